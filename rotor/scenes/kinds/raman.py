"""Scenes of rotational Raman lines."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from pathlib import Path

from rotor.scenes import kind
from rotor.scenes.kind import Kind, Where, Writer
from rotor.scenes.molecule import top_of
from rotor.scenes.scene import RamanScene, molecule_of
from rotor.scenes.sections import BasisNumerics, MoleculeSection, RamanConditions, RamanObservables
from rotor.spectra.raman import RamanLines
from rotor.spectra.raman_request import RamanAnswer, RamanRequest, answer_raman

_NAMES = {
    "temperature_k": "conditions.temperature", "laser_nm": "conditions.laser", "jmax": "numerics.jmax",
    "min_relative": "observables.min_relative", "q": "observables.q",
}  # fmt: skip


def request(scene: RamanScene, folder: Where = ".") -> RamanRequest:
    """The request of a scene."""
    molecule = molecule_of(scene)
    assert molecule is not None
    top = top_of(molecule, folder)
    if top.polarizability_abc_angstrom3 is None and top.kind != "spherical":
        raise ValueError("molecule.polarizability: it is not known; give it in principal axes (Å³)")
    with kind.fields(**_NAMES):
        return RamanRequest(
            top,
            temperature_k=kind.quantity("conditions.temperature", scene.conditions.temperature, "K"),
            laser_nm=kind.quantity("conditions.laser", scene.conditions.laser, "nm"),
            jmax=scene.numerics.jmax,
            min_relative=kind.cut("observables.min_relative", scene.observables.min_relative),
            q=scene.observables.q,
            vibrations=kind.vibrations(scene.vibration),
            effects=kind.effects_of(top, scene.effects, molecule),
        )


def answer(asked: RamanRequest, scene: RamanScene, out: Where, executor: Executor | None) -> RamanAnswer:
    """The lines.

    Parameters
    ----------
    asked : RamanRequest
        The scene as the library takes it, checked.
    scene : RamanScene
        Not used.
    out : path
        Not used.
    executor : Executor or None
        Its workers share the work.

    Returns
    -------
    RamanAnswer
        Raman lines.
    """
    return answer_raman(asked, executor)


def table(found: RamanAnswer) -> RamanLines:
    """All lines."""
    return found.lines


def writers(found: RamanAnswer, scene: RamanScene) -> Mapping[str, Writer]:
    """The picture."""

    def plot(path: Path) -> None:
        from rotor.plots.raman import plot_raman

        plot_raman(found.lines, path, provenance={})

    return {"plot": plot}


def saved(asked: RamanRequest, molecule: MoleculeSection | None) -> RamanScene:
    """The scene of a request."""
    assert molecule is not None
    return RamanScene(
        molecule=molecule,
        effects=kind.saved_effects(asked.effects, asked.top),
        conditions=RamanConditions(temperature=f"{asked.temperature_k!r} K", laser=f"{asked.laser_nm!r} nm"),
        observables=RamanObservables(
            min_relative="none" if asked.min_relative is None else asked.min_relative, q=asked.q
        ),
        vibration=kind.saved_vibrations(asked.vibrations),
        numerics=BasisNumerics(jmax=asked.jmax),
    )


KIND = Kind(request, answer, table, saved, writers, names=_NAMES)
