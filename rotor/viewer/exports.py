"""Files of a session for other programs: assigned lines, constants, SPFIT's files, a scene, a table for a publication."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from rotor.viewer.actions.fits import fit_assignments, fit_species
from rotor.viewer.prediction import Model
from rotor.viewer.records import Line

if TYPE_CHECKING:
    from rotor.formats.fits.fit_request import FitAnswer


def exported(what: str, model: Model, lines: Mapping[int, Line]) -> tuple[str, str]:
    """Name and text of an exported file; ValueError for an unknown kind, for no lines, and from the fit."""
    if what not in WRITERS:
        raise ValueError(f"export {what!r}: expected one of {', '.join(WRITERS)}")
    if not lines and what != "toml":
        raise ValueError(f"export {what}: no line is assigned to {model.record.name}")
    stem = re.sub(r"[^\w.-]+", "_", model.record.name).strip("._") or "species"
    return f"{stem}.{SUFFIXES.get(what, what)}", WRITERS[what](model, lines, stem)


def _lines_as(suffix: str) -> Callable[[Model, Mapping[int, Line], str], str]:
    def text(model: Model, lines: Mapping[int, Line], stem: str) -> str:
        from rotor.formats.lines.assigned_lines import write_assigned_lines

        return _written(f"{stem}.{suffix}", lambda path: write_assigned_lines(fit_assignments(model, lines), path))

    return text


def fit_answer(model: Model, lines: Mapping[int, Line], stem: str) -> FitAnswer:
    """The fit with its request, as the writers of fits take it."""
    from rotor.fitting.fit import FitOptions
    from rotor.fitting.parameters import parameters, with_names
    from rotor.formats.fits.fit_request import FitAnswer, FitFiles, FitRequest

    fit, free = fit_species(model, lines), list(model.record.free)
    begin = with_names(model.constants, free)
    files = FitFiles(f"{stem}.csv", start=model.file or None)
    request = FitRequest(fit.lines, begin, parameters(begin, free), FitOptions(), model.record.name, files)
    return FitAnswer(request, fit)


def _par(variances: bool) -> Callable[[Model, Mapping[int, Line], str], str]:
    def text(model: Model, lines: Mapping[int, Line], stem: str) -> str:
        from rotor.formats.fits.fit_request import write_fitted_par

        answer = fit_answer(model, lines, stem)
        return _written(f"{stem}.par", lambda path: write_fitted_par(answer, path, variances=variances))

    return text


def _toml(model: Model, lines: Mapping[int, Line], stem: str) -> str:
    """The molecule file; after a fit, with errors and correlations."""
    from rotor.fitting.top_constants import TopConstants
    from rotor.formats.fits.fit_request import write_fitted_toml
    from rotor.formats.molecules.molecule_file import MoleculeFile
    from rotor.formats.molecules.molecule_writer import write_molecule_file

    if lines and model.record.fit is not None:
        answer = fit_answer(model, lines, stem)
        return _written(f"{stem}.toml", lambda path: write_fitted_toml(answer, path))
    top, named = model.top, model.constants
    file = MoleculeFile(
        model.record.name,
        constants=named.top.constants if isinstance(named, TopConstants) else named,
        dipole_abc_debye=top.dipole_abc_debye,
        spin_weights=top.spin_weights,
        sources={"constants": "set in a session of rotor view"},
        states=top.states,
        spin_constants=top.spin_constants,
        internal_rotation=top.internal_rotation,
    )
    return _written(f"{stem}.toml", lambda path: write_molecule_file(file, path))


def _scene(model: Model, lines: Mapping[int, Line], stem: str) -> str:
    """The scene of the fit, which reads the exported STEM.csv and STEM.toml beside it."""
    from rotor.scenes.scene import scene_of, scene_text

    content = {
        "schema": 1,
        "kind": "fit",
        "title": f"fit of {model.record.name}",
        "molecule": f"{stem}.toml",
        "lines": {"source": f"{stem}.csv"},
        "parameters": {"free": list(model.record.free)},
    }
    return scene_text(scene_of(content, "scene"))


def _table(form: str) -> Callable[[Model, Mapping[int, Line], str], str]:
    def text(model: Model, lines: Mapping[int, Line], stem: str) -> str:
        from rotor.formats.fits.fit_request import fit_table

        return fit_table(fit_answer(model, lines, stem), form)

    return text


def _report(model: Model, lines: Mapping[int, Line], stem: str) -> str:
    from rotor.formats.fits.fit_request import fit_report

    return fit_report(fit_answer(model, lines, stem))


def _written(name: str, write: Callable[[Path], object]) -> str:
    """The text that a writer of files writes."""
    with tempfile.TemporaryDirectory(prefix="rotor-view-") as folder:
        path = Path(folder) / name
        write(path)
        return path.read_text(encoding="utf-8")


WRITERS: Mapping[str, Callable[[Model, Mapping[int, Line], str], str]] = {
    "lin": _lines_as("lin"),
    "csv": _lines_as("csv"),
    "par": _par(False),
    "var": _par(True),
    "toml": _toml,
    "scene": _scene,
    "fit": _report,
    "md": _table("markdown"),
    "tex": _table("latex"),
}
SUFFIXES = {"scene": "scene.toml"}
