"""Rotation about a bond: geometry and reduced moment, levels, scans, hindered-rotor thermodynamics."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import i0e, mathieu_a, mathieu_b

import rotor
from rotor import units
from rotor.molecules.bond_rotation import bond_rotation
from rotor.molecules.bond_scan import mmff_calculator, relaxed_scan
from rotor.molecules.molecule import Molecule
from rotor.molecules.optimise import ase_atoms
from rotor.molecules.readers.read import read_molecule
from rotor.quantum.bond_torsion import BondTorsion, FourierSeries, most_harmonics
from rotor.quantum.torsion import torsional_states
from rotor.thermodynamics.functions import GAS_CONSTANT
from rotor.thermodynamics.torsion.hindered_rotor import METHODS, hindered_rotor_functions
from rotor.thermodynamics.torsion.request import TorsionRequest, answer_torsion
from rotor.tops.top import Top

F, V3 = 160e3, 3e7  # MHz: a methyl group with 1000 cm⁻¹
CM = units.MHZ_PER_CM


def threefold(v3: float, f: float = F) -> BondTorsion:
    return BondTorsion(FourierSeries(f), FourierSeries(v3 / 2, np.array([3]), np.array([-v3 / 2]), np.zeros(1)), 3)


def lowest(torsion: BondTorsion, species: int, count: int) -> np.ndarray:
    return torsion.states(species, 300)[0][:count]


def top_of(name: str) -> Top:
    return Top.from_molecule(read_molecule(name))


# geometry and kinetic energy


@pytest.mark.parametrize(
    ("name", "bond"), [("SMILES:CC=O", "1-2"), ("SMILES:OO", "1-2"), ("SMILES:CCCC", "2-3"), ("SMILES:C(Cl)CO", "1-3")]
)
def test_the_reduced_moment_is_least_kinetic_energy(name, bond):
    """½ I_r α'² is the least kinetic energy at a given α' over all translations and rotations of the whole: minimised here atom by atom."""
    molecule = read_molecule(name)
    rotation = bond_rotation(molecule, bond)
    x, roots = molecule.positions_angstrom, np.sqrt(molecule.masses_u)[:, None]
    step = 1e-6
    turning = (rotation.turned(step).positions_angstrom - rotation.turned(-step).positions_angstrom) / (2 * step)
    rigid = [np.tile(axis, (len(x), 1)) for axis in np.eye(3)] + [np.cross(axis, x) for axis in np.eye(3)]
    design = np.array([(roots * motion).ravel() for motion in rigid]).T
    target = (roots * turning).ravel()
    rest = target - design @ np.linalg.lstsq(design, target, rcond=None)[0]
    assert rotation.reduced_moment() == pytest.approx(rest @ rest, rel=1e-9)  # central differences of step 1e-6


def test_the_reduced_moment_does_not_depend_on_which_side_turns_nor_on_the_frame():
    molecule = read_molecule("SMILES:C(Cl)CO")
    moved = molecule.moved([[0, 0, 1], [1, 0, 0], [0, 1, 0]], (1.0, -2.0, 3.0))
    moments = [
        bond_rotation(one, bond).reduced_moment()
        for one, bond in ((molecule, "1-3"), (molecule, "3-1"), (moved, "1-3"))
    ]
    assert moments == pytest.approx([moments[0]] * 3, rel=1e-12)  # round-off


def test_two_equal_coaxial_tops_have_half_the_moment_of_one():
    rotation = bond_rotation(read_molecule("C2H6"), "1-2")
    x, axis = rotation.molecule.positions_angstrom, np.array([0.0, 0.0, 1.0])
    arms = x[rotation.top] - np.outer(x[rotation.top] @ axis, axis)
    own = rotation.molecule.masses_u[rotation.top] @ np.sum(arms**2, axis=1)
    assert rotation.reduced_moment() == pytest.approx(own / 2, rel=1e-6)  # the g2 geometry has seven digits


def test_the_reduced_moment_of_a_methyl_group_is_that_of_rho_and_lambda():
    from rotor.molecules.bonds import bonded_atoms
    from rotor.quantum.estimates.methyl_groups import methyl_groups

    molecule = read_molecule("SMILES:CC=O")
    group = methyl_groups(molecule, bonded_atoms(molecule))[0]
    f = units.ROTATIONAL_MHZ_U_ANGSTROM2 / bond_rotation(molecule, "1-2").reduced_moment()
    assert f == pytest.approx(
        group.rotor.f_mhz, rel=0.01
    )  # the axis is the C-C bond here, that of the three hydrogens there


@pytest.mark.parametrize(
    ("name", "bond", "isotopes", "number"),
    [("C2H6", "1-2", None, 3), ("C2H6", "1-2", {3: "2H"}, 3), ("SMILES:CC=O", "2-1", None, 3), ("SMILES:OO", "1-2", None, 1),
     ("SMILES:Cc1ccccc1", "1-2", None, 6), ("SMILES:CCCC", "2-3", None, 1)],
)  # fmt: skip
def test_symmetry_numbers(name, bond, isotopes, number):
    molecule = read_molecule(name)
    molecule = molecule if isotopes is None else molecule.with_isotopes(isotopes)
    assert (
        bond_rotation(molecule, bond).symmetry_number() == number
    )  # CH2D-CH3: the other group has its three positions


def test_an_isotope_in_both_groups_leaves_no_symmetry():
    molecule = read_molecule("C2H6").with_isotopes({3: "2H", 6: "2H"})
    rotation = bond_rotation(molecule, "1-2")
    assert (rotation.symmetry_number(), rotation.symmetry_number(isotopes=False)) == (1, 3)


@pytest.mark.parametrize(
    ("name", "bond", "words"),
    [
        ("C2H6", "1_2", "'1_2': expected two atom numbers, such as 1-2"),
        ("C2H6", "1-9", "'1-9': expected two different atoms of C2H6, which has atoms 1 to 8"),
        ("C2H6", "2-2", "'2-2': expected two different atoms"),
        ("C2H6", "3-6", "atoms 3 (H) and 6 (H) are not bonded: "),
        ("C2H6", "1-3", "atom 3 (H) is bonded to no other atom"),
        ("SMILES:C1CCCCC1", "1-2", "the bond is part of a ring"),
        ("SMILES:CC#C", "1-2", "all atoms behind atom 2 lie on the line of the bond (a linear group)"),
    ],
)
def test_bonds_about_which_nothing_turns(name, bond, words):
    with pytest.raises(ValueError, match=r"^bond: ") as caught:
        TorsionRequest(top_of(name), bond)
    assert words in str(caught.value)


def test_two_methyl_groups_turn_about_the_line_of_a_triple_bond():
    assert bond_rotation(read_molecule("SMILES:CC#CC"), "2-3").symmetry_number() == 3


# levels


def test_levels_without_a_barrier_are_those_of_a_free_rotor():
    free = BondTorsion(FourierSeries(F), FourierSeries(0.0), 3)
    levels = np.concatenate([lowest(free, s, 3) for s in range(3)])
    assert np.sort(levels) == pytest.approx(F * np.array([0, 1, 1, 4, 4, 9, 9, 16, 16]), abs=1e-6)  # F m²; MHz of 1e6


@pytest.mark.parametrize("v3", [1e5, 3e6, 3e7])
def test_mathieu_characteristic_values(v3):
    """With 2z = 3α: y'' + (a - 2q cos 2z) y = 0, E = 9F a/4 + V3/2, |q| = V3/9F; A: even multiples of z, E: characteristic exponent ±2/3.

    scipy has integer orders: a_0, b_2, a_2, b_4, ... of period π in z are the levels of A.
    """
    q = v3 / (9 * F)
    expected = sorted([mathieu_a(0, q), mathieu_b(2, q), mathieu_a(2, q), mathieu_b(4, q), mathieu_a(4, q)])
    levels = lowest(threefold(v3), 0, 5)
    assert (levels - v3 / 2) * 4 / (9 * F) == pytest.approx(expected, rel=1e-9, abs=1e-8)  # scipy's have ten digits


def test_high_barriers_reach_the_harmonic_limit():
    """E_v = hν (v + ½) - 9F/16 (2v² + 2v + 1) of the quartic term to first and the cubic-free second order; hν = 3√(V3 F)."""
    v3, v = 1e11, np.arange(3)
    expected = 3 * math.sqrt(v3 * F) * (v + 0.5) - 9 * F / 16 * (2 * v**2 + 2 * v + 1)
    levels = lowest(threefold(v3), 1, 3)
    assert levels == pytest.approx(expected, abs=F * F**0.5 * 50 / v3**0.5)  # the next order is about F √(F/V3)


def test_constant_f_is_the_problem_of_one_angle():
    barriers = {3: V3, 6: -2e5}
    torsion = BondTorsion(FourierSeries(F), FourierSeries.from_barriers(barriers), 3)
    for species in range(3):
        other = torsional_states(F, barriers, np.zeros(1), species, 30)[0][0, :5] - torsion.foot_mhz
        assert lowest(torsion, species, 5) == pytest.approx(other, abs=1e-5)  # round-off of 1e9 MHz


def test_a_moment_that_changes_by_finite_differences():
    """H = p F p + V on a grid: -(F_{i+1/2}(ψ_{i+1} - ψ_i) - F_{i-1/2}(ψ_i - ψ_{i-1}))/h² + V ψ, extrapolated in h²."""
    kinetic = FourierSeries(1.0, np.array([1, 2]), np.array([0.3, 0.0]), np.array([0.0, 0.1]))
    potential = FourierSeries(0.0, np.array([1, 2, 3]), np.array([2.0, -1.0, 5.0]), np.array([0.5, 0.0, 0.0]))
    torsion = BondTorsion(kinetic, potential)

    def levels(count: int) -> np.ndarray:
        h = 2 * np.pi / count
        angles = h * np.arange(count)
        half = kinetic.values(angles + h / 2) / h**2
        matrix = np.diag(potential.values(angles) - torsion.foot_mhz + half + np.roll(half, 1))
        for i in range(count):
            matrix[i, (i + 1) % count] = matrix[(i + 1) % count, i] = -half[i]
        return np.linalg.eigvalsh(matrix)[:6]

    fine, coarse = levels(800), levels(400)
    assert lowest(torsion, 0, 6) == pytest.approx((4 * fine - coarse) / 3, abs=2e-5)  # the next order, h⁴ E''


def test_two_wells_tunnel():
    """The two forms of H2O2, mirror images, are one doublet below the barrier between them; above it there is none."""
    answer = answer_torsion(TorsionRequest(top_of("SMILES:OO"), "1-2", vmax=1))
    split, energies = answer.levels.splitting_mhz, answer.levels.energy_cm
    assert answer.torsion.fold == 1
    assert len(answer.torsion.wells()) == 2
    assert np.isnan(split[[0, 2, 3]]).all()
    assert split[1] == pytest.approx((energies[1] - energies[0]) * CM, rel=1e-9)
    assert energies[0] * CM < answer.torsion.lowest_barrier_mhz < energies[1] * CM


def test_wave_functions_are_normal_and_solve_the_equation():
    answer = answer_torsion(TorsionRequest(top_of("C2H6"), "1-2", "V3=1013 cm-1", vmax=2))
    angles = 2 * np.pi * np.arange(720) / 720
    psi = answer.wave_functions(angles)
    overlap = psi.T @ psi * 2 * np.pi / 720
    assert np.diag(overlap) == pytest.approx(1, abs=1e-9)  # round-off
    assert overlap - np.diag(np.diag(overlap)) == pytest.approx(0, abs=1e-9)
    waves = np.fft.fftfreq(720, 1 / 720)
    second = np.fft.ifft(-(waves[:, None] ** 2) * np.fft.fft(psi, axis=0), axis=0).real
    f = units.ROTATIONAL_MHZ_U_ANGSTROM2 / answer.rotation.reduced_moment()
    v = 0.5 * 1013 * CM * (1 - np.cos(3 * angles))
    left = -f * second + v[:, None] * psi
    assert left == pytest.approx(answer.levels.energy_cm * CM * psi, abs=1.0)  # MHz of 1e7: F is constant to 1e-8


# scans


def test_mmff_forces_are_the_slope_of_its_energy_along_a_path():
    molecule = read_molecule("SMILES:CC=O")
    atoms = ase_atoms(molecule)
    atoms.calc = mmff_calculator(molecule)
    rng, start = np.random.default_rng(3), atoms.get_positions()
    for _ in range(3):  # each at another geometry: nothing is left of the last one
        place, way = start + 0.05 * rng.normal(size=start.shape), rng.normal(size=start.shape)
        energies = []
        for step in (1e-4, -1e-4):
            atoms.set_positions(place + step * way)
            energies.append(atoms.get_potential_energy())
        atoms.set_positions(place)
        assert -np.sum(atoms.get_forces() * way) == pytest.approx((energies[0] - energies[1]) / 2e-4, rel=1e-5)


def test_a_relaxed_scan_is_even_where_the_molecule_has_a_plane():
    scan = relaxed_scan(bond_rotation(read_molecule("SMILES:CC=O"), "1-2"))
    series = FourierSeries.fitted(scan.angles, scan.energies_cm, 3, 4)
    assert np.abs(series.sines).max() < 0.01 * np.abs(series.cosines).max()  # the input is planar to about a degree
    assert abs(scan.closure_cm) < 0.1  # of forces of 5e-4 eV/Å
    assert len(scan.angles) == 12


@pytest.mark.parametrize(
    ("smiles", "bond", "even"),
    [("CCCC", "2-3", True), ("CC=O", "1-2", True), ("OO", "1-2", True), ("CC(F)Cl", "1-2", False)],
)
def test_planes_of_both_parts_make_the_potential_even(smiles, bond, even):
    rotation = bond_rotation(read_molecule(f"SMILES:{smiles}"), bond)
    about = rotation.mirror_angle()
    assert (about is not None) == even
    if about is not None:  # both hands of a turn have the same distances between atoms
        turned = [rotation.turned(about + sign * 0.7).positions_angstrom for sign in (1, -1)]
        lengths = [np.sort(np.linalg.norm(x[:, None] - x, axis=-1), axis=None) for x in turned]
        assert np.abs(lengths[0] - lengths[1]).max() < 0.1  # the geometry is symmetric to some 0.03 Å


def test_both_gauche_wells_of_difluoroethane_are_alike():
    answer = answer_torsion(TorsionRequest(top_of("SMILES:FCCF"), "2-3"))
    wells = sorted(well.energy_mhz for well in answer.torsion.wells())
    assert len(wells) == 3
    assert wells[1] - wells[0] < 1e-9 * wells[2]  # gauche is below anti here; of a series without odd terms


@pytest.mark.slow
def test_a_peptide_bond_turns_instead_of_bending(monkeypatch):
    """N-methylacetamide: 20 kcal/mol, and every angle of the turn; with one dihedral angle fixed alone nitrogen bends and snaps over."""
    rotation = bond_rotation(read_molecule("SMILES:CNC(C)=O"), "2-3")
    scan = relaxed_scan(rotation, points=12)
    assert 6500 < scan.energies_cm.max() < 7700
    assert np.diff(scan.angles).max() == pytest.approx(math.radians(30), abs=1e-3)
    monkeypatch.setattr(type(rotation), "opposite_atoms", lambda self: None)
    bent = relaxed_scan(rotation, points=12)
    assert np.diff(bent.angles).max() > math.radians(45)
    assert bond_rotation(read_molecule("C2H6"), "1-2").opposite_atoms() is None


def test_a_series_has_no_more_terms_than_the_widest_gap_resolves():
    even = np.arange(12) * math.pi / 6
    assert most_harmonics(even, 1) == 4
    assert most_harmonics(even / 3, 3) == 4
    assert most_harmonics(np.delete(even, [5, 6, 7]), 1) == 1  # a gap of 120 degrees


def test_a_scan_of_an_ase_calculator_object_is_that_of_its_name():
    top = top_of("SMILES:OO")
    by_name = answer_torsion(TorsionRequest(top, "1-2", points=12))
    by_object = answer_torsion(TorsionRequest(top, "1-2", mmff_calculator(top.molecule), points=12))
    assert by_object.levels.energy_cm.tolist() == by_name.levels.energy_cm.tolist()
    assert by_object.source.startswith("relaxed scan with Mmff94")


def test_the_table_has_the_barrier_of_acetaldehyde():
    answer = answer_torsion(TorsionRequest(top_of("SMILES:CC=O"), "1-2", "table"))
    assert answer.facts()["barrier_cm"] == pytest.approx(407.6, rel=1e-9)
    with pytest.raises(ValueError, match="potential: the table only has methyl groups"):
        TorsionRequest(top_of("SMILES:OO"), "1-2", "table")


@pytest.mark.parametrize(
    ("text", "words"),
    [("V3", "calculator 'V3' is unknown"), ("V1=3", "expected n = 3, 6"), ("V3=3 V3=4", "each once"), ("V3=x", "expected terms"),
     ("V3=3 D", "unit 'D'")],
)  # fmt: skip
def test_potentials_that_are_none(text, words):
    with pytest.raises(ValueError) as caught:
        answer_torsion(TorsionRequest(top_of("C2H6"), "1-2", text))
    assert words in str(caught.value)


# thermodynamics


def test_the_derivatives_are_those_of_ln_q():
    t, h, torsion = np.array([30.0, 150.0, 400.0, 1500.0]), 1e-4, threefold(V3)
    functions, above, below = (hindered_rotor_functions(torsion, t * scale, 3) for scale in (1.0, 1 + h, 1 - h))
    u = (above.ln_q - below.ln_q) / (math.log1p(h) - math.log1p(-h))
    rt = GAS_CONSTANT * functions.temperature_k
    assert functions.energy_j_per_mol / rt == pytest.approx(u, rel=1e-6)  # differences of h²
    assert functions.cv_over_r == pytest.approx(
        (above.energy_j_per_mol - below.energy_j_per_mol) / (2 * h * rt), abs=1e-6
    )
    assert functions.entropy_j_per_mol_k == pytest.approx(GAS_CONSTANT * (functions.ln_q + u), abs=1e-5)


def test_limits_of_the_heat_capacity():
    """R/2 of a free rotor, R of a deep well that is hot against hν, 0 at 0 K."""
    free = hindered_rotor_functions(threefold(1e-3), [300.0], 3).for_method("levels")
    assert free.cv_over_r[0] == pytest.approx(0.5, abs=1e-6)  # kT is 40 F
    deep = hindered_rotor_functions(threefold(6e9, 3e4), [10000.0], 3).for_method("levels")
    assert deep.cv_over_r[0] == pytest.approx(1.0, abs=0.03)  # first anharmonic order, kT/2V3
    cold = hindered_rotor_functions(threefold(V3), [10.0], 3).for_method("levels")
    assert cold.cv_over_r[0] < 1e-6


def test_the_classical_partition_function_of_a_cosine():
    """Q = (1/σ) √(πkT/F) exp(-V3/2kT) I_0(V3/2kT) (documentation of RMG-Py, torsional degrees of freedom)."""
    t = np.array([100.0, 300.0, 1000.0])
    kt = t * units.MHZ_PER_K
    expected = np.sqrt(np.pi * kt / F) * i0e(V3 / (2 * kt)) / 3
    functions = hindered_rotor_functions(threefold(V3), t, 3)
    assert functions.for_method("classical").ln_q == pytest.approx(np.log(expected), abs=1e-12)  # round-off
    u = 3 * math.sqrt(F * V3) / kt  # hν/kT of a well
    corrected = np.log(expected * u * np.exp(-u / 2) / (1 - np.exp(-u)))
    assert functions.for_method("Pitzer-Gwinn").ln_q == pytest.approx(
        corrected, abs=1e-9
    )  # Q_qm/Q_cl of an oscillator, from the foot


def test_every_approximation_has_its_limits():
    hot = hindered_rotor_functions(threefold(3e5, 3e4), [10000.0], 3)
    exact = hot.for_method("levels").ln_q[0]
    for name in ("classical", "Pitzer-Gwinn"):
        assert hot.for_method(name).ln_q[0] == pytest.approx(exact, abs=1e-4)  # first quantum order, (hν/kT)²/24
    free = hot.for_method("free rotor").ln_q[0]
    assert hot.for_method("tanh").ln_q[0] == pytest.approx(free, abs=0.01)  # tanh y = y - y³/3 at y = 0.07
    cold = hindered_rotor_functions(threefold(1e9), [30.0], 3)
    for name in ("harmonic", "Pitzer-Gwinn", "tanh"):
        assert cold.for_method(name).ln_q[0] == pytest.approx(
            cold.for_method("levels").ln_q[0], abs=0.2
        )  # 9F/16kT of the zero point
    assert list(dict.fromkeys(hot.method.tolist())) == list(METHODS)


def test_wells_of_different_depth_are_weighed():
    """Harmonic Q is a sum over wells: at 1000 K two wells 200 cm⁻¹ apart, written out."""
    answer = answer_torsion(
        TorsionRequest(
            top_of("SMILES:OO"), "1-2", FourierSeries.from_barriers({1: 200 * CM, 2: 2e8}), temperatures_k=(1000.0,)
        )
    )
    wells, kt = answer.torsion.wells(), 1000 * units.MHZ_PER_K
    q = sum(math.exp(-one.energy_mhz / kt) / (2 * math.sinh(one.quantum_mhz / (2 * kt))) for one in wells)
    assert len(wells) == 2
    assert answer.functions.for_method("harmonic").ln_q[0] == pytest.approx(math.log(q), rel=1e-9)


def test_a_heavy_group_is_refused():
    with pytest.raises(ValueError, match="a group this heavy is classical here"):
        hindered_rotor_functions(threefold(V3, 1.0), [1000.0], 3)


def test_a_bond_needs_a_geometry():
    with pytest.raises(ValueError, match="bond: constants alone have no bonds"):
        TorsionRequest(Top.from_constants("B=3 GHz"), "1-2")
    with pytest.raises(ValueError, match="bond: none is named"):
        TorsionRequest(Top.from_molecule(Molecule(("C", "O"), [[0, 0, 0], [0, 0, 1.13]])))


@pytest.mark.parametrize("bond", [(1, 2), [1, 2], "1-2", (np.int64(1), 2), np.array([1, 2])])
def test_a_bond_is_a_text_or_two_numbers(bond):
    answer = rotor.torsion(rotor.read("C2H6"), bond=bond, potential="V3=1013 cm-1", vmax=0)
    assert answer.facts()["bond"] == "1-2"


@pytest.mark.parametrize("bond", [(1,), (1, 2, 3), (1.0, 2), (True, 2), 12, np.array([1.0, 2.0])])
def test_what_is_no_pair_of_atoms_is_refused(bond):
    with pytest.raises(ValueError, match=r"bond: .*expected two atom numbers, such as 1-2"):
        rotor.torsion(rotor.read("C2H6"), bond=bond, potential="V3=1013 cm-1")
