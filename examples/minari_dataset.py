"""Episodes of the scripted gait as a Minari dataset, for offline learning.

    python examples/minari_dataset.py --dataset snake/field/gait-v0 --episodes 10

Minari records single environments; robots are independent of each other, so a seed of a batch gives the same episodes.
Needs "minari[create,hdf5]".
"""

from __future__ import annotations

import argparse

import gymnasium
import minari
import numpy as np

import snake_env


def record(dataset_id: str, env_id: str, episodes: int) -> minari.MinariDataset:
    """Plays action zero, the thesis's gait, and writes a dataset."""
    env = minari.DataCollector(gymnasium.make(env_id))
    action = np.zeros(env.action_space.shape, np.float32)
    for seed in range(episodes):
        env.reset(seed=seed)
        over = False
        while not over:
            _, _, terminated, truncated, _ = env.step(action)
            over = terminated or truncated
    dataset = env.create_dataset(
        dataset_id=dataset_id,
        algorithm_name="lateral undulation (7.3)",
        author="snake_env",
        code_permalink="examples/minari_dataset.py",
        description=f"{env_id}, snake_env {snake_env.__version__}",
    )
    env.close()
    return dataset


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dataset", default="snake/field/gait-v0")
    parser.add_argument("--env", default="SnakeField-v1")
    parser.add_argument("--episodes", type=int, default=10)
    args = parser.parse_args()
    dataset = record(args.dataset, args.env, args.episodes)
    print(f"{dataset.total_episodes} episodes, {dataset.total_steps} steps")


if __name__ == "__main__":
    main()
