"""Rotational constants by their published names, in MHz, with reduction, representation and uncertainties.

A set of constants is complete: it has the values, the reduction (A or S) and the axes (representation) that they refer to, and the kind
of top whose Hamiltonian they belong to. Nothing is converted silently; `rotor.tops.constants.operators` defines the operators of the names.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from rotor.checks import Renamed, first_names
from rotor.frozen import dataclass
from rotor.tops.constants.kind_of_constants import (
    KNOWN,
    RIGID,
    resolve_kind,
    resolve_reduction,
    resolve_representation,
    vocabulary,
)
from rotor.tops.constants.operators import KINDS, Powers, published_name, spelled_powers, spelled_term
from rotor.tops.constants.uncertain_numbers import known_digits, parse_named, write_number
from rotor.units import ROTATIONAL_MHZ_U_ANGSTROM2, parse_quantity

# letters that look alike: U+0394 and U+2206, φ and ϕ
_GREEK = {"Δ": "Delta", "∆": "Delta", "δ": "delta", "Φ": "Phi", "φ": "phi", "ϕ": "phi"}
_WITHOUT_K = {"DJ": "D", "HJ": "H", "LJ": "L"}  # names for linear and spherical tops
LEAST_MHZ, MOST_MHZ = 1e-12, 1e12  # far below any molecule, far above H2 (1.8e6 MHz)
_SPIN_OR_STATE = re.compile(r"(chi|eps|[CTDGF])_?[abc]{1,2}|(b_?F|W|E|gamma|lambda|[CJ]_?iso)\b")
_SETTINGS = ("reduction", "representation", "kind", "uncertainties", "sources")


@dataclass(frozen=True, init=False, repr=False)
class Constants:
    """Named rotational constants in MHz; immutable, equal if all their content is equal.

    Parameters
    ----------
    reduction : "A", "S" or None
        Watson's reduction, for asymmetric tops only; by default inferred from the names.
    representation : one of Ir, Il, IIr, IIl, IIIr, IIIl, or None
        Axes of an asymmetric top; Ir for Ray's κ <= 0 and IIIl for κ > 0 by default.
    kind : "linear", "spherical", "prolate", "oblate", "asymmetric" or None
        By default inferred: B alone is linear, A and B prolate, B and C oblate; for A, B and C exact equality decides.
        A given kind must not contradict the constants.
    uncertainties, sources : mapping by name
        One standard deviation in MHz; publication of the number.
    terms : mapping {(p, q, n): value in MHz}
        Terms J^2p ½[Jz^2q, J₊^2n + J₋^2n]₊ without a published name; stored under names such as
        `J4Jz2Jpm6`, which texts and files may also use.
    **values_mhz
        The constants: float in MHz or text with a unit. A, B, C with A >= B >= C > 0; distortion constants with
        published signs (ΔJ, DJ > 0 for a normal molecule). Greek letters and underscores are accepted.

    Raises
    ------
    ValueError
        For unknown names and names of another kind of top, both reductions in one set, constants that are not
        finite or out of order, and a kind, reduction or representation that does not fit.

    Examples
    --------
    >>> water = Constants(A=835840.288, B=435351.717, C=278138.7)
    >>> water.kind, water.representation, water["B"], water.get("DeltaJ")
    ('asymmetric', 'Ir', 435351.717, 0.0)
    >>> Constants(B=6081.492114, D=1.301427e-3).text()
    'B=6081.492114 D=0.001301427 MHz'
    """

    values: Mapping[str, float]
    reduction: str | None
    representation: str | None
    kind: str
    uncertainties: Mapping[str, float]
    sources: Mapping[str, str]

    def __init__(
        self,
        *,
        reduction: str | None = None,
        representation: str | None = None,
        kind: str | None = None,
        uncertainties: Mapping[str, float] | None = None,
        sources: Mapping[str, str] | None = None,
        terms: Mapping[Powers, float | str] | None = None,
        **values_mhz: float | str,
    ) -> None:
        named = _renamed([*values_mhz.items(), *_spelled(terms).items()], _published_name)
        _refuse_unknown(named)
        numbers = {name: _finite(name, value) for name, value in named.items()}
        kind = resolve_kind(numbers, kind)
        values = _renamed(numbers.items(), lambda name: _name_in(kind, name))

        errors = _renamed((uncertainties or {}).items(), lambda name: _name_in(kind, _published_name(name)))
        origins = _renamed((sources or {}).items(), lambda name: _name_in(kind, _published_name(name)))
        _refuse_strays("uncertainties", errors, values)
        _refuse_strays("sources", origins, values)

        reduction = resolve_reduction(kind, values, reduction)
        _refuse_misplaced(kind, reduction, dict(zip(values, (*values_mhz, *values), strict=False)))
        _refuse_disorder(kind, values)

        content = {
            "values": MappingProxyType(values),
            "reduction": reduction,
            "representation": resolve_representation(kind, values, representation),
            "kind": kind,
            "uncertainties": MappingProxyType({name: _spread(name, errors[name]) for name in values if name in errors}),
            "sources": MappingProxyType(origins),
        }
        for field, value in content.items():
            object.__setattr__(self, field, value)

    def __hash__(self) -> int:
        return hash((self.kind, self.reduction, self.representation, frozenset(self.values.items())))

    def __repr__(self) -> str:
        return f"Constants({self.line({})})"

    def line(self, estimated: Mapping[str, float]) -> str:
        """Kind, A, B, C in MHz with the digits that estimated errors leave, and the number of distortion constants."""
        form = ", ".join(filter(None, (self.reduction and f"{self.reduction}-reduction", self.representation)))
        rest = f", {self.distortion_count} of distortion" if self.distortion_count else ""
        return f"{self.kind}: {self.rigid_text(estimated)}{rest}{f' ({form})' if form else ''}"

    def rigid_text(self, estimated: Mapping[str, float]) -> str:
        """A, B, C in MHz with the digits that estimated errors leave."""
        rigid = [name for name in self.values if name in RIGID]
        return (
            ", ".join(f"{name} {known_digits(self.values[name], estimated.get(name), 10)}" for name in rigid) + " MHz"
        )

    @property
    def distortion_count(self) -> int:
        """Number of distortion constants."""
        return len(self.values.keys() - RIGID)

    def html_table(self, estimated: Mapping[str, float]) -> str:
        """Names, values and errors as a table in HTML; an estimated error leaves fewer digits."""
        rows = "<tr><th></th><th>MHz</th><th>±</th></tr>"
        for name, value in self.values.items():
            guess, error = estimated.get(name), self.uncertainties.get(name)
            text = f"about {known_digits(guess, guess)}" if guess else "" if error is None else f"{error:.2g}"
            rows += f"<tr><td>{name}</td><td>{known_digits(value, guess)}</td><td>{text}</td></tr>"
        return f"<table>{rows}</table>"

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuilt, (self._settings(), dict(self.values))

    def __getitem__(self, name: str) -> float:
        """The constant of this name in MHz; KeyError if it is missing."""
        return self.values[_name_in(self.kind, _published_name(name))]

    def __contains__(self, name: str) -> bool:
        return _name_in(self.kind, _published_name(name)) in self.values

    def get(self, name: str, default: float = 0.0) -> float:
        """The constant of this name in MHz, or `default` if it is missing."""
        return self.values.get(_name_in(self.kind, _published_name(name)), default)

    def spelling(self, name: str) -> str:
        """The spelling of a name in this set: Greek letters written out, no underscores, D for DJ of a linear molecule.

        >>> Constants(B=5.0).spelling("D_J")
        'D'
        """
        return _name_in(self.kind, _published_name(name))

    own_name = Renamed("spelling")

    @property
    def rigid(self) -> tuple[float, float, float]:
        """A, B, C in MHz for any kind of top; equal constants are filled in.

        A linear molecule has zero moment about its axis, so that A is infinite.

        >>> Constants(B=5.0, kind="spherical").rigid, Constants(B=5.0).rigid
        ((5.0, 5.0, 5.0), (inf, 5.0, 5.0))
        """
        b = self.values["B"]
        if self.kind == "linear":
            return math.inf, b, b  # no moment about the axis of a linear molecule
        return self.values.get("A", b), b, self.values.get("C", b)

    @property
    def terms(self) -> dict[Powers, float]:
        """Terms without a published name, {(p, q, n): value in MHz}.

        >>> Constants(A=9.0, B=3.0, C=2.0, terms={(1, 0, 4): 1e-9}).terms
        {(1, 0, 4): 1e-09}
        """
        return {powers: value for name, value in self.values.items() if (powers := spelled_powers(name))}

    def replace(self, **changes: Any) -> Constants:
        """A changed copy. A constant set to None is removed; kind, reduction or representation None is inferred again.

        A changed constant loses its uncertainty and source unless new ones are given.

        >>> Constants(A=9.0, B=3.0, C=2.0).replace(C=2.5).text()
        'A=9.0 B=3.0 C=2.5 MHz'
        """
        changes |= _spelled(changes.pop("terms", None))
        typed = {name: value for name, value in changes.items() if name not in _SETTINGS}
        changed = _renamed(typed.items(), lambda name: _name_in(self.kind, _published_name(name)))
        as_typed = dict(zip(changed, typed, strict=True))  # errors quote the names that were typed
        values = {as_typed.get(n, n): value for n, value in {**self.values, **changed}.items() if value is not None}
        settings = self._settings()
        for table in ("uncertainties", "sources"):
            settings[table] = {name: entry for name, entry in settings[table].items() if name not in changed}
        settings.update({name: value for name, value in changes.items() if name in _SETTINGS})
        return Constants(**settings, **values)

    @classmethod
    def parse(
        cls,
        text: str,
        *,
        reduction: str | None = None,
        representation: str | None = None,
        kind: str | None = None,
    ) -> Constants:
        """Constants from text such as "A=835840.288(12) B=435351.717 C=278138.7 MHz".

        Digits in brackets are the uncertainty in the last digits. Each item may carry a unit; a unit at the end, after a space,
        serves all items without one; without any unit, numbers are MHz.

        Parameters
        ----------
        text : str
            Names and values.
        reduction, representation, kind : str, optional
            "A" or "S"; axes at x, y, z ("Ir", ...); kind of top. By default inferred from names and values.

        Returns
        -------
        Constants
            Values and uncertainties in MHz.

        Raises
        ------
        ValueError
            For unreadable text, and for contradictory constants.

        Examples
        --------
        >>> Constants.parse("B=9.2GHz DJ=3.8kHz").values["D"]
        0.0038
        >>> Constants.parse("A=5.17 B=0.25(2) cm-1").uncertainties["B"]
        599.584916
        """
        values, uncertainties = parse_named(text)
        settings = {"reduction": reduction, "representation": representation, "kind": kind}
        return cls(**settings, uncertainties=uncertainties, **values)  # type: ignore[arg-type]

    def text(self, unit: str = "MHz") -> str:
        """The constants in one line, with uncertainties in brackets and the fewest digits that `parse` reads back exactly.

        >>> Constants.parse("B=57635.968(12) D=0.1835 MHz").text("GHz")
        'B=57.635968(12) D=0.0001835 GHz'
        """
        errors = self.uncertainties
        items = (f"{name}={write_number(value, errors.get(name), unit)}" for name, value in self.values.items())
        return f"{' '.join(items)} {unit}"

    def _settings(self) -> dict[str, Any]:
        """The arguments of the constructor without the values."""
        return {
            "reduction": self.reduction,
            "representation": self.representation,
            "kind": self.kind,
            "uncertainties": dict(self.uncertainties),
            "sources": dict(self.sources),
        }


# Names


def _published_name(name: str) -> str:
    """The name with Greek letters spelled out and without underscores: `Δ_JK` is `DeltaJK`; unknown names are unchanged."""
    plain = name.replace("_", "")
    plain = _GREEK.get(plain[:1], plain[:1]) + plain[1:]
    return plain if plain in KNOWN or spelled_powers(plain) else name


def _name_in(kind: str, name: str) -> str:
    return _WITHOUT_K.get(name, name) if kind in ("linear", "spherical") else name


def _spelled(values: Mapping[Powers, Any] | None) -> dict[str, Any]:
    return {spelled_term(*powers): value for powers, value in (values or {}).items()}


def _renamed(items: Iterable[tuple[str, Any]], rename: Callable[[str], str]) -> dict[str, Any]:
    renamed: dict[str, Any] = {}
    typed: dict[str, str] = {}
    for text, value in items:
        name = rename(text)
        if name in typed:
            raise ValueError(f"{typed[name]} and {text} are one constant, {name}, which is given twice; leave one out")
        typed[name], renamed[name] = text, value
    return renamed


class UnknownConstantError(ValueError):
    """A name that is not one of a rotational constant."""


def _refuse_unknown(names: Iterable[str]) -> None:
    for name in names:
        if name not in KNOWN and not spelled_powers(name):
            near = [candidate for candidate in KNOWN if candidate.casefold() == name.casefold()]
            near = near or difflib.get_close_matches(name.replace("_", ""), KNOWN, n=3)
            hint = f"did you mean {' or '.join(near)}? " if near else ""
            if re.fullmatch("mu_?[abc]", name):
                hint = "the dipole is not a rotational constant; molecule files have dipole = { a = 1.0 }, some commands --dipole. "
            elif _SPIN_OR_STATE.match(name):
                hint = (
                    "constants of spins and of further states are given beside these: --spin-constants 'chi_aa(14N)=-4.2 MHz' and "
                    "--state-constants, in Python spin_constants and states. "
                )
            raise UnknownConstantError(
                f"{name!r} is not a rotational constant known here: {hint}{'K' if hint else 'k'}nown are {first_names(KNOWN)}, and terms "
                "spelled out such as J4Jz2Jpm6"
            )


def _refuse_strays(what: str, names: Iterable[str], values: Mapping[str, float]) -> None:
    strays = [name for name in names if name not in values]
    if strays:
        raise ValueError(f"{what} of {', '.join(strays)}, but there is no such constant here: {', '.join(values)}")


def _refuse_misplaced(kind: str, reduction: str | None, typed: Mapping[str, str]) -> None:
    """Raise ValueError for a name that this kind of top does not have. typed: names as typed, by published name."""
    allowed = vocabulary(kind, reduction)
    for name in typed:
        if powers := spelled_powers(name):
            _refuse_named_term(kind, reduction, name, powers)
        elif name not in allowed:
            near = _counterpart(name, allowed)
            ways = [f"use {near}"] if near else []
            if kind in ("prolate", "oblate") and {*RIGID} <= {*typed}:
                ways.append("say kind='asymmetric'")
            hint = f"{' or '.join(ways)}; " if ways else ""
            raise ValueError(f"{typed[name]} is not a constant of kind {kind!r}: {hint}that has {', '.join(allowed)}")


def _refuse_named_term(kind: str, reduction: str | None, name: str, powers: Powers) -> None:
    """Refuse a spelled-out term that has a published name, or that this kind of top cannot have."""
    if published := published_name(powers, kind, reduction):
        raise ValueError(f"{name} is the operator of {published}; give it by that name, with the sign of that name")
    letters = {"linear": "J", "spherical": "J", "prolate": "J and Jz", "oblate": "J and Jz"}.get(kind)
    if letters and (powers[2] or (powers[1] and letters == "J")):
        raise ValueError(f"{name} is not a term of kind {kind!r}, whose terms have powers of {letters} only")


def _counterpart(name: str, allowed: tuple[str, ...]) -> str:
    """The allowed name of the same operator, such as DJ for DeltaJ or D, and HJK for PhiJK; empty for d1."""
    match = re.fullmatch(r"(Delta|Phi|[DHL])(J?J?K?K?J?)", name)
    if not match:
        return ""
    letter = {"Delta": "D", "Phi": "H"}.get(match[1], match[1])
    return next((n for n in (letter + match[2], letter + "J", letter) if n in allowed), "")


# Numbers


def _finite(name: str, value: float | str) -> float:
    try:
        return parse_quantity(value, "MHz")
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} = {value!r}: {error}") from None


def _spread(name: str, value: float | str) -> float:
    error = _finite(f"uncertainty of {name}", value)
    if error < 0:
        raise ValueError(f"uncertainty of {name} = {error!r} MHz: a standard deviation is 0 or more")
    return error


class AxisOrderError(ValueError):
    """Rotational constants whose names are not in the order of their values. constants: their text; order: of the names."""

    def __init__(self, constants: str, names: Sequence[str]) -> None:
        self.constants, self.order = constants, " >= ".join(names)
        super().__init__(f"{constants}: the names follow the order {self.order}; exchange them")


def _refuse_disorder(kind: str, values: Mapping[str, float]) -> None:
    rigid = {name: values[name] for name in RIGID if name in values}
    for name, value in rigid.items():
        if value <= 0:
            raise ValueError(f"{name} = {value!r} MHz: a rotational constant is positive")
        if not LEAST_MHZ <= value <= MOST_MHZ:
            raise ValueError(
                f"{name} = {value!r} MHz: expected a rotational constant from {LEAST_MHZ:g} to {MOST_MHZ:g} MHz; check the unit"
            )
    if list(rigid.values()) != sorted(rigid.values(), reverse=True):
        constants = ", ".join(f"{name} = {value!r}" for name, value in rigid.items())
        raise AxisOrderError(f"{constants} MHz", list(rigid))


def _rebuilt(settings: dict[str, Any], values: dict[str, Any]) -> Constants:
    return Constants(**settings, **values)


def constants_from_moments(moments: Iterable[float], kind: str) -> Constants:
    """Rigid constants for a kind of top, from moments in u Å²; degenerate moments are averaged."""
    if kind not in KINDS:
        raise ValueError(f"kind {kind!r} is none of {', '.join(KINDS)}")
    ia, ib, ic = (float(moment) for moment in moments)
    f = ROTATIONAL_MHZ_U_ANGSTROM2
    if kind == "linear":
        return Constants(B=f / ((ib + ic) / 2), kind=kind)
    if kind == "spherical":
        return Constants(B=f / ((ia + ib + ic) / 3), kind=kind)
    if kind == "prolate":
        return Constants(A=f / ia, B=f / ((ib + ic) / 2), kind=kind)
    if kind == "oblate":
        return Constants(B=f / ((ia + ib) / 2), C=f / ic, kind=kind)
    return Constants(A=f / ia, B=f / ib, C=f / ic, kind=kind)
