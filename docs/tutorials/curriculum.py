# ---
# jupyter:
#   kernelspec: {display_name: Python 3, language: python, name: python3}
# ---

# %% [markdown]
# # Curriculum and randomisation
#
# `difficulty` scales how irregular a scene is. It can rise while a policy learns, robot by robot. Randomisation draws
# friction, mass and other parameters anew in each episode, so that a policy does not rely on one value.

# %%
import gymnasium
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

import snake_env

torch.set_num_threads(1)

# %% [markdown]
# A new difficulty applies from the next episode on; the running one is unchanged. `mask` chooses robots.

# %%
envs = gymnasium.make_vec("SnakeField-v1", num_envs=8, difficulty=0.0)
envs.reset(seed=0)
envs.unwrapped.set_difficulty(1.0, np.arange(8) >= 4)
print(envs.unwrapped.difficulty)
envs.close()

# %% [markdown]
# With Stable-Baselines3 a callback raises it.


# %%
class Curriculum(BaseCallback):
    """Raises the difficulty linearly, from 0 to 1 over the training."""

    def _on_rollout_start(self) -> None:
        reached = self.num_timesteps / self.locals["total_timesteps"]
        self.training_env.env_method("set_difficulty", min(1.0, reached))

    def _on_step(self) -> bool:
        return True


venv = snake_env.sb3.make("SnakeField-v1", num_envs=32, difficulty=0.0)
model = PPO("MlpPolicy", venv, n_steps=64, batch_size=1024, seed=0)
model.learn(12_000, callback=Curriculum())
print(venv.get_attr("difficulty", indices=[0]))

# %% [markdown]
# Randomisation: intervals from which each episode draws. All of it is off by default.

# %%
randomised = snake_env.Randomization(
    friction=(0.5, 1.5), mass=(0.9, 1.1), torque_limit=(0.5, 1.0), reference_delay=(0.0, 0.1), peg_error=0.02
)
envs = gymnasium.make_vec("SnakeField-v1", num_envs=64, randomization=randomised)
envs.reset(seed=0)
for _ in range(100):
    envs.step(np.zeros((64, 4), np.float32))
spread = envs.unwrapped.state().distance
print(f"distance after 5 s: {spread.min():.2f} to {spread.max():.2f} m")
envs.close()

# %% [markdown]
# `Randomization.thesis()` switches on everything that the thesis lists as a difference between model and robot
# (section 7.5.4). A critic can see what was drawn: `privileged=True` adds blocks that the policy does not need.
