"""The covariance of the named constants of a .var file."""

from __future__ import annotations

import numpy as np

from rotor.formats.spcat.hamiltonian.codes import constants_and_matrix
from rotor.formats.spcat.solved_groups import variance_factor
from rotor.formats.spcat.text.par import ParameterFile
from rotor.tops.constants.covariance import Covariance


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
