"""Tests for mutants that others let pass (benchmarks/mutation.py): each goes red for its mutant."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import rotor
from rotor.formats.spcat.hamiltonian.codes import _whole_code
from rotor.formats.spcat.text.par import Parameter
from rotor.quantum.wang import wang_matrix
from rotor.requests.plan import Growth, Run

# Refusals


def test_a_molecule_without_a_geometry_is_refused_by_assign(call):
    """Its isotopologues would be left out without a word."""
    Path("peaks.csv").write_text("frequency_mhz,intensity\n" + "".join(f"{8000 + 90.5 * k},1\n" for k in range(20)))
    Path("a.toml").write_text(
        'name = "a"\n[constants]\nunit = "MHz"\nsource = "b"\nA = 9000.0\nB = 3000.0\nC = 2500.0\n'
    )
    code, _, err = call("assign", "peaks.csv", "--molecule", "a.toml")
    assert (code, err.count("\n")) == (2, 1)
    assert "holds no geometry" in err


@pytest.mark.parametrize("text", ["300,2e6", "1e7", "10:1.1e6K:3"])
def test_temperatures_beyond_molecules_are_refused(call, text):
    code, out, err = call("info", "CO", "--temperature", text)
    assert (code, out) == (2, "")
    assert "up to 1e+06 K; no molecule lasts beyond" in err


def test_a_folder_without_catalogues_is_named(call):
    Path("none").mkdir()
    Path("s.txt").write_text(
        "".join(f"{100000 + k} {np.exp(-((k - 50) ** 2)) + 0.01 * np.sin(7.0 * k):.6f}\n" for k in range(100))
    )
    code, _, err = call("identify", "s.txt", "--catalogue", "none", "--width", "2")
    assert code == 2
    assert "none: no .cat file in this folder" in err


def test_a_table_of_levels_names_its_file(folder):
    Path("levels.csv").write_text("j,ka,kc,energy_mhz,error_mhz\n0,0,0,0,0\n1,0,1,9,1\n1,0,1,9,1\n")
    from rotor.formats.molecules.level_table import read_level_table

    with pytest.raises(ValueError, match=r"^levels.csv: the level .* is twice in the table"):
        read_level_table("levels.csv")


@pytest.mark.parametrize(
    "code", [10000000000, 110010000, 111, 0]
)  # of a series, a spin, another state, the energy of a state
def test_codes_without_names_are_refused(code):
    with pytest.raises(ValueError, match=f"parameter {code}: its operator cannot be said by the named constants"):
        _whole_code(Parameter(code, 1.0, 0.0))


@pytest.mark.parametrize(
    ("fields", "what"),
    [
        ({"i2": 1}, "a commutator"),
        ({"typ": 82, "ns": 1}, "a power of N·S of one K"),
        ({"typ": 92}, "a term of a series"),
        ({"ff": 1}, "a term of a series"),
        ({"ns": 5, "typ": 1}, "N_z S_z together with another operator"),
        ({"ns": 5, "i1": 1}, "N_z S_z together with another operator"),
    ],
)
def test_codes_without_an_operator_are_refused_with_their_meaning(fields, what):
    """Another operator would be computed in their place."""
    from rotor.formats.spcat.hamiltonian.code_table import Digits
    from rotor.formats.spcat.hamiltonian.series import Series, coded_operator

    with pytest.raises(ValueError, match=f"{what}.* is read but not computed yet"):
        coded_operator(Digits(**{**dict.fromkeys(Digits._fields, 0), **fields}), "bca", Series(), None)


def test_a_solver_that_does_not_converge_raises(monkeypatch):
    """info > 0 of dstevd: off-diagonal elements that did not vanish; its energies are none."""
    import scipy.linalg.lapack

    size = wang_matrix.SMALL + 5
    unfinished = (np.zeros(size), np.eye(size), 3)
    monkeypatch.setattr(scipy.linalg.lapack, "dstevd", lambda *_, **__: unfinished)
    with pytest.raises(ValueError, match=rf"did not converge on a block of size {size} \(info = 3\)"):
        wang_matrix.diagonalise_all([[np.arange(size) ** 2.0, np.ones(size - 1)]])


def test_a_data_frame_whose_library_lacks_a_part_says_which(monkeypatch):
    """That pandas is not installed would be the wrong advice."""
    import importlib

    def lacks(name):
        raise ModuleNotFoundError("No module named 'dateutil'", name="dateutil")

    table = rotor.levels("CO", jmax=1).table
    monkeypatch.setattr(importlib, "import_module", lacks)
    with pytest.raises(ModuleNotFoundError, match="dateutil"):
        table.to_pandas()


def test_an_atom_is_refused_as_an_atom_and_not_as_a_drawing():
    """Of one atom a flat drawing is the whole geometry."""
    from rdkit import Chem
    from rdkit.Chem import AllChem

    atom = Chem.MolFromSmiles("[Ar]")
    AllChem.Compute2DCoords(atom)
    with pytest.raises(ValueError, match="a single atom"):
        rotor.read(atom)


@pytest.mark.parametrize(
    "module",
    ["rotor", "rotor.api", "rotor.formats", "rotor.scenes.scene", "rotor.thermodynamics"],
)
def test_modules_that_load_names_late_refuse_names_that_do_not_exist(module):
    """Without an error hasattr is true of anything, and a misspelt function is None."""
    from importlib import import_module

    with pytest.raises(AttributeError, match="no_such_name"):
        import_module(module).no_such_name  # noqa: B018


def test_lines_by_other_quantum_numbers_are_not_merged():
    """J of one list would be paired with J, Ka, Kc of the other."""
    from rotor.fitting.assignment import assignments, merged

    linear = assignments(("j",), [[1]], [[0]], [100.0], 0.1)
    asymmetric = assignments(("j", "ka", "kc"), [[1, 0, 1]], [[0, 0, 0]], [100.0], 0.1)
    with pytest.raises(ValueError, match="lines by j and by j, ka, kc cannot be merged"):
        merged(linear, asymmetric)


def test_standard_input_that_goes_on_for_too_long_is_refused(monkeypatch):
    """What is cut off silently would be another molecule."""
    import io
    from types import SimpleNamespace

    from rotor.formats import read_write

    text = b"2\n\nC 0 0 0\nO 0 0 1.1283\n"
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(text)))
    monkeypatch.setattr(read_write, "HARMLESS_BYTES", len(text))
    assert rotor.read("-").molecule.symbols == ("C", "O")
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(text)))
    monkeypatch.setattr(read_write, "HARMLESS_BYTES", len(text) - 1)
    with pytest.raises(ValueError, match="standard input exceeds"):
        rotor.read("-")


@pytest.mark.parametrize(
    ("molecules", "rule"),
    [
        ([[0, 0, 1], [2, 3]], "molecule 0 lists an atom twice"),
        ([[0, 1], [1, 2, 3]], "molecule 1 lists an atom twice, or one of another"),
        ([[0, 1], [2]], "atom 3 is in none of the molecules"),
        ([[0, 1], [2, 4]], "molecule 1 lists an atom that is not one of 0 to 3"),
    ],
)
def test_each_atom_of_a_box_is_in_one_molecule(molecules, rule):
    from ase import Atoms

    from rotor.fluids.motion.bodies import _labels

    box = Atoms("N4", positions=np.arange(12.0).reshape(4, 3))
    assert _labels(box, [[2, 3], [0, 1]]).tolist() == [1, 1, 0, 0]
    with pytest.raises(ValueError, match=rule):
        _labels(box, molecules)


@pytest.mark.parametrize("times", [[0.0, 1.0, 1.0], [0.0, 2.0, 1.0], [[0.0, 1.0, 2.0]]])
def test_moments_by_time_need_rising_times(times):
    """Of two moments at one time neither is the right one."""
    from rotor.classical.effects.changing_inertia import MomentsByTime

    rows = [[1.0, 2.0, 2.5]] * 3
    assert MomentsByTime([0.0, 1.0, 2.0], rows).rows.shape == (3, 3)
    with pytest.raises(ValueError, match="expected rising times"):
        MomentsByTime(times, rows)


def test_lines_that_no_dipole_makes_are_named_and_others_are_not():
    """Moments along a, b and c change Kc, both, or Ka by odd numbers (1_01, 1_11 and 1_10 from 0_00), and J by 0 or 1."""
    from rotor.fitting.assignment import assignments
    from rotor.fitting.reports.fit_notes import unlikely_lines

    def said(upper, lower):
        return unlikely_lines(assignments(("j", "ka", "kc"), [upper], [lower], [1e4], 0.1))

    for upper in ([1, 0, 1], [1, 1, 1], [1, 1, 0]):
        assert said(upper, [0, 0, 0]) == []
    assert "J changes by more than 1" in said([2, 0, 2], [0, 0, 0])[0]
    assert "Ka and Kc both change by even numbers" in said([2, 2, 1], [1, 0, 1])[0]


@pytest.mark.parametrize(("unit", "factor"), [("mhz", 1.0), ("khz", 1e-3)])
def test_widths_of_blends_are_read_in_their_unit(folder, unit, factor):
    from rotor.formats.lines.assigned_lines import read_assigned_lines

    rows = "1,0,12000,0.01,7,20\n2,1,24000,0.01,7,20\n"
    Path("lines.csv").write_text(f"j_upper,j_lower,frequency_mhz,error_mhz,blend,width_{unit}\n{rows}")
    lines, _ = read_assigned_lines("lines.csv", ("j",))
    assert list(lines.widths_mhz.values()) == [20.0 * factor]


def test_infinite_numbers_are_no_values_in_tables_of_files(folder):
    """A reader in another language would meet text in a column of numbers."""
    import duckdb

    from rotor.formats.tables import copy_columns

    columns = {"x": np.array([1.5, np.inf, -np.inf, np.nan]), "n": np.arange(4), "name": np.array(["a", "b", "c", "d"])}
    copy_columns(columns, Path("t.parquet"), "(FORMAT parquet)")
    rows = duckdb.sql("SELECT x, n, name FROM 't.parquet'").fetchall()
    assert [row[1:] for row in rows] == [(0, "a"), (1, "b"), (2, "c"), (3, "d")]
    assert rows[0][0] == 1.5
    assert all(row[0] is None or np.isnan(row[0]) for row in rows[1:])


def test_a_sum_of_cosines_at_even_times_is_the_plain_sum_without_its_exponentials(monkeypatch):
    """2√t exponentials a line instead of t; uneven times have no other way than the plain sum."""
    from rotor.alignment import observables

    rng, times = np.random.default_rng(3), np.linspace(-2.0, 7.0, 60)
    amplitudes, omegas = rng.normal(size=5) + 1j * rng.normal(size=5), rng.normal(size=5)
    plain = (amplitudes[:, None] * np.exp(1j * np.outer(omegas, times))).real.sum(axis=0)
    uneven = times + 0.01 * np.sin(times)
    assert observables.harmonic_sum(amplitudes, omegas, uneven) == pytest.approx(
        (amplitudes[:, None] * np.exp(1j * np.outer(omegas, uneven))).real.sum(axis=0), abs=1e-12
    )  # round-off of five terms
    monkeypatch.delattr(observables, "_plain_sum")
    assert observables.harmonic_sum(amplitudes, omegas, times) == pytest.approx(plain, abs=1e-12)


def test_lines_that_stand_twice_are_named_with_how_far_they_are_apart():
    from rotor.fitting.assignment import assignments
    from rotor.fitting.reports.fit_notes import repeated_text

    lines = assignments(("j",), [[1], [2], [1], [2]], [[0], [1], [0], [1]], [100.0, 200.0, 100.25, 200.5], 0.1)
    assert "the largest difference is 0.5 MHz, of 2 - 1" in repeated_text(lines, [(0, 2), (1, 3)])


def test_bodies_that_rotate_freely_are_written_in_a_line():
    from rotor.classical.free.free_motion import free_motion

    moments = [1.0, 2.0, 3.0]
    assert repr(free_motion([moments] * 2, [[0.1, 0.2, 2.0]] * 2)) == "FreeMotion(2 bodies)"
    assert repr(free_motion(moments, [0.0, 0.0, 2.0])).startswith("FreeMotion(moments 1, 2, 3; momentum 0, 0, 2; ")


def test_what_is_removed_after_killed_processes_is_ours_alone(folder):
    """A folder and the lock of a file; no link, which may lead anywhere, and no other file of that name."""
    from rotor.temporary import _is_ours

    Path("folder").mkdir()
    Path("link").symlink_to("folder", target_is_directory=True)
    for name in (".rotor-lock-a.csv", "notes"):
        Path(name).touch()
    judged = {name: _is_ours(Path(name)) for name in ("folder", "link", "notes", ".rotor-lock-a.csv")}
    assert judged == {"folder": True, "link": False, "notes": False, ".rotor-lock-a.csv": True}


@pytest.mark.parametrize(("pbc", "is_box"), [("T T T", True), ("T T F", True), ("F F F", False)])
def test_a_box_repeats_along_one_direction_or_more(folder, pbc, is_box):
    """A slab is a box; what the engines cannot take of it they refuse."""
    from rotor.formats.boxes import read_box

    lattice = 'Lattice="9 0 0 0 9 0 0 0 9" Properties=species:S:1:pos:R:3'
    Path("box.extxyz").write_text(f'1\n{lattice} pbc="{pbc}"\nAr 0 0 0\n')
    if is_box:
        assert read_box("box.extxyz").pbc.tolist() == [letter == "T" for letter in pbc.split()]
    else:
        with pytest.raises(ValueError, match="has no periodic cell"):
            read_box("box.extxyz")


# Equilibration of a box


@pytest.fixture
def box(monkeypatch):
    """A box whose translation is at 300 K and whose rotation at 270 K, and the times (ps) to which it was run."""
    from types import SimpleNamespace

    from rotor.fluids import equilibration

    times = []

    def advance(dynamics, bath, time_ps, rows, progress, longest):
        times.append(time_ps)
        dynamics.nsteps = round(time_ps * 1e3 / bath.step_fs)
        rows.extend([[-1.0, 300.0, 270.0, 1.0]] * 8)

    degrees = SimpleNamespace(translation=3, rotation=3)
    dynamics = SimpleNamespace(nsteps=0, degrees=degrees, wrench=lambda: None)
    monkeypatch.setattr(equilibration, "make_dynamics", lambda atoms, bath: dynamics)
    monkeypatch.setattr(equilibration, "_advance", advance)
    monkeypatch.setattr(equilibration, "is_stationary", lambda rows, kelvin: False)
    return times


def test_a_box_that_does_not_settle_is_run_half_as_long_again_up_to_a_limit(box):
    from rotor.fluids.equilibration import GROWTH, LONGEST_PS, SHORTEST_PS, equilibrate
    from rotor.fluids.settings import Settings

    ran = equilibrate(None, Settings(ensemble="langevin"))
    assert box == pytest.approx([*SHORTEST_PS * GROWTH ** np.arange(len(box) - 1), LONGEST_PS])
    assert len(box) == 7  # 10 ps times 1.5^5 is 76 ps
    assert (ran.time_ps, ran.stationary) == (LONGEST_PS, False)
    assert ran.rotation_over_translation == pytest.approx(0.9)
    assert ran.temperature_k == pytest.approx(285.0)  # as many degrees of freedom of both


def test_a_box_that_fails_is_stopped_with_the_step(box, monkeypatch):
    from rotor.checks import RunStopped
    from rotor.fluids import equilibration
    from rotor.fluids.settings import Settings

    def fail(*_):
        raise FloatingPointError("forces are not finite")

    monkeypatch.setattr(equilibration, "_advance", fail)
    with pytest.raises(RunStopped, match=r"forces are not finite \(step 1 of the equilibration\)"):
        equilibration.equilibrate(None, Settings())


# Equality


def test_an_array_is_the_same_as_an_array_alone():
    """A list, a number or an array of another shape differs, in either order."""
    from rotor.arrays import same

    array = np.array([1.0, np.nan])
    assert same(array, array.copy())
    for other in ([1.0, np.nan], 1.0, None, array[None, :], array[:1]):
        assert not same(array, other)
        assert not same(other, array)


# Costs


def test_a_cost_proportional_to_the_work_is_extrapolated_exactly(monkeypatch):
    """t = 10 + 3 n from n = 4 and 8 gives 310 at n = 100; a call that is no larger is measured itself."""

    def taken(cost, size):
        """What a clock would say of a call; the short calls are long enough."""
        calls.clear()
        run = Run(None, lambda n: calls.append(n) or cost(n))
        return Growth((4, 8))(size, run, lambda size: size, lambda size, n: n).seconds

    calls = []
    monkeypatch.setattr("rotor.requests.plan.timed", lambda call: (None, call()))
    monkeypatch.setattr("rotor.requests.plan.traced", lambda call: (None, 0.0))

    measured = taken(lambda n: 10.0 + 3.0 * n, 100)
    assert measured == pytest.approx(310.0, rel=1e-14)  # round-off of three operations
    assert calls == [8, 4]  # no call is timed twice
    assert taken(lambda n: 10.0 + 3.0 * n, 6) == 28.0
    falling = taken(lambda n: 10.0 - n, 100)
    assert falling == 2.0  # noise of a clock: no cost falls with the work


def test_the_steps_are_chosen_by_the_block_with_the_largest_population(monkeypatch):
    """What hardly any molecule is in says little about the steps that the cosines need."""
    from types import SimpleNamespace

    from rotor.alignment.propagation import steps

    weights = {"even": [0.1, 0.05], "odd": [0.5, 0.2], "none": None, "rest": [0.15]}
    tasks = {
        name: None if w is None else SimpleNamespace(name=name, weights=np.array(w), columns=np.arange(len(w)))
        for name, w in weights.items()
    }
    monkeypatch.setattr(steps, "block_task", lambda problem, block, plan, before: tasks[block])
    monkeypatch.setattr(steps, "Plan", lambda windows, passages: None)
    problem = SimpleNamespace(m_values=lambda space: [0, 1], windows=(), begins_before=True)
    space = SimpleNamespace(blocks=lambda m: list(weights) if m == 0 else [])
    task, whole = steps.pilot_task(problem, space)
    assert (task.name, whole) == ("odd", False)


def test_a_line_is_seen_above_the_noise_and_above_half_its_height():
    """Of three expected lines of 10, 10 and 4 σ the spectrum shows 8, 4 (less than half) and 2.5 σ (in the noise)."""
    from rotor.observed.identification.identify import _lines_seen
    from rotor.observed.spectrum import ObservedSpectrum

    expected, shown = np.zeros(40), np.zeros(40)
    for channel, height, seen in ((5, 10.0, 8.0), (15, 10.0, 4.0), (25, 4.0, 2.5)):
        expected[channel - 1 : channel + 2] = [0.5 * height, height, 0.5 * height]
        shown[channel] = seen
    spectrum = ObservedSpectrum(1e5 + np.arange(40.0), shown, np.ones(40))
    assert _lines_seen(spectrum, expected) == (3, 1)


def test_an_energy_of_the_only_state_moves_no_line():
    """A parameter of code 0 beside B has no name in a top: the file is computed as it stands, and only energies move."""
    from rotor.formats.spcat.fits.fit_input import _named_constants
    from rotor.formats.spcat.predict import predict
    from rotor.formats.spcat.text.int_file import read_int
    from rotor.formats.spcat.text.par import read_par

    expected = read_int(b"OCS\n 0 60503 1028.6 0 3 -9 -9 99 300\n 1 0.71519\n")
    alone = predict(read_par(b"OCS\n 1 0 0 0\nl -1 1 0 0\n 100 6081.492 0\n"), expected)
    file = read_par(b"OCS\n 2 0 0 0\nl -1 1 0 0\n 100 6081.492 0\n 0 29979.2458 0\n")
    moved = predict(file, expected)
    assert _named_constants(file) is None  # a fit takes the codes themselves
    assert moved.catalogue.frequency_mhz == pytest.approx(
        alone.catalogue.frequency_mhz, abs=1e-9
    )  # round-off of 36 GHz
    assert moved.catalogue.energy_lower_cm == pytest.approx(
        alone.catalogue.energy_lower_cm + 1.0, abs=1e-4
    )  # written with 4 digits


@pytest.mark.parametrize(
    ("status", "iterations", "goes_on"), [("stalled", 3, True), ("interrupted", 3, False), ("stalled", 20, False)]
)
def test_a_fit_tries_another_way_while_it_may(status, iterations, goes_on):
    """Neither after Ctrl-C nor when its iterations are over."""
    from types import SimpleNamespace

    from rotor.fitting.search import strategies

    search = SimpleNamespace(options=SimpleNamespace(most_iterations=20))
    reached = {"stalled": strategies.STALLED, "interrupted": strategies.INTERRUPTED}[status]
    assert strategies._is_open(search, SimpleNamespace(status=reached, iterations=[None] * iterations)) is goes_on


@pytest.mark.parametrize(("jmax", "compared"), [(5, 5), (90, 30)])
def test_the_truncation_of_a_torsion_is_compared_at_a_bounded_j(monkeypatch, jmax, compared):
    """A plan of J = 90 would otherwise solve J = 90 twice before anything is computed."""
    from types import SimpleNamespace

    from rotor.quantum.estimates.plans import MOST_J_COMPARED, torsional_parts
    from rotor.quantum.internal_rotation import levels, truncation

    monkeypatch.setattr(levels, "turning_tops", lambda top, constants: None)
    monkeypatch.setattr(truncation, "truncation_mhz", lambda model, j, vt_max, count: 1e-3 * j)
    texts = dict(torsional_parts(None, SimpleNamespace(functions=9, tops=1, vt_max=0), jmax))
    assert MOST_J_COMPARED[1] == 30
    assert texts["truncation"] == f"at most {1e-3 * compared:.1g} MHz at J = {compared}, v_t up to 0"
