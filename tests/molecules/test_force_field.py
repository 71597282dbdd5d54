"""Force fields: vibrations, finite differences, Hessian files, internal coordinates, geometries refined."""

from __future__ import annotations

import importlib.util
import json

import force_fields
import numpy as np
import pytest
from ase.calculators.lj import LennardJones

import rotor
from rotor.molecules.force_field import (
    EV_PER_ANGSTROM2,
    ForceField,
    force_field_from_calculator,
    force_field_from_internal,
    read_hessian,
    rigid_motions,
)
from rotor.molecules.internal_coordinates import bend, stretch, torsion, wilson_b
from rotor.molecules.molecule import Molecule
from rotor.molecules.optimise import calculator_by_name, refine
from rotor.tops.distortion import distortion_constants

TRIANGLE = Molecule(("Ar",) * 3, 1.1 * np.array([[0, 0, 0], [1, 0, 0], [0.55, 0.8, 0.1]]))


def lennard_jones():
    return LennardJones(rc=1e3, smooth=False)


def test_water_has_the_published_harmonic_wavenumbers():
    computed = force_fields.water().vibrations()
    assert computed.wavenumbers_cm == pytest.approx(
        [1648.5, 3832.2, 3942.5], abs=1.0
    )  # force constants to three digits
    assert computed.left_over_cm < 1e-3  # B of internal coordinates knows no translation


def test_heavy_water_follows_the_product_rule_of_teller_and_redlich():
    """∏ω'/∏ω = √(∏ m/m' · (M'/M)³ · I_a'I_b'I_c' / I_a I_b I_c), exact for a harmonic field (Wilson et al., § 8-5)."""
    from rotor.tops.top import Top

    light, heavy = force_fields.water(), force_fields.water().with_isotopes("H=2H")
    ratio = np.prod(heavy.vibrations().wavenumbers_cm / light.vibrations().wavenumbers_cm)
    masses = np.prod(light.molecule.masses_u / heavy.molecule.masses_u) ** 3
    moments = [np.prod(Top.from_molecule(item.molecule).moments_u_angstrom2) for item in (heavy, light)]
    expected = np.sqrt(masses * (heavy.molecule.mass_u / light.molecule.mass_u) ** 3 * moments[0] / moments[1])
    assert ratio == pytest.approx(expected, rel=1e-9)  # round-off


def test_vibrations_are_orthonormal_and_apart_from_rigid_motions():
    field = force_fields.sulfur_dioxide()
    displacements = np.hstack([field.vibrations().modes, rigid_motions(field.molecule)])
    assert displacements.T @ displacements == pytest.approx(np.eye(9), abs=1e-12)  # round-off


def test_wilson_b_agrees_with_differences():
    rng = np.random.default_rng(2)
    x = rng.normal(size=(4, 3))
    coordinates = [stretch(0, 2), bend(1, 0, 3), bend(2, 0, 3), torsion(0, 1, 2, 3)]
    b = wilson_b(coordinates, x)
    for place in range(12):
        ahead, behind = x.copy(), x.copy()
        ahead.flat[place] += 1e-5
        behind.flat[place] -= 1e-5
        slope = [(c(ahead) - c(behind)) / 2e-5 for c in coordinates]
        assert b[:, place] == pytest.approx(slope, rel=1e-6, abs=1e-7)  # h² of the differences
    assert np.abs(b.reshape(4, 4, 3).sum(axis=1)).max() < 1e-12  # a translation changes none


def test_a_pair_of_lennard_jones_has_its_closed_form():
    """V'' = 72 ε / (2^(1/3) σ²) at the minimum 2^(1/6) σ."""
    pair = refine(Molecule(("Ar", "Ar"), [[0, 0, 0], [0, 0, 1.3]]), lennard_jones(), most_force_ev_per_angstrom=1e-8)
    field = force_field_from_calculator(pair, lennard_jones(), step_angstrom=1e-3)
    stretched = field.hessian_ev_per_angstrom2[2, 2]
    assert stretched == pytest.approx(72 / 2 ** (1 / 3), rel=1e-3)  # h² V''''/6 of the differences
    assert len(field.vibrations().wavenumbers_cm) == 1


def test_a_triangle_becomes_an_oblate_top_and_is_refused_before():
    with pytest.raises(ValueError, match="refine it first"):
        force_field_from_calculator(TRIANGLE, lennard_jones())
    molecule = refine(TRIANGLE, lennard_jones(), most_force_ev_per_angstrom=1e-9)
    assert "largest force left" in molecule.notes[-1]
    field = force_field_from_calculator(molecule, lennard_jones(), step_angstrom=1e-4)
    constants = distortion_constants(field)
    assert constants.kind == "oblate"
    assert constants["DJK"] == pytest.approx(
        -2 * (constants["DJ"] + 2 * constants["DK"]) / 3, rel=1e-3
    )  # planar, Dowling 1961


def test_an_optimisation_that_falls_short_is_an_error():
    with pytest.raises(ValueError, match="in 2 steps: a force of"):
        refine(TRIANGLE, lennard_jones(), most_steps=2)


@pytest.mark.parametrize(
    ("name", "words"),
    [("EMT", "metals"), ("lj", "Lennard-Jones"), ("nosuch", "unknown to ASE"), ("tip3p", "rigid")],
)
def test_calculators_that_are_not_for_molecules(name, words):
    with pytest.raises(ValueError, match=words):
        calculator_by_name(name)


def test_calculators_by_name(monkeypatch):
    import ase.calculators.calculator as library

    import rotor.molecules.optimise as module

    monkeypatch.setattr(library, "get_calculator_class", lambda name: lennard_jones)
    assert isinstance(calculator_by_name(" Gaussian "), LennardJones)

    def missing(name):
        raise ImportError(f"No module named {name!r}")

    monkeypatch.setattr(module, "import_module", lambda name: library if name.startswith("ase") else missing(name))
    with pytest.raises(ValueError, match=r"'tblite' cannot be built here \(No module named 'tblite.ase'\); install"):
        calculator_by_name("tblite")


def test_a_calculator_that_fails_is_named():
    from ase.calculators.emt import EMT

    with pytest.raises(ValueError, match="EMT fails for Xe2"):
        refine(Molecule(("Xe", "Xe"), [[0, 0, 0], [0, 0, 4]]), EMT())


def write_hessian(path, field, unit, triangle):
    values = field.hessian_ev_per_angstrom2 / EV_PER_ANGSTROM2[unit]
    rows = [row[: i + 1] if triangle else row for i, row in enumerate(values)]
    path.write_text(
        "# a Hessian\r\n" + "\r\n".join(" ".join(f"{x:.14e}" for x in row) for row in rows), encoding="utf-8-sig"
    )


@pytest.mark.parametrize("unit", list(EV_PER_ANGSTROM2))
@pytest.mark.parametrize("triangle", [True, False])
def test_hessian_files(tmp_path, unit, triangle):
    field = force_fields.water()
    write_hessian(tmp_path / "h.txt", field, unit, triangle)
    again = read_hessian(tmp_path / "h.txt", field.molecule, unit=unit)
    assert again.vibrations().wavenumbers_cm == pytest.approx(field.vibrations().wavenumbers_cm, rel=1e-10)  # 14 digits


@pytest.mark.parametrize(
    ("text", "words"),
    [("1.0 2.0\n0.5D+01", "line 2: '0.5D.01' has a Fortran exponent"), ("1.0 *****", r"line 1: '\*\*\*\*\*' is no plain"),
     ("1 2 3 4", "4 numbers; a Hessian of 9 coordinates has 81"), ("\u22121.0", "no plain"), ("", "0 numbers")],
)  # fmt: skip
def test_broken_hessian_files(tmp_path, text, words):
    (tmp_path / "h.txt").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=words):
        read_hessian(tmp_path / "h.txt", force_fields.water().molecule)


def test_hessians_that_cannot_be():
    field = force_fields.water()
    molecule, hessian = field.molecule, field.hessian_ev_per_angstrom2
    with pytest.raises(ValueError, match="9 x 9"):
        ForceField(molecule, hessian[:6, :6])
    with pytest.raises(ValueError, match="transpose"):
        ForceField(molecule, np.triu(hessian))
    with pytest.raises(ValueError, match="not a minimum"):
        ForceField(molecule, -hessian).vibrations()
    with pytest.raises(ValueError, match="another geometry"):
        ForceField(molecule.moved([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]), hessian).vibrations()
    with pytest.raises(ValueError, match="unit 'erg'"):
        read_hessian("none", molecule, unit="erg")
    with pytest.raises(ValueError, match="force constants of shape"):
        force_field_from_internal(molecule, [stretch(0, 1)], np.eye(2))


def test_calculator_on_the_command_line(tmp_path, monkeypatch, capsys):
    import rotor.molecules.optimise as module
    from rotor.cli import run

    monkeypatch.setattr(module, "calculator_by_name", lambda name: lennard_jones())
    (tmp_path / "pair.xyz").write_text("2\n\nAr 0 0 0\nAr 0 0 1.3\n")
    assert run(["info", str(tmp_path / "pair.xyz"), "--calculator", "xtb", "--json", "-"]) == 0
    out, err = capsys.readouterr()
    b = 505379.00844 / (39.9623831 / 2 * 2 ** (1 / 3))  # at the minimum 2^(1/6) Å
    assert json.loads(out)["constants_mhz"]["B"] == pytest.approx(b, rel=1e-3)  # a force of 1e-3 is left
    assert "geometry refined with LennardJones" in err


@pytest.mark.skipif(importlib.util.find_spec("tblite") is None, reason="tblite is not installed (pip install tblite)")
def test_tblite_takes_a_smiles_to_distortion_constants(capfd):
    """GFN2-xTB for H2CO: a real calculator from geometry to quartic constants, and nothing of its own on standard output."""
    from rotor.cli import run

    arguments = ["info", "SMILES:C=O", "--calculator", "tblite", "--hessian", "calculator", "--json", "-"]
    assert run(arguments) == 0
    out, err = capfd.readouterr()
    content = json.loads(out)
    assert content["point_group"] == "C2v"
    measured = rotor.read("H2CO").constants
    for name in "ABC":
        assert content["constants_mhz"][name] == pytest.approx(measured[name], rel=0.04), (
            name
        )  # GFN2: 3.4, 1.5 and 2.1 %
    for name in ("DJ", "DJK", "DK", "d1", "d2"):
        # GFN2's force field: 3, 7, 13, 6 and 9 %
        assert content["constants_mhz"][name] == pytest.approx(measured[name], rel=0.15), name
    assert "geometry refined with TBLite" in err
    assert "harmonic force field (TBLite" in err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [(["water", "--calculator", "EMT"], "--calculator: calculator 'EMT'"), (["--constants", "B=1", "--calculator", "x"], "no geometry"),
     (["water", "--conformers", "5"], "conformers need a SMILES"), (["SMILES:CC", "--conformers", "0"], "--conformers: 0")],
)  # fmt: skip
def test_mistakes_with_calculators_and_conformers(capsys, arguments, words):
    from rotor.cli import run

    assert run(["info", *arguments]) == 2
    assert words in capsys.readouterr().err


def test_conformers_on_the_command_line(capsys):
    from rotor.cli import run

    assert run(["info", "SMILES:CCCC", "--conformers", "20", "--json", "-"]) == 0
    content = json.loads(capsys.readouterr().out)["conformers"]
    assert [round(entry["energy_kj_per_mol"], 1) for entry in content] == [0.0, 3.3]
    assert all(len(entry["rotational_constants_mhz"]) == 3 for entry in content)
    assert run(["info", "SMILES:CCCC", "--conformers", "20"]) == 0
    assert "E (kJ/mol)" in capsys.readouterr().out


def test_hessian_on_the_command_line(tmp_path, capsys):
    from rotor.cli import run

    field = force_fields.water()
    write_hessian(tmp_path / "h.txt", field, "hartree/bohr²", True)
    rows = [
        f"{s} {x:.9f} {y:.9f} {z:.9f}" for s, (x, y, z) in zip("OHH", field.molecule.positions_angstrom, strict=True)
    ]
    (tmp_path / "w.xyz").write_text("3\n\n" + "\n".join(rows) + "\n")
    arguments = ["info", str(tmp_path / "w.xyz"), "--hessian", str(tmp_path / "h.txt"), "--json", "-"]
    assert run([*arguments, "--isotope", "H=2H"]) == 0
    out, err = capsys.readouterr()
    expected = distortion_constants(field.with_isotopes("H=2H"))
    assert json.loads(out)["constants_mhz"] == pytest.approx(
        dict(expected.values), rel=1e-6
    )  # positions of nine digits
    assert "quartic distortion from a harmonic force field" in err
    assert "vibration causes an inertial defect of 0.062" in err  # D2O; measured constants 0.067
    assert run(["info", "water", "--hessian", "calculator"]) == 2
    assert run(["info", "--constants", "B=1", "--hessian", "h.txt"]) == 2
    assert run(["info", "water", "--hessian", str(tmp_path / "none.txt")]) == 2
    errors = capsys.readouterr().err
    assert "needs --calculator" in errors
    assert "--hessian: bare constants" in errors
    assert "none.txt: no such file" in errors
