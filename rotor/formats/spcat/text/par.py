"""The parameter file of SPFIT and SPCAT, .par and .var: header, options, coded parameters, correlation as it is."""

from __future__ import annotations

import os
import re
from dataclasses import field, replace
from functools import partial
from pathlib import Path

from rotor.formats.packed import source_name
from rotor.formats.spcat.text import freeform
from rotor.formats.spcat.text.freeform import Line
from rotor.frozen import dataclass
from rotor.table import counted

_LETTER = re.compile(r"[ \t]*(?:'([A-Za-z])'|([A-Za-z])?)")  # some write it in apostrophes
_DIGIT = re.compile(r"[0-9]")
_LIKE_PARAMETER = re.compile(r"[ \t]*-?\d+[ \t,]+[+-]?(?:\d|\.\d)")


@dataclass(frozen=True)
class Header:
    """Line 2. Only NPAR matters to a prediction; a negative NLINE allows ten quantum numbers a state."""

    npar: int
    nline: int = 1
    nitr: int = 1
    nxpar: int = 0
    thresh: float = 0.0
    errtst: float = 1e6
    frac: float = 1.0
    cal: float = 1.0
    text: str = field(default="", compare=False)


@dataclass(frozen=True)
class Options:
    """An option line; the defaults stand for fields that are left out.

    chr: letter of the names file. spind: degeneracies of the spins, digit by digit; negative for the quantum numbers
    of a symmetric top. nvib: number of vibrational states; negative for the oblate basis. knmin, knmax: range of K;
    both 0 for a linear molecule. iax, wtpl, wtmn, ewt: statistical weights. vsym: negative when another option line
    follows. diag: how levels are ordered and labelled.
    """

    chr: str = "g"
    spind: int = 1
    nvib: int = 1
    knmin: int = 0
    knmax: int = 359
    ixx: int = 0
    iax: int = 1
    wtpl: int = 1
    wtmn: int = 1
    vsym: int = 0
    ewt: int = 99
    diag: int = 0
    xopt: int = 0
    text: str = field(default="", compare=False)

    @property
    def oblate(self) -> bool:
        """Whether c is the axis z of the basis."""
        return self.nvib < 0

    @property
    def by_k(self) -> bool:
        """Whether levels have the quantum numbers of a symmetric top."""
        return self.spind < 0

    @property
    def phase(self) -> int:
        """PHASE of XOPT = PHASE + 10 NEWLZ + 20 NOFC + 40 G12."""
        return self.xopt % 10

    @property
    def newlz(self) -> bool:
        """NEWLZ of XOPT: Lz is named in the codes of l-doubled states."""
        return bool(self.xopt // 10 & 1)

    @property
    def nofc(self) -> bool:
        """NOFC of XOPT: FF names a K, not a term of a Fourier series."""
        return bool(self.xopt // 10 & 2)

    @property
    def g12(self) -> bool:
        """G12 of XOPT: odd Fourier terms change sign where K is odd."""
        return bool(self.xopt // 10 & 4)


@dataclass(frozen=True)
class Parameter:
    """A parameter line: the operator's code, the value in MHz, its error, a label.

    constrained: the code is written with a minus sign, in a fit the parameter keeps its ratio to the one before.
    error: a priori in a .par file, estimated in a .var file; None where it is left out.
    """

    code: int
    value: float
    error: float | None = None
    label: str = ""
    constrained: bool = False
    text: str = field(default="", compare=False)

    def refusal(self, why: str) -> ValueError:
        """An error that names the parameter by code and label."""
        label = f" /{self.label}" if self.label else ""
        return ValueError(f"parameter {'-' * self.constrained}{self.code}{label}: {why}")


@dataclass(frozen=True)
class ParameterFile:
    """A .par or .var file. `rest` is what follows the parameters, such as the correlation matrix, as it stands."""

    title: str
    header: Header
    options: tuple[Options, ...]
    parameters: tuple[Parameter, ...]
    rest: str = ""
    title_text: str = field(default="", compare=False)

    @property
    def states(self) -> int:
        """Number of vibrational states."""
        return max(abs(self.options[0].nvib), 1)


MOST_STATES = 999
_BEYOND = 1_000_000  # so that degeneracies, of weights times 2F + 1, stay whole numbers of 32 bits
_BY_DIGITS = ("spind", "vsym")  # each digit stands for a spin or a state
_HEADER, _OPTIONS = freeform.default_values(Header), freeform.default_values(Options)


def parameters_beside(path: str | os.PathLike[str]) -> Path:
    """The .var file of the same name as an .int file, else its .par file."""
    beside = [Path(path).with_suffix(suffix) for suffix in (".var", ".par")]
    existing = next((p for p in beside if p.exists()), None)
    if existing is None:
        raise ValueError(f"{path}: an .int file has no constants; its .var or .par must stand beside it")
    return existing


def read_par(source: str | os.PathLike[str] | bytes) -> ParameterFile:
    """The parameters in a .par or .var file, or in the bytes of one.

    As in the field's program (`getpar`) the list ends after NPAR lines, and before that at a blank line or one without any digit,
    such as "!": what follows is preserved and has no bearing.
    Raises ValueError with file, line, column and the rule that is broken.
    """
    lines = freeform.read_lines(source)
    if len(lines) < 3:
        name = lines[0].file if lines else source_name(source)
        raise ValueError(f"{name}: {counted(len(lines), 'line')}; expected a title, limits, options and parameters")
    header = _header(lines[1])
    with freeform.expecting(f"this is the option line, CHR {' '.join(map(str.upper, _OPTIONS))}"):
        options = [_options(lines[2], Options())]
    while options[-1].vsym < 0:
        at = 2 + len(options)
        if at == len(lines):
            raise lines[-1].error(0, "VSYM is negative, so that another option line should follow; the file ends here")
        with freeform.expecting("VSYM below 0 in the line before says that this is another option line"):
            options.append(_options(lines[at], options[0]))

    first = 2 + len(options)
    end = first
    while end < min(len(lines), first + header.npar) and _DIGIT.search(lines[end].text):
        end += 1
    parameters = tuple(_parameter(line) for line in lines[first:end])
    rest = "".join(line.text for line in lines[end:])
    return ParameterFile(freeform.read_title(lines[0]), header, tuple(options), parameters, rest, lines[0].text)


def _header(line: Line) -> Header:
    words, _ = freeform.read_words(line, 0, len(_HEADER), abutting=True)
    header = Header(**freeform.numbers(line, words, _HEADER), text=line.text)
    if header.npar < 0:
        raise line.error(0, f"NPAR is {header.npar}; it counts the parameters")
    return header


def _options(line: Line, defaults: Options) -> Options:
    """An option line; the first one sets the defaults of those that follow, but for VSYM."""
    letter = _LETTER.match(line.body)
    start = letter.end() if letter else 0
    spins, rest = freeform.read_code(line, start)
    words = spins + freeform.read_words(line, rest, len(_OPTIONS) - 1)[0]
    defaults = replace(defaults, vsym=0)
    values = freeform.numbers(line, words, {name: getattr(defaults, name) for name in _OPTIONS})
    large = next((name for name, value in values.items() if name not in _BY_DIGITS and abs(value) >= _BEYOND), None)
    if large:
        raise line.error(0, f"{large.upper()} is {values[large]}; expected at most six digits")
    if abs(values["nvib"]) > MOST_STATES:
        raise line.error(
            0,
            f"NVIB is {values['nvib']}; expected at most {MOST_STATES} states, as codes have three digits for a state",
        )
    return Options(chr=(letter and (letter[1] or letter[2])) or defaults.chr, **values, text=line.text)


def _parameter(line: Line) -> Parameter:
    code_word, rest = freeform.read_code(line)
    code = freeform.whole(line, code_word, 0, "the parameter code")
    others, end = freeform.read_words(line, rest, 2)
    words = code_word + others
    # SPCAT takes a line without one for the last parameter, without a word
    value = freeform.number(line, words, 1, "the parameter's value", most=freeform.MOST)
    error = freeform.number(line, words, 2, "the parameter's error") if len(words) > 2 and words[2].text else None
    tail = line.body[end:]
    label = tail.partition("/")[2].strip() if "/" in tail else ""
    negative = words[0].text is not None and words[0].text.startswith("-")
    return Parameter(abs(code), value, error, label, negative, line.text)


def npar_notes(file: ParameterFile) -> list[str]:
    """A note for a file with fewer parameters than NPAR says, or with another one behind them."""
    count, behind = len(file.parameters), file.rest.partition("\n")[0]
    if file.header.npar > count:
        return [f"NPAR = {file.header.npar}, but the file has {counted(count, 'parameter')}: all count"]
    if _LIKE_PARAMETER.match(behind):
        return [
            f"NPAR = {file.header.npar}: the line behind so many parameters, {' '.join(behind.split())}, does not count"
        ]
    return []


def format_par(file: ParameterFile) -> bytes:
    """The text of a parameter file; each line as it was read, as long as it says the same."""
    return freeform.encode([
        freeform.title_text(file.title, file.title_text),
        freeform.as_read(file.header, _header) or _header_text(file.header),
        *(freeform.as_read(options, partial(_options, defaults=file.options[0] if at else Options())) or _options_text(options)
          for at, options in enumerate(file.options)),
        *(freeform.as_read(parameter, _parameter) or _parameter_text(parameter) for parameter in file.parameters),
        file.rest,
    ])  # fmt: skip


def _header_text(h: Header) -> str:
    counts = f"{h.npar:5d}{h.nline:6d}{h.nitr:5d}{h.nxpar:5d}"
    return f"{counts} {freeform.spell(h.thresh)} {freeform.spell(h.errtst)} {freeform.spell(h.frac)} {freeform.spell(h.cal)}\n"


def _options_text(options: Options) -> str:
    if not re.fullmatch("[A-Za-z]", options.chr):
        raise ValueError(f"CHR is {options.chr!r}; expected one letter")
    return options.chr + "".join(f" {getattr(options, name):4d}" for name in _OPTIONS) + "\n"


def _parameter_text(parameter: Parameter) -> str:
    code = f"{'-' if parameter.constrained else ''}{parameter.code}"
    error = "" if parameter.error is None else f" {parameter.error:.8E}"
    label = f" /{parameter.label}" if parameter.label else ""
    return freeform.one_line(f"{code:>13} {freeform.spell(parameter.value):>23}{error}{label}")
