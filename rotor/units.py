"""Physical constants and conversions, each with its source, and the parser of numbers with units.

Constants are CODATA 2022 (exact ones by definition of the SI of 2019). A test compares them with `scipy.constants`,
which is not imported here because it would double the time of `import rotor`.
"""

import math
import re
from collections.abc import Sequence
from numbers import Real

import numpy as np
from numpy.typing import NDArray

CODATA_EDITION = "2022"

SPEED_OF_LIGHT_M_PER_S = 299792458.0  # exact
PLANCK_J_S = 6.62607015e-34  # exact
BOLTZMANN_J_PER_K = 1.380649e-23  # exact
ELEMENTARY_CHARGE_C = 1.602176634e-19  # exact
AVOGADRO_PER_MOL = 6.02214076e23  # exact
ATOMIC_MASS_KG = 1.66053906892e-27  # CODATA 2022
BOHR_RADIUS_ANGSTROM = 0.529177210544  # CODATA 2022
ELECTRON_MASS_KG = 9.1093837139e-31  # CODATA 2022
NUCLEAR_MAGNETON_MHZ_PER_T = 7.6225932188  # CODATA 2022
HARTREE_EV = 27.211386245981  # CODATA 2022
VACUUM_PERMITTIVITY_F_PER_M = 8.8541878188e-12  # CODATA 2022
QUADRUPOLE_MHZ_PER_BARN_AU = (  # e Q q/h of 1 barn in a field gradient of 1 Eh/(e a0²): 234.9647...
    HARTREE_EV * ELEMENTARY_CHARGE_C / (BOHR_RADIUS_ANGSTROM * 1e-10) ** 2 * 1e-28 / PLANCK_J_S * 1e-6
)

MHZ_PER_CM = 29979.2458  # 1 cm^-1 in MHz, exact
MHZ_PER_K = BOLTZMANN_J_PER_K / PLANCK_J_S * 1e-6  # 1 K in MHz, exact ratio: 20836.6191...
DEBYE_C_M = 1e-21 / SPEED_OF_LIGHT_M_PER_S  # 1 D = 1e-18 esu cm, exact by definition
MHZ_PER_DEBYE_KV_PER_CM = DEBYE_C_M * 1e5 / PLANCK_J_S * 1e-6  # μE/h of 1 D in 1 kV/cm: 503.4116...
DEBYE_PER_E_ANGSTROM = ELEMENTARY_CHARGE_C * 1e-10 / DEBYE_C_M  # 4.80320...

# units of ASE, used for classical motion: eV, Å, u, and those derived from them
ASE_TIME_PS = 1e2 * math.sqrt(ATOMIC_MASS_KG / ELEMENTARY_CHARGE_C)  # 1 Å √(u/eV) in ps: 0.01018...
HBAR_CLASSICAL = PLANCK_J_S / (2 * math.pi * 1e-10 * math.sqrt(ATOMIC_MASS_KG * ELEMENTARY_CHARGE_C))  # in Å √(u eV)
NM2_IN_CM2 = 1e-14
# integrated absorption of 1 cm/molecule in nm² MHz: c in cm/s times 1e8, exact
NM2_MHZ_PER_CM = SPEED_OF_LIGHT_M_PER_S * 1e10
EV_PER_K = BOLTZMANN_J_PER_K / ELEMENTARY_CHARGE_C  # exact ratio
EV_PER_ANGSTROM3_BAR = ELEMENTARY_CHARGE_C * 1e25  # 1 eV/Å³ in bar, exact
KJ_PER_MOL_EV = ELEMENTARY_CHARGE_C * AVOGADRO_PER_MOL * 1e-3  # 1 eV in kJ/mol, exact: 96.4853...
CM_PER_EV = ELEMENTARY_CHARGE_C / PLANCK_J_S * 1e-6 / MHZ_PER_CM  # 1 eV in cm^-1, exact ratio: 8065.54...

# A = hbar / (4 pi I): MHz times u angstrom^2
ROTATIONAL_MHZ_U_ANGSTROM2 = PLANCK_J_S / (8 * math.pi**2 * ATOMIC_MASS_KG * 1e-20) * 1e-6

_FREQUENCY = {"Hz": 1e-6, "kHz": 1e-3, "MHz": 1.0, "GHz": 1e3, "THz": 1e6, "cm-1": MHZ_PER_CM, "K": MHZ_PER_K}
_KINDS: dict[str, dict[str, float]] = {
    "temperature": {
        "mK": 1e-3,
        "K": 1.0,
    },  # first: a quantity declared in K is a temperature, though a typed K may also be an energy
    "frequency": _FREQUENCY,
    "length": {
        "pm": 0.01,
        "angstrom": 1.0,
        "Å": 1.0,
        "nm": 10.0,
        "bohr": BOHR_RADIUS_ANGSTROM,
        "um": 1e4,
        "mm": 1e7,
        "cm": 1e8,
        "m": 1e10,
        "km": 1e13,
    },
    "dipole": {"D": 1.0, "debye": 1.0, "e*angstrom": DEBYE_PER_E_ANGSTROM, "C*m": 1.0 / DEBYE_C_M},
    "polarizability": {"angstrom3": 1.0, "Å3": 1.0, "bohr3": BOHR_RADIUS_ANGSTROM**3},
    "time": {"fs": 1e-3, "ps": 1.0, "ns": 1e3, "us": 1e6, "ms": 1e9, "s": 1e12, "min": 60e12, "h": 3600e12},
    "field": {"V/cm": 1e-3, "kV/cm": 1.0, "V/m": 1e-5, "MV/m": 10.0},
    "intensity": {"W/cm2": 1.0, "GW/cm2": 1e9, "TW/cm2": 1e12, "W/m2": 1e-4},
    "fluence": {"J/cm2": 1.0, "mJ/cm2": 1e-3, "J/m2": 1e-4},
    "magnetic field": {"T": 1.0, "mT": 1e-3, "G": 1e-4, "gauss": 1e-4},
    "mass": {"u": 1.0, "amu": 1.0, "Da": 1.0, "kg": 1.0 / ATOMIC_MASS_KG},
    "moment of inertia": {"kg*m2": 1.0, "g*cm2": 1e-7, "u*Å2": ATOMIC_MASS_KG * 1e-20},
    "angular velocity": {
        "rad/s": 1.0,
        "deg/s": math.pi / 180,
        "rpm": math.pi / 30,
        "turns/s": 2 * math.pi,
        "rad/ps": 1e12,
    },
    "number": {"": 1.0},
    "fraction": {"fraction": 1.0, "%": 0.01},
    "density": {"g/cm3": 1.0, "kg/m3": 1e-3},
    "speed": {"km/s": 1.0, "m/s": 1e-3, "cm/s": 1e-5},
    "column density": {"1/cm2": 1.0, "1/m2": 1e-4},
    "angular momentum": {"ħ": 1.0},
    "rate": {"1/ps": 1.0, "1/fs": 1e3, "1/ns": 1e-3, "1/s": 1e-12},
    "angle": {"deg": 1.0, "rad": 180 / math.pi, "arcmin": 1 / 60, "arcsec": 1 / 3600, "mas": 1e-3 / 3600},
    "pressure": {"Pa": 1e-5, "mbar": 1e-3, "kPa": 1e-2, "bar": 1.0, "Torr": 1.33322368421e-3, "atm": 1.01325},
}
_ALIASES = {
    "cm^-1": "cm-1", "cm⁻¹": "cm-1", "1/cm": "cm-1", "μs": "us", "μm": "um", "Debye": "debye", "Angstrom": "angstrom",
    "Å^3": "Å3", "Å³": "Å3", "angstrom^3": "angstrom3",
    "u A^2": "u*Å2", "u A2": "u*Å2", "u A²": "u*Å2", "u*A2": "u*Å2", "u*A^2": "u*Å2", "u Å2": "u*Å2", "u Å^2": "u*Å2", "u Å²": "u*Å2",
    "u*Å²": "u*Å2", "u angstrom2": "u*Å2", "u*angstrom2": "u*Å2", "u angstrom^2": "u*Å2", "u*angstrom^2": "u*Å2", "u*Å^2": "u*Å2",
    "kg m2": "kg*m2", "kg m^2": "kg*m2", "kg m²": "kg*m2", "g cm2": "g*cm2", "g cm^2": "g*cm2", "g cm²": "g*cm2",
    "g/cm^3": "g/cm3", "g/cm³": "g/cm3", "kg/m^3": "kg/m3", "kg/m³": "kg/m3",
    "cm-2": "1/cm2", "cm^-2": "1/cm2", "cm⁻²": "1/cm2", "/cm2": "1/cm2", "/cm^2": "1/cm2", "/cm²": "1/cm2", "1/cm²": "1/cm2",
    "m-2": "1/m2", "m^-2": "1/m2", "m⁻²": "1/m2", "/m2": "1/m2", "/m^2": "1/m2", "/m²": "1/m2", "1/m²": "1/m2",
    "/ps": "1/ps", "ps-1": "1/ps", "/fs": "1/fs", "/ns": "1/ns", "/s": "1/s", "°": "deg", "degrees": "deg", "degree": "deg",
    "hbar": "ħ", "″": "arcsec",
    "W/cm^2": "W/cm2", "W/cm²": "W/cm2", "TW/cm^2": "TW/cm2", "TW/cm²": "TW/cm2", "J/cm^2": "J/cm2", "J/cm²": "J/cm2",
}  # fmt: skip
LEAST_KELVIN, MOST_KELVIN = 1e-9, 1e6  # limits of molecular gases
MOST_POINTS = 10_000_000  # of a grid: 80 MB of numbers
_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(\S.*?)?\s*$")


def _unit_kind(unit: str) -> str:
    return next(kind for kind, table in _KINDS.items() if unit in table)


def _factor(unit: str, expected: str) -> float:
    """The factor from a unit to the expected one."""
    unit = _ALIASES.get(unit, unit)
    table = _KINDS[_unit_kind(expected)]
    if unit in table:
        return table[unit] / table[expected]
    if expected in ("", "fraction"):
        raise ValueError(f"expected plain numbers here, without the unit {unit!r}")
    is_unit = any(unit in other for other in _KINDS.values())
    what = "does not measure the same thing as" if is_unit else "is not a known unit; the default is"
    raise ValueError(f"unit {unit!r} {what} {expected!r}; use one of {', '.join(table)}")


def _numbers(items: Sequence[str], unit: str, text: str) -> list[float]:
    """Numbers in `unit` of the items of a text, such as "9.2 GHz"; one without a unit has the last that the text names.

    A Unicode minus is accepted.
    """
    parts: list[tuple[float, str]] = []
    for item in items:
        match = _NUMBER.match(item.replace("−", "-"))
        if not match:
            raise ValueError(f"{item!r} is not a number with an optional unit, such as '9.2' or '9.2 GHz'")
        parts.append((float(match[1]), match[2] or ""))
    shared = next((typed for _, typed in reversed(parts) if typed), "")
    try:
        return [number * (_factor(typed or shared, unit) if typed or shared else 1.0) for number, typed in parts]
    except ValueError as error:
        raise ValueError(f"{text!r}: {error}") from None


def parse_quantity(value: float | Real | str, unit: str) -> float:
    """A number in `unit`, from a number in that unit or a text that may carry another unit.

    Raises ValueError for a text without a number, a unit of another kind, and non-finite values.

    >>> parse_quantity("9.2 GHz", "MHz")
    9200.0
    >>> parse_quantity("1 cm-1", "MHz")
    29979.2458
    """
    if isinstance(value, str):
        (value,) = _numbers([value], unit, value)
    if not math.isfinite(value):
        raise ValueError(f"{value!r} is not a finite number of {unit}")
    return float(value)


_BETWEEN = re.compile(r"\s*((?:\d+\.?\d*|\.\d+)\s*(?:[kMGT]?Hz|[kM]?V/cm|K|ps)?)\s*[-–]\s*(\d\S*(?:\s[^:]*)?)")


def _bounds(text: str, unit: str) -> tuple[float, float, str | None]:
    """Both ends of `start:stop` in `unit`, and the text of the count; a unit at one end serves both.

    A hyphen between two numbers without signs is a colon, `90-100GHz`.
    """
    hyphen = _BETWEEN.fullmatch(text)
    parts = (f"{hyphen[1]}:{hyphen[2]}" if hyphen else text).split(":")
    if len(parts) not in (2, 3) or not all(part.strip() for part in parts):
        raise ValueError(f"{text!r} is not a range; write start:stop or start:stop:count, such as '2:18GHz'")
    first, last = _numbers(parts[:2], unit, text)
    if not first < last:
        numbers = f"{first:g} is not below {last:g} {unit}".rstrip()
        raise ValueError(f"{text!r}: the range must rise, but {numbers}")
    return first, last, parts[2] if len(parts) == 3 else None


def parse_range(text: str, unit: str) -> tuple[float, float]:
    """Both ends of `start:stop` in `unit`; a unit at one end serves both.

    >>> parse_range("2:18GHz", "MHz"), parse_range("2-18 GHz", "MHz")
    ((2000.0, 18000.0), (2000.0, 18000.0))
    """
    first, last, count = _bounds(text, unit)
    if count is not None:
        raise ValueError(f"{text!r}: expected a plain range start:stop here, without a count")
    return first, last


def parse_grid(text: str, unit: str, points: int | None = None) -> NDArray[np.float64]:
    """Points in `unit` from `start:stop:count`, or from a comma list with a unit at any item; points: default count.

    >>> parse_grid("0:200kV/cm:3", "kV/cm")
    array([  0., 100., 200.])
    >>> parse_grid("0:1:3", "")  # plain numbers
    array([0. , 0.5, 1. ])
    >>> parse_grid("1,2,5 GHz", "MHz")
    array([1000., 2000., 5000.])
    """
    if ":" not in text and not _BETWEEN.fullmatch(text):
        return np.array(_numbers(text.split(","), unit, text))

    first, last, count = _bounds(text, unit)
    count = str(points) if count is None and points is not None else count
    if count is None or not count.strip().isdecimal() or float(count) < 2:
        raise ValueError(f"{text!r}: a grid is start:stop:count with a whole count of 2 or more, or a comma list")
    if float(count) > MOST_POINTS:
        raise ValueError(f"{text!r:.60}: a grid has at most {MOST_POINTS} points; ask for fewer")
    return np.linspace(first, last, int(count))
