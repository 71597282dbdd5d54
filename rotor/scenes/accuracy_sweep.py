"""Cost of accuracy in one scene: error and time of each value of every numerical knob, against a reference about 100 times finer.

    table = work_precision(read_scene("s.toml"))

Settings run from coarse to fine; the reference comes last. If the time limit ends a sweep before its reference, the finest answer
serves as reference, and the table says so. Times are processor times. Short settings are timed in rounds, each setting once a round, so
that other load on the machine slows all of them alike; the median counts. Neighbouring times that fall by less than their scatter are
replaced by their mean (`without_scatter`).
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.frozen import dataclass
from rotor.requests.knob import Knob, Setting, Sweep, in_words
from rotor.requests.plan import once
from rotor.scenes.run import scene_calculation
from rotor.scenes.scene import Scene
from rotor.table import Table

if TYPE_CHECKING:
    from rotor.plots.work_precision import Panel, Point

Progress = Callable[[str, str], object]
SHORT_SECONDS, ROUNDS = 1.0, 5  # shorter settings are timed in this many rounds
KNOWN_SECONDS = 0.1  # shorter times do not predict the time of the next setting
LEAST_SCATTER = 0.1  # relative, of a time: processor time depends on other users of memory and caches
LEAST_SECONDS = 5e-3  # of one timing; shorter calls are repeated
JUMP = 8.0  # a setting this many times slower than the coarser one may have compiled a kernel
COMPILING_SECONDS = 20.0  # a longer first call is not repeated
USUAL_LIMIT = 120.0  # seconds of processor time for all knobs together


@dataclass(frozen=True)
class Row:
    """One error of one setting. own: whether the scene has this setting. seconds: processor time of one calculation."""

    knob: str
    setting: str
    own: bool
    error_of: str
    error: float
    unit: str
    seconds: float


@dataclass(frozen=True, repr=False)
class WorkPrecision(Table):
    """Errors and times of all settings of all knobs.

    kind: of the scene. rows: coarse settings first. references: what errors are measured against, by knob. remarks: approximations
    without a knob, and sweeps left out, with the reason. knobs: by the key without a variant.
    """

    kind: str
    rows: tuple[Row, ...]
    references: Mapping[str, str]
    remarks: tuple[str, ...] = ()
    knobs: Mapping[str, Knob] = field(default_factory=dict)

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

    def facts(self) -> dict[str, Any]:
        """All settings as plain records."""
        return {**self.provenance, "settings": [asdict(row) for row in self.rows]}

    def curves(self) -> dict[tuple[str, str, str], list[Row]]:
        """The rows by knob, observable and unit."""
        by_knob: dict[tuple[str, str, str], list[Row]] = {}
        for row in self.rows:
            by_knob.setdefault((row.knob, row.error_of, row.unit), []).append(row)
        return by_knob


def panels_of(table: WorkPrecision) -> list[Panel]:
    """One panel of a picture for each knob and error, titled in words; orders of one splitting share a panel.

    >>> from rotor.scenes.scene import make_scene
    >>> [(panel.title, panel.of) for panel in panels_of(work_precision(make_scene("levels", molecule="CO")))]
    [('order of centrifugal distortion', 'energy of a level (MHz)')]
    """
    from rotor.plots.work_precision import Panel

    grouped: dict[tuple[str, str], dict[str, list[Point]]] = {}
    for (knob, error_of, unit), rows in table.curves().items():
        name, _, variant = knob.partition(", ")
        label = f"{error_of} ({unit})" if unit else error_of
        grouped.setdefault((name, label), {})[variant or name] = points_of(rows)
    return [
        Panel(table.knobs[name].title or in_words(name), label, curves, joined=table.knobs[name].series)
        for (name, label), curves in grouped.items()
    ]


def points_of(rows: list[Row]) -> list[Point]:
    """The settings of one knob as points of a picture."""
    from rotor.plots.work_precision import Point

    return [Point(row.setting, row.seconds, row.error, row.own) for row in rows]


def sweeps_of(scene: Scene, folder: str | os.PathLike[str] = ".") -> tuple[list[Sweep], tuple[str, ...]]:
    """Sweeps of all numerical knobs of a scene in a folder, and remarks on approximations without one, each with the reason.

    A requested accuracy first chooses the settings around which the knobs are swept.

    Raises ValueError for a scene with a sweep, and for any scene that a run refuses.
    """
    if scene.sweep:
        raise ValueError("sweep: the knobs of one point are swept; give the scene without its sweep")
    calculation = scene_calculation(scene, folder)
    verb, choice = calculation.verb, calculation.choice
    request = calculation.request if choice is None else choice.request
    numerics = verb.load_numerics()
    knobs = [(knob, knob.reason(request)) for knob in numerics.all_knobs(request)]
    prepared = numerics.prepare(request)
    sweeps = [
        knob.sweep(prepared if knob.field is None else request, verb.compute) for knob, why in knobs if why is None
    ]
    return sweeps, tuple(f"{knob.key}: {why}" for knob, why in knobs if why)


def work_precision(
    scene: Scene,
    *,
    folder: str | os.PathLike[str] = ".",
    limit_seconds: float = USUAL_LIMIT,
    progress: Progress = lambda knob, setting: None,
    on_knob: Callable[[WorkPrecision], object] = lambda table: None,
) -> WorkPrecision:
    """Sweep every knob of a scene.

    scene: without a sweep. folder: folder of the files that the scene reads. limit_seconds: processor time for all knobs together; each
    knob gets an equal share of the remainder. progress: called with the knob and the setting before each calculation. on_knob: called
    with the table so far after each knob.
    Returns: without rows if nothing can be swept; the remarks say why.
    Raises ValueError as a run of the scene.

    >>> from rotor.scenes.scene import make_scene
    >>> table = work_precision(make_scene("levels", molecule="CO"))
    >>> [row.setting for row in table.rows], table.rows[0].error > table.rows[-1].error == 0.0
    (['order J^2', 'order J^4', 'order J^6', 'order J^8'], True)
    """
    (sweeps, remarks), left = sweeps_of(scene, folder), limit_seconds
    table = WorkPrecision(scene.kind, (), {}, remarks, {each.name.partition(",")[0]: each.knob for each in sweeps})
    for number, swept in enumerate(sweeps):
        rows, against, more, spent = sweep(swept, left / (len(sweeps) - number), progress)
        left = max(left - spent, 0.0)
        references = {**table.references, f"{swept.name}: {swept.knob.measures[0].of}": against}
        table = replace(table, rows=(*table.rows, *rows), references=references, remarks=(*table.remarks, *more))
        on_knob(table)
    return table


def sweep(
    swept: Sweep, limit_seconds: float, progress: Progress = lambda knob, setting: None
) -> tuple[list[Row], str, list[str], float]:
    """Rows of one knob, the reference in words, remarks on omitted settings, and the seconds spent.

    A setting is omitted if it would exceed the limit, judged by how the time grew from setting to setting.
    """
    settings = [*swept.settings, *([] if swept.reference is None else [Setting("the reference", swept.reference)])]
    done: list[tuple[Setting, Any, float]] = []
    remarks: list[str] = []
    refused: list[str] = []
    spent = 0.0
    for setting in settings:
        if spent + _next_seconds([seconds for _, _, seconds in done]) > limit_seconds:
            remarks.append(f"{swept.name}: {setting.label} and finer ones are beyond the time limit")
            break
        progress(swept.name, setting.label)
        try:
            usual = done[-1][2] if done else None
            answer, seconds, both = timed(partial(swept.answer, setting.request), usual)
        except ValueError as error:
            refused.append(setting.label)
            why = str(error)
            continue
        spent += both
        done.append((setting, answer, seconds))
    if refused:
        remarks.append(f"{swept.name}: {', '.join(refused)}: refused, the last of them with: {why}")
    if not done:
        return [], swept.against, remarks, spent
    last, reference, _ = done[-1]
    reached = swept.reference is None or last.label == "the reference"
    against = swept.against if reached else f"the finest within the time limit, {last.label}"
    shown = done if swept.reference is None else done[:-1]
    calls = [partial(swept.answer, setting.request) for setting, _, _ in shown]
    times, more = in_rounds(calls, [seconds for _, _, seconds in shown], limit_seconds - spent)
    spent += more
    rows = [
        Row(
            swept.name,
            setting.label,
            setting.in_scene,
            m.of,
            m.error(answer, reference),
            m.unit,
            taken / swept.knob.repeats,
        )
        for m in swept.knob.measures
        for (setting, answer, _), taken in zip(shown, times, strict=True)
    ]
    return rows, against, remarks, spent


def _next_seconds(taken: list[float]) -> float:
    """Expected time of the next setting: the last time, scaled by its ratio to the one before; 0 without data."""
    if not taken:
        return 0.0
    if len(taken) == 1 or taken[-2] < KNOWN_SECONDS:
        return taken[-1]
    return taken[-1] * max(taken[-1] / taken[-2], 1.0)


def timed(call: Callable[[], Any], usual: float | None = 0.0) -> tuple[Any, float, float]:
    """The answer of a call, its processor time in seconds, and that of all calls made.

    usual: seconds of the coarser setting; None for the first setting; 0 if a single call is enough. The first call, and one that takes
    JUMP times as long as the coarser setting, may load modules or compile; it is then repeated, and only the second time counts.
    """
    answer, first = once(call)
    compiles = usual is None or (usual > 0 and first > max(JUMP * usual, KNOWN_SECONDS))
    if not compiles or first >= COMPILING_SECONDS:
        return answer, first, first
    answer, again = once(call)
    return answer, again, first + again


def in_rounds(
    calls: Sequence[Callable[[], Any]], first: Sequence[float], limit_seconds: float = math.inf
) -> tuple[list[float], float]:
    """Times of calls in seconds (medians of rounds for short calls), and the total time of the rounds.

    first: the time of one call each. Rounds end before they would exceed the limit.
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
            taken[n].append(once(partial(_repeat, calls[n], count))[1] / count)
    samples = [taken.get(n) or [seconds] for n, seconds in enumerate(first)]
    spent = math.fsum(counts[n] * math.fsum(times) for n, times in taken.items())
    return without_scatter(samples), spent


def _repeat(call: Callable[[], Any], count: int) -> None:
    for _ in range(count):
        call()


def without_scatter(samples: Sequence[Sequence[float]]) -> list[float]:
    """Median times of settings, coarse ones first; times that fall by less than their scatter are replaced by their mean.

    A finer setting that seems faster by less than the interquartile range of either, or by less than a tenth, is not known to be faster.
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
