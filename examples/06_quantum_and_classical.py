# %% [markdown]
# # Quantum lines and a classical gas
#
# A rotating dipole radiates whether Bohr or Newton looks at it. The classical gas has no lines: its dipole forgets where it
# pointed, and the Fourier transform of that memory is a band. Where many levels are occupied the band is the envelope of the
# lines; where few are, the two part. Pictures go to the folder given on the command line, if one is.

# %%
import math
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

import rotor
from rotor.classical.gas.correlations import linear_curves, plateau, short_time
from rotor.classical.gas.ensembles import free_gas_correlations
from rotor.plots.gas import band_figure
from rotor.plots.heat_capacity import Panel, plot_heat_capacity
from rotor.spectra.classical_band import classical_band, compare_bands, dipole_band_area, lines_area, rigid
from rotor.thermo import thermodynamic_functions
from rotor.units import ASE_TIME_PS, EV_PER_K, MHZ_PER_CM

folder = Path(sys.argv[1]) if len(sys.argv) > 1 and Path(sys.argv[1]).is_dir() else None
tops = {name: rigid(rotor.read(name)) for name in ("water", "OCS")}  # distortion left out on both sides

# %% [markdown]
# ## How fast a gas forgets
#
# OCS is linear, and its memory has a closed form. Water's dipole lies along the intermediate axis, which no L stays with: it is
# forgotten for ever. Ammonia's is not.

# %%
kt = EV_PER_K * 300
times_ps = np.linspace(0, 4, 41)
for name, remains in (("OCS", 0.0), ("water", 0.0), ("NH3", None)):
    top = rotor.read(name)
    moments, dipole = top.moments_u_angstrom2, top.dipole_abc_debye
    rng = np.random.default_rng(1)
    gas = free_gas_correlations(moments, kt, times_ps / ASE_TIME_PS, vector=dipole, molecules=10_000, rng=rng)
    stays = plateau(moments, dipole)
    second = short_time(moments, kt, dipole).m2 / ASE_TIME_PS**2
    print(
        f"{name:6s} C1 = 1 - {second / 2:7.3f} t² + ..., ends at {stays:.4f}; at 4 ps {gas.c1[-1]:+.4f} ± {gas.c1_error[-1]:.4f}"
    )
    assert remains is None or stays == remains
    if name == "OCS":
        closed, _ = linear_curves(times_ps / ASE_TIME_PS, moments[1], kt)
        assert np.abs((gas.c1 - closed)[1:] / gas.c1_error[1:]).max() < 4  # standard errors
    else:
        assert abs(gas.c1[-1] - stays) < 4 * gas.c1_error[-1]

# %% [markdown]
# ## One area for both
#
# [μ, [H, μ]] is a number for a rigid rotor. So the integrated absorption is Σ B_k (μ² - μ_k²) times a constant, classical or
# quantum, at any temperature: the sum over all lines shows it.

# %%
for name, top in tops.items():
    for kelvin in (300, 30):
        total = lines_area(rotor.line_list(top, temperature_k=kelvin, min_lgint=-14))
        print(f"{name:6s} {kelvin:4d} K: all lines over the closed form {total / dipole_band_area(top):.7f}")
        assert abs(total / dipole_band_area(top) - 1) < 3e-6  # lines below the cut

# %% [markdown]
# ## Band over lines
#
# Both are smoothed by the same Gaussian. The harmonic correction is what classical linear response gives; others put the
# missing detailed balance elsewhere, and disagree where it matters.

# %%
cases = [
    ("water", 300, 60, 700, ("harmonic", "standard"), 50_000),
    ("OCS", 300, 2, 60, ("harmonic",), 150_000),
    ("water", 30, 20, 240, ("harmonic", "schofield"), 50_000),
    ("OCS", 3, 0.2, 7, ("harmonic",), 50_000),
]
found, pairs = {}, []
with ThreadPoolExecutor(2) as pool:
    for name, kelvin, width, end, corrections, molecules in cases:
        top, grid = tops[name], np.linspace(0, end, 901) * MHZ_PER_CM
        lines = rotor.line_list(top, temperature_k=kelvin, min_lgint=-14)
        quantum = rotor.Spectrum.from_lines(lines, grid, fwhm_mhz=width * MHZ_PER_CM)
        bands = {}
        for correction in corrections:
            bands[correction] = classical_band(
                top, grid, fwhm_mhz=width * MHZ_PER_CM, temperature_k=kelvin, correction=correction, molecules=molecules,
                rng=np.random.default_rng(6), executor=pool,
            )  # fmt: skip
            found[name, kelvin, correction] = beside = compare_bands(bands[correction], quantum)
            print(
                f"{name:6s} {kelvin:4d} K, {correction:9s}: area {beside.area:.4f}, mean frequency {beside.mean:.4f}, largest "
                f"difference {100 * beside.largest:4.1f} % of the peak, at {beside.at_mhz / MHZ_PER_CM:.1f} cm⁻¹"
            )
        pairs.append((f"{name}, {kelvin} K, smoothed to {width} cm⁻¹", bands, quantum))

if folder is not None:
    band_figure(pairs).savefig(folder / "quantum_and_classical.png", dpi=160)

hot, cold = found["water", 300, "harmonic"], found["water", 30, "harmonic"]
noise = 4 / math.sqrt(50_000)  # of an area
assert abs(hot.area - 1) < noise + 1e-3
assert abs(hot.mean - 1) < 0.03  # the classical band lies 1.4 % low
assert hot.largest < 0.05
assert found["OCS", 300, "harmonic"].largest < 0.04  # 150,000 molecules; in closed form it is 0.001
assert found["OCS", 3, "harmonic"].largest > 0.2  # lines 2B = 0.4 cm⁻¹ apart are seen one by one
assert abs(found["water", 300, "standard"].area - 1) > 0.05  # this correction loses 7 % of the absorption
assert cold.largest > 0.3
assert cold.mean < 0.92
assert abs(cold.area - 1) < 2 * noise  # even there the area is the same

# %% [markdown]
# Where hB/kT is small, as for OCS at 300 K (0.001), band and lines are one curve. Water has hA/kT = 0.13 at 300 K: its band lies
# within 3 % of the peak. At 30 K a handful of lines is left, and the classical band lies where no line is. A reader who looks
# closely enough sees lines at any temperature: those of OCS at 3 K stand 0.4 cm⁻¹ apart, the classical band runs through them.

# %% [markdown]
# ## Heat capacities part in the same way
#
# Frozen levels store nothing. Hydrogen's are so far apart that even at 70 K it has hardly begun to rotate, and how far it has
# depends on its nuclear spins; water is classical from 70 K upwards.

# %%
kelvin = np.geomspace(5, 1000, 150)
hydrogen = {
    kind: thermodynamic_functions(rotor.read("H2"), kelvin, species=kind) for kind in ("normal", "para", "ortho")
}
water = thermodynamic_functions(rotor.read("water"), kelvin)
if folder is not None:
    plot_heat_capacity([Panel("H2", hydrogen), Panel("water", {"quantum": water})], folder / "heat_capacities.png")

at_70 = {kind: float(np.interp(70, kelvin, one.cv_over_r)) for kind, one in hydrogen.items()}
print("H2 at 70 K, C_v/R of rotation: " + ", ".join(f"{kind} {value:.3f}" for kind, value in at_70.items()))
assert at_70["normal"] < 0.15  # of 1
assert at_70["para"] > 50 * at_70["ortho"]  # the first steps are 510 K and 845 K high, e^(335/70) = 120
assert abs(float(np.interp(70, kelvin, water.cv_over_r)) - 1.5) < 0.03
