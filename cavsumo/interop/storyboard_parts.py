"""Parts of an OpenSCENARIO storyboard: entities, trajectories, triggers.

``xosc`` is the package scenariogeneration.xosc, which is only imported where it is used. Around
each timestep a heading is held for a moment, because players turn between points in different ways.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from cavsumo.interop.tracks import Stays, Track, TrackPoint, axle, height
from cavsumo.model.bodies import BICYCLE, BUS, PEDESTRIAN

PEDESTRIAN_KG = 75.0
HELD_S = 0.001  # for how long around a timestep a heading is held
CATEGORIES = {
    BUS.name: "bus",
    BICYCLE.name: "bicycle",
    "truck": "truck",
    "trailer": "truck",
    "delivery": "van",
    "motorcycle": "motorbike",
    "moped": "motorbike",
    "tram": "tram",
    "rail": "train",
}
SHAPE = "cavsumo.shape"  # property of an entity: part, kind, length, width, wheelbase
FAST_MPS, HARD_MPS2 = 70.0, 10.0  # limits of a vehicle, beyond those of all tracks


def entity(xosc: Any, of: Stays) -> Any:
    """A body as an entity; its reference point is the rear axle, of pedestrians the middle."""
    name, shape = of.name, of.shape
    tall, back = height(shape), axle(shape)
    box = xosc.BoundingBox(shape.width, shape.length, tall, back, 0.0, tall / 2)
    if shape.kind == PEDESTRIAN.name:
        category = xosc.PedestrianCategory.pedestrian
        body = xosc.Pedestrian(name, PEDESTRIAN_KG, category, box)
    else:
        category = getattr(xosc.VehicleCategory, CATEGORIES.get(shape.kind, "car"))
        front = xosc.Axle(0.6, 0.6, shape.width * 0.9, 2.0 * back, 0.3)
        rear = xosc.Axle(0.0, 0.6, shape.width * 0.9, 0.0, 0.3)
        limits = FAST_MPS, HARD_MPS2, HARD_MPS2
        body = xosc.Vehicle(name, category, box, front, rear, *limits)
    body.add_property(SHAPE, json.dumps([of.part, *shape]))
    return body


def position(xosc: Any, moment: TrackPoint) -> Any:
    """A place in the world."""
    return xosc.WorldPosition(moment.x, moment.y, 0.0, moment.heading, 0.0, 0.0)


def follow(xosc: Any, name: str, track: Track, *, by_clock: bool) -> Any:
    """The action that follows a track once, by the clock of the simulation or its own."""
    points = held(track)
    start = 0.0 if by_clock else track[0].time
    times = [point.time - start for point in points]
    trajectory = xosc.Trajectory(name, closed=False)
    trajectory.add_shape(xosc.Polyline(times, [position(xosc, point) for point in points]))
    domain = xosc.ReferenceContext.absolute if by_clock else xosc.ReferenceContext.relative
    return xosc.FollowTrajectoryAction(trajectory, xosc.FollowingMode.position, domain, 1, 0)


def held(track: Track) -> list[TrackPoint]:
    """A track with points just before and after each, on the way, with the same heading.

    Players turn between the headings of points in different ways; some are halfway at a point. A
    track of one moment is held for a moment: a trajectory has two points at least.
    """
    if len(track) == 1:
        return [track[0], track[0]._replace(time=track[0].time + HELD_S)]
    points = []
    for i, here in enumerate(track):
        for shift in (-HELD_S, 0.0, HELD_S):
            other = track[max(0, min(len(track) - 1, i + (shift > 0.0) - (shift < 0.0)))]
            share = shift / (other.time - here.time) if other.time != here.time else 0.0
            if share or not shift:
                x, y = here.x + share * (other.x - here.x), here.y + share * (other.y - here.y)
                points.append(here._replace(time=here.time + shift, x=x, y=y))
    return points


def standing_speed(xosc: Any, speed: float) -> Any:
    """The action that gives a speed at once [m/s]."""
    at_once = xosc.TransitionDynamics(xosc.DynamicsShapes.step, xosc.DynamicsDimension.time, 0.0)
    return xosc.AbsoluteSpeedAction(speed, at_once)


def event(xosc: Any, name: str, action: Any, trigger: Any) -> Any:
    """An event that happens once."""
    made = xosc.Event(name, xosc.Priority.parallel)
    made.add_action(f"{name}: action", action)
    made.add_trigger(trigger)
    return made


def group(xosc: Any, name: str, events: Sequence[Any]) -> Any:
    """The events of one body."""
    manoeuvre = xosc.Maneuver(f"manoeuvre of {name}")
    for one in events:
        manoeuvre.add_event(one)
    made = xosc.ManeuverGroup(f"group of {name}")
    made.add_actor(name)
    made.add_maneuver(manoeuvre)
    return made


def at_time(xosc: Any, time: float, name: str, *, after: bool = False, stop: bool = False) -> Any:
    """A trigger that holds from a time on [s], or after it."""
    rule = xosc.Rule.greaterThan if after else xosc.Rule.greaterOrEqual
    condition = xosc.SimulationTimeCondition(time, rule)
    where = "stop" if stop else "start"
    return xosc.ValueTrigger(name, 0.0, xosc.ConditionEdge.none, condition, triggeringpoint=where)


def ego_has_come(xosc: Any, metres: float, name: str, before: str | None) -> Any:
    """A trigger that holds when the ego has come so far, and an event before has ended."""
    found = xosc.ConditionGroup()
    distance = xosc.TraveledDistanceCondition(metres)
    found.add_condition(xosc.EntityTrigger(name, 0.0, xosc.ConditionEdge.none, distance, "ego"))
    if before is not None:
        ended = xosc.StoryboardElementStateCondition(
            xosc.StoryboardElementType.event, before, xosc.StoryboardElementState.completeState
        )
        found.add_condition(
            xosc.ValueTrigger(f"{before} has ended", 0.0, xosc.ConditionEdge.none, ended)
        )
    return found
