"""Reading and writing: `read` makes a top from any description of a molecule, `write` chooses a format by suffix."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.checks import require_file
from rotor.formats.packed import HARMLESS_BYTES, refuse_bomb
from rotor.formats.registry import find_reader, find_writer
from rotor.molecules.readers.sdf_entries import BUILT, parse_entry
from rotor.tops.constants.constants import Constants
from rotor.tops.magnetic import MagneticTensors
from rotor.tops.top import Top

if TYPE_CHECKING:
    from rotor.formats.molecules.molecule_file import MoleculeFile

Isotopes = Mapping[int | str, str] | str


def read(source: Any, *, isotopes: Isotopes | None = None) -> Any:
    """A top from any description of a molecule; lines from a .cat or .hitran file.

    Parameters
    ----------
    source : str, Path, Top, Constants, Molecule, ase.Atoms or rdkit.Chem.Mol
        A word is a path that exists, else a molecule of the library (`"water"`, `"H2CO"`), else one of ASE's g2 set;
        a path and a molecule of one name are an error. `"SMILES:C=O"` and `"InChI=1S/..."` are built with RDKit; `"-"` reads a geometry
        (xyz, sdf) or a TOML of constants from standard input. Paths: .xyz, .extxyz, .mol, .sdf (of several molecules
        `"many.sdf#3"` is the third), whatever
        `ase.io.read` knows; .toml: a molecule file or constants alone; .par, .var, .int: input of SPFIT and SPCAT;
        .cat: a catalogue; .lin: measured lines; .egy: levels; .hitran, and .par where its first line is a record of 160
        characters: HITRAN's lines. `rotor.formats.registry` has them all.
    isotopes : mapping or str, optional
        Substitutions such as `"1=2H"` (atom 1) or `"O=18O"` (every O). Measured constants of a library molecule are then
        carried over by the ratio of those calculated from its geometry, and a note says so (`rotor.tops.isotopes.isotopologues`).

    Returns
    -------
    Top, or Catalogue for a .cat file, HitranLines for one of HITRAN, LineList for .lin, LevelList for .egy

    Raises
    ------
    ValueError
        With the input, its place, the rule that it breaks and the remedy.

    Examples
    --------
    >>> read("CO").kind
    'linear'
    """
    if isinstance(source, Top):
        return _with_isotopes(source, isotopes)
    if isinstance(source, Constants):
        return _with_isotopes(Top.from_constants(source), isotopes)
    if isinstance(source, str) and not source.strip():
        raise ValueError("an empty text names no molecule: give a path, 'SMILES:...' or a name")
    if isinstance(source, str) and source != "-" and not source.startswith(BUILT):
        source = _meaning(source)
    if isinstance(source, Path):
        return _read_path(source, isotopes)
    if source == "-":
        return _read_standard_input(isotopes)
    return _with_isotopes(_geometry_top(source), isotopes)


def _geometry_top(source: Any) -> Top:
    from rotor.molecules.readers.read import read_molecule

    return Top.from_molecule(read_molecule(source))


def _g2_names() -> tuple[str, ...]:
    from rotor.molecules.readers.read import g2_names

    return g2_names()


def _meaning(word: str) -> Path | str:
    """The path of a word: an existing file, else a file of the library; else the word itself."""
    from rotor.formats.molecules.library import library_file

    library_path, path = library_file(word), Path(word)
    # ASE takes 0.7 s to load
    if path.exists() and (library_path or (not _looks_like_a_path(word) and word in _g2_names())):
        what = "a molecule of the library" if library_path else "a molecule of ASE's g2 set"
        raise ValueError(
            f"{word!r} is ambiguous: it is a path here and {what}; write '{os.path.join('.', word)}' for the path, "
            "or use another folder for the molecule"
        )
    if path.exists():
        return path
    if _CONSTANTS.match(word):
        raise ValueError(f"{word!r} is no file: constants go to --constants, in Python to constants=")
    if _looks_like_a_path(word):
        return path
    if library_path is None and word not in _g2_names():
        if _SMILES.fullmatch(word):
            raise ValueError(f"{word!r} is no file and no name of a molecule; did you mean 'SMILES:{word}'?")
        import difflib

        from rotor.formats.molecules.library import count_atoms, names

        known = dict.fromkeys([*names(), *_g2_names()])
        typed = word.casefold().replace("0", "o")  # a zero for the letter O, another case
        alike = [name for name in known if name.casefold() == typed]
        is_formula, atoms = _FORMULA.fullmatch(word), count_atoms(word)
        alike += [name for name in known if is_formula and _FORMULA.fullmatch(name) and count_atoms(name) == atoms]
        alike += [_OF_G2[name] for name in (re.sub("[-_]", " ", typed),) if name in _OF_G2]
        near = dict.fromkeys(alike or difflib.get_close_matches(word, known, n=3))
        meant = f"did you mean {', '.join(list(near)[:3])}? " if near else ""
        meant = next((f"did you mean {hint}? " for hint in _isotopologues(word, known)), meant)
        raise ValueError(
            f"{word!r} is no file here, no molecule of the library ('rotor molecules' lists it) and none of ASE's g2 set; "
            f"{meant}a SMILES is written 'SMILES:...'"
        )
    return library_path or word


_FORMULA = re.compile(r"(?:[A-Z][a-z]?\d*)+")
_OF_G2 = {
    "acetaldehyde": "CH3CHO", "acetamide": "CH3CONH2", "acetic acid": "CH3COOH", "acetone": "CH3COCH3", "allene": "C3H4_D2d",
    "butane": "trans-butane", "cyclopropane": "C3H6_D3h", "dimethyl ether": "CH3OCH3", "ethane": "C2H6", "ethanol": "CH3CH2OH",
    "hydrazine": "N2H4", "methanol": "CH3OH", "methylamine": "H3CNH2", "propane": "C3H8", "pyrrole": "C4H4NH", "silane": "SiH4",
    "thiophene": "C4H4S",
}  # fmt: skip  # molecules that the set has by their formulas
_ISOTOPE = re.compile(r"D(?![a-z])|(1[358]|17|3[346]|37|81)(C|N|O|S|Cl|Br)(?![a-z])")


def _isotopologues(word: str, known: Iterable[str]) -> Iterable[str]:
    """The known parents of a formula with isotopes such as DCl or 13CO, with their options; each element is replaced as a whole.

    >>> list(_isotopologues("DCl", ["HCl"])), list(_isotopologues("13C18O", ["CO"])), list(_isotopologues("CH2DOH", ["CH3OH"]))
    (['HCl --isotope H=2H'], ['CO --isotope C=13C --isotope O=18O'], [])
    >>> list(_isotopologues("HDO", ["H2O"]))
    ['H2O --isotope N=2H, N the number of an H']
    """
    isotopes = dict.fromkeys((match[2] or "H", match[1] or "2") for match in _ISOTOPE.finditer(word))
    parent = _ISOTOPE.sub(lambda match: match[2] or "H", word)
    if isotopes and parent in known and all(len(re.findall(rf"{e}(?![a-z])", parent)) == 1 for e, _ in isotopes):
        yield " ".join([parent, *(f"--isotope {element}={mass}{element}" for element, mass in isotopes)])
    half = re.sub(r"HH(?![a-z0-9])", "H2", parent)
    if half != parent and half in known and list(isotopes) == [("H", "2")]:
        yield f"{half} --isotope N=2H, N the number of an H"


_SMILES = re.compile(r"(?=.*[=#()\[\]])[A-Za-z0-9@+\-\[\]()=#]+")  # letters with a bond or a branch among them
_CONSTANTS = re.compile(r"\s*[ABC]\s*=\s*[\d.]")


def _looks_like_a_path(word: str) -> bool:
    return os.sep in word or "/" in word or bool(Path(word).suffix)


def _read_path(path: Path, isotopes: Isotopes | None) -> Any:
    if parse_entry(str(path)) is not None:
        return _with_isotopes(_geometry_top(path), isotopes)
    require_file(path)
    if path.stat().st_size == 0:
        raise ValueError(f"{path}: the file is empty")
    reader = find_reader(path)
    if reader is None:
        refuse_bomb(path)
    content = reader(path) if reader else _geometry_top(path)
    if isinstance(content, Top):
        return _with_isotopes(content, isotopes)
    if isotopes:
        raise ValueError(
            f"{path}: holds a {type(content).__name__}, which has no atoms to substitute; leave out the isotopes"
        )
    return content


def read_spcat_top(path: Path, *, errors: bool = False, alone: bool = True) -> Top:
    """The top of a .par or .var file with the dipole of the .int file of the same name, or of an .int file likewise.

    Constants in cm⁻¹ (FLAGS of the .int file) become MHz. errors: whether errors of parameters become uncertainties. alone:
    whether levels are those of the constants, with every K, which a note says where the file has fewer K.
    """
    from rotor.formats.spcat.hamiltonian.states import file_states
    from rotor.formats.spcat.names.named_top import named_top
    from rotor.formats.spcat.predict import FLAGS_IN_CM, files_in_mhz
    from rotor.formats.spcat.prediction_notes import range_notes
    from rotor.formats.spcat.text.int_file import read_int
    from rotor.formats.spcat.text.par import parameters_beside, read_par

    intensities = path.with_suffix(".int")
    parameters = parameters_beside(path) if path.suffix.lower() == ".int" else path
    file, light = read_par(parameters), read_int(intensities) if intensities.exists() else None
    if light is not None and light.request.flags >= FLAGS_IN_CM:
        file, light = files_in_mhz(file, light)
    try:
        top = named_top(file, light, errors=errors)
    except ValueError as error:
        files = f"{path} with {(intensities if path == parameters else parameters).name}" if light else str(path)
        raise ValueError(f"{files}: {error}") from None
    notes = range_notes(file_states(file), parameters.name) if alone else []
    return replace(top, notes=(*top.notes, *notes), symmetry_checked=False)


def _read_standard_input(isotopes: Isotopes | None) -> Top:
    import sys

    from rotor.molecules.readers.read import parse_molecule
    from rotor.molecules.readers.xyz import decode

    content = sys.stdin.buffer.read(HARMLESS_BYTES + 1)
    if len(content) > HARMLESS_BYTES:
        raise ValueError(
            f"standard input exceeds {HARMLESS_BYTES / 1e6:.0f} MB, more than a molecule needs; give a file"
        )
    text = decode(content, "standard input")
    if not text.strip():
        raise ValueError("standard input is empty; expected a geometry (xyz, sdf) or a TOML of constants")
    if any(line.strip().startswith("[constants]") for line in text.splitlines()):
        from rotor.formats.molecules.molecule_file import parse_molecule_file

        return file_top(parse_molecule_file(text, "standard input"), isotopes)
    return _with_isotopes(Top.from_molecule(parse_molecule(text, "standard input")), isotopes)


def _with_isotopes(top: Top, isotopes: Isotopes | None) -> Top:
    if not isotopes:
        return top
    from rotor.formats.molecules.fitted_isotopologue import with_fitted_isotopologue
    from rotor.tops.isotopes.isotopologues import isotopologue

    return with_fitted_isotopologue(isotopologue(top, isotopes).top)


def read_top_file(path: Path) -> Top:
    """The top that a molecule file in TOML describes."""
    from rotor.formats.molecules.molecule_file import read_molecule_file

    return file_top(read_molecule_file(path))


def file_top(file: MoleculeFile, isotopes: Isotopes | None = None) -> Top:
    """The top of a molecule file: with its constants if it has any, else with those of its geometry."""
    return _with_isotopes(_top_as_written(file), isotopes)


def _top_as_written(file: MoleculeFile) -> Top:
    geometry = Top.from_molecule(file.molecule) if file.molecule is not None else None
    if file.constants is None:
        assert geometry is not None  # the reader refuses a file with neither
        return replace(geometry, name=file.name, spin_constants=file.spin_constants, magnetic=_magnetic(file))
    return replace(
        geometry or Top.from_constants(file.constants),
        constants=file.constants,
        dipole_abc_debye=file.dipole_abc_debye,
        spin_weights=file.spin_weights,
        name=file.name,
        source=file.cited("constants"),
        dipole_source=file.cited("dipole"),
        weights_source=file.cited("spin_weights"),
        polarizability_abc_angstrom3=file.polarizability_abc_angstrom3,
        polarizability_source=file.cited("polarizability"),
        independent_errors=_uncertain_constants(file) < 2,
        level_table=file.levels,
        states=file.states,
        covariance=file.covariance,
        spin_constants=replace(file.spin_constants, source=file.cited("spins")) if file.spin_constants else None,
        magnetic=_magnetic(file),
        internal_rotation=file.internal_rotation,
    )


def _uncertain_constants(file: MoleculeFile) -> int:
    """Number of uncertain constants of the rotation and of internal rotors, whose correlations a file does not have."""
    turning = file.internal_rotation.uncertainties if file.internal_rotation else {}
    return len(file.constants.uncertainties if file.constants else ()) + len(turning)


def _magnetic(file: MoleculeFile) -> MagneticTensors | None:
    return replace(file.magnetic, source=file.cited("magnetic")) if file.magnetic else None


def write(thing: Any, path: str | os.PathLike[str], *, settings: Mapping[str, Any] | None = None) -> None:
    """Write lines, a catalogue, or any table of the package; the suffix of `path` names the format.

    Lines: .cat, .cat.gz, .hitran, .csv, .parquet, .json, and .states, ExoMol's, with .trans and .pf beside; catalogue: .cat, .cat.gz;
    HITRAN's lines: .hitran; these and every
    other table (levels, Raman lines, spectra, motions, thermodynamic functions, correlation functions, tests of
    equipartition, runs of a fluid): .csv, .parquet, .json; levels that were selected (`answer_levels`): .egy too. An existing
    file is replaced at the end, whole or not at all. settings: what the provenance shall say besides; for lines,
    `{"tag": 18003}` is the tag of a .cat, `{"molecule": 1, "isotopologue": 1, "abundance": 0.997}` what `hitran_lines` asks
    for. Parquet and JSON carry the provenance inside, the others in a file beside, `path` + ".provenance.json". Raises
    ValueError for a thing or a suffix that has no format.
    """
    find_writer(thing, path)(thing, path, settings or {})
