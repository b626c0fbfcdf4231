"""The shape of manifests, rows and traces, checked once where they are read.

Later readers find the keys and types that they expect; keys that are not named here are left as
they are.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from cavsumo.errors import shown
from cavsumo.model.documents import first_problem

OUTCOMES = ("violated", "held", "unfair", "not_triggered", "invalid", "error")
# Columns that are computed with: whole numbers, and other numbers, which may be empty.
WHOLE = ("run", "seed")
NUMBERS = ("trigger_time_s", "violation_time_s", "time_s", "impact_speed_mps", "wall_s")
# Of which outcomes a number may not be empty.
NEEDED: Mapping[str, tuple[str, ...]] = {
    "trigger_time_s": ("held", "violated"),
    "violation_time_s": ("violated",),
    "time_s": tuple(outcome for outcome in OUTCOMES if outcome != "error"),
}
WHOLE_NUMBER = re.compile(r"[0-9]{1,19}")
NUMBER = re.compile(r"-?[0-9]{1,15}(\.[0-9]{1,9})?")

MOST = 1e9  # metres, seconds, radians and so on: beyond it a trace is damaged
Finite = Annotated[float, Field(allow_inf_nan=False, ge=-MOST, le=MOST)]
# x, y [m], v [m/s], o [rad]
Pose = Annotated[list[Finite], Field(min_length=4, max_length=4)]
# throttle [m/s2], steering [rad]
Chosen = Annotated[list[Finite], Field(min_length=2, max_length=2)]


class _Open(BaseModel):
    """A record that may hold more."""

    model_config = ConfigDict(extra="ignore", strict=True)


class ManifestShape(_Open):
    """Content of a manifest; all but its format and status may be missing."""

    format: str
    status: str
    command: list[str] = []
    plan: dict[str, Any] = {}
    ego_route: list[str] = []
    junction: str | None = None
    sha256: dict[str, str] = {}
    versions: dict[str, str] = {}
    sumo_options: dict[str, str] = {}
    ego_outputs: list[str] = []
    episodes: int = 0
    counts: dict[str, int] = {}
    stopped_by: str | None = None
    learned: dict[str, list[Any]] = {}
    learned_after: dict[str, int] = {}
    certifies: dict[str, Any] = {}


class BodiesShape(_Open):
    """Bodies of one shape: kind, length, width and wheelbase [m]."""

    box: Annotated[list[Any], Field(min_length=4, max_length=4)]
    ids: list[str]


class HeadShape(_Open):
    """Content of the head of a trace; ``recording`` checks the rest of it."""

    format: str
    row: dict[str, str]
    plan: dict[str, Any]
    sha256: dict[str, str]
    versions: dict[str, str]
    sumo_options: dict[str, str]
    memory: list[Any] | None
    memory_kept: bool
    bodies: list[BodiesShape]


class FrameShape(_Open):
    """Content of a frame of a trace."""

    step: int
    time_s: Finite
    ego: Pose
    steering: Finite
    testers: dict[str, Pose]
    background: dict[str, Pose]
    lights: str = ""


class ActedFrameShape(FrameShape):
    """A frame with the testers' actions, as traces have it since format 2."""

    actions: list[Chosen]


_BOX: TypeAdapter[Any] = TypeAdapter(tuple[str, Finite, Finite, Finite])


def check_manifest(data: Any) -> None:
    """Raise ValueError, in plain words, unless this is the shape of a manifest."""
    _check(ManifestShape.model_validate, data)


def check_head(data: Any) -> None:
    """Raise ValueError, in plain words, unless this is the shape of a trace's head."""
    _check(HeadShape.model_validate, data)
    for bodies in data["bodies"]:
        _check(_BOX.validate_python, bodies["box"])


def check_frame(data: Any, *, acted: bool) -> None:
    """Raise ValueError, in plain words, unless this is the shape of a frame.

    ``acted``: with the testers' actions.
    """
    _check((ActedFrameShape if acted else FrameShape).model_validate, data)


def _check(validate: Any, data: Any) -> None:
    try:
        validate(data)
    except ValidationError as error:
        raise ValueError(first_problem(error)) from error


def check_row(row: Mapping[str, str | None]) -> None:
    """Raise ValueError, in plain words, unless the cells that are computed with can be.

    A test has the time of its trigger, a violation its own as well.
    """
    outcome = row.get("outcome")
    for column in WHOLE:
        if not WHOLE_NUMBER.fullmatch(row.get(column) or ""):
            raise _wrong(row, column, "a whole number")
    if outcome not in OUTCOMES:
        raise _wrong(row, "outcome", "one of " + ", ".join(OUTCOMES))
    for column in NUMBERS:
        cell = row.get(column) or ""
        if (cell or outcome in NEEDED.get(column, ())) and not NUMBER.fullmatch(cell):
            raise _wrong(row, column, "a number")


def _wrong(row: Mapping[str, str | None], column: str, expected: str) -> ValueError:
    return ValueError(f"{column} is {shown(row.get(column) or '')}, expected {expected}")
