"""The network on which a scenario is played: made of its OpenDRIVE, or a straight proving road.

netconvert makes the network, in the same coordinates. It serves if the ego's way begins in the
middle of a lane of ordinary width. On the areas of test tracks, which are one lane of 28 m, SUMO's
drivers would take everybody for a leader; there, and without OpenDRIVE, the proving road of the
suites is laid under a straight way, and all places are moved with it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from cavsumo.errors import InputError
from cavsumo.model.checksums import checksum
from cavsumo.model.curve import PlaneCurve, Pose
from cavsumo.model.geometry import wrap
from cavsumo.model.own_folders import process_folder
from cavsumo.openscenario.placing import Beginning
from cavsumo.openscenario.roads import RoadMap

OPTIONS = ("offset.disable-normalization", "no-turnarounds.except-deadend")
PROVING_ROAD, EASTBOUND = Path("proving-road"), "eastbound"
PROVING_BEGIN: Pose = (-500.0, -1.75, 0.0)  # of the ego's reference point
BESIDE_M, ORDINARY_M = 1.0, 6.0  # of the way beside the middle of a lane; width of a lane
STEP_M, BEYOND_M = 2.0, 1000.0


@dataclass(frozen=True)
class Ground:
    """Where a scenario is played.

    Attributes:
        net: the network, as plans name it.
        route: the edges of the ego's route.
        move: brings a pose of the scenario there.
        places: the present paths of files that were made for it.
        note: what to tell; empty for nothing.
    """

    net: Path
    route: tuple[str, ...]
    move: Callable[[Pose], Pose]
    places: dict[str, Path]
    note: str = ""


def ground_of(ego: Beginning, roads: RoadMap | None) -> Ground:
    """The ground for an ego's way; raises InputError where none can be laid."""
    why = "the scenario names no OpenDRIVE"
    if roads is not None:
        try:
            made = converted(roads.file)
            route = _route(made, ego)
            if route:
                return Ground(roads.file, route, lambda pose: pose, {str(roads.file): made})
            why = f"{roads.file.name} has no lane of up to {ORDINARY_M:g} m along the ego's way"
        except InputError as error:
            why = f"{roads.file.name}: {error}"
    if not ego.course.straight:
        raise InputError(f"{str(ego.course.node.xml.file)!r}: no road for the ego: {why}")
    note = f"{why}: played on a straight proving road"
    return Ground(PROVING_ROAD, (EASTBOUND,), _mover(ego.course.begin), {}, note)


def _mover(begin: Pose) -> Callable[[Pose], Pose]:
    """The function that moves a pose as it moves the ego's beginning to the proving road."""
    x0, y0, o0 = begin
    x1, y1, o1 = PROVING_BEGIN
    turn = o1 - o0
    c, s = math.cos(turn), math.sin(turn)

    def move(pose: Pose) -> Pose:
        dx, dy = pose[0] - x0, pose[1] - y0
        return x1 + dx * c - dy * s, y1 + dx * s + dy * c, wrap(pose[2] + turn)

    return move


def converted(file: Path) -> Path:
    """The network that netconvert makes of OpenDRIVE, in a folder of this process."""
    from cavsumo.network.osm.netconvert import (
        in_comment,
        netconvert,
        netconvert_version,
        with_notice,
    )

    folder = process_folder("scenario") / checksum(file)
    made = folder / f"{file.stem}.net.xml"
    if not made.is_file():
        folder.mkdir(exist_ok=True)
        options = [f"opendrive-files={file.resolve()}", f"output-file={made.name}", *OPTIONS]
        netconvert(options, folder)
        text = made.read_text(encoding="utf-8")
        head = f"made by netconvert {netconvert_version()} from {in_comment(file.name)}"
        text = with_notice(text, head, [in_comment(" ".join(OPTIONS))])
        made.write_text(re.sub(r"[ \t]+\n", "\n", text), encoding="utf-8")
    return made


def _route(file: Path, ego: Beginning) -> tuple[str, ...]:
    """The edges along the ego's way; none if it does not begin on an ordinary lane."""
    from cavsumo.network.reader import driving_lanes, lane_path, read_network

    network = read_network(file)
    lanes = [
        (str(edge.getID()), lane_path([lane]), float(lane.getWidth()))
        for edge in network.edges
        for lane in driving_lanes(edge)
    ]
    curve = PlaneCurve(ego.course.begin, ego.course.legs)
    found: list[str] = []
    s = ego.entity.front
    while s < max(curve.length, BEYOND_M):
        x, y, o = curve.at(s)
        for name, path, width in lanes:
            here = path.project(x, y)
            if not 0.0 < here.along < path.length or abs(here.lateral) > BESIDE_M:
                continue
            if math.cos(path.at(here.along)[2] - o) > 0.9 and width <= ORDINARY_M:
                if name not in found:
                    found.append(name)
                break
        else:
            if s == ego.entity.front:
                return ()
        s += STEP_M
    return tuple(found)
