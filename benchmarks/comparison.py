"""The page's section on error against run time."""

from __future__ import annotations

from benchmarks import curves, independent, texts
from benchmarks.results import Record, Results
from snake_env.markdown import table

ERRORS = (10.0, 2.0, 0.5, 0.1)
"""Errors of the worst link over the run at which curves are compared [mm]."""


def render(results: Results, images: str, tables: bool = True) -> str:
    """The section on error against run time, with a table for each scene or with pictures only."""
    scenes = results.of("scene")
    if not scenes:
        return ""
    parts = [texts.PRECISION, _reference_table(scenes) if tables else "", _default_table(results, scenes)]
    for scene in scenes:
        name = scene["scene"]
        title = title_of(scene)
        heading = f"### {title[0].upper()}{title[1:]}\n\n" if tables else ""  # pictures have a title
        parts.append(f"{heading}![{title}]({images}/bench-{name}.png)")
        parts.append(_own_reference(results, name))
        if tables:
            parts.append(_ratio_table(results, name))
    return "\n\n".join(part for part in parts if part)


def title_of(scene: Record) -> str:
    """The scene in words."""
    return str(scene["title"])


def _own_reference(results: Results, scene: str) -> str:
    """The reference of a peer, where it is not ours."""
    record = next((r for r in results.of("peer", scene=scene) if "against" in r), None)
    if record is None:
        return ""
    apart, check = (f"{1e3 * record[name]['worst']:.2g}" for name in ("apart", "uncertainty"))
    return (
        f"{record['curve']} is judged by {record['against']}, whose worst link is up to {apart} mm from ours (two of "
        f"its fine runs differ by {check} mm)."
    )


def _reference_table(scenes: list[Record]) -> str:
    rows = []
    for scene in scenes:
        reference = scene["reference"]
        check = reference["uncertainty"]
        steps = " and ".join(f"{1e3 * step:g}" for step in reference["steps"])
        other = independent.distance(scene)
        rows.append((title_of(scene), steps, *(_micro(d) for d in (check["worst"], check["end"], other))))
    head = ("scene", "steps of the two runs [ms]", "apart over the run [um]", "apart at the end [um]")
    return table((*head, "from an independent implementation over the run [um]"), rows)


def _default_table(results: Results, scenes: list[Record]) -> str:
    """Errors at the default step of each model."""
    rows = []
    for scene in scenes:
        for point in results.of("point", scene=scene["scene"], default=True):
            if point["error"]:
                errors = (f"{1e3 * point['error'][name]:.2g}" for name in ("worst", "end"))
                rows.append((title_of(scene), f"{1e3 * point['integrator']['step']:g}", *errors))
    head = ("scene", "default step [ms]", "error over the run [mm]", "error at the end [mm]")
    return f"{texts.DEFAULT}\n\n{table(head, rows)}" if rows else ""


def _micro(metres: float | None) -> str:
    return "-" if metres is None else f"{1e6 * metres:.2g}"


def _ratio_table(results: Results, scene: str) -> str:
    """Speeds at equal error, interpolated."""
    lanes, alone = (
        curves.frontier(curves.points(results, scene, curves.OURS, s)) for s in ("speed_fleet", "speed_alone")
    )
    thesis, mujoco = (curves.frontier(curves.points(results, scene, whose)) for whose in (curves.THESIS, "MuJoCo"))
    rows = []
    for error in ERRORS:
        ours, one, other, peer = (curves.speed_at(curve, 1e-3 * error) for curve in (lanes, alone, thesis, mujoco))
        if ours is not None or one is not None:
            cells = [_speed(value) for value in (ours, one, other, peer)]
            rows.append((f"{error:g}", *cells, _times(ours, other), _times(ours, peer)))
    head = (
        "error [mm]",
        "ours, lanes",
        "ours, one robot",
        "Algorithm 3.1",
        "MuJoCo",
        "ours / Alg. 3.1",
        "ours / MuJoCo",
    )
    return table(head, rows) if rows else ""


def _speed(value: float | None) -> str:
    return "-" if value is None else f"{value:,.0f}"


def _times(ours: float | None, other: float | None) -> str:
    return "-" if not ours or not other else f"{ours / other:.1f}x"
