"""Fourier and Euler series of SPFIT's files, XOPT, against plain matrices over signed K; lines in tests/oracles/kinds."""

from __future__ import annotations

import numpy as np
import pytest
from full_matrix_rotor import momenta

from rotor.formats.spcat.file_model import connected_groups
from rotor.formats.spcat.hamiltonian.coded_file import coded_file
from rotor.formats.spcat.predict import predict
from rotor.formats.spcat.text.int_file import IntensityFile, Request, read_int
from rotor.formats.spcat.text.par import read_par
from rotor.units import MHZ_PER_CM

ABC = ((10000, 30000.123), (20000, 9000.2), (30000, 7500.7))
RHO = 0.37


def _file(parameters, options="a 1 1 0 20 0 1 1 1 0 1 0\n"):
    lines = "".join(f"{code} {value!r} 0\n" for code, value in parameters)
    return read_par(f"a case\n {len(parameters)} 1 1 0 0 1e6 1 1\n{options}{lines}".encode())


def _energies(file, j):
    groups = connected_groups(file, IntensityFile("", Request(), ()))
    levels = [group.levels((2 * j, 2 * j)) for group in groups]
    return np.sort(np.concatenate([each.energy_mhz[each.rotational == j] for each in levels]))


def _plain(j):
    """Na, Nb, Nc over signed k, and the rigid rotor of ABC."""
    of = momenta(j, "a")
    return of, sum(value * of[axis] @ of[axis] for axis, (_, value) in zip("abc", ABC, strict=True))


@pytest.mark.parametrize("j", [1, 4, 7])
def test_cosines_act_at_the_mean_k(j):
    """c cos(2π n ρ K/3) along the diagonal, and of an operator at the mean of both K."""
    of, rigid = _plain(j)
    k = np.arange(-j, j + 1)
    mean = (k[:, None] + k[None, :]) / 2
    across = of["a"] @ of["b"] + of["b"] @ of["a"]
    plain = (
        rigid + np.diag(55.5 * np.cos(4 * np.pi / 3 * RHO * k)) + 350.0 * across * np.cos(2 * np.pi / 3 * RHO * mean)
    )
    series = ((910000, RHO), (2_000_000_000, 55.5), (1_000_610_000, 350.0))
    energies = _energies(_file((*ABC, *series)), j)
    assert energies == pytest.approx(np.linalg.eigvalsh(plain), abs=1e-8)  # round-off of 1e6 MHz
    assert np.abs(energies - _energies(_file((*ABC, *series[:2])), j)).max() > 1.0  # the off-diagonal term acts


@pytest.mark.parametrize("j", [1, 5])
def test_euler_series(j):
    """((N² - K²)/D)^p (K²/D)^q, the operators with ΔK = 2 as half an anticommutator with 1/D."""
    of, rigid = _plain(j)
    a, b = 2e-3, 3e-4
    k = np.arange(-j, j + 1.0)
    rest = j * (j + 1) - k**2
    below = 1 + a * k**2 + b * rest
    step = of["b"] - 1j * of["c"]
    across = np.diag(1 / below) @ (step @ step + (step @ step).conj().T)
    closed_form = -973.0 * (k**2 / below) ** 2 - 170.0 * (k**2 / below) * (rest / below)
    plain = rigid + np.diag(closed_form) - 15.2 * (across + across.conj().T) / 2
    series = ((911000, a), (910100, b), (100_000_002_000, -973.0), (100_000_001_100, -170.0), (100_000_040_000, -15.2))
    assert _energies(_file((*ABC, *series)), j) == pytest.approx(np.linalg.eigvalsh(plain), abs=1e-8)  # round-off


@pytest.mark.parametrize(("code", "function_of_k"), [(11_000_000_001, lambda k: 1j), (11_000_200_001, lambda k: k)])
def test_sine_between_states(code, function_of_k):
    """⟨0|H|1⟩ = i s sin(2π ρ K/3): the function changes its sign with K, so that time reversal needs the i; with Na it does not."""
    j, energy, s = 4, 500.0, 20.0
    options = "a 1 2 0 20 0 1 1 1 0 1 0\n"
    common = tuple((code + 99, value) for code, value in ABC)
    file = _file((*common, (11, energy), (910099, RHO), (code, s)), options)
    _, rigid = _plain(j)
    k = np.arange(-j, j + 1)
    between = s * np.diag(function_of_k(k) * np.sin(2 * np.pi / 3 * RHO * k))
    plain = np.block([[rigid, between], [between.conj().T, rigid + energy * np.eye(2 * j + 1)]])
    assert _energies(file, j) == pytest.approx(np.linalg.eigvalsh(plain), abs=1e-8)  # round-off


@pytest.mark.parametrize(
    ("options", "code", "says"),
    [
        ("a 1 1 0 20 0 1 1 1 0 1 0 80\n", 100, "XOPT = 80"),  # the first that is no sum of its parts
        ("a 1 1 0 20 0 1 1 1 0 1 0 90\n", 100, "XOPT = 90"),
        ("a 3 1 0 20 0 1 1 1 0 1 0\n", 10_920_000, "a spin with TYP 92"),
        ("a 1 1 0 20 0 1 1 1 0 1 0\n", 1_000_830_000, "one series alone"),
        ("a 1 1 0 20 0 1 1 1 0 1 0\n", 930000, "no constant of a series"),
        ("a 1 1 0 20 0 1 1 1 0 1 0\n", 100_000_000_000, "an energy has no EX"),
        ("a 1 1 0 20 0 1 1 1 0 1 0\n", 600_000_000_100, "five Euler series"),
    ],
)
def test_what_does_not_compute_is_named(options, code, says):
    with pytest.raises(ValueError, match=says):
        _ = coded_file(_file(((code, 1.0),), options)).lines


def test_newlz_names_the_sign_of_l():
    """With NEWLZ -2Aζ stands at the state with K l ≤ 0; at the other it is refused."""
    option_card = "s -1 {n} 0 20 0 6 2 2 {more} {ewt} 1 {x}\n"
    lines = [(3, -1, 1), (1, -1, 101), (2, 0, 201)]
    options = {x: "".join(option_card.format(n=n, more=m, ewt=e, x=x) for n, m, e in lines) for x in (0, 10)}
    common = ((1099, 148900.0), (199, 9198.9), (11, 3.0e5))
    request = read_int(b"a case\n0 41 14000 0 5 -30 -30 99999 300\n 001 3.92\n 111 3.92\n")
    plain = predict(_file((*common, (200011, -277854.0)), options[0]), request).catalogue
    explicit = predict(_file((*common, (200022, -277854.0)), options[10]), request).catalogue
    assert np.array_equal(plain.frequency_mhz, explicit.frequency_mhz)
    assert np.array_equal(plain.energy_lower_cm, explicit.energy_lower_cm)
    with pytest.raises(ValueError, match="with NEWLZ"):
        predict(_file((*common, (200011, -277854.0)), options[10]), request)


def test_half_the_difference_of_the_energies_of_one_k():
    """With NEWLZ TYP 80 of the state with K l ≤ 0 raises K = 1 with K l > 0 and lowers K = 1 with K l < 0 by as much."""
    option_card = "s -1 {n} 0 20 0 6 2 2 {more} {ewt} 1 10\n"
    options = "".join(option_card.format(n=n, more=m, ewt=e) for n, m, e in [(3, -1, 1), (1, -1, 101), (2, 0, 201)])
    common = ((1099, 148900.0), (199, 9198.9), (11, 3.0e5), (200022, -277854.0))  # K l > 0 lies lower
    plain, moved = (_energies(_file((*common, *more), options), 1) for more in ((), ((801022, 50.0),)))
    shifts = np.sort(moved) - np.sort(plain)
    assert np.unique(np.round(shifts, 6)).tolist() == [-50, 0, 50]
    energy = np.sort(plain)
    assert energy[shifts > 25].max() < energy[shifts < -25].min()


def test_moments_of_other_kinds_with_errors_of_constants():
    """A moment with N² and constants that have errors: each line gets its error; of a pair of l-doubled states both take part."""
    request = read_int(b"a case\n0 41 14000 0 5 -30 -30 99999 300\n 1 3.92\n 30001 1e-4\n")
    file = read_par(b"a case\n 1 1 1\na -1 1 0 0 0 1 1 1 0 1 0\n 100 6081.5 1e-3 /B\n")
    prediction = predict(file, request).catalogue
    assert prediction.error_mhz == pytest.approx(2e-3 * np.arange(1, 6))  # σ(ν) = 2 (J + 1) σ(B)


def test_constants_of_series_are_pure_numbers_in_files_with_wavenumbers():
    """FLAGS 1000 changes the unit of parameters, not ρ, a and b."""
    parameters = (*ABC, (910000, RHO), (1_000_000_000, 55.5), (911000, 2e-3), (910100, 3e-4), (100_000_002_000, -9.0))
    pure = {910000, 911000, 910100}
    in_cm = tuple((code, value if code in pure else value / MHZ_PER_CM) for code, value in parameters)
    text = "a case\n{} 41 14000 0 5 -30 -30 {} 300\n 1 1.0\n"
    plain = predict(_file(parameters), read_int(text.format(0, 99999).encode())).catalogue
    prediction = predict(_file(in_cm), read_int(text.format(1000, 99999).encode())).catalogue
    plain = plain.take(plain.frequency_mhz > 0.02)  # 5e-7 cm⁻¹ prints as 0 and is left out
    assert len(prediction) == len(plain) > 20
    assert prediction.frequency_mhz * MHZ_PER_CM == pytest.approx(plain.frequency_mhz, abs=1e-6)  # round-off


def test_a_note_on_a_parameter_stands_once():
    options = "a 1 3 0 20 0 2 1 3 0 1 0\n"
    file = _file((*((code + 99, value) for code, value in ABC), (910099, RHO), (1_000_210_099, 3.0)), options)
    assert len(coded_file(file).left_out) == 1
