"""A kept test in words, its result against another ego, and where an ego may enter."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from cavsumo.kept.candidate import Candidate
from cavsumo.kept.entries import RouteLanes
from cavsumo.kept.motion import BodyMotion, MotionLeg
from cavsumo.kept.regression import ELSEWHERE, ERROR, FAILS, PASSES, STANDS, judged
from cavsumo.kept.sentence import in_words
from cavsumo.model.carriageway import StartRecord
from cavsumo.model.departures import Entry, Trip
from cavsumo.model.scenario import BatchPlan, Scenario

EARLY, LATE = "tester0 left the world at 2.0 s", "tester0 left the world at 22.6 s"
ROW = {
    "time_s": "2.700",
    "outcome": "violated", "assertion": "reaction-zone", "tester": "tester0", "avoidable": "1",
    "reference": "human", "violation_time_s": "2.700", "impact_speed_mps": "2.500",
}  # fmt: skip
START = StartRecord(209.0, 73.0, -math.pi / 2, 0.0)
WAITS = BodyMotion(START, (MotionLeg(0, 0.0), MotionLeg(15, 1.4)))


def plan(**settings: Any) -> BatchPlan:
    """A plan at the crossing."""
    return BatchPlan(scenario=Scenario(net="crossing", **settings))


def test_a_test_in_a_sentence() -> None:
    """Each leg, the entry of the ego, the impact, and the reference driver."""
    small = Candidate((1,), (WAITS,), entry=Entry(0, 1, 70.0, 8.0))
    assert in_words(plan(), ROW, small) == (
        "On crossing, a pedestrian at (209, 73) stands until 1.5 s, then walks straight to the "
        "south at 1.4 m/s; ego sumo enters at 8 m/s and hits it at 2.7 s, closing at 2.5 m/s; a "
        "careful human driver (UN R157) would have avoided that."
    )


def test_several_testers_and_traffic() -> None:
    """They have names; what is on a track or as recorded says so."""
    along = BodyMotion(START, (MotionLeg(0, 5.0),), way=((0.0, 0.0), (1.0, 1.0)))
    trip = Trip(0.0, "a", "t", ("e",), 0, 1.0, 1.0, 1.0)
    large = Candidate((0, 1), (along, BodyMotion(START)), trips=(trip,))
    row = {**ROW, "tester": "tester1", "avoidable": "", "impact_speed_mps": ""}
    assert in_words(plan(kind="car"), row, large) == (
        "On crossing, among 1 of the background, tester0 at (209, 73) drives along its track at 5 "
        "m/s; tester1 at (209, 73) moves as recorded, in 0 segments; ego sumo violates "
        "reaction-zone at 2.7 s."
    )


@pytest.mark.parametrize(
    ("changed", "stands", "status"),
    [
        ({}, False, FAILS),
        ({"verdicts": "reaction-zone=held standing=held"}, False, PASSES),
        ({"verdicts": "reaction-zone=held standing=held"}, True, STANDS),
        ({"verdicts": "reaction-zone=held standing=violated"}, False, STANDS),
        ({"verdicts": "reaction-zone=not_triggered standing=violated"}, False, STANDS),
        ({"verdicts": "reaction-zone=not_triggered standing=held"}, False, ELSEWHERE),
        ({"verdicts": "reaction-zone=unfair standing=held"}, False, ELSEWHERE),
        ({"outcome": "error", "error": "it died"}, False, ERROR),
        (
            {"outcome": "invalid", "verdicts": "reaction-zone=held", "breach": EARLY},
            False,
            ELSEWHERE,
        ),
        ({"outcome": "invalid", "verdicts": "reaction-zone=held", "breach": LATE}, False, PASSES),
        ({"verdicts": "reaction-zone=violated standing=violated"}, True, FAILS),
    ],
)
def test_the_result_of_a_kept_test(changed: dict[str, str], stands: bool, status: str) -> None:
    """An ego that stands is never taken for one that passes, but for one that fails if it does."""
    row = {**ROW, "verdicts": "reaction-zone=violated standing=held", "error": "", "breach": ""}
    if not changed.get("verdicts", "violated").startswith("reaction-zone=violated"):
        row["outcome"] = "held"
    assert judged(ROW, row | changed, stands=stands)[0] == status


def test_an_ego_enters_on_a_lane_of_its_route(networks: dict[str, Path]) -> None:
    """At its front bumper; not beside the lane, not turned away from it, not elsewhere."""
    lanes = RouteLanes(networks["pedestrians"], ["eastbound"])
    found = lanes.entry((20.0, -1.825, 7.0, 0.0), 4.0)
    assert found is not None
    assert (found.edge, found.lane, found.speed) == (0, 1, 7.0)
    assert found.along == pytest.approx(22.0, abs=0.1)
    assert lanes.entry((20.0, -1.0, 7.0, 0.0), 4.0) is None
    assert lanes.entry((20.0, -1.825, 7.0, 0.5), 4.0) is None
    assert lanes.entry((-50.0, -1.825, 7.0, 0.0), 4.0) is None
