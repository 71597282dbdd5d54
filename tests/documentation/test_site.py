"""The pages of the documentation site: one a verb, all modules in the reference, no link out of it. CI builds it whole."""

from __future__ import annotations

import importlib.util
import os
import re
import sys
from pathlib import Path
from types import ModuleType

import pytest
from places import PROJECT

needs_extra = pytest.mark.skipif(
    importlib.util.find_spec("griffe") is None and "CI" not in os.environ,
    reason='needs the extra docs: python -m pip install ".[docs]"',
)


def _script(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


API = _script(PROJECT / "docs" / "site" / "api_pages.py")
SITE = _script(PROJECT / "docs" / "make_site.py")


@pytest.fixture(scope="module")
def pages(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("site") / "source"
    SITE.prepare(folder)
    return folder


@needs_extra
def test_every_verb_has_a_page_with_its_help(pages):
    assert {"spectrum", "info", "thermo", "tumble", "gas", "fluid", "cat"} <= set(SITE.verbs())
    for verb in SITE.verbs():
        text = (pages / "verbs" / f"{verb}.md").read_text(encoding="utf-8")
        assert text.startswith(f"# rotor {verb}\n")
        assert f"Usage: rotor {verb}" in text
        options = set(re.findall(r"^  (--[a-z-]+)", text, re.MULTILINE))
        described = text.split("## Help")[0]
        assert options - {"--help"} or verb == "molecules"
        assert "rotor " + verb in described


@needs_extra
def test_every_public_module_is_in_the_reference(pages):
    text = "".join(path.read_text(encoding="utf-8") for path in (pages / "api").glob("rotor*.md"))
    modules = [
        ".".join(path.relative_to(PROJECT).with_suffix("").parts)
        for path in (PROJECT / "rotor").rglob("*.py")
        if not path.stem.startswith("_") and "cli" not in path.parts
    ]
    assert len(modules) > 150
    assert not [module for module in modules if f"## {module}\n" not in text]
    assert "{py:function} line_list(top: rotor.tops.top.Top, *, temperature_k: float = 300.0" in text
    index = (pages / "api" / "index.md").read_text(encoding="utf-8")
    assert "{py:obj}`rotor.api.line_list <rotor.spectra.lines.line_list>`" in index


@needs_extra
def test_a_session_of_a_docstring_is_code_and_symbols_are_text():
    text = API._markdown("Sum of |x|*2 over [a] in `b*c`:\n\n>>> 1 + 1\n2\n\nEnd.")
    assert text == "Sum of |x|\\*2 over \\[a\\] in `b*c`:\n\n```pycon\n>>> 1 + 1\n2\n```\n\nEnd."


@needs_extra
def test_links_stay_on_the_site(pages):
    assert SITE.on_the_site("[a](../examples/04_free_rotation.py)") == "[a](notebooks/04_free_rotation.ipynb)"
    assert SITE.one_level_down("[a](../../CONVENTIONS.md)") == "[a](../conventions.md)"
    assert SITE.on_the_site("see [`data/levels/`](../data/levels).") == "see `data/levels/`."
    for page in [*pages.glob("*.md"), *pages.glob("verbs/*.md"), *pages.glob("how_to/*.md")]:
        for target in re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8")):
            assert target.startswith("http") or (page.parent / target).exists(), f"{page.name}: {target}"


@needs_extra
def test_a_verb_without_a_page_is_refused():
    with pytest.raises(ValueError, match=r"dance\.md is missing"):
        SITE.verb_page("dance")
