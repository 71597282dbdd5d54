"""Compiled sums over wave vectors (Ewald): charges in blocks of LANES, phases turned from one wave vector to the next.

Wave vectors stand in columns of equal (nx, ny); along a column e^{ik·r} is turned by e^{±i 2π z/L} from one to the next. All
runs of a block sit at constant distances in one flat array, as in the kernels of pairs.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rotor.arrays import Floats
from rotor.fluids.forces._pair_kernels import FAST
from rotor.fluids.forces.assembly import Integers
from rotor.kernels import kernel

LANES = 128
CHARGE, START_C, START_S, NOW_C, NOW_S, TURN_C, TURN_S, SUM, FX, FY, FZ, HEAD = range(12)


@kernel(error_model="numpy", nogil=True)
def unit_phases(sites: Floats, charged: Integers, waves: Floats) -> Floats:
    """cos and sin of 2πx/L, 2πy/L, 2πz/L of the charges, (n, 6)."""
    phases = np.empty((len(charged), 6))
    for k in range(len(charged)):
        for axis in range(3):
            phase = waves[axis] * sites[charged[k], axis]
            phases[k, 2 * axis], phases[k, 2 * axis + 1] = np.cos(phase), np.sin(phase)
    return phases


@kernel(error_model="numpy")
def _fill_block(block: Floats, phases: Floats, charges: Floats, first: int, highest: Integers) -> None:
    """Charges, the turn along z, and e^{2πi n x/L}, e^{2πi n y/L} for n = 0... of LANES charges; charge 0 beyond the last."""
    for k in range(LANES):
        here = first + k < len(charges)
        at = first + k if here else 0
        block[CHARGE * LANES + k] = charges[at] if here else 0.0
        for run in range(FX, HEAD):
            block[run * LANES + k] = 0.0
        block[TURN_C * LANES + k], block[TURN_S * LANES + k] = phases[at, 4], phases[at, 5]
        run = HEAD
        for axis in range(2):
            turn_c, turn_s, c, s = phases[at, 2 * axis], phases[at, 2 * axis + 1], 1.0, 0.0
            for _ in range(highest[axis] + 1):
                block[run * LANES + k], block[(run + 1) * LANES + k] = c, s
                c, s = c * turn_c - s * turn_s, c * turn_s + s * turn_c
                run += 2


@kernel(error_model="numpy")
def _start_column(block: Floats, nx: int, ny: int, highest: Integers) -> None:
    """e^{i(kx x + ky y)} of the block."""
    at_x = (HEAD + 2 * nx) * LANES
    at_y = (HEAD + 2 * (highest[0] + 1) + 2 * abs(ny)) * LANES
    sign = 1.0 if ny >= 0 else -1.0
    for k in range(LANES):
        cx, sx, cy, sy = block[at_x + k], block[at_x + LANES + k], block[at_y + k], sign * block[at_y + LANES + k]
        block[START_C * LANES + k] = cx * cy - sx * sy
        block[START_S * LANES + k] = cx * sy + sx * cy
        block[SUM * LANES + k] = 0.0


@kernel(error_model="numpy")
def _back_to_start(block: Floats) -> None:
    for k in range(LANES):
        block[NOW_C * LANES + k] = block[START_C * LANES + k]
        block[NOW_S * LANES + k] = block[START_S * LANES + k]


@kernel(error_model="numpy", fastmath=FAST)
def _sum_charges(block: Floats) -> Any:
    """Σ q e^{ik·r} of the block."""
    real, imaginary = 0.0, 0.0
    for k in range(LANES):
        real += block[CHARGE * LANES + k] * block[NOW_C * LANES + k]
        imaginary += block[CHARGE * LANES + k] * block[NOW_S * LANES + k]
    return real, imaginary


@kernel(error_model="numpy", fastmath=FAST)
def _turn_and_sum(block: Floats, sign: float) -> Any:
    """Turn the phases by e^{±i 2π z/L} to the next wave vector and sum."""
    real, imaginary = 0.0, 0.0
    for k in range(LANES):
        c, s = block[NOW_C * LANES + k], block[NOW_S * LANES + k]
        tc, ts = block[TURN_C * LANES + k], sign * block[TURN_S * LANES + k]
        further_c, further_s = c * tc - s * ts, c * ts + s * tc
        block[NOW_C * LANES + k], block[NOW_S * LANES + k] = further_c, further_s
        real += block[CHARGE * LANES + k] * further_c
        imaginary += block[CHARGE * LANES + k] * further_s
    return real, imaginary


@kernel(error_model="numpy", fastmath=FAST)
def _push(block: Floats, real: float, imaginary: float) -> None:
    """One wave vector's part of the force where kz = 0: sin(k·r) Re S - cos(k·r) Im S."""
    for k in range(LANES):
        block[SUM * LANES + k] += block[NOW_S * LANES + k] * real - block[NOW_C * LANES + k] * imaginary


@kernel(error_model="numpy", fastmath=FAST)
def _turn_and_push(block: Floats, sign: float, real: float, imaginary: float, kz: float) -> None:
    """Turn the phases to the next wave vector and add its forces, and those times kz."""
    for k in range(LANES):
        c, s = block[NOW_C * LANES + k], block[NOW_S * LANES + k]
        tc, ts = block[TURN_C * LANES + k], sign * block[TURN_S * LANES + k]
        further_c, further_s = c * tc - s * ts, c * ts + s * tc
        block[NOW_C * LANES + k], block[NOW_S * LANES + k] = further_c, further_s
        t = further_s * real - further_c * imaginary
        block[SUM * LANES + k] += t
        block[FZ * LANES + k] += kz * t


@kernel(error_model="numpy", fastmath=FAST)
def _end_column(block: Floats, kx: float, ky: float) -> None:
    for k in range(LANES):
        block[FX * LANES + k] += kx * block[SUM * LANES + k]
        block[FY * LANES + k] += ky * block[SUM * LANES + k]


@kernel(error_model="numpy", nogil=True)
def structure_factors(phases: Floats, charges: Floats, highest: Integers, columns: Integers, factors: Floats) -> None:
    """Add Σ q e^{ik·r} to factors (wave vectors, 2); phases from `unit_phases`.

    columns (n, 5): nx, ny, lowest nz, highest nz, place of the column's nz = 0 in the list of wave vectors (which may be one
    that is not there).
    """
    block = np.empty((HEAD + 2 * (highest[0] + highest[1] + 2)) * LANES)
    for first in range(0, len(charges), LANES):
        _fill_block(block, phases, charges, first, highest)
        for column in range(len(columns)):
            nx, ny, low, high, place = columns[column]
            _start_column(block, nx, ny, highest)
            if low <= 0:
                _back_to_start(block)
                real, imaginary = _sum_charges(block)
                factors[place, 0] += real
                factors[place, 1] += imaginary
            for sign, most in ((1, high), (-1, -low)):
                _back_to_start(block)
                for n in range(1, most + 1):
                    real, imaginary = _turn_and_sum(block, sign)
                    factors[place + sign * n, 0] += real
                    factors[place + sign * n, 1] += imaginary


@kernel(error_model="numpy", nogil=True)
def fourier_forces(
    phases: Floats,
    charged: Integers,
    charges: Floats,
    waves: Floats,
    highest: Integers,
    columns: Integers,
    factors: Floats,
    forces: Floats,
) -> None:
    """Add the forces of all wave vectors; factors are structure factors times 2 A(k)."""
    block = np.empty((HEAD + 2 * (highest[0] + highest[1] + 2)) * LANES)
    for first in range(0, len(charges), LANES):
        _fill_block(block, phases, charges, first, highest)
        for column in range(len(columns)):
            nx, ny, low, high, place = columns[column]
            _start_column(block, nx, ny, highest)
            if low <= 0:
                _back_to_start(block)
                _push(block, factors[place, 0], factors[place, 1])
            for sign, most in ((1, high), (-1, -low)):
                _back_to_start(block)
                for n in range(1, most + 1):
                    at = place + sign * n
                    _turn_and_push(block, sign, factors[at, 0], factors[at, 1], sign * n * waves[2])
            _end_column(block, nx * waves[0], ny * waves[1])
        for k in range(min(LANES, len(charges) - first)):
            for axis in range(3):
                forces[charged[first + k], axis] += charges[first + k] * block[(FX + axis) * LANES + k]


@kernel(error_model="numpy", nogil=True)
def inner_correction(
    sites: Floats, first_site: Integers, site_charges: Floats, alpha: float, coulomb: float, forces: Floats
) -> float:
    """Take the Gaussians' interaction inside molecules out again: -Σ qq erf(αr)/r; its forces are added, its energy returned."""
    energy = 0.0
    for m in range(len(first_site) - 1):
        for s in range(first_site[m], first_site[m + 1]):
            for t in range(s + 1, first_site[m + 1]):
                qq = coulomb * site_charges[s] * site_charges[t]
                if qq == 0.0:
                    continue
                x, y, z = sites[t, 0] - sites[s, 0], sites[t, 1] - sites[s, 1], sites[t, 2] - sites[s, 2]
                r = np.sqrt(x * x + y * y + z * z)
                screen = math.erf(alpha * r) / r
                energy -= qq * screen
                g = -qq * (screen - 2.0 * alpha / np.sqrt(np.pi) * np.exp(-((alpha * r) ** 2))) / (r * r)
                for c, d in enumerate((x, y, z)):
                    forces[t, c] += g * d
                    forces[s, c] -= g * d
    return energy
