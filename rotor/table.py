"""Tables of equal columns: what turns them into data frames, once for lines, levels, spectra and motions."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray


class Table(ABC):
    """A thing with columns of equal length, by their names with unit.

    >>> class Squares(Table):
    ...     columns = {"n": [1, 2, 3], "square": [1, 4, 9]}
    >>> Squares().to_pandas()["square"].tolist()
    [1, 4, 9]
    """

    @property
    @abstractmethod
    def columns(self) -> Mapping[str, NDArray[Any]]:
        """Every column by its name with unit."""

    def to_pandas(self) -> Any:
        """All columns as a pandas DataFrame."""
        import pandas as pd

        return pd.DataFrame(self.columns)

    def to_polars(self) -> Any:
        """All columns as a polars DataFrame."""
        import polars as pl

        return pl.DataFrame(self.columns)
