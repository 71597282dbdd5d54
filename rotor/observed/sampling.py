"""Distributions of fitted parameters by emcee (D. Foreman-Mackey et al., Publ. Astron. Soc. Pac. 125, 306 (2013)); extra `sampling`.

ln p = -χ²/2 with the noise and the priors of the fit, in the variables of its search (logarithms, except for velocities). Walkers start
around the minimum with the covariance of the fit. The first five autocorrelation times of the chain are left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.observed.fit import SourceFit, prior_widths
from rotor.observed.model.model import model
from rotor.observed.spectrum import KELVIN
from rotor.table import Table

EXTRA = 'python -m pip install "molrotor[sampling]"'
_BURN = 5  # start of the chain that is left out, in autocorrelation times


@dataclass(frozen=True, eq=False, repr=False)
class SourceSample(Table):
    """Draws (n, m) of the parameters of a fit in their units, and the autocorrelation time of the chain in steps."""

    names: tuple[str, ...]
    draws: Floats
    autocorrelation: float
    accepted: float
    walkers: int

    @property
    def columns(self) -> dict[str, Any]:
        """Draws by name of the parameter."""
        return {name: self.draws[:, i] for i, name in enumerate(self.names)}

    @property
    def effective(self) -> float:
        """Number of independent draws: number of draws divided by the autocorrelation time."""
        return len(self.draws) / self.autocorrelation if self.autocorrelation > 0 else float(len(self.draws))

    @property
    def text(self) -> str:
        """One line for a report."""
        return f"{len(self.draws)} draws, {self.effective:.0f} of them independent, {self.accepted:.0%} accepted"

    def facts(self) -> dict[str, Any]:
        """Median and quantiles at 16 and 84 % of each parameter."""
        low, middle, high = np.quantile(self.draws, (0.1587, 0.5, 0.8413), axis=0)
        return {
            "draws": len(self.draws),
            "independent": self.effective,
            "accepted": self.accepted,
            "parameters": [
                {"name": name, "median": float(middle[i]), "low": float(low[i]), "high": float(high[i])}
                for i, name in enumerate(self.names)
            ],
        }


def sample_source(fit: SourceFit, steps: int, *, walkers: int | None = None, seed: int = 1) -> SourceSample:
    """Sample the distribution of the parameters of a fit.

    Parameters
    ----------
    fit : SourceFit
    steps : int
        Steps of each walker.
    walkers : int, optional
        By default four for each parameter.
    seed : int, optional

    Returns
    -------
    SourceSample

    Raises
    ------
    ImportError
        Without emcee.
    ValueError
        For fewer than 10 steps.
    """
    if steps < 10:
        raise ValueError(f"sample: {steps} steps: expected 10 or more")
    if fit.spectrum.unit != KELVIN:
        raise ValueError(f"sample: a fit in {fit.spectrum.unit}; expected one of brightness in K")
    try:
        import emcee
    except ModuleNotFoundError as error:
        raise ImportError(f"emcee is not installed: {EXTRA}", name="emcee") from error
    count = len(fit.values)
    walkers = walkers or max(4 * count, 16)
    rng = np.random.default_rng(seed)
    spread = np.where(np.isfinite(fit.statistics.errors), fit.statistics.errors * fit.scale, 0.1)
    start = fit.values + np.minimum(spread, 0.5) * rng.normal(size=(walkers, count))
    sampler = emcee.EnsembleSampler(walkers, count, _log_probability, args=(fit,))
    sampler.random_state = np.random.RandomState(seed).get_state()
    sampler.run_mcmc(start, steps)
    time = float(np.max(sampler.get_autocorr_time(quiet=True, tol=0)))
    time = time if np.isfinite(time) else steps / 10
    draws = sampler.get_chain(discard=min(int(_BURN * time), steps // 2), flat=True)
    values = np.array(
        [[variable.back(value) for variable, value in zip(fit.variables.items, row, strict=True)] for row in draws]
    )
    return SourceSample(
        fit.variables.names(fit.components), values, time, float(np.mean(sampler.acceptance_fraction)), walkers
    )


def _log_probability(values: Floats, fit: SourceFit) -> float:
    try:
        components = fit.variables.applied(fit.start, values)
        seen = model(components, fit.spectrum.frequency_mhz, fit.sight).brightness_k
    except ValueError:  # out of the range of Q(T)
        return -np.inf
    chi = float(np.sum(((fit.spectrum.intensity - seen) / (fit.noise * fit.scale)) ** 2))
    if fit.choices.priors:
        chi += float(np.sum(((values - fit.variables.values(fit.start)) / prior_widths(fit.start, fit.variables)) ** 2))
    return -0.5 * chi


def load_corner() -> Any:
    """The package corner; ImportError that names the extra if it is not installed."""
    try:
        import corner
    except ModuleNotFoundError as error:
        raise ImportError(f"corner is not installed: {EXTRA}", name="corner") from error
    return corner
