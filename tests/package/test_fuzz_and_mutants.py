"""The fuzzer of values and the mutation run of benchmarks/: what they change, and what they count."""

from __future__ import annotations

import ast
import importlib
import random
import sys
from collections import Counter

import pytest
from places import PROJECT

BENCHMARKS = PROJECT / "benchmarks"


@pytest.fixture(scope="module")
def benchmarks():
    """Modules of benchmarks/, which import each other by name."""
    sys.path.insert(0, str(BENCHMARKS))
    yield importlib.import_module
    sys.path.remove(str(BENCHMARKS))


# Values


def test_changed_numbers_are_numbers_in_their_notation(benchmarks):
    fuzz_values, rng = benchmarks("fuzz_values"), random.Random(5)
    texts = [fuzz_values.changed_text("A=9.2 B=3 C=2.5 GHz", rng, 1.0) for _ in range(300)]
    changed = [[float(word.partition("=")[2]) for word in text.split()[:3]] for text in texts]
    ratio = sorted(abs(a / 9.2) for a, _, _ in changed)
    assert all(text.endswith(" GHz") for text in texts)
    assert len(set(texts)) > 250  # few draws coincide
    assert 0.6 < ratio[75] < ratio[225] < 1.7  # half lie within a factor near 1: ln of it has a sigma of 0.4
    assert ratio[0] < 0.2  # a few are far off, or 0
    assert fuzz_values.changed_text("chi_aa(14N) of a2.cat", rng, 1.0) == "chi_aa(14N) of a2.cat"


def test_sizes_stay_small(benchmarks):
    fuzz_values, rng = benchmarks("fuzz_values"), random.Random(5)
    assert max(int(fuzz_values.changed_number("20000", rng, True)) for _ in range(50)) <= 202


@pytest.mark.parametrize(("text", "bad"), [("x nan", True), ("[1, NaN]", True), ("-inf", True), ("1,inf\n", True), ("nano", False),
                                           ("nan.csv", False), ("infinite", False), ("banana", False), ("C=inf(3)", False)])  # fmt: skip
def test_numbers_that_are_none_are_seen(benchmarks, text, bad):
    assert bool(benchmarks("fuzz_values").NOT_FINITE.search(text)) == bad


def test_a_sample_of_changed_values_computes_and_shows_no_defect(benchmarks, folder):
    fuzz_values, fuzz = benchmarks("fuzz_values"), benchmarks("fuzz")
    light = ("spectrum", "levels", "thermo", "raman", "info")
    seeds = [
        seed for seed in fuzz_values.all_seeds() if seed.words[:1] and seed.words[0] in light and seed.kind == "command"
    ]
    outcomes = [{"code": 2 if "--plot" in seed.words else 0, "seconds": 0.05} for seed in seeds]
    drawn = seeds, fuzz_values.weights_of(seeds, outcomes)
    answers = list(fuzz_values.answers(range(20_000_000, 20_000_120), drawn, fuzz.seed_files(), whole=False))
    assert [answer for answer in answers if answer["defects"]] == []
    assert sum(answer["computed"] for answer in answers) > 25  # of 120; half of these seeds are refused as they stand


# Mutants


TEXT = '''"""A module with a number: 1 + 1."""
LIMIT: float = 2.5


def share(part, whole, strict=True):
    """A share > 0."""
    if whole == 0:
        raise ValueError(f"μ {whole}: more than {0} expected")
    if not strict and part < -LIMIT:
        return None
    return "µ" and min(part, whole) / whole
'''


@pytest.fixture
def drawn(benchmarks, folder):
    """Every change of the module above."""
    (folder / "rotor").mkdir()
    (folder / "rotor" / "a.py").write_text(TEXT, encoding="utf-8")
    source = benchmarks("mutants").Source(folder, folder / "rotor" / "a.py", frozenset())
    return source, list(source.mutants())


def test_every_kind_of_change_is_made_where_it_counts(drawn):
    _, mutants = drawn
    computed = Counter((mutant.operator, mutant.before.splitlines()[0][:10], mutant.after[:10]) for mutant in mutants)
    assert computed == Counter(
        [("constant", "2.5", "3.75"), ("constant", "True", "False"), ("comparison", "==", "!="), ("constant", "0", "1"),
         ("guard removed", "whole == 0", "False"), ("raise removed", "raise Valu", "pass"), ("boolean", "and", "or"),
         ("boolean", "not strict", "strict"), ("comparison", "<", "<="), ("sign", "-LIMIT", "LIMIT"),
         ("guard removed", "not strict", "False"), ("return removed", '"µ" and mi', "None"), ("boolean", "and", "or"),
         ("arithmetic", "/", "*"), ("all/any", "min", "max"), ("arguments swapped", "part, whol", "whole, par")]
    )  # fmt: skip


def test_a_change_alters_its_place_alone(drawn):
    source, mutants = drawn
    for mutant in mutants:
        text = mutant.applied(source.bytes).decode()
        assert ast.dump(ast.parse(text)) != ast.dump(source.tree)
        assert text.replace(mutant.after, "", 1) != text
        assert len(text.splitlines()) >= len(TEXT.splitlines()) - 1


def test_a_statement_outside_functions_is_looked_for_by_its_name(drawn):
    _, mutants = drawn
    names = {mutant.before: mutant.names for mutant in mutants}
    assert (names["2.5"], names["True"], names["=="]) == (("LIMIT",), ("share",), ())


def test_the_same_seed_draws_the_same(benchmarks, drawn, folder):
    sample = benchmarks("mutants").sample
    assert sample(folder, 5, 1) == sample(folder, 5, 1) != sample(folder, 5, 2)
    assert len({mutant.line for mutant in sample(folder, 5, 1)}) == 5


def test_intervals_of_a_share(benchmarks):
    """All of 10: the lower end is n / (n + z²)."""
    assert benchmarks("mutation").wilson(10, 10) == f"100.0% ({10 / (10 + 1.96**2):.1%} to 100.0%)"
    assert benchmarks("mutation").wilson(50, 100) == "50.0% (40.4% to 59.6%)"  # Wilson's own form is symmetric at 1/2
