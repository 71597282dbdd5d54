"""`rotor identify`: species that an observed spectrum needs, ranked by evidence, and unidentified lines."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotor.frozen import dataclass
from rotor.reports.progress import rewritten_line
from rotor.reports.screen import Part, record_table
from rotor.reports.top_facts import error_facts
from rotor.requests.field import CONDITIONS, REQUIRED, declared, identical, part
from rotor.requests.readers import INFINITE, Names, Quantity, Range, Text, Whole
from rotor.spectra.emission.emission import BACKGROUND_K
from rotor.table import counted
from rotor.verbs.common.outputs import PICTURES, Output, Report, table_file
from rotor.verbs.common.verb import ErrorsShown, Tool, Work
from rotor.verbs.measurements.observed_file import SpectrumFile, json_of, layer_field, padded, spectrum_facts

if TYPE_CHECKING:
    from rotor.observed.identification.identify import Identification
    from rotor.observed.model.model import Sight
    from rotor.observed.model.species import SpeciesLines
    from rotor.observed.spectrum import ObservedSpectrum
    from rotor.requests.budget import ErrorBudget

CAT = (".cat", ".cat.gz")
source_field = partial(declared, panel=CONDITIONS)  # a field under this heading of --help
EXAMPLES = """\
  rotor identify spectrum.fits --catalogue lines.rotorcat --plot pages.pdf
  rotor identify spectrum.txt --catalogue cdms/ --velocity 2.7 --width 1 --beam 0.5 --size 0.5
  rotor identify cube.fits --pixel 32,40 --catalogue lines.rotorcat --json -"""


@dataclass(frozen=True)
class IdentifyRequest:
    """The spectrum, the candidates, and settings of the search."""

    file: str = declared(REQUIRED, Text(), "Spectrum: FITS or text", option="FILE")
    catalogue: tuple[str, ...] = declared((), Names("FILE"), "Local catalogue, folder of .cat, or .cat; repeatable")
    range_mhz: tuple[float, float] = declared(INFINITE, Range("MHz"), "Range of frequencies (MHz)", option="--range")
    velocity_km_s: float | None = source_field(
        None, Quantity("km/s", metavar="V"), "Velocity of the source (km/s); by default estimated", option="--velocity"
    )
    fwhm_km_s: float | None = source_field(
        None, Quantity("km/s", metavar="W"), "Full width of the lines (km/s); by default estimated", option="--width"
    )
    background_k: float = layer_field("background_k", BACKGROUND_K)
    redshift: float = layer_field("redshift", 0.0)
    model_error: float = declared(0.1, Quantity(least=0, most=1), "Error of the model as a fraction of the brightness")
    most: int = declared(60, Whole(1), "Largest number of species")
    spectrum: SpectrumFile = part(SpectrumFile, identical, identical, SpectrumFile())

    def __post_init__(self) -> None:
        if not self.catalogue:
            raise ValueError(
                "catalogue: expected a local catalogue ('rotor catalogue add'), a folder of .cat files, or a .cat file"
            )


@dataclass(frozen=True)
class Identified:
    """The spectrum and its species."""

    observed: ObservedSpectrum
    sight: Sight
    identification: Identification
    model_error: float

    def facts(self) -> dict[str, Any]:
        """Spectrum and species, by the keys of docs/verbs."""
        return {"spectrum": json_of(self.observed), **self.identification.facts(), "errors": self.errors.as_json()}

    @property
    def errors(self) -> ErrorBudget:
        """Error budget of the column densities."""
        from rotor.observed.budgets import columns_budget

        return columns_budget(self.identification.fit, self.model_error)


def answer(request: IdentifyRequest, work: Work) -> Identified:
    """The species, ranked by evidence."""
    from rotor.observed.identification.identify import identify
    from rotor.observed.identification.selection import IdentifyChoices

    choices = IdentifyChoices(
        velocity_km_s=request.velocity_km_s,
        fwhm_km_s=request.fwhm_km_s,
        model_error=request.model_error,
        most_species=request.most,
        size_arcsec=request.spectrum.size_arcsec,
    )
    observed = request.spectrum.read(request.file, request.range_mhz)
    sight = request.spectrum.sight(observed, request.background_k, request.redshift)
    candidates = _candidates(request.catalogue, padded(observed, request.redshift))
    with rewritten_line(60) as progress:
        identification = identify(observed, candidates, sight, choices, progress=progress)
    return Identified(observed, sight, identification, request.model_error)


def _candidates(sources: Sequence[str], range_mhz: tuple[float, float]) -> list[SpeciesLines]:
    """Species with lines in the range, from catalogues, folders and files."""
    from rotor.formats.catalogue.cat_species import read_cat_species
    from rotor.formats.catalogue.catdir import is_catdir
    from rotor.formats.catalogue.database import LineCatalogue

    out: list[SpeciesLines] = []
    for source in sources:
        path = Path(source)
        if not path.exists():
            raise ValueError(f"--catalogue {source}: no such file or folder")
        if path.is_dir() or path.name.lower().endswith(CAT):
            files = (
                [candidate for candidate in sorted(path.rglob("*.cat*")) if candidate.name.lower().endswith(CAT)]
                if path.is_dir()
                else [path]
            )
            species = [read_cat_species(file) for file in files if not is_catdir(file)]
            in_range = [lines.between(*range_mhz) for lines in species]
            out += [lines for lines in in_range if len(lines)]
            if path.is_dir() and not files:
                raise ValueError(f"--catalogue {source}: no .cat file in this folder")
        else:
            with LineCatalogue(path) as catalogue:
                out += catalogue.species_between(*range_mhz)
    return out


def draw(answer: Identified, path: Path, report: Report) -> None:
    """Draw pages of panels with the fitted model."""
    from rotor.plots.spectra.overlay import plot_overlay

    components = [evidence.component for evidence in answer.identification.species]
    marked = [line.frequency_mhz for line in answer.identification.unidentified]
    plot_overlay(
        answer.observed, components, path, sight=answer.sight, unidentified_mhz=marked, provenance=report.command
    )


def show(answer: Identified, report: Report) -> Iterable[Part | None]:
    """The spectrum, the species by evidence and the unidentified lines."""
    identification = answer.identification
    chi = "" if identification.fit is None else f", χ²/ν = {identification.fit.reduced_chi_squared:.3g}"
    yield spectrum_facts(report.content["spectrum"])
    yield [
        ("candidates", str(identification.candidates)),
        ("start", f"velocity {identification.velocity_km_s:.2f} km/s, width {identification.fwhm_km_s:.2f} km/s"),
        ("species", f"{len(identification.species)}{chi}"),
        *error_facts(report.content.get("errors")),
    ]
    yield record_table("species by evidence", _SPECIES, identification.species, {"species", "lines seen", "or"})
    if count := sum(evidence.single_line for evidence in identification.species):
        single = f"* {counted(count, 'species', 'species')} on a single line"
        yield f"{single}: a line of a species that is no candidate may pass for it"
    if uncertain := [evidence for evidence in identification.species if evidence.uncertain]:
        verb = "is" if len(uncertain) == 1 else "are"
        yield (
            f"? {counted(len(uncertain), 'species', 'species')} {verb} uncertain: as many of its lines would lie on signals by chance in "
            f"{max(evidence.chance for evidence in uncertain):.2g} of {identification.candidates} candidates; take a wider range"
        )
    lines = sorted(identification.unidentified, key=lambda line: line.frequency_mhz)
    yield record_table(f"{len(lines)} unidentified lines", _UNIDENTIFIED, lines, {"candidates with a line there"})
    yield "" if lines else "no unidentified line above 5 standard deviations"


_SPECIES = {
    "species": "{0.component.species.name}",
    "Δχ²": "{0.signal:.0f}",
    "lines seen": lambda evidence: (
        f"{evidence.visible}/{evidence.expected}{' *' * evidence.single_line}{' ?' * evidence.uncertain}"
    ),
    "N (1/cm²)": "{0.component.column_per_cm2:.2e}",
    "T (K)": "{0.component.excitation_k:.0f}",
    "v (km/s)": "{0.component.velocity_km_s:.2f}",
    "Δv (km/s)": "{0.component.fwhm_km_s:.2f}",
    "or": lambda evidence: ", ".join(evidence.rivals),
}
_UNIDENTIFIED = {
    "frequency (MHz)": "{0.frequency_mhz:.3f}",
    "T_B (K)": "{0.peak_k:.3g}",
    "σ": "{0.deviations:.1f}",
    "candidates with a line there": lambda line: ", ".join(line.candidates) or "none",
}


VERB = Tool(
    name="identify",
    about="Species that an observed spectrum needs, by evidence; unidentified lines.",
    examples=EXAMPLES,
    small_blocks=True,
    request=IdentifyRequest,
    of="file",
    answer=answer,
    table=lambda answer: answer.identification,
    show=show,
    outputs=(
        table_file("csv", "the species"),
        Output("plot", PICTURES, "Draw pages of panels with the model over the spectrum", draw),
    ),
    shown=ErrorsShown,
    stepwise=True,
)
