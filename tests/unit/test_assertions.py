"""Verdicts: what is a test, what is unfair, what is a failure and what is none."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from support import DATA

from cavsumo.agents.base import Scene
from cavsumo.assertions import ASSERTIONS, Assertion
from cavsumo.assertions.contacts import ContactMonitor
from cavsumo.model.bodies import CAR, PEDESTRIAN, Body
from cavsumo.model.carriageway import Start
from cavsumo.model.kinematics import step_floats
from cavsumo.model.polyline import Path as Polyline
from cavsumo.model.snapshot import BodyState, Snapshot

CASES = json.loads((DATA / "assertion_vectors.json").read_text())["cases"]
ZONES = [c for c in CASES if c["metric"] == "cavgym_zones"]
VERDICTS = {"interesting": "held", "uninteresting_terminated": "unfair", "none": "not_triggered"}

State = tuple[float, float, float, float]  # x, y, v, o
DT, SPEED = 0.1, 6.75
# At 6.75 m/s: bumper at 2.25 m, braking zone to 4.78 m, reaction zone to 9.34 m from the centre.
BRAKING, REACTION, BEYOND = 4.0, 7.0, 10.0
FULL_LOCK = CAR.steering_max


def person(x: float, y: float = 0.0, v: float = 0.0, o: float = math.pi / 2) -> State:
    """A pedestrian, facing north unless told otherwise."""
    return x, y, v, o


def snapshot(step: int, ego: State, testers: Sequence[State], steering: float = 0.0) -> Snapshot:
    """What is seen at a timestep."""
    bodies = [Body(f"tester{i}", PEDESTRIAN) for i in range(len(testers))]
    states = tuple(BodyState(b, *s) for b, s in zip(bodies, testers, strict=True))
    return Snapshot(step, DT * step, BodyState(Body("ego", CAR), *ego), steering, states)


def judged(
    frames: Sequence[tuple[State, Sequence[State]]],
    name: str = "reaction-zone",
    steering: float = 0.0,
    **params: float,
) -> Assertion:
    """The assertion after an episode of these frames (ego, testers), with their real contacts."""
    assertion, monitor = ASSERTIONS.make(name, params), ContactMonitor()
    starts = tuple(Start(*s[:2], s[3]) for s in frames[0][1])
    bodies = tuple(Body(f"tester{i}", PEDESTRIAN) for i in range(len(starts)))
    path = Polyline([(0, 0), (100, 0)])
    assertion.reset(Scene(DT, Body("ego", CAR), path, bodies, starts))
    for step, (ego, testers) in enumerate(frames):
        seen = snapshot(step, ego, testers, steering)
        assertion.observe(seen, monitor.observe(seen))
    return assertion


def drive(testers: Sequence[State], steps: int, decel: float = 0.0) -> list[Any]:
    """Frames of an ego from the origin at 6.75 m/s, braking or not, with bodies that stand."""
    state: State = (0.0, 0.0, SPEED, 0.0)
    frames = []
    for _ in range(steps):
        frames.append((state, testers))
        state = step_floats(*state, -decel, 0.0, CAR.wheelbase, 0.0, 9.0, DT)
    return frames


def at(x: float, v: float = SPEED) -> State:
    """The ego on its straight way."""
    return x, 0.0, v, 0.0


@pytest.mark.parametrize("pose", [(0.0, 0.0, 0.0), (40.0, -7.0, 2.5), (-300.0, 500.0, -1.0)])
@pytest.mark.parametrize("case", ZONES, ids=[c["id"] for c in ZONES])
def test_cav_gyms_verdicts(case: Mapping[str, Any], pose: tuple[float, float, float]) -> None:
    """Interesting is a test, uninteresting is unfair, wherever the ego is and wherever it heads."""
    given = case["input"]
    x, y, o = pose
    along, across = given["ped_centre_ego_frame"]
    there = (
        x + along * math.cos(o) - across * math.sin(o),
        y + along * math.sin(o) + across * math.cos(o),
        1.4,
        o + given["ped_heading_ego_frame"],
    )
    frame = ((x, y, given["ego_speed"], o), [there])
    zones = {key: given[key] for key in ("max_decel", "reaction_time")}
    assertion = judged([frame], steering=given["steering"], **zones)
    assert assertion.judgement.verdict == VERDICTS[case["expect"]["verdict"]]


@pytest.mark.parametrize(
    ("x", "verdict"),
    [(0.0, "unfair"), (BRAKING, "unfair"), (REACTION, "held"), (BEYOND, "not_triggered")],
)
def test_the_first_zone_decides(x: float, verdict: str) -> None:
    """On the ego or in its braking zone is unfair, in the reaction zone a test, beyond nothing."""
    assertion = judged([(at(0.0), [person(x)])])
    assert assertion.judgement.verdict == verdict
    assert assertion.decided is (verdict == "unfair")
    assert assertion.pending is (verdict == "held")


def test_who_stands_at_the_kerb_is_in_no_zone() -> None:
    """The strip is as wide as the ego: beside it an ego passes without a test."""
    assertion = judged(drive([person(20.0, 1.3)], 40))
    assert assertion.judgement.verdict == "not_triggered"
    assert not assertion.decided


def test_unfair_wins_in_the_same_timestep() -> None:
    """One fair and one unfair tester at once make the test unfair, and the unfair one is named."""
    assertion = judged([(at(0.0), [person(REACTION), person(BRAKING)])])
    assert assertion.judgement.verdict == "unfair"
    assert assertion.judgement.tester == "tester1"
    assert assertion.judgement.trigger_time is None


def test_zones_depend_on_the_speed_and_the_driver_assumed() -> None:
    """At 15 m/s braking takes 12.5 m; at 6.75 m/s with 3 m/s2 instead of 9 it takes 7.6 m."""
    assert judged([(at(0.0, 15.0), [person(BEYOND)])]).judgement.verdict == "unfair"
    frame = [(at(0.0), [person(REACTION)])]
    assert judged(frame, max_decel=3.0).judgement.verdict == "unfair"
    assert judged(frame, reaction_time=0.1).judgement.verdict == "not_triggered"


def on_the_arc(distance: float, side: float) -> State:
    """A pedestrian at an arc length before the bumper of the ego at the origin, at full lock.

    The middle of the bumper goes around the centre of rotation, abreast of the rear axle.
    """
    rear, radius = -CAR.wheelbase / 2, CAR.wheelbase / math.tan(FULL_LOCK)
    ahead = CAR.length / 2 - rear
    angle = distance / math.hypot(radius, ahead)
    start = math.atan2(-radius, ahead)
    x = rear + math.hypot(radius, ahead) * math.cos(start + angle)
    y = radius + math.hypot(radius, ahead) * math.sin(start + angle)
    return x, side * y, 0.0, 0.0


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(
    ("distance", "verdict"), [(1.0, "unfair"), (5.0, "held"), (8.5, "not_triggered")]
)
def test_the_zones_follow_the_arc(distance: float, verdict: str, side: float) -> None:
    """At full lock braking ends 2.5 m along the arc and reaction 7.1 m, to the left and right."""
    frame = (at(0.0), [on_the_arc(distance, side)])
    assert judged([frame], steering=side * FULL_LOCK).judgement.verdict == verdict


def test_straight_ahead_of_a_turning_ego_is_out_of_its_way() -> None:
    """Who stands where the ego would go without steering is in no danger while it turns away."""
    frame = (at(0.0), [person(REACTION + 1.0)])
    assert judged([frame]).judgement.verdict == "held"
    assert judged([frame], steering=FULL_LOCK).judgement.verdict == "not_triggered"
    turned = (at(0.0), [on_the_arc(5.0, 1.0)])
    assert judged([turned]).judgement.verdict == "not_triggered"


def test_an_ego_that_drives_on_hits_and_fails() -> None:
    """Reaction zone first, then contact: violated, with times, speeds and who it was."""
    assertion = judged(drive([person(12.0)], 20))
    judgement = assertion.judgement
    assert (judgement.verdict, judgement.tester) == ("violated", "tester0")
    # The zone's end is 9.3375 m ahead of the centre, the bumper 2.25 m, the body 0.4375 m deep.
    assert judgement.trigger_time == pytest.approx(0.4)
    assert judgement.violation_time == pytest.approx(1.4)
    assert judgement.ego_speed == judgement.impact_speed == SPEED
    assert assertion.decided
    assert not assertion.pending


def test_an_ego_that_brakes_at_once_holds() -> None:
    """The same pedestrian in front of an ego that brakes with 9 m/s2 from the trigger on."""
    clear = drive([person(12.0)], 5)
    braking: State = clear[-1][0]
    for _ in range(30):
        braking = step_floats(*braking, -9.0, 0.0, CAR.wheelbase, 0.0, 9.0, DT)
        clear.append((braking, [person(12.0)]))
    assertion = judged(clear)
    assert assertion.judgement.verdict == "held"
    assert assertion.judgement.trigger_time == pytest.approx(0.4)
    assert assertion.judgement.violation_time is None
    assert assertion.decided


def test_standing_clear_takes_its_time() -> None:
    """An ego that stops is undecided until it stood for a second, and starts again to count."""
    stopped = [(at(1.0, 0.0), [person(REACTION)])]
    begin = [(at(0.0), [person(REACTION)])]
    assert judged(begin + stopped * 10).pending
    assert judged(begin + stopped * 11).decided
    creeping = [(at(1.0, 0.5), [person(REACTION)])]
    assert judged(begin + stopped * 10 + creeping + stopped * 10).pending
    assert judged(begin + stopped * 3, clear_s=0.2).decided


def test_an_ego_that_passes_holds() -> None:
    """A pedestrian who steps back just in time lets the ego by: held, once it has passed."""
    begin = [(at(0.0), [person(REACTION)])]
    beside = [(at(x), [person(REACTION, 1.4)]) for x in range(1, 10)]
    assert judged(begin + beside).pending
    passed = judged([*begin, *beside, (at(10.0), [person(REACTION, 1.4)])])
    assert passed.judgement.verdict == "held"
    assert passed.decided


def test_a_body_that_leaves_the_way_ends_the_test() -> None:
    """Who is well beside the ego's way was not hit: held, before the ego is past."""
    begin = [(at(0.0), [person(REACTION)])]
    left = judged([*begin, (at(0.7), [person(REACTION, 3.0)])])
    assert left.judgement.verdict == "held"
    assert left.decided


def test_a_contact_with_somebody_else_does_not_violate() -> None:
    """The test is about who triggered it; another one who jumps in front is no failure."""
    frames = [(at(0.0), [person(REACTION), person(3.0, 9.0)])]
    frames += [(at(0.7), [person(REACTION), person(3.0)])]
    assertion = judged(frames)
    assert assertion.judgement.verdict == "held"
    assert assertion.judgement.tester == "tester0"
    assert assertion.pending


def test_what_follows_a_verdict_changes_nothing() -> None:
    """A failure stays the failure it was, an unfair test unfair."""
    hit = drive([person(12.0)], 20)
    assert judged([*hit, (at(0.0), [person(BRAKING)])]).judgement == judged(hit).judgement
    unfair = [(at(0.0), [person(BRAKING)])]
    assert judged(unfair + hit).judgement == judged(unfair).judgement


@pytest.mark.parametrize("x", [0.0, 2.4, BRAKING, REACTION])
def test_who_walks_into_a_standing_ego_is_no_failure(x: float) -> None:
    """An ego that stands has no zones and hits nobody: nothing was tested."""
    assertion = judged([(at(0.0, 0.0), [person(x)])] * 5)
    assert assertion.judgement.verdict == "not_triggered"
    assert not assertion.decided


def test_who_walks_into_an_ego_that_stopped_for_him_is_no_failure() -> None:
    """The ego passed the test by stopping; that he then walks into its bumper is his affair."""
    begin = [(at(0.0), [person(REACTION)])]
    walking = [(at(3.0, 0.0), [person(REACTION - 0.15 * i)]) for i in range(12)]
    assertion = judged(begin + walking)
    assert assertion.judgement.verdict == "held"
    assert assertion.judgement.violation_time is None
    assert assertion.decided


def test_an_ego_that_then_drives_into_him_fails() -> None:
    """Leaning on a standing ego does not make one fair game for it when it drives off."""
    begin = [(at(0.0), [person(REACTION)])]
    touching = [(at(4.4, 0.0), [person(REACTION)])] * 3
    driving = [(at(4.4 + 0.1 * i, 1.0), [person(REACTION)]) for i in range(1, 60)]
    assert judged(begin + touching + driving).judgement.verdict == "violated"


@settings(deadline=None)
@example(9.703125, 3.40625)
@given(st.floats(9.7, 40.0), st.floats(0.0, 9.0))
def test_a_body_ahead_is_held_or_violated_as_the_ego_stops_short_or_not(
    x: float, decel: float
) -> None:
    """An ego that brakes evenly for one who stands ahead fails exactly if it drives into him."""
    frames = drive([person(x)], 150, decel)
    front = max(state[0] for state, _ in frames) + CAR.length / 2
    # Who creeps up to him with less than 0.1 m/s counts as standing: then it is neither.
    assume(abs(front - (x - PEDESTRIAN.width / 2)) > 0.02)
    verdict = judged(frames).judgement.verdict
    if front >= x - PEDESTRIAN.width / 2:
        assert verdict == "violated"
    else:
        assert verdict in ("held", "not_triggered")


def test_collision_is_violated_by_any_moving_contact() -> None:
    """Fair or not, the moving ego touched somebody: violated, with the closing speed."""
    assertion = judged(drive([person(12.0, 0.0, 1.0, math.pi)], 20), "collision")
    judgement = assertion.judgement
    assert (judgement.verdict, judgement.tester) == ("violated", "tester0")
    assert judgement.impact_speed == pytest.approx(SPEED + 1.0)
    assert judgement.violation_time == pytest.approx(1.4)
    assert assertion.decided


def test_collision_is_held_without_contact_and_by_a_standing_ego() -> None:
    """Nobody touched, or somebody walked into an ego that stood: held."""
    for frames in (drive([person(60.0)], 20), [(at(0.0, 0.0), [person(2.0)])] * 3):
        assertion = judged(frames, "collision")
        assert assertion.judgement.verdict == "held"
        assert not assertion.decided
