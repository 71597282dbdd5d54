"""HITRAN's 160-character records: read and written byte for byte, and made from a line list.

Layout of 2004 (L. S. Rothman et al., J. Quant. Spectrosc. Radiat. Transf. 96, 139 (2005), table 1). Intensities there are
S in cm⁻¹/(molecule cm⁻²) at 296 K, times the isotopologue's abundance. With the integrated intensity I of JPL and CDMS

    S = I / (c · 10⁸) = I(nm² MHz) / 2.99792458·10¹⁸        1 nm² MHz = 10⁻¹⁴ cm² · 10⁶ Hz, c in cm/s

(hitran.org, "Conversion of intensities between HITRAN and JPL/CDMS", eq. 1). The suffix here is `.hitran`: HITRAN's own,
`.par`, is that of SPFIT's parameters, and one name should not have two meanings when a file is written.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor import units
from rotor.formats.atomic_write import open_atomic
from rotor.formats.packed import first_bytes
from rotor.formats.spcat.text.fields import read_decimal, read_whole
from rotor.formats.spcat.text.freeform import Line, encode, read_lines
from rotor.spectra.lines import Lines
from rotor.table import Table

LENGTH = 160
MORE = ","  # separates further parameters (line mixing, other profiles) after a record in tables of HAPI
MOST_LENGTH = 4096  # longest first line with further parameters
TEMPERATURE_K = 296.0
_ISOTOPOLOGUES = "1234567890ABCDEFGHIJKLMNOPQRSTUVWXYZ"  # 0 is the tenth, A the eleventh


class _Field(NamedTuple):
    """One field: its columns, and the format of its number (None for text)."""

    name: str
    start: int
    stop: int
    form: str | None


_FIELDS = (
    _Field("molecule", 0, 2, "d"),
    _Field("isotopologue", 2, 3, "iso"),
    _Field("wavenumber_cm", 3, 15, ".6f"),
    _Field("intensity_cm", 15, 25, ".3E"),
    _Field("einstein_a_per_s", 25, 35, ".3E"),
    _Field("gamma_air", 35, 40, ".4f"),
    _Field("gamma_self", 40, 45, ".3f"),
    _Field("energy_lower_cm", 45, 55, ".4f"),
    _Field("n_air", 55, 59, ".2f"),
    _Field("delta_air", 59, 67, ".6f"),
    _Field("global_upper", 67, 82, None),
    _Field("global_lower", 82, 97, None),
    _Field("local_upper", 97, 112, None),
    _Field("local_lower", 112, 127, None),
    _Field("uncertainties", 127, 133, None),
    _Field("references", 133, 145, None),
    _Field("mixing_flag", 145, 146, None),
    _Field("g_upper", 146, 153, ".1f"),
    _Field("g_lower", 153, 160, ".1f"),
)


@dataclass(frozen=True, eq=False, repr=False)
class HitranLines(Table):
    """Records as columns of equal length n.

    molecule, isotopologue (n,): HITRAN's numbers. wavenumber_cm (n,): cm⁻¹. intensity_cm (n,): cm/molecule at 296 K with
    the isotopologue's abundance. einstein_a_per_s (n,). gamma_air, gamma_self (n,): half widths, cm⁻¹/atm. n_air (n,):
    exponent of the temperature. delta_air (n,): shift, cm⁻¹/atm. energy_lower_cm (n,): cm⁻¹. global_*, local_* (n,): 15
    characters of vibrational and of rotational labels. uncertainties, references, mixing_flag (n,): 6, 12, 1 characters.
    g_upper, g_lower (n,): degeneracies. texts: lines that are not as they would be written from the columns.
    """

    molecule: NDArray[np.int64]
    isotopologue: NDArray[np.int64]
    wavenumber_cm: NDArray[np.float64]
    intensity_cm: NDArray[np.float64]
    einstein_a_per_s: NDArray[np.float64]
    gamma_air: NDArray[np.float64]
    gamma_self: NDArray[np.float64]
    energy_lower_cm: NDArray[np.float64]
    n_air: NDArray[np.float64]
    delta_air: NDArray[np.float64]
    global_upper: NDArray[np.str_]
    global_lower: NDArray[np.str_]
    local_upper: NDArray[np.str_]
    local_lower: NDArray[np.str_]
    uncertainties: NDArray[np.str_]
    references: NDArray[np.str_]
    mixing_flag: NDArray[np.str_]
    g_upper: NDArray[np.float64]
    g_lower: NDArray[np.float64]
    texts: Mapping[int, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        lengths = {f.name: len(getattr(self, f.name)) for f in _FIELDS}
        if len(set(lengths.values())) > 1:
            raise ValueError(f"columns of HITRAN records must be equally long, not {lengths}")

    def __len__(self) -> int:
        return len(self.wavenumber_cm)

    @property
    def frequency_mhz(self) -> NDArray[np.float64]:
        """The lines' frequencies in MHz, (n,)."""
        return self.wavenumber_cm * units.MHZ_PER_CM

    def record(self, index: int) -> dict[str, Any]:
        """The content of one record by field."""
        return {f.name: getattr(self, f.name)[index].item() for f in _FIELDS}

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Every field of the records by its name."""
        return {f.name: getattr(self, f.name) for f in _FIELDS}


def cm_per_molecule(intensity_nm2_mhz: ArrayLike) -> NDArray[np.float64]:
    """An integrated intensity in cm/molecule, (n,), from nm² MHz, (n,), at the same temperature and abundance.

    >>> float(cm_per_molecule(2.99792458e-2))
    1e-20
    """
    return np.asarray(intensity_nm2_mhz, dtype=float) / units.NM2_MHZ_PER_CM


def nm2_mhz(intensity_cm_per_molecule: ArrayLike) -> NDArray[np.float64]:
    """An integrated intensity in nm² MHz, (n,), from cm/molecule, (n,); the inverse of `cm_per_molecule`."""
    return np.asarray(intensity_cm_per_molecule, dtype=float) * units.NM2_MHZ_PER_CM


def read_hitran(source: str | os.PathLike[str] | bytes) -> HitranLines:
    """The records in a file, packed with gzip or not, or in the bytes of one.

    Parameters that HAPI writes behind the 160 characters are not columns; they stay in the text of the line.
    Raises ValueError with file, line, column and the rule that is broken.
    """
    lines = read_lines(source)
    records = [_record(line) for line in lines]
    columns: dict[str, Any] = {f.name: _column(f, [record[f.name] for record in records]) for f in _FIELDS}
    plain = HitranLines(**columns)
    texts = {i: line.text for i, line in enumerate(lines) if _plain_or_none(plain.record(i)) != line.text}
    return HitranLines(**columns, texts=texts)


def is_hitran_file(path: Path) -> bool:
    """Whether the first line of a file, packed with gzip or not, is a record; HITRAN and SPFIT share the suffix .par."""
    first = first_bytes(path, MOST_LENGTH).split(b"\n")[0].removesuffix(b"\r")
    try:
        _record(Line(first.decode("latin-1"), 1, ""))
    except ValueError:
        return False
    return True


def _column(part: _Field, values: list[Any]) -> NDArray[Any]:
    if part.form is None:
        return np.array(values, dtype=f"U{part.stop - part.start}")
    return np.array(values, dtype=np.int64 if part.form in ("d", "iso") else np.float64)


def _record(line: Line) -> dict[str, Any]:
    if len(line.body) != LENGTH and line.body[LENGTH : LENGTH + 1] != MORE:
        raise line.error(
            min(len(line.body), LENGTH),
            f"the line has {len(line.body)} characters; a record of HITRAN has {LENGTH}, further parameters of HAPI follow a "
            f"{MORE!r}",
        )
    return {part.name: _read(line, part) for part in _FIELDS}


def _read(line: Line, part: _Field) -> Any:
    text = line.body[part.start : part.stop]
    if part.form is None:
        return text
    try:
        if part.form == "iso":
            return isotopologue_number(text)
        return read_whole(text) if part.form == "d" else read_decimal(text)
    except ValueError as error:
        raise line.error(part.start, f"{part.name} reads {text!r}; {error}") from None


def isotopologue_number(text: str) -> int:
    """Number of an isotopologue from its character."""
    if text not in _ISOTOPOLOGUES:
        raise ValueError("an isotopologue is a digit from 1, 0 for the tenth, or a letter from A, the eleventh")
    return _ISOTOPOLOGUES.index(text) + 1


def format_record(record: Mapping[str, Any]) -> str:
    """The line of a record with its end; ValueError, with the field, for what has no place in it."""
    parts = [_spell(part, record[part.name]) for part in _FIELDS]
    return "".join(parts) + "\n"


def _spell(part: _Field, value: Any) -> str:
    width = part.stop - part.start
    if part.form is None:
        text = str(value).rjust(width)
    elif part.form == "iso":
        text = _ISOTOPOLOGUES[value - 1] if 1 <= value <= len(_ISOTOPOLOGUES) else str(value).rjust(width + 1)
    else:
        text = f"{value:{width}{part.form}}"
        if len(text) > width:  # as Fortran does: the zero before the point is left out
            text = text.replace("-0.", "-.", 1) if text.startswith("-0.") else text.removeprefix("0")
    if len(text) != width or "\n" in text or (part.form not in (None, "d", "iso") and not np.isfinite(value)):
        raise ValueError(
            f"{part.name} = {value!r} does not fit columns {part.start + 1}-{part.stop} of a HITRAN record"
        )
    return text


def _plain_or_none(record: Mapping[str, Any]) -> str | None:
    try:
        return format_record(record)
    except ValueError:
        return None


def format_hitran(lines: HitranLines) -> bytes:
    """The text of the records; each line as it was read, as long as it says the same."""
    texts = []
    for index in range(len(lines)):
        record, stored = lines.record(index), lines.texts.get(index)
        same = stored is not None and _record(Line(stored, index + 1, "stored text")) == record
        texts.append(stored if same and stored is not None else format_record(record))
    return encode(texts)


def write_hitran(lines: HitranLines, path: str | os.PathLike[str]) -> None:
    """Write records; an existing file is replaced at the end or not at all."""
    with open_atomic(path) as handle:
        handle.write(format_hitran(lines))


def hitran_lines(lines: Lines, *, molecule: int, isotopologue: int = 1, abundance: float = 1.0) -> HitranLines:
    """Records of a line list made at 296 K.

    lines: n lines with intensities at 296 K. molecule, isotopologue: HITRAN's numbers for the species (CO is 5, its main isotopologue 1).
    abundance: abundance of the isotopologue, a factor of all intensities in HITRAN; 1 for the pure isotopologue.
    Returns: n records, rising in wavenumber.
    Raises ValueError for another temperature than 296 K, for an abundance that is not from above 0 to 1, and for lines split by spins.
    Not in a rotor's line list, and written as 0: broadening, shift, codes of uncertainty and of reference. Weights are those of the list,
    without a divisor common to all levels.
    """
    if lines.temperature_k != TEMPERATURE_K:
        raise ValueError(
            f"HITRAN's intensities are those at 296 K, the list was made for {lines.temperature_k:g} K; "
            "compute it again at temperature_k=296 (with Q at 296 K, if you give Q)"
        )
    if not 0 < abundance <= 1:
        raise ValueError(f"abundance {abundance}: the share of the isotopologue is above 0 and at most 1")
    _refuse_spins(lines)
    lines = lines.where(np.argsort(lines.frequency_mhz, kind="stable"))
    levels, n = lines.levels, len(lines)
    zero, (global_upper, global_lower) = np.zeros(n), _global_quanta(lines)
    upper, lower = _local_quanta(lines)
    return HitranLines(
        molecule=np.full(n, molecule, dtype=np.int64),
        isotopologue=np.full(n, isotopologue, dtype=np.int64),
        wavenumber_cm=lines.frequency_mhz / units.MHZ_PER_CM,
        intensity_cm=cm_per_molecule(lines.intensity_nm2_mhz) * abundance,
        einstein_a_per_s=lines.einstein_a_per_s,
        gamma_air=zero,
        gamma_self=zero,
        energy_lower_cm=lines.energy_lower_cm,
        n_air=zero,
        delta_air=zero,
        global_upper=global_upper,
        global_lower=global_lower,
        local_upper=upper,
        local_lower=lower,
        uncertainties=np.full(n, "000000"),
        references=np.full(n, " 0" * 6),
        mixing_flag=np.full(n, " "),
        g_upper=levels.degeneracy[lines.upper].astype(float),
        g_lower=levels.degeneracy[lines.lower].astype(float),
    )


def _refuse_spins(lines: Lines) -> None:
    """Raise ValueError for labels that end in F, which written as J, K would be labels of other lines."""
    if "n" in lines.levels.quanta:
        names = " ".join(lines.levels.quanta)
        raise ValueError(
            f"lines split by spins (labels {names}): records here hold J, K or Ka and Kc; leave the hyperfine structure out, or "
            "write a .cat file, which holds F"
        )


def _global_quanta(lines: Lines) -> tuple[NDArray[np.str_], NDArray[np.str_]]:
    """Names of the upper and lower states, (n,) each: those of the top's states if it has several, such as 0+ and 0-."""
    v, states = lines.levels.quanta.get("v"), lines.top.states
    if v is None or states is None:
        alike = np.full(len(lines), _ground_state(lines))
        return alike, alike
    names = np.array([states.name_of(number).rjust(15) for number in range(int(v.max()) + 1)])
    return names[v[lines.upper]], names[v[lines.lower]]


def _ground_state(lines: Lines) -> str:
    """v = 0 of a diatomic molecule, the word GROUND elsewhere: a top does not know how many modes it has."""
    molecule = lines.top.molecule
    return ("0" if molecule is not None and len(molecule.symbols) == 2 else "GROUND").rjust(15)


def _local_quanta(lines: Lines) -> tuple[NDArray[np.str_], NDArray[np.str_]]:
    """Rotational labels, (n,) each: branch and J″ of a linear molecule, J K of a symmetric, J Ka Kc of an asymmetric top."""
    upper, lower = (lines.quanta(rows) for rows in (lines.upper, lines.lower))
    if lines.levels.kind == "linear":
        branch = np.array(["P", "Q", "R"])[upper[:, 0] - lower[:, 0] + 1]
        below = [f"     {b}{j:3d}".ljust(15) for b, j in zip(branch.tolist(), lower[:, 0].tolist(), strict=True)]
        return np.full(len(lines), " " * 15), np.array(below, dtype="U15")
    return _labels(upper), _labels(lower)


def _labels(quanta: NDArray[np.int64]) -> NDArray[np.str_]:
    """Three characters for each quantum number, 15 in all, (n,)."""
    return np.array(["".join(f"{q:3d}" for q in row).ljust(15) for row in quanta.tolist()], dtype="U15")
