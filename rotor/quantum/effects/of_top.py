"""Effects that follow from the named constants of a top: spins, further states, internal rotation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from rotor.checks import did_you_mean, first_names
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.hyperfine_method import EXACT, TOLERANCE_MHZ, HyperfineMethod
from rotor.tops.constants.parameter_names import parse_name

if TYPE_CHECKING:
    from rotor.quantum.effects.spin_effect import SpinEffect
    from rotor.tops.spins.spin_constants import SpinConstants
    from rotor.tops.spins.spin_weights import SpinWeights
    from rotor.tops.top import Top


def spin_effects(top: Top) -> tuple[QuantumEffect, ...]:
    """Quadrupole, spin-rotation and spin-spin coupling of a top, from its spin constants.

    Raises ValueError for an unknown name, for like nuclei whose exchange the spin weights count already, and for a tensor that a linear
    molecule cannot have.

    >>> from rotor.tops.spins.spin_constants import SpinConstants
    >>> from rotor.tops.top import Top
    >>> top = Top.from_constants("B=44316 MHz", spin_constants=SpinConstants.parse("chi_aa(14N)=-4.7 MHz"))
    >>> [effect.name for effect in spin_effects(top)]
    ['nuclear quadrupole']
    """
    constants = top.spin_constants
    if constants is None:
        return ()
    _refuse_like_nuclei(top, constants)
    _refuse_unknown_states(top, constants)
    if top.kind == "linear":
        _refuse_across_a_line(constants)
    return _effects(constants)


def _effects(constants: SpinConstants) -> tuple[QuantumEffect, ...]:
    """Effects of spin constants, each with its parameters."""
    from rotor.quantum.effects.spin_effect import NuclearQuadrupole, SpinRotation, SpinSpin
    from rotor.quantum.spins.scheme import Spin

    kinds: tuple[type[SpinEffect], ...] = (NuclearQuadrupole, SpinRotation, SpinSpin)
    spins = tuple(
        Spin(name, twice, name.startswith("S"), constants.totals.get(name, ""))
        for name, twice in constants.twice.items()
    )
    values: dict[type[SpinEffect], dict[str, float]] = {}
    kind_of = {symbol: kind for kind in kinds for symbol in kind.symbols}
    for name, value in constants.values.items():
        symbol = parse_name(name).symbol if name.startswith(tuple(kind_of)) else ""
        if symbol not in kind_of:
            hint = did_you_mean(name.partition("(")[0], kind_of)
            raise ValueError(f"{name}: known constants of spins are {first_names(kind_of)}{hint}")
        values.setdefault(kind_of[symbol], {})[name] = value
    return tuple(kind(values[kind], spins) for kind in kinds if kind in values)


def _refuse_unknown_states(top: Top, constants: SpinConstants) -> None:
    """Raise ValueError for a spin constant of a state that the top does not have."""
    count = top.state_count
    for name in constants.values:
        states = parse_name(name).states
        if states and states[1] >= count:
            raise ValueError(
                f"{name}: there is no state {states[1]}; {top.name or 'this top'} has {count}, counted from 0"
            )


def _refuse_across_a_line(constants: SpinConstants) -> None:
    """Raise ValueError if a tensor of a linear molecule, whose axis is a, differs along b and c."""
    values = {parse_name(name): value for name, value in constants.values.items()}
    for parts, value in values.items():
        tensor, _, letters = parts.symbol.partition("_")
        if value and len(set(letters) - {"-"}) > 1 and set(letters) <= set("abc-"):
            raise ValueError(
                f"{parts.text} = {value:g} MHz: a linear molecule has none, its tensors are alike along b and c; leave it out"
            )
        if tensor in ("C", "eps") and letters in ("bb", "cc"):
            twin = parts._replace(symbol=f"{tensor}_{'cc' if letters == 'bb' else 'bb'}")
            if values.get(twin, 0.0) != value:
                scalar = parts._replace(symbol=f"{tensor}_iso").text
                raise ValueError(
                    f"{parts.text} = {value:g} MHz and {twin.text} = {values.get(twin, 0.0):g} MHz: alike in a linear molecule; give "
                    f"both the same value, or {scalar} alone"
                )


def _refuse_weights_of_the_pair(top: Top, constants: SpinConstants, weights: SpinWeights) -> None:
    """Raise ValueError if spin weights count two nuclei that have a total spin.

    A geometry decides this. Without one, weights that equal those of the two nuclei are assumed to count them, unless they are stated to be
    those of the other nuclei.
    """
    from rotor.tops.spins.spin_statistics import statistical_weights

    twice = constants.twice[next(iter(constants.totals))]
    all_nuclei = None if top.molecule is None else statistical_weights(top.molecule)
    if weights.with_pair(twice) == all_nuclei:
        return
    if weights == all_nuclei or (weights.fits_pair(twice) and not constants.weights_of_others):
        raise ValueError(
            f"{' and '.join(constants.totals)} in a total spin: the spin weights of {top.name or 'this top'} count their "
            f"{(twice + 1) ** 2} functions already; give weights of the other nuclei alone: of two, 1 to levels of even total spin, "
            '0 to others; where these are those of the others, say so in a file: weights = "other nuclei" in [spins]'
        )


def _refuse_like_nuclei(top: Top, constants: SpinConstants) -> None:
    """Raise ValueError if spin weights count the exchange of like nuclei that are coupled one by one."""
    all_weights = [top.spin_weights, *(top.states.weights.values() if top.states else ())]
    all_weights = [weights for weights in all_weights if weights.rule != "none"]
    pair = constants.totals if len(constants.totals) == 2 else ()
    for weights in all_weights if pair else ():
        _refuse_weights_of_the_pair(top, constants, weights)
    labels = [name.partition("_")[0] for name in constants.twice if name not in pair]
    like = [label for label in dict.fromkeys(labels) if labels.count(label) > 1]
    if like and all_weights:
        raise ValueError(
            f"spins of several {like[0]}: the spin weights of {top.name or 'this top'} count their exchange already; give the "
            "weights without them, or an .int and .var file with equivalent nuclei"
        )


def with_states(top: Top, effects: tuple[QuantumEffect, ...]) -> tuple[Top, tuple[QuantumEffect, ...]]:
    """The top with the spin weights of its state v = 0, and the effects of a calculation with all its states.

    States v ≥ 1 and internal rotation are added to the semi-rigid effects; any other effects remain unchanged.
    """
    if effects == SEMI_RIGID:
        effects = effects_of(top, False)
    if top.states is None:
        return top, effects
    weights = top.states.weights.get(0, top.spin_weights)
    return replace(top, spin_weights=weights, symmetry_checked=False), effects


def effects_of(
    top: Top, hyperfine: bool, method: str = "exact", tolerance_mhz: float = TOLERANCE_MHZ
) -> tuple[QuantumEffect, ...]:
    """The effects of a top: semi-rigid Hamiltonian, all states, internal rotation, and optionally spins.

    Parameters
    ----------
    top : Top
        Constants of the rotation, of states, internal rotation and spins.
    hyperfine : bool
        Whether spins are included.
    method : str
        "exact", "N-diagonal", "first-order", or "auto", the cheapest treatment whose estimated error is within the tolerance; see
        `rotor.quantum.hyperfine_method`.
    tolerance_mhz : float
        Largest error of lines with "auto".

    Returns
    -------
    tuple of QuantumEffect
        Effects for `solve_levels`, `line_list` and others.

    Raises
    ------
    ValueError
        If spins are requested and the top has no spin constants.
    """
    effects = SEMI_RIGID
    if top.states is not None:
        from rotor.quantum.effects.interactions import InteractingStates

        effects = (*effects, InteractingStates(top.states.values, top.states.weights, top.states.dipoles))
    if top.internal_rotation is not None:
        from rotor.quantum.effects.internal_rotation import InternalRotation

        effects = (*effects, InternalRotation(top.internal_rotation))
    if not hyperfine:
        return effects
    effects_of_spins = spin_effects(top)
    if not effects_of_spins:
        raise ValueError(
            f"{top.name or 'this top'}: no constants of spins are known, which hyperfine structure needs; give them as spin_constants "
            "(--spin-constants), such as chi_aa(14N)=-4.2 MHz"
        )
    return (*effects, *effects_of_spins, *_method(top, effects_of_spins, method, tolerance_mhz))


def _method(top: Top, effects: Sequence[QuantumEffect], method: str, tolerance_mhz: float) -> tuple[QuantumEffect, ...]:
    """The treatment of spins as an effect; empty for the exact one."""
    spins = {spin.name: spin for effect in effects for spin in effect.spins(top)}
    requested = HyperfineMethod(method, tolerance_mhz, tuple(spins.values()))
    return () if method == EXACT else (requested,)
