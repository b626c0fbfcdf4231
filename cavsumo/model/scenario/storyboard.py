"""The storyboard of a script: events that begin when their conditions hold, and their actions.

Published scenarios (OpenSCENARIO XML) are made into it, with all numbers computed and all places in
the coordinates of the network. Bodies are named as in snapshots: ``ego``, ``tester0`` ...
"""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from cavsumo.model.motion import Motion, Phase, motion_of, to_speed_by, to_speed_over
from cavsumo.model.scenario.sensor import Finite
from cavsumo.model.scenario.track import Place, ScriptedTrack

EGO = "ego"
HURRY = 2.0  # times its final speed: no body is faster than that to arrive
Sort = Literal[
    "angle",
    "collision",
    "distance",
    "headway",
    "reach",
    "relative-speed",
    "speed",
    "standstill",
    "state",
    "time",
    "travelled",
    "ttc",
    "variable",
]
ACROSS = ("distance", "headway", "ttc", "relative-speed", "collision")  # sorts that need another
Rule = Literal["greaterThan", "greaterOrEqual", "lessThan", "lessOrEqual", "equalTo", "notEqualTo"]
Axis = Literal["cartesian", "longitudinal", "lateral"]
Edge = Literal["none", "rising", "falling", "risingOrFalling"]
State = Literal["standbyState", "runningState", "completeState", "startTransition", "endTransition"]
LEVELS = ("story", "act", "maneuverGroup", "maneuver", "event")  # of the elements of a storyboard
Level = Literal["story", "act", "maneuverGroup", "maneuver", "event"]
Speed = Annotated[float, Field(ge=0, le=100, allow_inf_nan=False)]


class BoardPart(BaseModel):
    """A part of a storyboard; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class StoryCondition(BoardPart):
    """A quantity of one body or several that is compared with a number.

    ``distance``, ``headway`` and ``ttc`` are to another body or to a place; ``freespace``: between
    the boxes, else between the reference points.
    """

    sort: Sort
    bodies: tuple[str, ...] = Field((), description="whose quantity it is")
    all_of_them: bool = Field(False, description="it must hold for all of them, else for any")
    other: str = Field("", description="the body to which the quantity refers")
    place_m: Place | None = Field(None, description="the place to which it refers")
    rule: Rule = "greaterOrEqual"
    value: Finite = Field(0.0, description="in m, s or m/s")
    axis: Axis = Field("cartesian", description="along which distances are measured, the body's")
    freespace: bool = False
    element: str = Field("", description="whose state it is, or the name of a variable")
    level: Level = Field("event", description="of the element whose state it is")
    state: State | None = None
    word: str = Field("", description="the value of a variable")
    tolerance: Finite = Field(0.0, ge=0, description="of an angle, both in rad")
    delay_s: Finite = Field(0.0, ge=0, description="it counts so much later")
    edge: Edge = "none"

    @model_validator(mode="after")
    def _refers(self) -> Self:
        if self.sort in ACROSS and (self.place_m is None) == (not self.other):
            raise ValueError(f"{self.sort} must have one of other and place_m")
        if (self.sort == "state") != (self.state is not None):
            raise ValueError("sort state and a state go together")
        return self


Together = Annotated[tuple[StoryCondition, ...], Field(min_length=1)]  # all of them hold
StoryTrigger = tuple[Together, ...]  # any of these; without any, at once


class StoryAction(BoardPart):
    """One action: a change of speed of a body, its way, its track, or the value of a variable.

    A change of speed is at once, or lasts ``in_s``, ``over_m`` or has the rate ``by_mps2``. With
    ``ego_at_m`` it begins so that the body has gone ``own_at_m`` as the ego's front is there,
    and has its speed ``steady_m`` before. Distances count from where the body started.
    """

    body: str = ""
    to_mps: Speed | None = None
    in_s: Finite | None = Field(None, gt=0)
    over_m: Finite | None = Field(None, gt=0)
    by_mps2: Finite | None = Field(None, gt=0)
    ego_at_m: Finite | None = None
    own_at_m: Finite | None = None
    steady_m: Finite = Field(0.0, ge=0)
    legs: tuple[tuple[Finite, Finite, Finite], ...] = Field(
        (), description="length [m] and curvatures at both ends [1/m], from its place on"
    )
    track: ScriptedTrack | None = None
    variable: str = ""
    word: str = ""

    @model_validator(mode="after")
    def _one_of_four(self) -> Self:
        given = [self.to_mps is None, self.track is None, not self.variable, not self.legs]
        if given.count(False) != 1:
            raise ValueError("must have one of to_mps, legs, track and variable")
        if [self.in_s, self.over_m, self.by_mps2, self.ego_at_m].count(None) < 3:
            raise ValueError("must have at most one of in_s, over_m, by_mps2 and ego_at_m")
        if (self.ego_at_m is None) != (self.own_at_m is None):
            raise ValueError("ego_at_m and own_at_m go together")
        return self

    def change(self, v: float) -> Motion:
        """The motion of a body that changes its speed from v on [m/s]."""
        assert self.to_mps is not None
        if self.in_s is not None:
            return motion_of(v, [Phase((self.to_mps - v) / self.in_s, self.in_s)])
        if self.by_mps2 is not None:
            return motion_of(v, [to_speed_by(v, self.to_mps, self.by_mps2)])
        if self.over_m is not None and v + self.to_mps > 0.0:
            return motion_of(v, [to_speed_over(v, self.to_mps, self.over_m)])
        return Motion(self.to_mps)

    def arrival(self, gone: float, v: float) -> Motion:
        """The motion of a body that arrives with the ego: a change of speed, then its final one.

        ``gone``, ``v``: the distance that it has gone [m] and its speed [m/s] when it begins.
        """
        assert self.own_at_m is not None
        assert self.to_mps is not None
        over = self.own_at_m - self.steady_m - gone
        if over <= 1e-9 or v + self.to_mps == 0.0:
            return Motion(self.to_mps)
        return motion_of(v, [to_speed_over(v, self.to_mps, over)])

    def hurried(self, gone: float, v: float, left: float) -> Motion | None:
        """The motion of a body that has less time than ``arrival`` takes; None if it is too little.

        It gains speed and loses it again at the same rate a, the least one with which it arrives in
        time: over the distance d and time T before its steady speed from v to u, and from u to the
        final speed w, with::

            T = (2 u - v - w) / a,    d = (2 u^2 - v^2 - w^2) / (2 a)

        ``left``: the time until it arrives [s].
        """
        assert self.own_at_m is not None
        assert self.to_mps is not None
        over, w = self.own_at_m - self.steady_m - gone, self.to_mps
        time = left - self.steady_m / w
        if over <= 0.0 or time <= 0.0:
            return None
        square = over * over - over * time * (v + w) + time * time * (v * v + w * w) / 2.0
        u = (over + math.sqrt(max(0.0, square))) / time
        rate = (2.0 * u - v - w) / time
        if rate <= 0.0 or u > HURRY * max(v, w):
            return None
        return motion_of(v, [to_speed_by(v, u, rate), to_speed_by(u, w, rate)])


class StoryEvent(BoardPart):
    """An event, which happens once.

    Attributes:
        name: of the event.
        within: its story, act, group and manoeuvre.
        starts: triggers that must all hold: of the act, and its own.
        stops: what ends its act; without any, its end does.
        overrides: it ends the other events of its manoeuvre.
    """

    name: str
    within: tuple[str, ...] = ()
    starts: tuple[StoryTrigger, ...] = ()
    stops: StoryTrigger = ()
    overrides: bool = False
    actions: tuple[StoryAction, ...] = ()


class Storyboard(BoardPart):
    """The events of a script, and when it stops.

    Attributes:
        axles_m: how far the reference point of each body lies behind the middle of its box, by id.
        paces: bodies that keep their distance to another one until they change their speed, by id.
        variables: the values of variables at the beginning.
        stops: any of them ends the episode; without any, its horizon does.
    """

    events: tuple[StoryEvent, ...] = ()
    axles_m: dict[str, Finite] = Field(default_factory=dict)
    paces: dict[str, str] = Field(default_factory=dict)
    variables: dict[str, str] = Field(default_factory=dict)
    stops: StoryTrigger = ()

    @property
    def arrivals(self) -> list[StoryAction]:
        """The actions by which bodies arrive with the ego."""
        every = [action for event in self.events for action in event.actions]
        return [action for action in every if action.ego_at_m is not None]

    @property
    def bodies(self) -> set[str]:
        """The ids of all bodies that it names."""
        triggers = [t for event in self.events for t in (*event.starts, event.stops)]
        conditions = [one for t in (*triggers, self.stops) for group in t for one in group]
        named = {name for one in conditions for name in (*one.bodies, one.other)}
        return (named | {a.body for event in self.events for a in event.actions}) - {""}
