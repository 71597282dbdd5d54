"""Named constants: what they are inferred to be, what is refused, and that text loses nothing."""

from __future__ import annotations

import copy
import pickle

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rotor.tops.constants.constants import Constants
from rotor.tops.constants.kind_of_constants import A_REDUCTION, S_REDUCTION, ray_kappa, vocabulary
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.states.state_constants import StateConstants
from rotor.tops.states.state_texts import parse_weights
from rotor.tops.top import Top
from rotor.units import MHZ_PER_CM


@pytest.mark.parametrize(
    ("values", "kind"),
    [
        ({"B": 3}, "linear"),
        ({"A": 5, "B": 3}, "prolate"),
        ({"B": 5, "C": 3}, "oblate"),
        ({"A": 5, "B": 4, "C": 3}, "asymmetric"),
        ({"A": 5, "B": 3, "C": 3}, "prolate"),
        ({"A": 5, "B": 5, "C": 3}, "oblate"),
        ({"A": 5, "B": 5, "C": 5}, "spherical"),
        ({"A": 5, "B": 5 * (1 - 1e-15), "C": 3}, "asymmetric"),
    ],
)
def test_kind_follows_the_names_and_exact_equality(values, kind):
    assert Constants(**values).kind == kind


def test_given_kind_wins_when_it_fits():
    assert Constants(B=3, kind="spherical").rigid == (3, 3, 3)
    assert Constants(A=5, B=3, C=3, kind="asymmetric", d1=1e-3).kind == "asymmetric"
    with pytest.raises(ValueError, match="kind 'oblate' needs B and C"):
        Constants(A=5, B=4, C=3, kind="oblate")
    with pytest.raises(ValueError, match="a top is one of linear"):
        Constants(B=3, kind="round")


@pytest.mark.parametrize("text", [{"A": 5}, {"A": 5, "C": 3}, {"C": 3}, {"DJ": 1}])
def test_incomplete_constants_are_refused(text):
    with pytest.raises(ValueError, match="give B"):
        Constants(**text)


def test_reduction_is_told_by_the_names():
    rigid = {"A": 5, "B": 4, "C": 3}
    assert Constants(**rigid).reduction is None
    assert Constants(**rigid, DeltaJ=1e-6).reduction == "A"
    assert Constants(**rigid, DJ=1e-6).reduction == "S"
    assert Constants(**rigid, LJ=1e-9, reduction="A").reduction == "A"
    with pytest.raises(ValueError, match="both reductions"):
        Constants(**rigid, DJ=1e-6, DeltaK=1e-6)
    with pytest.raises(ValueError, match="belong to the S-reduction"):
        Constants(**rigid, DJ=1e-6, reduction="A")
    with pytest.raises(ValueError, match="fit both reductions"):
        Constants(**rigid, PK=1e-9)


def test_each_reduction_takes_its_whole_vocabulary():
    rigid = {"A": 5.0, "B": 4.0, "C": 3.0}
    for reduction, names in (("A", A_REDUCTION), ("S", S_REDUCTION)):
        constants = Constants(**rigid, **dict.fromkeys(names, 1e-9))
        assert (constants.reduction, tuple(constants.values)) == (reduction, vocabulary("asymmetric", reduction))


def test_representation_follows_kappa():
    assert Constants(A=5, B=4, C=3).representation == "Ir"  # kappa = 0
    assert Constants(A=5, B=4.1, C=3).representation == "IIIl"
    assert Constants(A=5, B=4.1, C=3, representation="Ir").representation == "Ir"
    assert Constants(A=5, B=3).representation is None
    with pytest.raises(ValueError, match="belongs to asymmetric tops"):
        Constants(B=3, representation="Ir")


def test_kappa_is_minus_one_and_one_in_the_limits():
    assert ray_kappa(3, 1, 1) == -1
    assert ray_kappa(3, 3, 1) == 1
    assert ray_kappa(float("inf"), 2, 2) == -1
    with pytest.raises(ValueError, match="A >= B >= C and A > C"):
        ray_kappa(2, 2, 2)


def test_greek_and_underscores_are_read():
    constants = Constants.parse("A=5 B=4 C=3 Δ_J=0.1 δK=0.2 Φ_KJ=0.3 ϕJ=0.4")
    assert list(constants.values)[3:] == ["DeltaJ", "deltaK", "PhiKJ", "phiJ"]
    assert constants["ΔJ"] == constants.get("Delta_J") == 0.1
    assert Constants.parse("B=4 D_J=0.1")["D"] == Constants.parse("B=4 D=0.1")["DJ"] == 0.1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a=5 b=4 c=3", "did you mean A"),
        ("A=5 B=4 C=3 DeltaL=1", "did you mean Delta"),
        ("A=5 B=4 DeltaJ=1", "use DJ"),
        ("A=5 B=5 C=4 deltaJ=1", "say kind='asymmetric'"),
        ("B=5 DK=1", "use D"),
        ("A=3 B=4 C=5", "A >= B >= C"),
        ("A=3 B=4", "A >= B"),
        ("B=-1", "is positive"),
        ("B=0", "is positive"),
        ("B=1e999", "not a finite number"),
        ("A=5 B=4 C=3GHz", "belongs to C only"),
        ("B=3 furlong", "not a known unit"),
        ("B=3 kV/cm", "does not measure the same thing"),
        ("B=3 B=4", "given twice"),
        ("B=3 D=1 DJ=1", "given twice"),
        ("B=3 = 4", "cannot read"),
        ("B=3(1", "cannot read"),
        ("", "no constant in it"),
    ],
)
def test_mistakes_are_told(text, message):
    with pytest.raises(ValueError, match=message):
        Constants.parse(text)


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), None, "nonsense"])
def test_values_must_be_finite_numbers(bad):
    with pytest.raises(ValueError, match=r"^D = "):
        Constants(B=3, D=bad)


def test_uncertainties_and_sources_belong_to_a_constant():
    constants = Constants(B=3, D=1, uncertainties={"DJ": 0.1}, sources={"B": "memory"})
    assert (dict(constants.uncertainties), dict(constants.sources)) == ({"D": 0.1}, {"B": "memory"})
    with pytest.raises(ValueError, match="uncertainties of H"):
        Constants(B=3, uncertainties={"H": 0.1})
    with pytest.raises(ValueError, match="0 or more"):
        Constants(B=3, uncertainties={"B": -0.1})


def test_units_of_one_item_and_of_all():
    assert dict(Constants.parse("B=9.2GHz DJ=3.8kHz").values) == {"B": 9200.0, "D": 0.0038}
    assert dict(Constants.parse("B = 9.2 GHz, D = 3.8 kHz").values) == {"B": 9200.0, "D": 0.0038}
    assert dict(Constants.parse("A=5;B=4;C=3 GHz").values) == {"A": 5000.0, "B": 4000.0, "C": 3000.0}
    assert dict(Constants.parse("A=5.17 B=0.25 cm-1").values) == {"A": 5.17 * MHZ_PER_CM, "B": 0.25 * MHZ_PER_CM}
    assert Constants.parse("B=3 D=−1.5D-3").values["D"] == -0.0015  # a unicode minus, a Fortran exponent


def test_brackets_are_the_last_digits():
    constants = Constants.parse("A=835840.288(12) B=4353(2) C=3.80(12)e3 MHz", kind="asymmetric")
    assert dict(constants.uncertainties) == {"A": 0.012, "B": 2.0, "C": 120.0}
    assert constants.text() == "A=835840.288(12) B=4353.0(20) C=3800.0(1200) MHz"


def test_immutable_picklable_and_compared_by_content():
    constants = Constants.parse("A=5 B=4 C=3(1) ΔJ=0.1")
    with pytest.raises(AttributeError):
        constants.kind = "linear"
    with pytest.raises(TypeError):
        constants.values["A"] = 6.0
    assert pickle.loads(pickle.dumps(constants)) == constants == copy.deepcopy(constants)
    assert constants != constants.replace(A=6.0)


def test_replace_keeps_what_is_not_changed():
    constants = Constants.parse("A=5 B=4 C=3(1) ΔJ=0.1(2)")
    changed = constants.replace(C=4.0, ΔJ=None)
    assert (changed.kind, changed.reduction) == ("asymmetric", "A")
    assert (dict(changed.values), dict(changed.uncertainties)) == ({"A": 5, "B": 4, "C": 4}, {})
    assert constants.replace(C=4.0, DeltaJ=None, kind=None, reduction=None, representation=None).kind == "prolate"


reasonable = st.floats(1e-30, 1e30) | st.floats(-1e30, -1e-30) | st.just(0.0)
spreads = st.none() | st.floats(0.0, 1e30)


@given(
    b=st.floats(1e-3, 1e9),
    distortion=st.dictionaries(st.sampled_from(["D", "H", "L"]), st.tuples(reasonable, spreads)),
    unit=st.sampled_from(["Hz", "kHz", "MHz", "GHz", "cm-1", "K"]),
)
def test_text_reads_back_exactly(b, distortion, unit):
    constants = Constants(
        B=b,
        **{name: value for name, (value, _) in distortion.items()},
        uncertainties={name: spread for name, (_, spread) in distortion.items() if spread is not None},
    )
    assert Constants.parse(constants.text(unit)) == constants  # exact: digits are added until both floats come back


@pytest.mark.parametrize(
    ("parse", "text", "name"),
    [
        (Constants.parse, "A=9 B=6 A=8 C=5 GHz", "A"),
        (StateConstants.parse, "E[1]=100 E[1]=200 MHz", r"E\[1\]"),
        (SpinConstants.parse, "chi_aa(14N)=-4 chi_aa(14N)=-3 MHz", r"chi_aa\(14N\)"),
        (
            lambda text: parse_weights(text, Top.from_constants("A=9 B=6 C=5 GHz")),
            "[1] even=3,odd=1 [1] even=1,odd=3",
            "state 1",
        ),
    ],
)
def test_a_constant_that_is_given_twice_is_refused(parse, text, name):
    with pytest.raises(ValueError, match=f"{name} is given twice; leave one out"):
        parse(text)
