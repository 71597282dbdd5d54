"""Compiled forces between molecules: sites are placed from atoms, pairs summed eight at a time, forces transferred to the atoms.

The neighbours of a molecule are first gathered into a flat array of runs of LANES numbers (x y z and force of each of their sites). The
distance between runs is a compile-time constant, so that the compiler can prove that they do not overlap and treats eight neighbours per
instruction; the cutoff is a mask, not a branch. Each pair is visited once (Newton's third law), and each thread has a separate array of
forces.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.fluids.forces.assembly import Integers
from rotor.kernels import kernel

LANES = 128
RUNS = 6  # x y z and force of a neighbour's site
FAR = 1e6  # Å: position of padding lanes
BITS, MASK = np.uint64(7), np.uint64(127)  # an entry of the list is 128 * molecule + code of its image
ONE, TWO = np.uint64(1), np.uint64(2)
ERFC = (
    1.2811636979448175, -0.055458415747475065, -0.09234223975654644, 0.11430594538064734, -0.07733392867213719,
    0.03669367051858509, -0.012636095691085234, 0.0029892246826299807, -0.00036982052040914534,
    -2.8596006341567566e-05, 1.9450115191334703e-05, -1.5392355353510548e-06, -6.803333019904514e-07,
    1.2439395444016415e-07, 2.5524391631352498e-08, -6.8008833385807295e-09, -1.198040436474614e-09,
    2.8306553005056336e-10, 5.576687295531988e-11,
)  # fmt: skip
FAST = {"reassoc", "contract", "nsz", "arcp"}  # sums may be taken by eights; inf and nan keep their meaning


@kernel(error_model="numpy", nogil=True)
def place_sites(
    positions: Floats, first_atom: Integers, first_site: Integers, kinds: Integers, weights: Floats, atoms: Integers, counts: Integers,
    box: Floats, reference: Floats, fresh: bool, sites: Floats, local: Floats, centres: Floats,
) -> float:  # fmt: skip
    """Place all molecules near their reference centres (fresh: in the cell); return the largest squared move of a centre.

    local: sites seen from their molecule's centre. weights[kind] has a row for each site and a last one for the centre. box
    is 0 along directions that do not repeat.
    """
    farthest, u = 0.0, np.zeros((weights.shape[2], 3))
    for m in range(len(kinds)):
        kind, start = kinds[m], first_atom[m]
        rows = counts[kind]
        for c in range(3):
            inverse = 1.0 / box[c] if box[c] > 0.0 else 0.0
            origin, middle = positions[start, c], 0.0
            for a in range(atoms[kind]):
                u[a, c] = positions[start + a, c] - origin
                u[a, c] -= box[c] * np.rint(u[a, c] * inverse)
                middle += weights[kind, rows, a] * u[a, c]
            centre = origin + middle
            turns = np.floor(centre * inverse) if fresh else np.rint((centre - reference[m, c]) * inverse)
            origin -= box[c] * turns
            centres[m, c] = centre - box[c] * turns
            for s in range(rows):
                place = 0.0
                for a in range(atoms[kind]):
                    place += weights[kind, s, a] * u[a, c]
                sites[first_site[m] + s, c] = origin + place
                local[first_site[m] + s, c] = place - middle
        if not fresh:
            move = 0.0
            for c in range(3):
                move += (centres[m, c] - reference[m, c]) ** 2
            farthest = max(farthest, move)
    return farthest


@kernel(error_model="numpy", nogil=True)
def carry_to_atoms(
    forces: Floats,
    first_atom: Integers,
    first_site: Integers,
    kinds: Integers,
    weights: Floats,
    atoms: Integers,
    counts: Integers,
    out: Floats,
) -> None:
    """Transfer forces on sites to the real atoms with the weights that place the sites; conserves force and torque."""
    out[:] = 0.0
    for m in range(len(kinds)):
        kind = kinds[m]
        for s in range(counts[kind]):
            for a in range(atoms[kind]):
                w = weights[kind, s, a]
                for c in range(3):
                    out[first_atom[m] + a, c] += w * forces[first_site[m] + s, c]


@kernel(error_model="numpy", nogil=True)
def mass_centres(sites: Floats, first_atom: Integers, first_site: Integers, masses: Floats, centres: Floats) -> None:
    """Centres of mass; the real atoms of a molecule are the first of its sites."""
    for m in range(len(centres)):
        total, x, y, z = 0.0, 0.0, 0.0, 0.0
        for a in range(first_atom[m + 1] - first_atom[m]):
            mass, site = masses[first_atom[m] + a], first_site[m] + a
            total += mass
            x += mass * sites[site, 0]
            y += mass * sites[site, 1]
            z += mass * sites[site, 2]
        centres[m, 0], centres[m, 1], centres[m, 2] = x / total, y / total, z / total


@kernel(error_model="numpy", nogil=True)
def lever_tensor(forces: Floats, arms_to: Floats, arms_from: Floats, first_site: Integers, by_molecule: bool) -> Floats:
    """Σ F ⊗ (to - from) over sites or, by_molecule, over molecules with their total force: (3, 3), not symmetric."""
    tensor = np.zeros((3, 3))
    for m in range(len(first_site) - 1):
        total = np.zeros(3)
        for s in range(first_site[m], first_site[m + 1]):
            for c in range(3):
                total[c] += forces[s, c]
                if not by_molecule:
                    for d in range(3):
                        tensor[c, d] += forces[s, c] * (arms_to[s, d] - arms_from[m, d])
        if by_molecule:
            for c in range(3):
                for d in range(3):
                    tensor[c, d] += total[c] * (arms_to[m, d] - arms_from[m, d])
    return tensor


@kernel(inline="always", error_model="numpy", fastmath=FAST)
def _over_neighbours(pair: Any, row: Any, n: int, x: float, y: float, z: float, strength: Any, form: Any) -> Any:
    """Force on a site and energy with all neighbours, whose forces are added in `row`.

    pair(r², strength, form) is -U'/r and U; form begins with the squared cutoff.
    """
    fx, fy, fz, energy = 0.0, 0.0, 0.0, 0.0
    for k in range(n):
        dx, dy, dz = row[k] - x, row[LANES + k] - y, row[2 * LANES + k] - z
        square = dx * dx + dy * dy + dz * dz
        g, u = pair(square, strength, form)
        g = g if square < form[0] else 0.0
        energy += u if square < form[0] else 0.0
        gx, gy, gz = g * dx, g * dy, g * dz
        fx -= gx
        fy -= gy
        fz -= gz
        row[3 * LANES + k] += gx
        row[4 * LANES + k] += gy
        row[5 * LANES + k] += gz
    return fx, fy, fz, energy


@kernel(inline="always", error_model="numpy", fastmath=FAST)
def _lennard_jones_pair(square: Any, strength: Any, cut: Any) -> Any:
    c12, c6 = strength
    _, begin, slope = cut
    inverse = 1.0 / square
    six = inverse * inverse * inverse
    attraction, repulsion = c6 * six, c12 * six * six
    root = np.sqrt(square)
    t = (root - begin) * slope
    t = t if t > 0.0 else 0.0
    t = t if t < 1.0 else 1.0
    switch = 1.0 - t * t * t * (10.0 - t * (15.0 - 6.0 * t))
    fall = 30.0 * t * t * (1.0 - t) * (1.0 - t) * slope
    bare = repulsion - attraction
    return switch * (12.0 * repulsion - 6.0 * attraction) * inverse + fall * bare * root * inverse, switch * bare


@kernel(error_model="numpy", fastmath=FAST)
def _lennard_jones(row: Floats, n: int, x: float, y: float, z: float, c12: float, c6: float, cut: Floats) -> Any:
    """S(r) (c12/r¹² - c6/r⁶), S = 1 - t³ (10 - 15 t + 6 t²), t = (r - r_s)/(r_c - r_s) clamped to 0..1; cut = r_c², r_s, 1/(r_c - r_s)."""
    return _over_neighbours(_lennard_jones_pair, row, n, x, y, z, (c12, c6), (cut[0], cut[1], cut[2]))


@kernel(inline="always", error_model="numpy", fastmath=FAST)
def _reaction_field_pair(square: Any, qq: Any, field: Any) -> Any:
    _, k, c = field
    inverse = 1.0 / np.sqrt(square)
    return qq * (inverse * inverse * inverse - 2.0 * k), qq * (inverse + k * square - c)


@kernel(error_model="numpy", fastmath=FAST)
def _reaction_field(row: Floats, n: int, x: float, y: float, z: float, qq: float, field: Floats) -> Any:
    """qq (1/r + k r² - c); field = r_c², k, c."""
    return _over_neighbours(_reaction_field_pair, row, n, x, y, z, qq, (field[0], field[1], field[2]))


@kernel(inline="always", error_model="numpy", fastmath=FAST)
def gauss_and_erfc(x: Any) -> Any:
    """exp(-x²) and erfc(x) for 0 <= x <= 7, relative errors 2e-14.

    (1 + 2x) exp(x²) erfc(x) is a polynomial in 43x/14(x + 3.75) - 1, the map of M. M. Shepherd, J. G. Laframboise, Math. Comp.
    36, 249 (1981); coefficients from Chebyshev interpolation with 50 digits. exp(-x²) is the 64th power of a Taylor sum.
    """
    w = x * x * (-1.0 / 64.0)
    high = 1.0 / 3628800.0 + w * (1.0 / 39916800.0 + w * (1.0 / 479001600.0 + w * (1.0 / 6227020800.0)))
    middle = 1.0 / 720.0 + w * (1.0 / 5040.0 + w * (1.0 / 40320.0 + w * (1.0 / 362880.0 + w * high)))
    g = 1.0 + w * (1.0 + w * (0.5 + w * (1.0 / 6.0 + w * (1.0 / 24.0 + w * (1.0 / 120.0 + w * middle)))))
    g = g * g
    g = g * g
    g = g * g
    g = g * g
    g = g * g
    g = g * g
    over = 1.0 / ((x + 3.75) * (1.0 + 2.0 * x))
    u = (43.0 / 14.0) * x * (1.0 + 2.0 * x) * over - 1.0
    p = ERFC[18]
    p = p * u + ERFC[17]
    p = p * u + ERFC[16]
    p = p * u + ERFC[15]
    p = p * u + ERFC[14]
    p = p * u + ERFC[13]
    p = p * u + ERFC[12]
    p = p * u + ERFC[11]
    p = p * u + ERFC[10]
    p = p * u + ERFC[9]
    p = p * u + ERFC[8]
    p = p * u + ERFC[7]
    p = p * u + ERFC[6]
    p = p * u + ERFC[5]
    p = p * u + ERFC[4]
    p = p * u + ERFC[3]
    p = p * u + ERFC[2]
    p = p * u + ERFC[1]
    p = p * u + ERFC[0]
    return g, g * p * (x + 3.75) * over


@kernel(inline="always", error_model="numpy", fastmath=FAST)
def _screened_pair(square: Any, qq: Any, field: Any) -> Any:
    _, b, c, alpha, slope, cutoff = field
    inverse = 1.0 / np.sqrt(square)
    distance = square * inverse
    gauss, screen = gauss_and_erfc(alpha * distance)
    force = ((screen * inverse + slope * gauss) * inverse - b) * inverse
    return qq * force, qq * (screen * inverse - c + b * (distance - cutoff))


@kernel(error_model="numpy", fastmath=FAST)
def _screened(row: Floats, n: int, x: float, y: float, z: float, qq: float, field: Floats) -> Any:
    """qq [erfc(αr)/r - c + b (r - r_c)]; field = r_c², b, c, α, 2α/√π, r_c; b = c = 0 is Ewald's part in real space."""
    form = (field[0], field[1], field[2], field[3], field[4], field[5])
    return _over_neighbours(_screened_pair, row, n, x, y, z, qq, form)


@kernel(inline="always", error_model="numpy")
def _collect(
    entries: Integers, at: int, stop: int, images: Floats, centres: Floats, m: int, reach2: float, first: Integers, base: Integers,
    arms: Floats,
) -> Any:  # fmt: skip
    """Neighbours of m whose spheres are within reach: where their sites begin, their centres seen from m's in three runs."""
    n = 0
    x, y, z = centres[m, 0], centres[m, 1], centres[m, 2]
    while at < stop and n < LANES:
        entry = entries[at]
        j, code = entry >> BITS, entry & MASK
        dx = centres[j, 0] + images[code, 0] - x
        dy = centres[j, 1] + images[code, 1] - y
        dz = centres[j, 2] + images[code, 2] - z
        base[n] = first[j]
        arms[n], arms[LANES + n], arms[2 * LANES + n] = dx, dy, dz
        n += 1 if dx * dx + dy * dy + dz * dz < reach2 else 0
        at += 1
    return n, at


@kernel(error_model="numpy", fastmath=FAST)
def _add_virial(arms: Floats, rows: Floats, sites: int, n: int, totals: Floats) -> None:
    """Σ F ⊗ d over neighbours, symmetric part in the order xx yy zz yz xz xy."""
    for s in range(sites):
        row = rows[s * RUNS * LANES : (s + 1) * RUNS * LANES]
        xx, yy, zz, yz, xz, xy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(n):
            fx, fy, fz = row[3 * LANES + k], row[4 * LANES + k], row[5 * LANES + k]
            x, y, z = arms[k], arms[LANES + k], arms[2 * LANES + k]
            xx += fx * x
            yy += fy * y
            zz += fz * z
            yz += fy * z + fz * y
            xz += fx * z + fz * x
            xy += fx * y + fy * x
        totals[2] += xx
        totals[3] += yy
        totals[4] += zz
        totals[5] += 0.5 * yz
        totals[6] += 0.5 * xz
        totals[7] += 0.5 * xy


@kernel(error_model="numpy")
def _gather(rows: Floats, local: Floats, base: Integers, arms: Floats, count: int, n: int, padded: int) -> None:
    """Sites of the neighbours relative to the centre of this molecule; forces 0; padding lanes up to `padded` far away."""
    for s in range(count):
        row = rows[s * RUNS * LANES : (s + 1) * RUNS * LANES]
        step = np.uint64(3 * s)
        for k in range(n):
            at = base[k] + step
            row[k] = local[at] + arms[k]
            row[LANES + k] = local[at + ONE] + arms[LANES + k]
            row[2 * LANES + k] = local[at + TWO] + arms[2 * LANES + k]
        for k in range(n, padded):
            row[k], row[LANES + k], row[2 * LANES + k] = FAR, FAR, FAR
        for k in range(padded):
            row[3 * LANES + k], row[4 * LANES + k], row[5 * LANES + k] = 0.0, 0.0, 0.0


@kernel(error_model="numpy")
def _scatter(rows: Floats, forces: Floats, base: Integers, count: int, n: int) -> None:
    for s in range(count):
        row = rows[s * RUNS * LANES : (s + 1) * RUNS * LANES]
        step = np.uint64(3 * s)
        for k in range(n):
            at = base[k] + step
            forces[at] += row[3 * LANES + k]
            forces[at + ONE] += row[4 * LANES + k]
            forces[at + TWO] += row[5 * LANES + k]


@kernel(error_model="numpy")
def _site_pairs(
    rows: Floats, padded: int, local: Floats, mine: Integers, pairs: Integers, numbers: Floats, cut: Floats, field: Floats,
    screened: bool, forces: Floats, totals: Floats,
) -> None:  # fmt: skip
    """All pairs of sites between a molecule, with sites from `mine` on, and its gathered neighbours."""
    for p in range(len(pairs)):
        at = 3 * (mine + pairs[p, 0])
        row = rows[pairs[p, 1] * RUNS * LANES : (pairs[p, 1] + 1) * RUNS * LANES]
        x, y, z = local[at], local[at + 1], local[at + 2]
        qq, c12, c6 = numbers[p, 0], numbers[p, 1], numbers[p, 2]
        if c12 > 0.0:
            fx, fy, fz, energy = _lennard_jones(row, padded, x, y, z, c12, c6, cut)
            totals[0] += energy
            forces[at] += fx
            forces[at + 1] += fy
            forces[at + 2] += fz
        if qq != 0.0:
            if screened:
                fx, fy, fz, energy = _screened(row, padded, x, y, z, qq, field)
            else:
                fx, fy, fz, energy = _reaction_field(row, padded, x, y, z, qq, field)
            totals[1] += energy
            forces[at] += fx
            forces[at + 1] += fy
            forces[at + 2] += fz


@kernel(error_model="numpy", nogil=True)
def pair_forces(
    first: int, last: int, starts: Integers, entries: Integers, images: Floats, reach2: Floats,
    local: Floats, centres: Floats, first_site: Integers, kinds: Integers, counts: Integers,
    pair_starts: Integers, pair_sites: Integers, pair_numbers: Floats, cut: Floats, field: Floats, screened: bool,
    forces: Floats, totals: Floats,
) -> None:  # fmt: skip
    """Add forces on sites, energies and virial of the pairs in the lists of molecules first to last - 1.

    local and forces are flat, three numbers a site. starts has, for each molecule, the bounds of its neighbours by kind.
    pair_sites (pairs, 2) and pair_numbers (pairs, 3: qq, c12, c6) belong to two kinds between pair_starts. totals: energies of
    dispersion and of charges, Σ F ⊗ d (6) with d between centres of the lists.
    """
    species = len(counts)
    most = 0
    for count in counts:
        most = max(most, count)
    rows, arms = np.empty(most * RUNS * LANES), np.empty(3 * LANES)
    base, begins = np.empty(LANES, dtype=np.uint64), np.empty(len(first_site), dtype=np.uint64)
    for m in range(len(first_site)):
        begins[m] = np.uint64(3 * first_site[m])
    for m in range(first, last):
        for other in range(species):
            pair = kinds[m] * species + other
            pairs = pair_sites[pair_starts[pair] : pair_starts[pair + 1]]
            numbers = pair_numbers[pair_starts[pair] : pair_starts[pair + 1]]
            at, stop = starts[m * species + other], starts[m * species + other + 1]
            while at < stop:
                n, at = _collect(entries, at, stop, images, centres, m, reach2[pair], begins, base, arms)
                padded = (n + 7) // 8 * 8
                _gather(rows, local, base, arms, counts[other], n, padded)
                _site_pairs(rows, padded, local, first_site[m], pairs, numbers, cut, field, screened, forces, totals)
                _scatter(rows, forces, base, counts[other], n)
                _add_virial(arms, rows, counts[other], n, totals)
