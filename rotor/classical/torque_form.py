"""Compiled forms of effects: a code and parameters for each torque that compiled integrators evaluate.

| code | torque in body axes | parameters |
|---|---|---|
| `BODY_FIXED` | v cos(Ω t + φ) | v, Ω, φ |
| `SPACE_FIXED` | Rᵀ v cos(Ω t + φ) | v, Ω, φ |
| `LEVER` | a x Rᵀ f | a of the body, f of space |
| `INDUCED` | (M e) x e, e = Rᵀ f | M by rows, f of space |
| `TURNING` | (M e) x e, e = Rᵀ (cos φ, sin φ, 0), φ = φ0 + Ω t + β t²/2 | M by rows, φ0, Ω, β |
| `LINEAR` | -C ω | C by rows |
| `QUADRATIC` | -c \\|ω\\| ω | c |
| `ROLLING` | that of `effects/rolling.py`, with its inertia | m, m g, μ of space, c, S² by rows |

R takes body axes to space. An effect returns its form from `compiled_form`; its `torque` is the plain form. Effects without a compiled
form are called at each step. The kernels are in `integrators/_torque_kernels.py`.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats

BODY_FIXED, SPACE_FIXED, LEVER, INDUCED, LINEAR, QUADRATIC, ROLLING, TURNING = range(8)
WIDTH = 12  # parameters of the longest form, except rolling, which has separate arrays


class TorqueForm(NamedTuple):
    """One torque: its code and its parameters, at most `WIDTH` numbers."""

    code: int
    parameters: tuple[float, ...]


class SystemForm(NamedTuple):
    """The effects on a body: codes (k,), parameters (k, WIDTH), and the sum h (3,) of inner momenta."""

    codes: NDArray[np.int64]
    parameters: Floats
    inner: Floats


def torque_form(code: int, *parts: ArrayLike) -> TorqueForm:
    """A form from its parameters: numbers, vectors and matrices, one after another.

    >>> torque_form(LEVER, [1.0, 0.0, 0.0], [0.0, 0.0, 2.0]).parameters
    (1.0, 0.0, 0.0, 0.0, 0.0, 2.0)
    """
    return TorqueForm(code, tuple(np.concatenate([np.ravel(part) for part in parts]).tolist()))


def kernels_are_compiled() -> bool:
    """False if NUMBA_DISABLE_JIT selects plain Python, in which the loop of a kernel is slower than numpy."""
    return os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0")


def compiled_form(effect: Any, plain: str) -> Any:
    """The compiled form of an effect if its class defines both this form and the plain method `plain`; otherwise None.

    A class that overrides only the plain method would inherit the form of another torque.
    """
    for kind in type(effect).__mro__:
        if plain in vars(kind):
            return effect.compiled_form() if "compiled_form" in vars(kind) else None
    return None


def rolling_forms(added: Iterable[Any]) -> Floats | None:
    """Parameters (k, 17) of rolling contacts from effects that add inertia; None if one of them is not rolling."""
    effects = list(added)
    forms = [(compiled_form(effect, "inertia"), compiled_form(effect, "torque")) for effect in effects]
    if any(form is None or form.code != ROLLING for pair in forms for form in pair):
        return None
    return np.array([form.parameters for form, _ in forms])


def system_form(torques: Iterable[Any], inner: Iterable[Any]) -> SystemForm | None:
    """The combined form of torques and inner momenta; None if one of them has no compiled form."""
    forms, momenta = (
        [compiled_form(t, "torque") for t in torques],
        [compiled_form(h, "inner_momentum") for h in inner],
    )
    if any(form is None for form in (*forms, *momenta)):
        return None
    parameters = np.zeros((len(forms), WIDTH))
    for row, form in zip(parameters, forms, strict=True):
        row[: len(form.parameters)] = form.parameters
    codes = np.array([form.code for form in forms], dtype=np.int64)
    return SystemForm(codes, parameters, np.sum([np.zeros(3), *momenta], axis=0))
