"""Findings of section 2.4.2: gaits that the thesis describes and does not simulate."""

from __future__ import annotations

import numpy as np

from snake_env.reproduce.experiment import PERIOD, Runs
from snake_env.reproduce.experiments import LIFTS, OFFSETS, PHASES
from snake_env.reproduce.findings import Result, Rows
from snake_env.reproduce.measures import at
from snake_env.reproduce.measures_spatial import body_turn, direction, displacement

STEADY = (6.0, 15.0)
"""Two periods of sidewinding after the soft start [s]."""

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


@rows.reproduced(
    "sidewinding: beta_0 controls the direction",
    thesis='"both gamma_h and beta_0 control the direction of locomotion" (Liljeback, 2004)',
    bound="-90 deg sends the robot to -y as 90 deg does to +y, within 1 deg, by symmetry; 60 to 120 deg all to +y, "
    "within 5 deg, so beta_0 chooses the side and hardly the course",
)
def _phase_chooses_the_side(runs: Runs) -> Result:
    found = {phase: direction(displacement(runs[f"sidewinding, beta_0 {phase}"], *STEADY)) for phase in PHASES}
    ours = ", ".join(f"{angle:+.1f} deg at {phase}" for phase, angle in found.items())
    return ours, abs(found[-90] + found[90]) < 1.0 and all(abs(found[phase] - 90.0) < 5.0 for phase in (60, 90, 120))


@rows.reproduced(
    "sidewinding: gamma_h controls the direction",
    thesis='"both gamma_h and beta_0 control the direction of locomotion" (Liljeback, 2004)',
    bound="-10 and 10 deg turn the body to opposite sides of its heading with 0, by over 5 deg in 9 s",
)
def _offset_turns(runs: Runs) -> Result:
    found = {offset: body_turn(runs[f"sidewinding, gamma_h {offset}"], *STEADY) for offset in OFFSETS}
    ours = ", ".join(f"{angle:+.1f} deg at {offset}" for offset, angle in found.items())
    return f"turns by {ours} in 9 s", found[-10] - 5.0 > found[0] > found[10] + 5.0


def _speed_ahead(runs: Runs, name: str) -> float:
    """Of the gravity centre over the last period, in the direction from link 11 to link 1 [m/s]."""
    run, position = runs[name], runs[name].position
    way = position[-1].mean(axis=0) - position[at(run, run.time[-1] - PERIOD)].mean(axis=0)
    ahead = position[-1, 0] - position[-1, -1]
    return float(way @ ahead / np.linalg.norm(ahead)) / PERIOD
