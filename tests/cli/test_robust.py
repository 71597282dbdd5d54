"""What goes wrong around the command: hostile files, full disks, signals, very large molecules."""

from __future__ import annotations

import gzip
import importlib.util
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from places import PROJECT

import rotor
from rotor.formats.atomic_write import PREFIX, DoesNotFitError, atomic_path, unfinished_folder, write_together
from rotor.molecules.molecule import Molecule, nearest_others

SPCAT_CASE = PROJECT / "tests" / "oracles" / "ocs"


# Files that are not what they should be


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.toml", "x=" + "[" * 990 + "]" * 990, "more than 50 deep"),
        ("a.toml", "x=" + "[" * 60 + "]" * 60, "more than 50 deep"),
        ("a.toml", f"[constants]\nA = {'9' * 500}\n", "a whole number of 500 digits is too large"),
        ("a.toml", f"[constants]\nA = {'9' * 5000}\n", "a whole number of thousands of digits"),
        ("a.extxyz", "\n\nO 0 0 0\n", "line 3: 'O 0 0 0' is not a number of atoms"),
        ("a.extxyz", '2\nProperties="""\nO 0 0 0\nH 0 0 1\n', "is not a list of name:type:columns"),
        ("a.extxyz", '2\nLattice="a Properties=x\nO 0 0 0\nH 0 0 1\n', "line 2"),
    ],
)
def test_odd_files_are_one_line(call, name, content, said):
    Path(name).write_text(content)
    code, _, err = call("info", name)
    assert code == 2
    assert said in err
    assert err.count("\n") == 1


@pytest.mark.parametrize("smiles", ["**", "*", "C*", "[*]CC"])
def test_a_dummy_atom_is_refused(call, smiles):
    code, _, err = call("info", f"SMILES:{smiles}")
    assert (code, "'*' stands for any atom" in err) == (2, True)


@pytest.mark.parametrize("column", ["STR0", "STR1"])
def test_a_cut_beyond_a_double_is_refused(call, column):
    for suffix in (".var", ".int"):
        (Path.cwd() / f"a{suffix}").write_bytes((SPCAT_CASE / f"ocs{suffix}").read_bytes())
    lines = Path("a.int").read_text().split("\n")
    words = lines[1].split()
    words[{"STR0": 5, "STR1": 6}[column]] = "400"
    Path("a.int").write_text("\n".join([lines[0], " ".join(words), *lines[2:]]))
    code, _, err = call("spectrum", "a.int")
    assert (code, f"{column} is 400" in err) == (2, True)


@pytest.mark.parametrize("about", ["[1, 2]", "5", '{"rotor_checkpoint": 1}', '{"rotor_checkpoint": 1, "box": 3}'])
def test_a_foreign_checkpoint_is_refused(call, about):
    np.savez("x.npz", about=np.array(about), centres=np.zeros(3))
    code, _, err = call("fluid", "water", "--molecules", "8", "--cutoff", "2.5", "--steps", "2", "--checkpoint", "x.npz",
                        "--resume")  # fmt: skip
    assert code == 2
    assert "x.npz: " in err
    assert "this is a defect" not in err


@pytest.mark.parametrize("name", ["a.cat.gz", "a.xyz.gz"])
def test_a_gzip_bomb_is_read_with_a_bound(call, name):
    with gzip.open(name, "wb", compresslevel=1) as file:
        for _ in range(30):
            file.write(b"0" * 10_000_000)
    code, _, err = call("cat" if "cat" in name else "info", name)
    assert (code, "unpacks to more than 134 MB" in err) == (2, True)


def test_a_link_in_a_circle_is_refused(call):
    os.symlink("x.csv", "x.csv")
    code, _, err = call("spectrum", "CO", "--csv", "x.csv")
    assert (code, "--csv x.csv: is a link that points to itself" in err) == (2, True)


@pytest.mark.parametrize("verb", ["fit", "cat", "fluid", "structure", "convert"])
def test_a_source_that_is_missing_is_named(call, verb):
    code, _, err = call(verb)
    assert code == 2
    assert "is missing; --help shows" in err or "is missing; expected" in err


def test_a_data_base_is_read_and_not_written(call):
    import ase.build
    import ase.db

    with ase.db.connect("x.db") as base:
        base.write(ase.build.molecule("H2O"))
    before = Path("x.db").read_bytes()
    assert call("info", "x.db")[0] == 0
    assert Path("x.db").read_bytes() == before
    assert os.listdir() == ["x.db"]


@pytest.mark.parametrize("value", ["1000000", "-1e6"])
def test_a_cut_that_no_double_holds_is_refused(call, value):
    code, _, err = call("spectrum", "CO", "--jmax", "3", "--min-lgint", value)
    assert (code, "--min-lgint" in err) == (2, True)


@pytest.mark.parametrize(
    "words",
    [
        ["info", "NH3", "--temperature", "1e300"],
        ["spectrum", "SO2", "--jmax", "1000000"],
        ["stark", "H2O", "--field", "0:10kV/cm:3", "--jmax", "1000"],
        ["fluid", "water", "--molecules", "27", "--steps", "4", "--cutoff", "1e300"],
    ],
)
def test_work_without_end_is_refused(call, words):
    code, _, err = call(*words)
    assert code in (1, 2)
    assert err.splitlines()[-1].startswith("error: ")


def test_an_unknown_constant_to_choose_is_named(call):
    Path("g.csv").write_text(
        "j_upper,ka_upper,kc_upper,j_lower,ka_lower,kc_lower,frequency_mhz,error_mhz\n1,0,1,0,0,0,11000.0,0.01\n"
        "2,0,2,1,0,1,21900.0,0.01\n2,1,2,1,1,1,20900.0,0.01\n2,1,1,1,1,0,23100,0.01\n"
    )
    code, _, err = call("fit", "g.csv", "--constants", "A=43 B=6 C=5 GHz", "--free", "B", "--choose", "x")
    assert (code, "'x' is n" in err) == (2, True)


# A disk that is full


WRITES = {
    "x.csv": ["spectrum", "water", "--csv", "x.csv"],
    "x.parquet": ["spectrum", "water", "--parquet", "x.parquet"],
    "x.cat": ["spectrum", "water", "--cat", "x.cat"],
    "x.json": ["spectrum", "water", "--json", "x.json"],
    "x.png": ["levels", "CO", "--plot", "x.png"],
    "y.csv": ["levels", "water", "--csv", "y.csv"],
    "x.egy": ["levels", "water", "--egy", "x.egy"],
    "z.csv": ["tumble", "water", "--csv", "z.csv"],
    "x.toml": ["convert", "water", "x.toml"],
    "x.par": ["convert", "water", "x.par"],
    "t.csv": ["thermo", "CO", "--csv", "t.csv"],
}


def settings_of(name: str) -> list[str]:
    return ["--jmax", "6"] if WRITES[name][0] in ("spectrum", "levels") else []


@pytest.mark.parametrize("name", [*WRITES])
def test_a_full_disk_is_exit_1_with_the_name_of_the_file(call, name):
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full on this system")
    os.symlink("/dev/full", name)
    code, _, err = call(*WRITES[name], *settings_of(name))
    assert (code, err.splitlines()[-1]) == (1, f"error: {name}: No space left on device")
    assert os.listdir() == [name]


@pytest.mark.parametrize("name", [*WRITES])
def test_a_file_that_may_not_grow_is_exit_1_and_leaves_nothing(call, name):
    resource = pytest.importorskip("resource")
    call(*WRITES[name], *settings_of(name))  # what is compiled is in its cache now
    size = sum(path.stat().st_size for path in Path().iterdir() if path.name == name) // 2
    for path in Path().iterdir():
        path.unlink()
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        code, _, err = call(*WRITES[name], *settings_of(name))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert (code, err.splitlines()[-1]) == (1, f"error: {name}: File too large")
    assert os.listdir() == []


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_a_full_standard_output_is_exit_1():
    with open("/dev/full", "w") as full:
        done = subprocess.run([sys.executable, "-m", "rotor", "info", "CO"], stdout=full, stderr=subprocess.PIPE, text=True,
                              cwd=PROJECT, timeout=60, check=False)  # fmt: skip
    assert (done.returncode, done.stderr) == (1, "error: standard output: No space left on device\n")


# Signals


WAITS = """
import sys, time
from pathlib import Path
import rotor.formats.lines.line_tables as tables
def slow(path):
    Path(path).write_text("half")
    print("writing", flush=True)
    time.sleep(60)
import rotor.verbs.spectrum as spectrum
from rotor.verbs.common.outputs import Files
write = Files.write
Files.write = lambda self, writers, **how: write(self, dict.fromkeys(writers, slow), **how)
sys.argv = ["rotor", "spectrum", "CO", "--csv", "x.csv"]
from rotor.cli import main
main()
"""


def stopped_while_writing(number: int) -> int:
    environment = os.environ | {"PYTHONPATH": str(PROJECT)}
    process = subprocess.Popen(
        [sys.executable, "-c", WAITS], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment
    )
    assert process.stdout is not None
    with process.stdout:
        assert process.stdout.readline() == b"writing\n"
        process.send_signal(number)
        return process.wait(timeout=30)


@pytest.mark.skipif(os.name == "nt", reason="signals of another kind")
def test_a_signal_to_end_cleans_up_as_ctrl_c_does(folder):
    assert stopped_while_writing(signal.SIGTERM) == 143
    assert os.listdir() == []
    assert stopped_while_writing(signal.SIGINT) == 130
    assert os.listdir() == []


@pytest.mark.skipif(os.name == "nt", reason="no locks of folders")
def test_what_a_killed_process_left_is_removed_by_the_next_one(call):
    assert stopped_while_writing(signal.SIGKILL) == -signal.SIGKILL
    assert [name.startswith(PREFIX) for name in os.listdir()] == [True, True]  # a folder, and the lock of its file
    assert call("spectrum", "CO", "--csv", "x.csv")[0] == 0
    assert sorted(os.listdir()) == ["x.csv", "x.csv.provenance.json"]


KILLED = """
import os, signal, sys
from pathlib import Path
from rotor.temporary import locked_folder
with locked_folder(Path(sys.argv[1]), "rotor-lammps-") as folder:
    (folder / "log").write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(os.name == "nt", reason="no locks of folders")
def test_the_folder_of_an_engine_that_was_killed_is_removed_by_the_next_run(folder, monkeypatch):
    """Of a LAMMPS run, which stands where temporary files do; LAMMPS itself is not needed to begin one."""
    from rotor.fluids.engines import lammps

    subprocess.run([sys.executable, "-c", KILLED, str(folder)], check=False)
    assert [name.startswith("rotor-lammps-") for name in os.listdir()] == [True]
    (left,) = os.listdir()
    begun = []
    monkeypatch.setattr(lammps, "check", lambda: None)
    monkeypatch.setattr(lammps.tempfile, "gettempdir", lambda: str(folder))

    def write_files(place, *_, **__):
        begun.append(os.listdir())
        raise ValueError("no more is needed")

    monkeypatch.setattr(lammps, "write_files", write_files)
    with pytest.raises(ValueError, match="no more"):
        next(lammps.frames(None, None))
    assert len(begun[0]) == 1
    assert begun[0] != [left]
    assert os.listdir() == []


@pytest.mark.skipif(os.name == "nt", reason="no locks of folders")
def test_a_new_folder_that_another_process_removes_is_made_again(folder, monkeypatch):
    """Before it is locked it looks abandoned: a point of a sweep over processes failed, some seconds after the other began."""
    fcntl = pytest.importorskip("fcntl", reason="no locks of folders")
    make, handles = Path.mkdir, []

    def taken(path, mode):
        make(path, mode)
        if not handles:
            handles.append(os.open(path, os.O_RDONLY))
            fcntl.flock(handles[0], fcntl.LOCK_EX)  # as the process that removes it

    monkeypatch.setattr(Path, "mkdir", taken)
    with unfinished_folder(folder) as made:
        first, second = sorted(folder.iterdir(), key=lambda path: path == made)
        shutil.rmtree(first)
        assert made == second
    os.close(handles[0])


@pytest.mark.skipif(os.name == "nt", reason="no locks of folders")
def test_the_folder_of_a_living_process_stays(folder):
    with unfinished_folder(folder) as first, atomic_path(folder / "a.txt") as unfinished:
        unfinished.write_text("a")
        assert first.is_dir()
        with unfinished_folder(folder):
            assert first.is_dir()
            assert unfinished.exists()
    assert os.listdir() == ["a.txt"]


def test_a_result_goes_through_a_link_and_into_a_pipe(call, tmp_path_factory):
    elsewhere = tmp_path_factory.mktemp("elsewhere") / "real.json"
    os.symlink(elsewhere, "x.json")
    assert call("info", "CO", "--json", "x.json")[0] == 0
    assert Path("x.json").is_symlink()
    assert json.loads(elsewhere.read_text())["kind"] == "linear"
    os.symlink("/dev/null", "n.json")
    assert call("info", "CO", "--json", "n.json")[0] == 0


# Very large molecules


def test_a_hundred_thousand_atoms_take_seconds():
    grid = 1.5 * np.stack(np.meshgrid(*[np.arange(47)] * 3), -1).reshape(-1, 3)[:100_000]
    started = time.perf_counter()
    top = rotor.Top.from_molecule(Molecule(("C",) * len(grid), grid))
    assert time.perf_counter() - started < 60.0  # s; 6 on a quiet machine, and 100 times that before
    assert top.kind == "asymmetric"


def test_a_cube_of_thousands_of_atoms_has_a_frame_in_seconds():
    cube = 1.5 * np.stack(np.meshgrid(*[np.arange(16)] * 3), -1).reshape(-1, 3)
    started = time.perf_counter()
    assert rotor.Top.from_molecule(Molecule(("C",) * len(cube), cube)).kind == "spherical"
    assert time.perf_counter() - started < 20.0  # s; 1 on a quiet machine


def test_nearest_atoms_of_many_are_those_of_all_distances():
    points = np.random.default_rng(5).uniform(0, 30, (400, 3))
    distances = np.linalg.norm(points[:, None] - points, axis=2)
    np.fill_diagonal(distances, np.inf)
    apart, nearest = nearest_others(points)
    np.testing.assert_array_equal(nearest, distances.argmin(axis=1))
    np.testing.assert_allclose(apart, distances.min(axis=1), rtol=1e-12)  # round-off of a square root


def test_smiles_of_thousands_of_atoms_are_refused_at_once(call):
    started = time.perf_counter()
    code, _, err = call("info", "SMILES:" + "C" * 3000)
    assert time.perf_counter() - started < 10.0  # s; 0.3 on a quiet machine, over a minute before
    assert (code, "9002 atoms with their hydrogens" in err) == (2, True)


# Mutated files and command lines


def test_a_sample_of_mutated_inputs_makes_no_traceback():
    spec = importlib.util.spec_from_file_location("fuzz", PROJECT / "benchmarks" / "fuzz.py")
    assert spec is not None
    assert spec.loader is not None
    fuzz = importlib.util.module_from_spec(spec)
    sys.modules["fuzz"] = fuzz
    spec.loader.exec_module(fuzz)
    failing, done = fuzz.fuzz(10_000_000, 300, fuzz.QUICK)
    assert done == 300
    assert [(failure.failing, failure.words, failure.said) for failure in failing] == []


# Long sums


@pytest.mark.parametrize(
    "words",
    [
        ["info", "--constants", "A=430 B=57 C=55 MHz"],
        ["thermo", "--constants", "A=430 B=57 C=55 MHz"],
        ["info", "mistyped.xyz"],
    ],
    ids=lambda words: " ".join(words[:2]),
)
def test_sums_over_very_many_levels_take_seconds(call, words):
    Path("mistyped.xyz").write_text("3\n\nO 0 0 0\nH 0.96 0 0\nH -0.24 9300 0\n")  # 0.93 was meant
    started = time.perf_counter()
    code, out, _ = call(*words)
    assert time.perf_counter() - started < 15.0  # s; 1 on a quiet machine, 39 and more than 60 before
    assert code == 0
    assert out


ENDS = """
import atexit, sys
from rotor.cli import process
atexit.register(print, "at the end")
if "own" in sys.argv:
    process.begin()
if "trace" in sys.argv:
    sys.settrace(lambda *seen: None)
print("written")
process.end(3)
"""


@pytest.mark.parametrize("words", [["own"], ["own", "trace"], []])
def test_a_process_that_ends_has_written_and_done_what_was_registered(words):
    done = subprocess.run([sys.executable, "-c", ENDS, *words], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (3, "written\nat the end\n", "")


def test_files_whose_format_cannot_hold_the_result_are_left_out_only_on_request(tmp_path):
    def refuses(path: Path) -> None:
        raise DoesNotFitError("too wide")

    writers = {tmp_path / "a.csv": lambda path: path.write_text("whole"), tmp_path / "b.egy": refuses}
    with pytest.raises(DoesNotFitError, match="too wide"):
        write_together(writers)
    assert list(tmp_path.iterdir()) == []
    left_out = write_together(writers, leave_out=True)
    assert {path.name: str(error) for path, error in left_out.items()} == {"b.egy": "too wide"}
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]
