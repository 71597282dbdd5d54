"""Makes docs/library.md: what the library holds, its geometries and constants against each other and measured lines.

    python docs/make_library.py ../shared/reference/catalogues > docs/library.md

The catalogues (JPL, CDMS) are not part of the project.
"""

from __future__ import annotations

import gzip
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rotor.formats.doors import top_of_file
from rotor.formats.library import folders
from rotor.formats.molecule_file import MoleculeFile, read_molecule_file
from rotor.formats.spcat.cat import read_cat
from rotor.formats.spcat.fields import BLANK
from rotor.quantum.levels import solve_levels
from rotor.top import Top

WIDTH = {"linear": 1, "prolate": 2, "asymmetric": 3}  # how many quantum numbers a level has
# eQq in MHz and nuclear spin of molecules whose catalogue resolves the splitting, which is added to first order
QUADRUPOLE = {"methyl chloride": (-74.685, 1.5)}

HEAD = """# The molecules of the library

Made by `docs/make_library.py`; do not edit. The files themselves, `data/molecules/*.toml`, say where every number is from.

- **geometry**: r0, rs, re or computed; the largest relative difference between its A, B, C and the constants, and the bound
  that the file states. The difference is what vibration makes (and, of a computed geometry, its error).
- **constants**: *fitted* to measured lines here, *published* (read in a source that the file names), *memory* (quoted from
  memory for want of a source, in part at least), *estimated*. **memory in** names the tables of the file of which a source
  is memory.
- **lines**: measured lines of the catalogue in the range given, and how the constants meet them: root mean square, median and
  worst of |measured - calculated|. Two lines measured as one are compared each; those of methyl chloride are compared with
  the first-order quadrupole splitting of 35Cl added, components measured as one put together.

| file | name | kind | κ | geometry | difference | bound | constants | memory in |
|---|---|---|---|---|---|---|---|---|
"""

LINES_HEAD = """
| file | catalogue | lines | J ≤ | K ≤ | rms MHz | median MHz | worst MHz |
|---|---|---|---|---|---|---|---|
"""


@dataclass(frozen=True)
class Line:
    """A measured line: components (upper, lower, hyperfine factor of each, weight) that were measured as one."""

    frequency_mhz: float
    components: tuple[tuple[tuple[int, ...], tuple[int, ...], float, float], ...]


def measured_lines(file: MoleculeFile, catalogues: Path) -> list[Line]:
    """The measured lines of the vibrational ground state in the range that a molecule file states."""
    if file.catalogue is None or file.constants is None:
        return []
    width = WIDTH[file.constants.kind]
    spin = QUADRUPOLE[file.name][1] if file.name in QUADRUPOLE else 0.0
    found = read_cat(gzip.decompress((catalogues / f"{file.catalogue.tag}.cat.gz").read_bytes()))
    together: dict[tuple[float, int], list[tuple[tuple[int, ...], tuple[int, ...], float, float]]] = {}
    for i in np.flatnonzero(found.tag < 0).tolist():
        upper, lower = found.quanta_upper[i].tolist(), found.quanta_lower[i].tolist()
        if not _in_range(upper, lower, file, width + bool(spin)):
            continue
        one = (
            _level(upper, width),
            _level(lower, width),
            _shift(upper, spin) - _shift(lower, spin),
            10 ** found.lgint[i],
        )
        together.setdefault((float(found.frequency_mhz[i]), -1 if spin else i), []).append(one)
    return [Line(frequency, tuple(components)) for (frequency, _), components in together.items()]


def _level(quanta: list[int], width: int) -> tuple[int, ...]:
    return tuple(abs(q) for q in quanta[:width])


def _in_range(upper: list[int], lower: list[int], file: MoleculeFile, width: int) -> bool:
    limits = file.catalogue
    assert limits is not None
    if any(rest not in (0, BLANK) for quanta in (upper, lower) for rest in quanta[width:]):
        return False  # an excited vibrational state
    j, k = (max(abs(upper[n]), abs(lower[n])) for n in (0, 1))
    return j <= (limits.j_max or j) and (limits.k_max is None or k <= limits.k_max)


def _shift(quanta: list[int], spin: float) -> float:
    """First-order quadrupole energy over eQq of a level (J, K, F): Casimir's function, halves of F rounded up in the file.

    E = eQq [3K²/J(J+1) - 1] {¾C(C+1) - I(I+1)J(J+1)} / {2I(2I-1)(2J-1)(2J+3)}, C = F(F+1) - I(I+1) - J(J+1)
    (C. H. Townes and A. L. Schawlow, Microwave Spectroscopy, 1955, eq. 6-4).
    """
    if not spin or quanta[0] == 0:
        return 0.0
    j, k, f = quanta[0], quanta[1], quanta[2] - 0.5
    c = f * (f + 1) - spin * (spin + 1) - j * (j + 1)
    casimir = 0.75 * c * (c + 1) - spin * (spin + 1) * j * (j + 1)
    return (3 * k**2 / (j * (j + 1)) - 1) * casimir / (2 * spin * (2 * spin - 1) * (2 * j - 1) * (2 * j + 3))


def residuals(file: MoleculeFile, catalogues: Path) -> np.ndarray:
    """Measured minus calculated, MHz, of every measured line."""
    lines = measured_lines(file, catalogues)
    energy = energies(file, max(level[0] for line in lines for part in line.components for level in part[:2]))
    return np.array([line.frequency_mhz - frequency(line, energy, file.name) for line in lines])


def frequency(line: Line, energy: dict[tuple[int, ...], float], name: str) -> float:
    """The calculated frequency of a line: the mean of its components, weighted by their intensities."""
    eqq = QUADRUPOLE.get(name, (0.0, 0.0))[0]
    weights = [weight for *_, weight in line.components]
    each = [energy[upper] - energy[lower] + eqq * factor for upper, lower, factor, _ in line.components]
    return float(np.average(each, weights=weights))


def energies(file: MoleculeFile, jmax: int) -> dict[tuple[int, ...], float]:
    """Level energies in MHz by J, (J, K) or (J, Ka, Kc)."""
    assert file.constants is not None
    found = solve_levels(Top.from_constants(file.constants), jmax, vectors=False)
    quanta = np.stack([found.j, found.ka, found.kc], axis=1)[:, : WIDTH[found.kind]]
    return {tuple(q): float(e) for q, e in zip(quanta.tolist(), found.energy_mhz, strict=True)}


def difference(file: MoleculeFile) -> float:
    """The largest relative difference between A, B, C of the geometry and the constants."""
    assert file.molecule is not None
    assert file.constants is not None
    geometry, known = Top.from_molecule(file.molecule).rotational_constants_mhz, file.constants.rigid
    return max(abs(one / other - 1) for one, other in zip(geometry, known, strict=True) if np.isfinite(other))


def _origin(file: MoleculeFile) -> str:
    source = file.sources["constants"]
    words = {"fitted here": "fitted", "estimated": "estimated", "memory": "memory"}
    return next((word for text, word in words.items() if text in source), "published")


def _rows(files: dict[str, MoleculeFile]) -> Iterator[str]:
    for stem, file in files.items():
        top = top_of_file(file)
        kappa = f"{top.kappa:.3f}" if top.kind == "asymmetric" else ""
        memory = ", ".join(table.replace("_", " ") for table, source in file.sources.items() if "memory" in source)
        yield (
            f"| {stem} | {file.name} | {top.kind} | {kappa} | {file.geometry_kind} | {100 * difference(file):.2g} % | "
            f"{100 * (file.vibrational_difference or 0):.2g} % | {_origin(file)} | {memory} |\n"
        )


def _line_rows(files: dict[str, MoleculeFile], catalogues: Path) -> Iterator[str]:
    for stem, file in files.items():
        if file.catalogue is None:
            continue
        off, seen = np.abs(residuals(file, catalogues)), file.catalogue
        rms, median, worst = np.sqrt(np.mean(off**2)), np.median(off), off.max()
        k_max = "" if seen.k_max is None else seen.k_max
        yield f"| {stem} | {seen.tag} | {len(off)} | {seen.j_max} | {k_max} | {rms:.2g} | {median:.2g} | {worst:.2g} |\n"


def page(catalogues: Path) -> str:
    """The text of docs/library.md."""
    paths = sorted(folders()[-1].glob("*.toml"), key=lambda path: path.stem.casefold())
    files = {path.stem: read_molecule_file(path) for path in paths}
    return HEAD + "".join(_rows(files)) + LINES_HEAD + "".join(_line_rows(files, catalogues))


if __name__ == "__main__":
    sys.stdout.reconfigure(encoding="utf-8")  # type: ignore[union-attr]
    print(page(Path(sys.argv[1])), end="")
