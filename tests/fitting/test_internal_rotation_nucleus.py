"""One top with one 14N, both frames, against the direct product |N K M⟩|m⟩|I M_I⟩ without contraction, and in fits."""

import numpy as np
import pytest
from spherical_tensors import spherical, symbol

import rotor
from rotor.fitting.assignment import assignments
from rotor.fitting.fit import fit_lines
from rotor.fitting.levels.top_levels import label_model
from rotor.fitting.parameters import parameters
from rotor.fitting.top_constants import TopConstants
from rotor.formats.lines.assigned_lines import write_assigned_lines
from rotor.tops.internal_rotation import InternalRotationConstants

CM = rotor.units.MHZ_PER_CM
F, WAVES = 4, 8  # total angular momentum of the compared levels; k of the free functions exp i(3k + σ)α
ABC = {"A": 9100.0, "B": 4300.0, "C": 3000.0}
PAM = {"F0": 158e3, "delta": 0.6, "V3": 60 * CM}
# the axis of the top in a plane of principal axes, or in none; and the component of the tensor in this plane, or across it without a mirror
DIRECTIONS = {
    "PAM": ({}, "ab"),
    "PAM ac": ({"epsilon": np.pi / 2}, "ac"),
    "PAM bc": ({"delta": np.pi / 2, "epsilon": 0.7}, "bc"),
    "PAM any": ({"epsilon": 0.7}, "ac"),
    "PAM across ab": ({}, "bc"),
    "PAM across ac": ({"epsilon": np.pi / 2}, "ab"),
}
RAM = {"F": 5.2 * CM, "rho": 0.21, "V3": 60 * CM, "Dab": -900.0}
SPINS = "chi_aa(14N)=-4.2 chi_bb-cc(14N)=1.3 chi_ab(14N)=2.1 C_aa(14N)=0.03 C_bb(14N)=-0.02 MHz"
TOML = """
name = "top"
[constants]
A = 9100
B = 4300
C = 3000
reduction = "A"
representation = "Ir"
[dipole]
a = 1.5
b = 0.8
[internal_rotation]
frame = "RAM"
F = "5.2 cm-1"
rho = 0.21
V3 = "60.2 cm-1"
Dab = -900
[spins.14N]
chi_aa = -4.0
chi_bb-cc = 1.3
chi_ab = 1.9
C_aa = 0.03
C_bb = -0.02
"""
ROTATION = np.diag([0.03, -0.02, 0.0])


def chi(frame):
    """The quadrupole tensor along a, b, c."""
    tensor = np.diag([-4.2, (4.2 + 1.3) / 2, (4.2 - 1.3) / 2])
    i, j = ("abc".index(letter) for letter in DIRECTIONS.get(frame, ({}, "ab"))[1])
    tensor[i, j] = tensor[j, i] = 2.1
    return tensor


def turning_top(frame, vt_max, spins=SPINS, **changes):
    values = RAM
    if frame != "RAM":
        direction, pair = DIRECTIONS[frame]
        values, spins = PAM | direction, spins.replace("chi_ab", f"chi_{pair}")
    values = values | {name: value for name, value in changes.items() if name not in "ABC"}
    constants = rotor.Constants(
        **ABC | {n: v for n, v in changes.items() if n in "ABC"}, reduction="A", representation="Ir"
    )
    internal = InternalRotationConstants(values, frame[:3], vt_max=vt_max)
    dipole = (0.0, 0.8, 1.5) if frame == "PAM bc" else (1.5, 0.0, 0.8) if frame == "PAM ac" else (1.5, 0.8, 0.0)
    return rotor.Top.from_constants(
        constants, dipole_abc_debye=dipole, spin_constants=spins, internal_rotation=internal
    )


def components(states):
    """P_a, P_b, P_c between functions |N K M⟩ with z, x, y = a, b, c."""
    raising = np.zeros((len(states),) * 2)
    place = {state: i for i, state in enumerate(states)}
    for (n, k, m), column in place.items():
        if k < n:
            raising[place[n, k + 1, m], column] = np.sqrt(n * (n + 1) - k * (k + 1))
    along = np.diag([float(k) for _, k, _ in states])
    return along.astype(complex), (raising + raising.T) / 2, 0.5j * (raising - raising.T)


def turned_tensors(states, rank):
    """⟨N'K'M'|D^k*_pq|N K M⟩ by p and q."""
    out = np.zeros((2 * rank + 1, 2 * rank + 1, len(states), len(states)))
    for r, (nn, kk, mm) in enumerate(states):
        for c, (n, k, m) in enumerate(states):
            p, q = mm - m, kk - k
            if max(abs(nn - n), abs(p), abs(q)) <= rank:
                root = (-1) ** (mm - kk) * np.sqrt((2 * nn + 1) * (2 * n + 1))
                out[p + rank, q + rank, r, c] = root * symbol(nn, rank, n, -mm, p, m) * symbol(nn, rank, n, -kk, q, k)
    return out


def direct_product(frame, sigma):
    """Energies with M_F = 4, those with F = 4 among them: N from 3 to 5 and all M with M + M_I = 4."""
    states = [(n, k, m) for n in (3, 4, 5) for k in range(-n, n + 1) for m in (3, 4, 5) if m <= n]
    axes = components(states)
    matrix, vector = turned_tensors(states, 2), turned_tensors(states, 1)
    rotation = sum(ABC[name] * axis @ axis for name, axis in zip("ABC", axes, strict=True))
    if frame != "RAM":  # ρ_g = λ_g B_g/F0, F = F0/(1 - Σ λ_g ρ_g)
        angles = {"epsilon": 0.0} | PAM | DIRECTIONS[frame][0]
        across = np.sin(angles["delta"])
        direction = np.array(
            [np.cos(angles["delta"]), across * np.cos(angles["epsilon"]), across * np.sin(angles["epsilon"])]
        )
        rho = direction * list(ABC.values()) / PAM["F0"]
        f, barrier = PAM["F0"] / (1 - direction @ rho), PAM["V3"]
        coupling = sum(x * axis for x, axis in zip(rho, axes, strict=True))
    else:
        rotation = rotation + RAM["Dab"] * (axes[0] @ axes[1] + axes[1] @ axes[0])
        f, barrier, coupling = RAM["F"], RAM["V3"], RAM["rho"] * axes[0]
    m = 3.0 * np.arange(-WAVES, WAVES + 1) + sigma
    p, identity = np.diag(m), np.eye(len(m))
    hindering = barrier / 2 * (identity - (np.eye(len(m), k=1) + np.eye(len(m), k=-1)) / 2)

    spin = np.array([1, 0, -1])
    raising = np.sqrt(2.0) * np.eye(3, k=1)
    ix, iy, iz = (raising + raising.T) / 2, -0.5j * (raising - raising.T), np.diag(spin.astype(float))
    pairs = [(r, c) for r in range(len(states)) for c in range(3) if states[r][2] + spin[c] == F]
    rows, spin_index = np.array(pairs).T

    def lifted(left, right):
        return left[np.ix_(rows, rows)] * right[np.ix_(spin_index, spin_index)]

    order = [1, 2, 0]  # x, y, z = b, c, a
    body_tensor = spherical(chi(frame)[np.ix_(order, order)])
    squares = [[(u @ v + v @ u) / 2 - (2 / 3 * np.eye(3) if i == k else 0) for k, v in enumerate((ix, iy, iz))]
               for i, u in enumerate((ix, iy, iz))]  # fmt: skip
    quadrupole = [part / 2 for part in spherical(squares)]  # 2I(2I - 1) = 2
    hyperfine = np.zeros((len(rows),) * 2, dtype=complex)
    for s in range(-2, 3):
        tensor = sum(body_tensor[q + 2] * matrix[s + 2, q + 2] for q in range(-2, 3))
        hyperfine += (-1) ** s * lifted(tensor, quadrupole[2 - s])
    body = {"a": [0, 1, 0], "b": [1 / np.sqrt(2), 0, -1 / np.sqrt(2)], "c": [-1j / np.sqrt(2), 0, -1j / np.sqrt(2)]}
    spin_vector = [(ix - 1j * iy) / np.sqrt(2), iz, -(ix + 1j * iy) / np.sqrt(2)]
    for letter, axis, value in zip("abc", axes, np.diag(ROTATION), strict=True):
        for s in (-1, 0, 1):
            cosine = sum(body[letter][q + 1] * vector[s + 1, q + 1] for q in (-1, 0, 1))
            hyperfine += value * (-1) ** s * lifted((cosine @ axis + axis @ cosine) / 2, spin_vector[1 - s])
    hamiltonian = hyperfine + lifted(rotation + f * coupling @ coupling, np.eye(3))
    whole = np.kron(hamiltonian, identity) - 2 * f * np.kron(lifted(coupling, np.eye(3)), p)
    return np.linalg.eigvalsh(whole + np.kron(np.eye(len(rows)), f * p @ p + hindering))


@pytest.mark.parametrize("frame", ["RAM", *DIRECTIONS])
@pytest.mark.parametrize("species", ["A", "E"])
def test_levels_with_one_nucleus_are_those_of_the_direct_product(frame, species):
    expected = direct_product(frame, "AE".index(species))
    levels = rotor.api.solve_levels(top := turning_top(frame, 2), 5, effects=rotor.api.effects_of(top, True))
    chosen = (levels.quanta["species"] == species) & (levels.quanta["f"] == F)
    for vt in (0, 1):
        ours = np.sort(levels.energy_mhz[chosen & (levels.quanta["vt"] == vt)])
        assert len(ours) == 27  # N = 3, 4, 5
        assert (
            np.abs(expected[:, None] - ours).min(axis=0).max() < 1e-6
        )  # MHz; elements are up to 3e7: rounding is 1e-7


NAMES = ("n", "ka", "kc", "species", "vt", "f")


def hyperfine_lines(top, nmax, error_mhz=0.002, noise=None, vt=(0, 1)):
    """Lines of a prediction with all components of F, as a fit has them."""
    seen = rotor.api.line_list(
        top, jmax=nmax, q=1.0, min_lgint=None, range_mhz=(5e3, 6e4), effects=rotor.api.effects_of(top, True)
    )
    seen = seen[(seen.strength_debye2 > 1e-3) & np.isin(seen.levels.quanta["vt"][seen.upper], vt)]
    quanta = {n: np.where(c == "E", 1, 0) if n == "species" else c for n, c in seen.levels.quanta.items()}
    upper, lower = (np.column_stack([quanta[name][rows] for name in NAMES]) for rows in (seen.upper, seen.lower))
    frequency = seen.frequency_mhz + (0.0 if noise is None else noise.normal(scale=error_mhz, size=len(seen)))
    blend = np.arange(len(seen))
    return assignments(NAMES, upper, lower, frequency, error_mhz, blend=blend)


@pytest.mark.parametrize("frame", ["RAM", "PAM", "PAM ac", "PAM any", "PAM across ac"])
@pytest.mark.parametrize("second", ["", pytest.param("chi_aa(35Cl)=-57 chi_ab(35Cl)=20 ", marks=pytest.mark.slow)])
def test_derivatives_with_spins_are_those_of_finite_differences(frame, second):
    top = turning_top(frame, 0, SPINS.replace("MHz", second + "MHz"))
    constants = TopConstants(top, hyperfine=True)
    levels = rotor.api.solve_levels(top, 2, effects=rotor.api.effects_of(top, True))
    few = np.random.default_rng(3).permutation(len(levels))[:60]
    quanta = {n: np.where(c == "E", 1, 0) if n == "species" else c for n, c in levels.quanta.items()}
    labels = np.column_stack([quanta[name][few] for name in constants.quanta])
    model = label_model(constants, labels)
    values = np.array(list(constants.values.values()))
    energies, slopes = model.levels(values)
    assert np.abs(energies - levels.energy_mhz[few]).max() < 1e-6  # MHz: the levels of the prediction
    for i, (name, value) in enumerate(constants.values.items()):
        step = max(abs(value) * (1e-5 if name in ("F", "F0", "rho", "delta", "epsilon", "V3") else 1e-3), 1e-6)
        changed = [np.where(np.arange(len(values)) == i, value + sign * step, values) for sign in (1, -1)]
        upper, lower = (model.levels(c)[0] for c in changed)
        expected = (upper - lower) / (2 * step)
        noise = 4e-8 / step  # rounding of eigenvalues of matrices with elements up to 1e8 MHz
        assert np.allclose(slopes[:, i], expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max() + noise), name


@pytest.mark.parametrize(("frame", "torsional"), [("RAM", ("rho", "V3", "Dab")), ("PAM", ("delta", "V3"))])
def test_constants_of_a_top_with_a_nucleus_are_found_again_from_noisy_lines(frame, torsional):
    lines = hyperfine_lines(turning_top(frame, 1), 4, noise=np.random.default_rng(7))
    moved = {"V3": 60.5 * CM} | ({"rho": 0.2102, "Dab": -903.0} if frame == "RAM" else {"delta": 0.601})
    near = turning_top(frame, 1, SPINS.replace("-4.2", "-3.9").replace("2.1", "1.8"), A=9103.0, B=4300.5, **moved)
    start = TopConstants(near, hyperfine=True)
    free = ["A", "B", "C", *torsional, "chi_aa(14N)", "chi_bb-cc(14N)", "chi_ab(14N)"]
    fit = fit_lines(lines, start, parameters(start, free))
    assert fit.converged
    assert 0.9 < fit.weighted_rms < 1.1  # of lines with the stated noise, some hundreds
    true = TopConstants(turning_top(frame, 1), hyperfine=True)
    for name, value, error in zip(fit.parameters.names, fit.values, fit.errors, strict=True):
        assert abs(value - true[name]) < 2 * error, name


def test_lines_with_spins_are_fitted_from_a_table(tmp_path, call):
    (tmp_path / "top.toml").write_text(TOML)
    write_assigned_lines(hyperfine_lines(turning_top("RAM", 1), 3), tmp_path / "lines.csv")
    free = "V3,chi_aa(14N),chi_ab(14N)"
    code, output, error = call(
        "fit", str(tmp_path / "lines.csv"), "--start", str(tmp_path / "top.toml"), "--free", free
    )
    assert code == 0, error
    assert "chi_ab(14N)" in output
    rows = (tmp_path / "lines.csv").read_text().splitlines()
    place = rows[0].split(",").index("f_upper")
    first = rows[1].split(",")
    (tmp_path / "wrong.csv").write_text(
        "\n".join([rows[0], ",".join([*first[:place], "9", *first[place + 1 :]]), *rows[2:]])
    )
    code, output, error = call(
        "fit", str(tmp_path / "wrong.csv"), "--start", str(tmp_path / "top.toml"), "--free", free
    )
    assert code == 2
    assert "wrong.csv: line 1, " in error
    assert "f = 9: each sum of angular momenta goes from their difference to their sum" in error
