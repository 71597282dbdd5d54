"""Measured lines of catalogues (.cat) as assigned lines: without states and spins, or with all quantum numbers."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rotor.fitting.assignment import Assignments, assignments
from rotor.formats.spcat.text.catalogue import Catalogue
from rotor.formats.spcat.text.fields import BLANK
from rotor.table import counted

_WITH_STATES = 10  # QNFMT // 100 is at least this if a state has a vibrational quantum number


def _measured(path: str | os.PathLike[str]) -> Catalogue:
    """The measured lines of a catalogue file."""
    from rotor.formats.spcat.text.cat import read_cat

    catalogue = read_cat(path)
    return catalogue.take(catalogue.tag < 0)


def _columns(lines: Catalogue, width: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Frequency, error, the first quantum numbers of both states, and intensities relative to the strongest line."""
    from rotor.formats.spcat.compare import in_mhz

    upper, lower = (np.abs(side[:, :width].astype(np.int64)) for side in (lines.quanta_upper, lines.quanta_lower))
    weight = 10.0 ** (lines.lgint - lines.lgint.max(initial=0.0)) if len(lines) else np.zeros(0)
    return *in_mhz(lines), upper, lower, weight


def catalogue_lines(path: str | os.PathLike[str], names: Sequence[str]) -> tuple[Assignments, list[str]]:
    """The measured lines of a catalogue without quantum numbers of states and spins, with hyperfine components merged; and notes."""
    measured, width = _measured(path), len(names)
    beyond = np.concatenate([measured.quanta_upper[:, width:], measured.quanta_lower[:, width:]], axis=1)
    split = (measured.qnfmt // 100 < _WITH_STATES) & (measured.qnfmt % 10 > width)
    ground = ((beyond == 0) | (beyond == BLANK)).all(axis=1) | split
    notes = []
    if not ground.all():
        notes.append(f"{int((~ground).sum())} measured lines of other states, or with spins, are left out")
    measured, split = measured.take(ground), split[ground]
    frequency, error, upper, lower, weight = _columns(measured, width)
    first = _without_repetitions(upper, lower, frequency)
    if split.all() and len(split):
        first, frequency, error = _centres(upper, lower, frequency, error, weight)
        notes.append(
            f"{len(split)} components of spins are put together by rotational line, at their mean by intensity: "
            f"{counted(len(first), 'line')}"
        )
    groups = [(round(float(f), 6), round(float(e), 6)) for f, e in zip(frequency, error, strict=True)]
    order = {key: i for i, key in enumerate(dict.fromkeys(groups))}
    return assignments(
        names, upper[first], lower[first], frequency[first], error[first],
        weight=weight[first] if len(measured) else 1.0,
        blend=np.array([order[key] for key in groups], dtype=np.int64)[first], source=Path(path).name,
    ), notes  # fmt: skip


def whole_catalogue_lines(path: str | os.PathLike[str], names: Sequence[str]) -> tuple[Assignments, list[str]]:
    """The measured lines of a catalogue with all quantum numbers, v and F included; and notes."""
    measured, width = _measured(path), len(names)
    whole = (measured.qnfmt % 10 == width) & ((measured.qnfmt // 1000 % 2 == 1) == ("v" in names))
    notes = [] if whole.all() else [f"{int((~whole).sum())} measured lines without {', '.join(names)} are left out"]
    measured = measured.take(whole)
    frequency, error, upper, lower, weight = _columns(measured, width)
    first = _without_repetitions(upper, lower, frequency)
    pairs = np.stack([frequency.round(6), error.round(6)], axis=1)
    blend = np.unique(pairs, axis=0, return_inverse=True)[1].reshape(-1) if len(pairs) else np.zeros(0, dtype=np.int64)
    return assignments(
        names, upper[first], lower[first], frequency[first], error[first], weight=weight[first], blend=blend[first],
        source=Path(path).name,
    ), notes  # fmt: skip


def _centres(
    upper: np.ndarray, lower: np.ndarray, frequency: np.ndarray, error: np.ndarray, weight: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places of the first component of each rotational line, and frequencies and errors with those of the unsplit lines there.

    To first order the intensity-weighted mean of all components is the line without spins; its error is the smallest of the components.
    """
    _, first, line = np.unique(np.concatenate([upper, lower], axis=1), axis=0, return_index=True, return_inverse=True)
    line = line.reshape(-1)
    means = np.bincount(line, weight * frequency) / np.bincount(line, weight)
    least = np.full(len(first), np.inf)
    np.minimum.at(least, line, error)
    return np.sort(first), means[line], least[line]


def _without_repetitions(upper: np.ndarray, lower: np.ndarray, frequency: np.ndarray) -> np.ndarray:
    """Places of lines without repetitions by K doublets, whose components have equal label and frequency."""
    keys = [(*u, *low, f) for u, low, f in zip(upper.tolist(), lower.tolist(), frequency.tolist(), strict=True)]
    seen = {key: i for i, key in reversed([*enumerate(keys)])}
    return np.array(sorted(seen.values()), dtype=np.int64)
