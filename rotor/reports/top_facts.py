"""Lines of a report on a top, common to all verbs, and the sources of its numbers: short citations, or full texts with --sources."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rotor.reports.screen import Facts, Part, listed
from rotor.requests.budget import ErrorBudget, ErrorTerm, size_text
from rotor.tops.components import known_dipole
from rotor.tops.facts import top_formula

if TYPE_CHECKING:
    from rotor.thermodynamics.sums.partition import PartitionFunction
    from rotor.tops.constants.constants import Constants
    from rotor.tops.top import Top

LONGEST = 72  # characters of one source in the short line
_CATALOGUE = re.compile(r"c\d{6} of (?:JPL|CDMS)(?: \([^()]*\d{4}[^()]*\))?")
_DATED = re.compile(r"^.*?\((?:\d{4}|[^()]*\b\d{4}\b[^()]*)\)")  # up to the first year in parentheses
_CONSTANT_NAMES = re.compile(r"[A-Z]\w{0,3}(?:, [A-Z]\w{0,3})*: ")  # a prefix that lists constants
_SPECIES = re.compile(r"(?:ground state[,;:]|[A-Z]\w* \d+\w+;) ")  # a prefix that names state or isotopologue
_TABLES = {"constants": "source", "dipole": "dipole_source", "polarizability": "polarizability_source",
           "spin weights": "weights_source"}  # fmt: skip


def short_source(text: str) -> str:
    """Shorten a source to its citation, or to its first clause if it cites nothing. The mark "unverified" stays.

    >>> short_source("fitted here to the 7 lines with J <= 10 of c018003 of JPL (Pickett et al. 1998), weighted by errors")
    'fitted to c018003 of JPL (Pickett et al. 1998)'
    >>> short_source("unverified: ground state; NIST CCCBDB release 22 has B = 1.1766 cm-1")
    'unverified: NIST CCCBDB release 22 has B = 1.1766 cm-1'
    >>> short_source("B, DJ: W. J. Orville-Thomas, J. T. Cox and W. Gordy, Millimeter Wave Spectra, J. Chem. Phys. 22 (1954); A: NIST")
    'B, DJ: W. J. Orville-Thomas, J. T. Cox and W. Gordy, Millimeter Wave Sp…'
    """
    marked = re.match(r"(?:[\w, ]+ )?unverified[:;] ?", text)
    mark, rest = (marked[0], text[marked.end() :]) if marked else ("", text)
    rest = _SPECIES.sub("", rest, count=1) if _SPECIES.match(rest) else rest
    if scaled := re.match(r"scaled from [^(;]+", rest):
        return mark + scaled[0].rstrip()
    if catalogue := _CATALOGUE.search(rest):
        verb = "fitted to " if "fitted" in rest[: catalogue.start()] else "from "
        return mark + verb + catalogue[0]
    dated = _DATED.match(rest)
    clause = dated[0] if dated else rest.partition(";")[0]
    if len(clause) > LONGEST:
        first = rest.partition(";")[0]
        clause = first if _CONSTANT_NAMES.match(first) else first.partition(":")[0]
    return mark + (clause if len(clause) <= LONGEST else clause[: LONGEST - 1].rstrip() + "…")


def source_facts(top: Top, tables: Sequence[str], whole: bool) -> list[tuple[str, str]]:
    """Sources of the named tables of a top (constants, dipole, polarizability, spin weights), short or `whole`."""
    texts = {table: getattr(top, _TABLES[table]) for table in tables if getattr(top, _TABLES[table])}
    if top.states is not None and top.states.source and "constants" in tables:
        texts["states"] = top.states.source
    if whole:
        return [(f"{table} from", text) for table, text in texts.items()]
    cited = [f"{table}: {short_source(text)}" for table, text in texts.items() if table != "spin weights"]
    longer = any(short_source(text) != text for text in texts.values())
    return [("sources", "; ".join(cited) + (" (--sources: all of it)" if longer else ""))] if cited else []


KINDS = {
    "linear": "linear molecule",
    "spherical": "spherical top",
    "prolate": "prolate symmetric top",
    "oblate": "oblate symmetric top",
    "asymmetric": "asymmetric top",
}

NOTHING_SEEN = "nothing that the molecule shows signs of; further states of vibration are not those of these constants"
NOTHING_KNOWN = "of constants alone, nuclear spins and motions of large amplitude are not known; a geometry shows them"


def error_facts(errors: Mapping[str, Any] | None) -> list[tuple[str, str]]:
    """The line of an error budget, from its JSON; empty for None."""
    if errors is None:
        return []
    from rotor.requests.budget import ErrorBudget

    name, _, text = ErrorBudget.from_json(errors).line().partition(": ")
    return [("errors", f"{name.removeprefix('errors ')}: {text}")]


def model_facts(report: Any) -> list[tuple[str, str]]:
    """Errors, effects in the model and effects left out (largest first), from `rotor.quantum.estimates.limits.limit_facts`.

    Of a motion without a Hamiltonian: errors, and what its content states as left out.
    """
    content = report.content
    if "limits" not in content:
        return [*error_facts(content.get("errors")), *listed("left out", content.get("left_out", ()))]
    from rotor.quantum.estimates.limits import Limit
    from rotor.requests.plan import left_out_texts

    present = [
        f"{effect['name']} {size_text(effect['size_mhz'], 'MHz')}" for effect in content["effects"] if effect["present"]
    ]
    sizes = (
        f"at J = {content['sizes_at_j']}: " + ", ".join(present) if present else "those of the parameters of the files"
    )
    facts = [*error_facts(content.get("errors")), ("effects", sizes)]
    if content.get("constants_reason"):
        return [*facts, ("left out", "not estimated: sizes follow from named constants")]
    known = [Limit(**limit) for limit in content["limits"]]
    limits = left_out_texts(known, lambda limit: limit.sentence(report.with_spins))
    unknown = (
        NOTHING_KNOWN if not content.get("spins") else NOTHING_KNOWN.replace("nuclear spins", "further nuclear spins")
    )
    return facts + listed("left out", limits or [NOTHING_SEEN if content["mass_u"] is not None else unknown])


def report_on_top(
    facts: Callable[[Any, Mapping[str, Any]], Facts],
    *parts: Callable[[Any, Any], Part | None],
    sources: Sequence[str] = ("constants",),
    title: Callable[[Any], str] = lambda answer: heading(answer.request.top),
) -> Callable[[Any, Any], Iterable[Part | None]]:
    """The function `show` of a verb on the top of its request: heading, facts, further parts; then sources, errors and what is left out.

    facts: of an answer and the content of its JSON. parts: of an answer and its report (`rotor.verbs.common.outputs.Report`).
    sources: tables of the top that are cited. title: of an answer.
    """

    def show(answer: Any, report: Any) -> Iterable[Part | None]:
        """The parts of the report."""
        yield title(answer)
        yield facts(answer, report.content)
        for part in parts:
            yield part(answer, report)
        yield [*source_facts(answer.request.top, sources, report.sources), *model_facts(report)]

    return show


def states_facts(top: Top) -> list[tuple[str, str]]:
    """Names and dipoles of vibrational states."""
    states = top.states
    if states is None:
        return []
    names = [f"{v} ({states.name_of(v)})" if states.names else str(v) for v in range(states.count)]
    facts = [("states", f"v = {', '.join(names)}")]
    for (up, low), moment in states.dipoles.items():
        where = f"in {states.name_of(up)}" if up == low else f"between {states.name_of(low)} and {states.name_of(up)}"
        facts.append(("", f"dipole {where}: {vector_text(moment)}"))
    return facts


def heading(top: Top) -> str:
    """Name, formula and kind in one line."""
    formula = top_formula(top)
    if formula:  # imported only here: the library takes some ms to load
        from rotor.formats.molecules.library import written_formula

        formula = written_formula(top.name, formula)
    names = ", ".join(dict.fromkeys(filter(None, (top.name, formula)))) or "constants"
    kappa = f" (κ = {top.kappa:.4f})" if top.kind == "asymmetric" and top.kappa is not None else ""
    return f"{names}: {KINDS[top.kind]}{kappa}"


def constants_text(top: Top) -> str:
    """A, B, C in MHz, their estimated error, and the number of distortion constants."""
    constants, errors = top.constants, top.estimated_errors_mhz
    text, more = constants.rigid_text(errors), constants.distortion_count
    if errors:
        text += f" (good to about {100 * top.estimated_error:.2g} %)"
    text += f", and {more} of distortion" if more else ", rigid"
    return text + (f" ({form_text(constants)})" if more and constants.reduction else "")


def rigid_fact(top: Top) -> tuple[str, str]:
    """A, B, C of a top whose motion is computed without distortion."""
    constants = zip("ABC", top.rotational_constants_mhz, strict=True)
    rigid = ", ".join(f"{name} {value:.10g}" for name, value in constants if math.isfinite(value))
    return "rigid top", f"{rigid} MHz, distortion neglected"


def form_text(constants: Constants) -> str:
    """Reduction and representation of an asymmetric top, such as "A-reduction, Ir"."""
    reduction = f"{constants.reduction}-reduction, " if constants.reduction else ""
    return f"{reduction}{constants.representation}"


def vector_text(vector: Sequence[float] | None) -> str:
    """A dipole as `μa 0, μb 1.8546, μc 0 D`."""
    if vector is None:
        return "not known"
    return (
        ", ".join(f"{name} {round(x, 6) + 0.0:.6g}" for name, x in zip(("μa", "μb", "μc"), vector, strict=True)) + " D"
    )


def dipole_text(top: Top) -> str:
    """The dipole of a top; an estimated dipole has one decimal, since its error is 0.2 D."""
    estimated = top.has_estimated_dipole and top.dipole_abc_debye is not None
    return vector_text(known_dipole(top.dipole_abc_debye, estimated)) + (" (estimated)" if estimated else "")


def tensor_text(top: Top) -> str:
    """A polarizability as `aa 1.528, bb 1.468, cc 1.415 Å³`, with the non-zero off-diagonal elements."""
    tensor = top.polarizability_abc_angstrom3
    if tensor is None:
        return "isotropic by symmetry" if top.kind == "spherical" else "not known"
    names = (("aa", 0, 0), ("bb", 1, 1), ("cc", 2, 2), ("ab", 0, 1), ("ac", 0, 2), ("bc", 1, 2))
    shown = [f"{name} {tensor[i][k]:.6g}" for name, i, k in names if i == k or tensor[i][k]]
    return ", ".join(shown) + " Å³"


_COMPONENTS = {
    "prolate": "each of K and -K", "oblate": "each of K and -K", "spherical": "each of the components of a level",
}  # fmt: skip


def weights_facts(top: Top, mapping: Mapping[str, int]) -> list[tuple[str, str]]:
    """Spin weights of the levels, for each vibrational state if the states have weights, else for the top."""
    states = top.states
    if top.internal_rotation is not None and not mapping:
        return [("spin weights", "by torsional species, from the nuclei of the turning groups")]
    if states is None or not states.weights:
        components = f" ({_COMPONENTS[top.kind]})" if mapping and top.kind in _COMPONENTS else ""
        return [("spin weights", weights_text(mapping) + components)]
    texts = [
        f"{states.name_of(v)}: {weights_text(weights.to_mapping())}" for v, weights in sorted(states.weights.items())
    ]
    texts[0] += f" ({_COMPONENTS[top.kind]})" if top.kind in _COMPONENTS else ""
    return listed("spin weights", texts)


def hyperfine_lines(used: dict[str, Any] | None) -> list[tuple[str, str]]:
    """The method that split the levels, and the estimated difference from the exact one."""
    if used is None:
        return []
    if used["method"] == "exact":
        return [("hyperfine", "exact: all N that a tensor connects")]
    estimate = f"{1000 * used['estimate_mhz']:.2g} kHz"
    return [("hyperfine", f"{used['method']}: differs from exact by less than {estimate}, estimated")]


def weights_text(mapping: Mapping[str, int]) -> str:
    """Spin weights as `ee 1, eo 3, oe 3, oo 1`."""
    return ", ".join(f"{name} {weight}" for name, weight in mapping.items()) or "not given: 1 for every level"


def values_text(values: Mapping[str, float]) -> str:
    """Constants as `chi_aa -4.22, chi_bb-cc 1.1`."""
    return ", ".join(f"{name} {value:.6g}" for name, value in values.items())


def q_text(partition: PartitionFunction, classical: float | None) -> str:
    """Q with its source, and its classical limit if there is one."""
    return f"{partition.q:.6g}, {partition.source}" + (f"; classical limit {classical:.6g}" if classical else "")


ERROR_KINDS = {
    "rounding": "bound", "truncation": "bound", "model": "size, within a factor of 3", "data": "one standard deviation",
    "statistics": "one standard deviation",
}  # fmt: skip


def error_parts(content: Mapping[str, Any]) -> list[Part]:
    """The table of errors of an answer; empty if its content has no budget."""
    return [f"errors of {content['errors']['of']}", error_rows(content["errors"])] if "errors" in content else []


def error_rows(content: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Rows (name, text) of the five error sources and their total, from the JSON of a budget."""
    budget = ErrorBudget.from_json(content)
    rows = [(name, _error_text(term, budget.unit, ERROR_KINDS[name])) for name, term in budget.terms.items()]
    total = budget.total
    return [*rows, ("total", "no: a term is not estimated" if total is None else size_text(total, budget.unit))]


def _error_text(term: ErrorTerm, unit: str, kind: str) -> str:
    if term.value is None:
        return term.text(unit)
    if not term.value:
        return f"{'exact' if kind == 'bound' else 'none'} ({term.source})"
    remedy = f"; {term.remedy} would lower it" if term.remedy else ""
    return size_text(term.value, unit) + f", {kind}: {term.source}{remedy}"
