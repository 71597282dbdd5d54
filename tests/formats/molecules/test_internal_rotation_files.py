"""Internal rotation in molecule files and on the command line."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from places import ORACLES

import rotor
from rotor.formats.lines.assigned_lines import read_assigned_lines
from rotor.formats.molecules.molecule_file import read_molecule_file
from rotor.formats.molecules.molecule_writer import write_molecule_file
from rotor.quantum.internal_rotation.from_geometry import with_internal_rotation
from rotor.tops.top import Top

CM = rotor.units.MHZ_PER_CM
ACETALDEHYDE = """
name = "acetaldehyde"
[constants]
unit = "cm-1"
A = 1.8848813
B = 0.3487065
C = 0.303184
reduction = "A"
representation = "Ir"
[dipole]
a = 2.423
b = 1.266
[internal_rotation]
source = "Astron. Astrophys. 579 (2015) A46, table 1"
frame = "RAM"
unit = "cm-1"
F = 7.567082
rho = { value = 0.328632673, uncertainty = 2e-8 }
V3 = 407.59768
V6 = -11.63964
Dab = 0.122669
"""


@pytest.fixture
def acetaldehyde(tmp_path) -> Path:
    path = tmp_path / "ch3cho.toml"
    path.write_text(ACETALDEHYDE)
    return path


def test_a_molecule_file_has_the_constants_of_an_internal_rotor(acetaldehyde, tmp_path):
    file = read_molecule_file(acetaldehyde)
    assert file.internal_rotation.values["V3"] == pytest.approx(407.59768 * CM)
    assert file.internal_rotation.values["rho"] == 0.328632673
    assert dict(file.internal_rotation.uncertainties) == {"rho": 2e-8}
    write_molecule_file(file, tmp_path / "again.toml")
    again = rotor.read(tmp_path / "again.toml")
    assert dict(again.internal_rotation.values) == dict(file.internal_rotation.values)
    assert again.internal_rotation.uncertainties == file.internal_rotation.uncertainties


@pytest.mark.parametrize(
    ("line", "wrong", "text"),
    [
        ('frame = "RAM"', "", "not stated"),
        ('frame = "RAM"', 'frame = "PAM"', "F0, delta missing"),
        ("V6 =", "V5 =", "no constant of an internal rotor"),
        ("Dab =", "vt_max = 20\nDab =", "at least v_t"),
    ],
)
def test_mistakes_in_a_molecule_file_are_named(acetaldehyde, line, wrong, text):
    acetaldehyde.write_text(ACETALDEHYDE.replace(line, wrong))
    with pytest.raises(ValueError, match=text) as error:
        rotor.read(acetaldehyde)
    assert "ch3cho.toml, [internal_rotation]" in str(error.value)


def test_the_partition_function_is_that_of_the_lille_database(acetaldehyde):
    """https://lsd.univ-lille.fr/table/5: Q with A and E levels of v_t up to 8 alike, as here; its constants have higher orders."""
    partition = rotor.partition_function(rotor.read(acetaldehyde), [9.375, 37.5])
    assert partition.q.tolist() == pytest.approx([135.028, 1077.01], rel=1.5e-3)


def test_lines_on_the_command_line_have_species_and_torsional_states(acetaldehyde, tmp_path, call):
    table = tmp_path / "lines.json"
    code, _, _ = call("spectrum", str(acetaldehyde), "--temperature", "10", "--jmax", "2", "--json", str(table))
    assert code == 0
    content = json.loads(table.read_text())
    assert content["line_count"] > 20


def test_a_fit_on_the_command_line_finds_the_constants_of_butynoic_acid(tmp_path, call):
    rows = np.loadtxt(ORACLES / "2ba.txt")
    names = [f"{name}_{side}" for side in ("upper", "lower") for name in ("j", "ka", "kc", "species")]
    lines = [",".join([*names, "vt_upper", "vt_lower", "frequency_mhz", "error_mhz"])]
    for row in rows.tolist():
        labels = [str(int(x)) for x in row[:8]]
        labels[3], labels[7] = ("AE"[int(row[place])] for place in (3, 7))
        lines.append(",".join([*labels, "0", "0", str(row[8]), str(row[9])]))
    (tmp_path / "lines.csv").write_text("\n".join(lines))
    (tmp_path / "start.toml").write_text(
        "[constants]\nA = 11268.9\nB = 1752.18585\nC = 1529.58084\nDeltaJ = 4.367e-5\nDeltaJK = 0.01135\nDeltaK = 0.00264\n"
        'deltaJ = 1.183e-5\nJpm4 = -1.495e-5\nreduction = "A"\nrepresentation = "Ir"\n[dipole]\na = 2.3\nb = 1.4\n'
        '[internal_rotation]\nframe = "RAM"\n'
        'names = "energy"\nvt_max = 0\nF = "5.66 cm-1"\nrho = 0.0715287\nV3 = "1.009 cm-1"\nDab = -16.185\nFJ = -0.03726\n'
        "rhoJ = 0.0352\nrhoK = 0.01502\nJz1Jpm2p1 = -0.000376\n"
    )
    free = "A,B,C,DeltaJ,DeltaJK,DeltaK,deltaJ,Jpm4,rho,V3,Dab,FJ,rhoJ,rhoK,Jz1Jpm2p1"
    files = [str(tmp_path / name) for name in ("lines.csv", "start.toml", "fitted")]
    code, out, _ = call("fit", files[0], "--start", files[1], "--free", free, "--out", files[2])
    assert code == 0
    assert "A 0 - " in out  # species by letters in the report
    fitted = rotor.read(tmp_path / "fitted.toml")
    assert fitted.internal_rotation.values["V3"] / CM == pytest.approx(
        1.00901, abs=4.1e-4
    )  # westerfit's value and error
    lines_with_errors = rotor.line_list(fitted, jmax=2, q=1.0, min_lgint=None)
    assert np.isfinite(lines_with_errors.error_mhz).all()


def test_acetaldehyde_from_smiles_has_its_splittings(call):
    code, out, err = call(
        "spectrum", "SMILES:CC=O", "--internal-rotation", "geometry", "--jmax", "2", "--temperature", "5"
    )
    assert code == 0
    assert "407.6 cm-1, that of acetaldehyde" in err
    frequency = {
        species: float(row.split()[0])
        for row in out.splitlines()
        for species in "AE"
        if row.endswith(f"{species}  0  2  0  2   {species}  0  1  0  1")
    }
    assert frequency["E"] - frequency["A"] == pytest.approx(
        38506.03 - 38512.08, abs=1.5
    )  # JPL's catalogue; V3 within 10 %


@pytest.mark.parametrize(
    ("isotopes", "weights"),
    [("", (1, 1)), ("4=2H,5=2H,6=2H", (11, 16)), ("7=2H", (1, 1)), ("4=2H,5=2H,6=2H,7=2H", (11, 16))],
)
def test_spin_weights_are_those_of_the_hydrogens_that_turn(isotopes, weights):
    """CH3 4 and 4, CD3 11 and 16 with both components of E; the hydrogen of CHO takes no part."""
    molecule = rotor.read("SMILES:CC=O").molecule
    top = with_internal_rotation(Top.from_molecule(molecule.with_isotopes(isotopes) if isotopes else molecule))
    levels = rotor.api.solve_levels(top, 0)
    computed = [int(levels.weight[levels.find(species=name, vt=0, j=0, ka=0, kc=0)]) for name in "AE"]
    assert tuple(computed) == weights


def test_a_barrier_by_a_scan_is_that_of_the_torsion():
    """V3 and V6 against the Fourier series of `rotor torsion`, whose zero is the geometry."""
    top = with_internal_rotation(rotor.read("SMILES:CC=O"), "mmff")
    torsion = rotor.torsion("SMILES:CC=O", bond="2-1").torsion
    terms = dict(zip(torsion.potential.n.tolist(), (-2 * torsion.potential.cosines).tolist(), strict=True))
    for n in (3, 6):
        assert top.internal_rotation.values[f"V{n}"] == pytest.approx(terms[n], rel=1e-3)
    assert terms[3] + terms[9] == pytest.approx(
        torsion.barrier_mhz, rel=1e-4
    )  # V9 is no constant of a fit and left out
    assert "relaxed scan with MMFF94" in top.internal_rotation.source


def test_a_group_of_unlike_hydrogens_is_refused_by_name(call):
    code, _, err = call(
        "spectrum", "SMILES:CC=O", "--isotope", "4=2H", "--internal-rotation", "geometry", "--temperature", "20"
    )
    assert code == 2
    assert "hydrogens of carbon 1 are not all alike" in err


def test_constants_of_an_internal_rotor_on_the_command_line(call):
    constants = "A=56507.3198 B=10453.9579 C=9089.2277 MHz"
    text = "RAM F=7.567082cm-1 rho=0.328632673 V3=407.59768cm-1 Dab=0.122669cm-1 vt_max=0"
    code, out, _ = call("levels", "--constants", constants, "--internal-rotation", text, "--jmax", "1")
    assert code == 0
    assert re.search(r"E  0  1  0  1 +0.70561[56]", out)  # as from the file
    code, _, err = call("levels", "--constants", constants, "--internal-rotation", "F=7cm-1 rho=0.3 V3=400cm-1")
    assert code == 2
    assert "--internal-rotation" in err
    assert "expected RAM" in err
    code, _, err = call("levels", "--constants", constants, "--internal-rotation", "geometry")
    assert code == 2
    assert "no geometry" in err


@pytest.mark.parametrize(
    "command",
    [
        ("zeeman", "--g", "0,0,0.1", "--field", "0:1T"),
        ("convert", "case.var"),
    ],
)
def test_what_knows_no_internal_rotation_refuses_it(acetaldehyde, call, command):
    verb, *options = command
    code, _, err = call(verb, str(acetaldehyde), *options)
    assert code == 2
    assert "internal rotation" in err


def test_a_plan_states_what_the_truncation_of_the_torsion_costs(acetaldehyde, call):
    (acetaldehyde.parent / "scene.toml").write_text(
        'schema = 1\nkind = "spectrum"\nmolecule = "ch3cho.toml"\n[conditions]\ntemperature = "10 K"\n[numerics]\njmax = 3\n'
    )
    code, out, _ = call("plan", str(acetaldehyde.parent / "scene.toml"))
    assert code == 0
    assert "9 torsional functions for each K" in out
    assert re.search(r"truncation +at most \S+ MHz at J = 3", out)


def test_a_stark_map_on_the_command_line_has_species(acetaldehyde, call):
    code, out, _ = call("stark", str(acetaldehyde), "--field", "0:5kV/cm:3", "--states", "1")
    assert code == 0
    assert "E 0 1 0 1" in out


def test_a_field_on_a_molecule_with_spins_has_species_and_spins(acetaldehyde, call):
    acetaldehyde.write_text(ACETALDEHYDE + "[spins.14N]\nchi_aa = -4\n")
    code, out, _ = call("stark", str(acetaldehyde), "--hyperfine", "--field", "0:1kV/cm:2", "--states", "1")
    assert code == 0
    assert "E 0 1 0 1 2" in out


def test_raman_lines_of_both_species_have_the_strengths_of_a_rigid_top(call, tmp_path):
    """v_t = 0 behind 408 cm-1, the tensor turned into the frame of rho: S of A as of the rigid top, of E twice as much."""
    results = {}
    for name, options in {"rigid": (), "turning": ("--internal-rotation", "geometry")}.items():
        path = tmp_path / f"{name}.csv"
        tensor = ("--polarizability", "5,4.4,4", "--temperature", "20", "--jmax", "2", "--csv", str(path))
        assert call("raman", "SMILES:CC=O", *options, *tensor)[0] == 0
        rows = [line.split(",") for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
        results[name] = [dict(zip(rows[0], row, strict=True)) for row in rows[1:]]
    strength = next(key for key in results["rigid"][0] if key.startswith("strength"))

    def of(row):
        return tuple(row[key] for key in row if key.split("_")[0] in ("j", "ka", "kc"))

    rigid = {of(row): float(row[strength]) for row in results["rigid"]}
    turning = [row for row in results["turning"] if {row[key] for key in row if key.startswith("vt_")} == {"0"}]
    compared = 0
    for row in turning:
        species = {row[key] for key in row if key.startswith("species_")}
        if of(row) in rigid and species == {"A"}:
            assert float(row[strength]) == pytest.approx(rigid[of(row)], rel=0.03)
            compared += 1
    assert compared > 10
    far = [row for row in turning if abs(int(row["j_initial"]) - int(row["j_final"])) == 2]  # none is elastic
    total = {name: sum(float(row[strength]) for row in far if row["species_initial"] == name) for name in "AE"}
    assert total["E"] == pytest.approx(2 * total["A"], rel=0.01)


COLUMNS = ("n", "ka", "kc", "species", "vt", "f")
SPELLINGS = {
    "as spectra have them": "frequency_mhz,error_mhz,n_upper,ka_upper,kc_upper,species_upper,vt_upper,f_upper,"
    "n_lower,ka_lower,kc_lower,species_lower,vt_lower,f_lower\n8600.1,0.01,7,1,7,E,0,13/2,6,1,6,E,0,11/2\n",
    "J, capitals, one column of species, no v_t": "Frequency_MHz,error_khz,J_upper,Ka_upper,Kc_upper,F_upper,"
    "J_lower,Ka_lower,Kc_lower,F_lower,sym\n8600.1,10,7,1,7,6.5,6,1,6,5.5,E1\n",
    "sigma": "frequency_mhz,error_khz,n_upper,ka_upper,kc_upper,f_upper,n_lower,ka_lower,kc_lower,f_lower,sigma,vt\n"
    "8600.1,10,7,1,7,13,6,1,6,11,-1,0\n",
}  # fmt: skip


@pytest.mark.parametrize("text", SPELLINGS.values(), ids=list(SPELLINGS))
def test_lines_in_the_columns_that_users_write(tmp_path, text):
    path = tmp_path / "lines.csv"
    path.write_text(text)
    lines, notes = read_assigned_lines(path, COLUMNS, {"f"})
    assert lines.upper.tolist() == [[7, 1, 7, 1, 0, 13]]
    assert lines.lower.tolist() == [[6, 1, 6, 1, 0, 11]]
    assert lines.error_mhz.tolist() == [0.01]
    assert [note for note in notes if "v_t = 0" in note] == ([] if "vt" in text else notes)


def test_a_species_that_is_none_is_named_with_its_line(tmp_path):
    path = tmp_path / "lines.csv"
    path.write_text(SPELLINGS["sigma"].replace(",-1,", ",X,"))
    with pytest.raises(ValueError, match="line 1 of the table: species_upper reads 'X'; expected A or E"):
        read_assigned_lines(path, COLUMNS, {"f"})
