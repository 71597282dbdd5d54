"""The isotopologues of a molecule: abundance, constants, axes, dipole and spin weights of each.

In the Born-Oppenheimer approximation, isotopes change neither the geometry nor the charges; their masses shift the centre of mass
and rotate the principal axes. `rotor.tops.isotopes.isotopic_scaling` scales measured constants.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.molecules.molecule import Molecule
from rotor.molecules.nuclei import isotope, natural_isotopes
from rotor.molecules.symmetry.point_group import Symmetry, molecule_symmetry
from rotor.tops.allowed import invariant_vector
from rotor.tops.isotopes.isotopic_scaling import carried_over, matched_axes, turned_degrees
from rotor.tops.isotopes.isotopic_spins import carried_spins
from rotor.tops.top import Top, without_internal_rotation

Changes = Mapping[int | str, str] | str

MOST_ARRANGEMENTS = 20_000  # placements of isotopes on the atoms, equivalent ones counted separately
_DIPOLE_ERROR = 0.02  # of the whole: what symmetry of the bare geometry forbids below it is the error of the components
_DOUBTFUL_OVERLAP = 0.6  # cos² below which it is doubtful which axis is which


@dataclass(frozen=True)
class Isotopologue:
    """An isotopologue of a parent molecule.

    top : constants, kind, dipole along its principal axes, spin weights, and the masses in `top.molecule`
    substituted : isotopes other than the most abundant ones, by atom number from 1, such as `{2: "2H"}`
    arrangements : number of equivalent placements of the isotopes
    abundance : fraction of the natural molecules, summed over these placements
    axes : the parent's axes nearest to a, b and c: `"abc"`, or `"bac"` if a and b are exchanged
    turned_degrees : angle between matched axes of parent and isotopologue; degenerate axes of a symmetric top do not count
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
        """The formula with the substituted atoms, if any: `"H[2H]O (2=2H)"`."""
        sites = ",".join(f"{atom}={name}" for atom, name in self.substituted.items())
        return f"{self.formula} ({sites})" if sites else self.formula


def isotopologues(parent: Top, *, min_abundance: float = 1e-4) -> tuple[Isotopologue, ...]:
    """Isotopologues of a molecule with a natural abundance of at least `min_abundance`, the most abundant first.

    Placements that a rotation or reflection of the geometry exchanges are one isotopologue.
    An element without natural isotopes keeps the isotope of the parent.

    Parameters
    ----------
    parent : Top
        A top with a geometry, of any isotopes.
    min_abundance : float
        Fraction of the natural molecules, above 0.

    Returns
    -------
    tuple of Isotopologue

    Raises
    ------
    ValueError
        For a top without geometry, and for a limit that no placement or too many placements reach.

    Examples
    --------
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
        raise ValueError(f"min_abundance: least abundance {min_abundance:g}: expected a fraction above 0 and up to 1")
    ancestor = _Ancestor(parent)
    molecule, permutations = ancestor.molecule, ancestor.permutations
    placements: dict[tuple[int, ...], tuple[float, int]] = {}
    # equivalent placements add up, at most as many as there are permutations
    for numbers, abundance in _placements(molecule, min_abundance / len(permutations)):
        alike = {tuple(image) for image in _images(numbers, permutations)}
        placements[max(alike, key=lambda image: _earliest(molecule, image))] = (abundance * len(alike), len(alike))
    common = {numbers: placement for numbers, placement in placements.items() if placement[0] >= min_abundance}
    if not common:
        raise ValueError(
            f"no isotopologue of {molecule.formula} has an abundance of {min_abundance:g}; lower the limit"
        )
    ordered = sorted(common, key=lambda numbers: -common[numbers][0])
    return tuple(ancestor.isotopologue(numbers) for numbers in ordered)


def isotopologue(parent: Top, changes: Changes) -> Isotopologue:
    """The isotopologue of a top with a geometry after substitutions such as `"2=2H"` or `{"O": "18O"}`.

    Raises ValueError for a top without geometry, and for substitutions that `Molecule.with_isotopes` refuses.

    >>> from rotor.molecules.molecule import Molecule
    >>> water = Molecule(("O", "H", "H"), [[0, 0, 0.1173], [0, 0.7572, -0.4692], [0, -0.7572, -0.4692]],
    ...                  dipole_debye=[0, 0, -1.8546])
    >>> hdo = isotopologue(Top.from_molecule(water), "2=2H")
    >>> hdo.axes, round(hdo.turned_degrees, 1), [round(abs(mu), 2) for mu in hdo.top.dipole_abc_debye]
    ('abc', 21.1, [0.67, 1.73, 0.0])
    """
    return _Ancestor(parent).isotopologue(_geometry(parent).with_isotopes(changes).mass_numbers)


def single_substitutions(parent: Top, element: str, name: str) -> tuple[Isotopologue, ...]:
    """Isotopologues with a single substituted atom of an element, one for each set of equivalent atoms.

    Substitution structures use this set. Raises ValueError for an element that the molecule lacks.

    >>> from rotor.molecules.molecule import Molecule
    >>> hcn = Molecule(("H", "C", "N"), [[0, 0, -1.0655], [0, 0, 0], [0, 0, 1.1532]])
    >>> [one.label for one in single_substitutions(Top.from_molecule(hcn), "C", "13C")]
    ['[13C]HN (2=13C)']
    """
    ancestor = _Ancestor(parent)
    molecule, permutations = ancestor.molecule, ancestor.permutations
    atoms = [atom for atom, symbol in enumerate(molecule.symbols) if symbol == element]
    if not atoms:
        raise ValueError(f"element {element!r} to substitute is not in {molecule.formula}")
    # the first atom of each set of equivalent ones
    first = sorted({min(int(p[atom]) for p in permutations) for atom in atoms})
    return tuple(ancestor.isotopologue(molecule.with_isotopes({atom + 1: name}).mass_numbers) for atom in first)


def _geometry(parent: Top) -> Molecule:
    if parent.molecule is None:
        raise ValueError(f"no isotope of {parent.name or 'constants alone'} can be changed: there is no geometry")
    return parent.molecule


# Enumeration of the isotopologues


def _bare_symmetry(molecule: Molecule) -> Symmetry:
    """The symmetry of the geometry, isotopes ignored."""
    return molecule_symmetry(replace(molecule, mass_numbers=_abundant(molecule)))


def _permutations(symmetry: Symmetry) -> list[NDArray[np.int64]]:
    """Permutations of the atoms under the operations."""
    distinct = {tuple(operation.permutation.tolist()) for operation in (*symmetry.rotations, *symmetry.improper)}
    return [np.array(permutation) for permutation in sorted(distinct)]


def _without_masses(dipole: Floats, symmetry: Symmetry) -> Floats:
    """The part of a dipole that the geometry allows without regard to isotopes; measured components have errors beyond it."""
    part = invariant_vector(dipole, symmetry)
    return part if np.linalg.norm(dipole - part) < _DIPOLE_ERROR * np.linalg.norm(dipole) else dipole


def _abundant(molecule: Molecule) -> tuple[int, ...]:
    """The most abundant isotope of every atom; elements without natural isotopes keep the isotope of the molecule."""
    pairs = zip(molecule.symbols, molecule.mass_numbers, strict=True)
    return tuple(isotope(s).mass_number if natural_isotopes(s) else number for s, number in pairs)


def _placements(molecule: Molecule, least: float) -> Iterator[tuple[tuple[int, ...], float]]:
    """Mass numbers and abundance of each placement of at least this abundance.

    Starting from the most abundant placement, atoms are substituted in turn. Each substitution lowers the abundance, so that a
    placement below the limit is dropped together with all further substitutions of it.
    """
    fractions = [{nuclide.mass_number: nuclide.abundance for nuclide in natural_isotopes(s)} for s in molecule.symbols]
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
                f"more than {MOST_ARRANGEMENTS} placements of isotopes on {molecule.formula}: raise the lowest abundance"
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
    """Sort key: largest for the placement whose substituted atoms have the lowest numbers."""
    return [abs(number - usual) for number, usual in zip(numbers, _abundant(molecule), strict=True)]


# Properties of each isotopologue


class _Ancestor:
    """A parent, its rigid top and the permutations of its geometry, computed once for all its isotopologues."""

    def __init__(self, parent: Top) -> None:
        molecule, dipole = _geometry(without_internal_rotation(parent, "isotopologues")), parent.dipole_abc_debye
        symmetry = _bare_symmetry(molecule)
        self.permutations = _permutations(symmetry)
        if dipole is not None and parent.frame is not None:
            vector = _without_masses(np.array(dipole) @ parent.frame.axes, symmetry)
            molecule = replace(molecule, dipole_debye=vector, dipole_source=parent.dipole_source)
        if parent.polarizability_abc_angstrom3 is not None and parent.frame is not None:
            axes = parent.frame.axes
            tensor = axes.T @ np.array(parent.polarizability_abc_angstrom3) @ axes
            source = parent.polarizability_source
            molecule = replace(molecule, polarizability_angstrom3=tensor, polarizability_source=source)
        self.parent, self.molecule, self.rigid = parent, molecule, Top.from_molecule(molecule)

    def isotopologue(self, numbers: tuple[int, ...]) -> Isotopologue:
        """The isotopologue with these mass numbers."""
        symbols, usual = self.molecule.symbols, _abundant(self.molecule)
        names = [f"{number}{symbol}" for number, symbol in zip(numbers, symbols, strict=True)]
        turned = Top.from_molecule(self.molecule.with_isotopes(dict(enumerate(names, start=1))))
        axes, overlap = matched_axes(self.rigid, turned)
        angle = turned_degrees(self.rigid, turned, axes)
        top = carried_over(self.parent, self.rigid, turned, axes, angle)
        spins, said = carried_spins(self.parent, top, angle)
        notes = tuple(dict.fromkeys((*top.notes, *_doubts(self.parent, overlap, angle), *said)))
        arrangements = len({tuple(image) for image in _images(numbers, self.permutations)})
        return Isotopologue(
            top=replace(top, name=_name(self.parent, self.molecule, turned), notes=notes, spin_constants=spins),
            substituted={i + 1: name for i, name in enumerate(names) if numbers[i] != usual[i]},
            arrangements=arrangements,
            abundance=arrangements * _abundance(symbols, numbers),
            axes=axes,
            turned_degrees=angle,
        )


def _name(parent: Top, molecule: Molecule, turned: Top) -> str:
    formula = _geometry(turned).formula
    if parent.name and formula == molecule.formula:
        return parent.name
    return formula if parent.name in ("", molecule.formula) else f"{parent.name} ({formula})"


def _abundance(symbols: tuple[str, ...], numbers: tuple[int, ...]) -> float:
    """Natural abundance of a placement; an isotope of an element without natural isotopes counts as 1."""
    pairs = zip(symbols, numbers, strict=True)
    return math.prod(isotope(s, number).abundance if natural_isotopes(s) else 1.0 for s, number in pairs)


def _doubts(parent: Top, overlap: float, angle: float) -> list[str]:
    notes = []
    if overlap < _DOUBTFUL_OVERLAP:
        notes.append(f"the axes are turned by {angle:.0f}°: their assignment to the parent's axes is doubtful")
    dipole = parent.dipole_abc_debye
    # the sign of a single component has no effect
    if dipole is not None and sum(abs(mu) > 1e-3 for mu in dipole) > 1 and angle > 0.1:
        notes.append("the dipole along the new axes depends on the signs of the parent's components; check them")
    return notes
