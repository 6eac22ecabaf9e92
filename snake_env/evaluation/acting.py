"""Policies by what a command line calls them: a gait, a scripted controller, a shipped policy, a file."""

from __future__ import annotations

from dataclasses import astuple
from typing import Any

import numpy as np

from snake_env.errors import ConfigError
from snake_env.evaluation.rollout import layout_of
from snake_env.evaluation.tasks import BenchmarkTask
from snake_env.policies.gaits import DEGREE, GaitParameters, scripted
from snake_env.policies.interface import Policy, refuse_other_interface
from snake_env.policies.scripted import catalogue
from snake_env.policies.shipped import NAMES, load_policy

BASELINE = "gait"
"""The default gait of the environment, action zero: in the plane lateral undulation (T 7.3)."""

CHOICES = f"{BASELINE}, A,omega,beta in degrees, {', '.join(catalogue.CONTROLLERS)}, {', '.join(NAMES)}, or a file"
"""What may be named."""


def acting(text: str, task: BenchmarkTask) -> Policy:
    """The policy that ``text`` names, for a task.

    Args:
        text: ``gait``, amplitude, frequency and phase shift of a gait such as ``30,120,-50`` (degrees and degrees per
            second), a scripted controller such as ``heading control``, a shipped policy, or the path of one.
        task: Where it acts; scripted controllers are tuned for a task.

    Raises:
        ConfigError: there is no such policy, or it was trained with another model or interface than the task has.
    """
    if text == BASELINE:
        return default_gait(task.env_id, **task.options)
    if text in catalogue.CONTROLLERS:
        return catalogue.tuned(text, task.name)
    if text.count(",") == 2:
        return gait_policy(_gait(text), task.env_id, **task.options)
    policy = load_policy(text)
    refuse_other_interface(policy, task.options)
    policy.begin(layout_of(task.env_id, task.options | policy.env_options), 1)
    return policy


def _gait(text: str) -> GaitParameters:
    try:
        return GaitParameters(*(float(part) * DEGREE for part in text.split(",")))
    except ValueError:
        raise ConfigError("policy", text, f"one of {CHOICES}") from None


def default_gait(env_id: str, **options: Any) -> Policy:
    """Action zero as a policy: the default gait of an environment with these keywords."""
    entries = layout_of(env_id, options | {"action_mode": "gait"})["action"]
    gait = GaitParameters.default(entries)
    name = "thesis gait" if np.allclose(astuple(gait), astuple(GaitParameters())) else "default gait"
    return scripted(gait, entries, name)


def gait_policy(gait: GaitParameters, env_id: str, **options: Any) -> Policy:
    """A gait as a policy for an environment with these keywords, named after its parameters."""
    name = "thesis gait" if gait == GaitParameters() else str(gait)
    return scripted(gait, layout_of(env_id, options | {"action_mode": "gait"})["action"], name)
