"""Lines of acetaldehyde in JPL's catalogue: labels, and a fit that starts from published constants."""

import gzip

import numpy as np
import pytest

import rotor
from rotor.fitting.assignment import assignments
from rotor.fitting.fit import fit_lines
from rotor.fitting.parameters import parameters
from rotor.fitting.search import FitOptions
from rotor.fitting.top_constants import TopConstants
from rotor.tops.internal_rotation import InternalRotationConstants

CM = rotor.units.MHZ_PER_CM
NAMES = ("j", "ka", "kc", "species", "vt")

# Astron. Astrophys. 579 (2015) A46, table 1, cm-1; terms of higher order start from 0
PUBLISHED = {"F": 7.56708175, "V3": 407.59768, "V6": -11.63964, "Dab": 0.122669037}
ROTATION = {"A": 1.884881309, "B": 0.348706489, "C": 0.3031840478}
FIRST = [
    "A",
    "B",
    "C",
    "Dab",
    "rho",
    "V3",
    "DeltaJ",
    "DeltaJK",
    "DeltaK",
    "deltaJ",
    "deltaK",
    "rhoJ",
    "rhoK",
    "rhobc",
    "V3J",
    "V3K",
    "V3bc",
]
QUARTIC = ["FK", "FJ", "Fbc", "V3ab", "rhoab"]
SEXTIC = [
    "PhiJ",
    "PhiJK",
    "PhiKJ",
    "PhiK",
    "phiJ",
    "phiJK",
    "phiK",
    "J2Jz3p1",
    "Jz5p1",
    "J4Jz1p1",
    "J2Jz1Jpm2p1",
    "Jz3Jpm2p1",
]
TORSIONAL = ["J4cos3", "J2Jz2cos3", "Jz4cos3", "J2Jpm2cos3", "Jz2Jpm2cos3", "Jz4p2", "J2Jz2p2"]
STEPS = (
    (6, FIRST),
    (8, FIRST),
    (10, FIRST + QUARTIC),
    (12, FIRST + QUARTIC + SEXTIC[:7]),
    (16, FIRST + QUARTIC + SEXTIC),
)


def catalogue(path, jmax):
    """Lines of v_t = 0 with J ≤ jmax: of JPL's quanta J Ka Kc v, v = 0 is A, 1 and 2 are E with Ka + Kc = J + 1 and J."""
    upper, lower, numbers = [], [], []
    with gzip.open(path, "rt") as rows:
        for row in rows:
            if len(row) < 75:
                continue
            labels = [tuple(int(row[place + 2 * i : place + 2 * i + 2]) for i in range(4)) for place in (55, 67)]
            if max(label[3] for label in labels) < 3 and max(label[0] for label in labels) <= jmax:
                for label, side in zip(labels, (upper, lower), strict=True):
                    assert label[3] in (0, 1 + (label[1] + label[2] == label[0]))
                    side.append((*label[:3], int(label[3] > 0), 0))
                numbers.append((float(row[:13]), max(float(row[13:21]), 0.005)))
    return assignments(NAMES, upper, lower, *np.array(numbers).T)


@pytest.mark.oracle
@pytest.mark.slow
def test_lines_of_the_ground_torsional_state_have_their_labels_and_frequencies(shared):
    path = shared / "reference" / "internal_rotation" / "c044003.cat.gz"
    values = {name: value * CM for name, value in PUBLISHED.items()} | {"rho": 0.328632673}
    constants = rotor.Constants(**{n: value * CM for n, value in ROTATION.items()}, reduction="A", representation="Ir")
    top = rotor.Top.from_constants(constants, internal_rotation=InternalRotationConstants(values, "RAM", vt_max=0))
    start = TopConstants(top)
    for jmax, free in (*STEPS, (20, FIRST + QUARTIC + SEXTIC + TORSIONAL)):
        lines = catalogue(path, jmax)
        start = start.replace(**{name: 0.0 for name in free if name not in start})
        fit = fit_lines(lines, start, parameters(start, free), FitOptions(most_iterations=12))
        start = fit.constants
    missed = np.abs(fit.difference_mhz)
    assert len(lines) > 4000
    assert (missed < 50.0).mean() > 0.999  # another label is off by GHz
    assert (missed < 3 * lines.error_mhz).mean() > 0.95  # as far as the catalogue itself states them
    assert fit.weighted_rms < 1.0
