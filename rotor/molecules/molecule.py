"""A molecule: symbols, isotopes, positions, and its dipole and polarizability in the same frame.

A `Molecule` holds the checked data of a file or program, with their source and uncertainty. It has no rotational properties.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from rotor.arrays import Floats, Ints
from rotor.frozen import dataclass
from rotor.molecules.nuclei import Isotope, isotope
from rotor.units import DEBYE_PER_E_ANGSTROM, QUADRUPOLE_MHZ_PER_BARN_AU

_UNTURNED = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

ELECTRONIC = ("even", "odd")  # parity of the electronic state under half turns
# X2 with the ground state 3Σg- (K. P. Huber and G. Herzberg 1979)
SIGMA_MINUS = ("B", "O", "Si", "S", "Ge", "Se", "Te")
FEW_ATOMS = 100  # up to which all distances are as quick as a k-d tree
CLOSEST_ANGSTROM = 0.1  # no two nuclei of a molecule come nearer; H2 has 0.74 Å


@dataclass(frozen=True, eq=False, repr=False)
class Molecule:
    """Nuclei at fixed positions, checked.

    symbols : n element symbols; isotope names such as `"D"` or `"13C"` are split into symbol and mass number
    positions_angstrom : (n, 3) array, Å
    mass_numbers : n mass numbers; default: those of `symbols`, or of the most abundant isotopes
    charge : in elementary charges
    multiplicity : 2S + 1 of the electrons. None: not known
    electron_spin_mhz : largest constant of the electron spin, such as |lambda| of a triplet. None: not known
    electronic : "even" if half turns leave the electronic state unchanged, as for closed shells; "odd" if half turns that exchange
        like nuclei change its sign, as for Σg- of O2. Used for nuclear-spin weights. By default that of the ground state of O2, S2 and the
        like, which are triplets then, and "even" for others
    dipole_debye : (3,) array in the frame of the positions, D, pointing from negative to positive; for an ion relative
        to its centre of mass. None: not known
    dipole_source : origin of the dipole
    polarizability_angstrom3 : (3, 3) symmetric array in the same frame, polarizability volume in Å³. None: not known
    polarizability_source : origin of the polarizability
    quadrupole_mhz : (3, 3) traceless quadrupole couplings χ in MHz in the same frame, by atom number, counted from 1
    field_gradients_au : (3, 3) traceless second derivatives of the electric potential at the nuclei, Eh/(e a0²), in the same frame, by
        atom number. They do not change with isotopes, so that an isotope with a quadrupole moment gets its coupling
    quadrupole_source : origin of couplings and gradients
    name, source : name of the molecule, origin of the geometry
    uncertainty : typical relative error of the rotational constants from the geometry. None: not known
    notes : remarks for the user

    Raises ValueError for no atoms, positions that are not n triples of finite numbers, a symbol or mass number of no known
    isotope, two atoms closer than 0.1 Å, an unknown electronic state, or a dipole or tensor of the wrong shape.
    Arrays are read-only copies.

    >>> water = Molecule(("O", "H", "H"), [[0, 0, 0.1173], [0, 0.7572, -0.4692], [0, -0.7572, -0.4692]])
    >>> water.formula, water.mass_u
    ('H2O', 18.010564683056)
    >>> water.with_isotopes({2: "D"}).formula
    'H[2H]O'
    """

    symbols: tuple[str, ...]
    positions_angstrom: Floats
    mass_numbers: tuple[int, ...] = ()
    charge: int = 0
    multiplicity: int | None = None
    electron_spin_mhz: float | None = None
    electronic: str = ""
    dipole_debye: Floats | None = None
    dipole_source: str = ""
    polarizability_angstrom3: Floats | None = None
    polarizability_source: str = ""
    quadrupole_mhz: Mapping[int, Floats] = field(default_factory=dict)
    field_gradients_au: Mapping[int, Floats] = field(default_factory=dict)
    quadrupole_source: str = ""
    name: str = ""
    source: str = ""
    uncertainty: float | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        nuclei = _nuclei(self.symbols, self.mass_numbers)
        positions = _checked(self.positions_angstrom, (len(nuclei), 3), "positions_angstrom")
        _refuse_coincident(positions, nuclei)
        for key, shape in (("dipole_debye", (3,)), ("polarizability_angstrom3", (3, 3))):
            if getattr(self, key) is not None:
                object.__setattr__(self, key, _checked(getattr(self, key), shape, key))
        _refuse_lopsided(self.polarizability_angstrom3)
        for key in ("quadrupole_mhz", "field_gradients_au"):
            object.__setattr__(self, key, _checked_tensors(getattr(self, key), len(nuclei), key))
        object.__setattr__(self, "notes", tuple(self.notes))
        charge = float(_checked(self.charge, (), "charge"))
        if not charge.is_integer():
            raise ValueError(f"charge {charge:g}: expected a whole number of elementary charges")

        if not self.electronic:
            self._take_ground_state([nucleus.symbol for nucleus in nuclei], charge)
        _refuse_multiplicity(self.multiplicity, sum(nucleus.element_number for nucleus in nuclei) - int(charge))
        if self.electron_spin_mhz is not None and not 0 < self.electron_spin_mhz < np.inf:
            raise ValueError(f"electron_spin_mhz {self.electron_spin_mhz!r}: expected a finite number above 0")
        if self.electronic not in ELECTRONIC:
            raise ValueError(f"electronic {self.electronic!r}: expected 'even' (a closed shell) or 'odd' (such as Σg-)")

        object.__setattr__(self, "symbols", tuple(nucleus.symbol for nucleus in nuclei))
        object.__setattr__(self, "mass_numbers", tuple(nucleus.mass_number for nucleus in nuclei))
        object.__setattr__(self, "positions_angstrom", positions)
        object.__setattr__(self, "charge", int(charge))

    def _take_ground_state(self, symbols: list[str], charge: float) -> None:
        """Set parity and multiplicity where the elements alone determine the electronic ground state; even otherwise."""
        first = symbols[0]
        triplet = symbols == [first, first] and first in SIGMA_MINUS and not charge and self.multiplicity in (None, 3)
        object.__setattr__(self, "electronic", "odd" if triplet else "even")
        if triplet:
            object.__setattr__(self, "multiplicity", 3)
            text = f"{first}2 is taken in its ground state 3Σg-: spin weights and degeneracy of the electrons are those of this triplet"
            object.__setattr__(self, "notes", (*self.notes, text))

    @cached_property
    def nuclei(self) -> tuple[Isotope, ...]:
        """The isotope of each atom, with its mass, spin and moments."""
        return tuple(isotope(s, a) for s, a in zip(self.symbols, self.mass_numbers, strict=True))

    @property
    def masses_u(self) -> Floats:
        """Masses (n,) of the atoms in u."""
        return np.array([nucleus.mass_u for nucleus in self.nuclei])

    @property
    def mass_u(self) -> float:
        """Total mass in u; missing or additional electrons of an ion (5.5e-4 u each) are neglected."""
        return float(self.masses_u.sum())

    @property
    def centre_of_mass_angstrom(self) -> Floats:
        """Centre of mass (3,) in Å, in the frame of the positions."""
        return np.asarray(self.masses_u @ self.positions_angstrom / self.mass_u, dtype=np.float64)

    def __repr__(self) -> str:
        names = ", ".join(dict.fromkeys(filter(None, (self.name, self.formula))))
        charge = f", charge {self.charge:+d}" if self.charge else ""
        return f"Molecule({names}, {len(self.symbols)} atom{'s' if len(self.symbols) != 1 else ''}{charge})"

    @property
    def formula(self) -> str:
        """Formula in Hill's order; isotopes that are not the most abundant are marked, as in `"C[13C]H6O"`."""
        return _hill(self.nuclei) + _charge_text(self.charge)

    def with_isotopes(self, changes: Mapping[int | str, str] | str) -> Molecule:
        """This geometry with other isotopes, in the same frame.

        Parameters
        ----------
        changes : mapping or str
            Isotope names by 1-based atom number, by atom (element and number, as in r(O1-C2)) or by element for all its atoms:
            `{1: "2H"}`, `{"C2": "13C"}`, `{"O": "18O"}`, or as text `"1=2H,O=18O"`. Single atoms have precedence.

        Returns
        -------
        Molecule
            The dipole of an ion is transformed to the new centre of mass, μ' = μ - q (R' - R); that of a neutral
            molecule and the geometry do not change (the change of the r₀ structure, about 0.001 Å, is neglected).

        Raises
        ------
        ValueError
            An atom or element that the molecule does not have, or an isotope of another element.

        Examples
        --------
        >>> Molecule(("C", "O"), [[0, 0, 0], [0, 0, 1.128]]).with_isotopes("O=18O").mass_numbers
        (12, 18)
        """
        table = _parse_changes(changes) if isinstance(changes, str) else dict(changes)
        numbers = list(self.mass_numbers)
        for key, name in sorted(table.items(), key=lambda item: str(item[0])[-1:].isdecimal()):
            for atom in self._atoms_named(key):
                numbers[atom] = _same_element(self.symbols[atom], name, atom).mass_number
        changed = replace(self, mass_numbers=tuple(numbers))
        changed = replace(changed, quadrupole_mhz=_scaled_couplings(self, changed.nuclei))
        if self.dipole_debye is None or not self.charge:
            return changed
        shift = changed.centre_of_mass_angstrom - self.centre_of_mass_angstrom
        return replace(changed, dipole_debye=self.dipole_debye - self.charge * DEBYE_PER_E_ANGSTROM * shift)

    def _atoms_named(self, key: int | str) -> list[int]:
        """Indices of the atoms with this number, element, or both."""
        element, digits = ("", str(key)) if isinstance(key, int) else _split_atom(key)
        if digits:
            number = int(digits)
            if not 1 <= number <= len(self.symbols):
                raise ValueError(f"atom {key} to substitute: {self.formula} has atoms 1 to {len(self.symbols)}")
            if element not in ("", self.symbols[number - 1]):
                raise ValueError(
                    f"atom {key} to substitute: atom {number} of {self.formula} is {self.symbols[number - 1]}"
                )
            return [number - 1]
        atoms = [i for i, symbol in enumerate(self.symbols) if symbol == key]
        if not atoms:
            raise ValueError(
                f"element {key!r} to substitute is not in {self.formula}; "
                f"name an element of it or an atom, by number or as {self.symbols[0]}1"
            )
        return atoms

    def moved(self, rotation: ArrayLike = _UNTURNED, shift_angstrom: ArrayLike = (0.0, 0.0, 0.0)) -> Molecule:
        """The molecule turned about the origin, then shifted: r' = R r + s; dipole R μ, polarizability R α Rᵀ, χ R χ Rᵀ.

        Raises ValueError for a matrix (3, 3) that is no proper rotation (a mirror image would be another molecule).

        >>> rod = Molecule(("H", "F"), [[0, 0, 0.917], [0, 0, 0]], dipole_debye=[0, 0, 1.8265])
        >>> rod.moved([[0, 0, 1], [1, 0, 0], [0, 1, 0]]).dipole_debye
        array([1.8265, 0.    , 0.    ])
        """
        r = _checked(rotation, (3, 3), "rotation")
        if not np.allclose(r @ r.T, np.eye(3), atol=1e-6) or np.linalg.det(r) < 0:
            raise ValueError(f"rotation {r.tolist()} is not a proper rotation: expected R Rᵀ = 1 and det R = 1")
        shift = _checked(shift_angstrom, (3,), "shift_angstrom")
        dipole, alpha = self.dipole_debye, self.polarizability_angstrom3
        return replace(
            self,
            positions_angstrom=self.positions_angstrom @ r.T + shift,
            dipole_debye=None if dipole is None else r @ dipole,
            polarizability_angstrom3=None if alpha is None else r @ alpha @ r.T,
            quadrupole_mhz={atom: r @ chi @ r.T for atom, chi in self.quadrupole_mhz.items()},
            field_gradients_au={atom: r @ q @ r.T for atom, q in self.field_gradients_au.items()},
        )


def _nuclei(symbols: Iterable[str], mass_numbers: Iterable[int]) -> tuple[Isotope, ...]:
    """Isotopes of the atoms; messages give the 1-based atom number."""
    names = (symbols,) if isinstance(symbols, str) else tuple(symbols)
    numbers: tuple[int | None, ...] = tuple(mass_numbers) or (None,) * len(names)
    if not names:
        raise ValueError("a molecule without atoms: give one atom or more")
    if len(numbers) != len(names):
        raise ValueError(f"{len(names)} symbols but {len(numbers)} mass numbers; give one each, or none")
    isotopes = []
    for i, (name, number) in enumerate(zip(names, numbers, strict=True), start=1):
        try:
            isotopes.append(isotope(name, number))
        except ValueError as reason:
            raise ValueError(f"atom {i}: {reason}") from None
    return tuple(isotopes)


def _checked(values: ArrayLike, shape: tuple[int, ...], what: str) -> Floats:
    """A read-only copy as finite floats of this shape."""
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        kind = f"numbers in an array of shape {shape}" if shape else "a number"
        raise ValueError(f"{what}: expected {kind}, not {values!r:.80}") from None
    if array.shape != shape:
        raise ValueError(f"{what} has shape {array.shape}; expected {shape}")
    if not np.isfinite(array).all():
        where = f", atom {np.argwhere(~np.isfinite(array))[0][0] + 1}" if what == "positions_angstrom" else ""
        raise ValueError(f"{what}{where}: a number that is not finite; every one must be")
    array.setflags(write=False)
    return array


def _checked_tensors(tensors: Mapping[int, Floats], atoms: int, key: str) -> dict[int, Floats]:
    """Symmetric traceless tensors by atom number, as read-only arrays."""
    checked = {}
    for atom, value in tensors.items():
        if not 1 <= atom <= atoms:
            raise ValueError(f"{key} of atom {atom}: the atoms are numbered from 1 to {atoms}")
        tensor = _checked(value, (3, 3), f"{key} of atom {atom}")
        least = 1e-6 * max(1.0, float(np.abs(tensor).max()))
        if abs(np.trace(tensor)) > least or np.abs(tensor - tensor.T).max() > least:
            raise ValueError(f"{key} of atom {atom}: {tensor.tolist()} expected a symmetric, traceless tensor")
        checked[atom] = tensor
    return checked


def couplings_mhz(gradients_au: Mapping[int, Floats], nuclei: Sequence[Isotope]) -> dict[int, Floats]:
    """χ = e Q q/h in MHz from field gradients q in Eh/(e a0²), for nuclei with a spin of at least 1 and a known Q.

    q is the second derivative of the potential, positive along the axis to a positive charge (W. Gordy and R. L. Cook, Microwave
    Molecular Spectra, 3rd ed., chapter IX).

    >>> from rotor.molecules.nuclei import isotope
    >>> couplings_mhz({1: np.diag([0.5, 0.5, -1.0])}, (isotope("14N"),))[1][2, 2].round(4)
    np.float64(-4.8027)
    """
    couplings = {}
    for atom, gradient in gradients_au.items():
        nucleus = nuclei[atom - 1]
        if nucleus.quadrupole_barn and nucleus.spin >= 1:
            couplings[atom] = QUADRUPOLE_MHZ_PER_BARN_AU * nucleus.quadrupole_barn * gradient
    return couplings


def _scaled_couplings(molecule: Molecule, nuclei: Sequence[Isotope]) -> dict[int, Floats]:
    """χ Q'/Q for other isotopes, or χ from the field gradient. Nuclei without a known Q have none."""
    couplings = couplings_mhz(molecule.field_gradients_au, nuclei)
    for atom, chi in molecule.quadrupole_mhz.items():
        old, new = molecule.nuclei[atom - 1], nuclei[atom - 1]
        if old == new:
            couplings[atom] = chi
        elif atom not in couplings and old.quadrupole_barn and new.quadrupole_barn and new.spin >= 1:
            couplings[atom] = chi * (new.quadrupole_barn / old.quadrupole_barn)
    return couplings


def _refuse_multiplicity(multiplicity: int | None, electrons: int) -> None:
    """Raise ValueError for a multiplicity 2S + 1 that is impossible with this number of electrons."""
    if multiplicity is None:
        return
    if isinstance(multiplicity, bool) or multiplicity != int(multiplicity) or multiplicity < 1:
        raise ValueError(f"multiplicity {multiplicity!r}: expected 2S + 1 of the electrons, a whole number from 1 on")
    if multiplicity % 2 == electrons % 2:
        kind = "odd" if electrons % 2 else "even"
        raise ValueError(
            f"multiplicity {multiplicity}: with an {kind} number of electrons ({electrons}) it is {'even' if electrons % 2 else 'odd'}"
        )


def _refuse_lopsided(tensor: Floats | None) -> None:
    if tensor is not None and not np.allclose(tensor, tensor.T, atol=1e-6 * max(1.0, float(np.abs(tensor).max()))):
        raise ValueError(f"polarizability_angstrom3 {tensor.tolist()} is not symmetric; a static one is")


def _refuse_coincident(positions: Floats, nuclei: tuple[Isotope, ...]) -> None:
    """Raise ValueError for the first two atoms closer than `CLOSEST_ANGSTROM`."""
    if len(positions) < 2:
        return
    apart, nearest = nearest_others(positions)
    first = int(np.argmin(apart))
    if apart[first] < CLOSEST_ANGSTROM:
        first, second = sorted((first, int(nearest[first])))
        raise ValueError(
            f"atoms {first + 1} ({nuclei[first].symbol}) and {second + 1} ({nuclei[second].symbol}) are "
            f"{apart[first]:.3g} Å apart, nearer than {CLOSEST_ANGSTROM} Å: one on top of the other; remove one, "
            "or check that the positions are in Å"
        )


def nearest_others(positions: Floats) -> tuple[Floats, Ints]:
    """Distance (n,) of each point from its nearest neighbour, and the index of this neighbour; n ≥ 2."""
    if len(positions) > FEW_ATOMS:  # n log n; imported only for many atoms
        from scipy.spatial import cKDTree

        distances, indices = cKDTree(positions).query(positions, k=2)
        is_itself = indices[:, 0] == np.arange(len(positions))  # coincident points may come in either order
        return distances[:, 1], np.where(is_itself, indices[:, 1], indices[:, 0])
    distances = np.linalg.norm(positions[:, None] - positions, axis=2)
    np.fill_diagonal(distances, np.inf)
    nearest = np.argmin(distances, axis=1)
    return distances[np.arange(len(positions)), nearest], nearest


def _parse_changes(text: str) -> dict[int | str, str]:
    """`"1=2H,O=18O"` as a mapping."""
    table: dict[int | str, str] = {}
    for item in text.split(","):
        match = re.fullmatch(r"\s*(\w+)\s*=\s*(\w+)\s*", item)
        if not match:
            raise ValueError(f"isotopes {text!r}: {item!r} is not of the kind of '1=2H' or 'O=18O'")
        table[int(match[1]) if match[1].isdecimal() else match[1]] = match[2]
    return table


def _split_atom(name: str) -> tuple[str, str]:
    """Element and number of an atom such as C2; the number is empty for an element alone."""
    match = re.fullmatch(r"([A-Z][a-z]?)([0-9]+)", name)
    return (match[1], match[2]) if match else (name, "")


def _same_element(symbol: str, name: str, atom: int) -> Isotope:
    nucleus = isotope(name)
    if nucleus.symbol != symbol:
        raise ValueError(f"atom {atom + 1} is {symbol}: {name!r} is an isotope of {nucleus.symbol}, not of {symbol}")
    return nucleus


def _hill(nuclei: tuple[Isotope, ...]) -> str:
    """Carbon first, then hydrogen, then the alphabet; without carbon the alphabet alone (Hill 1900)."""
    counts = Counter(
        (nucleus.symbol, 0 if nucleus == isotope(nucleus.symbol) else nucleus.mass_number) for nucleus in nuclei
    )
    first = ("C", "H") if any(symbol == "C" for symbol, _ in counts) else ()

    def place(key: tuple[str, int]) -> tuple[int, str, int]:
        symbol, mass_number = key
        return first.index(symbol) if symbol in first else len(first), symbol, mass_number

    def text(key: tuple[str, int]) -> str:
        symbol, mass_number = key
        label = f"[{mass_number}{symbol}]" if mass_number else symbol
        return f"{label}{counts[key] if counts[key] > 1 else ''}"

    return "".join(text(key) for key in sorted(counts, key=place))


def _charge_text(charge: int) -> str:
    if not charge:
        return ""
    sign = "+" if charge > 0 else "-"
    return sign if abs(charge) == 1 else f"({abs(charge)}{sign})"
