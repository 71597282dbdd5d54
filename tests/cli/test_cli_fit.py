"""`rotor fit` and `rotor structure` keep the contract of docs/verbs."""

from __future__ import annotations

import json
import math
import runpy
from pathlib import Path

import numpy as np
import pytest
from documented_options import undocumented
from places import ORACLES, PROJECT

import rotor
from rotor.formats.fits.family_file import read_family
from rotor.formats.molecules.molecule_file import read_molecule_file
from rotor.formats.spcat.text.par import read_par
from rotor.spectra.lines import line_list

DOCS = PROJECT / "docs"
CO = "B=57635.96804(3) D=0.1835053(4) H=1.723e-7(5) MHz"

PAR = """CO
   3  31   20    0    0.0000E+000    1.0000E+006    1.0000E+000 1.0000000000
l   -1    1    0    0    0    1    1    1         0   -1    0
             100  5.700000000000000E+004 1.00000000E+035 /B
             200 -1.700000000000000E-001 1.00000000E+035 /-D
             300  1.600000000000000E-007 1.00000000E+035 /H
"""


def write_lines(path: Path, noise: float = 0.003, seed: int = 5) -> None:
    """Lines of CO to J = 25 with normal noise, .lin or .csv."""
    top = rotor.Top.from_constants(CO, dipole_abc_debye=(0.11, 0, 0))
    lines = line_list(top, jmax=25, min_lgint=None, q=1.0)
    seen = lines.frequency_mhz + noise * np.random.default_rng(seed).normal(size=len(lines))
    j = lines.levels.quanta["j"]
    rows = zip(j[lines.upper].tolist(), j[lines.lower].tolist(), seen.tolist(), strict=True)
    if path.suffix == ".lin":
        path.write_text("".join(f"{u:3d}{low:3d}{'':30s} {f:15.4f} {noise}\n" for u, low, f in rows))
    else:
        body = "".join(f"{u},{low},{f:.4f},{noise * 1e3}\n" for u, low, f in rows)
        path.write_text("j_upper,j_lower,frequency_mhz,error_khz\n" + body)


def test_spfits_files_are_fitted_and_written(call, folder):
    (folder / "co.par").write_text(PAR)
    write_lines(folder / "co.lin")
    code, out, err = call(
        "fit", "co.par", "--out", "new", "--plot", "rest.png", "--table", "t.tex", "--json", "co.json"
    )
    assert code == 0, err
    assert "CO: CONVERGED" in out
    content = json.loads((folder / "co.json").read_text(encoding="utf-8"))
    for name, true, error in (("B", 57635.96804, 3e-4), ("D", 0.1835053, 3e-6)):
        assert content["constants_mhz"][name] == pytest.approx(true, abs=error)  # about five of its standard errors
    assert {path.name for path in folder.iterdir()} >= {
        "new.fit",
        "new.toml",
        "new.par",
        "new.var",
        "rest.png",
        "t.tex",
    }
    variances, again = read_par(folder / "new.var"), read_par(folder / "new.par")
    assert variances.parameters[0].error == pytest.approx(content["parameters"][0]["error"], rel=1e-8)  # digits printed
    assert again.parameters[1].error == 1e35
    assert variances.parameters[1].value == content["parameters"][1]["value"]
    assert read_par(folder / "co.par").parameters[0].value == 57000.0


def test_the_covariance_reaches_the_errors_of_predicted_lines(call, folder):
    """Errors that know the correlations are other, mostly smaller, than from the uncertainties alone."""
    write_lines(folder / "co.csv")
    code, _, err = call("fit", "co.csv", "--constants", "B=57000 D=0.17 H=0 MHz", "--free", "B,D,H", "--out", "new")
    assert code == 0, err
    file = read_molecule_file(folder / "new.toml")
    assert file.covariance.names == ("B", "D", "H")
    assert abs(file.covariance.correlations[1, 2]) > 0.9
    top = rotor.read(str(folder / "new.toml")).with_dipole((0.11, 0, 0), "a test")
    lines = rotor.api.line_list(top, jmax=30, min_lgint=None)
    alone = math.sqrt(
        sum((s * d) ** 2 for s, d in zip(file.constants.uncertainties.values(), (60, -4 * 30**3, 0), strict=True))
    )
    high = lines.error_mhz[lines.levels.quanta["j"][lines.upper] == 30][0]
    assert 0 < high < alone


def test_not_converged_is_exit_code_1_with_the_reason_and_no_constants_written(call, folder):
    write_lines(folder / "co.csv")
    code, out, err = call("fit", "co.csv", "--constants", "B=57000 D=0.17 MHz", "--free", "B", "--out", "new")
    assert code == 1
    assert err.splitlines()[-1].startswith(
        "error: not converged: a minimum was reached, but it does not describe the lines"
    )
    assert "NOT CONVERGED" in out
    assert [path.name for path in sorted(folder.glob("new*"))] == ["new.fit"]
    assert "NOT CONVERGED" in (folder / "new.fit").read_text(encoding="utf-8")


@pytest.mark.parametrize(("molecule", "free"), [("OCS", "B"), ("formamide", "A,B,C")])
def test_a_predicted_list_is_fitted(call, molecule, free):
    """The CSV of `rotor spectrum` gives its constants back; a note says which of its columns a fit does not use."""
    assert call("spectrum", molecule, "--jmax", "3", "--csv", "predicted.csv")[0] == 0
    code, out, err = call("fit", "predicted.csv", "--start", molecule, "--free", free)
    assert code == 0
    assert "columns of a prediction that a fit does not use: lgint, energy_lower_cm, g_upper" in err
    assert "weighted rms 0.00000" in out


def test_a_list_of_another_kind_of_top_says_its_columns(call):
    assert call("spectrum", "OCS", "--jmax", "3", "--csv", "predicted.csv")[0] == 0
    code, _, err = call("fit", "predicted.csv", "--start", "formamide", "--free", "B")
    assert code == 2
    assert "no column n_upper" in err or "no column ka_upper" in err
    assert "; the file has frequency_mhz, error_mhz, j_upper, j_lower" in err


def test_an_empty_list_says_that_it_has_no_columns(call, folder):
    (folder / "lines.csv").write_text("", encoding="utf-8")
    code, _, err = call("fit", "lines.csv", "--start", "water")
    assert code == 2
    assert err.rstrip().endswith("; the file has none: its first line is empty")


BD = ("--constants", "B=57000 D=0.17 MHz", "--free", "B,D")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("co.par", "--free", "B"), "--free: a .par file states the free"),
        (("co.csv",), "either --start or --constants"),
        (("co.csv", "--constants", "B=57000 MHz"), "--free: name the constants to fit"),
        (("co.csv", "--start", "co.par"), "the free parameters of co.par are fitted to its .lin by rotor fit co.par"),
        (("co.csv", "--constants", "B=57000 MHz", "--free", "B,"), "names parted by commas"),
        (("co.csv", "--constants", "B=57000 MHz", "--free", "B,B"), "B is named twice"),
        (("co.csv", "--constants", "B=57000 MHz", "--free", "B", "--prior", "B"), "--prior 'B': name=error"),
        (("co.csv", "--constants", "B=57000 MHz", "--free", "B", "--lin", "x.lin"), "--lin: expected with a .par file"),
        (("co.txt", "--constants", "B=57000 MHz", "--free", "B"), "assigned lines are read from"),
        (("empty.csv", "--constants", "B=57000 MHz", "--free", "B"), "no lines in it"),
        (("co.csv", "--constants", "A=6 B=5 C=4 GHz", "--free", "B"), "no column ka_upper"),
        (("co.csv", "--constants", "B=57000 MHz", "--free", "B", "--out", "no/folder"), "there is no folder"),
        (("zero.csv", "--constants", "B=57000 MHz", "--free", "B"), "or a common error (--default-error)"),
        (("co.csv", "--constants", "B=57000 MHz", "--free", "B,Q"), "--free: 'Q' is not a rotational constant"),
        (("co.csv", "--constants", "B=57000 MHz", "--free", "B,mu_q"), "--free: 'mu_q' is not a rotational constant"),
        (("co.csv", "--constants", "B=57000 MHz", "--free", "B,mu_q"), "mu_a, mu_b, mu_c (lines in a field)"),
        (("co.csv", "--constants", "B=57000 MHz", "--free", "B,D_J,D"), "--free: D_J and D are one constant"),
        (("co.csv", "--constants", "B=57000 MHz", "--free", "B,D_K"), "--free: D_K is not a constant of kind 'linear'"),
        (
            ("co.csv", "--constants", "B=57000 mu_a=1 MHz", "--free", "B"),
            "'mu_a' is not a rotational constant known here: the dipole",
        ),
        (("co.csv", "--constants", "B=57000 MHz", "--free", "B,A"), "--free: A is not a constant of the start"),
        (("co.csv", *BD, "--prior", "B=1", "--prior", "B=2"), "--prior 'B=2': B has an a-priori error already"),
        (("co.csv", *BD, "--prior", "H=1"), "--prior: H is not in the set"),
        (("co.csv", *BD, "--tie", "Q=2*B"), "--tie 'Q=2*B': 'Q' is not a rotational constant known here"),
        (("co.csv", *BD, "--tie", "D=1..2*B"), "--tie 'D=1..2*B': write 'X = 2.5*Y'"),
        (("co.csv", *BD, "--tie", "D=2*B"), "--tie 'D=2*B': D must not be free"),
        (("co.csv", *BD, "--loss", "l1"), "--loss 'l1'"),
        (("co.csv", *BD, "--reject", "-1"), "--reject = -1"),
        (("co.csv", *BD, "--poor-rms", "0"), "--poor-rms = 0"),
        (("co.csv", *BD, "--try", "Q"), "--try: 'Q' is not a rotational constant"),
        (("co.csv", *BD, "--choose", "B"), "--choose: B is free already"),
        (("co.csv", *BD, "--suggest", "H"), "--suggest: H is not among the free"),
        (("co.csv", *BD, "--merge", "empty.csv"), "--merge: empty.csv: no lines"),
        (("co.csv", "--start", "co.csv", "--free", "B"), "--start co.csv: a list of lines has no constants"),
        (("one.csv", "--constants", "B=57000 D=0.1 MHz", "--free", "B,D"), "one.csv: 2 free constants for 1 measured"),
        (("bad.csv", "--constants", "B=57000 MHz", "--free", "B"), "line 1 of the table: there is no level -1"),
        (("same.csv", *BD), "line 1, 1 - 1 at 0.0000 MHz: upper and lower state are the same level"),
        (("long.csv", *BD), "line 1 of the table: 1 value more"),
        (("negative.csv", *BD), "line 1 of the table: error_mhz = -0.1"),
        (
            ("water.csv", "--constants", "A=9 B=5 C=4 GHz", "--free", "B"),
            "line 1, 3 2 3 - 2 1 1 at 183310.0000 MHz: there is no level 3 2 3",
        ),
        (("co.par", "--lin", "none.lin"), "--lin: none.lin: no such file"),
        (("held.par", "--lin", "co.lin"), "no parameter is free"),
        (("co.par", "--out", "co"), "--out co.par: is an input"),
        (("alone.par",), "there are no measured lines beside alone.par"),
    ],
)
def test_wrong_input_is_one_line_and_nothing_is_written(call, folder, arguments, words):
    (folder / "co.par").write_text(PAR)
    (folder / "alone.par").write_text(PAR)
    write_lines(folder / "co.lin")
    write_lines(folder / "co.csv")
    (folder / "co.txt").write_text("1 0 115271.2\n")
    head = "j_upper,j_lower,frequency_mhz,error_mhz\n"
    (folder / "empty.csv").write_text(head)
    (folder / "zero.csv").write_text(head + "1,0,115271.2,0\n2,1,230538.0,0\n")
    (folder / "one.csv").write_text(head + "1,0,115271.2,0.1\n")
    (folder / "bad.csv").write_text(head + "0,-1,115271.2,0.1\n")
    (folder / "same.csv").write_text(head + "1,1,0,0.1\n2,1,230538.0,0.1\n")
    (folder / "long.csv").write_text(head + "1,0,115271.2,0.1,7\n")
    (folder / "negative.csv").write_text(head + "1,0,115271.2,-0.1\n")
    asymmetric = "j_upper,ka_upper,kc_upper,j_lower,ka_lower,kc_lower,frequency_mhz,error_mhz\n"
    (folder / "water.csv").write_text(asymmetric + "3,2,3,2,1,1,183310,0.1\n")
    (folder / "held.par").write_text(PAR.replace("E+035", "E-037"))
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    code, _, err = call("fit", *arguments)
    assert code == 2
    assert words in err.splitlines()[-1]
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_no_degree_of_freedom_is_said_and_there_are_no_errors_from_the_scatter(call, folder):
    (folder / "two.csv").write_text("j_upper,j_lower,frequency_mhz,error_mhz\n1,0,115271.2,0.1\n2,1,230538.0,0.1\n")
    code, out, err = call("fit", "two.csv", *BD, "--out", "two", "--json", "two.json")
    assert code == 0, err
    assert "0 degrees of freedom" in out.splitlines()[0]
    assert "sqrt(chi2/degrees of freedom) undefined" in out
    assert "nan" not in out + (folder / "two.fit").read_text(encoding="utf-8")
    content = json.loads((folder / "two.json").read_text(encoding="utf-8"))
    assert content["parameters"][0]["scaled_error"] is None
    assert content["parameters"][0]["error"] > 0
    (folder / "co.lin").write_text(
        "  1  0                              115271.2 0.1\n  2  1                              230538.0 0.1\n"
    )
    (folder / "co.par").write_text(PAR.replace("   3  31", "   2   2", 1).replace("1.0000E+000", "-1.0", 1))
    assert call("fit", "co.par", "--out", "new")[0] == 0
    assert all(math.isfinite(p.error) for p in read_par(folder / "new.var").parameters)


def test_lines_of_a_par_file_with_no_such_level_are_left_out_by_name(call, folder):
    """As SPFIT does ("Bad Line"); in other lists they are an error."""
    (folder / "co.par").write_text(PAR)
    write_lines(folder / "co.lin")
    text = (folder / "co.lin").read_text()
    (folder / "co.lin").write_text(text.replace("  2  1 ", " -2 -1 ", 1))
    code, out, err = call("fit", "co.par")
    assert code == 0, err
    assert "line 2, -2 - -1 at 23053" in err
    assert "is left out" in err
    assert "lines 24, of which 24 count" in out
    assert call("fit", "co.par", "--out", "new")[0] == 0
    report = (folder / "new.fit").read_text(encoding="utf-8")
    assert "    3: 3 - 2" in report  # by its place in the file


def test_spfits_options_are_honoured_or_refused_by_name(call, folder):
    write_lines(folder / "co.lin")
    for old, new, exit_code, words in (
        ("   20    0 ", "   20   99 ", 2, "co.par: NXPAR = 99"),
        ("1.0000E+006", "0.0", 0, "ERRTST = 0: 1e+06 is taken"),
        (" 1.0000000000", " -1.0", 2, "CAL = -1"),
        ("  31   20", "   0   20", 2, "NLINE = 0: no line counts"),
        ("             300", "             200", 2, "parameter 200 stands twice and both are free"),
        ("1.600000000000000E-007 1.00000000E+035 /H", "1.723E-007 -1.0 /H", 0, "a-priori errors below 0: H are held"),
    ):
        (folder / "co.par").write_text(PAR.replace(old, new, 1))
        code, _, err = call("fit", "co.par")
        assert code == exit_code, (words, err)
        assert words in err
    (folder / "co.par").write_text(PAR.replace("  31   20", "  10   20", 1))
    (folder / "co.lin").write_text((folder / "co.lin").read_text() + "what follows was not fitted\n")
    code, out, err = call("fit", "co.par")
    assert code == 0
    assert "NLINE = 10: 15 lines behind it do not count" in err
    assert "lines 10, of which 10 count" in out
    write_lines(folder / "co.lin")
    tied = PAR.replace("             300", "            -300")
    (folder / "co.par").write_text(tied)
    call("fit", "co.par", "--json", "tied.json")
    content = json.loads((folder / "tied.json").read_text(encoding="utf-8"))
    assert [parameter["name"] for parameter in content["parameters"]] == ["B", "-D"]
    assert content["constants_mhz"]["H"] / content["constants_mhz"]["D"] == pytest.approx(
        1.6e-7 / 0.17, rel=1e-12
    )  # the ratio of the file


def test_criteria_that_too_few_lines_leave_undefined_are_dashes(call, folder):
    """Five lines and four constants: AICc needs two lines more than constants, and the scale of the errors is one."""
    top = rotor.Top.from_constants("A=9000 B=3100 C=2500 MHz")
    levels = rotor.api.solve_levels(top, 4)
    text = "j_upper,ka_upper,kc_upper,j_lower,ka_lower,kc_lower,frequency_mhz,error_mhz\n"
    for upper, lower in (
        ((1, 0, 1), (0, 0, 0)),
        ((1, 1, 0), (1, 0, 1)),
        ((2, 1, 2), (1, 1, 1)),
        ((2, 2, 0), (2, 1, 1)),
        ((3, 1, 3), (2, 0, 2)),
    ):
        ends = [levels.energy_mhz[levels.find(j=j, ka=ka, kc=kc)] for j, ka, kc in (upper, lower)]
        text += ",".join(map(str, (*upper, *lower, round(ends[0] - ends[1], 2), 0.05))) + "\n"
    Path("l.csv").write_text(text)
    code, out, err = call(
        "fit", "l.csv", "--constants", "A=9000 B=3100 C=2500 MHz", "--free", "A,B,C", "--try", "DK", "--json", "a.json"
    )
    assert code == 0, err
    row = next(line for line in out.splitlines() if line.startswith("DK") and "added" in line)
    assert " - " in row
    assert "inf" not in out.split()
    assert json.loads(Path("a.json").read_text())["trials"][0]["aicc"] is None


def test_trying_choosing_suggesting_and_resampling(call, folder):
    write_lines(folder / "co.csv")
    common = ("fit", "co.csv", "--constants", "B=57000 D=0.17 MHz", "--free", "B,D")
    code, out, _ = call(*common, "--poor-rms", "1e9", "--try", "H,L", "--json", "try.json")
    assert code == 0
    assert "tried" in out
    trials = json.loads((folder / "try.json").read_text(encoding="utf-8"))["trials"]
    assert (trials[0]["name"], trials[0]["better"]) == ("H", True)
    code, out, _ = call(*common, "--choose", "H,L", "--suggest", "H", "--bootstrap", "20", "--json", "choose.json")
    assert code == 0
    content = json.loads((folder / "choose.json").read_text(encoding="utf-8"))
    assert [constant["name"] for constant in content["chosen"]] == ["H"]
    assert len(content["bootstrap_errors"]) == 3
    assert content["suggestions"] == []  # every line of the range is measured


def test_lines_are_merged_and_saved(call, folder):
    write_lines(folder / "co.csv")
    (folder / "more.csv").write_text("j_upper,j_lower,wavenumber_cm,error_cm\n27,26,103.3354,0.0001\n")
    code, _, err = call(
        "fit", "co.csv", "--merge", "more.csv", "--constants", "B=57635.97 D=0.1835 H=1.7e-7 MHz", "--free", "B,D,H",
        "--save-lines", "all.csv",
    )  # fmt: skip
    assert code in (0, 1), err
    assert len((folder / "all.csv").read_text().splitlines()) == 27
    assert "27,26," in (folder / "all.csv").read_text()


FAMILY = """name = "OCS"
[geometry]
atoms = [["O", 0, 0, 1.16], ["C", 0, 0, 0], ["S", 0, 0, -1.56]]
[coordinates]
CO = [1, 2]
CS = [2, 3]
[[isotopologue]]
constants = "B=6081.492114(6) MHz"
[[isotopologue]]
isotopes = "C=13C"
constants = "B=6061.923848(20) MHz"
[[isotopologue]]
isotopes = "S=34S"
constants = "B=5932.833732(2) MHz"
[[isotopologue]]
isotopes = "O=18O"
constants = "B=5704.857421(40) MHz"
"""


def test_a_family_file_becomes_a_structure(call, folder):
    (folder / "ocs.toml").write_text(FAMILY)
    code, out, err = call(
        "structure", "ocs.toml", "--method", "rs,r0,rm1", "--plot", "o.png", "--xyz", "o.xyz", "--json", "o.json"
    )
    assert code == 0, err
    assert "CO" in out
    content = json.loads((folder / "o.json").read_text(encoding="utf-8"))
    assert [component.name for component in read_family("ocs.toml").family.species] == [
        "parent",
        "C=13C",
        "S=34S",
        "O=18O",
    ]
    rs = {value["name"]: value["value"] for value in content["rs"]["values"]}
    assert rs == pytest.approx({"CO": 1.16054, "CS": 1.55967}, abs=1e-5)  # digits as published
    assert content["r0"]["degrees_of_freedom"] == 2
    top = rotor.read(str(folder / "o.xyz"))
    assert top.constants["B"] == pytest.approx(6081.5, rel=5e-3)  # r_m⁽¹⁾ leaves vibration out


def test_a_family_may_be_made_of_measured_lines(call, folder):
    write_lines(folder / "co.csv")
    (folder / "co.toml").write_text(
        'name = "CO"\n[geometry]\natoms = [["C", 0, 0, 0], ["O", 0, 0, 1.128]]\n[[isotopologue]]\nlines = "co.csv"\n'
        'start = "B=57000 D=0.17 H=0 MHz"\n[[isotopologue]]\nisotopes = "C=13C"\nconstants = "B=55101.011 MHz"\n'
    )
    code, out, err = call("structure", "co.toml", "--method", "r0", "--json", "-")
    assert code == 0, err
    content = json.loads(out)
    assert content["isotopologues"][0]["source"].startswith("fitted to 25 measured lines of co.csv")
    assert content["r0"]["values"][0]["value"] == pytest.approx(1.1308, abs=3e-4)  # r₀ of CO


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("CO = [1, 2]", "CO = [1, 9]", "atoms 1 to 3"),
        ('isotopes = "C=13C"', 'isotopes = "N=15N"', "element 'N'"),
        ('isotopes = "C=13C"', 'isotope = "C=13C"', "unknown key 'isotope'"),
        ('constants = "B=6061.923848(20) MHz"', "", "either constants or lines"),
        ("B=6061.923848(20)", "A=6061.9", "a linear molecule has B"),
        ("[geometry]", "[geometrie]", "unknown key 'geometrie'"),
        ("atoms =", "atom =", "[geometry] with atoms"),
    ],
)
def test_a_family_that_cannot_be_is_refused(call, folder, old, new, words):
    (folder / "ocs.toml").write_text(FAMILY.replace(old, new, 1))
    code, _, err = call("structure", "ocs.toml")
    assert code == 2
    assert words in err
    assert err.count("\n") == 1


def test_methods_that_cannot_be_are_refused(call, folder):
    (folder / "ocs.toml").write_text(FAMILY)
    assert "--method: 'rx'" in call("structure", "ocs.toml", "--method", "rx")[2]
    code, _, err = call("structure", "ocs.toml", "--method", "rs", "--check")
    assert code == 2
    assert "--check: needs r0, rm1, rm2 or re" in err
    assert "no constant has a correction" in call("structure", "ocs.toml", "--method", "re")[2]
    assert "a family of isotopologues is a .toml file" in call("structure", "ocs.xyz")[2]


def test_the_options_and_keys_are_in_the_documents(call, folder):
    (folder / "ocs.toml").write_text(FAMILY)
    write_lines(folder / "co.csv")
    call("fit", "co.csv", "--constants", CO, "--free", "B,D", "--json", "fit.json")
    call("structure", "ocs.toml", "--json", "structure.json")
    for verb in ("fit", "structure"):
        page = (DOCS / "verbs" / f"{verb}.md").read_text(encoding="utf-8")
        assert undocumented(verb, call(verb, "--help")[1]) == set()
        for key in json.loads((folder / f"{verb}.json").read_text(encoding="utf-8")):
            assert f"`{key}`" in page, (verb, key)


SAMPLES = ORACLES / "fits"


@pytest.mark.parametrize(
    ("script", "reached"),
    [("07_fit", lambda names: names["robust"].converged), ("08_structure", lambda names: names["doubtful"].notes)],
)
def test_the_examples_of_fits_and_structures_run_to_their_last_result(script, reached, monkeypatch):
    monkeypatch.chdir(SAMPLES.parents[2] / "examples")
    names = runpy.run_path(str(SAMPLES.parents[2] / "examples" / f"{script}.py"))
    assert reached(names)


def test_pictures_of_a_fit_and_of_a_molecule_are_the_same_file_each_time(call, folder):
    (folder / "ocs.toml").write_text(FAMILY)
    write_lines(folder / "co.csv")
    for name in ("one", "two"):
        call("fit", "co.csv", "--constants", CO, "--free", "B,D", "--plot", f"fit_{name}.svg")
        call("structure", "ocs.toml", "--plot", f"molecule_{name}.svg")
    for kind in ("fit", "molecule"):
        first, two = ((folder / f"{kind}_{name}.svg").read_text() for name in ("one", "two"))
        assert first.replace("one.svg", "two.svg") == two  # the command in the metadata apart
        assert "(Obs. − calc.) / error" in first or "1.15" in first


def test_the_family_of_samples_gives_the_published_structure(call, folder):
    code, out, err = call("structure", str(SAMPLES / "ocs.toml"), "--method", "rs", "--json", "-")
    assert code == 0, err
    values = {value["name"]: value["value"] for value in json.loads(out)["rs"]["values"]}
    assert values == pytest.approx({"CO": 1.16054, "CS": 1.55967}, abs=1e-5)  # digits as published


def test_a_fit_from_constants_is_not_named_after_its_lines(call, folder):
    write_lines(folder / "co.csv")
    code, out, err = call("fit", "co.csv", "--constants", "B=57636 D=0.18 H=0 MHz", "--free", "B,D,H", "--out", "f")
    assert code == 0, err
    assert out.startswith("linear top: CONVERGED")
    assert rotor.read("f.toml").name == "linear top"


@pytest.mark.parametrize(
    ("beside", "said"),
    [
        (
            [],
            "there is no a.par beside it, which would say what is free; give measured lines (.lin, .csv, .cat) with --start a.var",
        ),
        (["a.lin"], "there is no a.par beside it, which would say what is free; give a.lin with --start a.var"),
        (["a.par"], "give a.par, which says what is free, and lines in a.lin"),
        (["a.par", "a.lin"], "give a.par, which says what is free"),
    ],
)
def test_a_var_file_in_place_of_lines_is_told_what_is_missing(call, folder, beside, said):
    for name in ("a.var", *beside):
        (folder / name).write_text(PAR)
    code, _, err = call("fit", "a.var")
    assert (code, err) == (2, f"error: a.var: the constants of a fit, not measured lines; {said}\n")
