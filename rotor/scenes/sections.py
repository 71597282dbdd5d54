"""The tables of a scene file: molecule, effects, conditions, observables, numerics and outputs, kind by kind.

Each field carries its description, from which templates and the JSON Schema are made. A quantity is a number in the unit that the
description names, or a text with a unit of its own ("300 K"); a grid is a list of numbers or a text ("0:100kV/cm:21").
"""

from __future__ import annotations

from typing import Annotated, Any

from rotor.verbs.subjects import molecule_section
from rotor.verbs.tables import Section, said

Quantity = float | str
Grid = list[float] | str


MoleculeSection: Any = molecule_section()


class TableOutputs(Section, frozen=True):
    """Files to write."""

    csv: Annotated[str | None, said("the table", "out.csv")] = None
    parquet: Annotated[str | None, said("the table", "out.parquet")] = None
    json: Annotated[str | None, said("the table", "out.json")] = None
    plot: Annotated[str | None, said("picture (.png, .pdf, .svg)", "out.png")] = None


class BodySection(Section, frozen=True):
    """A rigid body instead of a molecule, in any coherent units."""

    moments: Annotated[list[float], said("principal moments of inertia, in any order", [0.3, 0.35, 0.4])]
    units: Annotated[str, said('"SI" (kg m², s, J), or "" for any coherent set')] = ""
    angular_momentum: Annotated[list[float] | None, said("at time 0 in principal axes", [1.8, 0.4, -0.9])] = None
    angular_velocity: Annotated[list[float] | None, said("instead of the angular momentum", [0.1, 15.0, 0.1])] = None
    attitude: Annotated[list[float] | None, said("quaternion, body to space, at time 0", [1.0, 0.0, 0.0, 0.0])] = None


class TumbleNumerics(Section, frozen=True):
    """Knobs of a motion under effects; the free motion is exact."""

    tolerance: Annotated[float, said("of a step, relative to |L| and one radian")] = 1e-10
    step: Annotated[float | None, said("of a splitting, where no torque depends on the angular velocity", 0.01)] = None
    order: Annotated[int, said("of the splitting: 2, 4, 6 or 8")] = 4


class TumbleConditions(Section, frozen=True):
    """How the molecule starts, and when it is looked at."""

    temperature: Annotated[Quantity, said("whose thermal mean |L| is, half a degree off the middle axis (K)")] = "300 K"
    angular_momentum: Annotated[list[float] | None, said("instead, along a, b, c (ħ)", [10.0, 0.1, 0.1])] = None
    times: Annotated[Grid | None, said("ps of a molecule; by default two periods", "0:2:201")] = None


_SHARED = {
    "QuantumEffects": "SpectrumEffects", "VibrationSection": "SpectrumVibration", "BasisNumerics": "SpectrumNumerics",
    "FieldEffects": "StarkEffects",
}  # fmt: skip  # tables that several kinds have


def __getattr__(name: str) -> Any:
    """The structure of a table of a kind: `RamanConditions` is that of [conditions] of raman."""
    name = _SHARED.get(name, name)
    if name == "EmittingMolecule":
        from rotor.verbs.emission import emitting_molecule

        return emitting_molecule()
    if (shape := name.removesuffix("Section").lower()) in ("gaussian", "switched", "kick", "thz"):
        from rotor.verbs.align import PULSES

        return PULSES.structures[shape]
    from rotor.verbs.scene_tables import tables_of
    from rotor.verbs.verb import SCENE_VERBS, verb_of

    kind = next((one for one in SCENE_VERBS if name.startswith(one.capitalize())), "")
    tables = tables_of(verb_of(kind)) if kind else {}
    if (table := name.removeprefix(kind.capitalize()).lower()) not in tables:
        raise AttributeError(f"module 'rotor.scenes.sections' has no attribute {name!r}")
    return tables[table]
