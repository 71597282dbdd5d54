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
    'errors of rotational constants: left out about 580 MHz (error of the geometry), numerical 1e-10 MHz, data not estimated: \
no uncertainties of the constants are known'
    """
    largest = max((top.constants[name] for top in tops for name in _rigid(top)), default=0.0)
    return ErrorBudget(
        of="rotational constants",
        unit="MHz",
        rounding=ErrorTerm(ROUNDING * largest, "moments in double precision"),
        truncation=ErrorTerm(0.0, "nothing is approximated"),
        model=_estimated(tops),
        data=_measured(tops),
        statistics=ErrorTerm(0.0, "nothing is sampled"),
    )


def _rigid(top: Top) -> list[str]:
    return [name for name in RIGID if name in top.constants.values]


def _estimated(tops: Sequence[Top]) -> ErrorTerm:
    """Estimated error of constants from a geometry, or scaled from another isotopologue."""
    errors = {top: max(top.estimated_errors_mhz.values(), default=0.0) for top in tops}
    top, error = max(errors.items(), key=lambda pair: pair[1], default=(None, 0.0))
    if top is None or not error:
        return ErrorTerm(0.0, "constants that define the Hamiltonian")
    molecule = top.molecule
    from_geometry = molecule is not None and top.source == molecule.source
    source = "error of the geometry" if from_geometry else "scaling from another isotopologue"
    return ErrorTerm(error, source, "measured constants")


def _measured(tops: Sequence[Top]) -> ErrorTerm:
    """Largest standard deviation of A, B and C."""
    measured = [(top, name) for top in tops for name in _rigid(top) if name not in top.estimated_errors_mhz]
    errors = [top.constants.uncertainties.get(name) for top, name in measured]
    if not errors or None in errors:
        return ErrorTerm(None, "no uncertainties of the constants are known")
    return ErrorTerm(max(error for error in errors if error is not None), "constants", "more precise constants")
