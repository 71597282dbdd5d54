"""Zeeman effect of molecules without electron spin: a magnetic field along Z and the moment of the rotation.

    H = H0 - μ_N B ½ Σ_ij g_ij (Φ_Zi J_j + J_j Φ_Zi),           μ_N/h = 7.6226 MHz/T

with the rotational g tensor along a, b, c (W. H. Flygare, Chem. Rev. 74, 653 (1974), eq. 8), Φ_Zi the direction cosines and J_j in the
molecule. J of a linear top is perpendicular to its axis, so that H = -g μ_N B J_Z and E = E0 - g μ_N B M exactly; a symmetric top has
g⊥ J_Z + (g∥ - g⊥) Φ_Zz J_z. M is a good quantum number, and M and -M differ. To second order the magnetisability χ acts,

    -½ B² χ_ZZ,          1e-6 erg/(G² mol) = 0.0250607 MHz/T²,

about 0.1 MHz/T² for an anisotropy of ten of these units. With spins, -μ_N B Σ g_I I_Z is added; the shielding of the nuclei is neglected.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats
from rotor.checks import require_whole
from rotor.molecules.nuclei import isotope
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.effects.stark import DEFAULT_TOLERANCE_MHZ, HIGHEST_J, Z, projections
from rotor.quantum.estimates.limits import Limit
from rotor.quantum.fields.answer import MapAnswer
from rotor.quantum.fields.blocks import Contraction, Magnet
from rotor.quantum.fields.field_map import FieldMap, field_map
from rotor.quantum.fields.inputs import basis_field, states_field, tolerance_field
from rotor.quantum.fields.map_request import FieldKind, FieldTerm, MapRequest
from rotor.quantum.hamiltonian_input import spins_field
from rotor.requests.budget import ErrorTerm
from rotor.requests.field import SPINS, check_fields, declared
from rotor.requests.lists import Pairs
from rotor.requests.readers import Grid
from rotor.tops.magnetic import MagneticTensors
from rotor.units import AVOGADRO_PER_MOL, NUCLEAR_MAGNETON_MHZ_PER_T, PLANCK_J_S

if TYPE_CHECKING:
    from rotor.tops.top import Top

HIGHEST_TESLA = 1000.0
MOST_G = 100.0  # of the rotation, in nuclear magnetons per ħ
MAGNETIC = FieldKind(
    "T", "fields_tesla", "field_tesla", "moment_nuclear_magnetons", NUCLEAR_MAGNETON_MHZ_PER_T, HIGHEST_TESLA
)
MHZ_PER_T2 = 1e-11 / (AVOGADRO_PER_MOL * PLANCK_J_S)  # value of 1e-6 erg/(G² mol), which is 1e-5 J/(T² mol)
POINTS = 51  # number of fields of a range without a count


def zeeman_map(
    top: Top,
    fields_tesla: ArrayLike,
    g: ArrayLike,
    *,
    magnetisability: ArrayLike | None = None,
    effects: Sequence[QuantumEffect] = (),
    executor: Executor | None = None,
    **settings: Any,
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
    executor : Executor, optional
        Solves blocks in parallel.
    **settings
        Further fields of a `ZeemanRequest`: `j_highest`, `jmax`, `tolerance_mhz` and `nuclear_g` of nuclei of the effects; other nuclei
        do not interact with the field.

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
    chi = None if magnetisability is None else _axial_tensor(top, magnetisability, "χ").tolist()
    if settings.get("nuclear_g") and not effects:
        raise ValueError("nuclear_g: give the effects that have these spins too")
    turning = replace(top, magnetic=MagneticTensors(checked_g(top, g).tolist(), chi))
    fields = tuple(MAGNETIC.checked(fields_tesla).tolist())
    return answer_zeeman(ZeemanRequest(turning, fields, hamiltonian=tuple(effects), **settings), executor).states


def checked_g(top: Top, g: ArrayLike) -> Floats:
    """The g tensor (3, 3) along a, b, c; ValueError unless its elements are at most `MOST_G` and it fits the kind of top."""
    if top.kind == "spherical":
        raise ValueError("a spherical top has an isotropic g: E = E0 - g μ_N B M; no map is needed")
    tensor = _axial_tensor(top, g, "g")
    if np.abs(tensor).max() > MOST_G:
        raise ValueError(
            f"g: {np.abs(tensor).max():g} is no g of the rotation, a moment in nuclear magnetons per ħ: nuclei that turn give Z/A, at most "
            f"1, and electrons take from it or add to it; expected at most {MOST_G:g}"
        )
    return tensor


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


@dataclass(frozen=True)
class ZeemanRequest:
    """A map of levels in a magnetic field; all values are checked when the request is made.

    top: with its g tensor in `magnetic`. fields_tesla: in any order. j_highest: highest J of the free levels in the map. jmax: highest J of
    the basis; None for what tolerance_mhz needs. hyperfine: include the spins of the top's constants. nuclear_g: g = μ/(μ_N I) by the names
    of spins; by default that of the isotope. An electron spin needs a value. hamiltonian: effects of a top with spins, instead of those
    that hyperfine means; g of their spins is then nuclear_g alone.
    """

    top: Top
    fields_tesla: tuple[float, ...] = declared(
        tuple(np.linspace(0.0, 5.0, POINTS).tolist()), Grid("T", points=POINTS),
        "Fields: start:stop[:count], of 51 by default, or a comma list (T, mT or G)", "conditions.field", common=True, typed="0:5T:51",
    )  # fmt: skip
    j_highest: int = states_field()
    jmax: int | None = basis_field(12)
    tolerance_mhz: float = tolerance_field(DEFAULT_TOLERANCE_MHZ, "1e-6 MHz")
    hyperfine: bool = spins_field()
    nuclear_g: Mapping[str, float] | None = declared(
        None, Pairs(float, "spin", "14N=0.4038"),
        "g = moment/(nuclear magneton x spin) of spins, 14N=0.4038,...; by default of the isotope", "magnetic.nuclear_g",
        example={"14N": 0.4038}, panel=SPINS,
    )  # fmt: skip
    hamiltonian: tuple[QuantumEffect, ...] = ()

    def __post_init__(self) -> None:
        check_fields(self)
        require_whole("j_highest", self.j_highest, 0, HIGHEST_J)
        MAGNETIC.checked(self.fields_tesla)
        checked_g(self.top, self.magnetic.g)
        if self.nuclear_g and not (self.hyperfine or self.hamiltonian):
            raise ValueError("nuclear_g: belongs to spins; ask for the hyperfine structure too")
        _ = self.effects, self.spin_g

    @property
    def magnetic(self) -> MagneticTensors:
        """The tensors of the top; ValueError if they are not known."""
        if self.top.magnetic is None:
            raise ValueError(
                f"the rotational g tensor of {self.top.name or 'this top'} is not known: give one, in principal axes"
            )
        return self.top.magnetic

    @property
    def effects(self) -> tuple[QuantumEffect, ...]:
        """Effects with spins if these are requested; empty for the default Hamiltonian."""
        return effects_of(self.top, True) if self.hyperfine else self.hamiltonian

    @property
    def map(self) -> MapRequest:
        """Hamiltonian, fields and states of the map."""
        magnetic, effects = self.magnetic, self.effects
        terms = [FieldTerm(1, -NUCLEAR_MAGNETON_MHZ_PER_T, Magnet(np.array(magnetic.g), self.spin_g))]
        if magnetic.magnetisability is not None:
            chi = Contraction(_axial_tensor(self.top, magnetic.magnetisability, "χ"), np.outer(Z, Z))
            terms.append(FieldTerm(2, -0.5 * MHZ_PER_T2, chi))
        positive = projections(self.top, effects, None, self.j_highest)
        return MapRequest(
            top=self.top,
            effects=effects,
            terms=tuple(terms),
            observables={},
            kind=MAGNETIC,
            fields=MAGNETIC.checked(self.fields_tesla),
            j_highest=self.j_highest,
            m_values=tuple(sorted({*positive, *(-m for m in positive)})),
            tolerance_mhz=self.tolerance_mhz,
        )

    @property
    def spin_g(self) -> dict[str, float]:
        """g of each spin, from the request or the isotope; ValueError if it is not known."""
        constants, requested = self.top.spin_constants, dict(self.nuclear_g or {})
        if not self.hyperfine or constants is None:
            return requested
        if unknown := sorted(requested.keys() - constants.twice.keys()):
            raise ValueError(f"nuclear_g: {', '.join(unknown)}: the spins of this top are {', '.join(constants.twice)}")
        for name, value in requested.items():
            if not math.isfinite(value):
                raise ValueError(f"nuclear_g: {name} = {value}: a finite number is expected")
        return {name: float(requested[name]) if name in requested else _g_of(name) for name in constants.twice}


def _g_of(name: str) -> float:
    """g of the isotope after which a spin is named, such as 35Cl_1."""
    try:
        g = isotope(name.partition("_")[0]).g_factor
    except ValueError:
        g = None
    if g is None:
        raise ValueError(f"nuclear_g: the g of {name} is not known; give it")
    return g


@dataclass(frozen=True, repr=False)
class ZeemanAnswer(MapAnswer):
    """The map of a request."""

    request: ZeemanRequest

    def conditions(self) -> dict[str, Any]:
        """The tensors of the top and g of its nuclei."""
        magnetic = self.request.magnetic
        return {
            "g_abc": magnetic.g,
            "magnetisability_abc": magnetic.magnetisability,
            "magnetic_source": magnetic.source or None,
            "nuclear_g": self.request.spin_g,
        }

    def field_limits(self) -> list[Limit]:
        """See `magnetic_limits`."""
        return magnetic_limits(self.request)

    def moment_terms(self) -> list[ErrorTerm]:
        """The error of the g tensor."""
        if self.states.fields.any():
            return [ErrorTerm(None, "the g tensor has no stated uncertainty")]
        return [ErrorTerm(0.0, "no field acts")]


def magnetic_limits(request: ZeemanRequest) -> list[Limit]:
    """Neglected effects of the field: moments of nuclei without hyperfine structure, and an unknown magnetisability.

    >>> from rotor.tops.magnetic import MagneticTensors, tensor_for
    >>> from rotor.tops.top import Top
    >>> rod = Top.from_constants("B=6000 MHz", magnetic=MagneticTensors(tensor_for("linear", [-0.03])))
    >>> [limit.name for limit in magnetic_limits(ZeemanRequest(rod, (0.0, 1.0)))]
    ['magnetisability']
    """
    limits, strongest = [], max(abs(field) for field in request.fields_tesla)
    nuclei = () if request.top.molecule is None else request.top.molecule.nuclei
    moments = {nucleus.label: abs(nucleus.g_factor or 0.0) * nucleus.spin for nucleus in nuclei if nucleus.spin > 0}
    if moments and not request.hyperfine:
        size = max(moments.values()) * NUCLEAR_MAGNETON_MHZ_PER_T * strongest
        text = f"{', '.join(sorted(moments))}: energies in {strongest:g} T, not lines between states of one orientation"
        limits.append(Limit("magnetic moments of nuclei", size, text))
    if request.magnetic.magnetisability is None:
        text = f"levels shift with the square of the field, up to {strongest:g} T"
        limits.append(Limit("magnetisability", None, text))
    return limits


def answer_zeeman(request: ZeemanRequest, executor: Executor | None = None) -> ZeemanAnswer:
    """The map of a request; `zeeman_map` has an example. executor: solves blocks of states in parallel."""
    return ZeemanAnswer(request, field_map(request.map, request.jmax, executor))
