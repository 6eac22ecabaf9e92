"""Findings of sections 7.5.2 and 7.5.3: lateral undulation without and with pegs (Fig. 7.14 and 7.16)."""

from __future__ import annotations

from snake_env.reproduce.experiments import PERIOD, Runs
from snake_env.reproduce.findings import Check
from snake_env.reproduce.measures import mean_velocity, period_speed

Result = tuple[str, bool]


def _slowly_backward(runs: Runs) -> Result:
    speed = period_speed(runs["free"])
    return f"{100 * speed:.2f} cm/s", -0.015 < speed < -0.005


def _steadily_backward(runs: Runs) -> Result:
    first, second = (float(mean_velocity(runs["free"], t, t + PERIOD)[0]) for t in (0.0, PERIOD))
    ours = f"{100 * first:.2f} and {100 * second:.2f} cm/s in the first and second period"
    return ours, first < 0.0 and second < 0.0


def _speed_among_pegs(runs: Runs) -> Result:
    speed = float(mean_velocity(runs["table 7.5"], 0.0, 2 * PERIOD)[0])
    later = period_speed(runs["table 7.5"])
    ours = f"{100 * speed:.1f} cm/s from rest on, {100 * later:.1f} cm/s in the second period"
    return ours, 0.14 < speed < 0.17


def _below_the_bound(runs: Runs) -> Result:
    speed, bound = period_speed(runs["table 7.5"]), runs.no_slip_speed("table 7.5")
    return f"{speed:.4f} m/s, bound {bound:.4f} m/s", 0.95 < speed / bound < 1.0


def _fifteen_times(runs: Runs) -> Result:
    factor = abs(period_speed(runs["table 7.5"]) / period_speed(runs["free"]))
    return f"{factor:.1f} times", 12.0 < factor < 20.0


def _opposite_direction(runs: Runs) -> Result:
    among_pegs, without = period_speed(runs["table 7.5"]), period_speed(runs["free"])
    return f"{among_pegs:+.3f} and {without:+.3f} m/s", among_pegs > 0.0 > without


def _forward_by_anisotropy(runs: Runs) -> Result:
    speed = period_speed(runs["orthotropic"])
    return f"{speed:+.3f} m/s", speed > 0.02


def _no_penetration(runs: Runs) -> Result:
    depth = max(runs[name].max_penetration for name in ("table 7.5", "table 7.3", "beta -50"))
    return f"at most {1e6 * depth:.0f} um", depth < 1e-3


CHECKS = [
    Check(
        "7.5.2",
        "isotropic ground without pegs: slowly backward",
        '"approximately -1 cm/s" (Fig. 7.14)',
        _slowly_backward,
    ),
    Check("7.5.2", "and so all along", "backward in every period (Fig. 7.14)", _steadily_backward),
    Check("7.5.3", "Table 7.5: speed among pegs", '"ca. 15 cm/s" (Fig. 7.16)', _speed_among_pegs),
    Check(
        "7.5.3",
        "Table 7.5: below the no-slip bound",
        "bound: every link in the track of the one before, (omega L / |beta|) J0(A / (2 sin(|beta| / 2)))",
        _below_the_bound,
    ),
    Check("7.5.3", "faster with pegs than without", '"15 times faster"', _fifteen_times),
    Check("7.5.3", "other direction with pegs", '"moves in the opposite direction"', _opposite_direction),
    Check(
        "7.5.3",
        "orthotropic ground (0.2, 0.5): forward without pegs",
        '"for anisotropic friction [...] opposite to [...] the propagating wave"',
        _forward_by_anisotropy,
    ),
    Check("7.5.3", "no peg penetrates a link", '"keep the obstacles from penetrating" (7.3.4)', _no_penetration),
]
