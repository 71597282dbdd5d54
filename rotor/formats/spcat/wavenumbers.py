"""Files with constants in cm⁻¹ (FLAGS of 1000 and more): conversion to MHz, and catalogues in cm⁻¹ as SPCAT writes them.

There FQLIM is in cm⁻¹, a frequency that prints as 0.000000 is left out, and STR1 counts (ν cm/300 000)², ν in cm⁻¹ as the program has it in
its variable of MHz; frequencies and errors of the catalogue have six decimals (H. M. Pickett, documentation of SPFIT and SPCAT, "FLAGS";
STR1 as the program's lists say).
"""

from __future__ import annotations

import math
from dataclasses import replace

from rotor import units
from rotor.formats.spcat.hamiltonian.code_table import Digits, file_codes
from rotor.formats.spcat.hamiltonian.codes import HELD_BELOW
from rotor.formats.spcat.text.catalogue import Catalogue, Layout
from rotor.formats.spcat.text.int_file import IntensityFile
from rotor.formats.spcat.text.par import Parameter, ParameterFile

FROM = 1000  # constants are in cm⁻¹ for FLAGS of at least this value
_LEAST_CM = 5e-7
_DECIMALS = (6, 6, 4, 4)


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
        flags=request.flags % FROM,
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
        layout=Layout(decimals=_DECIMALS),
    )
    return converted.take(frequency >= _LEAST_CM)
