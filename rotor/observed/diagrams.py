"""Rotational diagrams of all species of a model, as a table of points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotor.observed.diagram import RotationalDiagram, rotational_diagram
from rotor.observed.model.model import Component, Sight
from rotor.observed.spectrum import ObservedSpectrum
from rotor.table import Table


@dataclass(frozen=True, eq=False, repr=False)
class SpeciesDiagrams(Table):
    """Rotational diagrams by species; `notes` has the reason if a species has none."""

    names: tuple[str, ...]
    diagrams: tuple[RotationalDiagram, ...]
    notes: tuple[str, ...] = ()

    @property
    def columns(self) -> dict[str, Any]:
        """species, frequency_mhz, energy_upper_k, log_population, error, uncorrected, optical_depth."""
        if not self.diagrams:
            return {"species": np.zeros(0, dtype=np.str_)}
        parts = [diagram.columns for diagram in self.diagrams]
        species = np.repeat(np.array(self.names, dtype=np.str_), [len(diagram.error) for diagram in self.diagrams])
        return {"species": species} | {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    def facts(self) -> list[dict[str, Any]]:
        """Temperature and column density of each diagram."""
        names = ("excitation_k", "excitation_error_k", "column_per_cm2", "column_error_per_cm2", "chi_squared")
        return [
            {"species": name, "lines": len(diagram.error), **{key: getattr(diagram, key) for key in names}}
            for name, diagram in zip(self.names, self.diagrams, strict=True)
        ]


def species_diagrams(
    spectrum: ObservedSpectrum, components: Sequence[Component], sight: Sight | None = None
) -> SpeciesDiagrams:
    """The rotational diagram of each component that has one, corrected for optical depth."""
    names, diagrams, notes = [], [], []
    for number, component in enumerate(components):
        try:
            diagrams.append(rotational_diagram(spectrum, components, number, sight))
            names.append(component.species.name)
        except ValueError as error:
            notes.append(str(error))
    return SpeciesDiagrams(tuple(names), tuple(diagrams), tuple(notes))
