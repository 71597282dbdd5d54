"""Nothing is lost: servers and pages of `rotor view` killed at random moments, and their session resumed."""

from __future__ import annotations

import os
import shutil

import pytest
from view_kills import kill_pages, kill_servers

pytest.importorskip("websockets.sync.client", reason="needs websockets (extra view)")
pytestmark = pytest.mark.skipif(os.name != "posix", reason="processes end by SIGKILL")
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


@pytest.mark.parametrize("moments", [5, pytest.param(50, marks=pytest.mark.slow(seconds=45))])
def test_a_killed_server_leaves_the_whole_session(tmp_path, moments):
    outcome = kill_servers(tmp_path, moments, seed=20261124)
    print(outcome)
    assert outcome.moments == moments
    assert outcome.acknowledged >= moments  # else the moments say little
    assert outcome.reads > moments


@pytest.mark.skipif(CHROMIUM is None, reason="no chromium on this machine")
@pytest.mark.parametrize("moments", [2, pytest.param(50, marks=pytest.mark.slow(seconds=105))])
def test_a_closed_or_crashed_page_loses_nothing(tmp_path, moments):
    playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright (extra test)")
    with playwright.sync_playwright() as started:
        try:
            browser = started.chromium.launch(
                executable_path=CHROMIUM, args=["--no-sandbox"] if os.geteuid() == 0 else []
            )
        except playwright.Error as error:  # an installed browser that this machine does not let run
            pytest.skip(f"Chromium does not start: {str(error).splitlines()[0]}")
        outcome = kill_pages(tmp_path, moments, 20261124, browser)
        browser.close()
    print(outcome)
    assert outcome.moments == moments
    assert outcome.acknowledged >= moments
    assert outcome.reads > moments
