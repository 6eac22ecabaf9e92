"""The layers of the repository: every import goes down. Draws docs/images/architecture.svg.

    python -m experiments.architecture            # check, exit status 1 if an arrow goes up
    python -m experiments.architecture --write    # check and draw

Imports are read from the sources: ``use crate::``, ``use snake_core::`` and ``use snake_thesis::`` in Rust, ``import``
in Python. Tests, command-line entry points (``__main__.py``) and imports for type checking do not count.
"""

from __future__ import annotations

import argparse
import ast
import re
import sys
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

from snake_env._files import write_text

ROOT = Path(__file__).resolve().parent.parent
CORE = "rust/core/src"
LAYERS: tuple[dict[str, str], ...] = (
    {"error": "ConfigError", "interrupt": "signals", "math": "lanes, trigonometry"},
    {"rows": "contacts as rows"},
    {"laws": "force laws as convex sets", "judge": "verification of laws", "robot": ""},
    {"obstacles": "shapes, distances", "slope": ""},
    {"scene": "", "gait": "references", "noise": ""},
    {"control": "joint controllers"},
    {"pegs": "grid of pegs"},
    {"contact": "gaps, near lists"},
    {"solver": "augmented Lagrangian"},
    {"stepping": "steps, robots in lanes"},
    {"capabilities": "what each model has"},
    {"planar": "chapter 3", "spatial": "chapter 4"},
    {"simulation": "one robot, scripted"},
    {"environment": "tasks, rewards, observations", "rust/thesis": "chapter 6, as printed"},
    {"batch": "robots on threads"},
    {"rust/bench": "", "rust/playground": "web page", "rust/python": "bindings", "rust/stress": ""},
    {"snake_env": "Python package"},
    {"snake_env/reproduce": "the thesis", "snake_env/policies": "gaits, controllers, networks"},
    {"snake_env/evaluation": "test scenes, statistics"},
    {"snake_env/viewer": "in the browser"},
    {"snake_env/commands": "snake-env"},
    {"training": "learners, policies, evaluation"},
    {"benchmarks": "simulator"},
    {"experiments": "tables and pictures of the docs"},
)
"""Units from the bottom to the top, each with its content; a unit imports only from rows below its own.

A name without a slash that is no Python package is a folder or file of rust/core/src.
"""

Edges = dict[str, dict[str, str]]
"""For each unit the units that it imports from, each with one file that does."""


def rust_imports(source: str, crate: str) -> set[str]:
    """Top-level modules of ``crate`` that a Rust file names outside of comments and unit tests."""
    code = re.sub(r"//.*", "", source).split("#[cfg(test)]")[0]
    found = set()
    for group, name in re.findall(rf"\b{crate}::(?:\{{(.*?)\}};|(\w+))", code, re.DOTALL):
        found.update(re.findall(r"(?:^|,)\s*(\w+)", re.sub(r"\{[^{}]*\}", "", group)) if group else [name])
    return {"error" if name == "ConfigError" else name for name in found}


def python_imports(source: str) -> set[str]:
    """Dotted names that a Python file imports; ``from a import b`` counts as ``a.b``."""
    tree = ast.parse(source)
    ifs = (node for node in ast.walk(tree) if isinstance(node, ast.If))
    skipped = {id(child) for node in ifs if "TYPE_CHECKING" in ast.dump(node.test) for child in ast.walk(node)}
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import) and id(node) not in skipped:
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and id(node) not in skipped and node.level == 0:
            found.update(f"{node.module}.{alias.name}" for alias in node.names)
    return found


def imports_between_units(root: Path, units: list[str]) -> Edges:
    """Who imports from whom.

    Args:
        root: of the repository.
        units: names as in ``LAYERS``.
    """
    edges: Edges = {unit: {} for unit in units}
    for file in sorted((root / CORE).rglob("*.rs")):
        unit = file.relative_to(root / CORE).parts[0].removesuffix(".rs")
        if unit != "lib":
            _add(edges, unit, rust_imports(file.read_text(), "crate"), file)
    for unit in filter(lambda unit: unit.startswith("rust/"), units):
        for file in sorted((root / unit / "src").rglob("*.rs")):
            source = file.read_text()
            _add(edges, unit, rust_imports(source, "snake_core"), file)
            _add(edges, unit, {"rust/thesis"} if rust_imports(source, "snake_thesis") else set(), file)
    packages = {unit.split("/")[0] for unit in units if (root / unit / "__init__.py").exists()}
    for file in sorted(file for package in packages for file in (root / package).rglob("*.py")):
        if file.name != "__main__.py":
            names = {_unit_of(name.replace(".", "/"), units) for name in python_imports(file.read_text())}
            _add(edges, _unit_of(str(file.relative_to(root)), units), names - {""}, file)
    return edges


def _unit_of(path: str, units: list[str]) -> str:
    """The unit with the longest matching name, or nothing; the native module is that of the bindings."""
    if path.startswith("snake_env/_native"):
        return "rust/python"
    inside = [unit for unit in units if path == unit or path.startswith(f"{unit}/")]
    return max(inside, key=len, default="")


def _add(edges: Edges, unit: str, imported: set[str], file: Path) -> None:
    for name in imported - {unit}:
        edges.setdefault(unit, {}).setdefault(name, str(file))


def violations(edges: Edges, layers: tuple[dict[str, str], ...] = LAYERS) -> list[str]:
    """One line for each arrow that does not go down or ends outside the layers."""
    height = {unit: row for row, layer in enumerate(layers) for unit in layer}
    lines = [f"{unit} has no layer" for unit in edges if edges[unit] and unit not in height]
    for unit, imported in edges.items():
        for other, file in imported.items():
            if other not in height:
                lines.append(f"{unit} imports from {other}, which has no layer: {file}")
            elif height[other] >= height.get(unit, len(layers)):
                lines.append(f"{unit} imports from {other}, which is not below it: {file}")
    return lines


def circle_of_modules(root: Path, package: str) -> list[str]:
    """Modules of a Python package that import each other in a circle when they are loaded, or nothing."""
    files = {".".join(file.relative_to(root).with_suffix("").parts): file for file in (root / package).rglob("*.py")}
    graph = {}
    for name, file in files.items():
        if not name.endswith("__init__"):
            tops = ast.Module([n for n in ast.parse(file.read_text()).body if not isinstance(n, ast.FunctionDef)], [])
            found = python_imports(ast.unparse(tops))
            graph[name] = {other for other in files for i in found if i == other or i.startswith(f"{other}.")} - {name}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def reduced(edges: Edges) -> Iterator[tuple[str, str]]:
    """The arrows that follow from no others."""

    def reachable(unit: str) -> set[str]:
        return {unit}.union(*(reachable(other) for other in edges.get(unit, {})))

    for unit, imported in edges.items():
        for other in imported:
            if not any(other in reachable(between) for between in imported if between != other):
                yield unit, other


BOX, ROW, MARGIN, WIDTH = (150, 40), 66, 20, 760


def svg(edges: Edges, layers: tuple[dict[str, str], ...] = LAYERS) -> str:
    """The picture: one row for each layer, arrows from a unit to what it imports from."""
    height = MARGIN * 2 + ROW * len(layers)
    centre = {}
    for row, layer in enumerate(reversed(layers)):
        for column, unit in enumerate(layer):
            x = WIDTH / 2 + (column - (len(layer) - 1) / 2) * (BOX[0] + MARGIN)
            centre[unit] = (x, MARGIN + ROW * row + BOX[1] / 2)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" font-family="sans-serif">',
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path d="M0 0L8 4L0 8z" fill="#667"/></marker></defs>',
        f'<rect width="{WIDTH}" height="{height}" fill="#fff"/>',
    ]
    parts += [_arrow(centre[unit], centre[other]) for unit, other in sorted(reduced(edges))]
    parts += [_box(unit, content, centre[unit]) for layer in layers for unit, content in layer.items()]
    return "\n".join([*parts, "</svg>"]) + "\n"


def _arrow(start: tuple[float, float], end: tuple[float, float]) -> str:
    (x, y), (to_x, to_y) = (start[0], start[1] + BOX[1] / 2), (end[0], end[1] - BOX[1] / 2)
    bend = (to_y - y) / 2 if abs(to_x - x) > 1 else 0.0
    path = f"M{x:.0f} {y:.0f}C{x:.0f} {y + bend:.0f} {to_x:.0f} {to_y - bend:.0f} {to_x:.0f} {to_y:.0f}"
    return f'<path d="{path}" fill="none" stroke="#667" marker-end="url(#tip)"/>'


def _box(unit: str, content: str, centre: tuple[float, float]) -> str:
    (x, y), (width, height) = centre, BOX
    colour = "#fde9d0" if "rust/" in unit else "#dcecf9" if unit.split("/")[0] in PYTHON else "#e5f1df"
    name = f'<text x="{x:.0f}" y="{y + (-2 if content else 4):.0f}" text-anchor="middle" font-size="13">{unit}</text>'
    note = f'<text x="{x:.0f}" y="{y + 12:.0f}" text-anchor="middle" font-size="9" fill="#555">{content}</text>'
    frame = f'<rect x="{x - width / 2:.0f}" y="{y - height / 2:.0f}" width="{width}" height="{height}" rx="5"'
    return f'{frame} fill="{colour}" stroke="#667"/>{name}{note if content else ""}'


PYTHON = ("snake_env", "training", "benchmarks", "experiments")


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="also draw docs/images/architecture.svg")
    args = parser.parse_args(arguments)
    edges = imports_between_units(ROOT, [unit for layer in LAYERS for unit in layer])
    wrong = violations(edges)
    wrong += [f"circle: {' -> '.join(circle)}" for name in PYTHON if (circle := circle_of_modules(ROOT, name))]
    for line in wrong:
        print(line)
    if args.write and not wrong:
        write_text(ROOT / "docs/images/architecture.svg", svg(edges))
    print(f"{len(edges)} units, {sum(map(len, edges.values()))} arrows, {len(wrong)} of them wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
