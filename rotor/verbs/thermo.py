"""`thermo`: partition function, energy, entropy and heat capacity of rotation and of the ideal gas."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from rotor.reports import top_facts
from rotor.reports.progress import sum_progress
from rotor.reports.screen import Table, record_table, sampled
from rotor.requests.budget import size_text
from rotor.requests.field import CONDITIONS
from rotor.thermodynamics.functions import ThermoFunctions
from rotor.thermodynamics.request import ThermoAnswer, ThermoRequest, answer_thermo
from rotor.verbs.common.molecule import DIPOLE, POLARIZABILITY, REFINEMENT
from rotor.verbs.common.outputs import Report, picture, tables
from rotor.verbs.common.subjects import OneMolecule
from rotor.verbs.common.verb import Extra, Verb

SHOWN = 25  # rows of the table in the report

EXAMPLES = """\
  rotor thermo water
  rotor thermo water --temperature 10:1000K:100 --csv water.csv --plot water.png
  rotor thermo HCN --hyperfine --temperature 0.0001,0.001,0.01,0.1,1
  rotor thermo H2 --species ortho --temperature 5:300K:60 --plot ortho.png
  rotor thermo water --gas --pressure 1bar --vibration 1595,3657,3756 --temperature 298.15"""


def _facts(answer: ThermoAnswer, content: Mapping[str, Any]) -> list[tuple[str, str]]:
    functions, top = answer.functions, answer.functions.top
    corrections, jmax = content["classical_corrections"], content["jmax"]
    sums = f"to J = {jmax} at most" if jmax >= 0 else "none: classical with corrections"
    series = " ".join(
        f"{'-' if value < 0 else '+'} {abs(value):.6g}{unit}"
        for value, unit in zip(corrections.values(), ("/T", "/T²", " T", " T²"), strict=True)
        if value
    )
    return [
        ("constants", top_facts.constants_text(top)),
        *top_facts.weights_facts(top, content["spin_weights"]),
        *(fact for fact in top_facts.states_facts(top) if not fact[1].startswith("dipole")),
        ("species", _species_text(functions, content)),
        ("Θ_rot", _theta_text(content["rotational_temperatures_k"])),
        ("classical Q", _onset_text(content["classical_tolerance"], content["classical_above_k"])),
        ("corrected", f"classical Q times exp of the logarithm of 1 {series}, to that order"),
        ("sums", f"{sums}, Q, U and C_v to {content['relative_error']:.0e} of themselves{_worst_text(functions)}"),
        *_spin_facts(content["hyperfine"]),
        ("vibration", content["vibrations"] or "left out: no states given"),
    ]


def _worst_text(functions: ThermoFunctions) -> str:
    """The temperature at which the sums leave out most, of several."""
    if len(functions.temperature_k) < 2:
        return ""
    _, temperature = max(zip(functions.relative_error.tolist(), functions.temperature_k.tolist(), strict=True))
    return f", worst at {temperature:g} K"


def _spin_facts(used: dict[str, Any] | None) -> list[tuple[str, str]]:
    """Number of spin functions in Q, and the temperature up to which their splittings are summed."""
    if used is None:
        return []
    up_to, size = used["summed_up_to_k"], f"splittings of {size_text(used['splitting_mhz'], 'MHz')}"
    where = "too small to change them" if up_to is None else f"summed level by level up to {up_to:g} K"
    return [("hyperfine", f"Q counts {used['spin_functions']:.6g} functions of the spins; {size}, {where}")]


def _onset_text(tolerance: float, above_k: float | None) -> str:
    if above_k is None:
        return f"the temperature above which it is good to {tolerance:.0%} of C_v is not known: no sum over levels reaches it"
    return f"good to {tolerance:.0%} of C_v above {above_k:.4g} K (rigid top, equilibrium)"


def _species_text(functions: ThermoFunctions, content: Mapping[str, Any]) -> str:
    text = functions.species
    if functions.fractions:
        text += ", frozen: " + ", ".join(f"{name} {x:.4g}" for name, x in functions.fractions.items())
    others = [name for name in content["species_known"] if name != functions.species]
    return text + (f"; also available: {', '.join(others)}" if others else "; all levels are of one species")


def _theta_text(theta: Sequence[float]) -> str:
    """Temperatures of A, B, C; of B alone for a linear top."""
    names = "ABC" if math.isfinite(theta[0]) else "B"
    return ", ".join(f"{name} {theta['ABC'.index(name)]:.6g}" for name in names) + " K"


def _rotation_table(answer: ThermoAnswer, report: Report) -> Table:
    """The functions of rotation at evenly spaced temperatures."""
    records, few = sampled(answer.functions, SHOWN, "temperatures")
    columns = {
        "T (K)": "{temperature_k:g}",
        "Q": "{q_rot:.6g}",
        "Q classical": "{q_rot_classical:.6g}",
        "Q corrected": "{q_rot_corrected:.6g}",
        "U (J/mol)": "{energy_j_per_mol:.6g}",
        "S (J/mol K)": "{entropy_j_per_mol_k:.6g}",
        "Cv/R": "{cv_over_r:.6f}",
        "classical": "{cv_over_r_classical:.1f}",
        "corrected": "{cv_over_r_corrected:.6f}",
    }
    title = f"rotation{few}; U from the lowest level, S with nuclear spin as the weights count it"
    return record_table(title, columns, records)


def _gas_table(answer: ThermoAnswer, report: Report) -> Table | None:
    """The functions of the ideal gas, if they are requested."""
    functions, gas = answer.functions, answer.functions.gas
    if gas is None:
        return None
    columns = {
        "T (K)": "{temperature_k:g}",
        "Cp (J/mol K)": "{gas_cp_j_per_mol_k:.3f}",
        "S (J/mol K)": "{gas_entropy_j_per_mol_k:.3f}",
        "H-H(0) (J/mol)": "{gas_enthalpy_j_per_mol:.3f}",
        "-(G-H(0))/T (J/mol K)": "{gas_gibbs_j_per_mol_k:.3f}",
    }
    states = "" if gas.electronic.degeneracies == (1,) else f"{gas.electronic.text}; "
    spin = f"{states}R ln {functions.spin_factor:.6g} of nuclear spin left out of S and G"
    title = f"ideal gas at {gas.pressure_bar:g} bar, {gas.mass_u:.6f} u; {spin}"
    return record_table(title, columns, sampled(functions, SHOWN)[0])


VERB = Verb(
    name="thermo",
    about="Rotational partition function, energy, entropy and heat capacity, quantum and classical.",
    examples=EXAMPLES,
    small_blocks=True,
    request=ThermoRequest,
    answer=lambda request, work: answer_thermo(request, sum_progress() if work.progress else None),
    results=lambda answer: {
        name: answer.table.columns[name][-1]
        for name in ("temperature_k", "q_rot", "entropy_j_per_mol_k", "cv_over_r")
    },
    rows="functions",
    show=top_facts.report_on_top(_facts, _rotation_table, _gas_table, sources=("constants", "spin weights")),
    outputs=(
        *tables("the table", "out"),
        picture("Draw the heat capacity", "out.png"),
    ),
    subject=OneMolecule((*DIPOLE, *POLARIZABILITY, "state_dipoles", *REFINEMENT)),
    drawn="K",
    extras=(
        Extra(
            "--gas", "", "Also functions of the ideal gas, with translation; at 1 bar unless --pressure is given",
            lambda _: {"conditions.pressure": "1 bar"}, panel=CONDITIONS, common=True,
        ),
    ),
    numerics="rotor.thermodynamics.numerics:THERMO",
    accuracy="of Q, U and C_v",
    accuracy_example="0.1 %",
    start={"molecule": "water", "conditions.temperature": "10:1000K:100", "outputs.csv": "thermo.csv"},
)  # fmt: skip
