"""Blends of lines of different species: one measured frequency, all species in one fit; and the files of each species from it."""

from __future__ import annotations

import json
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import least_squares
from view_cases import KELVIN, NAME, SERIES, assign_line, write_case

from rotor.viewer.actions.joint_fits import shared_blends, together
from rotor.viewer.opening import open_session
from rotor.viewer.prediction import changed
from rotor.viewer.records import Line, State

SECOND = {"A": 8000.02, "B": 2990.01, "C": 2500.005}
WEIGHTS = (0.3, 0.7)
BLENDED = (([4, 0, 4], [3, 1, 3]), SERIES[0])  # of the first and of the second species


@pytest.fixture
def service(tmp_path, monkeypatch):
    """Two species with lines of their own, and a blend with a line of each."""
    monkeypatch.chdir(tmp_path)
    write_case(tmp_path)
    opened = open_session("spectrum.csv", [NAME, "A=8000 B=2990 C=2500 MHz"], temperature_k=KELVIN)
    for upper, lower in SERIES:
        assign_line(opened, upper, lower)
    for i, labels in enumerate(SERIES[1:4]):
        f = calculated(opened, 2, labels, SECOND) + 1e-3 * (-1) ** i
        done(opened, "assign", frequency_mhz=f, error_mhz=0.002, to=[target(2, labels)])
    frequencies = [
        calculated(opened, 1, BLENDED[0], {"A": 9000.0, "B": 3000.0}),
        calculated(opened, 2, BLENDED[1], SECOND),
    ]
    to = [target(n, labels) | {"weight": w} for n, labels, w in zip((1, 2), BLENDED, WEIGHTS, strict=True)]
    done(opened, "assign", frequency_mhz=float(np.dot(WEIGHTS, frequencies)) + 2e-3, error_mhz=0.001, to=to)
    yield opened
    opened.session.release()


def done(service, name, **message):
    """The content of an answer that is no error."""
    answer = service.answer({"do": name, **message})
    assert "ok" in answer, answer
    return answer["ok"]


def target(species, labels):
    """A line as a message names it."""
    return {"species": species, "upper": labels[0], "lower": labels[1]}


def calculated(service, number, labels, constants):
    """A line at other constants (MHz)."""
    model = service.predictions.model(changed(service.session.state.species[number], constants))
    return float(model.calculated_mhz(np.array([labels[0]]), np.array([labels[1]]))[0])


def free_of(service):
    """Free constants of both species, as pairs of number and name."""
    return [(n, name) for n, record in service.session.state.species.items() for name in record.free]


def weighted_residuals(service, values):
    """(ν - Σ w ν_i)/σ of every measured frequency, written out line by line."""
    state, moved = service.session.state, {1: {}, 2: {}}
    for (number, name), value in zip(free_of(service), values, strict=True):
        moved[number][name] = float(value)
    lines = state.lines.values()
    out = []
    for blend in sorted({line.blend for line in lines}):
        members = [line for line in lines if line.blend == blend]
        mean = sum(m.weight * calculated(service, m.species, (m.upper, m.lower), moved[m.species]) for m in members)
        out.append((members[0].frequency_mhz - mean / sum(m.weight for m in members)) / members[0].error_mhz)
    return np.array(out)


def test_a_blend_of_two_species_is_one_fit_and_agrees_with_another_program(service):
    state = service.session.state
    before = [state.species[n].constants[name] for n, name in free_of(service)]
    expected = least_squares(
        lambda x: weighted_residuals(service, x),
        before,
        x_scale=1e-3,
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
        diff_step=1e-6,
    )
    steps = len(service.session.done)
    done(service, "refit", species=2)
    assert len(service.session.done) == steps + 1
    species = service.session.state.species
    errors = np.sqrt(np.diag(np.linalg.inv(expected.jac.T @ expected.jac)))
    for i, (number, name) in enumerate(free_of(service)):
        assert abs(species[number].constants[name] - expected.x[i]) < 0.01 * errors[i]  # two minima of one function
        assert species[number].errors[name] == pytest.approx(errors[i], rel=1e-3)  # of numerical derivatives
    assert species[1].fit.lines + species[2].fit.lines == len(service.session.state.lines) == 10
    for number, count in ((1, 6), (2, 4)):
        assert species[number].fit.lines == count
        assert "fitted together" in species[number].fit.notes[0]
    rows, residuals = service.facts()["lines"], weighted_residuals(service, expected.x)
    assert len(residuals) == 9
    blend = next(n for n, line in service.session.state.lines.items() if line.weight == WEIGHTS[0])
    assert rows[str(blend)]["difference_mhz"] / 0.001 == pytest.approx(residuals[-1], abs=0.01)


def test_without_the_shared_frequency_each_species_has_its_fit(service):
    done(service, "refit", species=1)
    joint = service.session.state.species
    done(service, "undo")
    blend = [n for n, line in service.session.state.lines.items() if line.blend in shared_blends(service.session.state)]
    done(service, "reject", lines=blend[:1], rejected=True)
    assert together(service.session.state, 1) == (1,)
    answer = service.answer({"do": "refit", "species": 1})
    assert "ok" in answer
    alone = service.session.state.species
    assert alone[2].fit is None
    assert alone[1].constants["A"] != joint[1].constants["A"]
    done(service, "undo")
    done(service, "undo")
    label = done(service, "refit")["label"]
    assert label == "refit case, A=8000 B=2990 C=2500 MHz"
    assert service.session.state.species == joint


def test_chains_of_shared_blends_are_one_group_and_rejected_lines_link_nothing():
    line = Line(1, (1,), (0,), 1.0, 0.1, 1)
    lines = {}
    for blend, (a, b) in enumerate(pairwise((1, 2, 3))):
        for species in (a, b):
            number = len(lines) + 1
            lines[f"line/{number}"] = Line(species, (1,), (0,), 1.0, 0.1, blend, rejected=number == 4)
    assert together(State(lines), 1) == (1, 2)
    lines["line/4"] = Line(3, (1,), (0,), 1.0, 0.1, 1)
    assert together(State(lines), 1) == together(State(lines), 3) == (1, 2, 3)
    assert together(State({"line/1": line}), 4) == (4,)


def test_files_of_one_species_give_the_constants_of_the_joint_fit(service, call, tmp_path):
    done(service, "refit")
    for number in (1, 2):
        record = service.session.state.species[number]
        for what in ("csv", "toml", "lin"):
            made = done(service, "export", what=what, species=number)
            (tmp_path / f"s.{what}").write_text(made["text"])
        assert "blend with" in (tmp_path / "s.csv").read_text()
        free = ",".join(record.free)
        for suffix in ("csv", "lin"):
            code, _, err = call("fit", f"s.{suffix}", "--start", "s.toml", "--free", free, "--json", "c.json")
            assert code == 0, err
            fitted = {one["name"]: one for one in json.loads((tmp_path / "c.json").read_text())["parameters"]}
            for name in record.free:
                # the least errors of the fit are 0.1 kHz, the files have the lines to 1e-10 MHz
                assert fitted[name]["value"] == pytest.approx(record.constants[name], abs=0.01 * record.errors[name])


def test_a_shared_blend_measures_no_combination_difference(service):
    levels = done(service, "levels", species=1)
    by = [one for one in levels["differences"] if "4 0 4" in one["levels"] or one["by"] == "4 0 4"]
    assert not by


def test_a_species_without_free_constants_is_held(service):
    done(service, "free", species=2, free=[])
    before = service.session.state.species[2]
    done(service, "refit", species=1)
    assert service.session.state.species[2] == before
    assert service.session.state.species[1].fit.lines == 6
    done(service, "free", species=1, free=[])
    error = service.answer({"do": "refit", "species": 1})["error"]
    assert error.startswith("case and A=8000 B=2990 C=2500 MHz: no constant is free")
