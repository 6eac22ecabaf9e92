"""The results as a Markdown page."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from benchmarks import comparison, equal_error, texts
from benchmarks.results import Record, Results
from benchmarks.targets import all_targets, rate
from snake_env.markdown import table

BUSY = 0.5
"""Load above which other work is mentioned."""


def render(results: Results, images: str, published: bool = False) -> str:
    """The whole page.

    Args:
        results: of a run.
        images: path of the pictures, seen from the page.
        published: leave out the tables that only developers of a part need; the page of each run has them.
    """
    sections = [_head(results), equal_error.render(results, published), _speeds(results)]
    if not published:
        sections += [_widths(results), _targets(results)]
    sections.append(comparison.render(results, images, tables=not published))
    growth = [*_growth(results, images)]
    if published:
        sections += [*growth[:1], texts.PUBLISHED]
    else:
        sections += [*growth, _skip(results), _certificate(results), _interface(results)]
    return "\n\n".join(section for section in [*sections, texts.HOW] if section) + "\n"


def _head(results: Results) -> str:
    machine, versions = results.machine, results.versions
    packages = ", ".join(f"{name} {value}" for name, value in versions.items() if value and name != "rustc")
    notes = []
    if results.quick:
        notes.append("Quick run: few settings, few repetitions.")
    if not results.complete:
        notes.append("**Stopped before the end**: partial results.")
    if (machine.get("load") or 0.0) > BUSY:
        load = f"{machine['load']:.1f} runnable processes at the start"
        notes.append(f"**The machine was busy**: {load}. This affects wall-clock rates much more than CPU times.")
    for run in results.of("run"):
        notes.append(
            f"Measured anew by `{run['command']}`: {run['seconds'] / 60:.1f} minutes on {run['machine']['cpu']}, "
            f"commit `{run['commit']}`."
        )
    if not results.of("peer"):
        notes.append("MuJoCo was not installed (dependency group `bench`): no comparison with it.")
    lines = [
        "# Benchmarks",
        "",
        f"Written by `{results.command}`; nothing here is typed by hand. {results.seconds / 60:.1f} minutes on",
        f"{machine['cpu']}, {machine['cores']} cores, {machine['system']} {machine['architecture']};",
        f"commit `{results.commit}`; {versions.get('rustc')}; {packages}.",
    ]
    text = "\n".join(lines)
    return "\n\n".join([text, *notes])


SPEEDS = ("environment", "gait", "random", "random joints")


def _speeds(results: Results) -> str:
    """Environments x actions."""
    rows = []
    for env in dict.fromkeys(r["env"] for r in results.of("growth", axis="batch")):
        rows.append((f"`{env}`", *(_count(rate(results, env, actions)) for actions in SPEEDS[1:])))
    if not rows:
        return ""
    return f"{texts.SPEEDS}\n\n{table(SPEEDS, rows)}"


def _widths(results: Results) -> str:
    """Environments in registers of every width."""
    records = results.of("width")
    if not records:
        return ""
    widths = sorted({r["lanes"] for r in records})
    rows = []
    for env, actions in dict.fromkeys((r["env"], r["actions"]) for r in records):
        rates = {r["lanes"]: r["steps_per_cpu_second"] for r in records if (r["env"], r["actions"]) == (env, actions)}
        rows.append((f"`{env}`", actions, *(_count(rates.get(lanes)) for lanes in widths)))
    head = ("environment", "actions", *(f"{lanes} per register" for lanes in widths))
    return f"{texts.WIDTHS}\n\n{table(head, rows)}"


def _count(value: float | None) -> str:
    return "-" if value is None else f"{value:,.0f}"


def _targets(results: Results) -> str:
    rows = [(t.what, t.target, t.measured, t.verdict) for t in all_targets(results)]
    return f"## Targets\n\n{table(('quantity', 'target', 'measured', ''), rows)}"


FLEET = ("scene", "links", "pegs", "us per step", "us per link", "solves per step", "divided steps", "us per peg scan")


def _growth(results: Results, images: str) -> Iterator[str]:
    if not results.of("growth"):
        return
    yield f"## Growth\n\n![Growth]({images}/bench-growth.png)"
    fleets = [*results.of("growth", axis="links"), *results.of("growth", axis="pegs")]
    if fleets:
        yield f"{texts.GROWTH}\n\n{table(FLEET, map(_fleet_row, fleets))}"
    if results.of("growth", axis="batch"):
        yield f"{texts.BATCH}\n\n{_batch_table(results)}"


SIZES = (1, 64, 256, 1024)
"""Numbers of robots of the table; the picture shows all."""


def _rates(results: Results, env: str, actions: str) -> dict[int, dict[int, float]]:
    """Robots -> threads -> environment steps per second."""
    rates: dict[int, dict[int, float]] = {}
    for r in results.of("growth", axis="batch", env=env, actions=actions):
        rates.setdefault(r["robots"], {})[r["threads"]] = r["steps_per_second"]
    return rates


def _batch_table(results: Results) -> str:
    records = results.of("growth", axis="batch")
    sizes = sorted({r["robots"] for r in records} & set(SIZES))
    rows = []
    for env, actions in dict.fromkeys((r["env"], r["actions"]) for r in records):
        rates = _rates(results, env, actions)
        cells = [" / ".join(f"{rate:,.0f}" for _, rate in sorted(rates.get(size, {}).items())) for size in sizes]
        two = results.of("growth", axis="batch", env=env, actions=actions, threads=2)
        busy = [r["utilisation"] for r in two if r["robots"] >= 64]
        rows.append((env, actions, *cells, f"{100 * min(busy):.0f} %" if busy else "-"))
    return table(("environment", "actions", *(f"{size:,}" for size in sizes), "busy"), rows)


def _fleet_row(r: Record) -> tuple[Any, ...]:
    look = "-" if r["us_per_look"] is None else f"{r['us_per_look']:.2f}"
    times = f"{r['us_per_step']:.2f}", f"{r['us_per_link']:.3f}"
    return (
        r["scene"],
        r["links"],
        f"{r['pegs']:,}",
        *times,
        f"{r['iterations_per_step']:.1f}",
        _percent(r["events_per_step"]),
        look,
    )


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"


def _skip(results: Results) -> str:
    rows = []
    for r in results.of("skip"):
        spread = f"{r['ratio']:.3f} [{r['ratio_low']:.3f}, {r['ratio_high']:.3f}]"
        kind = "cannot act" if r["idle"] else "acts"
        rows.append((r["feature"], r["off"], r["on"], kind, spread))
    if not rows:
        return ""
    head = ("feature", "off", "on", "on, it", "on / off [middle half]")
    pressed = [
        (f"{r['bend']:g}", *(f"{r[name]:.2f}" for name in ("pairs", "solves", "us_step", "us_solve")))
        for r in results.of("pressed")
    ]
    section = f"{texts.SKIP}\n\n{table(head, rows)}"
    if not pressed:
        return section
    columns = ("joints at [rad]", "pressed pairs", "solves per step", "step [us]", "solve [us]")
    return f"{section}\n\n{texts.PRESSED}\n\n{table(columns, pressed)}"


def _certificate(results: Results) -> str:
    rows = []
    for r in results.of("certificate"):
        cells = [" / ".join(f"{value:.1g}" for value in r[key]) for key in ("residual", "gap")]
        solves = " / ".join(f"{value:.1f}" for value in r["iterations"])
        counts = (f"{r[name]:,}" for name in ("events", "misses", "above_tolerance"))
        rows.append((r["what"], f"{r['steps']:,}", *cells, solves, *counts))
    if not rows:
        return ""
    head = (
        "motion",
        "steps",
        "residual [m/s]",
        "duality gap [J]",
        "solves per step",
        "divided steps",
        "unconverged",
        "above tolerance",
    )
    return f"{texts.CERTIFICATE}\n\n{table(head, rows)}"


def _interface(results: Results) -> str:
    parts = [(text, results.of(kind)) for kind, text in (("interface", texts.INTERFACE), ("learning", texts.LEARNING))]
    return "\n\n".join(f"{text}\n\n{_whole_table(rows)}" for text, rows in parts if rows)


def _whole_table(rows: list[Record]) -> str:
    names = [name for name in rows[0] if name != "kind"]
    return table(names, ([r[name] for name in names] for r in rows))
