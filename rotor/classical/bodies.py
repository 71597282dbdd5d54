"""Ordinary bodies by name, made of uniform parts: a book, a phone, a racket, a wing nut.

| part | principal moments about its own centre, x, y, z |
|---|---|
| box of edges a, b, c | m/12 (b² + c²), m/12 (a² + c²), m/12 (a² + b²) |
| cylinder of radius r and height h along z | m/12 (3 r² + h²) twice, m r²/2 |
| hoop of radius r in the plane x y, thin | m r²/2 twice, m r² |
| rod of length l along x, thin | 0, m l²/12 twice |

and m d² for a centre that lies d off an axis (Steiner's theorem; L. D. Landau and E. M. Lifshitz, Mechanics, § 32). Sizes and masses
are round numbers chosen here for an ordinary body of its kind; they were not measured.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotor.arrays import Floats

Three = tuple[float, float, float]


@dataclass(frozen=True)
class Part:
    """A uniform part. mass_kg; centre_m: its centre; moments_kg_m2: about that, along x, y, z, which must be principal."""

    mass_kg: float
    centre_m: Three
    moments_kg_m2: Three


@dataclass(frozen=True)
class NamedBody:
    """A body of parts. axes: names of x, y, z, along which its principal axes lie. text: its sizes and masses in words."""

    name: str
    parts: tuple[Part, ...]
    text: str
    axes: tuple[str, str, str]

    @property
    def moments_kg_m2(self) -> Three:
        """Principal moments about the centre of mass, along x, y, z.

        >>> [round(1e6 * moment, 1) for moment in named_body("phone").moments_kg_m2]
        [70.0, 289.0, 357.2]
        """
        tensor = self.inertia_kg_m2
        x, y, z = (float(moment) for moment in np.diag(tensor))
        return x, y, z

    @property
    def inertia_kg_m2(self) -> Floats:
        """Tensor of inertia (3, 3) about the centre of mass."""
        mass = np.array([part.mass_kg for part in self.parts])
        centres = np.array([part.centre_m for part in self.parts])
        off = centres - mass @ centres / mass.sum()
        about = np.sum(off**2, axis=1)[:, None, None] * np.eye(3) - off[:, :, None] * off[:, None, :]
        own = np.diag(np.sum([part.moments_kg_m2 for part in self.parts], axis=0))
        return np.asarray(own + np.einsum("p,pij->ij", mass, about))


def box(mass_kg: float, edges_m: Three, centre_m: Three = (0.0, 0.0, 0.0)) -> Part:
    """A uniform box with its edges along x, y, z.

    >>> box(12.0, (1.0, 2.0, 3.0)).moments_kg_m2
    (13.0, 10.0, 5.0)
    """
    a, b, c = (edge**2 for edge in edges_m)
    return Part(mass_kg, centre_m, (mass_kg / 12 * (b + c), mass_kg / 12 * (a + c), mass_kg / 12 * (a + b)))


def cylinder(mass_kg: float, radius_m: float, height_m: float) -> Part:
    """A uniform cylinder along z about the origin."""
    across = mass_kg / 12 * (3 * radius_m**2 + height_m**2)
    return Part(mass_kg, (0.0, 0.0, 0.0), (across, across, mass_kg * radius_m**2 / 2))


def hoop(mass_kg: float, radius_m: float, centre_m: Three) -> Part:
    """A thin hoop in a plane z = constant."""
    across = mass_kg * radius_m**2 / 2
    return Part(mass_kg, centre_m, (across, across, 2 * across))


def rod(mass_kg: float, length_m: float, centre_m: Three) -> Part:
    """A thin rod along x."""
    across = mass_kg * length_m**2 / 12
    return Part(mass_kg, centre_m, (0.0, across, across))


_MM = 1e-3
BODIES: dict[str, NamedBody] = {
    one.name: one
    for one in (
        NamedBody(
            "book", (box(0.8, (240 * _MM, 160 * _MM, 30 * _MM)),), "a box of 240 x 160 x 30 mm, 0.8 kg",
            ("long", "across", "thick"),
        ),
        NamedBody(
            "phone", (box(0.16, (147 * _MM, 72 * _MM, 8 * _MM)),), "a box of 147 x 72 x 8 mm, 0.16 kg",
            ("long", "across", "thick"),
        ),
        NamedBody(
            "racket", (hoop(0.14, 140 * _MM, (0.545, 0.0, 0.0)), rod(0.16, 405 * _MM, (0.2025, 0.0, 0.0))),
            "a hoop of radius 140 mm, 0.14 kg, on a rod of 405 mm, 0.16 kg", ("handle", "across", "face"),
        ),
        NamedBody(
            "wing nut",
            (
                cylinder(0.012, 6 * _MM, 14 * _MM),
                box(0.0035, (15 * _MM, 3 * _MM, 10 * _MM), (13 * _MM, 0.0, 0.0)),
                box(0.0035, (15 * _MM, 3 * _MM, 10 * _MM), (-13 * _MM, 0.0, 0.0)),
            ),
            "a cylinder of radius 6 mm and height 14 mm, 12 g, with two wings of 15 x 3 x 10 mm, 3.5 g each, 13 mm off its axis",
            ("wings", "across", "bolt"),
        ),
    )
}  # fmt: skip


def named_body(name: str) -> NamedBody:
    """A body by its name, in any case, with or without the blank; ValueError for another name.

    >>> named_body("Wing-Nut").name
    'wing nut'
    """
    key = "".join(letter for letter in name.casefold() if letter.isalnum())
    for known, body in BODIES.items():
        if known.replace(" ", "") == key:
            return body
    raise ValueError(f"{name!r}: expected one of {', '.join(BODIES)}")
