"""The script of a test: programmed testers, and the way and speed at which the ego approaches.

A programme is a way, a speed, the moment at which it begins, and stages after that::

    [[script.testers]]
    kind = "pedestrian"
    length_m = 0.6
    width_m = 0.5
    way = { x_m = 0.0, y_m = -4.0, heading_rad = 1.5707963267948966 }
    begins = { ego_at_m = -0.25, own_at_m = 4.06 }
    stages = [{ to_mps = 1.3889, over_m = 1.06 }]

A body commits once: when its programme begins it is fixed, and what the ego does later changes
nothing. Arc lengths on the ego's way are those of its front.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from cavsumo.model.bodies import KINDS, Body, Kind
from cavsumo.model.curve import Bend, PlaneCurve, Pose
from cavsumo.model.motion import Motion, Phase, motion_of, to_speed_by, to_speed_over
from cavsumo.model.scenario.impact import Front, Straight, impact
from cavsumo.model.scenario.sensor import Finite
from cavsumo.model.scenario.storyboard import EGO, Storyboard
from cavsumo.model.scenario.track import Place, ScriptedTrack

Length = Annotated[float, Field(gt=0, le=50, allow_inf_nan=False)]
Speed = Annotated[float, Field(ge=0, le=100, allow_inf_nan=False)]
FOUR_S = 4.0  # time to the nominal contact; until then SUMO's driver keeps the speed of the test
FAST_MPS2 = 1000.0  # limit of a programmed body's throttle: its places are prescribed


class ScriptPart(BaseModel):
    """A part of a script; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Leg(ScriptPart):
    """A leg of a way; its curvature changes evenly from one end to the other."""

    length_m: Finite = Field(ge=0, le=10_000, description="its length [m]")
    curvature: Finite = Field(0.0, description="at its beginning, positive to the left [1/m]")
    to_curvature: Finite | None = Field(None, description="at its end; the same if not given")


class ScriptedWay(ScriptPart):
    """A way from a pose over legs, prolonged straight on at both ends."""

    x_m: Finite = 0.0
    y_m: Finite = 0.0
    heading_rad: Finite = 0.0
    legs: tuple[Leg, ...] = ()
    points_m: Annotated[float, Field(gt=0.01, allow_inf_nan=False)] | None = Field(
        default=None, description="distance of points between which it is straight; else smooth"
    )

    @cached_property
    def curve(self) -> PlaneCurve:
        """The way as a curve."""
        bends = [
            Bend(leg.length_m, leg.curvature, leg.curvature if last is None else last)
            for leg in self.legs
            for last in (leg.to_curvature,)
        ]
        return PlaneCurve((self.x_m, self.y_m, self.heading_rad), bends, self.points_m)


class SpeedChange(ScriptPart):
    """A change of speed, over a distance or by a rate; or the speed kept for some time."""

    to_mps: Speed | None = Field(None, description="speed at its end [m/s]")
    over_m: Finite | None = Field(None, gt=0, description="distance in which it changes [m]")
    by_mps2: Finite | None = Field(None, gt=0, description="rate by which it changes [m/s2]")
    for_s: Finite | None = Field(None, ge=0, description="time for which the speed is kept [s]")

    @model_validator(mode="after")
    def _one_of_three(self) -> Self:
        given = (self.to_mps is not None, self.over_m is not None, self.by_mps2 is not None)
        if given.count(True) != (0 if self.for_s is not None else 2) or (
            self.for_s is None and not given[0]
        ):
            raise ValueError("must have to_mps with over_m or by_mps2, or for_s alone")
        return self

    def phase(self, before: float) -> Phase:
        """The phase that it is after a speed [m/s]."""
        if self.for_s is not None:
            return Phase(0.0, self.for_s)
        assert self.to_mps is not None
        if self.over_m is not None:
            if before + self.to_mps == 0.0:
                raise ValueError("a stage from standing to standing covers no distance")
            return to_speed_over(before, self.to_mps, self.over_m)
        assert self.by_mps2 is not None
        return to_speed_by(before, self.to_mps, self.by_mps2)


class Begins(ScriptPart):
    """The moment at which a programme begins: by the ego's place, by an impact, or by time.

    With ``own_at_m`` the body commits as soon as it must begin to arrive there when the ego, at
    its present speed, arrives at ``ego_at_m``; else when the ego is there. ``impact`` gives both
    places, for a body that goes straight: its reference point would meet that share of the ego's
    front, from the right edge (0) to the left (1).
    """

    impact: Finite | None = Field(None, description="share of the ego's front")
    front_m: Finite | None = Field(None, description="of the reference point, from its own front")
    ego_at_m: Finite | None = Field(None, description="arc length of the ego's front [m]")
    own_at_m: Finite | None = Field(None, ge=0, description="distance on the body's own way [m]")
    at_s: Finite | None = Field(None, ge=0, description="time since the ego entered [s]")

    @model_validator(mode="after")
    def _by_one(self) -> Self:
        if [self.ego_at_m, self.at_s, self.impact].count(None) != 2:
            raise ValueError("must have one of ego_at_m, impact and at_s")
        if self.front_m is not None and self.impact is None:
            raise ValueError("front_m needs impact")
        if self.own_at_m is not None and self.ego_at_m is None:
            raise ValueError("own_at_m needs ego_at_m")
        return self


class Programme(ScriptPart):
    """A programmed body: its box, its way, and how it moves along it."""

    kind: Literal[tuple(KINDS)] = Field(  # type: ignore[valid-type]
        description="how it is drawn, whether it walks, and whether it hides others"
    )
    length_m: Length = Field(description="length of its box [m]")
    width_m: Length = Field(description="width of its box [m]")
    way: ScriptedWay = ScriptedWay()
    speed_mps: Speed = Field(0.0, description="before its programme begins [m/s]")
    begins: Begins | None = Field(None, description="when its stages begin; None for never")
    stages: tuple[SpeedChange, ...] = ()
    track: ScriptedTrack | None = Field(None, description="its places, in place of all that")
    top_mps: Speed | None = Field(None, description="its largest speed on a storyboard [m/s]")
    errors_m: tuple[Place, ...] = Field(
        (), description="of its place as the ego measures it, in each timestep from the first [m]"
    )

    @cached_property
    def motion(self) -> Motion:
        """Its motion from the moment at which the programme begins."""
        v, phases = self.speed_mps, []
        for stage in self.stages:
            phases.append(stage.phase(v))
            v = v if stage.to_mps is None else stage.to_mps
        return motion_of(self.speed_mps, phases)

    @model_validator(mode="after")
    def _moves(self) -> Self:
        if bool(self.stages) != (self.begins is not None):
            raise ValueError("begins and stages go together")
        if self.track is not None and self.model_fields_set & {"way", "speed_mps", "stages"}:
            raise ValueError("track stands in place of way, speed_mps, begins and stages")
        return self

    @property
    def enters(self) -> tuple[Pose, float]:
        """Its pose and its speed [m/s] when the ego enters."""
        if self.track is not None:
            return (*self.track.points_m[0], self.track.heading), self.track.speeds[0]
        return (self.way.x_m, self.way.y_m, self.way.heading_rad), self.speed_mps

    @property
    def top_speed(self) -> float:
        """Its largest speed [m/s]."""
        if self.top_mps is not None:
            return self.top_mps
        return self.motion.top_speed if self.track is None else max(self.track.speeds)

    @property
    def body_kind(self) -> Kind:
        """The kind of its body: the box, and limits that its programme keeps."""
        base = KINDS[self.kind]
        return replace(
            base,
            length=self.length_m,
            width=self.width_m,
            wheelbase=base.wheelbase * self.length_m / base.length,
            v_max=max(self.top_speed, 0.1),
            throttle_min=-FAST_MPS2,
            throttle_max=FAST_MPS2,
        )


class EgoApproach(ScriptPart):
    """The ego's approach.

    ``axle_m``: the point that follows the way lies so far behind its front; the middle of a car
    follows it if that is not given, its rear axle in protocols with turns.
    """

    speed_mps: Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)]
    start_m: Finite = Field(description="arc length of its front where it enters [m]")
    way: ScriptedWay = ScriptedWay()
    axle_m: Finite | None = Field(None, gt=0, le=30)
    length_m: Length | None = Field(None, description="length of its box; its own if not given")
    width_m: Length | None = Field(None, description="width of its box; its own if not given")
    meets_m: Finite = Field(0.0, description="arc length of its front at the nominal contact [m]")
    tolerance_mps: Finite = Field(0.3, gt=0, description="of its speed after it entered")

    @model_validator(mode="after")
    def _moves(self) -> Self:
        if self.tolerance_mps >= self.speed_mps:
            raise ValueError("tolerance_mps must be smaller than speed_mps")
        return self

    def axle(self, length: float) -> float:
        """Distance from the front of an ego of a length to its point that follows the way [m]."""
        return length / 2 if self.axle_m is None else self.axle_m


class ScriptedTest(ScriptPart):
    """The script of a test.

    ``name`` and ``parameters`` say which case of a suite it is. ``board``: events that move the
    testers that have neither stages nor a track, in place of these.
    """

    name: str = ""
    parameters: dict[str, bool | int | float | str] = Field(default_factory=dict)
    ego: EgoApproach
    testers: tuple[Programme, ...] = Field(min_length=1)
    board: Storyboard | None = None

    @field_validator("parameters", mode="before")
    @classmethod
    def _flat(cls, value: Any) -> Any:
        """Words and numbers only."""
        if isinstance(value, Mapping) and any(" " in str(v) for v in value.values()):
            raise ValueError("values must not contain blanks")
        return value

    @cached_property
    def commitments(self) -> tuple[Begins | None, ...]:
        """When each programme begins, with both places of an impact."""
        return tuple(self._commitment(tester) for tester in self.testers)

    def _commitment(self, tester: Programme) -> Begins | None:
        """When a programme begins."""
        begins, ego, way = tester.begins, self.ego, tester.way
        if begins is None or begins.impact is None:
            return begins
        if ego.width_m is None or ego.length_m is None or way.legs:
            raise ValueError("begins.impact needs the ego's box, and a way without legs")
        front = tester.length_m / 2 if begins.front_m is None else begins.front_m
        pose = way.x_m, way.y_m, way.heading_rad
        box = Straight(pose, tester.length_m, tester.width_m, front)
        axle = ego.axle(ego.length_m)
        at = impact(Front(ego.way.curve, axle, ego.width_m), box, begins.impact, ego.start_m)
        return Begins.model_validate({"ego_at_m": at[0], "own_at_m": at[1]})

    @model_validator(mode="after")
    def _told(self) -> Self:
        known = {EGO, *(f"tester{i}" for i in range(len(self.testers)))}
        if self.board is not None and (unknown := sorted(self.board.bodies - known)):
            raise ValueError(f"board: there is no body {unknown[0]!r}")
        return self

    @model_validator(mode="after")
    def _meet(self) -> Self:
        for tester, begins in zip(self.testers, self.commitments, strict=True):
            own = begins.own_at_m if begins else None
            if own is not None and not math.isfinite(tester.motion.when(own)):
                raise ValueError("begins: its place is never reached by the stages")
        return self

    @cached_property
    def bodies(self) -> tuple[Body, ...]:
        """The bodies of its testers."""
        return tuple(Body(f"tester{i}", one.body_kind) for i, one in enumerate(self.testers))

    @cached_property
    def begins_m(self) -> float:
        """Arc length of the ego's front from which on SUMO's driver decides its speed [m].

        Four seconds before the nominal contact, or where the first tester commits.
        """
        v, marks = self.ego.speed_mps, [self.ego.meets_m - FOUR_S * self.ego.speed_mps]
        for tester, begins in zip(self.testers, self.commitments, strict=True):
            if begins is not None and begins.ego_at_m is not None:
                needed = 0.0
                if begins.own_at_m is not None:
                    needed = tester.motion.when(begins.own_at_m)
                marks.append(begins.ego_at_m - v * needed)
        for action in self.board.arrivals if self.board else ():
            assert action.ego_at_m is not None
            assert action.own_at_m is not None
            speed = self.testers[int(action.body.removeprefix("tester"))].speed_mps
            marks.append(action.ego_at_m - v * action.arrival(0.0, speed).when(action.own_at_m))
        return max(self.ego.start_m, min(marks))
