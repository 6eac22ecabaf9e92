"""Pictures of the documents: what draws each, and what it shows."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from types import ModuleType
from typing import Any

from benchmarks import figures as bench_figures
from benchmarks.results import Results
from experiments import browser_pictures, concepts, difficulty, environment_films
from experiments.origin import digest
from snake_env import card, drawing, palette, rendering, side_view
from snake_env.commands.environment_pages import FILMS
from snake_env.evaluation import film
from snake_env.registration import SCENARIOS, TASKS
from snake_env.reproduce import figures as thesis_figures
from snake_env.reproduce.experiment import Experiment, Runs
from snake_env.reproduce.experiments import experiments
from snake_env.viewer import drawing as viewer_drawing
from snake_env.viewer import live, plots
from training.evaluation import inspection, inspection_figures
from training.evaluation.loading import task as task_of

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
IMAGES = DOCS / "images"

FINAL = {"touch.png": "e14cf7ac"}
"""Pictures that are not drawn again, and the commit with what drew them, which their page names."""

Code = tuple[Callable[..., Any] | ModuleType, ...]


@dataclass(frozen=True)
class Picture:
    """A picture of the documents.

    Attributes:
        draw: writes it to a path; returns the names of the runs that it shows: of experiments, or :func:`episode`.
        code: functions and modules that draw it.
        configuration: on what else it depends; anything that JSON can hold.
        policies: shipped ones, and scripted controllers with the task for which they are tuned.
    """

    draw: Callable[[Path], tuple[str, ...]]
    code: Code
    configuration: Any = None
    policies: tuple[str, ...] = ()


@cache
def pictures() -> dict[str, Picture]:
    """All by file name."""
    groups = (_films(), _thesis(), _benchmark(), _difficulty(), _inspected(), _browser())
    return {name: picture for group in groups for name, picture in group.items()}


def episode(policy: str, env_id: str, scene: int = 0, options: dict[str, Any] | None = None) -> str:
    """The name of a run: what acts, where, and on which test scene."""
    return json.dumps([policy, env_id, scene, options or {}])


def _drawn(runs: tuple[str, ...], draw: Callable[..., Any], *arguments: Any) -> Callable[[Path], tuple[str, ...]]:
    """Draws by a function whose last argument is the path."""

    def write(path: Path) -> tuple[str, ...]:
        draw(*arguments, path)
        return runs

    return write


def _films() -> dict[str, Picture]:
    shown = {f"env-{card.page_name(env_id)}.gif": (env_id, one) for env_id, one in FILMS.items()}
    shown |= {f"learned-{name}.gif": ("SnakeSpatial-v1", one) for name, one in environment_films.POLICIES.items()}
    code: Code = (environment_films.write_film, film.play, film.write_gif, palette, rendering, side_view)
    found = {}
    for name, (env_id, one) in shown.items():
        runs = (episode(one.policy, env_id, one.scene, one.options),)
        acts = {"action zero": (), "heading control": ("heading control, maze",)}.get(one.policy, (one.policy,))
        draw = _drawn(runs, environment_films.write_film, env_id, one)
        found[name] = Picture(draw, code, [env_id, TASKS[env_id], one], acts)
    starts = tuple(
        episode("action zero", env_id, 0, {"difficulty": level})
        for env_id in (*(family["id"] for family in SCENARIOS), "SnakeSpatial-v1")
        for level in environment_films.DIFFICULTIES
    )
    draw = _drawn(starts, environment_films.write_gallery)
    found["gallery.png"] = Picture(draw, (environment_films.write_gallery, drawing, palette, rendering, side_view))
    return found


THESIS = {
    "course.png": "figure-7.7.png",
    "figure-7.10.png": "figure-7.10.png",
    "comparison-models.png": "figure-2.3.2-models.png",
    "chapter-5-mechanism.png": "figure-5.2.png",
    "chapter-6-lyapunov.png": "figure-6.3.3-theorem.png",
    "chapter-6-high-gains.png": "figure-7.3.5-high-gains.png",
    "chapter-4-gaits.png": "gaits.png",
    "chapter-8-stairs.png": "figure-8-stairs.png",
    **{f"chapter-4-{name}.png": f"{name}.png" for name in (f"figure-7.{number}" for number in (2, 4, 12, 13))},
}
"""Figures of the reproduction that the documents show."""


class _Used(Runs):
    """Runs that note which experiments a figure looks at."""

    def __init__(self) -> None:
        super().__init__(experiments())
        self.names: set[str] = set()

    def experiment(self, name: str) -> Experiment:
        self.names.add(name)
        return super().experiment(name)


def _thesis() -> dict[str, Picture]:
    def draw(figure: Callable[[Runs, Path], Path], path: Path) -> tuple[str, ...]:
        runs = _Used()
        with drawing.style():
            figure(runs, path)
        return tuple(sorted(runs.names))

    functions = {name: thesis_figures.FIGURES[figure][1] for name, figure in THESIS.items()} | {
        "concepts.png": concepts.draw
    }
    return {name: Picture(partial(draw, figure), (figure, drawing)) for name, figure in functions.items()}


def _benchmark() -> dict[str, Picture]:
    results = Results.read(DOCS / "benchmarks.json")
    found = {}
    for scene in results.of("scene"):
        name = scene["scene"]

        def draw(path: Path, scene: dict[str, Any] = scene) -> tuple[str, ...]:
            bench_figures.work_precision(results, scene, path.parent)
            return ()

        records = [one for one in results.records if one.get("scene") == name and one["kind"] != "growth"]
        found[f"bench-{name}.png"] = Picture(draw, (bench_figures.work_precision, drawing), records)

    def growth(path: Path) -> tuple[str, ...]:
        bench_figures.growth(results, path.parent)
        return ()

    found["bench-growth.png"] = Picture(growth, (bench_figures.growth, drawing), results.of("growth"))
    return found


FIELDS = 150
"""Test scenes at each difficulty."""


def _difficulty() -> dict[str, Picture]:
    runs = tuple(
        episode("gait", task.env_id, 0, task.options | {"difficulty": level})
        for task in (difficulty.FAMILIES[name] for name in difficulty.PLANAR)
        for level in difficulty.DIFFICULTIES
    )

    def measure(path: Path) -> None:
        difficulty.compare(difficulty.Options(fields=FIELDS, picture=path))

    return {"difficulty.png": Picture(_drawn(runs, measure), (difficulty, drawing), FIELDS)}


INSPECTED = {
    "learned-goal-reached-frames.png": ("field-hard", 300, "goal-reached-frames.png"),
    "learned-goal-reached.gif": ("field-hard", 300, "goal-reached.gif"),
    "learned-perturbed.gif": ("perturbed", 20, "goal-reached.gif"),
    "learned-corridor.gif": ("corridor", 20, "goal-reached.gif"),
}
"""Policy, number of test scenes, and which file of ``python -m training inspect``."""


def _inspected() -> dict[str, Picture]:
    def draw(policy: str, fields: int, shown: str, path: Path) -> tuple[str, ...]:
        shutil.copyfile(_inspect(policy, fields) / shown, path)
        env_id, options = task_of(None, {}, [Path(policy)])
        return (episode(policy, env_id, 0, options),)

    found = {}
    for name, shown in INSPECTED.items():
        code: Code = (inspection, inspection_figures, film.play, film.write_gif, palette, rendering, drawing)
        found[name] = Picture(partial(draw, *shown), code, shown, shown[:1])
    return found


@cache
def _inspect(policy: str, fields: int) -> Path:
    """The folder of an inspection."""
    out = Path(_KEPT.name) / policy
    inspection.inspect(inspection.Options(Path(policy), fields=fields, out=out))
    return out


_KEPT = tempfile.TemporaryDirectory()


def _browser() -> dict[str, Picture]:
    def draw(function: Callable[..., Any], run: str, path: Path) -> tuple[str, ...]:
        with browser_pictures.browser() as opened:
            function(opened, path.parent)
        return (run,)

    hard = episode("general", "SnakeField-v1", 0, {"difficulty": 1.0})
    viewer: Code = (browser_pictures.viewer, live, palette, viewer_drawing, plots)
    web = [digest(path.read_bytes()) for path in sorted((ROOT / "rust/playground/web").glob("*.*s"))]
    page, sidewinds = browser_pictures.playground, browser_pictures.sidewinding
    still = episode("action zero", "SnakeSpatial-v1")
    return {
        "viewer.png": Picture(partial(draw, browser_pictures.viewer, hard), viewer, None, ("general",)),
        "playground.png": Picture(partial(draw, page, hard), (page,), web, ("general",)),
        "sidewinding.gif": Picture(partial(draw, sidewinds, still), (sidewinds, film.write_gif), web),
    }
