"""Motions in legs: they come to the same place at the same time, and can begin later."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from cavsumo.kept.motion import BodyMotion, MotionLeg, TrackToViolation, gaining, in_legs
from cavsumo.model.bodies import CAR, PEDESTRIAN, Action, Body, Kind
from cavsumo.model.carriageway import StartRecord
from cavsumo.model.kinematics import step_floats
from cavsumo.model.snapshot import BodyState

DT = 0.1
KINDS = [PEDESTRIAN, CAR]


def track(motion: BodyMotion, kind: Kind, steps: int) -> list[tuple[float, ...]]:
    """The poses of a body that moves so."""
    start = motion.start
    state = BodyState(Body("a", kind), start.x, start.y, start.v or 0.0, start.o)
    poses = [tuple(state[1:])]
    for action in motion.played(kind, steps, DT):
        limits = kind.wheelbase, kind.v_min, kind.v_max, DT
        state = BodyState(state.body, *step_floats(*state[1:], *action, *limits))
        poses.append(tuple(state[1:]))
    return poses


def dawdling(kind: Kind) -> BodyMotion:
    """A body that goes, stops, waits, and goes on in another direction."""
    top = min(kind.throttle_max, 2.0)
    acting = [*[Action(-top, 0.3)] * 5, *[Action(-top, 0.0)] * 10, *[Action(0.0, 0.0)] * 20]
    acting += [*[Action(top, 0.0)] * 10, *[Action(0.0, 0.0)] * 15]
    return BodyMotion(StartRecord(1.0, 2.0, 0.5, 1.2), actions=tuple(acting))


@pytest.mark.parametrize("kind", KINDS)
def test_legs_lead_to_the_same_place_at_the_same_time(kind: Kind) -> None:
    """Within the way of half a timestep, and a little for the track's bends."""
    was = dawdling(kind)
    poses = track(was, kind, len(was.actions))
    found = in_legs(was, TrackToViolation(tuple(poses), kind, DT))
    assert [motion.segments for motion in found] == sorted(m.segments for m in found)
    assert found[-1].segments == 2
    for motion in found:
        end = track(motion, kind, len(poses) - 1)[-1]
        fast = motion.legs[-1].speed
        assert math.dist(end[:2], poses[-1][:2]) < fast * DT + 0.05, motion
        assert end[2] == pytest.approx(fast)


@pytest.mark.parametrize("kind", KINDS)
def test_speeds_change_within_the_limits(kind: Kind) -> None:
    """By the acceleration of a calm driver, or of a pedestrian; standing it does not move."""
    legs = (MotionLeg(0, 0.0), MotionLeg(10, 1.4))
    motion = BodyMotion(StartRecord(0.0, 0.0, 0.0, 0.0), legs)
    poses = track(motion, kind, 40)
    assert {pose[:2] for pose in poses[:11]} == {(0.0, 0.0)}
    gains = [(after[2] - before[2]) / DT for before, after in pairwise(poses)]
    assert max(gains) == pytest.approx(gaining(kind))
    assert poses[-1][2] == pytest.approx(1.4)
    assert {pose[1] for pose in poses} == {0.0}


@pytest.mark.parametrize("steps", [0, 5, 12, 30])
def test_a_motion_that_begins_later_goes_on_the_same(steps: int) -> None:
    """In legs and as recorded."""
    legs = (MotionLeg(0, 0.0), MotionLeg(10, 1.4))
    was = BodyMotion(StartRecord(0.0, 0.0, 0.3, 0.0), legs)
    for motion in (was, dawdling(PEDESTRIAN)):
        poses = track(motion, PEDESTRIAN, 40)
        later = motion.later(poses[steps], steps)
        again = track(later, PEDESTRIAN, 40 - steps)
        for pose, was_then in zip(again, poses[steps:], strict=True):
            assert pose == pytest.approx(was_then)


@pytest.mark.parametrize("steps", [-7, 4])
@pytest.mark.parametrize("first", [0.0, 1.4])
@pytest.mark.parametrize("way", [(), ((-20.0, 0.0), (20.0, 0.0))])
def test_a_motion_at_another_time_is_the_same(
    way: tuple[tuple[float, float], ...], first: float, steps: int
) -> None:
    """It comes to every place so many timesteps earlier, or later."""
    legs = (MotionLeg(0, first), MotionLeg(10, 0.7))
    was = BodyMotion(StartRecord(0.0, 0.0, 0.0, first), legs, way)
    shifted = was.shifted(steps, DT)
    assert shifted is not None
    poses, again = track(was, PEDESTRIAN, 40), track(shifted, PEDESTRIAN, 40)
    for step, pose in enumerate(poses):
        if 0 <= step - steps <= 40:
            assert again[step - steps] == pytest.approx(pose, abs=1e-9), step


def test_a_motion_without_room_is_not_shifted() -> None:
    """In time before its second leg, along its way before its beginning; nor one as recorded."""
    start, way = StartRecord(0.0, 0.0, 0.0, 1.4), ((-1.0, 0.0), (20.0, 0.0))
    standing = BodyMotion(start._replace(v=0.0), (MotionLeg(0, 0.0), MotionLeg(10, 0.7)))
    assert standing.shifted(10, DT) is None
    assert BodyMotion(start, (MotionLeg(0, 1.4),), way).shifted(-8, DT) is None
    assert dawdling(PEDESTRIAN).shifted(1, DT) is None


def test_segments_of_what_was_recorded() -> None:
    """Parts with one action each."""
    assert dawdling(PEDESTRIAN).segments == 5


def test_a_body_that_always_moves_needs_one_leg() -> None:
    """Straight on at its speed, from where it started."""
    was = BodyMotion(StartRecord(0.0, 0.0, 0.3, 1.4), actions=(Action(0.0, 0.0),) * 30)
    poses = track(was, PEDESTRIAN, 30)
    found = in_legs(was, TrackToViolation(tuple(poses), PEDESTRIAN, DT))[0]
    assert found.legs == (MotionLeg(0, 1.4),)
    assert not found.way
    assert (found.start.x, found.start.y) == pytest.approx((0.0, 0.0), abs=1e-9)
