"""Lines of acetaldehyde in JPL's catalogue, v_t = 0 and 1: labels, and a fit that starts from published constants."""

import gzip

import numpy as np
import pytest
from places import ORACLES

import rotor
from rotor.fitting.assignment import assignments
from rotor.fitting.fit import fit_lines
from rotor.fitting.parameters import parameters
from rotor.fitting.search.residuals import FitOptions
from rotor.fitting.top_constants import TopConstants
from rotor.tops.internal_rotation import InternalRotationConstants

CM = rotor.units.MHZ_PER_CM
NAMES = ("j", "ka", "kc", "species", "vt")

# Astron. Astrophys. 579 (2015) A46, table 1, cm-1; terms of higher order start from 0: the stored text of the table has lost some signs
PUBLISHED = {"F": 7.56708175, "V3": 407.59768, "V6": -11.63964, "Dab": 0.122669037}
ROTATION = {"A": 1.884881309, "B": 0.348706489, "C": 0.3031840478}


def names(text):
    return text.split()


SECOND = names("A B C Dab rho V3")
FOURTH = names(
    "V6 Fm rhom V3J V3K V3bc V3ab FJ FK Fbc Fab D3ac D3bc rhoJ rhoK rhobc rhoab DeltaJ DeltaJK DeltaK deltaJ deltaK"
)
# of sixth order; v_t = 1 is described by nothing less than p⁶ and Pa p⁵ to within 0.4 MHz
TORSION = names("p6 Jz1p5 J2p4 Jz2p4 Jpm2p4 Jz1Jpm1p4 J2Jz1p3 Jz3p3 Jz1Jpm2p3")
SIXTH = names(
    "J2cos6 Jz2cos6 Jpm2cos6 Jz1Jpm1cos6 V9 J4p2 J2Jz2p2 Jz4p2 J2Jpm2p2 Jz2Jpm2p2 J2Jz1Jpm1p2 Jz3Jpm1p2 J4Jz1p1 J2Jz3p1 Jz5p1 "
    "J2Jz1Jpm2p1 Jz3Jpm2p1 J4cos3 J2Jz2cos3 Jz4cos3 J2Jpm2cos3 Jz2Jpm2cos3 J2Jz1Jpm1cos3 Jz3Jpm1cos3 Jpm4cos3 PhiJ PhiJK PhiKJ PhiK "
    "phiJ phiJK phiK"
)
EIGHTH = names("p8 Jz1p7 Jz2p6 Jz3p5 Jz4p4 Jz5p3 Jz6p2 Jz7p1")
MIXED = names(
    "J2p6 Jpm2p6 Jz1Jpm1p6 J2Jz1p5 Jz1Jpm2p5 J4p4 J2Jz2p4 J2Jpm2p4 J2Jz1Jpm1p4 J2Jz3p3 J4Jz1p3 J2Jz1Jpm2p3"
)  # of sixth and eighth order, rotation and torsion: low K of v_t = 1, E
STEPS = (
    (6, SECOND + FOURTH),
    (6, SECOND + FOURTH + TORSION),
    *((jmax, SECOND + FOURTH + TORSION + SIXTH) for jmax in (8, 12, 16)),
    *((jmax, SECOND + FOURTH + TORSION + SIXTH + EIGHTH) for jmax in (18, 20)),
    (20, SECOND + FOURTH + TORSION + SIXTH + EIGHTH + MIXED),
)


def catalogue(path, jmax):
    """Lines of v_t ≤ 1 with J ≤ jmax: of JPL's quanta J Ka Kc v, v = 3 v_t is A, 3 v_t + 1 and + 2 are E with Ka + Kc = J + 1 and J."""
    upper, lower, numbers = [], [], []
    with gzip.open(path, "rt") as rows:
        for row in rows:
            if len(row) < 75:
                continue
            labels = [tuple(int(row[place + 2 * i : place + 2 * i + 2]) for i in range(4)) for place in (55, 67)]
            if max(label[3] for label in labels) < 6 and max(label[0] for label in labels) <= jmax:
                for label, side in zip(labels, (upper, lower), strict=True):
                    assert label[3] % 3 in (0, 1 + (label[1] + label[2] == label[0]))
                    side.append((*label[:3], int(label[3] % 3 > 0), label[3] // 3))
                numbers.append((float(row[:13]), float(row[13:21])))
    return upper, lower, *np.array(numbers).T


def crosses(labels):
    """Whether E levels of v_t = 1 have K ≥ 14: v_t = 2, K = 12 crosses them, and lines of v_t = 0 and 1 do not determine where."""
    columns = np.array(labels)
    return (columns[:, 3] == 1) & (columns[:, 4] == 1) & (columns[:, 1] >= 14)


def test_constants_of_the_fit_give_lines_of_the_catalogue_with_its_labels():
    levels = rotor.api.solve_levels(rotor.read(ORACLES / "ch3cho_ram.toml"), 20)
    energies = {
        (j, ka, kc, int(species == "E"), vt): energy
        for species, vt, j, ka, kc, energy in zip(
            *(levels.quanta[name].tolist() for name in ("species", "vt", "j", "ka", "kc")),
            levels.energy_mhz.tolist(),
            strict=True,
        )
    }
    rows = np.loadtxt(ORACLES / "ch3cho.txt")
    computed = [energies[tuple(row[:5])] - energies[tuple(row[5:])] for row in rows[:, :10].astype(int).tolist()]
    missed = np.abs(np.array(computed) - rows[:, 10])
    between = rows[:, 4] != rows[:, 9]  # two lines that a resonance of v_t = 0, K = 10 with v_t = 1, K = 3 allows
    assert between.sum() == 2
    assert missed[between].max() < 3 * rows[between, 11].min()
    assert (missed < 3 * rows[:, 11]).mean() > 0.95
    assert missed.max() < 50.0  # another label is off by GHz


@pytest.mark.oracle
@pytest.mark.slow(seconds=147)
def test_lines_of_two_torsional_states_have_their_labels_and_frequencies(shared):
    path = shared / "reference" / "internal_rotation" / "c044003.cat.gz"
    values = {name: value * CM for name, value in PUBLISHED.items()} | {"rho": 0.328632673}
    constants = rotor.Constants(**{n: value * CM for n, value in ROTATION.items()}, reduction="A", representation="Ir")
    top = rotor.Top.from_constants(constants, internal_rotation=InternalRotationConstants(values, "RAM"))
    start = TopConstants(top)
    for jmax, free in STEPS:
        upper, lower, frequency, error = catalogue(path, jmax)
        left_out = crosses(upper) | crosses(lower)  # of the fit; they count in the shares below
        lines = assignments(NAMES, upper, lower, frequency, np.where(left_out, 1e4, np.maximum(error, 0.005)))
        start = start.replace(**{name: 0.0 for name in free if name not in start})
        fit = fit_lines(lines, start, parameters(start, free), FitOptions(most_iterations=25, poor_rms=100))
        start = fit.constants
    missed = np.abs(fit.difference_mhz)
    assert len(lines) == 8587
    assert (missed < 50.0).mean() > 0.999  # another label is off by GHz
    assert left_out.sum() == 46
    assert (missed < 2 * error).mean() > 0.95  # as far as the catalogue itself states them
    for vt in (0, 1):
        here = lines.upper[:, 4] == vt
        assert (missed < 3 * error)[here].mean() > (0.99, 0.95)[vt]
