"""The molecules that come with the package: every name and where its file is."""

from __future__ import annotations

from pathlib import Path

from rotor.formats.molecule_file import MoleculeFile, read_molecule_file
from rotor.molecules.nuclei import data_folder


def names() -> dict[str, Path]:
    """Every name and alias of the library with its file: formulas as written, words in lower case.

    A formula is a name with a capital after the first letter, or with a digit; anything else is a word.

    Raises ValueError where two files claim one name.
    """
    found: dict[str, Path] = {}
    for path in sorted((data_folder() / "molecules").glob("*.toml")):
        molecule = read_molecule_file(path)
        for name in dict.fromkeys(map(_key, (molecule.name, *molecule.names))):
            if name in found:
                raise ValueError(f"{path}: the name {name!r} belongs to {found[name]} already")
            found[name] = path
    return found


def library_file(name: str) -> Path | None:
    """The file of a molecule by name, formula (`CO` is not `Co`) or word (in any case); None if there is none."""
    known = names()
    return known.get(name) or known.get(name.casefold())


def library_molecule(name: str) -> MoleculeFile:
    """The molecule of that name; ValueError, with the names there are, for one that is not in the library.

    >>> library_molecule("Water").constants["B"] > 400_000
    True
    """
    path = library_file(name)
    if path is None:
        raise ValueError(f"no molecule {name!r} in the library; it has {', '.join(sorted(names()))}")
    return read_molecule_file(path)


def _key(name: str) -> str:
    formula = any(letter.isdigit() or letter.isupper() for letter in name[1:]) and " " not in name
    return name if formula else name.casefold()
