"""Write dipoles.csv: dipole components from the intensities that JPL's and CDMS's catalogues print.

`python data/make_dipoles.py PATH_TO_SHARED`, with the folder of reference files.

A catalogue's LGINT is log10 of I = 4.16231e-5 ν g_I S μ² [exp(-E″/kT) - exp(-E′/kT)] / Q at 300 K (H. M. Pickett et al.,
J. Quant. Spectrosc. Radiat. Transfer 60 (1998) 883, eq. 1), with the Q(300 K) of the catalogue's own list. S of every line
comes from the constants of data/molecules and is checked to be that of the catalogue's by how little μ differs between lines;
g_I is GUP over 2J'+1. Components of hyperfine structure are added. The dipole is what the compilers put into their program:
its source is in their documentation, and its accuracy is not the spread, which only says that the intensities hang together.
Where that dipole depends on rotation, the lines of J <= 3 stand for the vibrational ground state, and of linear molecules the
limit of μ² = μ0² (1 + c m²), m = J'' + 1 (R. Herman and R. F. Wallis, J. Chem. Phys. 23 (1955) 637).

Two lists print a Q that the intensities do not contain: of HC5N it counts the spin of 14N, which GUP does not; of N2O it
contains vibration, with which μ would be 0.1711 D instead of the 0.1609 D of Stark measurements. There Q is summed here.
"""

from __future__ import annotations

import csv
import gzip
import math
import sys
from pathlib import Path

import numpy as np

import rotor
from rotor import units
from rotor.arrays import Floats
from rotor.formats.spcat.text.cat import read_cat
from rotor.formats.spcat.text.catalogue import Catalogue

TABLE = Path(__file__).with_name("dipoles.csv")
COLUMNS = "molecule,axis,debye,catalogue,lines,relative_spread"
HEAD = """\
# Dipole components from the intensities of catalogues of JPL (H. M. Pickett et al., J. Quant. Spectrosc. Radiat. Transfer 60
# (1998) 883) and CDMS (H. S. P. Müller et al., Astron. Astrophys. 370 (2001) L49; J. Mol. Struct. 742 (2005) 215;
# C. P. Endres et al., J. Mol. Spectrosc. 327 (2016) 95). Written by make_dipoles.py, which says how.
"""
CATALOGUES = {
    "H2O": "c018003", "HDO": "c019002", "D2O": "c020001", "HCN": "c027501", "CO": "c028503", "H2CO": "c030501",
    "H2S": "c034502", "CH3CCH": "c040502", "CH3CN": "c041001", "CH2CO": "c042501", "HNCO": "c043002", "N2O": "c044004",
    "c-C2H4O": "c044504", "HCONH2": "c045512", "HCOOH": "c046506", "H2CS": "c046509", "CH3Cl": "c050007",
    "HC3N": "c051501", "CH2OHCHO": "c060501", "OCS": "c060503", "SO2": "c064502", "HC5N": "c075503",
}  # fmt: skip
INTENSITY_NM2_MHZ = 4.16231e-5  # the number of the catalogues, not CODATA's
OWN_Q = ("N2O", "HC5N")
HIGHEST_J, HIGHEST_K = 10, 4  # where the constants and a constant dipole serve
LIGHT, LIGHT_J = ("H2O", "HDO", "D2O", "H2S", "H2CO", "HNCO"), 3
Line = tuple[tuple[int, ...], tuple[int, ...]]  # quantum numbers of the upper and the lower level
NAMES = {"linear": ("j",), "prolate": ("j", "k"), "oblate": ("j", "k"), "asymmetric": ("j", "ka", "kc")}


def read_catalogue(shared: Path, tag: str) -> Catalogue:
    """A catalogue of the reference files, in whichever folder it is."""
    folders = (shared / "reference" / name for name in ("catalogues", "library_lines"))
    path = next(folder / f"{tag}.cat.gz" for folder in folders if (folder / f"{tag}.cat.gz").is_file())
    return read_cat(gzip.decompress(path.read_bytes()))


def q_of_catalogue(shared: Path, tag: str) -> float:
    """Q(300 K) in the list of JPL (numbers below 500 in the last three digits) or CDMS."""
    number, folder = int(tag.removeprefix("c")), shared / "reference" / "partition"
    if number % 1000 < 500:
        rows = (folder / "jpl_catdir.cat").read_text(encoding="utf-8").splitlines()
        return 10 ** float(next(row[26:33] for row in rows if int(row[:6]) == number))
    text = (folder / "cdms_partfunc.cat").read_text(encoding="utf-8", errors="replace")
    cells = ([cell.strip() for cell in row.split("|")] for row in text.splitlines())
    return 10 ** float(next(row[6] for row in cells if len(row) > 6 and row[1] == str(number)))


def line_strengths(found: Catalogue, q: float, width: int, highest_j: int) -> dict[Line, float]:
    """S μ² of every rotational line of the ground state, (upper, lower): hyperfine components added, g_I divided out."""
    strengths: dict[Line, float] = {}
    degeneracy: dict[Line, dict[tuple[int, ...], float]] = {}
    for i in range(len(found.frequency_mhz)):
        upper, lower = (tuple(x[i].tolist()) for x in (found.quanta_upper, found.quanta_lower))
        key = (tuple(map(abs, upper[:width])), tuple(map(abs, lower[:width])))
        excited = found.qnfmt[i] // 100 % 10 != width and width == 3 and found.qnfmt[i] >= 1000 and upper[3] > 0
        if excited or key[0][0] > highest_j or (width > 1 and max(key[0][1], key[1][1]) > HIGHEST_K):
            continue
        lower_k = float(found.energy_lower_cm[i]) * units.MHZ_PER_CM / units.MHZ_PER_K
        photon = float(found.frequency_mhz[i]) / units.MHZ_PER_K / 300.0
        scale = INTENSITY_NM2_MHZ * float(found.frequency_mhz[i]) * math.exp(-lower_k / 300.0) * -math.expm1(-photon)
        strengths[key] = strengths.get(key, 0.0) + 10 ** float(found.lgint[i]) * q / scale
        degeneracy.setdefault(key, {})[upper] = float(found.g_upper[i])
    return {key: s * (2 * key[0][0] + 1) / sum(degeneracy[key].values()) for key, s in strengths.items()}


def unit_strengths(name: str, axis: int) -> dict[Line, float]:
    """S of every line for a dipole of 1 D along one axis, per component of the upper state's degeneracy 2J'+1."""
    top = rotor.read(name)
    top = rotor.Top.from_constants(top.constants, dipole_abc_debye=np.eye(3)[axis])  # no weights: all levels
    lines = rotor.api.line_list(top, jmax=HIGHEST_J, min_lgint=None, q=1.0)
    columns, names = lines.columns, NAMES[top.kind]
    ends = [np.stack([columns[f"{n}_{end}"] for n in names], axis=1).tolist() for end in ("upper", "lower")]
    components = lines.levels.components[lines.upper]
    values = (lines.strength_debye2 / components).tolist()
    return {(tuple(u), tuple(v)): s for u, v, s in zip(*ends, values, strict=True)}


def axis_of(upper: tuple[int, ...], lower: tuple[int, ...], kind: str) -> int:
    """The axis whose dipole component makes a line: by the parities of ΔKa and ΔKc, or the figure axis."""
    if kind != "asymmetric":
        return 2 if kind == "oblate" else 0
    odd = [(u - v) % 2 == 1 for u, v in zip(upper[1:], lower[1:], strict=True)]
    return {(False, True): 0, (True, True): 1, (True, False): 2}[odd[0], odd[1]]


def dipoles(name: str, shared: Path) -> list[tuple[str, float, int, float]]:
    """Component, value in D, number of lines, and the relative spread of a single one, for each axis that has lines."""
    top, tag = rotor.read(name), CATALOGUES[name]
    q = rotor.api.partition_function(top, 300.0).q if name in OWN_Q else q_of_catalogue(shared, tag)
    highest = LIGHT_J if name in LIGHT else HIGHEST_J
    seen = line_strengths(read_catalogue(shared, tag), q, len(NAMES[top.kind]), highest)
    found = []
    for axis in sorted({axis_of(*key, top.kind) for key in seen}):
        ours = unit_strengths(name, axis)
        of_axis = {
            key: value / ours[key] for key, value in seen.items() if axis_of(*key, top.kind) == axis and key in ours
        }
        squares = np.array(list(of_axis.values()))
        if top.kind == "linear":
            mean, left = at_rest(np.array([upper[0] for upper, _ in of_axis]), squares)
        else:
            left = np.sqrt(squares)
            left = left[np.abs(left / np.median(left) - 1) < 0.02]  # others differ in label or mixing
            mean = float(np.mean(left))
        found.append(("abc"[axis], mean, len(left), float(np.std(left) / mean)))
    return found


def at_rest(m: Floats, squares: Floats) -> tuple[float, Floats]:
    """μ0 of a linear molecule from the μ² of its lines, and what every line then says of it."""
    slope, limit = np.polyfit(m.astype(float) ** 2, squares, 1)
    return math.sqrt(limit), np.sqrt(squares - slope * m**2)


def main(shared: Path) -> None:
    with TABLE.open("w", encoding="utf-8", newline="") as file:
        file.write(HEAD + COLUMNS + "\n")
        rows = csv.writer(file, lineterminator="\n")
        for name, tag in CATALOGUES.items():
            for axis, value, lines, spread in dipoles(name, shared):
                rows.writerow([name, axis, f"{value:.5g}", tag, lines, f"{spread:.1e}"])


if __name__ == "__main__":
    main(Path(sys.argv[1]))
