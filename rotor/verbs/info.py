"""`info`: constants, axes, kind and partition function of a molecule as a top."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from rotor.reports import top_facts
from rotor.reports.progress import sum_progress
from rotor.reports.screen import Table, record_table
from rotor.requests.fill import read_fields
from rotor.thermodynamics.info_request import InfoAnswer, InfoRequest, answer_info
from rotor.tops.constants.uncertain_numbers import known_digits
from rotor.units import MHZ_PER_CM
from rotor.verbs.common.molecule import POLARIZABILITY
from rotor.verbs.common.outputs import Report, tables
from rotor.verbs.common.subjects import OneMolecule
from rotor.verbs.common.verb import Verb, facts_named

EXAMPLES = """\
  rotor info water
  rotor info my.sdf --isotope 1=2H --json info.json
  rotor info --constants "A=8.572 B=3.64 C=2.79 GHz" --temperature 10:300K:30"""


def _facts(answer: InfoAnswer, content: Mapping[str, Any]) -> list[tuple[str, str]]:
    top = answer.request.top
    group = f"{content['point_group']}, rotational symmetry number {content['symmetry_number']}{_near_text(content)}"
    heading = "reduction" if top.constants.reduction else "representation"
    return [
        ("point group", "" if top.symmetry is None else group),
        (heading, top_facts.form_text(top.constants) if top.constants.representation else ""),
        ("dipole", top_facts.dipole_text(top)),
        ("polarizability", top_facts.tensor_text(top)),
        *top_facts.weights_facts(top, content["spin_weights"]),
        *top_facts.states_facts(top),
        ("mass", f"{top.mass_u:.6f} u" if top.mass_u else "not known"),
        ("inertial defect", f"{round(content['inertial_defect_u_angstrom2'], 9) + 0.0:.6g} u Å²"),
        ("kind", _kind_text(content["kind"], content["kind_decision"]) if top.kind_of_top else ""),
    ]


def _near_text(content: Mapping[str, Any]) -> str:
    if content["near_point_group"] is None:
        return ""
    off = content["near_displacement_angstrom"]
    return (
        f"; near {content['near_point_group']}: nuclei are up to {off:.2g} Å off it (--symmetry-tolerance accepts it)"
    )


def _kind_text(kind: str, decision: Mapping[str, Any]) -> str:
    """The ratios that decided the kind of the geometry, and the margin."""
    numbers = (
        f"Ia/Ic = {decision['ia_over_ic']:.3g} (linear below {decision['linear_below']:g}), "
        f"(Ib-Ia)/Ib = {decision['ib_minus_ia_over_ib']:.3g}, (Ic-Ib)/Ic = {decision['ic_minus_ib_over_ic']:.3g} "
        f"(equal within {decision['equal_within']:g})"
    )
    differs = "" if kind == decision["kind"] else f"; the constants are those of another kind, {kind}"
    margin = f"{decision['margin']:.3g}" if decision["margin"] < 1e9 else "more than 1e9"
    return f"the geometry is {decision['kind']} by {numbers}; margin: a factor of {margin}{differs}"


def _constants_table(answer: InfoAnswer, report: Report) -> Table:
    top = answer.request.top
    stated, estimated = top.constants.uncertainties, top.estimated_errors_mhz
    records = []
    for name, mhz in top.constants.values.items():
        guess = estimated.get(name)
        error = f"{stated[name]:.2g}" if name in stated else f"about {known_digits(guess, guess)}" if guess else ""
        wavenumber = known_digits(mhz / MHZ_PER_CM, guess and guess / MHZ_PER_CM, wavenumber_digits(mhz))
        records.append({"name": name, "mhz": known_digits(mhz, guess), "error": error, "cm": wavenumber})
    columns = {"constant": "{name}", "MHz": "{mhz}", "± MHz": "{error}", "cm-1": "{cm}"}
    return record_table("", columns, records, {"constant"})


def wavenumber_digits(mhz: float) -> int:
    """Significant digits of a constant in cm⁻¹: one more than it has in MHz, at most 10.

    >>> wavenumber_digits(5689.28), wavenumber_digits(10000.0), wavenumber_digits(0.00125), wavenumber_digits(6081.492114)
    (7, 6, 4, 10)
    """
    digits, _, _ = f"{abs(mhz):.12g}".partition("e")
    return min(10, 1 + len(digits.replace(".", "").lstrip("0")))


def _states_table(answer: InfoAnswer, report: Report) -> Table | None:
    """Constants of further vibrational states and their couplings."""
    states = answer.request.top.states
    columns = {
        "of states": "{0[0]}",
        "MHz": "{0[1]:.12g}",
        "cm-1": lambda constant: f"{constant[1] / MHZ_PER_CM:.{wavenumber_digits(constant[1])}g}",
    }
    return None if states is None else record_table("", columns, states.values.items(), {"of states"})


def _axes_table(answer: InfoAnswer, report: Report) -> Table:
    """Moments and planar moments; axes and centre of mass in the frame of the input."""
    moments, planar, frame = (report.content[k] for k in ("moments_u_angstrom2", "planar_moments_u_angstrom2", "frame"))
    columns, vectors = {"axis": "{0[0]}", "I (u Å²)": "{0[1]:.6f}", "P (u Å²)": "{0[2]:z.6f}"}, [()] * 3
    if frame:
        columns |= {axis: f"{{0[3][{number}]:z.6f}}" for number, axis in enumerate("xyz")}
        vectors = frame["axes"]
    records = [*zip("abc", moments, planar, vectors, strict=True)]
    centre = [("centre of mass (Å)", None, None, frame["centre_angstrom"])] if frame else []
    return record_table("", columns, [*records, *centre], {"axis"})


def _nuclei_table(answer: InfoAnswer, report: Report) -> Table:
    """Nuclei that split lines, the size of the splitting, and their constants if known."""
    spins = answer.request.top.spin_constants
    records: list[dict[str, Any]] = []
    for nucleus in report.content["splitting_nuclei"]:
        constants = top_facts.values_text(spins.of(nucleus["nucleus"]) if nucleus["known"] and spins else {})
        text = constants or "not known; the size is that of covalent bonds of this element"
        size = f"{'' if nucleus['known'] else 'about '}{nucleus['splitting_mhz']:.3g}"
        records.append({"nucleus": nucleus["nucleus"], "spin": nucleus["spin"], "size": size, "constants": text})
    values, listed = spins.values if spins else {}, [record["nucleus"] for record in records]
    for name in dict.fromkeys(re.findall(r"\(([^()]*)\)", " ".join(values))):  # electrons, spins of 1/2, pairs
        if spins and name not in listed:
            inside = f"({name})"
            text = top_facts.values_text(
                {key.replace(inside, ""): value for key, value in values.items() if inside in key}
            )
            spin = None if "," in name else spins.twice[name] / 2
            records.append({"nucleus": name, "spin": spin, "size": "", "constants": text})
    columns = {
        "nucleus": "{nucleus}",
        "spin": "{spin:g}",
        "splits J = 1 by (MHz)": "{size}",
        "constants (MHz)": "{constants}",
    }
    return record_table("", columns, records, {"nucleus", "constants (MHz)"})


def _reason(source: str) -> str:
    """Reason why a sum has no meaning, without temperature and remedy."""
    return re.sub(r"^Q\([^)]*\):? *", "", source).partition(";")[0]


def _q_table(answer: InfoAnswer, report: Report) -> Table:
    rows = report.content["partition_function"]
    columns: dict[str, Any] = {
        "T (K)": "{temperature_k:g}",
        "Q": lambda row: "-" if row["q"] is None else f"{row['q']:.6g}",
        "Q classical": "{classical:.6g}",
        # without jmax the classical limit replaced the sum
        "J max": lambda row: "-" if row["q"] is None or row["jmax"] is None else f"{row['jmax']}",
        "error": lambda row: "-" if row["q"] is None else f"{row['relative_error']:.0e}",
    }
    if any(row["q"] is None for row in rows):
        columns["remark"] = lambda row: _reason(row["source"]) if row["q"] is None else ""
    return record_table("", columns, rows, {"remark"})


def _conformers_table(answer: InfoAnswer, report: Report) -> Table:
    """Energies, constants (to the digits that the error of the geometry leaves) and dipoles of the conformers, if requested."""
    molecule = answer.request.top.molecule
    records: list[tuple[Any, ...]] = []
    relative = (molecule.uncertainty or 0.0) if molecule is not None else 0.0
    for conformer in report.content.get("conformers", ()):
        constants = conformer["rotational_constants_mhz"]
        texts = [known_digits(mhz, relative * mhz) if mhz < float("inf") else "-" for mhz in constants]
        dipole = conformer["dipole_abc_debye"] or (float("nan"),) * 3
        records.append((len(records) + 1, conformer["energy_kj_per_mol"], texts, dipole))
    columns = {"conformer": "{0[0]}", "E (kJ/mol)": "{0[1]:.2f}"}
    columns |= {f"{name} (MHz)": f"{{0[2][{number}]}}" for number, name in enumerate("ABC")}
    columns |= {f"μ{axis} (D)": f"{{0[3][{number}]:z.2f}}" for number, axis in enumerate("abc")}
    return record_table("", columns, records)


VERB = Verb(
    name="info",
    about="Frame, constants, kind of top with its margin, moments, dipole, table of Q(T).",
    examples=EXAMPLES,
    request=InfoRequest,
    answer=lambda request, work: answer_info(request, sum_progress() if work.progress else None),
    results=lambda answer: {name: answer.table.columns[name][0] for name in ("a_mhz", "b_mhz", "c_mhz")}
    | facts_named(answer.facts(), "mass_u", "kappa"),
    rows="partition_function",
    records=lambda answer: None,
    show=top_facts.report_on_top(
        _facts, _constants_table, _states_table, _axes_table, _nuclei_table, _q_table, _conformers_table,
        sources=("constants", "dipole", "polarizability", "spin weights"),
    ),
    outputs=tables("the table of Q(T)", "q"),
    subject=OneMolecule((*POLARIZABILITY, "internal_rotation")),
    build=lambda verb, entries, subject: InfoRequest(
        **subject.values, **read_fields(InfoRequest, entries, subject), smiles=subject.text
    ),
    drawn=None,
    accuracy="of the rotational constants",
    start={"molecule": "water", "outputs.csv": "q.csv"},
    small_blocks=True,
)  # fmt: skip
