"""Tracks of all bodies of a trace, as formats of others need them.

The position of a body is the middle of its box here. Others refer to a point of the body: the
middle of the rear axle of a vehicle, half a wheelbase behind.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate, pairwise
from typing import NamedTuple

from cavsumo.model.bodies import BICYCLE, BUS, PEDESTRIAN
from cavsumo.results.traces import Shape, Trace, last_stood, states

HEIGHT_M = {PEDESTRIAN.name: 1.7, BICYCLE.name: 1.7, BUS.name: 3.2}
CAR_HEIGHT_M = 1.5


class TrackPoint(NamedTuple):
    """A body at a time."""

    time: float  # s
    x: float  # m
    y: float  # m
    heading: float  # rad, without jumps
    speed: float  # m/s


Track = Sequence[TrackPoint]


class Stays(NamedTuple):
    """A body with its tracks: one for each time that it is there.

    Attributes:
        part: ego, tester or background.
        name: its id.
        shape: its box.
        tracks: of the middle of its box, one moment a timestep.
        late, early: whether it is not there at the beginning, or at the end.
    """

    part: str
    name: str
    shape: Shape
    tracks: Sequence[Track]
    late: bool
    early: bool


def stays(trace: Trace) -> list[Stays]:
    """All bodies with their tracks, in the order of their appearance."""
    shapes, found, parts = trace.shapes(), dict[str, list[list[TrackPoint]]](), dict[str, str]()
    last = dict[str, int]()
    for i, frame in enumerate(trace.frames):
        for part, name, (x, y, v, o) in states(frame):
            tracks = found.setdefault(name, [])
            parts[name] = part
            if last.get(name) != i - 1 or not tracks:
                tracks.append([])
            if tracks[-1]:
                before = tracks[-1][-1].heading
                o = before + math.remainder(o - before, math.tau)
            tracks[-1].append(TrackPoint(frame["time_s"], x, y, o, v))
            last[name] = i
    first, end = (trace.frames[i]["time_s"] for i in (0, -1))
    return [
        Stays(parts[name], name, shapes[name], tracks, tracks[0][0].time > first,
              tracks[-1][-1].time < end)
        for name, tracks in found.items()
    ]  # fmt: skip


def axle(shape: Shape) -> float:
    """How far the rear axle lies behind the middle of a body, within its box [m]."""
    if shape.kind == PEDESTRIAN.name:
        return 0.0
    return min(shape.wheelbase, shape.length) / 2.0


def at_axle(shape: Shape, track: Track) -> list[TrackPoint]:
    """A track of the rear axle."""
    return moved(track, -axle(shape))


def moved(track: Track, ahead: float) -> list[TrackPoint]:
    """A track of a point that lies so far ahead [m] of the one given."""
    return [
        one._replace(
            x=one.x + ahead * math.cos(one.heading), y=one.y + ahead * math.sin(one.heading)
        )
        for one in track
    ]


def height(shape: Shape) -> float:
    """The height of a body, which is nowhere recorded [m]."""
    return HEIGHT_M.get(shape.kind, CAR_HEIGHT_M)


def driven(track: Track) -> list[float]:
    """How far a body has come at each moment [m]."""
    steps = (math.dist(a[1:3], b[1:3]) for a, b in pairwise(track))
    return list(accumulate(steps, initial=0.0))


def set_off(track: Track) -> int | None:
    """The moment from which on a body does not stand any more; None if it never stood."""
    return last_stood(one.speed for one in track)
