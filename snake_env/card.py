"""The environments' reference page, generated from what the core says about itself.

``python -m snake_env card --write docs/environments.md`` writes it; a test keeps the file up to date.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from snake_env._markdown import table
from snake_env._task import Task
from snake_env.registration import MAX_EPISODE_STEPS, TASKS

DESCRIPTIONS = {
    "SnakeCourse-v0": "The course of Table 7.5 of the thesis: seven pegs of 12.5 cm radius that fit the gait (7.3), "
    "continued to the goal. The scripted gait makes way here; an agent can be quicker, or spend less energy.",
    "SnakeField-v0": "A new random field of pegs each episode, by three generators: a threaded track with jitter, a "
    "staggered lattice, and pegs thrown at random (Poisson disc). `difficulty` in [0, 1] sets how irregular it is. "
    "The robot never starts inside a peg.",
    "SnakeFree-v0": "No pegs; the ground resists sliding across a link more than along it, which is what moves a snake "
    "forward on open ground.",
    "SnakePerturbed-v0": "The courses of Tables 7.3 and 7.5 with pegs out of place, as in Figure 7.8 of the thesis. "
    "With the probability `difficulty` a peg is missing, and two more are shifted by up to `difficulty` times one link "
    'diameter. The headline case is `perturbation={"course": "table-7.3", "without": [3], "removed": 0, "shifted": '
    "0}`, where the thesis's gait fails.",
    "SnakeMaze-v0": "A lattice of 5 x 6 posts after Liu, Onal and Fu (2021) on the way to a goal point, up to "
    "`difficulty` times 90 degrees off the robot's direction. As there the posts have a radius of 2 cm, the goal lies "
    "2 m away, the gaps jitter, and the robot can move without posts: the ground resists sideways sliding more, as in "
    "`SnakeFree-v0`. Scaled to Aiko: the posts stand half a wave of its gait apart, 0.367 m, so that a body length "
    "meets three columns and passages are three body widths wide.",
    "SnakeCorridor-v0": "A corridor whose walls are rows of pegs: straight where the robot starts, then bent along an "
    "arc by up to `difficulty` times 90 degrees, with the goal point at its end. `difficulty` also widens the corridor "
    "beyond the width that fits the gait and moves pegs along the walls.",
    "SnakeSpatial-v0": "The robot in space (chapter 4 of the thesis): joints that bend sideways and up and down, "
    "links that lift, roll and press on the ground with forces of their own. No pegs and isotropic ground, on which a "
    "snake that lies flat does not get ahead. It lies across the way to its goal, and action zero is the sidewinding "
    "of section 7.5.2; phase shift zero with a small amplitude rolls it (7.3.2). With `task` it goes where the planar "
    'robot goes: `gymnasium.make("SnakeSpatial-v0", task="field")` is the field of pegs in space, where action zero is '
    "the flat gait (7.3). A picture shows it from above and, in a strip below, from the side.",
}

ARGUMENTS = {
    "model": 'robot in the plane, "planar", or in space, "spatial"; set by the id',
    "task": 'scene and goal: "course", "field", "free", "perturbed", "maze" or "corridor"; set by the id',
    "action_mode": 'what an action prescribes: "gait", "joints" or "residual"',
    "perception": '"pegs": the robot locates the pegs nearest to its leading link; "body": and, from each link, the '
    'nearest one; "blind": it feels contact forces only',
    "nearest_pegs": "number of pegs located at a time, 1 to 64",
    "control_period": "time between two actions [s], 0.001 to 1",
    "max_episode_steps": "control periods after which an episode is truncated, >= 1",
    "goal_distance": "way from the start of the CG to the goal line or the goal point [m], 0.1 to 20",
    "corridor_half_width": "distance from the centre line at which the corridor ends; with a goal point: by how much "
    "the robot may be farther from it than at the start [m], 0.1 to 5",
    "goal_radius": 'radius of the goal of "maze" and "corridor" [m], 0.01 to 0.9 `goal_distance`',
    "turn": 'largest angle between the start and the goal of "maze", largest bend of "corridor", at difficulty 1 '
    "[rad], 0 to pi/2",
    "difficulty": "irregularity of a random scene, 0 to 1",
    "field": 'generator of the random field: "mixed", "track", "lattice" or "poisson"',
    "push_points": 'scenes of "field" and "maze" are drawn anew, up to 100 times, until every body length of the way '
    "to the goal has so many pegs that can serve as push-points, 0 to 4; 0: as they come. The rule is in docs/tasks.md",
    "perturbation": 'pegs of "perturbed" that are out of place: `course` ("table-7.3", "table-7.5" or "mixed"), '
    "numbers of pegs `removed`, each with the probability `difficulty`, and `shifted` in an episode, drawn from peg 3 "
    "on; the longest `shift` at difficulty 1 [m], 0 to 0.5; pegs always absent, `without` = [j, ...], and always "
    "elsewhere, `moved` = [[j, dx, dy], ...], j from 1 as in the thesis",
    "randomization": "what differs from episode to episode beside the scene: the fields of "
    "`snake_env.Randomization`, with ranges and units at the end of this page",
    "friction": "Coulomb coefficients along and across a link, 0 to 10; null: the task's own, (0.2, 0.5) for "
    '"maze" and for the planar robot on "free", and (0.2, 0.2) otherwise',
    "stribeck": "how friction falls in sliding: `drop`, the share that is lost, 0 to 1, and `speed`, at which half of "
    "that is lost [m/s]; the planar model alone",
    "controller": 'joint controller: "pd", or in the plane "io" (input-output linearising, critically damped with K_D '
    "= 0.5 / T for T a tenth of the control period; both with a limit of 10 N m), or the fields of "
    "`snake_env.PD` or `snake_env.IOLinearizing` with their `law`",
    "integrator": "time stepping: the fields of `snake_env.Integrator`",
    "robot": "the robot: the fields of `snake_env.Robot`",
    "reward_weights": "weights of the reward's terms",
    "start_jitter": "scale of the random start pose and phase, 0 to 1; 0: always the same start",
}

HEADER = """# Environments

This page is generated by `python -m snake_env card --write docs/environments.md`.

Each id has two forms: `gymnasium.make(id)` is a single environment, `gymnasium.make_vec(id, num_envs=n)` the native
batch `snake_env.SnakeVectorEnv`, which is identical to n single environments, bit for bit, and steps them in Rust on
`num_threads` threads. `snake_env.sb3.make(id, num_envs=n)` is the batch as a Stable-Baselines3 `VecEnv`.

A snake robot of 11 links (Aiko, Table 7.1 of the thesis) lies on a horizontal plane with Coulomb friction; it is planar
but in `SnakeSpatial-v0`. It has no wheels: it makes way by pushing its body against pegs, or by sliding more easily
along its links than across them. Link 1 leads. Units are SI and radians.
"""

FOOTER = """## Vector environments

Keywords of the batch beside those above: `num_envs`, `num_threads` (default: the environment variable
`SNAKE_ENV_NUM_THREADS`, else min(cores, ceil(num_envs / 8))), `autoreset_mode`, `render_mode` and `reward_fn`.

| `autoreset_mode` | step in which an episode ends | next step of that robot | for |
| --- | --- | --- | --- |
| `"NextStep"` (default) | last observation | action ignored, reset observation, reward 0 | wrappers, RLlib |
| `"SameStep"` | reset observation; the last one in `infos["final_obs"]` | an ordinary step | SB3, CleanRL |
| `"Disabled"` | last observation | an error, until `reset(options={"reset_mask": mask})` | control by hand |

RLlib reads the first observation of an episode from the step after its end: use `"NextStep"` there, `"SameStep"` would
corrupt its episodes without an error.

`reset(seed=s)` gives robot i the random stream s + i, whatever the number of robots and threads; a reset without seed
goes on to the next episode of each stream. `reset_mask`, a bool array, is the only option of `reset`.

`reward_fn(signals, action, previous_action)` replaces the reward: `signals` holds the arrays of `info` by name.
`get_state(mask)` and `set_state(states, mask)` save and restore robots bit for bit
(with the method "implicit"; "thesis" starts its iteration from zero impulses).

Choose the threads of torch too: `torch.set_num_threads(1)` and the rest for the simulation is a good start.

## Curriculum and randomisation

`set_difficulty(d)` of the single environment (`env.unwrapped`) and `set_difficulty(d, mask)` of the batch set the
difficulty of the episodes that begin from then on, robot by robot; a callback of Stable-Baselines3 calls
`env.env_method("set_difficulty", d)`.

`randomization` draws anew for each robot and episode what the thesis lists as discrepancies (T 7.5.4). All is off by
default; `snake_env.Randomization.thesis()` is a choice of everything at once.

| field | off | range | unit | meaning |
| --- | --- | --- | --- | --- |
| `friction` | (1, 1) | 0 to 10 | 1 | factor on both friction coefficients |
| `anisotropy` | (1, 1) | 0 to 10 | 1 | further factor on the coefficient across a link |
| `mass` | (1, 1) | 0.1 to 10 | 1 | factor on mass and inertia of all links |
| `torque_limit` | (1, 1) | 0.01 to 10 | 1 | factor on the largest torque of a joint |
| `reference_rate` | null | 0.1 to 1 / `control_period` | Hz | how often the joint references take over a new action |
| `reference_delay` | (0, 0) | 0 to 10, at most 100 periods | s | time from an action to its effect, in whole periods |
| `noise` | zeros | >= 0 | | amplitudes of uniform noise on the observation, drawn each step (Table 7.4) |
| `peg_error` | 0 | 0 to 1 | m | largest error of a located peg's position, the same for an episode |
| `free_play` | (0, 0) | 0 to pi/2 | rad | free play of the joints, beyond the robot's own |
| `stribeck` | (0, 0) | 0 to 1 | 1 | share of friction that is lost in sliding, beyond the ground's own |

The start pose is randomised by `start_jitter`.
Factors on the robot, free play and the Stribeck effect need the planar model and the integrator's method "implicit" or
"adaptive", free play also a PD controller. `joint_angle` is the joint's, not the motor's.

## Version history

- v0: first release of all ids. `SnakePerturbed-v0`, `SnakeMaze-v0`, `SnakeCorridor-v0` and `SnakeSpatial-v0` came
  later; the others did not change by it.
"""


def page() -> str:
    """The page as Markdown."""
    return "\n".join([HEADER, *(_environment(env_id, options) for env_id, options in TASKS.items()), FOOTER])


def _environment(env_id: str, options: dict[str, str]) -> str:
    layout = Task(options, MAX_EPISODE_STEPS).layout
    config = json.loads(layout["config"])
    return "\n".join(
        [
            f"## {env_id}\n",
            DESCRIPTIONS[env_id] + "\n",
            _spaces(layout),
            _actions(config),
            _observation(layout),
            _rewards(layout),
            _episode(config),
            _info(layout),
            _arguments(config),
        ]
    )


def _spaces(layout: dict[str, Any]) -> str:
    size = sum(block["size"] for block in layout["observation"])
    rows = [
        ("action space", f"`Box(-1, 1, ({len(layout['action'])},), float32)`"),
        ("observation space", f"`Box` ({size},) float32, bounds below"),
        ("made by", "`gymnasium.make`, `gymnasium.make_vec`, `snake_env.sb3.make`"),
    ]
    return _table(("", ""), rows)


def _actions(config: dict[str, Any]) -> str:
    """One table for each action mode."""
    parts = ["### Actions\n"]
    parts.append(
        "An action in [-1, 1] maps linearly to the interval [min, max]; values beyond are clipped. The references of "
        "the joints follow it smoothly and no faster than the slew limit, and a joint controller with a torque limit "
        "follows the references.\n"
    )
    for mode in ("gait", "joints", "residual"):
        layout = Task({"model": config["model"], "task": config["task"], "action_mode": mode}, None).layout
        default = " (default)" if mode == config["action_mode"] else ""
        rows: list[tuple[Any, ...]] = [
            (k, e["name"], _number(e["low"]), _number(e["high"]), _number(e["slew"]), e["unit"], e["meaning"])
            for k, e in enumerate(layout["action"])
        ]
        parts.append(f'`action_mode="{mode}"`{default}\n')
        parts.append(_table(("num", "action", "min", "max", "slew limit [unit/s]", "unit", "meaning"), rows))
    return "\n".join(parts)


def _observation(layout: dict[str, Any]) -> str:
    parts = [
        "### Observations\n",
        "Each element is its value divided by the scale and clipped to [min, max]; running normalisation is not "
        "needed.\n",
    ]
    rows: list[tuple[Any, ...]] = []
    for block in layout["observation"]:
        for k, element in enumerate(block["elements"]):
            name = block["name"] if block["name"] == element else f"{block['name']}: {element}"
            bounds = _number(block["low"]), _number(block["high"])
            rows.append((block["start"] + k, name, *bounds, _number(block["scale"]), block["unit"]))
    parts.append(_table(("num", "observation", "min", "max", "scale", "unit"), rows))
    rows = [(block["name"], block["size"], block["description"]) for block in layout["observation"]]
    parts.append(_table(("block", "size", "meaning"), rows))
    parts.append(
        "Excluded: the absolute position, since the task is the same everywhere along the corridor, and with "
        '`perception="blind"` the pegs. With `perception="body"` a block `link_pegs` is added, three elements a link: '
        "the nearest peg from each link's CG, likewise, within a quarter of the robot's length.\n"
    )
    return "\n".join(parts)


def _rewards(layout: dict[str, Any]) -> str:
    rows = [(term["name"], term["weight"], term["description"], term["unit"]) for term in layout["reward"]]
    text = "The sum of these terms times their `reward_weights`; each weighted term is in `info` as `reward_<term>`.\n"
    return "\n".join(["### Rewards\n", text, _table(("term", "weight", "value", "unit"), rows)])


def _episode(config: dict[str, Any]) -> str:
    goal, half_width = _number(config["goal_distance"]), _number(config["corridor_half_width"])
    steps, period = config["max_episode_steps"], config["control_period"]
    if config["task"] in ("maze", "corridor"):
        radius = _number(config["goal_radius"])
        success = f"the CG is within {radius} m of the goal point, {goal} m of way from its start"
        failure = f"it is {half_width} m farther from the goal point than it was at the start"
    else:
        success = f"the CG has moved {goal} m along x"
        failure = f"it is more than {half_width} m from the corridor's centre line"
    return (
        "### Start, termination, truncation\n\n"
        "The robot starts at rest in the posture of the gait, ready to move to +x, at a random phase and with a small "
        "random displacement, both scaled by `start_jitter`.\n\n"
        f"The episode terminates when {success} (`is_success`), when {failure} (`left_corridor`), and when the "
        f"computation of this robot diverged (`diverged`). It is truncated after {steps} steps, "
        f"{_number(steps * period)} s.\n"
    )


def _info(layout: dict[str, Any]) -> str:
    rows = [(f"`{s['name']}`", s["kind"], s["unit"], s["description"]) for s in layout["signals"]]
    return "\n".join(
        [
            "### Info\n",
            "The same keys after `reset` and `step`.\n",
            _table(("key", "type", "unit", "meaning"), rows),
        ]
    )


def _arguments(config: dict[str, Any]) -> str:
    rows = [(f"`{name}`", f"`{json.dumps(config[name])}`", meaning) for name, meaning in ARGUMENTS.items()]
    return "\n".join(["### Arguments\n", _table(("keyword", "default", "meaning and range"), rows)])


def _table(head: Iterable[str], rows: Iterable[Iterable[Any]]) -> str:
    return table(head, rows) + "\n"


def _number(value: float) -> str:
    return f"{round(value, 12) + 0.0:.4g}"


def main(argv: list[str]) -> int:
    """Prints the page, or writes it to a file."""
    parser = argparse.ArgumentParser(prog="python -m snake_env card", description=__doc__)
    parser.add_argument("--write", type=Path, metavar="FILE", help="write the page to FILE instead of printing it")
    options = parser.parse_args(argv)
    if options.write is None:
        print(page(), end="")
    else:
        options.write.parent.mkdir(parents=True, exist_ok=True)
        options.write.write_text(page(), encoding="utf-8")
    return 0
