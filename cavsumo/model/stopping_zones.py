"""Stopping zones ahead of the ego (after CAV-Gym).

Lengths in metres, angles in radians anticlockwise from east. Plain floats only, for the inner loop
of the simulation; NaN in a box is not checked for.

A strip as wide as the ego starts at its front bumper. Its first d_b = v^2 / (2 max_decel) metres
are the braking zone: even immediate full braking does not avoid a body that stands there. The next
    d_r = reaction_time * v metres are the reaction zone: immediate full braking avoids a body that
    stands there, braking after the reaction time does not.

While the ego steers, the strip follows the circle on which the centre F of the front bumper moves
about the centre of rotation (eqs 12-13 of the seed, the draft paper "Simulator-Based Verification
of Autonomous Vehicles: Agent-Based Test Generation"); d_b and d_r are arc lengths along it. F moves
at an angle to the heading, so the start of that strip is turned against the bumper about F; the
triangle this opens ahead of the outer half of the bumper belongs to the braking zone. CAV-Gym has
no zones while the ego steers; without steering the zones here are equal to its own.
"""

from __future__ import annotations

import itertools
import math
from math import cos, sin
from typing import Literal, NamedTuple

from cavsumo.model.geometry import TOUCH, Box, Point, corners, in_frame, overlap

# m; a strip that leaves the straight one by less than this is taken as straight. The radius is then
# at most about 1e8 m, where the arithmetic of the arc is good to 1e-7 m.
STRAIGHT = 1e-6


# m; how far the chords of a drawn arc may lie off it; zone_entered uses the arc itself
SAGITTA = 0.01


class Zones(NamedTuple):
    """Corner points [m] of the two stopping zones, anticlockwise; an empty zone has none."""

    braking: list[Point]
    reaction: list[Point]


class _Arc(NamedTuple):
    """A curved strip, about the centre of rotation: x along the ego's heading, turning left."""

    side: float  # +1 for a turn to the left, -1 for one to the right, which is mirrored
    rear: float  # distance from the centre of rotation to the rear axle, b / |tan e| [m]
    ahead: float  # how far F is ahead of the rear axle [m]
    shift: float  # how far the centre of the ego is ahead of the rear axle, b / 2 [m]
    radius: float  # of the circle of F [m]
    half_width: float  # of the ego and the strip [m]


def stopping_distances(v: float, *, max_decel: float, reaction_time: float) -> tuple[float, float]:
    """Return the braking distance v^2 / (2 max_decel) and the reaction distance reaction_time v.

    Args:
        v: speed [m/s]; both distances [m] are 0 for v <= 0.
        max_decel: size of the strongest deceleration [m/s^2], > 0; reaction_time: [s], >= 0.

    Raises:
        ValueError: max_decel or reaction_time is outside its range, or v is NaN.
    """
    if not (max_decel > 0.0 <= reaction_time and v == v):
        given = f"max_decel={max_decel}, reaction_time={reaction_time}, v={v}"
        raise ValueError(f"need max_decel > 0, reaction_time >= 0 and v a number, got {given}")
    return (0.5 * v * v / max_decel, reaction_time * v) if v > 0.0 else (0.0, 0.0)


def zone_entered(
    body: Box,
    ego: Box,
    v: float,
    *,
    max_decel: float,
    reaction_time: float,
    wheelbase: float,
    steering: float = 0.0,
) -> Literal["body", "braking", "reaction"] | None:
    """Return the first of the ego's body, braking zone and reaction zone that `body` touches.

    Touching counts. For v <= 0 there are no zones. The arc of a steering ego is not approximated.

    Args:
        body, ego: boxes in one frame [m, rad].
        v: the ego's speed [m/s].
        max_decel, reaction_time: [m/s^2] and [s], as in `stopping_distances`.
        wheelbase: b of the ego [m], > 0; steering: e [rad], positive to the left, |e| < pi/2.

    Raises:
        ValueError: as `stopping_distances`, or (noticed only near the ego) wheelbase or steering.
    """
    braking, reaction = stopping_distances(v, max_decel=max_decel, reaction_time=reaction_time)
    x, y, heading, length, width = ego
    dx, dy = body[0] - x, body[1] - y
    reach = 0.5 * (length + width + body[3] + body[4]) + braking + reaction + TOUCH
    if dx * dx + dy * dy > reach * reach:
        return None
    if overlap(body, ego):
        return "body"
    if braking == 0.0:
        return None
    seen = in_frame(body, x, y, heading)
    arc = _arc(ego, steering, wheelbase, braking + reaction)
    if _enters(seen, ego, arc, 0.0, braking):
        return "braking"
    return "reaction" if _enters(seen, ego, arc, braking, braking + reaction) else None


def zone_polygons(
    ego: Box,
    v: float,
    *,
    max_decel: float,
    reaction_time: float,
    wheelbase: float,
    steering: float = 0.0,
) -> Zones:
    """Return the outlines of both zones, for drawing; arguments and errors as `zone_entered`."""
    braking, reaction = stopping_distances(v, max_decel=max_decel, reaction_time=reaction_time)
    arc = _arc(ego, steering, wheelbase, braking + reaction)
    limits = ((0.0, braking), (braking, braking + reaction))
    outlines = [_outline(ego, arc, begin, end) if end > begin else [] for begin, end in limits]
    c, s = cos(ego.heading), sin(ego.heading)
    world = [[(ego.x + x * c - y * s, ego.y + x * s + y * c) for x, y in o] for o in outlines]
    return Zones(*world)


def _arc(ego: Box, steering: float, wheelbase: float, distance: float) -> _Arc | None:
    """The ego's arc, or None if a strip of length `distance` is straight to within `STRAIGHT`."""
    if not (abs(steering) < 0.5 * math.pi and wheelbase > 0.0):
        raise ValueError(f"need |steering| < pi/2 and wheelbase > 0: {steering}, {wheelbase}")
    ahead, slope = 0.5 * (ego.length + wheelbase), math.tan(abs(steering)) / wheelbase
    # F starts at a slope of ahead * slope to the heading and then bends by at most 1 / rear = slope
    # per metre; the start of the strip is tilted by as much as F's path.
    if (distance * (ahead + 0.5 * distance) + 0.5 * ego.width * ahead) * slope < STRAIGHT:
        return None
    rear, side = 1.0 / slope, math.copysign(1.0, steering)
    return _Arc(side, rear, ahead, 0.5 * wheelbase, math.hypot(rear, ahead), 0.5 * ego.width)


def _enters(seen: Box, ego: Box, arc: _Arc | None, begin: float, end: float) -> bool:
    """Whether `seen`, in the frame of the ego, touches the zone from `begin` to `end` [m]."""
    if arc is None:
        return overlap(seen, _strip(ego, begin, end))
    x, y = seen.x + arc.shift, arc.side * seen.y - arc.rear
    reach = arc.half_width + 0.5 * (seen.length + seen.width) + TOUCH
    if abs(math.hypot(x, y) - arc.radius) > reach:
        return False
    body = corners(Box(x, y, arc.side * seen.heading, seen.length, seen.width))
    centre, bumper, strip = _wedge(arc)
    if not begin and _clip(_clip(_clip(body, centre, bumper), bumper, strip), strip, centre):
        return True
    return _touches_sector(body, arc, begin, end)


def _strip(ego: Box, begin: float, end: float) -> Box:
    """The part of a straight strip from `begin` to `end` [m] in the frame of the ego."""
    return Box(0.5 * (ego.length + begin + end), 0.0, 0.0, end - begin, ego.width)


def _wedge(arc: _Arc) -> tuple[Point, Point, Point]:
    """F, the outer end of the bumper and the outer start of the strip, anticlockwise."""
    scale = 1.0 + arc.half_width / arc.radius
    centre = (arc.ahead, -arc.rear)
    return centre, (arc.ahead, -arc.rear - arc.half_width), (scale * centre[0], scale * centre[1])


def _touches_sector(body: list[Point], arc: _Arc, begin: float, end: float) -> bool:
    """Whether `body` touches the curved strip from `begin` to `end` [m]."""
    # Exact: the part of a convex body between two rays is convex, so it meets the ring between two
    # radii if and only if its nearest point is within the outer and its farthest, a corner, beyond
    # the inner. Two rays bound a convex sector only below pi.
    inner, outer = arc.radius - arc.half_width - TOUCH, arc.radius + arc.half_width + TOUCH
    for first, last in itertools.pairwise(_rays(arc, begin, end, 0.5 * math.pi)):
        part = _clip(_clip(body, (0.0, 0.0), first), last, (0.0, 0.0))
        if part and max(math.hypot(*p) for p in part) >= inner and _nearest(part) <= outer:
            return True
    return False


def _rays(arc: _Arc, begin: float, end: float, most: float) -> list[Point]:
    """Unit vectors from `begin` to `end` [m], at most `most` [rad] apart and over one turn."""
    start = math.atan2(-arc.rear, arc.ahead) + begin / arc.radius
    sweep = min((end - begin) / arc.radius, math.tau)
    count = max(1, math.ceil(sweep / most))
    angles = [start + sweep * i / count for i in range(count + 1)]
    return [(cos(a), sin(a)) for a in angles]


def _clip(polygon: list[Point], p: Point, q: Point) -> list[Point]:
    """The part of a convex polygon on the left of the line from p to q, or within `TOUCH` of it."""
    (px, py), dx, dy = p, q[0] - p[0], q[1] - p[1]
    slack = TOUCH * math.hypot(dx, dy)
    sides = [dx * (y - py) - dy * (x - px) + slack for x, y in polygon]
    kept: list[Point] = []
    for i, (x, y) in enumerate(polygon):
        (x0, y0), side0, side = polygon[i - 1], sides[i - 1], sides[i]
        if (side0 >= 0.0) != (side >= 0.0):
            t = side0 / (side0 - side)
            kept.append((x0 + t * (x - x0), y0 + t * (y - y0)))
        if side >= 0.0:
            kept.append((x, y))
    return kept


def _nearest(polygon: list[Point]) -> float:
    """The smallest distance from the origin to an edge of the polygon [m]."""
    best = math.inf
    for (x0, y0), (x, y) in itertools.pairwise([polygon[-1], *polygon]):
        dx, dy = x - x0, y - y0
        t = min(1.0, max(0.0, -(x0 * dx + y0 * dy) / (dx * dx + dy * dy or 1.0)))
        best = min(best, math.hypot(x0 + t * dx, y0 + t * dy))
    return best


def _outline(ego: Box, arc: _Arc | None, begin: float, end: float) -> list[Point]:
    """The corner points of one zone in the frame of the ego, anticlockwise."""
    if arc is None:
        return corners(_strip(ego, begin, end))
    inner, outer = max(arc.radius - arc.half_width, 0.0), arc.radius + arc.half_width
    # A chord over the angle a has the sagitta r (1 - cos(a / 2)) <= r a^2 / 8.
    rays = _rays(arc, begin, end, math.sqrt(8.0 * SAGITTA / outer))
    points = [] if begin else list(_wedge(arc)[:2])
    points += [(outer * x, outer * y) for x, y in rays]
    points += [(inner * x, inner * y) for x, y in reversed(rays)]
    seen = [(x - arc.shift, arc.side * (y + arc.rear)) for x, y in points]
    return seen if arc.side > 0.0 else seen[::-1]
