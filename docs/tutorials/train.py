# ---
# jupyter:
#   kernelspec: {display_name: Python 3, language: python, name: python3}
# ---

# %% [markdown]
# # Train a policy
#
# PPO of Stable-Baselines3 learns to pass random fields of pegs. This page trains for some seconds, to show the parts;
# `make train` trains for six minutes and passes most of the test scenes.

# %%
import numpy as np
import torch
from stable_baselines3 import PPO

import snake_env
from snake_env.evaluation import evaluate

torch.set_num_threads(1)  # a second thread often slows down a network this small

# %% [markdown]
# `snake_env.sb3.make` is a batch of robots as a `VecEnv` of Stable-Baselines3. All robots are stepped by one call.

# %%
venv = snake_env.sb3.make("SnakeField-v1", num_envs=64, difficulty=0.5)
print(venv.observation_space.shape, venv.action_space.shape)

# %% [markdown]
# The networks are small and the rollouts short: 64 robots make many short episodes at once. Actions begin near zero,
# which is the baseline gait, so that the policy moves from the start.

# %%
model = PPO(
    "MlpPolicy",
    venv,
    n_steps=64,
    batch_size=1024,
    learning_rate=5e-4,
    gamma=0.997,
    policy_kwargs={"log_std_init": -1.0, "net_arch": [64, 64]},
    seed=0,
)
model.learn(30_000)

# %% [markdown]
# Scores are taken on test scenes, which training never sees, and without exploration noise.


# %%
def learned(observation):
    """The mean action of the policy."""
    return model.predict(observation, deterministic=True)[0]


def gait(observation):
    """Action zero, the baseline gait."""
    return np.zeros((len(observation), 4), np.float32)


for policy in (gait, learned):
    scores = evaluate(policy, "field-medium", scenes=40).scores
    success, speed = scores["success"], scores["speed"]
    print(
        f"{policy.__name__}: success {success.value:.2f} [{success.low:.2f}, {success.high:.2f}], {speed.value:.3f} m/s"
    )

# %% [markdown]
# So few steps rarely change the success much. Train longer (`model.learn(2_000_000)`), watch the learning curve in
# TensorBoard (`tensorboard_log=` of PPO), and compare several seeds before you believe a difference:
# [evaluate and report](../evaluate/).
