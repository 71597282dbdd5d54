"""A catalogue beside another list: what stands in OTHER of `rotor cat --compare`, at which temperature and in which range."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.checks import NoAnswerError
from rotor.table import counted
from rotor.verbs.molecule import with_some_dipole
from rotor.verbs.subjects import top_of_word
from rotor.verbs.verb import Note

if TYPE_CHECKING:
    import numpy as np

    from rotor.formats.spcat.compare import Comparison
    from rotor.formats.spcat.text.catalogue import Catalogue
    from rotor.verbs.cat_request import CatRequest

FORMAT_K = 300.0  # intensities of the 80-column format are those at 300 K
DIFFERENCES = ("frequency_mhz", "lgint", "energy_lower_cm")
UNLIKE = 0.05  # a temperature of intensities further off than this is pointed out


@dataclass(frozen=True)
class Compared:
    """Two lists side by side, and for a molecule that was predicted its temperature with where that is from."""

    comparison: Comparison
    temperature_k: float | None = None
    temperature_source: str | None = None

    @cached_property
    def likely_temperature_k(self) -> float:
        """The temperature at which the intensities are most alike; nan where they do not say."""
        from rotor.formats.spcat.compare import likely_temperature_k

        return likely_temperature_k(self.comparison, self.temperature_k or FORMAT_K)


def beside(lines: Catalogue, request: CatRequest, note: Note) -> Compared:
    """The lines of a file beside those of OTHER that the request means."""
    from rotor.formats.spcat.compare import compare, within
    from rotor.formats.spcat.predict import predict_file

    other = request.compare or ""
    if not len(lines):
        raise NoAnswerError("--compare: no lines are left to compare")
    if other.lower().endswith((".cat", ".cat.gz")):
        return Compared(compare(lines, request.chosen(read_catalogue(other))))
    if other.lower().endswith(".int"):
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
    """The catalogue in a file; ValueError for a file of something else."""
    if not path.lower().endswith((".cat", ".cat.gz")):
        raise ValueError(f"{path}: expected a catalogue, .cat or .cat.gz")
    from rotor.formats.spcat.text.cat import read_cat

    return read_cat(path)


def temperature_of(file: str, option: float | None) -> tuple[float, str]:
    """The temperature of a catalogue's intensities in K, and where it is from: an option, the file beside it, the format."""
    if option is not None:
        return option, "given (--temperature)"
    beside = Path(f"{file}.provenance.json")
    if beside.is_file():
        try:
            known = json.loads(beside.read_text(encoding="utf-8")).get("temperature_k")
        except (ValueError, AttributeError):
            raise ValueError(f"{beside}: expected a JSON object with temperature_k; give --temperature") from None
        if isinstance(known, int | float) and known > 0:
            return float(known), beside.name
    return FORMAT_K, "the format's"


def predicted(lines: Catalogue, request: CatRequest, kelvin: float, note: Note) -> Catalogue:
    """Lines of a molecule to the highest J of the catalogue, down to its weakest line and somewhat beyond its range."""
    from rotor.formats.line_tables import catalogue
    from rotor.formats.spcat.compare import in_mhz
    from rotor.spectra.lines import line_list

    source = request.compare or ""
    highest = int(max(lines.quanta_upper[:, 0].max(), lines.quanta_lower[:, 0].max()))
    frequency, _ = in_mhz(lines)
    reach = 1000.0 + 0.01 * float(frequency.max())  # lines that lie elsewhere with other constants are found too
    made = line_list(
        top_of_word(source, note, request.isotope, with_some_dipole),
        temperature_k=kelvin,
        jmax=highest,
        min_lgint=float(lines.lgint.min()) - 1.0,
        untrusted=True,
        range_mhz=(max(0.0, float(frequency.min()) - reach), float(frequency.max()) + reach),
    )
    note(f"{source}: predicted at {made.temperature_k:g} K with Q = {made.q:.6g}, J up to {highest}")
    if not len(made):
        raise NoAnswerError(f"--compare: {source} has no lines in the range of the catalogue")
    return catalogue(made)


def comparison_record(compared: Compared, other: str, shown: int) -> dict[str, Any]:
    """Matched, missing and extra lines and the differences, ours (OTHER) minus the catalogue."""
    from rotor.formats.spcat.compare import agreement

    comparison = compared.comparison
    met = agreement(comparison)
    return {
        "other": other,
        "temperature_k": compared.temperature_k,
        "temperature_source": compared.temperature_source,
        "likely_temperature_k": compared.likely_temperature_k,
        "spins_collapsed": comparison.collapsed,
        "matched": len(comparison.of_ours),
        "missing": len(comparison.missing),
        "extra": len(comparison.extra),
        "other_states": comparison.other_states,
        **{name: _spread(comparison.differences(name)) for name in DIFFERENCES},
        "degeneracies_that_differ": None
        if comparison.collapsed
        else int((comparison.differences("g_upper") != 0).sum()),
        "measured": met._asdict() if met.lines else None,
        "missing_lines": [line_record(comparison.reference, row) for row in comparison.missing[:shown].tolist()],
        "extra_lines": [line_record(comparison.ours, row) for row in comparison.extra[:shown].tolist()],
    }


def temperature_note(compared: Compared | None) -> list[str]:
    """A remark where the intensities of a catalogue are like those at another temperature than that of the prediction."""
    if compared is None or compared.temperature_k is None:
        return []
    kelvin, likely = compared.temperature_k, compared.likely_temperature_k
    if not math.isfinite(likely) or abs(likely / kelvin - 1) <= UNLIKE:
        return []
    text = f"the intensities of the catalogue are most like those at {likely:.3g} K, not {kelvin:g} K"
    return [f"{text}; if it was made at that temperature, give --temperature {likely:.3g}"]


def _spread(difference: np.ndarray[Any, Any]) -> dict[str, float] | None:
    import numpy as np

    if not len(difference):
        return None
    size = np.abs(difference)
    return {"median": float(np.median(size)), "largest": float(size.max()), "mean": float(difference.mean())}


def line_record(lines: Catalogue, row: int) -> dict[str, Any]:
    """One line by the fields of the format, without blank quantum numbers."""
    from rotor.formats.spcat.text.fields import BLANK

    record = lines.record(row)._asdict()
    for side in ("quanta_upper", "quanta_lower"):
        record[side] = [q for q in record[side] if q != BLANK]
    return record


def comparison_facts(record: dict[str, Any]) -> list[tuple[str, str]]:
    """What a comparison found, as names and texts."""
    facts = [
        ("compared with", record["other"]),
        ("matched", str(record["matched"]) + (" (components of spins added)" if record["spins_collapsed"] else "")),
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
            text = "median |difference| {median:.6g}, largest {largest:.6g}, mean difference {mean:.6g}"
            facts.append((name, f"{text.format(**record[name])} {units[name]}".rstrip()))
    if record["degeneracies_that_differ"] is not None:
        facts.append(("degeneracy", f"differs in {counted(record['degeneracies_that_differ'], 'line')}"))
    if record["measured"]:
        met = record["measured"]
        text = (
            f"{met['lines']}: median |obs - calc| {met['median_mhz']:.4g} MHz, {met['within_3_sigma']:.1%} within 3 σ"
        )
        facts.append(("measured lines", text))
    return facts
