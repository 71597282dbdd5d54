"""Isotopologues: which there are and how abundant, constants against measured ones, axes, dipole, weights."""

from __future__ import annotations

import importlib.util
import itertools
import json
import sys
from collections import defaultdict
from dataclasses import replace

import force_fields
import numpy as np
import pytest
from ase import Atoms
from hypothesis import given, settings
from hypothesis import strategies as st
from places import PROJECT

import rotor
from rotor.cli import run
from rotor.formats.molecules import fitted_isotopologue
from rotor.molecules.molecule import Molecule
from rotor.molecules.nuclei import data_folder, isotope, natural_isotopes
from rotor.molecules.readers.read import g2_molecule
from rotor.tops.distortion import distortion_constants, semirigid_top
from rotor.tops.isotopes.isotopologues import isotopologue, isotopologues, single_substitutions
from rotor.tops.top import Top

# Which there are


@pytest.mark.parametrize("name", ["H2O", "C2H4", "CH3Cl", "CO2", "NH3", "H2O2", "C2H6"])
def test_abundances_of_a_family_are_those_of_all_placements(name):
    """Placements of every isotope on every atom, distinguished by their distances and masses, not by symmetry operations."""
    molecule = g2_molecule(name)
    options = [list(natural_isotopes(s)) for s in molecule.symbols]
    distances = np.linalg.norm(molecule.positions_angstrom[:, None] - molecule.positions_angstrom, axis=2).round(4)
    families: dict[tuple, list[float]] = defaultdict(list)
    for placement in itertools.product(*options):
        part = np.prod([item.abundance for item in placement])
        numbers = [item.mass_number for item in placement]
        key = sorted(
            (
                molecule.symbols[i],
                numbers[i],
                tuple(sorted((molecule.symbols[j], numbers[j], distances[i, j]) for j in range(len(numbers)))),
            )
            for i in range(len(numbers))
        )
        families[tuple(key)].append(float(part))
    expected = sorted((sum(parts), len(parts)) for parts in families.values() if sum(parts) >= 1e-7)
    computed = sorted(
        (variant.abundance, variant.arrangements)
        for variant in isotopologues(Top.from_molecule(molecule), min_abundance=1e-7)
    )
    assert [n for _, n in computed] == [n for _, n in expected]
    assert np.allclose(
        [a for a, _ in computed], [a for a, _ in expected], rtol=1e-9
    )  # sums of products in another order


def test_all_isotopologues_together_are_all_molecules():
    computed = isotopologues(Top.from_molecule(g2_molecule("CH3Cl")), min_abundance=1e-14)
    assert sum(entry.abundance for entry in computed) == pytest.approx(1, abs=1e-10)  # what is rarer than the limit


def test_benzene_has_three_pairs_of_13c():
    family = isotopologues(rotor.read("C6H6"))
    pairs = {item.label: item for item in family if len(item.substituted) == 2}
    assert {label: pair.arrangements for label, pair in pairs.items()} == {
        "C4[13C]2H6 (1=13C,2=13C)": 6, "C4[13C]2H6 (1=13C,3=13C)": 6, "C4[13C]2H6 (1=13C,4=13C)": 3,
    }  # fmt: skip
    assert [pair.top.symmetry.point_group for pair in pairs.values()].count("D2h") == 1  # para
    assert not any("doubtful" in note for item in family for note in item.top.notes)


def test_mirror_images_are_one_isotopologue():
    methane = Top.from_molecule(g2_molecule("CH4"))
    chiral = isotopologue(methane, "2=2H,3=3H")
    assert chiral.arrangements == 12  # 4 · 3 placements of D and T, all alike: no two hydrogens are left different
    difluoro = Top.from_molecule(g2_molecule("H2CF2"))
    hydrogen = difluoro.molecule.symbols.index("H") + 1
    assert isotopologue(difluoro, {hydrogen: "2H"}).arrangements == 2
    assert (
        isotopologue(difluoro, {hydrogen: "2H", difluoro.molecule.symbols.index("F") + 1: "18F"}).arrangements == 4
    )  # chiral


def test_a_parent_that_is_rare_itself_has_the_same_family():
    rare = rotor.read("water", isotopes="O=18O")
    assert [variant.label for variant in isotopologues(rare)] == [
        variant.label for variant in isotopologues(rotor.read("water"))
    ]


def test_one_at_a_time():
    computed = single_substitutions(rotor.read("CH3CN"), "C", "13C")
    assert [dict(entry.substituted) for entry in computed] == [{1: "13C"}, {2: "13C"}]
    assert len(single_substitutions(rotor.read("C6H6"), "H", "2H")) == 1
    with pytest.raises(ValueError, match="element 'O'"):
        single_substitutions(rotor.read("CH3CN"), "O", "18O")


def test_the_lowest_of_equivalent_atoms_is_named_also_for_a_lighter_isotope():
    """Of boron 11B is the abundant one."""
    pair = Molecule(("B", "B"), [[0.0, 0.0, 0.0], [0.0, 0.0, 1.6]])
    family = isotopologues(Top.from_molecule(pair), min_abundance=1e-3)
    assert [dict(item.substituted) for item in family] == [{}, {1: "10B"}, {1: "10B", 2: "10B"}]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: isotopologues(rotor.Top.from_constants("B=1 GHz")), "there is no geometry"),
        (lambda: isotopologues(rotor.read("water"), min_abundance=0), "above 0"),
        (lambda: isotopologues(rotor.read("HDO"), min_abundance=1.0), "lower the limit"),
        (lambda: isotopologues(rotor.read("camphor"), min_abundance=1e-30), "placements of isotopes"),
        (lambda: isotopologue(rotor.read("water"), "4=2H"), "atom 4"),
    ],
)
def test_what_cannot_be_is_told(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_an_element_without_natural_isotopes_keeps_its_own():
    assert natural_isotopes("Tc") == ()
    pair = Top.from_molecule(Molecule(("Tc", "Tc"), [[0, 0, 0], [0, 0, 2.2]]))
    (only,) = isotopologues(pair)
    assert only.abundance == 1.0


# Constants


@pytest.mark.oracle
def test_heavy_atoms_replaced_are_met_within_a_few_parts_in_ten_thousand(shared):
    """B of linear molecules from the first measured line of their own catalogues."""
    cases = [("c062505", "OCS", "3=34S"), ("c062506", "OCS", "1=18O"), ("c061502", "OCS", "2=13C"), ("c052512", "HC3N", "1=15N"),
             ("c052510", "HC3N", "3=13C"), ("c052509", "HC3N", "4=13C"), ("c052511", "HC3N", "2=13C")]  # fmt: skip
    for tag, name, changes in cases:
        catalogue = rotor.read(shared / "reference" / "catalogues" / f"{tag}.cat.gz")
        line = catalogue.frequency_mhz[catalogue.tag < 0][0]
        item = isotopologue(rotor.read(name), changes).top.constants
        computed = 2 * item["B"] - 4 * item["D"]
        assert computed == pytest.approx(line, rel=2e-4), tag  # what the two vibrational averages differ by
        assert computed != pytest.approx(line, rel=1e-8)  # scaled, not looked up


@pytest.mark.parametrize(("changes", "name"), [("H=2H", "D2O"), ("2=2H", "HDO")])
def test_deuterium_in_water_is_met_within_a_per_cent(changes, name):
    scaled, measured = isotopologue(rotor.read("water"), changes).top, rotor.read(name)
    rigid = Top.from_molecule(measured.molecule)
    for x in range(3):
        off, without = (abs(t.constants.rigid[x] / measured.constants.rigid[x] - 1) for t in (scaled, rigid))
        assert off < 0.008  # 0.71 % at most: the zero-point motion of D is not that of H
        assert off < without  # the ratio is better than the geometry


@pytest.mark.parametrize(
    ("name", "heavy", "quartic", "sextic"),
    [
        (
            "water",
            "D2O",
            {"DJ": 3.5, "DJK": 5.8, "DK": 8.5, "d1": 6.3, "d2": 13.4},
            {"HJ": 9.4, "HKJ": -68.9, "HK": 17.9},
        ),
        ("ammonia", "ND3", {"DJ": 15.1, "DJK": 16.9, "DK": -26.7}, {"HJ": 50.5, "HKJ": 47.5, "HK": -106.5}),
    ],
)
def test_what_scaling_of_distortion_misses_is_stated(name, heavy, quartic, sextic):
    """Per cent beside the fitted constants of the library; the note has the extremes."""
    scaled, fitted = rotor.read(name, isotopes="H=2H"), rotor.read(heavy).constants
    for constant, off in {**quartic, **sextic}.items():
        assert 100 * (scaled.constants[constant] / fitted[constant] - 1) == pytest.approx(off, abs=0.06), constant
    (note,) = [note for note in scaled.notes if "scaled with powers" in note]
    low, high = min(map(abs, quartic.values())), max(map(abs, quartic.values()))
    assert f"{int(low)} to {round(high)} % " in note  # 3 to 13, 15 to 27
    assert "up to 107 %" in note
    assert "5 %" not in note.replace("15 to", "")


@pytest.mark.oracle
def test_what_scaling_misses_for_heavy_atoms_is_stated(shared):
    """D of the fits of docs/make_published_structures.py, which have H where the lines call for it."""
    path = PROJECT / "docs" / "make_published_structures.py"
    spec = importlib.util.spec_from_file_location("make_published_structures", path)
    make = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(make)
    worst = {"D": 0.0, "H": 0.0}
    for name in ("OCS", "HC3N"):
        fits = [fit.named for fit in make.of_lines(name, shared)[1].values()]
        heavy = [
            fit for fit in fits[1:] if name == "OCS" or fit["B"] > 0.95 * fits[0]["B"]
        ]  # B of DC3N is 0.93 of that of HC3N
        for item, (constant, power) in itertools.product(heavy, (("D", 2), ("H", 3))):
            if constant in item.values and constant in fits[0].values:
                ratio = fits[0][constant] * (item["B"] / fits[0]["B"]) ** power / item[constant]
                worst[constant] = max(worst[constant], abs(ratio - 1))
    assert (round(100 * worst["D"], 1), round(100 * worst["H"])) == (1.1, 10)
    notes = " ".join(rotor.read("OCS", isotopes="O=18O").notes)
    assert "up to 1.1 % (quartic) and 10 % (sextic) for replaced heavy atoms" in notes


@pytest.mark.parametrize(
    ("source", "changes", "entry"), [("water", "H=2H", "D2O"), ("ND3", "H=1H", "NH3"), ("D2O", "3=1H", "HDO")]
)
def test_fitted_constants_of_the_library_are_pointed_out(source, changes, entry):
    notes = rotor.read(source, isotopes=changes).notes
    (note,) = [note for note in notes if "the library has" in note]
    assert f"itself, {entry!r}: here" in note
    if entry == "D2O":
        assert "A is +0.58 %" in note
    assert not [note for note in rotor.read(entry).notes if "the library has" in note]


def test_a_symmetric_isotopologue_has_no_tensor_elements_of_rounding_size(call):
    """ND3 from NH3 had C_ac = 1e-10 MHz, which mixes K and -K: levels were pairs with Ka and Kc."""
    top = rotor.read("NH3", isotopes="H=2H")
    names = {name.partition("(")[0] for name in top.spin_constants.values}
    assert names == {"chi_cc", "C_aa", "C_bb", "C_cc"}
    code, out, err = call("levels", "NH3", "--isotope", "H=2H", "--hyperfine", "--jmax", "2")
    assert code == 0, err
    assert "Ka" not in out
    turned = rotor.read("NH3", isotopes="2=2H").spin_constants.values
    assert any(name.startswith("C_ac") for name in turned)  # the axes of NH2D are turned by 9 degrees


def test_other_molecules_are_not_pointed_out(call):
    """Neither an isotopologue that the library lacks, nor the parent, nor another placement of the same isotopes."""
    for changes in ("O=18O", "2=3H"):
        assert not [note for note in rotor.read("water", isotopes=changes).notes if "the library has" in note]
    assert not [note for note in rotor.read("water", isotopes="H=1H").notes if "the library has" in note]
    places = [rotor.read("N2O").molecule.with_isotopes(f"{n}=15N") for n in (1, 2)]
    assert not fitted_isotopologue._same(*places)
    assert fitted_isotopologue._same(
        places[0], replace(places[0], positions_angstrom=places[0].positions_angstrom * 1.01)
    )
    code, _, err = call("isotopologues", "water", "--site", "2=2H", "--site", "3=2H")
    assert code == 0
    assert "the library has constants of this isotopologue itself, 'D2O'" in err


@pytest.mark.parametrize("changes", ["1=34S", "O=18O", "2=18O", "2=17O"])
def test_scaled_distortion_is_near_that_of_the_force_field(changes):
    field = force_fields.sulfur_dioxide()
    scaled = isotopologue(semirigid_top(field, reduction="A"), changes).top.constants
    exact = distortion_constants(field.with_isotopes(changes), reduction="A")
    assert {name: scaled[name] for name in "ABC"} == pytest.approx(
        {name: exact[name] for name in "ABC"}, rel=1e-9
    )  # round-off
    for name in ("DeltaJ", "DeltaJK", "DeltaK", "deltaJ", "deltaK"):
        assert scaled[name] == pytest.approx(exact[name], rel=0.04)  # at most 3.5 %


@given(st.floats(1.0, 3.0), st.sampled_from(["1=13C", "2=18O", "1=13C,2=17O", "1=14C"]))
@settings(max_examples=20)
def test_diatomics_scale_exactly(distance, changes):
    """B goes as 1/μ, D as 1/μ², whatever B and D are (Dunham 1932)."""
    atoms = Molecule(("C", "O"), [[0, 0, 0], [0, 0, distance]])
    parent = Top.from_molecule(atoms)
    parent = rotor.read(Top(parent.constants.replace(B=50000.0, D=0.2), molecule=atoms, frame=parent.frame))
    scaled = isotopologue(parent, changes).top.constants
    mu = [np.prod(m.masses_u) / m.mass_u for m in (atoms, atoms.with_isotopes(changes))]
    assert scaled["B"] == pytest.approx(50000 * mu[0] / mu[1], rel=1e-12)  # round-off
    assert scaled["D"] == pytest.approx(0.2 * (mu[0] / mu[1]) ** 2, rel=1e-12)


def test_a_geometry_alone_is_recomputed():
    water = g2_molecule("H2O")
    item = isotopologue(Top.from_molecule(water), "1=18O").top
    assert item.constants == Top.from_molecule(water.with_isotopes("1=18O")).constants
    assert not any("the ratio of those calculated" in note for note in item.notes)


# Axes, dipole, weights


def test_hdo_gains_a_dipole_along_a_and_loses_ortho_and_para():
    hdo = isotopologue(rotor.read("water"), "2=2H")
    assert [abs(x) for x in hdo.top.dipole_abc_debye] == pytest.approx([0.67, 1.73, 0.0], abs=0.005)
    assert (hdo.top.symmetry.point_group, hdo.top.spin_weights.to_mapping()) == ("Cs", {})
    assert hdo.turned_degrees == pytest.approx(21.1, abs=0.05)
    assert any("no distortion constants" in note for note in hdo.top.notes)


def near_oblate() -> Top:
    """Bent SH2 whose moments about C2 and along H-H, 2 m x² and 2 m z² M/(M + 2m), change order from H to D."""
    bent = Molecule(("S", "H", "H"), [[0, 0, 0], [0.96, 0, 1.0], [-0.96, 0, 1.0]], dipole_debye=[0, 0, 1.0])
    return Top.from_molecule(bent)


def test_axes_that_change_places_are_matched_by_overlap():
    parent = near_oblate()
    item = isotopologue(parent, "H=2H")
    assert item.axes == "bac"
    along, before = (int(np.argmax(np.abs(top.dipole_abc_debye))) for top in (item.top, parent))
    assert item.axes[along] == "abc"[before]  # the dipole has not moved in the molecule
    assert along != before
    assert item.turned_degrees == pytest.approx(0, abs=1e-6)  # matched, they have not turned at all


def test_scaled_constants_follow_axes_that_change_places():
    rigid = near_oblate()
    measured = rigid.constants.replace(A=rigid.constants["A"] * 1.001, DeltaJ=1.0)
    parent = replace(rigid, constants=measured)
    item = isotopologue(parent, "H=2H")
    bare = Top.from_molecule(item.top.molecule).constants
    assert item.top.constants["B"] == pytest.approx(bare["B"] * 1.001, rel=1e-12)  # B here is along the parent's a
    assert item.top.constants["A"] == pytest.approx(bare["A"], rel=1e-12)
    assert "DeltaJ" not in item.top.constants


def test_scaled_constants_out_of_order_take_their_frame_along():
    rigid = near_oblate().with_polarizability(np.diag([3.0, 2.0, 1.0]), "invented")
    parent = replace(rigid, constants=rigid.constants.replace(A=rigid.constants["A"] * 1.2))
    item = isotopologue(parent, "H=2H").top
    bare = Top.from_molecule(item.molecule)
    assert item.constants["A"] == pytest.approx(bare.constants["B"] * 1.2, rel=1e-12)
    theirs = np.array(bare.polarizability_abc_angstrom3)[np.ix_((1, 0, 2), (1, 0, 2))]
    assert np.abs(item.polarizability_abc_angstrom3) == pytest.approx(np.abs(theirs), abs=1e-12)  # round-off of a turn
    assert np.diag(theirs)[0] != pytest.approx(np.diag(theirs)[1], rel=0.1)
    assert item.constants.rigid == tuple(sorted(item.constants.rigid, reverse=True))
    assert [abs(mu) for mu in item.dipole_abc_debye] == pytest.approx(
        [abs(bare.dipole_abc_debye[i]) for i in (1, 0, 2)]
    )
    assert np.linalg.det(item.frame.axes) == pytest.approx(1.0)
    assert any("changed the order" in note for note in item.notes)


@pytest.mark.parametrize(
    ("name", "changes", "kind", "degrees"),
    [("CH4", "2=2H", "prolate", 0.0), ("C6H6", "H=2H", "oblate", 0.0), ("C6H6", "7=2H", "asymmetric", 0.0),
     ("NH3", "2=2H", "asymmetric", 9.06), ("NH3", "H=2H", "oblate", 0.0), ("CH3CN", "4=2H", "asymmetric", 1.82),
     ("CO", "1=13C", "linear", 0.0)],
)  # fmt: skip
def test_free_axes_do_not_count_as_turned(name, changes, kind, degrees):
    """Of NH2D the axis nearest to C3 is 9.06° off it, wherever a and b of NH3 were put."""
    item = isotopologue(rotor.read(name), changes)
    assert item.top.kind == kind
    assert item.turned_degrees == pytest.approx(degrees, abs=0.01)
    assert not any("doubtful" in note for note in item.top.notes)


def test_the_frame_of_the_input_has_no_bearing():
    from scipy.spatial.transform import Rotation

    molecule = g2_molecule("CH3Cl")
    turned = molecule.moved(Rotation.random(rng=np.random.default_rng(3)).as_matrix(), (1, 2, 3))
    for here, there in zip(
        *(isotopologues(Top.from_molecule(m), min_abundance=1e-5) for m in (molecule, turned)), strict=True
    ):
        assert (here.label, here.axes) == (there.label, there.axes)
        assert here.turned_degrees == pytest.approx(there.turned_degrees, abs=1e-5)
        assert here.top.constants.rigid == pytest.approx(there.top.constants.rigid, rel=1e-9)  # round-off


def test_a_dipole_given_by_hand_turns_along():
    parent = rotor.read("water").with_dipole((0.0, 2.0, 0.0), "given")
    hdo = isotopologue(parent, "2=2H").top
    assert np.hypot(*hdo.dipole_abc_debye[:2]) == pytest.approx(2.0, rel=1e-12)  # a turn keeps its length
    assert hdo.dipole_source == "given"


# The command line


def test_the_family_of_water(capsys):
    assert run(["isotopologues", "water"]) == 0
    out, err = capsys.readouterr()
    assert [line.split()[0] for line in out.split("\n\n")[0].splitlines()[2:]] == [
        "H2O",
        "H2[18O]",
        "H2[17O]",
        "H[2H]O",
    ]
    assert "21.12" in out
    assert "note: H[2H]O (2=2H): no distortion constants" in err


def test_json_and_what_is_asked_for(capsys, tmp_path):
    options = ["--each", "H=2H", "--site", "2=2H", "--site", "3=2H", "--json"]
    assert run(["isotopologues", "water", *options, "-"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert [variant["label"] for variant in content["isotopologues"]] == ["H[2H]O (2=2H)", "[2H]2O (2=2H,3=2H)"]
    assert content["isotopologues"][0]["arrangements"] == 2
    assert run(["isotopologues", "water", *options, str(tmp_path / "w.json")]) == 0
    assert json.loads((tmp_path / "w.json").read_text())["isotopologues"] == content["isotopologues"]


@pytest.mark.parametrize(
    ("options", "words"),
    [(["--each", "O18"], "--each: 'O18'"), (["--each", "N=15N"], "--each: element 'N'"), (["--site", "9=2H"], "--site: atom 9"),
     (["--min-abundance", "2"], "--min-abundance: least abundance 2")],
)  # fmt: skip
def test_mistakes_on_the_command_line(capsys, options, words):
    assert run(["isotopologues", "water", *options]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert words in err


def test_natural_isotopes_add_up():
    for symbol in ("H", "C", "O", "Cl", "Sn", "Xe"):
        parts = [natural_isotope.abundance for natural_isotope in natural_isotopes(symbol)]
        assert parts == sorted(parts, reverse=True)
        assert sum(parts) == pytest.approx(1, abs=2e-4)  # rounding of the tables
        assert natural_isotopes(symbol)[0] == isotope(symbol)


def test_ten_thousand_atoms_get_a_clear_word():
    side = np.stack(np.meshgrid(*[np.arange(22.0)] * 3), -1).reshape(-1, 3)[:10_000]
    crowd = Molecule(("C",) * 10_000, 1.5 * side + np.random.default_rng(0).normal(scale=0.1, size=side.shape))
    with pytest.raises(ValueError, match="no isotopologue of C10000"):
        isotopologues(Top.from_molecule(crowd))


@pytest.mark.parametrize("path", sorted((data_folder() / "molecules").glob("*.toml")), ids=lambda path: path.stem)
def test_every_molecule_of_the_library_has_a_family(path):
    family = isotopologues(rotor.read(path), min_abundance=3e-3)
    assert sum(item.abundance for item in family) <= 1 + 1e-9
    usual = next(
        item.top for item in family if not item.substituted
    )  # not the first for CCl4: C 35Cl3 37Cl is commoner
    for item in family:
        a, b, c = item.top.rotational_constants_mhz
        assert a >= b >= c > 0
        assert item.top.spin_weights.mean > 0
        ratio = np.divide(item.top.rotational_constants_mhz[1:], usual.rotational_constants_mhz[1:])
        assert (
            (ratio > 0.9) & (ratio < 1.0 + 1e-9)
        ).all()  # one or two heavier atoms slow it down, by less than a tenth


@pytest.mark.parametrize(
    ("changes", "weights"),
    [
        ("O=16O", {"even": 0, "odd": 1}),
        ("O=18O", {"even": 0, "odd": 1}),
        ("O=17O", {"even": 7, "odd": 5}),  # (I+1) : I with I = 5/2; fermions, and the sign of the electrons
        ("1=18O", {}),
        ("1=17O", {}),
    ],
)
def test_isotopologues_of_oxygen_keep_its_odd_electronic_state(changes, weights):
    """Of 16O2 and 18O2 odd N alone; of 17O2 both, the other way round than in a closed shell; of mixed ones every N."""
    assert isotopologue(rotor.read("O2"), changes).top.spin_weights.to_mapping() == weights
    assert rotor.read("O2", isotopes=changes).spin_weights.to_mapping() == weights


def test_two_atoms_of_a_triplet_ground_state_are_taken_in_it_and_say_so():
    """O2, S2 and Si2 have the ground state 3Σg-, N2 and C2 1Σg+; even N does not exist in 16O2 and 32S2."""
    for element, weights in {"O": (0, 1), "S": (0, 1), "Si": (0, 1), "C": (1, 0)}.items():
        top = Top.from_molecule(Molecule((element, element), [[0, 0, 0], [0, 0, 1.5]]))
        assert tuple(top.spin_weights.to_mapping().values()) == weights
        assert any("ground state 3Σg-" in note for note in top.notes) == (weights == (0, 1))
        assert top.molecule.multiplicity == (3 if weights == (0, 1) else None)
    assert rotor.read("S2").spin_weights.to_mapping() == {"even": 0, "odd": 1}
    singlet = Molecule(("O", "O"), [[0, 0, 0], [0, 0, 1.2156]], multiplicity=1)
    assert (singlet.electronic, singlet.notes) == ("even", ())
    assert Molecule(("O", "S"), [[0, 0, 0], [0, 0, 1.48]]).electronic == "even"  # nothing exchanges its nuclei
    pair = Atoms("O2", [[0, 0, 0], [0, 0, 1.2075]])
    assert (
        rotor.thermo(pair, pressure_bar=1, temperatures_k=[300])
        .facts()["electronic"]
        .startswith("electronic degeneracy 3 ")
    )


def test_a_geometry_alone_is_taken_for_a_closed_shell_and_says_so():
    pair = Molecule(("O", "O"), [[0, 0, 0], [0, 0, 1.2075]], electronic="even")
    closed, odd = Top.from_molecule(pair), Top.from_molecule(replace(pair, electronic="odd"))
    assert closed.spin_weights.to_mapping() == {"even": 1, "odd": 0}
    assert "closed shell" in closed.weights_source
    assert odd.spin_weights.to_mapping() == {"even": 0, "odd": 1}
    assert "change in sign" in odd.weights_source
    ion = Top.from_molecule(replace(pair, charge=1))
    assert "their number is odd" in ion.weights_source
    with pytest.raises(ValueError, match="electronic 'ungerade'"):
        replace(pair, electronic="ungerade")


@pytest.mark.parametrize(("name", "changes"), [("water", "1=18O"), ("H2CO", "1=18O"), ("HCOOH", "1=13C")])
def test_axes_that_keep_their_order_have_no_note_of_another(name, changes):
    top = isotopologue(rotor.read(name), changes).top
    assert any("scaled" in note for note in (*top.notes, top.source))
    assert not any("changed the order" in note for note in top.notes)
