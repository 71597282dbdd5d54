"""Constants of internal rotation between frames, and XIAM's splittings from constants of the principal axes."""

import numpy as np
import pytest
from places import ORACLES
from rho_axis_frame import ram_of_pam

import rotor
from rotor.quantum.internal_rotation.frames import torsional_kinetics
from rotor.quantum.internal_rotation.levels import turning_tops
from rotor.tops.internal_rotation import InternalRotationConstants

# XIAM's printed BJ, BK, B-, F0, delta, barriers and quartic constants (GHz), and what it derives from them: F, rho, beta
MTBE = {
    "b": (2.731574558, 1.651265676, 0.000818278),
    "f0": 156.758300542,
    "delta": 0.460684017,
    "V3": 23855.231617,
    "V6": -11471.086948,
}
MTBE_DERIVED = (160.922724228, 0.026215839, 0.300066193)
CYCLOTENE = {
    "b": (1.645509220, 1.441295129, 0.389996386),
    "f0": 158.594089694,
    "delta": 0.322025461,
    "V3": 11100.189782,
}
CYCLOTENE_DERIVED = (161.632715565, 0.018904615, 0.216558561)
QUARTIC = {
    "mtbe": {"DJ": 0.323517e-3, "DJK": 4.212895e-3, "DK": -3.657421e-3, "d1": -5.111316e-6, "d2": -11.765429e-6},
    "cyclotene": {
        "DeltaJ": 0.070680e-3,
        "DeltaJK": 0.302973e-3,
        "DeltaK": -0.112991e-3,
        "deltaJ": 0.025906e-3,
        "deltaK": 0.234007e-3,
    },
}


def abc_mhz(case):
    bj, bk, minus = case["b"]
    return [1e3 * (bj + bk), 1e3 * (bj + minus), 1e3 * (bj - minus)]


def kinetics(case):
    f, rho = torsional_kinetics(
        dict(zip("ABC", abc_mhz(case), strict=True)), {"F0": 1e3 * case["f0"], "delta": case["delta"]}
    )
    return f[0, 0], rho[0]


@pytest.mark.parametrize(("case", "derived"), [(MTBE, MTBE_DERIVED), (CYCLOTENE, CYCLOTENE_DERIVED)])
def test_f_rho_and_the_angle_of_rho_are_those_of_xiam(case, derived):
    f, rho = kinetics(case)
    assert f == pytest.approx(1e3 * derived[0], rel=2e-10)  # the digits that XIAM prints
    assert np.linalg.norm(rho) == pytest.approx(derived[1], rel=3e-8)
    assert np.arctan2(rho[1], rho[0]) == pytest.approx(derived[2], abs=2e-9)


def test_the_rho_axis_frame_keeps_the_constants_of_the_principal_axes_and_has_its_z_along_rho():
    rng = np.random.default_rng(7)
    for _ in range(20):
        abc = np.sort(rng.uniform(1.0, 10.0, 3))[::-1]
        rho = rng.uniform(-0.3, 0.3, 3)
        ram = ram_of_pam(abc, 150.0, rho)
        ab, bc, ac = (ram.get(name, 0.0) for name in ("Dab", "Dbc", "Dac"))
        values, vectors = np.linalg.eigh(np.array([[ram["A"], ab, ac], [ab, ram["B"], bc], [ac, bc, ram["C"]]]))
        assert np.allclose(values[::-1], abc, rtol=1e-12)  # a rotation keeps them
        assert np.allclose(np.abs(ram["rho"] * vectors[0, ::-1]), np.abs(rho), rtol=1e-10)


def pam_top(case, constants_mhz):
    a, b, c = abc_mhz(case)
    values = {"F0": 1e3 * case["f0"], "delta": case["delta"], "V3": 1e3 * case["V3"]} | {
        "V6": 1e3 * case.get("V6", 0.0)
    }
    internal = InternalRotationConstants(values, "PAM", vt_max=0)
    reduction = "S" if "DJ" in constants_mhz else "A"
    constants = rotor.Constants(A=a, B=b, C=c, **constants_mhz, reduction=reduction, representation="Ir")
    return rotor.Top.from_constants(constants, dipole_abc_debye=(0.1, 1.2, 0.0), internal_rotation=internal)


def test_levels_do_not_depend_on_the_frame():
    top = pam_top(CYCLOTENE, {})
    ram = ram_of_pam(abc_mhz(CYCLOTENE), *kinetics(CYCLOTENE))
    internal = InternalRotationConstants(
        {"V3": 1e3 * CYCLOTENE["V3"], **{name: ram[name] for name in ("F", "rho", "Dab")}}, "RAM", vt_max=0
    )
    constants = rotor.Constants(**{name: ram[name] for name in "ABC"}, reduction="A", representation="Ir")
    cosine, sine, _ = turning_tops(top, top.internal_rotation).frame.rows[0]
    turned = (0.1 * cosine + 1.2 * sine, 1.2 * cosine - 0.1 * sine, 0.0)
    same = rotor.Top.from_constants(constants, dipole_abc_debye=turned, internal_rotation=internal)
    ours, others = (rotor.line_list(one, jmax=4, q=1.0, min_lgint=None) for one in (top, same))
    assert (
        np.abs(np.sort(ours.levels.energy_mhz) - np.sort(others.levels.energy_mhz)).max() < 1e-7
    )  # rounding of 1e7 MHz
    assert ours.strength_debye2.sum() == pytest.approx(others.strength_debye2.sum(), rel=1e-10)


@pytest.mark.parametrize(("name", "case", "rms_khz"), [("mtbe", MTBE, 2.1), ("cyclotene", CYCLOTENE, 0.30)])
def test_splittings_of_a_and_e_are_those_of_xiam(name, case, rms_khz):
    """MTBE: 2.0 kHz rms of exact PAM, since XIAM leaves out overlaps of the torsion there; cyclotene: 0.25 kHz."""
    top = pam_top(case, QUARTIC[name])
    levels = rotor.solve_levels(top, 12 if name == "cyclotene" else 5)
    rows = (ORACLES / "xiam.txt").read_text().splitlines()[1:]
    rows = [row.split()[1:] for row in rows if row.startswith(name)]
    assert len(rows) > 60
    differences = []
    for *labels, _, split in rows:
        j, ka, kc, *low = map(int, labels)
        ours = {
            species: levels.energy_mhz[levels.find(species=species, vt=0, j=j, ka=ka, kc=kc)]
            - levels.energy_mhz[levels.find(species=species, vt=0, j=low[0], ka=low[1], kc=low[2])]
            for species in "AE"
        }
        differences.append(float(split) - (ours["E"] - ours["A"]))
    assert np.sqrt(np.mean(np.square(differences))) * 1e3 < rms_khz
    assert np.abs(differences).max() * 1e3 < 5 * rms_khz


def test_a_mixture_of_frames_is_refused():
    with pytest.raises(ValueError, match="rho in the frame PAM"):
        InternalRotationConstants({"F0": 1.0, "delta": 0.1, "V3": 1.0, "rho": 0.1}, "PAM")
