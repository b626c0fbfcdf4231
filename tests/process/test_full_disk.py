"""What a batch writes on a disk that is full, and beside another process."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest
from support import content

from cavsumo.errors import ResultsError
from cavsumo.results.reading import read_manifest, read_rows
from cavsumo.results.rows import Outcome
from cavsumo.results.writing import Recorder

PLAN = {"plan": {"seed": 1}}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Where the results go, in a folder of their own."""
    return tmp_path / "r.csv"


def test_two_recorders_never_write_one_file(file: Path) -> None:
    """The second is refused as long as the first is open, in this process and in another."""
    code = f"from cavsumo.results.writing import *\nwith Recorder(Path({str(file)!r})): pass"
    with Recorder(file) as recorder:
        recorder.begin(PLAN)
        recorder.write(Outcome({"run": 0, "agent": "noop", "outcome": "held"}))
        before = content(file.parent)
        with pytest.raises(ResultsError, match="another run is writing them"), Recorder(file):
            pytest.fail("two writers")
        other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        assert "another run is writing them" in other.stderr
        assert content(file.parent) == before
        recorder.finish("finished", {})
    with Recorder(file):
        pass
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


UNCOMPILED = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}  # it would be cut, and kept, too

FULL = """
import resource, sys
from pathlib import Path
from cavsumo.errors import BatchError
from cavsumo.results.rows import Outcome
from cavsumo.results.writing import Recorder

file, what = Path(sys.argv[1]), sys.argv[2]
row = {"agent": "noop", "outcome": "error", "error": 1500 * "x"}
trace = 1500 * b"y" if what == "rows" else 20_000 * b"y"
with Recorder(file) as recorder:
    recorder.begin({})
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, 10_000))
    try:
        for run in range(20):
            last = what == "rows" or run == 3
            recorder.write(Outcome(row | {"run": run}, trace if last else b""))
    except BatchError as error:
        print(run, error)
"""


@pytest.mark.parametrize("what", ["rows", "trace"])
def test_a_full_disk_leaves_whole_rows(file: Path, what: str) -> None:
    """The disk takes part of a row, or of a trace: one sentence, and no part of it stays."""
    words = [sys.executable, "-c", FULL, str(file), what]
    done = subprocess.run(words, env=UNCOMPILED, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    failed, _, said = done.stdout.partition(" ")
    assert "cannot be written: File too large; the rows before are whole" in said
    rows = read_rows(file)
    assert 0 < len(rows) == int(failed) < 20
    assert file.read_bytes().endswith(b"\n")
    assert all(len(row["error"]) == 1500 for row in rows)
    last = file.with_suffix("") / f"run{len(rows):06d}.jsonl.gz"
    assert not last.exists() or what == "rows"
    todo = iter(range(20))
    with Recorder(file) as recorder:
        assert list(recorder.resume(read_manifest(file), todo)) == rows
        assert not last.exists()
        assert next(todo) == len(rows)
        recorder.finish("finished", {})


LIMITED = """
import resource, sys
from cavsumo.cli import main

limit = int(sys.argv[1])
resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
sys.exit(main(sys.argv[2:]))
"""


def test_a_full_disk_ends_a_run_with_one_sentence(
    networks: Mapping[str, Path], tmp_path: Path
) -> None:
    """Exit 3 and no traceback; with room again --resume gives the rows of an undisturbed run."""
    words = ["run", "-n", str(networks["pedestrians"]), "-r", "none", "--end", "1", "-q"]
    words += ["--agent", "noop", "--testers", "1", "--runs", "60", "--trace", "none"]

    def limited(limit: int, *more: str) -> subprocess.CompletedProcess[str]:
        line = [sys.executable, "-c", LIMITED, str(limit), *words, *more]
        return subprocess.run(
            line, cwd=tmp_path, env=UNCOMPILED, capture_output=True, text=True, timeout=120
        )

    done = limited(8_000)
    assert done.returncode == 3, done.stderr
    assert done.stderr.count("\n") == 1
    assert "cannot be written: File too large" in done.stderr
    file = tmp_path / "results.csv"
    assert file.read_bytes().endswith(b"\n")
    kept = read_rows(file)
    assert 0 < len(kept) < 60
    assert read_manifest(file)["status"] == "broken"
    assert limited(10_000_000, "--resume").returncode == 0
    rows = read_rows(file)
    assert rows[: len(kept)] == kept
    assert [int(row["run"]) for row in rows] == list(range(60))


FULL_AT_ONCE = """
import resource, sys
from pathlib import Path
from cavsumo.errors import ResultsError
from cavsumo.results.writing import Recorder

resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
try:
    with Recorder(Path(sys.argv[1])) as recorder:
        recorder.begin({})
except ResultsError as error:
    print(error)
"""


def test_a_disk_full_from_the_start_is_one_sentence(file: Path) -> None:
    """Not even the manifest fits: refused by name, and nothing half there is left."""
    words = [sys.executable, "-c", FULL_AT_ONCE, str(file)]
    done = subprocess.run(words, env=UNCOMPILED, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "cannot be written: File too large" in done.stdout
    assert content(file.parent) == {}
    with Recorder(file) as recorder:
        recorder.begin(PLAN)
        recorder.finish("finished", {})
