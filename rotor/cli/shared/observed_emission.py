"""`rotor emission --over` and `--fit`: a model over an observed spectrum, and the source that describes it best."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.cli.shared import inputs
from rotor.cli.shared.observed_options import (
    SpectrumOptions,
    beam_of,
    json_of,
    padded,
    read_observed,
    size_of,
    species_of,
    spectrum_facts,
)
from rotor.cli.shared.options import option
from rotor.cli.shared.output import Files, Table, deliver, json_text, note, show_facts, show_table

if TYPE_CHECKING:
    from rotor.observed.fit import Contribution, SourceFit
    from rotor.observed.model import Component, Sight
    from rotor.observed.spectrum import ObservedSpectrum

FREE = {
    "column": "column_per_cm2",
    "excitation": "excitation_k",
    "velocity": "velocity_km_s",
    "width": "fwhm_km_s",
    "size": "size_arcsec",
}


@dataclass(frozen=True)
class ObservedOptions:
    """What is laid over a spectrum or fitted to it."""

    over: str | None = option(None, metavar="FILE", help="Observed spectrum (FITS, text) under the model.")
    fit: str | None = option(None, metavar="FILE", help="Observed spectrum to which the source is fitted.")
    catalogue: str | None = option(None, metavar="FILE", help="Local catalogue that SOURCE names species of.")
    free: str | None = option(None, metavar="LIST", help="Fitted of column, excitation, velocity, width, size.")
    shared: str | None = option(None, metavar="LIST", help="Fitted alike for all species: velocity,width.")
    calibration: str | None = option(None, metavar="X", help="Error of the intensity scale, a fraction.")
    reject: float | None = option(
        None, metavar="X", help="Fit near lines only, without channels X standard deviations above the model."
    )
    sample: int = option(0, metavar="N", help="Steps of emcee after the fit (extra sampling).")

    @property
    def file(self) -> str | None:
        """The spectrum, where one is asked for; ValueError for two, and for options without one."""
        if self.over is not None and self.fit is not None:
            raise ValueError(
                "--over, --fit: both name a spectrum; expected one of them (a fit is laid over its spectrum)"
            )
        given = [f"--{name}" for name in ("free", "shared", "sample", "calibration", "reject") if getattr(self, name)]
        if given and self.fit is None:
            raise ValueError(f"{given[0]}: belongs to a fit; expected with --fit FILE")
        return self.over or self.fit


@dataclass(frozen=True)
class EmissionInputs:
    """The options of `rotor emission` as texts, None where they were not typed."""

    sources: Sequence[str]
    column: str | None
    excitation: str | None
    velocity: str | None
    width: str | None
    background: str
    redshift: float
    range_mhz: tuple[float, float] | None
    partition: str | None


def run_observed(
    context: typer.Context, requested: EmissionInputs, given: ObservedOptions, file: SpectrumOptions, files: Files
) -> None:
    """Read, model or fit, and deliver."""
    from rotor.observed.model import Sight

    spectrum = read_observed(given.file or "", file, requested.range_mhz)
    beam = spectrum.beam_arcsec or beam_of(file)
    sight = Sight(
        inputs.quantity("--background", requested.background, "K"),
        None if beam is None else (beam[0] * beam[1]) ** 0.5,
        requested.redshift,
    )
    species = species_of(requested.sources, given.catalogue, padded(spectrum, requested.redshift), requested.partition)
    for one in species:
        if "note" in one.identity:
            note(f"{one.name}: {one.identity['note']}")
    fit, components = None, _components(spectrum, species, sight, requested, given, file)
    if given.fit is not None:
        fit = _fitted(spectrum, components, sight, given)
        components = list(fit.components)
    content, needed, chain = _content(spectrum, components, fit, given, sight, context.obj)
    content["files"] = files.names
    show = lambda: _show(spectrum, components, fit, needed, chain)  # noqa: E731
    deliver(files, _writers(spectrum, components, sight, fit, chain, context.obj), lambda: json_text(content), show)


def _components(
    spectrum: ObservedSpectrum,
    species: Sequence[Any],
    sight: Sight,
    requested: EmissionInputs,
    given: ObservedOptions,
    file: SpectrumOptions,
) -> list[Component]:
    """Of the options, where they were typed; of a fit the rest is estimated from the spectrum."""
    from dataclasses import replace

    from rotor.observed.model import Component
    from rotor.observed.start import start_components

    count = len(species)
    typed = {
        name: _each(f"--{name}", getattr(requested, name), count)
        for name in ("column", "excitation", "velocity", "width")
    }
    size = size_of(file)
    if given.fit is None:
        defaults = {"column": 1e14, "excitation": 100.0, "velocity": 0.0, "width": 1.0}
        values = {name: typed[name] or (default,) * count for name, default in defaults.items()}
        return [
            Component(
                one, values["column"][k], values["excitation"][k], values["velocity"][k], values["width"][k], size
            )
            for k, one in enumerate(species)
        ]
    first = {name: (values[0] if values else None) for name, values in typed.items()}
    start = start_components(
        spectrum,
        species,
        sight,
        velocity_km_s=first["velocity"],
        fwhm_km_s=first["width"],
        excitation_k=first["excitation"],
        size_arcsec=size,
    )
    names = {
        "column": "column_per_cm2",
        "excitation": "excitation_k",
        "velocity": "velocity_km_s",
        "width": "fwhm_km_s",
    }
    changes = [{names[name]: values[k] for name, values in typed.items() if values} for k in range(count)]
    return [replace(one, **change) for one, change in zip(start, changes, strict=True)]  # type: ignore[arg-type]


def _each(name: str, text: str | None, count: int) -> tuple[float, ...] | None:
    """One number for each species, or one for all."""
    from rotor.units import parse_quantity

    if text is None:
        return None
    unit = "K" if name == "--excitation" else ""
    bare = text.replace("cm-2", "").replace("km/s", "")
    values = inputs.parsed(name, bare, lambda value: tuple(parse_quantity(item, unit) for item in value.split(",")))
    if len(values) not in (1, count):
        raise ValueError(f"{name} {text}: {len(values)} numbers for {count} species; expected one for all or one each")
    return values * count if len(values) == 1 else values


def _fitted(
    spectrum: ObservedSpectrum, components: Sequence[Component], sight: Sight, given: ObservedOptions
) -> SourceFit:
    from rotor.observed.fit import FitChoices, fit_source

    calibration = inputs.quantity("--calibration", given.calibration or "0", "fraction")
    free = _names("--free", given.free) or ("column_per_cm2", "excitation_k", "velocity_km_s", "fwhm_km_s")
    choices = FitChoices(free=free, shared=_names("--shared", given.shared), calibration=calibration)
    if given.reject is None:
        return fit_source(spectrum, components, sight, choices)
    from rotor.observed.channels import fit_rejecting

    return fit_rejecting(spectrum, components, sight, choices, deviations=given.reject)


def _names(name: str, text: str | None) -> tuple[str, ...]:
    words = [word.strip() for word in (text or "").split(",") if word.strip()]
    for word in words:
        if word not in FREE:
            raise ValueError(f"{name} {word!r}: expected of {', '.join(FREE)}")
    return tuple(FREE[word] for word in words)


def _content(
    spectrum: ObservedSpectrum,
    components: Sequence[Component],
    fit: SourceFit | None,
    given: ObservedOptions,
    sight: Sight,
    command: str,
) -> tuple[dict[str, Any], list[Contribution], Any]:
    """The JSON, what each species contributes, and the sample."""
    import numpy as np

    from rotor.observed.fit import component_facts, contributions
    from rotor.observed.model import model

    content: dict[str, Any] = {"command": command, "spectrum": json_of(spectrum)}
    if fit is None:
        left = spectrum.intensity - model(components, spectrum.frequency_mhz, sight).brightness_k
        content["components"] = [component_facts(one) for one in components]
        return content | {"rms_k": float(np.sqrt(np.mean(left**2)))}, [], None
    needed = contributions(fit)
    content |= fit.facts()
    content["contributions"] = [
        {"species": one.species, "signal": one.signal, "needed": one.needed, "limit_per_cm2": one.limit_per_cm2}
        for one in needed
    ]
    chain = None
    if given.sample:
        from rotor.observed.sampling import sample_source

        chain = sample_source(fit, given.sample)
        content["sample"] = chain.facts()
    return content, needed, chain


def _writers(
    spectrum: ObservedSpectrum,
    components: Sequence[Component],
    sight: Sight,
    fit: SourceFit | None,
    chain: Any,
    command: str,
) -> Mapping[str, Callable[[Path], None]]:
    import rotor

    settings = {"command": command}

    def draw(path: Path) -> None:
        """Pages of panels."""
        from rotor.plots.overlay import plot_overlay

        plot_overlay(spectrum, components, path, sight=sight, provenance=settings)

    def profile(path: Path) -> None:
        """Observed and modelled brightness."""
        from rotor.observed.overlay_table import overlay_table

        rotor.write(overlay_table(spectrum, components, sight), path, settings=settings)

    def rows(path: Path) -> None:
        """Fitted parameters, or the modelled lines."""
        from rotor.observed.overlay_table import line_table

        rotor.write(fit if fit is not None else line_table(spectrum, components, sight), path, settings=settings)

    return {"--csv": rows, "--parquet": rows, "--profile-csv": profile, "--plot": draw}


def _show(
    spectrum: ObservedSpectrum,
    components: Sequence[Component],
    fit: SourceFit | None,
    needed: Sequence[Contribution],
    chain: Any,
) -> None:
    show_facts(spectrum_facts(spectrum))
    print()
    if fit is None:
        rows = [
            (
                c.species.name,
                f"{c.column_per_cm2:.4g}",
                f"{c.excitation_k:.4g}",
                f"{c.velocity_km_s:.3f}",
                f"{c.fwhm_km_s:.3f}",
            )
            for c in components
        ]
        show_table(
            Table("model", ("species", "N (1/cm²)", "T_ex (K)", "v (km/s)", "Δv (km/s)"), rows, frozenset({"species"}))
        )
        return
    show_facts(
        [
            ("fit", fit.minimum.reason),
            ("χ²/ν", f"{fit.reduced_chi_squared:.4g}, {fit.degrees_of_freedom} degrees of freedom"),
        ]
    )
    print()
    show_table(_parameter_table(fit))
    print()
    seen = [
        (
            one.species,
            f"{one.signal:.1f}",
            "yes" if one.needed else "no",
            "" if one.limit_per_cm2 is None else f"{one.limit_per_cm2:.3g}",
        )
        for one in needed
    ]
    show_table(
        Table(
            "what each species contributes",
            ("species", "Δχ²", "needed", "limit, 3σ (1/cm²)"),
            seen,
            frozenset({"species"}),
        )
    )
    if fit.statistics.undetermined:
        print()
        show_facts([("undetermined", one.text) for one in fit.statistics.undetermined])
    if chain is not None:
        print()
        show_facts([("sample", chain.text)])


def _parameter_table(fit: SourceFit) -> Table:
    rows = []
    for row in fit.parameters:
        low, high = row["interval"]
        error = f"{row['error']:.2g}" if row["determined"] else "undetermined"
        rows.append(
            (
                row["name"],
                f"{row['value']:.5g}",
                error,
                f"{low:.5g}" if row["determined"] else "",
                f"{high:.5g}" if row["determined"] else "",
            )
        )
    return Table(
        "fitted parameters, intervals of 68 %",
        ("parameter", "value", "error", "from", "to"),
        rows,
        frozenset({"parameter"}),
    )
