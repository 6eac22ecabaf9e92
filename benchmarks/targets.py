"""The targets of the project in numbers, each with what was measured."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from benchmarks import curves
from benchmarks.results import Record, Results

QUICKEST = {
    "free": ("free undulation", {0.3: 20_000, 0.05: 5_000}),
    "course-7.5": ("Table 7.5", {0.5: 8_000, 0.15: 4_000, 0.05: 2_000, 0.015: 800}),
    "spatial-course-7.5": ("3D, Table 7.5", {0.64: 3_000, 0.04: 400}),
    "spatial-sidewinding": ("3D, sidewinding", {10.0: 8_000, 1.0: 1_500}),
}
"""Simulated seconds per second and core by error of link 6 [mm]."""
AHEAD, AHEAD_3D = 50.0, 20.0
"""Times faster than a peer at equal error."""
ENV_STEPS, ENV_STEPS_FLOOR, TWO_THREADS = 300_000, 150_000, 1.9


class Target(NamedTuple):
    """One row: the target, what was measured, whether it is met (None: not measured)."""

    what: str
    target: str
    measured: str
    met: bool | None

    @property
    def verdict(self) -> str:
        """One word for the table."""
        return {True: "met", False: "**missed**", None: "not measured"}[self.met]


def all_targets(results: Results) -> list[Target]:
    """Every row, measured or not."""
    return [
        *_speeds(results),
        *_against(results, "MuJoCo", "MuJoCo at equal error, every point of both curves"),
        *_against(results, "MuJoCo", "MuJoCo in 3D, at equal error", spatial=True),
        *_against(results, curves.THESIS, "Algorithm 3.1 in the same code, at equal error"),
        *_batch(results),
        *_growth(results),
        *_skip(results),
        *_accuracy(results),
        _certificate(results),
    ]


def _speeds(results: Results) -> Iterator[Target]:
    for scene, (name, rows) in QUICKEST.items():
        points = curves.points(results, scene, curves.OURS)
        for millimetres, aim in rows.items():
            what = f"{name}, error of link 6 <= {millimetres:g} mm"
            best = curves.fastest_within(points, 1e-3 * millimetres)
            if best is None:
                yield Target(what, f"{aim:,} s/s", "no such point" if points else "-", False if points else None)
            else:
                measured = f"{best.speed:,.0f} s/s ({describe(best.record)}, {1e3 * best.error:.2g} mm)"
                yield Target(what, f"{aim:,} s/s", measured, best.speed >= aim)


def describe(record: Record) -> str:
    """A point's method in few words."""
    if "setup" in record:
        setup = record["setup"]
        soft = f", contacts of {1e3 * setup['contact_time']:g} ms" if "contact_time" in setup else ""
        return f"{setup['solver']}, {1e3 * setup['step']:g} ms, tolerance {setup['tolerance']:g}{soft}"
    return f"{record['curve']}, {1e3 * record['integrator']['step']:g} ms"


def _against(results: Results, whose: str, what: str, spatial: bool = False) -> Iterator[Target]:
    """The least favourable point on any scene both were measured on, planar or 3D."""
    found = []
    for scene in results.of("scene", model="spatial" if spatial else None):
        ours = curves.frontier(curves.points(results, scene["scene"], curves.OURS))
        theirs = curves.frontier(curves.points(results, scene["scene"], whose))
        for ratio in curves.ratios(ours, theirs):
            found.append((ratio.value, f"{scene['scene']} at {1e3 * ratio.error:.2g} mm"))
        for point in curves.unreached(ours, theirs):
            found.append((0.0, f"{scene['scene']}: {1e3 * point.error:.2g} mm not reached by ours"))
    ahead = AHEAD_3D if spatial else AHEAD
    aim = f">= {ahead:g}x"
    if not found:
        yield Target(what, aim, "-", None)
        return
    low, where = min(found)
    high, there = max(found)
    yield Target(what, aim, f"{low:.1f}x ({where}) to {high:,.0f}x ({there})", low >= ahead)


def _batch(results: Results) -> Iterator[Target]:
    """The rate of one thread by CPU time, which other work on the machine disturbs least; the gain by wall clock."""
    what = "SnakeCourse-v1, native batch, gait: "
    best = max(_course(results, 1), key=lambda r: r["steps_per_cpu_second"], default=None)
    aim = f"{ENV_STEPS:,} (floor {ENV_STEPS_FLOOR:,})"
    if best is None:
        yield Target(what + "env-steps/s of one core", aim, "-", None)
    else:
        rate = best["steps_per_cpu_second"]
        floor = "" if rate >= ENV_STEPS else f", {'above' if rate >= ENV_STEPS_FLOOR else 'below'} the floor"
        measured = f"{rate:,.0f} ({best['robots']:,} robots; by wall clock {best['steps_per_second']:,.0f}){floor}"
        yield Target(what + "env-steps/s of one core", aim, measured, rate >= ENV_STEPS)
    gains = _gains(results)
    robots = max(gains, key=lambda r: gains[r], default=None)
    measured = "-" if robots is None else f"{gains[robots]:.2f}x ({robots:,} robots)"
    yield Target(
        what + "two threads over one",
        f"{TWO_THREADS}x",
        measured,
        None if robots is None else gains[robots] >= TWO_THREADS,
    )


def _gains(results: Results) -> dict[int, float]:
    """Number of robots -> rate of two threads over that of one, by wall clock."""
    one = {r["robots"]: r["steps_per_second"] for r in _course(results, 1)}
    return {r["robots"]: r["steps_per_second"] / one[r["robots"]] for r in _course(results, 2) if r["robots"] in one}


def _course(results: Results, threads: int) -> list[Record]:
    return results.of("growth", axis="batch", env="SnakeCourse-v1", actions="gait", threads=threads)


def _growth(results: Results) -> Iterator[Target]:
    for scene in ("free", "track"):
        links = results.of("growth", axis="links", scene=scene)
        yield _spread(f"growth with links, {scene}: time per link", links, "us_per_link", 1.3, "links")
    pegs = results.of("growth", axis="pegs")
    yield _spread("growth with pegs in the field: time per step", pegs, "us_per_step", 1.2, "pegs")
    large = [r for r in _course(results, 1) if r["robots"] >= 64]
    yield _spread(
        "growth with batch beyond 64 robots: rate of one thread", large, "steps_per_cpu_second", 1.2, "robots"
    )
    busy = [r["utilisation"] for r in _course(results, 2) if r["robots"] >= 64]
    measured = "-" if not busy else f"at least {100 * min(busy):.0f} % busy"
    yield Target(
        "two threads, 64 robots and more: no thread idle", ">= 95 %", measured, min(busy) >= 0.95 if busy else None
    )


def _spread(what: str, records: list[Record], quantity: str, within: float, axis: str) -> Target:
    """Largest growth from the smallest size on: a larger one may be cheaper."""
    if len(records) < 2:
        return Target(what, f"within {within}x", "-", None)
    rows = sorted(records, key=lambda r: r[axis])
    cost = [1.0 / r[quantity] if quantity.endswith("second") else r[quantity] for r in rows]
    worst = max(range(len(rows)), key=lambda k: cost[k])
    ratio = cost[worst] / cost[0]
    sizes = (
        f"{rows[worst][axis]:,} against {rows[0][axis]:,} {axis}" if worst else "no size costs more than the smallest"
    )
    measured = f"{ratio:.2f}x ({sizes})"
    return Target(what, f"within {within}x", measured, ratio <= within)


def _skip(results: Results) -> Iterator[Target]:
    rows = results.of("skip", idle=True)
    worst: Any = max(rows, key=lambda r: r["ratio"], default=None)
    measured = "-" if worst is None else f"{100 * (worst['ratio'] - 1):+.1f} % ({worst['feature']}: {worst['on']})"
    yield Target(
        "a feature the scene does not need", "<= 2 %", measured, None if worst is None else worst["ratio"] <= 1.02
    )


def _accuracy(results: Results) -> Iterator[Target]:
    """The environments' own method and step, worst link."""
    for scene in ("free", "course-7.5", "course-7.3"):
        step = [r for r in results.of("point", scene=scene, default=True) if r["error"]]
        what = f"default accuracy, {scene}, worst link after 5 s"
        if step:
            error = step[0]["error"]["worst"]
            yield Target(what, "<= 0.5 mm", f"{1e3 * error:.2g} mm", error <= 5e-4)
        else:
            yield Target(what, "<= 0.5 mm", "-", None)


def _certificate(results: Results) -> Target:
    """Verified: solved to the tolerance according to code that no solver uses."""
    what = "every stage verified, scenes and random fields"
    records = results.of("certificate")
    if not records:
        return Target(what, "no exception", "-", None)
    misses, above, steps = (sum(r[name] for r in records) for name in ("misses", "above_tolerance", "steps"))
    measured = f"{misses:,} unconverged, {above:,} residuals above tolerance in {steps:,} steps"
    return Target(what, "no exception", measured, misses + above == 0)
