"""States on the command line: dipoles, weights, symmetry and names as a file of constants has them, notes and refusals."""

from __future__ import annotations

import json

import pytest

from rotor.tops.states.state_constants import StateConstants
from rotor.tops.states.state_texts import with_state_texts
from rotor.tops.top import Top

AMMONIA = """
[constants]
kind = "oblate"
unit = "MHz"
B = 298192.0
C = 186696.0

[dipole]
a = 0
b = 0
c = 0

[spin_weights]
0 = 2
1 = 1
2 = 1

[states]
unit = "MHz"
names = ["0+", "0-"]
symmetry = "C2v"
"E[1]" = 23785.0
"B[1]" = 298041.0
"C[1]" = 187000.0

[states.weights]
0 = { 0even = 0, 0odd = 4, 1 = 1, 2 = 1 }
1 = { 0even = 4, 0odd = 0, 1 = 1, 2 = 1 }

[states.dipoles]
"0,1" = [0.0, 0.0, 1.47]
"""
STATE_TEXTS = (
    "--constants", "B=298192 C=186696 MHz", "--dipole-abc", "0,0,0", "--spin-weights", "0=2,1=1,2=1",
    "--state-constants", "E[1]=23785 B[1]=298041 C[1]=187000 MHz", "--state-dipoles", "[0,1] 0,0,1.47",
    "--state-weights", "[0] 0even=0,0odd=4,1=1,2=1 [1] 0even=4,0odd=0,1=1,2=1", "--state-symmetry", "C2v", "--state-names", "0+,0-",
)  # fmt: skip
STATE = ("--constants", "A=20 B=10 C=8 GHz", "--state-constants", "E[1]=20 A[1]=20 B[1]=10 C[1]=8 GHz")
THREE = "E[1]=20 A[1]=20 B[1]=10 C[1]=8 {}[0,1]=0.1 {}[0,1]=0.2 {}[0,1]=0.3 GHz"


def test_options_give_what_a_file_gives(call, tmp_path):
    """Weights 4:0, a dipole between states, names and symmetry: the same lines, and the inversion lines are among them."""
    path = tmp_path / "ammonia.toml"
    path.write_text(AMMONIA, encoding="utf-8")
    file_top, option_top = (
        json.loads(call("spectrum", *words, "--jmax", "3", "--json", "-")[1]) for words in ((str(path),), STATE_TEXTS)
    )
    assert option_top["lines"] == file_top["lines"]
    assert option_top["q"]["q"] == file_top["q"]["q"]
    keys = ("names", "symmetry", "spin_weights", "dipoles_abc_debye")
    assert [option_top["further_states"][key] for key in keys] == [file_top["further_states"][key] for key in keys]
    assert any(line["frequency_mhz"] < 30e3 for line in option_top["lines"])


@pytest.mark.parametrize("verb", ["levels", "thermo", "info"])
def test_every_verb_with_states_takes_weights_and_symmetry(call, verb):
    words = [
        *(STATE_TEXTS[:2] + STATE_TEXTS[4:8]), "--state-weights", STATE_TEXTS[11], "--state-symmetry", "C2v", "--state-names", "0+,0-",
    ]  # fmt: skip
    code, out, _ = call(verb, *words, "--json", "-")
    assert code == 0
    assert json.loads(out)["further_states"]["spin_weights"]["0"] == {"0even": 0, "0odd": 4, "1": 1, "2": 1}


def test_a_saved_scene_has_the_states(call, tmp_path):
    scene, table = tmp_path / "s.toml", tmp_path / "lines.csv"
    assert call("spectrum", *STATE_TEXTS, "--jmax", "2", "--csv", str(table), "--save-scene", str(scene))[0] == 0
    first = table.read_text(encoding="utf-8")
    table.unlink()
    assert call("run", str(scene), "--out", str(tmp_path))[0] == 0
    assert table.read_text(encoding="utf-8") == first


def test_what_is_not_named_stays():
    states = StateConstants({"E[1]": 5.0, "A[1]": 9.0, "B[1]": 8.0, "C[1]": 7.0}, dipoles={(1, 1): (1.0, 0.0, 0.0)})
    top = Top.from_constants("A=9 B=8 C=7 GHz", states=states)
    computed = with_state_texts(top, {"state_dipoles": "[0,1]=0,1,0"}, "given").states
    assert computed is not None
    assert dict(computed.dipoles) == {(1, 1): (1.0, 0.0, 0.0), (1, 0): (0.0, 1.0, 0.0)}


@pytest.mark.parametrize(("kinds", "noted"), [("G_b G_c W", True), ("G_a F_ac G_c", True), ("G_c F_ab W", False)])
def test_three_kinds_of_coupling_are_noted_unless_a_symmetry_is_declared(call, kinds, noted):
    """G_c and F_ab go like one rotation about c: with W that is Cs(ab). Three kinds have no group but C1 and Ci."""
    words = (
        "levels",
        "--constants",
        "A=20 B=10 C=8 GHz",
        "--state-constants",
        THREE.format(*kinds.split()),
        "--jmax",
        "1",
    )
    code, _, err = call(*words)
    assert code == 0
    assert ("exist together in C1 and Ci only" in err) == noted
    assert "exist together" not in call(*words, "--state-symmetry", "C1")[2]
    code, _, err = call(*words, "--state-symmetry", "Cs(ab)")
    assert (code == 2) == noted
    assert ("have one of them or the other" in err) == noted


REFUSED = [
    ((*STATE, "--state-dipoles", "1,0,0"), "expected the state in square brackets"),
    ((*STATE, "--state-dipoles", "[0,1] 1,0"), "expected three numbers"),
    ((*STATE, "--state-dipoles", "[0,2] 1,0,0"), "there are 2 states, counted from 0"),
    ((*STATE, "--state-dipoles", "[0,1] 1,0,0 MHz"), "does not measure the same thing"),
    ((*STATE, "--state-dipoles", "[1] 1,0,0 [1] 1,0,0"), "given twice"),
    ((*STATE, "--state-weights", "[0,1] ee=1"), "expected the number of a state"),
    ((*STATE, "--state-weights", "[1] ee=2,eo=2,oe=2,oo=2"), "without a common divisor"),
    ((*STATE, "--state-weights", "[1] ee"), "expected class=number"),
    ((*STATE, "--state-weights", "[1] xx=1"), "--state-weights"),
    ((*STATE, "--state-weights", "[3] none"), "there are 2 states"),
    ((*STATE, "--state-symmetry", "Cx"), "expected one of C1, Ci, C2v"),
    ((*STATE, "--state-symmetry", "Cs"), "expected one of C1, Ci, C2v"),
    (("--constants", "A=20 B=10 C=8 GHz", "--state-symmetry", "C2v"), "this top has a single state"),
    ((*STATE, "--state-symmetry", ""), "the text given is empty"),
    ((*STATE, "--state-symmetry", "C2v,C1"), "expected one of"),
    ((*STATE, "--state-names", "a"), "expected 2, one for each state"),
    (("HCN", "--state-names", "a,b"), "this top has a single state"),
]


@pytest.mark.parametrize(("words", "why"), REFUSED)
def test_wrong_input_is_one_line_and_exit_code_2(call, words, why):
    code, out, err = call("spectrum", *words, "--dipole-abc", "1,0,0", "--jmax", "1")
    assert (code, out) == (2, "")
    (line,) = [row for row in err.splitlines() if not row.startswith("note:")]
    option = next(word for word in words[::-1] if word.startswith("--state-"))
    assert line.startswith(f"error: {option}: ")
    assert why in line


def test_what_is_given_of_states_is_named_in_sources_and_refusals(call):
    """Also where the source has the states already: its source stays, and what is given is added."""
    top = with_state_texts(Top.from_constants("A=20 B=10 C=8 GHz"), {"state_constants": STATE[3]}, "of a file")
    assert with_state_texts(top, {"state_dipoles": "[0,1] 0,0,1"}, "given").states.source == "of a file; dipoles given"
    weights = ("--state-weights", "[0] ee=1,eo=3,oe=3,oo=1 [1] ee=3,eo=1,oe=1,oo=3")
    code, _, err = call("spectrum", *STATE, *weights, "--dipole-abc", "1,0,0")
    assert code == 2
    assert "--state-weights: dipole μa = 1 D in state 0" in err
    printed = call("spectrum", *STATE, *weights, "--dipole-abc", "0,1,0", "--jmax", "1", "--sources")[1]
    assert "given (--state-constants, --state-weights)" in printed
    assert "spin weights  0:" in call("thermo", *STATE, *weights, "--temperature", "30")[1]


@pytest.mark.parametrize("names", [",", "0+,0+"])
def test_names_of_states_tell_them_apart(call, names):
    code, _, err = call("spectrum", *STATE, "--state-names", names, "--dipole-abc", "1,0,0")
    assert code == 2
    assert "expected each once, none of them empty" in err
