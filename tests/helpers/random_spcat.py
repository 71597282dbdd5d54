"""Random .par and .int files: states, spins and moments, ranges of K, l-doubled pairs of a threefold axis."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass, replace

from full_matrix_codes import Case, case_of
from full_matrix_l_doubled import l_values
from full_matrix_moments import Moment

from rotor.formats.spcat.text.int_file import IntensityFile, read_int
from rotor.formats.spcat.text.par import ParameterFile, read_par

RIGID = ((10000, 9400.0), (20000, 3100.0), (30000, 2500.0))
DISTORTION = (200, 1100, 2000, 40100, 41000, 300, 50000)
# W, F and G of Fermi and Coriolis interactions with powers of N² and Nz², and with a spin
COUPLINGS = (0, 40000, 200000, 400000, 600000, 210000, 410000, 610000)
HIGHER_COUPLINGS = (100, 1000, 41000, 200100, 401000, 610100)
SPIN = (10010000, 10020000, 10030000, 10610000, 10000000, 10000100, 10001000, 1100, 41000, 2000)
SPIN_COUPLINGS = (10000000, 10010000, 10040000, 10610000, 10210000, 10200000, 10400000, 10600000, 1000000)
QUADRUPOLE = (110010000, 110040000, 110610000)
SECOND_SPIN = (20010000, 20020000, 20000000, 20610000, 120000000, 120010000, 120040000, 120610000)
SECOND_QUADRUPOLE = (220010000, 220040000, 220610000)
WITHIN, BETWEEN = (0, 3, 4, 6, 9, 10, 12), (0, 1, 2, 3, 4, 5, 6, 9, 10, 11, 12)  # TYP of moments
Lines = list[tuple[int, float]]


@dataclass(frozen=True)
class RandomFile:
    """A pair of files as text and read, with the moments that act."""

    text: str
    par: ParameterFile
    intensities: IntensityFile
    moments: tuple[Moment, ...]

    @classmethod
    def of(cls, seed: int, options: Sequence[str], lines: Lines, moments: Sequence[Moment]) -> RandomFile:
        """From its option lines, parameters and moments."""
        values = "".join(f"{code} {number!r} 1\n" for code, number in lines)
        par = f"random {seed}\n{len(lines)} 1 1 0 0 1e6 1 1\n" + "".join(f"{o}\n" for o in options) + values
        request = "random\n0 41 1000 0 4 -30 -30 9999 300\n" + "".join(m.line for m in moments)
        return cls(par + request, read_par(par.encode()), read_int(request.encode()), tuple(moments))

    @property
    def case(self) -> Case:
        """What full matrices read in it."""
        return case_of(self.par, read_int(b"random\n0 41 1000 0 4 -30 -30 9999 300\n1 1.0\n"))


class Draw(random.Random):
    """Random numbers, codes and pairs of states."""

    def value(self, least: float, most: float) -> float:
        """A value of either sign."""
        return self.choice([-1, 1]) * round(self.uniform(least, most), 1)

    def lines(
        self, codes: Sequence[int], least: int, most: int, states: Sequence[int], sizes: tuple[float, float]
    ) -> Lines:
        """From `least` to `most` of the codes, each with one of the states V2 V1."""
        count = min(self.randint(least, most), len(codes))
        return [(code + self.choice(states), self.value(*sizes)) for code in self.sample(codes, count)]

    def spind(self, spins: int) -> str:
        """Digits of spins 1/2, 1 and 3/2."""
        return "".join(self.choice("234") for _ in range(spins)) or "1"


def file_of_states(seed: int, states: int, spins: int, limits: bool = False) -> RandomFile:
    """States with constants of their own and interactions, up to two spins, moments of all TYP within and between states.

    limits: whether each state has its KNMIN and KNMAX.
    """
    r = Draw(seed)
    oblate, spind = r.random() < 0.4, r.spind(spins)
    own, pairs = [11 * v for v in range(states)], [(w, v) for v in range(states) for w in range(v)]
    where, between = own + [99] * (states > 1), [code for v, w in pairs for code in (10 * v + w, 10 * w + v)]
    lines = [(v, r.uniform(-3e4, 3e4)) for v in own[1:]]
    for v in own:
        lines += [(code + v, size * r.uniform(0.97, 1.03)) for code, size in RIGID]
        lines += [(code + v, r.uniform(-0.05, 0.05)) for code in r.sample(DISTORTION, r.randint(0, 2))]
    quadrupole = QUADRUPOLE if spind[-1] in "34" else ()
    second = SECOND_SPIN + (SECOND_QUADRUPOLE if spind[0] in "34" else ()) if spins == 2 else ()
    if spins:
        lines += r.lines(SPIN[:8] if states > 1 else SPIN, 1, 3, where, (5.0, 100.0))
    for codes in (quadrupole, second):
        lines += r.lines(codes, 1, 2, where, (5.0, 100.0))
    if pairs:
        lines += [(r.choice(COUPLINGS) + 10 * v + v + 1, r.value(1.0, 500.0)) for v in range(states - 1)]
        lines += r.lines(COUPLINGS, 0, 3, between, (1.0, 500.0)) + r.lines(HIGHER_COUPLINGS, 0, 2, between, (0.1, 5.0))
        for codes in (SPIN_COUPLINGS if spins else (), quadrupole, second):
            lines += r.lines(codes, 0, 2, between, (5.0, 100.0))
    options = []
    for v in range(states):
        k = (r.choice([0, 0, 1]), r.choice([1, 2, 3, 20])) if limits else (0, 20)
        nvib = v or (-states if oblate else states)
        options.append(f"a {spind} {nvib} {k[0]} {k[1]} 0 1 1 1 {-1 if v < states - 1 else 0} 0 0")
    return RandomFile.of(seed, options, lines, _moments(r, states, pairs, spins))


def _moments(r: Draw, states: int, pairs: Sequence[tuple[int, int]], spins: int) -> list[Moment]:
    def some(both: tuple[int, int], types: Sequence[int]) -> list[Moment]:
        each = range(r.randint(0, 2))
        return [Moment(both, r.choice(types), r.randint(1, 3), round(r.uniform(-0.3, 0.3), 3)) for _ in each]

    moments = []
    for v in range(states):
        moments += [Moment((v, v), 0, r.randint(1, 3), 1.0)] * (r.random() < 0.8) + some((v, v), WITHIN)
    for both in pairs:
        moments += some(both, BETWEEN)
    if spins and r.random() < 0.3:  # magnetic
        moments += [Moment(both, 0, 0, r.value(0.1, 2.0), r.randint(0, spins)) for both in ((0, 0), *pairs)]
    return moments or [Moment((0, 0), 0, 1, 1.0)]


def file_of_l(seed: int, pairs: int, spins: int) -> RandomFile:
    """A ground state and one or two l-doubled pairs of a threefold axis, with all that Δk - Δl = 0, ±3 allows among the codes."""
    r = Draw(seed)
    oblate, spind = r.random() < 0.5, r.spind(spins)
    z, along = (600000, 3) if oblate else (200000, 1)
    quadrupole = spind[-1] in "34"
    spin_along = [10000000, 10000000 + 10000 * along, 10000100] + [110000000 + 10000 * along] * quadrupole
    two = [40000, 40100, 41000]
    spin_xz = [10410000] * (spins > 0) + [110410000] * quadrupole + [120410000] * (spins == 2)
    spin_two = [10040000, 1040000] * (spins > 0) + [110040000] * quadrupole + [120040000] * (spins == 2)
    firsts = [1 + 2 * pair for pair in range(pairs)]
    lines = [(1099, r.uniform(-3000, 7000)), (199, r.uniform(3000, 9000))]
    lines += r.lines(spin_along if spins else (), 0, 2, (0, 99), (5.0, 100.0))
    for v in firsts:
        own, parallel, opposite = 11 * v, 10 * v + v + 1, 10 * (v + 1) + v  # V2 < V1, and V2 > V1
        lines += [(own, r.uniform(-4e4, 4e4)), (z + own, r.value(100.0, 5000.0))]
        lines += r.lines((100, 1000, z + 100), 0, 2, (own,), (1.0, 10.0))
        lines += r.lines(two, 0, 2, (parallel,), (1.0, 30.0)) + r.lines((410000, 50000), 0, 2, (opposite,), (0.1, 9.0))
        lines += r.lines(spin_along if spins else (), 0, 3, (own,), (5.0, 100.0))
        lines += r.lines(spin_two, 0, 2, (parallel,), (5.0, 50.0)) + r.lines(spin_xz, 0, 1, (opposite,), (5.0, 100.0))
        lines += r.lines((400000, 600000 if not oblate else 200000, 410000, *spin_xz), 0, 2, (v,), (1.0, 100.0))
        lines += r.lines((40000, *spin_two), 0, 2, (10 * v,), (1.0, 30.0))
    if pairs == 2:
        lines += r.lines((0, 100, 1000), 0, 2, (13, 31), (1.0, 10.0))
    codes = [1, *[101, 201] * pairs]
    signed = -len(codes) if oblate else len(codes)
    options = [
        f"s -{spind} {v or signed} 0 40 0 6 2 2 {-1 if v < len(codes) - 1 else 0} {code} 0"
        for v, code in enumerate(codes)
    ]
    moments = [Moment((v, v), 0, along, round(r.uniform(0.5, 2), 2)) for v in (0, *firsts)]
    moments += [Moment((v, v), r.choice((3, 4, 9, 10)), along, r.value(0.1, 0.3)) for v in (0, *firsts)]
    return with_both_of_pairs(RandomFile.of(seed, options, lines, moments))


def with_both_of_pairs(file: RandomFile) -> RandomFile:
    """The file with the moments of first states of pairs, which act on both states, listed for both."""
    doubled = l_values(file.case)
    seconds = [replace(m, states=(m.states[0] + 1,) * 2) for m in file.moments if m.states[0] in doubled]
    return replace(file, moments=(*file.moments, *seconds))


def with_value(file: RandomFile, place: int, number: float) -> RandomFile:
    """The file with another value of one parameter line."""
    parameters = list(file.par.parameters)
    parameters[place] = replace(parameters[place], value=number)
    return replace(file, par=replace(file.par, parameters=tuple(parameters)))
