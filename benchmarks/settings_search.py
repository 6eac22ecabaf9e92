"""Errors and cost of our settings and MuJoCo's under random actions.

Errors of all settings come first; then those that no other setting of the same simulator beats in both error and time
are timed in interleaved rounds, so that other work on the machine weighs on all alike.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.curves import Point, frontier
from benchmarks.mujoco_model import DEFAULT, STIFF, Setup
from benchmarks.mujoco_spatial import SpatialSetup
from benchmarks.restarts import SCENES, Case, Course, Mujoco, Ours, Player
from snake_env import Scene

Record = dict[str, Any]

FIELD = (("difficulty", 0.5),)
NO_ROLLING_FRICTION = (("scene", Scene(friction=(0.2, 0.2), rolling_friction=0.0)),)
"""MuJoCo's model in 3D leaves it out."""
CASES = (
    Case("SnakeCourse-v1", "joints"),
    Case("SnakeCourse-v1", "gait"),
    Case("SnakeField-v1", "joints", FIELD),
    Case("SnakeField-v1", "gait", FIELD),
    Case("SnakeFree-v1", "joints"),
    Case("SnakeFree-v1", "gait"),
    Case("SnakeSpatial-v1", "joints", NO_ROLLING_FRICTION),
)
STEPS = (0.025, 0.01, 0.005, 0.0025, 0.002, 0.001, 0.0005, 0.00025)
"""Steps of MuJoCo that are tried [s]."""
FINEST_3D = 0.0001
"""One more in 3D, where its errors fall more slowly [s]."""
SHOWN_STEP = 0.01
"""That of MuJoCo in the table of environment steps [s]."""
PEG_CONTACTS = tuple(product((2e-3, 1e-4), (DEFAULT, STIFF)))
"""Time constants [s] and impedances that are tried in the plane."""
CONTACTS_3D = tuple(product((2e-3, 1e-3, 2e-2), (1e3, 1e5), (DEFAULT, STIFF)))
"""Time constants [s], hardness of friction and impedances that are tried in 3D."""
TOLERANCE = 1e-2
"""Of MuJoCo's solver; tighter ones cost more and err no less."""
FINEST = {"step_tolerance": 1e-6, "impact_step": 1e-4}
REFERENCE: dict[str, Record] = {
    "planar": {"step": 0.000625, "tolerance": 1e-7, **FINEST},
    "spatial": {"step": 0.0005, "tolerance": 1e-6, **FINEST},
}
SHARES = (10.0, 4.0, 0.5, 0.2, 0.1)
"""Of the default tolerances, beyond the precision "fast" and before "fine"."""


def _around(tolerance: float, step_tolerance: float, impact_step: float) -> list[Record]:
    defaults = {"tolerance": tolerance, "step_tolerance": step_tolerance, "impact_step": impact_step}
    shares = [{name: share * value for name, value in defaults.items()} for share in SHARES]
    return [{"precision": "fast"}, {"precision": "fine"}, *shares]


OURS: dict[str, list[Record]] = {
    "planar": _around(1e-4, 4e-4, 1.5e-3),
    "spatial": _around(1e-5, 1.5e-4, 4e-4),
}
"""Settings of ours that are tried beside the default."""


@dataclass(frozen=True)
class Plan:
    """How much is measured.

    Attributes:
        cases: environments and actions.
        robots: in the plane, and twice as many as in 3D; a multiple of twice the scenes of a case.
        starts: control periods from whose beginning robots restart; contacts have begun by the first.
        timed: number of periods, from the first of these on, that are timed.
        rounds: of timing.
        steps: of MuJoCo that are tried [s].
        steps_3d: the same in 3D.
        contacts: number of its contact settings that are tried; None: all.
    """

    cases: tuple[Case, ...] = CASES
    robots: int = 64
    starts: tuple[int, ...] = (4, 8, 12, 16)
    timed: int = 6
    rounds: int = 4
    steps: tuple[float, ...] = STEPS
    steps_3d: tuple[float, ...] = (*STEPS, FINEST_3D)
    contacts: int | None = None


SHORTEST = 0.1
"""CPU time of a timing [s]."""
QUICK_STEPS = (SHOWN_STEP, 0.002, 0.001)
QUICK = Plan(CASES[::6], 2 * SCENES, timed=2, rounds=1, steps=QUICK_STEPS, steps_3d=QUICK_STEPS, contacts=1)


@dataclass(eq=False)
class Setting:
    """What settings of a simulator gave.

    Attributes:
        party: "ours" or "MuJoCo".
        setup: the settings.
        player: the simulator.
        errors: of the worst link after one period, a restart each [m].
        work_bias: of the positive actuator work of all restarts against the reference's.
        cost: CPU time of one simulated second of one robot, in the restarts [s].
        shown: whether its environment steps are shown.
    """

    party: str
    setup: Record
    player: Player
    errors: NDArray[np.float64]
    work_bias: float
    cost: float
    shown: bool = False

    @property
    def error(self) -> float:
        """Median [m]."""
        return float(np.median(self.errors))


def measure(plan: Plan, progress: Callable[[str], None]) -> Iterator[Record]:
    """A record for each setting that was timed."""
    for case in plan.cases:
        name = f"{case.env}, random {case.actions}"
        progress(f"{name}: errors")
        model = "spatial" if case.env == "SnakeSpatial-v1" else "planar"
        robots = plan.robots // 2 if model == "spatial" else plan.robots
        periods = max(plan.starts[0] + plan.timed, plan.starts[-1] + 1)
        course = Course(case, robots, periods, REFERENCE[model])
        tried = [_tried(course, plan, *player) for player in _players(course, plan, model)]
        timed = [setting for party in ("ours", "MuJoCo") for setting in _worth_timing(tried, party)]
        progress(f"{name}: cost of {len(timed)} of {len(tried)} settings")
        costs = [[_cost(course, setting.player, plan) for setting in timed] for _ in range(plan.rounds)]
        for setting, *rounds in zip(timed, *costs, strict=True):
            yield {
                "kind": "equal_error",
                "env": case.env,
                "actions": case.actions,
                "period": course.period,
                "robots": robots,
                "samples": len(setting.errors),
                "tried": sum(other.party == setting.party for other in tried),
                "party": setting.party,
                "setup": setting.setup,
                "shown": setting.shown,
                "error": setting.error,
                "error_90": float(np.quantile(setting.errors, 0.9)),
                "work_bias": setting.work_bias,
                "cost": statistics.median(rounds),
            }


def _players(course: Course, plan: Plan, model: str) -> Iterator[tuple[str, Record, Player]]:
    """Everything that is tried."""
    for ours in ({}, *OURS[model]):
        yield "ours", ours, Ours(course, ours)
    has_pegs = any(scenario["scene"]["obstacles"] for scenario in course.scenarios)
    steps = plan.steps_3d if model == "spatial" else plan.steps
    for setup in setups(model, steps, plan.contacts if has_pegs or model == "spatial" else 1):
        yield "MuJoCo", dict(vars(setup)), Mujoco(course, setup)


def setups(model: str, steps: Sequence[float], contacts: int | None) -> list[Setup] | list[SpatialSetup]:
    """What is tried of MuJoCo in a model, with the first of the contact settings."""
    if model == "spatial":
        return [SpatialSetup(step, TOLERANCE, *one, "CG") for step, one in product(steps, CONTACTS_3D[:contacts])]
    return [Setup(step, TOLERANCE, *one, "CG") for step, one in product(steps, PEG_CONTACTS[:contacts])]


def _tried(course: Course, plan: Plan, party: str, setup: Record, player: Player) -> Setting:
    errors, bias, seconds = course.errors(player, plan.starts)
    return Setting(party, setup, player, errors, bias, seconds / (len(errors) * course.period))


def _worth_timing(tried: list[Setting], party: str) -> list[Setting]:
    """The settings of a party that no other beats, and the one whose environment steps are shown: our default, and
    MuJoCo's best at :data:`SHOWN_STEP`.
    """
    own = [setting for setting in tried if setting.party == party]
    best = frontier(Point(setting.error, 1.0 / setting.cost, {"setting": setting}) for setting in own)
    chosen = [point.record["setting"] for point in best]
    candidates = [s for s in own if not s.setup or (party == "MuJoCo" and s.setup["step"] == SHOWN_STEP)]
    shown = min(candidates, key=lambda setting: setting.error)
    shown.shown = True
    return chosen if shown in chosen else [*chosen, shown]


def _cost(course: Course, player: Player, plan: Plan) -> float:
    """CPU time of one simulated second of one robot [s]; short plays are repeated."""
    plays, seconds = 0, 0.0
    while seconds < SHORTEST:
        seconds += player.play(plan.starts[0], plan.timed).seconds
        plays += 1
    return seconds / (plays * plan.timed * course.period * course.robots)
