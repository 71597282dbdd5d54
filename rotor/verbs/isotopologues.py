"""`isotopologues`: isotopologues of a molecule, by abundance or by substitution."""

from __future__ import annotations

from collections.abc import Iterable

from rotor.formats.molecules.isotopologue_request import IsotopologuesAnswer, IsotopologuesRequest, answer_isotopologues
from rotor.reports.screen import Part, Table, record_table
from rotor.reports.top_facts import error_facts, values_text
from rotor.tops.constants.uncertain_numbers import known_digits
from rotor.tops.isotopes.isotopologues import Isotopologue
from rotor.tops.top import Top
from rotor.verbs.common.molecule import POLARIZABILITY, REFINEMENT, STATES
from rotor.verbs.common.outputs import Report, tables
from rotor.verbs.common.subjects import OneMolecule
from rotor.verbs.common.verb import ErrorsShown, Verb

EXAMPLES = """\
  rotor isotopologues water
  rotor isotopologues CH3Cl --min-abundance 0.01 --json family.json
  rotor isotopologues H2CO --each C=13C --each O=18O
  rotor isotopologues water --site 2=2H --site 3=2H"""


def show(answer: IsotopologuesAnswer, report: Report) -> Iterable[Part | None]:
    """The isotopologues, and their spin constants if known."""
    with_spins = [isotopologue for isotopologue in answer.family if isotopologue.top.spin_constants]
    columns = {
        "isotopologue": "{0.label}",
        "spin constants (MHz)": lambda isotopologue: values_text(isotopologue.top.spin_constants.values),
    }
    yield _table(answer.request.top, answer.family)
    yield record_table("", columns, with_spins, columns)
    yield error_facts(report.content.get("errors"))


def _table(parent: Top, family: tuple[Isotopologue, ...]) -> Table:
    columns = ("isotopologue", "abundance", "ways", "mass (u)", "kind", "group", "A (MHz)", "B (MHz)", "C (MHz)", "± %",
               "axes", "turned (°)", "μa (D)", "μb (D)", "μc (D)", "spin weights")  # fmt: skip
    left = frozenset({"isotopologue", "kind", "group", "axes", "spin weights"})
    return Table(
        f"isotopologues of {parent.name or 'the molecule'}",
        columns,
        [_row(isotopologue) for isotopologue in family],
        left,
    )


def _rigid_texts(top: Top) -> list[str]:
    """A, B, C rounded to their estimated error, and that error in per cent."""
    if not top.estimated_errors_mhz:
        return [f"{x:.3f}" if x < float("inf") else "-" for x in top.rotational_constants_mhz] + [""]
    relative = top.estimated_error
    texts = [known_digits(x, relative * x) if x < float("inf") else "-" for x in top.rotational_constants_mhz]
    return [*texts, f"{100 * relative:.2g}"]


def _row(isotopologue: Isotopologue) -> list[str]:
    top = isotopologue.top
    weights = ", ".join(f"{name} {weight}" for name, weight in top.spin_weights.to_mapping().items())
    dipole, decimals = top.dipole_abc_debye, 1 if top.has_estimated_dipole else 4
    return [
        isotopologue.label,
        f"{isotopologue.abundance:.3e}",
        str(isotopologue.arrangements),
        f"{top.mass_u:.5f}",
        top.kind,
        top.symmetry.point_group if top.symmetry else "",
        *_rigid_texts(top),
        isotopologue.axes,
        f"{isotopologue.turned_degrees:.2f}",
        *(["-"] * 3 if dipole is None else [f"{round(mu, decimals) + 0.0:.{decimals}f}" for mu in dipole]),
        weights or "all equal",
    ]


VERB = Verb(
    name="isotopologues",
    about="Isotopologues: abundance, constants, kind, axes, dipole, spin weights, and spin constants if known.",
    examples=EXAMPLES,
    request=IsotopologuesRequest,
    answer=lambda request, work: answer_isotopologues(request),
    results=lambda answer: {"isotopologues": len(answer.table)},
    rows="isotopologues",
    records=lambda answer: None,
    show=show,
    outputs=tables("the isotopologues", "family"),
    subject=OneMolecule(
        ("constants", "isotopes", *POLARIZABILITY, "spin_weights", *STATES, "internal_rotation", *REFINEMENT, "symmetry_tolerance"),
    ),
    shown=ErrorsShown,
    accuracy="of the rotational constants",
    drawn=None,
    sound=False,
    start={"molecule": "water", "observables.min_abundance": 1e-4, "outputs.csv": "family.csv"},
)  # fmt: skip
