"""Levels and line strengths of coded parameters and moments from the direct product at one M (`direct_at_m`).

Series (Fourier, Euler, energies of one K), PHASE, IXX and the exchange of two equivalent nuclei are written as the documentation of
SPFIT and SPCAT has them (H. M. Pickett, "Format of the .par file", notes 1, 3, 6, 7, 9 and 11, "XOPT", "Format of the .int file");
nothing of the package is used.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from itertools import product
from math import pi

import numpy as np
from direct_at_m import Product, coded_matrix, coupled_functions, product_at, space_cosines, states_up_to
from full_matrix import AXIS_KINDS, CROSS_KINDS, ladder_axes
from full_matrix_moments import DEBYE_PER_MAGNETON, Moment, rotor_elements
from full_matrix_rotor import wigner_3j

EVEN_ORDER = (1, 2, 5, 8)  # TYP of moments


@dataclass(frozen=True)
class CodedTerm:
    """A parameter by the fields of its code; pair: V1, V2 with V1 ≤ V2."""

    value: float
    pair: tuple[int, int]
    typ: int = 0
    ksq: int = 0
    nsq: int = 0
    spins: tuple[int, ...] = ()
    ns: int = 0
    ff: int = 0
    ex: int = 0

    @property
    def code(self) -> int:
        """IDPAR of a file with less than ten states."""
        spins = 10 * min(self.spins) + max(self.spins) if len(self.spins) == 2 else sum(self.spins)
        head = ((self.ex * 100 + self.ff) * 100 + spins) * 10 + self.ns
        return (((head * 100 + self.typ) * 10 + self.ksq) * 10 + self.nsq) * 100 + 10 * self.pair[1] + self.pair[0]


@dataclass(frozen=True)
class Harmonic(Moment):
    """A moment with a cosine (TYP 7) or i times a sine (TYP 8) of a harmonic."""

    harmonic: int = 1

    @property
    def line(self) -> str:
        """Its text in a file with less than ten states."""
        tens, units = divmod(self.harmonic, 10)
        low, high = self.states
        return (
            f"{100_000 * tens + 10_000 * self.typ + 1000 * units + 100 * high + 10 * low + self.sym} {self.value!r}\n"
        )


@dataclass(frozen=True)
class Model:
    """What a file says, for the direct product. spins2: doubled spins, common to all states.

    rho: by state. a, b: constants of the Euler series n by (n, low, high). odd: axes along which odd operators are real (PHASE). ixx: its
    bits. exchange: axis of the half turn that exchanges the last two spins, with I_tot. weights: WTPL, WTMN by state, of functions that
    this turn leaves as they are, or not, times (-1)^I_tot; operators join functions of one weight.
    """

    states: int
    spins2: tuple[int, ...]
    oblate: bool
    terms: tuple[CodedTerm, ...]
    moments: tuple[Moment, ...]
    rho: dict[int, float] = field(default_factory=dict)
    a: dict[tuple[int, int, int], float] = field(default_factory=dict)
    b: dict[tuple[int, int, int], float] = field(default_factory=dict)
    odd: str = ""
    nofc: bool = False
    g12: bool = False
    ixx: int = 0
    exchange: str = ""
    weights: tuple[tuple[int, int], ...] = ()

    @property
    def z(self) -> str:
        """The axis of K."""
        return "c" if self.oblate else "a"

    @property
    def between_i(self) -> bool:
        """Whether moments between states have one more i: unless most within states are real (of odd order, not along an odd axis).

        Those that join functions of unlike weights alone do not count.
        """
        within = [m for m in self.moments if m.sym and m.states[0] == m.states[1]]
        within = [m for m in within if self._joins_one_weight(m.states[0], "abc"[m.sym - 1])]
        imaginary = [("abc"[m.sym - 1] in self.odd) != (m.typ in EVEN_ORDER) for m in within]
        return imaginary.count(True) >= imaginary.count(False)

    def _joins_one_weight(self, state: int, axis: str) -> bool:
        return not self.exchange or axis == self.exchange or len(set(self.weights[state])) == 1


def harmonic_factor(model: Model, n: int, sine: bool, pair: tuple[int, int], k: np.ndarray) -> np.ndarray:
    """The factor of each element of a Fourier term, or that of one K with NOFC (notes 3 and 6)."""
    bra, ket = k[:, None], k
    if model.nofc:
        chosen = np.abs(bra + ket) == 2 * n - (bra - ket) % 2
        return np.where(chosen, np.sign(bra + ket) if sine else 1.0, 0.0)
    low, high = (model.rho.get(v, 0.0) for v in pair)
    order = n - 0.5 if low * high < 0 else n
    angle = pi / 3 * order * (abs(low) * bra + abs(high) * ket)
    factor = np.where(bra + ket == 0, 0.0, np.sin(angle)) if sine else np.cos(angle)
    return factor * (-1.0) ** np.minimum(np.abs(bra), np.abs(ket)) if model.g12 and n % 2 else factor


def harmonic_of(ff: int) -> tuple[int, bool]:
    """The harmonic of FF and whether it is a sine: 1 to 10 cosines, 11 to 20 sines of n = 1 to 10, 21 to 40 the same from n = 11 on."""
    block, place = divmod(ff - 1, 10)
    return place + 1 + 10 * (block // 2), block % 2 == 1


def euler_values(model: Model, term: CodedTerm, n: np.ndarray, k: np.ndarray) -> np.ndarray:
    """((N² - K²)/D)^NSQ (K²/D)^KSQ of each function, D = 1 + a K² + b (N² - K²), over D but for the scalar of the first series alone."""
    number = term.ex - 1 if term.ex else (term.typ - 90) // 2
    along, across = k**2, n * (n + 1.0) - k**2
    below = 1 + model.a.get((number, *term.pair), 0.0) * along + model.b.get((number, *term.pair), 0.0) * across
    values = (across / below) ** term.nsq * (along / below) ** term.ksq
    return values if not term.spins and (term.ex, term.typ) in ((1, 0), (0, 90)) else values / below


def times_z(axis: str, z: str) -> str:
    """The species of z times a species: "a", "b", "c" or none."""
    return z if not axis else "" if axis == z else next(other for other in "abc" if other not in (axis, z))


def term_matrix(model: Model, basis: Product, term: CodedTerm) -> tuple[np.ndarray, bool, str]:
    """A term without its value and its phase; whether it is odd under time reversal; its species."""
    n, k, typ = basis.n, basis.k, term.typ
    series = bool(term.ex) or typ >= 90
    plain = 0 if 80 <= typ <= 90 else 3 + (typ - 90) // 2 if typ > 90 else typ
    matrix = coded_matrix(basis, plain, term.spins)
    if 80 <= typ < 90:
        matrix = matrix * (np.abs(k) == 10 * (typ - 80) + term.ksq)
    elif not series:
        matrix = matrix * (k[:, None] ** (2.0 * term.ksq) + k ** (2.0 * term.ksq)) / 2
    if term.ns > 4:
        along = coded_matrix(basis, "abc".index(model.z) + 1, (1,))
        matrix = (matrix @ along + along @ matrix) / 2
    power = term.ns % 5
    if power or (term.nsq and not series):
        scalar = np.diag((n * (n + 1.0)) ** (0 if series else term.nsq))
        scalar = scalar @ np.linalg.matrix_power(basis.dot(1), power) if power else scalar
        matrix = (scalar @ matrix + matrix @ scalar) / 2
    if series:
        values = euler_values(model, term, n, k)
        matrix = matrix * (values[:, None] + values) / 2
    axis = AXIS_KINDS.get(typ, "") or "".join(set("abc") - set(CROSS_KINDS.get(typ, "abc")))
    if not term.ff:
        return matrix, typ in AXIS_KINDS, axis
    harmonic, sine = harmonic_of(term.ff)
    matrix = matrix * harmonic_factor(model, harmonic, sine, term.pair, k)
    return matrix, (typ in AXIS_KINDS) != sine, times_z(axis, model.z) if sine else axis


def hamiltonian(model: Model, basis: Product) -> np.ndarray:
    """H over |v⟩ times the functions of one M; i stands where time reversal with the half turn of PHASE changes an operator."""
    size = len(basis.n)
    total = np.zeros((model.states, size, model.states, size), complex)
    for term in model.terms:
        matrix, odd, axis = term_matrix(model, basis, term)
        phase = 1.0 if odd == bool(axis and axis in model.odd) else 1j
        _add(total, term.pair, term.value * phase * (-1.0 if odd and model.oblate else 1.0) * matrix)
    return total.reshape(model.states * size, -1)


def _add(total: np.ndarray, pair: tuple[int, int], matrix: np.ndarray) -> None:
    low, high = pair
    total[low, :, high] += matrix
    if low != high:
        total[high, :, low] += matrix.conj().T


def solve(model: Model, basis: Product, f2: int) -> tuple[np.ndarray, np.ndarray]:
    """Levels of one F at the M of the basis: vectors over |v⟩ times its functions, and energies."""
    columns, labels = coupled_functions(basis, f2, 2 if model.exchange else 0)
    unit = np.eye(model.states)
    change = np.kron(unit, columns)
    inner = change.conj().T @ hamiltonian(model, basis) @ change
    for bit in range(labels.shape[1]):
        if model.ixx >> bit & 1:
            inner = inner * np.kron(np.ones_like(unit), labels[:, None, bit] == labels[:, bit])
    if not model.exchange:
        energy, vectors = np.linalg.eigh(inner)
        return change @ vectors, energy
    signs, classes = np.linalg.eigh(columns.conj().T @ basis.exchange(model.exchange) @ columns)
    other = np.rint(signs).astype(int) != (-1) ** model.spins2[-1]
    weights = np.concatenate([np.where(other, minus, plus) for plus, minus in model.weights])
    parts = []
    for weight in sorted(set(weights.tolist()) - {0}):
        part = np.kron(unit, classes)[:, weights == weight]
        energy, vectors = np.linalg.eigh(part.conj().T @ inner @ part)
        parts.append((change @ part @ vectors, energy))
    return np.concatenate([v for v, _ in parts], axis=1), np.concatenate([e for _, e in parts])


# --- moments ----------------------------------------------------------------------------------------------------------


def moment_matrix(model: Model, basis: Product, moment: Moment) -> np.ndarray:
    """⟨M_Z⟩ over |v⟩ times the functions of one M."""
    size = len(basis.n)
    matrix = _plain_moment(model, basis, moment)
    axis = "abc"[moment.sym - 1] if moment.sym else ""
    if isinstance(moment, Harmonic):
        matrix = matrix * harmonic_factor(model, moment.harmonic, moment.typ == 8, moment.states, basis.k)
        matrix = matrix * (1.0 if moment.typ == 7 else -1j if model.oblate else 1j)
    axis = times_z(axis, model.z) if moment.typ in (8, 12) else axis
    has_i = moment.sym and moment.states[0] != moment.states[1] and bool(axis and axis in model.odd) != model.between_i
    total = np.zeros((model.states, size, model.states, size), complex)
    unit = 1.0 if moment.sym else DEBYE_PER_MAGNETON
    _add(total, moment.states, moment.value * unit * (1j if has_i else 1.0) * matrix)
    return total.reshape(model.states * size, -1)


def _plain_moment(model: Model, basis: Product, moment: Moment) -> np.ndarray:
    typ = 0 if isinstance(moment, Harmonic) else moment.typ
    if not moment.spin:
        return basis.both(_space_moment(basis.top, model.z, typ, moment.sym), basis.on_spins({}))
    if typ in (1, 2):
        return _spin_tensor(model, basis, moment)
    n2, k2 = basis.n * (basis.n + 1.0), basis.k**2.0
    mean = {0: np.ones(len(n2)), 3: n2, 4: k2, 9: n2**2}[typ]
    return basis.both(basis.unit, basis.vector(moment.spin, "z")) * (mean[:, None] + mean) / 2


def _spin_tensor(model: Model, basis: Product, moment: Moment) -> np.ndarray:
    """Σ c_ij φ_Zi S_j, S_j along the molecule: i(φ_y S_x + φ_x S_y), ..., of SYM 0 φ_z S_z - ½(φ_x S_x + φ_y S_y), φ_y S_y - φ_x S_x."""
    (x, y), z, i = ladder_axes(model.z), model.z, -1j if model.oblate else 1j
    if moment.sym:
        first, second = (axis for axis in "abc" if axis != "abc"[moment.sym - 1])
        parts = [(i, first, second), (i, second, first)]
    else:
        parts = [(1.0, z, z), (-0.5, x, x), (-0.5, y, y)] if moment.typ == 1 else [(1.0, y, y), (-1.0, x, x)]
    phi, total = space_cosines(basis.top + 1, model.z), 0.0
    inner = np.array([n <= basis.top for n, _, _ in states_up_to(basis.top + 1)])
    for f in "xyz":
        rotor = sum(c * phi["z", along] @ phi[f, about] for c, along, about in parts)[np.ix_(inner, inner)]
        total = total + basis.both(rotor, basis.vector(moment.spin, f))
    return total


@cache
def _space_moment(top: int, z: str, typ: int, sym: int) -> np.ndarray:
    """The space-fixed z component of a moment without spins on |N k m⟩."""
    states = states_up_to(top)
    index = {state: i for i, state in enumerate(states)}
    total = np.zeros((len(states),) * 2, complex)
    for bra, ket in product(range(top + 1), repeat=2):
        if abs(bra - ket) > 1:
            continue
        reduced = rotor_elements(Moment((0, 0), typ, sym, 1.0), bra, ket, z)
        for m in range(-min(bra, ket), min(bra, ket) + 1):
            symbol = (-1) ** (bra - m) * wigner_3j(2 * bra, 2, 2 * ket, -2 * m, 0, 2 * m)
            rows, columns = ([index[n, k, m] for k in range(-n, n + 1)] for n in (bra, ket))
            total[np.ix_(rows, columns)] = symbol * reduced
    return total


def strengths(model: Model, f2: int, g2: int, top: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Energies of F and of G ≤ F at M = G, and |⟨F‖M‖G⟩|², electric and magnetic moments added."""
    basis = product_at(model.spins2, model.z, top, g2)
    (up, up_energy), (low, low_energy) = solve(model, basis, f2), solve(model, basis, g2)
    symbol, total = wigner_3j(f2, 2, g2, -g2, 0, g2), np.zeros((len(up_energy), len(low_energy)))
    for electric in (True, False):
        chosen = [moment for moment in model.moments if bool(moment.sym) == electric]
        if chosen and symbol:
            matrix = sum(moment_matrix(model, basis, moment) for moment in chosen)
            total += np.abs(up.conj().T @ matrix @ low / symbol) ** 2
    return up_energy, low_energy, total
