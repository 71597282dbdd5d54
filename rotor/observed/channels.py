"""Which channels of a crowded spectrum a fit uses: those near the lines of its species, less those where another species shines.

Lines of species that are not in the model make the spectrum brighter, never darker. Channels in which it is above the fitted model by more
than some standard deviations are left out, the fit is repeated, and channels that the new model explains come back, until none changes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rotor.observed.fit import FitChoices, SourceFit, fit_source
from rotor.observed.model import KM_PER_S, Component, Sight, model
from rotor.observed.spectrum import ObservedSpectrum

_ROUNDS = 10
_LEAST = 3  # channels a parameter


def near_lines(
    spectrum: ObservedSpectrum, components: Sequence[Component], sight: Sight, widths: float
) -> NDArray[np.bool_]:
    """Channels (n,) within some widths of a line of any component."""
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
    """A fit of a crowded spectrum: channels near the lines alone, and without those that other species make brighter.

    Parameters
    ----------
    spectrum, components, sight, choices :
        As in `fit_source`.
    deviations : float, optional
        Standard deviations above the model from which a channel is left out.
    widths : float, optional
        Reach around each line, in its width.

    Returns
    -------
    SourceFit
        Its spectrum has the channels that were used.

    Raises
    ------
    ValueError
        Where fewer than three channels a parameter are left.
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
