"""What SPCAT does with its input files: limits, cut, weights, doublets, Q, and what it does in silence."""

from __future__ import annotations

import shutil
from dataclasses import replace

import numpy as np
import pytest
from changed_files import mutated
from oracle_cases import SAMPLES

from rotor.formats.spcat.file_lines import least_intensity
from rotor.formats.spcat.predict import predict, predict_file
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.par import read_par

PAR = b"water\n 3 0 0 0\na 1 1 0 9 0 2 1 3 0 1 %d\n 10000 835840.3 0\n 20000 435351.7 0\n 30000 278138.7 0\n%s"
INT = b"water\n 0 18003 178.1 %d %d %s 99999 300\n 2 1.8546\n"


def water(*, diag: int = 3, more: bytes = b"", fbgn: int = 0, fend: int = 9, cut: bytes = b"-20 -20"):
    return predict(read_par(PAR % (diag, more)), read_int(INT % (fbgn, fend, cut)))


def files(case: str):
    folder = SAMPLES / case
    return read_par(folder / f"{case}.var"), read_int(folder / f"{case}.int")


def test_f_runs_from_fbgn_to_fend():
    whole, part = water().catalogue, water(fbgn=2, fend=5).catalogue
    j = np.stack([whole.quanta_upper[:, 0], whole.quanta_lower[:, 0]])
    assert (j.min(), j.max()) == (0, 9)
    assert len(part) == np.count_nonzero((j.min(axis=0) >= 2) & (j.max(axis=0) <= 5))


@pytest.mark.parametrize("cut", [(-5.0, -100.0), (-100.0, -6.0), (-5.0, -5.5)])
def test_a_line_is_cut_by_both_strengths(cut):
    """10^STR0 + 10^STR1 (ν/300 GHz)², against the formula applied to the whole list."""
    whole = water().catalogue
    least = 10 ** cut[0] + 10 ** cut[1] * (whole.frequency_mhz / 300e3) ** 2
    cut_list = water(cut=b"%f %f" % cut).catalogue
    assert 0 < len(cut_list) < len(whole)
    np.testing.assert_array_equal(cut_list.frequency_mhz, whole.frequency_mhz[10**whole.lgint > least])


def test_the_cut_at_300_ghz_is_the_sum_of_both():
    request = read_int(INT % (0, 9, b"-9 -8")).request
    assert least_intensity(request, np.array([3e5]))[0] == pytest.approx(1.1e-8, rel=1e-12)  # round-off


def test_weights_stand_as_the_file_has_them_and_q_with_them():
    parameters, request = files("h2co")
    option = parameters.options[0]
    threefold = replace(parameters, options=(replace(option, wtpl=3, wtmn=9, text=""),))
    q_thrice = replace(request, request=replace(request.request, qrot=3 * request.request.qrot))
    once, thrice = predict(parameters, request).catalogue, predict(threefold, q_thrice).catalogue
    np.testing.assert_array_equal(thrice.g_upper, 3 * once.g_upper)
    np.testing.assert_allclose(thrice.lgint, once.lgint, atol=1e-12)  # round-off
    unchanged_q = predict(threefold, request).catalogue
    assert unchanged_q.lgint.max() - once.lgint.max() == pytest.approx(np.log10(3), abs=1e-12)  # round-off


def test_energies_count_from_zero_where_the_lowest_level_does_not_exist():
    """With J = 0 absent E″ of the first line is still that of J = 1, and so is its Boltzmann factor."""
    odd = predict(read_par(b"x\n 3 0 0 0\na 1 1 0 9 0 2 0 1\n 10000 9e4 0\n 20000 5e4 0\n 30000 4e4 0\n"),
                  read_int(b"x\n 0 1 7 0 2 -90 -90 9999 5\n 2 1\n"))  # fmt: skip
    line = int(np.argmin(odd.catalogue.energy_lower_cm))
    lower = odd.catalogue.energy_lower_cm[line] * 29979.2458
    assert odd.catalogue.quanta_lower[line, :3].tolist() == [1, 0, 1]
    assert lower == pytest.approx(9e4, rel=1e-12)  # B + C, round-off
    kt, f = 5 * 20836.619, odd.catalogue.frequency_mhz[line]
    s = odd.lines.strength_debye2[line]
    expected = 4.16231e-5 * f * s * np.exp(-lower / kt) * -np.expm1(-f / kt) / 7
    assert 10 ** odd.catalogue.lgint[line] == pytest.approx(expected, rel=1e-6, abs=0)  # kB/h to 8 digits


def test_k_doublets_are_parted_as_the_program_parts_them():
    """J = 4 - 3: K = 3 as -3 ← 3 and 3 ← -3, K = 1 and 2 twice with one label, K = 0 once."""
    listed = predict_file(SAMPLES / "ch3cn" / "ch3cn.int").catalogue
    four = listed.quanta_upper[:, 0] == 4
    pairs = zip(listed.quanta_upper[four, 1].tolist(), listed.quanta_lower[four, 1].tolist(), strict=True)
    assert list(pairs) == [(-3, 3), (3, -3), (2, 2), (2, 2), (1, 1), (1, 1), (0, 0)]
    assert listed.g_upper[four].tolist() == [18, 18, 9, 9, 9, 9, 18]


def test_what_the_program_does_in_silence_is_said():
    assert water().notes == ()
    assert (
        water(fend=12).notes[0].startswith("KNMAX = 9 of state 0: as the file says, other K are left out of the basis")
    )
    quartic = b" 2000 -974.0 0\n 1100 173.0 0\n 200 -37.6 0\n"
    text = (PAR % (0, quartic)).replace(b" 3 0 0 0", b" 6 0 0 0").replace(b"0 9 0", b"0 30 0")
    request = read_int(INT % (0, 25, b"-20 -20"))
    assert "from N = " in predict(read_par(text), request).notes[0]
    assert predict(read_par(text.replace(b"1 3 0 1 0", b"1 3 0 1 3")), request).notes == ()
    assert (
        "NPAR = 5, but the file has 3 parameters"
        in predict(read_par((PAR % (3, b"")).replace(b" 3 0", b" 5 0", 1)), request).notes[0]
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"fbgn": 5, "fend": 2}, "F runs from FBGN to FEND"),
        ({"fend": 360}, "from 0 to 359"),
    ],
)
def test_what_cannot_be_predicted_is_refused(change, words):
    change = {**change}
    if "more" in change:
        parameters = read_par((PAR % (3, change["more"])).replace(b" 3 0 0 0", b" 4 0 0 0"))
        with pytest.raises(ValueError, match=words):
            predict(parameters, read_int(INT % (0, 9, b"-20 -20")))
    else:
        with pytest.raises(ValueError, match=words):
            water(**change)


@pytest.mark.parametrize(("word", "value"), [(b"178.1", b"0"), (b" 300", b" 0"), (b"178.1", b"-3")])
def test_a_q_or_temperature_of_nothing_is_refused(word, value):
    with pytest.raises(ValueError, match=r"QROT|temperature|Q ="):
        predict(read_par(PAR % (3, b"")), read_int((INT % (0, 9, b"-20 -20")).replace(word, value)))


def test_var_comes_before_par_and_one_of_them_must_be_there(tmp_path):
    shutil.copy(SAMPLES / "ocs" / "ocs.int", tmp_path / "ocs.int")
    with pytest.raises(ValueError, match=r"its \.var or \.par must stand beside it"):
        predict_file(tmp_path / "ocs.int")
    text = (SAMPLES / "ocs" / "ocs.var").read_bytes()
    (tmp_path / "ocs.par").write_bytes(text.replace(b"6.0", b"7.0"))
    other = predict_file(tmp_path / "ocs.int").catalogue.frequency_mhz[0]
    (tmp_path / "ocs.var").write_bytes(text)
    assert predict_file(tmp_path / "ocs.int").catalogue.frequency_mhz[0] < other


def read_or_refuse(parameters: bytes, request: bytes):
    try:
        par, expected = read_par(parameters), read_int(request)
        return (
            None if expected.request.fend > 30 else predict(par, expected)
        )  # a larger list says no more, and takes long
    except ValueError as refusal:
        return str(refusal)


def test_mutated_files_are_predicted_or_refused():
    """Nothing but a prediction with finite numbers or a sentence comes out of damaged input."""
    rng = np.random.default_rng(5)
    texts = [
        [(SAMPLES / case / f"{case}{suffix}").read_bytes() for suffix in (".var", ".int")]
        for case in ("h2o_octic", "ocs")
    ]
    predicted = refused = 0
    for i in range(300):
        pair = list(texts[i % 2])
        pair[i % 3 == 0] = mutated(pair[i % 3 == 0], rng)
        pair[1] = pair[1].replace(b" 0 20 ", b" 0 6 ").replace(b" 0 100 ", b" 0 6 ")
        computed = read_or_refuse(*pair)
        if isinstance(computed, str):
            refused += len(computed) > 10
        elif computed is not None:
            lines = computed.catalogue
            assert np.isfinite([lines.frequency_mhz, lines.lgint, lines.energy_lower_cm]).all()
            predicted += 1
    assert min(predicted, refused) > 40  # both outcomes are really tried
