"""Line lists larger than memory: pieces on disk, sorted by DuckDB, written as one .parquet, .csv or .cat file; interrupted runs can resume.

Each piece (`list_pieces`) is written atomically, so that a killed run leaves only complete ones; the next run with the same settings makes
the others.
"""

from __future__ import annotations

import json
import math
import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rotor.formats.atomic_write import atomic_path, open_atomic
from rotor.formats.lines.line_tables import as_printed
from rotor.formats.lines.list_pieces import BATCH, Plan, list_plan, make_piece, piece_ranges
from rotor.formats.lines.sorted_pieces import engine_in, listed, open_folder, row_count, sort_pieces
from rotor.formats.provenance import write_beside
from rotor.formats.spcat.text.cat import format_lines
from rotor.formats.spcat.text.catalogue import Catalogue, predicted_catalogue
from rotor.formats.tables import quoted, run
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.spectra.intensity import require_cut
from rotor.spectra.lines import DEFAULT_MIN_LGINT, line_list
from rotor.temporary import locked_file
from rotor.tops.top import Top
from rotor.version import version

PIECE_LINES = 300_000  # transitions of a piece before the intensity cut, unless a single J has more
MEMORY_MB = 500  # memory of the sort, besides the program


@dataclass(frozen=True)
class StreamedList:
    """Result of a streamed run: the file, its number of lines, and the numbers of new and of existing pieces."""

    path: Path
    lines: int
    pieces_computed: int
    pieces_reused: int
    jmax: int
    q: float


@dataclass(frozen=True)
class SortedLines:
    """A list that is sorted on disk in Parquet files of rising frequency, to be written in other formats."""

    files: tuple[Path, ...]
    count: int
    pieces_computed: int
    pieces_reused: int
    plan: Plan
    record: Mapping[str, Any]
    memory_mb: int

    def write(self, target: Path, tag: int = 0, progress: Callable[[int, int], object] | None = None) -> None:
        """Write the list as .parquet, .csv or .cat by the suffix of the name. progress: of the lines of a .cat."""
        suffix = target.suffix.lower()
        if suffix in (".parquet", ".csv"):
            text = quoted(json.dumps(self.record, ensure_ascii=False))
            form = "csv, HEADER" if suffix == ".csv" else f"parquet, KV_METADATA {{provenance: {text}}}"
            with atomic_path(target) as unfinished, engine_in(self.plan.folder, self.memory_mb) as engine:
                run(engine, f"COPY (SELECT * FROM {self._lines}) TO {quoted(str(unfinished))} (FORMAT {form})", target)
            if suffix == ".csv":
                write_beside(target, dict(self.record) | {"lines": self.count})
            return
        count = 0
        with open_atomic(target) as handle:
            for part in _catalogues(self.plan, self.files, tag, self.memory_mb):
                handle.write(format_lines(part))
                count += len(part)
                if progress is not None:
                    progress(count, self.count)
        write_beside(target, dict(self.record) | {"lines": count})

    @property
    def _lines(self) -> str:
        return f"read_parquet({listed(self.files)})"

    def strongest_cut(self, count: int) -> tuple[float | None, int]:
        """The lgint that `count` lines exceed, and their highest J; None if the list has no more lines."""
        n = "n" if self.plan.twice_spins else "j"
        with engine_in(self.plan.folder, self.memory_mb) as engine:
            rows = engine.execute(
                f"SELECT lgint, greatest({n}_upper, {n}_lower) FROM {self._lines} WHERE lgint IS NOT NULL "
                f"ORDER BY lgint DESC LIMIT {count}"
            ).fetchall()
        return (rows[-1][0] if len(rows) == count else None), max((j for _, j in rows), default=1)

    @property
    def span_mhz(self) -> tuple[float, float]:
        """The lowest and the highest frequency."""
        with engine_in(self.plan.folder, self.memory_mb) as engine:
            row = engine.execute(f"SELECT min(frequency_mhz), max(frequency_mhz) FROM {self._lines}").fetchone()
        assert row is not None  # an aggregate always has one row
        return row[0], row[1]

    def remove(self) -> None:
        """Remove the folder with the list."""
        shutil.rmtree(self.plan.folder, ignore_errors=True)


def stream_lines(
    top: Top,
    path: str | os.PathLike[str],
    *,
    jmax: int | None = None,
    temperature_k: float = 300.0,
    min_lgint: float | None = DEFAULT_MIN_LGINT,
    range_mhz: tuple[float, float] = (0.0, math.inf),
    q: float | None = None,
    vibrational_factor: float = 1.0,
    tag: int = 0,
    memory_mb: int = MEMORY_MB,
    piece_lines: int = PIECE_LINES,
    effects: Sequence[QuantumEffect] = SEMI_RIGID,
    executor: Executor | None = None,
) -> StreamedList:
    """Write the lines of `rotor.api.line_list`, rising in frequency, to a .parquet, .csv or .cat file with bounded memory.

    Pieces are stored in the folder `path` + ".pieces" and removed when the file is complete. After an interruption the same call resumes
    from them.

    Parameters
    ----------
    top : Top
        Top with a dipole in debye.
    path : path
        The suffix names the format.
    jmax : int, optional
        The highest J; by default the one beyond which no line can reach `min_lgint`.
    temperature_k : float, optional
        Temperature of the intensities.
    min_lgint : float or None, optional
        log10 of nm² MHz below which lines are left out.
    range_mhz : (float, float), optional
        First and last frequency.
    q : float, optional
        Partition function to use instead of the summed one.
    vibrational_factor : float, optional
        Multiplies Q.
    tag : int, optional
        Tag of a .cat file.
    memory_mb : int, optional
        Memory of the sort, besides the program.
    piece_lines : int, optional
        Transitions of a piece. A single J is never divided; with all three dipole components it has about 4.5 J².
    effects : sequence of QuantumEffect, optional
        Effects of the Hamiltonian.
    executor : Executor, optional
        Makes pieces in parallel. Processes of a pool must be spawned, since a forked copy of a program with threads may hang.

    Returns
    -------
    StreamedList
        The file, its number of lines, and the numbers of new and of existing pieces.

    Raises
    ------
    ValueError
        For another suffix, for a pool that forks, for input that `line_list` refuses, and if the folder has pieces of another list.
    """
    target = Path(path)
    if target.suffix.lower() not in (".parquet", ".csv", ".cat"):
        raise ValueError(f"{path}: a streamed list is written as .parquet, .csv or .cat; the suffix names the format")
    with locked_file(target):
        lines = sorted_lines(
            top,
            Path(f"{target}.pieces"),
            jmax=jmax,
            temperature_k=temperature_k,
            min_lgint=min_lgint,
            range_mhz=range_mhz,
            q=q,
            vibrational_factor=vibrational_factor,
            memory_mb=memory_mb,
            piece_lines=piece_lines,
            effects=effects,
            executor=executor,
        )
        lines.write(target, tag)
        lines.remove()
    return StreamedList(
        target, lines.count, lines.pieces_computed, lines.pieces_reused, lines.plan.jmax, lines.plan.partition.q
    )


def sorted_lines(
    top: Top,
    folder: Path,
    *,
    jmax: int | None,
    temperature_k: float,
    min_lgint: float | None,
    range_mhz: tuple[float, float],
    q: float | None,
    vibrational_factor: float,
    memory_mb: int = MEMORY_MB,
    piece_lines: int = PIECE_LINES,
    effects: Sequence[QuantumEffect] = SEMI_RIGID,
    executor: Executor | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> SortedLines:
    """The lines of `stream_lines`, sorted in a folder; existing pieces are reused."""
    if piece_lines < 1 or memory_mb < 100:
        raise ValueError(f"piece_lines = {piece_lines}, memory_mb = {memory_mb}: expected at least 1 line and 100 MB")
    require_cut(min_lgint)
    _refuse_forks(executor)
    start = line_list(
        top,
        temperature_k=temperature_k,
        jmax=0,
        min_lgint=None,
        q=q,
        vibrational_factor=vibrational_factor,
        effects=effects,
    )
    plan = list_plan(start, jmax, -math.inf if min_lgint is None else min_lgint, range_mhz, folder)
    ranges = list(piece_ranges(plan, piece_lines))
    record = _provenance(plan, ranges) | {"errors_from": start.errors_from}
    open_folder(plan.folder, record)

    merged = plan.folder / "sorted"
    missing = [] if merged.exists() else [r for r in ranges if not plan.piece(*r).exists()]
    jobs = ([plan] * len(missing), *zip(*missing, strict=True)) if missing else ([], [], [])
    before = len(ranges) - len(missing)
    advance = progress or (lambda done, total: None)
    for done, _ in enumerate((executor.map if executor else map)(make_piece, *jobs), before + 1):
        advance(done, len(ranges))
    pieces = sorted(plan.folder.glob("*.parquet"))
    if not merged.exists():
        sort_pieces(
            pieces, merged, plan.folder, memory_mb, lambda done, more: advance(len(ranges) + done, len(ranges) + more)
        )
    for piece in pieces:
        piece.unlink()
    files = tuple(sorted(merged.iterdir()))
    with engine_in(plan.folder, memory_mb) as engine:
        count = row_count(engine, files)
    return SortedLines(files, count, len(missing), before, plan, record, memory_mb)


def _refuse_forks(executor: Executor | None) -> None:
    context = getattr(executor, "_mp_context", None)  # of a ProcessPoolExecutor; it has no public name
    if context is not None and context.get_start_method() == "fork":
        raise ValueError(
            "the executor forks its processes, and a forked copy of a program with threads may never answer; give "
            'ProcessPoolExecutor(mp_context=multiprocessing.get_context("spawn"))'
        )


def _provenance(plan: Plan, ranges: list[tuple[int, int]]) -> dict[str, Any]:
    """The provenance of the list, by which pieces of another list are recognised too."""
    return (
        {"program": "rotor", "version": version()}
        | plan.top.provenance
        | {
            "temperature_k": plan.temperature_k,
            "jmax": plan.jmax,
            "min_lgint": plan.min_lgint if math.isfinite(plan.min_lgint) else None,
            "range_mhz": [bound if math.isfinite(bound) else None for bound in plan.range_mhz],
            "q": plan.partition.q,
            "q_source": plan.partition.source,
            "pieces": len(ranges),
            "pieces_end_at_j": [last for _, last in ranges],
        }
    )


def _catalogues(plan: Plan, files: Sequence[Path], tag: int, memory_mb: int) -> Iterator[Catalogue]:
    """The sorted lines as catalogues of some hundred thousand; lines of zero strength have no logarithm."""
    names = plan.quanta_names
    with engine_in(plan.folder, memory_mb) as engine:
        for file in files:
            for start in range(0, row_count(engine, [file]), BATCH):
                part = engine.execute(
                    f"SELECT * FROM read_parquet({quoted(str(file))}, file_row_number = true) WHERE lgint IS NOT NULL "
                    f"AND file_row_number >= {start} AND file_row_number < {start + BATCH}"
                ).fetchnumpy()
                (upper, qnfmt), (lower, _) = (
                    as_printed({name: part[f"{name}_{side}"] for name in names}, plan.halves)
                    for side in ("upper", "lower")
                )
                yield predicted_catalogue(part, upper, lower, qnfmt, tag, linear=plan.top.kind == "linear")
