"""Joint references of the user's own."""

from __future__ import annotations

import math

import numpy as np
import pytest

import snake_env
from snake_env import ConfigError, Gait, JointTrajectory, Start

MODELS = ["planar", "spatial", "minimal"]
NAN = float("nan")


def sampled_gait(interval: float = 0.02, duration: float = 3.0, **changes) -> JointTrajectory:
    time = np.arange(0.0, duration + interval, interval)
    wave = Gait(**changes).reference(time)
    return JointTrajectory(time, wave["angle"], wave["rate"])


@pytest.mark.parametrize("model", MODELS)
def test_a_sampled_gait_moves_the_robot_as_the_gait_does(model):
    runs = [snake_env.simulate(model, gait=gait, duration=2.0) for gait in (Gait(), sampled_gait())]
    assert abs(runs[0].position - runs[1].position).max() < 2e-5
    assert abs(runs[0].position[-1] - runs[0].position[0]).max() > 0.01


def test_an_object_with_angles_and_rates_is_followed():
    class Wave:
        def angle(self, time):
            return 0.5 * np.sin(2.0 * time - 0.8 * np.arange(10))

        def rate(self, time):
            return np.cos(2.0 * time - 0.8 * np.arange(10))

    own = snake_env.simulate(gait=Wave(), duration=2.0)
    same = snake_env.simulate(gait=Gait(amplitude=0.5, omega=2.0, beta=-0.8), duration=2.0)
    assert abs(own.position - same.position).max() < 1e-6


def test_pitch_angles_lift_links_of_the_spatial_model():
    angle = np.zeros((3, 10, 2))
    angle[1:, 3:6, 1] = 0.3 * np.array([-0.5, 1.0, -0.5])
    runs = [
        snake_env.simulate("spatial", gait=gait, start=Start(posture="straight"), duration=2.0)
        for gait in (JointTrajectory([0.0, 1.0, 2.0], angle), JointTrajectory([0.0, 1.0, 2.0], angle[..., 0]))
    ]
    heights = [run.position[-1, :, 2] for run in runs]
    assert np.ptp(heights[0]) > 5e-3
    assert np.ptp(heights[1]) < 1e-6


def test_without_rates_the_reference_stays_between_its_samples():
    time = np.array([0.0, 0.3, 0.5, 1.0, 1.1, 2.0])
    angle = np.array([0.0, 0.0, 0.5, 0.5, -0.3, -0.2])[:, np.newaxis]
    reference = JointTrajectory(time, angle).reference(np.linspace(0.0, 2.0, 401))["angle"][:, 0]
    for k in range(5):
        inside = (np.linspace(0.0, 2.0, 401) >= time[k]) & (np.linspace(0.0, 2.0, 401) <= time[k + 1])
        low, high = sorted(angle[k : k + 2, 0])
        assert reference[inside].min() >= low - 1e-12
        assert reference[inside].max() <= high + 1e-12


def test_rates_that_are_not_given_are_those_of_scipy():
    interpolate = pytest.importorskip("scipy.interpolate")
    time = np.array([0.0, 0.2, 0.7, 1.0, 1.8, 2.0, 2.5])
    angle = np.cumsum(np.sin(5.0 * np.arange(21))).reshape(7, 3)
    at = np.linspace(0.0, 2.49, 100)
    ours = JointTrajectory(time, angle).reference(at)
    theirs = interpolate.PchipInterpolator(time, angle)
    np.testing.assert_allclose(ours["angle"], theirs(at), atol=1e-12)
    np.testing.assert_allclose(ours["rate"], theirs(at, 1), atol=1e-11)


def test_before_and_after_the_samples_the_joints_hold_their_angles():
    reference = JointTrajectory([1.0, 2.0], [[0.1], [0.4]]).reference([0.0, 0.99, 2.0, 5.0])
    np.testing.assert_allclose(reference["angle"][:, 0], [0.1, 0.1, 0.4, 0.4])
    np.testing.assert_array_equal(reference["rate"], 0.0)


@pytest.mark.parametrize("gait", [Gait(), sampled_gait()])
def test_a_late_reference_is_the_earlier_one(gait):
    late = snake_env.simulate(gait=gait, reference_delay=0.25, duration=2.0, start=Start(posture="straight"))
    expected = Gait().reference(2.0 - 0.25)["angle"][0]
    assert abs(late.joint_angle[-1] - expected).max() < 0.01


def test_joints_that_receive_ten_samples_a_second_lag_by_an_interval():
    slow = snake_env.simulate(reference_rate=10.0, duration=2.0, start=Start(posture="straight"))
    assert abs(slow.joint_angle[-1] - Gait().reference(1.9)["angle"][0]).max() < 0.01


@pytest.mark.parametrize("first", [1.7e9, 0.5, -1.0])
def test_samples_that_lie_outside_the_run_warn(first):
    """Times of a clock."""
    gait = JointTrajectory(first + np.array([0.0, 0.5, 1.0]), np.zeros((3, 10)))
    for rate in (None, 20.0):
        with pytest.warns(UserWarning, match=r"gait\.time, .* s, lies outside the run"):
            snake_env.simulate(gait=gait, reference_rate=rate, duration=0.5)


@pytest.mark.parametrize("first", [0.0, 0.4, -0.9])
def test_samples_of_which_some_lie_within_the_run_do_not(first, recwarn):
    snake_env.simulate(gait=JointTrajectory([first, first + 1.0], np.zeros((2, 10))), duration=0.5)
    assert not recwarn.list


BAD = [
    ({"time": [0.0], "angle": [[0.0]]}, "gait.time"),
    ({"time": [0.0, 0.0], "angle": [[0.0], [0.1]]}, "gait.time"),
    ({"time": [0.0, NAN], "angle": [[0.0], [0.1]]}, "gait.time"),
    ({"time": [[0.0, 1.0]], "angle": [[0.0], [0.1]]}, "gait.time"),
    ({"time": "x", "angle": [[0.0], [0.1]]}, "gait.time"),
    ({"time": [0.0, 1.0], "angle": [0.0, 0.1]}, "gait.angle"),
    ({"time": ["0", "1"], "angle": [[0.0], [0.1]]}, "gait.time"),
    ({"time": [0.0, 1.0], "angle": [[0.0j], [0.1]]}, "gait.angle"),
    ({"time": [0.0, 1.0], "angle": [[False], [0.1]]}, "gait.angle"),
    ({"time": [0.0, 1.0], "angle": [[0.0], [0.1, 0.2]]}, "gait.angle"),
    ({"time": [0.0, 1.0], "angle": [[0.0], [NAN]]}, "gait.angle[1, 0]"),
    ({"time": [0.0, 1.0], "angle": np.zeros((3, 10))}, "gait.angle"),
    ({"time": [0.0, 1.0], "angle": np.zeros((2, 10, 3))}, "gait.angle"),
    ({"time": [0.0, 1.0], "angle": np.zeros((2, 10)), "rate": np.zeros((2, 9))}, "gait.rate"),
]


@pytest.mark.parametrize(("fields", "wrong"), BAD)
def test_samples_that_are_not_admissible_are_refused(fields, wrong):
    with pytest.raises(ConfigError) as caught:
        JointTrajectory(**fields)
    assert caught.value.field.startswith(wrong)
    assert caught.value.expected


@pytest.mark.parametrize(
    ("model", "angle", "message"),
    [
        ("planar", np.zeros((2, 9)), "9 joints: expected 10 joints"),
        ("planar", np.zeros((2, 10, 2)), "one angle per joint"),
        ("planar", np.full((2, 10), 3.2), "expected angles in"),
        ("spatial", np.full((2, 10), 1.6), "expected angles in"),
        ("minimal", np.zeros((2, 11)), "11 joints: expected 10 joints"),
    ],
)
def test_a_trajectory_that_does_not_fit_the_robot_is_refused(model, angle, message):
    with pytest.raises(ConfigError, match=message):
        snake_env.simulate(model, gait=JointTrajectory([0.0, 1.0], angle), start=Start(posture="straight"))


@pytest.mark.parametrize(
    "keywords",
    [
        *({"reference_rate": rate} for rate in (0.0, "x", True, math.nan)),
        *({"reference_delay": delay} for delay in (-0.1, math.inf, False, "x", None, np.zeros(2))),
    ],
)
def test_rates_and_delays_that_are_not_admissible_are_refused(keywords):
    (name,) = keywords
    with pytest.raises(ConfigError, match=rf"^{name} = "):
        snake_env.simulate(duration=0.1, **keywords)


@pytest.mark.parametrize("duration", [math.nan, math.inf, "a", -1, 1e300, None])
def test_a_reference_at_a_rate_needs_a_duration(duration):
    with pytest.raises(ConfigError, match=r"^duration = "):
        snake_env.simulate(reference_rate=10, duration=duration)


def test_a_rate_may_be_an_integer_of_numpy_and_a_gait_a_mapping():
    one = snake_env.simulate(reference_rate=np.int64(10), gait={"amplitude": 0.5}, duration=0.1)
    other = snake_env.simulate(reference_rate=10.0, gait=Gait(amplitude=0.5), duration=0.1)
    np.testing.assert_array_equal(one.position, other.position)


def test_a_trajectory_keeps_copies_that_nobody_changes():
    time, angle, rate = np.arange(2.0), np.zeros((2, 10)), np.zeros((2, 10))
    trajectory = JointTrajectory(time, angle, rate)
    angle[:] = 5.0
    assert not np.any(trajectory.angle)
    for array in (trajectory.time, trajectory.angle, trajectory.rate):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        (("0.5", 3), "time"),
        ((True, 3), "time"),
        ((math.nan, 3), "time"),
        (([[0.0]], 3), "time"),
        ((0.0, -1), "joints"),
        ((0.0, 2.5), "joints"),
        ((0.0, 10**15), "joints"),
        ((0.0, 3, "up"), "vertical"),
        ((0.0, 3, False, "a"), r"gait\.start_up"),
        ((0.0, 3, False, -1.0), r"gait\.start_up"),
    ],
)
def test_a_reference_names_its_argument(arguments, field):
    with pytest.raises(ConfigError, match=f"^{field} = "):
        Gait().reference(*arguments)
    if field in ("time", "vertical"):
        time, _, *rest = arguments
        with pytest.raises(ConfigError, match=f"^{field} = "):
            JointTrajectory([0.0, 1.0], np.zeros((2, 3))).reference(time, *rest[:1])
