"""Hyperparameters for RL Zoo.

``python -m rl_zoo3.train --algo ppo --env SnakeField-v1 --gym-packages snake_env --conf-file snake_env.zoo``; for SAC
and TQC take ``snake_env.zoo.sac`` and ``snake_env.zoo.tqc``.
"""

from snake_env.zoo._common import for_all_environments

hyperparams = for_all_environments(
    n_envs=64,
    n_timesteps=4e6,
    n_steps=64,
    batch_size=1024,
    n_epochs=8,
    learning_rate="lin_5e-4",
    gamma=0.98,
    gae_lambda=0.95,
    ent_coef=0.0,
    policy_kwargs="dict(net_arch=[128, 128], log_std_init=-0.5)",
)
