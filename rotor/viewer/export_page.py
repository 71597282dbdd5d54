"""A page that contains its data (spectrum, sticks, lines, fits, rows) and opens without a server or a network."""

from __future__ import annotations

import base64
import json
from typing import Any

import msgspec
import numpy as np

from rotor.arrays import Floats
from rotor.viewer.assets import bokeh_js, page, page_file
from rotor.viewer.records import species_key
from rotor.viewer.service import Service

MOST_POINTS = 500_000  # of the spectrum in the page; a longer one as the extremes of half as many pieces
MOST_STICKS = 20_000  # of a species
ROW_PIXELS = 300


def export_page(service: Service, half_width_mhz: float | None = None) -> str:
    """The page of a session as HTML text."""
    data = msgspec.json.encode(page_data(service, half_width_mhz)).decode()
    safe = data.replace("<", "\\u003c")  # so that no text of the data ends the element
    style = f"<style>\n{page_file('page.css')}\n</style>"
    script = (
        f'<script type="application/json" id="rotor-data">{safe}</script>\n'
        f"<script>{_embedded(bokeh_js())}</script>\n"
        f'<script type="module">\n{_embedded(page_file("page.js"))}\n</script>'
    )
    return page(style, script)


def _embedded(script: str) -> str:
    """A script that can stand inside a script element."""
    return script.replace("</script", "<\\/script")


def page_data(service: Service, half_width_mhz: float | None = None) -> dict[str, Any]:
    """Data of the exported page, by the messages that they answer."""
    x, y = service.pyramid.frequency_mhz, service.pyramid.intensity
    hello = service.answer({"do": "hello"})["ok"]
    if len(x) > MOST_POINTS:
        x, y = service.pyramid.window(*service.band_mhz, MOST_POINTS // 2)
        hello["session"]["warnings"].append(
            f"this page has {len(x)} points of the spectrum's {len(service.spectrum)}: lowest and highest of each piece"
        )
    half = half_width_mhz or max(2.0, 20 * service.spectrum.channel_mhz)
    rows = service.answer({"do": "loomis_wood", "half_width_mhz": half, "pixels": ROW_PIXELS, "rows": 50})
    window = service.answer(
        {"do": "window", "first_mhz": service.band_mhz[0], "last_mhz": service.band_mhz[1], "pixels": 8000}
    )["ok"]
    species = service.session.state.species
    return {
        "hello": hello,
        "x": _axis(x),
        "y": _packed(y),
        "sticks": {str(n): _sticks(service, n) for n, record in species.items() if record.visible},
        "model": window.get("model"),
        "loomis_wood": rows.get("ok", {"rows": []}) | {"half_width_mhz": half},
        "levels": {str(n): service.answer({"do": "levels", "species": n}).get("ok") for n in species},
    }


def _sticks(service: Service, number: int) -> dict[str, Any]:
    record = service.session.state.records[species_key(number)]
    predicted = service.predictions.lines(record)  # type: ignore[arg-type]
    return service.sticks(predicted, *service.band_mhz, MOST_STICKS)


def _axis(x: Floats) -> dict[str, Any]:
    """A frequency axis: three numbers for equal steps, otherwise the distances from the first frequency."""
    steps = np.diff(x)
    if len(x) > 2 and np.ptp(steps) < 1e-6 * abs(float(steps.mean())):
        return {"start": float(x[0]), "scale": float((x[-1] - x[0]) / (len(x) - 1)), "steps": len(x)}
    span = float(x[-1] - x[0]) or 1.0
    return {"start": float(x[0]), "scale": span, **_packed((x - x[0]) / span, plain=True)}


def _packed(values: Floats, plain: bool = False) -> dict[str, Any]:
    """Numbers as base64 text of 32-bit floats. plain: without start and scale."""
    text = base64.b64encode(np.asarray(values, dtype="<f4").tobytes()).decode()
    return {"base64": text} if plain else {"start": 0.0, "scale": 1.0, "base64": text}


def read_page(text: str) -> dict[str, Any]:
    """The data inside an exported page."""
    start = text.index(">", text.index('id="rotor-data"')) + 1
    data: dict[str, Any] = json.loads(text[start : text.index("</script>", start)])
    return data
