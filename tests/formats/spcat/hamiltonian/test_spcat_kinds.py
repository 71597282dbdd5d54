"""Inputs of every kind that published fits have, against lines of the reference program (tests/oracles/kinds/README.md)."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from places import ORACLES

from rotor.formats.spcat.file_model import connected_groups
from rotor.formats.spcat.hamiltonian.coded_file import coded_file
from rotor.formats.spcat.hamiltonian.dipole_codes import line_moment, split_dipole
from rotor.formats.spcat.hamiltonian.operators import code_operator
from rotor.formats.spcat.predict import predict, predict_file
from rotor.formats.spcat.text.cat import format_lines, read_cat
from rotor.formats.spcat.text.catalogue import Catalogue
from rotor.formats.spcat.text.int_file import Dipole, IntensityFile, Request, read_int
from rotor.formats.spcat.text.par import read_par

KINDS = ORACLES / "kinds"
RANGES = {"h2coh": (6, 10), "o2": (0, 75), "fso3": (0, 9), "oc33s": (0, 22), "co": (0, 99)}  # F that the samples need

# made here, lines of the compiled program: how many lines there are in all
WRITTEN_KINDS = {
    "l_doubled_quad": 194, "patterns_of_i_tot": 822, "three_states_oblate": 877, "dipoles_between": 657, "threefold_weights": 72,
    "threefold_asymmetric_quanta": 52, "forbidden_coupling": 654, "water_diag1": 339, "water_diag5": 398, "two_quadrupoles_i_tot": 1005,
    "eighteen_states": 958, "oblate_spin_orbit": 238, "three_protons_i_tot": 247, "methyl_i_tot": 215, "inversion_i_tot": 215,
    "deuterons_i_tot": 323, "forbidden_three_i_tot": 292, "l_doubled_weights": 419, "inversion_weights": 100, "one_of_two_i_tot": 208,
    "moment_of_n": 92, "weights_of_states_i_tot": 583, "unequal_weights_i_tot": 361, "fourier_l_doubled": 588,
    "fourier_two_states": 7206, "euler_water": 273, "sampled_k": 1603,
    "diag3_spins": 1150, "diag5_i_tot": 638, "diag3_states": 167, "euler_series": 218, "fourier_series": 288, "near_sphere_states": 235,
    "moments_between": 7674, "moments_between_oblate": 9426, "moments_alone": 398, "spin_orders": 625, "spin_series": 1264,
    "odd_and_phase": 1399, "weights_in_part": 602, "phase_with_spins": 3671, "odd_in_oblate": 1178, "states_up_to_maxv": 320,
    "triplet_and_delta": 57, "wavenumbers": 437, "spin_of_size_zero": 1810,
    "spin_of_size_zero_beside_three": 2701,
}  # fmt: skip


@cache
def _predicted(name: str) -> Catalogue:
    parameters, value = (read(KINDS / name / f"{name}{s}") for read, s in ((read_par, ".var"), (read_int, ".int")))
    first, last = RANGES.get(name, (value.request.fbgn, value.request.fend))
    request = replace(value.request, fbgn=first, fend=last)
    return predict(parameters, replace(value, request=request), as_spcat=True).catalogue


def _by_label(lines: Catalogue) -> dict[tuple[int, ...], list[int]]:
    groups: dict[tuple[int, ...], list[int]] = defaultdict(list)
    for row, pair in enumerate(zip(lines.quanta_upper.tolist(), lines.quanta_lower.tolist(), strict=True)):
        groups[*pair[0], *pair[1]].append(row)
    return groups


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.slow) if name == "h2coh" else name for name in (*RANGES, *WRITTEN_KINDS)],
)
def test_lines_of_every_kind_agree_to_the_printed_digits(name):
    """Frequencies to the digits printed, intensities to 1e-4 of LGINT and half a digit, E″, degeneracies, labels."""
    ours, reference = _predicted(name), read_cat(KINDS / name / "sample.cat")
    rows = _by_label(ours)
    for row, pair in enumerate(zip(reference.quanta_upper.tolist(), reference.quanta_lower.tolist(), strict=True)):
        near = rows[*pair[0], *pair[1]]
        assert near, reference.record(row)
        nearest = min(near, key=lambda i: abs(ours.frequency_mhz[i] - reference.frequency_mhz[row]))
        assert abs(ours.frequency_mhz[nearest] - reference.frequency_mhz[row]) < 5.1e-5, reference.record(row)
        assert abs(ours.lgint[nearest] - reference.lgint[row]) < 1.6e-4, reference.record(row)
        assert abs(ours.energy_lower_cm[nearest] - reference.energy_lower_cm[row]) < 5.1e-5
        assert ours.g_upper[nearest] == reference.g_upper[row]
    assert len(reference) >= 7


@pytest.mark.parametrize("name", WRITTEN_KINDS)
def test_no_line_is_missing_or_extra(name):
    assert len(_predicted(name)) == WRITTEN_KINDS[name]


@pytest.mark.parametrize(
    "name", ["triplet_and_delta", "diag3_states", "euler_series", "states_up_to_maxv", "water_diag5"]
)
def test_levels_hold_the_lower_states_of_all_lines(name):
    """Energies, labels and degeneracies of the list of levels; of the last one's one state too, whose levels have other names here."""
    levels = predict_file(KINDS / name / f"{name}.int", as_spcat=True).levels
    results = {}
    for quanta, energy in zip(levels.quanta.tolist(), levels.energy_cm, strict=True):
        results.setdefault(tuple(q for q in quanta if q >= -99), []).append(energy)
    lines = read_cat(KINDS / name / "sample.cat")
    for quanta, energy in zip(lines.quanta_lower.tolist(), lines.energy_lower_cm, strict=True):
        near = results[tuple(q for q in quanta if q >= -99)]
        assert min(abs(energy - level) for level in near) < 5.1e-5  # half a digit


def test_a_state_with_quantum_numbers_of_its_own_has_no_number_of_a_pattern():
    """Beside states of more spins; the program lists -1 there."""
    name = "spin_of_size_zero_beside_three"
    levels = predict_file(KINDS / name / f"{name}.int", as_spcat=True).levels
    assert levels.pattern is not None
    in_state = levels.quanta[:, 3] == 0
    assert set(levels.pattern[in_state].tolist()) == {-1}
    assert set(levels.pattern[~in_state].tolist()) == set(range(24))  # 2 * 6 * 2 couplings


@pytest.mark.slow
def test_ten_quantum_numbers_are_written_and_read():
    ours = _predicted("h2coh")
    assert set(ours.qnfmt.tolist()) == {3488}
    back = read_cat(format_lines(ours))
    assert np.array_equal(back.quanta_upper[:, :8], ours.quanta_upper[:, :8])
    assert np.array_equal(back.quanta_lower[:, :8], ours.quanta_lower[:, :8])


def _bare_clclo2(factor: float = 1.0):
    file = read_par(KINDS / "clclo2" / "clclo2.var")
    scaled = [replace(p, value=p.value * (factor if p.code in (620001, 621001) else 1.0)) for p in file.parameters]
    return replace(file, parameters=tuple(scaled))


# centres of quadrupole patterns that SPFIT computed, in MHz
CENTRES = {((40, 0, 40), (39, 0, 39)): 223433.75785, ((41, 0, 41), (40, 0, 40)): 228950.18234}


@pytest.mark.parametrize(("factor", "off"), [(1.0, 0.0), (-1.0, 7.0)])
def test_coriolis_terms_of_third_order(factor, off):
    """620001 and 621001 move these lines by 4 MHz; with the other sign they are 7 MHz off."""
    (group,) = connected_groups(_bare_clclo2(factor), IntensityFile("", Request(), ()), as_spcat=True)
    levels = group.levels((2 * 39, 2 * 41))
    for (upper, lower), centre in CENTRES.items():
        energies = [levels.energy_mhz[levels.find(v=0, j=j, ka=ka, kc=kc)] for j, ka, kc in (upper, lower)]
        difference = abs(energies[0] - energies[1] - centre)
        assert difference < 2e-5 if not off else difference > off  # digits printed


@pytest.mark.parametrize(
    ("code", "says"),
    [
        (61001, "moment of third order that acts on spin 1"),
        (80001, "time reversal would change the sign"),
        (50000, "l_z of an l-doubled state"),
        (1002, "acts on spin 1"),
        (1004, "SYM = 4"),
        (2000, "spin 2 is not among the 1"),
    ],
)
def test_moments_that_do_not_compute_are_named(code, says):
    dipole = Dipole(code, 1.0)
    with pytest.raises(ValueError, match=says):
        line_moment(dipole, split_dipole(code, 1), (0, 0), 1)


def test_operators_of_n_are_hermitian_and_obey_time_reversal():
    """All of TYP 12 to 79: Hermitian (with i where odd), and even ones real, odd ones imaginary, as J of the table of phases."""
    from plain_elements import matrix_of_j

    from rotor.formats.spcat.hamiltonian.code_table import split_code
    from rotor.formats.spcat.hamiltonian.codes import AXES

    for axes in AXES.values():
        for typ in (*range(12, 18), *range(20, 28), *range(40, 48), *range(60, 68)):
            coded = code_operator(split_code(typ * 10000), axes)
            matrix = matrix_of_j(coded.alone, 6)
            sign = -1 if coded.odd else 1
            np.testing.assert_allclose(matrix, sign * matrix.conj().T, atol=1e-9)  # i times a Hermitian operator
            k = np.arange(-6, 7)
            turned = (-1.0) ** (k[:, None] - k) * matrix[::-1, ::-1].conj()
            np.testing.assert_allclose(matrix, turned, atol=1e-9)  # numbers of up to 1e5


def test_low_orders_are_cartesian_products():
    """TYP 21, 41, 61 are NbNc + NcNb, ...; 20, 40, 60 i times Na, Nb, Nc, -i in the oblate basis (as SPCAT's levels say)."""
    from plain_elements import matrix_of_j

    from rotor.formats.spcat.hamiltonian.code_table import split_code
    from rotor.formats.spcat.hamiltonian.codes import AXES
    from rotor.quantum.operators.algebra import half_anticommutator
    from rotor.quantum.operators.rotation import components

    for axes, representation in ((AXES["Ir"], "Ir"), (AXES["IIIl"], "IIIl")):
        of = components(representation)
        for typ, axis in ((20, "a"), (40, "b"), (60, "c")):
            others = [of[x] for x in "abc" if x != axis]
            pair = matrix_of_j(code_operator(split_code((typ + 1) * 10000), axes).alone, 5)
            products = matrix_of_j(2.0 * half_anticommutator(*others), 5)
            np.testing.assert_allclose(pair, products, atol=1e-12)  # sums of two products
            alone = matrix_of_j(code_operator(split_code(typ * 10000), axes).alone, 5)
            factor = 1j if representation == "Ir" else -1j
            np.testing.assert_allclose(alone, factor * matrix_of_j(of[axis], 5), atol=1e-14)  # round-off


def test_the_energy_of_one_k():
    """802000 is the energy of K = 2 and 802100 the same times N(N+1), in a symmetric top, whose energies are B N(N+1) + (A - B) K²."""
    values = ("100 9000.0", "1000 100000.0", "802000 50.0", "802100 0.5")
    text = "a case\n 4 1 1 0 0 1e6 1 1\na 1 1 0 9 0 1 1 1 0 1 0\n" + "".join(f"{value} 0\n" for value in values)
    (group,) = connected_groups(read_par(text.encode()), IntensityFile("", Request(), ()))
    levels = group.levels((0, 8))
    square, k = levels.rotational * (levels.rotational + 1.0), levels.quanta["ka"]
    expected = 9000.0 * square + 1e5 * k**2 + (k == 2) * (50.0 + 0.5 * square)
    np.testing.assert_allclose(levels.energy_mhz, expected, atol=1e-8)  # a few units in the last place of 2e6 MHz


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ("s -22 -1 0 20 0 -6 1 1 0 0 0", "couples three spins"),
        ("s -2322 -1 0 20 0 -6 1 1 0 0 0", "of several sizes"),
        ("s -2222 -1 0 20 0 -7 1 1 0 0 0", "a total spin of 4 equivalent nuclei"),
        ("s -222 -1 0 20 0 -6 1 1 0 2 0", "levels of E species do not exist"),
        ("s -222 -1 0 20 0 -6 1 1 0 100 0", "l-doubled state with a total spin of three"),
        ("s -222 -1 0 20 0 -6 1 1 0 0 1", "DIAG = 1"),
        ("s -222 -1 0 20 2 -6 1 1 0 0 0", "IXX = 2"),
    ],
)
def test_totals_of_three_that_do_not_compute_are_named(options, says):
    file = read_par(f"a case\n 1 0 0 0\n{options}\n 100 1.0 0\n".encode())
    with pytest.raises(ValueError, match=says):
        connected_groups(file, IntensityFile("", Request(), ()))


def test_terms_of_three_nuclei_that_spcat_leaves_out_are_noted():
    file = read_par((KINDS / "forbidden_three_i_tot" / "forbidden_three_i_tot.var").read_bytes())
    notes = coded_file(file).left_out
    assert len(notes) == 4
    assert sum("the first is named, or the first and the second" in note for note in notes) == 3
    assert sum("no multiple of 3" in note for note in notes) == 1


def test_files_without_a_level_that_has_a_weight_are_refused():
    file = read_par(b"a case\n 1 0 0 0\nl -2 1 0 0 0 1 0 1\n 100 6000.0 0\n")
    with pytest.raises(ValueError, match="no level"):
        predict(file, IntensityFile("", Request(fend=3), (Dipole(1, 1.0),)))


@pytest.mark.parametrize("str0", [-9.0, -5.5, -5.0])
def test_the_lines_are_those_of_the_catalogue(str0):
    """l-doubled states: a line of two levels of ±K stands twice in the catalogue, the others once, at every cut."""
    parameters, request = (
        read(KINDS / "l_doubled_quad" / f"l_doubled_quad{s}") for read, s in ((read_par, ".var"), (read_int, ".int"))
    )
    prediction = predict(parameters, replace(request, request=replace(request.request, str0=str0)))
    components = prediction.lines.levels.components
    times = np.maximum(components[prediction.lines.upper], components[prediction.lines.lower])
    assert set(times.tolist()) == {1, 2}
    assert times.sum() == len(prediction.catalogue) > 20
