"""Energy, entropy and heat capacity of rotation: closed forms, sums in 150 digits, derivatives, species, limits."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rotor
from rotor import units
from rotor.quantum.solve import solve_levels
from rotor.thermodynamics.functions import GAS_CONSTANT, species_names, thermodynamic_functions, translational_entropy
from rotor.thermodynamics.sums.classical_limit import classical_limit, rotational_temperatures_k
from rotor.thermodynamics.sums.classical_onset import classical_above_k
from rotor.thermodynamics.sums.level_sums import level_sums
from rotor.thermodynamics.sums.partition import partition_function
from rotor.thermodynamics.sums.species import implied_symmetry_number, spin_species
from rotor.thermodynamics.vibration import VibrationalStates, vibrational_functions
from rotor.tops.constants.constants import Constants
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.top import Top

COLD_TO_HOT = [5.0, 20.0, 77.0, 150.0, 298.15, 600.0, 1000.0]
WITH_SPECIES = ("H2", "water", "NH3", "CH4", "C2H4", "C6H6", "SF6", "CCl4")


def plain_functions(energies_k, degeneracies, temperature_k):
    """ln q, U/RT and C_v/R of listed levels, in 150 digits: below 10 K the last is a difference of equal numbers."""
    with mpmath.workdps(150):
        t = mpmath.mpf(temperature_k)
        terms = [
            (g * mpmath.exp(-mpmath.mpf(e) / t), mpmath.mpf(e) / t)
            for e, g in zip(energies_k, degeneracies, strict=True)
        ]
        q, first, second = (mpmath.fsum(w * x**n for w, x in terms) for n in (0, 1, 2))
        mean = first / q
        return float(mpmath.log(q)), float(mean), float(second / q - mean**2)


def hydrogen_levels(parity=None):
    """E/k and (2J+1) g_I of H2 to J = 25 by its four constants, energies from J = 0."""
    c = rotor.read("H2").constants
    energies, degeneracies = [], []
    for j in range(26):
        if parity is None or j % 2 == parity:
            x = j * (j + 1)
            mhz = c["B"] * x - c["D"] * x**2 + c["H"] * x**3 + c["L"] * x**4
            energies.append(mhz / units.MHZ_PER_K)
            degeneracies.append((2 * j + 1) * (3 if j % 2 else 1))
    return energies, degeneracies


@pytest.mark.parametrize(("species", "parity"), [("equilibrium", None), ("para", 0), ("ortho", 1)])
def test_hydrogen_is_the_sum_over_its_levels_in_150_digits(species, parity):
    functions = thermodynamic_functions(rotor.read("H2"), COLD_TO_HOT, species=species, relative_error=1e-13)
    for i, t in enumerate(COLD_TO_HOT):
        ln_q, mean, cv = plain_functions(*hydrogen_levels(parity), t)
        # round-off of some 20 terms, and of E/kT = 34 of ortho's lowest level at 5 K; truncation where H2's series ends
        within = 2e-14 + 2 * functions.relative_error[i]
        assert functions.relative_error[i] < (1e-13 if t < 900 else 1e-5)
        assert math.log(functions.q_rot[i]) == pytest.approx(ln_q, rel=0, abs=within * max(1, abs(ln_q)))
        assert functions.energy_j_per_mol[i] == pytest.approx(GAS_CONSTANT * t * mean, rel=within, abs=0)
        assert functions.cv_over_r[i] == pytest.approx(cv, rel=50 * within, abs=0)  # a difference of squares
        assert functions.entropy_j_per_mol_k[i] == pytest.approx(GAS_CONSTANT * (ln_q + mean), rel=within, abs=1e-12)


def test_frozen_hydrogen_is_a_mixture_of_gases():
    """U and C_v are means of para and ortho; S has the entropy of mixing on top."""
    top = rotor.read("H2")
    normal, para, ortho = (thermodynamic_functions(top, COLD_TO_HOT, species=s) for s in ("normal", "para", "ortho"))
    assert normal.fractions == {"para": 0.25, "ortho": 0.75}
    for name in ("energy_j_per_mol", "cv_over_r"):
        mean = 0.25 * getattr(para, name) + 0.75 * getattr(ortho, name)
        assert np.allclose(getattr(normal, name), mean, rtol=1e-13, atol=0)  # round-off
    mixing = -GAS_CONSTANT * (0.25 * math.log(0.25) + 0.75 * math.log(0.75))
    mean = 0.25 * para.entropy_j_per_mol_k + 0.75 * ortho.entropy_j_per_mol_k + mixing
    assert np.allclose(normal.entropy_j_per_mol_k, mean, rtol=1e-13, atol=0)  # round-off


@pytest.mark.parametrize("name", WITH_SPECIES)
def test_species_add_up_to_all_levels(name):
    """Σ q_s = q, and in equilibrium C = Σ x C_s + R (⟨u²⟩ - ⟨u⟩²) with x = q_s/q and u = U_s/RT."""
    top = rotor.read(name)
    theta = min(t for t in rotational_temperatures_k(top) if math.isfinite(t))
    temperatures = theta * np.array([0.3, 1.0, 3.0, 10.0])
    whole = thermodynamic_functions(top, temperatures, relative_error=1e-12)
    names = species_names(top)[2:]
    assert len(names) > 1
    parts = [thermodynamic_functions(top, temperatures, species=s, relative_error=1e-12) for s in names]
    q = np.array([part.q_rot for part in parts])
    assert np.allclose(q.sum(axis=0), whole.q_rot, rtol=1e-11, atol=0)  # truncation of every sum
    x = q / q.sum(axis=0)
    u = np.array([part.energy_j_per_mol for part in parts]) / (GAS_CONSTANT * temperatures)
    cv = (x * [part.cv_over_r for part in parts]).sum(axis=0) + (x * u**2).sum(axis=0) - (x * u).sum(axis=0) ** 2
    assert np.allclose(
        (x * u).sum(axis=0), whole.energy_j_per_mol / (GAS_CONSTANT * temperatures), rtol=1e-10, atol=1e-14
    )
    assert np.allclose(cv, whole.cv_over_r, rtol=1e-9, atol=1e-12)  # truncation, and a difference of large numbers


@pytest.mark.parametrize("name", WITH_SPECIES)
def test_frozen_and_equilibrium_agree_when_hot(name):
    """The frozen ratio is that of high temperature, and spin factors add up."""
    top = rotor.read(name)
    hot = 40 * max(t for t in rotational_temperatures_k(top) if math.isfinite(t))
    top = rigid(top)  # distortion might be beyond its reach there
    normal, whole = (thermodynamic_functions(top, [hot], species=species) for species in ("normal", "equilibrium"))
    assert normal.q_rot[0] == pytest.approx(whole.q_rot[0], rel=1e-7)  # what is left falls as exp(-π² T/Θ) and faster
    assert normal.cv_over_r[0] == pytest.approx(whole.cv_over_r[0], rel=1e-6)
    assert normal.spin_factor == pytest.approx(whole.spin_factor, rel=1e-12)  # round-off
    factors = [thermodynamic_functions(top, [hot], species=s).spin_factor for s in species_names(top)[2:]]
    assert sum(factors) == pytest.approx(whole.spin_factor, rel=1e-12)


def rigid(top):
    a, b, c = top.rotational_constants_mhz
    constants = Constants(B=b) if top.kind == "linear" else Constants(A=a, B=b, C=c)
    return Top.from_constants(constants, spin_weights=top.spin_weights)


def test_known_figures_of_species():
    """Ortho hydrogen gives off 1417 J/mol at 0 K; H2O, CH4 and C6H6 have 4, 16 and 128/2 spin functions of their protons."""
    h2 = rotor.read("H2")
    cold = thermodynamic_functions(h2, [1.0], species="ortho")
    assert cold.energy_j_per_mol[0] == pytest.approx(1417.4, abs=0.1)  # 118.487 cm⁻¹, the first rotational level of H2
    assert cold.entropy_j_per_mol_k[0] == pytest.approx(GAS_CONSTANT * math.log(9), rel=1e-12)  # three J, three spins
    # of NH3 both inversion states are in Q, so that the factor is that of all three protons, 2³
    factors = {"H2": 4, "water": 4, "CH4": 16, "C2H4": 16, "CO2": 1, "CO": 1, "NH3": 8}
    for name, factor in factors.items():
        assert thermodynamic_functions(rotor.read(name), [50.0]).spin_factor == pytest.approx(factor, rel=1e-12)


def test_names_of_species():
    known = {
        "H2": ["para", "ortho"], "N2": ["para", "ortho"], "water": ["para", "ortho"], "NH3": ["para", "ortho"],
        "CH4": ["A", "E", "F"], "C2H4": ["ee", "eo", "oe", "oo"], "C6H6": ["0even", "0odd", "1", "2", "3"],
    }  # fmt: skip
    for name, expected in known.items():
        assert species_names(rotor.read(name)) == ["equilibrium", "normal", *expected]
    for name in ("CO", "CO2", "HDO"):
        assert species_names(rotor.read(name)) == ["equilibrium"]
    ortho = spin_species(SpinWeights.from_mapping({"even": 2, "odd": 1}))["ortho"]  # N2: even J weighs more
    assert ortho.to_mapping() == {"even": 2, "odd": 0}
    along_c = spin_species(SpinWeights.from_mapping({"ee": 3, "eo": 1, "oe": 3, "oo": 1}))  # half turn about c
    assert along_c["para"].to_mapping() == {"ee": 0, "eo": 1, "oe": 0, "oo": 1}
    with pytest.raises(ValueError, match="all levels of carbon monoxide belong to the same"):
        thermodynamic_functions(rotor.read("CO"), [10.0], species="normal")
    with pytest.raises(ValueError, match="equilibrium, normal, A, E, F"):
        thermodynamic_functions(rotor.read("CH4"), [10.0], species="ortho")


@pytest.mark.parametrize(
    "name", ["H2", "water", "NH3", "CH4", "C2H4", "C6H6", "SF6", "CO", "CO2", "HDO", "CH3Cl", "SO2"]
)
def test_weights_tell_the_symmetry_number(name):
    top = rotor.read(name)
    implied = implied_symmetry_number(top.spin_weights)
    assert implied == top.symmetry.symmetry_number
    assert np.isclose(implied * top.spin_weights.mean, round(implied * top.spin_weights.mean), rtol=0, atol=1e-9)


def test_linear_heat_capacity_meets_its_series():
    """C_v/R = 1 + x²/45 + 16 x³/945 + ..., from Q = 1/x + 1/3 + x/15 + 4x²/315 (Mulholland 1928), x = Θ/T."""
    top = Top.from_constants("B=57635.968 MHz")
    for t in (50.0, 100.0, 200.0):
        x = 57635.968 / units.MHZ_PER_K / t
        functions = thermodynamic_functions(top, [t], relative_error=1e-13)
        series = 1 + x**2 / 45 + 16 * x**3 / 945
        assert functions.cv_over_r[0] == pytest.approx(series, rel=0, abs=0.02 * x**4)  # the next term is of that order


@pytest.mark.parametrize(
    "text",
    [
        "A=10 B=6 C=4 cm-1",
        "A=8 B=8 C=3 cm-1",
        "A=20 B=3 C=3 cm-1",
        "A=5 B=5 C=5 cm-1",
        "B=10 cm-1",
        "A=30 B=5 C=4.5 cm-1",
    ],
)
def test_quantum_corrections_are_those_of_the_sum(text):
    """Q/Q_cl - 1 = a/T + b/T² + O(1/T³): both from sums at two high temperatures."""
    top = Top.from_constants(text)
    limit = classical_limit(top)
    t = np.array([1000.0, 2000.0])
    rest = level_sums(top, [top.spin_weights], t, 1e-13)[0].q / limit.q(t) - 1
    scale = max(x for x in rotational_temperatures_k(top) if math.isfinite(x))
    second = (rest - limit.a / t) * t**2
    assert rest[1] * t[1] == pytest.approx(limit.a, rel=1e-2)  # b/aT, Θ/T at most
    assert 2 * second[1] - second[0] == pytest.approx(
        limit.b, rel=0, abs=2e-3 * limit.b + (scale / t[1]) ** 2 * scale**2
    )
    assert second[1] == pytest.approx(limit.b, rel=0.01)  # the third term, Θ/T of it


def test_corrections_of_a_symmetric_top_are_those_of_mcdowell():
    """ln Q/Q_cl = B(4 - m)/12T + B²(1 - m)²/90T² + ..., m = B/A (R. S. McDowell, J. Chem. Phys. 93 (1990) 2801; memory)."""
    for text in ("A=20 B=3 cm-1", "B=8 C=3 cm-1"):
        limit = classical_limit(Top.from_constants(text))
        a, b, c = rotational_temperatures_k(Top.from_constants(text))
        m = b / a if a > b else b / c
        assert limit.a == pytest.approx(b * (4 - m) / 12, rel=1e-13)  # round-off
        assert limit.b - limit.a**2 / 2 == pytest.approx((b * (1 - m)) ** 2 / 90, rel=1e-12)


@pytest.mark.parametrize(
    ("rigid_text", "distorted"),
    [
        ("B=10", "B=10 D=1e-6"),
        ("A=20 B=3", "A=20 B=3 DJ=1e-7 DJK=2e-7 DK=1e-6"),
        ("B=8 C=3", "B=8 C=3 DJ=3e-7 DJK=-2e-7 DK=1e-7"),
        ("A=5 B=5 C=5", "A=5 B=5 C=5 D=1e-7"),
        ("A=10 B=6 C=4", "A=10 B=6 C=4 DJ=1e-7 DJK=-3e-7 DK=8e-7 d1=2e-8 d2=4e-8"),
        ("A=10 B=6 C=4", "A=10 B=6 C=4 DeltaJ=1e-7 DeltaJK=-3e-7 DeltaK=8e-7 deltaJ=2e-8 deltaK=1e-7"),
        ("A=10 B=9 C=4", "A=10 B=9 C=4 DeltaJ=1e-7 DeltaJK=-1e-7 DeltaK=2e-7 deltaJ=2e-8 deltaK=1e-7"),
    ],
)  # fmt: skip
def test_distortion_correction_is_that_of_the_sum(rigid_text, distorted):
    """Q of distortion so small that it counts once, over the rigid Q: 1 + dT (1 + O(Θ/T))."""
    t = np.array([1000.0, 2000.0])
    tops = [Top.from_constants(f"{text} cm-1") for text in (rigid_text, distorted)]
    q = [level_sums(top, [top.spin_weights], t, 1e-14)[0].q for top in tops]
    d = (q[1] / q[0] - 1) / t
    assert 2 * d[1] - d[0] == pytest.approx(classical_limit(tops[1]).d, rel=2e-3)  # terms of (Θ/T)² and second order


@given(
    st.floats(1.0, 40.0),
    st.floats(0.05, 1.0),
    st.floats(0.05, 1.0),
    st.floats(0.3, 300.0),
    st.sampled_from(["", "KaKc"]),
)
@settings(max_examples=40)
def test_derivatives_of_ln_q(a, b_over_a, c_over_b, t_over_theta, rule):
    """U/RT = d ln Q/d ln T and C_v = dU/dT by differences, whatever the asymmetric top."""
    weights = {"ee": 1, "eo": 3, "oe": 3, "oo": 1} if rule else None
    b = a * b_over_a
    constants = (
        Constants(A=a * 29979.0, B=b * 29979.0, C=b * c_over_b * 29979.0, kind="asymmetric")
        if c_over_b < 1 and b_over_a < 1
        else Constants(B=a * 29979.0)
    )
    top = Top.from_constants(constants, spin_weights=weights if constants.kind == "asymmetric" else None)
    t = min(t_over_theta * rotational_temperatures_k(top)[2], 300 * rotational_temperatures_k(top)[2])
    h = 1e-4
    around = t * np.exp([-h, 0.0, h])
    sums = level_sums(top, [top.spin_weights], around, 1e-13)[0]
    assert sums.energy_over_rt[1] == pytest.approx(
        (np.log(sums.q[2]) - np.log(sums.q[0])) / (2 * h), rel=1e-6, abs=1e-10
    )
    energy = sums.energy_over_rt * around
    slope = (energy[2] - energy[0]) / (around[2] - around[0])
    assert sums.cv_over_r[1] == pytest.approx(slope, rel=1e-5, abs=1e-9)  # h² times third derivatives, round-off over h


def test_a_plain_sum_over_levels_of_water():
    top = rotor.read("water")
    levels = solve_levels(top, 30)
    functions = thermodynamic_functions(top, [40.0, 300.0], relative_error=1e-8)
    for i, t in enumerate((40.0, 300.0)):
        there = levels.weight > 0
        x = (levels.energy_mhz[there] / units.MHZ_PER_K).tolist()
        _, mean, cv = plain_functions(x, levels.degeneracy[there].tolist(), t)
        assert functions.energy_j_per_mol[i] == pytest.approx(GAS_CONSTANT * t * mean, rel=1e-8)  # truncation asked for
        assert functions.cv_over_r[i] == pytest.approx(cv, rel=1e-8)


@pytest.mark.parametrize("species", ["equilibrium", "normal", "para", "ortho"])
def test_entropy_is_the_integral_of_heat_capacity(species):
    """S(300 K) - S(30 K) = ∫ C/T dT, by 200 nodes of Gauss and Legendre in ln T."""
    nodes, weights = np.polynomial.legendre.leggauss(200)
    low, high = math.log(30.0), math.log(300.0)
    middle = np.exp((low + high) / 2 + (high - low) / 2 * nodes)
    top = rotor.read("H2")
    cv = thermodynamic_functions(top, middle, species=species, relative_error=1e-12).cv_over_r
    integral = GAS_CONSTANT * (high - low) / 2 * float(weights @ cv)
    ends = thermodynamic_functions(top, [30.0, 300.0], species=species, relative_error=1e-12).entropy_j_per_mol_k
    assert ends[1] - ends[0] == pytest.approx(integral, rel=1e-11)  # round-off of the sums


@pytest.mark.parametrize("name", ["H2", "water", "CH4", "C6H6", "SF6", "CH3I"])
@pytest.mark.parametrize("species", ["equilibrium", "each"])
def test_the_lowest_temperatures(name, species):
    """Down to 1e-6 K nothing overflows, S is R ln g of the lowest level, and C_v falls to nothing."""
    top = rotor.read(name)
    for species_name in species_names(top)[2:] if species == "each" else ["equilibrium"]:
        functions = thermodynamic_functions(top, [1e-6, 1e-3], species=species_name)
        degeneracy = math.exp(functions.entropy_j_per_mol_k[1] / GAS_CONSTANT)
        assert degeneracy == pytest.approx(round(degeneracy), rel=1e-6)  # E/kT of some 1e5 cancels in 16 digits
        assert round(degeneracy) >= 1
        assert functions.cv_over_r[0] == 0.0
        assert np.isfinite([functions.energy_j_per_mol, functions.entropy_j_per_mol_k]).all()


@pytest.mark.parametrize("text", ["B=60 cm-1", "A=27.9 B=14.5 C=9.3 cm-1", "A=5 B=0.4 cm-1", "B=5 C=5 A=5 cm-1"])
def test_errors_are_below_what_was_asked(text):
    top = Top.from_constants(text)
    temperatures = np.array([2.0, 10.0, 50.0, 300.0])
    exact = level_sums(top, [top.spin_weights], temperatures, 1e-13)[0]
    for goal in (1e-3, 1e-6):
        computed = level_sums(top, [top.spin_weights], temperatures, goal)[0]
        for name, claimed in (
            ("q", computed.error_q),
            ("energy_over_rt", computed.error_energy),
            ("cv_over_r", computed.error_cv),
        ):
            off = np.abs(getattr(computed, name) / getattr(exact, name) - 1)
            assert (off <= claimed + 2e-13).all()  # round-off, and the error of what is called exact
            assert (claimed < goal).all()


def test_many_temperatures_at_once_are_each_by_itself():
    top = rotor.read("water")
    grid = np.linspace(10, 1000, 12)
    together = thermodynamic_functions(top, grid)
    alone = [thermodynamic_functions(top, [t]).cv_over_r[0] for t in grid]
    assert np.allclose(together.cv_over_r, alone, rtol=1e-14, atol=0)  # sums in another order
    backwards = thermodynamic_functions(top, grid[::-1]).cv_over_r
    assert np.allclose(backwards[::-1], together.cv_over_r, rtol=1e-14, atol=0)


def test_species_with_gaps_are_summed_to_the_end():
    """Icosahedral, one species: levels at J = 0, 6, 10, 12, 15 ...; the classical limit is met nevertheless."""
    only_a = {"A": 1, "F1": 0, "F2": 0, "G": 0, "H": 0}
    top = Top.from_constants("A=1 B=1 C=1 GHz", spin_weights=only_a)
    partition = partition_function(top, 300.0, 1e-9)
    assert partition.q == pytest.approx(float(classical_limit(top).corrected([300.0])[0][0]), rel=1e-8)  # truncation
    cold = thermodynamic_functions(top, [0.2])  # 0, then J = 6 with 13: x = 42 Θ/T
    x = 42e3 / units.MHZ_PER_K / 0.2
    assert cold.cv_over_r[0] == pytest.approx(
        13 * x**2 * math.exp(-x) / (1 + 13 * math.exp(-x)) ** 2, rel=1e-5
    )  # J = 10


def test_weights_of_the_split_levels_of_methane():
    """D_t splits levels by irrep; species then come from the irreps, and sum to the same as unsplit where it is tiny."""
    weights = {"A": 5, "E": 2, "F": 3}
    split = Top.from_constants(Constants(B=157122.3, D=3.3, Dt=1e-7, kind="spherical"), spin_weights=weights)
    whole = Top.from_constants(Constants(B=157122.3, D=3.3, kind="spherical"), spin_weights=weights)
    for species in ("A", "E", "F", "normal"):
        pair = [thermodynamic_functions(top, [20.0, 100.0], species=species) for top in (split, whole)]
        assert np.allclose(pair[0].cv_over_r, pair[1].cv_over_r, rtol=1e-7, atol=0)  # truncation; D_t/B is 1e-12


def test_distortion_beyond_its_reach():
    """Water's polynomial serves to some J: beyond, the error grows with temperature, and at last there is no answer."""
    top = rotor.read("water")
    functions = thermodynamic_functions(top, [300.0, 1000.0, 1200.0])
    assert functions.relative_error[0] < 1e-5 < functions.relative_error[1] < functions.relative_error[2] < 0.1
    with pytest.raises(ValueError, match=r"Q\(5000 K\): populated levels lie .* can be had up to 300 K"):
        thermodynamic_functions(top, [300.0, 5000.0])
    with pytest.raises(ValueError, match="beyond the reach of the distortion constants"):
        level_sums(top, [top.spin_weights], [1200.0], 1e-8, at_worst=1e-8)


def test_corrected_limit_is_consistent_and_ends_where_it_must():
    limit = classical_limit(rotor.read("water"))
    t, h = 200.0, 1e-4
    q = limit.corrected(t * np.exp([-h, 0, h]))[0]
    _, energy, cv = (float(x[0]) for x in limit.corrected([t]))
    assert energy == pytest.approx((math.log(q[2]) - math.log(q[0])) / (2 * h), rel=1e-7)  # differences
    slope = np.diff(limit.corrected(t * np.array([1 - h, 1 + h]))[1] * t * np.array([1 - h, 1 + h]))[0] / (2 * h * t)
    assert cv == pytest.approx(slope, rel=1e-7)
    assert np.isnan(limit.corrected([5.0])).all()


def test_where_quantum_and_classical_part():
    """At that temperature C_v is off by just the tolerance, above it nowhere by more."""
    for top in (rotor.read("water"), rotor.read("CH4"), rotor.read("H2"), Top.from_constants("B=1 cm-1")):
        t = classical_above_k(top)
        there = level_sums(rigid(top), [top.spin_weights], t * np.array([1.0, 1.02, 1.1, 1.5, 3.0, 10.0]), 1e-9)[0]
        off = np.abs(there.cv_over_r / (1.0 if top.kind == "linear" else 1.5) - 1)
        assert off[0] == pytest.approx(0.01, rel=1e-3)  # T is known to 1e-6
        assert (off[1:] < 0.01).all()
    j = np.arange(40)
    part = classical_above_k(Top.from_constants("B=1 cm-1"))
    _, _, cv = plain_functions((j * (j + 1) * 1.438776877).tolist(), (2 * j + 1).tolist(), part)  # hc/k in cm K
    assert cv == pytest.approx(1.01, rel=1e-6)
    with pytest.raises(ValueError, match="between 0 and 1"):
        classical_above_k(rotor.read("CO"), 0.0)


@pytest.mark.parametrize("harmonic", [True, False])
def test_vibration_by_its_derivatives(harmonic):
    states = VibrationalStates((667.4, 1388.2, 2349.1), (2, 1, 1), harmonic)
    for t in (100.0, 300.0, 1500.0):
        h = 1e-4
        around = t * np.exp([-h, 0.0, h])
        ln_q, mean, cv = vibrational_functions(states, around)
        assert ln_q[1] == pytest.approx(math.log(states.factor(t)), rel=1e-9, abs=0)  # ln of 1 + a little
        assert mean[1] == pytest.approx((ln_q[2] - ln_q[0]) / (2 * h), rel=1e-5)  # differences
        energy = mean * around
        assert cv[1] == pytest.approx((energy[2] - energy[0]) / (around[2] - around[0]), rel=1e-5)
    assert np.isfinite(vibrational_functions(states, [1e-3])).all()


def test_ideal_gas_functions_hang_together():
    states = VibrationalStates((1595.0, 3657.0, 3756.0), harmonic=True)
    top = rotor.read("water")
    t, h = 400.0, 0.01
    low, here, high = (
        thermodynamic_functions(top, [x], vibrations=states, pressure_bar=2.0).gas for x in (t - h, t, t + h)
    )
    slope = (high.enthalpy_j_per_mol[0] - low.enthalpy_j_per_mol[0]) / (2 * h)
    assert here.cp_j_per_mol_k[0] == pytest.approx(slope, rel=1e-7)  # h², and digits of the difference
    assert here.cp_j_per_mol_k[0] == pytest.approx(
        t * (high.entropy_j_per_mol_k[0] - low.entropy_j_per_mol_k[0]) / (2 * h), rel=1e-7
    )
    assert here.gibbs_j_per_mol_k[0] == pytest.approx(
        here.entropy_j_per_mol_k[0] - here.enthalpy_j_per_mol[0] / t, rel=1e-14
    )
    at_1_bar = thermodynamic_functions(top, [t], vibrations=states, pressure_bar=1.0).gas
    assert at_1_bar.entropy_j_per_mol_k[0] - here.entropy_j_per_mol_k[0] == pytest.approx(
        GAS_CONSTANT * math.log(2), rel=1e-12
    )


@pytest.mark.parametrize(("mass", "published"), [(4.002602, 126.153), (20.1797, 146.328), (39.948, 154.846)])
def test_rare_gases_by_sackur_and_tetrode(mass, published):
    """He, Ne, Ar at 298.15 K and 1 bar: CODATA key values for thermodynamics (Cox, Wagman and Medvedev 1989; memory)."""
    assert translational_entropy([298.15], mass, 1.0)[0] == pytest.approx(
        published, abs=3e-3
    )  # uncertainty given: 0.002, 0.003


def test_thermodynamic_functions_refuse_impossible_input():
    top = Top.from_constants("B=1 cm-1")
    for temperatures in ([0.0], [-5.0], [math.nan], [10.0, math.inf]):
        with pytest.raises(ValueError, match="a temperature is above 0 K"):
            thermodynamic_functions(top, temperatures)
    with pytest.raises(ValueError, match="needs the mass"):
        thermodynamic_functions(top, [10.0], pressure_bar=1.0)
    with pytest.raises(ValueError, match="finite pressure above 0"):
        thermodynamic_functions(rotor.read("CO"), [10.0], pressure_bar=0.0)


def test_a_series_that_turns_over_is_refused_before_thousands_of_levels_are_solved():
    """The 15 constants of ammonia serve to J of some 20; from J = 58 on its lowest level of each J falls."""
    seen: list[int] = []
    top = rotor.read("NH3")
    with pytest.raises(ValueError, match="beyond the reach of the distortion constants"):
        level_sums(top, [top.spin_weights], [1e6], progress=lambda j, last: seen.append(j))
    assert 50 < max(seen) < 100


@pytest.mark.parametrize(
    "ratios", [(1.03, 4.5), (1.2, 1.43), (2.2, 2.6), (3.1, 1.44), (4.3, 7.3), (7.4, 1.09), (14.3, 1.5), (14.6, 5.7)]
)
def test_the_next_quantum_correction_is_bounded(ratios, monkeypatch):
    """ln Q of the corrected classical limit against the sum over the levels, at 12 times the temperature of A."""
    from rotor.thermodynamics.sums import level_sums
    from rotor.thermodynamics.sums.classical_limit import classical_limit

    monkeypatch.setattr(level_sums, "LONG_SUM", 10**9)  # the sum, not the limit itself
    b = 1e4
    top = Top.from_constants(f"A={b * ratios[0]} B={b} C={b / ratios[1]} MHz")
    kelvin = 12 * b * ratios[0] / units.MHZ_PER_K
    exact = level_sums.level_sums(top, [top.spin_weights], [kelvin], 1e-13)[0]
    limit = classical_limit(top)
    actual = abs(math.log(exact.q[0] / limit.corrected([kelvin])[0][0]) - exact.ground_k / kelvin)
    assert actual <= limit.errors([kelvin])[0, 0] <= 60 * actual  # 2.2 to 5.5, 46 of the nearly symmetric top
