"""Cases of the reference program, by two routes, and a comparison line by line.

One route reads the program's own .int and .var; the other makes top and lines from the words of case.json, with the
published names of the constants.
"""

from __future__ import annotations

import contextlib
import importlib.util
import io
import json
import warnings
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest import mock

import numpy as np
from places import ORACLES

from rotor.formats.spcat.predict import Prediction, predict_file
from rotor.formats.spcat.text.catalogue import Catalogue
from rotor.formats.spcat.text.egy import LevelList
from rotor.spectra.lines import Lines, line_list
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top
from rotor.units import MHZ_PER_CM

SAMPLES = ORACLES
WORDED = ("abc_rigid_j20_all", "hard_nearsym_j150", "h2o_quartic_diag3", "abc_sred", "ocs", "hc3n", "ch3cn")
CASES = (*WORDED, "abc_ared6", "h2co", "h2o_octic", "h2o_sextic", "pyridine_oblate_s", "so2")
COUPLED = (
    "asym_spinrot", "ch2cl2_2quad", "ch3cn_quad", "formamide_quad", "hcn_quad", "three_states_fermi_coriolis",
    "tunnelling_doublet_quad", "two_state_coriolis", "vinylcl35_quad",
)  # fmt: skip  # spins, several states
BIG = ("abc_ared6", "abc_sred", "hard_nearsym_j150", "pyridine_oblate_s")
_PUBLISHED = {"-DelJ": "DeltaJ", "-DelJK": "DeltaJK", "-DelK": "DeltaK", "-delJ": "deltaJ", "-delK": "deltaK"}
_WEIGHTS = {
    "IAX=2: 1:3": {"ee": 1, "eo": 3, "oe": 3, "oo": 1},
    "IAX=6 (3-fold), WTPL=WTMN=2, EWT=1: K mod 3 = 0 weight 2, else weight 1 (see .egy degeneracy)": {"0": 2, "1": 1, "2": 1},
}  # fmt: skip


def top_of_case(case: dict[str, Any]) -> Top:
    """Constants by their published names (a label "-D" is minus D), dipole, spin weights."""
    parameters = {p["label"]: p["value"] for p in case["parameters"]}
    values = {
        _PUBLISHED.get(k, k.removeprefix("-")): -v if k.startswith("-") else v
        for k, v in parameters.items()
        if k != "A-B"
    }
    if "A-B" in parameters:
        values = {"A": parameters["A-B"] + parameters["B"]} | values
    reduction = case["reduction"][-1] if case["reduction"].startswith("Watson") else None
    dipole = {d["component"]: d["value"] for d in case["dipoles_debye"]}
    return Top.from_constants(
        Constants(reduction=reduction, **values),
        dipole_abc_debye=[dipole.get(axis, 0.0) for axis in "abc"],
        spin_weights=_WEIGHTS.get(case["spin_statistics"]),
    )


def lines_of_case(case: dict[str, Any]) -> Lines:
    """The case's list: its Q, limits and cut 10^STR0 + 10^STR1 (ν/300 GHz)², which counts one component of a K doublet."""
    lines = line_list(
        top_of_case(case),
        temperature_k=case["temperature_K"],
        q=case["qrot_used"],
        jmax=case["fend"],
        min_lgint=None,
        range_mhz=(0.0, case["frequency_limit_GHz"] * 1e3),
    )
    least = 10.0 ** case["str0"] + 10.0 ** case["str1"] * (lines.frequency_mhz / 3e5) ** 2
    return lines.where(lines.intensity_nm2_mhz / lines.levels.components[lines.lower] > least)


_PREDICTIONS: dict[tuple[bytes, ...], Prediction] = {}


def prediction(folder: Path) -> Prediction:
    """What the case's .int and .var predict; samples and whole files of a case have the same ones."""
    path = folder / f"{folder.name}.int"
    texts = tuple(path.with_suffix(suffix).read_bytes() for suffix in (".int", ".var"))
    if texts not in _PREDICTIONS:
        _PREDICTIONS[texts] = predict_file(path)
    return _PREDICTIONS[texts]


def read_case(folder: Path) -> dict[str, Any]:
    return dict(json.loads((folder / "case.json").read_text(encoding="utf-8")))


@cache
def _comparison_tool(path: Path) -> ModuleType:
    """The comparison script; a file of the reference, which it never changes, is read once."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    read, read_once = module.read, cache(module.read)
    module.read = lambda name: (read_once if name.endswith(".gz") else read)(name)
    return module


def compare_with_tool(shared: Path, case: str, ours: Path) -> tuple[bool, str]:
    """What the comparison script of the reference folder says of our file: equal, and its words."""
    folder, tool = shared / "reference" / "spcat" / case, shared / "tools" / "compare_cat.py"
    words = [str(tool), str(folder / f"{case}.cat.gz"), str(ours), "--int", str(folder / f"{case}.int")]
    with mock.patch("sys.argv", words), contextlib.redirect_stdout(io.StringIO()) as said, warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # the script leaves the closing of a file to Python
        status = _comparison_tool(tool).main()
    return status == 0, said.getvalue()


def _labels(catalogue: Catalogue) -> list[list[int]]:
    """Quantum numbers of each line, signs of K dropped."""
    return np.abs(np.hstack([catalogue.quanta_upper, catalogue.quanta_lower])).tolist()


def _merged(catalogue: Catalogue) -> dict[tuple[Any, ...], list[list[float]]]:
    """Lines by label, signs of K dropped, K components of one frequency added."""
    out: dict[tuple[Any, ...], list[list[float]]] = {}
    columns = (catalogue.frequency_mhz, catalogue.lgint, catalogue.energy_lower_cm, catalogue.g_upper)
    for label, f, strength, energy, g in zip(_labels(catalogue), *(c.tolist() for c in columns), strict=True):
        rows = out.setdefault(tuple(label), [])
        twin = next((row for row in rows if abs(row[0] - f) < 2e-4), None)
        if twin:
            twin[1], twin[3] = float(np.log10(10 ** twin[1] + 10**strength)), twin[3] + g
        else:
            rows.append([f, strength, energy, g])
    return out


def disagreements(reference: Catalogue, ours: Catalogue) -> list[str]:
    """What of a sample is missing from our list or differs: 1.1e-4 MHz, 2e-4 in LGINT and E″, degeneracy, label."""
    expected, out = _merged(reference), []
    index = _merged(ours.take(np.array([tuple(label) in expected for label in _labels(ours)])))
    for label, rows in expected.items():
        for f, strength, energy, g in rows:
            near = min(index.get(label, []), key=lambda row: abs(row[0] - f), default=None)
            if near is None:
                out.append(f"missing {label} at {f}")
            elif (
                abs(near[0] - f) > 1.1e-4
                or abs(near[1] - strength) > 2e-4
                or abs(near[2] - energy) > 2e-4
                or near[3] != g
            ):
                out.append(f"{label}: {near} is not {[f, strength, energy, g]}")
    return out


def level_disagreements(reference: LevelList, ours: Prediction) -> list[str]:
    """Levels of an .egy file that are missing from ours or differ: 1e-6 cm⁻¹, half a digit of print with it; degeneracy."""
    levels = ours.lines.levels
    energy = (levels.energy_mhz / MHZ_PER_CM).tolist()
    g = (levels.degeneracy // levels.components).tolist()
    labels = ours.lines.quanta(np.arange(len(levels), dtype=np.int32)).tolist()
    index = {tuple(label): row for row, label in enumerate(labels)}
    out = []
    for i in range(len(reference)):
        level = reference.level(i)
        row = index.get(tuple(np.abs(level.quanta[: len(labels[0])]).tolist()))
        if row is None or abs(energy[row] - level.energy_cm) > 1e-6 or g[row] != level.degeneracy:
            out.append(f"{level} is not {row is not None and (energy[row], g[row])}")
    return out


def coupled_level_disagreements(reference: LevelList, ours: Prediction) -> list[str]:
    """Levels of an .egy file with all their quantum numbers that are missing from ours or differ: 5.1e-7 cm⁻¹, half a digit of print."""
    assert ours.levels is not None
    results: dict[tuple[int, ...], list[int]] = {}
    for row, label in enumerate(ours.levels.quanta.tolist()):
        results.setdefault(tuple(label), []).append(row)
    out = []
    for i in range(len(reference)):
        level = reference.level(i)
        rows = results.get(tuple(level.quanta[: ours.levels.quanta.shape[1]]), [])
        near = min(rows, key=lambda row: abs(ours.levels.energy_cm[row] - level.energy_cm), default=None)
        if (
            near is None
            or abs(ours.levels.energy_cm[near] - level.energy_cm) > 5.1e-7
            or ours.levels.degeneracy[near] != level.degeneracy
        ):
            out.append(f"{level} is not {near is not None and ours.levels.energy_cm[near]}")
    return out
