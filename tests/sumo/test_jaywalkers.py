"""Testers that start beside the road in episodes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from cavsumo import cli
from cavsumo.results.reading import read_rows


def test_jaywalkers_find_failures_where_there_is_no_pavement(
    bare: Callable[[str], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The timing agent triggers tests from beside the road, with background traffic."""
    monkeypatch.chdir(tmp_path)
    words = ["--net", str(bare("pedestrians")), "--jaywalk", "--traffic", "3", "--runs", "8", "-q"]
    assert cli.main(["run", *words, "--exit-zero", "--trace", "none"]) == 0
    rows = read_rows(tmp_path / "results.csv")
    assert not any(row["error"] for row in rows)
    assert sum(row["outcome"] in ("held", "violated") for row in rows) >= 2
