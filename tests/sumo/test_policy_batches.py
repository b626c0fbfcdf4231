"""Trained policies in batches, beside registered agents."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import rows

from cavsumo.agents.observations import VERSION, entries
from cavsumo.agents.policy_file import Header, Observed, TrainedPolicy, write_policy
from cavsumo.cli import main
from cavsumo.results.reading import read_manifest

NAMES = tuple(name for name, _, _ in entries(1, 1.4, 1.0))


def constant(*outputs: float, **changed: Any) -> TrainedPolicy:
    """A policy that says the same whatever it sees."""
    n = len(NAMES)
    layer = np.zeros((n, len(outputs))), np.array(outputs)
    header = Header(observation=Observed(version=VERSION, names=NAMES), **changed)
    return TrainedPolicy(header, np.zeros(n), np.ones(n), (layer,))


@pytest.fixture
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A policy that walks across at once, in a folder of its own."""
    file = tmp_path_factory.mktemp("policies") / "across.npz"
    write_policy(file, constant(0.0, 1.0, 0.0, 0.0, 0.0, actions="targets"))
    return file


def test_policies_play_beside_registered_agents(
    networks: dict[str, Path], kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two policies and timing, relative paths: the rows do not depend on the number of processes.

    The file's checksum is in the manifest; a replay is the same; a resume and a replay notice a
    file that has changed.
    """
    monkeypatch.chdir(tmp_path)
    Path("across.npz").write_bytes(kept.read_bytes())
    write_policy(Path("idle.npz"), constant(1.0, 0.0, 0.0, 0.0, 0.0, actions="targets"))
    settings = tmp_path / "scenarios"
    settings.mkdir()
    (settings / "both.toml").write_text(
        f'net = "{networks["pedestrians"]}"\nroutes = "none"\nruns = 2\nend = 12.0\n'
        'agents = ["policy:../across.npz", "timing", "policy:../idle.npz"]\n'
    )
    names = ("policy:scenarios/../across.npz", "timing", "policy:scenarios/../idle.npz")
    words = ["-c", "scenarios/both.toml", "-q", "--exit-zero", "--trace", "all"]
    assert main(["run", *words, "-o", "one.csv"]) == 0
    assert main(["run", *words, "-o", "two.csv", "-j", "2"]) == 0
    one, two = rows(Path("one.csv")), rows(Path("two.csv"))
    assert [{**r, "trace": ""} for r in one] == [{**r, "trace": ""} for r in two]
    assert [row["agent"] for row in one] == list(names) * 2
    cost = {name: sum(float(r["cost"]) for r in one if r["agent"] == name) for name in names}
    assert cost[names[0]] > 0.0 == cost[names[2]], "who walks across is on the road, who stands not"
    sums = read_manifest(Path("one.csv"))["sha256"]
    assert "scenarios/../across.npz" in sums
    assert main(["replay", "one.csv", "0"]) == 0
    write_policy(Path("across.npz"), constant(1.0, 0.0, 0.0, 0.0, 0.0, actions="targets"))
    assert main(["run", "--resume", "-o", "one.csv", "--runs", "3", "-q"]) == 2
    assert main(["replay", "one.csv", "0"]) == 0
