"""Quantum numbers of levels of any .par or .var file by SPCAT's rules.

Quantum numbers are N, then nothing, K or Ka Kc, then v where there are several states, then J, F1, ... F, half-integers rounded up.
Where that makes more than six (ten, where NLINE is negative), one number that counts the coupling patterns stands for all but F.
QNFMT = 100 Q + 10 H + NQN: Q is the kind of quanta, H in binary which of the last ones are half-integers.
That number is the place of the pattern in SPCAT's list of patterns.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotor.arrays import Ints
from rotor.formats.spcat.file_model import Group
from rotor.formats.spcat.hamiltonian.states import is_odd
from rotor.formats.spcat.text.par import ParameterFile
from rotor.frozen import dataclass
from rotor.quantum.levels import Levels
from rotor.quantum.spins.coupling import symmetric_functions


@dataclass(frozen=True)
class Format:
    """Format of quantum numbers: columns of rotation (1, 2 or 3), whether v is listed, largest numbers of spins and of columns.

    equivalent: number of spins that are coupled to a total, 0, 2 or 3.
    """

    rotation: int
    states: bool
    spins: int
    most: int = 6
    equivalent: int = 0

    @property
    def before_spins(self) -> int:
        """Number of columns of rotational and vibrational quantum numbers, which precede those of spins."""
        return self.rotation + self.states

    @property
    def aggregate(self) -> bool:
        """Whether a single number replaces the coupling pattern."""
        return self.before_spins + self.spins > self.most

    def aggregates(self, spins: int) -> bool:
        """Whether a single number replaces the pattern of states with this number of spins, whose quantum numbers need more columns."""
        return self.aggregate and spins > self.width - self.before_spins

    @property
    def width(self) -> int:
        """Number of columns of quantum numbers of one state."""
        return self.before_spins + (2 if self.aggregate else self.spins)

    def qnfmt(self, spins: tuple[int, ...]) -> int:
        """QNFMT of a group with these doubled spins.

        >>> Format(3, True, 1).qnfmt((2,)), Format(3, False, 2).qnfmt((3, 3)), Format(1, False, 0).qnfmt(())
        (1405, 325, 101)
        """
        code = 1000 * self.states + 100 * self.before_spins + self.width
        aggregated = self.aggregates(len(spins))
        code += {0: 0, 2: 2000, 3: 6000}[0 if aggregated else self.equivalent]
        odd = np.cumsum(spins) % 2 if spins else np.zeros(0, dtype=np.int64)  # half-integer sums are marked by bits
        if self.equivalent == 2 and len(odd) > 1:
            odd[-2] = 0  # the total of two equal spins is an integer
        if self.equivalent == 3 and len(odd) > 2:
            odd[-3:-1] = 0, sum(spins[-3:]) % 2
        total = int(odd[-1]) if len(odd) else 0
        if aggregated:
            return code + 4000 + 10 * total
        halves = [int(odd[i]) if i < len(odd) else total for i in range(self.width - self.before_spins)]
        h = 0
        for bit in halves:
            h = 2 * h + bit
        return code + 10 * (h & 7 if h > 9 else h)  # one digit: of larger numbers the last three bits remain


def quanta_format(file: ParameterFile, groups: list[Group]) -> Format:
    """Format of the quantum numbers of a file."""
    first = file.options[0]
    linear = all(state.linear for group in groups for state in group.states)
    rotation = 3 if first.spind > 0 else 1 if linear else 2
    spins = max(len(group.spins) for group in groups)
    equivalent = max(state.equivalent for group in groups for state in group.states)
    return Format(rotation, file.states > 1, spins, 10 if file.header.nline < 0 else 6, equivalent)


def listed_quanta(group: Group, levels: Levels, form: Format, negative: bool = False) -> Ints:
    """The quantum numbers of each row as the file lists them, for one component of ±K.

    group: the connected states of the levels. levels: n solved levels. form: which columns there are. negative: whether to list the
    component -K of a K doublet whose levels differ in species.
    Returns: half-integers rounded up.
    """
    quanta, n = levels.quanta, levels.rotational
    v = levels.quantum("v")
    columns = [n, *_rotation(group, levels, v, form, negative)]
    if form.states:
        columns.append(group.numbers(levels))
    names = group.spin_names(levels)
    # half-integers are rounded up in these files
    totals = [(quanta[name] + 1) // 2 if name in levels.halves else quanta[name] for name in names] or [n]
    if form.aggregates(len(group.spins)):
        columns += [pattern_numbers(group, levels, names), totals[-1]]
    elif form.spins:
        columns += totals + [totals[-1]] * (form.width - form.before_spins - len(totals))
    return np.stack(columns, axis=1)


def _rotation(group: Group, levels: Levels, v: Ints, form: Format, negative: bool) -> list[Ints]:
    """Nothing, signed K, or Ka and Kc.

    Levels of E species, or of l-doubled states, have no sign of K, and N - K across the axis, or N - K + 1 in the first state of a pair.
    """
    quanta, n = levels.quanta, levels.rotational
    if form.rotation == 1:
        return []
    if form.rotation == 3 and "kc" not in quanta:  # linear, in a file with the quanta of asymmetric tops
        return [np.zeros_like(n), n]
    k, unsigned = group.basis_k(levels), np.zeros(len(n), dtype=bool)
    for place, state in enumerate(group.states):
        unsigned |= (v == place) & state.is_e(k)
    if form.rotation == 2:
        odd = is_odd(quanta["ka"], quanta["kc"]) if "kc" in quanta else np.full(len(levels), negative)
        return [np.where(odd & ~unsigned, -k, k)]
    firsts = [pair.first for pair in group.effect.pairs]
    across = np.where(unsigned, n - k + np.isin(v, firsts), quanta["ka" if group.oblate else "kc"])
    return [across, k] if group.oblate else [k, across]


def pattern_numbers(group: Group, levels: Levels, names: list[str]) -> Ints:
    """Numbers of the coupling patterns among those of any F.

    Patterns are ordered by N - F, by I_tot if there is one, then by J_i - J_(i-1), the last spin first."""
    doubled = [levels.quanta[name] * (1 if name in levels.halves else 2) for name in names]
    chain, spins = [2 * levels.rotational, *doubled], group.spins
    if not group.states[0].i_tot:
        return _among(pattern_steps(spins), _steps(chain, spins))
    if group.states[0].equivalent == 3:
        total, symmetry = chain[-2], chain[-3] // 2
        steps = np.insert(_steps([*chain[:-3], chain[-1]], (*spins[:-3], total)), 1, total, axis=1)
        return _among(_threefold_patterns(spins), np.column_stack([steps, symmetry]))
    total, totals = chain.pop(-2), range(0, spins[-1] + spins[-2] + 1, 2)
    all_steps = np.concatenate([np.insert(pattern_steps((*spins[:-2], i_tot)), 1, i_tot, axis=1) for i_tot in totals])
    all_steps = all_steps[np.lexsort((all_steps[:, 1], all_steps[:, 0]))]  # lexsort is stable within one I_tot
    steps = _steps(chain, (*spins[:-2], total))
    return _among(all_steps, np.insert(steps, 1, total, axis=1))


def _threefold_patterns(spins: tuple[int, ...]) -> Ints:
    """2(N - F), I_tot, the other steps and the species of all patterns with a total of three spins, in the order of SPCAT."""
    tables = []
    # totals of three spins fall by whole numbers, to 0 or 1/2
    for total in range(3 * spins[-1] % 2, 3 * spins[-1] + 1, 2):
        names = symmetric_functions(spins[-1], total).symmetry // 2
        order = np.lexsort((names, ~np.isin(names % 6, (0, 2))))  # even functions before odd ones
        steps = np.insert(pattern_steps((*spins[:-3], total)), 1, total, axis=1)
        tables.append(np.column_stack([np.repeat(steps, len(names), axis=0), np.tile(names[order], len(steps))]))
    table = np.concatenate(tables)
    return table[np.lexsort((table[:, 1], table[:, 0]))]


def pattern_steps(spins: tuple[int, ...]) -> Ints:
    """2(N - F) and (J_i - J_(i-1) + S_i) of all coupling patterns of doubled spins, in SPCAT's order.

    >>> pattern_steps((1, 1)).tolist()
    [[-2, 1, 1], [0, 1, 0], [0, 0, 1], [2, 0, 0]]
    """
    steps = np.stack(np.meshgrid(*(np.arange(spin + 1) for spin in spins), indexing="ij"), axis=-1).reshape(
        -1, len(spins)
    )
    difference = (np.array(spins, dtype=np.int64) - 2 * steps).sum(axis=1)
    return np.column_stack((difference, steps))[np.lexsort((*steps.T, difference))]


def _steps(chain: list[Ints], spins: Sequence[Ints | int]) -> Ints:
    """The steps of `pattern_steps` for levels, from their doubled N, J, F1, ... F."""
    steps = [(after - before + spin) // 2 for before, after, spin in zip(chain, chain[1:], spins, strict=False)]
    return np.column_stack((chain[0] - chain[-1], *steps))


def _among(all_steps: Ints, steps: Ints) -> Ints:
    """Place of each pattern in the list of all."""
    number = {tuple(row): place for place, row in enumerate(all_steps.tolist())}
    return np.array([number[tuple(row)] for row in steps.tolist()], dtype=np.int64)
