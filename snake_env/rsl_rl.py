"""rsl_rl's ``VecEnv`` over the native batch; needs the extra ``rsl-rl``."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from snake_env._extras import extras
from snake_env.vector_env import SnakeVectorEnv, refuse_other_autoreset, refuse_others

with extras():
    import torch
    from rsl_rl.env import VecEnv
    from tensordict import TensorDict

LOGGED = ("is_success", "distance", "speed", "jam_ratio")
"""Signals of an episode's last step that rsl_rl logs as means over the episodes that end."""


def make(
    env_id: str = "SnakeField-v1", num_envs: int = 1, *, device: str = "cpu", seed: int | None = None, **options: Any
) -> RslRlEnv:
    """A native batch as an rsl_rl ``VecEnv``.

    Args:
        env_id: a registered id of this package.
        num_envs: number of robots.
        device: of the tensors; the simulator runs on the processor.
        seed: robot ``i`` takes ``seed + i``; None: whatever comes.
        **options: keywords of :class:`snake_env.SnakeVectorEnv`.

    Raises:
        ConfigError: the id is another package's, or an option is not admissible.
    """
    refuse_others(env_id)
    envs: Any = gym.make_vec(env_id, num_envs=num_envs, **options, autoreset_mode="SameStep")
    return RslRlEnv(envs, device, seed)


class RslRlEnv(VecEnv):
    """rsl_rl's view of a batch in SameStep mode.

    Observations have two groups: ``policy``, what a robot senses, and ``critic``, which with ``privileged=True`` also
    has what it cannot sense. ``extras`` has ``time_outs``, and where episodes end ``log`` with their mean signals.
    ``episode_length_buf`` counts steps; setting it does not change when an episode ends.
    """

    def __init__(self, env: SnakeVectorEnv, device: str = "cpu", seed: int | None = None) -> None:
        refuse_other_autoreset(env, "rsl_rl")
        self.env, self.device = env, device
        layout = env.unwrapped.layout
        self.cfg = layout["config"]
        self.num_envs, self.num_actions = env.num_envs, len(layout["action"])
        self.max_episode_length = int(self.cfg["max_episode_steps"])
        starts = (block["start"] for block in layout["observation"] if block["name"].startswith("privileged_"))
        self._sensed = next(starts, None)
        self.episode_length_buf = torch.zeros(self.num_envs, dtype=torch.long, device=device)
        self._observation, _ = env.reset(seed=seed)

    def get_observations(self) -> TensorDict:
        """The present observations, (n, o) in each group."""
        whole = torch.from_numpy(self._observation).to(self.device)
        groups = {"policy": whole[:, : self._sensed], "critic": whole}
        return TensorDict(groups, batch_size=[self.num_envs], device=self.device)

    def step(self, actions: Any) -> tuple[TensorDict, Any, Any, dict[str, Any]]:
        """One control period of all robots; those whose episodes end begin the next one.

        Args:
            actions: (n, a) in [-1, 1].

        Returns:
            observations, rewards (n,), dones (n,) and extras.
        """
        given = actions.detach().cpu().numpy()
        self._observation, reward, terminated, truncated, infos = self.env.step(given)
        ended = terminated | truncated
        self.episode_length_buf = torch.where(self._tensor(ended), 0, self.episode_length_buf + 1)
        more: dict[str, Any] = {"time_outs": self._tensor(truncated & ~terminated)}
        if ended.any():
            more["log"] = {f"/episode/{name}": float(infos["final_info"][name][ended].mean()) for name in LOGGED}
        reward = self._tensor(reward.astype(np.float32))
        return self.get_observations(), reward, self._tensor(ended).long(), more

    def _tensor(self, array: NDArray[Any]) -> Any:
        return torch.from_numpy(array).to(self.device)

    def close(self) -> None:
        """Closes the batch."""
        self.env.close()
