"""One reference page per environment id, generated like the common page, of which :mod:`snake_env.card` makes the rows.

``snake-env card --write docs/environments.md`` writes them into the folder ``docs/environments/``.
"""

from __future__ import annotations

import json
from typing import Any, NamedTuple

from snake_env import card
from snake_env.markdown import table
from snake_env.policies.loading import load_policy
from snake_env.policies.policy_card import PolicyCard
from snake_env.policies.shipped import NAMES
from snake_env.registration import DESCRIPTIONS, TASKS
from snake_env.vector_env import SnakeVectorEnv


class Film(NamedTuple):
    """The episode on top of a page: who acts, with which keywords, on which test scene.

    ``policy`` is a shipped policy, a scripted controller or ``"action zero"``.
    """

    policy: str
    scene: int
    options: dict[str, Any]


FILMS = {
    "SnakeCourse-v1": Film("general", 0, {}),
    "SnakeField-v1": Film("general", 0, {"difficulty": 1.0}),
    "SnakeFree-v1": Film("action zero", 0, {}),
    "SnakePerturbed-v1": Film("general", 0, {"difficulty": 1.0}),
    "SnakeMaze-v1": Film("general", 0, {"difficulty": 1.0}),
    "SnakeCorridor-v1": Film("general", 0, {"difficulty": 1.0}),
    "SnakeCommand-v1": Film("heading control", 0, {}),
    "SnakeTerrain-v1": Film("action zero", 0, {"terrain": "ramps", "difficulty": 1.0}),
    "SnakePipe-v1": Film("action zero", 0, {}),
    "SnakeClimb-v1": Film("action zero", 0, {}),
    "SnakeClutter-v1": Film("heading control", 0, {}),
    "SnakeSpatial-v1": Film("spatial", 0, {}),
}
"""By id; ``make pictures`` draws them."""

KEYWORDS = {
    "course": ("goal_distance", "corridor_half_width"),
    "field": ("difficulty", "field", "push_points", "goal_distance", "corridor_half_width"),
    "free": ("friction", "goal_distance", "corridor_half_width"),
    "perturbed": ("difficulty", "perturbation", "goal_distance", "corridor_half_width"),
    "maze": ("difficulty", "turn", "push_points", "goal_distance", "goal_radius"),
    "corridor": ("difficulty", "turn", "goal_distance", "goal_radius"),
    "command": ("difficulty", "turn", "speed"),
    "terrain": ("difficulty", "terrain", "goal_distance", "corridor_half_width"),
    "pipe": ("difficulty", "goal_distance"),
    "climb": ("difficulty", "goal_distance", "controller"),
    "clutter": ("difficulty", "goal_distance", "corridor_half_width"),
}
"""Keywords that shape a task, by its name; all others are those of every environment."""


def pages() -> dict[str, str]:
    """The pages as Markdown, by file name."""
    return {f"{card.page_name(env_id)}.md": page(env_id) for env_id in TASKS}


def page(env_id: str) -> str:
    """The page of one id."""
    layout = card.layout_of(**TASKS[env_id])
    parts = [
        f"# {env_id}",
        DESCRIPTIONS[env_id],
        "```python\nimport gymnasium\n\n"
        f'envs = gymnasium.make_vec("snake_env:{env_id}", num_envs=256)\n'
        "obs, info = envs.reset(seed=0)\n```",
        f"![an episode](../images/env-{card.page_name(env_id)}.gif)",
        f"*{_caption(env_id)}.*",
        _facts(env_id, layout),
        *_policies(env_id),
    ]
    return "\n\n".join(part.strip() for part in parts if part) + "\n"


def _caption(env_id: str) -> str:
    film = FILMS[env_id]
    actors = {
        "action zero": "Action zero, the default gait,",
        "heading control": "A scripted controller, heading control,",
    }
    actor = actors.get(film.policy, f"The shipped policy `{film.policy}`")
    chosen = "".join(f", `{name}={json.dumps(value)}`" for name, value in film.options.items())
    forces = "; arrows: forces of the pegs" if TASKS[env_id]["task"] in card.peg_tasks() else ""
    return f"{actor} on test scene {film.scene}{chosen}{forces}"


def _facts(env_id: str, layout: dict[str, Any]) -> str:
    config = layout["config"]
    size = sum(block["size"] for block in layout["observation"])
    along, across = _friction(env_id)
    ground = f"friction {along:g} along the links, {across:g} across" if along != across else f"friction {along:g}"
    model = "planar, chapter 3 of the thesis" if config["model"] == "planar" else "3D, chapter 4 of the thesis"
    entries = ", ".join(row[0] for row in card.grouped((entry["name"],) for entry in layout["action"]))
    blocks = ", ".join(block["name"] for block in layout["observation"])
    keywords = (f"`{name}` {card.default(config[name])}" for name in KEYWORDS[config["task"]])
    return table(
        ("property", "value"),
        [
            ("robot", f"{config['robot']['links']} links, {model}"),
            ("ground", ground),
            ("[action](../environments.md#actions)", f"`Box(-1, 1, ({len(layout['action'])},), float32)`: {entries}"),
            ("[observation](../environments.md#observations)", f"`Box({size},)` of float32: {blocks}"),
            *_end(config),
            ("[keywords](../environments.md#arguments) of this task", ", ".join(keywords)),
        ],
    )


def _friction(env_id: str) -> tuple[float, float]:
    """Of the ground, which the task chooses."""
    options: Any = TASKS[env_id]
    envs = SnakeVectorEnv(1, **options)
    along, across = envs.scene(0).friction
    envs.close()
    return along, across


def _end(config: dict[str, Any]) -> list[tuple[str, str]]:
    kind = card.GOALS[config["task"]]
    reached, strayed = card.goal_rows(config)[kind]
    rewards = "[reward](../environments.md#rewards)"
    if kind == "direction":
        return [("end", "by the time limit"), (rewards, "`tracking` of the command")]
    return [
        ("`is_success`", reached),
        ("`left_corridor`", strayed),
        (rewards, "progress, less energy and abrupt actions; a bonus at the goal"),
    ]


def _policies(env_id: str) -> list[str]:
    """Scores of the shipped policies that were trained in this environment."""
    cards = [load_policy(name).card for name in NAMES]
    own = [one for one in cards if one.env_id == env_id]
    if not own:
        return []
    rows = [_policy_row(one) for one in own]
    return [
        "## Shipped policies",
        table(("policy", "success", "speed [m/s]"), rows)
        + "\n\n95 % intervals over test scenes; `snake-env card NAME` prints keywords and more scores. "
        "All policies: [results](../results.md).",
    ]


def _policy_row(one: PolicyCard) -> tuple[str, ...]:
    return (f"`{one.name}`", *(_estimate(one, name) for name in ("success", "speed")))


def _estimate(one: PolicyCard, name: str) -> str:
    value, low, high = one.scores.get(name, (None, None, None))
    return "-" if value is None else f"{value:.3f} [{low:.3f}, {high:.3f}]"
