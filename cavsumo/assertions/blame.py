"""Which party broke which rule first in a violated episode: a hint by rules, not law.

For each rule the time is found at which it was first broken, up to the violation. The earliest
counts, at equal times the first in RULES. If none was broken there is no blame: both parties may
have obeyed all rules, or the broken rule is not among them. docs/fairness.md lists the rules with
their sources.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import shapely

from cavsumo.assertions.base import Judgement
from cavsumo.assertions.contacts import STANDING_MPS
from cavsumo.assertions.metrics.highway_code import DECEL, MPH, THINKING_S
from cavsumo.assertions.metrics.rss import rss_longitudinal, rss_longitudinal_opposite
from cavsumo.assertions.red_light import RED
from cavsumo.assertions.relations import Relation, front_along, relation
from cavsumo.model.carriageway import MarkedCrossing
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.model.zone_presence import is_vehicle

# Responsibility-Sensitive Safety with the parameters of CARLA's RSS sensor (RssCheck.cpp).
RHO_S, ACCEL, B_MIN, B_MIN_CORRECT, B_MAX = 1.0, 3.5, 4.0, 3.0, 8.0  # s, m/s2
# From where speed is enforced in the UK (National Police Chiefs' Council): 10 % and 2 mph over.
SPEED_SHARE, SPEED_PLUS = 1.1, 2.0 * MPH
AFTER_LINE_M = 60.0  # a stop line farther back than this is not related to the violation


@dataclass(frozen=True)
class Case:
    """A violated episode until the violation.

    Attributes:
        snapshots: one a timestep, the last is that of the violation.
        trigger: when the encounter began [s].
        body: index of the tester's body involved, None without one or for a background body.
        relations: position of that body relative to the ego in each snapshot; empty without one.
    """

    scene: Scene
    snapshots: Sequence[Snapshot]
    trigger: float
    body: int | None
    relations: Sequence[Relation]

    @property
    def tester(self) -> list[BodyState]:
        """The states of the tester's body."""
        assert self.body is not None
        return [snapshot.testers[self.body] for snapshot in self.snapshots]


def blamed(scene: Scene, snapshots: Sequence[Snapshot], judgement: Judgement) -> str:
    """The first rule broken, as ``party:rule``; empty if none was."""
    case = _case(scene, snapshots, judgement)
    broken = [(when, name) for name, rule in RULES.items() if (when := rule(case)) is not None]
    return min(broken, key=lambda found: found[0])[1] if broken else ""


def _case(scene: Scene, snapshots: Sequence[Snapshot], judgement: Judgement) -> Case:
    """The case of an episode."""
    end = judgement.violation_time
    assert end is not None  # it was violated
    seen = [s for s in snapshots if s.time <= end + 1e-9]
    names = [body.id for body in scene.bodies]
    body = names.index(judgement.tester) if judgement.tester in names else None
    found = [] if body is None else [relation(scene, s, s.testers[body]) for s in seen]
    begun = judgement.trigger_time
    return Case(scene, seen, end if begun is None else begun, body, found)


def ran_red_light(case: Case) -> float | None:
    """The ego's front passed the last stop line before the violation at red (rule 109)."""
    scene, last = case.scene, front_along(case.scene, case.snapshots[-1])
    passed = [i for i, light in enumerate(scene.lights) if light.along <= last]
    if not passed or last - scene.lights[passed[-1]].along > AFTER_LINE_M:
        return None
    i = passed[-1]
    for before, after in pairwise(case.snapshots):
        if front_along(scene, before) <= scene.lights[i].along < front_along(scene, after):
            letters = before.lights[i : i + 1] + after.lights[i : i + 1]
            red = len(letters) == 2 and all(letter in RED for letter in letters)
            return after.time if red else None
    return None


def speeded(case: Case) -> float | None:
    """The ego was above the speed limit when the encounter began or later (rule 124).

    The time is the beginning of the last uninterrupted excess.
    """
    since: float | None = None
    for snapshot in case.snapshots:
        limit = _limit(case.scene, snapshot)
        if limit is None or snapshot.ego.v <= limit * SPEED_SHARE + SPEED_PLUS:
            since = None
            continue
        since = snapshot.time if since is None else since
        if snapshot.time >= case.trigger - 1e-9:
            return since
    return None


def _limit(scene: Scene, snapshot: Snapshot) -> float | None:
    """The speed limit where the ego is [m/s]."""
    along = scene.ego_progress(snapshot)
    past = [limit.speed for limit in scene.limits if limit.along <= along]
    return past[-1] if past else None


def answered_improperly(case: Case) -> float | None:
    """The ego did not respond properly to a body in its way (RSS, arXiv 1708.06374, definition 4).

    While the body is in its way and nearer than the safe distance, the ego accelerates by at most
    ACCEL for RHO_S, then brakes by at least B_MIN (B_MIN_CORRECT before one that comes towards it)
    until it stands. The time is when it first failed to.
    """
    if case.body is None:
        return None
    since: float | None = None
    for (before, after), there in zip(pairwise(case.snapshots), case.relations[1:], strict=True):
        if not (there.in_way and there.ahead > 0.0 and there.ahead < _safe(after, there)):
            since = None
            continue
        since = after.time if since is None else since
        decel = (before.ego.v - after.ego.v) / case.scene.dt
        answering = after.time - since > RHO_S + case.scene.dt - 1e-9
        least = (B_MIN_CORRECT if there.onward < 0.0 else B_MIN) if answering else -ACCEL
        if after.time > since and after.ego.v > STANDING_MPS and decel < least - 0.05:
            return after.time
    return None


def _safe(snapshot: Snapshot, other: Relation) -> float:
    """The safe distance to a body ahead (definitions 1 and 2) [m]."""
    v = snapshot.ego.v
    if other.onward < -STANDING_MPS:
        opposite = rss_longitudinal_opposite(v, other.onward, RHO_S, ACCEL, B_MIN_CORRECT, B_MIN)
        return float(opposite)
    return float(rss_longitudinal(v, max(0.0, other.onward), RHO_S, ACCEL, B_MIN, B_MAX))


def walked_at_red(case: Case) -> float | None:
    """A pedestrian stepped out onto a crossing at lights that showed red to it (rule 21).

    The crossing is that on which the body came into the ego's way. A pedestrian that started there,
    or stepped out before the red, did not break the rule.
    """
    step, red = _crossed_at_lights(case)
    return case.snapshots[step].time if step is not None and red else None


def _crossed_at_lights(case: Case) -> tuple[int | None, bool]:
    """When a pedestrian came onto a crossing at lights, and whether it showed red then.

    The snapshot in which it came onto the crossing, or the carriageway beside it; None if it came
    into the ego's way anywhere else, or began there.
    """
    entered = None if case.body is None or is_vehicle(case.tester[0]) else _entered(case)
    if entered is None:
        return None, False
    here = case.tester[entered]
    for i, crossing in enumerate(case.scene.crossings):
        if crossing.light is None or not shapely.contains_xy(crossing.surface, here.x, here.y):
            continue
        step = entered
        while step and _on_road(case, crossing, case.tester[step - 1]):
            step -= 1
        letters = [s.crossing_lights[i : i + 1] for s in case.snapshots[step - 1 : step + 1]]
        red = len(letters) == 2 and all(one and one[0] in RED for one in letters)
        return step or None, red
    return None, False


def _on_road(case: Case, crossing: MarkedCrossing, body: BodyState) -> bool:
    """Whether a body is on a crossing or a carriageway."""
    roads = case.scene.roads
    if roads is not None and roads.contains(body.x, body.y):
        return True
    return bool(shapely.contains_xy(crossing.surface, body.x, body.y))


def stepped_out(case: Case) -> float | None:
    """A pedestrian stepped onto the carriageway within the ego's stopping distance.

    The step is the last time before the violation at which the body came onto the carriageway or,
    on it, began to walk, while it was not yet in the ego's way. The stopping distance is that of
    rule 126, thinking and braking. Not so at a crossing at lights that did not show red to it.
    """
    roads = case.scene.roads
    if roads is None or case.body is None or is_vehicle(case.tester[0]):
        return None
    crossed, red = _crossed_at_lights(case)
    if crossed is not None and not red:
        return None
    step: int | None = None
    walked = False
    for i, (body, there) in enumerate(zip(case.tester, case.relations, strict=True)):
        if there.in_way:
            break
        walks = body.v > STANDING_MPS and roads.contains(body.x, body.y)
        if walks and not walked:
            step = i
        walked = walks
    return None if step is None or not walked else _too_near(case, step)


def stepped_in(case: Case) -> float | None:
    """A pedestrian came into the ego's way within its stopping distance, from any place.

    By RSS the party that makes the lateral distance unsafe last is responsible (definition 8): a
    pedestrian who already walks on the carriageway must still let a vehicle pass that cannot stop.
    This does not hold on marked crossings with lights or priority, where the ego may have had to
    wait.
    """
    if case.body is None or is_vehicle(case.tester[0]):
        return None
    entered = _entered(case)
    if entered is None:
        return None
    body = case.tester[entered]
    crossings = [c.surface for c in case.scene.crossings if c.signalled or c.priority]
    if any(shapely.contains_xy(surface, body.x, body.y) for surface in crossings):
        return None
    return _too_near(case, entered)


def _entered(case: Case) -> int | None:
    """The snapshot in which the body last came into the ego's way."""
    steps = enumerate(pairwise(case.relations), 1)
    entered = [i for i, (before, after) in steps if after.in_way and not before.in_way]
    return entered[-1] if entered else None


def _too_near(case: Case, step: int) -> float | None:
    """The time of a snapshot in which the body is within the ego's stopping distance (rule 126)."""
    v, ahead = case.snapshots[step].ego.v, case.relations[step].ahead
    near = 0.0 < ahead < THINKING_S * v + v * v / (2.0 * DECEL)
    return case.snapshots[step].time if near else None


def cut_in(case: Case) -> float | None:
    """A vehicle came into the ego's way nearer than the safe distance, without right of way.

    That is from a lane beside or, where it had to give way, from another road. By RSS the party
    that makes the second of the two distances unsafe is responsible (definition 8).
    """
    if case.body is None or not is_vehicle(case.tester[0]):
        return None
    approach = case.scene.starts[case.body].approach
    if approach is None or not (approach.yields or approach.type == "adjacent"):
        return None
    entered = _entered(case)
    if entered is None:
        return None
    there, snapshot = case.relations[entered], case.snapshots[entered]
    near = -snapshot.ego.body.kind.length < there.ahead < _safe(snapshot, there)
    return snapshot.time if near else None


RULES: Mapping[str, Callable[[Case], float | None]] = {
    "ego:red-light": ran_red_light,
    "ego:speed": speeded,
    "ego:rss-response": answered_improperly,
    "tester:red-man": walked_at_red,
    "tester:stepped-out": stepped_out,
    "tester:stepped-in": stepped_in,
    "tester:cut-in": cut_in,
}
