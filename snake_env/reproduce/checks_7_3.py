"""Findings of section 7.3.4: obstacle aided locomotion among small pegs (Fig. 7.6 to 7.9)."""

from __future__ import annotations

import math

import numpy as np

from snake_env.reproduce.experiments import PERIOD, Runs
from snake_env.reproduce.findings import Check
from snake_env.reproduce.measures import (
    at,
    gravity_centre,
    heading,
    mean_force,
    mean_velocity,
    period_speed,
    pushed_links,
    torque,
    total_force,
)

SHOWN = (5.15, 5.25)
"""Time around the outline of Fig. 7.7 (a) over which forces are averaged [s]."""
PLOTTED = (4.5, 5.5)
"""Time of the plots of Fig. 7.7 (b) and (c) [s]."""

Result = tuple[str, bool]


def _passes_the_course(runs: Runs) -> Result:
    speed = float(mean_velocity(runs["table 7.3"], 0.0, 15.0)[0])
    bound = runs.no_slip_speed("table 7.3")
    share = speed / bound
    return f"{15 * speed:.2f} m in 15 s, {share:.0%} of the no-slip bound", 0.9 < share < 1.0


def _three_contacts(runs: Runs) -> Result:
    links = pushed_links(mean_force(runs["table 7.3"], *SHOWN))
    return "links " + ", ".join(map(str, links)), links == [2, 7, 10]


def _sum_points_forward(runs: Runs) -> Result:
    x, y = mean_force(runs["table 7.3"], *SHOWN).sum(axis=0)
    angle = abs(math.degrees(math.atan2(y, x)))
    return f"({x:.1f}, {y:.1f}) N, {angle:.0f} deg from forward", angle < 20.0


def _link_7_balances(runs: Runs) -> Result:
    """In the thesis link 7 is pushed to -y, here to +y: the posture at 5.2 s is mirrored, half a wave apart."""
    forces = mean_force(runs["table 7.3"], *PLOTTED)[[1, 6, 9]]
    second, seventh, tenth = np.linalg.norm(forces, axis=1)
    sides = np.sign(forces[:, 1])
    sizes = f"{seventh:.1f} N against {second:.1f} and {tenth:.1f} N"
    lateral = ", ".join(f"{force:+.1f}" for force in forces[:, 1])
    opposite = sides[0] == sides[2] == -sides[1]
    return f"{sizes}; to the left {lateral} N (2, 7, 10)", seventh > max(second, tenth) and opposite


def _moved_peg_passes(runs: Runs) -> Result:
    share = _share_of_course(runs, "peg 3 moved")
    return f"{share:.0%} of the unaltered course's distance in 15 s", share > 0.9


def _moved_peg_deflects(runs: Runs) -> Result:
    return _deflects(runs, "peg 3 moved")


def _removed_peg_fails(runs: Runs) -> Result:
    share = _share_of_course(runs, "peg 3 removed")
    return f"{share:.0%} of the unaltered course's distance in 15 s", share < 0.25


def _removed_peg_deflects(runs: Runs) -> Result:
    return _deflects(runs, "peg 3 removed")


def _few_curls_fail(runs: Runs) -> Result:
    speed, bound = period_speed(runs["beta -30"]), runs.no_slip_speed("beta -30")
    return f"{speed:.3f} m/s, no-slip bound {bound:.3f} m/s", speed < 0.1 * bound


def _many_curls_pass(runs: Runs) -> Result:
    speed, bound = period_speed(runs["beta -70"]), runs.no_slip_speed("beta -70")
    return f"{speed:.4f} m/s, no-slip bound {bound:.4f} m/s", 0.9 < speed / bound < 1.01


def _many_curls_need_forces(runs: Runs) -> Result:
    many, usual = (total_force(runs[name], PERIOD, 2 * PERIOD) for name in ("beta -70", "beta -50"))
    return f"{many:.0f} N against {usual:.0f} N in sum", many > 1.2 * usual


def _many_curls_need_torques(runs: Runs) -> Result:
    many, usual = (torque(runs[name], PERIOD, 2 * PERIOD) for name in ("beta -70", "beta -50"))
    ours = f"RMS {many.rms:.2f} against {usual.rms:.2f} N m, largest {many.peak:.1f} against {usual.peak:.1f}"
    return ours, many.rms > usual.rms and many.peak > usual.peak


def _share_of_course(runs: Runs, name: str) -> float:
    """Distance of a run in 15 s against the unaltered course's."""
    altered, unaltered = (mean_velocity(runs[course], 0.0, 15.0)[0] for course in (name, "table 7.3"))
    return float(altered / unaltered)


def _deflects(runs: Runs, name: str, until: float = 3.0) -> Result:
    """A run slides left and turns anticlockwise against the unaltered course; largest deviations."""
    altered, unaltered = runs[name], runs["table 7.3"]
    end = at(altered, until) + 1
    aside = (gravity_centre(altered) - gravity_centre(unaltered))[:end, 1]
    turned = np.degrees(heading(altered) - heading(unaltered))[:end]
    left, turn = aside[np.argmax(np.abs(aside))], turned[np.argmax(np.abs(turned))]
    return f"{100 * left:.1f} cm to the left, {turn:.0f} deg anticlockwise", left > 0.02 and turn > 3.0


CHECKS = [
    Check("7.3.4", name, thesis, test)
    for name, thesis, test in (
        (
            "robot passes the course of Table 7.3",
            '"able to traverse the obstacle course"',
            _passes_the_course,
        ),
        ("three links are pushed at t = 5.2 s", "links 2, 7 and 10 (Fig. 7.7)", _three_contacts),
        (
            "sum of contact forces points forward at t = 5.2 s",
            '"also the direction in which the sum of forces [...] points"',
            _sum_points_forward,
        ),
        (
            "link 7 is pushed harder than links 2 and 10, and to the other side (4.5 to 5.5 s)",
            '"average applied force to link 7 is higher"; it "balances" those on 2 and 10',
            _link_7_balances,
        ),
        (
            "peg 3 moved by 2 L_SC: passes all the same",
            '"not substantial enough to hinder the snake robot" (Fig. 7.8 a)',
            _moved_peg_passes,
        ),
        (
            "peg 3 moved: slides left, turns anticlockwise",
            '"sliding to the left and rotating anti-clockwise"',
            _moved_peg_deflects,
        ),
        ("peg 3 removed: does not pass", '"unable to complete the track" (Fig. 7.8 b)', _removed_peg_fails),
        (
            "peg 3 removed: slides left, turns anticlockwise",
            '"rotated anticlockwise and slid to the left"',
            _removed_peg_deflects,
        ),
        (
            "beta_h = -30 deg, pegs placed for it: makes no way",
            '"unable to move forward" (Fig. 7.9 a)',
            _few_curls_fail,
        ),
        (
            "beta_h = -70 deg, pegs placed for it: moves forward",
            '"able to move forward" (Fig. 7.9 b)',
            _many_curls_pass,
        ),
        (
            "beta_h = -70 deg: larger contact forces than at -50 deg",
            '"the contact force needs to be higher"',
            _many_curls_need_forces,
        ),
        (
            "beta_h = -70 deg: larger joint torques than at -50 deg",
            '"larger joint torques are needed"',
            _many_curls_need_torques,
        ),
    )
]
