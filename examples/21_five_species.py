# %% [markdown]
# # Five species of IRAS 16293-2422 B beside their published model
#
# Column densities and temperatures of glycolaldehyde, ethylene oxide, methyl isocyanate, glycol and propanal from an ALMA Band 6 spectrum
# (PILS survey, J. K. Jørgensen et al., Astron. Astrophys. 595, A117 (2016)), next to the model that was published for them.
# Background: `docs/observed.md`; a first fit: the notebook of observed spectra.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import rotor
from rotor.api import (
    Component,
    FitChoices,
    ReadChoices,
    Sight,
    fit_rejecting,
    model,
    read_cat_species,
    read_spectrum,
    start_components,
)

# %matplotlib inline

rotor.api.use_style()

folder = Path("data/observed/five_species")  # beside this notebook

# %% [markdown]
# ## Spectrum and lines
#
# The channels of the spectrum near lines of the five species, 233.7 to 236.8 GHz; the noise of the whole spectrum is 0.29 K. Lines and
# Q(T) are those of CDMS. The published temperatures were adopted, not fitted, and its column densities hold a vibrational correction,
# which is divided out here.

# %%
spectrum = read_spectrum(folder / "spectrum.csv.gz", ReadChoices(noise=0.29))
published = {  # tag: column density (1/cm²), vibrational correction, temperature (K)
    "c060501": (1.7e16, 1.47, 300.0),
    "c044504": (6.1e15, 1.489, 125.0),
    "c057505": (4.0e15, 1.0, 100.0),
    "c062504": (2.5e16, 4.02, 300.0),
    "c058505": (2.2e15, 1.489, 125.0),
}
species = {tag: read_cat_species(folder / f"{tag}.cat") for tag in published}
pd.DataFrame({"lines": {lines.name: len(lines) for lines in species.values()}})

# %%
assert len(spectrum) == 5076

# %% [markdown]
# ## One fit for each species
#
# Source and beam are taken as 0.5″. The spectrum is crowded: channels that lie more than four deviations above the model belong to other
# species and are left out, so that the start matters. It is estimated from the spectrum.

# %%
sight = Sight(beam_arcsec=0.5)
choices = FitChoices(calibration=0.1)
fits = {}
for tag, lines in species.items():
    start = start_components(spectrum, [lines], sight, velocity_km_s=0.0, fwhm_km_s=1.0, size_arcsec=0.5)
    fits[tag] = fit_rejecting(spectrum, start, sight, choices, deviations=4.0)

rows = {}
for tag, fit in fits.items():
    column, kelvin, velocity, _ = fit.parameters
    total, correction, published_k = published[tag]
    error = f"± {kelvin['error']:3.0f}" if kelvin["determined"] else "bound"
    rows[species[tag].name] = {
        "N (1e15/cm²)": f"{column['value'] / 1e15:.2f} ± {column['error'] / 1e15:.2f}",
        "N published": f"{total / correction / 1e15:.2f}",
        "T (K)": f"{kelvin['value']:.0f} {error}",
        "T published": f"{published_k:.0f}",
        "v (km/s)": f"{velocity['value']:.2f}",
    }
pd.DataFrame(rows).transpose()

# %%
ratio = {
    name: fits[name].components[0].column_per_cm2 / (value / factor) for name, (value, factor, _) in published.items()
}
assert all(0.5 < ratio[tag] < 1.3 for tag in ("c060501", "c044504", "c057505", "c062504"))
assert all(-0.25 < fit.components[0].velocity_km_s < 0.1 for fit in fits.values())  # published: -0.2 km/s
assert all(0.8 < fit.components[0].fwhm_km_s < 1.4 for fit in fits.values())  # published: 1.0 km/s
assert abs(fits["c044504"].components[0].excitation_k - 125.0) < 15

# %% [markdown]
# Four column densities lie within a factor of two of the published ones. Propanal runs to 600 K, where its Q(T) ends, and is held there:
# its lines are weak and blended, and its temperature does not follow from them. At the published temperature:

# %%
start = start_components(
    spectrum, [species["c058505"]], sight, velocity_km_s=0.0, fwhm_km_s=1.0, excitation_k=125.0, size_arcsec=0.5
)
fixed = FitChoices(calibration=0.1, fixed=((0, "excitation_k"),))
propanal = fit_rejecting(spectrum, start, sight, fixed, deviations=4.0)
propanal.to_pandas()

# %%
assert not fits["c058505"].parameters_of(0)["excitation_k"]["determined"]
assert propanal.components[0].excitation_k == 125.0

# %% [markdown]
# ## The strongest lines, and the two models
#
# Grey: observed. Orange: the fit. Blue: the published model, computed here. Bright lines that neither has belong to other species.

# %%
figure, panels = plt.subplots(1, 5, figsize=(11.5, 2.7))
for axes, (tag, fit) in zip(panels, fits.items(), strict=True):
    fitted = propanal.components[0] if tag == "c058505" else fit.components[0]
    total, correction, kelvin = published[tag]
    known = Component(species[tag], total / correction, kelvin, -0.2, 1.0, 0.5)
    bright = model([fitted], spectrum.frequency_mhz, sight).brightness_k
    middle = spectrum.frequency_mhz[np.argmax(bright)]
    near = np.abs(spectrum.frequency_mhz - middle) < 4
    offset = spectrum.frequency_mhz[near] - middle
    axes.step(offset, spectrum.intensity[near], where="mid", color="0.4", linewidth=0.8)
    axes.plot(offset, model([known], spectrum.frequency_mhz[near], sight).brightness_k, color="C0", linewidth=0.9)
    axes.plot(offset, bright[near], color="C1", linewidth=1.0)
    axes.set_ylim(-1, max(2.0, 2.2 * bright.max()))
    axes.set_title(f"{species[tag].name}\n{middle / 1e3:.3f} GHz", fontsize=8)
    axes.set_xlabel("Offset (MHz)")
panels[0].set_ylabel("Brightness temperature (K)")
figure.tight_layout()

# %% [markdown]
# ## All together
#
# Species that blend with one another belong into one fit; here with one velocity and one width for all, and propanal at its published
# temperature.

# %%
starts = [*(fit.components[0] for tag, fit in fits.items() if tag != "c058505"), propanal.components[0]]
joint = fit_rejecting(
    spectrum,
    starts,
    sight,
    FitChoices(calibration=0.1, shared=("velocity_km_s", "fwhm_km_s"), fixed=((4, "excitation_k"),)),
    deviations=4.0,
)
pd.DataFrame(
    [
        {"parameter": row["name"], "value": f"{row['value']:.4g}", "error": f"{row['error']:.2g}"}
        for row in joint.parameters
    ]
).set_index("parameter")

# %%
assert joint.minimum.converged
assert abs(joint.components[0].fwhm_km_s - 1.0) < 0.1
for before, component in zip(starts, joint.components, strict=True):
    assert 0.8 < component.column_per_cm2 / before.column_per_cm2 < 1.25
