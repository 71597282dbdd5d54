"""The lowest states of real tridiagonal matrices at many fields at once: a linear or symmetric top in a static field.

Energies at some fields, from LAPACK, are interpolated by a polynomial in √(field - first field) with Chebyshev nodes, which are denser at
weak fields, where energies bend most.

At all fields they are improved with eigenvectors z from a twisted factorisation (`rotor.quantum.wang.twisted`),

    λ ← λ + γ_k/|z|².

This is Rayleigh quotient iteration, which converges cubically (derived by multiplying out). The number of negative d⁺ equals the number of
energies below λ (Sylvester), which reveals convergence to a wrong state; LAPACK then solves all fields.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints, Workspace
from rotor.quantum.wang.twisted import twisted

Chain = tuple[tuple[Floats, ...], int]  # H_n (n, n) of a chain, and the number of its lowest states to solve

ANCHORS = 15  # fields solved by LAPACK
SWEEPS = 4  # most Rayleigh quotient iterations
CONVERGED = 1e-9  # last change of an energy relative to the smallest gap; vectors have an error of this size, energies of its square
# shift of energies before a sweep, relative to the largest element, so that no pivot is 0 at zero field
OFF_ZERO = 1e-15
TOGETHER = 1 << 19  # most numbers in memory where several chains are solved together


def is_chain(terms: tuple[NDArray[np.generic], ...]) -> bool:
    """Whether matrices are real and tridiagonal."""
    if len(terms[0]) < 3 or any(np.iscomplexobj(term) for term in terms):
        return False
    return not any(np.triu(term, 2).any() for term in terms)


def chain_states(chains: Sequence[Chain], fields: Floats) -> list[tuple[Floats, Floats]] | None:
    """Energies (fields, count) and vectors (fields, n, count) of the lowest states of each chain; None if the iteration fails.

    Chains of several sizes are padded to one size with unconnected states of high energy.
    """
    size = max(len(terms[0]) for terms, _ in chains)
    if len(chains) > 1 and size * len(fields) * sum(count for _, count in chains) > TOGETHER:
        each = [chain_states([chain], fields) for chain in chains]
        return None if any(states is None for states in each) else [states[0] for states in each if states is not None]
    padded, scale = _padded([terms for terms, _ in chains], size, float(np.abs(fields).max()))
    counts = [count for _, count in chains]
    of, rank = np.repeat(np.arange(len(chains)), counts), np.concatenate([np.arange(count) for count in counts])
    energies, gaps = _between_anchors(padded, fields, of, rank)
    powers = fields[:, None] ** np.arange(padded.shape[1])
    main = np.diagonal(padded, 0, 2, 3).transpose(2, 1, 0)[..., of]  # (n, powers, states)
    beside = np.diagonal(padded, 1, 2, 3).transpose(2, 1, 0)[..., of]
    main, beside = (np.matmul(powers, chain) for chain in (main, beside))  # (n, fields, states)
    vectors = _swept(main, beside, energies, rank, gaps, scale)
    if vectors is None:
        return None
    ends = np.cumsum(counts).tolist()
    places = [slice(end - count, end) for end, count in zip(ends, counts, strict=True)]
    return [  # without the padding states
        (energies[:, place], vectors[: len(terms[0]), :, place].transpose(1, 0, 2))
        for place, (terms, _) in zip(places, chains, strict=True)
    ]


def _swept(main: Floats, beside: Floats, energies: Floats, rank: Ints, gaps: Floats, scale: float) -> Floats | None:
    """Eigenvectors (n, fields, states) by Rayleigh quotient iteration, which improves `energies` (fields, states) in place.

    Converged energies are left out of the next sweep. None if an energy does not converge to the state of its rank.
    """
    shape, flat = energies.shape, energies.reshape(-1)
    bands = main.reshape(len(main), -1), beside.reshape(len(beside), -1)
    ranks, least = np.tile(rank, shape[0]), np.tile(CONVERGED * gaps, shape[0]) + 2 * OFF_ZERO * scale
    vectors, moving, space = np.empty_like(bands[0]), np.arange(flat.size), Workspace()
    for sweep in range(SWEEPS):
        moved = flat[moving] - OFF_ZERO * scale
        diagonal, next_to_it = (band[:, moving] for band in bands) if sweep else bands
        with np.errstate(invalid="ignore"):
            turned, squares, gamma, below = twisted(diagonal - moved, next_to_it, space)
            change = gamma / squares
        flat[moving] = moved + change
        vectors[:, moving] = turned
        still = np.abs(change - OFF_ZERO * scale) <= least[moving]
        if not ((below == ranks[moving]) | (below == ranks[moving] + 1) | ~still).all():
            return None
        moving = moving[~still]
        if not len(moving):
            return vectors.reshape(-1, *shape) if np.isfinite(vectors).all() else None
    return None


def _padded(chains: Sequence[tuple[Floats, ...]], size: int, strongest: float) -> tuple[Floats, float]:
    """H_n of all chains (chains, powers, size, size), and the largest element at the strongest field."""
    out = np.zeros((len(chains), max(map(len, chains)), size, size))
    for chain, terms in enumerate(chains):
        for power, term in enumerate(terms):
            out[chain, power, : len(term), : len(term)] = term
    scale = float(sum(strongest**n * np.abs(out[:, n]).max() for n in range(out.shape[1])))
    for chain, terms in enumerate(chains):
        rest = np.arange(len(terms[0]), size)
        out[chain, 0, rest, rest] = 4 * scale + scale * rest
    return out, scale


def _between_anchors(padded: Floats, fields: Floats, of: Ints, rank: Ints) -> tuple[Floats, Floats]:
    """Energies (fields, states) interpolated between anchor fields, and the smallest gap at these (states,)."""
    first, width = fields[0], fields[-1] - fields[0]
    roots = (1 - np.cos(np.pi * np.arange(ANCHORS) / (ANCHORS - 1))) / 2
    powers = (first + width * roots**2)[:, None] ** np.arange(padded.shape[1])
    energies = np.linalg.eigvalsh(np.einsum("fp,cpij->cfij", powers, padded))
    apart = np.pad(np.diff(energies, axis=2).min(axis=1), ((0, 0), (1, 1)), constant_values=np.inf)
    gaps = np.minimum(apart[:, :-1], apart[:, 1:])  # (chains, n)
    return lagrange(np.sqrt((fields - first) / width), roots) @ energies[of, :, rank].T, gaps[of, rank]


def lagrange(places: Floats, nodes: Floats) -> Floats:
    """Factors (places, nodes) of the values at nodes in the polynomial through them."""
    apart = places[:, None] - nodes
    others = ~np.eye(len(nodes), dtype=bool)
    above = np.array([apart[:, rest].prod(axis=1) for rest in others]).T
    return np.asarray(above / np.array([(node - nodes[rest]).prod() for node, rest in zip(nodes, others, strict=True)]))
