"""Write isotopes.csv from tables of nuclear data: python data/make_isotopes.py FOLDER.

FOLDER holds isotopes_data.csv (masses of AME2020, abundances in percent, spins, g factors, half-lives) and
elec_mom_recomm.csv (IAEA's recommended electric quadrupole moments).

Kept are the isotopes that occur in nature, those that live for 9 minutes or longer (so 14C, tritium and the tracers
11C, 13N and 18F are in), and of every element the one that lives longest.
"""

import csv
import re
import sys
from pathlib import Path

SHORTEST_HALF_LIFE_S = 540.0

# Quadrupole moments in barn that IAEA's file does not list: P. Pyykkö, Mol. Phys. 116, 1328 (2018) for 2H, 14N, 17O
# and 81Br; Mol. Phys. 106, 1965 (2008) for the others.
QUADRUPOLE_BARN = {
    ("H", 2): 0.00285783,
    ("N", 14): 0.02044,
    ("O", 17): -0.02558,
    ("Ne", 21): 0.10155,
    ("Br", 81): 0.2579,
    ("In", 113): 0.759,
    ("In", 115): 0.770,
    ("Lu", 176): 4.97,
    ("Hg", 201): 0.387,
}

# The table says 8.84 %, with which tellurium sums to 90 %; IUPAC (Pure Appl. Chem. 88, 293 (2016)) says 18.84 %.
ABUNDANCE_PERCENT = {("Te", 126): 18.84}

HEADER = """\
# Isotopes: mass in u, abundance as a fraction of 1, half-life in s (inf: stable), spin, g factor (mu = g I mu_N),
# quadrupole moment in barn.
# Written by make_isotopes.py, which says what is kept; an empty cell is a value that the sources do not give.
# Masses: AME2020, M. Wang, W. J. Huang, F. G. Kondev, G. Audi, S. Naimi, Chin. Phys. C 45, 030003 (2021).
# Abundances, half-lives, spins: NUBASE2020, F. G. Kondev et al., Chin. Phys. C 45, 030001 (2021); abundance of 126Te:
# J. Meija et al., Pure Appl. Chem. 88, 293 (2016).
# Quadrupole moments: IAEA Nuclear Data Section, N. J. Stone, INDC(NDS)-0833 (2021); 2H, 14N, 17O, 81Br: P. Pyykko,
# Mol. Phys. 116, 1328 (2018); 21Ne, 113In, 115In, 176Lu, 201Hg: P. Pyykko, Mol. Phys. 106, 1965 (2008).
"""
COLUMNS = "symbol,element_number,mass_number,mass_u,abundance,half_life_s,spin,g_factor,quadrupole_barn"


def read_quadrupoles(path):
    """Ground-state quadrupole moments in barn by (symbol, mass number); values of uncertain sign keep their size."""
    moments = {}
    with path.open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            text = row["electric quadrupole [b]"]
            if row["energy [keV]"] == "0" and " or " not in text:
                sign = -1 if "-" in text.split(".")[0] else 1
                digits = re.search(r"\d+\.?\d*", text)
                moments[row["symbol"], int(row["n.n+n.z"])] = sign * float(digits[0])
    return moments


def half_life_s(row):
    """Half-life in seconds; 0 where the table gives none."""
    return float(row["half_life [s]"] or 0)


def kept(rows):
    """The rows that occur in nature or live long, and the longest-lived of every element."""
    longest = {}
    for row in rows:
        best = longest.setdefault(row["symbol"], row)
        if half_life_s(row) > half_life_s(best):
            longest[row["symbol"]] = row

    def is_kept(row):
        natural = float(row["abundance"] or 0) > 0
        return natural or half_life_s(row) >= SHORTEST_HALF_LIFE_S or longest[row["symbol"]] is row

    return [row for row in rows if int(row["atomic_number"]) > 0 and is_kept(row)]


def line_of(row, moments):
    """One line of the file; a quadrupole moment vanishes for a spin below 1."""
    key = row["symbol"], int(row["mass_number"])
    abundance = ABUNDANCE_PERCENT.get(key, float(row["abundance"] or 0)) / 100
    spin = float(row["spin"])
    quadrupole = 0.0 if spin < 1 else moments.get(key, QUADRUPOLE_BARN.get(key, row["quadrupole_moment [b]"]))
    g_factor = f"{float(row['gfactor']):.9g}" if row["gfactor"] else ""
    mass = f"{key[0]},{row['atomic_number']},{key[1]},{row['mass [u]']}"
    return f"{mass},{abundance:.8g},{half_life_s(row):.4g},{spin:g},{g_factor},{quadrupole}"


def main(folder):
    """Read both tables in `folder` and write isotopes.csv beside this script."""
    with (folder / "isotopes_data.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    moments = read_quadrupoles(folder / "elec_mom_recomm.csv")
    text = HEADER + "\n".join([COLUMNS, *(line_of(row, moments) for row in kept(rows))]) + "\n"
    Path(__file__).with_name("isotopes.csv").write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python make_isotopes.py FOLDER (with isotopes_data.csv and elec_mom_recomm.csv)")
    main(Path(sys.argv[1]))
