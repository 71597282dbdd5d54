"""What a .var file knows of its errors: the covariance C = D V Vᵀ D of the parameters, as a factor that makes errors of lines.

D are the errors beside the parameters, V (upper triangular, column by column, ten characters a number) what stands behind them;
without V the errors count as uncorrelated, as SPCAT takes them. A parameter with a minus sign keeps its ratio to the one before.
"""

from __future__ import annotations

from itertools import takewhile

import numpy as np

from rotor.arrays import Floats
from rotor.formats.spcat.hamiltonian.codes import HELD_BELOW, constants_and_matrix
from rotor.formats.spcat.text.par import Parameter, ParameterFile
from rotor.tops.covariance import Covariance

FREE_ABOVE = 1e15  # MHz: an a-priori error so large is none; SPFIT counts it as no datum either
_WIDTH = 10


def variance_factor(file: ParameterFile) -> Floats | None:
    """F (parameters, k) in MHz with F Fᵀ the covariance of the parameter lines; None where none has an estimated error.

    Raises ValueError for correlations that are of another number of parameters, or no numbers.
    """
    errors = np.array([_estimated(parameter) for parameter in file.parameters])
    if not errors.any():
        return None
    leaders = [i for i, parameter in enumerate(file.parameters) if not parameter.constrained]
    fitted = [i for i in leaders if errors[i] > 0]
    correlations = _correlations(file)
    named = leaders if len(correlations) == len(leaders) else fitted
    if not len(correlations):
        correlations = np.eye(len(named))
    if len(correlations) != len(named):
        raise ValueError(
            f"correlations of {len(correlations)} parameters stand at the end of the file, which has {len(fitted)} with an error; "
            "give the .var as it was written"
        )
    factor = np.zeros((len(file.parameters), len(named)))
    factor[named] = errors[named, None] * correlations
    for i, parameter in enumerate(file.parameters):
        if parameter.constrained:
            leader = max(j for j in leaders if j < i)
            value = file.parameters[leader].value
            factor[i] = factor[leader] * (parameter.value / value) if value else 0.0
    return factor


def constants_covariance(file: ParameterFile) -> Covariance | None:
    """The covariance of the named constants of a file with one state and no spins; None without estimated errors."""
    factor = variance_factor(file)
    if factor is None:
        return None
    constants, matrix = constants_and_matrix(file)
    spread = matrix @ factor
    rows = np.flatnonzero(spread.any(axis=1))
    names = tuple(constants.values)
    return Covariance(tuple(names[i] for i in rows), spread[rows] @ spread[rows].T)


def _estimated(parameter: Parameter) -> float:
    error = parameter.error or 0.0
    return error if HELD_BELOW <= error < FREE_ABOVE and not parameter.constrained else 0.0


def _is_of_numbers(line: str) -> bool:
    return not line.strip() or line.strip()[0] in "+-.0123456789"


def _correlations(file: ParameterFile) -> Floats:
    """V (k, k), upper triangular; (0, 0) where none stands there.

    As for SPCAT (`getpar`, `getvar`) there is none behind fewer parameters than NPAR; nor is a text behind them, such as another list
    that is put aside, one.
    """
    rows = list(takewhile(_is_of_numbers, file.rest.splitlines()))
    if len(file.parameters) < file.header.npar:
        rows = []
    words = [line[i : i + _WIDTH] for line in rows for i in range(0, len(line.rstrip()), _WIDTH)]
    try:
        values = [float(word) for word in words if word.strip()]
    except ValueError:
        raise ValueError(
            f"the correlations at the end of the file are no numbers of {_WIDTH} characters each"
        ) from None
    size = int((np.sqrt(8 * len(values) + 1) - 1) / 2)
    if size * (size + 1) // 2 != len(values):
        raise ValueError(
            f"{len(values)} correlations stand at the end of the file; k (k + 1)/2 are needed for k parameters"
        )
    out = np.zeros((size, size))
    for column in range(size):
        out[: column + 1, column] = values[column * (column + 1) // 2 : (column + 1) * (column + 2) // 2]
    return out
