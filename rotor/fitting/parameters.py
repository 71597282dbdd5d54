"""Free parameters of a fit. Constants are linear functions of them, free, held, or tied; free ones may have an a-priori error.

constants = base + matrix @ parameters. With plain names a parameter is a constant. In SPFIT's coding it is the factor of a
coded operator (A - B, -D_J), and a tied parameter has a fixed ratio to the preceding one.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rotor.arrays import Floats, Ints
from rotor.fitting.top_constants import DIPOLES, ConstantSet
from rotor.tops.constants.constants import UnknownConstantError
from rotor.tops.constants.kind_of_constants import RIGID
from rotor.units import parse_quantity

_NAME = r"(\w+(?:-[abc]{2}(?:_\w+)?(?=\())?(?:\([^()]*\))?(?:\[[^\[\]]*\])?)"  # DeltaJ, A[1], G_c[0,1], chi_bb-cc(14N)
_TIE = re.compile(
    rf"\s*{_NAME}\s*=\s*(?:([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*\*\s*)?{_NAME}\s*(?:([+-])\s*(.+))?\s*$"
)

_FURTHER = (
    f"a fit has also {', '.join(DIPOLES)} (lines in a field), E[1] and A[1] of further states, G_c[0,1] of pairs of states, chi_aa(14N) of "
    "spins, F, rho and V3 of an internal rotor"
)


@dataclass(frozen=True, eq=False)
class Parameters:
    """Free parameters and how the constants follow from them.

    names (n,) : the free parameters. start (n,) : values before the fit, MHz. prior (n,) : a-priori standard errors, MHz;
    infinite without one. centre (n,) : a-priori values, MHz, if they differ from `start`
    constant_names (c,) ; base (c,), matrix (c, n) : constants = base + matrix @ parameters
    """

    names: tuple[str, ...]
    start: Floats
    prior: Floats
    constant_names: tuple[str, ...]
    base: Floats
    matrix: Floats
    centre: Floats | None = None

    @property
    def expected(self) -> Floats:
        """A-priori values (n,), MHz, with the standard errors `prior`."""
        return self.start if self.centre is None else self.centre

    @property
    def prior_count(self) -> int:
        """The number of a-priori values."""
        return int(np.isfinite(self.prior).sum())

    def to_constants(self, parameters: Floats) -> Floats:
        """The constants (c,) in MHz."""
        return np.asarray(self.base + self.matrix @ parameters)

    def to_parameter_slopes(self, slopes: Floats) -> Floats:
        """Derivatives by the parameters (..., n) from those by the constants (..., c)."""
        if self._constants is None:
            return np.asarray(slopes @ self.matrix)
        return slopes if len(self._constants) == slopes.shape[-1] else slopes.take(self._constants, axis=-1)

    @cached_property
    def _constants(self) -> Ints | None:
        """Indices of the parameters among the constants; None if a parameter is not a constant, or a constant is tied to several."""
        # a constant without a factor takes its parameter directly, which saves a product of matrices
        rows = self.matrix.argmax(axis=0) if self.matrix.size else np.zeros(0, dtype=np.int64)
        plain = np.zeros(self.matrix.shape)
        plain[rows, np.arange(len(rows))] = 1.0
        rising = bool((np.diff(rows) > 0).all())  # so that all of them are in their order
        return rows if rising and np.array_equal(self.matrix, plain) else None

    def without(self, name: str) -> Parameters:
        """A copy with one parameter held at 0."""
        i = self.names.index(name)
        keep = [k for k in range(len(self.names)) if k != i]
        return Parameters(
            tuple(self.names[k] for k in keep), self.start[keep], self.prior[keep], self.constant_names, self.base,
            self.matrix[:, keep], self.expected[keep],
        )  # fmt: skip

    def moved(self, start: Floats) -> Parameters:
        """A copy with other start values; a-priori values do not change."""
        start = np.asarray(start, dtype=np.float64)
        # a-priori values pull to what was expected, others count from the start
        centre = np.where(np.isfinite(self.prior), self.expected, start)
        return replace(self, start=start, centre=centre)

    def with_free(self, constants: ConstantSet, added: Sequence[str]) -> Parameters:
        """A copy with more free constants; ties and a-priori errors do not change.

        constants : gives the start values of the added ones. Raises ValueError if one is free or tied already.
        """
        names, full_names = tuple(constants.values), [_spelled_as_in_set(name, constants, "free") for name in added]
        moving = {name for name, row in zip(self.constant_names, self.matrix, strict=True) if row.any()}
        if taken := [name for name in full_names if name in moving]:
            raise ValueError(f"{taken[0]} is free or tied already; leave it out, or take the tie away")
        held = dict(zip(self.constant_names, self.base.tolist(), strict=True))
        rows = dict(zip(self.constant_names, self.matrix, strict=True))
        none = np.zeros(len(self.names))
        first = np.array([rows.get(name, none) for name in names]).reshape(len(names), len(self.names))
        return Parameters(
            names=(*self.names, *full_names),
            start=np.append(self.start, [constants[name] for name in full_names]),
            # an infinite a-priori error: no a-priori value
            prior=np.append(self.prior, np.full(len(full_names), np.inf)),
            centre=np.append(self.expected, [constants[name] for name in full_names]),
            constant_names=names,
            base=np.array([0.0 if name in full_names else held.get(name, constants[name]) for name in names]),
            matrix=np.column_stack(
                [first, *(np.array([each == name for each in names], dtype=float) for name in full_names)]
            ),
        )


def parameters(
    constants: ConstantSet,
    free: Sequence[str],
    *,
    ties: Sequence[str] = (),
    priors_mhz: Mapping[str, float] | None = None,
) -> Parameters:
    """Free parameters from names of constants.

    Parameters
    ----------
    constants : Constants or TopConstants
        Start values; constants that are not free are held. The set must contain each free constant.
    free : sequence of str
    ties : sequence of str
        Such as "DeltaK = 2.5*DeltaJ" (a fixed ratio) or "C = B - 300" (a fixed difference, MHz or with a unit): the constant on
        the left follows the one on the right and is not free itself.
    priors_mhz : mapping, optional
        A-priori standard errors of free constants; their a-priori values are the start values.

    Returns
    -------
    Parameters
        Start values and a-priori errors (free,) in MHz, and how the constants follow from them.

    Raises
    ------
    ValueError
        A repeated or unknown name, a constant both free and tied or tied to one that is not free, no free constant, a prior not
        above 0.

    Examples
    --------
    >>> from rotor.tops.constants.constants import Constants
    >>> set_ = Constants(A=9.0, B=3.0, C=2.0)
    >>> parameters(set_, ["A", "B"], ties=["C = B - 1"]).to_constants(np.array([9.5, 3.5])).tolist()
    [9.5, 3.5, 2.5]
    """
    names, values = tuple(constants.values), np.array(list(constants.values.values()))
    chosen = [_spelled_as_in_set(name, constants, "free") for name in free]
    twice = next((name for name in chosen if chosen.count(name) > 1), None)
    if twice:
        typed = " and ".join(dict.fromkeys(text for text, name in zip(free, chosen, strict=True) if name == twice))
        alike = "are one constant" if " and " in typed else "is named twice among the free constants"
        raise ValueError(f"free: {typed} {alike}; once is enough")
    if not chosen:
        raise ValueError("free: no constant is free; name those that are to be fitted, such as A,B,C")

    base, matrix = values.copy(), np.zeros((len(names), len(chosen)))
    for column, name in enumerate(chosen):
        base[names.index(name)] = 0.0
        matrix[names.index(name), column] = 1.0
    for text in ties:
        left, ratio, right, shift = _tie(text, constants)
        if left in chosen or right not in chosen:
            raise ValueError(f"ties {text!r}: {left} must not be free, and {right} must be")
        row = names.index(left)
        if matrix[row].any():
            raise ValueError(f"ties {text!r}: {left} is tied already")
        base[row] = shift
        matrix[row, chosen.index(right)] = ratio
    start = np.array([constants[name] for name in chosen])
    return Parameters(tuple(chosen), start, _priors(chosen, priors_mhz or {}, constants), names, base, matrix)


def with_names(constants: ConstantSet, names: Sequence[str]) -> ConstantSet:
    """A set with the missing constants of `names` added at 0, so that they can be fitted.

    Raises ValueError for a name that does not belong to the kind of top or the reduction, and for a missing state or spin.

    >>> from rotor.tops.constants.constants import Constants
    >>> with_names(Constants(B=6081.5), ["D"]).values["D"]
    0.0
    """
    missing = [name for name in names if name not in constants]
    if rigid := [name for name in missing if name in RIGID]:
        raise ValueError(f"{rigid[0]} is not a constant of the start, and a rotational constant cannot begin at 0")
    try:
        return constants.replace(**dict.fromkeys(missing, 0.0)) if missing else constants
    except UnknownConstantError as error:
        for name in missing:
            if near := [known for known in constants.values if _plain(known) == _plain(name)]:
                raise ValueError(f"{name} is not a constant of the start; did you mean {' or '.join(near)}?") from None
        raise ValueError(f"{error}; {_FURTHER}") from None


def _plain(name: str) -> str:
    """A name without spins, states, underscores and case, to compare what was typed: chi_aa(14N) and chiaa are alike."""
    return re.split(r"[(\[]", name)[0].replace("_", "").casefold()


def _spelled_as_in_set(name: str, constants: ConstantSet, where: str) -> str:
    if name not in constants:
        raise ValueError(
            f"{where}: {name} is not in the set of constants to start from, which has {', '.join(constants.values)}"
        )
    return constants.spelling(name)


def _tie(text: str, constants: ConstantSet) -> tuple[str, float, str, float]:
    """Parse `left = ratio*right + difference`: left, ratio, right, difference in MHz."""
    match = _TIE.match(text.replace("−", "-"))
    if not match:
        raise ValueError(
            f"ties {text!r}: write 'X = 2.5*Y' (a ratio) or 'X = Y - 300' (a difference, in MHz or with a unit)"
        )
    left, right = (_spelled_as_in_set(match[i], constants, f"ties {text!r}") for i in (1, 3))
    if left == right:
        raise ValueError(f"ties {text!r}: {left} cannot follow itself")
    try:
        shift = parse_quantity(match[5], "MHz") if match[5] else 0.0
    except ValueError as error:
        raise ValueError(f"ties {text!r}: {error}") from None
    return left, float(match[2] or 1.0), right, -shift if match[4] == "-" else shift


def _priors(chosen: Sequence[str], priors_mhz: Mapping[str, float], constants: ConstantSet) -> Floats:
    errors = {_spelled_as_in_set(name, constants, "priors_mhz"): value for name, value in priors_mhz.items()}
    lost = [name for name in errors if name not in chosen]
    if lost:
        raise ValueError(f"priors_mhz: a-priori error of {', '.join(lost)}, which is not free")
    for name, value in errors.items():
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"priors_mhz: a-priori error of {name}: {value!r} MHz; expected a standard error above 0")
    return np.array([errors.get(name, np.inf) for name in chosen])  # an infinite a-priori error: no a-priori value
