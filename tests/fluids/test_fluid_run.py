"""Long runs: kept, killed, resumed bit for bit; full disks, broken forces, files that were changed."""

import io
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ase.io import read
from fluid_run_case import FILES, SETTINGS, box
from places import PROJECT

from rotor.checks import RunStopped
from rotor.fluids.checkpoint import AseTrajectory, TextFile, read_checkpoint
from rotor.fluids.forces.models import find_model
from rotor.fluids.initial_box import lattice_box
from rotor.fluids.record import FluidRecord
from rotor.fluids.request import FluidRequest, NewBox, answer_fluid
from rotor.fluids.run import Outputs, make_calculator, make_dynamics, pressure_bar, run_fluid

ENSEMBLES = ("nve", "langevin", "nose-hoover")


def stop_after(step):
    """What a run is asked to do, and what ends it there as a signal would."""

    def progress(now, steps, speed):
        if now >= step:
            raise KeyboardInterrupt

    return progress


def same(record: FluidRecord, other: FluidRecord) -> bool:
    return all(
        np.array_equal(a, b, equal_nan=True)
        for a, b in zip(record.columns.values(), other.columns.values(), strict=True)
    )


def lines(path):
    return Path(path).read_text().splitlines()


@pytest.mark.parametrize("ensemble", ENSEMBLES)
def test_a_run_cut_anywhere_and_resumed_is_the_uninterrupted_one(folder, monkeypatch, ensemble):
    monkeypatch.setattr("rotor.fluids.run.BAR_INTERVAL_S", -1.0)
    settings = replace(SETTINGS, ensemble=ensemble)
    (folder / "a").mkdir()
    os.chdir("a")
    whole = box()
    record = run_fluid(whole, settings, FILES)
    (folder / "b").mkdir()
    os.chdir("../b")
    for step in (5, 14, 33, 34):  # in the first interval, on a checkpoint, twice between others
        with pytest.raises(KeyboardInterrupt):
            run_fluid(box(), settings, FILES, resume=step > 5, progress=stop_after(step))
    with open("run.csv", "a") as file:
        file.write(
            "0.03,-1.5\n" * 2000 + "0.03"
        )  # many rows and half a row beyond the checkpoint, more than come after it
    resumed = box()
    again = run_fluid(resumed, settings, FILES, resume=True)
    assert same(record, again)
    assert len(again) == 16
    assert np.array_equal(whole.positions, resumed.positions)
    assert np.array_equal(whole.get_momenta(), resumed.get_momenta())
    assert Path("run.csv").read_bytes() == Path("../a/run.csv").read_bytes()
    assert Path("run.xyz").read_bytes() == Path("../a/run.xyz").read_bytes()
    frames, others = read("run.traj", ":"), read("../a/run.traj", ":")
    assert [len(frames), len(others)] == [16, 16]
    assert all(np.array_equal(f.positions, o.positions) for f, o in zip(frames, others, strict=True))
    assert np.array_equal(frames[-1].get_momenta(), whole.get_momenta())
    assert not list(Path().glob(".*"))


def test_a_finished_run_can_be_made_longer(folder):
    record = run_fluid(box(), replace(SETTINGS, steps=84), replace(FILES, csv=None, checkpoint=None))
    run_fluid(box(), replace(SETTINGS, steps=42), replace(FILES, csv=None))
    longer = run_fluid(box(), replace(SETTINGS, steps=84), replace(FILES, csv=None), resume=True)
    assert len(longer) == 22
    assert (
        abs(longer.total_ev - record.total_ev).max() < 1e-9
    )  # eV: other checkpoints, so other lists, so other rounding


@contextmanager
def files_up_to(size):
    """No file may grow beyond: the system's own refusal, as of a full disk."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


KILLED = """
import sys
import numpy as np
from fluid_run_case import FILES, SETTINGS, box
from dataclasses import replace
from rotor.fluids.run import run_fluid
run_fluid(box(), replace(SETTINGS, ensemble="langevin", steps=100000), FILES, resume="--resume" in sys.argv)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL on this system")
def test_a_hard_kill_loses_no_more_than_one_interval(folder):
    root = PROJECT
    environment = os.environ | {"PYTHONPATH": f"{root}{os.pathsep}{root / 'tests' / 'helpers'}"}
    process = subprocess.Popen([sys.executable, "-c", KILLED], env=environment, cwd=folder)
    until = time.monotonic() + 60.0
    while time.monotonic() < until and not (Path("run.csv").exists() and len(lines("run.csv")) > 15):
        assert process.poll() is None
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    written = len(lines("run.csv"))
    checkpoint = read_checkpoint("run.npz").about["step"]
    assert checkpoint % 14 == 0
    assert 4 * (written - 2) - checkpoint <= 14 + 4  # rows beyond the checkpoint: less than an interval and a row
    settings = replace(SETTINGS, ensemble="langevin", steps=100000)
    steps = checkpoint + 28
    whole, resumed = box(), box()
    (folder / "other").mkdir()
    record = run_fluid(
        whole,
        replace(settings, steps=steps),
        replace(FILES, csv="other/run.csv", trajectories=(), checkpoint="other/run.npz"),
    )
    again = run_fluid(resumed, replace(settings, steps=steps), FILES, resume=True)
    assert same(record, again)
    assert np.array_equal(whole.positions, resumed.positions)
    assert Path("run.csv").read_bytes() == Path("other/run.csv").read_bytes()


def test_a_full_disk_stops_the_run_with_all_that_was_written(folder):
    settings = replace(SETTINGS, steps=500, every=1, ensemble="langevin")
    files = replace(FILES, trajectories=(), checkpoint_every=7)
    said = r"run.csv: File too large at step \d+; files written before are complete; run.npz is of step \d+"
    with files_up_to(12000), pytest.raises(RunStopped, match=said):
        run_fluid(box(), settings, files)
    rows = lines("run.csv")
    assert Path("run.csv").read_bytes().endswith(b"\n")
    assert all(len(row.split(",")) == 9 for row in rows)
    record = run_fluid(box(), replace(settings, steps=100), files, resume=True)
    assert len(record) == 101
    assert lines("run.csv")[: len(rows)] == rows


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full on this system")
def test_no_space_left_is_told(folder):
    os.symlink("/dev/full", "run.csv")
    with pytest.raises((RunStopped, OSError), match="No space left on device"):
        run_fluid(box(), SETTINGS, Outputs(csv="run.csv"))


def test_a_checkpoint_that_cannot_be_written_leaves_the_old_one(folder, monkeypatch):
    run_fluid(box(), replace(SETTINGS, steps=14, ensemble="langevin"), FILES)
    stored = Path("run.npz").read_bytes()

    def full(*paths):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("rotor.fluids.checkpoint.os.replace", full)
    monkeypatch.setattr(AseTrajectory, "__init__", lambda self, path, length=None: setattr(self, "path", Path(path)))
    with pytest.raises(RunStopped, match=r"run.npz: No space left on device at step 28.*run.npz is of step 14"):
        run_fluid(box(), replace(SETTINGS, ensemble="langevin"), FILES, resume=True)
    assert Path("run.npz").read_bytes() == stored
    assert not list(Path().glob(".*"))


class BrokenLater:
    """A force that is no number, from a call on."""

    def __init__(self, calls):
        self.left, self.inner = calls, make_calculator(SETTINGS)

    def __getattr__(self, name):
        return getattr(self.inner, name)

    def get_forces(self, atoms):
        self.left -= 1
        forces = self.inner.get_forces(atoms).copy()
        forces[5] = np.nan if self.left < 0 else forces[5]
        return forces


def test_a_force_that_is_no_number_is_told_with_step_and_checkpoint(folder):
    atoms = box()
    atoms.calc = BrokenLater(31)
    with pytest.raises(
        RunStopped,
        match=r"force on molecule 1 \(OH2, atoms 3 to 5\) is not finite in step 2\d: .*run.npz is of step 14, resume",
    ):
        run_fluid(atoms, SETTINGS, FILES)
    assert len(lines("run.csv")) >= 1 + 5
    assert len(read("run.traj", ":")) == len(lines("run.csv")) - 1


def test_molecules_on_top_of_each_other_and_broken_shapes_are_refused_before_anything_is_written(folder):
    atoms = box()
    atoms.positions[3:6] = atoms.positions[:3] + 0.05
    with pytest.raises(ValueError, match="on top of each other"):
        run_fluid(atoms, SETTINGS, FILES)
    atoms = box()
    atoms.positions[4] += 0.3
    with pytest.raises(ValueError, match=r"molecule 1 .* off its place"):
        run_fluid(atoms, SETTINGS, FILES)
    assert not list(Path().iterdir())


def test_a_box_wrapped_into_its_cell_runs_as_the_whole_one(folder):
    whole, cut = box(), box()
    cut.wrap()
    cut.positions[::3] += cut.cell.lengths()  # oxygens one cell further on: every molecule is cut
    first, other = run_fluid(whole, SETTINGS), run_fluid(cut, SETTINGS)
    assert abs(first.total_ev - other.total_ev).max() < 1e-9  # eV: round-off of other places of the same molecules


@pytest.mark.parametrize("ensemble", ["nve", "langevin", "nose-hoover"])
def test_a_run_that_ended_between_checkpoints_continues_bit_for_bit(folder, ensemble):
    """40 steps, then 90, with an interval of 70: one run of 90. A checkpoint at step 40, off the interval, made 1e-14 of difference."""
    settings = replace(SETTINGS, steps=90, every=1, ensemble=ensemble, step_fs=2.0, cutoff_angstrom=4.0)
    whole, first, parts = (lattice_box(find_model("spce"), 27, 0.9, np.random.default_rng(3)) for _ in range(3))
    record = run_fluid(whole, settings, Outputs(checkpoint="whole.npz", checkpoint_every=70))
    files = Outputs(csv="run.csv", trajectories=("run.xyz",), checkpoint="run.npz", checkpoint_every=70)
    run_fluid(first, replace(settings, steps=40), files)
    again = run_fluid(parts, settings, files, resume=True)
    for name, column in record.columns.items():
        assert np.array_equal(column, again.columns[name]), name
    assert np.array_equal(whole.positions, parts.positions)
    assert np.array_equal(whole.get_momenta(), parts.get_momenta())
    rows = Path("run.csv").read_text().splitlines()
    assert len(rows) == len(set(rows)) == 92


def test_what_cannot_be_resumed_is_refused(folder):
    settings = replace(SETTINGS, steps=14)
    run_fluid(box(), settings, FILES)
    with pytest.raises(ValueError, match="exists already"):
        run_fluid(box(), settings, FILES)
    with pytest.raises(ValueError, match=r"with step_fs = 1\.0, not 2\.0"):
        run_fluid(box(), replace(settings, step_fs=2.0), FILES, resume=True)
    with pytest.raises(ValueError, match="another box"):
        run_fluid(box(8), settings, FILES, resume=True)
    with pytest.raises(ValueError, match=r"wrote other files: csv, run\.traj, run\.xyz"):
        run_fluid(box(), settings, replace(FILES, csv=None), resume=True)
    with pytest.raises(ValueError, match="after the 5 steps"):
        run_fluid(box(), replace(settings, steps=5), FILES, resume=True)
    with pytest.raises(ValueError, match="name the checkpoint"):
        run_fluid(box(), settings, resume=True)
    with pytest.raises(ValueError, match=r"none.npz: no such checkpoint"):
        run_fluid(box(), settings, replace(FILES, checkpoint="none.npz"), resume=True)
    Path("run.csv").write_text("short")
    with pytest.raises(
        ValueError, match=r"run.csv: is shorter than the \d+ bytes that it had when the checkpoint was written"
    ):
        run_fluid(box(), settings, FILES, resume=True)
    Path("run.npz").write_bytes(Path("run.npz").read_bytes()[:300])
    with pytest.raises(ValueError, match="is no checkpoint"):
        run_fluid(box(), settings, FILES, resume=True)
    with pytest.raises(ValueError, match="checkpoint_every = 0"):
        Outputs(checkpoint_every=0)


def test_a_piece_that_does_not_fit_is_not_there_at_all(folder):
    file = TextFile("a.csv")
    file.add("head\n")
    with files_up_to(8), pytest.raises(OSError, match=r"a\.csv"):
        file.add("0123456789\n")
    file.close()
    assert Path("a.csv").read_text() == "head\n"


def test_the_pressure_is_that_of_centres_of_mass():
    """P = (2 K_trans - 3V dU/dV)/3V, the derivative by moving centres and cell, molecules as they are."""
    from fluid_boxes import SoftSites

    for calculator, edge in ((make_calculator(SETTINGS), None), (SoftSites(), 9.0)):
        atoms = box(8)
        if edge is not None:
            atoms.set_cell([edge] * 3)
        atoms.calc = calculator
        dynamics = make_dynamics(atoms, SETTINGS)
        volume, centres = atoms.get_volume(), dynamics.state.centres.copy()

        def potential(scale, atoms=atoms, dynamics=dynamics, centres=centres):
            other = atoms.copy()
            other.positions += np.repeat((scale - 1.0) * centres, 3, axis=0)
            other.set_cell(atoms.cell * scale)
            other.calc = atoms.calc
            return other.get_potential_energy()

        h = 1e-5
        slope = (potential(1 + h) - potential(1 - h)) / (2 * h)  # dU/ds at s = 1, V = V0 s³
        expected = (2.0 * dynamics.kinetic().translation_ev - slope) / (3.0 * volume) * 1.602176634e6
        assert pressure_bar(dynamics) == pytest.approx(expected, rel=1e-5)  # a difference quotient of step 1e-5


def test_the_table_has_its_rows_where_asked():
    record = run_fluid(box(8), replace(SETTINGS, steps=10, every=5))
    assert record.time_ps.tolist() == [0.0, 0.005, 0.01]
    assert np.all(record.temperature_k > 0.0)
    kinetic = (record.translation_ev, record.rotation_ev)
    assert record.translation_k == pytest.approx(2 * kinetic[0] / (21 * 8.617333262145e-5), rel=1e-9)  # 3·8 - 3 degrees
    assert record.rotation_k == pytest.approx(2 * kinetic[1] / (24 * 8.617333262145e-5), rel=1e-9)  # 3·8


def test_the_table_can_be_written_and_read_back(folder):
    import json

    import polars as pl

    import rotor

    record = run_fluid(box(8), replace(SETTINGS, steps=10, every=5))
    for name, reader in (("a.csv", pl.read_csv), ("a.parquet", pl.read_parquet)):
        rotor.write(record, name, settings={"seed": 1})
        assert reader(name)["total_ev"].to_list() == record.total_ev.tolist()  # to the last bit
    rotor.write(record, "a.json")
    assert [row["rotation_k"] for row in json.loads(Path("a.json").read_text())["rows"]] == record.rotation_k.tolist()
    assert json.loads(Path("a.csv.provenance.json").read_text())["seed"] == 1
    with pytest.raises(ValueError, match=r"\.csv, \.parquet or \.json"):
        rotor.write(record, "a.txt")


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self):
        return True


def test_a_terminal_sees_speed_and_progress_and_a_pipe_nothing(capsys, monkeypatch):
    run_fluid(box(8), SETTINGS)
    assert capsys.readouterr() == ("", "")
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    run_fluid(box(8), SETTINGS)
    assert "ns/day" in terminal.getvalue()
    assert "60 of 60 steps" in terminal.getvalue()


def test_a_terminal_sees_the_steps_of_the_equilibration_and_of_the_run(monkeypatch):
    """The bar counted the steps of an equilibration as 5000 of 0."""
    monkeypatch.setattr("sys.stderr", terminal := Terminal())
    answer_fluid(FluidRequest(NewBox(64, equilibration_ps=0.4), replace(SETTINGS, cutoff_angstrom=6.0, steps=20)))
    totals = set(re.findall(r"(?<!box: )\b\d+ of (?:at most )?(\w+) steps", terminal.getvalue()))
    assert "20" in totals
    assert len(totals) == 2
    assert not totals & {"0", "None"}


def test_a_terminal_sees_the_quench_of_a_new_box_from_its_start(monkeypatch):
    """A box of 30000 molecules is quenched for more than half a minute."""
    monkeypatch.setattr("sys.stderr", terminal := Terminal())
    seen = []
    request = FluidRequest(NewBox(27, equilibration_ps=0.0), replace(SETTINGS, cutoff_angstrom=4.0, steps=20))
    answer_fluid(request)
    assert "overlaps of the new box: 300 of 300 steps" in terminal.getvalue()
    answer_fluid(request, progress=lambda *state: seen.append(state))
    assert seen[:2] == [(0, 300, 0.0), (1, 300, 0.0)]
    assert seen[-1][:2] == (20, 20)


@pytest.mark.parametrize("harm", [Path.unlink, lambda path: path.write_bytes(path.read_bytes()[:3000])])
def test_frames_that_are_gone_or_cut_short_are_told_by_name(folder, harm):
    run_fluid(box(), SETTINGS, FILES)
    harm(Path("run.traj"))
    with pytest.raises(
        ValueError, match=r"^run.traj: cannot be continued \(.+\); the checkpoint needs its first \d+ frames"
    ):
        run_fluid(box(), SETTINGS, FILES, resume=True)
    assert sorted(path.name for path in Path().iterdir() if path.name.startswith(".")) == []


def test_a_file_that_is_no_checkpoint_is_told_in_our_words(folder):
    Path("run.npz").write_text("junk")
    with pytest.raises(
        ValueError, match=r"^run.npz: is no checkpoint of rotor fluid; name the file of --checkpoint"
    ) as progress:
        run_fluid(box(), SETTINGS, FILES, resume=True)
    assert "pickle" not in str(progress.value)
