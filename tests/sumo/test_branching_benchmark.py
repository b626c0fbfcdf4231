"""The measurement of branches, at its smallest size."""

from __future__ import annotations

import pytest
from support import benchmark


def test_it_prints_that_all_is_the_same(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every part once, on the network that is quickest."""
    measured = benchmark("branching")
    monkeypatch.setattr(measured, "PREFIXES", (5,))
    words = "--net pedestrians --branches 5 --costs 1 --many 2 --failures 1".split()
    monkeypatch.setattr("sys.argv", ["branching.py", *words])
    with pytest.raises(SystemExit) as ended:
        measured.main()
    said = capsys.readouterr().out
    assert ended.value.code == 0, said
    assert said.count("5 of 5 branches the same (0 errors), 1 of 1 episodes") == 2
    assert "by fork" in said
    before, after = said.split("resources")[1].splitlines()[0].split(": ")[1].split("; ")
    assert before.rpartition(",")[0] == after.rpartition(",")[0]
    assert "verdicts the same" in said
