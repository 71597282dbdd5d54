"""Catalogue predicted from an .int and a .var or .par file as by SPCAT, with the Q, limits, cut, weights and labels of the files.

Notes of the prediction report input that SPCAT ignores silently.

FLAGS of 1000 and more: constants are in cm⁻¹, and so are FQLIM, the frequencies and their errors, with six decimals; a frequency that
prints as 0.000000 is left out, and STR1 counts (ν cm/300 000)², ν in cm⁻¹ as the program has it in its variable of MHz (H. M. Pickett,
documentation of SPFIT and SPCAT, "FLAGS"; STR1 as the program's lists say).
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable
from dataclasses import field, replace
from functools import cached_property, partial

from rotor import units
from rotor.formats.spcat.block_numbers import numbered_blocks
from rotor.formats.spcat.file_lines import as_catalogue, as_level_list, group_lines, group_transitions
from rotor.formats.spcat.file_model import connected_groups
from rotor.formats.spcat.file_quanta import quanta_format
from rotor.formats.spcat.hamiltonian.code_table import Digits, file_codes
from rotor.formats.spcat.hamiltonian.codes import HELD_BELOW
from rotor.formats.spcat.prediction_notes import prediction_notes
from rotor.formats.spcat.solved_groups import highest_n, joined_lines, solved_groups
from rotor.formats.spcat.text.catalogue import Catalogue, Layout
from rotor.formats.spcat.text.egy import LevelList
from rotor.formats.spcat.text.fields import QUANTUM_RANGE
from rotor.formats.spcat.text.int_file import IntensityFile, Request, read_int
from rotor.formats.spcat.text.par import Parameter, ParameterFile, parameters_beside, read_par
from rotor.frozen import dataclass
from rotor.spectra.lines import Lines

FLAGS_IN_CM = 1000  # and above
_LEAST_CM = 5e-7
_DECIMALS_IN_CM = (6, 6, 4, 4)


@dataclass(frozen=True)
class Prediction:
    """A predicted catalogue with the data behind it.

    catalogue: as the program would list it, in cm⁻¹ where FLAGS says so, E″ from the Hamiltonian's zero, degeneracies with the
    weights as the file has them. lines: the same lines before K doublets were parted, E″ from the lowest level.
    q: the partition function used, as a file counts it: unreduced weights, energies from the Hamiltonian's zero.
    request: line 2 of the .int file. noting, listing: what makes `notes` and `levels`.
    """

    catalogue: Catalogue
    lines: Lines
    q: float
    request: Request
    noting: Callable[[], Iterable[str]] = field(repr=False)
    listing: Callable[[], LevelList] = field(repr=False)

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """What the program would have passed over in silence; computed at first use, since the effect of KNMAX takes other levels."""
        return tuple(self.noting())

    @cached_property
    def levels(self) -> LevelList:
        """The levels from FBGN to FEND as SPCAT would list them; computed at first use."""
        return self.listing()


def predict_file(path: str | os.PathLike[str], *, as_spcat: bool = False, full_basis: bool = False) -> Prediction:
    """The catalogue of an .int file and the .var (else .par) file of the same name.

    as_spcat, full_basis: see `predict`. Raises ValueError, with file and line, for unreadable or unsupported input.
    """
    beside = parameters_beside(path)
    parameters, intensities = read_par(beside), read_int(path)
    try:
        prediction = predict(parameters, intensities, as_spcat=as_spcat, full_basis=full_basis)
    except ValueError as error:
        raise ValueError(f"{path} with {beside.name}: {error}") from None
    if beside.suffix.lower() != ".par" or prediction.lines.stated_spread is None:
        return prediction
    a_priori = f"errors of lines are from the a-priori errors of {beside.name}; SPFIT writes those of a fit into a .var"
    return replace(prediction, noting=lambda: (*prediction.notes, a_priori))


def predict(
    parameters: ParameterFile, intensities: IntensityFile, *, as_spcat: bool = False, full_basis: bool = False
) -> Prediction:
    r"""The catalogue that SPCAT makes of its two input files, from true eigenvalues.

    A line is listed when both its J (F, without nuclear spins) lie from FBGN to FEND, its two levels have the same nuclear-spin
    weight (with an axis of threefold or higher symmetry: their Wang blocks have a weight in common, so that the two levels may weigh
    WTPL and WTMN), its frequency lies below FQLIM, and its intensity, that of one component of a K doublet, is above
    10^STR0 + 10^STR1 (ν/300 GHz)² nm² MHz.

    parameters: the .var or .par file. intensities: the .int file. as_spcat: reproduce SPCAT's numbers even where it errs: QROT below 1,
    some moments. full_basis: ignore KNMIN and KNMAX: the basis has all K up to N. By default K runs from KNMIN to KNMAX.
    Returns: catalogue, lines, levels, Q, and notes on input that SPCAT ignores silently and on the effect of KNMAX.
    Raises ValueError for an empty range of F, for Q or a temperature not above 0, and for unsupported input, which docs/spcat_codes.md
    lists.

    >>> from rotor.formats.spcat.text.int_file import read_int
    >>> from rotor.formats.spcat.text.par import read_par
    >>> file = read_par(b"OCS\n 1 0 0 0\nl -1 1 0 0\n 100 6081.492 0\n")
    >>> expected = read_int(b"OCS\n 0 60503 1028.6 0 3 -9 -9 99 300\n 1 0.71519\n")
    >>> predict(file, expected).catalogue.frequency_mhz.round(3).tolist()
    [12162.984, 24325.968, 36488.952]
    """
    request = intensities.request
    _refuse_limits(request)
    if request.flags >= FLAGS_IN_CM:
        files = files_in_mhz(parameters, intensities)
        in_mhz = predict(*files, as_spcat=as_spcat, full_basis=full_basis)
        return replace(in_mhz, catalogue=catalogue_in_cm(in_mhz.catalogue), request=request)
    if as_spcat and request.qrot < 1:
        request = replace(request, qrot=1.0)
    highest = highest_n(parameters, request)
    groups = connected_groups(parameters, intensities, as_spcat=as_spcat, full_basis=full_basis, highest_n=highest)
    form = quanta_format(parameters, groups)
    solved = solved_groups(parameters, groups, request, form)
    listed = [group_lines(*each, group_transitions(each.group, each.levels, request), form, request) for each in solved]
    pieces = [(lines, form.qnfmt(each.group.spins)) for lines, each in zip(listed, solved, strict=True)]

    present = [each.group for each in solved]
    linear = all(state.linear for group in present for state in group.states)
    without_vectors = [each._replace(levels=replace(each.levels, blocks=())) for each in solved]
    return Prediction(
        as_catalogue(pieces, form, request.tag, linear=linear),
        joined_lines(parameters, solved, [lines.transitions for lines in listed], form, request),
        request.qrot,
        request,
        partial(prediction_notes, parameters, intensities, as_spcat, full_basis, without_vectors),
        lambda: as_level_list(without_vectors, form, numbered_blocks(parameters, present)),
    )


def _refuse_limits(request: Request) -> None:
    """Raise ValueError for a range of F without levels, and for Q or a temperature that is not above 0."""
    if not 0 <= request.fbgn <= request.fend <= QUANTUM_RANGE[1]:
        raise ValueError(
            f"FBGN = {request.fbgn}, FEND = {request.fend}: F runs from FBGN to FEND, from 0 to {QUANTUM_RANGE[1]}, the "
            "highest that two characters of a catalogue can say"
        )
    if not (math.isfinite(request.qrot) and request.qrot > 0):
        raise ValueError(f"QROT = {request.qrot}: a partition function is a number above 0")
    if not (math.isfinite(request.temperature_k) and request.temperature_k > 0):
        raise ValueError(f"TEMP = {request.temperature_k:g}: a temperature is above 0 K")


def files_in_mhz(parameters: ParameterFile, intensities: IntensityFile) -> tuple[ParameterFile, IntensityFile]:
    r"""Both files converted to MHz: values and errors of parameters, limits of the request.

    >>> from rotor.formats.spcat.text.int_file import Request
    >>> from rotor.formats.spcat.text.par import read_par
    >>> file = read_par(b"CO\n 1 0 0 0\nl -1 1 0 0\n 100 1.9225 1e-37\n")
    >>> file, intensities = files_in_mhz(file, IntensityFile("", Request(flags=1001, fqlim_ghz=100.0), ()))
    >>> round(file.parameters[0].value, 3), round(intensities.request.fqlim_ghz, 6)
    (57635.1, 2997.92458)
    """
    request = intensities.request
    request = replace(
        request,
        flags=request.flags % FLAGS_IN_CM,
        fqlim_ghz=request.fqlim_ghz * units.MHZ_PER_CM * 1e-3,
        str1=request.str1 - 2.0 * math.log10(units.MHZ_PER_CM),
        text="",
    )
    in_mhz = tuple(map(_in_mhz, parameters.parameters, file_codes(parameters)))
    return replace(parameters, parameters=in_mhz), replace(intensities, request=request)


def _in_mhz(parameter: Parameter, digits: Digits) -> Parameter:
    if digits.is_constant:  # ρ, a and b of a series are pure numbers
        return parameter
    error = parameter.error
    if error is not None and error >= HELD_BELOW:
        error *= units.MHZ_PER_CM
    return replace(parameter, value=parameter.value * units.MHZ_PER_CM, error=error, text="")


def catalogue_in_cm(catalogue: Catalogue) -> Catalogue:
    """The lines of a catalogue in MHz, with frequencies and errors converted to cm⁻¹ with six decimals."""
    frequency = catalogue.frequency_mhz / units.MHZ_PER_CM
    converted = replace(
        catalogue,
        frequency_mhz=frequency,
        error_mhz=catalogue.error_mhz / units.MHZ_PER_CM,
        layout=Layout(decimals=_DECIMALS_IN_CM),
    )
    return converted.take(frequency >= _LEAST_CM)
