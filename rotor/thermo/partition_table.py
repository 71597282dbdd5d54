"""Q(T) of a top beside its classical limit, as plain records."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rotor.thermo.classical_limit import classical_partition_function
from rotor.thermo.level_sums import Progress
from rotor.thermo.partition import PartitionFunction, partition_function, partition_functions

if TYPE_CHECKING:
    from rotor.tops.top import Top


def partition_facts(top: Top, partition: PartitionFunction) -> dict[str, Any]:
    """Q at one temperature beside its classical limit, by the keys of docs/command_line.md."""
    return {
        "temperature_k": partition.temperature_k,
        "q": partition.q,
        "classical": classical_partition_function(top, partition.temperature_k),
        "jmax": partition.jmax,
        "relative_error": partition.relative_error,
        "source": partition.source,
    }


def partition_table(
    top: Top, temperatures_k: Sequence[float], progress: Progress | None = None
) -> list[dict[str, Any]]:
    """Q summed and classical at each temperature; where there is no sum, `q` is None and `source` says why.

    >>> from rotor.tops.top import Top
    >>> [round(row["q"], 2) for row in partition_table(Top.from_constants("B=57635.968 MHz"), [10.0, 300.0])]
    [3.97, 108.79]
    """
    try:
        return [partition_facts(top, one) for one in partition_functions(top, temperatures_k, progress=progress)]
    except ValueError:  # one of them is out of reach: each for itself
        return [_partition_row(top, temperature) for temperature in temperatures_k]


def _partition_row(top: Top, temperature_k: float) -> dict[str, Any]:
    try:
        return partition_facts(top, partition_function(top, temperature_k))
    except ValueError as error:
        return {
            "temperature_k": temperature_k,
            "q": None,
            "classical": classical_partition_function(top, temperature_k),
            "jmax": None,
            "relative_error": None,
            "source": str(error),
        }
