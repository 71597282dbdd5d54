"""Prediction from files with spins, several states or operators outside orthorhombic symmetry.

The other files go through `predict`, with constants by their names.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from rotor import units
from rotor.arrays import Floats, Ints, end_to_end
from rotor.formats.spcat.block_numbers import blocks_of
from rotor.formats.spcat.file_lines import (
    LEAST_MHZ,
    as_catalogue,
    as_level_list,
    lines_of,
    transitions_of,
)
from rotor.formats.spcat.file_model import Group, groups_of, line_names
from rotor.formats.spcat.file_quanta import Format, format_of
from rotor.formats.spcat.hamiltonian.codes import constants_of, split_code
from rotor.formats.spcat.hamiltonian.states import states_of
from rotor.formats.spcat.hamiltonian.undiagonalized import is_undiagonalized
from rotor.formats.spcat.prediction_notes import (
    note_of_diagonal_elements,
    notes_of_basis,
    notes_of_diagonal,
    notes_of_files,
    notes_of_full_basis,
)
from rotor.formats.spcat.text.catalogue import Catalogue
from rotor.formats.spcat.text.egy import LevelList
from rotor.formats.spcat.text.int_file import IntensityFile, Request
from rotor.formats.spcat.text.par import ParameterFile
from rotor.formats.spcat.variances import variance_factor
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.levels import Levels
from rotor.spectra.lines import Lines
from rotor.spectra.transitions import Transitions
from rotor.thermodynamics import PartitionFunction
from rotor.tops.top import Top

_TAIL = 1e-7  # largest share of Q beyond the last F
_STEP = 8  # number of F that are added to Q at a time
_LAST = 2000


def predicted(
    parameters: ParameterFile,
    intensities: IntensityFile,
    *,
    own_q: bool = False,
    as_spcat: bool = False,
    full_basis: bool = False,
) -> tuple[Catalogue, Lines, float, Callable[[], LevelList], list[str]]:
    """The prediction of files with spins, several states or other operators; see `predict.predict`.

    Parameters
    ----------
    parameters : ParameterFile
        The .var or .par file.
    intensities : IntensityFile
        The .int file.
    own_q : bool, optional
        Whether Q is summed over the levels, with all K, instead of taken from QROT.
    as_spcat : bool, optional
        Whether to reproduce erroneous moments of SPCAT.
    full_basis : bool, optional
        Whether to ignore KNMIN and KNMAX.

    Returns
    -------
    catalogue : Catalogue
        The catalogue as SPCAT would list it.
    lines : Lines
        The lines before K doublets were divided.
    q : float
        Partition function with the weights and the zero of energy of the file.
    levels : callable
        Makes the list of levels as SPCAT would write it.
    notes : list of str
        Notes on input that SPCAT ignores silently.

    Raises
    ------
    ValueError
        As `predict` does.
    """
    request = intensities.request
    groups = _groups_to_solve(parameters, intensities, as_spcat, full_basis)
    form = format_of(parameters, groups)
    q = request.qrot
    if own_q:
        q = summed_q(groups_of(parameters, intensities, full_basis=True), request.temperature_k).q
    groups = _with_levels(groups, request)
    solved = _solved(groups, request, form)
    notes = notes_of_files(parameters, intensities, as_spcat) + _notes_without_diagonalization(solved, as_spcat)
    transitions = [transitions_of(group, levels, request, q) for group, levels in solved]
    spreads = _spreads(solved, parameters)
    listed = [
        lines_of(group, levels, allowed, form, request, q, spread)
        for (group, levels), allowed, spread in zip(solved, transitions, spreads, strict=True)
    ]
    pieces = [(group_lines, form.qnfmt(group.spins)) for group_lines, (group, _) in zip(listed, solved, strict=True)]
    listed_catalogue = as_catalogue(
        pieces, form, request.tag, 2 if all(s.linear for g in groups for s in g.states) else 3
    )
    if any(state.is_cut for group in groups for state in group.states):
        notes += notes_of_basis(groups, _groups_to_solve(parameters, intensities, as_spcat, True), request)
    notes += notes_of_diagonal(groups, parameters.options[0].diag, _highest_n(parameters, request))
    if full_basis:
        notes += notes_of_full_basis(states_of(parameters), _highest_n(parameters, request))
    lines = _lines(parameters, solved, [group_lines.transitions for group_lines in listed], form, request, q)
    with_spread = [spread_of_group for spread_of_group in spreads if spread_of_group is not None]
    if with_spread:
        lines = replace(lines, given_spread=np.concatenate(with_spread))
    plain = [(group, replace(levels, blocks=())) for group, levels in solved]
    return listed_catalogue, lines, q, partial(_level_list, parameters, plain, form, spreads), notes


def _level_list(
    parameters: ParameterFile,
    solved: list[tuple[Group, Levels]],
    form: Format,
    spreads: Sequence[Floats | None],
) -> LevelList:
    """The levels as SPCAT lists them, with its block numbers and places."""
    return as_level_list(solved, form, spreads, blocks_of(parameters, [group for group, _ in solved]))


def _notes_without_diagonalization(solved: list[tuple[Group, Levels]], as_spcat: bool) -> list[str]:
    """The notes of groups with DIAG below 0, whose levels are diagonal elements in place of eigenvalues.

    Raises ValueError with `as_spcat` for a group whose basis is not one of Wang functions, and which therefore has eigenvalues.
    """
    listed = [
        is_undiagonalized(levels, group.diag) for group, levels in solved if group.diag < 0 and not _is_diagonal(group)
    ]
    if as_spcat and not all(listed):
        raise ValueError(
            "DIAG below 0: diagonal elements in place of eigenvalues, which are computed for asymmetric tops and states over Wang "
            "functions alone; give DIAG = 0, or leave --as-spcat out for eigenvalues"
        )
    return [note_of_diagonal_elements(undiagonalized) for undiagonalized in dict.fromkeys(listed)]


def _is_diagonal(group: Group) -> bool:
    """Whether a single state of a symmetric or linear top without spins has no elements off the diagonal."""
    return group.top.kind != "asymmetric" and len(group.states) == 1 and not group.spins


def _solved(groups: list[Group], request: Request, form: Format) -> list[tuple[Group, Levels]]:
    """The levels of all groups from FBGN to FEND; levels of states above MAXV have weight 0."""
    groups_and_levels = [(group, group.levels(f_range(group, request))) for group in groups]
    if request.maxv >= 0 and form.states:
        groups_and_levels = [(group, _up_to(request.maxv, group, levels)) for group, levels in groups_and_levels]
    if not any((levels.weight > 0).any() for _, levels in groups_and_levels):
        raise ValueError(
            f"no level has a weight from FBGN = {request.fbgn} to FEND = {request.fend}, MAXV = {request.maxv}; give other limits or "
            "weights (WTPL, WTMN, EWT)"
        )
    return groups_and_levels


def _up_to(maxv: int, group: Group, levels: Levels) -> Levels:
    return replace(levels, weight=np.where(_file_numbers(group, levels) <= maxv, levels.weight, 0))


def _groups_to_solve(
    parameters: ParameterFile, intensities: IntensityFile, as_spcat: bool, full_basis: bool
) -> list[Group]:
    """The groups for the levels of an .int file, which reach N = FEND + the sum of the spins."""
    highest = _highest_n(parameters, intensities.request)
    return groups_of(parameters, intensities, as_spcat=as_spcat, full_basis=full_basis, highest_n=highest)


def _highest_n(parameters: ParameterFile, request: Request) -> int:
    return request.fend + max(sum(state.spins) for state in states_of(parameters)) // 2


def levels_of_files(
    parameters: ParameterFile, intensities: IntensityFile, *, as_spcat: bool = False, full_basis: bool = False
) -> LevelList:
    """The levels of an .int file from FBGN to FEND as SPCAT lists them, with or without named constants.

    Energies in cm⁻¹ from the zero of the Hamiltonian, their errors by the covariance of the file, degeneracies with the weights of the
    file. Raises ValueError as `predict.predict` does.
    """
    groups = _groups_to_solve(parameters, intensities, as_spcat, full_basis)
    form = format_of(parameters, groups)
    solved = _solved(_with_levels(groups, intensities.request), intensities.request, form)
    return _level_list(parameters, solved, form, _spreads(solved, parameters))


def _spreads(solved: list[tuple[Group, Levels]], parameters: ParameterFile) -> list[Floats | None]:
    """∂E/∂p F for the levels of each group, with F of the covariance of the file."""
    factor, names = variance_factor(parameters), line_names(parameters)
    return [level_spreads(group, levels, names, factor) for group, levels in solved]


def _with_levels(groups: list[Group], request: Request) -> list[Group]:
    """The groups with levels from FBGN to FEND; ValueError if there are none."""
    present = [group for group in groups if group.has_levels(f_range(group, request))]
    if not present:
        limits = sorted({(state.kmin, state.plus, state.minus) for group in groups for state in group.states})
        raise ValueError(
            f"no level exists from FBGN = {request.fbgn} to FEND = {request.fend}: N must reach KNMIN and a weight be above 0; "
            f"KNMIN, WTPL, WTMN of the states are {limits}"
        )
    return present


def level_spreads(group: Group, levels: Levels, names: Sequence[str], factor: Floats | None) -> Floats | None:
    """∂E/∂p F for each level, whose rows give errors of levels and lines; None without a covariance.

    Parameters
    ----------
    group : Group
        States with their effect and top.
    levels : Levels
        Levels of the group.
    names : sequence of str
        The parameters of the file, in the order of the rows of `factor`.
    factor : (parameters, k) array or None
        F with F Fᵀ the covariance, in MHz.

    Returns
    -------
    (levels, k) array or None
        In MHz.
    """
    if factor is None:
        return None
    parameters = tuple(group.effect.parameters(group.top))
    rows = [names.index(name) for name in parameters]
    return np.asarray(level_derivatives(group.top, levels, parameters) @ factor[rows])


def f_range(group: Group, request: Request) -> tuple[int, int]:
    """The doubled F from FBGN to FEND, which are rounded up."""
    half = sum(group.spins) % 2
    return max(half, 2 * request.fbgn - half), 2 * request.fend - half


def summed_q(groups: list[Group], temperature_k: float) -> PartitionFunction:
    """Q summed over all levels of all groups, with F until the rest is below 1e-7; weights and zero of energy are those of the file."""
    if not (math.isfinite(temperature_k) and temperature_k > 0):
        raise ValueError(f"temperature {temperature_k} K: a temperature is above 0 K")
    kt = temperature_k * units.MHZ_PER_K
    total, last = 0.0, 0
    for group in groups:
        half, f, group_sum, before = sum(group.spins) % 2, 0, 0.0, math.inf
        while True:
            levels = group.levels((2 * f + half, 2 * (f + _STEP) - 2 + half))
            piece = float((levels.degeneracy * np.exp(-levels.energy_mhz / kt)).sum())
            group_sum, f = group_sum + piece, f + _STEP
            if piece < before < math.inf and piece * piece / (before - piece) < _TAIL * group_sum:
                break
            if f > _LAST:
                raise ValueError(f"Q({temperature_k:g} K) needs levels beyond F = {_LAST}; give QROT")
            before = piece
        total, last = total + group_sum, max(last, f - 1)
    return PartitionFunction(
        temperature_k, total, last, _TAIL, f"summed from levels to F = {last}, relative error below {_TAIL:g}"
    )


def _lines(
    parameters: ParameterFile,
    solved: list[tuple[Group, Levels]],
    transitions: list[Transitions],
    form: Format,
    request: Request,
    q: float,
) -> Lines:
    """The lines of the catalogue with one table of levels for all groups and one line for both components of ±K."""
    starts = np.cumsum([0, *(len(levels) for _, levels in solved[:-1])]).astype(np.int32)
    levels = _joined(solved, form)
    t = request.temperature_k
    above = math.exp(levels.ground_mhz / units.MHZ_PER_K / t)  # Q counts from zero, `Lines` from the lowest level
    return Lines(
        top=_shown(parameters, solved[0][0]),
        levels=levels,
        frequency_mhz=end_to_end([each.frequency_mhz for each in transitions]),
        strength_debye2=end_to_end([each.strength_debye2 for each in transitions]),
        upper=end_to_end([each.upper + start for each, start in zip(transitions, starts, strict=True)]),
        lower=end_to_end([each.lower + start for each, start in zip(transitions, starts, strict=True)]),
        temperature_k=t,
        min_lgint=request.str0,
        range_mhz=(LEAST_MHZ, request.fqlim_ghz * 1e3),
        given_partition=PartitionFunction(t, q * above, None, math.nan, "given"),
    ).sorted()


def _joined(tables: list[tuple[Group, Levels]], form: Format) -> Levels:
    """The levels of all groups in one table, with v of the file; a level without a spin that others have repeats its last sum."""
    most = max((levels for _, levels in tables), key=lambda levels: len(levels.quanta))
    names = [name for name in most.quanta if name != "v"]
    quanta: dict[str, Ints] = {}
    if form.states:
        quanta["v"] = np.concatenate([_file_numbers(group, levels) for group, levels in tables])
    for name in names:
        quanta[name] = np.concatenate([_column(levels, name, most) for _, levels in tables])
    joined: dict[str, Any] = {
        name: np.concatenate([getattr(levels, name) for _, levels in tables])
        for name in ("energy_mhz", "multiplicity", "components", "weight")
    }
    mixing = [np.ones(len(levels)) if levels.mixing is None else levels.mixing for _, levels in tables]
    return replace(most, quanta=quanta, blocks=(), mixing=np.concatenate(mixing), **joined)


def _file_numbers(group: Group, levels: Levels) -> Ints:
    numbers = np.array([state.number for state in group.states])
    return np.asarray(numbers[levels.quanta.get("v", np.zeros(len(levels), dtype=np.int64))])


def _column(levels: Levels, name: str, most: Levels) -> Ints:
    if name in levels.quanta:
        return np.asarray(levels.quanta[name])
    if name in ("n", "j"):
        return levels.rotational
    if name in ("k", "ka"):
        return np.asarray(levels.quanta.get("k", np.zeros(len(levels), dtype=np.int64)))
    if name == "kc":
        return np.asarray(levels.rotational - levels.quanta.get("k", np.zeros(len(levels), dtype=np.int64)))
    total = (levels.multiplicity - 1).astype(np.int64)
    return np.asarray(total if name in most.halves else total // 2)


def _shown(parameters: ParameterFile, group: Group) -> Top:
    """The top of the lowest state with named constants, if they have names; else the top that represents its symmetry."""
    states = max(abs(parameters.options[0].nvib), 1)
    parameters_of_state = []
    for parameter in parameters.parameters:
        d = split_code(parameter.code, states)
        wild = d.v1 == d.v2 and d.v1 >= states
        if not (d.i1 or d.i2 or d.ns) and d.typ < 12 and any(d[:8]) and (wild or d.v1 == d.v2 == 0):
            code = (d.typ * 10 + d.ksq) * 1000 + d.nsq * 100
            parameters_of_state.append(replace(parameter, code=code, constrained=False, text=""))
    first = parameters.options[0]
    option = replace(first, spind=-1 if first.spind < 0 else 1, nvib=-1 if first.nvib < 0 else 1, knmin=0, text="")
    if group.states[0].linear:
        option = replace(option, spind=-1, knmax=0)
    try:
        constants = constants_of(replace(parameters, options=(option,), parameters=tuple(parameters_of_state)))
    except ValueError:
        return group.top
    return replace(group.top, constants=constants)
