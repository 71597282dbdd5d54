"""Lines of a catalogue as columns of numbers, and the layout of its text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.formats.spcat.text.fields import BLANK
from rotor.formats.spcat.text.rows import Columns
from rotor.frozen import dataclass
from rotor.table import Table

MAX_TAG = 999_999
WIDE_MHZ = 99999999.0  # from here on FREQ has three decimals, and ERR and LGINT with it


@dataclass(frozen=True)
class Layout:
    """Layout of a catalogue's text, so that it is written as it was read.

    line_length: characters of a line without its end; None for those of the field's program, 80, or 55 and four for
    each quantum number of a state where there are more than six.
    newline: the end of a line.
    decimals: of FREQ, ERR, LGINT and ELO; (6, 6, 4, 4) in infrared catalogues, whose FREQ is in cm⁻¹.
    spelling: text of the lines, by index, that are not as they would be written from their numbers: dropped zeros,
    other decimals, comments, blank lines before. It is used only while it still says the numbers of the line.
    beginning, ending: what stands before the first line, such as a byte-order mark, and after the last.
    """

    line_length: int | None = None
    newline: bytes = b"\n"
    decimals: tuple[int, int, int, int] = (4, 4, 4, 4)
    spelling: Mapping[int, bytes] = field(default_factory=dict)
    beginning: bytes = b""
    ending: bytes = b""


# the type of each of the columns; annotations cannot be asked for it in every release of numpy
DTYPES: dict[str, type[np.generic]] = dict.fromkeys(Columns._fields, np.float64) | {
    "dr": np.int16,
    "g_upper": np.int32,
    "tag": np.int32,
    "qnfmt": np.int32,
    "quanta_upper": np.int16,
    "quanta_lower": np.int16,
}


@dataclass(frozen=True, eq=False, repr=False)
class Catalogue(Table):
    """Lines of a catalogue as columns of equal length n.

    frequency_mhz, error_mhz (n,): FREQ and ERR as the file has them: MHz, but cm⁻¹ both where the error is negative
    and in infrared catalogues (six decimals in `layout`); errors beyond 999.9999 are written so. lgint (n,): log10 of
    the intensity in nm² MHz. dr (n,): degrees of freedom of rotation in Q, 0, 2 or 3. energy_lower_cm (n,): cm⁻¹.
    g_upper (n,): degeneracy of the upper state. tag (n,): the species; negative for a line measured in a laboratory,
    whose frequency and error are then the laboratory's. qnfmt (n,): what the quantum numbers are, its last digit how
    many. quanta_upper, quanta_lower (n, 6) or wider; -32768 is blank.

    Source: Pickett, Poynter, Cohen, Delitsky, Pearson, Müller, J. Quant. Spectrosc. Radiat. Transf. 60, 883 (1998).
    """

    frequency_mhz: NDArray[np.float64]
    error_mhz: NDArray[np.float64]
    lgint: NDArray[np.float64]
    dr: NDArray[np.int16]
    energy_lower_cm: NDArray[np.float64]
    g_upper: NDArray[np.int32]
    tag: NDArray[np.int32]
    qnfmt: NDArray[np.int32]
    quanta_upper: NDArray[np.int16]
    quanta_lower: NDArray[np.int16]
    layout: Layout = Layout()

    def __post_init__(self) -> None:
        for name, dtype in DTYPES.items():
            object.__setattr__(self, name, _column(name, getattr(self, name), dtype))
        lengths = {name: len(getattr(self, name)) for name in DTYPES}
        if len(set(lengths.values())) > 1:
            raise ValueError(f"columns of a catalogue must be equally long, not {lengths}")
        if self.quanta_upper.shape[1] != self.quanta_lower.shape[1] or self.quanta_upper.shape[1] < 6:
            raise ValueError(
                f"quanta_upper {self.quanta_upper.shape} and quanta_lower {self.quanta_lower.shape} must have the same "
                f"number of columns, 6 or more; {BLANK} fills those without a quantum number"
            )

    def __len__(self) -> int:
        return len(self.frequency_mhz)

    def take(self, index: NDArray[Any] | slice) -> Catalogue:
        """The lines that a slice, a mask or an array of positions picks, in that order, with their spelling."""
        picked = np.arange(len(self))[index]
        spelled = self.layout.spelling
        spelling = {i: spelled[old] for i, old in enumerate(picked.tolist()) if old in spelled} if spelled else spelled
        columns = {name: getattr(self, name)[index] for name in DTYPES}
        return Catalogue(**columns, layout=replace(self.layout, spelling=spelling))

    def rows(self, start: int, stop: int) -> Columns:
        """The numbers of lines `start` to `stop`."""
        return Columns._make(getattr(self, name)[start:stop] for name in DTYPES)

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Every column by its name with unit, the quantum numbers last, one column each: q1_upper, ..., q6_lower."""
        out = {name: getattr(self, name) for name in DTYPES if not name.startswith("quanta")}
        for side, quanta in (("upper", self.quanta_upper), ("lower", self.quanta_lower)):
            out |= {f"q{i}_{side}": column for i, column in enumerate(quanta.T, 1) if (column != BLANK).any()}
        return out

    def record(self, index: int) -> Columns:
        """The numbers of one line."""
        values = [getattr(self, name)[index] for name in DTYPES]
        return Columns._make(tuple(value.tolist()) if value.ndim else value.item() for value in values)


def predicted_catalogue(
    numbers: Mapping[str, NDArray[Any]],
    quanta_upper: NDArray[np.int16],
    quanta_lower: NDArray[np.int16],
    qnfmt: NDArray[np.int32] | int,
    tag: int = 0,
    *,
    linear: bool = False,
) -> Catalogue:
    """The catalogue of predicted lines.

    numbers: frequency_mhz, lgint, energy_lower_cm, g_upper, each (n,), and error_mhz (0 if unknown). quanta_upper, quanta_lower (n, 6):
    quantum numbers of both states. qnfmt (n,): format of the quantum numbers, for all lines or each. tag: tag of the species. linear:
    whether Q rises as for a linear molecule, DR = 2.
    Raises ValueError for a tag of more than six digits.
    """
    if not 0 <= tag <= MAX_TAG:
        raise ValueError(f"tag {tag}: a catalogue's tag has at most six digits")
    n = len(quanta_upper)
    return Catalogue(
        frequency_mhz=numbers["frequency_mhz"],
        error_mhz=numbers["error_mhz"] if "error_mhz" in numbers else np.zeros(n),
        lgint=numbers["lgint"],
        dr=np.full(n, 2 if linear else 3, dtype=np.int16),
        energy_lower_cm=numbers["energy_lower_cm"],
        g_upper=np.asarray(numbers["g_upper"]).astype(np.int32),
        tag=np.full(n, tag, dtype=np.int32),
        qnfmt=np.broadcast_to(np.asarray(qnfmt, dtype=np.int32), n),
        quanta_upper=quanta_upper,
        quanta_lower=quanta_lower,
    )


def _column(name: str, values: Any, dtype: type[np.generic]) -> NDArray[Any]:
    """The column in its type; ValueError for a wrong shape or values that would change."""
    array = np.asarray(values)
    axes = 2 if name.startswith("quanta") else 1
    if array.ndim != axes:
        raise ValueError(f"{name} has shape {array.shape}; expected shape {'(n, 6)' if axes == 2 else '(n,)'}")
    if array.dtype == dtype:
        return array
    with np.errstate(invalid="ignore"):
        column = array.astype(dtype)
    if np.issubdtype(dtype, np.integer) and not np.array_equal(column, array):
        wrong = array[column != array].flat[0]
        raise ValueError(f"{name} holds {wrong!r}; expected whole numbers that fit {np.dtype(dtype).name}")
    return column
