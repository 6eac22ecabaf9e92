"""One episode of a policy: its states and pictures, and films of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snake_env._extras import extras
from snake_env._files import replace
from snake_env.config import Scene
from snake_env.errors import ConfigError
from snake_env.evaluation.rollout import make_env
from snake_env.evaluation.seeds import held_out
from snake_env.evaluation.tasks import acting_in
from snake_env.policies.interface import Policy, acting
from snake_env.state import State

if TYPE_CHECKING:
    from PIL import Image


class Episode(NamedTuple):
    """One robot's path through one field.

    Attributes:
        walk: (T, 2) CG at each control instant, from the start to the end [m].
        scene: pegs and ground.
        frames: pictures; empty unless requested.
        success: the goal was reached.
        states: at each control instant.
        observations: (T, o) what the policy saw.
    """

    walk: NDArray[np.float64]
    scene: Scene
    frames: list[NDArray[np.uint8]]
    success: bool
    states: list[State]
    observations: NDArray[np.float32]


def play(policy: Policy, env_id: str, seed: int, render_mode: str | None = None, **options: Any) -> Episode:
    """Plays the first episode of a seed.

    Args:
        policy: acts.
        env_id: environment.
        seed: of the field.
        render_mode: "rgb_array" keeps a picture of every control instant, "human" shows the episode in a window.
        **options: keywords of the environment, under those of the policy.
    """
    env = make_env(env_id, 1, 1, render_mode=render_mode, **acting(policy, options))
    observation, _ = env.reset(seed=[seed])
    policy.begin(env.unwrapped.layout, 1)
    states, observations, frames, ended = [], [], [], False
    success = False

    def note() -> None:
        states.append(env.unwrapped.state().robot(0))
        observations.append(observation[0].copy())
        if render_mode == "rgb_array":
            frames.append(env.render()[0])

    note()
    scene = env.unwrapped.scene(0)
    while not ended:
        observation, _, terminated, truncated, infos = env.step(policy(observation))
        ended, success = bool(terminated[0] or truncated[0]), bool(infos["is_success"][0])
        note()
    env.close()
    walk = np.array([state.position for state in states])
    return Episode(walk, scene, frames, success, states, np.array(observations))


def film(
    policy: Any,
    env: Any,
    path: str | Path,
    *,
    seed: int = 0,
    normalize: Any = None,
    trust: bool = False,
    **options: Any,
) -> Path:
    """Films a policy on a test scene; needs the extra ``video``.

    Args:
        policy: a name, file or object, as :func:`snake_env.load_policy` takes them.
        env: name of a task, id, or an environment made with this package; None: where the policy was trained.
        path: ends in .mp4 or .gif; without an ending .mp4 is added.
        seed: number of the test scene, from 0, the one that :func:`snake_env.evaluate` plays in that episode.
        normalize: file of a ``VecNormalize``, see :func:`snake_env.load_policy`.
        trust: the policy's file may run code, see :func:`snake_env.load_policy`.
        **options: keywords of the environment, such as ``difficulty`` or ``picture``.

    Returns:
        What was written: a gif where no ffmpeg is found.

    Raises:
        ConfigError: the policy, the environment or the ending is not admissible.
    """
    path = file(Path(path))
    actor, task = acting_in(policy, env, options=options, normalize=normalize, trust=trust)
    (field,) = held_out(1, seed)
    frames = play(actor, task.env_id, field, render_mode="rgb_array", **task.options).frames
    path.parent.mkdir(parents=True, exist_ok=True)
    return write(frames, path)


def file(path: Path) -> Path:
    """The file of a film: an mp4 or a gif; without an ending, an mp4.

    Raises:
        ConfigError: another ending.
        MissingExtra: the packages that write films are missing.
    """
    with extras():
        import imageio  # noqa: F401
        from PIL import Image  # noqa: F401
    path = path if path.suffix else path.with_name(f"{path.name}.mp4")
    if path.suffix.lower() not in (".mp4", ".gif"):
        raise ConfigError("film", str(path), "a name that ends in .mp4 or .gif")
    return path


def write(frames: list[NDArray[np.uint8]], path: Path, frames_per_second: int = 20) -> Path:
    """Writes a film; returns what was written.

    Args:
        frames: pictures of one size.
        path: ends in .mp4 or .gif; without an ending .mp4 is added. Where no ffmpeg is found, a gif stands in for an
            mp4.
        frames_per_second: of real time.

    Raises:
        ConfigError: another ending.
    """
    path = file(path)
    if path.suffix.lower() == ".gif":
        return _write_small_gif(frames, path, frames_per_second)
    try:
        replace(path, lambda part: _write_mp4(frames, part, frames_per_second))
        return path
    except (ImportError, OSError, ValueError) as error:
        print(f"no mp4 ({error}); writing a gif")
        return _write_small_gif(frames, path.with_suffix(".gif"), frames_per_second)


def _write_mp4(frames: list[NDArray[np.uint8]], path: Path, frames_per_second: int) -> None:
    import imageio

    with imageio.get_writer(path, fps=frames_per_second, macro_block_size=2) as writer:
        for frame in frames:
            height, width = frame.shape[:2]
            even = frame[: height - height % 2, : width - width % 2]  # as the codec wants it
            writer.append_data(even)  # type: ignore[attr-defined]


def _write_small_gif(frames: list[NDArray[np.uint8]], path: Path, frames_per_second: int) -> Path:
    """At half the size."""
    return write_gif([frame[::2, ::2] for frame in frames], path, milliseconds=round(1000 / frames_per_second))


def write_gif(frames: list[NDArray[np.uint8]], path: Path, milliseconds: int) -> Path:
    """Writes frames of one size, shown so long each, in the same few colours: small where little moves."""
    with extras():
        from PIL import Image

    pictures = [Image.fromarray(frame) for frame in frames]
    palette = _palette(pictures)
    few = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in pictures]
    settings: dict[str, Any] = {"save_all": True, "append_images": few[1:], "duration": milliseconds, "loop": 0}
    replace(path, lambda part: few[0].save(part, optimize=False, **settings))
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
