"""Names that docstrings of training and experiments refer to exist."""

import re
from importlib import import_module
from pathlib import Path

import pytest

pytest.importorskip("torch")

ROOT = Path(__file__).parents[2]
REFERENCE = re.compile(r":(?:func|class|meth|mod|data):`((?:training|experiments|snake_env)\.[\w.]+)`")


def resolve(name: str) -> object:
    """The module, or what stands in one."""
    module, _, rest = name, "", []
    while True:
        try:
            found = import_module(module)
            break
        except ModuleNotFoundError:
            module, _, last = module.rpartition(".")
            rest.insert(0, last)
    for part in rest:
        found = getattr(found, part)
    return found


def test_references_in_docstrings_resolve():
    sources = [path for folder in ("training", "experiments") for path in (ROOT / folder).rglob("*.py")]
    found = {name: path for path in sources for name in REFERENCE.findall(path.read_text())}
    assert "snake_env.SnakeVectorEnv.step" in found
    for name, path in found.items():
        assert resolve(name) is not None, f"{path}: {name}"
