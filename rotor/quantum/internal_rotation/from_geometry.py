"""Constants of internal rotors from a geometry and the barriers of similar molecules."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rotor import units
from rotor.arrays import Floats, Ints
from rotor.molecules.bond_rotation import bond_rotation
from rotor.molecules.bond_scan import BondScan, relaxed_scan
from rotor.molecules.bonds import bonded_atoms
from rotor.molecules.molecule import Molecule
from rotor.molecules.symmetry.operations import Operation
from rotor.quantum.bond_torsion import potential_of_scan
from rotor.quantum.estimates.methyl_groups import MethylGroup, methyl_groups
from rotor.quantum.internal_rotation.rho_axis_tensors import REPRESENTATION
from rotor.quantum.reductions import to_representation
from rotor.tops.internal_rotation import COUNTED, MOST_TOPS, PAIRS, InternalRotationConstants, values_and_settings
from rotor.tops.top import Top

F0_ERROR = 0.02  # of F0 from a geometry, relative
IN_PLANE = 1e-3  # cosine of axes to c, b or a up to which a molecule counts as symmetric about its plane ab, ac or bc


def with_internal_rotation(top: Top, calculator: Any = None, given: str = "") -> Top:
    """Add the internal rotation of one to three methyl groups: F0 and axes from the geometry, V3 from similar molecules.

    Parameters
    ----------
    top : Top
        Top with a geometry. Its constants, dipole and distortion remain in principal axes.
    calculator : optional
        ASE calculator, its name, or "mmff" for MMFF94. V3 and V6 of each group then come from a relaxed scan instead of the table.
    given : str, optional
        Values and settings in place of these, such as "V3=400cm-1 vt_max=0". Of several groups V3 is that of each, V3_2 that of the second.

    Returns
    -------
    Top
        Top with constants of the internal rotors in the frame PAM, and notes on source and uncertainty of the barriers.

    Raises
    ------
    ValueError
        If there is no geometry, no methyl group or more than three, or no known barrier.

    Notes
    -----
    F0 from a geometry is good to about 2 %, which its uncertainty states; V3 has one unless it is that of the molecule itself. Splittings
    scale about as exp(-1.3 √(V3/F)). The coupling of the potentials of several groups (V12) is neglected unless it is given.
    """
    groups, top = _groups_of(top), _in_prolate_axes(top)
    numbers = [""] if len(groups) == 1 else [f"_{number}" for number in range(1, len(groups) + 1)]
    values, settings = values_and_settings(given.split())
    values = _for_each(values, numbers)
    exchange = _exchange(top, groups)
    constants: dict[str, Any] = {**_kinetic_constants(top, groups, numbers, exchange)}
    errors = {name: F0_ERROR * value for name, value in constants.items() if name.startswith("F0")}
    origins: dict[str, list[str]] = {}
    alike = exchange is not None and values.get("V3_1") == values.get("V3_2")
    solved = groups[:1] if alike else groups
    potentials = [
        _barriers(top, group, calculator, values.get(f"V3{n}")) for n, group in zip(numbers, solved, strict=False)
    ]
    for number, (barriers, error, origin) in zip(numbers, potentials * (2 if alike else 1), strict=True):
        constants |= {f"{name}{number}": value for name, value in barriers.items()}
        errors |= {f"{name}{number}": error * abs(value) for name, value in barriers.items() if error}
        origins.setdefault(origin, []).append(f"V3{number}")
    texts = [f"F0 and {'the axes' if numbers[0] else 'delta'} from the geometry"]
    texts += [f"{', '.join(names)} = {origin}" for origin, names in origins.items()]
    texts += ["coupling of the potentials (V12) left out"] if numbers[0] and not PAIRS.keys() & values else []
    source = "; ".join(texts)
    nuclei: dict[str, Any] = {
        "spin_states": _spin_states(top, groups),
        "exchanged": _exchanged_pairs(top, groups, exchange),
    }
    uncertain = {name: error for name, error in errors.items() if name not in values}
    internal = InternalRotationConstants(
        constants | values, "PAM", uncertainties=uncertain, source=source, **(nuclei | settings)
    )
    return replace(top, internal_rotation=internal, notes=(*top.notes, f"internal rotation: {source}"))


def _for_each(values: Mapping[str, str], numbers: Sequence[str]) -> dict[str, str]:
    """Values with V3 and V6 as those of each of several groups that has none of its own."""
    common = {name: value for name, value in values.items() if name in ("V3", "V6")}
    each = {f"{name}{number}": value for name, value in common.items() for number in numbers}
    return each | {name: value for name, value in values.items() if name not in common}


def _in_prolate_axes(top: Top) -> Top:
    """The top with its constants in the representation Iʳ, in which internal rotation is computed."""
    if top.kind != "asymmetric" or top.constants.representation == REPRESENTATION:
        return top
    conversion = to_representation(top.constants, REPRESENTATION, top.covariance)
    notes = (conversion.note,) if top.constants.distortion_count else ()
    covariance = top.covariance and conversion.covariance
    return replace(top, constants=conversion.constants, covariance=covariance, notes=(*top.notes, *notes))


def _kinetic_constants(
    top: Top, groups: Sequence[MethylGroup], numbers: Sequence[str], exchange: Operation | None
) -> dict[str, float]:
    """F0 (MHz), delta and, of several groups, epsilon (radians) of each; equal constants of groups that a rotation exchanges."""
    # λ_g I_α of the axes, from ρ_g = λ_g I_α/I_g
    cosines = np.array([group.rotor.rho for group in groups]) * top.moments_u_angstrom2
    if exchange is not None:
        turn = _turn_in_principal_axes(top, exchange)
        first = 0.5 * (cosines[0] + turn @ cosines[1])
        cosines = np.array([first, turn @ first])
    norms = np.linalg.norm(cosines, axis=1)
    directions = cosines / norms[:, None]
    constants = {
        f"F0{number}": units.ROTATIONAL_MHZ_U_ANGSTROM2 / norm
        for number, norm in zip(numbers, norms.tolist(), strict=True)
    }
    across = (np.abs(directions) <= IN_PLANE).all(axis=0)
    for number, (a, b, c) in zip(numbers, directions.tolist(), strict=True):
        if across[2]:  # the exact plane, so that the Hamiltonian is real
            constants[f"delta{number}"] = math.atan2(b, a)
        elif across[1]:
            constants |= {f"delta{number}": math.atan2(c, a), f"epsilon{number}": math.pi / 2}
        else:
            constants |= {f"delta{number}": math.acos(0.0 if across[0] else a), f"epsilon{number}": math.atan2(c, b)}
    return constants


def _exchange(top: Top, groups: Sequence[MethylGroup]) -> Operation | None:
    """The twofold rotation that exchanges two groups; None if there is none."""
    if len(groups) != 2 or top.symmetry is None:
        return None
    first, second = (set(group.hydrogens) for group in groups)
    for operation in top.symmetry.rotations:
        if set(operation.permutation[list(first)].tolist()) == second and operation.order == 2:
            return operation
    return None


def _turn_in_principal_axes(top: Top, exchange: Operation) -> Floats:
    """The twofold rotation on components along a, b, c: the one about the principal axis nearest to its axis."""
    assert top.frame is not None
    nearest = int(np.argmax(np.abs(top.frame.axes @ exchange.axis)))
    return np.diag(np.where(np.arange(3) == nearest, 1.0, -1.0))


def _exchanged_pairs(top: Top, groups: Sequence[MethylGroup], exchange: Operation | None) -> tuple[int, ...]:
    """2I + 1 of each pair of nuclei with spin, outside the groups, that the exchange of the groups exchanges too."""
    if exchange is None:
        return ()
    assert top.molecule is not None
    turning = {i for group in groups for i in group.hydrogens}
    states = [round(2 * nucleus.spin) + 1 for nucleus in top.molecule.nuclei]
    images = exchange.permutation.tolist()
    return tuple(states[i] for i, image in enumerate(images) if i < image and i not in turning and states[i] > 1)


def _barriers(top: Top, group: MethylGroup, calculator: Any, given: str | None) -> tuple[dict[str, float], float, str]:
    """V3 and, of a scan, V6 (MHz) of a group, their relative error (0 if unknown), and text on both; ValueError for an unknown barrier."""
    assert top.molecule is not None
    if given is not None:
        return {}, 0.0, f"{given}, given"
    if calculator is not None:
        barriers, scan = _scanned(top, group, calculator)
        error, origin = scan.relative_error, f"of a {scan.source}, {scan.doubt or 'whose error is not known'}"
    elif group.barrier is not None and not group.rotor.barrier_mhz:
        raise ValueError(
            f"internal rotation of {top.name or 'this top'}: a methyl group on a ring of six may have no threefold barrier (toluene: V6 = "
            "4.88 cm-1 alone); give both (geometry V3=0cm-1 V6=4.88cm-1), where weights of nuclei that the ring exchanges are left out"
        )
    elif group.barrier is None:
        raise ValueError(
            f"internal rotation of {top.name or 'this top'}: no similar molecule with a threefold barrier is known; give V3 (geometry "
            "V3=400cm-1), or scan it"
        )
    else:
        barriers, error = {"V3": group.rotor.barrier_mhz}, group.barrier.relative_error(top.molecule)
        origin = group.barrier.text(top.molecule)
    return barriers, error, f"{barriers['V3'] / units.MHZ_PER_CM:.4g} cm-1, {origin}"


def _scanned(top: Top, group: MethylGroup, calculator: Any) -> tuple[dict[str, float], BondScan]:
    """V3 and V6 (MHz) of a relaxed scan about the bond of the group, α = 0 at the minimum of the lowest term; and the scan."""
    assert top.molecule is not None
    bonds = bonded_atoms(top.molecule)
    carbon = int(bonds[group.hydrogens[0]][0])
    bearer = next(i for i in bonds[carbon].tolist() if i not in group.hydrogens)
    rotation = bond_rotation(top.molecule, f"{bearer + 1}-{carbon + 1}")
    scan = relaxed_scan(rotation, calculator, points=36)
    series = potential_of_scan(scan, rotation)
    # of exp(inα), from n = 3 or 6 up
    terms = dict(zip(series.n.tolist(), series.cosines - 1j * series.sines, strict=True))
    lowest = min(terms)
    start = np.angle(-terms[lowest]) / -lowest  # angle of its minimum: the lowest term is -|t| cos n(α - start)
    return {f"V{n}": float(-2 * (terms.get(n, 0.0) * np.exp(1j * n * start)).real) for n in (3, 6)}, scan


def _groups_of(top: Top) -> list[MethylGroup]:
    """The methyl groups; ValueError for none, more than three, or groups of different isotopes."""
    name = top.name or "this top"
    if top.molecule is None:
        raise ValueError(
            f"internal rotation of {name}: there is no geometry; give its constants, such as RAM F=... rho=... V3=..."
        )
    bonds = bonded_atoms(top.molecule)
    groups = methyl_groups(top.molecule, bonds)
    if not groups and (carbon := _carbon_of_unlike_hydrogens(top.molecule, bonds)):
        raise ValueError(
            f"internal rotation of {name}: the hydrogens of carbon {carbon} are not all alike (CH2D, CHD2); their potential is threefold, "
            "their moments of inertia are not, so that there are no species A and E: such a group is not computed"
        )
    if not groups:
        raise ValueError(f"internal rotation of {name}: no methyl group turns")
    if len(groups) > MOST_TOPS:
        raise ValueError(
            f"internal rotation of {name}: {len(groups)} methyl groups turn; up to {COUNTED[MOST_TOPS]} are computed: write the constants "
            "of those that matter, PAM F0_1=... delta_1=... V3_1=..."
        )
    return groups


def _carbon_of_unlike_hydrogens(molecule: Molecule, bonds: Sequence[Ints]) -> int:
    """The number, from 1, of a carbon with three hydrogens of different isotopes; 0 for none."""
    for carbon, near in enumerate(bonds):
        hydrogens = [i for i in near.tolist() if molecule.symbols[i] == "H"]
        if (
            molecule.symbols[carbon] == "C"
            and len(hydrogens) == 3
            and np.ptp([molecule.mass_numbers[i] for i in hydrogens])
        ):
            return carbon + 1
    return 0


def _spin_states(top: Top, groups: Sequence[MethylGroup]) -> int | tuple[int, ...]:
    """2I + 1 of the nuclei of each group: 3 of CD3, else 2; one number if all have the same."""
    assert top.molecule is not None
    states = tuple(3 if top.molecule.mass_numbers[group.hydrogens[0]] == 2 else 2 for group in groups)
    return states[0] if len(set(states)) == 1 else states
