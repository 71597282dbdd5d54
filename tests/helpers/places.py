"""Where the tests find the project, the samples beside them, and the shared reference files."""

from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
PROJECT = TESTS.parent
ORACLES = TESTS / "oracles"
SHARED = PROJECT.parent / "shared"
