"""Train a policy with PPO of Stable-Baselines3, in settings that suit the fields, or with RLlib on a Ray cluster.

    snake-env train
    snake-env train --task maze --steps 2000000 --out runs/maze/model.zip
    snake-env train --ray 4 --out model.safetensors     # four processes with a batch each

It does what these lines of Python do, where callbacks, other settings and other algorithms have their place:

    venv = snake_env.sb3.make("SnakeField-v1", num_envs=64, seed=0, difficulty=0.5)
    model = PPO("MlpPolicy", venv, n_steps=32, batch_size=512, gamma=0.995, seed=0)
    model.learn(500_000)
    model.save("model.zip")

Beside the model a JSON file names the environment, which other commands then take by default. With --ray the settings
are those of snake_env.rllib.settings, and the policy is a file of this package.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from snake_env import _documents
from snake_env._checks import integer
from snake_env._cli import parser
from snake_env._extras import extras
from snake_env._files import replace, write_json
from snake_env.commands.arguments import add_task
from snake_env.errors import ConfigError
from snake_env.evaluation.tasks import BenchmarkTask, acting_in


def main(arguments: list[str]) -> int:
    """Runs the command."""
    cli = parser("train", __doc__)
    add_task(cli)
    cli.add_argument("--steps", type=int, default=500_000, help="environment steps (default 500,000)")
    cli.add_argument("--num-envs", type=int, default=64, help="robots (default 64)")
    cli.add_argument("--seed", type=int, default=0, help="of robots and networks (default 0)")
    cli.add_argument("--ray", type=int, metavar="RUNNERS", help="train with RLlib; so many processes step a batch each")
    cli.add_argument("--out", type=Path, help="file of the model (default model.zip, with --ray model.safetensors)")
    args = cli.parse_args(arguments)
    for name in ("steps", "num_envs"):
        integer(name, getattr(args, name), 1)
    _, task = acting_in(lambda observation: observation, args.env or args.task, options=args.options)
    if args.ray is not None:
        return _with_ray(args, task)
    args.out = args.out or Path("model.zip")
    out = args.out if args.out.suffix == ".zip" else args.out.with_name(f"{args.out.name}.zip")
    beside = out.with_suffix(".json")
    if beside.exists() and not _is_own(beside):
        raise ConfigError("out", str(out), f"a name without another {beside.name} beside it")
    with extras():
        import torch
        from stable_baselines3 import PPO

        from snake_env import sb3

    torch.set_num_threads(1)  # a second thread often slows down a network this small
    venv = sb3.make(task.env_id, args.num_envs, seed=args.seed, **task.options)
    model = PPO("MlpPolicy", venv, n_steps=32, batch_size=512, gamma=0.995, seed=args.seed, verbose=1, device="cpu")
    model.learn(args.steps)
    out.parent.mkdir(parents=True, exist_ok=True)
    replace(out, model.save)
    write_json(beside, {"env_id": task.env_id, "env_options": task.options, "steps": args.steps})
    _say(out)
    return 0


def _with_ray(args: argparse.Namespace, task: BenchmarkTask) -> int:
    integer("ray", args.ray, 0)
    out = (args.out or Path("model")).with_suffix(".safetensors")
    from snake_env import rllib
    from snake_env.policies import rllib_module

    config = rllib.settings(task.env_id, args.ray, args.num_envs, seed=args.seed, **task.options)
    algorithm = rllib.train(config, args.steps)
    out.parent.mkdir(parents=True, exist_ok=True)
    rllib_module.save(algorithm, out, {"env_id": task.env_id, "env": task.options, "about": "PPO of RLlib"})
    algorithm.stop()
    _say(out)
    return 0


def _say(out: Path) -> None:
    print(f"{out}\nnext: snake-env view --policy {out}\n      snake-env evaluate --policy {out}")


def _is_own(path: Path) -> bool:
    """An earlier run of this command has written the file."""
    try:
        return set(_documents.read(path)) == {"env_id", "env_options", "steps"}
    except (OSError, TypeError, ValueError):
        return False
