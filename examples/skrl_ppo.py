"""PPO of skrl on a native batch, with a critic that sees the privileged blocks.

    python examples/skrl_ppo.py --total-steps 1000000

skrl calls what the critic sees the state. Needs skrl, 2.0 or later, and torch.
"""

from __future__ import annotations

import argparse
from typing import Any

import gymnasium
import torch
from skrl.agents.torch.ppo import PPO, PPO_CFG
from skrl.envs.wrappers.torch.gymnasium_envs import GymnasiumWrapper
from skrl.memories.torch import RandomMemory
from skrl.models.torch import DeterministicMixin, GaussianMixin, Model
from skrl.trainers.torch import SequentialTrainer
from skrl.utils import set_seed
from torch import Tensor, nn

import snake_env

STEPS = 64
"""Of each robot between two updates."""


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--env", default="SnakeField-v1")
    parser.add_argument("--num-envs", type=int, default=64)
    parser.add_argument("--total-steps", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", default="runs/skrl", help="folder of the checkpoints and of TensorBoard's logs")
    return parser.parse_args()


class Robots(GymnasiumWrapper):
    """skrl's view of a batch: the policy observes what a robot senses, the critic everything."""

    def __init__(self, envs: Any) -> None:
        super().__init__(envs)
        blocks = envs.unwrapped.layout["observation"]
        self.sensed = next(block["start"] for block in blocks if block["name"].startswith("privileged_"))
        space = envs.single_observation_space
        self._space = gymnasium.spaces.Box(space.low[: self.sensed], space.high[: self.sensed])

    @property
    def observation_space(self) -> gymnasium.Space:
        """Of one robot, without privileged blocks."""
        return self._space

    @property
    def state_space(self) -> gymnasium.Space:
        """Of one robot, with privileged blocks."""
        return self._env.single_observation_space

    def reset(self) -> tuple[Tensor, dict[str, Any]]:
        """Starts the first episodes; later ones follow each other within steps."""
        if self._reset_once:
            observation, self._info = self._env.reset(seed=self._seed)
            self._reset_once, self._seed = False, None
            self._observation = torch.from_numpy(observation).to(self.device)
        return self._observation[:, : self.sensed], self._info

    def step(self, actions: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor, dict[str, Any]]:
        """One control period of all robots."""
        observation, *results, self._info = self._env.step(actions.cpu().numpy())
        # Tensors share the memory of the arrays: a batch never writes again to what it has returned.
        self._observation = torch.from_numpy(observation).to(self.device)
        reward, terminated, truncated = (torch.from_numpy(one).to(self.device)[:, None] for one in results)
        return self._observation[:, : self.sensed], reward.float(), terminated, truncated, self._info

    def state(self) -> Tensor:
        """What the critic sees of the present."""
        return self._observation


def network(inputs: int, outputs: int) -> nn.Sequential:
    """Two hidden layers."""
    return nn.Sequential(nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, outputs))


class Policy(GaussianMixin, Model):
    """Actions from observations."""

    def __init__(self, **spaces: Any) -> None:
        Model.__init__(self, **spaces)
        GaussianMixin.__init__(self)
        self.mean = network(self.num_observations, self.num_actions)
        self.log_std = nn.Parameter(torch.full((self.num_actions,), -0.5))

    def compute(self, inputs: dict[str, Tensor], role: str = "") -> tuple[Tensor, dict[str, Tensor]]:
        """The mean of the actions."""
        return self.mean(inputs["observations"]), {"log_std": self.log_std}


class Critic(DeterministicMixin, Model):
    """Expected returns from states."""

    def __init__(self, **spaces: Any) -> None:
        Model.__init__(self, **spaces)
        DeterministicMixin.__init__(self)
        self.value = network(self.num_states, 1)

    def compute(self, inputs: dict[str, Tensor], role: str = "") -> tuple[Tensor, dict[str, Tensor]]:
        """The expected return."""
        return self.value(inputs["states"]), {}


def train(args: argparse.Namespace) -> PPO:
    """Trains; returns skrl's agent."""
    set_seed(args.seed)
    envs = gymnasium.make_vec(args.env, num_envs=args.num_envs, privileged=True, autoreset_mode="SameStep")
    robots = Robots(envs)
    device = robots.device
    spaces = {
        "observation_space": robots.observation_space,
        "state_space": robots.state_space,
        "action_space": robots.action_space,
        "device": device,
    }
    config = PPO_CFG(rollouts=STEPS, learning_epochs=5, mini_batches=8, learning_rate=3e-4, time_limit_bootstrap=True)
    config.experiment.directory = args.out
    agent = PPO(
        models={"policy": Policy(**spaces), "value": Critic(**spaces)},
        memory=RandomMemory(memory_size=STEPS, num_envs=args.num_envs, device=device),
        cfg=config,
        **spaces,
    )
    steps = max(STEPS, args.total_steps // args.num_envs)
    trainer = {"timesteps": steps, "headless": True, "close_environment_at_exit": False}
    SequentialTrainer(env=robots, agents=agent, cfg=trainer).train()
    envs.close()
    print(f"{steps * args.num_envs} steps, checkpoints in {agent.experiment_dir}")
    return agent


if __name__ == "__main__":
    print(f"snake_env {snake_env.__version__}")
    train(arguments())
