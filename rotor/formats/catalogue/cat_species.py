"""Catalogues of JPL and CDMS, .cat, as species whose lines can be computed at any temperature.

LGINT is for 300 K; with Q(300 K) and Q(T) of a catdir.cat it gives the intensity at another temperature (H. M. Pickett et al., J. Quant.
Spectrosc. Radiat. Transf. 60, 883 (1998)). Without that table Q is summed over the levels of the lines. A note says so.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rotor import units
from rotor.formats.catalogue.catdir import CatdirEntry, catdir_beside, read_catdir
from rotor.formats.catalogue.level_sum import partition_from_lines
from rotor.formats.spcat.compare import in_mhz
from rotor.formats.spcat.text.cat import read_cat
from rotor.formats.spcat.text.catalogue import Catalogue
from rotor.formats.spcat.text.fields import BLANK
from rotor.observed.model.partition import PartitionTable
from rotor.observed.model.species import CATALOGUE_K, SpeciesLines, species_lines, strength_from_lgint

NO_CATDIR = "there is no catdir.cat with this tag"


def read_cat_species(
    path: str | os.PathLike[str],
    entries: Mapping[int, CatdirEntry] | None = None,
    name: str | None = None,
    partition: PartitionTable | None = None,
) -> SpeciesLines:
    """The lines of a .cat file as a species.

    Parameters
    ----------
    path : path
    entries : mapping, optional
        Species by tag, of `read_catdir`; by default those of files catdir*.cat in the same folder and the one above.
    name : str, optional
        Replaces the name in the table of species.
    partition : PartitionTable, optional
        Replaces Q(T) of that table.

    Returns
    -------
    SpeciesLines

    Raises
    ------
    ValueError
        For an unreadable line, with file, line and column, for a file without lines, and for a file with several tags.
    """
    file = Path(path)
    return species_from_catalogue(
        read_cat(file), entries if entries is not None else catdir_beside(file), name, str(file), partition
    )


def species_from_catalogue(
    catalogue: Catalogue,
    entries: Mapping[int, CatdirEntry],
    name: str | None = None,
    source: str = "",
    partition: PartitionTable | None = None,
) -> SpeciesLines:
    """A catalogue as a species.

    entries, name, partition: as in `read_cat_species`. source: file of the catalogue.
    Raises ValueError for a catalogue with several tags.
    """
    tags = np.unique(np.abs(catalogue.tag))
    if len(tags) != 1:
        raise ValueError(f"{source}: {len(tags)} tags; expected the lines of one species")
    tag = int(tags[0])
    entry = entries.get(tag)
    stated = partition or (entry.partition if entry is not None else None)
    table = stated or partition_from_lines(catalogue)
    frequency, error = in_mhz(catalogue)
    lower_k = catalogue.energy_lower_cm * units.MHZ_PER_CM / units.MHZ_PER_K
    identity = (
        {"tag": tag}
        | ({"database": entry.database} if entry else {})
        | ({} if stated else {"note": f"{NO_CATDIR}: Q {table.source}"})
    )
    return species_lines(
        name or (entry.name if entry else Path(source).stem or f"tag {tag}"),
        frequency,
        strength_from_lgint(catalogue.lgint, frequency, lower_k, table.at(CATALOGUE_K)),
        lower_k,
        catalogue.g_upper,
        table,
        error_mhz=error,
        upper=quanta_texts(catalogue.quanta_upper),
        lower=quanta_texts(catalogue.quanta_lower),
        source=source,
        identity=identity,
    )


def read_cat_with(path: str | os.PathLike[str], partition: str | None) -> SpeciesLines:
    """The lines of a .cat file with Q(T) from a text, `300=108.87,75=27.46`, from a catdir.cat, or as by `read_cat_species`.

    Raises ValueError for a text that is no list of temperatures and Q, and for a table without the tag of the catalogue.
    """
    if partition is None:
        return read_cat_species(path)
    if Path(partition).is_file():
        species = read_cat_species(path, read_catdir(partition))
        if "note" in species.identity:
            raise ValueError(f"{partition}: has no Q for tag {species.identity['tag']} of {os.fspath(path)}")
        return species
    return read_cat_species(path, {}, Path(path).stem, parse_partition(partition))


def parse_partition(text: str) -> PartitionTable:
    """Q(T) from `T=Q` pairs in K, separated by commas.

    >>> round(parse_partition("75=27.46, 300=108.87").at(300.0), 9)
    108.87
    """
    pairs = [pair.split("=") for pair in text.split(",") if pair.strip()]
    try:
        kelvin, q = np.array(sorted((float(t), float(value)) for t, value in pairs)).T
    except ValueError:
        raise ValueError(f"{text!r}: expected a catdir.cat file or T=Q pairs such as 300=108.87,75=27.46") from None
    return PartitionTable(kelvin, q, "the T=Q pairs given")


def quanta_texts(quanta: NDArray[np.int16]) -> NDArray[np.str_]:
    """Quantum numbers (n, q) as texts (n,), blanks left out."""
    rows, inverse = np.unique(quanta, axis=0, return_inverse=True)
    texts = np.array([" ".join(str(q) for q in row if q != BLANK) for row in rows.tolist()], dtype=np.str_)
    return texts[inverse.reshape(-1)] if len(rows) else np.zeros(0, dtype=np.str_)
