"""Scenes of levels in a static magnetic field."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rotor.quantum.fields.field_map import FieldMap
from rotor.quantum.fields.zeeman_request import ZeemanAnswer, ZeemanRequest, answer_zeeman
from rotor.scenes import kind
from rotor.scenes.kind import Kind, Where, Writer
from rotor.scenes.molecule import GIVEN, named, top_of
from rotor.scenes.scene import ZeemanScene, molecule_of
from rotor.scenes.sections import (
    FieldEffects,
    MagneticSection,
    MoleculeSection,
    ZeemanConditions,
    ZeemanNumerics,
    ZeemanObservables,
)
from rotor.tops.magnetic import MagneticTensors, Tensor, tensor_for

if TYPE_CHECKING:
    from rotor.tops.top import Top

_NAMES = {
    "fields_tesla": "conditions.field", "j_highest": "observables.jmax", "jmax": "numerics.jmax",
    "tolerance_mhz": "numerics.tolerance", "hyperfine": "effects.hyperfine", "nuclear_g": "magnetic.nuclear_g",
}  # fmt: skip


def request(scene: ZeemanScene, folder: Where = ".") -> ZeemanRequest:
    """The request of a scene."""
    molecule = molecule_of(scene)
    assert molecule is not None
    top = _with_tensors(top_of(molecule, folder), scene.magnetic)
    with kind.fields(**_NAMES):
        return ZeemanRequest(
            top,
            kind.grid("conditions.field", scene.conditions.field, "T") or (),
            j_highest=scene.observables.jmax,
            jmax=scene.numerics.jmax,
            tolerance_mhz=kind.quantity("numerics.tolerance", scene.numerics.tolerance, "MHz"),
            hyperfine=kind.hyperfine_of(scene.effects.hyperfine, molecule),
            nuclear_g=scene.magnetic.nuclear_g,
        )


def _with_tensors(top: Top, given: MagneticSection) -> Top:
    """The top with the tensors that the scene gives, else those of its file."""
    chi = None if given.magnetisability is None else _tensor(top, "magnetic.magnetisability", given.magnetisability)
    if given.g is not None:
        return replace(top, magnetic=MagneticTensors(_tensor(top, "magnetic.g", given.g), chi, GIVEN))
    if top.magnetic is None:
        raise ValueError(
            "magnetic.g: the rotational g tensor is not known: expected aa, bb, cc in principal axes, along and across the axis of a "
            "symmetric top, or the one g of a linear top"
        )
    return top if chi is None else replace(top, magnetic=replace(top.magnetic, magnetisability=chi))


def _tensor(top: Top, name: str, numbers: list[float]) -> Tensor:
    return named(name, lambda: tensor_for(top.kind, numbers))


def answer(asked: ZeemanRequest, scene: ZeemanScene, out: Where, executor: Executor | None) -> ZeemanAnswer:
    """The map.

    Parameters
    ----------
    asked : ZeemanRequest
        The scene as the library takes it, checked.
    scene : ZeemanScene
        Not used.
    out : path
        Not used.
    executor : Executor or None
        Its workers share the work.

    Returns
    -------
    ZeemanAnswer
        Energies against the field.
    """
    with kind.fields(**_NAMES):
        return answer_zeeman(asked, executor)


def table(found: ZeemanAnswer) -> FieldMap:
    """Every state in every field."""
    return found.states


def writers(found: ZeemanAnswer, scene: ZeemanScene) -> Mapping[str, Writer]:
    """The picture of the map."""

    def plot(path: Path) -> None:
        from rotor.plots.picture import name_of_top
        from rotor.plots.zeeman import plot_zeeman

        title = name_of_top(found.request.top)
        plot_zeeman(found.states, path, title=title, spins=len(found.request.spin_g), provenance={})

    return {"plot": plot}


def saved(asked: ZeemanRequest, molecule: MoleculeSection | None) -> ZeemanScene:
    """The scene of a request."""
    assert molecule is not None
    nuclei = asked.nuclear_g
    return ZeemanScene(
        molecule=molecule,
        magnetic=MagneticSection(
            g=_numbers(asked.magnetic.g)
            if _is_symmetric(asked.magnetic.g)
            else None,  # else that of the molecule's file
            magnetisability=_numbers(asked.magnetic.magnetisability),
            nuclear_g=None if nuclei is None else {name: float(value) for name, value in nuclei.items()},
        ),
        conditions=ZeemanConditions(field=list(asked.fields_tesla)),
        observables=ZeemanObservables(jmax=asked.j_highest),
        effects=FieldEffects(hyperfine=kind.saved_hyperfine(asked.hyperfine, asked.top)),
        numerics=ZeemanNumerics(jmax=asked.jmax, tolerance=f"{asked.tolerance_mhz!r} MHz"),
    )


def _is_symmetric(tensor: Tensor) -> bool:
    return all(tensor[i][k] == tensor[k][i] for i in range(3) for k in range(i))


def _numbers(tensor: Tensor | None) -> list[float] | None:
    """aa, bb, cc, and ab, ac, bc where one of them is there."""
    if tensor is None:
        return None
    (aa, ab, ac), (_, bb, bc), (_, _, cc) = tensor
    mixed = [ab, ac, bc]
    return [aa, bb, cc, *(mixed if any(mixed) else [])]


KIND = Kind(request, answer, table, saved, writers, names=_NAMES)
