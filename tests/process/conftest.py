"""What the tests of processes share: scripts of benchmarks/."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from scripts_played import Play, scripts


@pytest.fixture
def play(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Iterator[Play]:
    """Call with a benchmark, its words and values of its constants: what it prints."""
    with scripts(monkeypatch, capsys) as played:
        yield played
