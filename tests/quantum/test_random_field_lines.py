"""Lines and means of random tops in a field against full matrices of direct products: strengths, intensities, effective moments, fits.

Levels of N ≤ 1 of up to two states, two spins, three components of the dipole, one between the states. Strengths between levels that
coincide are compared in sum.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from random_hamiltonians import LARGEST, NUCLEAR_G, Case, full_matrix, functions_of_m, operators, random_case
from random_tops import top_and_effects

import rotor
from rotor.fitting.levels.stark_levels import stark_levels
from rotor.fitting.top_constants import TopConstants
from rotor.quantum.effects.stark import stark_map
from rotor.quantum.effects.zeeman import zeeman_map
from rotor.quantum.labels.quanta import FIELD_STEP_KV_PER_CM
from rotor.spectra.fields.lines import field_lines
from rotor.tops.states.state_constants import StateConstants
from rotor.tops.top import Top
from rotor.units import MHZ_PER_DEBYE_KV_PER_CM, MHZ_PER_K, NUCLEAR_MAGNETON_MHZ_PER_T

BELOW_MHZ = 18_000.0  # all N ≤ 1 of both states, and no N = 2
CLOSE_MHZ = 1e-3
ELECTRIC = [("electric",), ("states", "electric"), ("spins", "electric"), ("states", "spins", "electric")]
MAGNETIC = [("magnetic",), ("states", "magnetic"), ("spins", "magnetic"), ("states", "spins", "magnetic")]
LIGHT = {"parallel": (3.0, 0.0), "perpendicular": (0.0, 1.5), "isotropic": (1.0, 1.0), 35.0: None}
TEMPERATURE_K = 3.0
COMMON = {"j_highest": 1, "jmax": LARGEST + 2, "tolerance_mhz": 1e-6}


def _states(case: Case) -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """Energies and states of each doubled M that N ≤ 1 reaches."""
    most = 2 + 3 * case.spins
    solved = {}
    for twice_m in range(-most, most + 1, 2):
        energy, vectors = np.linalg.eigh(full_matrix(replace(case, twice_m=twice_m)))
        solved[twice_m] = energy[energy < BELOW_MHZ], vectors[:, energy < BELOW_MHZ]
    return solved


def _between(case: Case, up: int, low: int, space: dict[str, complex]) -> np.ndarray:
    """Σ of components in space times the dipole, over the functions of two M."""
    phi, _ = operators()
    rows, columns = (functions_of_m(replace(case, twice_m=m)) for m in (up, low))
    total = np.zeros((len(rows[0]), len(columns[0])), complex)
    for i, axis in enumerate("abc"):
        cosine = sum(value * phi[f, axis] for f, value in space.items())[np.ix_(rows[1], columns[1])]
        total += cosine * np.where(np.equal.outer(rows[0], columns[0]), case.dipole[i], case.between[i])
    same_spins = np.equal.outer(rows[2], columns[2]) & np.equal.outer(rows[3], columns[3])
    return total * same_spins


def _strengths(case: Case, light, solved) -> tuple[np.ndarray, np.ndarray]:
    """All energies, and strengths between the states."""
    parts = LIGHT[light] or (3 * np.cos(np.radians(light)) ** 2, 1.5 * np.sin(np.radians(light)) ** 2)
    starts = dict(zip(solved, np.cumsum([0, *(len(energy) for energy, _ in solved.values())])[:-1], strict=True))
    energies = np.concatenate([energy for energy, _ in solved.values()])
    out = np.zeros((len(energies),) * 2)
    for up, (first, states) in solved.items():
        for low, (other, functions) in solved.items():
            if abs(up - low) <= 2:
                if up == low:
                    elements = [(parts[0], _between(case, up, low, {"z": 1.0}))]
                else:
                    elements = [(parts[1], _between(case, up, low, {axis: 1.0})) for axis in "xy"]
                block = sum(weight * np.abs(states.conj().T @ matrix @ functions) ** 2 for weight, matrix in elements)
                out[starts[up] : starts[up] + len(first), starts[low] : starts[low] + len(other)] = block
    return energies, out


def _compare_lines(case: Case, light) -> int:
    """How many sums of lines were compared."""
    top, effects = top_and_effects(case)
    with_effects = {"effects": effects} if case.spins or len(case.abc) == 2 else {}
    lines = field_lines(top, [0.0, case.kv_per_cm], light=light, temperature_k=TEMPERATURE_K, **with_effects, **COMMON)
    energies, strengths = _strengths(case, light, _states(case))
    ordered = np.sort(energies)
    numbers = np.cumsum(np.diff(ordered, prepend=ordered[0]) > CLOSE_MHZ)
    place = numbers[np.searchsorted(ordered, energies)]
    expected, ours, amounts = (np.zeros((numbers[-1] + 1,) * 2) for _ in range(3))
    np.add.at(expected, (place[:, None], place), strengths)
    at = lines.field_kv_per_cm == case.kv_per_cm
    both = [lines.lower_mhz[at] + lines.frequency_mhz[at], lines.lower_mhz[at]]
    near = [np.abs(ordered[:, None] - energy).argmin(axis=0) for energy in both]
    assert max(np.abs(ordered[n] - energy).max() for n, energy in zip(near, both, strict=True)) < 1e-6
    up, low = (numbers[n] for n in near)
    np.add.at(ours, (up, low), lines.strength_debye2[at])
    np.add.at(amounts, (up, low), lines.intensity_nm2_mhz[at])
    ours, expected = np.triu(ours + ours.T, 1), np.triu(expected, 1)
    np.testing.assert_allclose(ours, expected, rtol=1e-6, atol=1e-8 * expected.max())
    _compare_intensities(
        np.triu(amounts - amounts.T, 1), expected, np.array([ordered[numbers == n][0] for n in range(numbers[-1] + 1)])
    )
    return int((expected > 1e-8 * expected.max()).sum())


def _compare_intensities(amounts: np.ndarray, strengths: np.ndarray, energy: np.ndarray) -> None:
    """Intensities are S ν (p″ - p′) times one number."""
    population = np.exp(-(energy - energy[0]) / (TEMPERATURE_K * MHZ_PER_K))
    factors = np.subtract.outer(energy, energy) * np.subtract.outer(population, population)
    shape = np.abs(strengths * factors)
    scale = np.abs(amounts).sum() / shape.sum()
    np.testing.assert_allclose(np.abs(amounts), scale * shape, rtol=1e-6, atol=1e-8 * scale * shape.max())


@pytest.mark.parametrize(
    ("parts", "light"),
    [(("electric",), "perpendicular"), (("states", "electric"), "isotropic"), (("spins", "electric"), 35.0)],
)
def test_lines_in_an_electric_field(parts, light):
    assert _compare_lines(random_case(parts, np.random.default_rng(3)), light) > 5


def _compare_slopes(case: Case) -> int:
    """How many effective moments of a map were compared, -dE/dfield = -⟨ψ|H(F) - H(0)|ψ⟩/F."""
    top, effects = top_and_effects(case)
    with_effects = {"effects": effects} if case.spins or len(case.abc) == 2 else {}
    if case.tesla:
        nuclear = {"nuclear_g": NUCLEAR_G} if case.spins else {}
        field, unit = case.tesla, NUCLEAR_MAGNETON_MHZ_PER_T
        states = zeeman_map(top, [0.0, field], case.g, **with_effects, **nuclear, **COMMON)
    else:
        field, unit = case.kv_per_cm, MHZ_PER_DEBYE_KV_PER_CM
        states = stark_map(top, [0.0, field], **with_effects, **COMMON)
    count = 0
    for twice_m, (energy, vectors) in _states(case).items():
        here = replace(case, twice_m=twice_m)
        acting = full_matrix(here) - full_matrix(replace(here, kv_per_cm=0.0, tesla=0.0))
        slopes = -np.einsum("ij,ik,kj->j", vectors.conj(), acting, vectors).real / field / unit
        m = twice_m / 2 if case.tesla else abs(twice_m) / 2
        at = np.flatnonzero((states.field == field) & (states.m == m))
        gaps = np.minimum(np.diff(energy, prepend=-np.inf), np.diff(energy, append=np.inf))
        for e, slope, gap in zip(energy, slopes, gaps, strict=True):
            row = at[np.abs(states.energy_mhz[at] - e).argmin()]
            assert abs(states.energy_mhz[row] - e) < 1e-6
            if gap > CLOSE_MHZ:
                assert states.slope[row] == pytest.approx(
                    slope, rel=1e-6, abs=1e-8 / gap + 1e-9
                )  # round-off of 1e5 MHz mixes
                count += 1
    return count


@pytest.mark.parametrize("parts", [*ELECTRIC[:2], *MAGNETIC[:2]], ids="+".join)
def test_effective_moments_in_a_field(parts):
    assert _compare_slopes(random_case(parts, np.random.default_rng(5))) > 5


NAMES = {"A": 0, "B": 1, "C": 2, "mu_a": 0, "mu_b": 1, "mu_c": 2}
SCALARS = {"E[1]": "origin", "W[0,1]": "fermi", "G_c[0,1]": "coriolis", "F_ab[0,1]": "f_ab"}


def _with_more(case: Case, name: str) -> Case:
    """The case with one more MHz or debye of a constant, in which H is linear."""
    if name in SCALARS:
        return replace(case, **{SCALARS[name]: getattr(case, SCALARS[name]) + 1.0})
    plain = name.removesuffix("[1]")
    if plain.startswith("mu"):
        return replace(case, dipole=case.dipole + np.eye(3)[NAMES[plain]])
    abc = case.abc.copy()
    abc[int(plain != name), NAMES[plain]] += 1.0
    return replace(case, abc=abc)


def _compare_derivatives(case: Case) -> int:
    """How many derivatives of labelled levels of a fit in a field were compared, ∂E/∂c = ⟨ψ|∂H/∂c|ψ⟩."""
    constants = rotor.Constants(**dict(zip("ABC", case.abc[0], strict=True)), reduction="A", representation="Ir")
    states = None
    if len(case.abc) == 2:
        values = {name: getattr(case, attribute) for name, attribute in SCALARS.items()}
        values |= dict(zip(("A[1]", "B[1]", "C[1]"), case.abc[1].tolist(), strict=True))
        states = StateConstants(values, dipoles={(0, 1): tuple(case.between)})
    top = Top.from_constants(constants, dipole_abc_debye=tuple(case.dipole), states=states)
    steps = round(case.kv_per_cm / FIELD_STEP_KV_PER_CM)
    here = replace(case, kv_per_cm=steps * FIELD_STEP_KV_PER_CM)
    free = [
        (0, 0, 0, 0),
        (1, 0, 1, 0),
        (1, 1, 1, 0),
        (1, 1, 0, 0),
        (1, 0, 1, 1),
        (1, 1, 1, 1),
        (1, 1, 0, 1),
    ]  # J Ka Kc |M|
    labels = [(*jkk, *[v] * (states is not None), m, steps) for *jkk, m in free for v in range(len(case.abc))]
    model = stark_levels(TopConstants(top, dipole=("mu_a", "mu_b", "mu_c")), np.array(labels))
    energies, slopes = model.levels(np.array(list(model.start.values.values())))
    for m in (0, 1):
        at = replace(here, twice_m=2 * m)
        matrix = full_matrix(at)
        acting = [full_matrix(_with_more(at, name)) - matrix for name in model.names]
        energy, vectors = np.linalg.eigh(matrix)
        for row in [row for row, label in enumerate(labels) if label[-2] == m]:
            place = np.abs(energy - energies[row]).argmin()
            assert abs(energy[place] - energies[row]) < 1e-6
            vector = vectors[:, place]
            expected = [(vector.conj() @ part @ vector).real for part in acting]
            np.testing.assert_allclose(slopes[row], expected, rtol=1e-6, atol=1e-5)
    return slopes.size


@pytest.mark.parametrize("parts", ELECTRIC[:2], ids="+".join)
def test_derivatives_of_fits_in_an_electric_field(parts):
    assert _compare_derivatives(random_case(parts, np.random.default_rng(6))) > 20


@pytest.mark.slow
@pytest.mark.parametrize("parts", ELECTRIC[:2], ids="+".join)
def test_derivatives_of_more_fits_in_an_electric_field(parts):
    rng = np.random.default_rng(7)
    assert sum(_compare_derivatives(random_case(parts, rng)) for _ in range(15)) > 500


@pytest.mark.slow
@pytest.mark.parametrize("parts", ELECTRIC, ids="+".join)
def test_lines_of_more_tops(parts):
    rng = np.random.default_rng(ELECTRIC.index(parts))
    assert sum(_compare_lines(random_case(parts, rng), light) for light in LIGHT for _ in range(5)) > 100


@pytest.mark.slow
@pytest.mark.parametrize("parts", [*ELECTRIC, *MAGNETIC], ids="+".join)
def test_effective_moments_of_more_tops(parts):
    rng = np.random.default_rng(len(parts))
    assert sum(_compare_slopes(random_case(parts, rng)) for _ in range(10)) > 50
