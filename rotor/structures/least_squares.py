"""Structures fitted to the moments of all isotopologues: r_0, r_m⁽¹⁾, r_m⁽²⁾, and r_e from corrected constants.

The moments I_g (g = a, b, c of each species) of one geometry with the masses of each isotopologue are fitted to the measured
ones. The vibrational contribution is neglected in r_0, subtracted from the constants in a semi-experimental r_e, and fitted in r_m:

    r_m⁽¹⁾   I_g⁰ = I_g + c_g √I_g
    r_m⁽²⁾   I_g⁰ = I_g + c_g √I_g + d_g (m₁ m₂ ... m_n / M)^(1/(2n-2))

J. K. G. Watson, A. Roytburg and W. Ulrich, J. Mol. Spectrosc. 196, 102 (1999). c and d refer to the parent's axes, which are matched
to those of the isotopologue by overlap. Axis rotation between isotopologues in these terms (r_m⁽¹ʳ⁾) and the Laurie correction of
bonds to hydrogen (r_m⁽¹ᴸ⁾) are not fitted. With positions r_i in the principal axes the gradients are exact,

    ∂I_a/∂r_i = 2 m_i (r_i - a_i â).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotor.arrays import Floats
from rotor.molecules.molecule import Molecule
from rotor.statistics.least_squares import Minimum, minimise
from rotor.statistics.regression import Combination, regression
from rotor.structures.coordinates import Named, bonds_and_angles, moved_to, symmetric_displacements
from rotor.structures.family import AXES, Family, Species
from rotor.structures.substitution import Value
from rotor.tops.top import Top

METHODS = ("r0", "rm1", "rm2", "re")
WEIGHTS = ("equal", "errors")
STUDENT = {
    1: 1.84,
    2: 1.32,
    3: 1.20,
}  # Student's |t| at 68.27 %, by degrees of freedom
_FAR = 0.5  # Å: largest displacement of an atom from the start


class TooFewMomentsError(ValueError):
    """A fit with more unknowns than moments."""


@dataclass(frozen=True)
class Moment:
    """A moment of a species: species and axis, observed value with error, calculated value; u Å²."""

    species: str
    axis: str
    observed: float
    error: float
    calculated: float

    @property
    def difference(self) -> float:
        """Observed minus calculated, u Å²."""
        return self.observed - self.calculated


@dataclass(frozen=True)
class FittedStructure:
    """A structure fitted to all moments.

    method : "r0", "rm1", "rm2" or "re". molecule : the geometry in the principal axes of the parent. values : bonds and angles
    with errors, fitted and derived. vibrational : c and d of r_m with their errors, by name (u½ Å and u½ Å²).
    moments : observed and calculated. rms_u_angstrom2 : of the differences. degrees_of_freedom : moments minus parameters.
    condition : of the column-scaled Jacobian. undetermined : combinations that the moments do not determine. minimum : how the search
    ended. With equal weights, errors are scaled by the rms of the fit, because the residuals are due to vibration.
    """

    method: str
    molecule: Molecule
    values: tuple[Value, ...]
    vibrational: tuple[Value, ...]
    moments: tuple[Moment, ...]
    rms_u_angstrom2: float
    degrees_of_freedom: int
    condition: float
    undetermined: tuple[Combination, ...]
    minimum: Minimum
    notes: tuple[str, ...] = ()


def fit_structure(
    family: Family,
    method: str = "r0",
    *,
    coordinates: Sequence[Named] = (),
    held: Sequence[Named] = (),
    weights: str = "equal",
    leave_out: Sequence[str] = (),
) -> FittedStructure:
    """Fit a structure to the moments of a family.

    Parameters
    ----------
    family : Family
    method : "r0", "rm1", "rm2" or "re"
        See above; "re" uses only constants with a correction.
    coordinates : sequence of Named
        Coordinates to fit. Default: all totally symmetric displacements.
    held : sequence of Named
        Coordinates fixed at the values of the start geometry.
    weights : "equal" or "errors"
        Equal weights, or 1/σ² of the measured moments. The vibrational contributions far exceed the measurement errors and are
        of similar size for all moments, so "equal" suits all methods except a good r_e.
    leave_out : sequence of "a", "b" or "c"
        Axes whose moments are not used; for a planar molecule one is usually left out, since its three moments are dependent.

    Returns
    -------
    FittedStructure

    Raises
    ------
    ValueError
        An unknown method or weight, no moments, more parameters than moments, weights by errors for constants without errors.

    Notes
    -----
    Symmetry is preserved exactly. Coordinates that are neither fitted nor held move as little as possible.
    """
    _refuse_settings(method, weights, coordinates, held)
    problem = _Problem.from_family(family, method, coordinates, held, weights, leave_out)
    count = problem.count
    if len(problem.observed) < count:
        raise TooFewMomentsError(
            f"{family.name}: {count} unknowns for {len(problem.observed)} moments; "
            "fit fewer coordinates and hold the others, or add isotopologues"
        )
    minimum = minimise(problem.evaluate, np.zeros(count), tolerance=1e-9, most_iterations=200)
    return _result(problem, minimum)


def _refuse_settings(method: str, weights: str, coordinates: Sequence[Named], held: Sequence[Named]) -> None:
    if method not in METHODS:
        raise ValueError(f"method {method!r}: one of {', '.join(METHODS)} is needed")
    if weights not in WEIGHTS:
        raise ValueError(f"weights {weights!r}: 'equal' or 'errors' is needed")
    once: dict[object, str] = {}
    for each in coordinates:
        for image in each.alike:
            if once.setdefault(image, each.name) != each.name:
                raise ValueError(
                    f"{once[image]} and {each.name} are the same coordinate, or equal by symmetry; leave one of them out"
                )
    if held and not coordinates:
        raise ValueError(f"{held[0].name} is held, but no coordinate is named that is fitted; name those, too")
    both = {atoms for each in coordinates for atoms in each.alike} & {atoms for each in held for atoms in each.alike}
    if both:
        raise ValueError(f"atoms {sorted(both)[0]}: the same coordinate is both fitted and held")


@dataclass(frozen=True)
class _Problem:
    """The model of the search. Parameters: changes of the coordinates (or of u), then c, then d."""

    family: Family
    method: str
    coordinates: tuple[Named, ...]
    held: tuple[Named, ...]
    space: Floats
    rows: tuple[tuple[int, int], ...]  # species, axis
    observed: Floats
    errors: Floats
    sigma: Floats
    terms: tuple[str, ...]  # c_a, ... d_a, ...

    @classmethod
    def from_family(
        cls,
        family: Family,
        method: str,
        coordinates: Sequence[Named],
        held: Sequence[Named],
        weights: str,
        leave_out: Sequence[str],
    ) -> _Problem:
        """The equations of a family for a method, with weights by errors or equal weights."""
        rows, observed, errors = _observations(family, method, leave_out)
        if weights == "errors" and not (errors > 0).all():
            first = family.species[rows[int(np.argmin(errors))][0]].name
            raise ValueError(
                f"weights by errors: {first} has a constant without an error; give the error, or use equal weights"
            )
        axes = sorted({family.species[s].axes[g] for s, g in rows})
        if family.top.kind in ("linear", "prolate", "oblate"):
            axes = sorted({_equal_axis(family, axis) for axis in axes})
        letters = {"rm1": "c", "rm2": "cd"}.get(method, "")
        return cls(
            family,
            method,
            tuple(coordinates),
            tuple(held),
            symmetric_displacements(family.molecule),
            tuple(rows),
            observed,
            errors,
            errors if weights == "errors" else np.ones(len(rows)),
            tuple(f"{letter}_{axis}" for letter in letters for axis in axes),
        )

    @property
    def start(self) -> Floats:
        return self.family.molecule.positions_angstrom

    @property
    def shape_count(self) -> int:
        """Number of geometric parameters."""
        return len(self.coordinates) or self.space.shape[1]

    @property
    def count(self) -> int:
        return self.shape_count + len(self.terms)

    def positions(self, p: Floats) -> Floats:
        """The geometry (n, 3) for the parameters; ValueError if atoms move too far or the coordinates cannot be reached."""
        change = p[: self.shape_count]
        if not self.coordinates:
            x = self.start + (self.space @ change).reshape(self.start.shape)
        else:
            coordinates = (*self.coordinates, *self.held)
            targets = np.array([coordinate.value(self.start) for coordinate in coordinates])
            targets[: len(change)] += change * np.array([coordinate.factor for coordinate in self.coordinates])
            x = moved_to(self.start, self.space, coordinates, targets)
        if np.abs(x - self.start).max() > 2 * _FAR:
            raise ValueError("an atom would move by more than 1 Å from the start geometry; give a better one")
        return x

    def directions(self, x: Floats) -> Floats:
        """∂x/∂p (3n, shape_count)."""
        if not self.coordinates:
            return self.space
        b = np.array([coordinate.gradient(x) for coordinate in (*self.coordinates, *self.held)]) @ self.space
        return np.asarray(self.space @ np.linalg.pinv(b, rcond=1e-9)[:, : len(self.coordinates)])

    def model(self, p: Floats) -> tuple[Floats, Floats]:
        """Moments (m,) and their derivatives (m, count)."""
        x = self.positions(p)
        directions = self.directions(x)
        terms = dict(zip(self.terms, p[self.shape_count :], strict=True))
        moments = np.empty(len(self.rows))
        jacobian = np.zeros((len(self.rows), self.count))
        frames = {s: _principal(self.family.species[s], x) for s in {s for s, _ in self.rows}}
        for row, (s, g) in enumerate(self.rows):
            species = self.family.species[s]
            moment, gradient = _moment(self.family, species, frames[s], g)
            jacobian[row, : self.shape_count] = gradient.ravel() @ directions
            axis = species.axes[g] if f"c_{species.axes[g]}" in terms else _equal_axis(self.family, species.axes[g])
            moments[row] = self._with_vibration(species, axis, moment, terms, jacobian[row])
        return moments, jacobian

    def _with_vibration(
        self, species: Species, axis: str, moment: float, terms: dict[str, float], row: Floats
    ) -> float:
        """The moment with the terms of c and d; updates the row of derivatives in place."""
        total, slope = moment, 1.0
        if f"c_{axis}" in terms:
            c, root = terms[f"c_{axis}"], float(np.sqrt(moment))
            total, slope = total + c * root, slope + c / (2 * root)
            row[self.shape_count + self.terms.index(f"c_{axis}")] = root
        row[: self.shape_count] *= slope
        if f"d_{axis}" in terms:
            factor = _mass_factor(species.molecule)
            total += terms[f"d_{axis}"] * factor
            row[self.shape_count + self.terms.index(f"d_{axis}")] = factor
        return total

    def evaluate(self, p: Floats) -> tuple[Floats, Floats]:
        moments, jacobian = self.model(p)
        return (self.observed - moments) / self.sigma, jacobian / self.sigma[:, None]


def _observations(
    family: Family, method: str, leave_out: Sequence[str]
) -> tuple[list[tuple[int, int]], Floats, Floats]:
    """(species, axis) of the moments in the fit, the moments, and their errors."""
    strays = [axis for axis in leave_out if axis not in AXES]
    if strays:
        raise ValueError(f"leave_out: axes {', '.join(strays)}: a, b and c there are")
    twice = [axis for axis in AXES if list(leave_out).count(axis) > 1]
    if twice:
        raise ValueError(f"leave_out: axis {twice[0]} is named twice; once is enough")
    idle = [
        axis
        for axis in leave_out
        if not any(np.isfinite(species.moments[AXES.index(axis)]) for species in family.species)
    ]
    if idle:
        raise ValueError(f"leave_out: axis {idle[0]}: no isotopologue has a moment about it")
    rows, observed, errors = [], list[float](), list[float]()
    for s, species in enumerate(family.species):
        moments = species.equilibrium_moments if method == "re" else species.moments
        for g in range(3):
            if np.isfinite(moments[g]) and species.axes[g] not in leave_out and not _repeated(family, species, g):
                rows.append((s, g))
                observed.append(float(moments[g]))
                errors.append(float(species.moment_errors[g]))
    if not rows:
        why = "no constant has a correction" if method == "re" else "every moment is left out"
        raise ValueError(f"{family.name}: nothing to fit {method} to: {why}")
    return rows, np.array(observed), np.array(errors)


def _repeated(family: Family, species: Species, g: int) -> bool:
    """Whether a moment is redundant for its species: I_c of a linear or prolate top with I_b."""
    kind = Top.from_molecule(species.molecule).kind
    if kind == "linear":
        return AXES[g] != "b"
    constants = species.constants_mhz
    return (kind == "prolate" and g == 2 and "B" in constants) or (kind == "oblate" and g == 0 and "B" in constants)


def _equal_axis(family: Family, axis: str) -> str:
    """The axis whose c and d apply to this axis: the first of two with equal moments of the parent."""
    same = {"linear": "bbb", "prolate": "abb", "oblate": "bbc"}.get(family.top.kind, AXES)
    return same[AXES.index(axis)]


def _principal(species: Species, x: Floats) -> tuple[Floats, Floats, Floats]:
    """Positions (n, 3) in the principal axes, the axes as rows, and masses."""
    top = Top.from_molecule(Molecule(species.molecule.symbols, x, species.molecule.mass_numbers))
    assert top.frame is not None  # a top made from a molecule always has a frame
    return (x - top.frame.centre) @ top.frame.axes.T, top.frame.axes, species.molecule.masses_u


def _moment(family: Family, species: Species, frame: tuple[Floats, Floats, Floats], g: int) -> tuple[float, Floats]:
    """I_g and its gradient (n, 3) in the frame of the input; the mean for equal moments."""
    places, axes, masses = frame
    kind = Top.from_molecule(species.molecule).kind
    across = {"linear": (1, 2), "prolate": (1, 2), "oblate": (0, 1)}.get(kind, ())
    chosen = across if g in across else (g,)
    weight = np.zeros(3)
    for axis in chosen:
        weight += (1.0 - np.eye(3)[axis]) / len(chosen)  # I_a = Σ m (b² + c²)
    moment = float(masses @ (places**2 @ weight))
    return moment, 2 * (masses[:, None] * places * weight) @ axes


def _mass_factor(molecule: Molecule) -> float:
    """(m₁ m₂ ... m_n / M)^(1/(2n-2))."""
    masses = molecule.masses_u
    return float((np.prod(masses) / masses.sum()) ** (1 / (2 * len(masses) - 2)))


def _result(problem: _Problem, minimum: Minimum) -> FittedStructure:
    family, p = problem.family, minimum.parameters
    x = problem.positions(p)
    calculated, _ = problem.model(p)
    free = len(problem.observed) - problem.count
    names = [*(coordinate.name for coordinate in problem.coordinates or ())] or [
        f"u{i + 1}" for i in range(problem.shape_count)
    ]
    linear = regression(minimum.jacobian, [*names, *problem.terms])
    scale = float(np.sqrt(minimum.residuals @ minimum.residuals / free)) if free > 0 else np.nan
    covariance = linear.covariance * (scale**2 if (problem.sigma == 1).all() else 1.0)

    vibrational = [
        Value(
            name,
            (),
            float(p[problem.shape_count + i]),
            float(np.sqrt(covariance.diagonal()[problem.shape_count + i])),
            "",
        )
        for i, name in enumerate(problem.terms)
    ]
    moments = tuple(
        Moment(family.species[s].name, AXES[g], o, e, c)
        for (s, g), o, e, c in zip(
            problem.rows, problem.observed.tolist(), problem.errors.tolist(), calculated.tolist(), strict=True
        )
    )
    differences = problem.observed - calculated
    return FittedStructure(
        method=problem.method,
        molecule=_in_parent_frame(family, x),
        values=_values(problem, x, covariance),
        vibrational=tuple(vibrational),
        moments=moments,
        rms_u_angstrom2=float(np.sqrt(differences @ differences / len(differences))),
        degrees_of_freedom=free,
        condition=linear.condition,
        undetermined=linear.undetermined,
        minimum=minimum,
        notes=_notes(problem, linear.condition, free),
    )


def _values(problem: _Problem, x: Floats, covariance: Floats) -> tuple[Value, ...]:
    """Bonds and angles of the geometry `x` with errors."""
    directions, shape = problem.directions(x), slice(0, problem.shape_count)
    values = []
    for coordinate in _worth_giving(problem, x):
        spread = _spread(coordinate.gradient(x) @ directions, covariance[shape, shape])
        values.append(
            Value(coordinate.name, coordinate.atoms, coordinate.value(x), spread * coordinate.factor, coordinate.unit)
        )
    return tuple(values)


def _worth_giving(problem: _Problem, x: Floats) -> list[Named]:
    """The fitted coordinates, followed by other bonds and angles of the geometry."""
    molecule = Molecule(problem.family.molecule.symbols, x, problem.family.molecule.mass_numbers)
    chosen = [*problem.coordinates, *problem.held]
    seen = {atoms for coordinate in chosen for atoms in coordinate.alike}
    return [*chosen, *(coordinate for coordinate in bonds_and_angles(molecule) if not seen & set(coordinate.alike))]


def _spread(gradient: Floats, covariance: Floats) -> float:
    """√(g C gᵀ); infinite if an undetermined parameter contributes."""
    used = np.abs(gradient) > 1e-9
    if not np.isfinite(covariance.diagonal()[used]).all():
        return float("inf")
    chosen = gradient[used]
    return float(np.sqrt(chosen @ covariance[np.ix_(used, used)] @ chosen))


def _in_parent_frame(family: Family, x: Floats) -> Molecule:
    places, _, _ = _principal(family.parent, x)
    return Molecule(family.molecule.symbols, places, family.molecule.mass_numbers, name=family.name)


def _notes(problem: _Problem, condition: float, free: int) -> tuple[str, ...]:
    notes = []
    if free in STUDENT:
        notes.append(
            f"errors from the scatter of {free} degree{'s' if free > 1 else ''} of freedom: for 68 % confidence they count "
            f"{STUDENT[free]} times (Student's t)"
        )
    if len(problem.observed) == problem.count:
        notes.append("as many unknowns as moments: the fit cannot be tested, and there are no errors")
    if condition > 1e4:
        notes.append(f"condition {condition:.1e}: some combination of the parameters is poorly determined")
    family = problem.family
    if (
        problem.method in ("r0", "re")
        and family.planar
        and len({family.species[s].axes[g] for s, g in problem.rows}) == 3
    ):
        notes.append(
            "a planar molecule with all three moments of each species: they depend on each other; leave one out"
        )
    return tuple(notes)
