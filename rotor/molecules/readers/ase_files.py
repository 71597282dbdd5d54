"""Structures in files that ASE reads; the file itself is never opened for writing.

ASE opens most formats read-only and passes the open file to the reader. Other readers (databases, netCDF, FHI-aims, ...) get the
file name, and SQLite opens it for writing; these read a copy.
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
_LOOPS_AT_END = ("cp2k-restart",)  # readers that would wait for a closing word at the end of the file


def structures(path: Path, index: str = ":", remedy: str = "give an xyz, mol or sdf file") -> list[Atoms]:
    """The structures of a file in one of ASE's formats.

    Parameters
    ----------
    path : Path
        An existing file, in a format that ASE knows by its suffix, name or first bytes.
    index : str, optional
        Selection in ASE's notation: all, or `"-1"` for the last.
    remedy : str, optional
        The advice in the error message of an unreadable file.

    Returns
    -------
    list of ase.Atoms

    Raises
    ------
    ValueError
        For an unreadable file, with the reason of ASE's reader, and for a format of a database server.
    """
    from ase.io.formats import filetype, ioformats, open_with_compression

    file = path.absolute()  # ASE takes a relative name that begins with "postgres" or "mysql" for a server
    try:
        kind = filetype(str(file))
        file_format = ioformats.get(kind)
        if kind in _SERVERS:
            raise ValueError(f"the suffix means a database server ({kind}), which no file is")
        if kind in _LOOPS_AT_END:
            with open_with_compression(str(file), "r") as text:
                return _read(_Ending(text.read()), kind, index)
        with nullcontext(file) if file_format is None or file_format.acceptsfd else _copy(file) as readable:
            return _read(str(readable), kind, index)
    except Exception as reason:  # ASE's readers raise exceptions of any class; all mean that the file is invalid
        why = str(reason).strip().splitlines()[0] if str(reason).strip() else type(reason).__name__
        raise ValueError(f"{path}: ASE cannot read it ({why}); {remedy}") from reason


def _read(source: Any, kind: str, index: str) -> list[Atoms]:
    import ase.io

    read: Any = ase.io.read(source, index=index, format=kind, do_not_split_by_at_sign=True)
    return [atoms for atoms in (read if isinstance(read, list) else [read]) if atoms is not None]


class _Ending(io.StringIO):
    """A text stream that raises an error at its end."""

    def readline(self, size: int | None = -1) -> str:  # type: ignore[override]  # io.StringIO takes None as well
        """The next line; EOFError at the end."""
        line = super().readline(-1 if size is None else size)
        if not line:
            raise EOFError("the file ends before the section of coordinates does")
        return line


@contextmanager
def _copy(file: Path) -> Iterator[Path]:
    """A copy of a file with its name, in a temporary folder."""
    with locked_folder(Path(gettempdir()), "rotor-read-") as folder:
        yield Path(shutil.copyfile(file, folder / file.name))
