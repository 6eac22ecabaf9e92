"""What the command lines share."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from typing import Any

import gymnasium as gym

from snake_env import ConfigError
from training.policies.gaits import DEGREE, GaitParameters


def help_format(prog: str) -> argparse.HelpFormatter:
    """Keeps the line breaks of a module's text and shows defaults."""
    return _Format(prog, width=100)


def answer(cli: argparse.ArgumentParser, work: Callable[[argparse.Namespace], int], given: list[str] | None) -> int:
    """Does the work that a command line asks for; input that does not do ends it with one line and status 2.

    Args:
        cli: the command line.
        work: what it asks for, with its exit status.
        given: arguments; None: those of the process.
    """
    args = cli.parse_args(given)
    try:
        return work(args)
    except (FileNotFoundError, ConfigError, gym.error.Error) as error:
        cli.error(str(error))


class _Format(argparse.RawDescriptionHelpFormatter, argparse.ArgumentDefaultsHelpFormatter):
    pass


def gait_from_text(text: str) -> GaitParameters:
    """'thesis', or 'A,omega,beta' in degrees and degrees per second."""
    if text == "thesis":
        return GaitParameters()
    try:
        amplitude, omega, beta = (float(part) * DEGREE for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: expected 'thesis' or A,omega,beta in degrees") from None
    return GaitParameters(amplitude, omega, beta)


def json_mapping(text: str) -> dict[str, Any]:
    """A JSON object."""
    try:
        value = json.loads(text)
    except json.JSONDecodeError as error:
        raise argparse.ArgumentTypeError(f"{text!r}: expected a JSON object ({error})") from None
    if not isinstance(value, dict):
        raise argparse.ArgumentTypeError(f"{text!r}: expected a JSON object")
    return value


def numbers(text: str) -> list[float]:
    """Numbers separated by commas."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: expected numbers separated by commas") from None


def names(text: str) -> list[str]:
    """Words separated by commas."""
    return [part.strip() for part in text.split(",")]
