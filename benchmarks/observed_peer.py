"""The same LTE model by pyspeckit: brightness of one species, thin to thick, cold to warm, at 0 and at 50 km/s.

pyspeckit is installed in an environment of its own (`python -m venv peer && peer/bin/pip install pyspeckit`); lines, Einstein coefficients
and Q(T) that both use are those of rotor. `pyspeckit.spectrum.models.lte_molecule.generate_model` has the same equations (J. G. Mangum
and Y. L. Shirley, Publ. Astron. Soc. Pac. 127 (2015) 266), with the constants of astropy, and a line's width in frequency is that at rest.

    python benchmarks/observed_peer.py peer/bin/python
"""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import numpy as np

from rotor import units
from rotor.formats.read_write import read
from rotor.observed.model.model import KM_PER_S, Component, Sight, model
from rotor.observed.model.species import SpeciesLines, species_from_lines
from rotor.spectra.lines import line_list

WIDTH_KM_S, BACKGROUND_K, CHANNEL = 3.0, 2.725, 0.1
PEER = """
import json, sys
import numpy as np
from astropy import units as u
from pyspeckit.spectrum.models.lte_molecule import generate_model
import pyspeckit
case = json.load(sys.stdin)
lines = case["lines"]
freqs, eu = np.array(lines["frequency_hz"]) * u.Hz, np.array(lines["energy_upper_erg"])
out = []
for one in case["cases"]:
    got = generate_model(np.array(case["grid_hz"]) * u.Hz, one["velocity"], case["sigma"], one["t"], float(one["n"]), freqs,
                         np.array(lines["log_a"]), np.array(lines["g"]), eu, lambda t: one["q"], tbg=case["background"])
    out.append(got.tolist())
json.dump({"version": pyspeckit.__version__, "brightness": out}, sys.stdout)
"""


def species() -> SpeciesLines:
    """Lines of SO2 of the library between 200 and 260 GHz."""
    top = read("SO2")
    return species_from_lines(line_list(top, temperature_k=300.0, min_lgint=-8.0, range_mhz=(200e3, 260e3)), "SO2")


def question(lines: SpeciesLines, grid: np.ndarray, cases: list[dict[str, float]]) -> dict[str, Any]:
    """What pyspeckit needs, in its units."""
    erg = units.BOLTZMANN_J_PER_K * 1e7
    return {
        "grid_hz": (grid * 1e6).tolist(),
        "sigma": WIDTH_KM_S / (8 * np.log(2)) ** 0.5,
        "background": BACKGROUND_K,
        "cases": cases,
        "lines": {
            "frequency_hz": (lines.frequency_mhz * 1e6).tolist(),
            "log_a": np.log10(lines.einstein_a_per_s).tolist(),
            "g": lines.g_upper.tolist(),
            "energy_upper_erg": (lines.energy_upper_k * erg).tolist(),
        },
    }


def main(python: str) -> None:
    lines = species()
    centres = lines.frequency_mhz[:, None] * (1 - np.array([0.0, 50.0]) / KM_PER_S)
    grid = np.unique(np.round(centres.reshape(-1, 1) + np.arange(-15, 15, CHANNEL), 1))
    cases = [
        {"n": n, "t": t, "velocity": velocity, "q": float(lines.partition.at(t))}
        for velocity in (0.0, 50.0)
        for t in (10.0, 50.0, 150.0, 300.0)
        for n in (1e13, 1e16, 1e18)
    ]
    text = json.dumps(question(lines, grid, cases))
    answer = json.loads(
        subprocess.run([python, "-c", PEER], input=text, capture_output=True, text=True, check=True).stdout
    )
    print(f"pyspeckit {answer['version']}, {len(lines)} lines, {len(grid)} channels")
    for case, theirs in zip(cases, answer["brightness"], strict=True):
        part = Component(lines, case["n"], case["t"], case["velocity"], WIDTH_KM_S)
        seen = model([part], grid, Sight(background_k=BACKGROUND_K))
        peak = float(seen.brightness_k.max())
        worst = float(np.abs(seen.brightness_k - np.array(theirs)).max()) / peak
        head = f"N {case['n']:.0e}  T {case['t']:5.0f} K  v {case['velocity']:4.0f} km/s"
        print(f"{head}  peak {peak:9.3g} K  largest difference {worst:.1e} of it")


if __name__ == "__main__":
    main(sys.argv[1])
