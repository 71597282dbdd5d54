"""Free parameters of a source model: which there are, which components share them, and how they enter a search.

A search moves ln N, ln T, v, ln Δv and ln θ: what is above 0 stays above 0, and the errors of a column density or a temperature are
closer to those of a Gaussian.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.observed.model import PARAMETERS, Component
from rotor.statistics.least_squares import Evaluate, Minimum, minimise

LOGARITHMIC = ("column_per_cm2", "excitation_k", "fwhm_km_s", "size_arcsec")
_ROUND_OFF = 1e-12  # of the exponential of a logarithm
DEFAULT_FREE = ("column_per_cm2", "excitation_k", "velocity_km_s", "fwhm_km_s")


@dataclass(frozen=True)
class Variable:
    """A number of the search: the parameter it stands for, and the components that share it."""

    name: str
    components: tuple[int, ...]

    @property
    def logarithmic(self) -> bool:
        """Whether the search moves its logarithm."""
        return self.name in LOGARITHMIC

    def forward(self, value: float) -> float:
        """Parameter to search."""
        return math.log(value) if self.logarithmic else value

    def back(self, value: float) -> float:
        """Search to parameter; ValueError beyond what a double holds."""
        if self.logarithmic and abs(value) > 300:
            raise ValueError(f"{self.name}: e^{value:g} is out of range")
        return math.exp(value) if self.logarithmic else value


@dataclass(frozen=True)
class Variables:
    """The free parameters of components, in the order of the search."""

    items: tuple[Variable, ...]

    def __len__(self) -> int:
        return len(self.items)

    def names(self, components: Sequence[Component]) -> tuple[str, ...]:
        """Such as `CO column_per_cm2`; a number follows where a species has several components."""
        return tuple(f"{_who(variable, components)} {variable.name}" for variable in self.items)

    def values(self, components: Sequence[Component]) -> Floats:
        """What the search moves (m,), at the values of components; of shared ones the first counts."""
        return np.array(
            [variable.forward(getattr(components[variable.components[0]], variable.name)) for variable in self.items]
        )

    def applied(self, components: Sequence[Component], values: Floats) -> list[Component]:
        """The components with the values (m,) of a search; ValueError where one is out of bounds."""
        changes: list[dict[str, float]] = [{} for _ in components]
        for variable, value in zip(self.items, values.tolist(), strict=True):
            for k in variable.components:
                changes[k][variable.name] = variable.back(value)
        return [
            replace(component, **change) if change else component  # type: ignore[arg-type]
            for component, change in zip(components, changes, strict=True)
        ]

    def within(self, components: Sequence[Component], values: Floats) -> tuple[Floats, Ints]:
        """Values (m,) with temperatures moved to where Q(T) of all their species is known, and at which end each is: -1, 1, else 0."""
        low, high = np.array([_temperatures(variable, components) for variable in self.items]).reshape(-1, 2).T
        inside = np.clip(values, low, np.maximum(low, high))
        return inside, (inside >= high).astype(np.int64) - (inside <= low)

    def minimum(self, evaluate: Evaluate, components: Sequence[Component], **choices: Any) -> Minimum:
        """The least squares of a function of what the search moves, from components.

        A temperature at an end of its Q(T) stays there while χ² falls outwards (its column is 0: not determined), and the others go on.
        """

        def projected(values: Floats) -> tuple[Floats, Floats]:
            inside, end = self.within(components, values)
            residuals, jacobian = evaluate(inside)
            return residuals, np.where((jacobian.T @ residuals) * end > 0, 0.0, jacobian)

        end = minimise(projected, self.values(components), **choices)
        return replace(end, parameters=self.within(components, end.parameters)[0])

    def jacobian(self, components: Sequence[Component], slopes: Floats) -> Floats:
        """Derivatives (n, m) of the brightness by what the search moves, from the slopes (k, 5, n) of `model`."""
        out = np.zeros((slopes.shape[2], len(self)))
        for column, variable in enumerate(self.items):
            place = PARAMETERS.index(variable.name)
            for k in variable.components:
                scale = getattr(components[k], variable.name) if variable.logarithmic else 1.0
                out[:, column] += scale * slopes[k, place]
            if variable.name == "size_arcsec":  # a layer has one size; every member has the slope of the whole layer
                out[:, column] /= _members(variable, components)
        return out


def _temperatures(variable: Variable, components: Sequence[Component]) -> tuple[float, float]:
    """First and last ln T at which Q(T) is known for all species of a variable, round-off inside; of others -inf and inf."""
    if variable.name != "excitation_k":
        return -math.inf, math.inf
    lowest, highest = zip(*(components[k].species.partition.range_k for k in variable.components), strict=True)
    return math.log(max(lowest)) + _ROUND_OFF, math.log(min(highest)) - _ROUND_OFF


def _members(variable: Variable, components: Sequence[Component]) -> int:
    return len(variable.components) // len({components[k].layer for k in variable.components})


def _who(variable: Variable, components: Sequence[Component]) -> str:
    if len(variable.components) == len(components) > 1:
        return "all"
    texts = []
    for k in variable.components:
        name = components[k].species.name
        alike = [i for i, component in enumerate(components) if component.species.name == name]
        texts.append(name if len(alike) == 1 else f"{name} ({alike.index(k) + 1})")
    return ", ".join(texts)


def variables(
    components: Sequence[Component],
    free: Sequence[str] = DEFAULT_FREE,
    shared: Sequence[str] = (),
    fixed: Sequence[tuple[int, str]] = (),
) -> Variables:
    """The free parameters of components.

    Parameters
    ----------
    components : sequence of Component
    free : sequence of str
        Names of `PARAMETERS` that are free; `size_arcsec` is shared by the components of a layer.
    shared : sequence of str, optional
        Names that all components have in common.
    fixed : sequence of (int, str), optional
        Parameters of single components that stay as they are.

    Returns
    -------
    Variables

    Raises
    ------
    ValueError
        For an unknown name, and for a free size of components that fill the beam.
    """
    for name in (*free, *shared, *(name for _, name in fixed)):
        if name not in PARAMETERS:
            raise ValueError(f"parameter {name!r}: known are {', '.join(PARAMETERS)}")
    items: list[Variable] = []
    for name in PARAMETERS:
        moving = [k for k in range(len(components)) if name in free and (k, name) not in fixed]
        if name == "size_arcsec":
            if any(components[k].size_arcsec is None for k in moving):
                raise ValueError("size_arcsec is free, but a component fills the beam: state a size to begin with")
            by_layer = {
                components[k].layer: [i for i in moving if components[i].layer == components[k].layer] for k in moving
            }
            items += [Variable(name, tuple(group)) for group in by_layer.values()]
        elif name in shared and moving:
            items.append(Variable(name, tuple(moving)))
        else:
            items += [Variable(name, (k,)) for k in moving]
    return Variables(tuple(items))
