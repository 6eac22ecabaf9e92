"""The vector checker finds each kind of mistake that it looks for."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

from snake_env import SnakeVectorEnv
from snake_env.testing import check_vector_env


class Unbatched(SnakeVectorEnv):
    def __init__(self, **keywords):
        super().__init__(**keywords)
        self.observation_space = self.single_observation_space


class TextMode(SnakeVectorEnv):
    def __init__(self, **keywords):
        super().__init__(**keywords)
        self.metadata["autoreset_mode"] = "NextStep"


class SinglePrecisionReward(SnakeVectorEnv):
    def step(self, actions):
        observation, reward, *rest = super().step(actions)
        return observation, reward.astype(np.float32), *rest


class NoMasks(SnakeVectorEnv):
    def step(self, actions):
        *results, infos = super().step(actions)
        return *results, {name: values for name, values in infos.items() if not name.startswith("_")}


class ReusedBuffer(SnakeVectorEnv):
    def step(self, actions):
        observation, *rest = super().step(actions)
        self.buffer = getattr(self, "buffer", np.empty_like(observation))
        self.buffer[:] = observation
        return self.buffer, *rest


class IgnoredSeed(SnakeVectorEnv):
    def reset(self, *, seed=None, options=None):
        return super().reset(seed=None if seed is None else 0, options=options)


class PoppedMask(SnakeVectorEnv):
    def reset(self, *, seed=None, options=None):
        result = super().reset(seed=seed, options=options)
        (options or {}).pop("reset_mask", None)
        return result


class ForgottenRows(SnakeVectorEnv):
    def reset(self, *, seed=None, options=None):
        observation, infos = super().reset(seed=seed, options=options)
        if options:
            observation[~options["reset_mask"]] = 0.0
        return observation, infos


class RewardedReset(SnakeVectorEnv):
    def step(self, actions):
        observation, reward, *rest = super().step(actions)
        return observation, reward + 1e-9, *rest


class SharedRandomness(SnakeVectorEnv):
    def __deepcopy__(self, memo):
        return self


class NeverClosed(SnakeVectorEnv):
    def close(self):
        pass


@pytest.mark.parametrize(
    ("kind", "complaint"),
    [
        (Unbatched, "observation_space is not the batch"),
        (TextMode, "must be an AutoresetMode"),
        (SinglePrecisionReward, "rewards of step 0 must be an array"),
        (NoMasks, "lacks the boolean mask"),
        (ReusedBuffer, "share memory"),
        (IgnoredSeed, "the same seed alone"),
        (PoppedMask, "removed the mask"),
        (ForgottenRows, "rows outside reset_mask"),
        (SharedRandomness, "a deep copy and the original"),
        (NeverClosed, "reset works after close"),
        (RewardedReset, "NEXT_STEP, step 0"),
    ],
)
def test_each_mistake_is_found(kind, complaint):
    keywords = {"task": "field", "max_episode_steps": 6}
    with pytest.raises(AssertionError, match=complaint):
        check_vector_env(
            lambda **given: kind(**keywords, **given),
            lambda: gym.make("SnakeField-v1", max_episode_steps=6),
            steps=10,
        )


def test_gymnasiums_own_class_does_not_take_numpy_seeds():
    def make(num_envs, autoreset_mode):
        single = [lambda: gym.make("SnakeFree-v1", max_episode_steps=6)]
        return gym.vector.SyncVectorEnv(single * num_envs, autoreset_mode=autoreset_mode)

    with pytest.raises(AssertionError, match=r"reset does not take the seed"):
        check_vector_env(make, steps=10)
