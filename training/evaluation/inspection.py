"""Inspect a policy: how episodes end, which links push and when, gait over time, films of successes and failures.

    python -m training inspect --policy field-hard --out runs/inspect

Plays the policy and the scripted controllers of ``--beside`` on held-out fields of the policy's own task. Prints the
counts of outcomes and, of a policy that commands a wave, the 10 %, 50 % and 90 % quantiles of its parameters and the
speed at which the wave of the medians would move without slip. Writes these and the mean force of the pegs on each link
as JSON; draws ``links.png`` and, for the first episode of each outcome, ``<outcome>-frames.png`` with the forces,
``<outcome>-timeline.png`` and ``<outcome>.gif``.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from snake_env._files import write_json
from snake_env.evaluation import film, rollout, seeds, tasks
from snake_env.evaluation.rollout import Episodes
from snake_env.evaluation.tasks import GOAL
from snake_env.policies.gaits import DEGREE, GaitParameters
from snake_env.policies.interface import Policy
from snake_env.policies.loading import load_policy
from snake_env.policies.scripted import catalogue
from snake_env.policies.scripted.sensors import Array
from training.config import Count
from training.evaluation import inspection_figures, video
from training.evaluation.loading import task
from training.evaluation.record_episodes import KINDS, RecordedPolicy
from training.evaluation.reference_limits import no_slip_speed

FRAMES = 4

QUANTILES = (0.1, 0.5, 0.9)


@dataclass
class Options:
    """Policies, task and output.

    Args:
        policy: policy.safetensors or model.zip of a run.
        beside: Scripted controllers to compare with.
        task: Task for which the controllers are tuned.
        fields: Number of held-out fields.
        num_threads: Threads of the simulator.
        out: Output folder.
    """

    policy: Path
    beside: tuple[str, ...] = ("heading control",)
    task: str = "field-hard"
    fields: Count = 200
    num_threads: int | None = None
    out: Path = Path("runs/inspect")


def inspect(args: Options) -> int:
    """Plays the policy and the controllers, counts and draws."""
    tasks.chosen([args.task])
    policy = load_policy(args.policy, name=args.policy.stem)
    others: list[Policy] = [catalogue.tuned(title, args.task) for title in args.beside]
    env_id, options = task(None, {}, [args.policy])
    args.out.mkdir(parents=True, exist_ok=True)
    fields = seeds.held_out(args.fields)
    found = {one.name: record(one, env_id, fields, args.num_threads, options) for one in (policy, *others)}
    inspection_figures.links({name: (one["ahead"], one["back"]) for name, one in found.items()}, args.out / "links.png")
    for name, one in found.items():
        print(f"{name}: " + ", ".join(f"{kind} {count}" for kind, count in one["ends"].items()))
        print("".join(f"  {what}: {text}\n" for what, text in _told(one).items()), end="")
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
    ahead, back = np.maximum(force, 0).mean(0), np.minimum(force, 0).mean(0)
    return {"ends": ends, "kind": kind, "ahead": ahead, "back": back, "speed": float(episodes["speed"].mean())} | waves(
        recorded, episodes
    )


def waves(recorded: RecordedPolicy, episodes: Episodes) -> dict[str, Any]:
    """Quantiles of the parameters of the wave [deg, deg/s], and the speed of that of the medians without slip [m/s]."""
    names, during = recorded.wave[0], recorded.during(episodes)
    if not names:
        return {}
    of = {name: np.quantile(np.array([one[name] for one in recorded.wave])[during], QUANTILES) for name in names}
    amplitude, omega, beta = (of[name][1] * DEGREE for name in ("amplitude", "frequency", "phase shift"))
    return {"wave": of, "no_slip_speed": no_slip_speed(GaitParameters(amplitude, omega, beta))}


def _told(found: dict[str, Any]) -> dict[str, str]:
    """Lines about the wave of a policy that commands one."""
    if "wave" not in found:
        return {}
    lines = {name: ", ".join(f"{value:.1f}" for value in values) for name, values in found["wave"].items()}
    return lines | {"speed": f"{found['speed']:.3f} m/s, {found['no_slip_speed']:.3f} without slip"}


def _plain(found: dict[str, Any]) -> dict[str, Any]:
    """For JSON."""
    plain: dict[str, Any] = {key: [round(float(f), 3) for f in found[key]] for key in ("ahead", "back")}
    if "wave" in found:
        quantiles = {name: [round(float(value), 1) for value in values] for name, values in found["wave"].items()}
        plain |= {"wave": quantiles, "no_slip_speed": round(found["no_slip_speed"], 3)}
    return {"ends": found["ends"], "speed": round(found["speed"], 3), **plain}


def show(policy: Policy, kind: str, env_id: str, seed: int, out: Path, options: dict[str, Any]) -> None:
    """Frames, timeline and film of one episode."""
    episode = film.play(policy, env_id, seed, render_mode="rgb_array", **(options | {"picture": video.STILL}))
    layout = rollout.layout_of(env_id, options | policy.env_options)
    stem = kind.replace(",", "").replace(" ", "-")
    title = f"{policy.name}, held-out field {seed - seeds.HELD_OUT.start}: {kind}"
    inspection_figures.frames(episode, title, FRAMES, out / f"{stem}-frames.png")
    inspection_figures.timeline(episode, layout, title, out / f"{stem}-timeline.png")
    print(video.write_small_gif(episode.frames, out / f"{stem}.gif"))
