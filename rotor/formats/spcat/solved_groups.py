"""Levels of the groups of an .int file, with their errors, and its lines with one table of levels.

The covariance of a .var file is C = D V Vᵀ D. D are the errors of the parameter lines; V (upper triangular, column by column, ten
characters for each number) follows them. Without V the errors are uncorrelated, as in SPCAT. A parameter with a minus sign has a fixed
ratio to the one before.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import takewhile
from typing import Any, NamedTuple

import numpy as np

from rotor import units
from rotor.arrays import Floats, Ints, end_to_end
from rotor.formats.spcat.file_model import Group
from rotor.formats.spcat.file_quanta import Format
from rotor.formats.spcat.hamiltonian.code_table import file_codes
from rotor.formats.spcat.hamiltonian.coded_file import line_names
from rotor.formats.spcat.hamiltonian.codes import FREE_ABOVE, HELD_BELOW, NO_LEADER, file_constants
from rotor.formats.spcat.hamiltonian.states import file_states, options_alone
from rotor.formats.spcat.text.int_file import Request
from rotor.formats.spcat.text.par import ParameterFile
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.levels import Levels
from rotor.spectra.lines import Lines
from rotor.spectra.transitions.pairs import Transitions
from rotor.thermodynamics.sums.partition import PartitionFunction
from rotor.tops.top import Top

MOST_EXPONENT = 700.0  # of a population in double precision
_DIGITS = 10  # characters of each correlation


def highest_n(parameters: ParameterFile, request: Request) -> int:
    """The highest N of the levels up to FEND."""
    return request.fend + max(sum(state.spins) for state in file_states(parameters)) // 2


class SolvedGroup(NamedTuple):
    """A group with its levels, and ∂E/∂p F for each level, (levels, k) in MHz, whose rows give errors of levels and lines.

    F Fᵀ is the covariance of the parameters p of the file; without one the spread is None.
    """

    group: Group
    levels: Levels
    spread: Floats | None


def solved_groups(parameters: ParameterFile, groups: list[Group], request: Request, form: Format) -> list[SolvedGroup]:
    """The levels of all groups from FBGN to FEND, with their errors; levels of states above MAXV have weight 0.

    Raises ValueError if there is no level with a weight.
    """
    factor, names = variance_factor(parameters), line_names(parameters)
    solved = []
    for group in _with_levels(groups, request):
        levels, spread = group.levels(_f_range(group, request)), None
        if factor is not None:
            parameters_of_group = tuple(group.effect.parameters(group.top))
            rows = [names.index(name) for name in parameters_of_group]
            spread = level_derivatives(group.top, levels, parameters_of_group) @ factor[rows]
        if request.maxv >= 0 and form.states:
            # a weight of 0 leaves the level out of lines, but in the table
            levels = replace(levels, weight=np.where(group.numbers(levels) <= request.maxv, levels.weight, 0))
        solved.append(SolvedGroup(group, levels, spread))
    if not any((each.levels.weight > 0).any() for each in solved):
        raise ValueError(
            f"no level has a weight from FBGN = {request.fbgn} to FEND = {request.fend}, MAXV = {request.maxv}; give other limits or "
            "weights (WTPL, WTMN, EWT)"
        )
    return solved


def _with_levels(groups: list[Group], request: Request) -> list[Group]:
    """The groups with levels from FBGN to FEND; ValueError if there are none."""
    present = [group for group in groups if group.has_levels(_f_range(group, request))]
    if not present:
        limits = sorted({(state.kmin, state.plus, state.minus) for group in groups for state in group.states})
        raise ValueError(
            f"no level exists from FBGN = {request.fbgn} to FEND = {request.fend}: N must reach KNMIN and a weight be above 0; "
            f"KNMIN, WTPL, WTMN of the states are {limits}"
        )
    return present


def _f_range(group: Group, request: Request) -> tuple[int, int]:
    """The doubled F from FBGN to FEND, which are rounded up."""
    half = sum(group.spins) % 2  # F has the parity of the sum of the spins, doubled
    return max(half, 2 * request.fbgn - half), 2 * request.fend - half


def joined_lines(
    parameters: ParameterFile,
    solved: Sequence[SolvedGroup],
    transitions: Sequence[Transitions],
    form: Format,
    request: Request,
) -> Lines:
    """The lines of the catalogue with one table of levels for all groups and one line for both components of ±K."""
    starts = np.cumsum([0, *(len(each.levels) for each in solved[:-1])]).astype(np.int32)
    levels, spreads = _joined(solved, form), [each.spread for each in solved if each.spread is not None]
    t = request.temperature_k
    above = levels.ground_mhz / units.MHZ_PER_K / t  # Q counts from zero, `Lines` from the lowest level
    if abs(above) > MOST_EXPONENT:
        raise ValueError(
            f"the lowest level lies at {levels.ground_mhz / units.MHZ_PER_CM:.3g} cm-1, and QROT counts energies from zero: its "
            f"population at TEMP = {t:g} K is beyond the range of numbers; give states energies near zero"
        )
    return Lines(
        top=_shown(parameters, solved[0].group),
        levels=levels,
        frequency_mhz=end_to_end([each.frequency_mhz for each in transitions]),
        strength_debye2=end_to_end([each.strength_debye2 for each in transitions]),
        upper=end_to_end([each.upper + start for each, start in zip(transitions, starts, strict=True)]),
        lower=end_to_end([each.lower + start for each, start in zip(transitions, starts, strict=True)]),
        temperature_k=t,
        min_lgint=request.str0,
        range_mhz=request.range_mhz,
        stated_partition=PartitionFunction(t, request.qrot * math.exp(above), None, math.nan, "given"),
        stated_spread=np.concatenate(spreads) if spreads else None,
    ).sorted()


def _joined(solved: Sequence[SolvedGroup], form: Format) -> Levels:
    """The levels of all groups in one table, with v of the file; a level without a spin that others have repeats its last sum."""
    tables = [each.levels for each in solved]
    most = max(tables, key=lambda levels: len(levels.quanta))
    quanta: dict[str, Ints] = {}
    if form.states:
        quanta["v"] = np.concatenate([each.group.numbers(each.levels) for each in solved])
    for name in [name for name in most.quanta if name != "v"]:
        quanta[name] = np.concatenate([_column(levels, name, most) for levels in tables])
    joined: dict[str, Any] = {
        name: np.concatenate([getattr(levels, name) for levels in tables])
        for name in ("energy_mhz", "multiplicity", "components", "weight")
    }
    return replace(
        most, quanta=quanta, blocks=(), mixing=np.concatenate([levels.shares for levels in tables]), **joined
    )


def _column(levels: Levels, name: str, most: Levels) -> Ints:
    if name in levels.quanta:
        return np.asarray(levels.quanta[name])
    if name in ("n", "j"):
        return levels.rotational
    if name in ("k", "ka"):
        return levels.quantum("k")
    if name == "kc":
        return np.asarray(levels.rotational - levels.quantum("k"))
    total = (levels.multiplicity - 1).astype(np.int64)
    return np.asarray(total if name in most.halves else total // 2)


def _shown(parameters: ParameterFile, group: Group) -> Top:
    """The top of the lowest state with named constants, if they have names; else the top that represents its symmetry."""
    parameters_of_state = [
        replace(parameter, code=d.in_lowest_state, constrained=False, text="")
        for parameter, d in zip(parameters.parameters, file_codes(parameters), strict=True)
        if d.has_name
    ]
    option = replace(options_alone(parameters, 0), knmin=0)
    if group.states[0].linear:
        option = replace(option, spind=-1, knmax=0)
    try:
        constants = file_constants(replace(parameters, options=(option,), parameters=tuple(parameters_of_state)))
    except ValueError:
        return group.top
    return replace(group.top, constants=constants)


def variance_factor(file: ParameterFile) -> Floats | None:
    """F (parameters, k) in MHz with F Fᵀ the covariance of the parameter lines; None without estimated errors.

    Raises ValueError for correlations of another number of parameters, or that are not numbers.
    """
    errors = np.array([0.0 if each.constrained else each.error or 0.0 for each in file.parameters])
    errors[~((errors >= HELD_BELOW) & (errors < FREE_ABOVE))] = 0.0
    if not errors.any():
        return None
    leaders = [i for i, parameter in enumerate(file.parameters) if not parameter.constrained]
    fitted = [i for i in leaders if errors[i] > 0]
    correlations = _correlations(file)
    named = leaders if len(correlations) == len(leaders) else fitted
    if not len(correlations):
        correlations = np.eye(len(named))
    if len(correlations) != len(named):
        raise ValueError(
            f"correlations of {len(correlations)} parameters stand at the end of the file, which has {len(fitted)} with an error; "
            "give the .var as it was written"
        )
    factor = np.zeros((len(file.parameters), len(named)))
    factor[named] = errors[named, None] * correlations
    for i, parameter in enumerate(file.parameters):
        if parameter.constrained:
            leader = max((j for j in leaders if j < i), default=None)
            if leader is None:
                raise parameter.refusal(NO_LEADER)
            value = file.parameters[leader].value
            factor[i] = factor[leader] * (parameter.value / value) if value else 0.0
    return factor


def _correlations(file: ParameterFile) -> Floats:
    """V (k, k), upper triangular; (0, 0) if the file has none.

    As in SPCAT (`getpar`, `getvar`), V is ignored after fewer parameters than NPAR, and so is text after the parameters, such as another
    list."""
    rows = list(takewhile(lambda line: line.strip()[:1] in "+-.0123456789", file.rest.splitlines()))
    if len(file.parameters) < file.header.npar:
        rows = []
    words = [line[i : i + _DIGITS] for line in rows for i in range(0, len(line.rstrip()), _DIGITS)]
    try:
        values = [float(word) for word in words if word.strip()]
    except ValueError:
        raise ValueError(
            f"the correlations at the end of the file are no numbers of {_DIGITS} characters each"
        ) from None
    size = int((np.sqrt(8 * len(values) + 1) - 1) / 2)
    if size * (size + 1) // 2 != len(values):
        raise ValueError(
            f"{len(values)} correlations stand at the end of the file; k (k + 1)/2 are needed for k parameters"
        )
    out = np.zeros((size, size))
    out.T[np.tril_indices(size)] = values
    return out
