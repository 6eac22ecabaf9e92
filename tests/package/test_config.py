"""Bad input is an error that names the field, the value and what is admissible."""

from __future__ import annotations

import copy
import dataclasses
import functools
import inspect
import operator
import pickle

import gymnasium
import numpy as np
import pytest

import snake_env
from snake_env import (
    PD,
    ConfigError,
    Gait,
    Integrator,
    IOLinearizing,
    Noise,
    Patch,
    Picture,
    Randomization,
    Robot,
    Scene,
    Start,
    Stribeck,
    _native,
)
from snake_env.obstacles import Box, Circle, Polygon, Segment

NAN, INF = float("nan"), float("inf")

SECTIONS = [
    (Robot, "links", [1, 0, -3, 2.5, NAN, "eleven", None, True, 10**30]),
    *[
        (Robot, name, [0, -1.0, NAN, INF, "x", [1.0] * 10, None])
        for name in ("length", "radius", "mass", "inertia", "roll_inertia")
    ],
    (Robot, "contact_half_length", [-1e-9, NAN, [0.1] * 12, "x"]),
    (Robot, "cg_offset", [-0.061, 0.061, NAN, INF, [0.01] * 12, [0.07] * 11, "x", None]),
    (Robot, "backlash", [-0.1, 2.0, NAN, "x", None, [0.0] * 9, [[0.0] * 3] * 10]),
    (Robot, "kp", [-0.1, NAN, INF, "x", [1.0] * 9]),
    (Robot, "kd", [-0.1, NAN, INF, "x", [[1.0, -1.0]] * 10]),
    (Robot, "torque_limit", [0.0, NAN, "x", [1.0] * 11]),
    (Robot, "friction_factor", [-0.1, NAN, INF, "x", None, [1.0] * 10]),
    (Robot, "self_contact", [2, "x", 0.5]),
    (Robot, "link_friction", [-0.1, NAN, INF, "x", None, [0.1] * 10]),
    (Robot, "joint_limit", [0.0, -1.0, NAN, "x", [1.0] * 9]),
    (Stribeck, "drop", [-0.1, 1.1, NAN, "x", None]),
    (Stribeck, "speed", [0.0, -1.0, NAN, INF, "x", None]),
    (Scene, "stribeck", [0.3, None, "x", {"drop": 0.3}]),
    (Robot, "gravity", [0.0, -9.81, NAN, INF, "x", [9.81] * 11]),
    (
        Scene,
        "obstacles",
        [3, "x", [(0.1, 0.2)], [(0.0, 1, 1)], [(-1, 1, 1)], [(0.1, NAN, 1)], [(0.1, 1, "y")]],
    ),
    (Scene, "friction", [0.2, (0.2,), (0.2, 0.2, 0.2), (-0.1, 0.2), (0.2, NAN), "x"]),
    (Scene, "friction_backward", [-0.1, NAN, INF, "x", (0.1, 0.1)]),
    (Scene, "rolling_friction", [-0.1, NAN, INF, "x", None, (0.02, 0.02)]),
    (Scene, "spin_friction", [-0.1, NAN, INF, "x", None, (0.02, 0.02)]),
    (Scene, "viscous", [(-0.1, 0.0), (0.1,), (0.1, NAN), "x"]),
    (Scene, "slope", [0.1, (0.1,), (-0.1, 0.0), (1.6, 0.0), (NAN, 0.0), (0.1, INF), "x", None]),
    (Scene, "friction_law", ["sticky", None]),
    (Scene, "smoothing", [0.0, -1.0, NAN, "x"]),
    *[
        (Gait, name, [NAN, INF, "x", None, [1.0]])
        for name in (
            "amplitude",
            "omega",
            "beta",
            "gamma",
            "vertical_amplitude",
            "vertical_omega",
            "vertical_beta",
            "vertical_phase",
        )
    ],
    (Gait, "soft_start", [1, "yes", None]),
    *[(PD, name, [-1.0, NAN, INF, "x", None]) for name in ("kp", "kd", "active_from")],
    *[(IOLinearizing, name, [-1.0, NAN, INF, "x", None]) for name in ("kp", "kd", "active_from")],
    *[(kind, "torque_limit", [0.0, -1.0, NAN, "x"]) for kind in (PD, IOLinearizing)],
    *[(kind, "treatment", [0.0, -1.0, NAN, "explicit", None]) for kind in (PD, IOLinearizing)],
    *[
        (Noise, name, [-1.0, NAN, "x", None])
        for name in ("position", "heading", "joint_angle", "velocity", "yaw_rate", "joint_rate")
    ],
    (Integrator, "method", ["rk4", "Thesis", 1, None]),
    *[(Integrator, name, [0.0, -1.0, NAN, INF, "x"]) for name in ("step", "tolerance")],
    (Integrator, "max_iterations", [0, -1, 2.5, "x"]),
    (Integrator, "order", [0, 3, 1.5, "x"]),
    *[(Integrator, name, [0.0, -1.0, NAN, INF, "x"]) for name in ("step_tolerance", "impact_step")],
    (Integrator, "precision", ["finest", "", 1.0]),
]

BAD_SECTIONS = [(kind, name, value) for kind, name, values in SECTIONS for value in values]


@pytest.mark.parametrize(("kind", "name", "value"), BAD_SECTIONS)
def test_every_field_of_a_section_is_checked_where_it_is_made(kind, name, value):
    with pytest.raises(ConfigError) as caught:
        kind(**{name: value})
    section = kind._section
    assert caught.value.field.startswith(f"{section}.{name}"), caught.value
    assert caught.value.expected
    assert str(caught.value).startswith(f"{section}.{name}")


@pytest.mark.parametrize("name", ["step", "tolerance", "r_t", "r_h", "r_n", "r_v"])
@pytest.mark.parametrize("value", [0.0, -1.0, NAN, INF, "x"])
def test_the_numbers_of_the_thesis_method_are_checked(name, value):
    with pytest.raises(ConfigError, match=rf"^integrator\.{name} = .*: expected a finite number"):
        Integrator(method="thesis", **{name: value})


IMPLICIT_OPTIONS = {"order": 2, "step_tolerance": 1e-3, "impact_step": 1e-3, "precision": "fine"}
THESIS_OPTIONS = {"r_t": 1.0, "r_h": 0.02, "r_n": 0.2, "r_v": 0.1}
SHARED_OPTIONS = {"step": 1e-3, "tolerance": 1e-8, "max_iterations": 500}


@pytest.mark.parametrize(
    ("method", "own", "others"),
    [("implicit", IMPLICIT_OPTIONS, THESIS_OPTIONS), ("thesis", THESIS_OPTIONS, IMPLICIT_OPTIONS)],
)
def test_an_option_of_the_other_method_is_refused(method, own, others):
    Integrator(method=method, **SHARED_OPTIONS, **own)
    known = ", ".join([*SHARED_OPTIONS, *own])
    for name, value in others.items():
        message = rf'^integrator\.{name} = {value!r}: expected an option of method="{method}": {known}$'
        with pytest.raises(ConfigError, match=message):
            Integrator(method=method, **{name: value})
        with pytest.raises(ConfigError, match=message):
            _native.check("integrator", {name: value, "method": method})


def test_an_integrator_without_a_method_is_implicit():
    _native.check("integrator", {"order": 1})
    with pytest.raises(ConfigError, match=r'^integrator\.r_h = 0\.02: expected an option of method="implicit"'):
        _native.check("integrator", {"r_h": 0.02})
    with pytest.raises(ConfigError, match=r'^integrator\.ordre = 1: expected an option of method="implicit"'):
        _native.check("integrator", {"ordre": 1})


@pytest.mark.parametrize("option", [{"step_tolerance": 1e-6}, {"impact_step": 1e-4}])
def test_steps_of_first_order_are_all_alike(option):
    """In the core, too, the options of parts change nothing."""
    with pytest.raises(ConfigError, match=rf"^integrator\.{next(iter(option))} = .*: expected None with order=1"):
        Integrator(order=1, **option)
    scene = Scene.preset("table-7.5")
    for model in ("planar", "spatial"):
        runs = [
            snake_env.simulate(model, scene=scene, integrator={"order": 1, **own}, duration=0.5) for own in ({}, option)
        ]
        np.testing.assert_array_equal(runs[0].position, runs[1].position)


@pytest.mark.parametrize(("name", "outside"), [("max_iterations", 0), ("order", 3)])
@pytest.mark.parametrize("value", [True, 2.5, "x", 10**30])
def test_what_is_no_integer_has_the_range_of_integers(name, outside, value):
    expected = []
    for wrong in (value, outside):
        with pytest.raises(ConfigError, match=rf"^integrator\.{name} = ") as caught:
            Integrator(**{name: wrong})
        expected.append(caught.value.expected)
    assert expected[0] == expected[1]


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("position", ["x", None, (1.0,), (0.0, 0.0, 0.0, 0.0), (NAN, 0.0), (True, 0.0), ("1", "2")]),
        ("heading", [None, "x", NAN, INF, True, 1j]),
        ("posture", [5, None, "bent", [[0.0, 0.0, 0.0]], [NAN], [True, False], ["0.1"], [0.1, None]]),
        ("pitch", ["y", None, 1.6, NAN, True]),
        ("roll", ["z", INF, True]),
    ],
)
def test_a_start_is_checked_when_it_is_made(name, values):
    for value in values:
        with pytest.raises(ConfigError, match=rf"^start\.{name}.* = "):
            Start(**{name: value})


THESIS = Integrator(method="thesis")

BAD_SPATIAL = [
    ({"noise": Noise()}, "noise"),
    ({"controller": IOLinearizing()}, "controller"),
    ({"scene": Scene(viscous=(0.1, 0.1))}, "scene.viscous"),
    ({"scene": Scene(friction_law="arctan")}, "scene.friction_law"),
    ({"scene": Scene(stribeck=Stribeck(drop=0.1))}, "scene.stribeck.drop"),
    ({"robot": Robot(backlash=0.1)}, "robot.backlash"),
    ({"gait": Gait(amplitude=1.5, gamma=0.1)}, "gait.amplitude"),
    ({"gait": Gait(vertical_amplitude=-1.6)}, "gait.vertical_amplitude"),
    ({"start": {"position": (1.0,)}}, "start.position"),
    ({"start": {"position": (0.0, 0.0, NAN)}}, "start.position[2]"),
    ({"start": {"pitch": 1.6}}, "start.pitch"),
    ({"start": {"pitch": NAN}}, "start.pitch"),
    ({"start": {"roll": INF}}, "start.roll"),
    ({"start": {"posture": [(0.0, 0.0)] * 3}}, "start.posture"),
    ({"start": {"posture": [(0.0, NAN)] * 10}}, "start.posture"),
    ({"start": {"posture": [(0.0, 0.0, 0.0)] * 10}}, "start.posture"),
    ({"start": {"posture": [(0.0, 3.2)] * 10}}, "start.posture"),
]


@pytest.mark.parametrize(
    ("keywords", "field"),
    [
        ({"model": "cubic"}, "model"),
        ({"model": None}, "model"),
        ({"robot": {"link": 7}}, "robot.link"),
        ({"robot": Gait()}, "robot"),
        ({"gait": Gait(amplitude=40)}, "gait.amplitude"),
        ({"gait": Gait.sidewinding()}, "gait.vertical_amplitude"),
        ({"gait": Gait.lateral_rolling()}, "gait.vertical_amplitude"),
        ({"controller": Gait()}, "controller"),
        ({"start": {"position": (1.0,)}}, "start.position"),
        ({"start": {"position": (NAN, 0.0)}}, "start.position[0]"),
        ({"start": {"heading": INF}}, "start.heading"),
        ({"start": {"position": (0.0, 0.0, 0.1)}}, "start.position"),
        ({"start": {"pitch": 0.1}}, "start.pitch"),
        ({"start": {"roll": 0.1}}, "start.roll"),
        ({"model": "minimal", "start": {"pitch": 0.1}}, "start.pitch"),
        ({"start": {"posture": "curled"}}, "start.posture"),
        ({"start": {"posture": [0.0] * 3}}, "start.posture"),
        ({"start": {"posture": [NAN] * 10}}, "start.posture"),
        ({"duration": 0.0}, "duration"),
        ({"duration": NAN}, "duration"),
        ({"duration": 1e12}, "duration"),
        ({"duration": "5"}, "duration"),
        ({"sample": 0.0}, "sample"),
        ({"sample": 6.0}, "sample"),
        ({"noise": 0.1}, "noise"),
        ({"noise": Noise()}, "noise"),
        ({"controller": IOLinearizing(treatment=0.01)}, "controller.treatment"),
        ({"controller": PD(treatment="step")}, "controller.treatment"),
        ({"scene": Scene(viscous=(0.1, 0.1))}, "scene.viscous"),
        ({"scene": Scene(friction_law="arctan")}, "scene.friction_law"),
        ({"model": "minimal", "noise": 0.1}, "noise"),
        ({"model": "minimal", "scene": Scene.preset("table-7.5")}, "scene.obstacles"),
        ({"model": "minimal", "controller": Gait()}, "controller"),
        ({"model": "minimal", "scene": Scene(stribeck=Stribeck(drop=0.1))}, "scene.stribeck.drop"),
        ({"model": "minimal", "robot": Robot(backlash=0.1)}, "robot.backlash"),
        ({"integrator": THESIS, "robot": Robot(backlash=0.1)}, "robot.backlash"),
        ({"controller": IOLinearizing(), "robot": Robot(backlash=0.1)}, "robot.backlash"),
        (
            {"model": "minimal", "scene": Scene(friction_law="arctan"), "integrator": THESIS},
            "scene.friction_law",
        ),
        ({"model": "minimal", "start": {"posture": [0.0] * 3}}, "start.posture"),
        ({"model": "minimal", "gait": Gait.sidewinding()}, "gait.vertical_amplitude"),
        *[({"model": "spatial", "integrator": THESIS} | keywords, field) for keywords, field in BAD_SPATIAL],
        ({"seed": -1}, "seed"),
        ({"seed": 1.5}, "seed"),
    ],
)
def test_simulate_names_the_argument(keywords, field):
    with pytest.raises(ConfigError) as caught:
        snake_env.simulate(**keywords)
    assert caught.value.field.startswith(field), caught.value


def test_the_error_is_a_value_error_that_can_be_pickled():
    with pytest.raises(ValueError, match=r"robot\.mass = -1: expected a finite number > 0") as caught:
        Robot(mass=-1.0)
    copy = pickle.loads(pickle.dumps(caught.value))
    assert str(copy) == str(caught.value)
    assert (copy.field, copy.value) == ("robot.mass", "-1")


SECTION_KINDS = [Robot, Gait, PD, Integrator, Scene, Stribeck, Noise, Start, Randomization]


@pytest.mark.parametrize("kind", [kind for kind in SECTION_KINDS if kind is not Integrator])
def test_the_fields_and_defaults_of_a_section_are_those_of_the_core(kind):
    core = _native.defaults(kind._section)
    ours = {field.name: getattr(kind(), field.name) for field in dataclasses.fields(kind) if not field.metadata}
    assert list(ours) == [name for name in core if name != "law"] + ["law"] * ("law" in core)
    for name, value in ours.items():
        expected = dataclasses.asdict(value) if dataclasses.is_dataclass(value) else value
        assert expected == (tuple(core[name]) if isinstance(core[name], list) else core[name]), name


def test_the_fields_of_an_integrator_are_those_of_the_methods():
    implicit, thesis = _native.defaults("integrator"), _native.defaults("thesis_integrator")
    assert [field.name for field in dataclasses.fields(Integrator)] == list(implicit | thesis)
    assert (implicit["method"], thesis["method"]) == (Integrator().method, "thesis")
    assert list(implicit) == ["method", *SHARED_OPTIONS, *IMPLICIT_OPTIONS]
    assert list(thesis) == ["method", *SHARED_OPTIONS, *THESIS_OPTIONS]


@pytest.mark.parametrize("kind", [*SECTION_KINDS, IOLinearizing])
def test_sections_are_values(kind):
    one = kind()
    assert one == kind()
    assert pickle.loads(pickle.dumps(one)) == one
    assert eval(repr(one), {name: getattr(snake_env, name) for name in snake_env.__all__}) == one
    assert str(inspect.signature(kind)).startswith("(")
    assert hash(one) == hash(kind())


MUTABLE = [
    (Robot, {"links": 2, "mass": np.array([1.0, 2.0]), "limp": [0]}),
    (Scene, {"obstacles": [[0.1, 1.0, 0.0], {"shape": "box", "size": [1.0, 2.0], "x": 3.0, "y": 0.0}]}),
    (Scene, {"obstacles": np.ones((2, 3)), "slope": np.zeros(2)}),
    (Polygon, {"vertices": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]}),
    (Start, {"position": np.zeros(2), "posture": [[0.1, 0.2], [0.3, 0.4]]}),
    (Randomization, {"friction": [0.5, 1.5], "noise": {"heading": 0.1}}),
    (Gait, {"amplitude": np.float64(0.5)}),
    (Picture, {"size": [64, 64], "centre": [0.0, 1.0], "layers": ["links"]}),
]


@pytest.mark.parametrize(("kind", "given"), MUTABLE)
def test_a_section_keeps_nothing_that_the_caller_can_change(kind, given):
    one, other = kind(**given), kind(**copy.deepcopy(given))
    for value in given.values():
        if isinstance(value, np.ndarray):
            value[:] = -1.0
        elif isinstance(value, list):
            value.clear()
        elif isinstance(value, dict):
            value["heading"] = -1.0
    assert one == other
    assert hash(one) == hash(other)
    assert eval(repr(one), {**vars(snake_env), **vars(snake_env.obstacles)}) == one


def test_scenes_are_values():
    assert len({Scene.preset("table-7.5"), Scene.preset("table-7.5"), Scene.preset("free")}) == 2


def test_a_list_within_itself_is_refused():
    endless: list = []
    endless.append(endless)
    for make in (lambda: Scene(obstacles=endless), lambda: Robot(mass=endless), lambda: Start(posture=endless)):
        with pytest.raises(ConfigError):
            make()


def test_a_law_without_gains_has_its_own():
    layout = _native.layout({"controller": {"law": "io"}})["config"]["controller"]
    assert (layout["kp"], layout["kd"]) == (IOLinearizing().kp, IOLinearizing().kd)
    assert PD() != IOLinearizing(kp=PD().kp, kd=PD().kd)


def test_what_a_model_does_not_have_is_refused_with_what_it_needs():
    rows = {row["name"]: row for row in _native.capabilities()}
    assert rows["contact with pegs"] | {"planar": True, "spatial": True, "minimal": False} == rows["contact with pegs"]
    models = r"model=\"planar\" or model=\"spatial\" and method=\"implicit\""
    message = rf"robot\.backlash = 0\.1: expected 0: backlash of the joints needs {models}"
    thesis = Integrator(method="thesis")
    for keywords in ({"model": "spatial", "integrator": thesis}, {"model": "minimal"}, {"integrator": thesis}):
        with pytest.raises(ConfigError, match=message):
            snake_env.simulate(robot=Robot(backlash=0.1), **keywords)


@pytest.mark.parametrize("make", [snake_env.SnakeEnv, functools.partial(snake_env.SnakeVectorEnv, 2)])
@pytest.mark.parametrize("integrator", [Integrator(method="thesis"), {"method": "thesis", "step": 5e-4}])
def test_environments_have_the_implicit_method_only(make, integrator):
    needs = 'reinforcement learning needs model="planar" or model="spatial" and method="implicit"'
    with pytest.raises(ConfigError, match=rf'^integrator\.method = "thesis": expected "implicit": {needs}$'):
        make(integrator=integrator)


USES = {
    "contact with pegs": {"scene": Scene.preset("table-7.5")},
    "the Stribeck effect": {"scene": Scene(stribeck=Stribeck(drop=0.1))},
    "patches of other friction": {"scene": Scene(patches=[Patch([(0, 0), (1, 0), (0, 1)], 0.5)])},
    "friction that differs forward and backward": {"scene": Scene(friction_backward=0.3)},
    "obstacles of finite height": {"scene": Scene(obstacles=[Circle(0.1, 3.0, 3.0, height=0.1)])},
    "backlash of the joints": {"robot": Robot(backlash=0.1)},
    "gains and torque limits of each joint": {"robot": Robot(kp=[100.0] * 10)},
    "friction that differs from link to link": {"robot": Robot(friction_factor=[2.0, *[1.0] * 10])},
    "contact of the robot with itself": {"robot": Robot(self_contact=True)},
    "friction between links of the robot": {"robot": Robot(link_friction=0.2)},
    "limits of the joint angles": {"robot": Robot(joint_limit=1.2)},
    "input-output linearisation": {"controller": IOLinearizing()},
    "a torque held over steps or periods": {"controller": PD(treatment="step")},
    "noise on the controller's measurements": {"noise": Noise(heading=0.1)},
    "viscous friction": {"scene": Scene(viscous=(0.1, 0.1))},
    "a smooth friction law": {"scene": Scene(friction_law="arctan")},
    "a vertical wave": {"gait": Gait(vertical_amplitude=0.1)},
    "pitch and roll at the start": {"start": Start(pitch=0.1)},
}


@pytest.mark.parametrize("method", ["implicit", "thesis"])
@pytest.mark.parametrize("model", ["planar", "spatial", "minimal"])
@pytest.mark.parametrize("feature", USES)
def test_a_model_has_what_the_table_says_and_refuses_the_rest(feature, model, method):
    support = next(row[model] for row in _native.capabilities() if row["name"] == feature)
    arguments = {"model": model, "integrator": Integrator(method=method), "duration": 0.01, "sample": 0.01}
    if support is True or support == method:
        snake_env.simulate(**arguments, **USES[feature])
    else:
        with pytest.raises(ConfigError):
            snake_env.simulate(**arguments, **USES[feature])


def test_numpy_values_and_lists_are_welcome():
    masses = np.linspace(0.5, 0.7, 11)
    one = snake_env.simulate(robot=Robot(mass=masses, links=np.int64(11)), duration=0.1)
    other = snake_env.simulate(robot=Robot(mass=list(masses)), duration=0.1)
    np.testing.assert_array_equal(one.position, other.position)


def test_presets_are_the_thesis_courses():
    assert len(Scene.preset("table-7.3").obstacles) == 9
    scene = Scene.preset("table-7.5", friction=(0.1, 0.3))
    assert scene.obstacles[0] == (0.125, 0.051, 0.176)
    assert scene.friction == (0.1, 0.3)
    assert Scene.preset("free").obstacles == ()
    with pytest.raises(ConfigError, match=r"preset = 'table-7\.4'"):
        Scene.preset("table-7.4")


def test_obstacles_are_numbered_from_one():
    scene = Scene.preset("table-7.5")
    assert scene.without(1).obstacles == scene.obstacles[1:]
    radius, x, y = scene.obstacles[2]
    assert scene.moved(3, 0.0, 0.105).obstacles[2] == (radius, x, y + 0.105)
    assert scene.moved(3, 0.0, 0.105).course == scene.without(3).course == "table-7.5"
    for j in (0, 8, -1):
        with pytest.raises(ConfigError, match=rf"obstacle = {j}: expected an integer in \[1, 7\]"):
            scene.without(j)
        with pytest.raises(ConfigError):
            scene.moved(j, 0.1, 0.1)


def test_a_start_on_a_course_needs_a_course():
    assert Start.on_course(Scene.preset("table-7.3")).heading == pytest.approx(3.930049541055)
    with pytest.raises(ConfigError, match=r"scene\.course"):
        Start.on_course(Scene())


def test_a_course_has_a_start_for_each_model():
    scene = Scene.preset("table-7.5")
    planar, spatial = Start.on_course(scene), Start.on_course(scene, "spatial")
    assert 1e-3 < abs(planar.position[1] - spatial.position[1]) < 0.02
    with pytest.raises(ConfigError, match="model"):
        Start.on_course(scene, "minimal")


def test_gaits_take_keywords_over_the_thesis_values():
    degree = np.pi / 180
    gait = Gait.lateral_undulation(beta=-70 * degree, soft_start=True)
    assert (gait.amplitude, gait.beta, gait.soft_start) == (40 * degree, -70 * degree, True)
    winding = Gait.sidewinding(omega=1.0)
    assert (winding.omega, winding.vertical_omega, winding.vertical_beta) == (1.0, 1.0, winding.beta)
    lifting = Gait.sinus_lifting(omega=1.0)
    assert (lifting.omega, lifting.vertical_omega, lifting.vertical_beta) == (1.0, 2.0, 2 * lifting.beta)
    crawling = Gait.caterpillar(omega=1.0)
    assert (crawling.amplitude, crawling.vertical_omega, crawling.vertical_phase) == (0.0, 1.0, 0.0)
    rolling = Gait.lateral_rolling(amplitude=0.2)
    assert (rolling.vertical_amplitude, rolling.vertical_phase, rolling.beta) == (0.2, 90 * degree, 0.0)


def leaves(tree, path=()):
    """Paths of all values of a configuration that hold no others."""
    items = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, (list, tuple)) else ()
    below = [leaf for key, item in items for leaf in leaves(item, (*path, key))]
    return below or [path]


def replaced(tree, path, value):
    """A copy of a configuration with another value at ``path``."""
    if not path:
        return value
    copy = dict(tree) if isinstance(tree, dict) else list(tree)
    copy[path[0]] = replaced(tree[path[0]], path[1:], value)
    return copy


SHAPES = [
    Circle(0.1, 1.0, 1.0, friction=0.2),
    Box((0.5, 0.2), 3.0, 1.0, angle=0.3),
    Segment((5.0, 5.0), (6.0, 5.0)),
    Polygon(((7.0, 7.0), (8.0, 7.0), (7.0, 8.0))),
]


@pytest.mark.parametrize("value", [INF, -INF, NAN, None, 5e-324, 0.1 + 0.2, 1, True, "x", [], [INF, NAN]])
def test_every_field_of_a_configuration_is_refused_or_comes_back_as_it_was_given(value):
    whole = _native.layout({"scene": Scene(obstacles=SHAPES)})["config"]
    assert _native.layout(whole)["config"] == whole
    kept = []
    for path in leaves(whole):
        try:
            config = _native.layout(replaced(whole, path, value))["config"]
        except ConfigError:
            continue
        assert functools.reduce(operator.getitem, path, config) == value, path
        assert _native.layout(config)["config"] == config, path
        kept.append(path)
    if value == INF:
        assert kept == [("robot", "joint_limit"), ("robot", "torque_limit")]


def test_an_infinite_joint_limit_reaches_environments():
    folded = [0.9, 2.0, 2.0, *[0.0] * 7]
    robot = {"joint_limit": INF, "self_contact": False}
    env = snake_env.SnakeEnv(task="free", robot=robot, start=Start(posture=folded), action_mode="torques")
    env.reset(seed=0)
    for one in (env, pickle.loads(pickle.dumps(env))):
        one.step(np.zeros(10))
        np.testing.assert_allclose(one.state().joint_angle, folded, atol=1e-3)


def test_joints_without_limits_are_given_by_an_infinite_one():
    folded = np.array([0.9, 2.0, 2.0, *[0.0] * 7])
    limp = {"controller": PD(kp=0.0, kd=0.0), "self_contact": False, "duration": 0.05, "sample": 0.05}
    free, limited = (
        snake_env.simulate(robot=Robot(joint_limit=limit), start=Start(posture=folded), **limp) for limit in (INF, None)
    )
    assert abs(free.joint_angle[-1] - folded).max() < 1e-9
    assert limited.joint_angle[-1].max() < 1.99
    gymnasium.make_vec("SnakeFree-v1", num_envs=1, robot={"joint_limit": INF}).close()


@pytest.mark.parametrize(("section", "value"), [(Robot, 0.1), (Randomization, (0.0, 0.1))])
def test_backlash_has_a_deprecated_name(section, value):
    now, options = section(backlash=value), {section.__name__.lower(): {"free_play": value}}
    with pytest.warns(DeprecationWarning, match="backlash"):
        assert section(free_play=value) == now
    with pytest.warns(DeprecationWarning, match="backlash"):
        assert section.of({"free_play": value}) == now
    with pytest.warns(DeprecationWarning, match="backlash"):
        assert now.free_play == value
    with pytest.raises(TypeError, match="backlash"), pytest.warns(DeprecationWarning, match="backlash"):
        section(free_play=value, backlash=value)
    assert copy.deepcopy(now) == pickle.loads(pickle.dumps(now)) == now
    read = snake_env.SnakeEnv(task="free", **options).layout["config"]
    assert read == snake_env.SnakeEnv(task="free", **{section.__name__.lower(): now}).layout["config"]


def test_unconverged_solves_have_a_deprecated_name():
    run = snake_env.simulate(duration=0.1)
    with pytest.warns(DeprecationWarning, match="unconverged"):
        assert run.misses is run.unconverged
    infos = snake_env.SnakeVectorEnv(2, task="free").reset(seed=0)[1]
    np.testing.assert_array_equal(infos["misses"], infos["unconverged"])
