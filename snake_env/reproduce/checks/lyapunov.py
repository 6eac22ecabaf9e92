"""Findings of section 6.3.3: Theorem 6.1 for a gait that satisfies its condition."""

from __future__ import annotations

import numpy as np

from snake_env.config import Gait
from snake_env.reproduce import lyapunov, theorem
from snake_env.reproduce.experiment import Runs
from snake_env.reproduce.findings import Result, Rows

STATES = 200
"""Random states for each norm of w."""
NORMS = (1.0, 2.0, 10.0)
"""Of w, over mu."""
SMALL_NORMS = (0.003, 0.01, 0.03, 0.1, 1.0)
"""Of w, far inside mu."""

rows = Rows("6.3.3")


@rows.reproduced(
    "Theorem 6.1 in its domain",
    thesis='the error "converges to zero exponentially and the velocity vector w(t) remains bounded"',
    bound="the gait at half the rate that the proof allows: after 1 s joints within 1e-6 deg of their references over "
    "a period, and |w| no larger in its second half than in its first within 1 %",
)
def _in_its_domain(runs: Runs) -> Result:
    run, gait = runs["IO, slow"], lyapunov.slow_gait()
    error = np.degrees(run.joint_angle - gait.reference(run.time)["angle"])[run.time > 1.0]
    halves = [float(half.max()) for half in np.array_split(lyapunov.speed(run), 2)]
    ours = f"omega_h / {Gait().omega / gait.omega:.0f}, |phi_d'| <= {theorem.reference_speed(gait):.3f} rad/s: "
    ours += f"errors up to {np.abs(error).max():.0e} deg, |w| up to {max(halves):.3f}"
    return ours, float(np.abs(error).max()) < 1e-6 and halves[1] < 1.01 * halves[0]


@rows.reproduced(
    "V falls outside of mu",
    thesis="V' <= -W(w) for |w| >= mu (6.119), with k_5 (6.110), k_6 (6.113) and mu (6.118)",
    bound="at 600 random states with |w| of 1, 2 and 10 mu and eta = 1/2, none with V' above -W",
)
def _falls_outside(_: Runs) -> Result:
    known = lyapunov.constants()
    rates = lyapunov.random_rates(tuple(factor * known.mu for factor in NORMS), STATES)
    least = (1.0 - lyapunov.SHARE) * known.k6
    ours = f"k_5 = {known.k5:.1f}, k_6 = {known.k6:.2f}, mu = {known.mu:.0f}: "
    return f"{ours}V' / |w|^2 at most {rates.max():.2f}, -W / |w|^2 = {-least:.2f}", bool(rates.max() < -least)


@rows.reproduced(
    "V along a solution of (6.50)",
    thesis="solutions decrease V until they are ultimately bounded (A.1)",
    bound="from w = (2, 2, 4) on V falls in each step down to the last thousandth of it",
)
def _along_a_solution(_: Runs) -> Result:
    times, speed, energy = lyapunov.decay()
    above = energy > 1e-3 * energy[0]
    ours = (
        f"V from {energy[0]:.0f} to {energy[-1]:.0e} J, |w| from {speed[0]:.1f} to {speed[-1]:.3f} in {times[-1]:.1f} s"
    )
    return ours, bool(np.all(np.diff(energy[above]) < 0.0) and energy[-1] < 1e-3 * energy[0])


@rows.ours(
    "how tight the proof is",
    bound="V rises at states with |w| = 0.003, at none of 200 with 0.03 or more: below 1e-3 of mu, since the proof "
    "counts Coulomb friction, 99 % of k_5, as a driving term, and it brakes",
)
def _how_tight(runs: Runs) -> Result:
    known = lyapunov.constants()
    rising = [bool(rates.max() > 0.0) for rates in lyapunov.random_rates(SMALL_NORMS, STATES)]
    largest = max(norm for norm, rises in zip(SMALL_NORMS, rising, strict=True) if rises)
    speed = float(lyapunov.speed(runs["IO, slow"]).max())
    ours = (
        f"V rises up to |w| = {largest:g}, mu is {known.mu:.0f}; the run stays below {speed:.3f}, the ultimate bound "
    )
    ours += f"(A.6) is {known.ultimate:.0f}; Coulomb friction is {known.coulomb / known.k5:.1%} of k_5"
    return ours, rising[0] and not any(rising[2:]) and known.coulomb > 0.99 * known.k5
