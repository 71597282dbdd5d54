"""`rotor cat`, `rotor convert` and `rotor spectrum case.int` keep the contract of docs/verbs."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from oracle_cases import SAMPLES, disagreements, prediction
from places import PROJECT

import rotor
from rotor.formats.spcat.text.cat import read_cat, write_cat
from rotor.formats.spcat.text.par import read_par

PAGES = PROJECT / "docs" / "verbs"
OCS = str(SAMPLES / "ocs" / "sample.cat")


@pytest.mark.parametrize("case", ["h2co", "ch3cn", "ocs"])
def test_an_int_file_makes_the_programs_catalogue(call, case, tmp_path):
    code, out, _ = call("spectrum", str(SAMPLES / case / f"{case}.int"), "--cat", "out.cat", "--json", "out.json")
    assert code == 0
    assert "Q" in out
    assert disagreements(read_cat(SAMPLES / case / "sample.cat"), read_cat(tmp_path / "out.cat")) == []
    content = json.loads((tmp_path / "out.json").read_text(encoding="utf-8"))
    assert content["line_count"] == len(prediction(SAMPLES / case).lines)
    assert (tmp_path / "out.cat.provenance.json").exists()


def test_options_that_the_files_answer_are_refused_and_silences_told(call, tmp_path):
    source = str(SAMPLES / "ocs" / "ocs.int")
    options = [("--jmax", "3"), ("--temperature", "10 K"), ("--q", "7"), ("--range", "0:9GHz"), ("--tag", "1")]
    options += [("--hessian", "h.txt"), ("--internal-rotation", "geometry"), ("--symmetry-tolerance", "0.1")]
    for option in options:
        code, _, err = call("spectrum", source, *option)
        assert code == 2
        assert err.startswith(f"error: {option[0]}: {source} determines it")
    code, _, err = call("spectrum", source, "--range", "0:9GHz", "--jmax", "3", "--isotope", "S=34S")
    assert code == 2
    assert err.startswith(
        f"error: --jmax, --range, --isotope: {source} determines them (FEND, FQLIM, the constants); change them there"
    )
    shutil.copy(SAMPLES / "so2" / "so2.int", tmp_path / "so2.int")
    text = (SAMPLES / "so2" / "so2.var").read_text()
    (tmp_path / "so2.var").write_text(text.replace("a 1 1 0 60 ", "a 1 1 0 20 "))
    code, _, err = call("spectrum", "so2.int", "--top", "0")
    assert code == 0
    assert err.startswith("note: KNMAX = 20 of state 0: as the file says, other K are left out")
    (tmp_path / "so2.var").unlink()
    assert call("spectrum", "so2.int")[0] == 2


def test_the_other_way_is_named_only_where_it_works(call, tmp_path):
    """A .var whose states have different spins has no named constants; then --temperature says only where it is set."""
    (tmp_path / "a.int").write_text("a\n1 76004 1000.0 0 3 -19.0 -19.0 9000.0 300.0\n1 1.2\n")
    head = "a\n 3 9 1 0 0.0 1.0e6 1.0 1.0\na 1 2 0 60 0 1 1 1 0 1 0\n{}10099 9400.0 1e36\n20099 3100.0 1e36\n30099 2500.0 1e36\n"
    for second, other in (("", True), ("a 3 1 0 60 0 1 1 1 0 1 0\n", False)):
        (tmp_path / "a.var").write_text(head.format(second).replace("a 1 2", "a 1 -2" if second else "a 1 2"))
        code, _, err = call("spectrum", "a.int", "--temperature", "10 K")
        assert code == 2
        assert err.startswith("error: --temperature: a.int determines it (TEMP); change it there")
        assert ("or give a.var with --dipole-abc" in err) == other
        assert (call("spectrum", "a.var", "--dipole-abc", "1,0,0", "--temperature", "10 K")[0] == 0) == other


def test_constants_go_to_toml_and_back(call, tmp_path):
    for suffix in (".int", ".var"):
        shutil.copy(SAMPLES / "so2" / f"so2{suffix}", tmp_path / f"so2{suffix}")
    assert call("convert", "so2.var", "so2.toml")[0] == 0
    code, _, err = call("convert", "so2.toml", "back.par", "--kmax", "60")
    assert code == 0
    assert err.startswith("note: a .par file cannot hold the dipole")
    there, back = read_par(tmp_path / "so2.var"), read_par(tmp_path / "back.par")
    assert [(p.code, p.value) for p in back.parameters] == [(p.code, p.value) for p in there.parameters]
    assert (back.options[0].iax, back.options[0].wtpl, back.options[0].wtmn, back.options[0].knmax) == (2, 1, 0, 60)
    top = rotor.read(tmp_path / "so2.toml")
    assert top.dipole_abc_debye == (0.0, 1.63305, 0.0)
    assert top.source == "converted from so2.var"


def test_errors_of_a_var_file_become_uncertainties(call, tmp_path):
    text = (SAMPLES / "so2" / "so2.var").read_text().replace("1.00000000E-037 /A", "2.5E-3 /A")
    (tmp_path / "so2.var").write_text(text)
    assert call("convert", "so2.var", "so2.toml")[0] == 0
    assert rotor.read(tmp_path / "so2.toml").constants.uncertainties == {"A": 2.5e-3}


def test_what_cannot_be_converted_is_refused(call, tmp_path):
    (tmp_path / "a.toml").write_text('[constants]\nunit = "MHz"\nA = 9.0\nB = 5.0\nC = 4.0\nrepresentation = "IIr"\n')
    assert call("convert", "a.toml", "a.par")[:2] == (2, "")
    assert call("convert", "a.toml", "a.xyz")[2].startswith("error: TARGET a.xyz: the name must end in")
    assert [p.name for p in tmp_path.iterdir()] == ["a.toml"]


def test_a_catalogue_is_shown_and_filtered(call, tmp_path):
    code, out, _ = call("cat", OCS, "--range", "0:50GHz", "--top", "2", "--out", "part.cat")
    assert code == 0
    assert "the 2 strongest of 4 lines" in out
    assert "frequency (MHz)  error (MHz)" in out
    whole = read_cat(OCS)
    assert read_cat(tmp_path / "part.cat").frequency_mhz.tolist() == whole.frequency_mhz[:4].tolist()
    _, out, _ = call("cat", OCS, "--min-lgint", "-3", "--json", "-")
    content = json.loads(out)
    assert content["line_count"] == np.count_nonzero(whole.lgint >= -3) > 10
    assert content["lines"][0]["quanta_upper"] == [content["lines"][0]["quanta_lower"][0] + 1]


def test_the_lines_that_are_left_go_to_tables(call, tmp_path):
    """As CSV and Parquet, every number as in the file."""
    source = str(SAMPLES / "ocs" / "sample.cat")
    assert call("cat", source, "--range", "30:50GHz", "--csv", "a.csv", "--parquet", "a.parquet")[0] == 0
    lines = read_cat(SAMPLES / "ocs" / "sample.cat")
    inside = lines.frequency_mhz[(lines.frequency_mhz > 30e3) & (lines.frequency_mhz < 50e3)]
    rows = (tmp_path / "a.csv").read_text().splitlines()
    assert [float(row.split(",")[0]) for row in rows[1:]] == inside.tolist()
    import duckdb

    computed = duckdb.sql(f"select frequency_mhz, error_mhz from '{tmp_path / 'a.parquet'}'").fetchall()
    assert [row[0] for row in computed] == inside.tolist()


def test_a_comparison_counts_and_measures(call, tmp_path):
    whole = read_cat(OCS)
    write_cat(whole.take(slice(2, None)), tmp_path / "less.cat")
    _, out, _ = call("cat", OCS, "--compare", "less.cat", "--json", "-")
    content = json.loads(out)["compared"]
    assert (content["matched"], content["missing"], content["extra"]) == (len(whole) - 2, 2, 0)
    assert content["frequency_mhz"]["largest"] == 0
    assert [line["quanta_upper"] for line in content["missing_lines"]] == [[1], [2]]
    _, out, _ = call("cat", "less.cat", "--compare", OCS)
    assert "only there: all lines" in out
    assert "mean there - here 0 MHz" in out


def test_a_catalogue_meets_its_prediction(call):
    _, out, _ = call("cat", OCS, "--compare", str(SAMPLES / "ocs" / "ocs.int"), "--json", "-")
    content = json.loads(out)["compared"]
    assert (content["matched"], content["missing"], content["extra"]) == (100, 0, 0)
    assert content["frequency_mhz"]["largest"] < 1.1e-4  # four decimals
    _, out, err = call("cat", OCS, "--compare", "OCS", "--json", "-")
    assert err.startswith("note: OCS: predicted at 300 K with Q = 1028.6")
    assert json.loads(out)["compared"]["frequency_mhz"]["largest"] < 1.0  # other constants: H differs by 1e-11 MHz


def test_measured_lines_are_merged_in(call, tmp_path):
    text = Path(OCS).read_text().splitlines(keepends=True)
    (tmp_path / "seen.cat").write_text("   12163.0000  0.0500" + text[0][21:44] + " -60503" + text[0][51:])
    _, out, _ = call("cat", OCS, "--measured", "seen.cat", "--json", "-")
    first = json.loads(out)["lines"][0]
    assert (first["frequency_mhz"], first["error_mhz"], first["tag"]) == (12163.0, 0.05, -60503)


def test_a_catalogue_is_drawn(call, tmp_path):
    for name in ("a.png", "a.svg", "a.pdf"):
        assert call("cat", OCS, "--plot", name)[0] == 0
    assert "log" in (tmp_path / "a.svg").read_text(encoding="utf-8")
    assert call("cat", OCS, "--range", "1:2MHz", "--plot", "none.png")[0] == 1
    assert not (tmp_path / "none.png").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("cat", "water"), "water: expected a catalogue"),
        (("cat", "no.cat"), "no.cat"),
        (("cat", OCS, "--range", "5"), "--range: '5' is not a range"),
        (("cat", OCS, "--min-lgint", "x"), "--min-lgint: 'x'"),
    ],
)
def test_wrong_input_is_one_line(call, arguments, words):
    code, out, err = call(*arguments)
    assert (code, out) == (2, "")
    assert words in err
    assert err.count("\n") == 1


def test_every_option_and_key_is_documented(call):
    for verb in ("cat", "convert"):
        _, out, _ = call(verb, "--help")
        options = set(re.findall(r"--[a-z][a-z-]+", out.split("Arguments:")[1].split("Examples:")[0])) - {"--help"}
        part = (PAGES / f"{verb}.md").read_text(encoding="utf-8")
        assert {option for option in options if f"`{option}" not in part} == set()
    content = json.loads(call("cat", OCS, "--compare", OCS, "--json", "-")[1])
    text = (PAGES / "cat.md").read_text(encoding="utf-8")
    assert [key for key in (*content, *content["compared"], *content["lines"][0]) if f"`{key}`" not in text] == []


def test_a_prediction_has_the_temperature_and_the_range_of_the_catalogue(call, tmp_path):
    assert call("spectrum", "OCS", "--temperature", "75", "--range", "100:400GHz", "--cat", "cold.cat")[0] == 0
    _, out, err = call("cat", "cold.cat", "--compare", "OCS", "--json", "-")
    content = json.loads(out)["compared"]
    assert "predicted at 75 K" in err
    assert (content["temperature_k"], content["temperature_source"]) == (75.0, "cold.cat.provenance.json")
    assert (content["missing"], content["extra"]) == (0, 0)
    assert content["lgint"]["largest"] < 1.01e-4  # printed to four decimals
    (tmp_path / "cold.cat.provenance.json").unlink()
    _, out, err = call("cat", "cold.cat", "--compare", "OCS", "--json", "-")
    assert json.loads(out)["compared"]["temperature_k"] == 300.0
    assert "most like those at 7" in err
    _, out, err = call("cat", "cold.cat", "--compare", "OCS", "--temperature", "75", "--json", "-")
    assert json.loads(out)["compared"]["lgint"]["largest"] < 1.01e-4  # as above
    assert "most like" not in err
    assert "error: --temperature: expected with --compare" in call("cat", "cold.cat", "--temperature", "75")[2]


def test_another_isotope_is_compared(call, tmp_path):
    assert call("spectrum", "OCS", "--isotope", "S=34S", "--jmax", "5", "--cat", "heavy.cat")[0] == 0
    _, out, _ = call("cat", "heavy.cat", "--compare", "OCS", "--isotope", "S=34S", "--json", "-")
    assert json.loads(out)["compared"]["other"] == "OCS, S=34S"
    assert json.loads(out)["compared"]["frequency_mhz"]["largest"] < 1.01e-4  # four decimals


def test_a_comparison_is_drawn_as_a_mirror_with_differences():
    from rotor.formats.spcat.compare import compare
    from rotor.plots.spectra.comparison import comparison_figure

    whole = read_cat(OCS)
    comparison = compare(whole, read_cat(OCS).take(slice(5, None)))
    figure = comparison_figure(comparison, names=("measured.cat", "SO2"))
    above, below = figure.axes
    sticks = [np.array(collection.get_segments()) for collection in above.collections]
    tips = [segments[:, 1, 1] for segments in sticks]
    assert [len(t) for t in tips] == [len(whole) - 5, 5, len(whole) - 5]  # matched, only above, matched below
    assert (tips[0] > 0).all()
    np.testing.assert_allclose(-tips[2], tips[0])  # the same lines
    assert np.ptp(below.lines[1].get_ydata()) == 0
    assert [text.get_text() for text in above.texts] == ["measured.cat", "SO$_{2}$"]
    ticks, labels = above.get_yticks(), [text.get_text() for text in above.get_yticklabels()]
    half = len(ticks) // 2
    np.testing.assert_allclose(ticks[:half], -ticks[half:])  # the scale below is that above, upside down
    assert labels[:half] == labels[half:]


def test_the_plot_of_a_comparison_is_written(call, tmp_path):
    assert call("cat", OCS, "--compare", "OCS", "--plot", "both.svg")[0] == 0
    assert "Difference" in (tmp_path / "both.svg").read_text(encoding="utf-8")


@pytest.mark.parametrize("content", [b"", b"\n \r\n"])
@pytest.mark.parametrize("words", [["empty.cat"], [OCS, "--compare", "empty.cat"], [OCS, "--measured", "empty.cat"]])
def test_a_file_without_lines_is_no_catalogue(call, tmp_path, words, content):
    (tmp_path / "empty.cat").write_bytes(content)
    code, out, err = call("cat", *words)
    assert (code, out) == (2, "")
    assert err == "error: empty.cat: the file is empty; expected lines of a catalogue\n"
