"""Quadrupole couplings of outputs of Gaussian and ORCA, from their axes to those of the top, its isotopologues and its lines."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from output_tables import TURN, table
from places import ORACLES

import rotor
from rotor.molecules.molecule import Molecule, couplings_mhz
from rotor.molecules.nuclei import isotope
from rotor.molecules.readers.read import read_molecule
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.solve import solve_levels
from rotor.tops.top import Top
from rotor.units import BOHR_RADIUS_ANGSTROM, QUADRUPOLE_MHZ_PER_BARN_AU

NUMBERS = (1, 7, 8)  # HNO, about
PLANE = np.array([[0.94, 1.02, 0.0], [0.0, 0.6, 0.0], [0.0, -0.61, 0.0]])
CHI_ABC = np.array([[0.36, 1.50, 0.0], [1.50, -5.46, 0.0], [0.0, 0.0, 5.10]])  # invented, traceless
DIPOLE_ABC = np.array([1.03, 1.31, 0.0])
FRAME = Top.from_molecule(Molecule(("H", "N", "O"), PLANE)).frame
COLUMNS = {
    "abc": np.eye(3),
    "cab": np.eye(3)[[2, 0, 1]],
    "bca": np.eye(3)[[1, 2, 0]],
}  # which axes its letters stand for


def output(columns: str, *, dipole: np.ndarray | None = None, isotope_of_n: int = 14, axes: bool = True) -> str:
    """An imitation of a job with output=pickett, its couplings in a table whose columns are a, b, c in another order."""
    order = COLUMNS[columns]
    frame_positions = (PLANE - FRAME.centre) @ FRAME.axes.T @ order.T
    chi, mu = order @ CHI_ABC @ order.T, order @ DIPOLE_ABC if dipole is None else dipole
    standard = PLANE @ TURN.T
    x, y, z = TURN @ FRAME.axes.T @ DIPOLE_ABC
    text = " Entering Gaussian System, Link 0=g16\n Copyright (c) 1988-2016, Gaussian, Inc.  All Rights Reserved.\n"
    text += " Charge =  0 Multiplicity = 1\n" + table("Standard orientation:", standard, NUMBERS)
    text += (
        f" Dipole moment (field-independent basis, Debye):\n    X={x:22.4f}    Y={y:22.4f}    Z={z:22.4f}  Tot= 1.0\n"
    )
    if axes:
        text += f"{'Principal axis orientation:':>45}\n {'-' * 69}\n Center     Atomic                     Coordinates (Angstroms)\n"
        text += f" Number     Number              X              Y              Z\n {'-' * 69}\n"
        rows = zip(NUMBERS, frame_positions, strict=True)
        text += "".join(f"{i:7d}{n:11d}    {r[0]:15.6f}{r[1]:15.6f}{r[2]:15.6f}\n" for i, (n, r) in enumerate(rows, 1))
        text += f" {'-' * 69}\n"
    text += f" Nuclear quadrupole coupling constants [Chi] (MHz):\n  2  N({isotope_of_n})\n"
    for i, first in enumerate("abc"):
        text += "".join(f"   {second}{first}={chi[k, i]:11.4f}" for k, second in enumerate("abc")) + "\n"
    text += " Dipole moment (Debye):\n" + "".join(f"{m:15.7f}" for m in mu) + "  Tot=      1.0\n"
    return text + " Normal termination of Gaussian 16 at Sat Jan  1 00:00:00 2022.\n"


def read(folder: Path, text: str) -> Top:
    path = folder / "hno.log"
    path.write_text(text, encoding="utf-8")
    return rotor.read(str(path))


@pytest.mark.parametrize("columns", COLUMNS)
def test_couplings_are_turned_to_the_principal_axes(tmp_path, columns):
    content = read(tmp_path, output(columns)).spin_constants
    assert dict(content.twice) == {"14N": 2}
    assert dict(content.atoms) == {"14N": 2}
    assert content.source.startswith("computed: Gaussian, ")
    expected = {"chi_aa(14N)": 0.36, "chi_bb-cc(14N)": -10.56, "chi_ab(14N)": 1.5}
    assert set(content.values) == set(expected)
    for name, value in expected.items():
        reference = (
            abs(content.values[name]) if name == "chi_ab(14N)" else content.values[name]
        )  # its sign goes with that of the axes
        assert reference == pytest.approx(value, abs=3e-4)  # four decimals, and six of coordinates


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"dipole": np.array([1.31, 1.03, 0.0])}, "a dipole that is not the molecule's"),
        ({"isotope_of_n": 15}, "are of 15N, atom 2 is 14N"),
        ({"axes": False}, "axes that no table of the same geometry says"),
    ],
)
def test_what_the_file_does_not_settle_is_left_out_with_a_note(tmp_path, changes, why):
    top = read(tmp_path, output("cab", **changes))
    assert top.spin_constants is None
    assert any(why in note for note in top.notes)


def test_isotopologues(tmp_path):
    """Deuterium turns the axes and leaves the tensor of nitrogen; 15N has no quadrupole moment."""
    from rotor.tops.isotopes.isotopologues import isotopologue

    parent = read(tmp_path, output("bca"))
    heavy = isotopologue(parent, "H=2H").top
    chi = heavy.frame.axes @ FRAME.axes.T @ CHI_ABC @ FRAME.axes @ heavy.frame.axes.T
    turned = parent.molecule.with_isotopes("H=2H").quadrupole_mhz[2]
    assert np.allclose(turned, parent.molecule.quadrupole_mhz[2])
    assert heavy.spin_constants.values["chi_bb-cc(14N)"] == pytest.approx(-10.56, abs=0.3)
    assert np.linalg.eigvalsh(chi) == pytest.approx(np.linalg.eigvalsh(turned), abs=1e-3)  # four decimals
    assert isotopologue(parent, "N=15N").top.spin_constants is None


def test_the_gradient_stays_and_q_changes():
    """χ of 37Cl is that of 35Cl times Q'/Q, 0.788."""
    chi = np.diag([-30.0, -45.0, 75.0])
    light = Molecule(("H", "Cl"), [[0, 0, 0], [0, 0, 1.27]], quadrupole_mhz={2: chi})
    ratio = isotope("Cl", 37).quadrupole_barn / isotope("Cl", 35).quadrupole_barn
    assert np.allclose(light.with_isotopes("Cl=37Cl").quadrupole_mhz[2], ratio * chi)
    assert 0.78 < ratio < 0.80
    back = light.moved(TURN).moved(TURN.T)
    assert np.allclose(back.quadrupole_mhz[2], chi)
    with pytest.raises(ValueError, match="expected a symmetric, traceless tensor"):
        Molecule(("H", "Cl"), [[0, 0, 0], [0, 0, 1.27]], quadrupole_mhz={2: np.eye(3)})


def test_levels_split(tmp_path):
    """J = 1 of three components; their mean, weighted by 2F+1, is the level without spin."""
    top = read(tmp_path, output("abc"))
    with_spin, plain = solve_levels(top, 1, effects=effects_of(top, True)), solve_levels(top, 1)
    first_level = with_spin.quanta["n"] == 1
    assert first_level.sum() == 9
    weights = with_spin.multiplicity[first_level]
    mean = np.average(with_spin.energy_mhz[first_level], weights=weights)
    assert mean == pytest.approx(plain.energy_mhz[plain.quanta["j"] == 1].mean(), abs=1e-3)  # χ²/A, less than 1 kHz
    assert np.ptp(with_spin.energy_mhz[first_level]) > 0


ORCA = ORACLES / "outputs"
GRADIENTS = {  # of the samples: their own e**2qQ in MHz and the last digit of their gradients, a.u.
    "aminoxyl_orca6.out": (-4.414326, 1e-7),
    "aminoxyl_orca4.out": (-4.393, 1e-4),
}


@pytest.mark.parametrize("name", GRADIENTS)
def test_field_gradients_of_orca(name):
    """Largest eigenvalue as the program's own, which has the same Q of 14N to 2e-6."""
    gradient, digit = GRADIENTS[name]
    molecule = read_molecule(ORCA / name)
    values = np.linalg.eigvalsh(molecule.quadrupole_mhz[1])
    assert values[np.abs(values).argmax()] == pytest.approx(
        gradient, abs=QUADRUPOLE_MHZ_PER_BARN_AU * 0.02 * 2 * digit + 1e-5
    )
    top = rotor.read(str(ORCA / name))
    chi = top.frame.axes @ molecule.quadrupole_mhz[1] @ top.frame.axes.T
    computed = top.spin_constants.values
    assert set(computed) == {"chi_aa(14N)", "chi_bb-cc(14N)", "chi_ac(14N)"}  # a plane of symmetry
    assert computed["chi_aa(14N)"] == pytest.approx(chi[0, 0])
    assert computed["chi_bb-cc(14N)"] == pytest.approx(chi[1, 1] - chi[2, 2])
    assert top.spin_constants.source.startswith("computed: field gradients of ORCA, ")


def field_gradient_of_charges(molecule: Molecule, atom: int) -> np.ndarray:
    """∂²/∂r² of the potential Σ Z/r of the other nuclei at one, Eh/(e a0²): Σ Z (3 r rᵀ - r²)/r⁵."""
    total = np.zeros((3, 3))
    for other, nucleus in enumerate(molecule.nuclei):
        r = (molecule.positions_angstrom[other] - molecule.positions_angstrom[atom]) / BOHR_RADIUS_ANGSTROM
        if other != atom:
            total += nucleus.element_number * (3 * np.outer(r, r) - r @ r * np.eye(3)) / (r @ r) ** 2.5
    return total


def test_sign_and_axes_of_orca_are_those_of_positive_charges():
    """The part of the other nuclei, which ORCA prints along the axes of the whole tensor, from its geometry."""
    molecule = read_molecule(ORCA / "aminoxyl_orca6.out")
    printed = {1: (-0.2291314, 1.0767742, -0.8476428), 2: (-0.5438474, 1.0662122, -0.5223648)}
    orientation = {  # columns are axes
        1: [[0.2770792, -0.7751726, 0.5677451], [-0.3481393, -0.6317234, -0.6926215], [0.8955591, -0.0057434, -0.4449055]],
        2: [[0.5025358, 0.8189756, 0.2770139], [-0.7419412, 0.5730124, -0.3481094], [-0.4438255, -0.0305906, 0.8955910]],
    }  # fmt: skip
    for atom, values in printed.items():
        axes = np.array(orientation[atom])
        assert np.diag(axes.T @ field_gradient_of_charges(molecule, atom - 1) @ axes) == pytest.approx(
            values, abs=2e-5
        )  # 6 decimals of r
        whole = np.diag(axes.T @ molecule.field_gradients_au[atom] @ axes)
        assert np.sort(whole) == pytest.approx(np.linalg.eigvalsh(molecule.field_gradients_au[atom]), abs=1e-6)


def test_isotopes_without_q_get_couplings_of_those_with_one():
    """1H and 16O have no quadrupole; 2H and 17O have those of ORCA's own table, in which it takes them instead."""
    light = read_molecule(ORCA / "aminoxyl_orca6.out")
    assert set(light.quadrupole_mhz) == {1}
    heavy = light.with_isotopes("H=2H,O=17O")
    largest = {atom: chi[np.abs(chi).argmax()] for atom, chi in
               ((atom, np.linalg.eigvalsh(chi)) for atom, chi in heavy.quadrupole_mhz.items())}  # fmt: skip
    assert largest == pytest.approx(
        {1: -4.414326, 2: 14.692034, 3: 0.263349, 4: 0.263354}, rel=3e-3
    )  # 2.86 and 2.858 mb of 2H
    assert largest[2] == pytest.approx(14.692034, rel=1e-3)  # 25.58 mb of 17O in both
    assert set(heavy.with_isotopes("H=1H,O=16O,N=15N").quadrupole_mhz) == set()
    turned = heavy.moved(TURN).with_isotopes("O=16O").with_isotopes("O=17O")
    assert np.allclose(turned.quadrupole_mhz[2], TURN @ heavy.quadrupole_mhz[2] @ TURN.T)


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        (" Nucleus   0N :", " Nucleus   0C :", "atom 1, counted from 1, of the last geometry is expected to be C"),
        ("     0.6915838      -0.1309907", "     0.6915838       0.1309907", "expected to be symmetric and traceless"),
        ("      -0.1309907      -0.3444413\n", "\n", "three rows of three numbers are expected"),
        (" Nucleus ", " Kern ", "without the line `Nucleus`"),
    ],
)
def test_damaged_field_gradients_are_refused(tmp_path, old, new, why):
    text = (ORCA / "aminoxyl_orca6.out").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "damaged.out"
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(ValueError, match=why):
        read_molecule(path)


def test_gradients_of_another_geometry_are_left_out(tmp_path):
    text = (ORCA / "aminoxyl_orca6.out").read_text(encoding="utf-8")
    start = text.index("CARTESIAN COORDINATES (ANGSTROEM)")
    again = text[start : text.index("CARTESIAN COORDINATES (A.U.)")]
    path = tmp_path / "two.out"
    path.write_text(text.replace("      ****ORCA TERM", again + "\n      ****ORCA TERM"), encoding="utf-8")
    molecule = read_molecule(path)
    assert not molecule.quadrupole_mhz
    assert any("belong to a geometry before the last one" in note for note in molecule.notes)


# Field gradients, a.u., at the geometries of data/molecules: PySCF 2.14.0, RKS B3LYP/def2-TZVPP, (3 r rᵀ - r²)/r⁵ of nuclei less electrons
PYSCF = {
    ("HCN", 3): np.diag([0.53862, 0.53862, -1.07724]),
    ("CH3Cl", 2): np.diag([-2.040865, -2.040865, 4.08173]),
    ("HCONH2", 3): np.array([[0.43812, -0.01421, 0.0], [-0.01421, 0.42608, 0.0], [0.0, 0.0, -0.8642]]),
}


@pytest.mark.parametrize("name", [name for name, _ in PYSCF])
def test_computed_gradients_give_the_measured_couplings(name):
    """Signs and sizes along the principal axes; that functional makes couplings of 14N 5 to 10 % too large, those of Cl 5 %."""
    top = rotor.read(name)
    gradients = {atom: gradient for (molecule, atom), gradient in PYSCF.items() if molecule == name}
    with_them = replace(top.molecule, quadrupole_mhz=couplings_mhz(gradients, top.molecule.nuclei))
    computed = Top.from_molecule(with_them).spin_constants.values
    measured = {key: value for key, value in top.spin_constants.values.items() if key.startswith("chi")}
    assert {"chi_aa", "chi_bb-cc"} & {key.partition("(")[0] for key in measured}
    for key, value in measured.items():
        assert computed[key] == pytest.approx(value, abs=0.11 * max(abs(item) for item in measured.values())), key
