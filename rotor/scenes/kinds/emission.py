"""Scenes of a source with one or several molecules, as a radio telescope sees it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from rotor.scenes import kind
from rotor.scenes.kind import Kind, Where, Writer
from rotor.scenes.molecule import named, top_of, with_dipole
from rotor.scenes.scene import EmissionScene
from rotor.scenes.sections import (
    EmissionConditions,
    EmissionObservables,
    EmittingMolecule,
    MoleculeSection,
    QuantumEffects,
)
from rotor.spectra.emission import Source, band_mhz
from rotor.spectra.emission_request import EmissionAnswer, EmissionLines, EmissionRequest, answer_emission

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top

_NAMES = {
    "columns_per_cm2": "molecules.column", "column_per_cm2": "molecules.column", "excitation_k": "conditions.excitation",
    "background_k": "conditions.background", "filling": "conditions.filling", "velocity_km_s": "conditions.velocity",
    "fwhm_km_s": "conditions.width", "range_mhz": "conditions.range", "least_depth": "observables.least_depth",
}  # fmt: skip


def request(scene: EmissionScene, folder: Where = ".") -> EmissionRequest:
    """The request of a scene."""
    if not scene.molecules:
        raise ValueError("molecules: expected one molecule or more")
    tops = tuple(
        named(f"molecules[{number}]", lambda one=one: with_dipole(top_of(one, folder)))  # type: ignore[misc]
        for number, one in enumerate(scene.molecules)
    )
    seen = scene.conditions
    with kind.fields(**_NAMES):
        return EmissionRequest(
            tops,
            tuple(one.column for one in scene.molecules),
            Source(
                column_per_cm2=scene.molecules[0].column,
                excitation_k=kind.quantity("conditions.excitation", seen.excitation, "K"),
                fwhm_km_s=seen.width,
                velocity_km_s=seen.velocity,
                background_k=kind.quantity("conditions.background", seen.background, "K"),
                filling=seen.filling,
            ),
            _range(seen),
            scene.observables.least_depth,
            _effects(scene, tops),
        )


def _effects(scene: EmissionScene, tops: Sequence[Top]) -> tuple[tuple[QuantumEffect, ...], ...]:
    """The Hamiltonian of each molecule; with hyperfine those are split whose constants of spins are known, of which there is one."""
    asked = scene.effects
    known = [top.spin_constants is not None for top in tops]
    each = [
        msgspec.structs.replace(asked, hyperfine=False, hyperfine_method="exact") if any(known) and not has else asked
        for has in known
    ]
    return tuple(kind.effects_of(top, own, one) for top, own, one in zip(tops, each, scene.molecules, strict=True))


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
    source, (first, last) = asked.source, asked.range_mhz
    given = [
        EmittingMolecule(**{name: getattr(one, name) for name in one.__struct_fields__}, column=column)
        for one, column in zip(molecules, asked.columns_per_cm2, strict=True)
    ]
    saved_each = [kind.saved_effects(own, top) for own, top in zip(asked.effects, asked.tops, strict=False)]
    effects = next((one for one in saved_each if one.hyperfine is not None), QuantumEffects())

    return EmissionScene(
        molecules=given,
        effects=effects,
        conditions=EmissionConditions(
            excitation=f"{source.excitation_k!r} K",
            background=f"{source.background_k!r} K",
            filling=source.filling,
            velocity=source.velocity_km_s,
            width=source.fwhm_km_s,
            range=f"{first!r}:{last!r} MHz",
        ),
        observables=EmissionObservables(least_depth=asked.least_depth),
    )


KIND = Kind(request, answer, table, saved, writers, names=_NAMES)
