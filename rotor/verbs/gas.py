"""`gas`: a classical gas of free molecules: test of equipartition, correlation functions."""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import replace
from typing import Any

from rotor.reports import top_facts
from rotor.reports.progress import counting
from rotor.reports.screen import Table, record_table, sampled
from rotor.requests.fill import Entries
from rotor.thermodynamics.gas.classical_gas import GasAnswer, GasRequest, answer_gas, settling_times_ps
from rotor.verbs.common.molecule import NUCLEI, POLARIZABILITY, REFINEMENT, STATES
from rotor.verbs.common.outputs import Report, picture, tables
from rotor.verbs.common.subjects import OneMolecule
from rotor.verbs.common.verb import Verb, Work

SHOWN = 11  # rows of the correlation functions in the report

EXAMPLES = """\
  rotor gas water --molecules 20000 --temperature 300 --seed 7 --json -
  rotor gas OCS --times 0:5:201 --csv ocs.csv --plot ocs.png"""


def adapt(request: GasRequest, outputs: Mapping[str, Any], entries: Entries) -> GasRequest:
    """Add times until the correlation functions have settled, if files need them and none are given."""
    if request.times_ps is None and any(map(outputs.get, ("csv", "parquet", "json", "plot"))):
        return replace(request, times_ps=settling_times_ps(request.top, request.temperature_k))
    return request


def answer(request: GasRequest, work: Work) -> GasAnswer:
    """The gas and its test, with correlation functions on all cores; the result does not depend on their number."""
    if request.times_ps is None:
        return answer_gas(request)
    bar = counting(request.molecules, "molecules") if work.progress else nullcontext()
    with ThreadPoolExecutor(os.cpu_count()) as pool, bar as advance:
        return answer_gas(request, pool, advance)


def _facts(answer: GasAnswer, content: Mapping[str, Any]) -> list[tuple[str, str]]:
    top, test = answer.request.top, answer.test
    count = content["degrees_of_freedom"]
    drawn = f"{content['molecules']} molecules at {content['temperature_k']:g} K, seed {content['seed']}"
    left_out = "" if top.mass_u is not None else "; translations are left out: the mass is not known"
    facts = [
        top_facts.rigid_fact(top),
        ("drawn", f"{drawn}; moved freely for {content['tested_at_ps']:.4g} ps, exactly"),
        ("degrees", f"{count['translation']} translations, {count['rotation']} rotations a molecule{left_out}"),
        ("test", str(test)),
    ]
    if answer.correlations is not None:
        facts += [("C1", f"of {content['vector_source']}"), ("C2", f"of {content['tensor_source']}")]
        start = content["short_time_per_ps2"]
        begins = f"C1 as 1 - {0.5 * start['c1']:.5g} t², C2 as 1 - {0.5 * start['c2']:.5g} t² (t in ps)"
        facts.append(("closed forms", f"{begins}; C1 ends at {content['c1_plateau']:.5g}"))
    return facts


def _degrees_table(answer: GasAnswer, report: Report) -> Table:
    columns = {
        "degree": "{name}",
        "E (cm-1)": "{energy_cm:.4f}",
        "½kT": "{expected_cm:.4f}",
        "2E/kT": "{mean:.5f}",
        "±": "{mean_spread:.5f}",
        "σ": "{sigma:+.2f}",
        "p": "{p_value:.3g}",
        "spread": "{spread:.4f}",
        "p (KS)": "{ks_p_value:.3g}",
    }
    title = "mean kinetic energy by degree; spread √2 = 1.4142 expected"
    return record_table(title, columns, report.content["degrees"], {"degree"})


def _curves_table(answer: GasAnswer, report: Report) -> Table | None:
    curves = answer.correlations
    if curves is None:
        return None
    records, few = sampled(curves, SHOWN, "times")
    first, *names = curves.columns
    columns = {"t (ps)": f"{{{first}:.4g}}"} | {name: f"{{{name}:.5f}}" for name in names}
    return record_table(f"correlation functions{few}", columns, records)


VERB = Verb(
    name="gas",
    about="A classical gas of free molecules: equipartition, correlation functions.",
    examples=EXAMPLES,
    request=GasRequest,
    answer=answer,
    table=lambda answer: answer.test if answer.correlations is None else answer.correlations,
    records=lambda answer: answer.correlations,
    results=lambda answer: {"p_value": answer.test.p_value, "chi2": answer.test.chi2},
    rows="correlation",
    show=top_facts.report_on_top(
        _facts,
        _degrees_table,
        _curves_table,
        title=lambda answer: f"{top_facts.heading(answer.request.top)}, a classical gas",
    ),
    outputs=(*tables("the correlation functions", "out"), picture("Draw the test and the functions", "out.png")),
    subject=OneMolecule((*POLARIZABILITY, "spin_weights", *NUCLEI, *STATES, *REFINEMENT, "symmetry_tolerance")),
    stated=("source", "temperature_k", "molecules", "seed", "vector_source", "tensor_source"),
    drawn="ps",
    scaled=False,
    adapt=adapt,
    invariants="conserved",
    numerics="rotor.thermodynamics.gas.numerics:GAS",
    accuracy="of temperature (K), heat capacity (%), or of C1 and C2 where times are given (%)",
    accuracy_example="1 K",
    start={"molecule": "water", "conditions.temperature": "300 K", "outputs.csv": "gas.csv"},
    sound=False,
)
