"""Comparison of two catalogues: common and missing lines, differences, and merging of measured lines; their error budget.

Lines that differ only in spin quantum numbers are merged where one catalogue has no spins: intensities are added; frequency, its error and
the energy are means weighted by intensity. First-order splittings leave this centre at the unsplit line: strengths summed over the
components of the other level are proportional to 2F + 1, and Σ (2F + 1) ΔE(F) is the trace of the coupling over the spins, which is 0.
The error budget of frequencies (`rotor.requests.budget`) has the printed decimals and the stated errors.
QNFMT = 100 Q + 10 H + NQN gives the number of spin quantum numbers: the last digit of Q counts all others.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor import units
from rotor.arrays import Floats
from rotor.formats.spcat.text.catalogue import DTYPES, WIDE_MHZ, Catalogue
from rotor.formats.spcat.text.fields import BLANK
from rotor.requests.budget import ROUNDING, ErrorBudget, ErrorTerm

Rows = NDArray[np.int64]

TWIN_MHZ = 2e-4  # lines of one label closer than this are components of one line: two digits of print
INFRARED_DECIMALS = 6
MOST_OF_SLOPE = 2000  # number of strongest lines from which a temperature is estimated
STRONG = 0.1  # weaker lines, relative to the strongest, are ignored in the error budget
MODEL = ErrorTerm(None, "a catalogue does not say what its lines leave out")


def in_mhz(catalogue: Catalogue) -> tuple[Floats, Floats]:
    """Frequencies and errors in MHz, (n,) each; infrared catalogues and lines with a negative error are in cm⁻¹."""
    infrared = catalogue.layout.decimals[0] == INFRARED_DECIMALS
    # infrared catalogues and negative errors are in cm⁻¹
    factor = np.where(infrared | (catalogue.error_mhz < 0), units.MHZ_PER_CM, 1.0)
    return catalogue.frequency_mhz * factor, np.abs(catalogue.error_mhz) * factor


@dataclass(frozen=True)
class Comparison:
    """Lines of two catalogues matched by quantum numbers, with components of a line merged in both.

    reference, ours: the catalogues with components added, in MHz, rising in frequency. reference_rows, our_rows: rows of
    the matched lines, (m,) each. missing: unmatched rows of `reference`. extra: unmatched rows of `ours`. other_states: lines left out
    because the other catalogue lacks the quantum number that identifies them. collapsed: whether hyperfine components were merged, since
    one catalogue has more spin quantum numbers.
    """

    reference: Catalogue
    ours: Catalogue
    reference_rows: Rows
    our_rows: Rows
    missing: Rows
    extra: Rows
    other_states: int
    collapsed: bool = False

    def differences(self, column: str) -> Floats:
        """Ours minus the reference in a column of `Catalogue`, (m,)."""
        ours, reference = getattr(self.ours, column), getattr(self.reference, column)
        return np.asarray(ours[self.our_rows].astype(float) - reference[self.reference_rows])

    @property
    def measured(self) -> NDArray[np.bool_]:
        """Whether the reference marks each matched line as measured in a laboratory (negative tag), (m,)."""
        return np.asarray(self.reference.tag[self.reference_rows] < 0)


def compare(reference: Catalogue, ours: Catalogue) -> Comparison:
    """Match the lines of two catalogues by their quantum numbers, without signs of K.

    If one catalogue has more spin quantum numbers, hyperfine components are merged in both. If it has more of the others (such as a
    vibrational state), only its lines with zeros there are compared and `other_states` counts the rest. Lines with equal labels are matched
    in order of frequency.
    """
    collapsed = bool(len(reference) and len(ours)) and spin_quanta(reference) != spin_quanta(ours)
    if collapsed:
        reference, ours = (without_spins(_plain(side)) for side in (reference, ours))
    width = min(_count(reference), _count(ours))
    left, right = (_ground(side, width) for side in (reference, ours))
    others = len(reference) + len(ours) - len(left) - len(right)
    left, right = _components_added(left, width), _components_added(right, width)

    keys, our_keys = _keys(left, right, width)
    _, at_left, at_right = np.intersect1d(keys, our_keys, assume_unique=True, return_indices=True)
    return Comparison(
        reference=left,
        ours=right,
        reference_rows=at_left,
        our_rows=at_right,
        missing=np.setdiff1d(np.arange(len(left)), at_left),
        extra=np.setdiff1d(np.arange(len(right)), at_right),
        other_states=others,
        collapsed=collapsed,
    )


def within(comparison: Comparison, range_mhz: tuple[float, float], least_lgint: float) -> Comparison:
    """The comparison without extra lines outside a range of frequencies or below an intensity, where the reference ends."""
    ours, extra = comparison.ours, comparison.extra
    frequency, lgint = ours.frequency_mhz[extra], ours.lgint[extra]
    inside = (frequency >= range_mhz[0]) & (frequency <= range_mhz[1]) & (lgint >= least_lgint)
    return replace(comparison, extra=extra[inside])


TEMPERATURES_K = np.geomspace(1.0, 3000.0, 801)  # steps of 1 %


def likely_temperature_k(comparison: Comparison, temperature_k: float) -> float:
    """The temperature at which intensities of the reference agree best with ours at `temperature_k`.

    That of a grid of 1 % at which the median size of the differences of lgint from their median is least; both are those of
    exp(-E"/kT) (1 - exp(-hν/kT)) times what no temperature changes. nan where fewer than three lines are matched, or all of
    them start from one energy.
    """
    rows = comparison.reference_rows[np.argsort(-comparison.reference.lgint[comparison.reference_rows])[:MOST_OF_SLOPE]]
    selected = np.isin(comparison.reference_rows, rows)
    energy = comparison.reference.energy_lower_cm[comparison.reference_rows][selected]
    if len(energy) < 3 or np.ptp(energy) == 0:  # a temperature needs lines from different energies
        return float("nan")
    frequency = comparison.reference.frequency_mhz[comparison.reference_rows][selected]
    off = comparison.differences("lgint")[selected]

    def populated(kelvin: Floats) -> Floats:
        at = units.MHZ_PER_K * kelvin[:, None]
        # ln of exp(-E/kT) (1 - exp(-hν/kT)), exact for small hν/kT
        log = -energy * units.MHZ_PER_CM / at + np.log(-np.expm1(-frequency / at))
        return np.asarray(log / np.log(10.0))

    change = off + populated(TEMPERATURES_K) - populated(np.array([temperature_k]))
    # the spread about the median, which lines with other causes do not move
    spread = np.median(np.abs(change - np.median(change, axis=1)[:, None]), axis=1)
    return float(TEMPERATURES_K[np.argmin(spread)])


def _count(catalogue: Catalogue) -> int:
    """Number of quantum numbers of a state."""
    return int((catalogue.qnfmt % 10).max(initial=0)) or catalogue.quanta_upper.shape[1]


def _ground(catalogue: Catalogue, width: int) -> Catalogue:
    """The lines whose quantum numbers beyond `width` are zero or blank, with frequencies and errors in MHz."""
    beyond = np.concatenate([catalogue.quanta_upper[:, width:], catalogue.quanta_lower[:, width:]], axis=1)
    return _plain(catalogue.take(((beyond == 0) | (beyond == BLANK)).all(axis=1)))


def _plain(catalogue: Catalogue) -> Catalogue:
    """The catalogue with frequencies and errors in MHz."""
    frequency, error = in_mhz(catalogue)
    plain = replace(catalogue.layout, decimals=(4, 4, 4, 4), spelling={})
    return replace(catalogue, frequency_mhz=frequency, error_mhz=error, layout=plain)


def _labels(catalogue: Catalogue, width: int) -> NDArray[np.int64]:
    """|quantum numbers| of upper and lower state, (n, 2 width)."""
    both = [catalogue.quanta_upper[:, :width], catalogue.quanta_lower[:, :width]]
    return np.abs(np.concatenate(both, axis=1).astype(np.int64))


def _components_added(catalogue: Catalogue, width: int) -> Catalogue:
    """Merge lines of equal label and frequency: intensities and degeneracies are added, lines rise in frequency."""
    if not len(catalogue):
        return catalogue
    labels = _labels(catalogue, width)
    order = np.lexsort((catalogue.frequency_mhz, *labels.T))
    same_label = (np.diff(labels[order], axis=0) == 0).all(axis=1)
    twins = same_label & (np.diff(catalogue.frequency_mhz[order]) < TWIN_MHZ)
    first = np.flatnonzero(np.concatenate(([True], ~twins)))

    merged = catalogue.take(order[first])
    strongest = catalogue.lgint.max()  # scaled, so that lines of 1e-100 keep their digits
    added = np.add.reduceat(10.0 ** (catalogue.lgint[order] - strongest), first)
    with np.errstate(divide="ignore"):  # no strength at all: the logarithm of the merged line remains
        summed = np.where(added > 0, np.log10(added) + strongest, merged.lgint)
    alone = np.diff(np.append(first, len(order))) == 1  # a single component keeps its printed digits
    degeneracy = np.add.reduceat(catalogue.g_upper[order], first)
    merged = replace(merged, lgint=np.where(alone, merged.lgint, summed), g_upper=degeneracy.astype(np.int32))
    return merged.take(np.argsort(merged.frequency_mhz, kind="stable"))


def _numbered(*tables: NDArray[Any]) -> list[Rows]:
    """An integer for each row of tables of labels, equal for equal labels."""
    _, code = np.unique(np.concatenate(tables), axis=0, return_inverse=True)
    ends = np.cumsum([len(table) for table in tables])[:-1]
    return np.split(code.reshape(-1).astype(np.int64), ends)


def _keys(left: Catalogue, right: Catalogue, width: int) -> list[Rows]:
    """An integer for each line of both catalogues, from its label and its place among lines with this label."""
    codes, places = _numbered(_labels(left, width), _labels(right, width)), []
    for code in codes:
        order = np.argsort(code, kind="stable")  # stable: rows of one label keep their order
        place = np.empty(len(code), dtype=np.int64)
        place[order] = np.arange(len(code)) - np.searchsorted(code[order], code[order])
        places.append(place)
    most = 1 + max(int(place.max(initial=0)) for place in places)
    return [code * most + place for code, place in zip(codes, places, strict=True)]


class Agreement(NamedTuple):
    """Agreement of a prediction with measured lines: their number, median and rms of |obs - calc|, share within 3 σ.

    no_error: number of lines with a stated error of 0; they count in the median, not in the share.
    """

    lines: int
    median_mhz: float
    rms_mhz: float
    within_3_sigma: float
    no_error: int


def agreement(comparison: Comparison, chosen: NDArray[np.bool_] | None = None) -> Agreement:
    """Agreement with the measured lines of the reference: all, or those `chosen` among the matched ones, (m,)."""
    seen = comparison.measured if chosen is None else comparison.measured & chosen
    off = np.abs(comparison.differences("frequency_mhz"))[seen]
    sigma = comparison.reference.error_mhz[comparison.reference_rows][seen]  # an error of 0 states none
    if not len(off):
        return Agreement(0, float("nan"), float("nan"), float("nan"), 0)
    has_error = sigma > 0
    share = float(np.mean(off[has_error] <= 3 * sigma[has_error])) if has_error.any() else float("nan")
    rms = float(np.sqrt(np.mean(off**2)))
    return Agreement(len(off), float(np.median(off)), rms, share, int(np.count_nonzero(~has_error)))


def with_measured_lines(predicted: Catalogue, measured: Catalogue) -> Catalogue:
    """The predicted lines, with frequency and error of measured lines (negative tag) of equal label.

    Both components of a K doublet take the frequency of a single measured line. The tag becomes negative, as in the catalogues of JPL and
    CDMS, and lines are sorted again. Measured lines that are not predicted are left out.
    """
    width = min(_count(predicted), _count(measured))
    seen = _ground(measured, width)
    seen = seen.take(seen.tag < 0)
    predicted_code, seen_code = _numbered(_labels(predicted, width), _labels(seen, width))
    _, once, times = np.unique(seen_code, return_index=True, return_counts=True)
    if (times > 1).any():  # several measured lines of one label: they must be one frequency
        _refuse_two_frequencies(seen, seen_code)

    source = np.full(1 + max(int(code.max(initial=-1)) for code in (predicted_code, seen_code)), -1)
    source[seen_code[once]] = once
    row = source[predicted_code]
    is_measured = row >= 0
    columns: dict[str, Any] = {name: getattr(predicted, name).copy() for name in DTYPES}
    columns["frequency_mhz"][is_measured] = seen.frequency_mhz[row[is_measured]]
    columns["error_mhz"][is_measured] = seen.error_mhz[row[is_measured]]
    columns["tag"][is_measured] = -np.abs(columns["tag"][is_measured])  # a negative tag marks a measured line
    merged = replace(predicted, **columns, layout=replace(predicted.layout, spelling={}))
    return merged.take(np.argsort(merged.frequency_mhz, kind="stable"))


def _refuse_two_frequencies(seen: Catalogue, code: Rows) -> None:
    """Raise ValueError for measured lines of equal label and different frequencies."""
    order = np.lexsort((seen.frequency_mhz, code))
    apart = (np.diff(code[order]) == 0) & (np.diff(seen.frequency_mhz[order]) > TWIN_MHZ)
    if apart.any():
        first, second = order[np.argmax(apart)], order[np.argmax(apart) + 1]
        raise ValueError(
            f"measured lines at {seen.frequency_mhz[first]} and {seen.frequency_mhz[second]} MHz have one label; "
            "give the quantum number that distinguishes them, or one of them"
        )


def spin_quanta(catalogue: Catalogue) -> int:
    """The largest number of spin quantum numbers of a state in a catalogue.

    >>> from rotor.formats.spcat.text.cat import read_cat
    >>> spin_quanta(read_cat(b"   26164.4901  0.0010 -5.8078 3   -0.0000  8  52009 213 1 0 2       0 0 2       \\n"))
    1
    """
    return int(_spin_counts(catalogue).max(initial=0))


def _spin_counts(catalogue: Catalogue) -> NDArray[np.int64]:
    """Number of spin quantum numbers of each line."""
    count, before = catalogue.qnfmt % 10, catalogue.qnfmt // 100 % 10
    # codes without a count of rotational quantum numbers name no spins
    return np.where(before > 0, np.maximum(count - before, 0), 0).astype(np.int64)


def without_spins(catalogue: Catalogue) -> Catalogue:
    """The lines without spin quantum numbers, with components merged, rising in frequency.

    A merged line is measured (negative tag) if all its components are. Its degeneracy is the sum over components, not that of the upper
    state, and must not be compared. Frequencies must be in MHz.
    """
    spin_count = _spin_counts(catalogue)
    count = catalogue.qnfmt % 10
    place = np.arange(catalogue.quanta_upper.shape[1])
    dropped = (place >= (count - spin_count)[:, None]) & (place < count[:, None])
    upper, lower = (
        np.where(dropped, np.int16(BLANK), side) for side in (catalogue.quanta_upper, catalogue.quanta_lower)
    )
    (code,) = _numbered(np.concatenate([upper, lower], axis=1))
    _, first = np.unique(code, return_index=True)
    weight = 10.0 ** (catalogue.lgint - catalogue.lgint.max(initial=-np.inf))  # scaled: no sum overflows
    total = np.bincount(code, weight)

    def mean(column: NDArray[np.float64]) -> NDArray[np.float64]:
        origin = column[first]  # differences are averaged, so that frequencies keep their digits
        return np.asarray(origin + np.bincount(code, weight * (column - origin[code])) / total)

    measured = np.bincount(code, catalogue.tag >= 0) == 0
    out = replace(
        catalogue.take(first),
        frequency_mhz=mean(catalogue.frequency_mhz),
        error_mhz=mean(catalogue.error_mhz),
        energy_lower_cm=mean(catalogue.energy_lower_cm),
        # relative to the strongest line, so that weak lines keep their digits
        lgint=np.log10(total) + catalogue.lgint.max(initial=-np.inf),
        g_upper=np.bincount(code, catalogue.g_upper).astype(np.int32),
        # a negative tag: at least one component was measured
        tag=np.where(measured, -1, 1) * np.abs(catalogue.tag[first]),
        qnfmt=(catalogue.qnfmt - 10 * (catalogue.qnfmt // 10 % 10) - spin_count)[first],
        quanta_upper=upper[first],
        quanta_lower=lower[first],
    )
    # stable: lines of one frequency keep the order of the file
    return out.take(np.argsort(out.frequency_mhz, kind="stable"))


def catalogue_budget(lines: Catalogue) -> ErrorBudget:
    """The errors of printed frequencies, for lines above a tenth of the strongest.

    >>> j = np.full((1, 6), -32768)
    >>> line = Catalogue([115271.2018], [0.0005], [-5.0], [2], [0.0], [3], [28503], [101], j, j)
    >>> catalogue_budget(line).line()
    'errors of frequencies: data 0.0005 MHz (errors of the file), numerical 5e-05 MHz, left out not estimated: a catalogue does not say \
what its lines leave out'
    """
    frequency, error = in_mhz(lines)
    decimals = lines.layout.decimals[0]
    if decimals == 4 and lines.frequency_mhz.max(initial=0.0) >= WIDE_MHZ:
        decimals = 3
    per_unit = units.MHZ_PER_CM if bool(len(lines)) and frequency[0] != lines.frequency_mhz[0] else 1.0
    # half of the last printed digit
    rounding = ErrorTerm(0.5 * 10.0**-decimals * per_unit, f"{decimals} decimals are printed")
    return listed_budget(rounding, error, lines.lgint)


def stored_budget(frequency_mhz: Floats, error_mhz: Floats, lgint: Floats) -> ErrorBudget:
    """The errors of frequencies stored in double precision."""
    rounding = ErrorTerm(ROUNDING * float(frequency_mhz.max(initial=0.0)), "double precision")
    return listed_budget(rounding, error_mhz, lgint)


def listed_budget(rounding: ErrorTerm, error_mhz: Floats, lgint: Floats) -> ErrorBudget:
    """The errors of frequencies of lines with stated errors (n,) and log10 intensities (n,)."""
    return ErrorBudget(
        of="frequencies",
        unit="MHz",
        rounding=rounding,
        truncation=ErrorTerm(0.0, "nothing is computed"),
        model=MODEL,
        data=_stated(error_mhz, lgint),
        statistics=ErrorTerm(0.0, "nothing is sampled"),
    )


def _stated(error_mhz: Floats, lgint: Floats) -> ErrorTerm:
    """The largest error of strong lines; not estimated if one of them has no error."""
    if not len(error_mhz):
        return ErrorTerm(None, "there is no line")
    errors = error_mhz[lgint >= lgint.max() + np.log10(STRONG)]  # lgint is a logarithm: a tenth is one less
    stated = errors[np.isfinite(errors) & (errors > 0)]
    if len(stated) < len(errors):
        others = f"; the largest of the others is {stated.max():.2g} MHz" if len(stated) else ""
        return ErrorTerm(None, f"{len(errors) - len(stated)} of {len(errors)} strong lines have no error{others}")
    return ErrorTerm(float(errors.max()), "errors of the file; largest of the lines above a tenth of the strongest")
