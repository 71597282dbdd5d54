"""Parameter codes: digits to operators, names to codes, spin weights, all against SPCAT's own levels."""

from math import gcd

import numpy as np
import pytest
from places import ORACLES

from rotor.formats.spcat import model
from rotor.formats.spcat.file_model import connected_groups
from rotor.formats.spcat.hamiltonian import codes
from rotor.formats.spcat.names.named_parameters import named_parameter_file
from rotor.formats.spcat.names.named_top import named_top
from rotor.formats.spcat.text.egy import read_egy
from rotor.formats.spcat.text.int_file import Dipole, IntensityFile, Request, read_int
from rotor.formats.spcat.text.par import Options, Parameter, ParameterFile, format_par, read_par
from rotor.quantum.effects.watson import centrifugal_operators, rigid_operators
from rotor.tops.constants.constants import Constants
from rotor.tops.constants.kind_of_constants import vocabulary
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.top import Top

SAMPLES = ORACLES / "spcat"
MHZ_PER_CM = 29979.2458
CASES = ("h2co", "h2o_octic", "pyridine_oblate_s", "ch3cn", "so2", "ocs")


def file_of(*parameters: tuple[int, float], options: Options | None = None) -> ParameterFile:
    file = read_par(b"t\n0\na 1 1 0 20\n")
    lines = tuple(Parameter(code, value) for code, value in parameters)
    return ParameterFile("t", file.header, (options or file.options[0],), lines)


# Digits


@pytest.mark.parametrize(
    ("code", "states", "fields"),
    [
        (100, 1, (0, 0, 0, 0, 0, 0, 0, 1, 0, 0)),
        (41199, 1, (0, 0, 0, 0, 0, 4, 1, 1, 9, 9)),
        (110010000, 1, (0, 0, 1, 1, 0, 1, 0, 0, 0, 0)),
        (600001, 2, (0, 0, 0, 0, 0, 60, 0, 0, 0, 1)),
        (6000000001, 200, (0, 0, 0, 0, 0, 60, 0, 0, 0, 1)),
        (1120010203, 12, (0, 0, 0, 1, 1, 20, 0, 1, 2, 3)),
    ],
)
def test_a_code_is_taken_apart_and_joined(code, states, fields):
    assert codes.split_code(code, states) == (*fields, states)
    assert codes.join_code(codes.Digits(*fields, states)) == code


def test_codes_that_are_none_are_refused():
    with pytest.raises(ValueError, match="digits"):
        codes.split_code(10**13)
    with pytest.raises(ValueError, match="KSQ = 10 does not fit 1 digit"):
        codes.term_code(0, 10, 0)


# Names


@pytest.mark.parametrize(
    ("kind", "reduction", "table"),
    [
        ("linear", None, codes.LINEAR),
        ("prolate", None, codes.SYMMETRIC),
        ("asymmetric", "A", codes.A_REDUCTION),
        ("asymmetric", "S", codes.S_REDUCTION),
    ],
)
def test_codes_and_signs_are_those_of_the_hamiltonian(kind, reduction, table):
    assert {name for factors in table.values() for name in factors} == set(vocabulary(kind, reduction)) - {
        "A",
        "B",
        "C",
    }
    rigid = {"linear": {"B": 2.0}, "prolate": {"A": 3.0, "B": 2.0}, "asymmetric": {"A": 3.0, "B": 2.0, "C": 1.0}}[kind]
    for code, ((name, sign),) in [(code, factors.items()) for code, factors in table.items()]:
        constants = Constants(**rigid, **{name: 1.0}, kind=kind, reduction=reduction)
        ((term, coefficient),) = centrifugal_operators(constants).items()
        assert (code, sign) == (codes.term_code(*term), coefficient)


@pytest.mark.parametrize(
    ("letter", "code", "reduction"), [("s", 41000, "A"), ("s", 2000, "S"), ("a", 50000, "S"), ("s", 40100, "S")]
)
def test_the_reduction_is_that_of_the_operators_before_that_of_the_letter(letter, code, reduction):
    """deltaK, 41000, is Watson's A-reduction alone; DeltaK and deltaJ, 2000 and 40100, are in both."""
    text = f"x\n4 1 1 0\n{letter} 1 1 0 99\n10000 9400.0 0\n20000 3100.0 0\n30000 2500.0 0\n{code} -1e-3 0\n"
    assert codes.file_constants(read_par(text.encode())).reduction == reduction


def test_signs_of_published_constants():
    a = codes.file_constants(read_par(SAMPLES / "h2o_octic.var"))
    assert (a["DeltaJ"], a["deltaJ"], a["PhiK"], a["LK"]) == (37.59422, 15.210402, 3.733028, -0.005)
    s = codes.file_constants(read_par(SAMPLES / "h2co.var"))
    assert (s["DJ"], s["d1"], s["HJ"]) == (7.031916984780129e-2, -1.043742519322449e-2, -1.476578679469996e-9)


# Levels from codes, by a slow route of its own: matrices of Nx, Ny, Nz in the whole basis of one N


def axis_matrices(j: int) -> dict[str, np.ndarray]:
    """Nz, N₊ = Nx + iNy and N₋ on |N K>, with the phases of body-fixed components."""
    k = np.arange(-j, j + 1)
    lower = np.diag(np.sqrt(j * (j + 1) - k[:-1] * (k[:-1] + 1.0)), 1)
    return {"z": np.diag(k.astype(float)), "+": lower, "-": lower.T}


def level_energies(file: ParameterFile, j: int) -> np.ndarray:
    """Eigenvalues in cm⁻¹ of the operators that the codes of a file name."""
    n = axis_matrices(j)
    x, y = (n["+"] + n["-"]) / 2, (n["+"] - n["-"]) / 2j
    x_is, y_is, z_is = ("b", "c", "a") if file.options[0].nvib > 0 else ("b", "a", "c")
    squares = {x_is: (x @ x).real, y_is: (y @ y).real, z_is: n["z"] @ n["z"]}
    power = np.linalg.matrix_power
    total = np.zeros((2 * j + 1, 2 * j + 1))
    for parameter in file.parameters:
        code = parameter.code // 100  # one state: the last two digits name it
        typ, ksq, nsq = code // 100, code // 10 % 10, code % 10
        kz = power(n["z"], 2 * ksq)
        if typ == 0:
            operator = kz
        else:
            operator = squares["abc"[typ - 1]] if typ < 4 else power(n["+"], 2 * typ - 6) + power(n["-"], 2 * typ - 6)
            operator = (kz @ operator + operator @ kz) / 2
        total += parameter.value * (j * (j + 1.0)) ** nsq * operator
    return np.linalg.eigvalsh(total) / MHZ_PER_CM


@pytest.mark.parametrize("case", [c for c in CASES if c not in ("so2", "ocs")])  # so2: half the levels have no weight
def test_levels_from_codes_are_those_of_the_program(case):
    file, levels = read_par(SAMPLES / f"{case}.var"), read_egy(SAMPLES / f"{case}_part.egy")
    for j in range(9):
        listed = np.sort(levels.energy_cm[levels.quanta[:, 0] == j])
        assert listed == pytest.approx(level_energies(file, j), abs=6e-7)  # half a unit of the last printed digit


@pytest.mark.parametrize("case", CASES)
def test_named_constants_say_the_same_hamiltonian_as_the_codes(case):
    file = read_par(SAMPLES / f"{case}.var")
    constants = codes.file_constants(file)
    operators = {**rigid_operators(constants)}
    for term, value in centrifugal_operators(constants).items():
        operators[term] = operators.get(term, 0.0) + value
    direct = {p.code: p.value for p in file.parameters}
    distortion = {codes.term_code(*term): v for term, v in operators.items() if sum(term) > 1 and term != (0, 0, 1)}
    assert distortion == {code: v for code, v in direct.items() if code not in (100, 1000, 10000, 20000, 30000)}


def test_mean_and_difference_codes_make_the_same_constants():
    a, b, c = 9.0, 4.0, 3.0
    direct = codes.file_constants(file_of((10000, a), (20000, b), (30000, c)))
    mean = codes.file_constants(file_of((100, (b + c) / 2), (1000, a - (b + c) / 2), (40000, (b - c) / 4)))
    assert direct == mean == Constants(A=a, B=b, C=c, representation="Ir")
    oblate = Options("a", nvib=-1, knmax=20)
    mean = codes.file_constants(
        file_of((199, (a + b) / 2), (1099, c - (a + b) / 2), (40099, (b - a) / 4), options=oblate)
    )
    assert mean == Constants(A=a, B=b, C=c, representation="IIIl")


def test_the_kind_of_top_follows_from_the_codes():
    assert codes.file_constants(file_of((100, 5.0), (1000, -2.0))).kind == "oblate"
    assert codes.file_constants(file_of((100, 5.0), (200, -1e-3))).kind == "spherical"
    assert codes.file_constants(read_par(SAMPLES / "ocs.var")).kind == "linear"


def test_errors_become_uncertainties_when_asked():
    file = read_par((SAMPLES / "h2co.var").read_bytes().replace(b"1.00000000E-037", b"2.5E-03"))
    assert codes.file_constants(file).uncertainties == {}
    assert set(codes.file_constants(file, errors=True).uncertainties.values()) == {2.5e-3}
    twice = file_of((100, 5.0), (1000, 1.0), (1000, 1.0))
    twice = ParameterFile(*[getattr(twice, n) for n in ("title", "header", "options")], tuple(
        Parameter(p.code, p.value, 0.5) for p in twice.parameters
    ))  # fmt: skip
    assert codes.file_constants(twice, errors=True).uncertainties == {"B": 0.5}


@pytest.mark.parametrize(
    ("file", "words"),
    [
        (read_par(SAMPLES / "csf.par"), "cannot be said by the named constants"),
        (file_of((110010000, 1.0)), "parameter 110010000: its operator cannot be said"),
        (file_of((210000, 1.0)), "parameter 210000: its operator cannot"),
        (file_of((800000, 1.0)), "parameter 800000: its operator"),
        (file_of((910000, 1.0)), "parameter 910000: its operator"),
        (file_of((10011, 1.0)), "parameter 10011: its operator"),
        (file_of((0, 1.0)), "parameter 0: its operator"),
        (file_of((10100, 1.0)), "parameter 10100: no constant"),
        (file_of((10000, 3.0), (20000, 2.0), (30000, 1.0), (41000, 1.0), (50000, 1.0)), "a mixture is read"),
        (file_of((100, 1.0), (1000, 1.0), options=Options("l", knmax=0)), "parameter 1000 does nothing"),
    ],
)
def test_what_is_not_computed_yet_is_refused_by_name(file, words):
    with pytest.raises(ValueError, match=words):
        codes.file_constants(file)


def test_terms_without_a_published_name_are_spelled_out():
    constants = codes.file_constants(read_par(SAMPLES / "h2s.par"))
    assert constants["J8Jpm2"] == pytest.approx(9.6347e-10, rel=1e-4)  # code 40400; printed here with five digits
    assert constants["Jpm10"] == pytest.approx(3.18e-10, rel=1e-3)  # code 80000
    assert codes.code_factors(constants)[40400] == {"J8Jpm2": 1.0}


# Weights


@pytest.mark.parametrize("case", CASES)
def test_spin_weights_are_those_of_the_listed_levels(case):
    options = read_par(SAMPLES / f"{case}.var").options[0]
    weights = model.option_weights(options)
    common = gcd(options.wtpl, options.wtmn, options.ewt if options.iax in model.FOLD else 0)
    levels = read_egy(SAMPLES / f"{case}_part.egy")
    for i in range(len(levels)):
        j, *k = levels.quanta[i].tolist()
        if len(k) == 2:
            expected = weights.asymmetric_weight("".join("eo"[q % 2] for q in k))
        else:
            both = 2 if k and k[0] else 1  # the two signs of K are two lines of the file
            expected = int(weights.symmetric_weights(j, abs(k[0]))) // both if k else int(weights.linear_weights(j))
        assert levels.degeneracy[i] == expected * common * (2 * j + 1)
    if case == "so2":
        assert len(levels) == 41  # those of weight 0 are not listed


def test_weights_of_other_option_lines():
    assert model.option_weights(Options("l", -1, 1, 0, 0, 0, 2, 1, 3)).to_mapping() == {"even": 1, "odd": 3}
    assert model.option_weights(Options("l", -1, 1, 0, 0, 0, 1, 1, 3)) == SpinWeights()
    assert model.option_weights(Options("s", -1, 1, 0, 20, 0, 1, 6, 4)).to_mapping() == {"0": 3, "1": 2}
    assert model.option_weights(Options("a", 1, 1, 0, 20, 0, 3, 10, 6, 1)).to_mapping() == {
        "ee": 3,
        "oe": 3,
        "eo": 5,
        "oo": 5,
    }


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (Options(iax=-6), "IAX = -6"),
        (Options(iax=4, wtmn=3), "IAX = 4"),
        (Options(iax=6, ewt=102), "EWT = 102: l-doubled"),
        (Options(iax=2, wtmn=3, spind=-1), "IAX = 2 in a symmetric top"),
    ],
)
def test_weights_that_are_not_computed_yet_are_refused(options, words):
    with pytest.raises(ValueError, match=words):
        model.option_weights(options)


def test_the_weight_that_an_option_line_without_ewt_has_is_a_weight():
    assert model.option_weights(Options(iax=6, wtpl=4, wtmn=4, ewt=99)).to_mapping() == {"0": 4, "1": 99, "2": 99}


def test_weights_of_a_threefold_axis_with_one_class_missing():
    """NH3 of one inversion state: K = 0 has odd J; half of the E levels are there, at twice their weight (SPFIT's documentation)."""
    computed = model.option_weights(Options(iax=6, wtpl=0, wtmn=4, ewt=2)).to_mapping()
    assert computed == {"0even": 0, "0odd": 4, "1": 1, "2": 1}
    with pytest.raises(ValueError, match="IAX = 6 of an asymmetric top"):
        model.option_weights(Options(iax=6, wtpl=0, wtmn=4, ewt=2), False)


@pytest.mark.parametrize("oblate", [False, True])
@pytest.mark.parametrize(
    "fields", [(6, 4, 4, 2), (6, 0, 4, 2), (6, 10, 1, 4), (9, 8, 8, 3), (9, 8, 0, 3), (9, 0, 8, 3), (9, 2, 5, 1)]
)
def test_weights_of_a_fold_are_those_of_the_levels(fields, oblate):
    """Levels of the file itself, one for each component and both of E species unless WTPL or WTMN of a threefold axis is 0."""
    iax, plus, minus, ewt = fields
    along = -3000.0 if oblate else 3000.0
    text = f"x\n 2 1\ns -1 {-1 if oblate else 1} 0 20 0 {iax} {plus} {minus} 0 {ewt}\n1000 {along} 1\n100 5000.0 1\n"
    file = read_par(text.encode())
    weights = named_top(file).spin_weights
    (group,) = connected_groups(file, read_int(b"x\n0 1 1 0 7\n1 1.0\n3 1.0\n"))
    levels = group.levels((0, 14))
    listed = {}
    for j, k, weight in zip(
        levels.rotational.tolist(), group.basis_k(levels).tolist(), levels.weight.tolist(), strict=True
    ):
        listed[j, k] = listed.get((j, k), 0) + weight
    named = {jk: int(weights.symmetric_weights(*jk)) for jk in listed}
    assert any(named.values())
    (j, k), factor = next((jk, listed[jk] / named[jk]) for jk in listed if named[jk])
    assert listed == {jk: factor * weight for jk, weight in named.items()}


def test_states_whose_weights_have_unlike_divisors_are_refused():
    """(4, 2) and (4, 4) are 2:1 and 1:1 of 2 and 4 in the file, so that states reduced each by itself weigh wrongly against each other."""
    text = "x\n 3 1\ns -1 2 0 20 0 6 4 4 -1 2\n -1 1 0 20 0 6 4 4 0 4\n1099 3000.0 1\n199 5000.0 1\n11 900.0 1\n"
    with pytest.raises(ValueError, match="common divisors differ"):
        named_top(read_par(text.encode()))


# There and back


@pytest.mark.parametrize("case", CASES)
def test_a_top_goes_to_files_and_comes_back(case):
    file, intensities = read_par(SAMPLES / f"{case}.var"), read_int(SAMPLES / f"{case}.int")
    top = named_top(file, intensities)
    again = read_par(format_par(named_parameter_file(top, file.options[0].knmax)))
    values = {p.code: p.value for p in file.parameters}
    assert {p.code: p.value for p in again.parameters} == pytest.approx(values, rel=4e-16)  # A - B: one rounding
    back = named_top(again, model.intensity_file(top, intensities.request))
    assert back.dipole_abc_debye == top.dipole_abc_debye
    assert back.spin_weights == top.spin_weights
    assert again.options[0].nvib == file.options[0].nvib


@pytest.mark.parametrize(
    "weights",
    [
        {"ee": 1, "eo": 1, "oe": 3, "oo": 3},
        {"ee": 1, "eo": 0, "oe": 0, "oo": 1},
        {"ee": 5, "eo": 7, "oe": 5, "oo": 7},
    ],
)
@pytest.mark.parametrize("representation", ["Ir", "IIIl"])
def test_weights_go_to_an_option_line_and_come_back(weights, representation):
    constants = Constants(A=3.0, B=2.0, C=1.0, representation=representation)
    spin_weights = SpinWeights.from_mapping(weights)
    assert model.option_weights(model.option_line(constants, spin_weights, 10)) == spin_weights


@pytest.mark.parametrize(
    ("constants", "weights"),
    [
        (Constants(A=3.0, B=2.0), {"0": 2, "1": 1, "2": 1}),
        (Constants(B=3.0, C=2.0), {"0": 3, "1": 5}),
        (Constants(B=3.0), {"even": 6, "odd": 3}),
    ],
)
def test_weights_of_symmetric_and_linear_tops_come_back(constants, weights):
    spin_weights = SpinWeights.from_mapping(weights)
    assert model.option_weights(model.option_line(constants, spin_weights, 10)) == spin_weights


def test_what_the_files_cannot_say_is_refused():
    with pytest.raises(ValueError, match="representation IIIr"):
        named_parameter_file(Top(Constants(A=3.0, B=2.0, C=1.0, representation="IIIr")), 9)
    four = SpinWeights.from_mapping({"ee": 7, "eo": 3, "oe": 3, "oo": 1})
    with pytest.raises(ValueError, match="cannot say"):
        model.option_line(Constants(A=3.0, B=2.0, C=1.0), four, 10)
    with pytest.raises(ValueError, match=r"has no dipole"):
        model.intensity_file(Top.from_constants("B=1 MHz"), Request())
    with pytest.raises(ValueError, match=r"dipole 30001: a moment other than a plain component"):
        named_top(file_of((100, 5.0)), read_int(SAMPLES / "co_4.int"))
    with pytest.raises(ValueError, match="the energy of the only state cannot be said"):
        named_top(file_of((100, 5.0), (0, 1.0)))


def test_a_constant_of_value_zero_keeps_its_name():
    assert dict(named_top(file_of((100, 5.0), (1000, 2.0), (200, 0.0))).constants.values) == {
        "A": 7.0,
        "B": 5.0,
        "DJ": 0.0,
    }


def test_the_symmetry_axis_is_where_the_kind_says():
    along_z = IntensityFile("t", Request(), (Dipole(1, 1.5),))
    assert named_top(file_of((100, 5.0), (1000, 2.0)), along_z).dipole_abc_debye == (1.5, 0.0, 0.0)
    assert named_top(file_of((100, 5.0), (1000, -2.0)), along_z).dipole_abc_debye == (0.0, 0.0, 1.5)


def test_mutated_parameter_files_make_a_top_or_a_refusal():
    rng = np.random.default_rng(5)
    texts = [(SAMPLES / f"{case}.var").read_bytes() for case in CASES]
    accepted = refused = 0
    for i in range(1_500):
        data = bytearray(texts[i % len(texts)])
        start = data.index(b"\n", data.index(b"\n") + 1)  # option line and parameters
        for _ in range(int(rng.integers(1, 3))):
            data[int(rng.integers(start, len(data)))] = int(rng.choice(list(b" 0123456789.+-E/")))
        try:
            written = named_parameter_file(named_top(read_par(bytes(data))), 10)
        except ValueError:
            refused += 1
        else:
            assert written.parameters
            accepted += 1
    assert min(accepted, refused) > 300  # both outcomes are really tried


def test_spelled_terms_are_written_by_their_code_and_others_refused():
    """A term beyond the published names has a code; the cubic tensor of a spherical top has none."""
    top = Constants(A=9000.0, B=5000.0, C=3000.0, DJ=0.1, terms={(2, 1, 3): 1e-9})
    assert list(codes.code_factors(top))[-1] == 61200  # J⁴ Jz² (J₊⁶ + J₋⁶): KSQ 1, NSQ 2, type 6
    with pytest.raises(ValueError, match="no code for it"):
        codes.code_factors(Constants(kind="spherical", B=157122.0, Dt=0.13))
