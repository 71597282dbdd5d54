"""Levels of `solve_levels` with spins against direct products of the rotation and QuTiP's spin operators, every m written out.

Nothing is coupled, contracted or labelled in the direct product: |N k m⟩ for N ≤ 3 times |m_S⟩ of each spin. Its states of one F are those
of M = F that F₊ annihilates; they are complete in N for F up to 3 less the sum of the spins.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
import qutip
from direct_product import on_spins, rotor_matrix, space_cosines, states_up_to
from scipy.linalg import block_diag, null_space

from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.solve import solve_levels
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.top import Top

TOP_N = 3
ABC = (9400.0, 3100.0, 2500.0)
TENSORS = {  # symmetric but one of spin-rotation; chi, T and D traceless
    "large": np.array([[-57.0, 60.3, 5.5], [60.3, 26.4, -8.2], [5.5, -8.2, 30.6]]),
    "small": np.array([[1.93, 1.1, -0.4], [1.1, -3.0, 0.7], [-0.4, 0.7, 1.07]]),
    "dipolar": np.array([[-4.7, 4.0, 1.5], [4.0, 3.0, -2.0], [1.5, -2.0, 1.7]]),
    "electron": np.array([[300.0, 45.0, -12.0], [45.0, -120.0, 9.0], [-12.0, 9.0, 90.0]]),
    "skew": np.array([[300.0, 245.0, -112.0], [-155.0, -120.0, 99.0], [88.0, -81.0, 90.0]]),
    "triplet": np.array([[5900.0, 300.0, 80.0], [300.0, -2500.0, 40.0], [80.0, 40.0, -3400.0]]),
}
CASES = {  # spins, one-spin terms (kind, spin, tensor), two-spin terms (spins, scalar, tensor)
    "two nuclei, 3/2 and 1": ({"35Cl": 3, "14N": 2}, [("chi", "35Cl", "large"), ("chi", "14N", "small"), ("C", "35Cl", "dipolar")],
                              [("35Cl", "14N", 3.0, "dipolar")]),
    "three nuclei, 1, 1/2 and 1/2": ({"14N": 2, "1H": 1, "19F": 1}, [("chi", "14N", "small"), ("C", "1H", "dipolar")],
                                     [("14N", "1H", 5.0, "dipolar"), ("1H", "19F", -4.0, "small")]),
    "S = 1/2 and I = 1": ({"S": 1, "14N": 2}, [("eps", "S", "electron"), ("chi", "14N", "small")], [("S", "14N", 140.0, "dipolar")]),
    "S = 1/2, the two orders unlike": ({"S": 1}, [("eps", "S", "skew")], []),
    "I = 1, the two orders unlike": ({"14N": 2}, [("chi", "14N", "small"), ("C", "14N", "skew")], []),
    "S = 1 and I = 1/2": ({"S": 2, "1H": 1}, [("D", "S", "triplet"), ("eps", "S", "electron")], [("S", "1H", 90.0, "dipolar")]),
}  # fmt: skip


def _named(name: str) -> SpinConstants:
    twice, singles, pairs = CASES[name]
    values = {}
    for kind, spin, tensor in [*singles, *(("T", f"{first},{two}", t) for first, two, _, t in pairs)]:
        m = TENSORS[tensor]
        for i, k in ((0, 1), (0, 2), (1, 2)):
            values[f"{kind}_{'abc'[i]}{'abc'[k]}({spin})"] = m[i, k]
            if m[k, i] != m[i, k]:
                values[f"{kind}_{'abc'[k]}{'abc'[i]}({spin})"] = m[k, i]
        for i in range(3):
            values[f"{kind}_{'abc'[i] * 2}({spin})"] = m[i, i]
    for first, two, scalar, _ in pairs:
        values[f"{'b_F' if first == 'S' else 'J'}({first},{two})"] = scalar
    return SpinConstants(values, twice)


def _operators(twice: dict[str, int]):
    """The rotor's φ and N cut at N ≤ 3, spins, and F₊ and M in the direct product."""
    states = states_up_to(TOP_N + 1)
    keep = np.array([i for i, s in enumerate(states) if s[0] <= TOP_N])
    space = {p: block_diag(*(np.kron(np.eye(2 * n + 1), _ascending(n, p)) for n in range(TOP_N + 1))) for p in "+z"}
    spin = {(at, p): qutip.jmat(two / 2, p).full() for at, two in enumerate(twice.values(), 1) for p in "xyz+"}
    sizes = tuple(twice.values())
    raising = on_spins(space["+"], sizes, {})
    projection = on_spins(space["z"], sizes, {})
    for at in range(1, len(sizes) + 1):
        raising = raising + on_spins(np.eye(len(keep)), sizes, {at: spin[at, "+"]})
        projection = projection + on_spins(np.eye(len(keep)), sizes, {at: spin[at, "z"]})
    return keep, spin, raising, np.diag(projection).real.round(6)


def _ascending(n: int, p: str) -> np.ndarray:
    """QuTiP's matrix with m rising, as the states of the direct product have it."""
    return qutip.jmat(n, p).full()[::-1, ::-1] if n else np.zeros((1, 1))


def _direct(name: str, twice_f: int) -> tuple[np.ndarray, float]:
    """Energies of one F, and the largest energy of all."""
    twice, singles, pairs = CASES[name]
    sizes, names = tuple(twice.values()), list(twice)
    keep, spin, raising, projection = _operators(twice)
    phi, n = space_cosines(TOP_N + 1), {axis: rotor_matrix(axis, TOP_N + 1) for axis in "abc"}
    cut = lambda matrix: matrix[np.ix_(keep, keep)]  # noqa: E731
    total = on_spins(cut(sum(x * n[axis] @ n[axis] for x, axis in zip(ABC, "abc", strict=True))), sizes, {})
    for kind, item, tensor in singles:
        at, m, size = names.index(item) + 1, TENSORS[tensor], twice[item] / 2
        if kind in ("C", "eps"):
            for p, i, j in product("xyz", range(3), range(3)):
                both = phi[p, "abc"[i]] @ n["abc"[j]] + n["abc"[j]] @ phi[p, "abc"[i]]
                total = total + m[i, j] / 2 * on_spins(cut(both), sizes, {at: spin[at, p]})
            continue
        scale = 1 / (2 * size * (2 * size - 1)) if kind == "chi" else 1.0
        for p, q in product("xyz", repeat=2):
            cosines = sum(m[i, j] * phi[p, "abc"[i]] @ phi[q, "abc"[j]] for i in range(3) for j in range(3))
            squares = (spin[at, p] @ spin[at, q] + spin[at, q] @ spin[at, p]) / 2
            total = total + scale * on_spins(cut(cosines), sizes, {at: squares})
    for item, two, scalar, tensor in pairs:
        a, b, m = names.index(item) + 1, names.index(two) + 1, TENSORS[tensor]
        for p, q in product("xyz", repeat=2):
            cosines = sum(m[i, j] * phi[p, "abc"[i]] @ phi[q, "abc"[j]] for i in range(3) for j in range(3))
            rotor = cut(cosines) + (scalar * np.eye(len(keep)) if p == q else 0.0)
            total = total + on_spins(rotor, sizes, {a: spin[a, p], b: spin[b, q]})
    here, above = (np.flatnonzero(np.abs(projection - m) < 1e-3) for m in (twice_f / 2, twice_f / 2 + 1))
    highest = null_space(raising[np.ix_(above, here)])
    block = highest.conj().T @ total[np.ix_(here, here)] @ highest
    return np.linalg.eigvalsh(block), float(np.abs(np.linalg.norm(total[np.ix_(here, here)], 2)))


SLOW = [pytest.param(name, marks=[] if "orders" in name else pytest.mark.slow) for name in CASES]


@pytest.mark.parametrize("name", SLOW)
def test_levels_are_those_of_a_direct_product_in_qutip(name):
    constants = _named(name)
    top = Top.from_constants(dict(zip("ABC", ABC, strict=True)), spin_constants=constants)
    levels = solve_levels(top, TOP_N, effects=effects_of(top, True))
    total, compared = sum(constants.twice.values()), 0
    for twice_f in range(total % 2, 2 * TOP_N - total + 1, 2):
        slow, size = _direct(name, twice_f)
        sorted_energies = np.sort(levels.energy_mhz[levels.multiplicity == twice_f + 1])
        assert len(sorted_energies) == len(slow)
        np.testing.assert_allclose(
            sorted_energies, slow, rtol=0, atol=1e-14 * size + 1e-9
        )  # round-off of energies up to 1e5 MHz
        compared += len(slow)
    assert compared >= 12


def test_a_difference_of_two_orders_moves_levels_and_its_sign_counts():
    """In second order, and in first beside the symmetric part of another element with the same ΔN."""
    energies = []
    for sign in (0.0, 1.0, -1.0):
        values = {"eps_aa(S)": 300.0, "eps_ab(S)": 45.0, "eps_ab-ba(S)": sign * 200.0}
        top = Top.from_constants(dict(zip("ABC", ABC, strict=True)), spin_constants=SpinConstants(values, {"S": 1}))
        energies.append(np.sort(solve_levels(top, TOP_N, effects=effects_of(top, True)).energy_mhz))
    assert min(np.abs(energies[i] - energies[k]).max() for i, k in ((0, 1), (0, 2), (1, 2))) > 0.5
