"""Line lists made for a .par file whose constants are known, in the ways that published .lin files are written."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rotor.formats.spcat.predict import predict
from rotor.formats.spcat.text.fields import BLANK
from rotor.formats.spcat.text.int_file import read_int
from rotor.formats.spcat.text.par import Parameter, ParameterFile, format_par, read_par
from rotor.units import MHZ_PER_CM

ERROR_MHZ = 0.02


@dataclass(frozen=True)
class Kind:
    """A kind of fit: the option lines, the parameters (code, value, label; a code below 0 is tied), dipoles, F up to, lines.

    held : labels of parameters that are not free. nline : sign of NLINE. wavenumbers : share of the lines that stand in cm-1
    """

    options: str
    parameters: str
    dipoles: str
    f_end: int
    lines: int
    held: str = ""
    ten: bool = False
    nxpar: int = 0


def parameter_file(kind: Kind) -> ParameterFile:
    """The file with the true constants."""
    rows = [row.split() for row in kind.parameters.strip().splitlines()]
    held = kind.held.split()
    text = "".join(
        f"{code:>13} {value} {'1.0E-37' if code.startswith('-') or label in held else '1.0E+36'} /{label}\n"
        for code, value, label in rows
    )
    head = (
        f"{len(rows):4d} {-kind.lines if kind.ten else kind.lines:5d}  100 {kind.nxpar:4d}  0.0E+00 1.0E+06 1.0E+00 1.0"
    )
    return read_par(f"a kind\n{head}\n{kind.options.strip()}\n{text}".encode())


def start_of(file: ParameterFile, share: float, rng: np.random.Generator) -> ParameterFile:
    """The file with every free constant off by its own part of itself, those tied to it alike."""
    factor, parameters = 1.0, list[Parameter]()
    for parameter in file.parameters:
        if not parameter.constrained:
            free = parameter.error is not None and parameter.error > 1.0
            factor = 1 + share * rng.uniform(-1, 1) if free else 1.0
        parameters.append(replace(parameter, value=parameter.value * factor))
    return replace(file, parameters=tuple(parameters))


def lines_of(kind: Kind, file: ParameterFile, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Quanta (n, 2k) of some lines drawn from the predicted ones, and their frequencies with normal errors, MHz."""
    request = f"a kind\n0 1 1000.0 0 {kind.f_end} -30 -30 9999999 300\n{kind.dipoles.strip()}\n"
    prediction = predict(file, read_int(request.encode()), as_spcat=True).catalogue
    width = int((prediction.quanta_upper[0] != BLANK).sum())
    quanta = np.concatenate([prediction.quanta_upper[:, :width], prediction.quanta_lower[:, :width]], axis=1)
    strong = np.flatnonzero(
        (prediction.lgint > np.quantile(prediction.lgint, 0.3)) & (prediction.frequency_mhz > 1000.0)
    )
    rows = np.sort(rng.choice(strong, size=min(kind.lines, len(strong)), replace=False))
    return quanta[rows].astype(int), prediction.frequency_mhz[rows] + ERROR_MHZ * rng.normal(size=len(rows))


def lin_text(quanta: np.ndarray, frequency: np.ndarray, rng: np.random.Generator, *, plain: bool = False) -> str:
    """The lines as people write them: blanks or commas, comments with or without a slash, errors in MHz or below 0 for cm-1.

    plain : all in MHz with blanks
    """
    fields = max(12, quanta.shape[1])
    out = []
    for row, value in zip(quanta.tolist(), frequency.tolist(), strict=True):
        labels = f"{''.join(f'{q:3d}' for q in row):<{3 * fields}}"
        style = 0 if plain else int(rng.integers(5))
        if style == 0:
            out.append(f"{labels} {value:16.4f} {ERROR_MHZ:8.4f}")
        elif style == 1:
            out.append(f"{labels} {value:.4f},{ERROR_MHZ} /Miller 1998, priv. comm.")
        elif style == 2:
            out.append(f"{labels} {value / MHZ_PER_CM:18.9f} {-ERROR_MHZ / MHZ_PER_CM:.9f}   / FTIR 12")
        elif style == 3:
            out.append(f"{labels}{value:.4f}  {ERROR_MHZ:.2E} 1.0 remark: seen twice")
        else:
            out.append(f"{labels} {value:16.4f}, {ERROR_MHZ:8.4f}, 0.5 /")
    return "\n".join(out) + "\n"


def write_case(folder: Path, name: str, kind: Kind, share: float, seed: int = 1) -> ParameterFile:
    """NAME.par with a start so far off, NAME.lin, and the true constants."""
    rng = np.random.default_rng(seed)
    file = parameter_file(kind)
    quanta, frequency = lines_of(kind, file, rng)
    (folder / f"{name}.lin").write_text(lin_text(quanta, frequency, rng))
    (folder / f"{name}.par").write_bytes(format_par(start_of(file, share, rng)))
    return file


def fields_of(text: str) -> list[str]:
    """The words of a line of text."""
    return re.split(r"[\s,]+", text.strip())
