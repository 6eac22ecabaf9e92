"""The environments' reference page, generated from what the core says about itself.

``snake-env card --write docs/environments.md`` writes it; a test keeps the file up to date.
"""

from __future__ import annotations

import itertools
import json
import re
import textwrap
from collections.abc import Iterable
from functools import cache
from typing import Any

from snake_env._native import capabilities
from snake_env._task import Task
from snake_env.errors import ConfigError
from snake_env.markdown import table
from snake_env.registration import MAX_EPISODE_STEPS, SCENARIOS, TASKS

GOALS = {row["name"]: row["goal"] for row in SCENARIOS}

ARGUMENTS = {
    "model": '"planar" or "spatial" (3D); set by the id',
    "task": "scene and goal, by the names [above](#ids); set by the id",
    "action_mode": '[what it sets](interface.md#actions): "gait", "joints", "residual", "velocities" or "torques"',
    "perception": '"pegs": the pegs nearest to the leading link; "body": also the nearest peg of each link; '
    '"blind": contact forces only',
    "nearest_pegs": "number of pegs observed, 1 to 64",
    "control_period": "time between two actions [s], 0.001 to 1",
    "max_episode_steps": "control periods after which an episode is truncated, >= 1; -1: never",
    "goal_distance": "distance from the start of the CG to the goal line or the goal point [m], 0.1 to 20",
    "corridor_half_width": "half width of the corridor; with a goal point: how much farther from it than at the "
    "start [m], 0.1 to 5",
    "goal_radius": 'radius of the goal of "maze" and "corridor" [m], 0.01 to 0.9 `goal_distance`',
    "turn": 'largest angle to the goal of "maze", bend of "corridor" or change of direction of "command", at '
    "difficulty 1 [rad], 0 to pi/2",
    "speed": 'interval of the speed that "command" commands [m/s], 0 to 2',
    "difficulty": "irregularity of a random scene, 0 to 1",
    "field": 'generator of the random field: "mixed", "track", "lattice" or "poisson"',
    "terrain": 'kind of uneven ground: "mixed", "rough", "blocks", "stairs" or "ramps"',
    "push_points": '[push-points](concepts.md#push-points) per body length that scenes of "field" and "maze" '
    "must have, 0 to 4",
    "perturbation": 'pegs of "perturbed" out of place: `course` ("table-7.3", "table-7.5" or "mixed"), numbers '
    "`removed` and `shifted`, longest `shift` at difficulty 1 [m], 0 to 0.5; always: `without` = [j, ...], `moved` = "
    "[[j, dx, dy], ...], j from 1",
    "randomization": "parameters sampled per robot and episode: [below](#curriculum-and-randomisation)",
    "scene": "a `snake_env.Scene` in place of the task's pegs and ground, a list of scenes, or a "
    "function `generator(rng, difficulty)` ([ground](ground.md#in-environments))",
    "observation_blocks": "names of the blocks of the observation; null: all but those on request",
    "privileged": "whether the observation ends with `privileged_...` blocks: what a robot cannot sense, for critics",
    "observation_noise": "amplitudes of uniform noise on blocks of the observation, by name and in their units, >= 0",
    "observation_delay": "delays of blocks of the observation, by name [s], in whole control periods, at most 100",
    "imu_link": "link of `accelerometer`, `gyro` and `gravity`, from 0; link 1 of their descriptions is the default",
    "range_link": "link of `range`, from 0",
    "encoder_resolution": "angle between two marks of the joint encoders [rad], 0 to a tenth of a turn; 0: exact. "
    "`joint_angle` is rounded to a mark, noise of `randomization` included",
    "energy": 'what `energy` and `cost_of_transport` count: "mechanical", the positive work of the actuators, or '
    '"electrical", what a `robot.motor` draws',
    "termination": "which events end an episode: `is_success`, `left_corridor`",
    "friction": "of the task's ground: Coulomb coefficients along and across a link, >= 0; null: those on its page",
    "friction_backward": "its coefficient along a link that slides [backward](ground.md#scales); null: as forward",
    "stribeck": "its Stribeck friction: `drop`, the share lost in sliding, 0 to 1, and `speed`, at which half "
    "of that is lost [m/s]",
    "slope": "inclination of that ground: angle, 0 to pi/2, and direction in which it rises [rad]",
    "controller": 'joint controller: "pd", in the planar model also "io" (input-output linearisation), or the fields '
    "of `snake_env.PD` or `snake_env.IOLinearizing` with their `law`; torque limit 10 N m",
    "integrator": 'time stepping: the fields of `snake_env.Integrator` with the method "implicit"',
    "robot": "the robot: the fields of `snake_env.Robot`",
    "reward_weights": "weights of the [reward terms](#rewards)",
    "start_jitter": "scale of the random start pose and phase, 0 to 1; 0: always the same start",
}

WORLD = {
    "robot_class": '"ideal" or "aiko": [keywords under one name](protocol.md#classes-of-robot), beneath those given',
    "start": "a `snake_env.Start` in place of the task's: position and heading of link 1, and the posture",
    "peg_friction": "range of the Coulomb coefficient between links and drawn pegs, one per episode, 0 to 10; starts "
    "then have no jitter; null: pegs without friction",
    "precision": '"fast", "default" or "fine": how accurate the time stepping is; fields of `integrator` override it',
    "goal": "in place of the task's: distance of a goal line, goal point (x, y) or (x, y, radius), or path "
    "[(x, y), ...], in m; or a command ([interface](interface.md#starts-goals-and-paths))",
    "corridor": 'deprecated: (y, half width), `corridor_half_width` and `goal={"centre_line": y}` now',
}
"""Keywords that are no fields of the core's configuration."""

HEADER = """# Environments

Make one robot, or a native batch of robots that one call steps in Rust:

```python
import gymnasium

env = gymnasium.make("snake_env:SnakeField-v1")  # a single robot
envs = gymnasium.make_vec("snake_env:SnakeField-v1", num_envs=256, difficulty=0.5)  # a batch
```

A batch is bit-identical to as many single environments; `snake_env.sb3.make(id, num_envs=n)` is one for
Stable-Baselines3. The robot is Aiko of the thesis: 11 links, link 1 leads. Units are SI and radians; CG is the centre
of gravity of the robot. [Concepts](concepts.md) explains the terms. `snake-env card --write docs/environments.md`
generates this page and those of the ids.
"""

INFO_TEXT = """The same keys after `reset` and `step`, besides `reward_<term>`. The bias of work and cost depends on
[`precision`](accuracy.md#work-of-the-actuators).
"""

ACTION_TEXT = """An action in [-1, 1] maps linearly to [min, max]; values beyond are clipped. Joint references follow it
within the slew limit per second, and a PD controller with a torque limit follows the references. In mode
"residual" the wave comes first, then the offsets of the joints. `env.unwrapped.layout["action"]` lists the entries
with their signs under reflection. In the last columns *pegs* stands for the tasks with pegs. The table is for ideal
motors. A [motor](robot.md#motors) bounds frequencies and rates by its no-load speed. The fastest wave of the default
amplitude turns joints at that speed, and so does the fastest reference.
"""

SAME_ACTIONS = """Yaw bends the body sideways, pitch up and down. The waves come first, then joint by joint yaw and
pitch.
"""

OBSERVATION_TEXT = """Each element is its value divided by the scale and clipped to the limits, so that normalisation is
not needed. Blocks come in this order; sizes are those of the default robot.
`env.unwrapped.layout["observation"]` lists every element. Blocks on request are
[sensors of real robots](interface.md#sensors-of-a-real-robot); `observation_blocks` names them.
"""

SAME_BLOCKS = """Blocks without a row below are as in the planar model. They come in this order:

{order}
"""

FOOTER = """## Vector environments

Further keywords of the batch: `num_envs`, `num_threads` (default: `SNAKE_ENV_NUM_THREADS`, else min(cores,
ceil(num_envs / 8))) and `autoreset_mode`. Further keywords of every environment: `render_mode`, `observation`,
`info_state`, `reward_fn`, `termination_fn` and `picture` ([interface](interface.md)).

| `autoreset_mode` | step in which an episode ends | next step of that robot | for |
| --- | --- | --- | --- |
| `"NextStep"` (default) | last observation | action ignored, reset observation, reward 0 | wrappers, RLlib |
| `"SameStep"` | reset observation; the last one in `infos["final_obs"]` | an ordinary step | SB3, CleanRL |
| `"Disabled"` | last observation | an error, until `reset(options={"reset_mask": mask})` | manual control |

* `RecordEpisodeStatistics` of Gymnasium before 1.4 counts wrongly over `"SameStep"`, and RLlib loses steps.
* `reset(seed=s)` gives robot i the random stream s + i, for any number of robots and threads. A reset without seed
  continues with the next episode of each stream.
* Options of `reset` are `reset_mask`, a bool array, and `scene`, `start`, `goal` and `difficulty`.
* `infos["_name"]` tells which entries of `infos["name"]` are valid. Infos of last steps are in `infos["final_info"]`.
* `get_state(mask)` and `set_state(states, mask)` save and restore robots bit for bit. A state of another configuration
  is refused with what differs.

## Curriculum and randomisation

`set_difficulty(d)`, in a batch `set_difficulty(d, mask)`, sets the difficulty of later episodes
([in Stable-Baselines3](training.md#callbacks)).

`randomization=snake_env.Randomization(...)` samples parameters per robot and episode. Everything is off by default;
`snake_env.Randomization.thesis()` switches on what the thesis lists as discrepancies (T 7.5.4).

| field | off | range | meaning |
| --- | --- | --- | --- |
| `friction` | (1, 1) | 0 to 10 | factor on both friction coefficients |
| `anisotropy` | (1, 1) | 0 to 10 | further factor on the coefficient across a link |
| `mass` | (1, 1) | 0.1 to 10 | factor on mass and inertia of all links |
| `torque_limit` | (1, 1) | 0.01 to 10 | factor on the largest torque of a joint |
| `reference_rate` | null | 0.1 to 1 / `control_period` Hz | rate at which the joint references adopt a new action |
| `reference_delay` | (0, 0) | 0 to 10 s, at most 100 periods | time from an action to its effect, in whole periods |
| `noise` | zeros | >= 0 | amplitudes of uniform noise on the observation, sampled in each step (Table 7.4) |
| `peg_error` | 0 | 0 to 1 m | largest error of an observed peg position, constant during an episode |
| `backlash` | (0, 0) | 0 to pi/2 rad | backlash of the joints, in addition to the robot's own; PD only |
| `stribeck` | (0, 0) | 0 to 1 | share of friction lost in sliding, in addition to the ground's own |

"""

VERSIONS = """## Version history

- v1: links touch each other, joints have limits, and no action pushes links more than 1 mm into pegs. `Robot(
  self_contact=False, joint_limit=inf)` gives the laws of v0.
- v0: first release.
"""


def page() -> str:
    """The page as Markdown."""
    sections = [_ids(), *map(_model, MODELS), _rewards(), _episode(), _info(), _arguments()]
    return "\n".join([HEADER, *sections, FOOTER + _capabilities(), VERSIONS])


MODELS = ("planar", "spatial")
CHOICES = {
    "action_mode": ("gait", "joints", "residual", "velocities", "torques"),
    "perception": ("pegs", "body", "blind"),
}
"""Options on which the blocks of an observation depend, and their values."""


@cache
def _choices(model: str) -> dict[str, tuple[str, ...]]:
    """The same with the tasks that a model has: some families of scenes are in the plane only, some in 3D."""
    return {"task": tuple(row["name"] for row in SCENARIOS if _has(model, row["name"]))} | CHOICES


def _has(model: str, task: str) -> bool:
    try:
        layout_of(model=model, task=task)
    except ConfigError:
        return False
    return True


def _capabilities() -> str:
    """Which features each model has, from the core's table, those of the same models together."""
    words = {True: "yes", False: "no", "implicit": "implicit"}
    models = ("planar", "spatial", "minimal")
    features: dict[tuple[str, ...], list[str]] = {}
    for row in capabilities():
        features.setdefault(tuple(words[row[model]] for model in models), []).append(str(row["name"]))
    text = (
        "## What each model has\n\n"
        "Environments have the planar and the spatial model, `snake_env.simulate` has all three. What a model does not "
        'have is refused by name. *implicit*: only with `method="implicit"`.\n\n'
    )
    return text + _table(("feature", *models), [("; ".join(names), *having) for having, names in features.items()])


@cache
def peg_tasks() -> set[str]:
    """Tasks with pegs, whose forces are observed."""
    layouts = {row["name"]: layout_of(model=row["model"], task=row["name"]) for row in SCENARIOS}
    return {name for name, one in layouts.items() if "contact_force" in {block["name"] for block in one["observation"]}}


def page_name(env_id: str) -> str:
    """Name of the page and the film of an id: ``"field"`` of ``"SnakeField-v1"``."""
    return env_id.removeprefix("Snake").partition("-")[0].lower()


def layout_of(**options: Any) -> dict[str, Any]:
    """What the core says about the environment with these keywords."""
    return Task(options, MAX_EPISODE_STEPS).layout


def _ids() -> str:
    rows = []
    for env_id, options in TASKS.items():
        config = layout_of(**options)["config"]
        link = f"[{env_id}](environments/{page_name(env_id)}.md)"
        rows.append((link, config["model"], config["task"], GOALS[config["task"]]))
    head = ("id", "model", "task", "goal")
    parts = ["## Ids\n", _table(head, rows)]
    parts.append("Each id has a page with a film, sizes of observation and action, and the shipped policies.\n")
    parts.append("![Starts of test scene 0 of every family, at three difficulties](images/gallery.png)\n")
    return "\n".join(parts)


def _model(model: str) -> str:
    """Actions and observations of a robot model."""
    return "\n".join([f"## The {model} model\n", _actions(model), _observation(model)])


def _actions(model: str) -> str:
    """One table for all action modes; rows that differ between tasks name theirs and follow each other."""
    uses: dict[str, dict[tuple[str, ...], dict[str, set[str]]]] = {}
    for mode, task in itertools.product(CHOICES["action_mode"], _choices(model)["task"]):
        layout = layout_of(model=model, task=task, action_mode=mode)
        for name, *cells in grouped(map(action_row, layout["action"])):
            _note(uses.setdefault(name, {}).setdefault(tuple(cells), {}), {"action_mode": mode, "task": task})
    rows = []
    for name, variants in uses.items():
        said = ""
        for (*cells, meaning), found in variants.items():
            modes = _conditions(model, found).removeprefix("`action_mode` ")
            rows.append((name, *cells, "likewise" if meaning == said else meaning, modes))
            said = meaning
    head = ("action", "min, max", "slew limit", "meaning", "only with `action_mode`")
    text = ACTION_TEXT if model == MODELS[0] else SAME_ACTIONS
    return "\n".join(["### Actions\n", text, _table(head, rows)])


def action_row(entry: dict[str, Any]) -> tuple[str, ...]:
    """Name, interval with its unit, slew limit and meaning of an entry of the action."""
    interval = f"{_interval(entry['low'], entry['high'])} {entry['unit']}"
    return (entry["name"], interval, number(entry["slew"]), entry["meaning"])


def _interval(low: float, high: float) -> str:
    return f"+-{number(high)}" if low == -high else f"{number(low)}, {number(high)}"


def _observation(model: str) -> str:
    """One table of all blocks that the model can have, with the options that they need; shared rows only once."""
    rows = _block_rows(model)
    head = ("block", "size", "scale", "limits", "meaning", "only with")
    if model == MODELS[0]:
        return "\n".join(["### Observations\n", OBSERVATION_TEXT, _table(head, rows)])
    planar = {row[0]: row for row in _block_rows(MODELS[0])}
    own = [
        (*cells, "as in the planar model" if meaning == planar.get(cells[0], cells)[-2] else meaning, needs)
        for *cells, meaning, needs in (row for row in rows if row not in planar.values())
    ]
    order = textwrap.wrap(" ".join(row[0] for row in rows), 100)
    text = SAME_BLOCKS.format(order=textwrap.indent("\n".join(order), "    "))
    return "\n".join(["### Observations\n", text, _table(head, own)])


def _block_rows(model: str) -> list[tuple[str, ...]]:
    """Rows of all blocks, in the order of the observation."""
    blocks: dict[str, dict[str, Any]] = {}
    uses: dict[str, dict[str, set[str]]] = {}
    order: list[str] = []
    on_request: set[str] = set()
    choices = _choices(model)
    for values in itertools.product(*choices.values()):
        options = dict(zip(choices, values, strict=True))
        place = 0
        usual = layout_of(model=model, **options)
        named = layout_of(model=model, **options, observation_blocks=usual["on_request"])
        for block in usual["observation"] + named["observation"]:
            name = block["name"]
            if name not in order:
                order.insert(place, name)
            place = order.index(name) + 1
            blocks.setdefault(name, block)
            _note(uses.setdefault(name, {}), options)
            on_request |= {name} & set(usual["on_request"])
    request = dict.fromkeys(on_request, "on request")
    conditions = {name: filter(None, (request.get(name), _conditions(model, uses[name]))) for name in order}
    return [_block_row(blocks[name], "; ".join(conditions[name])) for name in order]


def _block_row(block: dict[str, Any], conditions: str) -> tuple[str, ...]:
    size = "of the action" if block["name"] == "previous_action" else str(block["size"])
    scale = number(block["scale"]) if block["unit"] == "1" else f"{number(block['scale'])} {block['unit']}"
    return (block["name"], size, scale, _interval(block["low"], block["high"]), block["description"], conditions)


def _note(uses: dict[str, set[str]], options: dict[str, str]) -> None:
    """Adds the values of options with which something was found."""
    for option, value in options.items():
        uses.setdefault(option, set()).add(value)


def _conditions(model: str, uses: dict[str, set[str]]) -> str:
    """The options that something needs, or those with which it is absent where they are far fewer."""
    parts = []
    for option, found in uses.items():
        choices = _choices(model)[option]
        present = [value for value in choices if value in found]
        absent = [value for value in choices if value not in found]
        if option == "task" and set(present) == peg_tasks() & set(choices):
            parts.append("pegs")
        elif absent and 3 * len(absent) < len(present):
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
        "The robot starts at rest in the posture of the gait, facing +x. Its phase is random and it is displaced a "
        "little, both scaled by `start_jitter`. An episode terminates at the goal (`is_success`) and when the robot "
        f"has strayed (`left_corridor`). It is truncated after `max_episode_steps` = {steps} steps, "
        f"{number(steps * period)} s, and when its simulation has failed (`diverged`, `penetrated`).\n\n"
        + _table(("goal", "`is_success`", "`left_corridor`"), rows)
    )


def _info() -> str:
    having: dict[tuple[str, ...], list[str]] = {}
    for model in MODELS:
        for s in layout_of(model=model)["signals"]:
            if not s["name"].startswith("reward_"):
                unit = s["unit"] if s["kind"] == "float" else s["kind"]
                having.setdefault((f"`{s['name']}`", unit, s["description"]), []).append(model)
    rows = [
        (name, unit, meaning if len(models) == len(MODELS) else f"{meaning} ({models[0]})")
        for (name, unit, meaning), models in having.items()
    ]
    return "\n".join(["## Info\n", INFO_TEXT, _table(("key", "unit", "meaning"), rows)])


def _arguments() -> str:
    config = layout_of()["config"]
    rows = [(f"`{name}`", default(config[name]), meaning) for name, meaning in ARGUMENTS.items()]
    rows += [(f"`{name}`", default(None), meaning) for name, meaning in WORLD.items()]
    return "\n".join(["## Arguments\n", _table(("keyword", "default", "meaning and range"), rows)])


def default(value: Any) -> str:
    """A default as JSON; of many fields only that there are some."""
    if isinstance(value, dict) and len(value) > 2:
        return "its defaults"
    text = json.dumps(round(value, 4) if isinstance(value, float) else value)
    return f"`{text}`"


def _table(head: Iterable[str], rows: Iterable[Iterable[Any]]) -> str:
    return table(head, rows) + "\n"


def number(value: float) -> str:
    """Four digits; no sign of zero."""
    return f"{round(value, 12) + 0.0:.4g}"
