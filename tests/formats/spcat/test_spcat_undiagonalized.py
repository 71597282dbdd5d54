"""DIAG below 0: SPCAT's `hamx` copies the diagonal elements of each block as energies and takes unit vectors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from places import ORACLES
from spcat_fits import fit_of_prediction

from rotor.arrays import Floats
from rotor.formats.spcat.predict import Prediction, predict
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.par import ParameterFile, read_par

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
    count = 0
    for n, ka, kc, f, energy in zip(
        *(levels.quanta[q] for q in ("n", "ka", "kc", "f")), levels.energy_mhz, strict=True
    ):
        shift = 0.0
        if n:
            shift = CHI / 1.5 * _casimir(n, f) * (3 * ka**2 / (n * (n + 1)) - 1)
        assert energy == pytest.approx(_wang_diagonal(int(n), int(ka), int(kc)) + shift, abs=1e-8)
        count += 1
    assert count == 75


def _casimir(n: int, f: int, spin: float = 1.0) -> float:
    """f(N, I, F) of the coupling of a quadrupole with N alone, I = 1."""
    c = f * (f + 1) - n * (n + 1) - spin * (spin + 1)
    return (0.75 * c * (c + 1) - spin * (spin + 1) * n * (n + 1)) / (
        2 * spin * (2 * spin - 1) * (2 * n - 1) * (2 * n + 3)
    )


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


@pytest.mark.parametrize("linear", [False, True])
def test_axial_tops_with_spins(linear: bool):
    """Closed forms, without what chi joins of other N; eigenvalues and a note before, refused with --as-spcat."""
    further = "" if linear else "1000 1000 1e36\n"
    text = (
        f"t\n 5 9 20 0 0.0 1.0e6 1.0 1.0\ns -3 1 0 {0 if linear else 60} 0 1 1 1 0 1 -1\n100 3000 1e36\n200 -1 1e36\n"
    )
    file = read_par((text + f"110010000 {CHI} 1e36\n" + further).encode())
    computed = predict(file, read_int(b"t\n0 1 1000.0 0 4 -30 -30 99999 300\n1 1.2\n"), as_spcat=True)
    levels = computed.lines.levels
    k = np.zeros(len(levels), dtype=int) if linear else levels.quanta["k"]
    for n, along, f, energy in zip(levels.rotational, k, levels.quanta["f"], levels.energy_mhz, strict=True):
        x = int(n * (n + 1))
        quadrupole = CHI / 1.5 * _casimir(int(n), int(f)) * (3 * along**2 / x - 1) if n else 0.0
        along_axis = 0 if linear else 1000 * along**2
        assert energy == pytest.approx(3000 * x - x**2 + along_axis + quadrupole, abs=1e-8)
    assert len(levels) == (13 if linear else 44)
    assert [note for note in computed.notes if "DIAG is below 0: the energies are diagonal elements" in note]


@pytest.mark.parametrize(
    ("kind", "what"),
    [("three_protons_i_tot", "three equivalent spins"), ("l_doubled_quad", "l-doubled states")],
)
def test_functions_other_than_those_of_the_file_are_refused(kind: str, what: str):
    """Eigenvalues and a note before, for fits and predictions."""
    folder = ORACLES / "kinds" / kind
    file = read_par(folder / f"{kind}.var")
    below = replace(file, options=tuple(replace(options, diag=-1) for options in file.options))
    request = read_int(folder / f"{kind}.int")
    request = replace(request, request=replace(request.request, fend=min(request.request.fend, 4)))
    with pytest.raises(ValueError, match=f"DIAG is below 0.*those of {what} are not computed; give DIAG = 0"):
        predict(below, request)


FITS = {
    "plain": ("s 1 1 0 60 0 1 1 1 0 1 -1", "10000 8000 1e36\n20000 4000 1e36\n30000 3000 1e36\n200 -1e-3 1e36\n"),
    "spin": ("s 3 1 0 60 0 1 1 1 0 1 -1", "10000 8000 1e36\n20000 4000 1e36\n30000 3000 1e36\n110010000 -40 1e36\n"),
    "two states": (
        "s 1 2 0 60 0 1 1 1 0 1 -1",
        "10099 8000 1e36\n20099 4000 1e36\n30099 3000 1e36\n11 900 1e-37\n600001 50 1e-37\n",
    ),
    "symmetric, spin": ("s -3 1 0 60 0 1 1 1 0 1 -1", "100 3000 1e36\n1000 1000 1e-37\n110010000 -40 1e36\n"),
    "linear, spin": ("s -3 1 0 0 0 1 1 1 0 1 -1", "100 3000 1e36\n200 -1e-2 1e36\n110010000 -40 1e36\n"),
    "oblate in prolate axes": (
        "s -1 1 0 60 0 1 1 1 0 1 -1",
        "100 133480 1e36\n1000 -15992 1e-37\n200 -3.95 1e36\n1100 5.18 1e36\n60000 2e-4 1e-37\n",
    ),
}


def _true(kind: str) -> ParameterFile:
    options, lines = FITS[kind]
    return read_par(f"t\n {lines.count(chr(10))} 900 20 0 0.0 1.0e6 1.0 1.0\n{options}\n{lines}".encode())


def _predicted(file: ParameterFile) -> Prediction:
    return predict(file, read_int(b"t\n0 1 1000.0 0 5 -30 -30 99999999 300\n1 1.2\n2 0.9\n3 0.5\n"))


@pytest.mark.parametrize("kind", FITS)
def test_a_fit_has_the_diagonal_elements_too(kind: str, tmp_path: Path):
    """Eigenvalues before: an oblate top did not converge. Energies are linear in the constants, so that one step is enough."""
    true = _true(kind)
    code = next(p.code for p in true.parameters if p.error and p.error > 1)
    fit_input, fit = fit_of_prediction(true, _predicted(true), tmp_path, code=code)
    assert fit.converged, fit.reason
    assert "after 1 iteration:" in fit.reason
    assert fit.weighted_rms < 0.01
    expected = [p.value for p in true.parameters if p.error is not None and p.error > 1]
    assert (np.abs(fit.values - expected) < 0.1 * fit.errors).all()
    assert [note for note in fit_input.notes if "DIAG is below 0: the energies are diagonal elements" in note]


@pytest.mark.parametrize("kind", FITS)
def test_levels_of_a_fit_are_those_of_predictions_at_any_constants(kind: str, tmp_path: Path):
    """Two routes: slopes times constants, and blocks solved anew at these constants."""
    true = _true(kind)
    fit_input, _ = fit_of_prediction(true, _predicted(true), tmp_path)
    assert fit_input.model is not None
    factors = 1.0 + 0.05 * np.arange(len(true.parameters))
    moved = tuple(replace(p, value=p.value * x) for p, x in zip(true.parameters, factors, strict=True))
    values, lines = np.array([p.value for p in moved]), fit_input.lines
    energies = [fit_input.model(labels).levels(values)[0] for labels in (lines.upper, lines.lower)]
    listed = _frequencies(_predicted(replace(true, parameters=moved)), lines.upper.shape[1])
    expected = [listed[tuple(row)] for row in np.column_stack([lines.upper, lines.lower]).tolist()]
    np.testing.assert_allclose(np.abs(energies[0] - energies[1]), expected, atol=1e-4)
    assert len(expected) > 4


def _frequencies(computed: Prediction, width: int) -> dict[tuple[int, ...], float]:
    """Frequencies by the quantum numbers of both states, in both orders."""
    listed = computed.catalogue
    up, low = listed.quanta_upper[:, :width].tolist(), listed.quanta_lower[:, :width].tolist()
    lines = list(zip(up, low, listed.frequency_mhz.tolist(), strict=True))
    return {(*a, *b): nu for a, b, nu in lines} | {(*b, *a): nu for a, b, nu in lines}
