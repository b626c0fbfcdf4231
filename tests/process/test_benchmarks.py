"""Whether every script of benchmarks/ is played by a test."""

from __future__ import annotations

import re
from pathlib import Path

from support import ROOT

ELSEWHERE = {  # libraries, and the fuzz with its cases
    "rings": "unit/test_games.py",
    "storm": "unit/test_games_random.py",
    "fuzz": "sumo/test_fuzz.py",
    "fuzz_cases": "sumo/test_fuzz.py",
    "fuzz_inputs": "sumo/test_fuzz.py",
}


def test_every_benchmark_is_played() -> None:
    """Scripts that are added get a test, too: in a file beside this one or where ELSEWHERE says."""
    files = Path(__file__).parent.glob("test_benchmarks_*.py")
    tests = "".join(file.read_text(encoding="utf-8") for file in files)
    scripts = {file.stem for file in (ROOT / "benchmarks").glob("*.py")} - set(ELSEWHERE)
    for name, file in ELSEWHERE.items():
        assert name.split("_")[0] in (ROOT / "tests" / file).read_text(encoding="utf-8")
    assert scripts == set(re.findall(r'play\(\s*"(\w+)"', tests))
