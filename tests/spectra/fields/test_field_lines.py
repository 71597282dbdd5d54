"""Lines in a static field, mixtures, coefficients, smeared spectra and tables for deflection: closed forms, full matrices, bad input."""

from __future__ import annotations

import numpy as np
import pytest
from field_matrices import contracted_vectors, rigid, states

from rotor.quantum.effects.stark import stark_map
from rotor.quantum.fields.deflection import deflection_table
from rotor.spectra.fields.lines import field_lines
from rotor.spectra.fields.spectrum import FieldDistribution, field_spectrum
from rotor.spectra.fields.stark_coefficients import line_coefficients
from rotor.spectra.lines import line_list
from rotor.thermodynamics.gas.field_mixture import field_mixture
from rotor.tops.top import Top
from rotor.units import MHZ_PER_DEBYE_KV_PER_CM, MHZ_PER_K

OCS = Top.from_constants("B=6081.492475 MHz", dipole_abc_debye=(0.71519, 0, 0))
CH3F_LIKE = Top.from_constants("A=155000 B=25536 MHz", dipole_abc_debye=(1.86, 0, 0))
SKEW = Top.from_constants("A=10000 B=6000 C=4000 MHz", dipole_abc_debye=(1.0, 0.7, -0.4))
PLANE = Top.from_constants("A=10000 B=6000 C=4000 MHz", dipole_abc_debye=(1.0, 0.7, 0.0))


# Strengths


@pytest.mark.parametrize("top", [OCS, CH3F_LIKE, PLANE, SKEW])
@pytest.mark.parametrize("light", ["parallel", "perpendicular", "isotropic", 35.0])
def test_without_field_every_polarization_gives_the_catalogue(top, light):
    """Summed over M, S μ² of each line, whatever the polarization; and its intensity."""
    lines = field_lines(top, [0.0], j_highest=2, light=light, temperature_k=50.0)
    free = line_list(top, jmax=2, temperature_k=50.0, min_lgint=-np.inf)
    ours = np.array([lines.frequency_mhz.round(3), lines.strength_debye2, lines.intensity_nm2_mhz])
    for frequency, strength, intensity in zip(
        free.frequency_mhz, free.strength_debye2, free.intensity_nm2_mhz, strict=True
    ):
        here = np.abs(ours[0] - frequency) < 0.01  # rounded to 1e-3
        same = np.abs(free.frequency_mhz - frequency) < 0.01  # lines that coincide
        assert ours[1, here].sum() == pytest.approx(free.strength_debye2[same].sum(), rel=1e-9)
        assert ours[2, here].sum() == pytest.approx(free.intensity_nm2_mhz[same].sum(), rel=1e-6)  # Q to 1e-8
        assert strength > 0
        assert intensity > 0


@pytest.mark.parametrize("dipole", [(1.0, 0.7, -0.4), (1.0, 0.7, 0.0), (0.0, 0.0, 1.0)])
def test_strengths_in_a_strong_field_are_those_of_the_full_matrix(dipole):
    """All |J k M⟩ up to J = 3 in Iʳ (x, y, z = b, c, a): Σ over degenerate states of squares of μ_Z and of μ_X."""
    basis, field = states(3), 8.0
    body = np.array(dipole)[[1, 2, 0]]
    along, across = (contracted_vectors(basis, body, space) for space in ([0, 0, 1.0], [1.0, 0, 0]))
    energies, vectors = np.linalg.eigh(rigid(basis, 6000.0, 4000.0, 10000.0) - MHZ_PER_DEBYE_KV_PER_CM * field * along)
    top = Top.from_constants("A=10000 B=6000 C=4000 MHz", dipole_abc_debye=dipole)
    for light, operator in (("parallel", along), ("perpendicular", across)):
        squares = 3 * np.abs(vectors.conj().T @ operator @ vectors) ** 2
        lines = field_lines(top, [field], j_highest=1, light=light, jmax=3, tolerance_mhz=1e9)
        assert len(lines) >= 2
        for line in range(len(lines)):
            high = np.abs(energies - lines.lower_mhz[line] - lines.frequency_mhz[line]) < 0.01  # QuTiP's sums, 1e-3 MHz
            low = np.abs(energies - lines.lower_mhz[line]) < 0.01
            assert lines.strength_debye2[line] == pytest.approx(squares[np.ix_(high, low)].sum(), abs=1e-6)  # the same


def test_lobes_of_ocs_have_the_published_pattern():
    """J = 1 - 0, M = 0: +5.68392 MHz/(kV/cm)² with light along the field; M = ±1 across it (Townes and Schawlow: 8/15, 2/15 - ...)."""
    fields = np.linspace(0, 0.5, 11)
    along = line_coefficients(field_lines(OCS, fields, j_highest=1, tolerance_mhz=1e-9).lobes("1", "0"))
    across = line_coefficients(
        field_lines(OCS, fields, j_highest=1, light="perpendicular", tolerance_mhz=1e-9).lobes("1", "0")
    )
    assert along.coefficients[:, 1] == pytest.approx([5.68392], abs=1e-5)  # digits of the reference
    assert across.coefficients[:, 1] == pytest.approx([-1.06573501 + 3.55245003], abs=1e-5)  # the same
    assert not across.coefficients[:, ::2].any()  # parity
    with pytest.raises(ValueError, match="no line 3 - 2"):
        field_lines(OCS, fields, j_highest=1).lobes("3", "2")


# Mixtures


def test_at_high_temperature_orientation_is_the_function_of_langevin():
    """coth x - 1/x, x = μE/kT = 1.1; quantum corrections are of the order B/kT = 0.01."""
    mixture = field_mixture(OCS, [0.0, 2000.0], 32.0, left_out=1e-5, tolerance_mhz=1.0)
    x = 0.71519 * MHZ_PER_DEBYE_KV_PER_CM * 2000.0 / (32.0 * MHZ_PER_K)
    assert mixture.cosines["costheta"][1] == pytest.approx(1 / np.tanh(x) - 1 / x, rel=5e-3)  # B/kT of it
    assert mixture.cosines["costheta"][0] == pytest.approx(0.0, abs=1e-9)
    assert mixture.left_out < 1e-4


def test_in_equilibrium_the_dipole_is_the_slope_of_the_free_energy():
    """kT ∂lnQ/∂E for a top with two dipole components."""
    fields, temperature = np.array([19.9, 20.0, 20.1]), 1.0
    mixture = field_mixture(PLANE, fields, temperature, left_out=1e-4, tolerance_mhz=1e-3)
    slope = temperature * MHZ_PER_K * (np.log(mixture.q[2]) - np.log(mixture.q[0])) / 0.2
    assert mixture.mu_eff_debye[1] == pytest.approx(slope / MHZ_PER_DEBYE_KV_PER_CM, rel=1e-5)  # third derivative


def test_an_adiabatic_mixture_has_the_populations_of_the_free_top():
    mixture = field_mixture(OCS, [0.0, 50.0], 0.5, populations="adiabatic", left_out=1e-4)
    energies = 6081.492475 * np.array([0, 2, 6, 12, 20])
    free = np.exp(-energies / (0.5 * MHZ_PER_K))
    share = free / ((2 * np.arange(5) + 1) @ free)
    rows = {(int(mixture.map.label[r.start]), int(mixture.map.m[r.start])): r for r in mixture.map.curves()}
    expected = sum(share[j] * (2 if m else 1) * mixture.map.cosines["costheta"][r][1] for (j, m), r in rows.items())
    assert mixture.cosines["costheta"][1] == pytest.approx(expected, abs=1e-6)  # population above J = 4


# A field that varies over the sample


def test_a_spread_of_fields_smears_a_first_order_line_into_its_distribution():
    """1 1 -> 1 -1 at M = 1 moves as 2·μE/2: the spectrum is the distribution of fields, seen through a narrow line."""
    lines = field_lines(CH3F_LIKE, np.linspace(0.5, 1.5, 21), j_highest=2, light="parallel", temperature_k=10.0)
    lobe = lines.lobes("2 1", "1 1")
    component = lobe.where((lobe.upper_m == 1) & (lobe.lower_m == 1))
    uniform = FieldDistribution.uniform(0.8, 1.2)
    sharp = field_spectrum(component, np.linspace(1e5, 1.04e5, 4001), 1.0, fwhm_mhz=5.0)
    grid = sharp.frequency_mhz
    smeared = field_spectrum(component, grid, uniform, fwhm_mhz=5.0)
    area, mean = np.trapezoid(sharp.intensity, grid), np.trapezoid(smeared.intensity, grid)
    assert mean == pytest.approx(area, rel=1e-2)  # intensity changes by μE/kT over the fields
    inside = smeared.intensity > smeared.intensity.max() / 2
    edges = [np.interp(x, component.fields, component.frequency_mhz[component.pairs()[0]]) for x in (0.8, 1.2)]
    assert np.ptp(grid[inside]) == pytest.approx(abs(edges[1] - edges[0]), abs=4.0)  # half a width at each end
    assert FieldDistribution.gaussian(1.0, 0.01).weights(np.linspace(0.95, 1.05, 101)).sum() == pytest.approx(1.0)


# Deflection


def test_table_for_deflection():
    computed = deflection_table(stark_map(OCS, np.linspace(0, 50, 6), j_highest=1))
    assert list(computed.columns) == ["field_kv_per_cm", "mu_eff_debye 0 M0", "mu_eff_debye 1 M0", "mu_eff_debye 1 M1"]
    assert computed.mu_eff_debye[0, 1] == pytest.approx(2 * 3.55245003 * 10 / MHZ_PER_DEBYE_KV_PER_CM, rel=0.1)  # E⁴
    shares = computed.populations(1.0)
    assert shares[2] / shares[1] == pytest.approx(2.0)  # M and -M
    assert shares[1] / shares[0] == pytest.approx(np.exp(-2 * 6081.492475 / MHZ_PER_K))
    with pytest.raises(ValueError, match="evenly"):
        deflection_table(stark_map(OCS, [0.0, 1.0, 5.0], j_highest=0))


# Directions


@pytest.mark.parametrize("top", [OCS, PLANE])
def test_energies_do_not_know_the_direction_of_the_field(top):
    straight = stark_map(top, [0.0, 30.0], j_highest=1, tolerance_mhz=1e-3)
    turned = stark_map(top, [0.0, 30.0], j_highest=1, direction=(1, 2, 2), tolerance_mhz=1e-3)
    for field in (0.0, 30.0):
        here, there = straight.field == field, turned.field == field
        all_m = np.sort(np.repeat(straight.energy_mhz[here], straight.copies[here]))
        assert np.sort(turned.energy_mhz[there]) == pytest.approx(all_m, abs=1e-3)  # the tolerance
    assert (turned.m == -1).all()


def test_light_at_an_angle_with_the_field():
    """Light along Z and a field along X are light along X and a field along Z: against the full matrix of one J cut."""
    top = OCS.with_polarizability(np.diag([4.0, 0, 0]), "test")
    stark = stark_map(top, [40.0], j_highest=1, direction=(1, 0, 0), intensity_w_per_cm2=1e11, tolerance_mhz=1e-3)
    straight = stark_map(top, [40.0], j_highest=1, intensity_w_per_cm2=1e11, tolerance_mhz=1e-3)
    assert stark.energy_mhz.min() > straight.energy_mhz.min() + 1000.0  # crossed fields compete
    size = 1e11 * 2 * np.pi * 1e-26 / (299792458.0 * 6.62607015e-34) * 1e-6 * 4.0
    basis = [(j, 0, m) for j in range(stark.jmax + 1) for m in range(-j, j + 1)]
    cosines = {axis: contracted_vectors(basis, [0, 0, 1.0], np.eye(3)[axis]) for axis in (0, 2)}
    matrix = np.diag([6081.492475 * j * (j + 1) for j, _, _ in basis]).astype(complex)
    matrix -= MHZ_PER_DEBYE_KV_PER_CM * 0.71519 * 40.0 * cosines[0] + size * cosines[2] @ cosines[2]
    assert np.sort(stark.energy_mhz) == pytest.approx(np.linalg.eigvalsh(matrix)[: len(stark)], abs=2e-3)  # tolerance


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: field_lines(OCS, [1.0], light="up"), "light 'up'"),
        (lambda: field_lines(OCS, [1.0], temperature_k=0.0), "temperature_k"),
        (lambda: field_lines(OCS, [1.0], populations="cold"), "populations"),
        (lambda: field_mixture(OCS, [1.0], 3000.0), "above J = 60"),
        (lambda: stark_map(OCS, [1.0], direction=(0, 0, 0)), "direction"),
        (lambda: stark_map(OCS, [1.0], direction=(1, 0, 0), m_values=(0,)), "mixes M"),
        (lambda: FieldDistribution.gaussian(1.0, -1.0), "deviation"),
        (lambda: FieldDistribution(np.array([0.0, 1.0]), np.array([1.0, -1.0])), "density"),
        (lambda: field_spectrum(field_lines(OCS, [0.0, 1.0]), [1.0, 2.0], 5.0, fwhm_mhz=1.0), "cover the sample"),
    ],
)
def test_wrong_requests_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
