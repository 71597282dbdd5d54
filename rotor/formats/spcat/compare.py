"""Two catalogues side by side: which lines both have, which only one, how far they differ, and measured lines merged in."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor import units
from rotor.arrays import Floats
from rotor.formats.spcat.collapse import spin_quanta, without_spins
from rotor.formats.spcat.text.catalogue import DTYPES, Catalogue
from rotor.formats.spcat.text.fields import BLANK

Rows = NDArray[np.int64]

TWIN_MHZ = 2e-4  # lines of one label closer than this are components of one line: two digits of print
INFRARED_DECIMALS = 6
MOST_OF_SLOPE = 2000  # lines from which a temperature is judged, the strongest


def in_mhz(catalogue: Catalogue) -> tuple[Floats, Floats]:
    """Frequencies and errors in MHz, (n,) each: infrared catalogues and lines with a negative error have cm⁻¹."""
    infrared = catalogue.layout.decimals[0] == INFRARED_DECIMALS
    factor = np.where(infrared | (catalogue.error_mhz < 0), units.MHZ_PER_CM, 1.0)
    return catalogue.frequency_mhz * factor, np.abs(catalogue.error_mhz) * factor


@dataclass(frozen=True)
class Comparison:
    """Lines of two catalogues matched by quantum numbers, components of one line added on both sides.

    reference, ours: the catalogues with components added, in MHz, rising in frequency. of_reference, of_ours: rows of
    the matched lines, (m,) each. missing: rows of `reference` that ours has not, extra: rows of `ours` that the
    reference has not. other_states: lines left out because the other side has no quantum number to tell them by.
    collapsed: whether components that differ in quantum numbers of spins were added, since one side has more of these.
    """

    reference: Catalogue
    ours: Catalogue
    of_reference: Rows
    of_ours: Rows
    missing: Rows
    extra: Rows
    other_states: int
    collapsed: bool = False

    def differences(self, column: str) -> Floats:
        """Ours minus the reference in a column of `Catalogue`, (m,)."""
        ours, reference = getattr(self.ours, column), getattr(self.reference, column)
        return np.asarray(ours[self.of_ours].astype(float) - reference[self.of_reference])

    @property
    def measured(self) -> NDArray[np.bool_]:
        """Which matched lines the reference calls measured in a laboratory (a negative tag), (m,)."""
        return np.asarray(self.reference.tag[self.of_reference] < 0)


def compare(reference: Catalogue, ours: Catalogue) -> Comparison:
    """Match the lines of two catalogues by their quantum numbers, signs of K dropped.

    Where one side has more quantum numbers of spins than the other, the components of each line are added on both sides.
    Where one side has more of the others (a vibrational state, say), its lines with zeros there are compared and the rest
    counted in `other_states`. Lines of one label are matched in order of frequency.
    """
    collapsed = bool(len(reference) and len(ours)) and spin_quanta(reference) != spin_quanta(ours)
    if collapsed:
        reference, ours = (without_spins(_plain(side)) for side in (reference, ours))
    width = min(_count(reference), _count(ours))
    left, right = (_ground(side, width) for side in (reference, ours))
    others = len(reference) + len(ours) - len(left) - len(right)
    left, right = _components_added(left, width), _components_added(right, width)

    keys = _keys(left, right, width)
    _, at_left, at_right = np.intersect1d(keys.left, keys.right, assume_unique=True, return_indices=True)
    return Comparison(
        reference=left,
        ours=right,
        of_reference=at_left,
        of_ours=at_right,
        missing=np.setdiff1d(np.arange(len(left)), at_left),
        extra=np.setdiff1d(np.arange(len(right)), at_right),
        other_states=others,
        collapsed=collapsed,
    )


def within(comparison: Comparison, range_mhz: tuple[float, float], least_lgint: float) -> Comparison:
    """The comparison without extra lines outside a range of frequencies or weaker than a bound: the other list ends there."""
    ours, extra = comparison.ours, comparison.extra
    frequency, lgint = ours.frequency_mhz[extra], ours.lgint[extra]
    inside = (frequency >= range_mhz[0]) & (frequency <= range_mhz[1]) & (lgint >= least_lgint)
    return replace(comparison, extra=extra[inside])


TEMPERATURES_K = np.geomspace(1.0, 3000.0, 801)  # steps of 1 %


def likely_temperature_k(comparison: Comparison, temperature_k: float) -> float:
    """The temperature at which the intensities of the reference are most alike those of ours, which are at `temperature_k`.

    That of a grid of 1 % at which the median size of the differences of lgint from their median is least; both are those of
    exp(-E"/kT) (1 - exp(-hν/kT)) times what no temperature changes. nan where fewer than three lines are matched, or all of
    them start from one energy.
    """
    rows = comparison.of_reference[np.argsort(-comparison.reference.lgint[comparison.of_reference])[:MOST_OF_SLOPE]]
    selected = np.isin(comparison.of_reference, rows)
    energy = comparison.reference.energy_lower_cm[comparison.of_reference][selected]
    if len(energy) < 3 or np.ptp(energy) == 0:
        return float("nan")
    frequency = comparison.reference.frequency_mhz[comparison.of_reference][selected]
    off = comparison.differences("lgint")[selected]

    def populated(kelvin: Floats) -> Floats:
        at = units.MHZ_PER_K * kelvin[:, None]
        log = -energy * units.MHZ_PER_CM / at + np.log(-np.expm1(-frequency / at))
        return np.asarray(log / np.log(10.0))

    change = off + populated(TEMPERATURES_K) - populated(np.array([temperature_k]))
    spread = np.median(np.abs(change - np.median(change, axis=1)[:, None]), axis=1)
    return float(TEMPERATURES_K[np.argmin(spread)])


def _count(catalogue: Catalogue) -> int:
    return int((catalogue.qnfmt % 10).max(initial=0)) or catalogue.quanta_upper.shape[1]


def _ground(catalogue: Catalogue, width: int) -> Catalogue:
    """The lines whose quantum numbers beyond `width` are zero or blank, frequencies and errors in MHz."""
    beyond = np.concatenate([catalogue.quanta_upper[:, width:], catalogue.quanta_lower[:, width:]], axis=1)
    return _plain(catalogue.take(((beyond == 0) | (beyond == BLANK)).all(axis=1)))


def _plain(catalogue: Catalogue) -> Catalogue:
    """Frequencies and errors in MHz."""
    frequency, error = in_mhz(catalogue)
    plain = replace(catalogue.layout, decimals=(4, 4, 4, 4), spelling={})
    return replace(catalogue, frequency_mhz=frequency, error_mhz=error, layout=plain)


def _labels(catalogue: Catalogue, width: int) -> NDArray[np.int64]:
    """|quantum numbers| of upper and lower state, (n, 2 width)."""
    both = [catalogue.quanta_upper[:, :width], catalogue.quanta_lower[:, :width]]
    return np.abs(np.concatenate(both, axis=1).astype(np.int64))


def _components_added(catalogue: Catalogue, width: int) -> Catalogue:
    """Lines of one label and one frequency as one, intensities and degeneracies added, rising in frequency."""
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
    with np.errstate(divide="ignore"):
        summed = np.where(added > 0, np.log10(added) + strongest, merged.lgint)
    alone = np.diff(np.append(first, len(order))) == 1
    degeneracy = np.add.reduceat(catalogue.g_upper[order], first)
    merged = replace(merged, lgint=np.where(alone, merged.lgint, summed), g_upper=degeneracy.astype(np.int32))
    return merged.take(np.argsort(merged.frequency_mhz, kind="stable"))


class _Keys(NamedTuple):
    left: Rows
    right: Rows


def _keys(left: Catalogue, right: Catalogue, width: int) -> _Keys:
    """One number for each line: of its label, and of its place among the lines with that label."""
    labels = np.concatenate([_labels(left, width), _labels(right, width)])
    _, code = np.unique(labels, axis=0, return_inverse=True)
    code = code.reshape(-1).astype(np.int64)
    places = [_place_within(code[: len(left)]), _place_within(code[len(left) :])]
    most = 1 + max((int(p.max(initial=0)) for p in places), default=0)
    return _Keys(code[: len(left)] * most + places[0], code[len(left) :] * most + places[1])


def _place_within(code: Rows) -> Rows:
    """How many earlier lines have the same code, (n,)."""
    order = np.argsort(code, kind="stable")
    ordered = code[order]
    begins = np.flatnonzero(np.concatenate(([True], np.diff(ordered) != 0))) if len(code) else np.zeros(0, np.int64)
    place = np.empty(len(code), dtype=np.int64)
    place[order] = np.arange(len(code)) - np.repeat(begins, np.diff(np.append(begins, len(code))))
    return place


class Agreement(NamedTuple):
    """How well a prediction meets measured lines: their number, median and rms of |obs - calc|, share within 3 σ.

    no_error: lines whose file gives an error of 0; they count in the median, not in the share.
    """

    lines: int
    median_mhz: float
    rms_mhz: float
    within_3_sigma: float
    no_error: int


def agreement(comparison: Comparison, chosen: NDArray[np.bool_] | None = None) -> Agreement:
    """How the prediction meets the measured lines of the reference, all or those `chosen` of the matched ones, (m,)."""
    seen = comparison.measured if chosen is None else comparison.measured & chosen
    off = np.abs(comparison.differences("frequency_mhz"))[seen]
    sigma = comparison.reference.error_mhz[comparison.of_reference][seen]
    if not len(off):
        return Agreement(0, float("nan"), float("nan"), float("nan"), 0)
    known = sigma > 0
    share = float(np.mean(off[known] <= 3 * sigma[known])) if known.any() else float("nan")
    rms = float(np.sqrt(np.mean(off**2)))
    return Agreement(len(off), float(np.median(off)), rms, share, int(np.count_nonzero(~known)))


def with_measured_lines(predicted: Catalogue, measured: Catalogue) -> Catalogue:
    """The predicted lines, those with a measured line of the same label (a negative tag) taking frequency and error of it.

    Both components of a K doublet take the frequency of the one measured line. The tag becomes negative, as in the
    catalogues of JPL and CDMS; sorted anew. Measured lines that are not predicted are left out.
    """
    width = min(_count(predicted), _count(measured))
    seen = _ground(measured, width)
    seen = seen.take(seen.tag < 0)
    labels = np.concatenate([_labels(predicted, width), _labels(seen, width)])
    _, code = np.unique(labels, axis=0, return_inverse=True)
    code = code.reshape(-1)
    of_predicted, of_seen = code[: len(predicted)], code[len(predicted) :]
    _, once, times = np.unique(of_seen, return_index=True, return_counts=True)
    if (times > 1).any():  # several measured lines of one label: they must be one frequency
        _refuse_two_frequencies(seen, of_seen)

    source = np.full(int(code.max(initial=-1)) + 1, -1)
    source[of_seen[once]] = once
    row = source[of_predicted]
    found = row >= 0
    columns: dict[str, Any] = {name: getattr(predicted, name).copy() for name in DTYPES}
    columns["frequency_mhz"][found] = seen.frequency_mhz[row[found]]
    columns["error_mhz"][found] = seen.error_mhz[row[found]]
    columns["tag"][found] = -np.abs(columns["tag"][found])
    merged = replace(predicted, **columns, layout=replace(predicted.layout, spelling={}))
    return merged.take(np.argsort(merged.frequency_mhz, kind="stable"))


def _refuse_two_frequencies(seen: Catalogue, code: Rows) -> None:
    order = np.lexsort((seen.frequency_mhz, code))
    apart = (np.diff(code[order]) == 0) & (np.diff(seen.frequency_mhz[order]) > TWIN_MHZ)
    if apart.any():
        one, two = order[np.argmax(apart)], order[np.argmax(apart) + 1]
        raise ValueError(
            f"measured lines at {seen.frequency_mhz[one]} and {seen.frequency_mhz[two]} MHz have one label; "
            "give the quantum number that distinguishes them, or one of them"
        )
