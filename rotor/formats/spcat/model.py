"""Option lines of tops, spin weights of option lines, and the .int file of a top."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

from rotor.formats.spcat.hamiltonian.code_table import state_digits
from rotor.formats.spcat.hamiltonian.codes import NO_NAME, is_linear, is_oblate
from rotor.formats.spcat.hamiltonian.states import FOLDS, SPECIES, odd_under
from rotor.formats.spcat.text.int_file import Dipole, IntensityFile, Request
from rotor.formats.spcat.text.par import Options
from rotor.tops.constants.constants import Constants
from rotor.tops.spins.spin_weights import SpinWeights
from rotor.tops.top import Top

FOLD = {iax: fold.n for iax, fold in FOLDS.items() if len(fold.paired) == fold.n - 1 > 1}  # one kind of E levels
_HALF_TURNS = (1, 2, 3)  # IAX of half turns


def _is_odd(iax: int) -> dict[str, bool]:
    """Whether the levels of each class of (Ka, Kc) change their sign under the half turn of an IAX."""
    return {"eo"[ka] + "eo"[kc]: bool(odd_under(iax, ka, kc)) for ka, kc in SPECIES}


def option_weights(options: Options, symmetric: bool = True) -> SpinWeights:
    """The spin weights of an option line, divided by their common divisor, which Q in the .int file may still contain."""
    return reduced_weights(class_weights(options, symmetric))


def reduced_weights(by_class: dict[str, int]) -> SpinWeights:
    """Weights as of `class_weights`, divided by their common divisor."""
    return SpinWeights.from_mapping(by_class) if len(by_class) > 1 else SpinWeights()


def class_weights(options: Options, symmetric: bool = True) -> dict[str, int]:
    """Twice the spin weights of an option line, by the classes of `SpinWeights`; a single one if all levels weigh the same.

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
    if plus == minus or (
        is_linear(options) and options.iax == 1
    ):  # a turn about the axis leaves every linear level even
        return {"all": 2 * max(plus, 1)}
    if is_linear(options):
        return {"even": 2 * plus, "odd": 2 * minus}
    if options.by_k:
        if options.iax != (3 if options.oblate else 1):
            raise ValueError(
                f"IAX = {options.iax} in a symmetric top: weights that tell the two states of one K: these {NO_NAME}"
            )
        return {"0": 2 * plus, "1": 2 * minus}
    return {name: 2 * (minus if odd else plus) for name, odd in _is_odd(options.iax).items()}


def _fold_weights(options: Options, plus: int, minus: int, symmetric: bool) -> dict[str, int]:
    """Twice the weights of K = 0 and of the E levels; of a threefold axis, Wang blocks whose WTPL or WTMN is 0 have no E levels."""
    factor = 100 if options.ewt >= 0 else 1000  # EWT has two or three digits for the weight, by its sign
    if abs(options.ewt) >= factor:
        raise ValueError(f"EWT = {options.ewt}: l-doubled states {NO_NAME}")
    if plus != minus and not symmetric:
        raise ValueError(f"IAX = {options.iax} of an asymmetric top with unlike WTPL and WTMN {NO_NAME}")
    # a negative weight marks missing levels: 0 of them
    fold, (even, odd) = FOLD[options.iax], (max(plus, 0), max(minus, 0))
    at_zero = {"0": 2 * even} if even == odd else {"0even": 2 * even, "0odd": 2 * odd}
    blocks = 2 if fold > 3 else (even > 0) + (odd > 0)
    return at_zero | {str(k): blocks * abs(options.ewt) for k in range(1, fold)}


def option_line(constants: Constants, weights: SpinWeights, kmax: int) -> Options:
    """The option line for one vibrational state, K up to `kmax`.

    Levels of asymmetric tops are ordered by DIAG = 3: with 0 SPCAT returns first-order energies instead of eigenvalues where the diagonal
    does not rise with K. Raises ValueError for weights that an option line cannot express.
    """
    kind = constants.kind
    oblate = is_oblate(constants)
    letter = "l" if kind == "linear" else (constants.reduction or "A").lower() if kind == "asymmetric" else "s"
    line = Options(
        chr=letter,
        spind=1 if kind == "asymmetric" else -1,
        nvib=-1 if oblate else 1,
        knmax=0 if kind == "linear" else kmax,
        diag=3 if kind == "asymmetric" else 0,
    )
    values = dict.fromkeys(weights.values)
    for iax, plus, minus in product((*_HALF_TURNS, *FOLD), values, values):
        # twice, where SPCAT lists only one level of each E pair
        for ewt in (times * value for value in values for times in (1, 2)) if iax in FOLD else (0,):
            weighted = replace(line, iax=iax, wtpl=plus, wtmn=minus, ewt=ewt)
            if _has_weights(weighted, weights):
                return weighted
    raise ValueError(f"spin weights {weights.to_mapping()}: one option line of SPFIT cannot say these")


def _has_weights(options: Options, weights: SpinWeights) -> bool:
    """Whether an option line has these weights; those by (Ka, Kc) also tell the two states of one K of a symmetric top."""
    try:
        return option_weights(replace(options, spind=1) if weights.rule == "KaKc" else options) == weights
    except ValueError:
        return False


def intensity_file(top: Top, request: Request) -> IntensityFile:
    """The .int file of a top, with dipoles within and between states; components of exactly zero have no line."""
    if top.dipole_abc_debye is None:
        raise ValueError(f"{top.name or 'the top'} has no dipole; expected one for an .int file, (μa, μb, μc) in D")
    count = top.state_count
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
