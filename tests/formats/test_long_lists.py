"""`rotor spectrum` and scenes make lists on disk that memory may not hold: the same lines, in every format."""

from __future__ import annotations

import gzip
import json
import os
import subprocess
import sys
import threading
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from rotor.formats.lines import line_tables
from rotor.scenes.run import run_scene
from rotor.scenes.scene import parse_scene
from rotor.verbs.common import long_lists

CONSTANTS = "A=8572 B=3640 C=2790 MHz"
TYPED = (
    "spectrum",
    "--constants",
    CONSTANTS,
    "--dipole-abc",
    "1.2,1.9,0.4",
    "--jmax",
    "20",
    "--min-lgint",
    "none",
    "--q",
    "1e5",
)


@pytest.fixture
def short(monkeypatch):
    """Lists of more than a thousand transitions count as long."""
    monkeypatch.setattr(long_lists, "LINES_IN_MEMORY", dict.fromkeys(long_lists.LINES_IN_MEMORY, 1_000))
    monkeypatch.setattr(long_lists, "STRONGEST", 50)


def _in_memory(call, monkeypatch, *arguments):
    with monkeypatch.context() as patch:
        patch.setattr(long_lists, "LINES_IN_MEMORY", dict.fromkeys(long_lists.LINES_IN_MEMORY, 1e9))
        return call(*arguments)


def _recorded(patch, module, name, measure):
    """A list with `measure` of the arguments of each call of a function of a module."""
    seen, true = [], getattr(module, name)

    def recording(*arguments):
        result = true(*arguments)
        seen.append(measure(*arguments))
        return result

    patch.setattr(module, name, recording)
    return seen


def test_a_long_list_is_the_same_in_every_format(call, folder, monkeypatch, short):
    code, out, err = call(*TYPED, "--cat", "a.cat", "--parquet", "a.parquet")
    assert (code, err) == (0, "")
    code, plain, _ = _in_memory(call, monkeypatch, *TYPED, "--cat", "b.cat", "--parquet", "b.parquet")
    assert code == 0
    # facts and strongest lines; those of one frequency in any order
    assert sorted(out.split()) == sorted(plain.replace("b.cat", "a.cat").replace("b.parquet", "a.parquet").split())
    assert sorted(Path("a.cat").read_text().splitlines()) == sorted(Path("b.cat").read_text().splitlines())
    import duckdb

    streamed, whole = (duckdb.sql(f"SELECT * FROM '{name}.parquet'").fetchnumpy() for name in "ab")
    assert len(streamed["frequency_mhz"]) > 10_000
    assert np.all(np.diff(streamed["frequency_mhz"]) >= 0)
    order = [np.lexsort((c["lgint"], c["j_lower"], c["frequency_mhz"].round(6))) for c in (streamed, whole)]
    for name in ("frequency_mhz", "lgint", "energy_lower_cm"):
        np.testing.assert_allclose(
            streamed[name][order[0]], whole[name][order[1]], rtol=1e-9, atol=1e-9
        )  # rounding of blocks
    assert sorted(path.name for path in folder.iterdir()) == ["a.cat", "a.cat.provenance.json", "a.parquet", "b.cat",
                                                              "b.cat.provenance.json", "b.parquet"]  # fmt: skip


def test_a_long_list_is_written_as_csv(call, folder, monkeypatch, short):
    """From the disk, with the columns of a list in memory, its numbers and its provenance."""
    code, _, err = call(*TYPED, "--csv", "a.csv")
    assert (code, err) == (0, "")
    assert _in_memory(call, monkeypatch, *TYPED, "--csv", "b.csv")[0] == 0
    streamed, whole = (np.genfromtxt(f"{name}.csv", delimiter=",", names=True) for name in "ab")
    assert streamed.dtype.names == whole.dtype.names
    assert len(streamed) == len(whole) > 10_000
    assert np.all(np.diff(streamed["frequency_mhz"]) >= 0)
    order = [np.lexsort((c["lgint"], c["j_lower"], c["frequency_mhz"].round(6))) for c in (streamed, whole)]
    for name in ("frequency_mhz", "lgint", "energy_lower_cm", "j_upper"):
        np.testing.assert_allclose(streamed[name][order[0]], whole[name][order[1]], rtol=1e-9, atol=1e-9)
    assert json.loads(Path("a.csv.provenance.json").read_text())["lines"] == len(streamed)
    assert sorted(path.name for path in folder.iterdir()) == [
        "a.csv",
        "a.csv.provenance.json",
        "b.csv",
        "b.csv.provenance.json",
    ]


def test_few_lines_above_a_cut_are_made_in_memory(call, folder, monkeypatch, short):
    """Some 1,400 of 14,000 transitions: as many lines as a list in memory may have, or one less."""
    typed = [word if word != "none" else "-6" for word in TYPED]
    lines = _in_memory(call, monkeypatch, *typed, "--cat", "a.cat")[1].split("lines ")[1].split(",")[0].strip()
    made = _recorded(monkeypatch, long_lists, "_sorted", lambda *job: job)
    for most, disk in ((int(lines), 0), (int(lines) - 1, 1)):
        monkeypatch.setattr(long_lists, "LINES_IN_MEMORY", dict.fromkeys(long_lists.LINES_IN_MEMORY, most))
        monkeypatch.setattr(long_lists, "BEFORE_CUT", 1000)
        assert call(*typed, "--cat", f"{disk}.cat")[0] == 0
        assert len(made) == disk
        assert Path(f"{disk}.cat").read_bytes() == Path("a.cat").read_bytes()


def test_a_list_on_disk_needs_a_file(call, folder, short):
    typed = ("spectrum", "--constants", CONSTANTS, "--dipole-abc", "1.2,1.9,0.4", "--jmax", "20", "--min-lgint", "none")
    code, out, err = call(*typed, "--csv", "-")
    assert (code, out) == (2, "")
    assert "--csv -: more than 1000 lines are sorted on disk, beside a file: name it" in err
    assert not list(folder.iterdir())


SPINS = {  # constants, spins, dipole, J max, cut
    "14N": (CONSTANTS, "chi_aa(14N)=-40 chi_bb(14N)=20", "1.2,1.9,0.4", 9, "none"),
    "14N, chi_ab": (CONSTANTS, "chi_aa(14N)=-40 chi_bb(14N)=20 chi_ab(14N)=900", "1.2,1.9,0", 8, "-9"),
    "35Cl": (CONSTANTS, "chi_aa(35Cl)=-60 chi_bb(35Cl)=25", "1.2,0,0.4", 8, "-9"),
    "two nuclei": (CONSTANTS, "chi_aa(35Cl)=-60 chi_bb(35Cl)=25 chi_aa(14N)=-4 chi_bb(14N)=1", "1.2,0,0", 6, "none"),
    "symmetric": ("A=9000 B=3000 MHz", "chi_aa(14N)=-40", "1.2,0,0", 20, "none"),
    "linear": ("B=3000 MHz", "chi_aa(35Cl)=-40", "1.2,0,0", 40, "none"),
}


@pytest.mark.parametrize("name", SPINS)
def test_a_long_list_with_spins_is_the_one_in_memory(call, folder, monkeypatch, short, name):
    """Pieces of few F, whose levels mix N: every line once, the catalogue of a list in memory. Ended in an error of the sort before."""
    from rotor.formats.lines import streamed_lines

    constants, spins, dipole, jmax, cut = SPINS[name]
    typed = ("spectrum", "--constants", constants, "--spin-constants", spins, "--dipole-abc", dipole, "--jmax", str(jmax),
             "--min-lgint", cut, "--q", "1e5", "--hyperfine")  # fmt: skip
    monkeypatch.setattr(long_lists, "LINES_IN_MEMORY", dict.fromkeys(long_lists.LINES_IN_MEMORY, 100))
    with monkeypatch.context() as patch:
        defaults = streamed_lines.sorted_lines.__kwdefaults__ | {"piece_lines": 300}
        patch.setattr(streamed_lines.sorted_lines, "__kwdefaults__", defaults)
        made = _recorded(patch, streamed_lines, "make_piece", lambda *job: job[1:])
        code, out, _ = call(*typed, "--cat", "a.cat")
    assert code == 0
    assert len(made) > 2
    code, plain, _ = _in_memory(call, monkeypatch, *typed, "--cat", "b.cat")
    assert code == 0
    streamed, whole = (sorted(Path(f"{file}.cat").read_text().splitlines()) for file in "ab")
    assert streamed == whole
    assert len(whole) > 200
    assert sorted(out.split()) == sorted(plain.replace("b.cat", "a.cat").split())


def test_a_scene_makes_a_long_list_on_disk(folder, short):
    scene = parse_scene(
        f'schema = 1\nkind = "spectrum"\n[molecule]\nconstants = "{CONSTANTS}"\ndipole_abc = [1.2, 1.9, 0.4]\n'
        '[observables]\nmin_lgint = "none"\nq = 1e5\n[numerics]\njmax = 20\n[outputs]\ncat = "s.cat"\n'
    )
    result = run_scene(scene)
    assert isinstance(result.answer, long_lists.LongAnswer)
    facts = result.answer.facts()
    assert facts["line_count"] > 10_000
    assert facts["jmax"] == 20
    assert len(Path("s.cat").read_text().splitlines()) == facts["line_count"] or json.loads(
        Path("s.cat.provenance.json").read_text()
    )["lines"] == len(Path("s.cat").read_text().splitlines())  # lines without strength are in no catalogue
    assert not list(folder.glob("*.pieces"))


@pytest.mark.parametrize("json_file", ["-", "all.json"])
def test_json_beside_a_list_on_disk_has_every_line(call, folder, monkeypatch, short, json_file):
    cut = [word if word != "none" else "-4.5" for word in TYPED]
    code, out, err = call(*cut, "--cat", "a.cat", "--json", json_file, "--save-scene", "a.toml")
    assert (code, err) == (0, "")
    content = json.loads(out if json_file == "-" else Path(json_file).read_text())
    assert len(content["lines"]) == content["line_count"] == len(Path("a.cat").read_text().splitlines()) > 50
    assert not list(folder.glob("*.pieces"))


@pytest.mark.parametrize("json_file", ["-", "all.json"])
def test_json_of_too_many_lines_is_refused(call, folder, monkeypatch, short, json_file):
    """At once where no cut shortens the list; else when its lines are counted, and the same list goes on without the JSON."""
    monkeypatch.setattr(long_lists, "JSON_LINES", 100)
    code, out, err = call(*TYPED, "--cat", "a.cat", "--json", json_file)
    assert (code, out) == (2, "")
    assert "--json: some 1e+04 lines exceed the" in err
    assert "--parquet has every column of every line" in err
    assert not list(folder.iterdir())

    cut = [word if word != "none" else "-4.5" for word in TYPED]
    code, out, err = call(*cut, "--cat", "a.cat", "--json", json_file)
    assert (code, out) == (1, "")
    assert "the sorted lines are in a.cat.pieces; the same command without --json writes them" in err
    assert not Path("a.cat").exists()
    assert call(*cut, "--cat", "a.cat")[0] == 0
    assert not list(folder.glob("*.pieces"))


@pytest.mark.parametrize(
    "more", [("--csv", "a.csv"), ("--cat", "a.cat.gz"), ("--cat", "a.cat", "--resolution", "1"), ()], ids=str
)
def test_what_needs_the_whole_list_has_it(call, folder, monkeypatch, short, more):
    monkeypatch.setattr(long_lists, "answer_long", lambda *_: pytest.fail("made on disk"))
    code, _, err = call(*TYPED, *more)
    assert (code, err) == (0, "")
    if more[1:] == ("a.cat.gz",):
        assert len(gzip.decompress(Path("a.cat.gz").read_bytes()).splitlines()) > 10_000


def test_short_lists_are_made_in_memory(call, folder, monkeypatch):
    monkeypatch.setattr(long_lists, "answer_long", lambda *_: pytest.fail("made on disk"))
    assert call("spectrum", "water", "--cat", "a.cat")[0] == 0


def test_an_interrupted_list_goes_on(call, folder, monkeypatch, short):
    from rotor.formats.lines import streamed_lines

    monkeypatch.setattr(streamed_lines, "PIECE_LINES", 2_000)
    pieces, true = [], streamed_lines.make_piece

    def stopping(plan, first, last):
        if len(pieces) == 3:
            raise KeyboardInterrupt
        pieces.append(first)
        true(plan, first, last)

    with monkeypatch.context() as patch:
        patch.setattr(streamed_lines, "make_piece", stopping)
        patch.setattr(
            streamed_lines.sorted_lines,
            "__kwdefaults__",
            streamed_lines.sorted_lines.__kwdefaults__ | {"piece_lines": 2_000},
        )
        assert call(*TYPED, "--cat", "a.cat")[0] == 130
        assert Path("a.cat.pieces").is_dir()
        assert not Path("a.cat").exists()
        patch.setattr(
            streamed_lines, "make_piece", lambda plan, first, last: (pieces.append(first), true(plan, first, last))
        )
        assert call(*TYPED, "--cat", "a.cat")[0] == 0
    assert len(pieces) == len(set(pieces))  # no piece twice
    assert not Path("a.cat.pieces").exists()


def test_a_piece_of_many_lines_is_written_in_parts(call, folder, monkeypatch, short):
    """One F of J = 300 has 3.6 million lines with one 14N, whose columns took 0.55 GB at once."""
    from rotor.formats.lines import list_pieces

    with monkeypatch.context() as patch:
        patch.setattr(list_pieces, "BATCH", 300)
        sizes = _recorded(patch, list_pieces, "copy_columns", lambda columns, *_: len(columns["lgint"]))
        assert call(*TYPED, "--cat", "a.cat")[0] == 0
    assert len(sizes) > 20
    assert max(sizes) == 300
    assert _in_memory(call, monkeypatch, *TYPED, "--cat", "b.cat")[0] == 0
    assert sorted(Path("a.cat").read_text().splitlines()) == sorted(Path("b.cat").read_text().splitlines())


def test_a_bar_shows_pieces_and_the_lines_that_are_written(call, folder, monkeypatch, short):
    shown = []

    @contextmanager
    def bar(what, _):
        yield lambda done, total: shown.append((what, done, total))

    monkeypatch.setattr(long_lists, "_bar", bar)
    assert call(*TYPED, "--cat", "a.cat")[0] == 0
    assert ("pieces", 1, 1) in shown
    assert shown[-1] == ("lines in a.cat", len(Path("a.cat").read_text().splitlines()), shown[-1][2])


@pytest.mark.parametrize("form", ["cat", "parquet", "csv"])
def test_a_list_is_sorted_in_ranges_of_frequency(call, folder, monkeypatch, short, form):
    """DuckDB's sort of 367 million lines at once ended in an OutOfMemoryException."""
    import duckdb

    from rotor.formats.lines import sorted_pieces

    with monkeypatch.context() as patch:
        patch.setattr(sorted_pieces, "SORTED_LINES", 1000)
        sizes = _recorded(patch, sorted_pieces, "run", lambda engine, _, file: sorted_pieces.row_count(engine, [file]))
        assert call(*TYPED, f"--{form}", f"a.{form}")[0] == 0
    assert len(sizes) > 10
    assert max(sizes) < 2000  # of approximate quantiles
    assert _in_memory(call, monkeypatch, *TYPED, f"--{form}", f"b.{form}")[0] == 0
    if form == "cat":
        streamed, whole = (Path(f"{name}.cat").read_text().splitlines() for name in "ab")
        assert sorted(streamed) == sorted(whole)
        assert [float(line[:13]) for line in streamed] == sorted(float(line[:13]) for line in whole)
        return
    streamed, whole = (
        duckdb.sql(f"SELECT frequency_mhz FROM '{name}.{form}'").fetchnumpy()["frequency_mhz"] for name in "ab"
    )
    np.testing.assert_allclose(streamed, whole, rtol=1e-9)


def test_a_list_that_is_sorted_is_not_made_again(call, folder, monkeypatch, short):
    """Interrupted while a file is written: no piece is solved again, and the pieces take no space on the disk beside the sorted list."""
    from rotor.formats.lines import streamed_lines

    def stop(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(streamed_lines, "format_lines", stop)
        assert call(*TYPED, "--cat", "a.cat")[0] == 130
    assert {path.name for path in Path("a.cat.pieces").iterdir()} == {"manifest.json", "sorted"}
    with monkeypatch.context() as patch:
        patch.setattr(streamed_lines, "make_piece", lambda *_: pytest.fail("solved again"))
        assert call(*TYPED, "--cat", "a.cat")[0] == 0
    assert _in_memory(call, monkeypatch, *TYPED, "--cat", "b.cat")[0] == 0
    assert sorted(Path("a.cat").read_text().splitlines()) == sorted(Path("b.cat").read_text().splitlines())


def test_the_lines_that_are_written_are_counted(folder, monkeypatch, short):
    """The catalogue of 367 million lines is written for half an hour."""
    from rotor.formats.lines.streamed_lines import sorted_lines
    from rotor.tops.top import Top

    top = Top.from_constants(CONSTANTS, dipole_abc_debye=(1.2, 1.9, 0.4))
    lines = sorted_lines(top, Path("a.pieces"), jmax=5, temperature_k=300.0, min_lgint=None, range_mhz=(0.0, float("inf")),
                         q=1e5, vibrational_factor=1.0)  # fmt: skip
    counts = []
    lines.write(Path("a.cat"), progress=lambda done, total: counts.append((done, total)))
    assert counts[-1][0] == len(Path("a.cat").read_text().splitlines()) <= counts[-1][1] == lines.count


# the peak of this program: `ru_maxrss` of a child is at least what its parent had
MEASURED = """
import sys
import threading
from pathlib import Path
from rotor.cli import run
code = run(sys.argv[1:])
(peak,) = (line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
print(int(peak.split()[1]) // 1024, file=sys.stderr)
sys.exit(code)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="resident memory is measured in kB on Linux")
def test_all_lines_to_j_300_take_less_than_1_gb(tmp_path):
    """40 million lines of an asymmetric top with three components, sorted, as a catalogue and as Parquet."""
    typed = [word if word != "20" else "300" for word in TYPED]
    done = subprocess.run(
        [sys.executable, "-c", MEASURED, *typed, "--cat", "a.cat", "--parquet", "a.parquet"],
        cwd=tmp_path, env={**os.environ, "OMP_NUM_THREADS": "1"}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert int(done.stderr.splitlines()[-1]) < 1000  # MB resident, as the issue asks
    import duckdb

    ((count, falls),) = duckdb.sql(
        "SELECT count(*), count_if(frequency_mhz < before) FROM (SELECT frequency_mhz, lag(frequency_mhz) OVER () before "
        f"FROM '{tmp_path / 'a.parquet'}')"
    ).fetchall()
    assert count > 30_000_000
    assert falls == 0
    assert (tmp_path / "a.cat").stat().st_size > 80 * 30_000_000


def test_pieces_come_in_order_and_an_error_ends_the_threads():
    def doubled(start: int) -> int:
        if start == 14:
            raise ValueError("piece 14")
        return 2 * start

    assert list(line_tables._in_order(doubled, range(3, 14))) == [2 * k for k in range(3, 14)]
    others = set(threading.enumerate())
    pieces = line_tables._in_order(doubled, range(0, 400, 2))
    assert [next(pieces) for _ in range(7)] == [4 * k for k in range(7)]
    started = set(threading.enumerate()) - others
    with pytest.raises(ValueError, match="piece 14"):
        next(pieces)
    for thread in started:
        thread.join(10)
    assert not any(thread.is_alive() for thread in started)
