"""`rotor fit`: measured lines back to constants, SPFIT's input or a line list with start constants."""

from __future__ import annotations

import gc
import os
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rotor.checks import require_whole
from rotor.cli.shared import inputs
from rotor.cli.shared.fit_extras import Extras, chosen, extras_of
from rotor.cli.shared.fit_report import parameter_table, record, suggestion_table, trial_table
from rotor.cli.shared.inputs import Input, json_option
from rotor.cli.shared.options import argument, file_option, grouped, option
from rotor.cli.shared.output import (
    ComputationError,
    Files,
    Writer,
    deliver,
    json_text,
    note,
    show_facts,
    show_table,
    write_text,
)
from rotor.cli.shared.save_scene import beside, save_scene, save_scene_option

if TYPE_CHECKING:
    from rotor.fitting.choose import Trial
    from rotor.fitting.fit import Fit, FitOptions
    from rotor.formats.fit_request import FitAnswer, FitRequest
    from rotor.statistics.least_squares import Iteration

EXAMPLES = """\b
Examples:
  rotor fit case.par --out fitted
  rotor fit lines.csv --start constants.toml --free A,B,C,DeltaJ --out fitted
  rotor fit c060503.cat.gz --constants "B=6081 D=0.001 H=0 MHz" --free B,D,H
  rotor fit lines.csv --start states.toml --free "A,B,C,E[1],A[1],B[1],C[1],G_c[0,1],chi_aa(14N)" --out fitted
  rotor fit lines.lin --start water --free A,B,C --try DJ,DJK,DK
  rotor fit lines.csv --start constants.toml --free A,B,C,DeltaK,deltaJ --prior DeltaK=0.02 --tie "deltaK=0.5*deltaJ" --plot rest.png"""

MOST_SAMPLES = 100_000  # of a bootstrap: each is a fit


@dataclass(frozen=True)
class Options:
    """What is read, what is fitted and how, and what is written."""

    source: str = argument(..., help="case.par (with case.lin), or lines: .lin, .csv, .cat.")
    lin: str | None = option(None, metavar="FILE", help="Lines of case.par, where they are not case.lin.")
    start: str | None = option(
        None, metavar="SOURCE", help="Constants to start from: a file (.toml, .var, ...) or a name."
    )
    constants: str | None = option(None, metavar="TEXT", help='Constants to start from: "A=9.2 B=3 C=2.5 GHz" (MHz).')
    spin_constants: str | None = option(
        None, metavar="TEXT", help="Constants of spins to start from, as in 'rotor spectrum'."
    )
    spins: str | None = option(
        None, metavar="LIST", help='Sizes and order of the spins of --spin-constants: "S=1/2 14N".'
    )
    state_constants: str | None = option(
        None, metavar="TEXT", help="Further states to start from, as in 'rotor spectrum'."
    )
    free: str | None = option(
        None,
        metavar="LIST",
        help='Constants to fit: A,B,C,DeltaJ; of states and spins "E[1],B[1],G_c[0,1],chi_aa(14N)"; those of --start that '
        "have an error if left out.",
    )
    tie: list[str] | None = option(
        None, metavar="TEXT", help='A constant that follows a free one: "DeltaK=2.5*DeltaJ", "C=B-300"; repeatable.'
    )
    prior: list[str] | None = option(
        None, metavar="X=ERROR", help="A-priori standard error of a free constant (MHz); repeatable."
    )
    more: str | None = option(None, "--merge", metavar="FILE", help="More lines (.lin, .csv, .cat) of the same kind.")
    reject: float | None = option(
        None, metavar="X", help="Lines more than X errors off do not count; they are reported."
    )
    loss: str = option("squares", metavar="NAME", help="squares, or huber or cauchy: lines far off weigh less.")
    default_error: str | None = option(None, metavar="X", help="Error of lines whose file gives 0 (MHz).")
    poor_rms: float = option(10.0, metavar="X", help="Weighted rms above which the fit has failed.")
    iterations: int | None = option(None, metavar="N", help="Most iterations; 100, or NITR of a .par file.")
    try_: str | None = option(None, "--try", metavar="LIST", help="Try each of these constants more, or less.")
    choose: str | None = option(None, metavar="LIST", help="Build the model up from these constants, one at a time.")
    all_orders: bool = option(
        False, "--all-orders", help="With --choose: constants of all orders compete from the first step on."
    )
    suggest: str | None = option(None, metavar="NAME", help="Which unmeasured line would best fix this constant.")
    bootstrap: int = option(0, metavar="N", help="Errors from N samples of the lines beside the others.")
    seed: int = option(0, metavar="N", help="Of the bootstrap.")
    out: str | None = option(None, metavar="STEM", help="Write STEM.fit (report), .toml, .par and .var.")
    table: str | None = file_option(".txt", ".md", ".tex", help="Table for a publication.")
    save_lines: str | None = file_option(".lin", ".csv", help="The assigned lines, merged.")
    table_errors: str = option(
        "stated", metavar="NAME", help="Errors in --table: from the stated errors of the lines, or from their scatter."
    )
    plot: str | None = file_option(".png", ".pdf", ".svg", help="Residuals against frequency, J and K.")
    json: str | None = json_option()
    save_scene: str | None = save_scene_option()


@grouped()
def command(context: typer.Context, given: Options) -> None:
    """Constants from measured lines, with errors, correlations and what the lines leave open; exit code 1 unless converged."""
    os.environ.setdefault(
        "OPENBLAS_NUM_THREADS", "1"
    )  # before numpy is loaded: on small blocks threads only wait for each other
    gc.set_threshold(100_000)  # what is read and made lives to the end: looking for garbage would take 5 % of a run
    require_whole("--bootstrap", given.bootstrap, 0, MOST_SAMPLES)
    require_whole("--seed", given.seed, 0)
    require_whole("--iterations", given.iterations, 1)
    if given.table_errors not in ("stated", "scatter"):
        raise ValueError(f"--table-errors {given.table_errors}: one of stated, scatter is needed")
    files = _files(given)
    _refuse_unsaved(given)
    request = read_request(given)
    beside_it = str(Path(given.source).with_suffix(".lin"))
    _refuse_overwriting(files, [given.source, given.lin, given.start, given.more, beside_it])
    if given.all_orders and given.choose is None:
        raise ValueError("--all-orders goes with --choose, which names the constants to choose from")
    if given.choose is not None:
        answer, steps = chosen(request, _names("--choose", given.choose), not given.all_orders)
    else:
        answer, steps = _fitted(request), []
    fit = answer.fit
    for text in request.notes:
        note(text)
    if fit.constants is None and "--out .toml" in files.paths:
        del files.paths["--out .toml"]
        note("spins or several states: no .toml is written, the .par and .var have everything")
    tried = None if given.try_ is None else _names("--try", given.try_)
    extras = extras_of(answer, tried, given.suggest, given.bootstrap, given.seed)
    _refuse_constants(files, fit)
    spfit = _spfit_writers(files, answer)
    content = record(answer, context.obj, steps, extras)
    content["files"] = files.names
    if (given.save_lines or "").lower().endswith(".lin"):
        from rotor.formats.assigned_lin import note_of_lin

        for text in note_of_lin(fit.marked_lines):
            note(text)
    writers = _writers(answer, content, scaled=given.table_errors == "scatter") | spfit | _saved(answer, given)
    deliver(files, writers, lambda: json_text(content), lambda: _show(request, fit, steps, extras))
    if not fit.converged:
        more = "; --iterations allows more" if fit.minimum.status == "too many iterations" else ""
        raise ComputationError(f"not converged: {fit.reason}{more}")
    if extras.interrupted:
        raise ComputationError(f"interrupted: {extras.interrupted}; the fit itself is complete")


def _refuse_constants(files: Files, fit: Fit) -> None:
    """Constants of a fit that has failed are not written; the best point of one that was interrupted is."""
    if fit.converged or fit.minimum.status == "interrupted":
        return
    left = [files.paths.pop(name).name for name in ("--out .toml", "--out .par", "--out .var") if name in files.paths]
    if left:
        note(f"not converged: {', '.join(left)} are not written")


def _spfit_writers(files: Files, answer: FitAnswer) -> dict[str, Writer]:
    """The writers of SPFIT's files; a fit that has no parameters there goes into the others alone."""
    from rotor.formats.fit_request import fitted_par
    from rotor.formats.spcat.text.par import write_par

    names = [name for name in ("--out .par", "--out .var") if name in files.paths]
    try:
        made = {name: fitted_par(answer, variances=name == "--out .var") for name in names}
    except ValueError as error:
        left = ", ".join(files.paths.pop(name).name for name in names)
        note(f"{left} are not written: {error}")
        return {}
    return {name: partial(write_par, file) for name, file in made.items()}


def _refuse_unsaved(given: Options) -> None:
    if given.save_scene is not None and given.choose is not None:
        raise ValueError(
            "--save-scene: a scene has no --choose; choose first, then save the fit of those constants with --free"
        )


def _saved(answer: FitAnswer, given: Options) -> dict[str, Writer]:
    """The writer of --save-scene, with files counted from the folder of the scene."""
    if given.save_scene is None:
        return {}
    others = {"--try": given.try_, "--suggest": given.suggest, "--bootstrap": given.bootstrap}
    left = [name for name, value in others.items() if value]
    left += ["--table-errors"] if given.table_errors != "stated" else []
    if left:
        note(f"the scene does not repeat {', '.join(left)}")
    from rotor.formats.fit_request import FitFiles

    folder, stem = Path(given.save_scene).parent, given.out
    read = answer.request.files
    files = FitFiles(
        str(beside(read.source, folder)), *(beside(one, folder) for one in (read.lin, read.merge, read.start))
    )
    molecule = None if answer.request.spfit is not None else _start_of(given)
    outputs: dict[str, Any] = (
        {} if stem is None else {"report": f"{stem}.fit", "par": f"{stem}.par", "var": f"{stem}.var"}
    )
    if stem is not None and answer.fit.constants is not None:
        outputs["toml"] = f"{stem}.toml"
    return save_scene("fit", replace(answer.request, files=files), given, molecule, **outputs)


def _files(given: Options) -> Files:
    files = Files.of(given)
    if given.out is not None:
        for suffix in (".fit", ".toml", ".par", ".var"):
            files.ask(f"--out {suffix}", given.out + suffix, (suffix,))
    return files


def _refuse_overwriting(files: Files, read: Sequence[str | None]) -> None:
    """What was read is not written over."""
    here = {Path(path).resolve() for path in read if path and Path(path).exists()}
    for name, path in files.paths.items():
        if path.resolve() in here:
            raise ValueError(f"{name.split()[0]}: {path} is an input; write the result under another name")


def _names(option: str, text: str) -> list[str]:
    """The names of a list, each once; commas in brackets are part of a name."""
    names = [name.strip() for name in re.split(r",(?![^()\[\]]*[)\]])", text)]
    if not all(names):
        raise ValueError(f"{option}: {text!r}: names parted by commas are needed, such as A,B,C,DeltaJ")
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice:
        raise ValueError(f"{option}: {text!r}: {twice} is named twice; once is enough")
    return names


# What comes in


def read_request(given: Options) -> FitRequest:
    """The fit that the options mean."""
    from rotor.formats.fit_request import with_more_lines

    request = _of_spfit(given) if given.source.lower().endswith(".par") else _of_lines(given)
    if given.more is not None:
        with inputs.named("--merge"):
            request = with_more_lines(request, given.more)
    return replace(request, options=_options(request.options, given))


def _of_spfit(given: Options) -> FitRequest:
    from rotor.formats.fit_request import fit_of_spfit

    others = {
        "--start": given.start, "--constants": given.constants, "--spin-constants": given.spin_constants,
        "--spins": given.spins, "--state-constants": given.state_constants, "--free": given.free, "--tie": given.tie,
        "--prior": given.prior,
    }  # fmt: skip
    unused = [name for name, value in others.items() if value]
    if unused:
        raise ValueError(f"{', '.join(unused)}: a .par file says itself what is free and where the fit starts")
    with inputs.fields_as_options(lin="--lin"):
        return fit_of_spfit(given.source, given.lin)


def _of_lines(given: Options) -> FitRequest:
    from rotor.formats.fit_request import fit_of_lines

    if given.lin is not None:
        raise ValueError("--lin goes with a .par file; give the lines as the source otherwise")
    if (given.start is None) == (given.constants is None):
        raise ValueError("either --start or --constants says where the fit starts; give one of them")
    if given.start is not None and given.start.lower().endswith((".csv", ".lin")):
        raise ValueError(
            f"--start {given.start}: a list of lines has no constants; give a .toml, .var or the name of a molecule"
        )
    top = inputs.read_top(_start_of(given))
    names = None if given.free is None else _names("--free", given.free)
    priors = _priors(given.prior or [])
    with inputs.fields_as_options(free="--free", tie="--tie", priors_mhz="--prior"):
        return fit_of_lines(given.source, top, names, ties=given.tie or [], priors_mhz=priors, start=given.start)


def _start_of(given: Options) -> Input:
    """Where the fit of a line list starts."""
    return Input(
        given.start,
        given.constants,
        spin_constants=given.spin_constants,
        spins=given.spins,
        state_constants=given.state_constants,
    )


def _priors(texts: Sequence[str]) -> dict[str, float]:
    """A-priori errors by name, each named once."""
    found = dict[str, float]()
    for text in texts:
        name, value = _prior(text)
        if name in found:
            raise ValueError(f"--prior {text!r}: {name} has an a-priori error already; give one")
        found[name] = value
    return found


def _prior(text: str) -> tuple[str, float]:
    name, equals, value = (part.strip() for part in text.partition("="))
    if not (name and equals and value):
        raise ValueError(f"--prior {text!r}: name=error is needed, such as DeltaK=0.02")
    return name, inputs.quantity("--prior", value, "MHz")


def _options(options: FitOptions, given: Options) -> FitOptions:
    changes: dict[str, Any] = {"loss": given.loss, "poor_rms": given.poor_rms}
    if given.reject is not None:
        changes["reject_above"] = given.reject
    if given.iterations is not None:
        changes["most_iterations"] = given.iterations
    if given.default_error is not None:
        changes["default_error_mhz"] = inputs.positive("--default-error", given.default_error, "MHz")
    with inputs.fields_as_options(loss="--loss", reject_above="--reject", poor_rms="--poor-rms"):
        return replace(options, **changes)


# What is done


def _fitted(request: FitRequest) -> FitAnswer:
    from rotor.formats.fit_request import answer_fit

    return answer_fit(request, _progress())


def _progress() -> Any:
    """Iterations on standard error, where that is a terminal."""
    if not sys.stderr.isatty():
        return None

    def show(one: Iteration) -> None:
        """One iteration as a line."""
        taken = "" if one.taken else " refused"
        print(
            f"iteration {one.number}: weighted rms {one.rms_before:.6g} -> {one.rms_after:.6g}{taken}", file=sys.stderr
        )

    return show


# What goes out


def _writers(answer: FitAnswer, content: dict[str, Any], *, scaled: bool) -> dict[str, Writer]:
    from rotor.formats.assigned_lines import write_assigned_lines
    from rotor.formats.fit_request import report_of, table_of, write_fitted_toml

    request, fit = answer.request, answer.fit

    def picture(path: Path) -> None:
        """The picture as a file."""
        from rotor.plots.fit import plot_fit

        plot_fit(fit, path, title=request.title, provenance={"command": content["command"]})

    form = {".txt": "text", ".md": "markdown", ".tex": "latex"}
    return {
        "--out .fit": lambda path: write_text(path, report_of(answer)),
        "--out .toml": lambda path: write_fitted_toml(answer, path),
        "--table": lambda path: write_text(path, table_of(answer, form[path.suffix.lower()], scaled=scaled)),
        "--save-lines": lambda path: write_assigned_lines(fit.marked_lines, path),
        "--plot": picture,
    }


def _show(
    request: FitRequest,
    fit: Fit,
    steps: Sequence[Trial],
    extras: Extras,
) -> None:
    from rotor.fitting.report import far_off, statistics_text, status_text

    print(f"{request.title}: {status_text(fit)}")
    show_table(parameter_table(fit, extras.spread))
    print("\n".join(statistics_text(fit)))
    for text in fit.notes:
        note(text)
    for what, some in (("chosen, in this order", steps), ("tried", extras.trials)):
        if some:
            show_table(trial_table(what, some))
    if extras.suggestions:
        show_table(suggestion_table(fit, extras.suggestions))
    if not far_off(fit):
        show_facts([("lines", "none is more than 3 errors off")])
