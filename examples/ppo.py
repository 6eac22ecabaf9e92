"""PPO in one file, after CleanRL's ``ppo_continuous_action``, on a native batch with a critic that sees more.

    python examples/ppo.py --total-steps 1000000

The policy sees the blocks of the observation that a robot can sense, the critic also the privileged ones. Needs torch.
"""

from __future__ import annotations

import argparse
import time

import gymnasium
import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from torch import Tensor, nn

import snake_env

GAMMA, LAMBDA, CLIP = 0.99, 0.95, 0.2
EPOCHS, MINIBATCHES, LEARNING_RATE = 5, 8, 3e-4


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--env", default="SnakeField-v1")
    parser.add_argument("--num-envs", type=int, default=64)
    parser.add_argument("--steps", type=int, default=64, help="of each robot between two updates")
    parser.add_argument("--total-steps", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    return parser.parse_args()


def network(inputs: int, outputs: int, last: float) -> nn.Sequential:
    """Two hidden layers, orthogonal weights."""
    layers: list[nn.Module] = []
    for size_in, size_out, gain in ((inputs, 64, 2**0.5), (64, 64, 2**0.5), (64, outputs, last)):
        layer = nn.Linear(size_in, size_out)
        nn.init.orthogonal_(layer.weight, gain)
        nn.init.zeros_(layer.bias)
        layers += [layer, nn.Tanh()]
    return nn.Sequential(*layers[:-1])


class Agent(nn.Module):
    """A Gaussian policy of the sensed part of an observation, and a critic of all of it."""

    def __init__(self, size: int, sensed: int, actions: int) -> None:
        super().__init__()
        self.sensed = sensed
        self.critic = network(size, 1, 1.0)
        self.actor = network(sensed, actions, 0.01)
        self.log_std = nn.Parameter(torch.full((actions,), -0.5))

    def policy(self, observation: Tensor) -> torch.distributions.Normal:
        """The distribution of actions."""
        return torch.distributions.Normal(self.actor(observation[:, : self.sensed]), self.log_std.exp())

    def value(self, observation: Tensor) -> Tensor:
        """The expected return (n,)."""
        return self.critic(observation)[:, 0]


def train(args: argparse.Namespace) -> list[float]:
    """Trains; returns the mean return of the episodes that ended in each iteration."""
    torch.manual_seed(args.seed)
    envs = gymnasium.make_vec(
        args.env, num_envs=args.num_envs, privileged=True, autoreset_mode=AutoresetMode.SAME_STEP.value
    )
    blocks = envs.unwrapped.layout["observation"]
    sensed = next(block["start"] for block in blocks if block["name"].startswith("privileged_"))
    size, actions = envs.single_observation_space.shape[0], envs.single_action_space.shape[0]
    agent = Agent(size, sensed, actions)
    optimiser = torch.optim.Adam(agent.parameters(), lr=LEARNING_RATE, eps=1e-5)

    steps, n = args.steps, args.num_envs
    seen, taken = torch.zeros(steps, n, size), torch.zeros(steps, n, actions)
    log_prob, rewards, values, done = (torch.zeros(steps, n) for _ in range(4))
    returned, running = [], np.zeros(n)
    # Tensors share the memory of the arrays: a batch never writes again to what it has returned.
    observation = torch.from_numpy(envs.reset(seed=args.seed)[0])
    began = time.time()
    for iteration in range(max(1, args.total_steps // (steps * n))):
        ended: list[float] = []
        for t in range(steps):
            seen[t] = observation
            with torch.no_grad():
                distribution = agent.policy(observation)
                taken[t] = distribution.sample()
                log_prob[t] = distribution.log_prob(taken[t]).sum(1)
                values[t] = agent.value(observation)
            after, reward, terminated, truncated, infos = envs.step(taken[t].numpy())
            running += reward
            over = terminated | truncated
            if over.any():
                # An episode that was cut off goes on as far as its value is concerned.
                cut = np.flatnonzero(truncated & ~terminated)
                if len(cut):
                    last = torch.from_numpy(np.stack(infos["final_obs"][cut]))
                    with torch.no_grad():
                        reward[cut] += GAMMA * agent.value(last).numpy()
                ended += running[over].tolist()
                running[over] = 0.0
            rewards[t], done[t] = torch.from_numpy(reward), torch.from_numpy(over)
            observation = torch.from_numpy(after)
        advantages = torch.zeros(steps, n)
        with torch.no_grad():
            following, gain = agent.value(observation), torch.zeros(n)
        for t in reversed(range(steps)):
            delta = rewards[t] + GAMMA * following * (1 - done[t]) - values[t]
            advantages[t] = gain = delta + GAMMA * LAMBDA * (1 - done[t]) * gain
            following = values[t]
        update(agent, optimiser, *(x.flatten(0, 1) for x in (seen, taken, log_prob, advantages, advantages + values)))
        returned.append(float(np.mean(ended)) if ended else float("nan"))
        rate = (iteration + 1) * steps * n / (time.time() - began)
        print(f"iteration {iteration}  return {returned[-1]:.2f}  {rate:.0f} steps/s", flush=True)
    envs.close()
    return returned


def update(
    agent: Agent,
    optimiser: torch.optim.Optimizer,
    observation: Tensor,
    action: Tensor,
    old_log_prob: Tensor,
    advantage: Tensor,
    returns: Tensor,
) -> None:
    """Some epochs of the clipped objective."""
    for _ in range(EPOCHS):
        for rows in torch.randperm(len(observation)).chunk(MINIBATCHES):
            distribution = agent.policy(observation[rows])
            ratio = (distribution.log_prob(action[rows]).sum(1) - old_log_prob[rows]).exp()
            normed = (advantage[rows] - advantage[rows].mean()) / (advantage[rows].std() + 1e-8)
            gain = torch.min(ratio * normed, ratio.clamp(1 - CLIP, 1 + CLIP) * normed).mean()
            loss = 0.5 * (agent.value(observation[rows]) - returns[rows]).square().mean() - gain
            optimiser.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
            optimiser.step()


if __name__ == "__main__":
    print(f"snake_env {snake_env.__version__}")
    train(arguments())
