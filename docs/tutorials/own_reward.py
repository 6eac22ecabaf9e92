# ---
# jupyter:
#   kernelspec: {display_name: Python 3, language: python, name: python3}
# ---

# %% [markdown]
# # Your own reward
#
# `reward_fn` and `termination_fn` are called once per step for all robots. They see the complete state: poses,
# velocities, torques and forces, and not only what the policy observes.

# %%
import gymnasium
import numpy as np

import snake_env

# %% [markdown]
# The built-in reward is a sum of terms with weights. To change weights, no function is needed:

# %%
envs = gymnasium.make_vec("SnakeField-v1", num_envs=4, reward_weights={"progress": 1.0, "energy": 0.01})
_, info = envs.reset(seed=0)
print(sorted(name for name in info if name.startswith("reward_")))

# %% [markdown]
# A reward of your own gets `state`, `action` and `previous_action`, with one row per robot. This one pays for progress
# and charges for large torques and for contact forces on the head.


# %%
def gentle(state, action, previous_action):
    """Progress, less the mean square torque and the force on link 1."""
    torque = np.square(state.joint_torque).mean(axis=1)
    head = np.linalg.norm(state.contact_force[:, 0], axis=1)
    return 10.0 * snake_env.rewards.progress(state, action, previous_action) - 0.002 * torque - 0.01 * head


def stuck(state, action, previous_action):
    """Ends episodes of robots that have been jammed for more than half of the time."""
    return state["jam_ratio"] > 0.5


envs = gymnasium.make_vec("SnakeField-v1", num_envs=64, reward_fn=gentle, termination_fn=stuck)
envs.reset(seed=0)
total, ended = np.zeros(64), 0
for _ in range(200):
    _, reward, terminated, truncated, info = envs.step(np.zeros((64, 4), np.float32))
    total += reward
    ended += int(terminated.sum())
print(f"mean return {total.mean():.2f}, {ended} episodes ended")

# %% [markdown]
# The function is called with arrays of the whole batch, so that NumPy does the work. `info["reward_custom"]` holds the
# same values. What the functions can read:

# %%
for quantity in envs.unwrapped.layout["state"]:
    print(f"{quantity['name']:22s} {tuple(quantity['shape'])!s:10s} {quantity['unit']}")
envs.close()
