"""Structures in files that ASE reads, with the file itself never opened for writing.

ASE opens most formats read-only and hands the open file to the reader. The others (databases, netCDF, FHI-aims, ...) get the
name of the file, and SQLite opens that for writing: these read a copy.
"""

from __future__ import annotations

import io
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from tempfile import gettempdir
from typing import TYPE_CHECKING, Any

from rotor.temporary import locked_folder

if TYPE_CHECKING:
    from ase import Atoms

_SERVERS = ("mysql", "postgresql")  # formats that ASE reads from a database server, not from a file
_LOOPS_AT_END = ("cp2k-restart",)  # readers that wait for a closing word beyond the end of the file


def structures(path: Path, index: str = ":", remedy: str = "give an xyz, mol or sdf file") -> list[Atoms]:
    """The structures of a file in one of ASE's formats.

    Parameters
    ----------
    path : Path
        An existing file, in a format that ASE knows by its suffix, name or first bytes.
    index : str, optional
        Which of them, in ASE's notation: all, or `"-1"` the last.
    remedy : str, optional
        What the error of an unreadable file says would do.

    Returns
    -------
    list of ase.Atoms

    Raises
    ------
    ValueError
        With the reason of ASE's reader for a file that it cannot read, and for a format that means a database server.
    """
    from ase.io.formats import filetype, ioformats, open_with_compression

    file = path.absolute()  # ASE takes a relative name that begins with "postgres" or "mysql" for a server
    try:
        kind = filetype(str(file))
        known = ioformats.get(kind)
        if kind in _SERVERS:
            raise ValueError(f"the suffix means a database server ({kind}), which no file is")
        if kind in _LOOPS_AT_END:
            with open_with_compression(str(file), "r") as text:
                return _read(_Ending(text.read()), kind, index)
        with nullcontext(file) if known is None or known.acceptsfd else _copy(file) as readable:
            return _read(str(readable), kind, index)
    except Exception as reason:  # ASE's readers fail with any class; all mean that the file is not what it should be
        why = str(reason).strip().splitlines()[0] if str(reason).strip() else type(reason).__name__
        raise ValueError(f"{path}: ASE cannot read it ({why}); {remedy}") from reason


def _read(source: Any, kind: str, index: str) -> list[Atoms]:
    import ase.io

    read: Any = ase.io.read(source, index=index, format=kind, do_not_split_by_at_sign=True)
    return [atoms for atoms in (read if isinstance(read, list) else [read]) if atoms is not None]


class _Ending(io.StringIO):
    """Text whose end is an error."""

    def readline(self, size: int | None = -1) -> str:  # type: ignore[override]  # io.StringIO takes None as well
        """The next line; EOFError where there is none."""
        line = super().readline(-1 if size is None else size)
        if not line:
            raise EOFError("the file ends before the section of coordinates does")
        return line


@contextmanager
def _copy(file: Path) -> Iterator[Path]:
    """A copy of a file, under the same name in a temporary folder."""
    with locked_folder(Path(gettempdir()), "rotor-read-") as folder:
        yield Path(shutil.copyfile(file, folder / file.name))
