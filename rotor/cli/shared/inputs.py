"""What comes in: option texts become numbers, a source and its options become a top with a dipole."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from rotor.checks import require_positive
from rotor.cli.shared.options import argument, option
from rotor.cli.shared.output import note
from rotor.requests.fill import Given
from rotor.verbs.molecule import FIELDS, MoleculeInput, Reading, read_molecule, top_of
from rotor.verbs.molecule import with_some_dipole as with_estimated_dipole

if TYPE_CHECKING:
    from rotor.tops.top import Top

T = TypeVar("T")

USUAL_LEAST_MHZ = 100.0  # of the largest constant of a molecule: below it MHz without a unit are pointed out
MOST_TEMPERATURES = 100_000
MOST_TIMES = 10_000_000


STATES = {
    name: "--" + name.replace("_", "-")
    for name in ("state_constants", "state_dipoles", "state_weights", "state_symmetry", "state_names")
}  # fields of Input that are about further states, with their options


def json_option() -> Any:
    """The field of a group for the JSON that every verb can write."""
    return option(None, "--json", metavar="FILE", help="Everything printed, as JSON; - is standard output.")


def molecule_option(name: str) -> Any:
    """The option of an input of a molecule, as it is declared."""
    one = FIELDS[name]
    return option(None, one.flag, metavar=one.metavar or one.reader.metavar, help=f"{one.help}.")


@dataclass(frozen=True)
class Input:
    """The texts that say which top is meant; a verb takes those of them that it has a use for."""

    source: str | None = argument(help=f"{FIELDS['source'].help}.")
    constants: str | None = molecule_option("constants")
    isotope: list[str] | None = molecule_option("isotopes")
    dipole: str | None = molecule_option("dipole")
    dipole_abc: str | None = molecule_option("dipole_abc")
    spin_weights: str | None = molecule_option("spin_weights")
    spin_constants: str | None = molecule_option("spin_constants")
    spins: str | None = molecule_option("spins")
    state_constants: str | None = molecule_option("state_constants")
    state_dipoles: str | None = molecule_option("state_dipoles")
    state_weights: str | None = molecule_option("state_weights")
    state_symmetry: str | None = molecule_option("state_symmetry")
    state_names: str | None = molecule_option("state_names")
    calculator: str | None = molecule_option("calculator")
    hessian: str | None = molecule_option("hessian")
    symmetry_tolerance: str | None = molecule_option("symmetry_tolerance")

    sources: bool = option(False, "--sources", help="Print the sources of the numbers in full.")

    @property
    def isotopes(self) -> str | None:
        """All substitutions as one text."""
        return ",".join(self.isotope) if self.isotope else None

    @property
    def text(self) -> str:
        """The source as given, or the constants."""
        return self.source or self.constants or ""


def parsed(name: str, text: str, parse: Callable[[str], T]) -> T:
    """The value of an option; a ValueError says which option."""
    try:
        return parse(text)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def quantity(name: str, text: str, unit: str) -> float:
    """A number with an optional unit, in `unit`."""
    from rotor.units import MOST_KELVIN, parse_quantity

    found = parsed(name, text, lambda value: parse_quantity(value, unit))
    if unit == "K" and found > MOST_KELVIN:
        raise ValueError(f"{name}: {text!r}: expected a temperature up to {MOST_KELVIN:g} K; no molecule lasts beyond")
    return found


def positive(name: str, text: str, unit: str) -> float:
    """The same, above zero."""
    from rotor.units import LEAST_KELVIN

    found = require_positive(name, quantity(name, text, unit), unit)
    if unit == "K" and found < LEAST_KELVIN:
        raise ValueError(f"{name}: {text!r}: expected a temperature of {LEAST_KELVIN:g} K or more")
    return found


@contextmanager
def fields_as_options(**names: str) -> Iterator[None]:
    """Inside, a ValueError that names fields of a request names the options they come from.

    A name with an underscore is replaced wherever it stands; one that is an ordinary word, such as model, only at the start.
    """
    words = re.compile("|".join(rf"\b{name}\b" if "_" in name else rf"^{name}\b" for name in names))
    try:
        yield
    except ValueError as error:
        raise ValueError(words.sub(lambda found: names[found[0]], str(error))) from None


@contextmanager
def named(option: str) -> Iterator[None]:
    """Inside, a ValueError that names no option names this one."""
    try:
        yield
    except ValueError as error:
        text = str(error)
        raise ValueError(text if text.startswith("--") else f"{option}: {text}") from None


def temperatures(name: str, text: str) -> list[float]:
    """A grid or list of temperatures in K, refused unless all are above 0 K."""
    from rotor.units import LEAST_KELVIN, MOST_KELVIN, parse_grid

    found: list[float] = parsed(name, text, lambda value: parse_grid(value, "K").tolist())
    if not all(0 < t < float("inf") for t in found):
        raise ValueError(f"{name}: {text!r}: temperatures are above 0 K")
    if max(found, default=0.0) > MOST_KELVIN:
        raise ValueError(f"{name}: {text!r}: expected temperatures up to {MOST_KELVIN:g} K; no molecule lasts beyond")
    if min(found, default=1.0) < LEAST_KELVIN:
        raise ValueError(f"{name}: {text!r}: expected temperatures of {LEAST_KELVIN:g} K or more")
    if len(found) > MOST_TEMPERATURES:
        raise ValueError(f"{name}: {text!r}: at most {MOST_TEMPERATURES} temperatures in one table; ask for fewer")
    return found


def times(name: str, text: str | None, unit: str) -> tuple[float, ...] | None:
    """Finite times in `unit` from a grid or a list; None: none were given."""
    if text is None:
        return None
    from rotor.units import parse_grid

    def parse(value: str) -> tuple[float, ...]:
        """Times from a grid of bounded length."""
        count = value.rpartition(":")[2].strip()
        if ":" in value and count.isdecimal() and int(count) > MOST_TIMES:
            raise ValueError(f"{value!r}: at most {MOST_TIMES} times in one run; ask for fewer")
        found = tuple(parse_grid(value, unit).tolist())
        if not all(map(math.isfinite, found)):
            raise ValueError(f"{value!r}: a time is larger than a floating-point number can be")
        return found

    return parsed(name, text, parse)


def cut(name: str, text: str) -> float | None:
    """The least log10 of an intensity; None for `none`."""
    if text.strip().lower() == "none":
        return None

    def parse(value: str) -> float:
        """A finite number."""
        try:
            number = float(value.replace("−", "-"))
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise ValueError(f"{value!r} is not a finite number or 'none'")
        from rotor.spectra.intensity import MOST_LOG10

        if abs(number) > MOST_LOG10:
            raise ValueError(f"{value!r}: expected the log10 of an intensity, up to {MOST_LOG10} in size")
        return number

    return parsed(name, text, parse)


def weights(name: str, text: str) -> dict[str, int]:
    """Spin weights by class, from `ee=1,eo=3,oe=3,oo=1`."""
    table: dict[str, int] = {}
    for item in text.split(","):
        key, equals, number = (part.strip() for part in item.partition("="))
        if not (key and equals and number.isdecimal()) or key in table:
            raise ValueError(
                f"{name}: {item.strip()!r} in {text!r}: expected class=number, each class once, such as ee=1"
            )
        table[key] = int(number)
    return table


def reading_of(given: Input) -> Reading:
    """The inputs of a molecule as they were typed."""
    texts = {one.identity: getattr(given, name, None) for name, one in FIELDS.items() if name != "isotopes"}
    texts["molecule.isotopes"] = None if given.isotope is None else tuple(given.isotope)
    return Reading(read_molecule(Given(texts, "option")), "option", ".", note)


def read_top(given: Input) -> Top:
    """The top that the options mean, with the dipole and weights given by hand; its notes go to standard error."""
    return top_of(reading_of(given))


def with_some_dipole(top: Top) -> Top:
    """The top with an estimated dipole, noted as such, where none is known; ValueError where it cannot be estimated either."""
    return with_estimated_dipole(top, Reading(MoleculeInput(), "option", ".", note))
