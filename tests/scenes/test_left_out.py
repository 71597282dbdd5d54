"""Sizes of what plans leave out: within a factor of 3 of the effect itself, or of what was measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from ase import Atoms
from ase import units as ase_units
from ase.build import molecule
from places import PROJECT
from scipy.stats import norm

import rotor
from rotor import units
from rotor.classical.driven import DrivenRequest, answer_driven
from rotor.classical.effects.gravity import GravityAboutPivot
from rotor.classical.numerics import step_error
from rotor.fluids.analysis import Diffusion, yeh_hummer_correction
from rotor.fluids.motion.bodies import rigid_bodies
from rotor.fluids.numerics import neglected_in_fluid
from rotor.geometry.rotations import distance
from rotor.quantum.estimates.convergence import warnings_of
from rotor.quantum.estimates.plans import stray_field
from rotor.quantum.solve import solve_levels
from rotor.requests.budget import size_text
from rotor.scenes.plan import plan_of
from rotor.scenes.run import scene_calculation
from rotor.scenes.scene import make_scene, read_scene
from rotor.spectra.widths import pressure_width

SCENES = PROJECT / "examples" / "scenes"
ATM_PER_BAR, TORR_PER_BAR = 1 / 1.01325, 760 / 1.01325
MEASURED = [  # half widths at half maximum, MHz per bar
    (
        "OCS",
        300.0,
        6.59 * TORR_PER_BAR,
    ),  # J = 6-5, Stanek, Gierszal and Galica, Acta Phys. Pol. A 84, 1027 (1993): 6.59(25) MHz/Torr
    ("CO", 296.0, 0.086 * units.MHZ_PER_CM * ATM_PER_BAR),  # gamma_self of J = 1-0 in HITRAN (tests/oracles/hitran)
]


@pytest.mark.parametrize(("name", "kelvin", "half_width"), MEASURED, ids=["OCS", "CO"])
def test_the_pressure_width(name, kelvin, half_width):
    estimated = pressure_width(rotor.read(name), kelvin, 1.0).size
    assert 1 / 3 < estimated / (2 * half_width) < 3  # the factor that is claimed


def test_widths_are_those_of_the_conditions_of_the_scene():
    """Without a pressure no width is claimed; Doppler's is that inside the range."""
    alone = pressure_width(rotor.read("OCS"), 2.0, None)
    assert alone.size is None
    assert f"{size_text(pressure_width(rotor.read('OCS'), 2.0, 1e-3).size, 'MHz')} for each mbar" in alone.basis
    scene = make_scene("spectrum", molecule="H2CO", conditions={"temperature": "30 K", "range": "100:105GHz"})
    widths = {neglected.name: neglected for neglected in plan_of(scene).left_out}
    assert "at 105000 MHz" in widths["Doppler width"].basis
    assert widths["pressure width"].size is None


def test_a_spectrum_without_widths_says_both_and_one_of_them_with_doppler():
    def names(**observables) -> set[str]:
        gas = {"range": "115.2:115.4GHz"}
        scene = make_scene("spectrum", molecule="CO", conditions=gas, observables=dict(**observables))
        return {neglected.name for neglected in plan_of(scene).left_out}

    assert {"Doppler width", "pressure width"} <= names()
    assert {"Doppler width", "pressure width"} & names(profile="gaussian") == {"pressure width"}
    assert not {"Doppler width", "pressure width"} & names(profile="lorentzian", fwhm=1.0)


def test_a_plan_says_where_the_distortion_series_ends():
    plan, top = plan_of(make_scene("levels", molecule="HCONH2", observables={"jmax": 80})), rotor.read("HCONH2")
    assert "converges to J = 68;" in dict(plan.parts)["warning"]
    said = warnings_of(top, solve_levels(top, 80, jmin=80, vectors=False))
    assert "energies above J = 68 at the highest K" in said[0]  # what the run itself says
    short = plan_of(make_scene("levels", molecule="HCONH2", observables={"jmax": 68}))
    assert "warning" not in dict(short.parts)


@pytest.mark.parametrize("name", ["H2CO", "SO2", "water", "HCONH2", "CH2CHCN"])
def test_the_shift_of_an_asymmetric_top_in_a_stray_field(name):
    top = rotor.read(name)
    stark = rotor.api.stark_map(top, [0.0, 1e-3], j_highest=1, m_values=(1,), tolerance_mhz=1e-6)
    energy = stark.energy_mhz.reshape(-1, 2)  # both fields of one state after each other
    shift = np.abs(energy[:, 1] - energy[:, 0]).max()
    assert 1 / 3 < stray_field(top).size / shift < 3  # the other levels of J = 0 and 2 are left out


def normal(count: int) -> np.ndarray:
    """Numbers (count, 3) spread normally, by quantiles: their squares have the mean 1 but for the tails."""
    deviates = norm.ppf((np.arange(count) + 0.5) / count)
    return np.stack([deviates, deviates, deviates], axis=-1) / deviates.std()


@pytest.mark.parametrize("u", [0.3, 1.0, 2.0])
def test_the_quantum_correction_is_that_of_oscillators(u):
    """u = ħΩ/kT: the free energy of an oscillator is ln[sinh(u/2)/(u/2)] kT above the classical one."""
    kelvin, count = 50.0, 50
    bodies, _ = rigid_bodies(
        Atoms("Ar" * count, positions=10.0 * np.arange(count)[:, None] * [1.0, 0, 0]), np.arange(count)
    )
    omega = u * units.EV_PER_K * kelvin / units.HBAR_CLASSICAL
    force = -np.sqrt(bodies.mass[:, None] * units.EV_PER_K * kelvin) * omega * normal(count)  # -mΩ²x
    computed = {omission.name: omission for omission in neglected_in_fluid(bodies, force, 0 * force, kelvin, 2.0)}
    exact = 3 * np.log(np.sinh(u / 2) / (u / 2))
    tolerance = (
        0.05 + u**2 / 50
    )  # 12,000 squares have a spread of 1.3 %; the next order is u²/120 of this one, and more
    assert computed["quantum mechanics of nuclei"].size / 100 == pytest.approx(exact, rel=tolerance)
    assert "finite step" not in computed  # atoms do not turn


def test_the_step_error_is_that_of_librators():
    """⟨L²/I⟩ at full steps is s √(1 - s²)/asin s of kT, s = Ωh/2 (`rotor.fluids.motion.thermometers`)."""
    kelvin, step_fs, count = 300.0, 3.0, 20
    dimers = [molecule("N2") for _ in range(count)]
    for number, dimer in enumerate(dimers):
        dimer.translate([10.0 * number, 0, 0])
    bodies, _ = rigid_bodies(sum(dimers[1:], dimers[0]), np.arange(2 * count) // 2)
    step, rng = step_fs * 1e-3 / units.ASE_TIME_PS, np.random.default_rng(4)
    omega = 0.5 / step
    angles = rng.normal(size=(count, 3)) * (bodies.inverse_moments > 0)
    moments = np.where(
        bodies.inverse_moments > 0, 1 / np.where(bodies.inverse_moments > 0, bodies.inverse_moments, 1), 0
    )
    torque = -np.sqrt(moments * units.EV_PER_K * kelvin) * omega * angles
    computed = {omission.name: omission for omission in neglected_in_fluid(bodies, 0 * torque, torque, kelvin, step_fs)}
    s = 0.25
    assert computed["finite step"].size / 100 == pytest.approx(
        1 - s * np.sqrt(1 - s**2) / np.arcsin(s), rel=0.1
    )  # the next order of Ωh


@pytest.mark.parametrize("count", [64, 216, 1000])
def test_the_box_slows_diffusion_as_yeh_and_hummer_have_it(count):
    """With a viscosity of 0.9 mPa s and a diffusion of 2.3e-9 m²/s, about those of water at 298 K, 1 g/cm³."""
    edge = (count * 18.015 * units.ATOMIC_MASS_KG / 997.0) ** (1 / 3) * 1e10
    slowed = yeh_hummer_correction(Diffusion(0.0, 0.0), 298.0, 0.9e-3, edge).corrected / 2.3e-9
    bodies, _ = rigid_bodies(Atoms("Ar2", positions=[[0, 0, 0], [9, 0, 0]]), np.arange(2))
    share = neglected_in_fluid(bodies, np.zeros((2, 3)), np.zeros((2, 3)), 298.0, 1.0)
    size = next(omission.size for omission in share if omission.name == "finite box") * (2 / count) ** (
        1 / 3
    )  # of two: N^(-1/3)
    assert 1 / 3 < size / 100 / slowed < 3


@pytest.mark.slow
def test_a_plan_of_atoms_on_a_perfect_lattice():
    """64 atoms of argon: forces are round-off at the start, which is no net force; atoms have no step error of rotation."""
    box = {"model": "argon", "molecules": 64, "density": 1.0, "steps": 10, "every": 5}
    plan = plan_of(make_scene("fluid", conditions=box, numerics={"cutoff": "7 Å"}))
    sizes = {neglected.name: neglected.size for neglected in plan.left_out}
    assert sizes["finite box"] == pytest.approx(25.0)  # 64^(-1/3)
    assert "finite step" not in sizes


@pytest.mark.slow
def test_the_sizes_of_a_plan_are_those_of_the_equilibrated_fluid():
    """Forces and torques after 50 steps from a lattice, against those after two picoseconds; rotation at full steps is colder."""
    from rotor.fluids.motion.dynamics import RigidDynamics
    from rotor.fluids.motion.thermostats import Langevin
    from rotor.fluids.request import make_box
    from rotor.scenes.run import scene_calculation

    box = {"molecules": 64, "ensemble": "langevin", "friction": 5.0, "steps": 100}
    scene = make_scene("fluid", conditions=box, numerics={"cutoff": "6 Å"})
    planned = {neglected.name: neglected.size for neglected in plan_of(scene).left_out}
    request = scene_calculation(scene).request
    atoms, kelvin, step_fs = make_box(request), 298.15, 2.0
    thermostat = Langevin(kelvin, 5e-3 / ase_units.fs, np.random.default_rng(1))
    dynamics = RigidDynamics(atoms, step_fs * ase_units.fs, thermostat=thermostat)
    dynamics.run(1000)
    sizes = []
    for _ in range(20):
        dynamics.run(10)
        computed = neglected_in_fluid(dynamics.bodies, *dynamics.wrench(), kelvin, step_fs)
        sizes.append({entry.name: entry.size for entry in computed if entry.size is not None})
    for name in ("quantum mechanics of nuclei", "finite step"):
        assert 1 / 3 < planned[name] / np.mean([size[name] for size in sizes]) < 3


def driven(name: str, **changes) -> DrivenRequest:
    scene = read_scene(SCENES / f"{name}.toml").replaced(accuracy=None)
    return replace(scene_calculation(scene, SCENES).request, **changes)


@pytest.mark.parametrize(
    ("name", "tolerance"),
    [
        ("satellite_body_torque", 1e-4),
        ("satellite_body_torque", 1e-9),
        ("unbalanced_wheel", 1e-6),
        ("driven_chaos", 1e-9),
    ],
)
def test_the_error_of_the_steps_of_a_driven_motion(name, tolerance):
    request = driven(name, tolerance=tolerance)
    motion = answer_driven(request).motion
    truth = answer_driven(driven(name, tolerance=1e-13)).motion
    real = float(distance(motion.attitude, truth.attitude).max())
    assert 1 / 3 < step_error(request, motion.steps).size / real < 3  # 0.90 to 0.99


@pytest.mark.parametrize("step", [0.1, 0.02])
def test_the_error_of_a_fixed_step(step):
    weight = GravityAboutPivot(1.0, (0.0, 0.1, 1.0), (0.0, 0.0, -1.0))
    request = DrivenRequest((1.0, 1.2, 0.5), (0.0, 5.0), (weight,), angular_velocity=(0.3, 0.1, 4.0), step=step)
    motion = answer_driven(request).motion
    truth = answer_driven(replace(request, step=None, tolerance=1e-13)).motion
    real = float(distance(motion.attitude, truth.attitude).max())
    assert 1 / 3 < step_error(request, motion.steps).size / real < 3  # a quarter of the step has 1/256 of the error


def test_the_error_of_many_steps_is_a_bound():
    request = driven("satellite_body_torque", tolerance=1e-9)
    limit = step_error(request, 10**6)
    assert limit.size == pytest.approx(1e-3)  # steps times tolerance
    assert limit.basis.startswith("at most")
    dense = step_error(driven("dual_spin_satellite", tolerance=1e-6), 400)
    assert dense.basis.startswith("at most")  # its times are so dense that no tolerance takes more steps
    assert dense.size < 1e-11
