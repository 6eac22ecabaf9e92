"""Robots by arrays: bound once, updated in place; no episodes, observations or rewards."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Unpack

from snake_env import _checks, _worlds
from snake_env._buffers import Mask, StepBuffers
from snake_env._robots import Functions, Options, Robots, RobotState
from snake_env._task import Task
from snake_env.config import Randomization
from snake_env.errors import ConfigError
from snake_env.options import TaskOptions

Array = NDArray[np.float64]

DEFAULTS: Mapping[str, Any] = MappingProxyType(
    {"task": "free", "action_mode": "joints", "start_jitter": 0.0, "observation_blocks": ("heading",)}
)
"""Where they differ from those of environments; nothing reads the observation."""

PARAMETERS = ("friction", "mass", "torque_limit", "backlash", "stribeck")
"""Arrays that take the place of the draws of :class:`snake_env.Randomization`."""

INTERRUPTED = "a call was interrupted: reset all robots"


class Batch:
    """n robots that programs read and write by arrays, over the core that steps :class:`snake_env.SnakeVectorEnv`.

    All arrays are made once and updated in place: a reference to one, or ``torch.from_numpy`` of it, stays valid. The
    arrays of commands and parameters belong to the caller, who writes into them, ``batch.friction[:2] = 0.5``; no call
    changes them. Every call checks them, and a refused one has changed nothing. There are no episodes: robots move on
    until they are reset. Equal, bit for bit, to a :class:`snake_env.SnakeVectorEnv` with the same options and actions.
    One batch belongs to one thread at a time; a call during a call of another thread raises an error.

    Args:
        num_robots: n, >= 1.
        state: names of the arrays in ``state``, those of :class:`snake_env.State` that all robots have.
        seed: of the first :meth:`reset`, which the constructor does.
        num_threads: as of :class:`snake_env.SnakeVectorEnv`.
        **options: as of :class:`snake_env.SnakeVectorEnv`, ``control_period`` among them; by default joint references
            are commanded on free ground, and robots start alike.

    Attributes:
        command: (n, a) float64, what robots are to do: by default the reference of each joint [rad]. With another
            ``action_mode`` what ``layout["action"]`` lists, in its units.
        state: float64 arrays (n, ...) by name, after the last call.
        info: arrays (n,) by name, what ``infos`` of environments report of the last control period, ``residual`` and
            ``diverged`` among them.
        friction: (n, 2) factors on the ground friction along and across links.
        mass: (n,) factor on mass and inertia of all links.
        torque_limit: (n,) factor on the largest torque of a joint.
        backlash: (n,) backlash of the joints beyond the robot's own [rad].
        stribeck: (n,) drop of friction in sliding beyond the ground's own.
        layout: what the elements of commands, state and info mean, with their units, and ``control_period`` [s].
    """

    def __init__(
        self,
        num_robots: int,
        *,
        state: Sequence[str] = ("time", "link_position", "link_velocity", "joint_angle", "joint_rate"),
        seed: int | Sequence[int] = 0,
        num_threads: int | None = None,
        **options: Unpack[TaskOptions],
    ) -> None:
        n = _checks.integer("num_robots", num_robots, 1)
        task = Task({**DEFAULTS, **options}, None, ["num_robots", "state", "seed", "num_threads"])
        _require_no_draws(task.config["randomization"])
        self._robots = Robots(task, n, num_threads, Functions())
        self._step = StepBuffers(n, task.observation_size, task.layout["signals"])
        self._action = np.zeros((n, len(task.layout["action"])), np.float32)
        self._low, self._high = (np.array([one[end] for one in task.layout["action"]]) for end in ("low", "high"))
        self.layout: Mapping[str, Any] = task.layout
        shapes = {one["name"]: one["shape"] for one in task.layout["state"]}
        names = _checks.names("state", state, list(shapes))
        self.state: Mapping[str, Array] = MappingProxyType({name: np.zeros((n, *shapes[name])) for name in names})
        self.info: Mapping[str, NDArray[Any]] = MappingProxyType(self._step.values)
        self.command: Array = np.tile(0.5 * (self._low + self._high), (n, 1))
        self.friction: Array = np.ones((n, 2))
        self.mass: Array = np.ones(n)
        self.torque_limit: Array = np.ones(n)
        self.backlash: Array = np.zeros(n)
        self.stribeck: Array = np.zeros(n)
        self._is_made = True
        self.reset(seed=seed)

    def __setattr__(self, name: str, value: Any) -> None:
        if hasattr(self, "_is_made"):
            raise AttributeError(f"arrays of a batch are bound once: write into them, batch.{name}[:] = ...")
        super().__setattr__(name, value)

    def reset(self, mask: Mask | None = None, seed: int | Sequence[int | None] | None = None, **where: Any) -> None:
        """Puts robots at their start.

        Args:
            mask: bool (n,), which robots; None: all.
            seed: robot ``i`` takes ``seed + i``, or entry ``i`` of a sequence; None: what its stream draws next.
            **where: ``scene``, ``start`` and ``goal``, as the options of a reset of an environment.

        Raises:
            ConfigError: names what is not admissible.
            ResetNeeded: a signal handler has ended an earlier call, and ``mask`` leaves robots out.
        """
        robots = self._robots
        _worlds.check_options(where, [])
        options = Options(_worlds.per_robot(where, robots.num_envs)) if where else None
        seeds = _checks.seeds(seed, robots.num_envs)
        rows = self._rows(mask)
        if robots.native.is_interrupted and not rows.all():
            raise ResetNeeded(INTERRUPTED)
        self._send_parameters()
        # Every robot has a seed since the first reset: nothing is drawn.
        robots.reset(rows, seeds, np.random.default_rng(0), options, self._step)
        self._send_parameters()
        self._read()

    def step(self, periods: int = 1, mask: Mask | None = None) -> None:
        """Moves robots on by some control periods under the present commands.

        A robot whose computation diverges stops there, and ``info["diverged"]`` tells.

        Args:
            periods: >= 1.
            mask: bool (n,), which robots; None: all.

        Raises:
            ConfigError: names the element of ``command`` or of a parameter, its value and its range.
            ResetNeeded: a signal handler has ended an earlier call.
        """
        periods, active = _checks.integer("periods", periods, 1), self._rows(mask)
        native, arrays = self._robots.native, self._step.arrays
        if native.is_interrupted:
            raise ResetNeeded(INTERRUPTED)
        self._send_parameters()
        self._take_commands(active)
        try:
            for _ in range(periods):
                native.step(self._action, active, arrays)
                if self.info["diverged"].any():
                    active = active & ~self.info["diverged"]
        finally:  # also where Ctrl-C ends it between two periods
            self._read()

    def push(self, impulse: ArrayLike, mask: Mask | None = None) -> None:
        """Changes the momentum of links by impulses, as :meth:`snake_env.SnakeVectorEnv.push`."""
        self._robots.push(impulse, np.flatnonzero(self._rows(mask)).tolist())
        self._read()

    def save(self, mask: Mask | None = None) -> list[RobotState]:
        """The robots in ``mask``, in order; commands and parameters are the caller's."""
        return [self._robots.get_state(i, False) for i in np.flatnonzero(self._rows(mask)).tolist()]

    def load(self, states: Sequence[RobotState], mask: Mask | None = None) -> None:
        """Continues the robots in ``mask`` from as many states; ``info`` stays that of the last control period.

        Raises:
            ConfigError: there are not as many, or one is of other options.
        """
        rows = np.flatnonzero(self._rows(mask)).tolist()
        if len(states) != len(rows):
            raise ConfigError("states", f"{len(states)} states", f"{len(rows)} states, one per robot in the mask")
        self._send_parameters()
        self._robots.set_states(states, rows)
        self._send_parameters()
        self._read()

    def _rows(self, mask: Mask | None) -> Mask:
        return self._robots.all_rows if mask is None else _checks.mask("mask", mask, self._robots.num_envs)

    def _send_parameters(self) -> None:
        """Refuses parameters before anything changes, and prevails over what episodes begin with."""
        self._robots.native.set_parameters((self.friction, self.mass, self.torque_limit, self.backlash, self.stribeck))

    def _take_commands(self, active: Mask) -> None:
        """Commands in their units become actions in [-1, 1]."""
        half = 0.5 * (self._high - self._low)
        np.divide(self.command - 0.5 * (self._high + self._low), half, out=self._action, casting="same_kind")
        refused = np.argwhere(~(np.abs(self._action) <= 1.0) & active[:, np.newaxis])
        if len(refused):
            row, entry = refused[0].tolist()
            about = self.layout["action"][entry]
            expected = f"{about['name']} in [{about['low']:.6g}, {about['high']:.6g}] {about['unit']}"
            raise ConfigError(f"command[{row}, {entry}]", self.command[row, entry], expected)

    def _read(self) -> None:
        self._robots.native.read(list(self.state), list(self.state.values()))


def _require_no_draws(randomization: Mapping[str, Any]) -> None:
    """What the arrays of parameters set is not drawn besides."""
    for name in (*PARAMETERS, "anisotropy"):
        if tuple(randomization[name]) != tuple(getattr(Randomization(), name)):
            array = "friction" if name == "anisotropy" else name
            raise ConfigError(f"randomization.{name}", repr(randomization[name]), f"none: write batch.{array}[:] = ...")
