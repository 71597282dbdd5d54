"""The .par/.var, .int, .lin and .egy files: nothing lost, free-form numbers, refusals with file, line and column."""

import gzip
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from changed_files import mutated
from places import ORACLES, SHARED

from rotor.formats.atomic_write import write_whole
from rotor.formats.spcat.text.cat import format_lines, read_cat
from rotor.formats.spcat.text.egy import format_egy, read_egy
from rotor.formats.spcat.text.fields import BLANK
from rotor.formats.spcat.text.int_file import Dipole, IntensityFile, Request, format_int, read_int
from rotor.formats.spcat.text.lin import LineList, format_lin, line_list, read_lin, remark_notes
from rotor.formats.spcat.text.par import Header, Options, Parameter, ParameterFile, format_par, read_par

SAMPLES = ORACLES / "spcat"
REFERENCE = SHARED / "reference"


class Format(NamedTuple):
    suffixes: tuple[str, ...]
    read: Callable
    text: Callable


FORMATS = {
    "cat": Format((".cat",), read_cat, format_lines),
    "par": Format((".par", ".var", ".par.start"), read_par, format_par),
    "int": Format((".int",), read_int, format_int),
    "lin": Format((".lin",), read_lin, format_lin),
    "egy": Format((".egy",), read_egy, format_egy),
}


def format_of(path: Path) -> Format | None:
    name = path.name.removesuffix(".gz")
    return next((form for form in FORMATS.values() if name.endswith(form.suffixes)), None)


def samples() -> list[Path]:
    return sorted(path for path in SAMPLES.iterdir() if format_of(path) and path.suffix != ".cat")


@pytest.mark.parametrize("path", samples(), ids=lambda p: p.name)
def test_a_sample_comes_back_character_for_character(path):
    form = format_of(path)
    assert form.text(form.read(path)) == path.read_bytes()


@pytest.mark.oracle
def test_every_reference_file_comes_back_character_for_character():
    if not REFERENCE.exists():
        pytest.skip("the folder of reference files is not beside the project")
    paths = [
        path for folder in ("spcat", "spfit", "fits") for path in REFERENCE.glob(f"{folder}/**/*") if format_of(path)
    ]
    paths = [path for path in paths if ".cat" not in path.name and path.stat().st_size < 400_000]  # time
    assert len(paths) > 100
    for path in paths:
        text = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
        form = format_of(path)
        assert form.text(form.read(path)) == text, path


# Parameters


def test_the_content_of_a_parameter_file():
    file = read_par(SAMPLES / "formamide_hfs.var")
    assert file.header == Header(10, 400, 30, 0, 0.0, 1e9, 1.0, 1.0)
    assert file.options == (Options("a", 3, 1, 0, 20, 0, 1, 1, 1, 0, 1, 0),)
    assert file.parameters[0] == Parameter(10000, 7.271695801514469e4, 5.5598308e-5, "A")
    assert [p.code for p in file.parameters[-2:]] == [110010000, 110040000]
    assert file.title.startswith("formamide_hfs")
    assert file.rest.count("\n") == 7


def test_constrained_parameters_and_several_option_lines():
    file = read_par(SAMPLES / "ar-so2.par")
    assert [o.nvib for o in file.options] == [2, 1]
    assert [o.vsym for o in file.options] == [-1, 0]
    again = read_par(b"t\n2\na 1 1 0 5\n100 5.0 1 /B\n-1000 2.5 1 /follows\n")
    assert [(p.code, p.constrained) for p in again.parameters] == [(100, False), (1000, True)]


@pytest.mark.parametrize(
    ("line", "value"),
    [
        ("100 5.5D+3", 5500.0),
        ("100,5.5e3", 5500.0),
        ("100.\t+5500 / B", 5500.0),
        (" 100 , 5500., 1 /x", 5500.0),
        ("100,.55E+04,,", 5500.0),
        ("100,,3.0", 3.0),  # as SPCAT reads it
    ],
)
def test_numbers_in_free_form(line, value):
    parameter = read_par(f"t\n1\na 1 1 0 5\n{line}\n".encode()).parameters[0]
    assert (parameter.code, parameter.value) == (100, value)


@pytest.mark.parametrize("line", ["100", "100 / 7", "100 ,,,3.0"])
def test_a_parameter_without_a_value_is_refused(line):
    """SPCAT takes such a line for the last one, and the value of the third for 0."""
    with pytest.raises(ValueError, match=r"line 4, .* the parameter's value is missing"):
        read_par(f"t\n1\na 1 1 0 5\n{line}\n".encode())


@pytest.mark.parametrize(
    ("line", "fields"),
    [
        ("a,,2,,20", (1, 2, 0, 20)),
        ("a 3,,2,1,20", (3, 2, 1, 20)),
        ("a ,2,,30", (1, 2, 0, 30)),
        ("a-3,,,1", (-3, 1, 1, 359)),
        ("a 3 2 1 20", (3, 2, 1, 20)),
    ],
)
def test_one_comma_belongs_to_spind_and_one_before_nvib_leaves_no_default(line, fields):
    """As the compiled SPCAT reads such lines."""
    o = read_par(f"t\n1\n{line}\n100 5\n".encode()).options[0]
    assert (o.spind, o.nvib, o.knmin, o.knmax) == fields


def test_options_left_out_have_defaults():
    options = read_par(b"t\n1\n s  1 1 0,20\n100 5\n").options[0]
    assert (options.chr, options.knmax, options.iax, options.wtpl, options.wtmn) == ("s", 20, 1, 1, 1)
    assert read_par(b"t\n1\n-3 3 0 0 0 2 0 1 0 /mock\n100 5\n").options[0].spind == -3


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"", "0 lines"),
        (b"title\n1\n", "2 lines"),
        (b"t\nx\na 1\n", r"line 2, column 1: 'x' is no number"),
        (b"t\n\na 1\n", r"line 2, column 1: NPAR is missing"),
        (b"t\n-1\na 1\n", r"line 2, column 1: NPAR is -1"),
        (b"t\n1\na 1 1000\n", r"line 3, column 1: NVIB is 1000; expected at most 999 states"),
        (b"t\n1.5\na 1\n", r"NPAR = 1.5: expected a whole number"),
        (b"t\n1\na 1 1 0 20 0 1 1000000 1\n", r"line 3, .* WTPL is 1000000; expected at most six digits"),
        (b"t\n1\na 1 1 0 20 99999999999999999999\n", r"IXX is 9+; expected at most six digits"),
        (b"t\n1\na 1 1 0 20 0 1 one\n", r"line 3, column 16: 'one' is no number"),
        (b"t\n1\na 1 1 0 20 0 1 1 1 -1\n", "line 3, .*another option line"),
        (b"t\n1\na 1\n100 5..5\n", r"line 4, column 5: '5..5' is no number"),
        (b"t\n1\na 1\n100 B=5\n", r"line 4, column 5: 'B=5' is no number"),
        (b"t\n1\na 1\n1.5e4 5\n", r"line 4, column 1: the parameter code = 1.5e4: expected a whole number"),
        (b"t\n1\na 1\n100 1e999\n", r"line 4, column 5: .*too large"),
        (b"t\n1\na 1\n100 1e200\n", r"line 4, column 5: the parameter's value = 1e200 is too large"),
    ],
)
def test_an_unreadable_parameter_file_is_refused(tmp_path, text, words):
    path = tmp_path / "some.par"
    path.write_bytes(text)
    with pytest.raises(ValueError, match=words) as caught:
        read_par(path)
    if text:
        assert str(caught.value).startswith(str(path))


def test_a_changed_parameter_is_written_anew_and_the_others_as_they_were():
    path = SAMPLES / "h2s.par"
    file = read_par(path)
    changed = replace(file.parameters[1], value=0.1 + 0.2)
    file = replace(file, parameters=(file.parameters[0], changed, *file.parameters[2:]))
    old, new = path.read_bytes().splitlines(), format_par(file).splitlines()
    assert [i for i, (a, b) in enumerate(zip(old, new, strict=True)) if a != b] == [4]
    assert read_par(format_par(file)).parameters == file.parameters


def test_a_new_parameter_file_reads_back(tmp_path):
    file = ParameterFile(
        "made up",
        Header(2),
        (Options("s", 1, -1, 0, 30, 0, 1, 5, 3, 0, 1, 3),),
        (Parameter(100, 1 / 3, 1e-37, "B"), Parameter(1000, -2e-300, None, "", constrained=True)),
    )
    write_whole(tmp_path / "a.par", format_par(file))
    assert read_par(tmp_path / "a.par") == replace(file, title_text="made up\n")
    with pytest.raises(ValueError, match="one line"):
        format_par(replace(file, title="two\nlines"))


def test_bytes_that_are_no_utf8_survive():
    text = b"M\xfcller\r\n1\r\na 1\r\n100 5.0 1 /\xc3\xa5\r\n"
    assert format_par(read_par(text)) == text


# Intensities


def test_the_content_of_an_intensity_file():
    file = read_int(SAMPLES / "csf.int")
    assert file.request == Request(1, 146001, 6887.8333, 0, 6, -9.3, -9.3, 40.0, 225.0)
    assert file.dipoles == (Dipole(1, 1.948),)
    assert [d.code for d in read_int(SAMPLES / "ar-so2.int").dipoles] == [1, 111, 13]
    assert read_int(SAMPLES / "co_4.int").request.temperature_k == 300.0


def test_a_new_intensity_file_reads_back(tmp_path):
    request = Request(1, 28001, 108.865, 0, 99, -20, -20, 9999.99, 37.5, 2)
    file = IntensityFile("CO", request, (Dipole(1, 0.1101), Dipole(30001, -1.1e-5, grouped=True)))
    write_whole(tmp_path / "a.int", format_int(file))
    assert read_int(tmp_path / "a.int") == replace(file, title_text="CO\n")
    assert format_int(read_int(tmp_path / "a.int")) == (tmp_path / "a.int").read_bytes()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"title\n", "1 line;"),
        (b"t\n0 1 x\n", r"line 2, column 5: 'x' is no number"),
        (b"t\n0 1.5\n", "TAG = 1.5: expected a whole number"),
        (b"t\n0 1\n1\n", r"line 3, column 2: the dipole's value is missing"),
        (b"t\n0 1\n1 mu\n", r"line 3, column 3: 'mu' is no number"),
        (
            b"t\n0 1\n1 -1e200\n",
            r"line 3, column 3: the dipole's value = -1e200 is too large: expected at most 1e",
        ),
    ],
)
def test_an_unreadable_intensity_file_is_refused(text, words):
    with pytest.raises(ValueError, match=words):
        read_int(text)


# Lines


def test_the_content_of_a_line_list():
    lines = read_lin(SAMPLES / "csf.lin")
    upper, lower = lines.states()
    assert (upper[0].tolist(), lower[0].tolist()) == ([1, 4, 3, *[BLANK] * 3], [1, 5, 5, *[BLANK] * 3])
    assert (lines.frequency_mhz[0], lines.error_mhz[0], lines.weight[0]) == (0.22460, 0.00025, 1.0)


def test_a_negative_error_means_wavenumbers():
    lines = read_lin(b"  1  0" + b" " * 30 + b" 3.845 -0.0001 0.5\n")
    assert lines.frequency_mhz[0] == 3.845 * 29979.2458
    assert lines.error_mhz[0] == 0.0001 * 29979.2458
    assert lines.weight[0] == 0.5


def test_neighbours_of_one_frequency_and_error_are_a_blend():
    frequency = [10.0, 10.0, 10.0, 20.0, 20.0, 30.0, 30.0, 30.0]
    error = [0.1, 0.1, 0.5, 0.1, 0.3, 0.1, 0.1, 0.15]
    zeros = np.zeros((8, 12), dtype=np.int16)
    lines = LineList(zeros, np.array(frequency), np.array(error), np.ones(8))
    # two alike; the width of that blend; a frequency alone twice; two alike, then one whose error is no width's
    assert lines.blends().tolist() == [0, 0, -1, 1, 2, 3, 3, 4]


def test_a_changed_line_is_written_anew_and_the_others_as_they_were():
    path = SAMPLES / "ch3cn_part.lin"
    lines = read_lin(path)
    lines.frequency[3] = 1 / 3
    old, new = path.read_bytes().splitlines(), format_lin(lines).splitlines()
    assert [i for i, (a, b) in enumerate(zip(old, new, strict=True)) if a != b] == [3]
    again = read_lin(format_lin(lines))
    assert np.array_equal(again.frequency, lines.frequency)
    assert np.array_equal(again.quanta, lines.quanta)


def test_a_blank_line_ends_the_list_and_what_follows_is_kept():
    line = b"  1  0" + b" " * 30 + b" 115271.2018 0.0005\n"
    text = b"\n" + line + line + b"\n the rest, whatever\n"
    lines = read_lin(text)
    assert (len(lines), lines.rest) == (2, "\n the rest, whatever\n")
    assert format_lin(lines) == text


def test_a_new_line_list_reads_back(tmp_path):
    lines = line_list([[10, 2, 8, 9], [1, -1, 0, 123]], [[9, 2, 7, 8], [0, 0, 0, 0]], [1e6 / 3, 2.5], [0.1, 1e-3], 0.5)
    write_whole(tmp_path / "a.lin", format_lin(lines))
    again = read_lin(tmp_path / "a.lin")
    for name in ("quanta", "frequency", "error", "weight"):
        assert np.array_equal(getattr(again, name), getattr(lines, name))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"  1  0\n", r"line 1, column 7: the frequency \(from column 37 on\) is missing"),
        (b"  1  0  2" + b" " * 27 + b" 5.0 0.1\n", "line 1, column 10: 3 quantum numbers"),
        (b"  1  x" + b" " * 30 + b" 5.0 0.1\n", "line 1, column 4: quantum number reads '  x'"),
        (
            b"  1  0" + b" " * 30 + b" 5.0 0.1 O.5\n",
            "column 46: 'O.5' is no number.* a comment begins",
        ),
    ],
)
def test_an_unreadable_line_is_refused(text, words):
    with pytest.raises(ValueError, match=words):
        read_lin(text)


def test_words_behind_the_error_of_a_line_are_a_remark():
    """Without a slash too; in a blend, where the weight counts, that is said, since SPFIT takes the digits of the words for it."""
    line = b"  1  0" + b" " * 30 + b" 5.0 0.1 Smith 1973, v=0\n"
    read = read_lin(line)
    assert (read.frequency.tolist(), read.error.tolist(), read.weight.tolist()) == ([5.0], [0.1], [1.0])
    assert format_lin(read) == line
    assert remark_notes(read, read.blends()) == []
    blend = read_lin(line + b"  2  1" + line[6:])
    assert "2 blended lines have words where their weight may stand" in remark_notes(blend, blend.blends())[0]


def test_lines_that_do_not_fit_are_refused():
    with pytest.raises(ValueError, match=r"line 1 cannot be written: quantum numbers .1000"):
        format_lin(line_list([[1000]], [[999]], [1.0], 0.1))
    with pytest.raises(ValueError, match="not negative"):
        line_list([[1]], [[0]], [1.0], -0.1)


# Levels


def test_the_content_of_an_energy_file():
    levels = read_egy(SAMPLES / "h2co_part.egy")
    assert levels.level(1) == (6, 1, 10.700143, 0.0, 1.0, 9, (1, 1, 0), None)
    assert (len(levels), levels.texts) == (81, {})


def test_derivatives_among_the_levels_are_kept(tmp_path):
    level = b"     1    1          0.000000          0.000000   1.000000    1:  0  0  0\n"
    table = b"             1  -1.23456E+00     2   3.00000E+00\n"
    text = level + table + level + table + table
    levels = read_egy(text)
    assert len(levels) == 2
    assert format_egy(levels) == text
    write_whole(tmp_path / "a.egy", format_egy(levels))
    assert (tmp_path / "a.egy").read_bytes() == text


def test_an_unreadable_level_is_refused():
    level = b"     1    1          0.000000          0.000000   1.000000    1:  0  0  0\n"
    with pytest.raises(ValueError, match="line 2, column 64: a level has a colon"):
        read_egy(level + level[:50] + b"\n")
    with pytest.raises(ValueError, match="line 1, column 12: EGY reads"):
        read_egy(level[:20] + b"*" + level[21:])


# Mutations: a clear refusal, or a reading that comes back from its own text


def small_texts() -> list[tuple[Format, bytes]]:
    """The first dozen lines of each sample, so that every accident hits something that matters."""
    paths = sorted(path for path in SAMPLES.iterdir() if format_of(path))
    return [(format_of(path), b"".join(path.read_bytes().splitlines(keepends=True)[:12])) for path in paths]


def read_or_refuse(form: Format, text: bytes) -> object:
    try:
        return form.read(text)
    except ValueError as refusal:
        return str(refusal)


def survive(mutations: int, seed: int) -> tuple[int, int]:
    """How many mutated texts were read and how many refused; anything else fails."""
    rng, texts = np.random.default_rng(seed), small_texts()
    read = refused = 0
    for i in range(mutations):
        form, text = texts[i % len(texts)]
        text = mutated(text, rng)
        content = read_or_refuse(form, text)
        if isinstance(content, str):
            assert content.startswith("the text given"), (content, text)
            refused += 1
        else:
            assert form.text(content) == text, text
            read += 1
    return read, refused


def test_a_thousand_mutated_files():
    read, refused = survive(1_000, seed=1)
    assert min(read, refused) > 200  # both outcomes are really tried


@pytest.mark.slow
def test_ten_thousand_mutated_files():
    read, refused = survive(10_000, seed=2)
    assert min(read, refused) > 2_000
