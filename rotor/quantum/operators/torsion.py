"""Operators of an angle α on free-rotor functions exp(i m α)/√2π, m = n k + σ: the labels k count from the species σ of an n-fold top."""

from __future__ import annotations

from functools import cache

from rotor.quantum.operators.algebra import Operator, diagonal, shift


@cache  # the same object each time: sums of terms are merged by their operator of the torsion
def p_alpha(sigma: int, power: int = 1, fold: int = 3, label: str = "k") -> Operator:
    """p^r = (-i d/dα)^r, m^r on exp(i m α)."""
    return diagonal(lambda labels: (fold * labels[label] + float(sigma)) ** power)


@cache
def cosine(multiple: int, label: str = "k") -> Operator:
    """cos(n s α) of an n-fold top for s = `multiple`: half of each shift of k by ±s."""
    return 0.5 * (_step(multiple, label) + _step(-multiple, label))


@cache
def sine(multiple: int, label: str = "k") -> Operator:
    """sin(n s α) = (exp(i n s α) - exp(-i n s α))/2i."""
    return -0.5j * (_step(multiple, label) - _step(-multiple, label))


def _step(multiple: int, label: str) -> Operator:
    return shift(lambda labels: 1.0, **{label: multiple})
