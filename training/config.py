"""What a training run is made from: a YAML or JSON file over defaults."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym

from snake_env import ConfigError
from snake_env.registration import OWN_ID
from snake_env.vector_env import refuse_others
from training import seeds

ROOT = Path(__file__).parents[1]
CONFIGS = ROOT / "training" / "configs"


class Range(NamedTuple):
    """What a value may be, and how that is said."""

    said: str
    admits: Callable[[Any], bool]


def _whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _real(value: Any) -> bool:
    return (_whole(value) or isinstance(value, float)) and math.isfinite(value)


def _all(admissible: Range, values: Any) -> bool:
    return isinstance(values, (list, tuple)) and all(map(admissible.admits, values))


_COUNT = Range("an integer >= 1", lambda value: _whole(value) and value >= 1)
_FROM_ZERO = Range("an integer >= 0", lambda value: _whole(value) and value >= 0)
_NUMBER = Range("a number", _real)
_POSITIVE = Range("a number > 0", lambda value: _real(value) and value > 0.0)
_NOT_NEGATIVE = Range("a number >= 0", lambda value: _real(value) and value >= 0.0)
_SHARE = Range("a number in [0, 1]", lambda value: _real(value) and 0.0 <= value <= 1.0)
_SWITCH = Range("true or false", lambda value: isinstance(value, bool))
_TEXT = Range("text", lambda value: isinstance(value, str))


@dataclass(frozen=True)
class Policy:
    """The two networks (actor and critic alike) and the noise that explores.

    Args:
        hidden: units of each hidden layer.
        log_std: logarithm of the standard deviation of the action noise at the start.
        mirror: the networks treat left and right alike; the lean learner and evolution only.
        traces: time constants [s] of running means of what was felt, which the networks see too; the lean learner only.
        bfloat16: hidden layers learn in half precision, faster where the processor has it; the lean learner only.
    """

    hidden: tuple[int, ...] = (64, 64)
    log_std: float = -1.0
    mirror: bool = False
    traces: tuple[float, ...] = ()
    bfloat16: bool = False

    def __post_init__(self) -> None:
        _require(_all(_COUNT, self.hidden), "policy.hidden", self.hidden, "integers >= 1")
        _require(_all(_POSITIVE, self.traces), "policy.traces", self.traces, "times > 0")
        _check(self, "policy.", _NUMBER, "log_std")
        _check(self, "policy.", _SWITCH, "mirror", "bfloat16")


@dataclass(frozen=True)
class Ppo:
    """Proximal policy optimisation; names as in Stable-Baselines3.

    Args:
        n_steps: steps of each robot between two updates.
        batch_size: samples of a gradient step.
        n_epochs: passes over the samples.
        learning_rate: at the start; falls linearly with the share of the budget that is used.
        final_learning_rate: share of the learning rate at the end.
        gamma: discount of a control period.
        gae_lambda: trade-off of bias and variance in the advantage.
        clip_range: largest relative change of an action's probability that is rewarded.
        ent_coef: weight of the entropy bonus.
        vf_coef: weight of the critic's error.
        max_grad_norm: gradients are shortened to this norm.
        target_kl: an update stops early when the policy has moved by this much; None: never.
    """

    n_steps: int = 128
    batch_size: int = 2048
    n_epochs: int = 6
    learning_rate: float = 5e-4
    final_learning_rate: float = 0.1
    gamma: float = 0.99
    gae_lambda: float = 0.95
    clip_range: float = 0.2
    ent_coef: float = 0.0
    vf_coef: float = 0.5
    max_grad_norm: float = 0.5
    target_kl: float | None = None

    def __post_init__(self) -> None:
        _check(self, "ppo.", _COUNT, "n_steps", "batch_size", "n_epochs")
        _check(self, "ppo.", _POSITIVE, "learning_rate", "clip_range", "max_grad_norm")
        _check(self, "ppo.", _SHARE, "final_learning_rate", "gamma", "gae_lambda")
        _check(self, "ppo.", _NOT_NEGATIVE, "ent_coef", "vf_coef")
        if self.target_kl is not None:
            _check(self, "ppo.", _POSITIVE, "target_kl")


@dataclass(frozen=True)
class Evolution:
    """Evolution strategies; weights count in units of one over the root of a layer's inputs.

    Args:
        fields: fields on which each candidate plays an episode, >= 1; all candidates of a generation on the same.
        spread: standard deviation of the candidates around their mean, > 0.
        learning_rate: step of Adam at the start; falls linearly with the share of the budget that is used.
        final_learning_rate: share of the learning rate at the end.
        senses: blocks of the observation, or single elements as in "wave: sin_phase", that are the networks' inputs;
            None: all.
    """

    fields: int = 4
    spread: float = 0.2
    learning_rate: float = 0.03
    final_learning_rate: float = 0.3
    senses: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        _check(self, "evolution.", _COUNT, "fields")
        _check(self, "evolution.", _POSITIVE, "spread", "learning_rate")
        _check(self, "evolution.", _SHARE, "final_learning_rate")
        _require(self.senses is None or _all(_TEXT, self.senses), "evolution.senses", self.senses, "names, or none")


@dataclass(frozen=True)
class Clone:
    """What to begin as: a scripted controller, or a policy trained before.

    Args:
        controller: name of a scripted controller.
        task: task of the benchmark whose tuned numbers it has.
        policy: in their place, a file with a policy of the same hidden layers.
        rounds: rollouts on which the actor learns the controller's actions.
        critic_rounds: rollouts on which the critic alone learns, after that.
        epochs: passes over the samples in each round.
    """

    controller: str | None = None
    task: str | None = None
    policy: str | None = None
    rounds: int = 12
    critic_rounds: int = 12
    epochs: int = 4

    def __post_init__(self) -> None:
        given = (self.controller, self.task, self.policy)
        _require(
            [value is None for value in given] in ([False, False, True], [True, True, False]),
            "clone",
            given,
            "controller and task, or a policy",
        )
        _check(self, "clone.", _COUNT, "epochs")
        _check(self, "clone.", _FROM_ZERO, "rounds", "critic_rounds")


@dataclass(frozen=True)
class Config:
    """A training run.

    Args:
        about: what it is for; changes nothing.
        env_id: environment.
        env: keywords of the environment.
        num_envs: robots in the batch.
        num_threads: threads of the simulator.
        torch_threads: threads of the learner; it waits while the simulator runs, and the other way round.
        seed: of networks, noise and fields, >= 0.
        total_steps: environment steps to take, summed over the robots.
        max_minutes: wall time of training after which it ends all the same; None: no limit.
        checkpoint_seconds: wall time between checkpoints; zero: one after every update.
        curriculum: share of the budget over which the difficulty grows from zero to that of ``env``, in [0, 1];
            zero: no curriculum.
        clone: what the policy begins as; None: random weights.
        policy: networks.
        ppo: learner.
        evolution: the learner without gradients, which asks for it; the others refuse it.
    """

    about: str = ""
    env_id: str = "SnakeField-v0"
    env: dict[str, Any] = field(default_factory=dict)
    num_envs: int = 64
    num_threads: int = 2
    torch_threads: int = 1
    seed: int = 0
    total_steps: int = 10_000_000
    max_minutes: float | None = None
    checkpoint_seconds: float = 30.0
    curriculum: float = 0.0
    clone: Clone | None = None
    policy: Policy = field(default_factory=Policy)
    ppo: Ppo = field(default_factory=Ppo)
    evolution: Evolution | None = None

    def __post_init__(self) -> None:
        _require_environment(self.env_id)
        _require(isinstance(self.env, dict), "env", self.env, _MAPPING)
        _check(self, "", _COUNT, "num_envs", "num_threads", "torch_threads", "total_steps")
        _check(self, "", _NOT_NEGATIVE, "checkpoint_seconds")
        _check(self, "", _SHARE, "curriculum")
        limit = self.max_minutes
        _require(limit is None or _POSITIVE.admits(limit), "max_minutes", limit, "a number > 0, or none")
        _require(self.seed in seeds.TRAINING, "seed", self.seed, f"an integer in [0, {seeds.TRAINING.stop})")

    def difficulty(self, used: float, hardest: float) -> float:
        """Difficulty of the episodes that begin when the share ``used`` of the budget is used up.

        Args:
            used: in [0, 1].
            hardest: the environment's difficulty.
        """
        return hardest * min(1.0, used / self.curriculum) if self.curriculum else hardest

    def refuse(self, learner: str, *names: str) -> None:
        """Refuses what a learner does not have.

        Args:
            learner: its name.
            names: options it has not, dotted as in ``policy.mirror``.

        Raises:
            ConfigError: one of them is not at its default.
        """
        for name in names:
            value, default = attrgetter(name)(self), attrgetter(name)(type(self)())
            _require(value == default, name, value, f"{default}, {learner} has nothing else")

    def refuse_evolution(self, learner: str) -> None:
        """Refuses, for another learner, to begin with a configuration that is for evolution.

        Runs that began before this was asked noted a section whatever their learner was; they may go on.

        Args:
            learner: its name.

        Raises:
            ConfigError: there is a section ``evolution``.
        """
        expected = f"none: this configuration is for training.evolution, not for {learner}"
        _require(self.evolution is None, "evolution", self.evolution, expected)

    @classmethod
    def from_mapping(cls, values: dict[str, Any]) -> Config:
        """The configuration with ``values`` over the defaults; unknown names are errors."""
        values = dict(values)
        if "policy" in values:
            values["policy"] = _section(Policy, "policy", values["policy"], "hidden", "traces")
        if values.get("clone") is not None:
            values["clone"] = _section(Clone, "clone", values["clone"])
        if "ppo" in values:
            values["ppo"] = _section(Ppo, "ppo", values["ppo"])
        if values.get("evolution") is not None:
            values["evolution"] = _section(Evolution, "evolution", values["evolution"], "senses")
        return _section(cls, "config", values)

    def to_mapping(self) -> dict[str, Any]:
        """Plain lists, mappings and numbers, for a file."""
        values = dataclasses.asdict(self)
        values["policy"] |= {"hidden": list(self.policy.hidden), "traces": list(self.policy.traces)}
        if self.evolution is not None and self.evolution.senses is not None:
            values["evolution"]["senses"] = list(self.evolution.senses)
        return values


def load(path: Path) -> Config:
    """Reads a YAML or JSON file; a bare name is one of ``training/configs``. JSON needs no further package.

    Raises:
        ConfigError: there is no such file or name, it cannot be read, or a value in it is not admissible.
    """
    bare = [CONFIGS / f"{path}{suffix}" for suffix in (".yaml", ".json")]
    found = next((one for one in bare if one.exists()), path)
    _require(found.is_file(), "config", path, "a YAML or JSON file, or a name in training/configs")
    values = _from_json(found) if found.suffix == ".json" else _from_yaml(found)
    _require(isinstance(values, dict), "config", found, _MAPPING)
    return Config.from_mapping(values)


def _from_json(path: Path) -> Any:
    try:
        return json.loads(path.read_text())
    except ValueError as error:
        raise ConfigError("config", path, f"JSON ({error})") from None


def _from_yaml(path: Path) -> Any:
    import yaml

    try:
        values = yaml.safe_load(path.read_text())
    except (ValueError, yaml.YAMLError) as error:
        raise ConfigError("config", path, f"YAML ({' '.join(str(error).split())})") from None
    return {} if values is None else values


def save(config: Config, path: Path) -> None:
    """Writes a JSON file that :func:`load` reads."""
    path.write_text(json.dumps(config.to_mapping(), indent=2) + "\n")


_MAPPING = "a mapping of names to values"


def _section(kind: type, name: str, values: Any, *lists: str) -> Any:
    """A section from its mapping; the lists in it that ``lists`` names become tuples."""
    _require(isinstance(values, dict), name, values, _MAPPING)
    known = [f.name for f in dataclasses.fields(kind)]
    for key in values:
        _require(key in known, f"{name}.{key}", values[key], "one of " + ", ".join(known))
    return kind(**values | {key: tuple(values[key]) for key in lists if isinstance(values.get(key), list)})


def _require_environment(env_id: Any) -> None:
    """An id of this package, or one that a module has still to register, as in "module:id"."""
    _require(isinstance(env_id, str) and (":" in env_id or env_id in gym.registry), "env_id", env_id, OWN_ID)
    refuse_others(env_id)


def _check(section: object, prefix: str, admissible: Range, *names: str) -> None:
    for name in names:
        value = getattr(section, name)
        _require(admissible.admits(value), prefix + name, value, admissible.said)


def _require(ok: bool, name: str, value: object, expected: str) -> None:
    if not ok:
        raise ConfigError(name, value, expected)
