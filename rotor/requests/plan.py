"""Plan of a request: what it will do, and its time and memory, extrapolated from shorter calls.

The calibration runs the same request to a lower J (or with fewer molecules, fields, steps) and scales by the remaining work. Seconds are
processor time without start-up and compilation, within a factor of 3 above 1 s. Memory is the peak of what Python and NumPy allocate in
the same short runs, and grows with the size of the answer.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, field
from functools import cached_property, partial
from typing import Any, TypeVar

from rotor.frozen import dataclass

LONG_SEARCH = 10.0  # seconds; a shorter search is repeated, since its first run includes imports and compilation
T = TypeVar("T")
MOST_LEFT_OUT = 4  # lines of what a calculation leaves out
SMALL = 0.1  # of the largest effect: smaller ones are named without a line of their own
ENOUGH_SECONDS = 0.05  # shortest call that is extrapolated
LARGER = 3  # growth of the size until a call takes so long


@dataclass(frozen=True)
class LeftOut:
    """A neglected effect. size: in `unit`; None if not estimated. basis: how the size was estimated, and for which state."""

    name: str
    size: float | None
    unit: str
    basis: str


def largest_first(parts: Iterable[LeftOut]) -> tuple[LeftOut, ...]:
    """By size; effects without an estimate come last."""
    return tuple(sorted(parts, key=lambda part: (part.size is None, -(part.size or 0.0))))


def larger_items(
    items: Sequence[T], size: Callable[[T], float | None], name: Callable[[T], str]
) -> tuple[list[T], str]:
    """Up to four items of at least a tenth of the largest size (or without a size), and a sentence that names the others.

    >>> larger_items([5.0, 4.0, 0.1], lambda size: size, str)
    ([5.0, 4.0], 'and smaller or not estimated: 0.1')
    """
    least = SMALL * max((value for item in items if (value := size(item)) is not None), default=0.0)
    larger = [item for item in items if (value := size(item)) is None or value >= least]
    shown = larger if len(larger) <= MOST_LEFT_OUT else larger[: MOST_LEFT_OUT - 1]
    others = [name(item) for item in items if item not in shown]
    return shown, f"and smaller or not estimated: {', '.join(others)}" if others else ""


@dataclass(frozen=True)
class Plan:
    """Plan of a scene.

    effects: included effects, with sizes if estimated. good: quantum numbers, or conserved quantities of the motion.
    parts: (name, text) on basis, blocks, method and reason. counts: by name. seconds, memory_mb: estimates. left_out: largest first.
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


@dataclass(frozen=True)
class Cost:
    """Cost of a request. seconds: processor time. memory_mb: peak. answer: of the request, or of a shorter one that describes it."""

    seconds: float
    memory_mb: float
    answer: Any = None


def whole_cost(call: Callable[[], Any], times: float = 1.0, largest: Callable[[], Any] | None = None) -> Cost:
    """The cost of a call, and its answer. times: of its seconds. largest: the call that takes the memory, if it is another."""
    answers: list[Any] = []
    seconds = timed(lambda: answers.append(call()))
    return Cost(times * seconds, traced(largest or call)[1], answers[-1])


@dataclass(frozen=True)
class Growth:
    """A call whose cost is extrapolated from two smaller ones: a constant part, and a part proportional to the work.

    call: takes a size. size: the requested one. sizes: of the two short calls, smaller first. work: amount that the time is
    proportional to, from a size; memory: likewise for the memory. A call no larger than the second size is measured directly.
    """

    call: Callable[[int], Any]
    size: int
    sizes: tuple[int, int]
    work: Callable[[int], float] = float
    memory: Callable[[int], float] = float

    @property
    def seconds(self) -> float:
        """Processor time (s)."""
        first, _, taken = self._short_calls
        return self._extrapolated(taken, lambda: timed(partial(self.call, first)), self.work)

    @property
    def memory_mb(self) -> float:
        """Peak memory."""
        first, second, _ = self._short_calls
        most = traced(partial(self.call, second))[1]
        return self._extrapolated(most, lambda: traced(partial(self.call, first))[1], self.memory)

    @property
    def cost(self) -> Cost:
        """Both."""
        return Cost(self.seconds, self.memory_mb)

    @cached_property
    def _short_calls(self) -> tuple[int, int, float]:
        """Sizes of the two short calls, grown until the second takes long enough, and its time: constant parts dominate shorter ones."""
        first, second = (min(size, self.size) for size in self.sizes)
        while (taken := timed(partial(self.call, second))) < ENOUGH_SECONDS and second < self.size:
            first, second = min(LARGER * first, self.size), min(LARGER * second, self.size)
        return first, second, taken

    def _extrapolated(self, most: float, measure_first: Callable[[], float], work: Callable[[int], float]) -> float:
        """Cost of the call at `size` from that of the second short call and, unless that is all, of the first."""
        first, second, _ = self._short_calls
        if second == self.size:
            return most
        rate = max(most - measure_first(), 0.0) / max(work(second) - work(first), 1e-300)
        return most + rate * (work(self.size) - work(second))


def timed(call: Callable[[], Any], long: float = 3.0) -> float:
    """Processor time (s) of the second call, without imports and compilation; of the first if that takes longer than `long`."""
    start = time.process_time()
    call()
    first = time.process_time() - start
    if first > long:
        return first
    start = time.process_time()
    call()
    return time.process_time() - start


def traced(call: Callable[[], T]) -> tuple[T, float]:
    """The answer of a call, and the memory (MB) that it allocates at its peak; call it once before, for imports."""
    import tracemalloc

    started_here = not tracemalloc.is_tracing()
    if started_here:
        tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        tracemalloc.reset_peak()
        answer = call()
        return answer, (tracemalloc.get_traced_memory()[1] - before) / 1e6
    finally:
        if started_here:
            tracemalloc.stop()
