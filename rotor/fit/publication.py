"""The table of a publication: value(σ) in a fitting unit, as text, Markdown or LaTeX."""

from __future__ import annotations

import math
import re
from decimal import Decimal

from rotor.fit.fit import Fit

FORMS = ("text", "markdown", "latex")
_UNITS = (("MHz", 1.0), ("kHz", 1e-3), ("Hz", 1e-6), ("mHz", 1e-9), ("μHz", 1e-12), ("nHz", 1e-15), ("pHz", 1e-18))
_SHOWN = {"Delta": "Δ", "delta": "δ", "Phi": "Φ", "phi": "φ", "chi": "χ", "eps": "ε", "gamma": "γ", "lambda": "λ"}
_GREEK = {name: "\\epsilon" if name == "eps" else f"\\{name}" for name in _SHOWN}
_NAME = re.compile(r"(Delta|delta|Phi|phi|[A-Za-z])([JK]*|\d?)")
_WITH_AXES = re.compile(r"(chi|eps|gamma|lambda|[CTDGFWb])_?([\w-]*)")  # of states and spins: chi_bb-cc, G_c_J


def value_text(value: float, error: float | None, digits: int = 2) -> str:
    """A number with its standard error in brackets, in units of the last digit, the error with so many digits.

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
    """A multiple of three to take out of numbers that are too small to print; 0 for others."""
    size = max(abs(value), error)
    return 0 if size >= 1e-4 else 3 * math.floor(math.log10(size) / 3 + 1)


def unit_of(value: float, error: float | None) -> tuple[str, float]:
    """The unit in which a number reads well and its size in MHz: the value, or its error, above 0.1 of it.

    >>> unit_of(0.0013014, 3.7e-9)
    ('kHz', 0.001)
    """
    size = abs(value) or (error or 0.0)
    return next((unit for unit in _UNITS if size >= 0.1 * unit[1]), _UNITS[-1])


def name_text(name: str, form: str) -> str:
    """A constant's name as text (ΔJK), or in LaTeX; spins and states stand behind it.

    >>> name_text("DeltaJK", "latex"), name_text("d1", "latex"), name_text("PhiJ", "text")
    ('$\\\\Delta_{JK}$', '$d_{1}$', 'ΦJ')
    >>> name_text("DeltaJ[1]", "text"), name_text("chi_bb-cc(14N)", "latex"), name_text("G_c[0,1]", "latex")
    ('ΔJ[1]', '$\\\\chi_{bb-cc}$(14N)', '$G_{c}$[0,1]')
    """
    head = re.match(r"[^(\[]*", name)
    assert head is not None  # an empty one matches too
    own = name[head.end() :]  # spins and states, as in chi_aa(14N) or A[1]
    match = _NAME.fullmatch(head[0]) or _WITH_AXES.fullmatch(head[0])
    if not match:
        return f"\\texttt{{{name}}}".replace("_", "\\_") if form == "latex" else name
    letter, below = match[1], match[2]
    if form != "latex":
        between = "_" if "_" in head[0] else ""
        return _SHOWN.get(letter, letter) + between + below + own
    symbol = _GREEK.get(letter, letter) + (f"_{{{below}}}" if below else "")
    return f"${symbol}$" + own.replace("_", "\\_")


def publication_table(fit: Fit, form: str = "text", *, scaled: bool = False, digits: int = 2) -> str:
    """The constants with their standard errors, then what the fit is like.

    Parameters
    ----------
    fit : Fit
    form : "text", "markdown" or "latex"
    scaled : bool
        Errors times √(χ²/degrees of freedom), from the scatter of the lines, instead of those of the stated errors.
    digits : int
        Of the errors.

    Returns
    -------
    str

    Raises
    ------
    ValueError
        For an unknown form.
    """
    if form not in FORMS:
        raise ValueError(f"form {form!r}: one of {', '.join(FORMS)} is needed")
    if scaled and not fit.degrees_of_freedom:
        raise ValueError("scaled: with 0 degrees of freedom there are no errors from the scatter; take the stated ones")
    factor = fit.reduced_chi if scaled else 1.0
    rows = []
    for name, value, error in _numbers(fit):
        free = error is not None
        unit, size = unit_of(value, error)
        text = value_text(value / size, error * factor / size if error else None, digits)
        rows.append((name_text(name, form), unit, text if free else f"{text} (held)"))
    facts = _facts(fit, scaled)
    return {"text": _plain, "markdown": _markdown, "latex": _latex}[form](rows, facts)


def _numbers(fit: Fit) -> list[tuple[str, float, float | None]]:
    """Name, value and standard error (None: held) of the constants, or of SPFIT's parameters where they have no names."""
    if fit.constants is None:
        rows = zip(fit.parameters.names, fit.values.tolist(), fit.errors.tolist(), strict=True)
        return [(name, value, error) for name, value, error in rows]
    errors = fit.constants.uncertainties
    return [(name, value, errors.get(name)) for name, value in fit.constants.values.items()]


def _facts(fit: Fit, scaled: bool) -> list[tuple[str, str]]:
    j = max(int(fit.lines.upper[fit.used, 0].max(initial=0)), int(fit.lines.lower[fit.used, 0].max(initial=0)))
    form = "SPFIT's parameters" if fit.constants is None else fit.constants.kind
    if fit.constants is not None and fit.constants.reduction:
        form = f"{fit.constants.reduction}-reduction, {fit.constants.representation}"
    return [
        ("Hamiltonian", form),
        ("lines", f"{int(fit.used.sum())} of {len(fit.lines)}, {len(fit.groups)} frequencies, J up to {j}"),
        ("rms", f"{fit.rms_mhz():.4g} MHz" if math.isfinite(fit.rms_mhz()) else f"{fit.rms_mhz(True):.4g} cm-1"),
        ("weighted rms", f"{fit.weighted_rms:.4g}"),
        ("errors", "one standard deviation, " + ("scaled by the scatter" if scaled else "from the stated line errors")),
    ]


def _plain(rows: list[tuple[str, str, str]], facts: list[tuple[str, str]]) -> str:
    widths = [max(len(row[i]) for row in rows) for i in range(3)]
    lines = [f"{name:<{widths[0]}}  {unit:<{widths[1]}}  {text:>{widths[2]}}" for name, unit, text in rows]
    return "\n".join([*lines, "", *(f"{name}: {text}" for name, text in facts)]) + "\n"


def _markdown(rows: list[tuple[str, str, str]], facts: list[tuple[str, str]]) -> str:
    lines = ["| constant | unit | value |", "|---|---|---:|", *(f"| {' | '.join(row)} |" for row in rows)]
    return "\n".join([*lines, "", *(f"- {name}: {text}" for name, text in facts)]) + "\n"


def _latex(rows: list[tuple[str, str, str]], facts: list[tuple[str, str]]) -> str:
    def cell(text: str) -> str:
        return text.replace("μ", "$\\mu$").replace("e-", "\\times 10^{-}").replace("%", "\\%")

    lines = ["\\begin{tabular}{llr}", "\\hline", "constant & unit & value \\\\", "\\hline"]
    lines += [f"{name} & {cell(unit)} & {cell(text)} \\\\" for name, unit, text in rows]
    lines += ["\\hline", *(f"\\multicolumn{{3}}{{l}}{{{name}: {cell(text)}}} \\\\" for name, text in facts)]
    return "\n".join([*lines, "\\hline", "\\end{tabular}"]) + "\n"
