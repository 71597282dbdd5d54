"""Assigned lines as .lin or .csv."""

from __future__ import annotations

import csv
import os

from rotor.fitting.assignment import Assignments
from rotor.formats.atomic_write import open_atomic, write_whole
from rotor.formats.lines.assigned_lin import as_lin
from rotor.formats.spcat.text.lin import format_lin
from rotor.quantum.labels.quanta import FIELD_STEP_KV_PER_CM, value_text
from rotor.units import MHZ_PER_CM


def write_assigned_lines(lines: Assignments, path: str | os.PathLike[str]) -> None:
    """Write assigned lines as .lin or .csv; an existing file is replaced at the end or not at all.

    In a .lin a blend is lines of one frequency behind each other, so that the lines of a blend are put together, and others of one
    frequency apart; see `rotor.formats.lines.assigned_lin`. Excluded lines follow a blank line, where SPFIT stops reading. Wavenumbers
    have a negative error.
    """
    text = os.fspath(path).lower()
    if text.endswith(".lin"):
        return write_whole(path, format_lin(as_lin(lines)))
    if not text.endswith(".csv"):
        raise ValueError(f"{path}: assigned lines are written as .lin or .csv")
    names = [name for name in lines.names if name != "field"]
    labels = [f"{name}_{side}" for side in ("upper", "lower") for name in names]
    wave = bool(lines.wavenumber.all()) and len(lines) > 0
    unit = MHZ_PER_CM if wave else 1.0
    in_field = "field" in lines.names
    heads = [
        *labels,
        *(["field_kv_per_cm"] if in_field else []),
        "wavenumber_cm" if wave else "frequency_mhz",
        "error_cm" if wave else "error_mhz",
        "weight",
        "blend",
        *(["width_mhz"] if lines.widths_mhz else []),
        *(["excluded"] if lines.is_excluded.any() else []),
    ]
    halves = [name in lines.halves for name in lines.names]
    with open_atomic(path, "w", encoding="utf-8", newline="") as handle:
        writer = csv.writer(handle, lineterminator="\n")
        writer.writerow([*heads, *(["comment"] if lines.comments else [])])
        for i in range(len(lines)):
            numbers = [lines.frequency_mhz[i] / unit, lines.error_mhz[i] / unit, lines.weight[i]]
            sides = zip((*lines.upper[i].tolist(), *lines.lower[i].tolist()), halves * 2, strict=True)
            quanta = [value_text(value, half) for value, half in sides]
            if in_field:  # the last number of both states is the field
                del quanta[len(names)]
                quanta[-1] = repr(float(lines.lower[i, -1]) * FIELD_STEP_KV_PER_CM)
            row = [*quanta, *map(float, numbers), int(lines.blend[i])]
            if lines.widths_mhz:
                row.append(lines.widths_mhz.get(int(lines.blend[i]), ""))
            if "excluded" in heads:
                row.append("yes" if lines.is_excluded[i] else "")
            writer.writerow([*row, *([lines.comments[i]] if lines.comments else [])])
    return None
