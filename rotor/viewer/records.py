"""Records of a session (species, assigned lines, settings), which are immutable.

A state maps keys such as `species/1`, `line/12` and `settings` to records. An action gives a new state and a `Step`: the changed records
before and after it, for undo and redo. docs/view.md describes the JSON of the session file.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType

import msgspec

SCHEMA = 1
COLOURS = 7  # of the page's palette


class SpectrumFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The file of the observed spectrum: path from the folder of the session file, hash and number of points.

    axis_unit, rest_mhz (of a velocity axis), unit, noise: stated by the user for files that lack them.
    """

    path: str
    sha256: str
    points: int
    axis_unit: str | None = None
    rest_mhz: float | None = None
    unit: str | None = None
    noise: float | None = None


class FitSummary(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The last fit of a species. before: initial constants (MHz). open: combinations of constants that the lines do not determine.

    suspect: numbers of lines that are probably assigned wrongly; without them the weighted rms is `rms_without`.
    """

    converged: bool
    reason: str
    lines: int
    rms_mhz: float | None
    weighted_rms: float | None
    before: dict[str, float]
    open: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    suspect: tuple[int, ...] = ()
    rms_without: float | None = None


class Species(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="species"):
    """A molecule whose lines are predicted.

    source: a name, a file or SMILES:...; empty for constants alone, with `reduction` and `representation`. constants, errors (MHz).
    free: constants that a refit varies. scale: of the sticks. column_per_cm2, velocity_km_s, fwhm_km_s: of the emission model.
    """

    name: str
    source: str
    constants: dict[str, float]
    errors: dict[str, float] = {}
    free: tuple[str, ...] = ()
    temperature_k: float = 300.0
    dipole_abc_debye: tuple[float, float, float] | None = None
    scale: float = 1.0
    visible: bool = True
    colour: int = 0
    hyperfine: bool = False
    reduction: str = ""
    representation: str = ""
    column_per_cm2: float = 1e14
    velocity_km_s: float = 0.0
    fwhm_km_s: float = 1.0
    fit: FitSummary | None = None


class Line(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="line"):
    """An assigned line. species: number of its species. upper, lower: quantum numbers, half-integers doubled.

    Lines with the same `blend` number belong to a single measured frequency. width_mhz: full width at half maximum of the fitted peak.
    """

    species: int
    upper: tuple[int, ...]
    lower: tuple[int, ...]
    frequency_mhz: float
    error_mhz: float
    blend: int
    weight: float = 1.0
    rejected: bool = False
    wavenumber: bool = False
    width_mhz: float | None = None
    comment: str = ""


class Series(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The series of the Loomis-Wood rows: a line of a species and the step of its quantum numbers, or frequencies to extrapolate."""

    species: int | None = None
    upper: tuple[int, ...] = ()
    lower: tuple[int, ...] = ()
    step: tuple[int, ...] = ()
    frequencies_mhz: tuple[float, ...] = ()


class Settings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="settings"):
    """Settings of the page and of assignments. emission: draw the modelled emission of the species over the spectrum.
    default_error_mhz: of lines that come without an error; least_error_mhz: of lines assigned to a peak.
    auto_refit: fit after each change of the assignments."""

    series: Series | None = None
    default_error_mhz: float = 0.01
    least_error_mhz: float = 0.001
    emission: bool = False
    background_k: float = 2.725
    overlaid: bool = False
    auto_refit: bool = False


Record = Species | Line | Settings
Changes = Mapping[str, Record | None]


class Step(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An action: its label, and the changed records before and after it; None for a missing record."""

    label: str
    before: dict[str, Record | None]
    after: dict[str, Record | None]


class State:
    """All records of a session by their keys; immutable."""

    __slots__ = ("records",)

    def __init__(self, records: Mapping[str, Record]) -> None:
        self.records: Mapping[str, Record] = MappingProxyType(dict(records))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, State) and self.records == other.records

    __hash__ = None  # type: ignore[assignment]

    @property
    def settings(self) -> Settings:
        """Settings of the session, or the default settings."""
        settings = self.records.get("settings")
        return settings if isinstance(settings, Settings) else Settings()

    @property
    def species(self) -> dict[int, Species]:
        """Species by number."""
        return {
            int(key.partition("/")[2]): record for key, record in self.records.items() if isinstance(record, Species)
        }

    @property
    def lines(self) -> dict[int, Line]:
        """Assigned lines by number."""
        return {int(key.partition("/")[2]): record for key, record in self.records.items() if isinstance(record, Line)}

    def species_lines(self, species: int) -> dict[int, Line]:
        """The lines of a species by number."""
        return {number: line for number, line in self.lines.items() if line.species == species}

    def free_number(self, kind: str) -> int:
        """The number of a new record of a kind."""
        return max((int(key.partition("/")[2]) for key in self.records if key.startswith(f"{kind}/")), default=0) + 1

    def with_changes(self, changes: Changes) -> State:
        """The state with changed records; None removes a record."""
        records = dict(self.records)
        for key, record in changes.items():
            if record is None:
                records.pop(key, None)
            else:
                records[key] = record
        return State(records)

    def step(self, label: str, changes: Changes) -> Step:
        """The step from this state to the state with the changes, without records that stay equal."""
        moved = {key: record for key, record in changes.items() if self.records.get(key) != record}
        return Step(label, {key: self.records.get(key) for key in moved}, moved)

    def __iter__(self) -> Iterator[str]:
        return iter(self.records)


def species_key(number: int) -> str:
    """Key of a species, such as `species/1`."""
    return f"species/{number}"


def line_key(number: int) -> str:
    """Key of a line, such as `line/1`."""
    return f"line/{number}"
