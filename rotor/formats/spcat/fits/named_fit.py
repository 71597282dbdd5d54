"""The .par and .var files of a fit in named constants: held, free and tied parameters, a-priori errors, correlations; and tables of the
parameters of SPFIT's files after a fit, for a publication and for the report.

SPFIT's parameters are not always the constants (A - B of a symmetric top), so that errors and correlations are transformed. A constant that
follows another, c = r p + d, becomes a parameter with a fixed ratio to p (a code with a minus sign, after p), plus a held parameter of the
same code for d, since equal codes are added. In the .var file constants that the lines do not determine are held, and with them all
parameters that contain them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rotor.arrays import Floats
from rotor.fitting.reports.publication import Row, value_text
from rotor.fitting.result import Fit
from rotor.fitting.top_constants import TopConstants
from rotor.formats.spcat.fits.fit_input import SpfitInput, correlation_text
from rotor.formats.spcat.hamiltonian.code_table import Digits, Kind, file_codes
from rotor.formats.spcat.hamiltonian.codes import (
    A_REDUCTION,
    FIXED,
    LINEAR,
    MEAN,
    S_REDUCTION,
    SQUARES,
    SYMMETRIC,
    Factors,
    is_linear,
)
from rotor.formats.spcat.names.named_parameters import named_parameters
from rotor.formats.spcat.text.par import Parameter, ParameterFile
from rotor.tops.top import Top

_FREE = 1e36  # MHz, a-priori error of a free parameter
_ROUND_OFF = 1e-9  # smaller coefficients of parameters by free constants (ratios) are round-off
_KNMAX = 99  # above all measured K, as SPCAT silently leaves higher K out of predictions
_DIFFERENCE = 1e-12  # a smaller constant difference of a tied parameter, relative to it, is round-off


def named_file(fit: Fit, title: str, *, variances: bool) -> ParameterFile:
    """The .par file of a fit in named constants, or with variances the .var file.

    Raises ValueError if a fitted combination of constants, or an a-priori error, corresponds to no single parameter.
    """
    highest = max(int(fit.lines.upper[:, 0].max()), int(fit.lines.lower[:, 0].max()), _KNMAX)
    if isinstance(fit.named, TopConstants) and fit.named.in_field:
        raise ValueError("lines in an electric field: SPFIT's files have none")
    named = fit.named if isinstance(fit.named, TopConstants) else TopConstants(Top.from_constants(fit.named))
    if named.top.internal_rotation is not None:
        raise ValueError("internal rotation: SPFIT's files have no such constants; the .toml holds everything")
    file, codes = named_parameters(named, title, min(highest, 359))  # 359 is SPCAT's largest KNMAX
    matrix: Floats = np.asarray(np.linalg.pinv(codes), dtype=np.float64)
    back = codes @ fit.parameters.matrix  # derivatives of SPFIT's parameters by the free constants
    back[np.abs(back) < _ROUND_OFF] = 0.0
    if int(back.any(axis=1).sum()) == len(fit.parameters.names):
        parameters, free = _matched_parameters(fit, file.parameters, back, variances)
    else:
        parameters, free = _tied(fit, file.parameters, back, matrix, variances)
    numbers = iter(range(len(free)))
    columns = [-1 if p.error == FIXED else next(numbers) for p in parameters if not p.constrained]
    covariance = _covariance(fit, free)
    errors = np.sqrt(np.diag(covariance))
    rest = correlation_text(covariance / np.outer(errors, errors), columns) if variances else ""
    count = len(fit.lines) if file.header.nline > 0 else -len(fit.lines)
    header = replace(file.header, npar=len(parameters), nline=count, nitr=100)
    return replace(file, header=header, parameters=tuple(parameters), rest=rest)


def _covariance(fit: Fit, rows: Floats) -> Floats:
    """Covariance of determined combinations (m, n) of the free constants."""
    # undetermined parameters have no covariance in the file
    covariance = np.where(np.isfinite(fit.statistics.covariance), fit.statistics.covariance, 0.0)
    return np.asarray(rows @ covariance @ rows.T)


def _error(fit: Fit, row: Floats, variances: bool) -> float:
    """Error of a combination (n,) of the free constants, estimated or a priori; in the .var file held if undetermined."""
    if variances and not _is_determined(fit, row):
        return FIXED
    if variances:
        return float(np.sqrt(_covariance(fit, row[None])[0, 0]))
    priors = fit.parameters.prior[row != 0]
    if not np.isfinite(priors).any():
        return _FREE
    if len(priors) > 1:
        named = ", ".join(np.array(fit.parameters.names)[row != 0].tolist())
        raise ValueError(f"an a-priori error of {named} is none of one parameter of SPFIT, which is made up of these")
    return float(priors[0] * np.abs(row[row != 0][0]))


def _is_determined(fit: Fit, row: Floats) -> bool:
    """Whether the lines determine a combination of the free constants."""
    return bool(np.isfinite(fit.errors[row != 0]).all())


def _matched_parameters(
    fit: Fit, parameters: tuple[Parameter, ...], back: Floats, variances: bool
) -> tuple[list[Parameter], Floats]:
    """The parameters if as many move as constants are free; and the moving ones as combinations (m, n) of the free constants."""
    moved = np.atleast_1d(back.any(axis=1))
    fitted = [
        replace(p, error=_error(fit, row, variances) if moves else FIXED)
        for p, row, moves in zip(parameters, back, moved.tolist(), strict=True)
    ]
    return fitted, np.array([row for p, row in zip(fitted, back, strict=True) if p.error != FIXED]).reshape(
        -1, back.shape[1]
    )


def _tied(
    fit: Fit, parameters: tuple[Parameter, ...], back: Floats, matrix: Floats, variances: bool
) -> tuple[list[Parameter], Floats]:
    """The parameters if each moving one follows one free constant; and the moving ones as combinations (m, n) of the free constants.

    matrix: derivatives of the constants by the parameters.
    """
    if ((back != 0).sum(axis=1) > 1).any():
        raise ValueError("constants that are tied and parameters that are sums of constants (A - B) do not go together")
    tied, free, behind = list[Parameter](), list[Floats](), list[Parameter]()
    for i, name in enumerate(fit.parameters.names):
        rows = np.flatnonzero(back[:, i]).tolist()
        factors = matrix[fit.parameters.constant_names.index(name)]
        leader = max(rows, key=lambda k: abs(factors[k]))  # the largest factor divides the ratios: none exceeds 1
        if len(rows) > 1 and not _share(fit, back, leader):
            raise ValueError(f"{name} is 0, and SPFIT has no ratio to a parameter that is 0")
        if not variances or _is_determined(fit, back[leader]):
            free.append(back[leader])
        for k in sorted(rows, key=lambda k: (k != leader, k)):
            share = _share(fit, back, k)
            tied.append(
                replace(parameters[k], value=share, error=_error(fit, back[k], variances), constrained=k != leader)
            )
            if abs(parameters[k].value - share) > _DIFFERENCE * abs(share):
                behind.append(
                    replace(parameters[k], value=parameters[k].value - share, error=FIXED, label="difference")
                )
    held = [replace(p, error=FIXED) for p, row in zip(parameters, back, strict=True) if not row.any()]
    return [*tied, *behind, *held], np.array(free).reshape(-1, back.shape[1])


def _share(fit: Fit, back: Floats, k: int) -> float:
    """The part of a parameter that follows the free constants."""
    return float(back[k] @ fit.values)


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
