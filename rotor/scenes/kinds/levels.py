"""Scenes of energy levels."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from pathlib import Path

from rotor.quantum.request import LevelsAnswer, LevelsRequest, SelectedLevels, answer_levels
from rotor.scenes import kind
from rotor.scenes.kind import Kind, Where, Writer
from rotor.scenes.molecule import top_of
from rotor.scenes.scene import LevelsScene, molecule_of
from rotor.scenes.sections import LevelsObservables, MoleculeSection


def request(scene: LevelsScene, folder: Where = ".") -> LevelsRequest:
    """The request of a scene."""
    molecule = molecule_of(scene)
    assert molecule is not None
    top, asked = top_of(molecule, folder), scene.observables
    highest = None if asked.max_energy is None else kind.quantity("observables.max_energy", asked.max_energy, "MHz")
    names = {name: f"observables.{name}" for name in ("jmin", "jmax", "kmin", "kmax")}
    with kind.fields(**names, max_energy_mhz="observables.max_energy"):
        return LevelsRequest(
            top,
            jmax=asked.jmax,
            jmin=asked.jmin,
            kmin=asked.kmin,
            kmax=asked.kmax,
            max_energy_mhz=highest,
            effects=kind.effects_of(top, scene.effects, molecule),
        )


def answer(asked: LevelsRequest, scene: LevelsScene, out: Where, executor: Executor | None) -> LevelsAnswer:
    """The levels.

    Parameters
    ----------
    asked : LevelsRequest
        The scene as the library takes it, checked.
    scene : LevelsScene
        Not used.
    out : path
        Not used.
    executor : Executor or None
        Its workers share the work.

    Returns
    -------
    LevelsAnswer
        Levels with their energies.
    """
    return answer_levels(asked, executor)


def table(found: LevelsAnswer) -> SelectedLevels:
    """The levels asked for."""
    return found.table


def writers(found: LevelsAnswer, scene: LevelsScene) -> Mapping[str, Writer]:
    """List of SPCAT, and term diagram."""

    def levels(path: Path) -> None:
        from rotor.formats import write

        write(found.table, path)

    def plot(path: Path) -> None:
        from rotor.plots.levels import plot_levels

        plot_levels(found.table, found.request.top, path, provenance={})

    return {"egy": levels, "plot": plot}


def saved(asked: LevelsRequest, molecule: MoleculeSection | None) -> LevelsScene:
    """The scene of a request."""
    assert molecule is not None
    highest = None if asked.max_energy_mhz is None else f"{asked.max_energy_mhz!r} MHz"
    return LevelsScene(
        molecule=molecule,
        effects=kind.saved_effects(asked.effects, asked.top),
        observables=LevelsObservables(
            jmin=asked.jmin, jmax=asked.jmax, kmin=asked.kmin, kmax=asked.kmax, max_energy=highest
        ),
    )


KIND = Kind(request, answer, table, saved, writers)
