"""How spins are treated: exactly, with N as a good quantum number, or to first order; as requested, and as used."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any, ClassVar

from rotor.checks import require_choice, require_positive
from rotor.frozen import dataclass
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.levels import Used

if TYPE_CHECKING:
    from rotor.quantum.levels import Levels
    from rotor.quantum.spins.scheme import Spin
    from rotor.tops.top import Top

METHODS = ("auto", "exact", "N-diagonal", "first-order")
EXACT, N_DIAGONAL, FIRST_ORDER = "exact", "N-diagonal", "first-order"
TOLERANCE_MHZ = 1e-4


def are_with_spins(levels: Levels) -> bool:
    """Whether levels were solved in blocks with spins, whatever their quantum numbers are."""
    return any(block.spins is not None for block in levels.blocks[:1])


@dataclass(frozen=True)
class HyperfineMethod(QuantumEffect):
    """The requested method: "exact", "N-diagonal", "first-order", or "auto", the cheapest with an estimated error within a tolerance.

    coupled: the spins that the other effects couple.
    """

    method: str
    tolerance_mhz: float
    coupled: tuple[Spin, ...]
    name: ClassVar[str] = "hyperfine method"
    conserved: ClassVar[frozenset[str]] = frozenset()

    def __post_init__(self) -> None:
        require_choice("hyperfine", self.method, METHODS)
        require_positive("tolerance_mhz", self.tolerance_mhz)

    def parameters(self, top: Top) -> dict[str, float]:
        """An empty mapping: a choice of method has no constants."""
        return {}

    def size_mhz(self, top: Top, j: int) -> float:
        """0: a choice of method adds nothing to the energy."""
        return 0.0

    def spins(self, top: Top) -> tuple[Spin, ...]:
        """The spins that the effects with this method couple."""
        return self.coupled


def used_method(levels: Levels) -> Used | None:
    """The method of levels with spins; None without spins, and where none was requested, which means exact."""
    spins = levels.blocks[0].spins if levels.blocks else None
    return None if spins is None else spins.shared.used


def hyperfine_facts(top: Top, levels: Levels) -> dict[str, Any] | None:
    """Method, estimate and tolerance by the keys of docs/verbs; None for levels without spins."""
    if not any(effect.spins(top) for effect in levels.effects):
        return None
    return asdict(used_method(levels) or Used(EXACT, 0.0, TOLERANCE_MHZ))
