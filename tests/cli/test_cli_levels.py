"""`rotor levels` and its files keep their contract: docs/verbs/levels.md."""

from __future__ import annotations

import csv
import gzip
import json
from pathlib import Path

import numpy as np
import pytest

import rotor
from rotor.formats.spcat.names.named_top import named_top
from rotor.formats.spcat.text.egy import read_egy
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.level_list import level_list
from rotor.formats.spcat.text.par import read_par
from rotor.plots.energies.levels import ladders, levels_figure
from rotor.plots.show import write_picture
from rotor.plots.view import View
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.request import LevelsRequest, answer_levels
from rotor.reports.screen import plain, table_records

KEYS = {
    "jmin", "jmax", "kmin", "kmax", "max_energy_mhz", "quantum_numbers", "level_count", "ground_mhz", "hyperfine", "levels", "files",
    "errors",
}  # fmt: skip


def test_the_same_request_gives_the_same_answer(call):
    arguments = ("--j", "1:6", "--k", "1:2", "--max-energy", "200cm-1", "--json", "-")
    content = json.loads(call("levels", "H2CO", *arguments)[1])
    request = LevelsRequest(rotor.read("H2CO"), jmin=1, jmax=6, kmin=1, kmax=2, max_energy_mhz=200 * 29979.2458)
    answer = answer_levels(request)
    facts = plain({**answer.facts(), "levels": table_records(answer.table)})
    assert {key: content[key] for key in facts} == facts
    assert len(content["levels"]) == content["level_count"] > 10


def test_json_of_levels_has_the_documented_keys(call):
    content = json.loads(call("levels", "water", "--json", "-")[1])
    info = json.loads(call("info", "water", "--json", "-")[1])
    assert set(content) == KEYS | set(info) - {"partition_function"}
    assert set(content["levels"][0]) == {
        "j", "ka", "kc", "energy_mhz", "error_mhz", "energy_cm", "energy_k", "weight", "degeneracy",
    }  # fmt: skip
    assert content["jmax"] == 10


def test_energies_have_the_errors_of_constants(call, folder):
    """σ(E) = J(J+1) σ(B) of a linear rigid top, and nothing for the lowest level; no column without errors."""
    assert call("levels", "--constants", "B=6000.0(2) MHz", "--jmax", "3", "--csv", "a.csv")[0] == 0
    rows = list(csv.DictReader(Path("a.csv").read_text().splitlines()))
    assert [float(row["error_mhz"]) for row in rows] == pytest.approx([0.0, 0.4, 1.2, 2.4])
    assert call("levels", "--constants", "B=6000.0 MHz", "--jmax", "3", "--csv", "b.csv")[0] == 0
    assert "error_mhz" not in Path("b.csv").read_text()


def test_energies_count_from_the_lowest_level_that_exists():
    """J = 1 with eo and oe alone: B + C is the lowest, and A + B is A - C above it."""
    weights = {"ee": 0, "oo": 0, "eo": 1, "oe": 1}
    top = rotor.Top.from_constants("A=9000.0(3) B=6000.0(2) C=4000.0(1) MHz", spin_weights=weights)
    table = answer_levels(LevelsRequest(top, jmax=1)).table
    errors = dict(zip(table.energy_mhz.round(6).tolist(), table.error_mhz.round(9).tolist(), strict=True))
    assert errors[0.0] == 0.0
    assert errors[5000.0] == pytest.approx(np.hypot(0.3, 0.1))


def test_tabulated_energies_have_the_errors_of_the_table_and_no_series():
    """Water to J = 5 is in its table: nothing is said of the next order of distortion, for levels and for lines."""
    answer = rotor.levels("water", jmax=5)
    table = rotor.read("water").level_table
    rows = table.rows_of(answer.table.levels.quanta)[answer.table.rows]
    assert answer.table.error_mhz.tolist() == table.error_mhz[rows].tolist()
    for each in (answer, rotor.spectrum("water", jmax=5), rotor.levels("water", jmax=60)):
        assert ("centrifugal distortion of order" in each.errors.line()) == (each.request.jmax == 60)


@pytest.mark.parametrize(("unit", "energy"), [("MHz", "12.0000"), ("cm-1", "0.000400"), ("K", "0.000576")])
def test_the_table_is_in_the_unit_asked_for(call, unit, energy):
    """2B of B = 6 MHz; 6 MHz are 2.0e-4 cm⁻¹ and 2.88e-4 K."""
    _, out, _ = call("levels", "--constants", "B=6 MHz", "--jmax", "1", "--unit", unit)
    table = out.split("in order of energy\n")[1].splitlines()
    assert table[0].split() == ["J", "E", f"({unit})", "spin", "weight", "g"]
    assert table[2].split() == ["1", energy, "1", "3"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--j", "5:2"), "--j: '5:2': expected a range that rises, but 5 is above 2"),
        (("--j", "x"), "--j: 'x': expected a whole number or a range of them, such as 2:5"),
        (("--j", "1:2", "--jmax", "3"), "--j and --jmax: give one of them"),
        (("--unit", "eV"), "--unit: 'eV': expected one of MHz, cm-1, K"),
        (("--max-energy", "0"), "--max-energy: 0: expected a finite number above 0"),
        (("--max-energy", "5kg"), "--max-energy: '5kg': unit 'kg' does not measure the same thing as 'MHz'"),
        (("--egy", "a.txt"), "--egy a.txt: the name must end in .egy"),
    ],
)
def test_mistakes_are_one_line(call, folder, arguments, said):
    code, out, err = call("levels", "water", *arguments, "--csv", "a.csv")
    assert (code, out) == (2, "")
    assert err.startswith(f"error: {said}")
    assert err.count("\n") == 1
    assert not list(folder.iterdir())


def test_k_of_a_linear_top_is_refused(call):
    code, _, err = call("levels", "CO", "--k", "1:2")
    assert (code, err) == (2, "error: --k: the levels of a linear top have no K; give J alone\n")


def test_files_of_levels_hold_every_row(call, folder):
    assert call("levels", "CH3CN", "--jmax", "4", "--csv", "a.csv", "--egy", "a.egy", "--plot", "a.png")[0] == 0
    with open(folder / "a.csv", newline="") as handle:
        rows = list(csv.DictReader(handle))
    table = answer_levels(LevelsRequest(rotor.read("CH3CN"), jmax=4)).table
    assert [float(row["energy_cm"]) for row in rows] == table.energy_cm.tolist()
    assert len(read_egy(folder / "a.egy")) == len(rows) == 15  # J + 1 values of |K| for each J
    assert (folder / "a.png").read_bytes().startswith(b"\x89PNG")
    assert json.loads((folder / "a.csv.provenance.json").read_text())["command"].startswith("rotor levels CH3CN")


def test_irreps_have_no_place_in_an_egy_file(call, folder):
    code, _, err = call("levels", "--constants", "B=5.24 cm-1, Dt=1e-6 cm-1", "--egy", "a.egy")
    assert code in (1, 2)
    assert err.count("\n") == 1
    assert not list(folder.iterdir())


@pytest.mark.oracle
@pytest.mark.parametrize("case", ["abc_rigid_j20_all", "so2", "h2co"])
def test_blocks_and_energies_are_those_of_spcat(shared: Path, case):
    """Every level of the reference's list with the same block, rank, degeneracy and energy."""
    folder = shared / "reference" / "spcat" / case
    reference = read_egy(gzip.decompress((folder / f"{case}.egy.gz").read_bytes()))
    top = named_top(read_par(folder / f"{case}.var"), read_int(folder / f"{case}.int"))
    ours = level_list(answer_levels(LevelsRequest(top, jmax=20)).table)
    places = {tuple(row): i for i, row in enumerate(ours.quanta.tolist())}
    rows = [i for i in range(len(reference)) if reference.quanta[i, 0] <= 20]
    mine = np.array([places[tuple(reference.quanta[i].tolist())] for i in rows])
    assert len(rows) > 200
    if case != "so2":  # where SPCAT counts only the species that exist
        assert (ours.block[mine] == reference.block[rows]).all()
    assert (ours.rank[mine] == reference.rank[rows]).all()
    assert (
        np.abs(ours.energy_cm[mine] - reference.energy_cm[rows]).max() < 1.5e-6
    )  # half a digit of print and 1e-6 of it
    ratio = reference.degeneracy[rows] / ours.degeneracy[mine]
    assert len(set(ratio.tolist())) == 1  # our weights are reduced by their common divisor


def test_columns_of_the_diagram():
    for source, name, count in (("CH3CN", "|K|", 5), ("water", "Ka", 5), ("CO", "J", 5), ("CH4", "J", 5)):
        top = rotor.read(source)
        table = answer_levels(LevelsRequest(top, jmax=4)).table
        assert ladders(table, top)[0] == name
        assert len(set(ladders(table, top)[1].tolist())) == count
    oblate = rotor.Top.from_constants("A=10 B=9 C=4 MHz")  # κ = 0.67
    assert ladders(answer_levels(LevelsRequest(oblate, jmax=4)).table, oblate)[0] == "Kc"


def test_labels_of_the_diagram_do_not_overlap(tmp_path, monkeypatch):
    from matplotlib.figure import Figure

    drawn = []
    save = Figure.savefig
    monkeypatch.setattr(Figure, "savefig", lambda self, *a, **k: (drawn.append(self), save(self, *a, **k))[1])
    top = rotor.read("H2CO")
    write_picture(answer_levels(LevelsRequest(top, jmax=10)), tmp_path / "a.png", unit="K")
    figure = drawn[0]
    figure.canvas.draw()
    axes = figure.axes[0]
    boxes = [text.get_window_extent() for text in axes.texts]
    assert len(boxes) > 30
    assert not any(
        a.y0 + 1 < b.y1 - 1 and b.y0 + 1 < a.y1 - 1 and abs(a.x0 - b.x0) < 1
        for i, a in enumerate(boxes)
        for b in boxes[:i]
    )  # a pixel
    assert axes.get_ylabel() == "Energy (K)"


def test_spin_constants_split_levels(call, folder):
    """E(F) = -χ Y(F): N = 1 of one spin 1 has F = 0 at -χ/2, F = 1 at χ/4, F = 2 at -χ/20 (H. B. G. Casimir), to first order."""
    options = ("--constants", "B=44315.9757 MHz", "--spin-constants", "chi_aa(14N)=-4.7 MHz")
    code, out, _ = call("levels", *options, "--jmax", "1", "--json", "-")
    content = json.loads(out)
    assert code == 0
    assert content["quantum_numbers"] == ["n", "f"]
    energy = {(level["n"], level["f"]): level["energy_mhz"] for level in content["levels"]}
    assert len(energy) == 4
    splittings = [energy[1, f] - 2 * 44315.9757 for f in (0, 1, 2)]
    assert splittings == pytest.approx(
        [4.7 / 2, -4.7 / 4, 4.7 / 20], abs=2e-4
    )  # second order: χ²/B = 5e-4 MHz, times less than 0.4
    assert "N from 0 to 1" in call("levels", *options, "--jmax", "1")[1]
    assert "J from 0 to 1" in call("levels", *options[:2], "--jmax", "1")[1]


def test_levels_with_the_spins_of_the_library(call, folder):
    code, out, _ = call("levels", "formamide", "--hyperfine", "--jmax", "1", "--csv", "a.csv")
    assert code == 0
    assert "N Ka Kc F" in out
    assert len((folder / "a.csv").read_text().splitlines()) == 1 + 1 + 9  # F = 1 of N = 0; three F of three levels
    code, _, error = call("levels", "water", "--hyperfine")
    assert code == 2
    assert "no constants of spins are known" in error


@pytest.mark.parametrize(("limits", "expected"), [(None, {"$1_{0,1}, F{=}0,1,2$"}), ((21200.0, 21215.0), {0, 1, 2})])
def test_overlapping_levels_of_spins_have_one_label(limits, expected):
    """Steps that cannot be resolved have all values of F at one label; where the view parts them each has its own."""
    top = rotor.read("formamide")
    table = answer_levels(LevelsRequest(top, jmax=1, effects=effects_of(top, True))).table
    figure = levels_figure(table, top, unit="MHz", view=View(vertical=limits))
    texts = {text.get_text() for text in figure.axes[0].texts if "$1_{0,1}" in text.get_text()}
    assert texts == {label if isinstance(label, str) else f"$1_{{0,1}}, F{{=}}{label}$" for label in expected}


def test_ammonia_counts_from_the_lowest_level_that_exists_and_says_which(call):
    """Of J = K = 0 the upper inversion level alone exists (three protons are fermions): v = 1, 0.793 cm⁻¹ above the other."""
    code, out, err = call("levels", "NH3", "--jmax", "2")
    assert (code, err) == (0, "")
    head, table = out.split("all levels, in order of energy")
    assert "v J K = 1 0 0, 23785.6961 MHz above the Hamiltonian's zero: energies count from this level" in head
    assert "12: J from 0 to 2; 3 of spin weight 0, which do not exist, are not shown" in head
    rows = [line.split() for line in table.splitlines() if line[:3].strip().isdigit()]
    assert len(rows) == 9
    assert rows[0][:4] == ["1", "0", "0", "0.000000"]
    assert all(float(row[3]) >= 0 for row in rows)
    assert all(int(row[4]) > 0 for row in rows)
    weights = [line.split(": ") for line in head.splitlines() if "0even" in line]
    assert [text.split("  ")[0] for *_, text in weights] == [
        "0even 0, 0odd 4, 1 1, 2 1 (each of K and -K)",
        "0even 4, 0odd 0, 1 1, 2 1",
    ]
    assert "0 2, 1 1" not in head  # weights of both states together contradict the table
    by_label = {tuple(row[:3]): int(row[4]) for row in rows}
    assert by_label[("1", "0", "0")] == 4  # 0even of 0-
    assert by_label[("0", "1", "1")] == 2  # K and -K


def test_files_written_are_listed_after_the_report(call, folder):
    """For people alone: the JSON on standard output stays JSON."""
    _, out, _ = call("levels", "OCS", "--csv", "a.csv", "--plot", "a.png", "--save-scene", "a.toml", "--json", "a.json")
    assert out.splitlines()[-1].split(maxsplit=1) == ["files", "a.csv, a.png, a.toml, a.json"]
    assert "files" not in call("levels", "OCS")[1].split()
    assert json.loads(call("levels", "OCS", "--csv", "a.csv", "--json", "-")[1])["files"] == ["a.csv"]


def test_a_table_goes_to_standard_output(call, folder):
    assert call("levels", "OCS", "--jmax", "3", "--csv", "a.csv")[0] == 0
    code, out, _ = call("levels", "OCS", "--jmax", "3", "--csv", "-")
    assert (code, out) == (0, (folder / "a.csv").read_text(encoding="utf-8"))
    code, _, err = call("levels", "OCS", "--csv", "-", "--json", "-")
    assert (code, err.rstrip()) == (2, "error: --csv - and --json -: one of them can go to standard output")
    assert "--parquet -: the name must end in .parquet" in call("levels", "OCS", "--parquet", "-")[2]
    assert "--csv -: the name must end in .csv" in call("fluid", "water", "--csv", "-")[2]  # written during the run


def test_labels_of_a_term_diagram_end_before_the_next_column():
    """5 0 5 of water was written over the step of 5 1 5."""
    top = rotor.read("water")
    (axes,) = levels_figure(answer_levels(LevelsRequest(top, jmax=5)).table, top).axes
    steps = [axes.transData.transform(step) for lines in axes.collections for step in lines.get_segments()]
    for label in axes.texts:
        box = label.get_window_extent()
        crossed = [s for s in steps if box.y0 < s[0, 1] < box.y1 and s[0, 0] < box.x1 and s[1, 0] > box.x0]
        assert not crossed, label.get_text()
