"""Selection of the channels for a fit of a crowded spectrum: near lines of its species, and without lines of other species.

Lines of species outside the model make the spectrum brighter, never darker. Channels that exceed the fitted model by more than a few
standard deviations are left out and the fit is repeated; channels that the new model explains return. This ends when no channel changes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rotor.observed.fit import FitChoices, SourceFit, fit_source
from rotor.observed.model.model import KM_PER_S, Component, Sight, model
from rotor.observed.spectrum import ObservedSpectrum

_ROUNDS = 10
_LEAST = 3  # channels a parameter


def near_lines(
    spectrum: ObservedSpectrum, components: Sequence[Component], sight: Sight, widths: float
) -> NDArray[np.bool_]:
    """Mask (n,) of the channels within `widths` line widths of a line of any component."""
    near = np.zeros(len(spectrum), dtype=np.bool_)
    for component in components:
        centre = component.species.frequency_mhz * (1 - component.velocity_km_s / KM_PER_S) / (1 + sight.redshift)
        reach = widths * component.fwhm_km_s / KM_PER_S * centre
        first, last = (np.searchsorted(spectrum.frequency_mhz, centre + side * reach) for side in (-1, 1))
        for a, b in zip(first.tolist(), last.tolist(), strict=True):
            near[a:b] = True
    return near


def fit_rejecting(
    spectrum: ObservedSpectrum,
    components: Sequence[Component],
    sight: Sight | None = None,
    choices: FitChoices | None = None,
    *,
    deviations: float = 4.0,
    widths: float = 3.0,
) -> SourceFit:
    """Fit of a crowded spectrum, restricted to channels near the lines and without channels that other species make brighter.

    Parameters
    ----------
    spectrum, components, sight, choices :
        As in `fit_source`.
    deviations : float, optional
        A channel further above the model than this, in standard deviations, is left out.
    widths : float, optional
        Distance from each line, in line widths.

    Returns
    -------
    SourceFit
        The fit; its spectrum has only the selected channels.

    Raises
    ------
    ValueError
        If fewer than three channels for each parameter remain.
    """
    sight, choices = sight or Sight(), choices or FitChoices()
    near = near_lines(spectrum, components, sight, widths)

    def explained(parts: Sequence[Component]) -> NDArray[np.bool_]:
        brightness = model(parts, spectrum.frequency_mhz, sight).brightness_k
        sigma = np.hypot(spectrum.noise, choices.calibration * brightness)
        return near & (spectrum.intensity - brightness < deviations * sigma)

    used = explained(components)
    least = _LEAST * len(choices.free) * len(components)
    fit = None
    for _ in range(_ROUNDS):
        if used.sum() < least:
            raise ValueError(
                f"{int(used.sum())} of {len(spectrum)} channels are near lines and not brighter than the model; expected {least}"
            )
        begin = components if fit is None else fit.components
        fit = fit_source(spectrum.where(used), begin, sight, choices)
        again = explained(fit.components)
        if (again == used).all():
            break
        used = again
    assert fit is not None
    return fit
