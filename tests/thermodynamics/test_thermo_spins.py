"""Thermodynamic functions with spins: Schottky anomalies in closed form, the product against the sum over split levels, species."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import rotor
from rotor import units
from rotor.quantum.effects.of_top import effects_of
from rotor.spectra.lines import line_list
from rotor.thermodynamics.functions import ThermoFunctions, thermodynamic_functions
from rotor.thermodynamics.request import ThermoRequest, answer_thermo
from rotor.thermodynamics.sums.level_sums import level_sums, lowest_level_k
from rotor.thermodynamics.sums.partition import partition_function
from rotor.thermodynamics.sums.spin_factor import rotational_sum
from rotor.thermodynamics.sums.spin_sums import spin_sums, times_functions
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.top import Top

CHI = -4.7  # MHz, of 14N in a linear molecule
KELVIN = 1 / units.MHZ_PER_K


def rod(constants: str = f"chi_aa(14N)={CHI} MHz", spins: str | None = None, **others) -> Top:
    return Top.from_constants("B=44.316 GHz", spin_constants=SpinConstants.parse(constants, spins), **others)


def functions(top: Top, temperatures, **others) -> ThermoFunctions:
    return thermodynamic_functions(top, temperatures, effects=effects_of(top, True), **others)


def casimir(j: int, f: int, twice_i: int = 2) -> float:
    """E_F in units of χ: -[3C(C+1)/4 - I(I+1)J(J+1)] / [2I(2I-1)(2J-1)(2J+3)], C = F(F+1) - I(I+1) - J(J+1)."""
    i = twice_i / 2
    c = f * (f + 1) - i * (i + 1) - j * (j + 1)
    return -(0.75 * c * (c + 1) - i * (i + 1) * j * (j + 1)) / (2 * i * (2 * i - 1) * (2 * j - 1) * (2 * j + 3))


def test_schottky_anomaly_of_a_species_that_is_left_in_j_1():
    """Of a rotor of odd J alone F = 0, 1, 2 of J = 1 are all that there is below 1 K: their closed form, exact in N to 1e-4 MHz."""
    top = rod(spin_weights={"even": 0, "odd": 1})
    temperatures = np.array([0.2, 1.0, 5.0, 100.0]) * abs(CHI) * KELVIN
    computed = functions(top, temperatures)
    energies = CHI * KELVIN * np.array([casimir(1, f) for f in (0, 1, 2)])
    x = (energies - energies.min())[:, None] / temperatures
    terms = np.array([1, 3, 5])[:, None] * np.exp(-x)
    q = terms.sum(axis=0)
    mean, square = (terms * x).sum(axis=0) / q, (terms * x * x).sum(axis=0) / q
    assert computed.q_rot == pytest.approx(q, rel=1e-4)  # second order in χ: χ²/B = 5e-4 MHz of 4.7
    assert computed.cv_over_r == pytest.approx(square - mean**2, rel=1e-3)
    assert computed.cv_over_r[0] > 0.3
    assert computed.hyperfine is not None
    assert computed.hyperfine["summed_up_to_k"] == temperatures[-1]


@pytest.mark.parametrize("species", ["equilibrium", "normal", "ortho"])
def test_far_above_the_splittings_spins_are_a_factor(species):
    """Π(2I+1) of Q and R ln of it in S; U and C_v are those of the rotation, δ/kT = 1e-6."""
    top = rod(spin_weights={"even": 1, "odd": 3})
    temperatures = [5.0, 50.0, 300.0]
    plain, split = (
        thermodynamic_functions(top, temperatures, species=species),
        functions(top, temperatures, species=species),
    )
    assert split.q_rot == pytest.approx(3 * plain.q_rot, rel=1e-5)
    assert split.q_rot_classical == pytest.approx(3 * plain.q_rot_classical, rel=1e-12)
    assert split.spin_factor == pytest.approx(3 * plain.spin_factor, rel=1e-12)
    gas = 8.314462618
    assert split.entropy_j_per_mol_k - plain.entropy_j_per_mol_k == pytest.approx([gas * np.log(3)] * 3, rel=1e-4)
    assert split.cv_over_r == pytest.approx(plain.cv_over_r, rel=1e-6)


def test_the_product_is_as_good_as_it_says():
    """At δ/kT from 0.002 to 0.02 the factor against the sum over split levels."""
    top = rod("chi_aa(127I)=-1900 MHz")
    effects = effects_of(top, True)
    temperatures, weights = np.array([5.0, 20.0, 50.0]), [top.spin_weights]
    exact = level_sums(top, weights, temperatures, 1e-10, effects=effects)[0]
    ground = lowest_level_k(top, weights, effects)[0]
    product = times_functions(level_sums(top, weights, temperatures, 1e-10)[0], 6, ground, 1900.0)
    assert product.ground_k == exact.ground_k
    for name, error in (("q", "error_q"), ("energy_over_rt", "error_energy"), ("cv_over_r", "error_cv")):
        off, said = np.abs(getattr(product, name) / getattr(exact, name) - 1), getattr(product, error)
        assert (off < said).all()
        assert (said < 1000 * off).all()  # the mean of δ² over F and J is some hundredths of the largest


def test_split_levels_are_summed_where_the_factor_is_not_good_enough():
    top = rod("chi_aa(127I)=-1900 MHz")
    computed = spin_sums(top, [top.spin_weights], np.array([1.0, 20.0, 300.0, 900.0]), 1e-6, effects_of(top, True))
    assert computed.split.tolist() == [True, True, False, False]
    exact = level_sums(top, [top.spin_weights], [300.0], 1e-9, effects=effects_of(top, True))[0]
    assert computed.sums[0].q[2] == pytest.approx(float(exact.q[0]), rel=1e-6)


def test_an_electron_spin_counts_in_the_classical_limit_but_not_as_a_nuclear_function():
    top = rod("gamma(S)=100 MHz", "S=1/2")
    computed, plain = functions(top, [300.0]), thermodynamic_functions(top, [300.0])
    assert computed.q_rot == pytest.approx(2 * plain.q_rot, rel=1e-4)
    assert computed.q_rot_classical == pytest.approx(2 * plain.q_rot_classical, rel=1e-12)
    assert computed.spin_factor == plain.spin_factor
    assert computed.q_rot == pytest.approx(computed.q_rot_corrected, rel=1e-4)


def test_species_of_nuclei_with_a_total_spin_are_refused():
    weights = {"ee": 1, "eo": 3, "oe": 3, "oo": 1}
    constants = SpinConstants.parse("chi_aa(14N_1)=1 chi_aa(14N_2)=1 MHz", "14N_1+14N_2")
    top = Top.from_constants("A=30 B=20 C=15 GHz", spin_weights=weights, spin_constants=constants)
    with pytest.raises(ValueError, match="species are not separated; expected equilibrium"):
        functions(top, [10.0], species="ortho")


def test_the_answer_counts_the_effects():
    top = rod()
    split = answer_thermo(ThermoRequest(top, (1.0,), effects=effects_of(top, True))).facts()
    assert split["hyperfine"] == {
        "spin_functions": 3, "splitting_mhz": pytest.approx(4.7), "summed_up_to_k": None, "method": "exact"
    }  # fmt: skip
    assert "nuclear quadrupole" in {effect["name"] for effect in split["effects"] if effect["present"]}
    plain = answer_thermo(ThermoRequest(replace(top, spin_constants=None), (1.0,))).facts()
    assert plain["hyperfine"] is None


def test_constants_of_zero_leave_the_rotation_times_the_functions():
    """No splitting, a frozen rotation: 0/0 is no error, and nothing is summed."""
    computed = functions(rod("chi_aa(14N)=0 MHz"), [1e-3, 1e-2, 1.0])
    assert computed.q_rot[:2] == pytest.approx([3.0, 3.0], rel=1e-14)  # exp of a logarithm
    assert computed.hyperfine is not None
    assert computed.hyperfine["summed_up_to_k"] is None
    assert np.isfinite(computed.relative_error).all()


@pytest.mark.parametrize("temperature", [0.05, 1.0, 20.0])
def test_q_of_lines_counts_from_the_lowest_level_that_spins_split(temperature):
    """Σ g e^(-E/kT) over levels whose energies count from the lowest F; the lowest that exists, 1_01, is split by 100 MHz."""
    top = Top.from_constants(
        "A=60 B=44 C=36 GHz", spin_weights={"ee": 0, "eo": 1, "oe": 1, "oo": 0}, dipole_abc_debye=(0, 1.0, 0),
        spin_constants=SpinConstants.parse("chi_aa(14N)=-150 chi_bb-cc(14N)=20 MHz"),
    )  # fmt: skip
    effects = effects_of(top, True)
    lines = line_list(top, temperature_k=temperature, jmax=25, effects=effects)
    levels = lines.levels
    above = (levels.energy_mhz - levels.ground_mhz) / units.MHZ_PER_K
    here = levels.quanta["n"] <= 24
    expected = (levels.degeneracy * np.exp(-above / temperature))[here].sum()
    assert lines.partition.q == pytest.approx(expected, rel=2e-6)  # asked of Q: 1e-6, and rounding
    assert lines.partition.q == pytest.approx(functions(top, [temperature]).q_rot[0], rel=2e-6)


def test_a_total_spin_beside_weights_that_count_it_is_refused():
    """Of water 1:3 of its geometry are the functions of both protons; 1:0, those of even I, are what a total spin needs."""
    protons = SpinConstants.parse("C_iso(1H_1)=-0.03 C_iso(1H_2)=-0.03 MHz", "1H_1+1H_2")
    top = replace(rotor.read("water"), spin_constants=protons)
    with pytest.raises(ValueError, match="spin weights of water count their 4 functions already"):
        effects_of(top, True)
    even = top.with_weights({"ee": 1, "eo": 0, "oe": 0, "oo": 1}, "given")
    plain = partition_function(top, 300.0).q
    assert partition_function(even, 300.0, effects=effects_of(even, True)).q == pytest.approx(
        plain, rel=2e-6
    )  # asked: 1e-6


def test_the_corrected_limit_counts_from_the_lowest_level():
    """Of a triplet whose lowest level is 0.65 K below the unsplit one; and of a molecule whose J = 0 does not exist."""
    triplet = Top.from_constants(
        "B=43.1 GHz", spin_constants=SpinConstants.parse("lambda(S)=59500 gamma(S)=-250 MHz", "S=1")
    )
    computed = functions(triplet, [30.0, 300.0])
    assert computed.q_rot_corrected[1] == pytest.approx(computed.q_rot[1], rel=1e-4)  # second order: (2λ/3kT)² = 4e-5
    assert computed.q_rot_corrected[0] == pytest.approx(computed.q_rot[0], rel=5e-3)  # the same, 4e-3
    odd = thermodynamic_functions(rod(spin_weights={"even": 0, "odd": 1}), [300.0])
    assert odd.q_rot_corrected == pytest.approx(odd.q_rot, rel=1e-6)  # relative error asked of Q


@pytest.mark.parametrize("nucleus", ["14N", "1H"])
def test_three_equivalent_nuclei_count_as_spin_weights_by_k(nucleus):
    """Weights 11:8 of three spins 1 and 4:2 of three spins 1/2, against the sum over split levels that exchange allows."""
    size = 1 if nucleus == "14N" else 0.5
    text = "chi_aa(14N_1)=-0.1 chi_bb-cc(14N_1)=0.1 MHz" if nucleus == "14N" else "C_aa(1H_1)=0.01 C_bb(1H_1)=0.02 MHz"
    spins = "+".join(f"{nucleus}_{n}" for n in (1, 2, 3))
    top = Top.from_constants("A=79 B=9 GHz", spin_constants=SpinConstants.parse(text, spins))
    effects, temperatures = effects_of(top, True), np.array([2.0, 4.0])
    split = level_sums(top, [top.spin_weights], temperatures, 1e-5, effects=effects)[0]
    product = spin_sums(top, [top.spin_weights], temperatures, 1e-5, effects)
    assert not product.split.any()
    assert rotational_sum(top, effects).functions == (1 if size == 1 else 2)  # 11, 8 and 4, 2 = 2 (2, 1)
    for name, error in (("q", "error_q"), ("energy_over_rt", "error_energy"), ("cv_over_r", "error_cv")):
        off = np.abs(getattr(product.sums[0], name) / getattr(split, name) - 1)
        assert (off < getattr(product.sums[0], error)).all()
        assert (off < 1e-5).all()  # the error of both sums


def test_q_of_three_equivalent_nuclei_at_room_temperature_needs_no_split_levels():
    """54 spin functions: the sum over split levels to J = 150 took minutes and 5 GB."""
    text = "C_aa(I1)=0.3 chi_aa(14N_1)=-0.1 chi_bb-cc(14N_1)=0.1 MHz"
    constants = SpinConstants.parse(text, "I1=1/2 14N_1+14N_2+14N_3")
    top = Top.from_constants("A=79 B=9 GHz", spin_constants=constants)
    q = partition_function(top, 300.0, effects=effects_of(top, True))
    plain = partition_function(top.with_weights({"0": 11, "1": 8, "2": 8}, "test"), 300.0)
    assert q.source.startswith("classical with corrections")
    assert q.q == pytest.approx(2 * plain.q, rel=1e-6)
