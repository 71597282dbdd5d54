"""Draws pictures/quantum_and_classical.png: classical bands of water and OCS over the quantum lines, for docs/gas.md.

python docs/make_classical_bands.py
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, get_args

import numpy as np

import rotor
from rotor.plots.picture import BLUE, PALETTE, new_figure, save, styled
from rotor.spectra.classical_band import Correction, classical_band, rigid
from rotor.spectra.lines import line_list
from rotor.spectra.spectrum import Spectrum
from rotor.units import MHZ_PER_CM

PANELS = (
    ("water", 300.0, 60.0, 1000.0, ("harmonic", "standard")),
    ("OCS", 300.0, 2.0, 90.0, ("harmonic",)),
    ("water", 30.0, 20.0, 330.0, ("harmonic", "schofield")),
    ("OCS", 3.0, 0.2, 9.0, ("harmonic",)),
)  # molecule, temperature (K), width of the Gaussian and end of the axis (cm⁻¹), factors of detailed balance
MOLECULES = 50_000  # scatter of about 2 % of the peak for water


def main() -> None:
    """Draws the picture beside this file."""
    with styled():
        figure = new_figure((5.6, 5.0))
        for axes, panel in zip(figure.subplots(2, 2).ravel(), PANELS, strict=True):
            draw(axes, *panel)
    path = Path(__file__).parent / "pictures" / "quantum_and_classical.png"
    save(figure, path, "Classical bands over quantum lines", {"made by": "docs/make_classical_bands.py"})


def draw(axes: Any, name: str, temperature_k: float, fwhm_cm: float, last_cm: float, factors: tuple[str, ...]) -> None:
    """One gas: its lines, smoothed, and its classical bands."""
    top, grid_cm = rigid(rotor.read(name)), np.linspace(0.0, last_cm, 600)
    grid, fwhm = grid_cm * MHZ_PER_CM, fwhm_cm * MHZ_PER_CM
    lines = Spectrum.from_lines(line_list(top, temperature_k=temperature_k, min_lgint=-14), grid[1:], fwhm_mhz=fwhm)
    axes.fill_between(grid_cm[1:], lines.intensity, color=BLUE, alpha=0.25, label="quantum lines")
    for factor, colour in zip(factors, PALETTE[1:], strict=False):
        assert factor in get_args(Correction)
        rng = np.random.default_rng(1)
        band = classical_band(
            top, grid, fwhm_mhz=fwhm, temperature_k=temperature_k, correction=factor, molecules=MOLECULES, rng=rng
        )
        axes.plot(grid_cm, band.intensity, color=colour, label=f"classical, {factor}")
    axes.set(xlim=(0.0, last_cm), ylim=(0.0, None), xlabel="Wavenumber (cm⁻¹)", ylabel="Cross section (nm²)")
    axes.set_title(f"{name}, {temperature_k:g} K, smoothed to {fwhm_cm:g} cm⁻¹", fontsize=9.0)
    axes.ticklabel_format(axis="y", style="sci", scilimits=(-3, 4))
    axes.legend(fontsize=7.5, loc="upper right", handlelength=1.2, borderaxespad=0.0)


if __name__ == "__main__":
    main()
