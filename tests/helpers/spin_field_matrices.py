"""Full matrices of one spin in an electric field, over all M."""

from __future__ import annotations

import functools

import numpy as np
import qutip
from direct_product import on_spins, rotor_matrix, space_cosines, states_up_to

from rotor.quantum.effects.zeeman import MHZ_PER_T2
from rotor.units import MHZ_PER_DEBYE_KV_PER_CM, NUCLEAR_MAGNETON_MHZ_PER_T

DIPOLE = np.array([1.0, 0.7, -0.4])

CHI = np.array([[-4.0, 1.5, 0.3], [1.5, 2.5, -0.8], [0.3, -0.8, 1.5]])

G = np.array([[0.6, 0.1, 0.0], [0.1, -0.2, 0.05], [0.0, 0.05, 0.3]])

LARGEST = 3


def full_matrix(
    constants,
    twice_i: int,
    chi,
    *,
    kv_per_cm: float = 0.0,
    dipole=DIPOLE,
    tesla: float = 0.0,
    g=G,
    g_i: float = 0.0,
    x=None,
) -> np.ndarray:
    """Everything over |N k m⟩|m_I⟩, N ≤ 3; the cosines multiply out with one N more."""
    wide = states_up_to(LARGEST + 1)
    held = np.ix_(*[[i for i, state in enumerate(wide) if state[0] <= LARGEST]] * 2)
    phi, i = _cosines(), twice_i / 2
    spin = {p: qutip.jmat(i, p).full() for p in "xyz"}
    momenta = {axis: rotor_matrix(axis, LARGEST + 1) for axis in "abc"}
    rotor = sum(b * momenta[axis] @ momenta[axis] for b, axis in zip(constants, "abc", strict=True))
    rotor = rotor - kv_per_cm * MHZ_PER_DEBYE_KV_PER_CM * sum(dipole[k] * phi["z", "abc"[k]] for k in range(3))
    for k, first in enumerate("abc"):
        for n, second in enumerate("abc"):
            moment = (phi["z", first] @ momenta[second] + momenta[second] @ phi["z", first]) / 2
            rotor = rotor - tesla * NUCLEAR_MAGNETON_MHZ_PER_T * g[k, n] * moment
        if x is not None:
            rotor = rotor - tesla**2 * MHZ_PER_T2 / 2 * x[k, k] * phi["z", first] @ phi["z", first]
    total = on_spins(rotor[held], (twice_i,), {})
    total = total - on_spins(
        np.eye(held[0].size), (twice_i,), {1: tesla * NUCLEAR_MAGNETON_MHZ_PER_T * g_i * spin["z"]}
    )
    for p in "xyz":
        for q in "xyz" if twice_i > 1 else "":
            both = (spin[p] @ spin[q] + spin[q] @ spin[p]) / (4 * i * (2 * i - 1))
            computed = sum(chi[k, n] * phi[p, "abc"[k]] @ phi[q, "abc"[n]] for k in range(3) for n in range(3))
            total = total + on_spins(computed[held], (twice_i,), {1: both})
    return total


@functools.cache
def _cosines():
    return space_cosines(LARGEST + 1)


def every_state(computed, count: int) -> np.ndarray:
    """The lowest energies at the last field, each as often as it exists."""
    last = computed.field == computed.field.max()
    return np.sort(np.repeat(computed.energy_mhz[last], computed.copies[last]))[:count]
