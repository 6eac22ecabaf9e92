"""Configuration of a training run: one class per learner, read from a YAML or JSON file over defaults."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, TypeVar, get_type_hints

import gymnasium as gym
import tyro
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, field_validator, model_validator

from snake_env import ConfigError, _documents
from snake_env._files import write_text
from snake_env.evaluation import seeds
from snake_env.evaluation import tasks as benchmark_tasks
from snake_env.registration import OWN_ID
from snake_env.vector_env import refuse_others
from training import config_file

ROOT = Path(__file__).parents[1]

Count = Annotated[int, Field(ge=1)]
"""Number of things of which there is at least one."""
Seed = Annotated[int, Field(ge=0, lt=seeds.TRAINING.stop)]
Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


def _json_object(words: list[str]) -> dict[str, Any]:
    value = _documents.of_json(words[0])
    if not isinstance(value, dict):
        raise ValueError(f"{words[0]!r}: expected a JSON object")
    return value


JsonObject = Annotated[
    dict[str, Any],
    tyro.constructors.PrimitiveConstructorSpec(
        nargs=1,
        metavar="JSON",
        instance_from_str=_json_object,
        is_instance=lambda value: isinstance(value, dict),
        str_from_instance=lambda value: [json.dumps(value)],
    ),
]
"""A mapping, on the command line one JSON object."""

Self = TypeVar("Self", bound="Section")


class Section(BaseModel):
    """Options that are checked when they are set and never change after that."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

    def with_changes(self: Self, **changes: Any) -> Self:
        """A copy with other values, which are checked too.

        Raises:
            ConfigError: names the field, its value and what is admissible.
        """
        with checked(type(self)):
            return type(self)(**{name: getattr(self, name) for name in type(self).model_fields} | changes)


class Networks(Section):
    """Actor and critic, two networks with equal hidden layers, and the noise that explores.

    Args:
        hidden: Units of each hidden layer.
        log_std: Logarithm of the standard deviation of the action noise at the start.
    """

    hidden: tuple[Count, ...] = (64, 64)
    log_std: float = -1.0


class PpoNetworks(Networks):
    """Actor and critic of the learner ``ppo``.

    Args:
        symmetric: Both networks treat left and right alike.
        memory: Time constants [s] of running means of the observation, which are inputs too.
        bfloat16: Hidden layers compute in bfloat16, faster where the processor supports it.
        senses: Blocks of the observation that the actor sees; critic and teachers see all. None: the actor too.
    """

    symmetric: bool = False
    memory: tuple[Positive, ...] = ()
    bfloat16: bool = False
    senses: tuple[str, ...] = ()


class EvolutionNetworks(Section):
    """The actor of the learner ``evolution``.

    Args:
        hidden: Units of each hidden layer; none: actions are linear in the inputs of the network.
        symmetric: The network treats left and right alike.
    """

    hidden: tuple[Count, ...] = ()
    symmetric: bool = False


class Ppo(Section):
    """Proximal policy optimisation; names as in Stable-Baselines3.

    Args:
        n_steps: Steps of each robot between two updates.
        batch_size: Samples per gradient step.
        n_epochs: Passes over the samples.
        learning_rate: At the start; falls linearly with the share of the steps that are taken.
        final_learning_rate: Share of the learning rate that is left at the end.
        gamma: Discount per control period.
        gae_lambda: Trade-off of bias and variance in the advantage.
        clip_range: Largest relative change of an action's probability that is rewarded.
        ent_coef: Weight of the entropy bonus.
        vf_coef: Weight of the critic's error.
        max_grad_norm: Gradients are shortened to this norm.
        target_kl: An update stops early when the policy has moved by this much; None: never.
    """

    n_steps: Count = 128
    batch_size: Count = 2048
    n_epochs: Count = 6
    learning_rate: Positive = 5e-4
    final_learning_rate: Share = 0.1
    gamma: Share = 0.99
    gae_lambda: Share = 0.95
    clip_range: Positive = 0.2
    ent_coef: NotNegative = 0.0
    vf_coef: NotNegative = 0.5
    max_grad_norm: Positive = 0.5
    target_kl: Positive | None = None


class Evolution(Section):
    """Evolution by CMA-ES; weights count in units of one over the root of a layer's inputs.

    Args:
        fields: Fields on which each candidate plays an episode; all candidates of a generation on the same.
        spread: Standard deviation of the candidates around their mean at the start.
        inputs: Blocks of the observation, or single elements as in "wave: sin_phase", that are inputs; None: all.
    """

    fields: Count = 4
    spread: Positive = 0.2
    inputs: tuple[str, ...] | None = None


class BehaviourCloning(Section):
    """What the agent imitates before its first update: a scripted controller, or a policy trained before.

    Args:
        controller: Name of a scripted controller.
        task: Task of the benchmark for which the controller was tuned.
        policy: Instead of both, a file with a policy of the same hidden layers.
        run: Instead of these, a configuration of the same hidden layers, which is trained first, with the same seed.
        teachers: For each task of the run the policy that it imitates there: a shipped one or a file; with ``policy``
            or ``run``, after the weights of that are taken over.
        rounds: Rollouts on which the actor learns the actions of the controller, or of the teachers.
        critic_rounds: Rollouts on which only the critic learns, after that.
        epochs: Passes over the samples in each round.
    """

    controller: str | None = None
    task: str | None = None
    policy: str | None = None
    run: str | None = None
    teachers: dict[str, str] = {}
    rounds: Annotated[int, Field(ge=0)] = 12
    critic_rounds: Annotated[int, Field(ge=0)] = 12
    epochs: Count = 4

    @model_validator(mode="after")
    def _one_source(self) -> BehaviourCloning:
        given = [name for name in ("controller", "task", "policy", "run", "teachers") if getattr(self, name)]
        weights = given[:-1] if given[-1:] == ["teachers"] else given
        if given not in (["controller", "task"], ["teachers"]) and weights not in (["policy"], ["run"]):
            expected = "controller and task, a policy, a run, or teachers with or without a policy or a run"
            raise ConfigError("behaviour_cloning", " and ".join(given) or "nothing", expected)
        return self


class RunConfig(Section):
    """What the configurations of all learners have.

    Args:
        about: What the run is for; has no effect.
        env_id: Environment.
        env: Keywords of the environment; on the command line those that change, null for one that is left out.
        num_envs: Robots in the batch.
        num_threads: Threads of the simulator.
        torch_threads: Threads of the learner, which is idle while the simulator runs, and vice versa.
        seed: Of networks, noise and fields.
        total_steps: Environment steps after which training ends, summed over the robots; schedules follow them.
        checkpoint_steps: Environment steps between checkpoints; zero: one after every update.
        evaluations: How many times in a run the policy plays on validation fields, without exploration; the best of
            these policies is kept. Zero: never.
        evaluation_fields: Validation fields of each task that it plays on.
        track: Where losses, scores and rates go beside the learning curve.
    """

    learner: str
    about: str = ""
    env_id: str = "SnakeField-v1"
    env: JsonObject = {}
    num_envs: Count = 64
    num_threads: Count = 2
    torch_threads: Count = 1
    seed: Seed = 0
    total_steps: Count = 10_000_000
    checkpoint_steps: Annotated[int, Field(ge=0)] = 500_000
    evaluations: Annotated[int, Field(ge=0)] = 10
    evaluation_fields: Count = 50
    track: Literal["tensorboard", "none"] = "tensorboard"

    ADJUSTABLE: ClassVar = (
        "total_steps",
        "num_threads",
        "torch_threads",
        "checkpoint_steps",
        "evaluations",
        "evaluation_fields",
        "track",
    )
    """Fields that may change when a run is resumed."""

    @property
    def evaluation_interval(self) -> int | None:
        """Environment steps from one evaluation to the next; None: there is none."""
        return max(1, self.total_steps // self.evaluations) if self.evaluations else None

    def environments(self) -> list[tuple[str, str, dict[str, Any]]]:
        """Name of the task, environment and keywords of each task of the run; a single one has an empty name."""
        return [("", self.env_id, self.env)]

    @property
    def acting_env(self) -> dict[str, Any]:
        """Keywords of the environment in which the policy plays after the training."""
        return self.env

    @field_validator("env_id")
    @classmethod
    def _own_environment(cls, env_id: str) -> str:
        """An id of this package, or one that a module has yet to register, as in "module:id"."""
        if ":" not in env_id and env_id not in gym.registry:
            raise ConfigError("env_id", env_id, OWN_ID)
        refuse_others(env_id)
        return env_id


class CurriculumConfig(RunConfig):
    """A run of PPO, whose episodes may grow harder.

    Args:
        curriculum: Share of the budget over which the difficulty grows from zero to that of ``env``; zero: none.
    """

    curriculum: Share = 0.0
    ppo: Ppo = Ppo()

    def difficulty(self, used: float, hardest: float) -> float:
        """Difficulty of the episodes that begin when the share ``used`` of the budget is used up.

        Args:
            used: In [0, 1].
            hardest: The environment's difficulty.
        """
        return hardest * min(1.0, used / self.curriculum) if self.curriculum else hardest


class Sb3Config(CurriculumConfig):
    """A run of Stable-Baselines3's PPO."""

    learner: Annotated[Literal["sb3"], tyro.conf.Suppress] = "sb3"
    policy: Networks = Networks()


class PpoConfig(CurriculumConfig):
    """A run of this package's PPO.

    Args:
        behaviour_cloning: What the policy imitates first; None: it begins with random weights.
        tasks: Robots in each of several tasks of the benchmark, by name, for one policy for all of them; ``env_id`` is
            then one of their environments, and ``env`` has the keywords that they share. Empty: only ``env_id``.
    """

    learner: Annotated[Literal["ppo"], tyro.conf.Suppress] = "ppo"
    behaviour_cloning: BehaviourCloning | None = None
    tasks: dict[str, Count] = {}
    policy: PpoNetworks = PpoNetworks()

    @property
    def acting_env(self) -> dict[str, Any]:
        """As :attr:`RunConfig.acting_env`; critic and teachers may have seen more."""
        return self.env | ({"observation_blocks": list(self.policy.senses)} if self.policy.senses else {})

    def environments(self) -> list[tuple[str, str, dict[str, Any]]]:
        """As :meth:`RunConfig.environments`; the keywords in ``env`` come on top of those of the tasks."""
        if not self.tasks:
            return super().environments()
        known = benchmark_tasks.load()
        return [(name, known[name].env_id, known[name].options | self.env) for name in self.tasks]

    @model_validator(mode="after")
    def _tasks_fit(self) -> PpoConfig:
        known = benchmark_tasks.load()
        for name in self.tasks:
            if name not in known:
                raise ConfigError("tasks", name, f"some of {', '.join(known)}")
        if self.tasks and sum(self.tasks.values()) != self.num_envs:
            raise ConfigError("num_envs", self.num_envs, f"{sum(self.tasks.values())}, the robots of all tasks")
        if self.tasks and self.curriculum:
            raise ConfigError("curriculum", self.curriculum, "0 with several tasks")
        teachers = () if self.behaviour_cloning is None else tuple(self.behaviour_cloning.teachers)
        if teachers and set(teachers) != set(self.tasks):
            expected = f"one for each of the tasks {', '.join(self.tasks) or 'of a run of several'}"
            raise ConfigError("behaviour_cloning.teachers", ", ".join(teachers), expected)
        return self


class EvolutionConfig(RunConfig):
    """A run of evolution."""

    learner: Annotated[Literal["evolution"], tyro.conf.Suppress] = "evolution"
    policy: EvolutionNetworks = EvolutionNetworks()
    evolution: Evolution = Evolution()


LEARNERS: dict[str, type[RunConfig]] = {"sb3": Sb3Config, "ppo": PpoConfig, "evolution": EvolutionConfig}
LearnerName = Literal["sb3", "ppo", "evolution"]

Kind = TypeVar("Kind", bound=RunConfig)


def load(path: Path | str, learner: str | None = None) -> RunConfig:
    """Reads a YAML or JSON file; a bare name is one of ``training/configs``.

    Args:
        path: File or name.
        learner: Instead of the file's ``learner``, which is ``sb3`` where it has none.

    Raises:
        ConfigError: there is no such file or name, it cannot be read, or a value in it is not admissible.
    """
    values = config_file.read(path)
    name = values.get("learner", "sb3") if learner is None else learner
    if not isinstance(name, str) or name not in LEARNERS:
        raise ConfigError("learner", name, f"one of {', '.join(LEARNERS)}")
    return parse(LEARNERS[name], values | {"learner": name})


def load_as(kind: type[Kind], path: Path | str) -> Kind:
    """Reads a file as the configuration of one learner, whichever it names.

    Raises:
        ConfigError: as :func:`load`.
    """
    return parse(kind, config_file.read(path) | {"learner": kind.model_fields["learner"].default})


def parse(kind: type[Kind], values: dict[str, Any]) -> Kind:
    """The configuration with ``values`` over the defaults.

    Raises:
        ConfigError: names the field, its value and what is admissible.
    """
    with checked(kind):
        return kind.model_validate_json(json.dumps(values))


def check(options: object) -> None:
    """Checks the options of a command, a dataclass, as the sections of a configuration are.

    Raises:
        ConfigError: names the option, its value and what is admissible.
    """
    for name, admissible in get_type_hints(type(options), include_extras=True).items():
        try:
            TypeAdapter(admissible).validate_python(getattr(options, name))
        except ValidationError as error:
            first = error.errors()[0]
            raise ConfigError(".".join(map(str, (name, *first["loc"]))), first["input"], _expected(first)) from None


@contextmanager
def checked(kind: type[BaseModel]) -> Iterator[None]:
    """For making a section.

    Raises:
        ConfigError: in the place of pydantic's error.
    """
    try:
        yield
    except ValidationError as error:
        raise _config_error(kind, error) from None


def _expected(error: Any) -> str:
    """What one of pydantic's errors says is admissible."""
    return str(error["msg"]).removeprefix("Input should be ")


def _config_error(kind: type[BaseModel], error: ValidationError) -> ConfigError:
    """The first of pydantic's errors."""
    first = error.errors()[0]
    cause = first.get("ctx", {}).get("error")
    if isinstance(cause, ConfigError):
        return cause
    *path, last = first["loc"]
    section = kind
    for name in path:
        section = _section(section, str(name))
    expected = _expected(first)
    if first["type"] == "extra_forbidden":
        expected = f"one of {', '.join(section.model_fields)}"
    elif first["type"] in ("model_type", "dict_type"):
        expected = "a mapping of names to values"
    return ConfigError(".".join(map(str, (*path, last))), first["input"], expected)


def _section(kind: type[BaseModel], name: str) -> type[BaseModel]:
    """The class of a field that is a section, or else ``kind``."""
    annotation = kind.model_fields[name].annotation if name in kind.model_fields else None
    options = getattr(annotation, "__args__", (annotation,))
    return next((one for one in options if isinstance(one, type) and issubclass(one, BaseModel)), kind)


def save(config: RunConfig, path: Path) -> None:
    """Writes a JSON file that :func:`load` reads."""
    write_text(path, config.model_dump_json(indent=2) + "\n")
