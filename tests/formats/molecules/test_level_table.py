"""Levels of a top whose file has a table of energies: the table's where it has the level, the series' elsewhere."""

from __future__ import annotations

import gzip

import numpy as np
import pytest

import rotor
from rotor.formats.spcat.text.cat import read_cat
from rotor.quantum.solve import solve_levels


def test_energies_are_the_table_s_and_elsewhere_the_series_s():
    top = rotor.read("D2O")
    table, levels = top.level_table, solve_levels(top, 14)
    series = solve_levels(top.with_constants(top.constants), 14)
    rows = table.rows_of(levels.quanta)
    known = rows >= 0
    assert known.sum() == (table.quanta["j"] <= 14).sum()
    assert not known.all()
    assert np.array_equal(levels.energy_mhz[known], table.energy_mhz[rows[known]])
    assert np.array_equal(levels.energy_mhz[~known], series.energy_mhz[~known])
    assert np.abs(levels.energy_mhz - series.energy_mhz).max() > 1.0  # the table says something else


def test_blocks_hold_the_energies_of_their_levels():
    levels = solve_levels(rotor.read("HDO"), 10)
    for block in levels.blocks:
        mine = levels.energy_mhz[block.start : block.start + len(block.energies_mhz)]
        assert np.array_equal(block.energies_mhz, mine)


def test_other_constants_leave_the_table_behind():
    top = rotor.read("water")
    assert top.with_constants(top.constants).level_table is None


@pytest.mark.oracle
@pytest.mark.parametrize(("name", "tag", "jmax"), [("D2O", "c020001", 13), ("HDO", "c019002", 10)])
def test_every_measured_line_is_where_it_was_measured(shared, name, tag, jmax):
    """Negative tags of the catalogue; with the constants alone D2O missed one by GHz."""
    folders = (shared / "reference" / folder for folder in ("catalogues", "library_lines"))
    path = next(folder / f"{tag}.cat.gz" for folder in folders if (folder / f"{tag}.cat.gz").is_file())
    catalogue = read_cat(gzip.decompress(path.read_bytes()))
    lines = rotor.api.line_list(rotor.read(name), jmax=jmax, min_lgint=None, q=1.0)
    ends = [
        np.stack([lines.columns[f"{n}_{end}"] for n in ("j", "ka", "kc")], axis=1).tolist()
        for end in ("upper", "lower")
    ]
    ours = {(tuple(u), tuple(v)): f for u, v, f in zip(*ends, lines.frequency_mhz.tolist(), strict=True)}
    compared = 0
    for i in np.flatnonzero(np.asarray(catalogue.tag) < 0).tolist():
        key = tuple(tuple(x[i, :3].tolist()) for x in (catalogue.quanta_upper, catalogue.quanta_lower))
        if max(key[0][0], key[1][0]) <= jmax and key in ours:
            allowed = 0.001 + 3 * float(catalogue.error_mhz[i])  # what the file says of itself
            assert abs(ours[key] - catalogue.frequency_mhz[i]) <= allowed
            compared += 1
    assert compared > 40


@pytest.mark.parametrize("name", ["water", "D2O", "HDO"])
def test_lines_of_a_tabulated_molecule_are_between_tabulated_levels(name):
    top = rotor.read(name)
    lines = rotor.api.line_list(top)
    assert top.level_table is not None
    for states in (lines.upper, lines.lower):
        labels = {label: lines.levels.quanta[label][states] for label in ("j", "ka", "kc")}
        assert (top.level_table.rows_of(labels) >= 0).all()
    assert not any("does not converge" in text for text in lines.warnings)
    assert any("left out" in text for text in lines.warnings) == (lines.untrusted > 0)
    without = top.with_constants(top.constants)  # without the table
    assert any("does not converge" in text for text in rotor.api.line_list(without).warnings)


def test_lines_between_tabulated_levels_have_no_error_of_the_constants():
    lines = rotor.api.line_list("water", jmax=3)
    assert lines.error_mhz is None
    assert lines.errors_from == "none: the energies are from a table"
    assert rotor.api.line_list("SO2", jmax=3).errors_from.startswith("covariance of A, B, C")
