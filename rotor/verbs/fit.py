"""`fit`: constants from measured lines, from SPFIT's files or from a line list and starting constants."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.frozen import dataclass
from rotor.reports.screen import Part, Table, record_table
from rotor.reports.top_facts import error_facts
from rotor.requests.field import NUMERICS, OUTPUT, declared
from rotor.requests.fill import NamedError
from rotor.requests.lists import NameList
from rotor.requests.readers import Flag, Rule, Text, Whole
from rotor.table import ColumnTable
from rotor.verbs.common.outputs import Output, Report, picture, tables, write_text
from rotor.verbs.common.verb import ErrorsShown, Extra, Verb, Work
from rotor.verbs.measurements.measured_lines import FitInput, MeasuredLines, build

if TYPE_CHECKING:
    from rotor.fitting.choice.choose import Suggestion, Trial
    from rotor.fitting.result import Fit
    from rotor.formats.fits.fit_request import FitAnswer, FitRequest

EXAMPLES = """\
  rotor fit case.par --out fitted
  rotor fit lines.csv --start constants.toml --free A,B,C,DeltaJ --out fitted
  rotor fit c060503.cat.gz --constants "B=6081 D=0.001 H=0 MHz" --free B,D,H
  rotor fit lines.csv --start states.toml --free "A,B,C,E[1],A[1],B[1],C[1],G_c[0,1],chi_aa(14N)" --out fitted
  rotor fit lines.lin --start water --free A,B,C --try DJ,DJK,DK
  rotor fit lines.csv --start constants.toml --free A,B,C,DeltaK,deltaJ --prior DeltaK=0.02 --tie "deltaK=0.5*deltaJ" --plot rest.png"""
MOST_SAMPLES = 100_000  # bootstrap samples; each is a fit
FORMS = {".txt": "text", ".md": "markdown", ".tex": "latex"}
CONSTANTS = ("toml", "par", "var")  # outputs that hold the fitted constants


@dataclass(frozen=True)
class FitShown(ErrorsShown):
    """Analyses beside the fit, and display options."""

    try_constants: tuple[str, ...] | None = declared(
        None, NameList(), "Test the fit with each of these constants added or removed", option="--try", common=True
    )
    choose: tuple[str, ...] | None = declared(
        None, NameList(), "Build the model from these constants, one at a time", common=True
    )
    all_orders: bool = declared(
        False, Flag(), "With --choose: constants of all orders compete from the first step", rule=Rule(("choose",))
    )
    suggest: str | None = declared(
        None, Text(metavar="NAME"), "Unmeasured lines that would best determine this constant", common=True
    )
    bootstrap: int = declared(
        0, Whole(0, MOST_SAMPLES), "Also errors from N bootstrap samples of the lines", panel=NUMERICS
    )
    seed: int = declared(0, Whole(0), "Seed of the bootstrap", panel=NUMERICS)
    table_errors: str = declared(
        "stated", Text(("stated", "scatter"), "NAME"), "Errors in the table: from the stated errors of the lines, or from their scatter",
        panel=OUTPUT,
    )  # fmt: skip


def parameter_records(answer: FitAnswer) -> ColumnTable:
    """The free parameters of a fit, by the keys of the JSON."""
    fit = answer.fit
    numbers = {
        "value": fit.values,
        "error": fit.errors,
        "scaled_error": fit.scaled_errors,
        "start": fit.parameters.start,
    }
    return ColumnTable({"name": np.array(fit.parameters.names), **numbers})


def answer(request: FitRequest, work: Work) -> FitAnswer:
    """The fit and the analyses beside it; iterations are shown on a terminal."""
    from rotor.formats.fits.fit_request import answer_fit
    from rotor.formats.lines.assigned_lin import lin_notes

    further: FitShown = work.shown
    if further.choose is not None and "save_scene" in work.files:
        raise ValueError(
            "choose: a scene holds no choice of constants; choose first, then save the fit of those constants"
        )
    if further.choose is not None:
        from rotor.formats.fits.fit_further import chosen_fit

        fit_answer = chosen_fit(request, further.choose, not further.all_orders)
    else:
        fit_answer = answer_fit(request, _show_iteration if work.progress and sys.stderr.isatty() else None)
    if further.try_constants is not None or further.suggest is not None or further.bootstrap:
        from rotor.formats.fits.fit_further import with_further  # with all that lists of lines need

        fit_answer = with_further(fit_answer, further.try_constants, further.suggest, further.bootstrap, further.seed)
    if any(path.suffix.lower() == ".lin" for path in work.files.get("save_lines", ())):
        for text in lin_notes(fit_answer.fit.marked_lines):
            work.note(text)
    return fit_answer


def _show_iteration(iteration: Any) -> None:
    taken = "" if iteration.taken else " refused"
    print(
        f"iteration {iteration.number}: weighted rms {iteration.rms_before:.6g} -> {iteration.rms_after:.6g}{taken}",
        file=sys.stderr,
    )


def check(request: FitRequest, outputs: Mapping[str, tuple[Path, ...]], shown: FitShown) -> None:
    """Refuse to overwrite the lines beside a .par file."""
    lines = Path(request.files.source).with_suffix(".lin").resolve()
    for name, paths in outputs.items():
        if lines.exists() and any(path.resolve() == lines for path in paths):
            raise NamedError(f"{{outputs.{name}}}: {paths[0]} is an input; give another name")


def withheld(answer: FitAnswer, names: Sequence[str]) -> dict[str, str]:
    """Reasons why files of constants are not written: the fit failed, or the format cannot hold them.

    The best point of an interrupted fit is written.
    """
    from rotor.formats.fits.fit_request import fitted_par

    fit = answer.fit
    if not fit.converged and fit.minimum.status != "interrupted":
        return dict.fromkeys((name for name in CONSTANTS if name in names), "not converged")
    reasons = {}
    if fit.constants is None and "toml" in names:
        reasons["toml"] = "spins or several states; the .par and .var hold everything"
    for name in (name for name in ("par", "var") if name in names):
        try:
            fitted_par(answer, variances=name == "var")
        except ValueError as error:
            reasons[name] = str(error)
    return reasons


def failure(answer: FitAnswer) -> str:
    """Reason why a fit is not a result; empty if it is."""
    fit = answer.fit
    if not fit.converged:
        more = "; --iterations allows more" if fit.minimum.status == "too many iterations" else ""
        return f"not converged: {fit.reason}{more}"
    return f"interrupted: {answer.interrupted}; the fit itself is complete" if answer.interrupted else ""


def write_table(answer: FitAnswer, path: Path, report: Report) -> None:
    """Write the table for a publication."""
    from rotor.formats.fits.fit_request import fit_table

    write_text(path, fit_table(answer, FORMS[path.suffix.lower()], scaled=report.shown.table_errors == "scatter"))


def write_lines(answer: FitAnswer, path: Path, report: Report) -> None:
    """Write the assigned lines, merged."""
    from rotor.formats.lines.assigned_lines import write_assigned_lines

    write_assigned_lines(answer.fit.marked_lines, path)


def write_report(answer: FitAnswer, path: Path, report: Report) -> None:
    """Write the full report."""
    from rotor.formats.fits.fit_request import fit_report

    write_text(path, fit_report(answer))


def write_constants(answer: FitAnswer, path: Path, report: Report) -> None:
    """Write the constants in the format of the suffix: a molecule file, or the files of SPFIT and SPCAT."""
    from rotor.formats.fits.fit_request import write_fitted_par, write_fitted_toml

    if path.suffix.lower() == ".toml":
        write_fitted_toml(answer, path)
    else:
        write_fitted_par(answer, path, variances=path.suffix.lower() == ".var")


def content(answer: FitAnswer, shown: FitShown) -> dict[str, Any]:
    """Constants, correlations, lines and analyses, by the keys of docs/verbs."""
    fit, constants = answer.fit, answer.fit.constants
    return {
        **{name: getattr(constants, name, None) for name in ("kind", "reduction", "representation")},
        "constants_mhz": None if constants is None else dict(constants.values),
        "uncertainties_mhz": None if constants is None else dict(constants.uncertainties),
        "bootstrap_errors": list(answer.spread) or None,
        "correlations": fit.statistics.correlations,
        "chosen": [_trial_record(trial) for trial in answer.steps],
        "trials": [_trial_record(trial) for trial in answer.trials],
        "suggestions": [vars(suggestion) for suggestion in answer.suggestions],
        "lines": _line_records(fit),
    }


def _trial_record(trial: Trial) -> dict[str, Any]:
    """A trial by the keys of docs/verbs."""
    return {
        "name": trial.name,
        "added": trial.added,
        "f": trial.f_ratio,
        "chance": trial.chance,
        "aicc": trial.aicc,
        "aicc_before": trial.aicc_before,
        "cross_validated_rms": trial.cross_validated,
        "weighted_rms": trial.fit.weighted_rms,
        "better": trial.better,
    }


def _line_records(fit: Fit) -> list[dict[str, Any]]:
    from rotor.fitting.reports.report import dfbetas

    lines = fit.lines
    leverage = dict(zip(fit.groups.tolist(), fit.statistics.leverages.tolist(), strict=False))
    shifts = dfbetas(fit)
    dfbetas_of_line = {} if shifts is None else dict(zip(fit.groups.tolist(), shifts, strict=True))
    difference = fit.difference_mhz
    return [
        {
            "upper": lines.upper[i],
            "lower": lines.lower[i],
            "frequency_mhz": lines.frequency_mhz[i],
            "error_mhz": fit.line_errors_mhz[i],
            "calculated_mhz": fit.calculated_mhz[i],
            "difference_mhz": difference[i],
            "calculated_error_mhz": fit.calculated_errors_mhz[i],
            "blend": lines.blend[i],
            "used": bool(fit.used[i]),
            "leverage": leverage.get(i),
            "dfbetas": dfbetas_of_line.get(i),
        }
        for i in range(len(lines))
    ]


def show(answer: FitAnswer, report: Report) -> Iterable[Part | None]:
    """Parameters with errors, statistics and analyses."""
    from rotor.fitting.reports.report import far_off, statistics_text, status_text

    fit = answer.fit
    yield f"{answer.request.title}: {status_text(fit)}"
    yield _parameter_table(fit, answer.spread)
    yield "\n".join(statistics_text(fit))
    yield _advice(fit)
    poor_rms = answer.request.options.poor_rms
    yield _trial_table("chosen, in this order", answer.steps, poor_rms)
    yield _trial_table("tried", answer.trials, poor_rms)
    yield _suggestion_table(fit, answer.suggestions)
    close = [] if far_off(fit) else [("lines", "none deviates by more than 3 errors")]
    yield [*close, *error_facts(report.content.get("errors"))]


def _advice(fit: Fit) -> list[tuple[str, str]] | None:
    """What may help a fit that failed with most lines far off, not because of a single one: distortion constants that are not free."""
    from rotor.fitting.reports.report import mostly_off, outlier, quartics_not_free

    names = "" if fit.converged or not mostly_off(fit) or outlier(fit) else ",".join(quartics_not_free(fit))
    if not names:
        return None
    text = (
        f"most lines are off: constants may be missing (--choose {names} adds those that the lines need, "
        f"--try {names} tests each alone), or the start or the assignments are wrong"
    )
    return [("advice", text)]


def _parameter_table(fit: Fit, spread: Sequence[float]) -> Table:
    from rotor.fitting.reports.publication import value_text
    from rotor.fitting.reports.report import error_text, parameter_units, scatter_text

    values, errors, scaled = (numbers.tolist() for numbers in (fit.values, fit.errors, fit.scaled_errors))

    def value(row: int) -> str:
        known = errors[row] < float("inf")
        return value_text(values[row], errors[row]) if known else f"{values[row]!r} (not determined)"

    columns = {
        "parameter": lambda row: fit.parameters.names[row],
        f"value ({parameter_units(fit)})": value,
        "error": lambda row: error_text(errors[row], ".3g"),
        "from scatter": lambda row: scatter_text(scaled[row], ".3g"),
        **({"bootstrap": lambda row: f"{spread[row]:.3g}"} if spread else {}),
    }
    return record_table("", columns, range(len(values)), {"parameter"})


def _trial_table(title: str, trials: Sequence[Trial], poor_rms: float) -> Table:
    columns = {
        "constant": "{0.name}",
        "step": lambda trial: "added" if trial.added else "left out",
        "F": "{0.f_ratio:.3g}",
        "by chance": "{0.chance:.2g}",
        "AICc": "{0.aicc:.1f}",
        "from": "{0.aicc_before:.1f}",
        "left-one-out rms": "{0.cross_validated:.4g}",
        "weighted rms": "{0.fit.weighted_rms:.4g}",
        "better": lambda trial: "yes" if trial.better else f"no: {', '.join(_reasons(trial, poor_rms))}",
    }
    return record_table(title, columns, trials, {"constant", "step", "better"})


def _reasons(trial: Trial, poor_rms: float) -> tuple[str, ...]:
    """Why a trial is not better: its fit failed, or the columns that do not favour it."""
    fit = trial.fit
    if fit.converged:
        return trial.objections
    poor = fit.minimum.converged and max(fit.weighted_rms, fit.minimum.rms) > poor_rms
    return (f"rms above {poor_rms:g}" if poor else "not converged", *trial.objections)


def _suggestion_table(fit: Fit, suggestions: Sequence[Suggestion]) -> Table:
    label = fit.lines.label_text
    columns = {
        "upper - lower": lambda suggestion: f"{label(suggestion.upper)} - {label(suggestion.lower)}",
        "frequency (MHz)": "{0.frequency_mhz:.4f}",
        "error (MHz)": "{0.error_mhz:.4f}",
        "error of the constant, after/before": "{0.error_ratio:.4f}",
    }
    return record_table("lines that would help most", columns, suggestions, {"upper - lower"})


VERB = Verb(
    name="fit",
    about="Constants from measured lines, with errors, correlations and undetermined parameters; exit code 1 unless converged.",
    examples=EXAMPLES,
    small_blocks=True,
    request=FitInput,
    answer=answer,
    table=lambda answer: answer.parameters,
    results=lambda answer: {
        "lines_used": answer.fit.used.sum(), "weighted_rms": answer.fit.weighted_rms, "rms_mhz": answer.fit.rms_mhz(),
    },
    rows="parameters",
    records=parameter_records,
    show=show,
    outputs=(
        *tables("the fitted parameters", "fit"),
        Output("report", (".fit",), "Write the full report", write_report, "out.fit"),
        Output("toml", (".toml",), "Write a molecule file with the constants, errors and correlations", write_constants, "out.toml"),
        Output("par", (".par",), "Write the parameters for SPFIT", write_constants, "out.par"),
        Output("var", (".var",), "Write the parameters with errors and correlations, for SPCAT", write_constants, "out.var"),
        Output("table", (".txt", ".md", ".tex"), "Write a table for a publication", write_table, "table.tex"),
        Output("save_lines", (".lin", ".csv"), "Write the assigned lines, merged", write_lines, "all.lin"),
        picture("Draw the residuals against frequency, J and K", "rest.png"),
    ),
    subject=MeasuredLines(),
    shown=FitShown,
    content=content,
    notes=lambda answer: (*answer.request.notes, *answer.fit.notes),
    drawn=None,
    numerics="rotor.formats.fits.fit_numerics:FIT",
    accuracy="of the frequencies of the lines, or of the constants (% of their standard errors)",
    sound=False,
    build=build,
    check=check,
    withheld=withheld,
    failure=failure,
    extras=(
        Extra("--out", "STEM", "Write STEM.fit (report), .toml, .par and .var", panel=OUTPUT, common=True,
              files=lambda stem: {"report": f"{stem}.fit", **{name: f"{stem}.{name}" for name in CONSTANTS}}),
    ),
    start={"lines.source": "lines.csv", "molecule": "water", "parameters.free": ["A", "B", "C"], "outputs.csv": "fit.csv",
           "outputs.report": "out.fit"},
)  # fmt: skip
