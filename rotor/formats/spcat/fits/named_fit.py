"""The .par and .var file of a fit in named constants: held, free and tied parameters, a-priori errors, correlations.

SPFIT's parameters are not always the constants (A - B of a symmetric top), so that errors and correlations are carried over. A
constant that follows another one, c = r p + d, is a parameter that retains its ratio to p (a code with a minus sign, behind p), and
for d one more of the same code that is held: parameters of one code add up. In the .var file what the lines do not determine is held,
and with it every parameter that it is a part of.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rotor.arrays import Floats
from rotor.fitting.fit import Fit
from rotor.fitting.top_constants import TopConstants
from rotor.formats.spcat.fits.fit_input import packed_correlations
from rotor.formats.spcat.hamiltonian.codes import FIXED, constants_and_matrix
from rotor.formats.spcat.model import parameter_file
from rotor.formats.spcat.names.named_parameters import named_parameters
from rotor.formats.spcat.text.par import Parameter, ParameterFile
from rotor.tops.top import Top

_FREE = 1e36  # MHz: the a-priori error of what is free
_ROUND_OFF = 1e-9  # of the coefficients of parameters by the free constants, which are ratios
_KNMAX = 99  # above what is measured: SPCAT leaves higher K out of what it predicts, without a word
_DIFFERENCE = 1e-12  # of a tied parameter, below which it has no constant difference


def named_file(fit: Fit, title: str, *, variances: bool) -> ParameterFile:
    """The .par file of a fit in named constants, or with variances the .var file.

    Raises ValueError where a fitted combination of constants, or an a-priori error, has no parameter of its own there.
    """
    highest = max(int(fit.lines.upper[:, 0].max()), int(fit.lines.lower[:, 0].max()), _KNMAX)
    if isinstance(fit.named, TopConstants) and fit.named.in_field:
        raise ValueError("lines in an electric field: SPFIT's files have none")
    if isinstance(fit.named, TopConstants):
        file, codes = named_parameters(fit.named, title, min(highest, 359))
        matrix: Floats = np.asarray(np.linalg.pinv(codes), dtype=np.float64)
    else:
        file = parameter_file(Top.from_constants(fit.named, name=title), kmax=min(highest, 359))
        matrix = constants_and_matrix(file)[1]
        codes = np.asarray(np.linalg.pinv(matrix), dtype=np.float64)
    back = codes @ fit.parameters.matrix  # SPFIT's parameters by the free ones
    back[np.abs(back) < _ROUND_OFF] = 0.0
    if int(back.any(axis=1).sum()) == len(fit.parameters.names):
        parameters, free = _one_for_one(fit, file.parameters, back, variances)
    else:
        parameters, free = _tied(fit, file.parameters, back, matrix, variances)
    numbers = iter(range(len(free)))
    columns = [-1 if p.error == FIXED else next(numbers) for p in parameters if not p.constrained]
    rest = packed_correlations(_correlations(fit, free), columns) if variances else ""
    count = len(fit.lines) if file.header.nline > 0 else -len(fit.lines)
    header = replace(file.header, npar=len(parameters), nline=count, nitr=100)
    return replace(file, header=header, parameters=tuple(parameters), rest=rest)


def _covariance(fit: Fit, rows: Floats) -> Floats:
    """Of combinations (m, n) of the free constants that are determined."""
    own = np.where(np.isfinite(fit.statistics.covariance), fit.statistics.covariance, 0.0)
    return np.asarray(rows @ own @ rows.T)


def _correlations(fit: Fit, rows: Floats) -> Floats:
    covariance = _covariance(fit, rows)
    errors = np.sqrt(np.diag(covariance))
    return np.asarray(covariance / np.outer(errors, errors))


def _error(fit: Fit, row: Floats, variances: bool) -> float:
    """Estimated of the lines, or a priori, of a combination (n,) of the free constants; in the .var file held if not determined."""
    if variances and not _is_determined(fit, row):
        return FIXED
    if variances:
        return float(np.sqrt(_covariance(fit, row[None])[0, 0]))
    known = fit.parameters.prior[row != 0]
    if not np.isfinite(known).any():
        return _FREE
    if len(known) > 1:
        named = ", ".join(np.array(fit.parameters.names)[row != 0].tolist())
        raise ValueError(f"an a-priori error of {named} is none of one parameter of SPFIT, which is made up of these")
    return float(known[0] * np.abs(row[row != 0][0]))


def _is_determined(fit: Fit, row: Floats) -> bool:
    return bool(np.isfinite(fit.errors[row != 0]).all())


def _one_for_one(
    fit: Fit, given: tuple[Parameter, ...], back: Floats, variances: bool
) -> tuple[list[Parameter], Floats]:
    """As many parameters move as constants are free. Parameters, and those that are not held (m, n) by the free constants."""
    moved = np.atleast_1d(back.any(axis=1))
    made = [
        replace(p, error=_error(fit, row, variances) if moves else FIXED)
        for p, row, moves in zip(given, back, moved.tolist(), strict=True)
    ]
    return made, np.array([row for p, row in zip(made, back, strict=True) if p.error != FIXED]).reshape(
        -1, back.shape[1]
    )


def _tied(
    fit: Fit, given: tuple[Parameter, ...], back: Floats, matrix: Floats, variances: bool
) -> tuple[list[Parameter], Floats]:
    """Each parameter that moves follows one free constant. Parameters, and those that are not held (m, n) by the free constants.

    matrix : the constants by the parameters.
    """
    if ((back != 0).sum(axis=1) > 1).any():
        raise ValueError("constants that are tied and parameters that are sums of constants (A - B) do not go together")
    made, free, behind = list[Parameter](), list[Floats](), list[Parameter]()
    for i, name in enumerate(fit.parameters.names):
        rows = np.flatnonzero(back[:, i]).tolist()
        own = matrix[fit.parameters.constant_names.index(name)]
        leader = max(rows, key=lambda k: abs(own[k]))
        if len(rows) > 1 and not _share(fit, back, leader):
            raise ValueError(f"{name} is 0, and SPFIT has no ratio to a parameter that is 0")
        if not variances or _is_determined(fit, back[leader]):
            free.append(back[leader])
        for k in sorted(rows, key=lambda k: (k != leader, k)):
            share = _share(fit, back, k)
            made.append(replace(given[k], value=share, error=_error(fit, back[k], variances), constrained=k != leader))
            if abs(given[k].value - share) > _DIFFERENCE * abs(share):
                behind.append(replace(given[k], value=given[k].value - share, error=FIXED, label="difference"))
    held = [replace(p, error=FIXED) for p, row in zip(given, back, strict=True) if not row.any()]
    return [*made, *behind, *held], np.array(free).reshape(-1, back.shape[1])


def _share(fit: Fit, back: Floats, k: int) -> float:
    """The part of a parameter that follows the free constants."""
    return float(back[k] @ fit.values)
