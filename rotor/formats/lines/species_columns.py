"""Columns of a .csv of lines of a molecule with internal rotation, as users name them.

`species` and `vt` of both states may stand in one column; without `vt` all lines are of v_t = 0; J may stand for N beside a column of
F; species of one top may be A1, A2, E1, E2 or the numbers of a column `sigma`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rotor.quantum.labels.quanta import SPECIES_NUMBERS

SYMBOLS = {"A1": 0, "A2": 0, "E1": 1, "E2": 1, "E+": 1, "E-": 1, "-1": 1}  # of one top, beside A, E, 0 and 1
WORDS = {"sigma": "species", "symmetry": "species", "sym": "species", "v_t": "vt"}


def with_species(
    columns: Sequence[str], rows: Sequence[Mapping[str, str]], names: Sequence[str]
) -> tuple[list[str], list[dict[str, str]], list[str]]:
    """Columns and rows of a molecule with internal rotation, named by its quantum numbers, and a note if v_t is not stated."""
    sided = WORDS | ({"j": "n"} if names[0] == "n" and not {"n_upper", "n_lower"} & set(columns) else {})
    renamed = {}
    for column in columns:
        name, _, side = column.rpartition("_")
        both = side not in ("upper", "lower")
        renamed[column] = WORDS.get(column, column) if both else f"{sided.get(name, name)}_{side}"
    table = [{renamed.get(name, name): text for name, text in row.items()} for row in rows]
    columns = list(renamed.values())
    for name in ("species", "vt"):
        if name in columns:
            columns = [column for column in columns if column != name] + [f"{name}_upper", f"{name}_lower"]
            for row in table:
                row[f"{name}_upper"] = row[f"{name}_lower"] = row.pop(name)
    if any(column.startswith("vt_") for column in columns):
        return columns, table, []
    states = {"vt_upper": "0", "vt_lower": "0"}
    return (
        [*columns, *states],
        [row | states for row in table],
        ["no column vt_upper, vt_lower: all lines are of v_t = 0"],
    )


def species_number(path: object, line: int, name: str, text: str) -> int:
    """The number of a species."""
    numbers = SPECIES_NUMBERS | SYMBOLS | {str(number): number for number in SPECIES_NUMBERS.values()}
    if text not in numbers:
        raise ValueError(
            f"{path}, line {line} of the table: {name} reads {text!r}; expected A or E (A1, A2, E1, E2; sigma 0, 1, -1), "
            "of two tops AA, AE, EA, EE or EE*, of three AAA, AAE ... EE*E*"
        )
    return numbers[text]
