"""A request made in Python gives what the command gives, number by number; and a request is checked where it is made."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping

import numpy as np
import pytest

import rotor
from rotor.classical.motion import SI
from rotor.classical.tumble import TumbleRequest, answer_tumble
from rotor.fluids.request import FluidRequest, NewBox, answer_fluid
from rotor.fluids.settings import Settings
from rotor.quantum.request import LevelsRequest, answer_levels
from rotor.reports.screen import plain, table_records
from rotor.requests.readers import Whole
from rotor.spectra.raman.request import RamanRequest, answer_raman
from rotor.spectra.request import GasLayer, SpectrumRequest, answer_spectrum
from rotor.thermodynamics.gas.classical_gas import GasRequest, answer_gas, settling_times_ps
from rotor.thermodynamics.gas.thermal_tumble import thermal_tumble
from rotor.thermodynamics.info_request import InfoRequest
from rotor.thermodynamics.request import ThermoRequest, answer_thermo
from rotor.thermodynamics.vibration import VibrationalStates

COMMAND_KEYS = {"rotor_version", "command", "input", "files", "strongest", "patterns"}  # keys that no request has


def answer_of(call, *arguments: str) -> dict:
    code, out, err = call(*arguments, "--json", "-")
    assert code == 0, err
    return json.loads(out)


def assert_same(command: Mapping, facts: Mapping, but: frozenset[str] = frozenset()) -> None:
    """Every key of the command's JSON but those of the command itself, number by number: no tolerance, one code computes both."""
    assert set(command) - COMMAND_KEYS == set(facts) - but
    for key, value in plain(facts).items():
        if key not in but:
            assert command[key] == value, key


def test_a_spectrum_from_python_is_that_of_the_command(call):
    command = answer_of(
        call, "spectrum", "OCS", "--temperature", "150", "--range", "10:400GHz", "--min-lgint", "-6.5", "--jmax", "40",
        "--vibration", "859,520x2,2062", "--pressure", "2mbar", "--path", "1m", "--fwhm", "3MHz",
    )  # fmt: skip
    request = SpectrumRequest(
        rotor.read("OCS"), temperature_k=150, range_mhz=(10e3, 400e3), min_lgint=-6.5, jmax=40, fwhm_mhz=3.0,
        vibrations=VibrationalStates.parse("859,520x2,2062", harmonic=True), layer=GasLayer(2e-3, 100.0),
    )  # fmt: skip
    answer = answer_spectrum(request)
    assert_same(command, {**answer.facts(), "lines": table_records(answer.lines)})
    assert command["profile"] == "gaussian"
    assert command["strongest"] == answer.strongest(20).tolist()
    assert len(command["lines"]) == len(answer.lines) > 20


def test_spectrum_of_constants_with_a_given_q(call):
    arguments = (
        "--constants",
        "A=9.2 B=3 C=2.5 GHz",
        "--dipole-abc",
        "1,0,2",
        "--q",
        "1000",
        "--vibrational-factor",
        "1.5",
    )
    command = answer_of(call, "spectrum", *arguments, "--min-lgint", "none", "--jmax", "5")
    top = rotor.Top.from_constants("A=9.2 B=3 C=2.5 GHz", dipole_abc_debye=(1, 0, 2), source="given (--constants)",
                                   dipole_source="given in principal axes (--dipole-abc)")  # fmt: skip
    answer = answer_spectrum(SpectrumRequest(top, q=1000, vibrational_factor=1.5, min_lgint=None, jmax=5))
    assert_same(command, {**answer.facts(), "lines": table_records(answer.lines)})


def test_raman_lines_from_python_are_those_of_the_command(call):
    command = answer_of(call, "raman", "CO2", "--laser", "488", "--temperature", "500K", "--min-relative", "1e-3")
    answer = answer_raman(RamanRequest(rotor.read("CO2"), temperature_k=500, laser_nm=488, min_relative=1e-3))
    assert_same(command, {**answer.facts(), "lines": table_records(answer.lines)})


def test_thermo_from_python_is_that_of_the_command(call):
    command = answer_of(
        call, "thermo", "water", "--species", "ortho", "--temperature", "100:300K:5", "--gas", "--pressure", "1atm",
        "--vibration", "1595,3657,3756",
    )  # fmt: skip
    answer = answer_thermo(
        ThermoRequest(
            rotor.read("water"), tuple(np.linspace(100, 300, 5).tolist()), species="ortho", pressure_bar=1.01325,
            vibrations=VibrationalStates.parse("1595,3657,3756", harmonic=True),
        )
    )  # fmt: skip
    assert_same(command, {**answer.facts(), "functions": table_records(answer.functions)})


def test_tumble_of_a_molecule(call):
    command = answer_of(call, "tumble", "water", "--temperature", "100", "--times", "0:2ps:21")
    request = thermal_tumble(rotor.read("water"), temperature_k=100, times_ps=np.linspace(0, 2, 21))
    answer = answer_tumble(request)
    facts = {**answer.facts(), "motion": table_records(answer.table)}
    top_keys = {key for key in command if key not in facts} - COMMAND_KEYS
    assert_same({k: v for k, v in command.items() if k not in top_keys}, facts)
    assert command["temperature_k"] == 100


def test_tumble_of_a_body(call):
    command = answer_of(call, "tumble", "--moments", "0.6,0.8,1.0", "--angular-momentum", "1.8,0.4,-0.9")
    answer = answer_tumble(TumbleRequest((0.6, 0.8, 1.0), (1.8, 0.4, -0.9), source="given (--angular-momentum)"))
    facts = {
        **answer.facts(),
        "motion": table_records(answer.table),
        "kind": answer.request.kind,
        "notes": [],
        "temperature_k": None,
    }
    assert_same(command, facts)


def test_a_gas_from_python_is_that_of_the_command(call):
    command = answer_of(
        call, "gas", "OCS", "--molecules", "2000", "--temperature", "200", "--seed", "5", "--times", "0:1:6"
    )
    request = GasRequest(rotor.read("OCS"), 2000, 200.0, seed=5, times_ps=tuple(np.linspace(0, 1, 6).tolist()))
    answer = answer_gas(request)
    assert_same(command, {**answer.facts(), "correlation": table_records(answer.correlations)})
    assert len(settling_times_ps(request.top, 200.0)) == 101


def test_a_fluid_from_python_is_that_of_the_command(call):
    command = answer_of(
        call, "fluid", "water", "--molecules", "27", "--density", "0.5", "--ensemble", "langevin", "--steps", "20",
        "--cutoff", "5", "--seed", "3", "--temperature", "320", "--equilibration", "1 ps",
    )  # fmt: skip
    settings = Settings(ensemble="langevin", steps=20, cutoff_angstrom=5.0, seed=3, temperature_k=320.0)
    answer = answer_fluid(FluidRequest(NewBox(27, 0.5, 1.0), settings))
    assert_same(command, {**answer.facts(), "record": table_records(answer.record)})


def test_levels_of_every_kind_of_top():
    """Closed forms: B J(J+1), and A + B, A + C, B + C of J = 1; ranges of J, K and energy choose among the same levels."""
    linear = answer_levels(LevelsRequest(rotor.Top.from_constants("B=1 GHz"), jmax=5, jmin=2)).table
    assert linear.energy_mhz.tolist() == [1e3 * j * (j + 1) for j in range(2, 6)]
    assert linear.energy_cm[0] == pytest.approx(6e3 / 29979.2458, rel=1e-15)  # one division
    top = rotor.Top.from_constants("A=10 B=6 C=4 MHz")
    levels = answer_levels(LevelsRequest(top, jmax=4, jmin=1, kmin=1, kmax=2)).table
    table = answer_levels(LevelsRequest(top, jmax=4)).table
    chosen = [
        (row["j"], row["ka"], row["kc"], row["energy_mhz"])
        for row in table_records(table)
        if row["j"] >= 1 and 1 <= row["ka"] <= 2
    ]
    assert [(row["j"], row["ka"], row["kc"], row["energy_mhz"]) for row in table_records(levels)] == chosen
    low = answer_levels(LevelsRequest(top, jmax=4, max_energy_mhz=50.0)).table
    assert low.energy_mhz.tolist() == [e for e in table.energy_mhz.tolist() if e <= 50.0]


def test_levels_count_from_the_lowest_that_exists():
    """Only levels with Ka + Kc odd exist: 1(0,1) is the lowest, and 1(1,0) lies A + B - (B + C) above it."""
    top = rotor.Top.from_constants("A=10 B=6 C=4 MHz", spin_weights={"ee": 0, "eo": 1, "oe": 1, "oo": 0})
    table = answer_levels(LevelsRequest(top, jmin=1, jmax=1)).table
    assert dict(zip(table.labels, table.energy_mhz.round(9).tolist(), strict=True))[" 1  0  1"] == 0.0
    assert dict(zip(table.labels, table.energy_mhz.round(9).tolist(), strict=True))[" 1  1  0"] == 6.0


CO = "B=57.6 GHz"
BAD = [
    (lambda top: SpectrumRequest(top, temperature_k=0), "temperature_k: 0: expected a finite number above 0"),
    (lambda top: SpectrumRequest(top, jmax=-1), "jmax: -1: expected a whole number of 0 or more"),
    (lambda top: SpectrumRequest(top, profile="box"), "profile: 'box': expected one of sticks, gaussian"),
    (lambda top: SpectrumRequest(top, profile="sticks", fwhm_mhz=1), "fwhm_mhz: sticks have no width"),
    (lambda top: SpectrumRequest(top, profile="sticks", layer=GasLayer(1, 1)), "an optical depth needs a width"),
    (lambda top: SpectrumRequest(top, profile="voigt"), "profile voigt: expected the full width of the Lorentzian"),
    (lambda top: SpectrumRequest(top, profile="gaussian"), "a Doppler width needs a mass"),
    (lambda top: SpectrumRequest(top, range_mhz=(5, 2)), "range_mhz: 5 to 2 MHz: expected a range that rises"),
    (lambda top: SpectrumRequest(top, min_lgint=math.nan), "min_lgint: nan: expected a finite number"),
    (lambda top: SpectrumRequest(rotor.Top.from_constants(CO)), "the dipole of this top is not known"),
    (lambda top: GasLayer(0, 1), "pressure_bar: 0: expected a finite number above 0"),
    (lambda top: RamanRequest(top), "the polarizability of this top is not known"),
    (lambda top: ThermoRequest(top, ()), "temperatures_k: 0 numbers: expected 1 to"),
    (lambda top: ThermoRequest(top, (300, -1)), "temperatures_k: -1: expected a finite number above 0 K"),
    (lambda top: InfoRequest(top, temperatures_k=(300, -1)), "temperatures_k: -1: expected a finite number above 0 K"),
    (lambda top: GasRequest(top, times_ps=(0, math.inf)), "times_ps: inf: expected finite numbers"),
    (lambda top: ThermoRequest(top, species="ortho"), "species: 'ortho': this top has equilibrium; its levels are all of one"),
    (lambda top: ThermoRequest(top, pressure_bar=1), "the ideal gas needs the mass"),
    (lambda top: TumbleRequest((1, 2, 3), (0, 0, 0)), "a body at rest does not tumble"),
    (lambda top: TumbleRequest((1, 2, 3), (1, 0, 0), times=()), "times: expected at least one finite time"),
    (lambda top: thermal_tumble(top, temperature_k=-1), "temperature_k: -1: expected a finite number above 0 K"),
    (lambda top: GasRequest(top, molecules=1), "molecules: 1: expected a whole number from 2"),
    (lambda top: GasRequest(top, confidence=1), "confidence: 1: expected a number between 0 and 1"),
    (lambda top: FluidRequest(NewBox(0)), "molecules: 0: expected a whole number of 1 or more"),
    (lambda top: FluidRequest(NewBox(8), engine="gromacs"), "engine: 'gromacs': expected one of rotor, openmm, lammps"),
    (lambda top: LevelsRequest(top, jmax=2, jmin=3), "jmax: 2: expected a whole number of 3 or more"),
    (lambda top: LevelsRequest(top, kmax=2), "the levels of a linear top have no K"),
]  # fmt: skip


@pytest.mark.parametrize(("make", "said"), BAD, ids=[said for _, said in BAD])
def test_a_request_is_checked_where_it_is_made(make, said):
    top = rotor.Top.from_constants(CO, dipole_abc_debye=(0.1, 0, 0))
    with pytest.raises(ValueError, match=r".") as caught:
        make(top)
    assert said in str(caught.value)


def test_a_body_with_an_angular_velocity():
    """L = I ω: a uniform box 1 x 2 x 3 m of 12 kg has moments 13, 10 and 5 kg m²."""
    request = TumbleRequest.from_angular_velocity((13.0, 10.0, 5.0), (0.1, 2.0, 0.0), units=SI)
    answer = answer_tumble(request)
    assert request.angular_momentum == pytest.approx((1.3, 20.0, 0.0), rel=1e-15)  # one product each
    assert answer.facts()["energy"] == pytest.approx(0.5 * (13 * 0.01 + 10 * 4), rel=1e-15)  # a few roundings
    assert answer.facts()["units"]["time"] == "s"


@pytest.mark.parametrize("value", [True, 2.0, "3", None])
def test_a_whole_number_is_one_by_its_type(value):
    Whole(0).check(3)
    with pytest.raises(ValueError, match="expected a whole number, of type int"):
        Whole(0).check(value)
