"""The building blocks behind the verbs: requests with their answers, and functions of tops and levels.

    from rotor.api import line_list
    lines = line_list("water", temperature_k=300, jmax=20)

Functions of a top take whatever `rotor.read` takes instead. Names are loaded when they are first used.
"""

from collections.abc import Callable
from functools import cache, wraps
from importlib import import_module
from inspect import signature
from typing import TYPE_CHECKING, Any

from rotor.checks import did_you_mean

if TYPE_CHECKING:
    from rotor.alignment.align import AlignmentTrace as AlignmentTrace
    from rotor.alignment.align import align as align
    from rotor.alignment.qutip_objects import LinearObjects as LinearObjects
    from rotor.alignment.qutip_objects import block_objects as block_objects
    from rotor.alignment.qutip_objects import linear_objects as linear_objects
    from rotor.alignment.qutip_objects import solve_windows as solve_windows
    from rotor.alignment.request import AlignRequest as AlignRequest
    from rotor.alignment.request import answer_align as answer_align
    from rotor.assignment.request import AssignRequest as AssignRequest
    from rotor.assignment.request import answer_assign as answer_assign
    from rotor.classical.free.free_motion import free_motion as free_motion
    from rotor.classical.integrators.driven_batch import propagate_driven as propagate_driven
    from rotor.classical.integrators.moser_veselov import MoserVeselov as MoserVeselov
    from rotor.classical.lyapunov import body_flow as body_flow
    from rotor.classical.lyapunov import lyapunov_exponents as lyapunov_exponents
    from rotor.classical.lyapunov import orbit as orbit
    from rotor.classical.lyapunov import poincare_section as poincare_section
    from rotor.classical.tumble import TumbleRequest as TumbleRequest
    from rotor.classical.tumble import answer_tumble as answer_tumble
    from rotor.fluids.request import FluidRequest as FluidRequest
    from rotor.fluids.request import NewBox as NewBox
    from rotor.fluids.request import answer_fluid as answer_fluid
    from rotor.formats.streamed_lines import stream_lines as stream_lines
    from rotor.geometry.base_pair_steps import mean_rotation as mean_rotation
    from rotor.geometry.base_pair_steps import persistence_steps as persistence_steps
    from rotor.geometry.base_pair_steps import step_parameters as step_parameters
    from rotor.geometry.base_pair_steps import step_pose as step_pose
    from rotor.geometry.rigid_motions import screw_of as screw_of
    from rotor.geometry.rigid_motions import twist_exp as twist_exp
    from rotor.geometry.rigid_motions import twist_log as twist_log
    from rotor.molecules.optimise import refine as refine
    from rotor.quantum.effects.of_top import effects_of as effects_of
    from rotor.quantum.effects.stark import stark_map as stark_map
    from rotor.quantum.effects.zeeman import zeeman_map as zeeman_map
    from rotor.quantum.fields.stark_request import StarkRequest as StarkRequest
    from rotor.quantum.fields.stark_request import answer_stark as answer_stark
    from rotor.quantum.fields.zeeman_request import ZeemanRequest as ZeemanRequest
    from rotor.quantum.fields.zeeman_request import answer_zeeman as answer_zeeman
    from rotor.quantum.reductions import to_reduction as to_reduction
    from rotor.quantum.reductions import to_representation as to_representation
    from rotor.quantum.request import LevelsRequest as LevelsRequest
    from rotor.quantum.request import answer_levels as answer_levels
    from rotor.quantum.solve import solve_levels as solve_levels
    from rotor.spectra.classical_band import band_from_correlation as band_from_correlation
    from rotor.spectra.classical_band import classical_band as classical_band
    from rotor.spectra.classical_band import compare_bands as compare_bands
    from rotor.spectra.emission_request import EmissionRequest as EmissionRequest
    from rotor.spectra.emission_request import answer_emission as answer_emission
    from rotor.spectra.lines import line_list as line_list
    from rotor.spectra.raman import RamanLines as RamanLines
    from rotor.spectra.raman import raman_lines as raman_lines
    from rotor.spectra.raman_request import RamanRequest as RamanRequest
    from rotor.spectra.raman_request import answer_raman as answer_raman
    from rotor.spectra.request import GasLayer as GasLayer
    from rotor.spectra.request import SpectrumRequest as SpectrumRequest
    from rotor.spectra.request import answer_spectrum as answer_spectrum
    from rotor.structures.family import family as family
    from rotor.thermodynamics import VibrationalStates as VibrationalStates
    from rotor.thermodynamics import partition_function as partition_function
    from rotor.thermodynamics import thermodynamic_functions as thermodynamic_functions
    from rotor.thermodynamics.classical_gas import GasRequest as GasRequest
    from rotor.thermodynamics.classical_gas import answer_gas as answer_gas
    from rotor.thermodynamics.request import ThermoRequest as ThermoRequest
    from rotor.thermodynamics.request import answer_thermo as answer_thermo
    from rotor.thermodynamics.thermal_tumble import thermal_tumble as thermal_tumble

MODULES = {
    "AlignRequest": "rotor.alignment.request",
    "AssignRequest": "rotor.assignment.request",
    "AlignmentTrace": "rotor.alignment.align",
    "FluidRequest": "rotor.fluids.request",
    "GasLayer": "rotor.spectra.request",
    "GasRequest": "rotor.thermodynamics.classical_gas",
    "LevelsRequest": "rotor.quantum.request",
    "NewBox": "rotor.fluids.request",
    "RamanLines": "rotor.spectra.raman",
    "RamanRequest": "rotor.spectra.raman_request",
    "EmissionRequest": "rotor.spectra.emission_request",
    "SpectrumRequest": "rotor.spectra.request",
    "StarkRequest": "rotor.quantum.fields.stark_request",
    "ThermoRequest": "rotor.thermodynamics.request",
    "TumbleRequest": "rotor.classical.tumble",
    "VibrationalStates": "rotor.thermodynamics",
    "ZeemanRequest": "rotor.quantum.fields.zeeman_request",
    "align": "rotor.alignment.align",
    "answer_align": "rotor.alignment.request",
    "answer_assign": "rotor.assignment.request",
    "answer_fluid": "rotor.fluids.request",
    "answer_gas": "rotor.thermodynamics.classical_gas",
    "answer_levels": "rotor.quantum.request",
    "answer_raman": "rotor.spectra.raman_request",
    "answer_emission": "rotor.spectra.emission_request",
    "answer_spectrum": "rotor.spectra.request",
    "answer_stark": "rotor.quantum.fields.stark_request",
    "answer_thermo": "rotor.thermodynamics.request",
    "answer_tumble": "rotor.classical.tumble",
    "answer_zeeman": "rotor.quantum.fields.zeeman_request",
    "effects_of": "rotor.quantum.effects.of_top",
    "free_motion": "rotor.classical.free.free_motion",
    "line_list": "rotor.spectra.lines",
    "partition_function": "rotor.thermodynamics",
    "raman_lines": "rotor.spectra.raman",
    "refine": "rotor.molecules.optimise",
    "solve_levels": "rotor.quantum.solve",
    "stark_map": "rotor.quantum.effects.stark",
    "stream_lines": "rotor.formats.streamed_lines",
    "thermal_tumble": "rotor.thermodynamics.thermal_tumble",
    "thermodynamic_functions": "rotor.thermodynamics",
    "zeeman_map": "rotor.quantum.effects.zeeman",
}

FURTHER = {
    "LinearObjects": "rotor.alignment.qutip_objects",
    "MoserVeselov": "rotor.classical.integrators.moser_veselov",
    "band_from_correlation": "rotor.spectra.classical_band",
    "block_objects": "rotor.alignment.qutip_objects",
    "body_flow": "rotor.classical.lyapunov",
    "classical_band": "rotor.spectra.classical_band",
    "compare_bands": "rotor.spectra.classical_band",
    "family": "rotor.structures.family",
    "linear_objects": "rotor.alignment.qutip_objects",
    "lyapunov_exponents": "rotor.classical.lyapunov",
    "mean_rotation": "rotor.geometry.base_pair_steps",
    "orbit": "rotor.classical.lyapunov",
    "persistence_steps": "rotor.geometry.base_pair_steps",
    "poincare_section": "rotor.classical.lyapunov",
    "propagate_driven": "rotor.classical.integrators.driven_batch",
    "screw_of": "rotor.geometry.rigid_motions",
    "solve_windows": "rotor.alignment.qutip_objects",
    "step_parameters": "rotor.geometry.base_pair_steps",
    "step_pose": "rotor.geometry.base_pair_steps",
    "to_reduction": "rotor.quantum.reductions",
    "to_representation": "rotor.quantum.reductions",
    "twist_exp": "rotor.geometry.rigid_motions",
    "twist_log": "rotor.geometry.rigid_motions",
}  # that never stood in `rotor` itself

OF_TOPS = frozenset(
    {
        "align", "effects_of", "line_list", "partition_function", "raman_lines", "solve_levels", "stark_map", "stream_lines",
        "thermal_tumble", "thermodynamic_functions", "zeeman_map",
    }
)  # fmt: skip  # functions whose first argument is a top

__all__ = sorted([*MODULES, *FURTHER])


def __getattr__(name: str) -> Any:
    if name in MODULES or name in FURTHER:
        found = getattr(import_module({**MODULES, **FURTHER}[name]), name)
        return _taking_words(found) if name in OF_TOPS else found
    raise AttributeError(f"module 'rotor.api' has no attribute {name!r}{did_you_mean(name, __all__)}")


@cache
def _taking_words(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function of a top, given a top or whatever `read` makes one of."""

    @wraps(function)
    def call(top: Any, *args: Any, **options: Any) -> Any:
        from rotor.formats import read
        from rotor.tops.top import Top

        _refuse_arguments(function, (top, *args), options)
        found = top if isinstance(top, Top) else read(top)
        if not isinstance(found, Top):
            raise ValueError(f"{top}: holds a {type(found).__name__}, not a molecule or constants")
        return function(found, *args, **options)

    return call


def _refuse_arguments(function: Callable[..., Any], args: tuple[Any, ...], options: dict[str, Any]) -> None:
    """TypeError, with the names that would do, for arguments that the function does not take."""
    taken = signature(function)
    try:
        taken.bind(*args, **options)
    except TypeError as error:
        unknown = next((name for name in options if name not in taken.parameters), None)
        names = [name for name in taken.parameters if name not in ("top", *options)]
        which = did_you_mean(unknown, names) if unknown else ""
        raise TypeError(f"{function.__name__}(): {error}{which or '; by name it takes ' + ', '.join(names)}") from None


def __dir__() -> list[str]:
    return list(__all__)
