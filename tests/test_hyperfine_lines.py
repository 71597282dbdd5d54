"""Hyperfine components measured in laboratories, met by the library's constants and by those of published fits.

The samples in tests/oracles/hyperfine are cut by the script there: CH3CN (CDMS fit, references in its line list), CsF (CDMS fit of
the lines of Zorn et al.), CH3Cl (c050007) and HNCO (c043002) of JPL; HCN as data/molecules/HCN.toml says.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

import rotor
from rotor.quantum.effects.of_top import effects_of
from rotor.spectra.lines import Lines, line_list
from rotor.tops.constants import Constants
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.top import Top

SAMPLES = Path(__file__).parent / "oracles" / "hyperfine"
Quanta = tuple[int, ...]


@dataclass(frozen=True)
class Measured:
    """One frequency, with every component that the file has at it."""

    frequency_mhz: float
    error_mhz: float
    components: tuple[tuple[Quanta, Quanta], ...]

    @property
    def rotational(self) -> tuple[Quanta, Quanta]:
        up, low = self.components[0]
        return up[:-1], low[:-1]


def measured(name: str) -> list[Measured]:
    """Components at one frequency of one rotational line are one line."""
    together: dict[tuple[float, float, Quanta, Quanta], list[tuple[Quanta, Quanta]]] = {}
    with (SAMPLES / f"{name}.csv").open(encoding="utf-8") as handle:
        for row in csv.DictReader(handle):
            up, low = (tuple(map(int, row[side].split())) for side in ("upper", "lower"))
            key = (float(row["frequency_mhz"]), float(row["error_mhz"]), up[:-1], low[:-1])
            together.setdefault(key, []).append((up, low))
    return [Measured(f, e, tuple(components)) for (f, e, *_), components in together.items()]


def labelled(lines: Lines) -> dict[tuple[Quanta, Quanta], int]:
    """Rows of lines by quanta as catalogues write them, half-integers rounded up."""
    levels = lines.levels
    names = list(levels.quanta)
    quanta = np.stack([(levels.quanta[n] + 1) // 2 if n in levels.halves else levels.quanta[n] for n in names], axis=1)
    up, low = (list(map(tuple, quanta[rows].tolist())) for rows in (lines.upper, lines.lower))
    return {pair: row for row, pair in enumerate(zip(up, low, strict=True))}


def predicted(top: Top, found: list[Measured]) -> np.ndarray:
    """Frequencies of the measured lines; of components at one frequency the mean, weighted by intensity."""
    n_max = max(up[0] for line in found for up, _ in line.components)
    lines = line_list(top, jmax=n_max, temperature_k=300.0, effects=effects_of(top, True), min_lgint=None)
    row = labelled(lines)
    out = []
    for line in found:
        rows = [row[pair] for pair in line.components]
        out.append(np.average(lines.frequency_mhz[rows], weights=lines.intensity_nm2_mhz[rows]))
    return np.array(out)


def in_errors(top: Top, found: list[Measured]) -> np.ndarray:
    """Observed less calculated, in units of the stated errors."""
    seen, error = (np.array([getattr(line, name) for line in found]) for name in ("frequency_mhz", "error_mhz"))
    return np.asarray((seen - predicted(top, found)) / error)


def test_acetonitrile():
    """89 frequencies of 99 components; the fit that the constants are from has 0.9 for its 255 lines."""
    off = in_errors(rotor.read("CH3CN"), measured("ch3cn"))
    assert len(off) > 70
    assert np.sqrt(np.mean(off**2)) < 1.0  # 0.906 in the published fit
    assert np.abs(off).max() < 3.0  # largest of 89 normal deviates


def test_acetonitrile_needs_each_constant():
    """Without spin-rotation, or with χ 0.5 % larger, the same lines are missed."""
    top, found = rotor.read("CH3CN"), measured("ch3cn")
    constants = top.spin_constants
    best = np.mean(in_errors(top, found) ** 2)
    values = {"chi_aa(14N)": constants.values["chi_aa(14N)"]}
    without = replace(top, spin_constants=replace(constants, values=values, uncertainties={}))
    larger = replace(top, spin_constants=replace(constants, values=dict(constants.values) | {"chi_aa(14N)": -4.2443}))
    assert np.mean(in_errors(without, found) ** 2) > 2 * best
    assert np.mean(in_errors(larger, found) ** 2) > 1.5 * best


def test_methyl_chloride():
    """Components of 35Cl up to N = 8; some catalogue errors are below 1 kHz, where B and D of the library are not that good."""
    found = [replace(line, error_mhz=np.hypot(line.error_mhz, 0.02)) for line in measured("ch3cl")]
    off = in_errors(rotor.read("CH3Cl"), found)
    assert len(off) > 60
    assert np.sqrt(np.mean(off**2)) < 1.5  # the library's own fit has 1.2 with at least 0.05 MHz
    assert (
        np.sort(np.abs(off))[-2] < 3.2
    )  # one line, 4 3 3 - 3 3 2 at 106,337.92 MHz, is 0.18 MHz off; then normal deviates


def test_hydrogen_cyanide():
    """The triplet of J = 1-0: χ and C are from its distances, B and D from other lines, so that its centre is a test."""
    off = in_errors(rotor.read("HCN"), measured("hcn"))
    assert len(off) == 3
    assert np.abs(off).max() < 1.5  # kHz: 1 of each line, 0.7 of the centre, 1.3 of the library's 2 B - 4 D
    assert np.ptp(off) < 0.1  # its own three digits of χ and C


MISLABELLED = {((2, 1, 2), (1, 1, 1)), ((2, 1, 1), (1, 1, 0))}


def test_isocyanic_acid():
    """Distances from the centre of each rotational line, whose own error is larger here.

    Left out: two lines in which components near 43,799 and 44,119 MHz are 0.3 MHz off the catalogue's own calculation.
    """
    found = [line for line in measured("hnco") if line.rotational not in MISLABELLED]
    off, error = in_errors(rotor.read("HNCO"), found), np.array([line.error_mhz for line in found])
    compared = 0
    for key in {line.rotational for line in found}:
        of_it = np.array([line.rotational == key for line in found])
        if of_it.sum() > 1:
            residual = (off * error)[of_it]
            centred = (residual - np.average(residual, weights=1 / error[of_it] ** 2)) / error[of_it]
            assert np.abs(centred).max() < 3, key  # errors of the laboratory
            compared += int(of_it.sum())
    assert compared >= 10


def test_caesium_fluoride():
    """Transitions inside N = 1 by names of constants: χ, C, tensor and scalar spin-spin of Cs (7/2) and F (1/2)."""
    text = (
        f"chi_aa(133Cs)={1.855608779941512 / 1.5!r} C_iso(133Cs)=6.880531625605832e-4 C_iso(19F)=1.504430640628889e-2 "
        f"T_aa(133Cs,19F)={-2.943237328539779e-3 / 1.5!r} J(133Cs,19F)=6.184912813981738e-4 MHz"
    )
    top = Top.from_constants(
        Constants(B=5490.0), dipole_abc_debye=(7.9, 0, 0), spin_constants=SpinConstants.parse(text)
    )
    from rotor.quantum.solve import solve_levels

    levels = solve_levels(top, 1, effects=effects_of(top, True))
    names = list(levels.quanta)
    assert names == ["n", "f1", "f"]
    quanta = np.stack([(levels.quanta[n] + 1) // 2 if n in levels.halves else levels.quanta[n] for n in names], axis=1)
    energy = dict(zip(map(tuple, quanta.tolist()), levels.energy_mhz.tolist(), strict=True))
    lines = measured("csf")
    off = [
        (line.frequency_mhz - abs(energy[up] - energy[low])) / line.error_mhz
        for line in lines
        for up, low in line.components
    ]
    assert len(off) == 14
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(
        0.85537, abs=2e-3
    )  # that of the published fit, energies to 1e-9
