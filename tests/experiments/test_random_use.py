"""Ten seconds of random use of viewer and playground, of which the command takes ten minutes; and a freeze is found."""

from __future__ import annotations

import time

import pytest

pytest.importorskip("playwright.sync_api")
pytest.importorskip("viser")
pytest.importorskip("PIL")

from experiments import browser_pictures, random_use

pytestmark = pytest.mark.skipif(browser_pictures.CHROMIUM is None, reason="Chromium is not installed")
SECONDS = 10.0


@pytest.mark.parametrize("page", list(random_use.PAGES))
def test_random_use_does_not_freeze_a_page(page, capsys):
    if page == "playground" and not (browser_pictures.PLAYGROUND / "pkg").exists():
        pytest.skip("built by `make playground`")
    assert random_use.main(["--minutes", str(SECONDS / 60.0), "--pages", page]) == 0
    assert "no standstill" in capsys.readouterr().out


def test_a_freeze_is_found(monkeypatch, capsys):
    from snake_env.viewer.live import Live

    def hangs(self, steps):
        time.sleep(0.2)
        return 0.0

    monkeypatch.setattr(Live, "_moves_on", hangs)
    monkeypatch.setattr(random_use, "STANDSTILL", 2.0)
    monkeypatch.setattr(random_use, "act", lambda *_: "nothing")
    assert random_use.main(["--minutes", "0.5", "--pages", "viewer"]) == 1
    assert "stands still" in capsys.readouterr().out
