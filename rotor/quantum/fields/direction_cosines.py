"""cosθ and cos²θ between symmetric-top functions |J k M⟩, θ between the figure axis and Z: one chain of J for each k, M.

    ⟨J-1 k M|cosθ|J k M⟩ = √[(J²-k²)(J²-M²)] / (J √(4J²-1)),     ⟨J k M|cosθ|J k M⟩ = kM / (J(J+1))

(C. H. Townes and A. L. Schawlow, Microwave Spectroscopy, 1955, table 4.4; Condon-Shortley phases in space, ⟨J k±1|Jx ∓ iJy|J k⟩
positive in the molecule). k = 0 gives the functions of a linear molecule. cos²θ is the square of a matrix of cosθ with one more J, which
makes it exact for the requested J.
"""

from __future__ import annotations

import numpy as np

from rotor.arrays import Floats, Ints


def cosine_bands(j: Ints, k: int, m: int) -> tuple[Floats, Floats]:
    """Diagonal (n,) and the band beside it (n-1,) of cosθ over successive J ≥ max(|k|, |M|).

    >>> cosine_bands(np.arange(3), 0, 0)[1].round(6).tolist()  # 1/√3, 2/√15
    [0.57735, 0.516398]
    """
    j = j.astype(np.float64)
    diagonal = k * m / np.where(j > 0, j * (j + 1), 1.0)
    up = j[1:]
    return diagonal, np.sqrt((up**2 - k * k) * (up**2 - m * m) / (4 * up**2 - 1)) / up


def cosine_squared_bands(j: Ints, k: int, m: int) -> tuple[Floats, Floats, Floats]:
    """The diagonals of cos²θ with ΔJ = 0 (n,), 1 (n-1,) and 2 (n-2,) over successive J ≥ max(|k|, |M|).

    >>> cosine_squared_bands(np.arange(2), 0, 0)[0].round(6).tolist()  # 1/3, 3/5
    [0.333333, 0.6]
    """
    longer = np.append(j, j[-1] + 1)
    d, b = cosine_bands(longer, k, m)
    below = np.concatenate([[0.0], b[:-1]])  # J - 1 to J; zero for the first J
    return d[:-1] ** 2 + below**2 + b**2, (b * (d[:-1] + d[1:]))[:-1], (b[:-1] * b[1:])[:-1]
