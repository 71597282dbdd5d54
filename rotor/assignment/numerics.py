"""Plan of a search for constants."""

from __future__ import annotations

from typing import Any

from rotor.requests.knob import Knob
from rotor.requests.numerics import Numerics
from rotor.requests.plan import Cost

MEMORY_MB = 150.0  # of a search


SEARCH = Knob(
    key="search",
    fixed="seeded; how sure the answer is stands with it as a probability",
    cost=lambda request, *_: Cost(float(min(request.seconds, 1.0 + request.species)), MEMORY_MB),
)


def describe_assign(request: Any, _: Cost) -> dict[str, Any]:
    """What a search for constants does."""
    peaks = request.peaks
    temperature = "not known, tried from 1 to 8 K" if request.temperature_k is None else f"{request.temperature_k:g} K"
    bounds = request.bounds
    limits = ", ".join(
        f"{name} {low:g} to {high:g}" for name, low, high in zip("ABC", bounds.low, bounds.high, strict=True)
    )
    return {
        "effects": ("rigid", "quartic distortion"),
        "good": ("J",),
        "parts": (
            ("method", "families of three lines on the strongest peaks, evidence against chance, refinement by a fit"),
            ("bounds", f"{limits} MHz"),
            ("temperature", temperature),
        ),
        "counts": {"peaks": len(peaks), "species": request.species},
    }


ASSIGN = Numerics(knobs=(SEARCH,), describe=describe_assign)
