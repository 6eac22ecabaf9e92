"""Trajectories of an independent implementation, which the Rust tests use too."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.native import ROOT

DATA = ROOT / "rust" / "core" / "tests" / "data"
FILES = {"free": "planar-isotropic-converged.csv", "course-7.5": "planar-table-7.5-converged.csv"}
"""Scene -> file with rows t, then x, y, theta of links 1..n."""
DURATION = 5.0
"""Time at which errors are measured [s]."""


def distance(scene: dict[str, Any]) -> float | None:
    """Largest distance of a link of the bench's reference from the independent one [m]; None: there is none."""
    name = FILES.get(scene["scene"])
    if name is None or not (DATA / name).exists():
        return None
    rows = np.loadtxt(DATA / name, delimiter=",", skiprows=1)
    row = rows[np.isclose(rows[:, 0], DURATION)][0]
    links = row[1:].reshape(-1, 3)[:, :2]
    return float(np.linalg.norm(links - np.array(scene["reference"]["links"]), axis=1).max())
