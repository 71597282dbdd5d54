"""Numbers as tables print them: name=value(uncertainty in the last digits) unit, read and written without loss.

Decimal arithmetic throughout: a number written in any unit reads back as the same floating-point number.
"""

from __future__ import annotations

import math
import re
from decimal import Decimal, localcontext

from rotor.units import parse_quantity

_ITEM = re.compile(
    r"""(?P<name>[^\W\d]\w*) \s*=\s*
        (?P<number>[+-]?(?:\d+\.?\d*|\.\d+)) (?:\((?P<early>\d+)\))?
        (?:[eEdD](?P<power>[+-]?\d+))? (?:\((?P<late>\d+)\))?
        (?:(?P<gap>\s*)(?P<unit>[^\s,;=()]+)(?!\s*=|[^\s,;]))?""",
    re.VERBOSE,
)
_PRECISION = 1100  # decimal places: enough for the sum of any two floats


def parse_named(text: str) -> tuple[dict[str, float], dict[str, float]]:
    """Values and uncertainties in MHz, by name, from text such as "B=9.2(1)GHz D=3.8kHz" or "A=5 B=4 C=3 GHz".

    An item may have a unit; a unit at the end, after a space, serves all items without one; without any unit, numbers are MHz.
    Raises ValueError for unreadable items, a repeated name, or a unit attached to the last item while others have none,
    which is ambiguous.

    >>> parse_named("B=9.2(1)GHz D=3.8kHz")
    ({'B': 9200.0, 'D': 0.0038}, {'B': 100.0})
    """
    items = _items(text)
    shared = items[-1]["unit"] if items[-1]["gap"] else None
    unitless = [item["name"] for item in items if not item["unit"]]
    if unitless and items[-1]["unit"] and not shared:
        raise ValueError(
            f"{text!r}: {items[-1]['unit']} belongs to {items[-1]['name']} only; put a space before it to apply it to "
            f"{', '.join(unitless)} too, or give each item a unit"
        )

    values: dict[str, float] = {}
    uncertainties: dict[str, float] = {}
    for item in items:
        if item["name"] in values:
            raise ValueError(f"{text!r}: {item['name']} is given twice; leave one out")
        factor = _factor(item["unit"] or shared or "MHz")
        number = Decimal(f"{item['number']}e{item['power'] or 0}")
        values[item["name"]] = _product(number, factor)
        if digits := item["early"] or item["late"]:
            error = Decimal((0, tuple(map(int, digits)), int(number.as_tuple().exponent)))
            uncertainties[item["name"]] = _product(error, factor)
    return values, uncertainties


def mixed_units(text: str) -> str:
    """Which constants have which unit, for a text with units at some constants before the last; "" for other texts.

    >>> mixed_units("A=9 GHz B=3 C=2")
    'GHz is the unit of A alone, and B, C are in MHz: only a unit at the end applies to the constants without one'
    >>> mixed_units("A=9 B=3 C=2 GHz DeltaJ=1 kHz")
    'GHz is the unit of C alone, and A, B are in kHz: only a unit at the end applies to the constants without one'
    >>> mixed_units("A=9 B=3 C=2 GHz")
    ''
    """
    items = _items(text)
    last = items[-1]["unit"] or "MHz"
    without = [item["name"] for item in items if not item["unit"]]
    others = {item["name"]: item["unit"] for item in items if item["unit"] not in (None, last)}
    if not others or not without:
        return ""
    alone = ", ".join(
        f"{unit} is the unit of {', '.join(name for name in others if others[name] == unit)} alone"
        for unit in dict.fromkeys(others.values())
    )
    verb = "is" if len(without) == 1 else "are"
    return f"{alone}, and {', '.join(without)} {verb} in {last}: only a unit at the end applies to the constants without one"


def _items(text: str) -> list[re.Match[str]]:
    """The items name=number(digits)unit of a text; anything else but spaces, commas and semicolons is an error."""
    text = text.replace("−", "-")
    items, rest, end = [], [], 0
    for item in _ITEM.finditer(text):
        items.append(item)
        rest.append(text[end : item.start()])
        end = item.end()
    rest.append(text[end:])

    strange = next((piece.strip(" \t\r\n,;") for piece in rest if piece.strip(" \t\r\n,;")), None)
    if strange or not items:
        what = f"cannot read {strange!r}" if strange else "no constant in it"
        raise ValueError(
            f"{text!r}: {what}; write name=number, with the uncertainty in the last digits and a unit if expected, "
            "such as 'A=9.2(1) B=3 C=2.5 GHz'"
        )
    return items


def _factor(unit: str) -> Decimal:
    """MHz per unit, as an exact decimal number."""
    try:
        return Decimal(repr(parse_quantity(f"1 {unit}", "MHz")))
    except ValueError as error:
        raise ValueError(str(error).removeprefix(f"{f'1 {unit}'!r}: ")) from None


def _product(number: Decimal, factor: Decimal) -> float:
    with localcontext(prec=_PRECISION):
        return float(number * factor)


def write_number(value: float, spread: float | None, unit: str) -> str:
    """A frequency in MHz written in `unit` as 12.345(67), with the fewest digits that read back as the same floats.

    >>> write_number(835840.288, 0.012, "GHz"), write_number(-8.96e-11, None, "MHz")
    ('835.840288(12)', '-8.96e-11')
    """
    factor = _factor(unit)
    with localcontext(prec=_PRECISION):
        number, error = Decimal(repr(value)) / factor, Decimal(repr(spread or 0.0)) / factor
        step = Decimal(1).scaleb(min(number.adjusted(), -1) if value else -1)
        while not (_reads_back(number, step, factor, value) and _reads_back(error, step, factor, spread or 0.0)):
            step = step.scaleb(-1)

        number = number.quantize(step)
        bracket = "" if spread is None else f"({int(error / step + Decimal('0.5'))})"
        if value and number.adjusted() < -5:
            power = number.adjusted()
            return f"{number.scaleb(-power):f}{bracket}e{power:03d}"
        return f"{number:f}{bracket}"


def _reads_back(number: Decimal, step: Decimal, factor: Decimal, expected: float) -> bool:
    return float(number.quantize(step) * factor) == expected


def known_digits(value: float, error: float | None, digits: int = 12) -> str:
    """Number rounded to two uncertain digits of its error; with `digits` digits if no error is estimated.

    >>> known_digits(6011.70626348, 72.0), known_digits(6011.70626348, 0.6), known_digits(6011.70626348, None)
    ('6012', '6011.71', '6011.70626348')
    """
    if not error:
        return f"{value:.{digits}g}"
    decimals = 1 - math.floor(math.log10(error))
    return f"{round(value, decimals):.{max(decimals, 0)}f}"
