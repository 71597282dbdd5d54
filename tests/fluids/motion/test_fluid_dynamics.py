"""Dynamics of rigid molecules: order, reversal, what is kept, exact free motion, thermometers, and ASE's face."""

import math

import numpy as np
import pytest
from ase import Atoms
from ase.build import molecule
from ase.calculators.calculator import Calculator
from ase.calculators.tip4p import TIP4P
from ase.io import read
from ase.md.velocitydistribution import Stationary
from ase.units import fs
from fluid_boxes import MIXED, Free, SoftSites, Springs, box_of

from rotor.classical.free.free_motion import free_motion
from rotor.fluids.initial_box import at_rest, heat, relax
from rotor.fluids.motion.bodies import rigid_bodies
from rotor.fluids.motion.dynamics import RigidDynamics
from rotor.fluids.motion.thermometers import THERMOMETERS, kinetic_energy
from rotor.geometry.rotations import distance


def warm(box, calculator, temperature_k=300.0, seed=2):
    """The box with a calculator and thermal momenta."""
    bodies, pose = rigid_bodies(box)
    box.calc = calculator
    heat(box, bodies, pose.attitude, temperature_k, np.random.default_rng(seed))
    return box


def energies(step_fs, span_fs):
    """Conserved energy along a run of a mixed box."""
    dynamics = RigidDynamics(warm(box_of(*MIXED), SoftSites()), step_fs * fs)
    seen = []
    dynamics.attach(lambda: seen.append(dynamics.conserved_energy()))
    dynamics.run(round(span_fs / step_fs))
    return np.array(seen)


def test_the_energy_error_is_of_order_two():
    coarse, fine = (energies(step, 200.0)[:: round(2 / step)].std() for step in (1.0, 0.5))
    assert coarse > 1e-6  # eV: forces act
    assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)  # the next term, of order h², is 4 % here


def test_time_runs_back():
    dynamics = RigidDynamics(warm(box_of(*MIXED), SoftSites()), 2.0 * fs)
    start = dynamics.atoms.positions.copy()
    dynamics.run(200)
    assert abs(dynamics.atoms.positions - start).max() > 0.5  # Å: something moved
    dynamics.atoms.set_momenta(-dynamics.atoms.get_momenta())
    dynamics.run(200)
    assert abs(dynamics.atoms.positions - start).max() < 1e-9  # Å: round-off of 400 steps, with some chaos


def test_totals_shapes_and_lengths_are_kept():
    box = warm(box_of(*MIXED), SoftSites())
    bodies, pose = rigid_bodies(box)
    distances = box.get_all_distances()
    inside = box.arrays["molecule"][:, None] == box.arrays["molecule"][None]
    dynamics = RigidDynamics(box, 2.0 * fs)
    dynamics.run(2000)
    assert abs(dynamics.state.momentum.sum(axis=0)).max() < 1e-11  # √(u eV): round-off of momenta of order 1
    assert (
        abs(np.linalg.norm(dynamics.state.attitude, axis=1) - 1.0).max() < 4e-16
    )  # no drift: two units in the last place
    assert abs(box.get_all_distances() - distances)[inside].max() < 1e-13  # Å: rigid, in round-off of positions of 10 Å
    assert abs(dynamics.bodies.positions(pose) - bodies.positions(pose)).max() == 0.0
    assert box.get_kinetic_energy() == pytest.approx(dynamics.kinetic("full").total_ev, rel=1e-13)  # the same motion


@pytest.mark.parametrize("name", ["N2", "CO2", "CH4", "NH3"])
def test_free_motion_of_linear_symmetric_and_spherical_molecules_is_exact(name):
    box = warm(molecule(name), None)
    box.calc = Free(box)
    dynamics = RigidDynamics(box, 10.0 * fs, removed=0)
    angular, attitude = dynamics.state.angular[0].copy(), dynamics.state.attitude[0]
    dynamics.run(1000)
    moments = dynamics.bodies.moments[0]
    if name == "NH3":  # its geometry is symmetric to 1e-5 only; the exact solution takes the moments as they are
        assert abs(moments[0] / moments[1] - 1.0) < 1e-4
    momentum, turned = free_motion(moments, angular, attitude).at(10000.0 * fs)
    assert distance(dynamics.state.attitude[0], turned) < (
        2e-4 if name == "NH3" else 1e-10
    )  # asymmetry 1e-5; round-off
    assert np.allclose(dynamics.state.angular[0], momentum, atol=1e-4 if name == "NH3" else 1e-11)  # the same


def test_free_water_turns_with_an_error_of_order_two():
    errors = []
    for step in (2.0, 1.0):
        box = warm(molecule("H2O"), None)
        box.calc = Free(box)
        dynamics = RigidDynamics(box, step * fs, removed=0)
        exact = free_motion(dynamics.bodies.moments[0], dynamics.state.angular[0].copy(), dynamics.state.attitude[0])
        dynamics.run(round(500 / step))
        errors.append(float(distance(dynamics.state.attitude[0], exact.at(500.0 * fs)[1])))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)  # the next even order
    assert errors[0] < 0.05  # rad after 0.5 ps


@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e9])
def test_bodies_of_any_mass_turn(scale):
    """Masses times s with times √s is the same motion: no threshold stops small moments (as LAMMPS' once did)."""
    box = box_of("H2O", "N2")
    box.set_masses(rigid_bodies(box)[0].masses * scale)
    bodies, pose = rigid_bodies(box)
    heat(box, bodies, pose.attitude, 300.0, np.random.default_rng(1))
    box.calc = Free(box)
    dynamics = RigidDynamics(box, math.sqrt(scale) * fs)
    exact = [
        free_motion(*body)
        for body in zip(bodies.moments, dynamics.state.angular.copy(), dynamics.state.attitude, strict=True)
    ]
    start = dynamics.state.attitude
    dynamics.run(50)
    assert bodies.degrees().total == 11
    for body, motion in enumerate(exact):
        turned = motion.at(50 * dynamics.dt)[1]
        assert distance(turned, start[body]) > 0.1  # rad: it did turn
        assert distance(dynamics.state.attitude[body], turned) < 1e-3  # rad: error of water's steps of 1 fs


def harmonic(kind, step):
    """A harmonic motion of a molecule on springs: dynamics, its coordinate and momentum, frequency Ω from the springs."""
    box = molecule("N2") if kind == "libration" else Atoms("Ar")
    box.translate([0.1, 0.2, 0.3])
    mass = rigid_bodies(box)[0].mass[0] / len(box)
    box.calc = Springs(box.positions, mass)  # Ω = 1 for the centre and, two equal masses on equal springs, for the turn
    dynamics = RigidDynamics(box, step, removed=0)
    size = 1e-4
    if kind == "libration":
        dynamics.state.spin[0, 1] = size
    else:
        dynamics.state.momentum[0, 0] = size
    dynamics.write_momenta()
    path = []

    def note():
        state, start = dynamics.state, dynamics.atoms.calc.anchors
        if kind == "libration":
            arm = dynamics.bodies.sites[0, 0]
            aside = np.sum((dynamics.atoms.positions[0] - start[0]) ** 2) ** 0.5 / abs(arm)
            path.append((math.copysign(aside, dynamics.wrench()[1][0, 1] * -1), state.spin[0, 1]))
        else:
            path.append((dynamics.atoms.positions[0, 0] - start[0, 0], state.momentum[0, 0]))

    return dynamics, path, note


@pytest.mark.parametrize("kind", ["oscillation", "libration"])
def test_thermometers_meet_their_closed_forms_on_a_harmonic_motion(kind):
    """kT of the shadow ensemble is action times frequency, both measured: area of the orbit, and turns in time."""
    step = 0.6
    dynamics, path, note = harmonic(kind, step)
    seen = {name: [] for name in THERMOMETERS}
    dynamics.attach(note)

    def measure():
        for name, values in seen.items():
            values.append(2.0 * dynamics.kinetic(name).total_ev)

    dynamics.attach(measure)
    dynamics.run(4000)
    x, p = np.array(path).T
    x = x * (p.max() / x.max())
    unit = np.array(path)[:, 0].max() / x.max()
    angle = np.unwrap(np.arctan2(x, p))
    order = np.argsort(np.mod(angle, 2 * np.pi))
    area = 0.5 * abs(np.sum(x[order] * np.roll(p[order], -1) - p[order] * np.roll(x[order], -1))) * unit
    frequency = (angle[-1] - angle[0]) / (step * (len(x) - 1))
    kt = area / (2 * np.pi) * frequency
    s = 0.5 * step
    full, half = s * math.sqrt(1 - s * s) / math.asin(s), s / (math.asin(s) * math.sqrt(1 - s * s))
    assert np.mean(seen["full"]) / kt == pytest.approx(full, abs=3e-4)  # 4000 points: whole turns are met to 1/4000
    assert np.mean(seen["half"]) / kt == pytest.approx(half, abs=3e-4)  # the same
    assert full == pytest.approx(1 - step**2 / 6, abs=2 * s**4)  # the next term of the series is of order s⁴
    assert half == pytest.approx(1 + step**2 / 12, abs=2 * s**4)  # the same
    assert abs(np.mean(seen["mixed"]) / kt - 1.0) < s**4  # no h² left: a tenth of the others' error
    assert abs(np.mean(seen["full"]) / kt - 1.0) > 5 * s**4


def test_the_half_step_thermometer_is_the_mean_of_the_half_steps():
    dynamics = RigidDynamics(warm(box_of(*MIXED), SoftSites()), 2.0 * fs)
    dynamics.run(20)
    bodies, state, h = dynamics.bodies, dynamics.state, dynamics.dt
    force, torque = dynamics.wrench()
    sides = [
        kinetic_energy(bodies, state.momentum + s * h / 2 * force, state.angular + s * h / 2 * torque).total_ev
        for s in (-1, 1)
    ]
    assert dynamics.kinetic("half").total_ev == pytest.approx(np.mean(sides), rel=1e-13)  # an identity
    mixed = (2 * dynamics.kinetic("half").rotation_ev + dynamics.kinetic("full").rotation_ev) / 3
    assert dynamics.kinetic().rotation_ev == pytest.approx(mixed, rel=1e-13)  # the default


def test_it_is_a_dynamics_of_ase(folder):
    box = warm(box_of(*MIXED), SoftSites())
    dynamics = RigidDynamics(box, 2.0 * fs, trajectory="run.traj", logfile="run.log", loginterval=5)
    calls = []
    dynamics.attach(lambda: calls.append(dynamics.nsteps), interval=10)
    assert dynamics.run(20)
    assert [dynamics.nsteps for _ in dynamics.irun(2)] == [20, 21, 22]
    dynamics.close()
    assert calls == [0, 10, 20]
    frames = read("run.traj", ":")
    assert len(frames) == 5  # 0, 5, 10, 15, 20
    assert np.array_equal(frames[0].get_masses(), box.get_masses())
    assert frames[-1].get_potential_energy() < 10.0
    lines = (folder / "run.log").read_text().splitlines()
    assert len(lines) == 1 + 5
    assert float(lines[1].split()[3]) == pytest.approx(float(lines[-1].split()[3]), rel=0.9)  # a temperature


def test_it_moves_under_any_calculator_of_ase():
    water = molecule("H2O")
    pair = water + water
    pair.positions[3:] += [2.9, 0.1, 0.0]
    pair.set_cell([20.0] * 3)
    pair.calc = TIP4P(rc=9.0)
    dynamics = RigidDynamics(pair, 1.0 * fs, molecules=[0] * 3 + [1] * 3)
    seen = []
    dynamics.attach(lambda: seen.append(dynamics.conserved_energy()))
    dynamics.run(100)
    assert (
        np.ptp(seen) < 2e-4 < np.ptp([seen[0], pair.get_potential_energy()]) + 1
    )  # eV; the dimer turns and falls together
    assert dynamics.kinetic().rotation_ev > 1e-3  # eV


def test_changes_by_others_are_taken_over():
    dynamics = RigidDynamics(warm(box_of(*MIXED), SoftSites()), 2.0 * fs)
    dynamics.run(3)
    dynamics.atoms.set_momenta(2.0 * dynamics.atoms.get_momenta())
    hot = dynamics.atoms.get_kinetic_energy()
    dynamics.atoms.translate([0.5, 0.0, 0.0])
    dynamics.step()
    assert dynamics.kinetic("full").total_ev == pytest.approx(hot, rel=0.1)  # one step's work later; before, a quarter
    assert abs(dynamics.bodies.positions(dynamics.state.pose) - dynamics.atoms.positions).max() == 0.0


def test_relaxing_lowers_the_energy_and_leaves_the_box_at_rest():
    box = box_of(*["H2O"] * 8, spacing=1.8)
    box.calc = SoftSites()
    before = box.get_potential_energy()
    relax(box, 50)
    assert box.get_potential_energy() < 0.7 * before  # it fell by much
    assert not box.get_momenta().any()


class Broken(Calculator):
    """A calculator that fails after some calls."""

    implemented_properties = ("energy", "forces")

    def calculate(self, atoms=None, properties=("energy",), system_changes=("positions",)):
        super().calculate(atoms, properties, system_changes)
        forces = np.zeros((len(atoms), 3))
        if atoms.positions[0, 0] > 0.2:
            forces[4] = np.nan
        self.results = {"energy": 0.0, "forces": forces}


def test_a_force_that_is_no_number_is_told_by_molecule_and_step():
    box = molecule("H2O") + molecule("N2")
    box.positions[3:] += 5.0
    box.positions[:3] -= box.positions[0]
    box.set_momenta(np.array([[1.0, 0, 0]] * 5) * rigid_bodies(box)[0].masses[:, None])
    box.calc = Broken()
    dynamics = RigidDynamics(box, 0.01, removed=0)
    with pytest.raises(ValueError, match=r"force on molecule 1 \(N2, atoms 3, 4\) is not finite in step 20"):
        dynamics.run(100)
    assert np.isfinite(box.get_momenta()).all()


def test_a_count_that_cannot_hold_is_refused():
    box = warm(box_of("H2O", "N2", "Ar"), SoftSites())
    momenta = box.get_momenta()
    box.set_momenta(momenta + 0.1)
    with pytest.raises(ValueError, match=r"total momentum is not zero.*Stationary\(atoms\)"):
        RigidDynamics(box, fs)
    Stationary(box)
    RigidDynamics(box, fs)  # what the error names does help
    box.set_momenta(momenta)
    box.calc = Springs(box.positions + 0.1, 1.0)
    with pytest.raises(ValueError, match=r"forces add to .* removed=0"):
        RigidDynamics(box, fs).run(1)
    assert RigidDynamics(box, fs, removed=0).run(1)
    bodies, _ = rigid_bodies(box)
    assert abs(at_rest(bodies, np.ones((3, 3))).sum(axis=0)).max() < 1e-15  # round-off
    with pytest.raises(ValueError, match="timestep"):
        RigidDynamics(box, 0.0)


def test_degrees_are_counted_anew_for_every_box():
    small = RigidDynamics(warm(box_of("H2O", "N2", "Ar"), SoftSites()), fs)
    large = RigidDynamics(warm(box_of("H2O", "N2", "Ar", "H2O"), SoftSites()), fs)
    assert (small.degrees.total, large.degrees.total) == (9 + 5 - 3, 12 + 8 - 3)  # 3 once, not once for each molecule
    assert RigidDynamics(warm(box_of("H2O", "N2", "Ar"), SoftSites()), fs, removed=0).degrees.total == 14
