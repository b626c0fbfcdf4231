"""Damaged input of every sort: a sentence that speaks of the file, no traceback, nothing written.

``benchmarks/fuzz.py`` plays ten thousand; here are a few of each sort, the same every time.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support import ROOT

CASES = 20
SORTS = (
    *("scenario", "study", "manifest", "rows", "trace", "network", "junction", "routes", "extract"),
    *("game", "policy", "words", "reply"),
)
LARGE = ("junction", "extract")


@pytest.fixture(scope="module")
def fuzz() -> Iterator[Any]:
    """The benchmark with the modules beside it."""
    with pytest.MonkeyPatch.context() as patched:
        patched.syspath_prepend(str(ROOT / "benchmarks"))
        yield importlib.import_module("fuzz")
        for name in ("fuzz", "fuzz_cases", "fuzz_inputs"):
            sys.modules.pop(name)


@pytest.fixture(scope="module")
def sorts(fuzz: Any) -> dict[str, Any]:
    """Cases of every sort, none of which starts SUMO."""
    found: dict[str, Any] = fuzz.strategies(fuzz.whole_files(), simulated=False)
    return found


def test_every_sort_is_tried(sorts: dict[str, Any]) -> None:
    """A sort that is added is in the list above."""
    assert set(sorts) == set(SORTS)


@pytest.mark.parametrize("sort", SORTS)
def test_no_damaged_input_ends_in_a_traceback(
    fuzz: Any, sorts: dict[str, Any], tmp_path: Path, sort: str
) -> None:
    """One sentence without words of Python, not too long, within the deadline."""
    count = CASES // 3 if sort in LARGE else CASES
    ends, longest, bad, _ = fuzz.fuzzed(sort, sorts[sort], count, 7, tmp_path)
    assert bad == []
    assert sum(ends.values()) == count
    assert longest <= fuzz.LONGEST + len("cavsumo: ")


@pytest.mark.parametrize(
    ("said", "end"),
    [
        ("cavsumo: trace 'a': line 2: no JSON", ""),
        ("Traceback", "status"),
        ("cavsumo: KeyError: 'bodies'", "words"),
        ("cavsumo: 'NetReader' object has no attribute 'x'", "words"),
        ("cavsumo: " + "x" * 501, "long"),
    ],
)
def test_the_fuzz_tells_good_refusals_from_bad_ones(fuzz: Any, said: str, end: str) -> None:
    """By status, words and length; and whether something was written."""
    assert fuzz._wrong(2, said, False) == end
    assert fuzz._wrong(2, "cavsumo: no", True) == "written"
    assert fuzz._wrong(4, "cavsumo: no", False) == "status"


def test_the_fuzz_sees_tracebacks_and_hangs(
    fuzz: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else it would find none."""

    def raises(words: list[str]) -> int:
        raise KeyError(words[0])

    def hangs(words: list[str]) -> int:
        while True:
            pass

    monkeypatch.setattr(fuzz, "LIMIT_S", 0.05)
    for does, end in ((raises, "traceback"), (hangs, "hang")):
        monkeypatch.setattr(fuzz, "cavsumo", does)
        assert fuzz.tried(fuzz.Case(("run",), {}), tmp_path).end == end
