"""The selection of lines of a catalogue for `rotor cat`, and their comparison with another list: its temperature and range."""

from __future__ import annotations

import json
import math
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from rotor.checks import NoAnswerError
from rotor.formats.spcat.compare import Comparison, agreement, compare, in_mhz, likely_temperature_k, within
from rotor.formats.spcat.text.cat import read_cat
from rotor.formats.spcat.text.catalogue import Catalogue
from rotor.formats.spcat.text.fields import BLANK
from rotor.frozen import dataclass
from rotor.requests.field import OUTPUT, REQUIRED, changed_fields, declared
from rotor.requests.readers import INFINITE, Flag, Names, Quantity, Range, Text, Whole
from rotor.table import counted
from rotor.verbs.molecule import with_some_dipole
from rotor.verbs.subjects import top_of_word
from rotor.verbs.verb import Note

FORMAT_K = 300.0  # intensities of the 80-column format are those at 300 K
DIFFERENCES = ("frequency_mhz", "lgint", "energy_lower_cm")
COMPARED = "Comparison"
UNLIKE = 0.05  # relative difference of temperatures above which a note is given


@dataclass(frozen=True)
class CatRequest:
    """The selection of lines, and the list for a comparison."""

    file: str = declared(REQUIRED, Text(metavar="FILE"), "Catalogue (.cat, .cat.gz)", option="FILE")
    range_mhz: tuple[float, float] = declared(
        INFINITE, Range("MHz"), "First and last frequency (MHz)", option="--range"
    )
    min_lgint: float | None = declared(
        None, Quantity(least=-300, most=300), "Least log10 of the intensity in nm² MHz", none="none"
    )
    measured: str | None = declared(None, Text(metavar="FILE"), "Catalogue whose measured lines are merged in")
    compare: str | None = declared(
        None,
        Text(metavar="OTHER"),
        "List for a comparison: another .cat, an .int, or a molecule to predict",
        panel=COMPARED,
    )
    temperature: float | None = declared(
        None,
        Quantity("K", above=0, metavar="T"),
        "Temperature of the intensities in FILE, for a molecule (K; by default what FILE says, else 300)",
        panel=COMPARED,
    )
    isotope: tuple[str, ...] = declared(
        (),
        Names("1=2H"),
        "Another isotope of the molecule to predict, by atom number or element; repeatable",
        panel=COMPARED,
    )
    as_spcat: bool = declared(
        False,
        Flag(),
        "Predict the .int as SPCAT does, also where SPCAT errs (see rotor spectrum)",
        panel=COMPARED,
    )
    full_basis: bool = declared(
        False,
        Flag(),
        "Predict the .int with every K in the basis, ignoring KNMIN and KNMAX",
        panel=COMPARED,
    )
    top_lines: int = declared(20, Whole(0), "Number of lines shown", option="--top", panel=OUTPUT)

    def __post_init__(self) -> None:
        """Check that options of a predicted molecule or of an .int file have such a file or molecule."""
        other = (self.compare or "").lower()
        if not other.endswith(".int"):
            for field in changed_fields(self, ("as_spcat", "full_basis")):
                raise ValueError(f"{field.name}: expected with --compare and an .int file to predict")
        if not other or other.endswith((".cat", ".cat.gz", ".int")):
            for field in changed_fields(self, ("temperature", "isotope")):
                raise ValueError(f"{field.name}: expected with --compare and a molecule to predict; a file has its own")

    def chosen(self, lines: Catalogue) -> Catalogue:
        """The lines in the range and above the intensity cut."""
        frequency, _ = in_mhz(lines)
        least = -np.inf if self.min_lgint is None else self.min_lgint
        return lines.take((frequency >= self.range_mhz[0]) & (frequency <= self.range_mhz[1]) & (lines.lgint >= least))


@dataclass(frozen=True)
class Compared:
    """Two lists side by side; for a predicted molecule, its temperature and the source of that temperature."""

    comparison: Comparison
    temperature_k: float | None = None
    temperature_source: str | None = None

    @cached_property
    def likely_temperature_k(self) -> float:
        """The temperature (K) at which the intensities agree best; nan if they do not determine it."""
        return likely_temperature_k(self.comparison, self.temperature_k or FORMAT_K)


def beside(lines: Catalogue, request: CatRequest, note: Note) -> Compared:
    """Compare the lines of a file with those of OTHER."""
    other = request.compare or ""
    if not len(lines):
        raise NoAnswerError("--compare: no lines are left to compare")
    if other.lower().endswith((".cat", ".cat.gz")):
        return Compared(compare(lines, request.chosen(read_catalogue(other))))
    if other.lower().endswith(".int"):
        from rotor.formats.spcat.predict import predict_file

        prediction = predict_file(other, as_spcat=request.as_spcat, full_basis=request.full_basis)
        for text in prediction.notes:
            note(text)
        return Compared(compare(lines, request.chosen(prediction.catalogue)))
    kelvin, source = temperature_of(request.file, request.temperature)
    comparison = compare(lines, request.chosen(predicted(lines, request, kelvin, note)))
    reference = comparison.reference
    range_mhz = (float(reference.frequency_mhz.min()), float(reference.frequency_mhz.max()))
    return Compared(within(comparison, range_mhz, float(reference.lgint.min())), kelvin, source)


def read_catalogue(path: str) -> Catalogue:
    """Read a catalogue; ValueError for another kind of file."""
    if not path.lower().endswith((".cat", ".cat.gz")):
        raise ValueError(f"{path}: expected a catalogue, .cat or .cat.gz")
    return read_cat(path)


def temperature_of(file: str, option: float | None) -> tuple[float, str]:
    """Temperature of a catalogue's intensities (K) and its source: the option, the provenance file, or the format."""
    if option is not None:
        return option, "given (--temperature)"
    provenance = Path(f"{file}.provenance.json")
    if provenance.is_file():
        try:
            stated = json.loads(provenance.read_text(encoding="utf-8")).get("temperature_k")
        except (ValueError, AttributeError):
            raise ValueError(f"{provenance}: expected a JSON object with temperature_k; give --temperature") from None
        if isinstance(stated, int | float) and stated > 0:
            return float(stated), provenance.name
    return FORMAT_K, "the format's"


def predicted(lines: Catalogue, request: CatRequest, kelvin: float, note: Note) -> Catalogue:
    """Lines of a molecule up to the highest J and down to the weakest line of the catalogue, somewhat beyond its range."""
    from rotor.formats.line_tables import catalogue
    from rotor.spectra.lines import line_list

    source = request.compare or ""
    highest = int(max(lines.quanta_upper[:, 0].max(), lines.quanta_lower[:, 0].max()))
    frequency, _ = in_mhz(lines)
    reach = 1000.0 + 0.01 * float(frequency.max())  # other constants may shift lines out of the range
    prediction = line_list(
        top_of_word(source, note, request.isotope, with_some_dipole),
        temperature_k=kelvin,
        jmax=highest,
        min_lgint=float(lines.lgint.min()) - 1.0,
        untrusted=True,
        range_mhz=(max(0.0, float(frequency.min()) - reach), float(frequency.max()) + reach),
    )
    note(f"{source}: predicted at {prediction.temperature_k:g} K with Q = {prediction.q:.6g}, J up to {highest}")
    if not len(prediction):
        raise NoAnswerError(f"--compare: {source} has no lines in the range of the catalogue")
    return catalogue(prediction)


def comparison_record(compared: Compared, other: str, shown: int) -> dict[str, Any]:
    """Counts of matched, missing and extra lines, and differences (OTHER minus the catalogue), for JSON."""
    comparison = compared.comparison
    measured = agreement(comparison)
    return {
        "other": other,
        "temperature_k": compared.temperature_k,
        "temperature_source": compared.temperature_source,
        "likely_temperature_k": compared.likely_temperature_k,
        "spins_collapsed": comparison.collapsed,
        "matched": len(comparison.our_rows),
        "missing": len(comparison.missing),
        "extra": len(comparison.extra),
        "other_states": comparison.other_states,
        **{name: _spread(comparison.differences(name)) for name in DIFFERENCES},
        "degeneracies_that_differ": None
        if comparison.collapsed
        else int((comparison.differences("g_upper") != 0).sum()),
        "measured": measured._asdict() if measured.lines else None,
        "missing_lines": [line_record(comparison.reference, row) for row in comparison.missing[:shown].tolist()],
        "extra_lines": [line_record(comparison.ours, row) for row in comparison.extra[:shown].tolist()],
    }


def temperature_note(compared: Compared | None) -> list[str]:
    """A note if the intensities of a catalogue fit another temperature better than that of the prediction."""
    if compared is None or compared.temperature_k is None:
        return []
    kelvin, likely = compared.temperature_k, compared.likely_temperature_k
    if not math.isfinite(likely) or abs(likely / kelvin - 1) <= UNLIKE:
        return []
    text = f"the intensities of the catalogue are most like those at {likely:.3g} K, not {kelvin:g} K"
    return [f"{text}; if it was made at that temperature, give --temperature {likely:.3g}"]


def _spread(difference: np.ndarray[Any, Any]) -> dict[str, float] | None:
    if not len(difference):
        return None
    size = np.abs(difference)
    return {"median": float(np.median(size)), "largest": float(size.max()), "mean": float(difference.mean())}


def line_record(lines: Catalogue, row: int) -> dict[str, Any]:
    """A line by the fields of the format, without blank quantum numbers."""
    record = lines.record(row)._asdict()
    for side in ("quanta_upper", "quanta_lower"):
        record[side] = [q for q in record[side] if q != BLANK]
    return record


def comparison_facts(record: dict[str, Any]) -> list[tuple[str, str]]:
    """Rows of the report on a comparison."""
    facts = [
        ("compared with", record["other"]),
        ("matched", str(record["matched"]) + (" (hyperfine components summed)" if record["spins_collapsed"] else "")),
        ("missing there", str(record["missing"])),
        ("only there", str(record["extra"])),
    ]
    if record["temperature_k"] is not None:
        facts.insert(1, ("temperature", f"{record['temperature_k']:g} K: {record['temperature_source']}"))
    if record["other_states"]:
        facts.append(
            ("not compared", f"{counted(record['other_states'], 'line')} of states that one side has no number for")
        )
    units = {"frequency_mhz": "MHz", "lgint": "", "energy_lower_cm": "cm-1"}
    for name in DIFFERENCES:
        if record[name]:
            text = "median |difference| {median:.6g}, largest {largest:.6g}, mean there - here {mean:.6g}"
            facts.append((name, f"{text.format(**record[name])} {units[name]}".rstrip()))
    if record["degeneracies_that_differ"] is not None:
        facts.append(("degeneracy", f"differs in {counted(record['degeneracies_that_differ'], 'line')}"))
    if record["measured"]:
        measured = record["measured"]
        text = (
            f"{measured['lines']}: median |obs - calc| {measured['median_mhz']:.4g} MHz, "
            f"{measured['within_3_sigma']:.1%} within 3 σ"
        )
        facts.append(("measured lines", text))
    return facts
