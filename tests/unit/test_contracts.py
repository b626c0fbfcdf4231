"""Our own egos, agents and assertions keep the contracts that users test theirs with."""

from __future__ import annotations

import dataclasses
import math
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, ClassVar

import pytest
from sites import encounters_once
from support import ROOT

from cavsumo.agents import AGENTS, Agent
from cavsumo.agents.base import NoopAgent
from cavsumo.agents.random import RandomAgent
from cavsumo.assertions import ASSERTIONS, Assertion
from cavsumo.assertions.base import UNFAIR, Judgement
from cavsumo.assertions.collision import CollisionAssertion
from cavsumo.assertions.contacts import Contact
from cavsumo.egos import EGOS, Acceleration, Command, Ego, make_ego
from cavsumo.egos.base import EGO_KIND, Mission
from cavsumo.egos.time_gap import TimeGapEgo
from cavsumo.errors import EgoError
from cavsumo.model.bodies import Action
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot
from cavsumo.testing import (
    AgentContract,
    AssertionContract,
    EgoContract,
    agent_checks,
    assertion_checks,
    ego_checks,
)
from cavsumo.testing.scripts import ground

NET = ROOT / "networks" / "pedestrians.net.xml"


@pytest.mark.parametrize("name", list(EGOS))
class TestOurEgos(EgoContract):
    """Every ego that is registered."""

    net = NET

    @pytest.fixture(autouse=True)
    def _named(self, name: str) -> None:
        self.name = name

    def make(self) -> Ego:
        return make_ego(self.name, {})


@pytest.mark.parametrize("name", list(AGENTS))
class TestOurAgents(AgentContract):
    """Every agent that is registered."""

    net = NET

    @pytest.fixture(autouse=True)
    def _named(self, name: str) -> None:
        self.name = name

    def make(self) -> Agent:
        return AGENTS.make(self.name, {})


@pytest.mark.parametrize("name", list(ASSERTIONS))
class TestOurAssertions(AssertionContract):
    """Every assertion that is registered."""

    net = NET

    @pytest.fixture(autouse=True)
    def _named(self, name: str) -> None:
        self.name = name

    def make(self) -> Assertion:
        return ASSERTIONS.make(self.name, {})


@pytest.fixture(scope="module", autouse=True)
def _encounters_once() -> Iterator[None]:
    """All assertions are shown the same encounters, which are made once."""
    with encounters_once():
        yield


# What breaks a contract is found by the check that is meant for it.


class Spoilt(TimeGapEgo):
    """An ego that remembers how often it was asked."""

    asked = 0

    def act(self, snapshot: Snapshot) -> Command:
        self.asked += 1
        return self.answer(snapshot, super().act(snapshot))

    def answer(self, snapshot: Snapshot, command: Command) -> Command:
        """What it says instead."""
        return command


class Forgetful(Spoilt):
    """Brakes at every hundredth question, whichever episode it is."""

    def answer(self, snapshot: Snapshot, command: Command) -> Command:
        return Acceleration(-1.0) if self.asked % 100 == 0 else command


class Parked(Spoilt):
    """Never drives."""

    def answer(self, snapshot: Snapshot, command: Command) -> Command:
        return Acceleration(-9.0)


class Wild(Spoilt):
    """Wants more than its engine has when there are many around."""

    def answer(self, snapshot: Snapshot, command: Command) -> Command:
        return Acceleration(10.0) if len(snapshot.raw_background) > 10 else command


class Tired(Spoilt):
    """Answers with a number that is none after five minutes."""

    def answer(self, snapshot: Snapshot, command: Command) -> Command:
        return Acceleration(math.nan) if snapshot.time > 300.0 else command


class Shared(Spoilt):
    """Counts with all others of its sort, and brakes at every third question."""

    all: ClassVar[list[int]] = [0]

    def reset(self, scene: Scene) -> None:
        super().reset(scene)
        self.all[0] = 0

    def answer(self, snapshot: Snapshot, command: Command) -> Command:
        self.all[0] += 1
        return Acceleration(-2.0) if self.all[0] % 3 == 0 else command


class Picky(Spoilt):
    """Reads names as numbers."""

    def answer(self, snapshot: Snapshot, command: Command) -> Command:
        for body in snapshot.background:
            int(body.id.removeprefix("other"))
        return command


class Stillborn(Spoilt):
    """Cannot start."""

    def prepare(self, mission: Mission) -> None:
        raise EgoError("no such stack")


@pytest.mark.parametrize(
    ("spoilt", "failing"),
    [
        (Spoilt, ""),
        (Forgetful, "reset twice, two at once"),
        (Parked, "empty road"),
        (Wild, "crowded road, reset twice, two at once"),
        (Tired, "long episode"),
        (Shared, "two at once"),
        (Picky, "odd numbers"),
        (Stillborn, ", ".join(ego_checks.CHECKS)),
    ],
)
def test_a_bad_ego_is_found_out(spoilt: type[Ego], failing: str) -> None:
    """By the checks that are meant for its fault, and by no other."""
    assert failures(ego_checks.CHECKS, spoilt) == failing


class Drawing(RandomAgent):
    """Draws from the generator that all share."""

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        random.random()
        return super().choose_action(snapshot)


class Single(NoopAgent):
    """Forgets its second body."""

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        return super().choose_action(snapshot)[:1]


class Strong(NoopAgent):
    """Runs faster than it can."""

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        return tuple(Action(5.0, 0.0) for _ in self.owned)


class Counting(NoopAgent):
    """Walks after fifty questions in its life, and does not recall how many there were."""

    learns = True
    asked = 0

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        self.asked += 1
        return tuple(Action(float(self.asked > 250), 0.0) for _ in self.owned)


class Peeping(NoopAgent):
    """Says that it does not look at the background, and does."""

    def choose_action(self, snapshot: Snapshot) -> tuple[Action, ...]:
        return tuple(Action(float(bool(snapshot.raw_background)), 0.0) for _ in self.owned)


@pytest.mark.parametrize(
    ("spoilt", "failing"),
    [
        (Drawing, "its own generator"),
        (Single, ", ".join(agent_checks.CHECKS)),
        (Strong, ", ".join(agent_checks.CHECKS)),
        (Counting, "repeatable, memory"),
        (Peeping, "sees what it says"),
    ],
)
def test_a_bad_agent_is_found_out(spoilt: type[Agent], failing: str) -> None:
    """By the checks that are meant for its fault."""
    assert failures(agent_checks.CHECKS, spoilt) == failing


class Fickle(CollisionAssertion):
    """Takes a verdict back."""

    def observe(self, snapshot: Snapshot, contacts: Sequence[Contact]) -> None:
        super().observe(snapshot, contacts)
        if self.decided and snapshot.time > 10.0:
            self.judgement = Judgement(self.name)


class Grudging(CollisionAssertion):
    """Does not forget."""

    grudge = False

    def observe(self, snapshot: Snapshot, contacts: Sequence[Contact]) -> None:
        super().observe(snapshot, contacts)
        self.grudge |= self.decided
        if self.grudge and not self.decided:
            self.judgement = Judgement(self.name, UNFAIR)


class Timeless(CollisionAssertion):
    """Says that it was violated, not when."""

    def observe(self, snapshot: Snapshot, contacts: Sequence[Contact]) -> None:
        super().observe(snapshot, contacts)
        self.judgement = dataclasses.replace(self.judgement, violation_time=None)


@pytest.mark.parametrize(
    ("spoilt", "failing"),
    [
        (Fickle, "encounters, reset forgets, sees what it says"),
        (Grudging, "reset forgets"),
        (Timeless, "encounters, reset forgets, sees what it says"),
    ],
)
def test_a_bad_assertion_is_found_out(spoilt: type[Assertion], failing: str) -> None:
    """By the checks that are meant for its fault."""
    assert failures(assertion_checks.CHECKS, spoilt) == failing


def failures(checks: Mapping[str, Any], make: Callable[[], Any]) -> str:
    """The names of the checks that something fails."""
    here, failed = ground(NET, EGO_KIND), []
    for name, check in checks.items():
        try:
            assert check(make, here), "a check says what it saw"
        except (AssertionError, EgoError, ValueError):
            failed.append(name)
    return ", ".join(failed)
