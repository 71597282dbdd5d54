"""Compiled forms of the loops over lines: the columns of a pair of blocks in a single pass, and the choice by a cut.

Measured (`benchmarks/bench_lines.py`): a quarter of the time of the plain form in `transitions` for a long list; the
compiler takes half a second to load, so short lists do without it. Both forms give the same bits.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True, error_model="numpy")
def fill_pair(
    energies_up: NDArray[np.float64],
    energies_low: NDArray[np.float64],
    amplitude: NDArray[np.float64],
    start_up: int,
    start_low: int,
    frequency: NDArray[np.float64],
    strength: NDArray[np.float64],
    upper: NDArray[np.int32],
    lower: NDArray[np.int32],
) -> None:
    """Frequency, strength and states of all lines between two blocks; see `transitions._fill_pair`."""
    n_low = len(energies_low)
    for i in range(len(energies_up)):
        for k in range(n_low):
            at = i * n_low + k
            difference = energies_up[i] - energies_low[k]
            falls = difference < 0
            frequency[at] = abs(difference)
            strength[at] = amplitude[i, k] * amplitude[i, k]
            upper[at] = start_low + k if falls else start_up + i
            lower[at] = start_up + i if falls else start_low + k


@njit(cache=True, nogil=True, error_model="numpy")
def choose(
    energies_up: NDArray[np.float64],
    energies_low: NDArray[np.float64],
    strength: NDArray[np.float64],
    lowest: float,
    highest: float,
    population: NDArray[np.float64],
    kt_mhz: float,
    least: float,
    start_up: int,
    start_low: int,
) -> NDArray[np.int64]:
    """Rows and columns (2, chosen) of the lines between two blocks in a range and above a cut; see `transitions._choose`.

    The photon factor 1 - exp(-ν/kT) is at most 1, so it is computed only for lines that pass without it.
    """
    found = np.empty((2, strength.size), dtype=np.int64)
    count = 0
    for i in range(len(energies_up)):
        for k in range(len(energies_low)):
            difference = energies_up[i] - energies_low[k]
            frequency = abs(difference)
            if frequency < lowest or frequency > highest:
                continue
            state = start_up + i if difference < 0 else start_low + k
            scaled = frequency * strength[i, k] * population[state]
            if scaled >= least and scaled * -np.expm1(-frequency / kt_mhz) >= least:
                found[0, count], found[1, count] = i, k
                count += 1
    return found[:, :count]
