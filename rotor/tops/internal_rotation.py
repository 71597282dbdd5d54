"""Constants of an internal rotor, in the frame that they belong to.

In the rho-axis frame (RAM) z is along ρ and the rotational constants of the top are those of this frame,

    H = A Pa² + B Pb² + C Pc² + D_ab {Pa, Pb} + F (p - ρPa)² + ½V3 (1 - cos 3α) + ...,

A beside F (p - ρPa)². In the principal-axis frame (PAM, as XIAM has it) the rotational constants and distortion are those of the principal
axes, F0 = ħ²/2I_α of the top alone, delta is the angle between its axis and a, and epsilon (0 if missing) the angle about a from b to the
axis: 0 in the plane ab, π/2 in ac. The names of further terms are in `rotor.quantum.internal_rotation.terms`. Two or three tops are given
in the PAM, with the number of the top behind each name: F0_1, delta_1, epsilon_1, V3_1, V6_1, F0_2 ..., and their coupling by V12, V12s
(V13 ...).
Constants without a stated frame are refused.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import field
from itertools import product
from types import MappingProxyType
from typing import Any

from rotor.checks import did_you_mean, first_names
from rotor.frozen import dataclass
from rotor.units import parse_quantity

BARRIERS = ("V3", "V6", "V9")
NAMED = (
    "Dab", "Dbc", "Dac", "Fm", "rhom", "V3J", "V3K", "V3bc", "V3ab", "D3ac", "D3bc", "FJ", "FK", "Fbc", "Fab", "rhoJ", "rhoK", "rhobc",
    "rhoab", "DabJ", "DabK",
)  # fmt: skip
SPELLED = re.compile(
    r"(?:J(?P<j>\d+))?(?:Jz(?P<z>\d*))?(?:J(?P<kind>pm|mi)(?P<n>\d+))?(?:p(?P<p>\d*))?(?:(?P<wave>cos|sin)(?P<multiple>\d+))?"
)
FRAMES = ("RAM", "PAM")
NEEDED = {"RAM": ("F", "rho", "V3"), "PAM": ("F0", "delta", "V3")}
MOST_TOPS = 3
COUNTED = {2: "two", 3: "three"}
NUMBERED = {
    f"{name}_{top}": top for top in range(1, MOST_TOPS + 1) for name in ("F0", "delta", "epsilon", "V3", "V6")
}  # constants of several tops, and the number of the top
PAIRS = {"V12": 2, "V12s": 2, "V13": 3, "V13s": 3, "V23": 3, "V23s": 3}  # and of two of them, with the higher number
# dimensionless, or angles in radians
BARE = (
    "rho",
    "delta",
    "epsilon",
    *(name for name in NUMBERED if name.startswith(("delta", "epsilon"))),
)
DEFAULT_FUNCTIONS = {
    1: 9,
    2: 25,
    3: 60,
}  # n_v by the number of tops; v_t = 0: 1 Hz of one top at J = 25, a tenth of a MHz to 1 MHz of several
MOST_FUNCTIONS = {1: 20, 2: 81, 3: 100}


def sigma_species(count: int) -> dict[str, tuple[int, ...]]:
    """σ of each top by the name of the species; each stands for the opposite σ too, so that the first that is not 0 is 1.

    >>> sigma_species(2)
    {'AA': (0, 0), 'AE': (0, 1), 'EA': (1, 0), 'EE': (1, 1), 'EE*': (1, -1)}
    >>> len(sigma_species(3)), sigma_species(3)["EE*A"]
    (14, (1, -1, 0))
    """
    letters = {0: "A", 1: "E", -1: "E*"}
    return {
        "".join(letters[s] for s in sigma): sigma
        for sigma in product(letters, repeat=count)
        if next(filter(None, sigma), 1) > 0
    }


def spin_functions(states: int) -> tuple[int, int]:
    """Numbers of spin functions of A, and of one component of E, of three equal nuclei with n = 2I + 1 states each.

    The rotations by ±120° leave n of the n³ products unchanged, so that A has (n³ + 2n)/3 and each component of E has (n³ - n)/3.

    >>> spin_functions(2), spin_functions(3)  # CH3, CD3
    ((4, 2), (11, 8))
    """
    return (states**3 + 2 * states) // 3, (states**3 - states) // 3


def is_torsional(name: str) -> bool:
    """Whether a constant belongs to an internal rotor: F, rho, a barrier, a named term, or a term spelled with p, cos or sin.

    >>> [is_torsional(name) for name in ("V3", "J2p2", "Jz1Jpm1", "DeltaJ")]
    [True, True, False, False]
    """
    if name in ("F", "rho", "F0", "delta", "epsilon", *BARRIERS, *NAMED, *NUMBERED, *PAIRS):
        return True
    match = SPELLED.fullmatch(name)
    return bool(name) and match is not None and (match["p"] is not None or match["wave"] is not None)


def values_and_settings(items: Sequence[str]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Constants and settings (vt_max, functions ...) from items NAME=VALUE; ValueError for other items.

    >>> values_and_settings(["V3=408cm-1", "vt_max=2"])
    ({'V3': '408cm-1'}, {'vt_max': 2})
    """
    values: dict[str, Any] = {}
    for item in items:
        name, equals, value = item.partition("=")
        if not (name and equals and value):
            raise ValueError(f"internal rotation: {item!r}: expected NAME=VALUE, such as V3=407.6cm-1, without spaces")
        values[name] = value
    settings: dict[str, Any] = {k: int(values.pop(k)) for k in ("vt_max", "functions") if k in values}
    if states := values.pop("spin_states", ""):
        settings["spin_states"] = tuple(int(number) for number in states.split(","))
    if names := values.pop("names", ""):
        settings["names"] = names
    if exchanged := values.pop("exchanged", ""):
        settings["exchanged"] = tuple(int(number) for number in exchanged.split(",") if number)
    return values, settings


@dataclass(frozen=True, eq=False)
class InternalRotationConstants:
    """Constants of one threefold top, or of two or three: MHz by name, rho without a unit.

    values: F, rho, V3 and further terms, apart from the rotational constants and distortion, which are the top's. frame: "RAM" or "PAM".
    vt_max: the highest torsional state of the levels. functions: n_v, the torsional functions retained for each K; 0 stands for 9, and for
    25 products of two tops, 60 of three. spin_states: 2I + 1 of each nucleus of a top, 2 of hydrogen; (2, 3) is that of each top, CH3 and
    CD3. names: "K", E levels of a nearly free top are named by the signed K of largest weight; "energy", Ka and Kc are counted by energy
    inside each v_t, as westerfit and BELGI (A levels) do, which is another order for such a top.
    exchanged: of two equivalent tops 2I + 1 of the nuclei of each further pair that goes over into itself when they are exchanged, (2,) of
    propane with the hydrogens of CH2. uncertainties: in MHz (of rho without a unit). source: where the values are from.

    >>> constants = InternalRotationConstants({"F": "7.6 cm-1", "rho": 0.33, "V3": "408 cm-1"}, "RAM")
    >>> round(constants.values["V3"]), constants.weights
    (12231532, ((4, 2),))
    """

    values: Mapping[str, float]
    frame: str
    vt_max: int = 1
    functions: int = 0
    spin_states: int | tuple[int, ...] = 2
    names: str = "K"
    exchanged: tuple[int, ...] = ()
    uncertainties: Mapping[str, float] = field(default_factory=dict)
    source: str = ""

    def __post_init__(self) -> None:
        if self.frame not in FRAMES:
            raise ValueError(
                f"internal rotation in the frame {self.frame or '(not stated)'}: expected RAM (z along rho; F, rho) or PAM (principal "
                "axes; F0, delta), which have other values of A, B, C"
            )
        self._check_names()
        numbers = {n: float(value) if n in BARE else parse_quantity(value, "MHz") for n, value in self.values.items()}
        for name in numbers:
            if (name == "F" or name.startswith("F0")) and not numbers[name] > 0:
                raise ValueError(f"{name} = {numbers[name]:g} MHz: expected a number above 0")
        if not self.functions:
            object.__setattr__(self, "functions", DEFAULT_FUNCTIONS[self.tops])
        most = MOST_FUNCTIONS[self.tops]
        if not 0 <= self.vt_max <= self.functions - 2 <= most - 2:
            raise ValueError(
                f"torsional states up to v_t = {self.vt_max} from n_v = {self.functions} functions: expected n_v of at least v_t + 2 "
                f"and at most {most}"
            )
        if self.names not in ("K", "energy"):
            raise ValueError(f"names {self.names!r} of levels of internal rotation: expected K or energy")
        if self.exchanged and (self.tops != 2 or min(self.exchanged) < 1):
            raise ValueError(
                f"exchanged = {list(self.exchanged)}: expected 2I + 1 of each pair of nuclei that the exchange of two tops exchanges too"
            )
        if len(self.states_of_tops) != self.tops or min(self.states_of_tops) < 1:
            raise ValueError(
                f"spin_states = {self.spin_states}: expected 2I + 1 of the nuclei of all tops, or of each of {self.tops}"
            )
        object.__setattr__(self, "values", MappingProxyType(numbers))
        object.__setattr__(self, "uncertainties", MappingProxyType(dict(self.uncertainties)))

    def _check_names(self) -> None:
        """Raise ValueError for unknown names, names of the other frame, and missing names."""
        for name in self.values:
            if re.fullmatch(r"(F0|delta|epsilon|V3|V6)_[4-9]", name):
                raise ValueError(f"{name}: a molecule may have up to three tops; leave the others locked")
            if not is_torsional(name):
                known = ("F", "rho", *BARRIERS, *NAMED)
                raise ValueError(
                    f"{name!r} is no constant of an internal rotor: known are {first_names(known)}, and terms such as "
                    f"J2p2{did_you_mean(name, known)}"
                )
        needed: tuple[str, ...] = NEEDED[self.frame]
        others: tuple[str, ...] = (*NEEDED["PAM"], "epsilon") if self.frame == "RAM" else NEEDED["RAM"]
        place = f"in the frame {self.frame}"
        if self.tops > 1:
            needed = tuple(f"{name}_{top}" for top in range(1, self.tops + 1) for name in ("F0", "delta", "V3"))
            place = f"of {COUNTED[self.tops]} tops"
            others = tuple(name for name in self.values if name not in (*NUMBERED, *PAIRS))
            if self.frame != "PAM":
                raise ValueError(f"internal rotation {place} in the frame {self.frame}: expected PAM (principal axes)")
        if missing := [name for name in needed if name not in self.values]:
            raise ValueError(f"internal rotation: {', '.join(missing)} missing; expected {', '.join(needed)} {place}")
        if strange := [name for name in others if name in self.values and name not in needed]:
            raise ValueError(f"internal rotation: {', '.join(strange)} {place}: expected {', '.join(needed)}")

    @property
    def tops(self) -> int:
        """Number of internal rotors."""
        return max((NUMBERED | PAIRS).get(name, 1) for name in (*self.values, ""))

    def __reduce__(self) -> tuple[Any, ...]:
        others = (
            self.vt_max,
            self.functions,
            self.spin_states,
            self.names,
            self.exchanged,
            dict(self.uncertainties),
            self.source,
        )
        return type(self), (dict(self.values), self.frame, *others)

    @classmethod
    def parse(cls, text: str) -> InternalRotationConstants:
        """Constants from a text such as "RAM F=7.57cm-1 rho=0.3286 V3=407.6cm-1 Dab=0.12cm-1 vt_max=1".

        Raises ValueError if the text does not start with a frame, and for items that are not NAME=VALUE.

        >>> InternalRotationConstants.parse("PAM F0=158.6GHz delta=0.322 V3=11100GHz vt_max=0").vt_max
        0
        """
        frame, *items = text.split()
        values, settings = values_and_settings(items)
        return cls(values, frame, **settings)

    @property
    def states_of_tops(self) -> tuple[int, ...]:
        """2I + 1 of the nuclei of each top."""
        states = (self.spin_states,) if isinstance(self.spin_states, int) else tuple(self.spin_states)
        return states * self.tops if len(states) == 1 else states

    @property
    def weights(self) -> tuple[tuple[int, int], ...]:
        """Spin functions of each top (`spin_functions`)."""
        return tuple(spin_functions(states) for states in self.states_of_tops)
