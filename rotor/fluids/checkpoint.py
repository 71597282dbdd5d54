"""Files of a long run: growing rows and frames, and checkpoints that are written atomically.

A checkpoint is written to a temporary file, flushed to disk and renamed. It records the lengths of the growing files. A resumed run
first truncates them to these lengths, so that no line is duplicated or incomplete.
"""

from __future__ import annotations

import io
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.arrays import Floats

if TYPE_CHECKING:
    from ase import Atoms

VERSION = 1


class TextFile:
    """A text file that grows by complete pieces; a piece that does not fit on the disk leaves the file unchanged.

    length: bytes of an existing file to continue from; None: new file.
    """

    def __init__(self, path: str | os.PathLike[str], length: int | None = None) -> None:
        self.path = Path(path)
        if length is not None and (not self.path.is_file() or self.path.stat().st_size < length):
            raise ValueError(
                f"{path}: is shorter than the {length} bytes that it had when the checkpoint was written; it was changed since"
            )
        self._file = open(path, "wb" if length is None else "r+b", buffering=0)  # noqa: SIM115 - open as long as the run
        if length is not None:
            self._file.truncate(length)
            self._file.seek(length)

    def add(self, text: str) -> None:
        """Append a piece; OSError, with the file unchanged, if the disk is full."""
        start, left = self._file.tell(), memoryview(text.encode("utf-8"))
        try:
            while left:
                left = left[self._file.write(left) :]
        except OSError as error:
            if os.path.isfile(self.path):
                self._file.truncate(start)
            raise OSError(error.errno, error.strerror, str(self.path)) from error

    def sync(self) -> int:
        """Bytes, all on the disk."""
        if os.path.isfile(self.path):
            os.fsync(self._file.fileno())
        return self._file.tell()

    def close(self) -> None:
        """Let go of it."""
        self._file.close()


class ExtendedXyz(TextFile):
    """Frames as extended xyz: elements, positions, momenta, time and potential energy."""

    def add_frame(self, atoms: Atoms, time_ps: float) -> None:
        """Append a frame."""
        from ase.io.extxyz import write_extxyz

        frame = atoms.copy()
        frame.info.update(time_ps=time_ps, potential_ev=float(atoms.get_potential_energy()))
        columns = ["symbols", "positions", "momenta", *(["molecule"] if "molecule" in frame.arrays else [])]
        text = io.StringIO()
        write_extxyz(text, [frame], columns=columns)
        self.add(text.getvalue())


class AseTrajectory:
    """Frames as ASE's .traj, counted by frames; a continued file is copied up to the frame of the checkpoint."""

    def __init__(self, path: str | os.PathLike[str], length: int | None = None) -> None:
        from ase.io.trajectory import Trajectory

        self.path = Path(path)
        if length is None:
            self.path.unlink(missing_ok=True)
            return
        beside = self.path.with_name(f".{self.path.name}.part")
        try:
            with Trajectory(self.path) as old, Trajectory(beside, "w") as new:
                for k in range(length):
                    new.write(old[k])
        except (OSError, ValueError, IndexError, TypeError) as error:
            beside.unlink(missing_ok=True)
            message = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
            raise ValueError(
                f"{path}: cannot be continued ({message}); the checkpoint needs its first {length} frames"
            ) from error
        os.replace(beside, self.path)

    def add_frame(self, atoms: Atoms, time_ps: float) -> None:
        """Append a frame."""
        from ase.io.trajectory import Trajectory

        with Trajectory(self.path, "a") as file:
            file.write(atoms)

    def sync(self) -> int:
        """Frames, all on the disk."""
        from ase.io.trajectory import Trajectory

        if not self.path.exists():
            return 0
        with open(self.path, "rb") as file:
            os.fsync(file.fileno())
        with Trajectory(self.path) as file:
            return len(file)

    def close(self) -> None:
        """Nothing to close between frames."""


def trajectory_file(path: str | os.PathLike[str], length: int | None = None) -> ExtendedXyz | AseTrajectory:
    """The trajectory file for a suffix: .traj, .xyz or .extxyz."""
    suffix = Path(path).suffix.lower()
    if suffix == ".traj":
        return AseTrajectory(path, length)
    if suffix in (".xyz", ".extxyz"):
        return ExtendedXyz(path, length)
    raise ValueError(f"{path}: frames are written as .traj (ASE), .xyz or .extxyz; the suffix names the format")


@dataclass(frozen=True)
class Checkpoint:
    """The data to continue a run exactly.

    arrays: state, and the rows of the table if there is no CSV file. about: step, settings, thermostat, lengths of
    the growing files, fingerprint of the box.
    """

    arrays: Mapping[str, Floats]
    about: Mapping[str, Any]

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write to a temporary file, flush, and rename: at any time the complete old or new checkpoint exists."""
        target = Path(path).resolve()
        beside = target.with_name(f".{target.name}.part")
        content = io.BytesIO()
        about = json.dumps({"rotor_checkpoint": VERSION, **self.about})
        np.savez(content, about=np.array(about), **self.arrays)  # type: ignore[arg-type]
        try:
            with open(beside, "wb") as file:
                file.write(content.getbuffer())
                file.flush()
                os.fsync(file.fileno())
            os.replace(beside, target)
        except OSError as error:
            beside.unlink(missing_ok=True)
            raise OSError(error.errno, error.strerror, str(path)) from error
        _sync_folder(target.parent)


def read_checkpoint(path: str | os.PathLike[str]) -> Checkpoint:
    """The checkpoint in a file; ValueError for other files."""
    import zipfile

    if not Path(path).is_file():
        raise ValueError(f"{path}: no such checkpoint; leave --resume out to start a new run")
    try:
        with open(path, "rb") as handle, np.load(handle, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files if name != "about"}
            about = json.loads(str(file["about"]))
    except (zipfile.BadZipFile, KeyError, ValueError, EOFError, TypeError, AttributeError) as error:
        raise ValueError(f"{path}: is no checkpoint of rotor fluid; name the file of --checkpoint") from error
    if not isinstance(about, dict):
        raise ValueError(f"{path}: is no checkpoint of rotor fluid; name the file of --checkpoint")
    if about.get("rotor_checkpoint") != VERSION:
        raise ValueError(
            f"{path}: a checkpoint of version {about.get('rotor_checkpoint')}; this program reads {VERSION}"
        )
    return Checkpoint(arrays, about)


def csv_line(values: Sequence[float]) -> str:
    """A row in full precision: the shortest texts that reproduce the doubles."""
    return ",".join(repr(float(value)) for value in values) + "\n"


def read_rows(path: str | os.PathLike[str], length: int) -> list[list[float]]:
    """Rows within the first `length` bytes of a CSV file, without the heading."""
    with open(path, "rb") as file:
        lines = file.read(length).decode("utf-8").splitlines()[1:]
    return [[float(value) for value in line.split(",")] for line in lines]


def _sync_folder(folder: Path) -> None:
    """Flush a rename to disk, on systems that can open folders (not Windows)."""
    if os.name == "nt":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
