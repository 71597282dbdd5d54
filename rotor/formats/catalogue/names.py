"""Names of species as catalogues write them, and the formulas they mean.

CDMS and JPL write isotopes as `C-13-O` and `H2C-13-S`, states behind a comma (`HC3N, v7=1`). A formula here is in Hill's order with
isotopes in brackets: C-13-O is [13C]O.
"""

from __future__ import annotations

import re
from functools import lru_cache

_ATOM = re.compile(r"([A-Z][a-z]?)(?:-(\d{1,3})(?:-|(?![\d])))?(\d*)")
_MASS_FIRST = re.compile(r"\[?(\d{1,3})([A-Z][a-z]?)\]?(\d*)")
_STATE = re.compile(r"[,;].*$|\s+v.*$")
_HEAVY = {"D": ("H", "2"), "T": ("H", "3")}


@lru_cache(maxsize=10_000)
def hill_formula(name: str) -> str:
    """The formula of a name; empty if the name is not a formula.

    >>> [hill_formula(name) for name in ("C-13-O", "H2C-13-S,v=0", "CH3OD", "[13C]O", "CO+", "glycol")]
    ['[13C]O', '[13C]H2S', 'CH3[2H]O', '[13C]O', 'CO+', '']
    """
    bare = _STATE.sub("", name.strip())
    charge = "".join(sign for sign in "+-" if bare.endswith(sign))
    counts: dict[tuple[str, str], int] = {}
    rest = bare.rstrip("+-").replace("(", "").replace(")", "")
    rest = re.sub(r"^(?:[a-zA-Z]{1,5}g?'?-|[a-z]+-)(?=[A-Z])", "", rest)
    while rest:
        match = _MASS_FIRST.match(rest)
        mass, symbol, count = match.groups() if match else ("", "", "")
        if match is None:
            if (match := _ATOM.match(rest)) is None:
                return ""
            symbol, mass, count = match.group(1), match.group(2) or "", match.group(3)
        symbol, mass = _HEAVY.get(symbol, (symbol, mass))
        if symbol not in _elements():
            return ""
        counts[symbol, mass] = counts.get((symbol, mass), 0) + int(count or 1)
        rest = rest[match.end() :].lstrip("-")
    organic = any(symbol == "C" for symbol, _ in counts)
    first = {"C": 0, "H": 1} if organic else {}
    order = sorted(counts, key=lambda key: (first.get(key[0], 2), key))
    return "".join(_written(*key, counts[key]) for key in order) + charge


def _written(symbol: str, mass: str, count: int) -> str:
    return (f"[{mass}{symbol}]" if mass else symbol) + (str(count) if count > 1 else "")


@lru_cache(maxsize=1)
def _elements() -> frozenset[str]:
    from rotor.molecules.nuclei import element_symbol

    return frozenset(element_symbol(number) for number in range(1, 93))


def same_species(name: str, word: str) -> bool:
    """Whether a word equals a name, ignoring case, blanks and `v=0`.

    >>> same_species("CO, v=0", "co"), same_species("HC3N, v7=1", "HC3N")
    (True, False)
    """
    return _normal(name) == _normal(word)


def _normal(name: str) -> str:
    return re.sub(r",?v(t|b)?=0$", "", re.sub(r"\s+", "", name).lower())
