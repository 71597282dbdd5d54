"""Stark coefficients of levels and of lines: the shift in a field as a polynomial, fitted to energies in the field.

    ΔE(E) = c1 E + c2 E² + c3 E³ + c4 E⁴

c1 is not 0 where ±K coincide, c2 is what tables print (MHz/(kV/cm)²). The fit is a plain least-squares one; its largest departure is given
with it: where two levels that repel each other are as close as their shifts are large, a polynomial is no description, and it shows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.fields.field_map import FieldMap
from rotor.table import Table

if TYPE_CHECKING:
    from rotor.spectra.fields.lines import FieldLines

POWERS = 4


@dataclass(frozen=True, eq=False, repr=False)
class StarkCoefficients(Table):
    """Coefficients of shifts against the field, one row for each state or line.

    names: labels and M by column. coefficients: (n, powers) in MHz/(kV/cm)^p, p = 1 ... departure_mhz: the largest of the fit. highest:
    field in kV/cm up to which was fitted.
    """

    names: dict[str, NDArray[Any]]
    coefficients: Floats
    departure_mhz: Floats
    highest_kv_per_cm: float

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Names, c1_mhz_per_kv_per_cm, c2_mhz_per_kv2_per_cm2, ..., departure_mhz."""
        units = ["c1_mhz_per_kv_per_cm"] + [f"c{p}_mhz_per_kv{p}_per_cm{p}" for p in range(2, POWERS + 1)]
        fitted = {name: self.coefficients[:, place] for place, name in enumerate(units)}
        return {**self.names, **fitted, "departure_mhz": self.departure_mhz}

    @property
    def provenance(self) -> dict[str, Any]:
        """The field up to which was fitted."""
        return {"highest_kv_per_cm": self.highest_kv_per_cm, "powers": POWERS}


def level_coefficients(states: FieldMap) -> StarkCoefficients:
    """Stark coefficients of every state of a map against a static field.

    Raises ValueError for fewer than five fields other than 0.

    >>> from rotor.quantum.effects.stark import stark_map
    >>> from rotor.tops.top import Top
    >>> rod = Top.from_constants("B=6000 MHz", dipole_abc_debye=(0.7, 0, 0))
    >>> found = level_coefficients(stark_map(rod, np.linspace(0, 0.5, 11), j_highest=0))
    >>> found.coefficients[0, 1].round(5).item()  # -μ²/6B
    -3.44937
    """
    first = [rows.start for rows in states.curves()]
    shifts = np.array([states.energy_mhz[rows] - states.free_mhz[rows] for rows in states.curves()])
    names = {"label": states.label[first], "m": states.m[first]}
    return _fitted(states.fields, shifts, names)


def line_coefficients(lines: FieldLines) -> StarkCoefficients:
    """Stark coefficients of every line between two states, the shift counted from the line of the free top.

    Raises ValueError for fewer than five fields other than 0.
    """
    first = [rows.start for rows in lines.pairs()]
    shifts = np.array([lines.shift_mhz[rows] for rows in lines.pairs()])
    names = {name: getattr(lines, name)[first] for name in ("upper", "upper_m", "lower", "lower_m")}
    return _fitted(lines.fields, shifts, names)


def _fitted(fields: Floats, shifts: Floats, names: dict[str, NDArray[Any] | Ints]) -> StarkCoefficients:
    used = fields != 0
    if used.sum() <= POWERS:
        raise ValueError(
            f"{int(used.sum())} fields other than 0: more than {POWERS} are needed for the coefficients of E to E^{POWERS}"
        )
    highest = float(np.abs(fields).max())
    powers = np.arange(1, POWERS + 1)
    matrix = (fields[used, None] / highest) ** powers
    scaled = np.linalg.lstsq(matrix, shifts[:, used].T, rcond=None)[0]
    departure = np.abs(matrix @ scaled - shifts[:, used].T).max(axis=0)
    return StarkCoefficients(names, scaled.T / highest**powers, departure, highest)
