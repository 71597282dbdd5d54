"""The record of a fit in JSON, and its tables on a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rotor.cli.shared.fit_extras import Extras
from rotor.cli.shared.output import (
    Table,
)

if TYPE_CHECKING:
    from rotor.fitting.choose import Suggestion, Trial
    from rotor.fitting.fit import Fit
    from rotor.fitting.top_constants import ConstantSet
    from rotor.formats.fit_request import FitAnswer


_AFTER = ("undetermined", "changed_states", "notes")  # facts that come behind the parameters


def record(
    answer: FitAnswer,
    command_line: str,
    steps: Sequence[Trial],
    extras: Extras,
) -> dict[str, Any]:
    """Everything about a fit, by the keys of docs/command_line.md."""
    import rotor

    fit, facts = answer.fit, answer.facts()
    return {
        "rotor_version": rotor.__version__,
        "command": command_line,
        **{name: value for name, value in facts.items() if name not in _AFTER},
        **_constants_record(fit.constants),
        "parameters": [
            {"name": n, "value": v, "error": e, "scaled_error": s, "start": b}
            for n, v, e, s, b in zip(
                fit.parameters.names, fit.values, fit.errors, fit.scaled_errors, fit.parameters.start, strict=True
            )
        ],
        "bootstrap_errors": list(extras.spread) or None,
        "correlations": fit.statistics.correlations,
        **{name: facts[name] for name in _AFTER},
        "chosen": [_trial_record(one) for one in steps],
        "trials": [_trial_record(one) for one in extras.trials],
        "suggestions": [vars(one) for one in extras.suggestions],
        "lines": _line_records(fit),
    }


def _constants_record(constants: ConstantSet | None) -> dict[str, Any]:
    names = ("kind", "reduction", "representation", "constants_mhz", "uncertainties_mhz")
    if constants is None:
        return dict.fromkeys(names)
    values = (
        constants.kind,
        constants.reduction,
        constants.representation,
        dict(constants.values),
        dict(constants.uncertainties),
    )
    return dict(zip(names, values, strict=True))


def _trial_record(trial: Trial) -> dict[str, Any]:
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
    lines = fit.lines
    leverage = dict(zip(fit.groups.tolist(), fit.statistics.leverages.tolist(), strict=False))
    from rotor.fitting.report import dfbetas

    of_frequencies = dfbetas(fit)
    moved = {} if of_frequencies is None else dict(zip(fit.groups.tolist(), of_frequencies, strict=True))
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
            "dfbetas": moved.get(i),
        }
        for i in range(len(lines))
    ]


def parameter_table(fit: Fit, spread: Sequence[float]) -> Table:
    from rotor.fitting.publication import value_text
    from rotor.fitting.report import scatter_text

    columns = ["parameter", "value (MHz)", "error", "from scatter", *(["bootstrap"] if spread else [])]
    rows = []
    for i, name in enumerate(fit.parameters.names):
        error = float(fit.errors[i])
        text = (
            value_text(float(fit.values[i]), error)
            if error < float("inf")
            else f"{float(fit.values[i])!r} (not determined)"
        )
        numbers = [
            f"{error:.3g}",
            scatter_text(float(fit.scaled_errors[i]), ".3g"),
            *([f"{spread[i]:.3g}"] if spread else []),
        ]
        rows.append([name, text, *numbers])
    return Table("", columns, rows, frozenset({"parameter"}))


def trial_table(title: str, trials: Sequence[Trial]) -> Table:
    columns = ["constant", "step", "F", "by chance", "AICc", "from", "left-one-out rms", "weighted rms", "better"]
    rows = [
        [
            one.name, "added" if one.added else "left out", f"{one.f_ratio:.3g}", f"{one.chance:.2g}", f"{one.aicc:.1f}",
            f"{one.aicc_before:.1f}", f"{one.cross_validated:.4g}", f"{one.fit.weighted_rms:.4g}", "yes" if one.better else "no",
        ]
        for one in trials
    ]  # fmt: skip
    return Table(title, columns, rows, frozenset({"constant", "step"}))


def suggestion_table(fit: Fit, suggestions: Sequence[Suggestion]) -> Table:
    columns = ["upper - lower", "frequency (MHz)", "error", "error of the constant, after/before"]
    rows = [
        [
            f"{fit.lines.label_text(one.upper)} - {fit.lines.label_text(one.lower)}",
            f"{one.frequency_mhz:.4f}",
            f"{one.error_mhz:.4f}",
            f"{one.error_ratio:.4f}",
        ]
        for one in suggestions
    ]
    return Table("lines that would help most", columns, rows, frozenset({"upper - lower"}))
