"""What has a policy learned? How it ends, which links push and when, its gait over time, and films of both ends.

    python -m training.evaluation.inspection --policy pretrained/field-hard.safetensors --out runs/inspect

Plays the policy and the scripted controllers of ``--beside`` on held-out fields of the policy's own task, prints how
episodes ended and the mean force of the pegs on each link, writes both as JSON, and draws: ``links.png``; and of one
success and one failure of each kind ``<kind>-frames.png`` with the forces, ``<kind>-timeline.png`` and ``<kind>.gif``.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

from training import rollout, seeds, tasks
from training.cli import answer, help_format, names
from training.evaluation import inspection_figures, video
from training.evaluation.evaluate import load_model, task
from training.evaluation.record_episodes import KINDS, Watch
from training.policies.interface import Policy
from training.policies.scripted import catalogue
from training.policies.scripted.senses import Array
from training.runs import write_json
from training.search.tune import GOAL

FRAMES = 4


def parser() -> argparse.ArgumentParser:
    """The command line."""
    cli = argparse.ArgumentParser("training.evaluation.inspection", description=__doc__, formatter_class=help_format)
    cli.add_argument("--policy", type=Path, required=True, help="policy.safetensors or model.zip of a run")
    cli.add_argument("--beside", type=names, default=["heading control"], help="scripted controllers, comma separated")
    cli.add_argument("--task", default="field-hard", help="task whose tuned numbers the controllers have")
    cli.add_argument("--fields", type=int, default=200, help="number of held-out fields")
    cli.add_argument("--num-threads", type=int, help="threads of the simulator")
    cli.add_argument("--out", type=Path, default=Path("runs/inspect"), help="folder for everything")
    return cli


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(parser(), inspect, arguments)


def inspect(args: argparse.Namespace) -> int:
    """Watches the policy and the controllers, counts and draws."""
    tasks.chosen([args.task])
    policy = load_model(args.policy, args.policy.stem)
    others: list[Policy] = [catalogue.tuned(title, args.task) for title in args.beside]
    env_id, options = task(None, {}, [args.policy])
    args.out.mkdir(parents=True, exist_ok=True)
    fields = seeds.held_out(args.fields)
    found = {one.name: watch(one, env_id, fields, args.num_threads, options) for one in (policy, *others)}
    inspection_figures.links({name: (one["ahead"], one["back"]) for name, one in found.items()}, args.out / "links.png")
    for name, one in found.items():
        print(f"{name}: " + ", ".join(f"{kind} {count}" for kind, count in one["ends"].items()))
    write_json(args.out / "inspection.json", {name: _plain(one) for name, one in found.items()})
    for k, kind in enumerate(KINDS):
        of_kind = np.flatnonzero(found[policy.name]["kind"] == k)
        if len(of_kind):
            show(policy, kind, env_id, fields[of_kind[0]], args.out, options)
    return 0


def watch(
    policy: Policy, env_id: str, fields: list[int], num_threads: int | None, options: dict[str, Any]
) -> dict[str, Any]:
    """How the episodes of a policy ended, and the mean forces on its links ahead and back (links,) [N]."""
    watched = Watch(policy)
    episodes = rollout.run_episodes(watched, env_id, fields, num_threads, **options)
    kind = watched.kinds(episodes, float(options.get("goal_distance", GOAL)))
    force: Array = np.array(watched.force)[watched.during(episodes)]
    ends = {name: int((kind == k).sum()) for k, name in enumerate(KINDS)}
    return {"ends": ends, "kind": kind, "ahead": np.maximum(force, 0).mean(0), "back": np.minimum(force, 0).mean(0)}


def _plain(found: dict[str, Any]) -> dict[str, Any]:
    """For JSON."""
    return {"ends": found["ends"], **{key: [round(float(f), 3) for f in found[key]] for key in ("ahead", "back")}}


def show(policy: Policy, kind: str, env_id: str, seed: int, out: Path, options: dict[str, Any]) -> None:
    """Frames, timeline and film of one episode."""
    episode = video.play(policy, env_id, seed, film=True, **options)
    layout = rollout.layout_of(env_id, options | policy.env_options)
    stem, title = kind.replace(",", "").replace(" ", "-"), f"{policy.name}, held-out field {seed}: {kind}"
    inspection_figures.frames(episode, title, FRAMES, out / f"{stem}-frames.png")
    inspection_figures.timeline(episode, layout, title, out / f"{stem}-timeline.png")
    print(video.write_small_gif(episode.frames, out / f"{stem}.gif"))


if __name__ == "__main__":
    sys.exit(main())
