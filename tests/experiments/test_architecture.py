"""Imports go down, and an arrow that does not is reported."""

from __future__ import annotations

from pathlib import PurePath

import pytest

from experiments import architecture, size

LAYERS = ({"math": ""}, {"planar": ""}, {"snake_env": ""}, {"training": ""})


def write(root, name, text):
    path = root / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def checked(root):
    units = [unit for layer in LAYERS for unit in layer]
    return architecture.violations(architecture.imports_between_units(root, units), LAYERS)


def test_the_repository_has_no_upward_arrow(capsys):
    assert architecture.main([]) == 0, capsys.readouterr().out


def test_the_picture_is_that_of_the_present_imports():
    units = [unit for layer in architecture.LAYERS for unit in layer]
    edges = architecture.imports_between_units(architecture.ROOT, units)
    drawn = (architecture.ROOT / "docs/images/architecture.svg").read_text()
    assert drawn == architecture.svg(edges), "run `make docs`"


def test_a_made_up_upward_arrow_is_reported(tmp_path):
    write(tmp_path, "rust/core/src/planar/mod.rs", "use crate::math::Real;\n")
    write(tmp_path, "rust/core/src/math/mod.rs", "// use crate::planar::Stage;\npub trait Real {}\n")
    write(tmp_path, "snake_env/__init__.py", "import numpy\n")
    write(tmp_path, "training/__init__.py", "from snake_env import errors\n")
    assert checked(tmp_path) == []
    write(tmp_path, "rust/core/src/math/real.rs", "use crate::{planar::{Stage, State}};\n")
    assert [line.split(",")[0] for line in checked(tmp_path)] == ["math imports from planar"]
    write(tmp_path, "snake_env/env.py", "def train():\n    from training import ppo\n")
    assert "snake_env imports from training" in "\n".join(checked(tmp_path))


def test_a_folder_without_a_layer_is_reported(tmp_path):
    write(tmp_path, "rust/core/src/helpers.rs", "")
    write(tmp_path, "rust/core/src/planar/mod.rs", "use crate::helpers::max;\n")
    assert checked(tmp_path)[0].startswith("planar imports from helpers, which has no layer")


def test_modules_in_a_circle_are_found(tmp_path):
    write(tmp_path, "snake_env/a.py", "from snake_env import b\n")
    write(tmp_path, "snake_env/b.py", "import numpy\n")
    assert architecture.circle_of_modules(tmp_path, "snake_env") == []
    write(tmp_path, "snake_env/b.py", "from snake_env.a import thing\n")
    assert set(architecture.circle_of_modules(tmp_path, "snake_env")) == {"snake_env.a", "snake_env.b"}


def test_arrows_that_follow_from_others_are_not_drawn():
    edges = {"batch": {"planar": "", "math": ""}, "planar": {"math": ""}, "math": {}}
    assert set(architecture.reduced(edges)) == {("batch", "planar"), ("planar", "math")}


def test_sizes_count_this_file():
    rows, words = size.sizes()
    assert words["README.md"] > 100
    assert all(
        lines > code > 0 for language, folder, files, lines, code in rows if folder.startswith("rust/core/src/math")
    )


RUST = """//! What it is.

/// Twice.
pub fn twice(x: f64) -> f64 {
    2.0 * x // exact
}

#[cfg(test)]
mod tests {
    fn none() {}
}
"""
PYTHON = '''"""What it is."""

# Exact.
FACTOR = """two
lines"""
"""Its docstring."""


def twice(x: float) -> float:
    """Twice."""
    return (
        2.0 * x  # exact
    )
'''


@pytest.mark.parametrize(("name", "text", "code"), [("a.rs", RUST, 3), ("a.py", PYTHON, 6), ("tests/a.py", PYTHON, 0)])
def test_code_is_neither_comment_nor_docstring_nor_test(name, text, code):
    assert size.code_lines(PurePath(name), text) == code
