"""Accuracy as an input: the cheapest settings that reach what a scene asks for, and the error that was reached.

| kind | accuracy of | what is chosen | error stated |
|---|---|---|---|
| spectrum | frequencies, such as "1 kHz" | spins whose constants are known, left out if smaller | rounding, and spins left out |
| stark | energies, "1 kHz" | tolerance, and with it J max of the basis | by which energies move with a higher J max |
| align | cosines, 1e-4 | tolerance: steps, J max, populations | step error, edge population, population left out |
| thermo | Q, U and C_v, "0.1 %" | levels summed, or the classical limit with corrections | of the sums |
| tumble | attitude, "1e-6 rad" | tolerance of the steps; free motion is exact | from steps a hundred times finer |

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
UNITS = {"spectrum": "MHz", "stark": "MHz", "align": "", "thermo": "", "tumble": "rad"}


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
    error = _ERRORS[scene.kind](answer)
    if error > asked:
        raise ValueError(
            f"accuracy: {asked:g} {UNITS[scene.kind]}".rstrip()
            + f" cannot be given: the error here is {error:.2g} ({how})"
        )
    return Reached(asked, error, UNITS[scene.kind], how)


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


def _spectrum_error(answer: Any) -> float:
    lines = answer.lines
    rounding = ROUNDING * float(np.abs(lines.levels.energy_mhz).max(initial=0.0))
    has_spins = any(effect.spins(lines.top) for effect in lines.levels.effects)
    left = 0.0 if has_spins or lines.top.spin_constants is None else _spin_size(lines.top, lines.levels.effects)
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


_CHOICES: dict[str, Callable[[Any, Any, float], tuple[Any, str]]] = {
    "spectrum": _spectrum,
    "stark": _tolerance("tolerance_mhz", "1e-4 MHz", 1e-9),
    "align": _tolerance("tolerance", 1e-6, 1e-11),
    "thermo": _tolerance("relative_error", 1e-6, 1e-13),
    "tumble": _tumble,
}
_ERRORS: dict[str, Callable[[Any], float]] = {
    "spectrum": _spectrum_error,
    "stark": lambda answer: float(answer.facts()["accuracy_mhz"]),
    "align": lambda answer: float(answer.facts()["error_estimate"]),
    "thermo": lambda answer: float(answer.functions.relative_error.max()),
    "tumble": _tumble_error,
}
