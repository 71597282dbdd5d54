"""What the plans of all kinds share: the plan itself, the short calibration, and the words about levels."""

from __future__ import annotations

import math
import time
import tracemalloc
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from rotor.scenes.left_out import LeftOut

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.internal_rotation import InternalRotationConstants
    from rotor.tops.top import Top

LONG_SEARCH = 10.0  # seconds; a shorter one is made twice, as its first time has imports and compilation in it
ENOUGH_SECONDS, LARGER = 0.05, 3  # of a call that is extrapolated; by how much its size grows until it takes so long
ENERGY = "energies are eigenvalues of the truncated Hamiltonian"


@dataclass(frozen=True)
class Plan:
    """What a scene will do.

    effects: taken, with their sizes where they have one. good: quantum numbers, or what the motion conserves. parts: name and
    words: basis, blocks, method and why. counts: by name. seconds, memory_mb: estimated. left_out: largest first.
    """

    kind: str
    effects: tuple[str, ...]
    good: tuple[str, ...]
    parts: tuple[tuple[str, str], ...]
    counts: Mapping[str, int]
    seconds: float
    memory_mb: float
    left_out: tuple[LeftOut, ...]

    def facts(self) -> dict[str, Any]:
        """The plan as plain records."""
        return asdict(self) | {"parts": dict(self.parts), "counts": dict(self.counts)}


def timed(call: Callable[[], Any], long: float = 3.0) -> float:
    """Processor time of a call, its second one unless the first takes longer than `long` seconds: without imports and compilation."""
    start = time.process_time()
    call()
    first = time.process_time() - start
    if first > long:
        return first
    start = time.process_time()
    call()
    return time.process_time() - start


def extrapolated(call: Callable[[int], Any], work: Callable[[int], float], sizes: tuple[int, int], size: int) -> float:
    """Seconds of a call of one size from two smaller ones: a part that is always there, and one in proportion to the work.

    Parameters
    ----------
    call : callable
        Does what is timed, for a size.
    work : callable
        What the growing part is in proportion to, of a size.
    sizes : (int, int)
        The two sizes that are timed, the smaller first.
    size : int
        The size that is asked for.

    Returns
    -------
    float
        Processor time.
    """
    return _extrapolated(timed, call, work, _enough(call, sizes, size), size)


def _enough(call: Callable[[int], Any], sizes: tuple[int, int], size: int) -> tuple[int, int]:
    """Sizes of which the second takes long enough to be extrapolated: what is done once for many hides in a shorter call."""
    first, second = sizes
    while second < size and timed(partial(call, second)) < ENOUGH_SECONDS:
        first, second = LARGER * first, min(LARGER * second, size)
    return first, second


def peak_mb(call: Callable[[], Any]) -> float:
    """The most memory that a call has in use at one time beyond what was there, of Python and NumPy; made before, so without imports."""
    mine = not tracemalloc.is_tracing()
    if mine:
        tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        tracemalloc.reset_peak()
        call()
        return (tracemalloc.get_traced_memory()[1] - before) / 1e6
    finally:
        if mine:
            tracemalloc.stop()


def extrapolated_mb(
    call: Callable[[int], Any], work: Callable[[int], float], sizes: tuple[int, int], size: int
) -> float:
    """Peak memory in MB of a call of one size from those of two smaller ones.

    Parameters
    ----------
    call : callable
        Does what is measured, for a size.
    work : callable
        What the growing part is in proportion to, of a size.
    sizes : (int, int)
        The two sizes that are measured, the smaller first.
    size : int
        The size that is asked for.

    Returns
    -------
    float
        MB.
    """
    return _extrapolated(peak_mb, call, work, _enough(call, sizes, size), size)


def _extrapolated(
    measure: Callable[[Callable[[], Any]], float], call: Callable[[int], Any], work: Callable[[int], float],
    sizes: tuple[int, int], size: int,
) -> float:  # fmt: skip
    """What a call of one size takes by a measure, from two smaller ones; a call that is no larger is measured itself."""
    first, second = (min(one, size) for one in sizes)
    most = measure(lambda: call(second))
    if second == size:
        return most
    rate = max(most - measure(lambda: call(first)), 0.0) / max(work(second) - work(first), 1e-300)
    return most + rate * (work(size) - work(second))


MOST_J_COMPARED = {
    1: 30,
    2: 8,
}  # J up to which the truncation of the torsion is compared with more functions, by the number of tops


def level_parts(top: Top, jmax: int, effects: Sequence[QuantumEffect]) -> list[tuple[str, str]]:
    """Basis, blocks and method of the levels of a top."""
    from rotor.quantum.estimates.convergence import converges_to
    from rotor.quantum.wang.basis import wang_blocks
    from rotor.quantum.wang.rotation import representation_of

    spins = [spin for effect in effects for spin in effect.spins(top)]
    if top.internal_rotation is not None:
        return _torsional_parts(top, top.internal_rotation, jmax)
    if top.kind in ("linear", "spherical", "prolate", "oblate"):
        basis, method = f"J to {jmax}; no matrix", f"closed form: H is diagonal in the basis of a {top.kind} top"
    else:
        largest = max(block.size for block in wang_blocks(jmax, representation_of(top)))
        basis = f"J to {jmax}; four Wang blocks of each J, of up to {largest} states"
        method = f"Wang blocks one by one, {representation_of(top)}; {ENERGY}"
    parts = [("basis", basis), ("method", method)]
    if (reach := converges_to(top, jmax, effects)) < jmax:
        parts.append(
            (
                "warning",
                f"the distortion series converges to J = {reach}; energies above at the highest K are not to be trusted",
            )
        )
    if spins:
        size = math.prod(spin.twice + 1 for spin in spins)
        parts.append(("spins", f"blocks of F over the solved rotation, {size} spin functions: {_names(spins)}"))
    return parts


def _names(spins: Sequence[Any]) -> str:
    return ", ".join(dict.fromkeys(spin.name for spin in spins))


def effect_texts(top: Top, j: int, effects: Sequence[QuantumEffect]) -> tuple[str, ...]:
    from rotor.quantum.effect import effect_sizes

    return tuple(f"{one.name}, {one.size_mhz:.2g} MHz at J = {j}" for one in effect_sizes(top, j, effects))


def good_numbers(top: Top, effects: Sequence[QuantumEffect]) -> tuple[str, ...]:
    """Quantum numbers that stay good under the effects, as the levels have them."""
    from rotor.quantum.solve import solve_levels

    return solve_levels(top, 1, effects=effects, vectors=False).quanta_names


def _torsional_parts(top: Top, constants: InternalRotationConstants, jmax: int) -> list[tuple[str, str]]:
    """Basis, method and truncation error of levels with an internal rotor."""
    from rotor.quantum.internal_rotation.levels import turning_tops
    from rotor.quantum.internal_rotation.truncation import truncation_mhz

    count = constants.functions
    size = (2 * jmax + 1) * count
    compared = min(jmax, MOST_J_COMPARED[constants.tops])
    error = truncation_mhz(turning_tops(top, constants), compared, constants.vt_max, count)
    functions = "torsional functions" if constants.tops == 1 else "products of torsional functions"
    return [
        ("basis", f"J to {jmax}; {count} {functions} for each K, blocks of up to {size} states"),
        ("method", f"torsion of each K and species first; {ENERGY}"),
        ("truncation", f"at most {error:.1g} MHz at J = {compared}, v_t up to {constants.vt_max}"),
    ]
