"""The .par or .var file of a top with named constants, spins and states: the inverse of `named_top`.

| name | codes, in the basis Ir (axes a, b, c) |
|---|---|
| A[1], DeltaJ[1], E[1] | those of state 0 with V1 = V2 = 1; the energy is the code 11 |
| G_a, G_b, G_c; F_bc, F_ac, F_ab; W, W_pm2 | TYP 20, 40, 60; 21, 41, 61; 0, 4 between two states |
| chi_aa | 1.5 times TYP 1 with the spin twice; chi_bb-cc ¼ times TYP 4, in the basis IIIl of TYP 3 and 4; chi_ab TYP 61 |
| C_aa, eps_aa, C_iso, C_bb-cc | TYP 1 with the spin, 0, and ½ times 4 |
| C_ab-ba, eps_ab-ba | none |
| J, b_F; T_aa; D_aa, lambda | TYP 0 with two spins; as chi_aa; as chi_aa times 2S(2S-1) |

Powers J, K, S in a name are NSQ, KSQ, NS. A name without a state has V1 = V2 = 9 (99, 999).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.fitting.top_constants import TopConstants
from rotor.formats.spcat.hamiltonian.code_table import (
    PAIRS,
    TYPES_BETWEEN,
    Digits,
    all_states_digit,
    join_code,
    ladder_typ,
    split_code,
    square_typ,
    typ_across,
)
from rotor.formats.spcat.hamiltonian.codes import AXES, FIXED, basis_axes, code_factors, is_oblate
from rotor.formats.spcat.model import option_line
from rotor.formats.spcat.text.par import Header, Options, Parameter, ParameterFile
from rotor.quantum.effects.spin_effect import NuclearQuadrupole, SpinRotation, SpinSpin
from rotor.quantum.spins.scheme import Cosines, CosinesWithN, Scheme, SpinTerm, scheme_of
from rotor.tops.constants.constants import Constants
from rotor.tops.constants.parameter_names import ParameterName, parse_name
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.top import Top

_CROSS = {places: typ_across(letters) for letters, places in PAIRS.items()}
_KINDS = (NuclearQuadrupole, SpinRotation, SpinSpin)

Codes = dict[int, dict[str, float]]  # factors of the named constants in the value of each code


def _rotational_codes(constants: TopConstants) -> Codes:
    """Factors of the rotational parameters of each state."""
    top, out, states = constants.top, Codes(), constants.top.state_count
    for v in range(states):
        values: dict[str, Any] = dict(top.constants.values) if v == 0 or top.states is None else top.states.for_state(v)
        if v:
            out[join_code(Digits(v2=v, v1=v, state_count=states))] = {f"E[{v}]": 1.0}
            values.pop("E", None)
        state_constants = Constants(
            kind=constants.kind, reduction=constants.reduction, representation=constants.representation, **values
        )
        suffix = f"[{v}]" if v else ""
        for code, factors in code_factors(state_constants).items():
            full = join_code(split_code(code)._replace(v1=v, v2=v, state_count=states))
            out[full] = {f"{name}{suffix}": factor for name, factor in factors.items()}
    return out


def _interaction_codes(constants: TopConstants) -> Codes:
    """Factors of interactions and spin constants."""
    out, states, oblate = Codes(), constants.top.state_count, is_oblate(constants.top.constants)
    scheme = scheme_of(constants.top, constants.effects)
    terms = {
        term.name: term
        for effect in constants.effects
        if isinstance(effect, _KINDS)
        for term in effect.spin_terms(constants.top)
    }
    for name in constants.values:
        factors: dict[Digits, float] = {}
        if name in terms:
            factors = _spin_codes(parse_name(name), terms[name], scheme, constants, oblate)
        elif "," in name:
            parts = parse_name(name)
            assert parts.states is not None
            typ, (low, high) = TYPES_BETWEEN[parts.symbol], parts.states
            sign = -1.0 if oblate and parts.symbol.startswith("G") else 1.0
            factors = {Digits(typ=typ, ksq=parts.nz2, nsq=parts.n2, v2=low, v1=high, state_count=states): sign}
        for digits, factor in factors.items():
            if digits.nsq > 9 or digits.ksq > 9:
                raise ValueError(
                    f"{name}: SPFIT's codes have powers of N² and of Nz² up to 9 (J and K to the power 18)"
                )
            out.setdefault(join_code(digits), {})[name] = factor
    return out


def _spin_codes(
    parts: ParameterName, term: SpinTerm, scheme: Scheme, constants: TopConstants, oblate: bool
) -> dict[Digits, float]:
    """The codes of a spin constant, from the matrix c_ij that it multiplies."""
    states, places = constants.top.state_count, [scheme.place(spin) + 1 for spin in term.spins]
    i1, i2 = max(places), (min(places) if len(places) == 2 else 0)
    wild = 0 if states == 1 else all_states_digit(states)
    v1, v2 = (wild, wild) if parts.states is None else (max(parts.states), min(parts.states))
    base = Digits(i2=i2, i1=i1, ns=parts.ns, ksq=parts.nz2, nsq=parts.n2, v2=v2, v1=v1, state_count=states)
    rotor = term.rotor
    if not isinstance(rotor, Cosines | CosinesWithN):
        return {base: term.factor}
    if np.any(np.array(rotor.components) != np.array(rotor.components).T) and rotor.rank == 1:
        raise ValueError(
            f"{parts.text}: no code of SPFIT says what the two orders of a spin-rotation constant differ by (its commutators with N², "
            "I1 = 0 and I2 > 0, are other operators); leave it out, or stay with .toml"
        )
    acts_on_three = scheme.equivalent == 3 and max(places) > len(scheme.spins) - 3
    factors = _matrix_codes(
        np.array(rotor.components, dtype=float), isinstance(rotor, CosinesWithN), oblate, acts_on_three
    )
    return {base._replace(typ=typ): term.factor * factor for typ, factor in factors.items()}


def _matrix_codes(c: Floats, whole: bool, oblate: bool, acts_on_three: bool) -> dict[int, float]:
    """TYP and factors of Σ c_ij: of the whole matrix, or of its traceless part by TYP 1, 2 or 3 (for z) and TYP 4.

    acts_on_three: for one of three equivalent spins the parts that change K count twice, see `symmetry.halved_across`.
    """
    x, y, z = ("abc".index(axis) for axis in basis_axes(oblate))
    diagonal, times = np.diag(c), 2.0 if acts_on_three else 1.0
    mean, across = float(diagonal[x] + diagonal[y]) / 2, times * float(diagonal[x] - diagonal[y]) / 4
    factors = {typ: times * float(c[i, k]) for (i, k), typ in _CROSS.items()}
    along, ladder = square_typ("abc"[z]), ladder_typ(1)
    if not whole:
        factors |= {along: float(diagonal[z]) - mean, ladder: across}
    elif acts_on_three or diagonal[0] == diagonal[1] == diagonal[2] or diagonal[x] == -diagonal[y]:
        factors |= {0: mean, along: float(diagonal[z]) - mean, ladder: across}
    else:
        factors |= {square_typ("abc"[i]): float(diagonal[i]) for i in range(3)}
    # factors of round-off are no codes
    return {typ: factor for typ, factor in factors.items() if abs(factor) > 1e-12}


def named_parameter_file(top: Top, kmax: int) -> ParameterFile:
    """The file of a top, for levels with K up to `kmax`; spins in the order in which they are coupled.

    Raises ValueError, with the constant or the weights, for what an SPFIT file cannot express.
    """
    return named_parameters(TopConstants(top, top.spin_constants is not None), top.name, kmax)[0]


def named_parameters(constants: TopConstants, title: str, kmax: int) -> tuple[ParameterFile, Floats]:
    """The file of named constants with their errors, and M (parameters, constants) with values of the file = M @ constants.

    A parameter that contains a constant of unknown error has the error 1e-37, which holds it. Raises ValueError as `named_parameter_file`.
    """
    if constants.kind == "asymmetric" and constants.representation not in AXES:
        raise ValueError(
            f"constants in representation {constants.representation}: SPFIT's files have Ir and IIIl alone; convert them first"
        )
    codes, names = _rotational_codes(constants) | _interaction_codes(constants), list(constants.values)
    matrix = np.zeros((len(codes), len(names)))
    for row, factors in enumerate(codes.values()):
        for name, factor in factors.items():
            matrix[row, names.index(name)] = factor
    values = matrix @ np.array(list(constants.values.values()))
    parameters = tuple(
        Parameter(code, float(value), _error(factors, constants.uncertainties), _label(factors))
        for (code, factors), value in zip(codes.items(), values, strict=True)
    )
    # a negative NLINE: more than six quantum numbers a state
    header = Header(npar=len(parameters), nline=-1 if len(constants.quanta) > 6 else 1, nitr=1, errtst=1e6)
    return ParameterFile(title, header, _option_lines(constants, kmax), parameters), matrix


def _error(factors: Mapping[str, float], errors: Mapping[str, float]) -> float:
    """√Σ (factor · error)² for independent errors."""
    if not set(factors) <= set(errors):
        return FIXED
    return float(np.sqrt(sum((factor * errors[name]) ** 2 for name, factor in factors.items()))) or FIXED


def _label(factors: Mapping[str, float]) -> str:
    """The constants of a parameter, as text."""
    parts = [name if factor == 1 else f"{factor:.4g}*{name}" for name, factor in factors.items()]
    return "+".join(parts).replace("+-", "-").replace("-1*", "-")


def _option_lines(constants: TopConstants, kmax: int) -> tuple[Options, ...]:
    """One option line for all states, or one for each if their weights differ."""
    top = constants.top
    count = top.state_count
    weights = [top.states.weights.get(v, top.spin_weights) if top.states else top.spin_weights for v in range(count)]
    spins = top.spin_constants if constants.hyperfine else None
    lines = [_option_line(top, spins, state_weights, kmax) for state_weights in weights]
    sign = -1 if lines[0].nvib < 0 else 1
    first = replace(lines[0], nvib=sign * count)
    if all(state_weights == weights[0] for state_weights in weights):
        return (first,)
    others = [replace(line, nvib=sign * v, vsym=-1 if v < count - 1 else 0) for v, line in enumerate(lines)][1:]
    return (replace(first, vsym=-1), *others)


def _option_line(top: Top, spins: SpinConstants | None, weights: SpinWeights, kmax: int) -> Options:
    """The option line with spins; IAX is negative if two or three of them have a total spin."""
    line = option_line(top.constants, weights, kmax)
    if spins is None:
        return line
    line = replace(line, spind=line.spind * spind_digits(spins.twice))
    if len(spins.totals) == 3:
        return replace(line, iax=-6, ewt=0)
    return replace(line, iax=-line.iax) if spins.totals else line


def spind_digits(twice: Mapping[str, int]) -> int:
    """SPIND of spins in the order of coupling: 2I + 1 as digits from the right, or two digits each and a last 0 if one is above 9.

    >>> spind_digits({"S": 1, "14N": 2}), spind_digits({"10B": 6, "other": 9}), spind_digits({})
    (32, 10070, 1)
    """
    sizes = [size + 1 for size in twice.values()]
    wide = any(size > 9 for size in sizes)
    digits = "".join(f"{size:02d}" if wide else str(size) for size in reversed(sizes))
    return int(digits + "0" * wide) if sizes else 1
