"""Memory traces: running means of the observation as further inputs of a network, instead of recurrence.

The trace z of an element x of the observation follows z' = (x - z) / T. With one or two time constants T a network has
inputs that show whether the robot has moved lately, and on which links pegs have pushed. For such questions memory
traces are as good as windows of the past, and smaller (Eberhard, Muehlebach, Vernade 2025). They belong to the policy:
the environment, its observations and what scripted controllers see stay as they are.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env import _checks
from snake_env.errors import ConfigError

MOST_TIMES = 16
"""Time constants of a policy."""


def network_inputs(layout: dict[str, Any], times: Sequence[float]) -> list[str]:
    """Names of what a network sees: the elements of an observation, then their traces."""
    names = _names(layout)
    return names + [f"{names[k]}, over {float(time)} s" for time in times for k in remembered(layout)]


def time_constants(run: dict[str, Any]) -> tuple[float, ...]:
    """Time constants [s] of the traces of a policy, from the configuration in its file.

    Raises:
        ConfigError: they are none.
    """
    policy = _checks.kind("policy", run.get("policy", {}), dict, "a mapping")
    times = _checks.kind(
        "policy.memory", policy.get("memory", policy.get("traces", ())), list | tuple, "a list of times"
    )
    if len(times) > MOST_TIMES:
        raise ConfigError("policy.memory", f"{len(times)} times", f"at most {MOST_TIMES}")
    return tuple(_checks.positive(f"policy.memory[{k}]", time) for k, time in enumerate(times))


def _names(layout: dict[str, Any]) -> list[str]:
    return [f"{block['name']}: {element}" for block in layout["observation"] for element in block["elements"]]


def remembered(layout: dict[str, Any]) -> list[int]:
    """Indices of the remembered elements of the observation: the blocks marked "memory"."""
    blocks = [block for block in layout["observation"] if block["memory"]]
    return [k for block in blocks for k in range(block["start"], block["start"] + block["size"])]


class MemoryTraces:
    """The traces of a batch of robots.

    Args:
        layout: the environment's.
        times: time constants [s]; without any, observations are handed on as they are.
        num_envs: n.
    """

    def __init__(self, layout: dict[str, Any], times: Sequence[float], num_envs: int) -> None:
        self._places = remembered(layout)
        keep = [math.exp(-float(layout["control_period"]) / time) for time in times]
        self.keep = np.array(keep, np.float32)
        """Share of each trace that is left after a control period (times,)."""
        self._traces = np.zeros((num_envs, len(times), len(self._places)), np.float32)
        self._new = np.ones(num_envs, np.bool_)

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """What networks see (n, o + t), after the traces have moved on; those of a new episode begin at its start."""
        if self._traces.size:
            self._traces = self._after(observation, slice(None))
        self._new[:] = False
        return self._joined(observation, self._traces)

    def peek(self, observation: NDArray[np.float32], rows: NDArray[np.int64]) -> NDArray[np.float32]:
        """What networks would see of these robots' next observations (k, o), without moving on."""
        return self._joined(observation, self._after(observation, rows))

    @property
    def size(self) -> int:
        """Inputs of a network that the traces add."""
        return self._traces.shape[1] * self._traces.shape[2]

    def reset(self, rows: NDArray[np.bool_]) -> None:
        """The next observation of the robots in ``rows`` (n,) begins an episode."""
        self._new |= rows

    def state(self) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """The traces (n, times, remembered), and whose next observation begins an episode (n,)."""
        return self._traces, self._new

    def restore(self, traces: NDArray[np.float32], new: NDArray[np.bool_]) -> None:
        """Takes over what :meth:`state` returned."""
        self._traces, self._new = traces.copy(), new.copy()

    def _after(self, observation: NDArray[np.float32], rows: Any) -> NDArray[np.float32]:
        now = observation[:, None, self._places]
        before: NDArray[np.float32] = np.where(self._new[rows, None, None], now, self._traces[rows])
        return now + self.keep[:, None] * (before - now)

    def _joined(self, observation: NDArray[np.float32], traces: NDArray[np.float32]) -> NDArray[np.float32]:
        if not traces.size:
            return observation
        return np.concatenate([observation, traces.reshape(len(observation), -1)], axis=1)
