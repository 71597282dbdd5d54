"""Assignment of the atoms of a box to molecules and models, as arrays for the kernels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats
from rotor.fluids.forces.models import RigidModel

Integers = NDArray[Any]  # of whichever width
GEOMETRY_ANGSTROM = 0.05  # largest deviation of a distance in a molecule from the model


def spreading_weights(model: RigidModel) -> Floats:
    """Each site as a linear combination of the real atoms, (sites, atoms); rows add to 1.

    r_site = Σ w r_atom places the site, f_atom = w f_site transfers its force: Σ w = 1 conserves the force, Σ w r_atom = r_site the
    torque. The solution of smallest norm is used. A site outside the span of the atoms (off the line of a linear molecule) is an error.
    """
    places, real = model.positions_angstrom, len(model.symbols)
    equations = np.vstack((places[:real].T, np.ones(real)))
    weights = np.linalg.lstsq(equations, np.vstack((places.T, np.ones(len(places)))), rcond=None)[0].T
    weights[:real] = np.eye(real)
    missed = np.linalg.norm(weights @ places[:real] - places, axis=1)
    if missed.max() > 1e-9:
        raise ValueError(
            f"model {model.name}: site {int(missed.argmax())} has no mass and lies {missed.max():.3g} Å from the line or "
            "plane of the atoms; a site without mass is a linear combination of the atoms"
        )
    return np.asarray(weights)


def list_centre(model: RigidModel) -> tuple[Floats, float]:
    """Weights of the atoms for a centre close to all sites, and the largest distance of a site from it, Å.

    The midpoint of the two most distant sites, or the mean of all sites if that is closer.
    """
    weights, places = spreading_weights(model), model.positions_angstrom
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)
    s, t = np.unravel_index(apart.argmax(), apart.shape)
    choices = (0.5 * (weights[s] + weights[t]), weights.mean(axis=0))
    reach = [float(np.linalg.norm(places - w @ places[: len(model.symbols)], axis=1).max()) for w in choices]
    best = int(np.argmin(reach))
    return choices[best], reach[best]


@dataclass(frozen=True)
class Assembly:
    """Molecules of a box in the order of its atoms.

    models: the kinds. kinds: (n,) kind of each molecule. first_atom, first_site: (n + 1,) where its atoms and sites begin.
    """

    models: tuple[RigidModel, ...]
    kinds: Integers
    first_atom: Integers
    first_site: Integers

    def __len__(self) -> int:
        return len(self.kinds)

    @cached_property
    def atoms(self) -> Integers:
        """Real atoms of a molecule of each kind."""
        return np.array([len(model.symbols) for model in self.models])

    @cached_property
    def counts(self) -> Integers:
        """Sites of a molecule of each kind."""
        return np.array([len(model.sites) for model in self.models])

    @cached_property
    def weights(self) -> Floats:
        """(kinds, sites + 1, atoms): `spreading_weights` of each kind and behind them those of the list's centre."""
        weights = np.zeros((len(self.models), self.counts.max() + 1, self.atoms.max()))
        for kind, model in enumerate(self.models):
            weights[kind, : self.counts[kind], : self.atoms[kind]] = spreading_weights(model)
            weights[kind, self.counts[kind], : self.atoms[kind]] = list_centre(model)[0]
        return weights

    @cached_property
    def reach_angstrom(self) -> Floats:
        """Largest distance of a site of each kind from its list centre, including the tolerance of the geometry."""
        return np.array([list_centre(model)[1] + GEOMETRY_ANGSTROM for model in self.models])

    @cached_property
    def charges_e(self) -> Floats:
        """Charges of all sites in the box."""
        by_kind = [np.array([site.charge_e for site in model.sites]) for model in self.models]
        return np.concatenate([by_kind[kind] for kind in self.kinds])

    @cached_property
    def numbers(self) -> Integers:
        """Molecules of each kind."""
        return np.bincount(self.kinds, minlength=len(self.models))

    def check_geometry(self, sites_angstrom: Floats) -> None:
        """Raise ValueError if the distances in a molecule differ from those of its model."""
        for kind, model in enumerate(self.models):
            first = self.first_site[:-1][self.kinds == kind]
            real = model.positions_angstrom[: self.atoms[kind]]
            for s in range(len(real)):
                for t in range(s):
                    distances = np.linalg.norm(sites_angstrom[first + s] - sites_angstrom[first + t], axis=1)
                    self._refuse_distance(kind, s, t, distances, float(np.linalg.norm(real[s] - real[t])))

    def _refuse_distance(self, kind: int, s: int, t: int, distances: Floats, expected: float) -> None:
        wrong = np.flatnonzero(~(np.abs(distances - expected) <= GEOMETRY_ANGSTROM))
        if len(wrong):
            molecule = int(np.flatnonzero(self.kinds == kind)[wrong[0]])
            atoms = self.first_atom[molecule] + t, self.first_atom[molecule] + s
            raise ValueError(
                f"molecule {molecule}: atoms {atoms[0]} and {atoms[1]} are {distances[wrong[0]]:.4g} Å apart, in model "
                f"{self.models[kind].name} {expected:.4g} Å; give the atoms of a molecule one after another, in the model's shape"
            )


def _by_label(symbols: list[str], labels: Integers, models: tuple[RigidModel, ...]) -> list[int]:
    """Kinds of the runs of equal labels."""
    bounds = np.concatenate(([0], np.flatnonzero(np.diff(labels)) + 1, [len(labels)]))
    if len(bounds) - 1 != len(np.unique(labels)):
        raise ValueError('atoms of one molecule (array "molecule") are not consecutive; sort the box by molecule')
    kind_of_symbols = {model.symbols: kind for kind, model in enumerate(models)}
    kinds = []
    for start, end in pairwise(bounds):
        elements = tuple(symbols[start:end])
        if elements not in kind_of_symbols:
            raise ValueError(
                f"molecule {labels[start]} (atoms {start} to {end - 1}) is {'-'.join(elements)}; the models are "
                f"{_spelled(models)}, their atoms in this order"
            )
        kinds.append(kind_of_symbols[elements])
    return kinds


def kinds_by_symbols(symbols: list[str], models: Sequence[RigidModel]) -> list[int]:
    """Numbers of the models of consecutive molecules, the longest model that fits first; ValueError if none fits."""
    order = sorted(range(len(models)), key=lambda kind: -len(models[kind].symbols))
    kinds, at = [], 0
    while at < len(symbols):
        fits = (k for k in order if tuple(symbols[at : at + len(models[k].symbols)]) == models[k].symbols)
        kind = next(fits, None)
        if kind is None:
            raise ValueError(
                f"no molecule begins with atom {at} ({'-'.join(symbols[at : at + 4])}...); the models are "
                f"{_spelled(models)}, their atoms in this order"
            )
        kinds.append(kind)
        at += len(models[kind].symbols)
    return kinds


def _spelled(models: Sequence[RigidModel]) -> str:
    return ", ".join(f"{model.name} ({'-'.join(model.symbols)})" for model in models)


def assemble(atoms: Any, models: tuple[RigidModel, ...]) -> Assembly:
    """The molecules of an ase.Atoms: by its array "molecule" if present, otherwise by the sequence of atoms.

    >>> from ase.build import molecule
    >>> from rotor.fluids.forces.models import find_model
    >>> len(assemble(molecule("H2O") + molecule("H2O"), (find_model("spce"),)))
    2
    """
    if len({model.symbols for model in models}) != len(models):
        raise ValueError(f"two of the models have the same atoms: {_spelled(models)}")
    if not len(atoms):
        raise ValueError("a box without atoms has no energy; at least one molecule is expected")
    symbols, labels = atoms.get_chemical_symbols(), atoms.arrays.get("molecule")
    kinds = np.array(kinds_by_symbols(symbols, models) if labels is None else _by_label(symbols, labels, models))
    sizes = np.array([(len(model.symbols), len(model.sites)) for model in models])[kinds]
    starts = np.vstack((np.zeros((1, 2), dtype=np.int64), np.cumsum(sizes, axis=0)))
    return Assembly(models, kinds, np.ascontiguousarray(starts[:, 0]), np.ascontiguousarray(starts[:, 1]))
