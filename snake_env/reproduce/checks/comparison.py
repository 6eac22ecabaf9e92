"""Findings of section 2.3.2: the models of others against set-valued friction, all under the gait (7.3)."""

from __future__ import annotations

import math

import numpy as np

from snake_env.config import Gait
from snake_env.config.section import DEGREE
from snake_env.reproduce import compliant
from snake_env.reproduce.comparison import QuasiStatic, law_speed, small_amplitude_speed, steady_speed
from snake_env.reproduce.experiment import Runs
from snake_env.reproduce.findings import Result, Rows
from snake_env.reproduce.serpenoid import NaturalPath

LONG = ((73, 2), (145, 4))
"""Links of the long chains, and waves along them at a phase shift of 10 degrees."""

rows = Rows("2.3.2")


@rows.reproduced(
    "viscous friction (2.4), (2.7) and the quasi-stationary model (2.11)",
    thesis='(2.11) comes from (2.5) by "setting accelerations to zero"',
    bound="the minimal model with viscous friction within 0.5 % of (2.11) integrated by itself, since inertia is small",
)
def _viscous(runs: Runs) -> Result:
    dynamic, static = steady_speed(runs["viscous"]), law_speed("viscous")
    return f"{100 * dynamic:.3f} against {100 * static:.3f} cm/s", abs(dynamic / static - 1.0) < 5e-3


@rows.ours(
    "viscous against dry friction, both 2.5 times higher across",
    bound="0.5 to 0.6 of the speed on dry ground: dry friction gives way along the links once they slide across, and "
    "viscous friction does not",
)
def _viscous_is_slower(runs: Runs) -> Result:
    viscous, dry = steady_speed(runs["viscous"]), steady_speed(runs["orthotropic"])
    ours = f"{100 * viscous:.1f} against {100 * dry:.1f} cm/s, {viscous / dry:.2f}"
    return ours, 0.5 < viscous / dry < 0.6


@rows.ours(
    "set-valued friction against its quasi-static limit",
    bound="the planar model within 0.5 % of a chain without inertia, whose Coulomb friction is found by reweighting: "
    "the "
    "two share no code",
)
def _coulomb(runs: Runs) -> Result:
    dynamic, static = steady_speed(runs["orthotropic"]), law_speed("coulomb")
    return f"{100 * dynamic:.2f} against {100 * static:.2f} cm/s", abs(dynamic / static - 1.0) < 5e-3


@rows.corrected(
    "sign friction (2.8)",
    thesis='"a more complicated, but also a more accurate model for motion on non-lubricated surfaces"',
    bound="1.8 to 2.1 times as fast as friction against the direction of sliding; (2.8) without inertia within 2 % of "
    "its smooth form (6.21), eps = 1e-4 m/s, with one contact point per link",
    reason="Refined: the components of (2.8) do not know of each other, so a link that slides along itself keeps all "
    "of "
    "its friction across, like a wheel. Coulomb friction (3.61) opposes the sliding, and little of it is left across",
)
def _sign(runs: Runs) -> Result:
    smooth, sign, dry = steady_speed(runs["sign"]), law_speed("sign"), steady_speed(runs["orthotropic"])
    ours = f"{100 * sign:.1f} cm/s without inertia, {100 * smooth:.1f} with (6.21), {100 * dry:.1f} set-valued"
    return ours, 1.8 < sign / dry < 2.1 and abs(smooth / sign - 1.0) < 0.02


@rows.corrected(
    "wheels without slip (2.1), (2.2)",
    thesis='"an ideal version of the frictional properties of the snake skin"; "it can still be difficult to control '
    "the "
    'joint torques such that the wheels do not slip" (2.5)',
    bound="with the least slip of eleven fixed axles 0.88 to 0.95 of the no-slip bound, within 2 % of sign friction; "
    "over 0.99 of it with a fifth of the phase shift",
    reason="Refined: the gait asks eleven axles at the CGs of straight links for three freedoms. The CGs swing across "
    "by "
    "(beta / 2) cot(beta / 2) = 0.94 of what rolling needs, so they slip; steered axles (ACM III) or finer links need "
    "not",
)
def _wheels(runs: Runs) -> Result:
    bound, wheels, sign = runs.no_slip_speed("orthotropic"), law_speed("wheels"), law_speed("sign")
    fine = Gait(amplitude=8 * DEGREE, beta=-10 * DEGREE)
    share = QuasiStatic(fine, 0.0, 1.0, "wheels", links=73).speed(1, 36) / no_slip(fine)
    ours = (
        f"{100 * wheels:.1f} cm/s, {wheels / bound:.0%} of the bound {100 * bound:.1f}; {share:.1%} at beta = -10 deg"
    )
    return ours, 0.88 < wheels / bound < 0.95 and abs(wheels / sign - 1.0) < 0.02 and share > 0.99


@rows.ours(
    "viscous chain at small amplitude",
    bound="below resistive force theory for an infinite chain, (K^2 / 2) V (c_n / c_t - 1), by less than 10 % with "
    "two "
    "waves along the robot and 5 % with four: free ends swing",
)
def _small_amplitude(_: Runs) -> Result:
    gait = Gait(amplitude=DEGREE, beta=-10 * DEGREE)
    theory = small_amplitude_speed(gait, 2.5, QuasiStatic.length)
    found = [QuasiStatic(gait, turning=True, links=links).speed(1, 36) / theory for links, _ in LONG]
    ours = ", ".join(f"{share:.3f} with {waves} waves" for share, (_, waves) in zip(found, LONG, strict=True))
    return f"{ours}; theory {1e3 * theory:.2f} mm/s", 0.9 < found[0] < found[1] < 1.0 and found[1] > 0.95


@rows.reproduced(
    "compliant ground (2.3)",
    thesis='"needs to be set very high to imitate a solid surface. Hence, the total system is stiff and requires a '
    "very "
    'small simulation step size"',
    bound="a fall from 0.3 m: largest stable steps within 30 % of 2.785 / sqrt(k / m), so below 2 ms for less than 1 "
    "mm "
    "of penetration; the set-valued contact less than 1 um with 10 ms",
)
def _compliant(runs: Runs) -> Result:
    steps = [compliant.largest_step(stiffness) for stiffness in compliant.STIFFNESS]
    theory = [compliant.RUNGE_KUTTA / math.sqrt(stiffness / compliant.MASS) for stiffness in compliant.STIFFNESS]
    deepest = compliant.depths(1e6, 1e-4)[0]
    ours = ", ".join(f"{1e3 * step:.1f} ms at {k:.0e} N/m" for step, k in zip(steps, compliant.STIFFNESS, strict=True))
    ours += f"; {1e3 * deepest:.2f} mm deep at 1e+06; set-valued {1e6 * runs['flat drop'].max_penetration:.3f} um"
    close = bool(np.all(np.abs(np.divide(steps, theory) - 1.0) < 0.3))
    return ours, close and deepest < 1e-3 and steps[2] < 2e-3 and runs["flat drop"].max_penetration < 1e-6


def no_slip(gait: Gait) -> float:
    """Of a gait [m/s]."""
    return NaturalPath(gait, QuasiStatic.length).no_slip_speed
