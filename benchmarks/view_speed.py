"""`rotor view` on a million points: first view, pan and zoom, refit with redrawing, Loomis-Wood rows, 100,000 predicted lines.

    python benchmarks/view_speed.py [FOLDER]

Wall time and processor time of the answers of Python (median of repeated messages), and, where Playwright and Chromium are installed, times
of the page: from the listening server to the first picture, and from a key to the redrawn spectrum.
"""

from __future__ import annotations

import math
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from rotor.fitting.assignment import assignments
from rotor.formats.lines.assigned_lines import write_assigned_lines
from rotor.formats.molecules.molecule_file import MoleculeFile
from rotor.formats.molecules.molecule_writer import write_molecule_file
from rotor.observed.spectrum import observed_spectrum
from rotor.spectra.lines import line_list
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top
from rotor.viewer.opening import open_session
from rotor.viewer.records import SpectrumFile
from rotor.viewer.service import Service
from rotor.viewer.session import Session

POINTS = 1_000_000
BAND = (6000.0, 18000.0)
SMALL = Constants(A=9000.0, B=3000.0, C=2400.0, DeltaJ=0.001, DeltaJK=0.002, DeltaK=0.01, deltaJ=1e-4, deltaK=1e-3)
LONG = Constants(A=3000.0, B=120.0, C=115.0)  # rows of a series 235 MHz apart
FREE = ["A", "B", "C", "DeltaJ", "DeltaJK", "DeltaK", "deltaJ", "deltaK"]


def write_case(folder: Path) -> None:
    """A spectrum of a million points, three molecules, 500 assigned lines."""
    x = np.linspace(*BAND, POINTS)
    y = 0.002 * np.random.default_rng(1).normal(size=POINTS)
    top = Top.from_constants(SMALL, dipole_abc_debye=(2, 1, 0.5))
    lines = line_list(top, range_mhz=BAND, temperature_k=10)
    heights = lines.intensity_nm2_mhz / lines.intensity_nm2_mhz.max()
    for centre, height in zip(lines.frequency_mhz.tolist(), heights.tolist(), strict=True):
        a, b = np.searchsorted(x, (centre - 1, centre + 1))
        y[a:b] += height * np.exp(-(((x[a:b] - centre) / 0.06) ** 2))
    np.savetxt(
        folder / "spectrum.csv",
        np.column_stack([x, y]),
        delimiter=",",
        fmt="%.6f",
        header="frequency_mhz,intensity",
        comments="",
    )
    sources = {"constants": "made for a benchmark", "dipole": "made for a benchmark"}
    for name, constants in (("small", SMALL), ("long", LONG)):
        write_molecule_file(
            MoleculeFile(name, constants=constants, dipole_abc_debye=(2, 1, 0.5), sources=sources),
            folder / f"{name}.toml",
        )
    wide = line_list(top, range_mhz=(6000, 60000), temperature_k=10).strongest(500)
    names = ("j", "ka", "kc")
    labels = [np.stack([wide.levels.quanta[name][side] for name in names], axis=1) for side in (wide.upper, wide.lower)]
    noise = 0.01 * np.random.default_rng(2).normal(size=len(wide))
    write_assigned_lines(assignments(names, *labels, wide.frequency_mhz + noise, 0.01), folder / "lines.csv")


def timed(call: Callable[[int], Any], repeats: int = 11) -> tuple[float, float, int]:
    """Median wall and processor time (ms) of a call, and the bytes of its answer."""
    wall, processor, size = [], [], 0
    for i in range(repeats):
        begun, used = time.perf_counter(), time.process_time()
        answer = msgspec.json.encode(call(i))
        wall.append(1e3 * (time.perf_counter() - begun))
        processor.append(1e3 * (time.process_time() - used))
        size = len(answer)
        assert b'"error"' not in answer[:20], answer[:300]
    return statistics.median(wall), statistics.median(processor), size


def measure_python(folder: Path) -> None:
    """Answers of Python to the messages of a page."""
    begun, used = time.perf_counter(), time.process_time()
    service = open_session(
        folder / "spectrum.csv", [str(folder / "small.toml")], lines=str(folder / "lines.csv"), temperature_k=10.0
    )
    say("spectrum and lines opened", 1e3 * (time.perf_counter() - begun), 1e3 * (time.process_time() - used), 0)

    def ask(name: str, **message: Any) -> Any:
        return service.answer({"do": name, **message})

    def window(i: int, width: float = 500.0, **more: Any) -> Any:
        first = 6000.0 + 37.0 * i
        return ask("window", first_mhz=first, last_mhz=first + width, pixels=2000, **more)

    ask("free", species=1, free=FREE)
    say("whole band, 2000 pixels", *timed(lambda i: window(i, 12000.0)))
    say("pan of 500 MHz", *timed(window))
    say("zoom to 5 MHz", *timed(lambda i: window(i, 5.0)))
    say(
        "constant moved by its slider, redrawn",
        *timed(lambda i: window(i, preview={"species": 1, "constants": {"A": 9000 + 0.01 * i}})),
    )

    def refit(i: int) -> Any:
        """A constant moved away, 500 lines refitted, spectrum, sticks and residuals redrawn."""
        ask("constants", species=1, constants={"A": 9000.0 + 0.001 * (i + 1)})
        begun = ask("refit", species=1)
        return [begun, window(0), service.facts()]

    say("500 lines refitted and redrawn", *timed(refit))
    ask("edit", lines=[250], frequency_mhz=service.session.state.lines[250].frequency_mhz + 20.0)
    say("the same with a wrong line, which is looked for", *timed(refit))
    ask("add_species", source=str(folder / "long.toml"), temperature_k=10.0)
    ask("series", series={"species": 2, "upper": [40, 0, 40], "lower": [39, 0, 39], "step": [1, 0, 1]})
    rows = ask("loomis_wood", half_width_mhz=20.0, pixels=400, rows=50)["ok"]["rows"]
    say(
        f"{len(rows)} Loomis-Wood rows",
        *timed(lambda i: ask("loomis_wood", half_width_mhz=20.0 + i, pixels=400, rows=50)),
    )
    service.session.release()


def measure_many_lines(folder: Path) -> None:
    """More than 100,000 predicted lines over a spectrum of a million points from 6 to 700 GHz."""
    x = np.linspace(6000.0, 700_000.0, POINTS)
    y = np.random.default_rng(3).normal(size=POINTS)
    service = Service(Session(SpectrumFile("", "", 0)), observed_spectrum(x, y, noise=1.0))
    begun, used = time.perf_counter(), time.process_time()
    service.answer({"do": "add_species", "source": str(folder / "small.toml"), "temperature_k": 300.0})
    count = len(service.predictions.lines(service.session.state.species[1]).lines)
    say(f"{count} lines predicted, once", 1e3 * (time.perf_counter() - begun), 1e3 * (time.process_time() - used), 0)

    def window(i: int, width: float) -> Any:
        first = 6000.0 + 1000.0 * i
        return service.answer({"do": "window", "first_mhz": first, "last_mhz": first + width, "pixels": 2000})

    say(f"whole band with {count} lines", *timed(lambda i: window(i, 694_000.0)))
    say(f"pan of 20 GHz with {count} lines", *timed(lambda i: window(i, 20_000.0)))


def measure_page(folder: Path) -> None:
    """The page in Chromium."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        print("no playwright: times of the page are not measured")
        return
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if chromium is None:
        print("no chromium: times of the page are not measured")
        return
    root = hasattr(os, "geteuid") and os.geteuid() == 0
    with sync_playwright() as started:
        browser = started.chromium.launch(executable_path=chromium, args=["--no-sandbox"] if root else [])
        page = browser.new_page(viewport={"width": 1400, "height": 860})
        begun = time.perf_counter()
        words = [sys.executable, "-m", "rotor", "view", "spectrum.csv", "small.toml", "--temperature", "10"]
        words += ["--session", "page.view.json", "--no-browser"]
        process = subprocess.Popen(words, cwd=folder, stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        address = process.stdout.readline().strip()
        listening, used = time.perf_counter(), processor_ms(process.pid)
        page.goto(address)
        page.wait_for_selector("[data-drawn=yes]", timeout=60_000)
        drawn, used_later = time.perf_counter(), processor_ms(process.pid)
        page.wait_for_selector("[data-ready=yes]", timeout=60_000)
        say("command to listening server", 1e3 * (listening - begun), used, 0)
        say("listening server to first picture", 1e3 * (drawn - listening), used_later - used, 0)
        say("listening server to residuals and panels", 1e3 * (time.perf_counter() - listening), None, 0)
        steps = page.evaluate(
            """async () => { const v = rotorView, w = v.active, out = [];
            v.show(12000, w, 500);
            for (let i = 0; i < 25; i++) {
              const begun = performance.now(); w.go(w.first + 11, w.last + 11);
              while (w.busy) await new Promise((d) => setTimeout(d, 1));
              await new Promise((d) => requestAnimationFrame(() => setTimeout(d, 0))); out.push(performance.now() - begun); }
            return out; }"""
        )
        say("pan step of the page, answered and drawn", statistics.median(steps), None, 0)
        browser.close()
        process.terminate()
        process.wait(10)


def processor_ms(pid: int) -> float:
    """Processor time of another process; nan where the system has no /proc."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return math.nan
    return 1e3 * (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def say(what: str, wall: float, processor: float | None, size: int) -> None:
    """One row."""
    used = "" if processor is None else f"{processor:9.1f} ms processor"
    print(
        f"{what:45s} {wall:9.1f} ms wall {used} {size / 1e3:8.0f} kB"
        if size
        else f"{what:45s} {wall:9.1f} ms wall {used}",
        flush=True,
    )


def main() -> None:
    """Measure in a folder, by default a temporary one."""
    with tempfile.TemporaryDirectory(prefix="rotor-view-speed-") as temporary:
        folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(temporary)
        folder.mkdir(exist_ok=True)
        write_case(folder)
        measure_python(folder)
        measure_many_lines(folder)
        measure_page(folder)


if __name__ == "__main__":
    main()
