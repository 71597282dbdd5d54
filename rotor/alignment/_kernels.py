"""The compiled loop of the splitting: kicks and drifts of all columns of a block, and snapshots on the way."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True, error_model="numpy")
def kick_and_drift(
    states: NDArray[np.complex128],
    drifts: NDArray[np.complex128],
    which: NDArray[np.int64],
    phases: NDArray[np.complex128],
) -> None:
    """`states` (n, m) in place: the kick phases[0] (n,), then for every later one the drift drifts[which[i]] and phases[i + 1].

    One column goes through plain loops, which are faster there than a call of BLAS; more go through zgemm.
    """
    size, columns = states.shape
    for i in range(size):
        for c in range(columns):
            states[i, c] *= phases[0, i]
    moved = np.empty_like(states)
    for stage in range(len(which)):
        drift = drifts[which[stage]]
        if columns == 1:
            for i in range(size):
                real = 0.0
                imag = 0.0
                for k in range(size):
                    a, b = drift[i, k], states[k, 0]
                    real += a.real * b.real - a.imag * b.imag
                    imag += a.real * b.imag + a.imag * b.real
                moved[i, 0] = real + 1j * imag
        else:
            np.dot(drift, states, moved)
        for i in range(size):
            phase = phases[stage + 1, i]
            for c in range(columns):
                states[i, c] = moved[i, c] * phase
