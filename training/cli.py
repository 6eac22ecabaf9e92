"""The command line: ``python -m training <command> ...``, one module per command.

A command is a dataclass of options, from which tyro makes the parser and the help, and a function of it.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module
from typing import Annotated, TypeVar

import gymnasium as gym
import tyro

from snake_env import ConfigError
from snake_env.policies.gaits import DEGREE, GaitParameters
from training import config as configs
from training.runs import StaleRun

COMMANDS = {
    "train": ("training.train:main", "train a policy, or resume a run"),
    "evaluate": ("training.evaluate:evaluate", "score policies and gaits on held-out fields"),
    "submit": ("training.submission.submit:submit", "enter policies into the benchmark"),
    "verify": ("training.submission.verify:verify", "replay an entry, and say whether its scores hold"),
    "leaderboard": ("training.submission.leaderboard:show", "rank the entries"),
    "inspect": ("training.evaluation.inspection:inspect", "show how a policy moves and fails"),
    "video": ("training.evaluation.video:answer_film", "film an episode"),
    "tune": ("training.search.tune:tune_all", "choose the parameters of the scripted controllers"),
    "gaits": ("training.search.compare_gaits:compare", "search the best constant gait"),
    "sweep": ("training.search.sweep:sweep", "train many seeds of many configurations"),
    "pipeline": ("training.pipeline:run", "search a gait, train, evaluate, draw: what `make train` runs"),
}
"""By name: module and function of the module's ``Options``, or ``main``, which takes arguments; and the description."""

Options = TypeVar("Options")


def main(arguments: list[str] | None = None) -> int:
    """Runs the command that the first argument names."""
    given = sys.argv[1:] if arguments is None else arguments
    if not given or given[0] not in COMMANDS:
        wanted = bool(given) and given[0] in ("-h", "--help")
        width = max(map(len, COMMANDS))
        lines = [f"  {name.ljust(width)}  {about}" for name, (_, about) in COMMANDS.items()]
        print(
            "usage: python -m training <command> [options]", "", *lines, sep="\n", file=None if wanted else sys.stderr
        )
        return 0 if wanted else 2
    module, _, name = COMMANDS[given[0]][0].partition(":")
    found = import_module(module)
    work = getattr(found, name)
    status: int = work(given[1:]) if name == "main" else answer(found.Options, work, found.__doc__, given[1:])
    return status


def answer(
    kind: type[Options], work: Callable[[Options], int], text: str | None, arguments: list[str] | None = None
) -> int:
    """Runs a command; 2 after one line about what is wrong with its input, 130 when it was interrupted.

    Args:
        kind: Class of its options.
        work: The command, with its exit status.
        text: Its description.
        arguments: Of the command line; None: those of the process.
    """
    options = tyro.cli(kind, prog=as_typed(), args=arguments, description=text)
    try:
        configs.check(options)
        return work(options)
    except (FileNotFoundError, ConfigError, StaleRun, gym.error.Error) as error:
        print(error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("\nstopped", file=sys.stderr)
        return 130


def as_typed() -> str:
    """The command as it was typed, without its options."""
    module = sys.modules["__main__"].__spec__
    if module is None:  # a script
        return sys.argv[0]
    words = ["python -m", module.name.removesuffix(".__main__"), *sys.argv[1:2]]
    return " ".join(words[: 3 if module.name == "training.__main__" else 2])


def _gait(words: list[str]) -> GaitParameters:
    if words[0] == "thesis":
        return GaitParameters()
    try:
        amplitude, omega, beta = (float(part) * DEGREE for part in words[0].split(","))
    except ValueError:
        raise ValueError(f"{words[0]!r}: expected 'thesis' or A,omega,beta in degrees") from None
    return GaitParameters(amplitude, omega, beta)


Gait = Annotated[
    GaitParameters,
    tyro.constructors.PrimitiveConstructorSpec(
        nargs=1,
        metavar="GAIT",
        instance_from_str=_gait,
        is_instance=lambda value: isinstance(value, GaitParameters),
        str_from_instance=lambda gait: [",".join(f"{v / DEGREE:g}" for v in (gait.amplitude, gait.omega, gait.beta))],
    ),
]
"""'thesis', or A,omega,beta in degrees and degrees per second."""
