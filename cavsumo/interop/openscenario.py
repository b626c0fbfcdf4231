"""A trace as OpenSCENARIO XML 1.2 with OpenDRIVE (``opendrive``).

*recorded*: everybody follows the recorded track by the clock. *test*: the ego begins as recorded
and is left to the controller of the player; each tester moves until it last stands, waits there
until the ego has come as far as it had when the tester set off, and then follows its track once,
without regard to the ego; at the end of the record it goes straight on. That is the rule by which
``regress --testers policy`` plays it. The background follows the clock until the record ends.

A vehicle's reference point is the middle of its rear axle, as the standard has it; ours is the
middle of its box, half a wheelbase before the axle. A pedestrian's is the middle of its box in
both. Bodies that enter late or leave early are added and deleted then.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from cavsumo import __version__
from cavsumo.errors import InputError
from cavsumo.interop.folders import check_place, write_all
from cavsumo.interop.head import HEAD, head_of
from cavsumo.interop.opendrive import UNDATED, XODR, roads_of
from cavsumo.interop.storyboard_parts import (
    at_time,
    ego_has_come,
    entity,
    event,
    follow,
    group,
    position,
    standing_speed,
)
from cavsumo.interop.tracks import Stays, TrackPoint, at_axle, driven, moved, set_off, stays
from cavsumo.model.polyline import Path as Polyline
from cavsumo.network.drawing.surfaces import credit
from cavsumo.network.reader import lane_path, read_network
from cavsumo.results.traces import Trace

XOSC = "test.xosc"
MINOR = 2  # of the version of OpenSCENARIO
EXTRA = "pip install 'cavsumo[export]'"
RECORDED, TEST = "recorded", "test"
WAYS = (RECORDED, TEST)
STRAIGHT_ON_S = 10.0  # for which a tester goes straight on behind the end of the record
HALF = 0.5  # of a timestep before its first frame a body enters, and stands there


class ExportPlace(NamedTuple):
    """The place of an episode.

    Attributes:
        net: the network's file.
        path: the ego's path, from where its middle starts to where its front arrives.
        edges: ids of the edges of its route.
        horizon: how long an episode may last [s].
    """

    net: Path
    path: Polyline
    edges: tuple[str, ...]
    horizon: float


def write_openscenario(trace: Trace, place: ExportPlace, folder: Path, way: str = RECORDED) -> None:
    """Write ``test.xosc`` and ``test.xodr`` into a folder, which is made if need be.

    Args:
        way: RECORDED or TEST.

    Raises InputError when a package is missing, or a file cannot be made; then none is written.
    """
    xosc, notice = _library(), credit(place.net)
    check_place(folder)
    scenario = _scenario(xosc, trace, place, way, notice)
    roads = roads_of(place.net, notice)
    with TemporaryDirectory(prefix="cavsumo-") as work:
        scenario.write_xml(str(Path(work) / XOSC))
        story = (Path(work) / XOSC).read_text(encoding="utf-8")
    write_all(folder, {XODR: roads, XOSC: story})


def _library() -> Any:
    """The package that knows OpenSCENARIO."""
    try:
        from scenariogeneration import xosc
    except ImportError as error:
        raise InputError(f"export to OpenSCENARIO needs scenariogeneration: {EXTRA}") from error
    return xosc


def _scenario(xosc: Any, trace: Trace, place: ExportPlace, way: str, notice: str) -> Any:
    """The scenario; ``notice``: the attribution that the map's licence requires."""
    bodies, end = stays(trace), float(trace.frames[-1]["time_s"])
    entities, init = xosc.Entities(), xosc.Init()
    act = xosc.Act(way, at_time(xosc, 0.0, "start"))
    for body in bodies:
        entities.add_scenario_object(body.name, entity(xosc, body))
        for action in _begins(xosc, body, place, way):
            init.add_init_action(body.name, action)
        if body.late:
            init.add_global_action(xosc.DeleteEntityAction(body.name))
        events = list(_events(xosc, body, bodies[0], way, end))
        if events:
            act.add_maneuver_group(group(xosc, body.name, events))
    last = end if way == RECORDED else max(end, place.horizon)
    board = xosc.StoryBoard(init, at_time(xosc, last, "stop", after=True, stop=True))
    board.add_act(act)
    return _document(xosc, trace, way, notice, entities, board)


def _document(xosc: Any, trace: Trace, way: str, notice: str, entities: Any, board: Any) -> Any:
    """The file: its header, and what it consists of."""
    known = xosc.Properties()
    speeds = {
        body.name: [one.speed for track in body.tracks for one in track] for body in stays(trace)
    }
    known.add_property(HEAD, json.dumps({**head_of(trace, way), "speeds": speeds}))
    row = trace.row
    said = f"run {row['run']}, {row['outcome']}, as {way}"
    return xosc.Scenario(
        f"{said}; {notice}" if notice else said,
        f"cavsumo {__version__}",
        xosc.ParameterDeclarations(),
        entities,
        board,
        xosc.RoadNetwork(XODR),
        xosc.Catalog(),
        osc_minor_version=MINOR,
        license=xosc.License("ODbL 1.0", spdxId="ODbL-1.0", resource=None) if notice else None,
        creation_date=UNDATED,
        header_properties=known,
    )


def _begins(xosc: Any, body: Stays, place: ExportPlace, way: str) -> Iterator[Any]:
    """The actions with which a body begins."""
    if body.late:
        return
    first = at_axle(body.shape, body.tracks[0][:1])[0]
    yield xosc.TeleportAction(position(xosc, first))
    if way == TEST and body.part != "background":
        yield standing_speed(xosc, first.speed)
    if way == TEST and body.part == "ego":
        yield xosc.AssignRouteAction(_route(xosc, place))


def _route(xosc: Any, place: ExportPlace) -> Any:
    """The ego's route as waypoints: where it begins, one on each road, and where it ends.

    None is inside a junction, where several roads lie upon each other.
    """
    route = xosc.Route("route of ego")
    for x, y, heading in waypoints(place):
        there = position(xosc, TrackPoint(0.0, x, y, heading, 0.0))
        route.add_waypoint(there, xosc.RouteStrategy.shortest)
    return route


def waypoints(place: ExportPlace) -> list[tuple[float, float, float]]:
    """Places on the ego's path, with headings: its ends, and near the middle of each edge."""
    path, network = place.path, read_network(place.net)
    found = {0.0, path.length}
    for name in place.edges:
        lane = lane_path(network.edge(name).getLanes()[-1:])
        found.add(path.project(*lane.at(lane.length / 2.0)[:2]).along)
    return [path.at(along) for along in sorted(found)]


def _events(xosc: Any, body: Stays, ego: Stays, way: str, end: float) -> Iterator[Any]:
    """The events of a body."""
    if way == TEST and body.part == "ego":
        return
    if way == TEST and body.part == "tester":
        yield from _waiting(xosc, body, ego)
        return
    yield from _by_clock(xosc, body, ego, way, end)


def _pause(ego: Stays) -> float:
    """The time between two frames [s]."""
    track = ego.tracks[0]
    return track[1].time - track[0].time if len(track) > 1 else 0.0


def _by_clock(xosc: Any, body: Stays, ego: Stays, way: str, end: float) -> Iterator[Any]:
    """The events of a body that follows its tracks by the clock."""
    for i, track in enumerate(body.tracks):
        name = f"{body.name} {i}"
        there = at_axle(body.shape, track)
        begin, last = track[0].time, track[-1].time
        if body.late or i:
            added = xosc.AddEntityAction(body.name, position(xosc, there[0]))
            due = begin - HALF * _pause(ego)  # players add a body one of their steps later
            yield event(xosc, f"{name} enters", added, at_time(xosc, due, f"{name} is due"))
        action = follow(xosc, f"track of {name}", there, by_clock=True)
        yield event(xosc, f"{name} moves", action, at_time(xosc, begin, f"{name} starts"))
        if last < end or way == TEST:
            gone = xosc.DeleteEntityAction(body.name)
            trigger = at_time(xosc, last, f"{name} is over", after=True)
            yield event(xosc, f"{name} leaves", gone, trigger)


def _waiting(xosc: Any, body: Stays, ego: Stays) -> Iterator[Any]:
    """The events of a tester that waits for the ego where it last stood."""
    track, name = body.tracks[0], body.name
    at = set_off(track)
    before = None
    if at is None or at > 0:
        first = track if at is None else track[: at + 1]
        if at is None:
            first = [*first, _straight_on(first[-1])]
        if driven(first)[-1] > 0.0:
            before = f"{name} moves"
            action = follow(xosc, f"way of {name}", at_axle(body.shape, first), by_clock=True)
            yield event(xosc, before, action, at_time(xosc, 0.0, f"{name} starts"))
    if at is not None and at < len(track) - 1:
        second = at_axle(body.shape, [*track[at:], _straight_on(track[-1])])
        action = follow(xosc, f"last way of {name}", second, by_clock=False)
        metres = driven(at_axle(ego.shape, ego.tracks[0]))[at]
        trigger = ego_has_come(xosc, metres, f"ego has come {metres:.1f} m", before)
        yield event(xosc, f"{name} sets off", action, trigger)


def _straight_on(last: TrackPoint) -> TrackPoint:
    """Where a body is some time after the end of its track."""
    ahead = moved([last], last.speed * STRAIGHT_ON_S)[0]
    return ahead._replace(time=last.time + STRAIGHT_ON_S)
