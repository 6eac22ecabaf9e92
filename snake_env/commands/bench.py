"""Environment steps per second of processor time and of wall time, with random actions and with action zero.

snake-env bench
snake-env bench --env SnakeField-v1 --num-envs 1024 --num-threads 2

The last column is the ratio of the first one to the README's, where it has random actions in the same action mode.
"""

from __future__ import annotations

import math
import re
import time
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path

import gymnasium as gym
import numpy as np

from snake_env._cli import parser
from snake_env.markdown import table
from snake_env.registration import TASKS
from snake_env.vector_env import refuse_others

IDS = ("SnakeCourse-v1", "SnakeField-v1", "SnakeFree-v1", "SnakeSpatial-v1")


def main(arguments: list[str]) -> int:
    """Runs the command."""
    cli = parser("bench", __doc__)
    cli.add_argument("--env", action="append", metavar="ID", help=f"one of {', '.join(TASKS)}; may be repeated")
    cli.add_argument("--num-envs", type=int, default=256, help="robots (default 256)")
    cli.add_argument("--num-threads", type=int, default=1, help="threads (default 1)")
    cli.add_argument("--seconds", type=float, default=2.0, help="of each measurement (default 2)")
    args = cli.parse_args(arguments)
    if not 0.0 < args.seconds < math.inf:
        cli.error(f"argument --seconds: {args.seconds}: expected a finite number > 0")
    rows, known = [], in_readme()
    for env_id in args.env or IDS:
        refuse_others(env_id)
        rates = [rate(env_id, args.num_envs, args.num_threads, args.seconds, random) for random in (True, False)]
        ratio = f"{rates[0][0] / known[env_id]:.2f}" if env_id in known else "-"
        rows.append((f"`{env_id}`", *(f"{value:,.0f}" for pair in zip(*rates, strict=True) for value in pair), ratio))
    print(f"{args.num_envs} robots, {args.num_threads} thread(s), steps per second of processor and wall time\n")
    head = ("environment", "random actions", "action zero", "random, wall", "zero, wall", "random / README")
    print(table(head, rows))
    return 0


def in_readme() -> dict[str, float]:
    """Steps per second of processor time by environment, of the README that the package or its clone has."""
    readme = Path(__file__).parents[2] / "README.md"
    try:
        text = str(metadata("snake-robot-env"))
    except PackageNotFoundError:
        text = readme.read_text(encoding="utf-8") if readme.exists() else ""
    found = re.findall(r"^ *\| `(\w+-v1)` \| gait \| ([\d,]+) \|", text, re.MULTILINE)
    return {env_id: float(number.replace(",", "")) for env_id, number in found}


def rate(env_id: str, num_envs: int, num_threads: int, seconds: float, random: bool) -> tuple[float, float]:
    """Steps of robots per second of processor time, of all threads, and of wall time."""
    envs = gym.make_vec(env_id, num_envs=num_envs, num_threads=num_threads)
    envs.reset(seed=0)
    rng = np.random.default_rng(0)
    shape = envs.action_space.shape
    assert shape is not None
    actions = rng.uniform(-1.0, 1.0, (16, *shape)).astype(np.float32) if random else np.zeros((16, *shape), np.float32)
    steps, start, spent = 0, time.perf_counter(), time.process_time()
    while (passed := time.perf_counter() - start) < seconds:
        envs.step(actions[steps % len(actions)])
        steps += 1
    spent = time.process_time() - spent
    envs.close()
    return steps * num_envs / max(spent, 1e-6), steps * num_envs / passed
