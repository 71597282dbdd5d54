"""Inputs of `rotor cat`: the selection of lines, and the list for a comparison."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rotor.frozen import dataclass
from rotor.requests.field import OUTPUT, REQUIRED, changed_fields, declared
from rotor.requests.readers import INFINITE, Flag, Names, Quantity, Range, Text, Whole

if TYPE_CHECKING:
    from rotor.formats.spcat.text.catalogue import Catalogue

COMPARED = "Comparison"


@dataclass(frozen=True)
class CatRequest:
    """The selection of lines, and the list for a comparison."""

    file: str = declared(REQUIRED, Text(metavar="FILE"), "Catalogue (.cat, .cat.gz)", option="FILE")
    range_mhz: tuple[float, float] = declared(
        INFINITE, Range("MHz"), "First and last frequency (MHz)", option="--range"
    )
    min_lgint: float | None = declared(
        None, Quantity(least=-300, most=300), "Least log10 of the intensity in nm² MHz", none="none"
    )
    measured: str | None = declared(None, Text(metavar="FILE"), "Catalogue whose measured lines are merged in")
    compare: str | None = declared(
        None,
        Text(metavar="OTHER"),
        "List for a comparison: another .cat, an .int, or a molecule to predict",
        panel=COMPARED,
    )
    temperature: float | None = declared(
        None,
        Quantity("K", above=0, metavar="T"),
        "Temperature of the intensities in FILE, for a molecule (K; by default what FILE says, else 300)",
        panel=COMPARED,
    )
    isotope: tuple[str, ...] = declared(
        (),
        Names("1=2H"),
        "Another isotope of the molecule to predict, by atom number or element; repeatable",
        panel=COMPARED,
    )
    as_spcat: bool = declared(
        False,
        Flag(),
        "Predict the .int as SPCAT does, also where SPCAT errs (see rotor spectrum)",
        panel=COMPARED,
    )
    full_basis: bool = declared(
        False,
        Flag(),
        "Predict the .int with every K in the basis, ignoring KNMIN and KNMAX",
        panel=COMPARED,
    )
    top_lines: int = declared(20, Whole(0), "Number of lines shown", option="--top", panel=OUTPUT)

    def __post_init__(self) -> None:
        """Check that options of a predicted molecule or of an .int file have such a file or molecule."""
        other = (self.compare or "").lower()
        if not other.endswith(".int"):
            for field in changed_fields(self, ("as_spcat", "full_basis")):
                raise ValueError(f"{field.name}: expected with --compare and an .int file to predict")
        if not other or other.endswith((".cat", ".cat.gz", ".int")):
            for field in changed_fields(self, ("temperature", "isotope")):
                raise ValueError(f"{field.name}: expected with --compare and a molecule to predict; a file has its own")

    def chosen(self, lines: Catalogue) -> Catalogue:
        """The lines in the range and above the intensity cut."""
        import numpy as np

        from rotor.formats.spcat.compare import in_mhz

        frequency, _ = in_mhz(lines)
        least = -np.inf if self.min_lgint is None else self.min_lgint
        return lines.take((frequency >= self.range_mhz[0]) & (frequency <= self.range_mhz[1]) & (lines.lgint >= least))
