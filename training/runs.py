"""A run's folder: configuration, versions, checkpoints, learning curve.

config.json              the configuration
versions.json            what it ran on
checkpoints/000123456.*  policy and optimiser after that many environment steps
progress.json            wall seconds of training at each checkpoint
curve.jsonl              one line per update: steps, seconds, means over the last episodes
evaluations.jsonl        one line per evaluation: steps, means over validation fields without exploration
tensorboard/             losses, diagnostics, rates, shares of wall time
policy.safetensors       the policy at the end (model.zip of Stable-Baselines3)
best.safetensors         the policy that was best in an evaluation (best.zip of Stable-Baselines3)
finished.json            steps and wall seconds when a budget was used up
"""

from __future__ import annotations

import json
import os
import platform
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import snake_env
from snake_env import ConfigError
from snake_env._files import replace, write_json, write_text
from snake_env.errors import shortened
from training import config as configs

PACKAGES = ("snake_env", "gymnasium", "stable_baselines3", "torch", "numpy")


class StaleRun(ValueError):
    """A run that this version cannot continue; the message names the version it was started with."""


LOCK = ".lock"
"""File that the process holds that writes in a folder."""

POLICIES = ("policy.safetensors", "model.zip")
"""Names of the policy at the end: that of Stable-Baselines3 is a zip file."""


class RunFolder:
    """Reads and writes the files of one run.

    Args:
        path: The folder.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.checkpoints = path / "checkpoints"
        self.curve = path / "curve.jsonl"
        self._progress = path / "progress.json"
        self._finished = path / "finished.json"
        self._config = path / "config.json"
        self._versions = path / "versions.json"
        self._begun_with = json.loads(self._versions.read_text()) if self._versions.exists() else {}

    def create(self, config: configs.RunConfig) -> None:
        """Makes the folder and notes what the run is made from."""
        self.checkpoints.mkdir(parents=True, exist_ok=True)
        write_json(self._versions, versions())
        configs.save(config, self._config)
        if self.curve.exists():  # goes on after its last whole line
            write_text(self.curve, "".join(json.dumps(row) + "\n" for row in self.read_curve()))

    def discard(self) -> None:
        """Undoes :meth:`create`, of a run that has not begun."""
        for file in (self._config, self._versions, self.path / LOCK):
            file.unlink(missing_ok=True)
        for folder in (self.checkpoints, self.path):
            with suppress(OSError):  # what holds something stays
                folder.rmdir()

    def config(self) -> configs.RunConfig:
        """The configuration that the run was begun with.

        Raises:
            StaleRun: it is not one of this version.
        """
        with self.resumed():
            return configs.load(self._config)

    @contextmanager
    def resumed(self) -> Iterator[None]:
        """For reading what an earlier part of the run wrote.

        Raises:
            StaleRun: it does not fit: other options, other environments or other networks.
        """
        try:
            yield
        except (KeyError, RuntimeError, TypeError, ValueError) as error:
            raise StaleRun(
                f"{self.path} does not resume: {shortened(str(error), 500)}\n{self._provenance()}; choose another --out"
            ) from error

    def _provenance(self) -> str:
        """What has changed since the run was begun."""
        then, now = self._begun_with, versions()
        changed = [f"{name} {then.get(name)}, now {now[name]}" for name in PACKAGES if then.get(name) != now[name]]
        return "It was begun with " + (", ".join(changed) or f"other sources of snake_env {now['snake_env']}")

    @property
    def exists(self) -> bool:
        """A run has been begun here."""
        return self._config.exists()

    @property
    def has_begun(self) -> bool:
        """The run has left something of what it learned."""
        return self.curve.exists() or bool(self._saved())

    @property
    def is_taken(self) -> bool:
        """Holds a run, or the configuration of something else; not one that ended before it began to learn."""
        return self.exists and (self.has_begun or not self._versions.exists())

    @property
    def finished(self) -> bool:
        """The run has used up its budget, which may have been raised after it finished before."""
        return self.exists and self.has_taken(json.loads(self._config.read_text())["total_steps"])

    def has_taken(self, total_steps: int) -> bool:
        """The run has finished, after at least so many environment steps."""
        if not self._finished.exists() or not self.policy.exists():
            return False
        return int(json.loads(self._finished.read_text())["steps"]) >= total_steps

    def require_budget(self, total_steps: int) -> None:
        """Raises if a run would end before the environment steps that it has taken, or that were its budget.

        Raises:
            ConfigError: names both numbers.
        """
        checkpoint = self.latest()
        # The last update may have gone beyond the budget.
        taken = 0 if checkpoint is None else min(int(checkpoint.stem), self.config().total_steps)
        if total_steps < taken:
            raise ConfigError("total_steps", total_steps, f"at least {taken}, which {self.path} has already taken")

    @property
    def policy(self) -> Path:
        """The policy at the end of the run."""
        found = [self.path / name for name in POLICIES if (self.path / name).exists()]
        return found[0] if found else self.path / POLICIES[0]

    @property
    def best(self) -> Path:
        """The policy that was best in an evaluation."""
        return self.path / f"best{self.policy.suffix}"

    @property
    def chosen(self) -> Path:
        """The best policy, or the last one of a run without evaluations."""
        return self.best if self.best.exists() else self.policy

    def latest(self) -> Path | None:
        """The checkpoint after the most steps, of those that are whole."""
        return next((path for path in reversed(self._saved()) if _is_whole(path)), None)

    def _saved(self) -> list[Path]:
        """The checkpoints in the order of their steps."""
        return sorted(self.checkpoints.glob("[0-9]*"), key=lambda path: int(path.stem))

    def save_checkpoint(self, save: Callable[[Path], None], steps: int, seconds: float, suffix: str) -> Path:
        """Saves a checkpoint; the two before it are kept, and none beyond it, from which the run has gone back."""
        path = self.checkpoints / f"{steps:09d}{suffix}"
        replace(path, save)
        write_json(self._progress, self._seconds() | {path.stem: seconds})
        before = [one for one in self._saved() if int(one.stem) <= steps]
        for old in {*self._saved(), *self.checkpoints.glob("part-*")} - {*before[-3:]}:
            old.unlink()
        return path

    def seconds(self, checkpoint: Path) -> float:
        """Wall time of training before a checkpoint [s]."""
        return self._seconds().get(checkpoint.stem, 0.0)

    def _seconds(self) -> dict[str, float]:
        return json.loads(self._progress.read_text()) if self._progress.exists() else {}

    def finish(self, summary: dict[str, Any]) -> None:
        """Marks the run as finished."""
        write_json(self._finished, summary)

    def append_curve(self, row: dict[str, Any]) -> None:
        """Adds a line to the learning curve."""
        with self.curve.open("a") as file:
            file.write(json.dumps(row) + "\n")

    def read_curve(self) -> list[dict[str, Any]]:
        """The learning curve; after a resumption the lines that were undone are left out."""
        if not self.curve.exists():
            return []
        rows: list[dict[str, Any]] = []
        for line in self.curve.read_text().splitlines():
            try:
                row = json.loads(line)
            except ValueError:  # cut off, as when the disk was full
                continue
            while rows and rows[-1]["steps"] >= row["steps"]:
                rows.pop()
            rows.append(row)
        return rows


def _is_whole(checkpoint: Path) -> bool:
    """Whether an archive has all that was written into it."""
    try:
        with zipfile.ZipFile(checkpoint) as archive:
            return archive.testzip() is None
    except (EOFError, OSError, zipfile.BadZipFile, zlib.error):
        return False


@contextmanager
def sole_writer(folder: Path) -> Iterator[None]:
    """For writing in a folder, which is made; ends with the process, in whatever way that ends.

    Raises:
        ConfigError: another process writes there.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / LOCK).open("a") as file:
        try:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except ImportError:  # Windows, where runs are not protected
            pass
        except BlockingIOError:
            raise ConfigError("out", folder, "a folder in which no other process writes") from None
        yield


def versions() -> dict[str, Any]:
    """Versions of what a result depends on, and the machine's kind."""
    found = {"python": platform.python_version(), "machine": platform.machine(), "cores": os.cpu_count()}
    found["snake_env"] = snake_env.__version__
    for package in PACKAGES[1:]:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = None
    return found
