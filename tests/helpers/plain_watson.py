"""Levels of one J from the full (2J+1) matrix in Iʳ, to decic order, labelled by the rows of the textbook's table.

Nothing is shared with the package: dense matrices, anticommutators by multiplication, parities by projection.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

_DIAGONAL = {  # coefficient of J^2p Jz^2q, by the name's order and its tail
    "D": {"J": (2, 0), "JK": (1, 1), "K": (0, 2)},
    "H": {"J": (3, 0), "JK": (2, 1), "KJ": (1, 2), "K": (0, 3)},
    "L": {"J": (4, 0), "JJK": (3, 1), "JK": (2, 2), "KKJ": (1, 3), "K": (0, 4)},
    "P": {"J": (5, 0), "JJK": (4, 1), "JK": (3, 2), "KJ": (2, 3), "KKJ": (1, 4), "K": (0, 5)},
}
_A_OFF = {"deltaJ": (1, 0), "deltaK": (0, 1), "phiJ": (2, 0), "phiJK": (1, 1), "phiK": (0, 2)}
_A_OFF |= {"lJ": (3, 0), "lJK": (2, 1), "lKJ": (1, 2), "lK": (0, 3)}
_S_OFF = {"d1": (1, 1), "d2": (0, 2), "h1": (2, 1), "h2": (1, 2), "h3": (0, 3)}
_S_OFF |= {"l1": (3, 1), "l2": (2, 2), "l3": (1, 3), "l4": (0, 4)}


def matrix(values: Mapping[str, float], j: int) -> np.ndarray:
    """H of one J over K = -J ... J with z = a, x = b, y = c."""
    k = np.arange(-j, j + 1.0)
    up = np.diag(np.sqrt(j * (j + 1) - k[:-1] * (k[:-1] + 1)), -1)
    x = j * (j + 1.0)
    z2 = np.diag(k**2)
    shift = {n: np.linalg.matrix_power(up, 2 * n) for n in (1, 2, 3, 4)}
    shift = {n: s + s.T for n, s in shift.items()}

    a, b, c = values["A"], values["B"], values["C"]
    h = (b + c) / 2 * x * np.eye(2 * j + 1) + (a - (b + c) / 2) * z2 + (b - c) / 4 * shift[1]
    for name, value in values.items():
        letter = name.replace("Delta", "D").replace("Phi", "H")
        if letter[0] in _DIAGONAL and letter[1:] in _DIAGONAL[letter[0]]:
            p, q = _DIAGONAL[letter[0]][letter[1:]]
            h = h + (-value if letter[0] == "D" else value) * x**p * np.linalg.matrix_power(z2, q)
        elif name in _A_OFF:
            p, q = _A_OFF[name]
            power = np.linalg.matrix_power(z2, q)
            h = h + (-value if name.startswith("delta") else value) * x**p * (power @ shift[1] + shift[1] @ power) / 2
        elif name in _S_OFF:
            p, n = _S_OFF[name]
            h = h + value * x**p * shift[n]
        elif name not in ("A", "B", "C"):
            raise KeyError(name)
    return h


def levels(values: Mapping[str, float], j: int) -> dict[tuple[int, int, int], float]:
    """Energies in MHz by (J, Ka, Kc)."""
    h = matrix(values, j)
    results = {}
    for odd in (0, 1):
        for sign in (1, -1):
            ks = [k for k in range(odd, j + 1, 2) if k or sign == 1]
            if not ks:
                continue
            u = np.zeros((2 * j + 1, len(ks)))
            for column, k in enumerate(ks):
                u[j + k, column] = u[j - k, column] = 1.0
                u[j - k, column] *= sign if k else 1
            u /= np.linalg.norm(u, axis=0)
            for k, energy in zip(ks, np.linalg.eigvalsh(u.T @ h @ u), strict=True):
                even_kc = sign * (-1) ** (j + k) == 1  # C2(c)|J k> = (-1)^(J+k)|J -k>
                kc = j - k if k == 0 or ((j - k) % 2 == 0) == even_kc else j - k + 1
                results[j, k, kc] = float(energy)
    return results
