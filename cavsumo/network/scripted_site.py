"""The place of a scripted test: a network whose roads are there to be driven on, and a given way.

The ego's route is the edges that the scenario names. Its path is the way of the script; SUMO's
lanes need not follow it to the centimetre, since the ego is moved along the way (``sumo.guided``).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

from cavsumo.errors import NetworkError
from cavsumo.model.carriageway import Limit
from cavsumo.model.scenario import Scenario
from cavsumo.model.scenario.script import ScriptedTest
from cavsumo.model.surroundings import RouteLane
from cavsumo.network.ego_routes import EgoRoute, lanes_from
from cavsumo.network.reader import Network, driving_lanes, lane_path, read_network
from cavsumo.network.site import Site
from cavsumo.network.surroundings import surroundings

BESIDE_M = 1.0  # the way lies no farther beside a lane where the ego enters


def ground(scenario: Scenario) -> Site:
    """A network with the lanes of a route, from which the sites of its cases are made quickly.

    Raises NetworkError where no lane leads along the edges.
    """
    assert scenario.script is not None
    network = read_network(scenario.net_file)
    route = _route(network, scenario.ego_route, scenario.script)
    near = surroundings(network, route)
    roads = network.roads(), (), network.crossing_surface()
    return Site(network.file, route, *roads, surroundings=near)


def scripted_site(ground: Site, script: ScriptedTest, length: float) -> Site:
    """The site of a case; the ego's path leads from its centre's start to the end of the lanes.

    ``length``: of the ego [m]. Raises NetworkError where the way begins beside the lanes.
    """
    start, curve, lanes = script.ego.start_m, script.ego.way.curve, ground.route.path
    x, y, _ = curve.at(start)
    here = lanes.project(x, y)
    if abs(here.lateral) > BESIDE_M or not length <= here.along < lanes.length:
        raise NetworkError(
            f"{ground.net}: {script.name or 'script'}: the ego enters at {x:.1f}, {y:.1f}, which "
            f"is not on a lane of its route {' '.join(ground.route.edges)}"
        )
    path = curve.polyline(start - length / 2, start + lanes.length - here.along)
    route = dataclasses.replace(ground.route, depart_m=round(here.along, 3), path=path)
    speed = script.ego.speed_mps  # the limit of all lanes, as the ego enters
    width = min(lane.width for lane in ground.surroundings.route)
    near = dataclasses.replace(ground.surroundings, route=(RouteLane(0.0, width, speed),))
    return dataclasses.replace(ground, route=route, limits=(Limit(0.0, speed),), surroundings=near)


def _route(network: Network, names: Sequence[str], script: ScriptedTest) -> EgoRoute:
    """The route on the lanes nearest to the way; its path is that of whole lanes."""
    edges = [network.edge(name) for name in names]
    if not edges:
        raise NetworkError(f"{network.file}: a script needs ego_route, the edges of a route")
    x, y, _ = script.ego.way.curve.at(script.ego.start_m)
    best, found = math.inf, None
    for lane in driving_lanes(edges[0]):
        lanes = lanes_from(network, lane, edges[1:])
        beside = _beside(lanes, x, y)
        if beside < best:
            best, found = beside, lanes
    if found is None:
        raise NetworkError(f"{network.file}: no car can follow the route {' '.join(names)}")
    arrive = float(edges[-1].getLength())
    index = int(found[0].getIndex())
    return EgoRoute(tuple(names), index, 0.0, round(arrive, 2), lane_path(found))


def _beside(lanes: Sequence[Any] | None, x: float, y: float) -> float:
    """How far a point lies beside some lanes [m]; infinite without lanes."""
    return math.inf if lanes is None else abs(lane_path(lanes).project(x, y).lateral)
