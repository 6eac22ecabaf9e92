"""Hyperparameters for SAC."""

from snake_env.zoo._common import for_all_environments

hyperparams = for_all_environments(
    n_envs=16,
    n_timesteps=1e6,
    batch_size=512,
    buffer_size=500_000,
    learning_starts=5_000,
    learning_rate=7e-4,
    train_freq=4,
    gradient_steps=16,
    gamma=0.98,
    tau=0.01,
    policy_kwargs="dict(net_arch=[256, 256])",
)
