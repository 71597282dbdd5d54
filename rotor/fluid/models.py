"""Rigid models of molecules: sites with charges and Lennard-Jones parameters, each set with its source.

A model's real atoms come in the order in which they stand in a box; sites without mass (the M of TIP4P, the charge at
the centre of N2) follow from their places.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rotor import units
from rotor.rotations import Array

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Site:
    """One site of a rigid model.

    symbol: of the element, "" for a site without mass. position_angstrom: in the model's own axes. charge_e: charge.
    sigma_angstrom, epsilon_k: Lennard-Jones size and depth over k_B, 0 where the site has none.
    """

    symbol: str
    position_angstrom: Vector
    charge_e: float = 0.0
    sigma_angstrom: float = 0.0
    epsilon_k: float = 0.0

    @property
    def epsilon_ev(self) -> float:
        """The depth in eV."""
        return self.epsilon_k * units.EV_PER_K


@dataclass(frozen=True)
class RigidModel:
    """A molecule as sites that never move against each other; unlike sites mix by Lorentz and Berthelot.

    name: as users give it. sites: real atoms first, sites without mass after them. source: of the parameters.
    """

    name: str
    sites: tuple[Site, ...]
    source: str

    def __post_init__(self) -> None:
        massless = [not site.symbol for site in self.sites]
        if massless != sorted(massless) or all(massless):
            raise ValueError(f"model {self.name}: real atoms stand first, and there is at least one")
        if abs(sum(site.charge_e for site in self.sites)) > 1e-9:
            raise ValueError(
                f"model {self.name}: the charges add to {sum(s.charge_e for s in self.sites):g} e, not to 0"
            )

    @property
    def symbols(self) -> tuple[str, ...]:
        """Elements of the real atoms, in the order of the box."""
        return tuple(site.symbol for site in self.sites if site.symbol)

    @property
    def positions_angstrom(self) -> Array:
        """Places of all sites, (sites, 3), in the model's own axes."""
        return np.array([site.position_angstrom for site in self.sites])


def _bent(bond_angstrom: float, angle_degrees: float) -> tuple[Vector, Vector]:
    """Places of two equal atoms bound to one at the origin."""
    half = math.radians(angle_degrees) / 2
    x, z = bond_angstrom * math.sin(half), bond_angstrom * math.cos(half)
    return (x, 0.0, z), (-x, 0.0, z)


def _spce() -> RigidModel:
    first, second = _bent(1.0, math.degrees(math.acos(-1 / 3)))
    return RigidModel(
        "spce",
        (
            Site("O", (0.0, 0.0, 0.0), -0.8476, 3.16555789, 78.19743111),
            Site("H", first, 0.4238),
            Site("H", second, 0.4238),
        ),
        "H. J. C. Berendsen, J. R. Grigera, T. P. Straatsma, J. Phys. Chem. 91, 6269 (1987); digits of NIST's reference",
    )


MODELS: dict[str, RigidModel] = {model.name: model for model in (_spce(),)}


def model_of(name: str) -> RigidModel:
    """The model of that name; a ValueError lists the names there are.

    >>> model_of("spce").symbols
    ('O', 'H', 'H')
    """
    if name.lower() not in MODELS:
        raise ValueError(f"{name!r} is no model of a rigid molecule; there are {', '.join(MODELS)}")
    return MODELS[name.lower()]
