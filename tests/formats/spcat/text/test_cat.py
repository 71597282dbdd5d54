"""The .cat format: character for character, printf's rounding, every limit of a field, clear refusals."""

import gzip
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from places import ORACLES, PROJECT, SHARED

from rotor.formats.atomic_write import atomic_path, open_atomic
from rotor.formats.spcat.text import cat, rows
from rotor.formats.spcat.text.cat import format_lines, read_cat, spell_record, write_cat
from rotor.formats.spcat.text.catalogue import DTYPES, Catalogue, Layout
from rotor.formats.spcat.text.fields import (
    BLANK,
    read_degeneracy,
    read_quantum,
    spell_decimal,
    spell_degeneracy,
    spell_quantum,
)

SAMPLES = sorted((ORACLES / "spcat").glob("*.cat"))
REFERENCE = SHARED / "reference"
LINE = b"  115271.2018  0.0005 -5.0105 2    0.0000  3 -28503 101 1           0           \n"


def catalogue_of(n: int = 3, **columns) -> Catalogue:
    """A small catalogue of lines J+1 - J; `columns` replace its columns."""
    quanta = np.full((n, 6), BLANK)
    quanta[:, 0] = np.arange(n) % 300
    upper = quanta.copy()
    upper[:, 0] += 1
    values = {
        "frequency_mhz": 1000.5 * (1 + np.arange(n)),
        "error_mhz": np.full(n, 0.01),
        "lgint": -5 + 0.001 * np.arange(n),
        "dr": np.full(n, 2),
        "energy_lower_cm": 0.5 * np.arange(n),
        "g_upper": np.full(n, 3),
        "tag": np.full(n, 28001),
        "qnfmt": np.full(n, 101),
        "quanta_upper": upper,
        "quanta_lower": quanta,
        **columns,
    }
    return Catalogue(**values)


def same(a: Catalogue, b: Catalogue) -> bool:
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in DTYPES)


@pytest.mark.parametrize("path", SAMPLES, ids=lambda p: p.stem)
def test_a_sample_comes_back_character_for_character(path):
    catalogue = read_cat(path)
    assert format_lines(catalogue) == path.read_bytes()
    assert len(catalogue) == sum(bool(line.strip()) for line in path.read_bytes().splitlines())


@pytest.mark.oracle
def test_every_reference_catalogue_comes_back_character_for_character():
    if not REFERENCE.exists():
        pytest.skip("the folder of reference files is not beside the project")
    paths = [
        *REFERENCE.glob("catalogues/*.cat.gz"),
        *REFERENCE.glob("sp*/*/*.cat.gz"),
        *REFERENCE.glob("fits/*/*/*.cat"),
    ]
    assert len(paths) > 60
    for path in paths:
        text = path.read_bytes()
        text = gzip.decompress(text) if path.suffix == ".gz" else text
        assert format_lines(read_cat(path)) == text, path


def test_the_numbers_of_a_line():
    line = read_cat(LINE).record(0)
    assert line[:8] == (115271.2018, 0.0005, -5.0105, 2, 0.0, 3, -28503, 101)
    assert (line.quanta_upper, line.quanta_lower) == ((1, *[BLANK] * 5), (0, *[BLANK] * 5))


def test_touching_fields_are_cut_by_column():
    line = b"17272891.3462523.5473 -8.4199 3 2930.7278189  30501 303311715      301516      \n"
    record = read_cat(line).record(0)
    assert (record.frequency_mhz, record.error_mhz, record.energy_lower_cm, record.g_upper) == (
        17272891.3462, 523.5473, 2930.7278, 189,
    )  # fmt: skip
    assert record.quanta_upper[:3] == (31, 17, 15)


def test_codes_of_quantum_numbers_and_degeneracies_are_one_to_one():
    quanta = range(-269, 360)
    assert [read_quantum(spell_quantum(q)) for q in quanta] == list(quanta)
    assert len({spell_quantum(q) for q in quanta}) == len(quanta)
    assert [spell_quantum(q) for q in (-269, -10, -9, 0, 99, 100, 359)] == ["z9", "a0", "-9", " 0", "99", "A0", "Z9"]
    assert [read_degeneracy(spell_degeneracy(g)) for g in range(3600)] == list(range(3600))
    assert [read_degeneracy(text) for text in ("   ", "  7")] == [0, 7]
    assert [spell_degeneracy(g) for g in (999, 1000, 2600, 3599)] == ["999", "A00", "Q00", "Z99"]


def numbers_to_print(rng: np.random.Generator) -> np.ndarray:
    """100,000 numbers of all sizes, among them exact ties (multiples of 1/32) and their neighbours."""
    spread = rng.choice([-1.0, 1.0], 60_000) * 10 ** rng.uniform(-6, 7, 60_000)
    ties = rng.integers(-32 * 10**6, 32 * 10**6, 15_000) / 32.0
    decimals = rng.integers(-(10**9), 10**9, 10_000) / 10**4 + 0.00005
    near = np.concatenate([np.nextafter(ties, np.inf), np.nextafter(ties[:5_000], -np.inf)])[:15_000]
    return np.concatenate([spread, ties, decimals, near, [0.0, -0.0, 1e-300, -1e-300]])


@pytest.mark.parametrize("decimals", [4, 6, 3])
def test_rounding_is_that_of_printf(decimals):
    values = numbers_to_print(np.random.default_rng(decimals))
    values = values[np.abs(values) < 10.0 ** (11 - decimals)]
    expected = "".join(f"{v:13.{decimals}f}" for v in values.tolist()).encode()
    out = np.empty((len(values), 13), dtype=np.uint8)
    assert rows._put_decimal(out, values, decimals).all()
    assert out.tobytes() == expected


def random_catalogue(n: int, rng: np.random.Generator) -> Catalogue:
    quanta = rng.integers(-269, 360, (2, n, 6))
    quanta[:, :, 4:] = BLANK
    return catalogue_of(
        n,
        frequency_mhz=10 ** rng.uniform(-4, 9, n),
        error_mhz=10 ** rng.uniform(-5, 5, n),
        lgint=rng.uniform(-130, 3, n),
        dr=rng.integers(0, 4, n),
        energy_lower_cm=rng.choice([-1, 1], n) * 10 ** rng.uniform(-5, 5.3, n),
        g_upper=rng.integers(0, 3600, n),
        tag=rng.integers(-99999, 999999, n),
        qnfmt=rng.choice([4, 304, 1404], n),
        quanta_upper=quanta[0],
        quanta_lower=quanta[1],
    )


def test_rows_are_the_lines_spelled_one_by_one():
    """Against printf's rounding and Python's own justification, `spell_record`; rows that do not fit say so."""
    catalogue = random_catalogue(5000, np.random.default_rng(7))
    text = np.zeros((5000, 81), dtype=np.uint8)
    fits = rows.put_rows(text, catalogue.rows(0, 5000), (4, 4, 4, 4))
    assert 500 < fits.sum() < 4900  # both kinds are there
    for index in np.flatnonzero(fits).tolist():
        assert text[index].tobytes().decode() == spell_record(catalogue.record(index), (4, 4, 4, 4)).ljust(81)


@pytest.mark.parametrize("width", [1, 2, 3, 4, 5, 7, 8])
def test_whole_numbers_of_either_sign_in_fields_of_any_width(width):
    edges = [10**n + d for n in range(9) for d in (-1, 0, 1)]
    values = np.array([sign * value for value in edges for sign in (1, -1)] + [0])
    out = np.zeros((len(values), width), dtype=np.uint8)
    fits = rows._put_whole(out, values)
    expected = [f"{value:{width}d}" for value in values.tolist()]
    assert fits.tolist() == [len(text) == width for text in expected]
    assert [text.tobytes().decode() for text in out[fits]] == [text for text in expected if len(text) == width]


def test_long_lists_come_out_as_short_ones():
    catalogue = random_catalogue(20_500, np.random.default_rng(8))
    pieces = [format_lines(catalogue.take(slice(i, i + 5000))) for i in range(0, len(catalogue), 5000)]
    text = format_lines(catalogue)
    assert text == b"".join(pieces)
    again = read_cat(text)
    assert format_lines(again) == text
    assert np.array_equal(again.quanta_upper, catalogue.quanta_upper)
    assert np.allclose(again.lgint, catalogue.lgint, rtol=0, atol=5.001e-3)  # below -99.9999 two decimals are left


def test_lines_between_states_are_those_of_their_numbers():
    """A list spells each state once, whatever fits its field or does not; lines are those of the catalogue alone."""
    rng = np.random.default_rng(9)
    states = random_catalogue(300, rng)
    states = replace(states, tag=np.full(300, 18003), qnfmt=np.full(300, 304), quanta_lower=states.quanta_upper)
    upper, lower = rng.integers(0, 300, (2, 20_000)).astype(np.int32)
    lines = replace(
        random_catalogue(20_000, rng),
        dr=states.dr[lower],
        energy_lower_cm=states.energy_lower_cm[lower],
        g_upper=states.g_upper[upper],
        tag=states.tag[lower],
        qnfmt=states.qnfmt[lower],
        quanta_upper=states.quanta_upper[upper],
        quanta_lower=states.quanta_upper[lower],
    )
    texts = cat.state_texts(states)
    assert 0 < texts.plain.sum() < 300  # both kinds are there
    assert b"".join(cat.format_chunks(lines, cat.Between(texts, upper, lower))) == format_lines(lines)


def test_numbers_too_wide_for_their_decimals():
    text = format_lines(
        catalogue_of(
            5,
            frequency_mhz=[99999999.0, 99999998.5, 123456789.0125, 1.0, 2.0],
            error_mhz=[0.01, 5000.0, np.inf, 1.0, -0.05],
            lgint=[-5.0, -5.0, -5.0, -123.45678, 0.0],
            energy_lower_cm=[0, 0, 0, 123456.78901, -1234.5],
        )
    ).decode()
    assert [line[:41] for line in text.splitlines()] == [
        " 99999999.000   0.010  -5.000 2    0.0000",
        "99999998.5000999.9999 -5.0000 2    0.0000",
        "123456789.0131000.000  -5.000 2    0.0000",
        "       1.0000  1.0000-123.457 2123456.789",
        "       2.0000 -0.0500  0.0000 2-1234.5000",
    ]


@pytest.mark.parametrize(
    ("column", "value", "words"),
    [
        ("frequency_mhz", np.nan, "line 2 .*FREQ.*nan"),
        ("frequency_mhz", 1e14, "line 2 .*FREQ.*13 characters"),
        ("error_mhz", np.nan, "line 2 .*ERR"),
        ("lgint", -np.inf, "line 2 .*LGINT"),
        ("energy_lower_cm", 1e11, "line 2 .*ELO"),
        ("g_upper", 3600, "line 2 .*GUP.*3599.*common divisor"),
        ("g_upper", -1, "line 2 .*GUP"),
        ("dr", 100, "line 2 .*DR"),
        ("tag", 10**7, "line 2 .*TAG"),
        ("qnfmt", 10000, "line 2 .*QNFMT"),
        ("quanta_upper", 360, "line 2 .*360.*359"),
        ("quanta_lower", -270, "line 2 .*-270"),
    ],
)
def test_what_has_no_place_in_a_line_is_refused(column, value, words):
    values = np.array(getattr(catalogue_of(), column))
    values[1] = value
    with pytest.raises(ValueError, match=words):
        format_lines(catalogue_of(**{column: values}))


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (LINE[:52] + b"\n", "line 2, column 53: the line ends"),
        (b"x" + LINE[1:], r"line 2, column 1: FREQ \(columns 1 to 13\) reads 'x"),
        (LINE[:4] + b" " + LINE[5:], "column 1: FREQ .*blank inside"),
        (b" " * 13 + LINE[13:], "column 1: FREQ"),
        (LINE[:21] + b" " * 8 + LINE[29:], "column 22: LGINT"),
        (LINE[:41] + b"a02" + LINE[44:], r"column 42: GUP \(columns 42 to 44\) reads 'a02'"),
        (LINE[:55] + b"1 " + LINE[57:], "column 56: quantum number reads '1 '"),
        (LINE[:55] + b"  " + LINE[57:], "column 56: blank, but QNFMT 101 says that 1"),
        (LINE[:30] + b"\t" + LINE[31:], "column 31: byte 0x09"),
        (LINE[:30] + b"\xe2\x88\x92" + LINE[33:], "column 31: byte 0xe2"),
    ],
)
def test_an_illegal_line_is_refused_with_file_line_column_and_rule(tmp_path, wrong, words):
    path = tmp_path / "some.cat"
    path.write_bytes(LINE + wrong + LINE)
    with pytest.raises(ValueError, match=words) as caught:
        read_cat(path)
    assert str(caught.value).startswith(f"{path}, line 2, ")


@pytest.mark.parametrize(
    "text",
    [
        b"",
        b"\n\n",
        LINE[:-1],
        LINE.replace(b"\n", b"\r\n") * 3,
        b"\xef\xbb\xbf" + LINE,
        LINE + b"\n   \n" + LINE + b"\n",
        LINE + b"\x1a",
        LINE.replace(b"  0.0005", b"   .0005") + LINE,
        LINE.replace(b"  115271.2018", b"  1.152712E+5") + LINE,
        LINE[:-1] + b"/ a comment\n" + LINE,
        LINE.replace(b"  115271.2018  0.0005", b"     3.8450330.000010") * 4,
        f"{42.0:<13}{1:<8}{-3.0:<8}3 {12.5:<10}{3:<3}{1234:<7} 303 1 1 0       0 0 0      \n".encode(),
    ],
)
def test_legal_but_unusual_text_comes_back_character_for_character(text):
    assert format_lines(read_cat(text)) == text


def test_more_than_six_quantum_numbers():
    line = LINE[:51] + b" 308" + b" 1 2 3 4 5 6 7 8" + b" 8 7 6 5 4 3 2 1" + b"\n"
    catalogue = read_cat(line * 3)
    assert catalogue.quanta_lower.tolist() == [[8, 7, 6, 5, 4, 3, 2, 1]] * 3
    assert not catalogue.layout.spelling
    assert format_lines(catalogue) == line * 3
    mixed = read_cat(line + LINE * 2)
    assert mixed.quanta_upper.shape == (3, 8)
    assert format_lines(mixed) == line + LINE * 2


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (-12.3456, "-12.3456"),
        (-1234.5678, "-1234.57"),
        (-12345.678, "-12345.7"),
        (123456.78, "123456.8"),
        (12345678.4, "12345678"),
    ],
)
def test_a_number_has_as_many_decimals_as_fit_down_to_none(value, text):
    assert spell_decimal(value, 8, 4) == text
    with pytest.raises(ValueError, match="does not fit a field of 8 characters"):
        spell_decimal(-123456789.0, 8, 4)


def test_quantum_numbers_without_room_are_refused():
    wide = read_cat(LINE[:51] + b" 308" + b" 1 2 3 4 5 6 7 8" * 2 + b"\n")
    columns = {name: getattr(wide, name) for name in DTYPES}
    with pytest.raises(ValueError, match="line 1 cannot be written: QNFMT 303 can hold 6"):
        format_lines(Catalogue(**{**columns, "qnfmt": np.array([303])}))


@pytest.mark.parametrize("widths", [(6, 8), (8, 6), (4, 4)])
def test_columns_of_quantum_numbers_are_as_many_for_both_states_and_six_or_more(widths):
    columns = {name: getattr(read_cat(LINE), name) for name in DTYPES}
    sides = {f"quanta_{side}": np.zeros((1, width)) for side, width in zip(("upper", "lower"), widths, strict=True)}
    with pytest.raises(ValueError, match="must have the same number of columns, 6 or more"):
        Catalogue(**{**columns, **sides})


def test_a_kept_spelling_does_not_outlive_its_numbers():
    text = LINE.replace(b"  0.0005", b"   .0005") * 2
    catalogue = read_cat(text)
    columns = {name: getattr(catalogue, name).copy() for name in DTYPES}
    columns["error_mhz"][0] = 0.25
    changed = format_lines(Catalogue(**columns, layout=catalogue.layout))
    assert changed == LINE.replace(b"  0.0005", b"  0.2500") + text[len(LINE) :]


def test_taken_lines_carry_their_spelling():
    odd = LINE.replace(b"  0.0005", b"   .0005").replace(b" 115271", b" 225271")
    catalogue = read_cat(LINE + odd + LINE[:-1])
    assert format_lines(catalogue.take(np.array([2, 1, 0]))) == LINE + odd + LINE
    assert format_lines(catalogue.take(catalogue.frequency_mhz > 2e5)) == odd


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"g_upper": [1, 2]}, "equally long"),
        ({"quanta_upper": np.zeros((3, 5), dtype=int)}, "6 or more"),
        ({"quanta_upper": np.zeros((3, 8), dtype=int)}, "same number"),
        ({"g_upper": [1.5, 1, 1]}, "g_upper holds .*1.5"),
        ({"dr": [1, 2, 70000]}, "dr holds .*70000"),
        ({"lgint": [[1.0]]}, r"lgint has shape \(1, 1\)"),
    ],
)
def test_columns_that_do_not_fit_are_refused(columns, words):
    with pytest.raises(ValueError, match=words):
        catalogue_of(**columns)


def test_packed_catalogues_are_written_and_read(tmp_path):
    path = tmp_path / "a.cat.gz"
    write_cat(catalogue_of(), path)
    assert gzip.decompress(path.read_bytes()) == format_lines(catalogue_of())
    assert same(read_cat(path), read_cat(format_lines(catalogue_of())))
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(ValueError, match=r"a\.cat\.gz: a packed file that is damaged"):
        read_cat(path)


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "a.cat"
    write_cat(catalogue_of(), path)
    before = path.read_bytes()
    with pytest.raises(ValueError, match="line 3 "):
        write_cat(catalogue_of(tag=[1, 2, 10**8]), path)
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ["a.cat"]


def test_atomic_path_cleans_up_and_says_what_is_wrong(tmp_path):
    with pytest.raises(KeyError), open_atomic(tmp_path / "b.txt", "w") as handle:  # noqa: PT012
        handle.write("half")
        raise KeyError("stopped")
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(FileNotFoundError, match="there is no folder"), atomic_path(tmp_path / "no" / "b.txt"):
        pass
    with pytest.raises(IsADirectoryError, match="is a folder"), atomic_path(tmp_path):
        pass


def test_atomic_path_follows_a_link(tmp_path):
    (tmp_path / "target.txt").write_text("old")
    try:
        (tmp_path / "link.txt").symlink_to(tmp_path / "target.txt")
    except OSError:
        pytest.skip("this system does not let us make links")
    with open_atomic(tmp_path / "link.txt", "w") as handle:
        handle.write("new")
    assert (tmp_path / "link.txt").is_symlink()
    assert (tmp_path / "target.txt").read_text() == "new"


def test_short_lists_do_not_load_the_compiler():
    code = (
        "import sys; from rotor.formats.spcat.text.cat import read_cat, format_lines; "
        f"format_lines(read_cat({LINE!r} * 100)); sys.exit('numba' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], cwd=PROJECT).returncode == 0


def test_layout_of_new_lists_is_that_of_the_program():
    assert catalogue_of().layout == Layout()
    assert {len(line) for line in format_lines(catalogue_of()).splitlines()} == {80}


def test_wide_numbers_in_a_long_list_are_spelled_as_one_by_one(monkeypatch):
    """Long lists have many lines with wide FREQ or LGINT: written together they are the bytes of the careful form."""
    rng, n = np.random.default_rng(1), 6000
    frequency = np.concatenate([rng.uniform(9.99e7, 1.001e8, n // 2), 10 ** rng.uniform(3, 9.2, n // 2)])
    lgint = np.concatenate([-99.99995 + rng.uniform(-1e-4, 1e-4, 50), rng.uniform(-140, 2, n - 50)])
    quanta = np.full((n, 6), -32768, dtype=np.int16)
    quanta[:, :3] = rng.integers(0, 200, (n, 3))
    columns = (frequency, rng.uniform(0, 2e3, n), lgint, np.full(n, 3), rng.uniform(0, 9e4, n), rng.integers(1, 900, n))
    catalogue = Catalogue(*columns, np.full(n, 1), np.full(n, 303), quanta, quanta)
    together = format_lines(catalogue)
    monkeypatch.setattr(cat, "_wide_rows", lambda *arguments: None)
    assert together == format_lines(catalogue)
