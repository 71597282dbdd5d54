"""Outputs of quantum-chemistry programs, imitated here line by line from one water molecule with known tensors."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from output_tables import NUMBERS, TURN, table

from rotor.molecules.molecule import Molecule
from rotor.molecules.readers.ground_state import dipole_lines, is_excited, printed_dipole
from rotor.molecules.readers.programs import Output, detect_program
from rotor.molecules.readers.quantum_chemistry import read_output
from rotor.molecules.readers.read import read_molecule
from rotor.units import BOHR_RADIUS_ANGSTROM, DEBYE_PER_E_ANGSTROM, MHZ_PER_CM, ROTATIONAL_MHZ_U_ANGSTROM2

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("cclib") is None, reason="the extra qc (cclib) is not installed"
)

DEBYE_PER_AU = DEBYE_PER_E_ANGSTROM * BOHR_RADIUS_ANGSTROM
SYMBOLS = ("O", "H", "H")
WATER = np.array([[0.0, 0.0, 0.1173], [0.0, 0.7572, -0.4692], [0.0, -0.7572, -0.4692]])
DIPOLE = np.array([0.3, -0.2, 1.8])  # not along the axis: a wrong turn shows in every component
ALPHA = np.array([[9.1, 0.4, -0.3], [0.4, 10.2, 0.7], [-0.3, 0.7, 9.6]])  # a.u.
SHIFT = np.array([0.5, -1.2, 2.0])
AXES = WATER @ TURN.T + SHIFT  # the input orientation


def constants_mhz(positions, masses=None):
    """A, B, C of the planar molecule from its moments, by another route than the package: distances to each axis."""
    m = np.array((15.99491462, 1.00782503, 1.00782503) if masses is None else masses)
    r = positions - m @ positions / m.sum()
    _, _, axes = np.linalg.svd(np.sqrt(m)[:, None] * r)
    x = r @ axes.T
    moments = [m @ (x[:, (k + 1) % 3] ** 2 + x[:, (k + 2) % 3] ** 2) for k in range(3)]
    return np.sort([ROTATIONAL_MHZ_U_ANGSTROM2 / moment for moment in moments if moment > 1e-9])[::-1]


def d15(values):
    return "".join(f"{value:15.8E}" for value in values).replace("E", "D")


def gaussian(*, standard=WATER, inputs=AXES, tensor_turn=None, charge=0, ghz=None, polar=True):
    """An imitation of a Gaussian frequency job. tensor_turn: from standard axes to those of `Polarizability=`."""
    turn = np.eye(3) if tensor_turn is None else tensor_turn
    ghz = " ".join(f"{c / 1e3:15.7f}" for c in constants_mhz(WATER)) if ghz is None else ghz
    text = " Entering Gaussian System, Link 0=g16\n Copyright (c) 1988-2016, Gaussian, Inc.  All Rights Reserved.\n"
    text += f" Charge = {charge:2d} Multiplicity = 1\n"
    if inputs is not None:
        text += table("Input orientation:", inputs)
    if standard is not None:
        text += table("Standard orientation:", standard)
    text += f" Rotational constants (GHZ): {ghz}\n"
    x, y, z = DIPOLE if standard is not None else TURN @ DIPOLE
    text += " Dipole moment (field-independent basis, Debye):\n"
    text += f"    X={x:22.4f}    Y={y:22.4f}    Z={z:22.4f}  Tot={np.linalg.norm(DIPOLE):22.4f}\n"
    if polar:
        alpha = turn @ ALPHA @ turn.T
        text += f" Dipole        ={d15(turn @ DIPOLE / DEBYE_PER_AU)}\n"
        lower = alpha[np.tril_indices(3)]
        text += f" Polarizability={d15(lower[:3])}\n                {d15(lower[3:])}\n"
    return text + " Normal termination of Gaussian 16 at Sat Jan  1 00:00:00 2022.\n"


def orca(*, charge=0, masses=None, positions=AXES):
    rows = "".join(
        f"  {s}   {x:12.6f}  {y:12.6f}  {z:12.6f}\n" for s, (x, y, z) in zip(SYMBOLS, positions, strict=True)
    )
    x, y, z = TURN @ DIPOLE / DEBYE_PER_AU
    com = np.array([15.999, 1.008, 1.008]) @ positions / 18.015 / BOHR_RADIUS_ANGSTROM
    cm = "  ".join(f"{c / MHZ_PER_CM:.6f}" for c in constants_mhz(WATER, masses))
    alpha = "".join("".join(f"{value:14.6f}" for value in row) + "\n" for row in TURN @ ALPHA @ TURN.T)
    bohr = "".join(
        f"  {i} {s}   {z:.4f}    0  {m:8.3f}  {p[0]:12.6f} {p[1]:12.6f} {p[2]:12.6f}\n"
        for i, (s, z, m, p) in enumerate(
            zip(SYMBOLS, NUMBERS, (15.999, 1.008, 1.008), positions / BOHR_RADIUS_ANGSTROM, strict=True)
        )
    )
    return (
        "                 * O   R   C   A *\n Program Version 5.0.3 -  RELEASE  -\n\n"
        f" Total Charge           Charge          ....    {charge}\n"
        " Multiplicity           Mult            ....    1\n\n"
        f"---------------------------------\nCARTESIAN COORDINATES (ANGSTROEM)\n---------------------------------\n{rows}\n"
        f"----------------------------\nCARTESIAN COORDINATES (A.U.)\n----------------------------\n"
        f"  NO LB      ZA    FRAG     MASS         X           Y           Z\n{bohr}\n"
        f"The origin for moment calculation is the CENTER OF MASS  = ({com[0]:.6f}, {com[1]:.6f} {com[2]:.6f})\n"
        "-------------\nDIPOLE MOMENT\n-------------\n                                X             Y             Z\n"
        "Electronic contribution:      0.00000       0.00000      0.00000\n"
        "Nuclear contribution   :      0.00000       0.00000      0.00000\n"
        "                        -----------------------------------------\n"
        f"Total Dipole Moment    :   {x:12.6f}  {y:12.6f}  {z:12.6f}\n\n"
        f"Rotational constants in cm-1: {cm}\n\n"
        "-------------------------\nTHE POLARIZABILITY TENSOR\n-------------------------\n\n"
        f"The raw cartesian tensor (atomic units):\n{alpha}\n"
        "                             ****ORCA TERMINATED NORMALLY****\nTOTAL RUN TIME: 0 days 0 hours 0 minutes 1 seconds 1 msec\n"
    )


def psi4(positions=AXES):
    rows = "".join(
        f"         {s:<2} {x:18.12f} {y:18.12f} {z:18.12f} {m:18.12f}\n"
        for s, (x, y, z), m in zip(SYMBOLS, positions, (15.99491461957, 1.00782503223, 1.00782503223), strict=True)
    )
    x, y, z = TURN @ DIPOLE / DEBYE_PER_AU
    a, b, c = constants_mhz(WATER) / MHZ_PER_CM
    return (
        "          Psi4: An Open-Source Ab Initio Electronic Structure Package\n"
        "                               Psi4 1.5 release\n\n  ==> Geometry <==\n\n"
        "    Molecular point group: c1\n    Full point group: C1\n\n"
        "    Geometry (in Angstrom), charge = 0, multiplicity = 1:\n\n"
        "       Center              X                  Y                   Z               Mass       \n"
        "    ------------   -----------------  -----------------  -----------------  -----------------\n"
        f"{rows}\n  Running in c1 symmetry.\n\n"
        f"  Rotational constants: A = {a:11.5f}  B = {b:11.5f}  C = {c:11.5f} [cm^-1]\n"
        "Properties will be evaluated at   0.000000,   0.000000,   0.000000 [a0]\n\n  ==> Properties <==\n\n"
        "  Dipole Moment: [e a0]\n  Dipole Moment: (a.u.)\n"
        f"     X: {x:10.5f}      Y: {y:10.5f}      Z: {z:10.5f}     Total: 0.0\n\n"
        "*** Psi4 exiting successfully. Buy a developer a beer!\n"
    )


def written(folder: Path, text: str, name: str = "water.log") -> Path:
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def assert_tensors(molecule: Molecule, turn, polarizability=True):
    assert np.allclose(molecule.dipole_debye, turn @ DIPOLE, atol=2e-4)  # printed to 1e-4 D
    if polarizability:
        expected = turn @ ALPHA @ turn.T * BOHR_RADIUS_ANGSTROM**3
        assert np.allclose(molecule.polarizability_angstrom3, expected, atol=2e-5)  # coordinates to 1e-6 turn 1e-6
        assert molecule.polarizability_source


def test_gaussian_standard_orientation_holds_geometry_and_dipole(tmp_path):
    molecule = read_output(written(tmp_path, gaussian()))
    assert np.allclose(molecule.positions_angstrom, WATER, atol=1e-6)  # printed to 1e-6 Å
    assert_tensors(molecule, np.eye(3))
    assert molecule.notes == ()


def test_gaussian_polarizability_printed_in_input_axes_is_turned_to_the_standard_ones(tmp_path):
    molecule = read_output(written(tmp_path, gaussian(tensor_turn=TURN)))
    assert_tensors(molecule, np.eye(3))


def test_gaussian_polarizability_in_axes_that_nothing_settles_is_left_out_with_a_note(tmp_path):
    molecule = read_output(written(tmp_path, gaussian(tensor_turn=TURN @ TURN)))
    assert molecule.polarizability_angstrom3 is None
    assert "left out" in molecule.notes[0]


def test_gaussian_without_symmetry_has_input_axes_throughout(tmp_path):
    molecule = read_output(written(tmp_path, gaussian(standard=None, tensor_turn=TURN)))
    assert np.allclose(molecule.positions_angstrom, AXES, atol=1e-6)  # printed to 1e-6 Å
    assert_tensors(molecule, TURN)


def test_orca_tensors_share_the_axes_of_the_input(tmp_path):
    molecule = read_output(written(tmp_path, orca(), "water.out"))
    assert np.allclose(molecule.positions_angstrom, AXES, atol=1e-6)  # printed to 1e-6 Å
    assert_tensors(molecule, TURN)
    assert molecule.notes == ()


def test_psi4_outputs_give_geometry_and_moments(tmp_path):
    molecule = read_output(written(tmp_path, psi4(), "water.out"))
    assert np.allclose(molecule.positions_angstrom, AXES, atol=1e-10)  # printed to 1e-12 Å
    assert_tensors(molecule, TURN, polarizability=False)
    assert molecule.notes == ()


def test_dipole_of_an_ion_refers_to_the_centre_of_mass(tmp_path):
    molecule = read_output(written(tmp_path, gaussian(charge=1, polar=False)))
    expected = DIPOLE - DEBYE_PER_E_ANGSTROM * molecule.centre_of_mass_angstrom  # Gaussian's origin is that of its axes
    assert molecule.charge == 1
    assert np.allclose(molecule.dipole_debye, expected, atol=2e-4)  # printed to 1e-4 D


def test_dipole_of_an_orca_ion_refers_to_the_origin_that_is_printed(tmp_path):
    molecule = read_output(written(tmp_path, orca(charge=-1)))
    origin = np.array([15.999, 1.008, 1.008]) @ AXES / 18.015  # with average masses, 5e-5 Å from the isotopes' centre
    expected = TURN @ DIPOLE + DEBYE_PER_E_ANGSTROM * (molecule.centre_of_mass_angstrom - origin)
    assert np.allclose(molecule.dipole_debye, expected, atol=1e-5)  # the origin is printed to 1e-6 bohr


def test_tensors_of_another_geometry_than_the_last_are_left_out(tmp_path):
    step = table("Standard orientation:", WATER * 1.002)  # 2e-3 Å: more than a tensor may be off, constants by 0.4 %
    ending = " Normal termination"
    text = gaussian(polar=False).replace(ending, step + ending)
    molecule = read_output(written(tmp_path, text))
    assert molecule.dipole_debye is None
    assert "another geometry" in molecule.notes[0]


def test_isotopes_are_those_of_the_masses_printed(tmp_path):
    properties = (
        " Isotopes and Nuclear Properties:\n AtmWgt=  15.9949146   1.0078250   2.0141018\n Leave Link  101 at now\n"
    )
    text = gaussian(polar=False).replace(" Charge =", properties + " Charge =", 1)
    molecule = read_output(written(tmp_path, text))
    assert molecule.mass_numbers == (16, 1, 2)
    assert "printed constants" in molecule.notes[0]  # those in the text are of H2O


def test_constants_that_are_not_those_of_the_geometry_are_noted(tmp_path):
    a, b, c = constants_mhz(WATER) / 1e3
    slightly = gaussian(ghz=f"{a * (1 + 5e-5):.7f} {b:.7f} {c:.7f}")
    clearly = gaussian(ghz=f"{a * (1 + 2e-4):.7f} {b:.7f} {c:.7f}")
    assert read_output(written(tmp_path, slightly)).notes == ()
    (note,) = read_output(written(tmp_path, clearly)).notes
    assert "2.0e-04 apart" in note


def test_average_masses_of_the_program_show_in_the_constants(tmp_path):
    (note,) = read_output(written(tmp_path, orca(masses=(15.999, 1.008, 1.008)))).notes
    assert "they agree with the masses that ORCA used" in note


def test_linear_molecule_whose_a_is_asterisks(tmp_path):
    carbonyl = np.array([[0, 0, 0.6], [0, 0, -0.528], [0, 0, 1.7]])
    b = constants_mhz(carbonyl)[-1] / 1e3
    text = gaussian(standard=carbonyl, inputs=None, ghz=f"************ {b:.7f} {b:.7f}", polar=False)
    assert read_output(written(tmp_path, text)).notes == ()
    (note,) = read_output(written(tmp_path, text.replace(f"{b:.7f}", f"{1.001 * b:.7f}"))).notes
    assert "1.0e-03 apart" in note


@pytest.mark.parametrize(
    ("old", "new", "rule"),
    [
        ("    0.757200", "************", "asterisks"),
        ("    0.757200", "  0.7572D+00", "D exponent"),
        ("          1.8000", "        1.80D+00", "D exponent"),
    ],
)
def test_unreadable_numbers_are_refused_with_their_line(tmp_path, old, new, rule):
    text = gaussian()
    assert text.count(old) == 1
    line = text[: text.index(old)].count("\n") + 1
    with pytest.raises(ValueError, match=rf"line {line}: .*{rule}"):
        read_output(written(tmp_path, text.replace(old, new)))


def test_every_cut_is_refused(tmp_path):
    lines = gaussian().splitlines()
    for stop in range(2, len(lines) - 1):
        with pytest.raises(ValueError, match=rf"line {stop}: the file ends without"):
            read_output(written(tmp_path, "\n".join(lines[:stop]) + "\n"))


def test_second_job_that_was_cut_is_refused_although_the_first_ended(tmp_path):
    lines = gaussian().splitlines(keepends=True)
    for rest in (lines[:20], lines[:2], [" Link1:  Proceeding to internal job step number  2.\n"]):
        with pytest.raises(ValueError, match="ends without 'Normal termination of Gaussian'"):
            read_output(written(tmp_path, gaussian() + "".join(rest)))


def mopac(ending: str) -> str:
    rows = "".join(
        f"{i + 1:6d}   {s}   {x:14.8f}  *  {y:14.8f}  *  {z:14.8f}  *\n"
        for i, (s, (x, y, z)) in enumerate(zip(SYMBOLS, WATER, strict=True))
    )
    head = "  NO.       ATOM         X             Y             Z\n NUMBER   SYMBOL    (ANGSTROMS)   (ANGSTROMS)   (ANGSTROMS)\n"
    return f" ** MOPAC2016 **\n\n{head}\n{rows}\n{ending}\n"


def test_of_another_program_the_geometry_alone_and_no_cut_file(tmp_path):
    molecule = read_output(written(tmp_path, mopac("== MOPAC DONE ==")))
    assert np.allclose(molecule.positions_angstrom, WATER, atol=1e-7)  # printed to 1e-8 Å
    assert molecule.dipole_debye is None
    with pytest.raises(ValueError, match=r"line 8: MOPAC does not report a normal end"):
        read_output(written(tmp_path, mopac("")))


def test_reader_hands_outputs_over_and_tells_what_cclib_would_add(tmp_path, monkeypatch):
    path = written(tmp_path, gaussian())
    assert_tensors(read_molecule(str(path)), np.eye(3))
    assert read_molecule(path).name == "water"
    monkeypatch.setattr("rotor.molecules.readers.read.has_cclib", lambda: False)
    monkeypatch.setattr("rotor.molecules.readers.quantum_chemistry.has_cclib", lambda: False)
    with pytest.raises(ValueError, match=r"molrotor\[qc\]"):
        read_output(path)
    molecule = read_molecule(path)  # by ASE, which has the geometry
    assert np.allclose(molecule.positions_angstrom, WATER, atol=1e-6) or np.allclose(
        molecule.positions_angstrom, AXES, atol=1e-6
    )  # printed to 1e-6 Å
    assert "molrotor[qc]" in molecule.notes[-1]


def test_a_log_of_no_program_stays_with_ase(tmp_path):
    with pytest.raises(ValueError, match="no structure in it"):
        read_molecule(written(tmp_path, "nothing to see\n"))


# What the output says of itself


def test_coordinates_in_another_unit_are_refused(tmp_path):
    """A trajectory of Gaussian prints its geometries in bohr; read as Å they give constants 3.57 times too small."""
    text = gaussian(standard=WATER / BOHR_RADIUS_ANGSTROM, inputs=None, polar=False)
    with pytest.raises(
        ValueError, match=r"printed constants .* MHz, from the geometry .* 257.\d% apart: its coordinates are in bohr"
    ):
        read_output(written(tmp_path, text))
    with pytest.raises(ValueError, match=r"0.6% apart: it is another geometry, or in another unit; give an xyz file"):
        read_output(written(tmp_path, gaussian(standard=WATER * 1.003, inputs=None, polar=False)))


def test_constants_printed_with_few_digits_are_no_alarm(tmp_path):
    """Psi4 prints five decimals of cm⁻¹: of a heavy molecule that is three digits, and they need agree to no more."""
    heavy = WATER * 30
    a, b, c = constants_mhz(heavy) / MHZ_PER_CM
    assert c < 0.011
    a0, b0, c0 = constants_mhz(WATER) / MHZ_PER_CM
    old = f"A = {a0:11.5f}  B = {b0:11.5f}  C = {c0:11.5f} [cm^-1]"
    text = psi4(heavy)
    assert old in text
    rounded = text.replace(old, f"A = {a:11.5f}  B = {b:11.5f}  C = {c:11.5f} [cm^-1]")
    assert read_output(written(tmp_path, rounded, "water.out")).notes == ()
    off = text.replace(old, f"A = {a:11.5f}  B = {b:11.5f}  C = {c * 1.003:11.5f} [cm^-1]")
    (note,) = read_output(written(tmp_path, off, "water.out")).notes
    assert "is the geometry the last one?" in note


def test_average_masses_of_a_heavy_isotope_mixture_are_no_other_geometry(tmp_path):
    """ORCA's averages move the constants of Cl2 by 1.4 %, which is no reason to refuse."""
    averages = constants_mhz(WATER, (15.999 * 1.02, 1.008, 1.008))  # printed constants 2 % off by nothing but geometry
    with pytest.raises(ValueError, match="another geometry"):
        read_output(written(tmp_path, gaussian(ghz=" ".join(f"{x * 1.02 / 1e3:.7f}" for x in averages), polar=False)))
    used = constants_mhz(WATER, (15.999, 1.008, 1.008))
    (note,) = read_output(written(tmp_path, gaussian(ghz=" ".join(f"{x / 1e3:.7f}" for x in used), polar=False))).notes
    assert "they agree with the masses that Gaussian used" in note


EXCITED = """ The electronic state is 1-A1.
 Alpha  occ. eigenvalues --  -20.55000  -1.34000  -0.70000  -0.57000  -0.50000
 Alpha virt. eigenvalues --    0.20000   0.30000
 Excitation energies and oscillator strengths:

 Excited State   1:      Singlet-B1     8.6 eV  144.0 nm  f=0.0200
            Population analysis using the CI density.
 Dipole moment (field-independent basis, Debye):
    X=                0.0000    Y=                0.0000    Z=                0.0540  Tot=                0.0540
"""


def test_the_dipole_of_an_excited_density_is_not_taken(tmp_path):
    """CIS after SCF: the dipole of the ground state is there too, and is the one; alone, it is left out."""
    ending = " Normal termination"
    both = gaussian(polar=False).replace(ending, EXCITED + ending)
    molecule = read_output(written(tmp_path, both))
    assert molecule.dipole_debye == pytest.approx(DIPOLE, abs=1e-4)  # as printed
    alone = gaussian(polar=False)
    start = alone.index(" Dipole moment (field")
    alone = alone[:start] + EXCITED + alone[alone.index(ending) :]
    molecule = read_output(written(tmp_path, alone))
    assert molecule.dipole_debye is None
    assert "is of an excited density, and none is of the ground state: left out" in molecule.notes[0]
    ground = gaussian(polar=False).replace(ending, EXCITED.replace("CI density", "MP2 density") + ending)
    assert read_output(written(tmp_path, ground)).dipole_debye == pytest.approx([0, 0, 0.054], abs=1e-4)


@pytest.mark.parametrize(
    ("block", "excited"),
    [
        ("DIPOLE MOMENT\n---\n\nMethod             : SCF\nType of density    : Electron Density", False),
        ("DIPOLE MOMENT\n---\n\nMethod             : CIS\nType of density    : Electron Density", True),
        ("DIPOLE MOMENT\n---\n\nMethod             : MP2\nType of density    : Electron Density", False),
        ("TD-DFT relaxed density of state 1\n\nDIPOLE MOMENT\n---\n   X   Y   Z", True),
        ("SCF density\n\nDIPOLE MOMENT\n---\n   X   Y   Z", False),
    ],
)
def test_orca_says_which_method_a_dipole_is_of(block, excited):
    text = f"   O   R   C   A\n{block}\nTotal Dipole Moment    :   0.1  0.2  0.3\n"
    output = Output("x.out", tuple(text.splitlines()), detect_program(text))
    (start,) = dipole_lines(output)
    assert is_excited(output, start) is excited
    assert printed_dipole(output, start) == pytest.approx(
        np.array([0.1, 0.2, 0.3]) * DEBYE_PER_AU, rel=1e-12
    )  # round-off
