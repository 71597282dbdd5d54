"""Fits with internal rotation: 2-butynoic acid as westerfit has it, derivatives, constants found again."""

import numpy as np
import pytest
from places import ORACLES

import rotor
from rotor.fitting.assignment import assignments, levels_in
from rotor.fitting.fit import fit_lines
from rotor.fitting.levels.top_levels import label_model
from rotor.fitting.parameters import parameters
from rotor.fitting.top_constants import TopConstants
from rotor.quantum.labels.labelled import MissingLevelsError
from rotor.tops.internal_rotation import InternalRotationConstants

CM = rotor.units.MHZ_PER_CM
NAMES = ("j", "ka", "kc", "species", "vt")
OF_TOP = ("F0", "delta", "epsilon", "V3")

# 2ba.inp and 2ba.out: value before and after its fit, standard error; ½ of what multiplies N₊ⁿ + N₋ⁿ, Watson's signs
WESTERFIT = {
    "A": (11268.900113839629, 11269.900046035558, 1.08e-3),
    "B": (1752.1858457245653, 1752.185883795314, 1.49e-4),
    "C": (1529.5808412575634, 1529.5808257526596, 1.49e-4),
    "DeltaJ": (4.36707802770381e-5, 4.402600226953613e-5, 1.69e-6),
    "DeltaJK": (0.011352074685446559, 0.011351822000976095, 9.63e-6),
    "DeltaK": (0.002639063914417349, 0.002645404418713906, 2.08e-4),
    "deltaJ": (1.1832650420152253e-5, 1.2019765557067575e-5, 6.46e-7),
    "Jpm4": (-1.4952931691865935e-5, -1.541215947494109e-5, 1.89e-6),
    "rho": (0.07152870055577949, 0.07152869863830656, 3.72e-8),
    "V3": (1.009028077688395 * CM, 1.0090074507294404 * CM, 4.08e-4 * CM),
    "Dab": (-16.185008941764856, -16.184618098028285, 4.76e-3),
    "FJ": (-0.03725612111823862, -0.03725174662283204, 9.55e-5),
    "rhoJ": (0.03520364324277837, 0.03520452776801956, 3.51e-5),
    "rhoK": (0.015020957057119913, 0.015050519540083438, 7.38e-4),
    "Jz1Jpm2p1": (-0.0003759404894074222, -0.00037274016014681815, 3.10e-5),
}
TORSIONAL = ("rho", "V3", "Dab", "FJ", "rhoJ", "rhoK", "Jz1Jpm2p1")


def butynoic_acid():
    start = {name: values[0] for name, values in WESTERFIT.items()}
    internal = {"F": 5.66 * CM} | {name: start.pop(name) for name in TORSIONAL}
    constants = rotor.Constants(**start, reduction="A", representation="Ir")
    names = InternalRotationConstants(internal, "RAM", vt_max=0, names="energy")
    top = rotor.Top.from_constants(constants, internal_rotation=names)
    rows = np.loadtxt(ORACLES / "2ba.txt")
    labels = [np.column_stack([rows[:, first : first + 4], 0 * rows[:, 0]]).astype(int) for first in (0, 4)]
    return TopConstants(top), assignments(NAMES, *labels, rows[:, 8], rows[:, 9])


def test_butynoic_acid_comes_out_as_westerfit_has_it():
    constants, lines = butynoic_acid()
    assert constants.quanta == NAMES
    fit = fit_lines(lines, constants, parameters(constants, list(WESTERFIT)))
    assert fit.converged
    assert fit.rms_mhz() < 2.66e-3  # 2.65 kHz of an independent calculation, of 89 lines
    by_name = dict(zip(fit.parameters.names, fit.values, strict=True))
    for name, (_, published, error) in WESTERFIT.items():
        assert abs(by_name[name] - published) < error  # one standard error: its last step had not ended


def test_derivatives_by_every_constant_are_those_of_finite_differences():
    constants, lines = butynoic_acid()
    labels, _, _ = levels_in(lines)
    model = label_model(constants, labels)
    values = np.array(list(constants.values.values()))
    _, slopes = model.levels(values)
    for i, (name, value) in enumerate(constants.values.items()):
        step = max(abs(value) * (1e-5 if name in ("F", "rho", "V3") else 1e-3), 1e-9)
        changed = [np.where(np.arange(len(values)) == i, value + sign * step, values) for sign in (1, -1)]
        upper, lower = (model.levels(c)[0] for c in changed)
        expected = (upper - lower) / (2 * step)
        noise = 2e-8 / step  # rounding of eigenvalues of matrices with elements up to 1e8 MHz
        assert np.allclose(slopes[:, i], expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max() + noise)


def test_constants_are_found_again_from_lines_of_two_torsional_states():
    values = {"F": 227e3, "rho": 0.33, "V3": 12.2e6, "Dab": 3680.0}
    true = rotor.Constants(A=56500.0, B=10450.0, C=9090.0, reduction="A", representation="Ir")
    top = rotor.Top.from_constants(
        true, dipole_abc_debye=(2.4, 0.9, 0), internal_rotation=InternalRotationConstants(values, "RAM")
    )
    seen = rotor.line_list(top, jmax=5, min_lgint=None, q=1.0, range_mhz=(5e3, 3e5))
    quanta = {
        name: np.where(column == "E", 1, 0) if name == "species" else column
        for name, column in seen.levels.quanta.items()
    }
    upper, lower = (np.column_stack([quanta[name][rows] for name in NAMES]) for rows in (seen.upper, seen.lower))
    lines = assignments(NAMES, upper, lower, seen.frequency_mhz, 0.01)
    moved = InternalRotationConstants(values | {"rho": 0.3303, "V3": 12.23e6, "Dab": 3690.0}, "RAM")
    begin = rotor.Constants(A=56480.0, B=10451.0, C=9091.0, reduction="A", representation="Ir")
    start = TopConstants(rotor.Top.from_constants(begin, internal_rotation=moved))
    fit = fit_lines(lines, start, parameters(start, ["A", "B", "C", "Dab", "rho", "V3", "F"]))
    assert fit.converged
    for name, value in zip(fit.parameters.names, fit.values, strict=True):
        assert value == pytest.approx((values | dict(true.values))[name], rel=1e-8)  # lines without noise
    assert fit.rms_mhz() < 1e-6


def test_a_label_that_no_level_has_is_named():
    constants, lines = butynoic_acid()
    labels, _, _ = levels_in(lines)
    for label, text in (
        ([1, 0, 1, 2, 0], "species = 2, .*species: 0 is A, 1 is E"),
        ([2, 1, 3, 0, 0], "j = 2, ka = 1, kc = 3, .*Ka [+] Kc is J or one more"),
        ([2, 1, 2, 0, 8], "vt = 8: v_t is at most 7"),
    ):
        with pytest.raises(MissingLevelsError, match=text):
            label_model(constants, np.vstack([labels, [label]]))


def principal_axes(dipole=(1.4, 0.9, 0.0), **changes):
    values = {"F0": 158e3, "delta": 0.6, "V3": 3.0e6} | {k: v for k, v in changes.items() if k in OF_TOP}
    abc = {"A": 9100.0, "B": 4300.0, "C": 3000.0, "DeltaJ": 1e-3, "DeltaK": 2e-2}
    abc |= {k: v for k, v in changes.items() if k in abc}
    constants = rotor.Constants(**abc, reduction="A", representation="Ir")
    internal = InternalRotationConstants(values, "PAM", vt_max=0)
    return rotor.Top.from_constants(constants, dipole_abc_debye=dipole, internal_rotation=internal)


def lines_of(top, jmax):
    seen = rotor.api.line_list(top, jmax=jmax, min_lgint=None, q=1.0, range_mhz=(5e3, 1e5))
    quanta = {
        name: np.where(column == "E", 1, 0) if name == "species" else column
        for name, column in seen.levels.quanta.items()
    }
    upper, lower = (np.column_stack([quanta[name][rows] for name in NAMES]) for rows in (seen.upper, seen.lower))
    return assignments(NAMES, upper, lower, seen.frequency_mhz, 0.01)


@pytest.mark.parametrize(
    ("angles", "dipole"),
    [
        ({}, (1.4, 0.9, 0.0)),
        ({"epsilon": np.pi / 2}, (1.4, 0.0, 0.9)),
        ({"delta": np.pi / 2, "epsilon": 0.7}, (0.0, 1.4, 0.9)),
        ({"epsilon": 0.7}, (1.4, 0.9, 0.0)),
    ],
)
def test_derivatives_by_constants_of_principal_axes_are_those_of_finite_differences(angles, dipole):
    constants = TopConstants(principal_axes(dipole, **angles))
    labels, _, _ = levels_in(lines_of(constants.top, 4))
    model = label_model(constants, labels)
    values = np.array(list(constants.values.values()))
    _, slopes = model.levels(values)
    for i, (name, value) in enumerate(constants.values.items()):
        step = value * (1e-5 if name in OF_TOP else 1e-3)
        changed = [np.where(np.arange(len(values)) == i, value + sign * step, values) for sign in (1, -1)]
        upper, lower = (model.levels(c)[0] for c in changed)
        expected = (upper - lower) / (2 * step)
        noise = 2e-8 / step  # rounding of eigenvalues of matrices with elements up to 1e8 MHz
        assert np.allclose(slopes[:, i], expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max() + noise), name


@pytest.mark.parametrize(("epsilon", "free"), [(0.0, ()), (np.pi / 2, ()), (0.7, ("epsilon",))])
def test_constants_of_principal_axes_are_found_again(epsilon, free):
    dipole = (1.4, 0.0, 0.9) if epsilon > 1 else (1.4, 0.9, 0.0)
    true = principal_axes(dipole, epsilon=epsilon)
    lines = lines_of(true, 5)
    start = TopConstants(
        principal_axes(dipole, A=9102.0, B=4300.4, delta=0.602, V3=3.02e6, epsilon=epsilon + 0.002 * len(free))
    )
    fit = fit_lines(lines, start, parameters(start, ["A", "B", "C", "delta", "V3", "F0", *free]))
    assert fit.converged
    expected = dict(true.constants.values) | dict(true.internal_rotation.values)
    for name, value in zip(fit.parameters.names, fit.values, strict=True):
        assert value == pytest.approx(expected[name], rel=1e-7)  # lines without noise


def acetaldehyde_like(barrier_cm):
    values = {"F0": 158e3, "delta": 0.56, "V3": barrier_cm * CM}
    return rotor.Top.from_constants(
        {"A": 56508.0, "B": 10454.0, "C": 9089.0},
        internal_rotation=InternalRotationConstants(values, frame="PAM", vt_max=0),
    )


def rotational_lines(top, jmax):
    """Some ΔJ = 1 lines of A and E without errors."""
    levels = rotor.levels(top, jmax=jmax).table.levels
    quanta = [np.asarray(levels.quanta[name]) for name in NAMES]
    labels = np.column_stack(
        [(q == "E").astype(int) if name == "species" else q for name, q in zip(NAMES, quanta, strict=True)]
    )
    energy, j, (ka, kc, species) = np.asarray(levels.energy_mhz), labels[:, 0], labels[:, 1:4].T
    step = energy[:, None] - energy
    chosen = (step > 0) & (step < 4e5) & (np.abs(j[:, None] - j) == 1) & (species[:, None] == species)
    chosen &= (np.abs(ka[:, None] - ka) <= 1) & ((ka + kc)[:, None] % 2 != (ka + kc) % 2)
    upper, lower = np.nonzero(chosen)
    return assignments(NAMES, labels[upper], labels[lower], step[upper, lower], np.full(len(upper), 0.02))


def test_a_barrier_held_at_a_wrong_value_is_named_where_constants_cross():
    """The fit ended in "the names follow the order A >= B >= C; exchange them", though the names were right."""
    lines = rotational_lines(acetaldehyde_like(400.0), 4)
    start = TopConstants(acetaldehyde_like(300.0))
    held = fit_lines(lines, start, parameters(start, ["A", "B", "C"]))
    assert not held.converged
    assert "they left the order A >= B >= C; F0, V3 held at a wrong value" in held.reason
    assert held.reason.endswith("can make rotational constants cross: free V3")
    assert "exchange" not in held.reason
    freed = fit_lines(lines, start, parameters(start, ["A", "B", "C", "V3"]))
    assert freed.converged
    assert freed.constants.values["V3"] == pytest.approx(400.0 * CM, rel=1e-6)
