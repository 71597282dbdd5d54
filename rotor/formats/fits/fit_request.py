"""Request of a fit, from SPFIT's .par and .lin files or from a list of lines and starting constants.

`rotor fit` and scenes of the kind fit make the same request; this module also writes their results.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.fitting.assignment import Assignments, merged
from rotor.fitting.budgets import constants_budget, predictions_budget
from rotor.fitting.fit import FitOptions, fit_lines
from rotor.fitting.parameters import Parameters, parameters, with_names
from rotor.fitting.reports.publication import publication_table
from rotor.fitting.reports.report import fit_facts, report_text
from rotor.fitting.result import Fit, determined_covariance
from rotor.fitting.search.first_values import beside_zero
from rotor.fitting.top_constants import DIPOLES, ConstantSet, TopConstants
from rotor.formats.lines.assigned_lines import QUANTA, names_field, names_sums, read_assigned_lines
from rotor.quantum.labels.labelled import LevelModel
from rotor.requests.budget import ErrorBudget
from rotor.requests.fill import within
from rotor.statistics.least_squares import Progress
from rotor.table import Table, counted, with_article
from rotor.tops.top import Top
from rotor.version import version

if TYPE_CHECKING:
    from rotor.fitting.choice.choose import Suggestion, Trial
    from rotor.formats.molecules.molecule_file import MoleculeFile
    from rotor.formats.spcat.fits.fit_input import SpfitInput
    from rotor.formats.spcat.text.par import ParameterFile


@dataclass(frozen=True)
class FitFiles:
    """Files of a request: the lines or case.par, the .lin of a case.par, merged lines, and the starting constants.

    Lines that do not come from a file are named by their `source`.
    """

    source: str
    lin: str | None = None
    merge: str | None = None
    start: str | None = None


@dataclass(frozen=True, eq=False)
class FitRequest:
    """Lines, constants and options of a fit.

    lines, constants, parameters, options: as `rotor.fitting.fit.fit_lines` takes them. title: for reports. files: what it was read
    from. spfit: the files of SPFIT, where it was read from them. ties, priors_mhz: as given, of a list of lines. notes: what must be
    known of how it was read.
    """

    lines: Assignments
    constants: ConstantSet | None
    parameters: Parameters
    options: FitOptions
    title: str
    files: FitFiles
    spfit: SpfitInput | None = None
    ties: tuple[str, ...] = ()
    priors_mhz: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def model(self) -> Callable[[Ints], LevelModel] | None:
        """Model of levels for codes with spins or several states; None if `constants` are enough."""
        return self.spfit.model if self.spfit else None

    @property
    def top(self) -> Top | None:
        """The starting constants as a top; None for codes with spins or several states."""
        if isinstance(self.constants, TopConstants):
            return self.constants.top
        return None if self.constants is None else Top.from_constants(self.constants)


@dataclass(frozen=True, eq=False, repr=False)
class FittedParameters(Table):
    """Free parameters (n,) of a fit in MHz: values, standard errors from the stated errors of the lines and from their scatter, start."""

    names: tuple[str, ...]
    value_mhz: Floats
    error_mhz: Floats
    scaled_error_mhz: Floats
    start_mhz: Floats

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """parameter, value_mhz, error_mhz, scaled_error_mhz, start_mhz."""
        numbers = ("value_mhz", "error_mhz", "scaled_error_mhz", "start_mhz")
        return {"parameter": np.array(self.names), **{name: getattr(self, name) for name in numbers}}


@dataclass(frozen=True, eq=False)
class FitAnswer:
    """The result of a request for a fit.

    steps: of a choice of constants. trials, suggestions, spread: what was tried beside the fit, see `rotor.formats.fits.fit_further`;
    interrupted: what of these is not complete.
    """

    request: FitRequest
    fit: Fit
    steps: tuple[Trial, ...] = ()
    trials: tuple[Trial, ...] = ()
    suggestions: tuple[Suggestion, ...] = ()
    spread: tuple[float, ...] = ()
    interrupted: str = ""

    @property
    def parameters(self) -> FittedParameters:
        """The free parameters with their errors."""
        fit = self.fit
        return FittedParameters(fit.parameters.names, fit.values, fit.errors, fit.scaled_errors, fit.parameters.start)

    @property
    def errors(self) -> ErrorBudget:
        """Error budget of the frequencies of the lines, in MHz."""
        return predictions_budget(self.fit)

    @property
    def constants_errors(self) -> ErrorBudget:
        """Error budget of the constants, in standard errors."""
        return constants_budget(self.fit)

    def facts(self) -> dict[str, Any]:
        """Facts about the fit as a whole."""
        facts = fit_facts(self.fit)
        errors = {"errors": self.errors.as_json(), "constants_errors": self.constants_errors.as_json()}
        return {"title": self.request.title, **facts, **errors, "notes": [*self.request.notes, *facts["notes"]]}


def answer_fit(request: FitRequest, progress: Progress | None = None) -> FitAnswer:
    """The fit of a request; `fit.converged` states whether the search ended.

    Raises ValueError as `rotor.fitting.fit.fit_lines` does.
    """
    fit = fit_lines(
        request.lines, request.constants, request.parameters, request.options, model=request.model, progress=progress
    )
    return FitAnswer(request, fit)


def spfit_request(par: str, lin: str | None = None) -> FitRequest:
    """The request of a .par file and its lines; the file states free parameters and starting values. Raises ValueError as `read_fit`."""
    from rotor.formats.spcat.fits.fit_input import read_fit

    inputs = read_fit(par, lin)
    title = inputs.file.title or Path(par).stem
    files = FitFiles(par, lin)
    return FitRequest(
        inputs.lines,
        inputs.constants,
        inputs.parameters,
        inputs.options,
        title,
        files,
        inputs,
        notes=tuple(inputs.notes),
    )


def lines_request(
    lines: str | os.PathLike[str] | Assignments | Sequence[Sequence[float]],
    top: Top,
    free: Sequence[str] | None = None,
    *,
    ties: Sequence[str] = (),
    priors_mhz: Mapping[str, float] | None = None,
    start: str | None = None,
) -> FitRequest:
    """The request of assigned lines and starting constants.

    lines: .lin, .csv, .cat or .cat.gz; or assigned lines; or rows of the numbers of the upper state, of the lower state, frequency and
    error (MHz). top: top with the starting constants. free: constants to fit; by default those with an error. A constant that the top
    does not have starts at 0. ties, priors_mhz: as in `rotor.fitting.parameters.parameters`. start: file of the top, whose other tables
    are copied into a file of the result.
    Raises ValueError for invalid lines or names, and without a constant to fit.
    """
    if isinstance(lines, os.PathLike):
        lines = os.fspath(lines)
    has, priors = constants_for(lines, top, free or ()), dict(priors_mhz or {})
    quanta, halves = (has.quanta, has.halves) if isinstance(has, TopConstants) else (QUANTA[top.kind], frozenset[str]())
    notes: Sequence[str] = ()
    if isinstance(lines, str):
        read, notes = read_assigned_lines(lines, quanta, halves)
    else:
        read = lines if isinstance(lines, Assignments) else Assignments.from_rows(quanta, lines)
    if tuple(read.names) != tuple(quanta):
        raise ValueError(f"lines: labels {', '.join(read.names)}: expected {', '.join(quanta)}, those of the start")
    name = lines if isinstance(lines, str) else read.source
    names = list(has.uncertainties) if free is None else list(free)
    if not names:
        raise ValueError(f"free: name the constants to fit, such as A,B,C,DeltaJ; {_without_errors(start)}")
    with within("free"):
        begin = with_names(has, names)
    for tie in ties:  # a tied constant may be missing from the starting constants
        with within(f"ties {tie!r}"):
            begin = with_names(begin, [tie.partition("=")[0].strip()] if "=" in tie else [])
    fitted = parameters(begin, names, ties=ties, priors_mhz=priors)
    has_prior = np.isfinite(fitted.prior)  # constants with an a-priori value start there
    begin, moved = beside_zero(
        begin, [name for name, is_held in zip(fitted.names, has_prior, strict=True) if not is_held], read
    )
    if moved:
        fitted = parameters(begin, names, ties=ties, priors_mhz=priors)
        said = ", ".join(f"{name} at {value:.3g} {'D' if name in DIPOLES else 'MHz'}" for name, value in moved.items())
        notes = [*notes, f"only the square of these affects the lines, so that they start beside 0: {said}"]
    title = " ".join(top.name.split()) or f"{top.kind} top"
    files = FitFiles(name, start=start)
    return FitRequest(
        read, begin, fitted, FitOptions(), title, files, ties=tuple(ties), priors_mhz=priors, notes=tuple(notes)
    )


def _without_errors(start: str | None) -> str:
    """Why the start does not say which constants are free."""
    if start is None or not start.lower().endswith(".par"):
        return "those of the start have no errors"
    return f"a start gives values alone, and the free parameters of {start} are fitted to its .lin by rotor fit {start}"


def constants_for(lines: Any, top: Top, free: Sequence[str]) -> ConstantSet:
    """The constants of a top for a fit of these lines: with further states, and with spins if the lines have F.

    Raises ValueError for lines or free constants of spins that the top does not have.
    """
    rotation = len(QUANTA[top.kind]) + (top.states is not None) + 2 * (top.internal_rotation is not None)
    sums = names_sums(lines, rotation) if isinstance(lines, str) else "f" in getattr(lines, "names", ())
    hyperfine = sums or any("(" in name for name in free)
    if hyperfine and top.spin_constants is None:
        raise ValueError(
            f"{lines if isinstance(lines, str) else 'lines'}: "
            "lines or free constants of spins, and the constants to start from have none; give them there, such as "
            "[spins.14N] with chi_aa = -4.2" + ("" if top.states else "; a number v of the state needs [states] there")
        )
    in_field = names_field(lines) if isinstance(lines, str) else "field" in getattr(lines, "names", ())
    if not in_field and set(free) & set(DIPOLES):
        raise ValueError("free: a dipole is fitted to lines in a field; the lines have no column field_kv_per_cm")
    dipole = _dipole_for(top, free) if in_field else ()
    further = in_field or top.states is not None or top.internal_rotation is not None
    return TopConstants(top, hyperfine, dipole) if hyperfine or further else top.constants


def _dipole_for(top: Top, free: Sequence[str]) -> tuple[str, ...]:
    """The components of the dipole that act in a field: nonzero and free ones."""
    possible = {"linear": "a", "prolate": "a", "oblate": "c", "asymmetric": "abc", "spherical": ""}[top.kind]
    values = dict(zip(DIPOLES, top.dipole_abc_debye or (0.0, 0.0, 0.0), strict=True))
    names = tuple(name for name in DIPOLES if values[name] or name in free)
    if wrong := [name for name in names if name[-1] not in possible]:
        known = ", ".join(f"mu_{a}" for a in possible) or "none"
        raise ValueError(
            f"{', '.join(wrong)}: lines in a field of {with_article(top.kind)} top are fitted with {known}"
        )
    if not names:
        raise ValueError(
            "lines in a field: the dipole is not known; give it in the file to start from, or free it: mu_a"
        )
    return names


def with_more_lines(request: FitRequest, path: str) -> FitRequest:
    """The request with the lines of another file of the same kind."""
    more, notes = read_assigned_lines(path, request.lines.names, request.lines.halves)
    both, remarks = merged(request.lines, more)
    files = replace(request.files, merge=path)
    return replace(request, lines=both, files=files, notes=(*request.notes, *notes, *remarks))


def fit_report(answer: FitAnswer) -> str:
    """The report of a fit with its input; for SPFIT's files with all parameters."""
    from rotor.formats.spcat.fits.named_fit import parameter_section

    request, read = answer.request, answer.request.files
    files = [Path(file).name for file in (read.source, read.lin, read.merge) if file]
    head = [
        f"rotor {version()}; read: {', '.join(files)}" + (f"; start: {Path(read.start).name}" if read.start else "")
    ]
    loss = request.options.loss
    if loss != "squares":
        head.append(f"robust loss {loss}: lines that are far off weigh less")
    parameter_lines = parameter_section(request.spfit, answer.fit) if request.spfit else ()
    return report_text(answer.fit, request.title, notes=request.notes, head=head, file_lines=parameter_lines)


def fit_table(answer: FitAnswer, form: str, *, scaled: bool = False) -> str:
    """The table of a publication; ValueError as `publication_table`."""
    from rotor.formats.spcat.fits.named_fit import publication_rows

    spfit = answer.request.spfit
    rows = publication_rows(spfit, answer.fit) if spfit and answer.fit.constants is None else ()
    return publication_table(answer.fit, form, scaled=scaled, rows=rows)


def write_fitted_toml(answer: FitAnswer, path: str | os.PathLike[str]) -> None:
    """Write constants with errors and correlations into a copy of the starting file, or into a new one.

    Raises ValueError for SPFIT's codes with spins and several states, which have no named constants.
    """
    from rotor.formats.molecules.molecule_file import read_molecule_file
    from rotor.formats.molecules.molecule_writer import write_molecule_file

    request, fit = answer.request, answer.fit
    lost = "; ".join(combination.text for combination in fit.statistics.undetermined)
    doubt = "" if fit.converged else f"NOT CONVERGED ({fit.reason}): "
    origin = (
        f"{doubt}fitted by rotor to {counted(int(fit.used.sum()), 'line')} of {Path(request.files.source).name}, weighted by their "
        f"errors; weighted rms {fit.weighted_rms:.4g}; errors from the stated errors of the lines"
        + (
            f"; not determined by these lines{' and left at the start' if fit.converged else ''}: {lost}"
            if lost
            else ""
        )
    )
    start = request.files.start or ""
    is_toml = start.lower().endswith(".toml") and Path(start).exists()
    file = read_molecule_file(start) if is_toml else _molecule_file(request, path)
    sources = {**file.sources, "constants": origin}
    named, states, spins, internal = fit.named, file.states, file.spin_constants, file.internal_rotation
    if isinstance(named, TopConstants):
        top = named.top
        states = replace(top.states, source=origin) if top.states is not None else None
        spins = replace(top.spin_constants, source=origin) if named.hyperfine and top.spin_constants else spins
        internal = replace(top.internal_rotation, source=origin) if top.internal_rotation is not None else None
        sources |= {"states": origin} if states is not None else {}
        sources |= {"internal_rotation": origin} if internal is not None else {}
        sources |= {"dipole": origin} if named.dipole_errors else {}
        file = replace(file, dipole_abc_debye=top.dipole_abc_debye) if named.in_field else file
        named = top.constants
    fitted = replace(
        file,
        constants=named,
        covariance=determined_covariance(fit.parameters, fit.statistics),
        states=states,
        spin_constants=spins,
        internal_rotation=internal,
        levels=None,
        serves=None,
        sources=sources,
    )
    write_molecule_file(fitted, path)


def _molecule_file(request: FitRequest, path: str | os.PathLike[str]) -> MoleculeFile:
    """A new molecule file; with states or spins also dipole and weights, which a spectrum needs."""
    from rotor.formats.molecules.molecule_file import MoleculeFile

    name = request.title or Path(path).stem
    if not isinstance(request.constants, TopConstants):
        return MoleculeFile(name)
    top = request.constants.top
    sources = {"dipole": top.dipole_source, "spin_weights": top.weights_source}
    return MoleculeFile(
        name,
        dipole_abc_debye=top.dipole_abc_debye,
        spin_weights=top.spin_weights,
        sources={table: text for table, text in sources.items() if text},
        states=top.states,
        spin_constants=top.spin_constants,
        internal_rotation=top.internal_rotation,
    )


def write_fitted_par(answer: FitAnswer, path: str | os.PathLike[str], *, variances: bool) -> None:
    """Write SPFIT's .par file after the fit, or with variances the .var file. Raises ValueError as `fitted_par` does."""
    from rotor.formats.atomic_write import write_whole
    from rotor.formats.spcat.text.par import format_par

    write_whole(path, format_par(fitted_par(answer, variances=variances)))


def fitted_par(answer: FitAnswer, *, variances: bool) -> ParameterFile:
    """The .par file after the fit, or the .var file; ValueError for parameters that SPFIT does not have."""
    request, fit = answer.request, answer.fit
    if request.spfit is not None:
        from rotor.formats.spcat.fits.fit_input import fitted_file

        return fitted_file(request.spfit, fit, variances=variances)
    from rotor.formats.spcat.fits.named_fit import named_file

    return named_file(fit, request.title, variances=variances)
