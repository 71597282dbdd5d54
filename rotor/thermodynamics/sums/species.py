"""Nuclear-spin species: conversion between them is so slow that each behaves as a separate gas.

The species are the classes of spin weights that radiation and collisions do not mix: even and odd J (H2), even and odd Ka + Kc
(H2O), K a multiple of 3 or not (NH3), the irreps A, E and F (CH4). If there are two, the species of larger weight is called ortho
(G. Herzberg, Molecular Spectra and Molecular Structure I, section III,2f).
"""

from __future__ import annotations

from dataclasses import replace

from rotor.tops.spins.spin_weights import SpinWeights

_PAIRS = ((("ee", "oo"), ("eo", "oe")), (("ee", "eo"), ("oe", "oo")), (("ee", "oe"), ("eo", "oo")))


def spin_species(weights: SpinWeights) -> dict[str, SpinWeights]:
    """The spin weights of each nuclear-spin species by name, 0 for all other classes.

    Two species are named para and ortho; more have the names of their classes. If all levels belong to one species, the only
    entry is "all". Common divisors are not removed, so the weights of the species add up to the input.

    >>> {name: one.values for name, one in spin_species(SpinWeights.from_mapping({"even": 1, "odd": 3})).items()}
    {'para': (1, 0), 'ortho': (0, 3)}
    >>> list(spin_species(SpinWeights.from_mapping({"A": 5, "E": 2, "F": 3})))
    ['A', 'E', 'F']
    """
    groups = [group for group in _groups(weights) if any(_value(weights, name) for name in group)]
    if len(groups) < 2:
        return {"all": weights}
    heaviest = [max(_value(weights, name) for name in group) for group in groups]
    if len(groups) == 2 and heaviest[0] != heaviest[1]:
        para, ortho = (groups[i] for i in ((0, 1) if heaviest[0] < heaviest[1] else (1, 0)))
        return {"para": _only(weights, para), "ortho": _only(weights, ortho)}
    return {group[0]: _only(weights, group) for group in groups}


def _groups(weights: SpinWeights) -> list[tuple[str, ...]]:
    """Classes grouped by species: K with n - K, parities that a half turn does not separate; otherwise one class each."""
    if weights.rule == "K":
        return _by_k(weights)
    if weights.rule == "KaKc":
        for pair in _PAIRS:
            if all(len({_value(weights, name) for name in group}) == 1 for group in pair):
                return list(pair) if len(set(weights.values)) > 1 else [weights.classes]
    return [(name,) for name in weights.classes]


def _by_k(weights: SpinWeights) -> list[tuple[str, ...]]:
    zero = [name for name in weights.classes if name.startswith("0")]
    n = len(weights.classes) - len(zero) + 1
    pairs = [tuple(dict.fromkeys((str(k), str(n - k)))) for k in range(1, n // 2 + 1)]
    return [(name,) for name in zero] + pairs


def _value(weights: SpinWeights, name: str) -> int:
    return weights.values[weights.classes.index(name)]


def _only(weights: SpinWeights, names: tuple[str, ...]) -> SpinWeights:
    remaining = (value if name in names else 0 for name, value in zip(weights.classes, weights.values, strict=True))
    return replace(weights, values=tuple(remaining))


def weights_in_species(weights: SpinWeights, species: SpinWeights) -> SpinWeights:
    """The spin weights of a state, with 0 for classes outside the species.

    >>> state = SpinWeights.from_mapping({"0even": 0, "0odd": 4, "1": 1, "2": 1})
    >>> weights_in_species(state, SpinWeights("K", ("0", "1", "2"), (0, 1, 1))).values
    (0, 0, 1, 1)
    """
    if species.rule == "none":
        return weights
    if weights.rule != species.rule:
        raise ValueError(
            f"spin weights of a state follow the rule {weights.rule}, those of the molecule {species.rule}: expected the same rule"
        )
    weight_of_class = dict(zip(species.classes, species.values, strict=True))
    whole = {
        name: weight_of_class[name] if name in weight_of_class else weight_of_class["0"] for name in weights.classes
    }
    return _only(weights, tuple(name for name, value in whole.items() if value))


def implied_symmetry_number(weights: SpinWeights) -> int:
    """The symmetry number that the rule and classes of the spin weights imply; 1 without a rule.

    >>> implied_symmetry_number(SpinWeights.from_mapping({"A": 5, "E": 2, "F": 3}))
    12
    """
    if weights.rule == "none" or len(set(weights.values)) == len(weights.classes) == 1:
        return 1
    if weights.rule == "J":
        return 2
    if weights.rule == "irrep":
        return {3: 12, 5: 60 if "G" in weights.classes else 24}[len(weights.classes)]
    if weights.rule == "KaKc":
        return {1: 1, 2: 2, 4: 4}[len(_groups(weights))]
    dihedral = "0odd" in weights.classes
    return 2 * (len(weights.classes) - 1) if dihedral else len(weights.classes)
