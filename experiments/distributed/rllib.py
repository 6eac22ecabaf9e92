"""RLlib's PPO over the native batch of robots, from the configurations of the other learners.

    python -m experiments.distributed.rllib --runners 2 --config field-hard --out runs/rllib
    python -m experiments.distributed.rllib --address auto --runners 64 --num-envs 16384 --out runs/large

Each environment runner of RLlib has a batch of robots of its own, on whatever node Ray puts it; --num-threads counts
the threads and CPUs of a runner. Ctrl-C saves and stops, ``--resume`` goes on from the latest checkpoint. At the end
the folder holds ``policy.safetensors``. ``experiments/distributed/ppo.py`` is the faster of the two on a cluster. Needs
the dependency group ``rllib``.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
import tyro
from pydantic import field_validator

from experiments.distributed import cluster
from snake_env import ConfigError
from snake_env.evaluation import seeds
from snake_env.policies import files
from training.budget import Budget, Interval, StopRequest
from training.config import LEARNERS, Count, Networks, Ppo, RunConfig, load_as
from training.learning_curve import EPISODES, SIGNALS, text
from training.runs import RunFolder
from training.train import Options, command


class RllibConfig(RunConfig):
    """A run of RLlib's PPO."""

    learner: Annotated[Literal["rllib"], tyro.conf.Suppress] = "rllib"
    policy: Networks = Networks()
    ppo: Ppo = Ppo()

    @field_validator("ppo")
    @classmethod
    def _no_target(cls, ppo: Ppo) -> Ppo:
        if ppo.target_kl is not None:
            raise ConfigError("ppo.target_kl", ppo.target_kl, "none, RLlib's PPO does not have it")
        return ppo


LEARNERS["rllib"] = RllibConfig


def settings(config: RllibConfig, runners: int) -> Any:
    """RLlib's configuration of a run.

    The robots are reset in the step after the one that ends an episode (Gymnasium's next-step mode), which is the
    one RLlib expects; with same-step resets it would take the first observation of an episode for the last of the
    one before, without an error.

    Args:
        config: of the run.
        runners: environment runners, each with an equal share of the robots.

    Returns:
        A ``ray.rllib.algorithms.ppo.PPOConfig``.

    Raises:
        ConfigError: the robots cannot be shared evenly, or the run uses an option that RLlib's PPO does not have.
    """
    from ray.rllib.algorithms.ppo import PPOConfig
    from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig

    if runners < 1 or config.num_envs % runners:
        raise ConfigError("runners", runners, f"a divisor of num_envs = {config.num_envs}")
    ppo = config.ppo
    rates = [[0, ppo.learning_rate], [config.total_steps, ppo.learning_rate * ppo.final_learning_rate]]
    return (
        PPOConfig()
        .environment(
            f"snake_env:{config.env_id}",
            env_config={"num_threads": config.num_threads, **config.env, "autoreset_mode": "NextStep"},
        )
        .env_runners(
            num_env_runners=runners,
            num_envs_per_env_runner=config.num_envs // runners,
            num_cpus_per_env_runner=config.num_threads,
            gym_env_vectorize_mode="vector_entry_point",
            rollout_fragment_length=ppo.n_steps,
        )
        .training(
            lr=rates,
            gamma=ppo.gamma,
            lambda_=ppo.gae_lambda,
            use_kl_loss=False,
            clip_param=ppo.clip_range,
            entropy_coeff=ppo.ent_coef,
            vf_loss_coeff=ppo.vf_coef,
            vf_clip_param=float("inf"),
            grad_clip=ppo.max_grad_norm,
            grad_clip_by="global_norm",
            num_epochs=ppo.n_epochs,
            minibatch_size=ppo.batch_size,
            train_batch_size_per_learner=ppo.n_steps * config.num_envs,
        )
        .rl_module(
            model_config=DefaultModelConfig(
                fcnet_hiddens=list(config.policy.hidden),
                fcnet_activation="tanh",
                head_fcnet_hiddens=[],
                vf_share_layers=False,
                free_log_std=True,
            )
        )
        .callbacks(on_episode_end=note_signals)
        .debugging(seed=seeds.training(config.seed, 0, config.num_envs))
    )


def note_signals(episode: Any, metrics_logger: Any, **_: Any) -> None:
    """Logs the signals of an episode's last step, as RLlib's callback ``on_episode_end``."""
    last = episode.get_infos(-1)
    for name in SIGNALS:
        metrics_logger.log_value(name, float(last[name]), window=EPISODES)


def actor(weights: dict[str, Any]) -> files.Arrays:
    """The layers of the actor of RLlib's module, numbered as :class:`snake_env.policies.Network` has them."""
    layers = [name.removesuffix(".weight") for name in weights if name.startswith("encoder.actor_encoder.net")]
    order = [name for name in layers if not name.endswith(".bias")] + ["pi.net.mlp.0"]
    return {
        f"actor.{k}.{part}": np.asarray(weights[f"{layer}.{part}"], np.float32)
        for k, layer in enumerate(order)
        for part in ("weight", "bias")
    }


def train(folder: RunFolder, config: RllibConfig, show: bool, runners: int) -> int:
    """Trains from the folder's latest checkpoint, or from the start; 130 when it was stopped."""
    saved = folder.path / "algorithm"
    algorithm = settings(config, runners).build_algo()
    seconds = 0.0
    if saved.exists():
        with folder.resumed():
            algorithm.restore_from_path(str(saved.resolve()))
        seconds = folder.read_curve()[-1]["seconds"]
    steps = int(folder.read_curve()[-1]["steps"]) if saved.exists() else 0
    budget = Budget(config.total_steps, steps, seconds)
    checkpoints = Interval(config.checkpoint_steps, steps)
    with StopRequest() as stop:
        while True:
            row = curve_row(algorithm.train(), budget)
            budget.note(int(row["steps"]))
            folder.append_curve(row)
            if show:
                print(text(row), flush=True)
            ends = stop.received or budget.used >= 1.0
            if checkpoints.due(int(row["steps"])) or ends:
                algorithm.save_to_path(str(saved.resolve()))
            if ends:
                break
    weights = algorithm.get_module().get_state()
    policy = folder.path / files.NAME
    files.write(policy, actor(weights), config.model_dump(mode="json") | {"steps": int(row["steps"])})
    algorithm.stop()
    if stop.received:
        print(f"saved after {row['steps']:.0f} steps")
        return 130
    folder.finish({"steps": row["steps"], "seconds": row["seconds"]})
    return 0


def curve_row(result: dict[str, Any], budget: Budget) -> dict[str, float]:
    """A line of the learning curve from RLlib's result of an update."""
    found = result["env_runners"]
    row: dict[str, float] = {
        "steps": int(found["num_env_steps_sampled_lifetime"]),
        "seconds": round(budget.seconds, 2),
        "steps_per_second": round(found["num_env_steps_sampled"] / result["time_this_iter_s"]),
    }
    means = {"return": found.get("episode_return_mean"), **{name: found.get(name) for name in SIGNALS}}
    # No episode may have ended.
    return row | {name: round(float(mean), 4) for name, mean in means.items() if mean is not None and mean == mean}


@dataclass
class RllibOptions(Options):
    """Which run, and where.

    Args:
        runners: Environment runners, each with an equal share of the robots.
        address: Of a running cluster, or 'auto'; None: Ray starts on this machine.
    """

    runners: Count = 2
    address: str | None = None


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; 0 when the budget is used up, 130 when it was stopped, 2 without RLlib."""
    return command(RllibOptions, __doc__, arguments, lambda one: load_as(RllibConfig, one.config), begin)


def begin(options: RllibOptions, folder: RunFolder, config: RllibConfig) -> int:
    """Trains on the cluster."""
    cluster.require("rllib")
    cluster.join(options.address)
    return train(folder, config, options.bar, options.runners)


if __name__ == "__main__":
    sys.exit(main())
