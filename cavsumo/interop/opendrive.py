"""The roads of a network as OpenDRIVE 1.7, made by netconvert, then mended.

netconvert calls its output 1.4 and writes parts of later versions. The result here is valid by the
schema of 1.7 and has none of the errors that ``asam-qc-opendrive`` names: objects have a height
above the road, controllers are there once, curves have their arc lengths, and connecting roads
join their lanes (``plan_view``). In networks of left-hand traffic netconvert numbers the lanes of
connecting roads from the right and calls them left ones; they are right ones here.

Every edge is a road of one direction, in the coordinates of the network; its lanes lie to the
right of its reference line. So traffic keeps left where the network says so, by where the roads
lie. The header's offset leads to the coordinates of the projection.
"""

from __future__ import annotations

import datetime
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from cavsumo.errors import InputError
from cavsumo.interop.plan_view import join, set_lengths
from cavsumo.network.osm.netconvert import in_comment, netconvert, netconvert_version

XODR = "test.xodr"
MINOR = "7"  # of the version of OpenDRIVE
UNDATED = datetime.datetime(2000, 1, 1)  # so that the same test gives the same bytes


def roads_of(net: Path, notice: str) -> str:
    """The roads of a network as OpenDRIVE, without paths of this machine, and without a date.

    Args:
        net: the network's file.
        notice: the attribution that the map's licence requires.

    Raises InputError when netconvert refuses the network.
    """
    with TemporaryDirectory(prefix="cavsumo-") as work:
        try:
            netconvert([f"sumo-net-file={net.resolve()}", f"opendrive-output={XODR}"], Path(work))
        except InputError as error:
            raise InputError(f"{net.name}: no OpenDRIVE can be made of it: {error}") from error
        root = ET.parse(Path(work) / XODR).getroot()
    mend(root)
    made = f"made by netconvert {netconvert_version()} from {in_comment(net.name)}, and mended"
    lines = [f"<!-- {made}", *([f"    {in_comment(notice)}"] if notice else []), "-->"]
    ET.indent(root)
    body = ET.tostring(root, encoding="unicode")
    return "\n".join(['<?xml version="1.0" encoding="UTF-8"?>', *lines, body, ""])


def mend(root: ET.Element) -> None:
    """Mend a document of netconvert, see above."""
    header = root.find("header")
    assert header is not None
    header.set("revMinor", MINOR)
    header.set("date", f"{UNDATED:%Y-%m-%dT%H:%M:%S}")
    for reference in header.findall("geoReference"):
        reference.text = (reference.text or "").strip()
    for thing in root.iter("object"):
        thing.set("zOffset", thing.get("zOffset", "0"))
    for section in root.iter("laneSection"):
        _set_side(section)
    _unite_controllers(root)
    roads = {str(road.get("id")): road for road in root.iter("road")}
    for road in _connecting(root):
        join(road, roads)
    for road in roads.values():
        set_lengths(road)


def _connecting(root: ET.Element) -> Iterator[ET.Element]:
    """The roads through junctions."""
    return (road for road in root.iter("road") if road.get("junction") != "-1")


def _set_side(section: ET.Element) -> None:
    """Call lanes with negative numbers right ones, behind the middle one."""
    left = section.find("left")
    if left is not None and all(int(str(lane.get("id"))) < 0 for lane in left):
        section.remove(left)
        left.tag = "right"
        section.append(left)


def _unite_controllers(root: ET.Element) -> None:
    """Let controllers with the same id be one."""
    met = dict[str, ET.Element]()
    for controller in root.findall("controller"):
        first = met.setdefault(str(controller.get("id")), controller)
        if first is not controller:
            first.extend(list(controller))
            root.remove(controller)
