"""Play back a recorded run in the browser: play, pause, scrub, speed, plots."""

from __future__ import annotations

import threading
import time
from contextlib import redirect_stdout
from io import StringIO
from typing import Any

import numpy as np

from snake_env._extras import extras
from snake_env.viewer.camera import Follower, look_at
from snake_env.viewer.controls import Slider, checkbox
from snake_env.viewer.drawing import Drawing
from snake_env.viewer.frames import Frames
from snake_env.viewer.gate import guarded
from snake_env.viewer.plots import Plots

with extras():
    import viser

SPEEDS = (0.1, 4.0, 0.1, 1.0)
"""Slowest and fastest that runs are shown, the step between two speeds, and the first one; times real time."""
TICK = 1 / 30
"""Time between two pictures [s]."""


def server(host: str = "127.0.0.1", port: int = 8080) -> Any:
    """A viser server with z up; the next free port if this one is taken.

    Raises:
        RuntimeError: this version of viser cannot be guarded.
    """
    with guarded(host) as guards, redirect_stdout(StringIO()):  # of its banner
        made = viser.ViserServer(host=host, port=port, label="snake_env", verbose=False)
    if not guards:
        close(made)
        raise RuntimeError("this version of viser answers everybody: install viser 1.1")
    made.scene.set_up_direction("+z")
    made.scene.configure_default_lights(enabled=False)  # a drawing brings its own
    made.scene.configure_environment_map(None)
    made.gui.configure_theme(show_share_button=False)
    made.gui.main_panel.dock_right()
    return made


def close(made: Any) -> None:
    """Stops a server without a word."""
    with redirect_stdout(StringIO()):
        made.stop()


class Player:
    """A page that plays frames; runs until :meth:`stop`.

    Args:
        frames: poses.
        host: interface that serves the page.
        port: of the page; the next free one if it is taken.
    """

    def __init__(self, frames: Frames, host: str = "127.0.0.1", port: int = 8080) -> None:
        self.frames = frames
        self.server = server(host, port)
        self._drawing = Drawing(self.server.scene, frames)
        look_at(self.server, frames)
        gui = self.server.gui
        self.playing = checkbox(gui, "playing", True)
        self.time = Slider(gui, "time [s]", float(frames.time[0]), float(frames.time[-1]), 0.001, 0.0)
        self.speed = Slider(gui, "speed", *SPEEDS)
        self.camera = Follower(self.server, initial=False)
        Plots(gui).show(frames)
        self.time.on_update(self._draw)
        self._running = threading.Event()
        self._running.set()
        self._thread = threading.Thread(target=self._play, daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        """Of the page."""
        return f"http://{self.server.get_host()}:{self.server.get_port()}"

    def stop(self) -> None:
        """Closes the page."""
        self._running.clear()
        self._thread.join()
        close(self.server)

    def wait(self) -> None:
        """Returns when the process is interrupted."""
        while self._running.is_set():
            time.sleep(0.2)

    def _draw(self) -> None:
        k = int(np.searchsorted(self.frames.time, self.time.value - 1e-9))
        k = min(k, len(self.frames) - 1)
        self._drawing.show(self.frames, k)
        self.camera.show(self.frames, k)

    def _play(self) -> None:
        last = time.perf_counter()
        while self._running.is_set():
            time.sleep(TICK)
            now = time.perf_counter()
            if self.playing.value:
                ahead = self.time.value + (now - last) * self.speed.value
                end = float(self.frames.time[-1])
                self.time.value = ahead if ahead <= end else float(self.frames.time[0])
                self._draw()
            last = now
