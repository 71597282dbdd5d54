"""Reading of files with or without gzip, with a bound on the unpacked size."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import os
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

MOST_BYTES = 1 << 32  # largest unpacked file
HARMLESS_BYTES = 1 << 27  # unpacked size that is always allowed
# largest ratio to the packed size beyond that; lines of numbers shrink to a fifth, at best to a twentieth
MOST_TIMES = 100
_GZIP = b"\x1f\x8b"
_PIECE = 1 << 22


def load(source: str | os.PathLike[str] | bytes) -> tuple[bytes, str]:
    """The content of a file or of bytes, unpacked from gzip if needed, and its name for messages.

    Raises ValueError for a packed file that is damaged, or grows to more than 4 GB or a hundred times its size.
    """
    name = source_name(source)
    if isinstance(source, bytes):
        text = source
    else:
        with open(source, "rb") as handle:
            text = handle.read()
    return (unpacked(text, name) if text[:2] == _GZIP else text), name


def source_name(source: str | os.PathLike[str] | bytes) -> str:
    """Name of a file, or of bytes, in messages."""
    return "the text given" if isinstance(source, bytes) else os.fspath(source)


def unpacked(packed: bytes, name: str) -> bytes:
    """The content of gzip data of one or more members; `name` is used in messages."""
    return b"".join(_pieces(gzip.GzipFile(fileobj=io.BytesIO(packed)), len(packed), name))


def refuse_bomb(path: Path) -> None:
    """Raise ValueError for a gzip, bzip2 or xz file (for ASE) that is damaged or unpacks to more than `load` allows."""
    opened: Any = {".gz": gzip.open, ".bz2": bz2.open, ".xz": lzma.open}.get(path.suffix.lower())
    if opened is not None:
        for _ in _pieces(opened(path), path.stat().st_size, os.fspath(path)):
            pass


def _pieces(file: IO[bytes] | gzip.GzipFile, packed_size: int, name: str) -> Iterator[bytes]:
    """The unpacked content in pieces; ValueError if it is damaged or exceeds the bound."""
    most, size = max(HARMLESS_BYTES, min(MOST_BYTES, MOST_TIMES * packed_size)), 0
    try:
        with file:
            while piece := file.read(_PIECE):
                size += len(piece)
                if size > most:
                    raise ValueError(_too_large(name, most, packed_size))
                yield piece
    except (EOFError, OSError, zlib.error, lzma.LZMAError) as error:
        raise ValueError(f"{name}: a packed file that is damaged or cut off ({error})") from None


def _too_large(name: str, most: int, packed_size: int) -> str:
    return (
        f"{name}: unpacks to more than {most / 1e6:.0f} MB from {packed_size / 1e6:.3g} MB, more than a text of numbers; "
        "unpack it first if this is right"
    )


def first_bytes(path: Path, count: int) -> bytes:
    """The first bytes of a file, unpacked if it is a gzip file; fewer if the file is shorter."""
    with open(path, "rb") as handle:
        text = handle.read(count)
        if text[:2] != _GZIP:
            return text
        packed = text + handle.read(1 << 16)
    try:
        return zlib.decompressobj(wbits=31).decompress(packed, count)
    except zlib.error:  # damaged: the reader says so
        return b""
