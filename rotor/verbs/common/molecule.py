"""The molecule of a verb: its inputs on the command line, in scenes and in Python, and the top that they describe."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor.checks import no_molecule
from rotor.frozen import dataclass
from rotor.requests.field import SPINS, all_fields, declared
from rotor.requests.fill import Entries, naming, within
from rotor.requests.lists import Numbers, Pairs
from rotor.requests.readers import Names, Quantity, Text

if TYPE_CHECKING:
    from rotor.molecules.molecule import Molecule
    from rotor.tops.top import Top

USUAL_LEAST_MHZ = 100.0  # largest constant below which a missing unit gives a note
STATES = ("state_constants", "state_dipoles", "state_weights", "state_symmetry", "state_names")
DIPOLE, POLARIZABILITY = ("dipole", "dipole_abc"), ("polarizability", "anisotropy")
NUCLEI, REFINEMENT = ("spin_constants", "spins"), ("calculator", "hessian")
AXIAL = ("linear", "prolate", "oblate")  # kinds of top with one axis
_GEOMETRY = {
    "isotopes": "bare constants have no atoms; give the constants of the isotopologue itself",
    "calculator": "bare constants have no geometry to refine; give a molecule",
    "symmetry_tolerance": "bare constants have no nuclei; give a geometry",
    "hessian": "bare constants have no geometry that it belongs to; give a molecule",
}  # inputs that need a geometry, and the error without one


@dataclass(frozen=True, eq=False, repr=False)
class Source(Text):
    """What names a molecule: a text or a path; in Python also a top, a molecule, ase.Atoms or an RDKit molecule."""

    def read(self, raw: Any) -> Any:
        """The text, or the object."""
        if isinstance(raw, os.PathLike):
            return os.fspath(raw)
        plain = raw is None or isinstance(raw, str | bytes | int | float | complex | list | tuple | dict | set)
        return super().read(raw) if plain else raw


@dataclass(frozen=True)
class MoleculeInput:
    """Inputs of a molecule; either `source` or `constants` is given."""

    source: Any = declared(
        None,
        Source(),
        "File, name, SMILES:..., InChI=... or - for standard input",
        "molecule.source",
        option="SOURCE",
        example="water",
    )
    constants: str | None = declared(
        None, Text(), 'Constants instead of a source: "A=9.2(1) B=3 C=2.5 GHz" (MHz); only a unit at the end applies to all',
        "molecule.constants",
        common=True, example="A=9.2 B=3 C=2.5 GHz",
    )  # fmt: skip
    isotopes: tuple[str, ...] = declared(
        (), Names(metavar="1=2H"), "Isotope of an atom, by number (1=2H), atom (C1=13C) or element; repeatable",
        "molecule.isotopes", option="--isotope", common=True, example=["1=2H"],
    )  # fmt: skip
    dipole: tuple[float, ...] | None = declared(
        None, Numbers("D", (3,), "0,0,1.85 (debye)", "X,Y,Z"), "Dipole in the frame of the input (D)", "molecule.dipole",
        common=True, example=[0.0, 0.0, 1.85],
    )  # fmt: skip
    dipole_abc: tuple[float, ...] | None = declared(
        None, Numbers("D", (3,), "0,0,1.85 (debye)", "A,B,C"), "Dipole in principal axes (D)", "molecule.dipole_abc",
        common=True, example=[0.0, 1.85, 0.0],
    )  # fmt: skip
    polarizability: tuple[float, ...] | None = declared(
        None, Numbers("Å3", (), "aa,bb,cc or parallel,perpendicular"),
        "Polarizability in principal axes: aa,bb,cc[,ab,ac,bc] or parallel,perpendicular (Å³)", "molecule.polarizability",
        common=True, example=[8.0, 4.0],
    )  # fmt: skip
    anisotropy: float | None = declared(
        None, Quantity("Å3"), "α∥ - α⊥ of a linear or symmetric top (Å³), instead of the polarizability",
        "molecule.anisotropy", example=4.0,
    )  # fmt: skip
    spin_weights: Mapping[str, int] | None = declared(
        None, Pairs(int), 'Nuclear-spin weights: "ee=1,eo=3,oe=3,oo=1", "even=1,odd=3"', "molecule.spin_weights", panel=SPINS,
        example={"ee": 1, "eo": 3, "oe": 3, "oo": 1},
    )  # fmt: skip
    spin_constants: str | None = declared(
        None, Text(), 'Spin constants: "chi_aa(14N)=-4.22 chi_bb-cc(14N)=1.1 MHz" (MHz)', "molecule.spin_constants",
        panel=SPINS, example="chi_aa(14N)=-4.22 MHz",
    )  # fmt: skip
    spins: str | None = declared(
        None, Text(metavar="LIST"), 'Sizes and order of the spins: "S=1/2 14N"; "35Cl_1+35Cl_2" have a total spin', "molecule.spins",
        panel=SPINS, example="14N=1",
    )  # fmt: skip
    state_constants: str | None = declared(
        None, Text(), 'Further states and couplings: "E[1]=120GHz A[1]=... G_c[0,1]=450 W[0,1]=3 MHz" (MHz)',
        "molecule.state_constants", panel=SPINS, example="E[1]=120GHz B[1]=10GHz W[0,1]=3 MHz",
    )  # fmt: skip
    state_dipoles: str | None = declared(
        None, Text(), 'Dipoles in and between states, axes a, b, c: "[1] 0,0,1.3 [0,1] 0,0,1.47" (D)', "molecule.state_dipoles",
        panel=SPINS, example="[1] 0,0,1.3 [0,1] 0,0,1.47",
    )  # fmt: skip
    state_weights: str | None = declared(
        None, Text(), 'Spin weights of states: "[0] even=1,odd=3 [1] none"; none: all levels equal', "molecule.state_weights",
        panel=SPINS, example="[0] even=1,odd=3 [1] even=3,odd=1",
    )  # fmt: skip
    state_symmetry: str | None = declared(
        None, Text(metavar="GROUP"), "Symmetry group of the states, which checks their couplings: C2v, Cs(ab), C2(c), ...",
        "molecule.state_symmetry", panel=SPINS, example="C2v",
    )  # fmt: skip
    state_names: str | None = declared(
        None,
        Text(metavar="LIST"),
        "Names of all states, starting with v = 0: 0+,0-",
        "molecule.state_names",
        panel=SPINS,
        example="0+,0-",
    )
    internal_rotation: str | None = declared(
        None, Text(),
        'Internal rotation of methyl groups: "geometry" (barriers of similar molecules), "geometry V3=408cm-1", "scan" '
        '(--calculator, or MMFF94), or "RAM F=7.57cm-1 rho=0.33 V3=408cm-1"',
        "molecule.internal_rotation", panel=SPINS, example="RAM F=7.57cm-1 rho=0.3286 V3=407.6cm-1 Dab=0.1227cm-1",
    )  # fmt: skip
    calculator: str | None = declared(
        None, Text(metavar="NAME"), "Refine the geometry with an ASE calculator of that name, such as xtb or psi4",
        "molecule.calculator", example="xtb",
    )  # fmt: skip
    hessian: str | None = declared(
        None, Text(metavar="FILE"),
        "Hessian for the quartic distortion (hartree/bohr², rows or lower triangle), or, with the word "
        "'calculator', the Hessian of the calculator",
        "molecule.hessian", example="hessian.txt",
    )  # fmt: skip
    symmetry_tolerance: float | None = declared(
        None, Quantity("Å", above=0, metavar="DISTANCE"), "Displacement of nuclei within which a symmetry is accepted, such as 0.005 (Å)",
        "molecule.symmetry_tolerance", example="0.005 Å",
    )  # fmt: skip


FIELDS = {field.name: field for field in all_fields(MoleculeInput).values()}


@dataclass(frozen=True)
class Reading:
    """A molecule being read. style: how errors name its inputs. folder: of the files that it names. note: takes remarks."""

    inputs: MoleculeInput
    style: str = "name"
    folder: str | os.PathLike[str] = "."
    note: Callable[[str], None] = lambda _: None

    def named(self, name: str) -> str:
        """The name of an input in errors."""
        return FIELDS[name].called(self.style)

    def source(self, name: str, how: str = "") -> str:
        """The source of a number that the user gave, for provenance."""
        return f"given{how} ({self.named(name)})" if self.style != "name" else f"given{how}"

    def path(self, name: str) -> str:
        """Path of a file relative to the scene; other words unchanged."""
        beside = str(Path(self.folder) / name)
        return beside if self.style == "key" and not name.startswith("SMILES:") and is_file(beside) else name


def is_file(name: str) -> bool:
    """Whether a text names a file; False for text that no path can be, too long or with a zero byte."""
    try:
        return Path(name).is_file()
    except (OSError, ValueError):
        return False


def top_of(reading: Reading) -> Top:
    """The top that the inputs describe.

    Raises ValueError, with the name of the input, for contradictions and impossible values.

    >>> top_of(Reading(MoleculeInput(constants="B=57.6 GHz", dipole_abc=(0.1, 0.0, 0.0)))).kind
    'linear'
    """
    _refuse_contradictions(reading)
    top = _from_source(reading) if reading.inputs.constants is None else _from_constants(reading)
    for name, step in _STEPS.items():
        value = getattr(reading.inputs, name)
        if value is not None:
            with within(reading.named(name)):
                top = step(top, value, reading)
    top = _with_states(top, reading)
    from rotor.tops.plausible import implausible

    refuse_weights_of_another_kind(top)
    for text in (*top.notes, *implausible(top)):
        reading.note(text)
    return top


def _refuse_contradictions(reading: Reading) -> None:
    inputs, named = reading.inputs, reading.named
    if (inputs.source is None) == (inputs.constants is None):
        both = "both are given" if inputs.source is not None else "neither is"
        if reading.style == "key":
            raise ValueError("molecule: give either source or constants")
        source = "a source" if reading.style == "option" else named("source")
        raise ValueError(
            f"expected either {source} or {named('constants')}, and {both}; give one of them, such as the name water"
        )
    for first, other, more in (
        ("dipole", "dipole_abc", ", in the frame of the input or in principal axes"),
        ("polarizability", "anisotropy", ""),
    ):
        if getattr(inputs, first) is not None and getattr(inputs, other) is not None:
            raise ValueError(f"{named(first)} and {named(other)}: give one of them{more}")
    for name, text in _GEOMETRY.items() if inputs.constants is not None else ():
        if getattr(inputs, name):
            raise ValueError(f"{named(name)}: {text}")
    if inputs.spins is not None and inputs.spin_constants is None:
        raise ValueError(
            f"{named('spins')}: states the sizes of the spins in {named('spin_constants')}; give those too"
        )


def _from_constants(reading: Reading) -> Top:
    from rotor.tops.constants.constants import AxisOrderError
    from rotor.tops.constants.uncertain_numbers import mixed_units
    from rotor.tops.top import Top

    text = reading.inputs.constants or ""
    with within(reading.named("constants")):
        if bracketed := re.search(r"(\w[\w-]*[(\[][^()\[\]=]*[)\]](?:\[\d+\])?)\s*=", text):
            other = "spin_constants" if "(" in bracketed[1] else "state_constants"
            raise ValueError(f"{bracketed[1]} is not a rotational constant; give it with {reading.named(other)}")
        try:
            top = Top.from_constants(text, source=reading.source("constants"))
        except AxisOrderError as error:
            raise ValueError("; ".join(filter(None, (str(error), mixed_units(text))))) from None
    if mixed := mixed_units(text):
        reading.note(f"{reading.named('constants')}: {mixed}")
    if reading.style == "option" and not has_unit(text) and max(top.constants.values.values()) < USUAL_LEAST_MHZ:
        reading.note(
            f"{reading.named('constants')}: no unit is given: the numbers are taken as MHz; for GHz write '{text} GHz'"
        )
    return top


def has_unit(text: str) -> bool:
    """Whether the text of an option contains a unit of frequency.

    >>> has_unit("A=9.2 B=3 C=2.5 GHz"), has_unit("A=9.2(1) B=3"), has_unit("2:18"), has_unit("2GHz:18")
    (True, False, False, True)
    """
    return bool(re.search(r"[\d).]\s*(?:[kMGT]?Hz|cm(?:-1|\^-1|⁻¹)|1/cm|K)(?!\w)", text))


def range_without_unit(entries: Entries) -> str:
    """End of a sentence on missing lines: how a range without a unit was read."""
    text = entries.values.get("conditions.range")
    if entries.style != "option" or text is None or has_unit(text):
        return ""
    return f"; --range {text} has no unit and is taken as MHz: write {text}GHz for GHz"


def _from_source(reading: Reading) -> Top:
    from rotor.formats import read
    from rotor.molecules.readers.sdf_entries import LIST_SUFFIXES
    from rotor.tops.top import Top

    inputs = reading.inputs
    if isinstance(inputs.source, Top):
        return inputs.source
    source = reading.path(inputs.source) if isinstance(inputs.source, str) else inputs.source
    if source == "-" and reading.style == "key":
        raise ValueError(f"{reading.named('source')}: '-': a scene cannot read standard input; give a file")
    if isinstance(source, str) and source.lower().endswith(LIST_SUFFIXES) and is_file(source):
        kind = "a CSV file" if source.lower().endswith(".csv") else "a file of SMILES"
        raise ValueError(
            f"{source}: {kind} is a list of molecules, not a single one: write it into a scene, "
            f"molecule = \"{Path(source).name}\", and start that with 'rotor run'; 'rotor new info' prints a scene"
        )
    with within(reading.named("source")) if reading.style == "key" else nullcontext():
        top: object = read(source, isotopes=",".join(inputs.isotopes) or None)
    if not isinstance(top, Top):
        raise no_molecule(source, top)
    return top


def _geometry(top: Top) -> Molecule:
    if top.molecule is None:
        raise ValueError(f"{top.name or 'the source'} has constants only; expected a geometry")
    return top.molecule


def _refined(top: Top, name: str, reading: Reading) -> Top:
    """The top of the geometry that a calculator has refined."""
    from rotor.molecules.optimise import refine
    from rotor.tops.top import Top

    return Top.from_molecule(refine(_geometry(top), name))


def _semirigid(top: Top, hessian: str, reading: Reading) -> Top:
    """The top with quartic distortion from a Hessian: of a file or, by the word "calculator", of the calculator."""
    from rotor.molecules.force_field import force_field_from_calculator, read_hessian
    from rotor.molecules.optimise import calculator_by_name
    from rotor.tops.distortion import semirigid_top

    if hessian != "calculator":
        return semirigid_top(read_hessian(reading.path(hessian), _geometry(top)))
    calculator = reading.inputs.calculator
    if calculator is None:
        raise ValueError(f"the word 'calculator' needs {reading.named('calculator')}; otherwise give a file")
    return semirigid_top(force_field_from_calculator(_geometry(top), calculator_by_name(calculator)))


def _with_dipole_of_input(top: Top, dipole: tuple[float, ...], reading: Reading) -> Top:
    if top.frame is None:
        raise ValueError(f"needs the frame of a geometry; with constants use {reading.named('dipole_abc')}")
    vector = (top.frame.axes @ np.array(dipole)).tolist()
    return top.with_dipole(vector, reading.source("dipole", " in the frame of the input"))


def _with_polarizability(top: Top, numbers: tuple[float, ...], reading: Reading) -> Top:
    """The top with a polarizability (Å³): 2 numbers along and across the axis, 3 on the diagonal, or 6 with ab, ac, bc."""
    from rotor.tops.magnetic import tensor_for

    if len(numbers) not in (3, 6) and not (len(numbers) == 2 and top.kind in AXIAL):
        text = ",".join(f"{x:g}" for x in numbers)
        raise ValueError(
            f"{text!r}: expected aa,bb,cc or aa,bb,cc,ab,ac,bc, or parallel,perpendicular for a linear or symmetric top"
        )
    source = reading.source("polarizability", " in principal axes")
    return top.with_polarizability(tensor_for(top.kind, numbers), source)


def _with_anisotropy(top: Top, anisotropy: float, reading: Reading) -> Top:
    from rotor.tops.magnetic import tensor_for

    if top.kind not in AXIAL:
        raise ValueError(
            f"a top of the kind {top.kind} has no single anisotropy; give {reading.named('polarizability')} aa,bb,cc"
        )
    how = f"the anisotropy {reading.source('anisotropy')}; the mean, which exerts no torque, is left out"
    return top.with_polarizability(tensor_for(top.kind, (anisotropy, 0.0)), how)


def _with_spins(top: Top, text: str, reading: Reading) -> Top:
    from rotor.tops.spins.spin_constants import SpinConstants, refuse_other_nuclei

    constants = SpinConstants.parse(text, reading.inputs.spins, reading.source("spin_constants"))
    refuse_other_nuclei(constants, top.molecule)
    return replace(top, spin_constants=constants)


def _checked_spins(top: Top, text: str, reading: Reading) -> Top:
    from rotor.tops.spins.spin_constants import parse_coupled

    parse_coupled(text)
    return top


def _with_internal_rotation(top: Top, text: str, reading: Reading) -> Top:
    """The top with internal rotation of its methyl groups, from its geometry or from constants."""
    origin, *given = text.split()
    if origin in ("geometry", "scan"):
        from rotor.quantum.internal_rotation.from_geometry import with_internal_rotation

        calculator = (reading.inputs.calculator or "mmff") if origin == "scan" else None
        return with_internal_rotation(top, calculator, " ".join(given))
    from rotor.tops.internal_rotation import FRAMES, InternalRotationConstants

    try:
        return replace(top, internal_rotation=InternalRotationConstants.parse(text))
    except ValueError as error:
        if origin in FRAMES:
            raise
        raise ValueError(f"{error}; or the word geometry or scan, with values behind it such as V3=407.6cm-1") from None


_STEPS: Mapping[str, Callable[[Top, Any, Reading], Top]] = {
    "calculator": _refined,
    "symmetry_tolerance": lambda top, reach, _: top.with_symmetry_within(reach),
    "hessian": _semirigid,
    "dipole_abc": lambda top, abc, reading: top.with_dipole(abc, reading.source("dipole_abc", " in principal axes")),
    "dipole": _with_dipole_of_input,
    "polarizability": _with_polarizability,
    "anisotropy": _with_anisotropy,
    "spin_weights": lambda top, weights, reading: top.with_weights(dict(weights), reading.source("spin_weights")),
    "internal_rotation": _with_internal_rotation,
    "spins": _checked_spins,
    "spin_constants": _with_spins,
}  # what each input does to the top, in this order


def _with_states(top: Top, reading: Reading) -> Top:
    """The top with vibrational states; notes on their couplings are added to its notes."""
    texts = {name: text for name in STATES if (text := getattr(reading.inputs, name)) is not None}
    if texts:
        from rotor.tops.states.state_texts import with_state_texts

        source = f"given ({', '.join(map(reading.named, texts))})"
        with naming((FIELDS[name] for name in STATES), reading.style):
            top = with_state_texts(top, texts, source)
    notes = () if top.states is None else tuple(text for text in top.states.notes if text not in top.notes)
    return replace(top, notes=(*top.notes, *notes)) if notes else top


def refuse_weights_of_another_kind(top: Top) -> None:
    """Raise ValueError if spin weights belong to another kind of top, or a coupling joins levels of different weight."""
    from rotor.quantum.solve import solve_levels

    solve_levels(top, 1, vectors=False)


def with_some_dipole(top: Top, reading: Reading) -> Top:
    """The top, with an estimated dipole and a note if none is known; ValueError if none can be estimated."""
    from rotor.tops.estimated_dipole import with_dipole_estimate

    try:
        estimated = with_dipole_estimate(top)
    except ValueError as error:
        in_frame = f"{reading.named('dipole')} x,y,z (frame of the input) or " if top.frame is not None else ""
        raise ValueError(f"{error}: give {in_frame}{reading.named('dipole_abc')} a,b,c (principal axes)") from None
    for text in estimated.notes[len(top.notes) :]:
        reading.note(text)
    return estimated


def with_known_polarizability(top: Top, reading: Reading) -> Top:
    """The top; ValueError, with the remedy, if its polarizability is not known."""
    if top.polarizability_abc_angstrom3 is None and top.kind != "spherical":
        raise ValueError(
            f"the polarizability is not known: give {reading.named('polarizability')} aa,bb,cc (principal axes, Å³), or "
            "parallel,perpendicular for a linear or symmetric top"
        )
    return top
