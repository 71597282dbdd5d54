"""Lines above a cut from stacked Wang blocks: the same list as from every pair of blocks, cut afterwards."""

import dataclasses

import numpy as np
import pytest

from rotor.quantum.blocks.reduced import connected_wang_blocks, wang_amplitudes
from rotor.quantum.operators.tensors import body_tensor
from rotor.quantum.solve import solve_levels
from rotor.quantum.wang.stacked_blocks import Vector, are_whole, stacked
from rotor.spectra.intensity import intensity_cut
from rotor.spectra.lines import Lines, line_list
from rotor.spectra.transitions import pairs as transitions
from rotor.spectra.transitions import strong_lines
from rotor.thermodynamics.sums.partition import PartitionFunction
from rotor.tops.top import Top

TOPS = {
    "prolate, Ir": "A=8572 B=3640 C=2790 MHz",
    "oblate, IIIl": "A=8572 B=7640 C=3790 MHz",
    "S reduction, wide blocks": "A=8572 B=3640 C=2790 DJ=1e-3 DJK=-2e-3 DK=1e-2 d1=-1e-4 d2=-2e-5 MHz",
}
DIPOLES = [(1.2, 0, 0), (0, 1.9, 0), (0, 0, 0.4), (1.2, 1.9, 0), (1.2, 0, 0.4), (0, 1.9, 0.4), (1.2, 1.9, 0.4)]
Q = 2000.0


def by_states(lines: Lines | transitions.Transitions) -> tuple[np.ndarray, ...]:
    order = np.lexsort((lines.lower, lines.upper))
    return lines.upper[order], lines.lower[order], lines.frequency_mhz[order], lines.strength_debye2[order]


def assert_equal(computed: Lines, expected: Lines, mu2: float) -> None:
    """The same lines; strengths to round-off of the sum over all upper states, (2J+1) μ², of which weak ones are left over."""
    first, other = by_states(computed), by_states(expected)
    for i in range(3):
        assert np.array_equal(first[i], other[i])
    j = computed.levels.quanta["j"][first[1]]
    assert (np.abs(first[3] - other[3]) <= 1e-12 * other[3] + 1e-15 * (2 * j + 3) * mu2).all()


@pytest.mark.parametrize("constants", TOPS.values(), ids=TOPS)
@pytest.mark.parametrize("dipole", DIPOLES)
def test_a_cut_list_is_the_whole_list_cut(constants, dipole):
    top = Top.from_constants(constants, dipole_abc_debye=dipole)
    options = {"temperature_k": 20.0, "jmax": 14, "q": Q, "sort": False}
    lines = line_list(top, min_lgint=None, **options)
    for least in (-11.0, -7.0):
        computed = line_list(top, min_lgint=least, **options)
        expected = lines[lines.lgint >= least]
        assert 0 < len(computed) < len(lines)
        assert_equal(computed, expected, sum(mu * mu for mu in dipole))


@pytest.mark.parametrize("weights", [{"ee": 1, "eo": 3, "oe": 3, "oo": 1}, {"ee": 1, "eo": 0, "oe": 0, "oo": 1}])
def test_blocks_that_do_not_exist_and_a_range(weights):
    top = Top.from_constants(TOPS["prolate, Ir"], dipole_abc_debye=(0, 1.9, 0), spin_weights=weights)
    options = {"temperature_k": 20.0, "jmax": 20, "q": Q}
    lines = line_list(top, min_lgint=None, **options)
    inside = (lines.frequency_mhz >= 2e4) & (lines.frequency_mhz <= 1.1e5)
    computed = line_list(top, min_lgint=-5.0, range_mhz=(2e4, 1.1e5), **options)
    assert 50 < len(computed) < inside.sum()
    assert_equal(computed, lines[inside & (lines.lgint >= -5.0)], 1.9**2)


def test_every_pair_of_blocks_is_there_once_with_its_elements():
    """All elements between stacked blocks, up to one sign for a pair, are those of each pair by itself."""
    levels = solve_levels(Top.from_constants(TOPS["prolate, Ir"]), 7)
    dipole = body_tensor((1.2, 1.9, 0.4), 1, "Ir")
    vector, computed = Vector(dipole, 7), {}
    by_start = {block.start: block for block in levels.blocks}
    sectors = {(block.basis.j, (block.basis.first_k % 2, block.basis.sign)): block for block in levels.blocks}
    for js in (range(-1, 1), range(5), range(4, 8)):  # runs of J, each with the J below
        stacks = stacked(sectors, js)
        ups, below = ({p: stack.selected(part) for p, stack in stacks.items()} for part in (slice(1, None), slice(-1)))
        for lows in (below, ups):
            for parity, (sign, product) in ((p, item) for p in ups for item in vector.products(ups[p], lows)):
                upper = ups[parity].rows[:, ups[parity].sign_slice(sign)]
                for up_rows, low_rows, moved, low in zip(upper, product.rows, product.moved, product.low, strict=True):
                    there = np.ix_(up_rows >= 0, low_rows >= 0)
                    elements = moved.T @ low
                    if elements[there].size:
                        pair = frozenset((up_rows[0], low_rows[0]))
                        assert pair not in computed
                        computed[pair] = by_start[up_rows[0]], by_start[low_rows[0]], elements[there]
                    elements[there] = 0.0
                    assert not elements.any()  # padding
    expected = {frozenset((up.start, low.start)) for up, low in connected_wang_blocks(levels.blocks, dipole)}
    assert set(computed) == expected
    for up, low, elements in computed.values():
        alone = wang_amplitudes(up, low, dipole)
        sign = np.sign(np.sum(alone * elements))
        assert np.abs(alone - sign * elements).max() < 1e-14  # round-off of sums of some ten terms below 10


def test_cold_levels_alone_are_multiplied(monkeypatch):
    """At 2 K few states of a block reach the cut: the others are not in the products, and no line is missing."""
    top = Top.from_constants(TOPS["prolate, Ir"], dipole_abc_debye=(1.2, 1.9, 0.4))
    sizes, plain = [], np.matmul

    def counting(a, b, out):
        sizes.append(out.size)
        return plain(a, b, out=out)

    monkeypatch.setattr(strong_lines.np, "matmul", counting)
    lines = line_list(top, temperature_k=2.0, jmax=45, q=20.0, min_lgint=-9.0)
    monkeypatch.undo()
    value = line_list(top, temperature_k=2.0, jmax=45, q=20.0, min_lgint=None)
    assert sum(sizes) < 0.3 * len(value)  # with the padding of blocks of several J
    assert_equal(lines, value[value.lgint >= -9.0], 1.2**2 + 1.9**2 + 0.4**2)


def test_a_line_just_above_the_cut_is_not_lost_to_the_bounds():
    """At 0.1 K the photon factor of 000 - 110 is 0.997, and its frequency the highest between its blocks: both bounds are met."""
    top = Top.from_constants(TOPS["prolate, Ir"], dipole_abc_debye=(0, 0, 1.2))
    options = {"temperature_k": 0.1, "jmax": 1, "q": 1.0}
    lines = line_list(top, min_lgint=-5.0, **options)
    (from_ground,) = np.flatnonzero(lines.levels.quanta["j"][lines.lower] == 0)
    assert lines.frequency_mhz[from_ground] == pytest.approx(8572 + 3640, rel=1e-12)  # A + B
    least = float(lines.lgint[from_ground])
    just_below, just_above = (len(line_list(top, min_lgint=least + d, **options)) for d in (-1e-6, 1e-6))
    assert just_below == just_above + 1


def test_limited_blocks_take_the_way_of_single_pairs():
    levels = solve_levels(Top.from_constants(TOPS["prolate, Ir"]), 6)
    assert are_whole(levels.blocks)
    last = levels.blocks[-1]
    cut_off = last.basis._replace(first_k=last.basis.first_k + 2, size=last.basis.size - 1)
    assert not are_whole(
        [*levels.blocks[:-1], dataclasses.replace(last, parts=(last.parts[0]._replace(basis=cut_off),))]
    )
    few = dataclasses.replace(last, vectors=last.vectors[:, :1], energies_mhz=last.energies_mhz[:1])
    assert not are_whole([few])


def test_the_least_that_a_line_needs_has_no_division_by_nothing():
    levels = solve_levels(Top.from_constants(TOPS["prolate, Ir"], spin_weights={"ee": 1, "eo": 0, "oe": 0, "oo": 1}), 3)
    partition = PartitionFunction.stated(20.0, Q)
    cut = intensity_cut(levels, partition, -9.0)
    assert np.isinf(cut.needed[levels.weight == 0]).all()
    assert (cut.needed[levels.weight > 0] * cut.population[levels.weight > 0]) == pytest.approx(1e-9, rel=1e-15)
    assert not intensity_cut(levels, partition, -400.0).needed.any()  # 10^-400 is 0: every line reaches it
