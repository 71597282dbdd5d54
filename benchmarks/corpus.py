"""Command lines and scenes whose output two versions of the package must share: recorded with one, compared with another.

    python benchmarks/corpus.py record before.json --checkout ../base
    python benchmarks/corpus.py record after.json
    python benchmarks/corpus.py compare before.json after.json

Every case runs in process, in a folder of its own. Stored are the exit code, both streams and every file as text (pictures by their
presence). `compare` lists cases that differ: exit codes, numbers beyond 1e-9 of themselves, words. Numbers of equal text lines are
compared one by one, so that rounding in the last digit is no difference.
"""

from __future__ import annotations

import argparse
import contextlib
import difflib
import io
import json
import os
import re
import shutil
import signal
import sys
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
CASES = HERE / "corpus_cases"
SCENES = (CASES / "scenes.txt").read_text(encoding="utf-8").split("\n----\n")
TIMED = re.compile(
    r"\"(seconds|processor_time_s)\": [^,\n]*|seconds +\S+|computed now in \S+ s|\(\S+ s\)|"
    r"rotor_version\": \"[^\"]*\"|\"version\": \"[^\"]*\""
)
NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
MOST_SECONDS, MOST_CHARACTERS = 60, 60_000
BINARY = (".png", ".pdf", ".svg", ".parquet", ".npz", ".traj", ".rotorcat")


def cases() -> list[tuple[str, list[str]]]:
    """Name and words of every case; a scene is written to s.toml and run."""
    lines = (CASES / "commands.txt").read_text(encoding="utf-8").splitlines()
    commands = [(f"{number:03d} {line}", words_of(line)) for number, line in enumerate(lines)]
    return commands + [(f"scene {number:02d}", ["run", "s.toml"]) for number in range(len(SCENES))]


def words_of(text: str) -> list[str]:
    """Words between blanks; a text between bars may have blanks."""
    return [word for k, part in enumerate(text.split("|")) for word in ([part] if k % 2 else part.split())]


def record(path: Path, checkout: Path, only: str) -> None:
    """Run every case with the package of a checkout, or those whose name has a text or whose scene is of that kind."""
    sys.path.insert(0, str(checkout))
    import rotor

    assert Path(rotor.__file__).resolve().parents[1] == checkout, rotor.__file__
    results: dict[str, Any] = {}
    for name, words in cases():
        scene = SCENES[int(name[6:])] if name.startswith("scene ") else ""
        if not (only in name or f'kind = "{only}"' in scene):
            continue
        with tempfile.TemporaryDirectory(prefix="corpus-") as folder:
            shutil.copytree(CASES / "inputs", folder, dirs_exist_ok=True)
            if name.startswith("scene "):
                Path(folder, "s.toml").write_text(scene, encoding="utf-8")
            inputs = {path.name for path in Path(folder).iterdir()}
            results[name] = run(words, Path(folder), inputs, checkout)
    path.write_text(json.dumps(results, ensure_ascii=False, indent=0), encoding="utf-8")
    print(f"{len(results)} cases, {sum(result['seconds'] for result in results.values()):.0f} s")


def run(words: list[str], folder: Path, inputs: set[str], checkout: Path) -> dict[str, Any]:
    """Exit code, streams and files of one command, without the places of the folder and of the checkout."""
    from rotor.cli import run as call

    here, out, err = Path.cwd(), io.StringIO(), io.StringIO()
    start = time.process_time()
    signal.alarm(MOST_SECONDS)
    os.chdir(folder)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            code = call(words)
    except BaseException as error:
        code = f"{type(error).__name__}: {error}"
    finally:
        signal.alarm(0)
        os.chdir(here)
    files = {}
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.name not in inputs:
            binary = path.suffix in BINARY
            files[path.name] = "binary" if binary else path.read_text("utf-8", errors="replace")
    texts = {"out": out.getvalue(), "err": err.getvalue()} | {f"file {name}": text for name, text in files.items()}
    clean = {
        name: TIMED.sub("", text.replace(str(folder), "FOLDER").replace(str(checkout), "CHECKOUT"))[:MOST_CHARACTERS]
        for name, text in texts.items()
    }
    return {"code": code, "seconds": round(time.process_time() - start, 3), **clean}


def compare(before: Path, after: Path, verbose: bool) -> int:
    """Print the cases that differ and return their number."""
    old, new = (json.loads(path.read_text(encoding="utf-8")) for path in (before, after))
    count = 0
    for name in [name for name in old if name in new or len(new) == len(old)]:
        differences = [] if name in new else ["is missing"]
        for key in sorted((old[name].keys() | new.get(name, {}).keys()) - {"seconds"}) if name in new else ():
            differences += difference(key, old[name].get(key), new[name].get(key))
        count += bool(differences)
        if differences:
            print(f"== {name}")
            print("\n".join(differences if verbose else differences[:12]))
    print(f"{count} of {len(old)} cases differ")
    return count


def difference(key: str, old: Any, new: Any) -> list[str]:
    """What differs in one text, number by number."""
    if old == new:
        return []
    if not isinstance(old, str) or not isinstance(new, str):
        return [f"{key}: {str(old)[:200]} -> {str(new)[:200]}"]
    results = []
    for line in difflib.unified_diff(old.splitlines(), new.splitlines(), lineterm="", n=0):
        if line[:1] in "+-" and line[:3] not in ("+++", "---"):
            results.append(line)
    gone, come = ([line[1:] for line in results if line[0] == sign] for sign in "-+")
    if len(gone) == len(come) and all(same(a, b) for a, b in zip(gone, come, strict=True)):
        return []
    return [f"  {key}: {line[:300]}" for line in results]


def same(first: str, other: str) -> bool:
    """Whether two lines have the same words and numbers within round-off."""
    if NUMBER.sub("#", first) != NUMBER.sub("#", other):
        return False
    pairs = zip(NUMBER.findall(first), NUMBER.findall(other), strict=True)
    return all(abs(float(a) - float(b)) <= 1e-9 * max(abs(float(a)), abs(float(b))) + 1e-12 for a, b in pairs)


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="what", required=True)
    make = commands.add_parser("record")
    make.add_argument("path", type=Path)
    make.add_argument("--checkout", type=Path, default=HERE.parent)
    make.add_argument("--only", default="", help="cases with this text, or scenes of this kind")
    both = commands.add_parser("compare")
    both.add_argument("before", type=Path)
    both.add_argument("after", type=Path)
    both.add_argument("--verbose", action="store_true")
    options = parser.parse_args()
    if options.what == "record":
        record(options.path, options.checkout.resolve(), options.only)
    else:
        compare(options.before, options.after, options.verbose)


if __name__ == "__main__":
    signal.signal(signal.SIGALRM, lambda *_: (_ for _ in ()).throw(TimeoutError("too long")))
    main()
