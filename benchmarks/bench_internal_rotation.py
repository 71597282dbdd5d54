"""Internal rotation: levels of BELGI, a fit of westerfit's, truncation, limits, and processor times, in one table.

    python benchmarks/bench_internal_rotation.py --shared ../shared

Times are processor seconds of the second of two runs, in memory. Without --shared the comparisons with BELGI and westerfit are left out.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import rotor
from rotor.fitting.assignment import assignments
from rotor.fitting.fit import fit_lines
from rotor.fitting.parameters import parameters
from rotor.fitting.search.residuals import FitOptions
from rotor.fitting.top_constants import TopConstants
from rotor.formats.internal_rotation.belgi import read_belgi_levels
from rotor.quantum.internal_rotation.labels import counted_ka_kc
from rotor.quantum.internal_rotation.model import RamModel
from rotor.quantum.internal_rotation.truncation import truncation_mhz
from rotor.tops.internal_rotation import InternalRotationConstants

CM = rotor.units.MHZ_PER_CM
BELGI = {"A": 0.100069228559446, "B": 5.003461427972281e-2, "C": 3.335640951981520e-2, "F": 5.1}
ACETALDEHYDE = {"A": 1.8848813, "B": 0.3487065, "C": 0.303184, "Dab": 0.122669, "F": 7.567082, "V3": 407.59768}
METHYL_FORMATE = {"A": 0.5884101, "B": 0.3082455, "C": 0.17711843, "Dab": -0.1649794, "F": 5.49038, "V3": 370.924}
CH3OD = {"A": 3.675099, "B": 0.783150, "C": 0.733527, "Dab": 0.027977826, "F": 17.42797209, "V3": 183.171569}


def model(constants_cm: dict[str, float], rho: float) -> RamModel:
    """A model of constants in cm-1."""
    return RamModel({name: value * CM for name, value in constants_cm.items()} | {"rho": rho})


def belgi(folder: Path) -> tuple[int, float]:
    """Levels compared by name, and the largest difference in kHz."""
    count, largest = 0, 0.0
    for barrier in (20, 200):
        listed = read_belgi_levels(folder / "belgi" / f"v{barrier}.txt")
        ram = model(BELGI | {"V3": float(barrier)}, 0.05)
        for sigma in (0, 1):
            ours = ram.blocks(sigma, 6).solve(ram.coefficients, 3)
            quanta = ours.quanta
            k = counted_ka_kc(quanta["j"], quanta["vt"], ours.energies)[0] if sigma == 0 else quanta["k"]
            names = np.column_stack([quanta["j"], quanta["vt"], k])
            theirs = np.column_stack([listed.j, listed.vt, listed.k, listed.energy_cm])[listed.species == sigma]
            a = names[order := np.lexsort([ours.energies, *names.T])], ours.energies[order]
            order = np.lexsort([theirs[:, 3], *theirs[:, :3].T])
            assert (a[0] == theirs[order, :3]).all(), "a level has another name"
            largest = max(largest, float(np.abs(a[1] - theirs[order, 3] * CM).max()) * 1e3)
            count += len(theirs)
    return count, largest


def truncation(constants: dict[str, float], rho: float) -> tuple[float, float]:
    """The largest difference in Hz of v_t = 0 at J = 25 between n_v = 9 and all functions, and the stated one."""
    ram, actual = model(constants, rho), 0.0
    for sigma in (0, 1):
        computed = [ram.blocks(sigma, 25, jmin=25, count=n).solve(ram.coefficients, 0) for n in (9, 21)]
        by_name = [entry.energies[np.lexsort([entry.quanta[n] for n in ("kc", "ka")])] for entry in computed]
        actual = max(actual, float(np.abs(by_name[0] - by_name[1]).max()))
    return actual * 1e6, truncation_mhz(ram, 25, 0, 9) * 1e6


def slope_to_rigid() -> float:
    """d ln(error)/d ln(V3) of an asymmetric top towards the rigid one."""
    constants = {"A": 9000.0, "B": 5000.0, "C": 3000.0}
    rigid = rotor.api.solve_levels(rotor.Top.from_constants(constants), 3)
    expected, errors = np.sort(rigid.energy_mhz[rigid.quanta["j"] == 3]), []
    for ratio in (4e3, 16e3):
        ram = RamModel(constants | {"F": 160e3, "rho": 0.1, "V3": 160e3 * ratio})
        levels = ram.blocks(0, 3, count=7, waves=24).solve(ram.coefficients, 0)
        computed = np.sort(levels.energies[levels.quanta["j"] == 3]) - levels.energies[levels.quanta["j"] == 0][0]
        errors.append(np.abs(computed - expected).max())
    return float(np.log(errors[1] / errors[0]) / np.log(4.0))


def acetaldehyde(vt_max: int = 1, **spins: Any) -> rotor.Top:
    """A top with internal rotation, with a nucleus where one is given."""
    values = {name: f"{ACETALDEHYDE[name]} cm-1" for name in ("F", "V3", "Dab")} | {"rho": 0.328632673}
    constants = rotor.Constants(**{name: ACETALDEHYDE[name] * CM for name in "ABC"}, reduction="A", representation="Ir")
    internal = InternalRotationConstants(values, "RAM", vt_max=vt_max)
    return rotor.Top.from_constants(constants, dipole_abc_debye=(2.55, 0.87, 0.0), internal_rotation=internal, **spins)


def two_tops(equal: bool) -> rotor.Top:
    """Two tops of different or equal constants."""
    second = (
        {"F0_2": 158e3, "delta_2": np.pi - 0.56, "V3_2": 250 * CM}
        if equal
        else {"F0_2": 161e3, "delta_2": 2.5, "V3_2": 340 * CM}
    )
    internal = InternalRotationConstants({"F0_1": 158e3, "delta_1": 0.56, "V3_1": 250 * CM, **second}, "PAM", vt_max=0)
    constants = rotor.Constants(A=9800.0, B=4300.0, C=3200.0, reduction="A", representation="Ir")
    return rotor.Top.from_constants(constants, dipole_abc_debye=(0.0, 1.3, 0.0), internal_rotation=internal)


def three_tops() -> rotor.Top:
    """Three different tops."""
    tops = zip((158e3, 161e3, 159.5e3), (0.56, 2.5, 1.45), (250 * CM, 340 * CM, 300 * CM), strict=True)
    numbered = [(f"F0_{i}", f0, f"delta_{i}", delta, f"V3_{i}", v3) for i, (f0, delta, v3) in enumerate(tops, 1)]
    values = {name: value for row in numbered for name, value in zip(row[::2], row[1::2], strict=True)}
    constants = rotor.Constants(A=4800.0, B=3300.0, C=2200.0, reduction="A", representation="Ir")
    internal = InternalRotationConstants(values, "PAM", vt_max=0)
    return rotor.Top.from_constants(constants, dipole_abc_debye=(0.3, 1.3, 0.0), internal_rotation=internal)


def iteration_of_a_fit() -> Callable[[], object]:
    """One evaluation of 1000 lines of v_t = 0 and 1 with 19 constants."""
    names = ("j", "ka", "kc", "species", "vt")
    top = acetaldehyde()
    seen = rotor.api.line_list(top, jmax=15, min_lgint=None, q=1.0, range_mhz=(5e3, 5e5))
    quanta = {key: np.where(c == "E", 1, 0) if key == "species" else c for key, c in seen.levels.quanta.items()}
    rows = np.random.default_rng(1).permutation(len(seen.upper))[:1000]
    upper, lower = (np.column_stack([quanta[n][side[rows]] for n in names]) for side in (seen.upper, seen.lower))
    lines = assignments(names, upper, lower, seen.frequency_mhz[rows], 0.1)
    free = [
        "A",
        "B",
        "C",
        "Dab",
        "rho",
        "V3",
        "F",
        "V6",
        "V3J",
        "V3K",
        "FJ",
        "FK",
        "rhoJ",
        "rhoK",
        "DeltaJ",
        "DeltaJK",
        "DeltaK",
        "deltaJ",
        "deltaK",
    ]
    start = TopConstants(top)
    start = start.replace(**{name: 0.0 for name in free if name not in start})
    from rotor.fitting.assignment import levels_in
    from rotor.fitting.levels.top_levels import label_model

    levels = label_model(start, levels_in(lines)[0])
    values = np.array(list(start.values.values()))
    return lambda: levels.levels(values)


def butynoic_acid(folder: Path) -> Callable[[], Any]:
    """The fit of 2-butynoic acid from its published start."""
    rows = np.array(
        [
            [float(x) for x in row.split(",")]
            for row in (folder / "westerfit" / "2ba.lne").read_text().splitlines()
            if row.strip()
        ]
    )
    labels = [np.column_stack([rows[:, [i + 1, i + 2, i + 3, i + 4]], 0 * rows[:, 0]]).astype(int) for i in (0, 5)]
    lines = assignments(("j", "ka", "kc", "species", "vt"), *labels, rows[:, 10], rows[:, 11])
    rotation = {
        "A": 11268.9001,
        "B": 1752.18585,
        "C": 1529.58084,
        "DeltaJ": 4.367e-5,
        "DeltaJK": 0.011352,
        "DeltaK": 0.002639,
        "deltaJ": 1.1833e-5,
        "Jpm4": -1.4953e-5,
    }
    internal = {
        "rho": 0.0715287,
        "V3": 1.009028 * CM,
        "Dab": -16.185,
        "FJ": -0.037256,
        "rhoJ": 0.0352036,
        "rhoK": 0.015021,
        "Jz1Jpm2p1": -0.00037594,
    }
    names = InternalRotationConstants({"F": 5.66 * CM, **internal}, "RAM", vt_max=0, names="energy")
    start = TopConstants(
        rotor.Top.from_constants(
            rotor.Constants(**rotation, reduction="A", representation="Ir"), internal_rotation=names
        )
    )
    return lambda: fit_lines(lines, start, parameters(start, [*rotation, *internal]), FitOptions())


def seconds(work: Callable[[], Any]) -> tuple[float, Any]:
    """Processor seconds of the second run, and what it returned."""
    work()
    start = time.process_time()
    result = work()
    return time.process_time() - start, result


def modules_of_a_rigid_spectrum() -> int:
    """How many modules of internal rotation a rigid spectrum loads."""
    code = (
        "import sys, rotor; top = rotor.Top.from_constants('A=9 B=4 C=3 GHz', dipole_abc_debye=(1, 0, 0));"
        "rotor.line_list(top, jmax=5, temperature_k=10);"
        "print(sum('quantum.internal_rotation' in name or name.endswith('quantum.torsion') for name in sys.modules))"
    )
    return int(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--shared", type=Path, default=Path("../shared"))
    folder = parser.parse_args().shared / "reference" / "internal_rotation"
    if folder.is_dir():
        count, largest = belgi(folder)
        print(f"BELGI: {count} levels, every name, largest difference {largest:.4f} kHz")
        spent, fit = seconds(butynoic_acid(folder))
        print(f"2-butynoic acid: rms {fit.rms_mhz() * 1e3:.2f} kHz of {len(fit.difference_mhz)} lines in {spent:.2f} s")
    for name, constants, rho in (
        ("methyl formate", METHYL_FORMATE, 0.08427127),
        ("CH3OD", CH3OD, 0.6993446726),
        ("CH3CHO", ACETALDEHYDE, 0.3286),
    ):
        actual, stated = truncation(constants, rho)
        print(f"n_v = 9 against all functions, J = 25, v_t = 0, {name}: {actual:.2g} Hz, stated {stated:.2g} Hz")
    print(f"towards the rigid top: slope {slope_to_rigid():.3f} in V3")
    print(f"modules of internal rotation in a rigid spectrum: {modules_of_a_rigid_spectrum()}")
    nucleus = acetaldehyde(spin_constants=rotor.SpinConstants.parse("chi_aa(14N)=-4 chi_bb(14N)=2 MHz"))
    works: dict[str, Callable[[], Any]] = {
        "levels and lines of one top, v_t = 0 and 1, J to 30": lambda: rotor.api.line_list(
            acetaldehyde(), jmax=30, q=1.0, min_lgint=None
        ),
        "levels and lines of one top with one nucleus, v_t = 0 and 1, J to 14": lambda: rotor.api.line_list(
            nucleus, jmax=14, q=1.0, min_lgint=None, effects=rotor.api.effects_of(nucleus, True)
        ),
        "an iteration of a fit, 1000 lines, 19 constants": iteration_of_a_fit(),
        "levels and lines of two tops, five species, J to 20": lambda: rotor.api.line_list(
            two_tops(False), jmax=20, q=1.0, min_lgint=None
        ),
        "levels and lines of equivalent tops, four species, J to 20": lambda: rotor.api.line_list(
            two_tops(True), jmax=20, q=1.0, min_lgint=None
        ),
        "levels and lines of three tops, 14 species, J to 10": lambda: rotor.api.line_list(
            three_tops(), jmax=10, q=1.0, min_lgint=None
        ),
    }
    for name, work in works.items():
        print(f"{name}: {seconds(work)[0]:.2f} s")


if __name__ == "__main__":
    main()
