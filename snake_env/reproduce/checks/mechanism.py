"""Findings of section 5.3: what propels a robot that pushes against smooth pegs (Fig. 5.2 and 5.3)."""

from __future__ import annotations

import numpy as np

from snake_env.config.section import DEGREE
from snake_env.reproduce.experiment import PERIOD, Runs
from snake_env.reproduce.findings import Result, Rows
from snake_env.reproduce.measures import gravity_centre, period_speed, torque_beyond
from snake_env.reproduce.mechanism import ALPHAS, BETA, OFFSETS, peg_forces, push

LATER = (PERIOD, 2 * PERIOD)

rows = Rows("5.3")


@rows.reproduced(
    "Gray's three links",
    thesis='"forward direction if alpha > beta, in the backward direction if alpha < beta, and is zero if '
    'alpha = beta" (Fig. 5.2)',
    bound="in 0.1 s over 1 mm to the side of the larger angle, below 1 um if they are equal",
)
def _three_links(runs: Runs) -> Result:
    ways = {
        alpha: 1e3 * float(np.diff(gravity_centre(runs[f"three links {alpha}"])[[0, -1], 0])[0]) for alpha in ALPHAS
    }
    ours = ", ".join(f"{way:+.1f} mm at alpha = {alpha}" for alpha, way in ways.items()) + f" deg, beta = {BETA}"
    still = abs(ways.pop(BETA)) < 1e-3
    return ours.replace("-0.0 mm", "0.0 mm").replace("+0.0 mm", "0.0 mm"), still and all(
        way * np.sign(alpha - BETA) > 1.0 for alpha, way in ways.items()
    )


@rows.reproduced(
    "the resultant of the three pegs",
    thesis="the sum of the contact forces propels the mechanism (Fig. 5.2, right)",
    bound="within 0.5 N of (tau / a) (sin(alpha) - sin(beta)), up to 10.7 N: statics without the inertia of the links",
)
def _resultant(runs: Runs) -> Result:
    found = [float(runs[f"three links {alpha}"].contact_force[1].sum(axis=0)[0]) for alpha in ALPHAS]
    static = [float(peg_forces(alpha * DEGREE, BETA * DEGREE).sum(axis=0)[0]) for alpha in ALPHAS]
    ours = ", ".join(f"{force:+.1f} ({theory:+.1f})" for force, theory in zip(found, static, strict=True))
    ours = ours.replace("-0.0", "0.0").replace("+0.0", "0.0")
    return f"{ours} N ahead (by statics)", all(abs(a - b) < 0.5 for a, b in zip(found, static, strict=True))


@rows.reproduced(
    "push-points off the centre line",
    thesis='"a substantial portion of the normal contact reaction force points in the lateral direction"; "larger '
    'joint torques are needed to obtain the same longitudinal reaction forces"',
    bound="pegs at five distances, the speed the same within 0.1 % and the force ahead within 10 %: lateral forces and "
    "the torques by the pegs grow with each, to over twice, as headings at the pegs fall",
)
def _off_the_centre_line(runs: Runs) -> Result:
    names = [f"pegs off {offset:g}" for offset in OFFSETS]
    pushes = [push(runs[name], *LATER) for name in names]
    torques = [torque_beyond(runs[name], runs["beta -50, no pegs"], *LATER) for name in names]
    ours = "; ".join(
        f"{100 * p.place:.1f} cm: {p.across:.0f} N across, {p.ahead:.1f} N ahead, {t:.1f} N m RMS"
        for p, t in zip(pushes, torques, strict=True)
    )
    speeds = [period_speed(runs[name]) for name in names]
    same = max(speeds) < 1.001 * min(speeds) and max(p.ahead for p in pushes) < 1.1 * min(p.ahead for p in pushes)
    growing = bool(np.all(np.diff([p.across for p in pushes]) > 0.0) and np.all(np.diff(torques) > 0.0))
    return ours, same and growing and pushes[-1].across > 2.0 * pushes[0].across and torques[-1] > 2.0 * torques[0]
