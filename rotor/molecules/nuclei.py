"""Isotopes: mass, natural abundance, spin and quadrupole moment of all nuclei, from data/isotopes.csv.

Masses are those of isotopes (AME2020), not averages over the natural mixture. An element without a mass number means its most
abundant isotope, or the longest-lived one of elements that do not occur in nature.
"""

import difflib
import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rotor.frozen import dataclass

_ISOTOPE_SYMBOLS = {"D": ("H", 2), "T": ("H", 3)}
DUMMIES = ("X", "Xx", "Du", "Bq", "Gh")  # of Z-matrices, ghost functions and fixed points
_MASS_FIRST = re.compile(r"(\d+)-?([A-Za-z]{1,2})")
_MASS_LAST = re.compile(r"([A-Za-z]{1,2})-?(\d+)")


@dataclass(frozen=True)
class Isotope:
    """Tabulated properties of a nucleus.

    symbol : of the element; `"H"` for deuterium too (`label` distinguishes them)
    element_number, mass_number : protons, nucleons
    mass_u : mass of the neutral atom in u (AME2020)
    abundance : fraction of the natural element, 0 to 1
    half_life_s : infinite for a stable nucleus
    spin : in units of h/2π
    g_factor : magnetic moment over spin and nuclear magneton; None if unknown
    quadrupole_barn : spectroscopic electric quadrupole moment, 1 barn = 1e-28 m²; None if unknown
    """

    symbol: str
    element_number: int
    mass_number: int
    mass_u: float
    abundance: float
    half_life_s: float
    spin: float
    g_factor: float | None
    quadrupole_barn: float | None

    @property
    def label(self) -> str:
        """Mass number and symbol, such as `"13C"`."""
        return f"{self.mass_number}{self.symbol}"


def data_folder() -> Path:
    """The folder of data files: `rotor/data` in an installed package, `data` beside `rotor` in the source tree."""
    package = Path(__file__).resolve().parents[1]
    for folder in (package / "data", package.parent / "data"):
        if (folder / "isotopes.csv").is_file():
            return folder
    raise FileNotFoundError(f"isotopes.csv is neither in {package / 'data'} nor in {package.parent / 'data'}")


@cache
def _lines() -> dict[str, list[str]]:
    """The lines of the table by symbol; numbers are parsed on demand."""
    text = (data_folder() / "isotopes.csv").read_text(encoding="utf-8")
    by_symbol: dict[str, list[str]] = {}
    for line in [line for line in text.splitlines() if not line.startswith("#")][1:]:
        by_symbol.setdefault(line.partition(",")[0], []).append(line)
    return by_symbol


@cache
def _isotopes(element: str) -> dict[int, Isotope]:
    """All isotopes of an element by mass number."""
    isotopes = {}
    for line in _lines()[element]:
        symbol, number, mass_number, *numbers, g_factor, quadrupole = line.split(",")
        mass_u, abundance, half_life, spin = map(float, numbers)
        isotopes[int(mass_number)] = Isotope(
            symbol=symbol,
            element_number=int(number),
            mass_number=int(mass_number),
            mass_u=mass_u,
            abundance=abundance,
            half_life_s=half_life,
            spin=spin,
            g_factor=float(g_factor) if g_factor else None,
            quadrupole_barn=float(quadrupole) if quadrupole else None,
        )
    return isotopes


def isotope(symbol: str, mass_number: int | None = None) -> Isotope:
    """The isotope of this name; without a mass number the most abundant isotope of the element.

    For an element that does not occur in nature, the isotope with the longest half-life.

    Parameters
    ----------
    symbol : str
        `"H"`, `"2H"`, `"D"`, `"T"`, `"13C"`, `"C13"`, `"C-13"`; case of the letters counts.
    mass_number : int, optional
        Alternative to a mass number in `symbol`.

    Returns
    -------
    Isotope

    Raises
    ------
    ValueError
        A name or mass number outside the table (near matches are named); two different mass numbers.

    Examples
    --------
    >>> isotope("Cl").mass_number
    35
    >>> isotope("D").mass_u, isotope("2H").spin
    (2.014101777844, 1.0)
    """
    element, number_in_symbol = _split(symbol)
    if number_in_symbol is not None and mass_number not in (None, number_in_symbol):
        raise ValueError(f"isotope {symbol!r} with mass number {mass_number}: the two differ; give one of them")
    expected = number_in_symbol if number_in_symbol is not None else mass_number
    isotopes = _isotopes(element)
    if expected is None:
        return max(isotopes.values(), key=lambda candidate: (candidate.abundance, candidate.half_life_s))
    if expected not in isotopes:
        near = sorted(isotopes, key=lambda number: (abs(number - expected), number))[:3]
        names = ", ".join(f"{number}{element}" for number in sorted(near))
        raise ValueError(f"isotope {expected}{element} is not in data/isotopes.csv; near it are {names}")
    return isotopes[expected]


def _split(name: str) -> tuple[str, int | None]:
    """Element and mass number of `"13C"`, `"C13"`, `"D"` or `"C"`; checks the element."""
    name = name.strip()
    if name in _ISOTOPE_SYMBOLS:
        return _ISOTOPE_SYMBOLS[name]
    if match := _MASS_FIRST.fullmatch(name):
        element, number = match[2], int(match[1])
    elif match := _MASS_LAST.fullmatch(name):
        element, number = match[1], int(match[2])
    else:
        element, number = name, None
    if element.capitalize() in DUMMIES:
        raise ValueError(f"{name!r} is a dummy atom, without a nucleus: remove it")
    if element not in _lines():
        raise ValueError(f"{name!r} is not an element or isotope{_near(element)}; write 'C', '13C' or 'D'")
    return element, number


def _near(element: str) -> str:
    """A phrase with the elements most similar to a wrong symbol; may be empty."""
    symbols = list(_lines())
    near = [symbol for symbol in symbols if symbol.lower() == element.lower()]
    near += [symbol for symbol in difflib.get_close_matches(element, symbols, n=3) if symbol not in near]
    return f" (near it: {', '.join(near)})" if near else ""


def element_symbol(number: int) -> str:
    """The symbol of element `number`.

    >>> element_symbol(6)
    'C'
    """
    if number == 0:
        raise ValueError("an atom of number 0, 'X', is a dummy atom, without a nucleus: remove it")
    for symbol, lines in _lines().items():
        if lines[0].split(",", 2)[1] == str(number):
            return symbol
    raise ValueError(f"{number} is not the atomic number of an element in data/isotopes.csv; hydrogen is 1, carbon 6")


def natural_isotopes(symbol: str) -> tuple[Isotope, ...]:
    """The natural isotopes of an element, most abundant first; empty for technetium.

    >>> [nucleus.label for nucleus in natural_isotopes("O")]
    ['16O', '18O', '17O']
    """
    element, _ = _split(symbol)
    natural = [nuclide for nuclide in _isotopes(element).values() if nuclide.abundance > 0]
    return tuple(sorted(natural, key=lambda nuclide: -nuclide.abundance))


def isotope_by_mass(symbol: str, mass_u: float, within_u: float = 0.01) -> Isotope:
    """The isotope of an element with this mass in u; ValueError if none is within `within_u`.

    >>> isotope_by_mass("Cl", 36.966).label
    '37Cl'
    """
    element, _ = _split(symbol)
    nearest = min(_isotopes(element).values(), key=lambda nuclide: abs(nuclide.mass_u - mass_u))
    if not abs(nearest.mass_u - mass_u) <= within_u:
        raise ValueError(
            f"a mass of {mass_u:g} u is not that of an isotope of {element}; the nearest is {nearest.label} with "
            f"{nearest.mass_u:.6f} u, and the mass must be within {within_u:g} u of it"
        )
    return nearest


def masses(symbols: Sequence[str], mass_numbers: Sequence[int | None] = ()) -> NDArray[np.float64]:
    """Masses (n,) in u of named nuclei; without mass numbers, of the most abundant isotopes.

    >>> masses(["O", "H", "D"])
    array([15.99491462,  1.00782503,  2.01410178])
    """
    if len(mass_numbers) not in (0, len(symbols)):
        raise ValueError(f"{len(symbols)} symbols but {len(mass_numbers)} mass numbers; give one each, or none")
    numbers = mass_numbers or [None] * len(symbols)
    return np.array([isotope(s, a).mass_u for s, a in zip(symbols, numbers, strict=True)], dtype=np.float64)
