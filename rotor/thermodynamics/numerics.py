"""Plans of thermodynamic functions and of torsion."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from rotor.quantum.estimates.plans import plan_fields
from rotor.requests.knob import Knob
from rotor.requests.numerics import Goal, Numerics
from rotor.requests.plan import Cost, Growth, LeftOut
from rotor.thermodynamics.sums.classical_limit import populated_j

TEMPERATURES = Knob(
    key="conditions.temperature",
    fixed="",
    cost=Growth(
        (1,),
        lambda request: len(request.temperatures_k),
        lambda request, _: replace(request, temperatures_k=(max(request.temperatures_k),)),
        work=lambda request, count: 1.0,  # the levels at the highest temperature take the time
        largest=lambda request: request,
    ),
)
VIBRATION = Knob(
    key="vibration", fixed="its states are summed in closed form", used=lambda request: bool(request.vibrations)
)


def describe_thermo(request: Any, cost: Cost) -> dict[str, Any]:
    """What thermodynamic functions are."""
    hot, hottest = cost.answer, max(request.temperatures_k)
    jmax = int(hot.functions.jmax.max())
    summed = f"levels summed to J = {jmax} at {hottest:g} K" if jmax >= 0 else "classical with corrections: no levels"
    described = plan_fields(request.top, populated_j(request.top, hottest), hot.effects)
    vibration = [] if request.vibrations else [LeftOut("vibration", None, "", "no states given")]
    return {
        "effects": described["effects"],
        "good": described["good"],
        "parts": (("method", f"{summed}, to {request.relative_error:g} of Q, U and C_v"),),
        "counts": {"temperatures": len(request.temperatures_k)},
        "left_out": (*described["left_out"], *vibration),
    }


def describe_torsion(request: Any, cost: Cost) -> dict[str, Any]:
    """What a torsion is: basis and potential."""
    answer = cost.answer
    scanned = "" if answer.scan is None else f"; {len(answer.scan.angles) + 1} relaxed geometries"
    return {
        "effects": (f"potential: {answer.source}, barrier {answer.facts()['barrier_cm']:.4g} cm⁻¹",),
        "good": ("species",) if answer.torsion.fold > 1 else (),
        "parts": (("basis", f"exp(imα) up to m = {answer.waves}, {answer.torsion.fold} species{scanned}"),),
        "counts": {"levels": len(answer.levels), "temperatures": len(request.temperatures_k)},
        "left_out": (LeftOut("coupling with other vibrations and the whole rotation", None, "", "not estimated"),),
    }


def _has_potential(request: Any) -> bool:
    """Whether nothing can be chosen, since without a scan the basis follows from the energies."""
    from rotor.thermodynamics.torsion.potential import is_scan

    return not is_scan(request.potential)


BASIS = Knob(
    key="basis",
    fixed="its size follows from the highest energy; the error is stated with each run",
    used=_has_potential,
)
THERMO = Numerics({"": Goal("Q, U and C_v")}, knobs=(TEMPERATURES, VIBRATION), describe=describe_thermo)
TORSION = Numerics({"MHz": Goal("levels")}, knobs=(BASIS,), describe=describe_torsion)
