"""What was measured, on what: one JSON file.

    {"machine": {...}, "commit": "...", "versions": {...}, "command": "...", "quick": false, "complete": true,
     "seconds": 812.3, "records": [{"kind": "point", ...}, ...]}

Records are the lines of ``snake-bench`` and those of the peers, told apart by ``kind``:
``scene``, ``point``, ``growth``, ``skip``, ``pressed``, ``certificate``, ``width``, ``interface``, ``learning``,
``peer``, ``equal_error``, and ``run`` of a later command that measured some of these anew.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
from dataclasses import asdict, dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from benchmarks.native import ROOT
from snake_env import _native
from snake_env._files import write_text
from training.runs import versions

Record = dict[str, Any]

COMPARED = 256
"""Robots at which environments are compared."""

REQUIRED = {
    "scene": ("scene", "title", "scenario", "reference"),
    "point": ("scene", "curve", "integrator", "default", "error", "speed_alone", "speed_fleet", "misses"),
    "growth": ("axis",),
    "skip": ("feature", "off", "on", "idle", "us_off", "us_on", "ratio"),
    "pressed": ("bend", "pairs", "us_step", "us_solve", "solves"),
    "certificate": ("what", "percent", "residual", "gap", "iterations", "misses", "above_tolerance", "steps", "events"),
    "width": ("env", "actions", "lanes", "robots", "steps_per_cpu_second"),
    "interface": ("robots",),
    "learning": ("env", "robots", "simulator [us]", "learner [us]"),
    "peer": ("peer", "scene", "curve", "setup", "error", "speed_alone"),
    "equal_error": ("env", "actions", "period", "party", "setup", "shown", "error", "work_bias", "cost"),
    "run": ("command", "machine", "commit", "seconds"),
}
"""Kinds of records and what each must have."""


@dataclass
class Results:
    """All measurements of one run.

    Attributes:
        machine: CPU model, number of cores, and load (runnable processes, mean over a minute) at the start.
        commit: of the repository, "-dirty" if files had changed.
        versions: of compilers, packages and peers.
        command: what was run.
        quick: fewer cases and repetitions.
        complete: nothing was left out; False after Ctrl-C.
        seconds: wall time.
        records: measurements in order.
    """

    machine: dict[str, Any]
    commit: str
    versions: dict[str, Any]
    command: str
    quick: bool
    complete: bool = False
    seconds: float = 0.0
    records: list[Record] = field(default_factory=list)

    @classmethod
    def begin(cls, command: str, quick: bool) -> Results:
        """No measurements yet, on this machine."""
        return cls(machine(), commit(), all_versions(), command, quick)

    def add(self, record: Record) -> None:
        """Takes a record in.

        Raises:
            ValueError: its kind is unknown or something is missing.
        """
        required = REQUIRED.get(record.get("kind", ""))
        if required is None:
            raise ValueError(f"a record of unknown kind: {record}")
        missing = [name for name in required if name not in record]
        if missing:
            raise ValueError(f"{record['kind']}: no {', '.join(missing)} in {record}")
        self.records.append(record)

    def of(self, kind: str, **values: Any) -> list[Record]:
        """The records of a kind with the given values."""
        return [r for r in self.records if r["kind"] == kind and all(r.get(k) == v for k, v in values.items())]

    def renewed(self, other: Results) -> Results:
        """These results with what ``other``, a run of some parts, has measured anew: kinds of records, by scene."""
        fresh = {(record["kind"], record.get("scene")) for record in other.records}
        kept = [
            r for r in self.records if (r["kind"], r.get("scene")) not in fresh and r.get("command") != other.command
        ]
        run = {"kind": "run", **{name: getattr(other, name) for name in REQUIRED["run"]}}
        return Results(**(vars(self) | {"records": [*kept, *other.records, run]}))

    def write(self, path: Path) -> None:
        """Writes the file whole or not at all, a line a record."""
        content = asdict(self)
        records = ",\n".join(json.dumps(record) for record in content.pop("records"))
        head = json.dumps(content, indent=2).removesuffix("\n}")
        write_text(path, f'{head},\n  "records": [\n{records}\n]\n}}\n')

    @classmethod
    def read(cls, path: Path) -> Results:
        """Reads a file that :meth:`write` has written."""
        return cls(**json.loads(path.read_text()))


def machine() -> dict[str, Any]:
    """What the figures depend on most; ``lanes``: robots per register."""
    found = versions()
    return {
        "cpu": _cpu_model(),
        "cores": found["cores"],
        "architecture": found["machine"],
        "system": platform.system(),
        "lanes": _native.lanes(),
        "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
    }


def place(machine: dict[str, Any]) -> str:
    """Where times were taken, as pages say it."""
    return f"On one core of {machine['cpu']}, {machine.get('lanes', 'several')} robots per register."


def _cpu_model() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown"
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else "unknown"


def commit() -> str:
    """The commit that was measured."""
    return _output("git", "describe", "--always", "--dirty", "--abbrev=12") or "unknown"


def all_versions() -> dict[str, Any]:
    """Compiler, packages and peers; None: not installed."""
    found = {name: value for name, value in versions().items() if name not in ("machine", "cores")}
    return found | {"rustc": _output("rustc", "--version"), "mujoco": _installed("mujoco")}


def _installed(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _output(*command: str) -> str | None:
    try:
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return done.stdout.strip()
