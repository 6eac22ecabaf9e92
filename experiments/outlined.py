"""Code that does arithmetic of wide registers without their instructions.

    python -m experiments.outlined                       # of the installed native module
    python -m experiments.outlined path/of/_native.abi3.so

A function of all widths is compiled with the instructions of its registers only where it is inlined into a kernel.
Where a closure or an adapter of an iterator is not, each operation becomes a call of a function that passes registers
by way of memory, which is up to ten times slower. Such code is listed with the number of calls, and the command fails.
What runs once, or robot by robot, is left out: functions of the project that have a name.

Needs ``objdump`` and a processor of the kind x86-64.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

NAME = re.compile(r"^[0-9a-f]+ <(.*)>:$")
CALL = re.compile(r"\s(?:call|jmp)\s+[0-9a-f]+ <core::core_arch::")
ADAPTED = re.compile(r"\{\{closure\}\}|^<?core::(?!core_arch)")
"""Names of closures, and of functions of the standard library that call one."""


def outlined(disassembly: str) -> Counter[str]:
    """Calls of vector instructions as functions, by the closure or adapter that makes them."""
    calls: Counter[str] = Counter()
    name = ""
    for line in disassembly.splitlines():
        if match := NAME.match(line):
            name = match[1]
        elif CALL.search(line) and ADAPTED.search(name):
            calls[name] += 1
    return calls


def disassemble(module: Path) -> str:
    """The functions of a native module, with names as in the sources."""
    command = ["objdump", "--disassemble", "--demangle", "--no-show-raw-insn", str(module)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def has_names(disassembly: str) -> bool:
    """Whether functions have names: wheels and `make build` strip them."""
    return "snake_core::" in disassembly


def is_possible() -> bool:
    """Whether the tool is installed."""
    return shutil.which("objdump") is not None


def main(arguments: list[str]) -> int:
    """Prints the list; the exit status is 1 where it has entries."""
    from snake_env import _native

    disassembly = disassemble(Path(arguments[0] if arguments else str(_native.__file__)))
    if not has_names(disassembly):
        sys.exit("the module has no names of functions: give target/release/lib_native.so of `cargo build --release`")
    found = outlined(disassembly)
    for name, calls in found.most_common():
        print(f"{calls:4d} {name}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
