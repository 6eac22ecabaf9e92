"""The environments' reference page, generated from what the core says about itself.

``snake-env card --write docs/environments.md`` writes it; a test keeps the file up to date.
"""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Iterable
from typing import Any

from snake_env._native import capabilities
from snake_env._task import Task
from snake_env.markdown import table
from snake_env.registration import MAX_EPISODE_STEPS, SCENARIOS, TASKS

GOALS = {row["name"]: row["goal"] for row in SCENARIOS}

ARGUMENTS = {
    "model": 'the planar ("planar") or the 3D model ("spatial"); set by the id',
    "task": f"scene and goal: {', '.join(json.dumps(row['name']) for row in SCENARIOS)}; set by the id",
    "action_mode": 'what an action prescribes: "gait", "joints", "residual", "velocities" or "torques"',
    "perception": '"pegs": observe the pegs nearest to the leading link; "body": also the nearest peg of each link; '
    '"blind": contact forces only',
    "nearest_pegs": "number of pegs observed, 1 to 64",
    "control_period": "time between two actions [s], 0.001 to 1",
    "max_episode_steps": "control periods after which an episode is truncated, >= 1; -1: never",
    "goal_distance": "distance from the start of the CG to the goal line or the goal point [m], 0.1 to 20",
    "corridor_half_width": "distance from the centre line at which the corridor ends; with a goal point: the largest "
    "distance from it beyond that at the start [m], 0.1 to 5",
    "goal_radius": 'radius of the goal of "maze" and "corridor" [m], 0.01 to 0.9 `goal_distance`',
    "turn": 'largest angle between the start and the goal of "maze", largest bend of "corridor", largest commanded '
    'change of direction of "command", at difficulty 1 [rad], 0 to pi/2',
    "speed": 'interval of the speed that "command" commands [m/s], 0 to 2',
    "difficulty": "irregularity of a random scene, 0 to 1",
    "field": 'generator of the random field: "mixed", "track", "lattice" or "poisson"',
    "push_points": 'scenes of "field" and "maze" are generated again, up to 100 times, until every body length on the '
    "straight line to the goal has this number of usable push-points, 0 to 4; 0: no requirement. See docs/tasks.md",
    "perturbation": 'pegs of "perturbed" that are out of place: `course` ("table-7.3", "table-7.5" or "mixed"), '
    "numbers of pegs `removed`, each with the probability `difficulty`, and `shifted` in an episode, drawn from peg 3 "
    "on; the longest `shift` at difficulty 1 [m], 0 to 0.5; pegs always absent, `without` = [j, ...], and always "
    "elsewhere, `moved` = [[j, dx, dy], ...], j from 1 as in the thesis",
    "randomization": "parameters sampled per robot and episode besides the scene: the fields of "
    "`snake_env.Randomization`, with ranges and units at the end of this page",
    "scene": "a `snake_env.Scene` in place of the task's pegs and ground, a list of scenes, or a "
    "function `generator(rng, difficulty)`; see docs/interface.md",
    "observation_blocks": "names of the blocks of the observation; null: all of the task and the action mode",
    "privileged": "whether the observation ends with `privileged_...` blocks, for critics: what a robot cannot sense",
    "observation_noise": "amplitudes of uniform noise on blocks of the observation, by name and in their units, >= 0",
    "observation_delay": "delays of blocks of the observation, by name [s], in whole control periods, at most 100",
    "termination": "which events end an episode: `is_success`, `left_corridor`",
    "friction": "of the task's ground: Coulomb coefficients along and across a link, >= 0; null: its own, (0.2, 0.5) "
    'for "maze" and for the planar robot on "free", and (0.2, 0.2) otherwise',
    "stribeck": "its Stribeck friction: `drop`, the share lost in sliding, 0 to 1, and `speed`, at which half "
    "of that is lost [m/s]",
    "slope": "inclination of that ground: its angle, 0 to pi/2, and the direction in which it rises, from the x axis, "
    "both in rad; only the block `gravity` of the 3D model observes it",
    "controller": 'joint controller: "pd", or in the planar model "io" (input-output linearising, critically damped '
    "with K_D = 0.5 / T for T a tenth of the control period; both with a limit of 10 N m), or the fields of "
    "`snake_env.PD` or `snake_env.IOLinearizing` with their `law`",
    "integrator": 'time stepping: the fields of `snake_env.Integrator` with the method "implicit"',
    "robot": "the robot: the fields of `snake_env.Robot`",
    "reward_weights": "weights of the reward terms",
    "start_jitter": "scale of the random start pose and phase, 0 to 1; 0: always the same start",
}

WORLD = {
    "start": "a `snake_env.Start` in place of the task's: position and heading of link 1, and the posture",
    "precision": '"fast", "default" or "fine": how accurate the time stepping is; fields of `integrator` override it',
    "goal": "in place of the task's: the distance of a goal line, a goal point (x, y) or (x, y, radius), a path "
    "[(x, y), ...], all in m, or a command; see docs/interface.md",
    "corridor": 'deprecated: (y, half width), `corridor_half_width` and `goal={"centre_line": y}` now',
}
"""Keywords that are no fields of the core's configuration."""

HEADER = """# Environments

This page, and those of the ids, are generated by `snake-env card --write docs/environments.md`.

Each id has two forms: `gymnasium.make(id)` is a single environment, `gymnasium.make_vec(id, num_envs=n)` the native
batch `snake_env.SnakeVectorEnv`, which is bit-identical to n single environments and steps them in Rust on
`num_threads` threads. `snake_env.sb3.make(id, num_envs=n)` is the batch as a Stable-Baselines3 `VecEnv`.

A snake robot of 11 links (Aiko, Table 7.1 of the thesis) lies on a horizontal plane with Coulomb friction; the model is
planar except in `SnakeSpatial-v1`. The robot has no wheels: it moves forward by pushing its body against pegs, or by
sliding more easily along its links than across them. Link 1 leads. Units are SI and radians. Terms are defined in
[notation.md](notation.md#glossary), scenes in [tasks.md](tasks.md).
"""

INFO_TEXT = """The same keys after `reset` and `step`. `positive_work`, `energy` and `cost_of_transport` have a bias
that depends on `precision`: [accuracy.md](accuracy.md#work-of-the-actuators).
"""

ACTION_TEXT = """An action in [-1, 1] maps linearly to the interval [min, max]; values beyond are clipped. The
joint references follow it smoothly within the slew limit, and a joint controller with a torque limit follows the
references. In mode "residual" the wave comes first, then the offsets of the joints. Mode "velocities" integrates the
reference angles and limits them to 80 degrees; mode "torques" has no references: its torques, up to the
`torque_limit` of the `controller`, hold from one action to the next, less `kd` times the joint rate. "mirror": `+` if
a reflection of robot and scene leaves the value unchanged, `-` if it changes the sign.
"""

SAME_ACTIONS = """Yaw angles bend the body sideways, pitch angles up and down. The waves come first, then joint by
joint yaw and pitch, as in the observation and the state. Otherwise as above.
"""

OBSERVATION_TEXT = """Each element is its value divided by the scale and clipped to [min, max]; running normalisation is
not needed. Blocks come in this order; numbered elements are grouped by number. `+` and `-` after an element
are its mirror sign. "memory": a policy with memory keeps moving averages of the block. Scales and sizes are those of
the default robot, `corridor_half_width` and `nearest_pegs`. The absolute position is left out, since the task is the
same everywhere along the corridor.
"""

SAME_BLOCKS = """Blocks in order: {order}. Those without a row below are as in the planar model.
"""

FOOTER = """## Vector environments

Keywords of the batch besides those above: `num_envs`, `num_threads` (default: the environment variable
`SNAKE_ENV_NUM_THREADS`, else min(cores, ceil(num_envs / 8))), `autoreset_mode`, and those
of every environment: `max_episode_steps`, `render_mode`, `observation`, `info_state`, `reward_fn`, `termination_fn` and
`picture`. States, scenes, starts and goals of your own, and own rewards: [interface.md](interface.md).

| `autoreset_mode` | step in which an episode ends | next step of that robot | for |
| --- | --- | --- | --- |
| `"NextStep"` (default) | last observation | action ignored, reset observation, reward 0 | wrappers, RLlib |
| `"SameStep"` | reset observation; the last one in `infos["final_obs"]` | an ordinary step | SB3, CleanRL |
| `"Disabled"` | last observation | an error, until `reset(options={"reset_mask": mask})` | manual control |

RLlib reads the first observation of an episode from the step after its end: use `"NextStep"` there, since `"SameStep"`
silently corrupts its episodes. Gymnasium's `RecordEpisodeStatistics` counts returns and lengths wrongly over
`"SameStep"` before version 1.4.

`reset(seed=s)` gives robot i the random stream s + i, independent of the number of robots and threads; a reset without
seed continues with the next episode of each stream. Options of `reset` are `reset_mask`, a bool array, and `scene`,
`start`, `goal` and `difficulty`.

As in Gymnasium's own vector environments, the infos are arrays with an entry per robot, and `infos["_name"]` tells
which entries of `infos["name"]` are valid. In `infos["final_obs"]`, an array of objects, each robot whose episode has
ended has an observation as its observation space has it: an array, or a mapping with `observation="dict"`. The infos of
these last steps are in `infos["final_info"]`.

`get_state(mask)` and `set_state(states, mask)` save and restore robots bit for bit. A state of an environment with
another configuration is refused with what differs; only the time limit and the difficulty of later episodes may.

`SnakeVecEnv`, the batch for Stable-Baselines3, reports return and length of each episode itself, as `VecMonitor` does,
which is not needed then. `infos[i]` is empty but for the last step of an episode; `venv.signals` has the entries of
every step, arrays with an entry per robot.

Set the threads of torch too: `torch.set_num_threads(1)`, with the rest for the simulation, is a good start.

## Curriculum and randomisation

`set_difficulty(d)` of the single environment (`env.unwrapped`) and `set_difficulty(d, mask)` of the batch set the
difficulty of later episodes per robot; a callback of Stable-Baselines3 calls
`env.env_method("set_difficulty", d)`.

`randomization` samples per robot and episode what the thesis lists as discrepancies (T 7.5.4). Everything is off by
default; `snake_env.Randomization.thesis()` switches all of it on.

| field | off | range | unit | meaning |
| --- | --- | --- | --- | --- |
| `friction` | (1, 1) | 0 to 10 | 1 | factor on both friction coefficients |
| `anisotropy` | (1, 1) | 0 to 10 | 1 | further factor on the coefficient across a link |
| `mass` | (1, 1) | 0.1 to 10 | 1 | factor on mass and inertia of all links |
| `torque_limit` | (1, 1) | 0.01 to 10 | 1 | factor on the largest torque of a joint |
| `reference_rate` | null | 0.1 to 1 / `control_period` | Hz | rate at which the joint references adopt a new action |
| `reference_delay` | (0, 0) | 0 to 10, at most 100 periods | s | time from an action to its effect, in whole periods |
| `noise` | zeros | >= 0 | | amplitudes of uniform noise on the observation, sampled in each step (Table 7.4) |
| `peg_error` | 0 | 0 to 1 | m | largest error of an observed peg position, constant during an episode |
| `backlash` | (0, 0) | 0 to pi/2 | rad | backlash of the joints, in addition to the robot's own |
| `stribeck` | (0, 0) | 0 to 1 | 1 | share of friction lost in sliding, in addition to the ground's own |

The start pose is randomised by `start_jitter`.
Backlash also needs a PD controller. `joint_angle` is that of the joint, not of the motor.

"""

VERSIONS = """## Version history

- v1: links touch each other, joints have limits, and no action pushes links more than 1 mm into
  pegs; in v0 links passed through each other. All shipped policies are trained in v1.
- v0: first release of all ids.
"""


def page() -> str:
    """The page as Markdown."""
    sections = [_ids(), *map(_model, MODELS), _rewards(), _episode(), _info(), _arguments()]
    return "\n".join([HEADER, *sections, FOOTER + _capabilities(), VERSIONS])


MODELS = ("planar", "spatial")
CHOICES = {
    "task": tuple(row["name"] for row in SCENARIOS),
    "action_mode": ("gait", "joints", "residual", "velocities", "torques"),
    "perception": ("pegs", "body", "blind"),
}
"""Options on which the blocks of an observation depend, and their values."""


def _capabilities() -> str:
    """What each model has, from the core's table."""
    words = {True: "yes", False: "no", "implicit": '`method="implicit"`'}
    models = ("planar", "spatial", "minimal")
    rows = [(row["name"], *(words[row[model]] for model in models)) for row in capabilities()]
    text = (
        "## What each model has\n\n"
        "Environments have the planar and the spatial model, `snake_env.simulate` has all three. What a model does not "
        "have is refused by name.\n\n"
    )
    return text + _table(("feature", *models), rows)


def page_name(env_id: str) -> str:
    """Name of the page and the film of an id: ``"field"`` of ``"SnakeField-v1"``."""
    return env_id.removeprefix("Snake").partition("-")[0].lower()


def layout_of(**options: str) -> dict[str, Any]:
    """What the core says about the environment with these keywords."""
    return Task(options, MAX_EPISODE_STEPS).layout


def _ids() -> str:
    rows = []
    for env_id, options in TASKS.items():
        layout = layout_of(**options)
        size = sum(block["size"] for block in layout["observation"])
        config = layout["config"]
        link = f"[{env_id}](environments/{page_name(env_id)}.md)"
        rows.append((link, config["model"], config["task"], GOALS[config["task"]], size, len(layout["action"])))
    head = ("id", "model", "task", "goal", "observation", "action")
    parts = ["## Ids\n", _table(head, rows)]
    parts.append(
        "Spaces are `Box` of float32: actions (a,) in [-1, 1], observations (o,) with the bounds below; o and a are "
        "those of the default options. `env.unwrapped.layout` lists every element of both.\n"
    )
    parts.append("Each id has a page with a film, its actions and its observations; [gallery](gallery.md) shows all.\n")
    return "\n".join(parts)


def _model(model: str) -> str:
    """Actions and observations of a robot model."""
    return "\n".join([f"## The {model} model\n", _actions(model), _observation(model)])


def _actions(model: str) -> str:
    """One table for all action modes; rows that differ between tasks name theirs."""
    uses: dict[tuple[str, ...], dict[str, set[str]]] = {}
    for mode, task in itertools.product(CHOICES["action_mode"], CHOICES["task"]):
        layout = layout_of(model=model, task=task, action_mode=mode)
        for row in grouped(map(action_row, layout["action"])):
            _note(uses.setdefault(row, {}), {"action_mode": mode, "task": task})
    rows = [(*row, _conditions(found)) for row, found in uses.items()]
    head = ("action", "min", "max", "slew limit [unit/s]", "unit", "mirror", "meaning", "only with")
    text = ACTION_TEXT if model == MODELS[0] else SAME_ACTIONS
    return "\n".join(["### Actions\n", text, _table(head, rows)])


def action_row(entry: dict[str, Any]) -> tuple[str, ...]:
    """Name, limits, unit, mirror sign and meaning of an entry of the action."""
    limits = (number(entry[key]) for key in ("low", "high", "slew"))
    return (entry["name"], *limits, entry["unit"], sign(entry["mirror"]), entry["meaning"])


def _observation(model: str) -> str:
    """One table of all blocks that the model can have, with the options that they need; shared rows only once."""
    rows = _block_rows(model)
    head = ("block", "elements", "unit", "scale", "min, max", "memory", "meaning", "only with")
    if model == MODELS[0]:
        return "\n".join(["### Observations\n", OBSERVATION_TEXT, _table(head, rows)])
    shared = set(_block_rows(MODELS[0]))
    own = [row for row in rows if row not in shared]
    text = SAME_BLOCKS.format(order=", ".join(row[0] for row in rows))
    return "\n".join(["### Observations\n", text, _table(head, own)])


def _block_rows(model: str) -> list[tuple[str, ...]]:
    """Rows of all blocks, in the order of the observation."""
    blocks: dict[str, dict[str, Any]] = {}
    uses: dict[str, dict[str, set[str]]] = {}
    order: list[str] = []
    for values in itertools.product(*CHOICES.values()):
        options = dict(zip(CHOICES, values, strict=True))
        place = 0
        for block in layout_of(model=model, **options)["observation"]:
            name = block["name"]
            if name not in order:
                order.insert(place, name)
            place = order.index(name) + 1
            blocks.setdefault(name, block)
            _note(uses.setdefault(name, {}), options)
    return [_block_row(blocks[name], _conditions(uses[name])) for name in order]


def _block_row(block: dict[str, Any], conditions: str) -> tuple[str, ...]:
    pairs = zip(block["elements"], map(sign, block["mirror"]), strict=True)
    elements = ", ".join(f"{element} {sign}" for element, sign in grouped(pairs))
    if block["name"] == "previous_action":
        elements = "those of the action"
    bounds = f"{number(block['low'])}, {number(block['high'])}"
    memory = "yes" if block["memory"] else ""
    scale = number(block["scale"])
    return (block["name"], elements, block["unit"], scale, bounds, memory, block["description"], conditions)


def _note(uses: dict[str, set[str]], options: dict[str, str]) -> None:
    """Adds the values of options with which something was found."""
    for option, value in options.items():
        uses.setdefault(option, set()).add(value)


def _conditions(uses: dict[str, set[str]]) -> str:
    """The options that something needs, or those with which it is absent where they are fewer."""
    parts = []
    for option, found in uses.items():
        present = [value for value in CHOICES[option] if value in found]
        absent = [value for value in CHOICES[option] if value not in found]
        if absent and len(absent) < len(present):
            parts.append(f"`{option}` not {', '.join(absent)}")
        elif absent:
            parts.append(f"`{option}` {', '.join(present)}")
    return "; ".join(parts)


def grouped(rows: Iterable[tuple[str, ...]]) -> list[tuple[str, ...]]:
    """Rows whose first cells differ only in a number, such as those of the joints, as one row "first ... last"."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for name, *cells in rows:
        groups.setdefault((re.sub(r"\d+", "#", name), *cells), []).append(name)
    return [
        (names[0] if len(names) == 1 else f"{names[0]} ... {names[-1]}", *cells)
        for (_, *cells), names in groups.items()
    ]


def sign(mirror: int) -> str:
    """Of an element under reflection."""
    return "+" if mirror > 0 else "-"


def _rewards() -> str:
    terms = layout_of()["reward"]
    rows = [(term["name"], term["weight"], term["description"], term["unit"]) for term in terms]
    text = "The sum of these terms times their `reward_weights`; each weighted term is in `info` as `reward_<term>`.\n"
    return "\n".join(["## Rewards\n", text, _table(("term", "weight", "value", "unit"), rows)])


def goal_rows(config: dict[str, Any]) -> dict[str, tuple[str, str]]:
    """By kind of goal when it is reached, and when the robot has strayed."""
    goal, half_width = number(config["goal_distance"]), number(config["corridor_half_width"])
    radius = number(config["goal_radius"])
    return {
        "line": (
            f"the CG has moved `goal_distance` = {goal} m along x",
            f"it is more than `corridor_half_width` = {half_width} m from the corridor's centre line",
        ),
        "disc": (
            f"the CG is within `goal_radius` = {radius} m of the goal point, {goal} m from its start",
            f"it is {half_width} m farther from the goal point than it was at the start",
        ),
        "path": (
            f"the CG has come along the path to its last `goal_radius` = {radius} m",
            f"it is more than {half_width} m from the path",
        ),
        "direction": ("never", "never"),
    }


def _episode() -> str:
    config = layout_of()["config"]
    period, steps = config["control_period"], config["max_episode_steps"]
    rows = [(goal, *conditions) for goal, conditions in goal_rows(config).items()]
    return (
        "## Start, termination, truncation\n\n"
        "The robot starts at rest in the posture of the gait, ready to move to +x, at a random phase and with a small "
        "random displacement, both scaled by `start_jitter`. An episode terminates at the goal (`is_success`) and when "
        "the robot has strayed (`left_corridor`), as `termination` says. It is truncated after `max_episode_steps` = "
        f"{steps} steps, {number(steps * period)} s, and when the simulation of this robot has diverged "
        "(`diverged`) or left a link inside an obstacle (`penetrated`).\n\n"
        + _table(("goal", "`is_success`", "`left_corridor`"), rows)
    )


def _info() -> str:
    having: dict[tuple[str, ...], list[str]] = {}
    for model in MODELS:
        for s in layout_of(model=model)["signals"]:
            having.setdefault((f"`{s['name']}`", s["kind"], s["unit"], s["description"]), []).append(model)
    rows = [(*signal, "" if len(models) == len(MODELS) else models[0]) for signal, models in having.items()]
    head = ("key", "type", "unit", "meaning", "only with `model`")
    return "\n".join(["## Info\n", INFO_TEXT, _table(head, rows)])


def _arguments() -> str:
    config = layout_of()["config"]
    rows = [(f"`{name}`", f"`{json.dumps(config[name])}`", meaning) for name, meaning in ARGUMENTS.items()]
    rows += [(f"`{name}`", "`null`", meaning) for name, meaning in WORLD.items()]
    return "\n".join(["## Arguments\n", _table(("keyword", "default", "meaning and range"), rows)])


def _table(head: Iterable[str], rows: Iterable[Iterable[Any]]) -> str:
    return table(head, rows) + "\n"


def number(value: float) -> str:
    """Four digits; no sign of zero."""
    return f"{round(value, 12) + 0.0:.4g}"
