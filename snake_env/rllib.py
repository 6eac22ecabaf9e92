"""PPO of RLlib on native batches, one in each environment runner of a Ray cluster; needs the extra ``ray``."""

from __future__ import annotations

from typing import Any

from snake_env._extras import extras

with extras():
    import torch  # noqa: F401
    from ray.rllib.algorithms.ppo import PPO, PPOConfig
    from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig


def settings(
    env_id: str = "SnakeField-v1",
    runners: int = 1,
    num_envs: int = 64,
    *,
    steps: int = 64,
    seed: int = 0,
    **options: Any,
) -> PPOConfig:
    """RLlib's configuration, for ``build_algo()`` or as the trainable of a ``ray.tune.Tuner``.

    RLlib reads the first observation of an episode from the step after the end of the last one: in Gymnasium's
    next-step mode that is right, with same-step resets it would silently join two episodes.

    Args:
        env_id: a registered id of this package.
        runners: processes that step a batch each; 0: the one that learns.
        num_envs: robots of each runner.
        steps: of each robot between two updates.
        seed: of robots and networks.
        **options: keywords of the environment.
    """
    batch = max(1, runners) * num_envs * steps
    return (
        PPOConfig()
        # "snake_env:" imports the package in the runners.
        .environment(f"snake_env:{env_id}", env_config={"autoreset_mode": "NextStep", "num_threads": 1, **options})
        .env_runners(
            num_env_runners=runners,
            num_envs_per_env_runner=num_envs,
            gym_env_vectorize_mode="vector_entry_point",
            rollout_fragment_length=steps,
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
        .rl_module(
            model_config=DefaultModelConfig(fcnet_hiddens=[64, 64], fcnet_activation="tanh", vf_share_layers=False)
        )
        .debugging(seed=seed)
    )


def train(config: PPOConfig, total_steps: int) -> PPO:
    """Trains; returns RLlib's algorithm, which is still to be stopped."""
    algorithm = config.build_algo()
    done = 0
    while done < total_steps:
        results = algorithm.train()
        done = int(results["num_env_steps_sampled_lifetime"])
        mean = results["env_runners"].get("episode_return_mean", float("nan"))
        print(f"{done} steps  return {mean:.2f}", flush=True)
    return algorithm
