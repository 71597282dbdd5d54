"""Centrifugal distortion of a force field: measured constants, a minimum found by force, a matrix diagonalised whole."""

from __future__ import annotations

import force_fields
import numpy as np
import pytest
from scipy.optimize import minimize

import rotor
from rotor.geometry.inertia import point_masses
from rotor.molecules.force_field import ForceField, force_field_from_internal
from rotor.molecules.internal_coordinates import linear_bend, stretch
from rotor.molecules.molecule import Molecule
from rotor.tops.constants.constants import Constants
from rotor.tops.distortion import MHZ_PER_EV, distortion_constants, quartic_tensor_mhz, semirigid_top, tau_mhz
from rotor.units import ROTATIONAL_MHZ_U_ANGSTROM2

QUARTICS = ("DeltaJ", "DeltaJK", "DeltaK", "deltaJ", "deltaK")


def turned_field(field: ForceField, rng: np.random.Generator) -> ForceField:
    from scipy.spatial.transform import Rotation

    r = Rotation.random(rng=rng).as_matrix()
    rotation_of_all = np.kron(np.eye(len(field.molecule.symbols)), r)
    return ForceField(
        field.molecule.moved(r, (1.0, -2.0, 0.5)), rotation_of_all @ field.hessian_ev_per_angstrom2 @ rotation_of_all.T
    )


def test_sulfur_dioxide_meets_the_measured_constants():
    constants = distortion_constants(force_fields.sulfur_dioxide(), reduction="A")
    measured = rotor.read("SO2").constants
    off = {name: abs(constants[name] / measured[name] - 1) for name in QUARTICS}
    assert max(off[name] for name in QUARTICS[:4]) < 0.03  # harmonic: 0.9, 1.7, 2.5 and 0.5 %
    assert off["deltaK"] < 0.11  # the smallest, a difference of large terms: 9.6 %


def test_two_force_fields_of_sulfur_dioxide_agree():
    """One fitted to fundamentals, one computed: the computed one is stiffer, as harmonic wavenumbers are above fundamentals."""
    fitted, computed = force_fields.sulfur_dioxide(), force_fields.sulfur_dioxide_ab_initio()
    assert computed.vibrations().wavenumbers_cm == pytest.approx([524.4, 1170.1, 1382.5], abs=0.1)  # as typed
    first, other = (distortion_constants(field, reduction="A") for field in (fitted, computed))
    for name in QUARTICS:
        assert other[name] < first[name] if first[name] > 0 else other[name] > first[name]
        assert other[name] == pytest.approx(first[name], rel=0.04), name  # 1.6, 1.5, 3.7, 1.6 and 2.1 %


def test_water_is_off_by_what_anharmonicity_does():
    constants = distortion_constants(force_fields.water(), reduction="A")
    measured = dict(zip(QUARTICS, (37.594, -172.91, 973.29, 15.210, 41.05), strict=True))  # De Lucia 1974, memory
    for name in ("DeltaJ", "DeltaJK", "deltaJ"):
        assert constants[name] == pytest.approx(measured[name], rel=0.11)  # 4.9, 10.5 and 5.6 %
    assert constants["DeltaK"] == pytest.approx(
        measured["DeltaK"], rel=0.22
    )  # the bend is soft and strongly anharmonic
    assert 0 < constants["deltaK"] < measured["deltaK"]


def test_hdo_turns_its_axes_and_changes_a_sign():
    """No scaling of H2O's constants gives the ΔJK of HDO, 34.2 MHz where H2O has -173; the force field does."""
    constants = distortion_constants(force_fields.water().with_isotopes("2=2H"), reduction="A")
    measured = dict(zip(QUARTICS, (10.838, 34.208, 377.08, 3.647, 63.087), strict=True))  # De Lucia 1971, memory
    assert constants["DeltaJK"] == pytest.approx(measured["DeltaJK"], rel=0.02)  # found 33.89
    assert constants["DeltaJ"] == pytest.approx(measured["DeltaJ"], rel=0.06)  # found 10.29
    assert constants["DeltaK"] == pytest.approx(measured["DeltaK"], rel=0.25)  # harmonic


def test_linear_molecules_have_the_closed_form():
    co = force_field_from_internal(Molecule(("C", "O"), [[0, 0, 0], [0, 0, 1.128323]]), [stretch(0, 1)], [[19.019]])
    b, w = Constants(B=distortion_constants(co)["B"])["B"], co.vibrations().wavenumbers_cm[0] * 29979.2458
    assert distortion_constants(co)["D"] == pytest.approx(4 * b**3 / w**2, rel=1e-10)  # Kratzer's relation is exact
    assert distortion_constants(co)["D"] == pytest.approx(0.18351, rel=1e-3)  # measured D of CO, MHz


def test_bends_of_a_linear_molecule_leave_d_alone():
    atoms = Molecule(("O", "C", "S"), [[0, 0, -1.1561], [0, 0, 0], [0, 0, 1.5614]])
    bends = [linear_bend(0, 1, 2, axis) for axis in ([1, 0, 0], [0, 1, 0])]
    soft, stiff = (
        force_field_from_internal(
            atoms,
            [stretch(0, 1), stretch(1, 2), *bends],
            np.diag([16.0, 7.4, bend, bend]) + 1.0 * np.eye(4)[[1, 0, 2, 3]],
        )
        for bend in (0.6, 1.2)
    )
    assert len(soft.vibrations().wavenumbers_cm) == 4  # 3n - 5
    assert distortion_constants(soft)["D"] == pytest.approx(distortion_constants(stiff)["D"], rel=1e-10)  # round-off
    assert distortion_constants(soft)["D"] == pytest.approx(
        1.3014e-3, rel=0.1
    )  # force constants rounded to a few digits


def planar_fields():
    return [force_fields.water(), force_fields.sulfur_dioxide(), force_fields.water().with_isotopes("2=2H,1=18O")]


@pytest.mark.parametrize("field", planar_fields())
def test_planar_molecules_keep_dowlings_relations(field):
    """dI_c = dI_a + dI_b, so τ_xxcc / C² = τ_xxaa / A² + τ_xxbb / B², and no τ has one c (Dowling 1961)."""
    tau = tau_mhz(field)
    a, b, c = distortion_constants(field).rigid
    for x in range(3):
        assert tau[x, x, 2, 2] / c**2 == pytest.approx(
            tau[x, x, 0, 0] / a**2 + tau[x, x, 1, 1] / b**2, rel=1e-9
        )  # round-off
    assert np.abs(tau[0, 2]).max() < 1e-9 * np.abs(tau).max()
    assert np.abs(tau[1, 2]).max() < 1e-9 * np.abs(tau).max()


def test_the_frame_of_the_input_has_no_bearing():
    rng = np.random.default_rng(5)
    for field in planar_fields():
        here = np.array(list(distortion_constants(field).values.values()))
        there = np.array(list(distortion_constants(turned_field(field, rng)).values.values()))
        assert np.allclose(here, there, rtol=1e-8, atol=1e-9 * here.max() * 1e-6)  # round-off of a rotated Hessian


def energy_at_minimum(field: ForceField, j: np.ndarray) -> float:
    """min over vibrations of V(q) + f Jᵀ I(q)⁻¹ J minus the rigid energy, MHz, with the exact inertia of moved atoms."""
    modes, stiffness = field.vibrations().modes, field.vibrations().stiffness_ev * MHZ_PER_EV
    masses, start = field.molecule.masses_u, field.molecule.positions_angstrom

    def rotation(q):
        moved = start + (modes @ (q / np.sqrt(stiffness))).reshape(-1, 3) / np.sqrt(masses)[:, None]
        return ROTATIONAL_MHZ_U_ANGSTROM2 * j @ np.linalg.solve(point_masses(masses, moved).tensor, j)

    rigid = rotation(np.zeros(len(stiffness)))
    computed = minimize(lambda q: q @ q / 2 + rotation(q) - rigid, np.zeros(len(stiffness)), tol=1e-13)
    return float(computed.fun)


@pytest.mark.parametrize("field", planar_fields())
def test_a_minimum_found_by_force_agrees(field):
    """E(J) - E_rigid(J) over J⁴ tends to Σ T_αβγδ n n n n; the J⁶ left is taken away by Richardson's step."""
    axes = rotor.Top.from_molecule(field.molecule).frame.axes
    tau = tau_mhz(field) / 4
    for n in np.random.default_rng(1).normal(size=(4, 3)):
        n = n / np.linalg.norm(n)
        expected = np.einsum("abcd,a,b,c,d->", tau, n, n, n, n)
        near, far = (energy_at_minimum(field, axes.T @ n * j) / j**4 for j in (0.7, 1.4))
        assert (4 * near - far) / 3 == pytest.approx(expected, rel=1e-5)  # J⁸ terms and the minimiser's tolerance


def whole_matrices(rigid, tensor, j):
    """Σ B J² + Σ T_αβγδ JαJβJγJδ on |J K⟩ with the commutators of the molecular frame."""
    k = np.arange(-j, j + 1)
    up = np.diag(np.sqrt(j * (j + 1) - k[:-1] * (k[:-1] + 1.0)), 1)  # ⟨k|Jx + i Jy|k+1⟩: J₊ lowers K in the body
    jx, jy, jz = (up + up.T) / 2, (up - up.T) / 2j, np.diag(k)
    axes = np.array([jx, jy, jz], dtype=complex)
    products = np.einsum("aij,bjk->abik", axes, axes)
    quartic = np.einsum("abcd,abij,cdjk->ik", tensor, products, products)
    return np.einsum("a,aaij->ij", rigid, products), (quartic + quartic.conj().T) / 2


@pytest.mark.parametrize(
    ("reduction", "representation"), [("A", "Ir"), ("S", "Ir"), ("S", "IIIl"), ("A", "IIr"), ("A", "Il")]
)
def test_the_levels_of_the_unreduced_hamiltonian_come_back(reduction, representation):
    """Levels of ε T in full are those of the reduced constants to order ε², once A, B, C take up the order of operators."""
    field = force_fields.water().with_isotopes("2=2H")
    full = distortion_constants(field, reduction=reduction, representation=representation)
    rigid, tensor = np.array(full.rigid), tau_mhz(field) / 4
    worst = []
    for epsilon in (1e-2, 1e-3):
        scaled = full.replace(**{n: v * epsilon for n, v in full.values.items() if n not in "ABC"})
        ours = rotor.api.solve_levels(rotor.Top.from_constants(scaled), 6)
        computed = {j: np.sort(ours.energy_mhz[ours.quanta["j"] == j]) for j in range(1, 7)}
        rows, misses = [], []
        for j in range(1, 7):
            plain, quartic = whole_matrices(rigid, tensor, j)
            energies, states = np.linalg.eigh(plain + epsilon * quartic)
            misses.append(energies - computed[j])
            slopes = [whole_matrices(item, 0 * tensor, j)[0] for item in np.eye(3)]
            rows.append(np.array([np.einsum("ki,kl,li->i", states.conj(), s, states).real for s in slopes]).T)
        design, miss = np.concatenate(rows), np.concatenate(misses)
        shift = np.linalg.lstsq(design, miss, rcond=None)[0]
        assert np.abs(shift).max() < 20 * epsilon * np.abs(tensor).max()  # operator order: some quartic constants
        worst.append(np.abs(miss - design @ shift).max())
    assert worst[0] < 1e-3 * 1e-2 * np.abs(tensor).max() * 6**4
    assert np.log10(worst[0] / worst[1]) == pytest.approx(2, abs=0.2)  # second order in ε


def test_near_symmetric_tops_refuse_the_a_reduction():
    field = force_fields.bent_field(("S", "O", "O"), 1.4308, 119.32, 10, 0, 0, 0.8, "invented")
    with pytest.raises(ValueError, match="'A' and 'S'"):
        distortion_constants(field, reduction="B")
    from rotor.tops.distortion import reduced

    with pytest.raises(ValueError, match="reduction='S'"):
        reduced(quartic_tensor_mhz(field), np.array([9.0, 4.0, 4.0]), (1, 2, 0), "A")


def test_a_semirigid_top_says_where_its_distortion_is_from():
    top = semirigid_top(force_fields.sulfur_dioxide(), reduction="A")
    assert top.constants["DeltaJ"] > 0
    assert any("harmonic force field (Polo and Wilson 1954)" in note for note in top.notes)
