"""Levels and lines of any .par or .var file as SPCAT lists them: quantum numbers by its rules, K doublets as two lines.

Quantum numbers are N, then nothing, K or Ka Kc, then v where there are several states, then J, F1, ... F, half-integers rounded up.
Where that makes more than six (ten, where NLINE is negative), one number that counts the coupling patterns stands for all but F.
QNFMT = 100 Q + 10 H + NQN: Q is the kind of quanta, H in binary which of the last ones are half-integers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotor import units
from rotor.arrays import Floats, Indices, Ints, end_to_end, rising_order, rows_of
from rotor.formats.spcat.file_model import Group
from rotor.formats.spcat.pattern_numbers import pattern_numbers
from rotor.formats.spcat.states import is_odd
from rotor.formats.spcat.text.catalogue import Catalogue, catalogue_of
from rotor.formats.spcat.text.egy import LevelList
from rotor.formats.spcat.text.fields import BLANK
from rotor.formats.spcat.text.int_file import Request
from rotor.formats.spcat.text.par import ParameterFile
from rotor.quantum.levels import Levels
from rotor.spectra.intensity import LGINT_NM2_MHZ, IntensityCut
from rotor.spectra.transitions import Transitions, all_transitions

Quanta = NDArray[np.int16]


@dataclass(frozen=True)
class Format:
    """How a file's levels are called: columns of rotation (1, 2 or 3), whether v is listed, spins at most, columns at most.

    equivalent: how many spins are coupled to a total, 0, 2 or 3.
    """

    rotation: int
    states: bool
    spins: int
    most: int = 6
    equivalent: int = 0

    @property
    def before_spins(self) -> int:
        """Columns before those of spins."""
        return self.rotation + self.states

    @property
    def aggregate(self) -> bool:
        """Whether one number stands for the coupling pattern."""
        return self.before_spins + self.spins > self.most

    @property
    def width(self) -> int:
        """Number of columns."""
        return self.before_spins + (2 if self.aggregate else self.spins)

    def qnfmt(self, spins: tuple[int, ...]) -> int:
        """The code of a group whose doubled spins are these.

        >>> Format(3, True, 1).qnfmt((2,)), Format(3, False, 2).qnfmt((3, 3)), Format(1, False, 0).qnfmt(())
        (1405, 325, 101)
        """
        code = 1000 * self.states + 100 * self.before_spins + self.width
        code += {0: 0, 2: 2000, 3: 6000}[0 if self.aggregate else self.equivalent]
        odd = np.cumsum(spins) % 2 if spins else np.zeros(0, dtype=np.int64)
        if self.equivalent == 2 and len(odd) > 1:
            odd[-2] = 0
        if self.equivalent == 3 and len(odd) > 2:
            odd[-3:-1] = 0, sum(spins[-3:]) % 2
        total = int(odd[-1]) if len(odd) else 0
        if self.aggregate:
            return code + 4000 + 10 * total
        halves = [int(odd[i]) if i < len(odd) else total for i in range(self.spins)]
        h = 0
        for bit in halves:
            h = 2 * h + bit
        return code + 10 * (h & 7 if h > 9 else h)


def format_of(file: ParameterFile, groups: list[Group]) -> Format:
    """How the levels of a file are called."""
    first = file.options[0]
    linear = all(state.linear for group in groups for state in group.states)
    rotation = 3 if first.spind > 0 else 1 if linear else 2
    spins = max(len(group.spins) for group in groups)
    equivalent = max(state.equivalent for group in groups for state in group.states)
    return Format(rotation, abs(first.nvib) > 1, spins, 10 if file.header.nline < 0 else 6, equivalent)


def quanta_of(group: Group, levels: Levels, form: Format, negative: bool = False) -> Ints:
    """The quantum numbers of every row as the file prints them, of one component of ±K.

    Parameters
    ----------
    group : Group
        The connected states that the levels belong to.
    levels : Levels
        n solved levels.
    form : Format
        Which columns there are.
    negative : bool, optional
        Of a K doublet whose two levels differ in species, the one with -K.

    Returns
    -------
    (n, width) array of int
        Half-integers rounded up.
    """
    quanta, n = levels.quanta, levels.rotational
    v = quanta.get("v", np.zeros(len(levels), dtype=np.int64))
    columns = [n, *_rotation(group, levels, v, form, negative)]
    if form.states:
        columns.append(np.array([state.number for state in group.states])[v])
    names = [name for name in quanta if name not in ("v", "n", "k", "ka", "kc")] if group.spins else []
    totals = [(quanta[name] + 1) // 2 if name in levels.halves else quanta[name] for name in names] or [n]
    if form.aggregate:
        columns += [pattern_numbers(group, levels, names), totals[-1]]
    elif form.spins:
        columns += totals + [totals[-1]] * (form.spins - len(totals))
    return np.stack(columns, axis=1)


def _rotation(group: Group, levels: Levels, v: Ints, form: Format, negative: bool) -> list[Ints]:
    """Nothing, signed K, or Ka and Kc."""
    quanta = levels.quanta
    if form.rotation == 1:
        return []
    if form.rotation == 3:
        if "kc" in quanta:
            return _ka_kc(group, levels, v)
        n = levels.rotational  # linear, in a file with the quanta of asymmetric tops
        return [np.zeros_like(n), n]
    if "kc" in quanta:
        k = quanta["kc"] if group.oblate else quanta["ka"]
        odd = is_odd(quanta["ka"], quanta["kc"])
    else:
        k = quanta.get("k", np.zeros(len(levels), dtype=np.int64))
        odd = np.full(len(levels), negative)
    return [np.where(odd & ~_unsigned(group, v, k), -k, k)]


def _unsigned(group: Group, v: Ints, k: Ints) -> NDArray[np.bool_]:
    """Which levels are of E species or l-doubled: the sign of K, or the parity of the other K, says nothing of them."""
    found = np.zeros(len(k), dtype=bool)
    for place, state in enumerate(group.states):
        found |= (v == place) & state.is_e(k)
    return found


def _ka_kc(group: Group, levels: Levels, v: Ints) -> list[Ints]:
    """Ka and Kc; of E species the K that is not along the axis is N - K, and N - K + 1 in the first state of an l-doubled pair."""
    n, ka, kc = levels.rotational, levels.quanta["ka"], levels.quanta["kc"]
    along = kc if group.oblate else ka
    firsts = [pair.first for pair in group.effect.pairs]
    other = np.where(_unsigned(group, v, along), n - along + np.isin(v, firsts), ka if group.oblate else kc)
    return [other, along] if group.oblate else [along, other]


@dataclass(frozen=True)
class GroupLines:
    """The lines of one group, one component of a K doublet each: columns (n,) and quantum numbers (n, width)."""

    frequency_mhz: Floats
    intensity: Floats
    energy_lower_mhz: Floats
    g_upper: Ints
    upper: Quanta
    lower: Quanta
    error_mhz: Floats


_COLUMNS = ("frequency_mhz", "intensity", "energy_lower_mhz", "g_upper", "upper", "lower", "error_mhz")


def transitions_of(group: Group, levels: Levels, request: Request, q: float) -> Transitions:
    """The transitions between levels of a group that exist, have one weight and may pass the cut of an .int file.

    Parameters
    ----------
    group : Group
        The connected states.
    levels : Levels
        Their levels.
    request : Request
        Temperature and limits.
    q : float
        Partition function as the file counts it.

    Returns
    -------
    Transitions
        Frequencies in MHz and strengths in D². Lines between unequal weights are those that the program leaves out too.
    """
    if not (group.effect.moments or group.effect.others):
        none = np.zeros(0, dtype=np.int32)
        return Transitions(np.zeros(0), np.zeros(0), none, none)
    found = all_transitions(
        levels, dict(group.effect.moments), cut=_wide_cut(levels, request, q), moments=group.effect.others
    )
    exists = np.ones(len(found.lower), dtype=bool)
    if (levels.weight <= 0).any():
        exists = (levels.weight[found.lower] > 0) & (levels.weight[found.upper] > 0)
    if any(state.fold > 2 and state.equivalent < 3 for state in group.states):
        exists &= share_a_weight(group, levels, found.upper, found.lower)
    else:
        exists &= equally_weighted(levels, found.upper, found.lower)
    order = rising_order(found.frequency_mhz)  # what is in order is put in order quickly later on
    rows = order if exists.all() else order[exists[order]]
    return Transitions(*(getattr(found, name)[rows] for name in ("frequency_mhz", "strength_debye2", "upper", "lower")))


def _wide_cut(levels: Levels, request: Request, q: float) -> IntensityCut | None:
    """A cut that no line of the file is below, None where STR0 is below all numbers."""
    kt, least = request.temperature_k * units.MHZ_PER_K, _NEARLY * 10.0**request.str0
    with np.errstate(over="ignore"):  # far below zero and cold: every line passes
        populated = (
            LGINT_NM2_MHZ / q * np.max(levels.weight // levels.components, initial=0) * np.exp(-levels.energy_mhz / kt)
        )
    population = np.asarray(populated, dtype=float)
    return IntensityCut(population, kt, least) if least > 0 and np.isfinite(population).all() else None


def share_a_weight(group: Group, levels: Levels, upper: Indices, lower: Indices) -> NDArray[np.bool_]:
    """Which transitions of a top with an n-fold axis the program makes: all between blocks that have a weight in common.

    Parameters
    ----------
    group : Group
        The connected states.
    levels : Levels
        Their levels.
    upper, lower : (n,) arrays of int
        Rows of the levels of each transition.

    Returns
    -------
    (n,) array of bool
        Whether a weight of A or B species or of E species is that of one of these in the other block.
    """
    if levels.kind in ("prolate", "oblate"):  # where both weights are one
        return np.ones(len(upper), dtype=bool)
    quanta = levels.quanta
    along, v = quanta["kc"] if group.oblate else quanta["ka"], quanta.get("v", np.zeros(len(levels), dtype=np.int64))
    weights = np.zeros((len(levels), 2), dtype=np.int64)
    for place, state in enumerate(group.states):
        weights[v == place] = state.block_weights(quanta["ka"], quanta["kc"], along)[v == place]
    high, low = weights[upper], weights[lower]
    return np.asarray(((high[:, :, None] == low[:, None, :]) & (high[:, :, None] > 0)).any(axis=(1, 2)))


def weights_of_lines(group: Group, levels: Levels, found: Transitions) -> Ints:
    """The nuclear-spin weight of each line, or one of all: that of its level in the later block, by F, first state and species, one
    component of ±K."""
    weight = levels.weight // levels.components
    if len(weight) and weight.min() == weight.max():
        return np.full(1, weight[0])
    if (weight[found.upper] == weight[found.lower]).all() or "kc" not in levels.quanta:
        return np.asarray(weight[found.lower])
    ka, kc = levels.quanta["ka"] % 2, levels.quanta["kc"] % 2
    species = np.array([[0, 3], [1, 2]])[(kc, ka) if group.oblate else (ka, kc)]
    v = levels.quanta.get("v", np.zeros(len(levels), dtype=np.int64))
    order = (levels.multiplicity * (len(group.states) + 1) + v) * 4 + species
    for block in levels.blocks:  # which comes where its first state and species do
        rows = slice(block.start, block.start + len(block.energies_mhz))
        order[rows] = order[rows].min()
    return np.asarray(np.where(order[found.upper] > order[found.lower], weight[found.upper], weight[found.lower]))


def equally_weighted(levels: Levels, upper: Indices, lower: Indices) -> NDArray[np.bool_]:
    """Which transitions join levels of one nuclear-spin weight; between others there are none, whatever the dipole is."""
    weight = levels.weight // levels.components
    if len(weight) and weight.min() == weight.max():
        return np.ones(len(upper), dtype=bool)
    return np.asarray(weight[upper] == weight[lower])


_NEARLY = 0.999  # of the cut: what is found so is looked at with all digits and both terms of the cut
LEAST_MHZ = 0.00005  # a line that would print as 0.0000 is not in the program's files
_STR_SCALE_MHZ = 300_000.0  # STR1 counts (ν/300 GHz)²


def within(request: Request, frequency_mhz: Floats, intensity: Floats) -> NDArray[np.bool_]:
    """Which lines are below FQLIM and stronger than 10^STR0 + 10^STR1 (ν/300 GHz)² nm² MHz."""
    least = 10.0**request.str0 + 10.0**request.str1 * (frequency_mhz / _STR_SCALE_MHZ) ** 2
    limits = (frequency_mhz > LEAST_MHZ) & (frequency_mhz < request.fqlim_ghz * 1e3)
    return np.asarray(limits & (intensity > least))


def lines_of(
    group: Group,
    levels: Levels,
    found: Transitions,
    form: Format,
    request: Request,
    q: float,
    spread: Floats | None = None,
) -> GroupLines:
    """The lines of a group within the limits of an .int file, those of one component of a K doublet each.

    Parameters
    ----------
    group : Group
        The connected states.
    levels : Levels
        Their levels.
    found : Transitions
        Frequencies in MHz and strengths in D² between them.
    form : Format
        Which quantum numbers there are.
    request : Request
        Temperature and limits.
    q : float
        Partition function as the file counts it.
    spread : (levels, k) array, optional
        MHz; the differences have the errors of the lines as their lengths, which are 0 without it.

    Returns
    -------
    GroupLines
        Frequencies and lower energies in MHz, intensities in nm² MHz.
    """
    intensity = _intensity(group, levels, found, request, q)
    there = within(request, found.frequency_mhz, intensity)
    chosen = slice(None) if there.all() else np.flatnonzero(there)
    up, low = found.upper[chosen], found.lower[chosen]
    error = np.zeros(len(up)) if spread is None else np.linalg.norm(spread[up] - spread[low], axis=1)
    g_upper = (levels.multiplicity * (levels.weight // levels.components))[up]
    columns = (found.frequency_mhz[chosen], intensity[chosen], levels.energy_mhz[low], error)
    index, upper, lower = _one_component_each(group, levels, form, up, low)
    frequency, strength, energy, error = (column[index] for column in columns)
    return GroupLines(frequency, strength, energy, g_upper[index], upper, lower, error)


def _intensity(group: Group, levels: Levels, found: Transitions, request: Request, q: float) -> Floats:
    """The intensity of one component of each line in nm² MHz."""
    kt = request.temperature_k * units.MHZ_PER_K
    out = LGINT_NM2_MHZ / q * found.frequency_mhz
    out *= found.strength_debye2
    if (levels.components > 1).any():
        out /= np.maximum(levels.components[found.upper], levels.components[found.lower])
    out *= weights_of_lines(group, levels, found)
    below = np.expm1(-found.frequency_mhz / kt)
    below *= -np.exp(-levels.energy_mhz / kt)[found.lower]
    out *= below
    return out


def _one_component_each(
    group: Group, levels: Levels, form: Format, up: Indices, low: Indices
) -> tuple[Ints | slice, Quanta, Quanta]:
    """Which transition each line of one component of ±K belongs to, and the quantum numbers of its levels, (lines, width)."""
    plus = quanta_of(group, levels, form).astype(np.int16)
    if (levels.components == 1).all():
        return slice(None), rows_of(plus, up), rows_of(plus, low)
    pair, minus = (levels.components[up], levels.components[low]), quanta_of(group, levels, form, True).astype(np.int16)
    count = np.maximum(*pair)
    twice = np.flatnonzero((pair[0] == 2) & (pair[1] == 2))
    rest = np.flatnonzero(count == 1)
    mixed = np.flatnonzero((count == 2) & (np.minimum(*pair) == 1))
    pieces = [
        (rest, plus[up[rest]], plus[low[rest]]),
        (twice, minus[up[twice]], plus[low[twice]]),
        (twice, plus[up[twice]], minus[low[twice]]),
        (mixed, plus[up[mixed]], plus[low[mixed]]),
        (mixed, minus[up[mixed]], minus[low[mixed]]),
    ]
    index = np.concatenate([piece[0] for piece in pieces])
    return index, np.concatenate([piece[1] for piece in pieces]), np.concatenate([piece[2] for piece in pieces])


def as_catalogue(lines: list[tuple[GroupLines, int]], form: Format, tag: int, dr: int) -> Catalogue:
    """Lines of all groups, each with its QNFMT, in order of frequency.

    Parameters
    ----------
    lines : list of (GroupLines, int)
        Lines of each group, and the code of its quantum numbers.
    form : Format
        Which quantum numbers there are.
    tag : int
        Of the species.
    dr : int
        2 where all states are those of linear molecules, else 3.

    Returns
    -------
    Catalogue
        Frequencies in MHz, lower energies in cm⁻¹, log10 of intensities in nm² MHz.

    Raises
    ------
    ValueError
        For a tag of more than six digits.
    """
    joined = {name: end_to_end([getattr(each, name) for each, _ in lines]) for name in _COLUMNS}
    qnfmt = np.concatenate([np.full(len(each.frequency_mhz), code) for each, code in lines])
    order = _rising(joined["frequency_mhz"])
    width = max(6, form.width)
    quanta = {}
    for name in ("upper", "lower"):
        table = np.full((len(qnfmt), width), BLANK, dtype=np.int16)
        table[:, : form.width] = joined[name][order]
        quanta[name] = table
    with np.errstate(divide="ignore"):
        lgint = np.log10(joined["intensity"][order])
    numbers = {
        "frequency_mhz": joined["frequency_mhz"][order],
        "error_mhz": joined["error_mhz"][order],
        "lgint": lgint,
        "energy_lower_cm": joined["energy_lower_mhz"][order] / units.MHZ_PER_CM,
        "g_upper": joined["g_upper"][order],
    }
    return catalogue_of(numbers, quanta["upper"], quanta["lower"], qnfmt[order].astype(np.int32), tag, linear=dr == 2)


def _rising(frequency_mhz: Floats) -> Ints | slice:
    """What puts frequencies in order, those that are equal as they stand."""
    if (frequency_mhz[1:] >= frequency_mhz[:-1]).all():
        return slice(None)
    return rising_order(frequency_mhz)


def as_level_list(solved: list[tuple[Group, Levels]], form: Format) -> LevelList:
    """The levels of all groups as an .egy file has them, ±K apart; block and rank count the blocks here."""
    tables = []
    for group, levels in solved:
        for negative in (False, True) if (levels.components > 1).any() else (False,):
            rows = np.flatnonzero((levels.weight > 0) & (levels.components > int(negative)))
            mixing = np.ones(len(levels)) if levels.mixing is None else levels.mixing
            g = levels.multiplicity * (levels.weight // levels.components)
            quanta = quanta_of(group, levels, form, negative)
            tables.append((levels.energy_mhz[rows] / units.MHZ_PER_CM, mixing[rows], g[rows], quanta[rows]))
    energy, mixing, g, quanta = (np.concatenate([table[i] for table in tables]) for i in range(4))
    order = np.lexsort((energy, quanta[:, -1] if form.spins else quanta[:, 0]))
    n = len(order)
    return LevelList(
        block=np.ones(n, dtype=np.int32),
        rank=np.arange(1, n + 1, dtype=np.int32),
        energy_cm=energy[order],
        error_cm=np.zeros(n),
        mixing=mixing[order],
        degeneracy=g[order].astype(np.int32),
        quanta=quanta[order].astype(np.int16),
    )
