"""Plan of a request: what it will do, and its time and memory, extrapolated from shorter calls.

A knob declares how the cost grows with an amount of the request (`Growth`), such as J max or the number of molecules; the calibration runs
the request with small amounts and scales by the remaining work. Seconds are processor time without start-up and compilation, within a
factor of 3 above 1 s. Memory is the peak of what Python and NumPy allocate in the same short runs, and grows with the size of the answer.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, field
from functools import partial
from typing import Any, NamedTuple, TypeVar

from rotor.frozen import dataclass
from rotor.requests.budget import size_text

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

    def __str__(self) -> str:
        size = "not estimated" if self.size is None else f"about {size_text(self.size, self.unit)}"
        return f"{self.name}: {size}; {self.basis}"


def largest_first(parts: Iterable[LeftOut]) -> tuple[LeftOut, ...]:
    """By size; effects without an estimate come last."""
    return tuple(sorted(parts, key=lambda part: (part.size is None, -(part.size or 0.0))))


def left_out_texts(effects: Sequence[Any], text: Callable[[Any], str] = str) -> list[str]:
    """Texts of up to four neglected effects of at least a tenth of the largest size (or without a size), and one that names the others.

    effects: with `name` and `size`.
    >>> left_out_texts([LeftOut("spins", 5.0, "MHz", "as split"), LeftOut("field", 0.1, "MHz", "of the Earth")])
    ['spins: about 5 MHz; as split', 'and smaller or not estimated: field']
    """
    least = SMALL * max((effect.size for effect in effects if effect.size is not None), default=0.0)
    larger = [effect for effect in effects if effect.size is None or effect.size >= least]
    shown = larger if len(larger) <= MOST_LEFT_OUT else larger[: MOST_LEFT_OUT - 1]
    others = [effect.name for effect in effects if effect not in shown]
    return [*map(text, shown), *([f"and smaller or not estimated: {', '.join(others)}"] if others else [])]


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

    def rows(self, conserved: str = "good quantum numbers") -> list[tuple[str, str]]:
        """The plan as pairs of name and text, without what is left out. conserved: what `good` is called."""
        return [
            *([("effects", "; ".join(self.effects))] if self.effects else []),
            (conserved, ", ".join(self.good) or "none"),
            *self.parts,
            *((name, f"{count:,}") for name, count in self.counts.items()),
            ("seconds", f"{self.seconds:.2g} processor time, without start-up and compilation"),
            ("memory", f"{self.memory_mb:.2g} MB peak"),
        ]

    def __str__(self) -> str:
        left = (f"left out: {part}" for part in self.left_out)
        return "\n".join([*(f"{name}: {text}" for name, text in self.rows()), *left])

    def facts(self) -> dict[str, Any]:
        """The plan as plain records."""
        return asdict(self) | {"parts": dict(self.parts), "counts": dict(self.counts)}


@dataclass(frozen=True)
class Cost:
    """Cost of a request. seconds: processor time. memory_mb: peak. answer: of the request, or of a shorter one that describes it.
    amount: by which it was extrapolated.
    """

    seconds: float
    memory_mb: float
    answer: Any = None
    amount: Any = None


class Run(NamedTuple):
    """How a verb runs a request. compute: its answer. complete: the answer with its table, which is made on demand."""

    compute: Callable[[Any], Any]
    complete: Callable[[Any], Any]


@dataclass(frozen=True, eq=False)
class Growth:
    """How the cost of a request grows with an amount of it: a constant part, and a part proportional to the work.

    short: two small amounts that are measured, smaller first; or one, and the whole cost is proportional to the work. It may be a
    function of the request. An amount no larger than the second is measured directly.
    amount: of a request, by default the value of the knob. at: the request with an amount, by default as the knob sets it.
    prepare: returns the request that is measured. work: what the time is proportional to, from a request and an amount; memory: likewise.
    largest: the request that takes the memory, if it does not follow from the short ones. table: whether the table is part of a run.
    """

    short: tuple[float, ...] | Callable[[Any], tuple[float, ...]]
    amount: Callable[[Any], float] | None = None
    at: Callable[[Any, Any], Any] | None = None
    prepare: Callable[[Any], Any] = lambda request: request
    work: Callable[[Any, float], float] = lambda request, amount: amount
    memory: Callable[[Any, float], float] = lambda request, amount: amount
    largest: Callable[[Any], Any] | None = None
    table: bool = True

    def __call__(
        self, request: Any, run: Run, value: Callable[[Any], float], changed: Callable[[Any, Any], Any]
    ) -> Cost:
        """The cost, with the answer of the largest request, else that of a short one. value, changed: of the knob."""
        ready, at, answers = self.prepare(request), self.at or changed, list[Any]()
        amount = (self.amount or value)(ready)
        short = self.short(ready) if callable(self.short) else self.short

        def call(part: float) -> Any:
            answers[:1] = [(run.complete if self.table else run.compute)(at(ready, part))]
            return answers[0]

        first, second, taken = _short_calls(call, amount, short)

        def extrapolated(most: float, least: Callable[[], float], work: Callable[[Any, float], float]) -> float:
            """From the cost of the second call and, unless that is all, of the first."""
            if second == amount:
                return most
            if len(short) == 1:
                return most * work(ready, amount) / work(ready, second)
            rate = max(most - least(), 0.0) / max(work(ready, second) - work(ready, first), 1e-300)
            return most + rate * (work(ready, amount) - work(ready, second))

        seconds = extrapolated(taken, lambda: timed(partial(call, first))[1], self.work)
        if self.largest is not None:
            largest = self.largest(ready)
            answer, peak = traced(lambda: run.complete(largest))
            return Cost(seconds, peak, answer, amount)
        peak = extrapolated(traced(partial(call, second))[1], lambda: traced(partial(call, first))[1], self.memory)
        return Cost(seconds, peak, answers[0], amount)


def _short_calls(call: Callable[[float], Any], amount: float, short: tuple[float, ...]) -> tuple[float, float, float]:
    """Two small amounts, grown until the second call takes long enough (constant parts dominate shorter ones), and its time."""
    first, second = (min(part, amount) for part in (short[0], short[-1]))
    while (taken := timed(partial(call, second))[1]) < ENOUGH_SECONDS and second < amount and len(short) > 1:
        first, second = min(LARGER * first, amount), min(LARGER * second, amount)
    return first, second, taken


def complete_cost(request: Any, run: Run) -> Cost:
    """The cost of a complete run."""
    call = partial(run.complete, request)
    seconds = timed(call)[1]
    answer, peak = traced(call)
    return Cost(seconds, peak, answer)


def once(call: Callable[[], T]) -> tuple[T, float]:
    """The answer of a call and its processor time (s)."""
    start = time.process_time()
    answer = call()
    return answer, time.process_time() - start


def timed(call: Callable[[], T], long: float = 3.0) -> tuple[T, float]:
    """`once` of the second call, without imports and compilation; of the first if that takes longer than `long`."""
    first = once(call)
    return first if first[1] > long else once(call)


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
