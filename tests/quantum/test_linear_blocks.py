"""The linear block Hamiltonian against the other engines of the package, and its algebra against closed forms.

Two solvers of the same matrix differ by round-off: 32 eps of the norm of a block, which the largest energy bounds from below.
"""

from functools import reduce

import numpy as np
import pytest
from coupled_spaces import Space, coupled, spin_space
from field_matrices import contracted_vectors, states
from linear_functions import (
    NEGLIGIBLE,
    RealFunctions,
    contracted,
    energies_of,
    flat_elements,
    ket_bra,
    linear_blocks_of_coupled,
    product,
    slopes_of,
    states_of,
    with_real_phases,
)
from plain_tensors import symmetric_top_elements

import rotor
from rotor import units
from rotor.quantum.basis.labelled import Basis, rotation_labels
from rotor.quantum.blocks.connected import connected_blocks, linear_blocks
from rotor.quantum.blocks.linear_stacks import LinearBlock
from rotor.quantum.effects.watson import operators_by_name
from rotor.quantum.operators.algebra import UNIT, Operator, diagonal, half_anticommutator, shift
from rotor.quantum.operators.rotation import body_tensor, j_squared, j_x, j_y, j_z, ladder, sum_of_powers
from rotor.quantum.operators.symmetric_top_elements import space_factor
from rotor.quantum.operators.tensors import spherical_components
from rotor.quantum.torsion import cosine, p_alpha, sine

ROUNDING = 32 * np.finfo(float).eps  # of the norm of a block
RIGID = {"A": 9400.0, "B": 3100.0, "C": 2500.0}
CONSTANTS = RIGID | {"DeltaJ": 1e-3, "DeltaJK": -4e-3, "DeltaK": 0.05, "deltaJ": 3e-4, "deltaK": 2e-3}
CL = {"chi_aa(35Cl)": -57.0, "chi_bb-cc(35Cl)": -4.0, "chi_ab(35Cl)": 30.0}
N14 = {"chi_aa(14N)": -3.2, "chi_bb-cc(14N)": 1.1, "chi_ab(14N)": 0.7}


def watson(constants):
    top = rotor.Top.from_constants(constants)
    terms = {name: sum_of_powers(table) for name, table in operators_by_name(top.constants).items()}
    return terms, [constants[name] for name in terms]


def functions(jmax, real=True):
    basis = Basis(rotation_labels(jmax))
    return RealFunctions(basis) if real else basis


def chi(values, label):
    aa, difference = values[f"chi_aa({label})"], values[f"chi_bb-cc({label})"]
    off = {pair: values.get(f"chi_{pair}({label})", 0.0) for pair in ("ab", "ac", "bc")}
    bb, cc = (-aa + difference) / 2, (-aa - difference) / 2
    return np.array([[aa, off["ab"], off["ac"]], [off["ab"], bb, off["bc"]], [off["ac"], off["bc"], cc]])


def quadrupole(values, label):
    return 2, body_tensor(spherical_components(chi(values, label), 2, "Ir"))


def rotation(jmax, tensors, real=True) -> Space:
    terms, values = watson(CONSTANTS)
    basis = functions(jmax, real)
    return contracted(states_of(linear_blocks(basis, terms), values), basis, tensors)


def assert_same_levels(space, levels, totals):
    for total in totals:
        ours = np.sort(np.concatenate([s.energies for s in space.sectors if s.twice_j == total]))
        theirs = np.sort(levels.energy_mhz[levels.quanta["f"] == total])
        assert len(ours) == len(theirs) > 0
        assert np.abs(ours - theirs).max() <= ROUNDING * np.abs(theirs).max()


# The algebra


@pytest.mark.parametrize("real", [False, True])
def test_components_along_the_molecule_obey_the_anomalous_commutators(real):
    basis = functions(4, real)

    def matrix(operator):
        return basis.elements([operator]).dense()

    x, y, z = (matrix(operator) for operator in (j_x(), j_y(), j_z()))
    assert np.allclose(x @ y - y @ x, -1j * z, atol=1e-12)  # exact but for rounding of square roots of 20
    assert np.allclose(matrix(j_x() @ j_x() + j_y() @ j_y() + j_z() @ j_z()), matrix(j_squared()), atol=1e-12)


def test_which_angular_momenta_commute_with_the_hamiltonian():
    """J_Z = Σ_g Φ_Zg J_g is M. A free top has J², J_Z, and J_z if symmetric; a field along Z leaves J_Z alone, an oblique one none.

    Direction cosines Φ are QuTiP's. Products through J + 1 count to J = 3 only.
    """
    labelled = states(4)
    basis = Basis(dict(zip(("J", "K", "M"), np.array(labelled).T, strict=True)))
    along = [basis.elements([operator]).dense() for operator in (j_x(), j_y(), j_z())]
    squared = basis.elements([j_squared()]).dense()
    j_space = sum(contracted_vectors(labelled, unit, [0, 0, 1]) @ j for unit, j in zip(np.eye(3), along, strict=True))
    assert np.allclose(j_space, np.diag(basis.labels["M"]), atol=1e-12)
    asymmetric, prolate = (
        sum(b * j @ j for b, j in zip(rates, along, strict=True)) for rates in ([6, 4, 10], [4, 4, 10])
    )
    inner = np.ix_(basis.labels["J"] < 4, basis.labels["J"] < 4)

    def commute(hamiltonian):
        """Whether J², J_Z, J_z commute with it."""
        pairs = (hamiltonian @ j - j @ hamiltonian for j in (squared, j_space, along[2]))
        sizes = [np.abs(pair[inner]).max() for pair in pairs]
        assert all(size < 1e-11 or size > 0.1 for size in sizes)  # round-off of H and J² of 200
        return [bool(size < 1e-11) for size in sizes]

    assert commute(asymmetric) == [True, True, False]
    assert commute(prolate) == [True, True, True]
    fields = [contracted_vectors(labelled, [0.7, 0, 1.0], field) for field in ([0, 0, 1], [0.6, 0, 0.8])]
    assert commute(asymmetric - fields[0]) == [False, True, False]
    assert commute(asymmetric - fields[1]) == [False, False, False]
    assert commute(prolate - contracted_vectors(labelled, [0, 0, 1], [0, 0, 1])) == [False, True, True]


def test_products_and_anticommutators_of_operators_are_those_of_their_matrices():
    basis = Basis(product(rotation_labels(3), {"k": np.arange(-3, 4)}))
    a = j_x() @ p_alpha(1) + 2.0 * ladder(2)
    b = j_z(2) - 0.5j * j_y()
    matrices = [basis.elements([operator]).dense() for operator in (a, b, a @ b, half_anticommutator(a, b), a**3)]
    first, second, multiplied, symmetric, cube = matrices
    assert np.allclose(multiplied, first @ second, atol=1e-11)  # elements up to 1e3
    assert np.allclose(symmetric, (first @ second + second @ first) / 2, atol=1e-11)
    assert np.allclose(cube, first @ first @ first, atol=1e-9)  # elements up to 1e4


def test_a_cosine_and_a_sine_are_those_of_the_angle():
    basis = Basis({"k": np.arange(-6, 7)})
    c, s = (basis.elements([operator]).dense()[3:-3, 3:-3] for operator in (cosine(1) @ cosine(1), sine(1) @ sine(1)))
    assert np.allclose(c + s, np.eye(7), atol=1e-15)  # halves and quarters are exact
    assert np.allclose(c - s, basis.elements([cosine(2)]).dense()[3:-3, 3:-3], atol=1e-15)  # cos 6α of a threefold top


def test_a_function_that_stands_twice_is_refused():
    with pytest.raises(ValueError, match="stands twice"):
        Basis({"J": np.array([1, 1]), "K": np.array([0, 0])})


@pytest.mark.parametrize("rank", [1, 2, 3])
def test_reduced_elements_of_tensors_are_the_plain_ones(rank):
    rng = np.random.default_rng(5)
    parts = rng.normal(size=2 * rank + 1) + 1j * rng.normal(size=2 * rank + 1)
    basis = functions(5, real=False)
    whole = basis.elements([body_tensor(parts)]).dense()
    rows = [np.flatnonzero(basis.labels["J"] == j) for j in range(6)]
    for up in range(6):
        for low in range(6):
            expected = symmetric_top_elements(up, low, parts)
            assert np.allclose(whole[np.ix_(rows[up], rows[low])], expected, atol=1e-13)  # numbers of order 1


# The rotation


@pytest.mark.parametrize("phase", [1.0, 1j])
def test_energies_of_a_large_narrow_block_are_those_of_its_matrix(phase):
    size = 650
    diagonal, beside = np.arange(size), np.arange(size - 2)
    rows, columns = np.append(diagonal, beside + 2), np.append(diagonal, beside)
    factors = np.append(diagonal**2.0, phase * np.full(size - 2, 40.0))[:, None]
    block = LinearBlock(size, rows, columns, factors, np.eye(1), np.zeros(1, dtype=np.int64))
    exact = np.linalg.eigvalsh(block.lower(np.array([0.5])))
    assert np.abs(block.energies(np.array([0.5])) - exact).max() <= ROUNDING * exact.max()


@pytest.mark.parametrize("real", [False, True])
def test_levels_of_an_asymmetric_top_are_those_of_wang_blocks(real):
    terms, values = watson(CONSTANTS)
    basis = functions(30, real)
    blocks = linear_blocks(basis, terms)
    energies = energies_of(blocks, len(basis.labels["J"]), values)
    assert len(blocks) == (120 if real else 61)  # Wang blocks, none empty; even and odd K otherwise
    levels = rotor.api.solve_levels(rotor.Top.from_constants(CONSTANTS), 30)
    for j in range(1, 31):
        ours = np.sort(energies[basis.labels["J"] == j])
        theirs = np.sort(levels.energy_mhz[levels.quanta["j"] == j])
        assert np.abs(ours - theirs).max() <= ROUNDING * np.abs(theirs).max()


def test_slopes_are_those_of_finite_differences_and_sum_to_the_energy():
    terms, values = watson(CONSTANTS)
    basis = functions(8)
    blocks = linear_blocks(basis, terms)
    count = len(basis.labels["J"])
    slopes = slopes_of(states_of(blocks, values), basis.elements(list(terms.values())))
    assert np.allclose(
        slopes @ values, energies_of(blocks, count, values), rtol=1e-11
    )  # Euler's theorem, rounding of sums of 8 terms
    for i, value in enumerate(values):
        step = 1e-3 * abs(value)
        changed = [np.where(np.arange(len(values)) == i, value + sign * step, values) for sign in (1, -1)]
        upper, lower = (energies_of(blocks, count, c) for c in changed)
        expected = (upper - lower) / (2 * step)
        assert np.allclose(
            slopes[:, i], expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max()
        )  # second order in the step


def test_two_coupled_states_are_those_of_the_engine_of_states():
    more = {"E": 9000.0, "A": 9390.0, "B": 3110.0, "C": 2490.0}
    text = " ".join(f"{name}[1]={value}" for name, value in more.items())
    top = rotor.Top.from_constants(RIGID, states=f"{text} G_c[0,1]=400 F_ab[0,1]=12 MHz")
    levels = rotor.api.solve_levels(top, 12, effects=rotor.api.effects_of(top, False))

    a, b, c = j_z(), j_x(), j_y()  # the representation Ir: z, x, y are a, b, c
    between = 1.0 * (ket_bra(1, 0) + ket_bra(0, 1))
    turning = ket_bra(0, 1) - ket_bra(1, 0)
    terms: dict[str, Operator] = {}
    for v in (0, 1):
        projector = ket_bra(v, v)
        terms |= {
            f"E{v}": projector,
            f"A{v}": a @ a @ projector,
            f"B{v}": b @ b @ projector,
            f"C{v}": c @ c @ projector,
        }
    terms |= {"G": 1j * (c @ turning), "F": 2.0 * half_anticommutator(a, b) @ between}
    values = [0.0, *RIGID.values(), *more.values(), 400.0, 12.0]
    basis = RealFunctions(Basis(product(rotation_labels(12), {"v": np.arange(2)})))
    blocks = linear_blocks(basis, terms)
    assert not any(np.iscomplexobj(block.factors) for _, block in blocks)
    energies = energies_of(blocks, len(basis.labels["J"]), values)
    for j in range(1, 13):
        ours = np.sort(energies[basis.labels["J"] == j])
        theirs = np.sort(levels.energy_mhz[levels.quanta["j"] == j])
        assert np.abs(ours - theirs).max() <= ROUNDING * np.abs(theirs).max()


# Spins


@pytest.mark.parametrize(
    ("real", "more"), [(True, {}), (False, {}), (True, {"chi_ac(35Cl)": 11.0, "chi_bc(35Cl)": -7.0})]
)
def test_one_quadrupole_nucleus_is_that_of_the_engine_of_spins(real, more):
    values = CL | more
    top = rotor.Top.from_constants(CONSTANTS | values)
    levels = rotor.api.solve_levels(top, 10, effects=rotor.api.effects_of(top, True))
    space = rotation(9, {"chi": quadrupole(values, "35Cl")}, real)
    totals = range(1, 16, 2)
    solved = coupled(space, spin_space(3), {"chi": ("chi", "Q")}, {}, totals)
    assert_same_levels(solved.solve({"chi": 1.0}), levels, totals)


def test_two_nuclei_are_those_of_the_engine_of_spins():
    top = rotor.Top.from_constants(CONSTANTS | CL | N14)
    levels = rotor.api.solve_levels(top, 8, effects=rotor.api.effects_of(top, True))
    space = rotation(8, {"Cl": quadrupole(CL, "35Cl"), "N": quadrupole(N14, "14N")})
    first = coupled(space, spin_space(3), {"Cl": ("Cl", "Q")}, {"N": ("N", 2)}, range(1, 14, 2)).solve({"Cl": 1.0})
    both = coupled(first, spin_space(2), {"N": ("N", "Q")}, {}, range(1, 12, 2)).solve({"N": 1.0})
    assert_same_levels(both, levels, range(1, 12, 2))


def nuclear_spin_rotation(matrix):
    """Σ_ij C_ij ½{Φ_i, N_j} along x, y, z as a vector, coupled with the spin by a scalar product."""
    along = (j_x(), j_y(), j_z())
    unit = np.eye(3)[:, [2, 0, 1]]  # x, y, z along b, c, a of Ir
    vectors = [body_tensor(spherical_components(axis, 1, "Ir")) for axis in unit]
    terms = [
        matrix[i, j] * half_anticommutator(vectors[i], along[j]) for i in range(3) for j in range(3) if matrix[i, j]
    ]
    return reduce(lambda x, y: x + y, terms)


def test_spin_rotation_beside_a_quadrupole_is_that_of_the_engine_of_spins():
    named = {"C_aa(35Cl)": 20.0, "C_bb(35Cl)": 50.0, "C_cc(35Cl)": -30.0}
    top = rotor.Top.from_constants(CONSTANTS | CL | named)
    levels = rotor.api.solve_levels(top, 8, effects=rotor.api.effects_of(top, True))
    space = rotation(8, {"chi": quadrupole(CL, "35Cl"), "C": (1, nuclear_spin_rotation(np.diag([50.0, -30.0, 20.0])))})
    totals = range(1, 12, 2)
    both = coupled(space, spin_space(3), {"chi": ("chi", "Q"), "C": ("C", "I")}, {}, totals)
    assert_same_levels(both.solve({"chi": 1.0, "C": 1.0}), levels, totals)
    labels = Space(both.sectors, {}).labels()
    energies = energies_of(linear_blocks_of_coupled(both), len(labels["twice_j"]), [1.0, 1.0, 1.0])  # as for fits
    for total in totals:
        theirs = np.sort(levels.energy_mhz[levels.quanta["f"] == total])
        assert np.abs(np.sort(energies[labels["twice_j"] == total]) - theirs).max() <= ROUNDING * np.abs(theirs).max()


# Fields


def field_blocks(space, twice_m):
    """Linear blocks of one M: the energies of a space, and its tensor "mu" along the field."""
    start, pieces = space.starts(), []
    energies = np.concatenate([sector.energies for sector in space.sectors])
    pieces.append((np.arange(len(space)), np.arange(len(space)), 0, energies))
    for (a, b), reduced in space.tensors["mu"][1].items():
        factor = space_factor(space.sectors[a].twice_j, space.sectors[b].twice_j, 1, twice_m)
        r, c = np.nonzero(np.abs(factor * reduced) > NEGLIGIBLE * np.abs(reduced).max(initial=0.0))
        pieces.append((start[a] + r, start[b] + c, 1, factor * reduced[r, c]))
    projects = np.repeat([sector.twice_j >= abs(twice_m) for sector in space.sectors], np.diff(start))
    elements = with_real_phases(flat_elements(len(space), 2, pieces))
    return connected_blocks(space.labels(), elements, projects)


@pytest.mark.parametrize("dipole", [(0.0, 1.8, 0.0), (1.2, 0.7, 0.0), (1.2, 0.7, 0.4)])
def test_levels_in_an_electric_field_are_those_of_stark_maps(dipole):
    top = rotor.Top.from_constants(CONSTANTS, dipole_abc_debye=dipole)
    space = rotation(12, {"mu": (1, body_tensor(spherical_components(dipole, 1, "Ir")))})
    strengths = [5.0, 40.0]
    for m in (0, 1, 2):
        theirs = rotor.api.stark_map(top, strengths, j_highest=3, m_values=[m], jmax=12)
        blocks = field_blocks(space, 2 * m)
        complex_elements = any(np.iscomplexobj(block.factors) for _, block in blocks)
        assert complex_elements == bool(dipole[2] and m)  # three components and M: no real functions
        for strength in strengths:
            energies = energies_of(blocks, len(space), [1.0, -units.MHZ_PER_DEBYE_KV_PER_CM * strength])
            expected = np.sort(theirs.columns["energy_mhz"][theirs.columns["field_kv_per_cm"] == strength])
            nearest = np.abs(np.sort(energies[np.isfinite(energies)])[: 3 * len(expected), None] - expected).min(axis=0)
            assert nearest.max() <= ROUNDING * np.nanmax(np.abs(energies))


# A toy effect


def test_a_toy_effect_of_one_operator_reaches_levels_slopes_spins_and_fields():
    """c (J·n)⁴: one operator, made of products, is enough for all that stands above."""
    from toy_axis_power import AxisPower

    axis = np.array([0.6, 0.48, 0.64])  # along a, b, c
    toy = (float(axis[1]) * j_x() + float(axis[2]) * j_y() + float(axis[0]) * j_z()) ** 4
    top = rotor.Top.from_constants(RIGID)
    effect = AxisPower(c_mhz=2.0, axis_abc=tuple(axis.tolist()))
    levels = rotor.api.solve_levels(top, 8, effects=(*rotor.api.effects_of(top, False), effect))
    terms, values = watson(RIGID)
    basis = functions(8)
    blocks = linear_blocks(basis, terms | {"toy": toy})
    energies = energies_of(blocks, len(basis.labels["J"]), [*values, 2.0])
    for j in range(1, 9):
        ours = np.sort(energies[basis.labels["J"] == j])
        assert np.abs(ours - np.sort(levels.energy_mhz[levels.quanta["j"] == j])).max() <= ROUNDING * ours.max()
    states = states_of(blocks, [*values, 2.0])
    slopes = slopes_of(states, basis.elements([*terms.values(), toy]))
    assert np.allclose(slopes @ [*values, 2.0], energies, atol=1e-8)  # rounding of 1e6 MHz
    vector = body_tensor(spherical_components([1.0, 0.0, 0.0], 1, "Ir"))
    space = contracted(states, basis, {"chi": quadrupole(CL, "35Cl"), "mu": (1, vector)})
    hyperfine = coupled(space, spin_space(3), {"chi": ("chi", "Q")}, {"mu": ("mu", 1)}, range(1, 8, 2)).solve(
        {"chi": 1.0}
    )
    trace = sum(float(s.energies.sum()) for s in hyperfine.sectors if s.twice_j == 3)
    expected = sum(float(s.energies.sum()) for s in space.sectors if s.twice_j in (0, 2, 4, 6))
    assert trace == pytest.approx(
        expected, rel=1e-9
    )  # the coupling has no trace in F = 3/2 but that of each J, which vanishes in sum
    assert np.isfinite(energies_of(field_blocks(hyperfine, 1), len(hyperfine), [1.0, 100.0])).any()


def test_elements_of_a_plain_shift_reach_the_labels_they_name():
    basis = Basis({"v": np.array([0, 1, 2])})
    up = shift(lambda labels: np.sqrt(labels["v"] + 1.0), v=1)
    number = basis.elements(
        [up @ shift(lambda labels: np.sqrt(labels["v"] * 1.0), v=-1), UNIT, diagonal(lambda x: x["v"])]
    )
    assert number.values[0].tolist() == pytest.approx([0.0, 1.0, 2.0], abs=1e-15)
