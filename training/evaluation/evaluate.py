"""Judge policies and scripted gaits on held-out fields.

    python -m training.evaluate --policy runs/mine/model.zip
    python -m training.evaluate --policy runs/lean/policy.safetensors
    python -m training.evaluate --gait thesis --video

Without ``--env`` the task is the one that the first policy was trained in. Every policy meets the same fields, none of
which training has seen. Prints success, progress, speed, time to the goal, share of jammed time, cost of transport and
share of robots that left the corridor, each with its 95 % bootstrap interval over fields, and writes them as JSON.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym

from snake_env import ConfigError
from training import seeds
from training.cli import answer, gait_from_text, help_format, json_mapping
from training.config import Config
from training.evaluation import scores, video
from training.policies.gaits import GaitParameters, scripted
from training.policies.interface import INTERFACE, Policy, title
from training.policies.network import Network
from training.policies.sb3_model import Model
from training.rollout import Episodes, layout_of, run_episodes
from training.runs import RunFolder, versions, write_json

FIELDS = 200
"""Held-out fields of a report."""


def parser() -> argparse.ArgumentParser:
    """The command line."""
    cli = argparse.ArgumentParser("training.evaluation.evaluate", description=__doc__, formatter_class=help_format)
    cli.add_argument(
        "--policy",
        "--model",
        dest="policy",
        type=Path,
        action="append",
        default=[],
        help="policy.safetensors or model.zip of a run; may be repeated",
    )
    cli.add_argument(
        "--gait",
        type=gait_from_text,
        action="append",
        default=[],
        help="'thesis' (used if none is given), or A,omega,beta in degrees and degrees per second; may be repeated",
    )
    cli.add_argument("--env", help="environment id; by default that of the first policy, or SnakeField-v0")
    cli.add_argument("--options", type=json_mapping, default={}, help="keywords of the environment, as JSON")
    cli.add_argument("--fields", type=int, default=FIELDS, help="number of held-out fields")
    cli.add_argument("--num-threads", type=int, help="threads of the simulator")
    cli.add_argument("--out", type=Path, default=Path("runs/evaluate"), help="folder for JSON and video")
    cli.add_argument("--video", action="store_true", help="film the last policy on the first field it passes")
    return cli


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(parser(), evaluate, arguments)


def evaluate(args: argparse.Namespace) -> int:
    """Plays all policies, prints and writes what came out."""
    args.env, args.options = task(args.env, args.options, args.policy)
    policies: list[Policy] = [gait_policy(gait, args.env, **args.options) for gait in args.gait or [GaitParameters()]]
    policies += load_models(args.policy)
    refuse_other_model(args.policy, args.env, args.options)
    for policy in policies:
        refuse_other_interface(policy, args.options)
    print(f"{args.env} {json.dumps(args.options)}, {args.fields} held-out fields")
    rows, played = {}, {}
    for policy in policies:
        played[policy.name] = run_episodes(
            policy, args.env, seeds.held_out(args.fields), args.num_threads, **args.options
        )
        rows[policy.name] = scores.score(played[policy.name])
    report(rows, played, args.out, {"env": args.env, "options": args.options, "fields": args.fields})
    if args.video:
        print(film(policies[-1], args.env, played[policies[-1].name], args.out / "episode", args.options))
    return 0


def refuse_other_interface(policy: Policy, options: dict[str, Any]) -> None:
    """Refuses keywords of the environment that a policy brings along and that were asked for otherwise.

    Raises:
        ConfigError: names the keyword.
    """
    for name in INTERFACE:
        own = policy.env_options.get(name)
        if own is not None and options.get(name, own) != own:
            raise ConfigError(f"options.{name}", options[name], f"{own}, which {policy.name} acts with")


def refuse_other_model(paths: list[Path], env_id: str, options: dict[str, Any]) -> None:
    """Refuses to play policies of the plane in space, and the other way round; gaits play in both.

    Raises:
        ConfigError: names the model and the policy.
    """
    here = _model(env_id, options)
    for path in paths:
        trained_in = _model(*_origin(path))
        if trained_in != here:
            expected = f"{trained_in}, which {path} was trained in; --env and the option model choose it"
            raise ConfigError("model", here, expected)


def _model(env_id: str, options: dict[str, Any]) -> str:
    """The robot's model in an environment with these keywords."""
    return str(options.get("model", gym.spec(env_id).kwargs.get("model", "planar")))


def task(env_id: str | None, options: dict[str, Any], paths: list[Path]) -> tuple[str, dict[str, Any]]:
    """Environment and keywords: those asked for, over those that the first policy was trained with."""
    if env_id is not None or not paths:
        return env_id or "SnakeField-v0", options
    env_id, trained_with = _origin(paths[0])
    of_task = {name: value for name, value in trained_with.items() if name not in INTERFACE}
    return env_id, of_task | options


def _origin(path: Path) -> tuple[str, dict[str, Any]]:
    """Environment and keywords of the run that a policy comes from."""
    if path.suffix == ".safetensors":
        found = Network(path).config
        return found["env_id"], found["env"]
    folder = RunFolder(path.parent)
    config = folder.config() if folder.exists else Config()
    return config.env_id, config.env


def gait_policy(gait: GaitParameters, env_id: str, **options: Any) -> Policy:
    """A gait as a policy for an environment with these keywords, named after its parameters."""
    name = "thesis gait" if gait == GaitParameters() else str(gait)
    return scripted(gait, layout_of(env_id, options | {"action_mode": "gait"})["action"], name)


def load_model(path: Path, name: str | None = None) -> Policy:
    """A trained policy, with those keywords of its run that belong to it; named by :func:`training.policies.title`.

    Raises:
        ConfigError: there is no such file, or it is of another kind.
    """
    if not path.is_file() or path.suffix not in (".safetensors", ".zip"):
        raise ConfigError("policy", path, "the policy.safetensors or model.zip of a run")
    if path.suffix == ".safetensors":
        return Network(path, name)
    return Model(path, name or title(path), _origin(path)[1])


def load_models(paths: list[Path]) -> list[Policy]:
    """Trained policies; those that would have one name are named by their paths."""
    titles = [title(path) for path in paths]
    return [load_model(path, str(path) if titles.count(title(path)) > 1 else None) for path in paths]


def report(rows: dict[str, scores.Row], played: dict[str, Episodes], out: Path, what: dict[str, Any]) -> None:
    """Prints the table and writes ``evaluation.json``; differences are to the first policy."""
    print(scores.table(rows))
    first, *others = rows
    differences = {name: scores.against(played[name], played[first]) for name in others}
    for name, difference in differences.items():
        print(scores.difference_text(name, first, difference))
    out.mkdir(parents=True, exist_ok=True)
    content = {
        **what,
        "seeds": f"{seeds.HELD_OUT.start} and on, one a field",
        "versions": versions(),
        "scores": {name: scores.plain(row) for name, row in rows.items()},
        f"against {first}": {name: scores.plain(row) for name, row in differences.items()},
    }
    write_json(out / "evaluation.json", content)


def film(policy: Policy, env_id: str, episodes: Episodes, path: Path, options: dict[str, Any]) -> Path:
    """A video of the first field that the policy passes, or of the first of all."""
    passed = episodes["is_success"].nonzero()[0]
    seed = seeds.HELD_OUT[int(passed[0]) if len(passed) else 0]
    return video.write(video.play(policy, env_id, seed, film=True, **options).frames, path)


if __name__ == "__main__":
    sys.exit(main())
