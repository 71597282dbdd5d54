"""A line list as a catalogue, and as files whose formats know lines: .cat, .hitran, .json.

Tables of any kind, lines among them, become .csv and .parquet in `tables`.
"""

from __future__ import annotations

import gzip
import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.formats.atomic_write import atomic_path
from rotor.formats.provenance import record_of, write_beside
from rotor.formats.spcat.cat import format_lines, write_cat
from rotor.formats.spcat.catalogue import Catalogue
from rotor.formats.spcat.fields import BLANK
from rotor.spectra.lines import Lines

if TYPE_CHECKING:
    from rotor.formats.hitran import HitranLines

QNFMT = {("j",): 101, ("j", "k"): 202, ("j", "ka", "kc"): 303}
MAX_TAG = 999_999
PIECE = 1 << 15  # lines of a long list that are made into text at once

Settings = Mapping[str, Any]


def catalogue(lines: Lines, tag: int = 0) -> Catalogue:
    """The lines as a catalogue of the 80-column format.

    Lines of zero strength have no logarithm and are left out; ERR is 0 where no uncertainty of a constant is known.
    Raises ValueError for a tag that has no place in its six digits.
    """
    lgint = lines.lgint
    if not np.isfinite(lgint).all():
        lines, lgint = lines.where(np.isfinite(lgint)), lgint[np.isfinite(lgint)]
    numbers = {
        "frequency_mhz": lines.frequency_mhz,
        "lgint": lgint,
        "energy_lower_cm": lines.energy_lower_cm,
        "g_upper": lines.g_upper,
    }
    if (error := lines.error_mhz) is not None:
        numbers["error_mhz"] = error
    levels = lines.levels
    quanta = quanta_columns(levels.quanta_of(np.arange(len(levels))))
    return catalogue_of(numbers, lines.quanta_names, quanta[lines.upper], quanta[lines.lower], tag)


def quanta_columns(quanta: NDArray[Any]) -> NDArray[np.int16]:
    """Quantum numbers (n, names) as the six columns of a catalogue, blank where there are none, (n, 6)."""
    out = np.full((len(quanta), 6), BLANK, dtype=np.int16)
    out[:, : quanta.shape[1]] = quanta
    return out


def catalogue_of(
    numbers: Mapping[str, NDArray[Any]],
    names: tuple[str, ...],
    quanta_upper: NDArray[np.int16],
    quanta_lower: NDArray[np.int16],
    tag: int = 0,
) -> Catalogue:
    """The catalogue of lines given as columns.

    Parameters
    ----------
    numbers : frequency_mhz, lgint, energy_lower_cm, g_upper, each (n,), and error_mhz where one is known
    names : of the quantum numbers, which decide QNFMT and DR
    quanta_upper, quanta_lower : (n, 6), as `quanta_columns` makes them
    tag : of the species

    Raises
    ------
    ValueError
        For a tag that has no place in its six digits.
    """
    if not 0 <= tag <= MAX_TAG:
        raise ValueError(f"tag {tag}: a catalogue's tag has at most six digits")
    n = len(quanta_upper)
    return Catalogue(
        frequency_mhz=numbers["frequency_mhz"],
        error_mhz=numbers["error_mhz"] if "error_mhz" in numbers else np.zeros(n),
        lgint=numbers["lgint"],
        dr=np.full(n, 2 if names == ("j",) else 3, dtype=np.int16),
        energy_lower_cm=numbers["energy_lower_cm"],
        g_upper=np.asarray(numbers["g_upper"]).astype(np.int32),
        tag=np.full(n, tag, dtype=np.int32),
        qnfmt=np.full(n, QNFMT[names], dtype=np.int32),
        quanta_upper=quanta_upper,
        quanta_lower=quanta_lower,
    )


def write_catalogue(lines: Lines, path: str | os.PathLike[str], settings: Settings) -> None:
    """Write lines as a catalogue, their provenance beside it; `settings["tag"]` is the tag of the species."""
    tag = int(settings.get("tag", 0))
    if len(lines) <= PIECE:
        write_cat(catalogue(lines, tag), path)
    else:
        _write_in_pieces(lines, path, tag)
    write_beside(path, record_of(lines, settings))


def write_read_catalogue(lines: Catalogue, path: str | os.PathLike[str], settings: Settings) -> None:
    """Write a catalogue as it is; nothing is known of where it is from."""
    write_cat(lines, path)


def _write_in_pieces(lines: Lines, path: str | os.PathLike[str], tag: int) -> None:
    """The 80-column file of a long list: pieces made side by side on all cores and written in order."""
    _ = lines.partition, lines.spread  # made once, before the pieces ask for them

    def text(start: int) -> bytes:
        return format_lines(catalogue(lines.where(slice(start, start + PIECE)), tag))

    opened = gzip.open if os.fspath(path).endswith(".gz") else open
    with (
        atomic_path(path) as unfinished,
        opened(unfinished, "wb") as handle,
        ThreadPoolExecutor(os.cpu_count()) as pool,
    ):
        handle.writelines(_in_order(pool, text, range(0, len(lines), PIECE)))


def _in_order(pool: ThreadPoolExecutor, make: Callable[[int], bytes], starts: Iterable[int]) -> Iterator[bytes]:
    """make(start) of every start, in order; only so many are under way that memory stays bounded."""
    under_way: deque[Future[bytes]] = deque()
    for start in starts:
        under_way.append(pool.submit(make, start))
        if len(under_way) > 2 * (os.cpu_count() or 1):
            yield under_way.popleft().result()
    while under_way:
        yield under_way.popleft().result()


def write_hitran_lines(lines: Lines, path: str | os.PathLike[str], settings: Settings) -> None:
    """Write lines as records of HITRAN, their provenance beside them.

    settings: "molecule" (needed), "isotopologue" and "abundance" are what `hitran_lines` asks for.
    """
    from rotor.formats.hitran import hitran_lines, write_hitran

    if "molecule" not in settings:
        raise ValueError(
            f'{path}: HITRAN\'s records begin with its number of the molecule; give settings={{"molecule": 5}} (5 is CO)'
        )
    known = {key: settings[key] for key in ("molecule", "isotopologue", "abundance") if key in settings}
    write_hitran(hitran_lines(lines, **known), path)
    write_beside(path, record_of(lines, settings))


def write_records(lines: HitranLines, path: str | os.PathLike[str], settings: Settings) -> None:
    """Write records of HITRAN as they are; nothing is known of where they are from."""
    from rotor.formats.hitran import write_hitran

    write_hitran(lines, path)


def write_lines_json(lines: Lines, path: str | os.PathLike[str], settings: Settings) -> None:
    """Write lines as JSON: `provenance` and `lines`, a record for each."""
    from rotor.formats.tables import write_json

    write_json(lines, path, settings, key="lines")
