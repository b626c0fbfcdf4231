"""Branches of an episode: the same bits by a fork and by a replay, and the episode stays itself."""

from __future__ import annotations

import dataclasses
import os
import random
import re
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from cavsumo.agents.base import AGENTS, Agent
from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import job
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.egos import make_ego
from cavsumo.egos.base import EGO_KIND, Acceleration, Command, Ego
from cavsumo.errors import BranchError
from cavsumo.model.bodies import NOOP, Action
from cavsumo.model.snapshot import Snapshot
from cavsumo.simulation.branching import Continuation, branch, branches
from cavsumo.simulation.episode import Episode
from cavsumo.simulation.loop import EpisodeLoop
from cavsumo.simulation.playback import played_back, recorded
from cavsumo.sumo import native

Begin = Callable[..., EpisodeLoop]
STEPS = 25  # of the episode before it is branched
CASES: dict[str, dict[str, Any]] = {
    "crossing": {"routes": "auto", "testers": 3, "agents": ["random"]},
    "junction": {"kind": "car", "testers": 2, "traffic": "20", "agents": ["timing"], "end": 12.0},
    "pedestrians": {
        "ego": "time-gap",
        "agents": ["random"],
        "ego_sensor": {"range_m": 30.0, "position_noise_m": 0.1},
        "routes": "auto",
    },
}


@pytest.fixture(autouse=True)
def _forks(monkeypatch: pytest.MonkeyPatch) -> None:
    """The threads of the tests' own machinery hold nothing."""
    monkeypatch.setattr("cavsumo.simulation.branching.can_fork", lambda: True)


@pytest.fixture
def begin(set_up: Callable[..., PreparedBatch]) -> Iterator[Begin]:
    """Call with a network's name and settings: the first episode after some timesteps."""
    opened: list[EpisodeRunner] = []

    def one(name: str, steps: int = STEPS, record: bool = False, **settings: Any) -> EpisodeLoop:
        if not opened:
            opened.append(EpisodeRunner(set_up(name, **{"testers": 1} | settings)))
        (runner,) = opened
        own = job(runner.plan, 0)
        loop = EpisodeLoop(runner.setup, runner.agents_of(own), own.seed, record=record)
        for _ in range(steps):
            loop.step()
        return loop

    yield one
    for runner in opened:
        runner.setup.close()


def content(found: Episode | BranchError) -> dict[str, Any]:
    """All of a record, for comparison."""
    assert isinstance(found, Episode), found
    monitors = {"contacts", "naturalness", "criticality"}
    fields = {f.name: getattr(found, f.name) for f in dataclasses.fields(found)}
    fields["sumo_collisions"] = sorted(found.sumo_collisions)  # a set has no order
    texts = {name: repr(value) for name, value in fields.items() if name not in monitors}
    return {name: re.sub(r" at 0x\w+", "", text) for name, text in texts.items()}


def to_the_end(loop: EpisodeLoop) -> Episode:
    """The record of an episode that is played to its end."""
    while not loop.over:
        loop.step()
    return loop.finished()


@pytest.mark.parametrize("name", CASES)
def test_branches_are_the_same_by_fork_and_by_replay(begin: Begin, name: str) -> None:
    """With others or the same; without a difference a branch is the rest of the episode itself."""
    told: dict[str, Any] = CASES[name]
    loop = begin(name, record=True, **told)
    teams = loop.setup.teams
    ways = [
        Continuation(record=True),
        Continuation(seed=7, record=True),
        Continuation(actions=[[[NOOP] * len(team) for team in teams]] * 20, record=True),
        Continuation([AGENTS.make("proximity", {}) for _ in teams], seed=8, record=True),
        Continuation(ego=make_ego("constant", {"speed": 3.0}), record=True, steps=40),
        Continuation(steps=3),
    ]
    forks = list(map(content, branches(loop, ways)))
    assert list(map(content, branches(loop, ways, fork=False))) == forks
    whole = content(to_the_end(loop))
    assert forks[0] == whole
    assert len({fork["frames"] for fork in forks}) == len(ways)
    assert content(to_the_end(begin(name, record=True, **told))) == whole


def test_without_record_only_the_totals_come_back(begin: Begin) -> None:
    """The same episode, without what takes long to send."""
    loop = begin("pedestrians")
    short = branch(loop, Continuation())
    long = branch(loop, Continuation(record=True))
    assert (short.frames, short.actions) == ([], [])
    assert len(long.frames) == long.steps + 1
    assert len(long.actions) - long.steps in (0, 1), (
        "the last one may be that in which the ego left"
    )
    assert (short.judgement, short.steps) == (long.judgement, long.steps)


@pytest.mark.parametrize("fork", [True, False])
def test_a_branch_is_played_back_like_any_episode(begin: Begin, fork: bool) -> None:
    """From its record, with the starts among the site's own; so a search can judge its failures."""
    loop = begin("pedestrians", record=True)
    found = branch(loop, Continuation([Agent()], record=True), fork=fork)
    assert found.starts is loop.placed.starts
    again = played_back(loop.setup, recorded(loop.setup, found, loop.scene.seed, None))
    assert content(again)["frames"] == content(found)["frames"]


def test_routes_that_are_read_piece_by_piece(begin: Begin, tmp_path: Path) -> None:
    """SUMO reads a megabyte of a demand at once; all read on independently."""
    cars = "".join(
        f'<vehicle id="v{t}" depart="{t}"><route edges="westbound"/></vehicle><!--{" " * 9999}-->\n'
        for t in range(0, 600, 3)
    )
    file = tmp_path / "long.rou.xml"
    file.write_text(f"<routes>{cars}</routes>", encoding="utf-8")
    settings: dict[str, Any] = {
        "routes": str(file),
        "step_length": 1.0,
        "end": 480.0,
        "ego": "constant",
        "ego_params": {"speed": 0.1},
        "agents": ["noop"],
    }
    loop = begin("pedestrians", steps=150, record=True, **settings)
    way = Continuation(record=True, steps=280)
    first, second = map(content, branches(loop, [way, way]))
    for _ in range(280):
        loop.step()
    assert first == second == content(loop.finished())
    assert "v429" in {raw[0].id for raw in loop.snapshot.raw_background}


class Failing(Agent):
    """One that fails in a certain way when it is asked."""

    sees_background = False

    def __init__(self, how: Callable[[], Any]) -> None:
        self.how = how

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        self.how()
        return (NOOP,)


def test_a_branch_that_fails_costs_nothing_but_itself(begin: Begin) -> None:
    """A crash, an error; the others and the episode are what they are without it."""
    loop = begin("pedestrians")

    def crash() -> None:
        os.kill(os.getpid(), signal.SIGSEGV)

    def divide() -> float:
        return 1 / 0

    ways = [Continuation([Failing(how)]) for how in (crash, divide, int)]
    died, raised, good = branches(loop, ways)
    assert str(died) == "a branch died of SIGSEGV"
    assert str(raised) == "defect: ZeroDivisionError('division by zero')"
    assert isinstance(good, Episode)
    (again,) = branches(loop, ways[1:2], fork=False)
    assert str(again) == str(raised)
    with pytest.raises(BranchError, match="gave no result"):
        branch(loop, Continuation([Failing(lambda: signal.pause())]), deadline=0.5)
    assert content(to_the_end(loop)) == content(to_the_end(begin("pedestrians")))


def test_numbers_that_users_draw_are_the_same_too(begin: Begin) -> None:
    """From the generator of Python, although a fork seeds it anew."""

    class Drawing(Agent):
        def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
            return (Action(0.0, random.uniform(-0.1, 0.1)),)

    loop = begin("pedestrians")
    way = Continuation([Drawing()], record=True, steps=9)
    before = random.getstate()
    assert content(branch(loop, way)) == content(branch(loop, way, fork=False))
    assert random.getstate() == before


def test_an_ego_sees_what_it_wants_to_see(begin: Begin) -> None:
    """SUMO's driver needs no background, so it is not read; another ego of a branch may need it."""

    class Counting(Ego):
        seen = 0

        def act(self, snapshot: Snapshot) -> Command:
            self.seen += len(snapshot.background)
            return Acceleration(0.0)

        def close(self) -> None:
            assert self.seen > 10, self.seen

    loop = begin("crossing", steps=0, agents=["noop"], routes="auto")
    assert not loop.snapshot.raw_background
    for fork in (True, False):
        branch(loop, Continuation(ego=Counting(), steps=30), fork=fork)


class Wide(Ego):
    """An ego with another box."""

    kind = dataclasses.replace(EGO_KIND, width=2.5)

    def act(self, snapshot: Snapshot) -> Command:
        return Acceleration(0.0)


REFUSED: list[tuple[Continuation, str]] = [
    (Continuation(ego=make_ego("exec:true", {})), "has one conversation"),
    (Continuation(ego=make_ego("sumo", {})), "cannot hand it over to SUMO"),
    (Continuation(ego=Wide()), "the box and limits"),
    (Continuation([]), "needs 1 agents, got 0"),
    (Continuation([Agent()], actions=[]), "either agents or actions"),
]


@pytest.mark.parametrize("fork", [True, False])
def test_what_cannot_be_branched_is_refused(begin: Begin, fork: bool) -> None:
    """In one sentence, before anything is played."""
    loop = begin("pedestrians")
    for how, sentence in REFUSED:
        with pytest.raises(BranchError, match=sentence) as refused:
            branch(loop, how, fork=fork)
        assert "\n" not in str(refused.value)
    loop.setup = dataclasses.replace(loop.setup, ego=make_ego("tcp:localhost:1", {}))
    with pytest.raises(BranchError, match="has one conversation"):
        branch(loop, Continuation(), fork=fork)


def test_an_episode_that_is_over_has_no_branches(begin: Begin) -> None:
    """Nothing can follow."""
    loop = begin("pedestrians")
    to_the_end(loop)
    with pytest.raises(BranchError, match="is over"):
        branch(loop, Continuation())


def test_an_episode_whose_simulation_another_has_is_refused(begin: Begin) -> None:
    """It would be a branch of the other one."""
    loop = begin("pedestrians")
    begin("pedestrians")
    with pytest.raises(BranchError, match="another episode has begun"):
        branch(loop, Continuation())


def test_an_ego_that_steers_itself_is_not_handed_to_one_that_does_not(begin: Begin) -> None:
    """SUMO would have to find its way back to a lane."""
    from test_avoidable import Steering

    loop = begin("pedestrians")
    loop.hand_over(ego=Steering())
    loop.step()
    with pytest.raises(BranchError, match="cannot be handed"):
        branch(loop, Continuation(ego=make_ego("constant", {"speed": 5.0})))


def test_another_libsumo_refuses_a_seed(begin: Begin, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where its functions have other names; without a seed it branches."""
    monkeypatch.setattr(native, "SEED_ALL", "other")
    loop = begin("pedestrians")
    with pytest.raises(BranchError, match="branch without a seed"):
        branch(loop, Continuation(seed=1))
    assert branch(loop, Continuation(steps=2)).steps == STEPS + 2
