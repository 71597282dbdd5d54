"""Thermodynamic functions of a gas of tops: rotation by the quantum sum and classically, vibration, and the ideal gas.

Rotation, from the sums of `rotor.thermodynamics.sums.level_sums`: U = RT ⟨x⟩, S = R ln Q + U/T, C_v. Energies of all species count from the
lowest existing level of the molecule, so that ortho hydrogen has the 1.42 kJ/mol of its lowest level at 0 K.

Species with a frozen ratio x_s are a mixture of gases: U and C_v are means, and ln q = Σ x_s ln(q_s/x_s), which contains the entropy of
mixing. `normal` is the high-temperature ratio, given by the numbers of spin functions: 3:1 for ortho and para hydrogen.
`equilibrium` is the sum over all levels at each temperature.

The ideal gas has translation too (O. Sackur and H. Tetrode 1911-12; Mayer and Mayer, chapter 5),

    S_tr = R ln[(2πmkT/h²)^(3/2) kT/p] + 5R/2,    H - H(0) = U_rot + U_vib + 5RT/2,    C_p = C_rot + C_vib + 5R/2,

S and -(G - H(0))/T omit R ln of the number of nuclear-spin functions, as published tables do. Electronic states, including the spin
functions of a radical, count in the ideal gas (`rotor.thermodynamics.electronic`). Neglected: differences of the rotational
constants between vibrational and electronic states, and forces between molecules.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotor import units
from rotor.arrays import Floats
from rotor.quantum.effect import QuantumEffect
from rotor.quantum.effects.watson import SEMI_RIGID
from rotor.table import Table
from rotor.thermodynamics.electronic import ElectronicStates, electronic_states
from rotor.thermodynamics.sums.classical_limit import classical_limit
from rotor.thermodynamics.sums.level_sums import (
    AT_WORST,
    LevelSums,
    Progress,
    checked_temperatures,
    level_sums,
    lowest_level_k,
)
from rotor.thermodynamics.sums.species import implied_symmetry_number, spin_species
from rotor.thermodynamics.vibration import VibrationalStates, vibrational_functions
from rotor.tops.spins.spin_weights import SpinWeights

if TYPE_CHECKING:
    from rotor.tops.top import Top


GAS_CONSTANT = units.BOLTZMANN_J_PER_K * units.AVOGADRO_PER_MOL  # J/(mol K), exact


@dataclass(frozen=True)
class IdealGas:
    """Functions of the ideal gas at one pressure: rotation with vibration, translation and electronic states.

    cp_j_per_mol_k, entropy_j_per_mol_k, enthalpy_j_per_mol (H - H(0)), gibbs_j_per_mol_k (-(G - H(0))/T): (n,); entropy and
    gibbs omit nuclear spin. electronic: the electronic states that count.
    """

    pressure_bar: float
    mass_u: float
    cp_j_per_mol_k: Floats
    entropy_j_per_mol_k: Floats
    enthalpy_j_per_mol: Floats
    gibbs_j_per_mol_k: Floats
    electronic: ElectronicStates


@dataclass(frozen=True, eq=False, repr=False)
class ThermoFunctions(Table):
    """Thermodynamic functions of a top at n temperatures; all arrays are (n,).

    species: the species of the gas. fractions: frozen ratio of the species; empty in equilibrium. symmetry_number, spin_factor: numbers
    of rotations and of nuclear-spin functions in the classical q = spin_factor/symmetry_number · ...; a common divisor of the weights is
    removed. q_rot, energy_j_per_mol, entropy_j_per_mol_k, cv_over_r: quantum sum. q_rot_classical, cv_over_r_classical: classical limit.
    q_rot_corrected, cv_over_r_corrected: classical limit with quantum corrections and distortion, from the lowest level as q_rot; NaN if
    the corrections are large. jmax: last J of the sums, -1 for the corrected classical limit. relative_error: the largest of Q, U and C_v.
    vibrations, q_vib, cv_vib_over_r: None without vibrational states. gas: the ideal gas, None without pressure. hyperfine: treatment of
    spins, by the keys of docs/verbs; None without spins.
    """

    top: Top
    species: str
    fractions: Mapping[str, float]
    symmetry_number: int
    spin_factor: float
    temperature_k: Floats
    q_rot: Floats
    q_rot_classical: Floats
    q_rot_corrected: Floats
    energy_j_per_mol: Floats
    entropy_j_per_mol_k: Floats
    cv_over_r: Floats
    cv_over_r_classical: Floats
    cv_over_r_corrected: Floats
    jmax: NDArray[np.int64]
    relative_error: Floats
    vibrations: VibrationalStates | None = None
    q_vib: Floats | None = None
    cv_vib_over_r: Floats | None = None
    gas: IdealGas | None = None
    hyperfine: dict[str, Any] | None = None

    def __len__(self) -> int:
        return len(self.temperature_k)

    def where(self, chosen: NDArray[np.bool_]) -> ThermoFunctions:
        """The functions at chosen temperatures."""
        gas = self.gas and replace(self.gas, **_chosen_rows(self.gas, chosen))
        return replace(self, **_chosen_rows(self, chosen), gas=gas)

    @property
    def provenance(self) -> dict[str, Any]:
        """Inputs of the functions: the top and its sources, species, vibration, pressure, and the errors of the sums."""
        return (
            self.top.provenance
            | {
                "species": self.species,
                "fractions": dict(self.fractions),
                "symmetry_number": self.symmetry_number,
                "spin_factor": self.spin_factor,
                "vibrations": self.vibrations.text if self.vibrations is not None else None,
                "pressure_bar": self.gas.pressure_bar if self.gas is not None else None,
                "electronic": self.gas.electronic.text if self.gas is not None else None,
                "mass_u": self.gas.mass_u if self.gas is not None else None,
                "jmax": int(self.jmax.max()),
                "relative_error": float(self.relative_error.max()),
                "rows": len(self),
            }
            | ({} if self.hyperfine is None else {"hyperfine": self.hyperfine})
        )

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The functions by name; those of vibration and of the ideal gas only if computed."""
        names = (
            "temperature_k", "q_rot", "q_rot_classical", "q_rot_corrected", "energy_j_per_mol", "entropy_j_per_mol_k",
            "cv_over_r", "cv_over_r_classical", "cv_over_r_corrected",
        )  # fmt: skip
        out = {name: getattr(self, name) for name in names}
        if self.q_vib is not None and self.cv_vib_over_r is not None:
            out |= {"q_vib": self.q_vib, "cv_vib_over_r": self.cv_vib_over_r}
        if self.gas is not None:
            names_of_gas = ("cp_j_per_mol_k", "entropy_j_per_mol_k", "enthalpy_j_per_mol", "gibbs_j_per_mol_k")
            out |= {f"gas_{name}": getattr(self.gas, name) for name in names_of_gas}
        return out


def _chosen_rows(columns: Any, chosen: NDArray[np.bool_]) -> dict[str, Any]:
    """The arrays of an object by name, at chosen temperatures."""
    values = {field.name: getattr(columns, field.name) for field in fields(columns)}
    return {name: value[chosen] for name, value in values.items() if isinstance(value, np.ndarray)}


def species_names(top: Top) -> list[str]:
    """The values of `species` that `thermodynamic_functions` accepts for this top.

    >>> from rotor.tops.top import Top
    >>> species_names(Top.from_constants("B=60 cm-1", spin_weights={"even": 1, "odd": 3}))
    ['equilibrium', 'normal', 'para', 'ortho']
    """
    names = list(spin_species(top.spin_weights))
    return ["equilibrium"] if names == ["all"] else ["equilibrium", "normal", *names]


def thermodynamic_functions(
    top: Top,
    temperatures_k: ArrayLike,
    *,
    species: str = "equilibrium",
    vibrations: VibrationalStates | None = None,
    pressure_bar: float | None = None,
    electronic: ElectronicStates | None = None,
    relative_error: float = 1e-6,
    progress: Progress | None = None,
    effects: Sequence[QuantumEffect] = SEMI_RIGID,
    refuse: bool = True,
) -> ThermoFunctions:
    """Partition function, energy, entropy and heat capacity of a top at many temperatures, quantum and classical.

    Parameters
    ----------
    top : Top
    temperatures_k : (n,) above 0 K, in any order.
    species : "equilibrium", "normal" (frozen in the ratio of high temperature), or one nuclear-spin species: "para",
        "ortho", or a class of the spin weights such as "E"; see `species_names`.
    vibrations : vibrational states; none: vibration is left out.
    pressure_bar : pressure of an ideal gas, whose functions are then computed too; the top must have a mass.
    electronic : electronic states of the ideal gas. Default: the spin functions of the molecule (`electronic_states`), or none if
        the effects contain the electron spin, because Q then counts its functions.
    relative_error : largest error of Q, U and C_v. It can be exceeded, up to 10 %, if levels beyond the range of the distortion
        constants are populated; `ThermoFunctions.relative_error` is the error reached.
    progress : called as `progress(j, last)` during a long sum.
    effects : effects in the Hamiltonian; with spins Q counts their functions, see `rotor.thermodynamics.sums.spin_sums`.
    refuse : False: return functions with a larger error too, for a caller that checks `ThermoFunctions.relative_error`.

    Returns
    -------
    ThermoFunctions

    Raises
    ------
    ValueError
        A temperature not above 0 K, a species that the molecule does not have, no mass, levels beyond the range of the distortion.

    Examples
    --------
    >>> from rotor.tops.top import Top
    >>> functions = thermodynamic_functions(Top.from_constants("B=10 cm-1"), [5.0, 300.0])
    >>> [round(float(x), 4) for x in functions.cv_over_r]  # 3x² e⁻ˣ/(1 + 3e⁻ˣ)², x = 2Θ/T; 1 + (Θ/T)²/45
    [0.3088, 1.0001]
    """
    parts, fractions = _parts(top, species)
    temperatures = checked_temperatures(temperatures_k)
    effects = tuple(effects)
    if any(effect.spins(top) for effect in effects):
        rotation = _with_spins(top, species, parts, fractions, temperatures, relative_error, effects, progress, refuse)
    else:
        settings: dict[str, Any] = {"progress": progress, "effects": effects, "refuse": refuse}
        sums = level_sums(top, list(parts.values()), temperatures, relative_error, **settings)
        rotation = _rotation(top, species, parts, fractions, sums, effects)
    if pressure_bar is None:
        return _with_vibration(rotation, vibrations)
    if electronic is None:
        electronic = ElectronicStates() if _has_electrons(top, effects) else electronic_states(top.molecule)
    return _with_gas(_with_vibration(rotation, vibrations), pressure_bar, electronic)


def _parts(top: Top, species: str) -> tuple[dict[str, SpinWeights], dict[str, float]]:
    """The spin weights of each species in the gas, and the fractions in which they are frozen, if they are."""
    weights_by_species = spin_species(top.spin_weights)
    if species == "equilibrium":
        return {species: top.spin_weights}, {}
    if weights_by_species.keys() == {"all"}:
        raise ValueError(
            f"species {species!r}: all levels of {top.name or 'this top'} belong to the same nuclear-spin species"
        )
    if species == "normal":
        means = {name: weights.mean for name, weights in weights_by_species.items()}
        return weights_by_species, {name: mean / sum(means.values()) for name, mean in means.items()}
    if species not in weights_by_species:
        raise ValueError(f"species {species!r}: {top.name or 'this top'} has {', '.join(species_names(top))}")
    return {species: weights_by_species[species]}, {}


def _tunnelling_components(top: Top) -> int:
    """Number of tunnelling components (states split by tunnelling between equivalent forms) that share the spin weights of the geometry."""
    return len(top.states.weights) if top.states is not None and 0 in top.states.weights else 1


def refuse_species_with_totals(top: Top, species: str, effects: Sequence[QuantumEffect]) -> None:
    """Raise ValueError for a single species or a frozen mixture if nuclei are coupled to a total spin."""
    if species != "equilibrium" and any(spin.total for effect in effects for spin in effect.spins(top)):
        raise ValueError(
            f"species: {species!r}: with nuclei that are coupled to a total spin species are not separated; expected equilibrium"
        )


def _has_electrons(top: Top, effects: Sequence[QuantumEffect]) -> bool:
    return any(spin.electron for effect in effects for spin in effect.spins(top))


def refuse_electrons_twice(top: Top, effects: Sequence[QuantumEffect], electronic: ElectronicStates | None) -> None:
    """Raise ValueError for electronic states together with effects of the electron spin: Q would count its functions twice."""
    if electronic is not None and _has_electrons(top, effects):
        raise ValueError(
            "electronic: the constants of the electron spin already contribute its functions to Q; leave one of the two out"
        )


def _with_spins(
    top: Top,
    species: str,
    parts: dict[str, SpinWeights],
    fractions: dict[str, float],
    temperatures: Floats,
    relative_error: float,
    effects: tuple[QuantumEffect, ...],
    progress: Progress | None,
    refuse: bool,
) -> ThermoFunctions:
    """The functions of rotation with spins."""
    from rotor.quantum.hyperfine_method import EXACT, HyperfineMethod
    from rotor.thermodynamics.sums.spin_factor import spin_functions
    from rotor.thermodynamics.sums.spin_sums import spin_sums

    refuse_species_with_totals(top, species, effects)
    spin_result = spin_sums(top, list(parts.values()), temperatures, relative_error, effects, progress, refuse=refuse)
    rotation = _rotation(top, species, parts, fractions, spin_result.sums, effects)
    counted = spin_result.split & (rotation.relative_error <= AT_WORST)
    method = next((effect.method for effect in effects if isinstance(effect, HyperfineMethod)), EXACT)
    hyperfine = {
        "spin_functions": spin_functions(top, effects),
        "splitting_mhz": spin_result.splitting_mhz,
        "summed_up_to_k": float(temperatures[counted].max()) if counted.any() else None,
        "method": method,
    }
    return replace(rotation, hyperfine=hyperfine)


def _rotation(
    top: Top,
    species: str,
    parts: dict[str, SpinWeights],
    fractions: dict[str, float],
    sums: list[LevelSums],
    effects: tuple[QuantumEffect, ...] = SEMI_RIGID,
) -> ThermoFunctions:
    """The functions of rotation, including spins if the effects contain them."""
    from rotor.thermodynamics.sums.spin_factor import spin_functions

    ground_k, temperatures = lowest_level_k(top, [top.spin_weights], effects)[0], sums[0].temperatures_k
    shares = np.array(list(fractions.values()) or [1.0])
    ln_q, mean, cv = _mixed(sums, ground_k, shares)

    limit = classical_limit(top, next(iter(parts.values())) if len(parts) == 1 else None)
    means = np.array([classical_limit(top, weights).mean_weight for weights in parts.values()])
    mean_weight = float(np.exp(shares @ np.log(means / shares)))
    limit = replace(limit, mean_weight=mean_weight * spin_functions(top, effects))
    nuclear_weight = mean_weight * spin_functions(top, effects, electrons=False)
    corrected_q, _, corrected_cv = limit.corrected(temperatures)
    above = np.where(np.isfinite(corrected_q), ground_k / temperatures, 0.0)
    symmetry_number = top.symmetry.symmetry_number if top.symmetry else implied_symmetry_number(top.spin_weights)
    return ThermoFunctions(
        top=top,
        species=species,
        fractions=fractions,
        symmetry_number=symmetry_number,
        spin_factor=nuclear_weight * symmetry_number * _tunnelling_components(top),
        temperature_k=temperatures,
        q_rot=np.exp(ln_q),
        q_rot_classical=limit.q(temperatures),
        q_rot_corrected=corrected_q * np.exp(above),  # from the lowest level, as Q
        energy_j_per_mol=GAS_CONSTANT * temperatures * mean,
        entropy_j_per_mol_k=GAS_CONSTANT * (ln_q + mean),
        cv_over_r=cv,
        cv_over_r_classical=np.full(len(temperatures), limit.degrees / 2),
        cv_over_r_corrected=corrected_cv,
        jmax=np.max([total.jmax for total in sums], axis=0),
        relative_error=np.max([(total.error_q, total.error_energy, total.error_cv) for total in sums], axis=(0, 1)),
    )


def _mixed(sums: Sequence[LevelSums], ground_k: float, shares: Floats) -> tuple[Floats, Floats, Floats]:
    """ln q = Σ x ln(q/x), U/RT and C_v/R of species in a fixed ratio; energies (K) from a common zero."""
    ln_q, mean, cv = 0.0, 0.0, 0.0
    for total, share in zip(sums, shares.tolist(), strict=True):
        above = (total.ground_k - ground_k) / total.temperatures_k
        ln_q = ln_q + share * (np.log(total.q) - above - math.log(share))
        mean = mean + share * (total.energy_over_rt + above)
        cv = cv + share * total.cv_over_r
    return np.asarray(ln_q), np.asarray(mean), np.asarray(cv)


def _with_vibration(rotation: ThermoFunctions, vibrations: VibrationalStates | None) -> ThermoFunctions:
    if vibrations is None:
        return rotation
    ln_q, _, cv = vibrational_functions(vibrations, rotation.temperature_k)
    return replace(rotation, vibrations=vibrations, q_vib=np.exp(ln_q), cv_vib_over_r=cv)


def _with_gas(functions: ThermoFunctions, pressure_bar: float, electronic: ElectronicStates) -> ThermoFunctions:
    """The functions of rotation with those of the ideal gas at a pressure."""
    if not (math.isfinite(pressure_bar) and pressure_bar > 0):
        raise ValueError(f"pressure {pressure_bar} bar: expected a finite pressure above 0")
    if functions.top.mass_u is None:
        raise ValueError(
            "the ideal gas needs the mass of the molecule, which constants alone do not have; give a molecule"
        )
    t, rt = functions.temperature_k, GAS_CONSTANT * functions.temperature_k
    ln_q_vib, mean_vib, cv_vib = np.zeros((3, len(t)))
    if functions.vibrations is not None:
        ln_q_vib, mean_vib, cv_vib = vibrational_functions(functions.vibrations, t)
    ln_q_el, mean_el, cv_el = electronic.functions(t)
    enthalpy = functions.energy_j_per_mol + rt * (mean_vib + mean_el + 2.5)
    entropy = functions.entropy_j_per_mol_k - GAS_CONSTANT * math.log(functions.spin_factor)
    entropy = entropy + GAS_CONSTANT * (ln_q_vib + mean_vib + ln_q_el + mean_el)
    entropy = entropy + translational_entropy(t, functions.top.mass_u, pressure_bar)
    gas = IdealGas(
        pressure_bar=pressure_bar,
        mass_u=functions.top.mass_u,
        cp_j_per_mol_k=GAS_CONSTANT * (functions.cv_over_r + cv_vib + cv_el + 2.5),
        entropy_j_per_mol_k=entropy,
        enthalpy_j_per_mol=enthalpy,
        gibbs_j_per_mol_k=entropy - enthalpy / t,
        electronic=electronic,
    )
    return replace(functions, gas=gas)


def translational_entropy(temperatures_k: ArrayLike, mass_u: float, pressure_bar: float) -> Floats:
    """Entropy of an ideal gas of point masses in J/(mol K), by the equation of Sackur and Tetrode, (n,).

    >>> round(float(translational_entropy([298.15], 39.948, 1.0)[0]), 2)  # argon: 154.85 in the tables of CODATA
    154.85
    """
    kt = units.BOLTZMANN_J_PER_K * np.asarray(temperatures_k, dtype=np.float64)
    per_volume = (2 * math.pi * mass_u * units.ATOMIC_MASS_KG * kt) ** 1.5 / units.PLANCK_J_S**3
    return np.asarray(GAS_CONSTANT * (np.log(per_volume * kt / (pressure_bar * 1e5)) + 2.5))
