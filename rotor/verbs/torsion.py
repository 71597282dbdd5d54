"""`torsion`: rotation about a bond: potential, reduced moment, levels, tunnelling splittings, thermodynamics."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from rotor import units
from rotor.reports import top_facts
from rotor.reports.progress import progress_bar
from rotor.reports.screen import Table, record_table, table_records
from rotor.requests.readers import Rule
from rotor.thermodynamics.torsion.request import TorsionAnswer, TorsionRequest, answer_torsion
from rotor.verbs.common.molecule import DIPOLE, NUCLEI, POLARIZABILITY, STATES
from rotor.verbs.common.outputs import Report, picture, table_file
from rotor.verbs.common.subjects import OneMolecule
from rotor.verbs.common.verb import Verb, Work, facts_named

EXAMPLES = """\
  rotor torsion C2H6 --bond 1-2
  rotor torsion "SMILES:CC=O" --bond 1-2 --potential table --plot acetaldehyde.png
  rotor torsion C2H6 --bond 1-2 --potential "V3=1013 cm-1" --temperature 100:1000K:10
  rotor torsion C2H6 --bond 1-2 --potential "V3=1013 cm-1" --classical 300K
  rotor torsion butane.xyz --bond 2-3 --potential xtb --csv levels.csv --thermo-csv heat.csv"""

SHOWN = 30  # levels in the report


def answer(request: TorsionRequest, work: Work) -> TorsionAnswer:
    """The torsion, with a bar on a terminal during the scan."""
    if not work.progress:
        return answer_torsion(request)
    with progress_bar("angles of the scan") as show:
        return answer_torsion(request, show)


def _facts(answer: TorsionAnswer, record: Mapping[str, Any]) -> list[tuple[str, str]]:
    symbols = answer.rotation.molecule.symbols
    bond = "-".join(f"{symbols[atom]}{atom + 1}" for atom in (answer.rotation.first, answer.rotation.last))
    low, high = record["reduced_moment_range_u_angstrom2"]
    count = record["symmetry_number"]
    turn = (
        "the relaxed scan"
        if answer.scan is not None
        else f"a turn of {count} equal positions"
        if count > 1
        else "a turn"
    )
    spread = f" of the geometry; {low:.6g} to {high:.6g} over {turn}" if high - low > 1e-6 * high else ""
    # a minimum just below a whole turn is that of the geometry, at 0
    angles = [float(f"{well['angle_degrees']:.4g}") % 360 for well in record["wells"]]
    minima = sorted(zip(angles, (round(well["energy_cm"], 6) for well in record["wells"]), strict=True))
    wells = [f"{angle:.4g}° ({energy:.4g} cm⁻¹)" for angle, energy in minima]
    quanta = sorted({round(well["harmonic_cm"], 1) for well in record["wells"]})
    harmonic = ", ".join(f"{quantum:g}" for quantum in quanta)
    symmetry = f"{count} equal positions in a turn" if count > 1 else "none: no two positions in a turn are equal"
    misfit = record["scan_misfit_cm"]
    return [
        ("bond", f"{bond}; {len(answer.rotation.top)} atoms turn"),
        ("potential", f"{record['potential_source']}: {_terms_text(record)}"),
        ("barrier", f"{record['barrier_cm']:.6g} cm⁻¹ from the lowest to the highest point"),
        ("minima", ", ".join(wells) + f"; harmonic {harmonic} cm⁻¹" if wells else "none: a free rotor"),
        ("reduced moment", f"{record['reduced_moment_u_angstrom2']:.6g} u Å²{spread}"),
        ("F", f"{record['f_mhz'] / units.MHZ_PER_CM:.6g} cm⁻¹ ({record['f_mhz']:.6g} MHz)"),
        ("symmetry", symmetry),
        ("scan", "" if misfit is None else f"Fourier series within {misfit:.2g} cm⁻¹ (root mean square)"),
    ]


def _classical_facts(answer: TorsionAnswer, report: Report) -> list[tuple[str, str]]:
    gas = answer.classical
    if gas is None:
        return []
    torsion, rotation, potential = (gas.equipartition[name] for name in ("torsion", "rotation", "potential"))
    conserved = f"energy within {gas.energy_error:.1g} kT, L in space within {gas.momentum_error:.1g}"
    return [
        ("classical gas", f"{gas.molecules} molecules at {gas.temperature_k:g} K for {gas.time_ps[-1]:g} ps"),
        ("passages", f"{gas.rate.value:.4g} ± {gas.rate.error:.2g} a molecule and ps; {gas.expected_rate:.4g} by the equilibrium flux"),
        ("equipartition", f"p ∂H/∂p {torsion.value:.3f} ± {torsion.error:.3f} kT; L·ω/3 {rotation.value:.3f} ± {rotation.error:.3f} kT"),
        ("mean V", f"{potential.value:.3f} ± {potential.error:.3f} kT; {gas.expected_potential:.3f} by quadrature, 0.5 of a harmonic well"),
        ("conserved", f"{conserved}; steps of {gas.step_ps * 1e3:.2g} fs"),
        *top_facts.error_facts(gas.errors.as_json()),
    ]  # fmt: skip


def _terms_text(record: Mapping[str, Any]) -> str:
    """The largest terms V_n and W_n of the potential, in cm⁻¹."""
    terms = [(f"V{n}", -2 * value) for n, value in record["potential_cosines_cm"].items()]
    terms += [(f"W{n}", 2 * value) for n, value in record["potential_sines_cm"].items()]
    largest = max((abs(value) for _, value in terms), default=0.0)
    selected = [f"{name} = {value:.5g}" for name, value in terms if abs(value) > 1e-3 * largest]
    return (", ".join(selected) + " cm⁻¹") if selected else "none"


def _level_table(answer: TorsionAnswer, report: Report) -> Table:
    def splitting(row: Mapping[str, Any]) -> str:
        hidden = math.isnan(row["splitting_mhz"]) or (row["splitting_mhz"] == 0.0 and row["species"] == 0)
        return "" if hidden else f"{row['splitting_mhz']:.4f}"

    columns: dict[str, Any] = {
        "v": "{v}",
        "σ": "{species}",
        "g": "{degeneracy}",
        "E (cm-1)": "{energy_cm:.5f}",
        "above lowest": "{above_lowest_cm:.5f}",
        "splitting (MHz)": splitting,
    }
    title = "levels; E above the foot of the potential; splitting from σ = 0 of the same v, or of a tunnelling pair"
    return record_table(title, columns, table_records(answer.levels, slice(SHOWN)))


def _thermo_table(answer: TorsionAnswer, report: Report) -> Table:
    functions = answer.functions
    exact = functions.for_method("levels")
    columns: dict[str, Any] = {
        "T (K)": lambda row: f"{exact.temperature_k[row]:g}",
        "Q": lambda row: f"{math.exp(exact.ln_q[row]):.5g}",
        "S (J/mol K)": lambda row: f"{exact.entropy_j_per_mol_k[row]:.5g}",
    }
    for method in dict.fromkeys(functions.method.tolist()):
        heat = functions.for_method(method).cv_over_r
        columns[method] = lambda row, heat=heat: f"{heat[row]:.5f}"
    title = "thermodynamics: Q from the foot of the potential and S by the levels; C_v/R by the levels and by approximations"
    return record_table(title, columns, range(len(exact.temperature_k)))


VERB = Verb(
    name="torsion",
    about="Rotation about a bond: potential, levels, tunnelling, thermodynamics.",
    examples=EXAMPLES,
    request=TorsionRequest,
    answer=answer,
    table=lambda answer: answer.levels,
    results=lambda answer: facts_named(answer.facts(), "barrier_cm", "zero_point_cm", "reduced_moment_u_angstrom2")
    | {"cv_over_r": answer.functions.for_method("levels").cv_over_r[-1]},
    rows="levels",
    show=top_facts.report_on_top(_facts, _level_table, _thermo_table, _classical_facts),
    outputs=(
        table_file("csv", "the levels", "levels.csv"),
        table_file("thermo_csv", "the thermodynamic functions of all methods", "thermo.csv", lambda answer, _: answer.functions),
        table_file("classical_csv", "the classical gas against time", "gas.csv", lambda answer, _: answer.classical,
                   rule=Rule(("observables.classical",), why="a classical gas has a temperature, such as 300K")),
        picture("Draw potential, levels and wave functions", "torsion.png"),
    ),
    subject=OneMolecule(
        ("constants", *DIPOLE, *POLARIZABILITY, "spin_weights", *NUCLEI, *STATES, "hessian", "internal_rotation", "symmetry_tolerance"),
    ),
    content=lambda answer, shown: {"functions": table_records(answer.functions)},
    numerics="rotor.thermodynamics.numerics:TORSION",
    accuracy="of the levels",
    sound=False,  # errors of potentials and scans arise during the calculation
    drawn="",
    start={"molecule": "C2H6", "observables.bond": "1-2"},
)  # fmt: skip
