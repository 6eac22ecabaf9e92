"""Speed against that of an earlier commit, which is built beside this one.

    python -m experiments.earlier_commit 2e355ed
    python -m experiments.earlier_commit HEAD~1 --envs SnakeCourse --actions random --modes gait

Two processes, one with each build, step the same batch in turn for short runs, so that other work on the machine weighs
on both alike. Prints the rates of both and the median of the ratios of CPU times over the turns, with quartiles: above
one where this commit is faster. The other build needs what `make build` needs, and as long; it is kept.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from numpy.typing import NDArray

from snake_env import ConfigError
from snake_env._checks import names
from snake_env.markdown import table
from training.cli import answer
from training.config import Count

ROOT = Path(__file__).resolve().parent.parent
TIMER = Path(__file__).with_name("step_timer.py")
ENVS = ("SnakeCourse", "SnakeField", "SnakeFree", "SnakeCorridor", "SnakeSpatial")
MODES = ("gait", "joints")
ACTIONS = ("zero", "random")
HEAD = ("environment", "mode", "actions", "earlier [steps/s]", "now [steps/s]", "ratio", "quartiles")


@dataclass
class Options:
    """What is compared.

    Args:
        commit: The earlier one.
        envs: Ids without their version.
        modes: Action modes.
        actions: "zero", which is the gait in the mode of that name, or "random".
        robots: Of a batch, on one thread.
        turns: Runs of each build.
        periods: Control periods of a run.
        builds: Folder in which builds are kept.
    """

    commit: Annotated[str, tyro.conf.Positional]
    envs: tuple[str, ...] = ENVS
    modes: tuple[str, ...] = MODES
    actions: tuple[str, ...] = ACTIONS
    robots: Count = 256
    turns: Count = 15
    periods: Count = 6
    builds: Path = Path("runs/builds")


def built(commit: str, builds: Path) -> Path:
    """The folder with the `snake_env` of a commit, which is checked out and compiled there unless it has been.

    Raises:
        ConfigError: the repository has no such commit.
    """
    found = subprocess.run(
        ["git", "rev-parse", "--verify", "--quiet", f"{commit}^{{commit}}"], cwd=ROOT, capture_output=True, text=True
    )
    if found.returncode:
        raise ConfigError("commit", commit, "a commit of this repository")
    name = found.stdout.strip()
    tree = builds.resolve() / name
    module = tree / "snake_env" / "_native.abi3.so"
    if not module.exists():
        shutil.rmtree(tree, ignore_errors=True)
        subprocess.run(["git", "clone", "--quiet", "--shared", "--no-checkout", str(ROOT), str(tree)], check=True)
        subprocess.run(["git", "checkout", "--quiet", name], cwd=tree, check=True)
        settings = {"PYO3_NO_PYTHON": "1", "PYO3_BUILD_EXTENSION_MODULE": "1", "CARGO_TARGET_DIR": str(tree / "target")}
        cargo = ["cargo", "build", "--quiet", "--release", "--package", "snake-py"]
        subprocess.run(cargo, cwd=tree, env=os.environ | settings, check=True)
        libraries = [path for path in (tree / "target" / "release").glob("lib_native.*") if path.suffix != ".d"]
        shutil.copy(libraries[0], module)
    return tree


class Timer:
    """A process that steps with the `snake_env` of a folder."""

    def __init__(self, tree: Path) -> None:
        environment = os.environ | {"PYTHONPATH": str(tree), "OMP_NUM_THREADS": "1"}
        pipe = subprocess.PIPE
        command = [sys.executable, str(TIMER)]
        self.process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, env=environment, cwd=tree)

    def ask(self, request: Any) -> str:
        """Its answer.

        Raises:
            RuntimeError: it has ended; what went wrong is on standard error.
        """
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(json.dumps(request) + "\n")
        self.process.stdin.flush()
        reply = self.process.stdout.readline().strip()
        if not reply:
            raise RuntimeError(f"the process with the build in {self.process.args!r} ended")
        return reply


@contextmanager
def timers(trees: tuple[Path, Path]) -> Iterator[tuple[Timer, Timer]]:
    """A process for each folder, while they are needed."""
    both = Timer(trees[0]), Timer(trees[1])
    try:
        yield both
    finally:
        for timer in both:
            timer.process.kill()
            timer.process.communicate()


def times(both: tuple[Timer, Timer], batch: tuple[str, str, str, int], turns: int, periods: int) -> NDArray[np.float64]:
    """CPU time per robot and step of both builds in turn (turns, 2) [s]; the first runs do not count."""
    for timer in both:
        timer.ask(batch)
    for timer in both:
        timer.ask(3 * periods)
    return np.array([[float(timer.ask(periods)) for timer in both] for _ in range(turns)])


def row(batch: tuple[str, str, str, int], taken: NDArray[np.float64]) -> tuple[str, ...]:
    """A row of the table."""
    ratio = taken[:, 0] / taken[:, 1]
    rates = (f"{1.0 / each:,.0f}" for each in np.median(taken, axis=0))
    low, high = np.quantile(ratio, (0.25, 0.75))
    return (*batch[:3], *rates, f"{np.median(ratio):.2f}", f"{low:.2f} to {high:.2f}")


def compare(args: Options) -> int:
    """Prints the table."""
    names("envs", args.envs, ENVS)
    names("modes", args.modes, MODES)
    names("actions", args.actions, ACTIONS)
    with timers((built(args.commit, args.builds), ROOT)) as both:
        rows = []
        for name, mode, actions in product(args.envs, args.modes, args.actions):
            if mode != "gait" and actions == "zero":
                continue  # a robot that holds its shape
            batch = (f"{name}-v1", mode, actions, args.robots)
            rows.append(row(batch, times(both, batch, args.turns, args.periods)))
            print(", ".join(rows[-1]), file=sys.stderr, flush=True)
    print(table(HEAD, rows))
    return 0


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, compare, __doc__, arguments)


if __name__ == "__main__":
    sys.exit(main())
