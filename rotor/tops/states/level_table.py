"""Level energies as a table, for molecules whose distortion series does not converge: water, D2O, HDO.

A table belongs to a set of constants and an isotopologue; it is dropped when either changes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.frozen import dataclass
from rotor.table import Table


@dataclass(frozen=True, eq=False, repr=False)
class LevelTable(Table):
    """Energies of labelled levels.

    quanta : columns (n,) of whole numbers by name, in the order of a label: `j`, `ka`, `kc` of an asymmetric top
    energy_mhz : (n,), E/h in MHz from the level J = 0
    error_mhz : (n,), one standard deviation in MHz
    source : source of the energies
    own_error_mhz : (n,), the part of the error that other states `v` of the same rotation do not share. If it is not known (None),
        lines have no error, because errors of energies in a table are correlated.

    Raises ValueError for columns of different length, a repeated level, and energies that are not finite.

    >>> table = LevelTable({"j": np.array([0, 1]), "ka": np.array([0, 0]), "kc": np.array([0, 1])}, np.array([0.0, 9.0]), np.ones(2))
    >>> table.rows_of({"j": np.array([1, 2]), "ka": np.array([0, 0]), "kc": np.array([1, 2])}).tolist()
    [1, -1]
    """

    quanta: Mapping[str, Ints]
    energy_mhz: Floats
    error_mhz: Floats
    source: str = ""
    own_error_mhz: Floats | None = None
    _sorted: tuple[Ints, Ints, Ints] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        lengths = {name: len(column) for name, column in self.columns.items()}
        if len(set(lengths.values())) != 1 or not len(self.energy_mhz):
            raise ValueError(f"columns of a level table have one length above 0; found {lengths}")
        for name in self.columns.keys() - self.quanta.keys():
            if not np.isfinite(self.columns[name]).all():
                raise ValueError(f"{name} of a level table: expected finite numbers")
        stacked = np.stack([np.asarray(column, dtype=np.int64) for column in self.quanta.values()])
        if stacked.min() < 0:
            raise ValueError("quantum numbers of a level table: expected whole numbers of 0 or more")
        sizes = stacked.max(axis=1) + 1
        keys = np.asarray(np.ravel_multi_index(tuple(stacked), tuple(sizes.tolist())))
        order = np.argsort(keys)
        twice = np.flatnonzero(np.diff(keys[order]) == 0)
        if len(twice):
            label = ", ".join(f"{name} = {column[order[twice[0]]]}" for name, column in self.quanta.items())
            raise ValueError(f"the level {label} is twice in the table; remove one")
        object.__setattr__(self, "_sorted", (order, keys[order], sizes))

    def __len__(self) -> int:
        return len(self.energy_mhz)

    @property
    def columns(self) -> dict[str, NDArray[np.generic]]:
        """Quantum numbers, energy and error by name, and the part of the error that is not shared, if known."""
        out: dict[str, NDArray[np.generic]] = dict(self.quanta)
        out |= {"energy_mhz": self.energy_mhz, "error_mhz": self.error_mhz}
        return out if self.own_error_mhz is None else out | {"own_error_mhz": self.own_error_mhz}

    def rows_of(self, quanta: Mapping[str, Ints]) -> Ints:
        """Row (m,) of each labelled level, -1 if it is not in the table; labels by the names of the table."""
        order, keys, sizes = self._sorted
        labels = np.stack([np.asarray(quanta[name], dtype=np.int64) for name in self.quanta])
        inside = ((labels >= 0) & (labels < sizes[:, None])).all(axis=0)
        # any valid label in place of one outside the table; it is discarded below
        key = np.ravel_multi_index(tuple(np.where(inside, labels, 0)), tuple(sizes.tolist()))
        # a label beyond the last meets the last row, and differs from it
        place = np.minimum(np.searchsorted(keys, key), len(keys) - 1)
        return np.where(inside & (keys[place] == key), order[place], -1)

    def line_errors(self, upper: Ints, lower: Ints) -> Floats:
        """One standard deviation in MHz of lines between rows (m,) of the table; nan if a row is -1.

        Between two states of one rotation only the parts of the errors that are not shared count; between other levels the whole errors
        count, as if uncorrelated. Raises ValueError for a table without `own_error_mhz`.
        """
        if self.own_error_mhz is None:
            raise ValueError("errors of lines between levels of a table: expected a table with own_error_mhz")
        rotation = np.stack([column for name, column in self.quanta.items() if name != "v"], axis=1)
        alike = (rotation[upper] == rotation[lower]).all(axis=1)
        error = np.where(
            alike,
            np.hypot(*(self.own_error_mhz[i] for i in (upper, lower))),
            np.hypot(*(self.error_mhz[i] for i in (upper, lower))),
        )
        return np.where((upper >= 0) & (lower >= 0), error, np.nan)


def tabulated_energies(
    table: LevelTable, quanta: Mapping[str, Ints], energy_mhz: Floats
) -> tuple[Floats, NDArray[np.bool_]]:
    """Energies (n,) in MHz of solved levels, replaced by those of the table where it has them, and the mask (n,) of replaced levels.

    quanta, energy_mhz: labels by name and energies (n,) of the solved levels, from the level J = 0.
    A level that is not in the table keeps the energy of the distortion series.
    """
    rows = table.rows_of(quanta)
    known = rows >= 0
    return np.where(known, table.energy_mhz[rows], energy_mhz), known
