"""Q(T) of a top with its classical limit, as plain records."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.thermodynamics.sums.classical_limit import ClassicalLimit, classical_limit, classical_partition_function
from rotor.thermodynamics.sums.level_sums import AT_WORST, Progress, is_quick, refusal
from rotor.thermodynamics.sums.partition import PartitionFunction, partition_function
from rotor.thermodynamics.sums.spin_factor import spin_functions

if TYPE_CHECKING:
    from rotor.tops.top import Top

_KEYS = ("temperature_k", "q", "classical", "jmax", "relative_error", "source")


def partition_facts(
    top: Top,
    partition: PartitionFunction,
    effects: Sequence[QuantumEffect] = SEMI_RIGID,
    limit: ClassicalLimit | None = None,
) -> dict[str, Any]:
    """Q at one temperature with its classical limit, by the keys of docs/verbs; both count the spins of the effects.

    With internal rotation there is no classical limit, because that of the rigid top lacks torsional states. limit: that of the top,
    if already computed.
    """
    classical = None
    if top.internal_rotation is None:
        classical = spin_functions(top, effects) * float((limit or classical_limit(top)).q(partition.temperature_k))
    return {
        "temperature_k": partition.temperature_k,
        "q": partition.q,
        "classical": classical,
        "jmax": partition.jmax,
        "relative_error": partition.relative_error,
        "source": partition.source,
    }


def partition_table(
    top: Top, temperatures_k: Sequence[float], progress: Progress | None = None, quick: bool = False
) -> list[dict[str, Any]]:
    """Q summed and classical at each temperature; without a sum `q` is None and `source` says why.

    quick: skip sums over levels of mixed states or internal rotation that take longer than some seconds.

    >>> from rotor.tops.top import Top
    >>> [round(row["q"], 2) for row in partition_table(Top.from_constants("B=57635.968 MHz"), [10.0, 300.0])]
    [3.97, 108.79]
    """
    if quick:
        rows = {t: _long_row(top, t) for t in temperatures_k if not is_quick(top, t)}
        rest = [t for t in temperatures_k if t not in rows]
        rows |= dict(zip(rest, partition_table(top, rest, progress), strict=True)) if rest else {}
        return [rows[t] for t in temperatures_k]
    try:
        functions = partition_function(top, temperatures_k, refuse=False, progress=progress)
        limit = classical_limit(top)
        return [_unless_refused(partition_facts(top, function, limit=limit)) for function in functions]
    except ValueError:  # the levels of one temperature cannot be solved: try each temperature separately
        return [_row_alone(top, temperature) for temperature in temperatures_k]


def _unless_refused(facts: dict[str, Any]) -> dict[str, Any]:
    """The facts of one temperature; a sum with too large an error is removed."""
    if facts["relative_error"] <= AT_WORST:
        return facts
    return _without_sum(facts, refusal(facts["temperature_k"], facts["relative_error"]))


def _row_alone(top: Top, temperature_k: float) -> dict[str, Any]:
    try:
        return partition_facts(top, partition_function(top, temperature_k))
    except ValueError as error:
        classical_facts = {
            "temperature_k": temperature_k,
            "classical": classical_partition_function(top, temperature_k),
        }
        return _without_sum(classical_facts, str(error))


def _long_row(top: Top, temperature_k: float) -> dict[str, Any]:
    turning = top.internal_rotation is not None
    classical_facts = {
        "temperature_k": temperature_k,
        "classical": None if turning else classical_partition_function(top, temperature_k),
    }
    what = "internal rotation" if turning else "states that mix"
    return _without_sum(classical_facts, f"a long sum over levels of {what}; --temperature asks for it")


def _without_sum(facts: dict[str, Any], reason: str) -> dict[str, Any]:
    unknown = {"q": None, "jmax": None, "relative_error": None, "source": reason}
    return {name: unknown.get(name, facts.get(name)) for name in _KEYS}
