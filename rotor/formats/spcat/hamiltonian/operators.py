"""Operators of SPFIT's parameter codes: the table of supported codes.

| field | meaning here |
|---|---|
| TYP 0; 1, 2, 3; 3 + n | 1; Na², Nb², Nc²; N₊^2n + N₋^2n |
| TYP 20, 40, 60 | Na, Nb, Nc, between states with the factor i, in an oblate basis -i |
| TYP 21, 41, 61 | NbNc + NcNb, NaNc + NcNa, NaNb + NbNa |
| TYP 20 + n, 40 + n, 60 + n, 11 + n | tensors of rank L made of N alone, see `spin_operators`; of odd L between states with the factor i |
| TYP 80 + n | the energy of K = 10 n + KSQ alone, with N^2NSQ |
| I1 | one N is replaced by that spin: Σ c_ij ½{φ_pi, N_j} S_p; TYP 20, 40, 60: φ_a·S, between states |
| I1 = I2 | two N are: (Ia² - I²/3)/(2I(2I-1)), ... |
| I1 ≠ I2 | I1·I2 with TYP 0, else the traceless tensor I1a I2a - I1·I2/3, ... |
| KSQ, NSQ, NS | half anticommutators with Nz^2KSQ, then N^2NSQ (N·S1)^NS; NS > 4: NS - 5, and N_z S_z in place of the 1 of TYP 0 |

Terms of Fourier and Euler series (FF, EX, TYP 90 to 99) are in `series`.

(H. M. Pickett, documentation of SPFIT and SPCAT, and J. Mol. Spectrosc. 148, 371 (1991); each kind compared with the program's
own levels.) Any other code is refused with its meaning.
"""

from __future__ import annotations

from dataclasses import replace

from rotor.formats.spcat.hamiltonian.code_table import SPIN_ALONG_Z, Digits, Kind, square_typ
from rotor.formats.spcat.hamiltonian.codes import NOT_YET
from rotor.formats.spcat.hamiltonian.spin_operators import tensor_operator, tensor_with_spins
from rotor.frozen import dataclass
from rotor.quantum.effects.spin_effect import matrix_of
from rotor.quantum.operators.algebra import Operator
from rotor.quantum.operators.rotation import sum_of_powers, with_powers
from rotor.quantum.spins.operators import Cosines, CosinesWithN, Matrix, Rotor, Scalar, Vector
from rotor.tops.operators import Operators

REFUSED = {
    "commutator": "a commutator of a spin term with N² (the program's is not ½i[N², S], which C_ab-ba names here)",
    "series": "a term of a series without the constants of its file",
    "szsz": "N_z S_z together with another operator",
}


@dataclass(frozen=True)
class CodedOperator:
    """The operator of a code, without its states.

    plain: powers (p, q, n) of a term without spins. of_n: operator of a term without spins and without such powers. rotor, spins: of a
    spin term, with places of the spins from 1. odd: whether time reversal changes its sign.
    """

    plain: Operators | None = None
    of_n: Operator | None = None
    rotor: Rotor | None = None
    spins: tuple[int, ...] = ()
    odd: bool = False
    n2: int = 0
    nz2: int = 0
    ns: int = 0

    @property
    def alone(self) -> Operator:
        """The operator of a term without spins."""
        return self.of_n or sum_of_powers(self.plain or {})


def code_operator(digits: Digits, axes: str) -> CodedOperator:
    """The operator of a code; axes: the axes x, y, z (bca or bac).

    Raises ValueError, with the meaning of the code, if it is not supported.
    """
    _refuse(digits)
    if digits.projects_spin:  # N_z S_z of the first spin: the product of both projections on z
        digits = digits._replace(i1=1, typ=square_typ(axes[2]), ns=digits.ns - SPIN_ALONG_Z)
    if digits.has_spin:
        return _with_spins(digits, axes)
    if digits.kind is Kind.TENSOR:
        tensor = with_powers(tensor_operator(digits.tensor, 0, axes), digits.nsq, digits.ksq)
        return CodedOperator(of_n=tensor, odd=digits.tensor.odd)
    return CodedOperator(plain=_plain(digits, axes))


def _refuse(d: Digits) -> None:
    """Raise ValueError for codes that are not supported."""
    reasons = {
        "commutator": d.i1 == 0 and d.i2 > 0,
        "series": bool(d.ff or d.ex) or d.kind in (Kind.EULER, Kind.LEVEL),
        "szsz": d.projects_spin and (d.kind is not Kind.SCALAR or bool(d.spins)),
    }
    for reason, applies in reasons.items():
        if applies:
            raise ValueError(f"{REFUSED[reason]} is read but not computed yet")


def _plain(d: Digits, axes: str) -> Operators:
    """Scalars, ladders and squares by powers (p, q, n): Nx² = ½(N² - Nz²) + ¼(N₊² + N₋²), Ny² with -¼."""
    p, q = d.nsq, d.ksq
    if d.kind is not Kind.SQUARE:
        return {(p, q, d.ladder): 1.0}
    place = axes.index(d.square_axis)
    if place == 2:
        return {(p, q + 1, 0): 1.0}
    # Nx² and Ny² = ½(N² - Nz²) ± ¼(N₊² + N₋²)
    return {(p + 1, q, 0): 0.5, (p, q + 1, 0): -0.5, (p, q, 1): 0.25 if place == 0 else -0.25}


def _with_spins(d: Digits, axes: str) -> CodedOperator:
    """The operator of a code with spins."""
    spins, kind, along = d.spins, d.kind, d.tensor
    powered = CodedOperator(spins=spins, n2=d.nsq, nz2=d.ksq, ns=d.ns)
    twice = len(spins) == 2 and spins[0] == spins[1]
    vector = kind is Kind.TENSOR and along.rank == 1
    if not spins and kind is not Kind.TENSOR:
        plain = _plain(d._replace(nsq=0, ksq=0), axes)
        return replace(powered, rotor=Scalar(tuple(plain.items())))
    if twice and (kind is Kind.SCALAR or vector):
        times_n = " times N" if vector else ""
        raise ValueError(f"the square of one spin, a constant,{times_n} {NOT_YET}")
    if len(spins) == 2 and kind is Kind.SCALAR:
        return replace(powered, rotor=Scalar())
    if vector and len(spins) == 1:
        sign = 1.0 if axes[2] == "a" else -1.0  # as of Na, Nb, Nc between states
        components: Vector = tuple(sign * float(axis == along.axis) for axis in "abc")  # type: ignore[assignment]
        return replace(powered, rotor=Cosines(components), odd=True)
    if spins and along.rank <= 2 and not vector:
        matrix = _matrix(d, axes)
        return replace(powered, rotor=CosinesWithN(matrix) if len(spins) == 1 else Cosines(matrix))
    tensor = tensor_with_spins(along, 0 if vector else len(spins), axes)  # of rank 0: I1·I2 times N
    return replace(powered, rotor=tensor, odd=tensor.odd)


def _matrix(d: Digits, axes: str) -> Matrix:
    """c_ij of scalars, squares, N₊² + N₋² and the products of two axes."""
    if d.kind is Kind.SCALAR:
        return matrix_of("iso")
    if d.kind is Kind.SQUARE:
        return matrix_of(d.square_axis * 2)
    if d.kind is Kind.LADDER:  # N₊² + N₋² = 2 (Nx² - Ny²)
        plain = matrix_of(f"{axes[0] * 2}-{axes[1] * 2}")
        return tuple(tuple(2 * value for value in row) for row in plain)  # type: ignore[return-value]
    return matrix_of("abc".replace(d.tensor.axis, ""))
