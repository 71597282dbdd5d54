"""The page of `rotor view` as a widget of notebooks (JupyterLab, VS Code, marimo), by anywidget."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

from rotor.units import parse_quantity
from rotor.viewer.assets import MISSING, bokeh_js, page_file
from rotor.viewer.opening import open_session
from rotor.viewer.service import Service


def view(
    source: str | os.PathLike[str],
    molecules: Sequence[str] | str = (),
    *,
    lines: str | None = None,
    session: str | os.PathLike[str] | None = None,
    temperature_k: float | str = 300.0,
    axis_unit: str | None = None,
    rest_mhz: float | str | None = None,
    unit: str | None = None,
    noise: float | None = None,
    save: bool = True,
    height: int = 640,
) -> Any:
    """A spectrum with its prediction and its assignment as a widget, the page of `rotor view`.

    Parameters
    ----------
    source : path
        A spectrum (text, FITS, .npy), or the file of a session.
    molecules : str or sequence of str
        Names, files or SMILES:... of species.
    lines : path, optional
        Assigned lines (.lin, .csv, .cat) of the first molecule.
    session : path, optional
        The session file; by default SPECTRUM.view.json beside the spectrum.
    temperature_k : float or str, optional
        Of the added species.
    axis_unit, unit : str, optional
        What the file of the spectrum does not state, such as "GHz" and "mK".
    rest_mhz : float or str, optional
        Rest frequency of a velocity axis.
    noise : float, optional
        Of a channel.
    save : bool, optional
        Whether the session is saved after each action.
    height : int, optional
        Of the widget, pixels.

    Returns
    -------
    ViewWidget
        Shown by a notebook. `do(...)` is an action from Python, `session` the state, `export(path)` writes the page to a file.

    Raises
    ------
    ValueError
        With file and rule for what cannot be read, and where the extra `view` is not installed.
    """
    names = [molecules] if isinstance(molecules, str) else list(molecules)
    remarks: list[str] = []
    kelvin, rest = parse_quantity(temperature_k, "K"), None if rest_mhz is None else parse_quantity(rest_mhz, "MHz")
    service = open_session(
        source, names, lines=lines, session=session, temperature_k=kelvin, axis_unit=axis_unit, rest_mhz=rest, unit=unit,
        noise=noise, save=save, note=remarks.append,
    )  # fmt: skip
    service.session.warnings += tuple(text for text in remarks if text not in service.session.warnings)
    return widget_class()(service, height)


class SessionFace:
    """The session of a page from Python."""

    service: Service
    send: Callable[[Any], object]
    _sent: int

    @property
    def session(self) -> Any:
        """The session: `session.state.species`, `session.state.lines`, `session.undo()`."""
        return self.service.session

    def do(self, name: str, **message: Any) -> Any:
        """Carry out an action or a query by its name (docs/view.md); all pages show the change.

        Raises ValueError with the text that a page would show.
        """
        answer = self.service.answer({"do": name, **message})
        self._announce()
        if "error" in answer:
            raise ValueError(answer["error"])
        return answer["ok"]

    def export(self, path: str | os.PathLike[str]) -> None:
        """Write the page with its data as a file."""
        from rotor.formats.atomic_write import open_atomic
        from rotor.viewer.export_page import export_page

        with open_atomic(path, "w", encoding="utf-8") as handle:
            handle.write(export_page(self.service))

    def _announce(self) -> None:
        if self.service.session.revision != self._sent:
            self._sent = self.service.session.revision
            self.send({"session": self.service.facts()})


@cache
def widget_class() -> type:
    """The class of the widget; ValueError where anywidget is not installed."""
    try:
        import anywidget
        import traitlets
    except ImportError as error:
        raise ValueError(f"{error.name} is not installed; {MISSING}") from None

    class ViewWidget(SessionFace, anywidget.AnyWidget):
        """The page of a session in a notebook."""

        _esm = f"(function () {{ {bokeh_js()} }}).call(globalThis);\n{page_file('page.js')}"
        _css = page_file("page.css")
        height = traitlets.Int(640).tag(sync=True)

        def __init__(self, service: Service, height: int) -> None:
            super().__init__(height=height)
            self.service = service
            self._sent = service.session.revision
            self.on_msg(self._received)

        def close(self) -> None:
            """Close the widget and unlock the session."""
            self.service.session.release()
            super().close()

        def _received(self, widget: Any, content: Any, buffers: Any) -> None:
            answer = self.service.answer(content)
            self._announce()
            self.send({"re": content.get("id") if isinstance(content, dict) else None, **answer})

    return ViewWidget
