"""Scenes of a classical gas of free molecules."""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rotor.scenes import kind
from rotor.scenes.kind import Kind, Where, Writer
from rotor.scenes.molecule import top_of
from rotor.scenes.scene import GasScene, molecule_of
from rotor.scenes.sections import GasConditions, GasNumerics, GasObservables, MoleculeSection
from rotor.thermodynamics.classical_gas import GasAnswer, GasRequest, answer_gas, settling_times_ps

if TYPE_CHECKING:
    from rotor.table import Table

_NAMES = {
    "molecules": "numerics.molecules", "seed": "numerics.seed", "temperature_k": "conditions.temperature",
    "confidence": "observables.confidence", "times_ps": "observables.times",
}  # fmt: skip


def request(scene: GasScene, folder: Where = ".") -> GasRequest:
    """The request of a scene."""
    molecule = molecule_of(scene)
    assert molecule is not None
    top, files = top_of(molecule, folder), scene.outputs
    with kind.fields(**_NAMES):
        asked = GasRequest(
            top,
            scene.numerics.molecules,
            kind.quantity("conditions.temperature", scene.conditions.temperature, "K"),
            scene.numerics.seed,
            scene.observables.confidence,
            kind.grid("observables.times", scene.observables.times, "ps"),
        )
    if asked.times_ps is None and any((files.csv, files.parquet, files.json, files.plot)):
        return replace(asked, times_ps=settling_times_ps(top, asked.temperature_k))
    return asked


def answer(asked: GasRequest, scene: GasScene, out: Where, executor: Executor | None) -> GasAnswer:
    """The gas, tested, and its correlation functions on all cores; the answer does not depend on their number.

    Parameters
    ----------
    asked : GasRequest
        The scene as the library takes it, checked.
    scene : GasScene
        Not used.
    out : path
        Not used.
    executor : Executor or None
        Not used.

    Returns
    -------
    GasAnswer
        The test and the correlation functions.
    """
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        return answer_gas(asked, threads)


def table(found: GasAnswer) -> Table:
    """The correlation functions; the degrees of freedom where there are none."""
    return found.test if found.correlations is None else found.correlations


def writers(found: GasAnswer, scene: GasScene) -> Mapping[str, Writer]:
    """The picture of the test and of the correlation functions."""

    def plot(path: Path) -> None:
        from rotor.plots.gas import plot_gas

        facts = found.facts()
        title = f"{found.request.top.name}, {found.request.temperature_k:g} K"
        plot_gas(found.test, found.correlations, path, title=title, plateau=facts["c1_plateau"], provenance={})

    return {"plot": plot}


def saved(asked: GasRequest, molecule: MoleculeSection | None) -> GasScene:
    """The scene of a request."""
    assert molecule is not None
    times = None if asked.times_ps is None else list(asked.times_ps)
    return GasScene(
        molecule=molecule,
        conditions=GasConditions(temperature=f"{asked.temperature_k!r} K"),
        observables=GasObservables(times=times, confidence=asked.confidence),
        numerics=GasNumerics(molecules=asked.molecules, seed=asked.seed),
    )


KIND = Kind(request, answer, table, saved, writers, names=_NAMES)
