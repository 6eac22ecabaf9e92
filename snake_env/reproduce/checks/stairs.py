"""Stairs (T ch. 8), which the thesis asks a 3D model to have."""

from __future__ import annotations

from snake_env.reproduce.experiment import Runs
from snake_env.reproduce.findings import Result, Rows
from snake_env.reproduce.stairs import CASES, STEPS, climbed

rows = Rows("8")


@rows.ours(
    "three steps across the way of sidewinding",
    bound="with the thesis's lift of 10 degrees it climbs all steps of 1 cm and none of 2 cm; with twice the lift "
    "those of 2 cm too; steps of 6 cm only with twice the friction, and at least the first: the links that push must "
    "hold while others are lifted over the edge",
)
def _climbing(runs: Runs) -> Result:
    found = {case: climbed(runs, *case) for case in CASES}
    ours = "; ".join(
        f"{max(steps, 0.0):.0f} steps of {rise} cm with {lift} deg, mu = {mu:g}"
        for (lift, rise, mu), steps in found.items()
    )
    low, high, lifted, steep, held = found.values()
    tolerance = 0.25
    holds = abs(low - STEPS) < tolerance and abs(lifted - STEPS) < tolerance and max(high, steep) < tolerance
    return ours, holds and held > 1.0 - tolerance
