"""Thermodynamics of rotation: sums over levels, their classical limit, nuclear-spin species, and the ideal gas.

Modules: `level_sums`, `partition`, `classical_limit`, `classical_onset`, `species`, `vibration`, and `functions`, which combines
them; `partition_table` gives Q(T) as records. A module is loaded when one of its names is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from rotor.thermodynamics.classical_limit import (
    classical_limit as classical_limit,  # these two have the names of their modules
)
from rotor.thermodynamics.level_sums import level_sums as level_sums

if TYPE_CHECKING:
    from rotor.thermodynamics.classical_limit import ClassicalLimit as ClassicalLimit
    from rotor.thermodynamics.classical_limit import classical_partition_function as classical_partition_function
    from rotor.thermodynamics.classical_limit import rotational_temperatures_k as rotational_temperatures_k
    from rotor.thermodynamics.classical_onset import classical_above_k as classical_above_k
    from rotor.thermodynamics.functions import GAS_CONSTANT as GAS_CONSTANT
    from rotor.thermodynamics.functions import IdealGas as IdealGas
    from rotor.thermodynamics.functions import ThermoFunctions as ThermoFunctions
    from rotor.thermodynamics.functions import species_names as species_names
    from rotor.thermodynamics.functions import thermodynamic_functions as thermodynamic_functions
    from rotor.thermodynamics.functions import translational_entropy as translational_entropy
    from rotor.thermodynamics.level_sums import LevelSums as LevelSums
    from rotor.thermodynamics.partition import PartitionFunction as PartitionFunction
    from rotor.thermodynamics.partition import PartitionFunctions as PartitionFunctions
    from rotor.thermodynamics.partition import partition_function as partition_function
    from rotor.thermodynamics.species import implied_symmetry_number as implied_symmetry_number
    from rotor.thermodynamics.species import spin_species as spin_species
    from rotor.thermodynamics.vibration import VibrationalStates as VibrationalStates
    from rotor.thermodynamics.vibration import vibrational_functions as vibrational_functions
    from rotor.thermodynamics.vibration import vibrational_partition_function as vibrational_partition_function

_MODULES = {
    "ClassicalLimit": "classical_limit",
    "GAS_CONSTANT": "functions",
    "IdealGas": "functions",
    "LevelSums": "level_sums",
    "PartitionFunction": "partition",
    "PartitionFunctions": "partition",
    "ThermoFunctions": "functions",
    "VibrationalStates": "vibration",
    "classical_above_k": "classical_onset",
    "classical_partition_function": "classical_limit",
    "implied_symmetry_number": "species",
    "partition_function": "partition",
    "rotational_temperatures_k": "classical_limit",
    "species_names": "functions",
    "spin_species": "species",
    "thermodynamic_functions": "functions",
    "translational_entropy": "functions",
    "vibrational_functions": "vibration",
    "vibrational_partition_function": "vibration",
}

__all__ = [*sorted((*_MODULES, "classical_limit", "level_sums"))]


def __getattr__(name: str) -> Any:
    if name == "partition_functions":
        from rotor.checks import warn_renamed

        warn_renamed(name, name := "partition_function")
    if name not in _MODULES:
        raise AttributeError(f"module 'rotor.thermodynamics' has no attribute {name!r}")
    return getattr(import_module(f"rotor.thermodynamics.{_MODULES[name]}"), name)


def __dir__() -> list[str]:
    return list(__all__)
