"""Figures of a network: lanes, crossings, traffic lights, location, missing features."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

from cavsumo.network.reader import Network, driving_lanes, is_pavement

NET_VERSIONS = ((1, 0), (1, 20))  # versions of SUMO's network format for which cavsumo was made
# The right of way of pedestrians on a crossing.
SIGNALS, PRIORITY, NONE = "signals", "priority", "none"


@dataclass(frozen=True)
class Facts:
    """A network in figures.

    Attributes:
        format: version of SUMO's network format.
        left_hand: whether traffic keeps left.
        edges, lanes, car_lanes, pavements: roads by direction, and lanes of them by use.
        junctions, dead_ends: nodes that connect roads, and those at which one ends.
        traffic_lights: number of signal controllers.
        crossings: number of pedestrian crossings.
        crossings_with_signals, crossings_with_priority, crossings_without_priority: of these.
        walking_areas: where pavements and crossings meet.
        components: parts that no road connects.
        width_m, height_m: extent [m].
        centre: latitude and longitude of the middle [degrees], None when not known.
        notes: sentences about missing features, for the user.
    """

    format: str
    left_hand: bool
    edges: int
    lanes: int
    car_lanes: int
    pavements: int
    junctions: int
    dead_ends: int
    traffic_lights: int
    crossings: int
    crossings_with_signals: int
    crossings_with_priority: int
    crossings_without_priority: int
    walking_areas: int
    components: int
    width_m: float
    height_m: float
    centre: tuple[float, float] | None
    notes: tuple[str, ...]


def facts(network: Network) -> Facts:
    """A network in figures."""
    lanes = [lane for edge in network.edges for lane in edge.getLanes()]
    neighbours = _neighbours(network)
    ends = sum(len(others) < 2 for others in neighbours.values())
    rights = Counter(right_of_way(crossing) for crossing in network.crossings())
    west, south, east, north = _boundary(network)
    found = Facts(
        format=network.root.get("version", ""),
        left_hand=network.left_hand,
        edges=len(network.edges),
        lanes=len(lanes),
        car_lanes=sum(len(driving_lanes(edge)) for edge in network.edges),
        pavements=sum(is_pavement(lane) for lane in lanes),
        junctions=len(neighbours) - ends,
        dead_ends=ends,
        traffic_lights=len(network.net.getTrafficLights()),
        crossings=rights.total(),
        crossings_with_signals=rights[SIGNALS],
        crossings_with_priority=rights[PRIORITY],
        crossings_without_priority=rights[NONE],
        walking_areas=len(network.inside("walkingarea")),
        components=_components(neighbours),
        width_m=round(east - west, 2),
        height_m=round(north - south, 2),
        centre=place(network, (west + east) / 2, (south + north) / 2),
        notes=(),
    )
    return dataclasses.replace(found, notes=tuple(_notes(network, found)))


def right_of_way(crossing: Any) -> str:
    """The right of way of pedestrians on a crossing: by signals, by priority over cars or none."""
    links = [link for links in crossing.getIncoming().values() for link in links]
    if any(link.getTLSID() for link in links):
        return SIGNALS
    return PRIORITY if any(link.getState() == "M" for link in links) else NONE


def place(network: Network, x: float, y: float) -> tuple[float, float] | None:
    """Latitude and longitude of a point [degrees]; None without georeference or pyproj."""
    if not has_georeference(network) or find_spec("pyproj") is None:
        return None
    try:
        lon, lat = network.net.convertXY2LonLat(x, y)
    except RuntimeError:  # pyproj's errors: a projection that it does not know
        return None
    return round(float(lat), 6), round(float(lon), 6)


def has_georeference(network: Network) -> bool:
    """Whether a network has a georeference."""
    return str(network.net._location.get("projParameter", "!")) not in ("!", "-", "", ".")


def _boundary(network: Network) -> tuple[float, float, float, float]:
    """West, south, east and north end [m]: as the file says, else of its junctions."""
    if "convBoundary" in network.net._location:
        return tuple(network.net.getBoundary())
    (west, south), (east, north) = network.net.getBBoxXY()
    return west, south, east, north


def _neighbours(network: Network) -> dict[str, set[str]]:
    """The junctions that roads connect with each junction, in either direction."""
    found: dict[str, set[str]] = {}
    for edge in network.edges:
        a, b = str(edge.getFromNode().getID()), str(edge.getToNode().getID())
        found.setdefault(a, set()).add(b)
        found.setdefault(b, set()).add(a)
    return found


def _components(neighbours: Mapping[str, set[str]]) -> int:
    """The number of parts that no road connects."""
    parts, seen = 0, set[str]()
    for first in neighbours:
        parts += first not in seen
        waiting = [first]
        while waiting:
            node = waiting.pop()
            if node not in seen:
                seen.add(node)
                waiting += neighbours[node]
    return parts


def _notes(network: Network, found: Facts) -> Iterator[str]:
    """Sentences about the missing features of a network."""
    first, last = (".".join(map(str, version)) for version in NET_VERSIONS)
    if not NET_VERSIONS[0] <= _version(found.format) <= NET_VERSIONS[1]:
        yield (
            f"network format {found.format} is of another SUMO (made for {first} to {last}): "
            "if it gives trouble, netconvert -s OLD.net.xml -o NEW.net.xml writes it anew"
        )
    if not found.pavements:
        yield (
            "no pavements, so tester pedestrians have nowhere to start: "
            "netconvert -s OLD.net.xml --sidewalks.guess --crossings.guess -o NEW.net.xml adds them"
        )
    elif not found.crossings:
        yield (
            "no pedestrian crossings: testers cross the open road; "
            "netconvert -s OLD.net.xml --crossings.guess -o NEW.net.xml adds them"
        )
    if found.components > 1:
        yield f"{found.components} parts that no road connects"
    if found.centre is None and has_georeference(network):
        yield "where it lies is not shown: pip install 'cavsumo[osm]' brings pyproj"


def _version(text: str) -> tuple[int, int]:
    """A version of the network format as numbers."""
    major, minor = (*text.split("."), "0")[:2]
    return int(major), int(minor)
