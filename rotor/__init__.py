"""Molecular rotation: a molecule goes in, a rotational spectrum comes out.

    import rotor
    spectrum = rotor.spectrum("water", temperature_k=100)
    spectrum.table.strongest(5)
    spectrum.errors
    spectrum.write("water.cat")
    spectrum.plot()

Each verb of the command line is a function; its keyword arguments are numbers in the unit of the argument, or texts with a unit.
The building blocks behind the verbs are in `rotor.api`. Names are loaded on first use, so that `import rotor` does no work.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from rotor.version import version

if TYPE_CHECKING:
    from rotor.calls import Result as Result
    from rotor.classical.free.free_motion import FreeMotion as FreeMotion
    from rotor.formats import read as read
    from rotor.formats import write as write
    from rotor.molecules.molecule import Molecule as Molecule
    from rotor.plots.show import plot as plot
    from rotor.quantum.levels import Levels as Levels
    from rotor.requests.budget import ErrorBudget as ErrorBudget
    from rotor.scenes.plan import plan_of as plan_of
    from rotor.scenes.run import run_scene as run_scene
    from rotor.scenes.scene import read_scene as read_scene
    from rotor.scenes.scene import write_scene as write_scene
    from rotor.scenes.sweep import run_sweep as run_sweep
    from rotor.spectra.lines import Lines as Lines
    from rotor.spectra.spectrum import Spectrum as Spectrum
    from rotor.tops.constants.constants import Constants as Constants
    from rotor.tops.spins.spin_constants import SpinConstants as SpinConstants
    from rotor.tops.states.state_constants import StateConstants as StateConstants
    from rotor.tops.top import Top as Top
    from rotor.viewer.widget import view as view

VERBS = (
    "spectrum",
    "levels",
    "raman",
    "thermo",
    "tumble",
    "gas",
    "fluid",
    "stark",
    "zeeman",
    "align",
    "emission",
    "info",
    "isotopologues",
    "fit",
    "assign",
    "structure",
    "torsion",
)  # each is a function of this name

_MODULES = {
    "ErrorBudget": "rotor.requests.budget",
    "Result": "rotor.calls",
    "Constants": "rotor.tops.constants.constants",
    "FreeMotion": "rotor.classical.free.free_motion",
    "Levels": "rotor.quantum.levels",
    "Lines": "rotor.spectra.lines",
    "Molecule": "rotor.molecules.molecule",
    "Spectrum": "rotor.spectra.spectrum",
    "SpinConstants": "rotor.tops.spins.spin_constants",
    "StateConstants": "rotor.tops.states.state_constants",
    "Top": "rotor.tops.top",
    "plot": "rotor.plots.show",
    "plan_of": "rotor.scenes.plan",
    "read": "rotor.formats",
    "read_scene": "rotor.scenes.scene",
    "run_scene": "rotor.scenes.run",
    "run_sweep": "rotor.scenes.sweep",
    "view": "rotor.viewer.widget",
    "write": "rotor.formats",
    "write_scene": "rotor.scenes.scene",
}

__all__ = [*sorted([*_MODULES, *VERBS]), "__version__", "api"]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return version()
    if name in VERBS:
        from rotor.calls import function_of

        return function_of(name)
    if name == "api":
        return import_module("rotor.api")
    if name in _MODULES:
        return getattr(import_module(_MODULES[name]), name)
    if name.startswith("_"):
        raise AttributeError(f"module 'rotor' has no attribute {name!r}")
    return _moved(name)


def _moved(name: str) -> Any:
    """A name that moved to `rotor.api`, with a deprecation warning; AttributeError for unknown names."""
    from rotor import api

    if name not in api.MOVED:
        from rotor.checks import did_you_mean

        inside = f"; there is rotor.api.{name}" if name in api.modules() else ""
        raise AttributeError(
            f"module 'rotor' has no attribute {name!r}{inside or did_you_mean(name, [*__all__, *api.MOVED])}"
        )
    from rotor.checks import warn_renamed

    warn_renamed(f"rotor.{name}", f"rotor.api.{name}", stacklevel=4)
    return getattr(api, name)


def __dir__() -> list[str]:
    return list(__all__)
