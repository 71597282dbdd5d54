"""The vibrational factor of Q: hand calculations, closed forms, and the partition functions and intensities of catalogues."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import rotor
from rotor.formats.spcat.text.cat import read_cat
from rotor.spectra.lines import line_list
from rotor.spectra.raman.raman import raman_lines
from rotor.thermodynamics.sums.partition import partition_function
from rotor.thermodynamics.vibration import VibrationalStates, vibrational_partition_function

HC_OVER_K = 1.438776877  # cm K

# HCN below 3400 cm⁻¹: ν2 with l = 1; 2ν2 with l = 0, 2; ν1 (CN); 3ν2 with l = 1, 3; ν3 (CH). Rounded textbook energies.
HCN_STATES = "711.98x2, 1411.41, 1426.53x2, 2096.85, 2113.45x2, 2143.76x2, 3311.48"
HCN_FUNDAMENTALS = "711.98x2, 2096.85, 3311.48 cm-1"


def test_vibrational_sums_are_those_by_hand():
    """One state at kT ln 2 and, doubly degenerate, at kT ln 4: 1 + 1/2 + 2/4 = 2, or (1/2)⁻¹ (3/4)⁻² = 32/9."""
    kt_cm = 300.0 / HC_OVER_K
    energies = [kt_cm * math.log(2), kt_cm * math.log(4)]
    assert vibrational_partition_function(energies, [1, 2], 300.0) == pytest.approx(2.0, rel=1e-9)  # digits of hc/k
    assert vibrational_partition_function(energies, [1, 2], 300.0, harmonic=True) == pytest.approx(32 / 9, rel=1e-9)


@given(st.floats(50.0, 3000.0), st.integers(1, 3), st.floats(10.0, 1000.0))
def test_harmonic_is_the_sum_over_its_states(fundamental, degeneracy, temperature):
    """n quanta in g oscillators: binomial(n + g - 1, n) states at n times the fundamental."""
    n = np.arange(1, 2000)
    counts = [math.comb(int(k) + degeneracy - 1, int(k)) for k in n]
    listed = vibrational_partition_function(n * fundamental, counts, temperature)
    closed = vibrational_partition_function([fundamental], [degeneracy], temperature, harmonic=True)
    assert listed == pytest.approx(closed, rel=1e-12)  # exp(-2000·50/695), and round-off of 2000 terms


@pytest.mark.oracle
@pytest.mark.parametrize(
    ("temperature", "column", "within"),
    [(75.0, 10, 1e-4), (150.0, 9, 1e-4), (225.0, 8, 1.5e-4), (300.0, 7, 4e-4), (500.0, 6, 1e-3), (1000.0, 5, 2.5e-3)],
)  # states above 3400 cm⁻¹, and that hot ones have other constants
def test_hcn_of_cdms(shared, temperature, column, within):
    """log10 Q of HCN in CDMS counts vibrational states: 0.0288 at 300 K. Its spin weight of 3 (14N) is not in ours."""
    rows = (shared / "reference" / "partition" / "cdms_partfunc.cat").read_text().splitlines()
    theirs = float(next(row for row in rows if row.startswith("|  27501")).split("|")[column - 1])
    rigid = math.log10(3 * partition_function(rotor.read("HCN"), temperature).q)
    factor = math.log10(VibrationalStates.parse(HCN_STATES).factor(temperature))
    assert rigid + factor == pytest.approx(theirs, abs=within)
    if temperature == 300.0:
        assert theirs - rigid == pytest.approx(0.0288, abs=1e-4)
        harmonic = VibrationalStates.parse(HCN_FUNDAMENTALS, harmonic=True)
        assert math.log10(harmonic.factor(300.0)) == pytest.approx(theirs - rigid, abs=4e-4)  # anharmonic overtones


@pytest.mark.oracle
def test_hcn_of_jpl_is_without_vibration(shared):
    rows = (shared / "reference" / "partition" / "jpl_catdir.cat").read_text().splitlines()
    theirs = float(next(row for row in rows if row.startswith(" 27001")).split()[3])
    assert math.log10(3 * partition_function(rotor.read("HCN"), 300.0).q) == pytest.approx(theirs, abs=2e-4)


@pytest.mark.oracle
def test_intensities_of_a_catalogue_are_met_with_vibration_alone(shared):
    """c027501: our LGINT is 0.0288 too high without vibrational states, and right with them."""
    cat = read_cat(shared / "reference" / "catalogues" / "c027501.cat.gz")
    top = rotor.read("HCN")
    plain = line_list(top, jmax=40)
    counted = line_list(top, jmax=40, vibrations=VibrationalStates.parse(HCN_STATES))
    j = cat.quanta_upper[:, 0].astype(int)
    few = (j >= 1) & (j <= 22)  # the lines that the constants were held against
    for lines, expected in ((plain, 0.0288), (counted, 0.0)):
        ours = dict(zip(lines.levels.quanta["j"][lines.upper].tolist(), lines.lgint.tolist(), strict=True))
        off = np.array([ours[k] for k in j[few].tolist()]) - cat.lgint[few]
        assert np.median(off) == pytest.approx(expected, abs=5e-4)  # four decimals of LGINT, states left out
        assert np.ptp(off) < 2e-3  # the dipole's dependence on J, and four decimals


def test_a_factor_lowers_every_line_alike():
    top = replace(rotor.read("CO2"), dipole_abc_debye=(0.1, 0.0, 0.0), symmetry_checked=False)
    parsed = VibrationalStates.parse("667.4x2,1388,2349", harmonic=True)
    for plain, counted in (
        (line_list(top, jmax=10).intensity_nm2_mhz, line_list(top, jmax=10, vibrations=parsed).intensity_nm2_mhz),
        (
            raman_lines(top, jmax=10).cross_section_cm2_per_sr,
            raman_lines(top, jmax=10, vibrations=parsed).cross_section_cm2_per_sr,
        ),
    ):
        assert plain / counted == pytest.approx(parsed.factor(300.0), rel=1e-12)  # round-off
    assert (
        "fundamentals, harmonic, 667.4x2, 1388, 2349 cm-1"
        in line_list(top, jmax=10, vibrations=parsed).partition.source
    )


@pytest.mark.parametrize(
    ("text", "energies", "degeneracies"),
    [("667.4x2,1388,2349 cm-1", (667.4, 1388, 2349), (2, 1, 1)), ("100", (100,), (1,)), ("3×2 THz, 10 cm-1", (100.0692, 10), (2, 1))],
)  # fmt: skip
def test_texts_of_vibrations_are_parsed(text, energies, degeneracies):
    parsed = VibrationalStates.parse(text)
    assert parsed.energies_cm == pytest.approx(energies, rel=1e-6)
    assert parsed.degeneracies == degeneracies


@pytest.mark.parametrize(
    ("text", "said"),
    [("", "expected "), ("667,,1388", "expected "), ("-5", "expected "), ("0", "0.001 cm-1 or more"), ("667x0", "above 0 for each"),
     ("667 D", "unit 'D'"), ("667x1.5", "expected "), ("667 1388", "expected "), ("1e999", "not a finite number")],
)  # fmt: skip
def test_texts_that_mean_nothing(text, said):
    with pytest.raises(ValueError, match=said):
        VibrationalStates.parse(text)


def test_vibrations_that_contradict_are_refused():
    with pytest.raises(ValueError, match="give one of them"):
        line_list(rotor.read("CO"), jmax=2, vibrational_factor=2.0, vibrations=VibrationalStates((2143.0,)))
    with pytest.raises(ValueError, match="above 0 K"):
        vibrational_partition_function([100.0], [1], 0.0)
    with pytest.raises(ValueError, match="for each of 2"):
        vibrational_partition_function([100.0, 200.0], [1], 300.0)
