"""The benchmark of places, at its smallest size."""

from __future__ import annotations

from pathlib import Path

import pytest
from support import benchmark

pytestmark = pytest.mark.usefixtures("inline")


def test_the_table_has_a_line_for_each_place_ego_and_agent(
    networks: dict[str, Path], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    words = (
        "--runs 1 --learn 1 --traffic 0 -j 1 --ego time-gap --agent timing --agent best-response"
    )
    net = str(networks["pedestrians"])
    monkeypatch.setattr("sys.argv", ["places.py", net, *words.split()])
    benchmark("places").main()
    lines = capsys.readouterr().out.splitlines()[1:]
    assert [line.split()[:3] for line in lines] == [
        ["pedestrians", "time-gap", "timing"],
        ["pedestrians", "time-gap", "best-response"],
    ]
    assert all(len(line.split()) == 11 for line in lines)
