"""Rigid molecules of a box: which atoms, which shape, where; forces and momenta between atoms and bodies."""

import numpy as np
import pytest
from ase import Atoms
from ase.build import molecule
from ase.constraints import FixAtoms
from fluid_boxes import MIXED, box_of

from rotor.fluids.forces.models import find_model
from rotor.fluids.initial_box import check_apart, lattice_box, model_labels
from rotor.fluids.motion.bodies import Pose, rigid_bodies
from rotor.geometry import rotations
from rotor.molecules.nuclei import masses


def random_motion(bodies, seed=3):
    """Momenta and angular momenta with nothing about axes that carry no degree of freedom."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=(len(bodies), 3)), rng.normal(size=(len(bodies), 3)) * (bodies.moments > 0)


def test_a_mixed_box_has_the_right_bodies_and_is_laid_back_where_it_was():
    box = box_of(*MIXED)
    bodies, pose = rigid_bodies(box)
    assert bodies.names == ("OH2", "N2", "Ar", "CO2", "CH4", "NH3")
    assert bodies.species.tolist() == [0, 1, 2, 3, 4, 5, 0, 2]
    assert (bodies.moments > 0).sum(axis=1).tolist() == [3, 2, 0, 2, 3, 3, 3, 0]
    count = bodies.degrees(removed=3)
    assert (count.translation, count.rotation) == (3 * 8 - 3, 3 + 2 + 0 + 2 + 3 + 3 + 3 + 0)
    assert abs(bodies.positions(pose) - box.positions).max() < 1e-12  # round-off of a superposition, Å
    assert bodies.masses.tolist() == masses(box.get_chemical_symbols()).tolist()  # isotopes, not averages
    n2 = bodies.moments[1]
    assert n2[1] == n2[2] == pytest.approx(masses(["N"])[0] * box.get_distance(3, 4) ** 2 / 2, rel=1e-14)  # m d²/2


def test_masses_of_the_user_hold():
    box = molecule("H2O")
    box.set_masses([16.0, 2.0, 2.0])
    bodies, _ = rigid_bodies(box)
    assert bodies.mass.tolist() == [20.0]


@pytest.mark.parametrize("labelled", [True, False])
def test_molecules_cut_by_the_edge_are_put_together(labelled):
    whole = box_of("H2O", "CO2", "NH3", "CH4", "N2", spacing=4.5)
    whole.translate([1.9, 2.4, 0.3])
    cut = whole.copy()
    cut.wrap()
    if not labelled:
        del cut.arrays["molecule"]
    assert abs(cut.positions - whole.positions).max() > 5.0  # something was cut
    bodies, pose = rigid_bodies(cut)
    placed = bodies.positions(pose)
    shift = (placed - whole.positions) @ np.linalg.inv(cut.cell.array)
    assert abs(shift - np.round(shift)).max() < 1e-12  # the same but for whole cells, round-off
    for body in range(len(bodies)):
        rows = bodies.order[bodies.starts[body] : bodies.starts[body + 1]]
        assert np.ptp(np.round(shift[rows]), axis=0).max() == 0.0


def test_a_chain_longer_than_half_the_cell_is_followed_along_its_bonds():
    chain = Atoms("C6", positions=np.arange(6)[:, None] * [1.2, 0.1, 0.0], cell=[9.0, 9.0, 9.0], pbc=True)
    cut = chain.copy()
    cut.translate([5.0, 0.0, 0.0])
    cut.wrap()
    placed = (lambda computed: computed[0].positions(computed[1]))(rigid_bodies(cut))
    assert np.linalg.norm(placed[5] - placed[0]) == pytest.approx(5 * np.hypot(1.2, 0.1), rel=1e-12)  # round-off


def test_a_triclinic_cell():
    water = molecule("H2O")
    water.set_cell([[6, 0, 0], [2.5, 5.5, 0], [1.0, 1.5, 6.0]])
    water.pbc = True
    cut = water.copy()
    cut.wrap()
    bodies, pose = rigid_bodies(cut)
    placed = bodies.positions(pose)
    assert np.linalg.norm(placed[1] - placed[2]) == pytest.approx(water.get_distance(1, 2), rel=1e-12)  # round-off


def test_atoms_of_molecules_may_stand_in_any_order():
    box = box_of("H2O", "H2O", "N2")
    mixed = box[[0, 3, 6, 1, 4, 7, 2, 5]]
    body, _pose = rigid_bodies(box)
    other, other_pose = rigid_bodies(mixed)
    assert np.allclose(other.moments, body.moments, rtol=1e-12)  # round-off
    assert abs(other.positions(other_pose) - mixed.positions).max() < 1e-12  # round-off, Å
    lists, _ = rigid_bodies(mixed, molecules=[[0, 3, 6], [1, 4, 7], [2, 5]])
    assert lists.order.tolist() == other.order.tolist()


def test_bonds_find_the_molecules_that_labels_name():
    box = box_of(*MIXED, spacing=4.0)
    labelled, _ = rigid_bodies(box)
    del box.arrays["molecule"]
    computed, _ = rigid_bodies(box)
    assert computed.order.tolist() == labelled.order.tolist()
    assert computed.starts.tolist() == labelled.starts.tolist()


def test_forces_become_force_and_torque_that_do_the_same_work():
    box = box_of(*MIXED)
    bodies, pose = rigid_bodies(box)
    momentum, angular = random_motion(bodies)
    velocities = bodies.momenta(momentum, angular, pose.attitude) / bodies.masses[:, None]
    forces = np.random.default_rng(4).normal(size=velocities.shape)
    force, torque = bodies.wrench(forces, pose.attitude)
    work = np.sum(force * momentum / bodies.mass[:, None]) + np.sum(torque * angular * bodies.inverse_moments)
    assert work == pytest.approx(np.sum(forces * velocities), rel=1e-12)  # an identity, round-off
    body = 0
    rows = bodies.order[bodies.starts[body] : bodies.starts[body + 1]]
    in_space = np.cross(box.positions[rows] - pose.centres[body], forces[rows]).sum(axis=0)
    assert np.allclose(rotations.rotate(pose.attitude[body], torque[body]), in_space, rtol=1e-11)  # round-off


def test_momenta_of_atoms_and_bodies_are_one_motion():
    box = box_of(*MIXED)
    bodies, pose = rigid_bodies(box)
    momentum, angular = random_motion(bodies)
    box.set_masses(bodies.masses)
    box.set_momenta(bodies.momenta(momentum, angular, pose.attitude))
    back = bodies.wrench(box.get_momenta(), pose.attitude)
    assert np.allclose(back[0], momentum, rtol=0, atol=1e-12)  # round-off of numbers of order 1
    assert np.allclose(back[1], angular, rtol=0, atol=1e-12)  # the same
    energy = np.sum(momentum**2 / bodies.mass[:, None]) / 2 + np.sum(angular**2 * bodies.inverse_moments) / 2
    assert box.get_kinetic_energy() == pytest.approx(energy, rel=1e-12)  # round-off


def test_a_site_without_mass_turns_with_its_body_and_counts_no_degree():
    box = Atoms("OHHX", positions=[[0, 0, 0], [0.8, 0, 0.6], [-0.8, 0, 0.6], [0, 0, 0.15]])
    box.set_masses([16.0, 1.0, 1.0, 0.0])
    bodies, pose = rigid_bodies(box, molecules=[0, 0, 0, 0])
    assert bodies.degrees().total == 6
    forces = np.zeros((4, 3))
    forces[3] = [0.0, 1.0, 0.0]
    force, torque = bodies.wrench(forces, pose.attitude)
    arm = box.positions[3] - pose.centres[0]
    assert force.tolist() == [[0.0, 1.0, 0.0]]
    assert np.allclose(rotations.rotate(pose.attitude[0], torque[0]), np.cross(arm, forces[3]), atol=1e-15)  # round-off


def test_nearly_linear_molecules_are_told_of():
    bent = Atoms("OCO", positions=[[-1.16, 0, 0], [0, 1e-3, 0], [1.16, 0, 0]])
    bodies, _ = rigid_bodies(bent)
    count = bodies.degrees()
    assert count.rotation == 2
    assert count.notes[0].startswith("O2C: I_a/I_c = 2.")
    assert "2 rotational degrees" in count.notes[0]
    assert bodies.sites[:, 1:].tolist() == np.zeros((3, 2)).tolist()


def test_wrong_boxes_are_refused_by_name():
    box = box_of("H2O", "H2O")
    box.positions[4] += [0.2, 0, 0]
    with pytest.raises(ValueError, match=r"molecule 1 \(OH2, atoms 3 to 5\).*off its place"):
        rigid_bodies(box)
    hand = Atoms("CHFClBr", positions=[[0, 0, 0], [0, 0, 1.1], [1.3, 0, -0.4], [-0.8, 1.5, -0.5], [-0.9, -1.6, -0.6]])
    mirrored = hand.copy()
    mirrored.positions[:, 1] *= -1
    mirrored.translate([8, 0, 0])
    with pytest.raises(ValueError, match="molecule 1"):
        rigid_bodies(hand + mirrored, molecules=[0] * 5 + [1] * 5)
    with pytest.raises(ValueError, match="atom 1 is in none"):
        rigid_bodies(molecule("N2"), molecules=[[0]])
    with pytest.raises(ValueError, match="twice"):
        rigid_bodies(molecule("N2"), molecules=[[0, 1], [1]])
    with pytest.raises(ValueError, match="2 labels"):
        rigid_bodies(molecule("H2O"), molecules=[0, 0])
    with pytest.raises(ValueError, match="no atoms"):
        rigid_bodies(Atoms())
    held = molecule("H2O")
    held.set_constraint(FixAtoms([0]))
    with pytest.raises(ValueError, match="constraints"):
        rigid_bodies(held)
    lost = molecule("H2O")
    lost.positions[1, 0] = np.nan
    with pytest.raises(ValueError, match="atom 1 is not finite"):
        rigid_bodies(lost)
    weightless = molecule("N2")
    weightless.set_masses([0.0, 0.0])
    with pytest.raises(ValueError, match="without mass"):
        rigid_bodies(weightless)


def test_the_shape_of_a_model_is_used():
    model = find_model("spce")
    box = lattice_box(model, 8, 0.5, np.random.default_rng(1))
    box.positions += np.random.default_rng(2).normal(scale=1e-4, size=(24, 3))
    bodies, pose = rigid_bodies(box, shapes={model.symbols: model.positions_angstrom[:3]})
    placed = bodies.positions(pose)
    assert np.linalg.norm(placed[0::3] - placed[1::3], axis=1) == pytest.approx(1.0, rel=1e-13)  # O-H of SPC/E
    assert bodies.moments[0].round(3).tolist() == [
        0.597,
        1.344,
        1.94,
    ]  # published to these digits, with averaged masses 1.941


def test_a_lattice_of_water_has_its_density_and_no_overlap():
    box = lattice_box(find_model("spce"), 100, 0.997, np.random.default_rng(5))
    bodies, _ = rigid_bodies(box)
    grams = bodies.mass.sum() * 1.66053906892e-24
    assert grams / (box.get_volume() * 1e-24) == pytest.approx(0.997, rel=1e-12)  # its definition
    check_apart(box, bodies)
    box.positions[3:6] = box.positions[:3] + 0.1
    with pytest.raises(ValueError, match=r"molecule 0 .* and molecule 1 .* on top of each other"):
        check_apart(box, bodies)


def test_models_find_their_molecules_in_order():
    water = find_model("spce")
    assert model_labels(Atoms("OH2OH2", positions=np.zeros((6, 3))), [water]).tolist() == [0, 0, 0, 1, 1, 1]
    with pytest.raises(ValueError, match=r"no molecule begins with atom 3 \(H-O-H\.\.\.\)"):
        model_labels(Atoms("OH2HOH", positions=np.zeros((6, 3))), [water])


def test_a_pose_is_found_again_after_a_move():
    box = box_of(*MIXED)
    bodies, pose = rigid_bodies(box)
    turn = rotations.uniform(len(bodies), rng=np.random.default_rng(6))
    moved = Pose(pose.centres + 0.3, rotations.multiply(turn, pose.attitude))
    box.positions = bodies.positions(moved)
    again = bodies.positions(bodies.pose(box))
    assert abs(again - box.positions).max() < 1e-12  # round-off, Å
