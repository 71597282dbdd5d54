"""Catalogues of JPL and CDMS, .cat, as species whose lines can be computed at any temperature.

LGINT is for 300 K; with Q(300 K) and Q(T) of a catdir.cat it gives the intensity at another temperature. Without that table
Q(T)/Q(300 K) = (T/300 K)^(DR/2) with the catalogue's degrees of freedom DR (H. M. Pickett et al., J. Quant. Spectrosc. Radiat. Transf. 60,
883 (1998)); column densities need the ratio alone, Einstein coefficients then have an unknown factor. A note says so.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rotor import units
from rotor.formats.catalogue.catdir import CatdirEntry, catdir_beside
from rotor.formats.spcat.compare import in_mhz
from rotor.formats.spcat.text.cat import read_cat
from rotor.formats.spcat.text.catalogue import Catalogue
from rotor.formats.spcat.text.fields import BLANK
from rotor.observed.partition import PartitionTable
from rotor.observed.species import CATALOGUE_K, SpeciesLines, species_lines, strength_from_lgint

RATIO_NOTE = "Q(T) from the degrees of freedom of the catalogue: there is no catdir.cat with this tag; Einstein coefficients are not known"
_SCALED_K = (2.725, 9.375, 37.5, 150.0, 300.0, 1000.0)


def read_cat_species(
    path: str | os.PathLike[str], entries: Mapping[int, CatdirEntry] | None = None, name: str | None = None
) -> SpeciesLines:
    """The lines of a .cat file as a species.

    Parameters
    ----------
    path : path
    entries : mapping, optional
        Species by tag, of `read_catdir`; by default those of files catdir*.cat in the same folder and the one above.
    name : str, optional
        Instead of the one in the table of species.

    Returns
    -------
    SpeciesLines

    Raises
    ------
    ValueError
        For a line that cannot be read, by file, line and column, for a file without lines, and for one with several tags.
    """
    file = Path(path)
    return species_of_catalogue(
        read_cat(file), entries if entries is not None else catdir_beside(file), name, str(file)
    )


def species_of_catalogue(
    catalogue: Catalogue, entries: Mapping[int, CatdirEntry], name: str | None = None, source: str = ""
) -> SpeciesLines:
    """A catalogue that was read as a species; see `read_cat_species`."""
    tags = np.unique(np.abs(catalogue.tag))
    if len(tags) != 1:
        raise ValueError(f"{source}: {len(tags)} tags; expected the lines of one species")
    tag = int(tags[0])
    entry = entries.get(tag)
    known = entry.partition if entry is not None else None
    partition = known or partition_by_degrees(int(catalogue.dr[0]))
    frequency, error = in_mhz(catalogue)
    lower_k = catalogue.energy_lower_cm * units.MHZ_PER_CM / units.MHZ_PER_K
    identity = {"tag": tag} | ({"database": entry.database} if entry else {}) | ({} if known else {"note": RATIO_NOTE})
    return species_lines(
        name or (entry.name if entry else Path(source).stem or f"tag {tag}"),
        frequency,
        strength_from_lgint(catalogue.lgint, frequency, lower_k, partition.at(CATALOGUE_K)),
        lower_k,
        catalogue.g_upper,
        partition,
        error_mhz=error,
        upper=quanta_texts(catalogue.quanta_upper),
        lower=quanta_texts(catalogue.quanta_lower),
        source=source,
        identity=identity,
    )


def partition_by_degrees(dr: int) -> PartitionTable:
    """(T/300 K)^(DR/2), whose value at 300 K is 1 whatever that of Q is."""
    kelvin = np.array(_SCALED_K)
    return PartitionTable(kelvin, (kelvin / CATALOGUE_K) ** (dr / 2), RATIO_NOTE)


def quanta_texts(quanta: NDArray[np.int16]) -> NDArray[np.str_]:
    """Quantum numbers (n, q) as texts (n,), blanks left out."""
    rows, inverse = np.unique(quanta, axis=0, return_inverse=True)
    texts = np.array([" ".join(str(q) for q in row if q != BLANK) for row in rows.tolist()], dtype=np.str_)
    return texts[inverse.reshape(-1)] if len(rows) else np.zeros(0, dtype=np.str_)
