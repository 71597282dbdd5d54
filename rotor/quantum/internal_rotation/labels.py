"""Labels of torsion-rotation levels: v_t, and K or Ka and Kc, one to one.

A block with n_0 functions of t = 0 has n_0 states of v_t = 0: those with the largest weight of these functions. v_t = 1 follows from the
rest in the same way, and so on. Inside one v_t the state of rank n by energy takes K of the function of rank n by zeroth-order energy,
⟨J K t|H|J K t⟩ without the coupling of K and -K. Where these energies rise with K this is the rule of a rigid top, K counted by energy.
Where they do not (methanol), labels follow the torsional curves; largest coefficients would change at each avoided crossing. E levels of a
nearly free top take the signed K of largest weight, one to one, because their curves cross without interaction.

Kc of levels with σ = 0 follows from parity: C2 about the axis across the plane of symmetry is s p (-1)^J, p the parity of the torsional
function at K = 0; it is (-1)^Kc for the axis c, (-1)^(Ka + Kc) for b. E levels have signed K; the lower level of a pair ±K is called
Kc = J - K + 1, the upper Kc = J - K, as at a high barrier, where they are the levels of a rigid top.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.wang.coupled_levels import match_names


def torsional_numbers(vectors: NDArray[np.generic], t: Ints, vt_max: int) -> Ints:
    """v_t up to `vt_max` of the states of one block, -1 of others, from vectors (functions, states) and t (functions,).

    A block may be solved for its lowest states only.
    """
    members = (np.arange(vt_max + 1)[:, None] == t).astype(float)
    shares = members @ np.abs(vectors) ** 2
    numbers = np.full(vectors.shape[1], -1)
    for v, (share, count) in enumerate(zip(shares, members.sum(axis=1).astype(int).tolist(), strict=True)):
        free = np.flatnonzero(numbers < 0)
        numbers[free[np.argsort(-share[free], kind="stable")[:count]]] = v
    return numbers


def functions_of_states(numbers: Ints, t: Ints, vectors: NDArray[np.generic], zeroth_order: Floats | None) -> Ints:
    """The function (number in its block) that labels each state, -1 without v_t, one to one inside v_t = t.

    States and functions have equal ranks by energy; without energies of zeroth order the overlaps are largest.
    """
    names = np.full(len(numbers), -1)
    for v in np.unique(numbers[numbers >= 0]).tolist():
        states, functions = np.flatnonzero(numbers == v), np.flatnonzero(t == v)
        if zeroth_order is not None:
            order = np.argsort(zeroth_order[functions], kind="stable")
        else:
            overlaps = np.zeros((len(functions), len(functions)))
            overlaps[:, : len(states)] = np.abs(vectors[np.ix_(functions, states)]) ** 2
            order = match_names(overlaps)
        names[states] = functions[order[: len(states)]]
    return names


def counted_ka_kc(j: Ints, v: Ints, energies: Floats) -> tuple[Ints, Ints]:
    """Ka and Kc by energy inside each v_t of each J, as in a rigid prolate top: J(0,J), J(1,J), J(1,J-1), ... for either species.

    Ka is K of levels with σ = 0 as BELGI counts it.
    """
    order = np.lexsort([energies, v, j])
    starts = np.flatnonzero((np.diff(j[order], prepend=-1) != 0) | (np.diff(v[order], prepend=-1) != 0))
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order)) - np.repeat(starts, np.diff(np.append(starts, len(order))))
    ka = (rank + 1) // 2
    return ka, j - ka + rank % 2


def kc_of_parity(j: Ints, k: Ints, parity: Ints) -> Ints:
    """Kc of levels with σ = 0 from K ≥ 0 and the parity s p: J - K or J - K + 1, whichever has (-1)^Kc = s p (-1)^J.

    >>> kc_of_parity(np.array([2, 2, 2]), np.array([0, 1, 1]), np.array([1, 1, -1])).tolist()
    [2, 2, 1]
    """
    lower = j - k
    wrong = np.where((lower - j) % 2, -1, 1) != parity
    return np.where(wrong, lower + 1, lower)


def kc_of_pairs(keys: Mapping[str, Ints], k: Ints, energies: Floats) -> Ints:
    """Kc of levels with signed K: the lower of two levels ±K with equal keys (J, v_t) has J - |K| + 1."""
    j = keys["J"]
    size = np.abs(k)
    kc = np.where(k == 0, j, j - size)
    order = np.lexsort([energies, size, *keys.values()])
    same = np.ones(len(order) - 1, dtype=bool)
    for column in (*keys.values(), size):
        same &= column[order][1:] == column[order][:-1]
    first = np.flatnonzero(same)  # the lower level of each pair
    lower = order[first]
    kc[lower] = j[lower] - size[lower] + 1
    return kc
