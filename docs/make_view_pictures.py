"""The screenshots of docs/view.md: a session of a new user, in Chromium.

    python docs/make_view_pictures.py [FOLDER]      # by default docs/pictures

Needs the extras `view` and `test` and Chromium. The spectrum is that of tests/helpers/view_cases.py.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "helpers")]


def main() -> None:
    """Write every picture."""
    from playwright.sync_api import sync_playwright
    from view_cases import KELVIN, NAME, write_case

    from rotor.viewer.opening import open_session
    from rotor.viewer.server import ViewServer

    target = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "pictures"
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
    root = hasattr(os, "geteuid") and os.geteuid() == 0
    with tempfile.TemporaryDirectory() as place, sync_playwright() as started:
        browser = started.chromium.launch(executable_path=chromium, args=["--no-sandbox"] if root else [])
        spectrum = write_case(Path(place))
        for molecules, session, steps in (([str(Path(place) / NAME)], "known", KNOWN), ([], "unknown", UNKNOWN)):
            file = Path(place) / f"{session}.view.json"
            service = open_session(spectrum, molecules, session=file, temperature_k=KELVIN)
            server = ViewServer(service)
            thread = server.run_in_thread()
            page = browser.new_page(viewport={"width": 1280, "height": 760})
            page.goto(server.address)
            page.wait_for_selector("[data-ready=yes]")
            for step in steps:
                step(page)
                page.wait_for_timeout(900)
                if step.__name__.startswith("view_"):
                    page.screenshot(path=target / f"{step.__name__}.png")
            page.close()
            server.stop()
            thread.join(10)
            service.session.release()
        browser.close()


def press(page: Any, *keys: str) -> None:
    """Keys, one after the other."""
    for key in keys:
        page.keyboard.press(key)
        page.wait_for_timeout(250)


def view_opened(page: Any) -> None:
    """The whole band."""


def view_peak(page: Any) -> None:
    """A peak fitted."""
    page.evaluate("rotorView.show(16027, null, 30)")
    page.wait_for_timeout(500)
    press(page, "n", "f")


def assigned(page: Any) -> None:
    """Six lines assigned."""
    press(page, "Enter")
    for frequency in (10755.0, 11398.5, 10586.0, 14602.0, 15730.0):
        page.evaluate(f"rotorView.show({frequency}, null, 12)")
        page.wait_for_timeout(500)
        press(page, "n", "f", "Enter")


def view_fitted(page: Any) -> None:
    """Refitted, with what moved."""
    press(page, "r", "3")


def view_rows(page: Any) -> None:
    """Loomis-Wood rows."""
    press(page, "4")
    page.fill('[data-field="series.upper"]', "6 1 5")
    page.fill('[data-field="series.lower"]', "6 0 6")
    page.click("text=Show rows >> nth=0")


def view_dark(page: Any) -> None:
    """The list of lines, dark."""
    press(page, "l", "2", "t", "0")


def view_searched(page: Any) -> None:
    """Species and lines of `rotor assign` from the spectrum alone."""
    page.click("text=Search unknown molecules")
    page.wait_for_selector("text=species 1", timeout=60_000)
    page.wait_for_timeout(1000)
    press(page, "3")


def view_levels(page: Any) -> None:
    """Refitted; levels and combination differences of the assigned lines."""
    press(page, "r", "5")


KNOWN = (view_opened, view_peak, assigned, view_fitted, view_rows, view_dark)
UNKNOWN = (view_searched, view_levels)

if __name__ == "__main__":
    main()
