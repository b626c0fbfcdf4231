"""The background is read less often than it could be, and nobody can tell from the results."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from random import Random
from types import SimpleNamespace
from typing import Any

import libsumo
import pytest
from support import prepared_at

from cavsumo.agents.programmed import TimingAgent
from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import job
from cavsumo.egos.base import EGO_KIND
from cavsumo.errors import SimulationError
from cavsumo.model.bodies import PEDESTRIAN, Body
from cavsumo.model.geometry import gap
from cavsumo.model.scenario import BatchPlan
from cavsumo.model.snapshot import BodyState, RawState, Snapshot
from cavsumo.network.site import Site
from cavsumo.simulation.episode import Episode
from cavsumo.simulation.loop import play
from cavsumo.sumo.background import Background, Roaming, roaming

Staged = Callable[..., tuple[BatchPlan, Site]]
DT, TOP = 0.1, 20.0  # s, m/s


class Traffic:
    """Stands in for one of SUMO's domains: bodies 4 m long whose fronts are where the test says."""

    def __init__(self, fronts: dict[str, tuple[float, float]], stops: tuple[str, ...] = ()) -> None:
        self.fronts, self.stops, self.asked = fronts, stops, 0

    def getPosition(self, name: str) -> tuple[float, float]:
        self.asked += 1
        return self.fronts[name]

    def getStops(self, name: str, limit: int) -> tuple[str, ...]:
        return tuple(s for s in self.stops if s == name)

    def __getattr__(self, getter: str) -> Callable[[str], Any]:
        answers = {"getLength": 4.0, "getWidth": 2.0, "getMaxSpeed": TOP, "getAngle": 90.0}
        return lambda name: answers.get(getter, 0.0)


def watchers(x: float = 0.0) -> tuple[BodyState, ...]:
    """The ego at x on the axis and a tester 8 m beside it."""
    ego, tester = Body("ego", EGO_KIND), Body("tester0", PEDESTRIAN)
    return BodyState(ego, x, 0.0, 0.0, 0.0), BodyState(tester, x, 8.0, 0.0, 0.0)


def lookout(traffic: Traffic, network: Roaming | None) -> Background:
    """A background of these vehicles and of no persons."""
    return Background(traffic, Traffic({}), network, DT, watchers())


def touching(body: Body, front: tuple[float, float], ones: tuple[BodyState, ...]) -> bool:
    """Whether a body heading east touches anybody, by its box."""
    state = BodyState(body, front[0] - body.kind.length / 2, front[1], 0.0, 0.0)
    return any(gap(state.box, one.box) <= 0.0 for one in ones)


@pytest.mark.parametrize("seed", range(20))
def test_nobody_comes_within_touch_unseen(seed: int) -> None:
    """Bodies that move as far as the bound allows, most of them towards a moving ego."""
    random, network = Random(seed), Roaming(stretch=1.1, leap=1.0)
    stride = TOP * DT * network.stretch + network.leap
    fronts = {f"car{i}": (random.uniform(-90, 90), random.uniform(-90, 90)) for i in range(12)}
    traffic, x, met = Traffic(fronts), 0.0, 0
    background = lookout(traffic, network)
    for _ in range(200):
        x += random.choice((0.0, 1.0, 5.0, -3.0))
        for name, (fx, fy) in fronts.items():
            course = random.gauss(math.atan2(-fy, x - fx), 0.3) + random.choice((0.0, 0.0, 3.0))
            way = random.choice((0.0, 0.5, 1.0)) * stride
            fronts[name] = fx + way * math.cos(course), fy + way * math.sin(course)
        now = watchers(x)
        seen = {raw[0].id for raw in background.read(tuple(fronts), (), now)}
        for name, front in fronts.items():
            if touching(
                Body(name, dataclasses.replace(EGO_KIND, length=4.0, width=2.0)), front, now
            ):
                met += 1
                assert name in seen
    assert met
    assert traffic.asked < 200 * len(fronts)


def test_who_is_far_is_left_alone_and_who_is_near_is_not() -> None:
    """100 m at no more than 3 m a timestep: not before the 30th; within touch: always."""
    traffic = Traffic({"far": (100.0, 0.0), "near": (3.0, 0.0)})
    background = lookout(traffic, Roaming(leap=1.0))
    for _ in range(30):
        assert [raw[0].id for raw in background.read(("far", "near"), (), watchers())] == ["near"]
    assert traffic.asked == 1 + 30 * 2  # the near one's place is read twice


def test_everybody_is_read_when_somebody_wants_to_see_them() -> None:
    """Without a measured network nothing is left out."""
    traffic = Traffic({"far": (100.0, 0.0), "near": (3.0, 0.0)})
    background = lookout(traffic, None)
    for _ in range(3):
        assert len(background.read(("far", "near"), (), watchers())) == 2


def test_a_newcomer_is_noticed_at_once() -> None:
    """Whoever appears, appears in that timestep."""
    traffic = Traffic({"far": (900.0, 0.0), "new": (3.0, 0.0)})
    background = lookout(traffic, Roaming())
    assert background.read(("far",), (), watchers()) == ()
    assert [raw[0].id for raw in background.read(("far", "new"), (), watchers())] == ["new"]


def test_a_vehicle_that_means_to_stop_is_read_always() -> None:
    """Parking moves it aside by an unknown way, so no bound holds for it."""
    traffic = Traffic({"parker": (900.0, 0.0)}, stops=("parker",))
    background = lookout(traffic, Roaming())
    for _ in range(5):
        background.read(("parker",), (), watchers())
    assert traffic.asked == 5


def test_a_jump_that_no_bound_foresaw_is_said() -> None:
    """Rather an error than a contact that was overlooked."""
    traffic = Traffic({"car": (20.0, 0.0)})
    background = lookout(traffic, Roaming())
    background.read(("car",), (), watchers())
    traffic.fronts["car"] = (-200.0, 0.0)
    with pytest.raises(SimulationError, match="car jumped"):
        any(background.read(("car",), (), watchers()) for _ in range(20))


def episodes(staged: Staged, name: str, agent: str, **settings: Any) -> Iterator[Episode]:
    """A few episodes, each as it is played and as it is recorded."""
    plan, site = staged(name, agents=(agent,), routes="auto", **settings)
    with EpisodeRunner(prepared_at(plan, site)) as runner:
        for run in range(6):
            one = job(plan, run)
            for record in (False, True):
                yield play(runner.setup, runner.agents_of(one), one.seed, record=record)


@pytest.mark.parametrize(
    ("name", "agent", "settings"),
    [
        ("crossing", "timing", {}),
        ("crossing", "random", {"embodiment": "person"}),
        ("junction", "proximity", {"ego": "constant"}),
        ("junction", "q-learning", {"testers": 5}),
        ("pedestrians", "election", {}),
    ],
)
def test_an_episode_is_the_same_whoever_is_read(
    staged: Staged, name: str, agent: str, settings: dict[str, Any]
) -> None:
    """Recording reads everybody in every timestep; not a number of the episode depends on it."""
    for fast, full in zip(*[episodes(staged, name, agent, **settings)] * 2, strict=True):
        assert len(full.actions) in (full.steps, full.steps + 1)  # the ego may have arrived
        assert fast.contacts.ego_pairs == full.contacts.ego_pairs
        assert fast.contacts.tester_pairs == full.contacts.tester_pairs
        assert fast.contacts.min_gap == full.contacts.min_gap
        assert fast.criticality.extremes() == full.criticality.extremes()
        assert fast.naturalness.turning == full.naturalness.turning
        # Kept where it is recorded.
        full.frames, full.actions, full.departures = fast.frames, fast.actions, fast.departures
        full.contacts, full.criticality, full.naturalness = (
            fast.contacts,
            fast.criticality,
            fast.naturalness,
        )
        assert fast == full


@pytest.mark.parametrize("name", ["crossing", "junction", "pedestrians"])
def test_whoever_is_left_out_of_a_snapshot_touches_nobody(staged: Staged, name: str) -> None:
    """Every background body is read from SUMO beside the world; the boxes say who may be left."""
    plan, site = staged(name, routes="auto")
    skipped = 0
    with EpisodeRunner(prepared_at(plan, site)) as runner:
        world, one = runner.setup.world, job(plan, 0)
        inner = world._snapshot

        def checked() -> Snapshot:
            nonlocal skipped
            snapshot = inner()
            ones = (snapshot.ego, *snapshot.testers)
            all_of_them = Background(libsumo.vehicle, libsumo.person, None, DT, ones)
            shown = {raw[0].id: raw for raw in snapshot.raw_background}
            here = (libsumo.vehicle.getIDList(), libsumo.person.getIDList())
            for raw in all_of_them.read(*here, ones):
                skipped += raw[0].id not in shown
                assert shown.get(raw[0].id, raw) == raw
                assert raw[0].id in shown or _apart(raw, ones)
            return snapshot

        world._snapshot = checked  # type: ignore[method-assign]
        play(runner.setup, runner.agents_of(one), one.seed)
    assert skipped


def _apart(raw: RawState, ones: tuple[BodyState, ...]) -> bool:
    """Whether a body touches none of them."""
    return all(gap(BodyState(*raw).box, one.box) > 0.0 for one in ones)


def test_a_network_is_measured() -> None:
    """Two lanes that leave 3 m between them, one drawn twice as long as it is driven."""
    shapes = {"a_0": ((0.0, 0.0), (40.0, 0.0)), "b_0": ((40.0, 3.0), (60.0, 3.0))}
    shapes[":n_w0_0"] = ((0.0, 0.0), (500.0, 0.0))  # a walking area: its shape is an outline
    lane = SimpleNamespace(
        getIDList=lambda: tuple(shapes),
        getShape=shapes.__getitem__,
        getLength=lambda name: 20.0,
        getWidth=lambda name: 3.5,
        getLinks=lambda name: [("b_0", 0, 0, 0, "")] if name == "a_0" else [],
    )
    assert roaming(lane) == Roaming(stretch=2.0, leap=6.5, walkable=True)


class Looking(TimingAgent):
    """A timing agent that counts whom it sees."""

    sees_background = True
    seen = 0

    def choose_action(self, snapshot: Snapshot) -> Any:
        Looking.seen = max(Looking.seen, len(snapshot.background))
        return super().choose_action(snapshot)


def test_whoever_looks_sees_everybody(staged: Staged) -> None:
    """One agent that looks is enough for the whole background to be read."""
    plan, site = staged("crossing", routes="auto")
    with EpisodeRunner(prepared_at(plan, site)) as runner:
        play(runner.setup, [Looking() for _ in runner.setup.teams], 1)
    assert Looking.seen > 5
