"""l-doubled states of SPFIT's files against the plain matrix over signed k and l, and the symmetry that remains."""

from __future__ import annotations

import numpy as np
import pytest
from full_matrix_rotor import momenta

from rotor.formats.spcat.file_model import connected_groups
from rotor.formats.spcat.hamiltonian.l_doubled import Pair, l_doubled_pairs
from rotor.formats.spcat.hamiltonian.states import file_states
from rotor.formats.spcat.predict import predict
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.par import read_par

OPTIONS = "s -1 3 0 20 0 6 2 2 -1 1 1\ns -1 1 0 20 0 6 2 2 -1 101 1\ns -1 2 0 20 0 6 2 2 0 201 1\n"
A_MINUS_B, B, DJ, DJK, DK, E8, ZETA, Q22, Q12, W1 = (
    148900.0,
    9198.9,
    3.8e-3,
    0.177,
    2.83,
    3.0e5,
    -277854.0,
    8.9,
    1.7,
    41.0,
)
COMMON = ((1099, A_MINUS_B), (199, B), (299, -DJ), (1199, -DJK), (2099, -DK), (11, E8), (200011, ZETA))
PAIR = ((40012, Q22), (410021, Q12))  # Δk = Δl = 2; Δk = 1, Δl = -2, V2 > V1 as written
TO_GROUND = ((400001, W1),)  # a Coriolis term Nb with Δk = Δl = 1


def _file(parameters, options=OPTIONS):
    lines = "".join(f"{code} {value!r} 0\n" for code, value in parameters)
    return read_par(f"a case\n {len(parameters)} 1 1 0 0 1e6 1 1\n{options}{lines}".encode())


def _wanted(fend=5):
    return read_int(f"a case\n0 41 14000 0 {fend} -30 -30 99999 300\n 001 3.92\n 111 3.92\n".encode())


def full_matrix(j: int, pair: bool, to_ground: bool) -> np.ndarray:
    """The Hamiltonian over v = 0, l = + and l = - times |k⟩, k = -J ... J; Na, Nb, Nc of [Na, Nb] = -i Nc."""
    of = momenta(j, "a")
    a, b, c = (of[axis] for axis in "abc")
    square, size = j * (j + 1.0), 2 * j + 1
    identity = np.eye(size)
    rotor = (
        B * square * identity
        + A_MINUS_B * a @ a
        - DJ * square**2 * identity
        - DJK * square * a @ a
        - DK * a @ a @ a @ a
    )
    up = b - 1j * c  # raises k
    down = up.conj().T
    zero = np.zeros((size, size), complex)
    plus_minus = zero
    if pair:
        cross = a @ c + c @ a  # TYP 41; between l and -l its lowering part with Δl = +2, Δk Δl < 0
        raising = np.tril(cross, -1)  # rows are k + 1
        plus_minus = Q22 * up @ up + Q12 * (cross - raising)
    to_plus = 1j * W1 * up / 2 if to_ground else zero  # ⟨v|i Nb|0⟩, its part that raises k
    to_minus = 1j * W1 * down / 2 if to_ground else zero
    blocks = [
        [rotor, to_plus.conj().T, to_minus.conj().T],
        [to_plus, rotor + E8 * identity + ZETA * a, plus_minus],
        [to_minus, plus_minus.conj().T, rotor + E8 * identity - ZETA * a],
    ]
    return np.block(blocks)


@pytest.mark.parametrize(("pair", "ground"), [(False, False), (True, False), (False, True), (True, True)])
def test_levels_are_those_of_signed_k_and_l(pair, ground):
    parameters = COMMON + PAIR * pair + TO_GROUND * ground
    groups = connected_groups(_file(parameters), _wanted(), as_spcat=True)
    energies = {j: [] for j in range(6)}
    for group in groups:
        levels = group.levels((0, 10))
        count = levels.components  # of a state whose K is good ±K is one row
        for j, energy, times in zip(
            levels.rotational.tolist(), levels.energy_mhz.tolist(), count.tolist(), strict=True
        ):
            energies[j] += [energy] * times
    for j in range(6):
        slow = np.linalg.eigvalsh(full_matrix(j, pair, ground))
        np.testing.assert_allclose(
            np.sort(energies[j]), slow, rtol=0, atol=1e-9 + 1e-14 * np.abs(slow).max()
        )  # round-off


def test_l_doubled_labels_name_each_k_once_with_each_parity():
    """K l > 0 in the first state, K l ≤ 0 in the second, each K once with each parity; E levels without a sign."""
    levels = predict(_file(COMMON + PAIR), _wanted(), as_spcat=True).levels
    for j in range(6):
        quanta = [tuple(q[1:]) for q in levels.quanta.tolist() if q[0] == j]
        for v, lowest in ((1, 1), (2, 0)):
            ks = sorted(abs(k) for k, state in quanta if state == v)
            assert ks == sorted([*range(lowest, j + 1)] * 2)
        signed = {(k, v) for k, v in quanta if k < 0}
        assert signed == {(-k, v) for v in (0, 1, 2) for k in range(1, j + 1) if (k - v) % 3 == 0}
    energy = {tuple(q): e * 29979.2458 for q, e in zip(levels.quanta.tolist(), levels.energy_cm, strict=True)}
    assert energy[4, 1, 1] - energy[4, -1, 1] != pytest.approx(0.0, abs=1.0)  # l-type doubling of K l = 1
    assert abs(energy[4, 1, 1] - energy[4, -1, 1]) == pytest.approx(
        2 * Q22 * 20.0, rel=0.01
    )  # 2 q N(N+1), other terms in second order
    assert energy[4, 2, 1] < energy[4, 2, 2]  # Aζ lowers K l > 0


def test_lines_of_a_degenerate_state():
    """J + 1 ← J of K l = 1 are 2 Q22 (J+1) on each side of those of K l = -1; μ is the same in both states."""
    catalogue = predict(_file(COMMON + PAIR), _wanted(), as_spcat=True).catalogue
    computed = {
        (*up[:3], *low[:3]): (f, s)
        for up, low, f, s in zip(
            catalogue.quanta_upper.tolist(),
            catalogue.quanta_lower.tolist(),
            catalogue.frequency_mhz,
            catalogue.lgint,
            strict=True,
        )
    }
    centre = computed[3, 1, 2, 2, 1, 2][0]
    outer = sorted(computed[key][0] for key in ((3, -1, 1, 2, 1, 1), (3, 1, 1, 2, -1, 1)))
    assert [x - centre for x in outer] == pytest.approx(
        [-6 * Q22, 6 * Q22], abs=0.2
    )  # second-order shifts of the centre


@pytest.mark.parametrize(
    ("options", "parameters", "says"),
    [
        ("s -1 2 0 20 0 6 2 2 -1 1 1\ns -1 1 0 20 0 6 2 2 0 101 1\n", COMMON[:2], "come in pairs"),
        (OPTIONS, (*COMMON, (600021, 3.0)), "time reversal"),
        (OPTIONS, (*COMMON, (400002, 3.0)), "K l ≤ 0"),
        (OPTIONS.replace("6 2 2", "10 2 2").replace("101", "301").replace("201", "301"), COMMON, "not of E species"),
    ],
)
def test_what_does_not_compute_is_named(options, parameters, says):
    with pytest.raises(ValueError, match=says):
        connected_groups(_file(parameters, options), _wanted())


def test_the_program_passes_over_parameters_of_the_second_state():
    plain, more = (
        predict(_file(p), _wanted(2), as_spcat=True).levels.energy_cm
        for p in (COMMON + PAIR, (*COMMON, *PAIR, (22, 5e4)))
    )
    np.testing.assert_array_equal(plain, more)


def test_pairs_are_found_by_their_codes():
    assert l_doubled_pairs(file_states(_file(COMMON))) == [Pair(1, 2)]
    turned = OPTIONS.replace("-1 101", "-1 201x").replace("0 201 ", "0 101 ").replace("201x", "201")
    assert l_doubled_pairs(file_states(_file(COMMON, turned))) == [Pair(2, 1)]
