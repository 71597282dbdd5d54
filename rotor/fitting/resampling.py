"""Errors of constants by the bootstrap: fits to lines drawn with replacement."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.fitting.fit import FitOptions, fit_lines
from rotor.fitting.result import Fit
from rotor.quantum.labels.labelled import LevelModel


def bootstrap(
    fit: Fit,
    samples: int,
    rng: np.random.Generator,
    options: FitOptions | None = None,
    *,
    model: Callable[[Ints], LevelModel] | None = None,
) -> tuple[Floats, Floats]:
    """Parameters of fits to lines drawn with replacement, and their standard deviations.

    Each draw is a measured frequency; a blend is one frequency. Samples that determine fewer constants, or whose search does not
    converge, are replaced; at most ten times `samples` are drawn.

    Parameters
    ----------
    fit : Fit
        A finished fit of n parameters; each sample starts from its result.
    samples : int
        How many samples.
    rng : numpy.random.Generator
        Draws the lines.
    options : FitOptions, optional
        Options of each fit; the number of iterations is at least the default.
    model : callable, optional
        As in `fit_lines`.

    Returns
    -------
    values : (samples, n) array
        MHz. A KeyboardInterrupt ends with fewer samples if at least two are done.
    deviations : (n,) array
        Standard deviations, MHz; infinite for parameters that the lines of the fit do not determine.

    Raises
    ------
    ValueError
        If ten times `samples` draws are not enough; the message counts the samples that determine fewer constants and those that
        do not converge.

    Notes
    -----
    The bootstrap assumes only that the lines are independent. The error of a constant that few lines determine comes out too
    large or infinite.
    """
    groups = fit.lines.blend[fit.groups]
    members = {int(b): np.flatnonzero((fit.lines.blend == b) & fit.used) for b in groups}
    at = fit.parameters.moved(fit.values)
    settings = options or FitOptions()
    most = max(settings.most_iterations, FitOptions().most_iterations)
    # a poor rms does not reject a sample
    lenient = replace(settings, poor_rms=1e12, most_iterations=most, pass_interrupt=True)
    out: list[Floats] = []
    fewer = astray = 0

    def sample() -> Fit:
        drawn = rng.choice(groups, size=len(groups)).tolist()
        rows = np.concatenate([members[b] for b in drawn])
        blend = np.repeat(np.arange(len(drawn)), [len(members[b]) for b in drawn])
        widths = {i: fit.lines.widths_mhz[b] for i, b in enumerate(drawn) if b in fit.lines.widths_mhz}
        lines = replace(fit.lines.take(rows), blend=blend, comments=(), widths_mhz=widths)
        return fit_lines(lines, fit.constants, at, lenient, model=model)

    try:
        for _ in range(10 * samples):  # samples of lower rank are drawn again, at most ten times as many
            fit_of_sample = sample()
            if fit_of_sample.statistics.rank != fit.statistics.rank:
                fewer += 1
            elif not fit_of_sample.converged:
                astray += 1
            else:
                out.append(fit_of_sample.values)
            if len(out) == samples:
                break
    except KeyboardInterrupt:
        if len(out) < 2:  # a standard deviation needs two samples
            raise
        samples = len(out)
    if len(out) < samples:
        raise ValueError(
            f"only {len(out)} of {10 * samples} samples determine all constants and converge ({fewer} determine fewer, {astray} do "
            "not converge); too few lines for a bootstrap, or a fit far from linear"
        )
    values = np.array(out)
    # ddof=1: the mean comes from the same samples
    return values, np.where(np.isfinite(fit.errors), values.std(axis=0, ddof=1), np.inf)
