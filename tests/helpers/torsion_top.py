"""A top with internal rotation, for its Stark maps."""

import rotor
from rotor.tops.internal_rotation import InternalRotationConstants

CM = rotor.units.MHZ_PER_CM

ABC = {"A": 9000.0, "B": 4200.0, "C": 3100.0}

DIPOLE = (1.5, 0.8, 0.0)


def turning(rho=0.08, dab=700.0, v3=40.0, frame="RAM", **settings):
    constants = rotor.Constants(**ABC, reduction="A", representation="Ir")
    values = {"F": 5.2 * CM, "rho": rho, "V3": v3 * CM, "Dab": dab}
    if frame == "PAM":
        values = {"F0": 158e3, "delta": 0.7, "V3": v3 * CM}
    internal = InternalRotationConstants(values, frame, **settings)
    return rotor.Top.from_constants(constants, dipole_abc_debye=DIPOLE, internal_rotation=internal)
