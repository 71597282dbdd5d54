"""Request of the structure of a family of isotopologues, and its answer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.requests.field import OBSERVABLES, check_fields, declared
from rotor.requests.lists import NameList
from rotor.requests.numerics import Goal, Numerics
from rotor.requests.readers import Flag, Text
from rotor.table import Table

if TYPE_CHECKING:
    from rotor.formats.fits.family_file import FamilyFile
    from rotor.molecules.molecule import Molecule
    from rotor.requests.budget import ErrorBudget
    from rotor.structures.consistency import PlanarMoment, Without
    from rotor.structures.family import Family
    from rotor.structures.least_squares import FittedStructure
    from rotor.structures.substitution import SubstitutionStructure, Value

METHODS = ("rs", "r0", "rm1", "rm2", "re")


@dataclass(frozen=True)
class StructureRequest:
    """Structures of a family; all values are checked when the request is made.

    file: the family, with its coordinates. methods: substitution (rs), fitted to all moments (r0, rm1, rm2), of equilibrium (re).
    weights: of the moments. leave_out: axes whose moments are not fitted. pair: moments of a planar molecule that serve for rs. check:
    whether fits are made again without each isotopologue.
    """

    file: FamilyFile
    methods: tuple[str, ...] = declared(
        ("rs", "r0"),
        NameList(METHODS),
        "Kinds of structure, among rs, r0, rm1, rm2, re",
        "observables.method",
        common=True,
    )
    weights: str = declared(
        "equal", Text(metavar="NAME"), "Moments weighted equally, or by their errors (errors)", "numerics.weights"
    )
    leave_out: str = declared(
        "",
        Text(metavar="AXES"),
        "Axes whose moments are not fitted, such as c",
        "numerics.leave_out",
        common=True,
        example="c",
    )
    pair: str = declared(
        "ab", Text(metavar="AB"), "Pair of moments used for rs of a planar molecule: ab, ac, bc", "numerics.pair"
    )
    check: bool = declared(
        False,
        Flag(),
        "Fit again without each isotopologue, to see which one differs from the others",
        "observables.check",
        panel=OBSERVABLES,
        common=True,
    )

    def __post_init__(self) -> None:
        check_fields(self)
        if self.check and set(self.methods) == {"rs"}:
            raise ValueError(
                "check: needs r0, rm1, rm2 or re, which are fitted to all isotopologues; add one of them to the methods"
            )


@dataclass(frozen=True, eq=False, repr=False)
class StructureTable(Table):
    """Values of all methods by rows: method, coordinate, value, error, unit."""

    by_method: Mapping[str, tuple[Value, ...]]

    @cached_property
    def columns(self) -> dict[str, NDArray[Any]]:
        """method, coordinate, value, error, unit."""
        rows = [(method, value) for method, values in self.by_method.items() for value in values]
        return {
            "method": np.array([method for method, _ in rows]),
            "coordinate": np.array([value.name for _, value in rows]),
            "value": np.array([value.value for _, value in rows], dtype=np.float64),
            "error": np.array([value.error for _, value in rows], dtype=np.float64),
            "unit": np.array([value.unit for _, value in rows]),
        }


@dataclass(frozen=True, eq=False)
class StructureAnswer:
    """Results of all methods. without: fits without each isotopologue, by method. doubts: about isotopologues. refused: reasons of
    methods with more unknowns than moments, where another method has a result.
    """

    request: StructureRequest
    substitution: SubstitutionStructure | None
    fitted: tuple[FittedStructure, ...]
    planar: tuple[PlanarMoment, ...] = ()
    without: Mapping[str, list[Without]] = field(default_factory=dict)
    doubts: tuple[str, ...] = ()
    refused: Mapping[str, str] = field(default_factory=dict)

    @property
    def table(self) -> StructureTable:
        """Bond lengths, angles and vibrational terms."""
        values = {} if self.substitution is None else {"rs": tuple(self.substitution.values)}
        return StructureTable(values | {fit.method: (*fit.values, *fit.vibrational) for fit in self.fitted})

    @property
    def errors(self) -> ErrorBudget:
        """Error budget of the bond lengths of the last method."""
        from rotor.structures.budgets import lengths_budget

        weights = self.request.weights
        if self.fitted:
            last = self.fitted[-1]
            return lengths_budget(last.method, last.values, last, weights)
        assert self.substitution is not None  # one method at least
        return lengths_budget("rs", self.substitution.values, None, weights)

    @property
    def geometry(self) -> tuple[Molecule, tuple[Value, ...], str]:
        """The last geometry that is complete, its values and the name of the method.

        Raises ValueError where rs alone was made and does not have every atom.
        """
        from rotor.molecules.molecule import Molecule

        if self.fitted:
            last = self.fitted[-1]
            return last.molecule, tuple(last.values), last.method
        assert self.substitution is not None  # one method at least
        positions = self.substitution.positions_angstrom
        if np.isnan(positions).any():
            raise ValueError("rs has not every atom; add a method that fits the whole geometry")
        symbols = self.request.file.family.molecule.symbols
        return Molecule(symbols, positions), tuple(self.substitution.values), "rs"

    @property
    def notes(self) -> list[str]:
        """Doubts about isotopologues, and what the moments do not determine."""
        remarks = [*self.doubts, *(self.substitution.notes if self.substitution else ())]
        for fit in self.fitted:
            remarks += [f"{fit.method}: {text}" for text in fit.notes]
            remarks += [f"{fit.method}: not determined by these moments: {c.text}" for c in fit.undetermined]
        return remarks

    def facts(self) -> dict[str, Any]:
        """Everything about the structures, by the keys of docs/verbs."""
        family = self.request.file.family
        return {
            "name": family.name,
            "kind": family.top.kind,
            "isotopologues": [
                {
                    "name": item.name,
                    "formula": item.molecule.formula,
                    "constants_mhz": dict(item.constants_mhz),
                    "errors_mhz": dict(item.errors_mhz),
                    "corrections_mhz": dict(item.corrections_mhz),
                    "moments_u_angstrom2": item.moments,
                    "axes": item.axes,
                    "source": item.source or None,
                }
                for item in family.species
            ],
            "planar_moments": [{**vars(item), "doubtful": item.doubtful} for item in self.planar],
            "without": {method: [vars(item) for item in fits] for method, fits in self.without.items()},
            "rs": _substitution_record(self.substitution),
            **{item.method: _fitted_record(item) for item in self.fitted},
            "notes": self.notes,
            "errors": self.errors.as_json(),
        }


def answer_structure(request: StructureRequest) -> StructureAnswer:
    """The structures of the methods, in their order; with check, fitted again without each isotopologue."""
    from rotor.structures.consistency import doubts, gains, moments_across_planes, without_each
    from rotor.structures.least_squares import TooFewMomentsError, fit_structure
    from rotor.structures.substitution import substitution_structure

    file = request.file
    substitution = None
    if "rs" in request.methods:
        substitution = substitution_structure(file.family, pair=request.pair, coordinates=file.coordinates)

    def fitted_to(family: Family, name: str) -> FittedStructure:
        """The structure of one kind, fitted."""
        return fit_structure(
            family,
            name,
            coordinates=file.coordinates,
            held=file.held,
            weights=request.weights,
            leave_out=tuple(request.leave_out),
        )

    fits: list[FittedStructure] = []
    refused: dict[str, str] = {}
    for name in request.methods:
        if name != "rs":
            try:
                fits.append(fitted_to(file.family, name))
            except TooFewMomentsError as error:
                refused[name] = str(error)
    if refused and substitution is None and not fits:
        raise ValueError(next(iter(refused.values())))
    fitted = tuple(fits)
    without = {
        fit.method: without_each(file.family, fit, partial(fitted_to, name=fit.method))
        for fit in fitted
        if request.check
    }
    said = [text for fit in fitted for text in gains(fit.method, without.get(fit.method, []), fit.rms_u_angstrom2)]
    planar = tuple(moments_across_planes(file.family))
    return StructureAnswer(request, substitution, fitted, planar, without, (*doubts(file.family), *said), refused)


def _substitution_record(structure: SubstitutionStructure | None) -> dict[str, Any] | None:
    if structure is None:
        return None
    return {
        "atoms": [
            {
                "atom": atom.atom,
                "isotopologue": atom.species,
                "coordinates_angstrom": atom.coordinates_angstrom,
                "squares_angstrom2": atom.squares_angstrom2,
                "costain_angstrom": atom.costain_angstrom,
                "measured_angstrom": atom.measured_angstrom,
            }
            for atom in structure.atoms
        ],
        "values": [vars(atom) for atom in structure.values],
    }


def _fitted_record(fit: FittedStructure) -> dict[str, Any]:
    return {
        "converged": fit.minimum.converged,
        "reason": fit.minimum.reason,
        "values": [vars(value) for value in fit.values],
        "vibrational": [vars(value) for value in fit.vibrational],
        "rms_u_angstrom2": fit.rms_u_angstrom2,
        "degrees_of_freedom": fit.degrees_of_freedom,
        "condition": fit.condition,
        "undetermined": [c.text for c in fit.undetermined],
        "positions_angstrom": fit.molecule.positions_angstrom,
        "moments": [{**vars(moment), "difference": moment.difference} for moment in fit.moments],
    }


STRUCTURE = Numerics({"Å": Goal("bond lengths")})
