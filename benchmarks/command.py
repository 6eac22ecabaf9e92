"""The command line of the benchmarks."""

from __future__ import annotations

import importlib.util
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from benchmarks import equal_error, figures, interface_cost, learning_cost, native, page
from benchmarks.results import Record, Results
from benchmarks.targets import all_targets
from snake_env import _native
from snake_env._files import write_text
from snake_env.markdown import table
from training.cli import answer

WIDTH, PEER, EQUAL_ERROR, INTERFACE = "width", "peer", "equal-error", "interface"
Part = Literal["precision", "spatial", "growth", "skip", "certificate", "width", "peer", "equal-error", "interface"]
PARTS: tuple[Part, ...] = get_args(Part)
DOCS = native.ROOT / "docs"
RESULTS, PUBLISHED = "results.json", "benchmarks.json"

Progress = Callable[[str], None]


@dataclass
class Options:
    """What is measured.

    Args:
        quick: Few settings and repetitions: within two minutes.
        parts: What is measured.
        scenes: Scenes of the parts precision, certificate and peer; all if absent.
        out: Folder for results, pictures and page.
        write_docs: Also replace the committed page, pictures and results, or what the parts have measured of them.
    """

    quick: bool = False
    parts: tuple[Part, ...] = PARTS
    scenes: tuple[str, ...] | None = None
    out: Path = Path("runs/bench")
    write_docs: bool = False


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; 130 if it was interrupted."""
    return answer(Options, run, DESCRIPTION, arguments)


def run(args: Options) -> int:
    """Measures, and writes the page; 130 if it was interrupted."""
    args.out.mkdir(parents=True, exist_ok=True)
    results = Results.begin(_command(args), args.quick)
    progress = Clock()
    try:
        for record in measure(args, results, progress):
            results.add(record)
        results.complete = True
    except KeyboardInterrupt:
        progress("interrupted: keeping what was measured")
    finally:
        results.seconds = progress.seconds()
        results.write(args.out / RESULTS)
    write(results, args.out, args.out, RESULTS, "README.md", ".")
    if args.write_docs and results.complete:
        published = results if args.parts == PARTS else Results.read(DOCS / PUBLISHED).renewed(results)
        write(published, DOCS, DOCS / "images", PUBLISHED, "benchmarks.md", "images")
        equal_error.write_blocks(published)
    print(
        table(
            ("target", "aim", "measured", ""), ((t.what, t.target, t.measured, t.verdict) for t in all_targets(results))
        )
    )
    print(f"{args.out / 'README.md'}")
    return 0 if results.complete else 130


def _command(args: Options) -> str:
    """What to type for this run."""
    parts = ["--parts", *args.parts] if args.parts != PARTS else []
    options = " ".join([*(["--quick"] if args.quick else []), *parts])
    return f'make bench BENCH="{options}"' if options else "make bench"


class Clock:
    """Writes progress with the time since the start."""

    def __init__(self) -> None:
        self._start = time.monotonic()

    def seconds(self) -> float:
        """Since the start [s]."""
        return time.monotonic() - self._start

    def __call__(self, what: str) -> None:
        """Says what is being done."""
        minutes, seconds = divmod(int(self.seconds()), 60)
        print(f"[{minutes:2d}:{seconds:02d}] {what}", file=sys.stderr, flush=True)


def measure(args: Options, results: Results, progress: Progress) -> Iterator[Record]:
    """All records of the parts asked for; what is already in ``results`` may be built on."""
    parts = [part for part in native.PARTS if part in args.parts]
    if parts:
        progress("building snake-bench")
        yield from native.measure(native.build(), native_arguments(args, parts), progress)
    if WIDTH in args.parts:
        yield from widths(args.quick, progress)
    if PEER in args.parts and has_mujoco(progress):
        yield from peers(results, args.quick, progress)
    if EQUAL_ERROR in args.parts and has_mujoco(progress):
        from benchmarks import settings_search

        plan = settings_search.QUICK if args.quick else settings_search.Plan()
        yield from settings_search.measure(plan, progress)
    if INTERFACE in args.parts:
        progress("interface without physics")
        yield from ({"kind": "interface", **row} for row in interface(args.quick))
        progress("shares of simulator and learner")
        yield from ({"kind": "learning", **row} for row in learning(args.quick))


def native_arguments(args: Options, parts: Sequence[str]) -> list[str]:
    """Command line of ``snake-bench``; only a quick look takes references from an earlier run."""
    options = ["--quick", "--cache", str(args.out)] if args.quick else []
    return [*parts, *options, *(["--scenes", ",".join(args.scenes)] if args.scenes else [])]


def widths(quick: bool, progress: Progress) -> Iterator[Record]:
    """Environments in registers of every width that this processor has."""
    program = native.build()
    for lanes in (one for one in (1, 4, 8) if one <= _native.lanes()):
        yield from native.measure(program, [WIDTH, *(["--quick"] if quick else [])], progress, lanes)


def peers(results: Results, quick: bool, progress: Progress) -> Iterator[Record]:
    """MuJoCo on the scenes whose references are known."""
    from benchmarks import mujoco_peer

    scenes = results.of("scene")
    for scene in scenes[:2] if quick else scenes:
        yield from mujoco_peer.points(scene, quick, progress)


def has_mujoco(progress: Progress) -> bool:
    """Whether there is anything to compare with."""
    found = importlib.util.find_spec("mujoco") is not None
    if not found:
        progress("MuJoCo is not installed (group bench): no comparison with it")
    return found


def interface(quick: bool) -> Iterator[Record]:
    """What ``step`` costs around the physics."""
    for robots in (256,) if quick else (1, 16, 64, 256):
        yield interface_cost.overhead("SnakeCourse-v1", robots, 3 if quick else 7)


def learning(quick: bool) -> Iterator[Record]:
    """What a learner and its simulator take of the wall time."""
    for env_id in ("SnakeSpatial-v1",) if quick else ("SnakeField-v1", "SnakeSpatial-v1"):
        yield learning_cost.learning(env_id, 1 if quick else 20)


def write(results: Results, folder: Path, pictures: Path, data: str, text: str, images: str) -> None:
    """Writes results, pictures and page."""
    results.write(folder / data)
    figures.draw_all(results, pictures)
    write_text(folder / text, page.render(results, images, published=folder == DOCS))


DESCRIPTION = """Speed against error, growth, cost of features, certificates; peers on the same scenes.

    python -m benchmarks
    python -m benchmarks --quick --parts precision peer --scenes free course-7.5

Parts: precision (error against run time), spatial (the same in 3D), growth (links, pegs, robots and threads), skip
(what features cost), certificate (residuals, gaps, iterations), width (registers of every width), peer (MuJoCo on the
scenes of precision and spatial, if the group `bench` is installed), equal-error (cost at equal error under random
actions, ours and MuJoCo's), interface (Python's share of a step, and the simulator's of learning)."""
