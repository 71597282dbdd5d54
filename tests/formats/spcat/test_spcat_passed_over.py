"""What SPCAT and SPFIT pass over in files of users: states that do not exist, levels that fit no column, v = 0 in a list of lines."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import rotor
from rotor.cli import run
from rotor.formats.lines.assigned_lines import read_assigned_lines
from rotor.formats.spcat.fits.fit_input import spfit_input
from rotor.formats.spcat.predict import predict
from rotor.formats.spcat.text.cat import read_cat
from rotor.formats.spcat.text.egy import read_egy
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.lin import read_lin
from rotor.formats.spcat.text.par import read_par

TWO = (
    b"two states\n 5 9 1 0 0.0 1.0e6 1.0 1.0\na 1 2 0 60 0 1 1 1 0 1 0\n"
    b"10099 9400.0 1e36\n20099 3100.0 1e36\n30099 2500.0 1e36\n11 900.0 1e36\n1122 -1.5 1e36\n"
)
REQUEST = b"two states\n1 76004 1000.0 0 3 -19.0 -19.0 9000.0 300.0\n1 1.2\n111 1.2\n"
SAID = "parameter 1122 is left out, as SPCAT does: state 2 does not exist, NVIB = 2 counts from 0"


def test_a_parameter_of_a_state_that_does_not_exist_is_left_out():
    prediction = predict(read_par(TWO), read_int(REQUEST))
    without = predict(read_par(TWO.replace(b"1122 -1.5 1e36\n", b"").replace(b" 5 9", b" 4 9")), read_int(REQUEST))
    assert SAID in prediction.notes
    assert prediction.catalogue.frequency_mhz.tolist() == without.catalogue.frequency_mhz.tolist()
    assert without.notes == ()
    zero = predict(read_par(TWO.replace(b"1122 -1.5", b"1122 0.0")), read_int(REQUEST))
    assert zero.notes == ()  # nothing is left out


def test_of_one_state_too():
    """A file whose constants have names otherwise."""
    single_state = (
        TWO.replace(b"a 1 2 0", b"a 1 1 0")
        .replace(b"11 900.0 1e36\n", b"")
        .replace(b"1122", b"1111")
        .replace(b" 5 9", b" 4 9")
    )
    prediction = predict(read_par(single_state), read_int(REQUEST))
    assert (
        "parameter 1111 is left out, as SPCAT does: state 1 does not exist, NVIB = 1 counts from 0" in prediction.notes
    )
    assert len(prediction.catalogue) > 5


def test_a_fit_passes_over_it_too(tmp_path: Path):
    (tmp_path / "a.lin").write_text("  1  0  1  0  0  0  0  0".ljust(36) + " 5600.0 0.01\n")
    assert SAID in spfit_input(read_par(TWO), read_lin(tmp_path / "a.lin", 4, 9), "a.lin").notes


def test_names_leave_it_out_with_the_reason(tmp_path: Path):
    """The top of named constants is the same with and without the parameter, for one state and for two."""
    without = TWO.replace(b"1122 -1.5 1e36\n", b"").replace(b" 5 9", b" 4 9")
    for name, content in {"two": TWO, "less": without}.items():
        (tmp_path / f"{name}.par").write_bytes(content)
    top, less = (rotor.read(tmp_path / f"{name}.par") for name in ("two", "less"))
    assert SAID in top.notes
    assert top.constants == less.constants
    assert dict(top.states.values) == dict(less.states.values)


@pytest.mark.parametrize("code", [b"110010000", b"1111"])
@pytest.mark.parametrize("verb", ["info", "levels", "convert"])
def test_verbs_pass_over_spins_and_states_that_one_state_does_not_have(verb, code, tmp_path, monkeypatch, capsys):
    """A spin while SPIND is 1, and state 1 of one: a note in every verb, and numbers as without the parameter."""
    monkeypatch.chdir(tmp_path)
    head = b"one\n 4 9 1 0 0.0 1.0e6 1.0 1.0\na 1 1 0 60 0 1 1 1 0 1 0\n10000 9400.0 1e36\n20000 3100.0 1e36\n30000 2500.0 1e36\n"
    Path("one.par").write_bytes(head + code + b" -71.0 1e36\n")
    Path("less.par").write_bytes(head.replace(b" 4 9", b" 3 9"))
    outs = {}
    for name in ("one", "less"):
        words = {"info": [], "levels": ["--j", "0:2"], "convert": [f"{name}.toml"]}[verb]
        assert run([verb, f"{name}.par", *words]) == 0
        said = capsys.readouterr()
        assert (f"parameter {code.decode()} is left out, as SPCAT does" in said.err) == (name == "one")
        written = Path(f"{name}.toml").read_text() if verb == "convert" else said.out
        outs[name] = [line for line in written.splitlines() if "left out, as SPCAT does" not in line]
    assert [line.replace("one.", "less.") for line in outs["one"]] == outs["less"]


def test_levels_that_fit_no_column_leave_the_catalogue(tmp_path: Path, monkeypatch, capsys):
    """An energy of ten digits before the point; the message names the level and the number in the words of the format."""
    monkeypatch.chdir(tmp_path)
    wide = TWO.replace(b"11 900.0", b"11 9.0e14")
    (tmp_path / "a.var").write_bytes(wide)
    (tmp_path / "a.int").write_bytes(REQUEST)
    assert run(["spectrum", "a.int", "--cat", "a.cat", "--egy", "a.egy", "--top", "0"]) == 1
    error = capsys.readouterr().err
    assert re.search(
        r"error: --egy: a\.egy is not written: level 0 0 0 1: EGY = 3\.0\d+e\+10 does not fit the columns", error
    )
    assert "Level(" not in error
    assert len(read_cat(tmp_path / "a.cat")) > 5
    assert not (tmp_path / "a.egy").exists()
    (tmp_path / "a.var").write_bytes(TWO)
    assert run(["spectrum", "a.int", "--egy", "a.egy", "--top", "0"]) == 0
    assert len(read_egy(tmp_path / "a.egy")) == 2 * 16


LINES = (
    ((1, 0, 1), (0, 0, 0), 5600.0), ((2, 1, 2), (1, 1, 1), 10600.0), ((2, 1, 1), (1, 1, 0), 11800.0),
    ((1, 1, 1), (0, 0, 0), 11900.0),
)  # fmt: skip


def _list_of_lines(v: int, fillers: int) -> str:
    rows = [("".join(f"{q:3d}" for q in (*up, v, *low, v, *[0] * fillers)).ljust(36), f) for up, low, f in LINES]
    return "".join(f"{labels} {frequency:.4f} 0.01\n" for labels, frequency in rows)


@pytest.mark.parametrize("fillers", [0, 4])
def test_v_of_one_state_in_a_list_of_lines(tmp_path: Path, monkeypatch, fillers: int):
    """J Ka Kc v of both states, and zeros in the fields behind them, as programs write them that fill all twelve."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "v.lin").write_text(_list_of_lines(0, fillers))
    lines, _ = read_assigned_lines("v.lin", ("j", "ka", "kc"))
    assert np.array_equal(lines.upper, [up for up, _, _ in LINES])
    assert np.array_equal(lines.lower, [low for _, low, _ in LINES])
    assert run(["fit", "v.lin", "--constants", "A=9400.1 B=3100 C=2500", "--free", "A,B,C"]) == 0


def test_another_v_is_refused_with_both_meanings(tmp_path: Path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "v.lin").write_text(_list_of_lines(1, 0))
    assert run(["fit", "v.lin", "--constants", "A=9400.1 B=3100 C=2500", "--free", "A,B,C"]) == 2
    assert "a number v of the state needs [states] there" in capsys.readouterr().err
