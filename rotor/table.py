"""Tables of equally long columns: the base of lines, levels, spectra and motions."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from rotor.frozen import dataclass

EXTRA = 'python -m pip install "molrotor[tables]"'
_SHOWN = 6  # rows in the text of a table: half from the start, half from the end


def counted(count: int, singular: str, plural: str = "") -> str:
    """A number with its noun. plural: of the noun if it is not the singular with an s.

    >>> counted(1, "line"), counted(0, "line"), counted(2, "frequency", "frequencies"), counted(1, "line is", "lines are")
    ('1 line', '0 lines', '2 frequencies', '1 line is')
    """
    return f"{count} {singular if count == 1 else plural or singular + 's'}"


def with_article(noun: str) -> str:
    """A noun behind its indefinite article.

    >>> with_article("asymmetric top"), with_article("prolate top")
    ('an asymmetric top', 'a prolate top')
    """
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"


class Table(ABC):
    """An object with columns of equal length, by their names with unit.

    >>> class Squares(Table):
    ...     columns = {"n": [1, 2, 3], "square": [1, 4, 9]}
    >>> Squares()
    Squares, 3 rows
    n  square
    1       1
    2       4
    3       9
    """

    @property
    @abstractmethod
    def columns(self) -> Mapping[str, NDArray[Any]]:
        """The columns by their names with unit."""

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))

    @property
    def provenance(self) -> dict[str, Any]:
        """Origin of the table, as numbers, texts, and lists and dictionaries of them."""
        return {"rows": len(self)}

    def to_pandas(self) -> Any:
        """All columns as a pandas DataFrame.

        Raises ImportError, with the command that installs pandas, if it is missing.
        """
        return _frame("pandas", self.columns)

    def to_polars(self) -> Any:
        """All columns as a polars DataFrame.

        Raises ImportError, with the command that installs polars, if it is missing.
        """
        return _frame("polars", self.columns)

    def _title(self) -> str:
        """One line that describes the table."""
        return f"{type(self).__name__}, {counted(len(self), 'row')}"

    def _texts(self, rows: NDArray[np.int64]) -> dict[str, list[str]]:
        """The given rows as text, by the headings of the columns to show."""
        return {name: [_text(column[row]) for row in rows.tolist()] for name, column in self.columns.items()}

    def __repr__(self) -> str:
        """The title, and the first and last rows."""
        heads, lines = self._shown()
        widths = [max(map(len, column)) for column in zip(heads, *lines, strict=True)]
        rows = ["  ".join(t.rjust(w) for t, w in zip(line, widths, strict=True)) for line in (heads, *lines)]
        return "\n".join([self._title(), *(rows if lines else [])])

    def _repr_html_(self) -> str:
        """The title and the rows as HTML, for notebooks."""
        import html

        heads, lines = self._shown()
        rows = ["".join(f"<td>{html.escape(text)}</td>" for text in line) for line in lines]
        head = "".join(f"<th>{html.escape(name)}</th>" for name in heads)
        body = "".join(f"<tr>{row}</tr>" for row in rows)
        return f"<p>{html.escape(self._title())}</p><table><tr>{head}</tr>{body}</table>"

    def _shown(self) -> tuple[list[str], list[list[str]]]:
        """Headings and rows of text; dots stand for omitted rows."""
        count = len(self)
        short = count <= _SHOWN
        rows = np.arange(count) if short else np.r_[0 : _SHOWN // 2, count - _SHOWN // 2 : count]
        texts = self._texts(rows)
        lines = [list(line) for line in zip(*texts.values(), strict=True)]
        if not short:
            lines.insert(_SHOWN // 2, ["..."] * len(texts))
        return list(texts), lines


@dataclass(frozen=True, eq=False, repr=False)
class ColumnTable(Table):
    """A table made of columns."""

    values: dict[str, NDArray[Any]]

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Columns by name."""
        return self.values


class TextOf:
    """Text of an answer: its class, and the text of the attribute that `shown` names.

    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True, repr=False)
    ... class Answer(TextOf):
    ...     value: float
    ...     shown = "value"
    >>> Answer(2.0)
    Answer: 2.0
    """

    shown: ClassVar[str]

    def __repr__(self) -> str:
        return f"{type(self).__name__}: {getattr(self, self.shown)!r}"

    def _repr_html_(self) -> str:
        """The text as HTML with the line of the error budget, for notebooks."""
        import html

        value = getattr(self, self.shown)
        inner = value._repr_html_() if hasattr(value, "_repr_html_") else f"<pre>{html.escape(repr(value))}</pre>"
        return f"<p>{html.escape(type(self).__name__)}</p>{inner}{errors_html(self)}"


def errors_html(answer: Any) -> str:
    """The line of an answer's error budget as a paragraph; empty without a budget."""
    import html

    errors = getattr(answer, "errors", None)
    return "" if errors is None else f"<p>{html.escape(errors.line())}</p>"


def _text(value: Any) -> str:
    """A number with six digits, or with four decimals if it is large.

    >>> _text(115271.936), _text(1.23456789e-7), _text(12)
    ('115271.9360', '1.23457e-07', '12')
    """
    if not isinstance(value, float | np.floating):
        return str(value)
    number = float(value)
    return f"{number:.4f}" if 1e3 <= abs(number) < 1e12 else f"{number:.6g}"


def _frame(library: str, columns: Mapping[str, NDArray[Any]]) -> Any:
    from importlib import import_module

    try:
        return import_module(library).DataFrame(dict(columns))
    except ModuleNotFoundError as error:
        if error.name != library:
            raise
        raise ImportError(f"{library} is not installed: {EXTRA}", name=library) from None
