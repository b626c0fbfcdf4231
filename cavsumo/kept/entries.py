"""Where the ego may enter later than it did: the lanes on which it was seen, outside junctions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path as FilePath
from typing import Any

from cavsumo.model.departures import Entry
from cavsumo.model.polyline import Path
from cavsumo.network.reader import lane_path, read_network

BESIDE_M = 0.3  # from the centre line of its lane; it changes lanes where it is farther away
ROOM_M = 0.1  # from both ends of a lane
TURNED = 0.2  # rad between the ego and its lane


class RouteLanes:
    """The lanes of the ego's route.

    Args:
        net: the network's file.
        edges: ids of the edges of the route.
    """

    def __init__(self, net: FilePath, edges: Sequence[str]) -> None:
        network = read_network(net)
        self._lanes = [
            (edge, index, lane_path([lane]), float(lane.getLength()))
            for edge, name in enumerate(edges)
            for index, lane in enumerate(network.edge(name).getLanes())
        ]

    def entry(self, ego: Sequence[float], length: float) -> Entry | None:
        """The entry of an ego with a state x, y, v, o, whose box has a length [m].

        None where it is on no lane of its route.
        """
        x, y, v, o = ego
        front = x + length / 2 * math.cos(o), y + length / 2 * math.sin(o)
        for edge, index, path, told in self._lanes:
            along = _along(path, front, o)
            if along is not None:
                return Entry(edge, index, along * told / path.length, v)
        return None


def _along(path: Path, front: tuple[float, float], o: float) -> float | None:
    """How far along a lane the ego's front bumper is [m]; None when it is not on it."""
    here = path.project(*front)
    if abs(here.lateral) > BESIDE_M or not ROOM_M < here.along < path.length - ROOM_M:
        return None
    turned = math.remainder(path.at(here.along)[2] - o, math.tau)
    return here.along if abs(turned) <= TURNED else None


def entries_at(
    lanes: RouteLanes, frames: Sequence[Mapping[str, Any]], length: float, every: int
) -> dict[int, Entry]:
    """The entries of the ego at every so many timesteps of a trace."""
    found = {i: lanes.entry(frames[i]["ego"], length) for i in range(every, len(frames), every)}
    return {step: entry for step, entry in found.items() if entry is not None}
