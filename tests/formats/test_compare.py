"""Catalogues side by side: what is matched, merged, missing, extra; measured lines merged in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from oracle_cases import SAMPLES, prediction

from rotor.formats.lines.line_tables import catalogue
from rotor.formats.spcat.compare import agreement, compare, in_mhz, likely_temperature_k, with_measured_lines
from rotor.formats.spcat.text.cat import read_cat
from rotor.formats.spcat.text.catalogue import Layout

FIRST_LINE = b"  115271.2018  0.0005 -5.0105 2    0.0000  3  28503 101 1           0           \n"
TWO = b"  230538.0000  0.0005 -4.1197 2    3.8450  5 -28503 101 2           1           \n"
DOUBLET = (
    b"   73577.4513  0.0000 -3.8105 3   48.3748 18  41505 202 4-3         3 3         \n"
    b"   73577.4513  0.0000 -3.8105 3   48.3748 18  41505 202 4 3         3-3         \n"
)


def test_a_list_is_equal_to_itself_and_a_change_is_seen():
    ours = prediction(SAMPLES / "so2").catalogue
    same = compare(ours, ours)
    assert len(same.our_rows) == len(ours)
    assert (len(same.missing), len(same.extra), np.abs(same.differences("lgint")).max()) == (0, 0, 0)

    rng = np.random.default_rng(1)
    shuffled = ours.take(rng.permutation(len(ours))[5:])
    shuffled = replace(shuffled, frequency_mhz=shuffled.frequency_mhz + 0.25)
    comparison = compare(ours, shuffled)
    assert (len(comparison.our_rows), len(comparison.missing), len(comparison.extra)) == (len(ours) - 5, 5, 0)
    np.testing.assert_allclose(comparison.differences("frequency_mhz"), 0.25, atol=1e-9)  # round-off of 1e7 MHz
    assert len(compare(shuffled, ours).extra) == 5


def test_components_of_a_doublet_are_one_line_whatever_the_signs():
    merged = replace(read_cat(DOUBLET).take([0]), lgint=[np.log10(2) - 3.8105], g_upper=[36])
    comparison = compare(read_cat(DOUBLET), merged)
    assert (len(comparison.our_rows), len(comparison.missing), len(comparison.extra)) == (1, 0, 0)
    assert comparison.differences("lgint")[0] == pytest.approx(0, abs=1e-12)  # round-off
    assert comparison.differences("g_upper")[0] == 0
    apart = replace(read_cat(DOUBLET), frequency_mhz=[73577.4513, 73577.4523])
    assert len(compare(read_cat(DOUBLET), apart).extra) == 1  # 1 kHz apart: two lines


def test_lines_of_other_states_are_counted_not_compared():
    ground = b"  115271.2018  0.0005 -5.0105 2    0.0000  3  285031202 1 0         0 0         \n"
    excited = b"  114221.7523  0.0005 -9.0105 2 2143.2711  3  285031202 1 1         0 1         \n"
    comparison = compare(read_cat(ground + excited), read_cat(FIRST_LINE))
    assert (len(comparison.our_rows), len(comparison.missing), comparison.other_states) == (1, 0, 1)


def test_strengths_of_many_decades_are_added_without_loss():
    weak = replace(read_cat(DOUBLET), lgint=[-400.0, -400.0])
    assert compare(weak, weak).ours.lgint[0] == pytest.approx(np.log10(2) - 400, abs=1e-12)  # round-off


def test_wavenumbers_become_mhz():
    line = read_cat(FIRST_LINE.replace(b"  115271.2018  0.0005", b"       3.8450 -0.0005"))
    assert [float(x[0]) for x in in_mhz(line)] == pytest.approx([3.845 * 29979.2458, 0.0005 * 29979.2458], rel=1e-12)
    infrared = replace(read_cat(FIRST_LINE), frequency_mhz=[2.0], error_mhz=[0.5], layout=Layout(decimals=(6, 6, 4, 4)))
    assert [float(x[0]) for x in in_mhz(infrared)] == pytest.approx([2 * 29979.2458, 0.5 * 29979.2458], rel=1e-12)


def test_agreement_counts_measured_lines_alone():
    predicted = replace(read_cat(FIRST_LINE + TWO), frequency_mhz=[0.0, 230538.0014], tag=[28503, 28503])
    computed = agreement(compare(read_cat(FIRST_LINE + TWO), predicted))
    assert (computed.lines, computed.within_3_sigma, computed.no_error) == (1, 1.0, 0)  # 1.4 kHz, σ 0.5 kHz
    assert computed.median_mhz == computed.rms_mhz == pytest.approx(0.0014, abs=1e-9)  # round-off of 1e5 MHz
    further = replace(predicted, frequency_mhz=[0.0, 230538.0016])
    assert agreement(compare(read_cat(FIRST_LINE + TWO), further)).within_3_sigma == 0.0
    exact = replace(read_cat(FIRST_LINE + TWO), error_mhz=[0.0, 0.0])
    assert agreement(compare(exact, further)).no_error == 1
    assert agreement(compare(read_cat(FIRST_LINE), predicted)).lines == 0


def test_measured_lines_take_their_places():
    predicted = read_cat(DOUBLET + FIRST_LINE + TWO.replace(b"-28503", b" 28503"))
    measured = read_cat(
        TWO + DOUBLET[:81].replace(b"73577.4513  0.0000", b"240000.123  0.0300").replace(b"  41505", b" -41505")
    )
    merged = with_measured_lines(predicted.take(slice(2, 4)), measured.take(slice(0, 1)))
    assert merged.frequency_mhz.tolist() == [115271.2018, 230538.0]
    assert merged.tag.tolist() == [28503, -28503]
    both = with_measured_lines(predicted.take(slice(0, 2)), measured.take(slice(1, 2)))
    assert both.frequency_mhz.tolist() == [240000.123, 240000.123]
    assert both.error_mhz.tolist() == [0.03, 0.03]
    assert both.tag.tolist() == [-41505, -41505]


def test_two_measured_frequencies_of_one_label_are_refused():
    twice = read_cat(TWO + TWO.replace(b"230538.0000", b"230539.0000"))
    with pytest.raises(ValueError, match="have one label"):
        with_measured_lines(read_cat(FIRST_LINE), twice)


SPLIT = (  # J = 1 - 0 of CH3-37Cl (JPL, c052009): F = 5/2, 1/2, 3/2 above F = 3/2, rounded up
    b"   26164.4901  0.0010 -5.8078 3   -0.0000  8 -52009 213 1 0 2       0 0 2       \n"
    b"   26179.2202  0.0010 -5.6313 3   -0.0000 12 -52009 213 1 0 3       0 0 2       \n"
    b"   26190.9981  0.0010 -6.1082 3   -0.0000  4  52009 213 1 0 1       0 0 2       \n"
)
WHOLE = b"   26175.5000  0.0010 -5.3300 3    0.0000  6  52009 202 1 0         0 0         \n"


def test_components_of_a_spin_are_one_line_beside_a_list_without():
    comparison = compare(read_cat(SPLIT), read_cat(WHOLE))
    assert (len(comparison.our_rows), len(comparison.missing), len(comparison.extra), comparison.collapsed) == (
        1,
        0,
        0,
        True,
    )
    weights = 10.0 ** np.array([-5.8078, -5.6313, -6.1082])
    centre = weights @ [26164.4901, 26179.2202, 26190.9981] / weights.sum()
    assert comparison.reference.frequency_mhz[0] == pytest.approx(centre, abs=1e-9)  # round-off of 3e4 MHz
    assert comparison.reference.lgint[0] == pytest.approx(np.log10(weights.sum()), abs=1e-12)  # round-off
    assert comparison.reference.tag[0] == 52009  # one component was not measured
    turned = compare(read_cat(WHOLE), read_cat(SPLIT))
    assert turned.differences("frequency_mhz")[0] == pytest.approx(centre - 26175.5, abs=1e-9)  # round-off
    assert not compare(read_cat(SPLIT), read_cat(SPLIT)).collapsed


@pytest.mark.oracle
def test_a_catalogue_with_quadrupole_splitting_meets_an_unsplit_prediction(shared):
    import rotor

    reference = read_cat(shared / "reference" / "library_lines" / "c052009.cat.gz")  # 6438 components of CH3-37Cl
    # round constants that its own lines of low J and K give
    top = rotor.Top.from_constants("A=156051.5 B=13088.168 DJ=0.01753 DJK=0.1937 MHz", dipole_abc_debye=(1.9, 0, 0))
    ours = catalogue(rotor.api.line_list(top, jmax=82, min_lgint=-99.0, untrusted=True))
    comparison = compare(reference, ours)
    assert comparison.collapsed
    assert (len(comparison.our_rows), len(comparison.missing)) == (
        1186,
        0,
    )  # every line of the catalogue has its partner
    off = (
        np.abs(comparison.differences("frequency_mhz")) / comparison.reference.frequency_mhz[comparison.reference_rows]
    )
    j, k = np.abs(comparison.reference.quanta_upper[comparison.reference_rows, :2].T)
    inside = (j <= 49) & (k <= 9)
    assert inside.sum() == 445
    assert off[inside].max() < 3e-5  # 2.7e-5: constants without sextic terms
    assert 700 < (off < 3e-5).sum() < 750  # 724: above J = 49 and K = 9 sextic terms are felt


def test_the_temperature_of_intensities_is_found():
    import rotor

    top = rotor.read("OCS")
    cold, warm = (catalogue(rotor.api.line_list(top, temperature_k=t, jmax=40, min_lgint=-20.0)) for t in (75.0, 300.0))
    assert likely_temperature_k(compare(cold, warm), 300.0) == pytest.approx(75.0, rel=0.011)  # steps of 1 %
    assert likely_temperature_k(compare(warm, warm), 300.0) == pytest.approx(300.0, rel=0.011)
    assert np.isnan(likely_temperature_k(compare(cold.take([0]), warm), 300.0))
