"""What an episode leaves: its row in the CSV, and the trace beside it as text.

Both are made where the episode was played, so that the process that collects them only writes.
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from cavsumo.assertions.base import HELD, VIOLATED

# The columns of results.csv with their meaning, in order; interface of everything downstream.
COLUMNS: Mapping[str, str] = {
    "run": "number of the episode in the batch, from 0; the key for replay",
    "agent": "tester agent",
    "ego": "vehicle under test",
    "testers": "number of tester bodies",
    "reset": "fresh: in a simulation of its own; shared: in one that other episodes used before",
    "embodiment": "how SUMO was shown the testers: vehicle or person",
    "sumo_width_m": "width that SUMO was shown of a tester pedestrian",
    "seed": "the episode's seed, derived from the batch's seed and the number of the episode",
    "outcome": "violated, held, not_triggered, unfair or error",
    "assertion": "the assertion first violated, else triggered",
    "tester": "the tester's body involved",
    "trigger_time_s": "when the precondition triggered",
    "violation_time_s": "when the assertion was violated",
    "time_s": "length of the episode",
    "steps": "length of the episode in timesteps",
    "min_gap_m": "smallest gap between the ego and a tester",
    "min_ttc_s": "smallest time to collision (not measured in this version)",
    "max_drac_mps2": "largest deceleration to avoid a crash (not measured in this version)",
    "pet_s": "post-encroachment time (not measured in this version)",
    "ego_speed_mps": "speed of the ego at the violation, else at the trigger",
    "impact_speed_mps": "closing speed along the ego's heading at contact",
    "max_decel_mps2": "hardest braking of the ego",
    "avoidable": "whether the ego could still have avoided it (not judged in this version)",
    "cost": "time that the testers spent on the carriageway, together [s]",
    "reward": "the testers' return, undiscounted",
    "contacts": "bodies that touched the ego, standing or moving",
    "tester_contacts": "pairs of a tester and a body other than the ego that touched",
    "sumo_collisions": "pairs with the ego that SUMO itself reported as colliding",
    "background_collisions": "pairs without the ego that SUMO itself reported",
    "emergency_stops": "emergency stops that SUMO reported",
    "teleports": "teleports that SUMO reported",
    "trace": "frames, relative to this file",
    "error": "what went wrong when outcome is error",
    "wall_s": "real time; the only column that is not reproducible",
}
Row = dict[str, Any]


@dataclass(frozen=True)
class Outcome:
    """One finished episode.

    Attributes:
        row: its row, by column.
        trace: the frames worth keeping as JSON lines, empty for none.
        ego_log: what an ego from outside printed, which may differ from run to run; mostly empty.
    """

    row: Row
    trace: str = ""
    ego_log: str = ""

    @property
    def frames(self) -> list[dict[str, Any]]:
        """The frames of the trace (parsed anew at each call)."""
        return [json.loads(line) for line in self.trace.splitlines()[1:]]


def cell(value: Any) -> str:
    """A value as it stands in the CSV: empty for nothing, floats to three decimals.

    Line breaks become spaces: a row is a line, so a torn one shows.
    """
    if value is None or value == "":
        return ""
    if isinstance(value, float):
        return "" if not math.isfinite(value) else f"{value:.3f}".replace("-0.000", "0.000")
    return " ".join(str(value).splitlines())


def row_line(row: Mapping[str, Any]) -> str:
    """A row as a line of the CSV, with its end."""
    line = io.StringIO()
    cells = [cell(row.get(column)) for column in COLUMNS]
    csv.writer(line, lineterminator="\n").writerow(cells)
    return line.getvalue()


def is_test(row: Mapping[str, Any]) -> bool:
    """Whether the precondition was triggered: a test in the seed's sense."""
    return row["outcome"] in (HELD, VIOLATED)


def is_failure(row: Mapping[str, Any]) -> bool:
    """Whether the ego violated an assertion in this episode."""
    return bool(row["outcome"] == VIOLATED)
