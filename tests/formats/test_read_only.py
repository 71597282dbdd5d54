"""Files that are read are never opened for writing, whatever reader of ASE their suffix reaches."""

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import ase
import ase.db
import ase.io
import numpy as np
import pytest
from ase.build import molecule
from ase.io.formats import ioformats

from rotor.formats.boxes import read_box
from rotor.formats.read_write import read
from rotor.molecules.readers.ase_files import structures

_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_CONTENTS = {
    "byte": b"x",
    "text": b"hello\n1 2 3\n",
    "zeros": bytes(200),
    "sqlite": b"SQLite format 3\0" + bytes(84),
    "ulm": b"- of UlmASE-Trajectory" + bytes(100),
}
_watched: dict[str, list[str]] = {}


def _hook(event: str, args: tuple) -> None:
    """Note every opening for writing of a path below a watched folder; audit hooks stay as long as the process."""
    if not _watched or event not in ("open", "sqlite3.connect", "socket.connect"):
        return
    name = str(args[0])
    for folder, events in _watched.items():
        if event == "open" and name.startswith(folder) and args[2] & _WRITING:
            events.append(f"open {name} {args[1]}")
        elif (event == "sqlite3.connect" and name.startswith(folder)) or event == "socket.connect":
            events.append(f"{event} {args}")


sys.addaudithook(_hook)


def _names() -> list[str]:
    """A file name for every suffix and pattern of ASE's formats, for every format by its name, and for odd cases."""
    names = {"x.aselmdb", "x.db.gz", "postgres.traj", "mysql.traj", "mol@2.traj", "x.sqlite", "x.nc"}
    for form in ioformats.values():
        names |= {f"x.{form.name}", *(f"x.{suffix}" for suffix in form.extensions)}
        names |= {pattern.replace("*", "x") for pattern in form.globs}
    return sorted(names)


@pytest.fixture
def watched(tmp_path):
    """A folder and what was opened for writing in it, sockets too."""
    events: list[str] = []
    _watched[str(tmp_path)] = events
    yield tmp_path, events
    del _watched[str(tmp_path)]


def _write(path: Path, content: bytes) -> None:
    """A file on the quiet: through a descriptor of its folder, which no hook sees by name."""
    folder = os.open(path.parent, os.O_RDONLY)
    handle = os.open(path.name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644, dir_fd=folder)
    os.write(handle, content)
    os.close(handle)
    os.close(folder)


@pytest.mark.parametrize("kind", _CONTENTS)
@pytest.mark.filterwarnings("ignore")  # ASE's readers warn of what they cannot read
def test_no_suffix_makes_a_reader_write(watched, kind):
    folder, events = watched
    names = _names()
    assert len(names) > 90  # ASE 3.29 has 87 formats
    for name in names:
        path = folder / name
        _write(path, _CONTENTS[kind])
        for reader in (read, read_box):
            with suppress(ValueError):  # most say that the file is not what it should be, and nothing else is raised
                reader(path)
        assert path.read_bytes() == _CONTENTS[kind], name
        path.unlink()
        assert not list(folder.iterdir()), name
    assert events == []


def test_the_hook_sees_ase_write_a_database(watched):
    folder, events = watched
    _write(folder / "x.db", b"x")
    ase.io.read(folder / "x.db", index=":")
    assert any("sqlite3.connect" in event for event in events)
    assert (folder / "x.db").stat().st_size > 10_000


def test_structures_are_read_from_a_database_and_a_trajectory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    water = molecule("H2O")
    database = tmp_path / "postgres.db"  # ASE takes such a relative name for a server
    with ase.db.connect(database) as rows:
        rows.write(ase.Atoms("HF", [(0, 0, 0), (0, 0, 0.9)]))
        rows.write(water)
    trajectory = tmp_path / "mol@0.traj"  # what follows @ is no index
    ase.io.write(tmp_path / "mol.traj", [water, water])
    (tmp_path / "mol.traj").rename(trajectory)
    for path in (database, trajectory):
        before = path.read_bytes()
        assert len(structures(path)) == 2
        assert len(structures(path, "-1")) == 1
        top = read(Path(path.name))
        assert top.molecule.formula == "H2O"
        assert path.read_bytes() == before
        assert np.allclose(top.molecule.positions_angstrom, water.positions, atol=1e-12)  # copied, no arithmetic


@pytest.mark.parametrize("text", ["x", "&SUBSYS\n&COORD\nH 0 0 0\n"])
def test_a_cut_restart_file_ends(tmp_path, text):
    """ASE's reader of CP2K waits for the end of a section for ever, filling the memory."""
    path = tmp_path / "x.restart"
    path.write_text(text)
    done = subprocess.run(
        [sys.executable, "-m", "rotor", "info", str(path)], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 2
    assert "the file ends before" in done.stderr
    assert done.stderr.count("\n") == 1
    path.write_text(
        "&SUBSYS\n&CELL\nA 9 0 0\nB 0 9 0\nC 0 0 9\n&END CELL\n&COORD\nH 0 0 0\nF 0 0 0.9\n&END COORD\n&END\n"
    )
    assert read(path).kind == "linear"
    assert len(read_box(path)) == 2
