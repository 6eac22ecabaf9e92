"""Lateral undulation up an inclined plane (T 2.4.1): which amplitudes get ahead."""

from __future__ import annotations

from snake_env.config import Gait, Scene, Start
from snake_env.config.section import DEGREE
from snake_env.reproduce.experiment import PERIOD, Experiment, Runs
from snake_env.reproduce.measures import period_speed

FRICTION = (0.2, 0.5)
SLOPES = (0, 4, 6, 8)
"""All below the friction angle along the links, 11.3 degrees [deg]."""
AMPLITUDES = range(10, 85, 5)
"""[deg]"""


def experiments() -> dict[str, Experiment]:
    """Up the slope with every amplitude."""
    start = Start.on_course(Scene.preset("free", FRICTION))
    return {
        f"slope {slope}, amplitude {amplitude}": Experiment(
            Scene(friction=FRICTION, slope=(slope * DEGREE, 0.0)),
            2 * PERIOD,
            Gait(amplitude=amplitude * DEGREE),
            start,
        )
        for slope in SLOPES
        for amplitude in AMPLITUDES
    }


def window(runs: Runs, slope: int) -> list[int]:
    """The amplitudes that climb it in the second period [deg]."""
    return [a for a in AMPLITUDES if period_speed(runs[f"slope {slope}, amplitude {a}"]) > 0.0]
