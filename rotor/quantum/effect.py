"""The face of a quantum effect: what one says of itself, and sizes of several.

The Hamiltonian is a sum over effects, each a sum over named parameters,

    H = Σ_effects Σ_name c_name (O_name + Σ V^k · W^k),

O being operators of the rotational angular momentum alone, V^k of the rotation and W^k of spins. An effect is one object in
one file of `rotor.quantum.effects`. `solve_levels` looks at all effects first and takes the smallest basis and the cheapest
exact method that holds every one of their operators.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from rotor.frozen import dataclass
from rotor.tops.constants.operators import Operators, added

if TYPE_CHECKING:
    from rotor.quantum.operators.algebra import Operator
    from rotor.quantum.spins.scheme import Rotor, Spin, SpinTerm
    from rotor.quantum.wang.basis import SpeciesFactors
    from rotor.tops.spins.spin_weights import SpinWeights
    from rotor.tops.top import Top


@dataclass(frozen=True)
class State:
    """A state with a rotational Hamiltonian of its own, Σ c O over named parameters c of the effect that brings it.

    v: its number, 1 or more (0 is the top's own). terms: for each parameter the operators J^2p ½[Jz^2q, J₊^2n + J₋^2n]₊ that
    it multiplies, by powers (p, q, n); (0, 0, 0) is the unit operator, that of the energy of the state. spin_weights: None for those of
    the top.
    """

    v: int
    terms: dict[str, Operators]
    spin_weights: SpinWeights | None = None

    def operators(self, values: dict[str, float]) -> Operators:
        """The terms times the values of the parameters, added."""
        return added((terms, values[name]) for name, terms in self.terms.items())


@dataclass(frozen=True)
class Coupling:
    """What the parameter `name` of an effect multiplies: |bra⟩⟨ket| ⊗ O + Hermitian conjugate; O alone where bra is ket.

    bra, ket: numbers v of states. operator: O on |J K⟩ of a representation, which leaves J alone. An operator that time reversal changes
    in sign (an odd power of J) has a factor i, which belongs to O. factors: what its elements between Wang blocks are multiplied with.
    """

    name: str
    bra: int
    ket: int
    operator: Operator
    factors: SpeciesFactors | None = None


DEBYE_PER_BOHR_MAGNETON = 0.009274  # as SPCAT has it; 9.2740101e-3 by CODATA 2018


class Moment(NamedTuple):
    """A moment that makes lines besides the dipole of a state: |v'⟩⟨v| of its states times an operator, and its Hermitian conjugate.

    electric    Σ_i μ_i φ_pi, times functions of N', N, K', K (Herman-Wallis corrections, Fourier terms of internal rotation), or
                products of one direction cosine with components of N
    magnetic    g μB N_p, g μB S_p of one spin, or g μB Σ_ij c_ij φ_pi S_j (j along the molecule), c symmetric and traceless;
                g μB Σ_ij c_ij ½{φ_pi, N_j}
    of a spin   Σ_q ½{φ_p, N_q} S_q with the part of rank 2 alone, φ = Σ_i μ_i φ_i; i Σ_ij c_ij φ_pi S_j between two states

    p is a direction in space, i and j are a, b, c. In a level of good parity electric and magnetic moments do not interfere.
    rotor: of rank 1, or the part on |N K⟩ that the vector of a spin multiplies. spin: the name of that spin, "" for none. electric: whether
    it adds to the electric dipole in amplitude; elements are those of i times the moment (`spins.scheme`). imaginary: whether elements
    are i times those of a plain dipole within one state: their squares are added.
    """

    value_debye: float
    states: tuple[int, int]
    rotor: Rotor
    spin: str = ""
    electric: bool = True
    imaginary: bool = False

    @property
    def conjugate_sign(self) -> float:
        """What (-1)^(N'-N) times the transpose of the elements is multiplied with in the elements of the conjugate."""
        return -1.0 if self.electric and not self.imaginary else 1.0


class QuantumEffect(ABC):
    """A part of the rotational Hamiltonian, linear in its named parameters.

    name: how files, reports and errors call it.
    conserved: quantum numbers that stay good under it, of "j" (the rotational angular momentum), "species" (the parities of
    Ka and Kc) and "m" (the projection in space). What is not named is taken as mixed.

    resolves_m: levels under it are labelled by M, which `solve_levels` has not; it refuses such an effect.

    A subclass gives its parameters and, for each of them, operators of one or more of these kinds:

    - `operators`: J^2p ½[Jz^2q, J₊^2n + J₋^2n]₊, by their powers (p, q, n): the fast path, for any kind of top;
    - `j_operator`: any other Hermitian operator of J, of the algebra in `rotor.quantum.operators`;
    - `spin_terms`: molecule-fixed tensors coupled to spins, with the `spins` they need;
    - `states`, `couplings` and `dipoles`: further vibrational or tunnelling states, and what connects them.
    """

    name: ClassVar[str] = ""
    conserved: ClassVar[frozenset[str]] = frozenset({"j", "species", "m"})
    resolves_m: ClassVar[bool] = False

    @abstractmethod
    def parameters(self, top: Top) -> dict[str, float]:
        """The value of every parameter in MHz, by name."""

    @abstractmethod
    def size_mhz(self, top: Top, j: int) -> float:
        """How large the effect is for levels of angular momentum `j`, in MHz: a bound or an estimate within a factor of 3."""

    def operators(self, top: Top) -> dict[str, Operators]:
        """∂H/∂c of parameters by powers (p, q, n), by name."""
        return {}

    def j_operator(self, top: Top, name: str, representation: str) -> Operator | None:
        """∂H/∂c of the parameter `name` on |J K⟩ of a representation; None where `operators` has all of it."""
        return None

    def spins(self, top: Top) -> tuple[Spin, ...]:
        """The spins that the effect needs, in the order in which they are coupled."""
        return ()

    def spin_terms(self, top: Top) -> tuple[SpinTerm, ...]:
        """What couples the rotation to the spins."""
        return ()

    def states(self, top: Top) -> tuple[State, ...]:
        """States beyond the top's own (v = 0), with their numbers v."""
        return ()

    def couplings(self, top: Top, representation: str) -> tuple[Coupling, ...]:
        """What connects states of different v, by operators on |J K⟩ of a representation."""
        return ()

    def conserved_sums(self, top: Top) -> frozenset[str]:
        """Sums of angular momenta (n, j, f1, ...) that are taken for good ones, elements between different values left out."""
        return frozenset()

    def k_limits(self, top: Top) -> dict[int, tuple[int, int]]:
        """The least and the largest K of states v whose basis does not have all of them, such as K = 1 of a Π state."""
        return {}

    def other_moments(self, top: Top) -> tuple[Moment, ...]:
        """Moments that make lines besides plain dipoles, such as those of a spin."""
        return ()

    def solve(
        self, top: Top, effects: Sequence[QuantumEffect], jmin: int, jmax: int, vectors: bool, below_mhz: float
    ) -> Any:
        """Levels of all effects together where this one needs functions of its own; None where the functions of the rotation serve.

        Without vectors the levels serve sums over states: all that the functions have, whose names may be those of others; those above
        `below_mhz` may be left out.
        """
        return None

    def dipoles(self, top: Top) -> dict[tuple[int, int], tuple[float, float, float]]:
        """(μa, μb, μc) in debye by pairs of states (v', v): of the effect's states, and between states."""
        return {}


def dipoles_by_state(
    top: Top, dipole_abc: tuple[float, float, float], effects: Sequence[QuantumEffect]
) -> dict[tuple[int, int], tuple[float, float, float]]:
    """The dipole of every state, the top's own where its effect gives none, and those between states."""
    dipoles = {(0, 0): dipole_abc}
    for effect in effects:
        dipoles |= {(state.v, state.v): dipole_abc for state in effect.states(top)} | effect.dipoles(top)
    return dipoles


class EffectSize(NamedTuple):
    """The size of one effect: its name, the size in MHz at one J, and whether the calculation has it."""

    name: str
    size_mhz: float
    present: bool


def effect_sizes(top: Top, j: int, effects: Sequence[QuantumEffect]) -> list[EffectSize]:
    """The sizes of the effects of a calculation at one J that are above 0, largest first.

    >>> from rotor.quantum.effects.watson import SEMI_RIGID
    >>> from rotor.tops.top import Top
    >>> [(s.name, round(s.size_mhz, 6)) for s in effect_sizes(Top.from_constants("B=6000 D=0.001 MHz"), 10, SEMI_RIGID)]
    [('rigid rotor', 660000.0), ('centrifugal distortion', 12.1)]
    """
    sizes = [EffectSize(effect.name or type(effect).__name__, effect.size_mhz(top, j), True) for effect in effects]
    return sorted((size for size in sizes if size.size_mhz > 0), key=lambda size: -size.size_mhz)


def k_limits_of(top: Top, effects: Iterable[QuantumEffect]) -> dict[int, tuple[int, int]]:
    """The limits of K that the effects set, by states."""
    return {v: limits for effect in effects for v, limits in effect.k_limits(top).items()}


def couplings_of(top: Top, effects: Iterable[QuantumEffect], representation: str) -> list[Coupling]:
    """Couplings of effects, and what acts in the top's own state by other operators of J than powers."""
    couplings: list[Coupling] = []
    for effect in effects:
        couplings += effect.couplings(top, representation)
        named = ((name, effect.j_operator(top, name, representation)) for name in effect.parameters(top))
        couplings += [Coupling(name, 0, 0, operator) for name, operator in named if operator is not None]
    return couplings
