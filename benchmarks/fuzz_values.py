"""Valid commands, scenes and files with their values changed, given to the command `rotor`: most of them reach a computation.

    python benchmarks/fuzz_values.py --cases 98000                          # in process
    python benchmarks/fuzz_values.py --cases 2000 --first 1000000 --whole   # each in a new process
    python benchmarks/fuzz_values.py --case 123 --folder ../one             # writes the files of a case and runs it

Seeds are the commands and scenes of benchmarks/corpus_cases, examples/scenes, the examples of every verb, and files of SPCAT and
SPFIT in tests/oracles. Case k changes numbers inside their ranges (factors near 1, now and then of a hundred, a sign or zero), swaps
molecules, adds an option or a key that another seed of the verb has; one case in twelve is one of fuzz.py (hostile text). Counted as
defects: a traceback, "this is a defect", an exit code other than 0, 1, 2, a process that dies, files left by a refused command, nan or
inf in the results of exit code 0, JSON that does not parse, more than 20 s of processor time. A line of JSON per piece of 250 cases
(50 whole commands) goes to the state file, from which a stopped run resumes; its first line has the exit code and the seconds of every
seed, by which seeds are drawn.
"""

from __future__ import annotations

import argparse
import contextlib
import fcntl
import gc
import hashlib
import json
import math
import os
import pkgutil
import random
import re
import resource
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # threads that wait spin, which counts as processor time of a case

import corpus
import fuzz

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "benchmarks" / "results" / "fuzz_values.jsonl"
PIECE = 250
WHOLE_PIECE = 50  # whole commands take longer: less is lost where a run is stopped
SEED_S = 1.0  # bound on a seed as it stands: longer ones are left out
NUMBER = re.compile(r"(?<![\w.(])(?<![A-Za-z][-+])[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")
# a number that is none: not as a part of a word, of a path or of an option
NOT_FINITE = re.compile(r"(?<![\w./\-])[-+]?(?:nan|NaN|inf|Infinity)(?![\w.(])")
SHOWS = frozenset(
    {"molecules", "new", "convert", "cat", "catalogue", "plan", "hostile", "", "--version", "--help"}
)  # compute nothing, or are not counted
MOLECULES = (
    "water", "CO", "NH3", "CH4", "OCS", "CH3Cl", "HCN", "N2", "CO2", "H2", "CH3CN", "HC3N", "SO2", "H2CO", "O2", "CH3OH", "HCONH2",
)  # fmt: skip
PICTURES = frozenset({"--plot", "--gif", "--lobes"})  # seldom added: a film takes as long as 400 other cases
SIZES = re.compile(r"jmax|j_max|kmax|molecules|steps|points|every|times|--j$|^j$|classical|iterations|seed|workers")


@dataclass(frozen=True)
class Seed:
    """A command line with the files that it reads."""

    kind: str
    words: tuple[str, ...]
    files: tuple[tuple[str, bytes], ...] = ()

    @property
    def digest(self) -> str:
        """What the state file calls it."""
        return hashlib.sha256(repr((self.kind, self.words, self.files)).encode()).hexdigest()[:16]


Weighted = tuple[list[Seed], list[float]]  # seeds and how often each is drawn
Answer = dict[str, Any]


def all_seeds() -> list[Seed]:
    """Every seed, valid or not."""
    inputs = {path.name: path.read_bytes() for path in (corpus.CASES / "inputs").iterdir()}
    named = lambda text: tuple((name, content) for name, content in inputs.items() if name in text)  # noqa: E731
    lines = (corpus.CASES / "commands.txt").read_text(encoding="utf-8").splitlines()
    seeds = [Seed("command", tuple(corpus.words_of(line)), named(line)) for line in [*lines, *_examples()]]
    scenes = [*corpus.SCENES, *(p.read_text("utf-8") for p in sorted((ROOT / "examples" / "scenes").glob("*.toml")))]
    seeds += [
        Seed("scene", (verb, "s.toml"), (("s.toml", text.encode()), *named(text)))
        for text in scenes
        for verb in ("run", "run", "plan")
    ]
    return seeds + _file_seeds()


def _examples() -> list[str]:
    """The command lines in the help of every verb, with bars for quotes."""
    from rotor.cli import VERBS, declaration

    texts = "\n".join(declaration(verb).examples for verb in VERBS).replace('"', "|")
    return [line.strip()[6:] for line in texts.splitlines() if line.strip().startswith("rotor ") and ">" not in line]


def _file_seeds() -> list[Seed]:
    """Verbs on files of SPCAT and SPFIT, with the files beside each."""
    verbs = {".int": ("spectrum {} --csv x.csv", "levels {}", "spectrum {} --full-basis --cat x.cat", "info {}"),
             ".par": ("fit {} --iterations 2 --out o", "convert {} x.toml"), ".cat": ("cat {} --range 0:300GHz --out x.cat",),
             ".var": ("convert {} x.toml", "info {}")}  # fmt: skip
    seeds = []
    for path in sorted((ROOT / "tests" / "oracles").rglob("*.*")):
        if path.suffix in verbs and "hitran" not in path.parts and path.stat().st_size < 9000:
            beside = [file for file in path.parent.glob(f"{path.stem}.*") if file.suffix in (*verbs, ".lin")]
            files = tuple((file.name, file.read_bytes()) for file in sorted(beside) if file.stat().st_size < 20_000)
            seeds += [Seed("file", tuple(text.format(path.name).split()), files) for text in verbs[path.suffix]]
    return seeds


def changed_number(text: str, rng: random.Random, size: bool) -> str:
    """A number near another, in its notation; sizes of a computation stay small."""
    try:
        value = float(text)
    except ValueError:
        return text
    whole = text.lstrip("+-").isdigit()
    if size and whole:
        return str(max(0, min(int(value), 30 if value < 1000 else 200) + rng.randint(-2, 2)))
    draw = rng.random()
    if draw < 0.03:
        return rng.choice(("0", "-" + text.lstrip("+-")))
    spread = 4.6 if draw < 0.06 else 0.4  # ln 100, one sigma
    if whole and abs(value) < 20 and draw > 0.5:
        return str(int(value) + rng.randint(-1, 1))
    new = value * math.exp(rng.gauss(0, spread)) if value else rng.choice((0.0, 0.1, 1.0))
    return str(round(new) or 1) if whole else f"{new:.{max(3, len(text.split('.')[-1]))}g}"


def changed_text(text: str, rng: random.Random, share: float, size: bool = False) -> str:
    """The numbers of a text changed, each with a probability."""
    return NUMBER.sub(lambda m: changed_number(m[0], rng, size) if rng.random() < share else m[0], text)


def changed_file(name: str, content: bytes, rng: random.Random, seeds: list[Seed]) -> bytes:
    """A file with some values changed; a small computation stays small."""
    text = content.decode("utf-8", errors="replace")
    lines = text.split("\n")
    if name.endswith(".int") and len(lines) > 1:  # F at most 5: line 2 is FLAG TAG QROT FBGN FEND ...
        words = lines[1].replace(",", " ").split()
        if len(words) > 4:
            words[4] = str(rng.randint(1, 5))
        lines = [lines[0], " ".join(words[:4] + [words[4] if len(words) > 4 else "4"] + [changed_text(w, rng, 0.3) for w in words[5:]]),
                 *(_second_number(line, rng) for line in lines[2:])]  # fmt: skip
    elif name.endswith((".var", ".par")):
        lines = lines[:2] + [_second_number(line, rng) if len(line.split()) > 2 else line for line in lines[2:]]
    elif name.endswith((".cat", ".lin")):
        lines = [_changed_digit(line, rng) for line in lines[:25]]
    elif name.endswith(".toml"):
        lines = _changed_keys(lines, rng, seeds)
    else:
        lines = [changed_text(line, rng, 0.1) for line in lines]
    return "\n".join(lines).encode()


def _second_number(line: str, rng: random.Random) -> str:
    """A line of constants with its value changed, and rarely its code."""
    words = line.split(" ")
    places = [at for at, word in enumerate(words) if word]
    if len(places) > 1 and rng.random() < 0.25:
        at = places[0] if rng.random() < 0.05 else places[1]
        words[at] = changed_text(words[at], rng, 1.0)
    return " ".join(words)


def _changed_digit(line: str, rng: random.Random) -> str:
    digits = [at for at, sign in enumerate(line) if sign.isdigit()]
    if not digits or rng.random() > 0.2:
        return line
    at = rng.choice(digits)
    return line[:at] + rng.choice("0123456789") + line[at + 1 :]


def _changed_keys(lines: list[str], rng: random.Random, seeds: list[Seed]) -> list[str]:
    """A scene or a file of a molecule: values changed, a line of another scene added to the same table."""
    lines = [line if line.startswith(("schema", "name")) else _changed_key(line, rng) for line in lines]
    if rng.random() < 0.15:
        other = rng.choice([seed for seed in seeds if seed.kind == "scene"]).files[0][1].decode().split("\n")
        tables = [at for at, line in enumerate(lines) if line.startswith("[") and line in other]
        if tables:
            at = rng.choice(tables)
            rows = other[other.index(lines[at]) + 1 :]
            end = next((n for n, row in enumerate(rows) if row.startswith("[") or not row.strip()), len(rows))
            if end:
                lines.insert(at + 1, _changed_key(rng.choice(rows[:end]), rng))
    return lines


def _changed_key(line: str, rng: random.Random) -> str:
    key, equals, value = line.partition("=")
    if (
        key.strip() == "molecule"
        and rng.random() < 0.3
        and value.count('"') == 2
        and "." not in value
        and "{" not in value
    ):
        return f'{key}= "{rng.choice(MOLECULES)}"'
    return key + equals + changed_text(value, rng, 0.35, bool(SIZES.search(key)) or ":" in value)


def changed_words(seed: Seed, rng: random.Random, seeds: list[Seed]) -> list[str]:
    """The command line with values changed, a molecule swapped, an option of another seed added."""
    words = list(seed.words)
    if seed.kind != "command":
        return words
    for at in range(1, len(words)):
        before = words[at - 1]
        if words[at] in MOLECULES and rng.random() < 0.4:
            words[at] = rng.choice(MOLECULES)
        elif before.startswith("--") or (
            not words[at].startswith("--") and "." not in words[at][-6:-2] + words[at][-1:]
        ):
            words[at] = changed_text(words[at], rng, 0.4, bool(SIZES.search(before)))
    if rng.random() < 0.15:
        same = [item.words for item in seeds if item.words[:1] == seed.words[:1] and item.kind == "command"]
        donor = rng.choice(same)
        options = [at for at, word in enumerate(donor) if word.startswith("--") and word not in words]
        if options and rng.random() < 0.95:
            options = [at for at in options if donor[at] not in PICTURES]
        if options:
            at = rng.choice(options)
            value = [
                changed_text(word, rng, 1.0, True) if SIZES.search(donor[at]) else word
                for word in donor[at + 1 : at + 2]
            ]
            words += [donor[at], *(word for word in value if not word.startswith("--"))]
    return words


def case(number: int, folder: Path, weighted: Weighted, hostile: dict[str, bytes]) -> tuple[str, list[str]]:
    """Kind and words of a case, its files written into the folder."""
    rng = random.Random(f"values {number}")
    if rng.random() < 1 / 12:
        return "hostile", fuzz.case_words(number, folder, hostile, fuzz.QUICK)
    seeds, weights = weighted
    seed = rng.choices(seeds, weights)[0]
    for name, content in seed.files:
        (folder / name).write_bytes(changed_file(name, content, rng, seeds) if rng.random() < 0.8 else content)
    words = changed_words(seed, rng, seeds)
    if words[:1] == ["view"] and "--export" not in words:  # a page is shown until it is stopped
        words += ["--export", "b.html"]
    return seed.kind, words


def run_case(number: int, folder: Path, weighted: Weighted, hostile: dict[str, bytes], whole: bool) -> Answer:
    """What a case did: kind, verb, exit code, seconds, and its defects."""
    kind, words = case(number, folder, weighted, hostile)
    before, here = {str(p.relative_to(folder)) for p in folder.rglob("*")}, os.getcwd()
    os.chdir(folder)
    try:
        outcome, printed = whole_command(words) if whole else fuzz.run_words(words)
    finally:
        os.chdir(here)
    new = sorted({str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file()} - before)
    scene = folder / "s.toml"
    sweep = words[:2] == ["run", "s.toml"] and scene.exists() and b"[sweep]" in scene.read_bytes()
    not_converged = words[:1] == ["fit"] and outcome.code == 1  # it writes what it reached
    rows_stay = sweep or not_converged or words[:1] in (["fluid"], ["catalogue"])
    outcome.left = [
        name for name in new if Path(name).name.startswith(".rotor") or (outcome.code != 0 and not rows_stay)
    ]
    defects = [outcome.failing] if outcome.failing else []
    if outcome.code == 0:
        defects += _not_results(words, printed, [folder / name for name in new])
    verb = words[0] if words else ""
    answer = {
        "kind": kind,
        "verb": verb,
        "code": outcome.code,
        "seconds": round(outcome.seconds, 3),
        "defects": defects,
    }
    computed = outcome.code in (0, 1) and verb not in SHOWS and kind != "hostile"
    return answer | {"computed": computed, "said": outcome.said[-300:] if defects else "", "words": words}


def _not_results(words: list[str], printed: str, files: list[Path]) -> list[str]:
    """What in the output of a successful command is no result."""
    texts = {"printed": printed} | {
        p.name: p.read_text("utf-8", errors="replace") for p in files if p.suffix in (".csv", ".json", ".cat", ".toml")
    }
    defects = [f"{computed[0]} in {name}: {text[max(0, computed.start() - 80) : computed.end() + 20]!r}" for name, text in texts.items()
               if (computed := NOT_FINITE.search(text))]  # fmt: skip
    for name, text in texts.items():
        if name.endswith(".json") or (
            name == "printed"
            and "--json" in words[:-1]
            and words[words.index("--json") + 1] == "-"
            and not {"--help", "--help-all"} & {*words}
        ):
            try:
                json.loads(text)
            except ValueError as error:
                defects.append(f"{name} is no JSON: {error}")
    return defects


def whole_command(words: list[str]) -> tuple[fuzz.Outcome, str]:
    """A command in a process of its own, with its processor time."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        done = subprocess.run(
            [sys.executable, "-m", "rotor", *words],
            capture_output=True,
            timeout=20 * fuzz.HANG_S,
            stdin=subprocess.DEVNULL,
        )
        code, out, err = done.returncode, done.stdout, done.stderr
    except subprocess.TimeoutExpired:
        code, out, err = None, b"", b"hang"
    except ValueError:  # a null character cannot be typed
        code, out, err = 2, b"", b""
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return fuzz.Outcome(words, code, err.decode("utf-8", "replace"), seconds), out.decode("utf-8", "replace")


def in_child(work: Callable[..., Iterator[Answer]], *arguments: Any) -> list[Answer]:
    """What a function yields in a forked process, up to where that process ended."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name, "answers")
        child = os.fork()
        if child == 0:
            try:
                with path.open("w", encoding="utf-8") as file:
                    for answer in work(*arguments):
                        file.write(json.dumps(answer) + "\n")
                        file.flush()
            except BaseException:
                traceback.print_exc()
            finally:
                os._exit(0)  # nothing of the parent is cleaned up here
        os.waitpid(child, 0)
        return [json.loads(line) for line in path.read_text("utf-8").splitlines()]


def answers(numbers: range, weighted: Weighted, hostile: dict[str, bytes], whole: bool) -> Iterator[Answer]:
    """The answers of cases, one after the other."""
    for number in numbers:
        with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
            yield {"case": number} | run_case(number, Path(folder), weighted, hostile, whole)


def seed_outcomes(seeds: list[Seed]) -> Iterator[Answer]:
    """Exit code and seconds of every seed as it stands; where it is slow, the second time: the first one compiles and loads modules."""
    for seed in seeds:
        with tempfile.TemporaryDirectory(prefix="fuzz-") as folder, contextlib.chdir(folder):
            for name, content in seed.files:
                Path(name).write_bytes(content)
            outcome = fuzz.run_words(list(seed.words), 5 * SEED_S)[0]
            again = fuzz.run_words(list(seed.words), SEED_S)[0] if 0.1 < outcome.seconds < 5 * SEED_S else outcome
        print(f"{min(outcome.seconds, again.seconds):.2f}", outcome.code, *seed.words, file=sys.__stderr__, flush=True)
        yield {"code": outcome.code, "seconds": min(outcome.seconds, again.seconds)}


def weights_of(seeds: list[Seed], outcomes: list[dict[str, float]]) -> list[float]:
    """Seeds of a verb by their speed, a three-hundredth for those that are refused as they stand; verbs by speed and number of seeds."""
    weights: list[float] = []
    for outcome in outcomes:
        left_out = outcome["code"] is None or outcome["seconds"] > SEED_S / 2
        weights.append(0.0 if left_out else (0.01 + outcome["seconds"]) ** -2.5 / (1 if outcome["code"] == 0 else 300))
    verbs = [(seed.kind, seed.words[0] if seed.words else "") for seed in seeds]
    sums, costs = Counter[tuple[str, str]](), Counter[tuple[str, str]]()
    for verb, weight, outcome in zip(verbs, weights, outcomes, strict=True):
        sums[verb] += weight
        costs[verb] += weight * (0.02 + outcome["seconds"])
    counts = Counter(verbs)
    valid = {
        verb for verb, outcome in zip(verbs, outcomes, strict=True) if outcome["code"] == 0 and verb[1] not in SHOWS
    }
    shares = {
        verb: counts[verb] ** 0.5 * (total / costs[verb]) ** 2.5 * (1.0 if verb in valid else 0.05)
        for verb, total in sums.items()
        if total
    }
    return [weight * shares[verb] / sums[verb] if weight else 0.0 for verb, weight in zip(verbs, weights, strict=True)]


def main() -> None:
    """Run what is missing of a range of cases and print the summary."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--cases", type=int, default=98_000)
    parser.add_argument("--whole", action="store_true")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--state", type=Path, default=RESULTS)
    parser.add_argument("--case", type=int)
    parser.add_argument("--folder", type=Path)
    arguments = parser.parse_args()
    os.environ |= {"COLUMNS": "100", "MPLBACKEND": "Agg", "PYTHONPATH": str(ROOT)}
    resource.setrlimit(resource.RLIMIT_AS, (fuzz.MEMORY_BYTES, fuzz.MEMORY_BYTES))
    for library in ("numpy", "scipy.linalg", "scipy.optimize", "numba", "matplotlib.pyplot", "ase", "rdkit.Chem"):
        __import__(library)  # once, before children are forked
    load_package()
    gc.freeze()  # what is loaded is not looked through again in every case
    lines = (
        [json.loads(line) for line in arguments.state.read_text("utf-8").splitlines()]
        if arguments.state.exists()
        else []
    )
    seeds = all_seeds()
    known = lines[0]["seeds"] if lines else {}
    missing = [seed for seed in dict.fromkeys(seeds) if seed.digest not in known]
    if missing and len(lines) > 1:
        raise SystemExit(
            f"{arguments.state}: {len(missing)} of {len(seeds)} seeds are new since it was begun; begin another state"
        )
    if missing:
        computed = zip(missing, in_child(seed_outcomes, missing), strict=True)
        known |= {seed.digest: [outcome["code"], round(outcome["seconds"], 3)] for seed, outcome in computed}
        arguments.state.write_text(json.dumps({"seeds": known}) + "\n", encoding="utf-8")
    outcomes = [{"code": known[seed.digest][0], "seconds": known[seed.digest][1]} for seed in seeds]
    weighted = seeds, weights_of(seeds, outcomes)
    hostile = fuzz.seed_files()
    if arguments.case is not None:
        arguments.folder.mkdir(parents=True, exist_ok=True)
        print(json.dumps(run_case(arguments.case, arguments.folder, weighted, hostile, arguments.whole), indent=1))
        return
    size = WHOLE_PIECE if arguments.whole else PIECE
    done = {line["first"] for line in lines[1:] if line["whole"] == arguments.whole}
    missing = [first for first in range(arguments.first, arguments.first + arguments.cases, size) if first not in done]
    children = []
    for worker in range(arguments.workers):
        if not (child := os.fork()):
            for first in missing[worker :: arguments.workers]:
                add_line(arguments.state, run_piece(range(first, first + size), weighted, hostile, arguments.whole))
            os._exit(0)
        children.append(child)
    for child in children:
        os.waitpid(child, 0)
    print(summary([json.loads(line) for line in arguments.state.read_text("utf-8").splitlines()]))


def add_line(path: Path, line: Answer) -> None:
    """A line at the end of the state, by one worker at a time."""
    with path.open("a", encoding="utf-8") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        file.write(json.dumps(line) + "\n")


def load_package() -> None:
    """Import every module of the package that needs no further library, so that children need not."""
    import rotor

    for module in pkgutil.walk_packages(rotor.__path__, "rotor."):
        if not module.name.endswith("__main__"):
            with contextlib.suppress(ImportError):
                __import__(module.name)


def run_piece(numbers: range, weighted: Weighted, hostile: dict[str, bytes], whole: bool) -> Answer:
    """The counts of a piece, its slowest case and its defects."""
    done: list[Answer] = []
    started = time.time()
    first = numbers.start
    while len(done) < len(numbers):
        done += in_child(answers, numbers[len(done) :], weighted, hostile, whole)
        if len(done) < len(numbers):  # the process ended inside a case
            done.append({"case": first + len(done), "kind": "", "verb": "", "code": None, "seconds": fuzz.HANG_S, "computed": False,
                         "defects": ["died"], "said": "", "words": []})  # fmt: skip
    counts = Counter(f"{row['kind']} {row['verb']} {row['code']}" for row in done)
    defects = [row for row in done if row["defects"]]
    for defect in defects:
        print(json.dumps(defect), flush=True)
    times = {"processor": round(sum(row["seconds"] for row in done), 1), "wall": round(time.time() - started, 1)}
    slowest = max(done, key=lambda row: row["seconds"])
    computed = sum(row["computed"] for row in done)
    return {"first": first, "whole": whole, "cases": len(done), "computed": computed, "counts": counts, **times,
            "slowest": slowest, "defects": defects}  # fmt: skip


def summary(lines: list[Answer]) -> str:
    """Inputs by kind and outcome, the share that computes, the slowest, the defects."""
    texts = []
    for whole in (False, True):
        pieces = [line for line in lines if line.get("whole") is whole]
        counts: Counter[tuple[str, str]] = Counter()
        for piece in pieces:
            for name, count in piece["counts"].items():
                kind, code = name.split(" ")[0], name.split(" ")[-1]
                counts[kind, code] += count
        cases = sum(piece["cases"] for piece in pieces)
        if not cases:
            continue
        computed, defects = (
            sum(numbers) for numbers in zip(*((p["computed"], len(p["defects"])) for p in pieces), strict=True)
        )
        slowest = max((piece["slowest"] for piece in pieces), key=lambda row: row["seconds"])
        where = "whole commands" if whole else "in process"
        texts.append(f"{where}: {cases} inputs, {computed} computed ({computed / cases:.0%}), {defects} defects")
        texts += [f"  {kind or 'died':8} exit {code}: {count}" for (kind, code), count in sorted(counts.items())]
        texts.append(f"  slowest: {slowest['seconds']} s, {' '.join(slowest['words'])[:120]}")
    return "\n".join(texts)


if __name__ == "__main__":
    main()
