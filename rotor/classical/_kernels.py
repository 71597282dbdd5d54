"""Compiled forms of the plain functions that several kernels of classical motion share.

Each is compiled from the plain function of the same name, so that no formula is written twice.
"""

from __future__ import annotations

from rotor.classical.integrators import strang
from rotor.geometry import error_free
from rotor.kernels import inlined

halves = inlined(error_free.halves)
two_sum = inlined(error_free.two_sum)
two_square = inlined(error_free.two_square, halves=halves)
two_product = inlined(error_free.two_product, halves=halves)

remainders = inlined(strang.remainders)
symmetric_steps = inlined(strang.symmetric_steps)
