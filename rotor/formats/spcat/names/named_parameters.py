"""The .par or .var file of a top with named constants, spins and states: the inverse of `named_top`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from rotor.arrays import Floats
from rotor.fitting.top_constants import TopConstants
from rotor.formats.spcat.hamiltonian.codes import FIXED
from rotor.formats.spcat.model import option_line
from rotor.formats.spcat.names.named_codes import constant_codes
from rotor.formats.spcat.text.par import Header, Options, Parameter, ParameterFile
from rotor.tops.spins.spin_constants import SpinConstants
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.top import Top


def named_parameter_file(top: Top, kmax: int) -> ParameterFile:
    """The file of a top, for levels with K up to `kmax`; spins in the order in which they are coupled.

    Raises ValueError, with the constant or the weights, for what an SPFIT file cannot express.
    """
    return named_parameters(TopConstants(top, top.spin_constants is not None), top.name, kmax)[0]


def named_parameters(constants: TopConstants, title: str, kmax: int) -> tuple[ParameterFile, Floats]:
    """The file of named constants with their errors, and M (parameters, constants) with values of the file = M @ constants.

    A parameter that contains a constant of unknown error has the error 1e-37, which holds it. Raises ValueError as `named_parameter_file`.
    """
    codes, names = constant_codes(constants), list(constants.values)
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
    count = 1 if top.states is None else top.states.count
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
