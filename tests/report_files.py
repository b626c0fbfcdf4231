"""Results on disk whose outcomes are written down, for tests of what a report makes of them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from cavsumo.model.seeds import episode_seed
from cavsumo.results.reading import FORMAT, HEADER
from cavsumo.results.rows import row_line

Row = dict[str, Any]
HELD, FAILED, UNFAIR, NOTHING, ERROR = "held", "violated", "unfair", "not_triggered", "error"


def plan(**settings: Any) -> dict[str, Any]:
    """A plan as a manifest has it."""
    own = {"agents": ["random", "timing"], "runs": 4, "seed": 1, "reference": "none"}
    own |= {k: v for k, v in settings.items() if k in (*own, "first", "until_tests", "params")}
    scenario = {k: v for k, v in settings.items() if k not in own}
    return {"scenario": {"net": "gone/place.net.xml", **scenario}, **own}


def write(
    file: Path,
    outcomes: Sequence[Sequence[str | Mapping[str, Any]]],
    status: str = "finished",
    **settings: Any,
) -> Path:
    """A batch whose episodes came out like this: for each seed one outcome an agent."""
    own = plan(**{"runs": len(outcomes), **settings})
    lines = [HEADER]
    for episode, row in enumerate(outcomes):
        for which, outcome in enumerate(row):
            run = episode * len(own["agents"]) + which
            lines.append(row_line(made(run, own, outcome, episode_seed(own["seed"], episode))))
    file.write_text("".join(lines), encoding="utf-8")
    manifest = {"format": FORMAT, "status": status, "plan": own, "stopped_by": None}
    manifest |= {"versions": {}, "sha256": {}, "sumo_options": {}}
    file.with_suffix(".json").write_text(json.dumps(manifest), encoding="utf-8")
    return file


def judged(avoidable: int, blame: str = "") -> Mapping[str, Any]:
    """The cells of a failure that a reference driver was asked about."""
    return {"outcome": FAILED, "avoidable": avoidable, "reference": "human", "blame": blame}


def made(run: int, own: Mapping[str, Any], came: str | Mapping[str, Any], seed: int) -> Row:
    """A row, by its outcome or with further cells."""
    cells = {"outcome": came} if isinstance(came, str) else came
    outcome = cells["outcome"]
    agent = own["agents"][run % len(own["agents"])]
    row = {"run": run, "agent": agent, "seed": seed, "wall_s": 0.5, **cells}
    row |= {"ego": own["scenario"].get("ego", "sumo"), "testers": 3, "reset": "fresh"}
    if outcome == ERROR:
        return row | {"error": "SUMO crashed (SIGSEGV)"}
    row |= {"time_s": 20.0 + run, "steps": 200}
    if outcome in (HELD, FAILED):
        row |= {"assertion": "reaction-zone", "tester": "tester0", "trigger_time_s": 4.0 + run}
    if outcome == FAILED:
        row |= {"violation_time_s": 5.0 + run, "impact_speed_mps": 3.0}
    return row


SOME = [(HELD, HELD), (NOTHING, FAILED), (UNFAIR, FAILED), (ERROR, HELD)]
JUDGED = [
    [{"outcome": "invalid", "breach": "tester0 left the world at 3.0 s"}, judged(1)],
    [judged(1, "ego:speed"), judged(0, "tester:stepped-out")],
    [judged(1, "ego:speed"), FAILED],
]
