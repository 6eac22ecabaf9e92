"""The rows of the table of findings, one module per group of sections."""

from __future__ import annotations

from snake_env.reproduce.checks import control, drop, free_and_pegs, gaits, obstacles, rolling, sidewinding

CHECKS = [
    check
    for rows in (
        gaits.rows,
        drop.rows,
        rolling.rows,
        sidewinding.friction_rows,
        obstacles.rows,
        control.rows,
        sidewinding.rows,
        free_and_pegs.free,
        free_and_pegs.pegs,
        free_and_pegs.summary,
    )
    for check in rows.checks
]
"""In the order of the thesis."""
