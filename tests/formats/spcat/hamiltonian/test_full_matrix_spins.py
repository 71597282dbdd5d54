"""The coupled basis of `full_matrix.py` against a direct product: Cartesian components, QuTiP's spins, every m written out.

Nothing is coupled there: |N k m⟩ for N up to a limit, times |m_S⟩ of each spin. The direction cosines multiply out in a
basis with one N more, so that products are exact below.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
import qutip
from direct_product import on_spins, rotor_matrix, space_cosines, states_up_to
from full_matrix import block, cartesian, pieces
from full_matrix_codes import Case, case_of
from full_matrix_rotor import wigner_3j, wigner_6j, wigner_9j

from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.par import read_par

RIGID = ((10000, 9400.0), (20000, 3100.0), (30000, 2500.0), (1100, 2.0), (41000, -0.3))


def _case(options: str, *parameters: tuple[int, float]) -> Case:
    lines = "".join(f"{code} {value!r} 1.0\n" for code, value in parameters)
    par = read_par(f"a case\n{len(parameters)} 1 1 0 0.0 1e6 1.0 1.0\n{options}\n{lines}".encode())
    return case_of(par, read_int(b"a case\n0 999 1000.0 0 9 -30 -30 9999.99 300.0\n"))


def _direct(case: Case, top: int) -> np.ndarray:
    """The Hamiltonian of one state, N ≤ top, in the direct product."""
    spins2, wide = case.states[0].spins2, len(states_up_to(top + 1))
    keep = [i for i, s in enumerate(states_up_to(top + 1)) if s[0] <= top]
    phi, momentum = space_cosines(top + 1), {axis: rotor_matrix(axis, top + 1) for axis in "abc"}
    squared = sum(m @ m for m in momentum.values())
    spin = {(i, p): qutip.jmat(s / 2, p).full() for i, s in enumerate(spins2, 1) for p in "xyz"}
    total = 0.0
    for term in case.terms:
        n2, k2 = (
            np.linalg.matrix_power(squared, term.n2),
            np.linalg.matrix_power(momentum["a"] @ momentum["a"], term.k2),
        )
        for c, parts in _operator(term, phi, momentum, spin, spins2, wide):
            rotor = (k2 @ c + c @ k2) / 2
            rotor = (n2 @ rotor + rotor @ n2) / 2
            total = total + term.value * on_spins(rotor[np.ix_(keep, keep)], spins2, parts)
    return total


def _operator(term, phi, momentum, spin, spins2, wide):
    """The operator as a list of (rotor matrix, {spin: matrix})."""
    c = cartesian(term.kind, "a")
    axes = [(i, j) for i in range(3) for j in range(3) if c[i, j]]
    if not term.spins:
        if term.kind == 0:
            return [(np.eye(wide), {})]
        return [(c[i, j] * momentum["abc"[i]] @ momentum["abc"[j]], {}) for i, j in axes]
    if len(term.spins) == 1:
        (item,) = term.spins
        anti = lambda p, i, j: (phi[p, "abc"[i]] @ momentum["abc"[j]] + momentum["abc"[j]] @ phi[p, "abc"[i]]) / 2  # noqa: E731
        return [(c[i, j] * anti(p, i, j), {item: spin[item, p]}) for p in "xyz" for i, j in axes]
    item, two = term.spins
    if term.kind:
        c = c - np.eye(3) * np.trace(c) / 3
        axes = [(i, j) for i in range(3) for j in range(3) if c[i, j]]
    results = []
    for p, q in product("xyz", repeat=2):
        cosines = sum(c[i, j] * phi[p, "abc"[i]] @ phi[q, "abc"[j]] for i, j in axes)
        if item == two:
            size = spins2[item - 1] / 2
            both = (spin[item, p] @ spin[item, q] + spin[item, q] @ spin[item, p]) / 2
            results.append((cosines, {item: both / (2 * size * (2 * size - 1))}))
        elif term.kind or p == q:
            results.append((cosines if term.kind else np.eye(wide), {item: spin[item, p], two: spin[two, q]}))
    return results


def _coupled(case: Case, top: int) -> np.ndarray:
    """The same levels, F by F, each counted 2F + 1 times."""
    spins2, energies = case.states[0].spins2, []
    for f2 in range(sum(spins2) % 2, 2 * top + sum(spins2) + 1, 2):
        basis = pieces(case.states, f2)
        if basis:
            _, functions, hamiltonian, _ = block(case, f2)
            keep = [i for i, f in enumerate(functions) if basis[f.piece].n <= top]
            energies += np.linalg.eigvalsh(hamiltonian[np.ix_(keep, keep)]).repeat(f2 + 1).tolist()
    return np.sort(energies)


QUADRUPOLE = ((110010000, -85.5), (110040000, -1.05), (110610000, 60.3), (110410000, -8.2), (110210000, 5.5))
SPIN_ROTATION = (
    (10010000, 30.0),
    (10020000, -12.0),
    (10030000, 9.0),
    (10610000, 5.0),
    (10410000, -3.0),
    (10210000, 2.0),
)
CASES = {
    "chi off the diagonal, I = 3/2": ("a 4", *QUADRUPOLE),
    "spin-rotation off the diagonal, S = 1/2, with its distortion": (
        "a 2", *SPIN_ROTATION, (10000000, 50.0), (10000100, -1.5), (10001000, 2.5), (10011000, 0.7)),
    "two nuclei, 3/2 and 1, with their spin-spin": (
        "a 34", *QUADRUPOLE, (220010000, 2.9), (220610000, 1.1), (120000000, 3.0), (120010000, -7.0), (120040000, 2.0), (120610000, 4.0)),
    "doublet with I = 1: Fermi contact, dipolar, quadrupole": (
        "a 32", *SPIN_ROTATION, (120000000, 140.0), (120010000, 60.0), (120040000, -17.0), (120210000, 8.0),
        (220010000, 5.1), (220040000, -1.4)),
    "triplet: spin-spin, spin-rotation": ("a 3", (110010000, 59000.0), (110040000, 900.0), (110610000, 300.0), (10000000, -250.0)),
    "triplet with I = 1/2": ("a 23", (110010000, 59000.0), (10000000, -250.0), (120000000, 90.0), (120010000, 33.0), (20010000, 1.0)),
    "three nuclei, 1/2, 1 and 1/2": (
        "a 232", (10010000, 3.0), (30020000, -2.0), (220010000, 2.9), (220610000, 1.1), (130010000, -40.0), (120040000, 6.0),
        (230610000, 11.0), (130000000, 5.0), (230000000, -4.0)),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_direct_product(name):
    """Levels of N ≤ 2 (≤ 1 for three spins), each parameter of a size that is seen in the others' presence."""
    spins, *parameters = CASES[name]
    case = _case(f"{spins} 1 0 20 0 1 1 1 0 1 0", *RIGID, *parameters)
    top = 2 if len(case.states[0].spins2) < 3 else 1
    slow = np.linalg.eigvalsh(_direct(case, top))
    size = np.abs(slow).max()
    np.testing.assert_allclose(
        _coupled(case, top), slow, rtol=0, atol=1e-13 * size + 1e-9
    )  # rounding of a few hundred sums


@pytest.mark.parametrize("name", CASES)
def test_each_parameter_counts(name):
    """Negative control: the sign of one parameter turned moves the levels by more than the tolerance."""
    spins, *parameters = CASES[name]
    case = _case(f"{spins} 1 0 20 0 1 1 1 0 1 0", *RIGID, *parameters)
    for at, (code, value) in enumerate(parameters):
        other = [*parameters[:at], (code, 1.1 * value), *parameters[at + 1 :]]
        moved = _coupled(_case(f"{spins} 1 0 20 0 1 1 1 0 1 0", *RIGID, *other), 1)
        assert np.abs(moved - _coupled(case, 1)).max() > 1e-6, code


def casimir(f: float, i: float, n: int) -> float:
    """Y(I, N, F) of E = -eqQ Y (J. Casimir 1936; Gordy and Cook, Microwave Molecular Spectra, eq. 9.4)."""
    c = f * (f + 1) - i * (i + 1) - n * (n + 1)
    return (0.75 * c * (c + 1) - i * (i + 1) * n * (n + 1)) / (2 * (2 * n - 1) * (2 * n + 3) * i * (2 * i - 1))


@pytest.mark.parametrize("spin2", [2, 3, 5, 7])
def test_a_linear_molecule_has_casimir_energies_in_first_order(spin2):
    """A linear molecule in first order: the diagonal elements of each N are -eqQ Y."""
    case = _case(f"l -{spin2 + 1} 1 0 0 0 1 1 1 0 1 0", (100, 1e5), (110010000, 1.5 * -4.0))
    for f2 in range(spin2 % 2, 14, 2):
        basis, functions, hamiltonian, _ = block(case, f2)
        for at, function in enumerate(functions):
            n = basis[function.piece].n
            if n:
                expected = 1e5 * n * (n + 1) + 4.0 * casimir(f2 / 2, spin2 / 2, n)
                assert hamiltonian[at, at].real == pytest.approx(expected, abs=1e-8)  # 1e-15 of 1e7 MHz


def test_centre_of_gravity():
    """Terms of quadrupole and spin-spin leave the mean of an N, over all F, where it is."""
    case = _case("a 34 1 0 20 0 1 1 1 0 1 0", *QUADRUPOLE, (220010000, 2.9), (120010000, -7.0))
    total = dict.fromkeys(range(5), 0.0)
    for f2 in range(1, 2 * 4 + 6, 2):
        basis, functions, hamiltonian, _ = block(case, f2)
        for at, function in enumerate(functions):
            n = basis[function.piece].n
            if n in total:
                total[n] += (f2 + 1) * hamiltonian[at, at].real
    np.testing.assert_allclose(list(total.values()), 0.0, atol=1e-9)  # sums of a hundred numbers of 1e2 MHz


def test_symbols_of_3_6_and_9_j_are_orthogonal_and_symmetric():
    """3j, 6j and 9j: known values, orthogonality, symmetry."""
    assert wigner_3j(2, 2, 0, 0, 0, 0) == pytest.approx(-(3**-0.5), abs=1e-15)
    assert wigner_6j(2, 2, 2, 2, 2, 2) == pytest.approx(1 / 6, abs=1e-15)
    for f in (1, 3, 5, 7):  # Σ_x (x + 1)(f + 1) {3 4 x; 3 4 f}² = 1
        assert sum((x + 1) * (f + 1) * wigner_6j(3, 4, x, 3, 4, f) ** 2 for x in range(8)) == pytest.approx(
            1.0, abs=1e-14
        )
    rows = ((2, 3, 5), (2, 1, 3), (4, 4, 4))
    assert abs(wigner_9j(rows)) > 1e-3
    assert wigner_9j(rows) == pytest.approx(wigner_9j(tuple(zip(*rows, strict=True))), abs=1e-15)
