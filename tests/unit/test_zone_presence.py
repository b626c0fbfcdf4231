"""How tester vehicles count in the reaction-zone assertion, on the straight road without SUMO.

The ego drives at 8 m/s: it brakes within 3.56 m, its reaction zone is the 5.4 m after that.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import pytest

from cavsumo.assertions import ASSERTIONS
from cavsumo.assertions.base import HELD, NOT_TRIGGERED, UNFAIR, VIOLATED, Assertion
from cavsumo.assertions.contacts import ContactMonitor
from cavsumo.model.bodies import CAR
from cavsumo.model.zone_presence import drift

State = tuple[float, float, float, float]
LANE_Y, EGO_X, EGO_V, HALF = -1.825, 30.0, 8.0, 2.25
WIDE = 2 * HALF  # from centre to centre of two cars that touch


@pytest.fixture
def judged(straight_scene: Callable[..., Any], scene_snapshot: Callable[..., Any]) -> Any:
    """Call with (ego x, ego v) and the tester's state, timestep by timestep: the assertion then."""

    def judge(frames: Sequence[tuple[tuple[float, float], State]]) -> Assertion:
        scene = straight_scene([(frames[0][1][0], LANE_Y, 0.0)], kind=CAR)
        assertion, contacts = ASSERTIONS.make("reaction-zone", {}), ContactMonitor()
        assertion.reset(scene)
        for step, (ego, tester) in enumerate(frames):
            snapshot = scene_snapshot(scene, ego, [tester], step=step)
            assertion.observe(snapshot, contacts.observe(snapshot))
        return assertion

    return judge


def ahead(gap: float, v: float, y: float = LANE_Y, o: float = 0.0) -> Any:
    """A frame with a car whose rear is a gap ahead of the ego's front [m]."""
    return (EGO_X, EGO_V), (EGO_X + WIDE + gap, y, v, o)


@pytest.mark.parametrize("gap", [5.5, 6.0, 10.0, 20.0])
def test_following_at_an_ordinary_distance_is_no_test(judged: Any, gap: float) -> None:
    """As fast as the ego, a car needs as long to stop: only the reaction time counts."""
    assert judged([ahead(gap, EGO_V)]).judgement.verdict == NOT_TRIGGERED


@pytest.mark.parametrize(
    ("gap", "v", "verdict"),
    [  # gap + v^2 / 18 - 3.56 m is 0 at the near end of the reaction zone, 5.4 at its far end
        (5.3, 8.0, HELD),
        (0.1, 8.0, HELD),
        (8.0, 4.0, HELD),
        (8.2, 4.0, NOT_TRIGGERED),
        (3.0, 4.0, HELD),
        (2.6, 4.0, UNFAIR),
        (8.0, 0.0, HELD),
        (9.0, 0.0, NOT_TRIGGERED),
        (3.0, 0.0, UNFAIR),
    ],
)
def test_a_vehicle_counts_where_it_would_stand(
    judged: Any, gap: float, v: float, verdict: str
) -> None:
    """By its gap and the way that it would still make, braking at once."""
    assert judged([ahead(gap, v)]).judgement.verdict == verdict


@pytest.mark.parametrize("o", [0.0, math.pi])
@pytest.mark.parametrize("v", [0.0, 8.0])
def test_a_vehicle_in_its_own_lane_is_no_test(judged: Any, v: float, o: float) -> None:
    """Beside the ego, ahead of it or coming towards it, at any distance."""
    frames = [((EGO_X, EGO_V), (x, LANE_Y + 3.2, v, o)) for x in range(20, 60)]
    assert judged(frames).judgement.verdict == NOT_TRIGGERED


def test_who_comes_towards_the_ego_on_its_lane_counts_nearer(judged: Any) -> None:
    """Until an ego that brakes at once stands, it has come 5 m/s * 8 / 9 s nearer."""
    assert drift(-5.0, 8.0, 9.0) == pytest.approx(-40.0 / 9.0)
    coming = judged([ahead(12.0, 5.0, o=math.pi)])
    assert coming.judgement.verdict == HELD
    assert judged([ahead(12.0, 0.0)]).judgement.verdict == NOT_TRIGGERED


def test_running_into_a_car_that_brakes_is_a_failure(judged: Any) -> None:
    """First it stands in the reaction zone, then the ego's front touches its rear."""
    stands = (EGO_X + WIDE + 6.0, LANE_Y, 0.0, 0.0)
    frames = [((EGO_X + 0.8 * i, EGO_V), stands) for i in range(10)]
    assert judged(frames).judgement.verdict == VIOLATED


@pytest.mark.parametrize(
    ("x", "y", "o"),
    [
        (EGO_X - WIDE + 0.2, LANE_Y, 0.0),  # into its rear
        (EGO_X - 0.5, LANE_Y + 2.0, -math.pi / 2),  # into its side
    ],
)
def test_who_runs_into_the_ego_leaves_it_no_chance(
    judged: Any, x: float, y: float, o: float
) -> None:
    """Unfair, whether or not it had been in the reaction zone before."""
    hit = ((EGO_X, EGO_V), (x, y, 12.0, o))
    assert judged([hit]).judgement.verdict == UNFAIR
    after = judged([ahead(6.0, 0.0), hit]).judgement
    assert (after.verdict, after.trigger_time) == (UNFAIR, None)


def test_a_vehicle_that_drives_off_ends_the_encounter(judged: Any) -> None:
    """Once it is out of the zones and no slower than the ego for a second, the ego has coped."""
    off = [((EGO_X, 4.0), (EGO_X + WIDE + 12.0, LANE_Y, 6.0, 0.0)) for _ in range(12)]
    assertion = judged([ahead(6.0, 2.0), *off])
    assert assertion.decided
    assert assertion.judgement.verdict == HELD
    assert not judged([ahead(6.0, 2.0), *off[:5]]).decided
