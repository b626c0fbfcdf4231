"""The cast of a batch: resolved once from a plan, the same wherever it is taken."""

from __future__ import annotations

import pickle
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar

import pytest

from cavsumo.agents import AGENTS, Agent
from cavsumo.agents.casting import resolve_cast
from cavsumo.batch.prepared import prepare
from cavsumo.model.scenario import BatchPlan, plan_from


def planned(net: Path, agents: Sequence[str], **more: object) -> BatchPlan:
    """A plan on empty roads."""
    return plan_from({"net": net, "routes": "none", "agents": agents} | more, "test")


def test_a_member_holds_what_its_agent_declares(networks: dict[str, Path]) -> None:
    """Facts are read off an agent with the parameters of the plan."""
    agents = ("election", "again=q-learning", "expectiminimax")
    plan = planned(networks["pedestrians"], agents, params={"manoeuvre": "run"})
    election, learner, solver = resolve_cast(plan)
    assert (election.label, election.name) == ("election", "election")
    assert (election.params, election.manoeuvre, election.drives) == (
        {"manoeuvre": "run"},
        "run",
        True,
    )
    assert (learner.label, learner.name, learner.learns, learner.drives) == (
        "again",
        "q-learning",
        True,
        False,
    )
    assert (learner.params, learner.manoeuvre, learner.files) == ({}, "auto", ())
    assert (solver.promise, solver.learns) == ("egos of class constant", False)


def test_nobody_learns_where_it_is_said_what_they_know(networks: dict[str, Path]) -> None:
    """A plan with knowledge begins every episode with it."""
    plan = planned(networks["pedestrians"], ["q-learning"])
    assert resolve_cast(plan).learners == {"q-learning"}
    assert resolve_cast(plan.model_copy(update={"known": {}})).learners == set()


def test_there_is_an_agent_for_each_team(networks: dict[str, Path]) -> None:
    """Each is built anew, with the member's parameters."""
    plan = planned(
        networks["pedestrians"], ["timing"], testers=4, bodies_per_agent=2, params={"aim": 0.75}
    )
    cast = resolve_cast(plan)
    first, second = cast.agents("timing")
    assert first is not second
    assert {agent.aim for agent in (first, second)} == {0.75}  # type: ignore[attr-defined]


def test_a_cast_is_resolved_once_and_travels(
    networks: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """To prepare a batch builds an agent to be asked and one to be prepared, whatever reads it."""
    monkeypatch.setitem(AGENTS._entries, "counted", Counted)
    monkeypatch.setattr(AGENTS.names, "_others", {"counted"})
    monkeypatch.setattr(Counted, "built", 0)
    prepared = prepare(planned(networks["pedestrians"], ["counted"], kind="car"))
    assert Counted.built == 2
    again = pickle.loads(pickle.dumps(prepared)).cast
    assert again == prepared.cast
    assert Counted.built == 2
    assert len(again.agents("counted")) == 3
    assert Counted.built == 5


class Counted(Agent):
    """Counts how many of it are built."""

    PARAMETERS: ClassVar[Mapping[str, str]] = {}
    built: ClassVar[int] = 0

    def __init__(self) -> None:
        type(self).built += 1
