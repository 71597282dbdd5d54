"""Kind of top (linear, spherical, prolate, oblate, asymmetric) from moments of inertia and from symmetry."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from rotor.frozen import dataclass
from rotor.geometry.inertia import EQUAL_MOMENTS, LINEAR_BELOW

if TYPE_CHECKING:
    from rotor.molecules.symmetry.point_group import Symmetry


@dataclass(frozen=True)
class KindOfTop:
    """The kind of a geometry, with the numbers that decide it: I_a/I_c, relative differences of moments, and tolerances."""

    kind: str
    linearity: float  # I_a / I_c
    ab: float  # (I_b - I_a) / I_b
    bc: float  # (I_c - I_b) / I_c
    linear_below: float = LINEAR_BELOW
    equal_within: float = EQUAL_MOMENTS
    reason: str = ""

    @property
    def margin(self) -> float:
        """The factor between the deciding number and its tolerance; near 1 the kind is doubtful."""
        deciding = {
            "linear": [self.linear_below / max(self.linearity, 1e-300)],
            "spherical": [self.equal_within / max(self.ab, self.bc, 1e-300)],
            "prolate": [self.equal_within / max(self.bc, 1e-300), self.ab / self.equal_within],
            "oblate": [self.equal_within / max(self.ab, 1e-300), self.bc / self.equal_within],
            "asymmetric": [self.ab / self.equal_within, self.bc / self.equal_within],
        }[self.kind]
        if self.kind not in ("linear",):
            deciding.append(self.linearity / self.linear_below)
        return min(deciding)


def kind_from_moments(
    moments: ArrayLike, *, linear_below: float = LINEAR_BELOW, equal_within: float = EQUAL_MOMENTS
) -> KindOfTop:
    """Kind of top from principal moments I_a ≤ I_b ≤ I_c (any unit).

    Linear if I_a/I_c < `linear_below`; two moments are equal if they differ by less than `equal_within` of the larger.

    >>> kind_from_moments([1.0, 2.0, 2.0]).kind
    'prolate'
    """
    a, b, c = (float(m) for m in np.asarray(moments, dtype=float))
    if not c > 0:
        raise ValueError("all moments of inertia are zero: a single atom (or atoms at one point) does not rotate")
    linearity, ab, bc = a / c, (b - a) / b, (c - b) / c
    if linearity < linear_below:
        kind = "linear"
    else:
        kind = {(True, True): "spherical", (True, False): "oblate", (False, True): "prolate"}.get(
            (ab < equal_within, bc < equal_within), "asymmetric"
        )
    return KindOfTop(kind, linearity, ab, bc, linear_below, equal_within)


def kind_with_symmetry(by_numbers: KindOfTop, symmetry: Symmetry) -> KindOfTop:
    """The kind that the point group determines, else the kind from the moments.

    A group T, O or I means a spherical top, an axis C3 or higher, or S4, a symmetric top, C∞ a linear molecule. Lower
    groups determine nothing: equal moments are accidental there.
    """
    group = symmetry.rotation_group
    if symmetry.linear:
        kind = "linear"
    elif group in ("T", "O", "I"):
        kind = "spherical"
    elif symmetry.point_group in ("D2d", "S4") or (group[1:].isdigit() and int(group[1:]) > 2):
        kind = "prolate" if by_numbers.bc < by_numbers.ab else "oblate"
    else:
        return replace(by_numbers, reason=f"{symmetry.point_group} determines no kind; by the moments")
    return replace(by_numbers, kind=kind, reason=f"by symmetry: {symmetry.point_group}")
