"""The benchmark's protocol for any policy: test scenes, scores, intervals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from snake_env._checks import integer
from snake_env._extras import extras
from snake_env.errors import ConfigError
from snake_env.evaluation import seeds, tasks, tracks
from snake_env.evaluation.rollout import Episodes, layout_of, run_episodes
from snake_env.evaluation.scores import Row, against, latex, score, table
from snake_env.evaluation.tasks import BenchmarkTask

EPISODES = 500
"""Test scenes of the benchmark."""


@dataclass(frozen=True)
class Evaluation:
    """How a policy scores; ``print`` shows the table.

    Attributes:
        name: of the policy.
        task: where it was played.
        track: the narrowest one that admits what it observed, see ``snake_env.evaluation.tracks``; None: no track does.
        scores: by name, as "success" and "speed"; each has ``value``, and ``low`` and ``high`` of its 95 % bootstrap
            interval over scenes.
        episodes: the last ``info`` of every episode, (n,) arrays by name, and ``return``.
    """

    name: str
    task: BenchmarkTask
    track: str | None
    scores: Row
    episodes: Episodes

    def against(self, other: Evaluation) -> Row:
        """Differences in success, progress [m] and speed [m/s] to another policy, scene by scene, with their intervals.

        Raises:
            ConfigError: the two were played elsewhere, or on other numbers of scenes.
        """
        if self.task != other.task or len(self.episodes["time"]) != len(other.episodes["time"]):
            mine, its = (f"{one.task.name} on {len(one.episodes['time'])} scenes" for one in (self, other))
            raise ConfigError("other", its, f"an evaluation of {mine}")
        return against(self.episodes, other.episodes)

    def to_latex(self, *others: Evaluation) -> str:
        """The scores, and those of other evaluations beside them, as a table of LaTeX (package ``booktabs``).

        Evaluations of the same name are numbered in their order; ``evaluate(name=...)`` gives others.
        """
        rows: dict[str, Row] = {}
        names = [one.name for one in (self, *others)]
        for k, one in enumerate((self, *others)):
            number = f" ({names[: k + 1].count(one.name)})" if names.count(one.name) > 1 else ""
            rows[one.name + number] = one.scores
        return latex(rows)

    def to_dataframe(self) -> Any:
        """One row per episode: what :attr:`episodes` holds; needs the extra ``data``."""
        with extras():
            import pandas

        return pandas.DataFrame({name: list(values) for name, values in self.episodes.items()})

    def __str__(self) -> str:
        return table({self.name: self.scores})


def evaluate(
    policy: Any,
    task: Any = None,
    *,
    episodes: int = EPISODES,
    seed: int = 0,
    name: str | None = None,
    env_options: Mapping[str, Any] | None = None,
    normalize: Any = None,
    trust: bool = False,
    num_threads: int | None = None,
    precision: str | None = None,
    robot_class: str | None = None,
    track: str | None = None,
    scenes: int | None = None,
) -> Evaluation:
    """Plays a policy on test scenes, which neither training nor selection may use, one episode on each.

    Args:
        policy: a name, file or object, as :func:`snake_env.load_policy` takes them. Among them are a model of
            Stable-Baselines3 and a function of observations (n, o) that returns actions (n, a).
        task: name of a task of the benchmark, id of an environment, an environment made with this package, or a
            :class:`BenchmarkTask`. None: where the policy was trained, or "field-hard" if that is unknown.
        episodes: number of test scenes, >= 1; the same ones for every policy.
        seed: number of the first test scene, from 0; episode k is on scene ``seed + k``.
        name: of the policy in the table; None: its own.
        env_options: what a function needs of the environment, see :func:`snake_env.load_policy`. Everything else
            belongs to the task.
        normalize: file of a ``VecNormalize``, see :func:`snake_env.load_policy`.
        trust: the policy's file may run code, see :func:`snake_env.load_policy`.
        num_threads: threads of the simulator; None: the environment's choice.
        precision: "fast", "default" or "fine": how accurate the time stepping is; None: the task's, or else that in
            which the class of robot is judged.
        robot_class: "ideal" or "aiko"; None: the task's.
        track: "proprioception", "touch", "range" or "map": what the policy may observe; None: anything.
        scenes: earlier name of ``episodes``.

    Raises:
        ConfigError: the policy, the task, an option or the number of episodes is not admissible, or the policy observes
            what the track does not admit.
    """
    given, value = ("episodes", episodes) if scenes is None else ("scenes", scenes)
    count = integer(given, value, 1, len(seeds.HELD_OUT))
    given_options = {"precision": precision, "robot_class": robot_class}
    options = {name: value for name, value in given_options.items() if value is not None}
    how = {"env_options": env_options, "normalize": normalize, "trust": trust}
    player, played_in = tasks.acting_in(policy, task, "field-hard", options, **how)
    played_in = tasks.judged(played_in)
    seen = tracks.observed(layout_of(played_in.env_id, played_in.options | player.env_options))
    if track is not None:
        tracks.require(track, seen)
    found = run_episodes(player, played_in.env_id, seeds.held_out(count, seed), num_threads, **played_in.options)
    return Evaluation(name or player.name, played_in, tracks.narrowest(seen), score(found), found)
