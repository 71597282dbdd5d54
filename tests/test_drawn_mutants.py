"""Tests for mutants that others let pass (benchmarks/mutation.py, docs/validation/mutants_and_fuzz.md): each goes red for its mutant."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import rotor
from rotor.formats.spcat.hamiltonian.codes import _whole_code
from rotor.formats.spcat.text.par import Parameter
from rotor.quantum.wang import wang_matrix
from rotor.scenes.plan_parts import _extrapolated

# Refusals


def test_a_molecule_without_a_geometry_is_refused_by_assign(call):
    """Its isotopologues would be left out without a word."""
    Path("peaks.csv").write_text("frequency_mhz,intensity\n" + "".join(f"{8000 + 90.5 * k},1\n" for k in range(20)))
    Path("a.toml").write_text(
        'name = "a"\n[constants]\nunit = "MHz"\nsource = "b"\nA = 9000.0\nB = 3000.0\nC = 2500.0\n'
    )
    code, _, err = call("assign", "peaks.csv", "--molecule", "a.toml")
    assert (code, err.count("\n")) == (2, 1)
    assert "holds no geometry" in err


@pytest.mark.parametrize("text", ["300,2e6", "1e7", "10:1.1e6K:3"])
def test_temperatures_beyond_molecules_are_refused(call, text):
    code, out, err = call("info", "CO", "--temperature", text)
    assert (code, out) == (2, "")
    assert "expected temperatures up to 1e+06 K" in err


def test_a_folder_without_catalogues_is_named(call):
    Path("none").mkdir()
    Path("s.txt").write_text("".join(f"{100000 + k} {np.exp(-((k - 50) ** 2)) + 0.01 * np.sin(7.0 * k):.6f}\n" for k in range(100)))
    code, _, err = call("identify", "s.txt", "--catalogue", "none", "--width", "2")
    assert code == 2
    assert "none: no .cat file in this folder" in err


def test_a_table_of_levels_names_its_file(folder):
    Path("levels.csv").write_text("j,ka,kc,energy_mhz,error_mhz\n0,0,0,0,0\n1,0,1,9,1\n1,0,1,9,1\n")
    from rotor.formats.molecules.level_table import read_level_table

    with pytest.raises(ValueError, match=r"^levels.csv: the level .* is twice in the table"):
        read_level_table("levels.csv")


@pytest.mark.parametrize(
    ("code", "what"),
    [(10000000000, "Fourier"), (110010000, "a spin"), (111, "another vibrational state"), (0, "energy")],
)
def test_codes_without_names_are_refused(code, what):
    with pytest.raises(ValueError, match=what):
        _whole_code(Parameter(code, 1.0, 0.0))


def test_a_solver_that_does_not_converge_raises(monkeypatch):
    """info > 0 of dstevd: off-diagonal elements that did not vanish; its energies are none."""
    import scipy.linalg.lapack

    size = wang_matrix.SMALL + 5
    unfinished = (np.zeros(size), np.eye(size), 3)
    monkeypatch.setattr(scipy.linalg.lapack, "dstevd", lambda *_, **__: unfinished)
    with pytest.raises(ValueError, match=rf"did not converge on a block of size {size} \(info = 3\)"):
        wang_matrix.diagonalise([np.arange(size) ** 2.0, np.ones(size - 1)])


def test_a_data_frame_whose_library_lacks_a_part_says_which(monkeypatch):
    """That pandas is not installed would be the wrong advice."""
    import importlib

    def lacks(name):
        raise ModuleNotFoundError("No module named 'dateutil'", name="dateutil")

    table = rotor.levels("CO", jmax=1).table
    monkeypatch.setattr(importlib, "import_module", lacks)
    with pytest.raises(ModuleNotFoundError, match="dateutil"):
        table.to_pandas()


def test_an_atom_is_refused_as_an_atom_and_not_as_a_drawing():
    """Of one atom a flat drawing is the whole geometry."""
    from rdkit import Chem
    from rdkit.Chem import AllChem

    atom = Chem.MolFromSmiles("[Ar]")
    AllChem.Compute2DCoords(atom)
    with pytest.raises(ValueError, match="a single atom"):
        rotor.read(atom)


# Costs


def test_a_cost_proportional_to_the_work_is_extrapolated_exactly():
    """t = 10 + 3 n from n = 4 and 8 gives 310 at n = 100; a call that is no larger is measured itself."""
    measured = _extrapolated(lambda call: call(), lambda n: 10.0 + 3.0 * n, float, (4, 8), 100)
    assert measured == pytest.approx(310.0, rel=1e-14)  # round-off of three operations
    assert _extrapolated(lambda call: call(), lambda n: 10.0 + 3.0 * n, float, (4, 8), 6) == 28.0
    falling = _extrapolated(lambda call: call(), lambda n: 10.0 - n, float, (4, 8), 100)
    assert falling == 2.0  # noise of a clock: no cost falls with the work
