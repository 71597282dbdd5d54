"""Thermodynamics of rotation: sums over levels, their classical limit, nuclear-spin species, and the ideal gas.

A module for each: `level_sums`, `partition`, `classical_limit`, `classical_onset`, `species`, `vibration` and `functions`,
which brings them together.
"""

from rotor.thermo.classical_limit import (
    ClassicalLimit,
    classical_limit,
    classical_partition_function,
    rotational_temperatures_k,
)
from rotor.thermo.classical_onset import classical_above_k
from rotor.thermo.functions import (
    GAS_CONSTANT,
    IdealGas,
    ThermoFunctions,
    species_names,
    thermodynamic_functions,
    translational_entropy,
)
from rotor.thermo.level_sums import LevelSums, level_sums
from rotor.thermo.partition import PartitionFunction, PartitionFunctions, partition_function, partition_functions
from rotor.thermo.species import implied_symmetry_number, spin_species
from rotor.thermo.vibration import VibrationalStates, vibrational_functions, vibrational_partition_function

__all__ = [
    "GAS_CONSTANT",
    "ClassicalLimit",
    "IdealGas",
    "LevelSums",
    "PartitionFunction",
    "PartitionFunctions",
    "ThermoFunctions",
    "VibrationalStates",
    "classical_above_k",
    "classical_limit",
    "classical_partition_function",
    "implied_symmetry_number",
    "level_sums",
    "partition_function",
    "partition_functions",
    "rotational_temperatures_k",
    "species_names",
    "spin_species",
    "thermodynamic_functions",
    "translational_entropy",
    "vibrational_functions",
    "vibrational_partition_function",
]
