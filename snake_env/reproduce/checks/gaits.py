"""Findings of section 2.4.2: gaits that the thesis describes and does not simulate."""

from __future__ import annotations

import numpy as np

from snake_env.reproduce.experiment import PERIOD, Runs
from snake_env.reproduce.experiments import LIFTS
from snake_env.reproduce.findings import Result, Rows
from snake_env.reproduce.measures import at

rows = Rows("2.4.2")


@rows.corrected(
    "sinus-lifting, (0.2, 0.5), against undulation",
    thesis='"the snake robot moves forward faster by sinus-lifting than by lateral undulation" (Ma et al., 2004)',
    bound="more than 5 % faster with lifts of 0.25 and 0.5 deg, slower from 1 deg on",
    reason="Refined: the cited model presses the links on the ground by the curvature of the body. Stiff joints lift "
    "whole bends, which then push no more: with 1 deg the robot is slower than flat on the ground",
)
def _lifting_is_faster(runs: Runs) -> Result:
    flat = _speed_ahead(runs, "undulation, 3D")
    lifted = {lift: _speed_ahead(runs, f"lift {lift:g}") for lift in LIFTS}
    ours = ", ".join(f"{100 * speed:.1f} at {lift:g} deg" for lift, speed in lifted.items())
    faster = all(speed > 1.05 * flat for lift, speed in lifted.items() if lift <= 0.5)
    slower = all(speed < flat for lift, speed in lifted.items() if lift >= 1.0)
    return f"{100 * flat:.1f} cm/s flat; {ours}", faster and slower


@rows.reproduced(
    "caterpillar",
    thesis='"moving the same way as the travelling wave" (Fig. 2.5 b)',
    bound="backward, the way of the wave, by 0.5 to 3 cm/s: the crest of a link on two spheres moves it by little",
)
def _caterpillar_follows_its_wave(runs: Runs) -> Result:
    speed = _speed_ahead(runs, "caterpillar")
    return f"{100 * speed:.1f} cm/s; the wave runs from link 1 to link 11", -0.03 < speed < -0.005


def _speed_ahead(runs: Runs, name: str) -> float:
    """Of the gravity centre over the second period, in the direction from link 11 to link 1 [m/s]."""
    position = runs[name].position
    half = at(runs[name], PERIOD)
    way = position[-1].mean(axis=0) - position[half].mean(axis=0)
    ahead = position[-1, 0] - position[-1, -1]
    return float(way @ ahead / np.linalg.norm(ahead)) / PERIOD
