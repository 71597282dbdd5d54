"""Request of the isotopologues of a molecule, by abundance or by substitution, and its answer."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.formats.molecules.fitted_isotopologue import with_fitted_isotopologue
from rotor.requests.budget import ErrorBudget
from rotor.requests.field import check_fields, declared
from rotor.requests.readers import Names, Quantity
from rotor.table import Table
from rotor.tops.constants.budget import constants_budget
from rotor.tops.isotopes.isotopologues import Isotopologue, isotopologue, isotopologues, single_substitutions
from rotor.tops.top import Top

MIN_ABUNDANCE = 1e-4


@dataclass(frozen=True)
class IsotopologuesRequest:
    """Isotopologues of a molecule; all values are checked when the request is made.

    top: the parent, with a geometry. min_abundance: least abundance in nature; None: 1e-4 unless others are named. each: elements of which
    each atom is substituted, one at a time, "O=18O". site: atoms that are substituted together, "2=2H".
    """

    top: Top
    min_abundance: float | None = declared(
        None, Quantity("fraction", metavar="X"), "Minimum natural abundance of those listed; 0.0001 unless others are named",
        "observables.min_abundance", common=True, example=0.01,
    )  # fmt: skip
    each: tuple[str, ...] = declared(
        (), Names("O=18O"), "Substitute each atom of an element in turn, such as O=18O; repeatable", "observables.each", common=True,
        example=["O=18O"],
    )  # fmt: skip
    site: tuple[str, ...] = declared(
        (), Names("2=2H"), "The isotopologue with this atom substituted; repeated, all of them together", "observables.site", common=True,
        example=["2=2H"],
    )  # fmt: skip

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True, eq=False, repr=False)
class IsotopologueTable(Table):
    """Isotopologues by rows: label, formula, abundance, arrangements, mass, kind, A, B, C, dipole."""

    family: tuple[Isotopologue, ...]

    @cached_property
    def columns(self) -> dict[str, NDArray[Any]]:
        """label, formula, abundance, arrangements, mass_u, kind, a_mhz, b_mhz, c_mhz, mu_a_debye, mu_b_debye, mu_c_debye."""
        tops = [isotopologue.top for isotopologue in self.family]
        texts = {
            name: np.array([getattr(isotopologue, name) for isotopologue in self.family])
            for name in ("label", "formula", "abundance", "arrangements")
        }
        rigid = np.array([top.rotational_constants_mhz for top in tops]).reshape(-1, 3)
        dipole = np.array([top.dipole_abc_debye or (np.nan,) * 3 for top in tops]).reshape(-1, 3)
        return {
            **texts,
            "mass_u": np.array([top.mass_u for top in tops], dtype=np.float64),
            "kind": np.array([top.kind for top in tops]),
            **{f"{axis}_mhz": rigid[:, i] for i, axis in enumerate("abc")},
            **{f"mu_{axis}_debye": dipole[:, i] for i, axis in enumerate("abc")},
        }


@dataclass(frozen=True, eq=False)
class IsotopologuesAnswer:
    """The isotopologues of a request."""

    request: IsotopologuesRequest
    family: tuple[Isotopologue, ...]

    @property
    def table(self) -> IsotopologueTable:
        """One row for each isotopologue."""
        return IsotopologueTable(self.family)

    @property
    def notes(self) -> list[str]:
        """Notes that the parent does not have, each once with its isotopologues."""
        about: dict[str, list[str]] = {}
        for each in self.family:
            for text in each.top.notes:
                if text not in self.request.top.notes:
                    about.setdefault(text, []).append(each.label)
        return [f"{', '.join(labels)}: {text}" for text, labels in about.items()]

    @property
    def errors(self) -> ErrorBudget:
        """Error budget of A, B and C of all isotopologues."""
        return constants_budget([isotopologue.top for isotopologue in self.family])

    def facts(self) -> dict[str, Any]:
        """Everything about the isotopologues, by the keys of docs/verbs."""
        return {
            "name": self.request.top.name or None,
            "isotopologues": [record(isotopologue) for isotopologue in self.family],
            "errors": self.errors.as_json(),
        }


def answer_isotopologues(request: IsotopologuesRequest) -> IsotopologuesAnswer:
    """The isotopologues above the smallest abundance, those of `each` and that of `site`, each once.

    Raises ValueError for constants without a geometry, and for substitutions that the molecule does not have.
    """
    family: list[Isotopologue] = []
    if request.min_abundance is not None or not (request.each or request.site):
        least = MIN_ABUNDANCE if request.min_abundance is None else request.min_abundance
        family += isotopologues(request.top, min_abundance=least)
    for text in request.each:
        family += _named("each", text, lambda value: single_substitutions(request.top, *_substitution(value)))
    if request.site:
        family.append(_named("site", ",".join(request.site), lambda text: isotopologue(request.top, text)))
    by_label = {
        isotopologue.label: replace(isotopologue, top=with_fitted_isotopologue(isotopologue.top))
        for isotopologue in family
    }
    return IsotopologuesAnswer(request, tuple(by_label.values()))


def _named(name: str, text: Any, make: Any) -> Any:
    try:
        return make(text)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def _substitution(text: str) -> tuple[str, str]:
    element, equals, name = (part.strip() for part in text.partition("="))
    if not (element.isalpha() and equals and name):
        raise ValueError(f"{text!r}: expected an element and its isotope, such as O=18O")
    return element, name


def record(isotopologue: Isotopologue) -> dict[str, Any]:
    """One isotopologue by the keys of docs/verbs."""
    top, symmetry = isotopologue.top, isotopologue.top.symmetry
    return {
        "formula": isotopologue.formula,
        "label": isotopologue.label,
        "substituted": dict(isotopologue.substituted),
        "arrangements": isotopologue.arrangements,
        "abundance": isotopologue.abundance,
        "mass_u": top.mass_u,
        "kind": top.kind,
        "point_group": symmetry.point_group if symmetry else None,
        "constants_mhz": dict(top.constants.values),
        "estimated_errors_mhz": top.estimated_errors_mhz,
        "reduction": top.constants.reduction,
        "representation": top.constants.representation,
        "rotational_constants_mhz": top.rotational_constants_mhz,
        "axes_of_parent": isotopologue.axes,
        "turned_degrees": isotopologue.turned_degrees,
        "dipole_abc_debye": top.dipole_abc_debye,
        "spin_weights": top.spin_weights.to_mapping(),
        "spin_constants_mhz": dict(top.spin_constants.values) if top.spin_constants else None,
        "source": top.source or None,
        "notes": list(top.notes),
    }
