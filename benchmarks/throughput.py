"""Measure environment steps per second of the native batch, and the cost of the interface.

    python -m benchmarks.throughput
    python -m benchmarks.throughput --env SnakeCourse-v1 --batches 64 256 --threads 1 2 --seconds 2
    python -m benchmarks.throughput --lanes 1 4 8 --batches 256 --threads 1

Robots take uniformly random actions, as at the start of learning, or follow the thesis's gait (the zero action).
Figures are medians over repetitions, taken in turn so that other work on the machine weighs on all alike; CPU time
counts all threads of the process and is what a busy machine disturbs least. The interface is the whole of ``step``
around the physics, timed with the physics replaced by nothing. Registers narrower than the processor's widest are
measured in processes of their own, in which the environment variable SNAKE_ENV_LANES prescribes them.
"""

from __future__ import annotations

import itertools
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

import snake_env.sb3
from snake_env import _native
from snake_env._files import write_json
from snake_env.evaluation.rollout import make_env
from snake_env.testing import remove_physics
from training.cli import answer
from training.runs import versions

Actions = Literal["random", "gait"]


@dataclass
class Options:
    """What is measured.

    Args:
        env: Environment.
        batches: Numbers of robots.
        threads: Numbers of threads.
        actions: "random" or "gait".
        lanes: Numbers of robots in a register; none: the widest that the processor has.
        seconds: Wall time of a repetition.
        repetitions: Of each case.
        out: JSON file.
    """

    env: str = "SnakeCourse-v1"
    batches: tuple[int, ...] = (1, 16, 64, 256)
    threads: tuple[int, ...] = (1, 2)
    actions: tuple[Actions, ...] = ("random", "gait")
    lanes: tuple[int, ...] = ()
    seconds: float = 0.5
    repetitions: int = 7
    out: Path = Path("runs/throughput.json")


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, measure, __doc__, arguments)


def measure(args: Options) -> int:
    """Measures, prints and writes the rates."""
    if args.lanes:
        return max(_measure_in_own_process(lanes) for lanes in args.lanes)
    cases = [Case(args.env, n, k, actions) for n in args.batches for k in args.threads for actions in args.actions]
    for _ in range(args.repetitions):
        for case in cases:
            case.repeat(args.seconds)
    rows = [case.row() for case in cases]
    print(f"{args.env}, {os.cpu_count()} cores, {_native.lanes()} robots per register\n{_table(rows)}\n")
    overheads = [overhead(args.env, n, args.repetitions) for n in args.batches]
    print(f"interface without physics\n{_table(overheads)}")
    args.out.parent.mkdir(parents=True, exist_ok=True)
    content = {
        "env": args.env,
        "cores": os.cpu_count(),
        "lanes": _native.lanes(),
        "versions": versions(),
        "stepping": rows,
        "interface": overheads,
    }
    write_json(args.out, content)
    return 0


def _measure_in_own_process(lanes: int) -> int:
    """The same command without ``--lanes`` at a given width; returns its exit status."""
    words = sys.argv[1:]
    first = words.index("--lanes")
    last = next((k for k in range(first + 1, len(words)) if words[k].startswith("--")), len(words))
    command = [sys.executable, "-m", "benchmarks.throughput", *words[:first], *words[last:]]
    return subprocess.run(command, env={**os.environ, "SNAKE_ENV_LANES": str(lanes)}, check=False).returncode


class Case:
    """One batch size, number of threads and kind of actions."""

    def __init__(self, env_id: str, num_envs: int, num_threads: int, actions: Actions) -> None:
        self._env = make_env(env_id, num_envs, num_threads, action_mode="gait")
        self._env.reset(seed=0)
        self._actions = self._cycle(actions)
        self._name = {"robots": num_envs, "threads": num_threads, "actions": actions}
        self._rates: list[float] = []
        self._cpu_rates: list[float] = []
        self.repeat(0.1)
        self._rates.clear()
        self._cpu_rates.clear()

    def _cycle(self, actions: Actions) -> Iterator[Any]:
        """Actions without end, drawn beforehand."""
        if actions == "gait":
            return itertools.repeat(np.zeros(self._env.action_space.shape, np.float32))
        self._env.action_space.seed(0)
        return itertools.cycle([self._env.action_space.sample() for _ in range(DRAWN_STEPS)])

    def repeat(self, seconds: float) -> None:
        """Steps for a while."""
        steps, start, cpu_start = 0, time.perf_counter(), time.process_time()
        while time.perf_counter() - start < seconds:
            self._env.step(next(self._actions))
            steps += self._env.num_envs
        self._rates.append(steps / (time.perf_counter() - start))
        self._cpu_rates.append(steps / (time.process_time() - cpu_start))

    def row(self) -> dict[str, Any]:
        """Medians, with the range over repetitions."""
        return {
            **self._name,
            "steps/s": round(statistics.median(self._rates)),
            "lowest": round(min(self._rates)),
            "highest": round(max(self._rates)),
            "steps/s of CPU": round(statistics.median(self._cpu_rates)),
        }


def overhead(env_id: str, num_envs: int, repetitions: int) -> dict[str, Any]:
    """CPU microseconds of a step whose physics does nothing, for both interfaces."""
    vector = make_env(env_id, num_envs, 1, action_mode="gait")
    learner = snake_env.sb3.make(env_id, num_envs, num_threads=1, action_mode="gait")
    vector.reset(seed=0)
    learner.reset()
    actions = np.zeros(vector.action_space.shape, np.float32)
    for env in (vector.unwrapped, learner.env.unwrapped):
        remove_physics(env)
    return {
        "robots": num_envs,
        "Gymnasium [us]": round(_microseconds(lambda: vector.step(actions), repetitions), 2),
        "SB3 [us]": round(_microseconds(lambda: learner.step(actions), repetitions), 2),
    }


def _microseconds(function: Callable[[], Any], repetitions: int, calls: int = 2000) -> float:
    """Median CPU time of a call."""
    times = []
    for _ in range(repetitions):
        start = time.process_time()
        for _ in range(calls):
            function()
        times.append(1e6 * (time.process_time() - start) / calls)
    return statistics.median(times)


def _table(rows: list[dict[str, Any]]) -> str:
    lines = [
        list(rows[0]),
        *([value if isinstance(value, str) else f"{value:,}" for value in row.values()] for row in rows),
    ]
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    return "\n".join("  ".join(cell.rjust(width) for cell, width in zip(line, widths, strict=True)) for line in lines)


#: Steps of random actions, repeated for as long as the measurement lasts.
DRAWN_STEPS = 200


if __name__ == "__main__":
    sys.exit(main())
