"""Speed against that of an earlier commit.

    python -m experiments.earlier_commit 2e355ed
    python -m experiments.earlier_commit HEAD~1 --envs SnakeCourse --actions random --modes gait --peg-friction 0.3

Both commits are built in folders of their own, which are kept; that needs what `make build` needs, and takes as long.
Two processes, one with each build, step the same batch in turn for short runs, so that other work on the machine weighs
on both alike. Prints the rates of both and the median of the ratios of CPU times over the turns, with quartiles: above
one where the later commit is faster.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tyro
from numpy.typing import NDArray

from snake_env import ConfigError
from snake_env._files import replace
from snake_env.markdown import table
from training.cli import answer
from training.config import Count, NotNegative

ROOT = Path(__file__).resolve().parent.parent
TIMER = Path(__file__).with_name("step_timer.py")
HEAD = ("environment", "mode", "actions", "earlier [steps/s]", "later [steps/s]", "ratio", "quartiles")

Env = Literal[
    "SnakeCourse",
    "SnakeField",
    "SnakeFree",
    "SnakeCorridor",
    "SnakeClutter",
    "SnakeSpatial",
    "SnakeTerrain",
    "SnakePipe",
    "SnakeClimb",
]
Batch = tuple[str, str, str, int, float]
"""Id of the environment, action mode, actions, robots, friction at obstacles."""


@dataclass
class Options:
    """What is compared.

    Args:
        commit: The earlier one.
        later: The later one.
        envs: Ids without their version; one that the earlier commit does not have is left out.
        modes: Action modes.
        actions: "zero", the gait in the mode of that name and left out in the other; or "random".
        robots: Of a batch, on one thread.
        peg_friction: Coefficient of friction at obstacles, in environments that have them.
        turns: Runs of each build.
        periods: Control periods of a run.
        builds: Folder in which builds are kept.
    """

    commit: Annotated[str, tyro.conf.Positional]
    later: str = "HEAD"
    envs: tuple[Env, ...] = ("SnakeCourse", "SnakeField", "SnakeFree", "SnakeCorridor", "SnakeSpatial")
    modes: tuple[Literal["gait", "joints"], ...] = ("gait", "joints")
    actions: tuple[Literal["zero", "random"], ...] = ("zero", "random")
    robots: Count = 256
    peg_friction: NotNegative = 0.0
    turns: Count = 15
    periods: Count = 6
    builds: Path = Path("runs/builds")


def built(field: str, commit: str, builds: Path) -> Path:
    """The folder with the `snake_env` of a commit, which is checked out and compiled there unless it has been.

    Raises:
        ConfigError: there is no such commit, or it does not compile; names the `field`.
    """
    command = ["git", "rev-parse", "--verify", "--quiet", f"{commit}^{{commit}}"]
    found = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    if found.returncode:
        raise ConfigError(field, commit, "a commit of this repository")
    name = found.stdout.strip()
    tree = builds.resolve() / name
    module = tree / "snake_env" / "_native.abi3.so"
    if module.exists():
        return tree
    print(f"builds {commit} in {tree}", file=sys.stderr, flush=True)
    shutil.rmtree(tree, ignore_errors=True)
    settings = {"PYO3_NO_PYTHON": "1", "PYO3_BUILD_EXTENSION_MODULE": "1", "CARGO_TARGET_DIR": str(tree / "target")}
    try:
        subprocess.run(["git", "clone", "--quiet", "--shared", "--no-checkout", str(ROOT), str(tree)], check=True)
        subprocess.run(["git", "checkout", "--quiet", name], cwd=tree, check=True)
        cargo = ["cargo", "build", "--quiet", "--release", "--package", "snake-py"]
        subprocess.run(cargo, cwd=tree, env=os.environ | settings, check=True)
    except subprocess.CalledProcessError as error:
        raise ConfigError(field, commit, f"a commit that can be built ({' '.join(error.cmd)} failed)") from None
    [library] = (path for path in (tree / "target" / "release").glob("lib_native.*") if path.suffix != ".d")
    replace(module, partial(copy, library))
    return tree


def copy(source: Path, target: Path) -> None:
    """Copies a file."""
    shutil.copy(source, target)


class Timer:
    """A process that steps with the `snake_env` of a folder.

    Raises:
        RuntimeError: it has ended, or has another `snake_env`; what went wrong is on standard error.
    """

    def __init__(self, tree: Path) -> None:
        environment = os.environ | {"PYTHONPATH": str(tree), "OMP_NUM_THREADS": "1"}
        command = [sys.executable, str(TIMER)]
        self.tree = tree
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment, cwd=tree
        )
        if (found := self.reply()) != str(tree / "snake_env"):
            self.stop()
            raise RuntimeError(f"the process for {tree} has the snake_env of {found}")

    def reply(self) -> str:
        """The next line of its output."""
        assert self.process.stdout is not None
        line = self.process.stdout.readline().strip()
        if not line:
            raise RuntimeError(f"the process with the build in {self.tree} ended")
        return line

    def request(self, what: Any) -> str:
        """Its reply to a request of :mod:`experiments.step_timer`."""
        assert self.process.stdin is not None
        try:
            self.process.stdin.write(json.dumps(what) + "\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            raise RuntimeError(f"the process with the build in {self.tree} ended") from None
        return self.reply()

    def stop(self) -> None:
        """Ends the process."""
        self.process.kill()
        self.process.communicate()


@contextmanager
def timers(trees: tuple[Path, Path]) -> Iterator[tuple[Timer, Timer]]:
    """A process for each folder, while they are needed."""
    with ExitStack() as stack:
        both = []
        for tree in trees:
            both.append(Timer(tree))
            stack.callback(both[-1].stop)
        yield both[0], both[1]


def measure(both: tuple[Timer, Timer], batch: Batch, turns: int, periods: int) -> NDArray[np.float64] | None:
    """CPU time per robot and control period of both builds (turns, 2) [s], None where one lacks the environment.

    The first runs do not count; which build runs first changes from turn to turn.
    """
    if "unknown" in [timer.request(batch) for timer in both]:
        return None
    for timer in both:
        timer.request(3 * periods)
    times = np.empty((turns, 2))
    for turn in range(turns):
        for build in (0, 1) if turn % 2 else (1, 0):
            times[turn, build] = float(both[build].request(periods))
    return times


def row(batch: Batch, times: NDArray[np.float64]) -> tuple[str, ...]:
    """A row of the table."""
    ratio = times[:, 0] / times[:, 1]
    rates = (f"{1.0 / each:,.0f}" for each in np.median(times, axis=0))
    low, high = np.quantile(ratio, (0.25, 0.75))
    return (*batch[:3], *rates, f"{np.median(ratio):.2f}", f"{low:.2f} to {high:.2f}")


def compare(args: Options) -> int:
    """Prints the table."""
    trees = built("commit", args.commit, args.builds), built("later", args.later, args.builds)
    rows = []
    with timers(trees) as both:
        for name, mode, actions in product(args.envs, args.modes, args.actions):
            if mode != "gait" and actions == "zero":
                continue  # a robot that holds its shape
            batch = (f"{name}-v1", mode, actions, args.robots, args.peg_friction)
            times = measure(both, batch, args.turns, args.periods)
            if times is not None:
                rows.append(row(batch, times))
                print(", ".join(rows[-1]), file=sys.stderr, flush=True)
    print(table(HEAD, rows))
    return 0


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, compare, __doc__, arguments)


if __name__ == "__main__":
    sys.exit(main())
