"""Kraitchman's coordinates: where an atom lies, from what its substitution does to the moments of inertia.

In the principal axes of the parent (mass M) an isotope heavier by Δm at the position r adds to the planar moments
P = Σ m r rᵀ the matrix μ r rᵀ, μ = M Δm / (M + Δm). The eigenvalues P′ of P + μ r rᵀ and those of P give, along each axis i,

    r_i² = Π_k (P′_k - P_i) / [μ Π_{k≠i} (P_k - P_i)]

which is J. Kraitchman, Am. J. Phys. 21, 17 (1953), eqs. 16 to 20, written with planar moments: three axes for an asymmetric
top, two for an atom in the plane of a planar molecule, one on the axis of a linear one, two (along and across) where two
moments of the parent are equal, and one, the distance from the centre, where all three are. A square below zero, from vibration or
from errors, is an imaginary coordinate: the square is reported and the coordinate taken as 0. Signs are not in the moments.

Errors: Costain's rule δr = K/|r| for what vibration does, with K = 0.0015 Å² (C. C. Costain, Trans. Am. Cryst. Assoc. 2, 157
(1966); value of B. P. van Eijck, J. Mol. Spectrosc. 91, 348 (1982); both as quoted in the literature, not read here), and the
errors of the constants carried through.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats

COSTAIN_ANGSTROM2 = 0.0015
PAIRS = ("ab", "ac", "bc")
SHAPES = {"asymmetric": (0, 1, 2), "planar": (0, 1), "linear": (0,), "symmetric": (0, 1), "spherical": (0,)}
_STEP = 1e-6  # of a moment, for derivatives by central differences


@dataclass(frozen=True)
class Substituted:
    """Where an atom lies in the principal axes of the parent, without signs.

    squares_angstrom2 : (3,) a², b², c², below zero where imaginary; 0 along an axis that the shape leaves out. For the shape
        "symmetric" the first is along the figure axis, the second the square of the distance from it, the third 0; for "spherical"
        the first is the square of the distance from the centre
    errors_of_squares : (3,) from the errors of the moments. shape : the variant that was used
    """

    squares_angstrom2: Floats
    errors_of_squares: Floats
    shape: str

    @property
    def coordinates_angstrom(self) -> Floats:
        """|a|, |b|, |c| (3,), 0 where imaginary."""
        return np.sqrt(np.maximum(self.squares_angstrom2, 0.0))

    @property
    def imaginary(self) -> tuple[bool, bool, bool]:
        """Along which axes the square is below zero."""
        a, b, c = (self.squares_angstrom2 < 0).tolist()
        return a, b, c

    @property
    def costain_angstrom(self) -> Floats:
        """K/|r| (3,), what vibration may do to each coordinate; √K = 0.039 Å at most, where the rule has lost its sense."""
        size = np.maximum(np.sqrt(np.abs(self.squares_angstrom2)), np.sqrt(COSTAIN_ANGSTROM2))
        return np.where(self._used > 0, COSTAIN_ANGSTROM2 / size, 0.0)

    @property
    def measured_angstrom(self) -> Floats:
        """Errors (3,) that those of the moments make, δ(r²)/2|r|, and √δ(r²) where the coordinate is not above it."""
        size = np.sqrt(np.abs(self.squares_angstrom2))
        limit = np.sqrt(self.errors_of_squares)
        with np.errstate(divide="ignore", invalid="ignore"):
            linear = self.errors_of_squares / (2 * size)
        return np.where(size > limit, linear, limit)

    @property
    def errors_angstrom(self) -> Floats:
        """Both together, √(costain² + measured²), (3,)."""
        return np.asarray(np.hypot(self.costain_angstrom, self.measured_angstrom))

    @property
    def _used(self) -> Floats:
        return np.isin(np.arange(3), SHAPES[self.shape]).astype(float)


def planar_moments(moments: ArrayLike) -> Floats:
    """P_a, P_b, P_c of the moments I_a, I_b, I_c, (..., 3): P_a = (I_b + I_c - I_a)/2.

    >>> planar_moments([1.0, 2.0, 3.0]).tolist()
    [2.0, 1.0, 0.0]
    """
    i = np.asarray(moments, dtype=float)
    return np.asarray(i.sum(axis=-1, keepdims=True) / 2 - i)


def kraitchman(
    parent: ArrayLike,
    substituted: ArrayLike,
    *,
    mass_u: float,
    change_u: float,
    shape: str = "asymmetric",
    pair: str = "ab",
    parent_errors: ArrayLike = (0.0, 0.0, 0.0),
    substituted_errors: ArrayLike = (0.0, 0.0, 0.0),
) -> Substituted:
    """The place of one atom from the moments of the parent and of the isotopologue in which it is replaced.

    Parameters
    ----------
    parent, substituted : (3,) arrays, u Å²
        I_a, I_b, I_c of the parent and of the isotopologue. A moment that the shape does not use may be nan: those that are
        not in `pair` for "planar", I_a and one of I_b, I_c for "linear".
    mass_u : float
        Mass of the parent.
    change_u : float
        What the substitution adds, below zero for a lighter isotope.
    shape : "asymmetric", "planar", "linear", "symmetric" or "spherical"
        Which axes the atom can lie off, see above. "spherical" takes the two moments of the isotopologue across the line from the
        centre to the atom: the larger two of a heavier isotopologue, the smaller two of a lighter one. "symmetric" takes the two
        equal moments of the parent, which may be the smaller (oblate) or the larger (prolate); a symmetric isotopologue (an atom on
        the axis) may have I_a = nan.
    pair : "ab", "ac" or "bc"
        Which two moments serve for "planar"; they differ by what vibration does to the inertial defect.
    parent_errors, substituted_errors : (3,) arrays, u Å²
        Standard errors of the moments.

    Returns
    -------
    Substituted

    Raises
    ------
    ValueError
        For an unknown shape or pair, a mass or change that cannot be, and moments that are not finite where they count.

    Notes
    -----
    The moments of the ground state are taken for rigid ones: vibration moves r_s from r_e by 0.001 to 0.01 Å.

    >>> water = [0.61, 1.15, 1.76]                   # a planar molecule, Σ m c² = 0
    >>> atom = np.array([0.5, 0.3, 0.0])
    >>> mu = 18.0 * 1.0 / 19.0
    >>> p = np.diag(planar_moments(water)) + mu * np.outer(atom, atom)
    >>> heavier = np.sort(np.trace(p) - np.linalg.eigvalsh(p))
    >>> found = kraitchman(water, heavier, mass_u=18.0, change_u=1.0, shape="planar")
    >>> found.coordinates_angstrom.round(9).tolist()
    [0.5, 0.3, 0.0]
    """
    _refuse(shape, pair, mass_u, change_u)
    mu = mass_u * change_u / (mass_u + change_u)
    both = np.array([parent, substituted], dtype=float)
    errors = np.array([parent_errors, substituted_errors], dtype=float)
    used = _used_moments(both, shape, pair, change_u)
    if not np.isfinite(both[used]).all():
        needed = ", ".join(
            axis for axis, counts in zip("ABC", np.atleast_1d(used.any(axis=0)).tolist(), strict=True) if counts
        )
        raise ValueError(
            f"the equations of shape {shape!r} need {needed} of both isotopologues; one of them is missing"
        )

    squares = _squares(both, mu, shape, pair)
    spread = np.zeros(3)
    for place in zip(*np.nonzero(used & (errors > 0)), strict=True):
        step = _STEP * both[place]
        up, down = both.copy(), both.copy()
        up[place] += step
        down[place] -= step
        slope = (_squares(up, mu, shape, pair) - _squares(down, mu, shape, pair)) / (2 * step)
        spread += (slope * errors[place]) ** 2
    return Substituted(squares, np.sqrt(spread), shape)


def _refuse(shape: str, pair: str, mass_u: float, change_u: float) -> None:
    if shape not in SHAPES:
        raise ValueError(f"shape {shape!r}: one of {', '.join(SHAPES)} is needed")
    if pair not in PAIRS:
        raise ValueError(f"pair {pair!r}: one of {', '.join(PAIRS)} says which two moments of a planar molecule count")
    if not (np.isfinite([mass_u, change_u]).all() and mass_u > 0 and mass_u + change_u > 0 and change_u):
        raise ValueError(
            f"mass {mass_u!r} u changed by {change_u!r} u: a mass above 0 and a change other than 0 are needed"
        )


def _used_moments(both: Floats, shape: str, pair: str, change_u: float) -> NDArray[np.bool_]:
    """Which moments (2, 3) count; a missing one of two equal moments does not."""
    if shape == "planar":
        return np.array([[axis in pair for axis in "abc"]] * 2)
    if shape == "linear":
        return np.asarray(np.isfinite(both) & np.array([[False, True, True]] * 2))
    if shape == "symmetric":
        return np.asarray(np.isfinite(both))
    if shape == "spherical":
        used = np.isfinite(both)
        used[1, 0 if change_u > 0 else 2] = False
        used |= ~used.any(axis=1, keepdims=True)  # so that a missing one is refused
        return np.asarray(used)
    return np.ones((2, 3), dtype=bool)


def _squares(both: Floats, mu: float, shape: str, pair: str) -> Floats:
    if shape == "linear":
        p, changed = (np.array([np.nanmean(row[1:])]) for row in both)
        return np.concatenate([_interlaced(p, changed, mu), [0.0, 0.0]])
    if shape == "planar":
        p, changed = (_in_plane(row, pair) for row in both)
        return np.concatenate([_interlaced(p, changed, mu), [0.0]])
    if shape == "symmetric":
        return _symmetric_top(both, mu)
    if shape == "spherical":  # I′ = I + μ r² across the line to the atom
        across = both[1, 1:] if mu > 0 else both[1, :2]
        return np.array([(np.nanmean(across) - np.nanmean(both[0])) / mu, 0.0, 0.0])
    p, changed = planar_moments(both)
    return _interlaced(p, changed, mu)


def _interlaced(p: Floats, changed: Floats, mu: float) -> Floats:
    """r_i² = Π_k (P′_k - P_i) / [μ Π_{k≠i} (P_k - P_i)] along the axes of p."""
    above = np.prod(changed[None, :] - p[:, None], axis=1)
    apart = p[None, :] - p[:, None] + np.eye(len(p))
    return np.asarray(above / (mu * np.prod(apart, axis=1)))


def _in_plane(moments: Floats, pair: str) -> Floats:
    """P_a = I_b and P_b = I_a of a planar molecule, the missing moment from I_c = I_a + I_b."""
    a, b, c = moments
    if pair == "ac":
        b = c - a
    if pair == "bc":
        a = c - b
    return np.array([b, a])


def _symmetric_top(both: Floats, mu: float) -> Floats:
    """z² and ρ² in a top with two equal moments I_x; an atom on the axis leaves the isotopologue symmetric, ΔI_x = μ z².

    The plane through the figure axis and the atom holds both: P_z and P_x there become two eigenvalues P′ of the pair, the
    third, across it, stays P_x.
    """
    a, b, c = both[0]
    if not np.isfinite(both).all():  # A or C not known: the atom is taken to be on the axis
        equal = [np.nanmean(row[1:] if np.isnan(row[0]) else row[:2]) for row in both]
        return np.array([(equal[1] - equal[0]) / mu, 0.0, 0.0])
    prolate = abs(b - c) <= abs(a - b)
    along, across = (a, (b + c) / 2) if prolate else (c, (a + b) / 2)
    p = np.array([across - along / 2, along / 2])  # along z, and along x
    changed = np.sort(planar_moments(both[1]))[::-1]
    still = int(np.argmin(np.abs(changed - p[1])))  # the one across the plane, which has not moved
    return np.concatenate([_interlaced(p, np.delete(changed, still), mu), [0.0]])
