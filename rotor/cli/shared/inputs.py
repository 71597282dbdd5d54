"""What comes in: option texts become numbers, a source and its options become a top with a dipole."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

from rotor.checks import require_positive
from rotor.cli.shared.options import argument, option
from rotor.cli.shared.output import note

if TYPE_CHECKING:
    from rotor.molecules.molecule import Molecule
    from rotor.tops.spins.spin_constants import SpinConstants
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


@dataclass(frozen=True)
class Input:
    """The texts that say which top is meant; a verb takes those of them that it has a use for."""

    source: str | None = argument(help="File, name, SMILES:... or - for standard input.")
    constants: str | None = option(
        None, metavar="TEXT", help='Constants instead of a source: "A=9.2(1) B=3 C=2.5 GHz" (MHz).'
    )
    isotope: list[str] | None = option(
        None, metavar="1=2H", help="Another isotope, by atom number or element; repeatable."
    )
    dipole: str | None = option(None, metavar="X,Y,Z", help="Dipole in the frame of the input (D).")
    dipole_abc: str | None = option(None, metavar="A,B,C", help="Dipole in principal axes (D).")
    spin_weights: str | None = option(
        None, metavar="LIST", help='Nuclear-spin weights: "ee=1,eo=3,oe=3,oo=1", "even=1,odd=3".'
    )
    spin_constants: str | None = option(
        None, metavar="TEXT", help='Constants of spins: "chi_aa(14N)=-4.22 chi_bb-cc(14N)=1.1 MHz" (MHz).'
    )
    spins: str | None = option(
        None, metavar="LIST", help='Sizes and order of the spins: "S=1/2 14N"; "35Cl_1+35Cl_2" have a total spin.'
    )
    state_constants: str | None = option(
        None,
        metavar="TEXT",
        help='Further states and couplings: "E[1]=120GHz A[1]=... G_c[0,1]=450 W[0,1]=3 MHz" (MHz).',
    )
    state_dipoles: str | None = option(
        None, metavar="TEXT", help='Dipoles in and between states, axes a, b, c: "[1] 0,0,1.3 [0,1] 0,0,1.47" (D).'
    )
    state_weights: str | None = option(
        None, metavar="TEXT", help='Spin weights of states: "[0] even=1,odd=3 [1] none"; none: all its levels alike.'
    )
    state_symmetry: str | None = option(
        None, metavar="GROUP", help="Group of the states, whose couplings are checked by it: C2v, Cs(ab), C2(c), ..."
    )
    state_names: str | None = option(None, metavar="LIST", help="Names of all states, from 0 on: 0+,0-.")
    calculator: str | None = option(
        None, metavar="NAME", help="Refine the geometry with an ASE calculator of that name, such as xtb or psi4."
    )
    hessian: str | None = option(
        None,
        metavar="FILE",
        help="Quartic distortion from a Hessian at the geometry (hartree/bohr², rows or lower triangle), or, with the "
        "word 'calculator', from one that --calculator makes.",
    )
    symmetry_tolerance: str | None = option(
        None, metavar="DISTANCE", help="How far nuclei may be off the symmetry that is taken, such as 0.005 (Å)."
    )

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


def highest_j(text: str) -> int:
    """The J of `J<=2`, or of the number alone.

    >>> highest_j("J <= 2"), highest_j("3")
    (2, 3)
    """
    number = text.replace(" ", "").upper().removeprefix("J<=").removeprefix("J≤")
    if not number.isdecimal():
        raise ValueError(f"{text!r}: expected J<=2, or the number alone")
    return int(number)


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


def whole_range(name: str, text: str) -> tuple[int, int]:
    """First and last of a range of whole numbers, `2:5` or `3`."""
    parts = [part.strip() for part in text.split(":")]
    if len(parts) > 2 or not all(part.isdecimal() for part in parts):
        raise ValueError(f"{name}: {text!r}: expected a whole number or a range of them, such as 2:5")
    first, last = int(parts[0]), int(parts[-1])
    if first > last:
        raise ValueError(f"{name}: {text!r}: expected a range that rises, but {first} is above {last}")
    return first, last


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


def vector(name: str, text: str) -> tuple[float, float, float]:
    """Three components of a dipole in debye, from `x,y,z` with an optional unit at the end."""
    from rotor.units import parse_grid

    def parse(value: str) -> tuple[float, float, float]:
        """Three finite numbers."""
        numbers = parse_grid(value, "D").tolist() if ":" not in value else []
        if len(numbers) != 3 or not all(map(math.isfinite, numbers)):
            raise ValueError(f"{value!r}: expected three finite numbers, such as 0,0,1.85 (debye)")
        return numbers[0], numbers[1], numbers[2]

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


def read_top(given: Input) -> Top:
    """The top that the options mean, with the dipole and weights given by hand; its notes go to standard error."""
    _refuse_contradictions(given)
    top = _from_constants(given) if given.constants is not None else _from_source(given)
    if given.dipole_abc is not None:
        abc, said = vector("--dipole-abc", given.dipole_abc), "given in principal axes (--dipole-abc)"
        top = parsed("--dipole-abc", given.dipole_abc, lambda _: top.with_dipole(abc, said))
    if given.dipole is not None:
        xyz = vector("--dipole", given.dipole)
        top = parsed("--dipole", given.dipole, lambda _: _with_dipole_of_input(top, xyz))
    if given.spin_weights is not None:
        table = weights("--spin-weights", given.spin_weights)
        top = parsed("--spin-weights", given.spin_weights, lambda _: top.with_weights(table, "given (--spin-weights)"))
    if given.spin_constants is not None:
        top = replace(top, spin_constants=_spin_constants(given.spin_constants, given.spins, top))
    elif given.spins is not None:
        raise ValueError("--spins: says how large the spins of --spin-constants are; give those too")
    top = _with_states(top, given)
    from rotor.tops.plausible import implausible

    refuse_weights_of_another_kind(top)
    for text in (*top.notes, *implausible(top)):
        note(text)
    return top


def _with_states(top: Top, given: Input) -> Top:
    """The top with the states of the options, and what is to be said of their couplings among its notes."""
    texts = {name: text for name in STATES if (text := getattr(given, name)) is not None}
    if texts:
        from rotor.tops.states.state_texts import with_state_texts

        with fields_as_options(**STATES):
            top = with_state_texts(top, texts, f"given ({', '.join(STATES[name] for name in texts)})")
    notes = () if top.states is None else tuple(text for text in top.states.notes if text not in top.notes)
    return replace(top, notes=(*top.notes, *notes)) if notes else top


def _spin_constants(text: str, spins: str | None, top: Top) -> SpinConstants:
    from rotor.tops.spins.spin_constants import SpinConstants, parse_coupled, refuse_other_nuclei

    if spins is not None:
        parsed("--spins", spins, parse_coupled)

    def read(value: str) -> SpinConstants:
        """Constants of spins that the molecule has."""
        constants = SpinConstants.parse(value, spins, "given (--spin-constants)")
        refuse_other_nuclei(constants, top.molecule)
        return constants

    return parsed("--spin-constants", text, read)


def _refuse_contradictions(given: Input) -> None:
    if (given.source is None) == (given.constants is None):
        both = "both were given" if given.source is not None else "neither was given"
        raise ValueError(
            f"expected either a source or --constants, and {both}; give one of them, such as the name water"
        )
    if given.dipole is not None and given.dipole_abc is not None:
        raise ValueError("--dipole and --dipole-abc: give one of them, in the frame of the input or in principal axes")
    if given.isotopes and given.constants is not None:
        raise ValueError("--isotope: bare constants have no atoms; give the constants of the isotopologue itself")
    if given.calculator is not None and given.constants is not None:
        raise ValueError("--calculator: bare constants have no geometry to refine; give a molecule")
    if given.symmetry_tolerance is not None and given.constants is not None:
        raise ValueError("--symmetry-tolerance: bare constants have no nuclei; give a geometry")
    if given.hessian is not None and given.constants is not None:
        raise ValueError("--hessian: bare constants have no geometry that it belongs to; give a molecule")


def _from_constants(given: Input) -> Top:
    from rotor.tops.top import Top

    text = given.constants or ""
    top = parsed("--constants", text, lambda text: Top.from_constants(text, source="given (--constants)"))
    if not has_unit(text) and max(top.constants.values.values()) < USUAL_LEAST_MHZ:
        note(f"--constants: no unit is given, so the numbers are MHz; for GHz write '{text} GHz'")
    return top


def has_unit(text: str) -> bool:
    """Whether the text of an option has a unit of frequency somewhere.

    >>> has_unit("A=9.2 B=3 C=2.5 GHz"), has_unit("A=9.2(1) B=3"), has_unit("2:18"), has_unit("2GHz:18")
    (True, False, False, True)
    """
    return bool(re.search(r"[\d).]\s*(?:[kMGT]?Hz|cm(?:-1|\^-1|⁻¹)|1/cm|K)(?!\w)", text))


def _from_source(given: Input) -> Top:
    import rotor

    top: Top = rotor.read(given.source, isotopes=given.isotopes)
    if not isinstance(top, rotor.Top):
        raise ValueError(f"{given.source}: holds a {type(top).__name__.lower()}, not a molecule or constants")
    if given.calculator is not None:
        top = parsed("--calculator", given.calculator, lambda name: _refined(top, name))
    if given.symmetry_tolerance is not None:
        reach = positive("--symmetry-tolerance", given.symmetry_tolerance, "Å")
        top = parsed("--symmetry-tolerance", given.symmetry_tolerance, lambda _: top.with_symmetry_within(reach))
    if given.hessian is None:
        return top
    return parsed("--hessian", given.hessian, lambda path: _semirigid(top, path, given.calculator))


def _refined(top: Top, name: str) -> Top:
    from rotor.molecules.optimise import refine
    from rotor.tops.top import Top

    return Top.from_molecule(refine(_geometry(top), name))


def _semirigid(top: Top, path: str, calculator: str | None) -> Top:
    """The top of the geometry with the distortion that a Hessian gives, of a file or of the calculator."""
    from rotor.molecules.force_field import force_field_from_calculator, read_hessian
    from rotor.molecules.optimise import calculator_by_name
    from rotor.tops.distortion import semirigid_top

    if path != "calculator":
        return semirigid_top(read_hessian(path, _geometry(top)))
    if calculator is None:
        raise ValueError("the word 'calculator' needs --calculator NAME; else give a file")
    return semirigid_top(force_field_from_calculator(_geometry(top), calculator_by_name(calculator)))


def _geometry(top: Top) -> Molecule:
    if top.molecule is None:
        raise ValueError(f"{top.name or 'the source'} has constants alone; expected a geometry")
    return top.molecule


def _with_dipole_of_input(top: Top, dipole_debye: tuple[float, float, float]) -> Top:
    if top.frame is None:
        raise ValueError("this is in the frame of a geometry, and there is none here; use --dipole-abc")
    return top.with_dipole((top.frame.axes @ dipole_debye).tolist(), "given in the frame of the input (--dipole)")


def refuse_weights_of_another_kind(top: Top) -> None:
    """ValueError where the levels of lowest J show spin weights of another kind of top, or a coupling of unlike weights."""
    from rotor.quantum.solve import solve_levels

    solve_levels(top, 1, vectors=False)


def with_some_dipole(top: Top) -> Top:
    """The top with an estimated dipole, noted as such, where none is known; ValueError where it cannot be estimated either."""
    from rotor.tops.estimated_dipole import with_dipole_estimate

    try:
        found = with_dipole_estimate(top)
    except ValueError as error:
        of_input = "--dipole x,y,z (frame of the input) or " if top.frame is not None else ""
        raise ValueError(f"{error}: give {of_input}--dipole-abc a,b,c (principal axes)") from None
    for text in found.notes[len(top.notes) :]:
        note(text)
    return found
