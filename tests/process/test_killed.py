"""Commands that are killed or interrupted: whole rows stay, nobody is left, the rest follows."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from inline import played_here
from support import PATIENCE_S, alive, assert_same, rows, traces, until, untold, workers_of

from cavsumo.cli import main
from cavsumo.results.reading import read_manifest

RUNS = 9

# Its first episode never ends; the file ``hanging`` says that it began.
ENDLESS = """
import time
from pathlib import Path

class Endless:
    depart_speed = 6.0

    def __init__(self, hanging):
        self.hanging = Path(hanging)

    def reset(self, scene):
        if scene.starts:
            self.hanging.touch()
            time.sleep(3600)

    def act(self, snapshot):
        raise NotImplementedError
"""
STUDY = """
net = "{net}"
routes = "none"
agents = ["soon=timing", "q-learning"]
runs = 4
end = 6
trace = "all"
ego = "constant"
params = {{ "soon.aim" = 0.9 }}

[vary]
testers = [1, 2]
"""


def assert_gone(workers: Mapping[int, str]) -> None:
    """These processes end soon; one that nobody has buried yet counts as gone."""
    assert workers
    until(lambda: not any(alive(*worker) for worker in workers.items()), "the workers are gone")


class Command:
    """``cavsumo run`` as a process of its own."""

    def __init__(self, folder: Path, *words: str) -> None:
        line = [sys.executable, "-m", "cavsumo", "run", *words]
        self.file = folder / "results.csv"
        self.said = folder / "stderr"
        with self.said.open("wb") as stderr:
            self.process = subprocess.Popen(
                line, cwd=folder, stdout=subprocess.DEVNULL, stderr=stderr
            )

    def __enter__(self) -> Command:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.wait()

    def reaches(self, lines: int) -> dict[int, str]:
        """Wait until so many lines are written; the processes that simulate then."""
        self.until(lambda: self.file.is_file() and self.file.read_bytes().count(b"\n") >= lines)
        return workers_of(self.process.pid)

    def until(self, happened: Callable[[], Any]) -> None:
        """Wait until something is so while the command runs."""

        def over() -> bool:
            ended = self.process.poll()
            assert ended is None, f"ended with {ended}: {self.said.read_text()}"
            return bool(happened())

        until(over, "the command had come so far")


@pytest.fixture(scope="module")
def words(networks: Mapping[str, Path]) -> list[str]:
    """One agent that learns and one that does not, with traces."""
    line = f"-r none --end 8 --runs {RUNS} --agent timing --agent q-learning --testers 2 -q"
    return ["-n", str(networks["crossing"]), *line.split()]


@pytest.fixture(scope="module")
def quiet(words: list[str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The batch that nobody disturbed, played in this process."""
    file = tmp_path_factory.mktemp("quiet") / "results.csv"
    with played_here():
        assert main(["run", *words, "-o", str(file)]) in (0, 1)
    assert traces(file)
    return file


@pytest.fixture
def endless(networks: Mapping[str, Path], tmp_path: Path) -> list[str]:
    """The words of a batch whose episodes never end."""
    (tmp_path / "endless.py").write_text(ENDLESS, encoding="utf-8")
    line = "-r none --ego endless:Endless --agent noop --deadline 600 --ego-param"
    return ["-n", str(networks["pedestrians"]), *line.split(), f"hanging={tmp_path / 'hanging'}"]


# Killed -------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_batch_killed_again_and_again_is_the_one_that_was_not(
    quiet: Path, words: list[str], tmp_path: Path
) -> None:
    """SIGKILL before the first row and after some; --resume knows the settings.

    No process that simulates outlives the one that was killed.
    """
    for lines in (1, 7):
        batch = [] if (tmp_path / "results.json").exists() else [*words, "-j", "2"]
        with Command(tmp_path, "--resume", "-q", *batch) as command:
            workers = command.reaches(lines)
            assert workers
            command.process.kill()
            command.process.wait()
            assert_gone(workers)
        assert read_manifest(command.file)["status"] == "running"
        assert command.file.read_bytes().count(b"\n") < 2 * RUNS + 1
    with Command(tmp_path, "--resume", "-q", "-j", "2") as command:
        assert command.process.wait(PATIENCE_S) in (0, 1)
    assert_same(command.file, quiet)


def test_workers_that_hang_die_with_their_parent(endless: list[str], tmp_path: Path) -> None:
    """The parent is killed while an episode never ends: nobody hangs on."""
    with Command(tmp_path, *endless, "-q", "-j", "2") as command:
        command.until((tmp_path / "hanging").exists)
        workers = workers_of(command.process.pid)
        command.process.kill()
        assert_gone(workers)


# Interrupted --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("number", "jobs"), [(signal.SIGINT, "2"), (signal.SIGTERM, "1")])
def test_an_interrupted_batch_can_be_gone_on_with(
    quiet: Path,
    words: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    number: int,
    jobs: str,
) -> None:
    """Ctrl-C, or a scheduler whose time is up: exit 130, whole rows, and the rest later."""
    with Command(tmp_path, *words, "-j", jobs) as command:
        workers = command.reaches(4)
        command.process.send_signal(number)
        assert command.process.wait(PATIENCE_S) == 130
        assert_gone(workers)
    there = rows(command.file)
    told = read_manifest(command.file)
    assert (told["status"], told["episodes"]) == ("interrupted", len(there))
    assert there == rows(quiet)[: len(there)]
    assert 3 <= len(there) < 2 * RUNS
    monkeypatch.chdir(tmp_path)
    with played_here():
        assert main(["run", "--resume", "-q"]) in (0, 1)
    assert_same(command.file, quiet)


def test_a_second_interrupt_ends_at_once(endless: list[str], tmp_path: Path) -> None:
    """Whoever does not want to wait for what runs need not: exit 130, whole rows, nobody left."""
    with Command(tmp_path, *endless) as command:
        command.until((tmp_path / "hanging").exists)
        workers = workers_of(command.process.pid)
        command.process.send_signal(signal.SIGINT)
        command.until(lambda: "once more to stop at once" in command.said.read_text())
        command.process.send_signal(signal.SIGINT)
        assert command.process.wait(PATIENCE_S) == 130
        assert_gone(workers)
    assert "Traceback" not in command.said.read_text()
    assert rows(command.file) == []
    assert read_manifest(command.file)["status"] == "interrupted"


@pytest.mark.slow
def test_an_interrupted_study_goes_on_where_it_stopped(
    networks: Mapping[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C in the first batch: 130, the second is not begun; then all is as if played at once."""
    text = STUDY.format(net=networks["pedestrians"])
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    words = [sys.executable, "-m", "cavsumo", "run", "-c", "study.toml", "--exit-zero", "-q"]
    process = subprocess.Popen(words, cwd=tmp_path)
    first, second = (tmp_path / f"results-testers{n}.csv" for n in (1, 2))
    try:
        until(lambda: first.is_file() and first.read_bytes().count(b"\n") > 2, "it plays")
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE_S) == 130
    finally:
        process.kill()
        process.wait()
    assert read_manifest(first)["status"] == "interrupted"
    assert not second.exists()
    with played_here():
        assert main([*words[3:], "--resume"]) == 0
        assert main([*words[3:], "-o", "whole.csv"]) == 0
    for file in (first, second):
        whole = file.with_name(file.name.replace("results", "whole"))
        assert untold(rows(file)) == untold(rows(whole))
        assert read_manifest(file)["status"] == "finished"
        assert read_manifest(file)["learned"] == read_manifest(whole)["learned"]
