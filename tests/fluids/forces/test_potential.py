"""Energy, forces and stress of rigid molecules: the plain form, derivatives, invariances, NIST's water, bad input."""

from __future__ import annotations

import gzip
import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import plain_fluid as plain
import pytest
from ase import Atoms
from ase.calculators.calculator import PropertyNotImplementedError

from rotor import units
from rotor.fluids.forces.ewald import EwaldParameters
from rotor.fluids.forces.models import MODELS, RigidModel, Site, find_model
from rotor.fluids.forces.potential import RigidPotential

METHODS = {"reaction-field": math.inf, "shifted": 0.2, "ewald": 0.4}
MIXTURE = {"tip4p": 12, "trappe-n2": 8, "trappe-co2": 9, "argon": 7, "spce": 0}


def potential(models: str, method: str, cutoff: float = 7.0, **more) -> RigidPotential:
    """With Ewald's sum converged, so that truncation does not hide errors."""
    return RigidPotential(
        models,
        cutoff_angstrom=cutoff,
        electrostatics=method,
        ewald=EwaldParameters(0.6, 6.0) if method == "ewald" else None,
        **more,
    )


def mixture() -> tuple[Atoms, list[RigidModel]]:
    """36 molecules of four kinds in a cube of 15 Å."""
    atoms = plain.box_of(MIXTURE, 15.0, seed=3)
    return atoms, [find_model(name) for name, n in MIXTURE.items() for _ in range(n)]


# the plain form


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("width", [0.0, 1.0])
def test_a_mixture_agrees_with_the_plain_form(method: str, width: float) -> None:
    atoms, models = mixture()
    sites, edges = plain.sites_of(atoms, models), np.full(3, 15.0)
    alpha, k_cut = 0.4, 2.5
    calc = RigidPotential(
        "tip4p,trappe-n2,trappe-co2,argon",
        cutoff_angstrom=7.5,
        electrostatics=method,
        switch_width_angstrom=width,
        damping_per_angstrom=0.2,
        ewald=EwaldParameters(alpha, k_cut),
    )
    evaluated = calc.evaluate(atoms)
    dispersion, charges, forces, _ = plain.pair_terms(
        sites, edges, 7.5, width, (method, alpha if method == "ewald" else METHODS[method])
    )
    expected = {"dispersion": dispersion}
    if method == "ewald":
        expected["real_space"] = charges
        expected["fourier"], more = plain.fourier_terms(sites, edges, alpha, k_cut)
        expected["self"] = -plain.COULOMB_EV_ANGSTROM * alpha / math.sqrt(math.pi) * np.sum(sites.charge**2)
        expected["intramolecular"] = plain.inside_terms(sites, alpha)
        forces = forces + more
    else:
        expected[method.replace("-", "_")] = charges
    for name, value in expected.items():
        assert evaluated.terms_ev[name] == pytest.approx(value, rel=1e-12, abs=0), name  # a few hundred roundings
    on_atoms = sites.weights.T @ forces
    if method == "ewald":  # the plain form leaves out the forces inside molecules: compare total force and torque
        by_molecule = np.repeat(np.arange(len(models)), [len(m.symbols) for m in models])
        for m in range(len(models)):
            members, difference = by_molecule == m, evaluated.forces_ev_per_angstrom - on_atoms
            arms = atoms.positions[members] - atoms.positions[members][0]
            assert np.abs(difference[members].sum(axis=0)).max() < 1e-12 * np.abs(on_atoms).max()  # round-off
            assert (
                np.abs(np.cross(arms, difference[members]).sum(axis=0)).max() < 1e-11 * np.abs(on_atoms).max()
            )  # and Å
    else:
        assert np.abs(evaluated.forces_ev_per_angstrom - on_atoms).max() < 1e-12 * np.abs(on_atoms).max()  # round-off


def test_the_virial_is_that_of_centres_of_mass() -> None:
    atoms, models = mixture()
    sites, edges = plain.sites_of(atoms, models), np.full(3, 15.0)
    _, _, _, forces = plain.pair_terms(sites, edges, 7.5, 1.0, ("reaction-field", math.inf))
    masses, m = atoms.get_masses(), sites.molecule
    starts = np.concatenate(([0], np.cumsum([len(model.symbols) for model in models])))
    centres = np.array([np.average(atoms.positions[a:b], axis=0, weights=masses[a:b]) for a, b in pairwise(starts)])
    d = sites.places[None] - sites.places[:, None]
    shift = -edges * np.rint(d / edges)
    arms = centres[m][None] - centres[m][:, None] + shift
    virial = 0.5 * np.einsum("ija,ijb->ab", forces, arms)
    evaluated = RigidPotential("tip4p,trappe-n2,trappe-co2,argon", cutoff_angstrom=7.5).evaluate(atoms).virial_ev
    assert np.abs(evaluated - 0.5 * (virial + virial.T)).max() < 1e-12 * np.abs(virial).max()  # round-off


# derivatives


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", [name for name in MODELS if name != "argon"])
def test_forces_are_the_slope_of_the_energy(name: str, method: str) -> None:
    atoms = plain.box_of({name: 64}, 16.0, seed=5)
    calc = potential(name, method)
    forces, h = calc.evaluate(atoms).forces_ev_per_angstrom, 1e-4
    scale = np.abs(forces).max()
    for atom, axis in [(0, 0), (1, 1), (3, 2), (40, 0)]:
        energies = []
        for step in (h, -h):
            moved = atoms.copy()
            moved.positions[atom, axis] += step
            energies.append(calc.evaluate(moved).energy_ev)
        slope = -(energies[0] - energies[1]) / (2 * h)
        assert forces[atom, axis] == pytest.approx(slope, abs=1e-6 * scale)  # h² of the third derivative, ~100/Å² of F


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["tip4p", "trappe-n2"])
def test_pressure_is_minus_the_slope_with_volume(name: str, method: str) -> None:
    """Molecules keep their shape, their centres of mass are scaled; also along one axis alone."""
    atoms = plain.box_of({name: 64}, 16.0, seed=6)
    calc = potential(name, method, cutoff=6.0)
    atoms.calc = calc
    stress, size = atoms.get_stress(), len(find_model(name).symbols)
    molecules = atoms.positions.reshape(-1, size, 3)
    centres = np.average(molecules, axis=1, weights=atoms.get_masses()[:size])
    h = 1e-5
    for axes, expected in ((slice(0, 3), stress[:3].sum()), (slice(1, 2), stress[1])):
        energies = []
        for step in (h, -h):
            factor = np.ones(3)
            factor[axes] += step
            moved = atoms.copy()
            moved.set_cell(atoms.cell.lengths() * factor)
            moved.positions = (molecules + (centres * (factor - 1))[:, None]).reshape(-1, 3)
            energies.append(calc.evaluate(moved).energy_ev)
        slope = (energies[0] - energies[1]) / (2 * h * atoms.get_volume())
        assert expected == pytest.approx(slope, rel=2e-5)  # h² and what Ewald's sum leaves out, 1e-7


def test_energy_and_force_go_smoothly_to_nothing_at_the_cutoff() -> None:
    """Two waters drawn apart through the cutoff: reaction field with a conductor, switched Lennard-Jones."""
    calc = RigidPotential("spce", cutoff_angstrom=9.0)
    atoms = plain.box_of({"spce": 2}, 40.0, spread=0.0)
    atoms.positions[3:] += atoms.positions[0] - atoms.positions[3]
    forces, energies, steps = [], [], np.arange(8.0, 11.2, 0.002)
    for distance in steps:
        moved = atoms.copy()
        moved.positions[3:, 0] += distance
        evaluated = calc.evaluate(moved)
        energies.append(evaluated.terms_ev["dispersion"] + evaluated.terms_ev["reaction_field"])
        forces.append(evaluated.forces_ev_per_angstrom[3:, 0].sum())
    energies, forces = np.array(energies), np.array(forces)
    assert energies[-1] == 0.0
    slope = -np.gradient(energies, steps)
    assert np.abs(slope - forces)[1:-1].max() < 1e-2 * np.abs(forces).max()  # a quarter step of the force's kink
    assert np.abs(np.diff(forces)).max() < 5e-2 * np.abs(forces).max()  # its slope, up to 20 per Å


# invariances


def cluster() -> Atoms:
    """Eight molecules of TIP4P in open space."""
    atoms = plain.box_of({"tip4p": 8}, 9.0, seed=2)
    atoms.pbc = False
    return atoms


def test_a_cluster_feels_no_net_force_or_torque_and_may_be_turned_and_moved() -> None:
    atoms = cluster()
    calc = RigidPotential("tip4p", cutoff_angstrom=math.inf)
    evaluated = calc.evaluate(atoms)
    size = np.abs(evaluated.forces_ev_per_angstrom).max()
    assert np.abs(evaluated.forces_ev_per_angstrom.sum(axis=0)).max() < 1e-13 * size * len(
        atoms
    )  # Newton's third law, round-off
    torque = np.cross(atoms.positions, evaluated.forces_ev_per_angstrom).sum(axis=0)
    assert np.abs(torque).max() < 1e-12 * size * len(atoms)  # round-off, arms of 10 Å
    turned = atoms.copy()
    turned.rotate(33.0, (1, 2, -1))
    turned.positions += (100.0, -7.0, 3.0)
    again = calc.evaluate(turned)
    assert again.energy_ev == pytest.approx(evaluated.energy_ev, rel=1e-11)  # round-off of positions, 1e-14 of 100 Å
    back = Atoms(positions=again.forces_ev_per_angstrom)
    back.rotate(-33.0, (1, 2, -1))
    assert np.abs(back.positions - evaluated.forces_ev_per_angstrom).max() < 1e-10 * size  # the same


def test_an_open_pair_has_coulomb_and_lennard_jones_and_nothing_else() -> None:
    atoms = plain.box_of({"spce": 2}, 6.0, seed=4)
    atoms.pbc = False
    model = find_model("spce")
    sites = plain.sites_of(atoms, [model, model])
    d = np.linalg.norm(sites.places[:3, None] - sites.places[None, 3:], axis=-1)
    qq = plain.COULOMB_EV_ANGSTROM * sites.charge[:3, None] * sites.charge[None, 3:]
    six = (model.sites[0].sigma_angstrom / d[0, 0]) ** 6
    expected = np.sum(qq / d) + 4 * model.sites[0].epsilon_ev * (six**2 - six)
    assert RigidPotential("spce", cutoff_angstrom=math.inf).evaluate(atoms).energy_ev == pytest.approx(
        expected, rel=1e-13
    )


@pytest.mark.parametrize("method", METHODS)
def test_molecules_may_be_broken_by_the_edge_or_lie_in_other_cells(method: str) -> None:
    atoms = plain.box_of({"tip3p": 64}, 14.0, seed=7)
    calc = potential("tip3p", method)
    evaluated = calc.evaluate(atoms)
    moved = atoms.copy()
    moved.positions += (5.0, -3.3, 8.1)
    moved.wrap()
    assert np.ptp(moved.positions[:, 0].reshape(-1, 3), axis=1).max() > 7  # some are broken
    moved.positions += 14.0 * np.random.default_rng(1).integers(-2, 3, size=moved.positions.shape)
    again = potential("tip3p", method).evaluate(moved)
    assert again.energy_ev == pytest.approx(evaluated.energy_ev, rel=1e-11)  # round-off of positions, terms that cancel
    difference = again.forces_ev_per_angstrom - evaluated.forces_ev_per_angstrom
    assert np.abs(difference).max() < 1e-11 * np.abs(evaluated.forces_ev_per_angstrom).max()  # the same


def test_threads_change_the_last_digits_only_and_repeat_bit_for_bit() -> None:
    atoms = plain.box_of({"spce": 125}, 16.0, seed=8)
    evaluated = potential("spce", "ewald").evaluate(atoms)
    two = [potential("spce", "ewald", threads=2).evaluate(atoms) for _ in range(2)]
    assert two[0].energy_ev == two[1].energy_ev
    assert (two[0].forces_ev_per_angstrom == two[1].forces_ev_per_angstrom).all()
    assert two[0].energy_ev == pytest.approx(evaluated.energy_ev, rel=1e-12)  # another order of the sum
    difference = np.abs(two[0].forces_ev_per_angstrom - evaluated.forces_ev_per_angstrom).max()
    assert difference < 1e-12 * np.abs(evaluated.forces_ev_per_angstrom).max()  # the same


def test_reset_gives_the_bits_of_a_new_calculator() -> None:
    rng, atoms = np.random.default_rng(3), plain.box_of({"spce": 125}, 16.0, seed=8)
    calc = RigidPotential("spce", cutoff_angstrom=7.0)
    atoms.calc = calc
    atoms.get_potential_energy()
    atoms.positions += np.repeat(rng.normal(size=(125, 3)) * 0.1, 3, axis=0)
    calc.reset()
    old, new = atoms.get_forces(), RigidPotential("spce", cutoff_angstrom=7.0).get_forces(atoms)
    assert (old == new).all()


def test_ase_gets_what_is_asked_for_and_nothing_is_reckoned_twice() -> None:
    atoms = plain.box_of({"spce": 125}, 16.0, seed=8)
    calc = RigidPotential("spce", cutoff_angstrom=7.0)
    requests: list[int] = []
    plainly = calc.evaluate
    calc.evaluate = lambda box: (requests.append(1), plainly(box))[1]
    atoms.calc = calc
    with pytest.raises(ValueError, match="no atoms were given"):
        calc.get_potential_energy()
    forces = atoms.get_forces()
    assert atoms.get_potential_energy() == math.fsum(calc.terms_ev.values())
    assert len(atoms.get_stress()) == 6
    assert len(requests) == 1
    forces[:] = 0.0  # a copy
    assert atoms.get_forces().any()
    atoms.positions[0:3] += 1e-12
    assert calc.get_property("energy", atoms, allow_calculation=False) is None
    atoms.get_forces()
    assert (len(requests), calc.rebuilds) == (2, 1)  # lists outlive a small move
    atoms.set_cell([16.1] * 3)
    expected = RigidPotential("spce", cutoff_angstrom=7.0).evaluate(atoms).energy_ev
    assert atoms.get_potential_energy() == expected
    atoms.pbc = False
    with pytest.raises(PropertyNotImplementedError, match="repeats in all"):
        atoms.get_stress()
    with pytest.raises(PropertyNotImplementedError, match="magmoms: there are energy"):
        calc.get_property("magmoms", atoms)


# NIST's water

SAMPLES = {
    1: (9.95387e4, -8.23715e2, -5.58889e5, 6.27009e3, -2.84469e6, 2.80999e6, -4.88604e5),
    2: (1.93712e5, -3.29486e3, -1.19295e6, 6.03495e3, -5.68938e6, 5.61998e6, -1.06590e6),
    3: (3.54344e5, -7.41343e3, -1.96297e6, 5.24461e3, -8.53407e6, 8.42998e6, -1.71488e6),
    4: (4.48593e5, -1.37286e4, -3.57226e6, 7.58785e3, -1.42235e7, 1.41483e7, -3.20501e6),
}  # NIST Standard Reference Simulation Website, SPC/E reference calculations, 10 Å: energies over k_B in K
NAMES = ("dispersion", "long_range_correction", "real_space", "fourier", "self", "intramolecular")
CODATA_2010 = 1.602176565e-19**2 / (4 * math.pi * 8.854187817e-12) * 1e10 / 1.3806488e-23  # e²/4πε0 k_B, K Å, as NIST's
CODATA_2022 = plain.COULOMB_EV_ANGSTROM / units.EV_PER_K


def sample(number: int, shared: Path) -> Atoms:
    """One of NIST's boxes."""
    path = shared / "reference" / "nist_spce" / f"spce_sample_config_periodic{number}.txt.gz"
    lines = [line.split() for line in gzip.decompress(path.read_bytes()).decode().splitlines() if line.strip()]
    edges, rows = [float(x) for x in lines[0]], lines[2:]
    return Atoms(
        [row[4] for row in rows], positions=[[float(x) for x in row[1:4]] for row in rows], cell=edges, pbc=True
    )


def terms_k(atoms: Atoms, factor: float = 1.0) -> list[float]:
    """The six terms in K under NIST's conditions (k² < 27: up to √26.5), charges in the constants of their time."""
    edge = atoms.cell.lengths()[0]
    ewald = EwaldParameters(factor * 5.6 / edge, 2 * math.pi / edge * math.sqrt(26.5))
    calc = RigidPotential("spce", cutoff_angstrom=10.0, electrostatics="ewald", ewald=ewald, switch_width_angstrom=0.0)
    terms = calc.evaluate(atoms).terms_ev
    scale = [1.0, 1.0] + [CODATA_2010 / CODATA_2022] * 4
    return [terms[name] / units.EV_PER_K * s for name, s in zip(NAMES, scale, strict=True)]


def printed(values: list[float]) -> list[str]:
    """Six digits, as NIST prints."""
    return [f"{value:.5e}" for value in values]


@pytest.mark.oracle
@pytest.mark.parametrize("number", SAMPLES)
def test_nist_water_to_all_printed_digits(number: int, shared: Path) -> None:
    """Term by term; the printed total is the sum of the printed terms."""
    computed = printed(terms_k(sample(number, shared)))
    assert computed == printed(list(SAMPLES[number][:6]))
    assert f"{sum(float(x) for x in computed):.5e}" == f"{SAMPLES[number][6]:.5e}"


@pytest.mark.oracle
def test_nist_water_notices_a_moved_molecule_and_another_alpha(shared: Path) -> None:
    atoms = sample(1, shared)
    expected = printed(list(SAMPLES[1][:6]))
    changed = [a != b for a, b in zip(printed(terms_k(atoms, factor=1.001)), expected, strict=True)]
    assert changed == [False, False, True, True, True, True]
    atoms.positions[30:33] += 0.01
    changed = [a != b for a, b in zip(printed(terms_k(atoms)), expected, strict=True)]
    assert changed == [True, False, True, True, False, False]


# bad input


def test_positions_that_are_no_numbers_are_named() -> None:
    atoms = plain.box_of({"spce": 8}, 20.0)
    atoms.positions[7, 1] = np.nan
    with pytest.raises(ValueError, match="position of atom 7"):
        RigidPotential("spce").evaluate(atoms)


@pytest.mark.parametrize("shift", [0.0, 0.2])
def test_atoms_on_top_of_each_other_are_named(shift: float) -> None:
    atoms = plain.box_of({"spce": 8}, 20.0)
    atoms.positions[12:15] += (
        atoms.positions[4] - atoms.positions[12] + (shift, 0, 0)
    )  # O of molecule 4 on H of molecule 1
    calc = RigidPotential("spce")
    for _ in range(2):  # asking again does not help
        with pytest.raises(ValueError, match=r"atoms (4 and 12|12 and 4) of different molecules are (0|0\.2) Å apart"):
            calc.evaluate(atoms)


def test_cells_too_small_or_askew_or_flat_are_refused() -> None:
    atoms = plain.box_of({"spce": 8}, 17.0)
    with pytest.raises(
        ValueError, match=r"more than half of the smallest edge of the cell, 17 Å: give a cutoff of at most 8\.5 Å"
    ):
        RigidPotential("spce").evaluate(atoms)
    small = plain.box_of({"trappe-co2": 1}, 4.4)
    with pytest.raises(ValueError, match="a molecule would meet itself"):
        RigidPotential("trappe-co2", cutoff_angstrom=2.2).evaluate(small)
    atoms.set_cell([[20, 0, 0], [5, 20, 0], [0, 0, 20]])
    with pytest.raises(ValueError, match="right angles"):
        RigidPotential("spce").evaluate(atoms)
    atoms.set_cell([20, 20, 0])
    with pytest.raises(ValueError, match="need an edge above 0"):
        RigidPotential("spce").evaluate(atoms)


def test_open_boxes_refuse_what_needs_a_cell() -> None:
    with pytest.raises(ValueError, match="repeats in all three"):
        RigidPotential("tip4p", electrostatics="ewald").evaluate(cluster())
    atoms = cluster()
    atoms.pbc = True
    with pytest.raises(ValueError, match="needs a finite cutoff"):
        RigidPotential("tip4p", cutoff_angstrom=math.inf).evaluate(atoms)
    atoms.pbc = False
    atoms.calc = RigidPotential("tip4p")
    with pytest.raises(PropertyNotImplementedError):
        atoms.get_stress()


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"cutoff_angstrom": 0.0}, "above 0"),
        ({"cutoff_angstrom": math.nan}, "above 0"),
        ({"threads": 0}, "above 0"),
        ({"electrostatics": "pme"}, "one of reaction-field"),
        ({"electrostatics": "ewald", "cutoff_angstrom": math.inf}, "open boxes"),
        ({"switch_width_angstrom": 9.5}, "0 up to the cutoff"),
        ({"models": "spc"}, "is no model"),
    ],
)
def test_settings_are_checked(wrong: dict, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        RigidPotential(**wrong)


def test_charges_of_a_model_must_cancel() -> None:
    with pytest.raises(ValueError, match=r"charges add up to 0\.5 e"):
        RigidModel("ion", (Site("Na", (0.0, 0.0, 0.0), 0.5),), "none")
