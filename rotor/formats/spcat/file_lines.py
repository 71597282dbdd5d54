"""Levels and lines of any .par or .var file as SPCAT lists them: K doublets as two lines, quantum numbers as in `file_quanta`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor import units
from rotor.arrays import Floats, Indices, Ints, copy_rows, end_to_end, rising_order
from rotor.formats.spcat.block_numbers import Blocks
from rotor.formats.spcat.file_model import Group
from rotor.formats.spcat.file_quanta import Format, listed_quanta
from rotor.formats.spcat.hamiltonian.states import species_numbers
from rotor.formats.spcat.solved_groups import SolvedGroup
from rotor.formats.spcat.text.catalogue import Catalogue, predicted_catalogue
from rotor.formats.spcat.text.egy import LevelList
from rotor.formats.spcat.text.fields import BLANK
from rotor.formats.spcat.text.int_file import Request
from rotor.quantum.levels import Levels
from rotor.spectra.intensity import LGINT_NM2_MHZ, IntensityCut
from rotor.spectra.transitions.pairs import Transitions, all_transitions

Quanta = NDArray[np.int16]


class GroupLines(NamedTuple):
    """The lines of one group, one for each component of a K doublet, and the transitions of these lines.

    columns: frequency_mhz, error_mhz, intensity in nm² MHz, energy_lower_mhz, g_upper (n,); quantum numbers upper, lower (n, width).
    """

    columns: dict[str, NDArray[Any]]
    transitions: Transitions


def group_transitions(group: Group, levels: Levels, request: Request) -> Transitions:
    """The transitions between existing levels in a group that may pass the cut of an .int file.

    group: the connected states. levels: their levels. request: temperature, partition function and limits.
    Returns: frequencies in MHz and strengths in D². Lines between unequal weights are left out, as in SPCAT;
    with an n-fold axis those between Wang blocks without a common weight.
    """
    if not (group.effect.moments or group.effect.others):
        none = np.zeros(0, dtype=np.int32)  # int32 halves the memory of rows
        return Transitions(np.zeros(0), np.zeros(0), none, none)
    transitions = all_transitions(
        levels,
        dict(group.effect.moments),
        (0.0, request.fqlim_ghz * 1e3),
        cut=_wide_cut(levels, request),
        moments=group.effect.others,
    )
    exists, weight = np.ones(len(transitions.lower), dtype=bool), levels.weight // levels.components
    if (weight <= 0).any():
        exists = (weight[transitions.lower] > 0) & (weight[transitions.upper] > 0)
    if any(state.fold > 2 and state.equivalent < 3 for state in group.states):
        exists &= share_a_weight(group, levels, transitions.upper, transitions.lower)
    elif (weight != weight[:1]).any():  # lines between functions of unequal weight do not exist for any dipole
        exists &= weight[transitions.upper] == weight[transitions.lower]
    order = rising_order(transitions.frequency_mhz)  # sorted lines make later sorting fast
    rows = order if exists.all() else order[exists[order]]
    return _rows(transitions, rows)


def _rows(transitions: Transitions, rows: Ints) -> Transitions:
    """Selected transitions."""
    return Transitions(
        *(getattr(transitions, name)[rows] for name in ("frequency_mhz", "strength_debye2", "upper", "lower"))
    )


def _wide_cut(levels: Levels, request: Request) -> IntensityCut | None:
    """An intensity cut below all lines of the file; None if STR0 underflows."""
    kt, least = request.temperature_k * units.MHZ_PER_K, _NEARLY * 10.0**request.str0
    with np.errstate(over="ignore"):  # far below zero and cold: every line passes
        populated = (
            LGINT_NM2_MHZ
            / request.qrot
            * np.max(levels.weight // levels.components, initial=0)
            * np.exp(-levels.energy_mhz / kt)
        )
    population = np.asarray(populated, dtype=float)
    return IntensityCut(population, kt, least) if least > 0 and np.isfinite(population).all() else None


def share_a_weight(group: Group, levels: Levels, upper: Indices, lower: Indices) -> NDArray[np.bool_]:
    """Whether SPCAT lists transitions of a top with an n-fold axis: those between blocks with a common weight.

    group: the connected states. levels: their levels. upper, lower (n,): rows of the levels of each transition.
    Returns: whether a weight of A or B species or of E species is that of one of these in the other block.
    """
    if levels.kind in ("prolate", "oblate"):  # both weights are equal
        return np.ones(len(upper), dtype=bool)
    quanta, along, v = levels.quanta, group.basis_k(levels), levels.quantum("v")
    weights = np.zeros((len(levels), 2), dtype=np.int64)
    for place, state in enumerate(group.states):
        weights[v == place] = state.block_weights(quanta["ka"], quanta["kc"], along)[v == place]
    high, low = weights[upper], weights[lower]
    return np.asarray(((high[:, :, None] == low[:, None, :]) & (high[:, :, None] > 0)).any(axis=(1, 2)))


def line_weights(group: Group, levels: Levels, transitions: Transitions) -> Ints:
    """The nuclear-spin weight of each line, or a single one for all, for one component of ±K.

    It is the weight of the level in the later block, by F, first state and species."""
    weight = levels.weight // levels.components
    if len(weight) and weight.min() == weight.max():
        return np.full(1, weight[0])  # one weight for all lines takes no memory
    if (weight[transitions.upper] == weight[transitions.lower]).all() or "kc" not in levels.quanta:
        return np.asarray(weight[transitions.lower])
    species = species_numbers(levels.quanta["ka"], levels.quanta["kc"], group.oblate)
    order = (levels.multiplicity * (len(group.states) + 1) + levels.quantum("v")) * 4 + species
    for block in levels.blocks:  # blocks are ordered by their first state and species
        rows = slice(block.start, block.start + len(block.energies_mhz))
        order[rows] = order[rows].min()
    return np.asarray(
        np.where(
            order[transitions.upper] > order[transitions.lower], weight[transitions.upper], weight[transitions.lower]
        )
    )


# factor of a preliminary cut; the selected lines are tested with full precision and both terms of the cut
_NEARLY = 0.999
_STR_SCALE_MHZ = 300_000.0  # STR1 counts (ν/300 GHz)²


def within(request: Request, frequency_mhz: Floats, intensity: Floats) -> NDArray[np.bool_]:
    """Whether lines are below FQLIM and strong enough."""
    least, most = request.range_mhz
    limits = (frequency_mhz > least) & (frequency_mhz < most)
    return np.asarray(limits & (intensity > least_intensity(request, frequency_mhz)))


def least_intensity(request: Request, frequency_mhz: Floats) -> Floats:
    """The lowest intensity of a listed line in nm² MHz, (n,): 10^STR0 + 10^STR1 (ν/300 GHz)²."""
    return np.asarray(10.0**request.str0 + 10.0**request.str1 * (frequency_mhz / _STR_SCALE_MHZ) ** 2)


def group_lines(
    group: Group, levels: Levels, spread: Floats | None, transitions: Transitions, form: Format, request: Request
) -> GroupLines:
    """The lines of a group within the limits of an .int file, one for each component of a K doublet.

    group: the connected states. levels: their levels. spread (levels, k): ∂E/∂p F in MHz; the length of a difference of rows is the error
    of a line. Without it errors are 0. transitions: frequencies in MHz and strengths in D² between them. form: which quantum numbers
    there are. request: temperature, partition function and limits.
    Returns: frequencies and lower energies in MHz, intensities in nm² MHz.
    """
    intensity = _intensity(group, levels, transitions, request)
    listed = within(request, transitions.frequency_mhz, intensity)
    if not listed.all():
        chosen = np.flatnonzero(listed)
        transitions, intensity = _rows(transitions, chosen), intensity[chosen]
    up, low = transitions.upper, transitions.lower
    error = np.zeros(len(up)) if spread is None else np.linalg.norm(spread[up] - spread[low], axis=1)
    g_upper = (levels.multiplicity * (levels.weight // levels.components))[up]
    columns = {
        "frequency_mhz": transitions.frequency_mhz,
        "error_mhz": error,
        "intensity": intensity,
        "energy_lower_mhz": levels.energy_mhz[low],
        "g_upper": g_upper,
    }
    index, upper, lower = _single_component(group, levels, form, up, low)
    chosen_columns = {name: column[index] for name, column in columns.items()}
    return GroupLines(chosen_columns | {"upper": upper, "lower": lower}, transitions)


def _intensity(group: Group, levels: Levels, transitions: Transitions, request: Request) -> Floats:
    """The intensity of one component of each line in nm² MHz."""
    kt = request.temperature_k * units.MHZ_PER_K
    out = LGINT_NM2_MHZ / request.qrot * transitions.frequency_mhz
    out *= transitions.strength_debye2
    if (levels.components > 1).any():
        out /= np.maximum(levels.components[transitions.upper], levels.components[transitions.lower])
    out *= line_weights(group, levels, transitions)
    below = np.expm1(-transitions.frequency_mhz / kt)  # 1 - exp(-hν/kT), exact for small hν/kT
    with np.errstate(over="ignore", invalid="ignore"):  # far below zero and cold, where no line may start
        below *= -np.exp(-levels.energy_mhz / kt)[transitions.lower]
        out *= below
    return out


def _single_component(
    group: Group, levels: Levels, form: Format, up: Indices, low: Indices
) -> tuple[Ints | slice, Quanta, Quanta]:
    """The transition of each line of one component of ±K, and the quantum numbers of its levels, (lines, width)."""
    plus = listed_quanta(group, levels, form).astype(np.int16)  # int16: four bytes less a number in long lists
    if (levels.components == 1).all():
        return slice(None), copy_rows(plus, up), copy_rows(plus, low)
    pair, minus = (
        (levels.components[up], levels.components[low]),
        listed_quanta(group, levels, form, True).astype(np.int16),
    )
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


def as_catalogue(lines: list[tuple[GroupLines, int]], form: Format, tag: int, *, linear: bool) -> Catalogue:
    """Lines of all groups, each with its QNFMT, in order of frequency.

    lines: lines of each group, and the code of its quantum numbers. form: which quantum numbers there are. tag: tag of the species.
    linear: whether all states are linear, so that DR is 2.
    Returns: frequencies in MHz, lower energies in cm⁻¹, log10 of intensities in nm² MHz.
    Raises ValueError for a tag of more than six digits.
    """
    joined = {name: end_to_end([each.columns[name] for each, _ in lines]) for name in lines[0][0].columns}
    qnfmt = np.concatenate([np.full(len(each.columns["g_upper"]), code) for each, code in lines])
    frequency = joined["frequency_mhz"]
    order = slice(None) if (frequency[1:] >= frequency[:-1]).all() else rising_order(frequency)
    numbers = {name: column[order] for name, column in joined.items()}
    with np.errstate(divide="ignore"):  # a strength of 0 has no logarithm
        numbers["lgint"] = np.log10(numbers["intensity"])
    numbers["energy_lower_cm"] = numbers["energy_lower_mhz"] / units.MHZ_PER_CM
    upper, lower = (np.full((len(qnfmt), max(6, form.width)), BLANK, dtype=np.int16) for _ in range(2))
    upper[:, : form.width], lower[:, : form.width] = numbers["upper"], numbers["lower"]
    return predicted_catalogue(numbers, upper, lower, qnfmt[order].astype(np.int32), tag, linear=linear)


_ALL_NUMBERS = 99  # quantum numbers; no file has as many
_RANKS = 9999  # the largest number of four digits


def as_level_list(solved: Sequence[SolvedGroup], form: Format, blocks: Blocks | None = None) -> LevelList:
    """The levels of all groups as in an .egy file: ±K separate, by block and place, with all quantum numbers.

    solved: the groups with their levels and spreads; the lengths of rows of a spread are the errors of the energies, else they are 0.
    form: which quantum numbers there are. blocks: block numbers of SPCAT; without them a block has 9999 levels, by F and energy.
    """
    tables: list[list[Any]] = []
    for group, levels, spread in solved:
        error = np.zeros(len(levels)) if spread is None else np.linalg.norm(spread, axis=1) / units.MHZ_PER_CM
        for negative in (False, True) if (levels.components > 1).any() else (False,):
            rows = np.flatnonzero((levels.weight > 0) & (levels.components > int(negative)))
            g = levels.multiplicity * (levels.weight // levels.components)
            quanta = listed_quanta(group, levels, replace(form, most=_ALL_NUMBERS), negative)
            numbered = form.aggregates(len(group.spins))
            pattern = listed_quanta(group, levels, form, negative)[:, -2] if numbered else np.full(len(levels), -1)
            energy = levels.energy_mhz / units.MHZ_PER_CM
            numbers = np.ones((2, len(rows)), dtype=np.int64)
            if blocks is not None:
                numbers = np.array(blocks.numbers(group, levels, rows, negative))
            tables.append([*numbers, *(column[rows] for column in (energy, error, levels.shares, g, quanta, pattern))])
    block, rank, energy, error, mixing, g, quanta, pattern = (
        np.concatenate(parts) for parts in zip(*tables, strict=True)
    )
    order = np.lexsort((rank, block))
    if blocks is None:
        order = np.lexsort((energy, quanta[:, -1] if form.spins else quanta[:, 0]))
        block[order], rank[order] = (1 + number for number in np.divmod(np.arange(len(order)), _RANKS))
    return LevelList(
        block=block[order].astype(np.int32),
        rank=rank[order].astype(np.int32),
        energy_cm=energy[order],
        error_cm=error[order],
        mixing=mixing[order],
        degeneracy=g[order].astype(np.int32),
        quanta=quanta[order].astype(np.int16),
        pattern=pattern[order].astype(np.int16) if form.aggregate else None,
    )
