"""Fits of lines that a prediction from the same files gives."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from rotor.fitting.fit import fit_lines
from rotor.fitting.result import Fit
from rotor.formats.spcat.fits.fit_input import SpfitInput, spfit_input
from rotor.formats.spcat.predict import Prediction
from rotor.formats.spcat.text.lin import read_lin
from rotor.formats.spcat.text.par import ParameterFile


def fit_of_prediction(
    true: ParameterFile, computed: Prediction, folder: Path, factor: float = 1.001, code: int = 100, most: int = 300
) -> tuple[SpfitInput, Fit]:
    """The fit of predicted lines, given to 1e-5 MHz, from a start with one parameter of the true file multiplied by a factor."""
    listed = computed.catalogue
    width = int((listed.quanta_upper[0] >= -99).sum())
    rows = [
        "".join(f"{q:3d}" for q in (*up[:width], *low[:width])).ljust(36) + f" {frequency:.5f} 0.01"
        for up, low, frequency in zip(
            listed.quanta_upper.tolist(), listed.quanta_lower.tolist(), listed.frequency_mhz.tolist(), strict=True
        )
        if frequency > 1
    ]
    (folder / "a.lin").write_text("\n".join(rows[:most]) + "\n")
    off = tuple(replace(p, value=factor * p.value) if p.code == code else p for p in true.parameters)
    fit_input = spfit_input(replace(true, parameters=off), read_lin(folder / "a.lin", width, 900), "a.lin")
    fit = fit_lines(
        fit_input.lines, fit_input.constants, fit_input.parameters, fit_input.options, model=fit_input.model
    )
    return fit_input, fit
