"""Random .par and .int files with series, PHASE, IXX and two equivalent spins, and what they say for the direct product."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from direct_codes import CodedTerm, Harmonic, Model
from full_matrix_moments import Moment
from random_spcat import Draw

from rotor.formats.spcat.text.int_file import IntensityFile, read_int
from rotor.formats.spcat.text.par import ParameterFile, read_par

Pair = tuple[int, int]
EVEN, ODD = {"a": 21, "b": 41, "c": 61}, {"a": 20, "b": 40, "c": 60}  # TYP by axis
COUPLINGS = (0, 1, 4, *EVEN.values(), *ODD.values())
WITH_ONE, WITH_TWO = (0, 1, 2, 3, 4), (1, 2, 3, 4)
HARMONICS = (1, 1, 2, 3, 4, 11, 13)


@dataclass(frozen=True)
class CodedFile:
    """A pair of files as text and read, and the same as a model."""

    text: str
    par: ParameterFile
    intensities: IntensityFile
    model: Model


def written(model: Model, phase: int = 0, iax: int = 1) -> CodedFile:
    """The files of a model."""
    parameters = {term.code: term.value for term in model.terms}
    parameters |= {910_000 + 11 * v: rho for v, rho in model.rho.items()}
    for step, constants in ((1000, model.a), (100, model.b)):
        parameters |= {(91 + 2 * n) * 10_000 + step + 10 * high + low: x for (n, low, high), x in constants.items()}
    spind = "".join(str(spin + 1) for spin in reversed(model.spins2)) or "1"
    xopt, options = phase + 20 * model.nofc + 40 * model.g12, ""
    for v in range(model.states):
        nvib = v or (-model.states if model.oblate else model.states)
        plus, minus = model.weights[v] if model.weights else (1, 1)
        more = -1 if v < model.states - 1 else 0
        options += f"a {spind} {nvib} 0 20 {model.ixx} {iax} {plus} {minus} {more} 0 0 {xopt}\n"
    lines = "".join(f"{code} {value!r} 1\n" for code, value in parameters.items())
    par = f"random\n{len(parameters)} 1 1 0 0 1e6 1 1\n{options}{lines}"
    request = "random\n0 41 1000 0 4 -30 -30 9999 300\n" + "".join(moment.line for moment in model.moments)
    return CodedFile(par + request, read_par(par.encode()), read_int(request.encode()), model)


class CodeDraw(Draw):
    """Random terms and moments of a file with some states and spins."""

    def __init__(self, seed: int, states: int, spins: int) -> None:
        super().__init__(1000 * seed + 10 * states + spins)
        self.states, self.oblate = states, self.random() < 0.4
        self.spins2 = tuple(self.choice((1, 2)) for _ in range(spins))
        self.within = [(v, v) for v in range(states)]
        self.between = [(w, v) for v in range(states) for w in range(v)]
        self.z = "c" if self.oblate else "a"

    def rigid(self) -> list[CodedTerm]:
        """Rotational constants and energies of all states."""
        constants = ((1, 9400.0), (2, 3100.0), (3, 2500.0))
        terms = [CodedTerm(x * self.uniform(0.97, 1.03), pair, typ) for pair in self.within for typ, x in constants]
        return terms + [CodedTerm(self.value(10.0, 2e4), pair) for pair in self.within[1:]]

    def spin_kinds(self, odd: bool, axes: Sequence[str] = "abc") -> list[tuple[int, tuple[int, ...]]]:
        """TYP with a spin, with one twice, and with two; odd: also what time reversal changes; axes: of TYP 21, 41, 61."""
        if not self.spins2:
            return []
        spin, along = self.randint(1, len(self.spins2)), [EVEN[axis] for axis in axes]
        kinds = [(self.choice((*WITH_ONE, *along, *(ODD.values() if odd else ()))), (spin,))]
        if self.spins2[spin - 1] > 1:
            kinds.append((self.choice((*WITH_TWO, *along)), (spin, spin)))
        if len(self.spins2) > 1:
            pair = tuple(sorted(self.sample(range(1, len(self.spins2) + 1), 2)))
            kinds.append((self.choice((0, *WITH_TWO, *along)), pair))
        return kinds

    def term(self, pair: Pair, typ: int, spins: tuple[int, ...] = (), ff: int = 0, ex: int = 0) -> CodedTerm:
        """A term with powers of Nz² and N², larger in a series."""
        most = 2 if ex else self.choice((0, 0, 1))
        powers = self.randint(0, most), self.randint(0, most)
        return CodedTerm(self.value(1.0, 200.0), pair, typ, *powers, spins, 0, ff, ex)

    def spin_terms(self, pairs: Sequence[Pair], axes: Sequence[str] = "abc") -> list[CodedTerm]:
        """Some terms with spins."""
        return [self.term(pair, *kind) for pair in pairs for kind in self.spin_kinds(pair[0] != pair[1], axes)]

    def dipoles(self) -> list[Moment]:
        """A dipole of each state, some of two, and some between states."""
        moments = [Moment(pair, 0, self.randint(1, 3), 1.0) for pair in self.within]
        return moments + [
            Moment(pair, 0, self.randint(1, 3), self.value(0.1, 0.4)) for pair in (*self.within, *self.between)
        ]

    def model(self, terms: Sequence[CodedTerm], moments: Sequence[Moment], **more) -> Model:
        """Each code once."""
        chosen = {term.code: term for term in reversed(terms)}
        lines = {moment.line.split()[0]: moment for moment in reversed(moments)}
        return Model(self.states, self.spins2, self.oblate, tuple(chosen.values()), tuple(lines.values()), **more)


def file_of_series(seed: int, states: int, spins: int) -> CodedFile:
    """Fourier and Euler series and energies of one K, in and between states, with moments of TYP 7 and 8."""
    r = CodeDraw(seed, states, spins)
    nofc = r.random() < 0.25
    rho = {v: round(r.uniform(0.05, 1.4), 4) * r.choice((1, 1, -1)) for v in range(states)}
    terms, a, b = r.rigid() + r.spin_terms(r.within), {}, {}
    for pair in [*r.choices(r.within, k=3), *r.choices(r.between or r.within, k=3)]:
        sine, harmonic = pair[0] != pair[1] and r.random() < 0.5, r.choice(HARMONICS if not nofc else (1, 2, 3))
        plain = (r.choice((0, 0, 1, 2, 3, 4, 5) if pair[0] == pair[1] else COUPLINGS),)
        kind = r.choice([plain, plain, *r.spin_kinds(pair[0] != pair[1])])
        terms.append(r.term(pair, *kind, ff=harmonic + 10 * sine + 10 * (harmonic > 10)))
        terms.append(CodedTerm(r.value(1.0, 200.0), pair, 80, r.randint(0, 3), r.randint(0, 1)))
    for pair in r.choices(r.within + r.between, k=3):
        plain = (r.choice((4, 5) if pair[0] == pair[1] else (4, *EVEN.values(), *ODD.values())),)
        spin_kinds = [kind for kind in r.spin_kinds(pair[0] != pair[1]) if kind[0] not in (1, 2, 3)]
        term = r.term(pair, *r.choice([plain, *spin_kinds]), ex=r.randint(1, 5))
        other = r.term(pair, 90 + 2 * r.randint(0, 2), ex=0)
        terms += [term, other]
        for n in (term.ex - 1, (other.typ - 90) // 2):
            a[(n, *pair)], b[(n, *pair)] = round(r.uniform(-0.01, 0.02), 5), round(r.uniform(-0.01, 0.02), 5)
    terms += [CodedTerm(r.value(1.0, 300.0), (v, v + 1), r.choice(COUPLINGS)) for v in range(states - 1)]
    moments = r.dipoles()
    for pair in r.choices(r.within + r.between, k=3):
        typ = 7 if pair[0] == pair[1] else r.choice((7, 8))
        moments.append(Harmonic(pair, typ, r.randint(1, 3), r.value(0.1, 0.9), harmonic=r.choice((1, 2, 3, 12))))
    g12 = not nofc and r.random() < 0.3
    return written(r.model(terms, moments, rho=rho, a=a, b=b, nofc=nofc, g12=g12))


def file_of_phase(seed: int, states: int, spins: int) -> CodedFile:
    """Odd operators within states along the axes of PHASE, even ones along the others, moments of every TYP."""
    r = CodeDraw(seed, states, spins)
    phase = r.choice((3, 5, 6, 8))
    odd = "".join(axis for bit, axis in enumerate("abc" if r.oblate else "cba") if phase >> bit & 1)
    rho = {v: round(r.uniform(0.05, 1.4), 4) for v in range(states)}
    terms = r.rigid() + r.spin_terms(r.within, [axis for axis in "abc" if axis not in odd]) + r.spin_terms(r.between)
    for pair in r.within:
        for axis in r.sample("abc", 2):
            terms.append(r.term(pair, (ODD if axis in odd else EVEN)[axis]))
            if axis in odd and spins:
                terms.append(CodedTerm(r.value(5.0, 100.0), pair, ODD[axis], spins=(r.randint(1, spins),)))
        terms.append(r.term(pair, 0, ff=r.choice((1, 2)) + 10 * (r.z in odd)))
    terms += [r.term(pair, r.choice(COUPLINGS), ff=r.choice((0, 0, 1, 11))) for pair in r.between * 3]
    moments = [*r.dipoles(), Moment(r.choice(r.within + r.between), r.choice((0, 1, 2, 3, 4, 9)), 0, r.value(10, 200))]
    for pair in (*r.within, *r.between):
        types = (3, 4, 6, 9, 10) if pair[0] == pair[1] else (1, 2, 3, 4, 5, 6, 9, 10, 11, 12)
        moments.append(Moment(pair, r.choice(types), r.randint(1, 3), r.value(0.05, 0.3)))
        harmonic = r.choice((7, 8) if pair[0] != pair[1] else (7,))
        moments.append(Harmonic(pair, harmonic, r.randint(1, 3), r.value(0.1, 0.9), harmonic=r.randint(1, 2)))
        if spins:
            typ, sym = (r.choice((1, 2)), r.randint(1, 3)) if pair[0] != pair[1] else (r.choice((0, 1, 2, 3, 4, 9)), 0)
            moments.append(Moment(pair, typ, sym, r.value(0.1, 0.9) if sym else r.value(10, 200), r.randint(1, spins)))
    return written(r.model(terms, moments, rho=rho, odd=odd), phase)


def file_of_ixx(seed: int, states: int, spins: int) -> CodedFile:
    """Spin terms within and between states, powers of N·S, and bits of IXX."""
    r = CodeDraw(seed, states, spins)
    terms = r.rigid() + r.spin_terms((r.within + r.between) * 2)
    terms.append(CodedTerm(r.value(5.0, 50.0), r.choice(r.within), ns=r.choice((1, 2, 5, 6))))
    terms += [r.term(pair, r.choice(COUPLINGS)) for pair in r.between * 2]
    return written(r.model(terms, r.dipoles(), ixx=r.randint(1, 2 ** (spins + 1) - 1)))


def file_of_equivalent(seed: int, states: int, spins: int) -> CodedFile:
    """Two equivalent spins with a total, after a third where there are three; weights of either sign in each state."""
    r = CodeDraw(seed, states, spins)
    r.spins2 = (*r.spins2[:-2], *(r.spins2[-1:] * 2))
    iax, weights = r.randint(1, 3), r.choice(((1, 0), (0, 1), (3, 1), (1, 1), (2, 5)))
    terms = r.rigid() + r.spin_terms((r.within + r.between) * 3)
    terms += [CodedTerm(r.value(1.0, 300.0), pair, r.choice(list(EVEN.values()))) for pair in r.within]
    terms += [r.term(pair, r.choice(COUPLINGS)) for pair in r.between * 3]
    of_states = tuple(r.choice((weights, weights[::-1])) for _ in range(states))
    ixx = r.choice((0, 0, 0, r.randint(0, 2**spins - 1)))
    moments = [Moment((0, 0), 0, iax, 1.0), *r.dipoles()]  # the first joins functions of one weight
    return written(r.model(terms, moments, exchange="abc"[iax - 1], weights=of_states, ixx=ixx), iax=-iax)
