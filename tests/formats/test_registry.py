"""Formats: each registered once, found by suffix, type and content; tables say what they are and where they are from."""

from __future__ import annotations

import csv
import gzip
import importlib
import inspect
import json
import pkgutil
import subprocess
import sys
from typing import ClassVar

import duckdb
import numpy as np
import polars as pl
import pytest

import rotor
from rotor.formats import packed, tables
from rotor.formats.lines.line_tables import as_printed
from rotor.formats.provenance import provenance_record
from rotor.formats.registry import FORMATS, loaded, suffixes_for
from rotor.formats.spcat.file_quanta import Format
from rotor.formats.spcat.text.catalogue import Catalogue
from rotor.formats.spcat.text.egy import LevelList
from rotor.formats.spcat.text.fields import BLANK
from rotor.formats.spcat.text.lin import LineList
from rotor.table import Table

PROPANEDIOL = rotor.Top.from_constants("A=8572 B=3640 C=2790 MHz", dipole_abc_debye=(1.2, 1.9, 0.4))


class Numbers(Table):
    """A table of what a file can hold: long and short numbers, texts with commas, truth, and what is no number."""

    columns: ClassVar = {
        "x": np.array([0.1, 1e-300, 123456789.123456789, 1e22, np.nan, -np.inf]),
        "n": np.array([1, -2, 3, 4, 5, 6], dtype=np.int16),
        "text": np.array(["a", 'b,"c"', "", "d e", "ü", "NULL"]),
        "yes": np.array([True, False, True, True, False, False]),
    }


def all_tables() -> list[type[Table]]:
    for module in pkgutil.walk_packages(rotor.__path__, "rotor."):
        if not module.name.endswith(("__main__", "_kernels")):
            importlib.import_module(module.name)
    results: list[type[Table]] = []
    waiting = [Table]
    while waiting:
        below = waiting.pop().__subclasses__()
        waiting += below
        results += [cls for cls in below if cls.__module__.startswith("rotor.") and not inspect.isabstract(cls)]
    return results


def test_every_name_in_the_registry_exists():
    for form in FORMATS:
        for name in filter(None, (form.reader, form.recognises, *form.writers, *form.writers.values())):
            assert loaded(name) is not None


def test_every_table_can_be_written_and_says_where_it_is_from():
    for cls in all_tables():
        assert {".csv", ".parquet", ".json"} <= {*suffixes_for(cls)}, cls
        assert not hasattr(cls.__repr__, "__wrapped__"), f"{cls}: dataclass(repr=False), or its text is all its numbers"


def test_no_suffix_and_type_have_two_writers():
    claims = [(suffix, kind) for form in FORMATS for suffix in form.suffixes for kind in form.writers]
    assert len(claims) == len(set(claims))


def test_short_and_long_tables_become_the_same_characters(tmp_path, monkeypatch):
    rotor.write(Numbers(), tmp_path / "short.csv")
    monkeypatch.setattr(tables, "LONG_TABLE", 0)
    rotor.write(Numbers(), tmp_path / "long.csv")
    texts = [(tmp_path / name).read_text(encoding="utf-8") for name in ("short.csv", "long.csv")]
    short, long = (list(csv.DictReader(text.splitlines())) for text in texts)
    assert short == long
    assert [row["x"] for row in short] == ["0.1", "1e-300", "123456789.12345679", "1e+22", "", ""]
    assert [row["yes"] for row in short] == ["true", "false", "true", "true", "false", "false"]
    assert [row["text"] for row in short] == ["a", 'b,"c"', "", "d e", "ü", "NULL"]


def test_a_long_list_of_lines_is_the_same_csv_by_both_ways(tmp_path, monkeypatch):
    lines = rotor.api.line_list(PROPANEDIOL, jmax=20, q=1e5)
    monkeypatch.setattr(tables, "LONG_TABLE", len(lines) + 1)
    rotor.write(lines, tmp_path / "a.csv")
    monkeypatch.setattr(tables, "LONG_TABLE", 0)
    rotor.write(lines, tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


def test_parquet_and_json_hold_what_the_table_has(tmp_path):
    rotor.write(Numbers(), tmp_path / "a.parquet", settings={"note": "it's"})
    rotor.write(Numbers(), tmp_path / "a.json", settings={"note": "it's"})
    content = json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))
    with duckdb.connect() as engine:
        rows = engine.execute(f"SELECT * FROM '{tmp_path / 'a.parquet'}'").fetchall()
        types = [
            str(column[1]) for column in engine.execute(f"DESCRIBE SELECT * FROM '{tmp_path / 'a.parquet'}'").fetchall()
        ]
        (inside,) = engine.execute(f"SELECT value FROM parquet_kv_metadata('{tmp_path / 'a.parquet'}')").fetchone()
    assert types == ["DOUBLE", "SMALLINT", "VARCHAR", "BOOLEAN"]
    assert [dict(zip(Numbers.columns, row, strict=True)) for row in rows] == content["rows"]
    assert content["rows"][4] == {"x": None, "n": 5, "text": "ü", "yes": False}
    assert json.loads(inside) == content["provenance"]
    assert content["provenance"]["note"] == "it's"
    assert content["provenance"]["rows"] == 6


def test_a_record_is_what_the_table_knows_and_what_is_said_besides():
    lines = rotor.api.line_list(rotor.read("CO"), jmax=3, min_lgint=None)
    record = provenance_record(lines, {"command": "by hand"})
    assert (record["program"], record["version"], record["command"]) == ("rotor", rotor.__version__, "by hand")
    assert (record["min_lgint"], record["range_mhz"], record["lines"]) == (None, [0.0, None], 3)
    assert record["constants"] == rotor.read("CO").provenance["constants"]
    json.dumps(record, allow_nan=False)


@pytest.mark.parametrize("library", ["pandas", "polars"])
def test_without_the_library_the_command_that_installs_it_is_named(library, monkeypatch):
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(ImportError, match=rf'{library} is not installed: python -m pip install "molrotor\[tables\]"'):
        getattr(Numbers(), f"to_{library}")()


def test_parquet_needs_neither_pandas_nor_polars(tmp_path):
    code = (
        "import sys\n"
        "class Nowhere:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name.partition('.')[0] in ('pandas', 'polars', 'pyarrow'):\n"
        "            raise ModuleNotFoundError(name, name=name)\n"
        "sys.meta_path.insert(0, Nowhere())\n"
        "import rotor\n"
        "rotor.write(rotor.api.line_list(rotor.read('NH3'), jmax=4), sys.argv[1])\n"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "a.parquet")], check=True)
    assert pl.read_parquet(tmp_path / "a.parquet").columns[:3] == ["frequency_mhz", "error_mhz", "lgint"]


def test_texts_of_tables_are_short():
    lines = rotor.api.line_list(rotor.read("water"), jmax=6)
    assert 4 <= len(repr(lines).splitlines()) <= 10
    assert max(map(len, repr(lines).splitlines())) <= 120
    assert repr(lines).splitlines()[0].startswith(f"{len(lines)} lines of water at 300 K")
    assert "<table>" in lines._repr_html_()
    assert len(repr(lines.levels)) < 200
    assert repr(lines[:2]).splitlines()[-1].split()[0] == f"{lines.frequency_mhz[1]:.4f}"
    assert repr(lines[lines.frequency_mhz < 0]).splitlines() == ["0 lines of water at 300 K, J up to 6"]


def test_the_text_of_lines_sums_no_partition_function(monkeypatch):
    from rotor.spectra import lines as module

    lines = rotor.api.line_list(rotor.read("CO"), jmax=5, min_lgint=None)
    monkeypatch.setattr(module, "partition_function", None)
    assert "lgint" not in repr(lines)


def test_measured_lines_and_levels_are_read(tmp_path, shared):
    folder = shared / "reference" / "spcat" / "ocs"
    assert isinstance(rotor.read(folder / "ocs.egy.gz"), LevelList)
    (tmp_path / "a.lin").write_text("  1  0                                12162.98  0.01\n")
    assert isinstance(rotor.read(tmp_path / "a.lin"), LineList)


def test_a_catalogue_that_was_read_becomes_any_table(tmp_path):
    rotor.write(rotor.api.line_list(rotor.read("water"), jmax=4), tmp_path / "w.cat")
    again = rotor.read(tmp_path / "w.cat")
    assert isinstance(again, Catalogue)
    rotor.write(again, tmp_path / "w.csv")
    head = (tmp_path / "w.csv").read_text().splitlines()[0]
    assert head.endswith("q1_upper,q2_upper,q3_upper,q1_lower,q2_lower,q3_lower")
    with pytest.raises(ValueError, match=r"a Catalogue can be written as \.cat, \.cat\.gz, \.csv, \.parquet or \.json"):
        rotor.write(again, tmp_path / "w.hitran")


def test_a_file_of_lamda_is_refused_with_what_to_give(tmp_path):
    (tmp_path / "co.dat").write_text("!MOLECULE\nCO\n!MOLECULAR WEIGHT\n28.0\n")
    with pytest.raises(ValueError, match=r"a file of LAMDA .*give the catalogue"):
        rotor.read(tmp_path / "co.dat")


def test_a_packed_file_that_would_fill_the_memory_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(packed, "HARMLESS_BYTES", 1 << 20)
    (tmp_path / "bomb.cat.gz").write_bytes(gzip.compress(bytes(1 << 25)))
    with pytest.raises(ValueError, match=r"bomb\.cat\.gz: unpacks to more than 3 MB from 0\.0\d+ MB"):
        rotor.read(tmp_path / "bomb.cat.gz")


def test_packed_members_one_after_another_are_one_file(tmp_path):
    rotor.write(rotor.api.line_list(rotor.read("CO"), jmax=9), tmp_path / "co.cat")
    text = (tmp_path / "co.cat").read_bytes()
    packed_text = gzip.compress(text[:162]) + gzip.compress(text[162:])
    (tmp_path / "two.cat.gz").write_bytes(packed_text)
    assert np.array_equal(rotor.read(tmp_path / "two.cat.gz").lgint, rotor.read(tmp_path / "co.cat").lgint)
    (tmp_path / "cut.cat.gz").write_bytes(packed_text[:-5])
    with pytest.raises(ValueError, match="damaged or cut off"):
        rotor.read(tmp_path / "cut.cat.gz")


@pytest.mark.parametrize(
    ("quanta", "halves", "printed", "code"),
    [
        ({"j": 3}, (), [3], 101),
        ({"j": 3, "ka": 1, "kc": 2}, (), [3, 1, 2], 303),
        ({"v": 1, "j": 3, "ka": 1, "kc": 2}, (), [3, 1, 2, 1], 1404),  # v after the rotation, as SPCAT prints it
        ({"n": 3, "ka": 1, "kc": 2, "f": 7}, ("f",), [3, 1, 2, 4], 314),  # F = 7/2, rounded up
        ({"n": 3, "ka": 1, "kc": 2, "f1": 7, "f": 4}, ("f1", "f"), [3, 1, 2, 4, 2], 325),
        ({"v": 2, "n": 3, "ka": 1, "kc": 2, "f": 6}, ("f",), [3, 1, 2, 2, 3], 1405),
        ({"n": 3, "ka": 2, "kc": 1, "j": 5, "f": 7}, ("j", "f"), [3, 2, 1, 3, 4], 335),  # J = N + S, as SPCAT prints it
        ({"n": 3, "j": 5}, ("j",), [3, 3], 112),
    ],
)
def test_quantum_numbers_as_a_catalogue_has_them(quanta, halves, printed, code):
    columns, qnfmt = as_printed({name: np.array([value]) for name, value in quanta.items()}, halves)
    assert columns[0].tolist() == printed + [BLANK] * (6 - len(printed))
    assert qnfmt == code


def test_codes_are_those_of_predictions():
    def code(names, doubled):
        halves = [f"f{i}" for i in range(1, len(doubled) + 1)]
        totals = np.cumsum(doubled) % 2
        return as_printed(
            {name: np.array([1]) for name in names} | dict(zip(halves, totals[:, None], strict=True)), halves
        )[1]

    for names, form in ((("n",), (1, False)), (("n", "ka", "kc"), (3, False)), (("v", "n", "k"), (2, True))):
        for doubled in ((), (1,), (2,), (3, 3), (1, 2)):
            assert code(names, doubled) == Format(*form, len(doubled)).qnfmt(doubled)


def test_a_number_without_a_place_in_a_catalogue():
    with pytest.raises(ValueError, match=r"quantum numbers j, m: a catalogue has no place for m; write \.csv"):
        as_printed({"j": np.array([1]), "m": np.array([0])}, ())
