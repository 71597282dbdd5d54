"""A request for energy levels, and what answers it: a range of J and K, energies in MHz, cm⁻¹ and K, terms for a diagram."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor import units
from rotor.arrays import Floats, Ints
from rotor.checks import require_top, require_whole
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.estimates.budgets import energy_errors, levels_budget
from rotor.quantum.estimates.convergence import warnings_of
from rotor.quantum.estimates.limits import all_limits, limit_facts
from rotor.quantum.hamiltonian_input import effects_field
from rotor.quantum.hyperfine_method import hyperfine_facts
from rotor.quantum.levels import Levels
from rotor.quantum.solve import solve_levels
from rotor.requests.budget import ErrorBudget
from rotor.requests.field import check_fields, declared
from rotor.requests.readers import Quantity, Whole
from rotor.table import Table, TextOf, with_article
from rotor.tops.facts import top_facts

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from rotor.tops.top import Top

DEFAULT_JMAX = 10


@dataclass(frozen=True)
class LevelsRequest:
    """Energy levels to compute; every field is checked when the request is made.

    jmin, jmax: of the rotational angular momentum. kmin, kmax: of |K| of a symmetric top, of Ka of a near-prolate and Kc of
    a near-oblate asymmetric one; None: all. max_energy_mhz: above the lowest level that exists; None: no limit.
    effects: what the Hamiltonian consists of.
    """

    top: Top
    jmax: int = declared(DEFAULT_JMAX, Whole(0), "Highest J", "observables.jmax", common=True)
    jmin: int = declared(0, Whole(0), "Lowest J", "observables.jmin", option="--j", hidden=True)
    kmin: int | None = declared(
        None,
        Whole(0),
        "Lowest |K|, or Ka (Kc of a near-oblate top)",
        "observables.kmin",
        option="--k",
        hidden=True,
        example=0,
    )
    kmax: int | None = declared(
        None, Whole(0), "Highest |K|, likewise", "observables.kmax", option="--k", hidden=True, example=3
    )
    max_energy_mhz: float | None = declared(
        None, Quantity("MHz", above=0, metavar="E"), "Highest energy above the lowest level that exists (MHz; 10cm-1, 50K)",
        "observables.max_energy", common=True, example="10 cm-1",
    )  # fmt: skip
    effects: tuple[QuantumEffect, ...] = effects_field()

    def __post_init__(self) -> None:
        require_top(self.top)
        check_fields(self)
        require_whole("jmax", self.jmax, self.jmin)
        require_whole("kmax", self.kmax, self.kmin or 0)
        if (self.kmin is not None or self.kmax is not None) and self.top.kind in ("linear", "spherical"):
            raise ValueError(f"kmax: the levels of {with_article(self.top.kind)} top have no K; give J alone")


@dataclass(frozen=True, eq=False, repr=False)
class SelectedLevels(Table):
    """Energy levels in order of their rows, energies in three units from the lowest level that exists.

    levels: all that were solved. rows: (n,) those asked for. top: whose constants, or table, have the errors of energies; None: no
    errors. ground_mhz: energy of the lowest level that exists, from the Hamiltonian's zero.
    """

    levels: Levels
    rows: Ints
    top: Top | None = None

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def provenance(self) -> dict[str, Any]:
        """The Hamiltonian that the levels are of, and the energy that theirs count from."""
        return self.levels.provenance | {"ground_mhz": self.ground_mhz, "rows": len(self)}

    @cached_property
    def ground_mhz(self) -> float:
        """Energy of the lowest level that exists, from the Hamiltonian's zero."""
        return self.levels.ground_mhz

    @property
    def energy_mhz(self) -> Floats:
        """E/h in MHz above the lowest level that exists."""
        return np.asarray(self.levels.energy_mhz[self.rows] - self.ground_mhz)

    @property
    def energy_cm(self) -> Floats:
        """E/hc in cm⁻¹ above the lowest level that exists."""
        return self.energy_mhz / units.MHZ_PER_CM

    @property
    def energy_k(self) -> Floats:
        """E/k in K above the lowest level that exists."""
        return self.energy_mhz / units.MHZ_PER_K

    @cached_property
    def error_mhz(self) -> Floats | None:
        """One standard deviation of every energy, None where no errors are known; see `energy_errors`."""
        errors = None if self.top is None else energy_errors(self.top, self.levels)
        return None if errors is None else errors[self.rows]

    @property
    def labels(self) -> list[str]:
        """The quantum numbers of each level as text."""
        return self.levels.labels(self.rows)

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Quantum numbers, energies in three units, spin weight and degeneracy, by name; `error_mhz` where errors are known."""
        error = {} if self.error_mhz is None else {"error_mhz": self.error_mhz}
        numbers = {"energy_mhz": self.energy_mhz} | error | {"energy_cm": self.energy_cm, "energy_k": self.energy_k}
        counts = {name: getattr(self.levels, name)[self.rows] for name in ("weight", "degeneracy")}
        return {name: column[self.rows] for name, column in self.levels.quanta.items()} | numbers | counts


@dataclass(frozen=True, repr=False)
class LevelsAnswer(TextOf):
    """The levels that a request asked for, and the limits of the model behind them."""

    shown = "table"

    request: LevelsRequest
    table: SelectedLevels

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """The limits of these levels, in sentences."""
        return warnings_of(self.request.top, self.table.levels)

    @cached_property
    def errors(self) -> ErrorBudget:
        """How far the energies can be trusted."""
        request, levels = self.request, self.table.levels
        errors_mhz = self.table.error_mhz
        tabulated = (
            request.top.level_table is not None and errors_mhz is not None and bool(np.isfinite(errors_mhz).all())
        )
        limits = all_limits(request.top, max(request.jmax, 1), levels.effects, tabulated=tabulated)
        return levels_budget(request.top, levels, errors_mhz, limits)

    def facts(self) -> dict[str, Any]:
        """Everything about the answer but its table, by the keys of docs/verbs."""
        request = self.request
        return {
            **top_facts(request.top),
            "jmin": request.jmin,
            "jmax": request.jmax,
            "kmin": request.kmin,
            "kmax": request.kmax,
            "max_energy_mhz": request.max_energy_mhz,
            "quantum_numbers": list(self.table.levels.quanta_names),
            "level_count": len(self.table),
            "ground_mhz": self.table.ground_mhz,
            "hyperfine": hyperfine_facts(request.top, self.table.levels),
            "notes": [*request.top.notes, *self.notes],
            **limit_facts(request.top, max(request.jmax, 1), self.table.levels.effects),
            "errors": self.errors.as_json(),
        }


def answer_levels(request: LevelsRequest, executor: Executor | None = None) -> LevelsAnswer:
    """The levels of a request, in order of J and, within it, of the solution. executor: J are spread over it.

    >>> from rotor.tops.top import Top
    >>> answer = answer_levels(LevelsRequest(Top.from_constants("A=10 B=6 C=4 MHz"), jmin=1, jmax=1))
    >>> answer.table.energy_mhz.tolist(), answer.table.labels  # B + C, A + C, A + B
    ([10.0, 16.0, 14.0], [' 1  0  1', ' 1  1  0', ' 1  1  1'])
    """
    # from J = 0 and for some J more, so that the lowest level that exists is among them whatever the spin weights are
    levels = solve_levels(request.top, max(request.jmax, 3), effects=request.effects, executor=executor)
    selected = (levels.rotational >= request.jmin) & (levels.rotational <= request.jmax)
    if request.kmin is not None or request.kmax is not None:
        k = _projection(levels, request.top)
        selected &= (k >= (request.kmin or 0)) & (k <= (request.jmax if request.kmax is None else request.kmax))
    if request.max_energy_mhz is not None:
        selected &= levels.energy_mhz - levels.ground_mhz <= request.max_energy_mhz
    return LevelsAnswer(request, SelectedLevels(levels, np.flatnonzero(selected), request.top))


def _projection(levels: Levels, top: Top) -> Ints:
    """|K| of a symmetric top; Ka, or Kc where κ is above 0, of an asymmetric one."""
    quanta = levels.quanta
    if "k" in quanta:
        return np.asarray(np.abs(quanta["k"]))
    near_oblate = top.kind == "oblate" or (top.kind == "asymmetric" and (top.kappa or 0.0) > 0)
    return np.asarray(quanta["kc" if near_oblate else "ka"])
