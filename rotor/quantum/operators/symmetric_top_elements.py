"""Elements of a tensor between functions |J k⟩ of a symmetric top: closed forms up to rank 2, a 3j symbol above.

Phases and normalisation are those of `tensors`, which puts Wang blocks together of these.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats
from rotor.quantum.operators.wigner import three_j


def coupling(j_low: float, j_up: float, rank: int, q: int, k: ArrayLike) -> Floats:
    """√((2J'+1)(2J+1)) (-1)^(J'-k') (J' K J; -k' q k) from k to k' = k + q: √(2J+1) ⟨J k K q|J' k'⟩; 0 where k or k' do not exist.

    For K ≤ 2 in closed forms: K = 1 as the direction cosines of P. C. Cross, R. M. Hainer and G. W. King, J. Chem.
    Phys. 12, 210 (1944), table I; K = 2 from D. A. Varshalovich, A. N. Moskalev and V. K. Khersonskii, Quantum Theory
    of Angular Momentum, 1988, table 8.4. Else from `three_j`. J' < J and q < 0 follow from

        c(J → J', q, k) = (-1)^(J'-J-q) c(J' → J, -q, k+q) = (-1)^(J'-J-K) c(J → J', -q, -k).

    >>> round(float(coupling(1, 3, 2, 0, 0)) ** 2, 6)  # (3/2) (J+1)(J+2)/(2J+3) of a linear molecule
    1.8
    """
    return coupling_to(j_low, int(j_up - j_low), rank, q, k)


def coupling_to(j: ArrayLike, rise: int, rank: int, q: int, k: ArrayLike) -> Floats:
    """`coupling` from J to J' = J + `rise`, arrays of J and k that broadcast."""
    j, k = np.asarray(j, dtype=float), np.asarray(k, dtype=float)
    closes = 2 * j + rise >= rank
    exists = (np.abs(k) <= j) & (np.abs(k + q) <= j + rise) & closes
    if max(abs(rise), abs(q)) > rank:
        return np.zeros(exists.shape)
    # a J and k that exist in place of others; J may be half an odd number
    low = np.where(closes, j, (rank - rise + 1) // 2)
    inside = np.where(exists, k, np.maximum(-low, -low - rise - q))
    if rank <= 2:
        values = closed_coupling(low, rise, rank, q, inside)
    else:
        root = np.sqrt((2 * (low + rise) + 1) * (2 * low + 1))
        sign = np.where((low + rise - inside - q) % 2, -1.0, 1.0)
        values = sign * root * three_j(low + rise, rank, low, -inside - q, q, inside)
    return np.where(exists, values, 0.0)


def wang_coupling(j: ArrayLike, rise: int, rank: int, step: int, k: NDArray[Any]) -> Floats:
    """`coupling_to` between functions of K, times √2 where one of K and K + step is 0."""
    values = coupling_to(j, rise, rank, step, k)
    return values * np.where((k == 0) | (k + step == 0), np.sqrt(2.0), 1.0) if step else values


def closed_coupling(j: float | Floats, rise: int, rank: int, q: int, k: Floats) -> Floats:
    """`coupling` (n,) of rank 0, 1 or 2 to J' = J + `rise`, for k and k + q that exist; one J for all k or one for each."""
    if rise < 0:
        return sign_of(rise - q) * closed_coupling(j + rise, -rise, rank, -q, k + q)
    if q < 0:
        return sign_of(rise - rank) * closed_coupling(j, rise, rank, -q, -k)
    if rank == 0:
        return np.sqrt(2 * j + 1.0) + np.zeros(k.shape)
    if rank == 1:
        return _vector_up(j, k, q) if rise else _vector_level(j, k, q)
    return (_tensor_level, _tensor_one_up, _tensor_two_up)[rise](j, k, q)


def sign_of(power: int) -> float:
    """(-1)^power."""
    return -1.0 if power % 2 else 1.0


def _vector_up(j: float | Floats, k: Floats, q: int) -> Floats:
    if q == 0:
        return np.asarray(np.sqrt((j - k + 1) * (j + k + 1) / (j + 1)))
    return np.asarray(np.sqrt((j + k + 1) * (j + k + 2) / (2 * (j + 1))))


def _vector_level(j: float | Floats, k: Floats, q: int) -> Floats:
    if q == 0:
        return np.asarray(k * np.sqrt((2 * j + 1) / (j * (j + 1))))
    return np.asarray(-np.sqrt((j - k) * (j + k + 1) * ((2 * j + 1) / (2 * j * (j + 1)))))


def _tensor_two_up(j: float | Floats, k: Floats, q: int) -> Floats:
    if q == 0:
        above = 1.5 * (j - k + 1) * (j - k + 2) * (j + k + 1) * (j + k + 2)
    elif q == 1:
        above = (j - k + 1) * (j + k + 1) * (j + k + 2) * (j + k + 3)
    else:
        above = 0.25 * (j + k + 1) * (j + k + 2) * (j + k + 3) * (j + k + 4)
    return np.asarray(np.sqrt(above / ((j + 1.0) * (2 * j + 3) * (j + 2))))


def _tensor_one_up(j: float | Floats, k: Floats, q: int) -> Floats:
    norm = 2.0 * j * (j + 1) * (j + 2)
    if q == 0:
        return np.asarray(k * np.sqrt(6 * (j - k + 1) * (j + k + 1) / norm))
    if q == 1:
        return np.asarray((2 * k - j) * np.sqrt((j + k + 1) * (j + k + 2) / norm))
    return np.asarray(-np.sqrt((j - k) * (j + k + 1) * (j + k + 2) * (j + k + 3) / norm))


def _tensor_level(j: float | Floats, k: Floats, q: int) -> Floats:
    norm = (2 * j - 1) * 2.0 * j * (j + 1) * (2 * j + 3) / (2 * j + 1)
    if q == 0:
        return np.asarray((3 * k * k - j * (j + 1)) * np.sqrt(2 / norm))
    if q == 1:
        return np.asarray(-(2 * k + 1) * np.sqrt(3 * (j - k) * (j + k + 1) / norm))
    return np.asarray(np.sqrt(3 * (j - k) * (j - k - 1) * (j + k + 1) * (j + k + 2) / norm))


def space_factor(twice_up: int, twice_low: int, rank: int, twice_m: int, q: int = 0) -> float:
    """(-1)^(F'-M') (F' K F; -M' q M) of doubled F', F and M, M' = M + q; 0 where a rule forbids it.

    ⟨F'τ'M'|T^K_q|F τ M⟩ is this times ⟨F'τ'‖T^K‖F τ⟩ (R. N. Zare, Angular Momentum, 1988, eq. 5.14), whatever was contracted into τ.

    >>> round(space_factor(2, 0, 1, 0), 6)  # 1/√3
    0.57735
    """
    if abs(twice_m) > twice_low or abs(twice_m + 2 * q) > twice_up:
        return 0.0
    return float(_factors(twice_up, twice_low, rank, q)[(twice_low + twice_m) // 2])


@lru_cache(maxsize=8192)
def _factors(twice_up: int, twice_low: int, rank: int, q: int) -> Floats:
    """Of M = -F ... F."""
    m = np.arange(-twice_low, twice_low + 1, 2) / 2
    j_up, j_low = (twice // 2 if twice % 2 == 0 else twice / 2 for twice in (twice_up, twice_low))
    return np.asarray(coupling(j_low, j_up, rank, q, m) / np.sqrt((twice_up + 1.0) * (twice_low + 1)))
