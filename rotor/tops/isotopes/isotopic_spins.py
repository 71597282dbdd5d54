"""Hyperfine constants of an isotopologue from those of its parent: tensors in the new axes, scaled to the new nuclei.

    χ' = (Q'/Q) R χ Rᵀ         the field gradient is a property of the electrons, equal for all isotopes
    C' = (g'/g) R C I Rᵀ I'⁻¹   C = g K I⁻¹, where K depends only on the electrons and the nuclear charges

R transforms the principal axes of the parent into those of the isotopologue; I are the moments of inertia (W. Gordy and R. L. Cook,
Microwave Molecular Spectra, 3rd ed., chapters IX.4 and IX.7; Q and g of data/isotopes.csv). Neglected: vibration, which changes χ of
deuterium by some per cent and of heavier nuclei by less than one per cent. Constants of two spins are left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from rotor.arrays import Floats
from rotor.frozen import dataclass
from rotor.molecules.nuclei import Isotope
from rotor.tops.spins.spin_constants import SpinConstants, spin_names
from rotor.tops.spins.tensor_elements import chi_tensor

if TYPE_CHECKING:
    from rotor.molecules.molecule import Molecule
    from rotor.tops.top import Top

LETTERS = ("aa", "bb", "cc", "ab", "ac", "bc")
DIFFERENCES = ("ab-ba", "ac-ca", "bc-cb")
ROUND_OFF = 1e-6  # relative to a tensor: bound of elements that symmetry makes 0, and of differences that it makes 0
TURNED_DEGREES = 0.1  # rotation of the axes above which unknown off-diagonal elements matter


@dataclass(frozen=True)
class _Change:
    """A nucleus of the parent and of the isotopologue, the rotation from the old axes to the new, and both sets of moments."""

    old: Isotope
    new: Isotope
    rotation: Floats
    moments: Floats
    new_moments: Floats


def carried_spins(parent: Top, top: Top, angle: float) -> tuple[SpinConstants | None, tuple[str, ...]]:
    """Spin constants of the isotopologue `top`, and notes; None if no spin has constants.

    angle: rotation of the axes in degrees.
    """
    constants = parent.spin_constants
    if (
        constants is None
        or parent.molecule is None
        or top.molecule is None
        or parent.frame is None
        or top.frame is None
    ):
        return constants, ()
    if top.molecule.mass_numbers == parent.molecule.mass_numbers:
        return constants, ()
    rotation = top.frame.axes @ parent.frame.axes.T
    values: dict[str, float] = {}
    twice: dict[str, int] = {}
    atoms: dict[str, int] = {}
    notes = _pair_notes(constants)
    for spin in constants.twice:
        atom = constants.atoms.get(spin) or _only_atom(parent.molecule, spin)
        if atom is None:
            notes.append(
                f"constants of {spin} are left out: the molecule does not say which nucleus of the geometry it is"
            )
            continue
        old, new = parent.molecule.nuclei[atom - 1], top.molecule.nuclei[atom - 1]
        change = _Change(old, new, rotation, _moments(parent), _moments(top))
        carried, said = _carried_spin(
            constants.of(spin), change, angle if top.kind == parent.kind else 90.0, parent.kind
        )
        notes += [f"{spin}: {text}" for text in said]
        if carried:
            name = spin if old == new else new.label + spin.removeprefix(spin.partition("_")[0])
            values |= {f"{symbol}({name})": value for symbol, value in carried.items()}
            twice[name], atoms[name] = round(2 * new.spin), atom
    if not values:
        return None, tuple(notes)
    source = f"from those of {parent.name or 'the parent'} ({constants.source}), in the new axes and scaled by Q and g of the nuclei"
    return SpinConstants(values, twice, source, atoms=atoms), tuple(notes)


def _only_atom(molecule: Molecule, spin: str) -> int | None:
    """Number (from 1) of the only atom of the isotope that a spin is named after; None if several atoms or none fit."""
    atoms = [number for number, nucleus in enumerate(molecule.nuclei, 1) if nucleus.label == spin]
    return atoms[0] if len(atoms) == 1 else None


def _pair_notes(constants: SpinConstants) -> list[str]:
    pairs = [name for name in constants.values if len(spin_names(name)) != 1]
    return [f"{', '.join(pairs)}: constants of two spins are not carried over"] if pairs else []


def _moments(top: Top) -> Floats:
    return np.array(top.moments_u_angstrom2)


def _carried_spin(
    constants: Mapping[str, float], change: _Change, angle: float, kind: str
) -> tuple[dict[str, float], list[str]]:
    """Constants of one nucleus, by name without the spin, and notes."""
    chi = {name: value for name, value in constants.items() if name.startswith("chi_")}
    rotation = {name: value for name, value in constants.items() if name.startswith("C_")}
    notes = [f"{name} is not carried over" for name in constants if name not in chi and name not in rotation]
    out: dict[str, float] = {}
    if chi and change.new.spin >= 1:
        tensor = chi_tensor(chi)
        diagonal = not any(tensor[i, k] for i, k in ((0, 1), (0, 2), (1, 2)))
        if diagonal and kind == "asymmetric" and angle > TURNED_DEGREES:
            notes.append(
                f"the axes are turned by {angle:.1f}° and off-diagonal elements of χ are not known: their part of the new constants is "
                "missing"
            )
        q_ratio = _ratio(change.new.quadrupole_barn, change.old.quadrupole_barn, "quadrupole moment", change)
        out |= named_chi(q_ratio * change.rotation @ tensor @ change.rotation.T)
    if rotation and change.new.spin > 0:
        g_ratio = _ratio(change.new.g_factor, change.old.g_factor, "g factor", change)
        out |= _turned_rotation(rotation, change, g_ratio)
    return out, notes


def _ratio(new: float | None, old: float | None, what: str, change: _Change) -> float:
    if change.new == change.old:
        return 1.0
    if not new or not old:
        raise ValueError(
            f"{what} of {change.new.label} or {change.old.label} is not known: give the constants of this isotopologue"
        )
    return new / old


def named_chi(tensor: Floats) -> dict[str, float]:
    """chi_aa, chi_bb-cc and non-zero off-diagonal elements of a tensor, without rounding; chi_cc alone if it is symmetric about c."""
    tensor = without_rounding(tensor)
    if np.count_nonzero(tensor) == 3 and tensor[0, 0] == tensor[1, 1]:  # symmetric about c
        return {"chi_cc": float(tensor[2, 2])}
    elements = {
        "aa": tensor[0, 0],
        "bb-cc": tensor[1, 1] - tensor[2, 2],
        "ab": tensor[0, 1],
        "ac": tensor[0, 2],
        "bc": tensor[1, 2],
    }
    return {f"chi_{letters}": float(value) for letters, value in elements.items() if value}


def without_rounding(tensor: Floats) -> Floats:
    """A tensor (3, 3) with elements below `ROUND_OFF` of its largest set to 0, and diagonal elements made equal if they differ by less.

    >>> without_rounding(np.diag([1.0, 1.00000001, -2.0])).diagonal().tolist()
    [1.000000005, 1.000000005, -2.0]
    """
    least = ROUND_OFF * float(np.abs(tensor).max())
    out = np.where(np.abs(tensor) > least, tensor, 0.0)
    for i, k in ((0, 1), (1, 2)):
        if abs(out[i, i] - out[k, k]) <= least:
            out[i, i] = out[k, k] = (out[i, i] + out[k, k]) / 2
    return out


def _turned_rotation(constants: Mapping[str, float], change: _Change, g_ratio: float) -> dict[str, float]:
    """Spin-rotation constants for the new moments of inertia; C_iso of a linear molecule is proportional to B."""
    if set(constants) == {"C_iso"}:
        return {"C_iso": constants["C_iso"] * g_ratio * float(change.moments[1] / change.new_moments[1])}
    if not set(constants) <= {f"C_{letters}" for letters in (*LETTERS, *DIFFERENCES)}:
        return {}
    tensor = np.zeros((3, 3))
    for name, value in constants.items():
        i, k = ("abc".index(letter) for letter in name[2:4])
        tensor[i, k] += value
        if i != k:
            tensor[k, i] += -value if "-" in name else value
    electrons = change.rotation @ (tensor * change.moments) @ change.rotation.T
    with np.errstate(divide="ignore", invalid="ignore"):
        # a linear top does not rotate about its axis
        new = np.where(change.new_moments > 0, electrons / change.new_moments, 0.0) * g_ratio
    new = without_rounding(new)
    mean, half = (new + new.T) / 2, (new - new.T) / 2
    elements = {letters: _element(mean, letters) for letters in LETTERS}
    if any("-" in name for name in constants):  # else C_ab stands for both orders
        elements |= {letters: _element(half, letters) for letters in DIFFERENCES}
    return {f"C_{letters}": value for letters, value in elements.items() if value}


def _element(tensor: Floats, letters: str) -> float:
    return float(tensor["abc".index(letters[0]), "abc".index(letters[1])])
