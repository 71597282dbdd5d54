"""A line list as a file: .cat, .csv, .parquet, .json, .hitran, each with its provenance inside or in a file beside it."""

from __future__ import annotations

import gzip
import json
import math
import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from rotor.formats.atomic_write import atomic_path, open_atomic
from rotor.formats.spcat.cat import format_lines, write_cat
from rotor.formats.spcat.catalogue import Catalogue
from rotor.formats.spcat.fields import BLANK
from rotor.spectra.lines import Lines
from rotor.tops.top import Top
from rotor.version import version

QNFMT = {("j",): 101, ("j", "k"): 202, ("j", "ka", "kc"): 303}
MAX_TAG = 999_999
PIECE = 1 << 15  # lines of a long list that are made into text at once


def catalogue(lines: Lines, tag: int = 0) -> Catalogue:
    """The lines as a catalogue of the 80-column format.

    Lines of zero strength have no logarithm and are left out; ERR is 0 where no uncertainty of a constant is known.
    Raises ValueError for a tag that has no place in its six digits.
    """
    if not 0 <= tag <= MAX_TAG:
        raise ValueError(f"tag {tag}: a catalogue's tag has at most six digits")
    lgint = lines.lgint
    if not np.isfinite(lgint).all():
        lines, lgint = lines.where(np.isfinite(lgint)), lgint[np.isfinite(lgint)]

    n, levels = len(lines), lines.levels
    quanta = np.full((len(levels), 6), BLANK, dtype=np.int16)
    quanta[:, : len(levels.quanta)] = levels.quanta_of(np.arange(len(levels)))
    return Catalogue(
        frequency_mhz=lines.frequency_mhz,
        error_mhz=np.zeros(n) if (error := lines.error_mhz) is None else error,
        lgint=lgint,
        dr=np.full(n, 2 if levels.kind == "linear" else 3, dtype=np.int16),
        energy_lower_cm=lines.energy_lower_cm,
        g_upper=lines.g_upper.astype(np.int32),
        tag=np.full(n, tag, dtype=np.int32),
        qnfmt=np.full(n, QNFMT[lines.quanta_names], dtype=np.int32),
        quanta_upper=quanta[lines.upper],
        quanta_lower=quanta[lines.lower],
    )


def top_provenance(top: Top) -> dict[str, Any]:
    """What a top consists of: constants and their source, dipole, weights, notes, and the version of the package."""
    return {
        "program": "rotor",
        "version": version(),
        "name": top.name,
        "kind": top.kind,
        "constants": top.constants.text(),
        "reduction": top.constants.reduction,
        "representation": top.constants.representation,
        "constants_source": top.source,
        "dipole_abc_debye": top.dipole_abc_debye,
        "dipole_source": top.dipole_source,
        "spin_weights": top.spin_weights.to_mapping(),
        "spin_weights_source": top.weights_source,
        "notes": list(top.notes),
    }


def provenance(lines: Lines) -> dict[str, Any]:
    """What the lines were made from: the top and its sources, the settings, Q."""
    return top_provenance(lines.top) | {
        "errors_from": errors_from(lines),
        "temperature_k": lines.temperature_k,
        "jmax": lines.jmax,
        "min_lgint": finite_or_none(lines.min_lgint),
        "range_mhz": [finite_or_none(bound) for bound in lines.range_mhz],
        "q": lines.q,
        "q_source": lines.partition.source,
        "lines": len(lines),
        "warnings": list(lines.warnings),
    }


def errors_from(lines: Lines) -> str | None:
    """Which uncertainties the errors of frequencies come from, None where there are none."""
    if lines.covariance is not None:
        return f"covariance of {', '.join(lines.covariance.names)}"
    known = lines.top.constants.uncertainties
    if known and lines.covariance_used is None:
        return "none: the constants are from a fit whose correlations are not known"
    return f"uncertainties of {', '.join(known)}, uncorrelated" if known else None


def finite_or_none(value: float) -> float | None:
    """The value as JSON can say it: None for an open limit."""
    return value if math.isfinite(value) else None


def write_lines(lines: Lines, path: str | os.PathLike[str], settings: Mapping[str, Any] | None = None) -> None:
    """Write lines in the format that the suffix of `path` names: .cat, .cat.gz, .csv, .parquet, .json or .hitran.

    settings: what else the provenance shall say (the command line, for instance); its key "tag" is the tag of a .cat,
    "molecule" (always), "isotopologue" and "abundance" are those of a .hitran.
    Parquet and JSON carry the provenance inside, the others in a file beside, `path` + ".provenance.json".
    """
    name = Path(path).name.lower()
    record = provenance(lines) | {k: v for k, v in (settings or {}).items() if k != "tag"}
    if name.endswith((".cat", ".cat.gz")):
        _write_catalogue(lines, path, int((settings or {}).get("tag", 0)))
        write_beside(path, record)
    elif name.endswith((".csv", ".parquet")):
        write_frame(lines.to_polars(), path, record)
    elif name.endswith(".json"):
        with open_atomic(path, "w", encoding="utf-8") as handle:
            json.dump({"provenance": record, "lines": records(lines)}, handle, indent=1, allow_nan=False)
    elif name.endswith(".hitran"):
        _write_hitran(lines, path, settings or {})
        write_beside(path, record)
    else:
        raise ValueError(
            f"{path}: lines can be written as .cat, .cat.gz, .csv, .parquet, .json or .hitran; the suffix names the format"
        )


def _write_catalogue(lines: Lines, path: str | os.PathLike[str], tag: int) -> None:
    """The 80-column file; a long list in pieces, made side by side on all cores and written in order."""
    if len(lines) <= PIECE:
        return write_cat(catalogue(lines, tag), path)

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
    return None


def _write_hitran(lines: Lines, path: str | os.PathLike[str], settings: Mapping[str, Any]) -> None:
    from rotor.formats.hitran import hitran_lines, write_hitran

    if "molecule" not in settings:
        raise ValueError(
            f'{path}: HITRAN\'s records begin with its number of the molecule; give settings={{"molecule": 5}} (5 is CO)'
        )
    known = {key: settings[key] for key in ("molecule", "isotopologue", "abundance") if key in settings}
    write_hitran(hitran_lines(lines, **known), path)


def _in_order(pool: ThreadPoolExecutor, make: Callable[[int], bytes], starts: Iterable[int]) -> Iterator[bytes]:
    """make(start) of every start, in order; only so many are under way that memory stays bounded."""
    under_way: deque[Future[bytes]] = deque()
    for start in starts:
        under_way.append(pool.submit(make, start))
        if len(under_way) > 2 * (os.cpu_count() or 1):
            yield under_way.popleft().result()
    while under_way:
        yield under_way.popleft().result()


def records(lines: Lines) -> list[dict[str, float | int | None]]:
    """The lines as a list of plain records, numbers that are not finite as None."""
    columns = {name: column.tolist() for name, column in lines.columns.items()}
    rows = zip(*columns.values(), strict=True)
    return [
        {k: None if v != v or v in (math.inf, -math.inf) else v for k, v in zip(columns, row, strict=True)}
        for row in rows
    ]


def write_frame(frame: Any, path: str | os.PathLike[str], record: Mapping[str, Any]) -> None:
    """Write a polars frame as .csv with its provenance beside it, or as .parquet with it inside."""
    if Path(path).suffix.lower() == ".csv":
        with open_atomic(path) as handle:
            frame.write_csv(handle)
        write_beside(path, record)
    else:
        with atomic_path(path) as unfinished:
            frame.write_parquet(unfinished, metadata={"provenance": json.dumps(record)})


def write_beside(path: str | os.PathLike[str], record: Mapping[str, Any]) -> None:
    """Write the provenance of a file whose format has no place for it, as `path` + ".provenance.json"."""
    with open_atomic(f"{os.fspath(path)}.provenance.json", "w", encoding="utf-8") as handle:
        json.dump(record, handle, indent=1, ensure_ascii=False)
        handle.write("\n")
