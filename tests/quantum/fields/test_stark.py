"""Stark maps: reference files, formulas of perturbation theory, pendular states, labels, bad input."""

from __future__ import annotations

import gzip
import itertools
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import obl_cv

from rotor.quantum.effects.stark import MHZ_ANGSTROM3_W_PER_CM2, stark_map
from rotor.quantum.fields.blocks import Contraction
from rotor.quantum.fields.chains import chain_states, is_chain
from rotor.quantum.fields.diabatic import crossings
from rotor.quantum.fields.solved_space import field_space
from rotor.quantum.fields.solver import solve_fields, spanned_states
from rotor.tops.top import Top
from rotor.units import MHZ_PER_DEBYE_KV_PER_CM, PLANCK_J_S

OCS = Top.from_constants("B=6081.492475 D=1.301777e-3 MHz", dipole_abc_debye=(0.71519, 0, 0))
CH3CN = Top.from_constants("A=158099 B=9198.899167 DJ=3.807576e-3 DJK=0.177407 MHz", dipole_abc_debye=(3.92197, 0, 0))
H2CO = Top.from_constants("A=281970.56 B=38833.987 C=34004.244 MHz", dipole_abc_debye=(2.3317, 0, 0))
BENZONITRILE = Top.from_constants(
    "A=5655.2654 B=1546.875864 C=1214.40399 DeltaJ=45.6e-6 DeltaJK=938.1e-6 DeltaK=500e-6 deltaJ=10.95e-6 deltaK=628e-6 MHz",
    dipole_abc_debye=(4.5152, 0, 0),
)


def table(shared: Path, name: str) -> np.ndarray:
    with gzip.open(shared / "reference" / "fields" / f"{name}.csv.gz") as handle:
        return np.genfromtxt(handle, delimiter=",", comments="#", skip_header=1)


# Reference files


@pytest.mark.oracle
def test_ocs_to_a_hertz(shared):
    """To the accuracy of the file, 1e-6 MHz."""
    reference = table(shared, "stark_ocs")
    stark = stark_map(OCS, reference[:, 0], j_highest=5)
    names = ["J0M0", "J1M0", "J2M0", "J3M0", "J1M1", "J2M1", "J3M1", "J4M1", "J2M2", "J3M2", "J4M2", "J5M2"]
    for column, name in enumerate(names, 1):
        rows = stark.curve(name[1], int(name[3]))
        assert np.abs(stark.energy_mhz[rows] - reference[:, column]).max() < 1e-6


@pytest.mark.oracle
def test_stark_levels_of_ch3cn_meet_the_reference(shared):
    """To 2e-6 MHz, the accuracy of the file; signs of K and M there are those of the other sign of the field here or there."""
    reference = table(shared, "stark_ch3cn")
    stark = stark_map(CH3CN, reference[:, 0], j_highest=6, m_values=(0, 1, 2))
    for m in range(3):
        for k in range(-3, 4):
            first = 1 + 4 * ((k + 3) + 7 * m)
            curves = [
                c for c in stark.curves() if stark.m[c.start] == m and stark.block[c.start] == f"k={k if m else abs(k)}"
            ]
            ours = np.array([stark.energy_mhz[c] for c in curves[:4]]).T
            assert np.abs(ours - reference[:, first : first + 4]).max() < 2e-6, (k, m)


@pytest.mark.oracle
def test_stark_levels_of_h2co_meet_the_reference(shared):
    """The lowest 16 states of M = 0, 1, 2 to 1e-5 MHz, the accuracy of the file, from the ground state without field."""
    reference = table(shared, "stark_H2CO_Jmax15")
    stark = stark_map(H2CO, reference[::5, 0], j_highest=9, m_values=(0, 1, 2), tolerance_mhz=1e-4)
    for m in range(3):
        curves = [stark.energy_mhz[c] for c in stark.curves() if stark.m[c.start] == m]
        lowest = np.sort(np.array(curves), axis=0)[:16].T
        assert np.abs(lowest - reference[::5, 1 + 16 * m : 17 + 16 * m]).max() < 1e-5


def test_benzonitrile_ground_state_at_100_kv_per_cm():
    """-1.34489847e-22 J: the test of CMIstark (the same constants, J ≤ 15)."""
    stark = stark_map(BENZONITRILE, [100.0], j_highest=0, jmax=15)
    joule = stark.energy_mhz[0] * 1e6 * PLANCK_J_S
    assert joule == pytest.approx(-1.34489847e-22, rel=3e-8)  # its constants are of an older CODATA, 1.4e-8 apart


# Formulas


def test_without_field_levels_are_those_of_the_free_top():
    stark = stark_map(H2CO, [0.0], j_highest=2, tolerance_mhz=1e-3)
    space = field_space(H2CO, 2, [Contraction(H2CO.dipole_abc_debye, [0, 0, 1])])
    labels = {space.levels.label(row): energy for row, energy in enumerate(space.levels.energy_mhz)}
    assert [stark.energy_mhz[i] for i in range(len(stark))] == pytest.approx(
        [labels[str(name)] for name in stark.label], abs=1e-6
    )  # round-off of 1e6 MHz
    assert np.abs(stark.slope).max() < 1e-6  # no dipole without a field
    assert not np.signbit(stark.slope[stark.slope == 0]).any()  # 0 in tables, not -0


@pytest.mark.parametrize(
    ("j", "m", "coefficient"),
    [
        (0, 0, -3.55245003), (1, 0, 2.13147002), (1, 1, -1.06573501), (2, 0, 0.50749286), (2, 1, 0.25374643), (2, 2, -0.50749286),
        (3, 0, 0.23683000), (3, 1, 0.17762250), (3, 2, 0.0), (3, 3, -0.29603750),
    ],
)  # fmt: skip
def test_second_order_coefficients_of_ocs(j, m, coefficient):
    """W/E² = (μ²/2hB) [J(J+1) - 3M²]/[J(J+1)(2J-1)(2J+3)], in MHz/(kV/cm)², for the rigid top."""
    rigid = Top.from_constants("B=6081.492475 MHz", dipole_abc_debye=(0.71519, 0, 0))
    stark = stark_map(rigid, [0.0, 0.05], j_highest=3, tolerance_mhz=1e-9)
    rows = stark.curve(str(j), m)
    energies = stark.energy_mhz[rows]
    assert (energies[1] - energies[0]) / 0.0025 == pytest.approx(coefficient, abs=5e-6)  # fourth order: 2e-6


@given(k=st.integers(-3, 3), m=st.integers(1, 3))
@settings(max_examples=12)
def test_first_order_of_a_symmetric_top(k, m):
    """dW/dE = -μ KM/[J(J+1)]; the slope of (K, M) and that of (-K, M) are opposite."""
    stark = stark_map(CH3CN, [0.0], j_highest=3, m_values=(m,))
    for rows in stark.curves():
        j, state_k = (int(part) for part in stark.label[rows.start].split())
        if state_k == k and j >= m:
            assert stark.slope[rows.start] == pytest.approx(3.92197 * k * m / (j * (j + 1)) if j else 0.0, abs=1e-6)


@pytest.mark.parametrize("omega", [1.0, 50.0, 500.0])
def test_pendular_energies_are_spheroidal_characteristic_values(omega):
    """H/B = J² - Δω cos²θ: obl_cv(M, J, √Δω); a laser without a static field."""
    intensity = omega * 6000.0 / (MHZ_ANGSTROM3_W_PER_CM2 * 4.0)
    top = Top.from_constants("B=6000 MHz", dipole_abc_debye=(0.0, 0, 0)).with_polarizability(
        np.diag([4.0, 0, 0]), "test"
    )
    stark = stark_map(top, [0.0], j_highest=2, intensity_w_per_cm2=intensity, tolerance_mhz=1e-7)
    for rows in stark.curves():
        j, m = int(stark.label[rows.start]), int(stark.m[rows.start])
        assert stark.energy_mhz[rows.start] / 6000.0 == pytest.approx(obl_cv(m, j, np.sqrt(omega)), abs=1e-10)


@pytest.mark.oracle
def test_pendular_cosines(shared):
    """Alignment and orientation to 1e-10 (the files: 1e-12)."""
    for row in table(shared, "pendular_alignment"):
        omega, j, m, energy, cosine = row[0], int(row[1]), int(row[2]), row[3], row[4]
        intensity = omega * 6000.0 / (MHZ_ANGSTROM3_W_PER_CM2 * 4.0)
        top = Top.from_constants("B=6000 MHz").with_polarizability(np.diag([4.0, 0, 0]), "test")
        stark = stark_map(top, [0.0], j_highest=j, m_values=(m,), intensity_w_per_cm2=intensity)
        place = stark.curve(str(j), m).start
        assert stark.energy_mhz[place] / 6000 == pytest.approx(energy, abs=1e-9)  # 1e-6 MHz asked for
        assert stark.cosines["cos2theta"][place] == pytest.approx(
            cosine, abs=1e-7
        )  # a vector is as good as √ of the energy
    for omega, j, m, energy, cosine in table(shared, "pendular_orientation"):
        field = omega * 6000.0 / MHZ_PER_DEBYE_KV_PER_CM
        top = Top.from_constants("B=6000 MHz", dipole_abc_debye=(1.0, 0, 0))
        stark = stark_map(top, [field], j_highest=int(j), m_values=(int(m),))
        place = stark.curve(str(int(j)), int(m)).start
        assert stark.energy_mhz[place] / 6000 == pytest.approx(energy, abs=1e-9)  # 1e-6 MHz asked for
        assert stark.cosines["costheta"][place] == pytest.approx(cosine, abs=1e-7)  # as above


def test_effective_dipole_is_minus_the_slope_of_the_energy():
    fields = np.array([49.99, 50.0, 50.01])
    stark = stark_map(BENZONITRILE, fields, j_highest=1, tolerance_mhz=1e-6)
    for rows in stark.curves():
        slope = (stark.energy_mhz[rows][2] - stark.energy_mhz[rows][0]) / 0.02
        assert -slope / MHZ_PER_DEBYE_KV_PER_CM == pytest.approx(
            stark.slope[rows][1], abs=2e-6
        )  # third derivative, round-off


# J max and bases


def test_j_max_follows_from_the_tolerance():
    coarse, fine = (stark_map(OCS, [1000.0], j_highest=1, tolerance_mhz=t) for t in (1.0, 1e-8))
    assert coarse.jmax < fine.jmax
    assert np.abs(coarse.energy_mhz - fine.energy_mhz).max() < 1.0  # what was asked for
    assert fine.edge_population.max() < 1e-12  # leakage that goes with 1e-8 MHz


def test_processes_change_no_number():
    """Chains that one sweep holds, an asymmetric top, and a map of so many fields that its chains are solved apart."""
    with ThreadPoolExecutor(2) as pool:
        for top, fields in ((OCS, 50), (nearly_c2v(0.1), 3), (OCS, 20_000)):
            grid = np.linspace(0, 100, fields)
            maps = [stark_map(top, grid, j_highest=2, tolerance_mhz=1e-3, executor=item) for item in (None, pool)]
            assert (maps[0].energy_mhz == maps[1].energy_mhz).all()
            assert (maps[0].cosines["costheta"] == maps[1].cosines["costheta"]).all()


def test_a_j_max_too_small_is_refused():
    with pytest.raises(ValueError, match="J max 6 is too small"):
        stark_map(OCS, [500.0], j_highest=2, jmax=6)
    with pytest.raises(ValueError, match="J max 4 is too small: a state has"):
        stark_map(OCS, [100.0], j_highest=1, jmax=4, tolerance_mhz=10.0)


def test_accuracy_and_leakage_stand_beside_each_state():
    """The highest state is the least accurate; a tolerance of energies alone would leave cosines wrong: J max rises for those too."""
    stark = stark_map(OCS, [0.0, 1000.0], j_highest=3, tolerance_mhz=1e-6)
    finer = stark_map(OCS, [0.0, 1000.0], j_highest=3, tolerance_mhz=1e-8)
    assert stark.truncation_mhz.max() < 1e-6
    error = np.abs(stark.energy_mhz - finer.energy_mhz)
    assert (error <= stark.truncation_mhz + 2 * stark.round_off_mhz).all()  # both maps have round-off
    assert error[stark.curve("3", 0)][1] > 1e-8 > stark.truncation_mhz[stark.curve("0", 0)][1]
    rough = stark_map(OCS, [300.0], j_highest=1, tolerance_mhz=1e3)
    assert rough.edge_population.max() <= 1e-6  # the rule
    assert np.abs(rough.cosines["costheta"] - stark_map(OCS, [300.0], j_highest=1).cosines["costheta"]).max() < 1e-5


def test_the_reduced_basis_gives_the_energies_of_the_full_matrix():
    rng = np.random.default_rng(7)
    fixed = np.diag(np.sort(rng.uniform(0, 1e6, 200)))
    slope = rng.normal(size=(200, 200))
    slope = slope + slope.T
    fields = np.linspace(0, 300, 61)
    reduced, _, _ = spanned_states((fixed, slope), fields, 8, 1e-4)[1]
    whole, _, _ = solve_fields((fixed, slope), fields, 8)
    assert np.abs(reduced - whole).max() < 1e-4  # the tolerance


# Labels


def nearly_c2v(mu_b: float) -> Top:
    return Top.from_constants("A=5655.2654 B=1546.875864 C=1214.40399 MHz", dipole_abc_debye=(4.5152, mu_b, 0))


@pytest.mark.slow
def test_adiabatic_labels_do_not_depend_on_the_grid():
    """76 to 2401 fields: at those that all grids have, each label has one energy."""
    computed = [
        stark_map(nearly_c2v(0.05), np.linspace(0, 150, n), j_highest=2, m_values=(1,), tolerance_mhz=1e-3)
        for n in (76, 601, 2401)
    ]
    for rows in zip(*(entry.curves() for entry in computed), strict=True):
        assert len({str(entry.label[r.start]) for entry, r in zip(computed, rows, strict=True)}) == 1
        sampled = [
            entry.energy_mhz[r][:: (len(entry.fields) - 1) // 75] for entry, r in zip(computed, rows, strict=True)
        ]
        assert np.ptp(sampled, axis=0).max() < 2e-3  # the tolerance, twice


def test_labels_by_overlap_would_depend_on_the_grid():
    """Why they are not used: following the largest overlap from field to field gives other names on another grid."""
    space = field_space(nearly_c2v(0.05), 15, [Contraction((4.5152, 0.05, 0), [0, 0, 1])])
    block = space.blocks(1)[0]
    slope = -MHZ_PER_DEBYE_KV_PER_CM * block.matrix(Contraction((4.5152, 0.05, 0), [0, 0, 1]))
    names = []
    for count in (76, 301):
        _, vectors, _ = solve_fields((np.diag(block.energies_mhz), slope), np.linspace(0, 150, count), 40)
        order = np.arange(40)
        for before, after in itertools.pairwise(vectors):
            order = order[np.argmax(np.abs(before.T @ after), axis=0)]
        names.append(order)
    assert (names[0] != names[1]).any()


@pytest.mark.slow
def test_diabatic_labels_converge_and_tend_to_those_of_the_symmetric_molecule():
    """With μ_b = 1e-4 D the crossings of C2v species are avoided by below 5 MHz, and its true gaps are above."""

    def ends(computed, column: str) -> dict:
        names = getattr(computed, column)
        return {
            (str(names[r.stop - 1]), int(computed.m[r.start])): computed.energy_mhz[r][-1] for r in computed.curves()
        }

    settings = {"j_highest": 2, "m_values": (1,), "tolerance_mhz": 1e-3, "diabatic_gap_mhz": 5.0}
    symmetric = ends(stark_map(nearly_c2v(0.0), np.linspace(0, 100, 11), **settings), "diabatic_label")
    coarse, fine = (stark_map(nearly_c2v(1e-4), np.linspace(0, 100, n), **settings) for n in (11, 41))
    for computed in (coarse, fine):
        named = ends(computed, "diabatic_label")
        assert {key: named[key] for key in symmetric} == pytest.approx(
            symmetric, abs=5e-3
        )  # μ_b to second order: 1e-3 MHz
    assert (
        max(abs(ends(fine, "label")[key] - symmetric[key]) for key in symmetric) > 1e3
    )  # adiabatic ones do cross over


def test_states_that_take_the_label_of_a_followed_level_are_listed():
    """At crossings labels of J = 2 pass to states of J = 3, whose energies have no bound; a label stands once at a field."""
    settings = {"j_highest": 2, "m_values": (1,), "tolerance_mhz": 1.0, "diabatic_gap_mhz": 5.0}
    states = stark_map(nearly_c2v(1e-4), np.linspace(0, 25, 3), **settings)
    beyond = np.isnan(states.truncation_mhz)
    assert set(states.label[beyond]) == {"3 0 3", "3 1 3", "3 1 2"}
    followed = {label for label in states.label if label[0] < "3"}
    for field in states.fields:
        labels = states.diabatic_label[states.field == field].tolist()
        assert followed <= set(labels)
        assert len(labels) == len(set(labels))


def test_two_crossings_between_two_fields_are_seen():
    """sin(9x + 0.4) crosses 0 at (π - 0.4)/9 and (2π - 0.4)/9; a level far off, which has no slope, does not stop the search."""

    def solve(x):
        levels = np.stack([100 * np.sin(9 * x + 0.4), 0 * x, 0 * x + 1000], axis=-1)
        slopes = np.stack([900 * np.cos(9 * x + 0.4), 0 * x, 0 * x], axis=-1)
        order = np.argsort(levels, axis=-1)
        return np.take_along_axis(levels, order, -1), np.take_along_axis(slopes, order, -1)

    computed = crossings(solve, np.array([0.0, 1.0]), 1.0)
    assert [rank for _, rank in computed] == [0, 0]
    assert [at for at, _ in computed] == pytest.approx([(np.pi - 0.4) / 9, (2 * np.pi - 0.4) / 9], abs=1e-4)


# Bad input


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"fields_kv_per_cm": [1e7]}, "no molecule holds together"),
        ({"fields_kv_per_cm": [0.0, 1.0, -1e7]}, "a field of -1e\\+07 kV/cm is beyond"),
        ({"fields_kv_per_cm": [np.nan]}, "finite"),
        ({"fields_kv_per_cm": []}, "finite"),
        ({"j_highest": -1}, "j_highest: -1: expected a whole number"),
        ({"m_values": (3,)}, "m_values: "),
        ({"intensity_w_per_cm2": -1.0}, "intensity_w_per_cm2: -1"),
        ({"intensity_w_per_cm2": 1e10}, "polarizability"),
        ({"tolerance_mhz": 0.0}, "tolerance"),
        ({"diabatic_gap_mhz": -1.0}, "diabatic_gap_mhz: -1"),
        ({"top": Top.from_constants("B=6000 MHz")}, "dipole"),
        ({"top": Top.from_constants("B=6000 MHz", dipole_abc_debye=(0, 0, 0))}, "no dipole"),
    ],
)
def test_stark_maps_refuse_bad_input(change, message):
    arguments = {"top": OCS, "fields_kv_per_cm": [0.0, 10.0], "j_highest": 1, **change}
    with pytest.raises(ValueError, match=message):
        stark_map(arguments.pop("top"), arguments.pop("fields_kv_per_cm"), **arguments)


# Chains


@given(seed=st.integers(0, 10**6), size=st.integers(4, 24))
@settings(max_examples=25)
def test_chains_have_the_states_of_the_full_matrix_or_none(seed, size):
    """Random tridiagonal matrices, levels as close as they fall: LAPACK's energies, vectors without residual, or no answer."""
    rng = np.random.default_rng(seed)
    fixed = np.diag(np.sort(rng.uniform(0, 1e5, size)))
    beside = rng.normal(size=size - 1)
    slope = np.diag(beside, 1) + np.diag(beside, -1) + np.diag(rng.normal(size=size))
    fields, count = np.linspace(-200, 300, 61), 3
    assert is_chain((fixed, slope))
    computed = chain_states([((fixed, slope), count)], fields)
    matrices = fixed + fields[:, None, None] * slope
    if computed is None:
        return
    energies, vectors = computed[0]
    assert np.abs(energies - np.linalg.eigvalsh(matrices)[:, :count]).max() < 1e-9  # round-off of 1e5
    residual = matrices @ vectors - energies[:, None, :] * vectors
    assert np.abs(residual).max() < 1e-4  # the last change: 1e-9 of a gap, which is at most 1e5; seen: 4e-7
    assert np.abs((vectors**2).sum(axis=1) - 1).max() < 1e-14


def test_chains_of_a_top_are_solved_without_lapack():
    """The iteration succeeds for OCS: else the test above would be about nothing."""
    space = field_space(OCS, 14, [Contraction(OCS.dipole_abc_debye, [0, 0, 1.0])])
    chains, fields = [], np.linspace(0, 200, 201)
    for m in range(3):
        block = space.blocks(m)[0]
        slope = -MHZ_PER_DEBYE_KV_PER_CM * block.matrix(Contraction(OCS.dipole_abc_debye, [0, 0, 1.0]))
        chains.append(((np.diag(block.energies_mhz), slope), 3 - m))
    together = chain_states(chains, fields)
    for (terms, count), (energies, vectors) in zip(chains, together, strict=True):
        slow = np.linalg.eigh(terms[0] + fields[:, None, None] * terms[1])
        assert np.abs(energies - slow.eigenvalues[:, :count]).max() < 1e-8  # round-off of 1.3e6 MHz
        overlap = np.abs(np.einsum("fns,fns->fs", vectors, slow.eigenvectors[:, :, :count]))
        assert np.abs(overlap - 1).max() < 1e-12  # square of the last change over the gap, 1e-9, and round-off
    assert not is_chain((slope, slope @ slope))


@pytest.mark.parametrize(("field", "jmax"), [(200.0, 25), (20000.0, 60)])
def test_round_off_is_stated(field, jmax):
    """Energies of 40 digits differ by less than what is stated, and by more than a ten-thousandth of it."""
    stark = stark_map(OCS, [field], j_highest=1, m_values=(0,), jmax=jmax)
    with mpmath.workdps(40):
        b, d = (mpmath.mpf(OCS.constants.values[name]) for name in ("B", "D"))
        scale = mpmath.mpf(MHZ_PER_DEBYE_KV_PER_CM) * mpmath.mpf(OCS.dipole_abc_debye[0]) * field
        size = stark.jmax + 20
        main = [b * j * (j + 1) - d * (j * (j + 1)) ** 2 for j in range(size)]
        squares = [(scale * j) ** 2 / (4 * j * j - 1) for j in range(1, size)]
        lowest = [_nth_energy(main, squares, rank, stark.energy_mhz[rank]) for rank in (0, 1)]
    errors = [abs(float(true - mpmath.mpf(item))) for true, item in zip(lowest, stark.energy_mhz.tolist(), strict=True)]
    assert stark.round_off_mhz[0] <= stark.accuracy_mhz
    assert 1e-4 * stark.round_off_mhz[0] < max(errors) <= stark.round_off_mhz[0]


def _nth_energy(main, squares, rank, near):
    """The eigenvalue of a rank of a tridiagonal matrix by bisection with counts of negative pivots, 1e-3/2^70 MHz."""

    def below(x):
        count, pivot = 0, main[0] - x
        for diagonal, square in zip(main[1:], squares, strict=True):
            count += pivot < 0
            pivot = diagonal - x - square / pivot
        return count + (pivot < 0)

    low, high = mpmath.mpf(near) - 1e-3, mpmath.mpf(near) + 1e-3
    assert below(low) <= rank < below(high)
    for _ in range(70):
        middle = (low + high) / 2
        low, high = (middle, high) if below(middle) <= rank else (low, middle)
    return low


def test_a_tolerance_that_round_off_does_not_allow_is_refused():
    with pytest.raises(ValueError, match="have a round-off of"):
        stark_map(OCS, [20000.0], j_highest=1, tolerance_mhz=1e-14)


def test_a_vector_connects_nothing_where_j_even_and_odd_are_apart():
    light = Contraction(np.diag([2.0, 1.0, 1.0]), np.diag([0.0, 0.0, 1.0]))
    blocks = field_space(OCS, 6, [light]).blocks(0)
    assert len(blocks) == 2
    for block in blocks:
        assert np.abs(block.matrix(light)).max() > 0
        assert np.abs(block.matrix(Contraction((1.0, 0.0, 0.0), [0, 0, 1]))).max() == 0
