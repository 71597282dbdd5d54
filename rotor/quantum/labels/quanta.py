"""Names of quantum numbers, and from them column names, headings of tables and labels of states.

| name | what it is |
|---|---|
| `v` | number of the vibrational or tunnelling state |
| `species` | of the permutations of a turning group: A, E; of two AA, AE, EA, EE, EE* for (σ1, σ2) = 00, 01, 10, 11, 1-1; AAA ... |
| `vt` | number of the torsional state of a species |
| `n` | rotational angular momentum where spins are coupled to it (`j` where there are none) |
| `j` | total angular momentum without nuclear spins; the rotational one where there is no spin |
| `k`, `ka`, `kc` | projection on the axis of a symmetric top; on a and on c in the limits of an asymmetric one |
| `irrep` | irreducible representation of a spherical top's level |
| `f1`, `f2`, ... `f` | angular momenta after each spin is coupled, the last one `f` |
| `i_tot` | total spin of equivalent nuclei |
| `i_sym` | species of the spin function of three of them: A1 0, A2 1, E 2 where K = 3n + 2 and 4 where K = 3n + 1; 6 more for each
  further function of one species and total |
| `m` | projection on the field |

A half-integer quantum number is stored as twice its value; `Levels.halves` names those columns.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotor.arrays import Ints
from rotor.tops.internal_rotation import sigma_species

FIELD_STEP_KV_PER_CM = 1e-12  # labels are whole numbers: of a level in a field, the field in these steps

_HEADINGS = {"ka": "Ka", "kc": "Kc", "i_tot": "I", "i_sym": "Γ", "vt": "v_t"}
_HEADINGS |= {name: name for name in ("irrep", "v", "species")}  # others have capitals

# how a picture writes sums with spins, in TeX
_SUBSCRIPTED = {f"f{i}": f"F_{i}" for i in range(1, 9)} | {"i_tot": "I", "i_sym": r"\Gamma_I"}

SPECIES_NUMBERS = {
    name: first + i for tops, first in ((1, 0), (2, 10), (3, 100)) for i, name in enumerate(sigma_species(tops))
}  # how labels of whole numbers have species: A, E are 0, 1; AA, AE, EA, EE, EE* are 10 to 14; AAA ... are 100 to 113

Quanta = Mapping[str, NDArray[Any]]


def heading(name: str) -> str:
    """How a table or a plot calls a quantum number: J, Ka, F1, v.

    >>> [heading(name) for name in ("v", "n", "ka", "f1", "i_tot")]
    ['v', 'N', 'Ka', 'F1', 'I']
    """
    return _HEADINGS.get(name, name.upper())


def headings(names: Iterable[str]) -> str:
    """The headings of several quantum numbers with a space between them.

    >>> headings(("j", "ka", "kc"))
    'J Ka Kc'
    """
    return " ".join(heading(name) for name in names)


def value_text(value: Any, half: bool = False) -> str:
    """A quantum number as text; with `half`, twice its value is stored.

    >>> value_text(3), value_text(3, half=True), value_text(4, half=True)
    ('3', '3/2', '2')
    """
    if not half:
        return str(value)
    return f"{value}/2" if value % 2 else str(value // 2)


def label_value(name: str, value: int, half: bool = False) -> str:
    """One quantum number of a label of whole numbers as text, species by their letters.

    >>> label_value("species", 1), label_value("f", 3, half=True)
    ('E', '3/2')
    """
    if name == "field":
        return f"{value * FIELD_STEP_KV_PER_CM:g} kV/cm"
    letters = {number: letter for letter, number in SPECIES_NUMBERS.items()}
    return letters.get(value, str(value)) if name == "species" else value_text(value, half)


def labels(quanta: Quanta, rows: NDArray[Any], halves: Collection[str] = ()) -> list[str]:
    """Each of the levels `rows` as its quantum numbers in a row of text; `halves` are the doubled columns.

    >>> labels({"j": np.array([4]), "ka": np.array([1]), "kc": np.array([3])}, np.array([0]))
    [' 4  1  3']
    """
    texts = [
        [f"{value_text(value, name in halves):>2}" for value in column[rows].tolist()]
        for name, column in quanta.items()
    ]
    return [" ".join(row) for row in zip(*texts, strict=True)]


def line_text(quanta: Quanta, upper: int, lower: int, halves: Collection[str] = ()) -> str:
    r"""A line as a plot names it, upper level first; sums with spins come after both rotational levels, F = F' – F".

    >>> quanta = {"n": np.array([1, 2]), "ka": np.array([0, 0]), "kc": np.array([1, 2]), "f": np.array([2, 3])}
    >>> line_text(quanta, 1, 0)
    '$2_{0,2}$ – $1_{0,1}$, $F = 3 – 2$'
    >>> line_text({"species": np.array(["E", "E"]), "vt": np.array([0, 0]), **quanta}, 1, 0)
    '$\\mathrm{E}\\;v_t{=}0\\;2_{0,2}$ – $1_{0,1}$, $F = 3 – 2$'
    """
    rotation = rotational_quanta(quanta)
    sums = [name for name in quanta if name not in rotation]
    shared = [name for name in ("species", "vt") if name in rotation and rotation[name][upper] == rotation[name][lower]]
    named_once = {name: column for name, column in rotation.items() if name not in shared}
    text = f"{state_text(rotation, upper, halves)} – {state_text(named_once, lower, halves)}"
    if not sums:
        return text
    names = ", ".join(_SUBSCRIPTED.get(name, heading(name)) for name in sums)
    values = (", ".join(value_text(quanta[name][row], name in halves) for name in sums) for row in (upper, lower))
    return f"{text}, ${names} = {' – '.join(values)}$"


def rotational_quanta(quanta: Quanta) -> dict[str, NDArray[Any]]:
    """The quantum numbers of the rotation alone: of levels with n, those of sums with spins are left out; others have none.

    >>> list(rotational_quanta({"n": np.array([1]), "k": np.array([0]), "f1": np.array([3]), "f": np.array([2])}))
    ['n', 'k']
    """
    return {name: column for name, column in quanta.items() if name in _OF_ROTATION or "n" not in quanta}


def without_nuclei(quanta: Quanta) -> dict[str, NDArray[Any]]:
    """The quantum numbers without sums with nuclear spins; those with electron spins, j after n, stay.

    >>> list(without_nuclei({"n": np.array([1]), "j": np.array([3]), "f1": np.array([3]), "f": np.array([2])}))
    ['n', 'j']
    """
    rotation = rotational_quanta(quanta)
    return {name: column for name, column in quanta.items() if name in rotation or name.startswith("j")}


_OF_ROTATION = ("species", "vt", "v", "n", "k", "ka", "kc", "irrep", "m")


def merged_text(quanta: Quanta, rows: Ints, halves: Collection[str] = ()) -> str:
    r"""Levels of one rotational level as a plot names them where their steps overlap: all values of the sum that differs.

    Up to four values of one sum are listed, of more the first and the last one; where several sums differ the last one's range stands
    with how many levels there are.

    >>> merged_text({"n": np.array([1, 1, 1]), "f": np.array([1, 0, 2])}, np.arange(3))
    '$1, F{=}0,1,2$'
    >>> print(merged_text({"n": np.array([2] * 6), "f": np.arange(-1, 11, 2)}, np.arange(1, 6), halves={"f"}))
    $2, F{=}1/2\ldots9/2$
    >>> print(merged_text({"n": np.array([1] * 3), "f1": np.array([1, 3, 3]), "f": np.array([0, 1, 2])}, np.arange(3), {"f1"}))
    $1, F{=}0\ldots2\;(3)$
    """
    differing = [name for name, column in quanta.items() if len(np.unique(column[rows])) > 1]
    text = {
        name: value_text(column[rows[0]], name in halves)
        for name, column in quanta.items()
        if name not in differing[:-1]
    }
    if differing:
        last = differing[-1]
        values = [value_text(value, last in halves) for value in np.unique(quanta[last][rows]).tolist()]
        listed = len(values) <= 4 and len(differing) == 1
        text[last] = ",".join(values) if listed else f"{values[0]}\\ldots{values[-1]}"
        if len(differing) > 1:
            text[last] += f"\\;({len(rows)})"
    return as_mathtext(text)


def state_text(quanta: Quanta, row: int, halves: Collection[str] = ()) -> str:
    r"""One level as a plot names it: J, J with K or Ka,Kc as subscripts, F after a comma, v before it all.

    >>> state_text({"j": np.array([4]), "ka": np.array([1]), "kc": np.array([3])}, 0)
    '$4_{1,3}$'
    >>> state_text({"v": np.array([1]), "n": np.array([2]), "f": np.array([5])}, 0, halves={"f"})
    '$v{=}1\\;2, F{=}5/2$'
    >>> state_text({"j": np.array([7])}, 0)
    '7'
    """
    return as_mathtext({name: value_text(column[row], name in halves) for name, column in quanta.items()})


def as_mathtext(text: dict[str, str]) -> str:
    r"""Quantum numbers by name as a plot writes them; removes them from `text`.

    >>> as_mathtext({"v": "1", "j": "3", "k": "-2"})
    '$v{=}1\\;3_{-2}$'
    """
    total = text.pop("n", None) or text.pop("j")
    below = [text.pop(name) for name in ("k", "ka", "kc", "irrep") if name in text]
    before = f"\\mathrm{{{text.pop('species')}}}\\;" if "species" in text else ""
    before += "".join(
        f"{symbol}{{=}}{text.pop(name)}\\;" for name, symbol in (("vt", "v_t"), ("v", "v")) if name in text
    )
    after = "".join(f", {_SUBSCRIPTED.get(name, heading(name))}{{=}}{value}" for name, value in text.items())
    subscript = f"_{{{','.join(below)}}}" if below else ""
    return f"${before}{total}{subscript}{after}$" if before or subscript or after else total
