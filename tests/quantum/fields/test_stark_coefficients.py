"""Stark coefficients: closed forms, differences of energies of 80 digits, parity, degenerate levels, and the range that is stated."""

import itertools

import mpmath
import numpy as np
import pytest

import rotor
from rotor.quantum.effects.spin_effect import quadrupole_of_tensor
from rotor.quantum.effects.stark import stark_map
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.fields.field_series import field_series
from rotor.quantum.spins import Spin
from rotor.spectra.fields.lines import field_lines
from rotor.spectra.fields.stark_coefficients import level_coefficients, line_coefficients
from rotor.tops.top import Top
from rotor.units import MHZ_PER_DEBYE_KV_PER_CM

DIGITS = 80
GRID = np.linspace(0, 100, 201)  # kV/cm: far beyond the range of the series, which must not matter
PAIRS = [(j, m) for j in range(4) for m in range(j + 1)]
ROD = Top.from_constants("B=6081.5 MHz", dipole_abc_debye=(0.715, 0, 0))
PROLATE = Top.from_constants("A=158000 B=9198.9 MHz", dipole_abc_debye=(3.92, 0, 0))


def table_of(top, j_highest, fields=(0.0,), **settings):
    coefficients = level_coefficients(stark_map(top, fields, j_highest=j_highest, tolerance_mhz=1e-3, **settings))
    keys = zip(coefficients.names["label"].tolist(), coefficients.names["m"].tolist(), strict=True)
    return coefficients, dict(zip(keys, coefficients.coefficients, strict=True))


def second_order(j, k, m):
    """c2 of a symmetric top in μ²/2B: the direction cosines between J and J ± 1 over 2BJ and -2B(J+1).

    C. H. Townes and A. L. Schawlow, Microwave Spectroscopy, 1955, chapter 10; at K = 0 it is [J(J+1) - 3M²]/[J(J+1)(2J-1)(2J+3)]
    (Encyclopedia of Physical Science and Technology, 3rd edition, Microwave Molecular Spectroscopy, Table XXV).
    """
    below = (j**2 - k**2) * (j**2 - m**2) / (j**3 * (4 * j**2 - 1)) if j else 0.0
    n = j + 1
    return below - (n**2 - k**2) * (n**2 - m**2) / (n**3 * (4 * n**2 - 1))


def series_by_differences(terms, count, powers):
    """c1 ... of H_0 + x H_1 + ..., from a polynomial through energies of 80 digits at ten fields near 0."""
    with mpmath.workdps(DIGITS):
        matrices = [mpmath.matrix(term.tolist()) for term in terms]
        fields = [mpmath.mpf(10) ** -6 * (n + 1) for n in range(10)]

        def energies(x):
            return sorted(
                mpmath.eighe(sum((x**n * h for n, h in enumerate(matrices)), 0 * matrices[0]), eigvals_only=True)
            )

        powers_of = mpmath.matrix([[x**p for p in range(10)] for x in fields])
        rows = [energies(x) for x in fields]
        solved = [mpmath.lu_solve(powers_of, mpmath.matrix([row[n] for row in rows])) for n in range(count)]
        return np.array([[float(item[p]) for p in range(1, powers + 1)] for item in solved])


@pytest.mark.parametrize("kind", ["real", "complex"])
@pytest.mark.parametrize("levels", [[0.0, 1, 2, 3.5], [0.0, 0, 0, 1, 2, 2, 5]])
def test_series_are_the_derivatives_of_the_eigenvalues(kind, levels):
    """Random matrices with a quadratic term; the three lowest levels stay together in first order too, but for one of them."""
    rng = np.random.default_rng(3)
    size = len(levels)
    terms = [np.diag(levels)]
    for _ in range(2):
        values = rng.normal(size=(size, size)) + (1j * rng.normal(size=(size, size)) if kind == "complex" else 0)
        terms.append((values + values.conj().T) / 2)
    if levels[1] == 0:
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        terms[1][:3, :3] = turn @ np.diag([1.0, 1.0, 0.0]) @ turn.T
    computed = field_series(tuple(terms), size, 5)
    exact = series_by_differences(terms, size, 5)
    scale = np.abs(exact).max(axis=1, keepdims=True)
    assert (
        np.abs(computed.coefficients - exact).max() <= 1e-11 * scale.max()
    )  # step^5 of the polynomial, 1e-22, and 1e-15 of the sums
    assert (np.abs(computed.coefficients - exact) <= 20 * computed.errors + 1e-13 * scale).all()


def test_a_linear_top_has_minus_mu_squared_over_6b():
    """c2 of J = 0 is -μ²/6B, and parity leaves no odd power, whatever fields the map has (9 % and 0.097 from a polynomial)."""
    computed, rows = table_of(ROD, 3, GRID)
    unit = (0.715 * MHZ_PER_DEBYE_KV_PER_CM) ** 2 / (2 * 6081.5)
    assert rows["0", 0][1] == pytest.approx(-unit / 3, rel=1e-13)  # round-off
    for j, m in PAIRS:
        assert rows[str(j), m][1] == pytest.approx(unit * second_order(j, 0, m), rel=1e-12, abs=1e-12)  # the same
    assert not computed.coefficients[:, ::2].any()
    assert computed.columns["c1_mhz_per_kv_per_cm"].tolist() == [0.0] * len(computed)
    assert computed.errors[:, 1].max() < 1e-11 * unit


def test_a_symmetric_top():
    computed, rows = table_of(PROLATE, 3, GRID)
    first = 3.92 * MHZ_PER_DEBYE_KV_PER_CM
    for j, m in PAIRS:
        for k in range(-j if m else 0, j + 1):  # at M = 0 the states of K and -K are one curve
            row = rows[f"{j} {k}", m]
            linear = -first * k * m / (j * (j + 1)) if j else 0.0  # Encyclopedia ..., eq. 106
            assert row[0] == pytest.approx(linear, rel=1e-14)
            assert row[1] == pytest.approx(
                first**2 / (2 * 9198.9) * second_order(j, k, m), rel=1e-11
            )  # round-off of A K²
    assert len(computed) == 44  # every J, K, M with M ≥ 0, K ≥ 0 at M = 0
    odd = computed.coefficients[[k * m != 0 for k, m in ((int(a.split()[1]), b) for a, b in rows)], 2]
    assert (odd != 0).all()


@pytest.mark.parametrize(("j", "k", "m"), [(0, 0, 0), (1, 1, 1), (2, -1, 1), (3, 2, 1)])
def test_all_powers_against_differences_of_eighty_digits(j, k, m):
    """The band matrix of one K and M, written out, with 80 digits: c1 to c4."""
    ours = table_of(PROLATE, 3)[1][f"{j} {k}", m]
    lowest = max(abs(k), abs(m))
    levels = range(lowest, j + 5)
    with mpmath.workdps(DIGITS):
        free = mpmath.diag([mpmath.mpf(9198.9) * n * (n + 1) for n in levels])
        slope = mpmath.zeros(len(levels))
        unit = -mpmath.mpf(3.92) * mpmath.mpf(MHZ_PER_DEBYE_KV_PER_CM)
        for place, n in enumerate(levels):
            slope[place, place] = unit * k * m / (n * (n + 1)) if n else 0
            if place:
                root = mpmath.sqrt((n * n - k * k) * (n * n - m * m) / (4 * mpmath.mpf(n) ** 2 - 1)) / n
                slope[place, place - 1] = slope[place - 1, place] = unit * root
        step = mpmath.mpf(10) ** -5

        def energy(x):
            return sorted(mpmath.eigsy(free + x * slope, eigvals_only=True))[j - lowest]

        e = {n: energy(n * step) for n in range(-3, 4)}
        exact = [
            (e[1] - e[-1]) / (2 * step),
            (e[1] - 2 * e[0] + e[-1]) / step**2 / 2,
            (e[2] - 2 * e[1] + 2 * e[-1] - e[-2]) / (2 * step**3) / 6,
            (e[2] - 4 * e[1] + 6 * e[0] - 4 * e[-1] + e[-2]) / step**4 / 24,
        ]
    assert ours == pytest.approx([float(item) for item in exact], rel=1e-8, abs=1e-12)  # step² of the differences


def test_a_tilted_field_has_the_same_coefficients():
    """M is mixed, so that all M of a level coincide at zero field."""
    straight = level_coefficients(stark_map(ROD, [0.0], j_highest=2, tolerance_mhz=1e-3))
    tilted = level_coefficients(stark_map(ROD, [0.0], j_highest=2, tolerance_mhz=1e-3, direction=(1, 0.3, 2)))
    both_signs = np.repeat(straight.coefficients, np.where(straight.names["m"] == 0, 1, 2), axis=0)
    assert np.sort(tilted.coefficients[:, 1]) == pytest.approx(np.sort(both_signs[:, 1]), rel=1e-11)
    assert np.sort(tilted.coefficients[:, 3]) == pytest.approx(np.sort(both_signs[:, 3]), rel=1e-10, abs=1e-15)
    assert not tilted.coefficients[:, ::2].any()


@pytest.mark.parametrize("direction", [(0, 0, 1), (1, 0.3, 2)])
def test_parity_and_degeneracy_beside_light(direction):
    """The light of a laser mixes J in the free states: M and -M still coincide, and still no odd power is left."""
    rod = ROD.with_polarizability(np.diag([8.0, 4, 4]), "made up")
    skew = Top.from_constants("A=9500 B=4200 C=3100 MHz", dipole_abc_debye=(1.1, 0.7, 0.4))
    skew = skew.with_polarizability(np.diag([8.0, 5, 3]), "made up")
    for top in (rod,) if direction[0] else (rod, skew):
        settings = {"j_highest": 2, "intensity_w_per_cm2": 2e10, "direction": direction, "tolerance_mhz": 1e-4}
        coefficients = level_coefficients(stark_map(top, [0.0], **settings))
        apart = np.abs(np.subtract.outer(*[stark_map(top, [0.0], **settings).energy_mhz] * 2)) + 1e9 * np.eye(
            len(coefficients)
        )
        single = apart.min(axis=1) > 1e-6
        assert not coefficients.coefficients[single, ::2].any()
        assert np.abs(coefficients.coefficients[:, :3:2]).max() < 1e-9  # round-off, over small gaps
        small = min(0.3 * coefficients.valid_to_kv_per_cm.min(), 0.1)
        states = stark_map(top, [0.0, small], **settings)
        shift = states.energy_mhz[1::2] - states.energy_mhz[::2]
        assert (coefficients.coefficients * small ** np.arange(1, 5)).sum(axis=1) == pytest.approx(
            shift, rel=1e-4, abs=1e-6
        )  # E⁶


def test_asymmetric_tops_have_no_linear_effect():
    """Doublets of H2CO have a large c2 and a short range: 2_21 and 2_20, 2 MHz apart."""
    computed, rows = table_of(rotor.read("H2CO"), 2)
    assert not computed.coefficients[:, ::2].any()
    skew = Top.from_constants("A=9500 B=4200 C=3100 MHz", dipole_abc_debye=(1.1, 0.7, 0.4))  # complex matrices at M > 0
    assert not table_of(skew, 2)[0].coefficients[:, ::2].any()
    upper, lower = rows["2 2 0", 1], rows["2 2 1", 1]
    assert upper[1] == pytest.approx(-lower[1], rel=2e-3)
    ranges = dict(zip(rows, computed.valid_to_kv_per_cm, strict=True))
    assert ranges["2 2 0", 1] < 0.1 < 10 < ranges["0 0 0", 0]


@pytest.mark.parametrize("name", ["OCS", "CH3CN", "H2CO", "indole"])
def test_inside_the_range_the_series_is_the_solved_energy(name):
    top = rotor.read(name)
    computed, _ = table_of(top, 2)
    checked = 0
    for part, far in ((1.0, 0.03), (0.25, 1e-4)):  # 1 % each of E⁵ and E⁶, the next ones added; 4⁻⁴ of that
        fields = part * computed.valid_to_kv_per_cm
        for field in np.unique(fields.round(9))[:: 1 if name == "OCS" else 9]:
            states = stark_map(top, [0.0, field], j_highest=2, tolerance_mhz=1e-6)
            shift = states.energy_mhz[1::2] - states.energy_mhz[::2]
            here = np.isclose(fields, field, rtol=1e-6)
            series = (computed.coefficients * field ** np.arange(1, 5)).sum(axis=1)
            largest = np.abs(computed.coefficients * field ** np.arange(1, 5)).max(axis=1)
            assert (np.abs(series - shift)[here] <= far * largest[here] + 1e-5).all()  # the tolerance of the map
            checked += int(here.sum())
    assert checked >= 6


def test_lines_have_the_difference_of_their_states():
    lines = field_lines(PROLATE, [0.0, 1.0, 2.0], j_highest=2, light="isotropic")
    coefficients = line_coefficients(lines)
    _, rows = table_of(PROLATE, 2)
    names = [coefficients.names[name].tolist() for name in ("upper", "upper_m", "lower", "lower_m")]
    for upper, upper_m, lower, lower_m, row in zip(*names, coefficients.coefficients, strict=True):
        pairs = itertools.product((upper,), (lower,), (1, -1))  # K and -K with one M: of the pair either sign
        signs = [rows[a, upper_m] * [s, 1, s, 1] - rows[b, lower_m] * [s, 1, s, 1] for a, b, s in pairs]
        assert any(row == pytest.approx(other, rel=1e-10, abs=1e-9) for other in signs)
    assert len(coefficients) == len(lines.pairs()) > 20


def test_states_with_spins():
    """Levels with a quadrupole nucleus: derivatives at zero of the energies that are solved, F and -M_F together."""
    nitrogen = quadrupole_of_tensor(Spin("14N", 2), np.diag([-4.2, 2.1, 2.1]))
    effects = (*SEMI_RIGID, nitrogen)
    top = Top.from_constants("B=4549.06 MHz", dipole_abc_debye=(3.73, 0, 0))
    coefficients = level_coefficients(stark_map(top, [0.0], j_highest=1, effects=effects, tolerance_mhz=1e-6))
    step = 2e-3
    states = stark_map(top, [0.0, step, 2 * step], j_highest=1, effects=effects, tolerance_mhz=1e-6)
    e = states.energy_mhz.reshape(-1, 3)
    by_steps = (16 * (e[:, 1] - e[:, 0]) - (e[:, 2] - e[:, 0])) / (12 * step**2)
    assert len(coefficients) == len(e) > 6
    assert coefficients.coefficients[:, 1] == pytest.approx(
        by_steps, rel=1e-3, abs=1e-3
    )  # E⁶ of levels 1 MHz apart, 1e-9 MHz over step²
    lines = line_coefficients(field_lines(top, [0.0, 0.1], j_highest=1, effects=effects))
    assert np.isfinite(lines.coefficients).all()
    assert np.abs(lines.coefficients[:, 1]).max() > 1


def test_fields_below_zero_name_their_states():
    """At negative fields the state with K M > 0 is the higher one."""
    skew = {"direction": (1, 0.3, 2)}  # all M of one K are a block, whose ranks turn round with the field
    below, above = (table_of(PROLATE, 1, fields, **skew)[0] for fields in ([-1.0, 0.0], [0.0, 1.0]))
    states = stark_map(PROLATE, [-1.0, 0.0], j_highest=1, tolerance_mhz=1e-3, **skew)
    shift = states.energy_mhz[::2] - states.energy_mhz[1::2]
    assert (below.coefficients * [-1, 1, -1, 1]).sum(axis=1) == pytest.approx(shift, abs=0.05)  # E⁵ at 1 kV/cm
    assert below.names["label"].tolist() == above.names["label"].tolist()
    assert np.abs(below.coefficients[:, 0] - above.coefficients[:, 0]).max() > 100


def test_coefficients_do_not_depend_on_levels_between_those_of_a_map():
    """Levels beyond the basis lie among those of the map: each state has its coefficients, by label."""
    top = Top.from_constants("A=10 B=6 C=4 GHz", dipole_abc_debye=(0.1, 0, 0))
    near, far = (stark_map(top, [0.0, 0.1], j_highest=6, m_values=(2,), jmax=jmax) for jmax in (None, 14))
    assert near.jmax < 9  # 9 0 9 lies below 6 6 0
    few, many = level_coefficients(near), level_coefficients(far)
    assert few.names["label"].tolist() == many.names["label"].tolist()
    np.testing.assert_allclose(few.coefficients[:, 1], many.coefficients[:, 1], rtol=1e-9)
