"""Sweeps: what makes a point out of date, points that fail, lists of molecules, one file of all points, locks."""

from __future__ import annotations

import csv
import gc
import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import duckdb
import numpy as np
import pytest

import rotor
from rotor.scenes.run import run_scene
from rotor.scenes.scene import Scene, make_scene, parse_scene, write_scene
from rotor.scenes.sweep import points, run_sweep
from rotor.scenes.sweep.combined import CombinedFile
from rotor.scenes.sweep.inputs import InputHashes
from rotor.scenes.worker_processes import WorkerKilledError, WorkerProcesses
from rotor.table import Table
from rotor.temporary import locked_file

LINEAR = "[constants]\nB = {b}\n"


def levels(**changes) -> Scene:
    return make_scene("levels", **{"molecule": "CO", "observables": {"jmax": 2}, **changes})


# Keys of finished points


def test_constants_changed_in_a_file_are_computed_anew(call, folder):
    """The review's case: 10000 MHz becomes 20000 MHz, and the numbers follow."""
    Path("m.toml").write_text(LINEAR.format(b=10000.0))
    write_scene(levels(molecule="m.toml", sweep={"observables.jmax": [1, 2]}), "s.toml")
    for b in (10000.0, 20000.0):
        Path("m.toml").write_text(LINEAR.format(b=b))
        assert call("run", "s.toml", "--json", "r.json")[0] == 0
        answer = json.loads(Path("r.json").read_text())
        assert answer["computed"] == 2
        highest = [point["highest_cm"] * rotor.units.MHZ_PER_CM for point in answer["points"]]
        np.testing.assert_allclose(highest, [2 * b, 6 * b], rtol=1e-12)  # B J(J+1), exact but for the units
    assert call("run", "s.toml")[2].startswith("2 points: 0 computed now")


def _key(scene, folder="."):
    (point,) = points(scene, folder)
    return InputHashes(folder).key(point.content, point.values)


@pytest.mark.parametrize(
    ("file", "scene"),
    [
        ("m.toml", levels(molecule="m.toml", sweep={"observables.jmax": [1]})),
        ("m.toml", levels(molecule={"source": "m.toml"}, sweep={"observables.jmax": [1]})),
        ("h.txt", levels(molecule={"source": "water", "hessian": "h.txt"}, sweep={"observables.jmax": [1]})),
        ("case.var", levels(molecule="case.int", sweep={"observables.jmax": [1]})),
        ("levels.csv", levels(molecule="with_levels.toml", sweep={"observables.jmax": [1]})),
        ("mine/named.toml", levels(molecule="my molecule", sweep={"observables.jmax": [1]})),
        (
            "lines.csv",
            parse_scene(
                'schema = 1\nkind = "fit"\nmolecule = "CO"\n[lines]\nsource = "lines.csv"\n[sweep]\n"numerics.max_iterations" = [3]'
            ),
        ),
        ("many.sdf", levels(sweep={"molecule": ["many.sdf#2"]})),
    ],
)
def test_every_file_that_enters_is_part_of_the_key(folder, monkeypatch, file, scene):
    monkeypatch.setenv("ROTOR_MOLECULES", "mine")
    Path("mine").mkdir()
    Path("case.int").write_text("int")
    Path("with_levels.toml").write_text('[levels]\nfile = "levels.csv"\n')
    Path("many.sdf").write_text("one\n$$$$\ntwo\n$$$$\n")
    Path("mine/named.toml").write_text('name = "my molecule"\n')
    if not Path(file).exists():
        Path(file).write_text("before")
    before = _key(scene)
    assert _key(scene) == before
    Path(file).write_text(Path(file).read_text().replace("two", "three") + "\n# changed\n")
    assert _key(scene) != before


def test_other_files_are_not_part_of_the_key(folder):
    Path("out.csv").write_text("a result of the last run")
    Path("many.sdf").write_text("one\n$$$$\ntwo\n$$$$\n")
    levels_scene = levels(outputs={"csv": "out.csv"}, sweep={"observables.jmax": [1]})
    second = levels(sweep={"molecule": ["many.sdf#2"]})
    before = _key(levels_scene), _key(second)
    Path("out.csv").write_text("another result")
    Path("many.sdf").write_text("uno\n$$$$\ntwo\n$$$$\n")
    assert (_key(levels_scene), _key(second)) == before


def test_values_of_a_point_and_the_version_are_part_of_the_key(folder, monkeypatch):
    scene = levels(sweep={"observables.jmax": [1]})
    before = _key(scene)
    assert _key(levels(sweep={"observables.jmax": [2]})) != before
    monkeypatch.setattr("rotor.scenes.sweep.inputs.version", lambda: "9")
    assert _key(scene) != before


# Points that fail


def test_a_bad_molecule_costs_its_own_point(call, folder):
    write_scene(levels(sweep={"molecule": ["CO", "no such molecule", "HCl"]}), "s.toml")
    code, out, err = call("run", "s.toml", "--json", "r.json")
    assert code == 1
    assert "HCl" in out
    summary, error = err.splitlines()
    assert summary.startswith("3 points: 3 computed now")
    assert summary.endswith("1 failed")
    assert error.startswith(
        "error: 1 point of 3 failed (--retry-failed runs them again): molecule = no such molecule: "
    )
    answer = json.loads(Path("r.json").read_text())
    assert [point["rows"] for point in answer["points"]] == [3, 0, 3]
    assert [point["highest_cm"] is None for point in answer["points"]] == [False, True, False]
    assert "no such molecule" in answer["failed"][0]["error"]

    code, _, err = call("run", "s.toml")  # not run again, and still said
    assert code == 1
    assert err.startswith("3 points: 0 computed now")
    code, _, err = call("run", "s.toml", "--retry-failed")
    assert code == 1
    assert err.startswith("3 points: 1 computed now")


def test_a_failed_point_is_run_again_when_its_file_is_repaired(folder):
    scene = levels(sweep={"molecule": ["CO", "m.toml"]})
    Path("m.toml").write_text("[constants]\nB = 'x'\n")
    assert len(run_sweep(scene, record="r").failed) == 1
    Path("m.toml").write_text(LINEAR.format(b=1e4))
    result = run_sweep(scene, record="r")
    assert (result.failed, result.computed) == ((), 1)


def test_a_scene_that_no_point_can_be_is_refused_at_once(call, folder):
    write_scene(levels(sweep={"observables.j": [1, 2]}), "s.toml")
    code, _, err = call("run", "s.toml")
    assert code == 2
    assert "[observables] has no key 'j'" in err
    assert not Path("s.sweep.jsonl").exists()


ONE_NUMBER = '{"key": "a", "values": {}, "files": [], "rows": 1}'


@pytest.mark.parametrize(
    "line", ["1", "[]", "null", '"a"', '{"key": 1}', '{"key": "a", "values": {}}', ONE_NUMBER, "schema = 1"]
)
def test_odd_lines_of_a_record_are_errors_in_one_line(call, folder, line):
    write_scene(levels(sweep={"observables.jmax": [1]}), "s.toml")
    call("run", "s.toml")
    before = Path("s.sweep.jsonl").read_text() + line + "\n"
    Path("s.sweep.jsonl").write_text(before)
    code, _, err = call("run", "s.toml")
    assert code == 2
    assert err.startswith("error: s.sweep.jsonl, line 2: ")
    assert Path("s.sweep.jsonl").read_text() == before


def test_a_record_whose_last_line_was_cut_off_goes_on(folder):
    scene = levels(sweep={"observables.jmax": [1, 2]})
    run_sweep(scene, record="r")
    whole = Path("r").read_text()
    Path("r").write_text(whole[:-20])
    assert run_sweep(scene, record="r").computed == 1
    assert run_sweep(scene, record="r").computed == 0
    shown = []
    run_sweep(scene, record="r", progress=lambda done, total: shown.append((done, total)))
    assert shown == [(1, 2), (2, 2)]  # finished points count, too


# Workers


def _double(number):
    return 2 * number


def _end_this_process(_):
    os.kill(os.getpid(), signal.SIGKILL)


def _threads_of_blas(_):
    return [os.environ.get(name) for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")]


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_a_killed_worker_costs_its_piece(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    with WorkerProcesses(2) as pool:
        killed = [pool.submit(_end_this_process, 0) for _ in range(3)]
        others = [pool.submit(_double, n) for n in range(20)]
        assert [future.result() for future in others] == [2 * n for n in range(20)]
        for future in killed:
            with pytest.raises(WorkerKilledError, match="ended from outside"):
                future.result()
        assert pool.submit(_threads_of_blas, 0).result() == ["1", "1", "1"]
    assert os.environ["OMP_NUM_THREADS"] == "7"


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_a_sweep_goes_on_where_a_worker_is_killed(folder, monkeypatch):
    """One point is given to a process that ends; the others are done, and its record says why."""
    scene = levels(sweep={"observables.jmax": list(range(1, 9))})

    class Deadly:
        """An executor that ends the process of the third point."""

        def __init__(self, pool):
            self.pool = pool

        def submit(self, function, job):
            return self.pool.submit(_end_this_process if job.point.values["observables.jmax"] == 3 else function, job)

    with WorkerProcesses(2) as pool:
        result = run_sweep(scene, record="r", executor=Deadly(pool))
        assert [record["values"] for record in result.failed] == [{"observables.jmax": 3}]
        assert "ended from outside" in result.failed[0]["error"]
        assert result.columns["rows"].tolist() == [2, 3, 0, 5, 6, 7, 8, 9]
        again = run_sweep(scene, record="r", executor=pool, retry_failed=True)
    assert (again.failed, again.computed) == ((), 1)


def _interrupted():
    with WorkerProcesses(1) as pool:
        pool.submit(_double, 1).result()
        pool.submit(time.sleep, 60)
        raise KeyboardInterrupt


def test_an_error_ends_the_workers_at_once():
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        _interrupted()
    assert time.monotonic() - start < 30  # s; the piece alone takes 60


# Lists of molecules, and one file of all points

WATER = """{name}
  written by hand

  3  2  0  0  0  0            999 V2000
    0.0000    0.0000    0.1173 O   0  0
    0.0000    {y}   -0.4692 H   0  0
    0.0000   -{y}   -0.4692 H   0  0
  1  2  1  0
  1  3  1  0
M  END
$$$$
"""


def sdf(*entries) -> str:
    return "".join(WATER.format(name=name, y=f"{y:.4f}") for name, y in entries)


def test_an_sdf_of_many_molecules_is_a_sweep_over_them(call, folder):
    Path("many.sdf").write_text(sdf(("water", 0.7572), ("wide", 0.8), ("water", 0.9)))
    write_scene(levels(molecule="many.sdf", outputs={"csv": "{molecule}.csv"}), "s.toml")
    code, _, err = call("run", "s.toml")
    assert code == 0, err
    assert sorted(path.name for path in folder.glob("*.csv")) == ["water.csv", "water_2.csv", "wide.csv"]
    for number, name in enumerate(("water", "wide", "water_2"), 1):
        alone = run_scene(levels(molecule=f"many.sdf#{number}"))
        assert str(alone.table.energy_mhz[-1]) in Path(f"{name}.csv").read_text()
    with pytest.raises(ValueError, match=r"many.sdf#4: the file has 3 molecules"):
        rotor.read("many.sdf#4")
    with pytest.raises(ValueError, match=r"3 molecules.*many.sdf#1"):
        rotor.read("many.sdf")


def test_a_csv_of_smiles_or_names_is_a_sweep_over_them(folder):
    Path("a.csv").write_text("id,SMILES\nformaldehyde,C=O\n,[C-]#[O+]\nformaldehyde,C#N\n")
    molecules = [(p.values["molecule"], p.content["molecule"]) for p in points(levels(molecule="a.csv"))]
    assert molecules == [
        ("formaldehyde", "SMILES:C=O"), ("[C-]#[O+]", "SMILES:[C-]#[O+]"), ("formaldehyde_2", "SMILES:C#N"),
    ]  # fmt: skip
    Path("b.csv").write_text("name;x\n")
    with pytest.raises(ValueError, match=r"b.csv: expected a column smiles, molecule or name, found name;x"):
        points(levels(molecule="b.csv"))
    Path("c.csv").write_text("name\nCO\nHCl\n")
    result = run_sweep(levels(sweep={"molecule": ["OCS", "c.csv"], "observables.jmax": [0, 1]}))
    assert result.columns["molecule"].tolist() == ["OCS", "OCS", "CO", "CO", "HCl", "HCl"]


def test_a_file_of_smiles_is_a_sweep_over_them(folder):
    for text in ("C=O formaldehyde\n\n[C-]#[O+]\n", "SMILES Name\nC=O\tformaldehyde\n[C-]#[O+]"):
        Path("a.smi").write_text(text)
        molecules = [(p.values["molecule"], p.content["molecule"]) for p in points(levels(molecule="a.smi"))]
        assert molecules == [("formaldehyde", "SMILES:C=O"), ("[C-]#[O+]", "SMILES:[C-]#[O+]")]
    Path("b.smi").write_text("SMILES\n")
    with pytest.raises(ValueError, match=r"b.smi: no molecules; expected lines of a SMILES and a name"):
        points(levels(molecule="b.smi"))


def test_names_that_become_equal_in_files_get_a_number(folder):
    scene = levels(sweep={"molecule": ["SMILES:C=O", "SMILES:C#O", "SMILES:C-O"]}, outputs={"csv": "{molecule}.csv"})
    assert [p.content["outputs"]["csv"] for p in points(scene)] == [
        "SMILES_C_O.csv",
        "SMILES_C_O_2.csv",
        "SMILES_C-O.csv",
    ]


def _rows(path):
    import duckdb

    return duckdb.sql(f"SELECT molecule, jmax, j, energy_mhz FROM '{path}'").fetchall()


def test_rows_of_all_points_go_into_one_parquet_file(folder):
    scene = levels(
        sweep={"molecule": ["HCl", "CO", "bad word"], "observables.jmax": [1, 2]},
        outputs={"parquet": "all.parquet"},
    )
    result = run_sweep(scene, record="r")
    rows = _rows("all.parquet")
    assert [row[:3] for row in rows] == [(m, n, j) for m in ("HCl", "CO") for n in (1, 2) for j in range(n + 1)]
    alone = run_scene(levels(molecule="CO")).table.energy_mhz.tolist()
    assert [row[3] for row in rows[-3:]] == alone
    assert len(result.failed) == 2
    assert sorted(path.name for path in folder.iterdir()) == ["all.parquet", "r"]
    import duckdb

    (metadata,) = duckdb.sql("SELECT value FROM parquet_kv_metadata('all.parquet') WHERE key = 'provenance'").fetchall()
    assert parse_scene(metadata[0].decode()) == scene

    assert run_sweep(scene, record="r").computed == 0  # nothing is lost when nothing is new
    assert _rows("all.parquet") == rows
    fewer = levels(sweep={"molecule": ["CO", "OCS"], "observables.jmax": [1, 2]}, outputs=scene.content["outputs"])
    assert run_sweep(fewer, record="r").computed == 2  # of OCS; those of HCl leave the file
    assert [row[0] for row in _rows("all.parquet")] == ["CO"] * 5 + ["OCS"] * 5
    Path("all.parquet").unlink()
    assert run_sweep(scene, record="r").computed == 4  # rows that are lost are made again
    assert _rows("all.parquet") == rows


def test_a_stopped_sweep_keeps_the_rows_of_its_points(folder):
    scene = levels(sweep={"molecule": ["CO", "HCl"], "observables.jmax": [1, 2]}, outputs={"parquet": "all.parquet"})
    count = []

    def stop(record):
        count.append(record)
        if len(count) == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_sweep(scene, record="r", on_point=stop)
    assert not Path("all.parquet").exists()
    assert run_sweep(scene, record="r").computed == 1
    assert len(_rows("all.parquet")) == 10


def test_the_summary_shows_results(folder):
    result = run_sweep(make_scene("spectrum", molecule="CO", numerics={"jmax": 3}, sweep={"molecule": ["CO", "HCl"]}))
    columns = result.columns
    for row, name in enumerate(("CO", "HCl")):
        lines = rotor.api.line_list(rotor.read(name), jmax=3)
        best = lines.intensity_nm2_mhz.argmax()
        assert columns["lines"][row] == len(lines)
        assert columns["strongest_mhz"][row] == lines.frequency_mhz[best]
        assert columns["q"][row] == lines.partition.q


def test_what_a_molecule_does_not_have_is_a_dash_in_the_summary(call, folder):
    """A of a linear molecule, which is not a number in the table."""
    text = 'schema = 1\nkind = "info"\nmolecule = "CO"\n[sweep]\nmolecule = ["CO", "water"]\n'
    (folder / "s.toml").write_text(text)
    code, out, _ = call("run", "s.toml")
    assert code == 0
    row = next(line for line in out.splitlines() if line.split()[:1] == ["CO"])
    assert " - " in row
    assert "nan" not in out


def test_ten_thousand_points_begin_at_once(folder):
    """Points are made when they are needed: the first result comes before the last scene is checked."""
    scene = levels(sweep={"observables.jmax": list(range(10_000))}, observables={"max_energy": "1 MHz"})

    def stop(_):
        raise KeyboardInterrupt

    start = time.process_time()
    with pytest.raises(KeyboardInterrupt):
        run_sweep(scene, on_point=stop)
    assert time.process_time() - start < 1.0  # s, as the issue asks


# Locks and paths


def test_a_file_has_one_writer(folder):
    with (
        locked_file("a.csv"),
        pytest.raises(ValueError, match=rf"a.csv: another run \(process {os.getpid()}\) is writing"),
        locked_file(folder / "a.csv"),
    ):
        pass
    assert list(folder.iterdir()) == []
    with locked_file("a.csv"), locked_file("b.csv"), locked_file(os.devnull), locked_file(os.devnull):
        pass


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", "sweep.toml"),
        ("run", "one.toml"),
        ("run", "all.toml"),
        ("levels", "CO", "--csv", "a.csv"),
        ("spectrum", "CO", "--cat", "a.cat"),
        ("levels", "CO", "--json", "a.json"),
    ],
)
def test_the_second_of_two_runs_that_write_one_file_is_refused(call, folder, arguments):
    write_scene(levels(sweep={"observables.jmax": [1, 2]}), "sweep.toml")
    write_scene(levels(outputs={"csv": "a.csv"}), "one.toml")
    write_scene(levels(sweep={"observables.jmax": [1, 2]}, outputs={"parquet": "a.parquet"}), "all.toml")
    busy = {"sweep.toml": "sweep.sweep.jsonl", "one.toml": "a.csv", "all.toml": "a.parquet"}.get(
        arguments[1], arguments[-1]
    )
    code = f"from rotor.temporary import locked_file\nwith locked_file({busy!r}):\n    print('locked', flush=True)\n    input()"
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as holder:
        assert holder.stdout.readline() == "locked\n"
        answer = call(*arguments)
        holder.kill()  # a run that is killed holds nothing
    assert answer[0] == 2
    assert f"another run (process {holder.pid}) is writing this file" in answer[2]
    assert call(*arguments)[0] == 0
    assert not list(folder.glob(".rotor*"))


@pytest.mark.parametrize("name", ["../a.csv", "{place}/a.csv", "sub/../../a.csv"])
def test_outputs_of_a_scene_stay_in_its_folder(call, folder, name):
    Path("work/sub").mkdir(parents=True)
    os.chdir("work")
    name = name.replace("{place}", str(folder))
    write_scene(levels(outputs={"csv": name}), "s.toml")
    write_scene(levels(outputs={"csv": name}, sweep={"molecule": ["CO"]}), "t.toml")
    for scene in ("s.toml", "t.toml"):
        code, _, err = call("run", scene)
        assert code == 2
        assert "lies outside the folder ." in err
    assert not (folder / "a.csv").exists()


def test_a_folder_that_was_typed_is_written_to(call, folder):
    Path("work").mkdir()
    write_scene(levels(outputs={"csv": str(folder / "a.csv")}), "work/s.toml")
    assert call("run", "work/s.toml", "--out", str(folder))[0] == 0
    assert (folder / "a.csv").exists()


def test_parquet_of_all_points_stays_in_the_folder(call, folder):
    Path("work").mkdir()
    os.chdir("work")
    write_scene(levels(sweep={"molecule": ["CO", "HCl"]}, outputs={"parquet": "../a.parquet"}), "s.toml")
    code, _, err = call("run", "s.toml")
    assert (code, "lies outside" in err) == (2, True)


ORPHANS = """
import os, sys, time
from rotor.scenes.worker_processes import WorkerProcesses

def number(_):
    time.sleep(0.2)
    return os.getpid()

if __name__ == "__main__":
    with WorkerProcesses(2) as pool:
        print(*{future.result() for future in [pool.submit(number, n) for n in range(4)]}, flush=True)
        time.sleep(60)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="no /proc")
def test_workers_end_with_the_process_that_began(folder):
    """Workers of a process that the system ended waited for pieces for ever."""
    Path("orphans.py").write_text(ORPHANS)
    command = [sys.executable, "orphans.py"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as began:
        assert began.stdout is not None
        workers = [int(word) for word in began.stdout.readline().split()]
        began.kill()
    assert len(workers) == 2
    end = time.monotonic() + 20.0
    while time.monotonic() < end and any(_runs(number) for number in workers):
        time.sleep(0.05)
    assert not any(_runs(number) for number in workers)


def _runs(number: int) -> bool:
    """Whether a process runs; one that has ended and that nothing waits for does not."""
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def _setting(name: str) -> str | None:
    return os.environ.get(name)


def _is_loaded(name: str) -> bool:
    return name in sys.modules


@pytest.mark.parametrize("name", ["OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"])
def test_workers_have_one_thread_of_blas(name, monkeypatch):
    """Processes with several threads each wait for one another, whatever this process has."""
    monkeypatch.setenv(name, "4")
    with WorkerProcesses(1) as pool:
        assert pool.submit(_setting, name).result() == "1"
    assert os.environ[name] == "4"


def test_workers_have_the_environment_of_now_and_the_modules_of_the_work(monkeypatch):
    with WorkerProcesses(1) as pool:
        assert pool.submit(_setting, "ROTOR_MOLECULES").result() == os.environ.get("ROTOR_MOLECULES")
        if sys.platform == "linux":
            assert pool.submit(_is_loaded, "rotor.scenes.sweep.run").result()
    monkeypatch.setenv("ROTOR_MOLECULES", "elsewhere")
    with WorkerProcesses(1) as pool:
        assert pool.submit(_setting, "ROTOR_MOLECULES").result() == "elsewhere"


SHARED = """
import sys

def loaded(_):
    return [name in sys.modules for name in ("rotor.verbs.levels", "rdkit.Chem", "rotor.verbs.tumble")]

if __name__ == "__main__":
    from rotor.__main__ import start_workers_ahead
    start_workers_ahead(["run", "s.toml", "--workers", "2"])
    heavy = bool({"numpy", "typer"} & set(sys.modules))
    from rotor.scenes.worker_processes import WorkerProcesses
    with WorkerProcesses(2) as pool:
        print(heavy, pool.submit(loaded, 0).result())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere each process imports by itself")
def test_the_server_of_workers_starts_before_anything_is_loaded(folder):
    """The imports of workers came after those of the process that began: two workers were 1.2 times as fast as one process."""
    write_scene(levels(molecule="SMILES:C=O", sweep={"observables.jmax": [1, 2]}), "s.toml")
    Path("shared.py").write_text(SHARED)
    done = subprocess.run([sys.executable, "shared.py"], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False [True, True, False]"


FIRST_POINT = """
import os, sys

def loaded_by(job):
    from rotor.scenes.sweep.run import run_point
    before = set(sys.modules)
    record = run_point(job)
    return record.get("error"), sorted(name for name in set(sys.modules) - before if name.startswith(("rotor", "rdkit")))

if __name__ == "__main__":
    from rotor.scenes.worker_processes import WorkerProcesses, start_ahead
    start_ahead(open("s.toml").read())
    from rotor.scenes.scene import read_scene
    from rotor.scenes.sweep.points import points
    from rotor.scenes.sweep.run import Job
    (point,) = points(read_scene("s.toml"))
    os.mkdir("all.parquet.points")
    with WorkerProcesses(1) as pool:
        print(pool.submit(loaded_by, Job("k" * 64, point, ".", ".", ("all.parquet",))).result())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere each process imports by itself")
def test_the_first_point_of_a_worker_loads_no_module(folder):
    """Each worker imported 19 modules at its first SMILES, a fifth of a second on a busy machine."""
    write_scene(levels(molecule="SMILES:C=O"), "s.toml")
    Path("first.py").write_text(FIRST_POINT)
    done = subprocess.run([sys.executable, "first.py"], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "(None, [])"


def test_arguments_that_are_wrong_start_no_workers(monkeypatch):
    from rotor.__main__ import start_workers_ahead
    from rotor.scenes import worker_processes as processes

    texts = []
    monkeypatch.setattr(processes, "start_ahead", texts.append)
    for words in ("run s.toml", "run s.toml --workers 1", "run s.toml --workers x", "run s.toml --workers 01",
                  "plan s.toml --workers 2"):  # fmt: skip
        start_workers_ahead(words.split())
    assert texts == []
    start_workers_ahead(["run", "no such file", "--workers=2"])
    assert texts == [""]


def test_what_is_not_written_is_not_computed(monkeypatch, folder):
    """The facts of an answer, with its budgets and limits, took a third of a sweep that writes one table of all points."""
    from rotor.quantum.request import LevelsAnswer

    def failing(_):
        raise AssertionError("nothing shows them")

    monkeypatch.setattr(LevelsAnswer, "facts", failing)
    result = run_sweep(levels(sweep={"observables.jmax": [1, 2]}, outputs={"parquet": "all.parquet"}))
    assert [record.get("error") for record in result.records] == [None, None]


def test_a_csv_of_all_points_has_a_column_of_the_molecule(folder):
    """A CSV without a swept key in its name was refused for a list of molecules."""
    Path("list.csv").write_text("smiles,name\nC=O,formaldehyde\nC#N,cyanide\n")
    scene = levels(molecule="list.csv", outputs={"csv": "all.csv", "parquet": "all.parquet"})
    first = run_sweep(scene, record="r")
    assert [Path(name).name for name in first.files] == ["all.parquet", "all.csv"]
    rows = list(csv.DictReader(Path("all.csv").read_text().splitlines()))
    assert Counter(row["molecule"] for row in rows) == {"formaldehyde": 9, "cyanide": 3}
    with duckdb.connect() as engine:
        energies = engine.execute("SELECT energy_mhz FROM 'all.parquet'").fetchall()
    assert [float(row["energy_mhz"]) for row in rows] == [energy for (energy,) in energies]


def test_a_csv_of_all_points_goes_on(folder):
    scene = levels(sweep={"molecule": ["CO", "HCl"]}, outputs={"csv": "all.csv"})
    assert run_sweep(scene, record="r").computed == 2
    before = Path("all.csv").read_text()
    texts = list(csv.DictReader(before.splitlines()))
    more = levels(sweep={"molecule": ["HCl", "CO", "HF"]}, outputs={"csv": "all.csv"})
    again = run_sweep(more, record="r")
    assert again.computed == 1
    rows = list(csv.DictReader(Path("all.csv").read_text().splitlines()))
    assert [row["molecule"] for row in rows] == 3 * ["HCl"] + 3 * ["CO"] + 3 * ["HF"]
    assert all(row in rows for row in texts)  # text by text; the order of columns is that of the first molecule
    assert run_sweep(scene, record="r").computed == 0
    assert list(csv.DictReader(Path("all.csv").read_text().splitlines())) == texts


def test_workers_search_for_cycles_as_seldom_as_the_process_that_began():
    """Python's own threshold takes 5 to 15 % of a prediction; a worker that forgot it would be slower than one process."""
    before = gc.get_threshold()
    gc.set_threshold(43_210, 7, 5)
    try:
        with WorkerProcesses(1) as pool:
            assert pool.submit(gc.get_threshold).result() == (43_210, 7, 5)
    finally:
        gc.set_threshold(*before)


def test_points_that_wait_are_not_asked_one_by_one(folder, monkeypatch):
    """Negative control of speed: the time of each point does not grow with the number of points that wait."""
    asked = Counter()
    ask = Future.done
    monkeypatch.setattr(Future, "done", lambda self: asked.update(done=1) or ask(self))
    sweep = {"observables.jmax": list(range(1, 61))}
    with ThreadPoolExecutor(1) as pool:
        result = run_sweep(make_scene("levels", molecule="CO", sweep=sweep), record="r.jsonl", executor=pool)
    assert [record["rows"] for record in result.records] == list(range(2, 62))
    assert asked["done"] <= 60  # each once at most; 1,830 where all that wait are asked after each point


def test_small_points_wait_as_one_array_of_any_names_and_lengths(folder):
    """Texts of several lengths, infinite numbers and names beyond ASCII come back as they were, in the order of the keys."""
    joined = CombinedFile.of(["a.parquet"], ".")
    joined.open_folder()
    rows = {"a" * 16: (["x"], [1.5]), "b" * 16: (["longer", "Å"], [np.inf, np.nan])}
    for key, (texts, numbers) in rows.items():
        columns = {"name": np.array(texts), "ν": np.array(numbers)}
        joined.write_part(key, {"µ": 1}, type("FewColumns", (Table,), {"columns": columns})())
    assert {path.suffix for path in joined.folder.iterdir()} == {".npy"}
    joined.join(["b" * 16, "a" * 16], "{}")
    table = duckdb.sql("SELECT * FROM 'a.parquet'").fetchall()
    assert table == [("b" * 16, 1, "longer", None), ("b" * 16, 1, "Å", None), ("a" * 16, 1, "x", 1.5)]
    assert not joined.folder.exists()


def test_notes_on_the_molecules_of_a_list_are_told_once(call, folder):
    """A single `rotor info SMILES:...` says that its constants are estimates; a list of them said nothing. A second run says it, too."""
    names = {"formaldehyde": "C=O", "acetaldehyde": "CC=O", "sulphur dioxide": "O=S=O"}
    Path("list.csv").write_text("name,smiles\n" + "".join(f"{name},{smiles}\n" for name, smiles in names.items()))
    Path("s.toml").write_text('schema = 1\nkind = "info"\nmolecule = "list.csv"\nconditions.temperature = "300 K"\n')
    for _ in range(2):
        code, _, err = call("run", "s.toml")
        notes = [line for line in err.splitlines() if line.startswith("note: ")]
        assert code == 0, err
        assert notes[0].startswith("note: WARNING: geometry from MMFF94 with hypervalent")
        assert notes[0].endswith("(1 of 3 points)")
        (estimate,) = (line for line in notes if "half of such constants are wrong by" in line)
        assert estimate.endswith("(2 of 3 points)")
    Path("list.csv").write_text("name\nCO\nOCS\n")
    assert "note:" not in call("run", "s.toml")[2]


# Tables of a list

TWO_PULSES = """schema = 1
kind = "align"
molecule = "N2"
[[pulses]]
shape = "gaussian"
peak = "1e13 W/cm2"
fwhm = "0.1 ps"
[[pulses]]
shape = "gaussian"
peak = "1e13 W/cm2"
fwhm = "0.1 ps"
centre = "2 ps"
"""


def test_a_key_of_the_second_pulse_is_swept():
    """Only the second pulse moves."""
    scene = parse_scene(TWO_PULSES + '[sweep]\n"pulses.2.centre" = ["4 ps", "8.4 ps"]\n')
    pulses = [point.scene.content["pulses"] for point in points(scene)]
    assert [(first.get("centre"), second["centre"]) for first, second in pulses] == [(None, "4 ps"), (None, "8.4 ps")]


@pytest.mark.parametrize(
    ("name", "rule"),
    [
        ("pulses.3.centre", "3 is no table of this list; expected 1 to 2"),
        ("pulses.centre", r"expected the number of a table and its key, such as pulses\.1\.KEY"),
    ],
)
def test_a_table_of_a_list_that_is_not_there_is_refused(name, rule):
    scene = parse_scene(TWO_PULSES + f'[sweep]\n"{name}" = ["4 ps"]\n')
    with pytest.raises(ValueError, match=rule):
        list(points(scene))


def test_columns_of_a_joined_file_are_in_the_order_of_the_points(tmp_path):
    """Of a bent and a linear molecule, whatever their keys: a hash of the version among other things decided it."""
    bent, linear = (
        run_scene(make_scene("levels", molecule="water")).table,
        run_scene(make_scene("levels", molecule="CO")).table,
    )
    for first, second in (("0" * 16, "f" * 16), ("f" * 16, "0" * 16)):
        joined = CombinedFile.of([f"{first[0]}.csv"], tmp_path)
        joined.open_folder()
        joined.write_part(first, {"molecule": "water"}, bent)
        joined.write_part(second, {"molecule": "CO"}, linear)
        joined.join([first, second], "{}")
        assert (tmp_path / f"{first[0]}.csv").read_text().startswith("point,molecule,j,ka,kc,energy_mhz,")
