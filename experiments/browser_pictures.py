"""Pictures of what runs in a browser: the viewer, the playground, and a 3D film of sidewinding.

Needs Chromium (Debian's package, or any other on the PATH) and playwright.
"""

from __future__ import annotations

import io
import shutil
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from snake_env.evaluation import film
from snake_env.evaluation.tasks import BenchmarkTask

DOCS = Path(__file__).parents[1] / "docs"
PLAYGROUND = DOCS / "playground"
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = [
    "--no-sandbox",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
]
"""Of a browser on a machine without a graphics card."""
SIZE = {"width": 1280, "height": 720}
FILM = {"width": 560, "height": 336}
VIEWER_STEPS = 60
"""Control periods from the start to the picture of the viewer."""
FILM_STEPS = 90
"""Control periods of the film, each a picture: one period of the gait in 20 pictures per second."""


@contextmanager
def browser() -> Iterator[Any]:
    """A headless Chromium."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield opened
        opened.close()


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *_: Any) -> None:
        """Prints nothing."""


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """The address at which a server on this machine has the files of a folder."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_address[1]}"
    server.shutdown()
    server.server_close()


def opened_playground(opened: Any, url: str, query: str, size: dict[str, int]) -> Any:
    """The page of the playground, once its robot is there."""
    page = opened.new_page(viewport=size)
    page.goto(f"{url}/index.html?{query}")
    page.wait_for_function("window.playground !== undefined", timeout=60_000)
    return page


def viewer(opened: Any, folder: Path) -> Path:
    """The viewer with a policy in a hard field."""
    from snake_env.viewer.live import Live

    live = Live(BenchmarkTask("field-hard", "SnakeField-v1", {"difficulty": 1.0}, ""), "general", port=0)
    try:
        live.playing.value = False
        live.advance(VIEWER_STEPS)
        page = opened.new_page(viewport=SIZE)
        page.goto(live.url)
        page.get_by_text("amplitude [deg]").wait_for(timeout=60_000)
        page.add_style_tag(content=".mantine-Notifications-root { display: none }")  # on missing graphics cards
        page.wait_for_timeout(5000)
        page.screenshot(path=folder / "viewer.png", timeout=120_000)
        page.close()
    finally:
        live.stop()
    return folder / "viewer.png"


def playground(opened: Any, folder: Path) -> Path:
    """The playground with a policy in a field."""
    with served(PLAYGROUND) as url:
        page = opened_playground(opened, url, "task=field&driver=general&seed=3&paused", SIZE)
        page.evaluate("for (let k = 0; k < 60; k++) playground.step()")
        page.wait_for_timeout(2000)
        page.screenshot(path=folder / "playground.png", timeout=120_000)
        page.close()
    return folder / "playground.png"


def sidewinding(opened: Any, folder: Path) -> Path:
    """The 3D model without pegs, which sidewinds under action zero; the camera follows."""
    frames = []
    with served(PLAYGROUND) as url:
        page = opened_playground(opened, url, "model=spatial&task=free&driver=gait&paused&seed=1", FILM)
        page.add_style_tag(content="#panel, #bar, #help, #measured, #steer { display: none !important }")
        page.evaluate("playground.view.camera.position.lerp(playground.view.controls.target, 0.35)")
        for _ in range(FILM_STEPS):
            page.evaluate("playground.step()")
            page.wait_for_timeout(50)
            shot = Image.open(io.BytesIO(page.screenshot(timeout=120_000))).convert("RGB")
            frames.append(np.asarray(shot))
        page.close()
    return film.write_gif(frames, folder / "sidewinding.gif", milliseconds=50)
