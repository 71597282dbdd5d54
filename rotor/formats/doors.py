"""How things come in and go out: `read` makes a top of whatever means a molecule, `write` chooses a format by suffix."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from rotor.constants import Constants
from rotor.formats.library import library_file
from rotor.formats.molecule_file import MoleculeFile, parse_molecule_file, read_molecule_file
from rotor.molecules.molecule import Molecule
from rotor.molecules.readers import g2_names, read_molecule
from rotor.top import Top

Isotopes = Mapping[int | str, str] | str


def read(source: Any, *, isotopes: Isotopes | None = None) -> Any:
    """A top from whatever means a molecule; from a .cat file its catalogue.

    Parameters
    ----------
    source : str, Path, Top, Constants, Molecule, ase.Atoms or rdkit.Chem.Mol
        A word is a path that exists, else a molecule of the library (`"water"`, `"H2CO"`), else one of ASE's g2 set;
        a path and a molecule of one name are an error. `"SMILES:C=O"` is built with RDKit; `"-"` reads a geometry
        (xyz, sdf) or a TOML of constants from standard input. Paths: .xyz, .extxyz, .mol, .sdf, whatever
        `ase.io.read` knows; .toml: a molecule file or constants alone; .par, .var, .int: input of SPFIT and SPCAT;
        .cat: a catalogue.
    isotopes : mapping or str, optional
        Substitutions such as `"1=2H"` (atom 1) or `"O=18O"` (every O). A molecule of the library then loses its measured
        constants, since they belong to another isotopologue, and becomes the rigid top of its geometry.

    Returns
    -------
    Top, or Catalogue for a .cat file

    Raises
    ------
    ValueError
        What was read, where, which rule it breaks and what would do.

    >>> read("CO").kind
    'linear'
    """
    if isinstance(source, Top):
        return source if not isotopes else _from_molecule(_geometry_of(source), isotopes)
    if isinstance(source, Constants):
        return Top.from_constants(source)
    if isinstance(source, str) and source != "-" and not source.startswith("SMILES:"):
        source = _meaning(source)
    if isinstance(source, Path):
        return _read_path(source, isotopes)
    if source == "-":
        return _read_standard_input(isotopes)
    return _from_molecule(read_molecule(source), isotopes)


def _meaning(word: str) -> Path | str:
    """The path that a bare word names: a file that exists, else a file of the library; else the word itself."""
    known, path = library_file(word), Path(word)
    if path.exists() and (known or word in g2_names()):
        what = "a molecule of the library" if known else "a molecule of ASE's g2 set"
        raise ValueError(
            f"{word!r} is ambiguous: it is a path here and {what}; write '{os.path.join('.', word)}' for the path, "
            "or use another folder for the molecule"
        )
    if path.exists() or _looks_like_a_path(word):
        return path
    return known or word


def _looks_like_a_path(word: str) -> bool:
    return os.sep in word or "/" in word or bool(Path(word).suffix)


def _read_path(path: Path, isotopes: Isotopes | None) -> Any:
    if not path.exists():
        raise ValueError(f"{path}: no such file")
    if path.is_dir():
        raise ValueError(f"{path}: is a folder; give a file in it")
    if path.stat().st_size == 0:
        raise ValueError(f"{path}: the file is empty")
    suffixes = "".join(path.suffixes[-2:]).lower()
    if suffixes.endswith((".cat", ".cat.gz")):
        from rotor.formats.spcat.cat import read_cat

        return read_cat(path)
    if suffixes.endswith((".par", ".var", ".int")):
        return _read_spcat(path)
    if suffixes.endswith(".toml"):
        return top_of_file(read_molecule_file(path), isotopes)
    return _from_molecule(read_molecule(path), isotopes)


def _read_spcat(path: Path) -> Top:
    """The top of a .par or .var file, with the dipole of the .int file beside it; or of an .int file likewise."""
    from rotor.formats.spcat.int_file import read_int
    from rotor.formats.spcat.model import top_of
    from rotor.formats.spcat.par import read_par

    intensities = path.with_suffix(".int")
    parameters = path
    if path.suffix.lower() == ".int":
        beside = [path.with_suffix(suffix) for suffix in (".var", ".par")]
        parameters = next((p for p in beside if p.exists()), path)
        if parameters == path:
            raise ValueError(f"{path}: an .int file has no constants; its .var or .par must stand beside it")
    return top_of(read_par(parameters), read_int(intensities) if intensities.exists() else None)


def _read_standard_input(isotopes: Isotopes | None) -> Top:
    import sys

    from rotor.molecules.readers import parse_molecule
    from rotor.molecules.xyz import decode

    text = decode(sys.stdin.buffer.read(), "standard input")
    if not text.strip():
        raise ValueError("standard input is empty; a geometry (xyz, sdf) or a TOML of constants is wanted")
    if any(line.strip().startswith("[constants]") for line in text.splitlines()):
        return top_of_file(parse_molecule_file(text, "standard input"), isotopes)
    return _from_molecule(parse_molecule(text, "standard input"), isotopes)


def _geometry_of(top: Top) -> Molecule:
    if top.molecule is None:
        raise ValueError(f"isotopes cannot be changed in {top.name or 'constants alone'}: there is no geometry")
    return top.molecule


def _from_molecule(molecule: Molecule, isotopes: Isotopes | None) -> Top:
    return Top.from_molecule(molecule.with_isotopes(isotopes) if isotopes else molecule)


def top_of_file(file: MoleculeFile, isotopes: Isotopes | None = None) -> Top:
    """The top that a molecule file describes: its constants if it has some, else those of its geometry."""
    geometry = Top.from_molecule(file.molecule) if file.molecule is not None else None
    if isotopes:
        if file.molecule is None:
            raise ValueError(f"{file.name}: isotopes cannot be changed, the file has constants but no geometry")
        top = _from_molecule(file.molecule, isotopes)
        note = f"the measured constants of {file.name} belong to another isotopologue; these are of its rigid geometry"
        return replace(
            top, name=f"{file.name} ({top.molecule.formula if top.molecule else ''})", notes=(*top.notes, note)
        )
    if file.constants is None:
        assert geometry is not None  # the reader refuses a file with neither
        return replace(geometry, name=file.name)
    return replace(
        geometry or Top.from_constants(file.constants),
        constants=file.constants,
        dipole_abc_debye=file.dipole_abc_debye,
        spin_weights=file.spin_weights,
        name=file.name,
        source=file.sources.get("constants", ""),
        dipole_source=file.sources.get("dipole", ""),
        weights_source=file.sources.get("spin_weights", ""),
    )


def write(thing: Any, path: str | os.PathLike[str], *, settings: Mapping[str, Any] | None = None) -> None:
    """Write lines, a catalogue, a spectrum or a motion in the format that the suffix of `path` names.

    Lines: .cat, .cat.gz, .csv, .parquet, .json; catalogue: .cat, .cat.gz; spectrum, motion: .csv. An existing file is
    replaced at the end, whole or not at all. settings: what the provenance shall say besides; for lines, `{"tag": 18003}` is the tag
    of a .cat. Raises ValueError for a thing or a suffix that has no format.
    """
    from rotor.classical.motion import Motion
    from rotor.formats.spcat.catalogue import Catalogue
    from rotor.spectra.lines import Lines

    if isinstance(thing, Motion):
        from rotor.formats.motion_tables import write_motion

        return write_motion(thing, path, settings)
    if isinstance(thing, Lines):
        from rotor.formats.line_tables import write_lines

        return write_lines(thing, path, settings)
    if isinstance(thing, Catalogue) and os.fspath(path).lower().endswith((".cat", ".cat.gz")):
        from rotor.formats.spcat.cat import write_cat

        return write_cat(thing, path)
    raise ValueError(f"{path}: there is no format of that suffix for a {type(thing).__name__}")
