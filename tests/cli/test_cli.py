"""The command line keeps its contract: docs/verbs."""

from __future__ import annotations

import csv
import io
import json
import math
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from documented_options import undocumented
from places import PROJECT

import rotor
from rotor.reports import top_facts as report
from rotor.reports.screen import Table, json_text, show_table, table_text
from rotor.requests.lists import Numbers

WATER_XYZ = "3\nwater\nO 0 0 0\nH 0.75695 0 0.585882\nH -0.75695 0 0.585882\n"
RIGID = "A=835840.288 B=435351.717 C=278138.7 MHz"
INFO = """
    rotor_version command input name formula mass_u kind kind_decision point_group symmetry_number near_point_group
    near_displacement_angstrom constants_mhz uncertainties_mhz estimated_errors_mhz reduction
    representation rotational_constants_mhz rotational_constants_cm kappa moments_u_angstrom2 planar_moments_u_angstrom2
    inertial_defect_u_angstrom2 frame dipole_abc_debye dipole_source
    polarizability_abc_angstrom3 polarizability_source spin_weights spin_weights_source spin_constants_mhz spins spin_constants_source
    further_states
    partition_function source notes sizes_at_j effects limits splitting_nuclei errors
"""
SPECTRUM = """
    temperature_k q jmax jmax_source constants_reason min_lgint range_mhz line_count profile fwhm_mhz pressure_bar path_cm column_per_cm2
    optical_depth hyperfine patterns strongest lines files
"""
INFO_KEYS = set(INFO.split()) | {"files"}
SPECTRUM_KEYS = (INFO_KEYS - {"partition_function"}) | set(SPECTRUM.split())


def in_own_process(*arguments: str, **options) -> subprocess.CompletedProcess:
    """Run `python -m rotor` from the source tree."""
    environment = os.environ | {"PYTHONPATH": str(PROJECT), "PYTHONIOENCODING": "utf-8"}
    command = [sys.executable, "-m", "rotor", *arguments]
    return subprocess.run(command, env=environment, capture_output=True, check=False, timeout=120, **options)


# What is printed


def test_water_has_its_lines(call):
    code, out, err = call("spectrum", "water", "--top", "5")
    assert code == 0
    assert err == "note: 15 lines of levels beyond the reach of the distortion constants are left out\n"
    assert err.count("\n") == 1
    assert out.splitlines()[0] == "water, H2O: asymmetric top (κ = -0.4367)"
    top = rotor.read("water")
    lines = rotor.api.line_list(top)
    for name, beginning in (
        ("constants", "A 835852.4057, B 435264.025, C 278212.2207 MHz, and "),
        ("dipole", "μa 0, μb 1.8507, μc 0 D"),
        ("spin weights", "ee 1, eo 3, oe 3, oo 1"),
        ("temperature", "300 K"),
        ("Q", f"{lines.q:.6g}, summed from levels to J = "),
        ("J max", f"{lines.jmax}: beyond it no line reaches the cut"),
        ("cut", "lgint above -12"),
        ("lines", f"{len(lines)}, from 22235."),
    ):
        assert re.search(rf"^{name} +{re.escape(beginning)}", out, re.MULTILINE), name

    table = out.split("in order of frequency (states: J Ka Kc)\n")[1].split("\n\n")[0].splitlines()
    frequencies = [float(row.split()[0]) for row in table[1:]]
    assert frequencies == sorted(frequencies)
    assert np.allclose(frequencies, np.sort(lines.strongest(5).frequency_mhz), rtol=0, atol=5.1e-5)  # four decimals


def test_table_shows_what_was_asked_for(call):
    assert "all lines, in order of frequency" in call("spectrum", "CO", "--jmax", "3")[1]
    assert "frequency (MHz)" not in call("spectrum", "CO", "--top", "0")[1]
    _, out, _ = call("spectrum", "CO", "--range", "100:250GHz", "--min-lgint", "none", "--jmax", "9")
    assert "none: every allowed line, from 100000 to 250000 MHz" in out
    assert "lines         2, from 115271.2021 to 230538.0000 MHz" in out


def test_spherical_top_has_no_lines_and_says_so(call, folder):
    code, out, _ = call("spectrum", "CH4", "--csv", "a.csv", "--json", "a.json")
    assert code == 0
    assert "no lines: a rigid spherical top has none" in out
    assert (folder / "a.csv").read_text(encoding="utf-8").count("\n") == 1
    assert json.loads((folder / "a.json").read_text(encoding="utf-8"))["lines"] == []


def test_why_there_are_no_lines(call):
    assert "without a permanent dipole" in call("spectrum", "--constants", "B=11.7 GHz", "--dipole-abc", "0,0,0")[1]
    assert "widen --range" in call("spectrum", "CO", "--range", "1:2MHz")[1]


def test_info_of_water(call):
    code, out, err = call("info", "water", "--temperature", "100,300 K")
    assert (code, err) == (0, "")
    rows = {row.split()[0]: row.split()[1:] for row in out.splitlines() if row.strip()}
    assert float(rows["A"][0]) == pytest.approx(835852.4057, abs=1e-4)  # the library has more digits than its error
    assert rows["A"][1] == "0.26"
    q = rotor.api.partition_function(rotor.read("water"), 300.0)
    assert rows["300"][0] == f"{q.q:.6g}"
    assert "the geometry is asymmetric by Ia/Ic = 0.348" in re.sub(r"\s+", " ", out)
    assert len([row for row in out.splitlines() if re.match(r" *(100|300) ", row)]) == 2


def test_info_marks_the_temperatures_that_are_beyond_the_series(call, monkeypatch):
    import importlib

    sums = importlib.import_module("rotor.thermodynamics.sums.level_sums")

    real = sums._summed

    def breaks_above_400(ladder, s, temperatures, *others):
        if temperatures.max() > 400:
            raise ValueError(
                f"Q({temperatures.max():g} K): the sum over levels grows again at J = 9; too hot; lower it"
            )
        return real(ladder, s, temperatures, *others)

    monkeypatch.setattr(sums, "_summed", breaks_above_400)
    code, out, _ = call("info", "CO", "--json", "a.json")
    assert code == 0
    assert re.search(r"^ +500 +- +180\.761 +- +- +the sum over levels grows again at J = 9$", out, re.MULTILINE)
    rows = json.loads(Path("a.json").read_text(encoding="utf-8"))["partition_function"]
    assert [row["temperature_k"] for row in rows if row["q"] is None] == [500.0, 1000.0]
    assert rows[6]["q"] == pytest.approx(108.865, abs=1e-3)  # printed to three decimals


def test_two_ways_to_the_same_dipole(call, folder):
    (folder / "w.xyz").write_text(WATER_XYZ, encoding="utf-8")
    results = []
    for option in (["--dipole", "0,0,1.8546"], ["--dipole-abc", "0,1.8546,0"]):
        code, out, _ = call("spectrum", "w.xyz", *option, "--jmax", "5", "--json", "-")
        assert code == 0
        results.append(json.loads(out))
    assert np.allclose(np.abs(results[0]["dipole_abc_debye"]), [0, 1.8546, 0], atol=1e-12)  # round-off of the axes
    assert len(results[0]["lines"]) == len(results[1]["lines"]) > 10
    assert results[0]["lines"][0] == pytest.approx(results[1]["lines"][0], rel=1e-12)  # round-off of the axes


def test_estimated_dipole_is_said_loudly(call, folder):
    (folder / "w.xyz").write_text(WATER_XYZ, encoding="utf-8")
    code, out, err = call("spectrum", "w.xyz", "--jmax", "3")
    assert code == 0
    assert "estimate from MMFF94 partial charges" in out
    assert err.startswith("note: ")
    assert "MMFF94" in err


def test_smiles_says_how_good_it_is(call):
    code, out, err = call("spectrum", "SMILES:C=O", "--temperature", "100", "--json", "-")
    assert code == 0
    notes = [line.removeprefix("note: ") for line in err.splitlines()]
    assert len(notes) == 2
    assert json.loads(out)["notes"] == notes


def test_isotope_and_weights_by_hand(call):
    code, out, err = call("info", "water", "--isotope", "2=2H", "--json", "-")
    assert code == 0
    assert "the ratio calculated from its geometry" in err
    assert json.loads(out)["mass_u"] == pytest.approx(19.016841, abs=1e-6)  # H + D + 16O of AME2020, printed to 1e-6
    code, out, _ = call(
        "spectrum", "--constants", "A=30 B=20 C=10 GHz", "--dipole-abc", "0,1,0", "--spin-weights", "ee=2,eo=6,oe=6,oo=2",
        "--jmax", "1", "--json", "-"
    )  # fmt: skip
    content = json.loads(out)
    assert code == 0
    assert content["spin_weights"] == {"ee": 1, "eo": 3, "oe": 3, "oo": 1}
    assert [line["g_upper"] for line in content["lines"]] == [9, 3]  # 1(10)-1(01) at A - C, 1(11)-0(00) at A + C


def test_a_forbidden_dipole_is_one_line(call):
    code, out, err = call("spectrum", "water", "--dipole-abc", "1.8,0,0")
    assert (code, out) == (2, "")
    assert err == (
        "error: --dipole-abc: dipole μa = 1.8 D: a molecule of C2v has none along a; symmetry allows μb alone\n"
    )


def test_a_near_symmetry_is_shown_and_can_be_taken(call, folder):
    from ase.build import molecule

    molecule("C60").write(folder / "C60.xyz")
    code, out, err = call("info", "C60.xyz")
    assert code == 0
    near = (
        "Ci, rotational symmetry number 1; near Ih: nuclei are up to 0.0047 Å off it (--symmetry-tolerance accepts it)"
    )
    assert near in " ".join(out.split())
    assert "near Ih" in err
    code, out, err = call("info", "C60.xyz", "--symmetry-tolerance", "0.005", "--json", "-")
    content = json.loads(out)
    assert (content["point_group"], content["symmetry_number"], content["kind"]) == ("Ih", 60, "spherical")
    assert content["near_point_group"] is None
    assert call("info", "C60.xyz", "--symmetry-tolerance", "5 nm")[0] == 2
    assert call("info", "water", "--symmetry-tolerance", "0.005")[0] == 2


def test_q_and_vibrational_factor(call):
    _, out, _ = call("spectrum", "CO", "--q", "200", "--vibrational-factor", "1.5", "--json", "-")
    content = json.loads(out)
    assert content["q"]["q"] == 300.0
    assert content["q"]["jmax"] is None
    assert content["q"]["relative_error"] is None
    _, plain, _ = call("spectrum", "CO", "--json", "-")
    shift = math.log10(300.0 / json.loads(plain)["q"]["q"])
    by_frequency = {line["frequency_mhz"]: line["lgint"] for line in json.loads(plain)["lines"]}
    for line in content["lines"][:5]:
        assert by_frequency[line["frequency_mhz"]] - line["lgint"] == pytest.approx(shift, abs=1e-12)  # round-off


# JSON


def numbers_of(value):
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        return [number for item in value for number in numbers_of(item)]
    return [value] if isinstance(value, float) else []


@pytest.mark.parametrize("source", ["water", "CO", "CH3CN", "CH4"])
@pytest.mark.parametrize(("verb", "keys"), [("spectrum", SPECTRUM_KEYS), ("info", INFO_KEYS)])
def test_json_has_the_documented_keys(call, verb, keys, source):
    code, out, _ = call(verb, source, "--json", "-")
    assert code == 0
    content = json.loads(out, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert set(content) == keys
    text = "".join((PROJECT / "docs" / "verbs" / f"{page}.md").read_text(encoding="utf-8") for page in ("info", verb))
    assert all(f"`{key}`" in text for key in keys)
    assert all(map(math.isfinite, numbers_of(content)))
    assert content["rotor_version"] == rotor.__version__
    assert content["command"] == f"rotor {verb} {source} --json -"
    assert content["kind_decision"]["kind"] == content["kind"]
    if verb == "info":
        assert [row["temperature_k"] for row in content["partition_function"]] == [
            9.375,
            18.75,
            37.5,
            75,
            150,
            225,
            300,
            500,
            1000,
        ]
        assert np.allclose(np.array(content["frame"]["axes"]) @ np.transpose(content["frame"]["axes"]), np.eye(3))


def test_json_lines_are_those_of_the_list(call):
    _, out, _ = call("spectrum", "water", "--jmax", "4", "--top", "3", "--json", "-")
    content, lines = json.loads(out), rotor.api.line_list(rotor.read("water"), jmax=4)
    assert content["line_count"] == len(lines) == len(content["lines"])
    assert list(content["lines"][0]) == list(lines.columns)
    for name, column in lines.columns.items():
        assert [line[name] for line in content["lines"]] == column.tolist()
    lgint = lines.lgint
    assert sorted(lgint[content["strongest"]]) == sorted(lgint)[-3:]


def test_constants_alone_have_no_frame(call):
    _, out, _ = call("info", "--constants", RIGID, "--json", "-")
    content = json.loads(out)
    assert (content["frame"], content["kind_decision"], content["mass_u"], content["dipole_abc_debye"]) == (None,) * 4
    assert content["input"] == RIGID
    _, out, _ = call("info", "--constants", "B=1 GHz", "--json", "-")
    assert json.loads(out)["rotational_constants_mhz"] == [None, 1000.0, 1000.0]


# Files


def test_every_file_is_written_with_its_provenance(call, folder):
    options = "--cat a.cat --csv a.csv --parquet a.parquet --json a.json --plot a.png --profile-csv p.csv --fwhm 1MHz --tag 28503"
    code, out, _ = call("spectrum", "CO", *options.split())
    assert code == 0
    assert "carbon monoxide" in out
    names = ["a.cat", "a.csv", "p.csv"]
    assert sorted(p.name for p in folder.iterdir()) == sorted(
        [*names, *(f"{name}.provenance.json" for name in names), "a.parquet", "a.json", "a.png"]
    )
    for name in names:
        provenance = json.loads((folder / f"{name}.provenance.json").read_text(encoding="utf-8"))
        assert provenance["command"] == f"rotor spectrum CO {options}"
        assert provenance["version"] == rotor.__version__
        assert "CDMS" in provenance["constants_source"]
    assert (
        (folder / "a.cat")
        .read_text(encoding="ascii")
        .startswith("  115271.2021  0.0000 -5.0104 2    0.0000  3  28503 101 1 ")
    )
    assert json.loads((folder / "a.json").read_text(encoding="utf-8"))["files"] == [
        "a.cat", "a.csv", "a.parquet", "p.csv", "a.png", "a.json",
    ]  # fmt: skip


def test_files_appear_all_or_none(call, folder, monkeypatch):
    from rotor.plots.spectra import spectrum as plots

    (folder / "a.csv").write_text("old", encoding="utf-8")

    def fails(*args, **options):
        raise OSError(28, "No space left on device", "a.png")

    monkeypatch.setattr(plots, "picture", fails)
    code, out, err = call("spectrum", "CO", "--csv", "a.csv", "--cat", "a.cat", "--plot", "a.png")
    assert (code, out, err) == (1, "", "error: a.png: No space left on device\n")
    assert [p.name for p in folder.iterdir()] == ["a.csv"]
    assert (folder / "a.csv").read_text(encoding="utf-8") == "old"


def test_interrupt_says_in_one_line_that_nothing_was_written(call, folder, monkeypatch):
    from rotor.spectra import request

    def interrupted(*args, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr(request, "line_list", interrupted)
    assert call("spectrum", "CO", "--csv", "a.csv") == (130, "", "interrupted; nothing was written\n")
    assert not list(folder.iterdir())


def test_interrupt_of_the_report_names_the_files(call, folder, monkeypatch):
    from rotor.cli import command

    def interrupted(parts):
        raise KeyboardInterrupt

    monkeypatch.setattr(command, "show_parts", interrupted)
    code, out, err = call("levels", "CO", "--csv", "a.csv")
    assert (code, out) == (130, "")
    assert err == "interrupted while the report was printed; a.csv: written before\n"
    assert (folder / "a.csv").is_file()


# Mistakes

BAD_FILES = {
    "empty.xyz": "",
    "one.xyz": "1\none atom\nO 0 0 0\n",
    "close.xyz": "2\ntwo atoms at one place\nC 0 0 0\nO 0 0 0\n",
    "nan.xyz": "2\nnot a number\nC 0 0 0\nO 0 0 nan\n",
    "unknown.xyz": "2\nno such element\nC 0 0 0\nQq 0 0 1.1\n",
    "cut.xyz": "3\ncut in the middle\nO 0 0 0\nH 0.7",
    "text.xyz": "this is no geometry\n",
    "CO": "2\na file of the name of a molecule\nC 0 0 0\nO 0 0 1.1\n",
    "lines.cat": "  115271.2021  0.0000 -5.0104 2    0.0000  3  28503 101 1           0           \n",
}
MISTAKES = {
    "missing file": ("spectrum missing.xyz", "missing.xyz: no such file"),
    "empty file": ("spectrum empty.xyz", "empty"),
    "one atom": ("spectrum one.xyz", "single atom"),
    "two atoms at one place": ("spectrum close.xyz", "one on top of the other"),
    "NaN": ("spectrum nan.xyz", "nan"),
    "unknown element": ("spectrum unknown.xyz", "Qq"),
    "file cut in the middle": ("spectrum cut.xyz", "cut.xyz"),
    "no geometry": ("spectrum text.xyz", "text.xyz"),
    "folder": ("info ./sub", "folder"),
    "folder for lines": ("fit ./sub --start water", "sub: is a folder"),
    "folder for peaks": ("assign ./sub", "sub: is a folder"),
    "unknown unit": ("spectrum water --temperature 5furlong", "--temperature: '5furlong': unit 'furlong' is not a known unit"),
    "unit of another kind": ("spectrum water --range 0:5K/cm", "--range"),
    "negative temperature": ("spectrum water --temperature -5", "--temperature: -5: expected a finite number above 0 K"),
    "J max of -1": ("spectrum water --jmax -1", "--jmax: -1"),
    "SMILES that does not parse": ("spectrum SMILES:C(", "SMILES 'C('"),
    "SMILES that does not embed": ("spectrum SMILES:C1C#C1", "no geometry found"),
    "unreadable range": ("spectrum water --range 5", "--range: '5' is not a range"),
    "falling range": ("spectrum water --range 5:1GHz", "must rise"),
    "ambiguous name": ("spectrum CO", "'CO' is ambiguous"),
    "unknown name": ("spectrum Xx", "'Xx'"),
    "no input": ("spectrum", "neither is"),
    "two inputs": ("spectrum water --constants B=1", "both are given"),
    "catalogue as a molecule": ("spectrum lines.cat", "catalogue"),
    "unreadable constants": ("spectrum --constants B=x", "--constants"),
    "constants out of order": ("spectrum --constants A=1,B=2,C=3", "--constants"),
    "no dipole": ("spectrum --constants B=1GHz", "--dipole-abc"),
    "dipole without geometry": ("spectrum --constants B=1GHz --dipole 0,0,1", "use --dipole-abc"),
    "two dipoles": ("spectrum water --dipole 0,0,1 --dipole-abc 0,1,0", "give one of them"),
    "dipole of two numbers": ("spectrum water --dipole 0,1", "three finite numbers"),
    "dipole of NaN": ("spectrum water --dipole 0,0,nan", "--dipole"),
    "isotope of bare constants": ("spectrum --constants B=1 --isotope 1=2H", "no atoms"),
    "isotope of no atom": ("spectrum water --isotope 9=2H", "atom 9"),
    "spin weights of another kind": ("spectrum water --spin-weights even=1,odd=2", "do not fit an asymmetric top"),
    "spin weights of no rule": ("spectrum water --spin-weights x=1", "--spin-weights"),
    "spin weights unreadable": ("spectrum water --spin-weights ee", "class=number"),
    "spin weights twice": ("spectrum water --spin-weights ee=1,ee=2", "each class once"),
    "Q of zero": ("spectrum water --q 0", "--q: 0"),
    "Q of NaN": ("spectrum water --q nan", "--q: 'nan'"),
    "negative factor": ("spectrum water --vibrational-factor -1", "--vibrational-factor: -1"),
    "cut unreadable": ("spectrum water --min-lgint low", "--min-lgint"),
    "unknown profile": ("spectrum water --profile box --plot a.png", "--profile: 'box': expected one of"),
    "profile without width": ("spectrum water --profile voigt --plot a.png", "--fwhm"),
    "sticks with width": ("spectrum water --profile sticks --fwhm 1 --plot a.png", "--fwhm"),
    "profile to nowhere": ("spectrum water --fwhm 1", "--plot or --profile-csv"),
    "sticks as CSV": ("spectrum water --profile-csv a.csv", "sticks have no profile"),
    "Doppler without mass": (
        "spectrum --constants B=1GHz --dipole-abc 1,0,0 --profile gaussian --plot a.png", "needs a mass",
    ),
    "wrong suffix": ("spectrum water --cat a.txt", "must end in .cat"),
    "no folder to write in": ("spectrum water --csv no/a.csv", "there is no folder no"),
    "folder to write": ("spectrum water --csv sub.csv", "is a folder"),
    "two files of one name": ("spectrum water --csv a.csv --profile-csv ./a.csv --fwhm 1", "another output writes the same file"),
    "tag too long": ("spectrum water --tag 1234567", "--tag"),
    "negative count": ("spectrum water --top -1", "--top"),
    "temperature of emission": ("emission CO --temperature 20", "--temperature; the temperature of the molecules is --excitation"),
    "guess of a file": ("assign water.csv --guess water.toml", "'water.toml': expected three numbers for each guess"),
    "name of a molecule that has its formula alone": ("info ethanol", "did you mean CH3CH2OH?"),
    "formula of known isomers": ("info C2H5OH", "did you mean CH3CH2OH, CH3OCH3?"),
    "formula of nothing known": ("info C60", "none of ASE's g2 set; a SMILES is written"),
    "name of an isotopologue": ("info DCl", "did you mean HCl --isotope H=2H?"),
    "one of two hydrogens": ("info HD", "did you mean H2 --isotope N=2H, N the number of an H?"),
    "broken InChI": ("info InChI=1S/CH2O/c1-", "'InChI=1S/CH2O/c1-' cannot be read"),
    "hyphen before a negative number": ("spectrum water --range=-5-3GHz", "--range: '-5-3GHz' is not a range"),
    "wavenumber is no range": ("spectrum water --range 5cm-1", "--range: '5cm-1' is not a range"),
    "unknown option": ("spectrum water --colour red", "--colour"),
    "unknown verb": ("spektrum water", "spektrum"),
    "option without value": ("spectrum water --jmax", "--jmax"),
    "text for a number": ("spectrum water --jmax ten", "--jmax"),
    "grid of temperatures": ("info water --temperature 10:300", "--temperature"),
    "temperature of zero": ("info water --temperature 0,10", "above 0 K"),
}  # fmt: skip


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_one_line_and_leaves_nothing(call, folder, name):
    command, said = MISTAKES[name]
    for file, text in BAD_FILES.items():
        (folder / file).write_text(text, encoding="utf-8")
    for sub in ("sub", "sub.csv"):
        (folder / sub).mkdir()
    before = sorted(folder.rglob("*"))
    verb, *others = command.split()
    code, out, err = call(verb, "--json", "out.json", *others)
    assert (code, out) == (2, "")
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    assert said in err
    assert sorted(folder.rglob("*")) == before


def test_no_answer_is_another_exit_code(call, folder):
    code, out, err = call(
        "spectrum", "--constants", "B=1 MHz", "--dipole-abc", "1,0,0", "--temperature", "3000", "--csv", "a.csv"
    )
    assert (code, out) == (1, "")
    assert err.startswith("error: lines above 10^-12 nm² MHz at 3000 K reach to J = 29481, more than 600; give J max")
    assert "a largest constant of 1 MHz is small for a molecule: numbers without a unit are MHz; write GHz" in err
    _, _, err = call("spectrum", "--constants", "B=200 MHz", "--dipole-abc", "1,0,0", "--temperature", "3000")
    assert "reach to J" in err
    assert "GHz" not in err
    assert call("spectrum", "CH4", "--plot", "a.png")[0] == 1
    assert not list(folder.iterdir())


# The program as a whole


def test_help_shows_examples_and_every_option_is_documented(call):
    code, out, _ = call("--help")
    assert code == 0
    assert "rotor spectrum water\n" in out
    for verb in ("spectrum", "info", "levels"):
        code, out, _ = call(verb, "--help")
        assert code == 0
        assert f"rotor {verb} water\n" in out
        assert undocumented(verb, call(verb, "--help-all")[1] if "--help-all" in out else out) == set()
    assert call("identify", "--help-all") == call("identify", "--help")  # few options: --help shows all
    assert call()[1] == call("--help")[1]


def test_version_prints_the_version(call):
    assert call("--version") == (0, f"rotor {rotor.__version__}\n", "")


def test_a_molecule_is_read_from_standard_input(folder):
    ran = in_own_process("info", "-", "--json", "-", input=WATER_XYZ.replace("\n", "\r\n").encode(), cwd=folder)
    assert ran.returncode == 0, ran.stderr
    assert json.loads(ran.stdout)["formula"] == "H2O"


def test_a_reader_that_has_seen_enough_is_no_error(folder):
    environment = os.environ | {"PYTHONPATH": str(PROJECT), "PYTHONIOENCODING": "utf-8"}
    command = [sys.executable, "-m", "rotor", "spectrum", "H2CO", "--top", "100000"]
    with subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=folder
    ) as running:
        assert running.stdout.readline().startswith(b"formaldehyde")
        running.stdout.close()
        assert all(line.startswith(b"note: ") for line in running.stderr.read().splitlines())
        assert running.wait(timeout=60) == 0


def test_a_terminal_without_greek_letters(folder):
    environment = os.environ | {"PYTHONPATH": str(PROJECT), "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    command = [sys.executable, "-m", "rotor", "spectrum", "water", "--top", "1"]
    ran = subprocess.run(command, env=environment, capture_output=True, cwd=folder, check=False, timeout=60)
    assert ran.returncode == 0
    assert ran.stderr.startswith(b"note: 15 lines of levels")
    assert ran.stdout.startswith(b"water, H2O: asymmetric top (? = -0.4367)")


def test_nothing_heavy_is_loaded_for_lines_of_water(folder):
    code = (
        "import sys; from rotor import cli; cli.run(['spectrum', 'water']); "
        "print([m for m in ('ase', 'rdkit', 'qutip', 'matplotlib', 'numba', 'polars', 'pandas', 'rich') "
        "if m in sys.modules], file=sys.stderr)"
    )
    environment = os.environ | {"PYTHONPATH": str(PROJECT), "PYTHONIOENCODING": "utf-8"}
    ran = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, cwd=folder, check=True, timeout=60
    )
    assert ran.stderr.decode().splitlines()[-1] == "[]"


# Pieces


def test_tables_on_a_terminal_are_drawn(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    monkeypatch.setenv("COLUMNS", "80")
    table = Table("a title", ("name", "number [MHz]"), [("a", "1.5"), ("bc", "22.75")], frozenset({"name"}))
    screen = Terminal()
    monkeypatch.setattr(sys, "stdout", screen)
    show_table(table)
    drawn = screen.getvalue()
    assert all(text in drawn for text in ("a title", "number [MHz]", "22.75", "─"))

    wide = Table("", ("x" * 60, "y" * 60), [("1", "2")])
    screen.truncate(0)
    show_table(wide)
    assert "x" * 60 + "  " + "y" * 60 in screen.getvalue()  # whole, not cut to the terminal
    assert table_text(table) == "a title\nname  number [MHz]\na              1.5\nbc           22.75"


def test_numbers_that_are_not_finite_are_null():
    text = json_text({"a": math.nan, "b": [math.inf, 1.5], "c": np.float64(-math.inf), "rows": [{"x": math.nan}]})
    assert json.loads(text) == {"a": None, "b": [None, 1.5], "c": None, "rows": [{"x": None}]}


def test_dipole_carries_its_unit():
    assert Numbers("D", (3,)).read("0,0,3.33564095198152e-30 C*m") == pytest.approx((0.0, 0.0, 1.0))
    assert report.vector_text((1e-9, -1e-9, 1.85)) == "μa 0, μb 0, μc 1.85 D"


def test_columns_stand_under_their_headings(call):
    """With and without errors of the constants: each number of the JSON is printed under the heading of its name."""
    names = {
        "frequency (MHz)": "frequency_mhz", "error (MHz)": "error_mhz", "lgint": "lgint", 'E" (cm-1)': "energy_lower_cm",
        "g'": "g_upper", "A (1/s)": "einstein_a_per_s", "Sμ² (D²)": "strength_debye2",
    }  # fmt: skip
    for constants, errors in (("B=57635.968(1) D=0.1835(1) MHz", True), ("B=57635.968 D=0.1835 MHz", False)):
        arguments = ("spectrum", "--constants", constants, "--dipole-abc", "0.11,0,0", "--jmax", "3", "--top", "2")
        record = json.loads(call(*arguments, "--json", "-")[1])
        rows = call(*arguments)[1].split("(states: J)\n")[1].split("\n\n")[0].splitlines()
        heads = [head for head in names if head in rows[0]]
        assert ("error (MHz)" in heads) is errors
        ends = [rows[0].index(head) + len(head) for head in heads]
        for text, place in zip(rows[1:], record["strongest"], strict=True):
            printed = [float(text[:end].split()[-1]) for end in ends]
            expected = [record["lines"][place][names[head]] for head in heads]
            assert printed == pytest.approx(expected, rel=0.01, abs=5.1e-5)  # digits that are printed


def test_provenance_is_one_line_at_the_end_and_whole_when_asked_for(call):
    _, out, _ = call("spectrum", "water", "--top", "1")
    assert "sources   constants: fitted to c018003 of JPL (Pickett et al. 1998); dipole: from c018003 of JPL" in out
    assert len(out.splitlines()[1]) < 120  # constants, without where they are from
    assert "weighted by" not in out
    _, whole, _ = call("spectrum", "water", "--top", "1", "--sources")
    assert "weighted by their errors" in " ".join(whole.split())
    _, unsure, _ = call("spectrum", "C2H2")
    assert "constants: unverified: NIST CCCBDB release 22 has B" in unsure


def test_hitran_records_are_written(call, tmp_path):
    assert call("spectrum", "CO", "--hitran", "co.hitran", "--hitran-id", "5:1", "--jmax", "20")[0] == 0
    content = rotor.read(str(tmp_path / "co.hitran"))
    assert set(content.molecule.tolist()) == {5}
    lines = rotor.api.line_list(rotor.read("CO"), temperature_k=296, jmax=20)
    assert content.wavenumber_cm == pytest.approx(lines.frequency_mhz / 29979.2458, abs=6e-7)  # six decimals
    for extra in (("--hitran-id", "x"), ("--hitran-id", "5", "--temperature", "300"), ()):
        code, _, err = call("spectrum", "CO", "--hitran", "b.hitran", *extra)
        assert code == 2
        assert err.startswith("error: --hitran")


def test_a_forgotten_unit_is_named(call):
    _, _, err = call("spectrum", "--constants", "A=9.2 B=3 C=2.5", "--dipole-abc", "1,0,0")
    assert "no unit is given: the numbers are taken as MHz; for GHz write 'A=9.2 B=3 C=2.5 GHz'" in err
    _, out, _ = call("spectrum", "OCS", "--range", "2:18")
    assert "--range 2:18 has no unit and is taken as MHz: write 2:18GHz for GHz" in out
    assert "no unit" not in call("spectrum", "OCS", "--range", "2:3GHz")[1]


def test_what_a_unit_that_is_not_last_means_is_said(call):
    """Only a unit at the end applies to the constants without one; --help, a note and the error on the order say so."""
    rule = "only a unit at the end applies to the constants without one"
    code, _, err = call("info", "--constants", "A=9 GHz B=3 C=2")
    assert (code, f"note: --constants: GHz is the unit of A alone, and B, C are in MHz: {rule}" in err) == (0, True)
    code, _, err = call("info", "--constants", "A=9 B=3 C=2 GHz DeltaJ=1 kHz")
    assert code == 2
    assert f"exchange them; GHz is the unit of C alone, and A, B are in kHz: {rule}" in err
    code, _, err = call("info", "--constants", "A=9 GHz B=4 GHz C=3 GHz")
    assert (code, rule in err) == (0, False)
    assert "only a unit at the end applies to all" in " ".join(call("info", "--help")[1].split())


def test_a_smiles_without_its_prefix_is_recognized(call):
    code, _, err = call("spectrum", "C=O")
    assert (code, err) == (2, "error: 'C=O' is no file and no name of a molecule; did you mean 'SMILES:C=O'?\n")


def test_tables_of_facts_have_the_constants(call, folder):
    """Of a list of guessed geometries too, rounded to two uncertain digits of their errors."""
    (folder / "list.csv").write_text("name,smiles\nformaldehyde,C=O\n", encoding="utf-8")
    (folder / "many.toml").write_text(
        'schema = 1\nkind = "info"\nmolecule = "list.csv"\nconditions.temperature = "100 K"\noutputs.csv = "q.csv"\n'
    )
    code, out, err = call("run", "many.toml")
    assert code == 0, err
    row = next(csv.DictReader((folder / "q.csv").read_text().splitlines()))
    a, error = float(row["a_mhz"]), float(row["a_error_mhz"])
    assert 0.003 < error / a < 0.1
    assert a == round(a, 1 - math.floor(math.log10(error)))
    assert f" {a:.8g} " in out
    assert call("info", "OCS", "--csv", "one.csv")[0] == 0
    row = next(csv.DictReader((folder / "one.csv").read_text().splitlines()))
    assert (row["a_mhz"], float(row["b_mhz"])) == ("", rotor.read("OCS").constants["B"])


def test_conformers_show_no_digits_beyond_their_error(call):
    """A geometry of MMFF94 is good to 1.2 %: two uncertain digits, so that 18 GHz has steps of 10 MHz."""
    out = call("info", "SMILES:OCC=O", "--conformers", "10")[1]
    row = out.split("conformer ")[1].splitlines()[1].split()
    assert [float(cell) % 10 for cell in row[2:3]] == [0.0]
    assert all("." not in cell for cell in row[2:5])


def test_an_estimated_dipole_of_isotopologues_has_the_digits_that_are_known(call):
    """0.2 D uncertain, and printed as 2.3754: `rotor info` prints 2.4."""
    code, out, _ = call("isotopologues", "SMILES:CC=O")
    assert code == 0
    (parent,) = [line for line in out.splitlines() if line.startswith("C2H4O ")]
    assert " 2.4 " in parent
    assert not re.search(r"\d\.\d{4}  ", parent.partition(" abc ")[2].partition(" ")[2])


def test_constants_in_wavenumbers_have_no_more_digits_than_in_mhz(call):
    """5689.28 MHz was followed by 0.1897739536 cm-1."""
    rows = [line.split() for line in call("info", "benzene")[1].splitlines() if line.startswith(("B ", "DJ "))]
    assert rows == [["B", "5689.28", "0.189774"], ["DJ", "0.00125", "4.17e-08"]]
