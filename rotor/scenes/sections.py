"""Tables of a scene file: molecule, effects, conditions, observables, numerics and outputs of each kind.

Field descriptions feed templates and the JSON Schema. A quantity is a number in the unit of the description, or a text with a unit
("300 K"); a grid is a list of numbers or a text ("0:100kV/cm:21").
"""

from __future__ import annotations

from typing import Any

from rotor.verbs.subjects import molecule_section

MoleculeSection: Any = molecule_section()


def __getattr__(name: str) -> Any:
    """Structures by name: `RamanConditions` is the table [conditions] of raman."""
    if name == "EmittingMolecule":
        from rotor.verbs.emission import emitting_molecule

        return emitting_molecule()
    if name.endswith("Section"):
        return _section_of_list(name)
    from rotor.verbs.scene_tables import tables_of
    from rotor.verbs.verb import SCENE_VERBS, verb_of

    kind = next((verb for verb in SCENE_VERBS if name.startswith(verb.capitalize())), "")
    tables = tables_of(verb_of(kind)) if kind else {}
    if (table := name.removeprefix(kind.capitalize()).lower()) not in tables:
        raise AttributeError(f"module 'rotor.scenes.sections' has no attribute {name!r}")
    return tables[table]


def _section_of_list(name: str) -> Any:
    """Structure of an item in a list of tables, such as GaussianSection of [[pulses]]."""
    from rotor.alignment.request import PULSES
    from rotor.classical.driven import BODY_EFFECTS
    from rotor.verbs.tables import structures_of

    for choices in (PULSES, BODY_EFFECTS):
        for structure in structures_of(choices).values():
            if structure.__name__ == name:
                return structure
    raise AttributeError(f"module 'rotor.scenes.sections' has no attribute {name!r}")
