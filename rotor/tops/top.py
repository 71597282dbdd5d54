"""A top: inertia, principal axes, rotational constants, kind, dipole, polarizability, spin weights. The central object of the package.

A molecule becomes a top here; the quantum and the classical half work with tops only. Constants without a geometry enter through
`Top.from_constants`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rotor import units
from rotor.arrays import same
from rotor.frozen import dataclass
from rotor.geometry.inertia import EQUAL_MOMENTS, LINEAR_BELOW, Body, PrincipalFrame, point_masses, principal_frame
from rotor.tops.allowed import (
    allowed_dipole,
    allowed_polarizability,
    invariant_vector,
    refuse_forbidden_dipole,
    refuse_forbidden_polarizability,
)
from rotor.tops.components import Tensor, dipole_line, dipole_vector, in_frame, symmetric_tensor, tensor_in_frame
from rotor.tops.constants.constants import Constants, constants_from_moments
from rotor.tops.constants.covariance import Covariance
from rotor.tops.constants.named_values import constants_from_names, parse_fields
from rotor.tops.internal_rotation import InternalRotationConstants
from rotor.tops.kind import KindOfTop, kind_from_moments, kind_with_symmetry
from rotor.tops.magnetic import MagneticTensors
from rotor.tops.quadrupole import computed_couplings
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.states.level_table import LevelTable
from rotor.tops.states.state_constants import StateConstants
from rotor.tops.states.state_rules import (
    refuse_forbidden_couplings,
    refuse_forbidden_state_dipoles,
    refuse_incomplete_states,
)

if TYPE_CHECKING:
    from rotor.molecules.molecule import Molecule
    from rotor.molecules.symmetry.point_group import Symmetry

NOISE_ANGSTROM = 0.01  # smaller displacements may be noise of a geometry: a note names the symmetry that they break
SYMMETRIC_WITHIN = 1e-3  # tolerance of symmetry, relative to the shortest distance between nuclei
NO_WEIGHTS = SpinWeights()


@dataclass(frozen=True, eq=False, repr=False)
class Top:
    """A rigid or semi-rigid rotor.

    constants: rotational constants in MHz. dipole_abc_debye: (μa, μb, μc), None if unknown.
    polarizability_abc_angstrom3: symmetric tensor (3, 3) along a, b, c in Å³, or None. spin_weights: of nuclear spins.
    mass_u: for Doppler widths. frame: principal frame of a geometry, None without one. kind_of_top: how the kind was decided.
    molecule, symmetry: of a geometry. source: of the constants.
    independent_errors: whether uncertainties of the constants count as uncorrelated; False for a fit with unknown correlations.
    covariance: of the constants, if known. notes: limits of the data. spin_constants: of nuclear and electron spins, if known.
    states: further vibrational or tunnelling states; the spin weights are then those of all states together, and each state may have
    its own. level_table: energies that replace those of the constants. Covariance, states and level table belong to these constants
    (`with_constants` drops them). symmetry_checked: False accepts a dipole that spin weights forbid, as SPCAT does.
    magnetic: tensors on which a magnetic field acts. internal_rotation: of a methyl group; constants, dipole and other tensors then
    refer to its frame. scaling_error: estimated relative error of constants scaled from another isotopologue.

    Raises ValueError for a dipole or polarizability that the symmetry of the nuclei, or of the spin weights, forbids.
    """

    constants: Constants
    dipole_abc_debye: tuple[float, float, float] | None = None
    spin_weights: SpinWeights = NO_WEIGHTS
    name: str = ""
    mass_u: float | None = None
    frame: PrincipalFrame | None = None
    kind_of_top: KindOfTop | None = None
    molecule: Molecule | None = None
    symmetry: Symmetry | None = None
    source: str = ""
    dipole_source: str = ""
    weights_source: str = ""
    independent_errors: bool = True
    notes: tuple[str, ...] = ()
    polarizability_abc_angstrom3: Tensor | None = None
    polarizability_source: str = ""
    covariance: Covariance | None = None
    spin_constants: SpinConstants | None = None
    states: StateConstants | None = None
    internal_rotation: InternalRotationConstants | None = None

    level_table: LevelTable | None = None
    symmetry_checked: bool = True
    magnetic: MagneticTensors | None = None
    scaling_error: float | None = None

    def __post_init__(self) -> None:
        if not self.symmetry_checked:
            return
        if self.dipole_abc_debye is not None:
            refuse_forbidden_dipole(self.dipole_abc_debye, self.symmetry, self.frame, self.spin_weights)
        if self.polarizability_abc_angstrom3 is not None:
            tensor = self.polarizability_abc_angstrom3
            refuse_forbidden_polarizability(tensor, self.symmetry, self.frame, self.spin_weights)
        if self.states is not None:
            self._check_states(self.states)

    def _check_states(self, states: StateConstants) -> None:
        refuse_incomplete_states(states, self.kind, self.constants)
        if self.symmetry is not None and self.frame is not None and self.kind == "asymmetric":
            refuse_forbidden_couplings(states, self.symmetry, self.frame)
        refuse_forbidden_state_dipoles(states, self.kind, self.spin_weights, self.dipole_abc_debye)

    def __eq__(self, other: object) -> bool:
        return same(self, other) if isinstance(other, Top) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.constants)

    def __repr__(self) -> str:
        names = dict.fromkeys(filter(None, (self.name, self.molecule.formula if self.molecule else "")))
        dipole = dipole_line(self.dipole_abc_debye, self.has_estimated_dipole)
        return f"Top({', '.join([*names, self.constants.line(self.estimated_errors_mhz)])}; dipole {dipole})"

    def _repr_html_(self) -> str:
        """The constants with their errors, for notebooks."""
        import html

        return f"<p>{html.escape(repr(self))}</p>{self.constants.html_table(self.estimated_errors_mhz)}"

    @property
    def source_geometry(self) -> Molecule | None:
        """The geometry from which A, B, C follow; None if they are given or scaled."""
        return self.molecule if self.molecule is not None and self.source == self.molecule.source else None

    @property
    def estimated_error(self) -> float:
        """Relative error of A, B, C that follow from a geometry or another isotopologue; 0 if none is estimated."""
        return (self.source_geometry.uncertainty if self.source_geometry else self.scaling_error) or 0.0

    @property
    def estimated_errors_mhz(self) -> dict[str, float]:
        """Estimated errors of A, B, C by name if not measured: from a geometry, or from scaling of another isotopologue."""
        names, relative = self.constants.values.keys() - self.constants.uncertainties, self.estimated_error
        return {name: relative * self.constants[name] for name in "ABC" if name in names} if relative else {}

    @property
    def has_estimated_dipole(self) -> bool:
        """Whether the dipole is estimated, with an error of 0.2 D."""
        return self.dipole_source.startswith("estimate")

    @property
    def provenance(self) -> dict[str, Any]:
        """Content and sources of the top: constants, dipole, weights, notes."""
        return {
            "name": self.name,
            "kind": self.kind,
            "constants": self.constants.text(),
            "reduction": self.constants.reduction,
            "representation": self.constants.representation,
            "constants_source": self.source,
            "dipole_abc_debye": self.dipole_abc_debye,
            "dipole_source": self.dipole_source,
            "spin_weights": self.spin_weights.to_mapping(),
            "spin_weights_source": self.weights_source,
            "notes": list(self.notes),
        }

    @classmethod
    def from_constants(
        cls,
        constants: Constants | Mapping[str, float | str] | str,
        *,
        dipole_abc_debye: ArrayLike | None = None,
        spin_weights: SpinWeights | dict[str, int] | None = None,
        spins: str | None = None,
        **others: Any,
    ) -> Top:
        """A top from named constants, or from their text such as "A=835840.288 B=435351.717 C=278138.7 MHz".

        Parameters
        ----------
        constants : Constants, mapping or str
            A mapping has numbers in MHz or texts with a unit: `{"A": "9.2 GHz", "B": 3000, "C": 2500}`, also for constants of
            spins and further states: `{..., "chi_aa(14N)": -4.2, "E[1]": "5 GHz", ..., "G_c[0,1]": 450}`.
        dipole_abc_debye : (3,) array, optional
            Along the principal axes.
        spin_weights : SpinWeights or dict of str to int, optional
            Nuclear-spin weights; by default 1 for all levels.
        spins : str, optional
            Sizes of spins not named after isotopes, "S=1/2", and spins that are coupled first, "35Cl_1+35Cl_2".
        others : object
            Further fields of `Top`; `spin_constants` and `states` may be texts or mappings.

        Returns
        -------
        Top
            Without a geometry.

        Raises
        ------
        ValueError
            For unknown names or units, and for impossible constants.
        """
        if isinstance(constants, str):
            constants = Constants.parse(constants)
        if not isinstance(constants, Constants):
            constants, coupled = constants_from_names(constants, spins)
            if twice := ", ".join(coupled.keys() & others.keys()):
                raise ValueError(f"{twice}: given among the constants and again; give each once")
            others |= coupled
        if not isinstance(spin_weights, SpinWeights):
            spin_weights = SpinWeights.from_mapping(spin_weights) if spin_weights else SpinWeights()
        return cls(constants, dipole_vector(dipole_abc_debye), spin_weights, **parse_fields(others, spins))

    @classmethod
    def from_molecule(
        cls,
        molecule: Molecule,
        *,
        linear_below: float = LINEAR_BELOW,
        equal_within: float = EQUAL_MOMENTS,
        symmetry_within: float = SYMMETRIC_WITHIN,
    ) -> Top:
        """A rigid top from a geometry: principal axes, A, B, C, kind, spin weights, and tensors along the principal axes.

        The symmetry of the nuclei decides the kind where it can (C3v is a symmetric top), else the moments.
        Nuclear-spin weights follow from the symmetry and from `molecule.electronic`, without resolved inversion. Components of
        dipole and polarizability that symmetry forbids are removed if they are noise (`rotor.tops.allowed`).

        Parameters
        ----------
        molecule : Molecule
            At least two atoms.
        linear_below : float, optional
            Ratio of the smallest to the largest moment below which the top is linear.
        equal_within : float, optional
            Relative difference below which two moments are equal.
        symmetry_within : float, optional
            Tolerance of the symmetry, relative to the shortest distance.

        Returns
        -------
        Top
            Constants in MHz, dipole in debye, polarizability in Å³.

        Raises
        ------
        ValueError
            For a single atom, and for a dipole or polarizability that symmetry forbids.

        Notes
        -----
        Neglected: effects of vibration and centrifugal distortion, about 0.3 to 1 % between an equilibrium
        geometry and measured constants.

        Examples
        --------
        >>> from rotor.molecules.molecule import Molecule
        >>> top = Top.from_molecule(Molecule(("C", "O"), [[0, 0, 0], [0, 0, 1.128323]]))
        >>> top.kind, round(top.constants["B"], 0)
        ('linear', 57898.0)
        """
        if len(molecule.symbols) < 2:
            raise ValueError(
                f"{molecule.name or 'the input'} is a single atom: it has no rotation; give 2 atoms or more"
            )
        from rotor.molecules.symmetry.point_group import molecule_symmetry
        from rotor.tops.spins.spin_statistics import spin_weights

        body = point_masses(molecule.masses_u, molecule.positions_angstrom)
        frame = principal_frame(body, molecule.masses_u, molecule.positions_angstrom, equal_within)
        kind = kind_from_moments(frame.moments, linear_below=linear_below, equal_within=equal_within)
        symmetry = molecule_symmetry(molecule, symmetry_within)
        kind = kind_with_symmetry(kind, symmetry)
        dipole, tensor = molecule.dipole_debye, molecule.polarizability_angstrom3
        weights = spin_weights(symmetry, [nucleus.spin for nucleus in molecule.nuclei], molecule.electronic)
        return cls(
            constants=constants_from_moments(frame.moments, kind.kind),
            dipole_abc_debye=None if dipole is None else in_frame(frame, allowed_dipole(dipole, symmetry)),
            spin_weights=weights,
            name=molecule.name,
            mass_u=float(np.sum(molecule.masses_u)),
            frame=frame,
            kind_of_top=kind,
            molecule=molecule,
            symmetry=symmetry,
            source=molecule.source,
            dipole_source=molecule.dipole_source,
            weights_source=f"from the permutations of nuclei in {symmetry.point_group}{_electrons(molecule, weights)}",
            notes=(*molecule.notes, *_near_notes(symmetry)),
            polarizability_abc_angstrom3=None
            if tensor is None
            else tensor_in_frame(frame, allowed_polarizability(tensor, symmetry)),
            polarizability_source="" if tensor is None else molecule.polarizability_source,
            spin_constants=computed_couplings(molecule, frame),
        )

    @classmethod
    def from_body(cls, body: Body, **others: Any) -> Top:
        """A top from a body of point masses, plates or solids, in u and Å."""
        frame = principal_frame(body)
        kind = kind_from_moments(frame.moments)
        constants = constants_from_moments(frame.moments, kind.kind)
        return cls(constants, frame=frame, kind_of_top=kind, mass_u=body.mass, **others)

    @property
    def kind(self) -> str:
        """linear, spherical, prolate, oblate or asymmetric."""
        return self.constants.kind

    @property
    def state_count(self) -> int:
        """Number of vibrational or tunnelling states, 1 if none are given."""
        return 1 if self.states is None else self.states.count

    @property
    def rotational_constants_mhz(self) -> tuple[float, float, float]:
        """A, B, C in MHz for any kind of top; A of a linear top is infinite."""
        return self.constants.rigid

    @property
    def moments_u_angstrom2(self) -> tuple[float, float, float]:
        """I_a, I_b, I_c in u Å², from the constants: 505379.008/A; I_a of a linear top is 0."""
        a, b, c = (units.ROTATIONAL_MHZ_U_ANGSTROM2 / x for x in self.rotational_constants_mhz)
        return a, b, c

    @property
    def kappa(self) -> float | None:
        """Ray's asymmetry parameter (2B - A - C)/(A - C) from -1 (prolate) to +1 (oblate); None if A = C or linear."""
        a, b, c = self.rotational_constants_mhz
        return (2 * b - a - c) / (a - c) if math.isfinite(a) and a > c else None

    @property
    def planar_moments_u_angstrom2(self) -> tuple[float, float, float]:
        """P_aa, P_bb, P_cc = Σ m a², Σ m b², Σ m c² in u Å²."""
        a, b, c = self.moments_u_angstrom2
        return (b + c - a) / 2, (a + c - b) / 2, (a + b - c) / 2

    @property
    def inertial_defect_u_angstrom2(self) -> float:
        """I_c - I_a - I_b in u Å²: 0 for a rigid planar molecule, slightly positive for a real one."""
        a, b, c = self.moments_u_angstrom2
        return c - a - b

    def with_symmetry_within(self, displacement_angstrom: float) -> Top:
        """The top with the symmetry that its nuclei miss by at most this displacement; kind, spin weights and axes follow.

        The images of a displaced nucleus are twice as far apart. Raises ValueError for a top without geometry
        or with measured constants, and for a displacement above a tenth of the shortest distance between nuclei.
        """
        if self.molecule is None or self.kind_of_top is None or self.source != self.molecule.source:
            raise ValueError(
                f"{self.name or 'this top'} has constants that do not follow from its geometry; the tolerance is only for geometries"
            )
        from rotor.molecules.symmetry.operations import shortest_distance

        shortest = shortest_distance(self.molecule.positions_angstrom)
        if not 0 < displacement_angstrom <= 0.1 * shortest:
            raise ValueError(
                f"{displacement_angstrom:g} Å: expected a displacement above 0 and up to {0.1 * shortest:.3g} Å, a tenth of "
                "the shortest distance between nuclei"
            )
        return Top.from_molecule(self.molecule, symmetry_within=2.1 * displacement_angstrom / shortest)

    def with_constants(self, constants: Constants, source: str = "") -> Top:
        """The top with other constants, without covariance, level energies, further states and internal rotation."""
        return replace(
            self, constants=constants, source=source or self.source, covariance=None, level_table=None, states=None,
            internal_rotation=None,
        )  # fmt: skip

    def with_dipole(self, dipole_abc_debye: ArrayLike, source: str) -> Top:
        """The top with another dipole along the principal axes (D); states that share the top's dipole change with it."""
        dipole = dipole_vector(dipole_abc_debye)
        states = self.states.with_dipole(self.dipole_abc_debye, dipole) if self.states and dipole else self.states
        return replace(self, dipole_abc_debye=dipole, dipole_source=source, states=states)

    def with_polarizability(self, polarizability_abc_angstrom3: ArrayLike, source: str) -> Top:
        """The top with another polarizability (3, 3) along the principal axes, in Å³."""
        tensor = symmetric_tensor(polarizability_abc_angstrom3)
        return replace(self, polarizability_abc_angstrom3=tensor, polarizability_source=source)

    def with_estimated_dipole(self, dipole_debye: ArrayLike, source: str) -> Top:
        """The top with a dipole (D) in the frame of its geometry, without components that symmetry forbids."""
        if self.frame is None or self.symmetry is None:
            raise ValueError(f"{self.name or 'this top'} has no geometry, so a dipole has no frame")
        allowed = invariant_vector(np.asarray(dipole_debye, dtype=float), self.symmetry)
        return replace(self, dipole_abc_debye=in_frame(self.frame, allowed), dipole_source=source)

    def with_weights(self, weights: dict[str, int], source: str) -> Top:
        """The top with other spin weights, for all its states."""
        states = replace(self.states, weights={}) if self.states else None
        return replace(self, spin_weights=SpinWeights.from_mapping(weights), weights_source=source, states=states)


def _near_notes(symmetry: Symmetry) -> list[str]:
    """Notes if nuclei miss a higher symmetry by so little that noise may be the reason."""
    near = symmetry.near
    if near is None or near.displacement_angstrom > NOISE_ANGSTROM:
        return []
    return [
        f"taken as {symmetry.point_group} though near {near.point_group}: nuclei are up to {near.displacement_angstrom:.2g} Å "
        "off it; spin weights and kind would be others (symmetry tolerance)"
    ]


def _electrons(molecule: Molecule, weights: SpinWeights) -> str:
    """Assumption of the spin weights about the electrons, as words after the point group; empty if all weights are equal."""
    if weights.rule == "none":
        return ""
    if molecule.electronic == "odd":
        return ", electrons in a state that half turns change in sign"
    # a neutral atom has as many electrons as its nucleus has protons
    electrons = sum(nucleus.element_number for nucleus in molecule.nuclei) - molecule.charge
    odd = "; their number is odd, so that the state may differ" if electrons % 2 else ""
    return f", electrons assumed to form a closed shell{odd}"


def require_single_state(top: Top, what: str) -> Top:
    """The top if it has one vibrational state; ValueError, naming the calculation, if it has more.

    >>> from rotor.tops.top import Top
    >>> require_single_state(Top.from_constants("B=5 MHz"), "levels in a field").kind
    'linear'
    """
    without_internal_rotation(top, what)
    if top.states is not None:
        names = ", ".join(top.states.name_of(v) for v in range(top.states.count))
        raise ValueError(
            f"{what} of {top.name or 'this top'}: computed for a single state, but this top has {top.states.count} ({names}); "
            "give the constants of one state"
        )
    return top


def without_internal_rotation(top: Top, what: str) -> Top:
    """The top if it has no internal rotation; ValueError, naming the calculation, if it has."""
    if top.internal_rotation is not None:
        raise ValueError(
            f"{what} of {top.name or 'this top'}: not computed with internal rotation; leave out its constants to compute a rigid top"
        )
    return top
