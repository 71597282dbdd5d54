"""Operators of an angle α on free-rotor functions exp(i m α)/√2π, m = 3k + σ: the labels k count from the species σ of a threefold top."""

from __future__ import annotations

from functools import cache

from rotor.quantum.operators.algebra import Operator, diagonal, shift


@cache  # the same object each time: sums of terms are merged by their operator of the torsion
def p_alpha(sigma: int, power: int = 1) -> Operator:
    """p^r = (-i d/dα)^r, m^r on exp(i m α)."""
    return diagonal(lambda labels: (3 * labels["k"] + float(sigma)) ** power)


@cache
def cosine(multiple: int) -> Operator:
    """cos 3sα for s = `multiple`: half of each shift of k by ±s."""
    return 0.5 * (_step(multiple) + _step(-multiple))


@cache
def sine(multiple: int) -> Operator:
    """sin 3sα = (exp(3isα) - exp(-3isα))/2i."""
    return -0.5j * (_step(multiple) - _step(-multiple))


def _step(multiple: int) -> Operator:
    return shift(lambda labels: 1.0, k=multiple)
