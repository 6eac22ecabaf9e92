"""Pictures of the documents tell what they were made from, and are stale exactly when that has changed."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from experiments import origin, picture_list, pictures
from snake_env.reproduce.experiment import Experiment
from snake_env.reproduce.experiments import experiments

NAMES = list(picture_list.pictures())
PLANAR, SPATIAL, MINIMAL, DATA = (
    "course.png",
    "chapter-4-figure-7.12.png",
    "chapter-6-high-gains.png",
    "bench-growth.png",
)
DRAWN = (PLANAR, SPATIAL, MINIMAL, DATA)


@pytest.mark.parametrize("name", NAMES)
def test_pictures_show_what_there_is_now(name):
    reasons = pictures.stale(name)
    assert not reasons, f"{'; '.join(reasons)}: run `make pictures`, or python -m experiments.pictures --only {name}"


def test_every_picture_of_the_documents_is_drawn_by_the_command_or_final():
    found = {path.name for path in picture_list.IMAGES.iterdir() if path.suffix in (".png", ".gif", ".jpg")}
    assert sorted(found) == sorted([*NAMES, *picture_list.FINAL])
    results = (picture_list.DOCS / "results.md").read_text(encoding="utf-8")
    assert all(f"images/{name}" in results and f"commit {made}" in results for name, made in picture_list.FINAL.items())


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Some pictures as they are drawn now."""
    place = tmp_path_factory.mktemp("pictures")
    for name in DRAWN:
        pictures.redraw(name, place)
    return place


@pytest.fixture
def stale(folder):
    """Which of them are stale, found anew."""

    def found():
        pictures.beginning.cache_clear()
        picture_list.pictures.cache_clear()
        return {name for name in DRAWN if pictures.stale(name, folder)}

    yield found
    pictures.beginning.cache_clear()
    picture_list.pictures.cache_clear()


def test_a_picture_is_not_stale_after_it_was_drawn(stale):
    assert stale() == set()


@pytest.mark.parametrize(("model", "expected"), [("planar", PLANAR), ("spatial", SPATIAL), ("minimal", MINIMAL)])
def test_physics_makes_those_stale_that_show_it(model, expected, stale, monkeypatch):
    """A friction coefficient of one model is another by a hundredth."""
    simulate = Experiment.simulate

    def changed(self, **options):
        if self.model == model:
            along, across = self.scene.friction
            self = dataclasses.replace(self, scene=dataclasses.replace(self.scene, friction=(1.01 * along, across)))
        return simulate(self, **options)

    monkeypatch.setattr(Experiment, "simulate", changed)
    assert stale() == {expected}


def test_round_off_makes_none_stale(stale, monkeypatch):
    simulate = Experiment.simulate

    def rounded(self, **options):
        run = simulate(self, **options)
        return dataclasses.replace(run, position=run.position * (1.0 + 1e-9))

    monkeypatch.setattr(Experiment, "simulate", rounded)
    assert stale() == set()


def test_data_makes_stale_what_is_drawn_from_it(stale, monkeypatch, tmp_path):
    content = json.loads((picture_list.DOCS / "benchmarks.json").read_text())
    next(one for one in content["records"] if one["kind"] == "growth")["us_per_step"] *= 1.1
    (tmp_path / "benchmarks.json").write_text(json.dumps(content))
    before = {name: pictures.present(name, ()) for name in NAMES}
    monkeypatch.setattr(picture_list, "DOCS", tmp_path)
    assert stale() == {DATA}
    assert {name for name in NAMES if pictures.present(name, ()) != before[name]} == {DATA}


def test_a_policy_makes_its_pictures_stale(monkeypatch):
    """Of those whose record would be made now."""
    before = {name: pictures.present(name, ()) for name in NAMES}
    file_of = pictures._policy
    monkeypatch.setattr(pictures, "_policy", lambda name: b"another" if name == "corridor" else file_of(name))
    changed = {name for name in NAMES if pictures.present(name, ()) != before[name]}
    assert changed == {"learned-corridor.gif"}
    monkeypatch.setattr(pictures, "_policy", lambda name: b"another" if name == "general" else file_of(name))
    changed = {name for name in NAMES if pictures.present(name, ()) != before[name]}
    films = {f"env-{name}.gif" for name in ("course", "field", "perturbed", "maze", "corridor")}
    assert changed == {*films, "viewer.png", "playground.png"}


def test_another_scene_makes_one_film_stale(monkeypatch):
    before = {name: pictures.present(name, ()) for name in NAMES}
    other = picture_list.FILMS["SnakeMaze-v1"]._replace(scene=1)
    monkeypatch.setitem(picture_list.FILMS, "SnakeMaze-v1", other)
    picture_list.pictures.cache_clear()
    assert {name for name in NAMES if pictures.present(name, ()) != before[name]} == {"env-maze.gif"}
    picture_list.pictures.cache_clear()


def test_the_beginning_of_an_episode_differs_from_scene_to_scene():
    same, other = (pictures.beginning(picture_list.episode("corridor", "SnakeCorridor-v1", k)) for k in (0, 1))
    assert np.abs(same - other).max() > 0.01


def test_every_figure_records_which_experiments_it_shows(folder):
    assert list(origin.read(folder / PLANAR)["runs"]) == ["table 7.3"]
    assert all(
        run in experiments() for name in (PLANAR, SPATIAL, MINIMAL) for run in origin.read(folder / name)["runs"]
    )


@pytest.mark.parametrize("kind", ["png", "gif"])
@pytest.mark.parametrize("mode", ["RGB", "P", "L"])
def test_a_record_leaves_the_pixels_as_they_are(kind, mode, tmp_path):
    path = tmp_path / f"picture.{kind}"
    frames = [Image.effect_noise((40, 30), 60.0 + k).convert(mode) for k in range(3)]
    more = {"save_all": True, "append_images": frames[1:], "loop": 0, "duration": 100} if kind == "gif" else {}
    frames[0].save(path, **more)
    assert origin.read(path) is None
    before = pixels(path)
    record = {"command": "make", "runs": {"long": [0.123456] * 400}}
    origin.write(path, record)
    assert origin.read(path) == record
    assert pixels(path) == before


def pixels(path: Path) -> list[bytes]:
    with Image.open(path) as picture:
        frames = []
        for k in range(getattr(picture, "n_frames", 1)):
            picture.seek(k)
            frames.append(picture.convert("RGB").tobytes())
        return frames


def drawn(size):
    """Draws."""
    # in colour
    return size * SCALE, f"{size:.1f} m"


SCALE = 2.0


def test_code_is_what_it_does():
    """Comments, docstrings and layout do not count; a constant that a function uses does."""
    source = 'def f(a):\n    """Says."""\n    # why\n    return a  # so\n'
    assert origin.bare(source) == origin.bare("def f(a):\n\n    return a\n")
    assert origin.bare(source) != origin.bare("def f(a):\n    return -a\n")
    assert origin.bare("if a:\n    b()\n    c()\n") != origin.bare("if a:\n    b()\nc()\n")


def test_a_constant_counts_as_code(monkeypatch):
    before = origin.code(drawn)
    monkeypatch.setitem(globals(), "SCALE", 3.0)
    assert origin.code(drawn) != before


def test_a_picture_that_cannot_be_drawn_stays_and_is_reported(monkeypatch, capsys, tmp_path):
    def fails(path):
        raise OSError("no browser\ninstall one")

    broken = {"viewer.png": dataclasses.replace(picture_list.pictures()["viewer.png"], draw=fails)}
    monkeypatch.setattr(pictures, "pictures", lambda: broken)
    assert pictures.main(["--only", "viewer.png"]) == 1
    assert "viewer.png: not drawn, OSError: no browser\n" in capsys.readouterr().out
