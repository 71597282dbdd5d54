"""`align`: molecules aligned or oriented by pulses, quantum and classical."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.alignment.pulse import Axis, Pulse, TabulatedPulse, pulse_of_numbers, read_axis
from rotor.alignment.request import AlignAnswer, AlignRequest, answer_align
from rotor.arrays import Floats
from rotor.reports import top_facts
from rotor.reports.screen import Table, record_table
from rotor.requests.field import CONDITIONS, all_fields, declared_fields
from rotor.requests.fill import Entries, NamedError, read_fields, within
from rotor.requests.readers import Quantity
from rotor.table import counted
from rotor.verbs.common.molecule import NUCLEI, REFINEMENT, STATES, Reading, with_known_polarizability, with_some_dipole
from rotor.verbs.common.outputs import Report, picture, tables
from rotor.verbs.common.subjects import OneMolecule
from rotor.verbs.common.verb import Extra, Subject, Verb

if TYPE_CHECKING:
    from rotor.alignment.align import AlignmentTrace
    from rotor.tops.top import Top

FIELDS = all_fields(AlignRequest)
_TEXTS = {
    "--pulse": (
        "gaussian",
        'Gaussian pulse: peak intensity, full width at half maximum[, time]: "1e13 W/cm2, 1 ps"; repeatable',
    ),
    "--switched": ("switched", 'Switched pulse: "1e12 W/cm2, RISE, PLATEAU, FALL[, START]" (ps); repeatable'),
    "--kick": ("kick", 'Kick without duration: "0.5 J/cm2[, TIME]"; repeatable'),
    "--thz": (
        "thz",
        'Field on the dipole: "100 kV/cm, 1 ps[, 0.3 THz[, TIME]]": peak, width of its envelope, frequency; repeatable',
    ),
}  # shape of the pulse and help, by option

EXAMPLES = """\
  rotor align OCS --pulse "1e13 W/cm2, 1 ps" --temperature 1 --until 200ps --plot ocs.png --csv ocs.csv
  rotor align --constants "B=6081.492 MHz" --anisotropy 4.04 --pulse "1e13 W/cm2, 50 fs"
  rotor align N2 --pulse "3e13 W/cm2, 0.1 ps" --pulse "3e13 W/cm2, 0.1 ps, 8.38 ps" --temperature 300 --classical 20000
  rotor align OCS --thz "500 kV/cm, 1 ps, 0.3 THz" --observable costheta"""


def prepare(top: Top, reading: Reading, entries: Entries) -> Top:
    """The top with the dipole or polarizability that the pulses act on."""
    pulses = FIELDS["pulses"].read(entries.values.get("pulses"), entries.style) or ()
    acts_on = {pulse.acts_on for pulse in pulses}
    if "dipole" in acts_on:
        top = with_some_dipole(top, reading)
    return with_known_polarizability(top, reading) if "polarizability" in acts_on else top


def read_pulses(typed: Mapping[str, Any]) -> Mapping[str, Any]:
    """All pulses of the options.

    Raises ValueError, with the option, for an unreadable text, and if no pulse is given.
    """
    with within("--polarization"):
        axis = read_axis(typed.get("--polarization", "z"))
    pulses: list[Pulse] = []
    for option, (shape, _) in _TEXTS.items():
        along = {} if shape == "thz" else {"axis": axis}
        with within(option):
            pulses += [pulse_of_numbers(shape, text, **along) for text in typed.get(option, ())]
    if "--pulse-table" in typed:
        with within("--pulse-table"):
            pulses.append(_pulse_of_table(typed["--pulse-table"], axis))
    if not pulses:
        raise ValueError('no pulse: give --pulse "1e13 W/cm2, 1 ps", --switched, --kick, --pulse-table or --thz')
    return {"pulses": tuple(pulses)}


def _pulse_of_table(path: str, axis: Axis) -> Pulse:
    """A pulse from the columns t_ps and intensity_w_per_cm2 of a CSV file."""
    import csv

    with open(path, newline="", encoding="utf-8-sig") as handle:
        reader = csv.DictReader(line for line in handle if line.strip() and not line.startswith("#"))
        rows, names = list(reader), [name.strip() for name in reader.fieldnames or ()]
    columns = ("t_ps", "intensity_w_per_cm2")
    if not set(columns) <= set(names):
        raise ValueError(f"{path}: expected the columns {', '.join(columns)}; found {', '.join(names) or 'none'}")
    try:
        table = np.array([list(map(float, row.values())) for row in rows]).reshape(len(rows), len(names))
    except (TypeError, ValueError):
        raise ValueError(f"{path}: expected {len(names)} numbers in every row after the first") from None
    times, intensities = (table[:, names.index(name)] for name in columns)
    return TabulatedPulse(times, intensities, axis)


def build(verb: Verb, entries: Entries, subject: Subject) -> AlignRequest:
    """The request from a molecule, its pulses and the other inputs."""
    values = read_fields(AlignRequest, entries, subject)
    if not values.get("pulses"):
        raise ValueError(
            'pulses: expected one or more, such as "1e13 W/cm2, 1 ps" or "gaussian peak=1e13W/cm2 fwhm=1ps"'
        )
    if values.get("state") is not None and "temperature_k" in values and not values.get("classical_molecules"):
        raise NamedError(
            "{temperature_k} and {state}: give one of them; the molecules of one level have no temperature"
        )
    if "m" in (values.get("state") or {}):
        raise NamedError("{state}: a level has all M, and one |M| of it is given by {m}")
    if values.get("state") is not None and values.get("classical_molecules"):
        subject.note("the classical gas is at the temperature of --temperature, not in the level of --state")
    return AlignRequest(**subject.values, **values)


def _table(answer: AlignAnswer, report: Report) -> Table:
    """Extremes of the cosines."""
    trace = answer.trace
    columns = {
        "cosine": "{name}",
        "max": "{max:.6f}",
        "max at (ps)": "{max_at_ps:.3f}",
        "min": "{min:.6f}",
        "min at (ps)": "{min_at_ps:.3f}",
        "mean after": lambda row: f"{trace.permanent[row['name']]:.6f}" if row["name"] in trace.permanent else "",
    }
    return record_table("", columns, report.content["extremes"], {"cosine"})


def _facts(answer: AlignAnswer, content: Mapping[str, Any]) -> list[tuple[str, str]]:
    trace, top = answer.trace, answer.trace.top
    acts_on = {pulse.acts_on for pulse in trace.pulses}
    accuracy = (
        f"{content['error_estimate']:.1e} estimated: steps {trace.step_error:.1e}, leakage {trace.edge_population:.1e}, "
        f"left out {trace.ensemble.left_out:.1e} of the population"
    )
    return [
        ("constants", top_facts.constants_text(top)),
        ("dipole", top_facts.dipole_text(top) if "dipole" in acts_on else ""),
        ("polarizability", top_facts.tensor_text(top) if "polarizability" in acts_on else ""),
        ("pulses", "; ".join(_pulse_text(pulse) for pulse in trace.pulses)),
        ("gas", trace.gas_text),
        ("revivals", _revival_text(content["revival_ps"])),
        ("J max", f"{trace.jmax}; after the pulses the gas has J up to {trace.reached_jmax}"),
        ("method", f"{trace.method}, {counted(sum(trace.steps), 'step')}"),
        ("numerical error", accuracy),
        ("samples", _samples_text(trace)),
        ("classical gas", _classical_text(content)),
    ]


def _classical_text(content: Mapping[str, Any]) -> str:
    """Size of the classical gas and the errors of its means."""
    errors = ", ".join(f"{name} ± {error:.1g}" for name, error in content["classical_errors"].items())
    return errors and f"{content['classical_molecules']} molecules: {errors} at most, of sampling"


def _revival_text(period: float | None) -> str:
    if period is None:
        return "none that are exact: an asymmetric top"
    return f"every {period:.7g} ps, 1/(2Bc) of the rigid top; partial ones at its halves and quarters"


def _samples_text(trace: AlignmentTrace) -> str:
    """The number of times and their step, that max and min are samples, and how far the cosines go between them."""
    longest = float(np.diff(trace.t_ps).max(initial=0.0))
    beyond = max(beyond_samples(trace.t_ps, sign * values) for values in trace.cosines.values() for sign in (1.0, -1.0))
    text = f"{counted(len(trace.t_ps), 'time')}, at most {longest:.3g} ps apart; max and min are samples"
    return f"{text}, the cosines between them go about {beyond:.1g} further" if beyond > 0 else text


def beyond_samples(times: Floats, values: Floats) -> float:
    """How far a curve rises above its largest sample: the vertex of the parabola through this sample and its neighbours.

    >>> import numpy as np
    >>> t = np.linspace(0.0, 1.0, 11)
    >>> round(beyond_samples(t, -((t - 0.53) ** 2)), 6)  # (0.53 - 0.5)²
    0.0009
    """
    top = int(np.argmax(values))
    if not 0 < top < len(values) - 1:
        return 0.0
    bend, slope, _ = np.polyfit(times[top - 1 : top + 2] - times[top], values[top - 1 : top + 2], 2).tolist()
    return -(slope**2) / (4 * bend) if bend < 0 else 0.0


def _pulse_text(pulse: Pulse) -> str:
    first, last = pulse.window_ps
    values = {name: (field.reader, getattr(pulse, name)) for name, field in declared_fields(type(pulse)).items()}
    text = ", ".join(
        f"{name.partition('_')[0]} {reader.show(value)}"
        for name, (reader, value) in values.items()
        if isinstance(reader, Quantity)
    )
    return f"{type(pulse).__name__} on the {pulse.acts_on}, {first:g} to {last:g} ps" + (f" ({text})" if text else "")


def results(answer: Any) -> dict[str, Any]:
    """Largest and smallest cosines, for a sweep."""
    cosines = {name: values for name, values in answer.table.columns.items() if name != "t_ps"}
    highest = {f"max_{name}": values.max() for name, values in cosines.items()}
    return highest | {f"min_{name}": values.min() for name, values in cosines.items()}


VERB = Verb(
    name="align",
    about="Molecules aligned or oriented by pulses of light: cosines against time of a rotational wave packet.",
    examples=EXAMPLES,
    request=AlignRequest,
    answer=lambda request, work: answer_align(request, work.executor),
    results=results,
    rows="trace",
    show=top_facts.report_on_top(_facts, _table, sources=("constants", "dipole", "polarizability")),
    outputs=(*tables("the cosines", "out"), picture("Draw the cosines", "out.png")),
    subject=OneMolecule(("dipole", *REFINEMENT, *NUCLEI, *STATES), prepare),
    drawn="ps",
    scaled=False,
    workers="blocks of initial states",
    extras=(
        *(
            Extra(option, "TEXT", help_, panel=CONDITIONS, common=True, many=True)
            for option, (_, help_) in _TEXTS.items()
        ),
        Extra("--pulse-table", "FILE", "Pulse from a CSV with columns t_ps and intensity_w_per_cm2", panel=CONDITIONS),
        Extra(
            "--polarization",
            "NAME",
            "Polarization of all pulses: z, x, y, circular (in XY) or elliptical:R (I_X : I_Z = R : 1) [z]",
            panel=CONDITIONS,
        ),
    ),
    read_extras=read_pulses,
    build=build,
    sound=False,
    numerics="rotor.alignment.numerics:ALIGN",
    accuracy="of the cosines",
    accuracy_example=1e-4,
    start={
        "molecule": "OCS",
        "pulses.shape": "gaussian",
        "pulses.peak": "1e13 W/cm2",
        "pulses.fwhm": "1 ps",
        "conditions.temperature": "1 K",
        "outputs.csv": "align.csv",
    },
)
