"""Slow, independent matrices of a rotor |N k m>: molecule-fixed angular momenta and direction cosines, nothing factorised.

The quantisation axis z of the molecule is a or c, and x, y complete a right-handed frame. Molecule-fixed components obey
[Nx, Ny] = -i Nz, so that Nx - i Ny raises k. A tensor of the molecule has space-fixed components T_p = Σ_q D^K*_pq T_q,
⟨N'k'm'|D^K*_pq|N k m⟩ = (-1)^(m'-k') √((2N'+1)(2N+1)) (N' K N; -m' p m)(N' K N; -k' q k)
(R. N. Zare, Angular Momentum, Wiley 1988, eq. 3.118 conjugated). A space-fixed operator X of rank K is written as a
molecule-fixed product, taken for p = 0 at one m, and divided by its 3j symbol: that is the reduced matrix of X
(Wigner-Eckart), whatever X is made of.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from math import factorial, sqrt

import numpy as np

FRAMES = {"a": "bca", "c": "abc"}  # right-handed axes (x, y, z) for z = a and z = c


def _square_root(value: Fraction) -> float:
    """Of numbers whose parts may be beyond a float."""
    shift = max(value.numerator.bit_length(), value.denominator.bit_length()) - 900
    if shift <= 0:
        return sqrt(value)
    return sqrt(value.numerator / value.denominator)


def _triangle(a: int, b: int, c: int) -> Fraction:
    """Racah's Δ(abc)², doubled arguments."""
    top = factorial((a + b - c) // 2) * factorial((a - b + c) // 2) * factorial((b + c - a) // 2)
    return Fraction(top, factorial((a + b + c) // 2 + 1))


def _closes(a: int, b: int, c: int) -> bool:
    return abs(a - b) <= c <= a + b and (a + b + c) % 2 == 0


@cache
def wigner_3j(j1: int, j2: int, j3: int, m1: int, m2: int, m3: int) -> float:
    """3j symbol of doubled arguments, Racah's sum in fractions (Zare eq. 2.36)."""
    pairs = ((j1, m1), (j2, m2), (j3, m3))
    if m1 + m2 + m3 or not _closes(j1, j2, j3) or any(abs(m) > j for j, m in pairs):
        return 0.0
    total = Fraction(0)
    for t in range(max(0, (j2 - j3 - m1) // 2, (j1 - j3 + m2) // 2), (j1 + j2 - j3) // 2 + 1):
        parts = (t, (j1 + j2 - j3) // 2 - t, (j1 - m1) // 2 - t, (j2 + m2) // 2 - t)
        parts += ((j3 - j2 + m1) // 2 + t, (j3 - j1 - m2) // 2 + t)
        if min(parts) >= 0:
            total += Fraction((-1) ** t, int(np.prod([factorial(p) for p in parts], dtype=object)))
    if not total:
        return 0.0
    outer = _triangle(j1, j2, j3)
    for j, m in pairs:
        outer *= factorial((j + m) // 2) * factorial((j - m) // 2)
    sign = (-1) ** ((j1 - j2 - m3) // 2) * (1 if total > 0 else -1)
    return sign * _square_root(outer * total**2)


@cache
def wigner_6j(a: int, b: int, c: int, d: int, e: int, f: int) -> float:
    """6j symbol {a b c; d e f} of doubled arguments, Racah's sum in fractions (Zare eq. 4.15)."""
    triads = ((a, b, c), (a, e, f), (d, b, f), (d, e, c))
    if not all(_closes(*triad) for triad in triads):
        return 0.0
    low = max(sum(triad) // 2 for triad in triads)
    high = min((a + b + d + e) // 2, (b + c + e + f) // 2, (c + a + f + d) // 2)
    total = Fraction(0)
    for t in range(low, high + 1):
        parts = [t - sum(triad) // 2 for triad in triads]
        parts += [(a + b + d + e) // 2 - t, (b + c + e + f) // 2 - t, (c + a + f + d) // 2 - t]
        total += Fraction((-1) ** t * factorial(t + 1), int(np.prod([factorial(p) for p in parts], dtype=object)))
    if not total:
        return 0.0
    outer = Fraction(1)
    for triad in triads:
        outer *= _triangle(*triad)
    return (1 if total > 0 else -1) * _square_root(outer * total**2)


@cache
def wigner_9j(rows: tuple[tuple[int, int, int], ...]) -> float:
    """9j symbol of doubled arguments as a sum over three 6j symbols (Zare eq. 4.24)."""
    (a, b, c), (d, e, f), (g, h, i) = rows
    total = 0.0
    for x in range(max(abs(a - i), abs(d - h), abs(b - f)), min(a + i, d + h, b + f) + 1):
        if _closes(a, i, x) and _closes(d, h, x) and _closes(b, f, x):
            product = wigner_6j(a, b, c, f, i, x) * wigner_6j(d, e, f, b, x, h) * wigner_6j(g, h, i, x, a, d)
            total += (-1) ** x * (x + 1) * product
    return total


@cache
def momenta(n: int, z: str) -> dict[str, np.ndarray]:
    """Na, Nb, Nc on |N k>, k = -N ... N (last axis first: row k', column k), for the axis z."""
    k = np.arange(-n, n + 1.0)
    up = np.diag(np.sqrt(n * (n + 1) - k[:-1] * (k[:-1] + 1)), -1).astype(complex)  # Nx - i Ny
    down = up.conj().T
    x, y = (up + down) / 2, 1j * (up - down) / 2
    return dict(zip(FRAMES[z], (x, y, np.diag(k).astype(complex)), strict=True))


def reduced_d(n_bra: int, rank: int, q: int, n_ket: int) -> np.ndarray:
    """⟨N'k'||D^K*_.q||N k⟩ = (-1)^(N'-k') √((2N'+1)(2N+1)) (N' K N; -k' q k)."""
    out = np.zeros((2 * n_bra + 1, 2 * n_ket + 1))
    for k in range(-n_ket, n_ket + 1):
        if abs(k + q) <= n_bra:
            symbol = wigner_3j(2 * n_bra, 2 * rank, 2 * n_ket, -2 * (k + q), 2 * q, 2 * k)
            out[k + q + n_bra, k + n_ket] = (-1) ** (n_bra - k - q) * symbol
    return out * sqrt((2 * n_bra + 1) * (2 * n_ket + 1))


def spherical(tensor: np.ndarray) -> dict[int, complex]:
    """Components q = -2 ... 2 of a symmetric traceless tensor in axes (x, y, z): T0 = √(3/2) Tzz and so on."""
    t = np.asarray(tensor, complex)
    return {
        0: sqrt(1.5) * t[2, 2],
        1: -(t[0, 2] + 1j * t[1, 2]), -1: t[0, 2] - 1j * t[1, 2],
        2: (t[0, 0] - t[1, 1]) / 2 + 1j * t[0, 1], -2: (t[0, 0] - t[1, 1]) / 2 - 1j * t[0, 1],
    }  # fmt: skip


def in_frame(tensor: np.ndarray, z: str) -> np.ndarray:
    """A tensor or vector given in a, b, c, in the axes (x, y, z) of z."""
    order = ["abc".index(axis) for axis in FRAMES[z]]
    return np.asarray(tensor)[np.ix_(*[order] * np.ndim(tensor))]


def reduced_second_rank(n_bra: int, n_ket: int, tensor_abc: np.ndarray, z: str) -> np.ndarray:
    """⟨N'k'||T²||N k⟩ of a symmetric traceless tensor of the molecule."""
    parts = spherical(in_frame(tensor_abc, z))
    return sum(value * reduced_d(n_bra, 2, q, n_ket) for q, value in parts.items())


def reduced_vector(n_bra: int, n_ket: int, vector_abc: np.ndarray, z: str) -> np.ndarray:
    """⟨N'k'||T¹||N k⟩ of a vector of the molecule, a dipole for instance."""
    x, y, axial = in_frame(np.asarray(vector_abc, float), z)
    parts = {0: axial, 1: -(x + 1j * y) / sqrt(2), -1: (x - 1j * y) / sqrt(2)}
    return sum(value * reduced_d(n_bra, 1, q, n_ket) for q, value in parts.items())


def cosine(n_bra: int, n_ket: int, axis: str, m: int, z: str) -> np.ndarray:
    """⟨N'k'm|φ_0axis|N k m⟩: the cosine between the space-fixed Z and an axis of the molecule."""
    unit = np.eye(3)["abc".index(axis)]
    return (
        (-1) ** (n_bra - m)
        * wigner_3j(2 * n_bra, 2, 2 * n_ket, -2 * m, 0, 2 * m)
        * reduced_vector(n_bra, n_ket, unit, z)
    )


def reduced_coupled(n_bra: int, n_ket: int, tensor_abc: np.ndarray, z: str) -> np.ndarray:
    """⟨N'k'||V||N k⟩ of the vector V_p = Σ_ij C_ij ½{φ_pi, N_j}, spin-rotation's: any 3x3 matrix C in a, b, c.

    Taken from its component p = 0 at the largest m that both N have, where the 3j symbol is not zero.
    """
    m = min(n_bra, n_ket)
    symbol = (-1) ** (n_bra - m) * wigner_3j(2 * n_bra, 2, 2 * n_ket, -2 * m, 0, 2 * m)
    if symbol == 0.0:
        return np.zeros((2 * n_bra + 1, 2 * n_ket + 1), complex)
    bra, ket = momenta(n_bra, z), momenta(n_ket, z)
    total = np.zeros((2 * n_bra + 1, 2 * n_ket + 1), complex)
    for i, along in enumerate("abc"):
        phi = cosine(n_bra, n_ket, along, m, z)
        for j, about in enumerate("abc"):
            total += tensor_abc[i][j] * (phi @ ket[about] + bra[about] @ phi) / 2
    return total / symbol


def spin_reduced(spin2: int, rank: int) -> float:
    """⟨s||T^K||s⟩ of the spin itself (K = 1) or of T²(s, s) with T²_0 = (3 sz² - s²)/√6, from its element at m = s."""
    s = spin2 / 2
    element = {0: 1.0, 1: s, 2: (3 * s * s - s * (s + 1)) / sqrt(6)}[rank]
    symbol = wigner_3j(spin2, 2 * rank, spin2, -spin2, 0, spin2)
    return element / symbol if symbol else 0.0
