"""Findings of sections 7.3.4 and 7.5.3 on the body, amplitude and rate of the gait, one run each."""

from __future__ import annotations

import numpy as np

from snake_env.reproduce.experiment import PERIOD, Runs
from snake_env.reproduce.experiments import FAST, RATES
from snake_env.reproduce.findings import Result, Rows
from snake_env.reproduce.measures import collisions, mean_velocity, roughness, torque, torque_beyond, total_force

rows = Rows("7.3.4")
motor_rows = Rows("7.5.3")


@rows.reproduced(
    "bumps in the path of link 6",
    thesis='the path is "almost sine-like except from some \'bumps\'": small obstacles "may slide slightly into the '
    "small 'crack' between two adjacent links\" (Fig. 7.6)",
    bound="twice as rough over 3 cm as among the large pegs of Table 7.5; links without cracks, their straight sides "
    "reaching to the joints, lose over half of its mean square. The rest are collisions",
)
def _bumps(runs: Runs) -> Result:
    small, filled, large = (roughness(runs[name]) for name in ("table 7.3", "table 7.3, filled", "table 7.5"))
    ours = f"{1e3 * small:.2f} mm RMS, {1e3 * filled:.2f} without cracks, {1e3 * large:.2f} among large pegs"
    return ours, small > 2.0 * large and filled**2 < 0.5 * small**2


@rows.reproduced(
    "spikes of the contact forces",
    thesis='"spikes in the forces arise from impulses due to the link colliding with an obstacle" (Fig. 7.7)',
    bound="over three quarters of the samples with four times the median force come within 20 ms of a link's touching "
    "a peg anew, which are less than 40 % of all samples",
)
def _spikes(runs: Runs) -> Result:
    share, chance = collisions(runs["table 7.3"])
    return f"{share:.0%} of the spikes after a collision, {chance:.0%} of all samples", share > 0.75 and chance < 0.4


@rows.reproduced(
    "A_h lowered to 30 deg, pegs placed for it",
    thesis='"The angle between the link in contact with the obstacle and the direction of locomotion will also be '
    'smaller if we [...] lower the amplitude"',
    bound="over 1.5 times the contact forces and joint torques of 40 deg: the largest heading falls from 47 to 35 deg, "
    "which leaves 0.79 of a push for the way ahead, and the levers shrink as well",
)
def _low_amplitude(runs: Runs) -> Result:
    names = ("amplitude 30", "beta -50")
    forces = [total_force(runs[name], PERIOD, 2 * PERIOD) for name in names]
    torques = [torque_beyond(runs[name], runs[f"{name}, no pegs"], PERIOD, 2 * PERIOD) for name in names]
    ours = "{:.0f} against {:.0f} N in sum, ".format(*forces) + "{:.1f} against {:.1f} N m RMS".format(*torques)
    return ours, forces[0] > 1.5 * forces[1] and torques[0] > 1.5 * torques[1]


@rows.reproduced(
    "larger omega_h: faster, and harder impacts",
    thesis='"a larger omega_h will result in a greater forward speed"; "the larger the speed, the harder the impact"',
    bound="speed in proportion to omega_h within 2 %, since the track stays the same; the largest force in 0.67 % of a "
    "period over 1.3 times at each doubling",
)
def _rate(runs: Runs) -> Result:
    speeds = [float(mean_velocity(runs[f"rate {rate:g}"], 0.0, 15.0 / rate)[0]) for rate in RATES]
    impacts = [float(np.linalg.norm(runs[f"rate {rate:g}"].contact_force, axis=-1).max()) for rate in RATES]
    ours = ", ".join(f"{100 * speed:.1f} cm/s and {force:.0f} N" for speed, force in zip(speeds, impacts, strict=True))
    ours += " at " + ", ".join(f"{rate:g}" for rate in RATES) + " times omega_h"
    in_proportion = all(abs(v / r / speeds[1] - 1.0) < 0.02 for v, r in zip(speeds, RATES, strict=True))
    return ours, in_proportion and impacts[2] > 1.3 * impacts[1] > 1.69 * impacts[0]


@rows.reproduced(
    "peg 3 moved: touched badly",
    thesis='"even if it touches some obstacles in a far from perfect manner. The downside can be that larger joint '
    'torques are needed"',
    bound="over 3 times the largest torque of the unaltered course: once a link meets peg 4 nearly head-on",
)
def _touched_badly(runs: Runs) -> Result:
    moved, usual = (torque(runs[name], 0.0, 15.0).peak for name in ("peg 3 moved", "table 7.3"))
    return f"up to {moved:.0f} against {usual:.1f} N m", moved > 3.0 * usual


@motor_rows.reproduced(
    "what limits the speed",
    thesis='"the only practical limitation for the wave propagation speed [...] is the speed of the joint motors"; the '
    'speed "will be limited by the amount of torque the actuators are able to produce" (7.3.4)',
    bound="with 3 N m over 0.95 of the no-slip bound at 2 and 4 times omega_h, below half of it at 8 times, where the "
    "torques to accelerate the links are 16 times those at 2",
)
def _limited_by_motors(runs: Runs) -> Result:
    shares, ours = [], []
    for rate in FAST:
        name = f"rate {rate:g}, weak motors"
        speed = float(mean_velocity(runs[name], 0.0, 2 * PERIOD / rate)[0])
        shares.append(speed / runs.no_slip_speed(name))
        ours.append(f"{100 * speed:.0f} cm/s ({shares[-1]:.0%} of the bound) at {rate:g} times omega_h")
    return ", ".join(ours), shares[0] > 0.95 and shares[1] > 0.95 and shares[2] < 0.5
