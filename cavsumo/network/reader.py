"""A SUMO network: lanes, pavements, crossings, carriageway.

Read with sumolib; ids are opaque and never parsed, lane 0 is not assumed to be for driving, and
no side of the road is taken for granted.
"""

from __future__ import annotations

import html
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon

from cavsumo.errors import NetworkError, UnknownName
from cavsumo.model.carriageway import Roads
from cavsumo.model.polyline import Path, Point
from cavsumo.network.net_file import read_net
from cavsumo.network.network_file import root_of

# Junction interiors leave slivers between the lanes that cross them; closing by this much [m]
# makes the carriageway one surface without reaching over a kerb.
CLOSING_M = 0.5


class Network:
    """A network file, read once.

    Attributes:
        file: the path.
        net: the sumolib network.
        root: the attributes of its <net>.
        edges: its normal edges, in the order of their ids.
    """

    def __init__(self, file: FilePath, net: Any, root: Mapping[str, str]) -> None:
        self.file = file
        self.net = net
        self.root = dict(root)
        self.edges: list[Any] = sorted(
            (e for e in net.getEdges() if is_normal(e)),
            key=lambda e: str(e.getID()),
        )
        self._pavements: tuple[list[Any], shapely.STRtree] | None = None

    def edge(self, edge_id: str) -> Any:
        """The normal edge of that id; raises UnknownName with the nearest one."""
        edges = {e.getID(): e for e in self.edges}
        if edge_id not in edges:
            raise UnknownName("edge", edge_id, edges, str(self.file))
        return edges[edge_id]

    def junction(self, junction_id: str) -> Any:
        """The junction of that id; raises UnknownName with the nearest one."""
        nodes = {n.getID(): n for n in self.net.getNodes() if n.getType() != "internal"}
        if junction_id not in nodes:
            raise UnknownName("junction", junction_id, nodes, str(self.file))
        return nodes[junction_id]

    @property
    def left_hand(self) -> bool:
        """Whether traffic keeps left."""
        return self.root.get("lefthand") in ("true", "1")

    def inside(self, function: str) -> list[Any]:
        """The edges inside junctions with that function, in the order of the file."""
        edges = self.net.getEdges(withInternal=True)
        return [edge for edge in edges if edge.getFunction() == function]

    def crossings(self) -> list[Any]:
        """The pedestrian crossings, which are edges inside junctions."""
        return self.inside("crossing")

    def crossed_by(self, crossing: Any) -> list[str]:
        """Ids of the edges that a crossing leads over."""
        return [str(edge.getID()) for edge in crossing.getCrossingEdges()]

    def crossed_edges(self) -> set[str]:
        """Ids of the edges that a pedestrian crossing leads over."""
        return {edge for crossing in self.crossings() for edge in self.crossed_by(crossing)}

    def crossing_surface(self) -> shapely.Geometry:
        """The surface of the marked pedestrian crossings."""
        return shapely.union_all(
            lane_areas([lane for edge in self.crossings() for lane in edge.getLanes()])
        )

    def pavements(self) -> Iterator[Any]:
        """The lanes for pedestrians only, along the edges, in the order of their ids."""
        for edge in self.edges:
            yield from (lane for lane in edge.getLanes() if is_pavement(lane))

    def pavements_near(self, line: LineString, reach_m: float) -> list[Any]:
        """The pavements within a distance of a line [m], in the order of their ids."""
        if self._pavements is None:
            lanes = list(self.pavements())
            self._pavements = lanes, shapely.STRtree(lane_axes(lanes))
        lanes, tree = self._pavements
        return [lanes[i] for i in sorted(tree.query(line, "dwithin", reach_m).tolist())]

    def ground(self, line: LineString, reach_m: float) -> shapely.Geometry:
        """All lanes, crossings and walking areas, as one surface, within a distance of a line [m].

        Lanes without a surface are left out, since no body can be on them.
        """
        insides = [e for kind in ("internal", "crossing") for e in self.inside(kind)]
        lanes = [
            lane
            for edge in (*self.edges, *insides)
            for lane in edge.getLanes()
            if len(lane.getShape()) > 1 and float(lane.getWidth()) > 0.0
        ]
        near = shapely.dwithin(lane_axes(lanes), line, reach_m).tolist()
        outlines = [edge.getLanes()[0].getShape() for edge in self.inside("walkingarea")]
        areas = [Polygon([p[:2] for p in points]) for points in outlines if len(points) > 2]
        surfaces = lane_areas([lane for lane, it_is in zip(lanes, near, strict=True) if it_is])
        surfaces += [area for area in areas if shapely.dwithin(area, line, reach_m)]
        return shapely.union_all(shapely.make_valid(surfaces))  # outlines may cut themselves

    def roads(self) -> Roads:
        """The carriageways, junctions included, and the axes of driving lanes and pavements."""
        driving = [lane for edge in self.edges for lane in driving_lanes(edge)]
        inside = [lane for edge in self.inside("internal") for lane in driving_lanes(edge)]
        surface = shapely.union_all(lane_areas(driving + inside))
        closed = surface.buffer(CLOSING_M, join_style="mitre").buffer(
            -CLOSING_M, join_style="mitre"
        )
        axes = (lane_axes(lanes).tolist() for lanes in (driving, list(self.pavements())))
        return Roads(closed.simplify(0.01), *axes)


def read_network(file: FilePath, *, foes: bool = False) -> Network:
    """Read a .net.xml or .net.xml.gz; raises NetworkError in one sentence for any other file.

    ``foes``: with the tables of right of way, which take long on large networks.
    """
    root_of(file)
    network = Network(file, *read_net(file, foes=foes))
    if not any(driving_lanes(edge) for edge in network.edges):
        raise NetworkError(f"network {str(file)!r}: holds no lane on which a car may drive")
    return network


def street(edge: Any) -> str:
    """The name of an edge's street, empty for none."""
    return html.unescape(str(edge.getName() or ""))  # netconvert escapes what is escaped


def is_normal(edge: Any) -> bool:
    """Whether an edge is a road, not the inside of a junction."""
    return edge.getFunction() in ("", "connector")


def driving_lanes(edge: Any) -> list[Any]:
    """The lanes of an edge on which a passenger car may drive, rightmost first."""
    return [lane for lane in edge.getLanes() if lane.allows("passenger")]


def is_pavement(lane: Any) -> bool:
    """Whether a lane is for pedestrians and not for cars."""
    return bool(lane.allows("pedestrian") and not lane.allows("passenger"))


def pavement_walk(edge: Any) -> tuple[str, ...]:
    """Ids of an edge and of another one with a pavement that begins at its end, if any.

    A person whose walk leads on through a junction survives ``moveToXY`` there; one whose walk
    ends with its edge crashes SUMO.
    """
    back = {
        e.getID() for e in edge.getToNode().getOutgoing() if e.getToNode() is edge.getFromNode()
    }
    onward = sorted(
        (e.getID() in back, str(e.getID()))
        for e in edge.getToNode().getOutgoing()
        if is_normal(e) and any(is_pavement(lane) for lane in e.getLanes())
    )
    return (str(edge.getID()), *(edge_id for _, edge_id in onward[:1]))


def lane_shape(lane: Any) -> list[Point]:
    """The axis of a lane [m]."""
    return [(float(p[0]), float(p[1])) for p in lane.getShape()]


def lane_axes(lanes: Sequence[Any]) -> np.ndarray[Any, Any]:
    """The axes of lanes as lines, all at once for speed."""
    shapes = [lane_shape(lane) for lane in lanes]
    if not shapes:
        return np.empty(0, dtype=object)
    owners = np.repeat(np.arange(len(shapes)), [len(shape) for shape in shapes])
    return np.asarray(shapely.linestrings(np.concatenate(shapes), indices=owners))


def lane_path(lanes: Sequence[Any]) -> Path:
    """The centre line through lanes that follow each other."""
    return Path(point for lane in lanes for point in lane_shape(lane))


def lane_areas(lanes: Sequence[Any]) -> list[shapely.Geometry]:
    """The surfaces of lanes, all at once for speed; ValueError when one has none."""
    for lane in lanes:
        if not float(lane.getWidth()) > 0.0:
            raise ValueError(f"lane {lane.getID()!r} has the width {lane.getWidth()}")
        if len(lane.getShape()) < 2:
            raise ValueError(f"lane {lane.getID()!r} has a shape of fewer than two points")
    if not lanes:
        return []
    halves = [float(lane.getWidth()) / 2 for lane in lanes]
    return list(shapely.buffer(lane_axes(lanes), halves, cap_style="flat", join_style="mitre"))


def interior(network: Network, link: Any) -> list[Any]:
    """The lanes inside a junction that a connection leads over."""
    lanes: list[Any] = []
    while link is not None and link.getViaLaneID():
        via = network.net.getLane(link.getViaLaneID())
        lanes.append(via)
        onward = via.getOutgoing()
        link = onward[0] if onward else None
    return lanes
