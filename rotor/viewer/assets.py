"""Files of the page: its module and style, and BokehJS from the Python package of Bokeh."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec
from pathlib import Path

HERE = Path(__file__).parent
BOKEH = ("bokeh.min.js", "bokeh-api.min.js")
MISSING = "rotor view needs the packages of the extra 'view': python -m pip install 'molrotor[view]'"


@cache
def bokeh_js() -> str:
    """BokehJS; ValueError where Bokeh is not installed."""
    spec = find_spec("bokeh")
    if spec is None or not spec.submodule_search_locations:
        raise ValueError(f"bokeh is not installed; {MISSING}")
    folder = Path(next(iter(spec.submodule_search_locations))) / "server" / "static" / "js"
    return "\n".join((folder / name).read_text(encoding="utf-8") for name in BOKEH)


def page_file(name: str) -> str:
    """A file of the page: page.js, page.css or page.html."""
    return (HERE / name).read_text(encoding="utf-8")


def page(style: str, script: str) -> str:
    """The page with its style and scripts."""
    return page_file("page.html").replace("<!--style-->", style).replace("<!--script-->", script)
