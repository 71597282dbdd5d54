"""Labels of levels where the diagonal of a Hamiltonian does not rise with K, as for an oblate top in prolate axes.

SPCAT names the states of a Wang block by energy, as K rises (DIAG 0). Two of its rules matter where the diagonal falls (`kroll`, `hdiag`
and `ordblk` in H. M. Pickett's program): functions that no element connects are named apart; and with DIAG 0 it takes the elements of
all functions from the first K on, above K = 3, where the diagonal falls, out of the matrix. These functions are then states with
first-order energies. Here all energies are eigenvalues, and such states are named after the function that has the largest share of them.
Levels that are called by N and K alone (SPIND below 0) are named after that function in the whole block where each has more than half of
one function: K is nearly good then. SPCAT names those of them that are connected by energy. In an oblate basis the diagonal is that of -H.
"""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.connected import part_numbers

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from rotor.tops.operators import Operators

_FIRST_LOOKED_AT = 5  # the diagonal is tested from the last function of a block with K up to this value
_CLEAR = 0.5  # a larger weight is the largest one of its state and of its function
_NO_ELEMENT = 1e-13  # round-off of a matrix computed from its eigenvectors, relative to the largest energy


class Diagonal(Enum):
    """Behaviour of the diagonal of a Hamiltonian, which decides how levels are labelled.

    RISES: with K (falls in an oblate basis). FALLS: at some K. FALLS_IN_K: at some K, and levels are labelled by N and K.
    """

    RISES = 0
    FALLS = 1
    FALLS_IN_K = 2


def falls_with_k(
    states: Iterable[Mapping[str, Operators]], values: Mapping[str, float], highest_n: int, oblate: bool
) -> int | None:
    """The lowest N at which the diagonal of a state does not rise (in an oblate basis, fall) with K in steps of two; None without any.

    The diagonal consists of the terms with n = 0 of H = Σ c N^2p Nz^2q ½(N₊^2n + N₋^2n).
    """
    n, k = np.arange(highest_n + 1.0), np.arange(highest_n + 1.0)
    lowest_n = []
    for operators in states:
        diagonal = np.zeros((highest_n + 1, highest_n + 1))
        for name, powers in operators.items():
            for (p, q, order), factor in powers.items():
                if order == 0:
                    diagonal += values[name] * factor * np.outer((n * (n + 1)) ** p, k ** (2 * q))
        steps = (diagonal[:, 2:] - diagonal[:, :-2]) * (-1.0 if oblate else 1.0)
        wrong = ((steps < 0) & (k[2:] <= n[:, None])).any(axis=1)
        lowest_n += np.flatnonzero(wrong)[:1].tolist()
    return min(lowest_n, default=None)


def connected_groups(groups: Ints, k: Ints, amplitudes: Floats, energies: Floats, diag: int) -> Ints:
    """The groups of functions that label levels, divided into connected parts.

    groups (functions,): a group for each function, such as its Wang block. k (functions,). amplitudes (functions, states): eigenvectors
    in columns. energies (states,): eigenvalues of H, or of -H in an oblate basis. diag: DIAG; with 0 each function whose diagonal element
    falls is a separate group.
    Returns: group numbers from 0 on.
    """
    hamiltonian = (amplitudes * (energies - energies.mean())) @ amplitudes.T
    # elements of round-off link nothing
    linked = np.abs(hamiltonian) > _NO_ELEMENT * np.abs(energies).max(initial=0.0)
    if diag == 0:
        apart = _rolled_over(groups, k, hamiltonian.diagonal())
        linked[apart, :] = linked[:, apart] = False
    parts = part_numbers(len(k), *np.nonzero(linked))
    return np.asarray(np.unique(np.column_stack([groups, parts]), axis=0, return_inverse=True)[1].reshape(-1))


def clear_functions(amplitudes: Floats) -> Ints | None:
    """The function (states,) with more than half of the weight of each state; None if a state has none."""
    shares = amplitudes**2
    # one clear function a state names it
    return shares.argmax(axis=0) if (shares.max(axis=0) > _CLEAR).all() else None


def _rolled_over(groups: Ints, k: Ints, diagonal: Floats) -> NDArray[np.bool_]:
    """Functions that SPCAT removes from the matrix: in each group all from the first whose diagonal element falls."""
    apart = np.zeros(len(k), dtype=bool)
    for group in np.unique(groups):
        members = np.flatnonzero(groups == group)
        members = members[np.argsort(k[members], kind="stable")]  # stable: components of one K keep their order
        first = max(_FIRST_LOOKED_AT - int(k[members[0]]), 0) // 2
        falls = np.flatnonzero(np.diff(diagonal[members[first:]]) < 0)
        if len(falls):
            apart[members[first + falls[0] + 1 :]] = True
    return apart
