"""The table of SPFIT's codes: every TYP once, symmetries against the operators themselves, and no number of TYP elsewhere."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from plain_elements import matrix_of_j

import rotor.formats.spcat
from rotor.formats.spcat.hamiltonian.code_table import TABLE, Kind, axis_product, split_code
from rotor.formats.spcat.hamiltonian.codes import AXES
from rotor.formats.spcat.hamiltonian.operators import code_operator
from rotor.quantum.operators.algebra import half_anticommutator
from rotor.quantum.operators.rotation import components
from rotor.quantum.wang.basis import character, wang_blocks

J = 6


def test_every_typ_stands_in_one_row():
    rows = [typ for row in TABLE for typ in range(row.first, row.last + 1)]
    assert rows == list(range(100))


def half_turn(representation: str, axis: str) -> np.ndarray:
    """C2 of one axis over |J k⟩: Σ |f⟩ character ⟨f| over all Wang functions f."""
    turn = np.zeros((2 * J + 1, 2 * J + 1))
    for block in wang_blocks(J, representation):
        for k in block.k.tolist():
            function = np.zeros(2 * J + 1)
            function[J - k] = block.sign
            function[J + k] = 1.0
            turn += character(block.species, axis) * np.outer(function, function) / (function @ function)
    return turn


@pytest.mark.parametrize("representation", ["Ir", "IIIl"])
@pytest.mark.parametrize("typ", [typ for typ in range(2, 80) if split_code(10_000 * typ).tensor.rank <= 2 * J])
def test_symmetries_are_those_of_the_operators(typ: int, representation: str):
    """Half turns about a, b, c, time reversal (with the factor i of an odd operator) and the change of K, by elements over |J k>."""
    digits, oblate = split_code(10_000 * typ), representation == "IIIl"
    symmetry, operator = digits.symmetry(oblate), code_operator(digits, AXES[representation])
    matrix = matrix_of_j(operator.alone, J)
    assert matrix.any()
    for axis in "abc":
        turn = half_turn(representation, axis)
        turned = turn @ matrix @ np.linalg.inv(turn)
        sign = 1.0 if symmetry.axis in ("", axis) else -1.0
        np.testing.assert_allclose(turned, sign * matrix, atol=1e-12 * max(abs(matrix).max(), 1.0))
    assert operator.odd == symmetry.odd
    k = np.arange(-J, J + 1)
    changes = {abs(int(step)) for step in (k[:, None] - k[None, :])[abs(matrix) > 1e-9]}
    if digits.kind is Kind.SQUARE:
        assert changes <= {0, 2}
    else:
        assert changes == {symmetry.delta_k}


@pytest.mark.parametrize(("typ", "axis"), [(20, "a"), (40, "b"), (60, "c")])
def test_the_codes_of_na_nb_nc_are_those_of_the_manual(typ: int, axis: str):
    """With the factor i between states; Na, Nb, Nc are TYP 20, 40, 60, and the products of the two other axes follow each."""
    of = components("Ir")
    first, second = (letter for letter in "abc" if letter != axis)
    for code, matrix in ((typ, 1j * of[axis]), (typ + 1, 2.0 * half_anticommutator(of[first], of[second]))):
        operator = code_operator(split_code(10_000 * code), AXES["Ir"])
        np.testing.assert_allclose(matrix_of_j(operator.alone, J), matrix_of_j(matrix, J), atol=1e-12)


def test_axes_multiply_as_half_turns_do():
    pairs = [("a", "b"), ("b", "c"), ("a", "c"), ("b", "b"), ("", "a")]
    assert [axis_product(*pair) for pair in pairs] == ["c", "a", "b", "", "a"]


def test_no_other_module_compares_numbers_of_typ():
    folder = Path(rotor.formats.spcat.__file__).parent
    wrong = re.compile(r"\bd(igits)?\.typ\s*([<>=!%/]|in [(r])|\d\s*<=?\s*d(igits)?\.typ")
    numbers = {path.name for path in folder.rglob("*.py") if wrong.search(path.read_text())}
    assert numbers <= {"series.py"}  # which compares TYP with the first of its row
    assert wrong.search("if 80 <= digits.typ < 90:")
