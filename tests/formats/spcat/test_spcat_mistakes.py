"""Mistakes in files of SPCAT and SPFIT: what is said names the file, the place, the rule and what would do."""

from __future__ import annotations

from pathlib import Path

import pytest

PAR = """two states
  6    3   10    0    0.0  1.0E+06  1.0 1.0
a 1 2 0 60 0 1 1 1 0 1 0
  10099  9400.0 1E-37 /A
  20099  3100.0 1E36 /B
  30099  2500.0 1E-37 /C
     11   900.0 1E-37 /E1
  60011     2.0 1E-37 /dE
 600001    20.0 1E-37 /Gc
"""
INT = "two states\n1 76004 1000.0 0 3 -19.0 -19.0 9000.0 300.0\n1 1.2\n111 1.2\n"
LIN = "  1  0  1  0  0  0  0  0              5600.0 0.1\n  2  0  2  0  1  0  1  0             11180.0 0.1\n"


def _files(par: str = PAR, request: str = INT, lin: str = LIN, suffix: str = ".par") -> None:
    for name, text in ((f"case{suffix}", par), ("case.int", request), ("case.lin", lin)):
        Path(name).write_text(text)


@pytest.mark.parametrize(
    ("par", "request_text", "said"),
    [
        (
            PAR.replace(" 600001", "6600001"),
            INT,
            "case.int with case.var: parameter 6600001 /Gc: N_z S_z together with another operator is read but not computed yet; "
            "leave it out, or correct the code, which reads NS = 6, TYP = 60, V1 = 1",
        ),
        (PAR.replace("60 0 1 1 1", "60 0 12 1 1"), INT, "case.int with case.var: IAX = 12 of state 0"),
        (
            PAR.replace("  10099", " -10099").replace("3100.0 1E36", "3100.0 0.1"),
            INT,
            "case.int with case.var: parameter -10099 /A: the first one has none before it to keep a ratio to",
        ),
        (
            PAR.replace("a 1 2", "a 4444444444 2"),
            INT,
            "SPIND = 4444444444 of state 0 names 10 spins: expected at most 9",
        ),
        (PAR.replace("     11   900.0", "     11 -1.0e30"), INT, "the lowest level lies at -3.34e+25 cm-1"),
        (PAR, INT.replace("111 1.2", "114 1.2"), "case.int with case.var: dipole 114: SYM = 4"),
        (PAR, INT.replace("1000.0", "0.0"), "case.int with case.var: QROT = 0.0"),
        (
            PAR.replace("a 1 2 0 60 0 1 1 1 0 1 0\n", ""),
            INT,
            "case.var, line 3, column 17: KNMIN = 1E-37: expected a whole number; this is the option line, CHR SPIND NVIB KNMIN",
        ),
        (
            PAR.replace("1 1 1 0 1 0", "1 1 1 -1 1 0"),
            INT,
            "KNMIN = 1E-37: expected a whole number; VSYM below 0 in the line before says that this is another option line",
        ),
        (
            PAR,
            INT.replace("two states\n", ""),
            "line 2, behind a title, is FLAGS TAG QROT FBGN FEND STR0 STR1 FQLIM TEMP",
        ),
    ],
)
def test_a_mistake_in_a_prediction_is_named_with_its_file(call, par: str, request_text: str, said: str):
    _files(par, request_text, suffix=".var")
    code, _, err = call("spectrum", "case.int", "--top", "0")
    assert code == 2
    assert said in " ".join(err.split())


@pytest.mark.parametrize(
    ("par", "request_text", "said"),
    [
        (
            PAR,
            INT + "121 1.2\n",
            "dipole 121 is left out, as SPCAT does: state 2 does not exist, NVIB = 2 counts from 0",
        ),
        (
            PAR.replace("  6    3", "  5    3"),
            INT,
            "NPAR = 5: the line behind so many parameters, 600001 20.0 1E-37 /Gc, does not count",
        ),
        (
            PAR.replace("a 1 2", "a 1 3"),
            INT,
            "state 2 has no parameter of its own, not even an energy (V1 = V2 = 2), alone those of all states",
        ),
        (
            PAR.replace("a 1 2", "a 1 20").partition("     11")[0],
            INT,
            "parameter 10099 is left out, as SPCAT does: it reads V1 = 99, V2 = 0; with NVIB = 20 a state has 2 digits",
        ),
        (
            PAR.replace("a 1 2", "a 1 100").partition("     11")[0].replace("0099", "009999"),
            INT,
            "parameter 1009999 is left out, as SPCAT does: it reads V1 = 999, V2 = 9; with NVIB = 100 a state has 3 digits",
        ),
        (
            PAR.replace("a 1 2", "a 1 20").partition("     11")[0],
            INT,
            "state 1 has no parameter of its own, not even an energy (V1 = V2 = 1), and no parameter is of all states",
        ),
    ],
)
def test_what_a_prediction_passes_over_is_said(call, par: str, request_text: str, said: str):
    _files(par, request_text, suffix=".var")
    code, _, err = call("spectrum", "case.int", "--top", "0")
    assert code == 0
    assert said in " ".join(err.split())


def test_what_many_states_have_in_common_is_said_three_times_and_counted(call):
    _files(PAR.replace("a 1 2", "a 1 9"), INT + "".join(f"1{v}1 1.2\n" for v in "9999999"), suffix=".var")
    _, _, err = call("spectrum", "case.int", "--top", "0")
    assert err.count("has no parameter of its own") == 3
    assert "note: 4 more states have no parameters of their own either\n" in err
    assert err.count("dipole 191 is left out") == 3
    assert "note: 4 more dipoles are left out likewise\n" in err


TOP = "ammonia\n 4 1\ns -1 1 0 20 0 6 4 4 {}\n 1000 300.0 1e-37\n 100 5000.0 1e-37\n 2000 -30.0 1e-37\n 60000 1e-6 1e-37\n"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ("", "levels of E species weigh 99, which SPCAT takes where an option line has no EWT; the others weigh 4"),
        (
            "0 2 3",
            "from N = 4 on the diagonal of the Hamiltonian falls with K (rises, in an oblate basis): where K is mixed, DIAG = 3",
        ),
        ("0 2 1", ""),
    ],
)
def test_weights_of_a_threefold_axis_that_may_surprise_are_said(call, options: str, said: str):
    _files(TOP.format(options), "x\n0 1 1000 0 6 -20. -20. 9000.0 300.0\n1 1.0\n", suffix=".var")
    code, _, err = call("spectrum", "case.int", "--top", "0")
    assert code == 0
    assert said in " ".join(err.split())
    assert bool(said) == ("weigh" in err)


def test_correlations_behind_the_parameters_are_no_parameter(call):
    _files(PAR + " 1.0000000 0.1200000 0.9900000\n", suffix=".var")
    assert "does not count" not in call("spectrum", "case.int", "--top", "0")[2]


def test_a_priori_errors_are_said_to_be_the_errors_of_lines(call):
    _files(PAR.replace("1E36", "0.5"))
    assert "errors of lines are from the a-priori errors of case.par" in call("spectrum", "case.int", "--top", "0")[2]
    Path("case.par").rename("case.var")
    assert "a-priori" not in call("spectrum", "case.int", "--top", "0")[2]


@pytest.mark.parametrize(
    ("par", "said"),
    [
        (PAR.replace("  60011     2.0", "9000011     2.0"), None),
        (
            PAR.replace(" 600001", "1000600001"),
            "case.var with case.int: parameter 1000600001 /Gc: FF, EX, TYP 90 to 99",
        ),
    ],
)
def test_a_conversion_names_file_and_parameter(call, par: str, said: str | None):
    _files(par, suffix=".var")
    code, _, err = call("convert", "case.var", "case.toml")
    if said is None:
        assert (code, "parameter 9000011 is left out, as SPCAT does: spin 1 is not among" in err) == (0, True)
    else:
        assert (code, said in err) == (2, True)


@pytest.mark.parametrize(
    ("par", "lin", "said"),
    [
        (
            PAR,
            LIN.replace("  1  0  1  0", " 1 0 1 0    "),
            "quantum numbers fill three columns each, from the first column on",
        ),
        (PAR, "", "case.lin: no line; a blank line ends the list"),
        (
            PAR.replace("a 1 2", "a 1 1"),
            LIN,
            "has 4 quantum numbers for each state; these constants have 3 (j, ka, kc), as NVIB and",
        ),
        (
            PAR.replace("  6    3", "  6    1").replace("1E-37 /A", "1E36 /A"),
            LIN,
            "case.par: NLINE = 1: fewer lines count than the 2 parameters that are free; the .lin file has 2",
        ),
    ],
)
def test_a_mistake_in_measured_lines_has_its_rule(call, par: str, lin: str, said: str):
    _files(par, lin=lin)
    code, _, err = call("fit", "case.par")
    assert code == 2
    assert said in " ".join(err.split())


def test_lines_given_for_their_par_file_name_it(call):
    _files()
    code, _, err = call("fit", "case.lin")
    assert code == 2
    assert "or case.par as the source, which states them for lines beside it" in " ".join(err.split())
