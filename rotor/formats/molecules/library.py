"""The library of molecules: names and files, in the folders of the user and of the package.

Folders are searched in this order, and the first that knows a name wins, so that a user's own water is the water meant:

1. those named in the environment variable ROTOR_MOLECULES, separated as in PATH,
2. `.rotor/molecules` in the user's home folder, if there is one,
3. the one that comes with the package.

A molecule answers to the `name` and `names` of its file, and to the file's own name without `.toml`.
"""

from __future__ import annotations

import difflib
import os
import re
import tomllib
from functools import lru_cache
from pathlib import Path

from rotor.formats.molecules.molecule_file import MoleculeFile, read_molecule_file
from rotor.molecules.nuclei import data_folder

VARIABLE = "ROTOR_MOLECULES"

Stamp = tuple[tuple[str, int], ...]


def folders() -> tuple[Path, ...]:
    """The folders of molecule files, in the order in which they are searched.

    Raises ValueError where ROTOR_MOLECULES names a folder that does not exist.
    """
    named = [Path(item).expanduser() for item in os.environ.get(VARIABLE, "").split(os.pathsep) if item]
    for folder in named:
        if not folder.is_dir():
            raise ValueError(f"{VARIABLE}: {folder} is no folder; make it, or take it out of the variable")
    home = Path(os.path.expanduser("~")) / ".rotor" / "molecules"
    return (*named, *([home] if home.is_dir() else []), data_folder() / "molecules")


def names() -> dict[str, Path]:
    """All names and aliases with their files: formulas as written, words in lower case.

    A formula is a name with a capital after the first letter, or with a digit; anything else is a word.

    Raises ValueError if two files of one folder have the same name.
    """
    paths: dict[str, Path] = {}
    for folder in reversed(folders()):
        paths.update(_index(folder))
    return paths


def library_file(name: str) -> Path | None:
    """The file of a molecule by name, formula (`CO` is not `Co`) or word (in any case); None if there is none.

    >>> library_file("Heavy Water").name
    'D2O.toml'
    """
    for folder in folders():
        index = _index(folder)
        path = index.get(name) or index.get(name.casefold())
        if path is not None:
            return path
    return None


def molecule_path(name: str) -> Path:
    """The file of a molecule by name, as `library_file`; ValueError, with the nearest names, where there is none."""
    path = library_file(name)
    if path is None:
        name_by_lower_case = {key.casefold(): key for key in names()}
        near = [name_by_lower_case[key] for key in difflib.get_close_matches(name.casefold(), name_by_lower_case, n=3)]
        hint = f"did you mean {' or '.join(near)}? " if near else ""
        raise ValueError(f"no molecule {name!r} in the library: {hint}'rotor molecules' lists what it has")
    return path


def library_molecule(name: str) -> MoleculeFile:
    """The molecule of that name; ValueError, with the nearest names, for one that is not in the library.

    >>> library_molecule("Water").constants["B"] > 400_000
    True
    """
    return read_molecule_file(molecule_path(name))


def written_formula(name: str, formula: str) -> str:
    """The formula as the library writes it for a molecule of this name, else unchanged in Hill's order.

    An isotopologue of such a molecule, whose name has its own formula in brackets, is written like it where that says which atoms
    are replaced: all of an element, or some of its hydrogens.

    >>> written_formula("cyanoacetylene", "C3HN"), written_formula("", "O2S")
    ('HC3N', 'O2S')
    >>> written_formula("formaldehyde (CH[2H]O)", "CH[2H]O"), written_formula("cyanoacetylene (C2[13C]HN)", "C2[13C]HN")
    ('HDCO', 'C2[13C]HN')
    """
    parent = name.partition(" (")[0]
    path = library_file(parent) if parent else None
    if path is None:
        return formula
    spellings = [path.stem, *(key for key, file in names().items() if file == path)]
    same = (key for key in spellings if count_atoms(key) == count_atoms(formula))
    return next(same, None) or next(filter(None, (_substituted(key, formula) for key in spellings)), formula)


def _substituted(written: str, formula: str) -> str | None:
    """The isotopes of a formula in the order of a written one of the same elements; None where their places are not known.

    >>> _substituted("H2CO", "[13C][2H]2O"), _substituted("CH3CN", "C[13C]H3N")
    ('D2[13C]O', None)
    """
    tokens = re.findall(r"([A-Z][a-z]?)(\d*)", written)
    isotopes: dict[str, dict[str, int]] = {}
    for atom, count in count_atoms(formula).items():
        isotopes.setdefault(re.sub(r"[\[\]\d]", "", atom), {})[_SHORT.get(atom, atom)] = count
    elements = [element for element, _ in tokens]
    whole = "".join(f"{element}{count}" for element, count in tokens) == written
    if not whole or count_atoms(written) != {element: sum(counts.values()) for element, counts in isotopes.items()}:
        return None
    if any(len(counts) > 1 and (element != "H" or elements.count("H") > 1) for element, counts in isotopes.items()):
        return None
    isotope = {element: next(iter(counts)) for element, counts in isotopes.items()}
    return "".join(
        "".join(f"{atom}{n if n > 1 else ''}" for atom, n in isotopes[element].items())
        if len(isotopes[element]) > 1
        else isotope[element] + count
        for element, count in tokens
    )


_SHORT = {"[2H]": "D", "[3H]": "T"}


def count_atoms(formula: str) -> dict[str, int]:
    """Number of atoms of each element, or of each marked isotope, in a formula."""
    counts: dict[str, int] = {}
    for atom, number in re.findall(r"(\[\d+[A-Z][a-z]?\]|[A-Z][a-z]?)(\d*)", formula):
        counts[atom] = counts.get(atom, 0) + int(number or 1)
    return counts


def _index(folder: Path) -> dict[str, Path]:
    """Names with files of one folder, read again only if files were added, removed or changed."""
    with os.scandir(folder) as entries:
        files = [(entry.name, entry.stat().st_mtime_ns) for entry in entries if entry.name.endswith(".toml")]
    return _read_index(folder, tuple(sorted(files)))


@lru_cache(maxsize=32)
def _read_index(folder: Path, files: Stamp) -> dict[str, Path]:
    paths: dict[str, Path] = {}
    for path in (folder / name for name, _ in files):
        for key in dict.fromkeys(map(_key, (*_names_in(path), path.stem))):
            if paths.setdefault(key, path) != path:
                raise ValueError(f"{path}: the name {key!r} belongs to {paths[key]} already; give one of them another")
    return paths


def _names_in(path: Path) -> tuple[str, ...]:
    """`name` and `names` of a file, from the text before its first table; empty if that is invalid.

    An invalid file is only listed by its file name, so that it raises its error when requested and does not affect others.
    """
    head, _, _ = path.read_bytes().partition(b"\n[")
    try:
        content = tomllib.loads(head.decode("utf-8-sig"))
    except (ValueError, RecursionError):  # no TOML, no UTF-8
        return ()
    listed = content.get("names", [])
    listed_names = [content.get("name"), *(listed if isinstance(listed, list) else [])]
    return tuple(name for name in listed_names if isinstance(name, str) and name)


def _key(name: str) -> str:
    formula = any(letter.isdigit() or letter.isupper() for letter in name[1:]) and " " not in name
    return name if formula else name.casefold()
