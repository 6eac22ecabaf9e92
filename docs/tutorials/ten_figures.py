# ---
# jupyter:
#   kernelspec: {display_name: Python 3, language: python, name: python3}
# ---

# %% [markdown]
# # The thesis in ten figures
#
# A. A. Transeth, *Modelling and Control of Snake Robots* (NTNU 2007). This notebook computes the ten figures of
# [the page with the same name](../../thesis-in-ten-figures/), which explains them, from scratch. `Runs` simulates what
# a figure needs, once; the table compares each number with the words of the thesis.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

from snake_env.reproduce.command import findings
from snake_env.reproduce.experiment import Runs
from snake_env.reproduce.experiments import experiments
from snake_env.reproduce.figures import FIGURES

runs = Runs(experiments(), "implicit")
folder = Path(tempfile.mkdtemp())


def show(name):
    """Computes a figure, and shows it."""
    _, draw = FIGURES[name]
    plt.figure(figsize=(9, 6))
    plt.imshow(plt.imread(draw(runs, folder / name)))
    plt.axis("off")
    plt.show()


def compare(*sections):
    """Prints what the thesis says and what is found."""
    for found in findings(runs, sections):
        print(found)


# %% [markdown]
# ## 1. Why pushing sideways moves a robot forward

# %%
show("figure-5.2.png")
compare("5.3")

# %% [markdown]
# ## 2. Obstacle-aided locomotion

# %%
show("figure-7.7.png")

# %% [markdown]
# ## 3. A wave needs something to push against

# %%
show("figure-2.3.2-models.png")

# %% [markdown]
# ## 4. Many gaits from two waves

# %%
show("gaits.png")

# %% [markdown]
# ## 5. A fall

# %%
show("figure-7.2.png")

# %% [markdown]
# ## 6. Rolling

# %%
show("figure-7.4.png")

# %% [markdown]
# ## 7. Sidewinding

# %%
show("figure-7.12.png")

# %% [markdown]
# ## 8. A model and its robot

# %%
show("figure-7.13.png")

# %% [markdown]
# ## 9. Two controllers

# %%
show("figure-7.10.png")

# %% [markdown]
# ## 10. A theorem and its domain

# %%
show("figure-6.3.3-theorem.png")
compare("6.3.3")
