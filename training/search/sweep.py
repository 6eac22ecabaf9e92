"""Train several seeds of several configurations in parallel, and select the best.

    python -m training sweep --configs field-hard-symmetric corridor-cloned --seeds 5 --jobs 8

Each run is a process with one thread and has a folder ``<out>/<config>/seed-<k>`` with a log. Ctrl-C or a termination
signal, as that of ``timeout 540 python -m training sweep ...``, stops all runs, which save. The same command resumes a
stopped sweep: finished runs are kept, others continue from their checkpoints. At the end each configuration has
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

import numpy as np

from snake_env.evaluation import rollout, seeds
from snake_env.policies.interface import Policy
from training import config as configs
from training.cli import answer
from training.evaluation.loading import load_model
from training.learning_curve import text
from training.runs import RunFolder, write_json

FIELDS = 200
"""Fields on which the seeds of a configuration are compared."""
SKIP = 100_000
"""Validation seeds before this one are for tuning scripted controllers."""


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
    seeds: int = 5
    jobs: int = os.cpu_count() or 1
    total_steps: int | None = None
    fields: int = FIELDS
    out: Path = Path("runs/sweep")


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; returns 130 after a stop, 1 if a run failed."""
    return answer(Options, sweep, __doc__, arguments)


def sweep(args: Options) -> int:
    """Trains all seeds, then selects the best of each configuration."""
    for name in args.configs:
        configs.load(name)
    limits = [f"--total-steps={args.total_steps}"] if args.total_steps else []
    runs = [Run(name, seed, args.out, limits) for seed in range(args.seeds) for name in args.configs]
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    try:
        work([run for run in runs if not run.folder.finished], args.jobs)
    except KeyboardInterrupt:
        stop(runs)
        print("\nstopped; the same command continues")
        return 130
    failed = [run for run in runs if not run.folder.finished]
    for run in failed:
        print(f"{run.folder.path} failed: see {run.log}", file=sys.stderr)
    for name in args.configs:
        of_config = [run.folder for run in runs if run.config == name and run.folder.finished]
        if of_config:
            print(choose(args.out / Path(name).stem, of_config, args.fields), flush=True)
    return 1 if failed else 0


@dataclass
class Run:
    """One process: a configuration and a seed."""

    config: str
    seed: int
    out: Path
    limits: list[str]
    process: subprocess.Popen[bytes] | None = field(default=None, init=False)

    @property
    def folder(self) -> RunFolder:
        """Where it trains."""
        return RunFolder(self.out / Path(self.config).stem / f"seed-{self.seed}")

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
            "--resume",
        ]
        command += ["--out", str(self.folder.path), "--num-threads", "1", "--torch-threads", "1", *self.limits]
        with self.log.open("ab") as log:
            environment = os.environ | {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
            self.process = subprocess.Popen(
                command, stdout=log, stderr=subprocess.STDOUT, env=environment, start_new_session=True
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
    """Makes all processes save and stop, and waits for them."""
    running = [run for run in runs if run.running]
    for run in running:
        if run.process is not None:
            run.process.send_signal(signal.SIGINT)
    for run in running:
        if run.process is not None:
            run.process.wait()


def choose(out: Path, folders: list[RunFolder], fields: int) -> str:
    """Scores the seeds of a configuration on validation fields, copies the best policy, draws the curves."""
    config: configs.RunConfig = folders[0].config()
    rows: list[dict[str, Any]] = []
    for folder in folders:
        rows.append({"run": folder.path.name, **means_over_tasks(load_model(folder.policy), config, fields)})
    best = max(rows, key=lambda row: row["is_success"] + row["speed"])
    chosen = RunFolder(out / best["run"]).policy
    shutil.copyfile(chosen, out / f"best{chosen.suffix}")
    write_json(out / "seeds.json", {"best": best["run"], "fields": fields, "seeds": rows})
    draw({out.name: folders}, out)
    return f"{out}: best is {best['run']}, success {best['is_success']:.3f}, speed {best['speed']:.3f} m/s"


def means_over_tasks(policy: Policy, config: configs.RunConfig, fields: int) -> dict[str, float]:
    """Means of scores on validation fields; with several tasks over the tasks, and the success rate of each."""
    found = {
        task: rollout.run_episodes(policy, env_id, seeds.selection(fields, SKIP), config.num_threads, **options)
        for task, env_id, options in config.environments()
    }
    shown = ("is_success", "speed", "distance", "jam_ratio")
    means = {name: float(np.mean([episodes[name].mean() for episodes in found.values()])) for name in shown}
    return means | {f"is_success/{task}": float(one["is_success"].mean()) for task, one in found.items() if task}


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


if __name__ == "__main__":
    sys.exit(main())
