"""The picture of section 2.3.2: one gait under the friction models of others, and the price of compliant ground."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from snake_env import drawing
from snake_env.reproduce import compliant
from snake_env.reproduce.comparison import law_speed, steady_speed
from snake_env.reproduce.experiment import DEFAULT, Runs


def figure_models(runs: Runs, path: Path) -> Path:
    """Speed of the gait (7.3) by model; penetration of a fallen link over the step that its integration allows."""
    drawn, axes = drawing.figure(1, 2, 9.0, 3.4)
    bars = {
        "no slip (bound)": (runs.no_slip_speed("orthotropic"), drawing.PEG),
        "wheels (2.1), least slip": (law_speed("wheels"), drawing.PEG),
        "sign (2.8), no inertia": (law_speed("sign"), drawing.FORCE),
        "sign, smooth (6.21)": (steady_speed(runs["sign"]), drawing.FORCE),
        "set-valued (3.61)": (steady_speed(runs["orthotropic"]), drawing.PATH),
        "Coulomb, no inertia": (law_speed("coulomb"), drawing.PATH),
        "viscous (2.4), (2.7)": (steady_speed(runs["viscous"]), drawing.LINKS[10]),
        "viscous, no inertia (2.11)": (law_speed("viscous"), drawing.LINKS[10]),
    }
    shown = axes[0, 0].barh(
        list(bars), [100 * speed for speed, _ in bars.values()], color=[colour for _, colour in bars.values()]
    )
    axes[0, 0].bar_label(shown, fmt="%.1f", padding=2)
    axes[0, 0].invert_yaxis()
    axes[0, 0].set(title="(a) gait (7.3), friction 2.5 times higher across", xlabel="[cm/s]", xlim=(0.0, 19.0))
    steps = [compliant.largest_step(stiffness) for stiffness in compliant.STIFFNESS]
    sunk = [compliant.depths(k, 0.1 * step)[0] for k, step in zip(compliant.STIFFNESS, steps, strict=True)]
    axes[0, 1].loglog([1e3 * step for step in steps], [1e3 * depth for depth in sunk], "o-", color=drawing.FORCE)
    for stiffness, step, depth in zip(compliant.STIFFNESS, steps, sunk, strict=True):
        note = {"xytext": (6, -8), "textcoords": "offset points", "fontsize": 7}
        axes[0, 1].annotate(f"k = {stiffness:.0e} N/m", (1e3 * step, 1e3 * depth), **note)
    taken = 1e3 * (DEFAULT.step or 0.01)
    axes[0, 1].loglog([taken], [1e3 * runs["flat drop"].max_penetration], "o", color=drawing.PATH)
    axes[0, 1].annotate(
        "set-valued",
        (taken, 1e3 * runs["flat drop"].max_penetration),
        xytext=(6, 4),
        textcoords="offset points",
        fontsize=7,
    )
    axes[0, 1].set(title="(b) a link that falls from 0.3 m", xlabel="largest stable step [ms]", xlim=(0.4, 60.0))
    axes[0, 1].set(ylabel="deepest penetration [mm]", ylim=(1e-6, 30.0))
    return drawing.save(drawn, path)


FIGURES: dict[str, tuple[str, Callable[[Runs, Path], Path]]] = {"figure-2.3.2-models.png": ("2.3.2", figure_models)}
"""File name -> section and function."""
