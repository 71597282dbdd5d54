"""Polarizabilities of the library's files from refractive indices and depolarization ratios, written as their [polarizability].

`python data/make_polarizabilities.py`. Of a gas of N molecules per volume with index n at the wavelength of a helium-neon laser,
632.8 nm, the mean polarizability as a volume is α = 3/(4πN) (n² - 1)/(n² + 2) (Lorentz and Lorenz), N = p/(Z k T) with the
compressibility Z. The anisotropy is |Δα| = 3 α √((F - 1)/2) of the King correction factor F = 1 + 2 (Δα/(3α))², or of the
depolarization ratio ρ of polarized light with F = (3 + 6ρ)/(3 - 4ρ) (M. Sneep and W. Ubachs, J. Quant. Spectrosc. Radiat.
Transfer 92 (2005) 293). Its sign, which light scattered by a gas does not show, is that of the axis being easier to polarize.
The dispersion formulae were read, with the papers that they are from, in a public program for Rayleigh scattering.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rotor.formats.atomic_write import open_atomic

MOLECULES = Path(__file__).with_name("molecules")
WAVELENGTH_MICROMETRE = 0.6328
BOLTZMANN = 1.380649e-23  # J/K, exact
ATMOSPHERE = 101325.0  # Pa
READ = "read with its sources in a public program for Rayleigh scattering; data/make_polarizabilities.py"


@dataclass(frozen=True)
class Gas:
    """n - 1 and F as functions of s = λ⁻² in µm⁻², the temperature in K and compressibility of n, and where they are from."""

    index: Callable[[float], float]
    king: Callable[[float], float]
    kelvin: float
    compressibility: float
    source: str


def king_of_ratio(ratio: float) -> float:
    """King's factor of the depolarization ratio of polarized light."""
    return (3 + 6 * ratio) / (3 - 4 * ratio)


GASES = {
    "H2": Gas(
        lambda s: (14895.6 / (180.7 - s) + 4903.7 / (92 - s)) * 1e-6,
        lambda s: 1.0312 + 3.09e-4 * s,
        273.15,
        1.000624,
        "E. R. Peck and S. Huang, J. Opt. Soc. Am. 67 (1977) 1550; anisotropy of A. Raj, H. Hamaguchi and H. A. Witek (2018)",
    ),
    "N2": Gas(
        lambda s: (6497.378 + 3073864.9 / (144 - s)) * 1e-8,
        lambda s: 1.034 + 3.17e-4 * s,
        288.15,
        0.999715,
        "E. R. Peck and B. N. Khanna, J. Opt. Soc. Am. 56 (1966) 1059; anisotropy of D. R. Bates, Planet. Space Sci. 32 (1984) 785",
    ),
    "O2": Gas(
        lambda s: 1.181494e-4 + 9.708931e-3 / (75.4 - s),
        lambda s: 1.096 + 1.385e-3 * s + 1.448e-4 * s * s,
        293.15,
        0.999282,
        "P. Křen, Appl. Opt. 50 (2011) 6484; anisotropy of D. R. Bates, Planet. Space Sci. 32 (1984) 785",
    ),
    "CO2": Gas(
        lambda s: sum(a / (b - s) for a, b in CO2_INDEX),
        lambda s: 1.1364 + 25.3e-12 * s * 1e8,
        273.15,
        0.993265,
        "A. Bideau-Mehu et al., Opt. Commun. 9 (1973) 432; anisotropy of G. R. Alms et al., J. Chem. Phys. 63 (1975) 3321",
    ),
    "N2O": Gas(
        lambda s: (22095 + 1.66291e14 / (6.75226e9 - s * 1e8)) * 1e-8,
        lambda s: king_of_ratio(0.0577 + 11.8e-12 * s * 1e8),
        288.15,
        1.0,
        "Q. He et al., Atmos. Chem. Phys. 21 (2021) 14927; anisotropy of G. R. Alms et al., J. Chem. Phys. 63 (1975) 3321",
    ),
    "CO": Gas(
        lambda s: 0.040508 / (123.77 - s),
        lambda _: king_of_ratio(0.0048),
        273.15,
        1.0,
        "C. and M. Cuthbertson (1920); anisotropy of N. J. Bridge and A. D. Buckingham, Proc. R. Soc. Lond. A 295 (1966) 334",
    ),
}
CO2_INDEX = (
    (6.99100e-2, 166.175),
    (1.44720e-3, 79.609),
    (6.42941e-5, 56.3064),
    (5.21306e-5, 46.0196),
    (1.46847e-6, 0.0584738),
)


def mean_and_anisotropy(gas: Gas, wavelength_micrometre: float = WAVELENGTH_MICROMETRE) -> tuple[float, float]:
    """Mean polarizability and anisotropy of a gas in Å³ at a wavelength."""
    s = wavelength_micrometre**-2
    number = ATMOSPHERE / (gas.compressibility * BOLTZMANN * gas.kelvin)
    squared = (1 + gas.index(s)) ** 2
    mean = 3 / (4 * math.pi * number) * (squared - 1) / (squared + 2) * 1e30
    return mean, 3 * mean * math.sqrt((gas.king(s) - 1) / 2)


def section(gas: Gas) -> str:
    """The table of a molecule's file."""
    mean, anisotropy = mean_and_anisotropy(gas)
    return (
        f'[polarizability]\nsource = "at 632.8 nm, from the refractive index of {gas.source}; {READ}"\nunit = "Å3"\n'
        f"mean = {mean:.4f}\nanisotropy = {anisotropy:.4f}\n"
    )


def main() -> None:
    for name, gas in GASES.items():
        path = MOLECULES / f"{name}.toml"
        text, count = re.subn(
            r"\[polarizability\]\n(?:[^\[\n].*\n)*", lambda _, gas=gas: section(gas), path.read_text(encoding="utf-8")
        )
        assert count == 1, name
        with open_atomic(path, "w", encoding="utf-8") as handle:
            handle.write(text)


if __name__ == "__main__":
    main()
