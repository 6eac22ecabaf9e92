# ---
# jupyter:
#   kernelspec: {display_name: Python 3, language: python, name: python3}
# ---

# %% [markdown]
# # The robot in 3D
#
# In the spatial model joints bend sideways (yaw) and up and down (pitch). Links lift off, roll, and press on the ground
# with forces of their own.

# %%
import gymnasium
import matplotlib.pyplot as plt
import numpy as np

import snake_env
from snake_env import Gait, Scene, Start
from snake_env.obstacles import Box

# %% [markdown]
# Sidewinding: a vertical wave a quarter period ahead of the horizontal one. The links that move are lifted, those on
# the ground rest.

# %%
run = snake_env.simulate(
    model="spatial", gait=Gait.sidewinding(), duration=10.0, sample=0.05, record=["ground", "velocity"]
)
way = run.position[-1].mean(axis=0) - run.position[0].mean(axis=0)
print(f"{np.hypot(*way[:2]):.2f} m in 10 s, at {np.degrees(np.arctan2(way[1], way[0])):.0f} degrees from the x axis")

# %%
loaded = run.ground_normal.sum(axis=2) > 0.0
speed = np.linalg.norm(run.velocity[..., :2], axis=2)
print(f"links on the ground: {loaded[20:].sum(axis=1).mean():.1f} of 11")
print(f"speed of loaded links {speed[20:][loaded[20:]].mean():.3f} m/s")
print(f"speed of lifted links {speed[20:][~loaded[20:]].mean():.3f} m/s")

figure, panels = plt.subplots(2, 1, figsize=(8, 5), constrained_layout=True)
height = run.position[..., 2] - run.position[..., 2].min()
panels[0].imshow(1e3 * height.T, aspect="auto", extent=(0, 10, 11.5, 0.5), cmap="cividis")
panels[0].set(title="height of the links above their lowest place [mm]", ylabel="link", xlabel="time [s]")
for k in range(0, 201, 50):
    panels[1].plot(run.position[k, :, 0], run.position[k, :, 1], "o-", markersize=3, label=f"{run.time[k]:.1f} s")
panels[1].set(aspect="equal", xlabel="x [m]", ylabel="y [m]", title="from above")
panels[1].legend(ncols=5, fontsize=7)
plt.show()

# %% [markdown]
# Rolling: both waves alike, without a phase shift along the body. It bends to an arc and turns about its own axis.

# %%
rolling = snake_env.simulate(model="spatial", gait=Gait.lateral_rolling(), duration=6.0, sample=0.05)
way = rolling.position[-1].mean(axis=0) - rolling.position[0].mean(axis=0)
print(f"rolls {np.hypot(*way[:2]):.2f} m in 6 s")

# %% [markdown]
# Obstacles of finite height carry links on their top faces: a step of 5 cm.

# %%
step = Scene(obstacles=[Box((1.0, 2.0), 0.9, 0.0, height=0.05)])
fall = snake_env.simulate(
    model="spatial",
    scene=step,
    gait=Gait(amplitude=0.0),
    start=Start(position=(0.6, 0.0, 0.3), posture="straight"),
    duration=1.0,
    sample=0.02,
)
print(f"highest link {fall.position[-1, :, 2].max():.3f} m, lowest {fall.position[-1, :, 2].min():.3f} m")

# %% [markdown]
# The environment `SnakeSpatial-v1` has the same model; `task=` puts the robot into any scene of the planar ones.

# %%
envs = gymnasium.make_vec("SnakeSpatial-v1", num_envs=4, render_mode="rgb_array")
envs.reset(seed=0)
for _ in range(60):
    envs.step(np.zeros((4, 6), np.float32))
plt.figure(figsize=(8, 5))
plt.imshow(envs.render()[0])
plt.axis("off")
plt.show()
envs.close()

# %% [markdown]
# `run.view()` opens a run in the browser; `run.save("run.html")` writes a page that needs no server.
