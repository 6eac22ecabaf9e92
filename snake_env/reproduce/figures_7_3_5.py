"""Figures 7.10 and 7.11, and those of what the thesis leaves out about its controllers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from snake_env import drawing
from snake_env.config import PD, Gait, IOLinearizing
from snake_env.reproduce import stability, theorem, tracking
from snake_env.reproduce.experiment import Runs
from snake_env.reproduce.experiments import FEEDBACK

Array = NDArray[np.float64]

COLOURS = {"IO": drawing.PATH, "PD": drawing.FORCE, "PD high": "#3a8f4d"}
Family = tuple[str, Callable[[float], PD | IOLinearizing], Array, Callable[[Array], Array]]
"""Title, controller by K_D, values of K_D, and the longest stable control period by theory."""
LAW_COLOURS = {"set-valued": "black", "ellipse": drawing.PATH, "arctan": drawing.FORCE}


def figure_7_10(runs: Runs, path: Path) -> Path:
    """Reference of joint 5, and its error under both controllers on the smooth and on the set-valued plant."""
    drawn, axes = drawing.figure(3, 1, 7.0, 6.4)
    _reference(axes[0, 0], runs)
    for panel, law, letter in ((1, "arctan", "b"), (2, "set-valued", "c")):
        _errors(axes[panel, 0], runs, {name: f"{name}, {law}" for name in ("IO", "PD")}, 0.8)
        axes[panel, 0].set_title(f"({letter}) tracking error of joint 5, {law} friction")
    return drawing.save(drawn, path)


def figure_7_11(runs: Runs, path: Path) -> Path:
    """The same with the noise of Table 7.4."""
    drawn, axes = drawing.figure(4, 1, 7.0, 8.2)
    _reference(axes[0, 0], runs)
    for panel, row in enumerate("bcd", start=1):
        _errors(axes[panel, 0], runs, {name: f"{name}, noise {row}" for name in ("PD", "IO")}, 0.8)
        axes[panel, 0].set_title(f"({row}) tracking error of joint 5, noise of row ({row}) of Table 7.4")
    return drawing.save(drawn, path)


def figure_limit(runs: Runs, path: Path) -> Path:
    """Soft start and stationary motion with torques limited to 10 N m."""
    drawn, axes = drawing.figure(2, 2, 9.0, 5.0)
    for column, law in enumerate(("arctan", "set-valued")):
        curves = {name: f"{name} 10 N m, {law}" for name in ("IO", "PD")}
        _errors(axes[0, column], runs, curves, 8.0)
        axes[0, column].set(title=f"error of joint 5, {law}, +-10 N m", xlim=(0.0, 5.0))
        for name, run in curves.items():
            torque = np.abs(runs[run].joint_torque).max(axis=1)
            axes[1, column].plot(runs[run].time, torque, color=COLOURS[name], label=name)
        axes[1, column].set(title="largest torque of any joint", xlabel="time [s]", ylabel="[N m]", xlim=(0.0, 5.0))
    return drawing.save(drawn, path)


def figure_box_and_ellipse(runs: Runs, path: Path) -> Path:
    """The printed smooth law against the set-valued one and its own smoothing."""
    drawn, axes = drawing.figure(1, 3, 10.0, 3.2)
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    axes[0, 0].plot(0.2 * np.cos(angle), 0.5 * np.sin(angle), color="black", label="(6.25)")
    axes[0, 0].plot([0.2, -0.2, -0.2, 0.2, 0.2], [0.5, 0.5, -0.5, -0.5, 0.5], color=drawing.FORCE, label="(6.21)")
    axes[0, 0].set(title="admissible forces", xlabel="along / F_N", ylabel="across / F_N", aspect="equal")
    axes[0, 0].legend(loc="center")
    for law, colour in LAW_COLOURS.items():
        run = runs[f"PD, {law}"]
        _curve(axes[0, 1], run.time, tracking.errors(run)[:, tracking.JOINT], colour, law)
        centre = run.position[:, :, 0].mean(axis=1)
        _curve(axes[0, 2], run.time, centre - centre[0], colour, law)
    axes[0, 1].set(title="PD error of joint 5", xlabel="time [s]", ylabel="[deg]", xlim=(9.0, 14.0), ylim=(-0.7, 0.7))
    axes[0, 2].set(title="displacement of the centre of mass", xlabel="time [s]", ylabel="x - x(0) [m]")
    axes[0, 2].legend()
    return drawing.save(drawn, path)


def figure_noise_torque(runs: Runs, path: Path) -> Path:
    """What the small errors under noise cost: torque of joint 5."""
    drawn, axes = drawing.figure(1, 1, 7.0, 3.0)
    labels = ["none", "(b)", "(c)", "(d)"]
    for name, shift in (("IO", -0.2), ("PD", 0.2)):
        names = [f"{name}, set-valued", *(f"{name}, noise {row}" for row in "bcd")]
        values = [tracking.rms_torque(runs[run]) for run in names]
        bars = axes[0, 0].bar(np.arange(4) + shift, values, 0.4, color=COLOURS[name], label=name)
        axes[0, 0].bar_label(bars, [f"{value:.3g}" for value in values])
    axes[0, 0].axhline(10.0, color="black", linestyle=":", linewidth=0.8)
    axes[0, 0].set(title="RMS torque of joint 5 by noise of Table 7.4; dotted: 10 N m", ylabel="[N m]", yscale="log")
    axes[0, 0].set_xticks(range(4), labels)
    axes[0, 0].set_ylim(0.3, 3000.0)
    axes[0, 0].legend()
    return drawing.save(drawn, path)


def figure_theorem(runs: Runs, path: Path) -> Path:
    """Norm of the reference's rate against what the proof allows, and w all the same."""
    drawn, axes = drawing.figure(2, 1, 7.0, 4.6)
    run = runs["IO, arctan"]
    rate = np.linalg.norm(tracking.SOFT.reference(run.time)["rate"], axis=1)
    axes[0, 0].plot(run.time, rate, color=drawing.PATH, label="gait (7.3)")
    allowed = theorem.bound(Gait()).rate
    axes[0, 0].axhline(allowed, color=drawing.FORCE, label=f"Theorem 6.1: {allowed:.3f}")
    axes[0, 0].set(title="norm of the reference's rate [rad/s]", yscale="log", ylim=(0.02, 10.0))
    axes[0, 0].legend()
    assert run.passive_velocity is not None
    for k, name in enumerate(("v_x [m/s]", "v_y [m/s]", "theta' [rad/s]")):
        axes[1, 0].plot(run.time, run.passive_velocity[:, k], label=name)
    axes[1, 0].set(title="w under input-output linearisation", xlabel="time [s]", ylim=(-1.5, 1.5))
    axes[1, 0].legend(ncols=3)
    return drawing.save(drawn, path)


def figure_high_gains(runs: Runs, path: Path) -> Path:
    """PD with gains a hundred times higher against input-output linearisation."""
    drawn, axes = drawing.figure(1, 1, 7.0, 3.0)
    _errors(axes[0, 0], runs, {name: f"{name}, set-valued" for name in ("IO", "PD high")}, 0.01)
    high = FEEDBACK["PD high"]
    axes[0, 0].set(title=f"error of joint 5, set-valued friction; PD ({high.kp:g}, {high.kd:g})", xlim=(5.0, 20.0))
    return drawing.save(drawn, path)


def figure_stability(_: Runs, path: Path) -> Path:
    """Where sampled control is stable: control period against gains."""
    drawn, axes = drawing.figure(2, 3, 9.0, 5.6)
    periods = np.geomspace(1e-4, 5e-2, 18)
    families: list[Family] = [
        ("IO, K_P = K_D^2 / 4", stability.critically_damped, np.geomspace(10.0, 2e4, 16), lambda kd: 2.0 / kd),
        ("PD, k_P / k_D = 167", stability.proportioned, np.geomspace(0.02, 40.0, 16), _pd_theory),
    ]
    for row, (title, family, gains, theory) in enumerate(families):
        for column, treatment in enumerate(stability.TREATMENTS):
            stable = stability.grid(treatment, family, gains, periods)
            ax = axes[row, column]
            ax.pcolormesh(1e3 * periods, gains, stable, cmap="RdYlGn", vmin=-0.4, vmax=1.4, shading="nearest")
            if treatment.name != "implicit":
                ax.plot(1e3 * theory(gains), gains, color="black", linewidth=1.0)
            limits = (1e3 * periods[0], 1e3 * periods[-1])
            ax.set(title=f"{treatment.name}: {title}", xscale="log", yscale="log", xlim=limits)
            ax.set(ylim=(gains[0], gains[-1]), xlabel="control period [ms]", ylabel="K_D [1/s]" if row == 0 else "k_D")
    return drawing.save(drawn, path)


def _pd_theory(kd: Array) -> Array:
    return np.minimum(2.0 / (stability.MOBILITY * kd), 2.0 * 1.2 / 200.0)


def _reference(axes: Axes, runs: Runs) -> None:
    time = runs["IO, set-valued"].time
    axes.plot(time, np.degrees(tracking.SOFT.reference(time)["angle"][:, tracking.JOINT]), color="black")
    axes.set(title="(a) reference of joint 5, with soft start", ylabel="[deg]")


def _errors(axes: Axes, runs: Runs, curves: dict[str, str], limit: float) -> None:
    for name, run in curves.items():
        _curve(axes, runs[run].time, tracking.errors(runs[run])[:, tracking.JOINT], COLOURS[name], name)
    axes.set(ylim=(-limit, limit), xlabel="time [s]", ylabel="[deg]")
    axes.legend(loc="upper right", ncols=2)


def _curve(axes: Axes, x: Array, y: Array, colour: str, label: str) -> None:
    axes.plot(x, y, color=colour, label=label, linewidth=1.0)


FIGURES: dict[str, tuple[str, Callable[[Runs, Path], Path]]] = {
    "figure-7.10.png": ("7.3.5", figure_7_10),
    "figure-7.11.png": ("7.3.5", figure_7_11),
    "figure-7.3.5-torque-limit.png": ("7.3.5", figure_limit),
    "figure-7.3.5-box-and-ellipse.png": ("7.3.5", figure_box_and_ellipse),
    "figure-7.3.5-noise-torque.png": ("7.3.5", figure_noise_torque),
    "figure-7.3.5-theorem.png": ("7.3.5", figure_theorem),
    "figure-7.3.5-high-gains.png": ("7.3.5", figure_high_gains),
    "figure-7.3.5-stability.png": ("7.3.5", figure_stability),
}
"""File name -> section and function."""
