"""The polarizability of a top from the text of an option."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rotor.cli.shared import inputs

if TYPE_CHECKING:
    from rotor.tops.top import Top


def with_polarizability(top: Top, text: str | None) -> Top:
    """The top with the polarizability given, else its own; ValueError where none is known."""
    if text is not None:
        return inputs.parsed("--polarizability", text, lambda value: _given(top, value))
    if top.polarizability_abc_angstrom3 is None and top.kind != "spherical":
        raise ValueError(
            "the polarizability is not known: give --polarizability aa,bb,cc (principal axes, Å³), or "
            "parallel,perpendicular of a linear or symmetric top"
        )
    return top


def _given(top: Top, text: str) -> Top:
    from rotor.units import parse_grid

    numbers = parse_grid(text, "Å3").tolist() if ":" not in text else []
    source = "given in principal axes (--polarizability)"
    if len(numbers) == 2 and top.kind in ("linear", "prolate", "oblate"):
        along, across = numbers
        numbers = [across, across, along] if top.kind == "oblate" else [along, across, across]
    if len(numbers) not in (3, 6):
        raise ValueError(
            f"{text!r}: aa,bb,cc or aa,bb,cc,ab,ac,bc, or parallel,perpendicular of a linear or symmetric top"
        )
    aa, bb, cc, ab, ac, bc = [*numbers, 0.0, 0.0, 0.0][:6]
    return top.with_polarizability([[aa, ab, ac], [ab, bb, bc], [ac, bc, cc]], source)
