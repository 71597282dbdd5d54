"""A spectrum with known lines, the molecule behind it, and sessions on them, for the tests of `rotor view`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from rotor.formats.molecules.molecule_file import MoleculeFile
from rotor.formats.molecules.molecule_writer import write_molecule_file
from rotor.spectra.lines import line_list
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top

TRUE = Constants(A=9000.0, B=3000.0, C=2400.0, DeltaJ=0.001, DeltaJK=0.002, DeltaK=0.01, deltaJ=0.0001, deltaK=0.001)
DIPOLE = (2.0, 1.0, 0.0)
KELVIN = 3.0
WIDTH = 0.06  # e-folding half width of the lines, MHz
NOISE = 0.002
STEP = 0.03  # MHz
NAME = "molecule.toml"


def true_lines(band: tuple[float, float]) -> Any:
    """The lines behind the spectrum."""
    return line_list(Top.from_constants(TRUE, dipole_abc_debye=DIPOLE), range_mhz=band, temperature_k=KELVIN)


def spectrum_columns(band: tuple[float, float] = (8000.0, 17000.0), step: float = STEP) -> tuple[Any, Any]:
    """Frequencies and intensities: Gaussians of the lines, and noise."""
    x = np.arange(band[0], band[1], step)
    y = NOISE * np.random.default_rng(5).normal(size=len(x))
    lines = true_lines(band)
    heights = lines.intensity_nm2_mhz / lines.intensity_nm2_mhz.max()
    for centre, height in zip(lines.frequency_mhz.tolist(), heights.tolist(), strict=True):
        a, b = np.searchsorted(x, (centre - 1, centre + 1))
        y[a:b] += height * np.exp(-(((x[a:b] - centre) / WIDTH) ** 2))
    return x, y


def write_case(folder: Path, off_mhz: float = 0.03) -> Path:
    """spectrum.csv and molecule.toml, whose constants are a little off; the spectrum's path."""
    x, y = spectrum_columns()
    rows = "\n".join(f"{a:.4f},{b:.6f}" for a, b in zip(x.tolist(), y.tolist(), strict=True))
    path = folder / "spectrum.csv"
    path.write_text(f"frequency_mhz,intensity\n{rows}\n")
    start = TRUE.replace(A=TRUE["A"] + off_mhz, B=TRUE["B"] - off_mhz / 3)
    sources = {"constants": "made for a test", "dipole": "made for a test"}
    write_molecule_file(MoleculeFile("case", constants=start, dipole_abc_debye=DIPOLE, sources=sources), folder / NAME)
    return path


def assign_line(service: Any, upper: list[int], lower: list[int], species: int = 1) -> Any:
    """Assign the peak nearest to a predicted line to it; the answer."""
    computed = service.answer({"do": "pick", "species": species, "level": upper})["ok"]["candidates"]
    line = next(entry for entry in computed if entry["upper"] == upper and entry["lower"] == lower)
    f = line["frequency_mhz"]
    peak = service.answer({"do": "peak", "first_mhz": f - 0.4, "last_mhz": f + 0.4})["ok"]["peak"]
    return service.answer(
        {
            "do": "assign",
            "frequency_mhz": peak["frequency_mhz"],
            "error_mhz": peak["error_mhz"],
            "width_mhz": peak["width_mhz"],
            "to": [{"species": species, "upper": upper, "lower": lower}],
        }
    )


SERIES = (
    ([2, 0, 2], [1, 0, 1]),
    ([3, 0, 3], [2, 0, 2]),
    ([2, 1, 1], [1, 1, 0]),
    ([3, 1, 3], [2, 1, 2]),
    ([6, 1, 5], [6, 0, 6]),
)
