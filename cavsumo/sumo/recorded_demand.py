"""Departures that were recorded, as a route file that makes SUMO insert the very same bodies.

Each body is written for itself: its exact place, speed and speed factor at the exact time. SUMO's
drivers and walkers draw their later random numbers from generators of the lanes that they are on,
so the same bodies in the same places draw the same numbers, from any demand.

Departures do not tell all that a route file may ask for (stops, rides, where a trip ends on its
last edge, ...). Of a demand that holds more than is listed here none are recorded.
"""

from __future__ import annotations

import gzip
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

from cavsumo.model.departures import Attributes, Demand, Trip, Walk

_DEPARTS = "id type depart departLane departPos departSpeed speedFactor color"
_FLOWS = "begin end number period probability perHour vehsPerHour personsPerHour"
# The elements of a demand that departures tell in full, with their attributes.
TOLD = {
    tag: frozenset(attributes.split())
    for tag, attributes in {
        "vehicle": f"{_DEPARTS} route",
        "trip": f"{_DEPARTS} from to",
        "flow": f"{_DEPARTS} {_FLOWS} route from to",
        "person": _DEPARTS,
        "personFlow": f"{_DEPARTS} {_FLOWS}",
        "walk": "from to edges arrivalPos",
        "route": "id edges color probability",
        "routeDistribution": "id routes probabilities",
        "vTypeDistribution": "id vTypes probabilities",
    }.items()
}
TYPE = "vType"  # all its attributes are told, but not its children
PICTURES = frozenset({"imgFile", "osgFile"})  # files of the viewer, which change no traffic
ENTERING = frozenset(
    {"vehicle", "trip", "flow", "person", "personFlow", "container", "containerFlow", "include"}
)


def types_told(routes: Path | None, additional: Iterable[Path]) -> dict[str, Attributes] | None:
    """The vehicle types of a demand by id; None when departures would not tell all of it.

    Args:
        routes: the route file, if there is one.
        additional: SUMO's additional files, from which nobody may enter.
    """
    try:
        if any(element.tag in ENTERING for file in additional for element in elements(file)):
            return None
        return _types(elements(routes)) if routes is not None else {}
    except (ElementTree.ParseError, ValueError, LookupError):
        return None  # SUMO reads it and Python does not


def _types(elements: Iterable[Any]) -> dict[str, Attributes] | None:
    """The vehicle types among the elements of a demand; None when one says more than is told."""
    types: dict[str, Attributes] = {}
    for element in elements:
        attributes = dict(element.attrib)
        if element.tag == TYPE and not len(element):
            name = attributes.pop("id", "")
            types[name] = {k: v for k, v in attributes.items() if k not in PICTURES}
        elif element.tag not in TOLD or not TOLD[element.tag] >= attributes.keys():
            return None
    return types


def elements(file: Path) -> Iterator[Any]:
    """All elements of a file below its root, each once it is complete; the file may be packed."""
    with gzip.open(file) if file.suffix == ".gz" else file.open("rb") as stream:
        events = ElementTree.iterparse(stream, events=("start", "end"))
        _, root = next(events)
        for event, element in events:
            if event == "end" and element is not root:
                yield element
                if element.tag in ENTERING:  # of which a file has many
                    element.clear()


def route_file(demand: Demand) -> str:
    """The text of a route file in which everybody departs as recorded, in the order of times."""
    types = (f"    <vType {_written({'id': i, **a})}/>\n" for i, a in demand.types.items())
    bodies = sorted(
        [
            *((t.time, _vehicle(t)) for t in demand.trips),
            *((w.time, _person(w)) for w in demand.walks),
        ],
        key=lambda body: body[0],
    )
    return "".join(["<routes>\n", *types, *(text for _, text in bodies), "</routes>\n"])


def _vehicle(trip: Trip) -> str:
    """The XML of a vehicle."""
    attributes = {
        "id": trip.id,
        "type": trip.type,
        "depart": f"{trip.time:.3f}",
        "departLane": str(trip.lane),
        "departPos": repr(trip.along),
        "departSpeed": repr(trip.speed),
        "speedFactor": repr(trip.factor),
        "insertionChecks": "none",  # it was let in; a second check might round otherwise
    }
    route = f"<route edges={quoteattr(' '.join(trip.edges))}/>"
    return f"    <vehicle {_written(attributes)}>{route}</vehicle>\n"


def _person(walk: Walk) -> str:
    """The XML of a person."""
    attributes = {
        "id": walk.id,
        "type": walk.type,
        "depart": f"{walk.time:.3f}",
        "departPos": repr(walk.along),
        "speedFactor": repr(walk.factor),
    }
    walks = (
        f"<walk edges={quoteattr(' '.join(stage.edges))} arrivalPos={quoteattr(repr(stage.end))}/>"
        for stage in walk.stages
    )
    return f"    <person {_written(attributes)}>{''.join(walks)}</person>\n"


def _written(attributes: Attributes) -> str:
    """Attributes as XML."""
    return " ".join(f"{name}={quoteattr(value)}" for name, value in attributes.items())
