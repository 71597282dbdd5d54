"""Compiled lists of neighbouring molecules: bins of half the list's range, every image met once, in time O(N)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from rotor.rotations import Array

IMAGES = 2  # a neighbour is at most that many cells away
CODES = 128  # 5 x 5 x 5 images and room


@njit(cache=True)
def _bins_of(centres: Array, low: Array, width: Array, bins: Array) -> Any:
    """Bin of each centre (3 numbers), and the molecules sorted by bin with the starts of the bins."""
    n = len(centres)
    places = np.empty((n, 3), dtype=np.int64)
    starts = np.zeros(bins[0] * bins[1] * bins[2] + 1, dtype=np.int64)
    for m in range(n):
        for c in range(3):
            places[m, c] = min(max(int((centres[m, c] - low[c]) / width[c]), 0), bins[c] - 1)
        starts[(places[m, 0] * bins[1] + places[m, 1]) * bins[2] + places[m, 2] + 1] += 1
    starts = np.cumsum(starts)
    fill, order = starts.copy(), np.empty(n, dtype=np.int64)
    for m in range(n):
        cell = (places[m, 0] * bins[1] + places[m, 1]) * bins[2] + places[m, 2]
        order[fill[cell]] = m
        fill[cell] += 1
    return places, starts, order


@njit(cache=True)
def _gap(place: float, low: float, width: float) -> float:
    """Distance of a point from an interval."""
    return max(low - place, place - low - width, 0.0)


@njit(cache=True)
def _first_half(i: int, j: int, code: int) -> bool:
    """Whether the pair stands in i's list: shared out evenly; a molecule and its own image once."""
    if i == j:
        return code > CODES // 2 - 2  # the code of no shift is 62
    return (i < j) == ((i + j) % 2 == 1)


@njit(cache=True)
def neighbour_list(centres: Array, box: Array, low: Array, width: Array, bins: Array, kinds: Array, ranges: Array) -> Any:
    """Starts (n x kinds + 1) and entries (128 molecule + code of the image) of all pairs nearer than the range of their kinds.

    box is 0 along directions that do not repeat; low, width, bins (3) divide the cell or the space that holds the molecules.
    """
    n, species = len(centres), len(ranges)
    farthest = np.max(ranges)
    places, first, order = _bins_of(centres, low, width, bins)
    steps = np.array([int(np.ceil(farthest / width[c])) for c in range(3)])
    starts = np.zeros(n * species + 1, dtype=np.int64)
    entries, mine = np.empty(n * 64 + 1024, dtype=np.uint64), np.empty(1024, dtype=np.int64)
    used = 0
    for i in range(n):
        found = 0
        for raw_x in range(places[i, 0] - steps[0], places[i, 0] + steps[0] + 1):
            gap_x = _gap(centres[i, 0], low[0] + raw_x * width[0], width[0])
            image_x = raw_x // bins[0]
            if (box[0] == 0.0 and image_x != 0) or abs(image_x) > IMAGES or gap_x > farthest:
                continue
            for raw_y in range(places[i, 1] - steps[1], places[i, 1] + steps[1] + 1):
                gap_y = _gap(centres[i, 1], low[1] + raw_y * width[1], width[1])
                image_y = raw_y // bins[1]
                if (box[1] == 0.0 and image_y != 0) or abs(image_y) > IMAGES or gap_x**2 + gap_y**2 > farthest**2:
                    continue
                for raw_z in range(places[i, 2] - steps[2], places[i, 2] + steps[2] + 1):
                    gap_z = _gap(centres[i, 2], low[2] + raw_z * width[2], width[2])
                    image_z = raw_z // bins[2]
                    if (box[2] == 0.0 and image_z != 0) or abs(image_z) > IMAGES:
                        continue
                    if gap_x**2 + gap_y**2 + gap_z**2 > farthest**2:
                        continue
                    code = ((image_x + IMAGES) * 5 + image_y + IMAGES) * 5 + image_z + IMAGES
                    cell = ((raw_x - image_x * bins[0]) * bins[1] + raw_y - image_y * bins[1]) * bins[2] + raw_z - image_z * bins[2]
                    x = centres[i, 0] - image_x * box[0]
                    y = centres[i, 1] - image_y * box[1]
                    z = centres[i, 2] - image_z * box[2]
                    if found + first[cell + 1] - first[cell] > len(mine):
                        mine = np.concatenate((mine, np.empty(len(mine) + n, dtype=np.int64)))
                    for p in range(first[cell], first[cell + 1]):
                        j = order[p]
                        square = (centres[j, 0] - x) ** 2 + (centres[j, 1] - y) ** 2 + (centres[j, 2] - z) ** 2
                        if square < ranges[kinds[i], kinds[j]] ** 2 and _first_half(i, j, code):
                            mine[found] = j * CODES + code
                            found += 1
        if used + found > len(entries):
            entries = np.concatenate((entries, np.empty(len(entries) + found, dtype=np.uint64)))
        for kind in range(species):
            for p in range(found):
                if kinds[mine[p] // CODES] == kind:
                    entries[used] = mine[p]
                    used += 1
            starts[i * species + kind + 1] = used
    return starts, entries[:used]
