"""Kraitchman's equations: the position of an atom from the change of the moments of inertia upon isotopic substitution.

In the principal axes of the parent (mass M), an isotope heavier by Δm at position r adds μ r rᵀ to the planar moments
P = Σ m r rᵀ, with μ = M Δm / (M + Δm). The eigenvalues P′ of P + μ r rᵀ and those of P give, along each axis i,

    r_i² = Π_k (P′_k - P_i) / [μ Π_{k≠i} (P_k - P_i)]

J. Kraitchman, Am. J. Phys. 21, 17 (1953), eqs. 16 to 20, written with planar moments. There are three coordinates for an asymmetric
top, two for an atom in the plane of a planar molecule, one for a linear molecule, two (along and across the axis) if two moments of
the parent are equal, and one (the distance from the centre) if all three are. Vibration or errors can make a square negative, an
imaginary coordinate: the square is reported and the coordinate is set to 0. The moments do not determine signs.

Errors: Costain's rule δr = K/|r| for vibration, with K = 0.0015 Å² (C. C. Costain, Trans. Am. Cryst. Assoc. 2, 157 (1966); value of
B. P. van Eijck, J. Mol. Spectrosc. 91, 348 (1982); both as quoted in the literature, not read here), and the propagated errors of the
constants.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor.arrays import Floats

COSTAIN_ANGSTROM2 = 0.0015
PAIRS = ("ab", "ac", "bc")
SHAPES = {"asymmetric": (0, 1, 2), "planar": (0, 1), "linear": (0,), "symmetric": (0, 1), "spherical": (0,)}
_STEP = 1e-6  # relative step of a moment for central differences


@dataclass(frozen=True)
class Substituted:
    """The position of an atom in the principal axes of the parent, without signs.

    squares_angstrom2 : (3,) a², b², c²; negative if imaginary, 0 along axes that the shape excludes. For the shape "symmetric" the
        first is along the figure axis, the second the squared distance from it, the third 0; for "spherical" the first is the squared
        distance from the centre
    errors_of_squares : (3,) from the errors of the moments. shape : the variant of the equations
    """

    squares_angstrom2: Floats
    errors_of_squares: Floats
    shape: str

    @property
    def coordinates_angstrom(self) -> Floats:
        """|a|, |b|, |c| (3,); 0 if imaginary."""
        return np.sqrt(np.maximum(self.squares_angstrom2, 0.0))

    @property
    def imaginary(self) -> tuple[bool, bool, bool]:
        """Axes (3,) with a negative square."""
        a, b, c = (self.squares_angstrom2 < 0).tolist()
        return a, b, c

    @property
    def costain_angstrom(self) -> Floats:
        """Costain's error K/|r| (3,) of each coordinate; limited to √K = 0.039 Å, where the rule is no longer meaningful."""
        size = np.maximum(np.sqrt(np.abs(self.squares_angstrom2)), np.sqrt(COSTAIN_ANGSTROM2))
        return np.where(self._used > 0, COSTAIN_ANGSTROM2 / size, 0.0)

    @property
    def measured_angstrom(self) -> Floats:
        """Errors (3,) from those of the moments: δ(r²)/2|r|, or √δ(r²) for smaller coordinates."""
        size = np.sqrt(np.abs(self.squares_angstrom2))
        limit = np.sqrt(self.errors_of_squares)
        with np.errstate(divide="ignore", invalid="ignore"):
            linear = self.errors_of_squares / (2 * size)
        return np.where(size > limit, linear, limit)

    @property
    def errors_angstrom(self) -> Floats:
        """Total errors √(costain² + measured²), (3,)."""
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
    """The position of an atom from the moments of the parent and of the isotopologue in which it is substituted.

    Parameters
    ----------
    parent, substituted : (3,) arrays, u Å²
        I_a, I_b, I_c of the parent and of the isotopologue. Moments that the shape does not need may be nan: for "planar" the one
        outside `pair`, for "linear" I_a and one of I_b, I_c.
    mass_u : float
        Mass of the parent.
    change_u : float
        Change of the mass, negative for a lighter isotope.
    shape : "asymmetric", "planar", "linear", "symmetric" or "spherical"
        Variant of the equations, see above. "spherical" uses the two moments of the isotopologue across the line from the centre to
        the atom: the larger two of a heavier isotopologue, the smaller two of a lighter one. "symmetric" uses the two equal moments
        of the parent, smaller (oblate) or larger (prolate); for an atom on the axis, I_a of the symmetric isotopologue may be nan.
    pair : "ab", "ac" or "bc"
        The two moments used for "planar"; the results differ by the vibrational part of the inertial defect.
    parent_errors, substituted_errors : (3,) arrays, u Å²
        Standard errors of the moments.

    Returns
    -------
    Substituted

    Raises
    ------
    ValueError
        For an unknown shape or pair, an impossible mass or change, and required moments that are not finite.

    Notes
    -----
    Ground-state moments are treated as rigid ones; because of vibration r_s differs from r_e by 0.001 to 0.01 Å.

    >>> water = [0.61, 1.15, 1.76]                   # a planar molecule, Σ m c² = 0
    >>> atom = np.array([0.5, 0.3, 0.0])
    >>> mu = 18.0 * 1.0 / 19.0
    >>> p = np.diag(planar_moments(water)) + mu * np.outer(atom, atom)
    >>> heavier = np.sort(np.trace(p) - np.linalg.eigvalsh(p))
    >>> position = kraitchman(water, heavier, mass_u=18.0, change_u=1.0, shape="planar")
    >>> position.coordinates_angstrom.round(9).tolist()
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
    """Which moments (2, 3) are used; a missing one of two equal moments is not."""
    if shape == "planar":
        return np.array([[axis in pair for axis in "abc"]] * 2)
    if shape == "linear":
        return np.asarray(np.isfinite(both) & np.array([[False, True, True]] * 2))
    if shape == "symmetric":
        return np.asarray(np.isfinite(both))
    if shape == "spherical":
        used = np.isfinite(both)
        used[1, 0 if change_u > 0 else 2] = False
        used |= ~used.any(axis=1, keepdims=True)  # both must be present
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
    """P_a = I_b and P_b = I_a of a planar molecule; the moment outside `pair` follows from I_c = I_a + I_b."""
    a, b, c = moments
    if pair == "ac":
        b = c - a
    if pair == "bc":
        a = c - b
    return np.array([b, a])


def _symmetric_top(both: Floats, mu: float) -> Floats:
    """z² and ρ² in a top with two equal moments I_x; for an atom on the axis the isotopologue stays symmetric, ΔI_x = μ z².

    In the plane through the figure axis and the atom, P_z and P_x change to two eigenvalues P′; the third, perpendicular to this
    plane, remains P_x.
    """
    a, b, c = both[0]
    if not np.isfinite(both).all():  # A or C unknown: the atom is assumed to lie on the axis
        equal = [np.nanmean(row[1:] if np.isnan(row[0]) else row[:2]) for row in both]
        return np.array([(equal[1] - equal[0]) / mu, 0.0, 0.0])
    prolate = abs(b - c) <= abs(a - b)
    along, across = (a, (b + c) / 2) if prolate else (c, (a + b) / 2)
    p = np.array([across - along / 2, along / 2])  # along z, and along x
    changed = np.sort(planar_moments(both[1]))[::-1]
    still = int(np.argmin(np.abs(changed - p[1])))  # the unchanged eigenvalue, perpendicular to the plane
    return np.concatenate([_interlaced(p, np.delete(changed, still), mu), [0.0]])
