"""Plans of thermodynamic functions and of torsion."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from rotor.quantum.estimates.limits import populated_j
from rotor.quantum.estimates.plans import plan_fields
from rotor.requests.numerics import Goal, Numerics
from rotor.requests.plan import LeftOut, Plan, peak_mb, plan_complete_run, timed


def plan_thermo(request: Any) -> Plan:
    """The plan of thermodynamic functions; levels and seconds refer to the highest temperature."""
    from rotor.thermodynamics.request import answer_thermo

    hottest = max(request.temperatures_k)
    answers: list[Any] = []
    seconds = timed(lambda: answers.append(answer_thermo(replace(request, temperatures_k=(hottest,)))))
    jmax = int(answers[-1].functions.jmax.max())
    summed = f"levels summed to J = {jmax} at {hottest:g} K" if jmax >= 0 else "classical with corrections: no levels"
    described = plan_fields(request.top, populated_j(request.top, hottest), answers[-1].effects)
    vibration = [] if request.vibrations else [LeftOut("vibration", None, "", "no states given")]
    return Plan(
        kind="thermo",
        effects=described["effects"],
        good=described["good"],
        parts=(("method", f"{summed}, to {request.relative_error:g} of Q, U and C_v"),),
        counts={"temperatures": len(request.temperatures_k)},
        seconds=seconds,
        memory_mb=peak_mb(lambda: answer_thermo(request)),
        left_out=(*described["left_out"], *vibration),
    )


def plan_torsion(request: Any) -> Plan:
    """The plan of a torsion."""
    from rotor.thermodynamics.torsion_request import answer_torsion

    def describe(answer: Any) -> dict[str, Any]:
        """Describe the basis and potential of the answer."""
        scanned = "" if answer.scan is None else f"; {len(answer.scan.angles) + 1} relaxed geometries"
        return {
            "effects": (f"potential: {answer.source}, barrier {answer.facts()['barrier_cm']:.4g} cm⁻¹",),
            "good": ("species",) if answer.torsion.fold > 1 else (),
            "parts": (("basis", f"exp(imα) up to m = {answer.waves}, {answer.torsion.fold} species{scanned}"),),
            "counts": {"levels": len(answer.levels), "temperatures": len(request.temperatures_k)},
            "left_out": (LeftOut("coupling with other vibrations and the whole rotation", None, "", "not estimated"),),
        }

    return plan_complete_run("torsion", lambda: answer_torsion(request), describe)


def _remark_on_basis(request: Any) -> tuple[str, ...]:
    """Without a scan nothing can be chosen, since the basis follows from the energies."""
    from rotor.thermodynamics.torsion_potential import is_scan

    why = "basis: its size follows from the highest energy; the error is stated with each run"
    return () if is_scan(request.potential) else (why,)


THERMO = Numerics(
    {"": Goal("Q, U and C_v")},
    remarks=lambda request: ("vibration: its states are summed in closed form",) if request.vibrations else (),
    plan=plan_thermo,
)
TORSION = Numerics({"MHz": Goal("levels")}, remarks=_remark_on_basis, plan=plan_torsion)
