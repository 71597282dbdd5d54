"""Error budget of A, B and C (`rotor.requests.budget`): the largest error of each source over one or several tops."""

from __future__ import annotations

from collections.abc import Sequence

from rotor.requests.budget import ROUNDING, ErrorBudget, ErrorTerm
from rotor.tops.top import Top

RIGID = ("A", "B", "C")


def constants_budget(tops: Sequence[Top]) -> ErrorBudget:
    """Error budget of the rotational constants of tops.

    >>> from rotor.molecules.molecule import Molecule
    >>> co = Molecule(("C", "O"), [[0, 0, 0], [0, 0, 1.13]], source="a guess", uncertainty=0.01)
    >>> constants_budget([Top.from_molecule(co)]).line()
    'errors of rotational constants: data 580 MHz (error of the geometry), numerical 1e-10 MHz'
    """
    largest = max((top.constants[name] for top in tops for name in _rigid(top)), default=0.0)
    return ErrorBudget(
        of="rotational constants",
        unit="MHz",
        rounding=ErrorTerm(ROUNDING * largest, "moments in double precision"),
        truncation=ErrorTerm(0.0, "nothing is approximated"),
        model=ErrorTerm(0.0, "constants that define the Hamiltonian"),
        data=_data(tops),
        statistics=ErrorTerm(0.0, "nothing is sampled"),
    )


def _rigid(top: Top) -> list[str]:
    return [name for name in RIGID if name in top.constants.values]


def _data(tops: Sequence[Top]) -> ErrorTerm:
    """Largest error of A, B and C: estimated for constants from a geometry or another isotopologue, else a standard deviation."""
    estimates = {top: max(top.estimated_errors_mhz.values(), default=0.0) for top in tops}
    measured = [(top, name) for top in tops for name in _rigid(top) if name not in top.estimated_errors_mhz]
    errors = [top.constants.uncertainties.get(name) for top, name in measured]
    known = max((error for error in errors if error is not None), default=0.0)
    top, estimate = max(estimates.items(), key=lambda pair: pair[1], default=(None, 0.0))
    if top is not None and estimate > known:
        source = "error of the geometry" if top.source_geometry else "scaling from another isotopologue"
        return ErrorTerm(estimate, source, "measured constants")
    if not errors or None in errors:
        return ErrorTerm(None, "no uncertainties of the constants are known")
    return ErrorTerm(known, "constants", "more precise constants")
