"""Two internal rotors against full matrices over |K⟩|m1⟩|m2⟩, written without the package."""

import numpy as np
import pytest

from rotor import units
from rotor.quantum.internal_rotation.model import RamModel
from rotor.quantum.internal_rotation.two_tops import InternalTop, TwoTops

CM = units.MHZ_PER_CM
ABC = (9800.0, 4300.0, 3200.0)
FIRST = InternalTop(5.6 * CM, 300.0 * CM, (0.06, 0.02, 0.0))
SECOND = InternalTop(6.1 * CM, 40.0 * CM, (0.05, -0.03, 0.0))
COUPLED = {"f12": -0.4 * CM, "v12": 12.0 * CM, "v12_sine": -7.0 * CM}
SPECIES = [(0, 0), (0, 1), (1, 0), (1, 1), (1, -1)]


def direct_product(model, j, species, waves):
    """H of one J over |K⟩|m1⟩|m2⟩."""
    k = np.arange(-j, j + 1.0)
    raising = np.diag(np.sqrt(j * (j + 1) - k[:-1] * (k[:-1] + 1)), -1)
    components = [np.diag(k).astype(complex), (raising + raising.T) / 2, 0.5j * (raising - raising.T)]
    m = [3.0 * np.arange(-waves, waves + 1) + sigma for sigma in species]
    size = 2 * waves + 1
    one = np.eye(size)
    cos3, sin3 = (np.eye(size, k=1) + np.eye(size, k=-1)) / 2, (np.eye(size, k=-1) - np.eye(size, k=1)) / 2j

    def whole(rotation, first, second):
        return np.kron(rotation, np.kron(first, second))

    unit = np.eye(2 * j + 1)
    slips = []
    for i, top in enumerate(model.tops):
        along = sum(value * component for value, component in zip(top.rho_abc, components, strict=True))
        p = np.diag(m[i])
        slips.append(whole(unit, *((p, one) if i == 0 else (one, p))) - whole(along, one, one))
    total = whole(sum(x * c @ c for x, c in zip(model.abc, components, strict=True)), one, one)
    for i, (top, slip) in enumerate(zip(model.tops, slips, strict=True)):
        barrier = top.v3_mhz / 2 * (one - cos3)
        total = total + top.f_mhz * slip @ slip + whole(unit, *((barrier, one) if i == 0 else (one, barrier)))
    total = total + model.f12 * (slips[0] @ slips[1] + slips[1] @ slips[0])
    return total + model.v12 / 2 * whole(unit, one - cos3, one - cos3) + model.v12_sine / 2 * whole(unit, sin3, sin3)


@pytest.mark.parametrize("species", SPECIES)
@pytest.mark.parametrize("plane", [True, False])
def test_all_products_give_the_levels_of_the_direct_product(species, plane):
    second = SECOND if plane else InternalTop(SECOND.f_mhz, SECOND.v3_mhz, (0.05, -0.03, 0.04))
    model = TwoTops(ABC, (FIRST, second), **COUPLED)
    blocks = model.blocks(species, 3, count=49, each=7, waves=3)
    energies = blocks.linear.energies(model.coefficients)
    for j in range(4):
        expected = np.linalg.eigvalsh(direct_product(model, j, species, 3))
        found = np.sort(energies[blocks.functions.labels["J"] == j])
        assert len(found) == len(expected)
        assert np.abs(found - expected).max() < 1e-6  # MHz, of energies up to 4e7: rounding of both matrices


def test_two_tops_that_do_not_see_each_other_are_two_molecules():
    """ρ2 = 0 and no coupling: levels of the first top plus the torsion of the second."""
    alone = InternalTop(SECOND.f_mhz, SECOND.v3_mhz, (0.0, 0.0, 0.0))
    model = TwoTops(ABC, (InternalTop(FIRST.f_mhz, FIRST.v3_mhz, (0.06, 0.0, 0.0)), alone))
    single = RamModel(dict(zip("ABC", ABC, strict=True)) | {"F": FIRST.f_mhz, "V3": FIRST.v3_mhz, "rho": 0.06})
    for sigma in (0, 1):
        both = model.blocks((sigma, 0), 3, count=9, each=9).solve(model.coefficients, 0)
        expected = single.blocks(sigma, 3, count=9).solve(single.coefficients, 0)
        difference = np.sort(both.energies) - np.sort(expected.energies)
        assert np.ptp(difference) < 1e-3  # nine products by energy have fewer functions of the first top than nine
        assert difference.mean() == pytest.approx(
            model.blocks((sigma, 0), 0).functions.torsion.second.energies[0, 0], abs=1e-2
        )


def test_products_converge_from_above():
    model = TwoTops(ABC, (FIRST, SECOND), **COUPLED)
    lowest = [
        model.blocks((0, 1), 4, count=count, each=9).solve(model.coefficients, 0).energies for count in (16, 36, 64)
    ]
    errors = [np.abs(np.sort(energies) - np.sort(lowest[-1])).max() for energies in lowest[:-1]]
    assert errors[1] < errors[0] / 10
    assert (np.sort(lowest[0]) >= np.sort(lowest[1]) - 1e-5).all()  # the variational principle, but for rounding
