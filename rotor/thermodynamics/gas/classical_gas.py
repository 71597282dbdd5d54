"""Request and answer for a classical gas of free molecules: test of equipartition, correlation functions.

Distortion, quantum effects and forces between molecules are neglected.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor import units
from rotor.arrays import Floats
from rotor.checks import require_top
from rotor.classical.gas.correlations import ShortTime, plateau, short_time
from rotor.classical.gas.ensembles import Correlations, Ensemble, free_gas_correlations, thermal_ensemble
from rotor.quantum.effects.of_top import effects_of
from rotor.quantum.estimates.limits import SPIN_LIMITS, model_limits, model_sizes
from rotor.requests.budget import ErrorBudget, size_text
from rotor.requests.field import check_fields, declared
from rotor.requests.readers import Grid, Quantity, Whole
from rotor.statistics.degrees_of_freedom import count_degrees
from rotor.statistics.equipartition import Equipartition, equipartition
from rotor.table import TextOf
from rotor.thermodynamics.sums.classical_limit import populated_j
from rotor.thermodynamics.sums.classical_onset import classical_above_if_known
from rotor.tops.facts import top_facts

if TYPE_CHECKING:
    from rotor.tops.top import Top

MOST_MOLECULES = 10_000_000  # 1.4 GB: momentum, attitude, position, velocity and energies
MOST_TIMES = 100_000
DEFAULT_TIMES = 101
SETTLED = 12.0  # rms rotation angle in radians at which the table of the correlation functions ends
TESTED_AT_PS = 10.0


@dataclass(frozen=True)
class GasRequest:
    """A classical gas to sample and propagate; all fields are checked when the request is made.

    molecules: sample size. seed: of the random numbers. confidence: of the test of equipartition. times_ps: times of the
    correlation functions C1 and C2, see `settling_times_ps`; None: no correlation functions.
    """

    top: Top
    molecules: int = declared(
        20_000, Whole(2, MOST_MOLECULES), "Number of molecules drawn", "numerics.molecules", common=True
    )
    temperature_k: float = declared(
        300.0, Quantity("K", above=0, metavar="T"), "Temperature (K)", "conditions.temperature", common=True
    )
    seed: int = declared(1, Whole(0), "Seed of the random numbers", "numerics.seed")
    confidence: float = declared(
        0.99, Quantity(above=0, below=1), "Confidence level of the test of equipartition", "observables.confidence"
    )
    times_ps: tuple[float, ...] | None = declared(
        None, Grid("ps", most_points=MOST_TIMES), "Times of the correlation functions: start:stop:count or a comma list (ps)",
        "observables.times", common=True, example="0:2:201",
    )  # fmt: skip

    def __post_init__(self) -> None:
        require_top(self.top)
        check_fields(self)

    @property
    def kt(self) -> float:
        """kT in eV."""
        return units.EV_PER_K * self.temperature_k

    @property
    def tested_at_ps(self) -> float:
        """The time at which equipartition is tested: the last time of the correlation functions, or 10 ps without them."""
        return TESTED_AT_PS if self.times_ps is None else max(self.times_ps)


@dataclass(frozen=True)
class Probes:
    """The probes of C1 and C2: a unit vector (3,) and a tensor (3, 3) in principal axes, with their sources."""

    vector: Floats
    vector_source: str
    tensor: Floats
    tensor_source: str


@dataclass(frozen=True, repr=False)
class GasAnswer(TextOf):
    """The gas after it has moved, the verdict on equipartition, and the correlation functions with times in ps."""

    shown = "test"

    request: GasRequest
    ensemble: Ensemble
    test: Equipartition
    correlations: Correlations | None

    @cached_property
    def probes(self) -> Probes:
        """The vector and tensor of the correlation functions."""
        return top_probes(self.request.top)

    @property
    def short_time(self) -> ShortTime:
        """The short-time behaviour of the correlation functions in closed form, in the units of the motion."""
        top, probes = self.request.top, self.probes
        return short_time(top.moments_u_angstrom2, self.request.kt, probes.vector, probes.tensor)

    @property
    def left_out(self) -> list[str]:
        """Effects neglected by a classical gas of free rigid tops: quantum mechanics, distortion, and others of this molecule."""
        top = self.request.top
        j, effects = populated_j(top, self.request.temperature_k), effects_of(top, hyperfine=False)
        above_k = classical_above_if_known(top, 0.01)
        where = "" if above_k is None else f": the heat capacity is classical within 1 % above {above_k:.3g} K"
        quantum = f"quantum mechanics{where}"
        sizes = [
            size for size in model_sizes(top, j, effects) if size.present and size.name == "centrifugal distortion"
        ]
        distortion = [f"{size.name}: {size_text(size.size_mhz, 'MHz')} of a level at J = {j}" for size in sizes]
        seen = [limit.sentence() for limit in model_limits(top, j, effects) if limit.name not in SPIN_LIMITS]
        return [f"collisions; vibrations; {quantum}", *distortion, *seen]

    @cached_property
    def errors(self) -> ErrorBudget:
        """Error budget of the temperature, or of C1 and C2."""
        from rotor.thermodynamics.gas.budget import gas_budget

        return gas_budget(self)

    def facts(self) -> dict[str, Any]:
        """Facts of the answer except its table, by the keys of docs/verbs."""
        request, test = self.request, self.test
        degrees = count_degrees([request.top.moments_u_angstrom2])
        half_kt = 0.5 * test.kt * units.CM_PER_EV
        return {
            **top_facts(request.top),
            "temperature_k": request.temperature_k,
            "molecules": request.molecules,
            "seed": request.seed,
            "confidence": request.confidence,
            "degrees_of_freedom": {
                "translation": degrees.translation,
                "rotation": degrees.rotation,
                "total": degrees.total,
                "gas": round(self.ensemble.kinetic.total),
            },
            "tested_at_ps": request.tested_at_ps,
            "accepted": test.accepted,
            "p_value": test.p_value,
            "chi2": test.chi2,
            "chi2_degrees": test.chi2_degrees,
            "chi2_p": test.chi2_p,
            "ks_p": test.ks_p,
            "failing": list(test.failing),
            "degrees": [asdict(d) | {"energy_cm": half_kt * d.mean, "expected_cm": half_kt} for d in test.degrees],
            **self._correlation_facts(),
            "left_out": self.left_out,
            "errors": self.errors.as_json(),
        }

    def _correlation_facts(self) -> dict[str, Any]:
        names = ("vector_abc", "vector_source", "tensor_source", "short_time_per_ps2", "c1_plateau")
        if self.correlations is None:
            return dict.fromkeys(names)
        probes, start = self.probes, self.short_time
        per_ps2 = {"c1": start.m2 / units.ASE_TIME_PS**2, "c2": start.n2 / units.ASE_TIME_PS**2}
        last = plateau(self.request.top.moments_u_angstrom2, probes.vector)
        values = (probes.vector, probes.vector_source, probes.tensor_source, per_ps2, last)
        return dict(zip(names, values, strict=True))


def answer_gas(
    request: GasRequest,
    executor: ThreadPoolExecutor | None = None,
    progress: Callable[[int], object] | None = None,
) -> GasAnswer:
    """Sample and propagate the gas of a request, test it, and compute its correlation functions if it has times.

    executor: threads for the correlation functions; the answer does not depend on it.
    progress: called with the number of molecules done.

    >>> from rotor.tops.top import Top
    >>> answer = answer_gas(GasRequest(Top.from_constants("A=10 B=6 C=4 GHz"), molecules=1000))
    >>> answer.test.accepted, len(answer.test.degrees)  # no translations: bare constants have no mass
    (True, 3)
    """
    top, rng = request.top, np.random.default_rng(request.seed)
    start = thermal_ensemble(top.moments_u_angstrom2, request.kt, request.molecules, rng=rng, mass=top.mass_u)
    gas = start.moved(request.tested_at_ps / units.ASE_TIME_PS)
    test = equipartition(gas.kinetic, request.kt, confidence=request.confidence)
    return GasAnswer(request, gas, test, _correlations(request, executor, progress))


def _correlations(
    request: GasRequest, executor: ThreadPoolExecutor | None, progress: Callable[[int], object] | None
) -> Correlations | None:
    """C1 and C2, with times in ps, from a separate sample of molecules (another stream of the same seed)."""
    if request.times_ps is None:
        return None
    probes, times = top_probes(request.top), np.array(request.times_ps)
    curves = free_gas_correlations(
        request.top.moments_u_angstrom2,
        request.kt,
        times / units.ASE_TIME_PS,
        vector=probes.vector,
        tensor=probes.tensor,
        molecules=request.molecules,
        rng=np.random.default_rng([request.seed, 1]),
        executor=executor,
        progress=progress,
    )
    return replace(curves, times=times, time_unit="ps")


def top_probes(top: Top) -> Probes:
    """The dipole and the polarizability of a top if they are known and anisotropic; otherwise its figure axis."""
    axis = 2 if top.kind == "oblate" else 0
    vector, vector_source = np.eye(3)[axis], f"axis {'abc'[axis]}, as there is no dipole that is known"
    if top.dipole_abc_debye is not None and any(top.dipole_abc_debye):
        vector, vector_source = np.array(top.dipole_abc_debye), "the dipole"
        vector = vector / np.linalg.norm(vector)
    tensor, tensor_source = np.outer(vector, vector), f"the second Legendre polynomial of {vector_source.split(',')[0]}"
    polarizability = top.polarizability_abc_angstrom3
    if polarizability is not None:
        alpha = np.array(polarizability)
        if np.linalg.norm(alpha - np.trace(alpha) / 3 * np.eye(3)) > 1e-6 * np.linalg.norm(alpha):
            tensor, tensor_source = alpha, "the anisotropic polarizability"
    return Probes(vector, vector_source, tensor, tensor_source)


def settling_times_ps(top: Top, temperature_k: float) -> tuple[float, ...]:
    """Times in ps until the correlation functions of a free gas have settled: 12 rad of rms rotation."""
    probes = top_probes(top)
    start = short_time(top.moments_u_angstrom2, units.EV_PER_K * temperature_k, probes.vector, probes.tensor)
    last = SETTLED / math.sqrt(max(start.m2, start.n2 / 3)) * units.ASE_TIME_PS
    return tuple(np.linspace(0.0, last, DEFAULT_TIMES).tolist())
