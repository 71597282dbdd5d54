"""The widget of `rotor view` in an executed notebook, and in JupyterLab and marimo in Chromium.

JupyterLab and marimo are tested where they, Playwright and Chromium are installed.
"""

from __future__ import annotations

import importlib.util
import json
import os
import re
import shutil
import socket
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest
from places import PROJECT
from view_cases import KELVIN, NAME, write_case

from rotor.viewer.session import read_session

pytest.importorskip("anywidget", reason="needs anywidget (extra view)")
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
CELLS = (
    f"import rotor\nwidget = rotor.view('spectrum.csv', {NAME!r}, temperature_k={KELVIN})\nwidget",
    "target = {'species': 1, 'upper': [3, 0, 3], 'lower': [2, 0, 2]}\n"
    "peak = widget.do('peak', first_mhz=16029.8, last_mhz=16030.6)['peak']\n"
    "widget.do('assign', frequency_mhz=peak['frequency_mhz'], error_mhz=peak['error_mhz'], to=[target])['label']",
)


def write_notebook(folder: Path) -> Path:
    """A notebook that shows the widget and assigns a line from Python."""
    write_case(folder)
    cells = [
        {"cell_type": "code", "id": f"cell{i}", "metadata": {}, "outputs": [], "execution_count": None, "source": code}
        for i, code in enumerate(CELLS)
    ]
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    content = {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
    path = folder / "session.ipynb"
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


@pytest.fixture
def environment(monkeypatch):
    """The package under test in the kernels of notebooks."""
    monkeypatch.setenv("PYTHONPATH", str(PROJECT))


@pytest.mark.filterwarnings("default")  # of Jupyter's packages
def test_an_executed_notebook_has_the_widget_and_the_line(tmp_path, environment):
    nbclient = pytest.importorskip("nbclient", reason="needs nbclient (extra docs)")
    nbformat = pytest.importorskip("nbformat", reason="needs nbformat (extra docs)")
    pytest.importorskip("ipykernel", reason="needs ipykernel (extra docs)")
    notebook = nbformat.read(write_notebook(tmp_path), as_version=4)
    nbclient.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(tmp_path)}}).execute()
    shown = notebook.cells[0].outputs[0].data["application/vnd.jupyter.widget-view+json"]
    state = notebook.metadata.widgets["application/vnd.jupyter.widget-state+json"]["state"]
    assert "export default" in state[shown["model_id"]]["state"]["_esm"]
    assert "assign 16030.18" in notebook.cells[1].outputs[0].data["text/plain"]
    assert [line.upper for line in read_session(tmp_path / "spectrum.view.json").state.lines.values()] == [(3, 0, 3)]


def address_in(log: Path, name: str) -> str:
    """The address of a notebook, once the server that writes the log answers."""
    for _ in range(300):
        match = re.search(r"http://127\.0\.0\.1:(\d+)/lab\?token=\w+", log.read_text())
        if match:
            with suppress(OSError), socket.create_connection(("127.0.0.1", int(match[1])), timeout=5):
                return match[0].replace("/lab?", f"/lab/tree/{name}?")
        time.sleep(0.1)
    raise AssertionError(log.read_text())


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("jupyterlab") is None, reason="needs JupyterLab: pip install jupyterlab")
@pytest.mark.skipif(CHROMIUM is None, reason="no chromium on this machine")
def test_the_widget_works_in_jupyterlab(tmp_path, environment):
    """Both cells are run in JupyterLab; the widget shows the line that Python assigned, and its button takes it back."""
    playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright (extra test)")
    notebook = write_notebook(tmp_path)
    root = hasattr(os, "geteuid") and os.geteuid() == 0
    words = [sys.executable, "-m", "jupyterlab", "--no-browser", "--ip=127.0.0.1", f"--ServerApp.root_dir={tmp_path}"]
    words += ["--ServerApp.port=0", "--allow-root"]
    log = tmp_path / "jupyter.log"
    with open(log, "w") as handle:
        server = subprocess.Popen(words, cwd=tmp_path, stdout=handle, stderr=subprocess.STDOUT)
    try:
        with playwright.sync_playwright() as started:
            browser = started.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"] if root else [])
            page = browser.new_page(viewport={"width": 1500, "height": 1000})
            page.goto(address_in(log, notebook.name))
            page.wait_for_selector(".jp-Notebook .jp-Cell", timeout=60_000)
            page.wait_for_selector("text=/\\| Idle/", timeout=60_000)  # the kernel, in the status bar
            page.click(".jp-Notebook .jp-Cell >> nth=0")
            for _ in CELLS:
                page.keyboard.press("Shift+Enter")
            page.wait_for_selector(".rotor-view[data-ready=yes]", timeout=60_000)
            page.click(".rotor-view #tab-Lines")
            page.wait_for_selector(".rotor-view >> text=3 0 3 ← 2 0 2", timeout=30_000)
            head, body = (
                page.locator(f".rotor-view {part}").bounding_box() for part in ("thead th >> nth=2", "td >> nth=2")
            )
            assert head["x"] == pytest.approx(body["x"], abs=1)  # not styled as tables of outputs are
            page.click(".rotor-view >> text=Undo")
            page.wait_for_selector(".rotor-view >> text=0 of 0 lines", timeout=30_000)
            browser.close()
        assert read_session(tmp_path / "spectrum.view.json").state.lines == {}
    finally:
        server.terminate()
        server.wait(30)


MARIMO = f"""import marimo

app = marimo.App()


@app.cell
def _():
    import rotor

    widget = rotor.view("spectrum.csv", {NAME!r}, temperature_k={KELVIN})
    widget
    return (widget,)


@app.cell
def _(widget):
    target = {{"species": 1, "upper": [3, 0, 3], "lower": [2, 0, 2]}}
    widget.do("assign", frequency_mhz=16030.188, error_mhz=0.002, to=[target])["label"]
    return
"""


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("marimo") is None, reason="needs marimo: pip install marimo")
@pytest.mark.skipif(CHROMIUM is None, reason="no chromium on this machine")
def test_the_widget_works_in_marimo(tmp_path, environment):
    """The widget shows the line that the second cell assigns, and its button takes it back."""
    playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright (extra test)")
    write_case(tmp_path)
    (tmp_path / "session.py").write_text(MARIMO, encoding="utf-8")
    root = hasattr(os, "geteuid") and os.geteuid() == 0
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    words = [sys.executable, "-m", "marimo", "run", "session.py", "--headless", "--no-token", "--host", "127.0.0.1"]
    log = tmp_path / "marimo.log"
    with open(log, "w") as handle:
        server = subprocess.Popen([*words, "--port", f"{port}"], cwd=tmp_path, stdout=handle, stderr=subprocess.STDOUT)
    try:
        for _ in range(300):
            with suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=5):
                break
            time.sleep(0.1)
        with playwright.sync_playwright() as started:
            browser = started.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"] if root else [])
            page = browser.new_page(viewport={"width": 1500, "height": 1000})
            page.goto(f"http://127.0.0.1:{port}/")
            page.wait_for_selector(".rotor-view[data-ready=yes]", timeout=90_000)
            page.click(".rotor-view #tab-Lines")
            page.wait_for_selector(".rotor-view >> text=3 0 3 ← 2 0 2", timeout=30_000)
            page.click(".rotor-view >> text=Undo")
            page.wait_for_selector(".rotor-view >> text=0 of 0 lines", timeout=30_000)
            browser.close()
        assert read_session(tmp_path / "spectrum.view.json").state.lines == {}
    finally:
        server.terminate()
        server.wait(30)
