"""The how-to pages: every command runs, and what the page shows of its answer is what it prints; every option named exists."""

from __future__ import annotations

import csv
import json
import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
from places import ORACLES, PROJECT

import rotor
from rotor.units import BOHR_RADIUS_ANGSTROM

PAGES = sorted((PROJECT / "docs" / "how_to").glob("*.md"))
PAGE_OF_OPTIONS = PROJECT / "docs" / "options.md"
LONGEST = 60  # rows of a page: about a screen


def shown(page: Path) -> list[tuple[str, list[str]]]:
    """Commands of a page with the lines shown of their answers; ... stands for lines left out."""
    commands: list[tuple[str, list[str]]] = []
    for block in re.findall(r"```console\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL):
        for line in block.splitlines():
            if line.startswith("$ rotor "):  # others are answers
                commands.append((line.removeprefix("$ rotor "), []))
            elif line != "...":
                commands[-1][1].append(line)
    return commands


def is_shown(line: str, printed: str) -> bool:
    """Whether a printed line is that of the page: words alike, numbers to two units of their last digit, as round-off makes them."""
    words, answer = line.split(), printed.split()
    if words[-1] == "...":
        words, answer = words[:-1], answer[: len(words) - 1]
    return len(words) == len(answer) and all(map(alike, words, answer))


def alike(word: str, printed: str) -> bool:
    if word == printed or not re.fullmatch(r"-?\d+\.\d+", word) or not re.fullmatch(r"-?\d+\.\d+", printed):
        return word == printed
    digits = len(word.split(".")[1])
    return digits == len(printed.split(".")[1]) and abs(float(word) - float(printed)) < 2.5 * 10.0**-digits


def write_files(name: str, page: Path) -> None:
    """The files that a page takes as the reader's."""
    text = page.read_text(encoding="utf-8")
    if name == "spcat_files":
        for suffix in ("int", "var"):
            shutil.copy(ORACLES / "vinylcl35_quad" / f"vinylcl35_quad.{suffix}", f"case.{suffix}")
        shutil.copy(ORACLES / "vinylcl35_quad" / "sample.cat", "program.cat")
    elif name == "fit_lines":
        rows = list(csv.reader((ORACLES / "fits" / "ocs.csv").read_text(encoding="utf-8").splitlines()))
        Path("lines.csv").write_text("".join(",".join(row[:4]) + "\n" for row in rows))
        assert (Path("lines.csv").read_text()).startswith(re.search(r"```text\n(.*?)```", text, re.DOTALL)[1])
    elif name == "hyperfine":
        rows = list(csv.DictReader((ORACLES / "hyperfine" / "hconh2.csv").read_text(encoding="utf-8").splitlines()))
        columns = [f"{quantum}_{level}" for level in ("upper", "lower") for quantum in ("n", "ka", "kc", "f")]
        lines = [[*row["upper"].split(), *row["lower"].split(), row["frequency_mhz"], row["error_mhz"]] for row in rows]
        head = [*columns, "frequency_mhz", "error_mhz"]
        Path("components.csv").write_text("".join(",".join(row) + "\n" for row in (head, *lines)))
    elif name == "structure":
        Path("ocs.toml").write_text(re.search(r"```toml\n(.*?)```", text, re.DOTALL)[1])
    elif name == "assign":
        top = rotor.Top.from_constants("A=4512.3 B=1890.7 C=1420.2 MHz", dipole_abc_debye=(1.2, 0.8, 0))
        lines = rotor.api.line_list(top, temperature_k=2.0, jmax=15, range_mhz=(6000, 18000))
        rng, height = np.random.default_rng(3), 100 * lines.intensity_nm2_mhz / lines.intensity_nm2_mhz.max()
        strong = height > 1
        frequency = lines.frequency_mhz[strong] + 0.003 * rng.normal(size=strong.sum())
        foreign = np.column_stack([rng.uniform(6000, 18000, 25), 2 * rng.random(25) ** -0.8])
        peaks = np.concatenate([np.column_stack([frequency, height[strong]]), foreign])
        np.savetxt("unknown.csv", peaks, delimiter=",", header="frequency_mhz,intensity", comments="", fmt="%.4f")
    elif name == "overlay":
        lines = rotor.spectrum("furan", temperature_k=2, range_mhz=(8000, 18000)).table
        height = lines.intensity_nm2_mhz / lines.intensity_nm2_mhz.max()
        np.savetxt(
            "peaks.csv", np.column_stack([lines.frequency_mhz, height])[height > 1e-3], delimiter=",",
            header="frequency_mhz,intensity", comments="",
        )  # fmt: skip
    elif name == "quantum_chemistry":
        shutil.copy(ORACLES / "outputs" / "water_psi4.out", "calc.out")
        shutil.copy(ORACLES / "spectro" / "h2o.hessian", "hessian.txt")
        case = json.loads((ORACLES / "spectro" / "spectro.json").read_text(encoding="utf-8"))["h2o"]
        rows = zip(case["symbols"], BOHR_RADIUS_ANGSTROM * np.array(case["positions_bohr"]), strict=True)
        atoms = [f"{symbol} {x:.10f} {y:.10f} {z:.10f}" for symbol, (x, y, z) in rows]
        Path("geometry.xyz").write_text("\n".join([str(len(atoms)), "", *atoms]) + "\n")
    elif name == "many_molecules":
        Path("list.csv").write_text(re.search(r"```text\n(.*?)```", text, re.DOTALL)[1])
        Path("many.toml").write_text(re.search(r"```toml\n(.*?)```", text, re.DOTALL)[1])


def slow_where_long(page: Path) -> object:
    """The box of molecules needs a quarter of a minute."""
    return pytest.param(page, id=page.stem, marks=[pytest.mark.slow] if page.stem == "fluid" else [])


@pytest.mark.parametrize("page", [slow_where_long(page) for page in PAGES])
def test_commands_answer_as_shown(page, call, folder):
    write_files(page.stem, page)
    for command, lines in shown(page):
        code, out, err = call(*shlex.split(command))
        assert code == 0, (command, err)
        printed = iter(out.splitlines())
        for line in lines:
            assert any(is_shown(line, each) for each in printed), (command, line, out)


def test_options_named_exist():
    known = set(re.findall(r"`(--[a-z][a-z-]+)", PAGE_OF_OPTIONS.read_text(encoding="utf-8")))
    for page in PAGES:
        for option in re.findall(r"(?<![\w-])--[a-z][a-z-]+", page.read_text(encoding="utf-8")):
            assert option in known, (page.name, option)


def test_a_page_is_about_a_screen():
    assert len(PAGES) >= 9
    for page in PAGES:
        assert len(page.read_text(encoding="utf-8").splitlines()) <= LONGEST, page.name
