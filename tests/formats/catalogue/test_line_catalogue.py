"""The local catalogue: what goes in comes out, faults are named, ranges are found."""

import bz2
from pathlib import Path

import numpy as np
import pytest
from places import SHARED

from rotor import units
from rotor.formats.catalogue.build import SourceFacts, add_sources
from rotor.formats.catalogue.cat_species import read_cat_species
from rotor.formats.catalogue.catdir import read_catdir
from rotor.formats.catalogue.database import LineCatalogue
from rotor.formats.catalogue.names import hill_formula
from rotor.formats.lines.hitran import hitran_lines, write_hitran
from rotor.observed.model.partition import PartitionTable
from rotor.observed.model.species import species_from_lines
from rotor.spectra.lines import line_list
from rotor.tops.top import Top

CO_CAT = """  115271.2018  0.0005 -5.0105 2    0.0000  3 -28503 101 1           0
  230538.0000  0.0005 -4.1197 2    3.8450  5 -28503 101 2           1
  345795.9899  0.0005 -3.6118 2   11.5350  7 -28503 101 3           2
"""
CATDIR = (
    " 28503 CO, v=0    3   2.5595  2.2584  2.0369  1.9123  1.7370  1.4386  1.1429  0.8526  0.5733  0.3389  0.1479\n"
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "cdms").mkdir()
    (tmp_path / "cdms" / "c028503.cat").write_text(CO_CAT)
    (tmp_path / "cdms" / "catdir.cat").write_text(CATDIR)
    return tmp_path


def test_catalogue_of_cdms_gives_back_its_species(folder: Path) -> None:
    report = add_sources(
        folder / "a.rotorcat",
        [str(folder / "cdms")],
        SourceFacts(citation="Endres 2016", inchikeys={"28503": "UGFAIRIUMAVXCW-UHFFFAOYSA-N"}),
    )
    assert [(entry.species, entry.lines, entry.fault) for entry in report] == [("CO, v=0", 3, None)]
    direct = read_cat_species(folder / "cdms" / "c028503.cat")
    with LineCatalogue(folder / "a.rotorcat") as catalogue:
        for word in ("CO, v=0", "CO", "28503", "UGFAIRIUMAVXCW-UHFFFAOYSA-N"):
            (species,) = catalogue.species_between(0.0, 1e9, [word])
        assert species.identity["citation"] == "Endres 2016"
        (part,) = catalogue.species_between(200e3, 300e3)
    for name in ("frequency_mhz", "strength_nm2_mhz", "energy_lower_k", "g_upper", "upper", "lower"):
        assert (getattr(species, name) == getattr(direct, name)).all(), name
    assert species.error_mhz == pytest.approx(direct.error_mhz)  # stored in single precision
    assert species.partition.at(300.0) == direct.partition.at(300.0)
    assert part.upper.tolist() == ["2"]


def test_intensity_and_einstein_coefficient_of_co(folder: Path) -> None:
    """A(1-0) = 7.203e-8 1/s (CDMS, from 0.11011 D) from LGINT and Q(300 K), to the four decimals of both."""
    species = read_cat_species(folder / "cdms" / "c028503.cat")
    exact = 1.1639654e-20 * 115271.2018**3 * 0.11011**2 / 3
    assert species.einstein_a_per_s[0] == pytest.approx(exact, rel=3e-4)
    assert np.log10(species.intensity_nm2_mhz(300.0)[0] * 4.16231 / 4.16238) == pytest.approx(-5.0105, abs=1e-5)


def test_without_a_table_of_species_q_is_summed_and_noted(folder: Path) -> None:
    """At 300 K the intensity is the catalogue's whatever Q is."""
    species = read_cat_species(folder / "cdms" / "c028503.cat", {})
    assert "Q summed over the 4 levels" in species.identity["note"]
    known = read_cat_species(folder / "cdms" / "c028503.cat")
    assert np.allclose(species.intensity_nm2_mhz(300.0), known.intensity_nm2_mhz(300.0), rtol=1e-12)


def test_faulty_line_is_named_and_the_others_are_added(folder: Path) -> None:
    bad = CO_CAT.splitlines(keepends=True)
    bad[1] = bad[1].replace("-4.1197", "-4.1x97")
    (folder / "cdms" / "c000001.cat").write_text("".join(bad))
    report = add_sources(folder / "a.rotorcat", [str(folder / "cdms")])
    assert [entry.fault is None for entry in report] == [False, True]
    assert "c000001.cat" in str(report[0].fault)
    assert "line 2" in str(report[0].fault)
    with LineCatalogue(folder / "a.rotorcat") as catalogue:
        assert len(catalogue) == 3


def test_adding_again_replaces_and_other_sources_stay(folder: Path) -> None:
    path = folder / "a.rotorcat"
    add_sources(path, [str(folder / "cdms")])
    (folder / "other.cat").write_text(CO_CAT.replace("28503", "99999"))
    add_sources(path, [str(folder / "other.cat")])
    add_sources(path, [str(folder / "cdms")])
    with LineCatalogue(path) as catalogue:
        assert len(catalogue) == 6
        frequency = catalogue.lines(0.0, 1e9)["frequency_mhz"]
        assert (np.diff(frequency) >= 0).all()
        assert sorted(catalogue.species().facts["name"]) == ["CO, v=0", "other"]
        with pytest.raises(ValueError, match=r"no species 'CO, v=1'.*CO, v=0"):
            catalogue.numbers("CO, v=1")


def exomol(folder: Path, states: str, trans: str) -> Path:
    (folder / "1H2__test.states").write_text(states)
    with bz2.open(folder / "1H2__test.trans.bz2", "wt") as handle:
        handle.write(trans)
    return folder / "1H2__test.states"


def test_exomol_states_and_packed_transitions(tmp_path: Path) -> None:
    """CO's first levels in ExoMol's form: the same line as from a formula, Q summed over the states."""
    j = np.arange(0, 60)
    b_cm = 1.9225
    states = "".join(f"{n + 1:12d} {b_cm * n * (n + 1):12.6f} {2 * n + 1:6d} {n:7d} + e {0:3d}\n" for n in j.tolist())
    trans = "".join(f"{n + 1:12d} {n:12d} {1e-7 * n**3:10.4e}\n" for n in j[1:].tolist())
    path = exomol(tmp_path, states, trans)
    (report,) = add_sources(tmp_path / "a.rotorcat", [str(path)])
    assert (report.fault, report.lines) == (None, 59)
    with LineCatalogue(tmp_path / "a.rotorcat") as catalogue:
        (species,) = catalogue.species_between(0.0, 300e3)
    assert species.frequency_mhz == pytest.approx(
        [2 * b_cm * n * units.MHZ_PER_CM for n in (1, 2)], rel=1e-9
    )  # six decimals of cm⁻¹
    assert species.einstein_a_per_s == pytest.approx([1e-7, 8e-7], rel=1e-12)
    assert (species.upper.tolist(), species.lower.tolist()) == (["1 + e 0", "2 + e 0"], ["0 + e 0", "1 + e 0"])
    q = float(np.sum((2 * j + 1) * np.exp(-b_cm * j * (j + 1) * units.MHZ_PER_CM / units.MHZ_PER_K / 75.0)))
    assert species.partition.at(75.0) == pytest.approx(q, rel=1e-5)


@pytest.mark.parametrize(
    ("states", "trans", "rule"),
    [
        ("1 0.0 1 0\n2 x 3 1\n", "2 1 1e-7\n", r"\.states, line 2"),
        ("1 0.0 1 0\n2 3.8 3 1\n", "2 1 1e-7\n2 1\n", r"line 2: '2 1"),
        ("1 0.0 1 0\n2 3.8 3 1\n", "3 1 1e-7\n", "state 3 is not in"),
        ("", "2 1 1e-7\n", r"\.states: no states"),
    ],
)
def test_faults_of_exomol_are_named(tmp_path: Path, states: str, trans: str, rule: str) -> None:
    with pytest.raises(ValueError, match=rule):
        add_sources(tmp_path / "a.rotorcat", [str(exomol(tmp_path, states, trans))])
    assert not (tmp_path / "a.rotorcat").exists()


def test_hitran_records(tmp_path: Path) -> None:
    """Records that rotor writes come back with the line list's own intensities."""
    co = Top.from_constants("B=57635.968 D=0.1835 MHz", dipole_abc_debye=(0.11011, 0, 0), name="CO")
    lines = line_list(co, temperature_k=296.0, jmax=20, min_lgint=-9)
    write_hitran(hitran_lines(lines, molecule=5), tmp_path / "co.par")
    (report,) = add_sources(tmp_path / "a.rotorcat", [str(tmp_path / "co.par")])
    assert report.fault is None
    with LineCatalogue(tmp_path / "a.rotorcat") as catalogue:
        (species,) = catalogue.species_between(0.0, 1e9)
    exact = species_from_lines(lines, partition=PartitionTable([296.0], [lines.q]))
    assert species.name == "HITRAN 5, isotopologue 1"
    assert np.allclose(
        species.intensity_nm2_mhz(296.0), exact.intensity_nm2_mhz(296.0), rtol=2e-3
    )  # four digits of A and S
    text = (tmp_path / "co.par").read_text().splitlines(keepends=True)
    (tmp_path / "bad.par").write_text(text[0] + text[1][:30] + "?" + text[1][31:])
    with pytest.raises(ValueError, match=r"bad\.par.*line 2"):
        add_sources(tmp_path / "b.rotorcat", [str(tmp_path / "bad.par")])


def test_what_is_no_catalogue_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.rotorcat").write_text("text")
    (tmp_path / "a.cat").write_text(CO_CAT)
    with pytest.raises(ValueError, match="not a catalogue"):
        add_sources(tmp_path / "a.rotorcat", [str(tmp_path / "a.cat")])
    assert (tmp_path / "a.rotorcat").read_text() == "text"
    with pytest.raises(FileNotFoundError, match="no such catalogue"):
        LineCatalogue(tmp_path / "none")
    with pytest.raises(FileNotFoundError, match=r"expected \.cat"):
        add_sources(tmp_path / "b.rotorcat", [str(tmp_path / "none.cat")])


def test_unknown_line_of_a_table_of_species_is_named() -> None:
    with pytest.raises(ValueError, match="line 2: expected tag"):
        read_catdir(CATDIR.encode() + b"what is this\n")


def test_formulas() -> None:
    names = {
        "CH3C-13-H2CN, v=0": "C2[13C]H5N",
        "N-15-NH+": "HN[15N]+",
        "HDCO-18": "CH[2H][18O]",
        "SiO": "OSi",
        "glycol": "",
    }
    assert {name: hill_formula(name) for name in names} == names


@pytest.mark.oracle
def test_every_catalogue_of_the_reference_is_parsed(tmp_path: Path) -> None:
    """105 catalogues of CDMS and tables of 934 and 401 species."""
    import tarfile

    folder = SHARED / "reference" / "observed"
    if not folder.is_dir():
        pytest.skip("../shared/reference/observed is not there")
    with tarfile.open(folder / "catalogues_233_237GHz.tar.gz") as archive:
        archive.extractall(tmp_path / "cdms", filter="data")
    assert len(read_catdir(folder / "catdir_jpl.cat")) == 401
    report = add_sources(tmp_path / "a.rotorcat", [str(tmp_path / "cdms")], catdir=str(folder / "catdir_cdms.cat"))
    assert (len(report), [entry for entry in report if entry.fault], sum(entry.lines for entry in report)) == (
        105,
        [],
        3496,
    )
    with LineCatalogue(tmp_path / "a.rotorcat") as catalogue:
        assert not any(catalogue.species().facts["note"])


def test_a_fault_leaves_what_the_source_gave_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pieces are stored as they come; a fault in the last one takes them out again."""
    from rotor.formats.catalogue import build, exomol

    monkeypatch.setattr(exomol, "PIECE_BYTES", 10)
    monkeypatch.setattr(build, "_CHECKPOINT_LINES", 1)
    path, states = tmp_path / "a.rotorcat", "1 0.0 1 0\n2 3.8 3 1\n3 11.5 5 2\n"
    source = exomol_source(tmp_path, states, "2 1 1e-7\n3 2 1e-6\n")
    assert [one.lines for one in add_sources(path, [source])] == [2]
    (tmp_path / "co.cat").write_text(CO_CAT)
    faulty = exomol_source(tmp_path, states, "3 2 2e-6\n2 1 2e-7\n9 1 1e-7\n")
    report, carbon_monoxide = add_sources(path, [faulty, str(tmp_path / "co.cat")])
    assert "state 9 is not in" in str(report.fault)
    with LineCatalogue(path) as catalogue:
        assert len(catalogue) == 2 + carbon_monoxide.lines
        (species,) = (species for species in catalogue.species_between(0.0, 1e9) if len(species) == 2)
        assert species.einstein_a_per_s == pytest.approx([1e-7, 1e-6], rel=1e-12)
    add_sources(path, [exomol_source(tmp_path, states, "3 2 2e-6\n")])
    with LineCatalogue(path) as catalogue:
        assert len(catalogue) == 1 + carbon_monoxide.lines


def exomol_source(folder: Path, states: str, trans: str) -> str:
    return str(exomol(folder, states, trans))


def test_pages_of_the_file_take_less_memory_while_lines_are_entered(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """DuckDB's pool of pages grows to its limit: that of the entry is lower than that of the sort."""
    from rotor.formats.catalogue import build
    from rotor.formats.catalogue.database import scalar

    limits = {}

    def noting(name, plain):
        def noted(engine, *more):
            number, unit = scalar(engine, "SELECT current_setting('memory_limit')").split()
            limits[name] = float(number) * {"KiB": 2**10, "MiB": 2**20}[unit] / 1e6
            plain(engine, *more)

        return noted

    for name in ("_insert", "_sort"):
        monkeypatch.setattr(build, name, noting(name, getattr(build, name)))
    add_sources(folder / "a.rotorcat", [str(folder / "cdms")])
    assert limits == pytest.approx({"_insert": 128.0, "_sort": 400.0}, rel=1e-3)
