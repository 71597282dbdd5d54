"""SPFIT's input (.par and .lin) as a fit: assigned lines, constants, free parameters and options.

A parameter of the file is the coefficient of its code: A - B for 1000, -D_J for 200. The constants follow linearly, so that the fit reports
the same numbers as SPFIT. Each field of line 2 is either applied or refused by name.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.fitting.assignment import Assignments, assignments
from rotor.fitting.fit import FitOptions
from rotor.fitting.parameters import Parameters
from rotor.fitting.result import Fit
from rotor.formats.lines.assigned_lin import with_excluded_lines
from rotor.formats.lines.assigned_lines import QUANTA
from rotor.formats.spcat.hamiltonian.codes import FIXED, FREE_ABOVE, NO_LEADER, constants_and_matrix, is_held
from rotor.formats.spcat.hamiltonian.states import is_plain
from rotor.formats.spcat.text.lin import LineList, default_note, read_lin, remark_notes, with_defaults
from rotor.formats.spcat.text.par import Header, Parameter, ParameterFile, npar_notes, read_par
from rotor.quantum.labels.labelled import LevelModel
from rotor.table import counted
from rotor.tops.constants.constants import AxisOrderError, Constants

_NO_ERRTST = 1e6  # SPFIT's value for an ERRTST of 0 or less


@dataclass(frozen=True, eq=False)
class SpfitInput:
    """The fit that a pair of .par and .lin files defines.

    constants: for a file with one state and no spins; else None, and `model` has the levels. columns: for each parameter of the file, the
    free parameter that it follows, -1 if held. ratios: the ratio to that parameter. notes: deviations from SPFIT.
    """

    file: ParameterFile
    lines: Assignments
    constants: Constants | None
    parameters: Parameters
    options: FitOptions
    columns: tuple[int, ...]
    ratios: tuple[float, ...]
    notes: tuple[str, ...]
    model: Callable[[Ints], LevelModel] | None = None


def read_fit(par: str | os.PathLike[str], lin: str | os.PathLike[str] | None = None) -> SpfitInput:
    """The fit of a .par file, with the .lin file of the same name by default.

    Raises ValueError, with file, line or option, for input that cannot be read or is not supported.
    """
    if not Path(par).exists():
        raise ValueError(f"{par}: no such file")
    beside = Path(lin) if lin is not None else Path(par).with_suffix(".lin")
    if lin is not None and not beside.exists():
        raise ValueError(f"lin: {lin}: no such file")
    if not beside.exists():
        raise ValueError(
            f"{beside}: there are no measured lines beside {Path(par).name}; SPFIT's lines stand in a .lin file"
        )
    file = read_par(par)
    try:
        names = _quanta_names(file)
    except ValueError as error:
        raise ValueError(f"{par}: {error}") from None
    lines = read_lin(beside, len(names), abs(file.header.nline))
    if not len(lines):
        raise ValueError(f"{beside}: no line; a blank line ends the list")
    try:
        return spfit_input(file, lines, Path(beside).name)
    except LineWidthError as error:
        raise ValueError(f"{beside}: {error}") from None
    except ValueError as error:
        raise ValueError(f"{par}: {error}") from None


class LineWidthError(ValueError):
    """A line has fewer or more quantum numbers than its levels."""


def _quanta_names(file: ParameterFile) -> tuple[str, ...]:
    """The quantum numbers of a state in the .lin file."""
    named = _named_constants(file)
    if named is not None:
        return QUANTA[named[0].kind]
    from rotor.formats.spcat.file_quanta import quanta_format
    from rotor.formats.spcat.fits.fit_states import groups_for_fit, quanta_names

    return quanta_names(quanta_format(file, groups_for_fit(file)))


def _named_constants(file: ParameterFile) -> tuple[Constants, Floats] | None:
    """The constants of a file by name and M of `constants_and_matrix`; None if the codes themselves are fitted.

    Codes are fitted for spins, states and further operators, for axes not in the order A >= B >= C, if the sign of SPIND requests the
    quantum numbers of the other kind of top, and for the diagonal elements of DIAG below 0.
    """
    if not is_plain(file):
        return None
    try:
        constants, matrix = constants_and_matrix(file)
    except AxisOrderError:
        return None
    # diagonal elements, over the functions of the codes
    if file.options[0].diag < 0 and constants.kind in ("asymmetric", "spherical"):
        return None
    by_k = file.options[0].by_k
    return None if (constants.kind in ("asymmetric", "spherical")) == by_k else (constants, matrix)


def spfit_input(file: ParameterFile, lines: LineList, source: str = "") -> SpfitInput:
    """The fit from a .par file and lines that have been read."""
    _refuse_options(file.header)
    columns, ratios, free = _columns(file.parameters)
    _refuse_twice([file.parameters[i] for i in free])
    spread = np.array(ratios)[:, None] * (np.array(columns)[:, None] == np.arange(len(free)))
    model, constants, kmax, quanta = None, None, None, _quanta_names(file)
    named = _named_constants(file)
    if named is not None:
        constants, matrix = named
        names, kmax = tuple(constants.values), file.options[0].knmax if constants.kind == "asymmetric" else None
    else:
        from rotor.formats.spcat.fits.fit_states import FileLevels
        from rotor.formats.spcat.hamiltonian.coded_file import line_names

        matrix, names = np.eye(len(file.parameters)), line_names(file)
        model = partial(FileLevels.from_labels, file)
    values = np.array([p.value for p in file.parameters])
    parameters = Parameters(
        names=_distinct([file.parameters[i] for i in free]),
        start=values[list(free)],
        prior=np.array([_prior(file.parameters[i]) for i in free]),
        constant_names=names,
        # columns below 0 are held at their values
        base=matrix @ np.where(np.array(columns) < 0, values, 0.0),
        matrix=matrix @ spread,
    )
    assigned, notes = _assigned(lines, quanta, file.header, source)
    if not free:
        raise ValueError(
            "no parameter is free: every a-priori error is below 1e-30; give one that is to be fitted 1e36"
        )
    count, needed = abs(file.header.nline), sum(_prior(file.parameters[i]) == np.inf for i in free)
    if count < min(needed, len(lines)):
        raise ValueError(
            f"NLINE = {file.header.nline}: fewer lines count than the {needed} parameters that are free; the .lin file has {len(lines)}"
        )
    options = FitOptions(
        reject_above=file.header.errtst if file.header.errtst > 0 else _NO_ERRTST,
        # a count, whatever its sign
        most_iterations=max(abs(file.header.nitr), 1),
        kmax=kmax,
        leave_out_missing=True,
    )
    notes += _notes(file, options, model is None, assigned) + ([] if model is None else _notes_on_codes(file))
    return SpfitInput(file, assigned, constants, parameters, options, columns, ratios, tuple(notes), model)


def _notes_on_codes(file: ParameterFile) -> list[str]:
    """Notes on parameters that act on no level, and on free ones that a fit does not move from 0."""
    from rotor.formats.spcat.fits.fit_states import groups_for_fit, stay_at_zero
    from rotor.formats.spcat.hamiltonian.coded_file import coded_file
    from rotor.formats.spcat.hamiltonian.labels import UNDIAGONALIZED_NOTE

    stay = stay_at_zero(file)
    at_zero = f"{', '.join(stay)}: at 0 they change no level to first order, and stay there; give other starts"
    below = any(group.diag < 0 and not group.is_diagonal for group in groups_for_fit(file))
    return coded_file(file).left_out + ([at_zero] if stay else []) + ([UNDIAGONALIZED_NOTE] if below else [])


def _refuse_options(header: Header) -> None:
    """Raise ValueError for options of line 2 that are not supported."""
    if not 0 <= header.nxpar <= header.npar:
        raise ValueError(
            f"NXPAR = {header.nxpar}: so many parameters at the end of the list are left out for lines with F below 0; from 0 to "
            f"NPAR = {header.npar}"
        )
    if not header.cal > 0:
        raise ValueError(f"CAL = {header.cal:g}: the factor of wavenumbers is above 0")


def _refuse_twice(free: Sequence[Parameter]) -> None:
    """Raise ValueError for two free parameters with equal code and no a-priori error, which lines cannot distinguish."""
    codes = [p.code for p in free if _prior(p) == np.inf]
    twice = next((code for code in codes if codes.count(code) > 1), None)
    if twice is not None:
        raise ValueError(
            f"parameter {twice} stands twice and both are free; leave one out, hold it, or tie it (-{twice})"
        )


def _columns(parameters: Sequence[Parameter]) -> tuple[tuple[int, ...], tuple[float, ...], list[int]]:
    """Columns and ratios of `SpfitInput`, and the places of free parameters."""
    columns, ratios, free = list[int](), list[float](), list[int]()
    for i, parameter in enumerate(parameters):
        if not parameter.constrained:
            leader = parameter
            free += [] if is_held(parameter) else [i]
        elif not i:
            raise parameter.refusal(NO_LEADER)
        elif not leader.value:
            raise parameter.refusal(f"no ratio to {leader.code}, which is 0")
        columns.append(-1 if is_held(leader) else len(free) - 1)
        ratios.append(parameter.value / leader.value if parameter.constrained else 1.0)
    return tuple(columns), tuple(ratios), free


def _prior(parameter: Parameter) -> float:
    """A-priori error of a parameter."""
    error = parameter.error if parameter.error else np.inf
    return error if error < FREE_ABOVE else np.inf


def _distinct(parameters: Sequence[Parameter]) -> tuple[str, ...]:
    """Distinct labels: repeated ones with their code, and with a number if the code is repeated too."""
    labels = [p.label or str(p.code) for p in parameters]
    names = [f"{x} ({p.code})" if labels.count(x) > 1 else x for x, p in zip(labels, parameters, strict=True)]
    return tuple(
        f"{name}, {1 + names[:i].count(name)}" if names.count(name) > 1 else name for i, name in enumerate(names)
    )


def _assigned(lines: LineList, names: Sequence[str], header: Header, source: str) -> tuple[Assignments, list[str]]:
    """Lines up to NLINE as assignments, wavenumbers divided by CAL, with the blends of the file."""
    lines = with_defaults(lines, names)
    notes = [default_note(lines)] if lines.defaulted else []
    blends = lines.blends()
    notes += remark_notes(lines, blends)
    used = np.arange(len(lines)) < abs(header.nline)
    if len(lines) and not used.any():
        raise ValueError(f"NLINE = {header.nline}: no line counts; give as many as the .lin file has, {len(lines)}")
    if not used.all():
        beyond = counted(len(lines) - int(used.sum()), "line behind it does", "lines behind it do")
        notes.append(f"NLINE = {abs(header.nline)}: {beyond} not count")
    widths = _widths(lines, blends, used, header)
    used &= blends >= 0
    upper, lower = lines.states()
    if len(wrong := np.flatnonzero(used & (lines.counts != len(names)))):
        raise LineWidthError(
            f"line {wrong[0] + 1} has {lines.counts[wrong[0]]} quantum numbers for each state; these constants have "
            f"{len(names)} ({', '.join(names)}), as NVIB and SPIND of the .par say"
        )
    wavenumber = lines.error < 0
    scale = np.where(wavenumber, header.cal, 1.0)  # SPFIT multiplies what it calculates in cm⁻¹ by CAL
    frequency, error = lines.frequency_mhz / scale, lines.error_mhz / scale
    k = len(names)
    listed = assignments(
        names, upper[used][:, :k], lower[used][:, :k], frequency[used], error[used],
        weight=lines.weight[used], blend=blends[used], wavenumber=wavenumber[used], source=source,
        widths_mhz=widths,
    )  # fmt: skip
    return with_excluded_lines(listed, lines), notes


def _widths(lines: LineList, blends: Ints, used: np.ndarray, header: Header) -> dict[int, float]:
    """Widths of blends: the error of the line of equal frequency that follows them."""
    widths = {}
    for i in np.flatnonzero(used & (blends < 0)).tolist():
        scale = header.cal if lines.error[i] < 0 else 1.0
        widths[int(blends[:i][blends[:i] >= 0][-1])] = float(lines.error_mhz[i] / scale)
    return widths


def _notes(file: ParameterFile, options: FitOptions, plain: bool, lines: Assignments) -> list[str]:
    """Notes on deviations from SPFIT."""
    notes = npar_notes(file)
    below = [p.label or str(p.code) for p in file.parameters if not p.constrained and (p.error or 0.0) < 0]
    if below:
        notes.append(f"a-priori errors below 0: {', '.join(below)} are held, as SPFIT does")
    if not file.header.errtst > 0:
        notes.append(f"ERRTST = {file.header.errtst:g}: {_NO_ERRTST:g} is taken, as SPFIT does")
    if file.header.thresh:
        notes.append("THRESH, the first damping, is chosen by the search itself; the result does not depend on it")
    unresolved = (
        int(((lines.upper[:, -1] < 0) | ((lines.lower[:, -1] < 0) & ~lines.from_zero)).sum())
        if lines.names[-1:] == ("f",)
        else 0
    )
    if unresolved or file.header.nxpar:
        notes.append(
            f"{unresolved} lines with F below 0: the last {file.header.nxpar} parameters (NXPAR) do not count for them"
        )
    # the first quantum number is N
    highest = int(max(lines.upper[:, 0].max(initial=0), lines.lower[:, 0].max(initial=0)))
    if options.kmax is not None and options.kmax < highest:
        notes.append(f"KNMAX = {options.kmax} is below the highest J, {highest}: the basis is cut there, as SPFIT does")
    if plain and options.kmax is not None and file.options[0].diag not in (0, 3):
        notes.append(f"DIAG = {file.options[0].diag}: levels are labelled by the order of energy in each Wang block")
    return notes


def error_factor(fit: Fit, header: Header) -> float:
    """SPFIT's factor of parameter errors: FRAC, or for negative FRAC -FRAC times √(χ²/degrees of freedom), where the root is at least 1."""
    if header.frac >= 0:
        return header.frac
    return float(-header.frac * np.sqrt(fit.residuals @ fit.residuals / max(fit.degrees_of_freedom, 1)))


def fitted_file(fit_input: SpfitInput, fit: Fit, *, variances: bool) -> ParameterFile:
    """The .par file after the fit (with a-priori errors), or the .var file (with estimated errors and V of C = D V Vᵀ D).

    In the .var file parameters that the lines do not determine are held.
    """
    errors = fit.errors * error_factor(fit, fit_input.file.header)
    fitted = []
    for parameter, column, ratio in zip(fit_input.file.parameters, fit_input.columns, fit_input.ratios, strict=True):
        value = parameter.value if column < 0 else float(fit.values[column]) * ratio
        error = parameter.error
        if variances and column >= 0:
            error = float(errors[column]) * abs(ratio) if np.isfinite(fit.errors[column]) else FIXED
        fitted.append(replace(parameter, value=value, error=error))
    leaders = [c for p, c in zip(fit_input.file.parameters, fit_input.columns, strict=True) if not p.constrained]
    rest = correlation_text(np.nan_to_num(fit.statistics.correlations), leaders) if variances else ""
    header = replace(fit_input.file.header, npar=len(fitted))
    return replace(fit_input.file, header=header, parameters=tuple(fitted), rest=rest)


def correlation_text(correlations: Floats, columns: Sequence[int]) -> str:
    """Text of the correlations (n, n) at the end of a .var file: C = V Vᵀ, V upper triangular, column by column, eight numbers in a line.

    columns: for each parameter without a minus sign its place among those of the fit, -1 if held (no correlations). SPCAT reads this number
    of rows, and ignores the correlations if there are fewer. The sign of a column of V does not affect C."""
    places = np.array(columns)
    free = np.flatnonzero(places >= 0)
    whole = np.eye(len(places))
    whole[np.ix_(free, free)] = correlations[np.ix_(places[free], places[free])]
    np.fill_diagonal(whole, 1.0)
    factor = _lower_factor(whole[::-1, ::-1])[::-1, ::-1]
    values = [factor[i, j] for j in range(len(factor)) for i in range(j + 1)]
    rows = [values[i : i + 8] for i in range(0, len(values), 8)]
    return "".join("".join(f"{value:10.7f}" for value in row) + "\n" for row in rows)


def _lower_factor(correlations: Floats) -> Floats:
    """L with L Lᵀ = C; negative round-off is set to zero."""
    lift = 0.0
    for _ in range(20):
        try:
            return np.asarray(np.linalg.cholesky(correlations + lift * np.eye(len(correlations))))
        except np.linalg.LinAlgError:
            # a correlation matrix printed in few digits may fail to be positive by round-off: its diagonal is lifted
            lift = max(10 * lift, 1e-15)
    raise ValueError("the correlation matrix is not positive; some combination of the parameters is not determined")
