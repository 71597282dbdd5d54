"""HITRAN's records: byte for byte, number by number, and CO's lines made here against HITRAN's own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from changed_files import mutated
from places import ORACLES

import rotor
from rotor.formats.lines.hitran import (
    HitranLines,
    cm_per_molecule,
    format_hitran,
    format_record,
    hitran_lines,
    nm2_mhz,
    read_hitran,
    write_hitran,
)
from rotor.quantum.effects.of_top import effects_of

SAMPLE = ORACLES / "hitran" / "CO_fragment.par"
TEXT = SAMPLE.read_bytes()


def test_records_come_back_byte_for_byte():
    lines = read_hitran(SAMPLE)
    assert len(lines) == 10
    assert format_hitran(lines) == TEXT
    assert format_hitran(replace(lines, texts={})) == TEXT  # our own spelling is theirs
    assert format_hitran(read_hitran(TEXT.replace(b"\n", b"\r\n"))) == TEXT.replace(b"\n", b"\r\n")


@pytest.mark.oracle
def test_the_sample_is_the_reference_file(shared: Path):
    assert (shared / "reference" / "catalogues" / "hitran_CO_fragment.par").read_bytes() == TEXT


def test_the_numbers_of_a_record():
    record = read_hitran(SAMPLE).record(9)
    assert {k: record[k] for k in ("molecule", "isotopologue", "wavenumber_cm", "intensity_cm", "einstein_a_per_s")} == {
        "molecule": 5, "isotopologue": 1, "wavenumber_cm": 7.68992, "intensity_cm": 2.566e-23, "einstein_a_per_s": 6.914e-7,
    }  # fmt: skip
    assert (record["gamma_air"], record["gamma_self"], record["energy_lower_cm"]) == (0.0748, 0.082, 3.845)
    assert (record["n_air"], record["delta_air"], record["g_upper"], record["g_lower"]) == (0.75, -0.00031, 5.0, 3.0)
    assert (record["local_lower"].strip(), record["global_upper"].strip()) == ("R  1", "0")
    assert read_hitran(SAMPLE).frequency_mhz[9] == pytest.approx(230538.0, abs=0.02)  # six decimals of cm-1


def test_intensities_of_the_two_databases():
    """1 nm² MHz = 1e-14 cm² · 1e6 Hz; over c = 2.99792458e10 cm/s."""
    assert float(cm_per_molecule(1.0)) == pytest.approx(1e-14 * 1e6 / 2.99792458e10, rel=1e-14, abs=0)  # round-off
    assert nm2_mhz(cm_per_molecule([1e-5, 3.0])) == pytest.approx([1e-5, 3.0], rel=1e-14, abs=0)  # round-off


def test_lines_of_co_are_those_of_hitran(tmp_path):
    """J = 2 - 1 of 12C16O, whose abundance HITRAN has as 0.986544: frequency, S, A, E″, weights and labels."""
    lines = rotor.api.line_list(rotor.read("CO"), temperature_k=296.0, jmax=30)
    rotor.write(lines, tmp_path / "co.hitran", settings={"molecule": 5, "isotopologue": 1, "abundance": 0.986544})
    ours, theirs = rotor.read(tmp_path / "co.hitran").record(1), read_hitran(SAMPLE).record(9)
    assert ours["wavenumber_cm"] == pytest.approx(theirs["wavenumber_cm"], abs=1.1e-6)  # print
    assert ours["intensity_cm"] == pytest.approx(
        theirs["intensity_cm"], rel=0.01
    )  # HITRAN states 1 to 2 % (code 7 or 8)
    assert ours["einstein_a_per_s"] == pytest.approx(theirs["einstein_a_per_s"], rel=1e-3)  # as above
    for name in ("energy_lower_cm", "g_upper", "g_lower", "local_upper", "local_lower", "global_upper", "molecule"):
        assert ours[name] == theirs[name]
    assert all(len(line) == 160 for line in (tmp_path / "co.hitran").read_text().splitlines())


def test_labels_of_other_tops():
    water = hitran_lines(rotor.api.line_list(rotor.read("H2O"), temperature_k=296.0, jmax=2), molecule=1)
    assert water.local_upper[0] == "  1  1  0      "
    assert water.local_lower[0] == "  1  0  1      "
    assert water.global_upper[0].strip() == "GROUND"
    assert (np.diff(water.wavenumber_cm) >= 0).all()
    cyanide = hitran_lines(rotor.api.line_list(rotor.read("CH3CN"), temperature_k=296.0, jmax=2), molecule=41)
    assert sorted(cyanide.local_upper) == ["  1  0         ", "  2  0         ", "  2  1         "]


def test_inversion_states_are_called_by_their_names():
    lines = rotor.api.line_list(rotor.read("NH3"), temperature_k=296.0, jmax=2)
    computed = hitran_lines(lines, molecule=11)
    pairs = set(zip(map(str.strip, computed.global_upper), map(str.strip, computed.global_lower), strict=True))
    assert pairs == {("0-", "0+"), ("0+", "0-")}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text[:150] + b"\n", "line 1, column 151: the line has 150 characters"),
        (lambda text: b"   " + text[3:], "line 1, column 1: molecule reads"),
        (lambda text: text[:2] + b"*" + text[3:], "column 3: isotopologue reads"),
        (lambda text: text[:170] + b"x" + text[171:], "line 2, column 4: wavenumber_cm reads"),
        (lambda text: text[:160] + b" \n" + text[161:], "the line has 161 characters"),
    ],
)
def test_an_illegal_record_is_refused_with_line_column_and_rule(change, words):
    with pytest.raises(ValueError, match=words):
        read_hitran(change(TEXT))


def test_what_has_no_place_in_a_record_is_refused():
    record = read_hitran(SAMPLE).record(0)
    for name, value in (("molecule", 123), ("isotopologue", 99), ("gamma_air", 12.5), ("wavenumber_cm", np.nan)):
        with pytest.raises(ValueError, match=f"{name} = "):
            format_record({**record, name: value})
    assert format_record({**record, "isotopologue": 10})[2] == "0"
    assert format_record({**record, "isotopologue": 11})[2] == "A"


def test_what_is_no_list_for_hitran_is_refused(tmp_path):
    lines = rotor.api.line_list(rotor.read("CO"), jmax=3)
    with pytest.raises(ValueError, match="296 K, the list was made for 300 K"):
        hitran_lines(lines, molecule=5)
    at_296 = rotor.api.line_list(rotor.read("CO"), jmax=3, temperature_k=296.0)
    with pytest.raises(ValueError, match="number of the molecule"):
        rotor.write(at_296, tmp_path / "co.hitran")
    split = rotor.read("CH3Cl")
    split = rotor.api.line_list(split, jmax=2, temperature_k=296.0, effects=effects_of(split, True))
    with pytest.raises(ValueError, match="lines split by spins"):  # F = 5/2 has no place among whole numbers
        hitran_lines(split, molecule=24)
    with pytest.raises(ValueError, match=r"abundance 1\.2"):
        hitran_lines(at_296, molecule=5, abundance=1.2)
    assert list(tmp_path.iterdir()) == []


def test_a_par_file_of_hitran_is_told_from_one_of_spfit(tmp_path):
    assert len(rotor.read(SAMPLE)) == 10
    write_hitran(read_hitran(SAMPLE), tmp_path / "co.hitran")
    assert (tmp_path / "co.hitran").read_bytes() == TEXT
    (tmp_path / "ocs.par").write_bytes((SAMPLE.parents[1] / "ocs" / "ocs.var").read_bytes())
    assert rotor.read(tmp_path / "ocs.par").kind == "linear"


def test_a_changed_column_is_written_and_the_others_as_they_were():
    lines = read_hitran(TEXT.replace(b"0.760-", b"0.76 -", 1).replace(b".07970.086", b".0797.0860"))
    assert lines.texts
    moved = replace(lines, wavenumber_cm=lines.wavenumber_cm + np.eye(10)[2])
    changed, before = format_hitran(moved).splitlines(), format_hitran(lines).splitlines()
    assert [a == b for a, b in zip(changed, before, strict=True)] == [i != 2 for i in range(10)]


def read_or_refuse(text: bytes) -> HitranLines | str:
    try:
        return read_hitran(text)
    except ValueError as refusal:
        return str(refusal)


def test_mutated_records_are_read_and_come_back_or_are_refused():
    rng, read = np.random.default_rng(3), 0
    for _ in range(1500):
        text = mutated(TEXT, rng)
        computed = read_or_refuse(text)
        if isinstance(computed, str):
            assert "the text given, line " in computed
        else:
            assert format_hitran(computed) == text
            read += 1
    assert 100 < read < 1400  # both outcomes are really tried
