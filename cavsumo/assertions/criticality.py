"""Thresholds of criticality metrics: TTC, DRAC, PET (surrogate safety measures).

The thresholds are the defaults of SUMO's SSM device, which measures vehicles only; here bodies are
boxes on the plane, so that pedestrians count (``metrics.plane``, ``metrics.encroachment``). Only
testers count, because background traffic on other lanes is on a collision course at every bend.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from cavsumo.assertions.base import ASSERTIONS
from cavsumo.assertions.contacts import STANDING_MPS
from cavsumo.assertions.margin import Margin, MarginAssertion
from cavsumo.assertions.metrics.encroachment import Moves, moves, spells
from cavsumo.assertions.metrics.plane import drac_boxes, ttc_boxes
from cavsumo.model.checks import number
from cavsumo.model.geometry import Box
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

Metric = Callable[..., NDArray[np.float64]]
Moment = tuple[float, Box]  # where a body was when
COURSE_S = 10.0  # a body that would meet the ego later than this is on no collision course
FIRM = 100.0  # m/s2; deceleration to avoid a contact that is there already
CROSSING_RAD = math.radians(30.0)  # courses that meet at less do not cross


def _velocity(state: BodyState) -> tuple[float, float]:
    return state.v * math.cos(state.o), state.v * math.sin(state.o)


def _near(snapshot: Snapshot) -> list[BodyState]:
    """The testers that could meet the moving ego within ``COURSE_S``."""
    ego = snapshot.ego
    if ego.v <= STANDING_MPS:
        return []
    return [
        t
        for t in snapshot.testers
        if math.hypot(t.x - ego.x, t.y - ego.y)
        <= ego.body.kind.reach + t.body.kind.reach + (ego.v + t.v) * COURSE_S
    ]


def measured(metric: Metric, snapshot: Snapshot) -> Iterator[Margin]:
    """A metric of the moving ego and each tester that could meet it."""
    near, ego = _near(snapshot), snapshot.ego
    if near:
        boxes, velocities = [t.box for t in near], [_velocity(t) for t in near]
        values = metric(ego.box, _velocity(ego), boxes, velocities)
        yield from zip([t.id for t in near], map(float, values), strict=True)


@ASSERTIONS.register("ttc")
class TtcAssertion(MarginAssertion):
    """The time to collision with a tester stays above 3 s (Hayward 1972; SUMO's SSM device).

    Precondition: at constant velocities the moving ego would touch a tester within 10 s. Violated
    by less than ``least_s``. Robustness: smallest TTC less ``least_s`` [s]. Bodies: testers.
    """

    name: ClassVar[str] = "ttc"
    unit: ClassVar[str] = "s"
    sees_background = False
    PARAMETERS: ClassVar[Mapping[str, str]] = {"least_s": "smallest time to collision [s]"}

    def __init__(self, least_s: float = 3.0) -> None:
        self.least_s = number("least_s", least_s, 0.0, COURSE_S)

    def margins(self, snapshot: Snapshot, before: Snapshot | None) -> Iterator[Margin]:
        for who, ttc in measured(ttc_boxes, snapshot):
            if ttc <= COURSE_S:
                yield who, ttc - self.least_s


@ASSERTIONS.register("drac")
class DracAssertion(MarginAssertion):
    """The deceleration to avoid a tester stays below 3 m/s2 (Guido et al. 2011; SUMO's SSM device).

    Precondition: as for ttc. Violated by more than ``most``. Robustness: ``most`` less the largest
    DRAC [m/s2], which is 100 m/s2 at contact. Bodies: testers.
    """

    name: ClassVar[str] = "drac"
    unit: ClassVar[str] = "m/s2"
    sees_background = False
    PARAMETERS: ClassVar[Mapping[str, str]] = {"most": "largest deceleration to need [m/s2]"}

    def __init__(self, most: float = 3.0) -> None:
        self.most = number("most", most, 0.0, FIRM)

    def margins(self, snapshot: Snapshot, before: Snapshot | None) -> Iterator[Margin]:
        for who, drac in measured(drac_boxes, snapshot):
            if drac > 0.0:
                yield who, self.most - min(drac, FIRM)


@ASSERTIONS.register("pet")
class PetAssertion(MarginAssertion):
    """The ego and a tester cross the same place at least 2 s apart (Allen et al. 1978; SUMO's SSM).

    Precondition: one of them enters an area that both sweep and that the other left at most 10 s
    before, on ways that cross by at least 30 degrees. Violated by a post-encroachment time below
    ``least_s``. Robustness: smallest PET less ``least_s`` [s]. Bodies: testers. Either body may be
    first: a tester that steps in behind the ego also counts. The extent of the area is known only
    as the second body moves on, so the time can decrease after it has entered.
    """

    name: ClassVar[str] = "pet"
    unit: ClassVar[str] = "s"
    sees_background = False
    PARAMETERS: ClassVar[Mapping[str, str]] = {"least_s": "smallest post-encroachment time [s]"}

    def __init__(self, least_s: float = 2.0) -> None:
        self.least_s = number("least_s", least_s, 0.0, COURSE_S)

    def reset(self, scene: Scene) -> None:
        super().reset(scene)
        self._tracks: dict[str, deque[Moment]] = {}
        self._inside: dict[tuple[str, str], tuple[float, float]] = {}

    def margins(self, snapshot: Snapshot, before: Snapshot | None) -> Iterator[Margin]:
        ego = snapshot.ego
        for state in (ego, *snapshot.testers):
            self._note(snapshot.time, state)
        for tester in snapshot.testers:
            found = self._pet(ego.id, tester.id), self._pet(tester.id, ego.id)
            times = [time for time in found if time <= COURSE_S]
            if times:
                yield tester.id, min(times) - self.least_s

    def _note(self, now: float, state: BodyState) -> None:
        """Add to a body's track; while it stands only the first and the last timestep are kept."""
        track = self._tracks.setdefault(state.id, deque())
        box = state.box
        if len(track) > 1 and track[-1][1] == track[-2][1] == box:
            track.pop()
        track.append((now, box))
        while len(track) > 2 and track[1][0] < now - COURSE_S:
            track.popleft()

    def _pet(self, second: str, first: str) -> float:
        """Time between one body's leaving an area and another's entering it, in which that one is
        now [s].

        Infinite if it is in no area that the other has left.
        """
        latest = list(self._tracks[second])[-2:]
        past = _passing(latest, self._tracks[first])
        met = spells(_moves(latest), _moves(past), CROSSING_RAD) if past else None
        if met is None:
            self._inside.pop((second, first), None)
            return math.inf
        entered, left = self._inside.get((second, first), (met.enters, -math.inf))
        left = max(left, met.other_leaves)
        self._inside[second, first] = entered, left
        return max(0.0, entered - left)


def _passing(latest: Sequence[Moment], track: Iterable[Moment]) -> list[Moment]:
    """The contiguous part of a track with all its pieces near the latest moments."""
    (_, before), (_, box) = latest[0], latest[-1]
    own = 0.5 * (box.length + box.width) + math.dist(before[:2], box[:2])
    near = []
    moments = list(track)
    for i, ((_, one), (_, two)) in enumerate(pairwise(moments)):
        reach = own + 0.5 * (one.length + one.width)
        near_x = abs(one.x - box.x) <= reach + abs(two.x - one.x)
        if near_x and abs(one.y - box.y) <= reach + abs(two.y - one.y):
            near.append(i)
    return moments[near[0] : near[-1] + 2] if near else []


def _moves(moments: Sequence[Moment]) -> Moves:
    """A piece of a track as the metrics have it."""
    times, boxes = zip(*moments, strict=True)
    return moves(times, boxes)
