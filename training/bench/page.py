"""The results as a Markdown page."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from training.bench import curves
from training.bench.curves import Point
from training.bench.results import Record, Results
from training.bench.targets import AHEAD, COMMAND, all_targets, describe

ERRORS = (10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01)
"""Errors of link 6 at which curves are compared [mm]."""


def render(results: Results, images: str) -> str:
    """The whole page.

    Args:
        results: of a run.
        images: path of the pictures, seen from the page.
    """
    sections = [_head(results), _targets(results), _work_precision(results, images), *_growth(results, images)]
    sections += [_skip(results), _certificate(results), _interface(results), HOW]
    return "\n\n".join(section for section in sections if section) + "\n"


def table(head: Iterable[str], rows: Iterable[Iterable[Any]]) -> str:
    """A Markdown table."""
    head = list(head)
    lines = [head, ["---"] * len(head), *([str(cell) for cell in row] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _head(results: Results) -> str:
    machine, versions = results.machine, results.versions
    packages = ", ".join(f"{name} {value}" for name, value in versions.items() if value and name != "rustc")
    notes = []
    if results.quick:
        notes.append("A quick look: few settings, few repetitions.")
    if not results.complete:
        notes.append("**Stopped before the end**: what was measured until then.")
    if not results.of("peer"):
        notes.append("MuJoCo was not installed (extra `bench`), so there is no comparison with it.")
    text = f"""# Benchmarks

Written by `{results.command}`; nothing here is typed by hand. {machine["cpu"]}, {machine["cores"]} cores, {machine["system"]}
{machine["architecture"]}; commit `{results.commit}`; {versions.get("rustc")}; {packages}. {results.seconds / 60:.1f} minutes."""
    return "\n\n".join([text, *notes])


def _targets(results: Results) -> str:
    rows = [(t.what, t.target, t.measured, f"`{COMMAND}`", t.verdict) for t in all_targets(results)]
    return "## Targets\n\n" + table(("target", "aim", "measured", "command", ""), rows)


def _work_precision(results: Results, images: str) -> str:
    scenes = results.of("scene")
    if not scenes:
        return ""
    parts = [PRECISION, _reference_table(scenes)]
    for scene in scenes:
        name = scene["scene"]
        parts.append(f"### {scene['title'].capitalize()}\n\n![{scene['title']}]({images}/bench-{name}.png)")
        parts.append(_ratio_table(results, name))
        parts.append(_frontier_table(results, name))
    return "\n\n".join(parts)


def _reference_table(scenes: list[Record]) -> str:
    rows = []
    for scene in scenes:
        reference = scene["reference"]
        check = reference["uncertainty"]
        steps = " and ".join(f"{1e3 * step:g}" for step in reference["steps"])
        rows.append((scene["title"], steps, f"{1e6 * check['worst']:.2g}", f"{1e6 * check['link6']:.2g}"))
    return table(("scene", "steps of the two runs [ms]", "worst link apart [um]", "link 6 apart [um]"), rows)


def _ratio_table(results: Results, scene: str) -> str:
    """Speeds at equal error, interpolated."""
    lanes, alone = (curves.frontier(curves.points(results, scene, curves.OURS, s)) for s in ("speed_fleet", "speed_alone"))
    thesis, mujoco = (curves.frontier(curves.points(results, scene, whose)) for whose in (curves.THESIS, "MuJoCo"))
    rows = []
    for error in ERRORS:
        ours, one, other, peer = (curves.speed_at(curve, 1e-3 * error) for curve in (lanes, alone, thesis, mujoco))
        if ours is not None or one is not None:
            cells = [_speed(value) for value in (ours, one, other, peer)]
            rows.append((f"{error:g}", *cells, _times(ours, other), _times(ours, peer)))
    head = ("error [mm]", "ours, lanes", "ours, one robot", "Algorithm 3.1", "MuJoCo", "ours / Alg. 3.1", "ours / MuJoCo")
    return table(head, rows) if rows else ""


def _speed(value: float | None) -> str:
    return "-" if value is None else f"{value:,.0f}"


def _times(ours: float | None, other: float | None) -> str:
    return "-" if not ours or not other else f"{ours / other:.1f}x"


def _frontier_table(results: Results, scene: str) -> str:
    """The settings behind the curves."""
    rows: list[tuple[str, ...]] = []
    for name, whose, speed in (
        ("ours, lanes", curves.OURS, "speed_fleet"),
        ("Algorithm 3.1", curves.THESIS, "best"),
        ("MuJoCo", "MuJoCo", "best"),
    ):
        rows += [(name, *_row(p)) for p in curves.frontier(curves.points(results, scene, whose, speed))]
    if not rows:
        return ""
    text = table(("", "link 6 [mm]", "worst link [mm]", "simulated s/s", "settings"), rows)
    return f"<details><summary>Settings on the curves</summary>\n\n{text}\n\n</details>"


def _row(point: Point) -> tuple[str, str, str, str]:
    error = point.record["error"]
    return f"{1e3 * error['link6']:.3g}", f"{1e3 * error['worst']:.3g}", f"{point.speed:,.0f}", describe(point.record)


def _growth(results: Results, images: str) -> Iterator[str]:
    if not results.of("growth"):
        return
    yield f"## Growth\n\n![Growth]({images}/bench-growth.png)"
    fleets = [*results.of("growth", axis="links"), *results.of("growth", axis="pegs")]
    if fleets:
        yield GROWTH
        head = ("scene", "links", "pegs", "us per step", "us per link", "solves per step", "retaken steps", "us per look of the peg sensor")
        yield table(head, map(_fleet_row, fleets))
    crowds = results.of("growth", axis="batch")
    if crowds:
        yield BATCH
        head = ("environment", "actions", "robots", "threads", "env-steps/s", "per CPU second", "threads busy")
        yield table(head, map(_crowd_row, crowds))
    peers = results.of("peer_batch")
    if peers:
        rows = [(r["peer"], r["scene"], f"{r['robots']:,}", r["threads"], f"{r['steps_per_second']:,.0f}") for r in peers]
        yield PEER_BATCH + "\n\n" + table(("peer", "scene", "robots", "threads", "env-steps/s"), rows)


def _fleet_row(r: Record) -> tuple[Any, ...]:
    look = "-" if r["us_per_look"] is None else f"{r['us_per_look']:.2f}"
    times = f"{r['us_per_step']:.2f}", f"{r['us_per_link']:.3f}"
    return r["scene"], r["links"], f"{r['pegs']:,}", *times, f"{r['iterations_per_step']:.1f}", _percent(r["events_per_step"]), look


def _crowd_row(r: Record) -> tuple[Any, ...]:
    rates = f"{r['steps_per_second']:,.0f}", f"{r['steps_per_cpu_second']:,.0f}"
    return r["env"], r["actions"], f"{r['robots']:,}", r["threads"], *rates, f"{100 * r['utilisation']:.0f} %"


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"


def _skip(results: Results) -> str:
    rows = []
    for r in results.of("skip"):
        spread = f"{r['ratio']:.3f} [{r['ratio_low']:.3f}, {r['ratio_high']:.3f}]"
        kind = "cannot act" if r["idle"] else "acts"
        rows.append((r["feature"], r["off"], r["on"], kind, r["unit"], f"{r['us_off']:.3f}", f"{r['us_on']:.3f}", spread))
    if not rows:
        return ""
    head = ("feature", "off", "on", "on, it", "unit", "off [us]", "on [us]", "on / off [middle half]")
    return f"{SKIP}\n\n{table(head, rows)}"


def _certificate(results: Results) -> str:
    rows = []
    for r in results.of("certificate"):
        cells = [" / ".join(f"{value:.1g}" for value in r[key]) for key in ("residual", "gap")]
        solves = " / ".join(f"{value:.1f}" for value in r["iterations"])
        rows.append((r["what"], f"{r['steps']:,}", *cells, solves, f"{r['events']:,}", f"{r['misses']:,}"))
    if not rows:
        return ""
    head = ("motion", "steps", "residual [m/s]", "duality gap [J]", "solves per step", "retaken steps", "misses")
    return f"{CERTIFICATE}\n\n{table(head, rows)}"


def _interface(results: Results) -> str:
    rows = results.of("interface")
    if not rows:
        return ""
    names = [name for name in rows[0] if name != "kind"]
    return f"{INTERFACE}\n\n{table(names, ([r[name] for name in names] for r in rows))}"


PRECISION = f"""## Error against run time

One robot follows the gait (T 7.3) for five seconds. The error is the distance of link 6 from the converged solution, which the bench
computes itself with two fine runs; their distance bounds what the reference is worth, and errors below {curves.TRUST:g} times it are shown there.
Speed is simulated seconds per CPU second of one thread, a median of repetitions taken in turn: of one robot alone, and of 64 robots
in eight lanes, staggered over the five seconds so that no lane does what its neighbour does. A curve is made of the points that no
other setting of the same method beats in both. The aim against each peer is {AHEAD:g}x. At equal error, interpolated between logarithms:"""

GROWTH = """A step is one of the default method, of one robot in a fleet of 64. *Solves* are eliminations of the chain; a step in which a peg
contact closes anywhere along the body is retaken in small ones, so longer bodies among pegs retake more of them."""

BATCH = """Control period 50 ms; robots start in the middle of their episodes, and episodes that end are started anew within the time measured."""

PEER_BATCH = "The same robot and course in `mujoco.batch`, control period 50 ms, steps of 10 ms, nothing but physics:"

SKIP = """## What a feature costs

A feature that *cannot act* leaves the motion as it is without it, so its cost is what a scene pays for something it does not need
(aim: at most 2 %). One that *acts* also changes the motion and the number of solves. Median of ratios of pairs timed in turn."""

CERTIFICATE = """## Certificates

Percentiles 50 / 90 / 99 / 100 over steps (scenes) or control periods (environments). Residual and duality gap are the worst of an
interval's stages, judged by code that no solver uses; a miss is a stage given up before its tolerance."""

INTERFACE = """## Interface

CPU time of one call of `step` around physics that does nothing."""

HOW = """## How to reproduce

    make bench                       # everything, within 20 minutes; runs/bench
    make bench BENCH=--quick         # within 2 minutes
    make bench BENCH="--parts precision --scenes free,course-7.5"
    make bench BENCH=--write-docs    # everything, and this page

Ctrl-C stops cleanly and keeps what was measured. `cargo bench -p snake-core` times single kernels."""
