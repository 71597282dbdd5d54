"""Wrong input at the command line: one line that says what, where and which rule; nothing is written, nothing read is lost."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from places import ORACLES

from rotor.cli import folded
from rotor.cli.command import refuse_overwriting
from rotor.verbs.common.outputs import Files

CASE = ORACLES / "ocs"
LINES = "j_upper,j_lower,frequency_mhz,error_mhz\n1,0,{},0.01\n"
SCENE = 'schema = 1\nkind = "levels"\nmolecule = "CO"\n'


@pytest.fixture
def files(call):
    """The command, in a folder with one file of each kind that is read."""
    for suffix in (".var", ".int"):
        Path(f"a{suffix}").write_bytes((CASE / f"ocs{suffix}").read_bytes())
    Path("a.cat").write_bytes((CASE / "sample.cat").read_bytes())
    Path("s.toml").write_text(SCENE)
    Path("hot.toml").write_text(f'{SCENE}[conditions]\ntemperature = "1e300 K"\n'.replace("levels", "gas"))
    Path("m.toml").write_text('name = "x"\n[constants]\nunit = "MHz"\nsource = "test"\nB = 6000.0\n')
    Path("nan.csv").write_text(LINES.format("nan"))
    Path("bytes.csv").write_bytes(b"\xff\xfe\x00")
    Path("empty.int").touch()
    Path("empty.var").touch()
    return call


def contents() -> dict[str, bytes]:
    return {name: Path(name).read_bytes() for name in sorted(os.listdir())}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("convert a.var ./a.var", "TARGET a.var: is an input of this command"),
        ("convert a.int a.var", "TARGET a.var: is an input of this command"),
        ("cat a.cat --range 1:2Hz --out ./a.cat", "--out a.cat: is an input of this command"),
        ("cat a.cat --measured a.cat --out a.cat", "--out a.cat: is an input of this command"),
        ("levels m.toml --save-scene m.toml", "--save-scene m.toml: is an input of this command"),
        ("new levels --out s.toml", "--out s.toml: exists already"),
    ],
)
def test_no_file_that_is_read_is_written_over(files, words, said):
    before = contents()
    code, _, err = files(*words.split())
    assert (code, err.count("\n"), said in err) == (2, 1, True), err
    assert contents() == before


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["spectrum", ""], "SOURCE: the text given is empty"),
        (["spectrum", "CO", "--temperature", ""], "--temperature: the text given is empty"),
        (["info", "CO", "--isotope", " "], "--isotope: the text given is empty"),
        (["emission", "CO", "", "--band", "ALMA3"], "SOURCE: the text given is empty"),
        (["spectrum", "CO", "HCN"], "error: HCN: more than the command takes"),
        (["spectrum", "CO", "--temperature", "5", "K", "--jmax", "3"], "stand in quotes: --temperature '5 K'"),
        (["spectrum", "CO", "--jmax", "--range", "0:1THz"], "--jmax: expected a value, but --range follows"),
        (["spectrum", "CO", "--cat", "--range=0:1THz"], "--cat: expected a value, but --range follows"),
        (["structure"], "FAMILY is missing"),
        (["spectrum", "H2O", "--jmax", "1_000"], "--jmax: '1_000': expected a whole number"),
        (["levels", "A=9 B=3 C=2.5 GHz"], "is no file: constants go to --constants"),
        (["spectrum", "empty.int"], "empty.var: 0 lines"),
        (["spectrum", "CO", "--temperature", "1e300"], "expected a temperature up to 1e+06 K"),
        (["gas", "CO", "--temperature", "1e-300"], "expected a temperature of 1e-09 K or more"),
        (["thermo", "CO", "--temperature", "1e-300"], "expected a temperature of 1e-09 K or more"),
        (["thermo", "CO", "--temperature", "10:300K:100000000"], "at most 100000 numbers; ask for fewer"),
        (["thermo", "CO", "--temperature", "10:300K:200000"], "at most 100000 numbers; ask for fewer"),
        (["stark", "OCS", "--field", "0:1kV/cm:" + "9" * 5000], "numbers; ask for fewer"),
        (["info", "--constants", "A=1 B=1 C=1e-300"], "expected a rotational constant from 1e-12 to 1e+12 MHz"),
        (["info", "--constants", "B=10 K/m"], "--constants: unit 'K/m' is not a known unit"),
        (["tumble", "--moments", "1e300,1e300,1e300", "--omega", "1,1,1"], "moments lie between 1e-100 and 1e+100"),
        (["tumble", "--moments", "1,2,3", "--omega", "1e200,1,1"], "up to 1e+100 in size"),
        (["thermo", "CO", "--vibration", "1e-300"], "expected finite ones of 0.001 cm-1 or more"),
        (["thermo", "CO", "--vibration", "100x1e9"], "unit 'e9' is not a known unit; the default is 'cm-1'"),
        (
            ["levels", "CO", "--spin-constants", "chi_aa(14N)=5"],
            "1 spin is named after 14N, but CO has 1 of 12C, 1 of 16O",
        ),
        (["spectrum", "HCN", "--spin-constants", "C_aa(1H_1)=5 C_aa(1H_2)=5"], "2 spins are named after 1H"),
        (["fit", "nan.csv", "--start", "OCS", "--seed", "-1"], "--seed: -1: expected a whole number of 0 or more"),
        (["fit", "nan.csv", "--start", "OCS", "--bootstrap", "1000000000"], "a whole number from 0 to 100000"),
        (["spectrum", "CO", "--temperature", "5", "--temperature=10"], "--temperature: given more than once"),
        (["xyzzy", "CO"], "No such command 'xyzzy'; --help lists the commands"),
        (["isotopologues", "a.var"], "error: no isotope of"),
        (["isotopologues", "CO", "--min-abundance", "2"], "--min-abundance: least abundance 2"),
        (["tumble", "water", "--omega", "0,0,0"], "--omega: '0,0,0': a body at rest does not tumble"),
        (["fit", "missing.par"], "error: missing.par: no such file"),
        (["fit", "bytes.csv", "--start", "OCS"], "bytes.csv, line 1: not UTF-8 text (invalid"),
        (
            ["fit", "nan.csv", "--start", "OCS", "--free", "B"],
            "nan.csv, line 1 of the table: frequency_mhz reads 'nan'",
        ),
        (["tumble", "--moments", "1,2,3", " ", " "], "more than the command takes"),
        (["cat", "a.cat", "--as-spcat"], "--as-spcat: expected with --compare and an .int file"),
        (["plan", "hot.toml"], "conditions.temperature: '1e300 K': expected a temperature up to 1e+06 K"),
        (["run", "s.toml", "--workers", "100000"], "--workers: 100000: expected a whole number from 1 to 256"),
    ],
)
def test_the_message_names_what_is_wrong(files, words, said):
    before = contents()
    code, _, err = files(*words)
    last = err.splitlines()[-1]
    assert (code, last.startswith("error: "), said in last) == (2, True, True), err
    assert "Warning" not in err
    assert contents() == before


def test_a_title_may_be_the_name_of_a_file(files):
    """A title is a text: the name of the picture that is drawn again is no input."""
    Path("a.png").touch()
    written = Files({"plot": (Path("a.png"),)}, {"plot": "--plot"})
    refuse_overwriting(written, {"source": "water"})
    with pytest.raises(ValueError, match=r"--plot a\.png: is an input"):
        refuse_overwriting(written, {"source": "a.png"})
    assert files("levels", "CO", "--plot", "a.png", "--plot-title", "a.png")[0] == 0


def test_examples_of_help_fit_a_terminal(call):
    """Commands that are longer than a line go on in the next one, each option beside its value."""
    text = '  rotor spectrum --constants "A=835840.288 B=435351.717 C=278138.7 MHz" --dipole-abc 0,1.8546,0 --jmax 20'
    first, second = folded(text).split("\n")
    assert first.endswith('MHz" \\')
    assert second == "      --dipole-abc 0,1.8546,0 --jmax 20"
    assert max(map(len, call("stark", "--help")[1].splitlines())) <= 80  # columns of a terminal


def test_a_range_where_a_single_value_is_needed(call):
    code, _, err = call("spectrum", "water", "--temperature", "8:18K")
    assert (code, err) == (
        2, "error: --temperature: '8:18K': expected a single value, not a range; the sweep of a scene goes over several\n",
    )  # fmt: skip


def test_a_list_where_a_single_molecule_is_needed(call, folder):
    (folder / "list.csv").write_text("name,smiles\na,C=O\n", encoding="utf-8")
    code, _, err = call("info", "list.csv")
    assert code == 2
    assert err.startswith("error: list.csv: a CSV file is a list of molecules")
    assert 'molecule = "list.csv"' in err
    assert "rotor run" in err
    (folder / "list.smi").write_text("C=O a\n", encoding="utf-8")
    assert "error: list.smi: a file of SMILES is a list of molecules" in call("info", "list.smi")[2]


FAMILY = 'name = "OCS"\n[[isotopologue]]\nconstants = "B=6081.492 MHz"\n[[isotopologue]]\nisotopes = "S=34S"\nconstants = "B=5932.8 MHz"\n'


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("info H20", "did you mean H2O? "),
        ("info h2o", "did you mean H2O? "),
        ("spectrum CH3CHO --internal-rotation table", "; or the word geometry or scan, with values behind it"),
        ("info family.toml", "family.toml: a family of isotopologues, not one molecule; rotor structure reads it"),
        (
            "isotopologues --constants B=1GHz",
            "No such option: --constants; this verb needs the atoms: a name, a file, or ",
        ),
        (
            "torsion CH3OH --bond 1-2 --potential V3=4foo",
            "use one of Hz, kHz, MHz, GHz, THz, cm-1, K, kJ/mol, kcal/mol, meV",
        ),
    ],
)
def test_a_remedy_that_does(files, words, said):
    """H20 was answered with H2, a family with an unknown key, constants of isotopologues with --spin-constants."""
    Path("family.toml").write_text(FAMILY)
    code, out, err = files(*words.split())
    assert (code, out) == (2, "")
    assert said in err
