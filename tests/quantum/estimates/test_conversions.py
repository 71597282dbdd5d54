"""Conversions of reduction and representation: operator identities, levels that stay the same, the order claimed."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from slow_matrix import body_operators, term_matrix

from rotor.quantum import reductions as conversions
from rotor.quantum.estimates.budgets import level_errors
from rotor.quantum.reductions import to_reduction, to_representation
from rotor.quantum.solve import solve_levels
from rotor.tops.constants.constants import Constants
from rotor.tops.constants.covariance import Covariance
from rotor.tops.constants.operators import REPRESENTATIONS
from rotor.tops.top import Top

QUARTIC = {
    "A": {"DeltaJ": 0.1, "DeltaJK": -0.3, "DeltaK": 2.0, "deltaJ": 0.02, "deltaK": 0.5},
    "S": {"DJ": 0.1, "DJK": -0.3, "DK": 2.0, "d1": -0.02, "d2": -0.013},
}
JMAX = 8
SCALES = (0.02, 0.01, 0.005)  # of constants that are large, so that second order stands far above round-off


def top_of(reduction: str, representation: str, scale: float) -> Constants:
    values = {name: scale * value for name, value in QUARTIC[reduction].items()}
    return Constants(A=9000.0, B=5500.0, C=3000.0, reduction=reduction, representation=representation, **values)


def energies(constants: Constants) -> np.ndarray:
    levels = solve_levels(Top(constants), JMAX)
    return levels.energy_mhz[np.lexsort((levels.quanta["kc"], levels.quanta["ka"], levels.quanta["j"]))]


def differences(old: Constants, new: Constants) -> tuple[float, float]:
    """The largest change of a level by the conversion, and by writing the old quartic constants off altogether."""
    quartic = energies(old) - energies(Constants(A=old["A"], B=old["B"], C=old["C"]))
    return np.abs(energies(new) - energies(old)).max(), np.abs(quartic).max()


def slope(convert) -> float:
    """Order in the quartic constants of what a conversion changes, from scales 1, 1/2, 1/4 of a fiftieth."""
    changes = []
    for scale in SCALES:
        change, quartic = differences(*convert(scale))
        assert change < 0.1 * scale * quartic  # it does convert: what is left is small beside the distortion
        changes.append(change)
    return float(np.polyfit(np.log(SCALES), np.log(changes), 1)[0])


@pytest.mark.parametrize("representation", REPRESENTATIONS)
@pytest.mark.parametrize(("old", "new"), [("A", "S"), ("S", "A")])
def test_levels_change_in_second_order_between_reductions(old, new, representation):
    def convert(scale):
        before = top_of(old, representation, scale)
        return before, to_reduction(before, new).constants

    assert slope(convert) == pytest.approx(2, abs=0.05)  # third order still shows


@pytest.mark.parametrize("reduction", ["A", "S"])
@pytest.mark.parametrize(("old", "new"), list(itertools.permutations(("Ir", "IIr", "IIIr", "IIIl"), 2)))
def test_levels_change_in_second_order_between_representations(old, new, reduction):
    def convert(scale):
        before = top_of(reduction, old, scale)
        return before, to_representation(before, new).constants

    if {old, new} == {"IIIr", "IIIl"}:  # x and y exchanged: exact
        before, after = convert(1.0)
        assert np.allclose(energies(before), energies(after), rtol=1e-13, atol=1e-8)
        return
    assert slope(convert) == pytest.approx(2, abs=0.05)


def test_left_handed_axes_change_signs_alone():
    """IIIr and IIIl: d1 of S changes its sign, δJ and δK of A do (hard case 5)."""
    for reduction, flipped in (("S", ("d1",)), ("A", ("deltaJ", "deltaK"))):
        before = top_of(reduction, "IIIr", 1.0)
        after = to_representation(before, "IIIl").constants
        for name, value in before.values.items():
            assert after[name] == pytest.approx(-value if name in flipped else value, rel=1e-12)


def test_published_relations():
    """d2 = -δK/4σ, DJ = ΔJ + 2 d2, DJK = ΔJK - 12 d2, DK = ΔK + 10 d2, d1 = -δJ (Watson 1977)."""
    before = top_of("A", "Ir", 1.0)
    after = to_reduction(before, "S").constants
    sigma = (2 * 9000.0 - 5500.0 - 3000.0) / (5500.0 - 3000.0)
    d2 = -0.5 / (4 * sigma)
    expected = {"d2": d2, "DJ": 0.1 + 2 * d2, "DJK": -0.3 - 12 * d2, "DK": 2.0 + 10 * d2, "d1": -0.02}
    expected |= {"A": 9000.0 - 10 * d2, "B": 5500.0 + 4 * d2 - 1.0, "C": 3000.0 + 4 * d2 + 1.0}
    assert dict(after.values) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("j", [2, 3, 7])
def test_cartesian_forms_are_identities(j):
    """Each term (p, q, n) is the stated sum of Jα⁴, JαJα JβJβ + JβJβ JαJα and Jα², as matrices."""
    squares = [component @ component for component in body_operators(j)[:3]]
    both = [squares[i] @ squares[k] + squares[k] @ squares[i] for i, k in ((0, 1), (1, 2), (2, 0))]
    cartesian = [*(s @ s for s in squares), *both, *squares]
    for column, powers in enumerate(conversions._TERMS):
        total = sum(c * matrix for c, matrix in zip(conversions._CARTESIAN[:, column], cartesian, strict=True))
        assert np.allclose(total, term_matrix(*powers, j), atol=1e-12 * j**4)


@pytest.mark.parametrize("j", [2, 3, 7])
def test_the_commutator_is_as_stated(j):
    """s [H_rigid, S] with S = {Jz, J₊² - J₋²}, J₊ being what raises K, as matrices."""
    _, _, jz, plus, minus = body_operators(j)
    k = np.diag(jz).real
    raising = plus if (k @ np.abs(plus) - np.abs(plus) @ k).sum() > 0 else minus
    step = raising @ raising
    generator = jz @ (step - step.conj().T) + (step - step.conj().T) @ jz
    rigid = {(1, 0, 0): 4.0, (0, 1, 0): 5.0, (0, 0, 1): 0.5}
    h = sum(c * term_matrix(*powers, j) for powers, c in rigid.items())
    change = conversions._turned(rigid | dict.fromkeys(conversions._TERMS[:6], 0.0), 1.0)
    stated = sum((c - rigid.get(powers, 0.0)) * term_matrix(*powers, j) for powers, c in change.items())
    assert np.allclose(h @ generator - generator @ h, stated, atol=1e-11 * j**5)


def test_there_and_back():
    before = top_of("A", "Ir", 0.01)
    back = to_reduction(to_reduction(before, "S").constants, "A").constants
    assert dict(back.values) == pytest.approx(dict(before.values), rel=1e-5)  # second order: 0.005/9000 of δK


def test_rigid_tops_change_their_axes_alone():
    done = to_representation(Constants(A=9.0, B=5.0, C=3.0, uncertainties={"A": 0.1}), "IIIl")
    assert done.constants.rigid == (9.0, 5.0, 3.0)
    assert done.constants.representation == "IIIl"
    assert done.constants.uncertainties == {"A": 0.1}
    assert done.s111 == 0.0


def test_nothing_is_silent():
    before = top_of("A", "Ir", 1.0).replace(sources={"A": "a paper"})
    done = to_reduction(before, "S")
    assert "A in Ir to S in Ir" in done.note
    assert done.constants.sources["A"].endswith("a paper")
    assert all("first order" in source for source in done.constants.sources.values())
    assert done.s111 == pytest.approx(0.5 / (2 * 9000.0 - 5500.0 - 3000.0))
    assert done.covariance is None


def test_uncertainties_go_along():
    """σ(DJ) from DJ = ΔJ + 2d2, d2 = -δK/4σ: of ΔJ and δK in quadrature; σ(d1) is that of δJ."""
    errors = {"DeltaJ": 1e-3, "deltaJ": 2e-4, "deltaK": 5e-3}
    done = to_reduction(top_of("A", "Ir", 1.0).replace(uncertainties=errors), "S")
    sigma = (2 * 9000.0 - 5500.0 - 3000.0) / (5500.0 - 3000.0)
    assert done.constants.uncertainties["d1"] == pytest.approx(2e-4, rel=1e-6)
    assert done.constants.uncertainties["d2"] == pytest.approx(5e-3 / (4 * sigma), rel=1e-6)
    assert done.constants.uncertainties["DJ"] == pytest.approx(np.hypot(1e-3, 5e-3 / (2 * sigma)), rel=1e-6)


def test_errors_of_levels_survive_a_conversion():
    """The covariance carried over gives the same errors of levels, to the order of the distortion."""
    rng = np.random.default_rng(3)
    before = top_of("A", "Ir", 0.02)
    names = tuple(before.values)
    root = rng.normal(size=(8, 8)) + 2 * np.eye(8)
    root /= np.linalg.norm(root, axis=1)[:, None]
    old = Covariance.from_correlations(names, [0.02, 0.01, 0.01, *[1e-5] * 5], root @ root.T)
    done = to_representation(before, "IIIl", old)
    errors = []
    for constants, covariance in ((before, old), (done.constants, done.covariance)):
        levels = solve_levels(Top(constants), JMAX)
        errors.append(
            level_errors(Top(constants), levels, covariance)[
                np.lexsort((levels.quanta["kc"], levels.quanta["ka"], levels.quanta["j"]))
            ]
        )
    assert np.allclose(errors[0], errors[1], rtol=1e-3)  # distortion over rotational constants at J = 8


def test_equal_constants_and_zeros_convert():
    """B = C exactly in Ir: no turn to S takes away what is not there, and a constant of zero has an uncertainty too."""
    before = Constants(
        A=9000.0, B=5000.0, C=5000.0, kind="asymmetric", DJ=0.1, d1=0.0, uncertainties={"B": 0.1, "d1": 1e-3}
    )
    done = to_reduction(before, "S")
    assert done.constants.get("d2") == 0.0
    assert done.constants.uncertainties["d1"] == pytest.approx(1e-3)


@pytest.mark.parametrize(
    ("convert", "says"),
    [
        (lambda: to_reduction(Constants(B=5.0), "S"), "neither reduction"),
        (lambda: to_reduction(top_of("A", "Ir", 1.0), "B"), "'A' and 'S'"),
        (lambda: to_representation(top_of("A", "Ir", 1.0), "IV"), "known are Ir"),
        (lambda: to_reduction(top_of("A", "Ir", 1.0).replace(PhiK=1e-3), "S"), "PhiK"),
        (lambda: to_reduction(top_of("S", "Ir", 1.0).replace(terms={(0, 1, 1): 1.0}), "A"), "Jz2Jpm2"),
        (lambda: to_reduction(Constants(A=9.0, B=5.0, C=5.0, kind="asymmetric", d2=1e-3), "A"), "Bx = By"),
    ],
)
def test_what_cannot_be_converted(convert, says):
    with pytest.raises(ValueError, match=says):
        convert()
