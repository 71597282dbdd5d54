"""Covariance C = D V Vᵀ D of the parameters of a .var file, as a factor for errors of lines.

D are the errors of the parameter lines; V (upper triangular, column by column, ten characters for each number) follows them. Without V the
errors are uncorrelated, as in SPCAT. A parameter with a minus sign has a fixed ratio to the one before.
"""

from __future__ import annotations

from itertools import takewhile

import numpy as np

from rotor.arrays import Floats
from rotor.formats.spcat.hamiltonian.codes import HELD_BELOW
from rotor.formats.spcat.text.par import Parameter, ParameterFile

FREE_ABOVE = 1e15  # MHz; a larger a-priori error counts as none, as in SPFIT
NO_LEADER = "the first one has none before it to keep a ratio to"
_WIDTH = 10


def variance_factor(file: ParameterFile) -> Floats | None:
    """F (parameters, k) in MHz with F Fᵀ the covariance of the parameter lines; None without estimated errors.

    Raises ValueError for correlations of another number of parameters, or that are not numbers.
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
            leader = max((j for j in leaders if j < i), default=None)
            if leader is None:
                raise parameter.refusal(NO_LEADER)
            value = file.parameters[leader].value
            factor[i] = factor[leader] * (parameter.value / value) if value else 0.0
    return factor


def _estimated(parameter: Parameter) -> float:
    error = parameter.error or 0.0
    return error if HELD_BELOW <= error < FREE_ABOVE and not parameter.constrained else 0.0


def _correlations(file: ParameterFile) -> Floats:
    """V (k, k), upper triangular; (0, 0) if the file has none.

    As in SPCAT (`getpar`, `getvar`), V is ignored after fewer parameters than NPAR, and so is text after the parameters, such as another
    list."""
    rows = list(takewhile(lambda line: line.strip()[:1] in "+-.0123456789", file.rest.splitlines()))
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
    out.T[np.tril_indices(size)] = values
    return out
