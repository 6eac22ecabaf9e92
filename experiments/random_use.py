"""Drives the viewer and the playground at random in a browser, and fails where one of them stands still.

    python -m experiments.random_use --minutes 10

Clicks, drags, keys, sliders, lists, numbers and buttons come in random order. After each of them the time that the page
shows has to go on, and nothing may have been reported on the page's console as an error. Needs Chromium, playwright and
`make playground`.
"""

from __future__ import annotations

import argparse
import re
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from experiments import browser_pictures

SIZE = {"width": 1000, "height": 700}
STANDSTILL = 60.0
"""Without a change of the time that a page shows, while it plays, this is a freeze [s]."""
CONTROLS = "input:visible, select:visible, button:visible"
KEYS = ("ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "+", "-", "Escape")


@contextmanager
def viewer(browser: Any) -> Iterator[tuple[Any, str, Callable[[], None]]]:
    """Its page, what finds the controls on it, and what lets a paused or folded one go on."""
    from snake_env.evaluation import tasks
    from snake_env.viewer.live import Live

    live = Live(tasks.load()["field-medium"], "general", port=0)

    page = browser.new_page(viewport=SIZE)

    def play() -> None:
        live.playing.value = True
        if not page.get_by_text("playing", exact=True).is_visible():
            page.get_by_text("snake_env", exact=True).click()  # a click there folds the controls, and unfolds them

    try:
        page.goto(live.url)
        page.get_by_text("amplitude [deg]").wait_for(timeout=60_000)
        # Of the buttons only its own: others ask servers elsewhere for an address.
        yield page, "input:visible, button:visible:has-text('restart')", play
    finally:
        live.stop()


@contextmanager
def playground(browser: Any) -> Iterator[tuple[Any, str, Callable[[], None]]]:
    """The same of the playground."""
    with browser_pictures.served(browser_pictures.PLAYGROUND) as url:
        page = browser_pictures.opened_playground(browser, url, "task=field", SIZE)
        yield page, CONTROLS, lambda: page.evaluate("playground.setPlaying(true)")


def act(page: Any, controls: str, random: np.random.Generator) -> str:
    """One random action; its kind. What vanishes under the pointer, or lies under something else, is no fault."""
    from playwright.sync_api import Error

    kind = str(random.choice(["click", "double", "drag", "key", "control", "control"]))
    x, y, to_x, to_y = (float(random.uniform(20, side - 20)) for side in (*SIZE.values(), *SIZE.values()))
    try:
        if kind == "click":
            page.mouse.click(x, y)
        elif kind == "double":
            page.mouse.dblclick(x, y)
        elif kind == "drag":
            page.mouse.move(x, y)
            page.mouse.down()
            page.mouse.move(to_x, to_y, steps=5)
            page.mouse.up()
        elif kind == "key":
            page.keyboard.press(str(random.choice(KEYS)), delay=float(random.uniform(0, 500)))
        else:
            found = page.locator(controls).all()
            change(page, found[random.integers(len(found))], random)
    except Error:
        return f"{kind}, in vain"
    return kind


def change(page: Any, control: Any, random: np.random.Generator) -> None:
    """Sets one control of a page to something."""
    tag, kind, role = control.evaluate("one => [one.tagName, one.type, one.getAttribute('aria-haspopup')]")
    if tag == "SELECT":
        options = control.locator("option").evaluate_all("all => all.map(one => one.value)")
        control.select_option(str(random.choice(options)), timeout=3000)
    elif kind == "range":
        control.evaluate(
            "(one, share) => { one.value = +one.min + share * (one.max - one.min);"
            " one.dispatchEvent(new Event('input')); one.dispatchEvent(new Event('change')); }",
            float(random.random()),
        )
    elif role == "listbox":
        control.click(timeout=3000)
        options = page.locator("[role=option]:visible").all()
        options[random.integers(len(options))].click(timeout=3000)
    elif tag == "INPUT" and kind == "text":
        control.fill(str(random.choice(["0", "1", "7", "0.3", "40", "1e9", "-3", "x"])), timeout=3000)
        control.press("Enter")
    else:
        control.click(timeout=3000)


def shown(page: Any) -> str:
    """What the page says of time and episodes."""
    text = page.evaluate("document.body.innerText")
    return " ".join(re.findall(r"[\d.]+ s · .*|goals \d+ of \d+", text))


def use(name: str, minutes: float, seed: int) -> Counter[str]:
    """Uses one of the two for a time.

    Raises:
        RuntimeError: it stood still, or its page reported an error.
    """
    random, done, reported = np.random.default_rng(seed), Counter[str](), []
    with browser_pictures.browser() as browser, PAGES[name](browser) as (page, controls, play):
        page.on("pageerror", lambda error: reported.append(str(error)))
        end = time.monotonic() + 60.0 * minutes
        while time.monotonic() < end:
            before = shown(page)
            kind = act(page, controls, random)
            done[kind] += 1
            limit = time.monotonic() + STANDSTILL
            while shown(page) == before:
                # Again and again: a pause that was clicked may arrive after the first call.
                play()
                if time.monotonic() > limit:
                    raise RuntimeError(f"{name} stands still after {done.total()} actions, the last one: {kind}")
                page.wait_for_timeout(500)
            if reported:
                raise RuntimeError(f"{name} after {done.total()} actions: {reported[0]}")
        page.close()
    return done


PAGES = {"viewer": viewer, "playground": playground}


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; 1 if a page stood still or reported an error."""
    cli = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    cli.add_argument("--minutes", type=float, default=10.0, help="of each")
    cli.add_argument("--seed", type=int, default=0, help="of the actions")
    cli.add_argument("--pages", nargs="+", choices=list(PAGES), default=list(PAGES))
    args = cli.parse_args(arguments)
    for name in args.pages:
        try:
            done = use(name, args.minutes, args.seed)
        except RuntimeError as error:
            print(error)
            return 1
        counts = ", ".join(f"{count} {kind}" for kind, count in sorted(done.items()))
        print(f"{name}: {args.minutes:g} min, {done.total()} actions ({counts}), no standstill, no error")
    return 0


if __name__ == "__main__":
    sys.exit(main())
