"""Enter policies into the benchmark: play them on test scenes and write a folder that can be replayed.

    python -m training submit --out submissions/mine --policy runs/sweep/mine/seed-0 --policy runs/sweep/mine/seed-1
    python -m training submit --out submissions/gait --policy gait --block joint_angle --robot-class aiko

The policies of an entry are runs of one configuration with different seeds: folders of runs, of which the best policy
on validation scenes is taken, files (.safetensors, .zip of Stable-Baselines3, .onnx), or one shipped or scripted policy
by name. Files are copied; those that would run code when they are read are refused. Episodes are kept in
runs/submissions: after Ctrl-C the same command continues. Then `python -m training leaderboard --write`.
"""

from __future__ import annotations

import json
import shutil
from dataclasses import dataclass
from pathlib import Path

import tyro

from snake_env import ConfigError
from snake_env.evaluation import tasks, tracks
from snake_env.policies import files
from snake_env.policies.loading import SCRIPTED, load_policy
from snake_env.policies.network import Network
from snake_env.policies.onnx_file import OnnxPolicy
from snake_env.policies.shipped import NAMES, policy_path
from training.config import Count
from training.evaluation import cached_scores
from training.evaluation.loading import trained_with
from training.runs import RunFolder, versions
from training.submission import ancestry, play
from training.submission.entry import Run, Submission, is_named, policy, write


@dataclass
class Options:
    """The entry.

    Args:
        out: Folder that is written; its name is that of the entry.
        policy: Folder of a run, file, or name; once for each training.
        robot_class: Class of robot.
        track: Track; by default the narrowest that admits what the policies observe.
        block: Of the observation, of gaits and scripted controllers; may be repeated. By default all.
        tasks: Of the benchmark; by default all of the policies' robot model.
        episodes: Test scenes of each policy in each task.
        about: One line; by default that of the policy.
        num_threads: Threads of the simulator.
    """

    out: Path
    policy: tyro.conf.UseAppendAction[tuple[str, ...]]
    robot_class: str = "ideal"
    track: str | None = None
    block: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    tasks: tuple[str, ...] | None = None
    episodes: Count = 200
    about: str = ""
    num_threads: int | None = None


def submit(args: Options) -> int:
    """Plays and writes an entry."""
    sources = [_source(one) for one in args.policy]
    if not sources:
        raise ConfigError("policy", "none", "at least one")
    env_options = {"observation_blocks": list(args.block)} if args.block else {}
    chosen = [play.task_of(name, args.robot_class) for name in args.tasks or _tasks(sources[0])]
    blocks = play.observed(sources[0], chosen, env_options)
    track = args.track or tracks.narrowest(blocks) or list(tracks.load())[-1]
    tracks.require(track, blocks)
    args.out.mkdir(parents=True, exist_ok=True)
    submission = Submission(
        about=args.about or getattr(getattr(load_policy(sources[0]), "card", None), "about", ""),
        robot_class=args.robot_class,
        track=track,
        blocks=tuple(blocks),
        env_options=env_options,
        episodes=args.episodes,
        versions=versions(),
        runs=tuple(_run(args.out, k, *one) for k, one in enumerate(zip(args.policy, sources, strict=True))),
    )
    scored = []
    for run in submission.runs:
        of_tasks = {}
        for task in chosen:
            acting = policy(args.out, run)
            found = play.summary(play.episodes(acting, submission, task, args.episodes, 0, args.num_threads))
            print(f"{args.out.name}, {task.name}: success {found.success:.3f}, {found.speed:.3f} m/s", flush=True)
            of_tasks[task.name] = found
        scored.append(run.with_changes(scores=of_tasks))
    write(args.out, submission.with_changes(runs=tuple(scored)))
    return 0


def _source(given: str) -> str:
    """A name, or the file of a policy; of a run the best one on validation scenes.

    Raises:
        ConfigError: the policy would run code when it is read.
    """
    if is_named(given):
        return given
    folder = RunFolder(Path(given))
    path = folder.chosen if folder.path.is_dir() else folder.path
    if not isinstance(load_policy(path), Network | OnnxPolicy):
        raise ConfigError("policy", str(path), "a file that runs no code when it is read")
    return str(path)


def _run(out: Path, number: int, given: str, source: str) -> Run:
    """A policy as an entry has it: named, or copied into its folder."""
    if is_named(source):
        config = files.read(policy_path(source))[1] if source in NAMES else {"steps": 0}
        return Run(policy=source, seed=config.get("seed"), steps=ancestry.steps(config))
    name, path = _copied(Path(source), out, number), Path(given)
    if not path.is_dir():
        config = files.read(path)[1] if path.suffix == ".safetensors" else {}
        return Run(policy=name, seed=config.get("seed"), steps=ancestry.steps(config))
    config = RunFolder(path).config().model_dump(mode="json")
    finished, machine = (json.loads((path / f"{one}.json").read_text()) for one in ("finished", "versions"))
    steps = ancestry.steps(config | {"steps": finished["steps"]})
    return Run(policy=name, seed=config["seed"], steps=steps, seconds=finished["seconds"], machine=machine)


def _copied(path: Path, out: Path, number: int) -> str:
    """Name of the copy of a policy in the folder."""
    found = load_policy(path)
    name = f"run-{number}{path.suffix if isinstance(found, OnnxPolicy) else '.safetensors'}"
    if isinstance(found, OnnxPolicy):
        shutil.copyfile(path, out / name)
    else:
        files.write(out / name, found.arrays, found.config)
    return name


def _tasks(name: str) -> list[str]:
    """All tasks of a policy's robot model outside the suite "ground"; of a scripted controller its tuned ones."""
    scripted = name in SCRIPTED
    model = trained_with(Path(name)) if Path(policy_path(name)).is_file() else "planar"
    return [
        task.name
        for task in tasks.load().values()
        if (cached_scores.tuning(name, task) if scripted else task.model == model and task.suite != "ground")
    ]
