"""`rotor view`: a spectrum, its prediction and its assignment, in the browser."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from rotor.checks import leaving
from rotor.frozen import dataclass
from rotor.requests.field import CONDITIONS, OUTPUT, REQUIRED, declared, identical, part
from rotor.requests.readers import Flag, Names, Quantity, Text, Whole
from rotor.verbs.common.outputs import Output, Report
from rotor.verbs.common.verb import Tool, Work
from rotor.verbs.measurements.observed_file import FileFacts

if TYPE_CHECKING:
    from rotor.viewer.service import Service

EXAMPLES = """\
  rotor view spectrum.csv
  rotor view spectrum.csv water molecule.toml --temperature 2 --lines lines.lin
  rotor view spectrum.view.json
  rotor view spectrum.csv OCS --export page.html"""


@dataclass(frozen=True)
class ViewRequest:
    """A spectrum, the molecules to predict, and display settings."""

    source: str = declared(
        REQUIRED, Text(), "A spectrum: text, FITS or .npy; or a saved session (.view.json)", option="SPECTRUM"
    )
    molecules: tuple[str, ...] = declared(
        (), Names(), 'Species to predict: names, files, SMILES:..., "A=9 B=3 C=2 GHz"', option="MOLECULE"
    )
    lines: str | None = declared(None, Text(metavar="FILE"), "Assigned lines of the first molecule: .lin, .csv, .cat")
    session: str | None = declared(
        None, Text(metavar="FILE"), "Session file; SPECTRUM.view.json if left out", panel=OUTPUT
    )
    temperature_k: float = declared(
        300.0,
        Quantity("K", above=0, metavar="T"),
        "Temperature of the molecules (K)",
        option="--temperature",
        panel=CONDITIONS,
    )
    facts: FileFacts = part(FileFacts, identical, identical, FileFacts())
    port: int = declared(0, Whole(0, 65535), "Port on this machine; 0 takes a free port", panel=OUTPUT)
    no_browser: bool = declared(False, Flag(), "Print the address; open no browser", panel=OUTPUT)


@dataclass(frozen=True)
class Opened:
    """An open session. page: file of an exported page, if any."""

    request: ViewRequest
    service: Service
    page: Path | None


def answer(request: ViewRequest, work: Work) -> Opened:
    """Open the session; it is released when the command ends."""
    from rotor.viewer.assets import bokeh_js
    from rotor.viewer.opening import open_session

    bokeh_js()  # fails early, with the command that installs it
    page = work.files.get("export", (None,))[0]
    service = open_session(
        request.source,
        request.molecules,
        lines=request.lines,
        session=request.session,
        temperature_k=request.temperature_k,
        **vars(request.facts),
        save=page is None,
        note=work.note,
    )
    work.at_end(service.session.release)
    return Opened(request, service, page)


def export(answer: Opened, path: Path, _: Report) -> None:
    """Write the page with its data."""
    from rotor.viewer.export_page import export_page

    path.write_text(export_page(answer.service), encoding="utf-8")


def show(answer: Opened, _: Report) -> Iterator[str]:
    """The exported page; or nothing, once the session that is served has been interrupted."""
    service = answer.service
    if answer.page is None:
        _serve(service, answer.request)
    else:
        yield f"{answer.page}: {len(service.spectrum)} points, {len(service.session.state.lines)} assigned lines"


def _serve(service: Service, request: ViewRequest) -> None:
    """Serve the session until the process is interrupted."""
    from rotor.viewer.server import ViewServer

    server = ViewServer(service, request.port)

    def started(address: str) -> None:
        """Print the address of the page, and open it."""
        print(f"{address}\nsession: {service.session.path}; Ctrl-C ends", flush=True)
        if not request.no_browser and sys.stdout.isatty():
            import webbrowser

            webbrowser.open(address)

    session = service.session.path  # None: not saved
    with leaving(*[(session, "has the session")] if session else []):
        server.run(started)


VERB = Tool(
    name="view",
    about="A spectrum, its prediction and its assignment in the browser; on this machine only.",
    examples=EXAMPLES,
    request=ViewRequest,
    answer=answer,
    text=None,
    show=show,
    outputs=(Output("export", (".html",), "Write one page with the data inside, and start no server", export),),
)
