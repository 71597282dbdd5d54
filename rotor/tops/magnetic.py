"""Magnetic tensors of a molecule without electron spin: the rotational g tensor and the magnetisability.

Both are given along the principal axes a, b, c. g is dimensionless; the rotational moment is μ_N ½ Σ g_ij (Φ_Zi J_j + J_j Φ_Zi). The
magnetisability χ is in 1e-6 erg/(G² mol), as in tables, negative for diamagnetic molecules (W. H. Flygare, Chem. Rev. 74, 653
(1974)). Both belong to one isotopologue: g varies roughly as 1/I and with the centre of mass.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from rotor.frozen import dataclass

Vector = tuple[float, float, float]
Tensor = tuple[Vector, Vector, Vector]

ELEMENTS = ("aa", "bb", "cc", "ab", "ac", "bc")


@dataclass(frozen=True)
class MagneticTensors:
    """g (3, 3), the magnetisability (3, 3) in 1e-6 erg/(G² mol) or None, and their source.

    g need not be symmetric. Raises ValueError for non-finite numbers and an asymmetric magnetisability.

    >>> MagneticTensors(make_tensor((0.7, 0.3, 0.2))).g[0]
    (0.7, 0.0, 0.0)
    """

    g: Tensor
    magnetisability: Tensor | None = None
    source: str = ""

    def __post_init__(self) -> None:
        for name, tensor in (("g", self.g), ("magnetisability", self.magnetisability)):
            array = np.zeros((3, 3)) if tensor is None else np.asarray(tensor, dtype=float)
            if array.shape != (3, 3) or not np.isfinite(array).all():
                raise ValueError(f"{name}: a tensor (3, 3) of finite numbers is expected; got {array.tolist()}")
        if self.magnetisability is not None and not np.allclose(
            self.magnetisability, np.transpose(self.magnetisability)
        ):
            raise ValueError(f"magnetisability: a symmetric tensor is expected; got {self.magnetisability}")


def make_tensor(numbers: ArrayLike) -> Tensor:
    """A tensor from its diagonal (3,), or from aa, bb, cc, ab, ac, bc (6,).

    >>> make_tensor([1, 2, 3, 0, 0, 0.5])[1]
    (0.0, 2.0, 0.5)
    """
    values = np.asarray(numbers, dtype=float).ravel().tolist()
    if len(values) not in (3, 6):
        raise ValueError(f"a tensor is aa, bb, cc or aa, bb, cc, ab, ac, bc; got {len(values)} numbers")
    aa, bb, cc, ab, ac, bc = (*values, 0.0, 0.0, 0.0)[:6]
    return (aa, ab, ac), (ab, bb, bc), (ac, bc, cc)


def tensor_for(kind: str, numbers: Sequence[float]) -> Tensor:
    """A tensor for a kind of top: 3 or 6 elements; along and across the axis of a symmetric top; or across that of a linear top.

    The element along the axis of a linear top has no effect; it is set to 0 if a single number is given.

    >>> tensor_for("linear", [-0.03])
    ((0.0, 0.0, 0.0), (0.0, -0.03, 0.0), (0.0, 0.0, -0.03))
    """
    if not np.isfinite(numbers).all():
        raise ValueError(f"{', '.join(f'{x:g}' for x in numbers)}: expected finite numbers")
    if len(numbers) == 1 and kind == "linear":
        return make_tensor([0.0, numbers[0], numbers[0]])
    if len(numbers) == 1 and kind == "spherical":
        return make_tensor([numbers[0]] * 3)
    if len(numbers) == 2 and kind in ("linear", "prolate", "oblate"):
        along, across = numbers
        return make_tensor([across, across, along] if kind == "oblate" else [along, across, across])
    if len(numbers) in (3, 6):
        return make_tensor(numbers)
    raise ValueError(
        f"{len(numbers)} numbers for a top of the kind {kind}: expected aa,bb,cc or aa,bb,cc,ab,ac,bc; parallel,perpendicular "
        "of a linear or symmetric top; or the element across the axis of a linear top"
    )
