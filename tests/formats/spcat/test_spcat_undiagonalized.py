"""DIAG below 0: SPCAT's `hamx` copies the diagonal elements of each block as energies and takes unit vectors."""

from __future__ import annotations

import numpy as np
import pytest

from rotor.arrays import Floats
from rotor.formats.spcat.predict import Prediction, predict
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.par import read_par

A, B, C, CHI = 8000.0, 4000.0, 3000.0, -40.0


def _prediction(options: str, further: str = "", b: float = B, as_spcat: bool = False) -> Prediction:
    lines = f"10000 {A} 1e-9\n20000 {b} 1e-3\n30000 {C} 1e-9\n{further}"
    header = f"t\n {lines.count(chr(10))} 9 20 0 0.0 1.0e6 1.0 1.0\n"
    intensities = read_int(b"t\n0 1 1000.0 0 4 -30 -30 99999 300\n1 1.2\n3 0.5\n")
    return predict(read_par((header + options + "\n" + lines).encode()), intensities, as_spcat=as_spcat)


def _wang_diagonal(n: int, ka: int, kc: int, b: float = B) -> float:
    """<N K s|H|N K s> in I^r, with z = a: (B + C)/2 N(N+1) + (A - (B + C)/2) K^2; of K = 1 the term (B - C)/4 J_+^2 adds."""
    x, mean = n * (n + 1), (b + C) / 2
    asymmetry = (b - C) / 4 * x if ka == 1 else 0.0
    return mean * x + (A - mean) * ka**2 + (asymmetry if ka + kc == n else -asymmetry)


@pytest.mark.parametrize("as_spcat", [False, True])
def test_energies_are_diagonal_elements(as_spcat: bool):
    """Eigenvalues with a note before, and refused with --as-spcat."""
    computed = _prediction("s 1 1 0 60 0 1 1 1 0 1 -1", as_spcat=as_spcat)
    levels = computed.lines.levels
    names = np.column_stack([levels.quanta[name] for name in ("j", "ka", "kc")])
    assert len(set(map(tuple, names.tolist()))) == 25
    expected = [_wang_diagonal(*row) for row in names.tolist()]
    np.testing.assert_allclose(levels.energy_mhz, expected, atol=1e-9)
    assert computed.notes == (
        "DIAG is below 0: the energies are diagonal elements of the Hamiltonian over the functions of the file, as in SPCAT, and each "
        "level is one function; DIAG = 0 has eigenvalues",
    )
    diagonalized = _prediction("s 1 1 0 60 0 1 1 1 0 1 0").lines.levels
    by_j = [energies[levels.rotational == 4].sum() for energies in (levels.energy_mhz, diagonalized.energy_mhz)]
    assert by_j[0] == pytest.approx(by_j[1], rel=1e-12)  # the trace
    assert np.abs(np.sort(levels.energy_mhz) - np.sort(diagonalized.energy_mhz)).max() > 1.0


def test_lines_are_those_of_single_functions():
    """A function of K has lines with dK = 0 of mu_a and dK = 1 of mu_c alone; mu_a^2 (N^2 - K^2)/N is the strength of R(N - 1)."""
    lines = _prediction("s 1 1 0 60 0 1 1 1 0 1 -1").lines
    levels = lines.levels
    n, ka = levels.rotational, levels.quanta["ka"]
    assert set(np.abs(ka[lines.upper] - ka[lines.lower]).tolist()) == {0, 1}
    parallel = (ka[lines.upper] == ka[lines.lower]) & (n[lines.upper] == n[lines.lower] + 1)
    top, k = n[lines.upper][parallel], ka[lines.upper][parallel]
    np.testing.assert_allclose(lines.strength_debye2[parallel], 1.44 * (top**2 - k**2) / top, rtol=1e-9)
    assert parallel.sum() > 10


def test_spins_add_their_diagonal_elements():
    """chi_aa [3K^2/(N(N+1)) - 1] f(N, I, F), Casimir's function, where the code stands for 3/2 chi_aa."""
    levels = _prediction("s 3 1 0 60 0 1 1 1 0 1 -1", f"110010000 {CHI} 1e-9\n").lines.levels
    spin, count = 1.0, 0
    for n, ka, kc, f, energy in zip(
        *(levels.quanta[q] for q in ("n", "ka", "kc", "f")), levels.energy_mhz, strict=True
    ):
        shift = 0.0
        if n:
            c = f * (f + 1) - n * (n + 1) - spin * (spin + 1)
            casimir = (0.75 * c * (c + 1) - spin * (spin + 1) * n * (n + 1)) / (
                2 * spin * (2 * spin - 1) * (2 * n - 1) * (2 * n + 3)
            )
            shift = CHI / 1.5 * casimir * (3 * ka**2 / (n * (n + 1)) - 1)
        assert energy == pytest.approx(_wang_diagonal(int(n), int(ka), int(kc)) + shift, abs=1e-8)
        count += 1
    assert count == 75


def test_states_do_not_mix():
    """A coupling G_c between two states is off the diagonal."""
    options = "s 1 2 0 60 0 1 1 1 0 1 -1"
    second = f"11 1000.0 1e-9\n10011 {A} 1e-9\n20011 {B} 1e-9\n30011 {C} 1e-9\n"
    both, alone = (_prediction(options, second + coupling).lines.levels for coupling in ("600001 50.0 1e-9\n", ""))
    np.testing.assert_allclose(np.sort(both.energy_mhz), np.sort(alone.energy_mhz), atol=1e-8)
    diagonalized = _prediction(options.replace("-1", "0"), second + "600001 50.0 1e-9\n").lines.levels
    assert np.abs(np.sort(both.energy_mhz) - np.sort(diagonalized.energy_mhz)).max() > 1.0


def test_errors_are_those_of_the_diagonal_elements():
    """dE/dB = N(N+1)/2 - K^2/2 (+- N(N+1)/4 of K = 1), here by a difference of two predictions."""
    lines = _prediction("s 1 1 0 60 0 1 1 1 0 1 -1")
    step = 1e-3  # the error of B
    moved = _prediction("s 1 1 0 60 0 1 1 1 0 1 -1", b=B + step)
    shifts = _by_quanta(moved, moved.catalogue.frequency_mhz)
    errors = _by_quanta(lines, lines.catalogue.error_mhz)
    for quanta, frequency in _by_quanta(lines, lines.catalogue.frequency_mhz).items():
        assert errors[quanta] == pytest.approx(abs(shifts[quanta] - frequency), abs=2e-6)


def _by_quanta(computed: Prediction, column: Floats) -> dict[tuple[int, ...], float]:
    quanta = np.hstack([computed.catalogue.quanta_upper, computed.catalogue.quanta_lower])
    return dict(zip(map(tuple, quanta.tolist()), column.tolist(), strict=True))


def test_a_basis_that_is_not_of_wang_functions():
    """A symmetric top with spins: eigenvalues and a note, refused with --as-spcat; without elements off the diagonal nothing is said."""
    text = "t\n {} 9 20 0 0.0 1.0e6 1.0 1.0\ns {} 1 0 60 0 1 1 1 0 1 -1\n100 4000 1e-3\n1000 3000 1e-3\n"
    request = read_int(b"t\n0 1 1000.0 0 4 -30 -30 99999 300\n1 1.2\n")
    spins = read_par((text.format(3, -3) + f"110010000 {CHI} 1e-3\n").encode())
    assert any("here are eigenvalues" in note for note in predict(spins, request).notes)
    with pytest.raises(ValueError, match="DIAG below 0: diagonal elements in place of eigenvalues, which are computed"):
        predict(spins, request, as_spcat=True)
    plain = read_par(text.format(2, -1).encode())
    assert not any("DIAG" in note for note in predict(plain, request, as_spcat=True).notes)
