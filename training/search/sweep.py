"""Train several seeds of several configurations in parallel, and select the best.

    python -m training sweep --configs field-hard-symmetric corridor-cloned --seeds 5 --jobs 8

Each run is a process with one thread and has a folder ``<out>/<config>/seed-<k>`` with a log. Ctrl-C or a termination
signal, as that of ``timeout 540 python -m training sweep ...``, stops all runs, which save. The same command resumes a
stopped sweep: finished runs are kept, others continue from their checkpoints, as do finished ones after which
``--total-steps`` was raised. At the end each configuration has
``best.safetensors``, the policy of the highest success rate plus speed [m/s] on validation fields, ``seeds.json`` with
the scores of all, and, with matplotlib, ``learning-curves.png`` with the spread over seeds.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from snake_env import ConfigError
from snake_env._files import replace, write_json
from snake_env.evaluation import seeds
from snake_env.policies.loading import load_policy
from training import config as configs
from training.config import Count
from training.learning_curve import text
from training.progress import means_over_tasks, merit
from training.runs import RunFolder, sole_writer
from training.train import ENDS_WITH_INPUT

FIELDS = 200
"""Fields on which the seeds of a configuration are compared."""
SKIP = 100_000
"""Validation seeds before this one are for tuning scripted controllers."""
SHOWN = ("is_success", "speed", "distance", "jam_ratio")
"""Signals whose means are compared."""


@dataclass
class Options:
    """What is trained.

    Args:
        configs: Names in training/configs, or files.
        seeds: Runs of each configuration, with seeds 0, 1, ...
        jobs: Parallel processes.
        total_steps: Environment steps of each run; overrides the configuration.
        fields: Validation fields for the comparison of seeds.
        out: Output folder.
    """

    configs: tuple[str, ...]
    seeds: Count = 5
    jobs: Count = os.cpu_count() or 1
    total_steps: Count | None = None
    fields: Count = FIELDS
    out: Path = Path("runs/sweep")


def sweep(args: Options) -> int:
    """Trains all seeds, then selects the best of each configuration; 130 after a stop, 1 if a run failed."""
    runs = planned(args)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    with sole_writer(args.out):
        return _trained(args, runs)


def _trained(args: Options, runs: list[Run]) -> int:
    try:
        work([run for run in runs if not run.finished], args.jobs)
    except KeyboardInterrupt:
        stop(runs)
        print("\nstopped; the same command continues")
        return 130
    failed = [run for run in runs if not run.finished]
    for run in failed:
        print(f"{run.folder.path} failed: see {run.log}", file=sys.stderr)
    for name in args.configs:
        of_config = [run.folder for run in runs if run.config == name and run.finished]
        if of_config:
            print(choose(args.out / Path(name).stem, of_config, args.fields), flush=True)
    return 1 if failed else 0


def planned(args: Options) -> list[Run]:
    """The runs of a sweep.

    Raises:
        ConfigError: a configuration is not admissible, two would share a folder, or a run has taken more steps already.
    """
    stems = [Path(name).stem for name in args.configs]
    for name, stem in zip(args.configs, stems, strict=True):
        if stems.count(stem) > 1:
            raise ConfigError("configs", name, f"configurations of different names, {stem} is the folder of the runs")
    loaded = {name: configs.load(name) for name in args.configs}
    steps = {name: args.total_steps or config.total_steps for name, config in loaded.items()}
    runs = [Run(name, seed, args.out, steps[name]) for seed in range(args.seeds) for name in args.configs]
    for run in runs:
        if run.folder.exists:
            run.folder.require_budget(run.total_steps)
    return runs


@dataclass
class Run:
    """One process: a configuration, a seed and a budget of environment steps."""

    config: str
    seed: int
    out: Path
    total_steps: int
    process: subprocess.Popen[bytes] | None = field(default=None, init=False)

    @property
    def folder(self) -> RunFolder:
        """Where it trains."""
        return RunFolder(self.out / Path(self.config).stem / f"seed-{self.seed}")

    @property
    def finished(self) -> bool:
        """It has used up its budget."""
        return self.folder.has_taken(self.total_steps)

    @property
    def log(self) -> Path:
        """What it prints."""
        return self.folder.path / "log.txt"

    def start(self) -> None:
        """Starts or resumes the run, in a session of its own so that the terminal's Ctrl-C does not reach it."""
        self.folder.path.mkdir(parents=True, exist_ok=True)
        command = [
            sys.executable,
            "-m",
            "training.train",
            "--config",
            self.config,
            "--seed",
            str(self.seed),
            "--total-steps",
            str(self.total_steps),
            "--resume",
        ]
        command += ["--out", str(self.folder.path), "--num-threads", "1", "--torch-threads", "1"]
        with self.log.open("ab") as log:
            environment = os.environ | {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", ENDS_WITH_INPUT: "1"}
            self.process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=log,
                stderr=subprocess.STDOUT,
                env=environment,
                start_new_session=True,
            )

    @property
    def running(self) -> bool:
        """The process has been started and has not ended."""
        return self.process is not None and self.process.poll() is None


def work(waiting: list[Run], jobs: int) -> None:
    """Runs all, ``jobs`` at a time."""
    started: list[Run] = []
    shown = time.monotonic()
    waiting = list(waiting)
    while waiting or any(run.running for run in started):
        while waiting and sum(run.running for run in started) < jobs:
            started.append(waiting.pop(0))
            started[-1].start()
        time.sleep(0.2)
        if time.monotonic() - shown >= SHOW_SECONDS:
            show([run for run in started if run.running], len(waiting))
            shown = time.monotonic()


SHOW_SECONDS = 30.0


def show(running: list[Run], waiting: int) -> None:
    """Prints one line per running process."""
    for run in running:
        curve = run.folder.read_curve()
        if curve:
            print(f"{run.config}, seed {run.seed}: {curve[-1]['seconds']:.0f} s, {text(curve[-1])}", flush=True)
    print(f"{len(running)} running, {waiting} waiting", flush=True)


def stop(runs: list[Run]) -> None:
    """Makes all processes save and stop; returns when they have ended."""
    running = [run for run in runs if run.running]
    for run in running:
        if run.process is not None:
            run.process.send_signal(signal.SIGINT)
    for run in running:
        if run.process is not None:
            run.process.wait()


def choose(out: Path, folders: list[RunFolder], fields: int) -> str:
    """Scores the seeds of a configuration on validation fields, copies the best policy, draws the curves."""
    config, chosen_on = folders[0].config(), seeds.selection(fields, SKIP)
    rows: list[dict[str, Any]] = []
    for folder in folders:
        found, of_tasks = means_over_tasks(load_policy(folder.policy), config, chosen_on, SHOWN)
        each = {f"is_success/{task}": means["is_success"] for task, means in of_tasks.items() if task}
        rows.append({"run": folder.path.name, **found, **each})
    best = max(rows, key=merit)
    chosen = RunFolder(out / best["run"]).policy
    replace(out / f"best{chosen.suffix}", lambda part: shutil.copyfile(chosen, part))
    write_json(out / "seeds.json", {"best": best["run"], "fields": fields, "seeds": rows})
    draw({out.name: folders}, out)
    return f"{out}: best is {best['run']}, success {best['is_success']:.3f}, speed {best['speed']:.3f} m/s"


def draw(runs: dict[str, list[RunFolder]], out: Path) -> None:
    """Draws the learning curves if matplotlib is installed and any run has one."""
    curves = {name: [curve for folder in of if (curve := folder.read_curve())] for name, of in runs.items()}
    drawn = {name: of for name, of in curves.items() if of}
    if not drawn:
        return
    try:
        from training.evaluation import figures
    except ImportError:
        return
    figures.learning_curves(drawn, out / "learning-curves.png")
