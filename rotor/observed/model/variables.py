"""Free parameters of a source model as search variables, some of them shared by several components.

The search variables are ln N, ln T, v, ln Δv and ln θ: positive parameters stay positive, and the errors of the logarithms of column
densities and temperatures are closer to a Gaussian.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.observed.model.model import PARAMETERS, Component
from rotor.statistics.least_squares import Evaluate, Minimum, minimise

LOGARITHMIC = ("column_per_cm2", "excitation_k", "fwhm_km_s", "size_arcsec")
_ROUND_OFF = 1e-12  # relative rounding error of exp(ln x)
DEFAULT_FREE = ("column_per_cm2", "excitation_k", "velocity_km_s", "fwhm_km_s")


@dataclass(frozen=True)
class Variable:
    """A search variable: its parameter, and the components that share it."""

    name: str
    components: tuple[int, ...]

    @property
    def logarithmic(self) -> bool:
        """Whether the search variable is the logarithm of the parameter."""
        return self.name in LOGARITHMIC

    def forward(self, value: float) -> float:
        """Search variable from the parameter."""
        return math.log(value) if self.logarithmic else value

    def back(self, value: float) -> float:
        """Parameter from the search variable; ValueError beyond the range of doubles."""
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
        """Names such as `CO column_per_cm2`; with a number if a species has several components."""
        return tuple(f"{_who(variable, components)} {variable.name}" for variable in self.items)

    def values(self, components: Sequence[Component]) -> Floats:
        """Search variables (m,) of components; a shared one is that of the first component."""
        return np.array(
            [variable.forward(getattr(components[variable.components[0]], variable.name)) for variable in self.items]
        )

    def applied(self, components: Sequence[Component], values: Floats) -> list[Component]:
        """The components with the values (m,) of a search; ValueError if a value is out of bounds."""
        changes: list[dict[str, float]] = [{} for _ in components]
        for variable, value in zip(self.items, values.tolist(), strict=True):
            for k in variable.components:
                changes[k][variable.name] = variable.back(value)
        return [
            replace(component, **change) if change else component  # type: ignore[arg-type]
            for component, change in zip(components, changes, strict=True)
        ]

    def within(self, components: Sequence[Component], values: Floats) -> tuple[Floats, Ints]:
        """Values (m,) with temperatures limited to the range of Q(T), and the end at which each is: -1, 1, or 0 inside."""
        low, high = np.array([_temperatures(variable, components) for variable in self.items]).reshape(-1, 2).T
        inside = np.clip(values, low, np.maximum(low, high))
        return inside, (inside >= high).astype(np.int64) - (inside <= low)

    def minimum(self, evaluate: Evaluate, components: Sequence[Component], **choices: Any) -> Minimum:
        """Least squares over the search variables, started from components.

        A temperature at an end of its Q(T) is held while χ² falls outwards (its column is 0, so that it is not determined); the other
        variables continue.
        """

        def projected(values: Floats) -> tuple[Floats, Floats]:
            inside, end = self.within(components, values)
            residuals, jacobian = evaluate(inside)
            return residuals, np.where((jacobian.T @ residuals) * end > 0, 0.0, jacobian)

        end = minimise(projected, self.values(components), **choices)
        return replace(end, parameters=self.within(components, end.parameters)[0])

    def jacobian(self, components: Sequence[Component], slopes: Floats) -> Floats:
        """Derivatives (n, m) of the brightness with respect to the search variables, from the slopes (k, 5, n) of `model`."""
        out = np.zeros((slopes.shape[2], len(self)))
        for column, variable in enumerate(self.items):
            place = PARAMETERS.index(variable.name)
            for k in variable.components:
                scale = getattr(components[k], variable.name) if variable.logarithmic else 1.0
                out[:, column] += scale * slopes[k, place]
            # a layer has a single size; each member has the slope of the whole layer
            if variable.name == "size_arcsec":
                out[:, column] /= _members(variable, components)
        return out


def _temperatures(variable: Variable, components: Sequence[Component]) -> tuple[float, float]:
    """Range of ln T in which Q(T) is known for all species of a variable, less round-off; -inf to inf for other variables."""
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
        Names of parameters that all components share.
    fixed : sequence of (int, str), optional
        Parameters of single components that are not fitted.

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
