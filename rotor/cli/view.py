"""`rotor view`: a spectrum, its prediction and its assignment, in the browser."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rotor.checks import require_whole
from rotor.cli.shared import inputs
from rotor.cli.shared.options import argument, file_option, grouped, option
from rotor.cli.shared.output import note

if TYPE_CHECKING:
    from rotor.viewer.service import Service

EXAMPLES = """\b
Examples:
  rotor view spectrum.csv
  rotor view spectrum.csv water molecule.toml --temperature 2 --lines lines.lin
  rotor view spectrum.view.json
  rotor view spectrum.csv OCS --export page.html"""


@dataclass(frozen=True)
class Options:
    """Spectrum, molecules, and how they are shown."""

    source: str = argument(
        ..., metavar="SPECTRUM", help="A spectrum: text, FITS or .npy; or the session file of one (.view.json)."
    )
    molecules: list[str] | None = argument(
        None, metavar="MOLECULE", help='Species to predict: names, files, SMILES:..., "A=9 B=3 C=2 GHz".'
    )
    lines: str | None = option(None, metavar="FILE", help="Assigned lines of the first molecule: .lin, .csv, .cat.")
    session: str | None = option(None, metavar="FILE", help="Session file; SPECTRUM.view.json if left out.")
    temperature: str = option("300", metavar="T", help="Temperature of the molecules (K).")
    axis_unit: str | None = option(None, metavar="UNIT", help="Unit of the spectral axis of a text: MHz, GHz, cm-1.")
    unit: str | None = option(None, metavar="UNIT", help="Unit of the intensities: K, mK, V, absorbance, Jy/beam.")
    noise: str | None = option(None, metavar="X", help="Noise of a channel; estimated from line-free channels.")
    export: str | None = file_option(".html", help="Write one page with the data inside, and start no server.")
    port: int = option(0, metavar="N", help="Port on this machine; 0 takes any that is free.")
    no_browser: bool = option(False, "--no-browser", help="Print the address; open no browser.")


@grouped()
def command(context: typer.Context, options: Options) -> None:
    """A spectrum, its prediction and its assignment in the browser; on this machine only."""
    require_whole("--port", options.port, 0, 65535)
    from rotor.viewer.assets import bokeh_js
    from rotor.viewer.opening import open_session

    bokeh_js()  # says what to install, before anything is read
    if options.export is not None:
        _refuse_path(options.export)
    service = open_session(
        options.source,
        options.molecules or (),
        lines=options.lines,
        session=options.session,
        temperature_k=inputs.positive("--temperature", options.temperature, "K"),
        axis_unit=options.axis_unit,
        unit=options.unit,
        noise=None if options.noise is None else inputs.parsed("--noise", options.noise, float),
        save=options.export is None,
        note=note,
    )
    try:
        _export(service, Path(options.export)) if options.export is not None else _serve(service, options)
    finally:
        service.session.release()


def _refuse_path(path: str) -> None:
    """ValueError for a name that is not that of a page."""
    if not path.lower().endswith(".html"):
        raise ValueError(f"--export {path}: the name must end in .html")


def _export(service: Service, path: Path) -> None:
    """Write the page with its data."""
    from rotor.formats.atomic_write import open_atomic
    from rotor.viewer.export_page import export_page

    with open_atomic(path, "w", encoding="utf-8") as handle:
        handle.write(export_page(service))
    print(f"{path}: {len(service.spectrum)} points, {len(service.session.state.lines)} assigned lines")


def _serve(service: Service, options: Options) -> None:
    """Serve the session until the process is interrupted."""
    from rotor.viewer.server import ViewServer

    server = ViewServer(service, options.port)

    def started(address: str) -> None:
        """Say where the page is, and open it."""
        print(f"{address}\nsession: {service.session.path}; Ctrl-C ends", flush=True)
        if not options.no_browser and sys.stdout.isatty():
            import webbrowser

            webbrowser.open(address)

    server.run(started)
