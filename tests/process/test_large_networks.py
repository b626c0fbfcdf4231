"""On a large network workers play episodes in forks: rows, traces and errors are as without."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from inline import played_here
from support import rows

from cavsumo.batch.episode_server import LARGE
from cavsumo.batch.executors import Means, opened
from cavsumo.batch.jobs import job
from cavsumo.batch.prepared import prepare
from cavsumo.batch.worker import Worker, play
from cavsumo.cli import main
from cavsumo.model.offspring import descendants
from cavsumo.model.scenario import plan_from
from cavsumo.network.osm.netconvert import sumo_home

pytestmark = pytest.mark.usefixtures("netconvert")
# Kills itself in the episode of one seed, wherever that is played.
CRASHING = """
import os, signal
from cavsumo.egos import Acceleration

class Crashing:
    def reset(self, scene):
        self.doomed = scene.seed == {seed}

    def act(self, snapshot):
        if self.doomed and snapshot.step > 3:
            os.kill(os.getpid(), signal.SIGSEGV)
        return Acceleration(0.5)
"""


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory, netconvert: None) -> Path:
    """A grid with pavements and crossings, of more lanes than a network without forks may have."""
    file = tmp_path_factory.mktemp("large") / "grid.net.xml"
    words = "--grid --grid.number 7 --sidewalks.guess --crossings.guess -o".split()
    program = sumo_home() / "bin" / "netgenerate"
    subprocess.run([program, *words, file], check=True, capture_output=True, timeout=60)
    assert file.read_text(encoding="utf-8").count("<lane ") >= LARGE
    return file


def test_rows_and_traces_are_the_same(
    large: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """In forks of two processes, in the process of this test, or resumed in the middle."""
    monkeypatch.chdir(tmp_path)
    words = ["run", "-n", str(large), "--traffic", "4,4", "--agent", "timing", "--agent", "random"]
    words += ["--runs", "2", "--trace", "all", "--end", "8", "--exit-zero"]
    with played_here():
        assert main([*words, "-q", "-o", "here.csv"]) == 0
    assert main([*words, "-j", "2", "-o", "forks.csv"]) == 0
    assert "SUMO is started for every episode" not in capfd.readouterr().err
    assert main([*words[:-1], "-q", "-x", "-o", "part.csv"]) in (0, 1)
    assert main(["run", "--resume", "-q", "--exit-zero", "--no-first", "-o", "part.csv"]) == 0
    for name in ("forks", "part"):
        assert untimed(Path(f"{name}.csv")) == untimed(Path("here.csv"))
        for trace in Path("here").glob("*.jsonl*"):
            assert (Path(name) / trace.name).read_bytes() == trace.read_bytes()


def untimed(file: Path) -> list[dict[str, str]]:
    """The rows of a file, without the real time and the folder of the traces."""
    return [
        {k: Path(v).name if k == "trace" else v for k, v in row.items() if k != "wall_s"}
        for row in rows(file)
    ]


def test_a_crash_of_a_fork_leaves_the_process(
    large: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, controller: Callable[..., str]
) -> None:
    """One row, with the words of a process that died, and the same process plays on."""
    monkeypatch.chdir(tmp_path)
    settings = {"net": str(large), "end": 5.0, "reference": "none"}
    module = controller(CRASHING.format(seed=job(plan_from(settings, "test"), 3).seed))
    plan = plan_from(settings | {"ego": f"{module}:Crashing"}, "test")
    with Worker(prepare(plan)) as worker:
        errors = [worker.play(job(plan, run)).outcome.row["error"] for run in range(3)]
        processes = descendants(os.getpid())
        errors += [worker.play(job(plan, run)).outcome.row["error"] for run in (3, 4)]
        assert errors == ["", "", "", "the simulation process died of SIGSEGV", ""]
        assert descendants(os.getpid()) == processes


def test_it_is_said_why_there_are_no_forks(
    large: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Once, on stderr: the results are the same."""
    monkeypatch.chdir(tmp_path)
    net = large.read_text(encoding="utf-8")
    edge = net[net.index('<edge id="A0') + 10 :].partition('"')[0]
    flow = f'<flow id="f" begin="0" end="9" probability="0.1" from="{edge}" to="{edge}"/>'
    (tmp_path / "x.rou.xml").write_text(f"<routes>{flow}</routes>")
    words = ["run", "-n", str(large), "-r", "x.rou.xml", "--runs", "3", "--end", "3", "--exit-zero"]
    assert main([*words, "-o", "r.csv"]) == 0
    said = capfd.readouterr().err
    assert said.count("SUMO is started for every episode: flow 'f' has random departures") == 1


def test_nothing_runs_after_a_batch(large: Path) -> None:
    """Neither the processes nor their forks."""
    before = descendants(os.getpid())
    plan = plan_from({"net": str(large), "end": 3.0}, "test")
    prepared = prepare(plan)
    with opened(Means(jobs=2)) as (executor, _):
        list(executor.map(play, [prepared] * 4, [job(plan, run) for run in range(4)]))
    assert descendants(os.getpid()) == before
