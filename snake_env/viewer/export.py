"""Recorded runs as files: a page that needs no server and no network, and a film."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from snake_env._files import write_text
from snake_env.viewer.drawing import Drawing
from snake_env.viewer.frames import Frames
from snake_env.viewer.player import close, look_at, server


def page(frames: Frames, path: Path) -> Path:
    """Writes a self-contained page with a time line: play, pause, scrub, speed."""
    made = server(port=0)
    try:
        look_at(made, frames)
        drawing = Drawing(made.scene, frames)
        recording = made.get_scene_serializer()
        for k, step in enumerate(np.diff(frames.time, append=frames.time[-1])):
            drawing.show(frames, k)
            recording.insert_sleep(float(step))
        write_text(path, recording.as_html())
    finally:
        close(made)
    return path
