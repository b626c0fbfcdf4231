"""Conditions of a storyboard: when they began to hold, foreseen within the next two timesteps.

Every condition has a margin m(t), which is positive while it holds. If it does not hold at t and
the margin grew from m(t - dt) to m(t), it will hold at::

    t + dt (0 - m(t)) / (m(t) - m(t - dt))

which is exact for quantities that change evenly. Delays are added to the moments.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from cavsumo.model.geometry import gap, in_frame
from cavsumo.model.scenario.storyboard import StoryCondition
from cavsumo.model.snapshot import BodyState

STANDS_MPS = 0.01  # slower bodies stand
TOUCHING_M = 1e-9


class BoardView(NamedTuple):
    """The state of a timestep, as conditions need it.

    Attributes:
        time: since the ego entered [s].
        front, speed: arc length of the ego's front on its way [m], and its speed [m/s].
        states: of all bodies, by id.
        gone: how far each has gone since the beginning [m].
        axles: how far the reference point of each lies behind its middle [m].
    """

    time: float
    front: float
    speed: float
    states: Mapping[str, BodyState]
    gone: Mapping[str, float]
    axles: Mapping[str, float]


class BoardState(Protocol):
    """A storyboard, as its conditions see it."""

    variables: dict[str, str]

    def state_moment(self, element: str, level: str, state: str) -> tuple[float, float]:
        """From when until when an element is in a state [s]."""
        ...


@dataclass
class ConditionWatch:
    """A condition in one episode.

    Attributes:
        condition: what is watched.
        told: the storyboard.
        margin: at the last timestep; None before the first.
        rose, fell: when it began and ended to hold [s]; infinite for not yet.
        first: whether it held from the beginning, which is no edge.
    """

    condition: StoryCondition
    told: BoardState
    margin: float | None = None
    rose: float = math.inf
    fell: float = math.inf
    first: bool = False
    stood: float = 0.0

    def look(self, seen: BoardView, dt: float) -> None:
        """Take up the state of a timestep."""
        one = self.condition
        if one.sort == "state":
            return  # it is asked for when it is needed
        before, now = self.margin, self._margin(seen, dt)
        self.margin = now
        held = self.rose < math.inf and self.fell == math.inf
        if now > 0.0 or (now == 0.0 and (one.rule.endswith("OrEqual") or one.sort == "angle")):
            if self.rose > seen.time or not held:
                self.rose, self.fell, self.first = seen.time, math.inf, before is None
        elif held and self.rose <= seen.time:
            self.fell = seen.time
        elif not held or self.rose > seen.time:
            self.rose = self._foreseen(before, now, seen.time, dt)
            self.fell = math.inf

    def _foreseen(self, before: float | None, now: float, time: float, dt: float) -> float:
        """When it will hold, if that is within two timesteps; else infinity."""
        if before is None or not now > before or math.isinf(now) or math.isinf(before):
            return math.inf
        moment = time + dt * -now / (now - before)
        return moment if moment < time + 2 * dt else math.inf

    def moment(self, time: float, dt: float) -> float:
        """From when on it counts, delay and edge included; infinite if it does not."""
        one = self.condition
        if one.sort == "state":
            assert one.state is not None
            begins, ends = self.told.state_moment(one.element, one.level, one.state)
        else:
            begins, ends = self.rose, self.fell
        if one.edge == "none":
            begins, ends = begins + one.delay_s, ends + one.delay_s
            passing = one.sort == "state" and begins == ends  # a transition
            return begins if ends > time or (passing and begins > time - dt) else math.inf
        edges = [ends] if one.edge == "falling" else [begins] if one.edge == "rising" else []
        edges = edges or [begins, ends]
        if self.first:
            edges = [edge for edge in edges if edge != begins]
        coming = [e + one.delay_s for e in edges if time - dt < e + one.delay_s < time + 2 * dt]
        return min(coming, default=math.inf)

    def _margin(self, seen: BoardView, dt: float) -> float:
        """By how much it holds; negative if it does not."""
        one = self.condition
        if one.sort in ("time", "variable"):
            return self._compared(seen.time if one.sort == "time" else 0.0)
        if one.sort == "standstill":
            stands = [seen.states[body].v <= STANDS_MPS for body in one.bodies]
            self.stood = self.stood + dt if (all if one.all_of_them else any)(stands) else 0.0
            return self._compared(self.stood)
        found = [self._compared(quantity(one, body, seen)) for body in one.bodies]
        return min(found) if one.all_of_them else max(found)

    def _compared(self, value: float) -> float:
        """The margin of a value."""
        one = self.condition
        if one.sort == "variable":
            return _words(self.told.variables[one.element], one)
        if one.sort == "collision":
            return math.inf if value <= TOUCHING_M else -math.inf
        if one.sort == "angle":
            return one.tolerance - value
        sign = 1.0 if one.rule.startswith("greater") else -1.0
        difference = sign * (value - one.value)
        return difference if not math.isnan(difference) else -math.inf


def _words(given: str, one: StoryCondition) -> float:
    """The margin of a variable's value, compared as numbers where both are."""
    try:
        a, b = float(given), float(one.word)
    except ValueError:
        equal = given == one.word
        return math.inf if equal == (one.rule == "equalTo") else -math.inf
    holds = {
        "greaterThan": a > b,
        "greaterOrEqual": a >= b,
        "lessThan": a < b,
        "lessOrEqual": a <= b,
        "equalTo": a == b,
        "notEqualTo": a != b,
    }[one.rule]
    return math.inf if holds else -math.inf


def quantity(one: StoryCondition, body: str, seen: BoardView) -> float:
    """The quantity of a condition for one body [m, s or m/s]."""
    state = seen.states[body]
    if one.sort == "speed":
        return state.v
    if one.sort == "travelled":
        return seen.gone[body]
    if one.sort == "angle":
        return abs(math.remainder(state.o - one.value, math.tau))
    if one.sort == "relative-speed":
        return state.v - seen.states[one.other].v
    if one.sort == "collision":
        return gap(state.box, seen.states[one.other].box)
    apart = distance(one, body, seen)
    if one.sort in ("distance", "reach"):
        return apart
    if one.sort == "headway":
        return apart / state.v if state.v > STANDS_MPS else math.inf
    closing = _closing(one, body, seen)
    return apart / closing if closing > 0.0 else math.inf


def distance(one: StoryCondition, body: str, seen: BoardView) -> float:
    """The distance of a body to another one or to a place, as the condition measures it [m]."""
    state, back = seen.states[body], seen.axles.get(body, 0.0)
    pose = _reference(state, back)
    if one.other and one.freespace:
        other = seen.states[one.other]
        if one.axis == "cartesian":
            return gap(state.box, other.box)
        there = in_frame(other.box, state.x, state.y, state.o)
        c, s = abs(math.cos(there.heading)), abs(math.sin(there.heading))
        own = state.body.kind
        if one.axis == "longitudinal":
            reach = (own.length + there.length * c + there.width * s) / 2
            return max(0.0, abs(there.x) - reach)
        reach = (own.width + there.length * s + there.width * c) / 2
        return max(0.0, abs(there.y) - reach)
    if one.other:
        other = seen.states[one.other]
        x, y = _reference(other, seen.axles.get(one.other, 0.0))
    else:
        assert one.place_m is not None
        x, y = one.place_m
    dx, dy, o = x - pose[0], y - pose[1], state.o
    if one.axis == "longitudinal":
        return abs(dx * math.cos(o) + dy * math.sin(o))
    if one.axis == "lateral":
        return abs(dy * math.cos(o) - dx * math.sin(o))
    return math.hypot(dx, dy)


def _reference(state: BodyState, back: float) -> tuple[float, float]:
    """The reference point of a body."""
    return state.x - back * math.cos(state.o), state.y - back * math.sin(state.o)


def _closing(one: StoryCondition, body: str, seen: BoardView) -> float:
    """How fast the distance becomes smaller [m/s]: the relative velocity along its direction."""
    state = seen.states[body]
    vx, vy = state.v * math.cos(state.o), state.v * math.sin(state.o)
    if one.other:
        other = seen.states[one.other]
        x, y = other.x, other.y
        vx, vy = vx - other.v * math.cos(other.o), vy - other.v * math.sin(other.o)
    else:
        assert one.place_m is not None
        x, y = one.place_m
    dx, dy = x - state.x, y - state.y
    if one.axis != "cartesian":
        c, s = math.cos(state.o), math.sin(state.o)
        along = one.axis == "longitudinal"
        ahead = dx * c + dy * s if along else dy * c - dx * s
        speed = vx * c + vy * s if along else vy * c - vx * s
        return speed * math.copysign(1.0, ahead)
    apart = math.hypot(dx, dy)
    return (vx * dx + vy * dy) / apart if apart > 0.0 else 0.0
