"""Findings of sections 7.5.2, 7.5.3 and 7.6: lateral undulation without and with pegs (Fig. 7.14 and 7.16)."""

from __future__ import annotations

from snake_env.reproduce.experiment import PERIOD, Runs
from snake_env.reproduce.findings import Result, Rows
from snake_env.reproduce.measures import mean_velocity, period_speed

AMONG_PEGS = ("table 7.5", "table 7.3", "peg 3 moved", "peg 3 removed", "beta -30", "beta -50", "beta -70")
IN_3D = tuple(f"{name}, 3D" for name in AMONG_PEGS[:4])

free = Rows("7.5.2")
pegs = Rows("7.5.3")
summary = Rows("7.6")


@free.reproduced(
    "isotropic ground without pegs: slowly backward",
    thesis='"approximately -1 cm/s" (Fig. 7.14)',
    bound="-0.5 to -1.5 cm/s, what rounds to -1",
)
def _slowly_backward(runs: Runs) -> Result:
    speed = period_speed(runs["free"])
    return f"{100 * speed:.2f} cm/s", -0.015 < speed < -0.005


@free.reproduced("and so all along", thesis="backward in every period (Fig. 7.14)", bound="the sign in either period")
def _steadily_backward(runs: Runs) -> Result:
    first, second = (float(mean_velocity(runs["free"], t, t + PERIOD)[0]) for t in (0.0, PERIOD))
    ours = f"{100 * first:.2f} and {100 * second:.2f} cm/s in the first and second period"
    return ours, first < 0.0 and second < 0.0


@free.reproduced(
    "the same in 3D",
    thesis='"same trend"; "the simulation results differ[s] between the 2D and the 3D model" (two contact points)',
    bound="backward too, by 5 to 25 % faster: at both ends of a link friction resists its turning as well",
)
def _free_in_3d(runs: Runs) -> Result:
    planar, spatial = period_speed(runs["free"]), period_speed(runs["free, 3D"])
    ours = f"{100 * spatial:.2f} cm/s, planar {100 * planar:.2f}: {spatial / planar - 1.0:.0%} more"
    return ours, spatial < 0.0 and 1.05 < spatial / planar < 1.25


@pegs.reproduced(
    "Table 7.5: speed among pegs",
    thesis='"ca. 15 cm/s" (Fig. 7.16)',
    bound="14 to 16.4 cm/s: what one calls 15, and no more than the no-slip bound of 16.33",
)
def _speed_among_pegs(runs: Runs) -> Result:
    speed = float(mean_velocity(runs["table 7.5"], 0.0, 2 * PERIOD)[0])
    later = period_speed(runs["table 7.5"])
    ours = f"{100 * speed:.1f} cm/s from rest on, {100 * later:.1f} cm/s in the second period"
    return ours, 0.14 < speed < 0.164 and 0.14 < later < 0.164


@pegs.ours(
    "Table 7.5: below the no-slip bound",
    bound="0.98 to 1 of (omega L / |beta|) J_0(A / (2 sin(|beta| / 2))), every link in the track of the one before",
)
def _below_the_bound(runs: Runs) -> Result:
    speed, bound = period_speed(runs["table 7.5"]), runs.no_slip_speed("table 7.5")
    return f"{speed:.4f} m/s, bound {bound:.4f} m/s", 0.98 < speed / bound < 1.0


@pegs.reproduced(
    "faster with pegs than without",
    thesis='"15 times faster"',
    bound="13 to 17 times; the thesis divides two rounded speeds",
)
def _fifteen_times(runs: Runs) -> Result:
    factor = abs(period_speed(runs["table 7.5"]) / period_speed(runs["free"]))
    return f"{factor:.1f} times", 13.0 < factor < 17.0


@pegs.reproduced("other direction with pegs", thesis='"moves in the opposite direction"', bound="the signs")
def _opposite_direction(runs: Runs) -> Result:
    among_pegs, without = period_speed(runs["table 7.5"]), period_speed(runs["free"])
    return f"{among_pegs:+.3f} and {without:+.3f} m/s", among_pegs > 0.0 > without


@pegs.reproduced(
    "orthotropic ground (0.2, 0.5): forward without pegs",
    thesis='"for anisotropic friction [...] the direction of motion is opposite to [...] the propagating wave"',
    bound="the sign",
)
def _forward_by_anisotropy(runs: Runs) -> Result:
    speed = period_speed(runs["orthotropic"])
    return f"{speed:+.3f} m/s", speed > 0.0


@pegs.reproduced(
    "no peg penetrates a link",
    thesis='"accurate enough to keep the obstacles from penetrating" (7.3.4)',
    bound="0.25 mm in eleven runs: steps of 25 ms let a peg in where it meets the body outside of the joints' reach",
)
def _no_penetration(runs: Runs) -> Result:
    depths = {name: runs[name].max_penetration for name in AMONG_PEGS + IN_3D}
    deepest = max(depths, key=lambda name: depths[name])
    return f"at most {1e6 * depths[deepest]:.0f} um ({deepest})", depths[deepest] < 2.5e-4


@pegs.reproduced(
    "Table 7.5 in 3D",
    thesis='"ca. 15 cm/s" (Fig. 7.16)',
    bound="0.98 to 1 of the no-slip bound, within 0.5 % of the planar model",
)
def _pegs_in_3d(runs: Runs) -> Result:
    speed, bound = period_speed(runs["table 7.5, 3D"]), runs.no_slip_speed("table 7.5, 3D")
    planar = period_speed(runs["table 7.5"])
    ours = f"{100 * speed:.2f} cm/s, {speed / bound:.1%} of the no-slip bound, planar {100 * planar:.2f}"
    return ours, 0.98 < speed / bound < 1.0 and abs(speed / planar - 1.0) < 5e-3


@summary.reproduced(
    "pegs against 2.5-fold friction across the links",
    thesis='"much faster by pushing against obstacles than [...] with 2.5 times higher friction coefficient"',
    bound="over 1.8 times",
)
def _faster_than_on_orthotropic_ground(runs: Runs) -> Result:
    pushed, slid = period_speed(runs["table 7.5"]), period_speed(runs["orthotropic"])
    return f"{100 * pushed:.1f} against {100 * slid:.1f} cm/s, {pushed / slid:.1f} times", pushed > 1.8 * slid
