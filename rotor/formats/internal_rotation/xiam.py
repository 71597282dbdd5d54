"""Input (.xi) and output (.xo) of XIAM: constants in principal axes, with one to three tops.

XIAM has z, x, y = a, b, c and gigahertz (H. Hartwig and H. Dreizler, Z. Naturforsch. 51a (1996) 923; its manual xiam-v25.txt, Version 2.5):

    BJ = ½(B + C),    BK = A - ½(B + C),    B- = ½(B - C),    V1n = V3,    V2n = V6,

F0, delta and epsil (radians) of a top; mu_x, mu_y, mu_z in debye. Watson's reduction is A where `reduc` is 0 and S where it is 1. A
constant with an index in brackets belongs to one set of constants B; the first is read, and those of several tops end in _1, _2, _3.
Lines that begin with a backslash print what XIAM derives; of these delta is read, F, rho and beta follow here anew.

Quadrupole coupling in the manual's elements, with one factor e1,

    chi_zz (3K² - J(J+1)),    chi_- ½ √... (K to K+2),    chi_xz (1 + 2K) √... (K to K+1),

is e1 [chi_zz (3Pz² - P²) + chi_- (Px² - Py²) + 2 chi_xz {Px Pz} ...]: chi_aa = chi_zz, chi_bb - chi_cc = chi_-, chi_ab = chi_xz,
chi_ac = chi_yz, chi_bc = chi_xy. `spin` is 2I; the nucleus has no name in the file and is called I1, that of `spin2` is not read.
"""

from __future__ import annotations

import os
import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from rotor.formats.packed import load
from rotor.tops.constants.constants import Constants
from rotor.tops.internal_rotation import InternalRotationConstants
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.top import Top

MHZ_PER_GHZ = 1e3
NAMES = {
    "A": ("DeltaJ", "DeltaJK", "DeltaK", "deltaJ", "deltaK", "PhiJ", "PhiJK", "PhiKJ", "PhiK", "phiJ", "phiJK", "phiK"),
    "S": ("DJ", "DJK", "DK", "d1", "d2", "HJ", "HJK", "HKJ", "HK", "h1", "h2", "h3"),
}  # ours by reduction, in the order of XIAM's
DISTORTION = ("DJ", "DJK", "DK", "dj", "dk", "H_J", "HJK", "HKJ", "H_K", "h_j", "hjk", "h_k")
ROTATION = ("BJ", "BK", "B-")
DIPOLE = ("mu_z", "mu_x", "mu_y")  # along a, b, c
OF_TOP = {"F0": "F0", "delta": "delta", "epsil": "epsilon", "V1n": "V3", "V2n": "V6"}
DERIVED = ("F", "rho", "beta", "gamma")
SPIN = "I1"  # the file does not name its nucleus
QUADRUPOLE = {
    "chi_zz": "chi_aa", "chi_z": "chi_aa", "chi_-": "chi_bb-cc", "chi-": "chi_bb-cc", "chi_xz": "chi_ab", "chi_yz": "chi_ac",
    "chi_xy": "chi_bc",
}  # fmt: skip
SPIN_ROTATION = ("C+", "C_z", "C-")
_CONSTANT = re.compile(
    r"\s*\\?(?P<name>[A-Za-z][\w\-+]*)(?:\((?P<set>\d+)\))?\s+(?P<value>[-+]?[\d.]+(?:[EDed][-+]?\d+)?)(?=\s|$)"
)
_SETTING = {"reduc": "reduc", "reduct": "reduc", "ntop": "ntop", "nfold": "nfold", "spin": "spin", "spin2": "spin2"}


def read_xiam(path: str | os.PathLike[str]) -> Top:
    """The top of an input or output file of XIAM.

    path: a .xi or .xo file.
    Returns: top with constants of internal rotation in the frame PAM, and of one nucleus named I1.
    Raises ValueError with the file, for missing or unsupported constants.
    """
    text = load(path)[0].decode("utf-8", errors="replace")
    settings, values = _content(text)
    try:
        return _top(Path(path).stem, settings, values)
    except ValueError as reason:
        raise ValueError(f"{os.fspath(path)}: {reason}") from None


def _content(text: str) -> tuple[dict[str, int], dict[str, float]]:
    """Settings and constants of the first set; for an output, from the part before its lines."""
    settings: dict[str, int] = {}
    values: dict[str, float] = {}
    if "Using Watson S Reduction" in text:
        settings["reduc"] = 1
    accepted = {*ROTATION, *DISTORTION, *DIPOLE, *OF_TOP, *DERIVED, *QUADRUPOLE, *SPIN_ROTATION}
    for line in text.split("-- B ")[0].splitlines():
        words = line.split()
        for name, number in pairwise(words):
            if name in _SETTING and number.isdigit():
                settings[_SETTING[name]] = int(number)
        match = _CONSTANT.match(line)
        if match is None or match["set"] not in (None, "1"):
            continue
        plain = re.sub(r"_[123]$", "", match["name"])
        if plain in accepted or plain.startswith(("Dpi2", "Dc3", "F12", "Vss", "Vcc", "mk")):
            values.setdefault(match["name"], float(match["value"].upper().replace("D", "E")))
    return settings, values


def _top(name: str, settings: dict[str, int], values: dict[str, float]) -> Top:
    missing = [key for key in ROTATION if key not in values]
    if missing:
        raise ValueError(f"{', '.join(missing)} missing; expected the constants of an input or output of XIAM")
    reduction = {0: "A", 1: "S"}.get(settings.get("reduc", 0))
    if reduction is None:
        raise ValueError(f"reduc {settings['reduc']}: read are Watson's A (0) and S (1)")
    tops = settings.get("ntop", 1)
    if tops not in (1, 2, 3) or settings.get("nfold", 3) != 3:
        raise ValueError(f"{tops} tops of fold {settings.get('nfold', 3)}: rotor reads one to three threefold tops")
    strange = [
        key for key, value in values.items()
        if value and re.sub(r"_[123]$", "", key) not in (*ROTATION, *DISTORTION, *DIPOLE, *OF_TOP, *DERIVED, *QUADRUPOLE)
    ]  # fmt: skip
    if strange:
        squares = "; XIAM multiplies Dpi2 by ⟨p - ρ·P⟩², which no term here does" if "Dpi2" in "".join(strange) else ""
        raise ValueError(f"{', '.join(strange)}: these terms are not computed; leave them out and fit again{squares}")
    bj, bk, minus = (values[key] * MHZ_PER_GHZ for key in ROTATION)
    numbers: dict[str, Any] = {"A": bj + bk, "B": bj + minus, "C": bj - minus}
    numbers |= {
        ours: values[theirs] * MHZ_PER_GHZ
        for ours, theirs in zip(NAMES[reduction], DISTORTION, strict=True)
        if values.get(theirs)
    }
    constants = Constants(**numbers, reduction=reduction, representation="Ir")
    internal = InternalRotationConstants(
        _single_top(values) if tops == 1 else _several_tops(values, tops), "PAM", vt_max=0, source="file of XIAM"
    )
    dipole = tuple(values.get(key, 0.0) for key in DIPOLE)
    top = Top.from_constants(
        constants, dipole_abc_debye=dipole, internal_rotation=internal, spin_constants=_spin(settings, values)
    )
    return replace(top, name=name)


def _spin(settings: dict[str, int], values: dict[str, float]) -> SpinConstants | None:
    """Quadrupole coupling of the nucleus, MHz; None without a spin or constants."""
    coupling = {ours: values[theirs] * MHZ_PER_GHZ for theirs, ours in QUADRUPOLE.items() if values.get(theirs)}
    if settings.get("spin2"):
        raise ValueError(
            f"spin2 {settings['spin2']}: rotor reads a single nucleus; leave out the second and give --spin-constants"
        )
    if coupling and settings.get("spin", 0) < 2:
        raise ValueError(
            f"{', '.join(coupling)} beside spin {settings.get('spin', 0)}: expected spin 2 (twice I) or more"
        )
    if not coupling:
        return None
    return SpinConstants(
        {f"{key}({SPIN})": value for key, value in coupling.items()}, {SPIN: settings["spin"]}, "file of XIAM"
    )


def _single_top(values: dict[str, float]) -> dict[str, float]:
    """F0, delta, epsilon unless the axis is in the plane ab, and barriers of one top."""
    constants = _top_constants(values, "")
    turn = constants.pop("epsilon", 0.0)
    if abs(np.sin(turn)) > 1e-6:
        return constants | {"epsilon": turn}
    return constants | {"delta": float(np.cos(turn)) * constants["delta"]}


def _several_tops(values: dict[str, float], tops: int) -> dict[str, float]:
    return {
        f"{name}_{top}": value
        for top in range(1, tops + 1)
        for name, value in _top_constants(values, f"_{top}").items()
    }


def _top_constants(values: dict[str, float], suffix: str) -> dict[str, float]:
    """F0, delta, epsilon, V3 and V6 of one top, MHz and radians."""
    constants = {}
    for theirs, ours in OF_TOP.items():
        value = values.get(f"{theirs}{suffix}", values.get(f"{theirs}_1") if not suffix else None)
        if value is not None:
            constants[ours] = value if ours in ("delta", "epsilon") else value * MHZ_PER_GHZ
    missing = [key for key in ("F0", "delta", "V1n") if OF_TOP[key] not in constants]
    if missing:
        names = ", ".join(f"{key}{suffix}" for key in missing)
        raise ValueError(f"{names} missing; expected F0, delta and V1n of each top (adj 25 of XIAM)")
    return constants
