# long: 60
# %% [markdown]
# # Constants from a spectrum, nothing known
#
# From a raw spectrum of cold gas to the table of constants of a paper: peaks, the search for constants, what the peaks that are left
# hold, a fit with the full Hamiltonian, and a check with known constants. The spectrum is synthetic (two molecules at 2 K, foreign
# lines, a comb of spurs, noise), so that the answer is known. Background: `docs/assign.md`.

# %%
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import rotor
from rotor.api import assignment_figure, fit_intensities, loomis_wood_figure, pick_peaks, publication_table

# %matplotlib inline

rotor.api.use_style()

BAND = (8000.0, 14000.0)
NAMES = ("A", "B", "C", "DJ", "DJK", "DK", "d1", "d2")
TRUTH = [
    (2237.03, 1368.45, 884.21, 4e-5, 1e-4, 2e-4, -1e-5, -1e-6),
    (3614.2, 811.4, 702.9, 5e-5, 2e-4, 1e-3, -6e-6, -5e-7),
]
DIPOLES, HEIGHTS = [(0.0, 1.0, 0.6), (1.0, 0.0, 0.0)], [100.0, 35.0]


def lines_of(values, dipole, temperature_k=2.0):
    """Lines of a top in the band."""
    constants = rotor.Constants(**dict(zip(NAMES, values, strict=True)), reduction="S", representation="Ir")
    top = rotor.Top.from_constants(constants, dipole_abc_debye=dipole)
    return rotor.api.line_list(top, temperature_k=temperature_k, jmax=30, range_mhz=BAND)


# %% [markdown]
# ## A raw spectrum
#
# 240,001 points of 25 kHz, lines of 100 kHz full width at half maximum, noise of 0.3 with the strongest line at about 100.

# %%
rng = np.random.default_rng(16)
sticks = []
for values, dipole, height in zip(TRUTH, DIPOLES, HEIGHTS, strict=True):
    lines = lines_of(values, dipole)
    sticks.append((lines.frequency_mhz, height * lines.intensity_nm2_mhz / lines.intensity_nm2_mhz.max()))
sticks.append((rng.uniform(*BAND, 40), np.minimum(90.0, 2.0 * rng.random(40) ** (-1 / 0.8))))  # foreign lines
sticks.append((np.arange(8050.0, 14000.0, 250.0), np.full(24, 8.0)))  # harmonics of a clock
grid = np.linspace(*BAND, 240_001)
spectrum = 0.3 * rng.normal(size=len(grid))
for centre, height in zip(*(np.concatenate(part) for part in zip(*sticks, strict=True)), strict=True):
    if height > 0.01:
        at = slice(*np.searchsorted(grid, [centre - 0.4, centre + 0.4]))
        spectrum[at] += height * np.exp(-4 * np.log(2) * ((grid[at] - centre) / 0.1) ** 2)
figure, axes = plt.subplots(figsize=(9, 2.6))
axes.plot(grid, spectrum, color="0.3", linewidth=0.5)
axes.set(xlabel="Frequency (MHz)", ylabel="Signal", title="The raw spectrum")
plt.show()

# %% [markdown]
# ## Peaks
#
# Maxima above six times the noise, each with the standard error of its frequency.

# %%
peaks = pick_peaks(grid, spectrum)
print(peaks)
strong = sticks[0][1] > 5
nearest = np.array([np.abs(peaks.frequency_mhz - one).min() for one in sticks[0][0][strong]])
print(f"{len(peaks)} peaks; lines above 5 are met within {1000 * np.median(nearest):.1f} kHz (median)")
assert 150 < len(peaks) < 400
assert np.median(nearest) < 0.005

# %% [markdown]
# ## The search
#
# Nothing is given but the peaks. The harmonics of the clock are set aside; both molecules are found, with the types of their lines,
# the ratio of dipole components, and a probability.

# %%
answer = rotor.assign(np.column_stack([peaks.frequency_mhz, peaks.intensity, peaks.uncertainty_mhz]), species=2)
table = {}
for number, (species, values) in enumerate(zip(answer.species, TRUTH, strict=True), start=1):
    constants = species.constants
    off = np.array([constants[name] - value for name, value in zip("ABC", values, strict=False)])
    errors = np.array([constants.uncertainties[name] for name in "ABC"])
    table[f"molecule {number}"] = {
        "answer": species.word,
        "lines": f"{len(species.lines)} of {species.kind} type",
        **{f"{name} (MHz)": f"{constants[name]:.5f}" for name in "ABC"},
        "off by (standard errors)": ", ".join(f"{value:.1f}" for value in off / errors),
        "|μa| : |μb| : |μc|": " : ".join(f"{value:.2f}" for value in species.dipole_ratio),
    }
    assert species.word == "certain"
    assert (np.abs(off) < 5 * errors).all()
assert [one.kind for one in answer.species] == ["bc", "a"]
assert answer.spurs.sum() >= 20
pd.DataFrame(table)

# %%
assignment_figure(answer, "Peaks above, predictions below, what is left")

# %% [markdown]
# ## What is left
#
# Foreign lines, and lines too weak to be told from them.

# %%
left = int(answer.unexplained.sum())
print(f"{left} peaks belong to nothing")
assert left < 80

# %% [markdown]
# ## The table
#
# The assigned lines were fitted with the full Hamiltonian; quartic constants that they do not determine are held near 0 by a-priori
# errors. The table in the form of a paper:

# %%
fit = answer.species[0].refined.fit
print(publication_table(fit))
assert fit.weighted_rms < 1.5

# %% [markdown]
# ## With known constants
#
# The temperature and the dipole ratios once more, now by a linear fit of the heights (`rotor spectrum --over`), and the Loomis-Wood
# rows: peaks of right constants stand below each other.

# %%
known = lines_of([answer.species[0].constants[name] for name in NAMES], (1.0, 1.0, 1.0), 5.0)
heights = fit_intensities(known, peaks)
print(f"T = {heights.temperature_k:.2f} ± {heights.temperature_error_k:.2f} K, |μ| {np.round(heights.dipole_ratio, 3)}")
assert abs(heights.temperature_k - 2.0) < 4 * heights.temperature_error_k + 0.02
assert np.abs(heights.dipole_ratio - [0.0, 1.0, 0.6]).max() < 0.03

# %%
loomis_wood_figure(known, heights.heights(known), peaks, "Peaks about the lines of the first molecule")
