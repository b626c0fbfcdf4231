"""Scripts of benchmarks/ about time, memory and room on the disk, at their smallest size."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import pytest
from inline import cavsumo
from scripts_played import Play, numbers
from support import CHROMIUM, ROOT, benchmark

pytestmark = pytest.mark.usefixtures("inline")
NET = str(ROOT / "networks" / "pedestrians.net.xml")


def test_branching(play: Play, capsys: pytest.CaptureFixture[str]) -> None:
    """A few branches by both ways, one prefix, what is left of two, the verdicts of an episode."""
    words = "--net pedestrians --branches 5 --costs 1 --many 2 --failures 1".split()
    with pytest.raises(SystemExit) as ended:
        play("branching", *words, PREFIXES=(5,))
    said = capsys.readouterr().out
    assert ended.value.code == 0, said
    assert said.count("5 of 5 branches the same (0 errors), 1 of 1 episodes") == 2
    assert "refused  pedestrians" in said
    assert "by fork" in said
    before, after, _ = said.split("before 2 branches: ")[1].splitlines()[0].split("; ")
    assert before.rpartition(",")[0] == after.removeprefix("after: ").rpartition(",")[0]
    assert "verdicts the same" in said


def test_budget(play: Play) -> None:
    """Parts of a few episodes, which add up."""
    said = play("budget", "--net", NET, "--testers", "1", "--episodes", "5")
    parts, together = said.splitlines()[1:-1], said.splitlines()[-1]
    total = numbers(together)[-1]
    assert total > 0.0
    assert sum(numbers(line)[-1] for line in parts) == pytest.approx(total, abs=0.05 * len(parts))


def test_environments(play: Play) -> None:
    """An episode in every form."""
    said = play("environments", "--episodes", "1", "--net", NET, ROUNDS=1)
    assert said.splitlines()[1].endswith("1.00 of play")
    assert len(said.splitlines()) == 5


def test_episode_server(
    play: Play, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Three episodes of one setting; a thread that other tests have left holds nothing."""
    monkeypatch.setattr("cavsumo.batch.episode_server.can_fork", lambda: True)
    words = ["--net", NET, "--episodes", "1", "--relative", "1", "--many", "2"]
    with pytest.raises(SystemExit) as ended:
        play("episode_server", *words, SETTINGS={"defaults": {"end": 3.0}})
    said = capsys.readouterr().out.splitlines()
    assert not ended.value.code, said
    assert "3 of 3 the same" in said[0]
    assert "before and after 2 episodes" in said[1]
    assert said[-1].endswith("(1.00)")


def test_external_ego(play: Play) -> None:
    """An episode of each form, the same in all."""
    said = play("external_ego", "--episodes", "1", "--net", NET)
    assert said.startswith("1 episodes, ")
    assert "its exchange with a program that looks at nothing" in said


def test_memory(play: Play) -> None:
    """A hundred stubs and twenty real episodes of half a second."""
    said = play("memory", "--stubs", "100", "--episodes", "20")
    assert said.count("stubs: ") >= 2
    assert said.count("episodes: ") == 3


def test_pages(play: Play) -> None:
    """Two seconds of an episode, on one screen."""
    if CHROMIUM is None:
        pytest.skip("no chromium here: apt-get install chromium")
    pytest.importorskip("playwright.sync_api", reason="no playwright: pip install playwright")
    module = benchmark("pages")
    settings = module.SETTINGS | {"end": 2.0, "assertions": ["collision"]}
    screens = {"laptop": module.SCREENS["laptop"]}
    said = play("pages", "--chromium", CHROMIUM, SETTINGS=settings, SCREENS=screens)
    assert said.count("between two drawings") == 1


def test_playback(play: Play) -> None:
    """An episode of one batch."""
    batches = {"straight": {"net": "pedestrians", "agents": ["timing"], "end": 5.0}}
    with pytest.raises(SystemExit) as ended:
        play("playback", "--runs", "1", BATCHES=batches)
    assert not ended.value.code


def test_reading(play: Play) -> None:
    """A small network, once."""
    assert "1 site" in play("reading", "--net", NET, "--times", "1")


def test_refusals(play: Play) -> None:
    """The help and one refusal."""
    said = play("refusals", "--rounds", "1", COMMANDS=("--help", "agents timming"))
    assert "agents timming" in said


def test_scale(play: Play, capsys: pytest.CaptureFixture[str]) -> None:
    """Two episodes for four rows, merged by this checkout twice."""
    with pytest.raises(SystemExit) as ended:
        play("scale", "--rows", "4", "--played", "1", "--what", "merge", "--other", str(ROOT))
    said = capsys.readouterr().out
    assert ended.value.code == 0, said
    assert said.splitlines()[-1].startswith("merge")
    assert numbers(said.splitlines()[-1])[0] > 0.0
    assert said.count("the same bytes") == 1


def test_scale_of_all_commands(play: Play, capsys: pytest.CaptureFixture[str]) -> None:
    """Each of them twice, in the process of this test: other bytes are told."""
    scale = benchmark("scale")
    answers = itertools.count()

    def run(_: Path, words: list[str], folder: Path) -> tuple[Any, bytes]:
        done = cavsumo(folder, *words)
        assert done.returncode == 0, done.stderr
        own = f"{next(answers)}" if words[0] == "merge" else done.stdout
        return scale.Spent(1.0, 1.0), own.encode()

    with pytest.raises(SystemExit) as ended:
        play("scale", "--rows", "4", "--played", "1", "--other", str(ROOT), run=run)
    said = capsys.readouterr().out
    assert ended.value.code == 1, said
    assert [line.split()[0] for line in said.splitlines()[1:]] == ["report", "merge", "resume"]
    assert said.count("the same bytes") == 2
    assert said.count("OTHER BYTES") == 1


SPEED = ["--net", NET, "--testers", "1", "--rounds", "1"]


def test_speed(play: Play) -> None:
    """Two episodes of this version, and the command."""
    _, line = play("speed", *SPEED, "--episodes", "2").splitlines()
    bare, *others = numbers(line.partition(ROOT.name)[2])
    assert bare > 0.0
    assert len(others) == 6  # alone, whole, command, each with its ratio


def test_speed_beside_another_version(play: Play) -> None:
    """An episode of this version beside itself, without the command."""
    words = [*SPEED, "--episodes", "1", "--no-command"]
    _, *lines = play("speed", *words, "--other", str(ROOT)).splitlines()
    assert [len(numbers(line.partition(ROOT.name)[2])) for line in lines] == [5, 5]


def test_throughput(play: Play) -> None:
    """Two episodes, with cars that wander about."""
    said = play("throughput", "--episodes", "2", "--cars", "2", "--net", NET)
    shares = [numbers(line)[-1] for line in said.splitlines() if line.endswith("%")]
    assert len(shares) == 8
    assert sum(shares) == pytest.approx(100.0, abs=0.5)
    assert "contacts and assertions" in said


def test_traces(play: Play) -> None:
    """One episode of one network."""
    said = play("traces", "--episodes", "1", "--rounds", "1", NETWORKS=("pedestrians",))
    lines = said.splitlines()
    assert lines[0].startswith("pedestrians: 1 traces, ")
    shares = [numbers(line)[1] for line in lines if "level" in line]
    assert len(shares) == 5
    assert shares[0] < 50.0
    assert shares == sorted(shares, reverse=True)
