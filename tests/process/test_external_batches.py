"""Batches with egos from outside: what an ego that fails costs, what it sees, how it ends."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from inline import played_here
from moody import FAULTS, MOODY, edit, line, pids
from support import alive, rows, traces, until, workers_of

from cavsumo.cli import main
from cavsumo.results.reading import read_manifest


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, with the moody ego in it."""
    (tmp_path / "moody.py").write_text(MOODY, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


# Batches ------------------------------------------------------------------------------------------


def run(net: Path, ego: str, *words: str, output: str = "r.csv") -> int:
    """``cavsumo run`` with that ego, quietly; only the ego is a process of its own."""
    with played_here():
        return main(["run", "-n", str(net), "--ego", ego, "-q", "-o", output, *words])


SHORT = "-r none --agent noop --testers 1 --end 2 --trace none".split()


def test_a_batch_goes_on_with_a_fresh_process(networks: dict[str, Path], here: Path) -> None:
    """Episodes that went wrong are errors, others are played; --retry-errors makes it whole."""
    faults = ["killed", "stopped", "garbage", "none", "long"]
    (here / "faults").write_text(" ".join(faults))
    words = [*SHORT, "--runs", "6", "--ego-param", "reply_s=0.5"]
    assert run(networks["pedestrians"], line("none"), *words) == 3
    there = rows(here / "r.csv")
    for row, fault in zip(there, [*faults, "none"], strict=True):
        assert row["outcome"] == ("not_triggered" if fault == "none" else "error")
        if fault != "none":
            assert re.search(f"at 0.30 s: {dict(FAULTS)[fault]}$", row["error"])
    assert len(pids(here)) == 5
    assert not any(alive(pid) for pid in pids(here))
    with played_here():
        assert main(["run", "--retry-errors", "-o", "r.csv", "-q"]) == 0
    assert {row["outcome"] for row in rows(here / "r.csv")} == {"not_triggered"}


def test_an_ego_that_cannot_be_started_again_costs_rows_not_the_batch(
    networks: dict[str, Path], here: Path
) -> None:
    """The script is taken away while the batch runs: each episode says so."""
    edit(here / "moody.py", "def misbehave():", "def misbehave():\n    os.remove('moody.py'); 1/0")
    assert run(networks["pedestrians"], line("any"), *SHORT, "--runs", "2") == 3
    first, second = rows(here / "r.csv")
    assert "at 0.30 s: ended with status 1 (ZeroDivisionError" in first["error"]
    assert "at 0.00 s (reset): ended with status 2" in second["error"]
    assert "No such file" in second["error"]


def test_what_an_ego_prints_lies_beside_its_row(networks: dict[str, Path], here: Path) -> None:
    """Only for episodes in which it printed; also when it dies of it."""
    (here / "faults").write_text("exits")
    assert run(networks["pedestrians"], line("none"), *SHORT, "--runs", "3") == 3
    assert traces(here / "r.csv") == {"run000000.ego.log": "\n  no GPU found  \n\n"}


def test_the_files_of_a_command_are_in_the_manifest(networks: dict[str, Path], here: Path) -> None:
    """A changed controller is noticed by whoever goes on with the batch."""
    assert run(networks["pedestrians"], line("none"), *SHORT, "--runs", "1") == 0
    assert "moody.py" in read_manifest(here / "r.csv")["sha256"]
    (here / "moody.py").write_text(MOODY + "\n# changed\n")
    assert main(["run", "--resume", "--runs", "2", "-o", "r.csv", "-q"]) == 2


def test_the_deadline_of_an_episode_holds(networks: dict[str, Path], here: Path) -> None:
    """An ego that may take long over an answer, and takes longer than the episode may."""
    edit(here / "moody.py", "def misbehave():", "def misbehave():\n    time.sleep(30)")
    words = [*SHORT, "--runs", "1", "--deadline", "1", "--ego-param", "reply_s=40"]
    net = str(networks["pedestrians"])
    assert main(["run", "-n", net, "--ego", line("any"), "-q", "-o", "r.csv", *words]) == 3
    assert rows(here / "r.csv")[0]["error"].startswith("no answer within 1 s, killed")
    until(lambda: not any(alive(pid) for pid in pids(here)), "they are gone")


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not tell children")
def test_an_ego_dies_with_a_process_that_is_killed(networks: dict[str, Path], here: Path) -> None:
    """kill -9 of the process that simulates, while its ego is stopped: neither is left."""
    words = ["run", "-n", str(networks["pedestrians"]), "--ego", line("stopped"), "-q", *SHORT]
    words += ["--runs", "1", "--ego-param", "reply_s=60", "-o", "r.csv"]
    with subprocess.Popen([sys.executable, "-m", "cavsumo", *words]) as process:
        until(lambda: pids(here) and _state(pids(here)[0]) == "T", "the ego stands still")
        (worker,) = workers_of(process.pid)
        os.kill(worker, signal.SIGKILL)
        assert process.wait(60.0) == 3
    assert "died of SIGKILL" in rows(here / "r.csv")[0]["error"]
    until(lambda: not any(alive(pid) for pid in pids(here)), "the ego is gone")


def _state(pid: int) -> str:
    """The letter of a process's state."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    return ""


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_an_ego_inherits_three_pipes_and_nothing_else(
    networks: dict[str, Path], here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No descriptor of ours, no signal ignored, the environment and folder of the command line."""
    (here / "probe.sh").write_text(
        "ls -l /proc/$$/fd > fds\n"  # no pipe of its own: the shell would hold it for a moment
        "cat /proc/self/status > status\nenv > environment\npwd > folder\n"
        f"exec {sys.executable} moody.py none\n"
    )
    monkeypatch.setenv("PYTHONPATH", os.environ.get("PYTHONPATH", "") + os.pathsep + "/mine")
    words = [sys.executable, "-m", "cavsumo", "run", "-n", str(networks["pedestrians"]), "-q"]
    words += ["--ego", "exec:sh probe.sh", *SHORT, "--runs", "1", "-o", "r.csv"]
    assert subprocess.run(words, timeout=120, check=False).returncode == 0
    found = re.findall(r"-> (\w+|/.*)", (here / "fds").read_text())
    mine = str(here)  # the script and where the shell writes
    assert [fd for fd in found if not fd.startswith(mine)] == ["pipe"] * 3
    status = dict(line.split(":\t", 1) for line in (here / "status").read_text().splitlines())
    assert int(status["SigIgn"], 16) & (1 << 1 | 1 << 12) == 0, "SIGINT or SIGPIPE is ignored"
    seen = (here / "environment").read_text().splitlines()
    assert f"PYTHONPATH={os.environ['PYTHONPATH']}" in seen
    assert not [line for line in seen if line.startswith("CAVSUMO")]
    assert (here / "folder").read_text().strip() == str(here.resolve())


def test_a_server_that_goes_away_costs_rows(networks: dict[str, Path], here: Path) -> None:
    """It serves an episode and ends: that connection is closed, the next one refused."""
    with contextlib.closing(socket.create_server(("127.0.0.1", 0))) as listening:
        spec = f"tcp:127.0.0.1:{listening.getsockname()[1]}"
        helper = threading.Thread(target=_serve_a_while, args=(listening,))
        helper.start()
        assert run(networks["pedestrians"], spec, *SHORT, "--runs", "2") == 3
        helper.join()
    first, second = rows(here / "r.csv")
    assert first["error"].endswith("at 0.10 s: closed the connection")
    assert second["error"].endswith("at 0.00 s (reset): cannot be reached: Connection refused")


def _serve_a_while(listening: socket.socket) -> None:
    """Answer hello, reset and one observation, then go."""
    connection, _ = listening.accept()
    listening.close()
    answers = [{"type": "hello", "version": 1}, {"type": "ready"}, {"acceleration": 0}]
    with connection, connection.makefile("r") as lines:
        for answer in answers:
            lines.readline()
            connection.sendall(json.dumps(answer).encode() + b"\n")
