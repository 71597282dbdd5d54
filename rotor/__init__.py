"""Molecular rotation: a molecule goes in, a rotational spectrum comes out.

    import rotor
    top = rotor.read("water")
    lines = rotor.line_list(top, temperature_k=300, jmax=20)
    rotor.write(lines, "water.cat")

The public names stand below. They are loaded when first used, so that `import rotor` does no work.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from rotor.version import version

if TYPE_CHECKING:
    from rotor.classical.free.free_motion import FreeMotion as FreeMotion
    from rotor.classical.free.free_motion import free_motion as free_motion
    from rotor.formats import read as read
    from rotor.formats import write as write
    from rotor.formats.streamed_lines import stream_lines as stream_lines
    from rotor.molecules.molecule import Molecule as Molecule
    from rotor.molecules.optimise import refine as refine
    from rotor.quantum.levels import Levels as Levels
    from rotor.quantum.solve import solve_levels as solve_levels
    from rotor.spectra.lines import Lines as Lines
    from rotor.spectra.lines import line_list as line_list
    from rotor.spectra.raman import RamanLines as RamanLines
    from rotor.spectra.raman import raman_lines as raman_lines
    from rotor.spectra.spectrum import Spectrum as Spectrum
    from rotor.thermo import VibrationalStates as VibrationalStates
    from rotor.thermo import partition_function as partition_function
    from rotor.thermo import thermodynamic_functions as thermodynamic_functions
    from rotor.tops.constants import Constants as Constants
    from rotor.tops.top import Top as Top

_HOME = {
    "Constants": "rotor.tops.constants",
    "FreeMotion": "rotor.classical.free.free_motion",
    "Levels": "rotor.quantum.levels",
    "Lines": "rotor.spectra.lines",
    "Molecule": "rotor.molecules.molecule",
    "RamanLines": "rotor.spectra.raman",
    "Spectrum": "rotor.spectra.spectrum",
    "VibrationalStates": "rotor.thermo",
    "Top": "rotor.tops.top",
    "free_motion": "rotor.classical.free.free_motion",
    "line_list": "rotor.spectra.lines",
    "partition_function": "rotor.thermo",
    "raman_lines": "rotor.spectra.raman",
    "read": "rotor.formats",
    "refine": "rotor.molecules.optimise",
    "solve_levels": "rotor.quantum.solve",
    "stream_lines": "rotor.formats.streamed_lines",
    "thermodynamic_functions": "rotor.thermo",
    "write": "rotor.formats",
}

__all__ = [*sorted(_HOME), "__version__"]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return version()
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'rotor' has no attribute {name!r}")


def __dir__() -> list[str]:
    return list(__all__)
