"""Labels of levels by the rules that DIAG of an option line selects (H. M. Pickett, documentation of SPFIT and SPCAT, "DIAG").

| DIAG | states are assigned to | and inside it ordered by |
|---|---|---|
| 0 | the Wang block of one state v and one coupling pattern, by the largest weights | energy, as K rises |
| 1 | one function each, by the largest weights | |
| 2 | as 0 | energy, as the diagonal elements rise |
| 3 | all functions of one v and pattern | energy, as K rises; of one K the function with Ka + Kc = N + 1 first |
| 4 | as 3 | ⟨K²⟩, those of one K by energy |
| 5 | as 3 | energy, as the diagonal elements rise |

Levels with spins already have the labels of DIAG 0, and of 3 where no two Wang blocks of one v and pattern are connected; so do levels of a
single Wang block. Levels of coupled states are labelled here (elsewhere in this package by overlaps with the levels of each state). In an
oblate basis energy falls as K rises.

If diagonal elements are equal (often those of the two functions of one K ≥ 3) the program takes the function of its earlier Wang block: for
even K the one with Ka + Kc = N if N is even and N + 1 if N is odd, for odd K the opposite.

Two of SPCAT's rules matter where the diagonal does not rise with K, as for an oblate top in prolate axes (`kroll`, `hdiag` and `ordblk` in
H. M. Pickett's program): functions that no element connects are named apart; and with DIAG 0 it takes the elements of all functions from
the first K on, above K = 3, where the diagonal falls, out of the matrix. These functions are then states with first-order energies. Here
all energies are eigenvalues, and such states are named after the function that has the largest share of them. Levels that are called by N
and K alone (SPIND below 0) are named after that function in the whole block where each has more than half of one function: K is nearly good
then. SPCAT names those of them that are connected by energy. In an oblate basis the diagonal is that of -H.

With DIAG below 0 SPCAT and SPFIT diagonalize nothing: levels are the functions of the basis, with the diagonal elements as energies. A
solved block has all its eigenvectors c and energies E, so that <i|H|i> = sum over states of c_i^2 E; no matrix is set up again.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from enum import Enum
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.quantum.blocks.connected import part_numbers
from rotor.quantum.levels import Levels, SolvedBlock
from rotor.quantum.spins.blocks import SpinFunctions
from rotor.quantum.spins.parts import assigned, names_of_parts
from rotor.quantum.wang.basis import WangBlock, names_of
from rotor.tops.constants.operators import Operators

if TYPE_CHECKING:
    from rotor.quantum.labels.tracking import NamedFunctions, Naming

_FIRST_LOOKED_AT = 5  # the diagonal is tested from the last function of a block with K up to this value
_CLEAR = 0.5  # a larger weight is the largest one of its state and of its function
_NO_ELEMENT = 1e-13  # round-off of a matrix computed from its eigenvectors, relative to the largest energy


class Diagonal(Enum):
    """Behaviour of the diagonal of a Hamiltonian, which decides how levels are labelled.

    RISES: with K (falls in an oblate basis). FALLS: at some K. FALLS_IN_K: at some K, and levels are labelled by N and K.
    """

    RISES = 0
    FALLS = 1
    FALLS_IN_K = 2


def falls_with_k(
    states: Iterable[Mapping[str, Operators]], values: Mapping[str, float], highest_n: int, oblate: bool
) -> int | None:
    """The lowest N at which the diagonal of a state does not rise (in an oblate basis, fall) with K in steps of two; None without any.

    The diagonal consists of the terms with n = 0 of H = Σ c N^2p Nz^2q ½(N₊^2n + N₋^2n).
    """
    n, k = np.arange(highest_n + 1.0), np.arange(highest_n + 1.0)
    lowest_n = []
    for operators in states:
        diagonal = np.zeros((highest_n + 1, highest_n + 1))
        for name, powers in operators.items():
            for (p, q, order), factor in powers.items():
                if order == 0:
                    diagonal += values[name] * factor * np.outer((n * (n + 1)) ** p, k ** (2 * q))
        steps = (diagonal[:, 2:] - diagonal[:, :-2]) * (-1.0 if oblate else 1.0)
        wrong = ((steps < 0) & (k[2:] <= n[:, None])).any(axis=1)
        lowest_n += np.flatnonzero(wrong)[:1].tolist()
    return min(lowest_n, default=None)


def connected_groups(groups: Ints, k: Ints, amplitudes: Floats, energies: Floats, diag: int) -> Ints:
    """The groups of functions that label levels, divided into connected parts.

    groups (functions,): a group for each function, such as its Wang block. k (functions,). amplitudes (functions, states): eigenvectors
    in columns. energies (states,): eigenvalues of H, or of -H in an oblate basis. diag: DIAG; with 0 each function whose diagonal element
    falls is a separate group.
    Returns: group numbers from 0 on.
    """
    hamiltonian = (amplitudes * (energies - energies.mean())) @ amplitudes.T
    # elements of round-off link nothing
    linked = np.abs(hamiltonian) > _NO_ELEMENT * np.abs(energies).max(initial=0.0)
    if diag == 0:
        apart = _rolled_over(groups, k, hamiltonian.diagonal())
        linked[apart, :] = linked[:, apart] = False
    parts = part_numbers(len(k), *np.nonzero(linked))
    return np.asarray(np.unique(np.column_stack([groups, parts]), axis=0, return_inverse=True)[1].reshape(-1))


def _rolled_over(groups: Ints, k: Ints, diagonal: Floats) -> NDArray[np.bool_]:
    """Functions that SPCAT removes from the matrix: in each group all from the first whose diagonal element falls."""
    apart = np.zeros(len(k), dtype=bool)
    for group in np.unique(groups):
        members = np.flatnonzero(groups == group)
        members = members[np.argsort(k[members], kind="stable")]  # stable: components of one K keep their order
        first = max(_FIRST_LOOKED_AT - int(k[members[0]]), 0) // 2
        falls = np.flatnonzero(np.diff(diagonal[members[first:]]) < 0)
        if len(falls):
            apart[members[first + falls[0] + 1 :]] = True
    return apart


BY_DIAG = (1, 2, 4, 5)  # values of DIAG whose labels differ from the default ones
_OF_WANG = (0, 2)  # values of DIAG that group by Wang blocks
_BY_DIAGONAL = (2, 5)
_ANEW = (2, 4, 5)  # values of DIAG whose order of labels depends on the constants
_EQUAL = 1e-11  # diagonal elements of the two functions of one K agree within this fraction of the largest energy


class Functions(NamedTuple):
    """The functions of a block: labels v, Ka, Kc, pattern (n, columns); K, group, Wang block (n,); amplitudes (n, states).

    n: rotation N. Ka + Kc - N, 0 or 1, identifies a Wang block of even or odd K.
    """

    names: Ints
    k: Ints
    pattern: Ints
    wang: Ints
    amplitudes: Floats
    n: Ints

    @property
    def above(self) -> Ints:
        """Ka + Kc - N, (n,)."""
        return np.asarray(self.names[:, 1] + self.names[:, 2] - self.n)


def named_by(levels: Levels, diag: int, oblate: bool, diagonal: Diagonal = Diagonal.RISES) -> Levels:
    """Levels of an asymmetric top with the labels of DIAG; unchanged if they have these labels already."""
    if not has_other_names(levels, diag, diagonal):
        return levels
    rises = diagonal is Diagonal.RISES
    tables, shares = [], []
    for block in levels.blocks:
        if diag == 3 and rises and block.spins and not _connects_wang_blocks(block.spins):
            tables.append(np.asarray(block.labels))
            shares.append(np.asarray(block.mixing))
            continue
        functions = wang_functions(block, str(levels.representation))
        energies = -block.energies_mhz if oblate else block.energies_mhz  # along c energies fall with K
        at = places(functions, energies, diag, diagonal)
        groups = _groups(functions, diag)
        tables.append(functions.names[at])  # with the weight of each state in the group that labels it
        shares.append((functions.amplitudes**2 * (groups[:, None] == groups[at])).sum(axis=0))
    return renamed(levels, tables, shares)


def renamed(levels: Levels, tables: Sequence[Ints], shares: Sequence[Floats]) -> Levels:
    """Levels with new labels v, Ka (or K), Kc (with spins also the doubled pattern N, ..., F) and weights, listed by block."""
    table = np.concatenate(tables)
    columns = {"v": 0, "k": 1, "ka": 1, "kc": 2}
    quanta = {name: table[:, columns[name]] if name in columns else values for name, values in levels.quanta.items()}
    if table.shape[1] > 3:
        quanta["n"] = table[:, 3] // 2
        for column, name in enumerate([name for name in quanta if name not in columns and name != "n"], 4):
            quanta[name] = table[:, column] if name in levels.halves else table[:, column] // 2
    return replace(levels, quanta=quanta, mixing=np.concatenate(shares))


def naming_by(diag: int, oblate: bool, diagonal: Diagonal = Diagonal.RISES) -> Naming:
    """Rule that labels states without spins while constants change."""

    def named(blocks: Sequence[tuple[int, WangBlock]], representation: str) -> NamedFunctions:
        functions = _joined([(v, basis, None, np.empty((basis.size, 0))) for v, basis in blocks], representation)
        return _named_functions(functions, None, diag, oblate, diagonal)

    return named


def spin_naming_by(
    diag: int, oblate: bool, diagonal: Diagonal, block: SolvedBlock, representation: str
) -> NamedFunctions:
    """Rule that labels the states of a block with spins while constants change, over its basis functions."""
    functions = wang_functions(over_basis(block), representation)
    return _named_functions(functions, functions.amplitudes, diag, oblate, diagonal)


def _named_functions(
    functions: Functions, turn: Floats | None, diag: int, oblate: bool, diagonal: Diagonal
) -> NamedFunctions:
    """Rule of DIAG; turn: the functions in rows over the basis of the eigenvectors, None where they are this basis."""
    from rotor.quantum.labels.tracking import Follows, NamedFunctions

    groups = _groups(functions, diag)
    if turn is not None:
        groups = groups[np.argsort(turn.argmax(axis=1))]

    def namer(matrix: Floats, energies: Floats, vectors: Floats) -> Ints:
        amplitudes = vectors if turn is None else turn @ vectors
        at = places(functions._replace(amplitudes=amplitudes), -energies if oblate else energies, diag, diagonal)
        return functions.names[at]

    changes = diagonal is not Diagonal.RISES or diag in _ANEW
    return NamedFunctions(groups, namer, Follows.NOTHING if changes else Follows.GROUPS)


def _groups(functions: Functions, diag: int) -> Ints:
    """The group of each function in which levels are labelled by their order."""
    return np.arange(len(functions.k)) if diag == 1 else functions.wang if diag in _OF_WANG else functions.pattern


def has_other_names(levels: Levels, diag: int, diagonal: Diagonal) -> bool:
    """Whether DIAG gives levels of an asymmetric top other labels than those that they have."""
    if "kc" not in levels.quanta or diagonal is not Diagonal.RISES or diag in BY_DIAG:
        return "kc" in levels.quanta
    # blocks of several Wang blocks, with spins of one v and pattern if DIAG is 3
    return any(
        diag == 3 and _connects_wang_blocks(block.spins) if block.spins else len(block.parts) > 1
        for block in levels.blocks
    )


def _connects_wang_blocks(block: SpinFunctions) -> bool:
    """Whether a block with spins contains several Wang blocks of one v and pattern; False if only some functions exist."""
    if block.allowed is not None:
        return False
    held = [
        (wang_part.v, number)
        for part in block.parts
        for wang_part in part.rotor.parts
        for number in range(part.patterns.start, part.patterns.stop)
    ]
    return len(set(held)) < len(held)


def places(functions: Functions, energies: Floats, diag: int, diagonal: Diagonal = Diagonal.RISES) -> Ints:
    """The function that labels each state, (states,); see `named_by`."""
    shares = functions.amplitudes**2
    if diag == 1:
        return assigned(shares, np.ones(len(shares), dtype=np.int64))
    groups = _groups(functions, diag)
    if diagonal is Diagonal.FALLS_IN_K and diag == 0 and (shares.max(axis=0) > _CLEAR).all():
        return np.asarray(shares.argmax(axis=0))  # one clear function a state names it
    if diagonal is not Diagonal.RISES:
        groups = connected_groups(groups, functions.k, functions.amplitudes, energies, diag)
    count = int(groups.max()) + 1
    group_weights = np.stack([shares[groups == g].sum(axis=0) for g in range(count)])
    group_of_state = assigned(group_weights, np.bincount(groups, minlength=count))
    ranks = _ranks(shares @ energies) if diag in _BY_DIAGONAL else None
    functions_of_states = np.empty(len(energies), dtype=np.int64)
    for g in range(count):
        members, states = np.flatnonzero(groups == g), np.flatnonzero(group_of_state == g)
        if diag == 4:
            functions_of_states[states] = _by_k2(functions, members, states, shares, energies)
            continue
        rising = _by_rising_k(functions, members) if ranks is None else _by_diagonal(functions, members, ranks)
        # stable: states of one energy keep their order
        functions_of_states[states[np.argsort(energies[states], kind="stable")]] = rising
    return functions_of_states


def _by_diagonal(functions: Functions, members: Ints, ranks: Floats) -> Ints:
    """The functions of a group by rising diagonal element; a selection sort by exchanges, as in SPCAT, orders equal ones.

    The sort begins with the Wang block of Ka + Kc - N = 0 if N + K is even, of 1 if it is odd.
    """
    wang = (functions.n + functions.k + functions.above)[members] % 2
    order = members[np.lexsort((functions.k[members], wang))]
    left = ranks[order]
    for place in range(len(order) - 1):
        least = place + int(left[place:].argmin())
        left[[place, least]], order[[place, least]] = left[[least, place]], order[[least, place]]
    return order


def _ranks(diagonal: Floats) -> Floats:
    """Rank of each function by diagonal element; elements equal within round-off share a rank."""
    order = np.argsort(diagonal, kind="stable")
    steps = np.diff(diagonal[order]) > _EQUAL * np.abs(diagonal).max(initial=0.0)
    ranks = np.empty(len(diagonal))
    ranks[order] = np.concatenate([[0.0], np.cumsum(steps)])
    return ranks


def _by_rising_k(functions: Functions, members: Ints) -> Ints:
    """The functions of a group by rising K; for one K the function with Ka + Kc = N + 1 first."""
    return np.asarray(members[np.lexsort((-functions.above[members], functions.k[members]))])


def _by_k2(functions: Functions, members: Ints, states: Ints, shares: Floats, energies: Floats) -> Ints:
    """Functions for states ordered by ⟨K²⟩ of their part in the group; states of one K by energy."""
    weights = shares[np.ix_(members, states)]
    # the mean of K² of each state orders the states of a group
    k2 = (functions.k[members].astype(float) ** 2) @ weights / weights.sum(axis=0)
    by_k2, by_tau = np.argsort(k2, kind="stable"), _by_rising_k(functions, members)
    ks, functions_of_states = functions.k[by_tau], np.empty(len(states), dtype=np.int64)
    for k in np.unique(ks):
        run = np.flatnonzero(ks == k)
        here = by_k2[run]
        functions_of_states[here[np.argsort(energies[states[here]], kind="stable")]] = by_tau[run]
    return functions_of_states


def over_basis(block: SolvedBlock) -> SolvedBlock:
    """The block with its basis functions in place of its states."""
    if not block.spins:
        return replace(block, vectors=np.eye(len(block.vectors)))
    columns = block.spins.columns.only(block.spins.number)
    rotors = [replace(rotor, vectors=np.eye(len(rotor.energies_mhz))) for rotor in columns.rotors]
    spins = replace(block.spins, columns=replace(columns, rotors=rotors), number=0)
    return replace(block, spins=spins, vectors=np.eye(spins.parts[-1].place.stop))


def wang_functions(block: SolvedBlock, representation: str) -> Functions:
    """The functions |N K ±⟩ of a solved block, with all coupling patterns, by part, pattern and K."""
    if block.spins:
        return _functions_with_spins(block, representation)
    return _joined([(part.v, part.basis, None, block.vectors[part.place]) for part in block.parts], representation)


def _functions_with_spins(block: SolvedBlock, representation: str) -> Functions:
    """The functions of a block with spins."""
    pieces = []
    for part in block.spins.parts:
        for wang_part in part.rotor.parts:
            assert isinstance(wang_part.basis, WangBlock)
            inside = np.einsum("kr,prn->pkn", part.rotor.vectors[wang_part.place], part.rows(block.vectors))
            patterns = block.spins.patterns[part.patterns]
            pieces += [
                (wang_part.v, wang_part.basis, pattern, each) for pattern, each in zip(patterns, inside, strict=True)
            ]
    return _joined(pieces, representation)


def _joined(pieces: Sequence[tuple[int, WangBlock, Ints | None, Floats]], representation: str) -> Functions:
    """Functions of all parts."""
    names, ks, groups, wangs, ns, group_numbers = [], [], [], [], [], dict[tuple[int, ...], int]()
    for place, (v, basis, pattern, _) in enumerate(pieces):
        ka, kc = names_of(basis, representation)
        order = np.argsort(kc if representation == "IIIl" else ka, kind="stable")
        pattern_columns = [] if pattern is None else [np.full(basis.size, value) for value in pattern]
        names.append(np.column_stack([np.full(basis.size, v), ka[order], kc[order], *pattern_columns]))
        ks.append(np.sort(basis.k))
        key = (v, *(() if pattern is None else tuple(pattern.tolist())))
        groups.append(np.full(basis.size, group_numbers.setdefault(key, len(group_numbers))))
        wangs.append(np.full(basis.size, place))
        ns.append(np.full(basis.size, basis.j))
    amplitudes = np.concatenate([vectors for *_, vectors in pieces])
    k, pattern, wang, n = (np.concatenate(each) for each in (ks, groups, wangs, ns))
    return Functions(np.concatenate(names), k, pattern, wang, amplitudes, n)


UNDIAGONALIZED_NOTE = (
    "DIAG is below 0: the energies are diagonal elements of the Hamiltonian over the functions of the file, as in SPCAT, and each "
    "level is one function; DIAG = 0 has eigenvalues"
)


def refuse_other_functions(levels: Levels, l_doubled: bool) -> None:
    """Raise ValueError for levels whose functions are not those of the file, so that they have other diagonal elements than in SPCAT."""
    what = "l-doubled states" if l_doubled else "three equivalent spins"
    if l_doubled or any(block.spins and block.spins.allowed for block in levels.blocks):
        raise ValueError(
            f"DIAG is below 0, diagonal elements in place of eigenvalues: those of {what} are not computed; give DIAG = 0 for eigenvalues"
        )


def without_diagonalization(levels: Levels) -> Levels:
    """Levels of the functions of each block, in order of their diagonal elements; each has a single function.

    Levels without blocks, such as those of a symmetric top, are those of single functions already.
    """
    if not levels.blocks:
        return levels
    pieces = [_functions_as_states(block, str(levels.representation)) for block in levels.blocks]
    blocks = tuple(block for block, _ in pieces)
    energies = levels.energy_mhz.copy()
    for block in blocks:
        energies[block.start : block.start + len(block.energies_mhz)] = block.energies_mhz
    named = renamed(levels, [names for _, names in pieces], [np.ones(len(names)) for _, names in pieces])
    return replace(named, energy_mhz=energies, blocks=blocks)


def _functions_as_states(block: SolvedBlock, representation: str) -> tuple[SolvedBlock, Ints]:
    """A block whose states are its functions, and their labels.

    The rows of the eigenvectors are rotational states where spins are added. With functions F = T R of rows R, amplitudes A = T V and
    orthogonal V, the functions are the columns of V A^T.
    """
    if block.axial_k is None:
        functions = wang_functions(block, representation)
        names, amplitudes = functions.names, functions.amplitudes
    else:  # |N K⟩ with each pattern: the rows of the vectors
        columns = block.spins.columns.only(block.spins.number)
        names, amplitudes = names_of_parts(columns, block.spins.patterns).labels, block.vectors
    diagonal: Floats = amplitudes**2 @ block.energies_mhz
    order = np.argsort(diagonal, kind="stable")  # stable: equal diagonal elements keep the order of functions
    vectors = (block.vectors @ amplitudes.T)[:, order]
    names = names[order]
    labels = None if block.labels is None else names
    return replace(block, energies_mhz=diagonal[order], vectors=vectors, labels=labels), names
