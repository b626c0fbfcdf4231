"""The signals that a formula may name: numbers that describe the ego's state at a timestep.

Only those that a formula names are computed. If there is no body to meet, distances and times are
infinite and decelerations 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cavsumo.model.geometry import gap, overlap
from cavsumo.model.snapshot import BodyState, RawState, Snapshot

if TYPE_CHECKING:
    from cavsumo.model.carriageway import Light
    from cavsumo.model.scene import Scene

SHOWN = {"G": 1.0, "g": 1.0, "r": -1.0}  # by SUMO's letter; other letters are 0


@dataclass(frozen=True)
class Moment:
    """The data of a timestep from which signals are computed.

    Attributes:
        scene: of the episode.
        before: the snapshot before; at the first timestep the same as ``now``.
        now: the snapshot.
    """

    scene: Scene
    before: Snapshot
    now: Snapshot


@dataclass(frozen=True)
class SignalKind:
    """The definition of a signal.

    Attributes:
        unit: of its values; empty for a number without one.
        meaning: one line.
        value: computes it.
        sees_background: whether it uses background traffic or lights.
    """

    unit: str
    meaning: str
    value: Callable[[Moment], float]
    sees_background: bool = False


# Signals


def _acceleration(moment: Moment) -> float:
    return (moment.now.ego.v - moment.before.ego.v) / moment.scene.dt


def _along(moment: Moment) -> float:
    return moment.scene.ego_progress(moment.now)


def _lateral(moment: Moment) -> float:
    return moment.scene.ego_projection(moment.now).lateral


def _gap(moment: Moment) -> float:
    return _smallest_gap(moment.now.ego, moment.now.testers)


def _gap_all(moment: Moment) -> float:
    return _smallest_gap(moment.now.ego, _everybody(moment.now))


def _ttc(moment: Moment) -> float:
    return _shortest_time(moment.now.ego, moment.now.testers)


def _ttc_all(moment: Moment) -> float:
    return _shortest_time(moment.now.ego, _everybody(moment.now))


def _drac(moment: Moment) -> float:
    return _hardest_braking(moment.now.ego, moment.now.testers)


def _drac_all(moment: Moment) -> float:
    return _hardest_braking(moment.now.ego, _everybody(moment.now))


def _nearest_speed(moment: Moment) -> float:
    ego = moment.now.ego
    ranked = [(gap(ego.box, body.box), i) for i, body in enumerate(moment.now.testers)]
    return moment.now.testers[min(ranked)[1]].v if ranked else 0.0


def _on_road(moment: Moment) -> float:
    roads = moment.scene.roads
    if roads is None:
        return 0.0
    return float(sum(roads.contains(body.x, body.y) for body in moment.now.testers))


def _contact(moment: Moment) -> float:
    return _touches(moment.now.ego, moment.now.testers)


def _contact_all(moment: Moment) -> float:
    return _touches(moment.now.ego, _everybody(moment.now))


def _light(moment: Moment) -> float:
    ahead = _light_ahead(moment)
    return 1.0 if ahead is None else SHOWN.get(moment.now.lights[ahead[0]], 0.0)


def _light_distance(moment: Moment) -> float:
    ahead = _light_ahead(moment)
    return math.inf if ahead is None else ahead[1].along - _front(moment)


SIGNALS: Mapping[str, SignalKind] = {
    "time_s": SignalKind("s", "time since the start of the episode", lambda m: m.now.time),
    "speed_mps": SignalKind("m/s", "speed of the ego", lambda m: m.now.ego.v),
    "acceleration_mps2": SignalKind(
        "m/s2", "change of its speed since the timestep before; 0 at the first", _acceleration
    ),
    "steering_rad": SignalKind(
        "rad", "its steering angle, positive to the left", lambda m: m.now.ego_steering
    ),
    "along_m": SignalKind("m", "how far its centre is along its path", _along),
    "lateral_m": SignalKind(
        "m", "distance of its centre from its path, positive to the left", _lateral
    ),
    "gap_m": SignalKind("m", "smallest distance between its box and a tester's", _gap),
    "gap_all_m": SignalKind("m", "the same, background traffic included", _gap_all, True),
    "ttc_s": SignalKind(
        "s", "shortest time until its box touches a tester's if all keep their velocity", _ttc
    ),
    "ttc_all_s": SignalKind("s", "the same, background traffic included", _ttc_all, True),
    "drac_mps2": SignalKind(
        "m/s2", "largest deceleration by which it just avoids a tester that keeps on", _drac
    ),
    "drac_all_mps2": SignalKind("m/s2", "the same, background traffic included", _drac_all, True),
    "nearest_speed_mps": SignalKind("m/s", "speed of the nearest tester", _nearest_speed),
    "testers_on_road": SignalKind(
        "", "number of testers whose centre is on the carriageway", _on_road
    ),
    "contact": SignalKind("", "1 while its box touches a tester's, else 0", _contact),
    "contact_all": SignalKind("", "the same, background traffic included", _contact_all, True),
    "light": SignalKind(
        "",
        "the next traffic light ahead of its front: 1 green, 0 yellow or off, -1 red; 1 if none",
        _light,
        True,
    ),
    "light_distance_m": SignalKind(
        "m", "distance of its front from that light's stop line", _light_distance, True
    ),
}


# Parts of the computations


def _everybody(now: Snapshot) -> Iterator[BodyState]:
    """The testers and the background."""
    yield from now.testers
    yield from map(_state, now.raw_background)


def _state(raw: RawState) -> BodyState:
    return BodyState(*raw)


def _smallest_gap(ego: BodyState, bodies: Iterable[BodyState]) -> float:
    """The smallest distance of a box; those that are too far off for it are not measured."""
    smallest = math.inf
    reach, x, y, box = ego.body.kind.reach, ego.x, ego.y, ego.box
    for body in bodies:
        if math.hypot(body.x - x, body.y - y) - reach - body.body.kind.reach < smallest:
            smallest = min(smallest, gap(box, body.box))
    return smallest


def _touches(ego: BodyState, bodies: Iterable[BodyState]) -> float:
    return float(any(overlap(ego.box, body.box) for body in bodies))


def _shortest_time(ego: BodyState, bodies: Iterable[BodyState]) -> float:
    """The shortest time to collision [s]."""
    found = _of_boxes("ttc_boxes", ego, bodies)
    return math.inf if found is None else float(found.min())


def _hardest_braking(ego: BodyState, bodies: Iterable[BodyState]) -> float:
    """The largest deceleration to avoid a collision [m/s2]."""
    found = _of_boxes("drac_boxes", ego, bodies)
    return 0.0 if found is None else float(found.max())


def _of_boxes(metric: str, ego: BodyState, bodies: Iterable[BodyState]) -> Any:
    """A metric of ``metrics.plane`` for the ego and each body that it may meet; None without
    bodies.

    Boxes whose circumscribed circles never meet are left out.
    """
    meeting = [body for body in bodies if _circles_meet(ego, body)]
    if not meeting:
        return None
    from cavsumo.assertions.metrics import plane

    velocities = [_velocity(body) for body in meeting]
    boxes = [body.box for body in meeting]
    return getattr(plane, metric)(ego.box, _velocity(ego), boxes, velocities)


def _circles_meet(ego: BodyState, body: BodyState) -> bool:
    """Whether the circles around two boxes that keep their velocity ever meet."""
    dx, dy = body.x - ego.x, body.y - ego.y
    (vx, vy), (ux, uy) = _velocity(body), _velocity(ego)
    wx, wy = vx - ux, vy - uy
    reach = ego.body.kind.reach + body.body.kind.reach + 1e-6
    apart, along, speed = dx * dx + dy * dy, dx * wx + dy * wy, wx * wx + wy * wy
    if apart <= reach * reach:
        return True
    return along < 0.0 and (apart - reach * reach) * speed <= along * along * (1.0 + 1e-9)


def _velocity(body: BodyState) -> tuple[float, float]:
    return body.v * math.cos(body.o), body.v * math.sin(body.o)


def _front(moment: Moment) -> float:
    """The arc length of the ego's front on its path."""
    return _along(moment) + moment.now.ego.body.kind.length / 2


def _light_ahead(moment: Moment) -> tuple[int, Light] | None:
    """The first light on the ego's path whose stop line its front has not passed."""
    if not moment.scene.lights or not moment.now.lights:
        return None
    front = _front(moment)
    ahead = ((i, light) for i, light in enumerate(moment.scene.lights) if light.along >= front)
    return next(ahead, None)
