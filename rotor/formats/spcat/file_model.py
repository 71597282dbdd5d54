"""Levels of any .par or .var file: connected states are solved together, other groups separately, and all are listed together.

Each group of connected states has a top that represents its symmetry, and the operators of the file as its only effect.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Ints
from rotor.formats.spcat.hamiltonian.coded_file import CodedFile, CodedLine
from rotor.formats.spcat.hamiltonian.codes import NOT_YET, PLURAL_NOT_YET
from rotor.formats.spcat.hamiltonian.dipole_codes import (
    EVEN_ORDER,
    DipoleCode,
    Dipoles,
    line_moment,
    moment_species,
    split_dipoles,
)
from rotor.formats.spcat.hamiltonian.entries import Connected, FileEffect
from rotor.formats.spcat.hamiltonian.l_doubled import Pair, named_by_l
from rotor.formats.spcat.hamiltonian.labels import (
    BY_DIAG,
    Diagonal,
    falls_with_k,
    named_by,
    refuse_other_functions,
    without_diagonalization,
)
from rotor.formats.spcat.hamiltonian.phases import (
    Phases,
    by_order,
    turned_axis,
    turned_moments,
    turned_odd_axes,
    with_dipoles,
)
from rotor.formats.spcat.hamiltonian.states import ALL_K, StateOptions, file_states
from rotor.formats.spcat.hamiltonian.symmetry import weights_agree
from rotor.formats.spcat.text.int_file import Dipole, IntensityFile
from rotor.formats.spcat.text.par import Options, ParameterFile
from rotor.frozen import dataclass
from rotor.quantum.blocks.connected import connected_parts
from rotor.quantum.effect import Moment
from rotor.quantum.levels import Levels
from rotor.quantum.solve import solve_levels
from rotor.quantum.spins.levels import levels_of_f
from rotor.quantum.spins.scheme import Spin, is_axial
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top


@dataclass(frozen=True)
class Group:
    """States that are solved together: their options by number, the top that represents their symmetry, and the effect.

    axial_kmax: the largest K of a symmetric top with good K. diag: labelling rule DIAG. by_k: whether labels are N and K.
    """

    states: tuple[StateOptions, ...]
    top: Top
    effect: FileEffect
    oblate: bool
    axial_kmax: int = ALL_K
    diag: int = 0
    by_k: bool = False

    @property
    def spins(self) -> tuple[int, ...]:
        """Doubled spins."""
        return self.states[0].spins

    def basis_k(self, levels: Levels) -> Ints:
        """|K| of levels along the axis of the basis."""
        return levels.quantum("k" if "kc" not in levels.quanta else "kc" if self.oblate else "ka")

    def numbers(self, levels: Levels) -> Ints:
        """The state in the file of each level."""
        return np.asarray(np.array([state.number for state in self.states])[levels.quantum("v")])

    def spin_names(self, levels: Levels) -> list[str]:
        """The quantum numbers of levels that spins add."""
        return [name for name in levels.quanta if name not in ("v", "n", "k", "ka", "kc")] if self.spins else []

    def levels(self, twice_f: tuple[int, int]) -> Levels:
        """The levels with doubled F from the first to the last of `twice_f`, with the weights of the file.

        Levels that do not exist are listed with weight 0.
        """
        if self.spins or self.effect.others:
            # F has the parity of the sum of the spins, doubled
            all_f = range(max(twice_f[0], sum(self.spins) % 2), twice_f[1] + 1, 2)
            # labels by l must be known before existing levels can be selected
            exist = None if self.top.kind == "linear" or self.effect.pairs else self._exist
            levels = levels_of_f(self.top, (self.effect,), all_f, None, None, exist)
        else:
            levels = solve_levels(self.top, twice_f[1] // 2, jmin=twice_f[0] // 2, effects=(self.effect,))
        levels = self.named(levels)
        return replace(levels, weight=self.weights(levels))

    def named(self, levels: Levels) -> Levels:
        """Levels as DIAG says: with its names or, where it is below 0, the functions of the basis with their diagonal elements."""
        if self.diag < 0:
            refuse_other_functions(levels, bool(self.effect.pairs))
            return without_diagonalization(levels)
        if self.effect.pairs:
            return named_by_l(levels, self.effect.pairs, str(levels.representation))
        return named_by(levels, self.diag, self.oblate, self.diagonal(levels.jmax))

    @property
    def is_diagonal(self) -> bool:
        """Whether a single state of a symmetric or linear top without spins has no elements off the diagonal."""
        return self.top.kind != "asymmetric" and len(self.states) == 1 and not self.spins

    def falls_from(self, highest_n: int) -> int | None:
        """The lowest N at which the diagonal of the Hamiltonian does not rise (oblate: fall) with K; None up to the highest N."""
        if self.top.kind != "asymmetric":
            return None
        states = [self.effect.operators(self.top), *(state.terms for state in self.effect.states(self.top))]
        return falls_with_k(states, self.effect.parameters(self.top), highest_n, self.oblate)

    def diagonal(self, highest_n: int) -> Diagonal:
        """Behaviour of the diagonal of the Hamiltonian up to the highest N."""
        if self.falls_from(highest_n) is None:
            return Diagonal.RISES
        return Diagonal.FALLS_IN_K if self.by_k else Diagonal.FALLS

    def has_levels(self, twice_f: tuple[int, int]) -> bool:
        """Whether any level from the first to the last of the doubled F has a weight and a K from KNMIN on."""
        highest = (twice_f[1] + sum(self.spins)) // 2  # N reaches F + ΣI
        # E states count where the axis has them
        weighted = any(max(state.plus, state.minus, state.e_weight if state.fold else 0) > 0 for state in self.states)
        return weighted and twice_f[0] <= twice_f[1] and any(state.kmin <= highest for state in self.states)

    def _exist(self, labels: Ints) -> NDArray[np.bool_]:
        """Whether labels v, Ka, Kc, N, ..., F belong to levels with a weight."""
        v, ka, kc = labels[:, 0], labels[:, 1], labels[:, 2]
        if self.top.kind in ("prolate", "oblate"):
            return np.asarray(ka <= self.axial_kmax)
        totals = {"i_tot": labels[:, -2] // 2, "i_sym": labels[:, -3] // 2} if self.states[0].i_tot else {}
        return self._component_weights(v, ka, kc, kc if self.oblate else ka, totals) > 0

    def weights(self, levels: Levels) -> Ints:
        """Weights of levels in the file, summed over components."""
        total, v = np.zeros(len(levels), dtype=np.int64), levels.quantum("v")
        for ka, kc, k, alike in _components(levels, self.oblate):
            total += np.where(alike, self._component_weights(v, ka, kc, k, levels.quanta), 0)
        return total

    def _component_weights(self, v: Ints, ka: Ints, kc: Ints, k: Ints, totals: Mapping[str, Ints]) -> Ints:
        """Weights of components with these labels (n,); 0 for those that do not exist. totals: with the total spins among them."""
        weights = np.zeros(len(v), dtype=np.int64)
        for place, state in enumerate(self.states):
            exists = (v == place) & (k <= self.axial_kmax)
            weights += np.where(exists, np.maximum(state.weights(ka, kc, k, state.odd_spins(totals)), 0), 0)
        return weights


def _components(levels: Levels, oblate: bool) -> list[tuple[Ints, Ints, Ints, Ints]]:
    """Ka, Kc, K of each component and the rows that have it; a symmetric top has two components ±K."""
    quanta, all_rows = levels.quanta, np.ones(len(levels), dtype=bool)
    if "kc" in quanta:
        return [(quanta["ka"], quanta["kc"], quanta["kc"] if oblate else quanta["ka"], all_rows)]
    n, k = levels.rotational, levels.quantum("k")
    upper, lower = n - k, n - k + 1  # the other K of both components; K = 0 has only the first
    pairs = [(upper, all_rows), (lower, k > 0)]
    return [(other, k, k, alike) if oblate else (k, other, k, alike) for other, alike in pairs]


def connected_groups(
    file: ParameterFile,
    intensities: IntensityFile,
    *,
    as_spcat: bool = False,
    full_basis: bool = False,
    highest_n: int | None = None,
) -> list[Group]:
    """The groups of connected states, by their lowest numbers; the basis has K from KNMIN to KNMAX.

    as_spcat: reproduce erroneous moments of SPCAT. full_basis: the basis has all K up to N, unless KNMIN = KNMAX, where K is a quantum
    number of the state, such as l. highest_n: highest N of the levels; a larger KNMAX has no effect.
    """
    states = file_states(file)
    if full_basis:
        states = tuple(state.with_all_k() for state in states)
    elif highest_n is not None:
        states = tuple(state.with_k_to(highest_n) for state in states)
    coded = CodedFile(file, states)
    light = _light(coded, intensities, as_spcat)
    edges = [line.states for line in coded.acting if line.states]
    edges += [*light.dipoles, *(code.states for _, code in light.others), *coded.pairs]
    return [_group(coded, numbers, light, as_spcat) for numbers in connected_parts(len(states), edges)]


class Light(NamedTuple):
    """Dipoles of a file by pairs of states, other moments, phases, and `moments_within_states`.

    Unless more electric moments within states have odd order (a dipole, TYP 0, 3, 4, ...) than even order, the program multiplies each
    moment between two states by i.
    """

    dipoles: Dipoles
    others: list[tuple[Dipole, DipoleCode]]
    phases: Phases
    axes_within_states: list[tuple[int, bool]]


def _light(coded: CodedFile, intensities: IntensityFile, as_spcat: bool) -> Light:
    """The moments of an .int file; those of the state K l > 0 of an l-doubled pair act on both states."""
    dipoles, others = split_dipoles(intensities.dipoles, len(coded.states))
    axes = moments_within_states(dipoles, others, coded)
    phases = with_dipoles(coded.phases, axes, coded.oblate, as_spcat and bool(coded.phases.odd))
    return Light(
        {pair: mu for states, mu in dipoles.items() for pair in _at_components(states, coded.pairs)},
        [
            (dipole, code._replace(states=pair))
            for dipole, code in others
            for pair in _at_components(code.states, coded.pairs)
        ],
        phases,
        axes,
    )


def moments_within_states(
    dipoles: Dipoles, others: list[tuple[Dipole, DipoleCode]], coded: CodedFile
) -> list[tuple[int, bool]]:
    """Axes of electric moments within one state that connect levels of equal weight, and whether their order is even."""
    plain = [(v, axis, False) for (v, w), mu in dipoles.items() for axis, value in enumerate(mu, 1) if v == w and value]
    plain += [
        (code.states[0], code.axis, code.typ in EVEN_ORDER)
        for _, code in others
        if code.axis in (1, 2, 3) and len(set(code.states)) == 1
    ]
    return [
        (axis, odd)
        for v, axis, odd in plain
        if v in coded.members or weights_agree("abc"[axis - 1], coded.states[v], coded.states[v])
    ]


def _at_components(states: tuple[int, int], pairs: list[Pair]) -> list[tuple[int, int]]:
    """Pairs of states on which a moment acts: for an l-doubled state with K l > 0 both states of the pair, for the other none."""
    firsts, seconds = {pair.first: pair.second for pair in pairs}, {pair.second for pair in pairs}
    low, high = states
    if low != high and {low, high} & (set(firsts) | seconds):
        raise ValueError(f"a dipole between states {low} and {high}, of which one is l-doubled, {NOT_YET}")
    if low in seconds:
        return []
    return [states, (firsts[low], firsts[low])] if low in firsts else [states]


def _group(coded: CodedFile, numbers: list[int], light: Light, as_spcat: bool) -> Group:
    """The group of the states with these numbers."""
    first, oblate, axes, doubled = coded.options, coded.oblate, coded.axes, coded.pairs
    states = [coded.states[v] for v in numbers]
    spins = states[0].spins
    if any((state.spins, state.equivalent) != (spins, states[0].equivalent) for state in states):
        raise ValueError(
            f"states {tuple(numbers)} are connected and have different spins: that is read but not computed yet"
        )
    here = {v: place for place, v in enumerate(numbers)}
    usable = [
        line
        for line in coded.usable
        if (line.states is None or set(line.states) <= set(here)) and line.highest_spin <= len(spins)
    ]
    pairs = tuple(Pair(here[pair.first], here[pair.second]) for pair in doubled if pair.first in here)
    kind = _kind(states, usable, oblate, first.by_k)
    if kind in ("prolate", "oblate") and any(set(code.states) <= set(here) for _, code in light.others):
        kind = "asymmetric"  # |N K⟩ does not distinguish K from -K, which such moments may exchange
    limits = {
        place: (state.kmin, state.kmax)
        for place, state in enumerate(states)
        if kind == "asymmetric" and (state.kmin > 0 or state.kmax < ALL_K)
    }
    coupled = coupled_spins(states[0], first)
    turned = _turned(usable, light, doubled)
    moments, beside = _group_moments(coded, here, light, turned, as_spcat)
    seconds = {pair.second for pair in doubled}
    lines = tuple(
        line._replace(states=line.states and (here[line.states[0]], here[line.states[1]]))
        for line in usable
        # the program takes no operator of K l ≤ 0 alone
        if not line.states or line.is_between or line.states[0] not in seconds
    )
    values = {line.name: line.parameter.value for line in lines}
    connected = Connected(tuple(states), pairs, axes, turned)
    if pairs:  # raises for operators forbidden between l-doubled states, before levels are solved
        connected.entries(lines)
    effect = FileEffect(values, lines, connected, coupled, moments, limits, beside, first.ixx)
    top = Top(_STANDS_FOR[kind, oblate], dipole_abc_debye=moments.get((0, 0), (0.0, 0.0, 0.0)), name=coded.file.title)
    kmax = states[0].kmax if kind in ("prolate", "oblate") else ALL_K
    return Group(tuple(states), top, effect, oblate, kmax, first.diag, first.by_k)


def _group_moments(
    coded: CodedFile, here: dict[int, int], light: Light, turned: str, as_spcat: bool
) -> tuple[Dipoles, tuple[Moment, ...]]:
    """Plain dipoles and other moments of a group, in the phases of its functions; here: places of its states by their numbers."""
    moments = {(here[b], here[a]): mu for (a, b), mu in light.dipoles.items() if a in here and b in here}
    acting = [(dipole, code) for dipole, code in light.others if set(code.states) <= set(here)]
    spins = len(coded.states[min(here)].spins)
    beside = tuple(
        line_moment(
            dipole, code, (here[code.states[1]], here[code.states[0]]), spins, coded.axes, as_spcat, coded.series
        )
        for dipole, code in acting
    )
    if light.phases.odd:
        fixed = light.phases._replace(odd=turned_odd_axes(turned)) if turned else light.phases
        with_species = [
            (each, moment_species(code, coded.axes)) for each, (_, code) in zip(beside, acting, strict=True)
        ]
        phases = with_dipoles(fixed, light.axes_within_states, coded.oblate, False)
        return turned_moments(moments, with_species, turned, phases)
    if light.phases.between_i:
        return by_order(moments, beside, [as_spcat and code.typ in EVEN_ORDER for _, code in acting])
    return moments, beside


def _turned(lines: Iterable[CodedLine], light: Light, doubled: list[Pair]) -> str:
    """The axis whose half turn accompanies time reversal if operators within one state are odd, else ""."""
    turned = turned_axis([line.symmetry.axis for line in lines], light.phases.odd)
    if turned and doubled:
        raise ValueError(
            f"operators that are odd under time reversal within one state, or PHASE, with l-doubled states "
            f"{PLURAL_NOT_YET}; leave one of them out"
        )
    return turned


# only the symmetry of these tops matters: the operators of the file are the whole Hamiltonian
_STANDS_FOR = {
    ("linear", False): Constants(B=1.0), ("linear", True): Constants(B=1.0),
    ("prolate", False): Constants(A=2.0, B=1.0), ("oblate", True): Constants(B=2.0, C=1.0),
    ("asymmetric", False): Constants(A=3.0, B=2.0, C=1.0, representation="Ir"),
    ("asymmetric", True): Constants(A=3.0, B=2.0, C=1.0, representation="IIIl"),
}  # fmt: skip


def _kind(states: list[StateOptions], lines: Sequence[CodedLine], oblate: bool, symmetric: bool) -> str:
    """Kind of top: linear; symmetric about the axis of the basis if K is good; else asymmetric."""
    alone = len(states) == 1
    plain = [powers for line in lines if line.operator.plain for powers in line.operator.plain]
    if (
        alone
        and states[0].linear
        and not oblate  # there its axis is not z
        and all(q == n == 0 for _, q, n in plain)
        and not any(line.operator.of_n for line in lines)
    ):
        return "linear"
    rotors = [line.operator.rotor for line in lines if line.operator.rotor is not None]
    axis = "c" if oblate else "a"
    good = all(n == 0 for _, _, n in plain) and all(is_axial(rotor, axis) for rotor in rotors)
    whole = alone and states[0].kmin == 0 and states[0].kmax > 0 and states[0].plus == states[0].minus
    if symmetric and whole and good and states[0].equivalent < 3 and not any(line.operator.of_n for line in lines):
        return "oblate" if oblate else "prolate"
    return "asymmetric"


# spins


def coupled_spins(state: StateOptions, first: Options) -> tuple[Spin, ...]:
    """The spins of a state in the order of coupling, equivalent last ones with a total; ValueError for unsupported options."""
    others = len(state.spins) - state.equivalent  # spins without a total
    if state.equivalent == 3 and first.diag in BY_DIAG:
        raise ValueError(f"DIAG = {first.diag} with a total spin of three nuclei {NOT_YET}; expected 0 or 3")
    if state.equivalent == 3 and first.ixx >> (others + 1):
        raise ValueError(f"IXX = {first.ixx}: a total spin of three nuclei that is taken for conserved {NOT_YET}")
    return tuple(
        Spin(f"I{place}", twice, total="I_tot" if place > others else "") for place, twice in enumerate(state.spins, 1)
    )
