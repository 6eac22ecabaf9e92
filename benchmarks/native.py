"""The measuring program ``snake-bench``: building it, running it, reading its results as they come."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Thread
from typing import IO, Any

ROOT = Path(__file__).resolve().parents[1]
PARTS = ("precision", "spatial", "growth", "skip", "certificate")
WIDTH = "SNAKE_ENV_LANES"
"""Environment variable that prescribes the number of robots per register."""

Progress = Callable[[str], None]


def build() -> Path:
    """Compiles the program if need be and returns its path."""
    command = ["cargo", "build", "--release", "--quiet", "--package", "snake-bench", "--message-format=json"]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    messages = map(json.loads, done.stdout.splitlines())
    programs = [m["executable"] for m in messages if m.get("target", {}).get("name") == "snake-bench"]
    return Path(programs[-1])


def measure(
    program: Path, arguments: list[str], progress: Progress, lanes: int | None = None
) -> Iterator[dict[str, Any]]:
    """Runs the program and yields its results, one by one.

    Args:
        program: path.
        arguments: of its command line.
        progress: takes its messages.
        lanes: robots per register; None: as many as the processor has room for.

    Raises:
        subprocess.CalledProcessError: the program failed.
    """
    command = [os.fspath(program), *arguments]
    environment = os.environ | ({} if lanes is None else {WIDTH: str(lanes)})
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        speaker = Thread(target=_pass_on, args=(process.stderr, progress), daemon=True)
        speaker.start()
        try:
            for line in process.stdout:
                yield json.loads(line)
        except BaseException:
            process.terminate()
            raise
        speaker.join()
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)


def _pass_on(lines: IO[str], progress: Progress) -> None:
    for line in lines:
        progress(line.rstrip())
