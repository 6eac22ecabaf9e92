"""The rows of the table of findings, one module per group of sections."""

from __future__ import annotations

from snake_env.reproduce.checks import (
    aiko,
    broken,
    comparison,
    control,
    drop,
    free_and_pegs,
    gaits,
    lyapunov,
    mechanism,
    obstacles,
    parameters,
    rolling,
    sidewinding,
    slope,
    stairs,
)

CHECKS = [
    check
    for rows in (
        comparison.rows,
        slope.rows,
        gaits.rows,
        mechanism.rows,
        lyapunov.rows,
        drop.rows,
        rolling.rows,
        sidewinding.friction_rows,
        obstacles.rows,
        parameters.rows,
        control.rows,
        sidewinding.rows,
        aiko.sidewinding,
        free_and_pegs.free,
        aiko.free,
        free_and_pegs.pegs,
        parameters.motor_rows,
        aiko.course,
        free_and_pegs.summary,
        broken.rows,
        stairs.rows,
    )
    for check in rows.checks
]
"""In the order of the thesis."""
