"""`snake_env.Batch` steps what environments step, by arrays that stay where they are."""

from __future__ import annotations

import re

import numpy as np
import pytest

import snake_env
from snake_env import Batch, ConfigError, SnakeVectorEnv
from snake_env.batch import DEFAULTS


def centre_and_half(batch):
    """Of the range of each command."""
    low, high = (np.array([one[end] for one in batch.layout["action"]]) for end in ("low", "high"))
    return 0.5 * (low + high), 0.5 * (high - low)


def random_commands(batch, rng):
    centre, half = centre_and_half(batch)
    return centre + half * rng.uniform(-0.5, 0.5, batch.command.shape)


def as_actions(batch):
    centre, half = centre_and_half(batch)
    return ((batch.command - centre) / half).astype(np.float32)


@pytest.mark.parametrize(
    "options",
    [
        {"scene": snake_env.Scene.preset("table-7.5")},
        {"task": "field", "action_mode": "gait"},
        {"model": "spatial", "action_mode": "velocities", "control_period": 0.01},
    ],
    ids=["joints on a course", "gait in a field", "velocities in 3D"],
)
def test_it_moves_as_the_environments_do(options):
    """Bit for bit, with randomised robots in place of parameters, through a partial reset and pushes."""
    options = {**DEFAULTS, **options}
    batch = Batch(5, seed=3, num_threads=2, **options)
    drawn = {"friction": (1.25, 1.25), "anisotropy": (2.0, 2.0), "mass": (0.9, 0.9), "torque_limit": (0.5, 0.5)}
    drawn |= {"backlash": (0.02, 0.02), "stribeck": (0.1, 0.1)}
    envs = SnakeVectorEnv(
        5, **options, randomization=drawn, autoreset_mode="Disabled", max_episode_steps=-1, termination=NO_EVENT
    )
    batch.friction[:] = 1.25, 2.5
    batch.mass[:], batch.torque_limit[:], batch.backlash[:], batch.stribeck[:] = 0.9, 0.5, 0.02, 0.1
    batch.reset(seed=3)
    envs.reset(seed=3)
    rng, some = np.random.default_rng(0), np.arange(5) % 2 == 0
    for k in range(12):
        batch.command[:] = random_commands(batch, rng)
        if k == 6:
            batch.reset(some)
            envs.reset(options={"reset_mask": some})
        if k == 8:
            impulse = np.full(batch.state["link_velocity"].shape[1:], 0.05)
            batch.push(impulse, some)
            envs.push(impulse, some)
        batch.step()
        *_, infos = envs.step(as_actions(batch))
        state = envs.state()
        for name, values in batch.state.items():
            np.testing.assert_array_equal(values, getattr(state, name), err_msg=f"{name} in step {k}")
        for name in ("residual", "energy", "diverged", "contacts"):
            np.testing.assert_array_equal(batch.info[name], infos[name], err_msg=f"{name} in step {k}")
    assert abs(batch.state["joint_rate"]).max() > 0.01


NO_EVENT = {"is_success": False, "left_corridor": False}


def test_arrays_are_bound_once():
    batch = Batch(3, state=["time", "joint_angle"])
    kept = [batch.command, batch.friction, *batch.state.values(), *batch.info.values()]
    before = batch.state["joint_angle"].copy()
    batch.command[:] = 0.2
    batch.step(4)
    batch.reset(np.array([True, False, False]))
    now = [batch.command, batch.friction, *batch.state.values(), *batch.info.values()]
    assert all(one is other for one, other in zip(kept, now, strict=True))
    np.testing.assert_array_equal(batch.state["time"], [0.0, 0.2, 0.2])
    assert (batch.state["joint_angle"][0] == before[0]).all()
    assert (batch.state["joint_angle"][1] != before[1]).any()
    assert (batch.command == 0.2).all()
    with pytest.raises(AttributeError, match=r"batch\.friction\[:\] = "):
        batch.friction = np.ones((3, 2))


def test_one_step_of_many_periods_is_as_many_steps():
    one, many = Batch(2), Batch(2)
    one.command[:] = many.command[:] = 0.3
    one.step(7)
    for _ in range(7):
        many.step()
    for name in one.state:
        np.testing.assert_array_equal(one.state[name], many.state[name])


def test_robots_outside_the_mask_stay():
    batch = Batch(3)
    batch.command[:] = 0.3
    before = batch.state["joint_angle"].copy()
    batch.step(3, np.array([False, True, False]))
    moved = (batch.state["joint_angle"] != before).any(axis=1)
    np.testing.assert_array_equal(moved, [False, True, False])


def test_each_robot_has_parameters_of_its_own():
    """On slippery ground a robot under the same references gets another way; its neighbour does as alone."""
    batch, alone = Batch(2), Batch(1)
    batch.friction[1] = 0.1
    for k in range(40):
        references = 0.7 * np.sin(0.07 * k - 0.87 * np.arange(10))
        batch.command[:] = alone.command[:] = references
        batch.step()
        alone.step()
    place = batch.state["link_position"]
    np.testing.assert_array_equal(place[0], alone.state["link_position"][0])
    assert abs(place[0] - place[1]).max() > 1e-3


def test_a_saved_robot_continues_in_another_row():
    batch = Batch(2)
    batch.command[:] = 0.3
    batch.friction[1] = 0.5
    batch.step(3)
    second = np.array([False, True])
    (saved,) = batch.save(second)
    batch.step(5)
    after = batch.state["link_position"][1].copy()
    batch.friction[0] = 0.5
    batch.load([saved], ~second)
    batch.step(5)
    np.testing.assert_array_equal(batch.state["link_position"][0], after)
    with pytest.raises(ConfigError, match="states = 1 states: expected 2 states"):
        batch.load([saved])


REFUSED = [
    (
        lambda b: b.command.__setitem__((2, 4), 2.0),
        "command[2, 4] = 2.0: expected joint_angle_5 in [-1.22173, 1.22173] rad",
    ),
    (lambda b: b.command.__setitem__((0, 0), np.nan), "command[0, 0] = nan: expected joint_angle_1 in"),
    (lambda b: b.friction.__setitem__((1, 1), -0.5), "friction[1, 1] = -0.5: expected 0 <= value <= 10"),
    (lambda b: b.mass.__setitem__(2, 0.0), "mass[2] = 0: expected 0.1 <= value <= 10"),
    (lambda b: b.mass.__setitem__(0, np.inf), "mass[0] = inf: expected a finite number"),
    (lambda b: b.torque_limit.__setitem__(0, 11.0), "torque_limit[0] = 11: expected 0.01 <= value <= 10"),
    (lambda b: b.backlash.__setitem__(1, 2.0), "backlash[1] = 2: expected 0 <= value <= 1.57"),
    (lambda b: b.stribeck.__setitem__(1, 1.5), "stribeck[1] = 1.5: expected 0 <= value <= 1"),
]


@pytest.mark.parametrize(("write", "message"), REFUSED, ids=[message.partition(" ")[0] for _, message in REFUSED])
def test_what_is_not_admissible_is_named_and_changes_nothing(write, message):
    batch = Batch(3)
    batch.command[:] = 0.1
    batch.step()
    before = {name: values.copy() for name, values in batch.state.items()}
    write(batch)
    with pytest.raises(ConfigError, match=re.escape(message)):
        batch.step()
    if not message.startswith("command"):
        with pytest.raises(ConfigError, match=re.escape(message)):
            batch.reset()
    for name, values in before.items():
        np.testing.assert_array_equal(batch.state[name], values)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Batch(0), "num_robots = 0"),
        (lambda: Batch(2, state=["where"]), "state[0] = 'where'"),
        (lambda: Batch(2, mass=2.0), "mass = 2.0"),
        (lambda: Batch(2, randomization={"friction": (0.5, 1.5)}), "randomization.friction"),
        (lambda: Batch(2).step(0), "periods = 0"),
        (lambda: Batch(2).step(mask=np.ones(3, bool)), "mask = shape (3,)"),
        (lambda: Batch(2).reset(seed=[1]), "seed = 1 seeds"),
        (lambda: Batch(2).reset(place=1), "options['place']"),
    ],
)
def test_bad_calls_are_refused(call, message):
    with pytest.raises(ConfigError) as refusal:
        call()
    assert str(refusal.value).startswith(message)


def test_it_has_few_methods():
    public = {name for name in vars(Batch) if not name.startswith("_")}
    assert public == {"reset", "step", "push", "save", "load"}
