"""The roads of an OpenStreetMap extract, found in it and written without mappers' names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple, TextIO
from xml.sax.saxutils import quoteattr

from cavsumo.errors import InputError
from cavsumo.network.osm.items import Item, read_items

Box = tuple[float, float, float, float]  # west, south, east, north [degrees]
# Tracks are not driven on, but they divide the roads that they cross or lie in.
TRACKS = frozenset({"highway", "railway"})
SIDES, COUNTRIES = ("left", "right"), ("addr:country", "is_in:country_code")
# Tags whose values begin with the code of the country that made the rule.
RULES = ("traffic_sign", "source:maxspeed", "maxspeed:type", "zone:traffic", "zone:maxspeed")


@dataclass
class RoadExtract:
    """The items of an extract that belong to its roads, and the hints to its location.

    Attributes:
        nodes, ways: ids of the items to keep.
        bounds: west, south, east, north of all nodes [degrees]; None without any.
        hints: number of occurrences of each tag that indicates the country or the side of traffic.
    """

    nodes: set[int] = field(default_factory=set)
    ways: set[int] = field(default_factory=set)
    bounds: Box | None = None
    hints: Counter[tuple[str, str]] = field(default_factory=Counter)


def parse_box(text: str) -> Box:
    """The box W,S,E,N of a command line."""
    try:
        west, south, east, north = (float(word) for word in text.split(","))
    except ValueError:
        raise InputError(
            f"--bbox: expected four numbers W,S,E,N in degrees, got {text!r}"
        ) from None
    if not (-180 <= west < east <= 180 and -90 <= south < north <= 90):
        raise InputError(
            f"--bbox {text}: expected west < east and south < north, in degrees (longitude, "
            "latitude, longitude, latitude)"
        )
    return west, south, east, north


def find_roads(file: Path, box: Box | None) -> RoadExtract:
    """The roads of an extract, whole, that touch the box; raises InputError when there are none.

    Read twice, because nodes may stand before the ways that use them or behind (Overpass), and
    only those of roads and tracks are kept.
    """
    found = RoadExtract()
    tracks = _tracks(file, found)
    if not any(track.is_road for track in tracks):
        raise InputError(f"extract {str(file)!r}: holds no roads (no way has the tag highway)")
    inside = _nodes_within(file, {ref for track in tracks for ref in track.refs}, box)
    near = False
    for track in tracks:
        if not inside.isdisjoint(track.refs):
            found.ways.add(track.id)
            found.nodes.update(track.refs)
            near = near or track.is_road
    if not near:
        raise InputError(f"extract {str(file)!r}: {_off_the_data(box, found.bounds)}")
    return found


class _Track(NamedTuple):
    """A road or track: its way's id, its nodes, and whether it is a road."""

    id: int
    refs: tuple[int, ...]
    is_road: bool


def _tracks(file: Path, found: RoadExtract) -> list[_Track]:
    """The roads and tracks of an extract; hints to its location are added to ``found``."""
    tracks = []
    for item in read_items(file):
        _note_hints(item, found.hints)
        if item.kind == "node":
            found.bounds = _widened(found.bounds, float(item.lon), float(item.lat))
        elif item.kind == "way" and not TRACKS.isdisjoint(item.tags):
            tracks.append(_Track(item.id, item.refs, "highway" in item.tags))
    return tracks


def _nodes_within(file: Path, wanted: Container[int], box: Box | None) -> set[int]:
    """The required nodes that exist and lie in the box, if there is one."""
    return {
        item.id
        for item in read_items(file)
        if item.kind == "node"
        and item.id in wanted
        and _within((float(item.lon), float(item.lat)), box)
    }


def _widened(bounds: Box | None, lon: float, lat: float) -> Box:
    """The bounds with one more place in them."""
    west, south, east, north = bounds or (lon, lat, lon, lat)
    return min(west, lon), min(south, lat), max(east, lon), max(north, lat)


def _within(place: tuple[float, float], box: Box | None) -> bool:
    """Whether a place lies in the box, if there is one."""
    return box is None or (box[0] <= place[0] <= box[2] and box[1] <= place[1] <= box[3])


def write_roads(file: Path, roads: RoadExtract, target: TextIO) -> None:
    """Write the roads found in an extract as OSM XML, with whole turn restrictions.

    Nodes come first, wherever they stand in the extract: netconvert finds no others.
    """
    behind: list[Item] = []
    target.write(
        '<?xml version="1.0" encoding="UTF-8"?>\n<osm version="0.6" generator="cavsumo">\n'
    )
    for item in read_items(file):
        if _is_kept(item, roads):
            if item.kind == "node":
                target.writelines(_xml(item))
            else:
                behind.append(item)
    for item in behind:
        target.writelines(_xml(item))
    target.write("</osm>\n")


def _is_kept(item: Item, roads: RoadExtract) -> bool:
    """Whether an item belongs to the roads: one of them, its nodes, a whole turn restriction."""
    if item.kind == "node":
        return item.id in roads.nodes
    if item.kind == "way":
        return item.id in roads.ways
    kept = {"node": roads.nodes, "way": roads.ways}
    whole = bool(item.members) and all(ref in kept.get(kind, ()) for kind, ref, _ in item.members)
    return whole and item.tags.get("type") == "restriction"


def _xml(item: Item) -> Iterator[str]:
    """The lines of an item."""
    place = f' lat="{item.lat}" lon="{item.lon}"' if item.kind == "node" else ""
    yield f'<{item.kind} id="{item.id}"{place}>\n'
    for ref in item.refs:
        yield f'<nd ref="{ref}"/>\n'
    for kind, ref, role in item.members:
        yield f'<member type="{kind}" ref="{ref}" role={quoteattr(role)}/>\n'
    for key, value in item.tags.items():
        yield f"<tag k={quoteattr(key)} v={quoteattr(value)}/>\n"
    yield f"</{item.kind}>\n"


def _note_hints(item: Item, hints: Counter[tuple[str, str]]) -> None:
    """Count the tags that tell the side of the road or the country."""
    for key, value in item.tags.items():
        if (key == "driving_side" and value in SIDES) or (key in COUNTRIES and _is_code(value)):
            hints[key, value] += 1
        elif key in RULES and value[2:3] == ":" and _is_code(value[:2]):  # GB:nsl, DE:274.1
            hints[key, value[:2]] += 1


def _is_code(text: str) -> bool:
    """Whether a text may be the code of a country."""
    return len(text) == 2 and text.isascii() and text.isalpha()


def _off_the_data(box: Box | None, bounds: Box | None) -> str:
    """The reason why no road was found."""
    if box is None or bounds is None:
        return "none of its roads has a node in it: the extract is incomplete"
    reach = ",".join(f"{x:.4f}" for x in bounds)
    turned = (box[1], box[0], box[3], box[2])
    swapped = all(
        low <= x <= high
        for low, x, high in zip(bounds[:2] * 2, turned, bounds[2:] * 2, strict=True)
    )
    hint = "; are latitude and longitude swapped?" if swapped else ""
    asked = ",".join(f"{x:g}" for x in box)
    return f"no road touches the box {asked}; the data is within {reach}{hint}"
