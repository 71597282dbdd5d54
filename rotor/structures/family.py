"""A molecule with the measured moments of its isotopologues; their axes are matched to those of the parent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from rotor.arrays import Floats
from rotor.molecules.molecule import Molecule
from rotor.structures.coordinates import symmetric_geometry
from rotor.tops.isotopes.isotopic_scaling import matched_axes
from rotor.tops.top import Top
from rotor.units import ROTATIONAL_MHZ_U_ANGSTROM2

AXES = "abc"
CONSTANTS = "ABC"
# ratios of measured constants to those of the geometry beyond which a mistake is assumed
_FAR_OF_PARENT, _FAR = (
    3.0,
    1.5,
)
PLANAR_WITHIN_ANGSTROM = 1e-4  # distance below which an atom lies in the plane


@dataclass(frozen=True)
class Species:
    """An isotopologue with its measured constants.

    name : such as "16O13C32S". molecule : the geometry with its isotopes. constants_mhz, errors_mhz : the known ones of A, B, C and
    their standard errors, MHz (0 if unknown). corrections_mhz : B_e - B_0 for each corrected constant. axes : the parent's axes
    nearest to a, b, c. source : origin of the data
    """

    name: str
    molecule: Molecule
    constants_mhz: Mapping[str, float]
    errors_mhz: Mapping[str, float] = field(default_factory=dict)
    corrections_mhz: Mapping[str, float] = field(default_factory=dict)
    axes: str = AXES
    source: str = ""

    @property
    def moments(self) -> Floats:
        """I_a, I_b, I_c (3,) in u Å²; nan for an unknown constant."""
        return _moments(self.constants_mhz)

    @property
    def moment_errors(self) -> Floats:
        """Standard errors (3,) of the moments in u Å², I σ(B)/B."""
        parts = [self.errors_mhz.get(name, 0.0) / self.constants_mhz.get(name, 1.0) for name in CONSTANTS]
        return np.asarray(np.nan_to_num(self.moments) * np.array(parts))

    @property
    def equilibrium_moments(self) -> Floats:
        """Moments from B_0 + correction, nan without a correction."""
        both = {
            name: value + self.corrections_mhz[name]
            for name, value in self.constants_mhz.items()
            if name in self.corrections_mhz
        }
        return _moments(both)


def _moments(constants: Mapping[str, float]) -> Floats:
    values = np.array([constants.get(name, np.nan) for name in CONSTANTS], dtype=float)
    return np.asarray(ROTATIONAL_MHZ_U_ANGSTROM2 / values)


@dataclass(frozen=True)
class Family:
    """A parent, `species[0]`, and its isotopologues, all with one geometry as the start.

    top : the rigid top of the parent's geometry
    """

    name: str
    species: tuple[Species, ...]
    top: Top

    @property
    def parent(self) -> Species:
        """The species to which substitutions refer."""
        return self.species[0]

    @property
    def molecule(self) -> Molecule:
        """The start geometry with the isotopes of the parent."""
        return self.parent.molecule

    @property
    def linear(self) -> bool:
        """Whether the start geometry is linear."""
        return self.top.kind == "linear"

    @property
    def planar(self) -> bool:
        """Whether all atoms lie in a plane, but not on a line."""
        c = self.frame_positions(self.parent)[:, 2]
        return not self.linear and bool(np.abs(c).max() < PLANAR_WITHIN_ANGSTROM)

    def frame_positions(self, species: Species) -> Floats:
        """Positions (n, 3) of the start geometry in the principal axes of a species."""
        frame = Top.from_molecule(species.molecule).frame
        assert frame is not None  # a top made from a molecule always has a frame
        return np.asarray((species.molecule.positions_angstrom - frame.centre) @ frame.axes.T)


def family(
    molecule: Molecule,
    measured: Sequence[tuple[str, Mapping[int | str, str] | str, Mapping[str, float], Mapping[str, float]]],
    *,
    corrections_mhz: Sequence[Mapping[str, float]] = (),
    sources: Sequence[str] = (),
    name: str = "",
) -> Family:
    """A family from a start geometry and the constants of isotopologues.

    Parameters
    ----------
    molecule : Molecule
        The parent with a start geometry that is good enough to determine axes and signs; it is symmetrised first.
    measured : sequence of (name, isotopes, constants_mhz, errors_mhz)
        Isotopes in the form of `Molecule.with_isotopes`, "" for the parent, which comes first.
    corrections_mhz, sources : sequences, optional
        One for each species, see `Species`.
    name : str

    Returns
    -------
    Family

    Raises
    ------
    ValueError
        No species; a first species that is not the parent; a repeated isotopologue; constants other than A, B, C, not above 0, far
        from those of the geometry, or not defined for this kind of top; errors or corrections without their constant.

    Examples
    --------
    >>> rod = Molecule(("C", "O"), [[0, 0, 0], [0, 0, 1.128]])
    >>> two = family(rod, [("CO", "", {"B": 57635.968}, {}), ("13CO", "1=13C", {"B": 55101.011}, {})])
    >>> two.linear, two.species[1].moments.round(4).tolist()
    (True, [nan, 9.1719, nan])
    """
    if not measured:
        raise ValueError("a family without isotopologues: the constants of the parent at least are needed")
    molecule = symmetric_geometry(molecule)
    top = Top.from_molecule(molecule)
    species: list[Species] = []
    for i, (label, isotopes, constants, errors) in enumerate(measured):
        changed = molecule.with_isotopes(isotopes) if isotopes else molecule
        corrections = corrections_mhz[i] if corrections_mhz else {}
        label = label or changed.formula
        _refuse_constants(label, top.kind, constants, errors, corrections)
        axes, _ = matched_axes(top, Top.from_molecule(changed))
        source = sources[i] if sources else ""
        species.append(Species(label, changed, dict(constants), dict(errors), dict(corrections), axes, source))
    _refuse_family(species, molecule)
    _refuse_far(species)
    return Family(name or molecule.name or molecule.formula, tuple(species), top)


def _refuse_constants(
    name: str, kind: str, constants: Mapping[str, float], errors: Mapping[str, float], corrections: Mapping[str, float]
) -> None:
    strays = [key for key in constants if key not in CONSTANTS]
    if strays or not constants:
        raise ValueError(f"{name}: {', '.join(strays) or 'no constants'}; expected at least one of A, B, C")
    for key, value in constants.items():
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name}: {key} = {value!r} MHz; a rotational constant is above 0")
    for what, table in (("error", errors), ("correction", corrections)):
        lost = [key for key in table if key not in constants]
        if lost:
            raise ValueError(f"{name}: {what} of {', '.join(lost)}, but no such constant is given")
    if kind == "linear" and "B" not in constants:
        raise ValueError(f"{name}: a linear molecule has B; {', '.join(constants)} given")


def _refuse_far(family_species: Sequence[Species]) -> None:
    """Raise ValueError for constants far from those of the start geometry scaled to the parent: wrong unit or digits."""
    parent = _measured_to_rigid(family_species[0])
    for species in family_species:
        ratios = _measured_to_rigid(species)
        for name, ratio in ratios.items():
            is_scaled = species is not family_species[0] and name in parent
            expected, most = (parent[name], _FAR) if is_scaled else (1.0, _FAR_OF_PARENT)
            if not 1 / most < ratio / expected < most:
                rigid = species.constants_mhz[name] / ratio * expected
                raise ValueError(
                    f"{species.name}: {name} = {species.constants_mhz[name]:g} MHz, where the geometry"
                    f"{' and the parent give' if is_scaled else ' gives'} about {rigid:.6g}; check digits, unit and isotopes"
                )


def _measured_to_rigid(species: Species) -> dict[str, float]:
    """Ratios of measured constants to those of the start geometry."""
    rigid = Top.from_molecule(species.molecule).constants.values
    return {name: value / rigid[name] for name, value in species.constants_mhz.items() if rigid.get(name)}


def _refuse_family(family_species: Sequence[Species], molecule: Molecule) -> None:
    if family_species[0].molecule.mass_numbers != molecule.mass_numbers:
        raise ValueError(
            f"{family_species[0].name}: the first isotopologue is the parent; it needs the isotopes of the geometry"
        )
    seen: dict[tuple[int, ...], str] = {}
    for species in family_species:
        numbers = species.molecule.mass_numbers
        if numbers in seen:
            raise ValueError(f"{species.name} and {seen[numbers]} have the same isotopes; leave one out")
        seen[numbers] = species.name
