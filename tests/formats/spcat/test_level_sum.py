"""Partition functions summed over the levels of a catalogue's lines: closed forms and the tables of JPL and CDMS."""

import math

import numpy as np
import pytest
from places import SHARED

from rotor import units
from rotor.formats.catalogue.level_sum import catalogue_levels, partition_from_lines
from rotor.formats.spcat.text.cat import read_cat
from rotor.formats.spcat.text.catalogue import predicted_catalogue
from rotor.formats.spcat.text.fields import BLANK

REFERENCE = SHARED / "reference"
CDMS_K = (1000, 500, 300, 225, 150, 75, 37.5, 18.75, 9.375, 5.0, 2.725)
JPL_K = (300, 225, 150, 75, 37.5, 18.75, 9.375)


def catalogue_of_levels(pairs, qnfmt, quanta):
    """A catalogue from (frequency, lower energy in MHz, g of the upper level) and the quantum numbers of both levels."""
    frequency, lower, g = np.array(pairs, dtype=float).T
    numbers = {
        "frequency_mhz": frequency, "lgint": np.full(len(g), -5.0), "energy_lower_cm": lower / units.MHZ_PER_CM, "g_upper": g,
    }  # fmt: skip
    table = np.full((2, len(g), 6), BLANK, dtype=np.int16)
    for i, sides in enumerate(quanta):
        for side in (0, 1):
            table[side, i, : len(sides[side])] = sides[side]
    return predicted_catalogue(numbers, table[0], table[1], qnfmt)


def test_a_ladder_of_a_linear_molecule():
    b = 10e3
    lines = [(2 * b * j, b * j * (j - 1), 2 * j + 1) for j in range(1, 60)]
    table = partition_from_lines(catalogue_of_levels(lines, 101, [((j,), (j - 1,)) for j in range(1, 60)]))
    for kelvin in (2.725, 18.75, 75.0):
        exact = sum((2 * j + 1) * math.exp(-b * j * (j + 1) / units.MHZ_PER_K / kelvin) for j in range(60))
        assert table.at(kelvin) == pytest.approx(exact, rel=1e-8)  # energies go through cm⁻¹
    assert "60 levels" in table.source


def test_weights_of_spins_and_half_integers():
    """Two lines of a spin-3/2 nucleus, F = 5/2 - 3/2 and 3/2 - 3/2, and one with a spin weight of 3 whose last number is v."""
    energy, weight = catalogue_levels(
        catalogue_of_levels([(100.0, 0.0, 6), (90.0, 0.0, 4)], 112, [((1, 3), (0, 2)), ((1, 2), (0, 2))])
    )
    assert sorted(weight.tolist()) == [4.0, 4.0, 6.0]  # 2F+1 of 3/2, 3/2, 5/2
    assert energy.max() == pytest.approx(100.0 / units.MHZ_PER_K, rel=1e-12)
    _, weight = catalogue_levels(catalogue_of_levels([(50.0, 10.0, 15)], 1404, [((2, 1, 2, 1), (1, 0, 1, 1))]))
    assert sorted(weight.tolist()) == [9.0, 15.0]  # the spin weight 3 of the upper level is that of the lower


def test_a_level_counts_once_with_the_weight_of_its_line():
    twice = read_cat(
        b"  115271.2018  0.0005 -5.0105 2    0.0000  3 -28503 101 1           0\n"
        b"  230538.0000  0.0005 -4.1197 2    3.8450  5 -28503 101 2           1\n"
    )
    assert sorted(catalogue_levels(twice)[1].tolist()) == [1.0, 3.0, 5.0]


def published() -> dict[int, dict[float, float]]:
    """log10 Q of JPL and CDMS by tag and temperature."""
    tables: dict[int, dict[float, float]] = {}
    for line in (REFERENCE / "partition" / "jpl_catdir.cat").read_text().splitlines():
        values = [line[26 + 7 * i : 33 + 7 * i] for i in range(7)]
        tables[int(line[:6])] = dict(zip(JPL_K, map(float, values), strict=True))
    for line in (REFERENCE / "partition" / "cdms_partfunc.cat").read_text().splitlines():
        words = [word.strip() for word in line.strip().strip("|").split("|")]
        if words[0].isdecimal():
            tables[int(words[0])] = dict(zip(CDMS_K, map(float, words[3:]), strict=True))
    return tables


@pytest.mark.skipif(
    not (REFERENCE / "partition").is_dir(), reason="the tables of JPL and CDMS are not beside this checkout"
)
def test_published_partition_functions():
    tables, off = published(), {}
    for path in sorted((REFERENCE / "catalogues").glob("*.cat.gz")):
        catalogue = read_cat(path)
        q, known = partition_from_lines(catalogue), tables[abs(int(catalogue.tag[0]))]
        off[path.name[1:7]] = {t: q.at(t) / 10 ** known[t] - 1 for t in known if t <= 300 and not math.isnan(known[t])}
    assert len(off) >= 37
    at_300 = {tag: abs(each[300]) for tag, each in off.items()}
    assert (
        sum(value < 2.5e-4 for value in at_300.values()) == 29
    )  # tables have four decimals of log10 Q: 1.2e-4, and rounding of ours
    incomplete = {tag for tag, value in at_300.items() if value > 5e-3}  # vibrational states count in the tables
    assert incomplete == {"027501", "040502", "041001", "050007", "064502"}
    cold = [abs(value) for tag, each in off.items() for t, value in each.items() if t <= 37.5 and tag != "050007"]
    assert max(cold) < 4e-4  # as above; CH3Cl has two states
