"""Derivatives of levels by constants (theorem of Hellmann and Feynman).

    ∂E_i/∂c = ⟨i|∂H/∂c|i⟩

(H. Hellmann, Einführung in die Quantenchemie (1937) 285; R. P. Feynman, Phys. Rev. 56 (1939) 340), where ∂H/∂c is a sum of
terms J^2p ½[Jz^2q, J₊^2n + J₋^2n]₊. With real coefficients a_K of a state over all K of one parity, a_{-K} = ± a_K, and
W_K = a_K a_{K+2n} ⟨K+2n|J₊^2n|K⟩,

    ⟨J^2p ½[Jz^2q, J₊^2n + J₋^2n]₊⟩ = X^p Σ_K W_K [(K+2n)^2q + K^2q]       (n > 0),      X^p Σ_K a_K² K^2q   (n = 0).

The states of all blocks are computed together, one row for each.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Workspace, distinct
from rotor.quantum.basis.state_elements import linear_blocks_of
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.hyperfine_method import are_with_spins
from rotor.quantum.levels import Levels, MomentBlock
from rotor.quantum.linear_stacks import LinearStack, stack_numbers
from rotor.quantum.wang.rotation import hamiltonian
from rotor.quantum.wang.spherical_top import scalar_and_tensor, tensor_eigenvalues
from rotor.tops.operators import Operators, Powers

if TYPE_CHECKING:
    from rotor.tops.top import Top

Rows = NDArray[np.integer]

_AT_ONCE = 1 << 22  # coefficients in memory at a time: 32 MB


def level_derivatives(top: Top, levels: Levels, names: Sequence[str] | None = None, rows: Rows | None = None) -> Floats:
    """∂E/∂c of levels by named parameters of their effects.

    Exact at the parameters that `levels` were solved with (Hellmann and Feynman).

    Parameters
    ----------
    top : Top
        Constants with which the levels were solved.
    levels : Levels
        Levels, with eigenvectors for an asymmetric top.
    names : sequence of str, optional
        Parameters, in the order of the columns; by default all parameters of the effects.
    rows : (rows,) array of int, optional
        Indices of the levels; by default all.

    Returns
    -------
    (rows, names) array
        Derivatives, MHz per MHz.

    Raises
    ------
    ValueError
        For a name that no effect has, and for levels of an asymmetric top that were solved without vectors.

    Examples
    --------
    >>> from rotor.quantum.solve import solve_levels
    >>> from rotor.tops.top import Top
    >>> top = Top.from_constants("A=10 B=6 C=4 MHz")
    >>> level_derivatives(top, solve_levels(top, 1)).round(12).tolist()[1:]
    [[0.0, 1.0, 1.0], [1.0, 1.0, 0.0], [1.0, 0.0, 1.0]]
    """
    by_name = parameter_operators(top, levels.effects)
    names = tuple(by_name) if names is None else tuple(names)
    for name in names:
        if name not in by_name:
            raise ValueError(f"no parameter {name} here to derive by: the effects have {', '.join(by_name)}")
    rows = np.arange(len(levels)) if rows is None else np.asarray(rows)

    if levels.blocks and isinstance(levels.blocks[0], MomentBlock):
        return np.concatenate([block.slopes(names) for block in levels.blocks])[rows]
    if "f" in levels.quanta or are_with_spins(levels):
        from rotor.quantum.spins.derivatives import derivatives

        return derivatives(top, levels, names, np.asarray(rows, dtype=np.int64))
    if "irrep" in levels.quanta:
        return _derivatives_of_spherical(top, levels, names, rows)
    if any(not block.alone for block in levels.blocks):
        return _derivatives_of_coupled(top, levels, names, rows)
    if "v" in levels.quanta:
        return _derivatives_of_uncoupled(top, levels, names, rows)
    return _sums_of_terms(levels, [by_name[name] for name in names], rows)


def _sums_of_terms(levels: Levels, operators: Sequence[Operators], rows: Rows) -> Floats:
    """Expectation values (rows, sums) of sums of terms."""
    terms = sorted({powers for operator in operators for powers in operator})
    if not terms:
        return np.zeros((len(rows), len(operators)))
    expectations = term_expectations(levels, terms, rows)
    factors = np.array([[operator.get(powers, 0.0) for operator in operators] for powers in terms])
    return np.asarray(expectations @ factors)


def _derivatives_of_uncoupled(top: Top, levels: Levels, names: Sequence[str], rows: Rows) -> Floats:
    """Derivatives of levels of uncoupled states, in closed form: each parameter acts in its state only."""
    terms = {0: parameter_operators(top, levels.effects)}
    terms |= {state.v: state.terms for effect in levels.effects for state in effect.states(top)}
    out, v = np.zeros((len(rows), len(names))), levels.quanta["v"][rows]
    for number, by_name in terms.items():
        here = v == number
        out[here] = _sums_of_terms(levels, [by_name.get(name, {}) for name in names], rows[here])
    return out


def parameter_operators(top: Top, effects: Sequence[QuantumEffect]) -> dict[str, Operators]:
    """∂H/∂c by powers (p, q, n) for each parameter; empty for parameters of other operators.

    If two effects have a parameter of the same name, its operators are added.
    """
    by_name: dict[str, Operators] = {}
    for effect in effects:
        operators = effect.operators(top)
        for name in effect.parameters(top):
            total = by_name.setdefault(name, {})
            for powers, factor in operators.get(name, {}).items():
                total[powers] = total.get(powers, 0.0) + factor
    return by_name


def _derivatives_of_coupled(top: Top, levels: Levels, names: Sequence[str], rows: Rows) -> Floats:
    """Derivatives of levels in coupled blocks, from their linear blocks."""
    starts = np.array([block.start for block in levels.blocks])
    blocks = [levels.blocks[i] for i in distinct(np.searchsorted(starts, rows, side="right") - 1).tolist()]
    linear = linear_blocks_of(top, levels, names, blocks)
    out = np.zeros((len(levels) + 1, len(names) + 1))  # the last row and column take the padding
    space = Workspace()
    for numbers in stack_numbers(linear):
        stack = LinearStack.of([linear[i] for i in numbers.tolist()])
        vectors = np.zeros((len(numbers), stack.size, stack.size))
        rows_of_states = np.full((len(numbers), stack.size), len(levels))
        for place, block in enumerate(blocks[i] for i in numbers.tolist()):
            size = len(block.energies_mhz)
            vectors[place, :size, :size] = block.vectors
            rows_of_states[place, :size] = block.start + np.arange(size)
        states = np.tile(np.arange(stack.size), (len(numbers), 1))
        out[rows_of_states[:, :, None], stack.parameters[:, None, :]] = stack.slopes(vectors, states, space)
    return out[rows, :-1]


def _derivatives_of_spherical(top: Top, levels: Levels, names: Sequence[str], rows: Rows) -> Floats:
    """Derivatives of split levels of a spherical top: X^p by scalar constants, the eigenvalue ω of the tensor by D_t.

    A parameter that multiplies d times the tensor plus scalars contributes d ω plus the scalars.
    """
    by_name = parameter_operators(top, levels.effects)
    total = hamiltonian(top, levels.effects)
    sign = 1 if scalar_and_tensor(total)[1] > 0 else -1
    j = levels.quanta["j"]
    omega = np.concatenate([tensor_eigenvalues(int(value), sign)[1] for value in np.unique(j)])
    x = (j * (j + 1)).astype(float)
    out = np.empty((len(levels), len(names)))
    for i, name in enumerate(names):
        scalars, dt = scalar_and_tensor(by_name[name])
        out[:, i] = dt * omega + sum(factor * x**p for (p, _, _), factor in scalars.items())
    return out[rows]


def term_expectations(levels: Levels, terms: Sequence[Powers], rows: Rows) -> Floats:
    """⟨J^2p ½[Jz^2q, J₊^2n + J₋^2n]₊⟩ (rows, terms) of levels."""
    j = levels.rotational[rows].astype(float)
    x = j * (j + 1)
    if "kc" in levels.quanta:
        by_k = _expectations_of_blocks(levels, [(q, n) for _, q, n in terms], rows)
    else:
        k = levels.quanta["k"][rows].astype(float) if "k" in levels.quanta else np.zeros_like(j)
        by_k = np.stack([k ** (2 * q) for _, q, _ in terms], axis=1)
    return np.asarray(by_k * np.stack([x**p for p, _, _ in terms], axis=1))


def _expectations_of_blocks(levels: Levels, terms: Sequence[tuple[int, int]], rows: Rows) -> Floats:
    """⟨½[Jz^2q, J₊^2n + J₋^2n]₊⟩ (rows, terms), in pieces of bounded memory."""
    if not levels.blocks:
        raise ValueError("these levels were solved without vectors; solve them with vectors=True")
    out = np.empty((len(rows), len(terms)))
    for odd in (0, 1):
        for chosen in _pieces(levels, rows, odd):
            out[chosen] = _expectations_of_parity(levels, terms, rows[chosen], odd)
    return out


def _pieces(levels: Levels, rows: Rows, odd: int) -> Iterator[NDArray[np.intp]]:
    """Places in `rows` of the states with even or odd K, in pieces of bounded size."""
    parities = np.repeat([b.basis.first_k % 2 for b in levels.blocks], [b.basis.size for b in levels.blocks])
    places = np.flatnonzero(parities[rows] == odd)
    step = max(1, _AT_ONCE // (levels.jmax // 2 + 1))
    for start in range(0, len(places), step):
        yield places[start : start + step]


def _expectations_of_parity(levels: Levels, terms: Sequence[tuple[int, int]], rows: Rows, odd: int) -> Floats:
    """⟨½[Jz^2q, J₊^2n + J₋^2n]₊⟩ (rows, terms) of states with K of one parity."""
    margin = 2 * max((n for _, n in terms), default=0)  # K starts at -margin + odd, to include pairs across K = 0
    states = _signed_coefficients(levels, rows, odd, margin)
    k: Floats = odd - margin + 2 * np.arange(states.shape[1], dtype=np.float64)
    j = levels.rotational[rows].astype(float)

    out = np.empty((len(rows), len(terms)))
    for n in {n for _, n in terms}:
        weights = _pair_weights(states, j, k, n)
        columns = [i for i, (_, order) in enumerate(terms) if order == n]
        low, high = k[: len(k) - n] ** 2, (k[: len(k) - n] + 2 * n) ** 2
        powers = np.stack([0.5 * (low ** terms[i][0] + high ** terms[i][0]) for i in columns], axis=1)
        out[:, columns] = weights @ powers
    return out


def _pair_weights(states: Floats, j: Floats, k: Floats, n: int) -> Floats:
    """a_K a_{K+2n} ⟨K+2n|J₊^2n|K⟩ (rows, K), with factors that count mirror images and both ladder operators.

    K and -K-2n form one pair, so that K > -n counts twice; K = -n is its own image.
    """
    low = k[: len(k) - n]
    weights = states[:, : len(low)] * states[:, n:]
    if n:
        step = j[:, None]
        squared = np.ones_like(weights)
        for i in range(2 * n):
            squared *= np.maximum((step - low - i) * (step + low + i + 1), 0.0)
        weights *= 2 * np.sqrt(squared)
    return weights * np.where(low > -n, 2.0, np.where(low == -n, 1.0, 0.0))


def _signed_coefficients(levels: Levels, rows: Rows, odd: int, margin: int) -> Floats:
    """a_K of states over K = odd - margin, ..., zero beyond each J: (a_K = v_K/√2, a_0 = v_0, a_{-K} = s a_K)."""
    starts = np.array([b.start for b in levels.blocks])
    block_of = np.searchsorted(starts, rows, side="right") - 1
    highest = int(levels.rotational[rows].max(initial=0))
    zero = margin // 2  # place of K = odd
    out = np.zeros((len(rows), zero + highest // 2 + 1))
    signs = np.array([b.basis.sign for b in levels.blocks])[block_of]

    order = np.argsort(block_of, kind="stable")
    cuts = np.flatnonzero(np.diff(block_of[order])) + 1
    for places in np.split(order, cuts) if len(rows) else ():
        block = levels.blocks[block_of[places[0]]]
        first = zero + block.basis.first_k // 2
        out[places, first : first + block.basis.size] = block.vectors[:, rows[places] - block.start].T

    out[:, zero + (1 - odd) :] *= np.sqrt(0.5)
    mirrored = zero + np.arange(1, zero + 1) - odd  # places of K = 2 - odd, ... behind K = -2 + odd, ...
    inside = mirrored < out.shape[1]
    out[:, zero - 1 - np.flatnonzero(inside)] = signs[:, None] * out[:, mirrored[inside]]
    return out
