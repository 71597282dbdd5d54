"""Fits of lines in an electric field: derivatives against differences, c2 of OCS, what made lines is found again, bad input."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from rotor.fitting.levels.stark_levels import stark_levels
from rotor.fitting.top_constants import TopConstants
from rotor.formats.fits.fit_request import answer_fit, lines_request
from rotor.quantum.labels.quanta import FIELD_STEP_KV_PER_CM
from rotor.spectra.fields.lines import field_lines
from rotor.tops.states.state_constants import StateConstants
from rotor.tops.top import Top
from rotor.units import MHZ_PER_DEBYE_KV_PER_CM

OCS = Top.from_constants("B=6081.492475 D=0.00130143 MHz", dipole_abc_debye=(0.71519, 0, 0))
PROLATE = Top.from_constants("A=20000 B=6000 DJ=0.01 MHz", dipole_abc_debye=(1.5, 0, 0))
ASYMMETRIC = Top.from_constants("A=10000 B=6000 C=4000 DeltaJ=0.01 MHz", dipole_abc_debye=(1.0, 0.7, 0.3))
TWO = Top.from_constants(
    "A=10000 B=6000 C=4000 MHz",
    dipole_abc_debye=(1.0, 0.7, 0),
    states=StateConstants(
        {"E[1]": 3000.0, "A[1]": 9900.0, "B[1]": 5950.0, "C[1]": 4010.0, "W[0,1]": 150.0, "G_c[0,1]": 20.0},
        dipoles={(0, 1): (0.3, 0.2, 0.0)},
    ),
)


def steps(kv_per_cm: float) -> int:
    return round(kv_per_cm / FIELD_STEP_KV_PER_CM)


def model_of(top: Top, labels):
    dipole = tuple(f"mu_{axis}" for axis, value in zip("abc", top.dipole_abc_debye, strict=True) if value)
    constants = TopConstants(top, dipole=dipole)
    return stark_levels(constants, np.array(labels)), np.array(list(constants.values.values()))


@pytest.mark.parametrize(
    ("top", "labels"),
    [
        (OCS, [(0, 0, steps(1.0)), (1, 0, steps(1.0)), (1, 1, steps(30.0))]),
        (PROLATE, [(1, 1, 1, steps(0.5)), (1, 1, -1, steps(0.5)), (2, -1, 1, steps(0.5)), (2, 1, 2, steps(2.0))]),
        (ASYMMETRIC, [(1, 0, 1, 0, steps(0.5)), (1, 1, 1, 1, steps(1.5)), (2, 1, 1, 2, steps(2.0))]),
        (TWO, [(1, 0, 1, 0, 0, steps(0.5)), (1, 1, 1, 1, 1, steps(0.5))]),
    ],
)
def test_derivatives_are_those_of_differences(top, labels):
    """By every constant and every component of the dipole; two states with the dipole and the couplings between them."""
    model, values = model_of(top, labels)
    _, slopes = model.levels(values)
    for i, value in enumerate(values):
        step = np.eye(len(values))[i] * max(1e-5 * abs(value), 1e-4)
        difference = (model.levels(values + step)[0] - model.levels(values - step)[0]) / (2 * step[i])
        assert np.abs(difference - slopes[:, i]).max() < 2e-6 * max(
            np.abs(slopes[:, i]).max(), 1.0
        )  # third order, rounding
    dipole = [i for i, name in enumerate(model.names) if name.startswith("mu")]
    assert np.abs(slopes[:, dipole]).min(axis=0).max() > 1e-3  # the dipole matters


def test_linear_blocks_add_up_without_light():
    """E = Σ c ∂E/∂c over all constants and the dipole, in which H is linear."""
    model, values = model_of(ASYMMETRIC, [(1, 0, 1, 0, steps(3.0)), (2, 1, 1, 2, steps(3.0))])
    energies, slopes = model.levels(values)
    assert slopes @ values == pytest.approx(energies, abs=1e-6)  # the tolerance of the basis
    assert np.abs(slopes[:, :3] @ values[:3] - energies).min() > 1.0


def test_ocs_has_its_second_order_coefficient():
    """c2 of J = 0 is -μ²/6B but for D, and μ ∂E/∂μ = 2E."""
    field = 0.05
    model, values = model_of(OCS, [(0, 0, steps(field))])
    energies, slopes = model.levels(values)
    strength = MHZ_PER_DEBYE_KV_PER_CM * 0.71519
    assert energies[0] / field**2 == pytest.approx(-(strength**2) / 6 / 6081.492475, rel=2e-6)  # D, fourth order
    assert 0.71519 * slopes[0, model.names.index("mu_a")] == pytest.approx(2 * energies[0], rel=2e-6)  # fourth order


def test_signs_of_k_and_m_are_one():
    model, values = model_of(PROLATE, [(1, 1, -1, steps(1.0)), (1, -1, 1, steps(1.0)), (1, 1, 1, steps(1.0))])
    energies, _ = model.levels(values)
    assert energies[0] == energies[1]
    strength = MHZ_PER_DEBYE_KV_PER_CM * 1.5
    assert energies[0] - energies[2] == pytest.approx(strength, rel=1e-3)  # ±μE/2, third order


def lines_file(path, top, fields, noise, unit="field_kv_per_cm", scale=1.0, only=lambda row: True):
    """Lines of J ≤ 2 in some fields as a .csv, with noise in MHz."""
    lines = field_lines(top, fields, j_highest=2, tolerance_mhz=1e-6)
    names = ("j",) if top.kind == "linear" else ("j", "ka", "kc")
    rng = np.random.default_rng(5)
    with Path(path).open("w", newline="") as handle:
        writer = csv.writer(handle)
        heads = [f"{name}_{side}" for side in ("upper", "lower") for name in (*names, "m")]
        writer.writerow([*heads, unit, "frequency_mhz", "error_mhz"])
        for i in range(len(lines)):
            if lines.upper[i] != lines.lower[i] and lines.strength_debye2[i] > 0.01:
                upper, lower = lines.upper[i].split(), lines.lower[i].split()
                labels = [*upper, lines.upper_m[i], *lower, lines.lower_m[i]]
                frequency = lines.frequency_mhz[i] + noise * rng.normal()
                writer.writerow([*labels, lines.field_kv_per_cm[i] * scale, f"{frequency:.6f}", noise])
    return str(path)


def test_a_dipole_is_fitted_with_the_constants(tmp_path):
    path = lines_file(tmp_path / "lines.csv", OCS, [0.0, 1.0, 3.0], 0.002, "field_v_per_cm", 1e3)
    start = Top.from_constants("B=6081 D=0.0013 MHz", dipole_abc_debye=(0.6, 0, 0))
    fit = answer_fit(lines_request(path, start, ["B", "D", "mu_a"])).fit
    assert fit.converged
    off = (fit.values - [6081.492475, 0.00130143, 0.71519]) / fit.errors
    assert np.abs(off).max() < 4.0  # standard errors
    assert fit.errors[2] < 1e-4  # D
    assert fit.named.uncertainties["mu_a"] == pytest.approx(fit.errors[2])
    assert fit.named.top.dipole_abc_debye[0] == fit.values[2]
    assert "mu_a" not in fit.covariance.names  # that is of constants in MHz


def test_two_components_of_an_asymmetric_top_from_a_wrong_start(tmp_path):
    top = Top.from_constants("A=10000 B=6000 C=4000 MHz", dipole_abc_debye=(1.0, 0.7, 0.0))
    path = lines_file(tmp_path / "lines.csv", top, [0.0, 0.3, 0.6], 0.001)
    start = Top.from_constants("A=10000.5 B=6000.1 C=4000.2 MHz", dipole_abc_debye=(0.9, 0.8, 0.0))
    fit = answer_fit(lines_request(path, start, ["A", "B", "C", "mu_a", "mu_b"])).fit
    assert fit.converged
    assert np.abs((fit.values - [10000.0, 6000.0, 4000.0, 1.0, 0.7]) / fit.errors).max() < 4.5  # standard errors


def test_an_unknown_dipole_starts_beside_zero(tmp_path):
    path = lines_file(tmp_path / "lines.csv", OCS, [0.0, 2.0], 0.002)
    request = lines_request(path, Top.from_constants("B=6081.49 D=0.0013 MHz"), ["B", "mu_a"])
    assert any("mu_a at" in note and note.endswith("D") for note in request.notes)
    fit = answer_fit(request).fit
    assert abs(fit.values[1]) == pytest.approx(0.71519, abs=4 * fit.errors[1])


def test_the_command_fits_a_dipole_and_writes_it(tmp_path, call):
    path = lines_file(tmp_path / "lines.csv", OCS, [0.0, 1.0, 3.0], 0.002)
    start = tmp_path / "start.toml"
    start.write_text('name = "OCS"\nconstants = { B = 6081.4, D = 0.0013 }\ndipole = { a = 0.7 }\n')
    stem = tmp_path / "fitted"
    options = ("--free", "B,D,mu_a", "--out", str(stem), "--save-lines", str(tmp_path / "again.csv"))
    code, out, _ = call("fit", path, "--start", str(start), *options)
    assert code == 0
    assert "mu_a" in out
    written = (tmp_path / "fitted.toml").read_text()
    assert "0.715" in written
    assert not (tmp_path / "fitted.par").exists()
    assert "mu in D" in (tmp_path / "fitted.fit").read_text()
    again = (tmp_path / "again.csv").read_text().splitlines()
    assert again[0].startswith("j_upper,m_upper,j_lower,m_lower,field_kv_per_cm,frequency_mhz")
    assert len(again) == len(Path(path).read_text().splitlines())


@pytest.mark.parametrize(
    ("text", "free", "message"),
    [
        ("j_upper,j_lower,frequency_mhz\n1,0,12163\n2,1,24326\n", ["B", "mu_a"], "no column field_kv_per_cm"),
        ("j_upper,m_upper,j_lower,m_lower,field_kv_per_cm,frequency_mhz\n1,0,0,0,1e9,12163\n", ["B"], "at most 100000 kV/cm"),
        ("j_upper,m_upper,j_lower,m_lower,field_kv_per_cm,frequency_mhz\n1,0,0,0,x,12163\n", ["B"], "finite number"),
        ("j_upper,j_lower,field_kv_per_cm,frequency_mhz\n1,0,1,12163\n", ["B"], "no column m_upper, m_lower"),
        ("j_upper,m_upper,j_lower,m_lower,field_kv_per_cm,frequency_mhz\n1,0,0,0,1,12163\n", ["mu_b"], "linear top are fitted with mu_a"),
    ],
)  # fmt: skip
def test_wrong_lines_are_refused(tmp_path, text, free, message):
    path = tmp_path / "lines.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        lines_request(str(path), OCS, free)


def test_a_level_that_is_none_is_named(tmp_path):
    path = tmp_path / "lines.csv"
    path.write_text(
        "j_upper,m_upper,j_lower,m_lower,field_kv_per_cm,frequency_mhz,error_mhz\n1,2,0,0,1,12163,0.1\n1,0,0,0,1,12163,0.1\n"
    )
    with pytest.raises(ValueError, match=r"line 1, .*there is no level with j = 1, m = 2, field = 1 kV/cm"):
        answer_fit(lines_request(str(path), OCS, ["B"]))
