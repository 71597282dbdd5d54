"""What comes in where a command is not declared: option texts become numbers, a source becomes a top with a dipole."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

from rotor.cli.shared.options import option
from rotor.cli.shared.output import note
from rotor.requests.field import Field
from rotor.requests.fill import Given
from rotor.requests.readers import Quantity, Reader
from rotor.verbs.molecule import Reading, read_molecule, top_of
from rotor.verbs.molecule import with_some_dipole as with_estimated_dipole

if TYPE_CHECKING:
    from rotor.tops.top import Top

T = TypeVar("T")


def json_option() -> Any:
    """The field of a group for the JSON that every verb can write."""
    return option(None, "--json", metavar="FILE", help="Everything printed, as JSON; - is standard output.")


def parsed(name: str, text: str, parse: Callable[[str], T]) -> T:
    """The value of an option; a ValueError says which option."""
    try:
        return parse(text)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def read_as(name: str, text: str, reader: Reader, none: str | None = None) -> Any:
    """The value of an option by a reader of declared fields; none: the word for None."""
    return Field(reader, "", option=name, none=none).read(text, "option")


def quantity(name: str, text: str, unit: str) -> float:
    """A number with an optional unit, in `unit`."""
    found: float = read_as(name, text, Quantity(unit))
    return found


def positive(name: str, text: str, unit: str) -> float:
    """The same, above zero."""
    found: float = read_as(name, text, Quantity(unit, above=0))
    return found


def read_top(source: str, isotopes: Sequence[str] | None = None) -> Top:
    """The top of a source; its notes go to standard error."""
    return top_of(_reading(source, isotopes))


def with_dipole(source: str, isotopes: Sequence[str] | None = None) -> Top:
    """The top of a source with an estimated dipole, noted as such, where none is known; ValueError where it cannot be estimated either."""
    reading = _reading(source, isotopes)
    return with_estimated_dipole(top_of(reading), reading)


def _reading(source: str, isotopes: Sequence[str] | None) -> Reading:
    given = Given({"molecule.source": source, "molecule.isotopes": tuple(isotopes) if isotopes else None}, "option")
    return Reading(read_molecule(given), "option", ".", note)
