"""A catalogue beside another list: what stands in OTHER of `rotor cat --compare`, at which temperature and in which range."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.cli.shared import inputs
from rotor.cli.shared.options import option
from rotor.cli.shared.output import ComputationError, note
from rotor.table import counted

if TYPE_CHECKING:
    import numpy as np

    from rotor.formats.spcat.compare import Comparison
    from rotor.formats.spcat.text.catalogue import Catalogue

FORMAT_K = 300.0  # intensities of the 80-column format are those at 300 K
DIFFERENCES = ("frequency_mhz", "lgint", "energy_lower_cm")
UNLIKE = 0.05  # a temperature of intensities further off than this is pointed out


@dataclass(frozen=True)
class CompareOptions:
    """What a catalogue is compared with."""

    compare: str | None = option(
        None, metavar="OTHER", help="Another .cat, an .int, or a molecule to predict: what differs in OTHER."
    )
    temperature: str | None = option(
        None, metavar="T", help="Of the intensities of FILE, for a molecule (K; by default what FILE says, else 300)."
    )
    isotope: list[str] | None = option(
        None, metavar="1=2H", help="Another isotope of the molecule to predict, by atom number or element; repeatable."
    )
    as_spcat: bool = option(
        False,
        "--as-spcat",
        help="OTHER, an .int, is predicted with SPCAT's own numbers also where it errs, see rotor spectrum.",
    )
    full_basis: bool = option(
        False,
        "--full-basis",
        help="OTHER, an .int, is predicted with every K in the basis, whatever KNMIN and KNMAX say.",
    )

    @property
    def other(self) -> str:
        """What it is compared with: the file or the molecule, with its isotopes."""
        return ", ".join([self.compare or "", *(self.isotope or [])])


@dataclass(frozen=True)
class Compared:
    """Two lists side by side, and for a molecule that was predicted its temperature with where that is from."""

    comparison: Comparison
    temperature_k: float | None = None
    temperature_source: str | None = None


def refuse_without_molecule(options: CompareOptions) -> None:
    """--temperature and --isotope belong to a molecule that is predicted, --as-spcat and --full-basis to an .int file."""
    for flag, on in (("--as-spcat", options.as_spcat), ("--full-basis", options.full_basis)):
        if on and not (options.compare or "").lower().endswith(".int"):
            raise ValueError(f"{flag}: expected with --compare and an .int file to predict")
    given = {"--temperature": options.temperature, "--isotope": options.isotope}
    name = next((name for name, value in given.items() if value), None)
    if name is None:
        return
    if options.compare is None or options.compare.lower().endswith((".cat", ".cat.gz", ".int")):
        raise ValueError(f"{name}: expected with --compare and a molecule to predict; a file has its own")


def beside(lines: Catalogue, file: str, options: CompareOptions, chosen: Any) -> Compared:
    """The lines of a file beside those of OTHER; chosen(catalogue) picks those of its lines that the options mean."""
    from rotor.formats.spcat.compare import compare, within
    from rotor.formats.spcat.predict import predict_file

    other = options.compare or ""
    if not len(lines):
        raise ComputationError("--compare: no lines are left to compare")
    if other.lower().endswith((".cat", ".cat.gz")):
        return Compared(compare(lines, chosen(read_catalogue(other))))
    if other.lower().endswith(".int"):
        prediction = predict_file(other, as_spcat=options.as_spcat, full_basis=options.full_basis)
        for text in prediction.notes:
            note(text)
        return Compared(compare(lines, chosen(prediction.catalogue)))
    kelvin, source = temperature_of(file, options.temperature)
    found = compare(lines, chosen(predicted(lines, other, options.isotope, kelvin)))
    reference = found.reference
    range_mhz = (float(reference.frequency_mhz.min()), float(reference.frequency_mhz.max()))
    return Compared(within(found, range_mhz, float(reference.lgint.min())), kelvin, source)


def read_catalogue(path: str) -> Catalogue:
    """The catalogue in a file; ValueError for a file of something else."""
    if not path.lower().endswith((".cat", ".cat.gz")):
        raise ValueError(f"{path}: expected a catalogue, .cat or .cat.gz")
    from rotor.formats.spcat.text.cat import read_cat

    return read_cat(path)


def temperature_of(file: str, given: str | None) -> tuple[float, str]:
    """The temperature of a catalogue's intensities in K, and where it is from: an option, the file beside it, the format."""
    if given is not None:
        return inputs.positive("--temperature", given, "K"), "given (--temperature)"
    beside = Path(f"{file}.provenance.json")
    if beside.is_file():
        try:
            known = json.loads(beside.read_text(encoding="utf-8")).get("temperature_k")
        except (ValueError, AttributeError):
            raise ValueError(f"{beside}: expected a JSON object with temperature_k; give --temperature") from None
        if isinstance(known, int | float) and known > 0:
            return float(known), beside.name
    return FORMAT_K, "the format's"


def predicted(lines: Catalogue, source: str, isotopes: Sequence[str] | None, kelvin: float) -> Catalogue:
    """Lines of a molecule to the highest J of the catalogue, down to its weakest line and somewhat beyond its range."""
    import rotor
    from rotor.formats.line_tables import catalogue
    from rotor.formats.spcat.compare import in_mhz

    top = inputs.with_dipole(source, isotopes)
    highest = int(max(lines.quanta_upper[:, 0].max(), lines.quanta_lower[:, 0].max()))
    frequency, _ = in_mhz(lines)
    reach = 1000.0 + 0.01 * float(frequency.max())  # lines that lie elsewhere with other constants are found too
    made = rotor.api.line_list(
        top,
        temperature_k=kelvin,
        jmax=highest,
        min_lgint=float(lines.lgint.min()) - 1.0,
        untrusted=True,
        range_mhz=(max(0.0, float(frequency.min()) - reach), float(frequency.max()) + reach),
    )
    note(f"{source}: predicted at {made.temperature_k:g} K with Q = {made.q:.6g}, J up to {highest}")
    if not len(made):
        raise ComputationError(f"--compare: {source} has no lines in the range of the catalogue")
    return catalogue(made)


def comparison_record(compared: Compared, other: str, shown: int) -> dict[str, Any]:
    """Matched, missing and extra lines and the differences, ours (OTHER) minus the catalogue."""
    from rotor.formats.spcat.compare import agreement, likely_temperature_k

    found = compared.comparison
    met = agreement(found)
    record = {
        "other": other,
        "temperature_k": compared.temperature_k,
        "temperature_source": compared.temperature_source,
        "likely_temperature_k": likely_temperature_k(found, compared.temperature_k or FORMAT_K),
        "spins_collapsed": found.collapsed,
        "matched": len(found.of_ours),
        "missing": len(found.missing),
        "extra": len(found.extra),
        "other_states": found.other_states,
        **{name: _spread(found.differences(name)) for name in DIFFERENCES},
        "degeneracies_that_differ": None if found.collapsed else int((found.differences("g_upper") != 0).sum()),
        "measured": met._asdict() if met.lines else None,
        "missing_lines": [line_record(found.reference, row) for row in found.missing[:shown].tolist()],
        "extra_lines": [line_record(found.ours, row) for row in found.extra[:shown].tolist()],
    }
    _point_out_temperature(record)
    return record


def _point_out_temperature(record: dict[str, Any]) -> None:
    kelvin, likely = record["temperature_k"], record["likely_temperature_k"]
    if kelvin is not None and math.isfinite(likely) and abs(likely / kelvin - 1) > UNLIKE:
        text = f"the intensities of the catalogue are most like those at {likely:.3g} K, not {kelvin:g} K"
        note(f"{text}; if it was made at that temperature, give --temperature {likely:.3g}")


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
