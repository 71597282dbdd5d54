"""What accuracy costs in one scene: every numerical knob swept, error against a reference about a hundred times finer, and time.

    table = work_precision(read_scene("s.toml"))

Coarse settings come first and the reference last. Where the time limit ends a sweep before its reference, the finest answer that
there is serves as one, and the table says so. Times are those of the processor. Settings that are short are timed in rounds, each
setting once a round, so that other work on the machine slows all of them alike; the median of the rounds counts. Times of neighbours
that differ by less than their scatter have one value, the mean (`without_scatter`).
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.requests.knob import Setting, Sweep, Sweeps
from rotor.scenes.kind import kind_of
from rotor.scenes.numerics import sweeps_of
from rotor.scenes.scene import Scene
from rotor.table import Table

Progress = Callable[[str, str], object]
SHORT_SECONDS, ROUNDS = 1.0, 5  # settings that are shorter are timed in so many rounds
KNOWN_SECONDS = 0.1  # below which one call does not say how much longer the next one takes
LEAST_SCATTER = 0.1  # of a time: processor time depends on what else uses memory and caches
LEAST_SECONDS = 5e-3  # of one timing: shorter calls are repeated in it
JUMP = 8.0  # a setting that takes so many times as long as the coarser one may have compiled a kernel
COMPILING_SECONDS = 20.0  # a first call that took longer is not repeated
USUAL_LIMIT = 120.0  # seconds of processor time for all knobs together


@dataclass(frozen=True)
class Row:
    """One error of one setting. own: whether the scene has it. seconds: of the processor, of one calculation."""

    knob: str
    setting: str
    own: bool
    error_of: str
    error: float
    unit: str
    seconds: float


@dataclass(frozen=True, repr=False)
class WorkPrecision(Table):
    """Errors and times of every setting of every knob.

    kind: of the scene. rows: coarse settings first. references: by knob, what errors are measured against. remarks: what has no
    knob, what was not swept and why.
    """

    kind: str
    rows: tuple[Row, ...]
    references: Mapping[str, str]
    remarks: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.rows)

    @cached_property
    def columns(self) -> dict[str, NDArray[Any]]:
        """knob, setting, own, error_of, error, unit, seconds."""
        names = Row.__dataclass_fields__
        return {name: np.array([getattr(row, name) for row in self.rows]) for name in names}

    @property
    def provenance(self) -> dict[str, Any]:
        """Kind of scene, references and remarks."""
        return {
            "kind": self.kind,
            "references": dict(self.references),
            "remarks": list(self.remarks),
            "rows": len(self),
        }

    def curves(self) -> dict[tuple[str, str, str], list[Row]]:
        """The rows by knob, what the error is of, and unit."""
        by_knob: dict[tuple[str, str, str], list[Row]] = {}
        for row in self.rows:
            by_knob.setdefault((row.knob, row.error_of, row.unit), []).append(row)
        return by_knob


def knobs_of(scene: Scene, folder: str | os.PathLike[str] = ".") -> Sweeps:
    """All numerical knobs of a scene in a folder; where it asks for an accuracy, about the settings that are chosen for it.

    Raises ValueError for a scene with a sweep, and whatever the scene itself would be refused for.
    """
    if scene.sweep:
        raise ValueError("sweep: the knobs of one point are swept; give the scene without its sweep")
    request = kind_of(scene).request(scene, folder)
    if getattr(scene, "accuracy", None) is not None:
        from rotor.scenes.accuracy import chosen

        request = chosen(scene, request).request
    return sweeps_of(scene.kind, request)


def work_precision(
    scene: Scene,
    *,
    folder: str | os.PathLike[str] = ".",
    limit_seconds: float = USUAL_LIMIT,
    progress: Progress = lambda knob, setting: None,
    on_knob: Callable[[WorkPrecision], object] = lambda table: None,
) -> WorkPrecision:
    """Sweep every knob of a scene.

    Parameters
    ----------
    scene : Scene
        Without a sweep.
    folder : path
        From which the files that the scene reads are counted.
    limit_seconds : float
        Of processor time for all knobs together; each has an equal share of what is left.
    progress : callable
        Called with the knob and the setting before each calculation.
    on_knob : callable
        Called with the table so far after each knob.

    Returns
    -------
    WorkPrecision
        Without rows where nothing can be swept; the remarks say why.

    Raises
    ------
    ValueError
        Whatever the scene itself would be refused for.

    Examples
    --------
    >>> from rotor.scenes.scene import LevelsScene
    >>> table = work_precision(LevelsScene(molecule="CO"))
    >>> [row.setting for row in table.rows], table.rows[0].error > table.rows[-1].error == 0.0
    (['order J^2', 'order J^4', 'order J^6', 'order J^8'], True)
    """
    knobs, left = knobs_of(scene, folder), limit_seconds
    table = WorkPrecision(scene.kind, (), {}, knobs.remarks)
    for number, knob in enumerate(knobs.knobs):
        rows, against, remarks, spent = sweep(knob, left / (len(knobs.knobs) - number), progress)
        left = max(left - spent, 0.0)
        references = {**table.references, f"{knob.name}: {knob.measures[0].of}": against}
        table = WorkPrecision(scene.kind, (*table.rows, *rows), references, (*table.remarks, *remarks))
        on_knob(table)
    return table


def sweep(
    knob: Sweep, limit_seconds: float, progress: Progress = lambda knob, setting: None
) -> tuple[list[Row], str, list[str], float]:
    """The rows of one knob, what their errors are measured against, remarks on what was left out, and the seconds that were timed.

    A setting that would go beyond the limit, judged by how much longer each setting took than the one before, is left out.
    """
    settings = [*knob.settings, *([] if knob.reference is None else [Setting("the reference", knob.reference)])]
    done: list[tuple[Setting, Any, float]] = []
    remarks: list[str] = []
    refused: list[str] = []
    spent = 0.0
    for setting in settings:
        if spent + _next_seconds([seconds for _, _, seconds in done]) > limit_seconds:
            remarks.append(f"{knob.name}: {setting.label} and finer ones are beyond the time limit")
            break
        progress(knob.name, setting.label)
        try:
            usual = done[-1][2] if done else None
            answer, seconds, both = timed(lambda request=setting.request: knob.answer(request), usual)  # type: ignore[misc]
        except ValueError as error:
            refused.append(setting.label)
            why = str(error)
            continue
        spent += both
        done.append((setting, answer, seconds))
    if refused:
        remarks.append(f"{knob.name}: {', '.join(refused)}: refused, the last of them with: {why}")
    if not done:
        return [], knob.against, remarks, spent
    last, reference, _ = done[-1]
    reached = knob.reference is None or last.label == "the reference"
    against = knob.against if reached else f"the finest within the time limit, {last.label}"
    shown = done if knob.reference is None else done[:-1]
    calls = [lambda request=setting.request: knob.answer(request) for setting, _, _ in shown]
    times, more = in_rounds(calls, [seconds for _, _, seconds in shown], limit_seconds - spent)
    spent += more
    rows = [
        Row(
            knob.name, setting.label, setting.in_scene, m.of, m.error(answer, reference), m.unit, seconds / knob.repeats
        )
        for m in knob.measures
        for (setting, answer, _), seconds in zip(shown, times, strict=True)
    ]
    return rows, against, remarks, spent


def _next_seconds(taken: list[float]) -> float:
    """How long the next setting may take: as much longer than the last one as that was than the one before; nothing is known at first."""
    if not taken:
        return 0.0
    if len(taken) == 1 or taken[-2] < KNOWN_SECONDS:
        return taken[-1]
    return taken[-1] * max(taken[-1] / taken[-2], 1.0)


def timed(call: Callable[[], Any], usual: float | None = 0.0) -> tuple[Any, float, float]:
    """The answer of a call, its processor time in seconds, and that of all calls that were made.

    usual: seconds of the coarser setting, None for the first one, 0 where a single call is enough. A call may load modules or compile
    if it is the first one or takes JUMP times as long as the coarser setting; it is made once more then, and its first time does not count.
    """
    answer, first = _once(call)
    compiles = usual is None or (usual > 0 and first > max(JUMP * usual, KNOWN_SECONDS))
    if not compiles or first >= COMPILING_SECONDS:
        return answer, first, first
    answer, again = _once(call)
    return answer, again, first + again


def in_rounds(
    calls: Sequence[Callable[[], Any]], first: Sequence[float], limit_seconds: float = math.inf
) -> tuple[list[float], float]:
    """Times of calls in seconds, medians of rounds where they are short, and the seconds that the rounds took.

    first: the time of each by one call. Rounds end where another one would go beyond the limit.
    """
    counts = {
        n: max(1, math.ceil(LEAST_SECONDS / max(seconds, 1e-9)))
        for n, seconds in enumerate(first)
        if seconds < SHORT_SECONDS
    }
    a_round = sum(first[n] * count for n, count in counts.items())
    rounds = ROUNDS if a_round * ROUNDS <= limit_seconds else int(limit_seconds / a_round)
    taken: dict[int, list[float]] = {n: [] for n in counts}
    for _ in range(rounds):
        for n, count in counts.items():
            taken[n].append(_once(partial(_repeat, calls[n], count))[1] / count)
    samples = [taken.get(n) or [seconds] for n, seconds in enumerate(first)]
    spent = math.fsum(counts[n] * math.fsum(times) for n, times in taken.items())
    return without_scatter(samples), spent


def _repeat(call: Callable[[], Any], count: int) -> None:
    for _ in range(count):
        call()


def without_scatter(samples: Sequence[Sequence[float]]) -> list[float]:
    """Medians of the times of settings, coarse ones first; those that fall by less than their scatter have a common mean.

    A finer setting that seems to be faster by less than the interquartile range of either, or than a tenth, is not known to be faster.

    >>> without_scatter([[1.0, 1.1, 1.3], [0.9, 1.0, 1.2], [2.0, 2.1, 2.2]])
    [1.05, 1.05, 2.1]
    >>> without_scatter([[5.0, 5.1, 5.2], [1.0, 1.1, 1.2]])
    [5.1, 1.1]
    """
    groups: list[tuple[float, float, int]] = []  # mean, scatter and number of settings
    for times in samples:
        low, middle, high = (float(value) for value in np.quantile(times, [0.25, 0.5, 0.75]))
        groups.append((middle, max(high - low, LEAST_SCATTER * middle), 1))
        while len(groups) > 1 and 0.0 < groups[-2][0] - groups[-1][0] < max(groups[-2][1], groups[-1][1]):
            (mean, scatter, count), (other, other_scatter, others) = groups.pop(), groups.pop()
            joined = (mean * count + other * others) / (count + others)
            groups.append((joined, max(scatter, other_scatter), count + others))
    return [mean for mean, _, count in groups for _ in range(count)]


def _once(call: Callable[[], Any]) -> tuple[Any, float]:
    start = time.process_time()
    answer = call()
    return answer, time.process_time() - start
