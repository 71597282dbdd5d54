"""Spin terms of more than second order against a direct product: TYP by TYP, one N or two replaced by spins in every order of the factors.

|v⟩ x |N k m⟩ x |m_S⟩ x ..., N up to 3; levels whose F holds no higher N are exact.
"""

from __future__ import annotations

from functools import cache
from itertools import permutations

import numpy as np
import pytest
import qutip
from direct_product import on_spins, rotor_matrix, space_cosines, states_up_to

from rotor.formats.spcat.file_model import connected_groups
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.par import read_par

TOP = 3
RIGID = {"a": 9400.0, "b": 3100.0, "c": 2500.0}
APART = 1500.0


def _ours(spind: str, oblate: bool, code: int, value: float) -> list[tuple[int, np.ndarray]]:
    rigid = "10099 9400.0 1\n20099 3100.0 1\n30099 2500.0 1\n11 1500.0 1\n"
    option = f"a {spind} {'-' if oblate else ''}2 0 9 0 1 1 1 0 1 0"
    par = read_par(
        f"two\n9 1 1 0 0.0 1e6 1.0 1.0\n{option}\n{rigid}200001 30.0 1\n910000 0.13 1\n910011 0.21 1\n{code} {value} 1\n".encode()
    )
    request = read_int(b"two\n0 999 1000.0 0 3 -30 -30 9999.99 300.0\n11 1.0\n")
    (group,) = connected_groups(par, request)
    total = sum(int(size) - 1 for size in spind)
    last = 2 * TOP - total
    levels = group.levels((total % 2, last))
    return [(f2, levels.energy_mhz[levels.multiplicity == f2 + 1]) for f2 in range(total % 2, last + 1, 2)]


@cache
def _n() -> dict[str, np.ndarray]:
    return {axis: rotor_matrix(axis, TOP + 1) for axis in "abc"}


def _factors(spins2: tuple[int, ...], which: tuple[int, ...]):
    """N_i (0) or φ_i·S (number of the spin) over all functions, i = a, b, c, N up to TOP + 1."""
    results = {}
    for axis in "abc":
        results[0, axis] = on_spins(_n()[axis], spins2, {})
        for place in which:
            spin = (
                qutip.jmat(spins2[place - 1] / 2, "x"),
                qutip.jmat(spins2[place - 1] / 2, "y"),
                qutip.jmat(spins2[place - 1] / 2, "z"),
            )
            results[place, axis] = sum(
                on_spins(space_cosines(TOP + 1)[p, axis], spins2, {place: matrix.full()})
                for p, matrix in zip("xyz", spin, strict=True)
            )
    return results


def _replaced(letters: list[dict[str, complex]], spins2: tuple[int, ...], which: tuple[int, ...]) -> np.ndarray:
    """The product of components of N, `which` spins in place of some of them, the mean over all orders and places."""
    of, total, count = _factors(spins2, which), 0.0, 0
    kinds = [*which, *(0 for _ in letters[len(which) :])]
    for order in set(permutations(kinds)):
        for value in permutations(range(len(letters))):
            product = None
            for kind, at in zip(order, value, strict=True):
                factor = sum(c * of[kind, axis] for axis, c in letters[at].items())
                product = factor if product is None else product @ factor
            total, count = total + product, count + 1
    return total / count


def _typ(typ: int, oblate: bool, spins2: tuple[int, ...], which: tuple[int, ...]) -> np.ndarray:
    """The operator of a TYP between two states, the factor i of odd ones with it."""
    i = -1j if oblate else 1j
    x, y, z = ("a", "b", "c") if oblate else ("c", "b", "a")
    # L, K, + of E + E† or - of (E - E†)/i, and the factor of (E ± E†) or of Z (E ± E†)
    order, k, sign, factor = {
        (12, False): (3, 2, -1, np.sqrt(6)), (12, True): (3, 2, -1, np.sqrt(6)),
        (22, False): (3, 2, 1, np.sqrt(6) / 2), (22, True): (3, 3, 1, 0.5),
        (42, False): (3, 3, -1, 0.5), (42, True): (3, 3, -1, 0.5), (62, False): (3, 3, 1, 0.5), (62, True): (3, 2, 1, np.sqrt(6) / 2),
    }[typ, oblate]  # fmt: skip
    extra = [{z: 1.0}] * (order - k)
    up, down = (_replaced([{x: 1.0, y: s * 1j}] * k + extra, spins2, which) for s in (1, -1))
    return i * factor * (up + down if sign > 0 else -1j * (up - down))


def _direct(spins2: tuple[int, ...], oblate: bool, operator: np.ndarray, value: float) -> np.ndarray:
    rigid = sum(b * _n()[axis] @ _n()[axis] for axis, b in RIGID.items())
    keep = np.array([s[0] <= TOP for s in states_up_to(TOP + 1)])
    whole = np.flatnonzero(np.kron(keep, np.ones(int(np.prod([s + 1 for s in spins2])))) > 0)
    inner = np.ix_(whole, whole)
    coriolis = (-1j if oblate else 1j) * 30.0 * on_spins(_n()["a"], spins2, {})
    across = (coriolis + value * operator)[inner]
    first = on_spins(rigid, spins2, {})[inner]
    return np.linalg.eigvalsh(np.block([[first, across], [across.conj().T, first + APART * np.eye(len(first))]]))


@pytest.mark.slow
@pytest.mark.parametrize("oblate", [False, True])
@pytest.mark.parametrize("typ", [12, 22, 42, 62])
def test_spin_terms_of_third_order(typ, oblate):
    code = 10_000_001 + 10_000 * typ
    _compare("2", oblate, code, 3.0, _direct((1,), oblate, _typ(typ, oblate, (1,), (1,)), 3.0))


@pytest.mark.parametrize("oblate", [False, True])
def test_a_spin_in_place_of_one_of_four_n(oblate):
    """TYP 5 with one spin, d2 of spin-rotation in the S reduction: N₊³S₊ + N₋³S₋."""
    x, y = ("b", "a") if oblate else ("b", "c")
    of, total = _factors((1,), (1,)), 0.0
    for sign in (1, -1):
        n, s = (of[kind, x] + sign * 1j * of[kind, y] for kind in (0, 1))
        total = total + n @ n @ n @ s
    _compare("2", oblate, 10_050_001, 3.0, _direct((1,), oblate, total, 3.0))


def _compare(spind: str, oblate: bool, code: int, value: float, slow: np.ndarray) -> None:
    moved = 0.0
    for (f2, energies), (_, without) in zip(
        _ours(spind, oblate, code, value), _ours(spind, oblate, code, 0.0), strict=True
    ):
        for energy in energies:
            assert (np.abs(slow - energy) < 1e-8).sum() >= f2 + 1  # 1e-14 of 1e5 MHz times some hundred sums
        moved = max(moved, np.abs(np.sort(energies) - np.sort(without)).max())
    assert moved > 1e-3  # the term counts


def test_spin_rotation_times_a_fourier_term():
    """Half the anticommutator of φ_b and N_b with S, each element from k'' to k' times cos(2π (ρ'k' + ρ''k'')/6)."""
    of = _factors((1,), (1,))
    plain = (of[1, "b"] @ of[0, "b"] + of[0, "b"] @ of[1, "b"]) / 2
    k = np.repeat([s[1] for s in states_up_to(TOP + 1)], 2)
    cosine = np.cos(2 * np.pi / 6 * (0.13 * k[:, None] + 0.21 * k[None, :]))
    _compare("2", False, 1_010_020_001, 30.0, _direct((1,), False, plain * cosine, 30.0))
