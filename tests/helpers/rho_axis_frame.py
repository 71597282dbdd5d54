"""Constants of the rho-axis frame from those of the principal axes, for tests that compare both frames."""

import numpy as np

from rotor.quantum.internal_rotation.frames import frame_along


def ram_of_pam(constants, f, rho_abc):
    """A, B, C, Dab, Dbc, Dac, F and rho of the rho-axis frame from A, B, C of the principal axes; those of D that vanish are left out."""
    axes = frame_along(rho_abc)
    tensor = axes @ np.diag(np.asarray(constants, dtype=float)) @ axes.T
    computed = {"A": tensor[0, 0], "B": tensor[1, 1], "C": tensor[2, 2], "F": f, "rho": np.linalg.norm(rho_abc)}
    scale = 1e-14 * float(np.abs(tensor).max())
    mixed = {"Dab": tensor[0, 1], "Dbc": tensor[1, 2], "Dac": tensor[0, 2]}
    return {
        name: float(value) for name, value in (computed | {n: v for n, v in mixed.items() if abs(v) > scale}).items()
    }
