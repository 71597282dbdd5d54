"""Tables of the parameters of SPFIT's files after a fit, for a publication and for the report: name, code and states."""

from __future__ import annotations

from rotor.fitting.publication import Row, value_text
from rotor.fitting.result import Fit
from rotor.formats.spcat.fits.fit_input import SpfitInput
from rotor.formats.spcat.hamiltonian.code_table import Digits, Kind, file_codes
from rotor.formats.spcat.hamiltonian.codes import (
    A_REDUCTION,
    LINEAR,
    MEAN,
    S_REDUCTION,
    SQUARES,
    SYMMETRIC,
    Factors,
    is_linear,
)
from rotor.formats.spcat.text.par import ParameterFile

_B: Factors = {MEAN: {"B": 1.0}}


def publication_rows(fit_input: SpfitInput, fit: Fit) -> list[Row]:
    """Rows of all parameters: published constants with their names and signs, others with their labels."""
    file, rows = fit_input.file, list[Row]()
    published = _names(file)
    for place, (parameter, digits) in enumerate(zip(file.parameters, file_codes(file), strict=True)):
        unnamed = {parameter.label or str(parameter.code): 1.0}
        ((name, sign),) = published.get(_rotational(digits), unnamed).items()
        value, error, follows = _numbers(fit_input, fit, place)
        rows.append(Row(name, sign * value, error, follows, _states(digits)))
    return rows


def parameter_section(fit_input: SpfitInput, fit: Fit) -> list[str]:
    """A line for each parameter of the file: code, label, value(error), and whether it is held or follows another."""
    out = []
    for place, parameter in enumerate(fit_input.file.parameters):
        value, error, follows = _numbers(fit_input, fit, place)
        role = "held" if error is None else f"follows {follows}" if follows else ""
        code = f"{'-' if parameter.constrained else ''}{parameter.code}"
        text = value_text(value, error) if error else f"{value:.15g}"
        out.append(f"{place + 1:5d}  {code:>13}  {parameter.label:<16}{text:>28}  {role}".rstrip())
    return out


def _numbers(fit_input: SpfitInput, fit: Fit, place: int) -> tuple[float, float | None, str]:
    """Value and error (None: held) of a parameter, and the label or code of the parameter to which it has a fixed ratio."""
    parameter, column, ratio = fit_input.file.parameters[place], fit_input.columns[place], fit_input.ratios[place]
    if column < 0:
        return parameter.value, None, ""
    # a constrained parameter follows the last free one above it
    leader = next(p for p in reversed(fit_input.file.parameters[: place + 1]) if not p.constrained)
    follows = "" if not parameter.constrained else leader.label or str(leader.code)
    return float(fit.values[column]) * ratio, float(fit.errors[column]) * abs(ratio), follows


def _rotational(digits: Digits) -> int:
    """The code without its states; -1 for terms with spins, series or between states."""
    if digits.v1 != digits.v2 or digits.has_spin or digits.ex or digits.ff:
        return -1
    return digits.in_lowest_state


def _names(file: ParameterFile) -> Factors:
    """The published names of the codes of a file; empty if its terms fit no single reduction."""
    rotational = [d for d in file_codes(file) if _rotational(d) >= 0]
    if all(is_linear(options) for options in file.options):
        return _B | LINEAR
    if all(d.kind is Kind.SCALAR for d in rotational):
        return _B | SYMMETRIC
    rigid = SQUARES if set(SQUARES) <= {_rotational(d) for d in rotational} else {}
    letters = frozenset().union(*(d.reductions for d in rotational))
    if len(letters) != 1:
        return rigid
    return rigid | (A_REDUCTION if "A" in letters else S_REDUCTION)


def _states(digits: Digits) -> str:
    """The states of a term: all of a file with several, one, or the two that it connects."""
    if digits.state_count == 1:
        return ""
    return "all" if digits.states is None else ", ".join(map(str, dict.fromkeys(digits.states)))
