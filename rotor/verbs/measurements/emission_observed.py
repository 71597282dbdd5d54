"""`rotor emission --over` and `--fit`: a model over an observed spectrum, its best fit, and the fit of every pixel of a cube."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.frozen import dataclass
from rotor.reports.screen import Part, Table, record_table
from rotor.requests.field import changed_fields, declared_fields
from rotor.requests.readers import INFINITE, Rule
from rotor.verbs.common.outputs import PICTURES, Output, Report, table_file
from rotor.verbs.common.verb import Note, Tool, Work
from rotor.verbs.measurements.observed_file import (
    FIT_OPTIONS,
    SINGLE,
    SINGLE_FIT,
    ObservedRequest,
    json_of,
    spectrum_facts,
)

if TYPE_CHECKING:
    from rotor.formats.spectra.cube_file import Cube
    from rotor.observed.cube import CubeFit
    from rotor.observed.fit import Contribution, SourceFit
    from rotor.observed.gas_cell import CellFit
    from rotor.observed.model.model import Component, Sight
    from rotor.observed.spectrum import ObservedSpectrum
    from rotor.table import Table as Columns


@dataclass(frozen=True)
class Mapped:
    """A cube and the maps of its fit. pixels: number of fitted pixels."""

    request: ObservedRequest
    cube: Cube
    fit: CubeFit
    pixels: int

    table = None

    def facts(self) -> dict[str, Any]:
        """Cube and maps, by the keys of docs/verbs."""
        cube = self.cube
        return {
            "cube": {
                "source": cube.source,
                "pixels": list(cube.noise_k.shape[::-1]),
                "channels": len(cube.frequency_mhz),
                "range_mhz": [float(cube.frequency_mhz[0]), float(cube.frequency_mhz[-1])],
                "frame": cube.frame,
                "beam_arcsec": None if cube.beam_arcsec is None else list(cube.beam_arcsec),
                "noise_k": float(np.nanmedian(cube.noise_k)),
            },
            "pixels": self.pixels,
            "converged": int(self.fit.fitted.sum()),
            "reduced_chi_squared": _quantiles(self.fit.reduced_chi_squared)[1],
            "maps": self._maps(),
        }

    def _maps(self) -> list[dict[str, Any]]:
        rows = []
        for name, value, error in zip(self.fit.names, self.fit.values, self.fit.errors, strict=True):
            ends = dict(zip(("low", "median", "high"), _quantiles(value), strict=True))
            rows.append({"name": name, **ends, "determined": int(np.isfinite(error).sum())})
        return rows


def _quantiles(values: Any) -> tuple[float | None, ...]:
    """16, 50 and 84 % quantiles of the finite values; None without any."""
    finite = values[np.isfinite(values)]
    return tuple(np.quantile(finite, (0.16, 0.5, 0.84)).tolist()) if len(finite) else (None, None, None)


def _map_parts(content: Mapping[str, Any]) -> Iterable[Part]:
    """The cube, and the range of each map."""
    cube = content["cube"]
    (width, height), (first, last) = cube["pixels"], cube["range_mhz"]
    size = f"{width} by {height} pixels, {cube['channels']} channels from {first:.6f} to {last:.6f} MHz"
    yield [
        ("cube", f"{cube['source']}: {size}, frame {cube['frame']}"),
        ("noise", f"{cube['noise_k']:.4g} K a channel, median of the pixels"),
        ("fitted", f"{content['pixels']} pixels, {content['converged']} of them converged"),
        ("χ²/ν", f"{content['reduced_chi_squared']:.4g}, median"),
    ]
    columns = {
        "parameter": "{name}",
        "16 %": "{low:.5g}",
        "median": "{median:.5g}",
        "84 %": "{high:.5g}",
        "determined": "{determined}",
    }
    yield record_table("pixels of each map", columns, content["maps"], {"parameter"})


def refuse_corner(request: ObservedRequest, outputs: Mapping[str, Any], _: Any) -> None:
    """Refuse a picture of draws without its package, before the fit."""
    if "corner" in outputs:
        from rotor.observed.sampling import load_corner

        load_corner()


def fitted_maps(request: ObservedRequest, work: Work) -> Mapped:
    """Read the cube, start from its brightest pixel, and fit every pixel."""
    from rotor.formats.spectra.cube_file import read_cube, read_mask
    from rotor.observed.cube import fit_cube
    from rotor.observed.spectrum import observed_spectrum

    cube = read_cube(Path(request.fit or ""), request.spectrum.choices)
    if request.range_mhz != INFINITE:
        cube = cube.between(*request.range_mhz)
    peak = np.max(np.where(np.isfinite(cube.intensity_k), cube.intensity_k, -np.inf), axis=0)
    shape = cube.noise_k.shape
    chosen = peak > 5 * cube.noise_k if request.mask is None else read_mask(Path(request.mask), shape)
    chosen = chosen & np.isfinite(cube.noise_k)
    if not chosen.any():
        where = (
            "inside the mask with noise and half of its channels" if request.mask else "above five standard deviations"
        )
        raise ValueError(f"{cube.source}: no pixel {where}, nothing to fit")
    y, x = np.unravel_index(np.argmax(np.where(chosen, peak, -np.inf)), shape)
    brightest = observed_spectrum(
        cube.frequency_mhz, cube.intensity_k[:, y, x], noise=float(cube.noise_k[y, x]), beam_arcsec=cube.beam_arcsec,
        source=f"{cube.source}, pixel {x + 1},{y + 1}", rest_mhz=cube.rest_mhz, frame=cube.frame,
    )  # fmt: skip
    sight = request.sight(brightest)
    start = request.components(brightest, request.species(brightest, work.note), sight)
    work.note(f"the search begins at the brightest pixel, {x + 1},{y + 1}")
    choices = request.choices
    noise = np.where(chosen, cube.noise_k, 1.0)
    fit = fit_cube(
        cube.frequency_mhz, cube.intensity_k, noise, start, sight, choices, mask=chosen, executor=work.executor
    )
    return Mapped(request, cube, fit, int(chosen.sum()))


def write_maps_of_fit(mapped: Mapped, path: Path, report: Report) -> None:
    """Write the maps with the coordinates of the cube."""
    from rotor.formats.spectra.cube_file import write_maps

    write_maps(mapped.fit, mapped.cube, path, str(report.content["command"]))


# options and files that a gas cell has no place for
_TELESCOPE_INPUTS = ("background_k", "redshift", *FIT_OPTIONS)
_BEAM_INPUTS = ("beam_arcsec", "size_arcsec")
_TELESCOPE_FILES = ("diagram", "corner")


@dataclass(frozen=True)
class Observed:
    """A spectrum with the model of its source. After a fit also each species' contribution, a sample and rotational diagrams."""

    request: ObservedRequest
    spectrum: ObservedSpectrum
    sight: Sight
    components: Sequence[Component]
    fit: SourceFit | None = None
    needed: Sequence[Contribution] = ()
    chain: Any = None
    diagrams: Any = None

    @property
    def table(self) -> Columns:
        """Fitted parameters, or the modelled lines."""
        from rotor.observed.overlay_table import line_table

        return line_table(self.spectrum, self.components, self.sight) if self.fit is None else self.fit

    def facts(self) -> dict[str, Any]:
        """Spectrum and model, by the keys of docs/verbs."""
        from rotor.observed.fit import component_facts
        from rotor.observed.overlay_table import modelled

        content: dict[str, Any] = {"spectrum": json_of(self.spectrum)}
        if self.fit is None:
            seen = modelled(self.spectrum, self.components, self.sight)
            content["components"] = [component_facts(component) for component in self.components]
            name = "rms_k" if self.spectrum.unit == "K" else "rms"
            return content | {name: float(np.sqrt(np.mean((self.spectrum.intensity - seen) ** 2)))}
        content |= self.fit.facts()
        names = ("species", "signal", "needed", "limit_per_cm2", "limit_excitation_k")
        content["contributions"] = [
            {name: getattr(contribution, name) for name in names} for contribution in self.needed
        ]
        further = {"sample": self.chain, "diagrams": self.diagrams}
        return content | {name: each.facts() for name, each in further.items() if each is not None}


def answer(request: ObservedRequest, work: Work) -> Observed | Mapped:
    """Read the spectrum, then model or fit it; with maps, fit every pixel of a cube."""
    if "maps" in work.files:
        return fitted_maps(request, work)
    if work.executor is not None:
        raise ValueError(
            "--workers: spreads the rows of a cube; expected with --maps FILE (one spectrum is one process)"
        )
    spectrum = request.spectrum.read(request.fit or request.over or "", request.range_mhz, gas_cell=True)
    if in_absorbance := spectrum.unit == "absorbance":
        refuse_telescope(request, work.files)
    sight = request.sight(spectrum)
    if in_absorbance and request.fit is not None:
        cell = cell_fit(spectrum, request, work.note)
        return Observed(request, spectrum, sight, list(cell.components), cell)
    components = request.components(spectrum, request.species(spectrum, work.note), sight)
    if request.fit is None:
        return Observed(request, spectrum, sight, components)
    from rotor.observed.fit import contributions

    fit = _fitted(spectrum, components, sight, request)
    chain = None
    if request.sample:
        from rotor.observed.sampling import sample_source

        chain = sample_source(fit, request.sample)
    diagrams = _diagrams(spectrum, fit, work) if "diagram" in work.files else None
    return Observed(request, spectrum, sight, list(fit.components), fit, contributions(fit), chain, diagrams)


def refuse_telescope(request: ObservedRequest, files: Collection[str]) -> None:
    """ValueError for options that a gas cell has no place for."""
    fields = changed_fields(request, _TELESCOPE_INPUTS) + changed_fields(request.spectrum, _BEAM_INPUTS)
    flags = [field.flag for field in fields] + [f"--{name}" for name in _TELESCOPE_FILES if name in files]
    flags += ["--velocity"] if any(request.velocity_km_s or ()) else []
    if flags:
        raise ValueError(f"{flags[0]}: belongs to brightness in K; expected without a spectrum in absorbance")


def cell_fit(spectrum: ObservedSpectrum, request: ObservedRequest, note: Note) -> CellFit:
    """The fit of a gas cell, from numbers that were typed and from the spectrum."""
    from rotor.observed.gas_cell import fit_cell, start_cell

    kelvin, width = _single(request, "excitation_k"), _single(request, "fwhm_km_s")
    species = request.species(spectrum, note)
    columns = request.each_species("column_per_cm2", len(species))
    start = start_cell(spectrum, species, kelvin, width)
    if columns is not None:
        start = [replace(part, column_per_cm2=column) for part, column in zip(start, columns, strict=True)]
    return fit_cell(spectrum, start)


def _single(request: ObservedRequest, name: str) -> float | None:
    """A number that all the gas has in common."""
    values = getattr(request, name)
    if values is not None and len(values) > 1:
        flag = declared_fields(ObservedRequest)[name].flag
        raise ValueError(f"{flag}: {len(values)} numbers; the gas of a cell has one temperature and one width")
    return values[0] if values else None


def _diagrams(spectrum: ObservedSpectrum, fit: SourceFit, work: Work) -> Any:
    """Rotational diagrams of the fitted species; a note for each species without one."""
    from rotor.observed.diagrams import species_diagrams

    diagrams = species_diagrams(spectrum, fit.components, fit.sight)
    for text in diagrams.notes:
        work.note(f"no rotational diagram of {text}")
    return diagrams


def withheld(answer: Observed | Mapped, names: Sequence[str]) -> dict[str, str]:
    """Reason why the picture of diagrams is not written; the fit is still printed."""
    empty = isinstance(answer, Observed) and answer.diagrams is not None and not answer.diagrams.names
    return {"diagram": "no species has a rotational diagram"} if empty and "diagram" in names else {}


def _fitted(
    spectrum: ObservedSpectrum, components: Sequence[Component], sight: Sight, request: ObservedRequest
) -> SourceFit:
    from rotor.observed.fit import fit_source

    choices = request.choices
    if request.reject is None:
        return fit_source(spectrum, components, sight, choices)
    from rotor.observed.channels import fit_rejecting

    return fit_rejecting(spectrum, components, sight, choices, deviations=request.reject)


def draw(answer: Observed, path: Path, report: Report) -> None:
    """Draw pages of panels with the spectrum and the model."""
    from rotor.plots.spectra.overlay import plot_overlay

    plot_overlay(answer.spectrum, answer.components, path, sight=answer.sight, provenance=report.command)


def profile(answer: Observed, _: Report) -> Columns:
    """Observed and modelled brightness."""
    from rotor.observed.overlay_table import overlay_table

    return overlay_table(answer.spectrum, answer.components, answer.sight)


LEFT = frozenset({"species", "parameter"})


def draw_diagrams(answer: Observed, path: Path, report: Report) -> None:
    """Write the points of all diagrams as CSV, or draw them."""
    if path.suffix.lower() == ".csv":
        from rotor.formats import write

        write(answer.diagrams, path, settings=dict(report.provenance))
        return
    from rotor.plots.spectra.diagrams import plot_diagrams

    plot_diagrams(answer.diagrams, path, report.command)


def draw_corner(answer: Observed, path: Path, report: Report) -> None:
    """Draw the sample of every pair of parameters."""
    from rotor.plots.spectra.diagrams import plot_corner

    plot_corner(answer.chain, path, report.command)


def show(answer: Observed | Mapped, report: Report) -> Iterable[Part | None]:
    """The spectrum and the model, or the fit."""
    if not isinstance(answer, Observed):
        yield from _map_parts(report.content)
        return
    yield spectrum_facts(report.content["spectrum"])
    if answer.fit is None:
        yield record_table("model", _MODEL, answer.components, LEFT)
    else:
        yield from _fit_parts(answer.fit, answer.needed, answer.chain)
    if answer.diagrams is not None:
        title = "rotational diagrams, corrected for optical depth"
        yield record_table(title, _DIAGRAMS, answer.diagrams.facts(), LEFT)


_MODEL = {
    "species": "{0.species.name}",
    "N (1/cm²)": "{0.column_per_cm2:.4g}",
    "T_ex (K)": "{0.excitation_k:.4g}",
    "v (km/s)": "{0.velocity_km_s:.3f}",
    "Δv (km/s)": "{0.fwhm_km_s:.3f}",
}
POOR = 4.0  # χ²/ν beyond which residuals are twice the noise
_DIAGRAMS = {
    "species": "{species}",
    "lines": "{lines}",
    "T (K)": "{excitation_k:.4g} ± {excitation_error_k:.2g}",
    "N (1/cm²)": "{column_per_cm2:.4g} ± {column_error_per_cm2:.2g}",
    "χ²": "{chi_squared:.3g}",
}
_NEEDED = {
    "species": "{0.species}",
    "Δχ²": "{0.signal:.1f}",
    "needed": lambda part: "yes" if part.needed else "no",
    "limit, 3σ (1/cm²)": "{0.limit_per_cm2:.3g}",
    "at T_ex (K)": "{0.limit_excitation_k:.4g}",
}


def _fit_parts(fit: SourceFit, needed: Sequence[Contribution], chain: Any) -> Iterable[Part | None]:
    chi = f"{fit.reduced_chi_squared:.4g}, {fit.degrees_of_freedom} degrees of freedom"
    if fit.reduced_chi_squared > POOR:
        chi += "; the model does not describe the spectrum: add species, or give other starting values (--velocity, --width) or --reject"
    yield [("fit", fit.minimum.reason), ("χ²/ν", chi)]
    yield _parameter_table(fit)
    yield record_table("what each species contributes", _NEEDED, needed, LEFT)
    facts = [("undetermined", combination.text) for combination in fit.statistics.undetermined]
    yield facts if chain is None else [*facts, ("sample", chain.text)]


def _parameter_table(fit: SourceFit) -> Table:
    def end(side: int) -> Callable[[Any], str]:
        return lambda row: f"{row['interval'][side]:.5g}" if row["determined"] else ""

    columns = {
        "parameter": "{name}",
        "value": "{value:.5g}",
        "error": lambda row: f"{row['error']:.2g}" if row["determined"] else "undetermined",
        "from": end(0),
        "to": end(1),
    }
    return record_table("fitted parameters, intervals of 68 %", columns, fit.parameters, LEFT)


OBSERVED = Tool(
    name="emission",
    about="A model over an observed spectrum, or the source that describes it best.",
    examples="",
    request=ObservedRequest,
    of="names",
    answer=answer,
    table=lambda answer: answer.table,
    show=show,
    outputs=(
        table_file("csv", "the lines, or the fitted parameters,", rule=SINGLE),
        table_file("parquet", "them", rule=SINGLE),
        table_file("profile_csv", "observed and modelled brightness", of=profile, rule=SINGLE),
        Output("plot", PICTURES, "Draw pages of panels", draw, rule=SINGLE),
        Output("diagram", (".csv", *PICTURES), "Rotational diagrams of the fitted species as CSV or picture", draw_diagrams,
               rule=SINGLE_FIT),
        Output("corner", PICTURES, "Draw the sample of every pair of parameters (extra sampling)", draw_corner,
               rule=Rule(("sample",), SINGLE.excludes, "a picture of draws")),
        Output("maps", (".fits",), "Fit every pixel of a cube and write maps of the parameters", write_maps_of_fit,
               rule=Rule(("fit",), why="belongs to a cube")),
    ),
    check=refuse_corner,
    withheld=withheld,
    workers="rows of a cube",
    instead="--over, --fit and their options",
)  # fmt: skip
