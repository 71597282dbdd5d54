"""The table [magnetic] of a molecule file: the rotational g tensor and the magnetisability along a, b, c.

[magnetic]
source = "..."
g_aa = 0.7           # g_bb, g_cc; g_ab, g_ac, g_bc where not 0
magnetisability_parallel = -3.0      # 1e-6 erg/(G2 mol), of a linear or symmetric top; _perpendicular
"""

from __future__ import annotations

from typing import Any

from rotor.formats.molecules.molecule_tables import TableReader
from rotor.tops.magnetic import ELEMENTS, MagneticTensors, Tensor, tensor_for

_TENSORS = ("g", "magnetisability")


def read_magnetic(table: TableReader | None, kind: str) -> MagneticTensors | None:
    """The tensors of the table, None without one; ValueError, with file, table and key, for unknown or missing entries."""
    if table is None:
        return None
    endings = ("", *(f"_{element}" for element in (*ELEMENTS, "parallel", "perpendicular")))
    table.refuse_unknown(("source", "unverified", *(name + ending for name in _TENSORS for ending in endings)))
    g, chi = (_tensor(table, name, kind) for name in _TENSORS)
    if g is None:
        raise ValueError(f"{table.place}: no g: give g_aa, g_bb, g_cc, or g_parallel and g_perpendicular, or g")
    return MagneticTensors(g, chi)


def _tensor(table: TableReader, name: str, kind: str) -> Tensor | None:
    if not any(key == name or key.startswith(f"{name}_") for key in table.content):
        return None
    if name in table.content:
        names: tuple[str, ...] = (name,)
    elif f"{name}_parallel" in table.content or f"{name}_perpendicular" in table.content:
        names = (f"{name}_parallel", f"{name}_perpendicular")
    else:
        names = tuple(f"{name}_{element}" for element in ELEMENTS)
    present = {key for key in table.content if key == name or key.startswith(f"{name}_")}
    if extra := sorted(present - set(names)):
        raise ValueError(f"{table.place}: {', '.join(extra)} beside {names[0]}: give the tensor in a single form")
    values = [table.number(key) for key in names]
    if missing := [key for key, value in zip(names[:3], values, strict=False) if value is None]:
        raise ValueError(f"{table.place}: {', '.join(missing)} is missing")
    try:
        return tensor_for(kind, [value or 0.0 for value in values])
    except ValueError as error:
        raise ValueError(f"{table.place}, {names[0]}: {error}") from None


def magnetic_table(tensors: MagneticTensors | None) -> dict[str, Any]:
    """The table that `read_magnetic` reads; ValueError for a g tensor that is not symmetric."""
    if tensors is None:
        return {}
    out: dict[str, Any] = {}
    for name, tensor in zip(_TENSORS, (tensors.g, tensors.magnetisability), strict=True):
        if tensor is None:
            continue
        for i, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
            if tensor[i][k] != tensor[k][i]:
                raise ValueError(f"{name} is not symmetric: a molecule file holds symmetric tensors; got {tensor}")
            if i == k or tensor[i][k]:
                out[f"{name}_{'abc'[i]}{'abc'[k]}"] = tensor[i][k]
    return out
