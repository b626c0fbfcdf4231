"""Trajectories: straight lines and clothoids as ways, polylines with times as tracks."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from cavsumo.model.curve import Bend, PlaneCurve, Pose
from cavsumo.model.geometry import wrap
from cavsumo.openscenario.nodes import XmlNode

STRAIGHT_M = 1e-3  # vertices so far beside a straight line are on it


@dataclass(frozen=True)
class Trajectory:
    """The way of a reference point.

    Attributes:
        node: the trajectory.
        begin, legs: a way; ``curve`` is made of them.
        times: of a polyline with times: when the reference point has which pose; else empty.
        relative: it begins where its entity is, and ``begin`` is no place.
    """

    node: XmlNode
    begin: Pose
    legs: tuple[Bend, ...] = ()
    times: tuple[tuple[float, Pose], ...] = ()
    relative: bool = False

    @property
    def curve(self) -> PlaneCurve:
        """The way as a curve."""
        return PlaneCurve(self.begin, self.legs)

    @property
    def straight(self) -> bool:
        """Whether it is a straight line."""
        return not any(leg.first or leg.last for leg in self.legs)

    def along(self, x: float, y: float) -> float:
        """The arc length of the nearest place [m], also before the beginning and after the end."""
        curve = self.curve
        x0, y0, o = curve.at(0.0)
        if self.straight:
            return (x - x0) * math.cos(o) + (y - y0) * math.sin(o)
        last = curve.at(curve.length)
        beyond = (x - last[0]) * math.cos(last[2]) + (y - last[1]) * math.sin(last[2])
        found = curve.polyline(0.0, curve.length).project(x, y).along
        before = (x - x0) * math.cos(o) + (y - y0) * math.sin(o)
        if found <= 0.0:
            return min(0.0, before)
        return curve.length + max(0.0, beyond) if found >= curve.length - 1e-6 else found


def course_of(trajectory: XmlNode, pose: Callable[[XmlNode], Pose]) -> Trajectory:
    """The course of a trajectory; ``pose``: of a position."""
    shape = trajectory.one("Shape").one("Polyline", "ClothoidSpline", "Clothoid")
    if trajectory.truth("closed", False):
        raise trajectory.refused("closed: expected false, closed trajectories are not understood")
    if shape.tag == "Polyline":
        return _polyline(trajectory, list(shape.all("Vertex")), pose)
    if shape.tag == "Clothoid":
        k0, length = shape.number("curvature"), shape.number("length")
        dot = "curvaturePrime" if shape.has("curvaturePrime") else "curvatureDot"
        leg = Bend(length, k0, k0 + length * shape.number(dot, 0.0))
        return Trajectory(trajectory, pose(shape.one("Position")), (leg,))
    return _spline(trajectory, shape, pose)


def _spline(trajectory: XmlNode, shape: XmlNode, pose: Callable[[XmlNode], Pose]) -> Trajectory:
    """The course of clothoids one after another."""
    segments, legs = list(shape.all("ClothoidSplineSegment")), []
    if shape.has("timeEnd"):
        raise shape.refused("timeEnd is not understood: a clothoid has no times here")
    for k, one in enumerate(segments):
        if k and one.maybe("PositionStart"):
            raise one.refused("PositionStart is understood in the first segment only")
        if one.number("hOffset", 0.0) or one.has("timeStart"):
            raise one.refused("hOffset and timeStart are not understood")
        ends = one.number("curvatureStart"), one.number("curvatureEnd")
        legs.append(Bend(one.number("length"), *ends))
    if not segments:
        raise shape.refused("expected a ClothoidSplineSegment")
    start = segments[0].maybe("PositionStart")
    if start is None:
        return Trajectory(trajectory, (0.0, 0.0, 0.0), tuple(legs), relative=True)
    return Trajectory(trajectory, pose(start), tuple(legs))


def _polyline(
    trajectory: XmlNode, vertices: Sequence[XmlNode], pose: Callable[[XmlNode], Pose]
) -> Trajectory:
    """The course of a polyline: straight, or with times."""
    if len(vertices) < 2:
        raise trajectory.refused("a polyline needs two vertices")
    poses = [pose(vertex.one("Position")) for vertex in vertices]
    timed = [vertex.has("time") for vertex in vertices]
    if all(timed):
        times = [vertex.number("time") for vertex in vertices]
        for vertex, (before, after) in zip(vertices[1:], pairwise(times), strict=True):
            if after <= before:
                raise vertex.refused(f"time: expected more than {before:g}, got {after:g}")
        return Trajectory(trajectory, poses[0], (), tuple(zip(times, poses, strict=True)))
    if any(timed):
        raise trajectory.refused("time: expected at all vertices or at none")
    (x, y, _), (x1, y1, _) = poses[0], poses[-1]
    o, length = math.atan2(y1 - y, x1 - x), math.dist((x, y), (x1, y1))
    for vertex, (px, py, _) in zip(vertices, poses, strict=True):
        if abs((py - y) * math.cos(o) - (px - x) * math.sin(o)) > STRAIGHT_M:
            raise vertex.refused(
                "a polyline with a bend needs times at its vertices; without them it is "
                "understood as a straight line only"
            )
    if length == 0.0:
        raise trajectory.refused("its first and last vertices are the same place")
    return Trajectory(trajectory, (x, y, wrap(o)), (Bend(length, 0.0, 0.0),))


def places_at(course: Trajectory, every_s: float, ahead: float) -> list[tuple[float, float]]:
    """The places of a body's middle at even times from the first time of a track on [m].

    ``ahead``: of the middle, before the reference point.
    """
    times = course.times
    first, last = times[0][0], times[-1][0]
    count = math.ceil((last - first) / every_s - 1e-9) + 1
    found, k = [], 0
    for i in range(max(2, count)):
        time = min(last, first + i * every_s)
        while k < len(times) - 2 and times[k + 1][0] < time:
            k += 1
        (t0, (x0, y0, o0)), (t1, (x1, y1, o1)) = times[k], times[k + 1]
        share = (time - t0) / (t1 - t0)
        o = o0 + share * wrap(o1 - o0)
        x, y = x0 + share * (x1 - x0), y0 + share * (y1 - y0)
        found.append((x + ahead * math.cos(o), y + ahead * math.sin(o)))
    return found
