"""Centrifugal distortion of H2O, H2CO and CH3OH against two other programs, from the same Hessians.

The measured constants of water are no test of this theory: ΔK of the ground state is 28 % above the harmonic one, and δK
nearly four times it, in every good force field.
"""

from __future__ import annotations

import json

import force_fields
import numpy as np
import pytest
from places import ORACLES

import rotor
from rotor.molecules.force_field import ForceField, Vibrations, read_hessian
from rotor.molecules.molecule import Molecule
from rotor.tops.distortion import MHZ_PER_EV, distortion_constants, quartic_tensor_mhz, tau_mhz
from rotor.tops.inertial_defect import (
    coriolis_zeta,
    harmonic_correction_u_angstrom2,
    inertia_by_modes,
    inertial_defect_u_angstrom2,
)
from rotor.units import BOHR_RADIUS_ANGSTROM, MHZ_PER_CM, ROTATIONAL_MHZ_U_ANGSTROM2

FOLDER = ORACLES / "spectro"
SPECTRO = json.loads((FOLDER / "spectro.json").read_text(encoding="utf-8"))
TOO_MUCH = 3.833384078e4 / (
    8 * (ROTATIONAL_MHZ_U_ANGSTROM2 / MHZ_PER_CM) ** 3
)  # SPECTRO's factor of τ over the right one
PAIRS = {"aa": (0, 0), "bb": (1, 1), "cc": (2, 2), "ab": (0, 1), "ac": (0, 2), "bc": (1, 2)}


def field_of(name: str) -> ForceField:
    case = SPECTRO[name]
    molecule = Molecule(tuple(case["symbols"]), BOHR_RADIUS_ANGSTROM * np.array(case["positions_bohr"]))
    return read_hessian(FOLDER / f"{name}.hessian", molecule)


class Unprojected(ForceField):
    """The modes as SPECTRO takes them: the 3n - 6 stiffest of the whole Hessian, rotations mixed in."""

    def vibrations(self) -> Vibrations:
        roots = np.sqrt(np.repeat(self.molecule.masses_u, 3))
        stiffness, modes = np.linalg.eigh(self.hessian_ev_per_angstrom2 / np.outer(roots, roots))
        return Vibrations(super().vibrations().wavenumbers_cm, modes[:, 6:], stiffness[6:], 0.0)


@pytest.mark.parametrize("name", ["h2o", "h2co"])
def test_wavenumbers_are_those_that_spectro_prints(name):
    assert field_of(name).vibrations().wavenumbers_cm == pytest.approx(SPECTRO[name]["wavenumbers_cm"], abs=0.006)


@pytest.mark.parametrize("reduction", ["A", "S"])
def test_water_has_the_constants_that_spectro_prints(reduction):
    constants = distortion_constants(field_of("h2o"), reduction=reduction, representation="Ir")
    for name, value in SPECTRO["h2o"][reduction].items():
        # masses and bohr of 1973 in one, of 2022 in the other: 1.2e-6
        assert TOO_MUCH * constants[name] == pytest.approx(value, rel=2e-6), name


@pytest.mark.parametrize("name", ["h2o", "h2co"])
def test_tau_are_those_that_spectro_prints(name):
    """All of H2O's, and of H2CO's all but τ′_aabb, which its modes, mixed with a rotation, change by 6e-4."""
    tensor = 4 * TOO_MUCH * quartic_tensor_mhz(field_of(name))
    for pair, value in SPECTRO[name]["tau_prime"].items():
        within = 6e-4 if (name, pair) == ("h2co", "ab") else 3e-6  # constants of 1973; 10 decimals of τ in cm⁻¹
        assert tensor[PAIRS[pair]] == pytest.approx(value, rel=within), pair


def test_the_one_that_differs_is_spectros_mixture_of_modes():
    """With SPECTRO's own modes and its sum Σ √m r_a l_b, which is symmetric in Eckart's frame alone, τ′_aabb is its too."""
    field = field_of("h2co")
    mixed = Unprojected(field.molecule, field.hessian_ev_per_angstrom2)
    tau, aabb = tau_mhz(mixed), SPECTRO["h2co"]["tau_prime"]["ab"]
    modes, stiffness = mixed.vibrations().modes.reshape(4, 3, -1)[:, :, [1, 5]], mixed.vibrations().stiffness_ev[[1, 5]]
    weighted = np.sqrt(field.molecule.masses_u)[:, None] * field.molecule.positions_angstrom
    along, across = weighted[:, 2] @ modes[:, 1], weighted[:, 1] @ modes[:, 2]  # z is the axis of the molecule
    assert np.abs(2 * along) == pytest.approx(
        [2.131457796, 1.304099113], rel=1e-6
    )  # its ∂I_ab/∂Q, digits of the Hessian
    share = ((2 * along) ** 2 / stiffness).sum() / ((along + across) ** 2 / stiffness).sum()
    assert TOO_MUCH * (tau[0, 0, 1, 1] + 2 * share * tau[0, 1, 0, 1]) == pytest.approx(
        aabb, rel=3e-6
    )  # constants of 1973


@pytest.mark.parametrize("reduction", ["A", "S"])
def test_formaldehyde_has_the_constants_that_spectro_prints(reduction):
    constants = distortion_constants(field_of("h2co"), reduction=reduction, representation="Ir")
    for name, value in SPECTRO["h2co"][reduction].items():
        assert TOO_MUCH * constants[name] == pytest.approx(value, rel=7e-4), name  # by the share of τ′_aabb: up to 6e-4


def test_formaldehyde_is_within_some_per_cent_of_the_measured_constants():
    """Harmonic, of an ab initio force field, against the ground state of CDMS (c030501), S reduction."""
    constants, measured = distortion_constants(field_of("h2co"), reduction="S"), rotor.read("H2CO").constants
    off = {name: abs(constants[name] / measured[name] - 1) for name in ("DJ", "DJK", "DK", "d1", "d2")}
    assert max(off["DJ"], off["DJK"]) < 0.02  # what vibration does: 1.1 and 0.7 %
    assert max(off["DK"], off["d1"]) < 0.07  # hydrogen moves: 4.5 and 6.0 %
    assert off["d2"] < 0.15  # the smallest, a difference of large terms: 14 %


def test_water_in_internal_coordinates_is_the_same_force_field():
    """SPECTRO's own force constants of H2O in r and θ: all ways to one set of constants."""
    k = SPECTRO["h2o"]["internal_mdyn_angstrom"]
    r, degrees = 0.9585819, 104.39947
    bent = force_fields.bent_field(
        ("O", "H", "H"), r, degrees, k["rr"], k["rs"], k["ra"] / r, k["aa"] / r**2, "SPECTRO, ab initio"
    )
    constants = distortion_constants(bent, reduction="A", representation="Ir")
    for name, value in SPECTRO["h2o"]["A"].items():
        assert TOO_MUCH * constants[name] == pytest.approx(value, rel=3e-5), name  # units of 1973: 1.6e-5 in mdyn/Å


def test_what_parts_water_from_the_measured_constants_is_not_the_force_field():
    """A fitted force field of 1965 and an ab initio one agree where the measured constants are far away."""
    fitted = distortion_constants(force_fields.water(), reduction="A")
    for name, value in SPECTRO["h2o"]["A"].items():
        assert fitted[name] == pytest.approx(value, rel=0.08), name  # two force fields: at most 3.6 %, δK 7.8 %
    assert 973.29 / fitted["DeltaK"] > 1.2
    assert 41.05 / fitted["deltaK"] > 3


def test_methanol_has_the_tau_that_gaussian_prints_along_its_axes():
    """Twelve modes, no axis fixed by symmetry but c: six τ′ along the axes of Gaussian's output, 2.6° from a and b."""
    folder = FOLDER.parent / "gaussian"
    case = json.loads((folder / "ch3oh.json").read_text(encoding="utf-8"))
    field = read_hessian(folder / "ch3oh.hessian", Molecule(tuple(case["symbols"]), case["positions_angstrom"]))
    top = rotor.Top.from_molecule(field.molecule)
    assert field.vibrations().wavenumbers_cm == pytest.approx(case["wavenumbers_cm"], abs=0.002)  # three decimals
    assert top.rotational_constants_mhz == pytest.approx(case["rigid_mhz"], rel=1e-5)  # coordinates to 1e-6 Å

    moments = np.array(top.moments_u_angstrom2)
    change = -ROTATIONAL_MHZ_U_ANGSTROM2 * inertia_by_modes(field, top)
    printed = np.diag(np.sign(np.diag(top.frame.axes))) @ top.frame.axes  # a, b, c of the top in Gaussian's axes
    change = np.einsum("ai,kab,bj->kij", printed, change, printed) / moments[:, None] / moments
    tau = -2 * np.einsum("kab,kcd,k->abcd", change, change, 1 / (field.vibrations().stiffness_ev * MHZ_PER_EV))
    assert np.degrees(np.arccos(abs(printed[0, 0]))) == pytest.approx(2.6, abs=0.05)
    for pair, value in case["tau_prime_mhz"].items():
        i, j = PAIRS[pair]
        computed = tau[i, i, j, j] + 2 * (i != j) * tau[i, j, i, j]
        assert computed == pytest.approx(value, rel=4e-6), pair  # coordinates to 1e-6 Å, constants of 2006


def test_coriolis_constants_and_inertial_defect_of_water_are_those_that_spectro_prints():
    field = field_of("h2o")
    bend, symmetric, antisymmetric = range(3)
    zeta = coriolis_zeta(field)[2]
    assert abs(zeta[antisymmetric, bend]) == pytest.approx(0.99995388, abs=1e-8)  # eight decimals
    assert abs(zeta[antisymmetric, symmetric]) == pytest.approx(0.00960432, abs=1e-8)
    assert np.abs(coriolis_zeta(field)[:2]).max() < 1e-12  # planar: about c alone
    assert inertial_defect_u_angstrom2(field) == pytest.approx(0.0458780280, rel=2e-6)  # constants of 1973


@pytest.mark.parametrize(
    ("field", "name"),
    [
        (field_of("h2o"), "H2O"),
        (field_of("h2co"), "H2CO"),
        (force_fields.sulfur_dioxide(), "SO2"),
        (force_fields.sulfur_dioxide_ab_initio(), "SO2"),
        (force_fields.water().with_isotopes("2=2H"), "HDO"),
        (force_fields.water().with_isotopes("H=2H"), "D2O"),
    ],
)
def test_inertial_defects_are_near_those_of_the_measured_constants(field, name):
    """0.046, 0.057, 0.138, 0.135, 0.052 and 0.063 u Å²; distortion and electrons add up to 0.005 to the measured ones."""
    measured = rotor.read(name).inertial_defect_u_angstrom2
    assert inertial_defect_u_angstrom2(field) == pytest.approx(measured, abs=0.005)


def test_the_moments_follow_the_sum_with_its_poles():
    """Σ α/2 as it is printed in books, mode by mode, whose poles cancel pairwise in the closed form."""
    for field in (field_of("h2co"), force_fields.water().with_isotopes("2=2H")):
        top = rotor.Top.from_molecule(field.molecule)
        w, moments, f = field.vibrations().wavenumbers_cm, top.moments_u_angstrom2, 505379.00844 / 29979.2458
        a, zeta = inertia_by_modes(field, top), coriolis_zeta(field)
        computed = harmonic_correction_u_angstrom2(field)
        for g in range(3):
            total = 0.0
            for k in range(len(w)):
                total += sum(3 * a[k, g, x] ** 2 / (4 * moments[x]) for x in range(3)) / w[k]
                others = [other for other in range(len(w)) if other != k]
                poles = [zeta[g, k, o] ** 2 * (3 * w[k] ** 2 + w[o] ** 2) / (w[k] ** 2 - w[o] ** 2) for o in others]
                total += sum(poles) / w[k]
            assert computed[g] == pytest.approx(-f * total, rel=1e-9)  # round-off of the poles


def test_no_inertial_defect_where_it_is_no_harmonic_quantity():
    folder = FOLDER.parent / "gaussian"
    case = json.loads((folder / "ch3oh.json").read_text(encoding="utf-8"))
    field = read_hessian(folder / "ch3oh.hessian", Molecule(tuple(case["symbols"]), case["positions_angstrom"]))
    with pytest.raises(ValueError, match="CH4O is not planar"):
        inertial_defect_u_angstrom2(field)
    from rotor.molecules.force_field import force_field_from_internal
    from rotor.molecules.internal_coordinates import stretch

    co = force_field_from_internal(Molecule(("C", "O"), [[0, 0, 0], [0, 0, 1.13]]), [stretch(0, 1)], [[19.0]])
    with pytest.raises(ValueError, match="CO is linear"):
        harmonic_correction_u_angstrom2(co)
