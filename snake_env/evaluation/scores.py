"""From episodes to a table: what is reported about a policy, with 95 % confidence intervals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from snake_env.evaluation.rollout import Episodes, energy_over_weight
from snake_env.evaluation.statistics import Estimate, mean_interval, paired_difference, ratio_interval


@dataclass(frozen=True)
class Score:
    """One column of the table.

    Attributes:
        name: key in JSON and heading.
        unit: of the values.
        decimals: printed.
        estimate: from episodes to value and interval.
    """

    name: str
    unit: str
    decimals: int
    estimate: Callable[[Episodes], Estimate]


def _time_to_goal(episodes: Episodes) -> Estimate:
    """Over the episodes that reach the goal."""
    return mean_interval(episodes["time"][episodes["is_success"]])


def _cost_of_transport(episodes: Episodes) -> Estimate:
    """All positive work of the actuators over weight times all distance; infinite without net progress."""
    return ratio_interval(energy_over_weight(episodes), episodes["distance"])


def _contact_free(episodes: Episodes) -> Estimate:
    """Share of all progress that was made while nothing pushed; infinite without net progress."""
    return ratio_interval(episodes["contact_free_progress"], episodes["distance"])


def _mean_of(name: str) -> Callable[[Episodes], Estimate]:
    return lambda episodes: mean_interval(episodes[name].astype(np.float64))


SCORES = (
    Score("success", "1", 3, _mean_of("is_success")),
    Score("progress", "m", 3, _mean_of("distance")),
    Score("speed", "m/s", 3, _mean_of("speed")),
    Score("time_to_goal", "s", 1, _time_to_goal),
    Score("jam_ratio", "1", 3, _mean_of("jam_ratio")),
    Score("self_contact_force", "N", 2, _mean_of("mean_self_contact_force")),
    Score("cost_of_transport", "1", 2, _cost_of_transport),
    Score("left_corridor", "1", 3, _mean_of("left_corridor")),
    Score("contact_free", "1", 3, _contact_free),
    Score("chatter", "1", 3, _mean_of("chatter")),
)

Row = dict[str, Estimate]

WIDEST = 100
"""Characters of a line of a table."""

LATEX = str.maketrans({character: f"\\{character}" for character in "_&%#$"})
"""What LaTeX would read as a command."""


def score(episodes: Episodes) -> Row:
    """All scores of a policy."""
    return {one.name: one.estimate(episodes) for one in SCORES}


def against(episodes: Episodes, reference: Episodes) -> Row:
    """Differences in success, progress and speed to another policy on the same fields, field by field."""
    return {
        "success": paired_difference(episodes["is_success"], reference["is_success"]),
        "progress": paired_difference(episodes["distance"], reference["distance"]),
        "speed": paired_difference(episodes["speed"], reference["speed"]),
    }


def table(rows: dict[str, Row]) -> str:
    """Policies by line, scores by column: value [low, high]; in several parts of at most 100 characters per line."""
    lines = [["", *map(_heading, SCORES)]]
    lines += [[name, *(cell(row[one.name], one.decimals) for one in SCORES)] for name, row in rows.items()]
    first, *columns = (
        [cell.ljust(max(map(len, column)) + 2) for cell in column] for column in zip(*lines, strict=True)
    )
    parts: list[list[str]] = []
    for column in columns:
        if not parts or len(parts[-1][0]) + len(column[0]) > WIDEST + 2:
            parts.append(first)
        parts[-1] = [line + cell for line, cell in zip(parts[-1], column, strict=True)]
    return "\n\n".join("\n".join(line.rstrip() for line in part) for part in parts)


def latex(rows: dict[str, Row]) -> str:
    """Policies by column, scores by line, as a tabular in the style of the package ``booktabs``."""
    lines = [["", *(name.translate(LATEX) for name in rows)]]
    lines += [
        [_heading(one).replace("_", " "), *(cell(row[one.name], one.decimals) for row in rows.values())]
        for one in SCORES
    ]
    head, *body = (f"{' & '.join(line)} \\\\" for line in lines)
    begin = f"\\begin{{tabular}}{{l{'r' * len(rows)}}}"
    return "\n".join([begin, "\\toprule", head, "\\midrule", *body, "\\bottomrule", "\\end{tabular}", ""])


def _heading(one: Score) -> str:
    return one.name if one.unit == "1" else f"{one.name} [{one.unit}]"


def difference_text(name: str, other: str, difference: Row) -> str:
    """One sentence about two policies."""
    parts = []
    for key, unit in (("success", ""), ("progress", " m")):
        value, low, high = difference[key]
        parts.append(f"{key} {value:+.3f}{unit} [{low:+.3f}, {high:+.3f}]")
    return f"{name} against {other}, field by field: " + ", ".join(parts)


def cell(estimate: Estimate, decimals: int) -> str:
    """Value [low, high], or a dash where there is none."""
    value, low, high = (f"{number:.{decimals}f}" for number in estimate)
    return f"{value} [{low}, {high}]" if np.isfinite(estimate.value) else "-"


def from_plain(found: dict[str, dict[str, float | None]]) -> Row:
    """From what :func:`plain` made; numbers that were not finite are NaN."""
    return {
        name: Estimate(**{key: np.nan if value is None else value for key, value in estimate.items()})
        for name, estimate in found.items()
    }


def plain(row: Row) -> dict[str, dict[str, float | None]]:
    """For JSON; numbers that are not finite become null."""
    return {
        name: {key: value if np.isfinite(value) else None for key, value in estimate._asdict().items()}
        for name, estimate in row.items()
    }
