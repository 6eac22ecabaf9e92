"""Pictures of what a policy does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from snake_env import State, drawing
from snake_env.config import Robot, Scene
from snake_env.evaluation.film import Episode
from snake_env.obstacles import circles
from snake_env.policies.scripted.sensors import Array, Sensors
from training.evaluation.figures import COLOURS
from training.evaluation.record_episodes import push_ahead, wave_parameters

HALF_VIEW = (0.95, 0.75)
"""Half of the ground that a frame shows along and across [m]."""
GOAL, BORDER = "#3c64b4", "#50555c"
"""Colours of the goal, and of the corridor's and the pegs' borders."""
REFERENCES = (20.0, 50.0, 100.0, 200.0)
"""Forces that an arrow for comparison may stand for [N]."""


def frames(episode: Episode, title: str, count: int, path: Path) -> Path:
    """The robot, the pegs and their forces at equidistant times, the last at the end; one scale of forces for all."""
    times = np.linspace(0, len(episode.states) - 1, count + 1).round().astype(int)[1:]
    chosen = [episode.states[k] for k in times]
    scale = min(_largest_scale(one) for one in chosen)
    with drawing.style():
        drawn, axes = drawing.figure(1, count, 2.6 * count, 2.7)
        for one, state in zip(axes[0], chosen, strict=True):
            _frame(one, state, episode.scene, scale)
        pushed = any(np.hypot(*one.contact_force.T).max() > drawing.FORCE_SHOWN for one in chosen)
        if pushed:
            _reference(axes[0, 0], scale)
        drawn.legend(handles=_legend(chosen[-1], pushed), loc="outside lower center", ncols=5, fontsize=7)
        drawn.suptitle(title, fontsize=9)
        return drawing.save(drawn, path)


def _largest_scale(state: State, margin: float = 0.04, smallest: float = 0.001) -> float:
    """The scale [m/N], up to that of other pictures, at which every arrow ends inside the frame, or the smallest."""
    start = np.vstack([state.link_position, state.link_position.mean(axis=0)]) - state.position
    force = np.vstack([state.contact_force, state.contact_force.sum(axis=0)])
    room = np.maximum(np.array(HALF_VIEW) - margin - np.sign(force) * start, 0.0)
    return max(float(np.min(room / np.maximum(np.abs(force), 1e-9), initial=drawing.FORCE_SCALE)), smallest)


def _frame(axes: Axes, state: State, scene: Scene, scale: float) -> None:
    """One time: links, pegs, an arrow for the pegs' force on each link, and a black one for their sum."""
    (x, y), (along, across) = state.position, HALF_VIEW
    for radius, *centre in circles(scene.obstacles):
        axes.add_patch(Circle((centre[0], centre[1]), radius, facecolor=drawing.PEG, edgecolor=BORDER, linewidth=0.6))
    links = state.link_position
    drawing.body(axes, Robot(links=len(links)), links, np.asarray(state.link_angle), (1,))
    drawing.forces(axes, links, state.contact_force, scale)
    axes.plot(x, y, "o", color="black", markersize=3.0, zorder=5)
    _goal(axes, state)
    drawing.ground(axes, f"t = {state.time:.1f} s", (x - along, x + along), (y - across, y + across))


def _goal(axes: Axes, state: State) -> None:
    """The goal, a disc or a line, and with the line the corridor's borders."""
    x, y = state.goal.tolist()
    if state.goal_radius > 0.0:
        axes.add_patch(
            Circle(
                (x, y), float(state.goal_radius), fill=False, edgecolor=GOAL, linewidth=1.0, linestyle="--", zorder=3
            )
        )
        return
    axes.axvline(x, color=GOAL, linewidth=1.0, linestyle="--")
    for side in (-1, 1):
        axes.axhline(y + side * float(state.corridor_half_width), color=BORDER, linewidth=1.2, linestyle="-.")


def _reference(axes: Axes, scale: float, shortest: float = 0.25) -> None:
    """An arrow for comparison above the right end of a frame."""
    newtons = next((one for one in REFERENCES if one * scale > shortest), REFERENCES[-1])
    x, height = axes.get_xlim()[1], 1.07
    shape = {"arrowstyle": "-|>", "mutation_scale": 9, "linewidth": 1.2, "shrinkA": 0, "shrinkB": 0}
    arrow: dict[str, Any] = {"xycoords": axes.get_xaxis_transform(), "annotation_clip": False}
    arrow["arrowprops"] = shape | {"color": drawing.FORCE}
    axes.annotate("", (x, height), (x - newtons * scale, height), **arrow)
    beside: dict[str, Any] = {"ha": "right", "va": "center", "fontsize": 7, "transform": axes.get_xaxis_transform()}
    axes.text(x - newtons * scale - 0.04, height, f"{newtons:g} N", **beside)


def _legend(state: State, pushed: bool) -> list[Line2D]:
    """Names of what is drawn."""
    arrow: dict[str, Any] = {"marker": ">", "markersize": 4}
    dashed: dict[str, Any] = {"color": GOAL, "linewidth": 1.0, "linestyle": "--"}
    found = [Line2D([], [], color="black", linestyle="", marker="o", markersize=3, label="centre of gravity")]
    if pushed:
        found.append(Line2D([], [], color=drawing.FORCE, linewidth=1.2, label="force of the pegs on a link", **arrow))
        found.append(Line2D([], [], color="black", linewidth=2.0, label="sum of these forces", **arrow))
    found.append(Line2D([], [], label="goal", **dashed))
    if state.goal_radius == 0.0:
        found.append(Line2D([], [], color=BORDER, linewidth=1.2, linestyle="-.", label="border of the corridor"))
    return found


def timeline(episode: Episode, layout: dict[str, Any], title: str, path: Path) -> Path:
    """Over time: the force ahead on each link, the gait that the policy commands, and the speed."""
    sensors = Sensors(layout)
    sensors.read(episode.observations)
    time = np.arange(len(episode.observations)) * layout["control_period"]
    with drawing.style():
        drawn, axes = drawing.figure(3, 1, 7.0, 5.4, (1.3, 1.0, 0.8))
        pushes, gait, speed = axes[:, 0]
        _pushes(pushes, push_ahead(sensors), float(layout["control_period"]))
        for name, values in wave_parameters(sensors, layout).items():
            gait.plot(time, values, label=name)
        gait.set(ylabel="gait [deg], [deg/s]")
        gait.legend(fontsize=7, ncols=4)
        speed.plot(time, sensors["velocity"][:, 0], color=COLOURS[-1])
        speed.set(ylabel="speed to goal [m/s]", xlabel="time [s]")
        for one in axes[:, 0]:
            one.set_xlim(0.0, time[-1])
        drawn.suptitle(title, fontsize=9)
        return drawing.save(drawn, path)


def _pushes(axes: Axes, force: Array, period: float) -> None:
    """A map of force over time and link; what was felt at an instant is the mean over the control period before it."""
    largest = float(np.abs(force).max()) or 1.0
    extent = (-period, (len(force) - 1) * period, force.shape[1] + 0.5, 0.5)
    image = axes.imshow(force.T, aspect="auto", cmap="RdBu_r", vmin=-largest, vmax=largest, extent=extent)
    axes.grid(visible=False)
    axes.set(ylabel="link, 1 leads")
    axes.figure.colorbar(image, ax=axes, label="force ahead [N]")


def links(forces: dict[str, tuple[Array, Array]], path: Path) -> Path:
    """Mean pushing and braking force on each link (links,) [N], policy by policy."""
    width = 0.8 / len(forces)
    with drawing.style():
        drawn, axes = drawing.figure(1, 1, 7.0, 2.6)
        one = axes[0, 0]
        for k, (name, (ahead, back)) in enumerate(forces.items()):
            place = np.arange(1, len(ahead) + 1) + (k - 0.5 * (len(forces) - 1)) * width
            one.bar(place, ahead, width, color=COLOURS[-1 - k], label=name)
            one.bar(place, back, width, color=COLOURS[-1 - k], alpha=0.5)
        one.axhline(0.0, color="black", linewidth=0.6)
        one.set(xlabel="link, 1 leads", ylabel="mean force of pegs [N]", xticks=range(1, len(ahead) + 1))
        one.set_title("ahead (full) and back (pale)")
        one.legend(fontsize=7)
        return drawing.save(drawn, path)
