"""Sources of the numbers in a report: one short line of citations, or full texts with --sources."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
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
