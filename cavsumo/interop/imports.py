"""Exported episodes read again: OpenSCENARIO and CommonRoad files of ``cavsumo export``.

The tracks are those of the file, to its rounding; settings and boxes are in its properties
(``head``). The result is a trace of format 1, which holds no actions. Files may come from
strangers: they are small, without document types, and every number is checked.
"""

from __future__ import annotations

import json
import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from cavsumo.errors import InputError, shown
from cavsumo.interop.commonroad import HEAD_COMMENT
from cavsumo.interop.head import HEAD
from cavsumo.interop.openscenario import RECORDED
from cavsumo.interop.storyboard_parts import SHAPE
from cavsumo.interop.tracks import axle
from cavsumo.model.documents import json_of
from cavsumo.model.kinematics import wrap
from cavsumo.results.traces import FORMATS, Shape, Trace, parsed

LARGEST_B = 1 << 26
PER_MOMENT = 3  # points of a trajectory for each moment: just before, at and after it
NO_PLAN = "it was not exported by cavsumo: its settings are missing"
Pose = tuple[float, float, float, float, float]  # time [s], x, y [m], speed [m/s], heading [rad]


class _Body(NamedTuple):
    """A body of a file."""

    part: str
    shape: Shape
    places: list[Pose]


def read_exported(file: Path) -> Trace:
    """The episode in a file of ``export``; raises InputError in one sentence."""
    text = _text(file)
    try:
        root = ET.fromstring(text)
        read = {"OpenSCENARIO": _openscenario, "commonRoad": _commonroad}.get(root.tag)
        if read is None:
            raise ValueError(f"<{root.tag}>, expected <OpenSCENARIO> or <commonRoad>")
        head, bodies = read(root, text)
        return _trace(head, bodies)
    except ET.ParseError as error:
        raise InputError(f"{str(file)!r}: line {error.position[0]}: no XML: {error}") from error
    except (KeyError, TypeError, IndexError) as error:
        raise InputError(f"{str(file)!r}: lacks {shown(str(error))}") from error
    except ValueError as error:
        raise InputError(f"{str(file)!r}: {error}") from error


def _text(file: Path) -> str:
    """The text of a file."""
    try:
        if file.stat().st_size > LARGEST_B:
            raise InputError(f"{str(file)!r}: is larger than {LARGEST_B} bytes")
        text = file.read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"{str(file)!r}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{str(file)!r}: is no text in UTF-8") from error
    if "<!DOCTYPE" in text:
        raise InputError(f"{str(file)!r}: declares a document type, which no export does")
    return text


def _head(text: str | None) -> dict[str, Any]:
    """The settings in a file."""
    if text is None:
        raise ValueError(NO_PLAN)
    head = json_of(text)
    if not isinstance(head, dict):
        raise ValueError(NO_PLAN)
    if head.get("way") != RECORDED:
        raise ValueError("it is a test, in which the ego has no track: import one as recorded")
    return head


# OpenSCENARIO


def _openscenario(root: ET.Element, _: str) -> tuple[dict[str, Any], dict[str, _Body]]:
    """The settings and bodies of an OpenSCENARIO file."""
    known = _properties(root.find("FileHeader"))
    head, bodies = _head(known.get(HEAD)), dict[str, _Body]()
    for thing in root.iter("ScenarioObject"):
        part, *box = json_of(_properties(thing)[SHAPE])
        bodies[str(thing.get("name"))] = _Body(part, Shape(*box), [])
    speeds = {name: iter(some) for name, some in head["speeds"].items()}
    for name, places in _trajectories(root):
        body = bodies[name]
        back = axle(body.shape)
        for time, x, y, heading in places:
            x, y = x + back * math.cos(heading), y + back * math.sin(heading)
            body.places.append((time, x, y, float(next(speeds[name])), heading))
    return head, bodies


def _properties(parent: ET.Element | None) -> dict[str, str]:
    """The properties of an element."""
    found = parent.iter("Property") if parent is not None else ()
    return {str(one.get("name")): str(one.get("value")) for one in found}


def _trajectories(root: ET.Element) -> Iterator[tuple[str, list[tuple[float, ...]]]]:
    """Bodies with the places of their reference points, stay after stay."""
    for group in root.iter("ManeuverGroup"):
        name = str(next(group.iter("EntityRef")).get("entityRef"))
        for trajectory in group.iter("Trajectory"):
            vertices = list(trajectory.iter("Vertex"))[::PER_MOMENT]
            yield name, [(_number(one, "time"), *_position(one)) for one in vertices]


def _position(parent: ET.Element) -> tuple[float, float, float]:
    """A position in the world."""
    there = next(parent.iter("WorldPosition"))
    return _number(there, "x"), _number(there, "y"), _number(there, "h")


def _number(element: ET.Element, name: str) -> float:
    """An attribute as a finite number."""
    return _finite(element.get(name), f"<{element.tag} {name}>")


def _finite(text: str | None, where: str) -> float:
    """A text as a finite number; raises ValueError that says where it stands."""
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"{where}: expected a number, got {shown(text)}")
    return value


# CommonRoad


def _commonroad(root: ET.Element, text: str) -> tuple[dict[str, Any], dict[str, _Body]]:
    """The settings and bodies of a CommonRoad file."""
    found = HEAD_COMMENT.search(text)
    head = _head(found[1] if found else None)
    bodies = {name: _Body(part, Shape(*box), []) for name, (part, *box) in head["bodies"].items()}
    dt = _number(root, "timeStepSize")
    for obstacle in root.findall("dynamicObstacle"):
        number = str(obstacle.get("id"))
        body, away = bodies[head["ids"][number]], int(head.get("enters", {}).get(number, 0))
        states = [*obstacle.findall("initialState"), *obstacle.findall("trajectory/state")]
        for state in states[away:]:
            x, y, heading, step, speed = (
                _finite(state.findtext(path), f"<{path}>")
                for path in ("position/point/x", "position/point/y", "orientation/exact",
                             "time/exact", "velocity/exact")
            )  # fmt: skip
            body.places.append((round(step * dt, 6), x, y, speed, heading))
    return head, bodies


# Both


def _trace(head: Mapping[str, Any], bodies: Mapping[str, _Body]) -> Trace:
    """The trace of bodies on their tracks."""
    own: dict[str, Any] = {
        key: head[key] for key in ("row", "plan", "sha256", "versions", "sumo_options")
    }
    own |= {"format": FORMATS[0], "memory": None, "memory_kept": False}
    own |= {"starts": head.get("starts", [])}
    own["bodies"] = [{"box": list(body.shape), "ids": [name]} for name, body in bodies.items()]
    frames = list(_frames(head, bodies))
    lines = [json.dumps(line, allow_nan=False) for line in (own, *frames)]
    return parsed("\n".join([*lines, ""]))


def _frames(head: Mapping[str, Any], bodies: Mapping[str, _Body]) -> Iterator[dict[str, Any]]:
    """The frames: all bodies at each time of the ego."""
    dt = float(head["plan"]["scenario"]["step_length"])
    by_step: dict[int, dict[str, Sequence[float]]] = {}
    for name, body in bodies.items():
        for time, x, y, speed, heading in body.places:
            pose = [x, y, speed, wrap(heading)]
            by_step.setdefault(round(time / dt), {})[name] = pose
    steering, lights = head["frames"]["steering"], head["frames"].get("lights")
    for step in sorted(by_step):
        there = by_step[step]
        frame: dict[str, Any] = {"step": step, "time_s": round(step * dt, 6)}
        frame |= {"ego": there["ego"], "steering": steering[step]}
        for part, key in (("tester", "testers"), ("background", "background")):
            frame[key] = {name: there[name] for name in there if bodies[name].part == part}
        yield {**frame, "lights": lights[step]} if lights else frame
