"""Files about the package say the same as the package."""

import re
from pathlib import Path

from places import PROJECT

import rotor
from rotor.version import VERSION


def test_citation_has_the_version_of_the_package():
    assert (
        re.search(r"^version: (\S+)$", (PROJECT / "CITATION.cff").read_text(), re.M).group(1)
        == VERSION
        == rotor.__version__
    )


def test_changelog_has_a_section_for_the_version():
    release = VERSION.partition(".dev")[0]
    assert f"## [{release}]" in (PROJECT / "CHANGELOG.md").read_text()


def test_the_package_is_marked_as_typed():
    assert (Path(rotor.__file__).parent / "py.typed").is_file()


def test_the_workflow_runs_every_python_and_system_that_is_supported():
    """Linux with the oldest Python runs everything; the others run the tests."""
    metadata = (PROJECT / "pyproject.toml").read_text(encoding="utf-8")
    workflow = (PROJECT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8")
    pythons = re.findall(r"Programming Language :: Python :: (3\.\d+)", metadata)
    assert pythons == ["3.11", "3.12", "3.13", "3.14"]
    assert f"python: {pythons}".replace("'", '"') in workflow
    assert "os: [ubuntu-latest, macos-latest, windows-latest]" in workflow
    assert 'python-version: "3.11"\n      - run: bash .ci/run' in workflow
    contributing = (PROJECT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    assert "Python 3.11 to 3.14 on Linux, macOS and Windows" in contributing
