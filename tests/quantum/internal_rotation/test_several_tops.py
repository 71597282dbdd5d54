"""Two and three internal rotors against full matrices over |K⟩|m1⟩|m2⟩..., written without the package."""

from functools import reduce
from itertools import combinations, product

import numpy as np
import pytest
from linear_functions import energies_of

import rotor
from rotor import units
from rotor.quantum.estimates.derivatives import level_derivatives
from rotor.quantum.internal_rotation.frames import axis_of_angles
from rotor.quantum.internal_rotation.levels import energies_alone
from rotor.quantum.internal_rotation.model import RamModel
from rotor.quantum.internal_rotation.several_tops import InternalTop, SeveralTops, several_tops
from rotor.tops.internal_rotation import InternalRotationConstants

CM = units.MHZ_PER_CM
ABC = {"A": 9800.0, "B": 4300.0, "C": 3200.0}
FIRST = InternalTop(5.6 * CM, 300.0 * CM, (0.06, 0.02, 0.0))
SECOND = InternalTop(6.1 * CM, 40.0 * CM, (0.05, -0.03, 0.0))
COUPLED = {"F12": -0.4 * CM, "V12": 12.0 * CM, "V12s": -7.0 * CM}
SPECIES = [(0, 0), (0, 1), (1, 0), (1, 1), (1, -1)]


def direct_product(model, j, species, waves):
    """H of one J over |K⟩|m1⟩|m2⟩..."""
    k = np.arange(-j, j + 1.0)
    raising = np.diag(np.sqrt(j * (j + 1) - k[:-1] * (k[:-1] + 1)), -1)
    components = [np.diag(k).astype(complex), (raising + raising.T) / 2, 0.5j * (raising - raising.T)]
    m = [3.0 * np.arange(-waves, waves + 1) + sigma for sigma in species]
    size = 2 * waves + 1
    cos3, sin3 = (np.eye(size, k=1) + np.eye(size, k=-1)) / 2, (np.eye(size, k=-1) - np.eye(size, k=1)) / 2j
    cos6 = 2 * (np.eye(size, k=2) + np.eye(size, k=-2)) / 4

    def whole(rotation, *of_tops):
        """A matrix of the rotation times matrices of the tops by number, unit matrices elsewhere."""
        named = dict(of_tops)
        return reduce(np.kron, [rotation, *(named.get(i, np.eye(size)) for i in range(len(species)))])

    unit = np.eye(2 * j + 1)
    slips = [
        whole(unit, (i, np.diag(m[i])))
        - whole(sum(value * component for value, component in zip(top.rho_abc, components, strict=True)))
        for i, top in enumerate(model.tops)
    ]
    total = whole(sum(x * c @ c for x, c in zip(model.rotation.values(), components, strict=True)))
    for i, (top, slip) in enumerate(zip(model.tops, slips, strict=True)):
        barrier = top.v3_mhz / 2 * (np.eye(size) - cos3) + top.v6_mhz / 2 * (np.eye(size) - cos6)
        total = total + top.f_mhz * slip @ slip + whole(unit, (i, barrier))
    for i, k in combinations(range(len(species)), 2):
        f, v, vs = (
            model.between.get(name, 0.0) for name in (f"F{i + 1}{k + 1}", f"V{i + 1}{k + 1}", f"V{i + 1}{k + 1}s")
        )
        total = total + f * (slips[i] @ slips[k] + slips[k] @ slips[i])
        total = total + v / 2 * whole(unit, (i, np.eye(size) - cos3), (k, np.eye(size) - cos3))
        total = total + vs / 2 * whole(unit, (i, sin3), (k, sin3))
    return total


@pytest.mark.parametrize("species", SPECIES)
@pytest.mark.parametrize("plane", [True, False])
def test_all_products_give_the_levels_of_the_direct_product(species, plane):
    second = SECOND if plane else InternalTop(SECOND.f_mhz, SECOND.v3_mhz, (0.05, -0.03, 0.04))
    model = SeveralTops(ABC, (FIRST, second), COUPLED)
    blocks = model.blocks(species, 3, count=49, each=7, waves=3)
    energies = energies_of(blocks.linear, blocks.elements.count, model.coefficients)
    for j in range(4):
        expected = np.linalg.eigvalsh(direct_product(model, j, species, 3))
        found = np.sort(energies[blocks.functions.labels["J"] == j])
        assert len(found) == len(expected)
        assert np.abs(found - expected).max() < 1e-6  # MHz, of energies up to 4e7: rounding of both matrices


THIRD = InternalTop(5.3 * CM, 150.0 * CM, (0.01, 0.055, 0.0), -6.0 * CM)
COUPLED_THREE = COUPLED | {
    "F13": 0.2 * CM,
    "V13": 5.0 * CM,
    "V13s": 3.0 * CM,
    "F23": -0.3 * CM,
    "V23": -4.0 * CM,
    "V23s": 6.0 * CM,
}
SPECIES_OF_THREE = [s for s in product((0, 1, -1), repeat=3) if s >= tuple(-x for x in s)]


@pytest.mark.parametrize("plane", [True, False])
@pytest.mark.parametrize(("species", "waves"), [*((species, 1) for species in SPECIES_OF_THREE), ((1, 1, -1), 2)])
def test_all_products_of_three_tops_give_the_levels_of_the_direct_product(species, waves, plane):
    third = THIRD if plane else InternalTop(THIRD.f_mhz, THIRD.v3_mhz, (0.01, 0.055, 0.02), THIRD.v6_mhz)
    model = SeveralTops(ABC, (FIRST, SECOND, third), COUPLED_THREE)
    blocks = model.blocks(species, 2, count=(2 * waves + 1) ** 3, each=2 * waves + 1, waves=waves)
    energies = energies_of(blocks.summed(model.coefficients), len(blocks.functions.labels["J"]), [1.0])
    for j in range(3):
        expected = np.linalg.eigvalsh(direct_product(model, j, species, waves))
        found = np.sort(energies[blocks.functions.labels["J"] == j])
        assert len(found) == len(expected)
        assert np.abs(found - expected).max() < 1e-6  # MHz, of energies up to 4e7: rounding of both matrices


def test_opposite_species_of_three_tops_have_equal_energies():
    """Time reversal takes (σ1, σ2, σ3) to (-σ1, -σ2, -σ3): each of the 14 names stands for both."""
    model = SeveralTops(ABC, (FIRST, SECOND, THIRD), COUPLED_THREE)
    for species in ((1, -1, 0), (1, 1, -1)):
        pair = [model.blocks(s, 2, count=20) for s in (species, tuple(-x for x in species))]
        first, second = (
            np.sort(energies_of(blocks.summed(model.coefficients), len(blocks.functions.labels["J"]), [1.0]))
            for blocks in pair
        )
        assert np.abs(first - second).max() < 1e-5  # MHz, of up to 1e8
    assert len(model.species) == len(SPECIES_OF_THREE) == 14


def test_a_third_top_without_coupling_adds_its_torsion():
    alone = InternalTop(THIRD.f_mhz, THIRD.v3_mhz, (0.0, 0.0, 0.0))
    three = SeveralTops(ABC, (FIRST, SECOND, alone), COUPLED)
    two = SeveralTops(ABC, (FIRST, SECOND), COUPLED)
    lowest = [
        np.sort(model.blocks(species, 2, count=count, each=4).solve_once(model.coefficients, 0).energies)
        for model, species, count in ((three, (0, 1, 1), 64), (two, (0, 1), 16))
    ]
    assert np.ptp(lowest[0] - lowest[1]) < 1e-5  # all products of four functions of each top; MHz, of 1e8


def test_two_tops_that_do_not_see_each_other_are_two_molecules():
    """ρ2 = 0 and no coupling: levels of the first top plus the torsion of the second."""
    alone = InternalTop(SECOND.f_mhz, SECOND.v3_mhz, (0.0, 0.0, 0.0))
    model = SeveralTops(ABC, (InternalTop(FIRST.f_mhz, FIRST.v3_mhz, (0.06, 0.0, 0.0)), alone))
    single = RamModel(ABC | {"F": FIRST.f_mhz, "V3": FIRST.v3_mhz, "rho": 0.06})
    for sigma in (0, 1):
        both = model.blocks((sigma, 0), 3, count=9, each=9).solve(model.coefficients, 0)
        expected = single.blocks(sigma, 3, count=9).solve(single.coefficients, 0)
        difference = np.sort(both.energies) - np.sort(expected.energies)
        assert np.ptp(difference) < 1e-3  # nine products by energy have fewer functions of the first top than nine
        assert difference.mean() == pytest.approx(
            model.blocks((sigma, 0), 0).functions.torsion.tops[1].energies[0, 0], abs=1e-2
        )


def test_products_converge_from_above():
    model = SeveralTops(ABC, (FIRST, SECOND), COUPLED)
    lowest = [
        model.blocks((0, 1), 4, count=count, each=9).solve(model.coefficients, 0).energies for count in (16, 36, 64)
    ]
    errors = [np.abs(np.sort(energies) - np.sort(lowest[-1])).max() for energies in lowest[:-1]]
    assert errors[1] < errors[0] / 10
    assert (np.sort(lowest[0]) >= np.sort(lowest[1]) - 1e-5).all()  # the variational principle, but for rounding


DIMETHYL = {
    "F0_1": 158e3,
    "delta_1": 0.56,
    "V3_1": 100.0 * CM,
    "F0_2": 161e3,
    "delta_2": 2.5,
    "epsilon_2": 0.2,
    "V3_2": 140.0 * CM,
}


def test_f_and_rho_are_those_of_the_inverse_kinetic_energy():
    """T of five velocities as a matrix, inverted as a whole."""
    model = several_tops(ABC, DIMETHYL)
    abc = np.array(list(ABC.values()))
    axes = np.array([axis_of_angles(DIMETHYL["delta_1"]), axis_of_angles(DIMETHYL["delta_2"], DIMETHYL["epsilon_2"])])
    moments = np.array([1 / (2 * DIMETHYL["F0_1"]), 1 / (2 * DIMETHYL["F0_2"])])  # ħ = 1
    inertia = np.zeros((5, 5))
    inertia[:3, :3] = np.diag(1 / (2 * abc))
    inertia[3:, 3:] = np.diag(moments)
    inertia[:3, 3:] = (axes * moments[:, None]).T
    inertia[3:, :3] = inertia[:3, 3:].T
    expected = np.linalg.inv(inertia) / 2  # of P P, P p and p p
    rho = np.array([top.rho_abc for top in model.tops])
    f = np.array([[model.tops[0].f_mhz, model.between["F12"]], [model.between["F12"], model.tops[1].f_mhz]])
    assert np.allclose(expected[3:, 3:], f, rtol=1e-12)
    assert np.allclose(expected[:3, 3:], -rho.T @ f, rtol=1e-12)
    assert np.allclose(expected[:3, :3], np.diag(abc) + rho.T @ f @ rho, rtol=1e-12)


FILE = """
name = "dimethyl"
[constants]
A = 9800
B = 4300
C = 3200
reduction = "A"
representation = "Ir"
[dipole]
a = 0.3
b = 1.3
[internal_rotation]
frame = "PAM"
F0_1 = 158000
delta_1 = 0.56
V3_1 = "250 cm-1"
F0_2 = 161000
delta_2 = 2.5
V3_2 = "340 cm-1"
vt_max = 0
"""


def test_a_molecule_file_with_two_tops_has_levels_and_lines_of_five_species(tmp_path):
    path = tmp_path / "dimethyl.toml"
    path.write_text(FILE)
    top = rotor.read(path)
    levels = rotor.api.solve_levels(top, 2)
    assert len(levels) == 5 * 9
    nine = {
        name: levels.degeneracy[levels.find(species=name, vt=0, j=0, ka=0, kc=0)]
        for name in ("AA", "AE", "EA", "EE", "EE*")
    }
    assert list(nine.values()) == [2, 2, 2, 1, 1]  # 16, 16, 16, 8 and 8 of the 64 spin functions
    assert len({tuple(row) for row in zip(*levels.quanta.values(), strict=True)}) == len(levels)
    model = several_tops(top.constants.values, top.internal_rotation.values)
    energies = model.blocks((1, -1), 2).solve(model.coefficients, 0).energies
    assert np.allclose(
        np.sort(levels.energy_mhz[levels.quanta["species"] == "EE*"]), np.sort(energies), atol=1e-6, rtol=0
    )
    lines = rotor.api.line_list(top, jmax=2, q=1.0, min_lgint=None)
    upper, lower = (lines.levels.quanta["species"][rows] for rows in (lines.upper, lines.lower))
    assert (upper == lower).all()
    assert set(upper.tolist()) == set(nine)


def test_a_top_behind_a_high_wall_leaves_the_other_one():
    """V3_2 of 3000 cm-1: species of the second top coincide, and splittings of the first are those of one top."""
    rotation = {"A": 9800.0, "B": 4300.0, "C": 3200.0}
    constants = {"F0_1": 158e3, "delta_1": 0.0, "V3_1": 250 * CM, "F0_2": 161e3, "delta_2": 0.0, "V3_2": 3000 * CM}
    both = several_tops(rotation, constants)
    ground = {name: both.ground_energies(species, 2) for name, species in both.species.items()}
    assert np.allclose(ground["AE"], ground["AA"], atol=1e-3, rtol=0)  # MHz, of energies of 1e9
    assert np.abs(ground["EA"] - ground["AA"]).min() > 1.0


@pytest.mark.parametrize(
    ("change", "text"),
    [(('frame = "PAM"', 'frame = "RAM"'), "two tops in the frame RAM"), (("F0_2 = 161000", ""), "F0_2 missing"),
     (("vt_max", 'rho = 0.1\nvt_max'), "rho of two tops"),
     (("vt_max", "F0_4 = 150000\nvt_max"), "F0_4: a molecule may have up to three tops")],
)  # fmt: skip
def test_mistakes_in_constants_of_two_tops_are_named(tmp_path, change, text):
    path = tmp_path / "dimethyl.toml"
    path.write_text(FILE.replace(*change))
    with pytest.raises(ValueError, match=text):
        rotor.read(path)


@pytest.mark.slow
def test_a_spectrum_of_two_tops_names_five_species(tmp_path, call):
    path = tmp_path / "dimethyl.toml"
    path.write_text(FILE)
    code, output, _ = call("spectrum", str(path), "--jmax", "2", "--temperature", "10")
    assert code == 0
    assert "EE*" in output


THIRD_TOP = """F0_3 = 159500
delta_3 = 1.45
V3_3 = "300 cm-1"
"""


def fixed_functions(turns):
    """Spin functions of nine protons that cyclic permutations of three groups, each applied turns[i] times, leave as they are."""
    spins = np.array(list(product((0, 1), repeat=9))).reshape(-1, 3, 3)
    moved = np.stack([np.roll(spins[:, i], turn, axis=1) for i, turn in enumerate(turns)], axis=1)
    return int((moved == spins).all(axis=(1, 2)).sum())


def test_weights_of_three_tops_are_those_of_permuted_spins(tmp_path):
    """Spin functions for which every cyclic permutation of a top has the character exp(2πiσ/3), for σ and -σ together."""
    path = tmp_path / "three.toml"
    path.write_text(FILE.replace("vt_max", THIRD_TOP + "functions = 12\nvt_max"))
    top = rotor.read(path)
    levels = rotor.api.solve_levels(top, 1)
    counts, w = {}, np.exp(2j * np.pi / 3)
    group = [(turns, fixed_functions(turns)) for turns in product(range(3), repeat=3)]
    for sigma in SPECIES_OF_THREE:
        name = "".join({0: "A", 1: "E", -1: "E*"}[s] for s in sigma)
        members = {sigma, tuple(-s for s in sigma)}
        counts[name] = round(
            sum((w ** -np.dot(member, turns) * fixed).real / 27 for member in members for turns, fixed in group)
        )
    assert sum(counts.values()) == 512
    found = {name: int(levels.weight[levels.find(species=name, vt=0, j=1, ka=1, kc=1)]) for name in counts}
    assert found == {name: count // 16 for name, count in counts.items()}  # 64, 32 and 16 of 512


def test_lines_of_three_tops(tmp_path):
    """14 species, each level J(Ka, Kc) once; lines stay inside a species."""
    path = tmp_path / "three.toml"
    path.write_text(FILE.replace("vt_max", THIRD_TOP + "functions = 12\nvt_max"))
    lines = rotor.api.line_list(rotor.read(path), jmax=2, q=1.0, min_lgint=None)
    assert len(lines.levels) == 14 * 9
    upper, lower = (lines.levels.quanta["species"][rows] for rows in (lines.upper, lines.lower))
    assert (upper == lower).all()
    assert len(set(upper.tolist())) == 14


@pytest.mark.parametrize(
    ("change", "text"),
    [("delta_3 = 1.45", "delta_3 missing"), ("F0_3 = 159500", "F0_3 missing")],
)
def test_missing_constants_of_a_third_top_are_named(tmp_path, change, text):
    path = tmp_path / "three.toml"
    path.write_text(FILE.replace("vt_max", THIRD_TOP.replace(change, "") + "vt_max"))
    with pytest.raises(ValueError, match=text):
        rotor.read(path)


def test_three_tops_of_which_two_are_exchanged_are_refused(tmp_path):
    """A third top on the axis b between two equal ones."""
    text = (
        FILE.replace("F0_2 = 161000", "F0_2 = 158000")
        .replace("delta_2 = 2.5\n", "delta_2 = 2.58159265\n")
        .replace("340 cm-1", "250 cm-1")
    )
    path = tmp_path / "three.toml"
    path.write_text(text.replace("vt_max", THIRD_TOP.replace("1.45", "1.57079633") + "vt_max"))
    with pytest.raises(ValueError, match="C2 about b exchanges tops 1 and 2; spin weights"):
        rotor.api.solve_levels(rotor.read(path), 1)


def test_sums_need_the_lowest_products_alone(tmp_path):
    """Levels below a limit between the first and the second torsional state are those of all products."""
    path = tmp_path / "dimethyl.toml"
    path.write_text(FILE)
    top = rotor.read(path)
    every = energies_alone(top, top.internal_rotation, (), 8, 8)
    ground = every.energy_mhz.min()
    limit = ground + 60.0 * CM  # v_t = 1 begins 100 cm-1 or more above
    low = energies_alone(top, top.internal_rotation, (), 8, 8, limit)
    expected, found = (np.sort(levels.energy_mhz[levels.energy_mhz < limit]) for levels in (every, low))
    assert len(low) < len(every)
    assert len(found) == len(expected) == 5 * 17
    assert np.abs(found - expected).max() < 0.05  # MHz: functions far above the limit are left out


def test_long_sums_of_three_tops_are_refused(tmp_path):
    path = tmp_path / "three.toml"
    path.write_text(FILE.replace("vt_max", THIRD_TOP + "vt_max"))
    top = rotor.read(path)
    with pytest.raises(ValueError, match="blocks of 2460 functions; give the partition function"):
        energies_alone(top, top.internal_rotation, (), 20, 20)


@pytest.mark.parametrize("axis", ["a", "b"])
def test_torsional_states_of_similar_tops_are_the_same_in_every_species(axis):
    """F12 mixes (1, 0) and (0, 1) of equal tops fully: v_t = 1 is the lower state of the pair in AA and in AE, not a share of both."""
    angles = {"b": {"delta_2": np.pi - 0.6}, "a": {"delta_2": -0.6}}[axis]
    top = {"F0_1": 160e3, "delta_1": 0.6, "V3_1": 900 * CM, "F0_2": 160e3, "V3_2": 900 * CM}
    model = several_tops(ABC, top | angles)
    assert model.axis == axis
    energies = {}
    for name in ("AA", "AE", "EE", "EE*"):
        levels = model.blocks(model.species[name], 3, count=16).solve_once(model.coefficients, 2)
        chosen = levels.quanta["j"] == 3
        energies[name] = [np.sort(levels.energies[chosen & (levels.vt == v)]) for v in (1, 2)]
    assert np.abs(energies["AA"][1] - energies["AA"][0]).min() > 1.5 * CM  # the pair is apart
    for name in ("AE", "EE", "EE*"):
        assert np.abs(np.array(energies[name]) - energies["AA"]).max() < 0.3 * CM  # the tunnelling splitting of v_t = 1


@pytest.mark.parametrize("tops", [1, 2])
def test_derivatives_of_predicted_levels_are_those_of_finite_differences(tops):
    """By constants of the principal axes, which act through F, ρ and F12 too: errors of F0 were left out without them."""
    values = {"F0_1": 158e3, "delta_1": 0.56, "V3_1": 250 * CM, "F0_2": 161e3, "delta_2": 2.5, "V3_2": 340 * CM}
    if tops == 1:
        values = {name[:-2]: value for name, value in values.items() if name.endswith("_1")}

    def levels_of(**changed):
        both = ABC | values | changed
        constants = rotor.Constants(**{name: both[name] for name in "ABC"}, reduction="A", representation="Ir")
        internal = InternalRotationConstants({name: both[name] for name in values}, "PAM", vt_max=0)
        top = rotor.Top.from_constants(constants, internal_rotation=internal)
        return top, rotor.api.solve_levels(top, 2)

    top, levels = levels_of()
    names = ["A", "B", *values]
    slopes = level_derivatives(top, levels, names)
    assert np.allclose(level_derivatives(top, levels, names[2:3]), slopes[:, 2:3], rtol=1e-12)
    for i, name in enumerate(names):
        value = (ABC | values)[name]
        step = 1e-5 * value
        up, down = (levels_of(**{name: value + sign * step})[1].energy_mhz for sign in (1, -1))
        expected = (up - down) / (2 * step)
        noise = 4e-8 / step  # rounding of eigenvalues of matrices with elements up to 1e8 MHz
        assert np.allclose(slopes[:, i], expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max() + noise), name
