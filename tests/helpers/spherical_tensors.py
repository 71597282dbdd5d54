"""3j symbols from QuTiP, and spherical components of a matrix, for full matrices of the tests."""

import numpy as np
import qutip


def symbol(j1, j2, j3, m1, m2, m3):
    """The 3j symbol from QuTiP's Clebsch-Gordan coefficients."""
    if m1 + m2 + m3 or abs(m1) > j1 or abs(m3) > j3 or not abs(j1 - j2) <= j3 <= j1 + j2:
        return 0.0
    return (-1) ** int(j1 - j2 - m3) / np.sqrt(2 * j3 + 1) * qutip.clebsch(j1, j2, j3, m1, m2, -m3)


def spherical(matrix_xyz):
    """T²_q, q = -2 ... 2, of a symmetric traceless matrix along x, y, z; entries may be matrices."""
    t = matrix_xyz
    two = 0.5 * (t[0][0] - t[1][1])
    return [two - 1j * t[0][1], t[0][2] - 1j * t[1][2], (2 * t[2][2] - t[0][0] - t[1][1]) / np.sqrt(6), -(t[0][2] + 1j * t[1][2]),
            two + 1j * t[0][1]]  # fmt: skip
