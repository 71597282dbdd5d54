"""Nuclear-spin weights of levels by their quantum numbers, summed over the components of each row."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Ints
from rotor.tops.spins.spin_weights import SpinWeights

Quanta = Mapping[str, NDArray[Any]]


def weights_of_quanta(kind: str, quanta: Quanta, weights: SpinWeights) -> Ints:
    """Spin weights of the levels of a top of this kind.

    Beside a total spin I of two nuclei the weights are those of even I; levels of odd I have those of the other class.

    >>> weights_of_quanta("linear", {"j": np.arange(3)}, SpinWeights.from_mapping({"even": 1, "odd": 3})).tolist()
    [1, 3, 1]
    """
    if "i_tot" in quanta and "i_sym" not in quanta and weights.rule != "none":
        even, odd = (_rotational_weights(kind, quanta, rule) for rule in (weights, weights.exchanged()))
        return np.where(quanta["i_tot"] % 2 == 0, even, odd)
    return _rotational_weights(kind, quanta, weights)


def _rotational_weights(kind: str, quanta: Quanta, weights: SpinWeights) -> Ints:
    """By the rotational quantum numbers alone."""
    if "irrep" in quanta:
        weight_of = {name: weights.irrep_weight(name) for name in np.unique(quanta["irrep"]).tolist()}
        return np.array([weight_of[name] for name in quanta["irrep"].tolist()], dtype=np.int64)
    j = np.asarray(quanta["n" if "n" in quanta else "j"])
    if "kc" in quanta:
        return _asymmetric_weights(kind, j, quanta["ka"], quanta["kc"], weights)
    if "k" in quanta:
        return weights.symmetric_weights(j, np.abs(quanta["k"]), oblate=kind == "oblate")
    return weights.spherical_weights(j) if kind == "spherical" else weights.linear_weights(j)


def _asymmetric_weights(kind: str, j: Ints, ka: Ints, kc: Ints, weights: SpinWeights) -> Ints:
    """By parities of (Ka, Kc); a symmetric top whose ±K are split has weights by K, one component each.

    Of a pair with K a multiple of n, 0even and 0odd go by the parity of the other label, which is J where K = 0: a half turn about
    an axis across the main one distinguishes the two components of the pair.
    """
    if kind in ("prolate", "oblate") and weights.rule == "K":
        k, other = (kc, ka) if kind == "oblate" else (ka, kc)
        # of K = 0, whose other label is J
        at_zero = np.array([weights.symmetric_weights(number, 0) for number in (0, 1)])
        both = weights.symmetric_weights(j, k, oblate=kind == "oblate") // np.where(k == 0, 1, 2)
        return np.where(k % weights.modulus == 0, at_zero[other % 2], both)
    by_parity = np.array([[weights.asymmetric_weight(a + c) for c in "eo"] for a in "eo"], dtype=np.int64)
    return np.asarray(by_parity[ka % 2, kc % 2])
