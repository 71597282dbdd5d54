"""The sources of error of a result, as `--errors` prints them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rotor.reports.screen import Part
from rotor.requests.budget import ErrorBudget, ErrorTerm

KINDS = {
    "rounding": "bound", "truncation": "bound", "model": "size, within a factor of 3", "data": "one standard deviation",
    "statistics": "one standard deviation",
}  # fmt: skip


def error_parts(content: Mapping[str, Any]) -> list[Part]:
    """The table of errors of an answer; empty if its content has no budget."""
    return [f"errors of {content['errors']['of']}", error_rows(content["errors"])] if "errors" in content else []


def error_rows(content: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Rows (name, text) of the five error sources and their total, from the JSON of a budget."""
    budget = ErrorBudget.from_json(content)
    rows = [(name, _text(term, budget.unit, KINDS[name])) for name, term in budget.terms.items()]
    total = budget.total
    return [*rows, ("total", "no: a term is not estimated" if total is None else f"{total:.2g} {budget.unit}".rstrip())]


def _text(term: ErrorTerm, unit: str, kind: str) -> str:
    if term.value is None:
        return term.text(unit)
    if not term.value:
        return f"{'exact' if kind == 'bound' else 'none'} ({term.source})"
    remedy = f"; {term.remedy} would lower it" if term.remedy else ""
    return f"{term.value:.2g} {unit}".rstrip() + f", {kind}: {term.source}{remedy}"
