"""Whatever is written into a configuration, it works or is rejected by name: no panic, no hang, no other exception."""

from __future__ import annotations

import contextlib
import dataclasses
import inspect
import math
import warnings
from collections.abc import Callable

import gymnasium
import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import snake_env
from snake_env import (
    PD,
    ConfigError,
    Gait,
    Integrator,
    IOLinearizing,
    JointTrajectory,
    Noise,
    Picture,
    Randomization,
    Robot,
    Scene,
    Start,
    Stribeck,
    _native,
    minimal,
)
from snake_env.errors import DivergenceError
from snake_env.obstacles import Box
from snake_env.options import TaskOptions

SECTIONS = [Robot, Scene, Stribeck, Gait, PD, IOLinearizing, Integrator, Noise, Randomization, Start]
FEW = settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
FEWER = settings(FEW, max_examples=40)

EDGES = [0, 1, -1, 2, 10**6, 2**31, 2**32, 2**63, 2**64, 10**30, 0.0, -0.0, 5e-324, 1e-300, 1e300, math.inf, -math.inf]
numbers = st.sampled_from(EDGES) | st.floats() | st.integers() | st.floats(0.0, 10.0)
arrays = st.lists(st.floats(width=32), max_size=12).map(np.array)
scalars = st.none() | st.booleans() | numbers | st.text(max_size=8) | st.binary(max_size=4) | st.complex_numbers()
lists = st.lists(numbers, max_size=12) | st.lists(st.lists(numbers, min_size=3, max_size=3), max_size=4)
dicts = st.dictionaries(st.text(max_size=8), numbers, max_size=3)
junk = scalars | lists | dicts | arrays | st.sets(st.integers(), max_size=2) | st.just(object())
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=8,
)


def names(kind: type) -> list[str]:
    return [field.name for field in dataclasses.fields(kind) if field.init]


def some_of(kind: type) -> st.SearchStrategy[dict]:
    return st.dictionaries(st.sampled_from(names(kind)), junk, min_size=1, max_size=3)


def rejection(call: Callable[[], object]) -> ConfigError | None:
    """The error by which bad input is rejected, if it is; any other exception is a failure."""
    try:
        call()
    except ConfigError as error:
        return error
    return None


def check_rejection(call: Callable[[], object]) -> None:
    error = rejection(call)
    assert error is None or (error.field and error.expected and str(error).startswith(error.field))


@pytest.mark.parametrize("kind", SECTIONS)
def test_a_section_is_made_or_names_its_field(kind):
    @FEW
    @given(some_of(kind))
    @example({"step": 5e-324} if kind is Integrator else {})
    @example({"step": 1e300} if kind is Integrator else {})
    def check(values):
        error = rejection(lambda: kind(**values))
        named = [f"{kind._section}.{name}" for name in values]
        assert error is None or (error.expected and error.field.startswith(tuple(named))), error

    check()


@pytest.mark.parametrize("section", sorted({kind._section for kind in SECTIONS}))
def test_the_core_takes_any_object(section):
    @FEW
    @given(json_values | junk)
    def check(value):
        check_rejection(lambda: _native.check(section, value))

    check()


@pytest.mark.parametrize("entry", [_native.layout, _native.simulate])
def test_the_core_takes_any_mapping(entry):
    @FEW
    @given(json_values | junk)
    def check(value):
        error = rejection(lambda: entry(value))
        assert error is None or error.expected

    check()


# Small enough to be run when it happens to be admissible.
SHORT = {"duration": 0.1, "sample": 0.1}


class OwnReference:
    """A joint reference by functions of time; what they return may be anything."""

    def __init__(self, value):
        self.angle = self.rate = lambda time: value


ARGUMENTS = list(inspect.signature(snake_env.simulate).parameters)
REFERENCES = st.builds(OwnReference, junk) | st.just(OwnReference([0.0] * 10))
FIELDS = {"robot": Robot, "scene": Scene, "gait": Gait, "start": Start}
anything = junk | json_values | REFERENCES


@FEW
@given(st.dictionaries(st.sampled_from(ARGUMENTS), anything, max_size=3))
@example({"reference_rate": 10, "duration": math.nan})
@example({"reference_rate": 10, "duration": math.inf})
@example({"robot": {"links": 5}, "self_contact": True})
@example({"robot": 5, "gait": OwnReference([0.0] * 10)})
@example({"record": 5})
def test_simulate_takes_any_arguments(values):
    arguments = SHORT | values
    # An admissible duration of years is work, not a defect.
    if isinstance(arguments["duration"], int | float) and 1.0 < arguments["duration"] < math.inf:
        arguments["duration"] = 1.0
    if isinstance(arguments["sample"], int | float) and 0.0 < arguments["sample"] < 1e-3:
        arguments["sample"] = 1e-3
    check_rejection(lambda: snake_env.simulate(**arguments))


@pytest.mark.parametrize("section", FIELDS)
def test_simulate_takes_any_fields(section):
    @FEWER
    @given(some_of(FIELDS[section]))
    def check(fields):
        # Ten thousand links are admissible, and no defect.
        if isinstance(fields.get("links"), int | float):
            fields["links"] = min(fields["links"], 20)
        check_rejection(lambda: snake_env.simulate(**{section: fields}, **SHORT))

    check()


METHODS = {
    "Gait.reference": (Gait().reference, 4),
    "JointTrajectory": (JointTrajectory, 3),
    "JointTrajectory.reference": (JointTrajectory([0.0, 1.0], np.zeros((2, 3))).reference, 2),
    "Scene.without": (Scene.preset("table-7.5").without, 1),
    "Scene.moved": (Scene.preset("table-7.5").moved, 3),
    "Scene.from_fields": (Scene.from_fields, 1),
    "Scene.to_mjcf": (Scene().to_mjcf, 5),
    "Noise.table_7_4": (Noise.table_7_4, 1),
    "Start": (Start, 5),
    "Start.on_course": (Start.on_course, 2),
    "Picture": (Picture, 5),
    "IOLinearizing.for_period": (IOLinearizing.for_period, 1),
    "minimal.process_plant": (minimal.process_plant, 4),
    "minimal.control_plant": (minimal.control_plant, 4),
    "Box.moved": (Box((1.0, 1.0), 0.0, 0.0).moved, 2),
}


@pytest.mark.parametrize("name", METHODS)
def test_public_methods_take_any_arguments(name):
    call, count = METHODS[name]
    required = {"Gait.reference": 1, "Scene.moved": 3, "Box.moved": 2, "Start": 0, "Picture": 0, "Scene.to_mjcf": 0}
    fewest = required.get(name, 2 if "plant" in name or name == "JointTrajectory" else 1)

    @FEWER
    @given(st.lists(anything, min_size=fewest, max_size=count))
    def check(arguments):
        check_rejection(lambda: call(*arguments))

    check()


positive = st.floats(1e-6, 1e6)


@st.composite
def admissible(draw):
    """Sections that are accepted, over all decades."""
    links = draw(st.integers(2, 12))
    per_link = positive | st.lists(positive, min_size=links, max_size=links)
    length, radius = draw(positive), draw(positive)
    methods = [{"method": "implicit", "order": 1}, {"method": "implicit", "order": 2}, {"method": "thesis"}]
    integrator = draw(st.sampled_from(methods))
    offset = 0.0 if integrator["method"] == "thesis" else draw(st.floats(-0.49, 0.49)) * length
    robot = Robot(
        links=links,
        mass=draw(per_link),
        inertia=draw(per_link),
        length=length,
        cg_offset=offset,
        radius=radius,
        # Links that overlap in the straight robot cannot touch each other.
        self_contact=None if length > Robot().contact_half_length + radius else False,
    )
    coordinate = st.floats(-1e3, 1e3)
    pegs = draw(st.lists(st.tuples(positive, coordinate, coordinate), max_size=5))
    mu = st.floats(0.0, 1e3)
    gains = st.floats(0.0, 1e9)
    limit = draw(st.none() | positive)
    return {
        "robot": robot,
        "scene": Scene(obstacles=pegs, friction=(draw(mu), draw(mu))),
        "controller": PD(kp=draw(gains), kd=draw(gains), torque_limit=limit),
        "gait": Gait(
            amplitude=draw(st.floats(-3.1, 3.1)), omega=draw(st.floats(-100, 100)), beta=draw(st.floats(-10, 10))
        ),
        "integrator": Integrator(**integrator, step=0.02, max_iterations=200),
    }


@FEWER
@given(admissible())
def test_what_is_accepted_runs_to_finite_numbers(sections):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a start inside a peg
        # The thesis's scheme may explode at such gains, and says so.
        with contextlib.suppress(DivergenceError):
            trajectory = snake_env.simulate(**sections, **SHORT)
            assert np.isfinite(trajectory.position).all()
            assert np.isfinite(trajectory.energy).all()


OPTIONS = list(TaskOptions.__annotations__)
KEYWORDS = ["max_episode_steps", "render_mode", "autoreset_mode", "num_threads", "reward_fn", "spelled_wrongly"]


@pytest.mark.parametrize("make", [snake_env.SnakeVectorEnv, snake_env.SnakeEnv])
def test_an_environment_is_made_or_names_its_keyword(make):
    @FEWER
    @given(st.dictionaries(st.sampled_from([*OPTIONS, *KEYWORDS]), junk, min_size=1, max_size=2))
    def check(options):
        # A thousand threads are admissible, and no defect.
        if isinstance(options.get("num_threads"), int | float):
            options["num_threads"] = min(options["num_threads"], 2)
        check_rejection(lambda: make(**options).close())

    check()


@FEWER
@given(junk)
def test_the_number_of_environments_is_checked(value):
    if isinstance(value, int | np.integer) and value > 100:
        value = 100
    check_rejection(lambda: gymnasium.make_vec("SnakeFree-v1", num_envs=value).close())


@FEWER
@given(st.sampled_from([*OPTIONS, "controller", "integrator", "robot"]), dicts | json_values)
def test_make_vec_takes_any_mapping(name, value):
    check_rejection(lambda: gymnasium.make_vec("SnakeField-v1", num_envs=2, **{name: value}).close())
