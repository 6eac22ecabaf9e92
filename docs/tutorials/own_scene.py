# ---
# jupyter:
#   kernelspec: {display_name: Python 3, language: python, name: python3}
# ---

# %% [markdown]
# # Your own scene
#
# A scene is a list of obstacles and a ground. The same scene serves scripted runs and environments.

# %%
import gymnasium
import matplotlib.pyplot as plt
import numpy as np

import snake_env
from snake_env.obstacles import Box, Segment

# %% [markdown]
# A peg is a triple (radius, x, y) in metres. Here pegs alternate on both sides of the path.

# %%
x = np.arange(-1.3, 3.0, 0.33)
pegs = [(0.06, float(a), 0.20 * (-1.0) ** k) for k, a in enumerate(x)]
scene = snake_env.Scene(obstacles=pegs, friction=(0.2, 0.5))
run = snake_env.simulate(
    scene=scene,
    start=snake_env.Start(position=(0.0, 0.0), heading=np.pi, posture="straight"),
    duration=8.0,
    sample=0.05,
)
print(f"moved {np.linalg.norm(np.diff(run.position[[0, -1]].mean(axis=1), axis=0)):.2f} m")
print(f"deepest overlap {1e3 * run.max_penetration:.2f} mm")

# %% [markdown]
# The robot is straight at the start and free of the pegs; a start inside an obstacle is refused in environments, and
# `simulate` warns of it. `run` holds poses, joint angles, torques and contact forces.

# %%
figure, axes = plt.subplots(figsize=(8, 3))
for radius, px, py in pegs:
    axes.add_patch(plt.Circle((px, py), radius, color="0.6"))
for k, colour in ((0, "0.75"), (-1, "#009e73")):
    axes.plot(*run.position[k].T, "o-", color=colour)
axes.plot(*run.position.mean(axis=1).T, color="#0072b2", linewidth=1)
axes.set(aspect="equal", xlabel="x [m]", ylabel="y [m]", title="start (grey), end (green), path of the CG (blue)")
plt.show()

# %% [markdown]
# Walls are segments, boxes and convex polygons; they can have friction. `Scene.save` and `Scene.load` keep a scene in a
# JSON or YAML file.

# %%
room = snake_env.Scene(
    obstacles=[
        Segment((-1.6, 0.35), (2.5, 0.35)),
        Segment((-1.6, -0.35), (2.5, -0.35)),
        Box((0.2, 0.1), 1.2, 0.0, angle=0.6, friction=0.3),
    ],
    friction=(0.2, 0.5),
)
print(len(room.obstacles))

# %% [markdown]
# An environment takes a scene, a list of scenes, one of which is drawn for each episode, or a function that makes one,
# with a start and a goal of your own.


# %%
def slalom(rng, difficulty):
    """Pegs on both sides, at places that become irregular with difficulty."""
    shift = rng.uniform(-0.1, 0.1, (len(pegs), 2)) * difficulty
    moved = [(r, a + dx, b + dy) for (r, a, b), (dx, dy) in zip(pegs, shift, strict=True) if a > 0.4]
    return snake_env.Scene(obstacles=moved, friction=(0.2, 0.5))


envs = gymnasium.make_vec(
    "SnakeField-v1",
    num_envs=8,
    scene=slalom,
    difficulty=0.5,
    goal={"distance": 2.0, "centre_line": 0.0},
    corridor_half_width=1.0,
    render_mode="rgb_array",
)
envs.reset(seed=0)
for _ in range(60):
    envs.step(np.zeros((8, 4), np.float32))
plt.figure(figsize=(8, 4))
plt.imshow(envs.render()[0])
plt.axis("off")
plt.show()
envs.close()
