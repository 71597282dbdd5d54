"""Effects that a model of rotation neglects, with estimated sizes: the next order of distortion, known spin couplings, and what the
molecule shows signs of:

| sign | effect | size |
|---|---|---|
| a nucleus of spin 1 or more | nuclear quadrupole coupling | known, or the gradient in covalent bonds (`splittings`) |
| constants from a geometry only | centrifugal distortion | 4D(J+1)³, D = 4B³/ν² |
| the same | vibration-rotation difference, B_e - B_0 | δB/B (`zero_point`) · 2B(J+1) |
| a methyl group beside atoms off its axis | internal rotation | A - E difference of lines (`internal_rotation`); at most F |
| O-H or S-H whose turn leads to an equal geometry | torsional tunnelling | not estimated |
| a pyramidal nitrogen with two hydrogens | inversion | at most about 24 GHz, as in NH3; 1.6 GHz, as in ND3, for heavy hydrogens |
| an odd number of electrons, an odd electronic state | electron spin | its largest known constant, else not estimated |
| nuclei with spin | spin-rotation and spin-spin coupling | not estimated |

D = 4B³/ν² holds exactly for a harmonic diatomic molecule (A. Kratzer, Z. Phys. 3 (1920) 289). ν = 1150 cm⁻¹ (B/cm⁻¹)^0.3 was chosen on the
library: it reproduces 40 of 41 D_J or ΔJ within a factor of 3 (tests/quantum/estimates/test_limits.py; the exception is glycolaldehyde).
A free group has the levels F m², with m = 0 for A and m = ±1 for E species, F apart.

The next order is extrapolated as a geometric series, c s_n²/s_(n-1), from the sizes s of the last two orders at one J (`order_sizes_mhz`).
From the quartic to the sextic order c = 0.3 for linear tops and 3 for others; c = 1 for all higher orders. A harmonic diatomic molecule has
c = 2, most of which anharmonicity cancels (Dunham's H = 2D(12B² - αω)/3ω²). The values were chosen on the library, where they hold within a
factor of 3 for 25 of 30 orders (tests/scenes/test_scene_plans.py names the others).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from rotor import units
from rotor.arrays import Ints
from rotor.frozen import dataclass
from rotor.quantum.effect import EffectSize, QuantumEffect, effect_sizes
from rotor.quantum.estimates.splittings import Splitting, splitting_nuclei
from rotor.requests.budget import size_text

if TYPE_CHECKING:
    from rotor.molecules.molecule import Molecule
    from rotor.quantum.estimates.methyl_groups import MethylGroup
    from rotor.tops.top import Top

FACTORS = {"linear": 0.3, "other": 3.0, "higher": 1.0}  # c
COMPUTE = "its constants are known, add the effects of spins"  # reports replace this by the option
ZERO_POINT, ESTIMATED = "vibration-rotation difference", "errors of the estimated constants"
OF_CHI = 0.5  # largest shift relative to χ: χ/2 for J = 1 with I = 1, χ/4 for higher J
VIBRATION_CM, VIBRATION_POWER = 1150.0, 0.3  # ν = 1150 (B/cm⁻¹)^0.3 cm⁻¹, for distortion that was not computed
HIGHEST_J = 20  # A - E splittings change little with J; those of higher J are estimated at this J
LOW_BARRIER = 10.0  # s = 4 V3/9F; below it torsional levels of E species depend on K as strongly as rotational ones
ELECTRON_SPIN = "electron spin"
QUADRUPOLE = "nuclear quadrupole"
SPIN_LIMITS = frozenset({QUADRUPOLE, "magnetic coupling of nuclear spins", ELECTRON_SPIN})
# the splittings of NH3 and ND3, see docs/limitations.md and data/molecules
AMMONIA_MHZ, HEAVY_AMMONIA_MHZ = 24_000.0, 1_600.0


@dataclass(frozen=True)
class Limit:
    """A neglected effect.

    size_mhz: for a line at the highest J; None if not estimated. at_most: whether the size is an upper bound. levels: J and K for which
    the size holds, where it grows fast with them.
    """

    name: str
    size_mhz: float | None
    text: str
    at_most: bool = False
    levels: str = ""

    @property
    def size(self) -> float | None:
        """The size in MHz, as that of `rotor.requests.plan.LeftOut`."""
        return self.size_mhz

    def sentence(self, with_spins: str = COMPUTE) -> str:
        """Name, size and consequence, as reports print them. with_spins: how the effects of spins are added."""
        estimate = "not estimated" if self.size_mhz is None else f"about {size_text(self.size_mhz, 'MHz')}"
        size = f"at most {estimate}" if self.at_most else estimate
        return f"{self.name}: {size}; {self.text.replace(COMPUTE, with_spins)}"


def model_sizes(top: Top, j: int, effects: Sequence[QuantumEffect]) -> list[EffectSize]:
    """Sizes at one J of the effects of a calculation and of those that it neglects, largest first."""
    return sorted([*effect_sizes(top, j, effects), *absent_sizes(top, effects)], key=lambda effect: -effect.size_mhz)


def absent_sizes(top: Top, effects: Sequence[QuantumEffect]) -> list[EffectSize]:
    """The size of quadrupole coupling if the calculation neglects it, summed as in `NuclearQuadrupole.size_mhz`."""
    nuclei = {nucleus.nucleus: abs(nucleus.chi_mhz) for nucleus in splitting_nuclei(top)}
    if not nuclei or QUADRUPOLE in {effect.name for effect in effects}:
        return []
    return [EffectSize(QUADRUPOLE, sum(nuclei.values()), False)]


def model_limits(top: Top, j: int, effects: Sequence[QuantumEffect]) -> list[Limit]:
    """Effects that a calculation neglects, largest first.

    Without estimates, electron spin comes first, since it may exceed all others, and the coupling of nuclear spins last.

    >>> from rotor.tops.top import Top
    >>> [limit.name for limit in model_limits(Top.from_constants("B=57.6 GHz"), 7, ())]
    ['centrifugal distortion']
    """
    known_limits = {limit.name: limit for limit in known_couplings(top, j, effects)}
    quadrupole = known_limits.pop(QUADRUPOLE, None)
    present = {effect.name for effect in effects} | set(known_limits)
    shift_mhz = 0.0 if quadrupole is None else quadrupole.size_mhz or 0.0
    nuclear = _nuclear_limits(top, effects, present, shift_mhz)
    limits = [*known_limits.values(), *_constant_limits(top, j), *nuclear]
    if top.molecule is not None:
        limits += _geometry_limits(top, top.molecule, j, present)
    return largest_first(limits)


def all_limits(top: Top, j: int, effects: Sequence[QuantumEffect], *, tabulated: bool = False) -> list[Limit]:
    """`model_limits` with the effects that follow from the constants, however small.

    tabulated: all energies are from the table of the top, so that the distortion series does not matter.
    """
    further = None if tabulated else next_order(top, j, effects)
    limits = model_limits(top, j, effects)
    return limits if further is None else largest_first([*limits, further])


def next_order(top: Top, j: int, effects: Sequence[QuantumEffect]) -> Limit | None:
    """The order of distortion beyond the highest of the calculation; None for rigid constants.

    >>> from rotor.quantum.effects.watson import SEMI_RIGID
    >>> from rotor.tops.top import Top
    >>> sextic = next_order(Top.from_constants("B=6000 D=0.001 MHz"), 20, SEMI_RIGID)
    >>> f"{sextic.size_mhz:.2e}"  # 0.3 D²/B (J(J+1))³
    '3.70e-03'
    """
    from rotor.quantum.estimates.convergence import order_sizes_mhz

    sizes = list(order_sizes_mhz(top, j, effects=effects).items())
    if len(sizes) < 2 or not sizes[-2][1]:
        return None
    (_, before), (order, last) = sizes[-2:]
    which = "higher" if order > 4 else "linear" if top.kind == "linear" else "other"
    text = f"{FACTORS[which]:g} times the order J^{order} ({size_text(last, 'MHz')}) squared over the order before"
    levels = f"J = {j}" if top.kind == "linear" else f"J = {j}, K up to {j}"
    return Limit(
        f"centrifugal distortion of order J^{order + 2}", FACTORS[which] * last**2 / before, text, levels=levels
    )


def known_couplings(top: Top, j: int, effects: Sequence[QuantumEffect]) -> list[Limit]:
    """Spin couplings with known constants that the calculation neglects."""
    if top.spin_constants is None:
        return []
    from rotor.quantum.effects.of_top import spin_effects

    present = {effect.name for effect in effects}
    parts = {"nuclear quadrupole": OF_CHI}
    limits = []
    for effect in spin_effects(top):
        if effect.name not in present:
            spins = ", ".join(dict.fromkeys(name for term in effect.spin_terms(top) for name in term.spins))
            size = parts.get(effect.name, 1.0) * effect.size_mhz(top, j)
            limits.append(Limit(effect.name, size, f"{spins}: {COMPUTE}"))
    return limits


def largest_first(limits: Sequence[Limit]) -> list[Limit]:
    """Limits by decreasing size; those without an estimate last, except for electron spin, which is first."""
    unknown = {ELECTRON_SPIN: math.inf}
    return sorted(
        limits, key=lambda limit: -(unknown.get(limit.name, 0.0) if limit.size_mhz is None else limit.size_mhz)
    )


def limit_facts(top: Top, j: int, effects: Sequence[QuantumEffect], further: Sequence[Limit] = ()) -> dict[str, Any]:
    """Sizes of effects and neglected effects at one J, `further` ones too, by the keys of docs/verbs."""
    return {
        "sizes_at_j": j,
        "effects": [size._asdict() for size in model_sizes(top, j, effects)],
        "limits": [asdict(limit) for limit in largest_first([*model_limits(top, j, effects), *further])],
        "splitting_nuclei": [asdict(splitting) for splitting in splitting_nuclei(top)],
    }


def _constant_limits(top: Top, j: int) -> list[Limit]:
    """Zero-point vibration of a geometry, and the distortion that rigid constants neglect."""
    limits, b = [], sum(top.rotational_constants_mhz[1:]) / 2  # half the spacing of lines of neighbouring J
    rigid = not any(name not in "ABC" for name in top.constants.values)
    if top.source_geometry is not None:
        limits += _zero_point(top.source_geometry, 2 * b * (j + 1))
    if rigid and top.kind != "spherical":
        vibration_cm = VIBRATION_CM * (b / units.MHZ_PER_CM) ** VIBRATION_POWER
        d = 4 * b**3 / (vibration_cm * units.MHZ_PER_CM) ** 2
        text = (
            f"the constants are rigid; with a vibration of {_rounded(vibration_cm, 2)} cm-1 a line of J = {j}, K = 0 is "
            "lower by this amount"
        )
        limits.append(Limit("centrifugal distortion", 4 * d * (j + 1) ** 3, text))
    return limits


def _zero_point(molecule: Molecule, line_mhz: float) -> list[Limit]:
    """The effect of zero-point vibration on lines of about one frequency; empty without bonded atoms."""
    from rotor.molecules.bonds import bonded_atoms
    from rotor.quantum.estimates.zero_point import relative_difference

    relative = relative_difference(molecule, bonded_atoms(molecule))
    percent = _rounded(100 * relative, 1)
    text = (
        f"A, B, C of an equilibrium geometry are about {percent} % off those of the ground state; not of r0, rs or rz"
    )
    return [Limit(ZERO_POINT, relative * line_mhz, text)] if relative else []


def _rounded(value: float, digits: int) -> str:
    """A number rounded to significant digits, as short text."""
    return f"{float(f'{value:.{digits}g}'):g}"


def _nuclear_limits(
    top: Top, effects: Sequence[QuantumEffect], sized: Collection[str], shift_mhz: float
) -> list[Limit]:
    """Nuclear spin couplings that the calculation neglects.

    sized: names of couplings whose size is listed already. shift_mhz: largest shift of a level by known quadrupole coupling.
    """
    limits = []
    if absent_sizes(top, effects):
        nuclei = splitting_nuclei(top)
        # isotopes, if no atom is named
        known = {nucleus.nucleus.partition("_")[0] for nucleus in nuclei if nucleus.known}
        others = [nucleus for nucleus in nuclei if not nucleus.known and nucleus.nucleus not in known]
        size = max([shift_mhz, *(abs(nucleus.chi_mhz) for nucleus in others)])
        limits.append(Limit(QUADRUPOLE, size, _split_text(nuclei)))
    if top.molecule is None:
        return limits
    magnetic = sorted(
        {nucleus.label for nucleus in top.molecule.nuclei if nucleus.spin > 0} - _with_magnetic_constants(top)
    )
    elsewhere = top.spin_constants is None and {"spin-rotation", "spin-spin"} & set(sized)
    if magnetic and not elsewhere:
        limits.append(Limit("magnetic coupling of nuclear spins", None, f"{', '.join(magnetic)}: small splittings"))
    return limits


def _with_magnetic_constants(top: Top) -> set[str]:
    """Isotopes with a known constant other than χ, such as C_aa(14N) or b_F(S,1H_2)."""
    values = top.spin_constants.values if top.spin_constants else {}
    inside = [name.partition("(")[2].rstrip(")").split(",") for name in values if not name.startswith("chi")]
    return {spin.partition("_")[0] for spins in inside for spin in spins}


def _split_text(nuclei: Sequence[Splitting]) -> str:
    """Text on the nuclei that split lines: known splittings, and the remedy."""
    known_splittings = [
        f"{nucleus.nucleus} splits J = 1 by {nucleus.splitting_mhz:.3g} MHz" for nucleus in nuclei if nucleus.known
    ]
    others = sorted({nucleus.nucleus for nucleus in nuclei if not nucleus.known})
    texts = [f"levels shift by this amount, {', '.join(known_splittings)}: {COMPUTE}"] if known_splittings else []
    if others:
        texts.append(
            f"{', '.join(others)} split{'s' if len(others) == 1 else ''} lines of low J, by about this amount in covalent bonds; its "
            f"spin constants, such as chi_aa({others[0]}), are not known"
        )
    return "; ".join(texts)


def _geometry_limits(top: Top, molecule: Molecule, j: int, present: set[str]) -> list[Limit]:
    """Large-amplitude motions and unpaired electrons that the geometry shows."""
    from rotor.molecules.bonds import bonded_atoms
    from rotor.quantum.estimates.methyl_groups import methyl_groups

    limits, bonds = [], bonded_atoms(molecule)
    if "internal rotation" not in present and (groups := methyl_groups(molecule, bonds)):
        limits.append(_internal_rotation(top, groups, j))
    if (inversions := _inversions_mhz(molecule, bonds)) and "interacting states" not in present:
        text = "nitrogen is pyramidal: its levels are pairs that this leaves out; the size is ammonia's, heavier groups have less"
        limits.append(Limit("inversion", max(inversions), text, at_most=True))
    if (bonds_turned := _turning_hydrogens(molecule, bonds)) and "interacting states" not in present:
        text = f"hydrogen turns about {bonds_turned} to an equal position: levels are pairs or more, by rotor torsion --bond"
        limits.append(Limit("torsional tunnelling", None, text))
    electrons = sum(nucleus.element_number for nucleus in molecule.nuclei) - molecule.charge
    if (electrons % 2 or molecule.electronic == "odd") and "spin-rotation" not in present:
        text = (
            "the molecule has unpaired electrons: levels and lines are multiplets, by spin constants such as eps_aa(S)"
        )
        limits.append(Limit(ELECTRON_SPIN, molecule.electron_spin_mhz, text))
    return limits


def _turning_hydrogens(molecule: Molecule, bonds: Sequence[Ints]) -> str:
    """The bonds, such as C2-O3, about which the hydrogens of O-H and S-H turn to equal geometries; empty if they do not.

    They do where the other nuclei have symmetry that the molecule lacks. Groups beside a methyl group turn against it: internal rotation.
    """
    from rotor.molecules.symmetry.point_group import NEAR, NEAR_UP_TO, find_symmetry

    symbols, turned = molecule.symbols, _single_hydrogens(molecule, bonds)
    if not turned or len(symbols) > NEAR_UP_TO:
        return ""
    bearers = {atom for _, atom in turned.values()}
    kinds = [(symbol, i in bearers) for i, symbol in enumerate(symbols)]
    whole, skeleton = (
        find_symmetry([kinds[i] for i in rows], molecule.masses_u[rows], molecule.positions_angstrom[rows], NEAR)
        for rows in ([*range(len(symbols))], [i for i in range(len(symbols)) if i not in turned])
    )
    orders = [len(group.rotations) + len(group.improper) for group in (whole, skeleton)]
    # a linear skeleton has all operations about its axis: only mirror images differ
    equal = not whole.improper if skeleton.linear else orders[1] > orders[0]
    pairs = sorted({(min(pair), max(pair)) for pair in turned.values()}) if equal else []
    return ", ".join("-".join(f"{symbols[i]}{i + 1}" for i in pair) for pair in pairs)


def _single_hydrogens(molecule: Molecule, bonds: Sequence[Ints]) -> dict[int, tuple[int, int]]:
    """The hydrogens of O-H and S-H beside no methyl group: the neighbour of O or S, and O or S itself, by hydrogen."""
    symbols, turned = molecule.symbols, dict[int, tuple[int, int]]()
    attached = [sum(symbols[i] == "H" for i in near.tolist()) for near in bonds]
    for atom, near in enumerate(bonds):
        if symbols[atom] in ("O", "S") and len(near) == 2 and attached[atom] == 1:
            hydrogen, other = sorted(near.tolist(), key=lambda i: symbols[i] != "H")
            if attached[other] < 3:
                turned[hydrogen] = (other, atom)
    return turned


def _internal_rotation(top: Top, groups: Sequence[MethylGroup], j: int) -> Limit:
    """Internal rotation of the group with the lowest V3/F; an upper bound if no barrier of a similar molecule is known.

    The size is that of the lines which the larger part of the dipole allows: ΔKa = 0 along a, ΔKa = 1 across it.
    """
    from rotor.quantum.estimates.methyl_groups import line_shifts
    from rotor.tops.internal_rotation import MOST_TOPS

    what = "a methyl group turns" if len(groups) == 1 else f"{len(groups)} methyl groups turn"
    unknown = [group.rotor.f_mhz for group in groups if group.barrier is None]
    if unknown:
        text = f"{what} against the rest: lines of A and of E species are apart, by less the higher the barrier"
        return Limit("internal rotation", max(unknown), text, at_most=True)
    least = min(groups, key=lambda group: group.rotor.barrier_mhz / group.rotor.f_mhz)
    barrier, rotor, j = least.barrier, least.rotor, min(j, HIGHEST_J)
    lines = zip(("within one K", "between two K"), line_shifts(top.rotational_constants_mhz, rotor, j), strict=True)
    sizes = [(where, float(np.median(np.abs(splittings)))) for where, splittings in lines]
    dipole = np.array(top.dipole_abc_debye or (0.0, 0.0, 0.0))
    if dipole @ dipole > 2 * dipole[0] ** 2:
        sizes.reverse()
    (first, size), (second, other) = sizes
    assert barrier is not None
    assert top.molecule is not None
    text = (
        f"{what} against the rest: half of the A and E lines of J = {j} {first} are farther apart, {second} than "
        f"{_rounded(other, 1)} MHz; barrier {barrier.v3_cm:g} cm-1, {barrier.text(top.molecule)}"
    )
    if 4 * rotor.barrier_mhz / (9 * rotor.f_mhz) < LOW_BARRIER:
        text += ", so low that no line of the E species fits a rigid top"
    if top.kind == "asymmetric" and len(groups) <= MOST_TOPS and all(group.rotor.barrier_mhz for group in groups):
        text += "; internal rotation 'geometry' computes it"
    return Limit("internal rotation", size, text)


def _inversions_mhz(molecule: Molecule, bonds: Sequence[Ints]) -> list[float]:
    """The splitting of ammonia for each pyramidal nitrogen with three neighbours, at least two of them hydrogens.

    That of ND3 if all neighbours are heavier than protium.
    """
    from rotor.quantum.estimates.methyl_groups import is_flat

    splittings = []
    for atom, near in enumerate(bonds):
        hydrogens = sum(molecule.symbols[i] == "H" for i in near.tolist())
        if molecule.symbols[atom] != "N" or len(near) != 3 or hydrogens < 2:
            continue
        if not is_flat(molecule.positions_angstrom, atom, near):
            heavy = all(molecule.mass_numbers[i] > 1 for i in near.tolist())
            splittings.append(HEAVY_AMMONIA_MHZ if heavy else AMMONIA_MHZ)
    return splittings
