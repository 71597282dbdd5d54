"""Compiled lists of neighbouring molecules from bins, with each pair listed once, in time O(N).

A pair is in the list of the molecule whose bin comes first (x, then y, then z; images are bins beyond the edge of the cell), within a
bin in the order of the bin. Images therefore need no special rule, not even images of the same molecule.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.fluids.forces.assembly import Integers
from rotor.kernels import kernel

IMAGES = 2  # largest distance of a neighbour in cells


@kernel()
def _sorted_into_bins(centres: Floats, low: Floats, width: Floats, bins: Integers) -> Any:
    """Bin of each centre (3 numbers), starts of the bins, molecules in the order of bins and the place of each in it."""
    n = len(centres)
    places, cells = np.empty((n, 3), dtype=np.int64), np.empty(n, dtype=np.int64)
    starts = np.zeros(bins[0] * bins[1] * bins[2] + 1, dtype=np.int64)
    for m in range(n):
        for c in range(3):
            places[m, c] = min(max(int((centres[m, c] - low[c]) / width[c]), 0), bins[c] - 1)
        cells[m] = (places[m, 0] * bins[1] + places[m, 1]) * bins[2] + places[m, 2]
        starts[cells[m] + 1] += 1
    for cell in range(1, len(starts)):
        starts[cell] += starts[cell - 1]
    fill, order, rank = starts.copy(), np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    for m in range(n):
        order[fill[cells[m]]] = m
        rank[m] = fill[cells[m]]
        fill[cells[m]] += 1
    return places, starts, order, rank


@kernel()
def _longer(array: Any, more: int) -> Any:
    """A copy of the list with free space at its end."""
    out = np.empty(len(array) + more, dtype=array.dtype)
    for i in range(len(array)):
        out[i] = array[i]
    return out


@kernel()
def _gap2(place: float, low: float, width: float) -> float:
    """Squared distance of a point from an interval."""
    return max(low - place, place - low - width, 0.0) ** 2


@kernel()
def _image(raw: int, bins: int, box: float) -> int:
    """The cell of a bin relative to the central one; out of range (IMAGES + 1) beyond the edge without periodicity."""
    image = raw // bins
    return IMAGES + 1 if box == 0.0 and image != 0 else image


@kernel(error_model="numpy")
def _keep_near(
    sorted_centres: Floats, order: Integers, start: int, stop: int, x: float, y: float, z: float, range2: float, code: int, count: int,
    mine: Integers,
) -> int:  # fmt: skip
    """Append the molecules from start to stop that are in range of (x, y, z); return the new count."""
    for p in range(start, stop):
        dx, dy, dz = sorted_centres[p, 0] - x, sorted_centres[p, 1] - y, sorted_centres[p, 2] - z
        mine[count] = order[p] * 128 + code
        count += 1 if dx * dx + dy * dy + dz * dz < range2 else 0
    return count


@kernel(error_model="numpy")
def _along_column(
    m: int, raw_x: int, raw_y: int, left: float, same_column: bool, rank: int, places: Integers, starts: Integers, sorted_centres: Floats,
    order: Integers, here: Floats, box: Floats, low: Floats, width: Floats, bins: Integers, range2: float, count: int,
    mine: Integers,
) -> Any:  # fmt: skip
    """Neighbours of m in a column of bins along z, within √left of it there; own: the column of m, from m upwards."""
    image_x, image_y = raw_x // bins[0], raw_y // bins[1]
    column = ((raw_x - image_x * bins[0]) * bins[1] + raw_y - image_y * bins[1]) * bins[2]
    reach = np.sqrt(left)
    bottom = int(np.floor((here[2] - reach - low[2]) / width[2]))
    top = int(np.floor((here[2] + reach - low[2]) / width[2]))
    bottom = max(bottom, places[m, 2]) if same_column else bottom
    for image_z in range(-IMAGES, IMAGES + 1):
        first, last = max(bottom, image_z * bins[2]), min(top, image_z * bins[2] + bins[2] - 1)
        if first > last or (box[2] == 0.0 and image_z != 0):
            continue
        start, stop = starts[column + first - image_z * bins[2]], starts[column + last - image_z * bins[2] + 1]
        start = rank + 1 if same_column and image_z == 0 else start
        if count + stop - start > len(mine):
            mine = _longer(mine, len(mine) + stop - start)
        x, y, z = here[0] - image_x * box[0], here[1] - image_y * box[1], here[2] - image_z * box[2]
        code = ((image_x + IMAGES) * 5 + image_y + IMAGES) * 5 + image_z + IMAGES
        count = _keep_near(sorted_centres, order, start, stop, x, y, z, range2, code, count, mine)
    return count, mine


@kernel()
def _by_kind(
    mine: Integers, count: int, kinds: Integers, species: int, entries: Integers, used: int, starts: Integers
) -> int:
    """Append a molecule's list to the others, sorted by kind, and record where each kind ends."""
    for kind in range(species):
        for p in range(count):
            if species == 1 or kinds[mine[p] // 128] == kind:
                entries[used] = mine[p]
                used += 1
        starts[kind] = used
    return used


@kernel(error_model="numpy")
def neighbour_list(
    centres: Floats,
    box: Floats,
    low: Floats,
    width: Floats,
    bins: Integers,
    kinds: Integers,
    species: int,
    farthest: float,
) -> Any:
    """Starts (n x kinds + 1) and entries (128 molecule + code of the image) of all pairs closer than `farthest`.

    box is 0 along directions that do not repeat; low, width, bins (3) divide the cell or the space that holds the molecules.
    """
    n, range2 = len(centres), farthest**2
    # a literal 0 has a type of its own, for which the functions called are compiled once more
    nothing: Any = np.int64(0)
    places, first, order, rank = _sorted_into_bins(centres, low, width, bins)
    sorted_centres = np.empty((n, 3))
    for p in range(n):
        for c in range(3):
            sorted_centres[p, c] = centres[order[p], c]
    steps_x, steps_y = int(np.ceil(farthest / width[0])), int(np.ceil(farthest / width[1]))
    starts = np.zeros(n * species + 1, dtype=np.int64)
    entries, mine, used = np.empty(n * 64 + 1024, dtype=np.uint64), np.empty(1024, dtype=np.int64), nothing
    for m in range(n):
        count, here = nothing, centres[m]
        for raw_x in range(places[m, 0], places[m, 0] + steps_x + 1):
            gap_x = _gap2(here[0], low[0] + raw_x * width[0], width[0])
            if abs(_image(raw_x, bins[0], box[0])) > IMAGES or gap_x > range2:
                continue
            ahead = raw_x > places[m, 0]
            for raw_y in range(places[m, 1] - steps_y if ahead else places[m, 1], places[m, 1] + steps_y + 1):
                left = range2 - gap_x - _gap2(here[1], low[1] + raw_y * width[1], width[1])
                if abs(_image(raw_y, bins[1], box[1])) > IMAGES or left < 0.0:
                    continue
                count, mine = _along_column(
                    m, raw_x, raw_y, left, not ahead and raw_y == places[m, 1], rank[m], places, first, sorted_centres, order, here,
                    box, low, width, bins, range2, count, mine,
                )  # fmt: skip
        if used + count > len(entries):
            entries = _longer(entries, len(entries) + count)
        used = _by_kind(mine, count, kinds, species, entries, used, starts[m * species + 1 : (m + 1) * species + 1])
    return starts, entries[:used]


@kernel(error_model="numpy")
def closest_atoms(
    starts: Integers, entries: Integers, images: Floats, centres: Floats, sites: Floats, first_site: Integers, first_atom: Integers,
    within2: float,
) -> Any:  # fmt: skip
    """Squared distance and numbers of the nearest atoms of listed molecules with centres within √within2; -1 if there are none.

    starts: where each molecule's list begins. The real atoms of a molecule are the first of its sites.
    """
    best, first, other = np.inf, -1, -1
    for i in range(len(centres)):
        for p in range(starts[i], starts[i + 1]):
            entry = np.int64(entries[p])
            j, image = entry >> 7, images[entry & 127]
            x = centres[j, 0] + image[0] - centres[i, 0]
            y = centres[j, 1] + image[1] - centres[i, 1]
            z = centres[j, 2] + image[2] - centres[i, 2]
            if x * x + y * y + z * z >= within2:
                continue
            for a in range(first_atom[i + 1] - first_atom[i]):
                for b in range(first_atom[j + 1] - first_atom[j]):
                    square = np.sum((sites[first_site[j] + b] + image - sites[first_site[i] + a]) ** 2)
                    if square < best:
                        best, first, other = square, first_atom[i] + a, first_atom[j] + b
    return best, first, other
