"""``python -m cavsumo``, a process of its own: a whole batch, and two refusals."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from cavsumo.results.reading import read_manifest, read_rows


def process(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """The command, run in a folder."""
    return subprocess.run(
        [sys.executable, "-m", "cavsumo", *words],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
    )


def test_one_command_tests_at_a_real_junction(tmp_path: Path, networks: Mapping[str, Path]) -> None:
    """With a network and nothing else: says what it chose, runs, writes and sums up."""
    done = process(tmp_path, "run", "--net", str(networks["crossing"]), "--runs", "2")
    steps = "..."  # the end of what is said of steps that take long on this machine
    first = next(line for line in done.stderr.splitlines() if not line.endswith(steps))
    for choice in ("agent timing", "ego sumo", "network crossing", "seed 1", "2 episodes"):
        assert choice in first
    rows = read_rows(tmp_path / "results.csv")
    assert [row["run"] for row in rows] == ["0", "1"]
    assert {row["outcome"] for row in rows} <= {"violated", "held", "not_triggered", "unfair"}
    manifest = read_manifest(tmp_path / "results.csv")
    assert (manifest["status"], manifest["episodes"]) == ("finished", 2)
    assert "timing" in done.stdout
    assert "in 2 episodes" in done.stdout
    assert done.returncode == int(any(row["outcome"] == "violated" for row in rows))


@pytest.mark.parametrize(
    ("words", "said"),
    [("cook", "unknown command 'cook'"), ("run --agent timming", "did you mean 'timing'?")],
)
def test_bad_input_is_one_sentence(tmp_path: Path, words: str, said: str) -> None:
    """On stderr, with exit status 2, and nothing written."""
    done = process(tmp_path, *words.split())
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("cavsumo: ")
    assert done.stderr.count("\n") == 1
    assert said in done.stderr
    assert list(tmp_path.iterdir()) == []
