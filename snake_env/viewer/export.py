"""Recorded runs as files: a page that needs no server and no network, and a film."""

from __future__ import annotations

import html
from pathlib import Path

import numpy as np

from snake_env._files import write_text
from snake_env.viewer.drawing import Drawing
from snake_env.viewer.frames import Frames
from snake_env.viewer.player import close, look_at, server

MOST = 400
"""Poses in a player of a notebook: its page is a part of the notebook."""


def page(frames: Frames, path: Path) -> Path:
    """Writes a self-contained page with a time line: play, pause, scrub, speed."""
    write_text(path, _html(frames))
    return path


def inline(frames: Frames, height: int = 480) -> str:
    """The page as an element of another one."""
    text = html.escape(_html(frames.every(-(-len(frames) // MOST))))
    return f'<iframe srcdoc="{text}" width="100%" height="{height}" style="border:0"></iframe>'


def _html(frames: Frames) -> str:
    made = server(port=0)
    try:
        look_at(made, frames)
        drawing = Drawing(made.scene, frames)
        recording = made.get_scene_serializer()
        for k, step in enumerate(np.diff(frames.time, append=frames.time[-1])):
            drawing.show(frames, k)
            recording.insert_sleep(float(step))
        return str(recording.as_html())
    finally:
        close(made)
