"""3j, 6j and 9j symbols: SymPy's exact values, orthogonality to J = 1000, symmetries, sum rules, bad arguments."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import qutip
from hypothesis import given, settings
from hypothesis import strategies as st
from places import ORACLES

from rotor.quantum.operators import wigner
from rotor.quantum.operators.wigner import nine_j, six_j, three_j

ROUND_OFF = 3e-15  # some twenty correctly rounded factors


def halves(*doubled: int) -> list[float]:
    return [number / 2 for number in doubled]


@st.composite
def three_j_arguments(draw, top: int = 60):
    """j1 j2 j3 m1 m2 m3 of a symbol that exists."""
    a, b = draw(st.integers(0, top)), draw(st.integers(0, top))
    c = draw(st.sampled_from(range(abs(a - b), a + b + 1, 2)))
    p = draw(st.sampled_from(range(-a, a + 1, 2)))
    inside = [q for q in range(-b, b + 1, 2) if abs(p + q) <= c]
    if not inside:
        p, inside = 0 if a % 2 == 0 else 1, [q for q in range(-b, b + 1, 2) if abs((0 if a % 2 == 0 else 1) + q) <= c]
    q = draw(st.sampled_from(inside))
    return halves(a, b, c, p, q, -p - q)


@st.composite
def six_j_arguments(draw, top: int = 40):
    """j1 j2 j3 l1 l2 l3 of a symbol that exists: l3 with (j1 j2 j3), then l1 and l2 that make all four triangles."""
    a, b, f = (draw(st.integers(0, top)) for _ in range(3))
    c = draw(st.sampled_from(range(abs(a - b), a + b + 1, 2)))
    e = draw(st.sampled_from(range(abs(a - f), a + f + 1, 2)))
    least, most = max(abs(b - f), abs(c - e)), min(b + f, c + e)  # not empty: all couplings of a, b, f, e
    return halves(a, b, c, draw(st.sampled_from(range(least, most + 1, 2))), e, f)


# Against exact values of others


def sympy_values() -> list[tuple[str, list[float], float]]:
    """Kind, arguments and value of every line of the file."""
    path = ORACLES / "wigner_sympy.txt"
    rows = [line.replace(":", " ").replace("=", " ").split() for line in path.read_text("utf-8").splitlines()[1:]]
    return [(kind, [float(x) for x in numbers[:-1]], float(numbers[-1])) for kind, *numbers in rows]


@pytest.mark.parametrize(("kind", "arguments", "value"), sympy_values())
def test_symbols_are_sympy_s(kind, arguments, value):
    """Exact sums of another program, to J = 1000."""
    if kind == "9j":
        assert float(nine_j(np.reshape(arguments, (3, 3)))) == pytest.approx(value, rel=1e-13)  # a sum of products
    else:
        assert float({"3j": three_j, "6j": six_j}[kind](*arguments)) == pytest.approx(value, rel=ROUND_OFF, abs=0)


@given(arguments=three_j_arguments(top=24))
@settings(max_examples=100)
def test_three_j_is_qutip_s(arguments):
    j1, j2, j3, m1, m2, m3 = arguments
    slow = (-1) ** round(j1 - j2 - m3) / math.sqrt(2 * j3 + 1) * qutip.clebsch(j1, j2, j3, m1, m2, -m3)  # DLMF 34.1.1
    assert float(three_j(*arguments)) == pytest.approx(slow, abs=1e-8)  # QuTiP's sum alternates in sign


def test_symbols_have_values_of_racahs_sum():
    """(1 1 2; 0 0 0)² = 2/15, {1 1 1; 1 1 1} = 1/6, {1 1 2; 1 1 2} = 1/30, all from Racah's sum by hand."""
    assert three_j(1, 1, 2, 0, 0, 0) == pytest.approx(math.sqrt(2 / 15), rel=ROUND_OFF)
    assert three_j(0.5, 0.5, 0, 0.5, -0.5, 0) == pytest.approx(math.sqrt(0.5), rel=ROUND_OFF)
    assert six_j(1, 1, 1, 1, 1, 1) == pytest.approx(1 / 6, rel=ROUND_OFF)
    assert six_j(1, 1, 2, 1, 1, 2) == pytest.approx(1 / 30, rel=ROUND_OFF)


def test_symbols_that_cancel_are_exactly_zero():
    assert three_j(1, 1, 1, 0, 0, 0) == 0  # odd sum of j
    assert three_j(3, 2, 2, 2, 0, -2) == -three_j(3, 2, 2, -2, 0, 2)
    assert three_j(3, 3, 2, 2, -2, 0) == 0  # 3 m² = j(j+1), by accident
    assert six_j(2, 2, 2, 1.5, 1.5, 1.5) == 0  # by accident


# Algebra


@pytest.mark.parametrize(("rank", "rise"), [(1, 0), (1, 1), (2, -1), (2, 0), (2, 2), (4, 3), (6, 0)])
def test_three_j_over_k_add_up_at_1000(rank, rise):
    """Σ_{m1} (j1 j2 j3; m1 m2 m3)² = 1/(2 j2 + 1), for every m2."""
    j, m = 1000, np.arange(-1000, 1001)[:, None]
    q = np.arange(-rank, rank + 1)
    beyond = np.abs(m + q) > j + rise
    symbols = three_j(j, rank, j + rise, m, q, -m - q)
    assert (symbols[beyond] == 0).all()
    assert np.sum(symbols**2, axis=0) * (2 * rank + 1) == pytest.approx(np.ones(len(q)), rel=1e-14)  # 2001 terms


def test_six_j_are_orthogonal_at_1000():
    """Σ_x (2x+1)(2f+1) {a b x; c d f} {c d x; a b g} = δ_fg for two pairs of a large and a small number."""
    a, b, c, d = 1000.0, 3.0, 1001.5, 2.5
    x = np.arange(997.0, 1005.0)
    f = np.arange(998.5, 1003.5)
    symbol = six_j(a, b, x, c, d, f[:, None])
    gram = (symbol * (2 * x + 1)) @ six_j(c, d, x, a, b, f[:, None]).T * np.sqrt(np.outer(2 * f + 1, 2 * f + 1))
    exists = np.abs(np.diag(gram)) > 0.5
    assert exists.sum() >= 4
    assert np.allclose(gram[np.ix_(exists, exists)], np.eye(exists.sum()), atol=1e-13)  # six products


@given(arguments=three_j_arguments(), order=st.permutations(range(3)))
@settings(max_examples=60)
def test_columns_of_three_j_change_places(arguments, order):
    columns = np.reshape(arguments, (2, 3))
    odd = list(order) in ([0, 2, 1], [1, 0, 2], [2, 1, 0])
    sign = (-1) ** round(sum(arguments[:3])) if odd else 1
    moved = columns[:, order].ravel()
    assert three_j(*moved) == pytest.approx(sign * three_j(*arguments), rel=2 * ROUND_OFF, abs=0)
    flipped = three_j(*arguments[:3], *(-m for m in arguments[3:]))
    assert flipped == pytest.approx((-1) ** round(sum(arguments[:3])) * three_j(*arguments), rel=2 * ROUND_OFF, abs=0)


@given(arguments=six_j_arguments(), order=st.permutations(range(3)))
@settings(max_examples=60)
def test_symmetries_of_six_j(arguments, order):
    """Columns change places, two columns turn upside down, and Regge's first symmetry (DLMF 34.5.9)."""
    upper, lower = np.reshape(arguments, (2, 3))
    value = pytest.approx(six_j(*arguments), rel=2 * ROUND_OFF, abs=0)
    assert six_j(*upper[list(order)], *lower[list(order)]) == value
    assert six_j(lower[0], lower[1], upper[2], upper[0], upper[1], lower[2]) == value
    s = (upper[1] + lower[1] + upper[2] + lower[2]) / 2
    assert six_j(upper[0], s - upper[1], s - upper[2], lower[0], s - lower[1], s - lower[2]) == value


@pytest.mark.parametrize("j", [(2, 1.5, 1.5, 2.5, 1, 1), (3, 2, 2, 1, 3, 2), (1.5, 1, 0.5, 1, 1.5, 2)])
def test_six_j_is_its_sum_of_three_j(j):
    """The definition (DLMF 34.4.1), over all m."""
    j1, j2, j3, l1, l2, l3 = j
    total = 0.0
    for n1, n2, n3 in itertools.product(*(np.arange(-x, x + 1) for x in (l1, l2, l3))):
        m1, m2, m3 = n3 - n2, n1 - n3, n2 - n1
        if abs(m1) > j1 or abs(m2) > j2 or abs(m3) > j3:
            continue
        product = three_j(j1, j2, j3, m1, m2, m3) * three_j(j1, l2, l3, m1, n2, -n3)
        product *= three_j(l1, j2, l3, -n1, m2, n3) * three_j(l1, l2, j3, n1, -n2, m3)
        total += (-1) ** round(l1 + n1 + l2 + n2 + l3 + n3) * float(product)
    assert abs(six_j(*j)) > 1e-3
    assert total == pytest.approx(float(six_j(*j)), abs=1e-14)  # some hundred terms below 0.1


def test_nine_j_are_orthogonal():
    """Σ_{c f} (2c+1)(2f+1)(2g+1)(2h+1) {a b c; d e f; g h i} {a b c; d e f; g' h' i} = δ δ."""
    a, b, d, e, i = 1.0, 0.5, 1.5, 1.0, 2.0
    pairs = [(g, h) for g in (0.5, 1.5, 2.5) for h in (0.5, 1.5)]
    coupled = [(c, f) for c in (0.5, 1.5) for f in (0.5, 1.5, 2.5)]
    rows = [[[[a, b, c], [d, e, f], [g, h, i]] for c, f in coupled] for g, h in pairs]
    norm = [[math.sqrt((2 * c + 1) * (2 * f + 1) * (2 * g + 1) * (2 * h + 1)) for c, f in coupled] for g, h in pairs]
    gram = nine_j(rows) * norm
    gram = gram @ gram.T
    exists = [g + h >= i and abs(g - h) <= i for g, h in pairs]
    assert np.allclose(gram, np.diag(np.array(exists, float)), atol=1e-14)  # some ten terms


# Routes and arguments


def test_floating_point_and_integers_agree(monkeypatch):
    j = np.arange(0, 30)
    arguments = (j + 2, 3, j + 1, np.minimum(j, 2), -1, 1 - np.minimum(j, 2))
    fast = three_j(*arguments)
    fast_six = six_j(j + 2, 3, j + 1, 2.5, j + 1.5, 2.5)
    monkeypatch.setattr(wigner, "CANCELLATION", 0.0)
    assert np.allclose(three_j(*arguments), fast, rtol=1e-13, atol=0)  # what a cancellation of 32 may cost
    assert np.allclose(six_j(j + 2, 3, j + 1, 2.5, j + 1.5, 2.5), fast_six, rtol=1e-13, atol=0)
    assert np.count_nonzero(fast) > 25
    assert np.count_nonzero(fast_six) > 25


def test_rules_that_are_broken_give_zero():
    assert three_j(1, 1, 3, 0, 0, 0) == 0
    assert three_j(1, 1, 1, 1, 1, -1) == 0
    assert three_j(1, 1, 1, 2, -1, -1) == 0
    assert six_j(1, 1, 3, 1, 1, 1) == 0
    assert six_j(0.5, 1, 1, 1, 1, 1) == 0  # a triangle with a half-integer sum
    assert three_j([], 1, 1, 0, 0, 0).shape == (0,)


def test_shapes_broadcast():
    assert three_j(1, 1, [[2], [1]], 0, [0, 1, -1], [0, -1, 1]).shape == (2, 3)
    assert six_j(1, 1, 1, 1, 1, np.ones((2, 1, 3))).shape == (2, 1, 3)
    assert nine_j(np.ones((4, 3, 3))).shape == (4,)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: three_j(1.3, 1, 1, 0, 0, 0), "1.3: angular momenta are multiples of 1/2"),
        (lambda: three_j(1, 1, 1, 0.5, -0.5, 0), "m is a half-integer where its j is one"),
        (lambda: three_j(-1, 1, 1, 0, 0, 0), "-1.0: an angular momentum is 0 or more"),
        (lambda: six_j(1, 1, 1, 1, 1, -1), "-1.0: an angular momentum is 0 or more"),
        (lambda: three_j(math.nan, 1, 1, 0, 0, 0), "nan: angular momenta"),
        (lambda: nine_j([1, 2, 3]), r"rows \(..., 3, 3\), found the shape \(3,\)"),
    ],
)
def test_what_is_no_quantum_number_is_an_error(call, said):
    with pytest.raises(ValueError, match=said):
        call()
