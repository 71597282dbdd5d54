"""Tables of the kind that quantum chemistry programs print."""

import numpy as np

NUMBERS = (8, 1, 1)

TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])  # a proper rotation in whole hundredths


def table(title, positions, numbers=NUMBERS):
    head = f"{title:>45}\n {'-' * 69}\n Center     Atomic      Atomic             Coordinates (Angstroms)\n"
    head += f" Number     Number       Type             X           Y           Z\n {'-' * 69}\n"
    rows = "".join(
        f"{i + 1:7d}{z:11d}           0     {x:12.6f}{y:12.6f}{w:12.6f}\n"
        for i, (z, (x, y, w)) in enumerate(zip(numbers, positions, strict=True))
    )
    return head + rows + f" {'-' * 69}\n"
