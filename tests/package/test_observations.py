"""Privileged blocks, noise and delays of single blocks, obstacles and paths in the state."""

from __future__ import annotations

import numpy as np
import pytest

from snake_env import ConfigError, Randomization, Scene, SnakeEnv, SnakeVectorEnv

VARIED = Randomization(friction=(0.5, 1.5), anisotropy=(0.8, 1.2), mass=(0.8, 1.2), torque_limit=(0.7, 1.0))


def blocks(env, observation):
    """The unscaled values of each block (n, k)."""
    layout = env.unwrapped.layout["observation"]
    return {b["name"]: b["scale"] * observation[..., b["start"] : b["start"] + b["size"]] for b in layout}


def driven(env, steps=30, seed=0):
    """Observations and states (steps + 1) of a seed."""
    rng = np.random.default_rng(5)
    seen = [(env.reset(seed=seed)[0], env.state())]
    for _ in range(steps):
        actions = rng.uniform(-1.0, 1.0, (env.num_envs, env.single_action_space.shape[0])).astype(np.float32)
        seen.append((env.step(actions)[0], env.state()))
    return seen


def test_privileged_blocks_come_last_and_leave_the_others_as_they_are():
    plain = driven(SnakeVectorEnv(4, task="field", max_episode_steps=20))
    seeing = driven(SnakeVectorEnv(4, task="field", max_episode_steps=20, privileged=True))
    size = plain[0][0].shape[1]
    for (one, _), (other, _) in zip(plain, seeing, strict=True):
        np.testing.assert_array_equal(one, other[:, :size])
    assert seeing[0][0].shape[1] == size + 2 + 4 + 2 + 22 + 15


def test_privileged_blocks_tell_what_the_episode_has_drawn():
    """The mass shows in the kinetic energy, which is not observed."""
    env = SnakeVectorEnv(8, task="free", privileged=True, randomization=VARIED)
    observation, state = driven(env)[-1]
    hidden = blocks(env, observation)
    speed, spin = np.square(state.link_velocity).sum(axis=(1, 2)), np.square(state.link_angular_velocity).sum(axis=1)
    nominal = 0.5 * (7.5 / 11.0 * speed + 1.32e-3 * spin)
    np.testing.assert_allclose(1.0 + hidden["privileged_robot"][:, 0], state.energy / nominal, rtol=1e-5)
    assert np.ptp(hidden["privileged_friction"], axis=0).min() > 0.01
    assert (np.abs(hidden["privileged_friction"] / [0.2, 0.5] - 1.0) < 0.8).all()


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_privileged_forces_are_those_of_the_state(model):
    env = SnakeVectorEnv(
        4, model=model, task="course", privileged=True, perception="blind", observation_noise={"contact_force": 5.0}
    )
    for observation, state in driven(env, 60):
        ahead = -state.link_axis[..., :2]
        ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
        left = np.stack([-ahead[..., 1], ahead[..., 0]], axis=-1)
        force = state.contact_force[..., :2]
        expected = np.stack([(ahead * force).sum(axis=-1), (left * force).sum(axis=-1)], axis=-1)
        found = blocks(env, observation)["privileged_contact_force"].reshape(expected.shape)
        np.testing.assert_allclose(found, expected.clip(-320.0, 320.0), atol=1e-3)
    assert np.abs(expected).max() > 0.0


def test_blind_robots_have_critics_that_see():
    seeing = SnakeVectorEnv(3, task="field", perception="pegs")
    blind = SnakeVectorEnv(3, task="field", perception="blind", privileged=True, randomization={"peg_error": 0.1})
    np.testing.assert_allclose(
        blocks(seeing, seeing.reset(seed=0)[0])["pegs"],
        blocks(blind, blind.reset(seed=0)[0])["privileged_pegs"],
        atol=1e-6,
    )


def test_noise_disturbs_the_blocks_that_are_named_and_no_other():
    clean = driven(env := SnakeVectorEnv(4, task="free"))
    noisy = driven(SnakeVectorEnv(4, task="free", observation_noise={"joint_angle": 0.05, "heading": 0.0}))
    pairs = [(blocks(env, one), blocks(env, other)) for (one, _), (other, _) in zip(clean, noisy, strict=True)]
    errors = np.array([other["joint_angle"] - one["joint_angle"] for one, other in pairs])
    assert np.abs(errors).max() <= 0.05 + 1e-6
    # Uniform in [-a, a]: the variance is a^2 / 3, the mean of 1240 of them 0 within five standard deviations.
    assert errors.var() == pytest.approx(0.05**2 / 3.0, rel=0.15)
    assert abs(errors.mean()) < 5.0 * 0.05 / np.sqrt(3.0 * errors.size)
    for one, other in pairs:
        for name in set(one) - {"joint_angle"}:
            np.testing.assert_array_equal(one[name], other[name])


def test_a_late_block_is_that_of_some_periods_ago():
    clean = driven(env := SnakeVectorEnv(2, task="free"))
    late = driven(SnakeVectorEnv(2, task="free", observation_delay={"velocity": 0.15}))
    for k, (observation, _) in enumerate(late):
        found, present = blocks(env, observation), blocks(env, clean[k][0])
        then = blocks(env, clean[max(k - 3, 0)][0])
        np.testing.assert_array_equal(found["velocity"], then["velocity"])
        np.testing.assert_array_equal(found["joint_angle"], present["joint_angle"])


def test_obstacles_and_paths_are_part_of_the_state():
    scenes = [Scene(obstacles=[(0.1, 2.0, 0.0)]), Scene(obstacles=[(0.1, 2.0, 0.0), (0.2, 3.0, 1.0)])]
    env = SnakeVectorEnv(2, task="field")
    env.reset(seed=0, options={"scene": scenes, "goal": [None, {"path": [(0.0, 0.0), (1.0, 0.0), (2.0, 2.0)]}]})
    state = env.state()
    np.testing.assert_array_equal(state.obstacles[1], [(0.1, 2.0, 0.0), (0.2, 3.0, 1.0)])
    np.testing.assert_array_equal(state.obstacles[0], [(0.1, 2.0, 0.0), (np.nan,) * 3])
    np.testing.assert_array_equal(state.path[1], [(0.0, 0.0), (1.0, 0.0), (2.0, 2.0)])
    assert np.isnan(state.path[0]).all()


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"observation_noise": {"smell": 0.1}}, "observation_noise"),
        ({"observation_noise": {"heading": -0.1}}, r"observation_noise\.heading"),
        ({"observation_delay": {"heading": 10.0}}, r"observation_delay\.heading"),
        ({"observation_delay": {"smell": 0.1}}, "observation_delay"),
    ],
)
def test_noise_and_delay_are_refused_by_name(options, field):
    with pytest.raises(ConfigError, match=field):
        SnakeEnv(task="free", **options)
