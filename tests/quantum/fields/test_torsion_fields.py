"""Internal rotation in an electric field: the rigid top where nothing couples, and the direct product |J K M⟩|m⟩ written out here."""

from dataclasses import replace

import numpy as np
import pytest
import qutip
from torsion_top import ABC, CM, DIPOLE, turning

import rotor
from rotor.quantum.fields.blocks import Contraction
from rotor.quantum.fields.solved_space import solved_levels, solved_space
from rotor.tops.internal_rotation import InternalRotationConstants


def blocks_of_species(top, jmax, along, m, species, together):
    levels = solved_levels(top, jmax, ())
    if together:  # without v_t the states of all v_t of a species are in one sector
        levels = replace(levels, quanta={name: column for name, column in levels.quanta.items() if name != "vt"})
    space = solved_space(top, levels, jmax, [along])
    return [block for block in space.blocks(m) if space.levels.quanta["species"][block.rows[0]] == species]


def symbol(j1, j2, j3, m1, m2, m3):
    """The 3j symbol from QuTiP's Clebsch-Gordan coefficients."""
    if m1 + m2 + m3 or abs(m1) > j1 or abs(m3) > j3 or not abs(j1 - j2) <= j3 <= j1 + j2:
        return 0.0
    return (-1) ** int(j1 - j2 - m3) / np.sqrt(2 * j3 + 1) * qutip.clebsch(j1, j2, j3, m1, m2, -m3)


def direct_product(sigma, m, jmax, strength, waves=10):
    """Energies of all states of one M with J ≤ jmax, in a field (MHz per debye)."""
    states = [(j, k) for j in range(abs(m), jmax + 1) for k in range(-j, j + 1)]
    n = len(states)
    raising, pa = np.zeros((n, n)), np.diag([float(k) for _, k in states])
    for column, (j, k) in enumerate(states):
        if k < j:
            raising[states.index((j, k + 1)), column] = np.sqrt(j * (j + 1) - k * (k + 1))
    pb, pc = (raising + raising.T) / 2, 0.5j * (raising - raising.T)
    cosines = {q: np.zeros((n, n)) for q in (-1, 0, 1)}  # ⟨J'K'M|D^1*_0q|J K M⟩
    for row, (jj, kk) in enumerate(states):
        for column, (j, k) in enumerate(states):
            if abs(jj - j) <= 1 and abs(kk - k) <= 1:
                root = (-1) ** (m - kk) * np.sqrt((2 * jj + 1) * (2 * j + 1))
                cosines[kk - k][row, column] = root * symbol(jj, 1, j, -m, 0, m) * symbol(jj, 1, j, -kk, kk - k, k)
    along_a, along_b = cosines[0], (cosines[-1] - cosines[1]) / np.sqrt(2)
    waves_m = 3.0 * np.arange(-waves, waves + 1) + sigma
    p, identity = np.diag(waves_m), np.eye(2 * waves + 1)
    cos3 = (np.eye(len(identity), k=1) + np.eye(len(identity), k=-1)) / 2
    rotation = ABC["A"] * pa @ pa + ABC["B"] * pb @ pb + (ABC["C"] * pc @ pc).real + 700.0 * (pa @ pb + pb @ pa)
    rotation = rotation - strength * (DIPOLE[0] * along_a + DIPOLE[1] * along_b)
    slip = np.kron(np.eye(n), p) - 0.08 * np.kron(pa, identity)
    return np.linalg.eigvalsh(
        np.kron(rotation, identity) + 5.2 * CM * slip @ slip + np.kron(np.eye(n), 20.0 * CM * (identity - cos3))
    )


@pytest.mark.parametrize("sigma", [0, 1])
@pytest.mark.parametrize("m", [0, 1, -1])
def test_levels_in_a_field_are_those_of_the_direct_product(sigma, m):
    strength = 5000.0  # MHz/D: 10 kV/cm
    along = Contraction(DIPOLE, (0.0, 0.0, 1.0))
    blocks = blocks_of_species(turning(vt_max=18, functions=20), 3, along, abs(m), "AE"[sigma], together=True)
    if sigma:
        blocks = [block for block in blocks if block.m == m]
    energies = [np.linalg.eigvalsh(np.diag(block.energies_mhz) - strength * block.matrix(along)) for block in blocks]
    ours, theirs = np.sort(np.concatenate(energies)), direct_product(sigma, m, 3, strength)
    assert np.abs(ours[:20] - theirs[:20]).max() < 1e-5  # MHz; rounding of 7e7, and the functions beyond v_t = 18


def test_species_of_one_sign_of_m_are_no_mirror_images():
    plus, minus = direct_product(1, 1, 3, 5000.0), direct_product(1, -1, 3, 5000.0)
    assert np.abs(plus[:5] - minus[:5]).max() > 1.0


@pytest.mark.parametrize("intensity", [0.0, 3e10])
def test_without_coupling_both_species_have_the_map_of_the_rigid_top(intensity):
    polarizability = np.array([[6.0, 0.4, 0.0], [0.4, 4.0, 0.0], [0.0, 0.0, 3.5]])
    fields = [0.0, 5.0]
    top = turning(rho=0.0, dab=0.0, v3=400.0, vt_max=0)
    rigid = rotor.Top.from_constants(
        top.constants, dipole_abc_debye=DIPOLE, polarizability_abc_angstrom3=polarizability
    )
    top = replace(top, polarizability_abc_angstrom3=rigid.polarizability_abc_angstrom3)
    expected, computed = (
        rotor.api.stark_map(item, fields, j_highest=2, intensity_w_per_cm2=intensity) for item in (rigid, top)
    )
    for strength in fields:
        at = expected.field == strength
        known = np.sort(np.repeat(expected.energy_mhz[at], expected.copies[at]))
        for species, copies in (("A", 1), ("E", 2)):
            named = np.char.startswith(computed.label, species)
            here = named & (computed.field == strength)
            energies = (
                np.sort(np.repeat(computed.energy_mhz[here], computed.copies[here])) - computed.free_mhz[named].min()
            )
            assert np.abs(energies - np.repeat(known, copies)).max() < 1e-5  # rounding of 1e7 MHz


def test_maps_do_not_depend_on_the_frame():
    """PAM against the same molecule in the rho-axis frame."""
    from rho_axis_frame import ram_of_pam

    from rotor.quantum.internal_rotation.frames import torsional_kinetics

    top = turning(frame="PAM", vt_max=0)
    f, (rho,) = torsional_kinetics(ABC, {"F0": 158e3, "delta": 0.7})
    ram = ram_of_pam(list(ABC.values()), f[0, 0], rho)
    angle = np.arctan2(rho[1], rho[0])
    turned = (
        DIPOLE[0] * np.cos(angle) + DIPOLE[1] * np.sin(angle), DIPOLE[1] * np.cos(angle) - DIPOLE[0] * np.sin(angle), 0.0
    )  # fmt: skip
    values = {name: ram[name] for name in ("F", "rho", "Dab")} | {"V3": 40.0 * CM}
    constants = rotor.Constants(**{name: ram[name] for name in "ABC"}, reduction="A", representation="Ir")
    same = rotor.Top.from_constants(
        constants, dipole_abc_debye=turned, internal_rotation=InternalRotationConstants(values, "RAM", vt_max=0)
    )
    ours, others = (rotor.api.stark_map(item, [0.0, 3.0], j_highest=1) for item in (top, same))
    assert np.abs(np.sort(ours.energy_mhz) - np.sort(others.energy_mhz)).max() < 1e-5


def test_a_field_at_an_angle_is_refused():
    with pytest.raises(ValueError, match="along Z alone"):
        rotor.api.stark_map(turning(), [1.0], j_highest=1, direction=(1.0, 0.0, 1.0))


@pytest.mark.parametrize("sigma", [0, 1])
def test_elements_between_torsional_states_move_levels_by_less_than_is_said(sigma):
    strength = 503.4  # MHz/D: 1 kV/cm
    along = Contraction(DIPOLE, (0.0, 0.0, 1.0))
    lowest = []
    for together in (True, False):
        blocks = blocks_of_species(turning(v3=400.0, vt_max=1), 3, along, 1, "AE"[sigma], together=together)
        blocks = [block for block in blocks if block.m == 1]
        energies = [np.linalg.eigvalsh(np.diag(b.energies_mhz) - strength * b.matrix(along)) for b in blocks]
        lowest.append(np.sort(np.concatenate(energies))[:15])
    assert np.abs(lowest[0] - lowest[1]).max() < 0.1


FILE = """
name = "top"
[constants]
A = 9800
B = 4300
C = 3200
reduction = "A"
representation = "Ir"
[internal_rotation]
frame = "PAM"
F0 = 158000
delta = 0.56
V3 = "250 cm-1"
vt_max = 0
"""


def test_a_magnetic_field_is_refused_with_the_reason(tmp_path, call):
    path = tmp_path / "top.toml"
    path.write_text(FILE)
    code, _, error = call("zeeman", str(path), "--jmax", "4", "--field", "0:1T:3", "--g=-0.03,-0.02,-0.01")
    assert code == 2
    assert "adds a moment along its axis" in error
