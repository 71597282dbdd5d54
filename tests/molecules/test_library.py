"""Which folders of molecules are searched, in what order, what a broken file does, and `rotor molecules`."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from places import PROJECT

from rotor.cli import run
from rotor.formats.molecules import library
from rotor.formats.molecules.library import folders, library_file, library_molecule, names

OURS = PROJECT / "data" / "molecules"


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty home folder, and no variable set."""
    folder = tmp_path / "home"
    folder.mkdir()
    for variable in ("HOME", "USERPROFILE"):
        monkeypatch.setenv(variable, str(folder))
    monkeypatch.delenv(library.VARIABLE, raising=False)
    return folder


def put(folder: Path, stem: str, b: float, text: str = "") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{stem}.toml"
    path.write_text(f"{text}\n[constants]\nsource = 'mine'\nB = {b!r}\n", encoding="utf-8")
    return path


def test_without_folders_of_ones_own_there_is_ours_alone():
    assert folders() == (OURS,)
    assert {path.parent for path in names().values()} == {OURS}
    assert len(set(names().values())) == len(list(OURS.glob("*.toml")))


def test_every_name_of_every_file_leads_to_it():
    for path in OURS.glob("*.toml"):
        assert library_file(path.stem) == path
        molecule = library_molecule(path.stem)
        assert {library_file(name) for name in (molecule.name, *molecule.names)} == {path}


def test_home_and_variable_are_searched_before_ours_and_the_first_wins(home, tmp_path, monkeypatch):
    mine = put(home / ".rotor" / "molecules", "mine", 1.0, 'name = "water"')
    assert library_file("water") == library_file("Water") == library_file("mine") == mine
    assert library_file("H2O") == OURS / "H2O.toml"  # a name that mine does not claim

    first = put(tmp_path / "one", "mine", 2.0, 'name = "water"')
    second = put(tmp_path / "two", "other", 3.0, 'names = [\n  "WATER", "HHO",\n]')
    monkeypatch.setenv("ROTOR_MOLECULES", os.pathsep.join([str(first.parent), "", str(second.parent)]))
    assert folders() == (first.parent, second.parent, mine.parent, OURS)
    assert library_file("water") == first
    assert library_molecule("HHO").constants["B"] == 3.0
    assert names()["water"] == first


def test_the_top_of_ones_own_molecule_is_read_by_name(home):
    import rotor

    put(home / ".rotor" / "molecules", "H2O", 7.0)  # no name inside: the file's own name serves
    assert rotor.read("H2O").constants["B"] == 7.0
    assert rotor.read("water").constants["B"] > 400_000


def test_a_changed_a_new_and_a_removed_file_are_noticed(home):
    path = put(home / ".rotor" / "molecules", "a", 1.0, 'name = "first name"')
    assert library_file("first name") == path
    put(path.parent, "a", 1.0, 'name = "second name"')
    os.utime(path, ns=(1, 1))  # a clock may be coarse: the change is known by the time of the file
    assert (library_file("second name"), library_file("first name")) == (path, None)
    new = put(path.parent, "b", 2.0)
    assert library_file("b") == new
    new.unlink()
    assert library_file("b") is None


def test_one_name_in_two_files_of_a_folder_is_an_error(home):
    put(home / ".rotor" / "molecules", "a", 1.0, 'name = "thing"')
    put(home / ".rotor" / "molecules", "b", 1.0, 'names = ["Thing"]')
    with pytest.raises(ValueError, match=r"b.toml: the name 'thing' belongs to .*a.toml already; give one"):
        library_file("water")


def test_a_folder_that_is_not_there_is_an_error(monkeypatch, tmp_path):
    monkeypatch.setenv("ROTOR_MOLECULES", str(tmp_path / "nowhere"))
    with pytest.raises(ValueError, match=r"ROTOR_MOLECULES: .*nowhere is no folder; make it"):
        library_file("water")


@pytest.mark.parametrize("content", [b"name = ", b"name = '\xe9'", b"name = 5\n[constants]\nB = 1\n"])
def test_a_broken_file_disturbs_nobody_who_does_not_ask_for_it(home, content):
    path = put(home / ".rotor" / "molecules", "broken", 1.0)
    path.write_bytes(content)
    assert library_molecule("water").name == "water"
    assert library_file("broken") == path
    with pytest.raises(ValueError, match=r"broken.toml"):
        library_molecule("broken")


def test_unknown_names_are_printed_the_nearest():
    with pytest.raises(ValueError, match=r"no molecule 'metane' .*did you mean methane"):
        library_molecule("metane")
    with pytest.raises(ValueError, match=r"no molecule 'hdo' .*did you mean HDO"):
        library_molecule("hdo")
    with pytest.raises(ValueError, match=r"no molecule 'zzzzzz' in the library: 'rotor molecules' lists"):
        library_molecule("zzzzzz")


def test_finding_a_name_is_quick():
    library_file("water")
    start = time.perf_counter()
    for _ in range(20):
        library_file("water")
    assert time.perf_counter() - start < 0.5  # 0.4 ms each here; parsing every file took 40 ms


def test_molecules_as_json(capsys, home):
    put(home / ".rotor" / "molecules", "mine", 5000.0, 'name = "water"')
    assert run(["molecules", "--json", "-"]) == 0
    records = json.loads(capsys.readouterr().out)
    assert len(records) == len(list(OURS.glob("*.toml"))) + 1
    assert (records[0]["name"], records[0]["own"], records[0]["kind"], records[0]["formula"]) == (
        "water",
        True,
        "linear",
        None,
    )
    by_name = {record["name"]: record for record in records if not record["own"]}
    water = by_name["water"]  # still there under its other names
    assert (water["kind"], water["point_group"], water["symmetry_number"]) == ("asymmetric", "C2v", 2)
    assert water["kappa"] == pytest.approx(-0.437, abs=5e-4)  # of A, B, C: three digits
    assert water["dipole_abc_debye"] == [0.0, 1.8507, 0.0]
    assert water["spin_weights"] == {"ee": 1, "eo": 3, "oe": 3, "oo": 1}
    assert water["catalogue"]["tag"] == "c018003"
    assert water["serves"] == {"j_max": 20, "k_max": 20, "max_ghz": 4870.0, "error_mhz": 0.56}
    assert (water["levels"], water["unverified"]) == (634, [])
    assert set(water["sources"]) >= {"geometry", "constants", "dipole", "spin_weights"}
    assert by_name["benzene"]["symmetry_number"] == 12
    assert by_name["carbon monoxide"]["kappa"] is None


def test_molecules_as_a_table_and_one_of_them(capsys):
    assert run(["molecules"]) == 0
    lines = capsys.readouterr().out.splitlines()
    heading = "name also kind κ μa μb μc J ≤ K ≤ within/MHz unverified from"
    assert lines[0].split() == heading.split()
    assert len(lines) == len(list(OURS.glob("*.toml"))) + 1
    (row,) = [line for line in lines if line.startswith("HDO")]
    assert row.split()[1:9] == ["semiheavy", "water", "asymmetric", "-0.684", "0.6567", "1.737", "10", "10"]
    (row,) = [line for line in lines if line.startswith("CH2CHCN ")]
    assert "constants, dipole" in row

    assert run(["molecules", "pyridine"]) == 0
    printed = capsys.readouterr().out
    assert "point group        C2v, symmetry number 2" in printed
    assert "spin weights from" in printed
    plainly = " ".join(printed.split())
    assert "unverified constants" in plainly
    assert "constants from unverified: G. Wlodarczak et al., J. Mol. Spectrosc. 127 (1988) 178, not read" in plainly
    assert run(["info", "pyridine"]) == 0
    printed = capsys.readouterr().out
    assert (
        "sources   constants: unverified: G. Wlodarczak et al., J. Mol. Spectrosc. 127 (1988); dipole: NIST" in printed
    )
    assert run(["info", "PH3"]) == 0
    assert "constants: C unverified; P. Helminger and W. Gordy, Phys. Rev. 188 (1969)" in capsys.readouterr().out
    assert run(["info", "PH3", "--sources"]) == 0
    assert "C unverified; P. Helminger and W. Gordy, Phys. Rev. 188 (1969) 100, doi" in capsys.readouterr().out


def test_molecules_that_are_not_there_are_refused(capsys, tmp_path):
    assert run(["molecules", "ozon"]) == 2
    assert capsys.readouterr().err == (
        "error: no molecule 'ozon' in the library: did you mean ozone? 'rotor molecules' lists what it has\n"
    )
    assert run(["molecules", "--json", str(tmp_path / "list.txt")]) == 2
    assert run(["molecules", "ozone", "--json", str(tmp_path / "list.json")]) == 0
    (ozone,) = json.loads((tmp_path / "list.json").read_text(encoding="utf-8"))
    assert ozone["name"] == "ozone"


def test_a_spectrum_by_name_parses_one_file_alone():
    code = """
import rotor.formats.molecules.library as library, rotor.formats.molecules.molecule_file as files
read = []
whole = files.parse_molecule_file
files.parse_molecule_file = lambda *a, **k: read.append(a) or whole(*a, **k)
library.library_molecule("formaldehyde")
print(len(read))
"""
    process = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=OURS.parents[1]
    )
    assert process.stdout == "1\n"
