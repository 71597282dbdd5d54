"""Which effects a Hamiltonian has, as every verb of levels asks for them: distortion, and the spins of nuclei by some method."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from rotor.frozen import dataclass
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.requests.field import declared, part
from rotor.requests.readers import Flag, Quantity, Text

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect
    from rotor.tops.top import Top

METHODS = ("auto", "exact", "N-diagonal", "first-order")
_SPINS = frozenset({"nuclear quadrupole", "spin-rotation", "spin-spin"})
_KNOWN = frozenset({"rigid rotor", "centrifugal distortion", "interacting states", "hyperfine method"})


@dataclass(frozen=True)
class HamiltonianInput:
    """What the Hamiltonian consists of besides the rigid rotor."""

    distortion: bool = declared(
        True, Flag(), "Centrifugal distortion, as far as constants are there", "effects.distortion", option=""
    )
    hyperfine: bool | None = declared(
        None, Flag(off=True), "Split by the spins of nuclei; by default where their constants are given", "effects.hyperfine",
        common=True, example=True,
    )  # fmt: skip
    hyperfine_method: str = declared(
        "exact", Text(METHODS, "NAME"), "exact, N-diagonal, first-order, or auto: the cheapest that keeps the tolerance",
        "effects.hyperfine_method",
    )  # fmt: skip
    hyperfine_tolerance: float = declared(
        1e-4, Quantity("MHz", above=0, metavar="D"), "With auto: allowed deviation from the exact levels (MHz)",
        "effects.hyperfine_tolerance", typed="0.1 kHz",
    )  # fmt: skip


def effects_field() -> Any:
    """The field `effects` of a request: a tuple of effects."""
    return part(HamiltonianInput, effects_from, lambda effects, request: saved_of_top(effects, request.top), SEMI_RIGID)


def takes_spins(hyperfine: bool | None, subject: Any) -> bool:
    """Whether spins take part: as asked for, by default where their constants were given with the molecule."""
    has_spins = any(molecule.spin_constants is not None for molecule in subject.molecules)
    return has_spins if hyperfine is None else hyperfine


def effects_from(inputs: HamiltonianInput, subject: Any) -> Any:
    """The Hamiltonian that is asked for, of the top of a subject."""
    _refuse_method_alone(inputs, subject)
    if "top" not in subject.values:  # files that name their effects themselves
        return SEMI_RIGID
    return effects_of_top(inputs, subject.top, takes_spins(inputs.hyperfine, subject))


def effects_of_top(inputs: HamiltonianInput, top: Top, hyperfine: bool) -> tuple[QuantumEffect, ...]:
    """The Hamiltonian of one top, with or without spins."""
    from rotor.quantum.effects.of_top import effects_of
    from rotor.quantum.effects.watson import Centrifugal

    effects = effects_of(top, hyperfine, inputs.hyperfine_method, inputs.hyperfine_tolerance)
    return effects if inputs.distortion else tuple(effect for effect in effects if not isinstance(effect, Centrifugal))


def _refuse_method_alone(inputs: HamiltonianInput, subject: Any) -> None:
    if inputs.hyperfine_method != "exact" and not takes_spins(inputs.hyperfine, subject):
        raise ValueError(
            f"hyperfine_method {inputs.hyperfine_method}: without hyperfine or constants of spins nothing is split; add one of them"
        )


def effects_of_each(inputs: HamiltonianInput, subject: Any) -> Any:
    """The Hamiltonian of each of several molecules: tops with constants of spins are split, and a note names the others.

    What is no top, such as the lines of a catalogue, has none.
    """
    from rotor.tops.top import Top

    _refuse_method_alone(inputs, subject)
    molecules: Sequence[Any] = subject.values["molecules"]
    tops = [molecule for molecule in molecules if isinstance(molecule, Top)]
    known, requested = [top for top in tops if top.spin_constants is not None], takes_spins(inputs.hyperfine, subject)
    mixed = requested and 0 < len(known) < len(tops)
    if mixed:
        unsplit = ", ".join(top.name or "a molecule" for top in tops if top.spin_constants is None)
        subject.note(f"--hyperfine: no constants of spins are known of {unsplit}, whose lines are not split")
    plain = HamiltonianInput(distortion=inputs.distortion)

    def effects(molecule: Any) -> tuple[QuantumEffect, ...]:
        if not isinstance(molecule, Top):
            return ()
        split = requested and not (mixed and molecule.spin_constants is None)
        return effects_of_top(inputs if split else plain, molecule, split)

    return tuple(map(effects, molecules))


def saved_of_each(effects: Sequence[Iterable[QuantumEffect]], request: Any) -> HamiltonianInput:
    """What asks for the effects of several molecules again."""
    from rotor.tops.top import Top

    pairs = zip(effects, request.molecules, strict=False)
    saved = [saved_of_top(each, molecule) for each, molecule in pairs if isinstance(molecule, Top)]
    return next((saved_input for saved_input in saved if saved_input.hyperfine is not None), HamiltonianInput())


def effects_of_each_field() -> Any:
    """The field `effects` of a request of several molecules."""
    return part(HamiltonianInput, effects_of_each, saved_of_each, ())


def saved_of_top(effects: Iterable[QuantumEffect], top: Top) -> HamiltonianInput:
    """The input that makes these effects of a top; ValueError for effects that a scene cannot name."""
    by_name = {effect.name: effect for effect in effects}
    if unknown := by_name.keys() - _SPINS - _KNOWN:
        raise ValueError(f"a scene has no name for {', '.join(sorted(unknown))}")
    hyperfine = None if top.spin_constants is None else bool(by_name.keys() & _SPINS)
    distortion, method = "centrifugal distortion" in by_name, by_name.get("hyperfine method")
    if method is None:
        return HamiltonianInput(distortion=distortion, hyperfine=hyperfine)
    from rotor.quantum.hyperfine_method import HyperfineMethod

    assert isinstance(method, HyperfineMethod)
    return HamiltonianInput(distortion, hyperfine, method.method, method.tolerance_mhz)


@dataclass(frozen=True)
class SpinsInput:
    """Whether spins of nuclei take part."""

    hyperfine: bool | None = declared(
        None, Flag(off=True), "Include the spins of nuclei; by default where their constants are given", "effects.hyperfine",
        common=True, example=True,
    )  # fmt: skip


def spins_field() -> Any:
    """The field `hyperfine` of a request: whether spins take part."""

    def split(hyperfine: bool, request: Any) -> SpinsInput:
        return SpinsInput(hyperfine if hyperfine or request.top.spin_constants is not None else None)

    return part(SpinsInput, lambda inputs, subject: takes_spins(inputs.hyperfine, subject), split, False)
