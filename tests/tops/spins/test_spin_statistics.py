"""Spin weights: textbook ratios, an explicit sum over spin functions, catalogue degeneracies, the table of the docs."""

from __future__ import annotations

import importlib.util
import itertools
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from ase.collections import g2
from hypothesis import given, settings
from hypothesis import strategies as st
from places import PROJECT
from scipy.linalg import expm

import rotor
from rotor.formats.spcat.text.cat import read_cat
from rotor.molecules.molecule import Molecule
from rotor.molecules.symmetry.point_group import find_symmetry, molecule_symmetry
from rotor.tops.spins.spin_statistics import (
    character_rows,
    inverting_symmetry,
    spin_characters,
    spin_weights,
    statistical_weights,
)
from rotor.tops.spins.spin_weights import IRREPS, SpinWeights, irreps_in_j
from rotor.tops.top import Top

DOCS = PROJECT / "docs"
_SPEC = importlib.util.spec_from_file_location("make_spin_weights", DOCS / "make_spin_weights.py")
make_spin_weights = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(make_spin_weights)
SPECIES = {species.label: species for species in make_spin_weights.SPECIES}


def molecule(label: str) -> Molecule:
    return make_spin_weights.molecule_of(SPECIES[label])


def g2_molecule(name: str, isotopes: str = "") -> Molecule:
    isolated = Molecule(tuple(g2[name].get_chemical_symbols()), g2[name].positions)
    return isolated.with_isotopes(isotopes) if isotopes else isolated


# Ratios that textbooks give (Bunker and Jensen, chapter 8; Herzberg, Molecular Spectra and Molecular Structure II,
# chapters I and IV; Townes and Schawlow, chapters 3 and 4)

RATIOS = {
    "H2": {"even": 1, "odd": 3},
    "D2": {"even": 2, "odd": 1},
    "14N2": {"even": 2, "odd": 1},
    "16O2, X 3Σg-": {"even": 0, "odd": 1},
    "CO2": {"even": 1, "odd": 0},
    "16O12C18O": {},
    "H2O": {"ee": 1, "eo": 3, "oe": 3, "oo": 1},
    "HDO": {},
    "D2O": {"ee": 2, "eo": 1, "oe": 1, "oo": 2},
    "H2CO": {"ee": 1, "eo": 1, "oe": 3, "oo": 3},
    "SO2": {"ee": 1, "eo": 0, "oe": 0, "oo": 1},
    "C2H4": {"ee": 7, "eo": 3, "oe": 3, "oo": 3},
    "C2D4": {"ee": 3, "eo": 2, "oe": 2, "oo": 2},
    "CH3OCH3": {"ee": 7, "eo": 9, "oe": 9, "oo": 7},
    "CH3-35Cl": {"0": 2, "1": 1, "2": 1},
    "ND3": {"0": 11, "1": 8, "2": 8},
    "BF3": {"0even": 0, "0odd": 4, "1": 1, "2": 1},
    "SO3": {"0even": 1, "0odd": 0, "1": 0, "2": 0},
    "C6H6": {"0even": 14, "0odd": 6, "1": 11, "2": 9, "3": 14, "4": 9, "5": 11},
    "C6D6": {"0even": 184, "0odd": 76, "1": 116, "2": 124, "3": 119, "4": 124, "5": 116},
    "CH4": {"A": 5, "E": 2, "F": 3},
    "CD4": {"A": 5, "E": 4, "F": 6},
    "SF6": {"A1": 1, "A2": 5, "E": 4, "F1": 3, "F2": 3},
    "12C60": {"A": 1, "F1": 0, "F2": 0, "G": 0, "H": 0},
}


@pytest.mark.parametrize("label", RATIOS)
def test_textbook_ratios(label):
    assert statistical_weights(molecule(label), electronic=SPECIES[label].electronic).to_mapping() == RATIOS[label]


def test_all_the_spin_functions_of_13c60_are_counted():
    """Each irrep with its dimension: together 2^60, exactly, up to the divisor taken out."""
    weights = statistical_weights(molecule("13C60"))
    assert 2**60 % np.dot((1, 3, 3, 4, 5), weights.values) == 0


def test_benzene_by_levels():
    """Pairs ±K weigh 10, 11, 9, 14 for |K| = 6p, 6p±1, 6p±2, 6p+3; K = 0 weighs 7 and 3, J even and odd."""
    weights = statistical_weights(molecule("C6H6"))
    assert weights.symmetric_weights(7, np.arange(1, 8)).tolist() == [2 * w for w in (11, 9, 14, 9, 11, 10, 11)]
    assert weights.symmetric_weights([4, 5], [0, 0]).tolist() == [14, 6]


def test_states_of_an_inverting_molecule():
    """NH3: J even, K = 0 only in the upper state; NH2D: 1:3 turns to 3:1 (Townes and Schawlow, chapter 12)."""
    ammonia, partly = molecule("NH3"), molecule("NH2D, lower of the doublet")
    assert statistical_weights(ammonia, inversion="symmetric").to_mapping() == {"0even": 0, "0odd": 4, "1": 1, "2": 1}
    assert statistical_weights(ammonia, inversion="antisymmetric").to_mapping() == {
        "0even": 4,
        "0odd": 0,
        "1": 1,
        "2": 1,
    }
    assert statistical_weights(partly, inversion="symmetric").to_mapping() == {"ee": 1, "eo": 1, "oe": 3, "oo": 3}
    assert statistical_weights(partly, inversion="antisymmetric").to_mapping() == {"ee": 3, "eo": 3, "oe": 1, "oo": 1}


@settings(max_examples=20)
@given(label=st.sampled_from(["NH3", "PH3", "ND3"]), j=st.integers(0, 9))
def test_both_states_of_the_doublet_add_up_to_the_unresolved_one(label, j):
    k = np.arange(j + 1)
    pair = [
        statistical_weights(molecule(label), inversion=state).symmetric_weights(j, k)
        for state in make_spin_weights.STATES
    ]
    whole = statistical_weights(molecule(label)).symmetric_weights(j, k)
    total = pair[0] + pair[1]
    assert np.array_equal(total * whole[0], whole * total[0])


# An explicit sum over spin functions, which knows neither cycles nor characters


def spin_operators(permutation, spins):
    """The matrix that carries products of spin functions m_1 ... m_n to permuted ones, with the fermions' sign."""
    ranges = [range(round(2 * spin) + 1) for spin in spins]
    functions = list(itertools.product(*ranges))
    place = {function: row for row, function in enumerate(functions)}
    fermions = [atom for atom, spin in enumerate(spins) if round(2 * spin) % 2]
    swaps = sum(permutation[a] > permutation[b] for a, b in itertools.combinations(fermions, 2))
    matrix = np.zeros((len(functions), len(functions)))
    for column, function in enumerate(functions):
        moved = [0] * len(function)
        for atom, value in enumerate(function):
            moved[permutation[atom]] = value
        matrix[place[tuple(moved)], column] = (-1) ** swaps
    return matrix


def angular_momentum(j):
    """Jx, Jy, Jz of the 2J+1 functions |J k>."""
    k = np.arange(-j, j + 1)
    up = np.diag(np.sqrt(j * (j + 1) - k[:-1] * (k[:-1] + 1)), -1)
    return (up + up.T) / 2, (up - up.T) / 2j, np.diag(k).astype(complex)


def moments(symmetry) -> np.ndarray:
    """Moments of inertia without the last digits, in which g2's symmetric tops are not quite symmetric."""
    return np.round(symmetry.moments_u_angstrom2, 3)


def brute_force_weights(molecule_: Molecule, jmax: int, electronic: str = "even") -> list[tuple[float, int, int, int]]:
    """(energy, J, number of components, number of allowed spin-rotation functions) of each rigid-rotor level.

    Rotational functions of one energy times all products of spin functions; those kept by the projector on what
    every rotation with its permutation leaves alike are counted by its rank.
    """
    symmetry = molecule_symmetry(molecule_)
    spins = [nucleus.spin for nucleus in molecule_.nuclei if nucleus.spin]
    atoms = [atom for atom, nucleus in enumerate(molecule_.nuclei) if nucleus.spin]
    rank_of = {atom: rank for rank, atom in enumerate(atoms)}
    constants = 1 / np.maximum(moments(symmetry), 1e-9)
    turns = []
    for turn in symmetry.rotations:
        permutation = [rank_of[int(turn.permutation[atom])] for atom in atoms]
        state = -1 if electronic == "odd" and turn.order == 2 else 1
        vector = turn.angle * symmetry.axes_abc @ turn.axis
        turns.append((vector, state * spin_operators(permutation, spins)))

    levels = []
    for j in range(jmax + 1):
        components = angular_momentum(j)
        if symmetry.linear:
            energies, vectors = np.array([float(j)]), np.linalg.eigh(components[0])[1][:, [j]]  # no momentum along a
        else:
            energies, vectors = np.linalg.eigh(sum(c * p @ p for c, p in zip(constants, components, strict=True)))
        for level in np.split(np.arange(len(energies)), np.flatnonzero(np.diff(energies) > 1e-11) + 1):
            eigenvectors = vectors[:, level]
            projector = sum(
                np.kron(
                    eigenvectors.conj().T
                    @ expm(-1j * np.einsum("i,ijk->jk", vector, np.array(components)))
                    @ eigenvectors,
                    spin,
                )
                for vector, spin in turns
            ) / len(turns)
            assert np.allclose(projector @ projector, projector, atol=1e-6)  # g2's rounded axes are good to 1e-6
            levels.append((float(energies[level[0]]), j, len(level), round(np.trace(projector).real)))
    return levels


def predicted(molecule_: Molecule, levels, electronic: str = "even") -> list[int]:
    """What the weights say of the same levels: asymmetric in order of energy, symmetric by K, spherical by J."""
    weights, symmetry = statistical_weights(molecule_, electronic=electronic), molecule_symmetry(molecule_)
    if symmetry.linear:
        return [int(weights.linear_weights(j)) for _, j, _, _ in levels]
    kinds = len(set(moments(symmetry).tolist()))
    if kinds == 1:
        return [int(weights.spherical_weights(j)) for _, j, _, _ in levels]
    out = []
    for j in sorted({level[1] for level in levels}):
        if kinds == 2:
            oblate = bool(np.diff(moments(symmetry))[0] == 0)
            k = np.arange(j, -1, -1) if oblate else np.arange(j + 1)
            out += weights.symmetric_weights(j, k, oblate).tolist()
        else:
            labels = [((tau + 1) // 2, j - tau // 2) for tau in range(2 * j + 1)]
            out += [weights.asymmetric_weight("eo"[ka % 2] + "eo"[kc % 2]) for ka, kc in labels]
    return out


@pytest.mark.parametrize(
    ("label", "jmax"),
    [
        ("H2", 4),
        ("14N2", 4),
        ("16O2, X 3Σg-", 4),
        ("CO2", 4),
        ("H2O", 4),
        ("D2O", 3),
        ("CH2, X 3B1", 3),
        ("H2CO", 4),
        ("SO2", 4),
        ("H2O2", 3),
        ("C2H4", 4),
        ("N2O4", 3),
        ("allene", 4),
        ("NH3", 4),
        ("CH3-35Cl", 4),
        ("BF3", 4),
        ("SO3", 4),
        ("XeF4", 4),
        ("C6H6", 6),
        ("CH4", 6),
        ("SF6", 4),
    ],
)
def test_against_the_sum_over_all_spin_functions(label, jmax):
    electronic = SPECIES[label].electronic
    levels = brute_force_weights(molecule(label), jmax, electronic)
    counted, said = [level[-1] for level in levels], predicted(molecule(label), levels, electronic)
    ratio = max(counted) / max(said)
    assert counted == [round(ratio * w) for w in said]


# Algebra


@settings(max_examples=40)
@given(label=st.sampled_from([s for s in SPECIES if not SPECIES[s].inversion and "C60" not in s]), j=st.integers(0, 40))
def test_all_levels_of_one_j_hold_the_right_number_of_spin_functions(label, j):
    """Σ over levels of the weight = Σ_R χ_J(R) f(R) / Σ 1, whatever the rule, up to the divisor taken out."""
    species, sample = SPECIES[label], molecule(label)
    symmetry = molecule_symmetry(sample)
    f = spin_characters(symmetry, [nucleus.spin for nucleus in sample.nuclei], species.electronic)
    weights = statistical_weights(sample, electronic=species.electronic)

    def allowed(jj):
        if symmetry.linear:
            return (f[0] + sum(f[1:]) * (-1) ** jj) / len(f)
        turns = [r.angle / 2 for r in symmetry.rotations]
        chi = [2 * jj + 1 if t == 0 else np.sin((2 * jj + 1) * t) / np.sin(t) for t in turns]
        return float(np.dot(chi, f)) / len(f)

    def counted(jj):
        k = np.arange(jj + 1)
        if symmetry.linear:
            return int(weights.linear_weights(jj))
        if weights.rule == "KaKc":
            labels = [((tau + 1) // 2, jj - tau // 2) for tau in range(2 * jj + 1)]
            assert weights.symmetric_weights(jj, k).sum() == weights.symmetric_weights(jj, k, oblate=True).sum()
            return sum(weights.asymmetric_weight("eo"[ka % 2] + "eo"[kc % 2]) for ka, kc in labels)
        return int(weights.spherical_weights(jj) if weights.rule == "irrep" else weights.symmetric_weights(jj, k).sum())

    reference = next(jj for jj in range(8) if counted(jj))
    assert counted(j) * allowed(reference) == pytest.approx(allowed(j) * counted(reference), rel=1e-9)  # round-off
    means = [counted(jj) / (1 if symmetry.linear else 2 * jj + 1) for jj in (359, 360)]
    assert weights.mean == pytest.approx(np.mean(means), rel=0.01)  # what is left falls as 1/J


@pytest.mark.parametrize(("group", "dimensions"), [("T", (1, 2, 3)), ("O", (1, 1, 2, 3, 3)), ("I", (1, 3, 3, 4, 5))])
def test_irreps_fill_every_j(group, dimensions):
    j = np.arange(200)
    assert np.array_equal(np.dot(dimensions, irreps_in_j(j, IRREPS[group])), 2 * j + 1)


@settings(max_examples=25)
@given(
    label=st.sampled_from(["H2O", "C2H4", "allene", "BF3", "C6H6", "CH4", "H2O2", "NH3, lower of the doublet"]),
    seed=st.integers(0, 2**32 - 1),
)
def test_rotation_shift_and_order_of_atoms_change_no_weight(label, seed):
    rng = np.random.default_rng(seed)
    sample, order = molecule(label), rng.permutation(len(molecule(label).symbols))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    moved = sample.moved(turn * np.linalg.det(turn), rng.normal(size=3))
    mixed = Molecule(
        tuple(sample.symbols[i] for i in order),
        moved.positions_angstrom[order],
        tuple(sample.mass_numbers[i] for i in order),
    )
    inversion = SPECIES[label].inversion
    assert statistical_weights(mixed, inversion=inversion) == statistical_weights(sample, inversion=inversion)


# An accidental symmetric top keeps its asymmetric-top weights (and the same for a sphere)


def square_f2o(height_ratio: float) -> Molecule:
    """An AB2 shape with a chosen ratio of its two smaller moments: O at distance h from the F-F line of length 2w."""
    mass_o, mass_f, w = 15.99491462, 18.99840316, 1.1
    reduced = mass_o * 2 * mass_f / (mass_o + 2 * mass_f)
    h = np.sqrt(height_ratio * 2 * mass_f * w**2 / reduced)
    return Molecule(("O", "F", "F"), [[0, h, 0], [w, 0, 0], [-w, 0, 0]])


def test_accidental_symmetric_top_keeps_its_weights():
    """F2O with I_a = I_b by numbers: an oblate top whose levels K = Kc weigh what eo + oe, ee + oo do."""
    accidental, plain = square_f2o(1.0), square_f2o(0.5)
    assert Top.from_molecule(accidental).kind == "oblate"
    assert molecule_symmetry(accidental).rotation_group == "C2"
    weights = statistical_weights(accidental)
    assert weights.rule == statistical_weights(plain).rule == "KaKc"
    assert sorted(weights.values) == [1, 1, 3, 3]
    assert weights.symmetric_weights(3, np.arange(4), oblate=True).tolist() == [3, 4, 4, 4]
    assert weights.symmetric_weights(2, np.arange(3), oblate=True).tolist() == [1, 4, 4]


def test_accidental_sphere_keeps_its_weights():
    """By K modulo 3 and by parities, J = 1: 0, ±1 of CH3Cl; 1_01, 1_11, 1_10 of H2O."""
    assert statistical_weights(molecule("CH3-35Cl")).spherical_weights([0, 1]).tolist() == [2, 4]
    assert statistical_weights(molecule("H2O")).spherical_weights([0, 1]).tolist() == [1, 7]


def test_weights_follow_the_axis_that_the_isotopes_leave():
    """C2H4: D2 to C2(a) in CH2CD2, to nothing in C2H3D; hard case 13."""
    ethene = g2_molecule("C2H4")
    hydrogens = [i + 1 for i, symbol in enumerate(ethene.symbols) if symbol == "H"]
    places = ethene.positions_angstrom[np.array(hydrogens) - 1]
    geminal = hydrogens[int(np.argsort(np.linalg.norm(places - places[0], axis=1))[1])]
    assert statistical_weights(ethene.with_isotopes({hydrogens[0]: "2H"})).rule == "none"
    pair = statistical_weights(ethene.with_isotopes({hydrogens[0]: "2H", geminal: "2H"})).to_mapping()
    assert pair == {"ee": 5, "eo": 5, "oe": 7, "oo": 7}  # f = 2²·3² = 36 and -2·3 = -6 about a: 15 and 21


# Catalogues: GUP = weight × (2J+1), or (2F+1), level by level

CATALOGUES = {  # tag: g2 name or a linear chain, isotopes
    "018003": ("H2O", ""), "019002": ("H2O", "2=2H"), "020003": ("H2O", "O=18O"), "027501": ("HCN", ""),
    "028001": ("CO", ""), "028503": ("CO", ""), "030501": ("H2CO", ""), "031503": ("H2CO", "C=13C"),
    "032503": ("H2CO", "O=18O"), "034502": ("SH2", ""), "036504": ("SH2", "S=34S"), "040502": ("C3H4_C3v", ""),
    "041001": ("CH3CN", ""), "042501": ("H2CCO", ""), "042509": ("CH3CN", "2=13C"), "042510": ("CH3CN", "N=15N"),
    "043505": ("H2CCO", "2=13C"), "043506": ("H2CCO", "1=13C"), "044504": ("CH2OCH2", ""),
    "046506": ("HCOOH", ""), "048001": ("SO", ""), "050007": ("CH3Cl", ""), "060503": ("OCS", ""),
    "061502": ("OCS", "C=13C"), "061503": ("OCS", "S=33S"), "061504": ("OCS", "O=17O"), "062505": ("OCS", "S=34S"),
    "062506": ("OCS", "O=18O"), "064502": ("SO2", ""), "066501": ("SO2", "S=34S"),
    "045512": ("formamide", ""), "051501": ("HC3N", ""), "052508": ("HC3N", "H=2H"), "052509": ("HC3N", "2=13C"),
    "052510": ("HC3N", "3=13C"), "052511": ("HC3N", "4=13C"), "052512": ("HC3N", "N=15N"),
    "060501": ("glycolaldehyde", ""),
}  # fmt: skip
TYPED = {  # geometries that g2 lacks, Å: CCCBDB release 22
    "HC3N": ("HCCCN", [[0, 0, 0], [0, 0, 1.058], [0, 0, 2.263], [0, 0, 3.641], [0, 0, 4.800]]),
    "formamide": (
        "COHNHH",
        [
            *([0, 0.4165, 0], [1.1942, 0.2217, 0], [-0.4299, 1.4182, 0]),
            *([-0.9373, -0.5551, 0], [-0.6608, -1.5171, 0], [-1.902, -0.2881, 0]),
        ],
    ),
}


def geometry(name: str, isotopes: str) -> Molecule:
    if name == "glycolaldehyde":  # g2 lacks it; the library has a geometry made from SMILES
        return rotor.read(name).molecule
    if name not in TYPED:
        return g2_molecule(name, isotopes)
    symbols, positions = TYPED[name]
    sample = Molecule(tuple(symbols), positions)
    return sample.with_isotopes(isotopes) if isotopes else sample


def weight_per_level(molecule_: Molecule, quanta) -> np.ndarray:
    """Predicted weight, both signs of K together, of levels with the quanta of a catalogue."""
    weights, j = statistical_weights(molecule_), quanta[:, 0].astype(int)
    if weights.rule == "KaKc":
        parity = [f"{'eo'[ka % 2]}{'eo'[kc % 2]}" for ka, kc in quanta[:, 1:3].tolist()]
        return np.array([weights.asymmetric_weight(species) for species in parity])
    if weights.rule == "K":
        return weights.symmetric_weights(j, np.abs(quanta[:, 1]).astype(int))
    return np.ones(len(j), dtype=np.int64)


@pytest.mark.oracle
@pytest.mark.parametrize("tag", CATALOGUES)
def test_degeneracies_of_catalogues(shared: Path, tag: str):
    """GUP over (2J+1), or (2F+1), is the predicted weight times one number for the whole catalogue."""
    catalogue = read_cat(shared / f"reference/catalogues/c{tag}.cat.gz")
    form = set(catalogue.qnfmt.tolist())
    both = np.abs(np.column_stack([catalogue.quanta_upper, catalogue.quanta_lower]))
    states, line = np.unique(both, axis=0, return_inverse=True)
    g_upper = np.bincount(line.ravel(), weights=catalogue.g_upper)  # ±K listed apart, six lines of CH3Cl, put together

    upper = states[:, : states.shape[1] // 2]
    last = {213: 2, 102: 1}.get(next(iter(form)), 0)  # J K F with F rounded up from a half; N J; J first otherwise
    degeneracy = g_upper / (2 * upper[:, last] + (0 if last == 2 else 1))
    ratio = degeneracy / weight_per_level(geometry(*CATALOGUES[tag]), upper)
    assert len(form) == 1
    assert len(ratio) >= 90
    assert np.ptp(ratio) < 1e-12, Counter(np.round(ratio, 3).tolist()).most_common(4)  # whole numbers divided


@pytest.mark.oracle
def test_no_catalogue_is_left_out(shared: Path):
    files = {path.name[1:7] for path in (shared / "reference/catalogues").glob("c*.cat.gz")}
    assert files == set(CATALOGUES)


# The page of the docs


def test_table_of_the_docs_is_what_the_code_gives():
    assert (DOCS / "spin_weights.md").read_text(encoding="utf-8") == make_spin_weights.page()
    assert len(make_spin_weights.SPECIES) >= 40


def test_rows_of_characters():
    rows = character_rows(molecule_symmetry(molecule("CH4")), [nucleus.spin for nucleus in molecule("CH4").nuclei])
    assert [(r.rotation, r.count, r.character) for r in rows] == [("E", 1, 16), ("C2", 3, 4), ("C3", 8, 4)]
    assert rows[2].cycles == ((0.0, 1, 1), (0.5, 1, 1), (0.5, 3, 1))


# What is refused


def test_mistakes_are_told():
    water, ammonia = molecule("H2O"), molecule("NH3")
    computed, ethylene = molecule_symmetry(water), molecule_symmetry(molecule("C2H4"))
    for call, message in [
        (lambda: spin_weights(computed, [0, 0.5]), "2 spins for 3 nuclei"),
        (lambda: spin_weights(computed, [0, 0.4, 0.4]), "multiples of 1/2"),
        (lambda: spin_weights(computed, [0, 0.5, 1]), "give both the same"),
        (lambda: spin_weights(computed, [0, 0.5, 0.5], "Sigma"), "'even', 'odd' for C2"),
        (lambda: spin_weights(ethylene, [0, 0, *[0.5] * 4], "odd"), "4 characters"),
        (lambda: spin_weights(ethylene, [0, 0, *[0.5] * 4], [1, -1, -1, -1]), "multiply like the rotations"),
        (lambda: statistical_weights(ammonia, inversion="up"), "'symmetric' or 'antisymmetric'"),
        (lambda: statistical_weights(ammonia, inversion="symmetric", electronic="odd"), "leave `electronic`"),
        (lambda: statistical_weights(water, inversion="symmetric"), "flat within"),
        (lambda: statistical_weights(g2_molecule("C2H6"), inversion="symmetric"), "no plane to invert"),
        (lambda: statistical_weights(g2_molecule("CH4"), inversion="symmetric"), "no plane to invert"),
        (lambda: statistical_weights(g2_molecule("H2CCl2"), inversion="symmetric"), "nuclei meet"),
    ]:
        with pytest.raises(ValueError, match=message):
            call()


def test_characters_given_by_hand():
    """O2 as by "odd"; the states of C2H4 that change sign under two half turns move 7 from ee to another species."""
    oxygen = find_symmetry("OO", [16.0, 16.0], [[0, 0, 0], [0, 0, 1.2]])
    assert spin_weights(oxygen, [0, 0], [1, -1]) == spin_weights(oxygen, [0, 0], "odd")

    ethylene = molecule_symmetry(molecule("C2H4"))
    spins = [nucleus.spin for nucleus in molecule("C2H4").nuclei]
    sevens = set()
    for signs in ([1, 1, -1, -1], [1, -1, 1, -1], [1, -1, -1, 1]):
        weights = spin_weights(ethylene, spins, signs).to_mapping()
        assert sorted(weights.values()) == [3, 3, 3, 7]
        sevens.add(max(weights, key=weights.get))
    assert sevens == {"eo", "oe", "oo"}


@pytest.mark.parametrize("weights", [(1, 1, 3, 3), (1, 3, 1, 3), (1, 3, 3, 1), (7, 3, 2, 1)])
def test_pairs_of_a_symmetric_top_by_numbers_add_up_its_asymmetric_levels(weights):
    """K is Ka in a prolate, Kc in an oblate top; the other label of the pair takes both parities."""
    by_parity = SpinWeights("KaKc", ("ee", "eo", "oe", "oo"), weights)
    for j in range(6):
        labels = [((tau + 1) // 2, j - tau // 2) for tau in range(2 * j + 1)]
        for oblate in (False, True):
            sums = [0] * (j + 1)
            for ka, kc in labels:
                sums[kc if oblate else ka] += by_parity.asymmetric_weight("eo"[ka % 2] + "eo"[kc % 2])
            assert by_parity.symmetric_weights(j, np.arange(j + 1), oblate).tolist() == sums


def test_too_many_spins_to_add_up_are_told():
    many = SpinWeights("J", ("even", "odd"), (2**60, 2**60 + 1))
    with pytest.raises(ValueError, match="use none"):
        many.linear_weights(3)


def test_rules_are_told_by_their_classes():
    assert SpinWeights.from_mapping({"0even": 0, "0odd": 8, "1": 2, "2": 2}).values == (0, 4, 1, 1)
    assert SpinWeights.from_mapping({"A": 5, "F1": 1, "F2": 1, "G": 2, "H": 3}).rule == "irrep"
    with pytest.raises(ValueError, match="no rule has these classes"):
        SpinWeights.from_mapping({"0even": 1, "1": 1, "2": 1})


def test_inverting_symmetry_keeps_the_rigid_rotations():
    ammonia = molecule("NH3")
    flat, signs = inverting_symmetry("NHHH", ammonia.masses_u, ammonia.positions_angstrom)
    assert (flat.point_group, sum(signs), len(signs)) == ("D3h", 0, 6)
