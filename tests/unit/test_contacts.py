"""Who touches whom: once, at its beginning, and how close the ego came."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cavsumo.assertions.contacts import Contact, ContactMonitor
from cavsumo.model.bodies import BUS, CAR, PEDESTRIAN, Body, Kind
from cavsumo.model.geometry import gap, overlap
from cavsumo.model.snapshot import BodyState, Snapshot

State = tuple[float, float, float, float]
Others = Sequence[tuple[Kind, State]]

places = st.floats(-12.0, 12.0)
states = st.tuples(places, places, st.floats(0.0, 9.0), st.floats(-math.pi, math.pi))
walks = st.lists(st.tuples(states, st.lists(states, min_size=2, max_size=2)), max_size=12)
EGO_AT_REST: State = (0.0, 0.0, 0.0, 0.0)
SIDE = 0.875 + 0.4375  # a pedestrian abreast of the car touches it [m]


def at(step: int, ego: State, testers: Sequence[State] = (), others: Others = ()) -> Snapshot:
    """What is seen at a timestep: the ego, pedestrians, and others of any kind."""
    return Snapshot(
        step,
        0.1 * step,
        BodyState(Body("ego", CAR), *ego),
        0.0,
        tuple(BodyState(Body(f"tester{i}", PEDESTRIAN), *s) for i, s in enumerate(testers)),
        tuple((Body(f"other{i}", kind), *s) for i, (kind, s) in enumerate(others)),
    )


def names(contacts: Sequence[Contact]) -> list[tuple[str, str]]:
    """Who is involved in each contact."""
    return [(c.a.id, c.b.id) for c in contacts]


# Contacts -----------------------------------------------------------------------------------------


def test_a_contact_is_reported_when_it_begins_and_once() -> None:
    """A pedestrian who leans on the car for three timesteps touches it once; one who returns twice.

    The pair counts once whatever it does.
    """
    monitor = ContactMonitor()
    apart, together = (0.0, 3.0, 1.0, 0.0), (0.0, 1.0, 1.0, 0.0)
    seen = [
        names(monitor.observe(at(i, EGO_AT_REST, [s])))
        for i, s in enumerate([apart, together, together, together, apart, together])
    ]
    assert seen == [[], [("ego", "tester0")], [], [], [], [("ego", "tester0")]]
    assert monitor.ego_pairs == {("ego", "tester0")}
    assert monitor.tester_pairs == set()


def test_touching_is_contact_and_a_hair_apart_is_none() -> None:
    """Sides that meet touch; a nanometre between them is a gap."""
    for lateral, count in ((SIDE, 1), (SIDE + 1e-9, 0)):
        contacts = ContactMonitor().observe(at(0, EGO_AT_REST, [(0.0, lateral, 1.0, 0.0)]))
        assert len(contacts) == count


def test_everybody_is_watched_who_is_not_only_background() -> None:
    """Ego with testers and background, testers with each other and background; no others.

    Two background bodies on top of each other are SUMO's business.
    """
    monitor = ContactMonitor()
    snapshot = at(
        0,
        EGO_AT_REST,
        [(0.0, 0.0, 1.0, 0.0), (0.3, 0.0, 1.0, 0.0), (50.0, 0.0, 1.0, 0.0)],
        [(BUS, (8.0, 0.0, 0.0, 0.0)), (CAR, (50.0, 1.0, 0.0, 0.0)), (CAR, (50.0, 2.0, 0.0, 0.0))],
    )
    assert sorted(names(monitor.observe(snapshot))) == [
        ("ego", "other0"),
        ("ego", "tester0"),
        ("ego", "tester1"),
        ("tester0", "tester1"),
        ("tester2", "other1"),
    ]
    assert monitor.ego_pairs == {("ego", "other0"), ("ego", "tester0"), ("ego", "tester1")}
    assert monitor.tester_pairs == {("tester0", "tester1"), ("tester2", "other1")}


@settings(deadline=None)
@given(states, st.lists(states, max_size=4), st.lists(states, max_size=4))
def test_no_contact_is_missed_or_made_up(
    ego: State, testers: list[State], others: list[State]
) -> None:
    """The pairs found are those whose boxes overlap, by comparing every box with every other."""
    snapshot = at(0, ego, testers, [(CAR, s) for s in others])
    expected = {
        (a.id, b.id)
        for i, a in enumerate((snapshot.ego, *snapshot.testers))
        for b in (*snapshot.testers[i:], *snapshot.background)
        if overlap(a.box, b.box)
    }
    assert set(names(ContactMonitor().observe(snapshot))) == expected


def test_a_long_train_touches_with_its_end() -> None:
    """A train of 135 m (SUMO's default) reaches who stands 67 m from its middle."""
    train = Kind("rail", 135.0, 2.84, 90.0, 0.0, 55.0, -1.0, 1.0, 0.0)
    snapshot = at(0, EGO_AT_REST, [(100.0, 50.0, 1.0, 0.0)], [(train, (167.0, 50.0, 20.0, 0.0))])
    assert names(ContactMonitor().observe(snapshot)) == [("tester0", "other0")]


# Closing speed ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("ego", "other", "closing"),
    [
        ((0.0, 0.0, 8.0, 0.0), (2.0, 0.0, 0.0, 0.0), 8.0),  # into one who stands
        ((0.0, 0.0, 8.0, 0.0), (2.0, 0.0, 3.0, 0.0), 5.0),  # into one who goes ahead
        ((0.0, 0.0, 8.0, 0.0), (2.0, 0.0, 3.0, math.pi), 11.0),  # head on
        ((0.0, 0.0, 8.0, 0.5), (1.0, 0.5, 1.4, 0.5 + math.pi / 2), 8.0),  # into one who crosses
        ((0.0, 0.0, 0.0, 2.0), (0.0, 0.0, 1.4, 2.0), -1.4),  # one who walks off a standing car
        ((0.0, 0.0, 2.0, math.pi), (-2.0, 0.0, 1.0, -math.pi), 1.0),  # pi and -pi are one heading
    ],
)
def test_closing_speed_by_hand(ego: State, other: State, closing: float) -> None:
    """The speed of the ego less what the other one has of it along the ego's heading."""
    (contact,) = ContactMonitor().observe(at(7, ego, [other]))
    assert contact.closing_speed == pytest.approx(closing)
    assert contact.time == pytest.approx(0.7)


# Smallest gap -------------------------------------------------------------------------------------


@settings(deadline=None)
@given(walks)
def test_the_smallest_gap_is_the_smallest_over_all_timesteps(
    walk: list[tuple[State, list[State]]],
) -> None:
    """What the monitor did not look at closely was never the closest; asked at every timestep."""
    monitor, smallest = ContactMonitor(), math.inf
    assert monitor.min_gap == math.inf
    for step, (ego, testers) in enumerate(walk):
        snapshot = at(step, ego, testers, [(CAR, ego)])
        monitor.observe(snapshot)
        gaps = [gap(snapshot.ego.box, t.box) for t in snapshot.testers]
        smallest = min([smallest, *gaps])
        assert monitor.min_gap == pytest.approx(smallest, abs=1e-12)


@pytest.mark.parametrize("closest", [0, 40, 100, 199])
@pytest.mark.parametrize("heading", [0.0, 0.7, 1.5])
def test_a_long_episode_forgets_nothing(closest: int, heading: float) -> None:
    """The closest of two hundred timesteps is kept, although the others come nearly as close."""
    monitor = ContactMonitor()
    testers = [(0.0, 5.5 + 0.001 * i, 1.0, 0.01 * i) for i in range(200)]
    testers[closest] = (0.3, 5.0, 1.0, heading)
    for step, tester in enumerate(testers):
        monitor.observe(at(step, EGO_AT_REST, [tester]))
    ego = BodyState(Body("ego", CAR), *EGO_AT_REST).box
    every = [gap(ego, BodyState(Body("t", PEDESTRIAN), *t).box) for t in testers]
    assert monitor.min_gap == pytest.approx(min(every), abs=1e-12)


def test_a_contact_has_no_gap() -> None:
    """Once they touched, the smallest gap is zero and stays so."""
    monitor = ContactMonitor()
    for lateral in (3.0, 0.5, 4.0):
        monitor.observe(at(0, EGO_AT_REST, [(0.0, lateral, 1.0, 0.0)]))
    assert monitor.min_gap == 0.0
