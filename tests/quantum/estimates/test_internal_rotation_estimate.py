"""The estimate of A - E splittings against levels of nine torsional functions."""

import numpy as np
import pytest

from rotor import units
from rotor.quantum.estimates.methyl_groups import line_shifts, rotor_of_moments
from rotor.quantum.internal_rotation.model import RamModel
from rotor.quantum.internal_rotation.terms import Axes


@pytest.mark.parametrize(
    ("abc", "direction", "v3"),
    [
        ((31e3, 9.8e3, 8.6e3), (0.9, 0.4, 0.0), 1e7),
        ((31e3, 9.8e3, 8.6e3), (0.0, 1.0, 0.0), 1e7),
        ((10e3, 9e3, 5e3), (0.7, 0.0, 0.7), 2.8e6),
    ],
)
def test_shifts_of_internal_rotation_are_between_lines_of_equal_ka_and_kc(abc, direction, v3):
    """The lowest torsional state alone, against nine: the same lines of A and E, for ρ in any direction."""
    cosines = np.array(direction) / np.linalg.norm(direction)
    rotor_top = rotor_of_moments(3.2, cosines, units.ROTATIONAL_MHZ_U_ANGSTROM2 / np.array(abc), v3)
    model = RamModel(
        dict(zip("ABC", abc, strict=True)) | {"F": rotor_top.f_mhz, "rho": np.linalg.norm(rotor_top.rho), "V3": v3},
        frame=Axes.along(rotor_top.rho),
    )
    lines = []
    for sigma in (0, 1):
        levels = model.blocks(sigma, 4).solve_once(model.coefficients, 0)
        labels = np.stack([levels.quanta[name] for name in ("j", "ka", "kc")], axis=1).tolist()
        energy = dict(zip(map(tuple, labels), levels.energies.tolist(), strict=True))
        lower = [(3, ka, kc) for ka in range(4) for kc in (4 - ka, 3 - ka) if 0 <= kc <= 3]
        lines.append([[energy[4, ka + up, kc + 1 - up] - energy[3, ka, kc] for _, ka, kc in lower] for up in (0, 1)])
    same, other = np.array(lines[1]) - np.array(lines[0])
    shifts_same, shifts_other = line_shifts(abc, rotor_top, 3)
    assert np.median(np.abs(shifts_same)) == pytest.approx(np.median(np.abs(same)), rel=0.03)
    assert np.median(np.abs(shifts_other)) == pytest.approx(np.median(np.abs(other)), rel=0.03)
