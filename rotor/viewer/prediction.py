"""Predicted lines of the species of a session: tops, models and line lists from the records.

Line lists are computed by `rotor.spectra.lines` and cached: a pan is a search in sorted frequencies, a moved constant takes a new line
list.
"""

from __future__ import annotations

import math
import re
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.checks import no_molecule
from rotor.fitting.levels.top_levels import label_model
from rotor.fitting.parameters import with_names
from rotor.fitting.top_constants import ConstantSet, TopConstants
from rotor.formats.lines.assigned_lines import QUANTA
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.quantum.labels.labelled import MissingLevelsError
from rotor.quantum.labels.quanta import SPECIES_NUMBERS
from rotor.spectra.intensity import highest_j
from rotor.spectra.lines import DEFAULT_MIN_LGINT, Lines, line_list
from rotor.thermodynamics.sums.partition import partition_function
from rotor.tops.constants.constants import Constants
from rotor.tops.top import Top
from rotor.viewer.records import Species

if TYPE_CHECKING:
    from rotor.observed.model.species import SpeciesLines

T = TypeVar("T")
MOST_J = 250  # of levels, so that a page does not wait for minutes
REMEMBERED = 12  # cached line lists
WEAKEST = 1e-8  # of the strongest line, below which a line is not shown
ASSUMED_DEBYE = 1.0  # dipole component along each axis that symmetry allows, where the dipole is unknown


def constant_set(top: Top, hyperfine: bool) -> ConstantSet:
    """The constants of a top for a fit."""
    further = top.states is not None or top.internal_rotation is not None
    return TopConstants(top, hyperfine) if hyperfine or further else top.constants


_CONSTANTS = re.compile(r"\s*[^\W\d_]\w*\s*=\s*[-+\d.]")  # such as "A=2458.69 B=490.43 C=408.87 MHz"


_ISOTOPES = re.compile(r"\s*,((?:\s*[A-Za-z0-9]+\s*=\s*\d+[A-Z][a-z]?\s*,?)+)$")  # such as ", S=34S" behind "OCS"


def without_isotopes(source: str) -> tuple[str, str]:
    """Source and isotopes of a text: "OCS" and "S=34S" of "OCS, S=34S"; the name of a file has no isotopes."""
    match = _ISOTOPES.search(source)
    if match is None or _is_file(Path(source)) or not source[: match.start()]:
        return source, ""
    return source[: match.start()], match[1].strip(" ,")


def source_top(source: str) -> Top:
    """The top of a name, a file, SMILES:..., constants such as "B=6081 MHz", or an isotopologue such as "OCS, S=34S".

    Raises ValueError for a source that is not a molecule.
    """
    from rotor.formats import read

    if _CONSTANTS.match(source) and not _is_file(Path(source)):
        return Top.from_constants(source)
    source, isotopes = without_isotopes(source)
    top = read(source, isotopes=isotopes or None)
    if not isinstance(top, Top):
        raise no_molecule(source, top)
    return top


def with_assumed_dipole(top: Top) -> tuple[Top, str]:
    """The top with a dipole, and a remark where it is estimated, or assumed as 1 D along each allowed axis."""
    if top.dipole_abc_debye is not None:
        return top, ""
    from rotor.verbs.common.molecule import MoleculeInput, Reading, with_some_dipole

    remarks: list[str] = []
    try:
        return with_some_dipole(top, Reading(MoleculeInput(), "name", ".", remarks.append)), "; ".join(remarks)
    except ValueError:
        axes = {"linear": (1, 0, 0), "prolate": (1, 0, 0), "oblate": (0, 0, 1)}.get(top.kind, (1, 1, 1))
        dipole = tuple(ASSUMED_DEBYE * axis for axis in axes)
        return top.with_dipole(dipole, "assumed"), (
            f"{top.name or 'the molecule'}: dipole not known, {ASSUMED_DEBYE:g} D along each axis assumed; enter it with the constants"
        )


def species_record(
    source: str, colour: int, temperature_k: float, base: Callable[[str], Top] = source_top
) -> tuple[Species, str]:
    """The record of a molecule, and a remark on its dipole."""
    top, remark = with_assumed_dipole(base(source))
    constants = constant_set(top, False)
    record = Species(
        name=" ".join(top.name.split()) or source,
        source=source,
        constants=dict(constants.values),
        errors=dict(constants.uncertainties),
        free=tuple(name for name in constants.values if name in ("A", "B", "C")),
        temperature_k=temperature_k,
        dipole_abc_debye=top.dipole_abc_debye,
        colour=colour,
        reduction=constants.reduction or "",
        representation=constants.representation or "",
    )
    return record, remark


def with_hyperfine(record: Species, on: bool, base: Callable[[str], Top] = source_top) -> Species:
    """The record with or without its spin constants; ValueError for a source without spin constants."""
    if on == record.hyperfine:
        return record
    top = base(record.source) if record.source else None
    if on and (top is None or top.spin_constants is None):
        raise ValueError(f"{record.name}: its source has no constants of spins, so that no line is split")
    known = constant_set(top, True) if on and top is not None else None
    spins = {name: value for name, value in known.values.items() if "(" in name} if known is not None else {}
    plain = {name: value for name, value in record.constants.items() if "(" not in name}
    free = tuple(name for name in record.free if on or "(" not in name)
    return msgspec.structs.replace(record, constants={**plain, **spins}, free=free, hyperfine=on)


@dataclass(frozen=True, eq=False)
class Model:
    """A species for predictions and fits: its record, the top with the record's constants and dipole, the constants by name.

    file: source of the species, a path or a name.
    """

    record: Species
    top: Top
    constants: ConstantSet
    file: str = ""

    @property
    def quanta(self) -> tuple[str, ...]:
        """Names of the quantum numbers that label a level in assignments."""
        return self.constants.quanta if isinstance(self.constants, TopConstants) else QUANTA[self.top.kind]

    @property
    def halves(self) -> frozenset[str]:
        """Names of the half-integer quantum numbers, which are stored doubled."""
        return self.constants.halves if isinstance(self.constants, TopConstants) else frozenset()

    @property
    def effects(self) -> tuple[Any, ...]:
        """Effects of the Hamiltonian."""
        return self.constants.effects if isinstance(self.constants, TopConstants) else tuple(SEMI_RIGID)

    def calculated_mhz(self, upper: Ints, lower: Ints) -> Floats:
        """Frequencies (n,) of lines by their labels (n, k); nan for a level that does not exist."""
        labels, places = np.unique(np.concatenate([upper, lower]), axis=0, return_inverse=True)
        energies = np.full(len(labels), np.nan)
        exists = np.ones(len(labels), dtype=bool)
        while exists.any():
            try:
                levels = label_model(self.constants, labels[exists])
            except MissingLevelsError as error:
                exists[np.flatnonzero(exists)[error.places]] = False
                continue
            energies[exists] = levels.levels(np.array(list(self.constants.values.values())))[0]
            break
        places = places.reshape(-1)
        return np.asarray(energies[places[: len(upper)]] - energies[places[len(upper) :]])

    def labels(self, levels: Any, rows: NDArray[Any]) -> Ints:
        """Labels (n, k) of rows of levels in the order of `quanta`; symmetry species as numbers."""
        columns = [levels.quanta[name][rows] for name in self.quanta]
        return np.stack(
            [np.array([SPECIES_NUMBERS[x] for x in column]) if column.dtype.kind in "US" else column for column in columns],
            axis=1,
        ).astype(np.int64)  # fmt: skip


def species_model(record: Species, base: Callable[[str], Top] = source_top) -> Model:
    """The model of a record. base: gives the top of a source."""
    if not record.source:
        settings: dict[str, Any] = {
            "reduction": record.reduction or None,
            "representation": record.representation or None,
        }
        constants = Constants(**{**settings, **record.constants}, uncertainties=record.errors)
        top = Top.from_constants(constants, dipole_abc_debye=record.dipole_abc_debye, name=record.name)
        return Model(record, top, constants)
    top = with_assumed_dipole(base(record.source))[0]
    if record.dipole_abc_debye is not None and record.dipole_abc_debye != top.dipole_abc_debye:
        top = top.with_dipole(record.dipole_abc_debye, "set in the session")
    constants_of_source = constant_set(top, record.hyperfine)
    if dict(constants_of_source.values) == record.constants:
        return Model(record, top, constants_of_source)  # with level energies and all else that the source has
    constants_of_source = with_names(
        constants_of_source, [name for name in record.constants if name not in constants_of_source]
    )
    moved = constants_of_source.replace(**record.constants, uncertainties=record.errors)
    return Model(record, moved.top if isinstance(moved, TopConstants) else top.with_constants(moved), moved)


@dataclass(frozen=True, eq=False)
class Predicted:
    """The lines of a species in the band, rising in frequency, and their integrated absorption (n,)."""

    model: Model
    lines: Lines
    intensity: Floats

    @property
    def strongest(self) -> float:
        """The largest intensity; 0 without lines."""
        return float(self.intensity.max(initial=0.0))

    def between(self, first_mhz: float, last_mhz: float, limit: int) -> Ints:
        """Rows in a range; of more than `limit` rows, the strongest in each of `limit` equal parts of the range."""
        a, b = np.searchsorted(self.lines.frequency_mhz, (first_mhz, last_mhz))
        rows = np.arange(a, b)
        if len(rows) <= limit:
            return rows
        part = ((self.lines.frequency_mhz[a:b] - first_mhz) * (limit / (last_mhz - first_mhz))).astype(np.int64)
        order = np.lexsort((self.intensity[a:b], part))
        last = np.append(np.diff(part[order]) != 0, True)
        return np.asarray(rows[np.sort(order[last])])


class Predictions:
    """Line lists of species in the band of a spectrum, cached by their constants."""

    def __init__(self, band_mhz: tuple[float, float], folder: Path | None = None) -> None:
        self.band_mhz = band_mhz
        self.folder = (folder or Path()).resolve()
        self._tops: dict[str, Top] = {}
        self._lists: OrderedDict[bytes, Predicted] = OrderedDict()
        self._jmax: dict[tuple[str, float, int], int] = {}
        self._models: OrderedDict[bytes, Model] = OrderedDict()
        self._emitters: dict[bytes, SpeciesLines] = {}

    def top(self, source: str) -> Top:
        """The top of a source, read once."""
        if source not in self._tops:
            self._tops[source] = source_top(self.located(source))
        return self._tops[source]

    def stored(self, source: str) -> str:
        """A source as the session file names it: relative paths below its folder, else absolute paths."""
        source, isotopes = without_isotopes(source)
        behind, path = f", {isotopes}" if isotopes else "", Path(source)
        if not _is_file(path):
            return source + behind
        where = path.resolve()
        return (where.relative_to(self.folder) if where.is_relative_to(self.folder) else where).as_posix() + behind

    def located(self, source: str) -> str:
        """A source for the reader: absolute paths for files of the session's folder."""
        source, isotopes = without_isotopes(source)
        behind = f", {isotopes}" if isotopes else ""
        return (str(self.folder / source) if _is_file(self.folder / source) else source) + behind

    def model(self, record: Species) -> Model:
        """The model of a record."""
        known = _remembered(self._models, _key(record, temperature=False), lambda: self._model(record))
        return known if known.record == record else replace(known, record=record)

    def _model(self, record: Species) -> Model:
        return replace(species_model(record, self.top), file=self.located(record.source) if record.source else "")

    def lines(self, record: Species) -> Predicted:
        """The predicted lines of a record in the band.

        The highest J follows from the constants with which the species was added, so that it stays while constants move.
        """
        model = self.model(record)
        known = _remembered(self._lists, _key(record), lambda: self._predicted(model))
        return known if known.model.record == record else replace(known, model=model)

    def _predicted(self, model: Model) -> Predicted:
        record = model.record
        key = (record.source or record.name, record.temperature_k, len(record.constants))
        if key not in self._jmax:
            self._jmax[key] = _highest_j(model)
        lines = line_list(
            model.top,
            temperature_k=record.temperature_k,
            range_mhz=self.band_mhz,
            jmax=self._jmax[key],
            effects=model.effects,
        )
        intensity = lines.intensity_nm2_mhz
        strong = intensity >= WEAKEST * intensity.max(initial=0.0)
        return Predicted(model, lines.where(strong), intensity[strong])

    def emitter(self, record: Species) -> SpeciesLines:
        """The lines of a record for emission models, with Q(T)."""
        from rotor.observed.model.species import species_from_lines

        key = _key(record)
        if key not in self._emitters:
            self._emitters[key] = species_from_lines(self.lines(record).lines, record.name)
        return self._emitters[key]


def _highest_j(model: Model) -> int:
    """The J beyond which no line reaches the cut of `line_list`, at most `MOST_J`."""
    top, temperature = model.top, model.record.temperature_k
    assert top.dipole_abc_debye is not None
    q = partition_function(top, temperature, effects=model.effects)
    try:
        return min(highest_j(top, top.dipole_abc_debye, q, DEFAULT_MIN_LGINT), MOST_J)
    except ValueError:  # far above what is computed while a page waits
        return MOST_J


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a text that no path can be
        return False


def _key(record: Species, temperature: bool = True) -> bytes:
    """Key of a line list: all that it depends on."""
    number = record.temperature_k if temperature else 0.0
    content = (record.source, record.name, record.constants, record.dipole_abc_debye, record.hyperfine, number)
    return msgspec.json.encode(content)


def _remembered(memory: OrderedDict[bytes, T], key: bytes, make: Callable[[], T]) -> T:
    """The cached value of a key, computed at its first use; the value that was not used for longest is removed."""
    if key not in memory:
        memory[key] = make()
        if len(memory) > REMEMBERED:
            memory.popitem(last=False)
    memory.move_to_end(key)
    return memory[key]


def changed(record: Species, constants: Mapping[str, float]) -> Species:
    """The record with changed constants, which have no errors; ValueError for a value that is not finite."""
    for name, value in constants.items():
        if not math.isfinite(value):
            raise ValueError(f"{name}: {value}: expected a finite number (MHz)")
    errors = {name: error for name, error in record.errors.items() if name not in constants}
    return msgspec.structs.replace(record, constants={**record.constants, **constants}, errors=errors)
