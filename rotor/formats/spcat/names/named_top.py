"""A .par or .var file with spins and several states as a top of named constants: chi_aa(14N), B[1], G_c[0,1], ...

The files contain sizes of spins but no isotopes. A spin is named after the isotope in labels such as chi_aa(14N) if the size agrees, else
by its place in SPIND, I1, I2, ...; the files do not distinguish electrons. Nuclei with a total spin (IAX below 0) share the name I. Terms
without a name here (l-doubled states, terms outside orthorhombic symmetry in one state, spin-orbit terms) are refused with their meaning;
`rotor.formats.spcat.predict` computes the files themselves.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from math import gcd

import numpy as np

from rotor.arrays import Floats
from rotor.formats.spcat.hamiltonian.code_table import PAIRS, TYPES_BETWEEN, Kind, split_code
from rotor.formats.spcat.hamiltonian.coded_file import CodedFile, CodedLine, coded_file
from rotor.formats.spcat.hamiltonian.codes import (
    ALONG,
    HELD_BELOW,
    MEAN,
    NO_NAME,
    basis_axes,
    file_constants,
)
from rotor.formats.spcat.hamiltonian.dipole_codes import split_dipoles
from rotor.formats.spcat.hamiltonian.operators import CodedOperator
from rotor.formats.spcat.hamiltonian.states import StateOptions, is_single_state, options_alone
from rotor.formats.spcat.hamiltonian.symmetry import halved_across
from rotor.formats.spcat.model import class_weights, reduced_weights
from rotor.formats.spcat.text.int_file import IntensityFile
from rotor.formats.spcat.text.par import Options, Parameter, ParameterFile
from rotor.quantum.effects.spin_effect import matrix_of
from rotor.quantum.spins.scheme import Cosines, CosinesWithN, Scalar
from rotor.tops.constants.constants import AxisOrderError, Constants
from rotor.tops.spins.spin_constants import SpinConstants, is_isotope
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.states.state_constants import StateConstants
from rotor.tops.top import Top

_BETWEEN = {typ: symbol for symbol, typ in TYPES_BETWEEN.items() if not symbol.startswith("W")}
_LADDERS = {
    int(symbol[4:] or 0) // 2: symbol for symbol in TYPES_BETWEEN if symbol.startswith("W")
}  # by n of N₊^2n + N₋^2n


def named_top(file: ParameterFile, intensities: IntensityFile | None = None, *, errors: bool = False) -> Top:
    """The top of files with several states or spins.

    file: a .par or .var file. intensities: dipoles of the states and between them. errors: whether errors of parameters become
    uncertainties of constants that are one parameter.
    Returns: constants of state 0, `states` and `spin_constants`; `notes` says which parameters are left out, as SPCAT leaves them out.
    The Hamiltonian is that of the files with every K to N in the basis.
    Raises ValueError with the field or the parameter, for terms without a name.
    """
    coded = coded_file(file)
    _refuse(coded)
    states, first, rows, odd = coded.states, coded.options, coded.usable, coded.phases.odd
    if odd and any(line.symmetry.axis for line in rows):
        raise ValueError(f"operators within one state that are odd under time reversal, or a PHASE for them, {NO_NAME}")

    letters = frozenset().union(*(line.digits.reductions for line in rows if line.operator.plain is not None))
    letter = "s" if "S" in letters else "a" if letters else first.chr  # of all states, as one of them shows it
    parameters_of_states = _parameters_by_state(coded)
    constants, energies = [], []
    for v, parameters in enumerate(parameters_of_states):
        option = replace(options_alone(file, v), chr=letter)
        energies.append(sum(p.value for p in parameters if split_code(p.code).is_energy))
        plain = tuple(p for p in parameters if not split_code(p.code).is_energy)
        constants.append(_state_constants(v, replace(file, options=(option,), parameters=plain), errors))
    if len(kinds := dict.fromkeys(state_constants.kind for state_constants in constants)) > 1:
        raise ValueError(f"states of the kinds {' and '.join(kinds)} in one file: a top has one kind of constants")
    turned = (constants[0].kind, first.oblate) in (("prolate", True), ("oblate", False))
    weights = _weights(file, states, constants[0].kind in ("prolate", "oblate"))
    couplings, dipoles = _couplings(rows, first, turned), _dipoles(intensities, len(states), turned)
    of_one_state = [low == high for (low, high), mu in dipoles.items() if any(mu)]
    if couplings and of_one_state and not any(of_one_state):
        raise ValueError(f"dipoles between coupled states alone, which SPCAT takes times i, {NO_NAME}")
    top = Top.from_constants(
        constants[0],
        name=file.title,
        dipole_abc_debye=dipoles.get((0, 0), (0.0, 0.0, 0.0)) if intensities else None,
        spin_weights=weights[0],
        symmetry_checked=False,
        states=_states(constants, energies, couplings, weights, dipoles),
        spin_constants=_spins(rows, states, turned, first.oblate, errors),
    )
    return replace(top, notes=(*top.notes, *coded.left_out))


def _refuse(coded: CodedFile) -> None:
    """Raise ValueError for options and operators without named constants."""
    first, states = coded.options, coded.states
    for digits, parameter in zip(coded.digits, coded.file.parameters, strict=True):
        if digits.is_series or digits.is_constant:
            raise parameter.refusal(f"FF, EX, TYP 90 to 99: a Fourier or Euler series {NO_NAME}")
    reasons = {
        f"IXX = {first.ixx}: a sum of angular momenta that is held for conserved": first.ixx != 0,
        f"IAX = {first.iax}: a total spin of three nuclei with unlike weights": any(
            s.equivalent == 3 and s.plus != s.minus for s in states
        ),
        f"EWT = {first.ewt}: an l-doubled state": any(s.l_code for s in states),
        f"XOPT = {first.xopt}: NEWLZ, NOFC or G12": first.xopt >= 10,
        "KNMIN: a range of K that does not begin with 0": any(s.kmin for s in states),
        "the energy of the only state": len(states) == 1 and any(line.digits.is_energy for line in coded.usable),
        "SPIND: spins that differ from state to state": len({s.spins for s in states}) > 1,
        "KNMAX: linear states beside others": len({s.linear for s in states}) > 1,
    }
    for what, applies in reasons.items():
        if applies:
            raise ValueError(f"{what} {NO_NAME}")


def _state_constants(v: int, file: ParameterFile, errors: bool) -> Constants:
    """The constants of one state; ValueError, with its number, unless A >= B >= C for its axes."""
    try:
        return file_constants(file, errors=errors)
    except AxisOrderError as reason:
        raise ValueError(f"state {v}: {reason.constants}; axes in another order than A >= B >= C {NO_NAME}") from None


def _parameters_by_state(coded: CodedFile) -> list[list[Parameter]]:
    """The parameters of each state without spins, with the codes of one state; parameters of all states occur in each."""
    count = len(coded.states)
    by_state: list[list[Parameter]] = [[] for _ in range(count)]
    for line in coded.usable:
        if line.operator.rotor is not None or line.is_between:
            continue
        if line.operator.plain is None:
            raise line.parameter.refusal(f"a term of this kind in one state {NO_NAME}")
        plain = replace(line.parameter, code=line.digits.in_lowest_state, constrained=False, text="")
        parts = [plain]
        if line.digits.kind is Kind.SQUARE and len(line.operator.plain) == 2:  # across an axis of more than two folds
            parts = [
                replace(plain, code=MEAN, value=plain.value / 2),
                replace(plain, code=ALONG, value=-plain.value / 2),
            ]
        for v in range(count) if line.states is None else line.states[:1]:
            by_state[v] += parts
    if is_single_state(coded.file):  # a constant of value 0 has a name as well
        zeros = zip(coded.file.parameters, coded.digits, strict=True)
        by_state[0] += [
            replace(p, code=d.in_lowest_state, constrained=False) for p, d in zeros if not p.value and d.has_name
        ]
    return by_state


def _couplings(rows: list[CodedLine], first: Options, turned: bool) -> dict[str, float]:
    """Interactions of two states without spins, by name; values of equal names are added."""
    values: dict[str, float] = {}
    sign = -1.0 if first.oblate else 1.0  # of G in an oblate basis
    for line in rows:
        parameter = line.parameter
        if line.operator.rotor is not None or not line.is_between:
            continue
        if turned:
            raise parameter.refusal(f"a coupling of states whose symmetry axis is not z {NO_NAME}")
        digits, terms = line.digits, dict[str, float]()
        if digits.typ in _BETWEEN:
            factor = sign if digits.tensor.odd else 1.0
            terms[_with_powers(_BETWEEN[digits.typ], digits.nsq, digits.ksq)] = factor
        for (p, q, n), factor in (line.operator.plain or {}).items():
            if n not in _LADDERS:
                terms.clear()
                break
            terms[_with_powers(_LADDERS[n], p, q)] = factor
        if not terms:
            raise parameter.refusal(f"this coupling of two states {NO_NAME}")
        for name, factor in terms.items():
            full = f"{name}[{','.join(map(str, line.states or ()))}]"
            values[full] = values.get(full, 0.0) + factor * parameter.value
    return values


def _with_powers(symbol: str, n2: int, nz2: int, ns: int = 0) -> str:
    powers = "J" * n2 + "K" * nz2 + "S" * ns
    return f"{symbol}_{powers}" if powers else symbol


def _weights(file: ParameterFile, states: tuple[StateOptions, ...], symmetric: bool) -> list[SpinWeights]:
    """The weights of all states; ValueError if states have different common divisors."""
    # with three equivalent spins all levels are of A species
    weights = [
        {"all": 2 * max(state.plus, 1)}
        if state.equivalent == 3
        else class_weights(replace(options_alone(file, state.number), iax=state.iax), symmetric)
        for state in states
    ]
    if len({gcd(*by_class.values()) for by_class in weights}) > 1:
        raise ValueError(f"WTPL, WTMN: weights of states whose common divisors differ {NO_NAME}")
    return [reduced_weights(by_class) for by_class in weights]


def _dipoles(
    intensities: IntensityFile | None, count: int, turned: bool
) -> dict[tuple[int, int], tuple[float, float, float]]:
    if intensities is None:
        return {}
    plain, others = split_dipoles(intensities.dipoles, count)
    if others:
        raise ValueError(f"dipole {others[0][0].code}: a moment other than a plain component {NO_NAME}")
    return {pair: mu[::-1] if turned else mu for pair, mu in plain.items()}


def _states(
    constants: list[Constants],
    energies: list[float],
    couplings: dict[str, float],
    weights: list[SpinWeights],
    dipoles: Mapping[tuple[int, int], tuple[float, float, float]],
) -> StateConstants | None:
    if len(constants) == 1:
        return None
    values: dict[str, float] = {}
    for v, state_value in enumerate(constants[1:], 1):
        values[f"E[{v}]"] = energies[v] - energies[0]
        values |= {f"{name}[{v}]": value for name, value in state_value.values.items()}
    zero_dipoles = {(v, v): (0.0, 0.0, 0.0) for v in range(len(constants))} if dipoles else {}
    others = {v: state_value for v, state_value in enumerate(weights) if state_value != weights[0]}
    if others:
        others[0] = weights[0]
    return StateConstants(values | couplings, weights=others, dipoles=zero_dipoles | dict(dipoles))


# spins


def _elements(kind: str, terms: list[tuple[Floats, float]]) -> dict[str, tuple[float, float | None]]:
    """The elements of a tensor by name, each with its error if it comes from one parameter.

    terms: of one kind with the same spins, powers and states: matrices along a, b, c, and their relative errors.
    """
    total = np.sum([matrix for matrix, _ in terms], axis=0)
    out: dict[str, tuple[float, float | None]] = {}
    for letters in _letters(kind, total):
        spreads = [abs(part) * error for matrix, error in terms if (part := _element(matrix, letters))]
        error = float(f"{spreads[0]:.12g}") if len(spreads) == 1 and spreads[0] > 0 else None
        out[kind if kind == "J" else f"{kind}_{letters}"] = float(f"{_element(total, letters):.15g}"), error
    return out


def _letters(kind: str, total: Floats) -> list[str]:
    """The nonzero elements that define a tensor; for spin-rotation only the scalar if it is one."""
    # equal but for round-off
    if kind in "CJ" and np.allclose(total, total[0, 0] * np.eye(3), rtol=0, atol=1e-14 * np.abs(total).max()):
        return ["iso"]
    names = ["aa", "bb", "cc", *PAIRS] if kind == "C" else ["aa", "bb-cc", *PAIRS]
    # elements of round-off get no name
    return [name for name in names if abs(_element(total, name)) > 1e-14 * np.abs(total).max()]


def _element(matrix: Floats, letters: str) -> float:
    return float((np.triu(matrix_of("aa" if letters == "iso" else letters)) * matrix).sum())


def _spins(
    rows: list[CodedLine], states: tuple[StateOptions, ...], turned: bool, oblate: bool, errors: bool
) -> SpinConstants | None:
    sizes, called = states[0].spins, _spin_names(rows, states[0].spins)
    equivalent = states[0].equivalent
    sums: dict[tuple[str, str], list[tuple[Floats, float]]] = {}
    for line in rows:
        parameter = line.parameter
        if line.operator.rotor is None:
            continue
        try:
            # of three equivalent nuclei, the parts of the term of one of them that change K are halved
            threefold = states[0].is_threefold(line.operator.spins)
            kind, matrix = _tensor(halved_across(line.operator, basis_axes(oblate)) if threefold else line.operator)
        except ValueError as reason:
            raise parameter.refusal(str(reason)) from None
        o, value = line.operator, parameter.value
        state_suffix = (
            "" if line.states is None or len(states) == 1 else f"[{','.join(map(str, dict.fromkeys(line.states)))}]"
        )
        spins = ",".join(called[place - 1] for place in sorted(set(o.spins)))
        key = kind, f"{_with_powers('', o.n2, o.nz2, o.ns)}({spins}){state_suffix}"
        spread = parameter.error or 0.0
        relative = spread / abs(value) if errors and spread > HELD_BELOW and value else 0.0
        sums.setdefault(key, []).append((value * (matrix[::-1, ::-1] if turned else matrix), relative))
    if not sizes:
        return None
    named = {
        symbol + rest: element
        for (kind, rest), terms in sums.items()
        for symbol, element in _elements(kind, terms).items()
    }
    values = {name: value for name, (value, _) in named.items()}
    spreads = {name: error for name, (_, error) in named.items() if error}
    totals = dict.fromkeys(called[len(called) - equivalent :], "I") if equivalent else {}
    twice = dict(zip(called, sizes, strict=True))
    # WTPL and WTMN never count the functions of two equivalent spins
    return SpinConstants(values, twice, uncertainties=spreads, totals=totals, weights_of_others=equivalent == 2)


def _spin_names(rows: list[CodedLine], sizes: tuple[int, ...]) -> list[str]:
    """Names of the spins: S or the isotope in labels of parameters with one spin, if the size agrees; else I1, I2, ..."""
    names = [f"I{place}" for place in range(1, len(sizes) + 1)]
    for line in rows:
        places, inside = set(line.operator.spins), re.search(r"\(([^(),]+)\)", line.parameter.label)
        if inside and len(places) == 1 and (name := inside[1].strip()) not in names:
            place = min(places) - 1
            if name.startswith("S") or is_isotope(name, sizes[place]):
                names[place] = name
    return names


def _tensor(operator: CodedOperator) -> tuple[str, Floats]:
    """The tensor of a spin term, and the matrix that its value multiplies."""
    rotor, spins = operator.rotor, operator.spins
    if isinstance(rotor, Scalar) and len(spins) == 2:
        return "J", np.eye(3)
    if isinstance(rotor, CosinesWithN):
        return "C", np.array(rotor.components)
    if isinstance(rotor, Cosines) and rotor.rank == 2:
        matrix = np.array(rotor.components)
        return "chi" if spins[0] == spins[1] else "T", matrix - np.trace(matrix) / 3 * np.eye(3)
    what = "a spin-orbit term" if isinstance(rotor, Cosines) else "a power of N·S alone"
    raise ValueError(f"{what} {NO_NAME}")
