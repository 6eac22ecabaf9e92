"""Stairs (T ch. 8), which the thesis asks a 3D model to have."""

from __future__ import annotations

from snake_env.reproduce.experiment import Runs
from snake_env.reproduce.findings import Result, Rows
from snake_env.reproduce.stairs import CASES, FRICTION, HIGH, STEPS, TWICE_THE_FRICTION, climbed

rows = Rows("8")

TOLERANCE = 0.25
"""Of a height, in steps."""


@rows.ours(
    "three steps across the way of sidewinding",
    bound="with the thesis's lift of 10 degrees it climbs all steps of 1 cm and none of 2 cm; with twice the lift "
    "those of 2 cm too; a step of 6 cm in at most a third of the runs, with twice the friction in more runs and at "
    "least a third: the links that push must hold while others are lifted over the edge, and whether they catch it "
    "changes with the coefficient's second digit",
)
def _climbing(runs: Runs) -> Result:
    found = {case: climbed(runs, *case) for case in CASES}
    slipping, holding = (
        [climbed(runs, *HIGH, mu) > 1.0 - TOLERANCE for mu in each] for each in (FRICTION, TWICE_THE_FRICTION)
    )
    ours = "; ".join(
        f"{max(steps, 0.0):.0f} steps of {rise} cm with {lift} deg, mu = {mu:g}"
        for (lift, rise, mu), steps in found.items()
    )
    lift, rise = HIGH
    ours += (
        f"; a step of {rise} cm with {lift} deg in {sum(slipping)} of {len(FRICTION)} runs with mu from {FRICTION[0]} "
        f"to {FRICTION[-1]}, in {sum(holding)} with twice that"
    )
    low, high, lifted = found.values()
    holds = abs(low - STEPS) < TOLERANCE and abs(lifted - STEPS) < TOLERANCE and high < TOLERANCE
    few = 3 * sum(slipping) <= len(slipping) and sum(slipping) < sum(holding)
    return ours, holds and few and 3 * sum(holding) >= len(holding)
