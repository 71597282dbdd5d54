"""Ordinary bodies by name, made of uniform parts: a book, a phone, a racket, a wing nut.

Sizes and masses are typical round numbers, not measurements. The moments of the parts and their sum come from
`rotor.geometry.inertia`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotor.checks import did_you_mean
from rotor.geometry.inertia import Body, box, cylinder, hoop, rod

Three = tuple[float, float, float]
_MM = 1e-3


@dataclass(frozen=True, repr=False)
class NamedBody:
    """A body in SI units, its principal axes along x, y, z. text: its sizes and masses in words. axes: names of x, y, z."""

    name: str
    body: Body
    text: str
    axes: tuple[str, str, str]

    def __repr__(self) -> str:
        moments = ", ".join(f"{moment:.4g}" for moment in self.moments_kg_m2)
        return f"NamedBody({self.name}: {self.text}; moments {moments} kg m²)"

    @property
    def moments_kg_m2(self) -> Three:
        """Principal moments about the centre of mass, along x, y, z.

        >>> [round(1e6 * moment, 1) for moment in named_body("phone").moments_kg_m2]
        [70.0, 289.0, 357.2]
        """
        x, y, z = (float(moment) for moment in np.diag(self.body.tensor))
        return x, y, z


def _racket() -> Body:
    return hoop(0.14, 140 * _MM).moved([0.545, 0.0, 0.0]) + rod(0.16, [0.0, 0.0, 0.0], [0.405, 0.0, 0.0])


def _wing_nut() -> Body:
    wing = box(0.0035, [15 * _MM, 3 * _MM, 10 * _MM])
    return cylinder(0.012, 6 * _MM, 14 * _MM) + wing.moved([13 * _MM, 0, 0]) + wing.moved([-13 * _MM, 0, 0])


BODIES: dict[str, NamedBody] = {
    body.name: body
    for body in (
        NamedBody(
            "book",
            box(0.8, [240 * _MM, 160 * _MM, 30 * _MM]),
            "a box of 240 x 160 x 30 mm, 0.8 kg",
            ("long", "across", "thick"),
        ),
        NamedBody(
            "phone",
            box(0.16, [147 * _MM, 72 * _MM, 8 * _MM]),
            "a box of 147 x 72 x 8 mm, 0.16 kg",
            ("long", "across", "thick"),
        ),
        NamedBody(
            "racket",
            _racket(),
            "a hoop of radius 140 mm, 0.14 kg, on a rod of 405 mm, 0.16 kg",
            ("handle", "across", "face"),
        ),
        NamedBody(
            "wing nut",
            _wing_nut(),
            "a cylinder of radius 6 mm and height 14 mm, 12 g, with two wings of 15 x 3 x 10 mm, 3.5 g each, 13 mm off its axis",
            ("wings", "across", "bolt"),
        ),
    )
}


def named_body(name: str) -> NamedBody:
    """A body by its name, ignoring case and blanks; ValueError for other names.

    >>> named_body("Wing-Nut").name
    'wing nut'
    """
    key = "".join(letter for letter in name.casefold() if letter.isalnum())
    for body_name, body in BODIES.items():
        if body_name.replace(" ", "") == key:
            return body
    raise ValueError(f"{name!r}: expected one of {', '.join(BODIES)}{did_you_mean(name.casefold(), BODIES)}")
