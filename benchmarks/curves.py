"""Points of error and speed: which are best, and how many times faster one curve is than another."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise
from typing import Any, NamedTuple

from benchmarks.results import Results

OURS = "implicit"
"""Our methods' curves begin with this; the thesis's with the next."""
THESIS = "thesis"
TRUST = 3.0
"""Errors below this multiple of the reference's uncertainty are not resolved."""

LOST = 0.1
"""Points with larger errors are left out [m]: about a link's length."""


class Point(NamedTuple):
    """Error of the worst link over the run [m] and simulated seconds per second of one thread, with the record."""

    error: float
    speed: float
    record: dict[str, Any]


def points(results: Results, scene: str, whose: str, speed: str = "best") -> list[Point]:
    """All trustworthy points of one party on a scene.

    Args:
        results: of a run.
        scene: name.
        whose: "implicit" (ours), "thesis", or a peer's name such as "MuJoCo".
        speed: "speed_alone", "speed_fleet", or "best" of the two.
    """
    ours = uncertainty(results, scene)
    records = [*results.of("point", scene=scene), *results.of("peer", scene=scene)]
    found = []
    for record in records:
        party = record.get("peer") or record["curve"]
        value = _speed(record, speed)
        floor = TRUST * (record["uncertainty"]["worst"] if "uncertainty" in record else ours)
        if party.startswith(whose) and record["error"] and record["error"]["worst"] < LOST and value:
            found.append(Point(max(record["error"]["worst"], floor), value, record))
    return found


def _speed(record: dict[str, Any], which: str) -> float | None:
    speeds = [record.get("speed_alone"), record.get("speed_fleet")]
    return max(filter(None, speeds), default=None) if which == "best" else record.get(which)


def uncertainty(results: Results, scene: str) -> float:
    """Distance between the two fine runs of the reference [m]."""
    records = results.of("scene", scene=scene)
    return records[0]["reference"]["uncertainty"]["worst"] if records else 0.0


def frontier(candidates: Iterable[Point]) -> list[Point]:
    """The points that no other beats in both error and speed, by growing error."""
    best: list[Point] = []
    for candidate in sorted(candidates, key=lambda p: (p.error, -p.speed)):
        if not best or candidate.speed > best[-1].speed:
            best.append(candidate)
    return best


def speed_at(curve: list[Point], error: float) -> float | None:
    """Speed of a frontier at an error, interpolated between logarithms.

    To the right of the curve its fastest point is accurate enough; to the left it has no answer: None.
    """
    if not curve or error < curve[0].error:
        return None
    for left, right in pairwise(curve):
        if left.error <= error < right.error:
            part = math.log(error / left.error) / math.log(right.error / left.error)
            return left.speed * (right.speed / left.speed) ** part
    return curve[-1].speed
