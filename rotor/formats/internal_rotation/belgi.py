"""Output of BELGI: the constants at its head, and its list of levels.

BELGI has the rho-axis frame, z along ρ, and

    H = OA Pa² + B Pb² + C Pc² + F (p - RHORHO Pa)² + ½V3 (1 - cos 3α) + ½V6 (1 - cos 6α) + ...

in cm⁻¹ or MHz, as the line before its constants says. The constants of this H are read, those that were compared with its levels (784,
within 0.002 kHz); other terms are refused where they are not 0. A line of the list is VT, K, E in cm⁻¹ above the foot of the potential, and
N: K of type A counts by energy inside each v_t, K of type E is signed. Lists of six columns v_t, K, E, J, parity, σ are read too.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Floats, Ints
from rotor.table import Table
from rotor.tops.constants.constants import Constants
from rotor.tops.internal_rotation import InternalRotationConstants
from rotor.tops.top import Top
from rotor.units import MHZ_PER_CM

HEAD = 4000  # characters that contain the name of the program
ROTATION = {"OA": "A", "B": "B", "C": "C"}
TORSION = {"F": "F", "RHORHO": "rho", "V3": "V3", "V6": "V6"}
_CONSTANT = re.compile(r"^\s*([A-Z]\w*)\s*=\s*([-+]?[\d.]+(?:[EeDd][-+]?\d+)?)\s*,?\s*$", re.MULTILINE)
_LEVEL = re.compile(r"VT= *(\d+) +K= *(-?\d+) +E= *(-?[\d.]+) +CM-1")
_BLOCK = re.compile(r"N= +(\d+) +ISIG= +(\d+)")


@dataclass(frozen=True, eq=False, repr=False)
class ListedLevels(Table):
    """Listed levels: species (0 A, 1 E), v_t, J, K (counted for A, signed for E), and cm⁻¹ above the minimum of the potential."""

    species: Ints
    vt: Ints
    j: Ints
    k: Ints
    energy_cm: Floats

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """species, vt, j, k, energy_cm."""
        return {name: getattr(self, name) for name in ("species", "vt", "j", "k", "energy_cm")}


def is_belgi_file(path: str | os.PathLike[str]) -> bool:
    """Whether a file is an output of BELGI with its constants."""
    with Path(path).open(encoding="utf-8", errors="replace") as handle:
        head = handle.read(HEAD)
    return "BELGI" in head and "&CSTE" in head


def read_belgi(path: str | os.PathLike[str]) -> Top:
    """The top with the constants at the head of an output of BELGI.

    path: the output.
    Returns: top with constants of internal rotation in the frame RAM.
    Raises ValueError with the file, for missing constants, and for unsupported terms that are not 0.
    """
    text = Path(path).read_text(encoding="utf-8", errors="replace")
    head = text.partition("&CSTE")[2].partition("\n /")[0]
    values = {name: float(number.upper().replace("D", "E")) for name, number in _CONSTANT.findall(head)}
    scale = MHZ_PER_CM if re.search(r"^\s*CM-1", text.partition("&CSTE")[0], re.MULTILINE) else 1.0
    names = ROTATION | TORSION
    if missing := [name for name in names if name not in values]:
        raise ValueError(
            f"{os.fspath(path)}: {', '.join(missing)} missing in the constants at the head of the output of BELGI"
        )
    if strange := [name for name, value in values.items() if value and name not in names]:
        raise ValueError(
            f"{os.fspath(path)}: {', '.join(strange)}: rotor reads {', '.join(names)}; give the others in a .toml file"
        )
    numbers = {ours: values[theirs] * (1.0 if ours == "rho" else scale) for theirs, ours in names.items()}
    internal = {name: value for name in TORSION.values() if (value := numbers[name]) or name in ("F", "rho", "V3")}
    rotation: dict[str, Any] = {name: numbers[name] for name in ROTATION.values()}
    return Top.from_constants(
        Constants(**rotation, reduction="A", representation="Ir"),
        internal_rotation=InternalRotationConstants(internal, "RAM", vt_max=0, source="output of BELGI"),
        name=Path(path).stem,
    )


def read_belgi_levels(path: str | os.PathLike[str]) -> ListedLevels:
    """The levels listed in an output of BELGI, in its order.

    Raises ValueError, with the file, if it lists none.
    """
    text = Path(path).read_text(encoding="utf-8", errors="replace")
    rows = [_parse_row(line) for line in text.splitlines() if line.count(",") == 5 and "=" not in line]
    if not rows:
        blocks = list(_BLOCK.finditer(text))
        ends = [*(block.start() for block in blocks[1:]), len(text)][: len(blocks)]
        for block, end in zip(blocks, ends, strict=True):
            levels = _LEVEL.findall(text[block.end() : end])
            rows += [(int(block[2]), int(v), int(block[1]), int(k), float(energy)) for v, k, energy in levels]
    if not rows:
        raise ValueError(
            f"{os.fspath(path)}: contains no levels; expected lines such as VT= 0 K= 0 E= 44.73 CM-1, or six columns"
        )
    species, vt, j, k, energy = np.array(rows).T
    whole = [column.astype(np.int64) for column in (species, vt, j, k)]
    return ListedLevels(whole[0], whole[1], whole[2], whole[3], energy)


def _parse_row(line: str) -> tuple[int, int, int, int, float]:
    """Species, v_t, J, K, E from a line with the columns v_t, K, E, J, parity, σ."""
    v, k, energy, j, _, species = line.split(",")
    return int(species), int(v), int(j), int(k), float(energy)
