"""Scenes of a source with one or several molecules, as a radio telescope sees it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from rotor.scenes import kind
from rotor.scenes.kind import Kind, Where, Writer
from rotor.scenes.molecule import named, top_of, with_dipole
from rotor.scenes.scene import EmissionScene, within
from rotor.scenes.sections import (
    EmissionConditions,
    EmissionObservables,
    EmittingMolecule,
    MoleculeSection,
    QuantumEffects,
)
from rotor.spectra.emission import Source, band_mhz
from rotor.spectra.emission_request import EmissionAnswer, EmissionLines, EmissionRequest, answer_emission
from rotor.spectra.emitters import CatalogueLines
from rotor.tops.top import Top

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect

_NAMES = {
    "columns_per_cm2": "molecules.column", "column_per_cm2": "molecules.column", "excitation_k": "conditions.excitation",
    "background_k": "conditions.background", "filling": "conditions.filling", "velocity_km_s": "conditions.velocity",
    "fwhm_km_s": "conditions.width", "redshift": "conditions.redshift", "range_mhz": "conditions.range",
    "least_depth": "observables.least_depth",
}  # fmt: skip


def request(scene: EmissionScene, folder: Where = ".") -> EmissionRequest:
    """The request of a scene."""
    if not scene.molecules:
        raise ValueError("molecules: expected one molecule or more")
    molecules = tuple(
        named(f"molecules[{number}]", lambda one=one: _molecule(one, folder))  # type: ignore[misc]
        for number, one in enumerate(scene.molecules)
    )
    with kind.fields(**_NAMES):
        return EmissionRequest(
            molecules,
            tuple(_source(one, scene.conditions) for one in scene.molecules),
            _range(scene.conditions),
            scene.observables.least_depth,
            _effects(scene, molecules),
        )


def _molecule(section: EmittingMolecule, folder: Where) -> Top | CatalogueLines:
    """A top with a dipole, or the lines of a .cat file."""
    if section.source is None or not section.source.lower().endswith((".cat", ".cat.gz")):
        if section.partition is not None:
            raise ValueError("partition: is Q(T) of a .cat file, and the source is none")
        return with_dipole(top_of(section, folder))
    from rotor.formats.catalogue.cat_species import read_cat_with

    table = section.partition
    if table is not None and "=" not in table:
        table = str(within(folder, table))
    return read_cat_with(within(folder, section.source), table)


def _source(section: EmittingMolecule, layer: EmissionConditions) -> Source:
    """The source of a molecule; what it leaves open is that of the conditions."""

    def value(name: str) -> Any:
        return getattr(layer if getattr(section, name) is None else section, name)

    return Source(
        column_per_cm2=section.column,
        excitation_k=kind.quantity("conditions.excitation", value("excitation"), "K"),
        fwhm_km_s=value("width"),
        velocity_km_s=value("velocity"),
        background_k=kind.quantity("conditions.background", layer.background, "K"),
        filling=layer.filling,
        redshift=layer.redshift,
    )


def _effects(scene: EmissionScene, molecules: Sequence[Top | CatalogueLines]) -> tuple[tuple[QuantumEffect, ...], ...]:
    """The Hamiltonian of each molecule; with hyperfine those are split whose constants of spins are known, if there are such."""
    wanted = scene.effects
    known = [isinstance(top, Top) and top.spin_constants is not None for top in molecules]
    each = [
        msgspec.structs.replace(wanted, hyperfine=False, hyperfine_method="exact") if any(known) and not has else wanted
        for has in known
    ]
    return tuple(
        kind.effects_of(top, own, one) if isinstance(top, Top) else ()
        for top, own, one in zip(molecules, each, scene.molecules, strict=True)
    )


def _range(seen: EmissionConditions) -> tuple[float, float]:
    if (seen.range is None) == (seen.band is None):
        raise ValueError("conditions.range, conditions.band: give one of them")
    if seen.band is not None:
        band = seen.band
        return named("conditions.band", lambda: band_mhz(band))
    return kind.frequencies("conditions.range", seen.range)


def answer(asked: EmissionRequest, scene: EmissionScene, out: Where, executor: Executor | None) -> EmissionAnswer:
    """The lines.

    Parameters
    ----------
    asked : EmissionRequest
        The scene as the library takes it, checked.
    scene : EmissionScene
        Not used.
    out : path
        Not used.
    executor : Executor or None
        Not used.

    Returns
    -------
    EmissionAnswer
        Lines and the spectrum of all molecules together.
    """
    return answer_emission(asked)


def table(found: EmissionAnswer) -> EmissionLines:
    """All lines."""
    return found.lines


def writers(found: EmissionAnswer, scene: EmissionScene) -> Mapping[str, Writer]:
    """Profile and picture."""
    from rotor.formats import write

    def profile(path: Path) -> None:
        write(found.spectrum, path)

    def plot(path: Path) -> None:
        from rotor.plots.emission import plot_emission

        plot_emission(found, path, provenance={})

    return {"profile_csv": profile, "plot": plot}


def saved(asked: EmissionRequest, molecule: MoleculeSection | None) -> EmissionScene:
    """The scene of a request of one molecule; `saved_molecules` is for several."""
    assert molecule is not None
    return saved_molecules(asked, (molecule,))


def saved_molecules(asked: EmissionRequest, molecules: Sequence[MoleculeSection]) -> EmissionScene:
    """The scene of a request, its molecules given."""
    layer, (first, last) = asked.sources[0], asked.range_mhz
    given = [
        EmittingMolecule(
            **{name: getattr(one, name) for name in one.__struct_fields__ if name in MoleculeSection.__struct_fields__},
            column=source.column_per_cm2,
            partition=getattr(one, "partition", None),
            **_departures(source, layer),
        )
        for one, source in zip(molecules, asked.sources, strict=True)
    ]
    tops = [(own, top) for own, top in zip(asked.effects, asked.molecules, strict=False) if isinstance(top, Top)]
    saved_each = [kind.saved_effects(own, top) for own, top in tops]
    effects = next((one for one in saved_each if one.hyperfine is not None), QuantumEffects())

    return EmissionScene(
        molecules=given,
        effects=effects,
        conditions=EmissionConditions(
            excitation=f"{layer.excitation_k!r} K",
            background=f"{layer.background_k!r} K",
            filling=layer.filling,
            velocity=layer.velocity_km_s,
            redshift=layer.redshift,
            width=layer.fwhm_km_s,
            range=f"{first!r}:{last!r} MHz",
        ),
        observables=EmissionObservables(least_depth=asked.least_depth),
    )


def _departures(source: Source, layer: Source) -> dict[str, Any]:
    """What a molecule has otherwise than the first, by the keys of its section."""
    said = {
        "excitation": (f"{source.excitation_k!r} K", source.excitation_k != layer.excitation_k),
        "velocity": (source.velocity_km_s, source.velocity_km_s != layer.velocity_km_s),
        "width": (source.fwhm_km_s, source.fwhm_km_s != layer.fwhm_km_s),
    }
    return {name: value for name, (value, differs) in said.items() if differs}


KIND = Kind(request, answer, table, saved, writers, names=_NAMES)
