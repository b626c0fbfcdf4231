"""The learned opponent model in batches: counted, written down, played frozen."""

from __future__ import annotations

import csv
import json
from pathlib import Path

from inline import cavsumo
from support import STRAIGHT_NET

from cavsumo.agents.planning.opponent import Counts


def test_it_learns_and_what_it_learned_is_played_frozen(tmp_path: Path) -> None:
    """Two episodes teach it how SUMO's driver decides; the manifest is the model of other batches.

    The ego decides in every timestep here, so that there is but one age and the plan is small.
    """
    base = ("--net", STRAIGHT_NET, "--agent", "best-response", "--testers", "2")
    base += (
        "--ego-param",
        "actionStepLength=0",
        "--trace",
        "none",
        "-q",
        "--exit-zero",
        "--step-length",
        "0.2",
    )
    first, second = tmp_path / "first.csv", tmp_path / "second.csv"
    taught = cavsumo(tmp_path, "run", *base, "--runs", "2", "--seed", "101", "-o", str(first))
    assert taught.returncode == 0, taught.stderr
    model = json.loads(first.with_suffix(".json").read_text())["learned"]["best-response"][0]
    assert model["episodes"] == 2
    counts = Counts.of(model["counts"])
    assert sum(map(sum, counts.taken.values())) > 50
    frozen = ("--param", "learn=false", "--param", f"model={first.with_suffix('.json')}")
    played = cavsumo(tmp_path, "run", *base, *frozen, "--runs", "2", "-o", str(second))
    assert played.returncode == 0, played.stderr
    with second.open(encoding="utf-8") as rows:
        assert all(row["outcome"] != "error" for row in csv.DictReader(rows))
    manifest = json.loads(second.with_suffix(".json").read_text())
    assert str(first.with_suffix(".json")) in manifest["sha256"]
    assert "best-response" not in manifest.get("learned", {})
