"""Scripts of benchmarks/ that look for what goes wrong, at their smallest size."""

from __future__ import annotations

import pytest
from scripts_played import Play, numbers
from support import ROOT

pytestmark = pytest.mark.usefixtures("inline")
NET = str(ROOT / "networks" / "pedestrians.net.xml")


def test_chaos(play: Play) -> None:
    """One episode, and no time for a kill: the batches are equal."""
    said = play("chaos", "--runs", "1", "--kills-every", "60", NET=NET)
    assert said.count("equal: True") == 2


def test_collisions(play: Play) -> None:
    """An episode of one setup."""
    said = play(
        "collisions", "--episodes", "1", "--examples",
        NETWORKS=("pedestrians",), AGENTS=("timing",), EGOS=("constant",), SHOWN=("wide-vehicle",),
    )  # fmt: skip
    assert said.startswith("1 episodes; 0 more in which SUMO died")


def test_overlaps(play: Play) -> None:
    """An episode on the straight road, with drawn traffic."""
    said = play("overlaps", "--net", NET, "--agent", "timing", "--runs", "1")
    assert said.splitlines()[1].split()[:3] == ["pedestrians", "timing", "1"]


def test_replays(play: Play, capsys: pytest.CaptureFixture[str]) -> None:
    """Both episodes of one batch."""
    batches = {"straight": {"net": "pedestrians", "agents": ["timing", "noop"], "end": 5.0}}
    with pytest.raises(SystemExit) as ended:
        play("replays", "--replays", "2", "--runs", "1", BATCHES=batches)
    assert not ended.value.code
    assert numbers(capsys.readouterr().out.splitlines()[-2]) == [1, 1, 0]


def test_soak(play: Play, capsys: pytest.CaptureFixture[str]) -> None:
    """Three episodes, and no time for a kill."""
    with pytest.raises(SystemExit) as ended:
        play("soak", "--episodes", "3", "--quiet", "2", "--kills-every", "1000", "-j", "1")
    said = capsys.readouterr().out
    assert ended.value.code == 0, said
    assert "0 errors, 0 after --retry-errors; 0 rows missing, in order: True" in said
