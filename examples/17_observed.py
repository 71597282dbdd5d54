# %% [markdown]
# # An observed spectrum
#
# From the spectrum of a telescope to a column density and a temperature: ethylene oxide around the protostar IRAS 16293-2422 B, in a
# piece of an ALMA spectrum (PILS survey, J. K. Jørgensen et al., Astron. Astrophys. 595, A117 (2016)). Read it, fit it, test on
# injected spectra what the errors are worth; a rotational diagram; which species a spectrum needs.
# Background: `docs/observed.md`.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import rotor
from rotor.api import (
    Component,
    FitChoices,
    IdentifyChoices,
    ReadChoices,
    Sight,
    contributions,
    fit_rejecting,
    fit_source,
    identify,
    model,
    observed_spectrum,
    plot_rotational_diagram,
    read_cat_species,
    read_spectrum,
    rotational_diagram,
    start_components,
)

# %matplotlib inline

rotor.api.use_style()

folder = Path("data/observed")  # observed spectra, beside this notebook

# %% [markdown]
# ## The spectrum and the lines
#
# 106 channels of 0.122 MHz around five groups of lines. The noise of the whole spectrum, from its line-free channels, is 0.29 K. Lines
# and Q(T) are those of CDMS.

# %%
spectrum = read_spectrum(folder / "iras16293_ethylene_oxide.csv", ReadChoices(noise=0.29))
species = read_cat_species(folder / "c044504.cat")
print(f"{len(spectrum)} channels, {len(species)} lines of {species.name}")
species.to_pandas()[["frequency_mhz", "energy_upper_k", "einstein_a_per_s", "upper", "lower"]]

# %%
assert len(spectrum) == 106
assert species.name == "Ethylene oxide"

# %% [markdown]
# ## A fit
#
# The source has 0.5″, as in the published model, and so has the beam here. Temperature and column density are estimated from the
# spectrum, then fitted with velocity and width. Other species have lines there too: channels far above the model are left out.

# %%
sight = Sight(beam_arcsec=0.5)
start = start_components(spectrum, [species], sight, velocity_km_s=0.0, fwhm_km_s=1.0, size_arcsec=0.5)
fit = fit_rejecting(spectrum, start, sight, FitChoices(calibration=0.1), deviations=4.0)
component = fit.components[0]
pd.DataFrame(
    [{"parameter": r["name"], "value": f"{r['value']:.5g}", "error": f"{r['error']:.2g}"} for r in fit.parameters]
)

# %%
assert abs(component.velocity_km_s - -0.2) < 0.1  # published: -0.2 km/s
assert abs(component.fwhm_km_s - 1.0) < 0.25  # published: 1.0 km/s
assert 100 < component.excitation_k < 250  # published: 125 K
assert 2e15 < component.column_per_cm2 < 8e15  # published: 6.1e15 with a vibrational factor of 1.489, 4.1e15 without
(only,) = contributions(fit)
assert only.needed

# %%
figure, panels = plt.subplots(1, 5, figsize=(11, 2.6), sharey=True)
gaps = np.flatnonzero(np.diff(spectrum.frequency_mhz) > 10) + 1
brightness = model(fit.components, spectrum.frequency_mhz, sight).brightness_k
for axes, part in zip(panels, np.split(np.arange(len(spectrum)), gaps), strict=True):
    offset = spectrum.frequency_mhz[part] - spectrum.frequency_mhz[part].mean()
    axes.step(offset, spectrum.intensity[part], where="mid", color="0.4", linewidth=0.8)
    axes.plot(offset, brightness[part], color="C1", linewidth=0.9)
    axes.set_title(f"{spectrum.frequency_mhz[part].mean() / 1e3:.4f} GHz", fontsize=8)
    axes.set_xlabel("Offset (MHz)")
panels[0].set_ylabel("Brightness temperature (K)")
figure.tight_layout()

# %% [markdown]
# ## What the errors are worth
#
# The same source injected 40 times with the noise of the spectrum: the scatter of the fits is their stated error.

# %%
rng = np.random.default_rng(17)
grid = spectrum.frequency_mhz
clean = model([component], grid, sight).brightness_k
pulls = []
for _ in range(40):
    injected = observed_spectrum(grid, clean + rng.normal(0, 0.29, len(grid)), noise=0.29)
    again = fit_source(injected, [component], sight)
    pulls.append((again.values - again.variables.values([component])) / again.statistics.errors)
pulls = np.array(pulls)
print("scatter over stated error:", np.round(pulls.std(axis=0), 2))
assert (np.abs(pulls.std(axis=0) - 1) < 0.4).all()  # 40 draws: 0.11

# %% [markdown]
# ## A rotational diagram
#
# Populations of the upper levels from integrated lines: thick lines lie below the straight line until they are corrected. An
# artificial rotor, without noise:

# %%
from rotor.api import (  # noqa: E402
    PartitionTable,
    species_lines,
    strength_from_einstein,
    units,
)

j = np.arange(12)
b_k = 10e3 / units.MHZ_PER_K
kelvin = np.geomspace(5, 200, 60)
q = [float(np.sum((2 * np.arange(200) + 1) * np.exp(-b_k * np.arange(200) * np.arange(1, 201) / t))) for t in kelvin]
frequency = 20e3 * (j + 1)
einstein = 1.1639654e-20 * frequency**3 * (j + 1) / (2 * j + 3)
strength = strength_from_einstein(einstein, frequency, 2 * j + 3)
rotor_lines = species_lines("rotor", frequency, strength, b_k * j * (j + 1), 2 * j + 3, PartitionTable(kelvin, q))
source = Component(rotor_lines, 1e16, 35.0, 0.0, 3.0)
grid = np.concatenate([np.arange(f - 10, f + 10, 0.05) for f in frequency[:6]])
diagram = rotational_diagram(observed_spectrum(grid, model([source], grid).brightness_k, noise=1e-4), [source])
figure, axes = plt.subplots(figsize=(5, 3.2))
plot_rotational_diagram(diagram, axes)
figure.tight_layout()
assert abs(diagram.excitation_k - 35.0) < 0.2
assert diagram.optical_depth.max() > 1

# %% [markdown]
# ## Which species?
#
# Thirty artificial species, three of them in a spectrum at -7 km/s: velocity and width are found with them.


# %%
def artificial(name):
    """A species with lines anywhere in the range."""
    count = int(rng.integers(4, 20))
    table = PartitionTable(np.geomspace(2, 600, 30), 0.5 * np.geomspace(2, 600, 30) ** 1.5)
    lines = rng.uniform(230e3, 230.6e3, count)
    return species_lines(
        name, lines, 10 ** rng.uniform(0, 1.5, count), rng.uniform(5, 400, count), np.full(count, 21), table
    )


candidates = [artificial(f"s{i}") for i in range(30)]
grid = np.arange(230e3, 230.6e3, 0.25)
there = [Component(candidates[i], n, t, -7.0, 3.0) for i, n, t in ((2, 3e16, 60.0), (7, 8e15, 30.0), (11, 2e16, 150.0))]
seen = observed_spectrum(grid, model(there, grid).brightness_k + rng.normal(0, 0.05, len(grid)), noise=0.05)
found = identify(seen, candidates, choices=IdentifyChoices())
found.to_pandas()

# %%
assert set(found.names) == {"s2", "s7", "s11"}
assert abs(found.velocity_km_s + 7) < 0.5
