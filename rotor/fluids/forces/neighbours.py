"""Sites of all molecules and lists of their neighbours, updated from one set of positions to the next."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from rotor.arrays import Floats
from rotor.fluids.forces.assembly import Assembly, Integers

CLOSEST_ANGSTROM = 0.5  # sites of two molecules closer than this overlap


@dataclass
class Neighbours:
    """Lists of molecules within cutoff and skin, rebuilt when a centre has moved by half the skin.

    box_angstrom: (3,), 0 along non-periodic directions. rebuilds: number of times the list was built.
    """

    assembly: Assembly
    box_angstrom: Floats
    cutoff_angstrom: float
    skin_angstrom: float
    rebuilds: int = 0
    sites: Floats = field(init=False)
    local: Floats = field(init=False)
    centres: Floats = field(init=False)
    reference: Floats = field(init=False)
    starts: Integers = field(init=False)
    entries: Integers = field(init=False)
    images: Floats = field(init=False)

    def __post_init__(self) -> None:
        n = len(self.assembly)
        self.sites = np.zeros((self.assembly.first_site[-1], 3))
        self.local = np.zeros_like(self.sites)
        self.centres, self.reference = np.zeros((n, 3)), np.zeros((n, 3))
        self.starts = np.zeros(0, dtype=np.int64)
        steps = np.arange(-2, 3)
        grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
        self.images = np.ascontiguousarray(grid * self.box_angstrom)
        self._refuse_small_boxes()

    @cached_property
    def within_angstrom(self) -> Floats:
        """(kinds, kinds) distance of centres beyond which no two sites are within the cutoff."""
        reach = self.assembly.reach_angstrom
        return np.asarray(self.cutoff_angstrom + reach[:, None] + reach[None])

    def _refuse_small_boxes(self) -> None:
        repeated = self.box_angstrom[self.box_angstrom > 0]
        if not len(repeated):
            return
        shortest, widest = repeated.min(), 2 * self.assembly.reach_angstrom.max()
        if self.cutoff_angstrom > 0.5 * shortest * (1 + 1e-12):
            raise ValueError(
                f"cutoff {self.cutoff_angstrom:g} Å is more than half of the smallest edge of the cell, {shortest:g} Å: "
                f"give a cutoff of at most {0.5 * shortest:g} Å, or a larger box with more molecules"
            )
        if self.cutoff_angstrom + widest >= shortest or self.within_angstrom.max() + self.skin_angstrom > 2 * shortest:
            raise ValueError(
                f"the cell's smallest edge, {shortest:g} Å, does not hold molecules {widest:.3g} Å wide with a cutoff of "
                f"{self.cutoff_angstrom:g} Å and a skin of {self.skin_angstrom:g} Å: a molecule would meet itself"
            )

    def update(self, positions_angstrom: Floats) -> None:
        """Place all sites; rebuild the list if it is outdated."""
        if not np.isfinite(positions_angstrom).all():
            atom = int(np.flatnonzero(~np.isfinite(positions_angstrom).all(axis=1))[0])
            raise ValueError(f"position of atom {atom} is {positions_angstrom[atom]}: expected finite numbers")
        if not len(self.starts) or self._place(positions_angstrom, fresh=False) > (0.5 * self.skin_angstrom) ** 2:
            self._place(positions_angstrom, fresh=True)
            self.assembly.check_geometry(self.sites)
            self._build()
            self._refuse_overlaps()

    def _place(self, positions_angstrom: Floats, fresh: bool) -> float:
        from rotor.fluids.forces import _pair_kernels

        a = self.assembly
        return float(
            _pair_kernels.place_sites(
                positions_angstrom, a.first_atom, a.first_site, a.kinds, a.weights, a.atoms, a.counts,
                self.box_angstrom, self.reference, fresh, self.sites, self.local, self.centres,
            )
        )  # fmt: skip

    def _build(self) -> None:
        from rotor.fluids.forces import _list_kernels

        self.reference = self.centres.copy()
        repeats = self.box_angstrom > 0
        low = np.where(repeats, 0.0, self.centres.min(axis=0))
        extent = np.where(repeats, self.box_angstrom, self.centres.max(axis=0) - low + 1e-3)
        farthest = min(self.within_angstrom.max() + self.skin_angstrom, 3 * float(np.linalg.norm(extent)))
        most = math.ceil((4 * len(self.assembly)) ** (1 / 3))
        bins = np.clip(np.floor(extent * 2 / farthest), 1, most).astype(np.int64)
        self.starts, self.entries = _list_kernels.neighbour_list(
            self.centres,
            self.box_angstrom,
            low,
            extent / bins,
            bins,
            self.assembly.kinds,
            len(self.assembly.models),
            farthest,
        )
        self.rebuilds += 1

    def pairs(self) -> tuple[Integers, Integers, Floats]:
        """The listed pairs: two molecules, and the shift from the second to its image near the first, Å."""
        if not len(self.starts):
            raise ValueError("the list is made by update(); it was not called yet")
        first = np.repeat(np.arange(len(self.assembly)), np.diff(self.starts[:: len(self.assembly.models)]))
        entries = self.entries.astype(np.int64)
        return first, entries // 128, self.images[entries % 128]

    def _refuse_overlaps(self) -> None:
        closest = self.closest(2 * self.assembly.reach_angstrom.max() + CLOSEST_ANGSTROM)
        if closest is not None and closest[0] < CLOSEST_ANGSTROM:
            self.starts = self.starts[:0]  # a repeated call must fail again
            raise ValueError(
                f"atoms {closest[1]} and {closest[2]} of different molecules are {closest[0]:.3g} Å apart; molecules "
                f"on top of each other (nearer than {CLOSEST_ANGSTROM} Å) have no meaningful energy: move one of them, or, if "
                "they were apart before, use a shorter step"
            )

    def closest(self, within_angstrom: float) -> tuple[float, int, int] | None:
        """Distance and numbers of the two nearest atoms of different molecules with centres nearer than that, if any."""
        from rotor.fluids.forces import _list_kernels

        a = self.assembly
        square, first, other = _list_kernels.closest_atoms(
            np.ascontiguousarray(self.starts[:: len(a.models)]), self.entries, self.images, self.centres, self.sites,
            a.first_site, a.first_atom, within_angstrom**2,
        )  # fmt: skip
        return None if first < 0 else (math.sqrt(square), int(first), int(other))
