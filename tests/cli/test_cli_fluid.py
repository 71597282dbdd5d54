"""`rotor fluid` on the command line: the contract of docs/verbs/fluid.md."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from ase.io import read

from rotor.fluids.record import FluidRecord

VAPOUR = (
    "fluid", "water", "--molecules", "27", "--density", "0.3", "--cutoff", "4", "--equilibration", "0", "--step", "1fs",
)  # fmt: skip


def test_a_box_is_made_and_run(call, folder):
    code, out, err = call(*VAPOUR, "--steps", "20", "--every", "5", "--csv", "a.csv", "--json", "-")
    assert (code, err) == (0, "")
    answer = json.loads(out)
    assert answer["degrees"] == {"translation": 78, "rotation": 81, "removed": 3, "total": 159}
    assert answer["molecules"][0]["name"] == "OH2"
    assert answer["molecules"][0]["rotational_degrees"] == 3
    assert answer["density_g_cm3"] == pytest.approx(0.3, rel=1e-12)  # by its making
    assert answer["settings"]["step_fs"] == 1.0
    assert answer["thermometer"] == "mixed"
    assert "27 molecules on a lattice at 0.3 g/cm³" in answer["start"]
    assert [row["time_ps"] for row in answer["record"]] == [0.0, 0.005, 0.01, 0.015, 0.02]
    rows = np.genfromtxt("a.csv", delimiter=",", names=True)
    assert rows.dtype.names == tuple(FluidRecord.__dataclass_fields__)
    assert rows["total_ev"].tolist() == [row["total_ev"] for row in answer["record"]]  # to the last bit
    assert answer["files"] == ["a.csv"]
    provenance = json.loads(Path("a.csv.provenance.json").read_text())
    assert provenance["settings"] == answer["settings"]
    assert provenance["command"].startswith("rotor fluid water --molecules 27")


def test_the_report_names_what_was_run(call, folder):
    code, out, _ = call(*VAPOUR, "--steps", "10", "--ensemble", "nose-hoover", "--json", "a.json")
    assert code == 0
    assert "27 H2O: 10 steps of 1 fs, nose-hoover, by rotor" in out
    assert "78 of translation, 81 of rotation; 3 removed" in out
    assert "potential energy" in out
    assert json.loads(Path("a.json").read_text())["thermometer"] == "half"


def test_a_run_is_resumed_to_the_same_end(call, folder):
    options = (*VAPOUR, "--ensemble", "langevin", "--every", "5", "--checkpoint-every", "10", "--trajectory")
    assert call(*options, "whole.xyz", "--csv", "whole.csv", "--checkpoint", "w.npz", "--steps", "40")[0] == 0
    cut = (*options, "cut.xyz", "--csv", "cut.csv", "--checkpoint", "c.npz", "--trajectory", "cut.traj")
    assert call(*cut, "--steps", "20")[0] == 0
    code, out, err = call(*cut, "--steps", "40", "--resume", "--json", "-")
    assert (code, err) == (0, "")
    assert json.loads(out)["start"] == "resumed from c.npz"
    assert Path("cut.csv").read_bytes() == Path("whole.csv").read_bytes()
    assert Path("cut.xyz").read_bytes() == Path("whole.xyz").read_bytes()
    assert len(read("cut.traj", ":")) == 9
    code, out, _ = call("fluid", "cut.traj", "--cutoff", "4", "--steps", "4", "--json", "-")
    assert code == 0
    assert json.loads(out)["start"] == "cut.traj; velocities those of the box"


def test_other_models_and_a_file_without_velocities(call, folder):
    code, out, _ = call(
        "fluid", "trappe-n2", "--model", "trappe-n2", "--molecules", "27", "--density", "0.3", "--temperature", "90",
        "--cutoff", "6", "--steps", "5", "--trajectory", "n2.extxyz", "--json", "-",
    )  # fmt: skip
    assert code == 0
    assert json.loads(out)["degrees"]["rotation"] == 54
    atoms = read("n2.extxyz", ":")[-1]
    del atoms.arrays["momenta"]
    atoms.write("bare.xyz")
    code, out, _ = call("fluid", "bare.xyz", "--model", "trappe-n2", "--cutoff", "6", "--steps", "2", "--json", "-")
    assert code == 0
    facts = json.loads(out)
    assert facts["start"] == "bare.xyz; velocities drawn at 298.15 K"
    assert "is not equilibrated" in facts["notes"][-1]
    assert facts["averaged_share"] == 0.5


def test_a_box_of_a_file_is_equilibrated_where_requested(call, folder):
    assert call(*VAPOUR, "--steps", "2", "--trajectory", "box.extxyz")[0] == 0
    run = "fluid", "box.extxyz", "--cutoff", "4", "--step", "1fs", "--steps", "2"
    before = Path("box.extxyz").read_bytes()
    code, out, _ = call(*run, "--equilibration", "50 fs", "--json", "-", "--save-scene", "s.toml")
    facts = json.loads(out)
    assert code == 0
    assert facts["start"].startswith("box.extxyz; velocities those of the box; equilibrated for 0.05 ps under langevin")
    assert (facts["equilibration_ps"], facts["averaged_share"]) == (pytest.approx(0.05), 1.0)
    assert not facts["notes"]
    assert Path("box.extxyz").read_bytes() == before
    again = json.loads(call("run", "s.toml", "--json", "-")[1])
    assert [mean["mean"] for mean in again["means"]] == [mean["mean"] for mean in facts["means"]]
    as_it_is = json.loads(call(*run, "--json", "-")[1])
    assert as_it_is["equilibration_ps"] is None
    code, out, _ = call("plan", "s.toml")
    assert code == 0
    assert re.search(r"equilibration +0\.05 ps", out)
    assert re.search(r"equilibration steps +50", out)


def test_a_plan_counts_the_equilibration_of_a_box_that_is_made(call, folder):
    Path("s.toml").write_text(
        'schema = 1\nkind = "fluid"\n[conditions]\nmolecules = 27\ndensity = 0.3\nsteps = 100\n[numerics]\ncutoff = 4\nstep = 2\n'
    )
    code, out, err = call("plan", "s.toml")
    assert code == 0, err
    text = " ".join(out.split())
    assert "equilibration 10 ps at least, until stationary, 100 ps at most; seconds count the least" in text
    assert "equilibration steps 5,000" in text
    with_it = float(re.search(r"seconds ([\d.e+-]+)", text)[1])
    Path("s.toml").write_text(Path("s.toml").read_text().replace("steps = 100", "steps = 100\nequilibration = 0"))
    without = float(re.search(r"seconds +([\d.e+-]+)", call("plan", "s.toml")[1])[1])
    assert with_it > 10 * without


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("nowhere.xyz",), "nowhere.xyz: no such file"),
        (("water", "--model", "spcf", "--molecules", "8"), "--model: 'spcf' is no model of a rigid molecule"),
        (("water", "--molecules", "0"), "--molecules"),
        (("water", "--molecules", "8", "--model", "argon"), "--model argon is not a model of water"),
        (("benzene", "--molecules", "8"), "a new box contains 'water' or a single model"),
        (("water", "--density", "1"), "--density: expected with --molecules"),
        (("water", "--equilibration", "-1ps"), "--equilibration: -1ps: expected a finite number of 0 ps or more"),
        (
            ("water", "--molecules", "8", "--relaxation", "9fs", "--ensemble", "langevin"),
            "with --ensemble nose-hoover; langevin does",
        ),
        (
            ("water", "--molecules", "8", "--friction", "2"),
            "--friction: expected with --ensemble langevin; nve does not",
        ),
        (
            ("water", "--molecules", "8", "--ewald-tolerance", "1e-4"),
            "expected with --electrostatics ewald; reaction-field does",
        ),
        (("tip4p", "--molecules", "8"), "write --model tip4p too"),
        (("water", "--molecules", "8", "--step", "0"), "--step: 0: expected a number above 0 and up to 1e+30 fs"),
        (("water", "--molecules", "8", "--relaxation", "9x"), "the default is 'fs'"),
        (("water", "--molecules", "8", "--seed", "-1"), "--seed: -1: expected a whole number of 0 or more"),
        (("overlap.xyz", "--trajectory", "./overlap.xyz"), "--trajectory overlap.xyz: is an input of this command"),
        (("far.xyz", "--model", "tip4p", "--cutoff", "4"), "in the shape of its model, more than 0.01 Å"),
        (("water", "--molecules", "8", "--ensemble", "npt"), "--ensemble: 'npt': expected one of nve"),
        (("water", "--molecules", "8"), "cutoff 9 Å is more than half of the smallest edge"),
        (("water", "--molecules", "8", "--csv", "a.txt"), "--csv a.txt: the name must end in .csv"),
        (("water", "--molecules", "8", "--trajectory", "a.pdb"), "a.pdb: the name must end in"),
        (("water", "--molecules", "8", "--engine", "gromacs"), "--engine: 'gromacs': expected one of"),
        (("water", "--molecules", "8", "--cutoff", "3", "--resume"), "name the checkpoint"),
        (("open.xyz",), "open.xyz: has no periodic cell"),
        (("overlap.xyz", "--csv", "a.csv", "--cutoff", "4"), "on top of each other"),
        (("text.xyz",), "give a box of atoms in extended xyz"),
    ],
)
def test_mistakes_are_one_line_and_nothing_is_written(call, folder, arguments, said):
    Path("open.xyz").write_text("1\n\nAr 0 0 0\n")
    Path("text.xyz").write_text("no box\n")
    water = ["O 1 1 1", "H 1.816497 1 1.577350", "H 0.183503 1 1.577350"]
    lattice = 'Lattice="9 0 0 0 9 0 0 0 9" pbc="T T T" Properties=species:S:1:pos:R:3'
    Path("overlap.xyz").write_text("\n".join(["6", lattice, *water, *water]) + "\n")
    Path("far.xyz").write_text("\n".join(["3", lattice, *water]) + "\n")
    code, out, err = call("fluid", *arguments)
    assert code == 2
    assert out == ""
    assert err.startswith("error: ")
    assert said in err
    assert err.count("\n") == 1
    assert sorted(path.name for path in Path().iterdir()) == ["far.xyz", "open.xyz", "overlap.xyz", "text.xyz"]


def test_a_run_that_stops_has_exit_code_one(call, folder, monkeypatch):
    from rotor.fluids.forces.potential import RigidPotential

    calls, inner = [], RigidPotential.calculate

    def breaks(self, *arguments):
        inner(self, *arguments)
        calls.append(1)
        if len(calls) > 320:  # 300 steps of relaxing come first
            self.results["forces"][:] = np.nan

    monkeypatch.setattr(RigidPotential, "calculate", breaks)
    code, out, err = call(
        *VAPOUR, "--steps", "100", "--csv", "a.csv", "--checkpoint", "a.npz", "--checkpoint-every", "5"
    )
    assert (code, out) == (1, "")
    assert "the force on molecule 0 (OH2, atoms 0 to 2) is not finite in step" in err
    assert "a.npz is of step" in err
    assert len(Path("a.csv").read_text().splitlines()) >= 2


def test_steps_too_long_are_told_with_their_number_and_length(call, folder):
    code, out, err = call(*VAPOUR[:-2], "--step", "2ps", "--steps", "50", "--checkpoint", "a.npz")
    assert (code, out) == (1, "")
    assert "use a shorter step" in err
    assert "of 50, 2000 fs each" in err
    assert err.endswith("a.npz is of step 0, resume from it\n")


def test_ctrl_c_tells_where_to_go_on(call, folder, monkeypatch):
    from rotor.fluids.motion.dynamics import RigidDynamics

    step = RigidDynamics.step

    def interrupted(self):
        if self.nsteps == 12 and Path("a.npz").exists():  # relaxing, before, has no checkpoint
            raise KeyboardInterrupt
        step(self)

    options = (*VAPOUR, "--ensemble", "langevin", "--steps", "20", "--every", "5", "--checkpoint-every", "5")
    monkeypatch.setattr(RigidDynamics, "step", interrupted)
    code, out, err = call(*options, "--checkpoint", "a.npz", "--csv", "a.csv")
    assert (code, out) == (130, "")
    assert err == "interrupted; a.npz holds the run so far; --resume continues\n"
    monkeypatch.setattr(RigidDynamics, "step", step)
    assert call(*options, "--checkpoint", "a.npz", "--csv", "a.csv", "--resume")[0] == 0
    assert call(*options, "--checkpoint", "b.npz", "--csv", "b.csv")[0] == 0
    assert Path("a.csv").read_bytes() == Path("b.csv").read_bytes()


def test_ctrl_c_before_the_first_row_names_no_file_of_an_earlier_run(call, folder, monkeypatch):
    from rotor.fluids.motion.dynamics import RigidDynamics

    def interrupted(self):
        raise KeyboardInterrupt

    Path("a.csv").write_text("an earlier run\n")
    monkeypatch.setattr(RigidDynamics, "step", interrupted)
    code, out, err = call(*VAPOUR, "--ensemble", "langevin", "--steps", "20", "--csv", "a.csv")
    assert (code, out, Path("a.csv").read_text()) == (130, "", "an earlier run\n")
    assert "a.csv" not in err


def test_what_there_is_not_has_no_row(call, folder):
    argon = (
        "fluid", "argon", "--model", "argon", "--molecules", "27", "--density", "0.5", "--cutoff", "6", "--equilibration", "0",
    )  # fmt: skip
    code, out, _ = call(*argon, "--temperature", "90", "--steps", "20")
    assert code == 0
    assert "of translation" in out
    assert "of rotation  " not in out  # an atom has none
    code, out, _ = call(*argon, "--temperature", "90", "--steps", "0")
    assert code == 0
    assert "nan" not in out
    assert "one row alone" in out


def test_a_run_is_drawn_with_temperatures_and_pair_distribution(call, folder):
    code, _, err = call(*VAPOUR, "--steps", "10", "--every", "5", "--plot", "run.svg")
    assert (code, err) == (0, "")
    text = Path("run.svg").read_text(encoding="utf-8")
    assert "Temperature (K)" in text
    assert "g(r) of 2 frames" in text
    assert [path.name for path in folder.iterdir()] == ["run.svg"]  # frames were taken along in a temporary folder
    assert call(*VAPOUR, "--steps", "5", "--plot", "run.txt")[0] == 2
    assert call(*VAPOUR, "--steps", "5", "--checkpoint", "c.npz", "--plot", "last.svg")[0] == 0
    assert "g(r) of 1 frame" in Path("last.svg").read_text(encoding="utf-8")
