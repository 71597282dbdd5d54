"""Scenes of rotational lines."""

from __future__ import annotations

import math
from collections.abc import Mapping
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING

from rotor.scenes import kind
from rotor.scenes.kind import Kind, Where, Writer
from rotor.scenes.molecule import top_of, with_dipole
from rotor.scenes.scene import SpectrumScene, molecule_of
from rotor.scenes.sections import (
    BasisNumerics,
    MoleculeSection,
    SpectrumConditions,
    SpectrumObservables,
)
from rotor.spectra.request import GasLayer, SpectrumAnswer, SpectrumRequest, answer_spectrum

if TYPE_CHECKING:
    from rotor.spectra.lines import Lines

_NAMES = {
    "temperature_k": "conditions.temperature", "range_mhz": "conditions.range", "jmax": "numerics.jmax",
    "min_lgint": "observables.min_lgint", "q": "observables.q", "fwhm_mhz": "observables.fwhm",
    "vibrational_factor": "observables.vibrational_factor", "profile": "observables.profile",
    "pressure_bar": "conditions.pressure", "path_cm": "conditions.path",
}  # fmt: skip


def request(scene: SpectrumScene, folder: Where = ".") -> SpectrumRequest:
    """The request of a scene."""
    molecule = molecule_of(scene)
    assert molecule is not None
    top = with_dipole(top_of(molecule, folder))
    asked, gas = scene.observables, scene.conditions
    fwhm = None if asked.fwhm is None else kind.quantity("observables.fwhm", asked.fwhm, "MHz")
    with kind.fields(**_NAMES):
        return SpectrumRequest(
            top,
            temperature_k=kind.quantity("conditions.temperature", gas.temperature, "K"),
            jmax=scene.numerics.jmax,
            min_lgint=kind.cut("observables.min_lgint", asked.min_lgint),
            range_mhz=kind.frequencies("conditions.range", gas.range),
            q=asked.q,
            vibrational_factor=asked.vibrational_factor,
            vibrations=kind.vibrations(scene.vibration),
            profile=asked.profile,
            fwhm_mhz=fwhm,
            layer=_layer(gas),
            untrusted=asked.untrusted,
            effects=kind.effects_of(top, scene.effects, molecule),
        )


def _layer(gas: SpectrumConditions) -> GasLayer | None:
    if gas.pressure is None and gas.path is None:
        return None
    if gas.pressure is None or gas.path is None:
        raise ValueError("conditions.pressure and conditions.path: an optical depth needs both")
    pressure = kind.quantity("conditions.pressure", gas.pressure, "bar")
    return GasLayer(pressure, kind.quantity("conditions.path", gas.path, "cm"))


def answer(asked: SpectrumRequest, scene: SpectrumScene, out: Where, executor: Executor | None) -> SpectrumAnswer:
    """The lines.

    Parameters
    ----------
    asked : SpectrumRequest
        The scene as the library takes it, checked.
    scene : SpectrumScene
        Not used.
    out : path
        Not used.
    executor : Executor or None
        Its workers share the work.

    Returns
    -------
    SpectrumAnswer
        Lines, and a spectrum where one is asked for.
    """
    return answer_spectrum(asked, executor)


def table(found: SpectrumAnswer) -> Lines:
    """All lines."""
    return found.lines


def writers(found: SpectrumAnswer, scene: SpectrumScene) -> Mapping[str, Writer]:
    """Catalogue, profile and picture."""
    from rotor.formats import write

    def catalogue(path: Path) -> None:
        write(found.lines, path, settings={"tag": scene.outputs.tag})

    def profile(path: Path) -> None:
        write(found.spectrum, path)

    def plot(path: Path) -> None:
        from rotor.plots.spectrum import plot_spectrum

        plot_spectrum(found.lines if found.request.shape == "sticks" else found.spectrum, path, provenance={})

    return {"cat": catalogue, "profile_csv": profile, "plot": plot}


def saved(asked: SpectrumRequest, molecule: MoleculeSection | None) -> SpectrumScene:
    """The scene of a request."""
    assert molecule is not None
    first, last = asked.range_mhz
    layer = asked.layer
    return SpectrumScene(
        molecule=molecule,
        effects=kind.saved_effects(asked.effects, asked.top),
        conditions=SpectrumConditions(
            temperature=f"{asked.temperature_k!r} K",
            range=None if math.isinf(last) and first == 0.0 else f"{first!r}:{last!r} MHz",
            pressure=None if layer is None else f"{layer.pressure_bar!r} bar",
            path=None if layer is None else f"{layer.path_cm!r} cm",
        ),
        observables=SpectrumObservables(
            min_lgint="none" if asked.min_lgint is None else asked.min_lgint,
            profile=asked.profile,
            fwhm=None if asked.fwhm_mhz is None else f"{asked.fwhm_mhz!r} MHz",
            untrusted=asked.untrusted,
            q=asked.q,
            vibrational_factor=asked.vibrational_factor,
        ),
        vibration=kind.saved_vibrations(asked.vibrations),
        numerics=BasisNumerics(jmax=asked.jmax),
    )


KIND = Kind(request, answer, table, saved, writers, names=_NAMES)
