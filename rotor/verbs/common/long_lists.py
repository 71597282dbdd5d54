"""Line lists too long for memory: sorted and written on disk; the strongest lines are shown."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.checks import leaving
from rotor.frozen import dataclass
from rotor.reports.progress import progress_bar
from rotor.spectra.intensity import highest_j
from rotor.spectra.request import SpectrumAnswer, SpectrumRequest, answer_spectrum
from rotor.spectra.transitions.pairs import TooManyLinesError, spin_functions, transition_count
from rotor.thermodynamics.sums.partition import PartitionFunction

if TYPE_CHECKING:
    from rotor.formats.lines.streamed_lines import SortedLines

# longest lists made in memory by what is written, in less than 1 GB: 0.08, 0.23 and 0.20 kB a line; longer ones are made on disk
LINES_IN_MEMORY = {"cat": 10_000_000, "csv": 4_000_000, "parquet": 4_000_000}
BEFORE_CUT = 10  # times as many transitions before a cut are still tried in memory
STRONGEST = 1_000  # lines held in memory
STREAMED = frozenset(LINES_IN_MEMORY)  # outputs written from disk
SMALL = frozenset({"json", "save_scene"})  # further allowed outputs: a scene has no lines, JSON only few
JSON_LINES = 200_000  # limit of JSON, whose text takes about 0.6 kB of memory for each line


@dataclass(frozen=True, repr=False)
class LongAnswer(SpectrumAnswer):
    """A list on disk. lines: the strongest. whole: all lines. span_mhz: first and last frequency. files: not yet written.

    progress: whether a terminal shows it.
    """

    whole: SortedLines
    span_mhz: tuple[float, float]
    files: list[Path]
    progress: bool = False

    def write(self, path: Path, tag: int) -> None:
        """Write all lines; the pieces on disk are removed after the last file."""
        with _bar(f"lines in {path.name}", self.progress) as advance:
            self.whole.write(path, tag, advance)
        self.files.pop()
        if not self.files:
            self.whole.remove()

    def facts(self) -> dict[str, Any]:
        """The facts of a spectrum, counted over all lines."""
        plan = self.whole.plan
        return super().facts() | {
            "jmax": plan.jmax,
            "line_count": self.whole.count,
            "min_lgint": self.request.min_lgint,
        }


def is_long(request: SpectrumRequest, files: Mapping[str, Any], resolution: float | None) -> bool:
    """Whether a list is made on disk: it may exceed memory, and no output needs it there."""
    top = request.top
    in_memory = (
        request.shape != "sticks"
        or request.layer is not None
        or resolution is not None
        or request.untrusted
        or request.covariance is not None
        or request.vibrations is not None
        or not files.keys() & STREAMED
        or files.keys() - STREAMED - SMALL
        or (top.internal_rotation is not None and spin_functions(top, request.effects) > 1)  # they have no ranges of F
        or any(path.suffix == ".gz" for path in _streamed(files))
        or top.dipole_abc_debye is None
    )
    return not in_memory and _count(request) > _most_lines(files)


def _most_lines(files: Mapping[str, Any]) -> int:
    """The longest list in memory for some outputs."""
    return min(most for name, most in LINES_IN_MEMORY.items() if name in files)


def _count(request: SpectrumRequest) -> float:
    """Approximate number of transitions before the cut."""
    return transition_count(request.top, _highest_j(request), request.effects)


def _streamed(files: Mapping[str, tuple[Path, ...]]) -> list[Path]:
    return [path for name, paths in files.items() if name in STREAMED for path in paths]


def refuse_long_output(request: SpectrumRequest, files: Mapping[str, Any], resolution: float | None) -> None:
    """Refuse JSON of a list on disk without range and cut, and its table on standard output, before any work."""
    if _on_screen(files) and is_long(request, files, resolution) and not _is_short_above_cut(request, files):
        raise ValueError(_no_screen(files))
    if "json" in files and request.min_lgint is None and is_long(request, files, resolution):
        first, last = request.range_mhz
        if first <= 0 and last == float("inf"):
            raise ValueError(_no_json(f"some {_count(request):.0e}"))


def _on_screen(files: Mapping[str, Any]) -> bool:
    return "csv" in files and not files["csv"]


def _no_screen(files: Mapping[str, Any]) -> str:
    return (
        f"--csv -: more than {_most_lines(files)} lines are sorted on disk, beside a file: name it (--csv lines.csv), or give --range or "
        "a higher --min-lgint"
    )


def _is_short_above_cut(request: SpectrumRequest, files: Mapping[str, Any]) -> bool:
    """Whether the lines above the cut may be few enough for memory."""
    return request.min_lgint is not None and _count(request) <= BEFORE_CUT * _most_lines(files)


def _no_json(count: str) -> str:
    return (
        f"--json: {count} lines exceed the {JSON_LINES} that JSON can hold in memory; leave --json out "
        "(--parquet has every column of every line), or give --range or a higher --min-lgint"
    )


def _highest_j(request: SpectrumRequest) -> int:
    """The requested highest J, or an estimate from the usual cut (with Q = 1e4 if Q is not known)."""
    dipole, least = request.top.dipole_abc_debye, -math.inf if request.min_lgint is None else request.min_lgint
    if dipole is None:
        return request.jmax or 0
    try:
        partition = PartitionFunction.stated(request.temperature_k, request.q or 1e4)
        return highest_j(request.top, dipole, partition, least, request.jmax, request.effects)
    except ValueError:  # the line list raises it with the reason
        return 0


def answer_long(
    request: SpectrumRequest, files: Mapping[str, tuple[Path, ...]], strongest: int, progress: bool
) -> SpectrumAnswer:
    """The lines of a request, sorted in a folder beside its first file; an interrupted run resumes from there.

    Where few lines are above a cut, they are made in memory after all: three times as fast.
    """
    most = _most_lines(files)
    if _is_short_above_cut(request, files):
        with suppress(TooManyLinesError):
            return answer_spectrum(request, most_lines=min(most, JSON_LINES) if "json" in files else most)
    if _on_screen(files):
        raise ValueError(_no_screen(files))
    paths = _streamed(files)
    folder = Path(f"{paths[0]}.pieces")
    with _bar("pieces", progress) as advance, leaving((folder, "has the finished pieces; the same command continues")):
        whole = _sorted(request, folder, advance)
    if "json" in files and whole.count > JSON_LINES:
        raise ValueError(
            f"{_no_json(str(whole.count))}; the sorted lines are in {whole.plan.folder}; the same command without --json writes them"
        )
    complete = None, whole.plan.jmax
    cut, jmax = complete if "json" in files else whole.strongest_cut(max(strongest, STRONGEST))
    least = request.min_lgint if cut is None else cut
    lines = answer_spectrum(replace(request, jmax=jmax, min_lgint=least)).lines
    return LongAnswer(request, lines, whole, whole.span_mhz, paths, progress)


def _bar(what: str, shown: bool) -> AbstractContextManager[Callable[[int, int], object] | None]:
    """A bar on a terminal, else nothing."""
    return progress_bar(what) if shown else nullcontext()


def _sorted(request: SpectrumRequest, folder: Path, progress: Callable[[int, int], object] | None) -> SortedLines:
    from rotor.formats.lines.streamed_lines import sorted_lines

    return sorted_lines(
        request.top,
        folder,
        jmax=request.jmax,
        temperature_k=request.temperature_k,
        min_lgint=request.min_lgint,
        range_mhz=request.range_mhz,
        q=request.q,
        vibrational_factor=request.vibrational_factor,
        effects=request.effects,
        progress=progress,
    )
