"""Rules of the world: which tester breaks which, and what becomes of the episode."""

from __future__ import annotations

import math
import pathlib
from collections.abc import Callable
from typing import Any

import pytest
from report_files import write
from shapely.geometry import LineString, box
from staging import Stage

from cavsumo.assertions.base import Judgement
from cavsumo.assertions.contacts import ContactMonitor, depth
from cavsumo.assertions.naturalness import Naturalness
from cavsumo.assertions.validity import STRAY_M, Breach, ValidityMonitor, possible
from cavsumo.batch.tally import Tally
from cavsumo.model.bodies import CAR, PEDESTRIAN, Body, Kind
from cavsumo.model.carriageway import Roads, Start
from cavsumo.model.geometry import Box
from cavsumo.model.kinematics import step_floats
from cavsumo.model.polyline import Path
from cavsumo.model.scenario import BatchPlan
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.network.site import Site
from cavsumo.report.analysis import analyse
from cavsumo.results.columns import measured
from cavsumo.simulation.rewards import GOAL, RewardMonitor

DT = 0.1
LEFT = math.pi / 2  # across the ego's way
Staged = Callable[..., tuple[BatchPlan, Site]]
Pose = tuple[float, float, float, float]  # x, y, v, o
# A road 100 m long and 6 m wide with a pavement on its southern side.
ROADS = Roads(
    box(0.0, -3.0, 100.0, 3.0), [LineString([(0, 0), (100, 0)])], [LineString([(0, -4), (100, -4)])]
)
AWAY: Pose = (-50.0, 0.0, 5.0, 0.0)  # where the ego meets nobody


def judged(*moments: list[Pose], **around: Any) -> str:
    """The first breach after these poses of the testers, one list a timestep; see ``watched``."""
    return str(watched(*moments, **around).first or "")


def watched(
    *moments: list[Pose],
    ego: Pose = AWAY,
    kind: Kind = PEDESTRIAN,
    traffic: list[Pose] | None = None,
    roads: Roads | None = ROADS,
) -> ValidityMonitor:
    """The validity monitor that saw these poses of the testers."""
    bodies = tuple(Body(f"tester{i}", kind) for i in range(len(moments[0])))
    driver = Body("ego", CAR)
    starts = tuple(Start(x, y, o) for x, y, _, o in moments[0])
    path = Path([(0.0, 0.0), (100.0, 0.0)])
    monitor = ValidityMonitor(Scene(DT, driver, path, bodies, starts, roads))
    contacts = ContactMonitor()
    walker = Body("walker", PEDESTRIAN)
    for step, poses in enumerate(moments):
        testers = tuple(map(BodyState, bodies, *zip(*poses, strict=True)))
        others = ((walker, *traffic[step]),) if traffic else ()
        snapshot = Snapshot(step, step * DT, BodyState(driver, *ego), 0.0, testers, others)
        contacts.observe(snapshot)
        monitor.observe(snapshot, contacts.pairs)
    return monitor


def walk(*poses: Pose, steps: int = 12) -> list[list[Pose]]:
    """Bodies that go straight on at their speed."""
    return [
        [(x + v * DT * i * math.cos(o), y + v * DT * i * math.sin(o), v, o) for x, y, v, o in poses]
        for i in range(steps)
    ]


def test_depth_of_boxes() -> None:
    """How far one box must be moved to leave the other."""
    one = Box(0.0, 0.0, 0.0, 4.0, 2.0)
    assert depth(one, Box(2.5, 0.5, 0.0, 2.0, 2.0)) == pytest.approx(0.5)
    assert depth(one, Box(0.0, 1.25, LEFT, 1.0, 4.0)) == pytest.approx(0.25)
    assert depth(one, Box(9.0, 0.0, 0.3, 2.0, 2.0)) == 0.0


def test_a_tester_that_starts_in_another_body() -> None:
    """Nobody starts in the ego; among others the box of a pedestrian is larger than a person."""
    assert judged([(0.0, 1.0, 0.0, 0.0)], ego=(0.0, 0.0, 5.0, 0.0)) == (
        "tester0 starts in ego at 0.0 s"
    )
    assert judged([(5.0, -4.0, 0.0, 0.0), (5.2, -4.0, 0.0, 0.0)]).endswith("in tester1 at 0.0 s")
    assert judged([(5.0, -4.0, 0.0, 0.0), (5.5, -4.0, 0.0, 0.0)]) == ""


def test_who_moves_into_whom() -> None:
    """The one that moves broke the rule; of two that meet, each answers for its own way."""
    standing, coming = (6.0, -4.0, 0.0, 0.0), (5.0, -4.0, 1.4, 0.0)
    assert judged(*walk(standing, coming)).startswith("tester1 moved into tester0")
    assert judged(*walk(coming, standing)).startswith("tester0 moved into tester1")
    beside = (6.0, -4.0 + 0.65, 0.0, 0.0)
    assert judged(*walk(coming, beside)) == ""  # they brush past each other
    assert judged(*walk((5.0, -4.0, 1.4, 0.0), (6.4, -4.0, 1.4, math.pi)))


def test_a_pair_is_measured_once_and_in_full() -> None:
    """Two who walk through each other: neither got as deep as is allowed by its own way alone."""
    met = watched(*walk((5.0, -4.0, 1.4, 0.0), (6.3, -3.83, 1.4, math.pi)))
    assert [str(breach).split(" at ")[0] for breach in met.breaches.values()] == [
        "tester0 moved into tester1",
        "tester1 moved into tester0",
    ]
    for name in ("tester0", "tester1"):
        assert met.spoils(Judgement("a", "violated", name)) is met.breaches[name]


def test_no_test_is_valid_in_which_somebody_walked_through_the_tester() -> None:
    """The one that stood did not move into anybody, and yet proves nothing any more."""
    met = watched(*walk((6.0, -4.0, 0.0, 0.0), (5.0, -4.0, 1.4, 0.0)))
    assert str(met.first).startswith("tester1 moved into tester0")
    assert str(met.breaches["tester0"]).startswith("tester0 stood in the way of tester1")


def test_the_depth_is_not_added_up() -> None:
    """In and out again is no deeper than once; what one starts with counts."""
    out, into = (5.0, -4.0, 0.0, 0.0), (5.2, -4.0, 0.0, 0.0)
    standing = (5.6, -4.0, 0.0, 0.0)
    assert depth(Box(*into[:2], 0.0, 0.65625, 0.875), Box(5.6, -4.0, 0.0, 0.65625, 0.875)) < 0.3
    there_and_back = [[pose, standing] for pose in (out, into) * 4]
    met = watched(*there_and_back)
    assert not any("moved into" in str(b) for b in met.breaches.values())
    deeper = [[(x, -4.0, 1.4, 0.0), standing] for x in (5.2, 5.27, 5.34)]
    assert judged(*deeper).startswith("tester0 moved into tester1 at 0.1 s")


def test_a_walking_tester_answers_for_the_whole_depth_to_traffic() -> None:
    """Traffic comes onto one that walks too; one that stands costs nothing (the test below)."""
    coming = [(7.0 - 1.4 * DT * i, -4.0, 1.4, math.pi) for i in range(12)]
    slow = walk((6.0, -4.0, 0.1, 0.0))
    assert judged(*slow, traffic=coming).startswith("tester0 moved into walker")


def test_traffic_that_walks_into_a_tester_is_not_its_fault() -> None:
    """SUMO's own bodies may not see a tester that stands; a tester sees them."""
    way = [(7.0 - 1.4 * DT * i, -4.0, 1.4, math.pi) for i in range(12)]
    assert judged(*walk((6.0, -4.0, 0.0, 0.0)), traffic=way) == ""
    there = [(6.0, -4.0, 0.0, 0.0)] * 12
    assert judged(*walk((5.0, -4.0, 1.4, 0.0)), traffic=there).startswith(
        "tester0 moved into walker"
    )


def test_the_standing_ego() -> None:
    """Who walks into the standing ego spoils nothing, until that drives on with it inside."""
    bodies = walk((0.0, -1.3, 1.4, LEFT), steps=6)
    stands = (0.0, 0.0, 0.0, 0.0)
    assert judged(*bodies, ego=stands) == ""
    both = _with_ego(bodies, [stands] * 5 + [(0.1, 0.0, 1.0, 0.0)])
    assert both.startswith("tester0 moved into ego")
    lightly = _with_ego(bodies[:2] + [bodies[1]] * 2, [stands] * 3 + [(0.1, 0.0, 1.0, 0.0)])
    assert lightly == ""


def _with_ego(moments: list[list[Pose]], egos: list[Pose]) -> str:
    """What the validity monitor says of one pedestrian while the ego moves too."""
    body, driver = Body("tester0", PEDESTRIAN), Body("ego", CAR)
    path = Path([(0.0, 0.0), (100.0, 0.0)])
    monitor = ValidityMonitor(Scene(DT, driver, path, (body,), (Start(0.0, -1.3, LEFT),), ROADS))
    contacts = ContactMonitor()
    for step, ((pose,), ego) in enumerate(zip(moments, egos, strict=True)):
        state = BodyState(driver, *ego)
        snapshot = Snapshot(step, step * DT, state, 0.0, (BodyState(body, *pose),))
        contacts.observe(snapshot)
        monitor.observe(snapshot, contacts.pairs)
    return str(monitor.first or "")


def test_the_edge_of_the_world() -> None:
    """On foot some metres off is the same as on a path that the network lacks; far off is not."""
    on_foot = (50.0, -4.0 - STRAY_M, 1.4, -LEFT)
    assert judged(*walk(on_foot)).startswith("tester0 left the world")
    assert judged(*walk((50.0, -10.0, 1.4, -LEFT))) == ""
    assert judged(*walk(on_foot), roads=None) == ""  # an open plane has no edge
    off = (50.0, 3.5, 5.0, LEFT)
    assert judged(*walk(off), kind=CAR).startswith("tester0 left the world")
    assert judged(*walk((50.0, 1.5, 5.0, 0.0)), kind=CAR) == ""


def test_moves_that_no_body_can_make() -> None:
    """Whatever the kinematics do is possible; more speed, more way or more turn is not."""
    before = BodyState(Body("tester0", PEDESTRIAN), 0.0, 0.0, 1.0, 0.5)
    limits = PEDESTRIAN.wheelbase, PEDESTRIAN.v_min, PEDESTRIAN.v_max, DT
    for throttle in (-1.4, 0.0, 1.4):
        for steering in (-PEDESTRIAN.steering_max, 0.0, PEDESTRIAN.steering_max):
            state = step_floats(*before[1:], throttle, steering, *limits)
            assert possible(before, BodyState(before.body, *state), DT)
    for change in ({"x": 1.0}, {"v": 1.3}, {"v": 0.7}, {"o": 2.5}):
        assert not possible(before, before._replace(**change), DT)
    assert judged([(5.0, -4.0, 1.0, 0.0)], [(9.0, -4.0, 1.0, 0.0)]) == (
        "tester0 moved as no pedestrian can at 0.1 s"
    )


def test_a_goal_reached_against_the_rules_earns_nothing() -> None:
    """Or learners would learn to cheat."""
    body = Body("tester0", PEDESTRIAN)
    path = Path([(0.0, 0.0), (100.0, 0.0)])
    scene = Scene(DT, Body("ego", CAR), path, (body,), (Start(5.0, -4.0, 0.0),), ROADS)
    tester = BodyState(body, 5.0, -4.0, 0.0, 0.0)
    snapshot = Snapshot(1, DT, BodyState(scene.ego, *AWAY), 0.0, (tester,))
    said = [Judgement("collision", "held", "tester0")]
    fair, cheat = (
        RewardMonitor(scene, ((0,),)).rewards(snapshot, said, cheats)
        for cheats in ((), ("tester0",))
    )
    assert fair is not None
    assert cheat is not None
    assert (fair[0][0] - cheat[0][0], fair[1], cheat[1]) == (GOAL, True, True)


def test_whose_breach_spoils_what() -> None:
    """The one whom the verdict names; anybody's where it names nobody; at the start always."""
    bodies = tuple(Body(f"tester{i}", PEDESTRIAN) for i in range(2))
    starts = (Start(5.0, -4.0, 0.0),) * 2
    path = Path([(0.0, 0.0), (100.0, 0.0)])
    monitor = ValidityMonitor(Scene(DT, Body("ego", CAR), path, bodies, starts, ROADS))
    assert monitor.spoils(Judgement("a", "held", "tester0")) is None
    monitor.breaches["tester0"] = Breach(1.0, "tester0", "left the world")
    for verdict, whom, spoilt in (
        ("violated", "tester0", True),
        ("held", "tester1", False),
        ("violated", "", True),
        ("violated", "bg_car", True),
        ("not_triggered", "", False),
    ):
        assert bool(monitor.spoils(Judgement("a", verdict, whom))) == spoilt
    monitor.breaches = {"tester1": Breach(0.0, "tester1", "starts in tester0")}
    assert monitor.spoils(Judgement("a")) is not None


def test_conduct_in_figures() -> None:
    """Two bodies, one of which speeds up and turns in one of two timesteps."""
    bodies = [Body(f"tester{i}", PEDESTRIAN) for i in range(2)]
    naturalness, ego = Naturalness(), BodyState(Body("ego", CAR), *AWAY)
    first = tuple(BodyState(body, 0.0, 0.0, 1.0, 3.1) for body in bodies)
    second = (first[0]._replace(v=1.1, o=-3.1), first[1])
    for step, testers in enumerate((first, second, second)):
        naturalness.observe(Snapshot(step, step * DT, ego, 0.0, testers))
    assert naturalness.turning == pytest.approx(2 * math.pi - 6.2)
    assert naturalness.rms_acceleration(2, DT) == pytest.approx(math.sqrt(1.0 / 4))


def test_invalid_episodes_are_counted_apart(tmp_path: pathlib.Path) -> None:
    """They are in no rate."""
    tally = Tally()
    row = {"agent": "a", "run": 0, "trigger_time_s": "1.0", "violation_time_s": "", "breach": "x"}
    row |= {"time_s": "9.0"}
    for outcome in ("held", "not_triggered", "invalid", "invalid"):
        tally.add(row | {"outcome": outcome})
    found = tally.all
    assert (found.invalid, found.valid, found.rate("tests").value) == (2, 2, 0.5)
    alone, invalid = analyse([write(tmp_path / "r.csv", [("held", "invalid")])]).rates
    assert (alone.invalid, alone.tests.total) == (0, 1)
    assert (invalid.invalid, invalid.tests.total) == (1, 0)


@pytest.fixture(scope="module")
def straight(staged: Staged) -> Stage:
    """The straight road, 99 m long; the ego drives in its southern lane."""
    return Stage(*staged("pedestrians"))


def onward(speed: float) -> Callable[[Snapshot, BodyState], tuple[float, float]]:
    """Bodies keep a speed; those that start standing stand."""
    return lambda snapshot, body: (speed if body.v > 0.0 else 0.0, 0.0)


def slow(snapshot: Snapshot) -> float:
    """Far from everybody while it matters."""
    return 1.0


@pytest.mark.parametrize(
    ("reason", "kind", "places"),
    [
        ("tester0 starts in ego", "pedestrian", [(0.5, -0.5, LEFT, 0.0)]),
        (
            "tester0 moved into tester1",
            "pedestrian",
            [(40.0, -4.0, 0.0, 1.4), (41.5, -4.0, 3.1, 0.0)],
        ),
        ("", "pedestrian", [(40.0, -4.0, 0.0, 1.4), (41.5, -3.35, 3.1, 0.0)]),
        ("tester0 left the world", "pedestrian", [(40.0, -22.5, -LEFT, 1.4)]),
        ("tester0 left the world", "car", [(40.0, 0.0, -LEFT, 5.0)]),
    ],
)
def test_each_reason_in_sumo(
    straight: Stage, reason: str, kind: str, places: list[tuple[float, float, float, float]]
) -> None:
    """An episode ends up invalid with its reason, whatever the assertion says."""
    starts = [straight.beside(along, aside, turn, v) for along, aside, turn, v in places]
    speed = onward(5.0 if kind == "car" else 1.4)
    _, episode = straight.play(
        "collision", slow, places=starts, testers=speed, kind=kind, start=1.0, end=3.0
    )
    row = measured(episode)
    if not reason:
        assert (episode.breach, row["breach"], row["outcome"]) == (None, "", "held")
        assert len(episode.contacts.tester_pairs) == 1  # they did touch
        return
    assert str(row["breach"]).startswith(reason)
    assert (row["outcome"], row["tester"]) == ("invalid", "tester0")
    assert (row["assertion"], row["trigger_time_s"], row["blame"]) == ("", None, "")


def test_walking_into_the_standing_ego_in_sumo(straight: Stage) -> None:
    """It drives on with somebody inside: a collision of its own making, but not of the ego's."""

    def ego(snapshot: Snapshot) -> float:
        return 0.0 if snapshot.time < 3.0 else 8.0

    def walks_in(snapshot: Snapshot, body: BodyState) -> tuple[float, float]:
        return (1.4 if snapshot.time < 1.5 else 0.0), 0.0

    for aside, outcome in ((-2.7, "invalid"), (-4.6, "held")):
        place = straight.beside(0.5, aside, LEFT, 1.4)
        said, episode = straight.play(
            "collision", ego, places=[place], testers=walks_in, start=0.0, end=6.0
        )
        assert episode.outcome == outcome
        assert said.verdict == ("violated" if outcome == "invalid" else "held")


def test_what_follows_a_violation_changes_nothing(straight: Stage) -> None:
    """After the collision the tester may end up anywhere."""
    places = [straight.beside(30.0, 0.0, LEFT, 0.0), straight.beside(60.0, -22.5, -LEFT, 0.0)]

    def strays(snapshot: Snapshot, body: BodyState) -> tuple[float, float]:
        return (1.4 if snapshot.time > 5.0 and body.id == "tester1" else 0.0), 0.0

    _, episode = straight.play(
        "collision speed-limit", lambda snapshot: 8.0, places=places, testers=strays, end=9.0
    )
    assert episode.outcome == "violated"
    assert episode.time > 8.0  # it went on, for the other assertion
