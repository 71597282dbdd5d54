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
