"""Compiled forms of the plain functions that several kernels of classical motion share.

The source of each is the plain function named; nothing is written a second time. Kernels are cached on disk by the date
of their own file: after a change of a plain function remove the caches (CONTRIBUTING.md says how).
"""

from __future__ import annotations

from rotor.classical.integrators import strang
from rotor.geometry import error_free
from rotor.geometry._kernels import inlined

halves = inlined(error_free.halves)
two_sum = inlined(error_free.two_sum)
two_square = inlined(error_free.two_square, halves=halves)
two_product = inlined(error_free.two_product, halves=halves)

remainders = inlined(strang.remainders)
symmetric_steps = inlined(strang.symmetric_steps)
