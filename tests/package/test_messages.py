"""What users read when something is not as it should be: names, counts, and what to do."""

from __future__ import annotations

import math
import shutil
import subprocess
import sys
import warnings
from inspect import signature
from pathlib import Path

import gymnasium as gym
import pytest

import snake_env
from snake_env import ConfigError, Gait, Integrator, Robot, SnakeEnv, SnakeVectorEnv, Start, _native
from snake_env.options import TaskOptions

ROOT = Path(__file__).parents[2]


class Angles:
    """References of one's own."""

    def angle(self, time):
        return [0.0] * 10

    rate = angle


@pytest.mark.parametrize("value", [5, "x", [1, 2], None])
@pytest.mark.parametrize(
    ("section", "words"),
    [
        ("integrator", "a snake_env.Integrator, or a mapping"),
        ("robot", "a snake_env.Robot, or a mapping"),
        ("randomization", "a snake_env.Randomization, or a mapping"),
        ("reward_weights", "a mapping"),
        ("perturbation", "a mapping"),
    ],
)
def test_the_error_of_a_section_of_the_wrong_kind_names_its_class(section, words, value):
    with pytest.raises(ConfigError, match=f"^{section} = .*: expected {words} of field names to values$"):
        SnakeVectorEnv(1, **{section: value})


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: SnakeVectorEnv(1, task=3), 'task = 3: expected one of "course", "field",'),
        (lambda: SnakeVectorEnv(1, randomization={"noise": 3}), "randomization.noise = 3: expected a snake_env.Noise"),
        (lambda: SnakeVectorEnv(1, friction=0.2), "friction = 0.2: expected 2 numbers"),
        (lambda: snake_env.simulate(start=Start(position=(1, 2, 3))), "start.position = .*: expected 2 numbers"),
        (
            lambda: snake_env.simulate(start=Start(posture=3)),
            'start.posture = 3: expected "gait", "straight" or a joint',
        ),
        (lambda: snake_env.PD(treatment=[1]), 'controller.treatment = .*: expected "implicit", "step" or a period'),
        (lambda: SnakeEnv(controller="io", control_period=-1), r"^control_period = -1: expected a number in"),
        (lambda: SnakeEnv(controller="io", control_period="x"), "control_period = 'x': expected a finite number"),
        (lambda: snake_env.simulate(noise={}), 'noise = {}: expected None: .* needs model="minimal"'),
        (lambda: snake_env.simulate(record=5), "record = 5: expected a name or a list of names"),
        (lambda: snake_env.Picture(layers="grid"), "picture.layers = 'grid': expected a list of names"),
        (lambda: snake_env.Picture(layers=5), "picture.layers = 5: expected a list of names"),
        (lambda: snake_env.Noise.table_7_4([]), r"noise.table_7_4 = \[\]: expected one of 'b', 'c', 'd'"),
        (lambda: snake_env.simulate(robot=5, gait=Angles()), "robot = 5: expected a snake_env.Robot, or a mapping"),
        (lambda: snake_env.simulate(robot={"link": 5}, self_contact=True), "robot.link = 5: expected a known field"),
        (lambda: snake_env.minimal.process_plant([True] * 13, [0.0] * 13), "q = .*: expected real numbers"),
        (lambda: snake_env.minimal.control_plant(["0"] * 10, [0.0] * 13), "phi = .*: expected real numbers"),
        (lambda: snake_env.minimal.process_plant([0.0] * 13, [0.0] * 13, 5), "robot = 5: expected a snake_env.Robot"),
        (lambda: snake_env.Scene().to_mjcf(robot=5), "robot = 5: expected a snake_env.Robot, or a mapping"),
        (lambda: snake_env.Scene().to_mjcf(start=5), "start = 5: expected a snake_env.Start"),
        (lambda: snake_env.Scene().to_mjcf(gait=5), "gait = 5: expected a snake_env.Gait, or a mapping"),
        (lambda: snake_env.Scene().to_mjcf(step=math.inf), "step = inf: expected a finite number > 0"),
        (lambda: SnakeVectorEnv(2).reset(seed=b"ab"), "seed = b'ab': expected an integer"),
        (lambda: snake_env.Robot(mass="x"), "robot.mass = 'x': expected a number, or a list of numbers"),
    ],
)
def test_the_error_of_a_value_of_the_wrong_kind_names_what_to_write(call, message):
    with pytest.raises(ConfigError, match=message):
        call()


@pytest.mark.parametrize(("name", "value"), [("num_envs", 4), ("num_threads", 1), ("autoreset_mode", "SameStep")])
def test_the_error_of_a_keyword_of_batches_names_where_it_belongs(name, value):
    with pytest.raises(ConfigError, match=f"{name} belongs to batches, gymnasium.make_vec; known are ") as caught:
        gym.make("SnakeField-v1", **{name: value})
    known = caught.value.expected.partition("known are ")[2].split(", ")
    taken = [one for one in signature(SnakeEnv).parameters if one != "options"]
    assert sorted(known) == sorted([*TaskOptions.__annotations__, *taken])


def test_the_error_of_a_misspelt_keyword_names_the_nearest():
    with pytest.raises(ConfigError, match=r"num_thread = 1: expected a known keyword, perhaps num_threads; ") as caught:
        gym.make_vec("SnakeField-v1", num_envs=2, num_thread=1)
    known = caught.value.expected.partition("known are ")[2].split(", ")
    taken = [one for one in signature(SnakeVectorEnv).parameters if one != "options"]
    assert sorted(known) == sorted([*TaskOptions.__annotations__, *taken])


@pytest.mark.parametrize(
    ("model", "largest", "words"),
    [
        ("planar", math.pi, r"\[-pi, pi\]"),
        ("minimal", math.pi, r"\[-pi, pi\]"),
        ("spatial", math.pi / 2, r"\[-pi/2, pi/2\]"),
    ],
)
def test_an_offset_too_large_for_any_amplitude_is_named_itself(model, largest, words):
    for gamma in (30, -30, math.nextafter(largest, 4.0), -math.nextafter(largest, 4.0)):
        with pytest.raises(ConfigError, match=rf"^gait\.gamma = {gamma}: expected an angle in {words}, in radians$"):
            snake_env.simulate(model, gait=Gait(gamma=gamma))
    with pytest.raises(ConfigError, match=r"^gait\.amplitude = 0\.69.* with the offset"):
        snake_env.simulate(model, gait=Gait(gamma=largest))
    with pytest.raises(ConfigError, match=r"^duration = 0"):  # which the core checks after the gait
        snake_env.simulate(model, gait=Gait(gamma=largest, amplitude=0.0), duration=0.0)


@pytest.mark.parametrize("wrong", [-1, 2.5, "x", None, True, 10**30])
@pytest.mark.parametrize(
    ("make", "below_or_above"),
    [
        (lambda links: Robot(links=links), [{"robot": {"links": 1}}, {"robot": {"links": 10_001}}]),
        (lambda links: SnakeVectorEnv(1, robot={"links": links}), [{"robot": {"links": 1}}]),
        (lambda pegs: SnakeVectorEnv(1, nearest_pegs=pegs), [{"nearest_pegs": 0}, {"nearest_pegs": 65}]),
        (lambda points: SnakeVectorEnv(1, push_points=points), [{"push_points": 5}]),
    ],
)
def test_the_error_of_what_is_no_count_names_the_range_of_the_core(make, below_or_above, wrong):
    with pytest.raises(ConfigError) as told:
        make(wrong)
    for config in below_or_above:
        with pytest.raises(ConfigError) as of_the_core:
            _native.layout(config)
        assert (told.value.field, told.value.expected) == (of_the_core.value.field, of_the_core.value.expected)


def test_without_the_compiled_core_the_error_of_the_import_names_how_to_get_it(tmp_path):
    shutil.copytree(ROOT / "snake_env", tmp_path / "snake_env", ignore=shutil.ignore_patterns("*.so", "*.pyd"))
    command = [sys.executable, "-c", "import snake_env"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "run `make build`" in done.stderr.splitlines()[-1]


def test_missed_solves_are_reported_once_with_their_number_and_a_remedy():
    few = Integrator(method="thesis", max_iterations=2)
    with pytest.warns(UserWarning, match="take a smaller Integrator.step") as caught:
        run = snake_env.simulate(scene=snake_env.Scene.preset("table-7.5"), integrator=few, duration=0.5)
    assert len(caught) == 1
    assert f"{run.unconverged.sum():.0f} solves ended before their tolerance" in str(caught[0].message)
    assert caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert snake_env.simulate(duration=0.5).unconverged.sum() == 0


@pytest.mark.parametrize("make", [SnakeEnv, SnakeVectorEnv])
def test_a_render_mode_is_one_of_the_known(make):
    env = make()
    env.render_mode = "rgb_array"
    with pytest.raises(ConfigError, match=r"^render_mode = 'ascii': expected one of None, 'human', 'rgb_array'"):
        env.render_mode = "ascii"
    assert env.render_mode == "rgb_array"
