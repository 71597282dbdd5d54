"""The rotational partition function Q(T) at one or many temperatures, with its method and estimated error."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.frozen import dataclass
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.table import Table
from rotor.thermodynamics.sums.level_sums import NOT_SUMMED, LevelSums, Progress, checked_temperatures, level_sums
from rotor.thermodynamics.sums.spin_factor import rotational_sum

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rotor.tops.top import Top


@dataclass(frozen=True)
class PartitionFunction:
    """Q at one temperature: value, last J of the sum, estimated relative error, method in words.

    jmax: None without a sum.
    """

    temperature_k: float
    q: float
    jmax: int | None
    relative_error: float
    source: str

    @classmethod
    def stated(cls, temperature_k: float, q: float, source: str = "given") -> PartitionFunction:
        """A Q from elsewhere, whose error is not known."""
        return cls(temperature_k, q, None, math.nan, source)


@dataclass(frozen=True, eq=False, repr=False)
class PartitionFunctions(Table):
    """Q at n temperatures; all arrays are (n,); indexing and iteration give each as a `PartitionFunction`.

    jmax: last J of the sum, -1 for the corrected classical limit. relative_error: estimated. source: method in words.
    """

    temperature_k: Floats
    q: Floats
    jmax: Ints
    relative_error: Floats
    source: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.q)

    def __getitem__(self, i: int) -> PartitionFunction:
        j = int(self.jmax[i])
        last = None if j == NOT_SUMMED else j
        return PartitionFunction(
            float(self.temperature_k[i]), float(self.q[i]), last, float(self.relative_error[i]), self.source[i]
        )

    def __iter__(self) -> Iterator[PartitionFunction]:
        return (self[i] for i in range(len(self)))

    @property
    def provenance(self) -> dict[str, Any]:
        """The method of each Q in words, and their number."""
        return {"source": list(self.source), "rows": len(self)}

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Temperature, Q, J max and error by name."""
        names = ("temperature_k", "q", "jmax", "relative_error")
        return {name: getattr(self, name) for name in names}


@overload
def partition_function(
    top: Top,
    temperature_k: float,
    relative_error: float = 1e-6,
    effects: Sequence[QuantumEffect] = SEMI_RIGID,
    *,
    refuse: bool = True,
    progress: Progress | None = None,
) -> PartitionFunction: ...


@overload
def partition_function(
    top: Top,
    temperature_k: Sequence[float] | Floats,
    relative_error: float = 1e-6,
    effects: Sequence[QuantumEffect] = SEMI_RIGID,
    *,
    refuse: bool = True,
    progress: Progress | None = None,
) -> PartitionFunctions: ...


def partition_function(
    top: Top,
    temperature_k: float | Sequence[float] | Floats,
    relative_error: float = 1e-6,
    effects: Sequence[QuantumEffect] = SEMI_RIGID,
    *,
    refuse: bool = True,
    progress: Progress | None = None,
) -> PartitionFunction | PartitionFunctions:
    """Q(T) of a top: a single value for a number, a table for a list or array of temperatures, from one set of levels.

    Q is summed over levels until the relative tail is below `relative_error`. If the sum would be long and the corrected
    classical limit is as accurate, that is used; see `rotor.thermodynamics.sums.level_sums`.

    Parameters
    ----------
    top : Top
        Constants and spin weights.
    temperature_k : float or (n,) array
        One temperature or many, above 0 K.
    relative_error : float, optional
        Largest relative error of Q.
    effects : sequence of QuantumEffect, optional
        Effects in the Hamiltonian.
    refuse : bool, optional
        False: return sums with an error above 10 % too, for a caller that checks the errors.
    progress : callable, optional
        Called as `progress(j, last)` when more levels are solved; see `level_sums`.

    Returns
    -------
    PartitionFunction or PartitionFunctions
        Q with J max, error and source. The error can exceed `relative_error` if levels beyond the range of the distortion
        constants are populated.

    Raises
    ------
    ValueError
        For an error above 10 %, unless `refuse` is False, and for a temperature not above 0 K.

    Examples
    --------
    >>> from rotor.tops.top import Top
    >>> top = Top.from_constants("B=57635.968 MHz")
    >>> round(partition_function(top, 300.0).q, 2), partition_function(top, [10.0, 300.0]).q.round(2).tolist()
    (108.79, [3.97, 108.79])
    """
    weights = [top.spin_weights]
    rotation = rotational_sum(top, effects)
    settings: dict[str, Any] = {"energies": False, "refuse": refuse, "progress": progress}
    if rotation.is_original:
        sums = level_sums(top, weights, temperature_k, relative_error, effects=rotation.effects, **settings)[0]
    else:  # energies count from the lowest split level
        from rotor.thermodynamics.sums.spin_sums import spin_sums

        temperatures = checked_temperatures(temperature_k)
        sums = spin_sums(top, weights, temperatures, relative_error, effects, **settings).sums[0]
    functions = PartitionFunctions(sums.temperatures_k, sums.q, sums.jmax, sums.error_q, _sources(sums, relative_error))
    return functions if np.ndim(temperature_k) else functions[0]


def _sources(sums: LevelSums, relative_error: float) -> tuple[str, ...]:
    """The method of each Q in words, and its error: the requested limit, or a larger error that was reached."""
    rows = zip(sums.jmax.tolist(), sums.error_q.tolist(), strict=True)
    return tuple(
        f"{_means(j)}, relative error {f'below {relative_error:g}' if error <= relative_error else f'about {error:.0e}'}"
        for j, error in rows
    )


def _means(jmax: int) -> str:
    return "classical with corrections" if jmax == NOT_SUMMED else f"summed from levels to J = {jmax}"
