"""An episode's extremes: what the bounds leave out changes nothing."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cavsumo.assertions.contacts import ContactMonitor
from cavsumo.assertions.criticality_monitor import (
    HORIZON_S,
    CriticalityMonitor,
    Extremes,
    pet,
    stretches,
    track,
)
from cavsumo.assertions.metrics.encroachment import pet_tracks
from cavsumo.assertions.metrics.plane import drac_boxes, ttc_boxes
from cavsumo.model.bodies import CAR, PEDESTRIAN, Body
from cavsumo.model.snapshot import BodyState, Snapshot

EGO, WALKER = Body("ego", CAR), Body("tester0", PEDESTRIAN)
State = tuple[float, float, float, float]  # x, y, v, o
Turns = Sequence[tuple[float, float, int]]  # speed, heading, number of timesteps
ANGLES = st.floats(-math.pi, math.pi)
STATES = st.tuples(st.floats(-30, 30), st.floats(-30, 30), st.floats(0, 10), ANGLES)


def moved(state: State, steps: int, stops: int = 10**6) -> list[State]:
    """A body that drives straight on and stands from some step on."""
    x, y, v, o = state
    found = []
    for i in range(steps):
        found.append((x, y, v if i < stops else 0.0, o))
        if i < stops:
            x, y = x + 0.1 * v * math.cos(o), y + 0.1 * v * math.sin(o)
    return found


def winding(turns: Turns) -> list[State]:
    """A body that drives at a speed and heading for some steps, then at the next."""
    x, y, found = 0.0, 0.0, []
    for v, o, steps in turns:
        for _ in range(steps):
            found.append((x, y, v, o))
            x, y = x + 0.1 * v * math.cos(o), y + 0.1 * v * math.sin(o)
    return found


def snapshots(egos: Sequence[State], testers: Sequence[State]) -> list[Snapshot]:
    """What is seen at each timestep."""
    return [
        Snapshot(i, round(0.1 * i, 6), BodyState(EGO, *e), 0.0, (BodyState(WALKER, *t),))
        for i, (e, t) in enumerate(zip(egos, testers, strict=True))
    ]


def extremes(seen: Sequence[Snapshot]) -> tuple[Extremes, list[Snapshot]]:
    """What is found, and the snapshots before the first contact."""
    criticality, monitor = CriticalityMonitor(), ContactMonitor()
    before: list[Snapshot] = []
    for snapshot in seen:
        criticality.observe(snapshot, monitor.observe(snapshot))
        if not monitor.ego_pairs:
            before.append(snapshot)
    return criticality.extremes(), before


def velocity(state: BodyState) -> tuple[float, float]:
    return state.v * math.cos(state.o), state.v * math.sin(state.o)


@settings(deadline=None)
@given(ego=STATES, tester=STATES, stops=st.integers(0, 60))
def test_bounds_leave_nothing_out(ego: State, tester: State, stops: int) -> None:
    """The extremes are those of all pairs and of whole tracks."""
    seen = snapshots(moved(ego, 60, stops), moved(tester, 60, 30))
    found, before = extremes(seen)
    pairs = [(s.ego, s.testers[0]) for s in before if s.ego.v > 0.1]
    ttc = [float(ttc_boxes(a.box, velocity(a), b.box, velocity(b))) for a, b in pairs]
    drac = [float(drac_boxes(a.box, velocity(a), b.box, velocity(b))) for a, b in pairs]
    near = [i for i, t in enumerate(ttc) if t <= HORIZON_S]
    assert found.ttc == pytest.approx(min((ttc[i] for i in near), default=math.inf))
    assert found.drac == pytest.approx(max((drac[i] for i in near), default=0.0))
    if len(before) < len(seen):
        assert found.pet == 0.0
        return
    whole = pet_tracks(
        [s.time for s in seen], [s.ego.box for s in seen], [s.testers[0].box for s in seen]
    )
    assert found.pet == pytest.approx(whole if whole <= HORIZON_S else math.inf)


TURNS = st.lists(st.tuples(st.floats(0, 10), ANGLES, st.integers(1, 20)), min_size=1, max_size=6)


@settings(deadline=None)
@given(ego=TURNS, tester=TURNS)
def test_pet_of_winding_tracks(ego: Turns, tester: Turns) -> None:
    """Whatever parts the tracks are cut into, the time is that of all pairs of places."""
    mine, theirs = (
        [(round(0.1 * i, 6), BodyState(body, *s)) for i, s in enumerate(winding(turns))]
        for body, turns in ((EGO, ego), (WALKER, tester))
    )
    length = min(len(mine), len(theirs))
    mine, theirs = mine[:length], theirs[:length]
    whole = pet_tracks([t for t, _ in mine], [s.box for _, s in mine], [s.box for _, s in theirs])
    tracks = [track(*zip(*one, strict=True)) for one in (mine, theirs)]
    found = pet(stretches(tracks[0], CAR.reach + PEDESTRIAN.reach + 1e-6), tracks[1])
    assert found == pytest.approx(whole if whole <= HORIZON_S else math.inf)


def test_hand_computed() -> None:
    """A car at 10 m/s towards somebody who stands 30 m ahead of its bumper; and who walked off."""
    standing = (2.25 + 30.0 + 0.65625 / 2, 0.0, 0.0, 0.0)
    found, _ = extremes(snapshots(moved((0.0, 0.0, 10.0, 0.0), 11), [standing] * 11))
    assert found.ttc == pytest.approx(2.0)  # after a second 20 m are left
    assert found.drac == pytest.approx(10.0**2 / (2 * 20.0))
    assert found.pet == math.inf
    crossing = moved((20.0, -3.0, 2.0, math.pi / 2), 40)
    found, _ = extremes(snapshots(moved((-10.0, 0.0, 10.0, 0.0), 40), crossing))
    left, came = (3.0 + 0.875 + 0.328125) / 2.0, (30.0 - 2.25 - 0.4375) / 10.0
    assert found.pet == pytest.approx(came - left, abs=0.2)


def test_nobody_is_not_critical() -> None:
    """Without testers, or with an ego that stands, there is nothing to measure."""
    nothing = Extremes(math.inf, 0.0, math.inf)
    assert CriticalityMonitor().extremes() == nothing
    still = snapshots([(0.0, 0.0, 0.0, 0.0)] * 5, moved((20.0, 0.0, 1.4, math.pi), 5))
    assert extremes(still)[0] == nothing


def test_a_body_that_stands_is_two_places() -> None:
    """The first and the last time, however long it stands, and PET knows both."""
    waits = [(5.0, 5.0, 0.0, 0.0)] * 20 + moved((5.0, 5.0, 10.0, 0.0), 5)
    states = [(0.1 * i, BodyState(WALKER, *s)) for i, s in enumerate(waits)]
    places = track(*zip(*states, strict=True))
    assert len(places) == 6
    passes = stretches([(9.0, states[0][1])], 2 * PEDESTRIAN.reach)
    assert pet(passes, places) == pytest.approx(9.0 - 2.0, abs=0.2)
