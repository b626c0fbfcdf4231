"""The sensor model without SUMO: range, noise, delay, occlusion, and who is shown where."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from cavsumo.agents.driving import Course
from cavsumo.agents.election import ElectionAgent
from cavsumo.agents.manoeuvres import everybody
from cavsumo.agents.programmed import ProximityAgent
from cavsumo.egos.base import EGO_KIND
from cavsumo.egos.time_gap import TimeGapEgo
from cavsumo.model.bodies import BICYCLE, CAR, PEDESTRIAN, Body
from cavsumo.model.carriageway import Light, Start
from cavsumo.model.polyline import Path
from cavsumo.model.scene import Scene
from cavsumo.model.sensors import Observer, Sensor
from cavsumo.model.snapshot import BodyState, RawState, Snapshot

EGO = Body("ego", EGO_KIND)
LIGHTS = (Light("near", 0, 20.0), Light("far", 1, 80.0))
STARTS = tuple(Start(x, 5.0, 0.0) for x in (10.0, 30.0, 60.0))
BODIES = tuple(Body(f"tester{i}", PEDESTRIAN) for i in range(3))


def scene(path: Path | None = None, starts: tuple[Start, ...] = STARTS) -> Scene:
    """An open plane with the ego's path along the x axis."""
    path = path or Path([(0.0, 0.0), (100.0, 0.0)])
    return Scene(0.1, EGO, path, BODIES[: len(starts)], starts, lights=LIGHTS)


def truth(
    step: int = 0,
    ego_x: float = 0.0,
    testers: Sequence[tuple[float, float]] = ((10.0, 5.0), (30.0, 5.0), (60.0, 5.0)),
    background: Sequence[RawState] = (),
    v: float = 8.0,
) -> Snapshot:
    """The ego at x on its path, testers where given, walking east."""
    states = tuple(BodyState(b, x, y, 1.0, 0.0) for b, (x, y) in zip(BODIES, testers, strict=False))
    ego = BodyState(EGO, ego_x, 0.0, v, 0.0)
    return Snapshot(step, step * 0.1, ego, 0.01 * step, states, tuple(background), ("G", "r"))


def observer(own: Sequence[int] | None = None, seed: int = 1, **sensor: object) -> Observer:
    """The ego (without bodies of its own) or an agent, looking through a sensor."""
    return Observer(Sensor.model_validate(sensor), scene(), own, np.random.default_rng(seed))


def car(x: float, y: float, name: str = "car", kind: object = CAR) -> RawState:
    """A background vehicle that stands along the x axis."""
    return (Body(name, kind), x, y, 0.0, 0.0)  # type: ignore[arg-type]


# Range


def test_the_ego_is_shown_who_is_in_range() -> None:
    """Testers and traffic farther away are left out; itself it knows exactly."""
    seen = truth(background=[car(40.0, 0.0, "a"), car(60.0, 0.0, "b")])
    view = observer(range_m=45.0).view(seen)
    assert [t.id for t in view.testers] == ["tester0", "tester1"]
    assert [b.id for b in view.background] == ["a"]
    assert view.testers == seen.testers[:2]
    assert (view.ego, view.time, view.ego_steering) == (seen.ego, seen.time, seen.ego_steering)


def test_the_range_reaches_to_the_centre_of_a_body() -> None:
    """Up to it and not beyond."""
    assert len(observer(range_m=20.0).view(truth(testers=[(20.0, 0.0)])).testers) == 1
    assert len(observer(range_m=20.0).view(truth(testers=[(20.001, 0.0)])).testers) == 0


def test_lights_out_of_range_show_nothing() -> None:
    """Their places stay those of the scene's lights."""
    assert observer(range_m=30.0).view(truth()).lights == ("G", "")
    assert observer(range_m=30.0).view(truth(ego_x=60.0)).lights == ("", "r")
    assert observer([2], range_m=30.0).view(truth()).lights == ("", "r")
    assert observer(delay_s=1.0).view(truth()).lights == ("G", "r")


# What tester agents are shown


def test_a_tester_keeps_everybody_in_their_places() -> None:
    """Unseen at first: testers at their starts, the ego at the beginning of its path, standing."""
    seen = truth(ego_x=50.0, testers=[(11.0, 6.0), (33.0, 7.0), (64.0, 8.0)])
    view = observer([0], range_m=25.0).view(seen)
    assert [t.id for t in view.testers] == ["tester0", "tester1", "tester2"]
    assert view.testers[0] is seen.testers[0]
    assert view.testers[1] == seen.testers[1]
    assert view.testers[2] == BodyState(BODIES[2], 60.0, 5.0, 0.0, 0.0)
    assert view.ego == BodyState(EGO, 0.0, 0.0, 0.0, 0.0)
    assert view.unseen == {"ego", "tester2"}
    assert not view.sees_ego


def test_who_is_lost_from_sight_stays_where_last_seen() -> None:
    """With the speed and the steering angle of then, until it is seen again."""
    one = observer([0], range_m=25.0)
    assert one.view(truth(1, ego_x=30.0)).sees_ego
    for step, x in (2, 34.0), (3, 60.0), (4, 90.0):
        view = one.view(truth(step, ego_x=x))
        assert view.step == step
        if step > 2:
            assert view.ego == truth(2, ego_x=34.0).ego
            assert view.ego_steering == pytest.approx(0.02)
            assert not view.sees_ego
    assert one.view(truth(5, ego_x=20.0)).ego.x == 20.0


def test_a_team_sees_what_any_of_its_bodies_sees() -> None:
    """The third body's neighbourhood is seen through its own eyes."""
    near = [car(62.0, 5.0)]
    assert not observer([0, 1], range_m=15.0).view(truth(background=near)).background
    team = observer([0, 2], range_m=15.0).view(truth(background=near))
    assert len(team.background) == 1
    assert team.unseen == {"tester1"}


def test_with_a_wide_range_a_tester_sees_the_truth() -> None:
    """Nothing but the record of the unseen tells the view from it."""
    seen = truth(background=[car(40.0, 0.0)])
    assert observer([1], range_m=1000.0).view(seen) == seen._replace(unseen=frozenset())


# Occlusion


@pytest.mark.parametrize(
    ("kind", "seen"), [(CAR, False), (BICYCLE, True), (PEDESTRIAN, True)], ids=lambda k: str(k)[:16]
)
def test_vehicles_hide_who_is_behind_them(kind: object, seen: bool) -> None:
    """Of the traffic; pedestrians and bicycles are seen past. Without the option nobody hides."""
    behind = truth(testers=[(20.0, 0.0)], background=[car(10.0, 0.0, kind=kind)])
    assert bool(observer(occlusion=True).view(behind).testers) is seen
    assert observer(range_m=50.0).view(behind).testers
    assert bool(observer(occlusion=True, range_m=20.5).view(behind).testers) is seen


def test_the_ego_hides_testers_from_each_other_and_nobody_from_itself() -> None:
    """It is a vehicle like any other; an agent's own bodies are in nobody's way."""
    seen = truth(ego_x=30.0, testers=[(10.0, 0.0), (50.0, 0.0)])
    assert observer([0], occlusion=True).view(seen).unseen == {"tester1"}
    assert len(observer(occlusion=True).view(seen).testers) == 2
    cars = tuple(BodyState(Body(f"tester{i}", CAR), 10.0 * i, 0.0, 1.0, 0.0) for i in range(3))
    row = seen._replace(testers=cars, ego=seen.ego._replace(x=60.0))
    assert observer([0, 1], occlusion=True).view(row).unseen == {"ego"}
    assert observer([0, 2], occlusion=True).view(row).unseen == frozenset()
    assert observer([0], occlusion=True).view(row).unseen == {"ego", "tester2"}


def test_one_beyond_the_range_hides_one_within() -> None:
    """A long vehicle's centre may be out of range while its front is in the way."""
    truck = dataclasses.replace(CAR, name="truck", length=16.0)
    seen = truth(testers=[(11.0, 0.0)], background=[car(18.0, 0.0, kind=truck)])
    assert not observer(occlusion=True, range_m=11.5).view(seen).testers
    assert not observer(occlusion=True, range_m=11.5).view(seen).background


# Delay


@pytest.mark.parametrize(("delay", "steps"), [(0.0, 0), (0.1, 1), (0.3, 3), (0.34, 3), (0.36, 4)])
def test_others_are_shown_as_they_were(delay: float, steps: int) -> None:
    """By timesteps, and at the start as they were first; the time and oneself are now."""
    one, mine = observer(delay_s=delay, range_m=500.0), observer([0], delay_s=delay, range_m=500.0)
    for step in range(10):
        seen = truth(step, ego_x=float(step), testers=[(10.0 + step, 5.0), (30.0 + step, 5.0)])
        view, then = one.view(seen), max(0, step - steps)
        assert [t.x for t in view.testers] == [10.0 + then, 30.0 + then]
        assert (view.step, view.time, view.ego) == (seen.step, seen.time, seen.ego)
        view = mine.view(seen)
        assert [t.x for t in view.testers[:2]] == [10.0 + step, 30.0 + then]
        assert (view.ego.x, view.ego_steering) == (then, pytest.approx(0.01 * then))


def test_what_is_late_is_what_was_measured_then() -> None:
    """With the noise and from the place of then: the same views as without delay, later."""
    sensor = {"position_noise_m": 1.0, "range_m": 30.0}
    prompt, late = observer(**sensor), observer(delay_s=0.5, **sensor)
    views = []
    for step in range(20):
        seen = truth(step, ego_x=3.0 * step)
        views.append(prompt.view(seen).testers)
        assert late.view(seen).testers == views[max(0, step - 5)]
    assert len(set(map(len, views))) > 1


# Noise


def test_noise_has_the_deviations_asked_for() -> None:
    """Of 4000 measurements, without bias, and independent across bodies and timesteps."""
    one = observer(position_noise_m=0.8, speed_noise_mps=0.3, heading_noise_rad=0.2)
    fast = truth()
    fast = fast._replace(testers=tuple(t._replace(v=9.0, o=1.0) for t in fast.testers))
    states = [[tuple(t[1:]) for t in one.view(fast).testers] for _ in range(4000)]
    errors = np.array(states) - np.array([t[1:] for t in fast.testers])  # (4000, 3, 4)
    wanted = np.array([0.8, 0.8, 0.3, 0.2])
    assert np.abs(errors.mean(axis=0) / wanted).max() < 5 / math.sqrt(4000)
    assert np.abs(errors.std(axis=0) / wanted - 1.0).max() < 5 / math.sqrt(2 * 4000)
    flat = errors.reshape(4000, -1)
    among = np.corrcoef(flat, rowvar=False) - np.eye(12)
    assert np.abs(among).max() < 5 / math.sqrt(4000)
    later = [np.corrcoef(flat[:-1, i], flat[1:, i])[0, 1] for i in range(12)]
    assert max(map(abs, later)) < 5 / math.sqrt(4000)
    share = (np.abs(errors / wanted) < 1.0).mean()  # Gaussian: 68.27 % within one deviation
    assert share == pytest.approx(0.6827, abs=0.01)


def test_noisy_states_are_possible_ones() -> None:
    """No speed below zero, unless the body does drive backwards; orientations are wrapped."""
    one = observer([0], speed_noise_mps=5.0, heading_noise_rad=3.0)
    for step in range(200):
        view = one.view(truth(step, v=-2.0 if step % 2 else 0.5))
        assert all(t.v >= 0.0 for t in view.testers)
        assert -math.pi < view.testers[1].o <= math.pi
        assert -math.pi < view.ego.o <= math.pi
        assert math.isfinite(view.ego.v)
        assert step % 2 or view.ego.v >= 0.0


def test_noise_does_not_depend_on_who_is_seen() -> None:
    """Numbers are drawn for everybody, so whoever two sensors both see, they see the same."""
    near, far = observer(position_noise_m=1.0, range_m=35.0), observer(position_noise_m=1.0)
    counts = set()
    for step in range(30):
        seen = truth(step, ego_x=2.0 * step, background=[car(40.0, 3.0)])
        some, every = near.view(seen), far.view(seen)
        assert set(some.testers) <= set(every.testers)
        assert set(some.background) <= set(every.background)
        counts.add(len(some.testers))
    assert len(counts) > 1


def test_the_same_seed_shows_the_same() -> None:
    """And another one something else."""
    views = [observer(seed=s, position_noise_m=1.0).view(truth()) for s in (1, 1, 2)]
    assert views[0] == views[1] != views[2]


# Who looks through sensors


def test_a_jumping_ego_is_projected_on_the_nearest_point() -> None:
    """A hairpin on which a search around the last place finds the wrong arm."""
    points = [(float(x), 0.0) for x in range(0, 101, 5)] + [
        (float(x), 4.0) for x in range(100, -1, -5)
    ]
    hairpin = Path(points)
    one = scene(hairpin)
    rng = np.random.default_rng(3)
    for step in range(300):
        exact = truth(step, ego_x=min(100.0, step / 3))
        x, y = rng.uniform(-5.0, 105.0), rng.uniform(-3.0, 7.0)
        jumped = exact._replace(ego=exact.ego._replace(x=x, y=y), unseen=frozenset())
        assert one.ego_projection(jumped) == hairpin.project(x, y)
        followed = one.ego_projection(exact)
        assert followed.along == pytest.approx(exact.ego.x)
        assert one.ego_projection(jumped) == hairpin.project(x, y)
        assert one.ego_projection(exact._replace(testers=())) is followed


def test_programmed_agents_begin_for_an_ego_that_they_see(
    straight_scene: Callable[..., Scene], scene_snapshot: Callable[..., Snapshot]
) -> None:
    """One remembered near by is no reason to cross."""
    road = straight_scene([(60.0, -5.15, 0.0)])
    for agent in ProximityAgent(idle="noop"), ElectionAgent(idle="noop"):
        agent.reset(road, [0], np.random.default_rng(1))
        type(agent).coordinate([agent], np.random.default_rng(1))
        near = scene_snapshot(road, (40.0, 8.0))
        agent.choose_action(near._replace(unseen=frozenset({"ego"})))
        assert not agent.behaviours[0].active
        agent.choose_action(near._replace(step=1, unseen=frozenset({"tester9"})))
        assert agent.behaviours[0].active


def test_each_elects_by_what_it_sees(
    straight_scene: Callable[..., Scene], scene_snapshot: Callable[..., Snapshot]
) -> None:
    """One who does not see the ego does not keep the other from crossing, and only one crosses."""
    road = straight_scene([(60.0, -5.15, 0.0), (62.0, -5.15, 0.0)])
    agents = [ElectionAgent(idle="noop") for _ in range(2)]
    for i, agent in enumerate(agents):
        agent.reset(road, [i], np.random.default_rng(1))
    ElectionAgent.coordinate(agents, np.random.default_rng(1))
    seen = scene_snapshot(road, (40.0, 8.0))
    blind = seen._replace(unseen=frozenset({"ego"}))
    alone = seen._replace(testers=(seen.testers[0]._replace(x=0.0), seen.testers[1]))
    agents[0].choose_action(blind)
    agents[1].choose_action(alone)
    assert [a.behaviours[0].active for a in agents] == [False, True]
    agents[0].choose_action(seen._replace(step=1))
    assert not agents[0].behaviours[0].active


def test_a_vehicle_keeps_no_distance_to_a_memory() -> None:
    """Who was seen ahead long ago and is unseen now does not stop it for ever."""
    cars = [BodyState(Body(f"tester{i}", CAR), 20.0 * i, 0.0, 5.0, 0.0) for i in range(2)]
    seen = Snapshot(0, 0.0, BodyState(EGO, -50.0, 0.0, 8.0, 0.0), 0.0, tuple(cars))
    course = Course(Path([(0.0, 0.0), (100.0, 0.0)]), CAR, 0.1, 9.0)
    assert course.room(cars[0], everybody(seen, cars[0])) < 15.0
    memory = seen._replace(unseen=frozenset({"tester1", "ego"}))
    assert list(everybody(memory, cars[0])) == []
    assert course.room(cars[0], everybody(memory, cars[0])) == math.inf


def test_the_time_gap_ego_copes_with_any_number_of_testers() -> None:
    """It brakes for those it sees, and drives on where it sees nobody."""
    ego = TimeGapEgo()
    ego.reset(scene())
    ahead = [(20.0, 0.0), (60.0, 5.0), (80.0, 5.0)]
    commands = [
        ego.act(observer(range_m=r).view(truth(i, testers=ahead)))
        for i, r in enumerate((5.0, 25.0))
    ]
    assert commands[0].value > 0.0 > commands[1].value  # type: ignore[union-attr]
