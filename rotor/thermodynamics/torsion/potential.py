"""Potential and kinetic energy of the rotation about a bond: stated Fourier terms, a table of barriers, or a scan."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor import units
from rotor.molecules.bond_rotation import BondRotation
from rotor.molecules.bond_scan import BondScan, relaxed_scan
from rotor.molecules.bonds import bonded_atoms
from rotor.quantum.bond_torsion import FourierSeries, potential_of_scan
from rotor.requests.fill import within

if TYPE_CHECKING:
    from rotor.quantum.estimates.methyl_groups import Barrier

TABLE = "table"
_TERM = re.compile(r"([VW])(\d+)\s*=\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([A-Za-zµ][^\s,=]*)?(?=[\s,]|$)")
_CM_PER_KJ_PER_MOL = units.CM_PER_EV / units.KJ_PER_MOL_EV
_MOLAR_UNITS = {
    "kJ/mol": _CM_PER_KJ_PER_MOL,
    "kcal/mol": 4.184 * _CM_PER_KJ_PER_MOL,
    "meV": 1e-3 * units.CM_PER_EV,
}  # in cm-1
Progress = Callable[[int, int], object]


def is_scan(potential: Any) -> bool:
    """Whether a potential comes from a scan (MMFF94 or a calculator) instead of Fourier terms."""
    if isinstance(potential, str):
        return "=" not in potential and potential != TABLE
    return not isinstance(potential, FourierSeries)


def potential_and_kinetic(
    stated: Any, points: int, rotation: BondRotation, progress: Progress | None
) -> tuple[FourierSeries, FourierSeries, str, BondScan | None, float]:
    """V and F in MHz, the source of V, the scan, and the misfit (cm⁻¹) of its Fourier series."""
    if not is_scan(stated):
        series, source = _named_terms(stated, rotation)
        return series, _rigid_kinetic(rotation, points), source, None, 0.0
    with within("potential"):
        scan = relaxed_scan(rotation, stated, points=points, progress=progress)
    period = rotation.symmetry_number(isotopes=False)
    potential = potential_of_scan(scan, rotation)
    misfit = np.sqrt(np.mean((potential.values(scan.angles) / units.MHZ_PER_CM - scan.energies_cm) ** 2))
    moments = np.array([rotation.reduced_moment(x) for x in scan.positions_angstrom])
    symmetry = rotation.symmetry_number()
    # isotopes: the masses have a longer period than the potential, so F comes from the rigidly turned geometry
    if symmetry != period:
        return potential, _rigid_kinetic(rotation, points), scan.source, scan, float(misfit)
    kinetic = FourierSeries.fitted(
        scan.angles, units.ROTATIONAL_MHZ_U_ANGSTROM2 / moments, period, len(potential.n), rotation.mirror_angle()
    )
    return potential, kinetic, scan.source, scan, float(misfit)


def _named_terms(potential: FourierSeries | str, rotation: BondRotation) -> tuple[FourierSeries, str]:
    """The given Fourier terms, or those of the table, and their source."""
    if potential == TABLE:
        return table_barrier(rotation)
    return (parse_potential(potential, rotation) if isinstance(potential, str) else potential), "given"


def _rigid_kinetic(rotation: BondRotation, points: int) -> FourierSeries:
    """F(α) of the geometry with a rigidly turned top."""
    period = rotation.symmetry_number()
    count = max(6, math.ceil(points / period))
    angles = 2 * math.pi / period * np.arange(count) / count
    moments = [
        rotation.reduced_moment(rotation.turned_positions(rotation.molecule.positions_angstrom, x)) for x in angles
    ]
    return FourierSeries.fitted(
        angles, units.ROTATIONAL_MHZ_U_ANGSTROM2 / np.array(moments), period, count // 3, rotation.mirror_angle()
    )


def parse_potential(text: str, rotation: BondRotation) -> FourierSeries:
    """Parse a potential such as "V3=400 V6=-10 cm-1": ½ V_n (1 - cos nα), ½ W_n sin nα; cm⁻¹ by default.

    Raises ValueError for other texts, repeated terms, and terms that the symmetry of the group excludes.
    """
    matches = list(_TERM.finditer(text))
    rest = _TERM.sub("", text).replace(",", " ").strip()
    names = [match[1] + match[2] for match in matches]
    if not matches or rest or len(set(names)) < len(names):
        raise ValueError(f"potential: {text!r}: expected terms such as 'V3=400 V6=-10 cm-1', each once")
    unit = next((match[4] for match in reversed(matches) if match[4]), "cm-1")
    tables: dict[str, dict[int, float]] = {"V": {}, "W": {}}
    fold = rotation.symmetry_number(isotopes=False)
    for match in matches:
        n = int(match[2])
        if n < 1 or n % fold:
            raise ValueError(
                f"potential: {match[1]}{n}: the bond has {fold} equal positions in a turn; expected n = {fold}, {2 * fold}, ..."
            )
        tables[match[1]][n] = _energy_mhz(match[3], match[4] or unit)
    return FourierSeries.from_barriers(tables["V"], tables["W"])


def _energy_mhz(number: str, unit: str) -> float:
    """An energy in MHz; barriers are also published in kJ/mol and kcal/mol."""
    if unit in _MOLAR_UNITS:
        return float(number.replace("−", "-")) * _MOLAR_UNITS[unit] * units.MHZ_PER_CM
    try:
        return units.parse_quantity(f"{number} {unit}", "cm-1") * units.MHZ_PER_CM
    except ValueError as error:
        raise ValueError(f"potential: {error}, {', '.join(_MOLAR_UNITS)}") from None


def table_barrier(rotation: BondRotation) -> tuple[FourierSeries, str]:
    """V3 of a similar molecule and its name; ValueError if the bond has no methyl group or the table no similar molecule."""
    barrier = similar_barrier(rotation)
    if barrier is None:
        raise ValueError(
            "potential: the table only has methyl groups, and none like that of this bond; give V_n or a scan (mmff, a calculator)"
        )
    return FourierSeries.from_barriers({3: barrier.v3_cm * units.MHZ_PER_CM}), f"V3, {barrier.text(rotation.molecule)}"


def similar_barrier(rotation: BondRotation) -> Barrier | None:
    """The measured barrier of a similar molecule; None without a methyl group at the bond, and for kinds that the table does not have."""
    from rotor.quantum.estimates.methyl_groups import barrier_beside

    molecule = rotation.molecule
    bonds = bonded_atoms(molecule)
    for carbon in (rotation.last, rotation.first):
        hydrogens = [i for i in bonds[carbon].tolist() if molecule.symbols[i] == "H"]
        if molecule.symbols[carbon] == "C" and len(hydrogens) == 3 and len(bonds[carbon]) == 4:
            barrier = barrier_beside(molecule, bonds, carbon)
            if barrier is not None:
                return barrier
    return None
