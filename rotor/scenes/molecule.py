"""From the molecule of a scene to a top."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from rotor.molecules.readers.sdf_entries import entry_of
from rotor.scenes.scene import within
from rotor.scenes.sections import MoleculeSection

if TYPE_CHECKING:
    from rotor.molecules.molecule import Molecule
    from rotor.tops.top import Top

T = TypeVar("T")
GIVEN = "given in the scene"


def named(field: str, make: Callable[[], T]) -> T:
    """What `make` makes; a ValueError says which field of the scene it is about."""
    try:
        return make()
    except ValueError as error:
        raise ValueError(f"{field}: {error}") from None


def top_of(molecule: MoleculeSection, folder: str | os.PathLike[str] = ".") -> Top:
    """The top of the molecule of a scene that is in a folder.

    Raises ValueError, with the field, for contradictions and for what no top can have.

    >>> top_of(MoleculeSection(constants="B=57.6 GHz", dipole_abc=[0.1, 0.0, 0.0])).kind
    'linear'
    """
    top = _bare(molecule, folder)
    if molecule.dipole is not None and molecule.dipole_abc is not None:
        raise ValueError("molecule: dipole and dipole_abc: give one of them")
    if molecule.dipole_abc is not None:
        abc = molecule.dipole_abc
        top = named("molecule.dipole_abc", lambda: top.with_dipole(abc, GIVEN))
    if molecule.dipole is not None:
        top = named("molecule.dipole", lambda: _with_dipole(top, molecule))
    if molecule.polarizability is not None:
        numbers = molecule.polarizability
        top = named("molecule.polarizability", lambda: with_tensor(top, numbers))
    if molecule.spin_weights is not None:
        weights = molecule.spin_weights
        top = named("molecule.spin_weights", lambda: top.with_weights(weights, GIVEN))
    return _with_states(_with_spins(top, molecule), molecule)


def _bare(molecule: MoleculeSection, folder: str | os.PathLike[str]) -> Top:
    if (molecule.source is None) == (molecule.constants is None):
        raise ValueError("molecule: give either source or constants")
    if molecule.constants is None:
        return _from_source(molecule, folder)
    for name in ("isotopes", "calculator", "hessian", "symmetry_tolerance"):
        if getattr(molecule, name):
            raise ValueError(f"molecule.{name}: bare constants have no geometry; give a source")
    from rotor.tops.top import Top

    text = molecule.constants
    return named("molecule.constants", lambda: Top.from_constants(text, source=GIVEN))


def _from_source(molecule: MoleculeSection, folder: str | os.PathLike[str]) -> Top:
    from rotor.formats import read
    from rotor.tops.top import Top
    from rotor.units import parse_quantity

    source = str(molecule.source)
    beside = within(folder, source)
    if not source.startswith("SMILES:") and (Path(beside).is_file() or entry_of(beside) is not None):
        source = beside
    if source == "-":
        raise ValueError("molecule.source: '-': a scene reads no standard input; give a file")
    found: object = named("molecule.source", lambda: read(source, isotopes=",".join(molecule.isotopes) or None))
    if not isinstance(found, Top):
        raise ValueError(f"molecule.source: {source}: holds a {type(found).__name__}, not a molecule or constants")
    top = found
    if molecule.calculator is not None:
        name = molecule.calculator
        top = named("molecule.calculator", lambda: _refined(top, name))
    if molecule.symmetry_tolerance is not None:
        reach = named("molecule.symmetry_tolerance", lambda: parse_quantity(str(molecule.symmetry_tolerance), "Å"))
        top = named("molecule.symmetry_tolerance", lambda: top.with_symmetry_within(reach))
    if molecule.hessian is not None:
        top = named("molecule.hessian", lambda: _semirigid(top, molecule, folder))
    return top


def _geometry(top: Top) -> Molecule:
    if top.molecule is None:
        raise ValueError(f"{top.name or 'the source'} has constants alone; expected a geometry")
    return top.molecule


def _refined(top: Top, name: str) -> Top:
    from rotor.molecules.optimise import refine
    from rotor.tops.top import Top

    return Top.from_molecule(refine(_geometry(top), name))


def _semirigid(top: Top, molecule: MoleculeSection, folder: str | os.PathLike[str]) -> Top:
    """The top with the distortion that a Hessian gives, of a file or, by the word "calculator", of the calculator."""
    from rotor.molecules.force_field import force_field_from_calculator, read_hessian
    from rotor.molecules.optimise import calculator_by_name
    from rotor.tops.distortion import semirigid_top

    if molecule.hessian != "calculator":
        return semirigid_top(read_hessian(within(folder, str(molecule.hessian)), _geometry(top)))
    if molecule.calculator is None:
        raise ValueError("the word 'calculator' needs molecule.calculator; else give a file")
    return semirigid_top(force_field_from_calculator(_geometry(top), calculator_by_name(molecule.calculator)))


def _with_dipole(top: Top, molecule: MoleculeSection) -> Top:
    import numpy as np

    if top.frame is None:
        raise ValueError("this is in the frame of a geometry, and there is none here; use dipole_abc")
    return top.with_dipole((top.frame.axes @ np.array(molecule.dipole)).tolist(), GIVEN)


def _with_spins(top: Top, molecule: MoleculeSection) -> Top:
    if molecule.spin_constants is None:
        if molecule.spins is not None:
            raise ValueError("molecule.spins: says how large the spins of spin_constants are; give those too")
        return top
    from rotor.tops.spins.spin_constants import SpinConstants, refuse_other_nuclei

    text, spins = molecule.spin_constants, molecule.spins
    constants = named("molecule.spin_constants", lambda: SpinConstants.parse(text, spins, GIVEN))
    named("molecule.spin_constants", lambda: refuse_other_nuclei(constants, top.molecule))
    return replace(top, spin_constants=constants)


def _with_states(top: Top, molecule: MoleculeSection) -> Top:
    from rotor.tops.states.state_texts import KEYS, with_state_texts

    texts = {name: getattr(molecule, name) for name in KEYS}
    try:
        return with_state_texts(top, texts, GIVEN)
    except ValueError as error:
        raise ValueError(f"molecule.{error}") from None


def with_tensor(top: Top, numbers: list[float]) -> Top:
    """The top with a polarizability: 2 numbers along and across its axis, 3 of the diagonal, or 6 with ab, ac, bc."""
    if len(numbers) == 2 and top.kind in ("linear", "prolate", "oblate"):
        along, across = numbers
        numbers = [across, across, along] if top.kind == "oblate" else [along, across, across]
    if len(numbers) not in (3, 6):
        raise ValueError(f"{numbers}: expected aa, bb, cc or aa, bb, cc, ab, ac, bc, or along and across the axis")
    aa, bb, cc, ab, ac, bc = [*numbers, 0.0, 0.0, 0.0][:6]
    return top.with_polarizability([[aa, ab, ac], [ab, bb, bc], [ac, bc, cc]], GIVEN)


def with_dipole(top: Top) -> Top:
    """The top with an estimated dipole where none is known.

    Raises ValueError where it cannot be estimated either.
    """
    from rotor.tops.estimated_dipole import with_dipole_estimate

    try:
        return with_dipole_estimate(top)
    except ValueError as error:
        raise ValueError(f"molecule: {error}: give dipole_abc, in principal axes (D)") from None
