"""A trace as CommonRoad XML (2020a): obstacles with their tracks, lanelets, a planning problem.

*recorded*: the ego is one of the obstacles too, so that its collision is in the file. *test*: it is
left to the planner, whose problem is to come from the ego's first state to the end of its route.
Obstacles follow the clock in both: the format has no triggers. The position of a body is the middle
of its box; coordinates are those of the network, in m, headings in rad, x to the east and y to the
north. A time step is that of the episode. The format wants a first state of everybody in time step
0, and its readers count all others from there on: who enters later is far away until then
(``AWAY_M``).

The file is written without the package commonroad-io, whose classes differ from version to version
(2024 and 2026), while the format is the same; it is read by both.
"""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from pathlib import Path

from cavsumo import __version__
from cavsumo.interop.folders import check_place, write_all
from cavsumo.interop.head import head_of
from cavsumo.interop.lanelets import CROSSING, PAVEMENT, Strip, strips
from cavsumo.interop.openscenario import TEST, ExportPlace
from cavsumo.interop.tracks import Stays, Track, TrackPoint, stays
from cavsumo.model.bodies import BICYCLE, BUS, PEDESTRIAN
from cavsumo.model.kinematics import wrap
from cavsumo.model.polyline import Point
from cavsumo.network.drawing.surfaces import credit
from cavsumo.network.osm.netconvert import in_comment
from cavsumo.network.reader import read_network
from cavsumo.results.traces import Shape, Trace

XML = "test.xml"
VERSION = "2020a"
UNDATED = "2000-01-01"  # so that the same test gives the same bytes
FIRST_BODY, PROBLEM = 100_001, 90_001  # ids, beyond those of lanelets
DECIMALS = 12
AWAY_M = 100_000.0  # to the south
GOAL_M = 10.0, 5.0  # length and width of the goal, at the end of the ego's route
TYPES = {PEDESTRIAN.name: "pedestrian", BICYCLE.name: "bicycle", BUS.name: "bus"}
TYPES |= {"truck": "truck", "trailer": "truck", "motorcycle": "motorcycle", "moped": "motorcycle"}
TAGS = ("critical", "simulated", "urban")
ON_FOOT = {PAVEMENT, CROSSING}
HEAD_COMMENT = re.compile(r"<!-- cavsumo\.head (.*?) -->", re.DOTALL)


def write_commonroad(trace: Trace, place: ExportPlace, folder: Path, way: str) -> None:
    """Write ``test.xml`` into a folder, which is made if need be; ``way`` is RECORDED or TEST.

    Raises InputError when the file cannot be made.
    """
    check_place(folder)
    notice, dt = credit(place.net), step_of(trace)
    bodies = stays(trace)
    root = _root(trace, place.net, way, notice)
    _add_location(root, place.net)
    tags = ET.SubElement(root, "scenarioTags")
    for tag in TAGS:
        ET.SubElement(tags, tag)
    for strip in strips(place.net, _lines(place, bodies)):
        _add_lanelet(root, strip)
    ids, enters = dict[int, str](), dict[int, int]()
    for body in bodies:
        for track in () if way == TEST and body.part == "ego" else body.tracks:
            number = FIRST_BODY + len(ids)
            ids[number] = body.name
            whole = _from_the_beginning(track, dt)
            if len(whole) > len(track):
                enters[number] = len(whole) - len(track)
            _add_obstacle(root, number, body.shape, whole, dt)
    _add_problem(root, bodies[0], place, dt)
    kinds = {body.name: [body.part, *body.shape] for body in bodies}
    head = {**head_of(trace, way), "ids": ids, "enters": enters, "bodies": kinds}
    write_all(folder, {XML: _text(root, head, notice)})


def step_of(trace: Trace) -> float:
    """The length of a timestep [s]."""
    return float(trace.head["plan"]["scenario"]["step_length"])


def _root(trace: Trace, net: Path, way: str, notice: str) -> ET.Element:
    """The outer element, with the header."""
    said = f"run {trace.row['run']}, {trace.row['outcome']}, as {way}, on {net.name}"
    attributes = {
        "timeStepSize": f"{step_of(trace)}",
        "commonRoadVersion": VERSION,
        "author": f"cavsumo {__version__}",
        "affiliation": "",
        "source": f"{said}; {notice}" if notice else said,
        "benchmarkID": _name(trace, net),
        "date": UNDATED,
    }
    return ET.Element("commonRoad", attributes)


def _name(trace: Trace, net: Path) -> str:
    """The name of the scenario: an invented country, the network, the run from 1 on."""
    words = re.findall(r"[A-Za-z]+", net.name.partition(".")[0])
    place = "".join(word.capitalize() for word in words) or "Network"
    return f"ZAM_{place}-1_{int(trace.row['run']) + 1}_T-1"


def _add_location(root: ET.Element, net: Path) -> None:
    """Where on earth the network is, if it says so."""
    network, location = read_network(net).net, ET.SubElement(root, "location")
    known = network.hasGeoProj()
    longitude, latitude = network.convertXY2LonLat(0.0, 0.0) if known else (999.0, 999.0)
    _add(location, "geoNameId", -999)
    _add(location, "gpsLatitude", round(latitude, 7))
    _add(location, "gpsLongitude", round(longitude, 7))
    if known:
        x, y = network.getLocationOffset()
        way = ET.SubElement(location, "geoTransformation")
        _add(way, "geoReference", network.getGeoProj().srs)
        more = ET.SubElement(way, "additionalTransformation")
        _add(more, "xTranslation", -x)
        _add(more, "yTranslation", -y)
        _add(more, "zRotation", 0.0)
        _add(more, "scaling", 1.0)


def _lines(place: ExportPlace, bodies: Sequence[Stays]) -> list[list[Point]]:
    """The lines near which lanelets are told."""
    tracks = [track for body in bodies if body.part != "background" for track in body.tracks]
    return [list(place.path.points), *([(one.x, one.y) for one in track] for track in tracks)]


def _add_lanelet(root: ET.Element, strip: Strip) -> None:
    """A lanelet."""
    lanelet = ET.SubElement(root, "lanelet", id=str(strip.id))
    for side, points in (("leftBound", strip.left), ("rightBound", strip.right)):
        bound = ET.SubElement(lanelet, side)
        for x, y in points:
            _add_point(bound, x, y)
    for name, numbers in (("predecessor", strip.before), ("successor", strip.after)):
        for number in numbers:
            ET.SubElement(lanelet, name, ref=str(number))
    for name, neighbour in (("adjacentLeft", strip.left_id), ("adjacentRight", strip.right_id)):
        if neighbour is not None:
            ET.SubElement(lanelet, name, ref=str(neighbour), drivingDir="same")
    _add(lanelet, "laneletType", strip.kind)
    on_foot = strip.kind in ON_FOOT
    _add(lanelet, "userBidirectional" if on_foot else "userOneWay", _user(on_foot))


def _user(on_foot: bool) -> str:
    """The users of a lanelet."""
    return "pedestrian" if on_foot else "vehicle"


def _from_the_beginning(track: Track, dt: float) -> Track:
    """A track with a state in each time step before its first one, standing far away."""
    first = track[0]
    away = [
        first._replace(time=step * dt, y=first.y - AWAY_M, speed=0.0)
        for step in range(round(first.time / dt))
    ]
    return [*away, *track]


def _add_obstacle(root: ET.Element, number: int, shape: Shape, track: Track, dt: float) -> None:
    """A body while it is there."""
    obstacle = ET.SubElement(root, "dynamicObstacle", id=str(number))
    _add(obstacle, "type", TYPES.get(shape.kind, "car"))
    box = ET.SubElement(ET.SubElement(obstacle, "shape"), "rectangle")
    _add(box, "length", shape.length)
    _add(box, "width", shape.width)
    _add_state(obstacle, "initialState", track[0], dt)
    if len(track) > 1:
        way = ET.SubElement(obstacle, "trajectory")
        for one in track[1:]:
            _add_state(way, "state", one, dt)


def _add_state(parent: ET.Element, name: str, one: TrackPoint, dt: float) -> ET.Element:
    """A body at a time step."""
    state = ET.SubElement(parent, name)
    _add_point(ET.SubElement(state, "position"), one.x, one.y)
    _add_exact(state, "orientation", wrap(one.heading))
    _add_exact(state, "time", round(one.time / dt))
    _add_exact(state, "velocity", one.speed)
    return state


def _add_problem(root: ET.Element, ego: Stays, place: ExportPlace, dt: float) -> None:
    """The ego's planning problem: from its first state to the end of its route."""
    problem = ET.SubElement(root, "planningProblem", id=str(PROBLEM))
    begin = _add_state(problem, "initialState", ego.tracks[0][0], dt)
    for name in ("yawRate", "slipAngle"):
        _add_exact(begin, name, 0.0)
    goal = ET.SubElement(problem, "goalState")
    x, y, heading = place.path.at(max(0.0, place.path.length - GOAL_M[0] / 2.0))
    area = ET.SubElement(ET.SubElement(goal, "position"), "rectangle")
    values = ("length", GOAL_M[0]), ("width", GOAL_M[1]), ("orientation", wrap(heading))
    for name, value in values:
        _add(area, name, value)
    centre = ET.SubElement(area, "center")
    _add(centre, "x", x)
    _add(centre, "y", y)
    when = ET.SubElement(goal, "time")
    _add(when, "intervalStart", 0)
    _add(when, "intervalEnd", max(1, round(place.horizon / dt)))


def _add(parent: ET.Element, name: str, value: float | str) -> None:
    """An element with a value; numbers have no exponent, which the schema does not allow."""
    if isinstance(value, float):
        value = f"{round(value, DECIMALS) + 0.0:.{DECIMALS}f}".rstrip("0").rstrip(".")
    ET.SubElement(parent, name).text = str(value)


def _add_exact(parent: ET.Element, name: str, value: float) -> None:
    """An exact value."""
    _add(ET.SubElement(parent, name), "exact", value)


def _add_point(parent: ET.Element, x: float, y: float) -> None:
    """A point."""
    point = ET.SubElement(parent, "point")
    _add(point, "x", x)
    _add(point, "y", y)


def _text(root: ET.Element, head: dict[str, object], notice: str) -> str:
    """The file, with the attribution, and with the episode's settings."""
    ET.indent(root)
    known = json.dumps(head).replace("--", "-\\u002d")  # a comment holds no two hyphens
    lines: Iterable[str] = (
        '<?xml version="1.0" encoding="UTF-8"?>',
        *([f"<!-- {in_comment(notice)} -->"] if notice else []),
        f"<!-- cavsumo.head {known} -->",
        ET.tostring(root, encoding="unicode"),
        "",
    )
    return "\n".join(lines)
