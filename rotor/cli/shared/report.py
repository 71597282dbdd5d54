"""What a top is, as content for JSON and as lines for people; the same for every verb that prints one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rotor.units import MHZ_PER_CM

if TYPE_CHECKING:
    from rotor.thermo import PartitionFunction
    from rotor.tops.constants import Constants
    from rotor.tops.kind import KindOfTop
    from rotor.tops.top import Top

KINDS = {
    "linear": "linear molecule",
    "spherical": "spherical top",
    "prolate": "prolate symmetric top",
    "oblate": "oblate symmetric top",
    "asymmetric": "asymmetric top",
}


def describe(top: Top, text: str, command: str) -> dict[str, Any]:
    """Everything about a top but its partition function, by the keys of docs/command_line.md."""
    import rotor

    constants, abc = top.constants, top.rotational_constants_mhz
    near = top.symmetry.near if top.symmetry else None
    frame = top.frame
    return {
        "rotor_version": rotor.__version__,
        "command": command,
        "input": text,
        "name": top.name or None,
        "formula": formula_of(top),
        "mass_u": top.mass_u,
        "kind": top.kind,
        "kind_decision": _decision(top.kind_of_top) if top.kind_of_top else None,
        "point_group": top.symmetry.point_group if top.symmetry else None,
        "symmetry_number": top.symmetry.symmetry_number if top.symmetry else None,
        "near_point_group": near.point_group if near else None,
        "near_displacement_angstrom": near.displacement_angstrom if near else None,
        "constants_mhz": dict(constants.values),
        "uncertainties_mhz": dict(constants.uncertainties),
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
        "source": top.source or None,
        "notes": list(top.notes),
    }


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


def formula_of(top: Top) -> str | None:
    """The formula of the molecule behind a top; None for constants alone."""
    return top.molecule.formula if top.molecule is not None else None


def q_record(partition: PartitionFunction, classical: float) -> dict[str, Any]:
    """One row of a table of Q."""
    return {
        "temperature_k": partition.temperature_k,
        "q": partition.q,
        "classical": classical,
        "jmax": partition.jmax,
        "relative_error": partition.relative_error,
        "source": partition.source,
    }


def heading(top: Top) -> str:
    """Name, formula and kind in one line."""
    names = ", ".join(dict.fromkeys(filter(None, (top.name, formula_of(top))))) or "constants"
    kappa = f" (κ = {top.kappa:.4f})" if top.kind == "asymmetric" and top.kappa is not None else ""
    return f"{names}: {KINDS[top.kind]}{kappa}"


def constants_text(top: Top) -> str:
    """A, B, C, and how many distortion constants go with them."""
    constants = top.constants
    rigid = [name for name in constants.values if name in "ABC"]
    text = ", ".join(f"{name} {constants[name]:.10g}" for name in rigid) + " MHz"
    more = len(constants.values) - len(rigid)
    text += f", and {more} of distortion" if more else ", rigid"
    return text + (f" ({form_text(constants)})" if more and constants.reduction else "")


def form_text(constants: Constants) -> str:
    """Reduction and representation of an asymmetric top."""
    reduction = f"{constants.reduction}-reduction, " if constants.reduction else ""
    return f"{reduction}{constants.representation}"


def vector_text(vector: Sequence[float] | None, names: Sequence[str] = ("μa", "μb", "μc")) -> str:
    """A dipole as `μa 0, μb 1.8546, μc 0 D`."""
    if vector is None:
        return "not known"
    return ", ".join(f"{name} {round(x, 6) + 0.0:.6g}" for name, x in zip(names, vector, strict=True)) + " D"


def tensor_text(top: Top) -> str:
    """A polarizability as `aa 1.528, bb 1.468, cc 1.415 Å³`, with the elements off the diagonal that are not 0."""
    tensor = top.polarizability_abc_angstrom3
    if tensor is None:
        return "isotropic by symmetry" if top.kind == "spherical" else "not known"
    names = (("aa", 0, 0), ("bb", 1, 1), ("cc", 2, 2), ("ab", 0, 1), ("ac", 0, 2), ("bc", 1, 2))
    shown = [f"{name} {tensor[i][k]:.6g}" for name, i, k in names if i == k or tensor[i][k]]
    return ", ".join(shown) + " Å³"


def weights_text(mapping: Mapping[str, int]) -> str:
    """Spin weights as `ee 1, eo 3, oe 3, oo 1`."""
    return ", ".join(f"{name} {weight}" for name, weight in mapping.items()) or "not given: 1 for every level"


def with_source(text: str, source: str | None) -> str:
    """A fact and where it is from."""
    return f"{text}; {source}" if source else text


def q_text(record: Mapping[str, Any]) -> str:
    """Q and what is known about it."""
    return f"{record['q']:.6g}, {record['source']}; classical limit {record['classical']:.6g}"
