"""A session with its spectrum: answers to the messages of pages; actions are steps that can be undone.

The server, the widget of notebooks and the tests use the same `Service.answer`. docs/view.md lists the messages.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

import msgspec
import numpy as np

from rotor.arrays import Floats
from rotor.assignment.peaks.peak_list import PeakList
from rotor.observed.spectrum import ObservedSpectrum
from rotor.version import version
from rotor.viewer.actions.actions import ACTIONS, REFITTED_AFTER
from rotor.viewer.actions.fits import assigned_levels
from rotor.viewer.actions.joint_fits import line_residuals, lines_alone, refits, shared_blends
from rotor.viewer.actions.line_actions import import_lines, peak_in
from rotor.viewer.exports import exported
from rotor.viewer.loomis_wood import label_rows, row_centres, row_points
from rotor.viewer.messages import Context, read_constants, read_number, read_species
from rotor.viewer.prediction import Model, Predicted, Predictions, changed
from rotor.viewer.pyramid import pyramid
from rotor.viewer.records import Line, Record, Species, species_key
from rotor.viewer.session import Session, facts

MOST_PIXELS = 8000
MOST_STICKS = 1500  # of a species in a window
MOST_PICKED = 300
SEARCH = "search"  # by rotor assign: long, so that it does not hold up other messages

Answer = dict[str, Any]


class Service:
    """A session with its spectrum. `answer` may be called by several threads; messages are answered in turn."""

    def __init__(self, session: Session, spectrum: ObservedSpectrum, peaks: PeakList | None = None) -> None:
        self.session = session
        self.spectrum = spectrum
        self.peaks = peaks
        x, y = spectrum.frequency_mhz, spectrum.intensity
        if peaks is not None:  # drawn as sticks
            x, y = np.repeat(x, 3), np.stack([0 * y, y, 0 * y], axis=1).reshape(-1)
        self.pyramid = pyramid(x, y)
        self.band_mhz = (float(spectrum.frequency_mhz[0]), float(spectrum.frequency_mhz[-1]))
        self.predictions = Predictions(self.band_mhz, session.path.parent if session.path else None)
        self._lock = threading.RLock()
        self._residuals: tuple[int, dict[int, dict[str, Any]]] | None = None
        self._queries: Mapping[str, Callable[[Mapping[str, Any]], Answer]] = {
            "hello": self._hello,
            "window": self._window,
            "loomis_wood": self._loomis_wood,
            "peak": self._peak,
            "pick": self._pick,
            "levels": self._levels,
            "export": self._export,
        }

    def answer(self, message: Any) -> Answer:
        """The answer to a message: `ok` with its content, or `error` with a line of text; `notes` has remarks."""
        if not isinstance(message, dict) or not isinstance(message.get("do"), str):
            return {"error": 'expected a message {"do": NAME, ...}'}
        try:
            if message["do"] == SEARCH:
                return self._search(message)
            with self._lock:
                return self._answer(message["do"], message)
        except ValueError as error:
            return {"error": " ".join(str(error).split())}
        except OSError as error:
            return {"error": f"{error.filename or 'session'}: {error.strerror}"}
        except (ArithmeticError, LookupError, TypeError, AttributeError) as error:  # an unforeseen message
            return {"error": f"{message['do']}: {type(error).__name__}: {error}"}

    def _search(self, message: Mapping[str, Any]) -> Answer:
        """Add species and lines by `rotor assign`; other messages are answered during the search."""
        from rotor.viewer.actions.from_search import search, search_records

        answer = search(self.spectrum, message, self.peaks)
        with self._lock:
            label, changes, remarks = search_records(answer, self.session.state)
            self.session.apply(label, changes)
        return {"ok": {"label": label}, "notes": remarks}

    def _answer(self, name: str, message: Mapping[str, Any]) -> Answer:
        if name in self._queries:
            return {"ok": self._queries[name](message)}
        if name in ("undo", "redo"):
            return {"ok": {"label": self.session.undo() if name == "undo" else self.session.redo()}}
        if name not in ACTIONS:
            raise ValueError(f"do {name!r}: known are {', '.join([*self._queries, *ACTIONS, 'undo', 'redo', SEARCH])}")
        context = self._context()
        label, changes = ACTIONS[name](self.session.state, message, context)
        if name in REFITTED_AFTER and self.session.state.settings.auto_refit:
            changes |= self._refits(changes, context)
        moved = self.session.apply(label, changes)
        return {"ok": {"label": label if moved else None}, "notes": context.notes}

    def _context(self) -> Context:
        return Context(self.spectrum, self.predictions, [], self.peaks)

    def _refits(self, changes: Mapping[str, Record | None], context: Context) -> dict[str, Record | None]:
        """Refit the species whose lines or free constants change; notes name the fits that fail."""
        after = self.session.state.with_changes(changes)
        before = self.session.state.records
        touched = set[int]()
        for key, record in changes.items():
            for revision in (record, before.get(key)):
                if isinstance(revision, Line):
                    touched.add(revision.species)
            if key.startswith("species/"):
                touched.add(int(key.partition("/")[2]))
        records, failures = refits(after, touched & after.species.keys(), self.predictions.model)
        context.notes.extend(f"not refitted: {text}" for text in failures)
        return {species_key(number): record for number, record in records.items()}

    def read_lines(self, path: str, species: int) -> list[str]:
        """Add the assigned lines of a file to the session; returns the remarks of the reader."""
        with self._lock:
            context = self._context()
            self.session.apply(*import_lines(self.session.state, species, path, context))
            return context.notes

    # Queries

    def facts(self) -> Answer:
        """The session without its spectrum, with the residual of each line and the quantum numbers of each species."""
        with self._lock:
            out = facts(self.session)
            out["lines"] = {str(number): row for number, row in self._line_facts().items()}
            out["quanta"] = {}
            for number, record in self.session.state.species.items():
                model = self.predictions.model(record)
                out["quanta"][str(number)] = {"names": list(model.quanta), "halves": sorted(model.halves)}
            return out

    def _line_facts(self) -> dict[int, dict[str, Any]]:
        """Residuals of all lines, computed once for each revision."""
        if self._residuals is None or self._residuals[0] != self.session.revision:
            self._residuals = (self.session.revision, line_residuals(self._models(), self.session.state))
        return self._residuals[1]

    def _models(self) -> dict[int, Model]:
        """The models of all species."""
        return {number: self.predictions.model(record) for number, record in self.session.state.species.items()}

    def _hello(self, message: Mapping[str, Any]) -> Answer:
        y = self.spectrum.intensity
        return {
            "rotor": version(),
            "band_mhz": list(self.band_mhz),
            "range": [float(y.min()), float(y.max())],
            "channel_mhz": self.channel_mhz,
            "list": self.peaks is not None,
            "noise": float(np.median(self.spectrum.noise)),
            "unit": self.spectrum.unit,
            "notes": list(self.spectrum.notes),
            "session": self.facts(),
        }

    @property
    def channel_mhz(self) -> float:
        """Width of a channel; the median error for a list of peaks."""
        return self.spectrum.channel_mhz if self.peaks is None else float(np.median(self.peaks.uncertainty_mhz))

    def _previewed(self, message: Mapping[str, Any]) -> dict[int, Species]:
        """The species; the species whose slider moves has the previewed values."""
        species = self.session.state.species
        preview = message.get("preview")
        if preview is None:
            return species
        number, record = read_species(self.session.state, preview)
        if "temperature_k" in preview:
            record = msgspec.structs.replace(record, temperature_k=read_number(preview, "temperature_k", above=0))
        if "constants" in preview:
            record = changed(record, read_constants(preview))
        if "dipole_abc_debye" in preview:
            a, b, c = (float(x) for x in preview["dipole_abc_debye"])
            record = msgspec.structs.replace(record, dipole_abc_debye=(a, b, c))
        if "scale" in preview:
            record = msgspec.structs.replace(record, scale=read_number(preview, "scale", above=0))
        return {**species, number: record}

    def _window(self, message: Mapping[str, Any]) -> Answer:
        """Points of the spectrum in a range; frequencies, heights (strongest line: 1) and labels of each species."""
        first, last = read_number(message, "first_mhz"), read_number(message, "last_mhz")
        if not first < last:
            raise ValueError(f"window: {first:g} to {last:g} MHz: expected a range that rises")
        pixels = min(int(read_number(message, "pixels", above=0)), MOST_PIXELS)
        x, y = self.pyramid.window(first, last, pixels)
        species = {n: record for n, record in self._previewed(message).items() if record.visible}
        answer: Answer = {"x": _numbers(x, 10), "y": _numbers(y), "sticks": {}}
        for number, record in species.items():
            answer["sticks"][str(number)] = self.sticks(self.predictions.lines(record), first, last)
        if self.session.state.settings.emission and species and len(x) > 1:
            answer["model"] = self._emission(species, first, last, pixels)
        return answer

    def sticks(self, predicted: Predicted, first: float, last: float, limit: int = MOST_STICKS) -> Answer:
        """Frequencies, heights and labels of the drawn lines of a species in a range."""
        rows = predicted.between(first, last, limit)
        lines, strongest = predicted.lines, predicted.strongest or 1.0
        chosen = lines.where(rows)
        labels = [predicted.model.labels(lines.levels, side) for side in (chosen.upper, chosen.lower)]
        return {
            "x": _numbers(chosen.frequency_mhz, 12),
            "height": _numbers(predicted.intensity[rows] / strongest * predicted.model.record.scale),
            "upper": labels[0].tolist(),
            "lower": labels[1].tolist(),
        }

    def _emission(self, species: Mapping[int, Species], first: float, last: float, pixels: int) -> Answer:
        """Brightness (K) of the modelled emission of all species."""
        from rotor.observed.model.model import Component, Sight, model

        components = [
            Component(
                self.predictions.emitter(record),
                record.column_per_cm2,
                record.temperature_k,
                record.velocity_km_s,
                record.fwhm_km_s,
            )
            for record in species.values()
        ]
        grid = np.linspace(max(first, self.band_mhz[0]), min(last, self.band_mhz[1]), 2 * pixels)
        modelled = model(components, grid, Sight(self.session.state.settings.background_k))
        return {"x": _numbers(grid, 10), "y": _numbers(modelled.brightness_k)}

    def _loomis_wood(self, message: Mapping[str, Any]) -> Answer:
        """The rows of the chosen series: centres, labels, points, and the line assigned in each."""
        series = self.session.state.settings.series
        if series is None:
            return {"rows": []}
        species = self._previewed(message)
        record = species.get(series.species) if series.species is not None else None
        predicted = None if record is None else self.predictions.lines(record)
        centres = row_centres(series, self.band_mhz, predicted)
        first, count = int(message.get("first_row", 0)), int(message.get("rows", 50))
        chosen = centres.where(np.arange(len(centres.number))[max(first, 0) : max(first, 0) + max(count, 1)])
        half = read_number(message, "half_width_mhz", above=0)
        points = row_points(chosen, self.pyramid, half, min(int(read_number(message, "pixels", above=0)), MOST_PIXELS))
        assigned = {
            (line.upper, line.lower): (number, line)
            for number, line in self.session.state.species_lines(series.species or -1).items()
        }
        rows = []
        for i, (x, y) in enumerate(points):
            labels = tuple(chosen.upper[i].tolist()), tuple(chosen.lower[i].tolist())
            number, line = assigned.get(labels, (None, None))
            rows.append(
                {
                    "n": int(chosen.number[i]),
                    "centre_mhz": float(chosen.frequency_mhz[i]),
                    "upper": labels[0],
                    "lower": labels[1],
                    "x": _numbers(x, 8),
                    "y": _numbers(y),
                    "line": number,
                    "at": None if line is None else line.frequency_mhz - float(chosen.frequency_mhz[i]),
                    "rejected": None if line is None else line.rejected,
                }
            )
        return {"rows": rows, "total": len(centres.number)}

    def _peak(self, message: Mapping[str, Any]) -> Answer:
        """The peak in a range, and the predicted lines in and near the range, strongest first."""
        first, last = read_number(message, "first_mhz"), read_number(message, "last_mhz")
        if not first < last:
            raise ValueError(f"peak: {first:g} to {last:g} MHz: expected a range that rises")
        answer: Answer = {"peak": None, "why": None, "candidates": []}
        try:
            peak = peak_in(self._context(), first, last)
            answer["peak"] = asdict(peak)
            centre = peak.frequency_mhz
        except ValueError as error:
            answer["why"], centre = str(error), (first + last) / 2
        reach = max(read_number(message, "reach_mhz", default=0.0), last - first)
        for number, record in self.session.state.species.items():
            if not record.visible:
                continue
            predicted = self.predictions.lines(record)
            rows = predicted.between(centre - reach, centre + reach, 40)
            answer["candidates"] += self._candidates(number, predicted, rows, centre)
        answer["candidates"].sort(key=lambda candidate: -candidate["height"])
        return answer

    def _candidates(self, number: int, predicted: Predicted, rows: Any, centre: float) -> list[Answer]:
        lines, model = predicted.lines.where(rows), predicted.model
        labels = [model.labels(lines.levels, side).tolist() for side in (lines.upper, lines.lower)]
        heights = predicted.intensity[rows] / (predicted.strongest or 1.0)
        assigned = {(line.upper, line.lower) for line in self.session.state.species_lines(number).values()}
        return [
            {
                "species": number,
                "upper": upper,
                "lower": lower,
                "frequency_mhz": frequency,
                "off_mhz": frequency - centre,
                "height": height,
                "assigned": (tuple(upper), tuple(lower)) in assigned,
            }
            for upper, lower, frequency, height in zip(
                *labels, lines.frequency_mhz.tolist(), heights.tolist(), strict=True
            )
        ]

    def _pick(self, message: Mapping[str, Any]) -> Answer:
        """The allowed lines of a level in the band, strongest first."""
        number, record = read_species(self.session.state, message)
        label = message.get("level")
        predicted = self.predictions.lines(record)
        model = predicted.model
        names = ", ".join(model.quanta)
        if not isinstance(label, list) or len(label) != len(model.quanta) or not all(type(q) is int for q in label):
            raise ValueError(f"level: {label!r}: expected {len(model.quanta)} whole numbers: {names}")
        row = int(label_rows(model, predicted.lines.levels, np.array([label]))[0])
        if row < 0:
            raise ValueError(
                f"level {' '.join(map(str, label))}: there is no such level ({names}) up to J = {predicted.lines.jmax}"
            )
        rows = np.flatnonzero((predicted.lines.upper == row) | (predicted.lines.lower == row))
        rows = rows[np.argsort(-predicted.intensity[rows])][:MOST_PICKED]
        return {"candidates": self._candidates(number, predicted, rows, 0.0)}

    def _levels(self, message: Mapping[str, Any]) -> Answer:
        number, record = read_species(self.session.state, message)
        predicted, shared = self.predictions.lines(record), shared_blends(self.session.state)
        lines = {
            n: msgspec.structs.replace(line, rejected=line.rejected or line.blend in shared)  # measures no difference
            for n, line in self.session.state.species_lines(number).items()
        }
        return assigned_levels(predicted.model, lines, predicted.lines.levels)

    def _export(self, message: Mapping[str, Any]) -> Answer:
        number, record = read_species(self.session.state, message)
        lines = lines_alone(number, self._models(), self.session.state)
        name, text = exported(str(message.get("what")), self.predictions.model(record), lines)
        return {"name": name, "text": text}


def _numbers(values: Floats, digits: int = 6) -> list[float]:
    """Numbers for JSON, rounded to the significant digits of the largest number for short messages."""
    largest = float(np.abs(values).max(initial=0.0))
    if not largest > 0 or not math.isfinite(largest):
        return np.asarray(values, dtype=np.float64).tolist()  # type: ignore[no-any-return]
    places = digits - 1 - math.floor(math.log10(largest))
    return np.round(values, places).tolist()  # type: ignore[no-any-return]
