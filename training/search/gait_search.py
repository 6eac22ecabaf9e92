"""The best constant gait: a search over amplitude, frequency and phase shift of the wave, in 3D of both waves."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env._files import write_json
from snake_env.evaluation.rollout import layout_of, run_episodes
from snake_env.policies.gaits import DEGREE, ConstantAction, GaitParameters
from training.evaluation import figures
from training.pace import Pace
from training.search.optimise import Found, Plan, Range, Values, maximise

RANGES: dict[str, Range] = {"amplitude": (20.0, 60.0), "omega": (80.0, 200.0), "beta": (-65.0, -25.0)}
"""[deg], [deg/s], [deg]; the thesis's gait lies within."""
SPATIAL_RANGES = RANGES | {
    "amplitude": (0.0, 60.0),
    "beta": (-100.0, 0.0),
    "gamma": (-10.0, 10.0),
    "lift": (-10.0, 30.0),
    "lift_phase": (-90.0, 270.0),
}
"""Those of the 3D model on open ground, where the wave at zero is sidewinding or, without phase shift, rolls."""
PLAN = Plan()


def search(
    env_id: str,
    ranges: Mapping[str, Range] | None = None,
    plan: Plan = PLAN,
    num_threads: int | None = None,
    show: bool = False,
    **options: Any,
) -> Found:
    """Finds the gait of most progress [m] on validation fields.

    Args:
        env_id: Environment; its torque limit holds for every gait.
        ranges: Bounds of the gait's parameters, fields of :class:`GaitParameters` [deg], [deg/s];
            None: those of the environment's model.
        plan: How much is tried.
        num_threads: Threads of the simulator.
        show: Print a line for each batch, and lines of progress.
        **options: Keywords of the environment.
    """
    entries = layout_of(env_id, options | {"action_mode": "gait"})["action"]
    ranges = ranges_of(entries) if ranges is None else ranges

    def progress(tried: list[Values], fields: list[int]) -> NDArray[np.float64]:
        actions = np.array([gait(values).action(entries) for values in tried])
        kind = _Shown if show else ConstantAction
        policy = kind(np.repeat(actions, len(fields), axis=0), "gaits", {"action_mode": "gait"})
        episodes = run_episodes(policy, env_id, fields * len(tried), num_threads, **options)
        distance: NDArray[np.float64] = episodes["distance"].reshape(len(tried), len(fields)).mean(axis=1)
        return distance

    thesis = in_degrees(GaitParameters(), ranges)
    inside = all(low <= thesis[name] <= high for name, (low, high) in ranges.items())
    return maximise(ranges, progress, plan, [thesis] if inside else [], print if show else lambda line: None)


def ranges_of(entries: list[dict[str, Any]]) -> Mapping[str, Range]:
    """What is searched, by the environment's table of actions: both waves where action zero lifts."""
    lifts = any(entry["name"] == "lift" and entry["low"] != -entry["high"] for entry in entries)
    return SPATIAL_RANGES if lifts else RANGES


def gait(values: Values) -> GaitParameters:
    """The gait of a candidate."""
    return GaitParameters(**{name: value * DEGREE for name, value in values.items()})


def in_degrees(one: GaitParameters, names: Iterable[str] = RANGES) -> Values:
    """These parameters of the wave [deg], [deg/s]."""
    return {name: round(getattr(one, name) / DEGREE, 6) for name in names}


def write(found: Found, out: Path) -> None:
    """Writes ``gaits.png``, then ``gaits.json``, which marks the search as done."""
    out.mkdir(parents=True, exist_ok=True)
    figures.gaits(found.tried, found.scores, found.best, out / "gaits.png")
    rows = [{**values, "progress": float(score)} for values, score in zip(found.tried, found.scores, strict=True)]
    write_json(out / "gaits.json", {"best": found.best, "progress": found.score, "gaits": rows})


class _Shown(ConstantAction):
    """Prints now and then how many control periods it has acted in."""

    def begin(self, layout: dict[str, Any], num_envs: int) -> None:
        """Counts from zero."""
        self._steps, self._pace = 0, Pace()

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The actions (n, a)."""
        self._steps += 1
        if self._pace.due():
            print(f"{self._steps} control periods", flush=True)
        return super().__call__(observation)
