"""Zeeman effect of molecules without electron spin: a magnetic field along Z and the moment of the rotation.

    H = H0 - μ_N B ½ Σ_ij g_ij (Φ_Zi J_j + J_j Φ_Zi),           μ_N/h = 7.6226 MHz/T

with the rotational g tensor along a, b, c (W. H. Flygare, Chem. Rev. 74, 653 (1974), eq. 8), Φ_Zi the direction cosines and J_j in the
molecule. J of a linear top is perpendicular to its axis, so that H = -g μ_N B J_Z and E = E0 - g μ_N B M exactly; a symmetric top has
g⊥ J_Z + (g∥ - g⊥) Φ_Zz J_z. M is a good quantum number, and M and -M differ. To second order the magnetisability χ acts,

    -½ B² χ_ZZ,          1e-6 erg/(G² mol) = 0.0250607 MHz/T²,

about 0.1 MHz/T² for an anisotropy of ten of these units. With spins, -μ_N B Σ g_I I_Z is added; the shielding of the nuclei is neglected.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.stark import projections
from rotor.quantum.fields.field_map import FieldMap, field_map
from rotor.quantum.fields.map_request import FieldKind, FieldTerm, MapRequest
from rotor.quantum.fields.operators import Contraction, Magnet
from rotor.units import AVOGADRO_PER_MOL, NUCLEAR_MAGNETON_MHZ_PER_T, PLANCK_J_S

if TYPE_CHECKING:
    from rotor.tops.top import Top

HIGHEST_TESLA = 1000.0
DEFAULT_TOLERANCE_MHZ = 1e-6
MAGNETIC = FieldKind(
    "T", "fields_tesla", "field_tesla", "moment_nuclear_magnetons", NUCLEAR_MAGNETON_MHZ_PER_T, HIGHEST_TESLA
)
MHZ_PER_T2 = 1e-11 / (AVOGADRO_PER_MOL * PLANCK_J_S)  # value of 1e-6 erg/(G² mol), which is 1e-5 J/(T² mol)
Z = (0.0, 0.0, 1.0)


def zeeman_map(
    top: Top,
    fields_tesla: ArrayLike,
    g: ArrayLike,
    *,
    magnetisability: ArrayLike | None = None,
    effects: Sequence[QuantumEffect] = (),
    nuclear_g: Mapping[str, float] | None = None,
    j_highest: int = 2,
    jmax: int | None = None,
    tolerance_mhz: float = DEFAULT_TOLERANCE_MHZ,
    executor: Executor | None = None,
) -> FieldMap:
    """Energies of a top against a magnetic field along Z.

    Parameters
    ----------
    top : Top
        A linear, symmetric or asymmetric top.
    fields_tesla : (n,)
        Field strengths; the map has each once, in rising order.
    g : float, (3,) or (3, 3)
        Rotational g tensor along a, b, c; one number or three for a linear top, whose g_aa has no effect.
    magnetisability : (3,) or (3, 3), optional
        χ along a, b, c in 1e-6 erg/(G² mol), with its sign (diamagnetic: negative).
    effects : sequence of QuantumEffect
        Effects of a linear or asymmetric top with spins, the semi-rigid ones included; states are then |F M_F⟩.
    nuclear_g : mapping, optional
        g = μ/(μ_N I) of nuclei by the names of their spins; other nuclei do not interact with the field.
    j_highest : int
        Highest J of the free levels in the map.
    jmax : int, optional
        Highest J of the basis; by default what the tolerance needs.
    tolerance_mhz : float
        Largest truncation error of an energy.
    executor : Executor, optional
        Solves blocks in parallel.

    Returns
    -------
    FieldMap
        Columns field_tesla, m (with its sign), rank, energy_mhz, label, moment_nuclear_magnetons (-dE/dB), block, ...

    Raises
    ------
    ValueError
        For a g tensor or a magnetisability that does not have the symmetry of a linear or symmetric top, fields beyond 1000 T, and g
        of nuclei that the effects do not have.

    Examples
    --------
    >>> from rotor.tops.top import Top
    >>> states = zeeman_map(Top.from_constants("B=6000 MHz"), [0.0, 1.0], -0.03, j_highest=1)
    >>> rows = states.curve("1", 1)
    >>> (states.energy_mhz[rows] - 12000).round(4).tolist()  # 0.03 μ_N B
    [0.0, 0.2287]
    """
    request = magnetic_map_request(
        top,
        fields_tesla,
        g,
        magnetisability=magnetisability,
        effects=effects,
        nuclear_g=nuclear_g,
        j_highest=j_highest,
        tolerance_mhz=tolerance_mhz,
    )
    return field_map(request, jmax, executor)


def magnetic_map_request(
    top: Top,
    fields_tesla: ArrayLike,
    g: ArrayLike,
    *,
    magnetisability: ArrayLike | None,
    effects: Sequence[QuantumEffect],
    nuclear_g: Mapping[str, float] | None,
    j_highest: int,
    tolerance_mhz: float,
) -> MapRequest:
    """The Hamiltonian, fields and states of a map, from the parameters of `zeeman_map`, with its errors."""
    tensor, nuclei = checked_g(top, g), dict(nuclear_g or {})
    if nuclei and not effects:
        raise ValueError("nuclear_g: give the effects that have these spins too")
    terms = [FieldTerm(1, -NUCLEAR_MAGNETON_MHZ_PER_T, Magnet(tensor, nuclei))]
    if magnetisability is not None:
        chi = Contraction(_axial_tensor(top, magnetisability, "χ"), np.outer(Z, Z))
        terms.append(FieldTerm(2, -0.5 * MHZ_PER_T2, chi))
    positive = projections(top, effects, None, j_highest)
    return MapRequest(
        top=top,
        effects=tuple(effects),
        terms=tuple(terms),
        observables={},
        kind=MAGNETIC,
        fields=MAGNETIC.checked(fields_tesla),
        j_highest=j_highest,
        m_values=tuple(sorted({*positive, *(-m for m in positive)})),
        tolerance_mhz=tolerance_mhz,
    )


def checked_g(top: Top, g: ArrayLike) -> Floats:
    """The g tensor (3, 3) along a, b, c; ValueError unless it is finite and fits the kind of top."""
    if top.kind == "spherical":
        raise ValueError("a spherical top has an isotropic g: E = E0 - g μ_N B M; no map is needed")
    return _axial_tensor(top, g, "g")


def _axial_tensor(top: Top, values: ArrayLike, name: str) -> Floats:
    """A tensor (3, 3) from one number, three or nine; ValueError unless it has the symmetry of the top."""
    array = np.asarray(values, dtype=np.float64)
    tensor = np.diag(np.broadcast_to(array, 3)) if array.ndim < 2 and array.size in (1, 3) else array
    if tensor.shape != (3, 3) or not np.isfinite(tensor).all():
        raise ValueError(f"a {name} tensor is one number, three, or (3, 3), finite; got {array.tolist()}")
    if top.kind != "asymmetric":
        axis = 2 if top.kind == "oblate" else 0
        if not Contraction(tensor, np.outer(Z, Z)).axial_about(axis):
            raise ValueError(
                f"the {name} tensor of a {top.kind} top is symmetric about {'abc'[axis]}; got {tensor.tolist()}"
            )
    return np.array(tensor)
