"""Trajectories of an independent implementation, which the Rust tests use too."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.native import ROOT

DATA = ROOT / "rust" / "core" / "tests" / "data"
FILES = {"free": "planar-isotropic-converged.csv", "course-7.5": "planar-table-7.5-converged.csv"}
"""Scene -> file with rows t, then x, y, theta of links 1..n."""


def distance(scene: dict[str, Any]) -> float | None:
    """Largest distance over the run of a link of the bench's reference from the independent one [m].

    None: there is no independent one.
    """
    name = FILES.get(scene["scene"])
    if name is None or not (DATA / name).exists():
        return None
    rows = np.loadtxt(DATA / name, delimiter=",", skiprows=1)
    ours, sample = np.array(scene["reference"]["samples"]), scene["reference"]["sample"]
    index = np.rint(rows[:, 0] / sample).astype(int)
    shared = np.isclose(rows[:, 0], index * sample) & (index >= 1) & (index <= len(ours))
    theirs = rows[shared, 1:].reshape(shared.sum(), -1, 3)[..., :2]
    return float(np.linalg.norm(theirs - ours[index[shared] - 1], axis=-1).max())
