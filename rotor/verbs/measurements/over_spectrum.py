"""`rotor spectrum --over FILE`: predicted lines over a measured spectrum, and a fit of their intensities."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rotor.assignment.peaks.intensities import Intensities
    from rotor.assignment.peaks.peak_list import PeakList
    from rotor.spectra.lines import Lines
    from rotor.verbs.common.outputs import Report

CACHE_KEY = "over"


class Comparison:
    """Lines inside the band of a spectrum, its peaks, and the fit of intensities; `why` is the reason if there is no fit."""

    def __init__(self, lines: Lines, path: str) -> None:
        from rotor.assignment.peaks.intensities import fit_intensities
        from rotor.formats.spectra.peak_files import read_peaks

        self.peaks: PeakList = read_peaks(path)
        low, high = self.peaks.band_mhz
        self.lines = lines.where(self.peaks.covers(lines.frequency_mhz))
        if not len(self.lines):
            raise ValueError(f"--over {path}: no line lies in its band, {low:g} to {high:g} MHz")
        self.fit: Intensities | None = None
        self.why = ""
        try:
            self.fit = fit_intensities(self.lines, self.peaks)
        except ValueError as error:
            self.why = str(error)

    @property
    def heights(self) -> Any:
        """Heights of the lines in units of the peaks: from the fit, else scaled to the highest peak."""
        if self.fit is not None:
            return self.fit.heights(self.lines)
        intensity = self.lines.intensity_nm2_mhz
        return intensity / intensity.max() * self.peaks.intensity.max()

    def facts(self) -> dict[str, Any]:
        """Counts and fit, by the keys of docs/verbs."""
        low, high = self.peaks.band_mhz
        out: dict[str, Any] = {"peaks": len(self.peaks), "band_mhz": [low, high], "lines": len(self.lines)}
        out["notes"] = list(self.peaks.notes)
        if self.fit is None:
            return out | {"fit": None, "reason": self.why}
        determined = math.isfinite(self.fit.temperature_k)
        return out | {
            "fit": {
                "lines": len(self.fit.line),
                "temperature_k": self.fit.temperature_k if determined else None,
                "temperature_error_k": self.fit.temperature_error_k if determined else None,
                "dipole_ratio": self.fit.dipole_ratio.tolist(),
                "scatter": self.fit.scatter,
            }
        }


def over_facts(record: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Rows of the report on a comparison."""
    band = " to ".join(f"{end:g}" for end in record["band_mhz"])
    rows = [("over", f"{record['peaks']} peaks from {band} MHz; {record['lines']} lines in this band")]
    rows += [("", text) for text in record["notes"]]
    fit = record["fit"]
    if fit is None:
        return [*rows, ("intensities", record["reason"])]
    a, b, c = fit["dipole_ratio"]
    temperature = (
        "no temperature determined"
        if fit["temperature_k"] is None
        else f"{fit['temperature_k']:.2f} ± {fit['temperature_error_k']:.2f} K"
    )
    text = f"{temperature}; |μa| : |μb| : |μc| = {a:.2f} : {b:.2f} : {c:.2f}, of {fit['lines']} lines with a peak"
    return [*rows, ("intensities", f"{text}, scatter {100 * fit['scatter']:.0f} %")]


def compared(answer: Any, report: Report) -> Comparison:
    """The comparison, made once for all files of a report."""
    if CACHE_KEY not in report.cache:
        report.cache[CACHE_KEY] = Comparison(answer.lines, report.shown.over)
    comparison: Comparison = report.cache[CACHE_KEY]
    return comparison


def drawing(name: str) -> Callable[[Any, Path, Report], None]:
    """Function that draws a picture of `rotor.plots.spectra.over`."""

    def draw(answer: Any, path: Path, report: Report) -> None:
        from rotor.plots.spectra.over import plot_over
        from rotor.plots.view import View

        comparison = compared(answer, report)
        view = View(*map(report.view.get, ("title", "range_mhz", "vertical", "log")))
        lines, heights, peaks = comparison.lines, comparison.heights, comparison.peaks
        plot_over(name, lines, heights, peaks, path, view=view, provenance=report.command)

    return draw


draw_over, draw_loomis_wood = drawing("over"), drawing("loomis_wood")
