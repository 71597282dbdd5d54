"""Non-LTE through pythonradex: the limits of many and of few collisions, and a fit of an injected source."""

from pathlib import Path

import numpy as np
import pytest

from rotor import units
from rotor.observed.model.model import Component, Sight, model
from rotor.observed.model.partition import PartitionTable
from rotor.observed.model.species import species_lines, strength_from_einstein
from rotor.observed.spectrum import observed_spectrum

pytest.importorskip("pythonradex")

from rotor.observed.model.non_lte import NonLteComponent, excited_lines, fit_non_lte, non_lte_brightness

B_CM = 1.9225
J = np.arange(12)
ENERGY = B_CM * J * (J + 1)
FREQUENCY = 2 * B_CM * units.MHZ_PER_CM * J[1:]
EINSTEIN = 7.2e-8 * J[1:] ** 4 * 3 / (2 * J[1:] + 1)
RATE = 3e-11  # cm³/s of every downward collision


@pytest.fixture
def lamda(tmp_path: Path) -> Path:
    """A rotor in the form of LAMDA, with the same rate for each downward collision at each temperature."""
    lines = [
        "!MOLECULE",
        "rotor",
        "!MOLECULAR WEIGHT",
        "28.0",
        "!NUMBER OF ENERGY LEVELS",
        str(len(J)),
        "!LEVEL + ENERGIES(cm^-1) + WEIGHT + J",
    ]
    lines += [f"{j + 1} {e:.9f} {2 * j + 1:.1f} {j}" for j, e in zip(J, ENERGY, strict=True)]
    lines += [
        "!NUMBER OF RADIATIVE TRANSITIONS",
        str(len(J) - 1),
        "!TRANS + UP + LOW + EINSTEINA(s^-1) + FREQ(GHz) + E_u(K)",
    ]
    lines += [
        f"{i + 1} {i + 2} {i + 1} {a:.9e} {f / 1e3:.9f} {ENERGY[i + 1] * 1.4388:.4f}"
        for i, (a, f) in enumerate(zip(EINSTEIN, FREQUENCY, strict=True))
    ]
    pairs = [(u, w) for u in range(1, len(J)) for w in range(u)]
    lines += [
        "!NUMBER OF COLL PARTNERS",
        "1",
        "!COLLISIONS BETWEEN",
        "1 rotor-H2 ! made for a test",
        "!NUMBER OF COLL TRANS",
        str(len(pairs)),
    ]
    lines += [
        "!NUMBER OF COLL TEMPS",
        "3",
        "!COLL TEMPS",
        "10.0 100.0 500.0",
        "!TRANS + UP + LOW + COLLRATES(cm^3 s^-1)",
    ]
    lines += [f"{n + 1} {u + 1} {w + 1} {RATE:.3e} {RATE:.3e} {RATE:.3e}" for n, (u, w) in enumerate(pairs)]
    (tmp_path / "rotor.dat").write_text("\n".join(lines) + "\n")
    return tmp_path / "rotor.dat"


GRID = np.sort(np.concatenate([np.linspace(f * (1 - 2e-5), f * (1 + 2e-5), 81) for f in FREQUENCY[:5]]))


def test_many_collisions_are_lte(lamda: Path) -> None:
    """n = 1e12 cm⁻³, n C/A above 1e4: the model in LTE with Q summed over the same levels."""
    kelvin = np.geomspace(10.0, 200.0, 60)
    energy_k = ENERGY * units.MHZ_PER_CM / units.MHZ_PER_K
    q = [float(np.sum((2 * J + 1) * np.exp(-energy_k / t))) for t in kelvin]
    strength = strength_from_einstein(EINSTEIN, FREQUENCY, 2 * J[1:] + 1)
    species = species_lines("rotor", FREQUENCY, strength, energy_k[:-1], 2 * J[1:] + 1, PartitionTable(kelvin, q))
    for column in (1e14, 3e17):
        exact = model([Component(species, column, 40.0, 0.0, 2.0)], GRID).brightness_k
        found = non_lte_brightness(NonLteComponent(lamda, column, 40.0, 1e12, fwhm_km_s=2.0), GRID)
        assert (
            np.abs(found - exact).max() < 2e-3 * exact.max()
        )  # A/(n C), and the convergence of pythonradex, 1e-6 of populations


def test_without_collisions_lines_vanish(lamda: Path) -> None:
    """Levels in equilibrium with the background emit what they absorb."""
    lines = excited_lines(NonLteComponent(lamda, 1e13, 40.0, 1e-6))
    assert np.allclose(lines.excitation_k[:4], 2.725, atol=0.02)
    assert np.abs(non_lte_brightness(NonLteComponent(lamda, 1e13, 40.0, 1e-6), GRID)).max() < 1e-4


def test_excitation_rises_from_the_background_to_the_gas(lamda: Path) -> None:
    kelvin = [excited_lines(NonLteComponent(lamda, 1e12, 40.0, n)).excitation_k[0] for n in (1.0, 10.0, 100.0, 1e12)]
    assert 2.725 < kelvin[0] < kelvin[1] < kelvin[2]
    assert kelvin[-1] == pytest.approx(40.0, rel=1e-3)


@pytest.mark.slow
def test_fit_of_an_injected_source(lamda: Path) -> None:
    true = NonLteComponent(lamda, 3e15, 40.0, 3e4, velocity_km_s=0.3, fwhm_km_s=2.0)
    rng = np.random.default_rng(1)
    noise = 0.02
    spectrum = observed_spectrum(GRID, non_lte_brightness(true, GRID) + rng.normal(0, noise, len(GRID)), noise=noise)
    fit = fit_non_lte(spectrum, NonLteComponent(lamda, 2e15, 50.0, 5e4, fwhm_km_s=2.3))
    assert fit.minimum.rms == pytest.approx(1.0, abs=0.1)  # 405 channels
    for name, error in fit.errors.items():
        assert abs(getattr(fit.component, name) - getattr(true, name)) < 4 * error, name


def test_mistakes_are_named(lamda: Path, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="density_per_cm3"):
        NonLteComponent(lamda, 1e15, 40.0, -1.0)
    with pytest.raises(ValueError, match="geometry 'cube'"):
        NonLteComponent(lamda, 1e15, 40.0, 1.0, geometry="cube")
    with pytest.raises(ValueError, match=r"none\.dat"):
        excited_lines(NonLteComponent(tmp_path / "none.dat", 1e15, 40.0, 1.0))
    (tmp_path / "bad.dat").write_text("nothing\n")
    with pytest.raises(ValueError, match="not a file of LAMDA"):
        excited_lines(NonLteComponent(tmp_path / "bad.dat", 1e15, 40.0, 1.0))
    with pytest.raises(ValueError, match="without a beam"):
        non_lte_brightness(NonLteComponent(lamda, 1e15, 40.0, 1e4, size_arcsec=1.0), GRID, Sight())
