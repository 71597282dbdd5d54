"""Plans of thermodynamic functions and of torsion."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from rotor.quantum.estimates.limits import populated_j
from rotor.quantum.estimates.plans import plan_fields
from rotor.requests.numerics import Goal, Numerics
from rotor.requests.plan import Cost, LeftOut, whole_cost


def thermo_cost(request: Any) -> Cost:
    """The cost of thermodynamic functions, and those at the highest temperature, whose levels take the time."""
    from rotor.thermodynamics.request import answer_thermo

    hottest = replace(request, temperatures_k=(max(request.temperatures_k),))
    return whole_cost(lambda: answer_thermo(hottest), largest=lambda: answer_thermo(request))


def describe_thermo(request: Any, hot: Any) -> dict[str, Any]:
    """What thermodynamic functions are, from those at the highest temperature."""
    hottest, jmax = max(request.temperatures_k), int(hot.functions.jmax.max())
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


def describe_torsion(request: Any, answer: Any) -> dict[str, Any]:
    """What a torsion is: basis and potential."""
    scanned = "" if answer.scan is None else f"; {len(answer.scan.angles) + 1} relaxed geometries"
    return {
        "effects": (f"potential: {answer.source}, barrier {answer.facts()['barrier_cm']:.4g} cm⁻¹",),
        "good": ("species",) if answer.torsion.fold > 1 else (),
        "parts": (("basis", f"exp(imα) up to m = {answer.waves}, {answer.torsion.fold} species{scanned}"),),
        "counts": {"levels": len(answer.levels), "temperatures": len(request.temperatures_k)},
        "left_out": (LeftOut("coupling with other vibrations and the whole rotation", None, "", "not estimated"),),
    }


def _remark_on_basis(request: Any) -> tuple[str, ...]:
    """Without a scan nothing can be chosen, since the basis follows from the energies."""
    from rotor.thermodynamics.torsion_potential import is_scan

    why = "basis: its size follows from the highest energy; the error is stated with each run"
    return () if is_scan(request.potential) else (why,)


THERMO = Numerics(
    {"": Goal("Q, U and C_v")},
    remarks=lambda request: ("vibration: its states are summed in closed form",) if request.vibrations else (),
    describe=describe_thermo,
    cost=thermo_cost,
)
TORSION = Numerics({"MHz": Goal("levels")}, remarks=_remark_on_basis, describe=describe_torsion)
