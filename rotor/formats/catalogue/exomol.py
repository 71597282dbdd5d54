"""ExoMol's line lists: .states (number, energy, degeneracy, J, labels) and .trans (upper, lower, Einstein A), packed or not.

J. Tennyson et al., J. Mol. Spectrosc. 327, 73 (2016): energies in cm⁻¹, A in 1/s, total degeneracy with nuclear spin; a transition's
wavenumber is the difference of its energies. Q(T) is that of the .pf file beside, else the sum over the states. Transitions are read in
pieces, so that memory is bounded by the states.
"""

from __future__ import annotations

import bz2
import gzip
import lzma
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from rotor import units
from rotor.arrays import Floats
from rotor.observed.model.partition import SUMMED_K, PartitionTable
from rotor.observed.model.species import SpeciesLines, species_lines, strength_from_einstein

PIECE_BYTES = 1 << 22  # text in memory at a time; as Python objects it needs ten times as much
_PACKED: dict[str, Any] = {".bz2": bz2.open, ".gz": gzip.open, ".xz": lzma.open}


@dataclass(frozen=True)
class States:
    """Levels in the order of the file: numbers (n,) rising, energies above the lowest (K), degeneracies, labels from J on."""

    number: NDArray[np.int64]
    energy_k: Floats
    degeneracy: Floats
    label: NDArray[np.str_]

    def rows(self, numbers: NDArray[np.int64], where: str) -> NDArray[np.int64]:
        """Rows of states by number; ValueError for one that the file does not have."""
        rows = np.minimum(np.searchsorted(self.number, numbers), len(self.number) - 1)
        if (missing := self.number[rows] != numbers).any():
            raise ValueError(f"{where}: state {int(numbers[missing][0])} is not in the .states file")
        return rows


@contextmanager
def opened(path: Path) -> Iterator[IO[bytes]]:
    """A file, unpacked by its suffix."""
    with _PACKED.get(path.suffix.lower(), open)(path, "rb") as handle:
        yield handle


def read_states(path: Path) -> States:
    """The .states file; ValueError with file and line for a line without number, energy, degeneracy and J."""
    numbers, energies, degeneracies, labels = [], [], [], []
    with opened(path) as handle:
        for count, line in enumerate(handle, start=1):
            parts = line.split(None, 3)
            try:
                number, energy, degeneracy = int(parts[0]), float(parts[1]), float(parts[2])
                label = " ".join(parts[3].decode("ascii").split())
            except (ValueError, IndexError):
                raise ValueError(
                    f"{path}, line {count}: {line[:60].decode('latin-1')!r}: expected number, energy, degeneracy, J and labels"
                ) from None
            numbers.append(number)
            energies.append(energy)
            degeneracies.append(degeneracy)
            labels.append(label)
    if not numbers:
        raise ValueError(f"{path}: no states")
    order = np.argsort(numbers, kind="stable")
    kelvin = np.array(energies)[order] * units.MHZ_PER_CM / units.MHZ_PER_K
    return States(
        np.array(numbers)[order],
        kelvin - kelvin.min(),
        np.array(degeneracies)[order],
        np.array(labels, dtype=np.str_)[order],
    )


def states_partition(states: States, path: Path) -> PartitionTable:
    """Q(T) of the .pf file beside the states, else Σ g exp(-E/kT)."""
    beside = path.with_name(_base(path) + ".pf")
    if beside.exists():
        kelvin, q = np.loadtxt(beside, usecols=(0, 1), unpack=True, ndmin=2)
        return PartitionTable(kelvin, q, str(beside))
    q = np.array([float(np.sum(states.degeneracy * np.exp(-states.energy_k / t))) for t in SUMMED_K])
    return PartitionTable(np.array(SUMMED_K), q, f"summed over {path.name}")


def exomol_species(path: Path, states: States) -> Iterator[SpeciesLines]:
    """The lines of all .trans files beside a .states file, in pieces; `upper` and `lower` are rows of `read_states`.

    Raises ValueError with file and line for what cannot be read, and where there is no .trans file.
    """
    partition, base = states_partition(states, path), _base(path)
    files = sorted(file for file in path.parent.glob(f"{base}*.trans*"))
    if not files:
        raise ValueError(f"{path}: no {base}*.trans file beside it")
    name = base.split("__")[0]
    for file in files:
        for upper, lower, a in _transitions(file, states):
            frequency = (states.energy_k[upper] - states.energy_k[lower]) * units.MHZ_PER_K
            selected = frequency > 0
            up, low = upper[selected], lower[selected]
            yield species_lines(
                name,
                frequency[selected],
                strength_from_einstein(a[selected], frequency[selected], states.degeneracy[up]),
                states.energy_k[low],
                states.degeneracy[up],
                partition,
                upper=up,
                lower=low,
                source=str(path),
                identity={"database": "ExoMol"},
            )


def _base(path: Path) -> str:
    return path.name.split(".states")[0]


def _transitions(path: Path, states: States) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64], Floats]]:
    """Rows of upper and lower states and Einstein coefficients, a few hundred thousand at a time."""
    count = 0
    with opened(path) as handle:
        while lines := handle.readlines(PIECE_BYTES):
            table = _numbers(lines, path, count)
            where = f"{path}, lines {count + 1} to {count + len(lines)}"
            count += len(lines)
            yield (
                states.rows(table[:, 0].astype(np.int64), where),
                states.rows(table[:, 1].astype(np.int64), where),
                table[:, 2],
            )


def _numbers(lines: list[bytes], path: Path, before: int) -> Floats:
    """The numbers of lines of three columns or four; ValueError with the first line that has others."""
    columns = len(lines[0].split())
    try:
        values = np.array(b"".join(lines).split(), dtype=np.float64)
    except ValueError:
        values = np.zeros(0)
    if columns in (3, 4) and len(values) == columns * len(lines):
        return values.reshape(len(lines), columns)
    for number, line in enumerate(lines, start=before + 1):
        if not _is_transition(line, columns):
            raise ValueError(
                f"{path}, line {number}: {line[:60].decode('latin-1')!r}: expected upper state, lower state and Einstein coefficient"
            )
    raise ValueError(f"{path}, line {before + 1}: expected three or four columns")


def _is_transition(line: bytes, columns: int) -> bool:
    parts = line.split()
    try:
        [float(part) for part in parts]
    except ValueError:
        return False
    return len(parts) == columns and columns in (3, 4)
