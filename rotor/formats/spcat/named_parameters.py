"""The .par or .var file of a top of named constants, with its spins and states: the way back from `named_top`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from rotor.arrays import Floats
from rotor.formats.spcat.codes import AXES, Digits, join_code, parameters_of, split_code
from rotor.formats.spcat.model import options_of
from rotor.formats.spcat.text.par import Header, Options, Parameter, ParameterFile
from rotor.quantum.effects.of_top import spin_effects
from rotor.quantum.effects.spin_effect import SpinEffect, parse_name
from rotor.quantum.spins.operators import EVERY_STATE, Cosines, CosinesWithN
from rotor.quantum.spins.terms import SpinTerm
from rotor.tops.constants import Constants
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.top import Top

_FIXED = 1e-37
_CROSS = {61: (0, 1), 41: (0, 2), 21: (1, 2)}
_BETWEEN = {"G_a": 20, "G_b": 40, "G_c": 60, "F_bc": 21, "F_ac": 41, "F_ab": 61}
_BETWEEN |= {"W": 0, "W_pm2": 4, "W_pm4": 5, "W_pm6": 6}


@dataclass(frozen=True)
class _Place:
    """Where a term of a code acts: spins by place, powers of N², Nz² and N·S, states or None for every one."""

    spins: tuple[int, ...] = ()
    n2: int = 0
    nz2: int = 0
    ns: int = 0
    states: tuple[int, int] | None = None

    def code(self, typ: int, count: int) -> int:
        """The whole code in a file with so many states."""
        every = 0 if count == 1 else 10 ** (1 if count <= 9 else 2 if count <= 99 else 3) - 1
        low, high = self.states or (every, every)
        i1, i2 = (max(self.spins, default=0), min(self.spins) if len(self.spins) > 1 else 0)
        return join_code(Digits(0, 0, i2, i1, self.ns, typ, self.nz2, self.n2, low, high), count)


def named_parameter_file(top: Top, kmax: int) -> ParameterFile:
    """The file of a top, for levels with K up to `kmax`; spins in the order in which they are coupled.

    Raises ValueError, naming the constant or the weights, for what an SPFIT file cannot say.
    """
    count = 1 if top.states is None else top.states.count
    own = [top.constants, *(_of_state(top, v) for v in range(1, count))]
    parameters = [one for v, constants in enumerate(own) for one in _rotation(top, constants, v, count)]
    parameters += _couplings(top, count)
    parameters += _spin_parameters(top, count)
    header = Header(npar=len(parameters), nline=1, nitr=1, errtst=1e6)
    return ParameterFile(top.name, header, _option_lines(top, own, kmax), tuple(parameters))


def _of_state(top: Top, v: int) -> Constants:
    """The constants of another state, in the vocabulary of the top."""
    assert top.states is not None
    values = {name: value for name, value in top.states.of_state(v).items() if name != "E"}
    same = {"kind": top.constants.kind, "reduction": top.constants.reduction}
    return Constants(**same, representation=top.constants.representation, **values)  # type: ignore[arg-type]


def _rotation(top: Top, constants: Constants, v: int, count: int) -> list[Parameter]:
    found = []
    if v and top.states is not None:
        energy = top.states.of_state(v).get("E", 0.0)
        found.append(Parameter(_Place(states=(v, v)).code(0, count), energy, _FIXED, f"E[{v}]"))
    for one in parameters_of(constants):
        digits = split_code(one.code)._replace(v1=v, v2=v)
        label = one.label if not v else f"{one.label}[{v}]"
        found.append(replace(one, code=join_code(digits, count), label=label))
    return found


def _couplings(top: Top, count: int) -> list[Parameter]:
    """Signs as in `named_top`: G has the factor -1 in an oblate basis."""
    if top.states is None:
        return []
    sign, found = -1.0 if _oblate(top.constants) else 1.0, []
    for name in top.states.couplings:
        parts = parse_name(name)
        place = _Place(n2=parts.n2, nz2=parts.nz2, states=parts.states)
        value = top.states.values[name] * (sign if parts.symbol.startswith("G") else 1.0)
        found.append(Parameter(place.code(_BETWEEN[parts.symbol], count), value, _FIXED, name))
    return found


def _oblate(constants: Constants) -> bool:
    return constants.kind == "oblate" or constants.representation == "IIIl"


def _spin_parameters(top: Top, count: int) -> list[Parameter]:
    """Every constant of a spin by the codes that make it up; values of one code are added, and so are the squares of errors."""
    if top.spin_constants is None:
        return []
    places = {name: place for place, name in enumerate(top.spin_constants.twice, 1)}
    axes = AXES["IIIl" if _oblate(top.constants) else "Ir"]
    found: dict[int, list[tuple[float, float, str]]] = {}
    for effect in spin_effects(top):
        assert isinstance(effect, SpinEffect)
        for term in effect.spin_terms(top):
            value, error = effect.values[term.name], top.spin_constants.uncertainties.get(term.name, 0.0)
            states = None if term.bra == EVERY_STATE else (term.bra, term.ket)
            spins = tuple(places[spin] for spin in term.spins)
            place = _Place(spins, term.n2, term.nz2, term.ns, states)
            for typ, factor in _types(term, axes).items():
                found.setdefault(place.code(typ, count), []).append((factor * value, abs(factor) * error, term.name))
    out = []
    for code, parts in found.items():
        error = sqrt(sum(e * e for _, e, _ in parts)) if all(e for _, e, _ in parts) else _FIXED
        label = parts[0][2] if len(parts) == 1 else "+".join(name.partition("(")[0] for _, _, name in parts)
        out.append(Parameter(code, sum(value for value, _, _ in parts), error, label))
    return out


def _types(term: SpinTerm, axes: str) -> dict[int, float]:
    """What each TYP counts in a term of value 1; axes: those at x, y, z.

    A traceless tensor is 3/2 M_zz of TYP z and ¼ (M_xx - M_yy) of TYP 4, spin-rotation its own elements.
    """
    rotor = term.rotor
    if isinstance(rotor, CosinesWithN | Cosines) and rotor.rank in (1, 2) and np.ndim(rotor.components) == 2:
        matrix: Floats = term.factor * np.array(rotor.components)
    else:
        return {0: term.factor}
    if isinstance(rotor, CosinesWithN):
        diagonal = np.diag(matrix)
        found = {0: float(diagonal[0])} if np.ptp(diagonal) == 0 else dict(enumerate(diagonal.tolist(), 1))
    else:
        x, y, z = ("abc".index(axis) for axis in axes)
        matrix = matrix - np.trace(matrix) / 3 * np.eye(3)
        found = {z + 1: 1.5 * float(matrix[z, z]), 4: float(matrix[x, x] - matrix[y, y]) / 4}
    found |= {typ: float(matrix[pair]) for typ, pair in _CROSS.items()}
    return {typ: value for typ, value in found.items() if value}


def _option_lines(top: Top, own: Iterable[Constants], kmax: int) -> tuple[Options, ...]:
    """One line for all states, or where their weights differ one for each."""
    constants = list(own)
    count = len(constants)
    weights = [top.states.weights.get(v, top.spin_weights) if top.states else top.spin_weights for v in range(count)]
    lines = [_option_line(top, one, kmax) for one in weights]
    sign = -1 if lines[0].nvib < 0 else 1
    first = replace(lines[0], nvib=sign * count)
    if all(one == weights[0] for one in weights):
        return (first,)
    others = [replace(line, nvib=sign * v, vsym=-1 if v < count - 1 else 0) for v, line in enumerate(lines)][1:]
    return (replace(first, vsym=-1), *others)


def _option_line(top: Top, weights: SpinWeights, kmax: int) -> Options:
    line = options_of(top.constants, weights, kmax)
    return replace(line, spind=line.spind * spind_of(top.spin_constants.twice if top.spin_constants else {}))


def spind_of(twice: Mapping[str, int]) -> int:
    """SPIND of spins in the order of coupling: 2I + 1 digit by digit from the right, above 9 two digits each and a last 0.

    >>> spind_of({"S": 1, "14N": 2}), spind_of({"10B": 6, "other": 9}), spind_of({})
    (32, 10070, 1)
    """
    sizes = [size + 1 for size in twice.values()]
    wide = any(size > 9 for size in sizes)
    digits = "".join(f"{size:02d}" if wide else str(size) for size in reversed(sizes))
    return int(digits + "0" * wide) if sizes else 1
