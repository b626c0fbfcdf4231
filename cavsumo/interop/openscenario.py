"""A trace as OpenSCENARIO XML 1.2 with OpenDRIVE: everybody follows the recorded track.

The road is made by netconvert, in the coordinates of the network. A vehicle's reference point is
the middle of its rear axle, as the standard has it; ours is the middle of its box, half a wheelbase
before the axle. A pedestrian's is the middle of its box in both. Bodies that are not there from the
beginning to the end are left out.
"""

from __future__ import annotations

import datetime
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from cavsumo import __version__
from cavsumo.errors import InputError
from cavsumo.model.bodies import BICYCLE, BUS, PEDESTRIAN
from cavsumo.network.drawing.surfaces import credit
from cavsumo.network.osm.netconvert import (
    in_comment,
    netconvert,
    netconvert_version,
    with_notice,
)
from cavsumo.results.traces import Shape, Trace, states

if TYPE_CHECKING:
    from scenariogeneration import xosc

XOSC, XODR = "test.xosc", "test.xodr"
MINOR = 2  # of the version of OpenSCENARIO
EXTRA = "pip install 'cavsumo[export]'"
HEIGHT_M = {PEDESTRIAN.name: 1.7, BICYCLE.name: 1.7, BUS.name: 3.2}
CAR_HEIGHT_M = 1.5
UNDATED = datetime.datetime(2000, 1, 1)  # so that the same test gives the same bytes
PEDESTRIAN_KG = 75.0
HELD_S = 0.001  # for how long around a timestep a heading is held
Track = Sequence[tuple[float, float, float, float]]  # time [s], x, y [m], heading [rad]


def write_openscenario(trace: Trace, net: Path, folder: Path) -> list[str]:
    """Write ``test.xosc`` and ``test.xodr`` into a folder; the ids of bodies that were left out.

    Raises InputError when a package is missing, or a file cannot be made; the scenario is written
    last.
    """
    library = _library()
    if not folder.is_dir():
        raise InputError(f"--output {str(folder)!r}: no such folder")
    whole, partial = tracks(trace)
    notice = credit(net)
    scenario = _scenario(library, trace, whole, notice)
    try:
        _write_roads(net, folder, notice)
        scenario.write_xml(str(folder / XOSC))
    except OSError as error:
        raise InputError(f"{str(folder / XOSC)!r}: cannot be written: {error.strerror}") from error
    return partial


def _write_roads(net: Path, folder: Path, notice: str) -> None:
    """Write the roads; without paths of this machine, and without a date."""
    with TemporaryDirectory(prefix="cavsumo-") as work:
        options = [f"sumo-net-file={net.resolve()}", f"opendrive-output={XODR}"]
        netconvert(options, Path(work))
        text = (Path(work) / XODR).read_text(encoding="utf-8")
    text = re.sub(r'(<header [^>]*\bdate=")[^"]*"', rf'\g<1>{UNDATED:%Y-%m-%dT%H:%M:%S}"', text)
    made = f"made by netconvert {netconvert_version()} from {in_comment(net.name)}"
    text = with_notice(text, made, [in_comment(notice)] if notice else [])
    (folder / XODR).write_text(text, encoding="utf-8")


def _library() -> Any:
    """The package that knows OpenSCENARIO."""
    try:
        from scenariogeneration import xosc
    except ImportError as error:
        raise InputError(f"export to OpenSCENARIO needs scenariogeneration: {EXTRA}") from error
    return xosc


def tracks(trace: Trace) -> tuple[dict[str, Track], list[str]]:
    """The tracks of the reference points of all bodies that are there in every frame; the others.

    Headings go on without jumps.
    """
    shapes, found = trace.shapes(), dict[str, list[tuple[float, float, float, float]]]()
    for frame in trace.frames:
        for _, name, state in states(frame):
            x, y, o = reference_point(shapes[name], state)
            own = found.setdefault(name, [])
            if own:
                o = own[-1][3] + math.remainder(o - own[-1][3], math.tau)
            own.append((frame["time_s"], x, y, o))
    length = len(trace.frames)
    whole: dict[str, Track] = {name: way for name, way in found.items() if len(way) == length}
    return whole, [name for name in found if name not in whole]


def reference_point(shape: Shape, state: Sequence[float]) -> tuple[float, float, float]:
    """The reference point of a body and its heading, from the middle of its box."""
    x, y, _, o = state
    back = axle(shape)
    return x - back * math.cos(o), y - back * math.sin(o), o


def axle(shape: Shape) -> float:
    """How far the rear axle lies behind the middle of a body, within its box [m]."""
    if shape.kind == PEDESTRIAN.name:
        return 0.0
    return min(shape.wheelbase, shape.length) / 2.0


def _scenario(xosc: Any, trace: Trace, whole: Mapping[str, Track], notice: str) -> Any:
    """The scenario; ``notice``: the attribution that the map's licence requires."""
    shapes, entities, init = trace.shapes(), xosc.Entities(), xosc.Init()
    end = float(trace.frames[-1]["time_s"])
    act = xosc.Act("recorded", _after(xosc, 0.0))
    for name, track in whole.items():
        entities.add_scenario_object(name, _entity(xosc, name, shapes[name]))
        init.add_init_action(name, xosc.TeleportAction(_place(xosc, track[0])))
        act.add_maneuver_group(_following(xosc, name, track))
    board = xosc.StoryBoard(init, _after(xosc, end, "stop"))
    board.add_act(act)
    return xosc.Scenario(
        _title(trace.row, notice),
        f"cavsumo {__version__}",
        xosc.ParameterDeclarations(),
        entities,
        board,
        xosc.RoadNetwork(XODR),
        xosc.Catalog(),
        osc_minor_version=MINOR,
        creation_date=UNDATED,
    )


def _title(row: Mapping[str, str], notice: str) -> str:
    """The description in the file's header."""
    said = f"run {row['run']}, {row['outcome']}, as recorded"
    return f"{said}; {notice}" if notice else said


def _entity(xosc: Any, name: str, shape: Shape) -> xosc.Vehicle | xosc.Pedestrian:
    """The body as an entity."""
    height = HEIGHT_M.get(shape.kind, CAR_HEIGHT_M)
    back = axle(shape)
    box = xosc.BoundingBox(shape.width, shape.length, height, back, 0.0, height / 2)
    if shape.kind == PEDESTRIAN.name:
        category = xosc.PedestrianCategory.pedestrian
        return xosc.Pedestrian(name, PEDESTRIAN_KG, category, box)
    categories = {BUS.name: "bus", BICYCLE.name: "bicycle"}
    category = getattr(xosc.VehicleCategory, categories.get(shape.kind, "car"))
    front = xosc.Axle(0.6, 0.6, shape.width * 0.9, 2.0 * back, 0.3)
    rear = xosc.Axle(0.0, 0.6, shape.width * 0.9, 0.0, 0.3)
    return xosc.Vehicle(name, category, box, front, rear, 70.0, 10.0, 10.0)


def _following(xosc: Any, name: str, track: Track) -> Any:
    """A body that follows its track by the clock."""
    points = held(track)
    shape = xosc.Polyline([point[0] for point in points], [_place(xosc, p) for p in points])
    trajectory = xosc.Trajectory(f"track of {name}", closed=False)
    trajectory.add_shape(shape)
    follow = xosc.FollowTrajectoryAction(
        trajectory, xosc.FollowingMode.position, xosc.ReferenceContext.absolute, 1, 0
    )
    event = xosc.Event(f"{name} moves", xosc.Priority.override)
    event.add_action(f"{name} follows", follow)
    event.add_trigger(_after(xosc, 0.0, "start", name))
    manoeuvre = xosc.Maneuver(f"manoeuvre of {name}")
    manoeuvre.add_event(event)
    group = xosc.ManeuverGroup(f"group of {name}")
    group.add_actor(name)
    group.add_maneuver(manoeuvre)
    return group


def held(track: Track) -> Track:
    """A track with points just before and after each, on the way, with the same heading.

    Players turn between the headings of points in different ways; some are halfway at a point.
    """
    points = []
    for i, (time, x, y, heading) in enumerate(track):
        for shift in (-HELD_S, 0.0, HELD_S):
            other = track[max(0, min(len(track) - 1, i + (shift > 0.0) - (shift < 0.0)))]
            share = shift / (other[0] - time) if other[0] != time else 0.0
            if share or not shift:
                there = x + share * (other[1] - x), y + share * (other[2] - y)
                points.append((time + shift, *there, heading))
    return points


def _place(xosc: Any, point: tuple[float, float, float, float]) -> Any:
    """A place in the world."""
    _, x, y, heading = point
    return xosc.WorldPosition(x, y, 0.0, heading, 0.0, 0.0)


def _after(xosc: Any, time: float, sort: str = "start", name: str = "") -> Any:
    """A trigger that holds from a time on [s]."""
    rule = xosc.Rule.greaterThan if sort == "stop" else xosc.Rule.greaterOrEqual
    condition = xosc.SimulationTimeCondition(time, rule)
    return xosc.ValueTrigger(
        f"{sort} {name}".strip(), 0.0, xosc.ConditionEdge.none, condition, triggeringpoint=sort
    )
