"""Zeeman maps: the closed forms of linear and symmetric tops, a full matrix for an asymmetric one, bad input."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from field_matrices import contracted_vectors, rigid, states

import rotor
from rotor.quantum.effects.stark import StarkRequest, answer_stark, stark_map
from rotor.quantum.effects.zeeman import ZeemanRequest, answer_zeeman, magnetic_limits, zeeman_map
from rotor.quantum.fields import field_map, map_request
from rotor.quantum.fields.blocks import Magnet
from rotor.quantum.fields.solved_space import field_space
from rotor.tops.magnetic import MagneticTensors, tensor_for
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.top import Top
from rotor.units import NUCLEAR_MAGNETON_MHZ_PER_T


def test_a_linear_top_is_linear_in_the_field():
    """E = E0 - g μ_N B M, exactly."""
    top = Top.from_constants("B=6000 D=0.001 MHz")
    zeeman = zeeman_map(top, [0.0, 2.0], -0.03, j_highest=2)
    for rows in zeeman.curves():
        j, m = int(zeeman.label[rows.start]), int(zeeman.m[rows.start])
        free = 6000.0 * j * (j + 1) - 0.001 * (j * (j + 1)) ** 2
        shift = 0.03 * NUCLEAR_MAGNETON_MHZ_PER_T * 2.0 * m
        assert zeeman.energy_mhz[rows].tolist() == pytest.approx([free, free + shift], abs=1e-9)  # round-off of 36 GHz
        assert zeeman.slope[rows.start] == pytest.approx(-0.03 * m, abs=1e-12)


def test_a_symmetric_top_to_first_order():
    """-μ_N B M [g⊥ + (g∥ - g⊥) K²/(J(J+1))] (Flygare)."""
    top = Top.from_constants("A=20000 B=9000 MHz")
    zeeman = zeeman_map(top, [0.0], [0.3, 0.1, 0.1], j_highest=2)
    for rows in zeeman.curves():
        j, k = (int(part) for part in zeeman.label[rows.start].split())
        m = int(zeeman.m[rows.start])
        first = m * (0.1 + 0.2 * k * k / (j * (j + 1))) if j else 0.0
        assert zeeman.slope[rows.start] == pytest.approx(first, abs=1e-12)


@pytest.mark.parametrize("g", [np.diag([0.6, -0.2, 0.3]), np.array([[0.6, 0.1, 0], [0.1, -0.2, 0], [0, 0, 0.3]])])
def test_an_asymmetric_top_against_the_full_matrix(g):
    """All |J k M⟩ up to J = 3 in Iʳ (x, y, z = b, c, a), ½(ΦJ + JΦ) multiplied out; a field strong enough to mix J."""
    basis = states(3)
    place = {state: i for i, state in enumerate(basis)}
    raising = np.zeros((len(basis), len(basis)), dtype=complex)  # Jx - iJy raises k
    for (j, k, m), i in place.items():
        if (j, k + 1, m) in place:
            raising[place[j, k + 1, m], i] = np.sqrt(j * (j + 1) - k * (k + 1))
    jx, jy = (raising + raising.conj().T) / 2, (raising - raising.conj().T) * 0.5j
    current = {0: np.diag([float(k) for _, k, _ in basis]), 1: jx, 2: jy}  # along a = z, b = x, c = y
    total = np.zeros_like(raising)
    for i in range(3):
        cosine = contracted_vectors(basis, np.eye(3)[i][[1, 2, 0]], [0, 0, 1])
        for j in range(3):
            total = total + g[i, j] * (cosine @ current[j] + current[j] @ cosine) / 2
    strength = 2.0
    full = np.linalg.eigvalsh(rigid(basis, 6.0, 4.0, 10.0) - strength * total)

    top = Top.from_constants("A=10 B=6 C=4 MHz")
    ours, magnet = [], Magnet(g)
    space = field_space(top, 3, [magnet])
    for m in range(-3, 4):
        for block in space.blocks(m):
            matrix = np.diag(block.energies_mhz) - strength * block.matrix(magnet)
            ours += np.repeat(np.linalg.eigvalsh(matrix), block.copies).tolist()
    assert np.sort(ours) == pytest.approx(full, abs=1e-6)  # QuTiP's alternating sums
    with pytest.raises(ValueError, match="beyond 1000"):
        zeeman_map(top, [1e6], g)


def test_bad_g_tensors_are_refused():
    with pytest.raises(ValueError, match="symmetric about a"):
        zeeman_map(Top.from_constants("A=10 B=6 MHz"), [1.0], [0.1, 0.2, 0.3])
    with pytest.raises(ValueError, match="one number, three"):
        zeeman_map(Top.from_constants("A=10 B=6 C=4 MHz"), [1.0], [[0.1, 0.2]])


def test_what_of_the_field_is_left_out_is_said():
    """The largest moment of a nucleus, μ = g I μ_N with 2.7928 of the proton, and a magnetisability that is not given."""
    hc3n, g = (
        replace(rotor.read("HC3N"), spin_constants=SpinConstants.parse("chi_aa(14N)=-4.3 MHz")),
        np.diag([0.0, -0.01, -0.01]),
    )
    results = {}
    for spins, chi in ((False, None), (True, tensor_for("linear", [-1.0]))):
        top = replace(hc3n, magnetic=MagneticTensors(g, chi))
        request = ZeemanRequest(top, (-0.5, 0.25), j_highest=1, hyperfine=spins)
        results[spins] = {item.name: item.size_mhz for item in magnetic_limits(request)}
        listed = answer_zeeman(request).facts()["limits"]
        assert {limit["name"] for limit in listed} >= results[spins].keys()
        sizes = [limit["size_mhz"] for limit in listed if limit["size_mhz"] is not None]
        assert sizes == sorted(sizes, reverse=True)
    proton = 2.7928473 * NUCLEAR_MAGNETON_MHZ_PER_T * 0.5
    assert results[False] == {"magnetic moments of nuclei": pytest.approx(proton, rel=1e-4), "magnetisability": None}
    assert results[True] == {}


def test_a_map_of_too_many_energies_is_refused():
    """(2J+1)² states of each J, at all fields: their table is in memory."""
    top = Top.from_constants("A=10 B=6 C=4 GHz", magnetic=MagneticTensors(tensor_for("asymmetric", [0.6, -0.2, 0.3])))
    assert ZeemanRequest(top, tuple(range(33)), j_highest=21).map.states == 14_190
    message = "14,190 states of J up to 21 at 120 fields are 1,702,800 energies, more than 1,500,000: follow states of lower J"
    with pytest.raises(ValueError, match=message):
        answer_zeeman(ZeemanRequest(top, tuple(np.arange(120) / 10), j_highest=21))


def test_a_map_of_too_large_blocks_is_refused(monkeypatch):
    """Time grows as the cube of the size of blocks: few energies may take hours, and were computed."""
    top = Top.from_constants("A=10 B=6 C=4 GHz", dipole_abc_debye=(1.0, 0, 0))
    message = r"states of J up to {} lie in blocks of up to {} functions, which at {} fields take some \d+ minutes"
    for j, size, fields in (
        (100, "1,276", 100),
        (60, r"1,\d\d\d", 400),
    ):  # of one M: a bound of 8 blocks, and the blocks
        few = StarkRequest(top, tuple(np.linspace(0, 10, fields).tolist()), j_highest=j, m_values=(0,))
        with pytest.raises(ValueError, match=message.format(j, size, fields)):
            answer_stark(few)
    small = StarkRequest(top, (0.0, 10.0), j_highest=2)
    monkeypatch.setattr(map_request, "MOST_WORK", 2e4)  # blocks with the J that the field calls for
    with pytest.raises(ValueError, match=r"states of J up to 2 lie in blocks of up to \d\d functions"):
        answer_stark(small)


def test_a_map_that_takes_too_long_is_refused_early(monkeypatch):
    """Small blocks of large |M| need the highest J; beginning with M = 0, J max was looked for in nearly all blocks before the refusal."""
    top, searched, true = rotor.read("H2CO"), [], field_map._smallest_of_block
    monkeypatch.setattr(field_map, "_smallest_of_block", lambda *job: searched.append(1) or true(*job))
    with pytest.raises(
        ValueError, match=r"in blocks of up to [\d,]+ functions, which at 2 fields take some \d+ minutes"
    ):
        stark_map(top, [0.0, 10.0], j_highest=34)
    assert 0 < len(searched) < 30  # of 70
