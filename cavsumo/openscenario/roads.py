"""OpenDRIVE, as far as positions need it: reference lines, lanes, and how roads go on.

Reference lines of straight lines, arcs and spirals are ways of ``model.curve``; lanes have the
widths that the file gives. Elevation and everything beside the road have no effect.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from cavsumo.errors import InputError, UnknownName
from cavsumo.model.curve import Bend, PlaneCurve, Pose
from cavsumo.model.geometry import wrap
from cavsumo.openscenario.nodes import XmlNode
from cavsumo.openscenario.tree import XmlElement, read_xml

SHAPES = ("line", "arc", "spiral")


class LinePiece(NamedTuple):
    """A piece of a reference line."""

    begins: float  # [m]
    curve: PlaneCurve
    leg: Bend


class RoadStage(NamedTuple):
    """A road on a way, and whether it is gone along its reference line."""

    road: OpenDriveRoad
    forward: bool


@dataclass(frozen=True)
class OpenDriveRoad:
    """A road.

    Attributes:
        node: its element.
        left_hand: whether traffic keeps left.
    """

    node: XmlNode

    @property
    def id(self) -> str:
        """Its id."""
        return self.node.word("id")

    @property
    def left_hand(self) -> bool:
        """Whether traffic keeps left."""
        return self.node.word("rule", "RHT") == "LHT"

    @cached_property
    def length(self) -> float:
        """Its length [m]."""
        return self.node.number("length")

    @cached_property
    def pieces(self) -> list[LinePiece]:
        """Its reference line; raises InputError for a shape that is not understood."""
        found = []
        for one in self.node.one("planView").all("geometry"):
            shape = one.maybe(*SHAPES)
            if shape is None:
                inside = next(one.all(), one)
                raise inside.refused(f"is not understood; understood: {', '.join(SHAPES)}")
            k0 = shape.number("curvature", 0.0) if shape.tag == "arc" else 0.0
            k1 = k0
            if shape.tag == "spiral":
                k0, k1 = shape.number("curvStart"), shape.number("curvEnd")
            leg = Bend(one.number("length"), k0, k1)
            pose = one.number("x"), one.number("y"), one.number("hdg")
            found.append(LinePiece(one.number("s"), PlaneCurve(pose, [leg]), leg))
        if not found:
            raise self.node.refused("has no reference line")
        return found

    def at(self, s: float, t: float = 0.0) -> Pose:
        """The pose at a place of the reference line, t to its left; it goes on at both ends."""
        one = next((p for p in reversed(self.pieces) if p.begins <= s), self.pieces[0])
        x, y, o = one.curve.at(s - one.begins)
        return x - t * math.sin(o), y + t * math.cos(o), o

    def lane(self, node: XmlNode, lane: int, s: float) -> tuple[float, float]:
        """Where the middle of a lane is beside the reference line at s, and its width [m]."""
        sections = list(self.node.one("lanes").all("laneSection"))
        section = next((x for x in reversed(sections) if x.number("s") <= s), sections[0])
        beyond = s - section.number("s")
        side = section.maybe("left" if lane > 0 else "right")
        lanes = {int(one.number("id")): one for one in side.all("lane")} if side else {}
        if lane not in lanes:
            place = f"{node.xml.file!r}: line {node.xml.line}: road {self.id}"
            raise UnknownName("lane", str(lane), map(str, sorted(lanes)), place)
        offset = _cubic(self.node.one("lanes").all("laneOffset"), "s", s)
        inner = sum(_width(lanes[k], beyond) for k in lanes if abs(k) < abs(lane))
        width = _width(lanes[lane], beyond)
        return offset + math.copysign(inner + width / 2, lane), width

    def drives_forward(self, lane: int) -> bool:
        """Whether traffic on a lane goes along the reference line."""
        return (lane < 0) != self.left_hand


def _cubic(parts: Iterator[XmlNode], key: str, s: float) -> float:
    """The value of the last cubic polynomial that has begun at s."""
    found = [one for one in parts if one.number(key) <= s + 1e-9]
    if not found:
        return 0.0
    one = found[-1]
    u = s - one.number(key)
    a, b, c, d = (one.number(k, 0.0) for k in "abcd")
    return a + u * (b + u * (c + u * d))


def _width(lane: XmlNode, s: float) -> float:
    """The width of a lane at a distance into its section [m]."""
    return _cubic(lane.all("width"), "sOffset", s)


class RoadMap:
    """The roads of a file, and how they go on."""

    def __init__(self, file: Path) -> None:
        self.file = file
        root = read_xml(file, "road network")
        if root.tag != "OpenDRIVE":
            raise InputError(
                f"{str(file)!r}: expected OpenDRIVE, which begins with <OpenDRIVE>; this file "
                f"begins with <{root.tag[:40]}>"
            )
        self.roads: Mapping[str, OpenDriveRoad] = {
            road.id: road for road in map(_road, root.inner) if road is not None
        }

    def road(self, node: XmlNode, name: str) -> OpenDriveRoad:
        """The road of that id; raises UnknownName with the nearest one."""
        if name not in self.roads:
            place = f"{node.xml.file!r}: line {node.xml.line}: {self.file.name}"
            raise UnknownName("road", name, self.roads, place)
        return self.roads[name]

    def route(self, node: XmlNode, begin: RoadStage, end: OpenDriveRoad) -> list[RoadStage]:
        """The roads from one in a direction to another, the fewest; breadth first."""
        ways = [[begin]]
        seen = {(begin.road.id, begin.forward)}
        while ways:
            way = ways.pop(0)
            if way[-1].road.id == end.id:
                return way
            for stage in self._next(way[-1]):
                if (stage.road.id, stage.forward) not in seen:
                    seen.add((stage.road.id, stage.forward))
                    ways.append([*way, stage])
        raise node.refused(f"no way leads from road {begin.road.id} to road {end.id}")

    def _next(self, stage: RoadStage) -> Iterator[RoadStage]:
        """The stages that may follow one."""
        road, forward = stage
        link = road.node.maybe("link")
        onward = link.maybe("successor" if forward else "predecessor") if link else None
        if onward is None:
            return
        if onward.word("elementType") == "road":
            other = self.roads.get(onward.word("elementId"))
            if other is not None:
                yield RoadStage(other, onward.word("contactPoint", "start") == "start")
            return
        for other in self.roads.values():
            if other.node.word("junction", "-1") == onward.word("elementId"):
                yield from _through(road, forward, other)


def _through(road: OpenDriveRoad, forward: bool, inner: OpenDriveRoad) -> Iterator[RoadStage]:
    """A road inside a junction, if it begins or ends where a road enters the junction."""
    link = inner.node.maybe("link")
    contact = "end" if forward else "start"
    for key, along in (("predecessor", True), ("successor", False)):
        there = link.maybe(key) if link else None
        if there is not None and there.word("elementType") == "road":
            same = there.word("elementId") == road.id
            if same and there.word("contactPoint", "start") == contact:
                yield RoadStage(inner, along)


def _road(element: XmlElement) -> OpenDriveRoad | None:
    """The road of an element; None for another element."""
    return OpenDriveRoad(XmlNode(element)) if element.tag == "road" else None


def turned(pose: Pose, by: float) -> Pose:
    """A pose with another heading."""
    return pose[0], pose[1], wrap(pose[2] + by)
