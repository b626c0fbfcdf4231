"""The boundary to SUMO, against real SUMO: who stops for whom, who drives whom, what is refused."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import libsumo
import pytest

from cavsumo.batch.jobs import job
from cavsumo.batch.worker import Worker
from cavsumo.egos import Acceleration, Drive
from cavsumo.errors import SimulationError
from cavsumo.model.bodies import BICYCLE, BUS, CAR, PEDESTRIAN, Body, Kind
from cavsumo.model.carriageway import Start
from cavsumo.model.kinematics import step_floats
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.network.pedestrian_starts import StartingArea
from cavsumo.sumo.poses import to_sumo
from cavsumo.sumo.world import World

Opener = Callable[..., World]
LANE_Y = -1.825  # of the ego's lane on the straight road [m]
CALM = {"ego_params": {"sigma": 0.0}}
PARKED = {"ego": "constant", "ego_params": {"speed": 0.0}}
WALK = ("eastbound", "westbound")


def standing(
    x: float, y: float, o: float = 0.0, kind: Kind = PEDESTRIAN
) -> tuple[tuple[BodyState], tuple[Start]]:
    """One standing tester and its start."""
    return (BodyState(Body("tester0", kind), x, y, 0.0, o),), (Start(x, y, o, walk=WALK),)


def episode(
    world: World, states: tuple[BodyState, ...] = (), starts: Sequence[Start] = ()
) -> Iterator[Snapshot]:
    """What is seen while SUMO drives the ego past standing testers, for at most 40 s."""
    snapshot: Snapshot | None = world.reset(1, states, starts)
    while snapshot is not None and snapshot.step <= 400:
        yield snapshot
        snapshot = world.step(states, None)


def waiting_at_the_kerb(world: World, area: StartingArea) -> tuple[Any, Any]:
    """A pedestrian on the pavement, facing the road, its toes 10 cm from the kerb."""
    way = world.site.roads.crossing(*area.pavement.at((area.begin + area.end) / 2)[:2])
    assert way is not None
    ahead = way.enter - PEDESTRIAN.length / 2 - 0.1
    x, y = way.x + ahead * math.cos(way.heading), way.y + ahead * math.sin(way.heading)
    (state,), (start,) = standing(x, y, way.heading)
    return (state,), (Start(start.x, start.y, start.o, walk=area.walk),)


@pytest.mark.parametrize("kind", [CAR, PEDESTRIAN, BUS, BICYCLE], ids=lambda k: k.name)
def test_sumos_driver_stops_short_of_the_true_rear(open_world: Opener, kind: Kind) -> None:
    """SUMO takes the position as the front: the ego halts minGap behind the rear of the box."""
    with open_world(**CALM) as world:
        *_, last = episode(world, *standing(70.0, LANE_Y, kind=kind))
        room = (70.0 - kind.length / 2) - (last.ego.x + last.ego.body.kind.length / 2)
        assert last.ego.v == 0.0
        assert room == pytest.approx(libsumo.vehicle.getMinGap("ego"), abs=0.01)
        assert world.collisions == set()


@pytest.mark.parametrize(
    ("embodiment", "y"),
    # Persons off the middle of the lane are missing: SUMO's drivers brush past them.
    [("vehicle", -3.0), ("vehicle", LANE_Y), ("vehicle", -0.5), ("person", LANE_Y)],
)
def test_a_pedestrian_on_the_lane_stops_the_ego(
    open_world: Opener, embodiment: str, y: float
) -> None:
    """Wherever on the lane a pedestrian stands, SUMO's driver halts and does not touch it."""
    with open_world(embodiment=embodiment, **CALM) as world:
        *_, last = episode(world, *standing(70.0, y, math.pi / 2))
    assert last.ego.v == 0.0
    assert last.ego.x + last.ego.body.kind.length / 2 < 70.0 - PEDESTRIAN.width / 2


@pytest.mark.parametrize("embodiment", ["vehicle", "person"])
@pytest.mark.parametrize("name", ["pedestrians", "crossing", "junction"])
def test_a_pedestrian_waiting_at_the_kerb_stops_nobody(
    open_world: Opener, name: str, embodiment: str
) -> None:
    """On the pavement of any road beside its path, a waiting pedestrian leaves the ego be."""
    with open_world(name, embodiment=embodiment, **CALM) as world:
        alone = [snapshot.ego for snapshot in episode(world)]
        for area in world.site.areas:
            seen = episode(world, *waiting_at_the_kerb(world, area))
            assert [snapshot.ego for snapshot in seen] == alone


def test_shown_in_its_true_width_the_same_pedestrian_stops_the_ego(open_world: Opener) -> None:
    """Why SUMO is shown a narrower body: 0.875 m wide, it counts as on the lane at the kerb."""
    with open_world(sumo_width=PEDESTRIAN.width, **CALM) as world:
        *_, last = episode(world, *waiting_at_the_kerb(world, world.site.areas[0]))
    assert last.ego.v == 0.0


def test_persons_on_a_real_junction_do_not_crash_sumo(set_up: Callable[..., Any]) -> None:
    """Episodes with testers shown as persons among marked crossings run to their end."""
    prepared = set_up("crossing", embodiment="person", agents=["programmed-random"], runs=3)
    with Worker(prepared) as worker:
        rows = [worker.play(job(prepared.plan, run)).outcome.row for run in prepared.plan.todo()]
    assert len(rows) == 3
    assert not any(row["error"] for row in rows)
    assert sum(row["steps"] for row in rows) > 150


def test_sumos_own_collision_reports_are_kept(open_world: Opener) -> None:
    """An ego that drives through a body: SUMO's report names the two, and only the two."""
    (body,), starts = standing(50.0, LANE_Y)
    with open_world(ego="constant", ego_params={"speed": 8.0}) as world:
        world.reset(1, (body,), starts)
        while world.step((body,), Acceleration(0.0)) is not None:
            pass
        assert world.collisions == {("ego", "tester0")}
        assert world.teleports == 0


def test_there_is_no_snapshot_after_the_ego_arrived(open_world: Opener) -> None:
    """The last thing seen of the ego is near the end of its path; then there is none."""
    with open_world(**CALM) as world:
        *_, last = episode(world)
        path = world.site.route.path
        assert path.length - path.project(last.ego.x, last.ego.y).along < 2.25 + 0.1 * 15
        assert world.step((), None) is None


def test_an_acceleration_changes_the_speed_by_a_dt(open_world: Opener) -> None:
    """Commanded 2 m/s2 for a second, then -9 until it stands: exactly that, never backwards."""
    with open_world(ego="constant", ego_params={"speed": 5.0}, step_length=0.05) as world:
        before = world.reset(1, (), ()).ego
        for a in [2.0] * 20 + [-9.0] * 20:
            after = world.step((), Acceleration(a))
            assert after is not None
            assert after.ego.v == pytest.approx(max(0.0, before.v + a * 0.05), abs=1e-9)
            mean = (before.v + after.ego.v) / 2  # SUMO integrates ballistically
            assert after.ego.x - before.x == pytest.approx(mean * 0.05, abs=1e-9)
            before = after.ego
        assert before.v == 0.0


def test_an_ego_that_drives_freely_follows_the_kinematics(open_world: Opener) -> None:
    """Slaloming off the road and back, it is where eqs 8 to 19 say, and SUMO has it there too."""
    with open_world(ego="constant", ego_params={"speed": 6.0}) as world:
        ego = world.reset(1, (), ()).ego
        kind, state = ego.body.kind, ego[1:]
        for i in range(100):
            throttle, steering = 1.5 - 0.04 * i, 0.5 * math.sin(0.15 * i)
            after = world.step((), Drive(throttle, steering))
            state = step_floats(
                *state, throttle, steering, kind.wheelbase, kind.v_min, kind.v_max, 0.1
            )
            assert after is not None
            assert after.ego[1:] == state
            assert after.ego_steering == steering
            x, y, o = state[0], state[1], state[3]
            told = (*libsumo.vehicle.getPosition("ego"), libsumo.vehicle.getAngle("ego"))
            assert told == pytest.approx(to_sumo(x, y, o, kind.length), abs=1e-6)
            assert libsumo.vehicle.getSpeed("ego") == pytest.approx(state[2], abs=0.2)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("quantity", ["x", "y", "v", "o"])
def test_a_state_that_is_no_number_is_refused(
    open_world: Opener, quantity: str, bad: float
) -> None:
    """Infinite or undefined states never reach SUMO, which would hang; the body is named."""
    states, starts = standing(50.0, -5.0)
    with open_world(**PARKED) as world:
        world.reset(1, states, starts)
        broken = BodyState(**states[0]._asdict() | {quantity: bad})
        with pytest.raises(SimulationError, match=r"tester0.*not finite"):
            world.step((broken,), Acceleration(0.0))


UNKNOWN_EDGE = '<routes><trip id="a" depart="0" from="nowhere" to="westbound"/></routes>'
TRUNCATED = "<routes><vehicle"
NO_NUMBER = '<routes><vType id="b" accel="fast"/></routes>'


def refusal(open_world: Opener, **settings: Any) -> str:
    """What is said when SUMO cannot load a scenario."""
    with open_world(**settings) as world, pytest.raises(SimulationError) as refused:
        world.reset(1, (), ())
    return str(refused.value)


@pytest.mark.parametrize(
    ("demand", "words"), [(UNKNOWN_EDGE, "'nowhere'"), (TRUNCATED, "unexpected end of input")]
)
def test_bad_demand_is_refused_in_sumos_own_words(
    open_world: Opener, tmp_path: Path, demand: str, words: str
) -> None:
    """What is wrong with a route file is said as SUMO says it."""
    file = tmp_path / "bad.rou.xml"
    file.write_text(demand, encoding="utf-8")
    said = refusal(open_world, routes=file)
    assert said.startswith("SUMO: ")
    assert words in said


@pytest.mark.parametrize("demand", [UNKNOWN_EDGE, TRUNCATED])
def test_sumos_own_words_are_one_line(open_world: Opener, tmp_path: Path, demand: str) -> None:
    """The refusal is one sentence on one line, as everything that a user reads."""
    file = tmp_path / "bad.rou.xml"
    file.write_text(demand, encoding="utf-8")
    assert "\n" not in refusal(open_world, routes=file)


def test_sumos_own_words_are_whole(open_world: Opener, tmp_path: Path) -> None:
    """Nothing is left out of what SUMO says, though it says the same word twice."""
    file = tmp_path / "bad.rou.xml"
    file.write_text(UNKNOWN_EDGE, encoding="utf-8")
    assert refusal(open_world, routes=file) == (
        "SUMO: The edge 'nowhere' within the route for trip 'a' is not known. "
        "The route can not be build."
    )


def test_a_number_that_is_none_is_quoted(open_world: Opener, tmp_path: Path) -> None:
    """SUMO prints which value it cannot read; that is said, not only that something is wrong."""
    file = tmp_path / "bad.rou.xml"
    file.write_text(NO_NUMBER, encoding="utf-8")
    assert "accel" in refusal(open_world, routes=file)


@pytest.mark.parametrize(
    ("attribute", "value"), [("laneChangeModel", "LC99"), ("accel", "fast"), ("decel", -1.0)]
)
def test_what_sumo_dislikes_about_the_ego_is_said(
    open_world: Opener, attribute: str, value: object
) -> None:
    """A vType attribute with a value that SUMO refuses: the message names one or the other."""
    said = refusal(open_world, ego_params={attribute: value})
    assert attribute in said or str(value) in said


BLOCKED = """<routes>
    <vehicle id="a" depart="0" departPos="6" departLane="1">
        <route edges="eastbound"/>
        <stop lane="eastbound_1" startPos="0" endPos="6" duration="1000"/>
    </vehicle>
</routes>
"""


def test_an_ego_that_finds_no_room_is_an_error(open_world: Opener, tmp_path: Path) -> None:
    """A car parked where the ego would enter: refused in a sentence that names the edge."""
    file = tmp_path / "blocked.rou.xml"
    file.write_text(BLOCKED, encoding="utf-8")
    assert refusal(open_world, routes=file) == (
        "the ego found no room to enter edge 'eastbound' in 30 s"
    )
