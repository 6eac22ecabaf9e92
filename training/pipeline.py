"""Train a policy, compare it with the scripted gaits, draw the figures and a video: what ``make train`` runs.

    python -m training.pipeline
    python -m training.pipeline --out runs/second --max-minutes 30 --seed 1

Three stages, each kept in the folder when it is done: the search for the best gait (``gaits/``), training
(``policy/``) and the evaluation (``evaluation.json``, figures, video). A run that was killed goes on where it was:
finished stages are not repeated, and training continues from its latest checkpoint with the wall time it has
left. It begins anew with ``--fresh``, or by itself when configuration or seed are not those of the run in the
folder. The evaluation is always done again. Ctrl-C stops in any stage; the same command goes on.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import shutil
import sys
import time
from pathlib import Path
from typing import Any

from training import config as configs
from training import seeds
from training.cli import answer, help_format
from training.config import Config
from training.evaluation import figures, scores, video
from training.evaluation.evaluate import FIELDS, film, gait_policy, load_model, report
from training.learners import sb3 as training_stage
from training.policies.gaits import DEGREE, GaitParameters
from training.policies.interface import Policy
from training.rollout import Episodes, run_episodes
from training.runs import RunFolder
from training.search import compare_gaits
from training.search.gait_search import ROUNDS, grid, search


def parser() -> argparse.ArgumentParser:
    """The command line."""
    cli = argparse.ArgumentParser("training.pipeline", description=__doc__, formatter_class=help_format)
    cli.add_argument("--out", type=Path, default=Path("runs/train"), help="folder for everything")
    cli.add_argument(
        "--config", type=Path, default=Path("default"), help="YAML or JSON file, or a name in training/configs"
    )
    cli.add_argument("--max-minutes", type=float, help="wall time of training, over the config's")
    cli.add_argument("--seed", type=int, help="seed of training, over the config's")
    cli.add_argument("--fields", type=int, default=FIELDS, help="held-out fields of the evaluation")
    cli.add_argument("--fresh", action="store_true", help="begin anew, whatever is in the folder")
    return cli


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; 130 when it was stopped."""
    return answer(parser(), run, arguments)


def run(args: argparse.Namespace) -> int:
    """Searches the gait, trains, judges; 130 when it was stopped."""
    try:
        status = _stages(args)
    except KeyboardInterrupt:
        print()
        status = 130
    if status == 130:
        print(f"stopped; the same command{' without --fresh' if args.fresh else ''} goes on")
    return status


def _stages(args: argparse.Namespace) -> int:
    changes: dict[str, Any] = {
        name: getattr(args, name) for name in ("max_minutes", "seed") if getattr(args, name) is not None
    }
    config = dataclasses.replace(configs.load(args.config), **changes)
    config.refuse_evolution("training.pipeline")
    config.refuse("training.learners.sb3", *training_stage.LACKS)
    folder = RunFolder(args.out / "policy")
    if args.fresh or (folder.exists and not _same_run(folder.config(), config)):
        print(f"beginning anew in {args.out}")
        for name in ("policy", "gaits"):
            shutil.rmtree(args.out / name, ignore_errors=True)
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


def _same_run(found: Config, asked: Config) -> bool:
    """The folder's run is the one asked for; what is told about it, budget and threads may differ."""
    loose: dict[str, Any] = {
        "about": "",
        "max_minutes": None,
        "total_steps": 1,
        "num_threads": 1,
        "torch_threads": 1,
        "checkpoint_seconds": 1.0,
        "evolution": None,  # as in Config.refuse_evolution
    }
    return dataclasses.replace(found, **loose) == dataclasses.replace(asked, **loose)


def _say(start: float, text: str) -> None:
    print(f"[{time.monotonic() - start:5.0f} s] {text}", flush=True)


def _gait_stage(out: Path, config: Config) -> GaitParameters:
    """The best constant gait, searched for once."""
    found = out / "gaits.json"
    if not found.exists():
        print(f"searching {len(grid())} constant gaits")
        options = {name: value for name, value in config.env.items() if name != "action_mode"}
        compare_gaits.write(search(grid(), config.env_id, ROUNDS, show=True, **options), out)
    best = json.loads(found.read_text())["best"]
    return GaitParameters(best["amplitude"] * DEGREE, best["omega"] * DEGREE, best["beta"] * DEGREE)


def _training_stage(folder: RunFolder, config: Config) -> int:
    """Trains, or goes on from the latest checkpoint."""
    checkpoint = folder.latest()
    if checkpoint is not None:
        used = folder.seconds(checkpoint) / 60.0
        print(f"resuming after {int(checkpoint.stem)} steps and {used:.1f} minutes: {checkpoint}")
    return training_stage.train(folder, config)


def _evaluation_stage(out: Path, folder: RunFolder, config: Config, best: GaitParameters, fields: int) -> None:
    """Scores on held-out fields, figures and a video."""
    options = {name: value for name, value in config.env.items() if name != "action_mode"}
    thesis, tuned = (gait_policy(gait, config.env_id, **options) for gait in (GaitParameters(), best))
    thesis.name, tuned.name = "thesis gait", "best gait"
    policies = [thesis, tuned, load_model(folder.model, "policy")]
    played = {one.name: run_episodes(one, config.env_id, seeds.held_out(fields), **options) for one in policies}
    rows = {name: scores.score(episodes) for name, episodes in played.items()}
    report(rows, played, out, {"env": config.env_id, "options": config.env, "fields": fields})
    print(scores.difference_text("policy", "best gait", scores.against(played["policy"], played["best gait"])))
    gaits = {name: row for name, row in rows.items() if name != "policy"}
    figures.learning_curve(folder.read_curve(), gaits, out / "learning-curve.png")
    figures.comparison(rows, out / "comparison.png")
    _draw_paths(policies, config, played, options, out / "paths.png")
    print(film(policies[-1], config.env_id, played["policy"], out / "policy", options))


def _draw_paths(
    policies: list[Policy], config: Config, played: dict[str, Episodes], options: dict[str, Any], path: Path
) -> None:
    """The first held-out field that the policy passes and the thesis's gait does not, or else the first it passes."""
    passed, missed = played["policy"]["is_success"], ~played["thesis gait"]["is_success"]
    candidates = [*(passed & missed).nonzero()[0], *passed.nonzero()[0], 0]
    seed = seeds.HELD_OUT[int(candidates[0])]
    walks = {one.name: video.play(one, config.env_id, seed, **options) for one in policies}
    walk = next(iter(walks.values()))
    goal = float(walk.walk[0, 0]) + float(config.env.get("goal_distance", 2.0))
    figures.paths({name: one.walk for name, one in walks.items()}, walk.pegs, goal, path)


if __name__ == "__main__":
    sys.exit(main())
