"""From the molecule of a scene to a top."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

import msgspec

from rotor.requests.fill import Given
from rotor.verbs.molecule import Reading, read_molecule
from rotor.verbs.molecule import top_of as top_of_inputs

if TYPE_CHECKING:
    from rotor.tops.top import Top

T = TypeVar("T")
GIVEN = "given in the scene"


def named(field: str, make: Callable[[], T]) -> T:
    """What `make` makes; a ValueError says which field of the scene it is about."""
    try:
        return make()
    except ValueError as error:
        raise ValueError(f"{field}: {error}") from None


def top_of(molecule: Any, folder: str | os.PathLike[str] = ".") -> Top:
    """The top of the molecule of a scene that is in a folder.

    Raises ValueError, with the field, for contradictions and for what no top can have.

    >>> from rotor.scenes.sections import MoleculeSection
    >>> top_of(MoleculeSection(constants="B=57.6 GHz", dipole_abc=[0.1, 0.0, 0.0])).kind
    'linear'
    """
    values = {f"molecule.{name}": value for name, value in msgspec.to_builtins(molecule).items()}
    return top_of_inputs(Reading(read_molecule(Given(values, "key")), "key", folder))


def with_dipole(top: Top) -> Top:
    """The top with an estimated dipole where none is known.

    Raises ValueError where it cannot be estimated either.
    """
    from rotor.tops.estimated_dipole import with_dipole_estimate

    try:
        return with_dipole_estimate(top)
    except ValueError as error:
        raise ValueError(f"molecule: {error}: give dipole_abc, in principal axes (D)") from None
