"""The building blocks behind the verbs: requests with their answers, and functions of tops and levels.

    from rotor.api import line_list
    lines = line_list("water", temperature_k=300, jmax=20)

Functions of a top also accept anything that `rotor.read` accepts. Names are loaded on first use.
"""

import ast
from collections.abc import Callable
from functools import cache, wraps
from importlib import import_module
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.checks import did_you_mean, no_molecule

if TYPE_CHECKING:  # `modules` reads these lines: they declare the names of this module
    from rotor import units as units
    from rotor.alignment.acting import revival_period_ps as revival_period_ps
    from rotor.alignment.align import AlignmentTrace as AlignmentTrace
    from rotor.alignment.align import align as align
    from rotor.alignment.classical import classical_trace as classical_trace
    from rotor.alignment.pulse import DipolePulse as DipolePulse
    from rotor.alignment.pulse import GaussianPulse as GaussianPulse
    from rotor.alignment.pulse import Kick as Kick
    from rotor.alignment.pulse import elliptical as elliptical
    from rotor.alignment.qutip_objects import block_objects as block_objects
    from rotor.alignment.qutip_objects import linear_objects as linear_objects
    from rotor.alignment.qutip_objects import solve_windows as solve_windows
    from rotor.alignment.request import AlignRequest as AlignRequest
    from rotor.alignment.request import answer_align as answer_align
    from rotor.assignment.assign import answer_assign as answer_assign
    from rotor.assignment.peaks.intensities import fit_intensities as fit_intensities
    from rotor.assignment.peaks.peak_finding import pick_peaks as pick_peaks
    from rotor.assignment.request import AssignRequest as AssignRequest
    from rotor.classical.effect import Torque as Torque
    from rotor.classical.effects.changing_inertia import ChangingInertia as ChangingInertia
    from rotor.classical.effects.drag import LinearDrag as LinearDrag
    from rotor.classical.effects.gravity import GravityAboutPivot as GravityAboutPivot
    from rotor.classical.effects.gyrostat import SpinningRotor as SpinningRotor
    from rotor.classical.effects.ideal_fluid import FluidImpulse as FluidImpulse
    from rotor.classical.effects.ideal_fluid import added_masses as added_masses
    from rotor.classical.effects.ideal_fluid import added_moments as added_moments
    from rotor.classical.effects.ideal_fluid import shape_integrals as shape_integrals
    from rotor.classical.effects.optical_centrifuge import OpticalCentrifuge as OpticalCentrifuge
    from rotor.classical.effects.rolling import RollingEllipsoid as RollingEllipsoid
    from rotor.classical.effects.torques import ConstantTorque as ConstantTorque
    from rotor.classical.euler import angular_velocity as angular_velocity
    from rotor.classical.euler import gyroscopic_rate as gyroscopic_rate
    from rotor.classical.euler import invariants as invariants
    from rotor.classical.euler import momentum_rate as momentum_rate
    from rotor.classical.free.free_motion import free_motion as free_motion
    from rotor.classical.free.polhodes import level as level
    from rotor.classical.free.stability import fixed_axes as fixed_axes
    from rotor.classical.free.stability import growth_rate as growth_rate
    from rotor.classical.free.stability import precession_rates as precession_rates
    from rotor.classical.free.stability import separatrix_ratio as separatrix_ratio
    from rotor.classical.gas.correlations import linear_curves as linear_curves
    from rotor.classical.gas.correlations import plateau as plateau
    from rotor.classical.gas.correlations import short_time as short_time
    from rotor.classical.gas.ensembles import free_gas_correlations as free_gas_correlations
    from rotor.classical.gas.ensembles import thermal_ensemble as thermal_ensemble
    from rotor.classical.gas.thermal_momentum import mean_thermal_momentum as mean_thermal_momentum
    from rotor.classical.gas.thermal_momentum import off_intermediate_axis as off_intermediate_axis
    from rotor.classical.integrators.driven_batch import propagate_driven as propagate_driven
    from rotor.classical.integrators.exact_drift import ExactDrift as ExactDrift
    from rotor.classical.integrators.lie_runge_kutta import LieRungeKutta as LieRungeKutta
    from rotor.classical.integrators.method import integrate as integrate
    from rotor.classical.integrators.moser_veselov import MoserVeselov as MoserVeselov
    from rotor.classical.integrators.splitting import RotationSplitting as RotationSplitting
    from rotor.classical.integrators.splitting import SymmetricTopSplitting as SymmetricTopSplitting
    from rotor.classical.internal_rotor import TurningTop as TurningTop
    from rotor.classical.internal_rotor import turning_motion as turning_motion
    from rotor.classical.lyapunov import body_flow as body_flow
    from rotor.classical.lyapunov import lyapunov_exponents as lyapunov_exponents
    from rotor.classical.lyapunov import orbit as orbit
    from rotor.classical.lyapunov import poincare_section as poincare_section
    from rotor.classical.system import total_momentum as total_momentum
    from rotor.classical.tumble import TumbleRequest as TumbleRequest
    from rotor.classical.tumble import answer_tumble as answer_tumble
    from rotor.fitting.assignment import assignments as assignments
    from rotor.fitting.choice.choose import choose_constants as choose_constants
    from rotor.fitting.choice.choose import suggest_lines as suggest_lines
    from rotor.fitting.fit import fit_lines as fit_lines
    from rotor.fitting.parameters import parameters as parameters
    from rotor.fitting.reports.publication import publication_table as publication_table
    from rotor.fitting.reports.report import report_text as report_text
    from rotor.fitting.resampling import bootstrap as bootstrap
    from rotor.fitting.search.residuals import FitOptions as FitOptions
    from rotor.fitting.top_constants import TopConstants as TopConstants
    from rotor.fluids.forces.potential import RigidPotential as RigidPotential
    from rotor.fluids.motion.dynamics import RigidDynamics as RigidDynamics
    from rotor.fluids.motion.thermostats import NoseHoover as NoseHoover
    from rotor.fluids.request import FluidRequest as FluidRequest
    from rotor.fluids.request import NewBox as NewBox
    from rotor.fluids.request import answer_fluid as answer_fluid
    from rotor.formats.catalogue.cat_species import read_cat_species as read_cat_species
    from rotor.formats.fits.family_file import read_family as read_family
    from rotor.formats.lines.assigned_lines import read_assigned_lines as read_assigned_lines
    from rotor.formats.lines.streamed_lines import stream_lines as stream_lines
    from rotor.formats.spcat.compare import agreement as agreement
    from rotor.formats.spcat.compare import compare as compare
    from rotor.formats.spcat.fits.fit_input import fitted_file as fitted_file
    from rotor.formats.spcat.fits.fit_input import read_fit as read_fit
    from rotor.formats.spcat.text.egy import read_egy as read_egy
    from rotor.formats.spectra.axis import ReadChoices as ReadChoices
    from rotor.formats.spectra.read import read_spectrum as read_spectrum
    from rotor.geometry import rotations as rotations
    from rotor.geometry.base_pair_steps import mean_rotation as mean_rotation
    from rotor.geometry.base_pair_steps import persistence_steps as persistence_steps
    from rotor.geometry.base_pair_steps import step_parameters as step_parameters
    from rotor.geometry.base_pair_steps import step_pose as step_pose
    from rotor.geometry.inertia import Body as Body
    from rotor.geometry.inertia import cone as cone
    from rotor.geometry.inertia import hemisphere as hemisphere
    from rotor.geometry.inertia import principal_frame as principal_frame
    from rotor.geometry.inertia import rectangle as rectangle
    from rotor.geometry.inertia import triangle as triangle
    from rotor.geometry.rigid_motions import adjoint as adjoint
    from rotor.geometry.rigid_motions import bracket as bracket
    from rotor.geometry.rigid_motions import chasles_screw as chasles_screw
    from rotor.geometry.rigid_motions import compose as compose
    from rotor.geometry.rigid_motions import power as power
    from rotor.geometry.rigid_motions import twist_exp as twist_exp
    from rotor.geometry.rigid_motions import twist_log as twist_log
    from rotor.geometry.rigid_parts import rigid_parts as rigid_parts
    from rotor.geometry.rotations import conjugate as conjugate
    from rotor.geometry.rotations import distance as distance
    from rotor.geometry.rotations import exp as exp
    from rotor.geometry.rotations import from_matrix as from_matrix
    from rotor.geometry.rotations import multiply as multiply
    from rotor.geometry.rotations import nearest_rotation as nearest_rotation
    from rotor.geometry.rotations import rotate as rotate
    from rotor.geometry.rotations import to_euler as to_euler
    from rotor.geometry.rotations import to_matrix as to_matrix
    from rotor.geometry.superposition import flow_gradient as flow_gradient
    from rotor.geometry.superposition import polar as polar
    from rotor.geometry.superposition import superpose as superpose
    from rotor.molecules.optimise import refine as refine
    from rotor.observed.channels import fit_rejecting as fit_rejecting
    from rotor.observed.diagram import plot_rotational_diagram as plot_rotational_diagram
    from rotor.observed.diagram import rotational_diagram as rotational_diagram
    from rotor.observed.fit import FitChoices as FitChoices
    from rotor.observed.fit import contributions as contributions
    from rotor.observed.fit import fit_source as fit_source
    from rotor.observed.identification.identify import identify as identify
    from rotor.observed.identification.selection import IdentifyChoices as IdentifyChoices
    from rotor.observed.model.model import Component as Component
    from rotor.observed.model.model import Sight as Sight
    from rotor.observed.model.model import model as model
    from rotor.observed.model.partition import PartitionTable as PartitionTable
    from rotor.observed.model.species import species_lines as species_lines
    from rotor.observed.model.species import strength_from_einstein as strength_from_einstein
    from rotor.observed.spectrum import observed_spectrum as observed_spectrum
    from rotor.observed.start import start_components as start_components
    from rotor.plots.energies.heat_capacity import Panel as Panel
    from rotor.plots.energies.heat_capacity import heat_capacity_figure as heat_capacity_figure
    from rotor.plots.energies.stark import stark_figure as stark_figure
    from rotor.plots.energies.torsion import torsion_figure as torsion_figure
    from rotor.plots.motion.alignment import alignment_figure as alignment_figure
    from rotor.plots.motion.gas import band_figure as band_figure
    from rotor.plots.motion.gas import equipartition_figure as equipartition_figure
    from rotor.plots.motion.polhodes import polhode_figure as polhode_figure
    from rotor.plots.picture import use_style as use_style
    from rotor.plots.spectra.assign import assignment_figure as assignment_figure
    from rotor.plots.spectra.fit import fit_figure as fit_figure
    from rotor.plots.spectra.over import loomis_wood_figure as loomis_wood_figure
    from rotor.plots.structure import structure_figure as structure_figure
    from rotor.quantum.basis.labelled import Basis as Basis
    from rotor.quantum.basis.labelled import rotation_labels as rotation_labels
    from rotor.quantum.blocks.connected import linear_blocks as linear_blocks
    from rotor.quantum.effects.of_top import effects_of as effects_of
    from rotor.quantum.effects.spin_effect import quadrupole_of_tensor as quadrupole_of_tensor
    from rotor.quantum.effects.stark import MHZ_ANGSTROM3_W_PER_CM2 as MHZ_ANGSTROM3_W_PER_CM2
    from rotor.quantum.effects.stark import StarkRequest as StarkRequest
    from rotor.quantum.effects.stark import answer_stark as answer_stark
    from rotor.quantum.effects.stark import stark_map as stark_map
    from rotor.quantum.effects.watson import SEMI_RIGID as SEMI_RIGID
    from rotor.quantum.effects.zeeman import ZeemanRequest as ZeemanRequest
    from rotor.quantum.effects.zeeman import answer_zeeman as answer_zeeman
    from rotor.quantum.effects.zeeman import zeeman_map as zeeman_map
    from rotor.quantum.fields.deflection import deflection_table as deflection_table
    from rotor.quantum.hyperfine_method import used_method as used_method
    from rotor.quantum.internal_rotation.from_geometry import with_internal_rotation as with_internal_rotation
    from rotor.quantum.internal_rotation.levels import turning_tops as turning_tops
    from rotor.quantum.operators.rotation import j_x as j_x
    from rotor.quantum.operators.rotation import j_y as j_y
    from rotor.quantum.operators.rotation import j_z as j_z
    from rotor.quantum.reductions import to_reduction as to_reduction
    from rotor.quantum.reductions import to_representation as to_representation
    from rotor.quantum.request import LevelsRequest as LevelsRequest
    from rotor.quantum.request import answer_levels as answer_levels
    from rotor.quantum.solve import solve_levels as solve_levels
    from rotor.quantum.spins import Spin as Spin
    from rotor.scenes.scene import make_scene as make_scene
    from rotor.spectra.classical_band import classical_band as classical_band
    from rotor.spectra.classical_band import compare_bands as compare_bands
    from rotor.spectra.classical_band import dipole_band_area as dipole_band_area
    from rotor.spectra.classical_band import lines_area as lines_area
    from rotor.spectra.classical_band import rigid as rigid
    from rotor.spectra.emission.request import EmissionRequest as EmissionRequest
    from rotor.spectra.emission.request import answer_emission as answer_emission
    from rotor.spectra.fields.lines import field_lines as field_lines
    from rotor.spectra.fields.stark_coefficients import line_coefficients as line_coefficients
    from rotor.spectra.lines import line_list as line_list
    from rotor.spectra.raman.raman import RamanLines as RamanLines
    from rotor.spectra.raman.raman import raman_lines as raman_lines
    from rotor.spectra.raman.request import RamanRequest as RamanRequest
    from rotor.spectra.raman.request import answer_raman as answer_raman
    from rotor.spectra.request import GasLayer as GasLayer
    from rotor.spectra.request import SpectrumRequest as SpectrumRequest
    from rotor.spectra.request import answer_spectrum as answer_spectrum
    from rotor.statistics.degrees_of_freedom import count_degrees as count_degrees
    from rotor.statistics.equipartition import equipartition as equipartition
    from rotor.statistics.equipartition import kinetic_degrees as kinetic_degrees
    from rotor.structures.coordinates import named as named
    from rotor.structures.coordinates import symmetric_displacements as symmetric_displacements
    from rotor.structures.family import family as family
    from rotor.structures.least_squares import fit_structure as fit_structure
    from rotor.structures.substitution import substitution_structure as substitution_structure
    from rotor.thermodynamics.functions import GAS_CONSTANT as GAS_CONSTANT
    from rotor.thermodynamics.functions import thermodynamic_functions as thermodynamic_functions
    from rotor.thermodynamics.gas.classical_gas import GasRequest as GasRequest
    from rotor.thermodynamics.gas.classical_gas import answer_gas as answer_gas
    from rotor.thermodynamics.gas.field_mixture import field_mixture as field_mixture
    from rotor.thermodynamics.gas.thermal_tumble import thermal_tumble as thermal_tumble
    from rotor.thermodynamics.request import ThermoRequest as ThermoRequest
    from rotor.thermodynamics.request import answer_thermo as answer_thermo
    from rotor.thermodynamics.sums.partition import partition_function as partition_function
    from rotor.thermodynamics.vibration import VibrationalStates as VibrationalStates
    from rotor.tops.internal_rotation import InternalRotationConstants as InternalRotationConstants
    from rotor.tops.isotopes.isotopologues import isotopologue as isotopologue
    from rotor.tops.isotopes.isotopologues import isotopologues as isotopologues
    from rotor.units import ASE_TIME_PS as ASE_TIME_PS
    from rotor.units import EV_PER_K as EV_PER_K
    from rotor.units import HBAR_CLASSICAL as HBAR_CLASSICAL
    from rotor.units import MHZ_PER_CM as MHZ_PER_CM
    from rotor.units import MHZ_PER_DEBYE_KV_PER_CM as MHZ_PER_DEBYE_KV_PER_CM

MOVED = frozenset(
    {
        "AlignRequest", "AlignmentTrace", "AssignRequest", "EmissionRequest", "FluidRequest", "GasLayer", "GasRequest",
        "LevelsRequest", "NewBox", "RamanLines", "RamanRequest", "SpectrumRequest", "StarkRequest", "ThermoRequest",
        "TumbleRequest", "VibrationalStates", "ZeemanRequest", "align", "answer_align", "answer_assign", "answer_emission",
        "answer_fluid", "answer_gas", "answer_levels", "answer_raman", "answer_spectrum", "answer_stark", "answer_thermo",
        "answer_tumble", "answer_zeeman", "effects_of", "free_motion", "line_list", "partition_function", "raman_lines", "refine",
        "solve_levels", "stark_map", "stream_lines", "thermal_tumble", "thermodynamic_functions", "zeeman_map",
    }
)  # fmt: skip  # names that moved here from `rotor`

TOP_FUNCTIONS = frozenset(
    {
        "align", "effects_of", "line_list", "partition_function", "raman_lines", "solve_levels", "stark_map", "stream_lines",
        "thermal_tumble", "thermodynamic_functions", "zeeman_map",
    }
)  # fmt: skip  # functions whose first argument is a top


@cache
def modules() -> dict[str, str]:
    """The module of each name, from the imports at the head of this file."""
    body = ast.parse(Path(__file__).read_text(encoding="utf-8")).body
    head = next(statement for statement in body if isinstance(statement, ast.If))
    imports = (statement for statement in head.body if isinstance(statement, ast.ImportFrom))
    return {name.name: str(statement.module) for statement in imports for name in statement.names}


def __dir__() -> list[str]:
    return sorted(modules())


def __getattr__(name: str) -> Any:
    if name == "__all__":
        return __dir__()
    if name.startswith("_"):
        raise AttributeError(f"module 'rotor.api' has no attribute {name!r}")
    if name not in modules():
        raise AttributeError(f"module 'rotor.api' has no attribute {name!r}{did_you_mean(name, modules())}")
    where = import_module(modules()[name])
    value = getattr(where, name) if hasattr(where, name) else import_module(f"{where.__name__}.{name}")
    return _reading_tops(value) if name in TOP_FUNCTIONS else value


@cache
def _reading_tops(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function of a top, extended to accept anything from which `read` makes a top."""

    @wraps(function)
    def call(top: Any, *args: Any, **options: Any) -> Any:
        from rotor.formats import read
        from rotor.tops.top import Top

        _refuse_arguments(function, (top, *args), options)
        value = top if isinstance(top, Top) else read(top)
        if not isinstance(value, Top):
            raise no_molecule(top, value)
        return function(value, *args, **options)

    return call


def _refuse_arguments(function: Callable[..., Any], args: tuple[Any, ...], options: dict[str, Any]) -> None:
    """Raise TypeError, with the valid names, for arguments that the function does not take."""
    accepted = signature(function)
    try:
        accepted.bind(*args, **options)
    except TypeError as error:
        unknown = next((name for name in options if name not in accepted.parameters), None)
        names = [name for name in accepted.parameters if name not in ("top", *options)]
        which = did_you_mean(unknown, names) if unknown else ""
        raise TypeError(f"{function.__name__}(): {error}{which or '; by name it takes ' + ', '.join(names)}") from None
