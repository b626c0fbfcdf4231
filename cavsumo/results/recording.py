"""The part of a trace from which an episode is played back: starts, actions and departures.

Traces come from strangers: what is read is checked in shape and in every number, and vehicle types
may hold nothing but plain attributes.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from cavsumo.agents.recorded import Recorded, check_start
from cavsumo.errors import ResultsError
from cavsumo.model.bodies import Action
from cavsumo.model.carriageway import StartRecord
from cavsumo.model.departures import Attributes, Demand
from cavsumo.sumo.recorded_demand import PICTURES

ATTRIBUTE = re.compile(r"[A-Za-z]\w*")  # names of a vehicle type's attributes


class _Parts(BaseModel):
    """Content of a head and frames, as JSON."""

    model_config = ConfigDict(strict=True, allow_inf_nan=False, extra="forbid", frozen=True)

    starts: tuple[StartRecord, ...]
    waited: tuple[StartRecord, ...]
    departures: Demand | None
    approaches: tuple[str, ...]
    actions: tuple[tuple[Action, ...], ...]


def recording_head(played: Recorded) -> dict[str, Any]:
    """Entries of a trace's head; the actions are in the frames."""
    there = played.departures
    return {
        "approaches": played.approaches,
        "starts": played.starts,
        "waited": played.waited,
        "departures": there and _departures(there),
    }


def _departures(demand: Demand) -> dict[str, Any]:
    """Departures as plain data; the ego's entry only where it is another one than its route's."""
    there = {"types": demand.types, "trips": demand.trips, "walks": demand.walks}
    return there if demand.ego is None else {**there, "ego": demand.ego}


def recording(head: Mapping[str, Any], frames: Sequence[Mapping[str, Any]]) -> Recorded:
    """The record that a trace holds; raises ResultsError where it holds none."""
    parts = {key: value for key, value in head.items() if key in _Parts.model_fields}
    parts["actions"] = [frame.get("actions") for frame in frames]
    try:
        seed = int(head["row"]["seed"])
        found = _Parts.model_validate_json(json.dumps(parts))
    except ValidationError as error:
        problem = error.errors()[0]
        place = ".".join(map(str, problem["loc"]))
        raise ResultsError(f"{place}: {problem['msg']}") from error
    except (KeyError, TypeError, ValueError) as error:
        raise ResultsError("its head holds no row with a seed, or a number is too large") from error
    _check(found)
    actions = found.actions if found.actions[-1] else found.actions[:-1]
    starts = found.starts, found.waited
    return Recorded(seed, actions, *starts, found.departures, found.approaches)


def _check(found: _Parts) -> None:
    """Raise ResultsError unless the parts fit each other and name nothing but plain values."""
    testers = len(found.starts)
    if not found.actions:
        raise ResultsError("it has no frames")
    if not testers or len(found.waited) not in (0, testers):
        raise ResultsError(f"{testers} starts and {len(found.waited)} places to wait at")
    for start in (*found.starts, *found.waited):
        try:
            check_start(start)
        except ValueError as error:
            raise ResultsError(str(error)) from error
    for step, joint in enumerate(found.actions):
        if len(joint) != testers and (joint or step < len(found.actions) - 1):
            raise ResultsError(f"step {step}: {len(joint)} actions of {testers} testers")
    demand = found.departures or Demand()
    for one in demand.trips:
        if not one.edges:
            raise ResultsError(f"departure of {one.id!r}: without edges")
    for walk in demand.walks:
        if not all(stage.edges for stage in walk.stages):
            raise ResultsError(f"departure of {walk.id!r}: a walk without edges")
    if demand.ego is not None and min(demand.ego) < 0:
        raise ResultsError(f"the ego enters at {tuple(demand.ego)}, expected no negative numbers")
    for name, attributes in demand.types.items():
        _check_type(name, attributes)


def _check_type(name: str, attributes: Attributes) -> None:
    """Raise ResultsError when a vehicle type names more than the properties of a vehicle."""
    for key in attributes:
        if not ATTRIBUTE.fullmatch(key) or key in {"id", *PICTURES}:
            raise ResultsError(f"vehicle type {name!r}: unknown attribute {key!r}")
