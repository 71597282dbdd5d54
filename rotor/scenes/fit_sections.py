"""The tables of a scene of the kind fit: lines, parameters, numerics and outputs. See `rotor.scenes.sections`."""

from __future__ import annotations

from typing import Annotated

from msgspec import field

from rotor.scenes.sections import Quantity
from rotor.verbs.tables import Section, said


class FitLines(Section, frozen=True):
    """The measured lines."""

    source: Annotated[str, said("assigned lines (.lin, .csv, .cat), counted from the scene's folder; or case.par")]
    lin: Annotated[str | None, said("lines of case.par, where they are not case.lin", "case.lin")] = None
    merge: Annotated[str | None, said("more lines of the same kind", "more.csv")] = None


class FitParameters(Section, frozen=True):
    """What is free; a .par file says so itself."""

    free: Annotated[
        list[str] | None, said("constants to fit; by default those that have an error", ["A", "B", "C", "DeltaJ"])
    ] = None
    ties: Annotated[list[str], said("constants that follow a free one", ["deltaK = 0.5*deltaJ"])] = field(
        default_factory=list
    )
    priors: Annotated[dict[str, Quantity], said("a-priori standard errors (MHz)", {"DeltaK": "20 kHz"})] = field(
        default_factory=dict
    )


class FitNumerics(Section, frozen=True):
    """Knobs of the fit; what is left out is chosen, or as a .par file has it."""

    reject_above: Annotated[float | None, said("lines more errors off than this do not count", 5.0)] = None
    loss: Annotated[str, said("squares, or huber or cauchy: lines far off weigh less")] = "squares"
    default_error: Annotated[Quantity | None, said("of lines whose file gives 0 (MHz)", "10 kHz")] = None
    poor_rms: Annotated[float, said("weighted rms above which the fit has failed")] = 10.0
    iterations: Annotated[int | None, said("at most", 100)] = None


class FitOutputs(Section, frozen=True):
    """Files to write; the constants only of a fit that has converged."""

    csv: Annotated[str | None, said("the fitted parameters", "fit.csv")] = None
    parquet: Annotated[str | None, said("the fitted parameters", "fit.parquet")] = None
    json: Annotated[str | None, said("the fitted parameters", "fit.json")] = None
    report: Annotated[str | None, said("the whole report", "out.fit")] = None
    toml: Annotated[str | None, said("molecule file with the constants, errors and correlations", "out.toml")] = None
    par: Annotated[str | None, said("parameters of SPFIT", "out.par")] = None
    var: Annotated[str | None, said("the same with errors and correlations, for SPCAT", "out.var")] = None
    table: Annotated[str | None, said("for a publication (.txt, .md, .tex)", "table.tex")] = None
    save_lines: Annotated[str | None, said("the assigned lines (.lin, .csv)", "all.lin")] = None
    plot: Annotated[str | None, said("residuals (.png, .pdf, .svg)", "rest.png")] = None
