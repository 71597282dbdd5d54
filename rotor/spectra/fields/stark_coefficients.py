"""Stark coefficients of levels and of lines: derivatives of energies at zero field.

    ΔE(E) = c1 E + c2 E² + c3 E³ + c4 E⁴ + ...

c1 is not 0 if ±K coincide; tables print c2 in MHz/(kV/cm)². The coefficients are perturbation sums over the blocks of the map
(`rotor.quantum.fields.field_series`) and do not depend on the fields of the map. For a linear top, c2 of J = 0 is -μ²/6hB; for a
symmetric top, c1 = -μ KM/[J(J+1)] (Encyclopedia of Physical Science and Technology, 3rd edition, Microwave Molecular
Spectroscopy, eq. 106).

The series has a limited range. It ends where the E⁵ or the E⁶ term reaches 1 % of the largest of the first four terms. Up to there the
four coefficients give the shift to about 1 %; beyond it, use the energies of the map. Close levels that the field mixes strongly, such as
asymmetry doublets, have large coefficients and a short range.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.quantum.effects.stark import HIGHEST_KV_PER_CM
from rotor.quantum.fields.block_states import basis_order, count_of
from rotor.quantum.fields.blocks import FieldBlock
from rotor.quantum.fields.field_map import FieldMap, blocks_of_map
from rotor.quantum.fields.field_series import FieldSeries, field_series
from rotor.quantum.fields.map_request import MapRequest
from rotor.table import Table

if TYPE_CHECKING:
    from rotor.spectra.fields.lines import FieldLines

POWERS = 4
_SUMMED = POWERS + 2  # E⁵ and E⁶ determine the range
SHARE = 0.01  # of the shift: contribution of E⁵ or E⁶ at the end of the range


@dataclass(frozen=True, eq=False, repr=False)
class StarkCoefficients(Table):
    """Stark coefficients, a row for each state or line.

    names: labels and M by column. coefficients, errors: (n, powers) in MHz/(kV/cm)^p, p = 1 ... 4; the errors are those of rounding.
    valid_to_kv_per_cm: (n,) field up to which the four terms give the shift to about 1 %.
    """

    names: dict[str, NDArray[Any]]
    coefficients: Floats
    errors: Floats
    valid_to_kv_per_cm: Floats

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Names, c1_mhz_per_kv_per_cm, c2_mhz_per_kv2_per_cm2, ..., valid_to_kv_per_cm, then c1_error, c2_error, ..."""
        powers = range(1, POWERS + 1)
        units = ["c1_mhz_per_kv_per_cm"] + [f"c{p}_mhz_per_kv{p}_per_cm{p}" for p in powers[1:]]
        values = {name: self.coefficients[:, place] for place, name in enumerate(units)}
        errors = {f"c{p}_error": self.errors[:, p - 1] for p in powers}
        return {**self.names, **values, "valid_to_kv_per_cm": self.valid_to_kv_per_cm, **errors}

    @property
    def provenance(self) -> dict[str, Any]:
        """The highest power, and the share of the shift that defines the range."""
        return {"powers": POWERS, "share_beyond_range": SHARE}


def level_coefficients(states: FieldMap) -> StarkCoefficients:
    """Stark coefficients of the states of a map.

    Parameters
    ----------
    states : FieldMap
        The states, the basis and the direction of the field. The values of its fields do not matter, except that a map with only negative
        fields names states at these.

    Returns
    -------
    StarkCoefficients
        A row for each curve of the map.

    Examples
    --------
    >>> from rotor.quantum.effects.stark import stark_map
    >>> from rotor.tops.top import Top
    >>> rod = Top.from_constants("B=6000 MHz", dipole_abc_debye=(0.7, 0, 0))
    >>> coefficients = level_coefficients(stark_map(rod, [0, 100], j_highest=0))
    >>> coefficients.coefficients[0, 1].round(8).item()  # -μ²/6B
    -3.44937264
    """
    request, jmax = states.request, states.jmax
    series = [_block_series(request, block, jmax) for block in blocks_of_map(request, jmax)]
    first = [rows.start for rows in states.curves()]
    of_curve = list(zip(states.block_number[first].tolist(), states.rank[first].tolist(), strict=True))
    values, errors = (
        np.array([getattr(series[number], name)[rank] for number, rank in of_curve]) for name in FieldSeries._fields
    )
    return _coefficients({"label": states.label[first], "m": states.m[first]}, values, errors)


def line_coefficients(lines: FieldLines) -> StarkCoefficients:
    """Stark coefficients of lines: those of the upper state minus those of the lower state."""
    first = [rows.start for rows in lines.pairs()]
    values, errors = _field_series(lines.request, lines.blocks, lines.jmax)
    upper, lower = lines.upper_state[first], lines.lower_state[first]
    names = {name: getattr(lines, name)[first] for name in ("upper", "upper_m", "lower", "lower_m")}
    return _coefficients(names, values[upper] - values[lower], errors[upper] + errors[lower])


def _field_series(request: MapRequest, blocks: Sequence[FieldBlock], jmax: int) -> FieldSeries:
    series = [_block_series(request, block, jmax) for block in blocks]
    coefficients, errors = (np.concatenate(parts) for parts in zip(*series, strict=True))
    return FieldSeries(coefficients, errors)


def _block_series(request: MapRequest, block: FieldBlock, jmax: int) -> FieldSeries:
    """Coefficients c1 ... c6 of the states of a block that a map solves, in their order at its fields; levels beyond its J max act too."""
    # only negative fields: odd powers change sign
    sign = -1 if request.fields.max() <= 0 > request.fields.min() else 1
    turned = tuple(sign**n * term for n, term in enumerate(request.matrices(block)))
    order, inside = block.free_order, basis_order(block, jmax)
    ranks = np.flatnonzero(block.j[order] <= jmax)[: count_of(request, block, inside)]
    series = field_series(turned, int(ranks[-1]) + 1, _SUMMED, block.even_in_field)
    powers = np.power(sign, np.arange(1, _SUMMED + 1))
    return FieldSeries(series.coefficients[ranks] * powers, series.errors[ranks])


def _coefficients(names: dict[str, NDArray[Any]], values: Floats, errors: Floats) -> StarkCoefficients:
    return StarkCoefficients(names, values[:, :POWERS], errors[:, :POWERS], _range(np.abs(values)))


def _range(sizes: Floats) -> Floats:
    """Field at which the E⁵ or E⁶ term reaches `SHARE` of the largest lower term; at most the highest accepted field."""
    beyond = np.full(len(sizes), HIGHEST_KV_PER_CM)
    for q in range(POWERS + 1, _SUMMED + 1):
        term = sizes[:, q - 1]
        reach = np.zeros(len(sizes))
        for p in range(1, POWERS + 1):
            with np.errstate(divide="ignore", invalid="ignore"):  # terms of 0 never matter: their field is infinite
                field = (SHARE * sizes[:, p - 1] / term) ** (1 / (q - p))
            reach = np.maximum(reach, np.where(term > 0, field, np.inf))
        beyond = np.minimum(beyond, reach)
    return np.asarray(beyond)
