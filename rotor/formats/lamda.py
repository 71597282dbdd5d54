"""Files of the Leiden database LAMDA: recognised, so that they are refused with a reason.

They hold levels, Einstein coefficients and collision rates of a molecule whose constants and dipole they do not have
(F. L. Schöier, F. F. S. van der Tak, E. F. van Dishoeck, J. H. Black, Astron. Astrophys. 432, 369 (2005)).
"""

from __future__ import annotations

from pathlib import Path
from typing import NoReturn

from rotor.formats.packed import first_bytes


def is_lamda_file(path: Path) -> bool:
    """Whether a file begins with the heading of LAMDA's, a comment with the word molecule."""
    return first_bytes(path, 200).lstrip().upper().startswith((b"!MOLECULE", b"! MOLECULE"))


def refuse_lamda(path: Path) -> NoReturn:
    """Raise ValueError with the content of the file and an alternative."""
    raise ValueError(
        f"{path}: a file of LAMDA (levels, Einstein coefficients, collision rates), which has neither constants nor a dipole "
        "to make a top of; give the catalogue of the molecule (.cat of JPL or CDMS), its constants, or its geometry"
    )
