"""Models as published, sites from atoms and back, atoms matched with models."""

from __future__ import annotations

import numpy as np
import plain_fluid as plain
import pytest
from ase import Atoms

from rotor.fluids.forces.assembly import assemble, list_centre, spreading_weights
from rotor.fluids.forces.models import MODELS, RigidModel, Site, find_model, find_models
from rotor.fluids.forces.potential import RigidPotential
from rotor.units import DEBYE_PER_E_ANGSTROM

DIPOLES = {"spce": 2.351, "tip3p": 2.347, "tip4p": 2.177, "tip4p-2005": 2.305, "tip4p-ew": 2.321}  # D, as published
QUADRUPOLES = {"trappe-n2": -1.394, "trappe-co2": -4.278}  # D Å, measured: C. Graham et al., Mol. Phys. 93, 49 (1998)


@pytest.mark.parametrize("name", DIPOLES)
def test_dipoles_of_the_waters(name: str) -> None:
    model = find_model(name)
    dipole = sum(site.charge_e * np.array(site.position_angstrom) for site in model.sites) * DEBYE_PER_E_ANGSTROM
    assert np.linalg.norm(dipole) == pytest.approx(DIPOLES[name], abs=2e-3)  # as printed, rounded


@pytest.mark.parametrize("name", QUADRUPOLES)
def test_quadrupoles_of_the_linear_models(name: str) -> None:
    model = find_model(name)
    moment = sum(site.charge_e * site.position_angstrom[2] ** 2 for site in model.sites) * DEBYE_PER_E_ANGSTROM
    assert moment == pytest.approx(QUADRUPOLES[name], rel=0.07)  # effective charges; a wrong sign or length is worse


def test_water_of_jorgensen_in_his_other_units() -> None:
    """The paper's Table I prints A = 582000 and 600000 kcal Å¹²/mol, C = 595 and 610; common tables σ = 3.1506 and 3.1536 Å."""
    sizes = [
        (find_model(name).sites[0].sigma_angstrom, find_model(name).sites[0].epsilon_k) for name in ("tip3p", "tip4p")
    ]
    assert np.array(sizes) == pytest.approx(np.array([(3.1506, 76.53), (3.1536, 78.02)]), abs=6e-3)  # as rounded


@pytest.mark.parametrize("name", MODELS)
def test_forces_on_sites_keep_total_and_torque_on_atoms(name: str) -> None:
    model, rng = find_model(name), np.random.default_rng(1)
    weights, places, forces = spreading_weights(model), model.positions_angstrom, rng.normal(size=(len(model.sites), 3))
    atoms, on_atoms = places[: len(model.symbols)], weights.T @ forces
    assert weights @ atoms == pytest.approx(places, abs=1e-14)  # round-off of Å
    assert on_atoms.sum(axis=0) == pytest.approx(forces.sum(axis=0), abs=1e-13)  # round-off
    torque = np.cross(places, forces).sum(axis=0)
    assert np.cross(atoms, on_atoms).sum(axis=0) == pytest.approx(torque, abs=1e-13)  # round-off
    centre, reach = list_centre(model)
    assert np.linalg.norm(places - centre @ atoms, axis=1).max() == pytest.approx(reach, abs=1e-14)  # round-off


def test_a_massless_site_off_the_line_is_refused() -> None:
    odd = RigidModel(
        "odd", (Site("N", (0, 0, 0), 0.5), Site("N", (0, 0, 1.1), 0), Site("", (0.2, 0, 0.5), -0.5)), "none"
    )
    with pytest.raises(ValueError, match=r"site 2 has no mass and lies 0\.2 Å from the line"):
        RigidPotential(odd).evaluate(Atoms("N2", positions=[(0, 0, 0), (0, 0, 1.1)]))


def test_labels_and_symbols_find_the_same_molecules() -> None:
    atoms = plain.box_of({"spce": 3, "trappe-n2": 2, "argon": 2}, 25.0)
    models = find_models("argon, trappe-n2,spce")
    by_symbols = assemble(atoms, models)
    atoms.set_array("molecule", np.repeat([5, 3, 9, 0, 1, 7, 8], [3, 3, 3, 2, 2, 1, 1]))
    by_labels = assemble(atoms, models)
    assert by_symbols.kinds.tolist() == by_labels.kinds.tolist() == [2, 2, 2, 1, 1, 0, 0]
    assert by_labels.first_atom.tolist() == [0, 3, 6, 9, 11, 13, 14, 15]
    assert by_labels.first_site.tolist() == [0, 3, 6, 9, 12, 15, 16, 17]


def test_atoms_that_do_not_match_are_named() -> None:
    models = find_models("spce")
    with pytest.raises(
        ValueError, match=r"no molecule begins with atom 3 \(H-O-H\.\.\.\); the models are spce \(O-H-H\)"
    ):
        assemble(Atoms("OH2HOH"), models)
    atoms = Atoms("OH2OH2")
    atoms.set_array("molecule", np.array([0, 0, 0, 1, 1, 2]))
    with pytest.raises(ValueError, match=r"molecule 1 \(atoms 3 to 4\) is O-H; the models are spce"):
        assemble(atoms, models)
    atoms.set_array("molecule", np.array([0, 0, 1, 1, 1, 0]))
    with pytest.raises(ValueError, match="are not consecutive"):
        assemble(atoms, models)
    with pytest.raises(ValueError, match="have the same atoms: spce"):
        assemble(atoms, find_models(["spce", "tip3p"]))
    with pytest.raises(ValueError, match="without atoms"):
        assemble(Atoms(), models)


def test_a_molecule_of_another_shape_is_named() -> None:
    atoms = plain.box_of({"spce": 8}, 20.0)
    atoms.positions[9:12] = atoms.positions[9] + 1.1 * (atoms.positions[9:12] - atoms.positions[9])
    with pytest.raises(ValueError, match=r"molecule 3: atoms 9 and 10 are 1\.1 Å apart, in model spce 1 Å"):
        RigidPotential("spce").evaluate(atoms)


def test_a_changed_box_is_seen() -> None:
    """The same calculator with other atoms, then with other labels."""
    calc = RigidPotential("spce,argon", cutoff_angstrom=5.0)
    first, second = plain.box_of({"spce": 8}, 20.0), plain.box_of({"spce": 7, "argon": 3}, 20.0)
    for atoms in (first, second, first):
        expected = RigidPotential("spce,argon", cutoff_angstrom=5.0).evaluate(atoms).energy_ev
        assert calc.evaluate(atoms).energy_ev == expected
    second.set_array("molecule", np.zeros(len(second), dtype=int))
    calc.evaluate(first)
    with pytest.raises(ValueError, match="molecule 0 "):
        calc.evaluate(second)
