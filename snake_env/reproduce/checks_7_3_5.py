"""Findings of section 7.3.5: input-output linearisation against PD on the minimal model (Fig. 7.10 and 7.11)."""

from __future__ import annotations

import statistics
import time

from snake_env.config import Gait, Integrator, IOLinearizing
from snake_env.reproduce import stability, theorem, tracking
from snake_env.reproduce.experiments import EXPERIMENTS, FEEDBACK, Runs
from snake_env.reproduce.findings import Check

Result = tuple[str, bool]

LAWS = ("set-valued", "arctan")


def _io_smooth(runs: Runs) -> Result:
    error = tracking.largest_error(runs["IO, arctan"])
    return f"at most {error:.1e} deg", error < 1e-5


def _pd_smooth(runs: Runs) -> Result:
    run = runs["PD, arctan"]
    change = tracking.repeats(run)
    return f"{tracking.largest_error(run):.3f} deg, repeats within {change:.1%}", change < 0.02


def _io_set_valued(runs: Runs) -> Result:
    io, pd = (tracking.largest_error(runs[f"{name}, set-valued"]) for name in ("IO", "PD"))
    return f"{io:.4f} deg, {pd / io:.0f} times less than PD", io < 0.02 * pd


def _pd_smaller(runs: Runs) -> Result:
    ours, smooth = (tracking.largest_error(runs[f"PD, {law}"]) for law in LAWS)
    return f"{ours:.4f} against {smooth:.4f} deg", 0.6 < ours / smooth < 0.9


def _pd_similar(runs: Runs) -> Result:
    likeness = tracking.likeness(*(runs[f"PD, {law}"] for law in LAWS))
    return f"correlation {likeness:.3f}", likeness > 0.9


def _joint_5_figures(runs: Runs) -> Result:
    run = runs["PD, set-valued"]
    figures = (tracking.largest_error(run), tracking.rms_error(run), tracking.rms_torque(run))
    expected = (0.3526, 0.2460, 0.859)
    close = all(abs(ours / theirs - 1.0) < 5e-3 for ours, theirs in zip(figures, expected, strict=True))
    return "max {:.4f} deg, RMS {:.4f} deg, torque {:.3f} N m".format(*figures), close


def _same_torques(runs: Runs) -> Result:
    io, pd = (tracking.rms_torque(runs[f"{name}, set-valued"]) for name in ("IO", "PD"))
    return f"{io:.3f} and {pd:.3f} N m RMS", abs(io / pd - 1.0) < 0.05


def _little_noise(runs: Runs) -> Result:
    found = {(name, row): tracking.largest_error(runs[f"{name}, noise {row}"]) for name in ("IO", "PD") for row in "bc"}
    plain = tracking.largest_error(runs["PD, set-valued"])
    ours = "IO {:.3f} and {:.3f} deg, PD {:.3f} and {:.3f} deg".format(*found.values())
    steady = all(found["PD", row] < 1.1 * plain and found["IO", row] < 0.1 * plain for row in "bc")
    return ours, steady


def _much_noise(runs: Runs) -> Result:
    little, much = (tracking.largest_error(runs[f"IO, noise {row}"]) for row in "cd")
    return f"IO {little:.3f} deg with 0.1 deg of noise on the joints, {much:.3f} with 1 deg", much > 5.0 * little


def _same_with_limit(runs: Runs) -> Result:
    differences = []
    for law in LAWS:
        for name in ("IO", "PD"):
            free, limited = runs[f"{name}, {law}"], runs[f"{name} 10 N m, {law}"]
            differences.append(abs(tracking.largest_error(free) - tracking.largest_error(limited)))
    return f"within {max(differences):.1e} deg", max(differences) < 1e-3


def _short_but_larger(runs: Runs) -> Result:
    io, pd = (runs[f"{name} 10 N m, arctan"] for name in ("IO", "PD"))
    peaks = tracking.starting_error(io), tracking.starting_error(pd)
    ours = f"{peaks[0]:.1f} against {peaks[1]:.1f} deg; joint 5 off by > 0.5 deg for {tracking.time_off(io):.2f} s"
    return ours, peaks[0] > peaks[1] and tracking.time_off(io) < 0.5


def _high_gains(runs: Runs) -> Result:
    high, io = (tracking.largest_error(runs[f"{name}, set-valued"]) for name in ("PD high", "IO"))
    return f"done: (2e4, 120) errs by {high:.4f} deg, IO by {io:.4f}", high < io


def _bounded(runs: Runs) -> Result:
    fastest = max((tracking.fastest(runs[f"{name}, {law}"]) for name in FEEDBACK for law in LAWS), key=max)
    return "|v| <= {:.2f} m/s, |theta'| <= {:.1f} rad/s in all runs".format(*fastest), max(fastest) < 50.0


def _condition(_: Runs) -> Result:
    allowed, asked = theorem.bound(Gait()).rate, theorem.reference_speed(Gait())
    ours = f"the proof allows {allowed:.3f} rad/s, the gait has {asked:.2f}: not covered, bounded all the same"
    return ours, asked > allowed


def _sampling(_: Runs) -> Result:
    explicit, held, implicit = stability.TREATMENTS
    words, passed = [], True
    for name, controller, theory in stability.PRINTED:
        found = [stability.limit(kind, controller, 1e-4, 2e-3) for kind in (explicit, held)]
        passed &= all(abs(period / theory - 1.0) < 0.03 for period in found) and implicit.recovers(controller, 0.05)
        words.append(f"{name}: {1e3 * found[0]:.2f} and {1e3 * found[1]:.2f} ms")
    return "explicit and held " + "; ".join(words) + "; implicit: none up to 50 ms", passed


def _any_period(_: Runs) -> Result:
    held = stability.TREATMENTS[1]
    periods = (1e-3, 5e-3, 2e-2, 5e-2)
    return "1 to 50 ms", all(held.recovers(IOLinearizing.for_period(period), period) for period in periods)


def _speed(_: Runs) -> Result:
    """Median of five runs each; a step of 50 ms is within 0.4 mm and 2e-4 rad of the limit."""
    runs = {"IO, set-valued": Integrator(step=0.05), "IO, arctan": Integrator(tolerance=1e-6)}
    rates = []
    for experiment, integrator in runs.items():
        walls = [_wall_time(experiment, integrator) for _ in range(5)]
        rates.append(20.0 / statistics.median(walls))
    return "{:.0f} s set-valued, {:.0f} s smooth in a second".format(*rates), min(rates) > 1.0


def _wall_time(name: str, integrator: Integrator) -> float:
    start = time.perf_counter()
    EXPERIMENTS[name]().simulate(integrator, 0.1)
    return time.perf_counter() - start


CHECKS = [
    Check("7.3.5", "Fig. 7.10 (b): IO, smooth friction", '"asymptotically stable error dynamics"', _io_smooth),
    Check("7.3.5", "Fig. 7.10 (b): PD, smooth friction", '"a periodic tracking error"', _pd_smooth),
    Check("7.3.5", "Fig. 7.10 (c): IO, set-valued friction", '"almost negligible"', _io_set_valued),
    Check("7.3.5", "Fig. 7.10 (c): PD, set-valued against smooth", '"somewhat smaller in amplitude"', _pd_smaller),
    Check("7.3.5", "and of the same form", '"almost similar in form"', _pd_similar),
    Check("7.3.5", "joint 5 under PD, independent figures", "0.3526 deg, 0.2460 deg, 0.859 N m", _joint_5_figures),
    Check("7.3.5", "torques of both controllers", '"almost the same in magnitude" (7.6)', _same_torques),
    Check("7.3.5", "Fig. 7.11 (b), (c): little noise on the joints", '"not significantly affected"', _little_noise),
    Check("7.3.5", "Fig. 7.11 (d): more noise on the joints", '"as long as the noise [...] is kept low"', _much_noise),
    Check("7.3.5", "+-10 N m: stationary motion", '"the same as Figure 7.10"', _same_with_limit),
    Check(
        "7.3.5",
        "+-10 N m: soft start",
        '"very short, but larger tracking error for the IO-controller"',
        _short_but_larger,
    ),
    Check("7.3.5", "PD with high gains", '"aborted [...] did not complete within 48 hours"', _high_gains),
    Check("7.3.5", "speed of simulation under IO", '"20 and 50 minutes [for] a single second"', _speed),
    Check("7.3.5", "Theorem 6.1: w stays bounded", '"the velocity vector w(t) remains bounded"', _bounded),
    Check(
        "7.3.5",
        "largest control period",
        "not told; theory: 0.83 ms (IO), 0.576 and 0.346 ms (PD)",
        _sampling,
    ),
    Check("7.3.5", "K_D = 0.5 / T, K_P = K_D^2 / 4: any period", "not told", _any_period),
    Check("7.3.5", "Theorem 6.1: its condition", '"for some sufficiently small c > 0"', _condition),
]
