"""Everything at once: processes die and stop at random, and the batch comes out all the same."""

from __future__ import annotations

import contextlib
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from support import rows

from cavsumo.results.reading import read_manifest

RUNS = 18
DEADLINE_S = 5  # of an episode while processes are stopped
HITS = 4
PATIENCE_S = 120.0  # for the whole of it, on a busy machine
SESSIONS = 12  # how often the batch is gone on with at most

# Takes its time, so that there is time to kill, and says which process it plays in.
SLOW = """
import os, time
from pathlib import Path
from cavsumo.egos import Acceleration

class Slow:
    depart_speed = 6.0

    def act(self, snapshot):
        Path("playing", str(os.getpid())).touch()
        time.sleep(0.003)
        return Acceleration(0.0)
"""


def start(folder: Path, *words: str) -> subprocess.Popen[bytes]:
    """``cavsumo run`` as a process of its own."""
    line = [sys.executable, "-m", "cavsumo", "run", "-q", "-j", "2", *words]
    return subprocess.Popen(line, cwd=folder, stderr=(folder / "stderr").open("ab"))


def playing(parent: int, folder: Path) -> list[int]:
    """The children of a process that simulate and are past their start."""
    found = []
    for mark in folder.iterdir():
        with contextlib.suppress(OSError):  # gone meanwhile
            process = Path("/proc", mark.name)
            mine = (process / "stat").read_text().rpartition(")")[2].split()[1] == str(parent)
            if mine and b"cavsumo.batch.worker_process" in (process / "cmdline").read_bytes():
                found.append(int(mark.name))
    return found


@pytest.mark.slow
def test_a_batch_survives_whatever_happens_to_its_processes(
    networks: dict[str, Path], tmp_path: Path
) -> None:
    """Workers killed and stopped at random, the parent killed in the middle, then the errors again.

    What was not hit is the row of a quiet run at any time, and in the end every row is.
    """
    (tmp_path / "slow.py").write_text(SLOW, encoding="utf-8")
    marks = tmp_path / "playing"
    marks.mkdir()
    line = f"-r none --ego slow:Slow --agent random --testers 2 --runs {RUNS} --end 5"
    words = ["-n", str(networks["pedestrians"]), "--trace", "all", *line.split()]
    hurried = ["--deadline", str(DEADLINE_S)]
    quiet, file = tmp_path / "quiet.csv", tmp_path / "chaos.csv"
    assert start(tmp_path, *words, "-o", quiet.name).wait(PATIENCE_S) in (0, 1)
    expected = [row | {"trace": row["trace"].replace("quiet/", "chaos/")} for row in rows(quiet)]

    signals = [signal.SIGKILL] * (HITS - 1) + [signal.SIGSTOP]
    random.Random(7).shuffle(signals)
    end, parent_killed = time.monotonic() + PATIENCE_S, False
    for _ in range(SESSIONS):
        process, stopped = start(tmp_path, *words, *hurried, "-o", file.name, "--resume"), set()
        try:
            while process.poll() is None:
                assert time.monotonic() < end, (tmp_path / "stderr").read_text()
                there = rows(file) if file.is_file() and file.stat().st_size else []
                if len(there) >= RUNS // 3 and not parent_killed:
                    process.kill()
                    parent_killed = True
                elif targets := sorted({*playing(process.pid, marks)} - stopped):
                    unhurt = all(row["outcome"] != "error" for row in there)
                    if signals or unhurt:
                        number = signals.pop() if signals else signal.SIGKILL
                        stopped |= {targets[0]} if number == signal.SIGSTOP else set()
                        with contextlib.suppress(ProcessLookupError):  # it went meanwhile
                            os.kill(targets[0], number)
                time.sleep(0.3)
        finally:
            process.kill()
            process.wait()
        if parent_killed and read_manifest(file)["status"] == "finished":
            break
    assert parent_killed
    assert read_manifest(file)["status"] == "finished", (tmp_path / "stderr").read_text()

    there = rows(file)
    assert [int(row["run"]) for row in there] == list(range(RUNS))
    errors = [row for row in there if row["outcome"] == "error"]
    assert errors
    for row in errors:
        assert (
            "died of SIGKILL" in row["error"] or f"no answer within {DEADLINE_S} s" in row["error"]
        )
    assert [row for row in there if row not in errors] == [
        row for row in expected if row["run"] not in {failed["run"] for failed in errors}
    ]

    assert start(tmp_path, "-o", file.name, "--retry-errors", "--deadline", "60").wait(
        PATIENCE_S
    ) in (0, 1)
    assert rows(file) == expected
    for trace in quiet.with_suffix("").glob("run*"):
        again = file.with_suffix("") / trace.name
        assert again.read_bytes() == trace.read_bytes()
    assert "Traceback" not in (tmp_path / "stderr").read_text()
