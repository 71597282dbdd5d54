"""The few numbers that say what came of a point: how many lines, the strongest of them, Q, the largest alignment."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

Numbers = dict[str, Any]


def point_results(kind: str, answer: Any, rows: int) -> dict[str, float | int]:
    """The results of an answer of a kind of scene, finite numbers by name.

    Parameters
    ----------
    kind : str
        Of the scene, such as "spectrum".
    answer : Any
        The library's answer to the request of the scene.
    rows : int
        Of the answer's table.

    Returns
    -------
    dict
        Names with their units, as columns of tables have them.
    """
    numbers = _RESULTS[kind](answer) if rows else {}
    plain = {name: np.asarray(value).item() for name, value in numbers.items() if value is not None}
    return {name: value for name, value in plain.items() if math.isfinite(value)}


def _spectrum(answer: Any) -> Numbers:
    lines = answer.lines
    strongest = int(np.argmax(lines.intensity_nm2_mhz))
    return {
        "lines": len(lines),
        "strongest_mhz": lines.frequency_mhz[strongest],
        "strongest_lgint": lines.lgint[strongest],
        "q": lines.partition.q,
        "jmax": lines.jmax,
    }


def _levels(answer: Any) -> Numbers:
    energy = answer.table.energy_cm
    return {"levels": len(energy), "lowest_cm": energy.min(), "highest_cm": energy.max()}


def _raman(answer: Any) -> Numbers:
    lines = answer.lines
    strongest = int(np.argmax(lines.cross_section_cm2_per_sr))
    return {
        "lines": len(lines),
        "strongest_cm": lines.shift_cm[strongest],
        "strongest_cm2_per_sr": lines.cross_section_cm2_per_sr[strongest],
        "q": lines.partition.q,
    }


def _thermo(answer: Any) -> Numbers:
    """Of the last temperature."""
    columns = answer.functions.columns
    return {name: columns[name][-1] for name in ("temperature_k", "q_rot", "entropy_j_per_mol_k", "cv_over_r")}


def _field_map(answer: Any) -> Numbers:
    """The largest move of a level between the first and the last field."""
    states = answer.states
    curves = [states.energy_mhz[rows] for rows in states.curves()]
    return {"levels": len(curves), "largest_shift_mhz": max(abs(curve[-1] - curve[0]) for curve in curves)}


def _align(answer: Any) -> Numbers:
    cosines = {name: values for name, values in answer.table.columns.items() if name != "t_ps"}
    highest = {f"max_{name}": values.max() for name, values in cosines.items()}
    return highest | {f"min_{name}": values.min() for name, values in cosines.items()}


def _fit(answer: Any) -> Numbers:
    fit = answer.fit
    return {"lines_used": fit.used.sum(), "weighted_rms": fit.weighted_rms, "rms_mhz": fit.rms_mhz()}


def _emission(answer: Any) -> Numbers:
    peak = answer.peak
    return {"lines": len(answer.lines), "peak_k": peak.brightness_k, "peak_mhz": peak.observed_mhz}


def _gas(answer: Any) -> Numbers:
    test = answer.test
    return {"p_value": test.p_value, "chi2": test.chi2}


def _fluid(answer: Any) -> Numbers:
    facts: Mapping[str, Any] = answer.facts()
    means = {f"{mean['quantity']} ({mean['unit']})": mean["mean"] for mean in facts["means"]}
    return means | {"conserved_drift_ev_per_ns": facts["conserved_drift_ev_per_ns"]}


def _tumble(answer: Any) -> Numbers:
    facts: Mapping[str, Any] = answer.facts()
    names = ("energy", "period", "turning_rate", "energy_first", "energy_last", "energy_drift")
    return {name: facts[name] for name in names if facts.get(name) is not None}


def _torsion(answer: Any) -> Numbers:
    """The barrier, the zero-point energy, and C_v by the levels at the last temperature."""
    facts = answer.facts()
    exact = answer.functions.of_method("levels")
    names = ("barrier_cm", "zero_point_cm", "reduced_moment_u_angstrom2")
    return {name: facts[name] for name in names} | {"cv_over_r": exact.cv_over_r[-1]}


def _assign(answer: Any) -> Numbers:
    """The number of species and of peaks, and how sure the first species is."""
    facts = answer.facts()
    numbers = {name: facts[name] for name in ("peaks", "unexplained")} | {"species": len(facts["species"])}
    return numbers | ({"probability": facts["species"][0]["probability"]} if facts["species"] else {})


def _info(answer: Any) -> Numbers:
    """Rotational constants, mass and Ray's parameter."""
    facts, columns = answer.facts(), answer.table.columns
    constants = {name: columns[name][0] for name in ("a_mhz", "b_mhz", "c_mhz")}
    return constants | {name: facts[name] for name in ("mass_u", "kappa")}


def _isotopologues(answer: Any) -> Numbers:
    return {"isotopologues": len(answer.facts()["isotopologues"])}


def _structure(answer: Any) -> Numbers:
    """How many coordinates there are, and the residuals of the fit of r0 where one was made."""
    fitted = answer.facts()["r0"]
    return {"coordinates": len(answer.table)} | ({"rms_u_angstrom2": fitted["rms_u_angstrom2"]} if fitted else {})


_RESULTS: Mapping[str, Callable[[Any], Numbers]] = {
    "spectrum": _spectrum, "levels": _levels, "raman": _raman, "thermo": _thermo, "stark": _field_map, "zeeman": _field_map,
    "align": _align, "fit": _fit, "emission": _emission, "gas": _gas, "fluid": _fluid, "tumble": _tumble, "torsion": _torsion,
    "assign": _assign, "info": _info, "isotopologues": _isotopologues, "structure": _structure,
}  # fmt: skip
