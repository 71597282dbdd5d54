"""What a request will do, before it is done: the plan, and its seconds and memory from shorter calls.

Seconds come from a short calibration: the same request to a lower J (or fewer molecules, fields, steps), scaled by the work that
is left. They are processor time without start-up and compilation, within a factor of 3 where they are above 1 s. Memory is the peak
of what Python and NumPy have in use in the same short runs, and grows with what the answer holds.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property, partial
from typing import Any, TypeVar

LONG_SEARCH = 10.0  # seconds; a shorter one is made twice, as its first time has imports and compilation in it
T = TypeVar("T")
MOST_LEFT_OUT = 4  # lines of what a calculation leaves out
SMALL = 0.1  # of the largest: effects below it are counted together
ENOUGH_SECONDS, LARGER = 0.05, 3  # of a call that is extrapolated; by how much its size grows until it takes so long


@dataclass(frozen=True)
class LeftOut:
    """Something that a request leaves out. size: in `unit`; None: not estimated. basis: how the size was found, and for what."""

    name: str
    size: float | None
    unit: str
    basis: str


def largest_first(parts: Iterable[LeftOut]) -> tuple[LeftOut, ...]:
    """By size; what is not estimated comes last."""
    return tuple(sorted(parts, key=lambda part: (part.size is None, -(part.size or 0.0))))


def larger_ones(items: Sequence[T], size: Callable[[T], float | None], name: Callable[[T], str]) -> tuple[list[T], str]:
    """The items of a report on what is left out, and a sentence that names the others: below a tenth of the largest, or beyond the fourth.

    >>> larger_ones([5.0, 4.0, 0.1], lambda one: one, str)
    ([5.0, 4.0], 'and smaller or not estimated: 0.1')
    """
    least = SMALL * max((known for item in items if (known := size(item)) is not None), default=0.0)
    larger = [item for item in items if (known := size(item)) is None or known >= least]
    shown = larger if len(larger) <= MOST_LEFT_OUT else larger[: MOST_LEFT_OUT - 1]
    others = [name(item) for item in items if item not in shown]
    return shown, f"and smaller or not estimated: {', '.join(others)}" if others else ""


@dataclass(frozen=True)
class Plan:
    """What a scene will do.

    effects: taken, with their sizes where they have one. good: quantum numbers, or what the motion conserves. parts: name and
    words: basis, blocks, method and why. counts: by name. seconds, memory_mb: estimated. left_out: largest first.
    """

    kind: str
    effects: tuple[str, ...] = ()
    good: tuple[str, ...] = ()
    parts: tuple[tuple[str, str], ...] = ()
    counts: Mapping[str, int] = field(default_factory=dict)
    seconds: float = 0.0
    memory_mb: float = 0.0
    left_out: tuple[LeftOut, ...] = ()

    def facts(self) -> dict[str, Any]:
        """The plan as plain records."""
        return asdict(self) | {"parts": dict(self.parts), "counts": dict(self.counts)}


def plan_of_whole(kind: str, call: Callable[[], Any], describe: Callable[[Any], Mapping[str, Any]]) -> Plan:
    """The plan of a call that is made whole. describe: the other fields of the plan, of its answer."""
    answers: list[Any] = []
    seconds = timed(lambda: answers.append(call()))
    return Plan(kind, seconds=seconds, memory_mb=peak_mb(call), **describe(answers[-1]))


@dataclass(frozen=True)
class Growth:
    """A call of one size, whose cost follows from two smaller ones: a part that is always there, and one in proportion to the work.

    call: of a size. size: that is asked for. sizes: of the short calls, the smaller first. work: what seconds grow in proportion to, of a
    size; memory: the same of the memory. A call that is no larger than the second size is measured itself.
    """

    call: Callable[[int], Any]
    size: int
    sizes: tuple[int, int]
    work: Callable[[int], float] = float
    memory: Callable[[int], float] = float

    @property
    def seconds(self) -> float:
        """Processor time."""
        return self.extrapolated(timed, self.work)

    @property
    def memory_mb(self) -> float:
        """Peak memory."""
        return self.extrapolated(peak_mb, self.memory)

    @cached_property
    def enough(self) -> tuple[int, int]:
        """Sizes of which the second takes long enough to be extrapolated: what is done once for many hides in a shorter call."""
        first, second = self.sizes
        while second < self.size and timed(partial(self.call, second)) < ENOUGH_SECONDS:
            first, second = LARGER * first, min(LARGER * second, self.size)
        return min(first, self.size), min(second, self.size)

    def extrapolated(self, measure: Callable[[Callable[[], Any]], float], work: Callable[[int], float]) -> float:
        """What the call takes by a measure."""
        first, second = self.enough
        most = measure(partial(self.call, second))
        if second == self.size:
            return most
        rate = max(most - measure(partial(self.call, first)), 0.0) / max(work(second) - work(first), 1e-300)
        return most + rate * (work(self.size) - work(second))


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


def peak_mb(call: Callable[[], Any]) -> float:
    """The most memory that a call has in use at one time beyond what was there, of Python and NumPy; made before, so without imports."""
    import tracemalloc

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
