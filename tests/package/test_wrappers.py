"""Gymnasium's vector wrappers over the native batch."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.wrappers import vector as wrappers

GYMNASIUM = tuple(map(int, gym.__version__.split(".")[:2]))


def roll(env, steps=25):
    """Results of random actions after a seeded reset."""
    env.action_space.seed(0)
    return [env.reset(seed=0), *(env.step(env.action_space.sample()) for _ in range(steps))]


@pytest.mark.parametrize(
    "wrap",
    [
        wrappers.RecordEpisodeStatistics,
        wrappers.NormalizeReward,
        wrappers.NormalizeObservation,
        wrappers.FlattenObservation,
        wrappers.ClipAction,
        wrappers.DictInfoToList,
        lambda env: wrappers.ClipReward(env, -1.0, 1.0),
        lambda env: wrappers.RescaleAction(env, -2.0, 2.0),
        lambda env: wrappers.RescaleObservation(env, 0.0, 1.0),
        lambda env: wrappers.DtypeObservation(env, np.float64),
    ],
)
def test_wrappers_run_in_the_default_mode(make, wrap):
    env = wrap(make(num_envs=3))
    for observation, *_ in roll(env):
        assert observation.shape == env.observation_space.shape


@pytest.mark.parametrize(
    "mode",
    [
        "NextStep",
        pytest.param("SameStep", marks=pytest.mark.skipif(GYMNASIUM < (1, 3), reason="wrong in Gymnasium before 1.3")),
    ],
)
def test_episode_statistics_are_right(make, mode):
    env = wrappers.RecordEpisodeStatistics(make(num_envs=2, autoreset_mode=mode))
    lengths = []
    for *_, infos in roll(env, 40)[1:]:
        source = infos.get("final_info", infos) if mode == "SameStep" else infos
        for record in (infos, source):
            if "episode" in record:
                lengths += record["episode"]["l"][record["_episode"]].tolist()
                break
    assert len(lengths) >= 6
    assert set(lengths) == {9}


def test_a_partial_reset_leaves_other_statistics_alone(make):
    """SyncVectorEnv takes the mask out of the caller's options, and the wrapper then clears all rows."""
    env = wrappers.RecordEpisodeStatistics(make(num_envs=4, autoreset_mode="Disabled"))
    env.reset(seed=0)
    for _ in range(3):
        env.step(np.zeros((4, 4)))
    env.reset(options={"reset_mask": np.array([True, False, False, False])})
    np.testing.assert_array_equal(env.episode_lengths, [0, 3, 3, 3])


def test_infos_as_a_list(make):
    env = wrappers.DictInfoToList(make(num_envs=2))
    _, infos = env.reset(seed=0)
    assert [set(info) for info in infos] == [set(infos[0])] * 2
    assert "time" in infos[0]


def test_videos_are_recorded(make, tmp_path):
    pytest.importorskip("moviepy")
    env = make(num_envs=2, render_mode="rgb_array")
    env = wrappers.RecordVideo(env, str(tmp_path), video_length=4, step_trigger=lambda step: step == 0)
    roll(env, 6)
    env.close()
    assert [path.suffix for path in tmp_path.glob("*.mp4")] == [".mp4"]


def test_single_wrappers_run():
    env = gym.make("SnakeField-v1", max_episode_steps=9)
    env = gym.wrappers.FrameStackObservation(gym.wrappers.RecordEpisodeStatistics(env), 3)
    env.reset(seed=0)
    infos = [env.step(env.action_space.sample())[4] for _ in range(9)]
    assert infos[-1]["episode"]["l"] == 9
