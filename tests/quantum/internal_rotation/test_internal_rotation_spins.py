"""Internal rotation with a nuclear spin, against the direct product |J K M⟩|m⟩|I M_I⟩ written out here."""

from collections import defaultdict

import numpy as np
import pytest
import qutip
from spherical_tensors import spherical, symbol

import rotor
from rotor.quantum.blocks.reduced import connections
from rotor.quantum.internal_rotation.hyperfine import coupled_blocks
from rotor.quantum.internal_rotation.levels import TorsionMoments, species_rotors
from rotor.quantum.internal_rotation.model import RamModel
from rotor.quantum.levels import placed
from rotor.quantum.operators.tensors import BodyTensor, spherical_components
from rotor.quantum.spins.scheme import Cosines, CosinesWithN, Scheme, Spin, SpinTerm
from rotor.tops.internal_rotation import InternalRotationConstants

CM = rotor.units.MHZ_PER_CM
CONSTANTS = {"A": 9000.0, "B": 4200.0, "C": 3100.0, "Dab": 700.0, "F": 5.2 * CM, "rho": 0.08, "V3": 40.0 * CM}
CHI = np.array([[-40.0, 25.0, 0.0], [25.0, 15.0, 0.0], [0.0, 0.0, 25.0]])  # MHz, along a, b, c
ROTATION = np.diag([30.0, -20.0, 10.0]) * 0.1  # C_gg, MHz
BODY = {  # components q = -1, 0, 1 of unit vectors with x, y, z = b, c, a
    "a": [0, 1, 0], "b": [1 / np.sqrt(2), 0, -1 / np.sqrt(2)], "c": [-1j / np.sqrt(2), 0, -1j / np.sqrt(2)],
}  # fmt: skip
JMAX, SPIN, WAVES = 2, 1, 3


def cosines(states, rank):
    """D^k*_pq between |J K M⟩ = ⟨J'K'M'|D^k*_pq|J K M⟩, all p and q, as (2k+1, 2k+1, n, n)."""
    n = len(states)
    out = np.zeros((2 * rank + 1, 2 * rank + 1, n, n))
    for r, (jj, kk, mm) in enumerate(states):
        for c, (j, k, m) in enumerate(states):
            if abs(jj - j) > rank:
                continue
            p, q = mm - m, kk - k
            if abs(p) <= rank and abs(q) <= rank:
                root = (-1) ** (mm - kk) * np.sqrt((2 * jj + 1) * (2 * j + 1))
                out[p + rank, q + rank, r, c] = root * symbol(jj, rank, j, -mm, p, m) * symbol(jj, rank, j, -kk, q, k)
    return out


def torsion_rotation(sigma, constants, waves=WAVES):
    """The functions |J K M⟩ with J ≤ 2, the components of P along a, b, c over them, and H over |J K M⟩|m⟩."""
    states = [(j, k, m) for j in range(JMAX + 1) for k in range(-j, j + 1) for m in range(-j, j + 1)]
    n = len(states)
    raising, along = np.zeros((n, n)), np.diag([float(k) for _, k, _ in states])
    for c, (j, k, m) in enumerate(states):
        if k < j:
            raising[states.index((j, k + 1, m)), c] = np.sqrt(j * (j + 1) - k * (k + 1))
    pa, pb, pc = along.astype(complex), (raising + raising.T) / 2, 0.5j * (raising - raising.T)

    m = 3.0 * np.arange(-waves, waves + 1) + sigma
    p, one = np.diag(m), np.eye(len(m))
    cos3 = (np.eye(len(m), k=1) + np.eye(len(m), k=-1)) / 2
    c = constants
    rotation = c["A"] * pa @ pa + c["B"] * pb @ pb + c["C"] * pc @ pc + c["Dab"] * (pa @ pb + pb @ pa)
    rotation = rotation + c.get("Dac", 0.0) * (pa @ pc + pc @ pa) + c.get("Dbc", 0.0) * (pb @ pc + pc @ pb)
    slip = np.kron(np.eye(n), p) - c["rho"] * np.kron(pa, one)
    free = np.kron(rotation, one) + c["F"] * slip @ slip + np.kron(np.eye(n), c["V3"] / 2 * (one - cos3))
    return states, (pa, pb, pc), free


def direct_product(sigma, constants, chi):
    """Energies of all states with J ≤ 2, all M, all M_I."""
    states, (pa, pb, pc), free = torsion_rotation(sigma, constants)
    n, one = len(states), np.eye(2 * WAVES + 1)
    ix, iy, iz = (qutip.jmat(SPIN, axis).full() for axis in "xyz")
    spins = (ix, iy, iz)
    product = [[(a @ b + b @ a) / 2 - (SPIN * (SPIN + 1) / 3 * np.eye(len(ix)) if i == k else 0) for k, b in enumerate(spins)]
               for i, a in enumerate(spins)]  # fmt: skip
    of_spin = [part / (2 * SPIN * (2 * SPIN - 1)) for part in spherical(product)]
    order = [1, 2, 0]  # x, y, z = b, c, a
    of_body = spherical(chi[np.ix_(order, order)])
    coupling = np.zeros((n * len(ix),) * 2, dtype=complex)
    turned = cosines(states, 2)
    for space in range(-2, 3):
        tensor = sum(of_body[q + 2] * turned[space + 2, q + 2] for q in range(-2, 3))
        coupling += (-1) ** space * np.kron(tensor, of_spin[2 - space])
    vector = cosines(states, 1)
    spin_vector = [(ix - 1j * iy) / np.sqrt(2), iz, -(ix + 1j * iy) / np.sqrt(2)]
    for letter, component, value in zip("abc", (pa, pb, pc), np.diag(ROTATION), strict=True):
        for space in (-1, 0, 1):
            cosine = sum(BODY[letter][q + 1] * vector[space + 1, q + 1] for q in (-1, 0, 1))
            half = (cosine @ component + component @ cosine) / 2
            coupling += value * (-1) ** space * np.kron(half, spin_vector[1 - space])
    whole = np.kron(free, np.eye(len(ix)))
    lifted = np.einsum("aibk,cd->acibdk", coupling.reshape(n, len(ix), n, len(ix)), one).reshape(whole.shape)
    return np.linalg.eigvalsh(whole + lifted)


def coupled_levels(sigma, constants, chi):
    """Energies of all states, each as often as it has values of M."""
    ram = RamModel(constants)
    levels = ram.blocks(sigma, JMAX, count=2 * WAVES + 1, waves=WAVES).solve(ram.coefficients, 2 * WAVES)
    free = list(placed(species_rotors(TorsionMoments(levels, ram), 1)))
    scheme = Scheme((Spin("14N", 2 * SPIN),))
    terms = [
        (1.0, SpinTerm("chi", ("14N", "14N"), Cosines(tuple(map(tuple, chi.tolist()))))),
        (1.0, SpinTerm("C", ("14N",), CosinesWithN(tuple(map(tuple, ROTATION.tolist()))))),
    ]
    names = np.arange(sum(len(block.energies_mhz) for block in free))[:, None] * [1, 0, 0]
    solved = coupled_blocks(free, names, scheme, terms, range(0, 2 * JMAX + 3, 2))
    is_real = ram.has_plane and (sigma == 0 or not chi[:2, 2].any())
    assert all(np.iscomplexobj(block.vectors) != is_real for block in solved)
    return np.sort(np.concatenate([np.repeat(block.energies_mhz, block.twice_total + 1) for block in solved]))


@pytest.mark.parametrize("sigma", [0, 1])
@pytest.mark.parametrize(
    ("across", "chi_across"),
    [({}, 0.0), ({"Dac": 300.0, "Dbc": -150.0}, 1.0), ({}, 1.0)],
    ids=["plane", "none", "axis"],
)
def test_a_quadrupole_and_spin_rotation_beside_internal_rotation(sigma, across, chi_across):
    """With a mirror plane, without it, and without it where the axis of the top lies in a principal plane all the same."""
    chi = CHI + chi_across * np.array([[0, 0, 12], [0, 0, -7], [12, -7, 0]])
    ours, theirs = coupled_levels(sigma, CONSTANTS | across, chi), direct_product(sigma, CONSTANTS | across, chi)
    assert len(ours) == len(theirs)
    assert np.abs(ours - theirs).max() < 1e-6  # MHz; rounding of energies up to 2e7 MHz is 1e-7


@pytest.mark.parametrize("vector", [(1.5, 0.8, 0.6), (0.0, 0.0, 0.6)])
def test_a_dipole_across_the_plane_of_the_axis_has_the_strengths_of_the_direct_product(vector):
    """H has the symmetry of the plane that contains ρ; a molecule without this mirror has a dipole across it."""
    internal = InternalRotationConstants({n: CONSTANTS[n] for n in ("Dab", "F", "rho", "V3")}, "RAM", 1, 20)
    constants = rotor.Constants(**{n: CONSTANTS[n] for n in "ABC"}, reduction="A", representation="Ir")
    top = rotor.Top.from_constants(constants, dipole_abc_debye=vector, internal_rotation=internal)
    lines = rotor.line_list(top, jmax=JMAX, q=1.0, min_lgint=None)
    for sigma, species in enumerate("AE"):
        states, _, free = torsion_rotation(sigma, CONSTANTS, waves=10)
        energies, vectors = np.linalg.eigh(free)
        along_z = np.einsum("l,lq,qij->ij", vector, [BODY[letter] for letter in "abc"], cosines(states, 1)[1])
        moved = (along_z @ vectors.reshape(len(states), -1)).reshape(vectors.shape)
        squares = 3 * np.abs(vectors.conj().T @ moved) ** 2
        here = lines[(lines.levels.quanta["species"][lines.upper] == species) & (lines.strength_debye2 > 1e-8)]
        assert len(here) > 40
        for up, low, strength in zip(here.upper, here.lower, here.strength_debye2, strict=True):
            rows = [np.abs(energies - here.levels.energy_mhz[level]) < 1e-4 for level in (up, low)]
            expected = squares[np.ix_(*rows)].sum() * (1 + sigma)
            assert strength == pytest.approx(expected, rel=1e-5, abs=1e-7)


# Levels and lines of a top


SPINS = "chi_aa(14N)=-40 chi_bb-cc(14N)=-10 chi_ab(14N)=25 C_aa(14N)=0.3 C_bb(14N)=-0.2 MHz"


def turning_top(spins=SPINS, **others):
    values = {"F": 5.2 * CM, "rho": 0.0, "V3": 400.0 * CM}
    internal = InternalRotationConstants(values, "RAM", vt_max=0)
    constants = rotor.Constants(A=9000.0, B=4200.0, C=3100.0, reduction="A", representation="Ir")
    return rotor.Top.from_constants(
        constants, dipole_abc_debye=(1.5, 0.8, 0.0), spin_constants=spins, internal_rotation=internal
    )


@pytest.mark.parametrize("spins", [SPINS, SPINS.replace(" MHz", " chi_aa(35Cl)=-57 chi_bb-cc(35Cl)=-4 MHz")])
def test_without_coupling_to_the_rotation_both_species_have_the_hyperfine_structure_of_a_rigid_top(spins):
    """ρ = 0: torsion and rotation are apart, and every level and line of the other engine comes out in A and in E."""
    top = turning_top(spins)
    rigid = rotor.Top.from_constants(top.constants, dipole_abc_debye=(1.5, 0.8, 0.0), spin_constants=spins)
    lines, expected = (
        rotor.line_list(t, jmax=3, q=1.0, min_lgint=None, effects=rotor.effects_of(t, True)) for t in (top, rigid)
    )
    assert lines.levels.quanta_names == ("species", "vt", *expected.levels.quanta_names)
    quanta = expected.levels.quanta_names

    def strong(table, copies):
        """Frequency, strength and names of both levels of lines that symmetry does not forbid, by frequency."""
        table = table[table.strength_debye2 > 1e-6 * copies].sorted()
        names = [
            np.column_stack([table.levels.quanta[name][rows] for name in quanta]) for rows in (table.upper, table.lower)
        ]
        return table.frequency_mhz, table.strength_debye2 / copies, np.hstack(names)

    known = strong(expected, 1)
    for species, copies in (("A", 1), ("E", 2)):
        found = strong(lines[lines.levels.quanta["species"][lines.upper] == species], copies)
        assert len(found[0]) == len(known[0])
        assert np.abs(found[0] - known[0]).max() < 1e-5  # rounding of 1e7 MHz
        assert np.allclose(
            np.sort(found[1]), np.sort(known[1]), rtol=1e-4, atol=1e-6
        )  # levels a few Hz apart mix by rounding
        assert sorted(map(tuple, found[2].tolist())) == sorted(map(tuple, known[2].tolist()))


def strengths(levels, name, tensor):
    """Sums of squares of reduced elements by pairs of torsion-rotation levels."""
    keys = list(zip(*(levels.quanta[key].tolist() for key in ("species", "vt", name, "ka", "kc")), strict=True))
    pairs, between = connections(levels.blocks, {(0, 0): tensor})
    sums = defaultdict(float)
    for up, low in pairs:
        for (i, k), element in np.ndenumerate(between(up, low)):
            first, second = keys[up.start + i], keys[low.start + k]
            if first == second:
                copies = 1 if up is low else 2
            else:
                copies = 0.5 if up is low else 1
            sums[min(first, second), max(first, second)] += copies * abs(element) ** 2
    return sums


@pytest.mark.parametrize("body", [[1.5, 0.8, 0.0], [[3.0, 0.7, 0.0], [0.7, -1.0, 0.0], [0.0, 0.0, -2.0]]])
def test_a_spin_without_coupling_leaves_the_sum_of_strengths_of_a_vector_and_of_a_matrix(body):
    body = np.array(body)
    tensor = BodyTensor(body.ndim, tuple(spherical_components(body, body.ndim, "Ir").tolist()))
    top = turning_top("chi_aa(14N)=1e-3 chi_bb-cc(14N)=2e-4 MHz")
    plain, beside = (
        rotor.api.solve_levels(top, 2, effects=rotor.api.effects_of(top, spins)) for spins in (False, True)
    )
    expected, found = strengths(plain, "j", tensor), strengths(beside, "n", tensor)
    strong = [pair for pair, strength in expected.items() if strength > 1e-6 * max(expected.values())]
    assert len(strong) > 20
    assert [found[pair] for pair in strong] == pytest.approx([3 * expected[pair] for pair in strong], rel=1e-8)


def test_what_is_not_computed_beside_internal_rotation_is_refused():
    top = turning_top("chi_aa(14N)=-4 chi_aa_J(14N)=0.001 MHz")
    with pytest.raises(ValueError, match="chi_aa_J"):
        rotor.solve_levels(top, 1, effects=rotor.effects_of(top, True))
