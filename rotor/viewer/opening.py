"""Opening of a session from a spectrum or a session file, molecules and assigned lines."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from rotor.assignment.peaks.peak_list import PeakList
from rotor.checks import require_file
from rotor.formats.packed import first_bytes
from rotor.observed.spectrum import ObservedSpectrum, observed_spectrum
from rotor.viewer.actions.species_actions import add_species
from rotor.viewer.messages import Context
from rotor.viewer.records import SpectrumFile
from rotor.viewer.service import Service
from rotor.viewer.session import SUFFIX, Session, check_spectrum, is_session, read_session, spectrum_file

Note = Callable[[str], None]
_READABLE = f"expected a spectrum (text, FITS or .npy) or a session ({SUFFIX})"
STATED = ("axis_unit", "rest_mhz", "unit", "noise")  # of `SpectrumFile`
ALIKE = 0.1  # relative difference of neighbouring steps of a spectrum; those of a list of peaks are random


def open_spectrum(path: Path, reading: SpectrumFile | None = None) -> ObservedSpectrum:
    """The spectrum of a file: .npy with two columns or rows, FITS, or text. reading: units and noise that the user states."""
    from rotor.formats.spectra.axis import ReadChoices
    from rotor.formats.spectra.read import read_spectrum

    require_file(path, _READABLE)
    if first_bytes(path, 6) == b"\x93NUMPY":
        values = np.load(path, allow_pickle=False)
        if values.ndim != 2 or not {2, 3} & set(values.shape) or values.dtype.kind not in "fiu":
            raise ValueError(f"{path}: an array of shape {values.shape}; expected two columns or rows of numbers")
        columns = values if values.shape[1] in (2, 3) else values.T
        noise = None if reading is None else reading.noise
        return observed_spectrum(columns[:, 0], columns[:, 1], noise=noise, source=path.name)
    stated = {} if reading is None else {name: getattr(reading, name) for name in STATED}
    return read_spectrum(path, ReadChoices(**stated))


def read_peak_list(path: Path, spectrum: ObservedSpectrum) -> PeakList | None:
    """The peaks of a list of peaks; None for a spectrum, whose neighbouring steps are mostly alike."""
    steps = np.diff(spectrum.frequency_mhz)
    alike = np.abs(np.diff(steps)) <= ALIKE * steps[1:]
    if len(steps) < 2 or alike.mean() > 0.5 or first_bytes(path, 9) == b"SIMPLE  =":
        return None
    from rotor.formats.spectra.peak_files import read_peaks

    return read_peaks(path)


def open_session(
    source: str | os.PathLike[str],
    molecules: Sequence[str] = (),
    *,
    lines: str | None = None,
    session: str | os.PathLike[str] | None = None,
    temperature_k: float = 300.0,
    axis_unit: str | None = None,
    rest_mhz: float | None = None,
    unit: str | None = None,
    noise: float | None = None,
    save: bool = True,
    note: Note = lambda _: None,
) -> Service:
    """The session of a spectrum with molecules and lines; a saved session is resumed.

    source: a spectrum (text, FITS, .npy), or the file of a session. molecules: names, files or SMILES:... of species; those that the
    session has already are not added again. lines: assigned lines (.lin, .csv, .cat) of the first molecule. session: the session file; by
    default SPECTRUM.view.json beside the spectrum. temperature_k: of the added species. axis_unit, rest_mhz, unit, noise: what the
    file of the spectrum does not state. save: whether the session is written to its file. note: takes remarks.
    Raises ValueError with file and rule for what cannot be read, and where another program has the session.
    """
    path = Path(source)
    if not is_session(path):
        require_file(path, _READABLE)
    file = path if is_session(path) else Path(session) if session is not None else _session_beside(path)
    if session is not None and not is_session(file):
        raise ValueError(f"{file}: the name of a session ends in {SUFFIX}")
    if is_session(path) and not path.is_file():
        raise ValueError(f"{path}: no such session; give the spectrum to begin one")
    resumed = file.is_file() and (save or is_session(path))
    opened = read_session(file) if resumed else Session(SpectrumFile("", "", 0), file if save else None)
    if save:
        opened.hold()
    try:
        where = file.parent / opened.spectrum.path if is_session(path) else path
        stated = msgspec.structs.replace(
            opened.spectrum,
            axis_unit=axis_unit or opened.spectrum.axis_unit,
            rest_mhz=rest_mhz or opened.spectrum.rest_mhz,
            unit=unit or opened.spectrum.unit,
            noise=opened.spectrum.noise if noise is None else noise,
        )
        spectrum = open_spectrum(where, stated)
        _bind(opened, stated, where, file.parent, len(spectrum), resumed)
        service = Service(opened, spectrum, read_peak_list(where, spectrum))
        remarks = list(spectrum.notes)
        _fill(service, molecules, lines, temperature_k, remarks.append)
        service.facts()  # every molecule of the session can be read
        opened.save()
    except BaseException:
        opened.release()
        raise
    for text in (*opened.warnings, *remarks):
        note(text)
    return service


def _bind(session: Session, stated: SpectrumFile, path: Path, folder: Path, points: int, resumed: bool) -> None:
    """Note the spectrum in the session; a changed spectrum gives a warning."""
    session.spectrum = msgspec.structs.replace(stated, sha256=session.spectrum.sha256)
    if resumed:
        check_spectrum(session, path, points, folder)
    else:
        session.spectrum = spectrum_file(path, points, folder, stated)


def _session_beside(path: Path) -> Path:
    """The session file beside a spectrum: spectrum.view.json for spectrum.csv."""
    name = path.name
    for suffix in (".gz", path.with_suffix("").suffix if name.endswith(".gz") else path.suffix):
        name = name.removesuffix(suffix) or name
    return path.with_name(name + SUFFIX)


def _fill(service: Service, molecules: Sequence[str], lines: str | None, temperature_k: float, note: Note) -> None:
    """Add assigned lines and the molecules that the session lacks."""
    session = service.session
    for source in molecules:
        if any(species.source == service.predictions.stored(source) for species in session.state.species.values()):
            continue
        context = Context(service.spectrum, service.predictions, [], service.peaks)
        message: dict[str, Any] = {"source": source, "temperature_k": temperature_k}
        session.apply(*add_species(session.state, message, context))
        for text in context.notes:
            note(text)
    if lines is not None:
        if not session.state.species:
            raise ValueError(f"{lines}: lines need a molecule; name it after the spectrum")
        chosen = service.predictions.stored(molecules[0]) if molecules else None
        first = next(n for n, species in session.state.species.items() if chosen in (None, species.source))
        for text in service.read_lines(lines, first):
            note(text)
