"""Rigid models of molecules: sites with charges and Lennard-Jones parameters, each set with its source.

The real atoms of a model are in the order of the box; massless sites (M of TIP4P, the charge at the centre of N2) are placed from
them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from rotor import units
from rotor.arrays import Floats

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
    """A molecule as rigidly connected sites; unlike sites follow the Lorentz-Berthelot rules.

    name: for users. sites: real atoms first, then massless sites. source: of the parameters.
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
                f"model {self.name}: the charges add up to {sum(s.charge_e for s in self.sites):g} e, not to 0"
            )

    @property
    def symbols(self) -> tuple[str, ...]:
        """Elements of the real atoms, in the order of the box."""
        return tuple(site.symbol for site in self.sites if site.symbol)

    @property
    def positions_angstrom(self) -> Floats:
        """Places of all sites, (sites, 3), in the model's own axes."""
        return np.array([site.position_angstrom for site in self.sites])


_K_PER_KCAL_PER_MOL = 4184.0 / (units.AVOGADRO_PER_MOL * units.BOLTZMANN_J_PER_K)  # 503.22 K, exact ratio


def _bent(bond_angstrom: float, angle_degrees: float) -> tuple[Vector, Vector]:
    """Places of two equal atoms bound to one at the origin."""
    half = math.radians(angle_degrees) / 2
    x, z = bond_angstrom * math.sin(half), bond_angstrom * math.cos(half)
    return (x, 0.0, z), (-x, 0.0, z)


def _three_site_water(
    name: str, hydrogens: tuple[Vector, Vector], charge_e: float, sigma_angstrom: float, epsilon_k: float, source: str
) -> RigidModel:
    """Charges on the atoms; charge_e is that of a hydrogen."""
    oxygen = Site("O", (0.0, 0.0, 0.0), -2 * charge_e, sigma_angstrom, epsilon_k)
    return RigidModel(name, (oxygen, *(Site("H", place, charge_e) for place in hydrogens)), source)


def _four_site_water(
    name: str, charge_e: float, om_angstrom: float, sigma_angstrom: float, epsilon_k: float, source: str
) -> RigidModel:
    """The negative charge sits on a massless site, om_angstrom from oxygen on the bisector; geometry of the free molecule."""
    return RigidModel(
        name,
        (
            Site("O", (0.0, 0.0, 0.0), 0.0, sigma_angstrom, epsilon_k),
            *(Site("H", place, charge_e) for place in _bent(0.9572, 104.52)),
            Site("", (0.0, 0.0, om_angstrom), -2 * charge_e),
        ),
        source,
    )


def _sigma_epsilon(repulsion: float, attraction: float) -> tuple[float, float]:
    """σ in Å and ε in K from A/r¹² - C/r⁶ with A in kcal Å¹²/mol and C in kcal Å⁶/mol: σ⁶ = A/C, ε = C²/4A."""
    return (repulsion / attraction) ** (1 / 6), attraction**2 / (4 * repulsion) * _K_PER_KCAL_PER_MOL


def _nitrogen() -> RigidModel:
    end = {"charge_e": -0.482, "sigma_angstrom": 3.31, "epsilon_k": 36.0}
    return RigidModel(
        "trappe-n2",
        (Site("N", (0.0, 0.0, -0.55), **end), Site("N", (0.0, 0.0, 0.55), **end), Site("", (0.0, 0.0, 0.0), 0.964)),
        _TRAPPE,
    )


def _carbon_dioxide() -> RigidModel:
    end = {"charge_e": -0.35, "sigma_angstrom": 3.05, "epsilon_k": 79.0}
    carbon = Site("C", (0.0, 0.0, 0.0), 0.70, 2.80, 27.0)
    return RigidModel("trappe-co2", (carbon, *(Site("O", (0.0, 0.0, z), **end) for z in (-1.16, 1.16))), _TRAPPE)


def _argon() -> RigidModel:
    return RigidModel(
        "argon", (Site("Ar", (0.0, 0.0, 0.0), 0.0, 3.405, 119.8),), "L. Verlet, Phys. Rev. 159, 98 (1967)"
    )


_TRAPPE = "J. J. Potoff, J. I. Siepmann, AIChE J. 47, 1676 (2001)"
_JORGENSEN = "W. L. Jorgensen et al., J. Chem. Phys. 79, 926 (1983)"
_BERENDSEN = (
    "H. J. C. Berendsen, J. R. Grigera, T. P. Straatsma, J. Phys. Chem. 91, 6269 (1987); digits of NIST's reference"
)
_TIP4P_2005 = "J. L. F. Abascal, C. Vega, J. Chem. Phys. 123, 234505 (2005)"
_TIP4P_EW = "H. W. Horn et al., J. Chem. Phys. 120, 9665 (2004)"

_WATERS = (
    _three_site_water("spce", _bent(1.0, math.degrees(math.acos(-1 / 3))), 0.4238, 3.16555789, 78.19743111, _BERENDSEN),
    _three_site_water("tip3p", _bent(0.9572, 104.52), 0.417, *_sigma_epsilon(582.0e3, 595.0), _JORGENSEN),
    _four_site_water("tip4p", 0.52, 0.15, *_sigma_epsilon(600.0e3, 610.0), _JORGENSEN),
    _four_site_water("tip4p-2005", 0.5564, 0.1546, 3.1589, 93.2, _TIP4P_2005),
    _four_site_water("tip4p-ew", 0.52422, 0.125, 3.16435, 0.16275 * _K_PER_KCAL_PER_MOL, _TIP4P_EW),
)

MODELS: dict[str, RigidModel] = {model.name: model for model in (*_WATERS, _nitrogen(), _carbon_dioxide(), _argon())}


def find_model(name: str) -> RigidModel:
    """The model of this name; a ValueError lists the available names.

    >>> find_model("spce").symbols
    ('O', 'H', 'H')
    """
    if name.lower() not in MODELS:
        raise ValueError(f"{name!r} is no model of a rigid molecule; there are {', '.join(MODELS)}")
    return MODELS[name.lower()]


def find_models(names: str | RigidModel | Sequence[str | RigidModel]) -> tuple[RigidModel, ...]:
    """Models from names joined by commas, models, or several of either.

    >>> [model.name for model in find_models("spce,argon")]
    ['spce', 'argon']
    """
    if isinstance(names, str):
        return tuple(find_model(name.strip()) for name in names.split(","))
    if isinstance(names, RigidModel):
        return (names,)
    return tuple(model for name in names for model in find_models(name))


def model_shapes(models: Iterable[RigidModel]) -> dict[tuple[str, ...], Floats]:
    """Places (atoms, 3) of the real atoms of each model by their elements, as `rotor.fluids.motion.bodies.rigid_bodies` takes them.

    >>> model_shapes(find_models("trappe-n2"))[("N", "N")].tolist()
    [[0.0, 0.0, -0.55], [0.0, 0.0, 0.55]]
    """
    return {model.symbols: model.positions_angstrom[: len(model.symbols)] for model in models}
