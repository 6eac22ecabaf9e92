"""Train a policy, compare it with the scripted gaits, draw the figures and a video: what ``make train`` runs.

    python -m training pipeline
    python -m training pipeline --out runs/second --total-steps 30000000 --seed 1

Three stages: the search for the best gait (``gaits/``), training (``policy/``) and the evaluation (``evaluation.json``,
figures, video). The same command continues a stopped run: finished stages are not repeated, and training resumes from
its latest checkpoint, also for a larger ``--total-steps`` than it finished with; only the evaluation is always
repeated. The run starts over with ``--fresh``, or if configuration or seed differ from those of the run in the folder.
"""

from __future__ import annotations

import json
import shutil
import time
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from snake_env.evaluation import film, scores, seeds
from snake_env.evaluation.rollout import Episodes, run_episodes
from snake_env.policies.gaits import GaitParameters, GaitPolicy
from snake_env.policies.interface import Policy
from snake_env.policies.loading import load_policy
from training import config as configs
from training.config import Count, RunConfig, Seed
from training.evaluation import figures
from training.evaluation.report import FIELDS, report
from training.evaluation.report import film as film_of
from training.runs import RunFolder, StaleRun, sole_writer
from training.search import gait_search
from training.train import MODULES

PLAN = gait_search.PLAN


@dataclass
class Options:
    """The run.

    Args:
        out: Output folder.
        config: YAML or JSON file, or a name in training/configs.
        total_steps: Environment steps of training; overrides the configuration.
        seed: Seed of training; overrides the configuration.
        fields: Number of held-out fields in the evaluation.
        fresh: Start over even if the folder holds a matching run.
    """

    out: Path = Path("runs/train")
    config: Path = Path("default")
    total_steps: Count | None = None
    seed: Seed | None = None
    fields: Count = FIELDS
    fresh: bool = False


def run(args: Options) -> int:
    """Searches for the gait, trains, evaluates; returns 130 after a stop."""
    try:
        status = _stages(args)
    except KeyboardInterrupt:
        print()
        status = 130
    if status == 130:
        print(f"stopped; the same command{' without --fresh' if args.fresh else ''} continues")
    return status


def _stages(args: Options) -> int:
    changes = {name: value for name in ("total_steps", "seed") if (value := getattr(args, name)) is not None}
    config = configs.load(args.config).with_changes(**changes)
    with sole_writer(args.out):
        return _continued(args, config)


def _continued(args: Options, config: RunConfig) -> int:
    folder = RunFolder(args.out / "policy")
    if args.fresh or (folder.exists and not _holds(folder, config)):
        print(f"starting over in {args.out}")
        with sole_writer(folder.path):
            for name in ("policy", "gaits"):
                shutil.rmtree(args.out / name, ignore_errors=True)
    if folder.exists:
        folder.require_budget(config.total_steps)
    folder.create(config)
    start = time.monotonic()
    best = _gait_stage(args.out / "gaits", config)
    _say(start, f"best constant gait: {best}")
    if not folder.finished:
        status = _training_stage(folder, config)
        if status != 0:
            return status
    _say(start, "policy trained")
    _evaluation_stage(args.out, folder, config, best, args.fields)
    _say(start, f"everything is in {args.out}")
    return 0


def _holds(folder: RunFolder, wanted: RunConfig) -> bool:
    """Whether the folder's run has the wanted configuration; budget, threads and description may differ."""
    try:
        found = folder.config()
    except StaleRun:
        return False
    loose = {name: getattr(wanted, name) for name in (*RunConfig.ADJUSTABLE, "about")}
    return found.with_changes(**loose) == wanted


def _say(start: float, text: str) -> None:
    print(f"[{time.monotonic() - start:5.0f} s] {text}", flush=True)


def _gait_stage(out: Path, config: RunConfig) -> GaitParameters:
    """The best constant gait; searched for once."""
    found = out / "gaits.json"
    if not found.exists():
        print("searching for the best constant gait")
        options = {name: value for name, value in config.env.items() if name != "action_mode"}
        gait_search.write(gait_search.search(config.env_id, plan=PLAN, show=True, **options), out)
    return gait_search.gait(json.loads(found.read_text())["best"])


def _training_stage(folder: RunFolder, config: RunConfig) -> int:
    """Trains, from the latest checkpoint if there is one."""
    checkpoint = folder.latest()
    if checkpoint is not None:
        used = folder.seconds(checkpoint) / 60.0
        print(f"resuming after {int(checkpoint.stem)} steps and {used:.1f} minutes: {checkpoint}")
    with sole_writer(folder.path):
        status: int = import_module(MODULES[config.learner]).train(folder, config, True)
    return status


def _evaluation_stage(out: Path, folder: RunFolder, config: RunConfig, best: GaitParameters, fields: int) -> None:
    """Writes scores on held-out fields, figures and a video."""
    options = {name: value for name, value in config.env.items() if name != "action_mode"}
    thesis, tuned = GaitPolicy(GaitParameters(), "thesis gait"), GaitPolicy(best, "best gait")
    policies = [thesis, tuned, load_policy(folder.chosen, name="policy")]
    played = {one.name: run_episodes(one, config.env_id, seeds.held_out(fields), **options) for one in policies}
    rows = {name: scores.score(episodes) for name, episodes in played.items()}
    report(rows, played, out, {"env": config.env_id, "options": config.env, "fields": fields})
    print(scores.difference_text("policy", "best gait", scores.against(played["policy"], played["best gait"])))
    gaits = {name: row for name, row in rows.items() if name != "policy"}
    figures.learning_curve(folder.read_curve(), gaits, out / "learning-curve.png")
    figures.comparison(rows, out / "comparison.png")
    _draw_paths(policies, config, played, options, out / "paths.png")
    print(film_of(policies[-1], config.env_id, played["policy"], out / "policy", options))


def _draw_paths(
    policies: list[Policy], config: RunConfig, played: dict[str, Episodes], options: dict[str, Any], path: Path
) -> None:
    """The first held-out field that the policy passes and the thesis's gait does not, or else the first it passes."""
    passed, missed = played["policy"]["is_success"], ~played["thesis gait"]["is_success"]
    candidates = [*(passed & missed).nonzero()[0], *passed.nonzero()[0], 0]
    seed = seeds.HELD_OUT[int(candidates[0])]
    walks = {one.name: film.play(one, config.env_id, seed, **options) for one in policies}
    walk = next(iter(walks.values()))
    goal = float(walk.walk[0, 0]) + float(config.env.get("goal_distance", 2.0))
    figures.paths({name: one.walk for name, one in walks.items()}, walk.scene, goal, path)
