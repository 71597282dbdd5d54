"""One top in any direction to the principal axes, against full matrices over |K⟩|m⟩ and rigid tops."""

import numpy as np
import pytest
from scipy.sparse import csr_array

import rotor
from rotor.quantum.blocks.dominated import dominated_states
from rotor.quantum.internal_rotation.frames import axis_of_angles
from rotor.quantum.internal_rotation.from_geometry import with_internal_rotation
from rotor.quantum.internal_rotation.levels import turning_tops
from rotor.quantum.internal_rotation.model import model_of_principal_axes
from rotor.tops.internal_rotation import InternalRotationConstants

ROTATION = {"A": 9e3, "B": 5e3, "C": 4e3}
OBLATE = {"A": 10e3, "B": 9e3, "C": 5e3}
QUARTIC = {"DeltaJ": 0.01, "DeltaJK": 0.02, "DeltaK": 0.05, "deltaJ": 0.003, "deltaK": 0.006}
TOP = {"F0": 157e3, "V3": 1e7, "V6": 3e5}
DIRECTIONS = {
    "ab": {"delta": 0.5},
    "ac": {"delta": 0.5, "epsilon": np.pi / 2},
    "bc": {"delta": np.pi / 2, "epsilon": 0.7},
    "b": {"delta": np.pi / 2},
    "c": {"delta": np.pi / 2, "epsilon": np.pi / 2},
    "none": {"delta": 0.9, "epsilon": 0.7},
}


def direct_product(angles, j, sigma, waves=10):
    """Energies of one J over |K⟩|m⟩ in principal axes: ρ_g = λ_g B_g/F0, F = F0/(1 - Σ λ_g ρ_g)."""
    k = np.arange(-j, j + 1.0)
    raising = np.diag(np.sqrt(j * (j + 1) - k[:-1] * (k[:-1] + 1)), -1)
    a, b, c = axes = [np.diag(k).astype(complex), (raising + raising.T) / 2, 0.5j * (raising - raising.T)]
    direction = axis_of_angles(**angles)
    rho = direction * list(ROTATION.values()) / TOP["F0"]
    m = 3.0 * np.arange(-waves, waves + 1) + sigma
    one, unit, square = np.eye(len(m)), np.eye(2 * j + 1), j * (j + 1)
    slip = np.kron(unit, np.diag(m)) - np.kron(sum(x * axis for x, axis in zip(rho, axes, strict=True)), one)
    rotation = sum(ROTATION[name] * axis @ axis for name, axis in zip("ABC", axes, strict=True))
    steps = 2 * (b @ b - c @ c)  # (b - ic)² + (b + ic)²
    q = QUARTIC
    rotation = rotation - q["DeltaJ"] * square**2 * unit - q["DeltaJK"] * square * a @ a - q["DeltaK"] * a @ a @ a @ a
    rotation = rotation - q["deltaJ"] * square * steps - q["deltaK"] / 2 * (a @ a @ steps + steps @ a @ a)
    cosines = [(np.eye(len(m), k=n) + np.eye(len(m), k=-n)) / 2 for n in (1, 2)]
    barrier = TOP["V3"] / 2 * (one - cosines[0]) + TOP["V6"] / 2 * (one - cosines[1])
    f = TOP["F0"] / (1 - direction @ rho)
    return np.linalg.eigvalsh(np.kron(rotation, one) + f * slip @ slip + np.kron(unit, barrier))


@pytest.mark.parametrize("plane", DIRECTIONS)
@pytest.mark.parametrize("sigma", [0, 1])
def test_levels_are_those_of_the_direct_product(plane, sigma):
    model = model_of_principal_axes(ROTATION | QUARTIC | TOP | DIRECTIONS[plane])
    assert model.has_plane == (plane != "none")
    levels = model.blocks(sigma, 4, count=21).solve_once(model.coefficients, 3)
    assert all(np.iscomplexobj(vectors) == (plane == "none") for vectors in levels.vectors)
    for j in range(5):
        energies = np.sort(levels.energies[levels.quanta["j"] == j])
        expected = direct_product(DIRECTIONS[plane], j, sigma)[: len(energies)]
        assert np.abs(energies - expected).max() < 1e-6  # MHz; elements are up to 1e8: rounding is 1e-7


@pytest.mark.parametrize(
    ("rotation", "plane"), [(rotation, plane) for rotation in (ROTATION, OBLATE) for plane in DIRECTIONS]
)
def test_names_behind_a_high_barrier_are_those_of_a_rigid_top(rotation, plane):
    """V3 = 1e8 MHz: the spacings differ by the reaction of the torsion, up to 7.7 MHz of 3e5; swapped names by far more."""
    internal = InternalRotationConstants({"F0": 157e3, "V3": 1e8, **DIRECTIONS[plane]}, "PAM", vt_max=0, functions=15)
    constants = rotor.Constants(**rotation, reduction="A", representation="Ir")
    rigid = rotor.api.solve_levels(rotor.Top.from_constants(constants), 6)
    levels = rotor.api.solve_levels(rotor.Top.from_constants(constants, internal_rotation=internal), 6)
    for species in "AE":
        energies = []
        for table, further in ((levels, {"species": species, "vt": 0}), (rigid, {})):
            rows = [
                table.find(j=j, ka=ka, kc=kc, **further)
                for j in range(7) for ka in range(j + 1) for kc in (j - ka, j - ka + 1) if 0 <= kc <= j
            ]  # fmt: skip
            energies.append(table.energy_mhz[rows] - table.energy_mhz[rows[0]])
        assert np.abs(energies[0] - energies[1]).max() < 8.0


@pytest.mark.parametrize(("smiles", "plane"), [("CN", "ac"), ("CC=O", "ab"), ("CCO", "none")])
def test_the_plane_of_a_geometry_is_exact(smiles, plane):
    """Methylamine: the mirror contains the axis and halves NH2, so that it is ac; gauche ethanol has none."""
    top = with_internal_rotation(rotor.read(f"SMILES:{smiles}"), given="V3=600cm-1")
    model = turning_tops(top, top.internal_rotation)
    assert model.has_plane == (plane != "none")
    assert model.frame.normal == {"ab": "c", "ac": "b", "none": ""}[plane]


def test_few_states_of_a_complex_matrix_are_those_of_all():
    rng = np.random.default_rng(3)
    size, count = 260, 10
    full = rng.normal(scale=3.0, size=(size, size)) + 1j * rng.normal(scale=3.0, size=(size, size))
    full = (full + full.conj().T) / 2 + np.diag(np.where(np.arange(size) < count, 20.0, 1e3) + 5.0 * np.arange(size))
    energies, vectors = dominated_states(csr_array(np.tril(full)), np.arange(count))
    eigenvalues = np.linalg.eigvalsh(full)[:count]
    assert np.abs(energies - eigenvalues).max() < 1e-6
    assert np.abs(full @ vectors - vectors * energies).max() < 1e-2  # the energies' error is quadratic in it
