"""Published elements of spin tensors, converted to the independent elements that this package uses.

| published | stored as |
|---|---|
| chi_bb_minus_cc | chi_bb-cc |
| two or three of chi_aa, chi_bb, chi_cc; also of T and D | chi_aa and chi_bb-cc: these tensors are traceless |
| C_ba alone | C_ab, for both orders |
| C_ab and C_ba; also of eps, and with powers | C_ab = ½(C_ab + C_ba), C_ab-ba = ½(C_ab - C_ba) |

Order of the axes: C_ab multiplies ½{S_a, N_b}, the axis of the spin first, as in I·C·J. J. M. Brown and T. J. Sears (J. Mol. Spectrosc. 75,
111 (1979)) put N first in their eps. chi, T and D are symmetric: chi_ba equals chi_ab.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from math import hypot

import numpy as np

from rotor.arrays import Floats

_TWO_ORDERS = re.compile(r"(?P<tensor>C|eps)_(?P<axes>ba|ca|cb)(?P<rest>(?:_[JKS]+)?\(.*)")
_SYMMETRIC = re.compile(r"(?P<tensor>chi|T|D)_(?P<axes>ba|ca|cb)(?P<rest>(?:_[JKS]+)?\(.*)")


def plain_elements(
    values: Mapping[str, float], errors: Mapping[str, float]
) -> tuple[dict[str, float], dict[str, float]]:
    """Values and uncertainties in MHz by the names of this package, from published elements (table above).

    >>> plain_elements({"C_ab(H)": 3.0, "C_ba(H)": 1.0, "chi_bb_minus_cc(D)": 2.0}, {})[0]
    {'C_ab(H)': 2.0, 'chi_bb-cc(D)': 2.0, 'C_ab-ba(H)': 1.0}
    """
    short = ({_in_short(name): value for name, value in by_name.items()} for by_name in (values, errors))
    return without_trace(*in_both_orders(*(dict(by_name) for by_name in short)))


def without_trace(
    values: Mapping[str, float], errors: Mapping[str, float]
) -> tuple[dict[str, float], dict[str, float]]:
    """Two or three diagonal elements of a traceless tensor (chi, T, D) converted to aa and bb-cc; other names do not change.

    A single element stays: the other two are each minus half of it. Raises ValueError for three elements whose sum exceeds 1e-3 of the
    largest (published elements are rounded), and for a difference beside two elements.

    >>> without_trace({"chi_aa(14N)": 2.0, "chi_cc(14N)": -3.5}, {})[0]
    {'chi_aa(14N)': 2.0, 'chi_bb-cc(14N)': 5.0}
    """
    out, left = dict(values), dict(errors)
    for tensor, spins in dict.fromkeys(
        (n.partition("_")[0], n.partition("(")[2]) for n in values if n[:2] in ("ch", "T_", "D_")
    ):
        names = {letters: f"{tensor}_{letters}({spins}" for letters in ("aa", "bb", "cc")}
        elements = {letters: values[name] for letters, name in names.items() if name in values}
        if len(elements) < 2:
            continue
        difference = [n for n in values if n.startswith(f"{tensor}_") and "-" in n and n.endswith(f"({spins}")]
        # of two elements the third follows, of three the sum is checked
        trace = sum(elements.values()) if len(elements) == 3 else 0.0
        if abs(trace) > 1e-3 * max(map(abs, elements.values())):
            raise ValueError(
                f"{tensor}({spins}: aa + bb + cc = {trace:g} MHz; the tensor is traceless, check the elements"
            )
        if difference:
            raise ValueError(
                f"{', '.join(difference)} beside {', '.join(elements)}: give aa and a difference, or the elements alone"
            )
        aa, bb, cc = (elements.get(letters, -sum(elements.values())) - trace / 3 for letters in names)
        spread = {letters: left.pop(name) for letters, name in names.items() if name in left}
        for name in names.values():
            out.pop(name, None)
        out |= {names["aa"]: aa, f"{tensor}_bb-cc({spins}": bb - cc}
        if len(spread) == len(elements):
            left |= {
                names["aa"]: spread.get("aa", hypot(*spread.values())),
                f"{tensor}_bb-cc({spins}": hypot(*spread.values()),
            }
    return out, left


def in_both_orders(values: dict[str, float], errors: dict[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """C_ab and C_ba converted to their mean and half their difference; C_ba alone becomes C_ab, for both orders.

    Raises ValueError if a symmetric tensor (chi, T, D) has both orders, and if C_ab-ba is given beside C_ab and C_ba.

    >>> in_both_orders({"eps_ca(S)": 3.0}, {"eps_ca(S)": 0.1})
    ({'eps_ac(S)': 3.0}, {'eps_ac(S)': 0.1})
    """
    out, left = dict(values), dict(errors)
    for name in values:
        match = _TWO_ORDERS.fullmatch(name) or _SYMMETRIC.fullmatch(name)
        if match is None:
            continue
        tensor, axes, rest = match["tensor"], match["axes"], match["rest"]
        other = f"{tensor}_{axes[::-1]}{rest}"
        difference = f"{tensor}_{axes[::-1]}-{axes}{rest}"
        if other not in values:
            if difference in values:
                raise ValueError(f"{name} beside {difference}: give {other} and {difference}, or {other} and {name}")
            out = {(other if key == name else key): value for key, value in out.items()}
            left = {(other if key == name else key): value for key, value in left.items()}
            continue
        if tensor in ("chi", "T", "D"):
            raise ValueError(f"{other} and {name} are one constant, {tensor} is symmetric; give it once")
        if difference in values:
            raise ValueError(f"{difference} beside {other} and {name}: give {other} and {difference}, or both orders")
        first, second = values[other], out.pop(name)
        out[other], out[difference] = (first + second) / 2, (first - second) / 2
        spread = [left.pop(order) for order in (other, name) if order in left]
        if len(spread) == 2:
            left[other] = left[difference] = hypot(*spread) / 2
    return out, left


def _in_short(name: str) -> str:
    """The short form of a name: chi_bb-cc(14N) for chi_bb_minus_cc(14N)."""
    return re.sub(r"^([A-Za-z]+_[abc]{2})_minus_([abc]{2})", r"\1-\2", name)


def chi_tensor(chi: Mapping[str, float]) -> Floats:
    """Traceless tensor (3, 3) along a, b, c from chi_aa, chi_bb-cc, ...; chi_aa alone gives -½ chi_aa along b and c.

    >>> chi_tensor({"chi_aa": 2.0, "chi_bb-cc": 1.0}).diagonal().tolist()
    [2.0, -0.5, -1.5]
    """
    tensor = np.zeros((3, 3))
    for name, value in chi.items():
        letters = name.removeprefix("chi_")
        first, _, second = letters.partition("-")
        i, k = ("abc".index(letter) for letter in first)
        if second:
            j = "abc".index(second[0])
            tensor[i, i] += value / 2
            tensor[j, j] -= value / 2
        elif i == k:
            # axial about one axis, without a trace: (3 n nᵀ - 1)/2
            tensor += value * (1.5 * np.outer(np.eye(3)[i], np.eye(3)[i]) - 0.5 * np.eye(3))
        else:
            tensor[i, k] = tensor[k, i] = value
    return tensor
