"""The targets of the project in numbers, each with what was measured."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from benchmarks import curves, equal_error
from benchmarks.results import COMPARED, Record, Results

ACCURATE = 0.5
"""Error of the worst link over the whole run at the default step [mm]."""
AHEAD = {
    "in the plane": {0.1: 80.0, 0.3: 40.0, 1.0: 40.0},
    "in 3D": {0.2: 50.0, 0.3: 30.0, 1.0: 10.0},
}
"""How many times less a second costs than MuJoCo's at an error [mm] under random actions, in the worst case."""
AHEAD_3D = {"spatial-course-7.5": (0.64, 40.0), "spatial-sidewinding": (10.0, 10.0)}
"""Error [mm], and times faster than MuJoCo at that error."""
TWO_THREADS = 1.95
INTERFACE = {"Gymnasium [us]": 4.0, "SB3 [us]": 15.0}
"""CPU time of a call of ``step`` without physics."""
SIMULATING = 0.5
"""Share of the simulator in the wall time of Stable-Baselines3's PPO in 3D."""


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
        *_accuracy(results),
        *_ahead(results),
        *_ahead_in_3d(results),
        _two_threads(results),
        *_growth(results),
        _skip(results),
        *_interface(results),
        _learning(results),
        _certificate(results),
    ]


def rate(results: Results, env: str, actions: str) -> float | None:
    """Our environment steps per CPU second of one thread."""
    records = results.of("growth", axis="batch", env=env, actions=actions, robots=COMPARED, threads=1)
    return records[0]["steps_per_cpu_second"] if records else None


def _ahead(results: Results) -> Iterator[Target]:
    cases = equal_error.cases(results)
    for where, aims in AHEAD.items():
        own = [case for case in cases if (case[0] == "SnakeSpatial-v1") == (where == "in 3D")]
        for error, aim in aims.items():
            what = f"random actions {where}, worst case: cost of MuJoCo over ours at {error:g} mm"
            both = [(equal_error.ratio(results, case, error), case) for case in own]
            known = [(ratio, case) for ratio, case in both if ratio]
            if known:
                least, (env, actions) = min(known)
                yield Target(what, f">= {aim:g}x", f"{least:.0f}x ({env}, {actions})", least >= aim)
            else:
                yield Target(what, f">= {aim:g}x", "not reached by MuJoCo's steps" if own else "-", None)


def _ahead_in_3d(results: Results) -> Iterator[Target]:
    for scene, (millimetres, aim) in AHEAD_3D.items():
        what = f"{scene}: simulated seconds over MuJoCo's at {millimetres:g} mm"
        both = (curves.frontier(curves.points(results, scene, whose)) for whose in (curves.OURS, "MuJoCo"))
        ours, peer = (curves.speed_at(curve, 1e-3 * millimetres) for curve in both)
        if ours and peer:
            yield Target(what, f">= {aim:g}x", f"{ours / peer:.1f}x", ours / peer >= aim)
        else:
            missing = "MuJoCo does not reach it" if ours else "not reached" if results.of("scene", scene=scene) else "-"
            yield Target(what, f">= {aim:g}x", missing, bool(ours) if missing != "-" else None)


def _two_threads(results: Results) -> Target:
    what, aim = "two threads over one, 64 robots and more, worst environment", f">= {TWO_THREADS}x"
    gains = []
    for one in results.of("growth", axis="batch", threads=1):
        same = {name: one[name] for name in ("env", "actions", "robots")}
        for two in results.of("growth", axis="batch", threads=2, **same):
            if one["robots"] >= 64:
                row = f"{one['env']}, {one['actions']}, {one['robots']:,} robots"
                gains.append((two["steps_per_second"] / one["steps_per_second"], row))
    if not gains:
        return Target(what, aim, "-", None)
    least, where = min(gains)
    return Target(what, aim, f"{least:.2f}x ({where})", least >= TWO_THREADS)


def _growth(results: Results) -> Iterator[Target]:
    for scene in ("free", "track"):
        links = results.of("growth", axis="links", scene=scene)
        yield _spread(f"growth with links, {scene}: time per link", links, "us_per_link", 1.3, "links")
    pegs = results.of("growth", axis="pegs")
    yield _spread("growth with pegs in the field: time per step", pegs, "us_per_step", 1.2, "pegs")
    course = results.of("growth", axis="batch", env="SnakeCourse-v1", actions="gait", threads=1)
    large = [r for r in course if r["robots"] >= 64]
    yield _spread(
        "growth with batch beyond 64 robots: rate of one thread", large, "steps_per_cpu_second", 1.2, "robots"
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


def _skip(results: Results) -> Target:
    rows = results.of("skip", idle=True)
    worst: Any = max(rows, key=lambda r: r["ratio"], default=None)
    measured = "-" if worst is None else f"{100 * (worst['ratio'] - 1):+.1f} % ({worst['feature']}: {worst['on']})"
    met = None if worst is None else worst["ratio"] <= 1.02
    return Target("a feature the scene does not need", "<= 2 %", measured, met)


def _accuracy(results: Results) -> Iterator[Target]:
    """The environments' own method and step."""
    for scene in ("free", "course-7.5", "course-7.3"):
        step = [r for r in results.of("point", scene=scene, default=True) if r["error"]]
        what, aim = f"default step, {scene}: error of the worst link over the run", f"<= {ACCURATE:g} mm"
        if step:
            error = 1e3 * step[0]["error"]["worst"]
            yield Target(what, aim, f"{error:.2g} mm", error <= ACCURATE)
        else:
            yield Target(what, aim, "-", None)


def _interface(results: Results) -> Iterator[Target]:
    for name, aim in INTERFACE.items():
        what, rows = f"interface, {COMPARED} robots: {name}", results.of("interface", robots=COMPARED)
        if rows and name in rows[0]:
            yield Target(what, f"<= {aim:g}", f"{rows[0][name]:g}", rows[0][name] <= aim)
        else:
            yield Target(what, f"<= {aim:g}", "-", None)


def _learning(results: Results) -> Target:
    what, aim = "Stable-Baselines3's PPO in 3D: share of the simulator", f"<= {100 * SIMULATING:g} %"
    rows = results.of("learning", env="SnakeSpatial-v1")
    if not rows:
        return Target(what, aim, "-", None)
    ours, learner = rows[0]["simulator [us]"], rows[0]["learner [us]"]
    share = ours / (ours + learner)
    return Target(what, aim, f"{100 * share:.0f} %", share <= SIMULATING)


def _certificate(results: Results) -> Target:
    """Verified: solved to the tolerance according to code that no solver uses."""
    what = "every stage verified, scenes and random fields"
    records = results.of("certificate")
    if not records:
        return Target(what, "no exception", "-", None)
    misses, above, steps = (sum(r[name] for r in records) for name in ("misses", "above_tolerance", "steps"))
    measured = f"{misses:,} unconverged, {above:,} residuals above tolerance in {steps:,} steps"
    return Target(what, "no exception", measured, misses + above == 0)
