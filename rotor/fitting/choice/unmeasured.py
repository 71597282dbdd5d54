"""Unmeasured lines of the same kinds as the measured ones: candidates for the next measurement."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rotor.arrays import Ints
from rotor.fitting.assignment import Assignments
from rotor.fitting.result import Fit
from rotor.fitting.top_constants import TopConstants
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.spectra.lines import line_list
from rotor.tops.top import Top

_WORTH_MEASURING = 1e-2  # smallest S μ² (D², for μ = 1 D) of a suggested line
_WIDER = 0.01  # fraction by which a line may lie beyond the lowest and highest measured frequency


def measured_range(lines: Assignments) -> tuple[int, tuple[float, float]]:
    """The highest J or N of measured lines, and frequencies a little beyond theirs, within which others are suggested."""
    highest = int(max(lines.upper[:, 0].max(), lines.lower[:, 0].max()))
    low, high = float(lines.frequency_mhz.min()), float(lines.frequency_mhz.max())
    return highest, (low * (1 - _WIDER), high * (1 + _WIDER))


def without_measured(upper: Ints, lower: Ints, lines: Assignments) -> tuple[Ints, Ints]:
    """The labels (n, k) of both states of the lines that are not measured."""
    known = set(zip(map(tuple, lines.upper.tolist()), map(tuple, lines.lower.tolist()), strict=True))
    pairs = zip(map(tuple, upper.tolist()), map(tuple, lower.tolist()), strict=True)
    new = np.array([pair not in known for pair in pairs], dtype=bool)
    return upper[new], lower[new]


def unmeasured(fit: Fit) -> tuple[Ints, Ints]:
    """Labels (n, k) of both states of unmeasured lines, within the kinds, frequencies and J of the measured ones."""
    measured, named = fit.lines, fit.named
    jmax, seen_mhz = measured_range(measured)
    if isinstance(named, TopConstants):
        top, effects = _bright_top(named.top, measured, _components(fit)), named.effects
    else:
        top, effects = Top.from_constants(named, dipole_abc_debye=_components(fit)), SEMI_RIGID
    lines = line_list(top, jmax=jmax, min_lgint=None, q=1.0, range_mhz=seen_mhz, effects=effects)
    strong = lines.strength_debye2 > _WORTH_MEASURING
    labels = np.stack([lines.levels.quanta[name] for name in measured.names], axis=1)
    return without_measured(labels[lines.upper[strong]], labels[lines.lower[strong]], measured)


def _bright_top(top: Top, lines: Assignments, dipole_abc_debye: tuple[float, float, float]) -> Top:
    """The top with this dipole in all states, and 1 D along each axis between states with measured lines."""
    states = top.states
    if states is not None and "v" in lines.names:
        v = lines.names.index("v")
        pairs = {
            (max(a, b), min(a, b)) for a, b in zip(lines.upper[:, v].tolist(), lines.lower[:, v].tolist(), strict=True)
        }
        # nothing is known of these components: all are allowed
        between = {pair: (1.0, 1.0, 1.0) for pair in pairs if pair[0] != pair[1]}
        states = replace(states, dipoles=between)
    return replace(top, dipole_abc_debye=dipole_abc_debye, states=states, symmetry_checked=False)


def _components(fit: Fit) -> tuple[float, float, float]:
    """A dipole of 1 D along each axis with measured lines, judged by the parities of ΔKa and ΔKc."""
    kind = fit.named.kind
    if kind != "asymmetric":
        return (0.0, 0.0, 1.0) if kind == "oblate" else (1.0, 0.0, 0.0)
    # parities: (0, 1) is an a-type, (1, 1) a b-type, (1, 0) a c-type line
    change = (fit.lines.upper[:, 1:3] - fit.lines.lower[:, 1:3]) % 2
    kinds = {(0, 1): 0, (1, 1): 1, (1, 0): 2}
    axes = {kinds.get((int(ka), int(kc)), 0) for ka, kc in change}
    a, b, c = (float(axis in axes) for axis in range(3))
    return a, b, c
