"""A periodic box of atoms from a file in any format that ASE reads."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from rotor.checks import require_file

if TYPE_CHECKING:
    from ase import Atoms


def read_box(path: str | os.PathLike[str]) -> Atoms:
    """The last frame of a file, without its calculator; ValueError for an unreadable file and for a box without a cell."""
    from rotor.molecules.readers.ase_files import structures

    require_file(path)
    frames = structures(Path(path), "-1", "give a box of atoms in extended xyz, with Lattice and pbc")
    if not frames:
        raise ValueError(f"{path}: no structure in it; give a file with a box of atoms")
    atoms: Any = frames[-1]
    atoms.calc = None
    if not atoms.pbc.any():
        raise ValueError(f"{path}: has no periodic cell; a box needs one (in extended xyz, Lattice and pbc)")
    return cast("Atoms", atoms)
