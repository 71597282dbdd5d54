"""Error budget of a result: five sources of error, each a number in the unit of the result or a reason why it is not estimated.
| term | what it is | how it is stated |
|---|---|---|
| rounding | double precision | a bound |
| truncation | basis, contraction, cut, J max, step, order, interpolation | a bound |
| model | effects that are left out, geometry, vibration | a size, right within a factor of 3 |
| data | uncertainties of constants, dipole, Q | one standard deviation |
| statistics | a finite number of samples | one standard deviation |
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from typing import Any

from rotor.frozen import dataclass

NOT_ESTIMATED = "not estimated"
ROUNDING = 8 * sys.float_info.epsilon  # of an eigenvalue, relative to the largest: a few units in the last place


def two_digits(value: float) -> str:
    """A size as reports print it.

    >>> two_digits(734.2), two_digits(0.0651), two_digits(4.13e-7)
    ('730', '0.065', '4.1e-07')
    """
    return f"{float(f'{value:.2g}'):g}"


def size_text(value: float, unit: str) -> str:
    """An estimated size with its unit: two digits, in GHz or THz from 1000 MHz on.

    >>> size_text(10.0, "MHz"), size_text(995.0, "MHz"), size_text(170432.0, "MHz"), size_text(3.7e7, "MHz"), size_text(1234.0, "K")
    ('10 MHz', '1 GHz', '170 GHz', '37 THz', '1200 K')
    """
    value = float(f"{value:.2g}")
    for larger in ("GHz", "THz"):
        if unit in ("MHz", "GHz") and value >= 1e3:
            value, unit = value / 1e3, larger
    return f"{two_digits(value)} {unit}".rstrip()


@dataclass(frozen=True)
class ErrorTerm:
    """One source of error of a result.

    value: in the unit of the budget; None if not estimated. source: what the value follows from, or why it is not estimated.
    remedy: what would lower the error.
    >>> ErrorTerm(4e-7, "J max 15").text("MHz")
    '4e-07 MHz (J max 15)'
    >>> ErrorTerm(None, "the dipole has no stated uncertainty").text("MHz")
    'not estimated: the dipole has no stated uncertainty'
    """

    value: float | None
    source: str
    remedy: str = ""

    def __post_init__(self) -> None:
        if self.value is not None and not (math.isfinite(self.value) and self.value >= 0):
            raise ValueError(f"an error of {self.value}: expected a finite number of at least 0, or None with a reason")
        if not self.source:
            raise ValueError("an error without its source: expected what it follows from, or why it is not estimated")

    def text(self, unit: str) -> str:
        """Value, unit and source as on the screen."""
        if self.value is None:
            return f"{NOT_ESTIMATED}: {self.source}"
        number = "exact" if self.value == 0 else size_text(self.value, unit)
        return f"{number} ({self.source})"

    def as_json(self, unit: str) -> dict[str, Any]:
        """`value`, `unit` and `from`, or a value of null with `reason`; `remedy` where there is one."""
        origin = {"reason": self.source} if self.value is None else {"from": self.source}
        return {"value": self.value, "unit": unit, **origin} | ({"remedy": self.remedy} if self.remedy else {})


@dataclass(frozen=True)
class ErrorBudget:
    """The errors of a result.

    of: the observable ("frequencies"). unit: unit of the values; empty for pure numbers.

    >>> budget = ErrorBudget(
    ...     "frequencies", "MHz", ErrorTerm(1e-9, "eigenvalues"), ErrorTerm(4e-7, "J max 15"),
    ...     ErrorTerm(0.5, "Doppler width not counted"), ErrorTerm(0.02, "constants"), ErrorTerm(0.0, "nothing is sampled"))
    >>> budget.line()
    'errors of frequencies: left out about 0.5 MHz (Doppler width not counted), data 0.02 MHz (constants), numerical 4e-07 MHz'
    >>> budget.numerical
    4.01e-07
    """

    of: str
    unit: str
    rounding: ErrorTerm
    truncation: ErrorTerm
    model: ErrorTerm
    data: ErrorTerm
    statistics: ErrorTerm

    @property
    def terms(self) -> dict[str, ErrorTerm]:
        """The five terms by name."""
        return {field.name: getattr(self, field.name) for field in fields(self) if field.name not in ("of", "unit")}

    @property
    def numerical(self) -> float | None:
        """Sum of the bounds of rounding and truncation; None if either is not estimated."""
        parts = (self.rounding.value, self.truncation.value)
        return None if None in parts else math.fsum(part for part in parts if part is not None)

    @property
    def total(self) -> float | None:
        """Bounds, plus model size, plus data and statistics added in quadrature; None if any term is not estimated."""
        numerical, model = self.numerical, self.model.value
        spread = (self.data.value, self.statistics.value)
        if numerical is None or model is None or spread[0] is None or spread[1] is None:
            return None
        return numerical + model + math.hypot(spread[0], spread[1])

    def shown(self) -> Iterator[tuple[str, ErrorTerm]]:
        """Terms for the screen, largest first and unestimated ones last; rounding and truncation are joined.

        Left out are terms of 0, and those that the rounding of the result hides.
        """
        larger = max((self.truncation, self.rounding), key=lambda term: -1.0 if term.value is None else term.value)
        missing = next((term for term in (self.truncation, self.rounding) if term.value is None), None)
        numerical = missing or ErrorTerm(self.numerical, larger.source, larger.remedy)
        named = [
            ("numerical", numerical),
            ("left out", self.model),
            ("data", self.data),
            ("statistics", self.statistics),
        ]
        hidden = self.rounding.value or 0.0
        known = [(name, term) for name, term in named if term.value and (term is numerical or term.value > hidden)]
        yield from sorted(known, key=lambda pair: -(pair[1].value or 0.0))
        yield from ((name, term) for name, term in named if term.value is None)

    def __str__(self) -> str:
        return self.line()

    def line(self) -> str:
        """One line of a report: each size with the first clause of its source; --errors has the full sources."""
        texts = dict[str, list[str]]()  # names by text: several terms may be unknown for the same reason
        for name, term in self.shown():
            about = "about " if name == "left out" and term.value else ""
            source = "" if name == "numerical" and term.value is not None else re.split("[;:]", term.source)[0]
            text = f"{about}{replace(term, source=source or 'x').text(self.unit)}".removesuffix(" (x)")
            texts.setdefault(text, []).append(name)
        named = [f"{', '.join(names)} {text}" for text, names in texts.items()]
        return f"errors of {self.of}: " + (", ".join(named) or "none beyond the last digit")

    def shortfall(self, accuracy: float) -> str:
        """Terms that exceed an accuracy (in the unit of the budget), largest first, with remedies; empty if none does.

        >>> exact = ErrorTerm(0.0, "exact")
        >>> geometry = ErrorTerm(300.0, "error of the geometry", "measured constants")
        >>> ErrorBudget("frequencies", "MHz", exact, ErrorTerm(7e-9, "J max 9"), geometry, exact, exact).shortfall(1e-3)
        'left out about 300 MHz is larger (error of the geometry); measured constants would lower it'
        """
        parts = []
        for name, term in self.shown():
            if term.value is None or term.value <= accuracy:
                continue
            size = f"{'about ' if name == 'left out' else ''}{size_text(term.value, self.unit)}"
            remedy = f"; {term.remedy} would lower it" if term.remedy else ""
            parts.append(f"{name} {size} is larger ({term.source}){remedy}")
        return "; ".join(parts)

    def as_json(self) -> dict[str, Any]:
        """The terms by name, with `of` and `unit`."""
        return {
            "of": self.of,
            "unit": self.unit,
            **{name: term.as_json(self.unit) for name, term in self.terms.items()},
        }

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> ErrorBudget:
        """The budget that `as_json` wrote."""
        terms = {
            name: ErrorTerm(term["value"], term.get("from") or term["reason"], term.get("remedy", ""))
            for name, term in content.items()
            if name not in ("of", "unit")
        }
        return cls(of=content["of"], unit=content["unit"], **terms)
