"""A pedestrian's decisions: once a second a heading and a speed, from when the ego is so near.

A sequence of decisions can be continued from any of them, so searches that look for a good next
decision vary it (``searchers.tree``, ``searchers.explore``). The walk notes the situation in which
each decision is taken, by which those searches know situations again.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from cavsumo.agents.avoidance import Avoidance
from cavsumo.agents.planning.coordinates import meeting
from cavsumo.agents.programme import BEYOND_M, ROUND_M
from cavsumo.agents.walking import ApproachKerb, walk
from cavsumo.model.bodies import Action
from cavsumo.model.kinematics import wrap
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

DECISION_S = 1.0
SLOWEST_MPS = 1.0  # a slower ego counts as so fast
GAP_M, CLOSING_MPS, ASIDE_M = 4.0, 2.0, 0.75  # situations within these are one
MOST_GAPS = 15  # a larger gap counts as so many of ``GAP_M``

Situation = tuple[int, int, int]


def written(situations: Sequence[Situation]) -> str:
    """Situations as the text of a cell of results."""
    return " ".join("/".join(map(str, one)) for one in situations)


def read(text: str) -> list[Situation]:
    """The situations of such a text."""
    found = []
    for word in text.split():
        gap, closing, aside = map(int, word.split("/"))
        found.append((gap, closing, aside))
    return found


class Decision(NamedTuple):
    """A heading, relative to the way straight across as in ``agents.programme`` [rad], and a speed.

    A speed of 0 is to stand [m/s].
    """

    heading: float
    speed: float


class Decisions(NamedTuple):
    """The decisions of one pedestrian.

    Attributes:
        arrival: they begin when the ego is so near to where their ways meet, in the time that it
            needs for it [s].
        chosen: the decisions; the last one holds until the body has left the road.
    """

    arrival: float
    chosen: Sequence[Decision]


class DecidedWalk:
    """One pedestrian that follows its decisions, in one episode.

    Attributes:
        situations: in which they were taken so far.
    """

    def __init__(self, scene: Scene, index: int, decisions: Decisions) -> None:
        self.scene, self.index, self.decisions = scene, index, decisions
        self.situations: list[Situation] = []
        self._met = meeting(scene, index)
        self._idle = ApproachKerb(scene, index)
        self._avoidance = Avoidance(scene, index)
        self._begun, self._entered, self._gone = math.inf, False, False
        if self._met is not None:
            _, _, ahead = scene.ego_path.at(self._met.along)
            self._side = math.copysign(1.0, math.sin(ahead - self._met.way.heading))

    def action(self, snapshot: Snapshot, state: BodyState) -> Action:
        """The next action."""
        if self._met is None or not self._begins(snapshot):
            return self._avoidance.along(snapshot, state, self._idle.action(state))
        heading, speed = self._decided(snapshot, state)
        if speed == 0.0 or self._off(state):
            heading, speed = state.o, 0.0
        wanted = walk(state, heading, speed, self.scene.dt)
        return self._avoidance.across(snapshot, state, wanted, heading)

    def reach(self, snapshot: Snapshot, state: BodyState) -> float:
        """How far the body may come from where it is, detours around others apart [m]."""
        if self._met is None:
            return ROUND_M + self._idle.left(state)
        way, chosen = self._met.way, self.decisions.chosen[max(0, len(self.situations) - 1) :]
        ahead = DECISION_S * sum(speed for _, speed in chosen)
        if math.isinf(self._begun):
            ahead += self._idle.left(state)
        heading, speed = chosen[-1]
        if speed > 0.0:
            across = way.leave - way.enter + 2.0 * BEYOND_M
            ahead += across / max(1e-9, abs(math.cos(heading)))
        left = max(0.0, self.scene.horizon - snapshot.time)
        return ROUND_M + min(ahead, state.body.kind.v_max * left)

    def _begins(self, snapshot: Snapshot) -> bool:
        """Whether the decisions have begun."""
        if math.isinf(self._begun) and snapshot.sees_ego:
            assert self._met is not None
            v = max(SLOWEST_MPS, snapshot.ego.v)
            if self._met.along - self.scene.ego_progress(snapshot) <= self.decisions.arrival * v:
                self._begun = snapshot.time
        return snapshot.time >= self._begun

    def _decided(self, snapshot: Snapshot, state: BodyState) -> tuple[float, float]:
        """Heading [rad] and speed [m/s] of the decision that holds now."""
        assert self._met is not None
        since = math.floor((snapshot.time - self._begun) / DECISION_S + 1e-9)
        number = min(since, len(self.decisions.chosen) - 1)
        while number >= len(self.situations):
            self.situations.append(self._situation(snapshot, state))
        turn, speed = self.decisions.chosen[number]
        return wrap(self._met.way.heading + self._side * turn), speed

    def _off(self, state: BodyState) -> bool:
        """Whether the body has been on the road and left it, on either side."""
        assert self._met is not None
        way = self._met.way
        there = way.progress(state.x, state.y)
        self._entered |= there > way.enter
        outside = there < way.enter - BEYOND_M or there > way.leave + BEYOND_M
        self._gone |= self._entered and outside
        return self._gone

    def _situation(self, snapshot: Snapshot, state: BodyState) -> Situation:
        """The gap along the ego's path, the closing speed, and the place beside the path."""
        scene, ego = self.scene, snapshot.ego
        here = scene.ego_path.project(state.x, state.y)
        gap = here.along - scene.ego.kind.length / 2 - scene.ego_progress(snapshot)
        closing = ego.v - state.v * math.cos(state.o - scene.ego_path.at(here.along)[2])
        return (
            min(MOST_GAPS, math.floor(gap / GAP_M)),
            math.floor(closing / CLOSING_MPS),
            math.floor(self._side * here.lateral / ASIDE_M),
        )
