"""The cases of the suite ``ast-crosswalk``: each draw is one vector of ``model.crosswalk``."""

from __future__ import annotations

Points = list[list[float]]


def points(y_m: float, walk_mps: float, draw: float, lane_y_m: float) -> Points:
    """The pedestrian's places, every 0.1 s.

    Args:
        y_m, walk_mps: where it starts, from the middle of the ego's lane, and how fast [m, m/s].
        draw: number of the draw.
        lane_y_m: the middle of the lane in the network [m].
    """
    from cavsumo.model import crosswalk  # loads numpy, which a list of suites need not

    start = crosswalk.CrosswalkStart(y_m, walk_mps)
    pushes = crosswalk.normals(int(draw))[0, :, :2] * crosswalk.DEVIATIONS[:2]
    return [[float(x), float(y) + lane_y_m] for x, y in crosswalk.walked(start, pushes)]


def errors(draw: float) -> Points:
    """The errors of its measured places; none before the first timestep."""
    from cavsumo.model import crosswalk

    drawn = crosswalk.normals(int(draw))[0, :, 2:] * crosswalk.DEVIATIONS[2:]
    return [[0.0, 0.0], *drawn.tolist()]
