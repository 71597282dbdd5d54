"""Mutated files and command lines given to the command `rotor`: no traceback, no hang, nothing left behind.

    python benchmarks/fuzz.py --cases 2000 --first 0 --seconds 380

Case k is the same on every machine: its random numbers begin from k alone. Each is a seed file or command line of one of many
formats and verbs, with some of it replaced, cut, doubled, or made extreme. In process; counted are defects (an exception that
is not the user's mistake, a traceback, an exit code other than 0, 1 or 2), hangs (over 20 s of processor time) and files that stay behind.
Results are added to benchmarks/results/fuzz.json.
"""

from __future__ import annotations

import argparse
import contextlib
import faulthandler
import io
import json
import os
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

ROOT = Path(__file__).parents[1]
ORACLES = ROOT / "tests" / "oracles"
RESULTS = Path(__file__).parent / "results" / "fuzz.json"
HANG_S = 20.0
MEMORY_BYTES = 6 << 30

WATER = "O 0.0 0.0 0.1173\nH 0.0 0.7572 -0.4692\nH 0.0 -0.7572 -0.4692\n"
SEEDS = {
    "a.xyz": f"3\nwater\n{WATER}",
    "b.extxyz": '3\nLattice="9 0 0 0 9 0 0 0 9" Properties=species:S:1:pos:R:3 dipole="0 0 0.4" charge=0 pbc="T T T"\n'
    + WATER,
    "c.sdf": "w\n  x\n\n  2  1  0  0  0  0  0  0  0  0999 V2000\n    0.0000    0.0000    0.0000 O   0  0\n"
    "    0.0000    0.0000    0.9700 H   0  0\n  1  2  1  0\nM  CHG  1   1  -1\nM  END\n",
    "d.toml": 'name = "w"\nnames = ["H2O"]\n[constants]\nunit = "GHz"\nsource = "a book"\nA = 835.84\nB = 435.35\nC = 278.14\n'
    'DeltaJ = { value = 0.0376, uncertainty = 1e-5, source = "b" }\n[dipole]\nsource = "c"\nb = 1.85\n'
    '[spin_weights]\nsource = "d"\nee = 1\neo = 3\noe = 3\noo = 1\n',
    "e.toml": 'name = "g"\n[geometry]\nkind = "r0"\nsource = "a"\natoms = [["C", 0, 0, 0], ["O", 0.0, 0.0, 1.128]]\n'
    '[polarizability]\nsource = "b"\nmean = 1.95\nanisotropy = 0.5\n',
    "f.toml": 'name = "OCS"\natoms = ["O", "C", "S"]\n[[isotopologue]]\nisotopes = ""\nB = 6081.492\n'
    '[[isotopologue]]\nisotopes = "S=34S"\nB = 5932.834\n[[isotopologue]]\nisotopes = "C=13C"\nB = 6061.925\n'
    '[geometry]\natoms = [["O", 0, 0, 0], ["C", 0, 0, 1.16], ["S", 0, 0, 2.72]]\n',
    "g.csv": "j_upper,ka_upper,kc_upper,j_lower,ka_lower,kc_lower,frequency_mhz,error_mhz,weight,blend,comment\n"
    "1,0,1,0,0,0,11000.0,0.01,1,,a\n2,0,2,1,0,1,21900.0,0.01,1,,b\n2,1,2,1,1,1,20900.0,0.01,1,,\n2,1,1,1,1,0,23100,0.01,1,,\n",
    "h.dat": "!MOLECULE\nCO\n!MOLECULAR WEIGHT\n28.0\n!NUMBER OF ENERGY LEVELS\n2\n",
    "i.hess": "\n".join(" ".join(["0.1"] * 9) for _ in range(9)) + "\n",
    "j.json": '{"a": [1, 2, {"b": null}]}',
    "k.csv": "time_ps,intensity\n0,0\n1,1e12\n2,0\n",
}
ORACLE_SEEDS = (
    "ocs", "h2co", "so2", "hcn_quad", "two_state_coriolis", "ch3cn", "vinylcl35_quad", "three_states_fermi_coriolis",
    "tunnelling_doublet_quad", "ch2cl2_2quad", "pyridine_oblate_s",
)  # fmt: skip
MOST_SEED_BYTES = 6000

SOURCES = ("water", "CO", "NH3", "CH4", "OCS", "CH3Cl", "SMILES:CO", "SMILES:[H]F", "SMILES:C#N", "-", "H2O")
CONSTANTS = ("B=57635.968(1) D=0.1835(1) MHz", "A=9.2(1) B=3 C=2.5 GHz", "A=430 B=57 C=55 MHz", "B=10 C=5 GHz")
VALUES = (
    "", " ", "0", "-1", "1", "1e999", "nan", "inf", "-inf", "1e-300", "1e300", "9" * 400, "0x10", "1_000", "٣", "−5",
    "5 K", "10:20", "20:10", "1:2:3", "1:2:0", "0:1:10000000000", "1,2,3", "1,2", ",,,", ":", "::", "=", "a=b",
    "1=2H", "O=18O", "1=99X", "none", "10 parsec", "9.2(1)", "B=", "B=0 MHz", "B=-1 GHz", "B=1e30 MHz", "B=1e-30 MHz",
    "A=1 B=2 C=3 GHz", "*", "\u200b", "../..", "/dev/null", "/", ".", "/proc/self/mem", "a" * 300, "%s%n", "{}", "[[",
    "\t", "\n", "ee=1,eo=3", "ee=0,eo=0,oe=0,oo=0", "even=1,odd=3", "water", "(1)", "1e5", "300", "1e-9", "1000000",
    "2:18GHz", "0:2000GHz:3", "0,0,1.85", "J=1", "1,0,1", "A", "x.csv", "x.json", "x.png", "x.cat", "x.parquet",
    "x.toml", "x.par", "x.npz", "x", "C=\ufffd", "S=1/2 14N=1", "chi_aa(14N)=-4.22 MHz", "667.4x2,1388",
)  # fmt: skip
TOKENS = (
    "nan", "inf", "-1", "0", "1e999", "9" * 400, "*********", "\x00", "\u2212", "\ufeff", "\r", "\r\n", "\n\n", "\t",
    "1d5", "1,5", "[", "]", "{", "}", '"', "'", "=", "#", "!", "\\", "1e-320", "-0", "65536", "2147483648",
    "99999999999999999999", "true", "D", "C13", "13C", "Xx", " " * 100, "é", "[" * 600, "[[constants]]",
    "[constants]", "\ud7ff", "1/0", "%", "1:2", "()",
)  # fmt: skip

QUICK = (
    "info {file}", "info {source} --temperature 10", "info --constants {constants}", "cat {cat}",
    "cat {cat} --range 0:100GHz --out x.cat", "spectrum {file} --jmax 3 --dipole-abc 1,1,1",
    "spectrum {source} --jmax 3 --csv x.csv", "spectrum {int} --cat x.cat",
    "spectrum --constants {constants} --dipole-abc 0,1,0 --jmax 4 --json -", "levels {file} --jmax 3",
    "levels {source} --jmax 3 --csv x.csv", "convert {file} x.toml", "convert {par} x.par",
    "thermo {source} --temperature 100:300:3", "fit {par} --iterations 2 --out x",
    "fit {lines} --constants {constants} --free B", "isotopologues {source}", "tumble {source} --times 0:1:5",
    "structure {family} --method rs", "tumble --moments 1,2,3 --angular-momentum 1,1,1 --times 0:1:3",
    "raman {source} --jmax 3", "molecules {source}", "cat {cat} --compare {cat}",
    "stark {source} --field 0:10kV/cm:3 --jmax 4", "spectrum {source} --hessian {file} --jmax 2",
    "spectrum {source} --profile-csv x.csv --jmax 3",
)  # fmt: skip
SLOW = (
    "gas {source} --molecules 200 --times 0:1:3",
    "align {source} --pulse {pulse} --until 3 --points 5 --jmax 6 --temperature 1",
    "fluid water --molecules 27 --steps 4 --every 1 --cutoff 4 --csv x.csv", "fluid {file} --steps 2",
    "spectrum {source} --plot x.png --jmax 3", "levels {source} --plot x.png --jmax 3",
    "fluid water --molecules 27 --steps 4 --cutoff 4 --checkpoint {file} --resume", "tumble {source} --plot x.png",
    "thermo {source} --plot x.pdf --temperature 10:300:3", "align {source} --pulse-table {file} --jmax 5 --until 3",
    "structure {family} --method r0,rm1 --plot x.png", "spectrum {source} --parquet x.parquet --jmax 5",
)  # fmt: skip
UNBOUNDED = ("--calculator", "--engine", "--threads", "--steps")  # another program; a run as long as is asked for
PULSES = ("1e13 W/cm2, 1 ps", "5e12 W/cm2, 0.3 ps", "1e13 W/cm2")


class Hang(BaseException):
    """The time of a case is over."""


@dataclass
class Outcome:
    """What a case did: its exit code (None where it did not end by itself), what it wrote on standard error, how long it took."""

    words: list[str]
    code: int | None
    said: str
    seconds: float
    left: list[str] = field(default_factory=list)
    made_by: str = ""

    @property
    def failing(self) -> str:
        """The class of failure; empty for none."""
        if self.seconds > HANG_S:
            return "hang"
        if self.code not in (0, 1, 2) or "this is a defect" in self.said or "Traceback" in self.said:
            return "defect"
        return "left behind" if self.left else ""


def seed_files() -> dict[str, bytes]:
    """Every seed by its name: those above, and files of the reference programs, cut to a few thousand bytes."""
    files = {name: text.encode() for name, text in SEEDS.items()}
    for name in ORACLE_SEEDS:
        for path in sorted((ORACLES / name).glob("*")):
            if path.suffix in (".cat", ".int", ".var", ".par", ".lin", ".egy"):
                files[f"{name}{path.suffix}"] = path.read_bytes()[:MOST_SEED_BYTES]
    for path in [*sorted((ORACLES / "outputs").glob("*"))[:12], *sorted((ORACLES / "hitran").glob("*"))[:3]]:
        if path.is_file() and path.stat().st_size < 400_000:
            files[path.name] = path.read_bytes()
    return files


def mutated(content: bytes, rng: random.Random) -> bytes:
    """The content with one to four changes; one time in eight as it was."""
    if rng.random() < 0.125:
        return content
    for _ in range(rng.choice((1, 1, 1, 2, 3, 4))):
        content = rng.choice(CHANGES)(content, rng)
    return content


def _cut(content: bytes, rng: random.Random) -> bytes:
    return content[: rng.randrange(len(content) + 1)]


def _without_piece(content: bytes, rng: random.Random) -> bytes:
    start = rng.randrange(len(content) + 1)
    return content[:start] + content[start + rng.randrange(1, 40) :]


def _flipped(content: bytes, rng: random.Random) -> bytes:
    if not content:
        return b"\xff"
    at = rng.randrange(len(content))
    return content[:at] + bytes([rng.randrange(256)]) + content[at + 1 :]


def _with_token(content: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(content) + 1)
    return content[:at] + rng.choice(TOKENS).encode() + content[at:]


def _word_replaced(content: bytes, rng: random.Random) -> bytes:
    words = content.split(b" ")
    words[rng.randrange(len(words))] = rng.choice(TOKENS).encode()
    return b" ".join(words)


def _lines_changed(content: bytes, rng: random.Random) -> bytes:
    lines = content.split(b"\n")
    at, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    change = rng.randrange(4)
    if change == 0:
        lines[at], lines[other] = lines[other], lines[at]
    elif change == 1:
        lines.insert(at, lines[other])
    elif change == 2:
        del lines[at]
    else:
        lines[at] = b""
    return b"\n".join(lines)


def _other_ends(content: bytes, rng: random.Random) -> bytes:
    return rng.choice(
        (content.replace(b"\n", b"\r\n"), content.replace(b"\n", b"\r"), b"\xef\xbb\xbf" + content, b"\n" + content)
    )


def _packed(content: bytes, rng: random.Random) -> bytes:
    import gzip

    return gzip.compress(content, mtime=0)


def _repeated(content: bytes, rng: random.Random) -> bytes:
    return (content * rng.choice((2, 3, 20)))[:200_000]


CHANGES: tuple[Callable[[bytes, random.Random], bytes], ...] = (
    _cut, _without_piece, _flipped, _with_token, _with_token, _word_replaced, _word_replaced, _lines_changed, _lines_changed, _other_ends,
    _packed, _repeated,
)  # fmt: skip


def case_words(number: int, folder: Path, files: dict[str, bytes], templates: tuple[str, ...]) -> list[str]:
    """The command line of a case, its mutated files written into the folder."""
    rng = random.Random(number)
    template = rng.choice(templates)
    words = []
    for word in template.split():
        kind = word.strip("{}") if word.startswith("{") else ""
        words.append(_filled(kind, folder, files, rng) if kind else word)
    changes = rng.choice((0, 1, 1, 2, 3)) if "{file}" not in template else rng.choice((0, 0, 1))
    for _ in range(changes):
        words = _changed_words(words, rng)
    return words


def _filled(kind: str, folder: Path, files: dict[str, bytes], rng: random.Random) -> str:
    if kind in ("source", "constants", "pulse"):
        return rng.choice({"source": SOURCES, "constants": CONSTANTS, "pulse": PULSES}[kind])
    endings = {
        "file": ("",), "cat": (".cat",), "int": (".int",), "par": (".par", ".var"), "lines": ("g.csv", ".lin"), "family": ("f.toml",),
    }[kind]  # fmt: skip
    names = [name for name in files if name.endswith(endings)]
    name = rng.choice(names)
    stem = name.rpartition(".")[0]
    for beside in files:  # the .var of an .int and so on, which are read with it
        if beside != name and beside.startswith(stem + ".") and kind in ("int", "par"):
            (folder / beside).write_bytes(mutated(files[beside], rng) if rng.random() < 0.3 else files[beside])
    if rng.random() < 0.03:
        name = stem + rng.choice(
            (".xyz", ".toml", ".cat", ".par", ".json", ".log", ".out", ".pdb", ".cif", ".db", ".traj", ".gz", "")
        )
    (folder / name).write_bytes(mutated(files.get(name, files[names[0]]), rng))
    return name


def _changed_words(words: list[str], rng: random.Random) -> list[str]:
    words = list(words) or ["info"]
    at = rng.randrange(1, len(words)) if len(words) > 1 else 0
    change = rng.randrange(6)
    if change <= 1:
        words[at] = rng.choice(VALUES)
    elif change == 2:
        del words[at]
    elif change == 3:
        words.insert(at, words[at])
    else:
        words += [rng.choice(options_of(words[0])), rng.choice(VALUES)] if options_of(words[0]) else []
    return words


def options_of(verb: str) -> list[str]:
    """The options of a verb, those aside that ask for an unbounded amount of work or another program."""
    import typer

    from rotor.cli import VERBS, _application

    if verb not in VERBS:
        return []
    if verb not in _OPTIONS:
        command = typer.main.get_command(_application([verb]))
        computed = command.commands[verb].params  # type: ignore[attr-defined]
        _OPTIONS[verb] = [o for option in computed for o in option.opts if o.startswith("--") and o not in UNBOUNDED]
    return _OPTIONS[verb]


_OPTIONS: dict[str, list[str]] = {}


def run_case(number: int, files: dict[str, bytes], templates: tuple[str, ...]) -> Outcome:
    """One case in a folder of its own."""
    before = os.getcwd()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        words = case_words(number, folder, files, templates)
        names = _names(folder)
        os.chdir(folder)
        try:
            outcome = run_words(words)[0]
        finally:
            os.chdir(before)
        new = _names(folder) - names
        if outcome.code != 0 and words[:1] != [
            "fluid"
        ]:  # the rows of a fluid, the report of a fit without an end, stay
            outcome.left = sorted(name for name in new if not (words[:1] == ["fit"] and name.endswith(".fit")))
        outcome.left += sorted(
            name for name in new if Path(name).name.startswith(".rotor") and name not in outcome.left
        )
        if outcome.failing:
            outcome.made_by = repr({p: (folder / p).read_bytes()[:300] for p in sorted(names)})
    return outcome


def _names(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*")}


def run_words(words: list[str], bound_s: float = HANG_S + 1) -> tuple[Outcome, str]:
    """A command line in this process, and what it prints; stopped after a processor time."""
    from rotor.cli import run

    stdout, stderr, started = io.TextIOWrapper(io.BytesIO()), io.StringIO(), time.process_time()
    code: int | None = None
    stdin, sys.stdin = sys.stdin, io.TextIOWrapper(io.BytesIO(b"2\n\nC 0 0 0\nO 0 0 1.128\n"))
    try:
        with _alarm(bound_s), contextlib.redirect_stdout(stdout), contextlib.redirect_stderr(stderr):
            code = run(words)
    except Hang:
        stderr.write("hang")
    except BaseException as error:  # whatever it is
        stderr.write(f"escaped, this is a defect: {type(error).__name__}: {error}")
    finally:
        sys.stdin = stdin
    seconds = time.process_time() - started
    with contextlib.suppress(ValueError):  # a command may have closed its output
        stdout.flush()
        stdout.seek(0)
    printed = "" if stdout.closed else stdout.buffer.getvalue().decode("utf-8", "replace")  # type: ignore[attr-defined]
    return Outcome(words, code, stderr.getvalue(), seconds), printed


@contextlib.contextmanager
def _alarm(seconds: float) -> Iterator[None]:
    """Inside, Hang is raised after a processor time; a library that does not come back ends the process later."""

    def ring(number: int, frame: FrameType | None) -> None:
        raise Hang

    signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    faulthandler.dump_traceback_later(5 * HANG_S, exit=True)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        faulthandler.cancel_dump_traceback_later()


def fuzz(
    first: int, count: int, templates: tuple[str, ...], seconds: float = float("inf")
) -> tuple[list[Outcome], int]:
    """The outcomes that fail among cases from `first` on, and how many were run before the time was over."""
    files, started, failing = seed_files(), time.perf_counter(), []
    for done in range(count):
        if time.perf_counter() - started > seconds:
            return failing, done
        outcome = run_case(first + done, files, templates)
        if outcome.failing:
            failing.append(outcome)
            print(
                first + done,
                outcome.failing,
                f"{outcome.seconds:.1f} s",
                outcome.words,
                outcome.said[-200:],
                flush=True,
            )
            print("   ", outcome.left, outcome.made_by[:1500], flush=True)
    return failing, count


def main() -> None:
    """Run a piece, print what fails, add the counts to the results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--cases", type=int, default=2000)
    parser.add_argument("--seconds", type=float, default=float("inf"))
    options = parser.parse_args()
    with contextlib.suppress(ImportError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    os.environ["COLUMNS"] = "100"
    failing, done = fuzz(options.first, options.cases, QUICK * 3 + SLOW, options.seconds)
    counts = Counter(failure.failing for failure in failing)
    piece = {
        "first": options.first,
        "cases": done,
        **{name: counts[name] for name in ("defect", "hang", "left behind")},
    }
    pieces = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else []
    kept = [other for other in pieces if other.get("first") != options.first]
    in_order = sorted([*kept, piece], key=lambda each: each.get("first", float("inf")))  # those of fuzz_values last
    RESULTS.write_text(json.dumps(in_order, indent=1) + "\n", encoding="utf-8")
    print(piece)


if __name__ == "__main__":
    main()
