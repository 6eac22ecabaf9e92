"""Stairs (T ch. 8), which the thesis asks a 3D model to have."""

from __future__ import annotations

from snake_env.reproduce.experiment import Runs
from snake_env.reproduce.findings import Result, Rows
from snake_env.reproduce.stairs import CASES, NEARBY, STEPS, climbed

rows = Rows("8")

TOLERANCE = 0.25
"""Of a height, in steps."""


@rows.ours(
    "three steps across the way of sidewinding",
    bound="with the thesis's lift of 10 degrees it climbs all steps of 1 cm and none of 2 cm; with twice the lift "
    "those of 2 cm too; steps of 6 cm only with about twice the friction, and at least the first in a third of the "
    "runs: the links that push must hold while others are lifted over the edge, and whether they catch it changes "
    "with the coefficient's second digit",
)
def _climbing(runs: Runs) -> Result:
    *cases, (lift, rise, _) = CASES
    found = {case: climbed(runs, *case) for case in cases}
    held = sum(climbed(runs, lift, rise, mu) > 1.0 - TOLERANCE for mu in NEARBY)
    ours = "; ".join(
        f"{max(steps, 0.0):.0f} steps of {rise} cm with {lift} deg, mu = {mu:g}"
        for (lift, rise, mu), steps in found.items()
    )
    ours += f"; one of {rise} cm or more with {held} of {len(NEARBY)} mu from {NEARBY[0]} to {NEARBY[-1]}"
    low, high, lifted, steep = found.values()
    holds = abs(low - STEPS) < TOLERANCE and abs(lifted - STEPS) < TOLERANCE and max(high, steep) < TOLERANCE
    return ours, holds and 3 * held >= len(NEARBY)
