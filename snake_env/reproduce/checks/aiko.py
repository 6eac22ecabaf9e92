"""Findings of sections 7.5.1 to 7.5.4: what sets Aiko apart from the models, one discrepancy at a time."""

from __future__ import annotations

import numpy as np

from snake_env.reproduce.experiment import AIKO, PERIOD, Runs
from snake_env.reproduce.experiments import AS_BUILT, FREE_PLAY, FRICTIONS, ISOTROPIC, SATURATED, WEAK_GAIN
from snake_env.reproduce.findings import Result, Rows
from snake_env.reproduce.measures import MIDDLE, mean_velocity, period_speed
from snake_env.reproduce.measures_spatial import body_turn, touching_share
from snake_env.trajectory import Trajectory

MOVING = 6.0
END = 15.0

sidewinding = Rows("7.5.1")
free = Rows("7.5.2")
course = Rows("7.5.3")


@sidewinding.reproduced(
    "sidewinding with weak joints: less way, a turn to the right, more of the body on the ground",
    thesis='"Aiko steadily turns somewhat to the right. In addition, the model covers a greater distance"; "a large '
    'part of its body was touching the ground"; "we believe that [...] Aiko is not able to control its joints '
    'accurately"',
    bound="k_P = 15 N m/rad, with which joints that lift sag by as much as the play of Aiko's: over a twentieth less "
    "way, over 10 deg to the right in 9 s where stiff joints turn to the left, twice the end spheres on the ground",
)
def _weak_joints(runs: Runs) -> Result:
    stiff, weak = runs[f"sidewinding {ISOTROPIC}"], runs["sidewinding, weak joints"]
    ways, turns, shares = zip(*(_way_turn_share(run) for run in (stiff, weak)), strict=True)
    ours = (
        f"{ways[1]:.2f} against {ways[0]:.2f} m in 15 s; {-turns[1]:.0f} deg to the right, {turns[0]:.0f} to the left"
    )
    ours += f" with k_P = 800; {shares[1]:.0%} of the end spheres touch, {shares[0]:.0%} then; k_P = {WEAK_GAIN:g}"
    return ours, ways[1] < 0.95 * ways[0] and turns[1] < -10.0 < 0.0 < turns[0] and shares[1] > 2.0 * shares[0]


@sidewinding.corrected(
    "sidewinding with motors that saturate",
    thesis='"joint motors sometimes saturate"; "particularly the case for vertical motion" (7.5.4)',
    bound="with 1.5 N m a tenth less way and over twice the end spheres on the ground, but a turn to the left as with "
    "strong motors, within 5 deg in 9 s",
    reason="Refined: saturation explains the way and the contact, not the turn to the right; joints that give do",
)
def _saturated(runs: Runs) -> Result:
    strong, weak = runs[f"sidewinding {ISOTROPIC}"], runs["sidewinding, saturated"]
    ways, turns, shares = zip(*(_way_turn_share(run) for run in (strong, weak)), strict=True)
    ours = (
        f"{ways[1]:.2f} against {ways[0]:.2f} m in 15 s with {SATURATED:g} N m; {turns[1]:.0f} against {turns[0]:.0f}"
    )
    ours += f" deg to the left; {shares[1]:.0%} against {shares[0]:.0%} of the end spheres touch"
    return ours, ways[1] < 0.9 * ways[0] and abs(turns[1] - turns[0]) < 5.0 and shares[1] > 2.0 * shares[0]


@free.corrected(
    "another isotropic friction",
    thesis='"we have tried varying the friction coefficients (while still keeping isotropic friction), but this did '
    'not seem to have a noticeable effect"',
    bound="from mu = 0.1 to 0.4 less than 0.1 cm/s in the plane, 0.1 to 0.4 cm/s in 3D",
    reason="Refined: in the plane inertia is small and friction of any size gives the same path. In 3D, where a link "
    "rests on two points whose load varies, fourfold friction adds a fifth to a third",
)
def _friction_does_not_matter(runs: Runs) -> Result:
    speeds = [[100 * period_speed(runs[f"free, mu {mu:g}{model}"]) for mu in FRICTIONS] for model in ("", ", 3D")]
    ours = "; ".join(", ".join(f"{speed:.2f}" for speed in row) for row in speeds)
    spans = [max(row) - min(row) for row in speeds]
    return f"{ours} cm/s in 3D, mu = 0.1, 0.2, 0.4".replace(";", " in the plane;"), spans[0] < 0.1 < spans[1] < 0.4


@free.reproduced(
    "free play of the joints",
    thesis='less distance than simulated "may come as a consequence of that the model [...] is able to reach the '
    'maximum amplitude (40 degrees)"; free play "of about 3 - 5 degrees" (7.5.4)',
    bound="10 to 30 % slower backward with 3 and 5 deg, since all but the last joints fall short by half of the play",
)
def _free_play(runs: Runs) -> Result:
    exact = period_speed(runs["free"])
    loose = [period_speed(runs[f"free play {angle}"]) for angle in FREE_PLAY]
    reached = [float(np.degrees(runs[f"free play {angle}"].joint_angle.max(axis=0)[:5].max())) for angle in FREE_PLAY]
    ours = ", ".join(
        f"{100 * speed:.2f} cm/s with {angle} deg (joints 1 to 5 reach {most:.1f})"
        for speed, angle, most in zip(loose, FREE_PLAY, reached, strict=True)
    )
    shares = [speed / exact for speed in loose]
    return f"{100 * exact:.2f} cm/s without; {ours}", 0.7 < shares[1] < shares[0] < 0.9


@course.reproduced(
    "the course with Aiko's discrepancies",
    thesis='"traverses its path among the obstacles [...] with approximately the same speed (ca. 15 cm/s) in the '
    'simulation as in the experiments" (Fig. 7.16)',
    bound="4 deg of free play, references at 10 Hz, 0.1 s late, P control with 5 N m and 50 N m/rad, and all "
    "together: "
    "each within 2 % of the exact joints in the second period, since three pegs hold the robot in its track",
)
def _as_built(runs: Runs) -> Result:
    exact = period_speed(runs["table 7.5"])
    found = {name: period_speed(runs[f"as built: {name}"]) for name in AS_BUILT}
    start = float(mean_velocity(runs["as built: all"], 0.0, 2 * PERIOD)[0])
    ours = ", ".join(f"{100 * speed:.1f} ({name})" for name, speed in found.items())
    ours = f"{100 * exact:.1f} cm/s exact; {ours}; {100 * start:.1f} from rest with all"
    return ours, all(abs(speed / exact - 1.0) < 0.02 for speed in found.values())


def _way_turn_share(run: Trajectory) -> tuple[float, float, float]:
    """Way of link 6 [m], turn to the left from 6 to 15 s [deg], and the share of end spheres that touch."""
    way = float(np.linalg.norm(run.position[-1, MIDDLE, :2] - run.position[0, MIDDLE, :2]))
    return way, body_turn(run, MOVING, END), touching_share(run, AIKO, MOVING)
