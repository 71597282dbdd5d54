"""Accuracy as an input: the cheapest settings that reach what a scene asks for, and the error that was reached.

| kind | accuracy of | what is chosen | error stated |
|---|---|---|---|
| spectrum, levels, raman | frequencies, energies, shifts, "1 kHz" | spins with known constants, left out if smaller | rounding, and these |
| stark, zeeman | energies, "1 kHz" | tolerance, and with it J max of the basis | by which energies move with a higher J max, round-off |
| align | cosines, 1e-4 | tolerance: steps, J max, populations | step error, edge population, population left out |
| thermo | Q, U and C_v, "0.1 %" | levels summed, or the classical limit with corrections | of the sums |
| tumble | attitude, "1e-6 rad" | tolerance of the steps; free motion is exact | from steps a hundred times finer |
| gas, fluid | see `rotor.scenes.accuracy_sampled` | | |

It is the numerical error with the constants as given. Their own uncertainty, and orders of distortion that they do not have, are
beside it in a plan. What double precision cannot give is refused.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.scenes.kind import quantity
from rotor.scenes.scene import Scene

if TYPE_CHECKING:
    from rotor.quantum.effect import QuantumEffect

ROUNDING = 8 * float(
    np.finfo(np.float64).eps
)  # of an eigenvalue, relative to the largest: a few units in the last place
FINEST_TOLERANCE, FINER, COARSER = 1e-13, 1e-2, 10.0
UNITS = {
    "spectrum": "MHz",
    "levels": "MHz",
    "raman": "MHz",
    "stark": "MHz",
    "zeeman": "MHz",
    "align": "",
    "thermo": "",
    "tumble": "rad",
}
SAMPLED = {"gas": ("K", "%", ""), "fluid": ("K", "%")}  # units, of which each is the accuracy of something else


@dataclass(frozen=True)
class Reached:
    """asked, error: in `unit`. how: which settings were chosen for it."""

    asked: float
    error: float
    unit: str
    how: str


def asked_of(scene: Scene) -> float | None:
    """The accuracy that a scene asks for, in the unit of its kind; None where it asks for none.

    >>> from rotor.scenes.scene import StarkScene, ThermoScene
    >>> asked_of(StarkScene(molecule="OCS", accuracy="1 kHz")), asked_of(ThermoScene(molecule="CO", accuracy="0.1 %"))
    (0.001, 0.001)
    """
    given = getattr(scene, "accuracy", None)
    if given is None:
        return None
    if scene.kind in SAMPLED:
        return _sampled(scene.kind, given)
    text, scale = str(given).strip(), 1.0
    if text.endswith("%"):
        text, scale = text[:-1], 0.01
    if scene.kind == "tumble":
        text = text.removesuffix("rad").strip()
    if scale != 1.0 and scene.kind not in ("thermo", "align"):
        raise ValueError(f"accuracy: {given!r}: expected {UNITS[scene.kind]}, not a percentage")
    unit = UNITS[scene.kind] if UNITS[scene.kind] == "MHz" else ""
    value = scale * quantity("accuracy", text, unit)
    if not value > 0.0:
        raise ValueError(f"accuracy: {given!r}: expected more than 0")
    return value


def unit_of(scene: Scene) -> str:
    """The unit of the accuracy of a scene.

    >>> from rotor.scenes.scene import GasScene
    >>> [unit_of(GasScene(molecule="water", accuracy=one)) for one in ("1 K", "0.1 %", 0.02)]
    ['K', '%', '']
    """
    if scene.kind not in SAMPLED:
        return UNITS[scene.kind]
    text = str(getattr(scene, "accuracy", "")).strip()
    return "%" if text.endswith("%") else "" if _is_number(text) else "K"


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _sampled(kind: str, given: str | float) -> float:
    """The accuracy of a gas or fluid in K, percent, or as a number.

    Raises ValueError for a unit that the kind has not.
    """
    text = str(given).strip()
    if _is_number(text) and "" not in SAMPLED[kind]:
        raise ValueError(f"accuracy: {given!r}: expected a unit: K of the conserved energy, or % of the forces")
    percent = text.endswith("%")
    value = quantity("accuracy", text.removesuffix("%"), "" if percent or _is_number(text) else "K")
    if not value > 0.0:
        raise ValueError(f"accuracy: {given!r}: expected more than 0")
    return value


def chosen(scene: Scene, request: Any) -> tuple[Any, str]:
    """The request with the cheapest settings that reach the accuracy of its scene, and what was chosen.

    Raises ValueError for what double precision cannot give, and where a knob is given by hand as well.
    """
    asked = asked_of(scene)
    assert asked is not None
    return _CHOICES[scene.kind](scene, request, asked)


def reached(scene: Scene, answer: Any, how: str) -> Reached:
    """The error that an answer reached; ValueError where it is more than what was asked for, with the reason."""
    asked = asked_of(scene)
    assert asked is not None
    unit = unit_of(scene)
    error = _sampled_error(scene.kind, answer, unit) if scene.kind in SAMPLED else _ERRORS[scene.kind](answer)
    if error > asked:
        raise ValueError(
            f"accuracy: {asked:g} {unit}".rstrip() + f" cannot be given: the error here is {error:.2g} ({how})"
        )
    return Reached(asked, error, unit, how)


def _sampled_error(kind: str, answer: Any, unit: str) -> float:
    from rotor.scenes.accuracy_sampled import error_of_fluid, error_of_gas

    return error_of_gas(answer, unit) if kind == "gas" else error_of_fluid(answer, unit)


def _gas(scene: Any, request: Any, asked: float) -> tuple[Any, str]:
    from rotor.scenes.accuracy_sampled import choose_molecules

    return choose_molecules(scene, request, asked, unit_of(scene))


def _fluid(scene: Any, request: Any, asked: float) -> tuple[Any, str]:
    from rotor.scenes.accuracy_sampled import choose_step

    return choose_step(scene, request, asked, unit_of(scene))


def _spectrum(scene: Any, request: Any, asked: float) -> tuple[Any, str]:
    """Spins whose constants are known are taken where they are larger than what was asked for."""
    if scene.effects.hyperfine is not None or request.top.spin_constants is None:
        return request, "exact: nothing cheaper"
    from rotor.quantum.effects.of_top import effects_of

    size = _spin_size(request.top, request.effects)
    if size <= asked:
        return request, f"spins of nuclei left out, {size:.2g} MHz"
    if any(effect.spins(request.top) for effect in request.effects):
        return request, "with spins of nuclei: exact, nothing cheaper"
    return replace(request, effects=effects_of(request.top, True)), f"with spins of nuclei, {size:.2g} MHz"


def _spin_size(top: Any, present: tuple[QuantumEffect, ...]) -> float:
    """The largest size of known couplings of spins at J = 1."""
    from rotor.quantum.effects.of_top import spin_effects

    return max((effect.size_mhz(top, 1) for effect in spin_effects(top)), default=0.0)


def _levels_error(top: Any, levels: Any) -> float:
    """Rounding of the largest energy, and the size of known spins that are left out."""
    rounding = ROUNDING * float(np.abs(levels.energy_mhz).max(initial=0.0))
    has_spins = any(effect.spins(top) for effect in levels.effects)
    left = 0.0 if has_spins or top.spin_constants is None else _spin_size(top, levels.effects)
    return rounding + left


def _tolerance(name: str, default: Any, least: float) -> Callable[[Any, Any, float], tuple[Any, str]]:
    """A choice that hands what was asked for to one field of the request."""

    def choose(scene: Any, request: Any, asked: float) -> tuple[Any, str]:
        key = {"tolerance_mhz": "tolerance"}.get(name, name)
        if getattr(scene.numerics, key) != default:
            raise ValueError(f"accuracy and numerics.{key}: give one of them")
        if asked < least:
            raise ValueError(f"accuracy: {asked:g}: the finest that is possible here is {least:g}")
        return replace(request, **{name: asked}), f"{key} {asked:g}"

    return choose


def _tumble(scene: Any, request: Any, asked: float) -> tuple[Any, str]:
    """The loosest tolerance whose motion differs by less than asked from one with a tolerance a hundred times finer."""
    from rotor.classical.driven import DEFAULT_TOLERANCE, DrivenRequest

    if not isinstance(request, DrivenRequest):
        return request, "exact: nothing cheaper"
    if scene.numerics.tolerance != DEFAULT_TOLERANCE or scene.numerics.step is not None:
        raise ValueError("accuracy and numerics: give one of them")
    tolerance, error = min(max(asked, FINEST_TOLERANCE), 1e-3), 0.0
    while tolerance >= FINEST_TOLERANCE:
        error = _step_error(request, tolerance)
        if error <= asked:
            return replace(request, tolerance=tolerance), f"tolerance {tolerance:.1g} of a step"
        tolerance /= COARSER
    raise ValueError(
        f"accuracy: {asked:g} rad cannot be given: steps to {FINEST_TOLERANCE:g} still differ by {error:.2g} rad at the end, the motion is "
        "chaotic or too long for double precision; ask for less, or for a shorter time"
    )


def _step_error(request: Any, tolerance: float) -> float:
    """The largest difference of attitude, in radians, from steps that are a hundred times finer."""
    from rotor.classical.driven import answer_driven
    from rotor.geometry.rotations import distance

    coarse, fine = (
        answer_driven(replace(request, tolerance=one)).motion
        for one in (tolerance, max(FINER * tolerance, 0.1 * FINEST_TOLERANCE))
    )
    return float(np.max(distance(coarse.attitude, fine.attitude)))


def _tumble_error(answer: Any) -> float:
    from rotor.classical.tumble import TumbleAnswer

    if not isinstance(answer, TumbleAnswer):
        return _step_error(answer.request, answer.request.tolerance)
    turned = (
        float(answer.motion.turning_rate) * float(np.abs(answer.table.times).max()) / answer.request.units.time_factor
    )
    return ROUNDING * max(turned, 1.0)


def _stark(scene: Scene, request: Any, asked: float) -> tuple[Any, str]:
    """Energies alone decide: the population at the edge of the basis, which cosines need, is reported and not limited."""
    found, how = _tolerance("tolerance_mhz", "1e-4 MHz", 1e-9)(scene, request, asked)
    return replace(found, most_at_edge=1.0), how


_CHOICES: dict[str, Callable[[Any, Any, float], tuple[Any, str]]] = {
    "spectrum": _spectrum,
    "levels": _spectrum,
    "raman": _spectrum,
    "gas": _gas,
    "fluid": _fluid,
    "stark": _stark,
    "zeeman": _tolerance("tolerance_mhz", "1e-6 MHz", 1e-9),
    "align": _tolerance("tolerance", 1e-6, 1e-11),
    "thermo": _tolerance("relative_error", 1e-6, 1e-13),
    "tumble": _tumble,
}
_ERRORS: dict[str, Callable[[Any], float]] = {
    "spectrum": lambda answer: _levels_error(answer.lines.top, answer.lines.levels),
    "levels": lambda answer: _levels_error(answer.request.top, answer.table.levels),
    "raman": lambda answer: _levels_error(answer.lines.top, answer.lines.levels),
    "stark": lambda answer: float(answer.states.accuracy_mhz),
    "zeeman": lambda answer: float(answer.states.accuracy_mhz),
    "align": lambda answer: float(answer.trace.error_estimate),
    "thermo": lambda answer: float(answer.functions.relative_error.max()),
    "tumble": _tumble_error,
}
