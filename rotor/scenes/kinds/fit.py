"""Scenes of fits: measured lines back to constants."""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Any

from rotor.formats.fit_request import (
    FitAnswer,
    FitRequest,
    FittedParameters,
    answer_fit,
    fit_of_lines,
    fit_of_spfit,
    with_more_lines,
    write_fitted_par,
    write_fitted_toml,
)
from rotor.scenes import kind
from rotor.scenes.fit_sections import FitLines, FitNumerics, FitParameters
from rotor.scenes.kind import Kind, NoResultError, Where, Writer
from rotor.scenes.molecule import named, top_of
from rotor.scenes.scene import FitScene, molecule_of, within
from rotor.scenes.sections import MoleculeSection


def request(scene: FitScene, folder: Where = ".") -> FitRequest:
    """The request of a scene."""
    of_spfit = scene.lines.source.lower().endswith(".par")
    with kind.fields(free="parameters.free"):
        asked = _of_spfit(scene, folder) if of_spfit else _of_lines(scene, folder)
    if scene.lines.merge is not None:
        more = _there("lines.merge", scene.lines.merge, folder)
        asked = named("lines.merge", lambda: with_more_lines(asked, more))
    return replace(asked, options=named("numerics", lambda: replace(asked.options, **_changes(scene.numerics))))


def _there(name: str, file: str, folder: Where) -> str:
    path = within(folder, file)
    if not Path(path).is_file():
        raise ValueError(f"{name}: {path}: no such file")
    return path


def _of_spfit(scene: FitScene, folder: Where) -> FitRequest:
    if scene.molecule is not None or scene.parameters != FitParameters():
        raise ValueError("molecule, parameters: a .par file says itself what is free and where the fit starts")
    par = _there("lines.source", scene.lines.source, folder)
    lin = None if scene.lines.lin is None else _there("lines.lin", scene.lines.lin, folder)
    return named("lines", lambda: fit_of_spfit(par, lin))


def _of_lines(scene: FitScene, folder: Where) -> FitRequest:
    molecule, asked = molecule_of(scene), scene.parameters
    if molecule is None:
        raise ValueError("molecule: expected constants from which the fit starts, as source or constants")
    if scene.lines.lin is not None:
        raise ValueError("lines.lin: goes with a .par file; give the lines as source otherwise")
    lines, top = _there("lines.source", scene.lines.source, folder), top_of(molecule, folder)
    start = None if molecule.source is None else within(folder, molecule.source)
    priors = {name: kind.quantity(f"parameters.priors.{name}", value, "MHz") for name, value in asked.priors.items()}
    beside = start if start is not None and os.path.isfile(start) else molecule.source
    return fit_of_lines(lines, top, asked.free, ties=asked.ties, priors_mhz=priors, start=beside)


def _changes(how: FitNumerics) -> dict[str, Any]:
    """Fields of the options that a scene gives."""
    changes: dict[str, Any] = {"loss": how.loss, "poor_rms": how.poor_rms}
    if how.reject_above is not None:
        changes["reject_above"] = how.reject_above
    if how.iterations is not None:
        if how.iterations < 1:
            raise ValueError(f"iterations: {how.iterations}: expected at least 1")
        changes["most_iterations"] = how.iterations
    if how.default_error is not None:
        changes["default_error_mhz"] = kind.quantity("default_error", how.default_error, "MHz")
    return changes


def answer(asked: FitRequest, scene: FitScene, out: Where, executor: Executor | None) -> FitAnswer:
    """The fit.

    Parameters
    ----------
    asked : FitRequest
        The scene as the library takes it, checked.
    scene : FitScene
        Not used.
    out : path
        Not used.
    executor : Executor or None
        Not used.

    Returns
    -------
    FitAnswer
        Parameters with errors.

    Raises
    ------
    NoResultError
        A fit that does not converge, with the reason.
    """
    found = answer_fit(asked)
    if not found.fit.converged:
        raise NoResultError(f"not converged: {found.fit.reason}; 'rotor fit' shows the lines and where it stopped")
    return found


def table(found: FitAnswer) -> FittedParameters:
    """The fitted parameters."""
    return found.parameters


def writers(found: FitAnswer, scene: FitScene) -> Mapping[str, Writer]:
    """Report, constants in three forms, table for a publication, lines and picture."""
    from rotor.formats.assigned_lines import write_assigned_lines
    from rotor.formats.fit_request import report_of, table_of

    fit, title, form = found.fit, found.request.title, {".txt": "text", ".md": "markdown", ".tex": "latex"}

    def plot(path: Path) -> None:
        from rotor.plots.fit import plot_fit

        plot_fit(fit, path, title=title, provenance={})

    return {
        "report": lambda path: _write_text(path, report_of(found)),
        "toml": lambda path: named("outputs.toml", lambda: write_fitted_toml(found, path)),
        "par": lambda path: named("outputs.par", lambda: write_fitted_par(found, path, variances=False)),
        "var": lambda path: named("outputs.var", lambda: write_fitted_par(found, path, variances=True)),
        "table": lambda path: _write_text(path, table_of(found, form[path.suffix.lower()])),
        "save_lines": lambda path: write_assigned_lines(fit.marked_lines, path),
        "plot": plot,
    }


def _write_text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")


def saved(asked: FitRequest, molecule: MoleculeSection | None) -> FitScene:
    """The scene of a request."""
    files, options = asked.files, asked.options
    free = FitParameters()
    if asked.spfit is None:
        priors: dict[str, float | str] = {name: f"{value!r} MHz" for name, value in asked.priors_mhz.items()}
        free = FitParameters(free=list(asked.parameters.names), ties=list(asked.ties), priors=priors)
    error = options.default_error_mhz
    return FitScene(
        lines=FitLines(source=files.source, lin=files.lin, merge=files.merge),
        molecule=molecule,
        parameters=free,
        numerics=FitNumerics(
            reject_above=options.reject_above,
            loss=options.loss,
            default_error=None if error is None else f"{error!r} MHz",
            poor_rms=options.poor_rms,
            iterations=options.most_iterations,
        ),
    )


KIND = Kind(request, answer, table, saved, writers)
