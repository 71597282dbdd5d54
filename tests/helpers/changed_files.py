"""Texts with a few characters changed."""

import numpy as np


def mutated(text: bytes, rng: np.random.Generator) -> bytes:
    """The text with one of the accidents that happen to files."""
    data = bytearray(text)
    at = int(rng.integers(len(data)))
    lines = text.splitlines(keepends=True)
    row = int(rng.integers(len(lines)))
    kind = int(rng.integers(9))
    if kind == 0:  # a byte flipped
        data[at] = int(rng.integers(256))
    elif kind == 1:  # a character out of place
        data[at] = int(rng.choice(list(b" 0123456789.+-eDEd,/AZaz*:\t\r\n")))
    elif kind == 2:  # a field shifted
        data[at:at] = b" " * int(rng.integers(1, 4))
    elif kind == 3:
        del data[at : at + int(rng.integers(1, 4))]
    elif kind == 4:  # cut off
        del data[at:]
    elif kind == 5:  # a line cut
        lines[row] = lines[row][: int(rng.integers(len(lines[row]) + 1))]
        return b"".join(lines)
    elif kind == 6:  # lines lost, doubled or exchanged
        lines[row : row + 1] = [lines[row]] * int(rng.choice([0, 2]))
        return b"".join(lines)
    elif kind == 7:
        return bytes(data).replace(b"\n", b"\r\n")
    else:  # two accidents
        return mutated(mutated(text, rng) or text, rng)
    return bytes(data)
