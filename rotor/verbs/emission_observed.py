"""`rotor emission --over` and `--fit`: a model over an observed spectrum, and the source that describes it best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.reports.screen import Table, show_facts, show_table
from rotor.requests.field import all_fields, check_fields, declared, identical, own_fields, part
from rotor.requests.readers import INFINITE, NameList, Quantity, Text, Whole
from rotor.spectra.emission_request import LayerInput, WindowInput
from rotor.verbs.observed_file import (
    PANEL,
    SeveralInput,
    SpectrumFile,
    json_of,
    padded,
    species_of,
    spectrum_facts,
)
from rotor.verbs.tool import Tool
from rotor.verbs.verb import PICTURES, Output, Report, Work

if TYPE_CHECKING:
    from rotor.observed.fit import Contribution, SourceFit
    from rotor.observed.model import Component, Sight
    from rotor.observed.spectrum import ObservedSpectrum
    from rotor.table import Table as Columns

FREE = {
    "column": "column_per_cm2",
    "excitation": "excitation_k",
    "velocity": "velocity_km_s",
    "width": "fwhm_km_s",
    "size": "size_arcsec",
}


OF_FIT = ("free", "shared", "sample", "calibration", "reject")


def of_layer(name: str) -> Any:
    """A field of the gas of a source, None where it is not typed: a fit estimates it."""
    field = own_fields(LayerInput)[name]
    return declared(None, field.reader, field.help, field.key, option=field.option, panel=field.panel)


@dataclass(frozen=True)
class ObservedRequest:
    """What is laid over a spectrum or fitted to it."""

    sources: SeveralInput = part(SeveralInput, identical, identical, SeveralInput())
    over: str | None = declared(
        None, Text(metavar="FILE"), "Observed spectrum (FITS, text) under the model", panel=PANEL
    )
    fit: str | None = declared(
        None, Text(metavar="FILE"), "Observed spectrum to which the source is fitted", panel=PANEL
    )
    catalogue: str | None = declared(
        None, Text(metavar="FILE"), "Local catalogue that SOURCE names species of", panel=PANEL
    )
    free: tuple[str, ...] = declared(
        (), NameList(tuple(FREE)), "Fitted of column, excitation, velocity, width, size", panel=PANEL
    )
    shared: tuple[str, ...] = declared(
        (), NameList(tuple(FREE)), "Fitted alike for all species: velocity,width", panel=PANEL
    )
    calibration: float = declared(
        0.0, Quantity(least=0, most=1), "Error of the intensity scale, a fraction", panel=PANEL
    )
    reject: float | None = declared(
        None, Quantity(), "Fit near lines only, without channels X standard deviations above the model", panel=PANEL
    )
    sample: int = declared(0, Whole(0), "Steps of emcee after the fit (extra sampling)", panel=PANEL)
    spectrum: SpectrumFile = part(SpectrumFile, identical, identical, SpectrumFile())
    column_per_cm2: tuple[float, ...] | None = of_layer("column_per_cm2")
    excitation_k: tuple[float, ...] | None = of_layer("excitation_k")
    velocity_km_s: tuple[float, ...] | None = of_layer("velocity_km_s")
    fwhm_km_s: tuple[float, ...] | None = of_layer("fwhm_km_s")
    background_k: float | None = of_layer("background_k")
    redshift: float | None = of_layer("redshift")
    range_mhz: tuple[float, float] = part(
        WindowInput, lambda value, _: value.range_mhz or value.band, lambda value, _: WindowInput(value), INFINITE,
        single=True, why="give one of them",
    )  # fmt: skip

    @property
    def names(self) -> tuple[str, ...]:
        """The molecules, as they are named."""
        return self.sources.names

    def __post_init__(self) -> None:
        check_fields(self)
        if self.over is not None and self.fit is not None:
            raise ValueError(
                "--over, --fit: both name a spectrum; expected one of them (a fit is laid over its spectrum)"
            )
        declared_here, file = own_fields(ObservedRequest), all_fields(SpectrumFile).values()
        named = [declared_here[name].flag for name in OF_FIT if getattr(self, name) != declared_here[name].default]
        if named and self.fit is None:
            raise ValueError(f"{named[0]}: belongs to a fit; expected with --fit FILE")
        named = [field.flag for field in file if getattr(self.spectrum, field.name) != field.default]
        if self.over is None and self.fit is None:
            raise ValueError(
                f"{(named or ['--catalogue'])[0]}: belongs to an observed spectrum; expected with --over or --fit"
            )
        if not self.names:
            raise ValueError("SOURCE: expected one molecule or several, such as 'rotor emission CO HCN --band ALMA3'")


@dataclass(frozen=True)
class Observed:
    """A spectrum with the model of its source. fit: where one was requested, with what each species contributes and a sample of it."""

    request: ObservedRequest
    spectrum: ObservedSpectrum
    sight: Sight
    components: Sequence[Component]
    fit: SourceFit | None = None
    needed: Sequence[Contribution] = ()
    chain: Any = None

    @property
    def table(self) -> Columns:
        """Fitted parameters, or the modelled lines."""
        from rotor.observed.overlay_table import line_table

        return line_table(self.spectrum, self.components, self.sight) if self.fit is None else self.fit

    def facts(self) -> dict[str, Any]:
        """Spectrum and model, by the keys of docs/verbs."""
        import numpy as np

        from rotor.observed.fit import component_facts
        from rotor.observed.model import model

        content: dict[str, Any] = {"spectrum": json_of(self.spectrum)}
        if self.fit is None:
            modelled = model(self.components, self.spectrum.frequency_mhz, self.sight).brightness_k
            content["components"] = [component_facts(component) for component in self.components]
            return content | {"rms_k": float(np.sqrt(np.mean((self.spectrum.intensity - modelled) ** 2)))}
        content |= self.fit.facts()
        names = ("species", "signal", "needed", "limit_per_cm2")
        content["contributions"] = [
            {name: getattr(contribution, name) for name in names} for contribution in self.needed
        ]
        return content if self.chain is None else content | {"sample": self.chain.facts()}


def answer(request: ObservedRequest, work: Work) -> Observed:
    """Read the spectrum, then model or fit it."""
    spectrum = request.spectrum.read(request.fit or request.over or "", request.range_mhz)
    redshift = request.redshift or 0.0
    background = (
        own_fields(LayerInput)["background_k"].default if request.background_k is None else request.background_k
    )
    sight = request.spectrum.sight(spectrum, background, redshift)
    reach, partition = padded(spectrum, redshift), request.sources.partition
    species = species_of(request.names, request.catalogue, reach, partition, work.note)
    for each in species:
        if "note" in each.identity:
            work.note(f"{each.name}: {each.identity['note']}")
    components = _components(spectrum, species, sight, request)
    if request.fit is None:
        return Observed(request, spectrum, sight, components)
    from rotor.observed.fit import contributions

    fit = _fitted(spectrum, components, sight, request)
    chain = None
    if request.sample:
        from rotor.observed.sampling import sample_source

        chain = sample_source(fit, request.sample)
    return Observed(request, spectrum, sight, list(fit.components), fit, contributions(fit), chain)


def _components(
    spectrum: ObservedSpectrum, species: Sequence[Any], sight: Sight, request: ObservedRequest
) -> list[Component]:
    """Of the options, where they were typed; of a fit the rest is estimated from the spectrum."""
    from dataclasses import replace

    from rotor.observed.model import Component
    from rotor.observed.start import start_components

    count, size = len(species), request.spectrum.size_arcsec
    typed = {name: _each(name, request, count) for name in FREE.values() if name != "size_arcsec"}
    if request.fit is None:
        defaults = {name: own_fields(LayerInput)[name].default * count for name in typed}
        values = {name: each or defaults[name] for name, each in typed.items()}
        rows: list[dict[str, Any]] = [{name: each[k] for name, each in values.items()} for k in range(count)]
        return [Component(each, **row, size_arcsec=size) for each, row in zip(species, rows, strict=True)]
    first = {name: (values[0] if values else None) for name, values in typed.items()}
    del first["column_per_cm2"]
    start = start_components(spectrum, species, sight, **first, size_arcsec=size)
    changes = [{name: values[k] for name, values in typed.items() if values} for k in range(count)]
    return [replace(component, **change) for component, change in zip(start, changes, strict=True)]  # type: ignore[arg-type]


def _each(name: str, request: ObservedRequest, count: int) -> tuple[float, ...] | None:
    """One number for each species, or one for all."""
    values: tuple[float, ...] | None = getattr(request, name)
    if values is not None and len(values) not in (1, count):
        flag, text = own_fields(LayerInput)[name].flag, ",".join(f"{number:g}" for number in values)
        raise ValueError(f"{flag} {text}: {len(values)} numbers for {count} species; expected one for all or one each")
    return values * count if values is not None and len(values) == 1 else values


def _fitted(
    spectrum: ObservedSpectrum, components: Sequence[Component], sight: Sight, request: ObservedRequest
) -> SourceFit:
    from rotor.observed.fit import FitChoices, fit_source
    from rotor.observed.variables import DEFAULT_FREE

    free, shared = (tuple(FREE[word] for word in words) for words in (request.free, request.shared))
    choices = FitChoices(free=free or DEFAULT_FREE, shared=shared, calibration=request.calibration)
    if request.reject is None:
        return fit_source(spectrum, components, sight, choices)
    from rotor.observed.channels import fit_rejecting

    return fit_rejecting(spectrum, components, sight, choices, deviations=request.reject)


def draw(answer: Observed, path: Path, report: Report) -> None:
    """Pages of panels."""
    from rotor.plots.overlay import plot_overlay

    plot_overlay(answer.spectrum, answer.components, path, sight=answer.sight, provenance=report.command)


def profile(answer: Observed) -> Columns:
    """Observed and modelled brightness."""
    from rotor.observed.overlay_table import overlay_table

    return overlay_table(answer.spectrum, answer.components, answer.sight)


LEFT = frozenset({"species", "parameter"})


def show(answer: Observed, _: Report) -> None:
    """Print the spectrum and the model, or the fit."""
    show_facts(spectrum_facts(answer.spectrum))
    print()
    if answer.fit is None:
        columns = ("species", "N (1/cm²)", "T_ex (K)", "v (km/s)", "Δv (km/s)")
        show_table(Table("model", columns, [_component_cells(component) for component in answer.components], LEFT))
    else:
        _show_fit(answer.fit, answer.needed, answer.chain)


def _component_cells(component: Component) -> tuple[str, ...]:
    gas = f"{component.column_per_cm2:.4g}", f"{component.excitation_k:.4g}"
    return component.species.name, *gas, f"{component.velocity_km_s:.3f}", f"{component.fwhm_km_s:.3f}"


def _show_fit(fit: SourceFit, needed: Sequence[Contribution], chain: Any) -> None:
    chi = f"{fit.reduced_chi_squared:.4g}, {fit.degrees_of_freedom} degrees of freedom"
    show_facts([("fit", fit.minimum.reason), ("χ²/ν", chi)])
    print()
    show_table(_parameter_table(fit))
    print()
    rows = [(each.species, f"{each.signal:.1f}", "yes" if each.needed else "no", _limit(each)) for each in needed]
    columns = ("species", "Δχ²", "needed", "limit, 3σ (1/cm²)")
    show_table(Table("what each species contributes", columns, rows, LEFT))
    facts = [("undetermined", combination.text) for combination in fit.statistics.undetermined]
    for part_ in (facts, [] if chain is None else [("sample", chain.text)]):
        if part_:
            print()
            show_facts(part_)


def _limit(contribution: Contribution) -> str:
    return "" if contribution.limit_per_cm2 is None else f"{contribution.limit_per_cm2:.3g}"


def _parameter_table(fit: SourceFit) -> Table:
    rows = []
    for row in fit.parameters:
        ends = [f"{end:.5g}" if row["determined"] else "" for end in row["interval"]]
        error = f"{row['error']:.2g}" if row["determined"] else "undetermined"
        rows.append((row["name"], f"{row['value']:.5g}", error, *ends))
    columns = ("parameter", "value", "error", "from", "to")
    return Table("fitted parameters, intervals of 68 %", columns, rows, LEFT)


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
        Output("csv", (".csv",), "Write the lines, or the fitted parameters, as CSV"),
        Output("parquet", (".parquet",), "Write them as Parquet"),
        Output("profile_csv", (".csv",), "Write observed and modelled brightness as CSV", of=profile),
        Output("plot", PICTURES, "Draw pages of panels", draw),
    ),
    instead="--over and --fit",
)
