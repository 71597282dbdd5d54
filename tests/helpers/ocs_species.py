"""Isotopologues of OCS."""

from __future__ import annotations

OCS_SPECIES = [  # B in MHz, fitted to the measured lines of CDMS c060503, c061502, c062505, c062506, see the test of the catalogues
    ("OCS", "", {"B": 6081.492114}, {"B": 6e-6}),
    ("O13CS", "C=13C", {"B": 6061.923848}, {"B": 2e-5}),
    ("OC34S", "S=34S", {"B": 5932.833732}, {"B": 2e-6}),
    ("18OCS", "O=18O", {"B": 5704.857421}, {"B": 4e-5}),
]
