"""Measured 14N splittings of N-methylformamide, whose barrier is low, from the constants of its published fit."""

import numpy as np
from places import ORACLES

import rotor
from rotor.fitting.levels.top_levels import label_model
from rotor.fitting.top_constants import TopConstants
from rotor.tops.internal_rotation import InternalRotationConstants

CM = rotor.units.MHZ_PER_CM
# cm-1, the larger constants of RAM36's input in wes648/Westerfit.jl @c465c5b, examples/nmf/input_Nmethylformamide.txt;
# 2Dzx and chi_ab there multiply half anticommutators once: they are twice Dab and chi_ab here
TORSIONAL = {
    "F": 5.5825022674605718, "V3": 51.719908837, "V6": 8.0286568650, "V9": 2.0575475131, "Dab": -0.15507074189, "V3J": -1.5939626042e-3,
    "rhoJ": 2.4034834055e-6, "V3ab": -9.1814949746e-3, "Fbc": -2.3266162869e-6, "V3K": 8.7184856061e-3, "rhoK": 1.1230441134e-5,
    "FK": -6.3308539247e-5, "DabK": 4.060877449e-6, "rhoab": -1.866775025e-5, "rhobc": 4.7393049923e-6, "J2cos6": 1.2412972225e-4,
    "D3bc": 2.354690894e-4, "rhom": 2.2240173696e-4, "Fm": -6.7979495846e-4, "Fab": 2.2615981537e-5,
}  # fmt: skip
HALF_SUM, AXIAL, HALF_DIFFERENCE = 0.22175219609123517 - 1.2412972225e-4, 0.35400364284702046, 0.05717595138097732
DISTORTION = {
    "DeltaJ": 3.0077525558e-7,
    "DeltaJK": -8.3336601e-7,
    "DeltaK": 3.0214665653e-6,
    "deltaJ": 1.0827117e-7,
    "deltaK": 3.6745322e-7,
}
CHI = {"chi_aa": 7.0092966296888729e-5, "chi_bb": 6.4465747808105926e-5, "chi_ab": 1.7545393051239724e-5 / 2}


def test_splittings_by_a_nucleus_are_the_measured_ones():
    internal = {name: value * CM for name, value in TORSIONAL.items()} | {"rho": 0.080976579060118736}
    rotation = {"A": AXIAL + HALF_SUM, "B": HALF_SUM + HALF_DIFFERENCE, "C": HALF_SUM - HALF_DIFFERENCE} | DISTORTION
    spins = " ".join(f"{name}(14N)={value * CM}" for name, value in CHI.items()) + " MHz"
    top = rotor.Top.from_constants(
        rotor.Constants(**{name: value * CM for name, value in rotation.items()}, reduction="A", representation="Ir"),
        spin_constants=spins,
        internal_rotation=InternalRotationConstants(internal, "RAM", vt_max=0, names="energy"),
    )
    constants = TopConstants(top, hyperfine=True)
    rows = np.loadtxt(ORACLES / "n_methylformamide.txt")
    labels = []
    for first in (1, 6):
        columns = dict(zip(("species", "f", "n", "ka", "kc"), rows[:, first : first + 5].astype(int).T, strict=True))
        columns["vt"] = np.zeros(len(rows), dtype=int)
        labels.append(np.column_stack([columns[name] for name in constants.quanta]))
    energies = label_model(constants, np.vstack(labels)).levels(np.array(list(constants.values.values())))[0]
    difference = rows[:, 0] - (energies[: len(rows)] - energies[len(rows) :])
    _, line = np.unique(rows[:, [1, 3, 4, 5, 8, 9, 10]], axis=0, return_inverse=True)
    centred = difference - np.array([difference[line == i].mean() for i in line.ravel()])
    measured = rows[:, 0] - np.array([rows[line == i, 0].mean() for i in line.ravel()])
    assert np.sqrt(np.mean(measured**2)) > 0.4  # MHz: how large the splittings are
    assert np.sqrt(np.mean(centred**2)) < 0.004  # MHz: the error of a line
