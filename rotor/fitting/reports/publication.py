"""Tables for publication: value(σ) in a suitable unit, as text, Markdown or LaTeX."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal

import numpy as np

from rotor.fitting.result import Fit
from rotor.fitting.top_constants import unit_of_constant
from rotor.table import counted

FORMS = ("text", "markdown", "latex")
_UNITS = (("MHz", 1.0), ("kHz", 1e-3), ("Hz", 1e-6), ("mHz", 1e-9), ("μHz", 1e-12), ("nHz", 1e-15), ("pHz", 1e-18))
_SHOWN = {"Delta": "Δ", "delta": "δ", "Phi": "Φ", "phi": "φ", "chi": "χ", "eps": "ε", "gamma": "γ", "lambda": "λ"}
_GREEK = {name: "\\epsilon" if name == "eps" else f"\\{name}" for name in _SHOWN}
_NAME = re.compile(r"(Delta|delta|Phi|phi|[A-Za-z])([JK]*|\d?)")
_ISOTOPE = re.compile(r"(?<=[(,])(\d+)(?=[A-Z])")  # the mass number in (35Cl) or (14N,1H_2)
_WITH_AXES = re.compile(r"(chi|eps|gamma|lambda|[CTDGFWb])_?([\w-]*)")  # of states and spins: chi_bb-cc, G_c_J


def value_text(value: float, error: float | None, digits: int = 2) -> str:
    """A number with its standard error in brackets, in units of the last digit; `digits` significant digits of the error.

    >>> value_text(57635.96804, 0.000034), value_text(-0.256e-12, 0.215e-12), value_text(12.0, None)
    ('57635.968040(34)', '-0.26(22)e-12', '12.0')
    >>> value_text(8200.0, 130.0)
    '8200(130)'
    """
    if error is None or not math.isfinite(error) or error <= 0:
        return repr(value)
    power = _power_of_ten(value, error)
    scaled, spread = Decimal(repr(value)).scaleb(-power), Decimal(repr(error)).scaleb(-power)
    place = spread.adjusted() - digits + 1
    rounded = round(spread.scaleb(-place))
    if rounded >= 10**digits:  # 0.0996 with two digits is 0.10
        place += 1
        rounded = round(spread.scaleb(-place))
    if place > 0:
        text, bracket = f"{round(scaled.scaleb(-place)) * 10**place}", f"({rounded * 10**place})"
    else:
        text, bracket = f"{scaled:.{-place}f}", f"({rounded})"
    return f"{text}{bracket}" + (f"e{power}" if power else "")


def _power_of_ten(value: float, error: float) -> int:
    """Power of ten (a multiple of 3) to factor out of very small numbers; 0 for others."""
    size = max(abs(value), error)
    return 0 if size >= 1e-4 else 3 * math.floor(math.log10(size) / 3 + 1)


def suitable_unit(value: float, error: float | None) -> tuple[str, float]:
    """A suitable unit and its size in MHz: the value is above 0.1 units and its error at most 10 units.

    >>> suitable_unit(0.0013014, 3.7e-9), suitable_unit(0.0, 2e-6)
    (('kHz', 0.001), ('Hz', 1e-06))
    """
    size = max(abs(value), 0.1 * (error or 0.0))  # a constant of 0 takes the unit of its error
    return next((unit for unit in _UNITS if size >= 0.1 * unit[1]), _UNITS[-1])


def name_text(name: str, form: str) -> str:
    """A constant's name as text (ΔJK) or in LaTeX, followed by its spins and states.

    >>> name_text("DeltaJK", "latex"), name_text("d1", "latex"), name_text("PhiJ", "text")
    ('$\\\\Delta_{JK}$', '$d_{1}$', 'ΦJ')
    >>> name_text("DeltaJ[1]", "text"), name_text("chi_bb-cc(14N)", "latex"), name_text("G_c[0,1]", "latex")
    ('ΔJ[1]', '$\\\\chi_{bb-cc}$($^{14}$N)', '$G_{c}$[0,1]')
    """
    head = re.match(r"[^(\[]*", name)
    assert head is not None  # an empty one matches too
    quantum_numbers = name[head.end() :]  # spins and states, as in chi_aa(14N) or A[1]
    match = _NAME.fullmatch(head[0]) or _WITH_AXES.fullmatch(head[0])
    if not match:
        return f"\\texttt{{{_latex_text(name)}}}" if form == "latex" else name
    letter, below = match[1], match[2]
    if form != "latex":
        between = "_" if "_" in head[0] else ""
        return _SHOWN.get(letter, letter) + between + below + quantum_numbers
    symbol = _GREEK.get(letter, letter) + (f"_{{{below}}}" if below else "")
    return f"${symbol}$" + _ISOTOPE.sub(r"$^{\1}$", quantum_numbers.replace("_", "\\_"))


@dataclass(frozen=True)
class Row:
    """A constant of the table: name, value and standard error in MHz, the constant it is tied to, its states.

    error : None if the constant is held, infinite if it is not determined.
    """

    name: str
    value: float
    error: float | None
    follows: str = ""
    states: str = ""


def publication_table(
    fit: Fit, form: str = "text", *, scaled: bool = False, digits: int = 2, rows: Sequence[Row] = ()
) -> str:
    """A table of the constants with their standard errors, followed by the statistics of the fit.

    Parameters
    ----------
    fit : Fit
    form : "text", "markdown" or "latex"
    scaled : bool
        Errors from the scatter of the lines, √(χ²/degrees of freedom) times those from the stated errors.
    digits : int
        Significant digits of the errors.
    rows : sequence of Row, optional
        Rows of the table. Default: the constants of the fit, or its free parameters if they are not named constants.

    Returns
    -------
    str

    Raises
    ------
    ValueError
        For an unknown form, or scaled errors without degrees of freedom.
    """
    if form not in FORMS:
        raise ValueError(f"form {form!r}: one of {', '.join(FORMS)} is needed")
    if scaled and not fit.degrees_of_freedom:
        raise ValueError(
            "scaled: without degrees of freedom there are no errors from the scatter; use the stated errors"
        )
    factor = fit.reduced_chi if scaled else 1.0
    table = rows or _rows(fit)
    cells = [_cells(row, factor, digits, form, any(each.states for each in table)) for row in table]
    heads = ["constant", *(["states"] if any(each.states for each in table) else []), "unit", "value"]
    facts = [*_facts(fit, scaled), *_note_on_states(table)]
    return {"text": _plain, "markdown": _markdown, "latex": _latex}[form](heads, cells, facts)


def _note_on_states(rows: Sequence[Row]) -> list[tuple[str, str]]:
    """A note that constants of all states and of a single state add up, if the table has both."""
    both = {row.name for row in rows if row.states == "all"} & {
        row.name for row in rows if row.states not in ("", "all")
    }
    return [("states", "what stands for all states and what stands for one add up")] if both else []


def _rows(fit: Fit) -> list[Row]:
    """The constants, or SPFIT's parameters where they have no names."""
    if fit.constants is None:
        numbers = zip(fit.parameters.names, fit.values.tolist(), fit.errors.tolist(), strict=True)
        return [Row(name, value, error) for name, value, error in numbers]
    tied, moves = _tied(fit), np.atleast_1d(fit.parameters.matrix.any(axis=1))
    # moved but undetermined: an infinite error
    lost = {name: math.inf for name, moved in zip(fit.parameters.constant_names, moves.tolist(), strict=True) if moved}
    errors = {**lost, **fit.constants.uncertainties}
    return [Row(name, value, errors.get(name), tied.get(name, "")) for name, value in fit.constants.values.items()]


def _tied(fit: Fit) -> dict[str, str]:
    """Each tied constant, with the free constant that it follows."""
    parameters = fit.parameters
    if not set(parameters.names) <= set(parameters.constant_names):
        return {}
    free = [(row != 0).nonzero()[0].tolist() for row in parameters.matrix]
    return {
        name: parameters.names[places[0]]
        for name, places in zip(parameters.constant_names, free, strict=True)
        if places and name not in parameters.names
    }


def _cells(row: Row, factor: float, digits: int, form: str, with_states: bool) -> list[str]:
    error = row.error if row.error and math.isfinite(row.error) else None
    unit, size = unit_of_constant(row.name), 1.0
    if unit == "MHz":
        unit, size = suitable_unit(row.value, error)
    is_determined = row.error is not None and math.isfinite(row.error)
    text = (
        value_text(row.value / size, row.error * factor / size, digits)
        if row.error and is_determined
        else f"{row.value / size:.12g}"
    )
    remark = (
        "held"
        if row.error is None
        else f"follows {name_text(row.follows, form)}"
        if row.follows
        else ""
        if is_determined
        else "not determined"
    )
    if form == "latex":
        unit, text = _latex_text(unit), _latex_number(text)
    name = name_text(row.name, form)
    return [name, *([row.states] if with_states else []), unit, f"{text} ({remark})" if remark else text]


def _facts(fit: Fit, scaled: bool) -> list[tuple[str, str]]:
    # the first quantum number of a label is J or N
    j = max(int(fit.lines.upper[fit.used, 0].max(initial=0)), int(fit.lines.lower[fit.used, 0].max(initial=0)))
    form = "SPFIT's parameters" if fit.constants is None else fit.constants.kind
    if fit.constants is not None and fit.constants.reduction:
        form = f"{fit.constants.reduction}-reduction, {fit.constants.representation}"
    return [
        ("Hamiltonian", form),
        (
            "lines",
            f"{int(fit.used.sum())} of {len(fit.lines)}, {counted(len(fit.groups), 'frequency', 'frequencies')}, J up to {j}",
        ),
        ("rms", f"{fit.rms_mhz():.4g} MHz" if math.isfinite(fit.rms_mhz()) else f"{fit.rms_mhz(True):.4g} cm-1"),
        ("weighted rms", f"{fit.weighted_rms:.4g}"),
        ("errors", "one standard deviation, " + ("scaled by the scatter" if scaled else "from the stated line errors")),
    ]


def _plain(heads: list[str], rows: list[list[str]], facts: list[tuple[str, str]]) -> str:
    widths = [max(len(row[i]) for row in rows) for i in range(len(heads))]
    aligned = ["<"] * (len(heads) - 1) + [">"]
    lines = [
        "  ".join(f"{cell:{side}{width}}" for cell, side, width in zip(row, aligned, widths, strict=True))
        for row in rows
    ]
    return "\n".join([*lines, "", *(f"{name}: {text}" for name, text in facts)]) + "\n"


def _markdown(heads: list[str], rows: list[list[str]], facts: list[tuple[str, str]]) -> str:
    top = [f"| {' | '.join(heads)} |", f"|{'---|' * (len(heads) - 1)}---:|"]
    lines = [*top, *(f"| {' | '.join(row)} |" for row in rows)]
    return "\n".join([*lines, "", *(f"- {name}: {text}" for name, text in facts)]) + "\n"


def _latex(heads: list[str], rows: list[list[str]], facts: list[tuple[str, str]]) -> str:
    lines = [f"\\begin{{tabular}}{{{'l' * (len(heads) - 1)}r}}", "\\hline", f"{' & '.join(heads)} \\\\", "\\hline"]
    lines += [f"{' & '.join(row)} \\\\" for row in rows]
    lines += [
        "\\hline",
        *(f"\\multicolumn{{{len(heads)}}}{{l}}{{{name}: {_latex_text(text)}}} \\\\" for name, text in facts),
    ]
    return "\n".join([*lines, "\\hline", "\\end{tabular}"]) + "\n"


def _latex_number(text: str) -> str:
    """A number in mathematical type, with its sign and power of ten.

    >>> _latex_number("-0.26(22)e-12")
    '$-0.26(22)\\\\times 10^{-12}$'
    """
    number, _, power = text.partition("e")
    return f"${number}\\times 10^{{{power}}}$" if power else f"${number}$"


def _latex_text(text: str) -> str:
    """Plain text with LaTeX's special characters escaped.

    >>> _latex_text("50 % of SPFIT_1, cm-1, μHz")
    '50 \\\\% of SPFIT\\\\_1, cm$^{-1}$, $\\\\mu$Hz'
    """
    for sign in "&%#_":
        text = text.replace(sign, "\\" + sign)
    return text.replace("μ", "$\\mu$").replace("cm-1", "cm$^{-1}$")
