"""Facts of a top under the keys that all reports, files and JSON of the package use."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rotor.units import MHZ_PER_CM

if TYPE_CHECKING:
    from rotor.tops.kind import KindOfTop
    from rotor.tops.top import Top


def top_facts(top: Top) -> dict[str, Any]:
    """Name, constants, kind, moments, frame, dipole, polarizability, spin weights and sources of a top.

    The keys are those of docs/command_line.md; unknown values are None.

    >>> from rotor.tops.top import Top
    >>> facts = top_facts(Top.from_constants("A=10 B=6 C=4 MHz"))
    >>> facts["kind"], facts["kappa"].__round__(6), facts["dipole_abc_debye"]
    ('asymmetric', -0.333333, None)
    """
    constants, abc = top.constants, top.rotational_constants_mhz
    frame, near = top.frame, top.symmetry.near if top.symmetry else None
    return {
        "name": top.name or None,
        "formula": top_formula(top),
        "mass_u": top.mass_u,
        "kind": top.kind,
        "kind_decision": _decision(top.kind_of_top) if top.kind_of_top else None,
        "point_group": top.symmetry.point_group if top.symmetry else None,
        "symmetry_number": top.symmetry.symmetry_number if top.symmetry else None,
        "near_point_group": near.point_group if near else None,
        "near_displacement_angstrom": near.displacement_angstrom if near else None,
        "constants_mhz": dict(constants.values),
        "uncertainties_mhz": dict(constants.uncertainties),
        "estimated_errors_mhz": top.estimated_errors_mhz,
        "reduction": constants.reduction,
        "representation": constants.representation,
        "rotational_constants_mhz": abc,
        "rotational_constants_cm": [x / MHZ_PER_CM for x in abc],
        "kappa": top.kappa,
        "moments_u_angstrom2": top.moments_u_angstrom2,
        "planar_moments_u_angstrom2": top.planar_moments_u_angstrom2,
        "inertial_defect_u_angstrom2": top.inertial_defect_u_angstrom2,
        "frame": {"axes": frame.axes, "centre_angstrom": frame.centre} if frame else None,
        "dipole_abc_debye": top.dipole_abc_debye,
        "dipole_source": top.dipole_source or None,
        "polarizability_abc_angstrom3": top.polarizability_abc_angstrom3,
        "polarizability_source": top.polarizability_source or None,
        "spin_weights": top.spin_weights.to_mapping(),
        "spin_weights_source": top.weights_source or None,
        "spin_constants_mhz": dict(top.spin_constants.values) if top.spin_constants else None,
        "spins": {name: twice / 2 for name, twice in top.spin_constants.twice.items()} if top.spin_constants else None,
        "spin_constants_source": (top.spin_constants.source or None) if top.spin_constants else None,
        "further_states": _states(top),
        "source": top.source or None,
        "notes": list(top.notes),
    }


_FROM_CONSTANTS = (
    "kind", "constants_mhz", "uncertainties_mhz", "estimated_errors_mhz", "reduction", "rotational_constants_mhz",
    "rotational_constants_cm", "kappa", "moments_u_angstrom2", "planar_moments_u_angstrom2",
    "inertial_defect_u_angstrom2", "spin_weights", "constants", "dipole_abc_debye",
)  # fmt: skip
NO_CONSTANTS = "the parameters of the file have no names here; levels follow from its parameter codes"


def without_constants(facts: dict[str, Any]) -> dict[str, Any]:
    """The facts of a top that only carries the symmetry of a file: null for constants and quantities derived from them.

    `constants_reason` has the reason.

    >>> without_constants({"name": "x", "constants_mhz": {"B": 2.0}})["constants_mhz"] is None
    True
    """
    return {key: None if key in _FROM_CONSTANTS else value for key, value in facts.items()} | {
        "constants_reason": NO_CONSTANTS
    }


def _states(top: Top) -> dict[str, Any] | None:
    """Further vibrational states: constants and couplings, names, weights and dipoles."""
    states = top.states
    if states is None:
        return None
    return {
        "constants_mhz": dict(states.values),
        "names": [states.name_of(v) for v in range(states.count)],
        "symmetry": states.symmetry or None,
        "spin_weights": {str(v): weights.to_mapping() for v, weights in states.weights.items()},
        "dipoles_abc_debye": {f"{low},{up}" if low != up else f"{up}": m for (up, low), m in states.dipoles.items()},
        "source": states.source or None,
    }


def top_formula(top: Top) -> str | None:
    """The formula of the molecule of a top; None for constants alone."""
    return top.molecule.formula if top.molecule is not None else None


def _decision(kind: KindOfTop) -> dict[str, Any]:
    return {
        "kind": kind.kind,
        "ia_over_ic": kind.linearity,
        "ib_minus_ia_over_ib": kind.ab,
        "ic_minus_ib_over_ic": kind.bc,
        "linear_below": kind.linear_below,
        "equal_within": kind.equal_within,
        "margin": kind.margin,
    }
