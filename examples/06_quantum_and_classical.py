# %% [markdown]
# # Quantum lines and a classical gas
#
# A rotating dipole absorbs and emits in quantum and in classical mechanics alike. The classical gas has no lines: its dipole
# loses the memory of its direction, and the Fourier transform of that correlation function is a band. Where many levels are
# occupied the band is the envelope of the lines; where few are, the two differ.

# %%
import math
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import rotor
from rotor.api import (
    ASE_TIME_PS,
    EV_PER_K,
    GAS_CONSTANT,
    MHZ_PER_CM,
    Panel,
    band_figure,
    classical_band,
    compare_bands,
    dipole_band_area,
    free_gas_correlations,
    heat_capacity_figure,
    linear_curves,
    lines_area,
    plateau,
    rigid,
    short_time,
    thermodynamic_functions,
)

# %matplotlib inline

rotor.api.use_style()

data = Path("data")  # reference values, beside this notebook
tops = {name: rigid(rotor.read(name)) for name in ("water", "OCS")}  # distortion left out on both sides

# %% [markdown]
# ## Correlation of the dipole in time
#
# OCS is linear, and its correlation function C1 has a closed form. Water's dipole lies along the intermediate axis: C1 ends at
# zero. Ammonia's lies along the symmetry axis, and a part of C1 stays for ever.

# %%
kt = EV_PER_K * 300
times_ps = np.linspace(0, 4, 41)
correlations = {}
for name, ends_at in (("OCS", 0.0), ("water", 0.0), ("NH3", None)):
    top = rotor.read(name)
    moments, dipole = top.moments_u_angstrom2, top.dipole_abc_debye
    rng = np.random.default_rng(1)
    gas = free_gas_correlations(moments, kt, times_ps / ASE_TIME_PS, vector=dipole, molecules=10_000, rng=rng)
    stays = plateau(moments, dipole)
    second = short_time(moments, kt, dipole).m2 / ASE_TIME_PS**2
    correlations[name] = {
        "1 - C1 at short times (t in ps)": f"{second / 2:.3f} t²",
        "C1 at 4 ps": f"{gas.c1[-1]:.4f} ± {gas.c1_error[-1]:.4f}",
        "C1 at late times, closed form": f"{stays:.4f}",
    }
    assert ends_at is None or stays == ends_at
    if name == "OCS":
        closed, _ = linear_curves(times_ps / ASE_TIME_PS, moments[1], kt)
        assert np.abs((gas.c1 - closed)[1:] / gas.c1_error[1:]).max() < 4  # standard errors
    else:
        assert abs(gas.c1[-1] - stays) < 4 * gas.c1_error[-1]

pd.DataFrame(correlations).transpose()

# %% [markdown]
# ## One area for both
#
# [μ, [H, μ]] is a number for a rigid rotor. So the integrated absorption is Σ B_k (μ² - μ_k²) times a constant, classical or
# quantum, at any temperature: the sum over all lines shows it.

# %%
ratios = {name: {} for name in tops}
for name, top in tops.items():
    for kelvin in (300, 30):
        total = lines_area(rotor.api.line_list(top, temperature_k=kelvin, min_lgint=-14))
        ratios[name][f"sum of all lines / closed form, {kelvin} K"] = f"{total / dipole_band_area(top):.7f}"
        assert abs(total / dipole_band_area(top) - 1) < 3e-6  # lines below the cut

pd.DataFrame(ratios).transpose()

# %% [markdown]
# ## Band over lines
#
# Both are smoothed by the same Gaussian. The harmonic correction is what classical linear response gives; others put the
# missing detailed balance elsewhere, and disagree where it matters.

# %%
cases = [
    ("water", 300, 60, 700, ("harmonic", "standard"), 20_000),
    ("OCS", 300, 2, 60, ("harmonic",), 60_000),
    ("water", 30, 20, 240, ("harmonic", "schofield"), 20_000),
    ("OCS", 3, 0.2, 7, ("harmonic",), 20_000),
]
found, pairs, table = {}, [], []
with ThreadPoolExecutor(2) as pool:
    for name, kelvin, width, end, corrections, molecules in cases:
        top, grid = tops[name], np.linspace(0, end, 901) * MHZ_PER_CM
        lines = rotor.api.line_list(top, temperature_k=kelvin, min_lgint=-14)
        quantum = rotor.Spectrum.from_lines(lines, grid, fwhm_mhz=width * MHZ_PER_CM)
        bands = {}
        for correction in corrections:
            bands[correction] = classical_band(
                top, grid, fwhm_mhz=width * MHZ_PER_CM, temperature_k=kelvin, correction=correction, molecules=molecules,
                rng=np.random.default_rng(6), executor=pool,
            )  # fmt: skip
            found[name, kelvin, correction] = beside = compare_bands(bands[correction], quantum)
            table.append(
                {
                    "gas": f"{name}, {kelvin} K",
                    "correction": correction.replace("schofield", "Schofield"),
                    "area, band / lines": f"{beside.area:.4f}",
                    "mean frequency, band / lines": f"{beside.mean:.4f}",
                    "largest difference (% of the peak)": f"{100 * beside.largest:.1f}",
                    "at (cm⁻¹)": f"{beside.at_mhz / MHZ_PER_CM:.1f}",
                }
            )
        named = {"Schofield" if each == "schofield" else each: band for each, band in bands.items()}
        pairs.append((f"{name}, {kelvin} K, smoothed to {width} cm⁻¹", named, quantum))

band_figure(pairs)

# %%
pd.DataFrame(table).set_index(["gas", "correction"])

# %%
hot, cold = found["water", 300, "harmonic"], found["water", 30, "harmonic"]
noise = 4 / math.sqrt(20_000)  # of an area
assert abs(hot.area - 1) < noise + 1e-3
assert abs(hot.mean - 1) < 0.03  # the classical band lies 1.4 % low
assert hot.largest < 0.05
assert found["OCS", 300, "harmonic"].largest < 0.06  # noise of 60,000 molecules; in closed form it is 0.001
assert found["OCS", 3, "harmonic"].largest > 0.2  # lines 2B = 0.4 cm⁻¹ apart are seen one by one
assert abs(found["water", 300, "standard"].area - 1) > 0.05  # this correction loses 7 % of the absorption
assert cold.largest > 0.3
assert cold.mean < 0.92
assert abs(cold.area - 1) < 2 * noise  # even there the area is the same

# %% [markdown]
# Where hB/kT is small, as for OCS at 300 K (0.001), band and lines are one curve. Water has hA/kT = 0.13 at 300 K: its band lies
# within 3 % of the peak. At 30 K a handful of lines is left, and the classical band lies where no line is. At high
# resolution there are lines at any temperature: those of OCS at 3 K stand 0.4 cm⁻¹ apart, the classical band runs through them.

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
heat_capacity_figure([Panel("H2", hydrogen), Panel("water", {"quantum": water})])

# %%
at_70 = {kind: float(np.interp(70, kelvin, one.cv_over_r)) for kind, one in hydrogen.items()}
print("H2 at 70 K, C_v/R of rotation: " + ", ".join(f"{kind} {value:.3f}" for kind, value in at_70.items()))
assert at_70["normal"] < 0.15  # of 1
assert at_70["para"] > 50 * at_70["ortho"]  # the first steps are 510 K and 845 K high, e^(335/70) = 120
assert abs(float(np.interp(70, kelvin, water.cv_over_r)) - 1.5) < 0.03

# %% [markdown]
# ## Against published heat capacities
#
# Para, ortho and normal hydrogen: the formulas of J. W. Leachman et al., J. Phys. Chem. Ref. Data 38 (2009) 721. Hydrogen in
# equilibrium, and water: M. W. Chase, NIST-JANAF Thermochemical Tables, 4th ed. (1998). The file has
# the numbers and says where each was read. The curves are rotation alone, C_p = C_v(rotation) + 5/2 R: above 400 K the
# published values of water rise above it, which is its bending vibration. Equilibrium hydrogen has a peak that no frozen
# mixture has: it is the heat of conversion from para to ortho.

# %%
known = tomllib.loads((data / "heat_capacity.toml").read_text(encoding="utf-8"))
janaf = {table["molecule"]: table for table in known["table"]}
leachman = {formula["species"]: formula for formula in known["einstein"] if "Leachman" in formula["source"]}


def cp_over_r(formula, t):
    """5/2 + Σ u (v/T)² e^(v/T) / (e^(v/T) - 1)²."""
    x = np.array(formula["v"])[:, None] / t
    return 2.5 + np.array(formula["u"]) @ (x**2 * np.exp(-x) / np.expm1(-x) ** 2)


figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
curve_k, published_k = np.linspace(15, 500, 200), np.linspace(20, 400, 20)
worst = {}
for color, species in zip(("C0", "C1", "C2", "C3"), ("para", "ortho", "normal", "equilibrium"), strict=True):
    ours = thermodynamic_functions(rotor.read("H2"), curve_k, species=species).cv_over_r + 2.5
    left.plot(curve_k, ours, color=color, label=species)
    if species in leachman:
        t, values = published_k, cp_over_r(leachman[species], published_k)
    else:
        t, values = np.array(janaf["H2"]["temperature_k"][:7], float), np.array(janaf["H2"]["cp"][:7]) / GAS_CONSTANT
    left.plot(t, values, "o", ms=3, color=color)
    worst[species] = np.abs(
        thermodynamic_functions(rotor.read("H2"), t, species=species).cv_over_r + 2.5 - values
    ).max()
left.set(xlabel="Temperature (K)", ylabel="Heat capacity $C_p/R$", title="Hydrogen; dots: published", ylim=(2.4, 4.8))
left.legend()

t, values = np.array(janaf["H2O"]["temperature_k"], float), np.array(janaf["H2O"]["cp"]) / GAS_CONSTANT
rotation = thermodynamic_functions(rotor.read("water"), t).cv_over_r + 2.5
right.plot(t, rotation, label="rotation, quantum")
right.plot(t, values, "o", ms=4, label="JANAF")
right.axhline(4.0, color="black", lw=0.5, ls="--", label="classical, 4 R")
right.set(
    xlabel="Temperature (K)", ylabel="Heat capacity $C_p/R$", title="Water: vibration begins at 300 K", ylim=(3.9, 5.1)
)
right.legend()
differences = {f"{species} hydrogen, largest to 400 K": value for species, value in worst.items()}
differences |= {f"water, {t[row]:.0f} K": rotation[row] - values[row] for row in (0, 1)}
pd.DataFrame({"C_p/R, calculated - published": differences}).map("{:.4f}".format)

# %%
assert worst["equilibrium"] < 4e-4  # 2.5e-3 J/(mol K), the last digits printed, in units of R
assert max(worst[species] for species in leachman) < 2.5e-3  # how well the formulas meet their own levels, 0.1 % of C_p
assert abs(rotation[0] - values[0]) < 4e-4
assert 0 < values[1] - rotation[1] < 2e-3  # the bending vibration at 200 K, (hν/kT)² exp(-hν/kT)
