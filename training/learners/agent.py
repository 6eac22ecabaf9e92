"""Actor and critic of PPO."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, cast

import numpy as np
import torch
from torch import Tensor, nn

from snake_env import ConfigError
from snake_env.evaluation.rollout import layout_of
from snake_env.policies import files, memory
from training.config import PpoConfig, PpoNetworks
from training.policies.symmetry import Reflection, SymmetricNetwork

LOG_SQRT_TAU = 0.5 * float(np.log(2.0 * np.pi))


class Agent(nn.Module):
    """Actor and critic: two networks with tanh, and a Gaussian whose spread does not depend on the observation.

    Args:
        observations: Elements of an observation.
        actions: Elements of an action.
        policy: Hidden layers, their precision, and the standard deviation at the start.
        reflection: Signs that make both networks treat left and right alike; None: they need not.
        sensed: Elements of the observation that the actor sees; None: all.
    """

    def __init__(
        self,
        observations: int,
        actions: int,
        policy: PpoNetworks,
        reflection: Reflection | None,
        sensed: list[int] | None = None,
    ) -> None:
        super().__init__()
        seen = observations if sensed is None else len(sensed)
        self.actor: nn.Module = network(seen, policy, actions, last_gain=0.01)
        self.critic: nn.Module = network(observations, policy, 1, last_gain=1.0)
        self._reflection = reflection
        if reflection is not None:
            self._reflection = reflection if sensed is None else reflection.part(sensed)
            self.actor = SymmetricNetwork(self.actor, self._reflection, reflection.action)
            self.critic = SymmetricNetwork(self.critic, reflection, np.ones(1, np.float32))
        if sensed is not None:
            self.actor = nn.Sequential(Sensed(sensed), self.actor)
        self.log_std = nn.Parameter(torch.full((actions,), policy.log_std))

    def forward(self, observation: Tensor, action: Tensor) -> tuple[Tensor, Tensor]:
        """Logarithm of the density of given actions, and the expected discounted return, (n,) each."""
        return self.log_density(observation, action), self.value(observation)

    def value(self, observation: Tensor) -> Tensor:
        """Expected discounted return (n,)."""
        return self.critic(observation).squeeze(-1)

    def act(self, observation: Tensor, deviation: Tensor) -> Tensor:
        """Actions (n, a) that are so many standard deviations (n, a) from the mean."""
        return torch.addcmul(self.actor(observation), deviation, self.log_std.exp())

    def log_density(self, observation: Tensor, action: Tensor) -> Tensor:
        """Logarithm of the density of given actions (n,)."""
        return self.log_density_of((action - self.actor(observation)) * (-self.log_std).exp())

    def log_density_of(self, deviation: Tensor) -> Tensor:
        """Logarithm of the density (...) of deviations from the mean in standard deviations (..., a)."""
        return -0.5 * deviation.square().sum(-1) - (self.log_std + LOG_SQRT_TAU).sum()

    def entropy(self) -> Tensor:
        """Of the Gaussian."""
        return (self.log_std + 0.5 + LOG_SQRT_TAU).sum()

    def arrays(self) -> files.Arrays:
        """Arrays of the policy file: the actor's layers, numbered without the tanh between them, and the signs."""
        layers = [layer for layer in self.actor.modules() if isinstance(layer, nn.Linear)]
        named = {
            f"actor.{k}.{name}": value for k, layer in enumerate(layers) for name, value in layer.named_parameters()
        }
        signs = {} if self._reflection is None else self._reflection.arrays()
        return {name: value.detach().numpy() for name, value in named.items()} | signs


def make_agent(config: PpoConfig, observations: int, actions: int) -> Agent:
    """The agent of a run before it has learned anything."""
    return Agent(observations, actions, config.policy, reflection_of(config), sensed(config))


def sensed(config: PpoConfig) -> list[int] | None:
    """Elements of what the networks of a run see that its actor sees, in the order of its policy file; None: all."""
    if not config.policy.senses:
        return None
    all_inputs, own = (
        memory.network_inputs(layout_of(config.env_id, env), config.policy.memory)
        for env in (config.env, config.acting_env)
    )
    unseen = sorted({name.partition(":")[0] for name in own} - {name.partition(":")[0] for name in all_inputs})
    if unseen:
        raise ConfigError("policy.senses", unseen[0], "a block that env.observation_blocks has")
    return [all_inputs.index(name) for name in own]


class Sensed(nn.Module):
    """Some elements (n, s) of observations (n, o).

    Args:
        elements: Their indices.
    """

    def __init__(self, elements: list[int]) -> None:
        super().__init__()
        self._elements = torch.tensor(elements)

    def forward(self, observation: Tensor) -> Tensor:
        """The elements."""
        return observation.index_select(-1, self._elements)


def reflection_of(config: PpoConfig) -> Reflection | None:
    """Of what the networks of a run see and do, memory included; None if the run does not use symmetry."""
    if not config.policy.symmetric:
        return None
    layout = layout_of(config.env_id, config.env)
    seen, kept = Reflection.of(layout), memory.remembered(layout)
    traced = seen.part(kept)
    times, sizes = len(config.policy.memory), len(seen.order)
    orders = [sizes + time * len(kept) + traced.order for time in range(times)]
    signs = np.concatenate([seen.observation, np.tile(traced.observation, times)])
    return Reflection(signs, seen.action, np.concatenate([seen.order, *orders]))


def network(inputs: int, policy: PpoNetworks, outputs: int, last_gain: float) -> nn.Sequential:
    """Hidden layers with tanh, in the precision that the policy learns in, and a last one that is linear."""
    sizes = pairwise([inputs, *policy.hidden])
    activation = nn.Tanh if policy.bfloat16 else Tanh
    layers = [layer for wide, high in sizes for layer in (linear(wide, high, 2.0**0.5), activation())]
    hidden = HalfPrecision(*layers) if policy.bfloat16 else nn.Sequential(*layers)
    return nn.Sequential(hidden, linear([inputs, *policy.hidden][-1], outputs, last_gain))


def linear(inputs: int, outputs: int, gain: float) -> nn.Linear:
    """A layer with orthogonal weights and zero biases."""
    layer = nn.Linear(inputs, outputs)
    nn.init.orthogonal_(layer.weight, gain)
    nn.init.zeros_(layer.bias)
    return layer


class Tanh(nn.Module):
    """The hyperbolic tangent in single precision, within 2e-7, in a third of the time of :class:`torch.nn.Tanh`.

    By tanh(x) = 2 / (1 + exp(-2 x)) - 1, since torch's exponential takes a sixth of the time of its tangent.
    """

    def forward(self, inputs: Tensor) -> Tensor:
        """Outputs of the shape of the inputs."""
        return cast(Tensor, FastTanh.apply(inputs))


class FastTanh(torch.autograd.Function):
    """What :class:`Tanh` computes, and its derivative 1 - tanh(x)^2."""

    @staticmethod
    def forward(ctx: Any, inputs: Tensor) -> Tensor:
        """Outputs of the shape of the inputs."""
        outputs = (2.0 * inputs).sigmoid_().mul_(2.0).sub_(1.0)
        ctx.save_for_backward(outputs)
        return outputs

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> Tensor:
        """Gradient of the inputs from that of the outputs."""
        (outputs,) = ctx.saved_tensors
        return torch.ops.aten.tanh_backward(gradient, outputs)


class HalfPrecision(nn.Sequential):
    """Layers whose products are of bfloat16 numbers; what they leave is in single precision again.

    Processors without instructions for such products multiply the rounded numbers in single precision: torch's own
    kernels for them are several times slower there. Both sum in single precision, in different orders.
    """

    def forward(self, inputs: Tensor) -> Tensor:
        """Outputs (n, k)."""
        if MULTIPLIES_BFLOAT16:
            with torch.autocast("cpu", torch.bfloat16):
                return cast(Tensor, super().forward(inputs)).float()
        outputs = rounded(inputs)
        for layer in self:
            if isinstance(layer, nn.Linear):
                outputs = rounded(nn.functional.linear(outputs, rounded(layer.weight), rounded(layer.bias)))
            else:
                outputs = rounded(layer(outputs))
        return outputs


def rounded(numbers: Tensor) -> Tensor:
    """The nearest bfloat16 numbers, and their gradients likewise, in single precision."""
    return numbers.bfloat16().float()


def multiplies_bfloat16() -> bool:
    """Whether this processor has instructions for products of bfloat16 numbers, by their names on x86 and ARM.

    Versions of torch that cannot tell leave the products to their own kernels.
    """
    if not hasattr(torch.cpu, "get_capabilities"):
        return True
    capabilities = torch.cpu.get_capabilities()
    return any(capabilities.get(name, False) for name in ("avx512_bf16", "bf16"))


MULTIPLIES_BFLOAT16 = multiplies_bfloat16()
