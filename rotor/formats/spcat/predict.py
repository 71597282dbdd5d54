"""Catalogue predicted from an .int and a .var or .par file as by SPCAT, with the Q, limits, cut, weights and labels of the files.

Notes of the prediction report input that SPCAT ignores silently.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from rotor import units
from rotor.formats.line_tables import catalogue
from rotor.formats.spcat import wavenumbers
from rotor.formats.spcat.file_lines import LEAST_MHZ, equally_weighted, least_intensity
from rotor.formats.spcat.hamiltonian.codes import is_linear
from rotor.formats.spcat.hamiltonian.labels import BY_DIAG
from rotor.formats.spcat.hamiltonian.states import is_plain, states_of
from rotor.formats.spcat.model import FOLD, common_weight, top_of
from rotor.formats.spcat.predict_states import levels_of_files, predicted
from rotor.formats.spcat.prediction_notes import note_of_qrot, notes_of_full_basis
from rotor.formats.spcat.text.catalogue import Catalogue
from rotor.formats.spcat.text.egy import LevelList
from rotor.formats.spcat.text.fields import QUANTUM_RANGE
from rotor.formats.spcat.text.int_file import IntensityFile, Request, read_int
from rotor.formats.spcat.text.par import Options, ParameterFile, note_of_npar, read_par
from rotor.formats.spcat.variances import constants_covariance
from rotor.quantum.levels import Levels
from rotor.quantum.solve import solve_levels
from rotor.quantum.wang.basis import wang_blocks
from rotor.quantum.wang.rotation import hamiltonian
from rotor.quantum.wang.wang_matrix import JMatrix, block_bands
from rotor.spectra.lines import Lines, line_list
from rotor.thermodynamics import PartitionFunction, partition_function
from rotor.tops.top import Top


@dataclass(frozen=True)
class Prediction:
    """A predicted catalogue with the data behind it.

    catalogue: as the program would list it, in cm⁻¹ where FLAGS says so, E″ from the Hamiltonian's zero, degeneracies with the
    weights as the file has them. lines: the same lines before K doublets were parted, weights reduced, E″ from the lowest level.
    q: the partition function used, as a file counts it: unreduced weights, energies from the Hamiltonian's zero.
    request: line 2 of the .int file. notes: what the program would have passed over in silence. listing: what makes `levels`.
    """

    catalogue: Catalogue
    lines: Lines
    q: float
    request: Request
    notes: tuple[str, ...] = ()
    listing: Callable[[], LevelList] | None = field(default=None, repr=False)

    @cached_property
    def levels(self) -> LevelList | None:
        """The levels as SPCAT would list them, for files with spins or several states; computed at first use."""
        return None if self.listing is None else self.listing()


def predict_file(
    path: str | os.PathLike[str], *, own_q: bool = False, as_spcat: bool = False, full_basis: bool = False
) -> Prediction:
    """The catalogue of an .int file and the .var (else .par) file of the same name.

    own_q, as_spcat, full_basis: see `predict`. Raises ValueError, with file and line, for unreadable or unsupported input.
    """
    return predict(
        read_par(parameters_beside(path)), read_int(path), own_q=own_q, as_spcat=as_spcat, full_basis=full_basis
    )


def levels_of_file(path: str | os.PathLike[str], *, as_spcat: bool = False, full_basis: bool = False) -> LevelList:
    """The levels of an .int file from FBGN to FEND as SPCAT lists them in its .egy file; see `predict_file`."""
    parameters, intensities = read_par(parameters_beside(path)), read_int(path)
    if intensities.request.flags >= wavenumbers.FROM:
        parameters, intensities = wavenumbers.files_in_mhz(parameters, intensities)
    return levels_of_files(parameters, intensities, as_spcat=as_spcat, full_basis=full_basis)


def parameters_beside(path: str | os.PathLike[str]) -> Path:
    """The .var file of the same name as an .int file, else its .par file."""
    beside = [Path(path).with_suffix(suffix) for suffix in (".var", ".par")]
    existing = next((p for p in beside if p.exists()), None)
    if existing is None:
        raise ValueError(f"{path}: an .int file has no constants; its .var or .par must stand beside it")
    return existing


def predict(
    parameters: ParameterFile,
    intensities: IntensityFile,
    *,
    own_q: bool = False,
    as_spcat: bool = False,
    full_basis: bool = False,
) -> Prediction:
    """The catalogue that SPCAT makes of its two input files, from true eigenvalues.

    A line is listed when both its J (F, without nuclear spins) lie from FBGN to FEND, its two levels have one nuclear-spin
    weight, its frequency lies below FQLIM, and its intensity, that of one component of a K doublet, is above
    10^STR0 + 10^STR1 (ν/300 GHz)² nm² MHz.

    Parameters
    ----------
    parameters : ParameterFile
        The .var or .par file.
    intensities : IntensityFile
        The .int file.
    own_q : bool, optional
        Sum the partition function over all levels, independent of FEND and KNMAX, instead of using QROT.
    as_spcat : bool, optional
        Reproduce SPCAT's numbers even where it errs: QROT below 1, some moments.
    full_basis : bool, optional
        Ignore KNMIN and KNMAX: the basis has all K up to N. By default K runs from KNMIN to KNMAX.

    Returns
    -------
    Prediction
        Catalogue, lines, Q, and notes on input that SPCAT ignores silently and on the effect of KNMAX.

    Raises
    ------
    ValueError
        For an empty range of F, for Q or a temperature not above 0, and for unsupported input: series with spins, operators of odd
        order within one state, some cases of l-doubled states and of total spins of equivalent nuclei.

    Examples
    --------
    >>> from rotor.formats.spcat.text.int_file import read_int
    >>> from rotor.formats.spcat.text.par import read_par
    >>> file = read_par(b"OCS\\n 1 0 0 0\\nl -1 1 0 0\\n 100 6081.492 0\\n")
    >>> expected = read_int(b"OCS\\n 0 60503 1028.6 0 3 -9 -9 99 300\\n 1 0.71519\\n")
    >>> predict(file, expected).catalogue.frequency_mhz.round(3).tolist()
    [12162.984, 24325.968, 36488.952]
    """
    options, request = parameters.options[0], intensities.request
    if not 0 <= request.fbgn <= request.fend <= QUANTUM_RANGE[1]:
        raise ValueError(
            f"FBGN = {request.fbgn}, FEND = {request.fend}: F runs from FBGN to FEND, from 0 to {QUANTUM_RANGE[1]}, the "
            "highest that two characters of a catalogue can say"
        )
    if request.flags >= wavenumbers.FROM:
        files = wavenumbers.files_in_mhz(parameters, intensities)
        in_mhz = predict(*files, own_q=own_q, as_spcat=as_spcat, full_basis=full_basis)
        return replace(in_mhz, catalogue=wavenumbers.catalogue_in_cm(in_mhz.catalogue), request=request)
    if not (own_q or (math.isfinite(request.qrot) and request.qrot > 0)):
        raise ValueError(f"QROT = {request.qrot}: a partition function is a number above 0")
    if not (math.isfinite(request.temperature_k) and request.temperature_k > 0):
        raise ValueError(f"TEMP = {request.temperature_k:g}: a temperature is above 0 K")
    further = (*note_of_qrot(request, as_spcat), *_not_written(request))
    if as_spcat and 0 < request.qrot < 1:
        request = replace(request, qrot=1.0)
        intensities = replace(intensities, request=request)
    others_names = (options.diag in BY_DIAG or options.diag < 0) and options.spind > 0 and not is_linear(options)
    is_cut = not full_basis and options.knmax < request.fend and not is_linear(options)
    top = None if is_cut or others_names else _named_top(parameters, intensities)
    if top is None:
        listed, lines_of_states, q, listing, notes = predicted(
            parameters, intensities, own_q=own_q, as_spcat=as_spcat, full_basis=full_basis
        )
        return Prediction(listed, lines_of_states, q, request, (*notes, *further), listing)

    top = replace(top, covariance=constants_covariance(parameters))
    common = common_weight(options)
    q = summed_q(top, options, request.temperature_k).q if own_q else request.qrot
    lines = _requested_lines(top, request, q / common)
    return Prediction(
        catalogue=_as_the_program_lists(lines, options, common, request.tag),
        lines=lines,
        q=q,
        request=request,
        notes=(*_notes(parameters, top, request), *further),
    )


def _named_top(parameters: ParameterFile, intensities: IntensityFile) -> Top | None:
    """The top with named constants; None if the codes of the file must be solved.

    Codes are solved for spins, states and other operators, for constants not in the order A >= B >= C, for a spherical top with a dipole,
    and if the sign of SPIND requests quantum numbers of the other kind: N and K of an asymmetric top, N, Ka and Kc of a symmetric or linear
    one.
    """
    first = parameters.options[0]
    if not is_plain(parameters, intensities) or (is_linear(first) and first.nvib < 0):  # whose axis is not z
        return None
    try:
        top = top_of(parameters, intensities)
    except ValueError:  # without names; what no file may have is refused there too
        return None
    if top.kind == "spherical" and any(
        dipole.value for dipole in intensities.dipoles
    ):  # which a top of that symmetry has none of
        return None
    return top if (top.kind in ("asymmetric", "spherical")) == (first.spind > 0) else None


def summed_q(top: Top, options: Options, temperature_k: float) -> PartitionFunction:
    """Q summed from the levels as an .int file counts it: unreduced weights, energies from the Hamiltonian's zero."""
    summed = partition_function(top, temperature_k)
    ground_k = _ground_mhz(top) / units.MHZ_PER_K
    return replace(summed, q=summed.q * common_weight(options) * math.exp(-ground_k / temperature_k))


def _ground_mhz(top: Top) -> float:
    """The lowest existing level (MHz), which has J ≤ 3 for any weights."""
    return solve_levels(top, 3, vectors=False).ground_mhz


def _requested_lines(top: Top, request: Request, q_reduced: float) -> Lines:
    """The lines within the request's limits. `Lines` counts energies from the lowest level, QROT from zero."""
    t = request.temperature_k
    above_zero = _ground_mhz(top) / units.MHZ_PER_K / t if math.isfinite(t) and t > 0 else 0.0
    lines = line_list(
        top,
        temperature_k=t,
        q=q_reduced * math.exp(above_zero),
        jmax=request.fend,
        untrusted=True,
        min_lgint=request.str0,
        range_mhz=(LEAST_MHZ, request.fqlim_ghz * 1e3),
    )
    j, components = lines.levels.rotational, lines.levels.components[lines.lower]
    in_range = np.minimum(j[lines.upper], j[lines.lower]) >= request.fbgn
    in_range &= equally_weighted(lines.levels, lines.upper, lines.lower)
    return lines.where(in_range & (10.0**lines.lgint / components > least_intensity(request, lines.frequency_mhz)))


def _as_the_program_lists(lines: Lines, options: Options, common: int, tag: int) -> Catalogue:
    """The catalogue of lines as SPCAT lists it."""
    listed = catalogue(lines, tag)
    from_zero = (lines.levels.energy_mhz / units.MHZ_PER_CM)[lines.lower]
    listed = replace(listed, energy_lower_cm=from_zero, g_upper=listed.g_upper * common)
    return _parted_doublets(listed, FOLD[options.iax]) if _parts_doublets(lines.levels, options) else listed


def _parts_doublets(levels: Levels, options: Options) -> bool:
    return levels.kind in ("prolate", "oblate") and options.spind < 0 and options.iax in FOLD


def _parted_doublets(merged: Catalogue, fold: int) -> Catalogue:
    """The catalogue with each line of a K doublet as two lines, as in SPCAT.

    If K is a multiple of the fold the two states of a doublet differ in symmetry (A1, A2); the sign of K distinguishes them, and a line
    with ΔK = 0 connects -K with K. All others (E) are listed twice with the same label. Lines with ΔK ≠ 0 are unchanged.
    """
    upper, lower = merged.quanta_upper[:, 1], merged.quanta_lower[:, 1]
    doublet = (upper == lower) & (upper > 0)
    twice = merged.take(np.repeat(np.arange(len(merged)), np.where(doublet, 2, 1)))
    first = np.cumsum(np.where(doublet, 2, 1)) - np.where(doublet, 2, 1)  # where each line begins in `twice`

    halved = np.repeat(doublet, np.where(doublet, 2, 1))
    quanta_upper, quanta_lower = twice.quanta_upper.copy(), twice.quanta_lower.copy()
    signed = first[doublet & (upper % fold == 0)]
    quanta_upper[signed, 1] *= -1
    quanta_lower[signed + 1, 1] *= -1
    return replace(
        twice,
        lgint=twice.lgint - math.log10(2) * halved,
        g_upper=twice.g_upper // np.where(halved, 2, 1).astype(np.int32),
        quanta_upper=quanta_upper,
        quanta_lower=quanta_lower,
    )


def _notes(parameters: ParameterFile, top: Top, request: Request) -> list[str]:
    """Notes on what SPCAT does silently with these files, and what is computed here."""
    options, notes = parameters.options[0], note_of_npar(parameters)
    if not is_linear(options):  # a KNMAX below FEND is here only where it is lifted
        notes += notes_of_full_basis(states_of(parameters), request.fend)
    if top.kind == "asymmetric" and options.diag == 0:
        j = _diagonal_rolls_over(top, request.fend)
        if j is not None:
            notes.append(
                f"from J = {j} on the diagonal of the Hamiltonian stops rising (or falling) with K: SPCAT with DIAG = 0 "
                "may then list first-order energies instead of eigenvalues; these are eigenvalues, labelled by order"
            )
    if top.kind in ("prolate", "oblate") and options.spind < 0 and options.iax not in FOLD:
        notes.append(
            f"IAX = {options.iax} in a symmetric top: the two lines of a K doublet are listed as one, with |K|"
        )
    return notes


def _not_written(request: Request) -> list[str]:
    """Note on output that FLAGS request and that is not written here, a .str file (tens digit)."""
    if request.flags // 10 % 10 == 0:
        return []
    return [
        f"FLAGS = {request.flags} asks for a .str file, which is not written here: the signs of its transition dipoles follow from the "
        "phases of SPCAT's diagonalization; strengths of lines are in --csv and --json"
    ]


def _diagonal_rolls_over(top: Top, jmax: int) -> int | None:
    """The lowest J at which ⟨K|H|K⟩ of a Wang block ceases to rise (or fall) with K."""
    operators, representation = hamiltonian(top), str(top.constants.representation)
    rise = 1.0 if representation[:2] == "Ir" else -1.0
    for j in range(2, jmax + 1):
        multiplet = JMatrix(operators, j)
        for block in wang_blocks(j, representation):
            steps = rise * np.diff(block_bands(multiplet, block)[0][1:])  # the folded element at the lowest K apart
            if (steps <= 0).any():
                return j
    return None
