"""The lowest states of real tridiagonal matrices at many fields at once: a linear or symmetric top in a static field.

Energies at some fields, by LAPACK, are joined by cubics through energies and slopes. At every other field they are improved with the
eigenvectors of a twisted factorisation, T - λ = N D N^T with N lower triangular above row k and upper triangular below it,

    z_k = 1,   z_i = -b_i z_(i+1)/d⁺_i (i < k),   z_i = -b_(i-1) z_(i-1)/d⁻_i (i > k),   λ ← λ + γ_k/|z|²,

k where γ_k = d⁺_k + d⁻_k - (a_k - λ) is smallest: the iteration of the Rayleigh quotient, which converges with the third power (it is
derived by multiplying out). The number of negative d⁺ is that of the energies below λ (Sylvester), so
that a state of another rank is noticed; then LAPACK does it all.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints

Chain = tuple[tuple[Floats, ...], int]  # H_n (n, n) of a chain, and how many of its lowest states

ANCHORS = 13  # fields that LAPACK solves, of many
SWEEPS = 4  # of the Rayleigh quotient at most
CONVERGED = 1e-9  # of the smallest gap: the last change of an energy; what is left of it is the third power
OFF_ZERO = (
    1e-15  # of the largest element: by which energies are moved before a sweep, so that no pivot is 0 at zero field
)
TOGETHER = 1 << 19  # numbers of a sweep held at once where several chains are solved together


def is_chain(terms: tuple[NDArray[np.generic], ...]) -> bool:
    """Whether matrices are real and have no elements beyond the diagonals beside the main one."""
    if len(terms[0]) < 3 or any(np.iscomplexobj(one) for one in terms):
        return False
    return not any(np.triu(one, 2).any() for one in terms)


def chain_states(chains: Sequence[Chain], fields: Floats) -> list[tuple[Floats, Floats]] | None:
    """Energies (fields, count) and vectors (fields, n, count) of the lowest states of each chain; None where that went astray.

    Chains of several sizes are filled up to one size with states far above, which nothing connects to the others.
    """
    size = max(len(terms[0]) for terms, _ in chains)
    if len(chains) > 1 and size * len(fields) * sum(count for _, count in chains) > TOGETHER:
        each = [chain_states([one], fields) for one in chains]
        return None if any(one is None for one in each) else [one[0] for one in each if one is not None]
    padded, scale = _padded([terms for terms, _ in chains], size, float(np.abs(fields).max()))
    counts = [count for _, count in chains]
    of, rank = np.repeat(np.arange(len(chains)), counts), np.concatenate([np.arange(count) for count in counts])
    energies, gaps = _between_anchors(padded, fields, of, rank)
    powers = fields[:, None] ** np.arange(padded.shape[1])
    main = np.diagonal(padded, 0, 2, 3).transpose(2, 1, 0)[..., of]  # (n, powers, states)
    beside = np.diagonal(padded, 1, 2, 3).transpose(2, 1, 0)[..., of]
    main, beside = (np.matmul(powers, one) for one in (main, beside))  # (n, fields, states)
    for _ in range(SWEEPS):
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            moved = energies - OFF_ZERO * scale
            vectors, change, below = twisted(main, beside, moved)
        energies, change = moved + change, change - OFF_ZERO * scale
        if not np.isfinite(vectors).all():
            return None
        if (np.abs(change) <= CONVERGED * gaps + 2 * OFF_ZERO * scale).all():
            right = ((below == rank) | (below == rank + 1)).all()
            return _apart(chains, energies, vectors) if right else None
    return None


def _apart(chains: Sequence[Chain], energies: Floats, vectors: Floats) -> list[tuple[Floats, Floats]]:
    """What belongs to each chain, the states that filled it up left out."""
    ends = np.cumsum([count for _, count in chains])
    places = [slice(end - count, end) for end, (_, count) in zip(ends.tolist(), chains, strict=True)]
    return [
        (energies[:, place], vectors[: len(terms[0]), :, place].transpose(1, 0, 2))
        for place, (terms, _) in zip(places, chains, strict=True)
    ]


def _padded(chains: Sequence[tuple[Floats, ...]], size: int, strongest: float) -> tuple[Floats, float]:
    """H_n of all chains (chains, powers, size, size), and the largest element at the strongest field."""
    out = np.zeros((len(chains), max(map(len, chains)), size, size))
    for chain, terms in enumerate(chains):
        for power, one in enumerate(terms):
            out[chain, power, : len(one), : len(one)] = one
    scale = float(sum(strongest**n * np.abs(out[:, n]).max() for n in range(out.shape[1])))
    for chain, terms in enumerate(chains):
        rest = np.arange(len(terms[0]), size)
        out[chain, 0, rest, rest] = 4 * scale + scale * rest
    return out, scale


def _between_anchors(padded: Floats, fields: Floats, of: Ints, rank: Ints) -> tuple[Floats, Floats]:
    """Energies (fields, states) from cubics through energies and slopes at a few fields, and the least gap there (states,)."""
    places = np.unique(np.linspace(0, len(fields) - 1, ANCHORS).astype(int))
    at, count = fields[places], int(rank.max()) + 1
    powers = at[:, None] ** np.arange(padded.shape[1])
    values, every = np.linalg.eigh(np.einsum("fp,cpij->cfij", powers, padded))
    vectors = every[..., :count]
    slopes = sum(
        n * at[:, None] ** (n - 1) * (vectors * (padded[:, None, n] @ vectors)).sum(axis=2)
        for n in range(1, padded.shape[1])
    )
    gaps = np.diff(values[..., : count + 1], axis=2).min(axis=1)  # (chains, count) to the next state above
    gaps = np.minimum(gaps, np.concatenate([gaps[:, :1], gaps[:, : gaps.shape[1] - 1]], axis=1)[:, : gaps.shape[1]])
    gaps = np.concatenate([gaps, gaps[:, -1:]], axis=1)[:, :count]
    return _cubics(at, values[of, :, rank].T, np.asarray(slopes)[of, :, rank].T, fields), gaps[of, rank]


def _cubics(at: Floats, values: Floats, slopes: Floats, fields: Floats) -> Floats:
    """Cubic Hermite curves through values and slopes (points, states) at `at`, (fields, states)."""
    place = np.clip(np.searchsorted(at, fields, "right") - 1, 0, len(at) - 2)
    width = (at[place + 1] - at[place])[:, None]
    t = (fields - at[place])[:, None] / width
    rise = (values[place + 1] - values[place]) / width
    first, last = slopes[place], slopes[place + 1]
    curve = first + t * (3 * rise - 2 * first - last + t * (first + last - 2 * rise))
    return np.asarray(values[place] + t * width * curve)


def twisted(main: Floats, beside: Floats, energies: Floats) -> tuple[Floats, Floats, Ints]:
    """Normalised vectors (n, f, s), corrections of energies (f, s), and how many energies lie below each (f, s).

    main: (n, f, s). beside: (n - 1, f, s). energies: (f, s), approximate; at the energy of a free state itself a pivot is 0.
    """
    size = len(main)
    shifted, squares = main - energies, beside**2
    down, up = shifted.copy(), shifted.copy()
    step = np.empty_like(energies)
    for i in range(1, size):
        np.divide(squares[i - 1], down[i - 1], out=step)
        down[i] -= step
        np.divide(squares[size - 1 - i], up[size - i], out=step)
        up[size - 1 - i] -= step
    gamma = down + up - shifted
    place = np.abs(gamma).argmin(axis=0)
    rows = np.arange(size)[:, None, None]
    vectors = (rows == place).astype(np.float64)
    upwards = np.where(rows[1:] > place, -beside / up[1:], 0.0)
    downwards = np.where(rows[:-1] < place, -beside / down[:-1], 0.0)
    for i in range(1, size):
        np.multiply(upwards[i - 1], vectors[i - 1], out=step)
        vectors[i] += step
    for i in range(size - 2, -1, -1):
        np.multiply(downwards[i], vectors[i + 1], out=step)
        vectors[i] += step
    lengths = (vectors**2).sum(axis=0)
    change = np.take_along_axis(gamma, place[None], axis=0)[0] / lengths
    return vectors / np.sqrt(lengths), change, np.count_nonzero(down < 0, axis=0)
