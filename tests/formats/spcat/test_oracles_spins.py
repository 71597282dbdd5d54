"""Spins and several states against the reference program: samples everywhere, its whole files beside the project."""

from __future__ import annotations

import gzip
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from doc_scripts import script
from oracle_cases import (
    COUPLED,
    SAMPLES,
    compare_with_tool,
    coupled_level_disagreements,
    disagreements,
    prediction,
)

from rotor.formats.spcat.compare import compare
from rotor.formats.spcat.text.cat import read_cat, write_cat
from rotor.formats.spcat.text.catalogue import Catalogue
from rotor.formats.spcat.text.egy import read_egy

EQUAL = [case for case in COUPLED if case != "three_states_fermi_coriolis"]


@pytest.mark.parametrize("case", COUPLED)
def test_samples(case):
    reference = read_cat(SAMPLES / case / "sample.cat")
    assert len(reference) >= 60
    assert disagreements(reference, prediction(SAMPLES / case).catalogue) == []


@pytest.mark.parametrize("case", COUPLED)
def test_samples_of_levels(case):
    reference, ours = read_egy(SAMPLES / case / "sample.egy"), prediction(SAMPLES / case)
    assert len(reference) >= 60
    assert coupled_level_disagreements(reference, ours) == []
    reference.energy_cm[30] += 1.1e-6  # negative control
    assert len(coupled_level_disagreements(reference, ours)) == 1


def test_samples_see_a_change():
    """Negative control: a line removed, one shifted by 4e-4 MHz, another intensity by 5e-4, another F."""
    case = SAMPLES / "vinylcl35_quad"
    reference, ours = read_cat(case / "sample.cat"), prediction(case).catalogue
    label = reference.quanta_upper[40], reference.quanta_lower[40]
    same = (ours.quanta_upper == label[0]).all(axis=1) & (ours.quanta_lower == label[1]).all(axis=1)
    assert same.any()
    assert disagreements(reference, ours.take(~same))
    for column, change in (("frequency_mhz", 4e-4), ("lgint", 5e-4)):
        assert disagreements(reference, replace(ours, **{column: getattr(ours, column) + change * same}))
    other = ours.quanta_upper.copy()
    other[same, 3] += 1
    assert disagreements(reference, replace(ours, quanta_upper=other))


@pytest.mark.oracle
@pytest.mark.parametrize("case", EQUAL)
def test_whole_catalogues(case: str, shared: Path, tmp_path: Path):
    path = tmp_path / "ours.cat"
    write_cat(prediction(shared / "reference" / "spcat" / case).catalogue, path)
    equal, words = compare_with_tool(shared, case, path)
    assert equal, words


@pytest.mark.oracle
@pytest.mark.parametrize("case", COUPLED)
def test_whole_lists_of_levels(case: str, shared: Path):
    """Every level with its labels and degeneracy, none that the program does not list."""
    folder = shared / "reference" / "spcat" / case
    reference, ours = read_egy(gzip.decompress((folder / f"{case}.egy.gz").read_bytes())), prediction(folder)
    assert coupled_level_disagreements(reference, ours) == []
    assert len(ours.levels) == len(reference)


def _reference(folder: Path) -> Catalogue:
    return read_cat(gzip.decompress((folder / f"{folder.name}.cat.gz").read_bytes()))


@pytest.mark.oracle
def test_three_states_by_their_doublets(shared: Path):
    """Fermi and two Coriolis couplings leave no symmetry: both components of a K doublet stand in one block there.

    Doublets of N ≥ 7 are closer than the rounding of doubles can part (`test_round_off_lines.py`), here and there, so that single
    lines are those of mixed components; their sums are right. A cut of 1e-12 leaves components out here or there.
    """
    folder = shared / "reference" / "spcat" / "three_states_fermi_coriolis"
    lists = _reference(folder), prediction(folder).catalogue
    assert np.abs(compare(*lists).differences("frequency_mhz")).max() < 1.1e-4  # one digit of print
    reference, ours = (script("make_reference_cases").sums_over_doublets(each) for each in lists)
    assert len(reference) > 20_000
    for label, (total, frequency) in reference.items():
        cut = 1e-12 * (1 + (frequency / 3e5) ** 2)  # STR0 = STR1 = -12; below it a component is not listed
        if total > 5 * cut:
            assert abs(ours[label][0] - total) < 4 * cut + 3e-4 * total, (
                label
            )  # four components at most; digits of LGINT
    alone = read_cat(SAMPLES / folder.name / "sample.cat")
    assert alone.quanta_upper[:, 0].max() == 6  # below that single lines are compared
