"""Constants of nuclear and electron spins of a top, by name with the spins.

    chi_aa(14N) = -4.22 MHz      quadrupole coupling along a      C_bb(14N), eps_aa(S), T_aa(S,14N), b_F(S,14N), ...

Names are those of `rotor.quantum.effects`: hyperfine, spin_rotation, spin_spin. A spin is named after its isotope (14N; 35Cl_1 and
35Cl_2 for several), which determines its size; for any other name, such as S, the size must be given.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from rotor.frozen import dataclass
from rotor.molecules.nuclei import isotope
from rotor.tops.spins.tensor_elements import plain_elements
from rotor.units import parse_quantity

if TYPE_CHECKING:
    from rotor.molecules.molecule import Molecule

_ITEM = re.compile(
    r"(?P<name>[A-Za-z][\w-]*\([^()]*\)(?:\[\d+\])?)\s*=\s*(?P<number>[-+−]?[\d.]+(?:[eEdD][-+]?\d+)?)(?P<gap>\s*)(?P<unit>[A-Za-z][\w-]*(?![\w(-]))?"
)
_ISOTOPE = re.compile(r"(\d+[A-Z][a-z]?|D|T)(?:_\w+)?")


@dataclass(frozen=True, eq=False)
class SpinConstants:
    """Values in MHz by name, the spins in their order of coupling, and the source of the values.

    twice: twice the size of each spin, by name. uncertainties: in MHz, by name. sources: by spin.
    atoms: number of the nucleus in the geometry, from 1, by spin. totals: name of the total spin, such as "I", to which two
    or three equivalent nuclei are coupled first, by spin. weights_of_others: whether the spin weights of the top are
    those of the nuclei outside the total spin. Raises ValueError for an impossible spin, and for constants of a spin that is
    not listed.
    """

    values: Mapping[str, float]
    twice: Mapping[str, int]
    source: str = ""
    uncertainties: Mapping[str, float] = field(default_factory=dict)
    sources: Mapping[str, str] = field(default_factory=dict)
    atoms: Mapping[str, int] = field(default_factory=dict)
    totals: Mapping[str, str] = field(default_factory=dict)
    weights_of_others: bool = False

    def __post_init__(self) -> None:
        values, errors = plain_elements(self.values, self.uncertainties)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "uncertainties", errors)
        for name in ("values", "twice", "uncertainties", "sources", "atoms", "totals"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))
        for name, twice in self.twice.items():
            if twice < 1:
                raise ValueError(
                    f"spin {name}: expected 1/2, 1, 3/2, ..., found {twice}/2; a nucleus without spin splits nothing"
                )
            if _ISOTOPE.fullmatch(name) and twice != twice_spin(name):
                raise ValueError(
                    f"spin {name} = {spin_text(twice)}: the isotope has {spin_text(twice_spin(name))}; leave its spin out, or give it "
                    "another name"
                )
        _refuse_totals(self.totals, self.twice)
        if self.weights_of_others and not self.totals:
            raise ValueError("spin weights of the other nuclei: expected a total spin of nuclei beside them")
        for name in self.values:
            for spin in spin_names(name):
                if spin not in self.twice:
                    raise ValueError(f"{name}: spin {spin} is not among {', '.join(self.twice) or 'none'}")
            if name.startswith("chi_") and any(self.twice[spin] < 2 for spin in spin_names(name)):
                raise ValueError(f"{name}: a spin of 1/2 has no quadrupole moment; that needs a spin of 1 or more")
        pairs: dict[tuple[str, ...], str] = {}
        for name in self.values:
            first = pairs.setdefault((name.partition("(")[0], name.partition(")")[2], *sorted(spin_names(name))), name)
            if first != name:
                raise ValueError(f"{first} and {name} are one constant of two spins; give it once")
        for name, error in self.uncertainties.items():
            if name not in self.values or not error >= 0:
                raise ValueError(
                    f"uncertainty {error:g} of {name}: expected a number of at least 0, for a constant with a value"
                )

    def __reduce__(self) -> tuple[type[SpinConstants], tuple[Any, ...]]:
        plain = (dict(self.uncertainties), dict(self.sources), dict(self.atoms), dict(self.totals))
        return type(self), (dict(self.values), dict(self.twice), self.source, *plain, self.weights_of_others)

    def of(self, spin: str) -> dict[str, float]:
        """Constants that belong to this spin only, of all states, by name without the spin.

        >>> SpinConstants.parse("chi_aa(14N)=-4.22MHz C_bb(14N)=2kHz T_aa(14N,D)=2kHz").of("14N")
        {'chi_aa': -4.22, 'C_bb': 0.002}
        """
        return {
            name.partition("(")[0]: value
            for name, value in self.values.items()
            if spin_names(name) == (spin,) and "[" not in name
        }

    @classmethod
    def parse(cls, text: str, spins: str | None = None, source: str = "") -> SpinConstants:
        """Constants from a text such as "chi_aa(14N)=-4.22 chi_bb-cc(14N)=1.1 MHz"; spins: "S=1/2 14N=1", for names that are no isotopes.

        An item may have a unit; a unit at the end, after a space, applies to all items without one; without any unit,
        numbers are MHz.

        >>> constants = SpinConstants.parse("chi_aa(14N)=-4.22408 MHz")
        >>> dict(constants.values), dict(constants.twice)
        ({'chi_aa(14N)': -4.22408}, {'14N': 2})
        """
        items = list(_ITEM.finditer(text))
        rest = _ITEM.sub("", text).replace(",", " ").strip()
        if not items or rest:
            raise ValueError(
                f"{text!r}: expected constants such as chi_aa(14N)=-4.22 MHz"
                + (_without_spin(rest) or (f"; {rest!r} is none" if rest and items else ""))
            )
        last, unitless = items[-1], [item["name"] for item in items if not item["unit"]]
        if unitless and last["unit"] and not last["gap"]:
            raise ValueError(
                f"{text!r}: the unit {last['unit']} belongs to {last['name']} only; put a space before it to apply it to "
                f"{', '.join(unitless)} too, or give each constant a unit"
            )
        shared = last["unit"] or "MHz"
        values: dict[str, float] = {}
        for item in items:
            name = re.sub(r"\s+", "", item["name"])
            if name in values:
                raise ValueError(f"{text!r}: {name} is given twice; leave one out")
            values[name] = parse_quantity(f"{item['number']} {item['unit'] or shared}", "MHz")
        return cls.from_values(values, spins, source)

    @classmethod
    def from_values(cls, values_mhz: Mapping[str, float], spins: str | None = None, source: str = "") -> SpinConstants:
        """Constants from values in MHz by name; spins as for `parse`.

        >>> dict(SpinConstants.from_values({"eps_aa(S)": 300.0, "b_F(S,1H)": 40.0}, "S=1/2").twice)
        {'S': 1, '1H': 1}
        """
        listed, totals = parse_coupled(spins or "")
        twice: dict[str, int] = {**listed, **{s: twice_spin(s) for s in _named(values_mhz) if s not in listed}}
        ordered = {name: twice[name] for name in sorted(twice, key=lambda name: name in totals)}
        return cls(values_mhz, ordered, source, totals=totals)


def refuse_other_nuclei(constants: SpinConstants, molecule: Molecule | None) -> None:
    """Raise ValueError if more spins are named after an isotope than the molecule has nuclei of it.

    Not checked without a molecule, and for spins that are not named after isotopes.
    """
    if molecule is None:
        return
    called = [match[1] for match in map(_ISOTOPE.fullmatch, constants.twice) if match]
    named = Counter((nucleus.symbol, nucleus.mass_number) for nucleus in map(isotope, called))
    there = Counter((nucleus.symbol, nucleus.mass_number) for nucleus in molecule.nuclei)
    for (symbol, number), count in named.items():
        if count > there[symbol, number]:
            has = ", ".join(f"{n} of {a}{s}" for (s, a), n in there.items())
            raise ValueError(
                f"{count} {'spin is' if count == 1 else 'spins are'} named after {number}{symbol}, but "
                f"{molecule.formula} has {has}; choose the isotope with --isotope, or give the spin another name and its size"
            )


def _without_spin(text: str) -> str:
    """Remedy for a constant that lacks its spin, for an error message; "" if none lacks it."""
    constant = re.search(r"(?<![\w)])([A-Za-z][\w-]*)\s*=\s*[-+−.\d]", text)
    return (
        f"; {constant[1]} needs its spin or spins in round brackets, {constant[1]}(14N), {constant[1]}(S,14N)"
        if constant
        else ""
    )


def _named(values: Mapping[str, float]) -> list[str]:
    return list(dict.fromkeys(spin for name in values for spin in spin_names(name)))


def spin_names(name: str) -> tuple[str, ...]:
    """Names of the spins of a constant.

    >>> spin_names("T_aa(S,14N)")
    ('S', '14N')
    """
    inside = name.partition("(")[2].partition(")")[0]
    return tuple(part.strip() for part in inside.split(",") if part.strip())


def twice_spin(spin: str) -> int:
    """Twice the spin of the isotope that a spin is named after.

    >>> twice_spin("14N"), twice_spin("35Cl_2"), twice_spin("D")
    (2, 3, 2)
    """
    match = _ISOTOPE.fullmatch(spin)
    if not match:
        raise ValueError(f"spin {spin}: not named after an isotope (14N, 35Cl_1); give its size, such as {spin}=1/2")
    return round(2 * isotope(match[1]).spin)


def is_isotope(name: str, twice: int) -> bool:
    """Whether a name is that of an isotope whose nucleus has the spin `twice`/2."""
    try:
        return twice_spin(name) == twice
    except ValueError:
        return False


def spin_text(twice: int) -> str:
    """The size of a spin as text.

    >>> spin_text(3), spin_text(2)
    ('3/2', '1')
    """
    return f"{twice}/2" if twice % 2 else str(twice // 2)


def _refuse_totals(totals: Mapping[str, str], twice: Mapping[str, int]) -> None:
    """Raise ValueError unless the spins of a total are the last two or three, of equal size."""
    if not totals:
        return
    last = list(twice)[-len(totals) :]
    if (
        len(totals) not in (2, 3)
        or set(totals) != set(last)
        or len(set(totals.values())) > 1
        or not all(totals.values())
        or len({twice[name] for name in last}) > 1
    ):
        raise ValueError(
            f"total spin of {', '.join(totals)}: expected one total of two or three equivalent nuclei of one size, the last ones among "
            f"{', '.join(twice)}"
        )


def parse_coupled(text: str) -> tuple[dict[str, int], dict[str, str]]:
    """Twice the spins by name, and the total spin of those that are coupled first, by name, from "14N 35Cl_1+35Cl_2".

    >>> parse_coupled("S=1/2 1H_1+1H_2=1/2")
    ({'S': 1, '1H_1': 1, '1H_2': 1}, {'1H_1': 'I', '1H_2': 'I'})
    """
    spins, totals = dict[str, int](), dict[str, str]()
    for part in text.replace(",", " ").split():
        names, equals, value = part.partition("=")
        together = names.split("+")
        for name in together:
            if not name:
                raise ValueError(f"{text!r}: expected spins such as S=1/2 14N or 35Cl_1+35Cl_2; {part!r} is none")
            if name in spins:
                raise ValueError(f"{text!r}: spin {name} is given twice; once is enough")
            spins |= parse_spins(f"{name}={value}") if equals else {name: twice_spin(name)}
        totals |= dict.fromkeys(together, "I") if len(together) > 1 else {}
    return spins, totals


def parse_spins(text: str) -> dict[str, int]:
    """Twice the spins by name from "S=1/2 14N=1", in this order.

    >>> parse_spins("S=1/2, 14N=1, X=1.5")
    {'S': 1, '14N': 2, 'X': 3}
    """
    spins: dict[str, int] = {}
    for part in text.replace(",", " ").split():
        name, equals, value = part.partition("=")
        whole, slash, half = value.partition("/")
        number = float(whole) if re.fullmatch(r"\d+(\.\d+)?", whole) else -1.0
        twice = number if slash else 2 * number
        if not (equals and name) or twice < 0 or twice % 1 or (slash and half != "2"):
            raise ValueError(
                f"{text!r}: expected spins such as S=1/2 14N=1, each a multiple of 1/2 (1/2, 1, 3/2, ...); {part!r} is none"
            )
        spins[name] = int(twice)
    return spins
