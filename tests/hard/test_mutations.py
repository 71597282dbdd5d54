"""Every safeguard of mutations.py is missed by its test when it is taken away."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest

_spec = importlib.util.spec_from_file_location("mutations", Path(__file__).with_name("mutations.py"))
mutations = importlib.util.module_from_spec(_spec)
sys.modules["mutations"] = mutations  # dataclasses look their module up
_spec.loader.exec_module(mutations)


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    folder = tmp_path_factory.mktemp("package")
    mutations.copy_of_package(folder)
    return folder


def test_every_text_that_is_replaced_stands_there_once():
    for mutation in mutations.MUTATIONS:
        text = (mutations.ROOT / mutation.file).read_text(encoding="utf-8")
        assert text.count(mutation.old) == 1, (
            f"case {mutation.case}: {mutation.file} has changed; write the mutation anew"
        )


@pytest.mark.slow
@pytest.mark.parametrize("mutation", mutations.MUTATIONS, ids=lambda mutation: f"case {mutation.case}")
def test_a_safeguard_is_missed(mutation, copy):
    assert mutations.goes_red(mutation, copy, before=False)  # the same tests run with the safeguards in place, too
