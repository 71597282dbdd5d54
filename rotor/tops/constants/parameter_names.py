"""Names of constants that state spins, powers and vibrational states.

    symbol [_powers] (spin [, spin]) [state]          chi_aa(14N), C_ab_J(H1), T_bb-cc(S, 14N), chi_aa(14N)[1]

powers: J for N², K for Nz², S for N·S of the first spin, one letter for each factor, as half anticommutators. Without a state in square
brackets a constant acts in all states.
"""

from __future__ import annotations

import re
from typing import NamedTuple

_NAME = re.compile(
    r"(?P<symbol>[A-Za-z]+(?:_(?:[abc]{2}(?:-[abc]{2})?|[abcF]|iso|pm\d))?)(?:_(?P<powers>[JKS]+))?"
    r"(?:\((?P<spins>[^()]*)\))?(?:\[(?P<states>\d+(?:,\s*\d+)?)\])?"
)


class ParameterName(NamedTuple):
    """Parts of a name: symbol, powers of N², Nz² and N·S, spins, and the states v', v that it connects (None: all)."""

    symbol: str
    n2: int = 0
    nz2: int = 0
    ns: int = 0
    spins: tuple[str, ...] = ()
    states: tuple[int, int] | None = None

    @property
    def text(self) -> str:
        """The complete name."""
        powers = "J" * self.n2 + "K" * self.nz2 + "S" * self.ns
        states = "" if self.states is None else f"[{','.join(str(v) for v in dict.fromkeys(self.states))}]"
        spins = f"({','.join(self.spins)})" if self.spins else ""
        return self.symbol + (f"_{powers}" if powers else "") + spins + states


def parse_name(name: str) -> ParameterName:
    """The parts of a parameter's name.

    >>> parse_name("chi_bb-cc_J(14N)[1]")
    ParameterName(symbol='chi_bb-cc', n2=1, nz2=0, ns=0, spins=('14N',), states=(1, 1))
    >>> parse_name("G_c_JK[0,1]").text
    'G_c_JK[0,1]'
    """
    match = _NAME.fullmatch(name.strip())
    if not match:
        raise ValueError(
            f"parameter {name!r}: a name has the form symbol_powers(spins)[states], such as chi_aa(14N), C_bb_J(H1) or G_c[0,1], "
            "with components along the principal axes: aa, bb-cc, ab, ac, bc, ..."
        )
    powers = match["powers"] or ""
    spins = tuple(part.strip() for part in (match["spins"] or "").split(",") if part.strip())
    states = None
    if match["states"]:
        numbers = [int(part) for part in match["states"].split(",")]
        states = (min(numbers), max(numbers))
    return ParameterName(match["symbol"], powers.count("J"), powers.count("K"), powers.count("S"), spins, states)
