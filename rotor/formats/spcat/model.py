"""Option lines of tops, spin weights of option lines, and the .int file of a top."""

from __future__ import annotations

from collections.abc import Mapping

from rotor.formats.spcat.hamiltonian.code_table import state_digits
from rotor.formats.spcat.hamiltonian.codes import NO_NAME, PLURAL_NOT_YET, is_linear, is_oblate
from rotor.formats.spcat.hamiltonian.states import FOLDS, SPECIES, odd_under
from rotor.formats.spcat.text.int_file import Dipole, IntensityFile, Request
from rotor.formats.spcat.text.par import Options
from rotor.tops.constants import Constants
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.top import Top

FOLD = {iax: fold.n for iax, fold in FOLDS.items() if len(fold.paired) == fold.n - 1 > 1}  # one kind of E levels
_IAX = {n: iax for iax, n in FOLD.items()}
_HALF_TURNS = (1, 2, 3)  # IAX of half turns


def _is_odd(iax: int) -> dict[str, bool]:
    """Whether the levels of each class of (Ka, Kc) change their sign under the half turn of an IAX."""
    return {"eo"[ka] + "eo"[kc]: bool(odd_under(iax, ka, kc)) for ka, kc in SPECIES}


def option_weights(options: Options, symmetric: bool = True) -> SpinWeights:
    """The spin weights of an option line, divided by their common divisor, which Q in the .int file may still contain.

    IAX 1, 2, 3: WTPL and WTMN for rotational states even and odd under a half turn about a, b, c. IAX 6, 9: WTPL
    where K is a multiple of 3 or 5, EWT elsewhere; where they differ, at K = 0 by the parity of J, of a symmetric top alone. An
    odd last digit of VSYM exchanges WTPL and WTMN.
    """
    # an odd VSYM exchanges the two weights
    plus, minus = (options.wtpl, options.wtmn) if options.vsym % 2 == 0 else (options.wtmn, options.wtpl)
    if options.iax in FOLD:
        return _fold_weights(options, plus, minus, symmetric)
    if options.iax not in _HALF_TURNS:
        raise ValueError(f"IAX = {options.iax}: spin weights other than by IAX 1, 2, 3, 6 or 9: these {NO_NAME}")
    if plus == minus:
        return SpinWeights()
    if is_linear(options):
        if options.iax == 1:  # a turn about the axis leaves every level even
            return SpinWeights()
        return SpinWeights.from_mapping({"even": plus, "odd": minus})
    if options.by_k:
        along = 3 if options.oblate else 1
        if options.iax != along:
            raise ValueError(
                f"IAX = {options.iax} in a symmetric top: weights that tell the two states of one K: these {NO_NAME}"
            )
        return SpinWeights.from_mapping({"0": plus, "1": minus})
    return SpinWeights.from_mapping({name: minus if odd else plus for name, odd in _is_odd(options.iax).items()})


def _fold_weights(options: Options, plus: int, minus: int, symmetric: bool) -> SpinWeights:
    fold = FOLD[options.iax]
    factor = 100 if options.ewt >= 0 else 1000  # EWT has two or three digits for the weight, by its sign
    if abs(options.ewt) >= factor - 1:
        raise ValueError(f"EWT = {options.ewt}: l-doubled states, and E levels without a weight, {PLURAL_NOT_YET}")
    if plus == minus:
        return SpinWeights.from_mapping({str(k): abs(options.ewt) if k else plus for k in range(fold)})
    if not symmetric:
        raise ValueError(f"IAX = {options.iax} of an asymmetric top with unlike WTPL and WTMN {NO_NAME}")
    raw = fold_parts(fold, plus, minus, abs(options.ewt))
    names = ["0even", "0odd", *(str(k) for k in range(1, fold))]
    # a negative weight marks missing levels: 0 of them
    return SpinWeights.from_mapping(dict(zip(names, (max(w, 0) for w in raw), strict=True)))


def fold_parts(fold: int, plus: int, minus: int, e_weight: int) -> list[int]:
    """Twice the weights of K = 0 with J even and odd and of the E levels; if one of the first is 0, only half of the E levels exist.

    fold: n of the n-fold axis. plus, minus: WTPL and WTMN. e_weight: weight of E levels in EWT.
    Returns: weights of 0even, 0odd, 1, ..., n - 1.
    """
    return [2 * plus, 2 * minus, *[2 * e_weight if min(plus, minus) > 0 else e_weight] * (fold - 1)]


def option_line(constants: Constants, weights: SpinWeights, kmax: int) -> Options:
    """The option line for one vibrational state, K up to `kmax`.

    Levels of asymmetric tops are ordered by DIAG = 3: with 0 SPCAT returns first-order energies instead of eigenvalues where the diagonal
    does not rise with K. Raises ValueError for weights that an option line cannot express.
    """
    kind = constants.kind
    oblate = is_oblate(constants)
    letter = "l" if kind == "linear" else (constants.reduction or "A").lower() if kind == "asymmetric" else "s"
    iax, plus, minus, ewt = _coded_weights(weights, oblate)
    return Options(
        chr=letter,
        spind=1 if kind == "asymmetric" else -1,
        nvib=-1 if oblate else 1,
        knmax=0 if kind == "linear" else kmax,
        iax=iax,
        wtpl=plus,
        wtmn=minus,
        ewt=ewt,
        diag=3 if kind == "asymmetric" else 0,
    )


def _coded_weights(weights: SpinWeights, oblate: bool) -> tuple[int, int, int, int]:
    """IAX, WTPL, WTMN, EWT of spin weights."""
    by_class: Mapping[str, int] = weights.to_mapping()
    if weights.rule == "none":
        return 1, 1, 1, 0
    if weights.rule == "J":
        return 2, by_class["even"], by_class["odd"], 0
    if weights.rule == "K" and "0even" in by_class:
        others = {weight for name, weight in by_class.items() if not name.startswith("0")}
        iax = _IAX.get(len(by_class) - 1, 0)
        plus, minus = by_class["0even"], by_class["0odd"]
        if iax and len(others) == 1:  # if one of the two is 0, SPCAT lists only one level of each E pair
            return iax, plus, minus, others.pop() * (1 if min(plus, minus) else 2)
    elif weights.rule == "K":
        others = set(weights.values[1:])
        iax = (_IAX | {2: 3 if oblate else 1}).get(len(weights.values), 0)
        if iax and len(others) == 1:
            ewt = others.pop()
            return (iax, weights.values[0], ewt, 0) if iax < 6 else (iax, weights.values[0], weights.values[0], ewt)
    for iax in _HALF_TURNS:
        if weights.rule == "KaKc":
            sides = [{by_class[name] for name, odd in _is_odd(iax).items() if odd == side} for side in (False, True)]
            if all(len(side) == 1 for side in sides):
                return iax, sides[0].pop(), sides[1].pop(), 0
    raise ValueError(f"spin weights {dict(by_class)}: one option line of SPFIT cannot say these")


def intensity_file(top: Top, request: Request) -> IntensityFile:
    """The .int file of a top, with dipoles within and between states; components of exactly zero have no line."""
    if top.dipole_abc_debye is None:
        raise ValueError(f"{top.name or 'the top'} has no dipole; expected one for an .int file, (μa, μb, μc) in D")
    count = 1 if top.states is None else top.states.count
    state_dipoles = top.states.dipoles if top.states else {}
    moments = {(v, v): state_dipoles.get((v, v), top.dipole_abc_debye) for v in range(count)}
    moments |= {pair: moment for pair, moment in state_dipoles.items() if pair[0] != pair[1]}
    width = 0 if count == 1 else state_digits(count)
    dipoles = tuple(
        Dipole((low * 10**width + high) * 10 + axis, value)
        for (high, low), moment in moments.items()
        for axis, value in enumerate(moment, 1)
        if value
    )
    return IntensityFile(top.name, request, dipoles)
