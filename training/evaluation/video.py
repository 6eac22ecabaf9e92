"""Film an episode.

python -m training video --policy pretrained/field-hard.safetensors --seed 8589934600 --out runs/film
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from training import seeds
from training.cli import answer
from training.config import JsonObject
from training.evaluation import loading
from training.policies.gaits import GaitParameters
from training.policies.interface import Policy
from training.rollout import make_env

if TYPE_CHECKING:
    from PIL import Image


@dataclass
class Options:
    """What is filmed.

    Args:
        policy: policy.safetensors or model.zip of a run; None: the thesis's gait.
        env: Environment; by default that of the policy, or SnakeField-v0.
        options: Keywords of the environment.
        seed: Of the episode; by default the first held-out one.
        out: File without its suffix, mp4 or, without ffmpeg, gif.
    """

    policy: Path | None = None
    env: str | None = None
    options: JsonObject = field(default_factory=dict)
    seed: int = seeds.HELD_OUT.start
    out: Path = Path("runs/episode")


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(Options, film, __doc__, arguments)


def film(args: Options) -> int:
    """Plays and writes one episode."""
    paths = [] if args.policy is None else [args.policy]
    env_id, options = loading.task(args.env, args.options, paths)
    loading.refuse_other_model(paths, env_id, options)
    policies = loading.load_models(paths) or [loading.gait_policy(GaitParameters(), env_id, **options)]
    args.out.parent.mkdir(parents=True, exist_ok=True)
    print(write(play(policies[0], env_id, args.seed, film=True, **options).frames, args.out))
    return 0


class Episode(NamedTuple):
    """One robot's way through one field.

    Attributes:
        walk: (T, 2) CG at each control instant, from the start to the end [m].
        pegs: (p, 3) radius, x, y [m].
        frames: pictures, empty unless asked for.
        success: the goal was reached.
        snapshots: what the renderer draws, at each control instant.
        observations: (T, o) what the policy saw.
    """

    walk: NDArray[np.float64]
    pegs: NDArray[np.float64]
    frames: list[NDArray[np.uint8]]
    success: bool
    snapshots: list[dict[str, Any]]
    observations: NDArray[np.float32]


def play(policy: Policy, env_id: str, seed: int, film: bool = False, **options: Any) -> Episode:
    """Plays the first episode of a seed.

    Args:
        policy: acts.
        env_id: environment.
        seed: of the field.
        film: keep a picture of every control instant.
        **options: keywords of the environment, under those of the policy.
    """
    mode = "rgb_array" if film else None
    env = make_env(env_id, 1, 1, render_mode=mode, **(options | policy.env_options))
    observation, _ = env.reset(seed=[seed])
    policy.begin(env.unwrapped.layout, 1)
    snapshots, observations, frames, ended = [], [], [], False
    success = False

    def note() -> None:
        snapshots.append(env.unwrapped.snapshot(0))
        observations.append(observation[0].copy())
        if film:
            frames.append(env.render()[0])

    note()
    while not ended:
        observation, _, terminated, truncated, infos = env.step(policy(observation))
        ended, success = bool(terminated[0] or truncated[0]), bool(infos["is_success"][0])
        note()
    env.close()
    walk = np.array([one["centre"] for one in snapshots])
    return Episode(walk, np.array(snapshots[0]["pegs"]), frames, success, snapshots, np.array(observations))


def write(frames: list[NDArray[np.uint8]], path: Path, frames_per_second: int = 20) -> Path:
    """Writes an mp4 file, or a gif where no ffmpeg is found; returns what was written."""
    import imageio

    try:
        with imageio.get_writer(path.with_suffix(".mp4"), fps=frames_per_second, macro_block_size=8) as writer:
            for frame in frames:
                writer.append_data(frame)  # type: ignore[attr-defined]
        return path.with_suffix(".mp4")
    except (ImportError, OSError, ValueError) as error:
        path.with_suffix(".mp4").unlink(missing_ok=True)
        print(f"no mp4 ({error}); writing a gif")
        half = [frame[::2, ::2] for frame in frames[::2]]
        imageio.mimsave(path.with_suffix(".gif"), list(half), duration=2000 / frames_per_second, loop=0)
        return path.with_suffix(".gif")


def write_small_gif(frames: list[NDArray[np.uint8]], path: Path, width: int = 360) -> Path:
    """Writes every third frame and the last, all in the same few colours, some hundreds of kilobytes for an episode."""
    from PIL import Image

    height = round(width * frames[0].shape[0] / frames[0].shape[1])
    shown = [*frames[:-1:3], frames[-1]]
    small = [Image.fromarray(frame).resize((width, height), Image.Resampling.BOX) for frame in shown]
    palette = _palette(small)
    film = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in small]
    film[0].save(path, save_all=True, append_images=film[1:], duration=150, loop=0, optimize=False)
    return path


def _palette(pictures: list[Image.Image], common: int = 8, rare: int = 16, sampled: int = 16) -> Image.Image:
    """The colours of a whole film, found in pictures along it.

    The common ones tell the faint grid from the ground, wherever its lines fall between pixels; the rare ones are as
    different as can be, so that forces, goal and head keep theirs.
    """
    from PIL import Image

    along = np.linspace(0, len(pictures) - 1, sampled).round().astype(int)
    seen = Image.fromarray(np.concatenate([pictures[k] for k in along]))
    ways = (common, Image.Quantize.MEDIANCUT), (rare, Image.Quantize.MAXCOVERAGE)
    palettes = [(seen.quantize(n, way, kmeans=3).getpalette() or [])[: 3 * n] for n, way in ways]
    found = Image.new("P", (1, 1))
    found.putpalette([value for palette in palettes for value in palette])
    return found


if __name__ == "__main__":
    sys.exit(main())
