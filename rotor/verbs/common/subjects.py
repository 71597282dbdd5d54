"""Subjects of verbs: a molecule read from its inputs."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rotor.frozen import dataclass
from rotor.requests.field import REQUIRED, all_fields
from rotor.requests.fill import Entries, read_instance, written_fields
from rotor.requests.readers import Custom, Field
from rotor.verbs.common.molecule import FIELDS, MoleculeInput, Reading, top_of
from rotor.verbs.common.verb import Note, Place, Subject, SubjectKind

if TYPE_CHECKING:
    from rotor.tops.top import Top
    from rotor.verbs.common.verb import Verb

INT_FILE_IN_SCENE = (
    "--save-scene: a scene cannot hold an .int file; the file and its .var already state the calculation"
)
FILES = ("molecule.source", "molecule.hessian")  # inputs that may name a file
MOLECULE = Field(
    Custom(str, scene_type=str | MoleculeInput), "a name, a file, SMILES:..., or a table", "molecule", default=REQUIRED,
)  # fmt: skip


@dataclass(frozen=True)
class OneMolecule(SubjectKind):
    """A molecule.

    without: inputs for which the verb has no option. prepare: adds to the top what the verb needs.
    further: dataclass of further inputs of the verb.
    """

    without: tuple[str, ...] = ()
    prepare: Callable[[Top, Reading, Entries], Top] = lambda top, reading, entries: top
    further: type | None = None
    scene_fields: ClassVar[tuple[Field, ...]] = (MOLECULE,)

    @cached_property
    def fields(self) -> Mapping[str, Field]:  # type: ignore[override]
        """The inputs of a molecule, and further ones."""
        return self._with_further(FIELDS)

    def _with_further(self, names: Iterable[str]) -> Mapping[str, Field]:
        further = {} if self.further is None else all_fields(self.further)
        return {FIELDS[name].identity: FIELDS[name] for name in names} | further

    @property
    def options(self) -> Mapping[str, Field]:
        """The inputs for which the verb has options."""
        return self._with_further(name for name in FIELDS if name not in self.without)

    def read(self, entries: Entries, place: Place, verb: Verb) -> Subject:
        """Read the molecule and prepare its top."""
        molecule: MoleculeInput = read_instance(MoleculeInput, entries)
        reading = Reading(molecule, entries.style, place.folder, place.note)
        top = self.prepare(top_of(reading), reading, entries)
        text = str(molecule.source or molecule.constants or "")
        further = None if self.further is None else read_instance(self.further, entries)
        return Subject({"top": top}, (molecule,), text, place.note, further=further)

    def saved(self, request: Any, subject: Subject, folder: Path) -> dict[str, Any]:
        """The inputs as entered, with files relative to the folder of the scene."""
        further = {} if subject.further is None else written_fields(subject.further)
        return {**saved_molecule(subject.molecules[0], folder), **further}


def file_name(raw: Any) -> Any:
    """A file name as text; other values, such as lines or a family, unchanged."""
    return os.fspath(raw) if isinstance(raw, os.PathLike) else raw


def saved_inputs(inputs: Any, folder: Path, what: str) -> dict[str, Any]:
    """Inputs by key, with files relative to the folder of the scene; ValueError if their source is no file but `what`."""
    if not isinstance(inputs.source, str):
        raise ValueError(f"a scene cannot hold {what}; give a file")
    content = written_fields(inputs)
    return {key: beside(value, folder) if isinstance(value, str) else value for key, value in content.items()}


def top_of_word(
    source: str,
    note: Note,
    isotopes: Sequence[str] = (),
    prepare: Callable[[Top, Reading], Top] = lambda top, reading: top,
) -> Top:
    """The top of a source on the command line. note: takes remarks."""
    values = {"molecule.source": source, "molecule.isotopes": tuple(isotopes) or None}
    reading = Reading(read_instance(MoleculeInput, Entries(values, "option")), "option", ".", note)
    return prepare(top_of(reading), reading)


def saved_molecule(molecule: MoleculeInput, folder: Path) -> dict[str, Any]:
    """The inputs of a molecule by dotted key, with files relative to the folder.

    Raises ValueError for sources that a scene cannot hold.
    """
    if molecule.source == "-":
        raise ValueError("--save-scene: the molecule came from standard input, which a scene cannot read; give a file")
    if molecule.source is not None and not isinstance(molecule.source, str):
        raise ValueError(
            f"a scene cannot hold an object of type {type(molecule.source).__name__}; give a name, a file, SMILES:... or constants"
        )
    if molecule.source is not None and molecule.source.endswith(".int"):
        raise ValueError(INT_FILE_IN_SCENE)
    content = {key: beside(v, folder) if key in FILES else v for key, v in written_fields(molecule).items()}
    return {"molecule": content["molecule.source"]} if list(content) == ["molecule.source"] else content


def beside(name: str, folder: Path) -> str:
    """Path of a file relative to a folder; other words unchanged."""
    return os.path.relpath(name, folder) if Path(name).is_file() else name
