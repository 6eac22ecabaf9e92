"""What has a policy learned? How it ends, which links push and when, its gait over time, and films of both ends.

    python -m training inspect --policy pretrained/field-hard.safetensors --out runs/inspect

Plays the policy and the scripted controllers of ``--beside`` on held-out fields of the policy's own task, prints how
episodes ended and the mean force of the pegs on each link, writes both as JSON, and draws: ``links.png``; and of one
success and one failure of each kind ``<kind>-frames.png`` with the forces, ``<kind>-timeline.png`` and ``<kind>.gif``.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from training import rollout, seeds, tasks
from training.cli import answer
from training.evaluation import inspection_figures, video
from training.evaluation.loading import load_model, task
from training.evaluation.record_episodes import KINDS, RecordedPolicy
from training.policies.interface import Policy
from training.policies.scripted import catalogue
from training.policies.scripted.senses import Array
from training.runs import write_json
from training.tasks import GOAL

FRAMES = 4


@dataclass
class Options:
    """What is inspected.

    Args:
        policy: policy.safetensors or model.zip of a run.
        beside: Scripted controllers.
        task: Task for which the controllers are tuned.
        fields: Number of held-out fields.
        num_threads: Threads of the simulator.
        out: Folder for everything.
    """

    policy: Path
    beside: tuple[str, ...] = ("heading control",)
    task: str = "field-hard"
    fields: int = 200
    num_threads: int | None = None
    out: Path = Path("runs/inspect")


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, inspect, __doc__, arguments)


def inspect(args: Options) -> int:
    """Plays the policy and the controllers, counts and draws."""
    tasks.chosen([args.task])
    policy = load_model(args.policy, args.policy.stem)
    others: list[Policy] = [catalogue.tuned(title, args.task) for title in args.beside]
    env_id, options = task(None, {}, [args.policy])
    args.out.mkdir(parents=True, exist_ok=True)
    fields = seeds.held_out(args.fields)
    found = {one.name: record(one, env_id, fields, args.num_threads, options) for one in (policy, *others)}
    inspection_figures.links({name: (one["ahead"], one["back"]) for name, one in found.items()}, args.out / "links.png")
    for name, one in found.items():
        print(f"{name}: " + ", ".join(f"{kind} {count}" for kind, count in one["ends"].items()))
    write_json(args.out / "inspection.json", {name: _plain(one) for name, one in found.items()})
    for k, kind in enumerate(KINDS):
        of_kind = np.flatnonzero(found[policy.name]["kind"] == k)
        if len(of_kind):
            show(policy, kind, env_id, fields[of_kind[0]], args.out, options)
    return 0


def record(
    policy: Policy, env_id: str, fields: list[int], num_threads: int | None, options: dict[str, Any]
) -> dict[str, Any]:
    """How the episodes of a policy ended, and the mean forces on its links ahead and back (links,) [N]."""
    recorded = RecordedPolicy(policy)
    episodes = rollout.run_episodes(recorded, env_id, fields, num_threads, **options)
    kind = recorded.kinds(episodes, float(options.get("goal_distance", GOAL)))
    force: Array = np.array(recorded.force)[recorded.during(episodes)]
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
