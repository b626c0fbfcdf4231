"""Reference lines of OpenDRIVE's roads: lengths that are those of the curves, and joined junctions.

netconvert tells of a curve the length of its lane in SUMO, and its roads through junctions can miss
the lanes that they join. Here a curve has its arc length, and the line of a connecting road is the
cubic (paramPoly3, p in [0, 1]) that begins and ends on the borders of the lanes that it joins,

    q(p) = q0 + p t0 + p^2 (3 (q1 - q0) - 2 t0 - t1) + p^3 (t0 + t1 - 2 (q1 - q0)),

with its tangents t0, t1 along them, as long as the road (Hermite's cubic). Lengths are in m, angles
in rad. ASAM OpenDRIVE 1.7, 7.6 (paramPoly3) and 11.6 (width).
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from bisect import bisect_right
from collections.abc import Mapping
from typing import NamedTuple

NOT_DRIVABLE = {"sidewalk", "none", "curb", "shoulder", "walking"}  # types of lanes
PLACED = ("signals/signal", "objects/object", "elevationProfile/elevation", "lanes/laneSection")


class End(NamedTuple):
    """An end of a reference line."""

    x: float  # m
    y: float  # m
    heading: float  # rad


def number(element: ET.Element, name: str) -> float:
    """An attribute as a number; 0 where it is not given."""
    return float(element.get(name) or 0.0)


def text(value: float) -> str:
    """A number as an attribute."""
    return f"{value + 0.0:.8f}"


def ends(road: ET.Element) -> tuple[End, End]:
    """Where a reference line begins and ends."""
    lines = road.findall("planView/geometry")
    return _at(lines[0], 0.0), _at(lines[-1], 1.0)


def _at(line: ET.Element, share: float) -> End:
    """A point of a line or a cubic, at a share of its parameter."""
    x, y, heading = (number(line, name) for name in ("x", "y", "hdg"))
    curve = line.find("paramPoly3")
    if curve is None:
        u, v, turned = share * number(line, "length"), 0.0, 0.0
    else:
        u, du = _cubic(curve, "U", share)
        v, dv = _cubic(curve, "V", share)
        turned = math.atan2(dv, du)
    c, s = math.cos(heading), math.sin(heading)
    return End(x + c * u - s * v, y + s * u + c * v, heading + turned)


def _cubic(curve: ET.Element, axis: str, p: float) -> tuple[float, float]:
    """A coordinate of a cubic and its derivative."""
    a, b, c, d = (number(curve, letter + axis) for letter in "abcd")
    return a + p * (b + p * (c + p * d)), b + p * (2.0 * c + 3.0 * p * d)


def set_lengths(road: ET.Element) -> None:
    """Give all curves of a road their arc length; the rest of the road keeps its places on it."""
    from scipy.integrate import quad

    old, new = [0.0], [0.0]
    for line in road.findall("planView/geometry"):
        length, curve = number(line, "length"), line.find("paramPoly3")
        old.append(old[-1] + length)
        if curve is not None:
            length, _ = quad(lambda p, at=curve: _speed(at, p), 0.0, 1.0, limit=200)
        line.set("s", text(new[-1]))
        line.set("length", text(length))
        new.append(new[-1] + length)
    for path in PLACED:
        for one in road.findall(path):
            one.set("s", text(_moved(number(one, "s"), old, new)))
    road.set("length", text(new[-1]))


def _speed(curve: ET.Element, p: float) -> float:
    """The length of a cubic's derivative."""
    return math.hypot(_cubic(curve, "U", p)[1], _cubic(curve, "V", p)[1])


def _moved(s: float, old: list[float], new: list[float]) -> float:
    """A place in the new lengths."""
    i = min(max(bisect_right(old, s) - 1, 0), len(old) - 2)
    share = (s - old[i]) / (old[i + 1] - old[i]) if old[i + 1] > old[i] else 0.0
    return new[i] + min(share, 1.0) * (new[i + 1] - new[i])


class _Joint(NamedTuple):
    """The lanes of another road that those of a connecting road join."""

    end: End
    widths: list[float]  # of the joined lanes, in the order of those of the connecting road
    before: float  # from the reference line to the first of them for vehicles


def join(road: ET.Element, roads: Mapping[str, ET.Element]) -> None:
    """Let a connecting road begin and end where the lanes that it joins end and begin."""
    lanes = road.findall("lanes/laneSection/right/lane")
    first = next((i for i, lane in enumerate(lanes) if _drivable(lane)), 0)
    begin = _joint(road, roads, lanes, first, "predecessor")
    finish = _joint(road, roads, lanes, first, "successor")
    if begin is None or finish is None:
        return
    offset = road.find("lanes/laneOffset")  # netconvert's U-turns: their line is outside
    more = 0.0 if offset is None else number(offset, "a")
    start, stop = (_beside(j.end, more + j.before - sum(j.widths[:first])) for j in (begin, finish))
    view = road.find("planView")
    assert view is not None
    view[:] = [_hermite(start, stop, number(road, "length"))]
    set_lengths(road)
    for lane, before, after in zip(lanes, begin.widths, finish.widths, strict=True):
        _set_width(lane, before, after, number(road, "length"))


def _drivable(lane: ET.Element) -> bool:
    """Whether vehicles drive on a lane."""
    return lane.get("type") not in NOT_DRIVABLE


def _joint(
    road: ET.Element,
    roads: Mapping[str, ET.Element],
    lanes: list[ET.Element],
    first: int,
    side: str,
) -> _Joint | None:
    """The lanes that a connecting road joins; None where it does not run as they do."""
    link = road.find(f"link/{side}")
    contact = "end" if side == "predecessor" else "start"
    if link is None or link.get("contactPoint") != contact or link.get("elementId") not in roads:
        return None
    other = roads[str(link.get("elementId"))]
    widths = {
        lane.get("id"): number(width, "a")
        for lane in other.findall("lanes/laneSection/right/lane")
        if (width := lane.find("width")) is not None
    }
    joined = [one.get("id") for lane in lanes if (one := lane.find(f"link/{side}")) is not None]
    if len(joined) < len(lanes) or not widths.keys() >= {*joined}:
        return None
    inner = sum(widths[str(-i)] for i in range(1, -int(str(joined[first]))))
    return _Joint(ends(other)[contact == "end"], [widths[name] for name in joined], inner)


def _beside(end: End, right: float) -> End:
    """A point to the right of an end."""
    x, y, heading = end
    return End(x + right * math.sin(heading), y - right * math.cos(heading), heading)


def _set_width(lane: ET.Element, before: float, after: float, length: float) -> None:
    """Let a lane widen from its beginning to its end."""
    width = lane.find("width")
    if width is not None and length > 0.0:
        gained = after - before
        values = before, 0.0, 3.0 * gained / length**2, -2.0 * gained / length**3
        for letter, value in zip("abcd", values, strict=True):
            width.set(letter, f"{value + 0.0:.12g}")


def _hermite(start: End, stop: End, tangent: float) -> ET.Element:
    """The cubic between two ends."""
    c, s = math.cos(start.heading), math.sin(start.heading)
    x, y = stop.x - start.x, stop.y - start.y
    u, v, turn = c * x + s * y, c * y - s * x, stop.heading - start.heading
    tu, tv = tangent * math.cos(turn), tangent * math.sin(turn)
    line = ET.Element("geometry", s=text(0.0), x=text(start.x), y=text(start.y))
    line.set("hdg", text(start.heading))
    line.set("length", text(tangent))
    curve = ET.SubElement(line, "paramPoly3")
    axes = {"U": (0.0, tangent, 3 * u - 2 * tangent - tu, tangent + tu - 2 * u)}
    axes["V"] = (0.0, 0.0, 3 * v - tv, tv - 2 * v)
    for axis, values in axes.items():
        for letter, value in zip("abcd", values, strict=True):
            curve.set(letter + axis, text(value))
    curve.set("pRange", "normalized")
    return line
