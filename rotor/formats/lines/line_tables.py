"""A line list as a catalogue, and as files whose formats know lines: .cat, .hitran, .json.

Tables of any kind, lines among them, become .csv and .parquet in `tables`.
"""

from __future__ import annotations

import gzip
import os
import threading
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, copy_rows
from rotor.formats.atomic_write import atomic_path
from rotor.formats.provenance import provenance_record, write_beside
from rotor.formats.spcat.text.cat import Between, format_chunks, state_texts, write_cat
from rotor.formats.spcat.text.catalogue import Catalogue, predicted_catalogue
from rotor.formats.spcat.text.fields import BLANK
from rotor.spectra.lines import Lines

if TYPE_CHECKING:
    from rotor.formats.lines.hitran import HitranLines

MAX_QUANTA = 9  # the last digit of QNFMT counts them
_BEFORE_SPINS = ("n", "j", "k", "ka", "kc", "v")
_IN_A_CATALOGUE = (*_BEFORE_SPINS, "i_sym", "i_tot", *(f"f{i}" for i in range(1, 9)), "f")
PIECE = 1 << 14  # lines of a long list that are converted into text at once

Settings = Mapping[str, Any]
T = TypeVar("T")


def catalogue(lines: Lines, tag: int = 0) -> Catalogue:
    """The lines as a catalogue of the 80-column format.

    Lines of zero strength have no logarithm and are left out; ERR is 0 where no uncertainty is known.
    Raises ValueError for a tag that has no place in its six digits, and for quantum numbers that the format has not.
    """
    return _catalogue(*_with_logarithm(lines), tag, as_printed(lines.levels.quanta, lines.levels.halves))


def _with_logarithm(lines: Lines) -> tuple[Lines, Floats]:
    """The lines whose intensity has a logarithm, and it."""
    lgint = lines.lgint
    if not np.isfinite(lgint).all():
        lines, lgint = lines.where(np.isfinite(lgint)), lgint[np.isfinite(lgint)]
    return lines, lgint


def _catalogue(lines: Lines, lgint: Floats, tag: int, printed: tuple[NDArray[np.int16], int]) -> Catalogue:
    """The lines with these intensities as a catalogue. printed: quantum numbers of all levels, and QNFMT."""
    numbers = {
        "frequency_mhz": lines.frequency_mhz,
        "lgint": lgint,
        "energy_lower_cm": lines.energy_lower_cm,
        "g_upper": lines.g_upper,
    }
    if (error := lines.error_mhz) is not None:
        numbers["error_mhz"] = np.nan_to_num(error, nan=0.0)
    quanta, qnfmt = printed
    linear = lines.levels.kind == "linear"
    upper, lower = copy_rows(quanta, lines.upper), copy_rows(quanta, lines.lower)
    return predicted_catalogue(numbers, upper, lower, qnfmt, tag, linear=linear)


def as_printed(quanta: Mapping[str, NDArray[Any]], halves: Collection[str]) -> tuple[NDArray[np.int16], int]:
    """Quantum numbers of levels in the order of a catalogue, (n, 6) or wider, and QNFMT.

    quanta: columns (n,) by name. halves: names of those that hold twice the number; they are printed rounded up. QNFMT is
    100 Q + 10 H + NQN: NQN counts the numbers, Q is that of those before the spins, 10 more with a v, H has a bit for each of the
    last three that is half-integer (H. M. Pickett et al., J. Quant. Spectrosc. Radiat. Transf. 60, 883 (1998)).
    Raises ValueError for quantum numbers that a catalogue has no place for.
    """
    foreign = [name for name in quanta if name not in _IN_A_CATALOGUE]
    # J beside N is a sum of spins, N + S
    rotation = tuple(name for name in _BEFORE_SPINS if name != "j" or "n" not in quanta)
    order = (*rotation, "j", *_IN_A_CATALOGUE[len(_BEFORE_SPINS) :])
    names = sorted(quanta, key=order.index) if not foreign else []
    if foreign or len(names) > MAX_QUANTA:
        raise ValueError(
            f"quantum numbers {', '.join(quanta)}: a catalogue has no place for {', '.join(foreign) or 'more than 9'}; "
            "write .csv or .parquet"
        )
    columns = [(quanta[name] + 1) // 2 if name in halves else quanta[name] for name in names]
    out = np.full((len(columns[0]), max(6, len(names))), BLANK, dtype=np.int16)
    out[:, : len(names)] = np.stack(columns, axis=1)

    before = [name for name in names if name in rotation]
    odd = [name in halves and bool((quanta[name] % 2).any()) for name in names[len(before) :]][-3:]
    h = sum(bit << place for place, bit in enumerate(reversed(odd)))
    return out, 1000 * ("v" in names) + 100 * len(before) + 10 * h + len(names)


def write_catalogue(lines: Lines, path: str | os.PathLike[str], settings: Settings) -> None:
    """Write lines as a catalogue, their provenance beside it; `settings["tag"]` is the tag of the species."""
    tag = int(settings.get("tag", 0))
    if len(lines) <= PIECE:
        write_cat(catalogue(lines, tag), path)
    else:
        _write_in_pieces(lines, path, tag)
    write_beside(path, provenance_record(lines, settings))


def write_read_catalogue(lines: Catalogue, path: str | os.PathLike[str], settings: Settings) -> None:
    """Write a catalogue that was read, without provenance."""
    write_cat(lines, path)


def _write_in_pieces(lines: Lines, path: str | os.PathLike[str], tag: int) -> None:
    """Write the 80-column file of a long list: pieces are made in parallel on all cores and written in order."""
    _ = lines.partition, lines.spread  # made once, before the pieces ask for them
    printed = as_printed(lines.levels.quanta, lines.levels.halves)
    states = None
    if len(lines.levels) < len(lines):  # the texts of all levels, each as a line from itself to itself
        rows, zeros = np.arange(len(lines.levels), dtype=np.int32), np.zeros(len(lines.levels))
        each = replace(lines.where(slice(0)), frequency_mhz=zeros, strength_debye2=zeros, upper=rows, lower=rows)
        states = state_texts(_catalogue(each, zeros, tag, printed))

    def text(start: int) -> list[bytes]:
        piece, lgint = _with_logarithm(lines.where(slice(start, start + PIECE)))
        between = Between(states, piece.upper, piece.lower) if states else None
        return list(format_chunks(_catalogue(piece, lgint, tag, printed), between))

    opened = gzip.open if os.fspath(path).endswith(".gz") else open
    with atomic_path(path) as unfinished, opened(unfinished, "wb") as handle:
        handle.writelines(chain.from_iterable(_in_order(text, range(0, len(lines), PIECE))))


def _in_order(make: Callable[[int], T], starts: range) -> Iterator[T]:
    """make(start) for all starts, in order; each thread makes every n-th and keeps at most two, which bounds memory.

    `concurrent.futures` would take 3 ms to load, a tenth of the time that 100,000 lines take.
    """
    from queue import Queue

    count, stopped = min(os.cpu_count() or 1, len(starts)), threading.Event()
    answers: list[Queue[T | BaseException]] = [Queue(2) for _ in range(count)]

    def run(number: int) -> None:
        try:
            for start in starts[number::count]:
                answers[number].put(make(start))
                if stopped.is_set():
                    return
        except BaseException as error:  # raised again where the piece is waited for
            answers[number].put(error)

    for number in range(count):
        threading.Thread(target=run, args=(number,), daemon=True).start()
    try:
        for place in range(len(starts)):
            answer = answers[place % count].get()
            if isinstance(answer, BaseException):
                raise answer
            yield answer
    finally:
        stopped.set()
        for waiting in answers:
            while not waiting.empty():  # so that no thread goes on waiting to put its piece
                waiting.get()


def write_hitran_lines(lines: Lines, path: str | os.PathLike[str], settings: Settings) -> None:
    """Write lines as records of HITRAN, their provenance beside them.

    settings: "molecule" (needed), "isotopologue" and "abundance" are what `hitran_lines` asks for.
    """
    from rotor.formats.lines.hitran import hitran_lines, write_hitran

    if "molecule" not in settings:
        raise ValueError(
            f'{os.path.basename(path)}: HITRAN\'s records begin with its number of the molecule; give settings={{"molecule": 5}} (5 is CO)'
        )
    options = {key: settings[key] for key in ("molecule", "isotopologue", "abundance") if key in settings}
    write_hitran(hitran_lines(lines, **options), path)
    write_beside(path, provenance_record(lines, settings))


def write_records(lines: HitranLines, path: str | os.PathLike[str], settings: Settings) -> None:
    """Write records of HITRAN that were read, without provenance."""
    from rotor.formats.lines.hitran import write_hitran

    write_hitran(lines, path)


def write_lines_json(lines: Lines, path: str | os.PathLike[str], settings: Settings) -> None:
    """Write lines as JSON: `provenance` and `lines`, a record for each."""
    from rotor.formats.tables import write_json

    write_json(lines, path, settings, key="lines")
