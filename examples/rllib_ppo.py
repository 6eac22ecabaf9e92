"""RLlib's PPO on native batches, one in each environment runner.

    python examples/rllib_ppo.py --runners 2 --total-steps 1000000

Needs "ray[rllib]" and torch.
"""

from __future__ import annotations

import argparse

from ray.rllib.algorithms.ppo import PPO, PPOConfig
from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig

import snake_env


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--env", default="SnakeField-v1")
    parser.add_argument("--runners", type=int, default=1, help="processes that step a batch each")
    parser.add_argument("--num-envs", type=int, default=64, help="robots of each runner")
    parser.add_argument("--steps", type=int, default=64, help="of each robot between two updates")
    parser.add_argument("--total-steps", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    return parser.parse_args()


def settings(args: argparse.Namespace) -> PPOConfig:
    """RLlib's configuration.

    RLlib reads the first observation of an episode from the step after the end of the last one: in Gymnasium's
    next-step mode that is right, with same-step resets it would silently join two episodes. "snake_env:" imports the
    package in the runners.
    """
    batch = args.runners * args.num_envs * args.steps
    return (
        PPOConfig()
        .environment(f"snake_env:{args.env}", env_config={"autoreset_mode": "NextStep", "num_threads": 1})
        .env_runners(
            num_env_runners=args.runners,
            num_envs_per_env_runner=args.num_envs,
            gym_env_vectorize_mode="vector_entry_point",
            rollout_fragment_length=args.steps,
        )
        .training(
            train_batch_size_per_learner=batch,
            minibatch_size=max(1, batch // 8),
            num_epochs=5,
            lr=3e-4,
            gamma=0.99,
            lambda_=0.95,
            clip_param=0.2,
            vf_clip_param=float("inf"),
            use_kl_loss=False,
        )
        .rl_module(model_config=DefaultModelConfig(fcnet_hiddens=[64, 64], vf_share_layers=False))
        .debugging(seed=args.seed)
    )


def train(args: argparse.Namespace) -> PPO:
    """Trains; returns RLlib's algorithm, which is still to be stopped."""
    algorithm = settings(args).build_algo()
    steps = 0
    while steps < args.total_steps:
        results = algorithm.train()
        steps = int(results["num_env_steps_sampled_lifetime"])
        mean = results["env_runners"].get("episode_return_mean", float("nan"))
        print(f"{steps} steps  return {mean:.2f}", flush=True)
    return algorithm


if __name__ == "__main__":
    print(f"snake_env {snake_env.__version__}")
    train(arguments()).stop()
