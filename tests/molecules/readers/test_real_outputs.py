"""Quantum-chemistry outputs that programs really wrote: geometry, constants, dipole and polarizability as they print them."""

from __future__ import annotations

import importlib.util
import shutil
from pathlib import Path

import numpy as np
import pytest
from places import ORACLES

import rotor
from rotor.cli import run
from rotor.molecules.readers.quantum_chemistry import read_output
from rotor.molecules.readers.read import read_molecule
from rotor.units import BOHR_RADIUS_ANGSTROM, DEBYE_PER_E_ANGSTROM

FOLDER = ORACLES / "outputs"
DEBYE_PER_AU = DEBYE_PER_E_ANGSTROM * BOHR_RADIUS_ANGSTROM
with_cclib = pytest.mark.skipif(
    importlib.util.find_spec("cclib") is None, reason="the extra qc (cclib) is not installed"
)


def top_of(name: str) -> rotor.Top:
    return rotor.Top.from_molecule(read_molecule(FOLDER / name))


@with_cclib
def test_a_real_output_of_gaussian_09_is_read():
    top = top_of("trithiolane_g09.log")
    # coordinates to 1e-6 Å, and constants of 2006
    assert top.rotational_constants_mhz == pytest.approx((3698.1615, 2533.1054, 1646.0769), rel=1e-6)
    assert top.molecule.dipole_debye == pytest.approx([-0.5831, 0.0001, 0.0006], abs=1e-9)  # as printed
    tensor = top.molecule.polarizability_angstrom3 / BOHR_RADIUS_ANGSTROM**3
    assert np.trace(tensor) / 3 == pytest.approx(66.10, abs=0.006)  # `Isotropic polarizability` of the whole output
    assert tensor[1, 2] == pytest.approx(1.520, abs=5e-4)  # three decimals
    assert top.notes == ()


@with_cclib
def test_psi4_1_7():
    top = top_of("water_psi4.out")
    assert top.rotational_constants_mhz == pytest.approx((795336.70717, 401083.17149, 266625.60076), rel=2e-9)
    assert np.abs(top.dipole_abc_debye) == pytest.approx([0, 0.6582919 * DEBYE_PER_AU, 0], abs=1e-6)  # 7 decimals
    assert top.molecule.dipole_debye[2] > 0  # the hydrogens are above, and positive
    assert top.notes == ()


def test_orca_6_gives_the_dipole_along_the_rotational_axes_itself():
    """ORCA turns the dipole into its own rotational axes, which are those of average masses: 1e-4 D apart."""
    top = top_of("tryptophan_orca6.out")
    assert top.dipole_abc_debye == pytest.approx([-0.882302, 1.879425, -1.743314], abs=3e-4)
    assert top.rotational_constants_mhz == pytest.approx((1235.349, 361.309, 317.877), rel=7e-4)  # its masses
    (note,) = top.notes
    assert "they agree with the masses that ORCA used" in note
    alpha = np.array(top.polarizability_abc_angstrom3) / BOHR_RADIUS_ANGSTROM**3
    assert np.linalg.eigvalsh(alpha) == pytest.approx([30.294228900, 91.536250787, 100.542236927], rel=1e-6)  # CODATA
    assert np.trace(alpha) / 3 == pytest.approx(74.12424, rel=1e-6)  # CODATA


def test_orca_6_and_gaussian_16_say_the_same_of_tryptophan():
    """The same job in both programs, in one frame: cclib's data/Gaussian/basicGaussian16/Trp_polar.log."""
    molecule = read_molecule(FOLDER / "tryptophan_orca6.out")
    assert molecule.dipole_debye == pytest.approx([-1.2075, 0.9547, -2.2316], abs=1e-4)  # four decimals
    gaussian = [[95.1154, -2.27759, -3.77571], [-2.27759, 49.9964, 30.4190], [-3.77571, 30.4190, 77.2609]]
    alpha = molecule.polarizability_angstrom3 / BOHR_RADIUS_ANGSTROM**3
    assert np.abs(alpha - gaussian).max() < 2e-4  # convergence of the two programs, digits printed


def test_cfour_2_1_takes_the_last_geometry_and_the_correlated_dipole():
    top = top_of("water_cfour.out")
    printed = (775472.0813744339, 443134.0923194804, 281992.7588724590)
    assert top.rotational_constants_mhz == pytest.approx(printed, rel=1e-6)  # constants of physics of another year
    assert np.abs(top.dipole_abc_debye) == pytest.approx([0, 0.7855589278 * DEBYE_PER_AU, 0], abs=1e-8)  # ten decimals
    assert np.linalg.norm(top.dipole_abc_debye) == pytest.approx(1.99669198, rel=1e-6)  # in debye, as CFOUR says it
    assert top.molecule.dipole_debye[2] < 0  # the hydrogens are below, and positive
    assert top.notes == ()
    assert "cclib" not in top.source


def changed(tmp_path: Path, name: str, *pairs: tuple[str, str]) -> Path:
    text = (FOLDER / name).read_text(encoding="utf-8")
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path / name


def test_neither_needs_cclib(monkeypatch):
    for module in ("read", "quantum_chemistry"):
        monkeypatch.setattr(f"rotor.molecules.readers.{module}.has_cclib", lambda: False)
    assert read_molecule(FOLDER / "water_cfour.out").dipole_source.startswith("CFOUR")
    assert read_molecule(FOLDER / "tryptophan_orca6.out").polarizability_source.startswith("ORCA")
    with pytest.raises(ValueError, match=r"molrotor\[qc\]"):
        read_output(FOLDER / "water_psi4.out")


@pytest.mark.parametrize("suffix", [".dat", ".c4", ".log"])
def test_names_that_outputs_have(tmp_path, suffix):
    shutil.copy(FOLDER / "water_cfour.out", tmp_path / f"output{suffix}")
    assert read_molecule(tmp_path / f"output{suffix}").formula == "H2O"


def test_isotopes_and_ions_of_orca_6(tmp_path):
    ion = ("....    0", "....    1")
    heavy = ("6 H     1.0000    0     1.008", "6 H     1.0000    0     2.014")
    neutral = read_molecule(FOLDER / "tryptophan_orca6.out")
    molecule = read_molecule(changed(tmp_path, "tryptophan_orca6.out", ion, heavy))
    assert (molecule.charge, molecule.mass_numbers[6]) == (1, 2)
    origin = BOHR_RADIUS_ANGSTROM * np.array([6.318125, 0.497235, -2.037981])  # as printed
    moved = molecule.dipole_debye - neutral.dipole_debye
    assert moved == pytest.approx(-DEBYE_PER_E_ANGSTROM * (molecule.centre_of_mass_angstrom - origin), abs=1e-6)


def test_dummies_and_a_polarizability_of_cfour(tmp_path):
    dummy = "     X         0         0.00000000     0.00000000     1.00000000\n     O         8        -0.00"
    path = changed(
        tmp_path,
        "water_cfour.out",
        ("     O         8        -0.00", dummy),
        ("ICHRGE              0", "ICHRGE              1"),
        ("   Components of second moment", "   Static polarizability\n   Components of second moment"),
    )
    molecule = read_molecule(path)
    assert (molecule.formula, molecule.charge) == ("H2O+", 1)
    assert "CFOUR's polarizability was not read" in molecule.notes[0]
    assert molecule.dipole_debye is not None


@pytest.mark.parametrize(
    ("name", "old", "new", "rule"),
    [
        ("water_cfour.out", "-1.42145288", "***********", "asterisks"),
        ("water_cfour.out", "-0.7855589278", "***********", "asterisks"),
        ("water_cfour.out", "-0.7855589278", "-0.785558D+00", "D exponent"),
        ("water_cfour.out", "Z =   -0.7855589278", "", "three numbers of a dipole"),
        ("water_cfour.out", "     O         8        -0", "     ?         8        -0", "no table of coordinates"),
        ("water_cfour.out", "This computation required", "", "ends without 'This computation required'"),
        ("tryptophan_orca6.out", "-0.877962624", "************", "asterisks"),
        ("tryptophan_orca6.out", "      95.115424760", "  ****************", "asterisks"),
        ("tryptophan_orca6.out", "The raw cartesian tensor", "", "no 3 x 3 numbers of a polarizability"),
        ("tryptophan_orca6.out", "ORCA TERMINATED NORMALLY", "", "ends without"),
        pytest.param("water_psi4.out", "0.6582919", "*********", "asterisks", marks=with_cclib),
        pytest.param("trithiolane_g09.log", "46.789", "******", "asterisks", marks=with_cclib),
    ],
)
def test_what_cannot_be_read_is_refused_with_its_line(tmp_path, name, old, new, rule):
    with pytest.raises(ValueError, match=rf"line \d+: .*{rule}"):
        read_molecule(changed(tmp_path, name, (old, new)))


def test_every_cut_of_cfour_is_refused(tmp_path):
    lines = (FOLDER / "water_cfour.out").read_text(encoding="utf-8").splitlines()
    for stop in range(3, len(lines) - 1, 3):
        (tmp_path / "cut.out").write_text("\n".join(lines[:stop]) + "\n", encoding="utf-8")
        last = max(k for k, line in enumerate(lines[:stop], 1) if line.strip())
        with pytest.raises(ValueError, match=rf"cut.out: line {last}: the file ends without"):
            read_molecule(tmp_path / "cut.out")


def test_on_the_command_line(capsys):
    assert run(["spectrum", str(FOLDER / "water_cfour.out"), "--jmax", "3", "--json", "-"]) == 0
    assert "CFOUR" in capsys.readouterr().out
