# ---
# jupyter:
#   kernelspec: {display_name: Python 3, language: python, name: python3}
# ---

# %% [markdown]
# # Evaluate and report
#
# Results of learning vary from scene to scene and from seed to seed. `snake_env.evaluation` plays any policy on the
# same test scenes and reports each score with its 95 % interval.

# %%
import matplotlib.pyplot as plt
import numpy as np

import snake_env
from snake_env.evaluation import evaluate

# %% [markdown]
# A policy is one that is shipped, one of your own, or a function from observations (n, o) to actions (n, a). Tasks have
# names; all take their scenes from the same range of seeds, which training does not touch.


# %%
def gait(observation):
    """Action zero, the baseline gait."""
    return np.zeros((len(observation), 4), np.float32)


SCENES = 60  # 500 for results that are reported
shipped = {
    name: evaluate(snake_env.load_policy(name), "field-hard", scenes=SCENES) for name in ("general", "field-hard")
}
results = {"gait": evaluate(gait, "field-hard", scenes=SCENES), **shipped}
for name, result in results.items():
    success, speed = result.scores["success"], result.scores["speed"]
    print(
        f"{name:11s} success {success.value:.2f} [{success.low:.2f}, {success.high:.2f}]  speed {speed.value:.3f} m/s"
    )

# %% [markdown]
# Episode k of every policy is on scene k. A paired difference is therefore far sharper than two intervals side by side.

# %%
for score, estimate in results["general"].against(results["field-hard"]).items():
    print(f"general - field-hard, {score}: {estimate.value:+.3f} [{estimate.low:+.3f}, {estimate.high:+.3f}]")

# %%
names = list(results)
figure, panels = plt.subplots(1, 2, figsize=(8, 2.6), constrained_layout=True)
for axes, score, unit in zip(panels, ("success", "speed"), ("", " [m/s]"), strict=True):
    found = [results[name].scores[score] for name in names]
    values = np.array([one.value for one in found])
    errors = np.abs(np.array([[one.low, one.high] for one in found]).T - values)
    axes.barh(names, values, xerr=errors, color=["0.7", "#009e73", "#0072b2"], capsize=3)
    axes.set(xlabel=score + unit)
plt.show()

# %% [markdown]
# `result.episodes` holds the last `info` of every episode, for questions of your own: how do failures end?

# %%
episodes = results["general"].episodes
failed = ~episodes["is_success"].astype(bool)
print(f"{failed.sum()} of {SCENES} fail, {episodes['left_corridor'][failed].sum():.0f} of them leave the corridor")

# %% [markdown]
# A policy that remembers something is a class with the members of `snake_env.policies.Policy`. This one steers against
# the mean heading of the last second; `layout` says where the heading stands in the observation.


# %%
class Steered(snake_env.policies.Policy):
    """The baseline gait, whose offset turns the robot back towards the goal."""

    name = "steered gait"
    env_options = {"action_mode": "gait", "perception": "blind"}  # noqa: RUF012, what the environment must be made with

    def begin(self, layout, num_envs):
        """Called once, before the first observations."""
        blocks = {block["name"]: block for block in layout["observation"]}
        self.sine = blocks["heading"]["start"] + blocks["heading"]["elements"].index("sin")
        self.mean = np.zeros(num_envs)

    def reset(self, rows):
        """Called for robots whose next observation begins an episode."""
        self.mean[rows] = 0.0

    def __call__(self, observation):
        """Actions for observations, robot by robot."""
        self.mean += 0.05 * (observation[:, self.sine] - self.mean)
        action = np.zeros((len(observation), 4), np.float32)
        action[:, 3] = np.clip(2.0 * self.mean, -1.0, 1.0)
        return action


print(evaluate(Steered(), "field-hard", scenes=20))

# %% [markdown]
# In a report give the environment id, the version of the package, the number of scenes and of training seeds, and
# success and speed with their intervals. `snake-env evaluate --policy FILE` prints the same table
# for a `policy.safetensors` of `python -m training`.
