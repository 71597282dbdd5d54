"""The stated error of the truncation to n_v torsional functions against all of them."""

import numpy as np
import pytest

from rotor import units
from rotor.quantum.internal_rotation.model import RamModel
from rotor.quantum.internal_rotation.truncation import truncation_mhz

CM = units.MHZ_PER_CM
METHYL_FORMATE = {
    "A": 0.5884101,
    "B": 0.3082455,
    "C": 0.17711843,
    "Dab": -0.1649794,
    "F": 5.49038,
    "V3": 370.924,
}  # A&A 500, 1109
METHANOL_OD = {
    "A": 3.675099,
    "B": 0.783150,
    "C": 0.733527,
    "Dab": 0.027977826,
    "F": 17.42797209,
    "V3": 183.171569,
}  # aa49918-24
CASES = {"methyl formate": (METHYL_FORMATE, 0.08427127), "CH3OD": (METHANOL_OD, 0.6993446726)}


@pytest.mark.parametrize("count", [5, 7, 9])
@pytest.mark.parametrize("case", CASES)
def test_the_stated_error_is_a_bound(case, count):
    constants, rho = CASES[case]
    model = RamModel({name: value * CM for name, value in constants.items()} | {"rho": rho})
    actual = 0.0
    for sigma in (0, 1):
        levels = [model.blocks(sigma, 15, jmin=15, count=n, waves=10).solve(model.coefficients, 1) for n in (count, 21)]
        by_name = [found.energies[np.lexsort([found.quanta[n] for n in ("kc", "ka", "vt")])] for found in levels]
        actual = max(actual, np.abs(by_name[0] - by_name[1]).max())
    assert actual <= truncation_mhz(model, 15, 1, count)
