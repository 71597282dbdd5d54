"""The slow, independent route: full (2J+1) matrices from QuTiP's angular momentum operators, nothing factorised."""

from __future__ import annotations

import numpy as np
import qutip

AXES = {"Ir": "bca", "Il": "cba", "IIr": "cab", "IIl": "acb", "IIIr": "abc", "IIIl": "bac"}


def body_operators(j: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Jx, Jy, Jz, J+, J- of one J in the body frame, where J∓ raises and lowers: anomalous commutators.

    The anomalous operators are the complex conjugates of the space-fixed ones.
    """
    x, y, z = (qutip.jmat(j, axis).full() if j else np.zeros((1, 1)) for axis in "xyz")
    x, y, z = x.conj(), y.conj(), z.conj()
    return x, y, z, x + 1j * y, x - 1j * y


def _anti(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    return (p @ q + q @ p) / 2


def watson_matrix(values: dict[str, float], reduction: str, representation: str, j: int) -> np.ndarray:
    """Watson's Hamiltonian written as his papers print it, operator by operator, to sextic order."""
    jx, jy, jz, up, down = body_operators(j)
    identity = np.eye(2 * j + 1)
    j2 = j * (j + 1) * identity
    v = lambda name: values.get(name, 0.0)  # noqa: E731
    axis = AXES[representation]
    total = v(axis[0].upper()) * jx @ jx + v(axis[1].upper()) * jy @ jy + v(axis[2].upper()) * jz @ jz
    z2, z4, z6 = (np.linalg.matrix_power(jz, n) for n in (2, 4, 6))
    if reduction == "A":
        xy = jx @ jx - jy @ jy
        total = total - v("DeltaJ") * j2 @ j2 - v("DeltaJK") * j2 @ z2 - v("DeltaK") * z4
        total = total - 2 * v("deltaJ") * j2 @ xy - 2 * v("deltaK") * _anti(z2, xy)
        total = total + v("PhiJ") * j2 @ j2 @ j2 + v("PhiJK") * j2 @ j2 @ z2 + v("PhiKJ") * j2 @ z4 + v("PhiK") * z6
        return total + 2 * (v("phiJ") * j2 @ j2 @ xy + v("phiJK") * j2 @ _anti(z2, xy) + v("phiK") * _anti(z4, xy))

    pair = lambda n: np.linalg.matrix_power(up, 2 * n) + np.linalg.matrix_power(down, 2 * n)  # noqa: E731
    total = total - v("DJ") * j2 @ j2 - v("DJK") * j2 @ z2 - v("DK") * z4
    total = total + v("d1") * j2 @ pair(1) + v("d2") * pair(2)
    total = total + v("HJ") * j2 @ j2 @ j2 + v("HJK") * j2 @ j2 @ z2 + v("HKJ") * j2 @ z4 + v("HK") * z6
    return total + v("h1") * j2 @ j2 @ pair(1) + v("h2") * j2 @ pair(2) + v("h3") * pair(3)


def term_matrix(p: int, q: int, n: int, j: int) -> np.ndarray:
    """J^2p ½[Jz^2q, J₊^2n + J₋^2n]₊, for n = 0 J^2p Jz^2q, by multiplying operators."""
    _, _, jz, up, down = body_operators(j)
    power = np.linalg.matrix_power
    ladder = power(up, 2 * n) + power(down, 2 * n) if n else np.eye(2 * j + 1)
    return (j * (j + 1.0)) ** p * _anti(power(jz, 2 * q), ladder)


def cubic_matrix(j: int) -> np.ndarray:
    """6 J⁴ - 2 J² - 10 (Jx⁴ + Jy⁴ + Jz⁴), as it is printed."""
    x = j * (j + 1.0)
    fourth = sum(np.linalg.matrix_power(component, 4) for component in body_operators(j)[:3])
    return (6 * x**2 - 2 * x) * np.eye(2 * j + 1) - 10 * fourth


def threefold_turn(j: int) -> np.ndarray:
    """The turn by 120° about (1, 1, 1)."""
    x, y, z, _, _ = body_operators(j)
    values, vectors = np.linalg.eigh((x + y + z) / np.sqrt(3))
    return (vectors * np.exp(-2j * np.pi / 3 * values)) @ vectors.conj().T
