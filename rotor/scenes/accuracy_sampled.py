"""Accuracy of what is sampled or stepped in a gas and a fluid: how many molecules, which step, which tolerance of Ewald's sum.

| kind | accuracy of | what is chosen | error stated |
|---|---|---|---|
| gas, "1 K" | temperature of the kinetic energy | molecules: z T √(2/fN) | the same |
| gas, "1 %" | heat capacity var(E)/kT² | molecules: z √((2 + 12/f)/N) | the same |
| gas with times, "2 %" or 0.02 | C1 and C2 at each time | molecules: z s/√N, s of a small gas | from the spread in the run |
| fluid, "0.5 K" | conserved energy, 2E/k per degree | the step, by short runs of the box | bound of these, and of the run |
| fluid, "0.1 %" | forces of Ewald's sum | its tolerance, by forces in the box | where the run ends |

The energy E of the f degrees of freedom of one molecule has a gamma distribution of shape f/2: mean f kT/2, variance f (kT)²/2, excess
kurtosis κ = 12/f. Of N independent values the mean has the variance var/N, and the variance has var² (2/(N - 1) + κ/N). z is the
two-sided quantile of the confidence of the scene.

The conserved energy of a fluid departs from its mean by h² G(q, p), h the step and G a function of coordinates and momenta: what a
step of order 2 conserves to order h⁴ is H + h² G. How far it departs depends on the stretch of the motion: a box that starts with
forces at rest and velocities drawn has more of it than a settled one, and a mean over a long run hides that. So n boxes are followed
without a thermostat over `FOLLOWED_FS`, each with velocities of its own, and the root mean squares r of their conserved energies give
a bound for one more such stretch: the difference of one more r and the mean of n is normal with the variance σ²(1 + 1/n), so that over
s, the standard deviation of the n, it has Student's distribution, t its quantile:

    r < mean(r) + t(0.99, n - 1) s(r) √(1 + 1/n)

Stated is this bound, or the root mean square of the whole run where that is larger. It is that of rigid molecules with the forces of
the scene, whose cutoff is part of the model.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rotor.scenes.choice import Choice

if TYPE_CHECKING:
    from rotor.fluids.request import FluidRequest
    from rotor.thermodynamics.classical_gas import GasAnswer, GasRequest

PILOT_MOLECULES = 2_000
SPARE = 1.25  # the forces where a run ends are others than those that Ewald's tolerance was chosen by
BOXES, SURE = 8, 0.99  # boxes that are followed, and the confidence of the bound
FIRST_STEP_FS, LONGEST_STEP_FS, SHORTEST_STEP_FS = 1.0, 8.0, 0.05
EWALD_LADDER = tuple(10.0**-n for n in range(2, 11))
REFERENCE_EWALD = 1e-12


def quantile(confidence: float) -> float:
    """z of a two-sided interval of a normal distribution.

    >>> round(quantile(0.99), 4)
    2.5758
    """
    from statistics import NormalDist

    return NormalDist().inv_cdf(0.5 + 0.5 * confidence)


def degrees_of(request: GasRequest) -> int:
    """Degrees of freedom of one molecule whose energy is drawn; bare constants have no translation."""
    from rotor.statistics.degrees_of_freedom import count_degrees

    one = count_degrees([request.top.moments_u_angstrom2])
    return round(one.rotation + (one.translation if request.top.mass_u is not None else 0))


def relative_spread(unit: str, degrees: int) -> float:
    """Standard error times √N of the temperature ("K") or of the heat capacity ("%"), as a part of it.

    >>> relative_spread("K", 6), relative_spread("%", 6)
    (0.5773502691896257, 2.0)
    """
    return math.sqrt(2.0 / degrees) if unit == "K" else math.sqrt(2.0 + 12.0 / degrees)


def choose_molecules(scene: Any, request: GasRequest, asked: float) -> Choice:
    """The request with as many molecules as the accuracy needs.

    Parameters
    ----------
    scene : GasScene
        Without a number of molecules of its own.
    request : GasRequest
        That of the scene.
    asked : float
        In K of the temperature, % of the heat capacity, or a number of C1 and C2, as `rotor.scenes.accuracy.unit_of` says.

    Returns
    -------
    Choice

    Raises
    ------
    ValueError
        Where molecules are given too, and where more are needed than a run has.
    """
    from rotor.scenes.accuracy import unit_of
    from rotor.thermodynamics.classical_gas import MOST_MOLECULES

    unit = unit_of(scene)
    if scene.numerics.molecules != type(scene.numerics)().molecules:
        raise ValueError("accuracy and numerics.molecules: give one of them")
    z = quantile(request.confidence)
    count = max(math.ceil((z * _spread(request, asked, unit) / asked) ** 2), 2)
    if count > MOST_MOLECULES:
        raise ValueError(
            f"accuracy: {asked:g} {unit}".rstrip()
            + f" would need {count:.2g} molecules, more than the {MOST_MOLECULES:g} of a run; ask for less"
        )
    return Choice(replace(request, molecules=count), f"{count} molecules, at a confidence of {request.confidence:g}")


def _spread(request: GasRequest, asked: float, unit: str) -> float:
    """Standard error times √N in the unit of the accuracy."""
    if unit:
        scale = request.temperature_k if unit == "K" else 100.0
        return scale * relative_spread(unit, degrees_of(request))
    if request.times_ps is None:
        raise ValueError(f"accuracy: {asked:g}: is of correlation functions; give observables.times, or a unit, K or %")
    from rotor.thermodynamics.classical_gas import answer_gas

    pilot = answer_gas(replace(request, molecules=PILOT_MOLECULES))
    return 1.1 * _largest_error(pilot) * math.sqrt(PILOT_MOLECULES)  # the spread itself is known to some percent


def _largest_error(answer: GasAnswer) -> float:
    """The largest standard error of C1 and C2."""
    curves = answer.correlations
    assert curves is not None
    return max(float(error.max()) for error in (curves.c1_error, curves.c2_error) if error is not None)


def error_of_gas(answer: GasAnswer, unit: str) -> float:
    """Within what the result is, at the confidence asked for."""
    request = answer.request
    z = quantile(request.confidence)
    if not unit:
        return z * _largest_error(answer)
    scale = request.temperature_k if unit == "K" else 100.0
    return z * scale * relative_spread(unit, degrees_of(request)) / math.sqrt(request.molecules)


def choose_step(scene: Any, request: FluidRequest, asked: float) -> Choice:
    """The request with the longest step, or the coarsest tolerance of Ewald's sum, that reaches an accuracy.

    Parameters
    ----------
    scene : FluidScene
        Without a value of its own for that knob.
    request : FluidRequest
        That of the scene.
    asked : float
        In K of the conserved energy, or % of the forces.

    Returns
    -------
    Choice
        Its request has a box that is made.

    Raises
    ------
    ValueError
        For another engine, a knob that is given too, and what no step or tolerance reaches.
    """
    if request.engine != "rotor":
        raise ValueError(f"accuracy: the engine {request.engine} is not swept; give numerics.step, or the engine rotor")
    from rotor.scenes.accuracy import unit_of

    made = made_of(request)
    return _by_energy(scene, made, asked) if unit_of(scene) == "K" else _by_forces(scene, made, asked)


def made_of(request: FluidRequest) -> FluidRequest:
    """The request with its box, made once."""
    from rotor.fluids.request import NewBox, box_of

    if not isinstance(request.box, NewBox):
        return request
    box = box_of(request)
    box.calc = None  # that of the settings is made anew, by those that are chosen
    return replace(request, box=box, box_source=request.start)


def _by_energy(scene: Any, request: FluidRequest, asked: float) -> Choice:
    from rotor.scenes.choice import quantity

    given, usual = (quantity("numerics.step", one, "fs") for one in (scene.numerics.step, type(scene.numerics)().step))
    if given != usual:
        raise ValueError("accuracy and numerics.step: give one of them")

    # of second order: the step that reaches it, in hundredths of a femtosecond, from one that is short; then shorter until it does
    step = FIRST_STEP_FS * math.sqrt(asked / conserved_bound_k(request, FIRST_STEP_FS))
    step = min(math.floor(100.0 * step) / 100.0, LONGEST_STEP_FS)
    while step > SHORTEST_STEP_FS:
        if (error := conserved_bound_k(request, step)) <= asked:
            longest = ", nothing cheaper: the longest there is" if step == LONGEST_STEP_FS else ""
            how = f"a step of {step:g} fs{longest}; root mean square of the conserved energy about its mean"
            return Choice(replace(request, settings=replace(request.settings, step_fs=step)), how, error)
        step = math.floor(95.0 * step) / 100.0
    raise ValueError(
        f"accuracy: {asked:g} K cannot be given: the steps would be shorter than {SHORTEST_STEP_FS:g} fs; ask for less"
    )


def conserved_bound_k(request: FluidRequest, step_fs: float) -> float:
    """What the root mean square of the conserved energy of a box over a short time is below, in K for each degree of freedom.

    request: with a box that is made; the first of the boxes that are followed has its own velocities, if there are any.
    """
    import numpy as np
    from scipy.special import stdtrit

    from rotor.scenes.knobs.of_motion import answer_followed, conserved_k, followed

    every = []
    for number in range(BOXES):
        box: Any = request.box
        box = box.copy()
        if number:
            box.set_momenta(np.zeros((len(box), 3)))  # drawn anew at the temperature
        settings = replace(request.settings, seed=request.settings.seed + number)
        every.append(conserved_k(answer_followed(followed(replace(request, box=box, settings=settings), step_fs))))
    spread = float(np.std(every, ddof=1)) * math.sqrt(1.0 + 1.0 / BOXES)
    return float(np.mean(every)) + float(stdtrit(BOXES - 1, SURE)) * spread


def _by_forces(scene: Any, request: FluidRequest, asked: float) -> Choice:

    own = request.settings
    if own.electrostatics != "ewald":
        raise ValueError(
            f"accuracy: {asked:g} %: of the forces is that of Ewald's sum, and {own.electrostatics} is another model; give "
            'numerics.electrostatics = "ewald", or an accuracy of the conserved energy in K'
        )
    if scene.numerics.ewald_tolerance != type(scene.numerics)().ewald_tolerance:
        raise ValueError("accuracy and numerics.ewald_tolerance: give one of them")
    for tolerance in EWALD_LADDER:
        chosen = replace(request, settings=replace(own, ewald_tolerance=tolerance))
        error = force_error(chosen)
        if error <= asked / SPARE:
            return Choice(chosen, f"a tolerance of {tolerance:g} of Ewald's sum")
    raise ValueError(
        f"accuracy: {asked:g} % cannot be given: Ewald's sum to {tolerance:g} is still off by {error:.2g} %"
    )


def force_error(request: FluidRequest) -> float:
    """Root mean square error in percent of the forces in a box, beside Ewald's sum to 1e-12 with the same cutoff."""
    from rotor.scenes.knobs.of_motion import force_difference, forces_of

    own = request.settings
    found, true = (
        forces_of(request, "ewald", own.cutoff_angstrom, one)() for one in (own.ewald_tolerance, REFERENCE_EWALD)
    )
    return force_difference(found, true)


def error_of_fluid(answer: Any, unit: str) -> float:
    """The error of a run: of its conserved energy, or of the forces where it ends."""
    from rotor.scenes.knobs.of_motion import conserved_k

    return conserved_k(answer) if unit == "K" else force_error(replace(answer.request, box=answer.atoms))
