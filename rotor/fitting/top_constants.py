"""All constants of a top with further states and spins, in one set of names for the fit.

    A, DeltaJ              of state 0, as in `rotor.tops.constants.constants`
    E[1], A[1], DeltaJ[1]  of state 1
    G_c[0,1], W[0,1]       between states 0 and 1, see `rotor.quantum.effects.interactions`
    chi_aa(14N)            of spins, in all states; chi_aa(14N)[1] is the difference of state 1

    mu_a, mu_b, mu_c       the dipole in debye, of lines in an electric field

They are the names of the parameters of `rotor.quantum.effects.of_top.effects_of`, in the same order.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.levels import Levels
from rotor.quantum.solve import solve_levels
from rotor.tops.constants.constants import Constants
from rotor.tops.constants.parameter_names import parse_name
from rotor.tops.constants.uncertain_numbers import write_number
from rotor.tops.internal_rotation import BARE, InternalRotationConstants, is_torsional
from rotor.tops.spins.spin_constants import SpinConstants, spin_names
from rotor.tops.states.state_constants import StateConstants, state_numbers
from rotor.tops.top import Top

DIPOLES = ("mu_a", "mu_b", "mu_c")


def unit_of_constant(name: str) -> str:
    """Unit of a constant of a fit: MHz, D of a dipole component, rad of an angle of an internal rotor, none of rho.

    >>> [unit_of_constant(name) for name in ("A", "mu_a", "delta_1", "rho")]
    ['MHz', 'D', 'rad', '']
    """
    if name in DIPOLES:
        return "D"
    if name in BARE:
        return "" if name == "rho" else "rad"
    return "MHz"


@dataclass(frozen=True, eq=False)
class TopConstants:
    """The constants of a top by name; with `hyperfine` those of spins, and for levels in a field the dipole (D).

    dipole : components that levels in a field depend on, such as ("mu_a",). dipole_errors : their standard deviations, D.
    values, uncertainties : in MHz, by the names above. Raises ValueError for unknown names.

    >>> from rotor.tops.spins.spin_constants import SpinConstants
    >>> top = Top.from_constants("A=9 B=3 C=2 GHz", spin_constants=SpinConstants.parse("chi_aa(14N)=-4 MHz"))
    >>> constants = TopConstants(top, hyperfine=True)
    >>> constants.spelling("Δ_J"), dict(constants.values)
    ('DeltaJ', {'A': 9000.0, 'B': 3000.0, 'C': 2000.0, 'chi_aa(14N)': -4.0})
    >>> constants.replace(**{"chi_ab(14N)": 1.0})["chi_ab(14N)"]
    1.0
    """

    top: Top
    hyperfine: bool = False
    dipole: tuple[str, ...] = ()
    dipole_errors: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.effects  # noqa: B018  checks all names when the set is made

    @property
    def kind(self) -> str:
        """Kind of the top."""
        return self.top.kind

    @property
    def reduction(self) -> str | None:
        """Reduction of the constants of all states."""
        return self.top.constants.reduction

    @property
    def representation(self) -> str | None:
        """Representation of the constants of all states."""
        return self.top.constants.representation

    @cached_property
    def effects(self) -> tuple[QuantumEffect, ...]:
        """The effects in the Hamiltonian."""
        return effects_of(self.top, self.hyperfine)

    @cached_property
    def values(self) -> Mapping[str, float]:
        """All constants in MHz, dipole components in D."""
        named = {self.spelling(name): value for part in self._parts for name, value in part.values.items()}
        return MappingProxyType(named | self._dipole)

    @property
    def _dipole(self) -> dict[str, float]:
        """Dipole components in D for levels in a field; empty otherwise."""
        values = self.top.dipole_abc_debye or (0.0, 0.0, 0.0)
        return {name: values[DIPOLES.index(name)] for name in self.dipole}

    @property
    def in_field(self) -> bool:
        """Whether the levels are in an electric field."""
        return bool(self.dipole)

    @cached_property
    def uncertainties(self) -> Mapping[str, float]:
        """One standard deviation in MHz of the constants that have one."""
        errors = {self.spelling(name): error for part in self._parts for name, error in part.uncertainties.items()}
        return MappingProxyType(errors | dict(self.dipole_errors))

    @property
    def _parts(self) -> list[Constants | StateConstants | SpinConstants | InternalRotationConstants]:
        spins = self.top.spin_constants if self.hyperfine else None
        parts = (self.top.constants, self.top.internal_rotation, self.top.states, spins)
        return [part for part in parts if part is not None]

    @cached_property
    def _first_levels(self) -> Levels:
        return solve_levels(self.top, 1, effects=self.effects)

    @property
    def quanta(self) -> tuple[str, ...]:
        """The quantum numbers of a level: those of the rotation, then v, then the sums with spins."""
        names = self._first_levels.quanta_names
        rotation = [name for name in ("n", "j", "k", "ka", "kc") if name in names]
        if rotation[0] == "n" and "j" in rotation:  # the sum with the spin of an electron
            rotation.remove("j")
        further = (*(["v"] if "v" in names else []), *(n for n in names if n != "v" and n not in rotation))
        return (*rotation, *further, *(("m", "field") if self.in_field else ()))

    @property
    def halves(self) -> frozenset[str]:
        """The quantum numbers that are half-integers, stored doubled."""
        return self._first_levels.halves

    def __getitem__(self, name: str) -> float:
        return self.values[self.spelling(name)]

    def __contains__(self, name: str) -> bool:
        return self.spelling(name) in self.values

    def spelling(self, name: str) -> str:
        """The spelling of a name in this set; ValueError for a name of no constant.

        >>> TopConstants(Top.from_constants("A=9 B=3 C=2 GHz")).spelling("G_c[1,0]")
        'G_c[0,1]'
        """
        if "(" in name:
            return parse_name(name).text
        if self.in_field and name in DIPOLES:
            return name
        if self.top.internal_rotation is not None and is_torsional(name):
            return name
        if "[" not in name:
            return self.top.constants.spelling(name)
        states, head = state_numbers(name), name.partition("[")[0].strip()
        return parse_name(name).text if len(states) == 2 else f"{self.top.constants.spelling(head)}[{states[0]}]"

    def replace(self, **changes: Any) -> TopConstants:
        """A changed set: missing constants are added, those set to None removed.

        A changed constant loses its uncertainty, unless `uncertainties` gives the whole table. Raises ValueError for a state or spin
        that the top does not have, and for unknown names.
        """
        uncertainties: Mapping[str, float] | None = changes.pop("uncertainties", None)
        new = {self.spelling(name): value for name, value in changes.items()}
        for name in new:
            self._refuse_unknown(name)
        values = {name: value for name, value in {**self.values, **new}.items() if value is not None}
        old_errors = (
            self.uncertainties
            if uncertainties is None
            else {self.spelling(name): error for name, error in uncertainties.items()}
        )
        errors = {
            name: error
            for name, error in old_errors.items()
            if name in values and (uncertainties is not None or name not in new)
        }
        return self._of(values, errors)

    def _of(self, values: Mapping[str, float], errors: Mapping[str, float]) -> TopConstants:
        """A copy with these values and uncertainties."""
        top = self.top
        dipole_errors = {name: error for name, error in errors.items() if name in DIPOLES}
        dipole = tuple(name for name in DIPOLES if name in values)
        if self.in_field:
            top = top.with_dipole([values.get(name, 0.0) for name in DIPOLES], top.dipole_source)
            values, errors = ({name: t[name] for name in t if name not in DIPOLES} for t in (values, errors))
        internal = top.internal_rotation
        if internal is not None:
            moved = [{name: table[name] for name in table if is_torsional(name)} for table in (values, errors)]
            internal = replace(internal, values=moved[0], uncertainties=moved[1])
            values, errors = ({name: t[name] for name in t if not is_torsional(name)} for t in (values, errors))
        gone = {name: None for name in top.constants.values if name not in values}
        constants = top.constants.replace(**_plain(values), **gone, uncertainties=_plain(errors))
        states, spins = top.states, top.spin_constants
        if states is not None:
            states = replace(states, values=_state_constants(values), uncertainties=_state_constants(errors))
        if spins is not None and self.hyperfine:
            spins = replace(spins, values=_spin_constants(values), uncertainties=_spin_constants(errors))
        top_with_values = replace(
            top,
            constants=constants,
            states=states,
            spin_constants=spins,
            internal_rotation=internal,
            covariance=None,
            level_table=None,
        )
        return TopConstants(top_with_values, self.hyperfine, dipole, dipole_errors)

    def _refuse_unknown(self, name: str) -> None:
        """Raise ValueError for a state or spin that the set does not have."""
        states = parse_name(name).states if "(" in name else state_numbers(name) if "[" in name else None
        count = self.top.state_count
        if states and max(states) >= count:
            raise ValueError(
                f"{name}: there is no state {max(states)}; the constants to start from have {count}, counted from 0"
            )
        if "(" in name:
            spins = self.top.spin_constants.twice if self.top.spin_constants is not None and self.hyperfine else {}
            lost = [spin for spin in spin_names(name) if spin not in spins]
            if lost:
                raise ValueError(
                    f"{name}: there is no spin {lost[0]}; the constants to start from have {', '.join(spins) or 'none'}"
                )

    def text(self, unit: str = "MHz") -> str:
        """The constants in one line, uncertainty in brackets."""
        spreads = self.uncertainties
        frequencies = {name: value for name, value in self.values.items() if name not in DIPOLES}
        items = (f"{name}={write_number(value, spreads.get(name), unit)}" for name, value in frequencies.items())
        dipole = "".join(f" {name}={value:.10g} D" for name, value in self._dipole.items())
        return f"{' '.join(items)} {unit}{dipole}"


ConstantSet = Constants | TopConstants


def _plain(table: Mapping[str, float]) -> dict[str, float]:
    """The constants of state 0, without spins."""
    return {name: value for name, value in table.items() if "[" not in name and "(" not in name}


def _state_constants(table: Mapping[str, float]) -> dict[str, float]:
    """The constants of further states and of pairs of states, without spins."""
    return {name: value for name, value in table.items() if "[" in name and "(" not in name}


def _spin_constants(table: Mapping[str, float]) -> dict[str, float]:
    return {name: value for name, value in table.items() if "(" in name}
