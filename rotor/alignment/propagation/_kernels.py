"""The compiled loop of the splitting: kicks and drifts of all columns of a block, with snapshots."""

import numpy as np
from numpy.typing import NDArray

from rotor.kernels import kernel


@kernel(error_model="numpy")
def _copy(source: NDArray[np.complex128], target: NDArray[np.complex128]) -> None:
    """Copy by plain loops: compiling a slice assignment, with its error messages, takes four seconds more."""
    for i in range(source.shape[0]):
        for c in range(source.shape[1]):
            target[i, c] = source[i, c]


@kernel(nogil=True, error_model="numpy")
def kick_and_drift(
    states: NDArray[np.complex128],
    drifts: NDArray[np.complex128],
    which: NDArray[np.int64],
    phases: NDArray[np.complex128],
    marks: NDArray[np.bool_],
    snapshots: NDArray[np.complex128],
) -> None:
    """Propagate `states` (n, m) in place: each stage i is a kick with phases[i] (n,) and the drift drifts[which[i]].

    After stages with `marks` the states are copied into `snapshots`. A single column uses plain loops, which are then faster than
    BLAS; several columns use zgemm.
    """
    size, columns = states.shape
    moved = np.empty_like(states)
    taken = 0
    for stage in range(len(which)):
        for i in range(size):
            phase = phases[stage, i]
            for c in range(columns):
                states[i, c] *= phase
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
        _copy(moved, states)
        if marks[stage]:
            _copy(states, snapshots[taken])
            taken += 1
