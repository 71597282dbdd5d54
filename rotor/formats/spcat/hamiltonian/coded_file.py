"""A .par or .var file as operators: its states, series and phases, the parameter lines that act, and why others are left out.

For files with one state and no spin see `codes.file_constants`, which gives named constants.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import NamedTuple

from rotor.formats.spcat.hamiltonian.code_table import Digits, Kind, Symmetry, file_codes, split_code, state_digits
from rotor.formats.spcat.hamiltonian.codes import basis_axes
from rotor.formats.spcat.hamiltonian.l_doubled import Pair, l_doubled_pairs
from rotor.formats.spcat.hamiltonian.operators import CodedOperator
from rotor.formats.spcat.hamiltonian.phases import Phases, read_phases
from rotor.formats.spcat.hamiltonian.series import Series, coded_operator, file_series, level_term, refuse_within_pairs
from rotor.formats.spcat.hamiltonian.states import StateOptions, file_states
from rotor.formats.spcat.hamiltonian.symmetry import forbidden, l_values, symmetric_part
from rotor.formats.spcat.text.par import Options, Parameter, ParameterFile
from rotor.frozen import dataclass


class CodedLine(NamedTuple):
    """One parameter line: its place in the file, from 1, its operator, and the two states, lower first (None: all states)."""

    place: int
    parameter: Parameter
    digits: Digits
    symmetry: Symmetry
    operator: CodedOperator
    states: tuple[int, int] | None

    @property
    def name(self) -> str:
        """The name of the line among the parameters of the Hamiltonian."""
        return line_name(self.parameter, self.place)

    @property
    def reversed_(self) -> bool:
        """Whether the code has V2 > V1."""
        return self.digits.v2 > self.digits.v1

    @property
    def is_between(self) -> bool:
        """Whether the line connects two states."""
        return self.states is not None and self.states[0] != self.states[1]

    @property
    def highest_spin(self) -> int:
        """The highest number of its spins; 0 without spins."""
        return max((*self.operator.spins, 1 if self.operator.ns else 0), default=0)


def line_name(parameter: Parameter, place: int) -> str:
    """The code of a parameter line and its place in the file, from 1, as one name."""
    return f"{parameter.code}#{place}"


def line_names(file: ParameterFile) -> tuple[str, ...]:
    """The names of all parameter lines."""
    return tuple(line_name(parameter, place) for place, parameter in enumerate(file.parameters, 1))


def coded_file(file: ParameterFile) -> CodedFile:
    """A file with the basis that its option lines state."""
    return CodedFile(file, file_states(file))


@dataclass(frozen=True, eq=False)
class CodedFile:
    """A parameter file by its codes.

    file: codes, values in MHz, labels, options. states: its states with the range of K of a calculation.
    """

    file: ParameterFile
    states: tuple[StateOptions, ...]

    @property
    def options(self) -> Options:
        """The first option line."""
        return self.file.options[0]

    @property
    def oblate(self) -> bool:
        """Whether z is the c axis."""
        return self.options.oblate

    @property
    def axes(self) -> str:
        """The axes x, y, z."""
        return basis_axes(self.oblate)

    @cached_property
    def digits(self) -> tuple[Digits, ...]:
        """The fields of each code."""
        return file_codes(self.file)

    @cached_property
    def pairs(self) -> list[Pair]:
        """The l-doubled pairs."""
        return l_doubled_pairs(self.states)

    @cached_property
    def members(self) -> frozenset[int]:
        """The states of l-doubled pairs."""
        return frozenset(v for pair in self.pairs for v in pair)

    @cached_property
    def series(self) -> Series:
        """The constants of series."""
        constants = [
            (digits, parameter)
            for digits, parameter in zip(self.digits, self.file.parameters, strict=True)
            if digits.is_constant
        ]
        return file_series(constants, self.options, len(self.states), self.pairs)

    @cached_property
    def phases(self) -> Phases:
        """The phases of the functions, without regard to dipoles."""
        return read_phases(self.options, self.digits, len(self.states), self.members)

    @cached_property
    def lines(self) -> list[CodedLine]:
        """All lines that have an operator; a series with constants of each state gives one line for each.

        Parameters of value zero are skipped, as are those between a state and 9 (99, 999), which are place holders in SPFIT, those of
        states that do not exist (`left_out`), and constants of series.
        Raises ValueError with the line, for an unknown operator or one that violates time reversal.
        """
        xopt, count, lines = self.options.xopt, len(self.states), list[CodedLine]()
        if not 0 <= xopt < 80:
            raise ValueError(f"XOPT = {xopt}: expected PHASE + 10 NEWLZ + 20 NOFC + 40 G12, 0 to 79")
        series = self.series
        for place, (digits, parameter) in enumerate(zip(self.digits, self.file.parameters, strict=True), 1):
            missing = digits.is_place_holder or digits.missing_state is not None
            # a line without a value, or for no state of the file, adds nothing
            if parameter.value == 0.0 or digits.is_constant or missing:
                continue
            symmetry, states = digits.symmetry(self.oblate), digits.states
            targets = [(v, v) for v in range(count)] if states is None and digits.is_series else [states]
            try:
                for target in targets:
                    operator = coded_operator(digits, self.axes, series, target)
                    line = CodedLine(place, parameter, digits, symmetry, operator, target)
                    lines.append(self._within_pairs(line))
            except ValueError as error:
                raise parameter.refusal(
                    f"{error}; leave it out, or correct the code, which reads {digits.text}"
                ) from None
        return lines

    def _within_pairs(self, line: CodedLine) -> CodedLine:
        """The line as it acts on l-doubled states: with NEWLZ, operators of the state with K l ≤ 0 have the sign of l.

        Raises ValueError for operators that violate time reversal, and for unsupported series.
        """
        firsts, states = {pair.second: pair.first for pair in self.pairs}, line.states
        if states:
            refuse_within_pairs(line.digits, states, self.members)
        if not states or line.is_between or states[0] not in self.members or not self.options.newlz:
            return line
        of_second, level = states[0] in firsts, line.digits.kind is Kind.LEVEL
        if line.operator.odd != of_second and not level:
            raise ValueError(
                "with NEWLZ an operator that time reversal turns around is named by the state with K l ≤ 0, any other by the one with "
                "K l > 0"
            )
        if not of_second:
            return line
        first = firsts[states[0]]
        if level:  # half the difference of the energies of one K with K l > 0 and K l < 0
            line = line._replace(operator=level_term(line.digits, self.axes, sine=True))
        return line._replace(states=(first, first))

    @cached_property
    def _selected(self) -> tuple[list[CodedLine], list[CodedLine], list[str]]:
        """`acting`, `usable`, and a sentence for each line that is left out."""
        lines, unlike = _without(self.lines, self._forbidden)
        acting, imaginary = _without([self._symmetric_part(line) for line in lines], self._imaginary)
        usable, without_spin = _without(acting, self._missing_spin)
        return acting, usable, unlike + imaginary + without_spin

    @property
    def acting(self) -> list[CodedLine]:
        """The lines that the declared symmetry allows, as in SPCAT, and that are real in the phases of the file.

        Raises ValueError for an odd operator within one state that is invariant under all half turns, which is imaginary in any phases.
        """
        return self._selected[0]

    @property
    def usable(self) -> list[CodedLine]:
        """The acting lines whose spins occur in SPIND."""
        return self._selected[1]

    @cached_property
    def left_out(self) -> list[str]:
        """A sentence for each parameter that SPCAT ignores: symmetry forbids it, or its spins or states do not exist."""
        reasons, count = list[str](), len(self.states)
        digit_count = state_digits(count)
        for digits, parameter in zip(self.digits, self.file.parameters, strict=True):
            missing = digits.missing_state
            if missing is not None and parameter.value:
                reasons.append(_left_out(parameter, f"state {missing} does not exist, NVIB = {count} counts from 0"))
            # with fewer digits the code would be of all states
            shorter = [split_code(parameter.code, 10**fewer - 1) for fewer in range(1, digit_count)]
            if digits.is_place_holder and parameter.value and any(each.states is None for each in shorter):
                why = f"with NVIB = {count} a state has {digit_count} digits, and {10**digit_count - 1} stands for all states"
                reasons.append(_left_out(parameter, f"it reads V1 = {digits.v1}, V2 = {digits.v2}; {why}"))
        return reasons + self._selected[2]

    def _concerned(self, line: CodedLine) -> list[tuple[int, int]]:
        """The pairs of states in which a line acts."""
        return [(v, v) for v in range(len(self.states))] if line.states is None else [line.states]

    def _forbidden(self, line: CodedLine) -> str:
        """The reason why the declared symmetry forbids a line."""
        l_of, why = l_values(self.states, self.pairs), []
        for low, high in self._concerned(line):
            del_l = abs(l_of.get(low, 0) - l_of.get(high, 0)) * (-1 if line.reversed_ else 1)
            both, doubled = (self.states[low], self.states[high]), bool({low, high} & self.members)
            why.append(forbidden(line.symmetry, *both, del_l, doubled, line.operator.spins))
        return why[0] if all(why) else ""

    def _symmetric_part(self, line: CodedLine) -> CodedLine:
        """The line with the part of its operator that an axis of more than two folds allows."""
        states = [self.states[v] for pair in self._concerned(line) for v in pair]
        if not line.symmetry.square or all(s.fold <= 2 or s.is_threefold(line.operator.spins) for s in states):
            return line
        return line._replace(operator=symmetric_part(line.operator, self.axes))

    def _imaginary(self, line: CodedLine) -> str:
        """The reason why a line within one state is imaginary in the phases of the file; odd operators of pairs act with the sign of l."""
        axis, odd = line.symmetry.axis, line.operator.odd
        if line.is_between or (line.states and line.states[0] in self.members) or odd == (axis in self.phases.odd):
            return ""
        if not axis:
            raise line.parameter.refusal(
                "the operator changes sign under time reversal and under no half turn; it can only connect different states"
            )
        kind, others = ("odd", "even") if odd else ("even", "odd")
        why = f"it is {kind} under time reversal; within one state those along {axis} are {others} ones here"
        return f"{why} (by their number, or by PHASE of XOPT)"

    def _missing_spin(self, line: CodedLine) -> str:
        """The reason why a spin term acts on none of its states."""
        spins, needed = line.operator.spins, line.highest_spin
        concerned = self.states if line.states is None else [self.states[v] for v in line.states]
        count = max if line.states is None else min
        have = count(len(state.spins) for state in concerned)
        if needed > have:
            return f"spin {needed} is not among the {have} that SPIND names"
        if len(spins) == 2 and spins[0] == spins[1]:
            largest = count(state.spins[needed - 1] if len(state.spins) >= needed else 0 for state in concerned)
            if largest <= 1:
                return f"spin {needed} is {largest}/2, and a spin of 1/2 or less has no quadrupole moment"
        return ""


def _left_out(parameter: Parameter, why: str) -> str:
    """A sentence on a line that is left out, as SPCAT does."""
    return f"parameter {parameter.code} is left out, as SPCAT does: {why}"


def _without(lines: Sequence[CodedLine], reason: Callable[[CodedLine], str]) -> tuple[list[CodedLine], list[str]]:
    """The lines without a reason to leave them out, and a sentence for each parameter that has one."""
    reasons = [reason(line) for line in lines]
    both = list(zip(lines, reasons, strict=True))
    # a parameter may be one line for each state
    sentences = dict.fromkeys(_left_out(line.parameter, why) for line, why in both if why)
    return [line for line, why in both if not why], list(sentences)
