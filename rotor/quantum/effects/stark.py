"""Stark effect of a static electric field, optionally with non-resonant laser light polarized along Z.

    H = H0 - μ·n E - (2π I/c) (α'_ZZ),          μE/h = 503.4117 MHz for 1 D and 1 kV/cm

The dipole points from minus to plus, so that a positive field lowers the state whose dipole points along it. If the field is along Z too
(n = Z), M is a good quantum number and ±M coincide. A field at an angle with the light mixes M; the basis then contains all M.
To second order a linear top has W = (μ²E²/2hB) [J(J+1) - 3M²]/[J(J+1)(2J-1)(2J+3)], and -μ²E²/6hB for J = 0; a symmetric one has
-μE KM/[J(J+1)] to first order (C. H. Townes and A. L. Schawlow, Microwave Spectroscopy, 1955, chapter 10). These formulas serve as checks;
the module solves the matrices.

H = H0 - s E·μ is linear in a scale s of the dipole, so that ∂E/∂ln s = F ∂E/∂F at a field of strength F (theorem of Hellmann and Feynman).
A relative error of the dipole therefore shifts an energy by this error times F ∂E/∂F. Maps neglect the polarization of the molecule by a
static field, -½ α F² by definition of the polarizability, with α/4πε0 a volume.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rotor import units
from rotor.checks import require_positive, require_whole
from rotor.quantum.effect import QuantumEffect, dipoles_by_state
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.estimates.limits import Limit
from rotor.quantum.fields.answer import MapAnswer
from rotor.quantum.fields.blocks import Contraction
from rotor.quantum.fields.field_map import FieldMap, field_map
from rotor.quantum.fields.inputs import INTENSITY, basis_field, read_direction, read_m, states_field, tolerance_field
from rotor.quantum.fields.map_request import MOST_AT_EDGE, FieldKind, FieldTerm, MapRequest
from rotor.quantum.hamiltonian_input import spins_field
from rotor.requests.budget import ErrorTerm
from rotor.requests.field import check_fields, declared
from rotor.requests.readers import Custom, Grid, Quantity

if TYPE_CHECKING:
    from rotor.tops.top import Top

HIGHEST_KV_PER_CM = 1e5  # 1 V/Å is 1e5 kV/cm: molecules are ionised
DEFAULT_TOLERANCE_MHZ = 1e-6
HIGHEST_J = 100  # of free levels in a map
ELECTRIC = FieldKind(
    "kV/cm", "fields_kv_per_cm", "field_kv_per_cm", "mu_eff_debye", units.MHZ_PER_DEBYE_KV_PER_CM, HIGHEST_KV_PER_CM
)
Z = (0.0, 0.0, 1.0)
# 2π I/(c h) in MHz for 1 Å³ and 1 W/cm²
MHZ_ANGSTROM3_W_PER_CM2 = 2 * math.pi * 1e-30 * 1e4 / (units.SPEED_OF_LIGHT_M_PER_S * units.PLANCK_J_S) * 1e-6
# ½ α F² in MHz of 1 Å³ in 1 kV/cm
MHZ_PER_ANGSTROM3 = 2 * math.pi * units.VACUUM_PERMITTIVITY_F_PER_M * 1e-30 * 1e10 / units.PLANCK_J_S * 1e-6
# standard deviation of a normal distribution with half of its values beyond ±0.2 D, as for the estimates
ESTIMATED_DIPOLE_D = 0.2 / 0.6745
POINTS = 201  # number of fields of a range without a count


def stark_map(
    top: Top,
    fields_kv_per_cm: ArrayLike,
    *,
    effects: Sequence[QuantumEffect] = (),
    tolerance_mhz: float = DEFAULT_TOLERANCE_MHZ,
    executor: Executor | None = None,
    **settings: Any,
) -> FieldMap:
    """Energies, effective dipoles and cosines of a top against a static field.

    Parameters
    ----------
    top : Top
        Top with `dipole_abc_debye`, and with `polarizability_abc_angstrom3` for light.
    fields_kv_per_cm : (n,)
        Field strengths; the map has each once, in rising order.
    effects : sequence of QuantumEffect
        Effects of a top with spins, the semi-rigid ones included; states are then |F M_F⟩.
    tolerance_mhz : float
        Largest truncation error of an energy.
    executor : Executor, optional
        Solves blocks in parallel.
    **settings
        Further fields of a `StarkRequest`: `j_highest`, `m_values`, `intensity_w_per_cm2`, `direction` (of any length), `jmax`,
        `diabatic_gap_mhz` and `most_at_edge`.

    Returns
    -------
    FieldMap
        Columns field_kv_per_cm, m (-1 where M is mixed), rank, energy_mhz, label, mu_eff_debye, costheta (with the field), cos2theta
        (with Z), block, edge_population, copies; with a gap `diabatic_label`.

    Raises
    ------
    ValueError
        For no dipole (and no light), fields beyond 1e5 kV/cm, a negative intensity, an M above J, or a J max that is too small.

    Notes
    -----
    Neglected: the polarizability in the static field (0.5 Δα E², below 1e-3 of the dipole's part), hyperfine coupling.
    """
    fields = tuple(ELECTRIC.checked(fields_kv_per_cm).tolist())
    request = StarkRequest(top, fields, tolerance_mhz=tolerance_mhz, hamiltonian=tuple(effects), **settings)
    return answer_stark(request, executor).states


def projections(
    top: Top, effects: Sequence[QuantumEffect], m_values: Sequence[float] | None, j_highest: int
) -> tuple[float, ...]:
    """|M| of the states in rising order, |M_F| of a top with spins; ValueError for values that do not occur."""
    total = 0
    if any(effect.spins(top) for effect in effects):
        from rotor.quantum.spins import scheme_of

        total = scheme_of(top, tuple(effects)).total
    possible = range(total % 2, 2 * j_highest + total + 1, 2)
    values = sorted({2 * m for m in m_values}) if m_values is not None else possible
    if not values or not set(values) <= set(possible):
        raise ValueError(
            f"m_values: {list(m_values or ())}: expected numbers from {possible[0] / 2:g} to {possible[-1] / 2:g} in steps of 1 "
            "(M and -M coincide)"
        )
    return tuple(m / 2 if m % 2 else int(m) // 2 for m in values)


def checked_direction(direction: Sequence[float]) -> tuple[float, float, float]:
    """The unit vector along a direction (3,); ValueError for zero and for numbers that are not finite."""
    vector = np.asarray(direction, dtype=np.float64)
    length = float(np.linalg.norm(vector)) if vector.shape == (3,) else math.nan
    if not (math.isfinite(length) and length > 0):
        raise ValueError(
            f"direction {np.asarray(direction).tolist()}: three finite numbers along X, Y, Z are expected, not all 0"
        )
    x, y, z = (vector / length).tolist()
    return x, y, z


def acting(
    top: Top,
    intensity_w_per_cm2: float,
    direction: tuple[float, float, float] = Z,
    effects: Sequence[QuantumEffect] = (),
) -> tuple[Contraction, Contraction | None]:
    """Contractions of the dipole with the direction of the field, and of the polarizability with Z; ValueError if nothing acts.

    Each of several states has its dipole; dipoles between states act too.
    """
    name = top.name or "this top"
    if top.kind == "spherical":
        raise ValueError(
            f"{name} is a spherical top: it has no dipole and no anisotropy, so that a field does not split its levels"
        )
    dipole = top.dipole_abc_debye
    if dipole is None and not intensity_w_per_cm2:
        raise ValueError(f"the dipole of {name} is not known: give one, in principal axes (D)")
    if not np.any(dipole or (0.0,)) and not intensity_w_per_cm2:
        raise ValueError(
            f"{name} has no dipole, which a map in a static field needs; its polarizability is left out there"
        )
    light = None
    if intensity_w_per_cm2:
        if top.polarizability_abc_angstrom3 is None:
            raise ValueError(f"the polarizability of {name} is not known: give one, in principal axes (Å³)")
        light = Contraction(top.polarizability_abc_angstrom3, np.outer(Z, Z))
    dipole_abc = dipole or (0.0, 0.0, 0.0)
    states = dipoles_by_state(top, dipole_abc, effects or effects_of(top, False))
    return Contraction(dipole_abc, direction, states if len(states) > 1 else {}), light


def dipole_derivative(top: Top, axis: int, effects: Sequence[QuantumEffect]) -> Contraction:
    """∂(dipole along Z)/∂μ for one component of the top's dipole, which applies to all states without a stated dipole."""
    x, y, z = np.eye(3)[axis].tolist()
    with_unit = dipoles_by_state(top, (x, y, z), effects)
    none = dipoles_by_state(top, (0.0, 0.0, 0.0), effects)
    states = {pair: tuple(np.subtract(moment, none[pair]).tolist()) for pair, moment in with_unit.items()}
    return Contraction(np.eye(3)[axis], Z, states if len(states) > 1 else {})


def figure_axis(top: Top) -> int:
    """The axis whose angle with Z is θ: the axis of a linear or symmetric top, else the principal axis nearest to the dipole."""
    if top.kind != "asymmetric":
        return 2 if top.kind == "oblate" else 0
    return int(np.argmax(np.abs(top.dipole_abc_debye or (1.0, 0.0, 0.0))))


@dataclass(frozen=True)
class StarkRequest:
    """A map of levels in an electric field; all values are checked when the request is made.

    top: with its dipole. fields_kv_per_cm: in any order. j_highest: highest J of the free levels in the map. m_values: |M|; None for all.
    intensity_w_per_cm2: of a laser along Z. direction: of the field. jmax: highest J of the basis; None for what tolerance_mhz needs.
    diabatic_gap_mhz: None for no diabatic labels. hyperfine: include the spins of the top's constants; m_values are then |M_F|.
    most_at_edge: largest population of a state in the two highest J of the basis; the error of cosines is about as large.
    hamiltonian: effects of a top with spins, instead of those that hyperfine means.
    """

    top: Top
    fields_kv_per_cm: tuple[float, ...] = declared(
        tuple(np.linspace(0.0, 100.0, POINTS).tolist()), Grid("kV/cm", points=POINTS),
        "Fields: start:stop[:count], of 201 by default, or a comma list (kV/cm)", "conditions.field", common=True,
        typed="0:100kV/cm:201",
    )  # fmt: skip
    j_highest: int = states_field()
    m_values: tuple[float, ...] | None = declared(
        None, Custom(read_m, list, "LIST", list[float]), "|M| of the states: 0,1; by default all. With spins |M_F|: 0.5,1.5",
        "observables.m", common=True, example=[0, 1],
    )  # fmt: skip
    intensity_w_per_cm2: float = declared(
        0.0, INTENSITY, "Intensity of a laser along Z, far from resonance (W/cm2)", "conditions.intensity"
    )
    direction: tuple[float, float, float] = declared(
        Z, Custom(read_direction, list, "ANGLE", list[float] | float | str),
        "Angle of the field with the light of the laser (degrees); M is mixed then",
        "conditions.direction", option="--tilt", typed="0 degrees", example=[0.0, 0.0, 1.0],
    )  # fmt: skip
    jmax: int | None = basis_field(30)
    tolerance_mhz: float = tolerance_field(1e-4, "1e-4 MHz")
    diabatic_gap_mhz: float | None = declared(
        None, Quantity("MHz", above=0, metavar="GAP"),
        "Follow states diabatically through avoided crossings narrower than this (MHz)", "observables.diabatic_gap", example="10 MHz",
    )  # fmt: skip
    hyperfine: bool = spins_field()
    most_at_edge: float = MOST_AT_EDGE
    hamiltonian: tuple[QuantumEffect, ...] = ()

    def __post_init__(self) -> None:
        check_fields(self)
        require_whole("j_highest", self.j_highest, 0, HIGHEST_J)
        projections(self.top, self.effects, self.m_values, self.j_highest)
        require_positive("most_at_edge", self.most_at_edge)
        checked_direction(self.direction)
        if self.tilted and self.m_values is not None:
            raise ValueError("m_values: a field at an angle with the light mixes M; leave them out")
        acting(self.top, self.intensity_w_per_cm2)

    @property
    def effects(self) -> tuple[QuantumEffect, ...]:
        """Effects with spins if these are requested; empty for the default Hamiltonian."""
        return effects_of(self.top, True) if self.hyperfine else self.hamiltonian

    @property
    def tilted(self) -> bool:
        """Whether the field is at an angle with Z."""
        x, y, _ = checked_direction(self.direction)
        return bool(x or y)

    @property
    def map(self) -> MapRequest:
        """Hamiltonian, fields and states of the map."""
        top, effects, unit = self.top, self.effects, checked_direction(self.direction)
        dipole, light = acting(top, self.intensity_w_per_cm2, unit, effects)
        terms = [FieldTerm(1, -units.MHZ_PER_DEBYE_KV_PER_CM, dipole)]
        if light is not None:
            terms.append(FieldTerm(0, -MHZ_ANGSTROM3_W_PER_CM2 * self.intensity_w_per_cm2, light))
        axis = np.eye(3)[figure_axis(top)]
        cosines = {"costheta": Contraction(axis, unit), "cos2theta": Contraction(np.outer(axis, axis), np.outer(Z, Z))}
        if top.internal_rotation is not None and any(effect.spins(top) for effect in effects):
            del cosines["cos2theta"]  # no elements of rank 2 with spins and internal rotation
        return MapRequest(
            top=top,
            effects=effects,
            terms=tuple(terms),
            observables=cosines,
            kind=ELECTRIC,
            fields=ELECTRIC.checked(self.fields_kv_per_cm),
            j_highest=self.j_highest,
            m_values=(0,) if self.tilted else projections(top, effects, self.m_values, self.j_highest),
            tolerance_mhz=self.tolerance_mhz,
            diabatic_gap_mhz=self.diabatic_gap_mhz,
            most_at_edge=self.most_at_edge,
        )


@dataclass(frozen=True, repr=False)
class StarkAnswer(MapAnswer):
    """The map of a request."""

    request: StarkRequest

    def conditions(self) -> dict[str, Any]:
        """The laser, the direction of the field, and the gap of diabatic labels."""
        return {
            "intensity_w_per_cm2": self.request.intensity_w_per_cm2,
            "field_direction": list(self.request.direction),
            "diabatic_gap_mhz": self.request.diabatic_gap_mhz,
        }

    def field_limits(self) -> list[Limit]:
        """The polarization by the static field; nothing without a field."""
        name, tensor = "polarization by the static field", self.request.top.polarizability_abc_angstrom3
        strongest = float(np.abs(self.states.fields).max())
        if not strongest:
            return []
        if tensor is None:
            return [Limit(name, None, "the polarizability is not known")]
        size = MHZ_PER_ANGSTROM3 * float(np.abs(np.linalg.eigvalsh(np.array(tensor))).max()) * strongest**2
        text = f"all levels are lower by about so much in {strongest:g} kV/cm, lines shift only by what differs between them"
        return [Limit(name, size, text)]

    def moment_terms(self) -> list[ErrorTerm]:
        """Errors of the dipole, and of the polarizability in light."""
        terms = [dipole_term(self.request.top, self.states)]
        if self.request.intensity_w_per_cm2:
            terms.append(ErrorTerm(None, "the polarizability has no stated uncertainty"))
        return terms


def answer_stark(request: StarkRequest, executor: Executor | None = None) -> StarkAnswer:
    """The map of a request. executor: solves blocks of states in parallel.

    >>> from rotor.tops.top import Top
    >>> rod = Top.from_constants("B=6000 MHz", dipole_abc_debye=(0.7, 0, 0))
    >>> answer_stark(StarkRequest(rod, (0.0, 1.0), j_highest=0)).states.energy_mhz.round(3).tolist()  # -μ²E²/6B
    [0.0, -3.449]
    """
    return StarkAnswer(request, field_map(request.map, request.jmax, executor))


def dipole_term(top: Top, states: FieldMap) -> ErrorTerm:
    """One standard deviation of the energies from the error of an estimated dipole; other dipoles have no stated uncertainty."""
    dipole = float(np.linalg.norm(top.dipole_abc_debye or (0.0,)))
    moved = np.abs(states.field * states.slope) * units.MHZ_PER_DEBYE_KV_PER_CM
    if not moved.any():
        return ErrorTerm(0.0, "the dipole moves no energy")
    if not top.dipole_source.startswith("estimate"):
        return ErrorTerm(None, "the dipole has no stated uncertainty")
    largest = float(np.nanmax(moved)) * ESTIMATED_DIPOLE_D / dipole
    return ErrorTerm(largest, f"dipole estimated within {ESTIMATED_DIPOLE_D:.1g} D", "a measured dipole")
