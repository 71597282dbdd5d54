"""Quadrupole splittings of lines, from known constants or from a typical field gradient.

To first order a level J = 1 with one nucleus of spin I lies at -χ_gg Y(F) with Casimir's function

    Y = [¾ C(C+1) - I(I+1)J(J+1)] / [2(2J-1)(2J+3) I(2I-1)],    C = F(F+1) - I(I+1) - J(J+1)

(W. Gordy and R. L. Cook, Microwave Molecular Spectra, 3rd ed., eq. 9.20), with χ_gg along the axis g about which J = 1 does not turn. The
reported size is the distance of the outermost components for the largest of the three. If χ is not known, it is estimated from the typical
gradient in covalent bonds of the element, `GRADIENTS`, in atomic units e/(4π ε0 a0³), chosen among those of these molecules: D 0.25 to 0.45
(C-D of DCOOH, O-D of HCOOD and CH3OD), O 0.8 (HCO⁺), N 0.6 to 1 (HOCN, ICN, HCONH2, NH3, CH3CN, HCN), Cl 3.9 (CH3Cl, CH2BrCl), Br 7
to 12 (2-bromopropane, CH3CH2Br, CH3Br, CH2Br2, HOBr), I 12 to 17 (CH3I, CH2ICN, CF3I, ICN, IN3); tests/quantum/estimates/test_limits.py
has them and where they were read. Other elements count with 1. In ionic molecules such as KCl the halogens have far less.

A line between J' and J has components at E(J', F') - E(J, F), E = χ (3K²/J(J+1) - 1) Y of a linear (K = 0) or symmetric top, with the parts
(2F'+1)(2F+1) {J' F' I; F J 1}² of its intensity. Their weighted mean is the line without coupling: the centre of gravity stays, and an
unresolved line loses a part of its depth at the centre, `depth_lost`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats
from rotor.frozen import dataclass
from rotor.quantum.operators.wigner import six_j
from rotor.tops.spins.tensor_elements import chi_tensor

if TYPE_CHECKING:
    from rotor.tops.top import Top

# eQV/h of a field gradient V of one atomic unit; CODATA 2022, checked in tests/quantum/estimates/test_limits.py
GRADIENT_MHZ_PER_BARN = 234.964778
GRADIENTS = {"H": 0.35, "N": 0.8, "O": 0.8, "Cl": 3.9, "Br": 8.0, "I": 13.0}


@dataclass(frozen=True)
class Splitting:
    """Splitting by one nucleus. known: whether its constants are known; otherwise they follow from a typical field gradient."""

    nucleus: str
    spin: float
    chi_mhz: float
    splitting_mhz: float
    known: bool


def casimir(twice_spin: int, j: int, twice_f: int) -> float:
    """Casimir's function Y of a nucleus of spin 1 or more.

    >>> [casimir(2, 1, twice_f) for twice_f in (0, 2, 4)]
    [0.5, -0.25, 0.05]
    """
    spin, f = twice_spin / 2, twice_f / 2
    c = f * (f + 1) - spin * (spin + 1) - j * (j + 1)
    above = 0.75 * c * (c + 1) - spin * (spin + 1) * j * (j + 1)
    return above / (2 * (2 * j - 1) * (2 * j + 3) * spin * (2 * spin - 1))


def spread(twice_spin: int) -> float:
    """The distance of the outermost components of J = 1 in units of χ.

    >>> spread(2), round(spread(3), 12)
    (0.75, 0.45)
    """
    values = [casimir(twice_spin, 1, f) for f in range(abs(twice_spin - 2), twice_spin + 3, 2)]
    return max(values) - min(values)


def line_components(twice_spin: int, j_upper: int, j_lower: int, k: int) -> tuple[Floats, Floats]:
    """Shifts (in units of χ) and relative intensities of the components of a line of one K.

    >>> shifts, parts = line_components(2, 1, 0, 0)
    >>> shifts.round(3).tolist(), parts.round(3).tolist()
    ([-0.5, 0.25, -0.05], [0.111, 0.333, 0.556])
    """
    upper, lower = (np.arange(abs(2 * j - twice_spin), 2 * j + twice_spin + 1, 2) for j in (j_upper, j_lower))
    twice_f, twice_g = (part.ravel() for part in np.meshgrid(upper, lower, indexing="ij"))
    allowed = (np.abs(twice_f - twice_g) <= 2) & (twice_f + twice_g >= 2)
    twice_f, twice_g = twice_f[allowed], twice_g[allowed]
    f, g, spin = twice_f / 2, twice_g / 2, twice_spin / 2
    parts = (twice_f + 1) * (twice_g + 1) * six_j(j_upper, f, spin, g, j_lower, 1) ** 2
    energies = [
        np.array([(3 * k**2 / (j * (j + 1)) - 1) * casimir(twice_spin, j, number) if j else 0.0 for number in numbers])
        for j, numbers in ((j_upper, twice_f), (j_lower, twice_g))
    ]
    return energies[0] - energies[1], parts / parts.sum()


def depth_lost(nuclei: Sequence[Splitting], numbers: tuple[int, int], k: int | None, fwhm_mhz: float) -> float:
    """The relative loss of depth at the centre of an unresolved line: 1 - Σ w exp(-4 ln 2 (δ/Δν)²) over components (shift δ, weight w).

    numbers: J of the upper and of the lower level. k: 0 for a linear top; None averages over all K. Δν: full width at half maximum.
    """
    left = 1.0
    k_values = range(min(numbers) + 1) if k is None else (k,)
    for nucleus in nuclei:
        shares = []
        for number in k_values:
            shifts, parts = line_components(round(2 * nucleus.spin), *numbers, number)
            shares.append(float(parts @ np.exp(-4 * math.log(2) * (nucleus.chi_mhz * shifts / fwhm_mhz) ** 2)))
        left *= sum(shares) / len(shares)
    return 1.0 - left


def splitting_nuclei(top: Top) -> list[Splitting]:
    """The nuclei of spin 1 or more whose coupling is known or can be estimated, the largest splitting first."""
    splittings, atoms_with_constants = [], set()
    if top.spin_constants is not None:
        for spin, twice in top.spin_constants.twice.items():
            constants = top.spin_constants.of(spin)
            # elements of χ itself, not of its dependence on J or K
            chi = {name: value for name, value in constants.items() if re.fullmatch(r"chi_[abc-]+", name)}
            if chi and twice > 1:
                diagonal = np.diag(chi_tensor(chi))
                splittings.append(_splitting(spin, twice, float(diagonal[np.abs(diagonal).argmax()]), True))
                atoms_with_constants.add(top.spin_constants.atoms.get(spin))
    if top.molecule is not None:
        labels: dict[str, Splitting] = {}
        for atom, nucleus in enumerate(top.molecule.nuclei, start=1):
            if nucleus.spin >= 1 and nucleus.quadrupole_barn and atom not in atoms_with_constants:
                chi_mhz = GRADIENT_MHZ_PER_BARN * GRADIENTS.get(nucleus.symbol, 1.0) * nucleus.quadrupole_barn
                labels.setdefault(nucleus.label, _splitting(nucleus.label, round(2 * nucleus.spin), chi_mhz, False))
        splittings += labels.values()
    return sorted(splittings, key=lambda splitting: -splitting.splitting_mhz)


def _splitting(nucleus: str, twice: int, chi_mhz: float, is_known: bool) -> Splitting:
    """Splitting of J = 1 by χ."""
    return Splitting(nucleus, twice / 2, chi_mhz, abs(chi_mhz) * spread(twice), is_known)
