"""Scenes of levels in a static electric field."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from pathlib import Path

from rotor.quantum.fields.field_map import FieldMap
from rotor.quantum.fields.stark_request import StarkAnswer, StarkRequest, answer_stark
from rotor.scenes import kind
from rotor.scenes.kind import Kind, Where, Writer
from rotor.scenes.molecule import top_of, with_dipole
from rotor.scenes.scene import StarkScene, molecule_of
from rotor.scenes.sections import FieldEffects, MoleculeSection, StarkConditions, StarkNumerics, StarkObservables

_NAMES = {
    "fields_kv_per_cm": "conditions.field", "intensity_w_per_cm2": "conditions.intensity", "m_values": "observables.m",
    "j_highest": "observables.jmax", "diabatic_gap_mhz": "observables.diabatic_gap", "jmax": "numerics.jmax",
    "direction": "conditions.direction", "hyperfine": "effects.hyperfine",
    "tolerance_mhz": "numerics.tolerance",
}  # fmt: skip


def request(scene: StarkScene, folder: Where = ".") -> StarkRequest:
    """The request of a scene."""
    molecule = molecule_of(scene)
    assert molecule is not None
    top = with_dipole(top_of(molecule, folder))
    asked, acting = scene.observables, scene.conditions
    fields = kind.grid("conditions.field", acting.field, "kV/cm")
    gap = None if asked.diabatic_gap is None else kind.quantity("observables.diabatic_gap", asked.diabatic_gap, "MHz")
    with kind.fields(**_NAMES):
        return StarkRequest(
            top,
            fields or (),
            j_highest=asked.jmax,
            m_values=None if asked.m is None else tuple(asked.m),
            direction=_direction(acting.direction),
            intensity_w_per_cm2=kind.quantity("conditions.intensity", acting.intensity, "W/cm2"),
            jmax=scene.numerics.jmax,
            tolerance_mhz=kind.quantity("numerics.tolerance", scene.numerics.tolerance, "MHz"),
            diabatic_gap_mhz=gap,
            hyperfine=kind.hyperfine_of(scene.effects.hyperfine, molecule),
        )


def _direction(numbers: list[float]) -> tuple[float, float, float]:
    if len(numbers) != 3:
        raise ValueError(f"conditions.direction: {numbers}: expected three numbers")
    x, y, z = numbers
    return x, y, z


def answer(asked: StarkRequest, scene: StarkScene, out: Where, executor: Executor | None) -> StarkAnswer:
    """The map.

    Parameters
    ----------
    asked : StarkRequest
        The scene as the library takes it, checked.
    scene : StarkScene
        Not used.
    out : path
        Not used.
    executor : Executor or None
        Its workers share the work.

    Returns
    -------
    StarkAnswer
        Energies against the field.
    """
    with kind.fields(**_NAMES):
        return answer_stark(asked, executor)


def table(found: StarkAnswer) -> FieldMap:
    """Every state in every field."""
    return found.states


def writers(found: StarkAnswer, scene: StarkScene) -> Mapping[str, Writer]:
    """The picture of the map."""

    def plot(path: Path) -> None:
        from rotor.plots.stark import plot_stark

        plot_stark(found.states, path, provenance={})

    return {"plot": plot}


def saved(asked: StarkRequest, molecule: MoleculeSection | None) -> StarkScene:
    """The scene of a request."""
    assert molecule is not None
    return StarkScene(
        molecule=molecule,
        conditions=StarkConditions(
            field=list(asked.fields_kv_per_cm),
            direction=[float(x) for x in asked.direction],
            intensity=f"{float(asked.intensity_w_per_cm2)!r} W/cm2",
        ),
        observables=StarkObservables(
            jmax=asked.j_highest,
            m=None if asked.m_values is None else [float(m) for m in asked.m_values],
            diabatic_gap=None if asked.diabatic_gap_mhz is None else f"{asked.diabatic_gap_mhz!r} MHz",
        ),
        effects=FieldEffects(hyperfine=kind.saved_hyperfine(asked.hyperfine, asked.top)),
        numerics=StarkNumerics(jmax=asked.jmax, tolerance=f"{asked.tolerance_mhz!r} MHz"),
    )


KIND = Kind(request, answer, table, saved, writers, names=_NAMES)
