"""The starting areas of jaywalkers: all places beside the carriageway along the ego's path."""

from __future__ import annotations

import shapely
from shapely.geometry import LineString

from cavsumo.errors import NetworkError
from cavsumo.model.carriageway import Roads
from cavsumo.model.polyline import Path
from cavsumo.network.pedestrian_starts import NEAR_M, StartingArea, stretches, ways_across
from cavsumo.network.reader import Network, lane_shape, pavement_walk

STRIP_M = 2.5  # width of the strip along the carriageway on which they start; holds a bicycle
LEAST_M = 1.0  # shorter pieces of it are left out
ROUND_M = 0.05  # the outline is simplified by this much


def kerb_areas(network: Network, roads: Roads, ego_path: Path) -> tuple[StartingArea, ...]:
    """The strips beside the carriageway near the ego's path whose way across the road meets it.

    Raises NetworkError when there is none.
    """
    line = LineString(ego_path.points)
    outline = shapely.buffer(roads.carriageway, STRIP_M / 2).boundary
    near = shapely.line_merge(shapely.intersection(outline, line.buffer(NEAR_M)))
    walk = _walk(network, line)
    shapely.prepare(line)
    areas = [
        area
        for axis in map(_axis, getattr(near, "geoms", [near]))
        if axis is not None
        for area in stretches(
            axis, STRIP_M, walk, shapely.intersects(line, ways_across(axis, roads)).tolist()
        )
    ]
    if not areas:
        raise NetworkError(
            f"{network.file}: nobody beside the road can cross the ego's route; choose another "
            "with --ego-route or --junction"
        )
    return tuple(areas)


def _axis(piece: shapely.Geometry) -> Path | None:
    """A piece of the outline as a path, None if it is too short."""
    if piece.geom_type != "LineString" or piece.length < LEAST_M:
        return None
    return Path(piece.simplify(ROUND_M).coords)


def _walk(network: Network, line: LineString) -> tuple[str, ...]:
    """Edges along which SUMO may believe its persons to walk, none where there is no pavement."""
    near = network.pavements_near(line, NEAR_M)
    if not near:
        return ()
    nearest = min(near, key=lambda lane: LineString(lane_shape(lane)).distance(line))
    return pavement_walk(nearest.getEdge())
