"""Streamed lists: the same lines as in memory, whatever the pieces; killed and taken up again; distinguished from other lists."""

from __future__ import annotations

import json
import multiprocessing
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from places import PROJECT

import rotor
from rotor.formats.lines.streamed_lines import stream_lines
from rotor.formats.spcat.text.cat import read_cat
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top

PROPANEDIOL = Top.from_constants("A=8572 B=3640 C=2790 MHz", dipole_abc_debye=(1.2, 1.9, 0.4))
KILLED = """
import rotor
top = rotor.Top.from_constants("A=8572 B=3640 C=2790 MHz", dipole_abc_debye=(1.2, 1.9, 0.4))
rotor.api.stream_lines(top, {path!r}, jmax=45, min_lgint=None, q=1e5, piece_lines=3000)
"""


def in_order(table: pl.DataFrame) -> pl.DataFrame:
    quanta = [name for name in table.columns if name[:2] in ("j_", "k_", "ka", "kc")]
    return table.sort(quanta)


def unlike(streamed: pl.DataFrame, whole: pl.DataFrame) -> list[str]:
    """Columns that differ beyond round-off: energies above the ground level are added in two steps there, in one here."""
    if streamed.columns != whole.columns or not (streamed["frequency_mhz"].diff().drop_nulls() >= 0).all():
        return ["columns or order of frequencies"]
    a, b = in_order(streamed), in_order(whole)
    different = []
    for name in a.columns:
        known = b[name].to_numpy()
        known = np.where(np.isinf(known), np.nan, known)  # no logarithm of zero strength: an empty field of a file
        if len(a) != len(b) or not np.allclose(a[name].to_numpy(), known, rtol=1e-12, atol=1e-10, equal_nan=True):
            different.append(name)
    return different


@pytest.mark.parametrize("piece_lines", [1, 4000, 10**9])
@pytest.mark.parametrize("cut", [None, -9.0])
def test_pieces_of_any_size_make_the_same_list(tmp_path, piece_lines, cut):
    stream = stream_lines(PROPANEDIOL, tmp_path / "a.parquet", jmax=24, min_lgint=cut, q=1e5, piece_lines=piece_lines)
    whole = rotor.api.line_list(PROPANEDIOL, jmax=24, min_lgint=cut, q=1e5)
    assert unlike(pl.read_parquet(tmp_path / "a.parquet"), whole.to_polars()) == []
    assert stream.lines == len(whole)
    assert stream.pieces_computed == {1: 22, 4000: stream.pieces_computed, 10**9: 1}[piece_lines]
    assert [p.name for p in tmp_path.iterdir()] == ["a.parquet"]  # nothing is left behind


@pytest.mark.parametrize(
    ("constants", "dipole", "weights"),
    [
        (Constants(B=6081.49), (0.7, 0, 0), None),
        (Constants(A=158e3, B=9198.9), (3.9, 0, 0), {"0": 2, "1": 1, "2": 1}),
        (Constants(A=835840.0, B=435351.0, C=278138.0), (0, 1.85, 0), {"ee": 1, "eo": 3, "oe": 3, "oo": 1}),
        (Constants(A=60778.0, B=10318.0, C=8799.0), (0, 1.6, 0), {"ee": 0, "eo": 1, "oe": 1, "oo": 0}),  # no J = 0
    ],
)
def test_every_kind_of_top(tmp_path, constants, dipole, weights):
    top = Top.from_constants(constants, dipole_abc_debye=dipole, spin_weights=weights)
    stream_lines(top, tmp_path / "a.parquet", jmax=15, range_mhz=(1e4, 9e5), piece_lines=500)
    assert (
        unlike(
            pl.read_parquet(tmp_path / "a.parquet"), rotor.api.line_list(top, jmax=15, range_mhz=(1e4, 9e5)).to_polars()
        )
        == []
    )


def test_errors_of_frequencies_go_along(tmp_path):
    top = Top.from_constants("A=8572.0(1) B=3640.0(2) C=2790.0(1) MHz", dipole_abc_debye=(1.2, 1.9, 0.4))
    whole = rotor.api.line_list(top, jmax=12, q=1e5)
    stream_lines(top, tmp_path / "a.parquet", jmax=12, q=1e5, piece_lines=500)
    assert unlike(pl.read_parquet(tmp_path / "a.parquet"), whole.to_polars()) == []
    assert whole.error_mhz.max() > 1
    stream_lines(top, tmp_path / "a.cat", jmax=12, q=1e5, piece_lines=500)
    errors = np.sort(read_cat(tmp_path / "a.cat").error_mhz)
    np.testing.assert_allclose(errors, np.sort(whole.error_mhz), atol=5.1e-5)  # four decimals


def test_a_catalogue_is_that_of_the_list_in_memory(tmp_path):
    stream_lines(PROPANEDIOL, tmp_path / "a.cat", jmax=20, min_lgint=-12, tag=76001, piece_lines=4000)
    rotor.write(rotor.api.line_list(PROPANEDIOL, jmax=20, min_lgint=-12), tmp_path / "b.cat", settings={"tag": 76001})
    ours, theirs = ((tmp_path / name).read_text().splitlines() for name in ("a.cat", "b.cat"))
    assert sorted(ours) == sorted(theirs)
    assert (np.diff(read_cat(tmp_path / "a.cat").frequency_mhz) >= 0).all()
    provenance = json.loads((tmp_path / "a.cat.provenance.json").read_text())
    assert (provenance["lines"], provenance["jmax"], provenance["temperature_k"]) == (len(ours), 20, 300.0)


def test_j_max_and_q_are_found_as_in_memory(tmp_path):
    top = Top.from_constants("B=57635.968 D=0.1835 MHz", dipole_abc_debye=(0.11, 0, 0))
    stream = stream_lines(top, tmp_path / "co.parquet")
    whole = rotor.api.line_list(top)
    assert (stream.jmax, stream.lines, stream.q) == (whole.jmax, len(whole), whole.q)
    metadata = json.loads(pl.read_parquet_metadata(tmp_path / "co.parquet")["provenance"])
    assert metadata["q"] == whole.q


def test_a_killed_run_goes_on(tmp_path):
    """The process is killed between pieces; what it left is used, the rest is made, the list is whole."""
    path = tmp_path / "a.parquet"
    process = subprocess.Popen([sys.executable, "-c", KILLED.format(path=str(path))], cwd=PROJECT)
    pieces, limit = tmp_path / "a.parquet.pieces", time.monotonic() + 60
    while len(list(pieces.glob("j*.parquet"))) < 3:
        assert time.monotonic() < limit, "no piece was written within a minute"
        assert process.poll() is None, "the run ended before it was killed"
        time.sleep(0.002)
    process.kill()
    process.wait()
    assert not path.exists()
    left = {p: p.stat().st_mtime_ns for p in pieces.glob("j*.parquet")}

    stream = stream_lines(PROPANEDIOL, path, jmax=45, min_lgint=None, q=1e5, piece_lines=3000)
    assert stream.pieces_reused == len(left) >= 3
    assert stream.pieces_computed > 0
    assert (
        unlike(pl.read_parquet(path), rotor.api.line_list(PROPANEDIOL, jmax=45, min_lgint=None, q=1e5).to_polars())
        == []
    )
    assert not pieces.exists()


def interrupted(path: Path, **settings: object) -> None:
    """A run that fails in its fourth piece."""

    class Failing(ThreadPoolExecutor):
        def map(self, work, *jobs):
            for i, job in enumerate(zip(*jobs, strict=True)):
                if i == 3:
                    raise KeyboardInterrupt
                yield work(*job)

    with pytest.raises(KeyboardInterrupt), Failing(1) as pool:
        stream_lines(PROPANEDIOL, path, q=1e5, piece_lines=1000, executor=pool, **settings)


def test_pieces_of_another_list_are_refused(tmp_path):
    path = tmp_path / "a.parquet"
    interrupted(path, jmax=15)
    with pytest.raises(ValueError, match=r"pieces of another list \(temperature_k was 300\.0, is 100\.0\)"):
        stream_lines(PROPANEDIOL, path, jmax=15, q=1e5, piece_lines=1000, temperature_k=100.0)
    (tmp_path / "a.parquet.pieces" / "manifest.json").write_text("{}")
    with pytest.raises(ValueError, match="not a manifest of pieces"):
        stream_lines(PROPANEDIOL, path, jmax=15, q=1e5, piece_lines=1000)


def test_pieces_are_used_not_made_anew(tmp_path):
    """Negative control: a piece emptied behind the run's back is missing in the list."""
    path = tmp_path / "a.parquet"
    interrupted(path, jmax=15)
    piece = sorted((tmp_path / "a.parquet.pieces").glob("j*.parquet"))[1]
    lost = len(pl.read_parquet(piece))
    pl.read_parquet(piece).clear().write_parquet(piece)
    stream = stream_lines(PROPANEDIOL, path, jmax=15, q=1e5, piece_lines=1000)
    assert stream.lines == len(rotor.api.line_list(PROPANEDIOL, jmax=15, q=1e5)) - lost
    assert lost > 0


def test_pieces_spread_over_processes(tmp_path):
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        stream_lines(PROPANEDIOL, tmp_path / "a.parquet", jmax=20, q=1e5, piece_lines=4000, executor=pool)
    assert (
        unlike(pl.read_parquet(tmp_path / "a.parquet"), rotor.api.line_list(PROPANEDIOL, jmax=20, q=1e5).to_polars())
        == []
    )


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="this system does not fork")
def test_a_pool_that_forks_is_refused(tmp_path):
    pool = ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("fork"))
    with pytest.raises(ValueError, match="forks its processes"):
        stream_lines(PROPANEDIOL, tmp_path / "a.parquet", jmax=5, executor=pool)


@pytest.mark.parametrize(
    ("path", "settings", "words"),
    [
        ("a.json", {}, r"streamed list is written as \.parquet, \.csv or \.cat"),
        ("a.cat", {"jmax": 0}, "J max = 0"),
        ("a.cat", {"piece_lines": 0}, "piece_lines = 0"),
        ("a.cat", {"memory_mb": 5}, "memory_mb = 5"),
        ("a.cat", {"temperature_k": -1.0}, "temperature_k: -1"),
    ],
)
def test_what_cannot_be_streamed_is_refused(tmp_path, path, settings, words):
    with pytest.raises(ValueError, match=words):
        stream_lines(PROPANEDIOL, tmp_path / path, **{"jmax": 5, **settings})
    assert list(tmp_path.iterdir()) == []


def test_levels_that_fall_below_the_ground_leave_the_pieces_of_high_j(tmp_path):
    """Beyond the reach of its distortion constants water's levels fall far below the ground; the list is that of the memory."""
    water = replace(rotor.read("water"), level_table=None)
    stream_lines(water, tmp_path / "a.parquet", jmax=60, piece_lines=20_000)
    streamed, whole = pl.read_parquet(tmp_path / "a.parquet"), rotor.api.line_list(water, jmax=60).to_polars()
    assert unlike(streamed, whole) == []


def test_a_piece_without_a_trusted_level_is_empty(tmp_path):
    stream_lines(replace(rotor.read("water"), level_table=None), tmp_path / "a.csv", jmax=70, piece_lines=20_000)
    assert len(pl.read_csv(tmp_path / "a.csv")) > 1000


def test_a_list_of_days_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"J max 1000000: about 2e\+18 transitions before the cut, more than 1e\+11"):
        stream_lines(PROPANEDIOL, tmp_path / "a.csv", jmax=1_000_000)
    assert list(tmp_path.iterdir()) == []
