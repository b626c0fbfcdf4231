"""The protocol of docs/ego-protocol.md, read for a planner: route, lanes, and bodies as predicted.

A planner is a function of what is seen that returns an answer: `accelerate`, or `follow` with the
states of a planned path. This module needs Python's standard library only.
"""

import importlib
import itertools
import json
import math
import sys
from bisect import bisect_right
from types import SimpleNamespace
from typing import NamedTuple

LOOK_S = 0.6  # how far ahead on the plan the steering aims
LOOK_M = 3.0  # but at least so far
SPACING_M = 1.0  # of the points of the centre line
PLACE = ("x_m", "y_m", "heading_rad", "speed_mps", "length_m", "width_m", "on_carriageway")


def package(name, pip):
    """Import a planner's package, or end with the command that installs it."""
    try:
        return importlib.import_module(name)
    except ImportError:
        print(f"this planner needs a package: pip install {pip}", file=sys.stderr)
        raise SystemExit(2) from None


def serve(begin):
    """Answer the messages on stdin. `begin(road)` gives a function of what is seen to an answer.

    It is called again for every episode, so that nothing is kept from the one before.
    """
    road = plan = None
    for message in map(json.loads, sys.stdin):
        if message["type"] == "hello":
            road = Road(message)
            reply = {"type": "hello", "version": 1}
        elif message["type"] == "reset":
            plan = begin(road)
            reply = {"type": "ready"}
        elif message["type"] == "observation":
            reply = {"step": message["step"]} | plan(Seen(road, message))
        else:
            return
        print(json.dumps(reply), flush=True)


class Road:
    """The hello: the ego's limits and its route.

    ego: the limits, named as in the protocol. dt: timestep [s]. points: the centre line [m], evenly
    spaced and prolonged. length: of the route; width: of its lanes, the narrowest [m].
    """

    def __init__(self, hello):
        self.ego, self.dt = SimpleNamespace(**hello["ego"]), hello["timestep_s"]
        given = hello["route"]["points_m"]
        steps = [math.dist(a, b) for a, b in itertools.pairwise(given)]
        self.starts = list(itertools.accumulate(steps, initial=0.0))
        self._given, self.length = given, self.starts[-1]
        self._lanes = hello["route"]["lanes"]
        self.width = min(lane["width_m"] for lane in self._lanes)
        count = int((self.length + 160.0) / SPACING_M)
        self.points = [self.at((i - 60) * SPACING_M)[:2] for i in range(count)]

    def at(self, along):
        """Point and heading of the centre line, straight on beyond its ends."""
        i = min(len(self._given) - 2, max(0, bisect_right(self.starts, along) - 1))
        (x0, y0), (x1, y1) = self._given[i], self._given[i + 1]
        t = (along - self.starts[i]) / (self.starts[i + 1] - self.starts[i])
        return x0 + t * (x1 - x0), y0 + t * (y1 - y0), math.atan2(y1 - y0, x1 - x0)

    def limit(self, along):
        """The speed limit at a place of the route [m/s]."""
        here = [lane for lane in self._lanes if lane["from_m"] <= along] or self._lanes[:1]
        return here[-1]["speed_limit_mps"]


class Body(NamedTuple):
    """Another body, in SI units; on_carriageway: whether its centre is."""

    number: int
    kind: str
    x: float
    y: float
    heading: float
    speed: float
    length: float
    width: float
    on_carriageway: bool

    def at(self, seconds):
        """Its place after some time if it keeps its velocity [m]."""
        way = self.speed * seconds
        return self.x + way * math.cos(self.heading), self.y + way * math.sin(self.heading)


class Seen:
    """An observation.

    x, y, heading, speed, acceleration, along, lateral: of the ego's centre. steering: its own.
    bodies: the others. speed_limit: the lowest within the next second. red_m: distance of the stop
    line of a light that is not green, from the front bumper, or None.
    """

    def __init__(self, road, message):
        ego, light = message["ego"], message["traffic_light"]
        self.road, self.step, self.time = road, message["step"], message["time_s"]
        self.x, self.y, self.heading = ego["x_m"], ego["y_m"], ego["heading_rad"]
        self.speed, self.acceleration = ego["speed_mps"], ego["acceleration_mps2"]
        self.steering = ego["steering_rad"]
        self.along, self.lateral = ego["along_m"], ego["lateral_m"]
        self.speed_limit = min(road.limit(self.along), road.limit(self.along + self.speed))
        closed = light and light["state"] not in ("green", "off", "blinking", "unknown")
        self.red_m = light["distance_m"] if closed else None
        self.bodies = [
            Body(i, b["kind"], *(b[key] for key in PLACE)) for i, b in enumerate(message["bodies"])
        ]

    @property
    def rear(self):
        """The place of the middle of the rear axle [m]."""
        arm = self.road.ego.wheelbase_m / 2
        return self.x - arm * math.cos(self.heading), self.y - arm * math.sin(self.heading)

    @property
    def obstacles(self):
        """The bodies, and a standing wall across the lane behind the stop line of a red light."""
        if self.red_m is None:
            return self.bodies
        front = self.along + self.road.ego.length_m / 2
        wall = *self.road.at(front + self.red_m + 1.0), 0.0, 1.0, 3.0, True
        return [*self.bodies, Body(len(self.bodies), "wall", *wall)]


def accelerate(seen, value):
    """The answer that keeps to the route: an acceleration [m/s2], brought within the limits."""
    ego = seen.road.ego
    return {"acceleration": min(ego.acceleration_max_mps2, max(ego.acceleration_min_mps2, value))}


def follow(seen, times, xs, ys, speeds):
    """Throttle and steering that follow planned states; times [s] begin now at 0.

    The throttle brings the planned speed of the next timestep; the steering aims at the point of
    the plan some way ahead (pure pursuit, Coulter 1992) with the wheels of the kinematic bicycle.
    """
    dt, i = seen.road.dt, 0
    while i < len(times) - 2 and times[i + 1] < dt:
        i += 1
    share = (dt - times[i]) / (times[i + 1] - times[i])
    wanted = speeds[i] + share * (speeds[i + 1] - speeds[i])
    reach = _reach(seen)
    aim = next((p for p in zip(xs, ys, strict=True) if math.dist(p, seen.rear) >= reach), None)
    return drive(seen, (wanted - seen.speed) / dt, _pursuit(seen, aim))


def brake(seen, value):
    """Braking along the centre line [m/s2], for a planner that steers and has found no path."""
    aim = seen.road.at(seen.along - seen.road.ego.wheelbase_m / 2 + _reach(seen))
    return drive(seen, value, _pursuit(seen, aim[:2]))


def drive(seen, throttle, steering):
    """The answer with throttle [m/s2] and steering [rad], brought within the limits."""
    ego, most = seen.road.ego, seen.road.ego.steering_max_rad
    throttle = min(ego.acceleration_max_mps2, max(ego.acceleration_min_mps2, throttle))
    return {"throttle": throttle, "steering": min(most, max(-most, steering))}


def _reach(seen):
    """How far ahead of the rear axle the steering aims [m]."""
    return max(LOOK_M, LOOK_S * seen.speed) + seen.road.ego.wheelbase_m / 2


def _pursuit(seen, aim):
    """The steering that leads the rear axle on a circle through a point; 0 without one [rad]."""
    if aim is None:
        return 0.0
    (x, y), base = seen.rear, seen.road.ego.wheelbase_m
    bearing = math.atan2(aim[1] - y, aim[0] - x) - seen.heading
    return math.atan2(2.0 * base * math.sin(bearing), math.dist(aim, (x, y)))
