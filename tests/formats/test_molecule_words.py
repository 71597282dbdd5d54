"""What a word, a path, a text on standard input means; what isotopes and formats do; errors that say what to do."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import rotor
from rotor.formats.spcat.text.catalogue import Catalogue

XYZ = "3\nwater\nO 0 0 0.1173\nH 0 0.7572 -0.4692\nH 0 -0.7572 -0.4692\n"
TOML = '[constants]\nsource = "memory"\nB = 57635.968\n[dipole]\nsource = "memory"\na = 0.11\n'


def test_names_come_from_the_library_then_from_g2():
    assert rotor.read("water").constants.reduction == "S"  # fitted constants, not a rigid geometry
    assert rotor.read("H2O").name == "water"
    assert rotor.read("C6H6").kind == "oblate"  # ASE's g2


def test_a_path_and_a_name_at_once_are_an_error(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("water").write_text(XYZ)
    with pytest.raises(ValueError, match="ambiguous"):
        rotor.read("water")


def test_molecule_files_are_read_by_suffix(tmp_path):
    (tmp_path / "w.xyz").write_text(XYZ)
    (tmp_path / "co.toml").write_text(TOML)
    assert rotor.read(tmp_path / "w.xyz").kind == "asymmetric"
    co = rotor.read(str(tmp_path / "co.toml"))
    assert (co.kind, co.dipole_abc_debye) == ("linear", (0.11, 0.0, 0.0))


@pytest.mark.parametrize(("text", "kind"), [(XYZ, "asymmetric"), (TOML, "linear")])
def test_standard_input_is_read_as_xyz_or_toml(monkeypatch, text, kind):
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO(text.encode())))
    assert rotor.read("-").kind == kind


def test_ase_and_rdkit_objects():
    from ase.build import molecule
    from rdkit import Chem
    from rdkit.Chem import AllChem

    assert rotor.read(molecule("H2O")).kind == "asymmetric"
    mol = Chem.AddHs(Chem.MolFromSmiles("C=O"))
    AllChem.EmbedMolecule(mol, randomSeed=7)
    assert rotor.read(mol).kind == "asymmetric"


def test_isotopes_of_a_library_molecule_carry_its_constants_over():
    heavy = rotor.read("water", isotopes="2=2H")
    assert heavy.rotational_constants_mhz == pytest.approx(
        (701931.5, 272912.6, 192055.25), rel=0.006
    )  # HDO, ratio from r_e
    assert any("the ratio calculated from its geometry" in note for note in heavy.notes)
    assert any("no distortion constants" in note for note in heavy.notes)
    assert abs(heavy.dipole_abc_debye[0]) == pytest.approx(0.67, abs=0.005)
    again = rotor.read(rotor.read("water"), isotopes={2: "2H"})
    assert again.rotational_constants_mhz == heavy.rotational_constants_mhz


def test_isotopes_of_constants_alone_cannot_change(tmp_path):
    (tmp_path / "co.toml").write_text(TOML)
    with pytest.raises(ValueError, match="there is no geometry"):
        rotor.read(tmp_path / "co.toml", isotopes="O=18O")
    with pytest.raises(ValueError, match="there is no geometry"):
        rotor.read(rotor.Constants(B=57635.968), isotopes="O=18O")
    rotor.write(co_lines(), tmp_path / "co.cat")
    with pytest.raises(ValueError, match="holds a Catalogue, which has no atoms"):
        rotor.read(tmp_path / "co.cat", isotopes="O=18O")


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("no/such.xyz", "no such file"), ("nosuchmolecule", "nosuchmolecule"), ("SMILES:C(", "SMILES"),
        (".", "folder"), (3.14, "is not a molecule"),
    ],
)  # fmt: skip
def test_nonsense_is_refused_with_the_source(source, words):
    with pytest.raises(ValueError, match=words):
        rotor.read(source)


def test_an_empty_file_is_refused(tmp_path):
    (tmp_path / "empty.xyz").write_text("")
    with pytest.raises(ValueError, match="empty"):
        rotor.read(tmp_path / "empty.xyz")


def test_spcat_input_is_a_top(shared):
    top = rotor.read(shared / "reference" / "spcat" / "ocs" / "ocs.int")
    assert (top.kind, top.dipole_abc_debye[0]) == ("linear", 0.71519)


def co_lines():
    return rotor.api.line_list(rotor.read("CO"), temperature_k=100, jmax=8)


@pytest.mark.parametrize("suffix", [".cat", ".cat.gz", ".csv", ".parquet", ".json"])
def test_lines_in_every_format(tmp_path, suffix):
    import polars as pl

    lines, path = co_lines(), tmp_path / f"co{suffix}"
    rotor.write(lines, path, settings={"tag": 28503, "command": "test"})
    if suffix.startswith(".cat"):
        again = rotor.read(path)
        assert isinstance(again, Catalogue)
        assert set(again.tag.tolist()) == {28503}
        computed = again.frequency_mhz
    elif suffix == ".csv":
        computed = pl.read_csv(path)["frequency_mhz"].to_numpy()
    elif suffix == ".parquet":
        computed = pl.read_parquet(path)["frequency_mhz"].to_numpy()
        provenance = json.loads(pl.read_parquet_metadata(path)["provenance"])
    else:
        content = json.loads(path.read_text())
        computed, provenance = [line["frequency_mhz"] for line in content["lines"]], content["provenance"]
    if suffix in (".cat", ".cat.gz", ".csv"):
        provenance = json.loads(Path(f"{path}.provenance.json").read_text())
    assert np.allclose(computed, lines.frequency_mhz, atol=5.1e-5)  # the rounding of a .cat
    assert provenance["constants"].startswith("B=57635.968")
    assert provenance["command"] == "test"
    assert provenance["temperature_k"] == 100


def test_long_lists_are_written_in_the_same_bytes_as_short_ones(tmp_path, monkeypatch):
    from rotor.formats.lines import line_tables

    top = rotor.Top.from_constants("A=9 B=5 C=3 GHz", dipole_abc_debye=(1, 1, 1))
    lines = rotor.api.line_list(top, jmax=14)
    rotor.write(lines, tmp_path / "whole.cat")
    monkeypatch.setattr(line_tables, "PIECE", 700)
    rotor.write(lines, tmp_path / "pieces.cat")
    assert (tmp_path / "whole.cat").read_bytes() == (tmp_path / "pieces.cat").read_bytes()


def test_unknown_suffix_leaves_nothing(tmp_path):
    with pytest.raises(ValueError, match="suffix names the format"):
        rotor.write(co_lines(), tmp_path / "co.xls")
    assert list(tmp_path.iterdir()) == []


def test_a_tag_that_does_not_fit():
    with pytest.raises(ValueError, match="six digits"):
        rotor.write(co_lines(), "co.cat", settings={"tag": 12345678})
    assert not Path("co.cat").exists()


@pytest.mark.parametrize(
    "verb",
    [
        ("raman", "N2"),
        ("tumble", "water"),
        ("gas", "CO", "--molecules", "50", "--times", "0:1:5"),
        ("thermo", "CO", "--temperature", "100,300K"),
    ],
    ids=lambda verb: verb[0],
)
def test_csv_and_parquet_hold_the_same_table(call, folder, verb):
    import polars as pl

    code, _, err = call(*verb, "--csv", "a.csv", "--parquet", "a.parquet")
    assert code == 0, err
    csv, parquet = pl.read_csv("a.csv", infer_schema_length=None), pl.read_parquet("a.parquet")
    assert csv.columns == parquet.columns
    assert csv.cast(dict(parquet.schema)).equals(parquet)  # to the last bit
    beside = json.loads(Path("a.csv.provenance.json").read_text(encoding="utf-8"))
    inside = json.loads(pl.read_parquet_metadata("a.parquet")["provenance"])
    assert {k: v for k, v in beside.items() if k != "command"} == {k: v for k, v in inside.items() if k != "command"}
    assert beside["program"] == "rotor"


def test_levels_are_a_table_too(tmp_path):
    levels = rotor.api.solve_levels(rotor.read("CO"), 2)
    rotor.write(levels, tmp_path / "levels.json")
    assert len(json.loads((tmp_path / "levels.json").read_text())["rows"]) == len(levels) == 3
