"""Findings of section 2.4.1: lateral undulation up an inclined plane."""

from __future__ import annotations

from itertools import pairwise

from snake_env.reproduce.experiment import Runs
from snake_env.reproduce.findings import Result, Rows
from snake_env.reproduce.slope import AMPLITUDES, SLOPES, window

rows = Rows("2.4.1")


@rows.reproduced(
    "up a slope: fewer amplitudes climb",
    thesis='"the upper limit for the initial winding angle alpha should be decreased and the lower limit should be '
    'increased for an increasing inclination angle of the plane" (after Ma)',
    bound="with each of the slopes 4, 6 and 8 degrees the least amplitude that climbs is larger, and the largest is "
    "not; at 8 degrees both have moved by 10 degrees or more, and all between them climb",
)
def _window(runs: Runs) -> Result:
    windows = [window(runs, slope) for slope in SLOPES]
    ours = ", ".join(f"{w[0]} to {w[-1]} deg at {slope} deg" for slope, w in zip(SLOPES, windows, strict=True))
    lower, upper = [w[0] for w in windows], [w[-1] for w in windows]
    whole = all(w == [a for a in AMPLITUDES if w[0] <= a <= w[-1]] for w in windows)
    rising = all(a < b for a, b in pairwise(lower))
    falling = all(a >= b for a, b in pairwise(upper))
    return f"A = {ours}", whole and rising and falling and lower[-1] >= lower[0] + 10 and upper[-1] <= upper[0] - 10
