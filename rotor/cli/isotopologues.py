"""`rotor isotopologues`: the family of a molecule, by abundance or as asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import typer

from rotor.cli.shared import inputs
from rotor.cli.shared.inputs import Input, json_option
from rotor.cli.shared.options import grouped, option
from rotor.cli.shared.output import Files, Table, deliver, json_text, note, show_table

if TYPE_CHECKING:
    from rotor.tops.isotopes.isotopologues import Isotopologue
    from rotor.tops.top import Top

MIN_ABUNDANCE = 1e-4

EXAMPLES = """\b
Examples:
  rotor isotopologues water
  rotor isotopologues CH3Cl --min-abundance 0.01 --json family.json
  rotor isotopologues H2CO --each C=13C --each O=18O
  rotor isotopologues water --site 2=2H --site 3=2H"""


@dataclass(frozen=True)
class Options:
    """Which isotopologues are listed."""

    min_abundance: str | None = option(
        None,
        metavar="X",
        help=f"Least abundance in nature of those listed; {MIN_ABUNDANCE:g} unless others are asked for.",
    )
    each: list[str] | None = option(
        None, metavar="O=18O", help="Each atom of an element substituted, one at a time; repeatable."
    )
    site: list[str] | None = option(
        None, metavar="2=2H", help="The isotopologue with this atom substituted; repeated, all of them together."
    )
    json: str | None = json_option()


@grouped(
    given=(
        "sources", "constants", "isotope", "spin_weights", *inputs.STATES, "calculator", "hessian", "symmetry_tolerance",
    )
)  # fmt: skip
def command(context: typer.Context, given: Input, options: Options) -> None:
    """Isotopologues: abundance, constants, kind, axes, dipole and spin weights of each, and constants of spins if known."""
    files = Files.of(options)
    parent = inputs.read_top(given)
    least = options.min_abundance
    abundance = None if least is None else inputs.quantity("--min-abundance", least, "fraction")
    family = _family(parent, abundance, options.each or [], options.site or [])
    _tell(parent, family)

    content = {
        "command": context.obj,
        "input": given.source,
        "name": parent.name or None,
        "isotopologues": [record(one) for one in family],
    }
    deliver(files, {}, lambda: json_text(content), lambda: _show(parent, family))


def _family(
    parent: Top, min_abundance: float | None, each: Sequence[str], site: Sequence[str]
) -> tuple[Isotopologue, ...]:
    """Those above the least abundance, those of --each, that of --site; none of them twice."""
    from rotor.formats.molecules.fitted_isotopologue import with_fitted_isotopologue
    from rotor.tops.isotopes.isotopologues import isotopologue, isotopologues, single_substitutions

    family: list[Isotopologue] = []
    if min_abundance is not None or not (each or site):
        least = MIN_ABUNDANCE if min_abundance is None else min_abundance
        with inputs.fields_as_options(least="--min-abundance: least"):
            family += isotopologues(parent, min_abundance=least)
    for text in each:
        family += inputs.parsed("--each", text, lambda value: single_substitutions(parent, *_substitution(value)))
    if site:
        family.append(inputs.parsed("--site", ",".join(site), lambda text: isotopologue(parent, text)))
    return tuple({one.label: replace(one, top=with_fitted_isotopologue(one.top)) for one in family}.values())


def _tell(parent: Top, family: Sequence[Isotopologue]) -> None:
    """What has not been said of the parent, each text once with the isotopologues that it is about."""
    about: dict[str, list[str]] = {}
    for one in family:
        for text in one.top.notes:
            if text not in parent.notes:
                about.setdefault(text, []).append(one.label)
    for text, labels in about.items():
        note(f"{', '.join(labels)}: {text}")


def _substitution(text: str) -> tuple[str, str]:
    element, equals, name = (part.strip() for part in text.partition("="))
    if not (element.isalpha() and equals and name):
        raise ValueError(f"{text!r}: expected an element and its isotope, such as O=18O")
    return element, name


def record(one: Isotopologue) -> dict[str, Any]:
    """One isotopologue by the keys of docs/command_line.md."""
    from rotor.tops.facts import estimated_errors_mhz

    top, symmetry = one.top, one.top.symmetry
    return {
        "formula": one.formula,
        "label": one.label,
        "substituted": dict(one.substituted),
        "arrangements": one.arrangements,
        "abundance": one.abundance,
        "mass_u": top.mass_u,
        "kind": top.kind,
        "point_group": symmetry.point_group if symmetry else None,
        "constants_mhz": dict(top.constants.values),
        "estimated_errors_mhz": estimated_errors_mhz(top),
        "reduction": top.constants.reduction,
        "representation": top.constants.representation,
        "rotational_constants_mhz": top.rotational_constants_mhz,
        "axes_of_parent": one.axes,
        "turned_degrees": one.turned_degrees,
        "dipole_abc_debye": top.dipole_abc_debye,
        "spin_weights": top.spin_weights.to_mapping(),
        "spin_constants_mhz": dict(top.spin_constants.values) if top.spin_constants else None,
        "source": top.source or None,
        "notes": list(top.notes),
    }


def _show(parent: Top, family: Sequence[Isotopologue]) -> None:
    show_table(_table(parent, family))
    rows = [[one.label, _constants_text(one.top)] for one in family if one.top.spin_constants]
    if rows:
        print()
        show_table(
            Table(
                "",
                ("isotopologue", "constants of spins (MHz)"),
                rows,
                frozenset({"isotopologue", "constants of spins (MHz)"}),
            )
        )


def _constants_text(top: Top) -> str:
    """The constants of spins of a top by name, in MHz."""
    known = top.spin_constants.values if top.spin_constants else {}
    return ", ".join(f"{name} {value:.6g}" for name, value in known.items())


def _table(parent: Top, family: Sequence[Isotopologue]) -> Table:
    columns = ("isotopologue", "abundance", "ways", "mass (u)", "kind", "group", "A (MHz)", "B (MHz)", "C (MHz)", "± %",
               "axes", "turned (°)", "μa (D)", "μb (D)", "μc (D)", "spin weights")  # fmt: skip
    left = frozenset({"isotopologue", "kind", "group", "axes", "spin weights"})
    return Table(f"isotopologues of {parent.name or 'the molecule'}", columns, [_row(one) for one in family], left)


def _rigid_texts(top: Top) -> list[str]:
    """A, B, C with the digits that their estimated error leaves, and that error in per cent."""
    from rotor.reports.top_facts import known_digits
    from rotor.tops.facts import estimated_errors_mhz

    errors = estimated_errors_mhz(top)
    if not errors:
        return [f"{x:.3f}" if x < float("inf") else "-" for x in top.rotational_constants_mhz] + [""]
    name = next(iter(errors))
    relative = errors[name] / top.constants[name]
    texts = [known_digits(x, relative * x) if x < float("inf") else "-" for x in top.rotational_constants_mhz]
    return [*texts, f"{100 * relative:.2g}"]


def _row(one: Isotopologue) -> list[str]:
    top = one.top
    weights = ", ".join(f"{name} {weight}" for name, weight in top.spin_weights.to_mapping().items())
    dipole = top.dipole_abc_debye
    return [
        one.label,
        f"{one.abundance:.3e}",
        str(one.arrangements),
        f"{top.mass_u:.5f}",
        top.kind,
        top.symmetry.point_group if top.symmetry else "",
        *_rigid_texts(top),
        one.axes,
        f"{one.turned_degrees:.2f}",
        *(["-"] * 3 if dipole is None else [f"{round(mu, 4) + 0.0:.4f}" for mu in dipole]),
        weights or "all alike",
    ]
