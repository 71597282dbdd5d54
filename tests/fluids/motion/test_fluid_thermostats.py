"""Thermostats: equipartition over every axis, the right count, closed forms, what is conserved; and planted mistakes caught."""

import math

import numpy as np
import pytest
from ase import Atoms
from ase.build import molecule
from ase.units import fs
from fluid_boxes import MIXED, Free, SoftSites, Springs, box_of

from rotor import units
from rotor.fluids.initial_box import heat, thermal_momenta
from rotor.fluids.motion.bodies import rigid_bodies
from rotor.fluids.motion.dynamics import RigidDynamics
from rotor.fluids.motion.thermostats import Langevin, NoseHoover
from rotor.geometry import rotations
from rotor.statistics.degrees_of_freedom import Degrees
from rotor.statistics.equipartition import equipartition, kinetic_degrees, statistical_inefficiency

KT = 300.0 * units.EV_PER_K


def gas(name, copies):
    """Many molecules far from each other, at rest, turned at random."""
    single, turns = molecule(name), rotations.uniform(copies, rng=np.random.default_rng(8))
    centred = single.positions - single.positions.mean(axis=0)
    places = rotations.rotate(turns[:, None], centred) + 20.0 * np.arange(copies)[:, None, None] * [1, 0, 0]
    box = Atoms(single.get_chemical_symbols() * copies, places.reshape(-1, 3))
    box.arrays["molecule"] = np.repeat(np.arange(copies), len(single))
    box.calc = Free(box)
    return box


def judged(dynamics):
    """The verdict on the momenta of one moment, at 99.9 %."""
    bodies, state = dynamics.bodies, dynamics.state
    energies = kinetic_degrees(
        masses=bodies.mass,
        velocities=state.momentum / bodies.mass[:, None],
        moments=bodies.moments,
        momenta=state.angular,
    )
    return equipartition(energies, KT, confidence=0.999)


class SpaceNoise(Langevin):
    """The mistake of LAMMPS issue 2288: noise drawn along the axes of space with the moments of the body."""

    def act(self, state, time):
        keep, gain = math.exp(-self.friction * time), math.sqrt(-math.expm1(-2.0 * self.friction * time))
        noise = self._rng.standard_normal((2, len(self._bodies), 3))
        state.momentum[...] = keep * state.momentum + gain * self._momentum_width * noise[0]
        in_space = gain * self._angular_width * noise[1]
        state.spin[:, :3] = keep * state.angular + rotations.rotate(rotations.conjugate(state.attitude), in_space)


@pytest.mark.parametrize("name", ["H2O", "N2", "CH4"])
def test_free_molecules_at_rest_come_to_equipartition_about_every_axis(name):
    """Bodies without torque are thermalised too (HOOMD 138, 139), asymmetric ones about their own axes."""
    box = gas(name, 3000)
    dynamics = RigidDynamics(box, 20.0 * fs, thermostat=Langevin(300.0, 0.02 / fs, np.random.default_rng(5)))
    dynamics.run(25)  # ten relaxation times
    verdict = judged(dynamics)
    assert verdict.accepted, str(verdict)
    assert dynamics.degrees.removed == 0
    assert dynamics.degrees.total == {"H2O": 6, "N2": 5, "CH4": 6}[name] * 3000


def test_noise_in_the_wrong_frame_is_caught():
    dynamics = RigidDynamics(
        gas("H2O", 3000), 20.0 * fs, thermostat=SpaceNoise(300.0, 0.02 / fs, np.random.default_rng(5))
    )
    dynamics.run(25)
    verdict = judged(dynamics)
    assert not verdict.accepted
    assert "rotation a" in verdict.failing


def test_langevin_in_the_middle_has_exact_half_steps_on_springs():
    """⟨p²/m⟩ = kT (1 - (Ωh)²/4) at full steps and kT at half steps, for oscillations and librations alike."""
    box = gas("N2", 1500)
    mass = rigid_bodies(box)[0].mass[0] / 2
    box.calc = Springs(box.positions, mass)  # Ω = 1 in all five degrees, librations as far as they are small
    h = 0.6
    cold = 1e-4  # eV of kT in these units of time: amplitudes of 4e-3 Å, so that librations are harmonic
    thermostat = Langevin(cold / units.EV_PER_K, 1.0, np.random.default_rng(3))
    dynamics = RigidDynamics(box, h, thermostat=thermostat)
    dynamics.run(20)
    seen = []
    dynamics.attach(
        lambda: seen.append(
            [
                energy
                for name in ("full", "half")
                for energy in (dynamics.kinetic(name).translation_ev, dynamics.kinetic(name).rotation_ev)
            ]
        )
    )
    dynamics.run(150)
    counts = np.array([4500, 3000, 4500, 3000])
    ratios = 2.0 * np.mean(seen, axis=0) / (counts * cold)
    noise = np.std(seen, axis=0) * 2.0 / (counts * cold) * math.sqrt(10.0 / len(seen))  # ten steps remember each other
    expected = np.array([1 - h * h / 4, 1 - h * h / 4, 1.0, 1.0])
    assert np.all(noise < 0.007)
    assert np.all(abs(ratios - expected) < 4 * noise)  # 4 σ; the thermometers differ by 9 %
    assert dynamics.thermometer == "half"


class OneTooMany(NoseHoover):
    """The mistake of OpenMM issue 4109: the chain counts the three degrees of the total momentum, which is removed."""

    def start(self, bodies, degrees):
        super().start(bodies, Degrees(degrees.bodies, degrees.translation + 3, degrees.rotation))


def mean_temperature(thermostat, steps=2500):
    """Mean and error of the temperature of a small box by its own count."""
    box = box_of("H2O", "N2", "CO2")
    box.calc = SoftSites()
    bodies, pose = rigid_bodies(box)
    heat(box, bodies, pose.attitude, 300.0, np.random.default_rng(4))
    dynamics = RigidDynamics(box, 2.0 * fs, thermostat=thermostat)
    seen = []
    dynamics.attach(lambda: seen.append(dynamics.temperatures().all_k))
    dynamics.run(steps)
    series = np.array(seen[200:])
    return series.mean(), series.std() * math.sqrt(statistical_inefficiency(series[:, None]) / len(series))


@pytest.mark.parametrize("separate", [False, True])
def test_nose_hoover_counts_the_degrees_that_move(separate):
    mean, error = mean_temperature(NoseHoover(300.0, 20.0 * fs, separate=separate))
    assert error < 8.0  # K: the three degrees more or less would be 69 K
    assert abs(mean - 300.0) < 4 * error  # K


def test_a_chain_that_forgets_the_removed_momentum_is_caught():
    mean, error = mean_temperature(OneTooMany(300.0, 20.0 * fs))
    assert mean == pytest.approx(300.0 * 16 / 13, abs=4 * error)  # K: the 3 degrees' heat is spread over the others
    assert mean - 300.0 > 5 * error


def test_the_conserved_energy_is_conserved_to_order_two():
    def spread(thermostat, step):
        box = box_of(*MIXED)
        box.calc = SoftSites()
        bodies, pose = rigid_bodies(box)
        heat(box, bodies, pose.attitude, 300.0, np.random.default_rng(4))
        dynamics = RigidDynamics(box, step * fs, thermostat=thermostat)
        seen = []
        dynamics.attach(lambda: seen.append(dynamics.conserved_energy()), interval=round(2 / step))
        dynamics.run(round(200 / step))
        return np.std(seen)

    chains = [spread(NoseHoover(400.0, 50.0 * fs), step) for step in (1.0, 0.5)]
    assert math.log2(chains[0] / chains[1]) == pytest.approx(2.0, abs=0.15)  # the next term in h²
    noise = [spread(Langevin(400.0, 0.01 / fs, np.random.default_rng(1)), step) for step in (1.0, 0.25)]
    assert noise[1] < 0.3 * noise[0] < 1e-3  # eV: heat is accounted for, what is left falls with the step
    work = spread(None, 1.0)
    assert noise[0] < 100 * work


def test_thermal_momenta_are_canonical_with_three_degrees_fewer():
    box = box_of("H2O", "N2", "Ar", "CH4")
    bodies, _ = rigid_bodies(box)
    rng = np.random.default_rng(11)
    drawn = [thermal_momenta(bodies, 300.0, rng, removed=3) for _ in range(4000)]
    momentum, angular = np.array([p for p, _ in drawn]), np.array([angular for _, angular in drawn])
    assert abs(momentum.sum(axis=1)).max() < 1e-12  # round-off
    twice = np.sum(momentum**2 / bodies.mass[:, None], axis=(1, 2)) + np.sum(
        angular**2 * bodies.inverse_moments, axis=(1, 2)
    )
    degrees = bodies.degrees(removed=3).total
    assert twice.mean() / (degrees * KT) == pytest.approx(1.0, abs=4 * math.sqrt(2 / degrees / 4000))  # 4 σ of χ²
    assert twice.var() / (2 * degrees * KT**2) == pytest.approx(1.0, abs=0.12)  # 4 σ of the variance of 4000 χ²


def test_wrong_thermostats_are_refused():
    rng = np.random.default_rng(1)
    for make in (
        lambda: Langevin(0.0, 1.0, rng),
        lambda: Langevin(300.0, -1.0, rng),
        lambda: NoseHoover(300.0, 0.0),
        lambda: NoseHoover(300.0, 1.0, links=0),
        lambda: NoseHoover(math.nan, 1.0),
    ):
        with pytest.raises(ValueError, match="expected"):
            make()
    argon = Atoms("Ar2", [[0, 0, 0], [4, 0, 0]])
    argon.calc = Free(argon)
    with pytest.raises(ValueError, match="0 degrees of freedom"):
        RigidDynamics(argon, fs, thermostat=NoseHoover(300.0, 1.0, separate=True), molecules=[0, 1])
