"""Nuclear-spin weights from the permutations of nuclei under the rotations of a molecule, and from the nuclear spins.

The total wave function changes sign under an odd permutation of identical fermions, and does not change under any other
permutation of identical nuclei. The weight of a level is the number of spin functions that satisfy this. Under a rotation R the
spin functions have the character Π (2I+1) over the cycles of its permutation. Multiplied by the sign (-1)^(length-1) of each cycle
of fermions and by the character of the electronic and vibrational state it is f(R), and the weight of a rotational species Γ is

    w(Γ) = Σ_R χ_Γ(R) f(R) / Σ_R 1

(P. R. Bunker and P. Jensen, Molecular Symmetry and Spectroscopy, 2nd ed., NRC Research Press 1998, chapter 8). The
rotations suffice as long as inversion is not resolved. No weight depends on the name of a molecule.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Ints
from rotor.frozen import dataclass
from rotor.molecules.molecule import CLOSEST_ANGSTROM, Molecule
from rotor.molecules.symmetry.operations import Operation, shortest_distance
from rotor.molecules.symmetry.point_group import TOLERANCE, Symmetry, find_symmetry, molecule_symmetry
from rotor.tops.spins.spin_weights import IRREPS, SPECIES, SpinWeights, character_table

STATES = ("symmetric", "antisymmetric")  # lower and upper state of each inversion doublet


@dataclass(frozen=True)
class CharacterRow:
    """A class of rotations: name, number, cycles of nuclei as (spin, length, count), and f(R)."""

    rotation: str
    count: int
    cycles: tuple[tuple[float, int, int], ...]
    character: int


def statistical_weights(
    molecule: Molecule,
    tolerance: float = TOLERANCE,
    electronic: str | Sequence[int] | None = None,
    inversion: str | None = None,
) -> SpinWeights:
    """Spin weights of a molecule's rotational levels, reduced by their common divisor.

    Parameters
    ----------
    molecule : Molecule
    tolerance : as for `molecule_symmetry`.
    electronic : symmetry of the electronic and vibrational state under the rotations, as for `spin_weights`; None for
        that of the molecule.
    inversion : None for unresolved inversion doublets; `"symmetric"` or `"antisymmetric"` for the weights of one state of
        a molecule that inverts through the plane of its a and b axes, such as NH3.

    Returns
    -------
    SpinWeights
        By symmetry species of the levels.

    Examples
    --------
    >>> water = Molecule(("O", "H", "H"), [[0, 0, 0.1173], [0, 0.7572, -0.4692], [0, -0.7572, -0.4692]])
    >>> statistical_weights(water).to_mapping()
    {'ee': 1, 'eo': 3, 'oe': 3, 'oo': 1}
    >>> statistical_weights(water.with_isotopes("2=2H")).to_mapping()
    {}
    """
    spins = [nucleus.spin for nucleus in molecule.nuclei]
    electronic = molecule.electronic if electronic is None else electronic
    if inversion is None:
        return spin_weights(molecule_symmetry(molecule, tolerance), spins, electronic)
    if inversion not in STATES:
        raise ValueError(f"inversion {inversion!r}: expected None, 'symmetric' or 'antisymmetric'")
    if electronic != "even":
        raise ValueError("inversion is for a totally symmetric electronic state: leave `electronic` at 'even'")
    kinds = list(zip(molecule.symbols, molecule.mass_numbers, strict=True))
    flat, signs = inverting_symmetry(kinds, molecule.masses_u, molecule.positions_angstrom, tolerance)
    return spin_weights(flat, spins, signs if inversion == "antisymmetric" else "even")


def spin_weights(symmetry: Symmetry, spins: Sequence[float], electronic: str | Sequence[int] = "even") -> SpinWeights:
    """Weights of the rotational species of a molecule from its symmetry, reduced by their common divisor.

    The rule follows from the group of rotations: none for C1 and C∞, parities of (Ka, Kc) for C2 and D2, |K| modulo n
    for Cn and Dn, parity of J for D∞, irreps for T, O and I. Equal moments of inertia do not matter.

    Parameters
    ----------
    symmetry : as `find_symmetry` gives it.
    spins : n nuclear spins in units of h/2π, in the order of the nuclei.
    electronic : "even" for a totally symmetric state. "odd", for C2 and D∞ only, for a state that changes sign under the half
        turns (Σg- of O2: half turns across the axis; 16O18O has none). Otherwise characters +1 and -1, one for each of
        `symmetry.rotations`.

    Raises
    ------
    ValueError
        For spins that do not fit the nuclei, differ between identical nuclei or are not multiples of 1/2, and for characters that
        are not a representation.

    Examples
    --------
    >>> found = find_symmetry("OO", [15.995, 15.995], [[0, 0, -0.604], [0, 0, 0.604]])
    >>> spin_weights(found, [0, 0], electronic="odd").to_mapping()
    {'even': 0, 'odd': 1}
    """
    characters = spin_characters(symmetry, spins, electronic)
    group = symmetry.rotation_group
    if group in ("C1", "C∞", "K"):
        return SpinWeights()
    if group == "D∞":
        return SpinWeights.from_mapping({"even": sum(characters), "odd": characters[0] - characters[1]})
    if group in ("C2", "D2"):
        return SpinWeights.from_mapping(_by_parities(symmetry, characters))
    if group in IRREPS:
        return SpinWeights.from_mapping(_by_irrep(symmetry, characters))
    return SpinWeights.from_mapping(_by_k(symmetry, characters))


def spin_characters(
    symmetry: Symmetry, spins: Sequence[float], electronic: str | Sequence[int] = "even"
) -> tuple[int, ...]:
    """f(R) of each of `symmetry.rotations`: spin character times sign of the fermions times electronic character."""
    n = len(symmetry.rotations[0].permutation)
    if len(spins) != n:
        raise ValueError(f"{len(spins)} spins for {n} nuclei: expected one each")
    if any(not spin >= 0 or 2 * spin != int(2 * spin) for spin in spins):
        raise ValueError(f"spins {list(spins)[:8]}: expected multiples of 1/2 from 0 up")
    signs = _electronic_characters(symmetry, electronic)
    return tuple(
        sign
        * math.prod(
            _cycle_character(spin, length) ** count for spin, length, count in cycles(operation.permutation, spins)
        )
        for sign, operation in zip(signs, symmetry.rotations, strict=True)
    )


def character_rows(
    symmetry: Symmetry, spins: Sequence[float], electronic: str | Sequence[int] = "even"
) -> list[CharacterRow]:
    """The characters f(R) behind the weights, one row for each class of rotations: E first, the others by name."""
    counts: dict[tuple[str, tuple[tuple[float, int, int], ...], int], int] = {}
    for operation, character in zip(symmetry.rotations, spin_characters(symmetry, spins, electronic), strict=True):
        key = _operation_name(symmetry, operation), cycles(operation.permutation, spins), character
        counts[key] = counts.get(key, 0) + 1
    # rotations themselves are ordered by round-off
    ordered = sorted(counts.items(), key=lambda item: (item[0][0] != "E", item[0]))
    return [CharacterRow(name, count, turns, character) for (name, turns, character), count in ordered]


def cycles(permutation: Ints, spins: Sequence[float]) -> tuple[tuple[float, int, int], ...]:
    """Cycles of a permutation as (spin, length, count); ValueError if it exchanges nuclei of different spin.

    >>> cycles(np.array([1, 2, 0, 3]), [0.5, 0.5, 0.5, 1])
    ((0.5, 3, 1), (1.0, 1, 1))
    """
    counts: dict[tuple[float, int], int] = {}
    images, seen = permutation.tolist(), [False] * len(permutation)
    for start in range(len(images)):
        length, atom = 0, start
        while not seen[atom]:
            seen[atom], length = True, length + 1
            image = images[atom]
            if spins[image] != spins[atom]:
                both = f"{spins[atom]:g} and {spins[image]:g}"
                raise ValueError(f"like nuclei {atom + 1} and {image + 1} have spins {both}; give both the same")
            atom = image
        if length:
            key = float(spins[start]), length
            counts[key] = counts.get(key, 0) + 1
    return tuple((spin, length, count) for (spin, length), count in sorted(counts.items()))


def inverting_symmetry(
    kinds: Sequence[Hashable], masses_u: ArrayLike, positions_angstrom: ArrayLike, tolerance: float = TOLERANCE
) -> tuple[Symmetry, tuple[int, ...]]:
    """Symmetry of an inverting molecule, and the characters of the antisymmetric state of each doublet.

    The molecule is projected onto the plane of its a and b axes, halfway between its two forms. A rotation of the planar
    form has the character +1 if it is also a rotation of the rigid form, and -1 if it exchanges the two forms.

    Parameters
    ----------
    kinds : sequence of hashable
        One entry for each nucleus; identical nuclei have equal entries.
    masses_u : (n,) array
        Masses of the nuclei.
    positions_angstrom : (n, 3) array
        Positions in one of the two forms.
    tolerance : float, optional
        Tolerance of the symmetry, relative to the shortest distance.

    Returns
    -------
    symmetry : Symmetry
        Symmetry of the planar form.
    characters : tuple of int
        1 or -1 for each rotation.

    Raises
    ------
    ValueError
        For a planar molecule, for one without a unique plane of inversion, and if nuclei would coincide in the plane.
    """
    rigid = find_symmetry(kinds, masses_u, positions_angstrom, tolerance)
    points = np.asarray(positions_angstrom, dtype=float)
    normal = rigid.axes_abc[2]
    heights = (points - points.mean(axis=0)) @ normal
    if rigid.linear or np.ptp(heights) <= rigid.tolerance_angstrom:
        raise ValueError(f"the molecule is flat within {rigid.tolerance_angstrom:.2g} Å: there is no inversion")
    # an axis of order 3 or more across the plane's normal makes axes equivalent
    if any(order > 2 and abs(axis @ normal) < 0.9 for order, axis in rigid.axes):
        raise ValueError("no plane to invert through: the b and c axes, or all three, are alike by symmetry")
    flat_points = points - np.outer(heights, normal)
    if len(points) < 2 or shortest_distance(flat_points) < CLOSEST_ANGSTROM:
        raise ValueError("nuclei meet in the plane of the a and b axes: the molecule does not invert through it")

    flat = find_symmetry(kinds, masses_u, flat_points, tolerance)
    rigid_ones = {operation.permutation.tobytes() for operation in rigid.rotations}
    return flat, tuple(1 if operation.permutation.tobytes() in rigid_ones else -1 for operation in flat.rotations)


def _cycle_character(spin: float, length: int) -> int:
    """Spin character of a cycle, with the sign of the permutation for fermions."""
    states = round(2 * spin) + 1
    fermions = states % 2 == 0
    # a cycle of even length is an odd permutation: fermions change sign
    return -states if fermions and length % 2 == 0 else states


def _electronic_characters(symmetry: Symmetry, electronic: str | Sequence[int]) -> tuple[int, ...]:
    rotations = symmetry.rotations
    if electronic == "even":
        return (1,) * len(rotations)
    if electronic == "odd" and len(rotations) <= 2:
        return (1, -1)[: len(rotations)]
    if isinstance(electronic, str):
        raise ValueError(
            f"electronic {electronic!r} with the rotations {symmetry.rotation_group}: 'even', 'odd' for C2 and D∞, or "
            f"expected {len(rotations)} characters +1 and -1"
        )
    if len(electronic) != len(rotations) or not _is_representation(rotations, electronic):
        raise ValueError(
            f"electronic {list(electronic)}: expected {len(rotations)} characters +1 and -1 that multiply like the rotations "
            f"of {symmetry.rotation_group}"
        )
    return tuple(int(sign) for sign in electronic)


def _is_representation(rotations: Sequence[Operation], signs: Sequence[int]) -> bool:
    sign_of = {operation.permutation.tobytes(): sign for operation, sign in zip(rotations, signs, strict=True)}
    products = ((p, q, sign_of[p.permutation[q.permutation].tobytes()]) for p in rotations for q in rotations)
    return set(signs) <= {1, -1} and all(
        sign == sign_of[p.permutation.tobytes()] * sign_of[q.permutation.tobytes()] for p, q, sign in products
    )


def _principal_letter(symmetry: Symmetry, operation: Operation) -> str:
    """Letter of the principal axis of a twofold rotation."""
    return "abc"[int(np.argmax(np.abs(symmetry.axes_abc @ operation.axis)))]


def _operation_name(symmetry: Symmetry, operation: Operation) -> str:
    """E, C3, C2(b) along a principal axis, C2′ across the main axis, C4² along a fourfold one."""
    if operation.order == 1:
        return "E"
    group = symmetry.rotation_group
    if group == "D∞":
        return "C2′"
    if group in ("C2", "D2"):
        return f"C2({_principal_letter(symmetry, operation)})"
    if group == "O" and operation.order == 2:
        return "C4²" if _on_fourfold_axis(symmetry, operation) else "C2"
    across = group.startswith("D") and abs(operation.axis @ symmetry.axes[0][1]) < 0.5
    return f"C{operation.order}{'′' if across else ''}"


def _on_fourfold_axis(symmetry: Symmetry, operation: Operation) -> bool:
    return any(order == 4 and abs(axis @ operation.axis) > 0.9 for order, axis in symmetry.axes)


def _by_parities(symmetry: Symmetry, characters: Sequence[int]) -> dict[str, int]:
    """C2 or D2: a half turn about a, b, c multiplies |J Ka Kc> by (-1)^Ka, (-1)^(Ka+Kc), (-1)^Kc."""
    weights = {}
    for species in SPECIES:
        ka, kc = (-1 if parity == "o" else 1 for parity in species)
        signs = {"E": 1, "C2(a)": ka, "C2(b)": ka * kc, "C2(c)": kc}
        terms = [
            signs[_operation_name(symmetry, operation)] * f
            for operation, f in zip(symmetry.rotations, characters, strict=True)
        ]
        weights[species] = sum(terms) // len(terms)
    return weights


def _by_k(symmetry: Symmetry, characters: Sequence[int]) -> dict[str, int]:
    """Cn or Dn, n > 2: |J K> turns by 2πK/n about the main axis; half turns across it swap ±K with (-1)^J.

    Weights are those of a single component. For Dn they are doubled, because the weight of a pair ±K may be odd.
    """
    n, main = symmetry.axes[0]
    turns = dict.fromkeys((d for d in range(1, n + 1) if n % d == 0), 0)
    across = 0
    for operation, f in zip(symmetry.rotations, characters, strict=True):
        if operation.order > 1 and abs(operation.axis @ main) < 0.5:
            across += f
        else:
            turns[operation.order] = f  # rotations of one order are powers of each other and share f
    along = [sum(f * _ramanujan_sum(order, k) for order, f in turns.items()) for k in range(n)]
    if symmetry.rotation_group.startswith("C"):
        return {str(k): total // n for k, total in enumerate(along)}
    zero = {"0even": (along[0] + across) // n, "0odd": (along[0] - across) // n}
    return zero | {str(k): along[k] // n for k in range(1, n)}


def _ramanujan_sum(q: int, k: int) -> int:
    """Σ cos(2πkm/q) over m = 1 ... q that are coprime to q; a whole number."""
    # an integer; the sum of cosines has round-off
    return round(sum(math.cos(2 * math.pi * k * m / q) for m in range(1, q + 1) if math.gcd(m, q) == 1))


def _by_irrep(symmetry: Symmetry, characters: Sequence[int]) -> dict[str, int]:
    """T, O, I. Classes of one order that are powers of each other share f, so that sums of characters are whole."""
    irreps = IRREPS[symmetry.rotation_group]
    classes, table = character_table(irreps)
    character_by_name = {
        _operation_name(symmetry, operation): f for operation, f in zip(symmetry.rotations, characters, strict=True)
    }
    names = ["E" if n == 1 else f"C{n}" for n, _, _ in classes]
    if symmetry.rotation_group == "O":
        names[2] = "C4²"
    weights = {}
    for irrep, row in zip(irreps, table, strict=True):
        sums = dict.fromkeys(character_by_name, 0.0)
        for name, (_, _, size), value in zip(names, classes, row, strict=True):
            sums[name] += size * value
        weights[irrep] = sum(round(total) * character_by_name[name] for name, total in sums.items()) // len(characters)
    return weights
