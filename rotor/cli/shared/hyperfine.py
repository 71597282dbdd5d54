"""`--hyperfine` and the options that belong to it, the same for every verb that has spins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rotor.cli.shared import inputs
from rotor.cli.shared.options import option
from rotor.cli.shared.output import note

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top


@dataclass(frozen=True)
class HyperfineOptions:
    """Whether spins take part, and how exactly."""

    hyperfine: bool | None = option(
        None,
        "--hyperfine/--no-hyperfine",
        help="Split levels and lines by the spins of nuclei; by default where --spin-constants are given.",
    )
    hyperfine_method: str = option(
        "exact",
        metavar="NAME",
        help="exact, N-diagonal, first-order, or auto: the cheapest that keeps --hyperfine-tolerance.",
    )
    hyperfine_tolerance: str = option(
        "0.1kHz", metavar="D", help="With auto: how far it may be off exact levels (MHz)."
    )


def hyperfine_asked(options: HyperfineOptions, spin_constants: str | None) -> bool:
    """Whether spins take part; ValueError for a method where they do not. spin_constants: the text of that option."""
    asked = spin_constants is not None if options.hyperfine is None else options.hyperfine
    if options.hyperfine_method != "exact" and not asked:
        raise ValueError(
            f"--hyperfine-method {options.hyperfine_method}: without --hyperfine or --spin-constants nothing is split; add "
            "one of them"
        )
    return asked


def effects_asked(top: Top, options: HyperfineOptions, spin_constants: str | None) -> tuple[QuantumEffect, ...]:
    """The Hamiltonian that the options ask for, of a top in all its states."""
    from rotor.quantum.effects.of_top import effects_of

    asked = hyperfine_asked(options, spin_constants)
    tolerance = inputs.positive("--hyperfine-tolerance", options.hyperfine_tolerance, "MHz")
    with inputs.fields_as_options(hyperfine="--hyperfine-method"):
        return effects_of(top, asked, options.hyperfine_method, tolerance)


def effects_of_each(
    tops: Sequence[Top], options: HyperfineOptions, spin_constants: str | None
) -> tuple[tuple[QuantumEffect, ...], ...]:
    """The same of several molecules: those with constants of spins are split, and a note names the others."""
    known = [top.spin_constants is not None for top in tops]
    if not hyperfine_asked(options, spin_constants) or not any(known) or all(known):
        return tuple(effects_asked(top, options, spin_constants) for top in tops)
    unsplit = ", ".join(top.name or f"molecule {number}" for number, top in enumerate(tops, 1) if not known[number - 1])
    note(f"--hyperfine: no constants of spins are known of {unsplit}, whose lines are not split")
    from rotor.quantum.effects.of_top import effects_of

    return tuple(
        effects_asked(top, options, spin_constants) if split else effects_of(top, hyperfine=False)
        for top, split in zip(tops, known, strict=True)
    )


def hyperfine_lines(used: dict[str, Any] | None) -> list[tuple[str, str]]:
    """Which method split the levels, and by how much it may differ from the exact one, as a line of a report."""
    if used is None:
        return []
    if used["method"] == "exact":
        return [("hyperfine", "exact: all N that a tensor connects")]
    estimate = f"{1000 * used['estimate_mhz']:.2g} kHz"
    return [("hyperfine", f"{used['method']}: differs from exact by less than {estimate}, estimated")]
