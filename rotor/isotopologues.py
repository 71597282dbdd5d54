"""The isotopologues of a molecule: abundance, constants, axes, dipole and spin weights of each.

In the approximation of Born and Oppenheimer the geometry and the charges stay where they are; the masses move the centre
and turn the principal axes. Where the parent has better constants than its geometry gives, they are carried over by the
ratio of calculated ones, X' = X · X'_calc / X_calc along matched axes, so that most of what vibration does cancels.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotor.constants import Constants
from rotor.inertia import PrincipalFrame
from rotor.molecules.molecule import Molecule
from rotor.molecules.nuclei import isotope, natural_isotopes
from rotor.molecules.symmetry import symmetry_of
from rotor.terms import distortion_terms, powers_of_spelled
from rotor.top import Top

Floats = NDArray[np.float64]
Changes = Mapping[int | str, str] | str

MOST_ARRANGEMENTS = 50_000  # of isotopes on the atoms, equivalent ones counted each
TURNED_TOO_FAR_DEGREES = 5.0  # beyond it distortion constants are not carried over
_DOUBTFUL_OVERLAP = 0.6  # cos² below which it is doubtful which axis is which


@dataclass(frozen=True)
class Isotopologue:
    """One isotopologue.

    top : constants, kind, dipole in its own axes, spin weights, and in `top.molecule` the masses
    substituted : by 1-based atom number, how it differs from the most abundant isotopes, such as `{2: "2H"}`
    arrangements : how many equivalent placements of the isotopes count as this one
    abundance : fraction of the natural molecules, all those placements together
    axes : the parent's axes that a, b and c are nearest to: `"abc"`, or `"bac"` where two have changed places
    turned_degrees : the angle by which the axes turned against the parent's, matched; axes that are free to turn in a
        symmetric top do not count
    """

    top: Top
    substituted: Mapping[int, str]
    arrangements: int
    abundance: float
    axes: str
    turned_degrees: float

    @property
    def formula(self) -> str:
        """Formula in Hill's order, such as `"H[2H]O"`."""
        return _geometry(self.top).formula

    @property
    def label(self) -> str:
        """The formula, with the atoms that are substituted where there are any: `"H[2H]O (2=2H)"`."""
        sites = ",".join(f"{atom}={name}" for atom, name in self.substituted.items())
        return f"{self.formula} ({sites})" if sites else self.formula


def isotopologues(parent: Top, *, min_abundance: float = 1e-4) -> tuple[Isotopologue, ...]:
    """All isotopologues of a molecule at least as abundant in nature as `min_abundance`, the most abundant first.

    Placements that a symmetry of the geometry (rotation or reflection) carries into one another are one isotopologue.
    An element that nature lacks keeps the isotope it has.

    Parameters
    ----------
    parent : Top
        With a geometry; its isotopes need not be the abundant ones.
    min_abundance : float
        Fraction of the natural molecules, above 0.

    Returns
    -------
    tuple of Isotopologue

    Raises
    ------
    ValueError
        A top without geometry, a limit that nothing reaches or that too many placements exceed.

    >>> from rotor.molecules.molecule import Molecule
    >>> water = Molecule(("O", "H", "H"), [[0, 0, 0.1173], [0, 0.7572, -0.4692], [0, -0.7572, -0.4692]])
    >>> for one in isotopologues(Top.from_molecule(water)):
    ...     print(one.formula, round(one.abundance, 6), one.arrangements)
    H2O 0.997281 1
    H2[18O] 0.002044 1
    H2[17O] 0.000383 1
    H[2H]O 0.000289 2
    """
    if not 0 < min_abundance <= 1:
        raise ValueError(f"least abundance {min_abundance:g}: a fraction above 0 and up to 1 is wanted")
    molecule = _geometry(parent)
    permutations = _permutations(molecule)
    found: dict[tuple[int, ...], tuple[float, int]] = {}
    for numbers, abundance in _placements(molecule, min_abundance / len(permutations)):
        alike = {tuple(image) for image in _images(numbers, permutations)}
        found[max(alike, key=lambda image: _earliest(molecule, image))] = (abundance * len(alike), len(alike))
    kept = {numbers: one for numbers, one in found.items() if one[0] >= min_abundance}
    if not kept:
        raise ValueError(
            f"no isotopologue of {molecule.formula} has an abundance of {min_abundance:g}; lower the limit"
        )
    ordered = sorted(kept, key=lambda numbers: -kept[numbers][0])
    return tuple(_isotopologue(parent, numbers, permutations) for numbers in ordered)


def isotopologue(parent: Top, changes: Changes) -> Isotopologue:
    """The isotopologue of a top with a geometry that substitutions such as `"2=2H"` or `{"O": "18O"}` make.

    Raises ValueError for a top without geometry, and what `Molecule.with_isotopes` refuses.

    >>> from rotor.molecules.molecule import Molecule
    >>> water = Molecule(("O", "H", "H"), [[0, 0, 0.1173], [0, 0.7572, -0.4692], [0, -0.7572, -0.4692]],
    ...                  dipole_debye=[0, 0, -1.8546])
    >>> hdo = isotopologue(Top.from_molecule(water), "2=2H")
    >>> hdo.axes, round(hdo.turned_degrees, 1), [round(abs(mu), 2) for mu in hdo.top.dipole_abc_debye]
    ('abc', 21.1, [0.67, 1.73, 0.0])
    """
    molecule = _geometry(parent)
    return _isotopologue(parent, molecule.with_isotopes(changes).mass_numbers, _permutations(molecule))


def single_substitutions(parent: Top, element: str, name: str) -> tuple[Isotopologue, ...]:
    """The isotopologues with one atom of an element substituted, one for each set of equivalent atoms.

    This is the set from which substitution structures are made. Raises ValueError for an element that is not there.

    >>> from rotor.molecules.molecule import Molecule
    >>> hcn = Molecule(("H", "C", "N"), [[0, 0, -1.0655], [0, 0, 0], [0, 0, 1.1532]])
    >>> [one.label for one in single_substitutions(Top.from_molecule(hcn), "C", "13C")]
    ['[13C]HN (2=13C)']
    """
    molecule = _geometry(parent)
    permutations = _permutations(molecule)
    atoms = [atom for atom, symbol in enumerate(molecule.symbols) if symbol == element]
    if not atoms:
        raise ValueError(f"element {element!r} to substitute is not in {molecule.formula}")
    first = sorted({min(int(p[atom]) for p in permutations) for atom in atoms})
    return tuple(
        _isotopologue(parent, molecule.with_isotopes({atom + 1: name}).mass_numbers, permutations) for atom in first
    )


def _geometry(parent: Top) -> Molecule:
    if parent.molecule is None:
        raise ValueError(f"isotopes cannot be changed in {parent.name or 'constants alone'}: there is no geometry")
    return parent.molecule


# Which there are


def _permutations(molecule: Molecule) -> list[NDArray[np.int64]]:
    """The permutations of atoms that the operations of the bare geometry make, all isotopes alike."""
    alike = replace(molecule, mass_numbers=_abundant(molecule))
    symmetry = symmetry_of(alike)
    distinct = {tuple(one.permutation.tolist()) for one in (*symmetry.rotations, *symmetry.improper)}
    return [np.array(permutation) for permutation in sorted(distinct)]


def _abundant(molecule: Molecule) -> tuple[int, ...]:
    """The most abundant isotope of every atom; of elements that nature lacks the one that is there."""
    pairs = zip(molecule.symbols, molecule.mass_numbers, strict=True)
    return tuple(isotope(s).mass_number if natural_isotopes(s) else number for s, number in pairs)


def _placements(molecule: Molecule, least: float) -> Iterator[tuple[tuple[int, ...], float]]:
    """Mass numbers and abundance of every placement with at least that abundance.

    From the most abundant one atom after another is substituted, each step less abundant than the one before, so that
    what falls below the limit is cut with all that would follow.
    """
    fractions = [{one.mass_number: one.abundance for one in natural_isotopes(s)} for s in molecule.symbols]
    base = _abundant(molecule)
    ratios = [
        [(number, part / options[base[atom]]) for number, part in options.items() if number != base[atom]]
        for atom, options in enumerate(fractions)
    ]
    abundance = math.prod(options.get(base[atom], 1.0) for atom, options in enumerate(fractions))
    waiting = [(0, base, abundance)] if abundance >= least else []
    for count in itertools.count(1):
        if not waiting:
            return
        if count > MOST_ARRANGEMENTS:
            raise ValueError(
                f"more than {MOST_ARRANGEMENTS} placements of isotopes on {molecule.formula}: raise the least abundance"
            )
        start, numbers, part = waiting.pop()
        yield numbers, part
        for atom in range(start, len(base)):
            for number, ratio in ratios[atom]:
                if part * ratio >= least:
                    waiting.append((atom + 1, (*numbers[:atom], number, *numbers[atom + 1 :]), part * ratio))


def _images(numbers: tuple[int, ...], permutations: list[NDArray[np.int64]]) -> Iterator[list[int]]:
    values = np.array(numbers)
    for permutation in permutations:
        image = np.empty_like(values)
        image[permutation] = values
        yield image.tolist()


def _earliest(molecule: Molecule, numbers: tuple[int, ...]) -> list[int]:
    """Greatest for the placement that names the lowest atoms."""
    return [abs(number - usual) for number, usual in zip(numbers, _abundant(molecule), strict=True)]


# What each is


def _isotopologue(parent: Top, numbers: tuple[int, ...], permutations: list[NDArray[np.int64]]) -> Isotopologue:
    molecule = _geometry(parent)
    if parent.dipole_abc_debye is not None and parent.frame is not None:
        molecule = replace(
            molecule,
            dipole_debye=np.array(parent.dipole_abc_debye) @ parent.frame.axes,
            dipole_source=parent.dipole_source,
        )
    symbols = molecule.symbols
    changes: dict[int | str, str] = {
        atom: f"{number}{symbols[atom - 1]}" for atom, number in enumerate(numbers, start=1)
    }
    rigid = Top.from_molecule(molecule)
    turned = Top.from_molecule(molecule.with_isotopes(changes))
    axes, overlap = _matched(rigid, turned)
    angle = _turned_degrees(rigid, turned, axes)
    usual = _abundant(molecule)
    substituted = {atom: changes[atom] for atom in range(1, len(usual) + 1) if numbers[atom - 1] != usual[atom - 1]}
    arrangements = len({tuple(image) for image in _images(numbers, permutations)})
    top = _carried_over(parent, rigid, turned, axes, angle)
    notes = (*top.notes, *_doubts(parent, overlap, angle))
    top = replace(top, name=_name(parent, molecule, turned), notes=tuple(dict.fromkeys(notes)))
    return Isotopologue(top, substituted, arrangements, arrangements * _abundance(symbols, numbers), axes, angle)


def _name(parent: Top, molecule: Molecule, turned: Top) -> str:
    formula = _geometry(turned).formula
    if parent.name and formula == molecule.formula:
        return parent.name
    return formula if parent.name in ("", molecule.formula) else f"{parent.name} ({formula})"


def _abundance(symbols: tuple[str, ...], numbers: tuple[int, ...]) -> float:
    """Of one placement; the isotopes of an element that nature lacks count as all there is."""
    pairs = zip(symbols, numbers, strict=True)
    return math.prod(isotope(s, number).abundance if natural_isotopes(s) else 1.0 for s, number in pairs)


def _alike(kind: str) -> tuple[tuple[int, ...], ...]:
    """Axes that are free to turn among themselves."""
    return {"spherical": ((0, 1, 2),), "oblate": ((0, 1), (2,)), "asymmetric": ((0,), (1,), (2,))}.get(
        kind, ((0,), (1, 2))
    )


def _matched(parent: Top, turned: Top) -> tuple[str, float]:
    """The parent's axes nearest to a, b, c, and the smallest cos² of the matches; free directions are taken together."""
    assert parent.frame is not None  # both are tops of a geometry
    assert turned.frame is not None
    squares = (turned.frame.axes @ parent.frame.axes.T) ** 2
    inside = np.zeros((3, 3))  # of each axis in the space that the other may turn in
    for own, other in itertools.product(map(list, _alike(turned.kind)), map(list, _alike(parent.kind))):
        block = np.ix_(own, other)
        inside[block] = squares[block].sum() / min(len(own), len(other))
        squares[block] = squares[block].mean()
    ways = itertools.permutations(range(3))  # the first, which changes nothing, wins where overlaps are alike
    best = max(ways, key=lambda way: round(sum(squares[i, j] for i, j in enumerate(way)), 9))
    return "".join("abc"[j] for j in best), min(float(inside[i, j]) for i, j in enumerate(best))


def _turned_degrees(parent: Top, turned: Top, axes: str) -> float:
    """The angle between matched axes; where one of the tops is symmetric, of its unique axis alone."""
    assert parent.frame is not None  # both are tops of a geometry
    assert turned.frame is not None
    if "spherical" in (parent.kind, turned.kind):
        return 0.0
    if parent.kind == turned.kind == "asymmetric":
        matched = parent.frame.axes[["abc".index(letter) for letter in axes]]
        return min(_angle(turned.frame.axes @ (matched * signs).T) for signs in _proper_signs(matched))
    one, other = (turned, parent) if parent.kind == "asymmetric" else (parent, turned)
    unique = one.frame.axes[2 if one.kind == "oblate" else 0]  # type: ignore[union-attr]  # asserted above
    nearest = float(np.abs(other.frame.axes @ unique).max())  # type: ignore[union-attr]
    return math.degrees(math.atan2(math.sqrt(max(0.0, 1 - nearest**2)), nearest))


def _proper_signs(axes: Floats) -> Iterator[Floats]:
    """Signs (3, 1) of axes that make them right-handed."""
    for signs in itertools.product((1.0, -1.0), repeat=3):
        if math.prod(signs) * np.linalg.det(axes) > 0:
            yield np.array(signs)[:, None]


def _angle(rotation: Floats) -> float:
    """Of a rotation matrix, in degrees, exact for small ones too."""
    vector = np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    return math.degrees(math.atan2(float(np.linalg.norm(vector)), float(np.trace(rotation)) - 1))


# Constants


def _carried_over(parent: Top, rigid: Top, turned: Top, axes: str, angle: float) -> Top:
    """The top of the geometry, with the parent's constants carried over where they are others than its geometry's."""
    if _masses(turned) == _masses(parent):
        return parent
    if _of_geometry(parent.constants, rigid.constants):
        return turned
    ratios = _ratios(rigid, turned, axes)
    order = ["abc".index(letter) for letter in axes]
    values = np.array(parent.constants.rigid)[order] * ratios
    values, turned = _in_order(values, turned)
    constants = _of_kind(values, turned.kind)
    name = parent.name or "the parent"
    note = (
        f"constants are those of {name} times the ratio of those calculated from its geometry; such constants were 0.02 % "
        "off where heavy atoms were replaced, and up to 0.8 % where hydrogen was"
    )
    origin = f" ({parent.source})" if parent.source else ""
    source = f"scaled from {name}{origin} by {_ratio_text(ratios, axes)}"
    constants, told = _with_distortion(parent, constants, axes, angle)
    return replace(turned, constants=constants, source=source, notes=(*turned.notes, note, *told))


def _masses(top: Top) -> tuple[int, ...]:
    return top.molecule.mass_numbers if top.molecule else ()


def _of_geometry(constants: Constants, rigid: Constants) -> bool:
    """Whether constants are those of a rigid geometry and nothing more."""
    same = constants.values.keys() == rigid.values.keys()
    return same and all(math.isclose(constants[name], rigid[name], rel_tol=1e-9) for name in rigid.values)


def _ratios(rigid: Top, turned: Top, axes: str) -> Floats:
    """X'_calc / X_calc along a, b, c; 1 along the axis of a linear molecule, where there is none."""
    before = np.array(rigid.constants.rigid)[["abc".index(letter) for letter in axes]]
    after = np.array(turned.constants.rigid)
    finite = np.isfinite(before)
    return np.where(finite, np.where(finite, after, 1.0) / np.where(finite, before, 1.0), 1.0)


def _ratio_text(ratios: Floats, axes: str) -> str:
    return ", ".join(
        f"{own.upper()} {ratio:.5f}" + (f" (from the parent's {other.upper()})" if own != other else "")
        for own, other, ratio in zip("abc", axes, ratios, strict=True)
    )


def _in_order(values: Floats, turned: Top) -> tuple[Floats, Top]:
    """Values falling, with frame and dipole of the top put into the same order: near a symmetric top the names change."""
    order = np.argsort(-values, kind="stable")
    if turned.kind != "asymmetric" or (order == np.arange(3)).all():
        return values, turned
    assert turned.frame is not None  # a top of a geometry has one
    axes = turned.frame.axes[order]
    axes = axes * np.array([[1.0], [1.0], [np.sign(np.linalg.det(axes))]])
    dipole = turned.dipole_abc_debye
    moved = None if dipole is None else axes @ turned.frame.axes.T @ np.array(dipole)
    frame = PrincipalFrame(turned.frame.moments[order], axes, turned.frame.centre)
    note = "the scaled constants have another order than the calculated ones: the axes are named by the scaled ones"
    told = replace(turned, frame=frame, notes=(*turned.notes, note))
    return values[order], told if moved is None else replace(told, dipole_abc_debye=(moved[0], moved[1], moved[2]))


def _of_kind(values: Floats, kind: str) -> Constants:
    a, b, c = (float(value) for value in values)
    return {
        "linear": lambda: Constants(B=(b + c) / 2, kind=kind),
        "spherical": lambda: Constants(B=(a + b + c) / 3, kind=kind),
        "prolate": lambda: Constants(A=a, B=(b + c) / 2, kind=kind),
        "oblate": lambda: Constants(B=(a + b) / 2, C=c, kind=kind),
        "asymmetric": lambda: Constants(A=a, B=b, C=c, kind=kind),
    }[kind]()


def _with_distortion(parent: Top, constants: Constants, axes: str, angle: float) -> tuple[Constants, tuple[str, ...]]:
    """The parent's distortion constants by powers of the rotational ones, or none where the axes are others.

    c of c J^2p Jz^2q J±^2n goes as ρ^(p+n) ρz^q with the ratios ρ of Bx + By and ρz of Bz. For one bond that is exact: D
    goes as B², H as B³ (J. L. Dunham, Phys. Rev. 41, 721 (1932), from D = 4 B³/ω² with ω² as B). A turn of the axes mixes
    the constants, and nothing of that is in them: from H2O to HDO ΔJK changes its sign.
    """
    old = parent.constants
    names = [name for name in old.values if name not in ("A", "B", "C")]
    if not names:
        return constants, ()
    if constants.kind != old.kind or axes != "abc" or angle > TURNED_TOO_FAR_DEGREES:
        return constants, (_why_rigid(old, constants, axes, angle),)
    if constants.kind == "asymmetric":
        constants = constants.replace(representation=old.representation)
    across, along = (new / before for new, before in zip(_of_z(constants), _of_z(old), strict=True))
    scaled = {name: old[name] * across ** (p + n) * along**q for name, (p, q, n) in _powers(old, names).items()}
    changes = {**scaled, "reduction": old.reduction} if old.reduction else scaled
    note = "distortion constants of the parent scaled as powers of the rotational constants (D as B², H as B³): a guess"
    return constants.replace(**changes), (note,)


def _powers(constants: Constants, names: list[str]) -> dict[str, tuple[int, int, int]]:
    """(p, q, n) of the one operator that each distortion constant stands for."""
    table = distortion_terms(constants.kind, constants.reduction)
    spelled = {name: powers_of_spelled(name) for name in names}
    return {name: own if (own := spelled[name]) else next(iter(table[name])) for name in names}


def _why_rigid(old: Constants, constants: Constants, axes: str, angle: float) -> str:
    if constants.kind != old.kind:
        why = f"the kind of top is {constants.kind}, the parent's {old.kind}"
    elif axes != "abc":
        why = f"a, b, c are nearest to the parent's {', '.join(axes)}"
    else:
        why = f"the axes turned by {angle:.1f}°"
    return (
        f"no distortion constants: those of the parent do not serve, {why}; a force field gives them (rotor.distortion)"
    )


def _of_z(constants: Constants) -> tuple[float, float]:
    """½(Bx + By) and Bz, 1 for the z of a linear or spherical top, whose terms have no Jz."""
    a, b, c = constants.rigid
    if constants.kind in ("linear", "spherical"):
        return b, 1.0
    if constants.kind in ("prolate", "oblate"):
        return b, a if constants.kind == "prolate" else c
    z = {"I": 0, "II": 1, "III": 2}[str(constants.representation).rstrip("rl")]
    return (a + b + c - (a, b, c)[z]) / 2, (a, b, c)[z]


def _doubts(parent: Top, overlap: float, angle: float) -> list[str]:
    told = []
    if overlap < _DOUBTFUL_OVERLAP:
        told.append(f"the axes turned by {angle:.0f}°: which of them is the parent's which is doubtful")
    dipole = parent.dipole_abc_debye
    if dipole is not None and sum(abs(mu) > 1e-3 for mu in dipole) > 1 and angle > 0.1:
        told.append("the dipole was turned with the signs that the parent's components are given with; check them")
    return told
